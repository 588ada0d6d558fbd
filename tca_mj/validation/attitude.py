"""What the bend of the 3D bending module is: which angle, and in which attitude.

Sun, Section 4.1.3, reads the bend from the *place* of the tip, eq. (4.1), and does not say how the
module was held. Place and tangent of one shape differ by up to twenty degrees, standing and
hanging by forty: a statement about the angle is one about both.

The verdict on the reported angles is by eq. (4.1), standing: see docs/studies.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from tca_mj.checks import Array, require_positive, within
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.sim import Simulation
from tca_mj.tca.embedding import CHANNEL_CONTACT

GRAVITY = 9.81  # [m/s²]
# Gravity in the module's frame, base at the origin, z along the cold module, TCA 1 on x [m/s²].
ATTITUDES: Mapping[str, tuple[float, float, float]] = MappingProxyType({
    "standing": (0.0, 0.0, -GRAVITY),
    "hanging": (0.0, 0.0, GRAVITY),
    "lying": (0.0, -GRAVITY, 0.0),
    "weightless": (0.0, 0.0, 0.0),
})  # fmt: skip
JUDGED = "standing"
TIME = 2.0  # of heating, Sun, Section 4.1.3 [s]
_SETTLING = 2.0  # in the attitude, before that [s]
_AIR = 0.026  # conductivity of air at 25 °C, a textbook's [W/(m K)]


class Bend(NamedTuple):
    """A bend of constant curvature, in radians.

    Attributes:
        angle: From 0 to π [rad].
        direction: Of the bend, from x towards y; 0 for a straight module [rad].
    """

    angle: float
    direction: float


def arc(bend: Bend, length: float) -> Array:
    """Tip of an arc of constant curvature, base at the origin along z, shape (3,) [m].

    L/θ (cos γ (1 - cos θ), sin γ (1 - cos θ), sin θ): Sun, Section 4.1.3, where γ is counted from
    y and the third component has a misprinted cosine, by which a straight module has no length.

    Args:
        bend: Angle θ and direction γ.
        length: Length L of the arc [m].
    """
    angle = bend.angle
    across = length * math.sin(angle / 2.0) * float(np.sinc(angle / (2.0 * math.pi)))
    along = length * float(np.sinc(angle / math.pi))
    return np.array([across * math.cos(bend.direction), across * math.sin(bend.direction), along])


def by_place(tip: ArrayLike, length: float) -> Bend:
    """Bend by the place of the tip alone: the arc of the given length whose tip is nearest.

    Minimises |p - p'| over angle (0 to π) and direction [Sun, eqs. (4.1), (4.2)]. Whatever the
    angle, the best direction is that of the tip, so that a search over the angle is left. Every
    direction is allowed; the published range is a quarter of the circle.

    Args:
        tip: Place of the tip p', base at the origin and along z, shape (3,) [m].
        length: Length of the module [m].

    Raises:
        ValueError: If the place is not three finite numbers or the length not positive.
    """
    x, y, z = within("tip", tip, shape=(3,))
    require_positive(length=length)
    aside = math.hypot(x, y)
    direction = math.atan2(y, x) if aside > 0.0 else 0.0

    def square(angle: float) -> float:
        near = arc(Bend(angle, 0.0), length)
        return ((near[0] - aside) ** 2 + (near[2] - z) ** 2) / length**2

    grid = np.linspace(0.0, math.pi, 181)
    best = int(np.argmin([square(angle) for angle in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, 180)]
    found = minimize_scalar(square, bounds=(low, high), method="bounded",
                            options={"xatol": 1e-10})  # fmt: skip
    ends = [(square(angle), angle) for angle in (found.x, low, high)]
    return Bend(float(min(ends)[1]), direction)


class Bent(NamedTuple):
    """The module after 2 s of power in an attitude, angles in degrees.

    Attributes:
        cold: Bend by place before, at rest in that attitude [°].
        tangent: Angle between the tip's axis and the base's [°].
        place: Bend by place [°].
        direction: Of the tip's place, from TCA 1 towards TCA 2 [°].
        leaning: Direction of the tip's axis, from TCA 1 towards TCA 2 [°].
        temperature: Temperatures of the three TCAs, shape (3,) [°C].
        line: Places along the module, base to tip, shape (k, 3) [m].
    """

    cold: float
    tangent: float
    place: float
    direction: float
    leaning: float
    temperature: Array
    line: Array


def bent(
    attitude: str, power: tuple[float, float], *, contact: float = CHANNEL_CONTACT,
    weight: float = BendingSpec().diameter,
) -> Bent:  # fmt: skip
    """Rests in an attitude, then heats TCAs 1 and 2 for 2 s from the cold.

    Args:
        attitude: A key of ``ATTITUDES``.
        power: Power of TCAs 1 and 2 [W].
        contact: Between a TCA and the wall of its channel, per length [W/(m K)].
        weight: Diameter of the silicone that has weight; its stiffness stays [m].

    Raises:
        ValueError: If there is no such attitude.
        SimulationDiverged: As ``Simulation.step``.
    """
    if attitude not in ATTITUDES:
        raise ValueError(f"attitude must be one of {sorted(ATTITUDES)}, got {attitude!r}")
    spec = BendingSpec()
    part = bending_module(spec)
    part.spec.option.gravity = list(ATTITUDES[attitude])
    if weight != spec.diameter:
        silicone = spec.body.mass * ((weight / spec.diameter) ** 2 - 1.0)
        pieces = [geom for geom in part.spec.geoms if geom.mass > 0.0]
        whole = sum(geom.mass for geom in pieces)
        for geom in pieces:
            geom.mass += silicone * geom.mass / whole
    sim = Simulation(part, timestep=5e-3)
    if contact != CHANNEL_CONTACT:
        through = conductance(contact) * spec.length
        sim.bank.heat = replace(sim.bank.heat, conductance=np.full(sim.n, through))
    tip = sim.data.site(part.sites["tip"])
    sim.data.qvel[:] = 1e-6  # what balances on its tip falls
    sim.step(np.zeros(sim.n), _SETTLING)
    cold = by_place(tip.xpos, spec.length)
    sim.keep(np.full(sim.n, 25.0))
    sim.step([*power, 0.0], TIME)
    axis = tip.xmat.reshape(3, 3)[:, 2]
    now = by_place(tip.xpos, spec.length)
    bodies = [i for i in range(sim.model.nbody) if "body" in sim.model.body(i).name]
    return Bent(
        cold=math.degrees(cold.angle),
        tangent=math.degrees(math.acos(max(-1.0, min(1.0, axis[2])))),
        place=math.degrees(now.angle), direction=math.degrees(now.direction),
        leaning=math.degrees(math.atan2(axis[1], axis[0])),
        temperature=sim.temperature.copy(),
        line=np.vstack([sim.data.xpos[bodies], tip.xpos]),
    )  # fmt: skip


def conductance(contact: float) -> float:
    """Between a TCA of the module and its silicone for a contact, both per length [W/(m K)]."""
    body = BendingSpec().embedded.body
    assert body is not None
    silicone = 1.0 / body.conductance - 1.0 / CHANNEL_CONTACT
    return 1.0 / (1.0 / contact + silicone)


def contact_for(attitude: str) -> float:
    """Contact with which 2 W and 0.4 W bend by 120°, by place [W/(m K)]."""
    return float(brentq(lambda contact: bent(attitude, (2.0, 0.4), contact=contact).place - 120.0,
                        0.1, 0.6, xtol=1e-3))  # fmt: skip


def in_free_air() -> float:
    """What the module's TCA loses in free air, per natural length [W/(m K)]."""
    tca = BendingSpec().tca
    return float(tca.heat.loss) / tca.rest_length


def ring_of_air(width: float) -> float:
    """What still air in a channel conducts, the TCA in its middle, per length [W/(m K)].

    Args:
        width: Diameter of the channel [m].
    """
    return 2.0 * math.pi * _AIR / math.log(width / (2.0 * BendingSpec().tca.outer_radius))


def slenderness(weight: float = BendingSpec().diameter) -> float:
    """q L³/EI of the silicone, ``weight`` as in ``bent``: beyond 7.84 it cannot stand [1]."""
    body = BendingSpec().body
    load = body.mass / body.length * (weight / BendingSpec().diameter) ** 2 * GRAVITY
    return load * body.length**3 / body.bending[0]

"""A built module at rest: its TCAs at temperatures, loads on its tips.

``settle`` puts a single beam to rest. Here it is the whole part that users run, with its default
nodes, connectors and masses, in two ways. ``rest`` finds the state at rest of any part: damped
steps lead to its neighbourhood, Newton's method on the joints' loads ends them. ``run`` is what a
user does: a ``Simulation`` is heated from the cold and left alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array
from tca_mj.model.at_rest import NotSettledError
from tca_mj.model.mujoco_warnings import count_warnings
from tca_mj.model.part import Part
from tca_mj.model.smooth import SmoothBody
from tca_mj.sim import Simulation

_TIMESTEP = 20e-3  # pseudo-time between two looks at the loads [s]
_DAMPING = (2.0, 8.0, 32.0)  # damping times of the joints over it, tried one after the other
_STEPS = 150  # steps over damping before Newton's method takes over
_NEAR = 1e-4  # left in a joint where it takes over: angle, or stretch over the cell
_TOLERANCE = 1e-9  # the same where it ends
_ITERATIONS = 12
_PERTURBATION = 1e-6  # of a joint, in the same unit, for the derivative of the loads

_HEATING, _LONGEST = 2.0, 20.0  # a run: seconds until all is hot, and until it is given up
_QUIET = 3e-5  # velocity of the joints at rest [rad/s]


Law: TypeAlias = Callable[[ArrayLike], tuple[Array, Array]]
"""Tension [N] and slope [N/m] over length [m], as ``tca_mj.tca.law_at`` gives it."""


class Touching(ValueError):
    """A part at rest touches something, of which the theory of rods knows nothing."""

    def __init__(self, part: str, one: str, other: str) -> None:
        super().__init__(
            f"part must touch nothing at rest, {part!r} has the geom {one} on the geom {other}"
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Load:
    """What acts on a part besides its TCAs.

    Attributes:
        force: Force on each of the t tips, in the world of the specification, shape (t, 3) [N].
        moment: Moments on them, shape (t, 3) [N m].
        gravity: Acceleration of gravity in the same frame, shape (3,) [m/s²].
    """

    force: Array
    moment: Array
    gravity: Array


class Rest(NamedTuple):
    """A part at rest.

    Attributes:
        position: Places of the tips in the same frame, shape (t, 3) [m].
        rotation: Their frames, columns x, y, z, shape (t, 3, 3) [1].
        length: Lengths of the TCAs along their routes, shape (n,) [m].
        tension: Their tensions, shape (n,) [N].
    """

    position: Array
    rotation: Array
    length: Array
    tension: Array


def rest(
    part: Part, tips: Sequence[str], laws: Sequence[Law], load: Load, *,
    start: Mapping[str, float] | None = None,
) -> Rest:  # fmt: skip
    """Rest of a part whose TCAs follow laws.

    A body that buckles has several. Found is the one to which it sinks from the unloaded shape,
    or, with ``start``, the one next to there.

    Args:
        part: The part, all of whose joints belong to cells that TCAs cross; its base is held.
        tips: Names of the t sites that are loaded and looked at.
        laws: Laws of its n TCAs.
        load: Loads.
        start: Positions of the joints to begin with, by name.

    Raises:
        NotSettledError: If no rest is found, or one that is not stable.
        Touching: If it touches something there.
    """
    body = _Body(part, tips, laws, load)
    if start is not None:
        return body.newton(body.positions(start))
    best = np.inf
    for damping in _DAMPING:
        try:
            return body.newton(body.approach(damping))
        except NotSettledError as error:
            best = min(best, error.residual)
    raise NotSettledError(best)


def run(
    part: Part, tips: Sequence[str], temperature: Array, load: Load, *,
    timestep: float | None = None,
) -> tuple[Rest, float]:  # fmt: skip
    """What a user sees: a simulation with its own settings, heated in two seconds and left alone.

    Args:
        part: The part.
        tips: Names of the t sites that are loaded and looked at.
        temperature: Temperatures of its n TCAs, shape (n,) [°C].
        load: Loads, there from the start.
        timestep: Another time step than the simulation's own [s].

    Returns:
        The state in the end, and the largest velocity of a joint that is left [rad/s].
    """
    _hold(part, tips, load)
    sim = Simulation(part) if timestep is None else Simulation(part, timestep=timestep)
    hands = [sim.model.body(_hand(tip)).id for tip in tips]
    sim.data.xfrc_applied[hands] = np.hstack([load.force, load.moment])
    left = sim.rest(temperature, warming=_HEATING, longest=_LONGEST, quiet=_QUIET)
    mujoco.mj_forward(sim.model, sim.data)
    return Rest(*_place(sim.data, hands), sim.length, np.maximum(sim.tension - 1e-9, 0.0)), left


def _place(data: mujoco.MjData, bodies: Sequence[int]) -> tuple[Array, Array]:
    """Places and frames of bodies."""
    return data.xpos[bodies].copy(), data.xmat[bodies].reshape(-1, 3, 3).copy()


def _hand(tip: str) -> str:
    return f"{tip}.load"


def _hold(part: Part, tips: Sequence[str], load: Load) -> None:
    """Gravity, and massless bodies at the tips: MuJoCo loads bodies at their centres of mass."""
    part.spec.option.gravity = load.gravity
    for tip in tips:
        site = part.spec.site(tip)
        hand = site.parent.add_body(name=_hand(tip), pos=site.pos)
        hand.ipos = [0.0, 0.0, 0.0]


class _Body:
    """The compiled part under loads."""

    def __init__(
        self, part: Part, tips: Sequence[str], laws: Sequence[Law], load: Load
    ) -> None:
        _hold(part, tips, load)
        part.spec.option.timestep = _TIMESTEP
        # Rest is the same by any integrator; the way there wants the one with implicit springs.
        part.spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
        count_warnings()
        self._name = part.spec.modelname
        self.model: mujoco.MjModel = part.spec.compile()
        self.data = mujoco.MjData(self.model)
        self._laws: dict[Law, list[int]] = {}  # which TCAs follow each
        for i, law in enumerate(laws):
            self._laws.setdefault(law, []).append(i)
        self._hands = [self.model.body(_hand(tip)).id for tip in tips]
        self._actuator = [self.model.actuator(tca.name).id for tca in part.tcas]
        self._tendon = [self.model.tendon(tca.name).id for tca in part.tcas]
        self._stiffness = self.model.jnt_stiffness.copy()
        self._body = SmoothBody(self.model, part.tcas)
        self._start = self.model.qpos_spring.copy()
        path = np.array([tca.path_length for tca in part.tcas])
        self._more = path - self._body.at(self._start).length
        slide = self.model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)
        cell = min(crossing.cell for tca in part.tcas for crossing in tca.crossings)
        self._scale = np.where(slide, cell, 1.0)
        self.data.xfrc_applied[self._hands] = np.hstack([load.force, load.moment])

    def left(self, q: Array, pulled: tuple[Array, Array] | None = None) -> Array:
        """What is left of the loads on the joints over their stiffness and scale, shape (nv,).

        Args:
            q: Positions of the joints.
            pulled: What ``_pull`` gives for them; None to compute it.
        """
        model, data = self.model, self.data
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_fwdPosition(model, data)
        strained = self._body.at(q)
        tension, slope = pulled or self._pull(strained.length + self._more)
        bias = model.actuator_biasprm
        bias[self._actuator, 0] = -tension + slope * data.ten_length[self._tendon]
        bias[self._actuator, 1] = -slope
        self._body.support(data, strained, tension)
        mujoco.mj_forward(model, data)
        return data.qfrc_smooth / (self._stiffness * self._scale)

    def _slope(self, q: Array, left: Array) -> Array:
        """Derivative of what is left by the positions, by differences."""
        slope, step = np.empty((len(q), len(q))), _PERTURBATION * self._scale
        moved = q + np.diag(step)
        pulled = self._pull(self._body.at(moved).length + self._more)
        for i, (one, *pull) in enumerate(zip(moved, *pulled, strict=True)):
            slope[:, i] = (self.left(one, (pull[0], pull[1])) - left) / step[i]
        return slope

    def _stable(self, slope: Array) -> bool:
        """Whether the energy has a minimum and no saddle."""
        root = np.sqrt(self._stiffness)
        curving = -slope * (root * self._scale)[:, None] / root
        return bool(np.linalg.eigvalsh(0.5 * (curving + curving.T)).min() > 0.0)

    def _pull(self, length: Array) -> tuple[Array, Array]:
        """Tensions and their slopes at lengths, shape (..., n) each."""
        tension, slope = np.empty((2, *length.shape))
        for law, mine in self._laws.items():
            tension[..., mine], slope[..., mine] = law(length[..., mine])
        return tension, slope

    def _require_apart(self) -> None:
        """Raises ``Touching`` where something is touched."""
        model, data = self.model, self.data
        for contact in data.contact[: data.ncon]:
            sides = []
            for geom in (model.geom(int(number)) for number in contact.geom):
                body = model.body(int(geom.bodyid[0])).name
                sides.append(f"{geom.name or geom.id!r} of the body {body!r}")
            raise Touching(self._name, *sides)

    def positions(self, start: Mapping[str, float]) -> Array:
        """The joints' positions from those by name."""
        q = self._start.copy()
        known = {self.model.joint(i).name for i in range(self.model.njnt)}
        for name in known.intersection(start):  # without motions that a chain leaves out
            q[self.model.joint(name).qposadr] = start[name]
        return q

    def approach(self, damping: float) -> Array:
        """Positions of the joints after damped steps from the unloaded shape."""
        model, data = self.model, self.data
        model.dof_damping[:] = damping * _TIMESTEP * self._stiffness
        data.qacc_warmstart[:] = 0.0
        q = self._start.copy()
        for _ in range(round(_STEPS * damping)):
            left = np.abs(self.left(q)).max()
            if left < _NEAR:
                break
            if not np.isfinite(left) or any(warning.number for warning in data.warning):
                raise NotSettledError(np.inf)
            mujoco.mj_step(model, data)
            q = data.qpos.copy()
        return q

    def newton(self, q: Array) -> Rest:
        """Rest near positions of the joints, by Newton's method."""
        left = self.left(q)
        slope = self._slope(q, left)
        for _ in range(_ITERATIONS):
            if not np.isfinite(left).all() or np.abs(left).max() < _TOLERANCE:
                break
            slope = self._slope(q, left)
            step = np.linalg.solve(slope, -left)
            share = min(1.0, 0.3 / float(np.abs(step / self._scale).max()))
            q = q + share * step
            left = self.left(q)
        worst = float(np.abs(left).max())
        if not worst < _TOLERANCE or not self._stable(slope):
            raise NotSettledError(worst)
        self._require_apart()
        length = self._body.at(q).length + self._more
        return Rest(*_place(self.data, self._hands), length, self._pull(length)[0])

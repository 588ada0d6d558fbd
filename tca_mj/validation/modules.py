"""Facts about the modules and the arm (Sun, Sections 4.1 to 4.3 and 5.3.1).

One of them, the bend by 120°, fixed the contact of a TCA in its channel. What else is known of
angles, openings and warming is judged with it.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from tca_mj.model.part import Part
from tca_mj.modules.bending import BendingSpec
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.rod import RodShape, solve_static
from tca_mj.routes import parallel
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, HeatStep, law_at
from tca_mj.validation.attitude import JUDGED, bent, contact_for, in_free_air
from tca_mj.validation.bistable import findings as bistable_forces
from tca_mj.validation.facts import Finding, finding, words
from tca_mj.validation.heat import SILICONE
from tca_mj.validation.replay import PRINTED, Course, loaded_arm

DEVIATION = 4.49  # largest standard deviation of Fig. 4.4d [deg]
INITIAL = 10.0  # largest error at the start, Section 4.1.3 [deg]
CUT = 6.7  # resistance of a TCA of 100 mm, Sun, Table 2.3 [ohm]
HOTTEST = 45.3  # of the bistable gripper's surface, Sun, Section 4.3.4 [°C]
_ROOM = 25.0  # [°C]


def findings(*, full: bool = True) -> list[Finding]:
    """All of them, in about 20 s; without ``full`` those that take a moment."""
    return [
        *bending(full=full), *rods(), *wrist(), *gripper(), *finger(), *bistable(),
        *bistable_forces(full=full), *weight(), *(arm() if full else ()),
    ]  # fmt: skip


def bending(*, full: bool = True) -> list[Finding]:
    """Angle and direction of the 3D bending module (Section 4.1.3).

    Args:
        full: Whether to say which contact a hanging module would need, which takes seconds.
    """
    large, small = bent(JUDGED, (2.0, 0.4)), bent(JUDGED, (1.0, 0.2))
    error, apart = 100.0 * (INITIAL + 4.5) / 50.0, large.direction - small.direction
    hanging = ""
    if full:
        hanging = words("hanging", contact=contact_for("hanging"), free=in_free_air())
    return [
        finding("bend-large", large.place, tangent=large.tangent, initial=INITIAL,
                lying=bent("lying", (1.0, 0.2)).cold, hanging=hanging),
        finding("bend-small", small.place, low=50.0 * (1.0 - error / 100.0),
                high=50.0 * (1.0 + error / 100.0), error=error, initial=INITIAL,
                ratio=large.place / small.place),
        finding("bend-direction", apart, abs(apart) < DEVIATION, deviation=DEVIATION, large=large,
                small=small),
    ]  # fmt: skip


def rods() -> list[Finding]:
    """What the TCAs of the bending module do to each other (Section 5.3.1), by rod theory."""
    spec = BendingSpec()
    routes, tca = parallel(3, spec.offset), CATALOGUE["free-stroke"]

    def bend(first: bool) -> float:
        hot = law_at(tca, 100.0)
        cold = law_at(tca, _ROOM) if first else 0.0
        shape = solve_static(spec.body, routes, [cold, hot, hot])
        assert shape.strain is not None
        return float(np.trapezoid(np.hypot(*shape.strain[:, :2].T), shape.arc_length))

    def pushed(temperature: float) -> float:
        laws = [law_at(tca, temperature)] * 3
        return 1e3 * float(solve_static(spec.body, routes, laws, tip_force=(5e-3, 0, 0)).tip[0])

    larger = 100.0 * (bend(False) / bend(True) - 1.0)
    soft, stiff = pushed(75.0), pushed(125.0)
    return [finding("without-passive", larger, larger > 0.0),
            finding("pushed-aside", stiff / soft, stiff < soft, stiff=stiff,
                    soft=soft)]  # fmt: skip


def _weightless(part: Part) -> tuple[Simulation, list[Any]]:
    """A part without its weight, and the sites at its tips."""
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part)
    return sim, [sim.data.site(site) for name, site in part.sites.items() if "tip" in name]


def turned(power: float, spec: TwistingSpec) -> float:
    """Turn of a twisting module alone after 2 s of power, no weight [deg]."""
    (sim, (tip,)), angles = _weightless(twisting_module(spec)), [0.0]
    for _ in range(20):
        sim.step([power], 0.1)
        r = tip.xmat.reshape(3, 3)
        angles.append(math.atan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]))
    return abs(math.degrees(float(np.unwrap(angles)[-1])))


def wrist() -> list[Finding]:
    """Turn of the wrist (Sections 4.1.2 and 4.1.4): nothing is fitted to it."""
    printed = {14.0: 45.0, 16.0: 58.0, 28.0: 180.0}
    angles = {power: turned(power, TwistingSpec()) for power in printed}
    single = turned(28.0, TwistingSpec(double=False, nodes=20))
    exponent = math.log(angles[28.0] / angles[14.0]) / math.log(2.0)
    per = ", ".join(f"{1e3 * angle / power**2:.0f}" for power, angle in printed.items())
    least = 0.85 * printed[28.0] / angles[28.0]
    most = min(1.15 * printed[p] / angles[p] for p in (14.0, 16.0))
    factor = f" {words('wrist-factor', least=least, most=most)}" if least < most else ""
    return [
        *(finding("wrist", angles[power], section="4.1.4" if power < 20.0 else "4.1.2",
                  power=power, angle=angle, low=0.85 * angle, high=1.15 * angle, per=per,
                  exponent=exponent, factor=factor) for power, angle in printed.items()),
        finding("double-helix", angles[28.0] / single, angles[28.0] > single, double=angles[28.0],
                single=single),
    ]  # fmt: skip


class Opening(NamedTuple):
    """The gripper after 2 s of power, and half a second later.

    Attributes:
        wide: Distance of the finger tips [mm].
        later: The same 0.5 s later, without power [mm].
        temperature: Of its TCA after 2 s [°C].
    """

    wide: float
    later: float
    temperature: float


def opened(power: float) -> Opening:
    """Heats the gripper for 2 s, no weight."""
    sim, (one, other) = _weightless(finger_pair())

    def wide() -> float:
        return 1e3 * float(np.linalg.norm(other.xpos - one.xpos))

    sim.step([power], 2.0)
    first, hot = wide(), float(sim.temperature[0])
    sim.step([0.0], 0.5)
    return Opening(first, wide(), hot)


def gripper() -> list[Finding]:
    """Opening, closing and force of the gripper (Section 4.1.1)."""
    spec = FingerPairSpec()
    found = [opened(power) for power in (2.0, 4.0, 6.0, 8.0, 10.0)]
    wide = np.array([one.wide for one in found])
    length = finger_pair(spec).tcas[0].spec.rest_length / 2.0
    half = spec.embedded.of_length(length)

    def still(temperature: float) -> float:
        return _wide(solve_static(spec.body, [spec.route], [law_at(half, temperature)]))

    last = found[-1]
    lost = 100.0 * (1.0 - last.later / last.wide)
    slow = _ROOM + (last.temperature - _ROOM) * math.exp(-0.5 / 5.0)
    single = 100.0 * (1.0 - still(slow) / still(last.temperature))
    forces = np.linspace(0.0, 0.1, 11)
    cold = [law_at(half, _ROOM)]
    pulled = np.array([
        _wide(solve_static(spec.body, [spec.route], cold, tip_force=(0, 0, f))) for f in forces
    ])  # fmt: skip
    slope = float(pulled @ forces / (pulled @ pulled))
    bow = 100.0 * float(np.abs(forces - slope * pulled).max() / forces.max())
    faster = bool(wide[0] > 0.0 and (np.diff(wide, prepend=0.0) > 0.0).all()
                  and (np.diff(wide, 2, prepend=0.0) > 0.0).all())  # fmt: skip
    return [
        finding("gripper-opening", float(wide[-1]), faster,
                listed=", ".join(f"{w:.1f}" for w in wide)),
        finding("gripper-force", bow, bow < 5.0, most=pulled[-1]),
        finding("gripper-closing", lost, lost > single, last=last, single=single),
    ]  # fmt: skip


def _wide(shape: RodShape) -> float:
    """Distance between the tips by theory: a finger's base points sideways [mm]."""
    return 2e3 * float(shape.tip[2])


def finger() -> list[Finding]:
    """How much slower the body of a finger is than its TCAs (Section 4.2.2)."""
    heat = BendingSpec().embedded.heat
    fast, slow = float(heat.time_constant), float(heat.body_capacity / heat.body_loss)
    return [finding("finger-body", slow / fast, slow > 20.0 * fast, fast=fast, slow=slow)]


def bistable() -> list[Finding]:
    """How warm the bistable gripper gets (Section 4.3.4): its heat alone.

    A finger with two TCAs of 100 mm. One gets 1.5 A for 0.8 s and closes, the other one then for
    1.5 s and opens.
    """
    tca = CATALOGUE["free-stroke"].of_length(0.100)
    heat, power = replace(tca, body=SILICONE).heat, np.array(1.5**2 * CUT)
    cold, off = np.array(_ROOM), np.array(0.0)
    shut, long = HeatStep.of(heat, 0.8), HeatStep.of(heat, 1.5)
    closer, closer_body, _ = shut.advance(cold, cold, power)
    _, closer_body, _ = long.advance(closer, closer_body, off)
    opener, opener_body, _ = long.advance(cold, cold, power)
    mean, hot = 0.5 * float(closer_body + opener_body), float(opener)
    return [finding("bistable", mean, _ROOM < mean < HOTTEST < hot, hottest=HOTTEST, tca=hot,
                    power=float(power))]  # fmt: skip


def weight() -> list[Finding]:
    """What the arm weighs (Section 4.1.4)."""
    sim, spec = loaded_arm(mass=0.0), BendingSpec()
    grams = 1e3 * float(sim.model.body_mass.sum() - sim.model.body("base").mass[0])
    wider = 1e3 * spec.body.mass * ((spec.outer_diameter / spec.diameter) ** 2 - 1.0)
    return [finding("arm-weight", grams, wider=wider)]


def arm() -> list[Finding]:
    """Bend of the hanging arm with gripper, wrist and an object of 1 g (Section 4.1.4)."""
    rows = []
    for powers in PRINTED.values():
        sim, course = loaded_arm(timestep=1e-2, tca_period=5e-2), Course()
        for _ in range(60):
            sim.step([*powers.bend, 0.0, 0.0, 0.0], 1.0)
            course.sample(sim, "bend")
        bend, astray = np.array(course.bend), np.array(course.astray)
        above, off = np.flatnonzero(bend > 30.0), np.flatnonzero(astray > 20.0)
        passes = leaves = ""
        if above.size:
            i = int(above[0])
            passes = " " + words("arm-passes", time=course.time[i], place=course.place[i],
                                 hot=course.temperature[i].max(),
                                 body=course.body[i].max())  # fmt: skip
        if off.size:
            leaves = " " + words("arm-leaves", time=course.time[int(off[0])])
        rows.append(finding("loaded-arm", float(bend.max()), bend=powers.bend, passes=passes,
                            leaves=leaves))  # fmt: skip
    return rows

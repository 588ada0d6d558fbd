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
from tca_mj.validation.facts import Finding, check, fitted, trend
from tca_mj.validation.heat import finger_body
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
        *weight(), *(arm() if full else ()),
    ]  # fmt: skip


def bending(*, full: bool = True) -> list[Finding]:
    """Angle and direction of the 3D bending module (Section 4.1.3).

    Args:
        full: Whether to say which contact a hanging module would need, which takes seconds.
    """
    source = "Section 4.1.3"
    large, small = bent(JUDGED, (2.0, 0.4)), bent(JUDGED, (1.0, 0.2))
    error = 100.0 * (INITIAL + 4.5) / 50.0
    lying = bent("lying", (1.0, 0.2)).cold
    choice = (
        "`CHANNEL_CONTACT`. By the place of the tip, as in eq. (4.1), standing; by its tangent"
        f" {large.tangent:.0f}°. The attitude is not printed: lying, the cold module hangs to the"
        f" side by {lying:.0f}° (at most {INITIAL:.0f}° reported)"
    )
    if full:
        choice += (
            f"; hanging, the contact would have to be {contact_for('hanging'):.2f} W/(m K), less"
            f" than the {in_free_air():.2f} that the same TCA loses in free air"
        )
    return [
        fitted(source, "bends by 2 W + 0.4 W for 2 s", "about 120°", f"{large.place:.0f}°",
               f"{choice}.", value=large.place),
        check(source, "bends by 1 W + 0.2 W for 2 s", "about 50°", small.place,
              50.0 * (1.0 - error / 100.0), 50.0 * (1.0 + error / 100.0), "°",
              note=f"By eq. (4.1), standing; {error:.0f} % are {INITIAL:.0f}° of error at the start"
              f" and 4.5° of deviation. The two bends stand {large.place / small.place:.1f} to 1"
              " (2.4 to 1 reported)."),
        trend(source, "direction at P1/P2 = 5", "depends on the ratio, not on the size",
              f"within {DEVIATION}° of each other",
              f"{large.direction:.1f}° at 2 W, {small.direction:.1f}° at 1 W",
              abs(large.direction - small.direction) < DEVIATION,
              note="From TCA 1 towards TCA 2. What else the angle is counted from is not printed.",
              value=large.direction - small.direction),
    ]  # fmt: skip


def rods() -> list[Finding]:
    """What the TCAs of the bending module do to each other (Section 5.3.1), by rod theory."""
    spec, source = BendingSpec(), "Section 5.3.1"
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
    return [
        trend(source, "bend without the passive TCA", "more than 40 % larger", "larger",
              f"{larger:.0f} % larger", larger > 0.0, value=larger,
              note="TCAs 2 and 3 at 100 °C. How much larger follows from the stiffness of a cold"
              " TCA; the printed one gives 1 %."),
        trend(source, "pushed aside by 5 mN, TCAs at 125 and at 75 °C", "much less when hotter",
              "less when hotter", f"{stiff:.1f} and {soft:.1f} mm", stiff < soft,
              value=stiff / soft),
    ]  # fmt: skip


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
    reason = (
        f"The printed angles are quadratic in power ({per} mdeg/W²), those of the model grow with"
        f" its power {exponent:.2f}: temperature is linear in power, and untwist and expansion grow"
        " by less than its square. So no factor meets all three."
        + (f" One of {least:.2f} to {most:.2f} on all turns would bring them into their bands;"
           " nothing is fitted to the wrist." if least < most else "")
    )  # fmt: skip
    rows = [
        check("Section 4.1.4" if power < 20.0 else "Section 4.1.2",
              f"wrist turned by {power:.0f} W for 2 s", f"about {angle:.0f}°", angles[power],
              0.85 * angle, 1.15 * angle, "°", digits=0, reason=reason)
        for power, angle in printed.items()
    ]  # fmt: skip
    return [*rows, trend(
        "Section 4.1.2", "double against single helix, 28 W for 2 s", "double turns further",
        "double further", f"{angles[28.0]:.0f}° and {single:.0f}°", angles[28.0] > single,
        value=angles[28.0] / single, strict=True,
        note="The diameter that carries load, 7 mm, is an estimate; below 5 mm it would be the"
        " other way round.",
    )]  # fmt: skip


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
    source, spec = "Section 4.1.1", FingerPairSpec()
    powers = (2.0, 4.0, 6.0, 8.0, 10.0)
    found = [opened(power) for power in powers]
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
    listed = ", ".join(f"{w:.1f}" for w in wide)
    return [
        trend(source, "gripper opened by 2 to 10 W for 2 s", "ever faster with power",
              "opening and its steps grow", f"{listed} mm",
              bool(wide[0] > 0.0 and (np.diff(wide, prepend=0.0) > 0.0).all()
                   and (np.diff(wide, 2, prepend=0.0) > 0.0).all()),
              value=float(wide[-1])),
        trend(source, "gripping force over the opening", "almost linear",
              "within 5 % of a straight line through 0",
              f"within {bow:.1f} % up to {pulled[-1]:.0f} mm", bow < 5.0,
              note="By rod theory; 5 % is an estimate of \"almost\".", value=bow),
        trend(source, "gripper closes", "at 2.5 s, opened until 2 s",
              "in 0.5 s more of the opening is lost than one node of 5 s would lose",
              f"{lost:.0f} % after 10 W ({last.wide:.1f} to {last.later:.1f} mm); one node"
              f" {single:.0f} %", lost > single, value=lost,
              note="The TCA cools into the silicone, which is still cold. How much had to close is"
              " not printed. The share of the channel's wall that it touches is an estimate."),
    ]  # fmt: skip


def _wide(shape: RodShape) -> float:
    """Distance between the tips by theory: a finger's base points sideways [mm]."""
    return 2e3 * float(shape.tip[2])


def finger() -> list[Finding]:
    """How much slower the body of a finger is than its TCAs (Section 4.2.2)."""
    heat = BendingSpec().embedded.heat
    fast, slow = float(heat.time_constant), float(heat.body_capacity / heat.body_loss)
    return [trend(
        "Section 4.2.2", "finger: its body against its TCAs",
        "its temperature takes much longer to settle than its shape",
        "the body at least 20 times slower",
        f"{fast:.1f} and {slow:.0f} s, {slow / fast:.0f} times", slow > 20.0 * fast,
        value=slow / fast,
        note="Time constants of the bending module's TCA, while the silicone keeps its temperature,"
        " and of its silicone in air; the finger's section is not printed. 20 is an estimate of"
        " \"much\".",
    )]  # fmt: skip


def bistable() -> list[Finding]:
    """How warm the bistable gripper gets (Section 4.3.4): its heat alone.

    A finger with two TCAs of 100 mm. One gets 1.5 A for 0.8 s and closes, the other one then for
    1.5 s and opens.
    """
    tca = CATALOGUE["free-stroke"].of_length(0.100)
    heat, power = replace(tca, body=finger_body(tca)).heat, np.array(1.5**2 * CUT)
    cold, off = np.array(_ROOM), np.array(0.0)
    shut, long = HeatStep.of(heat, 0.8), HeatStep.of(heat, 1.5)
    closer, closer_body, _ = shut.advance(cold, cold, power)
    _, closer_body, _ = long.advance(closer, closer_body, off)
    opener, opener_body, _ = long.advance(cold, cold, power)
    mean = 0.5 * float(closer_body + opener_body)
    return [trend(
        "Section 4.3.4", "bistable gripper, closed and opened: hottest surface",
        f"{HOTTEST} °C", "mean of the silicone below, TCA above",
        f"silicone {mean:.1f} °C, TCA {float(opener):.0f} °C",
        _ROOM < mean < HOTTEST < float(opener), value=mean,
        note=f"{float(power):.0f} W for 0.8 s into one TCA, then for 1.5 s into the other one of"
        " the same finger, each pressed to half of its channel's wall (an estimate). A surface has"
        " no temperature here: it is above the mean over the TCA and below it elsewhere.",
    )]  # fmt: skip


def weight() -> list[Finding]:
    """What the arm weighs (Section 4.1.4)."""
    sim, spec = loaded_arm(mass=0.0), BendingSpec()
    grams = 1e3 * float(sim.model.body_mass.sum() - sim.model.body("base").mass[0])
    wider = 1e3 * spec.body.mass * ((spec.outer_diameter / spec.diameter) ** 2 - 1.0)
    return [check(
        "Section 4.1.4", "weight of the arm", "6 g", grams, 5.5, 6.5, "g",
        reason="The bending module's silicone is that of 4.5 mm, which agrees with its stiffness"
        f" and lets it stand; that of its outline, 9 mm, would weigh {wider:.1f} g more and make it"
        " 6 g, but then the module could not stand. The loaded arm would bend as far.",
    )]  # fmt: skip


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
        note = "By the tangent of the module's tip; no time is printed, 60 s are an estimate."
        if above.size:
            i = int(above[0])
            hot, body = course.temperature[i].max(), course.body[i].max()
            note += (f" It passes 30° after {course.time[i]:.0f} s, the hotter TCA at {hot:.0f} and"
                     f" its silicone at {body:.0f} °C; by eq. (4.1) it has {course.place[i]:.0f}°"
                     " then, as its weight straightens it near the base.")  # fmt: skip
        if off.size:
            note += f" From {course.time[int(off[0])]:.0f} s on it leaves its plane."
        rows.append(check(
            "Section 4.1.4", f"loaded arm, {powers.bend[0]} W + {powers.bend[1]} W, within 60 s",
            "bends by more than 30°", float(bend.max()), 30.0, math.inf, "°", digits=0,
            note=note,
        ))  # fmt: skip
    return rows

"""Bending module and wrist in series, hanging: docs/pictures/study_arm.png and its table.

Sun, dissertation, Colorado State University, Sections 4.1.4 and 5.3.2: the wrist turns by 45° and
58°, and the arm bends by more than 30° with gripper, wrist and object. The gripper is rigid here.
"""

import math
from functools import cache
from typing import Any

import mujoco
import numpy as np
import studies
from matplotlib.figure import Figure
from studies import BLUE, GREEN, MUJOCO, ORANGE

from tca_mj.model.part import Part, new_spec
from tca_mj.modules.bending import bending_module
from tca_mj.modules.twisting import twisting_module
from tca_mj.record.plots import temperature_colour
from tca_mj.robots.arm import ArmSpec
from tca_mj.rod import RodShape, Segment, solve_series
from tca_mj.routes import parallel
from tca_mj.tca import TcaSpec, law_at

SPEC = ArmSpec()
OBJECT = 1e-3  # mass of an object between the finger tips: an estimate [kg]
GRAVITY = (0.0, 0.0, 9.81)  # the arm hangs along +z
# Temperatures of TCA 1, of TCAs 2 and 3, and of the wrist's [°C]: TCA 1 is kept taut.
CASES = [(25, 25, 25), (50, 90, 60), (70, 115, 70), (85, 135, 80), (100, 150, 90), (110, 160, 100)]


def loads() -> list[list[tuple[float, float]]]:
    """Mass [kg] and height above the tip [m] of what hangs rigidly on the two modules."""
    disc = (SPEC.connector_mass, SPEC.connector / 2.0)
    ring = SPEC.gripper.length / (2.0 * SPEC.gripper.closure)
    mount = SPEC.connector + SPEC.gripper.thickness / 2.0
    gripper = (2.0 * SPEC.gripper.body.mass, mount + ring)
    return [[disc], [disc, gripper, (OBJECT, mount + 2.0 * ring)]]


@cache
def tcas() -> tuple[TcaSpec, TcaSpec]:
    """The TCAs of the bending module and of the wrist."""
    return bending_module(SPEC.bending).tcas[0].spec, twisting_module(SPEC.twisting).tcas[0].spec


def theory(case: tuple[float, float, float], **more: Any) -> tuple[RodShape, RodShape]:
    """Both modules by rod theory."""
    one, two, wrist = case
    bending, twisting = tcas()
    bodies = (SPEC.bending.body, SPEC.twisting.body)
    routes = (parallel(3, SPEC.bending.offset), [SPEC.twisting.route])
    laws = ([law_at(bending, t) for t in (one, two, two)], [law_at(twisting, wrist)])
    segments = []
    for i, hung in enumerate(loads()):
        mass = sum(m for m, _ in hung)
        centre = (0.0, 0.0, sum(m * z for m, z in hung) / mass)
        offset = (0.0, 0.0, i * SPEC.connector)
        segments.append(Segment(bodies[i], routes[i], laws[i], offset=offset, mass=mass,
                                centre=centre))  # fmt: skip
    first, second = solve_series(segments, gravity=GRAVITY, **more)
    return first, second


def arm() -> Part:
    """The same in MuJoCo, with the builders' modules."""
    part = Part(new_spec("arm"))
    part.spec.option.gravity = list(GRAVITY)
    part.spec.worldbody.add_site(name="mount")
    part.attach(bending_module(SPEC.bending), to="mount", prefix="bending")
    for name, hung in zip(("bending.tip", "wrist.tip"), loads(), strict=True):
        tip = part.spec.site(name)
        for mass, height in hung:
            at = [0.0, 0.0, float(tip.pos[2]) + height]
            tip.parent.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-4, 0, 0], pos=at,
                                mass=mass, contype=0, conaffinity=0)  # fmt: skip
        if name == "bending.tip":
            far = [0.0, 0.0, float(tip.pos[2]) + SPEC.connector]
            tip.parent.add_site(name="far", pos=far)
            part.attach(twisting_module(SPEC.twisting), to="far", prefix="wrist")
    return part


def chain(case: tuple[float, float, float]) -> dict[str, np.ndarray]:
    """At rest in MuJoCo: points of the chains, places and rotations of the two tips."""
    one, two, wrist = case
    sim = studies.held(arm(), [one, two, two, wrist])
    tips = [sim.data.site(name) for name in ("bending.tip", "wrist.tip")]
    nodes = [i for i in range(sim.model.nbody) if "body" in sim.model.body(i).name]
    turns = sim.data.xmat[nodes].reshape(-1, 3, 3)
    half = np.repeat([SPEC.bending.length / SPEC.bending.nodes / 2.0,
                      SPEC.twisting.length / SPEC.twisting.nodes / 2.0],
                     [SPEC.bending.nodes + 1, SPEC.twisting.nodes + 1])  # fmt: skip
    half[[0, SPEC.bending.nodes + 1]] = 0.0  # the first piece starts at the base
    return {"points": sim.data.xpos[nodes] + half[:, None] * turns[:, :, 2],
            "place": np.array([tip.xpos for tip in tips]),
            "turn": np.array([tip.xmat.reshape(3, 3) for tip in tips])}  # fmt: skip


def angles(turn: np.ndarray) -> tuple[float, float, float]:
    """Angle of the bending module's tip, of the wrist's tip, and turn of the wrist [deg]."""
    wrist = turn[0].T @ turn[1]
    yaw = math.atan2(wrist[1, 0] - wrist[0, 1], wrist[0, 0] + wrist[1, 1])
    bends = np.degrees(np.arccos(np.minimum(turn[:, 2, 2], 1.0)))
    return float(bends[0]), float(bends[1]), abs(math.degrees(yaw))


def exact(shapes: tuple[RodShape, RodShape]) -> tuple[float, float, float]:
    """The same angles by theory [deg]."""
    return angles(np.array([shape.rotation[-1] for shape in shapes]))


def compute() -> dict[str, Any]:
    at = np.linspace(0.0, len(CASES) - 1.0, 26)
    course = np.array(
        [np.interp(at, range(len(CASES)), column) for column in zip(*CASES, strict=True)]
    )
    rows = [(case, theory(case), chain(case)) for case in CASES]
    return {"rows": rows, "course": course[1],
            "angles": np.array([exact(theory(tuple(case))) for case in course.T])}  # fmt: skip


def table(data: dict[str, Any]) -> str:
    reach = SPEC.bending.length + SPEC.connector + SPEC.twisting.length
    rows = []
    for (one, two, wrist), shapes, found in data["rows"]:
        pairs = zip(exact(shapes), angles(found["turn"]), strict=True)
        places = shapes[1].tip, found["place"][1]
        rows.append([f"{one}, {two}, {two}; {wrist}", *(f"{x:.1f}°" for p in pairs for x in p),
                     *(f"({1e3 * p[0] + 0.0:.2f}, {1e3 * p[2]:.2f})" for p in places),
                     f"{100.0 * np.linalg.norm(places[1] - places[0]) / reach:.2f} %"])  # fmt: skip
    head = ["TCAs 1, 2, 3; wrist [°C]", "bending module's tip, theory", "MuJoCo",
            "wrist's tip, theory", "MuJoCo", "wrist turns, theory", "MuJoCo",
            "wrist's tip x, z, theory [mm]", "MuJoCo", "apart, over the length"]  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    small = {**MUJOCO, "ms": 3.5, "mew": 1.2}
    for case, shapes, found in data["rows"]:
        colour = temperature_colour(case[1])
        for shape in shapes:
            left.plot(1e3 * shape.position[:, 0], -1e3 * shape.position[:, 2], color=colour, lw=2)
        points = 1e3 * found["points"]
        left.plot(points[:, 0], -points[:, 2], color=colour, **small)
        left.plot([], [], color=colour, lw=2, label=f"{case[1]} °C")
    left.plot([], [], color="#111111", label="MuJoCo", **small)
    left.set(xlabel="x [mm]", ylabel="height [mm]", aspect="equal", xlim=(-21, 33))
    left.legend(loc="upper right", frameon=False, fontsize=9, title="TCAs 2 and 3, theory",
                alignment="left")  # fmt: skip
    names = ("angle of the bending module's tip", "angle of the wrist's tip", "turn of the wrist")
    for k, (name, colour) in enumerate(zip(names, (BLUE, GREEN, ORANGE), strict=True)):
        right.plot(data["course"], data["angles"][:, k], color=colour, lw=2,
                   label=f"{name}, theory")  # fmt: skip
        right.plot([case[1] for case, _, _ in data["rows"]],
                   [angles(found["turn"])[k] for _, _, found in data["rows"]],
                   color=colour, **MUJOCO)  # fmt: skip
    right.plot([], [], color="#111111", label="MuJoCo, 8 nodes a module", **MUJOCO)
    right.axhline(30.0, color="#111111", lw=1, ls="--")
    right.text(26.0, 31.0, "reported: bends by more than 30°", fontsize=9)
    right.set(xlabel="temperature of TCAs 2 and 3 [°C]", ylabel="angle [°]", ylim=(-2, 105))
    right.legend(loc="upper left", frameon=False, fontsize=9)


if __name__ == "__main__":
    studies.publish("arm", __doc__, compute, table, draw)

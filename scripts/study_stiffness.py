"""Stiffness of the evenly heated bending module: docs/pictures/study_stiffness.png and its table.

Three TCAs are equally hot and a force pushes the tip aside (Sun, dissertation, Colorado State
University, Section 5.3.1, Fig. 5.5: from 75 to 125 °C the displacement becomes much less).
"""

from functools import partial
from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from studies import BLUE, GREEN, MUJOCO, ORANGE, PURPLE

from tca_mj.model import settle
from tca_mj.modules.bending import BendingSpec
from tca_mj.record.plots import temperature_colour
from tca_mj.rod import StrandLaw, solve_static
from tca_mj.routes import parallel
from tca_mj.tca import CATALOGUE, law_at

SPEC = BendingSpec()
FORCE = 5e-3  # push of the table and the right panel [N]
SHOWN = (75.0, 100.0, 125.0)
LAWS = {
    "printed": partial(studies.linear_law, ambient=None),
    "printed, at rest at 25 °C": studies.linear_law,
    "this package": partial(law_at, CATALOGUE["free-stroke"]),
    "printed passive modulus": studies.passive_law,
}
COLOURS = dict(zip(LAWS, (BLUE, ORANGE, GREEN, PURPLE), strict=True))


def question(law: StrandLaw, force: float) -> dict[str, Any]:
    """Three equal TCAs; the push is along x, towards TCA 1."""
    return dict(beam=SPEC.body, routes=parallel(3, SPEC.offset), tensions=[law] * 3,
                tip_force=(force, 0.0, 0.0))  # fmt: skip


def theory(law: StrandLaw, force: float = FORCE, shearable: bool = True) -> float:
    """How far the tip is pushed aside [mm]."""
    return 1e3 * float(solve_static(**question(law, force), shearable=shearable).tip[0])


def chain(law: StrandLaw, force: float = FORCE) -> float:
    """The same by MuJoCo [mm]."""
    return 1e3 * float(settle(**question(law, force), nodes=SPEC.nodes).tip[0])


def compute() -> dict[str, Any]:
    forces, course = np.linspace(0.0, 8e-3, 17), np.linspace(25.0, 130.0, 22)
    law = LAWS["this package"]
    return {
        "rows": {
            (name, t): (theory(of(t)), theory(of(t), shearable=False), chain(of(t)))
            for name, of in LAWS.items() for t in (75.0, 125.0)
        },
        "forces": forces,
        "push": {t: [theory(law(t), f) for f in forces] for t in SHOWN},
        "pushed": {t: [chain(law(t), f) for f in forces[::2]] for t in SHOWN},
        "course": course,
        "soft": {name: [theory(of(t)) for t in course] for name, of in LAWS.items()},
        "softened": {name: [chain(of(t)) for t in course[::5]] for name, of in LAWS.items()},
    }  # fmt: skip


def table(data: dict[str, Any]) -> str:
    rows = [[f"{name}, {t:.0f} °C", f"{exact:.2f} mm", f"{stiff:.2f} mm", f"{mj:.2f} mm",
             f"{100.0 * (mj / exact - 1.0):+.1f} %", f"{100.0 * (mj / stiff - 1.0):+.1f} %"]
            for (name, t), (exact, stiff, mj) in data["rows"].items()]  # fmt: skip
    head = ["law of the TCAs", "theory", "theory without shear", "MuJoCo", "MuJoCo to theory",
            "to theory without shear"]  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    for t in SHOWN:
        colour = temperature_colour(t)
        left.plot(1e3 * data["forces"], data["push"][t], color=colour, lw=2, label=f"{t:.0f} °C")
        left.plot(1e3 * data["forces"][::2], data["pushed"][t], color=colour, **MUJOCO)
    left.set(xlabel="force across the tip [mN]", ylabel="tip pushed aside [mm]", ylim=(0, 26),
             title="TCAs of this package")  # fmt: skip
    for name, colour in COLOURS.items():
        right.plot(data["course"], data["soft"][name], color=colour, lw=2, label=name)
        right.plot(data["course"][::5], data["softened"][name], color=colour, **MUJOCO)
    right.set(xlabel="temperature of all three TCAs [°C]", ylabel="tip pushed aside [mm]",
              title="by 5 mN", ylim=(0, 36), xlim=(22, 133))  # fmt: skip
    for axis, name in ((left, "theory"), (right, "law of the TCAs, theory")):
        axis.plot([], [], color="#111111", label="MuJoCo, 8 nodes", **MUJOCO)
        axis.legend(frameon=False, title=name, alignment="left", fontsize=9,
                    loc="upper left" if axis is left else "lower left")  # fmt: skip
        axis.title.set_fontsize(10)


if __name__ == "__main__":
    studies.publish("stiffness", __doc__, compute, table, draw)

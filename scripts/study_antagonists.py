"""Bending against a passive TCA: docs/pictures/study_antagonists.png and its table.

TCAs 2 and 3 of the bending module are hot; TCA 1 resists or is absent (Sun, dissertation,
Colorado State University, Section 5.3.1, Fig. 5.4: "more than 40 %" larger without it).
"""

from functools import partial
from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from studies import BLUE, GREEN, MUJOCO, ORANGE

from tca_mj.model import settle
from tca_mj.modules.bending import BendingSpec
from tca_mj.rod import StrandLaw, solve_static
from tca_mj.routes import parallel
from tca_mj.tca import CATALOGUE, law_at

SPEC = BendingSpec()
SHOWN = (75.0, 100.0, 125.0)  # temperatures of Section 5.3.1 [°C]
STIFF = np.geomspace(0.1, 27.0, 25)  # of a linear antagonist [N/m]
rod_law = partial(law_at, CATALOGUE["free-stroke"])
# What TCA 1 is, and by which law the other two are hot.
CASES = {
    "printed passive law": (studies.linear_law, studies.passive_law()),
    "linear, G = 0.22 GPa": (studies.linear_law, studies.linear_law(25.0)),
    "this package, cold": (rod_law, rod_law(25.0)),
}


def bends(hot: StrandLaw, antagonist: StrandLaw | float) -> tuple[float, float]:
    """Bend by theory and by MuJoCo with TCAs 2 and 3 hot [deg]."""
    question = SPEC.body, parallel(3, SPEC.offset), [antagonist, hot, hot]
    return studies.bend(solve_static(*question)), studies.bend(settle(*question, nodes=SPEC.nodes))


def larger(temperature: float, hot: Any, antagonist: StrandLaw) -> np.ndarray:
    """Bends without and with the antagonist, by theory and by MuJoCo, shape (2, 2) [deg]."""
    return np.array([bends(hot(temperature), 0.0), bends(hot(temperature), antagonist)])


def compute() -> dict[str, Any]:
    cases = {name: [larger(t, *case) for t in SHOWN] for name, case in CASES.items()}
    springs = [studies.linear_law(25.0, shear=k * studies.COMPLIANCE) for k in STIFF]
    course = np.linspace(25.0, 130.0, 22)
    lines = {name: [bends_theory(hot(t), one) for t in course]
             for name, (hot, one) in CASES.items()}  # fmt: skip
    lines["absent"] = [bends_theory(studies.linear_law(t), 0.0) for t in course]
    pulls = np.array([larger(100.0, studies.linear_law, s) for s in springs])
    return {"cases": cases, "course": course, "lines": lines, "springs": pulls}


def bends_theory(hot: StrandLaw, antagonist: StrandLaw | float) -> float:
    return studies.bend(solve_static(SPEC.body, parallel(3, SPEC.offset), [antagonist, hot, hot]))


def table(data: dict[str, Any]) -> str:
    head = ["TCA 1", "TCAs 2, 3", "bend without TCA 1, theory", "MuJoCo", "with it, theory",
            "MuJoCo", "larger without, theory", "MuJoCo"]  # fmt: skip
    rows = []
    for name, values in data["cases"].items():
        for temperature, both in zip(SHOWN, values, strict=True):
            more = 100.0 * (both[0] / both[1] - 1.0)
            rows.append([name, f"{temperature:.0f} °C", *(f"{x:.2f}°" for x in both.ravel()),
                         *(f"{x:.2f} %" for x in more)])  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    colours = dict(zip(CASES, (BLUE, ORANGE, GREEN), strict=True))
    left.plot(data["course"], data["lines"]["absent"], "--", color="#111111", lw=1.6,
              label="no TCA 1", zorder=3)  # fmt: skip
    for name, colour in colours.items():
        left.plot(data["course"], data["lines"][name], color=colour, lw=2, label=name)
        left.plot(SHOWN, [v[1, 1] for v in data["cases"][name]], color=colour, **MUJOCO)
    left.plot([], [], color="#111111", label="MuJoCo, 8 nodes", **MUJOCO)
    left.set(xlabel="temperature of TCAs 2 and 3 [°C]", ylabel="bend [°]", xlim=(25, 131),
             ylim=(0, 280))  # fmt: skip
    left.legend(loc="upper left", frameon=False, title="TCA 1; lines: theory", alignment="left")
    more = 100.0 * (data["springs"][:, 0] / data["springs"][:, 1] - 1.0)
    right.loglog(STIFF, more[:, 0], color="#333333", lw=2, label="TCA 1 a linear spring, theory")
    right.loglog(STIFF[::4], more[::4, 1], color="#333333", label="MuJoCo", **MUJOCO)
    right.axhline(40.0, color="#111111", lw=1.2, ls="--")
    right.text(0.11, 43.0, "reported: more than 40 %", fontsize=9)
    for name, x in (("printed passive law", 0.104), ("linear, G = 0.22 GPa", 27.0)):
        both = data["cases"][name][1]
        y = 100.0 * (both[0, 0] / both[1, 0] - 1.0)
        right.plot(x, y, "s", color=colours[name], ms=9)
        shift = (10, -4) if x < 1.0 else (-10, 2)
        right.annotate(f"{name}: {y:.3g} %", (x, y), shift, textcoords="offset points",
                       fontsize=9, ha="left" if x < 1.0 else "right", va="center")  # fmt: skip
    right.set(xlabel="stiffness of TCA 1 [N/m]", ylabel="bend larger without TCA 1 [%]",
              title="TCAs 2 and 3 at 100 °C", ylim=(0.7, 200))  # fmt: skip
    right.title.set_fontsize(10)
    right.legend(loc="center left", bbox_to_anchor=(0.0, 0.6), frameon=False)


if __name__ == "__main__":
    studies.publish("antagonists", __doc__, compute, table, draw)

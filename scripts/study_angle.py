"""What the angle of a 3D bend is: docs/pictures/study_angle.png and its table.

Angle by the tip's tangent and by the tip's place (Sun, dissertation, Colorado State University,
eq. (4.1)), of the module standing, hanging, lying and without weight. Reported are about 120° for
2 W + 0.4 W and about 50° for 1 W + 0.2 W, 2 s long (Section 4.1.3).
"""

from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from studies import BLUE, GREEN, GREY, ORANGE, PURPLE

from tca_mj.modules.bending import BendingSpec
from tca_mj.validation.attitude import (
    ATTITUDES,
    Bend,
    arc,
    bent,
    contact_for,
    in_free_air,
    ring_of_air,
    slenderness,
)

POWERS = ((2.0, 0.4), (1.0, 0.2))  # [W]
REPORTED = (120.0, 50.0)  # [deg]
HEAVY_DIAMETER = BendingSpec().outer_diameter
HEAVY = "standing, weight of 9 mm"
COLOURS = dict(zip(ATTITUDES, (BLUE, ORANGE, GREEN, PURPLE), strict=True))


def compute() -> dict[str, Any]:
    found = {(name, p): bent(name, p) for name in ATTITUDES for p in POWERS}
    found |= {(HEAVY, p): bent("standing", p, weight=HEAVY_DIAMETER) for p in POWERS}
    return {"bent": found, "contact": {name: contact_for(name) for name in ATTITUDES}}


def table(data: dict[str, Any]) -> str:
    rows = []
    for name in (*ATTITUDES, HEAVY):
        one, two = (data["bent"][name, p] for p in POWERS)
        fitted = data["contact"].get(name)
        rows.append([
            name, f"{slenderness(HEAVY_DIAMETER if name == HEAVY else 4.5e-3):.1f}"
            if name.startswith("standing") else "-", f"{one.cold:.0f}°",
            *(f"{angle:.1f}°" for b in (one, two) for angle in (b.tangent, b.place)),
            f"{one.place / two.place:.1f}", "-" if fitted is None else f"{fitted:.2f} W/(m K)",
        ])  # fmt: skip
    rows += [
        ["reported", "-", "up to 10°", "-", "about 120°", "-", "about 50°", "2.4", "-"],
        ["bare TCA in free air", *["-"] * 7, f"{in_free_air():.2f} W/(m K)"],
        *([f"still air in a channel of {1e3 * width:.1f} mm", *["-"] * 7,
           f"{ring_of_air(width):.2f} W/(m K)"] for width in (2.0e-3, 2.7e-3)),
    ]  # fmt: skip
    head = ["attitude", "q L³/EI (falls from 7.8 on)", "cold, eq. (4.1)",
            "2 W + 0.4 W, tangent", "eq. (4.1)", "1 W + 0.2 W, tangent", "eq. (4.1)",
            "ratio, eq. (4.1)", "contact for 120° by eq. (4.1)"]  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    length = BendingSpec().length
    for name, colour in COLOURS.items():
        found = data["bent"][name, POWERS[0]]
        line = 1e3 * found.line
        left.plot(np.hypot(line[:, 0], line[:, 1]), line[:, 2], color=colour, lw=2.5, label=name)
        angles = np.radians(found.place) * np.linspace(0.0, 1.0, 41)[1:]
        points = [arc(Bend(a, 0.0), length * a / angles[-1]) for a in angles]
        places = 1e3 * np.array([[0.0, 0.0, 0.0], *points])
        left.plot(places[:, 0], places[:, 2], color=colour, lw=1, ls="--")
    left.plot([], [], color="#111111", lw=1, ls="--", label="arc of eq. (4.1)")
    left.set(xlabel="aside [mm]", ylabel="along the cold module [mm]", aspect="equal",
             xlim=(-2, 48), ylim=(-2, 40))  # fmt: skip
    left.legend(loc="lower right", frameon=False, fontsize=9, title="2 W + 0.4 W for 2 s",
                alignment="left")  # fmt: skip
    for i, (p, reported) in enumerate(zip(POWERS, REPORTED, strict=True)):
        for k, name in enumerate(ATTITUDES):
            found, at = data["bent"][name, p], k + 5.0 * i
            right.bar(at - 0.2, found.tangent, 0.38, color=COLOURS[name], alpha=0.4)
            right.bar(at + 0.2, found.place, 0.38, color=COLOURS[name])
            right.plot([at - 0.4, at + 0.4], [found.cold] * 2, color="#111111", lw=1.5, ls=":")
        right.plot([5.0 * i - 0.5, 5.0 * i + 3.5], [reported] * 2, color="#111111", lw=1, ls="--")
        right.text(5.0 * i - 0.45, reported + 2.0, f"reported, {p[0]:.0f} W + {p[1]} W", fontsize=9)
    right.bar(-9.0, 0.0, color=GREY, alpha=0.4, label="by the tangent")
    right.bar(-9.0, 0.0, color=GREY, label="by the place, eq. (4.1)")
    right.plot([], [], color="#111111", lw=1.5, ls=":", label="cold, by the place")
    right.set(ylabel="bend [°]", ylim=(0, 150), xlim=(-0.8, 8.8))
    right.set_xticks([k + 5.0 * i for i in range(2) for k in range(4)],
                     [name for _ in range(2) for name in ATTITUDES], rotation=35, ha="right",
                     fontsize=9)  # fmt: skip
    right.legend(loc="upper right", frameon=False, fontsize=9)


if __name__ == "__main__":
    studies.publish("angle", __doc__, compute, table, draw)

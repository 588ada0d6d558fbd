"""Angle and direction of a 3D bend against power: docs/pictures/study_direction.png, its table.

Power P1 on TCA 1, P2 on TCA 2, none on TCA 3, for 2 s (Sun, dissertation, Colorado State
University, Section 4.1.3, Fig. 4.4): about 120° for 2 W + 0.4 W, about 50° for 1 W + 0.2 W, and
a direction that depends on the ratio of the powers, not on their size.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from scipy.optimize import brentq
from studies import BLUE, GREEN, MUJOCO, ORANGE, REPORTED

from tca_mj.model import settle
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.rod import RodShape, StrandLaw, solve_static
from tca_mj.routes import parallel
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, law_at

SPEC, TCA = BendingSpec(), CATALOGUE["free-stroke"]
EMBEDDED = SPEC.embedded
RATIOS = np.linspace(1.0, 5.0, 17)
SMALL = (0.4, 0.2)  # P2 of the two series of Fig. 4.4 [W]
Laws = Callable[[float, float], list[StrandLaw]]  # from two temperatures to three TCAs
rod_law = partial(law_at, TCA)
printed_law = partial(studies.linear_law, ambient=None)
LAWS: dict[str, Laws] = {
    "this package": lambda one, two: [rod_law(one), rod_law(two), rod_law(25.0)],
    "TCA 3 printed passive": lambda one, two: [rod_law(one), rod_law(two), studies.passive_law()],
    "all as printed": lambda one, two: [
        printed_law(one), printed_law(two), studies.passive_law()],
    "TCAs 2, 3 printed passive": lambda one, two: [
        rod_law(one), studies.passive_law(two), studies.passive_law()],
}  # fmt: skip


def shape(
    laws: Laws, powers: tuple[float, float], conductance: float | None = None,
    solve: Any = solve_static, **more: Any,
) -> RodShape:  # fmt: skip
    """The module after 2 s, at rest at the temperatures of that moment, no weight.

    ``conductance`` is that between TCA and silicone, by default the package's [W/(m K)].
    """
    tca = EMBEDDED
    if conductance is not None:
        tca = replace(tca, body=replace(tca.body, conductance=conductance))
    hot = studies.heated(tca, powers)
    return solve(SPEC.body, parallel(3, SPEC.offset), laws(*hot), **more)


def both(rod: RodShape) -> tuple[float, float]:
    """Angle of the bend, and its direction from TCA 1 towards TCA 2 [deg]."""
    return studies.bend(rod), studies.direction(rod.tip)


def chain(laws: Laws, powers: tuple[float, float]) -> tuple[float, float]:
    """Both angles by MuJoCo: 2 s of motion with the package's law, at rest with another."""
    if laws is not LAWS["this package"]:
        return both(shape(laws, powers, solve=settle, nodes=SPEC.nodes))
    part = bending_module(SPEC)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part)
    sim.step([*powers, 0.0], 2.0)
    axis = sim.data.site(part.sites["tip"]).xmat.reshape(3, 3)[:, 2]
    return math.degrees(math.acos(axis[2])), studies.direction(axis)


def conductance_for(laws: Laws, angle: float) -> float:
    """Conductance at which 2 W + 0.4 W bend by an angle, from TCA to silicone [W/(m K)]."""
    return float(brentq(lambda g: both(shape(laws, (2.0, 0.4), g))[0] - angle, 1e-4, 1.0))


def compute() -> dict[str, Any]:
    powers = {p2: [(r * p2, p2) for r in RATIOS] for p2 in SMALL}
    drawn = list(LAWS)[:2]
    return {
        "lines": {(n, p2): np.array([both(shape(LAWS[n], p)) for p in powers[p2]])
                  for n in drawn for p2 in SMALL},
        "marks": {(n, p2): np.array([chain(LAWS[n], p) for p in powers[p2][::4]])
                  for n in drawn for p2 in SMALL},
        "ends": {(n, p2): (both(shape(laws, powers[p2][-1])), chain(laws, powers[p2][-1]))
                 for n, laws in LAWS.items() for p2 in SMALL},
    }  # fmt: skip


def table(data: dict[str, Any]) -> str:
    rows = []
    for name, laws in LAWS.items():
        fitted = conductance_for(laws, 120.0)
        for p2, reported in zip(SMALL, (120, 50), strict=True):
            exact, mj = data["ends"][name, p2]
            lossless = both(shape(laws, (5.0 * p2, p2), 1e-6))[0]
            tuned = f"{both(shape(laws, (5.0 * p2, p2), fitted))[0]:.0f}° ({fitted:.2f})"
            rows.append([name, f"{5.0 * p2:.0f} W + {p2:.1f} W", f"{reported}°", f"{exact[0]:.1f}°",
                         f"{mj[0]:.1f}°", f"{mj[0] - exact[0]:+.2f}°", f"{exact[1]:.1f}°",
                         f"{mj[1]:.1f}°", f"{lossless:.0f}°", tuned])  # fmt: skip
    head = ["laws", "power", "bend reported", "theory", "MuJoCo", "difference", "direction, theory",
            "MuJoCo", "bend, no heat lost",
            "bend, conductance fitted to 120° [W/(m K)]"]  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    for k, axis in enumerate((left, right)):
        for (name, p2), line in data["lines"].items():
            colour = {("this package", 0.4): BLUE, ("this package", 0.2): GREEN}.get(
                (name, p2), ORANGE if p2 == 0.4 else studies.PURPLE)  # fmt: skip
            axis.plot(RATIOS, line[:, k], color=colour, lw=2, ls="-" if p2 == 0.4 else "--",
                      label=f"{name}, P2 = {p2} W")  # fmt: skip
            axis.plot(RATIOS[::4], data["marks"][name, p2][:, k], color=colour, **MUJOCO)
        axis.plot([], [], color="#111111", label="MuJoCo, 8 nodes", **MUJOCO)
        axis.set(xlabel="P1 / P2", xlim=(0.9, 5.15))
    left.plot([5.0, 5.0], [120.0, 50.0], label="reported", **REPORTED)
    for power, angle, up in (("2 W +\n0.4 W", 120.0, -20), ("1 W +\n0.2 W", 50.0, 20)):
        left.annotate(power, (5.0, angle), (8, up), textcoords="offset points", fontsize=8,
                      ha="right", va="center")  # fmt: skip
    left.set(ylabel="bend after 2 s, no weight [°]", ylim=(0, 150))
    right.set(ylabel="direction, from TCA 1 to TCA 2 [°]", ylim=(0, 65))
    left.legend(loc="upper left", frameon=False, fontsize=9, title="lines: theory",
                alignment="left")  # fmt: skip


if __name__ == "__main__":
    studies.publish("direction", __doc__, compute, table, draw)

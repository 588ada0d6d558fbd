"""Single and double helix of the twisting module: docs/pictures/study_twist.png and its table.

Sun, dissertation, Colorado State University, Sections 4.1.2 and 4.1.4: 14, 16 and 28 W for
2 s turn the double helix by about 45°, 58° and 180°; it turns further than the single one.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from scipy.optimize import brentq
from studies import BLUE, MUJOCO, ORANGE, REPORTED

from tca_mj.model import settle
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.rod import solve_static
from tca_mj.tca import CoilRods, TcaSpec, law_at
from tca_mj.validation.modules import turned

# A helix of five turns needs at least 15 nodes.
SPECS = {"double": TwistingSpec(), "single": TwistingSpec(double=False, nodes=20)}
POWERS = np.linspace(0.0, 30.0, 16)  # [W]
TURNS = {14.0: 45.0, 16.0: 58.0, 28.0: 180.0}  # Sun, Sections 4.1.2 and 4.1.4, by power [deg]
HOT = 120.0  # temperature at which the diameter is varied [°C]
DIAMETERS = np.linspace(3.5e-3, 8e-3, 10)


@cache
def tca(spec: TwistingSpec) -> TcaSpec:
    """The module's TCA, in its tube."""
    return twisting_module(spec).tcas[0].spec


def turn(spec: TwistingSpec, temperature: float, solve: Any = solve_static, **more: Any) -> float:
    """Angle by which the tip turns [deg]."""
    law = law_at(tca(spec), temperature)
    return abs(studies.twist(solve(spec.body, [spec.route], [law], **more)))


def ratio(diameter: float, solve: Any = solve_static, **more: Any) -> float:
    """Double over single at 120 °C."""
    two, one = (replace(spec, diameter=diameter) for spec in SPECS.values())
    if solve is settle:
        return turn(two, HOT, settle, nodes=two.nodes) / turn(one, HOT, settle, nodes=one.nodes)
    return turn(two, HOT, **more) / turn(one, HOT, **more)


def threshold(**more: Any) -> float:
    """Diameter at which both turn equally far [m]."""
    return float(brentq(lambda d: ratio(d, **more) - 1.0, 4e-3, 7e-3, xtol=1e-6))


def estimate(stiffness: float) -> float:
    """That diameter if the body only twists, GJ/L = 2 K a² [m]."""
    spec = SPECS["double"]
    needed = 2.0 * stiffness * spec.radius**2 * spec.length
    return spec.diameter * (needed / spec.body.torsion) ** 0.25


def compute() -> dict[str, Any]:
    hot = {name: studies.heated(tca(spec), POWERS) for name, spec in SPECS.items()}
    cases = [(n, s, t) for n, s in SPECS.items() for t in hot[n]]
    stiffness = float(CoilRods([tca(SPECS["double"])]).rest_stiffness[0])
    linear = studies.SHEAR / studies.COMPLIANCE * 45e-3 / tca(SPECS["double"]).rest_length
    return {
        "hot": hot,
        "theory": {n: np.array([turn(s, t) for m, s, t in cases if m == n]) for n in SPECS},
        "stiff": {n: turn(s, hot[n][14], shearable=False) for n, s in SPECS.items()},
        "mujoco": {n: np.array([turned(p, s) for p in POWERS[::2]]) for n, s in SPECS.items()},
        "ratio": [ratio(d) for d in DIAMETERS],
        "ratio, no shear": [ratio(d, shearable=False) for d in DIAMETERS],
        "ratio, MuJoCo": [ratio(d, settle) for d in DIAMETERS[::3]],
        "diameter": (threshold(), threshold(shearable=False), estimate(stiffness),
                     estimate(linear)),
    }  # fmt: skip


def table(data: dict[str, Any]) -> str:
    rows = []
    for power in (14.0, 16.0):
        k = int(np.flatnonzero(POWERS == power)[0])
        exact, mj = data["theory"]["double"][k], turned(power, SPECS["double"])
        rows.append([f"double, {power:.0f} W for 2 s ({data['hot']['double'][k]:.0f} °C)",
                     f"{exact:.1f}°", "-", f"{mj:.1f}°", f"{100.0 * (mj / exact - 1.0):+.1f} %",
                     "-"])  # fmt: skip
    for name in SPECS:
        exact, mj, stiff = (data["theory"][name][14], data["mujoco"][name][7], data["stiff"][name])
        rows.append([f"{name}, 28 W for 2 s ({data['hot'][name][14]:.0f} °C)", f"{exact:.1f}°",
                     f"{stiff:.1f}°", f"{mj:.1f}°", f"{100.0 * (mj / exact - 1.0):+.1f} %",
                     f"{100.0 * (mj / stiff - 1.0):+.1f} %"])  # fmt: skip
    for d in (4.5e-3, SPECS["double"].diameter):
        exact, stiff, mj = ratio(d), ratio(d, shearable=False), ratio(d, settle)
        rows.append([f"double / single at {1e3 * d:.1f} mm, 120 °C", f"{exact:.3f}",
                     f"{stiff:.3f}", f"{mj:.3f}", f"{100.0 * (mj / exact - 1.0):+.1f} %",
                     f"{100.0 * (mj / stiff - 1.0):+.1f} %"])  # fmt: skip
    exact, stiff, *rough = (1e3 * d for d in data["diameter"])
    rows.append(["both equal from a diameter of", f"{exact:.2f} mm", f"{stiff:.2f} mm", "-", "-",
                 f"GJ/L = 2 K a²: {rough[0]:.2f} mm, printed K: {rough[1]:.2f} mm"])  # fmt: skip
    head = ["", "theory", "theory without shear", "MuJoCo", "MuJoCo to theory",
            "to theory without shear"]  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    for (name, spec), colour in zip(SPECS.items(), (BLUE, ORANGE), strict=True):
        left.plot(POWERS, data["theory"][name], color=colour, lw=2, label=f"{name}, theory")
        left.plot(POWERS[::2], data["mujoco"][name], color=colour,
                  label=f"{name}, MuJoCo, {spec.nodes} nodes", **MUJOCO)  # fmt: skip
    left.plot(*zip(*TURNS.items(), strict=True), label="reported, double", **REPORTED)
    left.set(xlabel="power for 2 s [W]", ylabel="angle [°]", title="diameter 7 mm",
             xlim=(0, 31), ylim=(0, 220))  # fmt: skip
    right.plot(1e3 * DIAMETERS, data["ratio"], color="#333333", lw=2, label="theory")
    right.plot(1e3 * DIAMETERS, data["ratio, no shear"], ":", color="#333333", lw=2,
               label="theory without shear")  # fmt: skip
    right.plot(1e3 * DIAMETERS[::3], data["ratio, MuJoCo"], color="#333333", label="MuJoCo",
               **MUJOCO)  # fmt: skip
    right.axhline(1.0, color="#111111", lw=1, ls="--")
    right.text(8.0, 1.01, "reported: above 1", ha="right", va="bottom", fontsize=9)
    right.axvline(4.5, color=studies.GREY, lw=1)
    right.text(4.55, 0.52, "printed\ndiameter", fontsize=9)
    right.set(xlabel="diameter that carries load [mm]", ylabel="angle of double / single",
              title="TCAs at 120 °C", ylim=(0.5, 2.0))  # fmt: skip
    for axis in (left, right):
        axis.title.set_fontsize(10)
        axis.legend(loc="upper left" if axis is left else "lower right", frameon=False,
                    fontsize=9)  # fmt: skip


if __name__ == "__main__":
    studies.publish("twist", __doc__, compute, table, draw)

"""Opening and gripping force of the finger pair: docs/pictures/study_gripper.png and its table.

Sun, dissertation, Colorado State University, Section 4.1.1, Fig. 4.2: opening after 2 s of power,
growing ever faster, and force of the cold gripper pulled open, nearly linear in the opening.
"""

import math
from functools import cache
from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from studies import BLUE, GREEN, MUJOCO, ORANGE

from tca_mj.model import settle
from tca_mj.modules.bending import SILICONE_DENSITY, SILICONE_YOUNG
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.rod import BeamSpec, RodShape, solve_static
from tca_mj.sim import Simulation
from tca_mj.tca import TcaSpec, law_at

SPEC = FingerPairSpec()
POWERS = np.linspace(0.0, 11.0, 23)  # [W]
WIDEST = 15.0  # opening up to which the gripper is pulled, about [mm]


@cache
def tca() -> TcaSpec:
    """The gripper's TCA, in both fingers."""
    return finger_pair(SPEC).tcas[0].spec


def half(temperature: float) -> Any:
    """Law of the half of the TCA that is in one finger."""
    return law_at(tca().of_length(tca().rest_length / 2.0), temperature)


def opening(shape: RodShape) -> float:
    """Distance between the tips: a finger's base points sideways [mm]."""
    return 2e3 * float(shape.tip[2])


def printed_body() -> BeamSpec:
    """One finger with the printed section, 3 x 6 mm of Ecoflex (Section 5.3), without layers."""
    return BeamSpec.box(
        length=SPEC.length / 2.0, width=SPEC.core, height=SPEC.width, young=SILICONE_YOUNG,
        shear=SILICONE_YOUNG / 3.0, density=SILICONE_DENSITY, curvature=SPEC.body.curvature,
    )  # fmt: skip


def softness(body: BeamSpec) -> float:
    """Opening per small force on the tips, in closed form (Castigliano) [m/N].

    A half ring of radius R bent by M = F R (1 + cos φ), pulled by F cos φ, sheared by F sin φ.
    """
    radius = 1.0 / abs(body.curvature[1])
    axial = 0.5 / body.stretching + 0.5 / body.shearing
    return 2.0 * math.pi * radius * (1.5 * radius**2 / body.bending[1] + axial)


def pulled(body: BeamSpec, solve: Any = solve_static, widest: float = WIDEST, **more: Any) -> Any:
    """Openings [mm] and forces [mN] of a gripper pulled open at its tips, its TCA cold."""
    forces = np.linspace(0.0, 1.0, 17) * 0.86 * widest * 1e-3 / softness(body)
    shapes = [solve(body, [SPEC.route], [half(25.0)], tip_force=(0, 0, f), **more) for f in forces]
    return np.array([opening(s) for s in shapes]), 1e3 * forces


def powered(power: float) -> float:
    """Opening after 2 s by MuJoCo, both fingers, no weight [mm]."""
    part = finger_pair(SPEC)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part)
    sim.step([power], 2.0)
    tips = [sim.data.site(part.sites[f"tip{i}"]).xpos for i in range(2)]
    return 1e3 * float(tips[0][0] - tips[1][0])


def compute() -> dict[str, Any]:
    hot = studies.heated(tca(), POWERS)
    bodies = {"core and layers": SPEC.body, "printed section": printed_body()}
    shapes = [solve_static(SPEC.body, [SPEC.route], [half(t)]) for t in hot]
    return {
        "hot": hot,
        "open": np.array([opening(s) for s in shapes]),
        "opened": np.array([powered(p) for p in POWERS[::2]]),
        "force": {n: pulled(b) for n, b in bodies.items()},
        "stiff": {n: pulled(b, shearable=False) for n, b in bodies.items()},
        "forced": {n: pulled(b, settle, nodes=SPEC.nodes) for n, b in bodies.items()},
    }  # fmt: skip


def bow(width: np.ndarray, force: np.ndarray) -> float:
    """Largest distance from the best straight line through the origin, over the range."""
    return float(np.max(np.abs(force - width * (width @ force) / (width @ width))) / np.ptp(force))


def table(data: dict[str, Any]) -> str:
    rows = []
    for i in range(0, len(POWERS), 4):
        exact, mj = data["open"][i], data["opened"][i // 2]
        rows.append([f"opening after {POWERS[i]:.0f} W for 2 s ({data['hot'][i]:.0f} °C)",
                     f"{exact:.2f} mm", "-", f"{mj:.2f} mm", f"{mj - exact:+.2f} mm"])  # fmt: skip
    for name, line in data["force"].items():
        three = line, data["stiff"][name], data["forced"][name]
        exact, stiff, mj = (float(np.interp(10.0, *one)) for one in three)
        rows.append([f"force at 10 mm, {name}", f"{exact:.1f} mN", f"{stiff:.1f} mN",
                     f"{mj:.1f} mN",
                     f"{100.0 * (mj / exact - 1.0):+.1f} %"])  # fmt: skip
        bows = [100.0 * bow(*one) for one in three]
        rows.append([f"off a straight line, {name}", *(f"{x:.1f} %" for x in bows), "-"])
    return studies.markdown(
        ["", "theory", "theory without shear", "MuJoCo", "MuJoCo to theory"], rows
    )


def draw(figure: Figure, data: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    left.plot(POWERS, data["open"], color=BLUE, lw=2, label="theory")
    left.plot(POWERS[::2], data["opened"], color=BLUE, label="MuJoCo, 8 nodes a finger", **MUJOCO)
    left.set(xlabel="power for 2 s [W]", ylabel="distance between the tips [mm]", ylim=(-0.5, 12))
    cold, slope = data["hot"][0], (data["hot"][-1] - data["hot"][0]) / POWERS[-1]
    functions = (lambda p: cold + slope * p, lambda t: (t - cold) / slope)
    top = left.secondary_xaxis("top", functions=functions)
    top.set_xlabel("temperature of the TCA at the end [°C]")
    left.legend(loc="upper left", frameon=False)
    for (name, line), colour in zip(data["force"].items(), (ORANGE, GREEN), strict=True):
        right.plot(*line, color=colour, lw=2, label=f"{name}, theory")
        right.plot(*data["stiff"][name], ":", color=colour, lw=2)
        right.plot(*data["forced"][name], color=colour, **MUJOCO)
    right.plot([], [], ":", color="#111111", lw=2, label="theory without shear")
    right.plot([], [], color="#111111", label="MuJoCo, 8 nodes a finger", **MUJOCO)
    right.axhline(85.0, color="#111111", lw=1, ls="--")
    right.text(0.2, 88.0, "reported standard deviation", fontsize=9)
    right.set(xlabel="opening, pulled [mm]", ylabel="force on each tip [mN]", xlim=(0, 15.5),
              ylim=(-2, 125))  # fmt: skip
    right.legend(loc="upper left", frameon=False, fontsize=9)


if __name__ == "__main__":
    studies.publish("gripper", __doc__, compute, table, draw)

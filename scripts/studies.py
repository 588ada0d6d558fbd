"""What the studies of docs/studies.md share: published laws of a TCA, angles, figures, the page.

The two laws are those of Sun, dissertation, Colorado State University, Sections 5.1.3 and 5.3.1,
for the TCA of 45 mm. They are here and not in the package, because no single law of that chapter
agrees with what is reported; see the page.
"""

import argparse
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from tca_mj.model.part import Part
from tca_mj.rod import RodShape, StrandLaw
from tca_mj.sim import Simulation
from tca_mj.tca import HeatStep, TcaSpec

BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072b2", "#d55e00", "#009e73", "#8a4fa3", "#666666"
MUJOCO = dict(ls="none", marker="o", ms=6, mfc="white", mew=1.6)  # markers of every figure
REPORTED = dict(ls="none", marker="x", ms=9, mew=2.2, color="#111111")

# Sun, Table 3.2: fibre of 175 mm, coil radius 0.408 mm, pitch 22.42°; radii, not diameters.
_FIBRE, _COIL, _PITCH, _REST = 0.175, 0.408e-3, math.radians(22.42), 45e-3
_POLAR = math.pi * 0.21e-3**4 / 2.0  # J_t, Sun, Table 3.1
SHEAR = 0.22e9  # G_t of a heated TCA, Sun, Section 3.2.2 [Pa]
# Elongation = COMPLIANCE F/G_t + UNTWIST (untwist per length), Sun, eq. (5.23).
COMPLIANCE = _FIBRE * _COIL**2 * math.cos(_PITCH) ** 2 / _POLAR  # [m Pa/N]
UNTWIST = _FIBRE * _COIL * math.cos(_PITCH)  # A_cst [m²]
_G2, _G1, _G0 = 37.58e6, 111.33e6, 0.85e6  # G_t of a passive TCA over F, Sun, Section 5.3.1
FOLD = math.sqrt(_G0 / _G2)  # where the elongation is largest [N]
LONGEST = COMPLIANCE * FOLD / (_G2 * FOLD**2 + _G1 * FOLD + _G0)  # that elongation [m]


def untwist(temperature: float) -> float:
    """Untwist per length of fibre as printed: not 0 at room temperature [rad/m]."""
    return -0.0161 * temperature**2 + 0.3338 * temperature - 7.7311


def _free_length(temperature: float, ambient: float | None) -> float:
    rest = 0.0 if ambient is None else untwist(ambient)
    return _REST + UNTWIST * (untwist(temperature) - rest)


def linear_law(
    temperature: float, *, ambient: float | None = 25.0, shear: float = SHEAR
) -> StrandLaw:
    """Sun, eq. (5.23) with a constant modulus: a linear spring that heat shortens.

    Args:
        temperature: Temperature of the TCA [°C].
        ambient: Temperature at which it is at rest at 45 mm; None takes the polynomial of the
            untwist as printed, by which a TCA of 25 °C is 0.6 mm too short.
        shear: G_t [Pa].
    """
    free, stiffness = _free_length(temperature, ambient), shear / COMPLIANCE

    def law(length: float) -> tuple[float, float]:
        taut = length > free
        return (stiffness * (length - free), stiffness) if taut else (0.0, 0.0)

    return law


def passive_law(temperature: float = 25.0) -> StrandLaw:
    """Sun, Section 5.3.1: the modulus grows with the force, 37.58 F² + 111.33 F + 0.85 MPa.

    It is a secant: elongation = COMPLIANCE F/G(F). That grows to 66.4 mm at 0.150 N and falls
    beyond, so the law is the branch below. Its stiffness is 0.104 N/m at no force.

    Raises:
        ValueError: The law, for an elongation of 66.4 mm or more.
    """
    free = _free_length(temperature, 25.0)

    def law(length: float) -> tuple[float, float]:
        longer = length - free
        if longer <= 0.0:
            return 0.0, 0.0
        if longer >= LONGEST:
            raise ValueError(f"elongation must be below {LONGEST} m, got {longer}")
        # The smaller root of _G2 d F² + (_G1 d - c) F + _G0 d = 0.
        half = 0.5 * (COMPLIANCE - _G1 * longer)
        force = _G0 * longer / (half + math.sqrt(half**2 - _G0 * _G2 * longer**2))
        modulus = _G2 * force**2 + _G1 * force + _G0
        return force, modulus**2 / (COMPLIANCE * (_G0 - _G2 * force**2))

    return law


def heated(tca: TcaSpec, power: ArrayLike, time: float = 2.0) -> NDArray[np.float64]:
    """Temperature of a TCA, in its body if it has one, after some time at constant power [°C]."""
    cold = np.full(np.shape(power), tca.ambient)
    temperature, _, _ = HeatStep.of(tca.heat, time).advance(cold, cold, np.asarray(power))
    return temperature


def bend(shape: RodShape) -> float:
    """Angle by which a body is bent, beyond half a turn too, for bends in a plane [deg]."""
    u = shape.strain
    return math.degrees(np.trapezoid(np.hypot(u[:, 0], u[:, 1]), shape.arc_length))


def direction(axis: ArrayLike) -> float:
    """Direction of a bend from the axis, or the place, of the tip, from x to y [deg]."""
    return math.degrees(math.atan2(axis[1], axis[0]))


def twist(shape: RodShape) -> float:
    """Turn of the tip about the rod's axis, beyond half a turn too [deg]."""
    r = shape.rotation[0].T @ shape.rotation
    turn = np.unwrap(np.arctan2(r[:, 1, 0] - r[:, 0, 1], r[:, 0, 0] + r[:, 1, 1]))
    return math.degrees(turn[-1] - turn[0])


def held(part: Part, temperature: Sequence[float]) -> Simulation:
    """A part with its TCAs at given temperatures [°C], once it moves no more."""
    for joint in part.spec.joints:  # of no influence on where it comes to rest
        joint.damping = 20.0 * np.asarray(joint.damping)
    sim = Simulation(part, timestep=1e-2)
    if sim.rest(temperature, quiet=2e-6) > 2e-6:
        raise RuntimeError(f"at {temperature} °C the part does not come to rest")
    return sim


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; what is rounded to 0 has no sign."""
    lines = [head, ["---"] * len(head), *rows]
    text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return re.sub(r"[-+](0\.0+)(?![0-9])", r"\1", text)


def publish(
    name: str,
    doc: str,
    compute: Callable[[], Any],
    table: Callable[[Any], str],
    draw: Callable[[Figure, Any], None],
) -> None:
    """Prints a study's table, draws its figure, and puts both into the documentation."""
    parser = argparse.ArgumentParser(description=doc)
    docs = Path(__file__).parents[1] / "docs"
    parser.add_argument("--out", type=Path, default=docs, help="where studies.md and pictures/ are")
    args = parser.parse_args()
    data = compute()
    text = table(data)
    print(text)
    draw(figure := Figure(figsize=(10.5, 4.4), layout="constrained"), data)
    for axis in figure.axes:
        axis.grid(color="#e6e6e6")
        axis.spines[["top", "right"]].set_visible(False)
    pictures = args.out / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    figure.savefig(pictures / f"study_{name}.png", dpi=110)
    page, mark = args.out / "studies.md", f"<!-- scripts/study_{name}.py -->\n"
    if page.exists():
        old = page.read_text(encoding="utf-8")
        block = re.compile(re.escape(mark) + r"(\|.*\n)*")
        page.write_text(block.sub(lambda _: f"{mark}{text}\n", old), encoding="utf-8")

"""Draws docs/pictures/tca_conical.png: a TCA on a cone turns inside out.

With --table it prints the tables of docs/coil-bvp.md instead: what the ends of a coil add to its
length, and heights of the conical TCA.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

from tca_mj.pages import table as markdown
from tca_mj.record.plots import temperature_colour
from tca_mj.tca import CATALOGUE, hanging_length
from tca_mj.tca.fibre.boundary import FibreShape, solve_fibre
from tca_mj.tca.fibre.centreline import CONICAL, Centreline

SHOWN = (25, 55, 70, 85, 100, 115, 130)  # [°C]
COILS, WEIGHTS, COLD, HOT = (10, 20, 40, 63), (2, 30, 60), 25, 160  # [1], [g], [°C]


def heated(temperature: float) -> FibreShape:
    """The conical TCA without load."""
    return solve_fibre(CONICAL.centreline(), CONICAL.fibre, temperature)


def heights(shape: FibreShape) -> np.ndarray:
    """Heights of the sections above the clamp [mm]."""
    return 1e3 * (shape.position[:, 2] - shape.position[0, 2])


def crossing() -> float:
    """Temperature at which the free end is level with the clamp [°C]."""
    return float(brentq(lambda t: heights(heated(t))[-1], 60.0, 110.0))


def table() -> str:
    """Height of the free end, height of the body and dual-side stroke, in Markdown."""
    lines = ["| temperature [°C] | free end above clamp [mm] | highest to lowest point [mm] | "
             "dual-side stroke [%] |", "|---" * 4 + "|"]  # fmt: skip
    made = heights(heated(25.0))[-1]
    for t in SHOWN:
        z = heights(heated(t))
        lines.append(
            f"| {t} | {z[-1]:.1f} | {np.ptp(z):.1f} | {100.0 * (1.0 - z[-1] / made):.0f} |"
        )
    return "\n".join(lines)


def added_by_ends() -> str:
    """What ends add to a coil that hangs free to turn, over the uniform helix; also in words."""
    made = CATALOGUE["free-stroke-made"]
    pieces = [made.of_length(made.rest_length * coils / made.coils) for coils in COILS]
    rows, added, less = [], [], {}
    for grams in WEIGHTS:
        load, lengths = 9.81e-3 * grams, {}
        for hot in (COLD, HOT):
            uniform = np.array([hanging_length(tca, hot, load) for tca in pieces])
            found = np.array([
                -solve_fibre(Centreline.of_tca(tca), tca.fibre, hot, force=(0.0, 0.0, -load)).end[2]
                for tca in pieces
            ])  # fmt: skip
            lengths[hot] = found, uniform
            added.append(1e6 * (found - uniform))
            rows.append([f"{grams} g, {hot} °C",
                         *(f"{share:.2f} %" for share in 100.0 * (found / uniform - 1.0))])
        (cold, cold_uniform), (warm, warm_uniform) = lengths[COLD], lengths[HOT]
        less[grams] = 100.0 * (1.0 - (cold - warm) / (cold_uniform - warm_uniform))
    said = "; ".join(f"{grams} g {', '.join(f'{x:.1f}' for x in less[grams])} %" for grams in less)
    return "\n".join([
        *markdown(["load, temperature", *(f"{coils} coils" for coils in COILS)], rows), "",
        f"They add {np.min(added):.0f} to {np.max(added):.0f} µm.",
        f"The contraction between the temperatures is smaller by: {said}.",
    ])  # fmt: skip


def draw(figure: Figure) -> None:
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    for k, t in enumerate(SHOWN):
        shape, colour, shift = heated(t), temperature_colour(t), 27.0 * k
        x = 1e3 * (shape.position[:, 0] - shape.position[0, 0]) + shift
        z, depth = heights(shape), shape.position[:, 1]
        front = depth < np.median(depth)
        left.plot(x, z, color=colour, lw=1.0, alpha=0.55)
        left.plot(np.where(front, x, np.nan), np.where(front, z, np.nan), color=colour, lw=2.2)
        left.plot(x[0], 0.0, "^", color="#0072b2", ms=8, zorder=3)
        left.plot(x[-1], z[-1], "o", color="#d00000", ms=6, zorder=3)
        left.text(shift, 65.0, f"{t} °C", ha="center", fontsize=9)
    left.set(xticks=[], ylabel="height above the clamp [mm]", ylim=(-78, 72), aspect="equal")
    left.set_xlabel("seen from the side; triangle: clamped, circle: free end", fontsize=9)
    temperature = np.linspace(25.0, 160.0, 136)
    z = [heights(heated(t)) for t in temperature]
    right.fill_between(temperature, [h.min() for h in z], [h.max() for h in z], color="#dfe7ee",
                       label="from the lowest to the highest point")  # fmt: skip
    right.plot(temperature, [h[-1] for h in z], color="#d00000", lw=2, label="free end")
    right.axhline(0.0, color="#0072b2", lw=1)
    level = crossing()
    right.plot(level, 0.0, "o", color="#d00000", ms=5)
    right.annotate(f"{level:.0f} °C: stroke 100 %", (level, 0.0), (92, 22), fontsize=9,
                   arrowprops={"arrowstyle": "-", "color": "#666666"})  # fmt: skip
    right.set(xlabel="temperature [°C]", ylabel="height above the clamp [mm]",
              xlim=(25, 160), ylim=(-90, 72))  # fmt: skip
    right.legend(loc="lower left", frameon=False, fontsize=9)
    right.grid(color="#e6e6e6")
    for axis in (left, right):
        axis.spines[["top", "right"]].set_visible(False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs/pictures")
    parser.add_argument("--table", action="store_true", help="print the tables, draw nothing")
    args = parser.parse_args()
    if args.table:
        return print(added_by_ends(), table(), sep="\n\n")
    args.out.mkdir(parents=True, exist_ok=True)
    draw(figure := Figure(figsize=(11.0, 4.6), layout="constrained"))
    figure.savefig(args.out / "tca_conical.png", dpi=120)


if __name__ == "__main__":
    main()

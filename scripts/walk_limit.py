"""What limits the walk: how fast a leg's foot can swing, as its TCAs heat and cool.

Writes docs/pictures/walk_limit.png and prints the table of docs/tetrapod.md.

A foot is drawn forwards by one TCA and backwards by another. In a cycle of period P each is heated
up to the hottest temperature allowed and then cools in the air. A foot that carries without sliding
moves against the body as fast as the body gets on. Four legs of which two at a time carry do so for
half of the cycle each, so that v <= S/(P/2), where S is the largest change of a foot's place within
P/2. If more than two carry at a time, the bound is lower. The load, the lifting TCA and the other
legs, which all take from S, are left out.
"""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.modules.continuum_leg import LegSpec
from tca_mj.rod import solve_static
from tca_mj.routes import parallel
from tca_mj.tca import HeatSpec, law_at, step_temperature

Array = NDArray[np.float64]

POWERS = {"4 W": TetrapodGait.max_power, "any power": 1e3}  # of a TCA [W]
PERIODS = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0])  # [s]
SAMPLES = 200  # of a cycle
GRID = np.linspace(25.0, 180.0, 9)  # temperatures at which the leg is solved [°C]


def foot_place(leg: LegSpec) -> Any:
    """Fore-aft place of the foot over the temperatures of two TCAs, by rod theory, no load [m]."""
    law = partial(law_at, leg.tca.of_length(leg.length))
    routes = parallel(leg.count, leg.offset)
    place = np.zeros((len(GRID), len(GRID)))
    for i, front in enumerate(GRID):
        for j, rear in enumerate(GRID[: i + 1]):
            shape = solve_static(leg.body, routes, [law(25.0), law(front), law(rear)])
            foot = shape.tip + leg.foot_radius * shape.rotation[-1][:, 2]
            # TCA 1 is at 120° from the x axis: y is the fore-aft direction.
            place[i, j], place[j, i] = foot[1], -foot[1]
    return RectBivariateSpline(GRID, GRID, place, s=0)


def cycle(heat: HeatSpec, period: float, heated: float, power: float, hottest: float) -> Array:
    """Temperature over a cycle that ends its heating at ``hottest``, shape (SAMPLES,) [°C].

    It is heated at ``power`` for the share ``heated`` of the cycle; where that is too much, it is
    heated more gently, to be as hot at the end as it was at the start of the cooling.
    """
    dt = period / SAMPLES
    on = np.arange(SAMPLES) < round(heated * SAMPLES)
    cooled = float(step_temperature(hottest, 0.0, heat, period * (1.0 - on.mean())))
    # The power that brings it from there to the hottest temperature in the time of heating.
    decay = np.exp(-heat.loss * period * on.mean() / heat.capacity)
    needed = heat.loss * ((hottest - cooled * decay) / (1.0 - decay) - heat.ambient)
    if needed > power:  # never gets as hot: the periodic course of full power
        fade = np.exp(-heat.loss * period / heat.capacity)
        rise = power / heat.loss
        cooled = heat.ambient + rise * (1.0 - decay) * fade / decay / (1.0 - fade)
        needed = power
    temperature, out = cooled, np.empty(SAMPLES)
    for i in range(SAMPLES):
        temperature = float(step_temperature(temperature, needed * on[i], heat, dt))
        out[i] = temperature
    return out


def bound(place: Any, heat: HeatSpec, period: float, power: float) -> tuple[float, float]:
    """Largest swing S in half a cycle [m] and the speed that it allows [m/s]."""
    best = 0.0
    for heated in np.linspace(0.05, 0.9, 18):
        front = cycle(heat, period, heated, power, TetrapodGait.hot_temperature)
        for lag in range(0, SAMPLES, 10):
            foot = place(front, np.roll(front, lag), grid=False)
            best = max(best, float(np.max(np.roll(foot, -SAMPLES // 2) - foot)))
    return best, best / (0.5 * period)


def main(argv: list[str] | None = None) -> None:
    """Computes the bounds, draws them and prints their table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/pictures/walk_limit.png"))
    parser.add_argument("--loss", type=float, default=1.0,
                        help="factor of the heat lost to the air, as with a fan; draws nothing")
    args = parser.parse_args(argv)
    leg = LegSpec()
    heat, place = leg.tca.of_length(leg.length).heat, foot_place(leg)
    heat = replace(heat, loss=args.loss * heat.loss)
    rows = {
        name: np.array([bound(place, heat, period, power) for period in PERIODS])
        for name, power in POWERS.items()
    }
    print(f"| period | {' | '.join(f'{name}: swing | speed at most' for name in rows)} |")
    print(f"|---{'|---|---' * len(rows)}|")
    for i, period in enumerate(PERIODS):
        cells = [f"{1e3 * row[i, 0]:.1f} mm | {1e3 * row[i, 1]:.1f} mm/s" for row in rows.values()]
        print(f"| {period:g} s | {' | '.join(cells)} |")
    if args.loss != 1.0:
        return

    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    for (name, row), colour in zip(rows.items(), ("#2f6db3", "#d9822b"), strict=True):
        axes.plot(PERIODS, 1e3 * row[:, 1], "o-", color=colour, label=name)
    axes.axhline(9.0, color="0.5", lw=1.0, ls="--")
    axes.text(20.0, 9.2, "published 9 mm/s", ha="right", va="bottom", color="0.35", fontsize=8)
    axes.set(xlabel="period of the gait [s]", ylabel="speed at most [mm/s]", ylim=(0.0, None))
    axes.legend(frameon=False, title="power of a TCA")
    axes.spines[["top", "right"]].set_visible(False)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(args.out, dpi=150)


if __name__ == "__main__":
    main()

"""Prints the tables of docs/models.md: what each model of a TCA costs, and what they differ by.

    python scripts/models_page.py    seconds of one core

Costs are medians of processor time.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from tca_mj.bench.clock import median, taken
from tca_mj.pages import command_line, table
from tca_mj.tca import CATALOGUE, CoilSurfaces, TcaBank, calibrate, hanging_length, law_at
from tca_mj.tca.fibre.boundary import solve_fibre
from tca_mj.tca.fibre.centreline import Centreline

FEW, MANY = 5, 10_000
TCA, MADE = CATALOGUE["free-stroke"], CATALOGUE["free-stroke-made"]
WEIGHT = 0.060 * 9.81  # [N]
COILS = (5, 20, 63)  # of the fibres that are solved as a boundary value problem
# Name of a model, and how it is asked for; Kirchhoff's rod is Love's with its end free.
MODELS = (
    ("rod (uniform helix, Cosserat)", {"model": "rod", "spin": "free"}),
    ("rod", {"model": "rod", "spin": "locked"}),
    ("Kirchhoff (no shear, no stretch)", {"model": "love", "spin": "free"}),
    ("Love", {"model": "love", "spin": "locked"}),
    ("Castigliano, linear", {"model": "cst", "scheme": "linear", "spin": "free"}),
    ("Castigliano, implicit", {"model": "cst", "scheme": "implicit", "spin": "free"}),
    ("Castigliano, path-following", {"model": "cst", "scheme": "path", "spin": "free"}),
)
ENDS = {"free": "free to spin", "locked": "glued"}


def contractions() -> list[str]:
    """How far the TCA as made lifts 60 g, heated from 25 to 160 °C."""
    rows: list[list[str]] = []
    rod = 0.0
    for name, how in MODELS:
        asked: Any = how
        cold, hot = hanging_length(MADE, [25.0, 160.0], WEIGHT, **asked)
        over = f"{100.0 * ((cold - hot) / rod - 1.0):.0f} %" if rod else ""
        rod = rod or cold - hot
        rows.append([name, ENDS[how["spin"]], f"{1e3 * (cold - hot):.2f} mm", over])
    return table(["model", "ends", "60 g: contraction", "over the rod"], rows)


def told(seconds: Sequence[float], scale: float, unit: str) -> str:
    """A time, or the least and the most of several, with two digits."""
    low, high = (f"{scale * float(f'{t:.2g}'):g}" for t in (min(seconds), max(seconds)))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def pulls(law: Any) -> str:
    """What ``TcaBank.pull`` takes for some TCAs, and for one of many."""
    seconds = []
    for n in (FEW, MANY):
        random, bank = np.random.default_rng(0), TcaBank([TCA] * n, law=law)
        state, _ = bank.steady(random.uniform(25.0, 160.0, n))
        length = TCA.rest_length * random.uniform(0.8, 1.6, n)
        seconds.append(median(partial(bank.pull, state, length), 1000 if n == FEW else 40))
    few, many = seconds[0], seconds[1] / MANY
    return f"{told([few], 1e6, 'µs')} for {FEW} TCAs, {told([many], 1e6, 'µs')} each in {MANY:,}"


def lengths(**how: Any) -> float:
    """What ``hanging_length`` takes for one of many loads and temperatures [s]."""
    random = np.random.default_rng(0)
    temperature, load = random.uniform(25.0, 160.0, MANY), random.uniform(0.02, 0.6, MANY)
    return median(partial(hanging_length, TCA, temperature, load, **how), 20) / MANY


def made(calls: Sequence[Callable[[], object]]) -> str:
    """What calls take that are made once."""
    return told([taken(call) for call in calls], 1e3, "ms")


def fibre(coils: int, temperature: float) -> Callable[[], object]:
    """A hanging coil as a boundary value problem."""
    tca = MADE.of_length(MADE.rest_length * coils / MADE.coils)
    force = (0.0, 0.0, -WEIGHT / 2.0)
    return partial(solve_fibre, Centreline.of_tca(tca), tca.fibre, temperature, force=force)


def costs() -> list[str]:
    """What each model is for, takes, and how far it is off."""
    kinds = list(CATALOGUE.values())
    once = made([partial(CoilSurfaces, [tca]) for tca in kinds])  # kept from then on
    bounds = [calibrate(tca).bound for tca in kinds]
    off = f"{1e5 * max(b.relative for b in bounds):.1f}e-5 of the tension above 0.05 N,"
    under = f"{1e6 * max(b.absolute for b in bounds):.1f} µN below"
    law = law_at(TCA, 100.0)
    fibres = made([fibre(coils, hot) for coils in COILS for hot in (25.0, 160.0)])
    one = told([median(partial(hanging_length, TCA, 100.0, 0.3), 200)], 1e6, "µs")
    rods = told([lengths(spin=spin) for spin in ENDS], 1e6, "µs")
    implicit = [lengths(model="love"), lengths(model="cst")]
    path = told([lengths(model="cst", scheme="path")], 1e6, "µs")
    return table(["you want", "use", "cost", "how far it is off"], [
        ["a robot or many TCAs", '`TcaBank(specs, law="surface")`',
         f"{pulls('surface')}; {once} once per kind of coil and process", f"{off} {under}"],
        ["the same, exact", "`TcaBank(specs)` (the rod, ends glued)", pulls("rod"),
         "the reference for glued ends"],
        ["what a soft body at rest feels of a TCA",
         "`law_at(tca, temperature)`, a function of the length",
         f"{told([median(partial(law, 0.05), 200)], 1e6, 'µs')} for one",
         "as `model` and `spin` say; slack is 0"],
        ["the length under a weight, ends free or glued",
         "`hanging_length(tca, temperature, load)`", f"{rods} each in {MANY:,}, {one} for one",
         "uniform helix: no end effects"],
        ["a coil that is not uniform, or a short one",
         "`solve_fibre(centreline, fibre, temperature, force)`, see [coil-bvp.md](coil-bvp.md)",
         f"{fibres} for {COILS[0]} to {COILS[-1]} coils under 30 g",
         "its own `error`, 1e-6 of the fibre by default; no contact"],
        ["formulas, or to compare with the literature",
         '`hanging_length(..., model="love")` or `"cst"`',
         f"{told(implicit, 1e6, 'µs')} each in {MANY:,}, path-following CST {path}", "see below"],
    ])  # fmt: skip


def main() -> None:
    command_line(__doc__).parse_args()
    print("\n".join([*costs(), "", *contractions()]))


if __name__ == "__main__":
    main()

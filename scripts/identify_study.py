"""The study behind docs/identification.md: how often stated intervals hold, and how wide they are.

    python scripts/identify_study.py --out runs/identify     goes on where it was stopped
    python scripts/identify_study.py --out runs/identify --page
    python scripts/identify_study.py --pictures              docs/pictures/own_muscle_*.png

Every case is a TCA drawn by its own number as seed. A bench measures it with the errors of
``simulated_bench``; the fit starts at the thread of the catalogue, not at the truth, and knows the
geometry. A line of ``cases.jsonl`` is one case.
"""

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from tca_mj.files import append_whole
from tca_mj.pages import table, write_between
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.identify import constants_of, identify, simulated_bench, with_constants
from tca_mj.tca.identify.constants import CONSTANTS, encoded
from tca_mj.tca.identify.fit import SHARE, Problem
from tca_mj.tca.identify.predict import outcomes
from tca_mj.validation.residuals import residuals_picture

CASES, ROWS = 200, 100
DOCS = Path(__file__).resolve().parent.parent / "docs"
HELD, GAINS = (f"scripts/identify_study.py: {what}" for what in ("intervals", "gains"))
ORDER = ("stretch.csv", "length.csv", "force.csv", "step.csv", "resistance.csv")
_THREAD = CATALOGUE["free-stroke"]
_PLAIN = replace(_THREAD.fibre, load_softening=(0.0, 0.0, 1.0))


def drawn(seed: int) -> tuple[TcaSpec, TcaSpec]:
    """A TCA, and what is known of it before it is measured."""
    random = np.random.default_rng(seed)
    radius, coil = random.uniform(0.12e-3, 0.3e-3), random.uniform(2.0, 3.0)
    length, natural = random.uniform(0.1, 0.35), math.radians(random.uniform(14.0, 22.0))
    touching = math.asin(1.0 / (math.pi * coil))
    fibre = replace(_PLAIN, radius=radius, inserted_twist=_PLAIN.inserted_twist * 0.21e-3 / radius)
    tca = replace(
        _THREAD, fibre=fibre, fibre_length=length, coil_radius=coil * radius, pitch_angle=natural,
        minimum_pitch_angle=min(touching, 0.8 * natural),
    )  # fmt: skip
    young = 1.2e9 * math.exp(random.uniform(-0.6, 0.9))
    growth = random.uniform(0.6, 1.4)
    tca = with_constants(tca, {
        "young": young, "shear": young / random.uniform(3.0, 8.0),
        "softening_rate": random.uniform(1.5e-4, 6e-4),
        "growth_50": 0.0141 * growth, "growth_100": 0.0458 * growth * random.uniform(0.8, 1.2),
        "resistance_per_length": random.uniform(20.0, 150.0),
        "stretch_resistance": random.uniform(0.05, 0.3),
        "contraction_resistance": random.uniform(0.3, 0.9),
        "specific_heat": random.uniform(900.0, 1800.0),
        "heat_loss": tca.heat_loss * random.uniform(0.5, 2.0),
        "ambient": random.uniform(18.0, 30.0),
    })  # fmt: skip
    start = constants_of(_THREAD) | {
        "rest_length": tca.rest_length * random.uniform(0.95, 1.05),
        "minimum_length": tca.minimum_length * random.uniform(0.95, 1.05),
    }
    known = ("fibre_length", "radius", "coil_radius", "inserted_twist", "line_density")
    return tca, with_constants(tca, {n: v for n, v in start.items() if n not in known})


def case(seed: int) -> dict:
    """What the fit of one TCA says, beside the truth and the bound of Cramer and Rao."""
    tca, start = drawn(seed)
    truth = constants_of(tca)
    data = simulated_bench(tca, ROWS, seed)
    found = identify(data, start, compare=False)
    old = found.fit.problem
    at_truth = np.array([encoded(n, truth[n]) for n in old.names])
    exact = Problem.of(data, tca, "rod", old.ends, old.names, {}, {})
    slopes = exact.slopes(at_truth, np.ones(len(data)))
    bound = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    rows = {}
    for each, least in zip(found.found, bound.tolist(), strict=True):
        size = truth[each.name] if CONSTANTS[each.name].log else 1.0
        rows[each.name] = {
            "truth": truth[each.name], "value": each.value, "state": each.state,
            "interval": each.interval, "bound": least * size,
        }  # fmt: skip
    return {"seed": seed, "constants": rows, "scales": found.fit.scales.tolist()}


def summary(cases: list[dict]) -> list[str]:
    """The table of the page: a row for each constant, then all together."""

    def row(name: str, every: list[dict]) -> list[str]:
        good = [each for each in every if each["state"] == "identified"]
        if not good:
            return [name, f"0 of {len(every)}", "", "", "", "", ""]
        inside = [each["interval"][0] <= each["truth"] <= each["interval"][1] for each in good]
        wide = [(each["interval"][1] - each["interval"][0]) / (3.92 * each["bound"])
                for each in good]  # fmt: skip
        size = [each["bound"] / abs(each["truth"]) for each in good]
        off = np.array([(each["value"] - each["truth"]) / each["bound"] for each in good])
        return [name, f"{len(good)} of {len(every)}", f"{100.0 * np.mean(inside):.1f} %",
                f"{100.0 * np.median(size):.2g} %", f"{np.median(wide):.2f}", f"{max(wide):.2f}",
                f"{off.mean():+.2f} ± {off.std() / math.sqrt(len(off)):.2f}"]  # fmt: skip

    names = list(cases[0]["constants"])
    found = {name: [each["constants"][name] for each in cases] for name in names}
    heads = ["constant", "identified", "truth inside", "error, median", "width over bound, median",
             "largest", "off, mean, over bound"]  # fmt: skip
    rows = [row(f"`{name}`", every) for name, every in found.items()]
    every = row("all", [each for every in found.values() for each in every])
    return table(heads, [*rows, [*every[:-1], ""]])


def gains() -> list[str]:
    """Errors of the constants of the catalogue's coil as file is added to file, by the bound."""
    tca = replace(_THREAD, fibre=_PLAIN)
    data = simulated_bench(tca, ROWS, 0)
    names = [name for name in constants_of(tca) if CONSTANTS[name].own]
    ends = [each.ends or "locked" for each in data]
    problem = Problem.of(data, tca, "rod", ends, names, {}, {})
    slopes = problem.slopes(problem.start, np.ones(len(data)))
    sizes = [each.rows * len(outcomes(each)) for each in data]
    parts = dict(zip([each.name for each in data], np.split(slopes, np.cumsum(sizes)),
                     strict=False))  # fmt: skip
    before = slopes[problem.size :]
    columns = []
    for i in range(len(ORDER)):
        rows = np.concatenate([*(parts[name] for name in ORDER[: i + 1]), before])
        left = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
        columns.append([
            "" if error > SHARE * CONSTANTS[name].width
            else f"{100.0 * error:.2g} %" if CONSTANTS[name].log else f"{error:.2g} K"
            for name, error in zip(names, left, strict=True)
        ])  # fmt: skip
    heads = ["constant", f"`{ORDER[0]}`", *(f"and `{name}`" for name in ORDER[1:])]
    return table(heads, [[f"`{name}`", *row] for name, *row in zip(names, *columns, strict=True)])


def draw_pictures() -> None:
    """Two sets of the page's bench with what the fit expects."""
    known = replace(_THREAD, fibre=_PLAIN)
    hidden = with_constants(known, {"shear": 0.3e9, "growth_100": 0.055})
    found = identify(simulated_bench(hidden, ROWS, 1), known, compare=False)
    for data in found.data:
        if data.name in ("length.csv", "step.csv"):
            path = DOCS / "pictures" / f"own_muscle_{data.name.removesuffix('.csv')}.png"
            residuals_picture(found, data, path)


def main() -> None:
    """Goes on with the cases, and prints the table or writes it into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("runs/identify"))
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--page", action="store_true", help="write the tables into the page")
    parser.add_argument("--pictures", action="store_true", help="draw the pictures, nothing else")
    asked = parser.parse_args()
    if asked.pictures:
        return draw_pictures()
    path = asked.out / "cases.jsonl"
    asked.out.mkdir(parents=True, exist_ok=True)
    lines = path.read_text().splitlines() if path.exists() else []
    done = {each["seed"]: each for each in map(json.loads, lines)}
    seeds = range(asked.first, asked.first + asked.cases)
    for seed in seeds:
        if seed not in done:
            done[seed] = case(seed)
            append_whole(path, (json.dumps(done[seed]) + "\n").encode())
    held = summary([done[seed] for seed in seeds])
    for mark, rows in ((HELD, held), (GAINS, gains())):
        print("\n".join(rows), end="\n\n")
        if asked.page:
            write_between(DOCS / "identification.md", mark, rows)


if __name__ == "__main__":
    main()

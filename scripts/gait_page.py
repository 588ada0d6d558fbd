"""Trains gaits with several seeds, searches for as long, and writes docs/gaits.md.

    python scripts/gait_page.py                               what is missing, then the page
    python scripts/gait_page.py --tasks TCA/TetrapodWalk-v0   of one task; the page of all there is
    python scripts/gait_page.py --page                        the page alone, of what is there
    python scripts/gait_page.py --commands                    how the shipped walker follows
    python scripts/gait_page.py --others --tasks TASK         script, search and corrections anew

Runs and evaluations are kept in runs/gaits; a second call goes on where the first one stopped.
``docs/gaits.json`` holds the figures of the page, which tests compare with.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from tca_mj.agents.evaluate import Evaluation, evaluate, figures
from tca_mj.agents.policies import shipped
from tca_mj.agents.scripts.guided import WALKER
from tca_mj.agents.train.config import default_config, described
from tca_mj.agents.train.deep import EVALUATIONS, train
from tca_mj.files import write_whole
from tca_mj.pages import table
from tca_mj.registry import DEMOS, TASKS

ROOT = Path(__file__).resolve().parent.parent
PAGE, DATA = ROOT / "docs" / "gaits.md", ROOT / "docs" / "gaits.json"
PICTURES = ROOT / "docs" / "pictures"
GAITS = [task.id for task in TASKS if "gait" in task.kwargs]
SEEDS = tuple(range(5))  # chosen before anything was trained
ROBOTS = {"episodes": 16, "seed": 1000, "randomise": 0.2}  # the same for everybody
NOMINAL = {"episodes": 1, "seed": 0}
COMMANDED = {"episodes": 2, "seed": 0}
CORRECTED = {"TCA/TetrapodCrawl-v0": 40.0}  # by how much the searched gait is, too [K]
SHOWN = ("speed", "energy_per_metre", "peak_temperature", "drift")
LEVEL = 0.95

INTRODUCTION = """\
# Learned gaits

What the recipe of each gait task makes of five seeds, which were chosen beforehand, beside the
script and the searched gait that comes with the package. This page is written by one command, which
goes on where it was interrupted:

```sh
python scripts/gait_page.py
```

Everybody walks the same 16 robots, whose friction, mass, TCA gain and heat loss are off by up to
20 % and whose surroundings by up to 5 K (seeds 1000 to 1015), for 60 s from cold, at the task's own
time step; *nominal* is one robot that is off by nothing. A policy is the best of its run by the
run's own evaluations, on five robots with other seeds, which differ from run to run; the curves
show those. In brackets the 95 % interval of the mean, by
Student's t: over seeds for the mean of five, over robots for a single policy.
"""


def name_of(task: str) -> str:
    """Of a task, for files."""
    return task.partition("/")[2].partition("-")[0]


def interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Mean and the ends of its interval."""
    mean, n = float(np.mean(values)), len(values)
    half = float(stats.t.ppf(0.5 + LEVEL / 2.0, n - 1) * stats.sem(values)) if n > 1 else np.nan
    return mean, mean - half, mean + half


def measured(task: str, policy: str, out: Path) -> dict[str, Any]:
    """Figures of a policy on the robots and on the nominal one."""
    found = {}
    for name, settings in (("robots", ROBOTS), ("nominal", NOMINAL)):
        summary = evaluate(Evaluation(task=task, policy=policy, **settings), out=out / name)
        found[name] = figures(summary["episodes"])
    return found


def trained(task: str, seed: int, out: Path, **change: Any) -> dict[str, Any]:
    """A run of the recipe, or of what differs from it, its figures and its curve."""
    config, before = default_config(task, seed=seed, **change), time.process_time()
    print(described(config), flush=True)
    folder = out / f"seed_{seed}"
    more = "".join(f" --{name} {value}" for name, value in change.items())
    train(config, folder, command=f"tca-mj train {task}{more} --seed {seed}", video=False)
    spent, used = folder / "processor_time.json", time.process_time() - before
    if spent.is_file():  # the run went on, or was done
        used += json.loads(spent.read_text(encoding="utf-8"))
    write_whole(spent, json.dumps(round(used)).encode())
    with (folder / EVALUATIONS).open(encoding="utf-8", newline="") as text:
        rows = [(float(row["steps"]), float(row["speed"])) for row in csv.DictReader(text)]
    return {
        "processor_time": json.loads(spent.read_text(encoding="utf-8")),
        "curve": rows,
        **measured(task, str(folder), out / f"seed_{seed}" / "measured"),
    }


def followed() -> list[str]:
    """How the shipped walker follows commands, as Markdown: nominal robots, seeds 0 and 1."""
    demo = DEMOS["square"]
    told = {f"{45 * k}°": {"direction": math.remainder(k * math.pi / 4.0, 2.0 * math.pi)}
            for k in range(8)}  # fmt: skip
    told |= {"stand": {"speed": 0.0}, "4.5 mm/s": {"speed": 4.5e-3},
             "turn left": {"turning": 0.03}, "turn right": {"turning": -0.03},
             "0°, pushed by 0.05 m/s every 10 s": {"push": 0.05, "push_every": 10.0},
             "0°, up a slope of 5°": {"slope": math.radians(5.0)}}  # fmt: skip
    rows, speeds = [], []
    for name, options in told.items():
        evaluation = Evaluation(task=demo.task, policy=WALKER, options=options, **COMMANDED)
        found = evaluate(evaluation, progress=False)["figures"]
        speeds.append(found["speed"]["mean"])
        astray = math.degrees(found["heading_error"]["most"])
        rows.append([name, f"{1e3 * speeds[-1]:.2f}", f"{1e3 * found['distance']['mean']:.0f}",
                     f"{astray:.1f}"])  # fmt: skip
    rows.append(["mean of the eight directions", f"{1e3 * np.mean(speeds[:8]):.2f}", "", ""])
    return table(["command", "speed along it [mm/s]", "in 60 s [mm]",
                  "most off its heading [°]"], rows)  # fmt: skip


def searched(task: str) -> str:
    """The searched gait of a task that comes with the package."""
    name = f"tetrapod-{name_of(task).removeprefix('Tetrapod').lower()}"
    assert name in shipped()
    return name


def others(task: str, out: Path) -> dict[str, Any]:
    """Figures of the script and of the searched gait that comes with the package."""
    return {name: measured(task, name, out / name) for name in ("scripted", searched(task))}


def corrected(task: str, out: Path) -> dict[str, Any]:
    """The searched gait as it is corrected by SAC, by seed; nothing but of some tasks."""
    if task not in CORRECTED:
        return {}
    change = {"residual": CORRECTED[task], "start": searched(task)}
    runs = {str(seed): trained(task, seed, out / "corrected", **change) for seed in SEEDS}
    recipe = described(default_config(task, seed=0, **change)).rpartition(", seed")[0]
    return {"corrected": runs, "correction": recipe}


def of_task(task: str, out: Path) -> dict[str, Any]:
    """Everything about a task, run as far as it is missing."""
    return {
        "recipe": described(default_config(task, seed=0)).rpartition(", seed")[0],
        "others": others(task, out),
        "seeds": {str(seed): trained(task, seed, out) for seed in SEEDS},
        **corrected(task, out),
    }  # fmt: skip


def cell(values: Sequence[float | None], factor: float, digits: int) -> str:
    """A mean with its interval."""
    mean, low, high = (np.nan if v is None else factor * v for v in values)
    text = f"{mean:.{digits}f}"
    return f"{text} ({low:.{digits}f} to {high:.{digits}f})" if np.isfinite(low) else text


def rows_of(found: dict[str, Any]) -> list[list[str]]:
    """The lines of a task's table."""
    lines = figures_of(found["others"])
    for kind, name in (("seeds", "SAC"), ("corrected", "corrected by SAC")):
        several = found.get(kind, {})
        lines += figures_of({f"{name}, seed {seed}": each for seed, each in several.items()})
        lines += mean_of(name, [*several.values()]) if len(several) > 1 else []
    return lines


def figures_of(several: dict[str, Any]) -> list[list[str]]:
    """Lines of policies."""
    lines = []
    for name, each in several.items():
        robots, nominal = each["robots"], each["nominal"]
        speed = robots["speed"]
        lines.append([
            name, cell([speed["mean"], speed["low"], speed["high"]], 1e3, 2),
            f"{1e3 * speed['least']:.2f}", f"{1e3 * nominal['speed']['mean']:.2f}",
            f"{1e-3 * robots['energy_per_metre']['mean']:.2f}",
            f"{robots['peak_temperature']['most']:.0f}",
            f"{each['processor_time'] / 60.0:.1f}" if "processor_time" in each else "",
        ])  # fmt: skip
    return lines


def mean_of(name: str, several: list[dict[str, Any]]) -> list[list[str]]:
    """The line of the mean over seeds."""
    mean = [
        interval([each[kind]["speed"]["mean"] for each in several])
        for kind in ("robots", "nominal")
    ]
    energy = np.mean([each["robots"]["energy_per_metre"]["mean"] for each in several])
    return [[
        f"**{name}, mean of {len(several)} seeds**", f"**{cell(mean[0], 1e3, 2)}**",
        f"{1e3 * min(each['robots']['speed']['least'] for each in several):.2f}",
        f"**{cell(mean[1], 1e3, 2)}**", f"{1e-3 * energy:.2f}",
        f"{max(each['robots']['peak_temperature']['most'] for each in several):.0f}",
        f"{np.mean([each['processor_time'] for each in several]) / 60.0:.1f}",
    ]]  # fmt: skip


def draw(task: str, found: dict[str, Any]) -> Path:
    """The learning curves of a task: mean and interval over seeds, and the levels of others."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
    curves = [np.array(each["curve"]) for each in found["seeds"].values()]
    steps = curves[0][:, 0]
    speeds = np.array([np.interp(steps, *curve.T) for curve in curves]) * 1e3
    band = np.array([interval(column) for column in speeds.T])
    axes.fill_between(steps, band[:, 1], band[:, 2], alpha=0.25, lw=0.0, color="C0")
    for row in speeds:
        axes.plot(steps, row, color="C0", lw=0.6, alpha=0.5)
    axes.plot(steps, band[:, 0], color="C0", lw=2.0, label="SAC, mean of five seeds")
    for i, (name, each) in enumerate(found["others"].items()):
        level = 1e3 * each["robots"]["speed"]["mean"]
        axes.axhline(level, color=f"C{i + 1}", ls="--", label=f"{name}, {level:.1f}")
    axes.set(xlabel="decisions", ylabel="speed on robots off by 20 % [mm/s]", title=task,
             ylim=(min(0.0, float(speeds.min())), None))  # fmt: skip
    axes.legend(frameon=False, loc="lower right")
    axes.grid(alpha=0.3)
    path = PICTURES / f"gaits_{name_of(task)}.png"
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path


HEADS = ["policy", "speed on 16 robots [mm/s]", "slowest of them", "nominal [mm/s]",
         "energy per metre [kJ/m]", "hottest TCA [°C]", "processor time [min]"]  # fmt: skip


def page(results: dict[str, dict[str, Any]], notes: str) -> str:
    """The whole page; what stands below the last table was written by hand."""
    lines = [INTRODUCTION]
    if len(results) < len(GAITS):
        missing = ", ".join(f"`{task}`" for task in GAITS if task not in results)
        lines += [f"Not run with five seeds so far: {missing}.", ""]
    for task, found in results.items():
        more = [f"Corrected: {found['correction']}.", ""] if "correction" in found else []
        lines += [f"## `{task}`", "", f"{found['recipe']}.", "", *more,
                  *table(HEADS, rows_of(found)), "",
                  f"![Learning curves of {task}](pictures/gaits_{name_of(task)}.png)",
                  ""]  # fmt: skip
    return "\n".join([*lines, notes])


BY_HAND = "## What the policies do"


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", nargs="+", choices=GAITS, default=GAITS, metavar="TASK")
    parser.add_argument("--page", action="store_true", help="run nothing")
    parser.add_argument("--others", action="store_true", help="what the recipe gave stays")
    parser.add_argument("--commands", action="store_true", help="how commands are followed, alone")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "gaits")
    arguments = parser.parse_args(argv)
    if arguments.commands:
        print("\n".join(followed()))
        return
    results = json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}
    for task in [] if arguments.page else arguments.tasks:
        out = arguments.out / name_of(task)
        if arguments.others:
            again = {"others": others(task, out), **corrected(task, out)}
            results[task] = {**results.get(task, {}), **again}
        else:
            results[task] = of_task(task, out)
        draw(task, results[task])
        DATA.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    old = PAGE.read_text(encoding="utf-8") if PAGE.is_file() else ""
    notes = old[old.index(BY_HAND) :] if BY_HAND in old else f"{BY_HAND}\n"
    in_order = {task: results[task] for task in GAITS if task in results}
    PAGE.write_text(page(in_order, notes), encoding="utf-8")
    print(f"{PAGE}\n{DATA}")


if __name__ == "__main__":
    main()

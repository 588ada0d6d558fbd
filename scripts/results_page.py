"""Evaluates every agent in every task and writes docs/results.md, with its data and its pictures.

Tables of docs/training.md, on the policies that come with the package, of docs/tetrapod.md, on the
scripts of the gaits, and of docs/tetrapod-model.md, on finer models, are written, too.

    python scripts/results_page.py                            what is missing, then the page
    python scripts/results_page.py --tasks TCA/BendReach-v0   of one task; the page of all there is
    python scripts/results_page.py --page                     the page alone, of what is there
    python scripts/results_page.py --factors                  single factors of gaits, too: an hour

Finished episodes are kept in runs/results; a second run goes on where the first one stopped.
``docs/results.json`` holds the figures of the page, which tests compare with; where episodes are
not kept any more, a figure of the same settings, policy and versions is taken from it. Learning
curves are those that come with the policies, ``agents/policies/NAME.csv``.
"""

import argparse
import csv
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tca_mj.agents.evaluate import METRICS, Evaluation, cell, evaluate, figures
from tca_mj.agents.finished import EPISODES, kept
from tca_mj.agents.policies import SavedPolicy, shipped
from tca_mj.envs.gaits import TASKS as PUBLISHED
from tca_mj.pages import table as markdown
from tca_mj.pages import write_between
from tca_mj.registry import TASKS, find_task, task_class

ROOT = Path(__file__).resolve().parent.parent
PAGE, DATA = ROOT / "docs" / "results.md", ROOT / "docs" / "results.json"
PICTURES = ROOT / "docs" / "pictures"
COURSE = "TCA/TetrapodCourse-v0"
MARK = "scripts/results_page.py"
TRAINING, TETRAPOD = ROOT / "docs" / "training.md", ROOT / "docs" / "tetrapod.md"
MODEL = ROOT / "docs" / "tetrapod-model.md"
GOALS = [task.id for task in TASKS if "Tetrapod" not in task.id]  # they are reached or not

# The robot, and what it is called on the page. Chance and nobody act on the first alone.
CONDITIONS: dict[str, dict[str, Any]] = {
    "nominal": {"episodes": 5},
    "± 20 %": {"episodes": 5, "randomise": 0.2},
    "ten nodes a leg": {"episodes": 2, "model": "legs"},
    "finer": {"episodes": 1, "model": "fine"},
}
# Of gaits, on the nominal robot but for this one thing: what the second table shows.
_FACTORS = {"friction": (0.8, 1.2), "mass": (0.8, 1.2), "tca_gain": (0.8, 1.2),
            "heat_loss": (0.8, 1.2), "ambient": (20.0, 30.0)}  # fmt: skip
_UPHILL = {"5° up": 0.0, "5° down": math.pi, "5° aside": math.pi / 2.0}
FACTORS: dict[str, dict[str, Any]] = {
    "± 40 %": {"episodes": 5, "randomise": 0.4},
    **{
        f"{name.replace('_', ' ')} {value:g}": {"episodes": 1, "options": {name: value}}
        for name, ends in _FACTORS.items() for value in ends
    },
    **{
        name: {"episodes": 1,
               "options": {"slope": math.radians(5.0), "slope_direction": direction}}
        for name, direction in _UPHILL.items()
    },
    "pushed": {"episodes": 1, "options": {"push": 0.05, "push_every": 10.0}},
    "half the step": {"episodes": 1, "timestep": 3.125e-3},
}  # fmt: skip
SHOWN = {
    "gait": ("speed", "drift", "success", "energy_per_metre", "cost_of_transport",
             "peak_temperature", "peak_tension", "return"),
    "goal": ("success", "duration", "energy", "peak_temperature", "peak_tension", "return"),
}  # fmt: skip
# What is drawn of a learning curve, the first of these that it has: column, what it is, by what
# factor, and on which robots the levels are that stand beside it.
CURVES = (
    ("top_speed", "speed [mm/s]", 1.0, "nominal"),
    ("speed", "speed [mm/s]", 1e3, "± 20 %"),
    ("return_mean", "return", 1.0, ""),
    ("error", "off its teachers [1]", 1.0, ""),
)


CURVE_NOTE = """\
Of searched gaits: how much faster than the script's, on the same robot, the best gait of each
generation was, times the script's speed on the nominal one; robots differ from generation to
generation. Of networks that walk: the speed in the run's evaluations, on five robots that are off
by 20 %, of `tetrapod-command` on commands that are drawn, slow and sideways ones among them.
Dashed, the script and what came of it, straight ahead: on the nominal robot beside a search, on
five robots of the table above beside a network."""

INTRODUCTION = """\
# Results

How good the scripted and learned policies are, against chance and doing nothing. This page is
written by one command, which goes on where it was interrupted:

```sh
python scripts/results_page.py
```

Means over episodes of the tasks' own length with seeds 0, 1, ...; in brackets the 95 % interval of
the first two figures (of means: Student's t over episodes; of success: Wilson's; a single episode
has none). Energy per metre and cost of transport E/(m g d) are ratios of sums. Success of a gait is
to come to the end of its time; drift is its size.

* ± 20 %: friction, mass, TCA gain and heat loss are drawn within 20 %, the surroundings within 5 K
  of 25 °C.
* ten nodes a leg: legs of ten nodes instead of three, of the same mass.
* each factor alone (`--factors`), in a table of its own where it was run: speeds in mm/s of one
  episode, that of ± 40 % of five. Slopes are 5°, up, down and to the left of the way; pushes change
  the velocity of the hub by 0.05 m/s every 10 s, from all sides.
* finer: these legs, and an elastic body instead of a rigid one, every spine of which is a chain of
  its own that bends about both axes, twists and stretches ([the model that certifies the one in
  use](tetrapod-model.md)), at the same time step.

One's own policy is measured by `tca-mj eval POLICY --task TASK`, with `--randomise`, `--model` and
`--timestep`; `tca-mj demo --policy POLICY --task TASK` films it.
"""


def cases(tasks: list[str]) -> Iterator[tuple[str, str, str, Evaluation]]:
    """Task, policy and condition, with what is to be run."""
    for task in tasks:
        finer = task_class(task).finer
        learned = [name for name, path in shipped().items() if SavedPolicy.read(path).task == task]
        for policy in ("scripted", *learned, "random", "off"):
            for condition, settings in CONDITIONS.items():
                acts = policy not in ("random", "off")
                if (not acts and condition != "nominal") or (task == COURSE and not acts):
                    continue
                if settings.get("model", "used") not in ("used", *finer):
                    continue
                more = dict(settings)
                if task == COURSE:
                    more["episodes"] = 1
                yield task, policy, condition, Evaluation(task=task, policy=policy, **more)
            for factor, settings in FACTORS.items():
                if "gait" in find_task(task).kwargs and policy not in ("random", "off"):
                    yield task, policy, factor, Evaluation(task=task, policy=policy, **settings)


def table(task: str, found: dict[str, dict[str, Any]]) -> list[str]:
    """The table of a task, as Markdown."""
    first = next(iter(next(iter(found.values())).values()))
    names = SHOWN["gait" if "speed" in first["figures"] else "goal"]
    heads = [name.replace("_", " ") + (f" [{METRICS[name][0]}]" if METRICS[name][0] else "")
             for name in names]  # fmt: skip
    lines = [f"| agent | robot | episodes | {' | '.join(heads)} |", "|---" * (3 + len(names)) + "|"]
    for policy, conditions in found.items():
        for condition, entry in conditions.items():
            if condition in FACTORS:
                continue
            shown = [cell(name, entry["figures"][name], interval=name in names[:2])
                     if name in entry["figures"] else "" for name in names]  # fmt: skip
            lines.append(f"| {policy} | {condition} | {entry['episodes']} | {' | '.join(shown)} |")
    return lines


def factors(found: dict[str, dict[str, Any]]) -> list[str]:
    """The table of single factors of a task, as Markdown; empty if none was looked at whole."""
    known = {policy: each for policy, each in found.items() if FACTORS.keys() <= each.keys()}
    if not known:
        return []
    lines = [f"| speed [mm/s] | {' | '.join(known)} |", "|---" * (1 + len(known)) + "|"]
    for name in FACTORS:
        figures_of = [each[name]["figures"] if name in each else None for each in known.values()]
        cells = [cell("speed", each["speed"], interval=False) if each else ""
                 for each in figures_of]  # fmt: skip
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return [*lines, ""]


def curves(results: dict[str, dict[str, dict[str, Any]]]) -> list[str]:
    """Draws the learning curves that come with the policies; returns the lines that show them."""
    lines = []
    for name, path in shipped().items():
        file = path.with_suffix(".csv")
        if not file.is_file():
            continue
        with file.open(encoding="utf-8", newline="") as text:
            rows = list(csv.DictReader(text))
        found = results.get(SavedPolicy.read(path).task, {})
        key, what, factor, condition = next(each for each in CURVES if each[0] in rows[0])
        levels = {
            agent: METRICS["speed"][1] * found[agent][condition]["figures"]["speed"]["mean"]
            for agent in ("scripted", name)
            if condition and condition in found.get(agent, {})
        }
        if key == "top_speed":  # in units of the script's
            factor = levels["scripted"]
        points = [(float(row["steps"]), factor * float(row[key])) for row in rows if row.get(key)]
        picture = PICTURES / f"curve_{name}.png"
        draw(picture, points, levels, name, what)
        lines += [f"![{name}: {what} over steps of the task](pictures/{picture.name})", ""]
    return lines


def draw(
    path: Path, points: list[tuple[float, float]], levels: dict[str, float], title: str, what: str
) -> None:
    """One learning curve, with levels as lines."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 2.8), layout="constrained")
    axes.plot(*zip(*points, strict=True), marker=".")
    for k, (agent, level) in enumerate(levels.items()):
        axes.axhline(level, color=f"C{k + 1}", linestyle="--", label=f"{agent}, {level:.2g}")
    if levels:
        axes.legend(frameon=False)
        axes.set_ylim(bottom=0.0)
    axes.set(xlabel="steps of the task", ylabel=what, title=title)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def page(results: dict[str, dict[str, dict[str, Any]]]) -> str:
    """The whole page."""
    lines = [INTRODUCTION]
    for task, found in results.items():
        lines += [f"## `{task}`", "", *table(task, found), "", *factors(found)]
    drawn = curves(results)
    if drawn:
        lines += ["## Learning curves", "", CURVE_NOTE, "", *drawn]
    return "\n".join(lines)


def shipped_table(results: dict[str, dict[str, dict[str, Any]]]) -> list[str]:
    """The policies that come with the package: how each was made, by its file, and what it does."""

    def change(
        task: str, name: str, figure: str, scale: float, digits: int, share: bool = False
    ) -> str:
        both = [results[task][who]["nominal"]["figures"] for who in ("scripted", name)]
        if figure not in both[1]:
            return ""
        before, after = (scale * each[figure]["mean"] for each in both)
        more = f" ({100.0 * (after / before - 1.0):+.0f} %)" if share else ""
        return f"{before:.{digits}f} to {after:.{digits}f}{more}"

    rows = []
    for name, path in sorted(shipped().items()):
        saved = SavedPolicy.read(path)
        about = saved.origin
        what = "steps" if about.algorithm == "cma" or saved.task in GOALS else "decisions"
        success = change(saved.task, name, "success", 100.0, 0) if saved.task in GOALS else ""
        duration = change(saved.task, name, "duration", 1.0, 1) if saved.task in GOALS else ""
        rows.append([
            f"`{name}`", f"`{about.command}`", f"{about.steps:,} {what}",
            change(saved.task, name, "speed", 1e3, 2, share=True)
            or f"success {success} %, in {duration} s",
            change(saved.task, name, "energy_per_metre", 1e-3, 1),
        ])  # fmt: skip
    heads = ["policy", "made by", "taken at", "speed, scripted to learned [mm/s]",
             "energy per metre [kJ/m]"]  # fmt: skip
    return markdown(heads, rows)


def scripts_table(results: dict[str, dict[str, dict[str, Any]]]) -> list[str]:
    """What the scripts of the gaits do, beside what is published."""
    rows = []
    for task in TASKS:
        if "gait" not in task.kwargs:
            continue
        gait = task.kwargs["gait"]
        found = results[task.id]["scripted"]["nominal"]["figures"]
        speed, far = found["speed"], found["drift"]["most"]
        share = 100.0 * far / (speed["mean"] * find_task(task.id).max_episode_steps * 0.1)
        rows.append([
            gait, cell("speed", speed),
            f"{100.0 * speed['mean'] / PUBLISHED[gait].speed:.0f} %",
            f"at most {share:.1f} %", f"{found['peak_temperature']['mean']:.0f}",
            f"{found['peak_tension']['mean']:.2f}",
            f"{1e-3 * found['energy_per_metre']['mean']:.1f}",
        ])  # fmt: skip
    heads = ["gait", "speed (95 % interval) [mm/s]", "over the published", "drift over distance",
             "hottest TCA [°C]", "largest tension [N]", "energy per metre [kJ/m]"]  # fmt: skip
    return markdown(heads, rows)


def models_table(results: dict[str, dict[str, dict[str, Any]]]) -> list[str]:
    """Speeds of the script's and the searched gaits on the model in use and on finer ones."""
    rows = []
    for task in TASKS:
        gait = task.kwargs.get("gait")
        for policy, who in ((("scripted", "scripted"), (f"tetrapod-{gait}", "searched"))
                            if gait else ()):  # fmt: skip
            used, ten, finer = (
                1e3 * results[task.id][policy][model]["figures"]["speed"]["mean"]
                for model in ("nominal", "ten nodes a leg", "finer")
            )
            rows.append([f"{gait}, {who}", f"{used:.2f}", *(
                f"{speed:.2f} ({round(100.0 * speed / used) - 100:+d} %)" for speed in (ten, finer)
            )])  # fmt: skip
    heads = ["gait", "the model in use [mm/s]", "ten nodes a leg", "finer body, too"]
    return markdown(heads, rows)


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    known = [task.id for task in TASKS]
    parser.add_argument("--tasks", nargs="+", choices=known, default=known, metavar="TASK")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--page", action="store_true", help="run nothing")
    parser.add_argument("--factors", action="store_true", help="single factors of gaits, too")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "results")
    arguments = parser.parse_args(argv)
    before = json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}
    results: dict[str, dict[str, dict[str, Any]]] = {}
    for task, policy, condition, evaluation in cases(known):
        folder = arguments.out / task.partition("/")[2] / policy
        wanted = arguments.factors or condition not in FACTORS
        key = evaluation.key()
        entry = before.get(task, {}).get(policy, {}).get(condition, {})
        known = entry.get("key") == key and entry["episodes"] == evaluation.episodes
        if task in arguments.tasks and wanted and not arguments.page and not known:
            print(f"{task}: {policy}, {condition}", flush=True)
            evaluate(evaluation, out=folder, workers=arguments.workers)
        rows = kept(folder / EPISODES, key)
        if len(rows) >= evaluation.episodes:
            seeds = range(evaluation.seed, evaluation.seed + evaluation.episodes)
            figured = figures([rows[seed] for seed in seeds])
            entry = {"key": key, "episodes": evaluation.episodes, "figures": figured}
        elif not known:
            continue  # not run yet
        results.setdefault(task, {}).setdefault(policy, {})[condition] = entry
    DATA.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(page(results), encoding="utf-8")
    write_between(TRAINING, f"{MARK}: shipped", shipped_table(results))
    write_between(TETRAPOD, f"{MARK}: scripts", scripts_table(results))
    write_between(MODEL, f"{MARK}: models", models_table(results))
    print(f"{PAGE}\n{DATA}")


if __name__ == "__main__":
    main()

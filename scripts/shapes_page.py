"""Teaches one policy what three specialists do, three times, and writes the tables of its page.

    python scripts/shapes_page.py            what is missing, then the page
    python scripts/shapes_page.py --page     the page alone, of what is kept

Specialists that do not come with the package are trained anew, by the recipes. Runs and evaluations
are kept in runs/shapes; a second call goes on where the first one stopped. What the tables hold
stands in docs/shapes.json.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.evaluate import Evaluation, evaluate
from tca_mj.agents.policies import SavedPolicy
from tca_mj.agents.policies.load import find
from tca_mj.agents.train.config import default_config
from tca_mj.agents.train.deep import train
from tca_mj.agents.train.distil import Teacher, distil, distil_config
from tca_mj.envs.gaits import TASKS
from tca_mj.files import write_whole
from tca_mj.pages import table, write_between

ROOT = Path(__file__).resolve().parent.parent
PAGE, DATA = ROOT / "docs" / "shapes.md", ROOT / "docs" / "shapes.json"
TASK = "TCA/TetrapodShapes-v0"
# Training seeds of the specialists, for each seed of the one policy; chosen so that every one is
# used once and seed 0 has those that come with the package.
SETS = (
    {"crawl": 2, "walk": 0, "shimmy": 0},
    {"crawl": 1, "walk": 1, "shimmy": 1},
    {"crawl": 0, "walk": 2, "shimmy": 2},
)
BODIES = ("rigid", "elastic")
ARGUMENTS = {"body": BODIES}
ROBOTS = {"nominal": {"episodes": 1, "seed": 0},
          "off": {"episodes": 16, "seed": 1000, "randomise": 0.2}}  # fmt: skip
COMMAND = "scripts/shapes_page.py"


def task_of(gait: str) -> str:
    """The task of one shape alone."""
    return f"TCA/Tetrapod{gait.capitalize()}-v0"


def specialist(gait: str, seed: int, out: Path) -> str:
    """The policy of one shape, by a seed: that of the package, or else trained here."""
    name = f"tetrapod-{gait}-sac"
    if SavedPolicy.read(find(name)).origin.seed == seed:
        return name
    task, folder = task_of(gait), out / f"{gait}_{seed}"
    command = f"tca-mj train {task} --seed {seed}"
    train(default_config(task, seed=seed), folder, command=command, video=False)
    return str(folder)


def speeds(task: str, policy: str, out: Path, **more: Any) -> dict[str, Any]:
    """Speeds on every kind of robot and body [m/s], and the hottest TCA [°C]."""
    found: dict[str, Any] = {}
    for body in BODIES:
        for robots, settings in ROBOTS.items():
            evaluation = Evaluation(
                task=task, policy=policy, arguments={"body": body}, **settings, **more
            )
            figures = evaluate(evaluation, out=out / f"{body}-{robots}")["figures"]
            found[f"{body} {robots}"] = round(figures["speed"]["mean"], 7)
            found["hottest"] = max(found.get("hottest", 0.0),
                                   round(figures["peak_temperature"]["most"], 1))  # fmt: skip
            found["finished"] = min(found.get("finished", 1.0), figures["success"]["mean"])
    return found


def one_of_all(seed: int, out: Path) -> dict[str, Any]:
    """A policy of all shapes, its specialists, and how fast all of them are."""
    chosen = SETS[seed]
    known = {gait: specialist(gait, number, out) for gait, number in chosen.items()}
    teachers = tuple(
        Teacher(policy=policy, options={"gait": gait}) for gait, policy in known.items()
    )
    folder, before = out / f"one_{seed}", time.process_time()
    words = [f"{each.policy}:gait={each.options['gait']}" for each in teachers]
    words += ["--task", TASK, "--argument", f"body={','.join(BODIES)}", "--seed", str(seed)]
    config = distil_config(TASK, teachers, seed=seed, arguments=ARGUMENTS)
    distil(config, folder, command=" ".join(["tca-mj", "distil", *words]))
    spent, used = folder / "processor_time.json", time.process_time() - before
    if spent.is_file():  # the run went on, or was done
        used += json.loads(spent.read_text(encoding="utf-8"))
    write_whole(spent, json.dumps(round(used)).encode())
    rows = {}
    for gait, policy in known.items():
        rows[gait] = {
            "seed": chosen[gait],
            "specialist": speeds(task_of(gait), policy, out / "measured" / f"{gait}_{seed}"),
            "one": speeds(TASK, str(folder), folder / "measured" / gait, options={"gait": gait}),
        }
    return {"processor_time": round(used), "shapes": rows}


def share_table(kept: dict[str, Any], body: str, robots: str) -> list[str]:
    """Speeds on one kind of robot: specialist, one policy and its share, seed by seed."""
    key, rows = f"{body} {robots}", []
    for gait in TASKS:
        cells, shares = [gait], []
        for each in kept.values():
            found = each["shapes"][gait]
            own, one = (1e3 * found[who][key] for who in ("specialist", "one"))
            shares.append(one / own)
            cells.append(f"{own:.2f}, {one:.2f} ({100 * shares[-1]:.0f} %)")
        rows.append([*cells, f"{100 * np.mean(shares):.0f} %"])
    return table(["shape", *(f"seed {seed}" for seed in kept), "mean"], rows)


def least(kept: dict[str, Any]) -> str:
    """The smallest mean share of all tables, and the smallest of single seeds."""
    means, single = [], []
    for body in BODIES:
        for robots in ROBOTS:
            for gait in TASKS:
                found = [each["shapes"][gait] for each in kept.values()]
                shares = [f["one"][f"{body} {robots}"] / f["specialist"][f"{body} {robots}"]
                          for f in found]  # fmt: skip
                where = f"{gait}, {body} body, {'nominal' if robots == 'nominal' else 'off'}"
                means.append((float(np.mean(shares)), where))
                single += [(s, f"seed {k}, {where}") for k, s in zip(kept, shares, strict=True)]
    hottest = max(f[who]["hottest"] for each in kept.values() for f in each["shapes"].values()
                  for who in ("specialist", "one"))  # fmt: skip
    done = all(f["one"]["finished"] == 1.0 for each in kept.values()
               for f in each["shapes"].values())  # fmt: skip
    (mean, where), (lowest, there) = min(means), min(single)
    spent = "/".join(str(each["processor_time"]) for each in kept.values())
    return (
        f"Smallest share in the mean of the seeds: {100 * mean:.0f} % ({where}); of a single seed:"
        f" {100 * lowest:.0f} % ({there}). Hottest TCA: {hottest:.0f} °C."
        f" {'Every' if done else 'Not every'} episode came to the end of its time."
        f" Processor time of the three distillations: {spent} s."
    )


def write_page(kept: dict[str, Any]) -> None:
    """All tables of the page."""
    for body in BODIES:
        for robots in ROBOTS:
            write_between(PAGE, f"{COMMAND}: {body}, {robots}", share_table(kept, body, robots))
    write_between(PAGE, f"{COMMAND}: least", [least(kept)])


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", action="store_true", help="run nothing")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(len(SETS))))
    parser.add_argument("--out", type=Path, default=Path("runs/shapes"))
    arguments = parser.parse_args(argv)
    kept = json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}
    for seed in [] if arguments.page else arguments.seeds:
        kept[str(seed)] = one_of_all(seed, arguments.out)
        kept = dict(sorted(kept.items()))
        write_whole(DATA, (json.dumps(kept, indent=1) + "\n").encode())
    write_page(kept)


if __name__ == "__main__":
    main()

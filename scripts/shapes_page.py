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
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.evaluate import Evaluation, evaluate
from tca_mj.agents.policies import SavedPolicy, shipped
from tca_mj.agents.policies.load import find
from tca_mj.agents.train.config import default_config
from tca_mj.agents.train.deep import train
from tca_mj.agents.train.distil import Teacher, distil, distil_config
from tca_mj.envs.gaits import TASKS
from tca_mj.files import write_whole
from tca_mj.pages import table, write_between

ROOT = Path(__file__).resolve().parent.parent
PAGE, DATA = ROOT / "docs" / "shapes.md", ROOT / "docs" / "shapes.json"
GAITS = ROOT / "docs" / "gaits.json"
TASK = "TCA/TetrapodShapes-v0"
# Training seeds of the specialists, for each seed of the one policy; chosen so that every one is
# used once and seed 0 has those that come with the package.
SETS = (
    {"crawl": 2, "walk": 0, "shimmy": 0},
    {"crawl": 1, "walk": 1, "shimmy": 1},
    {"crawl": 0, "walk": 2, "shimmy": 2},
)
NOMINAL, OFF = {"episodes": 1, "seed": 0}, {"seed": 1000, "randomise": 0.2}
# Body, and the robots that it has; elastic ones take half as long again, so there are fewer.
ROBOTS: dict[tuple[str, str], dict[str, Any]] = {
    ("rigid", "nominal"): NOMINAL,
    ("rigid", "16 robots"): {"episodes": 16, **OFF},
    ("elastic", "nominal"): NOMINAL,
    ("elastic", "4 robots"): {"episodes": 4, **OFF},
}
OPTIONS = {"bend_spread": 0.17}  # as far as it goes: wherever specialists can tell what to do
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


def measured(task: str, policy: str, kind: tuple[str, str], out: Path, **more: Any) -> list[float]:
    """Speed [m/s], the hottest TCA [°C] and the share of episodes that came to their end."""
    evaluation = Evaluation(
        task=task, policy=policy, arguments={"body": kind[0]}, **ROBOTS[kind], **more
    )
    found = evaluate(evaluation, out=out / "-".join(kind).replace(" ", "_"))["figures"]
    return [found["speed"]["mean"], found["peak_temperature"]["most"], found["success"]["mean"]]


def speeds(
    task: str, policy: str, out: Path, body: str, **more: Any
) -> dict[str, list[float]]:  # fmt: skip
    """Those figures on every kind of robot with a body."""
    return {" ".join(kind): measured(task, policy, kind, out, **more) for kind in ROBOTS
            if kind[0] == body}  # fmt: skip


def specialist_speeds(
    gait: str, seed: int, policy: str, out: Path, body: str
) -> dict[str, list[float]]:  # fmt: skip
    """The same of a specialist. One that ships was measured on rigid bodies for the page of the
    gaits, which is checked by the nominal robot.

    Raises:
        ValueError: If it was not as fast there.
    """
    task = task_of(gait)
    if policy not in shipped() or body != "rigid":
        return speeds(task, policy, out, body)
    known = json.loads(GAITS.read_text(encoding="utf-8"))[task]["seeds"][str(seed)]
    found = {}
    for name, key in (("rigid nominal", "nominal"), ("rigid 16 robots", "robots")):
        figures = [known[key][figure] for figure in ("speed", "peak_temperature", "success")]
        found[name] = [figures[0]["mean"], figures[1]["most"], figures[2]["mean"]]
    now, before = measured(task, policy, ("rigid", "nominal"), out)[0], found["rigid nominal"][0]
    if abs(now - before) > 1e-3 * before:
        raise ValueError(f"{policy} must be as fast as {GAITS.name} says, {before}, got {now}")
    return found


def one_of_all(seed: int, out: Path) -> Iterator[dict[str, Any]]:
    """A policy of all shapes, its specialists, and how fast all of them are, body by body."""
    chosen = SETS[seed]
    known = {gait: specialist(gait, number, out) for gait, number in chosen.items()}
    teachers = tuple(
        Teacher(policy=policy, options={"gait": gait}) for gait, policy in known.items()
    )
    folder, before = out / f"one_{seed}", time.process_time()
    new = not folder.is_dir()
    words = [f"{each.policy}:gait={each.options['gait']}" for each in teachers]
    words += ["--task", TASK, *(f"--option {name}={value}" for name, value in OPTIONS.items())]
    words += ["--seed", str(seed)]
    config = distil_config(TASK, teachers, seed=seed, options=OPTIONS)
    distil(config, folder, command=" ".join(["tca-mj", "distil", *words]))
    spent = folder / "processor_time.json"
    if new:  # else it went on, or was done
        write_whole(spent, json.dumps(round(time.process_time() - before)).encode())
    used = json.loads(spent.read_text(encoding="utf-8")) if spent.is_file() else None
    rows: dict[str, Any] = {
        gait: {"seed": number, "specialist": {}, "one": {}} for gait, number in chosen.items()
    }
    for body in dict.fromkeys(body for body, _ in ROBOTS):
        for gait, policy in known.items():
            apart, number = out / "measured" / f"{gait}_{chosen[gait]}", chosen[gait]
            rows[gait]["specialist"] |= specialist_speeds(gait, number, policy, apart, body)
            rows[gait]["one"] |= speeds(
                TASK, str(folder), folder / "measured" / gait, body, options={"gait": gait}
            )
        yield {"processor_time": used, "shapes": rows}


def shares(kept: dict[str, Any], kind: tuple[str, str], gait: str) -> list[float]:
    """Speed of the one policy over that of the specialist, seed by seed."""
    key = " ".join(kind)
    each = [found["shapes"][gait] for found in kept.values() if key in found["shapes"][gait]["one"]]
    return [float(found["one"][key][0] / found["specialist"][key][0]) for found in each]


def share_table(kept: dict[str, Any], kind: tuple[str, str]) -> list[str]:
    """Speeds on one kind of robot: specialist, one policy and its share, seed by seed."""
    key, rows = " ".join(kind), []
    kept = {seed: each for seed, each in kept.items() if key in each["shapes"]["walk"]["one"]}
    for gait in TASKS:
        cells, found = [gait], shares(kept, kind, gait)
        for each, share in zip(kept.values(), found, strict=True):
            own, one = (1e3 * each["shapes"][gait][who][key][0] for who in ("specialist", "one"))
            cells.append(f"{own:.2f}, {one:.2f} ({100 * share:.0f} %)")
        rows.append([*cells, f"{100 * np.mean(found):.0f} %"])
    return table(["shape", *(f"seed {seed}" for seed in kept), "mean"], rows)


def in_short(kept: dict[str, Any]) -> str:
    """The smallest shares of all tables, and what else is to be known."""
    everywhere = [(gait, kind) for kind in ROBOTS for gait in TASKS]
    mean, gait, kind = min((float(np.mean(shares(kept, kind, gait))), gait, " ".join(kind))
                           for gait, kind in everywhere)  # fmt: skip
    single, seed, where, which = min(
        (share, seed, gait, " ".join(kind)) for gait, kind in everywhere
        for seed, share in zip(kept, shares(kept, kind, gait), strict=False)
    )  # fmt: skip
    rows = [row for each in kept.values() for found in each["shapes"].values()
            for who in ("specialist", "one") for row in found[who].values()]  # fmt: skip
    spent = ", ".join(f"{each['processor_time'] / 60.0:.1f}" for each in kept.values()
                      if each["processor_time"])  # fmt: skip
    return (
        f"The smallest share in the mean of the seeds is {100 * mean:.0f} % ({gait}, {kind}), of a"
        f" single seed {100 * single:.0f} % (seed {seed}, {where}, {which}). No TCA got hotter than"
        f" {max(row[1] for row in rows):.0f} °C; {100 * min(row[2] for row in rows):.0f} % of the"
        " episodes came to the end of their time."
        + (f" A distillation took {spent} min of processor time." if spent else "")
    )


def write_page(kept: dict[str, Any]) -> None:
    """All tables of the page."""
    for kind in ROBOTS:
        write_between(PAGE, f"{COMMAND}: {' '.join(kind)}", share_table(kept, kind))
    write_between(PAGE, f"{COMMAND}: in short", [in_short(kept)])


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", action="store_true", help="run nothing")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(len(SETS))))
    parser.add_argument("--out", type=Path, default=Path("runs/shapes"))
    arguments = parser.parse_args(argv)
    kept = json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}
    for seed in [] if arguments.page else arguments.seeds:
        for found in one_of_all(seed, arguments.out):
            kept[str(seed)] = found
            kept = dict(sorted(kept.items()))
            write_whole(DATA, (json.dumps(kept, indent=1) + "\n").encode())
            write_page(kept)
    write_page(kept)


if __name__ == "__main__":
    main()

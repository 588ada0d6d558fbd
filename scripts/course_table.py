"""How often, and how fast, controllers finish the tetrapod's course, and the tables of its page.

    python scripts/course_table.py --first 210 --seeds 15 --friction 0.2 --keep friction
    python scripts/course_table.py --first 300 --everything 0.2 --keep everything
    python scripts/course_table.py --first 300 --everything 0.2 --keep specialists
        --policy tca_mj.agents.scripts.course_quick:specialists
    python scripts/course_table.py --page       the page's tables alone, from what was kept

Prints a Markdown table, one row per seed, and writes each row to the folder as soon as it is known;
rows that lie there already are not run again unless --fresh is given. What is kept stands in
docs/course.json, by seed, and from there in docs/course.md.
"""

import argparse
import json
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.demo import play
from tca_mj.envs.course import TetrapodCourse
from tca_mj.files import write_whole
from tca_mj.pages import table, write_between

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGE, DATA = DOCS / "course.md", DOCS / "course.json"
NAMES = tuple(TetrapodCourse.published_speed)  # of the gaits that were published
AIM = 0.55  # of the script's time in the stages that get on
WALKED = ("crawl", "walk", "mount", "shimmy", "step off", "walk on")  # stages that get on
HEADS = ["seed", "friction", "finished", "time", *(f"{name} [mm/s]" for name in NAMES), "energy",
         "hottest", "largest tension"]  # fmt: skip
SCRIPT = "everything"  # its runs on robots that are off in everything
CONTROLLERS = {SCRIPT: "script", "searched": "search", "specialists": "specialists",
               "shapes": "one policy"}  # fmt: skip


def figures(
    seed: int, options: dict[str, float], out: Path, policy: str = "scripted"
) -> dict[str, Any]:
    """Figures of one episode, from the folder or run now."""
    path = out / f"seed{seed}.json"
    if path.is_file():
        result = json.loads(path.read_text(encoding="utf-8"))
    else:
        result = play("TCA/TetrapodCourse-v0", policy, seed=seed, options=options, progress=False)
        path.write_text(json.dumps(result, indent=2), encoding="utf-8")
    energy = sum(result["energy"].values()) + sum(result["heater_energy"].values())
    speeds = {each["name"]: round(1e3 * each["speed"], 2) for each in result["speeds"]}
    return {
        "seed": seed, "friction": round(result["friction"], 2),
        "ending": "" if result["success"] else result["ending"], "duration": result["duration"],
        **{name: speeds[name] for name in NAMES if name in speeds},
        "energy": round(energy), "hottest": round(max(result["peak_temperature"].values())),
        "tension": round(max(result["peak_tension"].values()), 2),
        "harmed": bool(result["damaged"] or result["touched_plate"]),
        "stages": {each["name"]: each["duration"] for each in result["phases"]},
    }  # fmt: skip


def cells(row: dict[str, Any]) -> list[str]:
    """A row of the table of a controller."""
    return [
        str(row["seed"]), f"{row['friction']:.2f}",
        f"no: {row['ending']}" if row["ending"] else "yes", f"{row['duration']:.0f} s",
        *(f"{row[name]:.2f}" if name in row else "" for name in NAMES),
        f"{1e-3 * row['energy']:.1f} kJ", f"{row['hottest']} °C", f"{row['tension']:.2f} N",
    ]  # fmt: skip


def walked(row: dict[str, Any]) -> float:
    """Time in the stages that get on [s]."""
    return sum(row["stages"].get(name, 0.0) for name in WALKED)


def by_seed(kept: dict[str, Any]) -> dict[int, dict[str, dict[str, Any]]]:
    """Rows of each controller on the seeds that the script and another one were given."""
    found: dict[int, dict[str, dict[str, Any]]] = {}
    for name in CONTROLLERS:
        for row in kept.get(name, ()):
            if row.get("stages"):
                found.setdefault(row["seed"], {})[name] = row
    return {seed: rows for seed, rows in sorted(found.items()) if len(rows) > 1 and SCRIPT in rows}


def stage_table(kept: dict[str, Any]) -> list[str]:
    """Mean and longest time in each stage, over the runs of each controller that finished."""
    seeds = by_seed(kept)
    rows = []
    for name in next(iter(seeds.values()))[SCRIPT]["stages"]:
        cells = [name]
        for who in CONTROLLERS:
            spans = [rows[who]["stages"].get(name, 0.0) for rows in seeds.values()
                     if who in rows and not rows[who]["ending"]]  # fmt: skip
            cells.append(f"{np.mean(spans):.0f} s, at most {max(spans):.0f} s" if spans else "")
        rows.append(cells)
    return table(["stage", *CONTROLLERS.values()], [row for row in rows if row[0] != "done"])


def time_table(kept: dict[str, Any], measure: Callable[[dict[str, Any]], float], most: float,
               words: str) -> list[str]:  # fmt: skip
    """A time of every controller, seed by seed, over the script's, and how often that is met."""
    seeds, rows = by_seed(kept), []
    met = dict.fromkeys(CONTROLLERS, 0)
    tried = dict.fromkeys(CONTROLLERS, 0)
    for seed, found in seeds.items():
        cells = [str(seed)]
        for who in CONTROLLERS:
            if who not in found:
                cells.append("")
                continue
            row, share = found[who], measure(found[who]) / measure(found[SCRIPT])
            if row["ending"]:
                cells.append(f"no: {row['ending']}, {row['duration']:.0f} s")
            else:
                cells.append(f"{measure(row):.0f} s ({100 * share:.0f} %)" if who != SCRIPT
                             else f"{measure(row):.0f} s")  # fmt: skip
            tried[who] += 1
            met[who] += not row["ending"] and not row["harmed"] and share <= most
        rows.append(cells)
    said = ", ".join(f"{CONTROLLERS[who]} on {met[who]} of {tried[who]}" for who in CONTROLLERS
                     if who != SCRIPT and tried[who])  # fmt: skip
    heads = ["seed", *(f"{name}, {words}" for name in CONTROLLERS.values())]
    return [*table(heads, rows), "", f"At most {100 * most:.0f} % of the script's time: {said}."]


def unmounted(kept: dict[str, Any], who: str = "shapes") -> str:
    """How often the walked stages would meet their aim, had the robot mounted in no time."""
    least = {
        seed: (walked(rows[who]) - rows[who]["stages"].get("mount", 0.0)) / walked(rows[SCRIPT])
        for seed, rows in by_seed(kept).items() if who in rows and not rows[who]["ending"]
    }  # fmt: skip
    missed = [f"{seed} ({100 * share:.0f} %)" for seed, share in least.items() if share > AIM]
    but = f"; not on {', '.join(missed)}" if missed else ""
    return (f"Had it mounted the beam in no time at all, the {CONTROLLERS[who]} would be within"
            f" that on {len(least) - len(missed)} of {len(least)}{but}.")


def write_page(kept: dict[str, Any]) -> None:
    """All tables of the page that there are figures for."""
    tables: dict[str, Iterable[str]] = {
        name: table(HEADS, map(cells, kept[name])) for name in ("friction", "everything")
    }
    tables |= {
        "stages": stage_table(kept),
        "whole": time_table(kept, lambda row: row["duration"], 0.7, "all of it"),
        "walked": [*time_table(kept, walked, AIM, "walked"), "", unmounted(kept)],
    }
    for name, lines in tables.items():
        write_between(PAGE, f"scripts/course_table.py: {name}", lines)


def keep(name: str, rows: list[dict[str, Any]]) -> None:
    """Adds rows to what is kept under a name, in the order of their seeds, and writes the page."""
    kept = json.loads(DATA.read_text(encoding="utf-8"))
    known = {row["seed"]: row for row in kept.get(name, ())} | {row["seed"]: row for row in rows}
    kept[name] = [known[seed] for seed in sorted(known)]
    lines = ",\n".join(
        f"{json.dumps(each)}: [\n" + ",\n".join(f"  {json.dumps(row)}" for row in kept[each]) + "]"
        for each in kept
    )
    write_whole(DATA, f"{{\n{lines}\n}}\n".encode())
    write_page(kept)


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--friction", type=float, default=0.0, help="share by which it is off")
    parser.add_argument("--everything", type=float, default=0.0, help="the same of the robot")
    parser.add_argument("--policy", default="scripted", help="who walks; each into its own --out")
    parser.add_argument("--out", type=Path, default=Path("runs/course"))
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--keep", metavar="NAME", help="what to keep the rows as, for the page")
    parser.add_argument("--page", action="store_true", help="write the page's tables, run nothing")
    args = parser.parse_args(argv)
    if args.page:
        return write_page(json.loads(DATA.read_text(encoding="utf-8")))
    if args.fresh:
        shutil.rmtree(args.out, ignore_errors=True)
    args.out.mkdir(parents=True, exist_ok=True)
    options = {"randomise_friction": args.friction, "randomise": args.everything}
    rows = []
    for seed in range(args.first, args.first + args.seeds):
        rows.append(figures(seed, options, args.out, args.policy))
        lines = table(HEADS, [cells(rows[-1])])
        print("\n".join(lines if len(rows) == 1 else lines[-1:]), flush=True)
    print(f"\n{sum(not row['ending'] for row in rows)} of {len(rows)} finished.")
    for name in NAMES:
        speeds = [row[name] for row in rows if name in row]
        if speeds:
            share = 0.1 * np.mean(speeds) / TetrapodCourse.published_speed[name]
            print(f"{name}: {np.mean(speeds):.2f} mm/s, {share:.0f} % of the published speed")
    if args.keep:
        keep(args.keep, rows)


if __name__ == "__main__":
    main()

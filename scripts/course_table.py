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
from collections.abc import Iterable
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
WALKED = ("crawl", "walk", "mount", "shimmy", "step off", "walk on")  # stages that get on
HEADS = ["seed", "friction", "finished", "time", *(f"{name} [mm/s]" for name in NAMES), "energy",
         "hottest", "largest tension"]  # fmt: skip
SHARE, SHARE_WALKED = 0.7, 0.55  # of the script's time: what is aimed at


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


def stage_table(kept: dict[str, Any]) -> list[str]:
    """Mean and longest time in each stage over the seeds that several have finished."""
    both = shared(kept)
    names = [name for name in both[0][0]["stages"] if name != "done"]
    rows = []
    for name in names:
        spans = [[pair[i]["stages"].get(name, 0.0) for pair in both if not pair[i]["ending"]]
                 for i in range(2)]  # fmt: skip
        rows.append([name, *(f"{np.mean(each):.0f} s, at most {max(each):.0f} s"
                             for each in spans)])  # fmt: skip
    return table(["stage", "script", "specialists"], rows)


def shared(kept: dict[str, Any]) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Rows of script and specialists with the same seed, whose stages are known."""
    script = {row["seed"]: row for row in kept["everything"] if row.get("stages")}
    return [(script[row["seed"]], row) for row in kept["specialists"] if row["seed"] in script]


def quick_table(kept: dict[str, Any]) -> list[str]:
    """The learned gaits beside the script, seed by seed, and how often the aims are met."""
    rows, whole, legs = [], 0, 0
    for script, quick in shared(kept):
        share, own = quick["duration"] / script["duration"], walked(quick) / walked(script)
        fine = not quick["ending"] and not quick["harmed"]
        whole, legs = whole + (fine and share <= SHARE), legs + (fine and own <= SHARE_WALKED)
        shares = [f"{100 * each:.0f} %" if not quick["ending"] else "" for each in (share, own)]
        rows.append([
            str(quick["seed"]), f"{script['duration']:.0f} s",
            f"no: {quick['ending']} after {quick['duration']:.0f} s" if quick["ending"]
            else f"{quick['duration']:.0f} s", shares[0], f"{walked(script):.0f} s",
            f"{walked(quick):.0f} s", shares[1],
        ])  # fmt: skip
    heads = ["seed", "script", "specialists", "share", "walked, script", "walked, specialists",
             "share"]  # fmt: skip
    said = (
        f"At most {100 * SHARE:.0f} % of the script's time on {whole} of {len(rows)} seeds, and at"
        f" most {100 * SHARE_WALKED:.0f} % of it in the walked stages on {legs}."
    )
    return [*table(heads, rows), "", said]


def write_page(kept: dict[str, Any]) -> None:
    """All tables of the page that there are figures for."""
    tables: dict[str, Iterable[str]] = {
        name: table(HEADS, map(cells, kept[name])) for name in ("friction", "everything")
    }
    tables |= {"stages": stage_table(kept), "quick": quick_table(kept)}
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

"""Runs the scripted demo on many seeds and prints how often it succeeds, as Markdown.

    python scripts/success_table.py                      20 seeds of each object, two processes
    python scripts/success_table.py --seeds 2 --fresh
    python scripts/success_table.py --tables             the tables of docs/arm.md: rates, and times
                                                         of phases on seeds 100 to 109; two minutes

Every finished episode is one line of ``results.jsonl``; a second run goes on where the first one
stopped. What was measured with other versions of the packages is not mixed in, but changes of the
code between two releases are not seen: use ``--fresh`` after them.
"""

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.demo import play
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.scripts.arm import PHASES
from tca_mj.agents.workers import Workers
from tca_mj.envs.arm import OBJECTS
from tca_mj.files import append_whole, claimed, write_whole
from tca_mj.machine import machine, versions
from tca_mj.pages import table as markdown

TASK = "TCA/ArmPickPlace-v0"
TIMED = range(100, 110)  # seeds on which phases are timed


def run(case: tuple[str, int]) -> dict[str, Any]:
    """The summary of one episode that is not recorded."""
    return play(TASK, seed=case[1], options={"object": case[0]}, progress=False)


def kept(path: Path) -> dict[tuple[str, int], dict[str, Any]]:
    """Results of the present versions in a file; a line that was cut off is skipped."""
    found: dict[tuple[str, int], dict[str, Any]] = {}
    for line in path.read_bytes().splitlines() if path.exists() else ():
        try:
            result = json.loads(line)
            if result["versions"] == versions():
                found[result["object"], result["seed"]] = result
        except (ValueError, TypeError, LookupError):
            continue
    return found


def phase_table(results: Iterable[dict[str, Any]]) -> str:
    """Mean time of each phase by object [s], in Markdown; one that comes again is added up."""
    found = list(results)
    heads = ["mean time [s]", *PHASES[:-1], "until it rests", "median of all"]
    rows = []
    for kind in OBJECTS:
        group = [r for r in found if r["object"] == kind]
        times = [[sum(each["duration"] for each in r["phases"] if each["name"] == name)
                  for name in PHASES] for r in group]  # fmt: skip
        rows.append([kind, *(f"{x:.1f}" for x in np.mean(times, axis=0)),
                     f"{np.median([r['duration'] for r in group]):.1f}"])  # fmt: skip
    return "\n".join(markdown(heads, rows))


def rates(results: Iterable[dict[str, Any]]) -> list[str]:
    """How often objects are put into the cup, in Markdown."""
    ordered = list(results)
    groups = {kind: [r for r in ordered if r["object"] == kind] for kind in OBJECTS}
    lines = [
        "| object | episodes | in the cup | held until released | duration [s] | energy [J]"
        " | peak temperature [°C] |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind, group in [*groups.items(), ("all", ordered)]:
        if group:
            won = sum(r["success"] for r in group)
            held = sum(r["held_until"] in ("release", "done") for r in group)
            lines.append(
                f"| {kind} | {len(group)} | {won} ({100 * won / len(group):.0f} %) | {held}"
                f" | {_spread([r['duration'] for r in group])}"
                f" | {_spread([_energy(r) for r in group])}"
                f" | {_spread([_hottest(r) for r in group])} |"
            )
    return lines


def table(results: Iterable[dict[str, Any]]) -> str:
    """Results as Markdown: rates by object, then every episode."""
    ordered = sorted(results, key=lambda r: (r["object"], r["seed"]))
    lines = [
        *rates(ordered),
        "",
        "Duration, energy and peak temperature: median (least to most).",
        "",
        "| object | seed | ending | tries | duration [s] | energy [J] | peak temperature [°C]"
        " | touched until | object from the cup's axis [mm] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for r in ordered:
        aside = np.hypot(*np.subtract(r["object_position"], r["cup_position"])[:2])
        lines.append(
            f"| {r['object']} | {r['seed']} | {r['ending']} | {r['tries']} | {r['duration']:.1f}"
            f" | {_energy(r):.0f} | {_hottest(r):.0f} | {r['held_until']} | {1e3 * aside:.1f} |"
        )
    return "\n".join(lines)


def _line(result: dict[str, Any]) -> bytes:
    return f"{json.dumps(result, ensure_ascii=False)}\n".encode()


def _energy(result: dict[str, Any]) -> float:
    return sum(result["energy"].values())


def _hottest(result: dict[str, Any]) -> float:
    return max(result["peak_temperature"].values())


def _spread(values: Sequence[float]) -> str:
    return f"{np.median(values):.0f} ({min(values):.0f} to {max(values):.0f})"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs what is missing and prints the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20, help="seeds 0, 1, ... of each object")
    parser.add_argument("--object", choices=list(OBJECTS), help="only this one")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, default=Path("runs/success"), help="folder")
    parser.add_argument("--fresh", action="store_true", help="forget earlier results")
    parser.add_argument("--tables", action="store_true", help="print the tables of docs/arm.md")
    arguments = parser.parse_args(argv)

    path = arguments.out / "results.jsonl"
    kinds = [arguments.object] if arguments.object else list(OBJECTS)
    cases = [(kind, seed) for seed in range(arguments.seeds) for kind in kinds]
    timed = [(kind, seed) for seed in TIMED for kind in kinds] if arguments.tables else []
    try:
        with claimed(arguments.out):
            results = {} if arguments.fresh else kept(path)
            write_whole(path, b"".join(map(_line, results.values())))
            missing = [(case,) for case in [*cases, *timed] if case not in results]
            bar = progress_bar(len(missing), unit="episodes")
            with bar, Workers(min(arguments.workers, len(missing))) as processes:
                for _, result in processes.run(run, missing):
                    results[result["object"], result["seed"]] = result
                    append_whole(path, _line(result))
                    bar.update()
    except KeyboardInterrupt:
        print(f"interrupted; run it again to go on from {path}", file=sys.stderr)
        return 130

    if timed:
        print("\n".join([*rates(results[case] for case in cases), "",
                         phase_table(results[case] for case in timed)]))  # fmt: skip
        return 0
    where = machine()
    said = table(results[case] for case in cases)
    report = (
        f"{said}\n\n{where['cpu']}, {where['cores']} cores; "
        + ", ".join(f"{name} {number}" for name, number in versions().items())
    )
    write_whole(arguments.out / "table.md", f"{report}\n".encode())
    print(report)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Holds tables of the pages against the scripts that print them, or writes them anew.

    python scripts/page_tables.py --check              all of them; under an hour of two cores
    python scripts/page_tables.py reach grasp          writes what has changed into these pages
    python scripts/page_tables.py reach --out FOLDER   keeps what the scripts print, too

A table that is printed stands on the page with the same first row; where several have that, they
are told apart by their order. What is printed and stands nowhere is said, and ends it with code 1,
as with --check does a table that differs in more than its columns and rows of times, or its
roundings, which hang on the machine. Pages that a script of their own writes between marks are
left out, but for those that it prints as well. tests/tables.txt says of every table what holds it;
one that is "printed" by a name and is not printed is said, too, and ends it with code 1.
"""

import argparse
import re
import shlex
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from tca_mj.files import write_whole
from tca_mj.pages import command_line

ROOT = Path(__file__).resolve().parent.parent
# What prints the tables of pages, by a name; the pages are those of that name but for a few.
PRINTED = {
    "adaptive-grasp": "adaptive_page.py --tables",
    "arm": "success_table.py --tables --fresh",
    "beyond": "beyond_page.py --tables",
    "bistable": "bistable_page.py --tables",
    "bistable-gripper": "bistable_gripper_page.py --tables",
    "cable": "cable_comparison.py",
    "certificate": "tetrapod_certificate.py rails bending legs gaits",
    "chain": "chain_table.py",
    "coil-bvp": "conical_tca.py --table",
    "commands": "gait_page.py --commands",
    "contacts": "tetrapod_contacts.py",
    "finger": "finger_page.py --tables",
    "grasp": "grasp_page.py --tables",
    "learned-model": "learned_model_page.py --tables",
    "models": "models_page.py",
    "morphing": "morphing_module.py --tables",
    "nodes": "node_table.py --nodes 4 6 8 10 12 16 --reference 48",
    "reach": "reach_page.py --tables",
    "replays": "shimmy_limit.py --replay",
    "rods": "tetrapod_certificate.py rods",
    "sensitivity": "sensitivity.py",
    "shape-memory": "shape_memory.py --tables",
    "tca": "tca_figures.py --tables",
    "walk-limit": "walk_limit.py",
    "warnings": "convexity_warnings.py",
}
STUDIES = sorted(path.stem for path in (ROOT / "scripts").glob("study_*.py"))
PRINTED |= {name: f"{name}.py --out build/studies" for name in STUDIES}
ELSEWHERE = {
    "bistable": ("bistable", "jump"), "cable": ("soft-bodies",), "chain": ("soft-bodies",),
    "certificate": ("tetrapod-model",), "commands": ("gaits",), "contacts": ("tetrapod",),
    "nodes": ("soft-bodies",), "replays": ("gaits",), "rods": ("tetrapod-model",),
    "walk-limit": ("tetrapod",), "warnings": ("tetrapod",),
    **dict.fromkeys(STUDIES, ("studies",)),
}  # fmt: skip
# Columns that hang on the machine, and rows:
TIMES = ("cable: µs per step", "chain: µs per step", "cost", "decision [ms]", "step [ms]")
TIMED = ("env.step", "env.step over its physics")
HOLDS = ROOT / "tests" / "tables.txt"
ROUNDED = re.compile(r"^\| \| of these warned")  # the first row of a table that does
TABLE = re.compile(r"^\|.*\n\|[-:| ]+\|\n(?:\|.*\n)*", re.MULTILINE)


def first_row(table: str) -> str:
    """What tables are told apart by."""
    return re.sub(r"\s+", " ", table.partition("\n")[0])


def holders() -> list[tuple[str, str, str]]:
    """Page, what holds it and first row of every table in ``HOLDS``, in the order of the pages."""
    found, page, kind = [], "", ""
    for line in HOLDS.read_text(encoding="utf-8").splitlines():
        deep = len(line) - len(line.lstrip())
        if line.startswith("#") or not line.strip():
            continue
        if deep == 0:
            page = line
        elif deep == 2:
            kind = line.strip()
        else:
            times, row = re.fullmatch(r" +(?:(\d+) x )?(\|.*)", line).groups()
            found += int(times or 1) * [(page, kind, row)]
    return found


def stands_for(row: str, head: str) -> bool:
    """Whether a row of ``HOLDS``, which may be cut off by an ellipsis, means a first row."""
    return head.startswith(row[:-1].rstrip()) if row.endswith("…") else head == row


def steady(table: str) -> list[list[str]]:
    """Its rows without columns and rows of times."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]
    kept = [i for i, head in enumerate(rows[0]) if head not in TIMES]
    return [[row[i] for i in kept] for row in rows if row[0] not in TIMED]


def tables(text: str) -> dict[str, list[str]]:
    """Tables of a text by their first rows; a zero has no sign."""
    text = re.sub(r"(?<=[ (])-(0\.0+)(?!\d)", r"\1", text)
    found = defaultdict(list)
    for match in TABLE.finditer(text if text.endswith("\n") else f"{text}\n"):
        found[first_row(match[0])].append(match[0])
    return found


def replaced(text: str, printed: dict[str, list[str]]) -> tuple[str, list[str], list[str]]:
    """A page with printed tables in place of its own.

    Args:
        text: The page.
        printed: Tables by their first rows.

    Returns:
        The page; the first rows that it has; those of them whose tables were others.
    """
    here = tables(text)
    known = [head for head, each in printed.items() if len(here.get(head, ())) == len(each)]
    changed = [head for head in known if here[head] != printed[head]]
    for head in changed:
        after = iter(printed[head])
        text = TABLE.sub(
            lambda m, head=head, after=after: next(after) if first_row(m[0]) == head else m[0], text
        )
    return text, known, changed


def held(name: str, asked: argparse.Namespace) -> bool:
    """Runs what prints a page's tables, and holds the page against that or writes it."""
    print(f"{name}: {PRINTED[name]}", flush=True)
    command = [sys.executable, *shlex.split(f"{ROOT / 'scripts'}/{PRINTED[name]}")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if asked.out:
        write_whole(asked.out / f"{name}.md", done.stdout.encode())
    if done.returncode:
        print(done.stderr[-2000:])
        return False
    printed, there, differ, wrong = tables(done.stdout), set(), [], []
    for page in ELSEWHERE.get(name, (name,)):
        path = ROOT / "docs" / f"{page}.md"
        old = path.read_text(encoding="utf-8")
        text, known, changed = replaced(old, printed)
        there |= {*known}
        differ += changed
        here = tables(old)
        wrong += [
            head for head in changed if not ROUNDED.search(head)
            and [*map(steady, here[head])] != [*map(steady, printed[head])]
        ]  # fmt: skip
        if changed and not asked.check:
            write_whole(path, text.encode())
    for head in printed:
        said = "as it was" if head not in differ else "written"
        if head in differ and asked.check:
            said = "differs" if head in wrong else "differs in what hangs on the machine"
        print(f"  {said if head in there else 'on no page'}: {head}", flush=True)
    missing = [
        row for _, kind, row in holders()
        if kind == f"printed {name}" and not any(stands_for(row, head) for head in printed)
    ]  # fmt: skip
    for row in missing:
        print(f"  not printed: {row}")
    if asked.check:
        missing += wrong
    return bool(printed) and there == printed.keys() and not missing


def main() -> int:
    parser = command_line(__doc__)
    parser.add_argument("names", nargs="*", help="which; without any, all")
    parser.add_argument("--check", action="store_true", help="write nothing")
    parser.add_argument("--out", type=Path, help="folder in which what is printed is kept")
    asked = parser.parse_args()
    unknown = sorted({*asked.names} - PRINTED.keys())
    if unknown:
        parser.error(f"names must be among {', '.join(PRINTED)}, got {', '.join(unknown)}")
    if asked.out:
        asked.out.mkdir(parents=True, exist_ok=True)
    return 0 if all([held(name, asked) for name in asked.names or PRINTED]) else 1


if __name__ == "__main__":
    sys.exit(main())

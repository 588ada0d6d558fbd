"""The table of docs/design.md on legs and the gaits searched for them, by the page's commands.

    python scripts/legs_table.py             a quarter of an hour of one core, then the page
    python scripts/legs_table.py --workers 1

Both sweeps are kept in runs/legs and runs/fixed; a second call goes on where the first one stopped.
"""

import csv
import os
import shlex
import sys
from pathlib import Path

from tca_mj.cli import main as tca_mj
from tca_mj.pages import command_line, table, write_between

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "design.md"
MARK = "scripts/legs_table.py"


def commands() -> list[list[str]]:
    """The sweeps as the page tells to type them."""
    text = PAGE.read_text(encoding="utf-8").replace("\\\n", " ")
    return [shlex.split(line, comments=True)[1:] for line in text.splitlines()
            if line.startswith("tca-mj sweep")]  # fmt: skip


def figure(row: dict[str, str], name: str, scale: float) -> str:
    """A figure with its interval."""
    mean, low, high = (scale * float(row[f"{name}{end}"]) for end in ("", "_low", "_high"))
    return f"{mean:.2f} ({low:.2f} to {high:.2f})"


def rows(command: list[str]) -> dict[float, dict[str, str]]:
    """What a sweep has found, by the length of the leg [m]."""
    out = ROOT / command[command.index("--out") + 1]
    with (out / "results.csv").open(encoding="utf-8", newline="") as file:
        return {float(next(value for name, value in row.items() if name.endswith("leg.length"))):
                row for row in csv.DictReader(file)}  # fmt: skip


def main() -> int:
    """Runs what is not there yet and writes the table."""
    parser = command_line(__doc__)
    parser.add_argument("--workers", help="trials at a time; default one per core")
    workers = parser.parse_args().workers
    os.chdir(ROOT)
    own, fixed = commands()
    for command in (own, fixed):
        code = tca_mj([*command, *(["--workers", workers] if workers else [])])
        if code:
            return code
    given, found = rows(fixed), rows(own)
    lines = table(
        ["leg", "the gait of the 55 mm leg [mm/s]", "a gait of its own [mm/s]",
         "kJ/m, of its own"],
        ([f"{1e3 * length:.0f} mm", figure(given[length], "speed", 1e3),
          figure(row, "speed", 1e3), f"{1e-3 * float(row['energy_per_metre']):.2f}"]
         for length, row in sorted(found.items())),
    )  # fmt: skip
    write_between(PAGE, MARK, lines)
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Measures the speed of the tasks and their recordings: ``tca-mj bench`` from a checkout.

    python scripts/benchmark.py --out runs/bench
    python scripts/benchmark.py --page           writes what lies in runs/bench into the page
"""

import sys
from pathlib import Path

from tca_mj.cli import main
from tca_mj.pages import write_between

ROOT = Path(__file__).resolve().parent.parent
PAGE, OUT = ROOT / "docs" / "benchmarks.md", ROOT / "runs" / "bench"
PARTS = {"tca-mj bench single": "benchmark.md", "tca-mj bench vector": "vector.md"}


def write_page() -> int:
    """Puts both reports into the page, between their marks."""
    for mark, name in PARTS.items():
        write_between(PAGE, mark, (OUT / name).read_text(encoding="utf-8").splitlines())
    return 0


if __name__ == "__main__":
    sys.exit(write_page() if sys.argv[1:] == ["--page"] else main(["bench", *sys.argv[1:]]))

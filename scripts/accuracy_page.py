"""Writes docs/accuracy.md below its marker, and docs/pictures/accuracy_*.png, in some minutes.

    python scripts/accuracy_page.py

All of it is computed: the modules against theory (``tca-mj certify``), then the chain and
MuJoCo's cable against closed forms (``scripts/cable_comparison.py``).
"""

import runpy
import shutil
import tempfile
from pathlib import Path

from tca_mj.certify.report import certify
from tca_mj.pages import command_line

HERE = Path(__file__).resolve()
DOCS = HERE.parents[1] / "docs"
MARKER = "<!-- Written by scripts/accuracy_page.py from here on. -->\n"


def main() -> None:
    command_line(__doc__).parse_args()
    page = DOCS / "accuracy.md"
    introduction, marker, _ = page.read_text(encoding="utf-8").partition(MARKER)
    if not marker:
        raise SystemExit(f"{page} has no line {MARKER!r}")
    with tempfile.TemporaryDirectory() as folder:
        result = certify(out=Path(folder))
        text = (Path(folder) / "report.md").read_text(encoding="utf-8")
        for picture in Path(folder).glob("*.png"):
            shutil.copyfile(picture, DOCS / "pictures" / picture.name)
    text = text.replace("](accuracy_", "](pictures/accuracy_")
    table = runpy.run_path(str(HERE.parent / "cable_comparison.py"))["table"]()
    cable = f"## The chain and MuJoCo's own cable\n\nTip error in % of the length.\n\n{table}"
    page.write_text(f"{introduction}{MARKER}\n{text}\n\n{cable}\n", encoding="utf-8")
    print(f"{page}: {result['seconds']}")


if __name__ == "__main__":
    main()

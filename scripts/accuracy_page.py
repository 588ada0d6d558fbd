"""Writes docs/accuracy.md below its marker, and docs/pictures/accuracy_*.png, in some minutes.

    python scripts/accuracy_page.py
    python scripts/accuracy_page.py --of FOLDER    what ``tca-mj certify --out FOLDER`` has written

All of it is computed by ``tca-mj certify``: the modules against the theory of rods.
"""

import shutil
import tempfile
from pathlib import Path

from tca_mj.certify.report import certify
from tca_mj.files import write_whole
from tca_mj.pages import command_line

DOCS = Path(__file__).resolve().parents[1] / "docs"
MARKER = "<!-- Written by scripts/accuracy_page.py from here on. -->\n"


def write(folder: Path) -> None:
    """Puts a report and its figures into the documentation."""
    page = DOCS / "accuracy.md"
    introduction, marker, _ = page.read_text(encoding="utf-8").partition(MARKER)
    if not marker:
        raise SystemExit(f"{page} has no line {MARKER!r}")
    text = (folder / "report.md").read_text(encoding="utf-8")
    for picture in folder.glob("accuracy_*.png"):
        shutil.copyfile(picture, DOCS / "pictures" / picture.name)
    text = text.replace("](accuracy_", "](pictures/accuracy_").rstrip("\n")
    write_whole(page, f"{introduction}{MARKER}\n{text}\n".encode())
    print(page)


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("--of", type=Path, metavar="FOLDER", help="compute nothing, take this")
    asked = parser.parse_args()
    if asked.of:
        return write(asked.of)
    with tempfile.TemporaryDirectory() as folder:
        certify(out=Path(folder))
        write(Path(folder))


if __name__ == "__main__":
    main()

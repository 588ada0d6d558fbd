"""Writes docs/validation.md below its marker, and docs/pictures/validation_*.png."""

import shutil
import tempfile
from pathlib import Path

from tca_mj.validation.report import report, validate_tca

DOCS = Path(__file__).parents[1] / "docs"
MARKER = "<!-- Written by scripts/validation_page.py from here on. -->\n"


def main() -> None:
    page = DOCS / "validation.md"
    introduction, marker, _ = page.read_text(encoding="utf-8").partition(MARKER)
    if not marker:
        raise SystemExit(f"{page} has no line {MARKER!r}")
    with tempfile.TemporaryDirectory() as folder:
        result = validate_tca(Path(folder))
        for picture in Path(folder).glob("*.png"):
            shutil.copyfile(picture, DOCS / "pictures" / picture.name)
    text = report(result, "pictures/")
    page.write_text(f"{introduction}{MARKER}\n{text}\n", encoding="utf-8")
    print(result["tally"])


if __name__ == "__main__":
    main()

"""Writes docs/validation*.md below their markers, and docs/pictures/validation_*.png."""

import re
import shutil
import tempfile
from pathlib import Path

from tca_mj.pages import command_line
from tca_mj.validation.report import report, validate_tca

DOCS = Path(__file__).parents[1] / "docs"
MARKER = "<!-- Written by scripts/validation_page.py from here on. -->\n"
# With which of its headings each page begins; the first has what stands above all of them.
PAGES = {"validation": 0, "validation-models": 2, "validation-modules": 4}


def written(text: str) -> dict[str, str]:
    """The pages by name: what stands on each by hand, then its part of a report."""
    head, *chapters = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    ends = [*list(PAGES.values())[1:], len(chapters)]
    found = {}
    for (name, start), end in zip(PAGES.items(), ends, strict=True):
        introduction, marker, _ = (DOCS / f"{name}.md").read_text("utf-8").partition(MARKER)
        if not marker:
            raise SystemExit(f"{name}.md has no line {MARKER!r}")
        part = "".join(([] if start else [head]) + chapters[start:end])
        found[name] = f"{introduction}{MARKER}\n{part.rstrip()}\n"
    return found


def main() -> None:
    command_line(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        result = validate_tca(Path(folder))
        for picture in Path(folder).glob("*.png"):
            shutil.copyfile(picture, DOCS / "pictures" / picture.name)
    for name, page in written(report(result, "pictures/")).items():
        (DOCS / f"{name}.md").write_text(page, encoding="utf-8")
    print(result["tally"])


if __name__ == "__main__":
    main()

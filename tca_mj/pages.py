"""Results as pages: tables and pictures in Markdown, and the same as data beside them."""

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from tca_mj.files import write_whole


def table(heads: Sequence[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """Lines of a table in Markdown.

    Args:
        heads: Titles of the columns.
        rows: A cell for each of them.
    """
    head, *lines = (
        "|" + "".join(f" {cell} |" if cell else " |" for cell in row) for row in (heads, *rows)
    )
    return [head, "|---" * len(heads) + "|", *lines]


def made_with(result: dict[str, Any]) -> list[str]:
    """Two lines on the ``machine`` and ``versions`` that a result states."""
    where = result["machine"]
    kept = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    return [f"{where['cpu']}, {where['cores']} cores; {where['system']}", kept]


def picture(caption: str, path: str) -> str:
    """A picture with its caption below it."""
    return f"![{caption}]({path})\n\n*{caption}*"


def page(*blocks: str | Iterable[str]) -> str:
    """Blocks of Markdown, as text or as lines, a blank line between two; without empty ones."""
    texts = (block if isinstance(block, str) else "\n".join(block) for block in blocks)
    return "\n\n".join(text for text in texts if text)


def write_between(path: Path, mark: str, lines: Iterable[str]) -> None:
    """Writes lines into a page, between ``<!-- mark -->`` and the next ``<!-- end -->``.

    Args:
        path: The page.
        mark: What its table is marked with, the command that writes it.
        lines: What stands there from now on.

    Raises:
        ValueError: If the page has no such mark, several of them, or none that ends it.
    """
    text, first = path.read_text(encoding="utf-8"), f"<!-- {mark} -->"
    before, *rest = text.split(first)
    if len(rest) != 1 or "<!-- end -->" not in rest[0]:
        raise ValueError(
            f"{path.name} must have one {first} that <!-- end --> follows, got {len(rest)}"
        )
    after = rest[0].partition("<!-- end -->")[2]
    written = "\n".join([f"{before}{first}", "", *lines, "", f"<!-- end -->{after}"])
    write_whole(path, written.encode())


def write_result(
    out: Path | None, name: str, result: Any, text: str, *, indent: int = 2
) -> None:
    """Writes a result as ``<name>.json`` and what it says as ``<name>.md`` into a folder."""
    if out is None:
        return
    data = json.dumps(result, indent=indent, ensure_ascii=False)
    for ending, content in ((".json", data), (".md", text)):
        write_whole(out / f"{name}{ending}", f"{content}\n".encode())


def command_line(about: str | None) -> argparse.ArgumentParser:
    """The options of a script, whose ``--help`` shows what it does as it stands there.

    Args:
        about: What the script does, its docstring.
    """
    return argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def folder_of_pictures(about: str | None, usual: Path) -> Path | None:
    """Where a script puts its pictures, from its command line; None if it is to print its tables.

    Args:
        about: What the script does.
        usual: The folder if none is given; it is made if it is missing.
    """
    parser = command_line(about)
    parser.add_argument("--out", type=Path, default=usual, help="where the pictures are put")
    parser.add_argument("--tables", action="store_true", help="print the tables, draw nothing")
    asked = parser.parse_args()
    if asked.tables:
        return None
    out: Path = asked.out
    out.mkdir(parents=True, exist_ok=True)
    return out

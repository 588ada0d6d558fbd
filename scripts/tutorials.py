"""Walks through the tutorials as their readers do: every block, in order, from an empty folder.

    python scripts/tutorials.py                  all of them, and what they print is compared
    python scripts/tutorials.py physics          one of them
    python scripts/tutorials.py physics --write  and the page gets what was printed and drawn
    python scripts/tutorials.py train --instead "--steps 5000=--steps 120"
                                                 with other words; nothing is compared

All Python of a page shares its names, as in a notebook; ``python NAME.py`` is a file that is saved,
``sh`` is typed into a shell, and ``no-run`` is left out. A ``text`` block is what the block above
it printed: the same words, and numbers within 2 % or one unit of their last digit. In ``text
varies``, where processors differ in what is learned or how long it takes, only the words count.
"""

import argparse
import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
NAMES = ("muscle", "robot", "train", "physics")
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```\n?", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
CLOSE = 0.02  # of a number, between two machines


class Block(NamedTuple):
    """A piece of a page.

    Attributes:
        kind: ``text`` of the page, ``python``, ``file``, ``sh``, ``said``, or ``shown``, a block
            that is not run.
        text: What stands in it.
        name: Of a file its name, of what was said "varies" or nothing, of what is shown its fence.
        line: Line of the page at which it begins.
    """

    kind: str
    text: str
    name: str
    line: int


def page_of(name: str) -> Path:
    """The page of a tutorial."""
    return DOCS / f"tutorial-{name}.md"


def blocks(text: str) -> Iterator[Block]:
    """The pieces of a page, in their order; together they are the page."""
    at = 0
    for fence in FENCE.finditer(text):
        if text[at : fence.start()].strip():
            yield Block("text", text[at : fence.start()], "", text.count("\n", 0, at) + 1)
        first, _, rest = fence[1].strip().partition(" ")
        line = text.count("\n", 0, fence.start()) + 1
        if first == "text":
            yield Block("said", fence[2], rest, line)
        elif first == "python" and rest.endswith(".py"):
            yield Block("file", fence[2], rest, line)
        elif first in ("python", "sh") and not rest:
            yield Block(first, fence[2], "", line)
        else:
            yield Block("shown", fence[2], fence[1].strip(), line)
        at = fence.end()
    if text[at:].strip():
        yield Block("text", text[at:], "", text.count("\n", 0, at) + 1)


def agrees(said: str, expected: str, varies: bool) -> bool:
    """Whether what was printed is what a page says.

    Args:
        said: What was printed.
        expected: What stands on the page.
        varies: Whether its numbers are only examples.
    """

    def words(text: str) -> list[str]:
        return NUMBER.sub("0", text).split()

    if words(said) != words(expected):
        return False
    if varies:
        return True
    for found, wanted in zip(NUMBER.findall(said), NUMBER.findall(expected), strict=True):
        digits = wanted.partition("e")[0].partition(".")[2]
        unit = 10.0 ** -len(digits) * 10.0 ** int(wanted.partition("e")[2] or 0)
        allowed = CLOSE * abs(float(wanted)) + 1.01 * unit
        if abs(float(found) - float(wanted)) > allowed:
            return False
    return True


def shell(text: str) -> str:
    """What a block of commands prints; it ends the walk where one of them fails."""
    command = ["bash", "-e", "-o", "pipefail", "-c", text]
    here = os.path.dirname(sys.executable)
    place = {**os.environ, "PATH": f"{here}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=place)
    if done.returncode:
        raise RuntimeError(f"{text}ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def walk(name: str, instead: dict[str, str]) -> Iterator[tuple[Block, str]]:
    """Runs the blocks of a page in the working folder; yields each with what it printed.

    Args:
        name: The tutorial.
        instead: Other words for some of its words.
    """
    page = page_of(name)
    text = page.read_text(encoding="utf-8")
    for old, new in instead.items():
        if old not in text:
            raise ValueError(f"{page.name} must have {old!r}")
        text = text.replace(old, new)
    space: dict[str, Any] = {"__name__": "__main__"}
    sys.path.insert(0, os.getcwd())
    for block in blocks(text):
        said = ""
        if block.kind == "file":
            Path(block.name).write_text(block.text, encoding="utf-8")
        elif block.kind == "sh":
            said = shell(block.text)
        elif block.kind == "python":
            source = "\n" * block.line + block.text  # errors name the line of the page
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(source, str(page), "exec"), space)
            said = out.getvalue()
        yield block, said


def run(name: str, *, instead: dict[str, str], write: bool) -> list[str]:
    """Walks through a tutorial in an empty folder; returns where it is not what its page says.

    Args:
        name: The tutorial.
        instead: Other words for some of its words; then nothing is compared.
        write: Whether the page gets what was printed, and the documentation what was drawn.
    """
    page, wrong, last, printed = page_of(name), [], "", []
    home, folder = os.getcwd(), tempfile.mkdtemp(prefix=f"tutorial-{name}-")
    os.chdir(folder)
    try:
        for block, said in walk(name, instead):
            if block.kind in ("python", "sh"):
                last = "\n".join(line.rstrip() for line in said.splitlines()).strip("\n") + "\n"
            elif block.kind == "said":
                if not instead and not agrees(last, block.text, bool(block.name)):
                    wrong.append(
                        f"{page.name}:{block.line} says\n{block.text}but this was printed:\n{last}"
                    )
                printed.append(last)
        text = page.read_text(encoding="utf-8")
        drawn = re.findall(r"\]\(pictures/(tutorial_[\w.]+)\)", text)
        wrong += [f"{each} was not drawn" for each in drawn if not Path(each).is_file()]
        if write:
            new = iter(printed)
            text = FENCE.sub(
                lambda fence: f"```{fence[1]}\n{next(new)}```\n"
                if fence[1].startswith("text") else fence[0], text,
            )  # fmt: skip
            page.write_text(text, encoding="utf-8")
            for each in drawn:
                shutil.copyfile(each, DOCS / "pictures" / each)
    finally:
        os.chdir(home)
        shutil.rmtree(folder)
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", help=f"of {', '.join(NAMES)}; without any, all")
    parser.add_argument("--write", action="store_true", help="write what was printed and drawn")
    parser.add_argument("--instead", action="append", default=[], metavar="OLD=NEW",
                        help="other words for some of a page; nothing is compared")  # fmt: skip
    asked = parser.parse_args()
    if unknown := set(asked.names) - set(NAMES):
        parser.error(f"names must be of {', '.join(NAMES)}, got {', '.join(sorted(unknown))}")
    os.environ["MPLBACKEND"] = "Agg"
    failed = 0
    for name in asked.names or NAMES:
        begun, busy = time.monotonic(), os.times()
        instead = dict(each.split("=", 1) for each in asked.instead)
        wrong = run(name, instead=instead, write=asked.write)
        now = os.times()
        spent = sum(now[:4]) - sum(busy[:4])
        print(*wrong, sep="\n", end="\n" if wrong else "")
        print(f"{name}: {'another' if wrong else 'as its page says'},"
              f" {time.monotonic() - begun:.0f} s, {spent:.0f} s of processor time")  # fmt: skip
        failed += bool(wrong) and not asked.write
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

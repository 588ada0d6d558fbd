"""Episodes that are finished, a line of ``episodes.jsonl`` each, to go on from.

Whatever the file holds, what is read of it are episodes as they were written.
"""

import json
import math
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tca_mj.checks import door
from tca_mj.files import append_whole, write_whole

EPISODES = "episodes.jsonl"

# Numbers that every episode has, and those that it may have.
_NUMBERS = ("return", "success", "duration", "energy", "peak_temperature", "peak_tension")
_OF_HEADWAY = ("distance", "drift", "speed", "weight")
_LONGEST = 65_536  # of a line, more than an episode can have [bytes]


@door
def kept(path: Path, key: str) -> dict[int, dict[str, Any]]:
    """Episodes in a file that have ``key``, by seed; lines that are no episodes are left out.

    Args:
        path: The file, one JSON object a line.
        key: What ``Evaluation.key`` says.

    Raises:
        OSError: If it cannot be read.
    """
    return _by_seed(_read(path)[0], key)


def begun(path: Path, key: str, *, fresh: bool = False) -> dict[int, dict[str, Any]]:
    """As ``kept``, and makes the file one that can be gone on with: lines that are no episodes go.

    Args:
        path: The file.
        key: What ``Evaluation.key`` says.
        fresh: Whether to drop those that have it.
    """
    rows, others = _read(path)
    if others:
        print(f"{path}: {others} lines that are no episodes are left out", file=sys.stderr)
    if fresh:
        rows = [row for row in rows if row["key"] != key]
    write_whole(path, b"".join(map(_line, rows)))
    return _by_seed(rows, key)


def keep(path: Path, key: str, episode: Mapping[str, Any]) -> None:
    """Adds an episode to a file."""
    append_whole(path, _line({"key": key, **episode}))


def _by_seed(rows: Iterable[Mapping[str, Any]], key: str) -> dict[int, dict[str, Any]]:
    return {
        row["seed"]: {name: value for name, value in row.items() if name != "key"}
        for row in rows
        if row["key"] == key
    }


def _read(path: Path) -> tuple[list[dict[str, Any]], int]:
    """The episodes in a file, and how many lines it has besides."""
    if not path.exists():
        return [], 0
    with path.open("rb") as file:
        rows = [_episode(line) for line in iter(lambda: file.readline(_LONGEST), b"")]
    episodes = [row for row in rows if row is not None]
    return episodes, len(rows) - len(episodes)


def _episode(line: bytes) -> dict[str, Any] | None:
    """An episode as it was written, or None if a line is something else."""
    try:
        row = json.loads(line)
        names = isinstance(row["key"], str) and isinstance(row["ending"], str)
        numbers = [row[name] for name in (*_NUMBERS, *(n for n in _OF_HEADWAY if n in row))]
        right = all(type(number) in (float, int, bool) for number in numbers)
        whole = names and right and type(row["seed"]) is int
        return row if whole and all(map(math.isfinite, numbers)) else None
    except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError):
        return None


def _line(row: Mapping[str, Any]) -> bytes:
    return f"{json.dumps(row, ensure_ascii=False)}\n".encode()

"""Results as files that are whole at any moment: JSON and CSV."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tca_mj.files import write_whole

Row = Mapping[str, Any]

_MOST = 1 << 24  # size of a file that is read [bytes]


def write_json(path: Path, value: Any, *, indent: int = 2) -> Path:
    """Writes a value as JSON."""
    text = json.dumps(value, indent=indent, ensure_ascii=False)
    return write_whole(path, f"{text}\n".encode())


def read_json(path: Path) -> dict[str, Any]:
    """Reads an object from a file of JSON.

    Raises:
        ValueError: If it holds anything else, or more than 16 MB.
        OSError: If it cannot be read.
    """
    with path.open("rb") as file:
        content = file.read(_MOST + 1)
    try:
        found = json.loads(content) if len(content) <= _MOST else None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{path} must hold an object as JSON: it is broken, or another file")
    return found


def write_csv(path: Path, rows: Sequence[Row], columns: Sequence[str] = ()) -> Path:
    """Writes rows as CSV, by default with all their keys in the order in which they come up."""
    text = io.StringIO()
    names = columns or list(dict.fromkeys(key for row in rows for key in row))
    table = csv.DictWriter(text, names, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return write_whole(path, text.getvalue().encode())


def plain(value: Any) -> Any:
    """A value with None in place of the numbers that JSON does not have: infinity and NaN."""
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

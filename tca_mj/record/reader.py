"""Recordings read back: curves as arrays with their times and units, and as a table."""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rerun.chunk import RrdReader

from tca_mj.checks import Array, door
from tca_mj.files import write_whole

UNITS = {
    "power": "W", "temperature": "°C", "body_temperature": "°C", "tension": "N", "length": "m",
    "resistance": "ohm", "voltage": "V",
}  # fmt: skip
_VALUES = "Scalars:scalars"


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One curve of a recording.

    Attributes:
        time: Recorded times, rising, shape (k,) [s].
        values: Values at these times, in the unit ``unit``, shape (k,).
        unit: Their unit; ``-`` where the recording says none.
    """

    time: Array
    values: Array
    unit: str


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What a recording holds besides geometry.

    Attributes:
        curves: Curves by their entity without the leading slash, for example
            ``actuators/leg.tca0/tension`` or ``reward/progress``.
        events: Times [s] and texts of the events.
    """

    curves: Mapping[str, Curve]
    events: tuple[tuple[float, str], ...]


@door
def read(path: str | Path) -> Recording:
    """Reads a recording that ``Recorder`` has written.

    Args:
        path: The file.

    Raises:
        FileNotFoundError: If there is no such file.
        ValueError: If it is no recording.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no recording {path}")
    clocks: dict[str, list[float]] = defaultdict(list)
    values: dict[str, list[float]] = defaultdict(list)
    texts: list[tuple[float, str]] = []
    try:
        for chunk in RrdReader(path).stream().to_chunks():
            batch = chunk.to_record_batch()
            columns = dict(zip(batch.schema.names, batch.columns, strict=True))
            if "sim_time" not in columns:
                continue
            ticks = np.array(columns["sim_time"]).astype("timedelta64[ns]").astype(np.int64)
            entity, clock = chunk.entity_path.lstrip("/"), (1e-9 * ticks).tolist()
            for name, column in columns.items():
                rows = column.to_pylist() if name.rpartition(":")[2] in ("scalars", "text") else ()
                if name.endswith("text"):
                    texts += [(t, row[0]) for t, row in zip(clock, rows, strict=True) if row]
                elif len(rows):
                    clocks[entity] += clock
                    values[entity] += [row[0] if row else np.nan for row in rows]
    except Exception as error:
        raise ValueError(
            f"path must be a whole recording, got {path}: {error}; one that was cut off is"
            f" mended by: rerun rrd merge {path} -o whole.rrd"
        ) from error
    curves = {}
    for entity in sorted(values):
        order = np.argsort(clocks[entity], kind="stable")
        unit = UNITS.get(entity.rpartition("/")[2], "-")
        curves[entity] = Curve(
            np.array(clocks[entity])[order], np.array(values[entity])[order], unit
        )
    return Recording(curves, tuple(sorted(texts)))


@door
def write_csv(recording: Recording, path: str | Path) -> None:
    """Writes the curves as one table: a row for every time, a column with its unit for each curve.

    Where a curve has no value at a time its field is empty.

    Args:
        recording: What ``read`` gave.
        path: The file to write.

    Raises:
        OSError: If it cannot be written.
    """
    times = np.unique(np.concatenate([c.time for c in recording.curves.values()] or [np.zeros(0)]))
    heads = [f"{name} [{curve.unit}]" for name, curve in recording.curves.items()]
    table = np.full((len(times), len(heads)), np.nan)
    for column, curve in enumerate(recording.curves.values()):
        table[np.searchsorted(times, curve.time), column] = curve.values
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(["time [s]", *heads])
    for time, row in zip(times.tolist(), table.tolist(), strict=True):
        writer.writerow([repr(time), *("" if x != x else repr(x) for x in row)])
    write_whole(Path(path), text.getvalue().encode())

"""Spaces as tables: every entry of an observation or action with its name, bounds and unit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class Entry:
    """A row of a table.

    Attributes:
        name: What it is.
        size: How many numbers it takes.
        low: Lower bound.
        high: Upper bound.
        unit: Unit, ``-`` for none.
        off: Of an action, what leaves the robot alone; None for the middle of the bounds.
    """

    name: str
    size: int
    low: float
    high: float
    unit: str
    off: float | None = None


class Table:
    """Rows laid end to end in one flat array of float32.

    Attributes:
        entries: The rows.
        slices: Where each row lies in the array.
        size: Length of the array.
    """

    def __init__(self, entries: Sequence[Entry]) -> None:
        self.entries = tuple(entries)
        self.slices: dict[str, slice] = {}
        start = 0
        for entry in self.entries:
            self.slices[entry.name] = slice(start, start + entry.size)
            start += entry.size
        self.size = start
        sizes = [entry.size for entry in self.entries]
        self._low = np.repeat([e.low for e in self.entries], sizes).astype(np.float32)
        self._high = np.repeat([e.high for e in self.entries], sizes).astype(np.float32)

    @property
    def space(self) -> Any:
        """The table as a Gymnasium ``Box`` of float32."""
        return Box(self._low, self._high, dtype=np.float32)

    @property
    def still(self) -> NDArray[np.float32]:
        """The action that leaves the robot alone, shape (size,)."""
        off = [(e.low + e.high) / 2.0 if e.off is None else e.off for e in self.entries]
        return np.repeat(off, [entry.size for entry in self.entries]).astype(np.float32)

    def pack(self, values: Mapping[str, ArrayLike]) -> NDArray[np.float32]:
        """Lays the rows' values end to end.

        Raises:
            ValueError: If a row is missing, unknown or of the wrong size.
        """
        if values.keys() != self.slices.keys():
            raise ValueError(f"values must be {sorted(self.slices)}, got {sorted(values)}")
        rows = [np.ravel(values[entry.name]) for entry in self.entries]
        for entry, row in zip(self.entries, rows, strict=True):
            if row.size != entry.size:
                raise ValueError(f"{entry.name} must have {entry.size} numbers, got {row.size}")
        return np.concatenate(rows, dtype=np.float32, casting="same_kind")

    def read(self, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """The rows of an array of shape (..., size), by name."""
        return {name: array[..., where] for name, where in self.slices.items()}

    def outside(self, array: NDArray[Any]) -> list[str]:
        """Names of the rows that are not finite or out of their bounds."""
        good = (array >= self._low) & (array <= self._high)  # false for what is not a number
        if good.all():
            return []
        bad = ~good
        return [name for name, where in self.slices.items() if bad[where].any()]

    def bounded(self, array: NDArray[Any]) -> NDArray[np.float32]:
        """The array with what is out of bounds on the nearest one, and 0 for what is no number."""
        return np.clip(np.nan_to_num(array), self._low, self._high).astype(np.float32)

    def markdown(self) -> str:
        """The table as Markdown, for the documentation."""
        lines = ["| index | entry | low | high | unit |", "|---|---|---|---|---|"]
        for entry in self.entries:
            where = self.slices[entry.name]
            last = where.stop - 1
            index = f"{where.start}" if entry.size == 1 else f"{where.start}-{last}"
            lines.append(
                f"| {index} | {entry.name} | {entry.low:g} | {entry.high:g} | {entry.unit} |"
            )
        return "\n".join(lines)


def numbers(name: str, value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """``value`` as real, finite numbers of the given shape, or a ``ValueError`` that names it."""
    try:
        array = np.asarray(value)
        if array.shape == shape and array.dtype.kind in "iuf" and np.isfinite(array).all():
            return array.astype(np.float64)
    except (TypeError, ValueError):
        pass
    raise ValueError(f"{name} must be finite numbers of shape {shape}, got {value!r}")

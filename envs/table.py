"""Spaces as tables: every entry of an observation or action with its name, bounds and unit."""

from __future__ import annotations

from array import array as singles
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, TypeAlias

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import (
    Checked,
    Edge,
    Finite,
    Positive,
    door,
    every,
    instance,
    shown,
    whole,
    within,
)  # fmt: skip

Mirror: TypeAlias = tuple[NDArray[np.int64], NDArray[np.float32]]
"""For each number of a table where it comes from in a mirror, and its sign."""
_Size = Annotated[int, partial(whole, at_least=1, at_most=10_000)]  # as long as a picture is wide
_EDGE = 1.0 + 1e-6  # of actions, which rounding may leave a little outside


@dataclass(frozen=True, slots=True)
class Entry(Checked):
    """A row of a table.

    Attributes:
        name: What it is.
        size: How many numbers it takes, 1 to 10 000.
        low: Lower bound [``unit``, as all numbers of the row].
        high: Upper bound [``unit``].
        unit: Unit, ``-`` for none.
        off: Of an action, what leaves the robot alone [``unit``]; None for the middle of the
            bounds.
        centre: What is scaled to 0, the same for left and right [``unit``].
        scale: How far from there is scaled to 1 [``unit``]; None for half the way between the
            bounds.
        mirror: Where each number comes from in the mirror that swaps left and right: a place in
            the row, from 1, negative if the sign changes; empty if nothing does.
        ends: The same in the mirror that swaps front and rear.

    Raises:
        ValueError: If a field is out of its bounds, low above high, or a mirror no mirror.
    """

    name: str
    size: _Size
    low: Edge
    high: Edge
    unit: str
    off: Finite | None = None
    centre: Finite = 0.0
    scale: Positive | None = None
    mirror: tuple[int, ...] = ()
    ends: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.low > self.high:
            raise ValueError(f"low must be at most high, {self.high}, got {self.low}")
        for name, mirror in (("mirror", self.mirror), ("ends", self.ends)):
            if mirror and sorted(abs(k) for k in mirror) != list(range(1, self.size + 1)):
                raise ValueError(
                    f"{name} must name each of the {self.size} places of {self.name} once,"
                    f" got {shown(mirror)}"
                )


class Table:
    """Rows laid end to end in one flat array of float32.

    Attributes:
        entries: The rows.
        slices: Where each row lies in the array.
        size: Length of the array.
        symmetric: Whether it says what a mirror makes of it that swaps left and right.
    """

    @door
    def __init__(self, entries: Sequence[Entry]) -> None:
        self.entries = tuple(entries)
        self.slices: dict[str, slice] = {}
        start = 0
        for entry in self.entries:
            self.slices[entry.name] = slice(start, start + entry.size)
            start += entry.size
        self.size = start
        self._sizes = tuple((entry.name, entry.size) for entry in self.entries)
        sizes = [entry.size for entry in self.entries]
        self._low = np.repeat([e.low for e in self.entries], sizes).astype(np.float32)
        self._high = np.repeat([e.high for e in self.entries], sizes).astype(np.float32)
        scales = [(e.high - e.low) / 2.0 if e.scale is None else e.scale for e in self.entries]
        self._scale = np.repeat(scales, sizes).astype(np.float32)
        self._centre = np.repeat([e.centre for e in self.entries], sizes).astype(np.float32)
        self.symmetric = any(entry.mirror for entry in self.entries)
        self._sides = self._laid([entry.mirror for entry in self.entries])
        self._ends = self._laid([entry.ends for entry in self.entries])

    def _laid(self, rows: Sequence[tuple[int, ...]]) -> Mirror:
        """A mirror of the whole table."""
        places = [
            (self.slices[e.name].start, k) for e, row in zip(self.entries, rows, strict=True)
            for k in (row or range(1, e.size + 1))
        ]  # fmt: skip
        source = np.array([start + abs(k) - 1 for start, k in places], dtype=np.int64)
        return source, np.array([np.sign(k) for _, k in places], dtype=np.float32)

    @door
    def covering(self, bounds: Mapping[str, tuple[float, float]]) -> Table:
        """The table with rows that reach at least as far as the given bounds, by name.

        Raises:
            ValueError: If there is no such row, or a bound is no number.
        """
        if bounds.keys() - self.slices.keys():
            raise ValueError(f"bounds must be of rows {list(self.slices)}, got {shown(bounds)}")
        wider = (
            replace(e, low=min(e.low, bounds[e.name][0]), high=max(e.high, bounds[e.name][1]))
            if e.name in bounds else e
            for e in self.entries
        )  # fmt: skip
        return Table(tuple(wider))

    def scaled(self, array: NDArray[Any]) -> NDArray[np.float32]:
        """Every number by its row's centre and scale, shape (..., size), of the order of 1."""
        return ((array - self._centre) / self._scale).astype(np.float32)

    @property
    def units(self) -> NDArray[np.float32]:
        """Centre and scale of every number, shape (2, size)."""
        return np.array([self._centre, self._scale])

    @property
    def mirror(self) -> Mirror:
        """What a mirror that swaps left and right does: where each number comes from, and its sign.

        Raises:
            ValueError: If no row says how.
        """
        if not self.symmetric:
            raise ValueError("the table must have a mirror in one of its rows, got none")
        return self._sides

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Which of fewer numbers each place gets where what a mirror swaps is the same, (size,).

        Raises:
            ValueError: If no row says how, or a sign changes.
        """
        source, sign = self.mirror
        if (sign < 0.0).any():
            raise ValueError("the table must have a mirror without signs, got one with some")
        first: NDArray[np.int64] = np.minimum(np.arange(self.size), source)
        return np.unique(first, return_inverse=True)[1]

    @property
    def ends(self) -> Mirror:
        """The same of the mirror that swaps front and rear.

        Raises:
            ValueError: If no row says how.
        """
        if not any(entry.ends for entry in self.entries):
            raise ValueError("the table must have ends in one of its rows, got none")
        return self._ends

    def mirrored(self, array: NDArray[Any]) -> NDArray[Any]:
        """What it makes of an array, shape (..., size), also a scaled one; errors as ``mirror``."""
        source, sign = self.mirror
        return array[..., source] * sign

    @property
    def space(self) -> Any:
        """The table as a Gymnasium ``Box`` of float32."""
        return Box(self._low, self._high, dtype=np.float32)

    @property
    def scaled_space(self) -> Any:
        """The same of what ``scaled`` makes of it."""
        return Box(self.scaled(self._low), self.scaled(self._high), dtype=np.float32)

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
        instance("values", values, Mapping)
        if values.keys() != self.slices.keys():
            found = sorted(map(str, values))
            raise ValueError(f"values must be {sorted(self.slices)}, got {found}")
        flat: list[float] = []
        for name, size in self._sizes:
            row = values[name]
            if type(row) is np.ndarray and row.ndim == 1:
                each = row.tolist()
            else:
                each = [row] if isinstance(row, float) else np.asarray(row).ravel().tolist()
            if len(each) != size:
                raise ValueError(f"{name} must have {size} numbers, got {len(each)}")
            flat += each
        return np.array(singles("f", flat))  # what diverged is infinite there, and so out of bounds

    def read(self, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """The rows of an array of shape (..., size), by name."""
        return {name: array[..., where] for name, where in self.slices.items()}

    def outside(self, array: NDArray[Any]) -> list[str]:
        """Names of the rows that are not finite or out of their bounds."""
        low, high = array >= self._low, array <= self._high  # false for what is not a number
        if every(low) and every(high):
            return []
        bad = ~(low & high)
        return [name for name, where in self.slices.items() if bad[where].any()]

    def bounded(self, array: NDArray[Any]) -> NDArray[np.float32]:
        """The array with what is out of bounds on the nearest one, and 0 for what is no number."""
        return np.clip(np.nan_to_num(array), self._low, self._high).astype(np.float32)

    def markdown(self) -> str:
        """The table as Markdown, for the documentation."""
        lines = ["| index | entry | low | high | unit | scale |", "|---|---|---|---|---|---|"]
        for entry in self.entries:
            where = self.slices[entry.name]
            last = where.stop - 1
            index = f"{where.start}" if entry.size == 1 else f"{where.start}-{last}"
            scale = float(self._scale[where.start])
            about = f"{entry.centre:g} ± {scale:g}" if entry.centre else f"± {scale:g}"
            lines.append(
                f"| {index} | {entry.name} | {entry.low:g} | {entry.high:g} | {entry.unit} |"
                f" {about} |"
            )
        return "\n".join(lines)


def commands(name: str, value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Actions as numbers within -1 and 1; beyond by a rounding they are on the bound.

    Raises:
        ValueError: If they have another shape, are not finite or out of bounds.
    """
    if type(value) is np.ndarray and value.shape == shape and value.dtype.kind == "f":
        command = value.astype(np.float64)
        if every(np.abs(command) <= 1.0):
            return command
    command = within(name, value, at_least=-_EDGE, at_most=_EDGE, shape=shape)
    return np.clip(command, -1.0, 1.0)

"""Arrays of the numbers of n objects, and dataclasses of arrays, stacked and taken apart."""

from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array

Value = TypeVar("Value")
_ONE = (1,)


def frozen(values: ArrayLike) -> Array:
    """A copy of ``values`` that cannot be written to."""
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array


ZERO, ONE = frozen(0.0), frozen(1.0)
"""Numbers for what runs often: NumPy takes half as long for one in an array as for Python's."""

FEW = 5  # TCAs that Python computes one by one, to the bit, faster than NumPy all at once


def alone(*values: Any) -> list[float] | None:
    """The numbers of arrays of one each, the first of shape (1,); None if they are not.

    Arithmetic is as exact with Python's numbers, and takes a tenth of the time.
    """
    first = values[0]
    if type(first) is not np.ndarray or first.shape != _ONE:
        return None
    try:
        return [value.item() for value in values]
    except (AttributeError, ValueError):  # a number of Python's, or several in one array
        return None


def column(objects: Iterable[Any], name: str) -> Array:
    """Attribute ``name`` of n objects, numbers or tuples of them, shape (n, ...)."""
    return frozen([getattr(each, name) for each in objects])


def stacked(values: Sequence[Value]) -> Value:
    """Dataclasses or named tuples of arrays as one, with an axis for them before all others.

    Fields that are such values themselves, or tuples of them, are stacked alike.
    """
    every: Any = values
    kind: Any = type(every[0])
    if kind is tuple:
        return tuple(map(stacked, zip(*every, strict=True)))  # type: ignore[return-value]
    if not _names(kind):
        return np.array(every)  # type: ignore[return-value]
    return kind(
        **{name: stacked([getattr(each, name) for each in every]) for name in _names(kind)}
    )


def row(values: Value, i: int) -> Value:
    """The ``i``-th of what ``stacked`` has made one."""
    every: Any = values
    kind: Any = type(every)
    if not _names(kind):
        return every[i]
    return kind(*[row(getattr(every, name), i) for name in _names(kind)])


def unstacked(values: Value) -> list[Value]:
    """All rows of what ``stacked`` has made one."""
    every: Any = values
    if isinstance(every, np.ndarray):
        return list(every)
    if type(every) is tuple:
        return list(zip(*map(unstacked, every), strict=True))  # type: ignore[arg-type]
    kind: Any = type(every)
    parts = zip(*[unstacked(getattr(every, name)) for name in _names(kind)], strict=True)
    return [kind(*each) for each in parts]


@cache
def _names(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a dataclass or a named tuple; none of anything else."""
    found: tuple[str, ...] = getattr(kind, "_fields", ())
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else found

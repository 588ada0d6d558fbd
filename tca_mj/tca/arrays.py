"""Arrays of the numbers of n objects, and dataclasses of arrays, stacked and taken apart."""

from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array

Value = TypeVar("Value")


def frozen(values: ArrayLike) -> Array:
    """A copy of ``values`` that cannot be written to."""
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array


def column(objects: Iterable[Any], name: str) -> Array:
    """Attribute ``name`` of n objects, numbers or tuples of them, shape (n, ...)."""
    return frozen([getattr(each, name) for each in objects])


def stacked(values: Sequence[Value]) -> Value:
    """Dataclasses of arrays as one, with an axis for them before all others.

    Fields that are dataclasses themselves, or tuples of them, are stacked alike.
    """
    first: Any = values[0]
    if isinstance(first, tuple):
        several = cast(Any, values)
        return cast(Value, tuple(stacked(each) for each in zip(*several, strict=True)))
    if not is_dataclass(first):
        return cast(Value, np.stack(cast(Any, values)))
    kind: Any = type(first)
    parts = {name: stacked([getattr(value, name) for value in values]) for name in _names(kind)}
    return cast(Value, kind(**parts))


def row(values: Value, i: int) -> Value:
    """The ``i``-th of what ``stacked`` has made one, of fields that need no names."""
    every: Any = values
    if isinstance(every, tuple):
        return cast(Value, tuple(row(each, i) for each in every))
    if not is_dataclass(every):
        return cast(Value, every[i])
    kind: Any = type(every)
    return cast(Value, kind(*[row(getattr(every, name), i) for name in _names(kind)]))


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))

"""Arrays of the numbers of n objects, and dataclasses of arrays, stacked and taken apart."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar

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
    return _mapped(lambda *each: np.stack(each), *values)


def row(values: Value, i: int) -> Value:
    """The ``i``-th of what ``stacked`` has made one."""
    return _mapped(lambda each: each[i], values)


def unstacked(values: Value) -> list[Value]:
    """All rows of what ``stacked`` has made one."""
    every: Any = values
    if isinstance(every, np.ndarray):
        return list(every)
    if isinstance(every, tuple):
        return list(zip(*map(unstacked, every), strict=True))  # type: ignore[arg-type]
    kind: Any = type(every)
    parts = zip(*[unstacked(getattr(every, name)) for name in _names(kind)], strict=True)
    return [kind(*each) for each in parts]


def _mapped(function: Callable[..., Any], *values: Any) -> Any:
    """``function`` of the arrays that stand at the same place in each of the values."""
    first = values[0]
    if isinstance(first, tuple):
        return tuple(_mapped(function, *each) for each in zip(*values, strict=True))
    if not is_dataclass(first):
        return function(*values)
    kind: Any = type(first)
    return kind(
        **{name: _mapped(function, *[getattr(each, name) for each in values])
           for name in _names(kind)}
    )  # fmt: skip


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))

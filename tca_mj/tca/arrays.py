"""Dataclasses of arrays, stacked and taken apart."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np

Value = TypeVar("Value")


def stacked(values: Sequence[Value]) -> Value:
    """Dataclasses of arrays as one, with an axis for them before all others.

    Fields that are dataclasses themselves are stacked alike.
    """
    first: Any = values[0]
    if not is_dataclass(first):
        return cast(Value, np.stack(cast(Any, values)))
    kind: Any = type(first)
    parts = {name: stacked([getattr(value, name) for value in values]) for name in _names(kind)}
    return cast(Value, kind(**parts))


def row(values: Value, i: int) -> Value:
    """The ``i``-th of what ``stacked`` has made one, of fields that need no names."""
    every: Any = values
    if not is_dataclass(every):
        return cast(Value, every[i])
    kind: Any = type(every)
    return cast(Value, kind(*[row(getattr(every, name), i) for name in _names(kind)]))


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))

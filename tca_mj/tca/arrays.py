"""Numbers from outside, real floats or a clear refusal; and dataclasses of arrays stacked."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

Value = TypeVar("Value")


def floats(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """``values`` as an array of floats, without a copy if they are one.

    Args:
        name: What they are, for the message.
        values: A real number or an array of them; NaN and infinity pass.

    Returns:
        The array.

    Raises:
        ValueError: If they are complex, text, ragged or no numbers at all, which NumPy would
            partly convert with a warning or none.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise TypeError
        return array.astype(np.float64)
    except (OverflowError, TypeError, ValueError) as error:
        text = f"{name} = {values!r} must be a real number or an array of them"
        raise ValueError(text) from error


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

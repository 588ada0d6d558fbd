"""Numbers from outside, real floats or a clear refusal; and dataclasses of arrays stacked."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
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
    parts = {
        field.name: stacked([getattr(value, field.name) for value in values])
        for field in fields(first)
    }
    return cast(Value, replace(cast(Any, first), **parts))


def row(values: Value, i: int) -> Value:
    """The ``i``-th of what ``stacked`` has made one."""
    every: Any = values
    if not is_dataclass(every):
        return cast(Value, every[i])
    parts = {field.name: row(getattr(every, field.name), i) for field in fields(every)}
    return cast(Value, replace(cast(Any, every), **parts))

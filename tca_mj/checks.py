"""Numbers from outside: real, finite and within their bounds, or a refusal that says what is wrong.

Every message reads ``name must ..., got ...``.
"""

import math
from collections.abc import Callable
from dataclasses import fields
from functools import cache, partial
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def floats(name: str, values: ArrayLike) -> Array:
    """``values`` as an array of floats, without a copy if they are one.

    Args:
        name: What they are, for the message.
        values: A real number or an array of them; NaN and infinity pass.

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
        raise ValueError(
            f"{name} must be a real number or an array of them, got {values!r}"
        ) from error


def within(
    name: str,
    values: ArrayLike,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    at_most: float = math.inf,
    unit: str = "",
    shape: tuple[int, ...] | None = None,
) -> Array:
    """``values`` as finite floats within bounds.

    Args:
        name: What they are, for the message.
        values: A real number or an array of them.
        above, at_least: Lower bound, without and with it.
        below, at_most: Upper bound, without and with it.
        unit: Unit of the bounds, for the message.
        shape: Shape that they must have; None for any.

    Raises:
        ValueError: If one is no real number, not finite or out of bounds, or the shape another.
    """
    array = floats(name, values)
    if shape is not None and array.shape != shape:
        kind = f"finite numbers of shape {shape}" if shape else "one finite number"
        raise ValueError(f"{name} must be {kind}, got {values!r}")
    if not array.size:
        return array
    least, most = float(array.min()), float(array.max())  # not a number if one is none
    if (
        math.isfinite(least) and math.isfinite(most)
        and above < least >= at_least and below > most <= at_most
    ):  # fmt: skip
        return array
    bounds = {"above": above, "at least": at_least, "below": below, "at most": at_most}
    said = [f"{word} {bound:.6g}" for word, bound in bounds.items() if math.isfinite(bound)]
    tail = f" {unit}" if unit and said else ""
    raise ValueError(f"{name} must be {' and '.join(['finite', *said])}{tail}, got {values!r}")


def number(name: str, value: Any, **bounds: Any) -> float:
    """One number within bounds, which are those of ``within``; errors as there."""
    return float(within(name, value, shape=(), **bounds))


def require_positive(**values: Any) -> None:
    """Checks fields of a specification by name.

    Raises:
        ValueError: If one of them is no single number, not finite or not above 0.
    """
    for name, value in values.items():
        number(name, value, above=0.0)


def require_count(**values: Any) -> None:
    """Checks fields of a specification that count something.

    Raises:
        ValueError: If one of them is no whole number or below 1.
    """
    for name, value in values.items():
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole:
            raise ValueError(f"{name} must be a whole number, got {value!r}")
        if value < 1:
            raise ValueError(f"{name} must be at least 1, got {value!r}")


def require_one_of(name: str, value: Any, choices: tuple[Any, ...]) -> None:
    """Raises ValueError unless ``value`` is one of the choices."""
    if value not in choices:
        raise ValueError(f"{name} must be one of {choices}, got {value!r}")


# Types of fields, which ``Checked`` checks. The plurals are numbers or arrays of them.
Finite = Annotated[float, number]
Positive = Annotated[float, partial(number, above=0.0)]
NotNegative = Annotated[float, partial(number, at_least=0.0)]
Temperature = Annotated[float, partial(number, above=-273.15)]
Count = Annotated[int, lambda name, value: require_count(**{name: value})]
Triple = Annotated[tuple[float, float, float], partial(within, shape=(3,))]
Positives = Annotated[float | Array, partial(within, above=0.0)]
NotNegatives = Annotated[float | Array, partial(within, at_least=0.0)]


class Checked:
    """A dataclass that checks itself: each field by what its type says.

    That is ``Literal[...]`` or ``Annotated[..., check]``; a check takes name and value and raises
    ValueError. What ties fields together is checked in a
    ``__post_init__`` that calls this one first.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, check in _checks(kind):
            check(name, getattr(self, name))


@cache
def _checks(kind: Any) -> tuple[tuple[str, Callable[[str, Any], Any]], ...]:
    types = get_type_hints(kind, include_extras=True)  # which a file may keep as text
    own = {field.name: types[field.name] for field in fields(kind)}
    choices = {name: get_args(type) for name, type in own.items() if get_origin(type) is Literal}
    return (
        *((name, partial(require_one_of, choices=each)) for name, each in choices.items()),
        *((name, check) for name in own for check in getattr(own[name], "__metadata__", ())),
    )

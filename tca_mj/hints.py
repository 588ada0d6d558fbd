"""What was probably meant: sizes in another unit, angles in degrees, names with a slip.

All numbers are in SI units. A bound here is one that nothing of its kind comes near, and that the
same number in millimetres, grams, megapascals or degrees passes; what passes it is refused with the
number that was meant. The bounds say what kind that is: they are none of the physics.
"""

import difflib
import math
from collections.abc import Iterable
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import quantity, shown

_SOFTEST = 100.0  # of gels that still have a shape [Pa]
_STIFFEST = 1e25  # diamond has 1e12; limits of theory, as of thin and stiff fibres, go beyond [Pa]


def size(
    name: str, value: Any, *, kind: str, at_most: float, at_least: float | None = None,
    unit: str = "m",
) -> float:  # fmt: skip
    """One number within what things of a kind measure.

    Args:
        name: What it is, for the message.
        value: The number.
        kind: What things these are, in the plural, for the message.
        at_most: What none of them reaches; a thousandth or a millionth of what is beyond is meant.
        at_least: Lower bound; None is above 0.
        unit: Unit of all of these.

    Raises:
        ValueError: If it is no number, or out of bounds.
    """
    least = {"above": 0.0} if at_least is None else {"at_least": at_least}
    found = quantity(name, value, **least)
    if found > at_most:
        meant = _meant([found * 1e-3, found * 1e-6], 0.0, at_most, unit)
        raise ValueError(
            f"{name} must be at most {at_most:g} {unit} ({kind} are below), got {shown(value)}"
            f"{meant}"
        )
    return found


def modulus(name: str, value: Any, *, typed: float = 1e6) -> float:
    """One modulus of elasticity [Pa], from that of gels on; errors as ``size``.

    Args:
        name: What it is, for the message.
        value: The number.
        typed: The unit that is probably meant where it is softer: megapascal, or 1e9 [Pa].
    """
    found = quantity(name, value, above=0.0, at_most=_STIFFEST, unit="Pa")
    if found < _SOFTEST:
        meant = _meant([found * typed], _SOFTEST, math.inf, "Pa")
        raise ValueError(
            f"{name} must be at least {_SOFTEST:g} Pa (gels are above), got {shown(value)}{meant}"
        )
    return found


def angle(name: str, value: Any, *, above: float = 0.0, below: float) -> float:
    """One angle between two others [rad]; errors as ``size``."""
    try:
        return quantity(name, value, above=above, below=below, unit="rad")
    except ValueError as error:
        degrees = isinstance(value, int | float) and abs(value) <= 360
        meant = _meant([math.radians(value)], above, below, "rad") if degrees else ""
        raise ValueError(f"{error}{meant}") from None


def nearest(name: Any, known: Iterable[str]) -> str:
    """The known name that is most like another, as the end of a message; empty if none is."""
    near = difflib.get_close_matches(name, list(known), 1) if isinstance(name, str) else []
    return f"; did you mean {near[0]!r}?" if near else ""


def _meant(values: list[float], low: float, high: float, unit: str) -> str:
    """The first of the values that is within bounds, as the end of a message."""
    within = [value for value in values if low < value < high]
    return f"; did you mean {within[0]:.4g} {unit}?" if within else ""


# Types of fields, which ``tca_mj.checks.Checked`` checks.
Length = Annotated[float, partial(size, kind="soft modules", at_most=2.0)]
Section = Annotated[float, partial(size, kind="sections of soft modules", at_most=0.1)]
Mass = Annotated[float, partial(size, kind="parts of soft robots", at_most=0.5, unit="kg")]
Modulus = Annotated[float, modulus]

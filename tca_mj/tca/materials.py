"""Where the numbers of a TCA come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from tca_mj.checks import Checked, quantity, row

Kind = Literal["weighed", "measured", "fitted", "published", "estimate"]


def _error(name: str, value: Any) -> float | tuple[float, ...]:
    """A standard error, or one for each number of a row; not negative."""
    check = row if isinstance(value, list | tuple) else quantity
    return check(name, value, at_least=0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Source(Checked):
    """Where a number comes from.

    Attributes:
        kind: ``weighed``, ``measured`` (by ruler, caliper, meter), ``fitted`` to data,
            ``published``, or an ``estimate``.
        error: Standard error, in the number's unit; of a row one for each of its numbers; None if
            it is not known.
        data: From what: files of data, a publication, or how.
    """

    kind: Kind
    error: Annotated[float | tuple[float, ...], _error] | None = None
    data: str = ""

"""Gaits as data: when each TCA of each leg is to be hot.

A leg is bent by TCAs round it, one after the other: heating them in turn lets its foot run round a
loop, as a rotating field turns a rotor. A gait says, for each TCA of a leg, where in the cycle it
is hot, and for each leg, how far it is behind. The thermostat computes the power for it: what the
heat loss takes, and what brings the TCA to its temperature within a response time. As it knows
the temperature, it heats late cycles no hotter than early ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    Positive,
    door,
    require_one_of,
    shown,
    within,
)

Row = tuple[float, ...]


def _rows(name: str, rows: Any) -> Any:
    """A row or several, as tuples."""
    value = within(name, rows)
    if value.ndim not in (1, 2) or not value.size:
        raise ValueError(f"{name} must be rows of finite numbers of one length, got {shown(rows)}")
    return tuple(value.tolist() if value.ndim == 1 else map(tuple, value.tolist()))


Rows = Annotated[Row | tuple[Row, ...], _rows]


@dataclass(frozen=True, kw_only=True, slots=True)
class Gait(Checked):
    """One cycle of all legs.

    ``start``, ``duty``, ``hot`` and ``warm`` are a row of one number for each TCA of a leg, which
    all legs share, or as many such rows as there are legs.

    Attributes:
        period: Duration of a cycle, positive [s].
        offset: Phase by which each leg is ahead, in cycles, one number per leg.
        start: Phase at which each TCA of a leg becomes hot, in cycles.
        duty: Share of the cycle during which it is hot, 0 to 1.
        hot: Temperature while hot [°C].
        warm: Temperature otherwise [°C].

    Raises:
        ValueError: If numbers are missing, not finite or out of range.
    """

    period: Positive
    offset: Row
    start: Rows
    duty: Rows
    hot: Rows
    warm: Rows

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        tcas = np.shape(self.start)[-1]
        for name in ("start", "duty", "hot", "warm"):
            value = np.array(getattr(self, name))
            if value.shape[-1] != tcas:
                raise ValueError(f"{name} must have {tcas} numbers per leg, got {value.shape[-1]}")
            if value.ndim == 2 and len(value) != self.legs:
                raise ValueError(f"{name} must have 1 or {self.legs} rows, got {len(value)}")
        within("duty", self.duty, at_least=0.0, at_most=1.0)
        if not (np.array(self.warm) <= np.array(self.hot)).all():
            raise ValueError(f"warm must be at most hot {self.hot}, got {self.warm}")

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.offset)

    @door
    def temperature(self, phase: ArrayLike) -> Array:
        """Temperatures to reach at a phase of the cycle.

        Args:
            phase: Time over period, any shape (...).

        Returns:
            Temperatures of all TCAs, leg by leg, shape (..., legs * TCAs per leg) [°C].
        """
        phase = within("phase", phase)[..., None, None]
        into = (phase + np.array(self.offset)[:, None] - np.array(self.start)) % 1.0
        target = np.where(into < np.array(self.duty), np.array(self.hot), np.array(self.warm))
        return target.reshape(*target.shape[:-2], self.legs * target.shape[-1])

    @door
    def table(self, name: str) -> Array:
        """``start``, ``duty``, ``hot`` or ``warm`` of every leg, shape (legs, TCAs per leg)."""
        require_one_of("name", name, ("start", "duty", "hot", "warm"))
        row = np.array(getattr(self, name))
        return np.broadcast_to(row, (self.legs, row.shape[-1])).copy()

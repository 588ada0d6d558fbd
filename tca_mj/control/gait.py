"""Gaits as data: when each TCA of each leg is to be hot; and the heater control that makes it so.

A leg is bent by TCAs round it, one after the other: heating them in turn lets its foot run round a
loop, as a rotating field turns a rotor. A gait says, for each TCA of a leg, where in the cycle it
is hot, and for each leg, how far it is behind. The thermostat computes the power for it: what the
heat loss takes, and what brings the TCA to its temperature within a response time. As it knows
the temperature, it heats late cycles no hotter than early ones.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.tca import HeatSpec

Array = NDArray[np.float64]
Row = tuple[float, ...]
Rows = Row | tuple[Row, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class Gait:
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

    period: float
    offset: Row
    start: Rows
    duty: Rows
    hot: Rows
    warm: Rows

    def __post_init__(self) -> None:
        if not 0.0 < self.period < math.inf:
            raise ValueError(f"period must be finite and above 0 s, got {self.period}")
        tcas = _table("start", self.start).shape[-1]
        for name in ("offset", "start", "duty", "hot", "warm"):
            value = _table(name, getattr(self, name))
            if name == "offset":
                if value.ndim != 1:
                    raise ValueError(f"offset must be a row of finite numbers, got {self.offset}")
            elif value.shape[-1] != tcas:
                raise ValueError(f"{name} must have {tcas} numbers per leg, got {value.shape[-1]}")
            elif value.ndim == 2 and len(value) != self.legs:
                raise ValueError(f"{name} must have 1 or {self.legs} rows, got {len(value)}")
        duty = np.array(self.duty)
        if not ((duty >= 0.0) & (duty <= 1.0)).all():
            raise ValueError(f"duty must be between 0 and 1, got {self.duty}")
        if not (np.array(self.warm) <= np.array(self.hot)).all():
            raise ValueError(f"warm must be at most hot {self.hot}, got {self.warm}")

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.offset)

    def temperature(self, phase: ArrayLike) -> Array:
        """Temperatures to reach at a phase of the cycle.

        Args:
            phase: Time over period, any shape (...).

        Returns:
            Temperatures of all TCAs, leg by leg, shape (..., legs * TCAs per leg) [°C].
        """
        phase = np.asarray(phase, dtype=np.float64)[..., None, None]
        into = (phase + np.array(self.offset)[:, None] - np.array(self.start)) % 1.0
        hot, warm = np.array(self.hot, dtype=np.float64), np.array(self.warm, dtype=np.float64)
        target = np.where(into < np.array(self.duty), hot, warm)
        return target.reshape(*target.shape[:-2], -1)

    def table(self, name: str) -> Array:
        """``start``, ``duty``, ``hot`` or ``warm`` of every leg, shape (legs, TCAs per leg)."""
        row = _table(name, getattr(self, name))
        return np.broadcast_to(row, (self.legs, row.shape[-1])).copy()


def _table(name: str, rows: Rows) -> Array:
    try:
        value = np.asarray(rows, dtype=np.float64)
    except (TypeError, ValueError):
        value = np.array(np.nan)
    if value.ndim not in (1, 2) or not value.size or not np.isfinite(value).all():
        raise ValueError(f"{name} must be rows of finite numbers of one length, got {rows}")
    return value


@dataclass(frozen=True, kw_only=True, slots=True)
class Thermostat:
    """Power that brings TCAs to a temperature: what keeps T* + C (T* - T)/τ, within limits.

    What keeps a bare TCA is λ (T* - T_amb); one in a soft body also warms that, G (T* - T_body).

    Attributes:
        heat: Thermal constants, arrays of shape (n,).
        max_power: Largest power of each TCA, shape (n,) or one number [W].
        response: Time τ in which an error would vanish [s].
        max_temperature: Limit of every target [°C].

    Raises:
        ValueError: If a number is not positive.
    """

    heat: HeatSpec
    max_power: float | Array
    response: float = 0.4
    max_temperature: float = 175.0

    def __post_init__(self) -> None:
        for name in ("max_power", "response", "max_temperature"):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if not (np.isfinite(value) & (value > 0.0)).all():
                raise ValueError(f"{name} must be finite and above 0, got {value}")

    def power(
        self, temperature: ArrayLike, target: ArrayLike, body: ArrayLike | None = None
    ) -> Array:
        """Power for TCAs at ``temperature`` that ought to be at ``target``, shape (..., n) [W].

        Args:
            temperature: Temperatures, shape (..., n) [°C].
            target: Wanted ones, same shape [°C].
            body: Temperatures of what they lie in, same shape; None if that is cold [°C].
        """
        goal = np.minimum(np.asarray(target, dtype=np.float64), self.max_temperature)
        error = goal - np.asarray(temperature, dtype=np.float64)
        steady = self.heat.keeping(goal, self.heat.ambient if body is None else body)
        return np.clip(steady + self.heat.capacity * error / self.response, 0.0, self.max_power)

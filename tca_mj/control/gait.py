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


@dataclass(frozen=True, kw_only=True, slots=True)
class Gait:
    """One cycle of all legs.

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
    offset: tuple[float, ...]
    start: tuple[float, ...]
    duty: tuple[float, ...]
    hot: tuple[float, ...]
    warm: tuple[float, ...]

    def __post_init__(self) -> None:
        if not 0.0 < self.period < math.inf:
            raise ValueError(f"period must be finite and above 0 s, got {self.period}")
        for name in ("offset", "start", "duty", "hot", "warm"):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.ndim != 1 or not len(value) or not np.isfinite(value).all():
                raise ValueError(f"{name} must be a row of finite numbers, got {value}")
            if name != "offset" and len(value) != len(self.start):
                raise ValueError(f"{name} must have {len(self.start)} numbers, got {len(value)}")
        if not all(0.0 <= duty <= 1.0 for duty in self.duty):
            raise ValueError(f"duty must be between 0 and 1, got {self.duty}")
        if not all(w <= h for w, h in zip(self.warm, self.hot, strict=True)):
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


@dataclass(frozen=True, kw_only=True, slots=True)
class Thermostat:
    """Power that brings TCAs to a temperature: λ (T* - T_amb) + C (T* - T)/τ, within limits.

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

    def power(self, temperature: ArrayLike, target: ArrayLike) -> Array:
        """Power for TCAs at ``temperature`` that ought to be at ``target``, shape (..., n) [W]."""
        goal = np.minimum(np.asarray(target, dtype=np.float64), self.max_temperature)
        error = goal - np.asarray(temperature, dtype=np.float64)
        steady = self.heat.loss * (goal - self.heat.ambient)
        return np.clip(steady + self.heat.capacity * error / self.response, 0.0, self.max_power)

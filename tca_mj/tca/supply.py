"""What a number for a TCA means: power, voltage, current, pulses, or a temperature to be held.

A supply has limits. Those of voltage U and current I act through the resistance R of the TCA, which
changes with its length and temperature: P <= U^2/R and P <= I^2 R. Pulses of the largest voltage
heat for their duty, the share of the time that they are on, as those of a motor driver do (Sun,
Section 2.3.2); they are much faster than any heat. A thermostat computes the power for a
temperature: what the heat loss takes, and what brings the TCA there within a response time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, Checked, Limits, Positives, every, some, within
from tca_mj.tca.arrays import ONE, ZERO, alone
from tca_mj.tca.thermal import HeatSpec, power_from_voltage

Quantity = Literal["power", "voltage", "current", "duty", "temperature"]
# A thermostat gives no power from so far above its limit on, and less over the last of it [K].
# Estimates: the TCAs of the tasks anneal 8 K above their limit, and where the heat loss is the
# nominal one they get no hotter than 1 K above it.
_CUT_OUT, _LETTING_GO = 5.0, 4.0
UNITS: dict[Quantity, str] = {
    "power": "W", "voltage": "V", "current": "A", "duty": "-", "temperature": "°C"
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class Thermostat(Checked):
    """Power that brings TCAs to a temperature: what keeps T* + C (T* - T)/τ, within limits.

    What keeps a bare TCA is λ (T* - T_amb); one in a soft body also warms that, G (T* - T_body).
    Where less heat is lost than this assumes, a TCA gets hotter than it ought to be. From 1 K above
    ``max_temperature`` on there is therefore less power, and from 5 K on none.

    Attributes:
        heat: Thermal constants, arrays of shape (n,).
        max_power: Largest power of each TCA, shape (n,) or one number [W].
        response: Time τ in which an error would vanish [s].
        max_temperature: Limit of every target [°C].

    Raises:
        ValueError: If a number is not positive.
    """

    heat: HeatSpec
    max_power: Positives
    response: Positives = 0.4
    max_temperature: Positives = 175.0

    def power(
        self, temperature: ArrayLike, target: ArrayLike, body: ArrayLike | None = None
    ) -> Array:
        """Power for TCAs at ``temperature`` that ought to be at ``target``, shape (..., n) [W].

        Args:
            temperature: Temperatures, shape (..., n) [°C].
            target: Wanted ones, same shape [°C].
            body: Temperatures of what they lie in, same shape; None if that is cold [°C].

        Raises:
            ValueError: If a temperature is not finite.
        """
        return self._power(
            within("temperature", temperature), within("target", target),
            self.heat.ambient if body is None else within("body", body),
        )  # fmt: skip

    def _power(self, temperature: Array, target: Array, body: float | Array) -> Array:
        heat = self.heat
        constants = self.max_power, heat.ambient, heat.loss, heat.conductance, heat.capacity
        now = alone(temperature, target, body, *constants)
        if now is None:
            power = self._limited(np.minimum, np.maximum, temperature, target, body, *constants)
        else:
            power = np.array([self._limited(min, max, *now)])
        if not some(temperature > self.max_temperature):  # the share is 1
            return power
        share = (self.max_temperature + _CUT_OUT - temperature) / _LETTING_GO
        return power * np.minimum(np.maximum(share, ZERO), ONE)

    def _limited(
        self, lesser: Callable[[Any, Any], Any], greater: Callable[[Any, Any], Any],
        temperature: Any, target: Any, body: Any, most: Any, ambient: Any, loss: Any,
        conductance: Any, capacity: Any,
    ) -> Any:  # fmt: skip
        goal = lesser(target, self.max_temperature)
        steady = loss * (goal - ambient) + conductance * (goal - body)
        power = steady + capacity * (goal - temperature) / self.response
        return lesser(greater(power, 0.0), most)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Supply(Checked):
    """How the TCAs of a simulation are driven.

    With ``duty`` the voltage is pulsed: ``max_voltage`` for that share of the time, 0 to 1, and
    ``max_current`` limits a pulse. With ``temperature`` a thermostat holds each TCA
    there, as often as the TCAs are updated. A temperature that is not above its idea of the
    surroundings' is off.

    Attributes:
        quantity: What is commanded, one of ``UNITS``.
        max_power: Largest power of each TCA, one number or shape (n,) [W].
        max_voltage: Largest voltage, of either sign [V].
        max_current: Largest current, of either sign [A].
        thermostat: What holds temperatures; needed for them, and for nothing else.

    Raises:
        ValueError: If the quantity is unknown, a limit is not above 0, or the thermostat, or the
            voltage of pulses, is missing.

    Example:
        >>> from tca_mj import Simulation, Supply, bending_module
        >>> sim = Simulation(bending_module(), supply=Supply(quantity="voltage", max_voltage=12.0))
        >>> sim.step([3.0, 0.0, 0.0], 0.5)  # [V]
        >>> sim.power.round(2)
        array([2.87, 0.  , 0.  ])
    """

    quantity: Quantity = "power"
    max_power: Limits = math.inf
    max_voltage: Limits = math.inf
    max_current: Limits = math.inf
    thermostat: Thermostat | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if (self.quantity == "temperature") != (self.thermostat is not None):
            raise ValueError(
                f"thermostat must be given for temperature and nothing else, got {self.thermostat}"
                f" for {self.quantity}"
            )
        if self.quantity == "duty":
            within("max_voltage, of the pulses,", self.max_voltage)

    def checked(self, command: ArrayLike, n: int) -> Array:
        """A command, shape (n,), in the unit of the quantity.

        Raises:
            ValueError: If the shape is another, or a number is not finite, a power negative, or a
                duty not 0 to 1.
        """
        quantity, unit = self.quantity, UNITS[self.quantity].strip("-")
        least = 0.0 if quantity in ("power", "duty") else -math.inf
        most = 1.0 if quantity == "duty" else math.inf
        return within(
            quantity, command, at_least=least, at_most=most, unit=unit, shape=(n,)
        ).copy()

    def power(
        self, command: Array, temperature: Array, body: Array, resistance: Callable[[], Array]
    ) -> Array:
        """Electrical power of the TCAs, shape (..., n) [W].

        Args:
            command: What is commanded, shape (..., n).
            temperature: Their temperatures, same shape [°C].
            body: Temperatures of what they lie in, same shape [°C].
            resistance: Gives their resistances, same shape, if it is asked to [ohm].

        Raises:
            ValueError: As ``resistance`` does.
        """
        quantity, power = self.quantity, command
        if quantity == "temperature":
            assert self.thermostat is not None
            held = self.thermostat._power(temperature, command, body)
            on = command > self.thermostat.heat.ambient
            power = held if every(on) else held * on
        volts, amperes = self.max_voltage, self.max_current
        free = type(volts) is type(amperes) is float and volts == amperes == math.inf
        if not free or quantity in ("voltage", "current"):
            ohms = resistance()
            if quantity == "voltage":
                power = power_from_voltage(command, ohms)
            elif quantity == "current":
                power = command**2 * ohms
            full = np.minimum(np.square(volts) / ohms, np.square(amperes) * ohms)
            power = command * full if quantity == "duty" else np.minimum(power, full)
        most = self.max_power
        return power if isinstance(most, float) and most == math.inf else np.minimum(power, most)

    def like(self, other: Supply) -> bool:
        """Whether another supply does the same."""
        return _equal(self, other)


def _equal(one: Any, other: Any) -> bool:
    """Whether two values are, number by number, the same; dataclasses by their fields."""
    if type(one) is type(other) and is_dataclass(one):
        return all(_equal(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return bool(np.array_equal(one, other))

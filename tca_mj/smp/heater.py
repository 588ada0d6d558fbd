"""Heater wire, still air and fan: the temperature of a shape-memory spine.

One temperature, as for a TCA: C dT/dt = V²/R - λ (T - T_amb), solved exactly. Sun, dissertation,
Colorado State University, Section 6.1.3: 25 V heats, 9.5 V holds; from there the spine cools to
80 °C in 25 s, and in 12 s in the air of a fan of 1 m/s.

What is fitted: the time constant in still air, C/λ, to the 25 s; R to 9.5 V holding the
temperature at which that cooling starts, which is an estimate. What follows: the fan's 12 s, by
the speed of its air, and the time to heat at 25 V, which needs neither C nor R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    Positive,
    Positives,
    door,
    flags,
    instance,
    number,
    numbers,
    within,
)
from tca_mj.smp.convection import Slab, Speed, moving_air, radiation, still_air
from tca_mj.smp.material import SpineSpec
from tca_mj.tca import HeatSpec, power_from_voltage
from tca_mj.tca.thermal import BareStep

HOLD_VOLTAGE = 9.5  # Sun, Section 6.1.3 [V]
COOL_TO = 80.0  # temperature at which both cooling times end, Sun, Section 6.1.3 [°C]
COOL_TIME = 25.0  # time to cool in still air, Sun, Section 6.1.3; fitted [s]
FAN_COOL_TIME = 12.0  # the same with the fan, Sun, Section 6.1.3; a check [s]
FAN_SPEED = 1.0  # speed of the fan's air, Sun, Section 6.1.3 [m/s]
# Temperature that 9.5 V holds, printed in a figure only [°C]. Estimate: 10 K into the soft range.
HOLD_TEMPERATURE = 120.0

Hot = Annotated[float, partial(number, above=COOL_TO, at_most=600.0, unit="°C")]
Cold = Annotated[float, partial(number, at_least=-100.0, below=COOL_TO, unit="°C")]


@dataclass(frozen=True, kw_only=True, slots=True)
class HeaterSpec(Checked):
    """Thermal and electrical constants of one spine, or of n spines as arrays of shape (n,).

    Attributes:
        capacity: Heat capacity C [J/K].
        loss: Heat lost to still air per excess temperature, λ [W/K].
        fan_gain: Factor of the loss while the fan blows, at least 1 [1].
        resistance: Resistance R of the heater wire [ohm].
        ambient: Temperature of the surroundings [°C].

    Raises:
        ValueError: If a number is out of range.
    """

    capacity: Positives
    loss: Positives
    fan_gain: Annotated[float | Array, partial(numbers, at_least=1.0)]
    resistance: Positives
    ambient: Annotated[float | Array, partial(numbers, above=-273.15, unit="°C")] = 25.0

    @classmethod
    @door
    def fitted(
        cls,
        spine: SpineSpec,
        *,
        hold_temperature: Hot = HOLD_TEMPERATURE,
        hold_voltage: Positive = HOLD_VOLTAGE,
        cool_time: Positive = COOL_TIME,
        fan_speed: Speed = FAN_SPEED,
        ambient: Cold = 25.0,
    ) -> HeaterSpec:
        """Constants from the natural cooling alone.

        The capacity, the polymer's own, scales powers and energies and no time.

        Args:
            spine: The spine, for its capacity and the fan's air round it.
            hold_temperature: Temperature at which cooling starts, above 80 °C [°C].
            hold_voltage: Voltage that holds it [V].
            cool_time: Time from there to 80 °C in still air [s].
            fan_speed: Speed of the fan's air [m/s].
            ambient: Temperature of the room [°C].

        Raises:
            ValueError: If a number is out of range.
        """
        excess = hold_temperature - ambient
        loss = spine.heat_capacity * math.log(excess / (COOL_TO - ambient)) / cool_time
        return cls(
            capacity=spine.heat_capacity, loss=loss,
            fan_gain=fan_gain(spine, fan_speed, hold_temperature, ambient),
            resistance=hold_voltage**2 / (loss * excess), ambient=ambient,
        )  # fmt: skip

    @classmethod
    @door
    def alike(cls, spine: SpineSpec) -> HeaterSpec:
        """Constants of a spine of another section than the published one.

        It loses as much heat per surface of polymer and excess temperature; so it cools in 25 s
        times the ratio of their sections over their perimeters. 9.5 V hold its temperature, too.

        Args:
            spine: The spine.
        """
        thick, published = (s.width * s.thickness / (s.width + s.thickness)
                            for s in (spine, SpineSpec()))  # fmt: skip
        return cls.fitted(spine, cool_time=COOL_TIME * thick / published)

    @door
    def heat(self, fan: ArrayLike = False) -> HeatSpec:
        """The heat balance with the fan on or off, shape (..., n)."""
        return HeatSpec(capacity=self.capacity, loss=self.losing(fan), ambient=self.ambient)

    def losing(self, fan: ArrayLike) -> Array:
        """Heat lost per excess temperature with the fan on or off, shape (..., n) [W/K]."""
        return np.where(flags("fan", fan), self.loss * self.fan_gain, self.loss)

    def power(self, voltage: ArrayLike) -> Array:
        """Power V²/R of the heater, shape (..., n) [W]."""
        return power_from_voltage(voltage, self.resistance)

    @door
    def settled(self, voltage: ArrayLike, fan: ArrayLike = False) -> Array:
        """Temperature that a voltage holds in the long run, shape (..., n) [°C]."""
        return self.ambient + self.power(voltage) / self.heat(fan).loss

    @door
    def time_to(
        self, target: ArrayLike, start: ArrayLike, voltage: ArrayLike = 0.0, fan: ArrayLike = False
    ) -> Array:
        """Time from one temperature to another at a constant voltage; inf if never [s].

        Args:
            target: Temperature to reach, shape (..., n) [°C].
            start: Temperature at the start, same shape [°C].
            voltage: Voltage of the heater, same shape [V].
            fan: Whether the fan blows, same shape.
        """
        settled, tau = self.settled(voltage, fan), np.asarray(self.heat(fan).time_constant)
        now = within("start", start) - settled
        now, then = np.broadcast_arrays(now, within("target", target) - settled)
        # From here the spine goes straight towards what the voltage holds, and never past it.
        ratio = np.divide(now, then, out=np.where(now == 0.0, 1.0, 0.0), where=then != 0.0)
        return np.where(ratio >= 1.0, tau * np.log(np.maximum(ratio, 1.0)), np.inf)


@dataclass(frozen=True, slots=True, eq=False)
class HeaterState:
    """State of n spines, each array of shape (..., n).

    Attributes:
        temperature: Temperature [°C].
        energy_in: Electrical energy taken in since the state of rest [J].
        energy_lost: Heat given to the air since then [J].
    """

    temperature: Array
    energy_in: Array
    energy_lost: Array

    @classmethod
    @door
    def rest(cls, spec: HeaterSpec, shape: tuple[int, ...] = ()) -> HeaterState:
        """At the temperature of the surroundings, no energy counted."""
        temperature = np.broadcast_to(spec.ambient, shape).copy()
        return cls(temperature, np.zeros(shape), np.zeros(shape))


def heat_spine(
    spec: HeaterSpec, state: HeaterState, voltage: ArrayLike, fan: ArrayLike, dt: float
) -> HeaterState:
    """Advances n spines by ``dt`` at constant voltage, exactly: any ``dt`` is stable.

    Args:
        spec: Constants, scalars or of shape (n,).
        state: State at the start, shape (..., n).
        voltage: Voltage of the heaters, shape (..., n) [V].
        fan: Whether the fan blows, shape (..., n).
        dt: Length of the step, not negative [s].

    Raises:
        ValueError: If a voltage is not finite, or ``dt`` negative.
    """
    instance("spec", spec, HeaterSpec)
    instance("state", state, HeaterState)
    number("dt", dt, at_least=0.0, unit="s")
    later = heated(BareStep.of(spec, spec.losing(fan), dt), state, spec.power(voltage), dt)
    if np.shape(later.temperature) != np.shape(state.temperature):
        raise ValueError(
            f"voltage and fan must fit the state's shape {np.shape(state.temperature)},"
            f" got {np.shape(voltage)} and {np.shape(fan)}"
        )
    return later


def heated(step: BareStep, state: HeaterState, power: Array, dt: float) -> HeaterState:
    """``heat_spine`` for powers [W]. Nothing is checked."""
    temperature, lost = step.advance(state.temperature, power)
    return HeaterState(temperature, state.energy_in + power * dt, state.energy_lost + lost)


@door
def fan_gain(spine: SpineSpec, speed: Speed, start: Hot, ambient: Cold) -> float:
    """How many times sooner the fan cools the spine from ``start`` to 80 °C.

    Air across a cylinder with the module's perimeter, still or at ``speed``, with radiation; all
    taken at the logarithmic mean of the spine's temperatures. Epoxy conducts badly (Bi about 0.3
    with the fan), so the times are those of the centre of a plate, where the thermistor is
    embedded; counting the air alone, the fan would be 1.10 times as good.

    Args:
        spine: The spine; its centre is ``thickness``/2 from its faces.
        speed: Speed of the air [m/s].
        start: Temperature at the start [°C].
        ambient: Temperature of the room [°C].

    Returns:
        Ratio of the two times, at least 1 [1].

    Raises:
        ValueError: If a number is out of range.
    """
    ratio = (start - ambient) / (COOL_TO - ambient)
    surface = ambient + (start - COOL_TO) / math.log(ratio)
    diameter = spine.equivalent_diameter
    natural = still_air(diameter, surface, ambient)
    # A breeze weaker than the buoyancy changes nothing.
    forced = max(natural, moving_air(diameter, speed, surface, ambient))
    radiated = radiation(surface, ambient)

    def time(convection: float) -> float:
        slab = Slab(
            thickness=spine.thickness, conductivity=spine.smp.conductivity,
            capacity=spine.smp.density * spine.smp.specific_heat, coefficient=convection + radiated,
        )  # fmt: skip
        return slab.centre_time(ratio)

    return time(natural) / time(forced)

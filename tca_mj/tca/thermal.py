"""Heat balance of a TCA: one temperature, Joule heat in, convection out, solved exactly."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.tca.arrays import floats


@dataclass(frozen=True, kw_only=True, slots=True)
class HeatSpec:
    """Lumped thermal constants of one TCA, or of n TCAs as arrays of shape (n,).

    Attributes:
        capacity: Heat capacity C of the whole actuator [J/K].
        loss: Heat-transfer coefficient times surface, λ [W/K].
        ambient: Temperature of the surroundings [°C].
    """

    capacity: float | NDArray[np.float64]
    loss: float | NDArray[np.float64]
    ambient: float | NDArray[np.float64] = 25.0

    def __post_init__(self) -> None:
        for name, low in (("capacity", 0.0), ("loss", 0.0), ("ambient", -273.15)):
            value = floats(name, getattr(self, name))
            if not np.all((value > low) & np.isfinite(value)):
                raise ValueError(f"{name} = {value} must be finite and above {low}")

    @property
    def time_constant(self) -> float | NDArray[np.float64]:
        """C/λ [s]."""
        return self.capacity / self.loss


def step_temperature(
    temperature: ArrayLike, power: ArrayLike, heat: HeatSpec, dt: float
) -> NDArray[np.float64]:
    """Advances the temperature by ``dt`` under constant power, exactly.

    Solves C dT/dt = P - λ (T - T_amb) [Sun, dissertation, Colorado State University, eq. (3.1);
    Yip & Niemeyer, IEEE T-RO 33(3), 2017] in closed form, so that any ``dt`` is stable and two
    half steps equal one whole step.

    Args:
        temperature: Temperature T at the start of the step, shape (..., n) [°C].
        power: Electrical power P, shape (..., n), not negative [W].
        heat: Thermal constants, scalars or of shape (n,).
        dt: Length of the step, not negative [s].

    Returns:
        Temperature at the end of the step, shape (..., n) [°C].

    Raises:
        ValueError: If a power is negative (a heater cannot cool), if ``dt`` is negative, or if
            any of the numbers is not finite.
    """
    temperature, power = _checked(temperature, power, dt)
    settled = heat.ambient + power / heat.loss
    return temperature - (settled - temperature) * np.expm1(-dt * heat.loss / heat.capacity)


def heat_lost(
    temperature: ArrayLike, power: ArrayLike, heat: HeatSpec, dt: float
) -> NDArray[np.float64]:
    """Heat given to the surroundings during a step, ∫ λ (T - T_amb) dt, exactly.

    This is the integral of the temperature's course in closed form and not the difference of
    energy in and energy stored, so that the balance of the three remains a check.

    Args:
        temperature: Temperature T at the start of the step, shape (..., n) [°C].
        power: Electrical power P during the step, shape (..., n), not negative [W].
        heat: Thermal constants, scalars or of shape (n,).
        dt: Length of the step, not negative [s].

    Returns:
        Heat lost, negative where the TCA is colder than its surroundings, shape (..., n) [J].

    Raises:
        ValueError: As ``step_temperature``.
    """
    temperature, power = _checked(temperature, power, dt)
    # The start's excess dies out, the power's builds up: T - T_amb = x e + (P/λ) (1 - e).
    died_out = -np.expm1(-dt * heat.loss / heat.capacity)
    of_start = heat.capacity * (temperature - heat.ambient) * died_out
    return of_start + power * (dt - heat.time_constant * died_out)


def power_from_voltage(voltage: ArrayLike, resistance: ArrayLike) -> NDArray[np.float64]:
    """Joule heat V^2/R of a voltage across a resistance, broadcast together.

    Args:
        voltage: Voltage of either sign [V].
        resistance: Resistance [ohm].

    Returns:
        Power [W].

    Raises:
        ValueError: If a voltage is not finite or a resistance not positive and finite.
    """
    voltage = floats("voltage", voltage)
    resistance = floats("resistance", resistance)
    if not np.isfinite(voltage).all():
        raise ValueError(f"voltage = {voltage} must be finite")
    if not ((resistance > 0.0) & (resistance < math.inf)).all():
        raise ValueError(f"resistance = {resistance} must be finite and above 0")
    with np.errstate(over="ignore"):
        power = voltage * voltage / resistance
    if not np.isfinite(power).all():
        raise ValueError(f"voltage = {voltage} V and resistance = {resistance} ohm give no power")
    return power


def _checked(
    temperature: ArrayLike, power: ArrayLike, dt: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    temperature = floats("temperature", temperature)
    power = floats("power", power)
    if not np.isfinite(temperature).all():
        raise ValueError(f"temperature = {temperature} must be finite")
    if not ((power >= 0.0) & (power < math.inf)).all():
        raise ValueError(f"power = {power} must be finite and not below 0: a heater cannot cool")
    if not 0.0 <= dt < math.inf:
        raise ValueError(f"dt = {dt} must be finite and not below 0")
    return temperature, power

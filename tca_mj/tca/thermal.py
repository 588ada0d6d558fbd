"""Heat balance of a TCA: Joule heat in, convection out, solved exactly.

A bare TCA has one temperature. One that lies in a soft body has two, its own and that of the body
round it: the heat of the TCA goes into the body, and the body's to the air.

    C dT/dt     = P - λ (T - T_amb) - G (T - T_body)
    C_b dT_b/dt = G (T - T_body) - λ_b (T_body - T_amb)

Without conductance G the TCA is alone, with an infinite one the two are a single body of capacity
C + C_b and loss λ + λ_b.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    NotNegatives,
    Positive,
    Positives,
    door,
    instance,
    number,
    numbers,
    within,
)
from tca_mj.tca.arrays import alone


@dataclass(frozen=True, kw_only=True, slots=True)
class HeatSpec(Checked):
    """Lumped thermal constants of one TCA, or of n TCAs as arrays of shape (n,).

    Attributes:
        capacity: Heat capacity C of the whole actuator [J/K].
        loss: Heat-transfer coefficient times surface, from the TCA straight to the air, λ [W/K];
            0 only for a TCA in a body.
        ambient: Temperature of the surroundings [°C].
        conductance: Between TCA and body, G; 0 for a bare TCA [W/K].
        body_capacity: Heat capacity C_b of the body; without conductance it has no meaning [J/K].
        body_loss: Heat-transfer coefficient times surface of the body, λ_b [W/K].

    Raises:
        ValueError: If a number is out of range, or heat cannot leave the TCA.
    """

    capacity: Positives
    loss: NotNegatives
    ambient: Annotated[float | Array, partial(numbers, above=-273.15, unit="°C")] = 25.0
    conductance: NotNegatives = 0.0
    body_capacity: Positives = 1.0
    body_loss: NotNegatives = 0.0

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        within("loss + conductance", np.add(self.loss, self.conductance), above=0.0)

    @property
    def time_constant(self) -> float | Array:
        """C/(λ + G): of the TCA, while the body keeps its temperature [s]."""
        return self.capacity / (self.loss + self.conductance)

    @property
    def steady_loss(self) -> float | Array:
        """Power per excess temperature in the steady state, λ + G λ_b/(G + λ_b) [W/K]."""
        series = np.asarray(self.conductance + self.body_loss)
        through = self.conductance * self.body_loss / np.where(series > 0.0, series, 1.0)
        return self.loss + through

    @door
    def losing(self, factor: ArrayLike) -> HeatSpec:
        """The same with another heat loss, that of the TCA, to its body and from there to the air.

        Args:
            factor: On each of them, above 0, broadcast with them [1].

        Raises:
            ValueError: If a factor is not above 0 and finite.
        """
        factor = within("factor", factor, above=0.0)
        return replace(
            self, loss=self.loss * factor, conductance=self.conductance * factor,
            body_loss=self.body_loss * factor,
        )  # fmt: skip

    @door
    def steady_body(self, temperature: ArrayLike) -> Array:
        """Temperature of the body once TCAs have been at ``temperature`` for long, (..., n) [°C].

        The body of a bare TCA has that of the surroundings, one without loss that of the TCA.

        Raises:
            ValueError: If a temperature is not finite.
        """
        series = np.asarray(self.conductance + self.body_loss)
        share = self.conductance / np.where(series > 0.0, series, 1.0)
        return self.ambient + share * (within("temperature", temperature) - self.ambient)

    def body_after(self, body: ArrayLike, temperature: ArrayLike, dt: float) -> Array:
        """Temperature of bodies after ``dt`` with their TCAs at ``temperature``, (..., n) [°C].

        Whoever sees the TCAs alone can so follow what they lie in. That of a bare TCA stays.

        Raises:
            ValueError: If a temperature is not finite, or ``dt`` negative or not finite.
        """
        series = np.asarray(self.conductance + self.body_loss)
        rate = np.where(np.asarray(self.conductance) > 0.0, series / self.body_capacity, 0.0)
        now, time = within("body", body), number("dt", dt, at_least=0.0, unit="s")
        return now - (self.steady_body(temperature) - now) * np.expm1(-rate * time)

    def keeping(self, temperature: ArrayLike, body: ArrayLike) -> Array:
        """Power that keeps TCAs at ``temperature`` while the body has ``body``, (..., n) [W].

        It is negative where the surroundings are hotter than the TCA.

        Raises:
            ValueError: If a temperature is not finite.
        """
        temperature = within("temperature", temperature)
        to_air = self.loss * (temperature - self.ambient)
        return to_air + self.conductance * (temperature - within("body", body))


@dataclass(frozen=True, kw_only=True, slots=True)
class BodyHeat(Checked):
    """The soft body round a TCA, per natural length of the TCA.

    Attributes:
        conductance: Between TCA and body, g [W/(m K)].
        capacity: Heat capacity of the body [J/(m K)].
        loss: Heat lost to the air per excess temperature of the body [W/(m K)].

    Raises:
        ValueError: If a number is not finite and positive.
    """

    conductance: Positive
    capacity: Positive
    loss: Positive


class HeatStep(NamedTuple):
    """What a step does to TCAs and their bodies: linear in temperatures and power, and exact.

    Attributes:
        heat: Thermal constants.
        dt: Length of the step [s].
        own, body_own: Change of an excess over the surroundings by itself, over that excess [1].
        given, taken: What the excess of TCA and body adds to that of the other, over it [1].
        warmed, body_warmed: Rise of TCA and body per power [K/W].
        lost, body_lost: Heat given to the air per excess of TCA and body at the start [J/K].
        passed: Heat given to the air per power [J/W].
    """

    heat: HeatSpec
    dt: float
    own: Array
    body_own: Array
    given: Array
    taken: Array
    warmed: Array
    body_warmed: Array
    lost: Array
    body_lost: Array
    passed: Array

    @classmethod
    def of(cls, heat: HeatSpec, dt: float) -> Self:
        """The step of length ``dt`` [s]: the matrix exponential of the two balances.

        Scaled by the roots of the capacities the balances are symmetric: two modes, a fast and a
        slow one, that decay with real rates. The slow rate is the determinant over the fast one,
        and no difference of nearly equal numbers is taken, however far apart the rates are.

        Raises:
            ValueError: If ``dt`` is negative or not finite.
        """
        number("dt", dt, at_least=0.0, unit="s")
        instance("heat", heat, HeatSpec)
        capacity, body = np.asarray(heat.capacity), np.asarray(heat.body_capacity)
        loss, out, through = heat.loss, heat.body_loss, heat.conductance
        first, second = (loss + through) / capacity, (out + through) / body
        coupling = through / np.sqrt(capacity * body)
        half = 0.5 * (first - second)
        root = np.hypot(half, coupling)
        fast = 0.5 * (first + second) + root
        product = (loss * out + through * (loss + out)) / (capacity * body)
        slow = product / np.where(fast > 0.0, fast, 1.0)
        # Shares of the fast mode in the TCA, of the slow one there, and what they exchange.
        safe = np.where(root > 0.0, root, 1.0)
        large = np.where(root > 0.0, 0.5 * (root + np.abs(half)) / safe, 1.0)
        small = 0.25 * coupling * coupling / (safe * safe * large)
        share = np.where(half >= 0.0, large, small)
        other = np.where(half >= 0.0, small, large)
        exchange = 0.5 * coupling / safe

        left = np.expm1(-fast * dt), np.expm1(-slow * dt)
        once = _integral(fast, dt), _integral(slow, dt)
        twofold = _second_integral(fast, dt), _second_integral(slow, dt)

        def matrix(f: tuple[Array, Array]) -> tuple[Array, Array, Array]:
            fast_one, slow_one = f
            return (
                share * fast_one + other * slow_one,
                exchange * (slow_one - fast_one) / np.sqrt(capacity * body),
                other * fast_one + share * slow_one,
            )

        own, mixed, body_own = matrix(left)
        held, swapped, stayed = matrix(once)
        rose, crossed, _ = matrix(twofold)
        return cls(
            heat=heat, dt=dt, own=own, body_own=body_own,
            given=capacity * mixed, taken=body * mixed, warmed=held / capacity, body_warmed=swapped,
            lost=loss * held + out * capacity * swapped,
            body_lost=loss * body * swapped + out * stayed,
            passed=loss * rose / capacity + out * crossed,
        )  # fmt: skip

    def advance(self, temperature: Array, body: Array, power: Array) -> tuple[Array, Array, Array]:
        """Temperatures of TCA and body at the end, shape (..., n) [°C]; heat lost meanwhile [J].

        The heat is the integral of the balances and not the difference of energy in and energy
        stored, so that the sum of the three remains a check. Nothing is checked here.
        """
        now = alone(temperature, body, power, self.heat.ambient, *self[2:])
        if now is None:
            return self._advanced(temperature, body, power, self.heat.ambient, *self[2:])
        later = self._advanced(*now)
        return np.array(later[:1]), np.array(later[1:2]), np.array(later[2:])

    @staticmethod
    def _advanced(
        temperature: Any, body: Any, power: Any, ambient: Any, own: Any, body_own: Any, given: Any,
        taken: Any, warmed: Any, body_warmed: Any, lost: Any, body_lost: Any, passed: Any,
    ) -> tuple[Any, Any, Any]:  # fmt: skip
        x, y = temperature - ambient, body - ambient
        # Changes, so that what is at rest stays there to the bit.
        hotter = own * x + taken * y + warmed * power
        warmer = body_own * y + given * x + body_warmed * power
        return temperature + hotter, body + warmer, lost * x + body_lost * y + passed * power


def _integral(rate: Array, dt: float) -> Array:
    """∫ exp(-rate t) dt from 0 to ``dt``."""
    safe = np.where(rate > 0.0, rate, 1.0)
    return np.where(rate > 0.0, -np.expm1(-safe * dt) / safe, dt)


def _second_integral(rate: Array, dt: float) -> Array:
    """The integral of that: (dt - ∫ exp(-rate t) dt)/rate, by its series where that is small."""
    z = rate * dt
    series = 0.5 - z / 6.0 * (1.0 - z / 4.0 * (1.0 - z / 5.0 * (1.0 - z / 6.0 * (1.0 - z / 7.0))))
    safe = np.where(rate > 0.0, rate, 1.0)
    return np.where(z < 5e-3, series * dt * dt, (dt - _integral(rate, dt)) / safe)


@door
def step_temperature(temperature: ArrayLike, power: ArrayLike, heat: HeatSpec, dt: float) -> Array:
    """Advances the temperature of what is bare by ``dt`` under constant power, exactly.

    Solves C dT/dt = P - λ (T - T_amb) [Sun, dissertation, Colorado State University, eq. (3.1);
    Yip & Niemeyer, IEEE T-RO 33(3), 2017] in closed form, so that any ``dt`` is stable and two
    half steps equal one whole step.

    Args:
        temperature: Temperature T at the start of the step, shape (..., n) [°C].
        power: Electrical power P, shape (..., n), not negative [W].
        heat: Thermal constants, scalars or of shape (n,), without a body.
        dt: Length of the step, not negative [s].

    Returns:
        Temperature at the end of the step, shape (..., n) [°C].

    Raises:
        ValueError: If a power is negative (a heater cannot cool), if ``dt`` is negative, if there
            is a body, or if any of the numbers is not finite.
    """
    return _bare(temperature, power, heat, dt)[0]


@door
def heat_lost(temperature: ArrayLike, power: ArrayLike, heat: HeatSpec, dt: float) -> Array:
    """Heat given to the surroundings during a step, ∫ λ (T - T_amb) dt, exactly.

    This is the integral of the temperature's course in closed form and not the difference of
    energy in and energy stored, so that the balance of the three remains a check.

    Args:
        temperature: Temperature T at the start of the step, shape (..., n) [°C].
        power: Electrical power P during the step, shape (..., n), not negative [W].
        heat: Thermal constants, scalars or of shape (n,), without a body.
        dt: Length of the step, not negative [s].

    Returns:
        Heat lost, negative where the TCA is colder than its surroundings, shape (..., n) [J].

    Raises:
        ValueError: As ``step_temperature``.
    """
    return _bare(temperature, power, heat, dt)[1]


class BareStep(NamedTuple):
    """What a step does to what is bare. Nothing is checked.

    Attributes:
        capacity, loss, ambient: As in ``HeatSpec``.
        built: Share of the way to the temperature that the power holds, 1 - exp(-λ dt/C) [1].
        passed: Heat given to the air per power [J/W].
    """

    capacity: float | Array
    loss: float | Array
    ambient: float | Array
    built: Array
    passed: Array

    @classmethod
    def of(cls, heat: Any, loss: float | Array, dt: float) -> Self:
        """The step of length ``dt`` [s] with capacity and surroundings of ``heat``."""
        built = -np.expm1(-dt * loss / heat.capacity)
        return cls(heat.capacity, loss, heat.ambient, built, dt - heat.capacity / loss * built)

    def advance(self, temperature: Array, power: Array) -> tuple[Array, Array]:
        """Temperature at the end [°C] and heat lost [J]."""
        now = alone(temperature, power, *self)
        if now is None:
            return self._advanced(temperature, power, *self)
        later = self._advanced(*now)
        return np.array(later[:1]), np.array(later[1:])

    @staticmethod
    def _advanced(
        temperature: Any, power: Any, capacity: Any, loss: Any, ambient: Any, built: Any,
        passed: Any,
    ) -> tuple[Any, Any]:  # fmt: skip
        # The start's excess dies out, the power's builds up: T - T_amb = x e + (P/λ) (1 - e).
        lost = capacity * (temperature - ambient) * built + power * passed
        settled = ambient + power / loss
        return temperature + (settled - temperature) * built, lost


def require_bare(heat: HeatSpec) -> None:
    """Refuses constants of TCAs that lie in a body.

    Raises:
        ValueError: If there is a conductance to a body.
    """
    within("conductance of a bare TCA", heat.conductance, at_most=0.0)


def power_from_voltage(voltage: ArrayLike, resistance: ArrayLike) -> Array:
    """Joule heat V^2/R of a voltage across a resistance, broadcast together.

    Args:
        voltage: Voltage of either sign [V].
        resistance: Resistance [ohm].

    Returns:
        Power [W].

    Raises:
        ValueError: If a voltage is not finite or a resistance not positive and finite.
    """
    voltage = within("voltage", voltage)
    resistance = within("resistance", resistance, above=0.0, unit="ohm")
    with np.errstate(over="ignore"):
        return within("voltage^2/resistance", voltage * voltage / resistance)


def _bare(
    temperature: ArrayLike, power: ArrayLike, heat: HeatSpec, dt: float
) -> tuple[Array, Array]:
    number("dt", dt, at_least=0.0, unit="s")
    require_bare(heat)
    power = within("power", power, at_least=0.0, unit="W")
    temperature = within("temperature", temperature)
    return BareStep.of(heat, heat.loss, dt).advance(temperature, power)

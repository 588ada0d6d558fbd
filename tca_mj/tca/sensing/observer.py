"""Temperature, length and tension of TCAs from their voltage and current alone: a Kalman filter.

Voltage over current is the resistance, which tells the length (``sensing.wire``); voltage times
current is the heat, which tells the temperature (``thermal``); and the law of tension, F(l, T),
tells what pulls at a TCA with this length and temperature. No load has to be known. An extended
Kalman filter weighs the three, with the state

    T     temperature        C dT/dt = P - (λ (T - T_amb) + G (T - T_b))/r + noise
    T_b   of the body        C_b dT_b/dt = (G (T - T_b) - λ_b (T_b - T_amb))/r
    l     length             F(l, T) + k l = load, and the load wanders
    r     nominal over true heat loss, constant or wandering; T is nearly linear in it
    m     mean of the load, where its bandwidth f is given

The load is a random walk, as nothing is known of it; or, with a bandwidth, it comes back to a mean
that nobody knows, d load/dt = 2 pi f (m - load) + noise, so that what is fast can be averaged away
and the heat behind it heard. Where a spring of stiffness k holds against the TCA, k may be given. A
length that heat alone changes is predicted so, and what a reading of the resistance says besides is
the load's. Heat is solved exactly, its derivative by r is a difference. The resistance has a kink
where the coils begin to touch, so that each reading is linearised anew where it leads to.

What cannot be told: the resistance does not know the temperature. While power and length stay as
they are, all (T, r) with λ (T - T_amb) = r P fit equally well, each with a tension of its own: a
TCA that loses less heat is hotter, and pulls at a heavier load. ``rank`` tells how many directions
of (T, l, r) a course of powers distinguishes. [Sun, dissertation, Colorado State University,
Section 2.3.2, controls by the resistance under constant weights, and names loads that vary as
future work in its last chapter.]
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    NotNegative,
    Numbers,
    Positive,
    Temperature,
    door,
    floats,
    number,
    within,
)
from tca_mj.tca.bank import TcaBank, TcaState
from tca_mj.tca.sensing import wire
from tca_mj.tca.thermal import HeatStep

_T, _BODY, _L, _R, _M = range(5)
_KELVIN, _METRE, _SHARE = 0.2, 1e-5, 1e-3  # of the differences
_LEAST, _MOST = 0.1, 10.0  # of r: an estimate, twice what ``Variation`` allows
_RELINEARISED = 4  # times; where the coils begin to touch the resistance has a kink
_NEWTON = 12  # steps to the first length: the resistance is nearly straight


@dataclass(frozen=True, kw_only=True, slots=True)
class ObserverSpec(Checked):
    """How far the model and the readings are trusted.

    Attributes:
        resistance_noise: Standard deviation of one reading of the resistance [ohm]. At one
            reading per ``dt`` its bandwidth is 1/(2 dt).
        current_noise: Of the current that it was read with, which adds R/I times this to it [A].
        tension_rate: How far the load wanders within a second: the standard deviation of a random
            walk. The default lets a weight of 20 g change by half of itself [N/s^0.5].
        temperature_rate: How far the temperature wanders from the heat balance, likewise: draught,
            and the error of the measured power; an estimate [K/s^0.5].
        loss_error: Standard deviation of the heat loss at the start, relative. With 0 and a
            ``loss_rate`` of 0 the nominal loss is believed [1].
        loss_rate: How far it wanders, relative [1/s^0.5].
        load_bandwidth: How fast the load comes back to its mean, which is not known and then is a
            state of its own: noise of first order, whose standard deviation is ``tension_rate`` /
            sqrt(4 pi bandwidth). With 0 it wanders, and comes back to nothing [Hz].
        mean_rate: How far that mean wanders, likewise [N/s^0.5].
        load_stiffness: Of a spring that holds against the TCA, 0 for a weight [N/m].
        start_error: Standard deviation of the temperature at the start [K].
    """

    resistance_noise: Positive = 10e-3
    current_noise: NotNegative = 0.0
    tension_rate: Positive = 0.1
    temperature_rate: NotNegative = 0.3
    loss_error: NotNegative = 0.0
    loss_rate: NotNegative = 0.0
    load_bandwidth: NotNegative = 0.0
    mean_rate: NotNegative = 0.0
    load_stiffness: NotNegative = 0.0
    start_error: NotNegative = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """What is believed of n TCAs.

    Attributes:
        mean: Temperature [°C], that of the body [°C], length [m], nominal over true heat loss [1]
            and, where the load has a bandwidth, its mean [N]: k = 4 or 5 rows, shape (k, ..., n).
        covariance: Of their errors, shape (k, k, ..., n) [products of those units].
    """

    mean: Array
    covariance: Array

    @property
    def temperature(self) -> Array:
        """Temperature, shape (..., n) [°C]."""
        return self.mean[_T]

    @property
    def body(self) -> Array:
        """Temperature of what they lie in, shape (..., n) [°C]."""
        return self.mean[_BODY]

    @property
    def length(self) -> Array:
        """Length, shape (..., n) [m]."""
        return self.mean[_L]

    @property
    def loss(self) -> Array:
        """Factor on the nominal heat loss, shape (..., n) [1]."""
        return 1.0 / self.mean[_R]

    @property
    def deviation(self) -> Array:
        """Standard deviations of ``mean``, same shape."""
        return np.sqrt(np.maximum(np.einsum("ii...->i...", self.covariance), 0.0))


class Sensed(NamedTuple):
    """Tension at an estimate, each of shape (..., n).

    Attributes:
        tension: Not clipped: negative where the coil would push [N].
        deviation: Its standard deviation [N].
    """

    tension: Array
    deviation: Array


class TcaObserver:
    """The filter for the n TCAs of a bank. Holds constants only: estimates go in and come out.

        observer = TcaObserver(TcaBank([tca], law="surface"), ObserverSpec())
        estimate = observer.begin(first_reading)
        for ...:
            estimate = observer.step(estimate, voltage, current, dt)
            print(estimate.length, observer.tension(estimate).tension)

    Attributes:
        bank: The TCAs: their law, their nominal heat and their resistance.
        spec: What is trusted.
    """

    @door
    def __init__(
        self, bank: TcaBank, spec: ObserverSpec | None = None, *,
        resistance: Callable[[Array, Array], Array] | None = None,
    ) -> None:  # fmt: skip
        """Takes the model.

        Args:
            bank: The TCAs; its heat is the nominal one.
            spec: What is trusted; None is the default.
            resistance: Resistance [ohm] over length [m] and temperature [°C], each (..., n); None
                is that of the bank, over the length alone.
        """
        self.bank, self.spec = bank, spec or ObserverSpec()
        self._resistance = resistance or partial(wire.resistance, wire.WireTable.of(bank.specs))
        self._adapts = self.spec.loss_error > 0.0 or self.spec.loss_rate > 0.0
        self._returns = 2.0 * np.pi * self.spec.load_bandwidth  # of the load to its mean [1/s]
        self._states = 5 if self._returns else 4

    @door
    def begin(
        self, resistance: Numbers, temperature: ArrayLike | None = None, *,
        steady_power: ArrayLike | None = None,
    ) -> Estimate:  # fmt: skip
        """What a first reading tells of TCAs that are as warm as their bodies, or at rest.

        Args:
            resistance: The reading, shape (..., n) [ohm].
            temperature: Of TCAs and bodies, broadcast with it; None is that of the surroundings
                [°C].
            steady_power: Under which they have come to rest, in place of a temperature. By how much
                they are then warmer than nominal is as uncertain as the heat loss, and tied to it
                [W].

        Raises:
            ValueError: If the last axis is not n, a number is not finite, a reading not above 0, a
                power negative, or both temperature and power are given.
        """
        ohms = self._sized("resistance", within("resistance", resistance, above=0.0))
        if steady_power is None:
            warm = self.bank.heat.ambient if temperature is None else temperature
            warm = _fitted("temperature", within("temperature", warm), ohms.shape)
            return self._begun(ohms, warm, warm, None)
        if temperature is not None:
            raise ValueError(
                "temperature must be None where steady_power tells it, got"
                f" {temperature} °C and {steady_power} W"
            )
        steady_power = _fitted("steady_power", floats("steady_power", steady_power), ohms.shape)
        warm = self.bank.heat.ambient + self._rise(steady_power)
        return self._begun(ohms, warm, self.bank.heat.steady_body(warm), steady_power)

    @door
    def step(
        self, estimate: Estimate, voltage: Numbers, current: Numbers, dt: Positive,
        duty: ArrayLike = 1.0,
    ) -> Estimate:  # fmt: skip
        """Goes on by ``dt`` under a power of voltage times current, and reads the two at its end.

        Args:
            estimate: What is believed before, shape (..., n).
            voltage: Measured voltage, of pulses while it is on, broadcast with it [V].
            current: Measured current then; without one there is no reading [A].
            dt: Time since the last step, above 0 [s].
            duty: Share of the time that pulses are on, 0 to 1.

        Raises:
            ValueError: If a number is not finite or out of range, or the two have other signs.
        """
        duty = within("duty", duty, at_least=0.0, at_most=1.0)
        product = within("voltage * current", voltage * current, at_least=0.0, unit="W")
        estimate = self.predicted(estimate, duty * product, dt)
        read = np.broadcast_to((current != 0.0) & (voltage != 0.0), estimate.length.shape)
        flowing = np.where(read, current, 1.0)
        ohms = np.where(read, voltage / flowing, np.nan)
        more = np.where(read, self.spec.current_noise * ohms / flowing, 0.0)
        return self.corrected(estimate, ohms, np.hypot(self.spec.resistance_noise, more))

    @door
    def predicted(self, estimate: Estimate, power: ArrayLike, dt: Positive) -> Estimate:
        """What is believed ``dt`` later, without a reading.

        Args:
            estimate: What is believed before, shape (..., n).
            power: Mean electrical power meanwhile, broadcast with it, not negative [W].
            dt: Time, above 0 [s].

        Raises:
            ValueError: If a number is not finite or out of range.
        """
        power = within("power", power, at_least=0.0, unit="W")
        power, spec = _fitted("power", power, estimate.mean.shape[1:]), self.spec
        mean, jacobian, heated, give = self._moved(estimate.mean, power, dt)
        covariance = np.einsum("ij...,jk...,lk...->il...", jacobian, estimate.covariance, jacobian)
        covariance += spec.temperature_rate**2 * dt * heated[:, None] * heated
        covariance[_L, _L] += np.square(give) * self._stirred(dt)
        covariance[_R, _R] += spec.loss_rate**2 * dt
        if self._returns:
            covariance[_M, _M] += spec.mean_rate**2 * dt
        return Estimate(mean, covariance)

    @door
    def corrected(
        self, estimate: Estimate, resistance: ArrayLike, deviation: ArrayLike | None = None
    ) -> Estimate:
        """What is believed after a reading.

        Args:
            estimate: What is believed before, shape (..., n).
            resistance: Reading, broadcast with it; NaN where there is none [ohm].
            deviation: Its standard deviation; None is ``ObserverSpec.resistance_noise`` [ohm].

        Raises:
            ValueError: If a reading is no number, or a deviation not above 0.
        """
        noise = within(
            "deviation", self.spec.resistance_noise if deviation is None else deviation, above=0.0
        )
        ohms = floats("resistance", resistance)
        there = np.isfinite(ohms) & (ohms > 0.0)
        ohms, before = np.where(there, ohms, 1.0), estimate.mean
        share = np.where(there, 1.0, 0.0)
        mean, best, least = before, before, np.full(before.shape[1:], np.inf)
        for _ in range(_RELINEARISED):
            gain, spread, missing = self._gain(estimate, mean, ohms, noise)
            mean = before + share * gain * missing
            mean[_L] = self._inside(mean[_L])
            off = ohms - self._read(mean[_L], mean[_T])[0]
            cost = missing**2 * (spread - noise**2) / spread**2 + np.square(off / noise)
            best = np.where(cost < least, mean, best)
            least = np.minimum(cost, least)
        gain, spread, _ = self._gain(estimate, best, ohms, noise)
        gain = share * gain
        mean = best.copy()
        mean[_R] = np.clip(mean[_R], _LEAST, _MOST)
        return Estimate(mean, estimate.covariance - gain[:, None] * gain * spread)

    def _gain(
        self, estimate: Estimate, mean: Array, ohms: Array, noise: Array
    ) -> tuple[Array, Array, Array]:
        """The gain of a reading linearised about ``mean``, the variance of what it misses, that."""
        expected, by_length, by_heat = self._read(mean[_L], mean[_T])
        slopes = np.zeros_like(mean)
        slopes[_L], slopes[_T] = by_length, by_heat
        shared = np.einsum("ij...,j...->i...", estimate.covariance, slopes)
        spread = np.einsum("i...,i...->...", slopes, shared) + np.square(noise)
        missing = ohms - expected - np.einsum("i...,i...->...", slopes, estimate.mean - mean)
        return shared / spread, spread, missing

    @door
    def expected(self, estimate: Estimate) -> Array:
        """Resistance at an estimate, shape (..., n) [ohm]."""
        return self._read(estimate.length, estimate.temperature)[0]

    @door
    def tension(self, estimate: Estimate) -> Sensed:
        """Tension at the believed length and temperature, and how sure it is, shape (..., n)."""
        force, slope, by_heat = self._law(estimate.length, estimate.temperature)
        slopes = np.zeros_like(estimate.mean)
        slopes[_L], slopes[_T] = slope, by_heat
        spread = np.einsum("i...,ij...,j...->...", slopes, estimate.covariance, slopes)
        return Sensed(force, np.sqrt(np.maximum(spread, 0.0)))

    @door
    def bound(
        self, truth: Numbers, power: Numbers, dt: Positive, *,
        steady_power: ArrayLike | None = None,
    ) -> Array:  # fmt: skip
        """Standard deviations that no observer can beat along a course: the Cramer-Rao bound.

        It is the inverse of Fisher's information, with that of the start and of the random walks
        in it, of the system linearised about its true course: the filter's own covariance, were it
        told the truth after each step.

        Args:
            truth: States as those of ``Estimate.mean``, shape (k + 1, 4 or 5, ..., n).
            power: Mean power between two of them, shape (k, ..., n) [W].
            dt: Time between two of them [s].
            steady_power: Under which they had come to rest before, as for ``begin``; None where
                the first temperature is known [W].

        Returns:
            Of temperature, length, and tension, shape (3, k, ..., n) [K, m, N].

        Raises:
            ValueError: If shapes differ or a number is not finite.
        """
        runs = (len(truth) - 1, *truth.shape[2:]) if truth.ndim > 2 else None
        if runs is None or truth.shape[1] != self._states or power.shape != runs:
            raise ValueError(
                f"truth must have shape (k + 1, {self._states}, ..., n) and power (k, ..., n), got"
                f" {truth.shape} and {power.shape}"
            )
        ohms = self._read(truth[:, _L], truth[:, _T])[0]
        estimate = self._begun(ohms[0], truth[0, _T], truth[0, _BODY], steady_power)
        estimate = replace(estimate, mean=truth[0])
        rows = []
        for state, now, reading in zip(truth[1:], power, ohms[1:], strict=True):
            estimate = replace(self.predicted(estimate, now, dt), mean=state)
            estimate = self.corrected(estimate, reading)
            deviation = estimate.deviation
            rows.append([deviation[_T], deviation[_L], self.tension(estimate).deviation])
        return np.swapaxes(np.array(rows), 0, 1)

    @door
    def rank(self, temperature: Temperature, load: float, powers: Numbers, dt: Positive) -> int:
        """How many directions of (T, l, r) the resistance tells along a course of powers.

        The rank of the observability matrix of the first TCA, bare and under a constant load,
        linearised along its course: 3 is all of it, 2 leaves heat and load mixed. Singular values
        below a millionth of the largest count as none, with kelvins, millimetres and per cent.

        Args:
            temperature: At the start [°C].
            load: Constant pull at it [N].
            powers: Powers one after the other, shape (k,) [W].
            dt: Time of each [s].

        Raises:
            ValueError: If a number is out of range.
        """
        warm = np.full(self.bank.n, temperature)
        length = self.under_load(warm, np.full(self.bank.n, number("load", load)))
        mean = np.stack([warm, self.bank.heat.steady_body(warm), length, np.ones_like(warm)])
        model = TcaObserver(
            self.bank, replace(self.spec, loss_error=1.0, load_bandwidth=0.0),
            resistance=self._resistance,
        )
        moved, rows = np.eye(4), []
        for power in within("powers", powers.ravel(), at_least=0.0, unit="W"):
            _, by_length, by_heat = self._read(mean[_L], mean[_T])
            rows.append(np.array([by_heat[0], 0.0, by_length[0], 0.0]) @ moved)
            mean, jacobian, _, _ = model._moved(mean, power, dt)
            moved = jacobian[:, :, 0] @ moved
        kelvin_millimetre_percent = np.array(rows)[:, [_T, _L, _R]] * [1.0, 1e-3, 1e-2]
        shares = np.linalg.svd(kelvin_millimetre_percent, compute_uv=False)
        return int(np.count_nonzero(shares > 1e-6 * shares[0]))

    @door
    def under_load(self, temperature: Numbers, load: Numbers) -> Array:
        """Length at which TCAs carry a load, or the law's end if none of them does.

        Args:
            temperature: Temperature, shape (..., n) [°C].
            load: Load, broadcast with it [N].

        Returns:
            Length, the shape of ``temperature`` [m].

        Raises:
            ValueError: If the last axis is not n, or a number not finite.
        """
        self._sized("temperature", temperature)
        load = _fitted("load", load, temperature.shape)
        length = np.broadcast_to(self.bank.rest_length, temperature.shape)
        for _ in range(_NEWTON):
            force, slope = self._pull(length, temperature)
            length = self._inside(length + (load - force) / slope)
        return length

    def _rise(self, power: ArrayLike) -> Array:
        """By how much TCAs are warmer than the surroundings once they rest under a power [K]."""
        power = within("steady_power", power, at_least=0.0, unit="W")
        return np.asarray(power / self.bank.heat.steady_loss)

    def _begun(self, ohms: Array, warm: Array, body: Array, power: ArrayLike | None) -> Estimate:
        """What a reading leaves open of TCAs and bodies that are believed as warm."""
        length = np.broadcast_to(self.bank.rest_length, ohms.shape)
        for _ in range(_NEWTON):
            now, slope, _ = self._read(length, warm)
            length = self._inside(length + (ohms - now) / slope)
        _, slope, by_heat = self._read(length, warm)

        # What the state is off by, over what is off by itself: T, T_b, the reading, r and the load.
        spec, ones = self.spec, np.ones(ohms.shape)
        error = np.zeros((self._states, self._states, *ohms.shape))
        embedded = np.where(self.bank.embedded, 1.0, 0.0)
        error[_T, _T], error[_BODY, _BODY] = spec.start_error * ones, spec.start_error * embedded
        error[_R, _R] = spec.loss_error * ones
        if power is not None:  # at rest T - T_amb is P r over the nominal loss, and T_b follows
            heat, rise = self.bank.heat, self._rise(power)
            error[_T, _R] = spec.loss_error * rise
            error[_BODY, _R] = spec.loss_error * (heat.steady_body(heat.ambient + rise)
                                                  - heat.ambient)  # fmt: skip
        error[_L] = -by_heat / slope * error[_T]
        error[_L, _L] = spec.resistance_noise / slope
        mean = np.stack([warm, body, length, ones])
        if self._returns:
            force, stiffness, warmed = self._law(length, warm)
            error[_M] = (stiffness + spec.load_stiffness) * error[_L] + warmed * error[_T]
            error[_M, _M] = spec.tension_rate / np.sqrt(2.0 * self._returns)
            mean = np.concatenate([mean, (force + spec.load_stiffness * length)[None]])
        return Estimate(mean, np.einsum("ij...,kj...->ik...", error, error))

    def _moved(self, mean: Array, power: Array, dt: float) -> tuple[Array, Array, Array, Array]:
        """The state ``dt`` later, its derivatives by the state before, what a kelvin too much does
        to it, and how much the length gives to the load [m/N]."""
        (warm, body, length, ratio), held = mean[:_M], self.spec.load_stiffness
        power = np.broadcast_to(power, warm.shape)
        heat, jacobian = self.bank.heat, np.zeros((len(mean), *mean.shape))
        if self._adapts:
            ends = []
            for shift in (-_SHARE, _SHARE):
                step = HeatStep.of(heat.losing(1.0 / (ratio + shift)), dt)
                ends.append(np.stack(step.advance(warm, body, power)[:2]))
            jacobian[: _BODY + 1, _R] = (ends[1] - ends[0]) / (2.0 * _SHARE)
            heat = heat.losing(1.0 / ratio)
        step = HeatStep.of(heat, dt)
        after, after_body, _ = step.advance(warm, body, power)
        jacobian[_T, _T], jacobian[_T, _BODY] = 1.0 + step.own, step.taken
        jacobian[_BODY, _T], jacobian[_BODY, _BODY] = step.given, 1.0 + step.body_own
        jacobian[_R, _R] = 1.0

        # The load stays: F(l1, T1) + k l1 = F(l, T) + k l; or it comes back to its mean by a share.
        # Two steps of Newton, and its slopes.
        force, slope, by_heat = self._law(length, warm)
        target, later, stays = force + held * length, length, 1.0
        if self._returns:
            stays = float(np.exp(-self._returns * dt))
            target = stays * target + (1.0 - stays) * mean[_M]
        for _ in range(2):
            now, rise = self._pull(later, after)
            later = self._inside(later + (target - now - held * later) / (rise + held))
        _, rise, later_by_heat = self._law(later, after)
        give = 1.0 / (rise + held)
        jacobian[_L] = -later_by_heat * give * jacobian[_T]
        jacobian[_L, _T] += stays * by_heat * give
        jacobian[_L, _L] += stays * (slope + held) * give
        if self._returns:
            jacobian[_L, _M], jacobian[_M, _M] = (1.0 - stays) * give, 1.0
        heated = np.zeros_like(mean)
        heated[_T], heated[_L] = 1.0, -later_by_heat * give
        moved = np.stack([after, after_body, later, ratio, *mean[_M:]])
        return moved, jacobian, heated, give

    def _stirred(self, dt: float) -> float:
        """Variance that the load gains in ``dt`` [N²]."""
        rate, fast = self.spec.tension_rate, 2.0 * self._returns
        return rate**2 * (-float(np.expm1(-fast * dt)) / fast if fast else dt)

    def _pull(self, length: Array, temperature: Array) -> tuple[Array, Array]:
        """Tension [N] and its slope over length [N/m]."""
        state = TcaState(temperature, temperature, temperature, temperature)  # of no energy
        force, slope, _ = self.bank.pull(state, length)
        return force, slope

    def _law(self, length: Array, temperature: Array) -> tuple[Array, Array, Array]:
        """Tension [N] and its slopes over length [N/m] and temperature [N/K]."""
        at = np.stack([temperature, temperature - _KELVIN, temperature + _KELVIN])
        force, slope = self._pull(np.broadcast_to(length, at.shape), at)
        return force[0], slope[0], (force[2] - force[1]) / (2.0 * _KELVIN)

    def _read(self, length: Array, temperature: Array) -> tuple[Array, Array, Array]:
        """Resistance [ohm] and its slopes over length [ohm/m] and temperature [ohm/K]."""
        near = [length, length - _METRE, length + _METRE, length, length]
        warm = [temperature] * 3 + [temperature - _KELVIN, temperature + _KELVIN]
        ohms = self._resistance(np.stack(near), np.stack(warm))
        by_length = (ohms[2] - ohms[1]) / (2.0 * _METRE)
        return ohms[0], by_length, (ohms[4] - ohms[3]) / (2.0 * _KELVIN)

    def _inside(self, length: Array) -> Array:
        """Lengths [m] within what the law holds for, and the differences, too."""
        least, most = self.bank.shortest + 2.0 * _METRE, self.bank.longest - 2.0 * _METRE
        return np.minimum(np.maximum(length, least), most)

    def _sized(self, name: str, values: Array) -> Array:
        if values.shape[-1:] != (self.bank.n,):
            raise ValueError(f"{name} must have shape (..., {self.bank.n}), got {values.shape}")
        return values


def _fitted(name: str, values: Array, shape: tuple[int, ...]) -> Array:
    """Values as an array of a shape."""
    try:
        return np.broadcast_to(values, shape)
    except ValueError as error:
        raise ValueError(f"{name} must fit the shape {shape}, got {np.shape(values)}") from error

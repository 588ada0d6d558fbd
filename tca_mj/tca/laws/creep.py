"""Creep, temporary length, hysteresis and ageing of TCAs: a small state, off unless asked for.

A loaded TCA stretches at once and then creeps, for some 20 hours when cold and within seconds
when hot; unloaded, it keeps a temporary length that recovers at the same rates [Sun, dissertation,
Colorado State University, Section 2.2.2]. Here the natural length has one slow part, ``shift``:

    d shift/dt = (settled(F) - shift)/tau(T)       tau = tau_room exp(A (1/T - 1/T_room)), T in K
    settled    = l_t S e/(e + h)                   e = max(F, 0)/(K l_t)

with K the cold stiffness at rest, l_t the fibre's length, and so e the elastic stretch per fibre
length. A step is exact for constant tension and temperature, for any dt. The law of tension is
that of the coil with the crept natural length; it keeps its turns and its contact length:

    creep, state = CreepBank([tca]), CreepBank([tca]).rest()
    for ...:
        state = creep.step(state, tension, temperature, dt)
        tension, _ = CoilRods(creep.crept(state)).tension(length, temperature)

``TcaBank(specs, creep=CreepSpec())`` and ``Simulation(part, creep=CreepSpec())`` do that with it.
One relaxation time stands for what in nylon are many: the model has the order of the reported
lengths and the two time scales, and not the shape of the curve between them. In it a steady
weight gives no hysteresis, as its shift is steady, too; that is ``hysteresis_damping``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    NotNegative,
    Positive,
    Temperature,
    Temperatures,
    door,
    floats,
    number,
    whole,
    within,
)
from tca_mj.tca.arrays import column
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.spec import TcaSpec

_KELVIN = 273.15


@dataclass(frozen=True, kw_only=True, slots=True)
class CreepSpec(Checked):
    """Constants of creep, hysteresis and ageing.

    Attributes:
        saturation: Largest shift S of the natural length over the fibre's [1]. This and
            ``half_stretch`` are fitted to the pitches of the crept free-stroke TCA, 20° at 30 g
            and 22° at 60 g (15° without load), in the code published with Sun et al.,
            github.com/jiefengsun/TCA-TRO; at 2 g they give 15.6° where that has 16°.
        half_stretch: Elastic stretch h over the fibre's length that gives half of it [1].
        room_temperature: Temperature of ``room_time`` [°C].
        room_time: Relaxation time there, fitted to "20 hours": 95 % are done in three times it [s].
        activation: Slope A of its logarithm over 1/T, fitted to 1 s at 150 °C, an estimate that
            stands for "seconds when hot"; 85 kJ/mol [K].
        lag: Time by which a stroke lags behind its temperature; an estimate [s].
        ageing_loss: Share of the stroke lost after ``ageing_cycles``, fitted to Sun, Fig. 2.8.
        ageing_cycles: Number of cycles there (0.25 Hz, 2 MPa).
        ageing_onset: Number of cycles from which on the loss grows with their logarithm; an
            estimate.
    """

    saturation: NotNegative = 0.1903
    half_stretch: Positive = 0.1036
    room_temperature: Temperature = 25.0
    room_time: Positive = 24e3
    activation: NotNegative = 10180.0
    lag: NotNegative = 0.05
    ageing_loss: Annotated[float, partial(number, at_least=0.0, below=1.0)] = 0.02
    ageing_cycles: Positive = 10e3
    ageing_onset: Positive = 100.0


@dataclass(frozen=True, slots=True, eq=False)
class CreepState:
    """State of n TCAs.

    Attributes:
        shift: What the natural lengths have grown by, shape (..., n) [m].
    """

    shift: Array


class CreepBank:
    """Creep of n TCAs. Holds constants only: the state goes in and comes out.

    Attributes:
        specs: The n TCAs at their natural lengths.
        creep: Constants of creep.
        n: Number of TCAs.
    """

    @door
    def __init__(self, specs: Sequence[TcaSpec], creep: CreepSpec | None = None) -> None:
        """Gathers the constants.

        Args:
            specs: The n TCAs at their natural lengths.
            creep: Constants, by default those of ``CreepSpec``.

        Raises:
            ValueError: If ``specs`` is empty, or creep would leave no helix of a TCA.
        """
        self.specs = tuple(specs)
        self.creep = creep or CreepSpec()
        rods = CoilRods(self.specs)
        self.n, self._stiffness = rods.n, rods.rest_stiffness
        for tca in self.specs:  # beyond the bound a TCA would be a straight fibre
            number("saturation", self.creep.saturation, below=1.0 - math.sin(tca.pitch_angle))
        self._rest = column(self.specs, "rest_length")
        self._fibre_length = column(self.specs, "fibre_length")

    @door
    def rest(self, batch_shape: tuple[int, ...] = ()) -> CreepState:
        """The state after training: natural lengths, shape batch_shape + (n,)."""
        return CreepState(np.zeros((*batch_shape, self.n)))

    @door
    def fresh(self, length: ArrayLike) -> CreepState:
        """The state of unloaded TCAs that have a temporary length, as right after fabrication.

        Args:
            length: That length, between the natural and the fibre's, shape (..., n) [m].

        Raises:
            ValueError: If it is not.
        """
        length = floats("length", length)
        if not ((length >= self._rest) & (length < self._fibre_length)).all():
            raise ValueError(
                f"length must be from {self._rest} to below {self._fibre_length} m, got {length}"
            )
        return CreepState(length - self._rest)

    @door
    def settled(self, tension: ArrayLike) -> Array:
        """Shift after a long time under a tension, shape (..., n) [N] -> [m].

        Raises:
            ValueError: If a tension is not finite.
        """
        pull = np.maximum(within("tension", tension), 0.0)
        stretch = pull / (self._stiffness * self._fibre_length)
        share = stretch / (stretch + self.creep.half_stretch)
        return self._fibre_length * self.creep.saturation * share

    @door
    def step(
        self, state: CreepState, tension: ArrayLike, temperature: ArrayLike, dt: float
    ) -> CreepState:
        """Advances by ``dt`` at constant tension and temperature, exactly.

        Args:
            state: State at the start, shape (..., n).
            tension: Tension, negative where the coil is pushed, which counts as none; a shape
                that broadcasts with the state's [N].
            temperature: Temperature, a shape that broadcasts with the state's [°C].
            dt: Length of the step, not negative, any size [s].

        Returns:
            State at the end.

        Raises:
            ValueError: If a number is not finite, ``dt`` is negative, or a temperature is not
                above absolute zero.
        """
        number("dt", dt, at_least=0.0, unit="s")
        settled = self.settled(tension)
        done = -np.expm1(-dt / relaxation_time(temperature, self.creep))
        return CreepState(state.shift + done * (settled - state.shift))

    @door
    def cycle(
        self,
        state: CreepState,
        tension: ArrayLike,
        *,
        cycles: Annotated[int, partial(whole, at_least=0, at_most=100_000)] = 1,
        hot: Temperatures = 150.0,
        hot_time: NotNegative = 4.0,
        cold: Temperatures = 25.0,
        cold_time: NotNegative = 100.0,
    ) -> CreepState:
        """Heating cycles: ``hot_time`` hot, then ``cold_time`` cold, at one tension.

        A TCA is trained by 10 of them without load (Sun, Section 2.2.2), and one of them brings it
        near the equilibrium under a new load. The times hot and cold are estimates, except for
        the 100 s. Arguments and errors otherwise as ``step``; ``cycles`` are at most 100 000, ten
        times those of the published ageing.
        """
        for _ in range(cycles):
            state = self.step(state, tension, hot, hot_time)
            state = self.step(state, tension, cold, cold_time)
        return state

    def law(self, rods: CoilRods, shift: Array) -> CoilRods:
        """The law of these TCAs at shifts of their natural lengths, (..., n) [m]; unchecked."""
        return rods.crept((self._rest + shift) / self._fibre_length)

    @door
    def crept(self, state: CreepState) -> tuple[TcaSpec, ...]:
        """The TCAs with their crept natural lengths, turns and contact lengths kept.

        Args:
            state: State of shape (n,).

        Raises:
            ValueError: If it has another shape, or is not one that this bank leads to.
        """
        shift = within("shift", state.shift, shape=(self.n,))
        sine = (self._rest + shift) / self._fibre_length
        within("sine of the crept helix", sine, above=0.0, below=1.0)
        return tuple(
            tca if by == 0.0 else tca.of_pitch(math.asin(sin))
            for tca, by, sin in zip(self.specs, shift, sine, strict=True)
        )


@door
def relaxation_time(temperature: ArrayLike, creep: CreepSpec) -> Array:
    """Time constant of creep and of recovery, Arrhenius' law.

    Args:
        temperature: Temperature, any shape [°C].
        creep: Constants of creep.

    Returns:
        Time constant, same shape [s].

    Raises:
        ValueError: If a temperature is not finite and above absolute zero.
    """
    kelvin = within("temperature", temperature, above=-_KELVIN, unit="°C") + _KELVIN
    # Below some 15 K the time is infinite in 64 bits, and nothing creeps.
    with np.errstate(over="ignore"):
        exponent = creep.activation * (1.0 / kelvin - 1.0 / (creep.room_temperature + _KELVIN))
        return creep.room_time * np.exp(exponent)


@door
def hysteresis_damping(tca: TcaSpec, creep: CreepSpec) -> float:
    """Damping b that makes a stroke lag: ``creep.lag`` times the cold stiffness [N s/m].

    As ``Load.damping`` it turns stroke over temperature into a loop. A harmonic stroke of
    amplitude a and angular frequency w takes the work pi b w a^2 per cycle.

    Args:
        tca: The TCA.
        creep: Constants, of which ``lag`` is used.
    """
    return creep.lag * float(CoilRods([tca]).rest_stiffness[0])


@door
def aged(tca: TcaSpec, cycles: float, creep: CreepSpec) -> TcaSpec:
    """The TCA after a number of cycles: it untwists less.

    The share lost is ageing_loss ln(1 + n/onset)/ln(1 + ageing_cycles/onset).

    Args:
        tca: The TCA when new.
        cycles: Number n of heating cycles, not negative [1].
        creep: Constants of ageing.

    Returns:
        The TCA with its ``fibre.untwist_scale`` reduced.

    Raises:
        ValueError: If ``cycles`` is negative or so large that no untwist is left.
    """
    number("cycles", cycles, at_least=0.0)
    onset = creep.ageing_onset
    loss = creep.ageing_loss * math.log1p(cycles / onset)
    loss /= math.log1p(creep.ageing_cycles / onset)
    number("share of the untwist lost in these cycles", loss, below=1.0)
    fibre = replace(tca.fibre, untwist_scale=(1.0 - loss) * tca.fibre.untwist_scale)
    return replace(tca, fibre=fibre)

"""Morphing a module with a shape-memory spine: soften, morph, hold, harden, release.

Sun, dissertation, Colorado State University, Section 6.1.1 and 6.2: the spine is heated until it
is soft, the TCA bends it, holds it there while the spine hardens, and is released; then nothing
needs power. A TCA must not contract against a hardening spine, so its power is left alone as soon
as the spine is no longer soft. Heating without a TCA recovers the memorised shape.

The sequence is a frozen description; where it stands is a value that goes in and comes out. It can
be aborted and restarted at any moment, and gives up with everything off when something is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

from tca_mj.checks import (
    Checked,
    NotNegative,
    Positive,
    door,
    instance,
    number,
    require_positive,
)
from tca_mj.control.pi import PiSpec, PiState, pi_rest, pi_step

# A module is steady when it turns less than this in 20 s, Sun, Section 6.2.1 [rad].
TOLERANCE = math.radians(3.0)
_ROUNDING = 1e-9  # of sums of steps [s]


class Phase(StrEnum):
    """Where a sequence stands."""

    SOFTEN = "soften"  # heater on, TCA off
    MORPH = "morph"  # spine soft, TCA bends it
    HOLD = "hold"  # the same, at the goal
    HARDEN = "harden"  # heater off, TCA still pulls
    RELEASE = "release"  # everything off, the TCA cools
    DONE = "done"  # everything off, rigid
    FAULT = "fault"  # everything off, something was wrong


@dataclass(frozen=True, kw_only=True, slots=True)
class OpenLoop(Checked):
    """A constant voltage, for as long as the module takes to settle (Sun, Section 6.2.1).

    Attributes:
        voltage: Voltage of the TCA [V].
        settle_time: Time after which the angle is steady [s]. Sun, Section 6.2.2: the closed
            loop, done within 3 s, is more than 100 times faster.

    Raises:
        ValueError: If a number is not finite and positive.
    """

    voltage: Positive
    settle_time: Positive = 300.0


@dataclass(frozen=True, kw_only=True, slots=True)
class ClosedLoop(Checked):
    """PI control of the angle that the TCA senses by its own resistance (Sun, Section 6.2.2).

    Attributes:
        pi: Gains from error [rad] to power [W], with limits of the power from 0 up.
        angle_of: Angle [rad] at a resistance of the TCA [ohm], for example the polynomial of
            third order that was fitted to measurements.
        tolerance: Largest error at the goal [rad].

    Raises:
        ValueError: If the tolerance is not positive, or the power could be negative or without
            limit.
    """

    pi: PiSpec
    angle_of: Callable[[float], float]
    tolerance: Positive = TOLERANCE

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("lowest power of pi", self.pi.lowest, at_least=0.0, unit="W")
        number("highest power of pi", self.pi.highest, unit="W")


class Measurement(NamedTuple):
    """What a sequence sees.

    Attributes:
        spine_temperature: Reading of the thermistor in the spine [°C].
        resistance: Resistance of the TCA [ohm].
    """

    spine_temperature: float
    resistance: float


class Command(NamedTuple):
    """What a sequence wants until its next step.

    Attributes:
        heater_voltage: Voltage of the heater wire [V].
        tca_power: Power of the TCA [W].
        fan: Whether the fan cools the spine.
    """

    heater_voltage: float
    tca_power: float
    fan: bool


OFF = Command(0.0, 0.0, False)


@dataclass(frozen=True, slots=True, eq=False)
class MorphState:
    """Where a sequence stands.

    Attributes:
        phase: Phase.
        target: Angle to reach [rad]; None to recover the memorised shape without the TCA.
        elapsed: Time in this phase [s].
        steady: Time for which the angle has been within its tolerance, at the goal [s].
        boost: Whether the heater gets its full voltage to stay hot.
        power: Recent mean power of the TCA at the goal [W].
        earlier: Recent mean of that mean, by which one sees how the power falls [W].
        control: State of the PI controller.
        fault: What was wrong, empty if nothing was.
    """

    phase: Phase
    target: float | None = None
    elapsed: float = 0.0
    steady: float = 0.0
    boost: bool = False
    power: float = 0.0
    earlier: float = 0.0
    control: PiState = field(default_factory=pi_rest)
    fault: str = ""

    @property
    def over(self) -> bool:
        """Whether nothing will happen any more."""
        return self.phase in (Phase.DONE, Phase.FAULT)


@dataclass(frozen=True, kw_only=True, slots=True)
class MorphSequence(Checked):
    """The phases as data: voltages, thresholds and times.

    Attributes:
        drive: How the TCA is driven.
        heat_voltage: Voltage that heats the spine [V]. Sun, Section 6.1.3.
        hold_voltage: Voltage that keeps it hot [V]. Sun, Section 6.1.3.
        soft_temperature: The spine is soft above it [°C]. Sun, Section 6.1.3.
        rigid_temperature: The spine is rigid below it [°C]. Sun, Section 6.1.3.
        margin: The spine is heated to this much above ``soft_temperature``, and heated up again
            when half of it is lost, in case the hold voltage holds less [K]. An estimate.
        highest_temperature: Above it something is wrong with the heater [°C]. An estimate.
        hold_time: Time at the goal before hardening [s]. Sun, Section 6.1.3: held for 10 s.
        average_time: Time over which the power at the goal is averaged, for the power while the
            spine hardens: longer than noise, much shorter than ``hold_time``, so that what it
            took to get there is forgotten [s]. An estimate.
        fading_time: Time constant with which the power falls that keeps a TCA at one temperature,
            as the tube round it warms (``LumpedModule.fading_time``); 0 for a bare TCA, whose
            power stays. In a tube, power that stayed would heat it on, against a stiff spine. A
            longer time than the true one relaxes the TCA, a shorter one contracts it [s].
        release_time: Time that the TCA is given to cool, so that it does not pull when the spine is
            softened next: nearly four times the 48 s in which its tube cools [s]. An estimate.
        fan: Whether the fan helps to harden.
        soften_limit: Longest time to soften [s]. About twice what 25 V need: a thermistor that
            has come off must not let them heat the spine for long.
        morph_limit: Longest time to reach the goal by closed loop [s]. An estimate.
        hold_limit: Longest time to stay there for ``hold_time`` without a break [s]. An estimate.
        harden_limit: Longest time to harden [s]. An estimate.

    Raises:
        ValueError: If a number is not finite, not positive, or inconsistent with another.
    """

    drive: OpenLoop | ClosedLoop
    heat_voltage: Positive = 25.0
    hold_voltage: NotNegative = 9.5
    soft_temperature: float = 110.0
    rigid_temperature: float = 80.0
    margin: Positive = 6.0
    highest_temperature: float = 160.0
    hold_time: Positive = 10.0
    average_time: Positive = 1.5
    fading_time: NotNegative = 0.0
    release_time: Positive = 180.0
    fan: bool = True
    soften_limit: Positive = 15.0
    morph_limit: Positive = 60.0
    hold_limit: Positive = 60.0
    harden_limit: Positive = 120.0

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("hold_voltage", self.hold_voltage, below=self.heat_voltage, unit="V")
        soft, hot = self.soft_temperature, self.soft_temperature + self.margin
        number("rigid_temperature", self.rigid_temperature, above=-273.15, below=soft, unit="°C")
        number("highest_temperature", self.highest_temperature, above=hot, unit="°C")
        number("hold_limit", self.hold_limit, above=self.hold_time, unit="s")

    @door
    def start(self, target: float | None) -> MorphState:
        """A new sequence, in whatever shape and temperature the module is.

        Args:
            target: Angle to reach [rad]; for an open loop it has no influence, only None does.
                None recovers the memorised shape.

        Raises:
            ValueError: If the target is not finite.
        """
        if target is not None:
            number("target", target, unit="rad")
        return MorphState(Phase.SOFTEN, target)

    @door
    def abort(self, state: MorphState) -> MorphState:
        """Stops at once with everything off: a TCA that relaxes comes to no harm."""
        return state if state.over else MorphState(Phase.RELEASE, state.target)

    def step(
        self, state: MorphState, measured: Measurement, dt: float
    ) -> tuple[MorphState, Command]:
        """Decides on the phase by what is measured now, and commands the next ``dt``.

        Args:
            state: State after the last step.
            measured: Measurements now.
            dt: Time until the next step [s].

        Returns:
            The state after ``dt``, and the command meanwhile. A sequence that is over, or has
            measured what cannot be, commands nothing.

        Raises:
            ValueError: If ``dt`` is not finite and positive.
        """
        require_positive(dt=dt)
        instance("state", state, MorphState)
        instance("measured", measured, Measurement)
        if state.over:
            return state, OFF
        if state.phase is Phase.RELEASE:
            if state.elapsed >= self.release_time - _ROUNDING:
                return replace(state, phase=Phase.DONE, elapsed=0.0), OFF
            return replace(state, elapsed=state.elapsed + dt), OFF
        if fault := self._fault(state, measured):
            return MorphState(Phase.FAULT, state.target, fault=fault), OFF
        state = self._next(state, measured)
        if state.phase is Phase.RELEASE:
            return replace(state, elapsed=dt), OFF
        state, heater = self._heater(state, measured.spine_temperature)
        state, power = self._tca(state, measured, dt)
        fan = state.phase is Phase.HARDEN and self.fan
        return replace(state, elapsed=state.elapsed + dt), Command(heater, power, fan)

    def _fault(self, state: MorphState, measured: Measurement) -> str:
        """What is wrong, empty if nothing is."""
        temperature, resistance = measured
        if not math.isfinite(temperature):
            return f"the spine's temperature reads {temperature}"
        if not 0.0 < resistance < math.inf:
            return f"the TCA's resistance reads {resistance} ohm"
        if temperature > self.highest_temperature:
            return f"the spine is at {temperature:.0f} °C"
        limits = {
            Phase.SOFTEN: self.soften_limit,
            Phase.MORPH: math.inf if isinstance(self.drive, OpenLoop) else self.morph_limit,
            Phase.HOLD: self.hold_limit,
            Phase.HARDEN: self.harden_limit,
        }
        if state.elapsed > limits[state.phase]:
            return f"{state.phase} did not end in {limits[state.phase]:g} s"
        if isinstance(self.drive, ClosedLoop) and not math.isfinite(
            self.drive.angle_of(resistance)
        ):
            return f"the TCA's resistance of {resistance:g} ohm gives no angle"
        return ""

    def _next(self, state: MorphState, measured: Measurement) -> MorphState:
        """The phase that the measurements ask for, at most one further."""
        temperature = measured.spine_temperature
        if state.phase is Phase.SOFTEN:
            if temperature >= self.soft_temperature + self.margin:
                after = Phase.HOLD if state.target is None else Phase.MORPH
                return MorphState(after, state.target)
        elif state.phase in (Phase.MORPH, Phase.HOLD):
            if temperature < self.soft_temperature:  # the TCA would pull at a stiff spine
                return MorphState(Phase.SOFTEN, state.target)
            if state.phase is Phase.HOLD and state.steady >= self.hold_time - _ROUNDING:
                return replace(state, phase=Phase.HARDEN, elapsed=0.0)
            if state.phase is Phase.MORPH and self._arrived(state, measured):
                return replace(state, phase=Phase.HOLD, elapsed=0.0, steady=0.0)
        elif temperature <= self.rigid_temperature:
            return MorphState(Phase.RELEASE, state.target)
        return state

    def _arrived(self, state: MorphState, measured: Measurement) -> bool:
        """Whether the angle is, as far as is known, that of the target."""
        if state.target is None:
            return True
        if isinstance(self.drive, OpenLoop):
            settled = state.elapsed >= self.drive.settle_time - _ROUNDING
            return settled or state.phase is not Phase.MORPH
        error = state.target - self.drive.angle_of(measured.resistance)
        return abs(error) <= self.drive.tolerance

    def _heater(self, state: MorphState, temperature: float) -> tuple[MorphState, float]:
        """Full voltage to soften, then as much as keeps the spine soft."""
        if state.phase is Phase.HARDEN:
            return replace(state, boost=False), 0.0
        hot = self.soft_temperature + self.margin
        boost = temperature < (hot if state.boost else hot - 0.5 * self.margin)
        boost = boost or (state.phase is Phase.SOFTEN)
        return replace(state, boost=boost), self.heat_voltage if boost else self.hold_voltage

    def _tca(self, state: MorphState, measured: Measurement, dt: float) -> tuple[MorphState, float]:
        """Power of the TCA; the time at the goal, and the mean power over it."""
        if state.phase is Phase.SOFTEN:
            return state, 0.0
        hardening = state.phase is Phase.HARDEN
        if state.target is None:
            power = 0.0
        elif hardening and measured.spine_temperature < self.soft_temperature:
            return self._faded(state, dt)
        elif isinstance(self.drive, OpenLoop):
            power = self.drive.voltage**2 / measured.resistance
        else:
            error = state.target - self.drive.angle_of(measured.resistance)
            control, output = pi_step(self.drive.pi, state.control, error, dt)
            state, power = replace(state, control=control), float(output)
        if hardening or state.phase is Phase.HOLD:
            if not (hardening or self._arrived(state, measured)):
                return replace(state, steady=0.0), power
            time = state.steady + dt
            weight = min(1.0, dt / min(time, self.average_time))
            mean = state.power + (power - state.power) * weight
            earlier = state.earlier + (mean - state.earlier) * weight
            state = replace(state, steady=time, power=mean, earlier=earlier)
        return state, power

    def _faded(self, state: MorphState, dt: float) -> tuple[MorphState, float]:
        """Power that keeps the TCA's temperature now, and the means ``dt`` later.

        It is settled + falling exp(-t/fading_time). In a mean over the past, what falls is larger
        by a known ``gain``, in the mean of that mean by its square: the two means tell both terms.
        The power never rises, so that an error can relax a TCA but not contract it.
        """
        share = dt / self.average_time
        if self.fading_time <= self.average_time or share >= 1.0:
            return state, state.power  # what falls so fast is over by now
        gain = share / (1.0 - (1.0 - share) * math.exp(dt / self.fading_time))
        falling = max(0.0, state.earlier - state.power) / (gain - 1.0)
        settled, left = state.power - falling, math.exp(-dt / self.fading_time) * falling
        later = replace(state, power=settled + left, earlier=settled + gain * left)
        return later, max(0.0, settled + left / gain)

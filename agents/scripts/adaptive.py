"""The scripted policy of ``TCA/AdaptiveGrasp-v0``: morph by self-sensing, harden, pinch, let go."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.scripts.morph import FADING, GAINS, calibrate
from tca_mj.checks import Checked, NotNegative, Positive, Temperature, number
from tca_mj.control import Thermostat
from tca_mj.control.morph import (
    OFF,
    ClosedLoop,
    Command,
    Measurement,
    MorphSequence,
    MorphState,
    Phase,
)
from tca_mj.control.pi import PiSpec
from tca_mj.envs.adaptive import OBSERVATION, AdaptiveGrasp
from tca_mj.robots.adaptive_gripper import AdaptiveGripperSpec, adaptive_gripper
from tca_mj.smp.lumped import LumpedModule
from tca_mj.tca.spec import heat_of

_DT = AdaptiveGrasp.control_period
_AMBIENT = 25.0
# By how much closer the pads of the hardened base hang than a base of even curvature and straight
# fingers say: soft, it bends most where it carries most. Angles [rad], distances [m]; measured on
# the model.
_BENT, _CLOSER = np.radians([113.0, 167.0, 217.0]), (18e-3, 10e-3, 4e-3)


@dataclass(frozen=True, kw_only=True, slots=True)
class AdaptiveGains(Checked):
    """What the script was tuned to, on the default gripper.

    Attributes:
        clearance: Distance of each pad from the object before it pinches [m].
        warm: Temperature of the fingers' TCAs that pinches what weighs nothing [°C].
        per_mass: Rise of that temperature by the object's mass [K/kg].
        warming: Rate at which they are warmed, so that both touch gently [K/s].
        response: Time in which their thermostats would make up for an error [s].
        climb_rate: Velocity of the carriage over the missing height [1/s].
        carry_height: Height to which an object is lifted [m].
        carry_speed: Largest velocity of the carriage with an object [m/s].
        set_down: Height at which it is let go [m].
        near: Error of a height that is small enough [m].
        squeeze: Time for which the warm fingers pinch before they lift [s].
        let_go: Temperature of the fingers' TCAs below which they no longer press, so that they can
            leave without taking along what is light [°C].
        cooling: Longest time that they are given to let go: their tubes stay warm [s].
        phase_limit: Time after which a phase is given up for the next one [s].

    Raises:
        ValueError: If a number is not finite or negative, or a time 0.
    """

    clearance: NotNegative = 3e-3
    warm: Temperature = 98.0
    per_mass: NotNegative = 4700.0
    warming: Positive = 30.0
    response: Positive = 0.4
    climb_rate: Positive = 2.0
    carry_height: Positive = 20e-3
    carry_speed: Positive = 10e-3
    set_down: NotNegative = 0.5e-3
    near: Positive = 0.6e-3
    squeeze: Positive = 1.5
    let_go: Temperature = 50.0
    cooling: Positive = 60.0
    phase_limit: Positive = 12.0


@dataclass
class AdaptivePolicy(Checked):
    """The scripted policy of ``TCA/AdaptiveGrasp-v0``: an observation in, an action out.

    Of the base it looks at the thermistor and the resistance of the TCA, not at its angle.

    Attributes:
        gripper_spec: The gripper it was told that it has.
        gains: What it was tuned to.
        base: PI gains from the error of the base's angle [rad] to its TCA's power [W].
        frozen: Whether it leaves the base as it is.
        angle: Angle that the base is to have [rad]; not a number before the first observation.
        phase: "soften", "morph", "hold", "harden", "lower", "pinch", "lift", "carry", "set down",
            "release" or "done".
        since: Time in this phase [s].
    """

    gripper_spec: AdaptiveGripperSpec = field(default_factory=AdaptiveGripperSpec)
    gains: AdaptiveGains = field(default_factory=AdaptiveGains)
    base: PiSpec = field(default_factory=lambda: replace(GAINS, near_proportional=8.0))
    frozen: bool = False

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        spec = self.gripper_spec
        fit = calibrate(spec.base)
        lumped = LumpedModule(spec.base.spine, spec.base.heater, spec.base.sheathed)
        self.sequence = MorphSequence(
            drive=ClosedLoop(pi=self.base, angle_of=lambda ohm: float(fit.displacement(ohm))),
            fading_time=FADING * lumped.fading_time, hold_time=3.0, average_time=1.0,
        )  # fmt: skip
        self._heat = heat_of([tca.spec for tca in adaptive_gripper(spec).tcas[1:]])
        self._thermostat = Thermostat(
            heat=self._heat, max_power=AdaptiveGrasp.max_power[1:], response=self.gains.response,
            max_temperature=AdaptiveGrasp.safe_temperature,
        )  # fmt: skip
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self.phase, self.since, self.angle = "soften", 0.0, math.nan
        self.progress: MorphState | None = None
        self._aim, self._ground = _AMBIENT, 0.0
        self._body = np.array(self._heat.ambient)  # what the fingers' TCAs lie in: followed

    def angle_for(self, width: float) -> float:
        """Angle of the base that suits an object of some width [rad].

        Args:
            width: The width [m].

        Raises:
            ValueError: If it is none, or no angle suits it.
        """
        wanted = number("width", width, at_least=0.0, unit="m") + 2.0 * self.gains.clearance
        found = math.pi
        for _ in range(20):
            closer = float(np.interp(found, _BENT, _CLOSER))
            found = 0.5 * (found + self.gripper_spec.angle_for(wanted + closer))
        return found

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (6,)."""
        rows = OBSERVATION.read(observation.astype(np.float64))
        if self.progress is None:
            self.angle = self.angle_for(float(rows["object width"][0]))
            self.progress = self.sequence.start(self.angle)
            self._ground = float(rows["where to pinch it"][2])
            if self.frozen:
                self.phase = "lower"
        self.since += _DT
        following = self._next(rows)
        if following != self.phase:
            self.phase, self.since = following, 0.0
        base = self._morph(rows)
        fingers = self._fingers(rows)
        climb = self._climb(rows) / self.gripper_spec.lift.speed
        action = [
            2.0 * base.heater_voltage / AdaptiveGrasp.max_voltage - 1.0,
            2.0 * base.tca_power / AdaptiveGrasp.max_power[0] - 1.0, *fingers,
            1.0 if base.fan else -1.0, climb,
        ]  # fmt: skip
        return np.clip(action, -1.0, 1.0).astype(np.float32)

    def _morph(self, rows: dict[str, NDArray[np.float64]]) -> Command:
        """What the base is told; its phases are those of the sequence until it is rigid."""
        if self.phase not in ("soften", "morph", "hold", "harden"):
            return OFF
        assert self.progress is not None
        seen = Measurement(float(rows["spine temperature"][0]), float(rows["TCA resistance"][0]))
        self.progress, command = self.sequence.step(self.progress, seen, _DT)
        if self.progress.phase in (Phase.RELEASE, Phase.DONE, Phase.FAULT):
            self.phase, self.since = "lower", 0.0
        elif self.progress.phase.value != self.phase:
            self.phase, self.since = self.progress.phase.value, 0.0
        return command

    def _next(self, rows: dict[str, NDArray[np.float64]]) -> str:
        """The phase after this one if its goal is reached, else the same."""
        gains, late = self.gains, self.since > self.gains.phase_limit
        height = float(rows["where to pinch it"][2]) - self._ground
        match self.phase:
            case "lower" if abs(self._missing(rows)) < gains.near or late:
                return "pinch"
            case "pinch" if self._aim >= self._warm(rows) and self.since > gains.squeeze + (
                self._warm(rows) - _AMBIENT
            ) / gains.warming:
                return "lift"
            case "lift" if height > gains.carry_height - gains.near or late:
                return "carry"
            case "carry" if rows["time held"][0] > AdaptiveGrasp.hold_time - 1e-3:
                return "set down"
            case "carry" if self.since > 2.0 * gains.phase_limit:
                return "set down"
            case "set down" if height < gains.set_down + gains.near or late:
                return "release"
            case "release" if (
                rows["TCA temperature"][1:].max() < gains.let_go or self.since > gains.cooling
            ):
                return "done"
        return self.phase

    def _warm(self, rows: dict[str, NDArray[np.float64]]) -> float:
        """Temperature of the fingers' TCAs with which they pinch the object [°C]."""
        return self.gains.warm + self.gains.per_mass * float(rows["object mass"][0])

    def _missing(self, rows: dict[str, NDArray[np.float64]]) -> float:
        """How far the pads have to rise to where to pinch [m]."""
        return float(rows["where to pinch it"][2] - rows["pads, x and z"][[1, 3]].mean())

    def _fingers(self, rows: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """What the fingers' TCAs are told."""
        now = rows["TCA temperature"][1:]
        pinching = self.phase in ("pinch", "lift", "carry", "set down")
        rise = _DT * self.gains.warming
        self._aim = min(self._aim + rise, self._warm(rows)) if pinching else _AMBIENT
        power = self._thermostat.power(now, np.full(2, self._aim), self._body)
        self._body = self._heat.body_after(self._body, now, _DT)
        return 2.0 * power * (self._aim > _AMBIENT) / AdaptiveGrasp.max_power[1:] - 1.0

    def _climb(self, rows: dict[str, NDArray[np.float64]]) -> float:
        """Velocity of the carriage [m/s]."""
        gains = self.gains
        height = float(rows["where to pinch it"][2]) - self._ground
        match self.phase:
            case "lower" | "pinch":  # bending fingers lift their pads
                return gains.climb_rate * self._missing(rows)
            case "lift" | "carry" | "set down":
                goal = gains.set_down if self.phase == "set down" else gains.carry_height
                climb = gains.climb_rate * (goal - height)
                return float(np.clip(climb, -gains.carry_speed, gains.carry_speed))
            case "done":
                return 0.5 * self.gripper_spec.lift.speed
            case _:
                return 0.0


def scripted(task: Any) -> AdaptivePolicy:
    """The scripted policy of an ``AdaptiveGrasp``."""
    return AdaptivePolicy(task.gripper_spec)

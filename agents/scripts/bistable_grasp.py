"""The scripted policy of ``TCA/BistableGrasp-v0``: snap shut, carry cold, snap open."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Angle, Checked, NotNegative, Positive
from tca_mj.envs.bistable_grasp import OBSERVATION, BistableGrasp
from tca_mj.robots.bistable_gripper import CLOSING, OPENING, SIDES, BistableGripperSpec

_DT = BistableGrasp.control_period
_TCAS = 2 * SIDES


@dataclass(frozen=True, kw_only=True, slots=True)
class BistableGraspGains(Checked):
    """What the script was tuned to, on the default gripper.

    Attributes:
        below: How far below the fingers' roots the object's middle is when they close [m].
        set_down: The same when they open: pushed down from where they carry it, they no longer
            press it from below, and need not slide along it [m].
        over: Bend beyond which a finger has gone over, either way [rad].
        lifted: Height to which the object is lifted [m].
        near: Error of a place that is small enough [m].
        climb_rate: Velocity of the carriage over the missing way [1/s].
        carry_speed: Largest velocity with an object, over the carriage's [1].
        calm: Time in which the fingers come to rest after a snap [s].
        phase_limit: Time after which a phase is given up for the next one [s].

    Raises:
        ValueError: If a number is not finite or negative, or a time 0.
    """

    below: NotNegative = 22e-3
    set_down: NotNegative = 16e-3
    over: Angle = 0.3
    lifted: NotNegative = 12e-3
    near: NotNegative = 0.5e-3
    climb_rate: NotNegative = 3.0
    carry_speed: NotNegative = 0.5
    calm: NotNegative = 0.6
    phase_limit: Positive = 6.0


@dataclass
class BistableGraspPolicy(Checked):
    """The scripted policy of ``TCA/BistableGrasp-v0``: an observation in, an action out.

    Attributes:
        gripper_spec: The gripper it was told that it has.
        gains: What it was tuned to.
        phase: "lower", "close", "calm", "lift", "carry", "set down", "open", "leave".
        since: Time in this phase [s].
    """

    gripper_spec: BistableGripperSpec = field(default_factory=BistableGripperSpec)
    gains: BistableGraspGains = field(default_factory=BistableGraspGains)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self.phase, self.since = "lower", 0.0
        self._ground: float | None = None

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (6,)."""
        rows = OBSERVATION.read(observation.astype(np.float64))
        if self._ground is None:
            self._ground = float(rows["object position"][2])
        self.since += _DT
        following = self._next(rows)
        if following != self.phase:
            self.phase, self.since = following, 0.0
        heat = np.full(_TCAS, -1.0)
        if self.phase in ("close", "open"):
            heat[list(CLOSING if self.phase == "close" else OPENING)] = 1.0
        spec, limit = self.gripper_spec, self.gains.carry_speed
        speeds = self.gains.climb_rate * self._missing(rows) / (spec.across_speed, spec.lift.speed)
        if self.phase in ("lift", "carry", "set down"):
            speeds = np.clip(speeds, -limit, limit)
        return np.clip([*heat, *speeds], -1.0, 1.0).astype(np.float32)

    def _missing(self, rows: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """The way along y and z that the carriage has to go [m]."""
        gains, hand, ground = self.gains, rows["carriage, y and z"], self._ground or 0.0
        y, z = rows["object position"][1:]
        goal = float(rows["where it is to go, y"][0])
        match self.phase:
            case "lower" | "close":
                return np.array([y - hand[0], ground + gains.below - hand[1]])
            case "lift":
                return np.array([0.0, ground + gains.lifted - z])
            case "carry":
                return np.array([goal - y, ground + gains.lifted - z])
            case "set down":
                return np.array([goal - y, ground + gains.set_down - hand[1]])
            case "leave":
                return np.array([0.0, self.gripper_spec.lift.travel[1] - hand[1]])
        return np.zeros(2)

    def _next(self, rows: dict[str, NDArray[np.float64]]) -> str:
        """The phase after this one if its goal is reached, else the same."""
        gains, late = self.gains, self.since > self.gains.phase_limit
        bends = rows["bend of the fingers"]
        missing = np.abs(self._missing(rows))
        match self.phase:
            case "lower" if missing.max() < gains.near or late:
                return "close"
            case "close" if bends.min() > gains.over or late:
                return "calm"
            case "calm" if self.since > gains.calm:
                return "lift"
            case "lift" if missing[1] < gains.near or late:
                return "carry"
            case "carry" if rows["time until it is to be let go"][0] < 0.0:
                return "set down"
            case "set down" if missing[1] < gains.near or late:
                return "open"
            case "open" if bends.max() < -gains.over or late:
                return "leave"
        return self.phase


def scripted(task: Any) -> BistableGraspPolicy:
    """The scripted policy of a ``BistableGrasp``."""
    return BistableGraspPolicy(task.gripper_spec)

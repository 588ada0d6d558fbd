"""The scripted policy of ``TCA/Grasp-v0``: open, lower, close, lift, hold without power, let go."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, NotNegative, Positive, Temperature
from tca_mj.envs.grasp import OBSERVATION, Grasp
from tca_mj.robots.gripper import GripperSpec

_DT, _AMBIENT = Grasp.control_period, 25.0
_CARRIED = ("lift", "hold", "set down")  # phases in which the object is


@dataclass(frozen=True, kw_only=True, slots=True)
class GraspGains(Checked):
    """What the script was tuned to, on the default gripper.

    Attributes:
        hottest: Temperature that the TCA is not asked to pass [°C].
        opening_slope: Rise of temperature that opens the gripper by one metre [K/m].
        clearance: Opening beyond the object's width with which the fingers go down [m].
        letting_go: The same with which they go up again: tilted, their ends have inner edges [m].
        hover: Height of the tips above the object's middle while they open [m].
        grasp_height: Height of the tips above the object's middle where they close: they touch it
            by their upper edges, 2 to 3 mm higher [m].
        near: Error of a height that is small enough [m].
        climb_rate: Velocity of the base over the missing height [1/s].
        carry_height: Height to which the object is lifted [m].
        set_down: Height at which it is let go [m].
        calm: Time without a change of the opening after which the fingers hold [s].
        phase_limit: Time after which a phase is given up for the next one [s].

    Raises:
        ValueError: If a number is not finite or negative, or a time 0.
    """

    hottest: Temperature = 160.0
    opening_slope: NotNegative = 1e4
    clearance: NotNegative = 4e-3
    letting_go: NotNegative = 6.5e-3
    hover: NotNegative = 9e-3
    grasp_height: float = -1e-3
    near: NotNegative = 0.4e-3
    climb_rate: NotNegative = 3.0
    carry_height: NotNegative = 10e-3
    set_down: NotNegative = 0.5e-3
    calm: NotNegative = 0.4
    phase_limit: Positive = 6.0


@dataclass
class GraspPolicy(Checked):
    """The scripted policy of ``TCA/Grasp-v0``: an observation in, an action out.

    Attributes:
        gripper_spec: The gripper it was told that it has.
        gains: What it was tuned to.
        phase: "open", "lower", "close", "lift", "hold", "set down", "release" or "done".
        since: Time in this phase [s].
    """

    gripper_spec: GripperSpec = field(default_factory=GripperSpec)
    gains: GraspGains = field(default_factory=GraspGains)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self.phase, self.since = "open", 0.0
        self._calm = self._opening = 0.0
        self._ground: float | None = None

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (2,)."""
        rows = OBSERVATION.read(observation.astype(np.float64))
        tips = rows["tips of the fingers, x and z"].reshape(2, 2)
        opening = float(np.linalg.norm(tips[1] - tips[0]))
        if self._ground is None:
            self._ground = float(rows["object position"][2])
        self.since += _DT
        self._calm = self._calm + _DT if abs(opening - self._opening) < 2e-5 else 0.0
        self._opening = opening
        following = self._next(rows, float(tips[:, 1].mean()))
        if following != self.phase:
            self.phase, self.since, self._calm = following, 0.0, 0.0
        return self._command(rows, float(tips[:, 1].mean()))

    def _next(self, rows: dict[str, NDArray[np.float64]], tips: float) -> str:
        """The phase after this one if its goal is reached, else the same."""
        gains, late = self.gains, self.since > self.gains.phase_limit
        above = tips - float(rows["object position"][2])
        height = float(rows["object position"][2]) - (self._ground or 0.0)
        width = float(rows["object width"][0])
        match self.phase:
            case "open" if self._opening > width + 0.9 * gains.clearance or late:
                return "lower"
            case "lower" if abs(above - gains.grasp_height) < gains.near or late:
                return "close"
            case "close" if self._calm > gains.calm or late:
                return "lift"
            case "lift" if height > gains.carry_height - gains.near or late:
                return "hold"
            case "hold" if rows["time until it is to be let go"][0] < 0.0:
                return "set down"
            case "set down" if height < gains.set_down + gains.near or late:
                return "release"
            case "release" if self._opening > width + 0.9 * gains.letting_go or late:
                return "done"
        return self.phase

    def _command(self, rows: dict[str, NDArray[np.float64]], tips: float) -> NDArray[np.float32]:
        gains, phase, where = self.gains, self.phase, float(rows["object position"][2])
        ground = self._ground or 0.0
        target = _AMBIENT
        if phase in ("open", "lower", "release", "done"):
            leaving = phase in ("release", "done")
            wanted = float(rows["object width"][0]) + (
                gains.letting_go if leaving else gains.clearance
            )
            target = float(rows["TCA temperature"][0]) + 0.5 * gains.opening_slope * (
                wanted - self._opening
            )
        missing = {
            "open": where + gains.hover - tips, "lower": where + gains.grasp_height - tips,
            "lift": ground + gains.carry_height - where,
            "hold": ground + gains.carry_height - where,
            "set down": ground + gains.set_down - where, "done": gains.hover,
        }.get(phase, 0.0)  # fmt: skip
        climb = gains.climb_rate * missing / self.gripper_spec.lift.speed
        if phase in _CARRIED:  # gently
            climb = float(np.clip(climb, -0.25, 0.25))
        span = Grasp.safe_temperature - _AMBIENT
        heat = 2.0 * (min(target, gains.hottest) - _AMBIENT) / span - 1.0
        return np.clip([heat, climb], -1.0, 1.0).astype(np.float32)


def scripted(task: Any) -> GraspPolicy:
    """The scripted policy of a ``Grasp``."""
    return GraspPolicy(task.gripper_spec)

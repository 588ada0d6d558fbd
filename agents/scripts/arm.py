"""Scripted agents: feedback on what the robot senses, no replay.

``PickAndPlace`` follows Sun, Section 4.1.4 and Fig. 5.6: align the wrist, open, lower, pinch,
lift, turn back, bend towards the cup, release. What need not wait does not: the gripper opens from
the start, the bending module is warmed up to the lift, and the wrist turns back, as far as it does,
while the arm bends.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, NotNegative, Positive, Temperature, require_one_of
from tca_mj.envs.arm import OBSERVATION, ArmPickPlace, misaligned, yaw
from tca_mj.envs.task import HEATINGS
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.tca.spec import heat_of

Array = NDArray[np.float64]

# Names of the phases, in order.
PHASES = ("align", "open", "lower", "pinch", "lift", "turn back", "bend", "release", "done")

_DT = ArmPickPlace.control_period
_BENDING, _WRIST, _GRIPPER = slice(0, 3), 3, 4


@dataclass(frozen=True, kw_only=True, slots=True)
class PickAndPlaceGains(Checked):
    """What the script was tuned to, on the default arm.

    Attributes:
        hottest: Temperature that no TCA is asked to pass [°C].
        settling: Time in which a TCA is brought to a temperature [s].
        averaging: Time over which positions are averaged [s].
        align_rate: Temperature asked for per offset of the gripper from the object and second
            [K/(m s)].
        align_now: Temperature asked for per such offset [K/m].
        bend_rate: Temperature asked for per offset of the object from the cup and second [K/(m s)].
        bend_now: Temperature asked for per such offset [K/m].
        brace: Rise of all three bending TCAs over the largest that the bend asks for. Pulling
            against each other they hold the soft body: strongly bent by one side alone it would
            roll over, from about 130 °C on.
        warm: Rise of all three bending TCAs up to the lift, on top of what aligns the gripper: with
            at most 2 W each they would need seconds to warm up for the bend [K].
        warm_rate: How fast it grows, so that power is left to align the gripper [K/s].
        wrist_slope: Temperature asked for per misalignment of the wrist [K/rad].
        opening_slope: Temperature asked for per missing opening [K/m].
        clearance: Opening beyond the object's width that is asked for; twice it to let go [m].
        opened: The same with which the gripper goes down, while it goes on opening [m].
        grasp_depth: How far below the object's centre the finger tips close [m].
        aligned: Offset of the gripper with which it goes down and closes [m].
        aligned_yaw: Misalignment of the wrist with which it closes; with twice it goes down [rad].
        over_cup: Offset of the object from the cup's axis at which it is let go; at twice it goes
            down [m].
        patience: Time after which half as much again is near enough: the arm cannot reach
            further without getting too hot [s].
        turning_back: Time that the wrist is given to turn back before the arm bends [s]. Its
            silicone, warm by then, keeps it turned for minutes; the cup is round.
        lifted: Height of the object at which the arm begins to bend; at 33 mm the task calls it
            carried [m].
        carry_height: Height of the object while it is carried [m].
        drop_height: Height of the object when it is let go [m].
        released: Height of the object below which it is out of the fingers [m].
        hover: Height above the object at which the gripper is aligned and opened [m].
        climb_rate: Velocity of the base over the missing height, to there [1/s].
        lower_rate: The same to the object, and while the fingers close round it [1/s].
        carry_rate: The same with the object [1/s].
        calm: Time without a change of the opening after which the fingers hold [s].
        still: Change of the opening in a step that is none [m].
        cool: Temperature of the gripper's TCA over its silicone's at which they do in any case, as
            the silicone keeps the TCA warm for minutes [K].
        slipped: Depth of the object below the finger tips at which it counts as lost [m].
        phase_limit: Time after which any phase is given up for the next one [s].

    Raises:
        ValueError: If a number is not finite or negative, or a time 0.
    """

    hottest: Temperature = 155.0
    settling: Positive = 0.35
    averaging: Positive = 0.25
    align_rate: NotNegative = 4000.0
    align_now: NotNegative = 3000.0
    bend_rate: NotNegative = 4000.0
    bend_now: NotNegative = 3500.0
    brace: NotNegative = 0.55
    warm: NotNegative = 80.0
    warm_rate: NotNegative = 20.0
    wrist_slope: NotNegative = 45.0
    opening_slope: NotNegative = 3e4
    clearance: NotNegative = 3.8e-3
    opened: NotNegative = 0.95e-3
    grasp_depth: NotNegative = 2e-3
    aligned: NotNegative = 2e-3
    aligned_yaw: NotNegative = 0.12
    over_cup: NotNegative = 8.5e-3
    patience: Positive = 12.0
    turning_back: Positive = 0.05
    lifted: NotNegative = 33.5e-3
    carry_height: NotNegative = 37e-3
    drop_height: NotNegative = 25e-3
    released: NotNegative = 19e-3
    hover: NotNegative = 14e-3
    climb_rate: NotNegative = 2.0
    lower_rate: NotNegative = 5.0
    carry_rate: NotNegative = 2.5
    calm: NotNegative = 0.1
    still: NotNegative = 2e-4
    cool: NotNegative = 13.0
    slipped: NotNegative = 8e-3
    phase_limit: Positive = 40.0


@dataclass
class PickAndPlace(Checked):
    """The scripted policy of ``TCA/ArmPickPlace-v0``: an observation in, an action out.

    Attributes:
        arm_spec: The arm it was told that it has.
        gains: What it was tuned to.
        period: Time between two actions [s].
        told: What it tells the TCAs, ``power`` or ``temperature``, as the task's ``action``.
        phase: What it is doing, one of ``PHASES``.
        since: Time in this phase [s].
        tries: How often it went for the object.
    """

    arm_spec: ArmSpec = field(default_factory=ArmSpec)
    gains: PickAndPlaceGains = field(default_factory=PickAndPlaceGains)
    period: Positive = _DT
    told: Annotated[str, partial(require_one_of, choices=HEATINGS)] = "power"

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self._heat = heat_of([tca.spec for tca in arm(self.arm_spec).tcas])
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self.phase, self.since, self.tries = "align", 0.0, 1
        self._bend = np.zeros(2)
        self._time = self._calm = self._opening = self._height = 0.0
        self._mean: Array | None = None
        self._body = np.array(self._heat.ambient)  # what the TCAs lie in: not seen, but followed

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (6,)."""
        seen = _Seen(observation)
        if self._mean is None:
            self._mean = np.stack([seen.gripper, seen.object])
        # The soft arm swings: steering on what it does on average does not drive the swing.
        share = self.period / self.gains.averaging
        self._mean += share * ([seen.gripper, seen.object] - self._mean)
        seen.gripper, seen.object = self._mean
        self.since += self.period
        self._time += self.period
        unchanged = abs(seen.opening - self._opening) < self.gains.still
        self._calm = self._calm + self.period if unchanged else 0.0
        self._opening = seen.opening
        following = self._next(seen)
        if following != self.phase:
            if following == "open" and self.phase in ("pinch", "lift"):
                self.tries += 1
            self.phase, self.since, self._calm = following, 0.0, 0.0
            self._height = seen.object[2] - self.gains.grasp_depth
        return self._command(seen)

    def _next(self, seen: _Seen) -> str:
        """The phase after this one if its goal is reached, else the same."""
        gains, late = self.gains, self.since > self.gains.phase_limit
        offset = float(np.linalg.norm(seen.object[:2] - seen.gripper[:2]))
        near, turned = offset < gains.aligned, abs(seen.misaligned) < gains.aligned_yaw
        match self.phase:
            case "align" if near and abs(seen.misaligned) < 2.0 * gains.aligned_yaw or late:
                return "open"
            case "open" if seen.opening > seen.width + gains.opened or late:
                return "lower"
            case "lower" if near and turned and abs(seen.tips - self._height) < 4e-4 or late:
                return "pinch"
            case "pinch" if (
                self._calm > gains.calm
                or seen.temperature[_GRIPPER] < self._body[_GRIPPER] + gains.cool
            ):
                return "lift"
            case "lift" if self.since > 1.0 and seen.object[2] < seen.gripper[2] - gains.slipped:
                return "open" if self.tries < 3 else "done"
            case "lift" if seen.object[2] > gains.lifted or late:
                return "turn back"
            case "turn back" if abs(seen.yaw) < 0.2 or self.since > gains.turning_back or late:
                return "bend"
            case "bend" if (
                float(np.linalg.norm(seen.object[:2] - seen.cup[:2]))
                < gains.over_cup * (1.0 if self.since < gains.patience else 1.5)
                and seen.object[2] < gains.drop_height + 2e-3
            ) or late:
                return "release"
            case "release" if seen.object[2] < 14e-3 or late:
                return "done"
        return self.phase

    def _command(self, seen: _Seen) -> NDArray[np.float32]:
        gains, phase = self.gains, self.phase
        target = np.full(5, -np.inf)  # wanted temperatures [°C]; below ambient means off
        error = np.zeros(2)
        if phase in ("align", "open", "lower"):
            error = seen.object[:2] - seen.gripper[:2]
            target[_WRIST] = seen.temperature[_WRIST] + gains.wrist_slope * seen.misaligned
        elif phase == "pinch":
            target[_WRIST] = seen.temperature[_WRIST]
        elif phase in ("lift", "turn back"):
            self._bend *= 0.9  # straight again
        elif phase == "bend" or self._holds(seen):
            error = seen.cup[:2] - seen.object[:2]
        target[_BENDING] = self._steer(seen, error)
        if phase in ("align", "open", "lower", "release"):
            wanted = seen.width + gains.clearance * (2.0 if phase == "release" else 1.0)
            target[_GRIPPER] = seen.temperature[_GRIPPER] + gains.opening_slope * (
                wanted - seen.opening
            )
        heat = self._heating(seen.temperature, np.minimum(target, gains.hottest))
        action = np.append(heat, self._climb(seen) / self.arm_spec.speed)
        return np.clip(action, -1.0, 1.0).astype(np.float32)

    def _heating(self, now: Array, wanted: Array) -> Array:
        """What brings the TCAs to a temperature, -inf being off, as an action, shape (n,)."""
        heat, settling = self._heat, self.gains.settling
        hold = heat.keeping(np.maximum(np.minimum(now, wanted), self._body), self._body)
        self._body = heat.body_after(self._body, now, self.period)
        if self.told == "power":
            power = np.maximum(hold + heat.capacity * (wanted - now) / settling, 0.0)
            return 2.0 * power / ArmPickPlace.max_power - 1.0
        # A thermostat is faster than ``settling``: it is told a temperature on the way.
        way = np.maximum(wanted, heat.ambient) - now
        asked = now + min(1.0, self.period / settling) * way
        asked = np.where(np.isfinite(wanted), asked, heat.ambient)
        return 2.0 * (asked - heat.ambient) / (ArmPickPlace.safe_temperature - heat.ambient) - 1.0

    def _steer(self, seen: _Seen, error: Array) -> Array:
        """Temperatures of the three bending TCAs that take the gripper along ``error`` [m].

        Proportional and integral; a TCA bends the arm to its own side.
        """
        gains, bending = self.gains, self.phase in ("bend", "release", "done")
        rate, now = (
            (gains.bend_rate, gains.bend_now) if bending else (gains.align_rate, gains.align_now)
        )
        self._bend = self._bend + rate * self.period * error
        wanted = self._bend + now * error
        share = (2.0 / 3.0) * _SIDES @ wanted
        share -= share.min()
        excess = share.max() + seen.ambient - gains.hottest
        if excess > 0.0:  # no wind-up against the hottest temperature
            self._bend *= 1.0 - excess / share.max()
            share *= 1.0 - excess / share.max()
        share = np.maximum(share, gains.brace * share.max())
        if not bending:
            room = gains.hottest - seen.ambient - share.max()
            share += min(gains.warm, gains.warm_rate * self._time, room)
        return seen.ambient + share

    def _holds(self, seen: _Seen) -> bool:
        """Whether the object is still in the fingers that let it go."""
        return self.phase == "release" and bool(seen.object[2] > self.gains.released)

    def _climb(self, seen: _Seen) -> float:
        """Velocity of the base [m/s]."""
        gains = self.gains
        match self.phase:
            case "align" | "open":
                return gains.climb_rate * (seen.object[2] + gains.hover - seen.gripper[2])
            case "lower" | "pinch":  # the arm gets shorter as it warms up
                return gains.lower_rate * (self._height - seen.tips)
            case "lift" | "turn back":
                return gains.carry_rate * (gains.carry_height - seen.object[2])
            case "bend":
                near = np.linalg.norm(seen.object[:2] - seen.cup[:2]) < 2.0 * gains.over_cup
                height = gains.drop_height if near else gains.carry_height
                return gains.carry_rate * (height - seen.object[2])
            case "release" if self._holds(seen):
                return gains.carry_rate * (gains.drop_height - seen.object[2])
            case _:
                return 0.5 * self.arm_spec.speed  # up and out of the way


# Unit vectors in the world towards which the three TCAs bend the hanging arm: the module's x
# axis is the world's, its y axis the world's negative one.
_ANGLES = -2.0 * np.pi / 3.0 * np.arange(3)
_SIDES = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)


class _Seen:
    """An observation, taken apart."""

    ambient = 25.0

    def __init__(self, observation: NDArray[np.float32]) -> None:
        rows = OBSERVATION.read(observation.astype(np.float64))
        self.temperature = rows["TCA temperature"]
        self.opening = float(rows["gripper opening"][0])
        self.width = float(rows["object width"][0])
        self.gripper = rows["gripper position"]
        self.tips = float(self.gripper[2])  # their height now; the positions become averages
        self.object = rows["object position"]
        self.cup = rows["cup position"]
        # The fingers close along the gripper's x axis; neutral is the world's x axis.
        self.yaw = yaw(rows["gripper orientation"])
        # The long side has to lie across the fingers; half turns do not matter.
        self.misaligned = misaligned(yaw(rows["object orientation"]), self.yaw)


def scripted(task: Any) -> PickAndPlace:
    """The scripted policy of an ``ArmPickPlace``; it tells the TCAs what those of the task take."""
    return PickAndPlace(period=task.control_period, told=task.heating)

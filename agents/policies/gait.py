"""A gait on feedback of the temperatures: an observation in, an action out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, Finite, NotNegative, Positive, Temperature, door
from tca_mj.control import Gait, Thermostat
from tca_mj.envs.table import Table
from tca_mj.registry import ControlPeriod
from tca_mj.tca import HeatSpec


@dataclass(kw_only=True)
class GaitPolicy(Checked):
    """What makes the TCAs of legs as hot as a gait says, steered to a direction.

    It can act in every task with ``legs`` whose action heats their TCAs, leg by leg, and which sees
    the rows "TCA temperature" and "commanded direction". Legs are left and right by turns. Where an
    action is a temperature that is held, it is that in the middle of that time.

    Attributes:
        gait: The gait.
        steering: How much cooler the legs of the side to turn to are kept, per angle between where
            the robot looks and where it ought to, one number or one for each leg [K/rad].
        seen: Table of the observation.
        heat: Thermal constants of the TCAs that it was told, fields of shape (TCAs,).
        max_power: Power of each of them at an action of 1 [W].
        hottest: Temperature that corrections may not pass, unless the gait does [°C].
        control_period: Time between two actions [s].
        time: Time since the start [s].
        asked: Temperatures that actions of -1 and of 1 ask for; None where they are power [°C].

    Raises:
        ValueError: If a field is not of its kind, the gait has an odd number of legs, or the
            steering another number, or ``asked`` falls.
    """

    gait: Gait
    steering: Finite | tuple[float, ...] = 0.0
    seen: Table
    heat: HeatSpec
    max_power: Positive
    hottest: Temperature
    control_period: ControlPeriod
    time: NotNegative = 0.0
    asked: tuple[float, float] | None = None
    phase = "gait"

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.gait.legs % 2:
            raise ValueError(f"gait must have legs by twos, got {self.gait.legs}")
        if self.asked and not self.asked[0] < self.asked[1]:
            raise ValueError(f"asked must rise from -1 to 1, got {self.asked}")
        if np.shape(self.steering) not in ((), (self.gait.legs,)):
            raise ValueError(f"steering must have {self.gait.legs} numbers, got {self.steering}")
        self._thermostat = Thermostat(heat=self.heat, max_power=self.max_power)
        self._left = np.array([1.0, 0.0] * (self.gait.legs // 2), dtype=np.float64)

    @classmethod
    @door
    def in_task(
        cls, env: gym.Env[Any, Any], gait: Gait, steering: float | tuple[float, ...]
    ) -> GaitPolicy:
        """A gait in an environment.

        Raises:
            ValueError: If no gait can do the task, or its legs are not those of the gait.
        """
        task: Any = env.unwrapped
        if task.legs != gait.legs:
            raise ValueError(f"gait must have {task.legs} legs, got {gait.legs}")
        n = task.action.size
        heat = HeatSpec(capacity=task.heat.capacity[:n], loss=task.heat.loss[:n])
        walker = cls.told_of(task, task.observation, heat, gait, steering)
        if task.heating == "temperature":
            low, high = task.heated(np.array([-1.0, 1.0]))[:2].tolist()
            walker.asked = low, high
        return walker

    @classmethod
    def told_of(
        cls, task: Any, seen: Table, heat: HeatSpec, gait: Gait, steering: float | tuple[float, ...]
    ) -> GaitPolicy:
        """A gait with the limits and the control period of a task, or of a class of tasks."""
        return cls(
            gait=gait, steering=steering, seen=seen, heat=heat, max_power=task.max_power,
            hottest=task.hot_temperature, control_period=task.control_period,
        )  # fmt: skip

    @property
    def cycle(self) -> float:
        """Where in the cycle it is, 0 to 1."""
        return self.time / self.gait.period % 1.0

    def reset(self) -> None:
        """Starts anew."""
        self.time = 0.0

    def act(
        self, observation: NDArray[np.float32], correction: NDArray[np.float64] | float = 0.0
    ) -> NDArray[np.float32]:
        """The action for the next control period, one number for each TCA.

        Args:
            observation: What is seen.
            correction: Added to the temperatures of the gait, one number for each TCA [K]. What it
                makes hotter than both the gait and ``hottest`` is cut off there.
        """
        rows = self.seen.read(observation.astype(np.float64))
        now = self.time + (0.5 * self.control_period if self.asked else 0.0)
        target = self.gait.temperature(now / self.gait.period).reshape(len(self._left), -1)
        x, y = rows["commanded direction"]
        aside = np.arctan2(y, x)
        weaker = np.clip(np.array(self.steering) * aside, -80.0, 80.0)
        side = self._left if aside > 0.0 else 1.0 - self._left
        target = (target - (np.abs(weaker) * side)[:, None]).ravel()
        limit = np.maximum(target, self.hottest)
        self.time += self.control_period
        wanted = np.minimum(target + correction, limit)
        if self.asked:
            low, high = self.asked
            action = 2.0 * (wanted - low) / (high - low) - 1.0
        else:
            power = self._thermostat.power(rows["TCA temperature"], wanted)
            action = 2.0 * power / self.max_power - 1.0
        return np.clip(action, -1.0, 1.0).astype(np.float32)

"""The scripted policy of ``TCA/BendReach-v0``: the inverse of the statics, and feedback on it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, NotNegative, Positive, Temperature
from tca_mj.control import Thermostat
from tca_mj.envs.hanging import StaticTip
from tca_mj.envs.reach import ACTION, OBSERVATION, BendReach
from tca_mj.modules.bending import BendingSpec


@dataclass
class ReachPolicy(Checked):
    """Temperatures from a model at rest, corrected by where the tip is: observation in, action out.

    Its own, nominal module tells at which temperatures the tip would rest at the target, and how
    the tip's place changes with them. By how much the tip misses the target is integrated and,
    through that slope, taken off.

    Attributes:
        module_spec: The module it was told that it has.
        averaging: Time over which what is missed is integrated to as much again [s].
        near: How near the temperatures have to be to those aimed at for that: on the way there the
            tip misses the target for no fault of the model [K].
        hottest: Temperature that no TCA is asked to pass [°C]. By 5 K above that of any target, so
            that a module that is weaker than nominal reaches its targets, and below what costs.
    """

    module_spec: BendingSpec = field(default_factory=BendingSpec)
    averaging: Positive = 1.0
    near: NotNegative = 10.0
    hottest: Temperature = BendReach.hot_temperature - 5.0
    phase = "reach"
    _dt = BendReach.control_period

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self._static = StaticTip(self.module_spec)
        self._heat = self._static.sim.bank.heat
        self._thermostat = Thermostat(heat=self._heat, max_power=BendReach.max_power)
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self._target: NDArray[np.float64] | None = None
        self._off = np.zeros(3)
        self._body = np.array(self._heat.ambient)  # what the TCAs lie in: not seen, but followed

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (3,)."""
        rows = OBSERVATION.read(observation.astype(np.float64))
        target, temperature = rows["target position"], rows["TCA temperature"]
        if self._target is None or (target != self._target).any():
            self._target = target
            self._rest, self._slope, _ = self._static.inverse(target, BendReach.hottest_target)
        aim = self._rest - np.linalg.solve(self._slope, self._off)
        aim = np.clip(aim, self._heat.ambient, self.hottest)
        if np.abs(temperature - aim).max() < self.near:
            missed = rows["tip position"] - target
            self._off += self._dt / self.averaging * missed
        power = self._thermostat.power(temperature, aim, self._body)
        self._body = self._heat.body_after(self._body, temperature, self._dt)
        action = 2.0 * power / BendReach.max_power - 1.0
        return np.clip(action, -1.0, 1.0).astype(ACTION.space.dtype)


def scripted(task: Any) -> ReachPolicy:
    """The scripted policy of a ``BendReach``."""
    return ReachPolicy(task.module_spec)

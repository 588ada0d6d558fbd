"""The scripted policy of ``TCA/Jump-v0``: heat until it goes over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Angle, Checked
from tca_mj.envs.jump import ACTION, OBSERVATION


@dataclass
class JumpPolicy(Checked):
    """Heats the TCA with all that is safe until the module has snapped: observation in, action out.

    Attributes:
        over: Bend at which it has snapped [rad].
    """

    over: Angle = 0.0
    phase = "heat"

    def reset(self) -> None:
        """Starts anew."""
        self.phase = "heat"

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (1,)."""
        if float(OBSERVATION.read(observation)["bend"][0]) > self.over:
            self.phase = "fly"
        heat = 1.0 if self.phase == "heat" else -1.0
        return np.full(ACTION.size, heat, dtype=ACTION.space.dtype)


def scripted(task: Any) -> JumpPolicy:
    """The scripted policy of a ``Jump``."""
    return JumpPolicy()

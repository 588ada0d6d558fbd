"""Scripted gaits of the tetrapod: which TCA is hot when.

The sequence of the legs is the published one (Sun, Section 6.3.2). All other figures were found by
a search for speed in each task: CMA-ES over period, starts, duties and temperatures, the same for
all legs, 120 to 216 gaits of which each went for half a minute; the walk's on feet of 6 mm.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies.actors import TROT
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.checks import door, require_one_of
from tca_mj.control import Gait
from tca_mj.envs.gaits import OBSERVATION, TASKS
from tca_mj.envs.shapes import OBSERVATION as SHAPED
from tca_mj.envs.stance import LEG_TCAS
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.robots.tetrapod import TetrapodSpec, tetrapod
from tca_mj.tca.spec import heat_of

CRAWL = Gait(
    period=2.9, offset=(0.0,) * 4, start=(0.0, 0.27, 0.63), duty=(0.65, 0.42, 0.49),
    hot=(169.0, 168.0, 168.0), warm=(55.0, 57.0, 53.0),
)  # fmt: skip
"""All four feet run round a loop together, like the flippers of a sea turtle."""

WALK = Gait(
    period=3.2, offset=(0.75, 0.25, 0.0, 0.5), start=(0.09, 0.21, 0.52), duty=(0.37, 0.33, 0.44),
    hot=(167.0, 169.0, 170.0), warm=(81.0, 82.0, 57.0),
)  # fmt: skip
"""An amble: rear left, front left, rear right, front right lift one after the other."""

SHIMMY = Gait(
    period=6.9, offset=(0.0, 0.0, 0.5, 0.5), start=(0.02, 0.15, 0.46), duty=(0.36, 0.36, 0.47),
    hot=(162.0, 170.0, 165.0), warm=(43.0, 28.0, 39.0),
)  # fmt: skip
"""Front and rear pair clamp the beam by turns, like a caterpillar."""

GAITS = MappingProxyType({"crawl": CRAWL, "walk": WALK, "shimmy": SHIMMY})  # by task

# The side that is to be turned to makes shorter strokes. Estimates that hold the direction.
STEERING = {"crawl": 600.0, "walk": 600.0, "shimmy": 0.0}


@door
def gait_policy(gait: str, robot: TetrapodSpec | None = None) -> GaitPolicy:
    """The scripted policy of a task.

    Args:
        gait: ``crawl``, ``walk`` or ``shimmy``.
        robot: The robot it is told that it has, by default the one that is the default everywhere.

    Raises:
        ValueError: If there is no such gait.

    Example:
        >>> import tca_mj
        >>> from tca_mj.agents.scripts import gait_policy
        >>> env = tca_mj.make("TCA/TetrapodWalk-v0", action="power")
        >>> observation, info = env.reset(seed=0)
        >>> gait_policy("walk").act(observation).shape
        (12,)
    """
    require_one_of("gait", gait, list(GAITS))
    heat = heat_of([tca.spec for tca in tetrapod(robot or TetrapodSpec()).tcas[:LEG_TCAS]])
    return GaitPolicy.told_of(TetrapodGait, OBSERVATION, heat, GAITS[gait], STEERING[gait])


class EveryGait:
    """In whatever shape a ``TetrapodShapes`` is, the gait of the task of that shape.

    The crawl is the trot of the script's: diagonal legs half a cycle apart, which is faster.
    """

    phase = "gait"

    @door
    def __init__(self, task: TetrapodGait) -> None:
        """Makes the three.

        Args:
            task: The task.
        """
        self._gaits = dict(GAITS, crawl=replace(CRAWL, offset=TROT))
        self._policies = {
            gait: GaitPolicy.in_task(task, self._gaits[gait], STEERING[gait]) for gait in GAITS
        }

    def reset(self) -> None:
        """Starts anew."""
        for policy in self._policies.values():
            policy.reset()

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action of the gait whose bend is nearest to what is seen."""
        bend = float(SHAPED.read(observation)["body bend"][0])
        nearest = min(GAITS, key=lambda gait: abs(TASKS[gait].bend - bend))
        return self._policies[nearest].act(observation)

    def gait_of(self, task: TetrapodGait) -> Gait:
        """The gait of the shape that a task is in now."""
        return self._gaits[task.gait]


def scripted(task: Any) -> GaitPolicy:
    """The scripted policy of a ``TetrapodGait``."""
    return gait_policy(task.gait)

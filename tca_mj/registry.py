"""The Gymnasium ids of the package.

The tasks live in ``tca_mj.envs``, the last layer but one, and yet ``import tca_mj`` has to make
their ids known. So this file names them as strings, which Gymnasium resolves in ``gymnasium.make``,
and imports nothing but Gymnasium itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium


@dataclass(frozen=True, kw_only=True, slots=True)
class Task:
    """What Gymnasium has to know of a task before its code is loaded.

    Attributes:
        id: Gymnasium id, ``TCA/<Name>-v<n>``.
        entry_point: ``module:class`` of the environment.
        max_episode_steps: Number of control steps after which ``TimeLimit`` truncates.
        kwargs: Arguments of the class that make it this task; a caller's own come on top.
    """

    id: str
    entry_point: str
    max_episode_steps: int
    kwargs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def vector_entry_point(self) -> str:
        """``module:function`` of the vector environment: beside the class, named after it."""
        return f"{self.entry_point}Vector"


TASKS = (
    Task(
        id="TCA/ArmPickPlace-v0",
        entry_point="tca_mj.envs.arm:ArmPickPlace",
        max_episode_steps=1000,
    ),
    Task(
        id="TCA/MorphModule-v0",
        entry_point="tca_mj.envs.morph:MorphModule",
        max_episode_steps=800,
    ),
    Task(
        id="TCA/BendReach-v0",
        entry_point="tca_mj.envs.reach:BendReach",
        max_episode_steps=200,
    ),
    *(
        Task(
            id=f"TCA/Tetrapod{gait.capitalize()}-v0",
            entry_point="tca_mj.envs.tetrapod:TetrapodGait",
            max_episode_steps=600,
            kwargs={"gait": gait},
        )
        for gait in ("crawl", "walk", "shimmy")
    ),
    Task(
        id="TCA/TetrapodCourse-v0",
        entry_point="tca_mj.envs.course:TetrapodCourse",
        max_episode_steps=15000,
    ),
)


def register() -> None:
    """Registers every task that Gymnasium does not know yet; further calls change nothing."""
    for task in TASKS:
        if task.id not in gymnasium.registry:
            gymnasium.register(
                task.id,
                entry_point=task.entry_point,
                vector_entry_point=task.vector_entry_point,
                max_episode_steps=task.max_episode_steps,
                kwargs=dict(task.kwargs),
            )

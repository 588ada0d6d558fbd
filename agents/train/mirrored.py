"""Memories of which half are mirrored, left for right: a robot learns on both sides at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.envs.table import Table


class MirroredReplayBuffer(ReplayBuffer):
    """A replay buffer that gives the first half of every batch as the task's mirror shows it.

    What a robot does is as good when left and right are swapped, where the task's tables say what
    that makes of an observation and of an action. Which memories a batch has is drawn as by
    ``ReplayBuffer``.
    """

    def __init__(self, *args: Any, observation: Table, action: Table, **kwargs: Any) -> None:
        """Takes the arguments of ``ReplayBuffer``, and the tables of a task.

        Args:
            *args: As for ``ReplayBuffer``.
            observation: What is seen.
            action: What is done.
            **kwargs: As for ``ReplayBuffer``.

        Raises:
            ValueError: If the tables know no mirror.
        """
        super().__init__(*args, **kwargs)
        self._observation, self._action = (
            tuple(torch.as_tensor(part, device=self.device) for part in table.mirror)
            for table in (observation, action)
        )

    def _get_samples(self, batch_inds: np.ndarray, env: Any = None) -> ReplayBufferSamples:
        samples = super()._get_samples(batch_inds, env)
        half = len(batch_inds) // 2

        def swapped(rows: torch.Tensor, mirror: tuple[torch.Tensor, ...]) -> torch.Tensor:
            source, sign = mirror
            return torch.cat([rows[:half, source] * sign, rows[half:]])

        return samples._replace(
            observations=swapped(samples.observations, self._observation),
            next_observations=swapped(samples.next_observations, self._observation),
            actions=swapped(samples.actions, self._action),
        )


def mirrored_memory(tasks: TaskVecEnv) -> dict[str, Any]:
    """Arguments of an off-policy learner of Stable-Baselines3 whose memories are mirrored.

        SAC("MlpPolicy", tasks, **mirrored_memory(tasks))

    Args:
        tasks: What it learns in, with scaled observations: running statistics know no mirror.

    Raises:
        ValueError: If observations are not scaled, or the task knows no mirror.
    """
    if not tasks.scaled:
        raise ValueError("tasks must give scaled observations, got scaled=False")
    task = tasks.tasks.envs[0]
    for name, table in (("observation", task.observation), ("action", task.action)):
        if not table.symmetric:
            raise ValueError(f"tasks must know a mirror, got none in the table of its {name}")
    return {
        "replay_buffer_class": MirroredReplayBuffer,
        "replay_buffer_kwargs": {"observation": task.observation, "action": task.action},
    }

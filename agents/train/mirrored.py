"""Memories of which half are mirrored, left for right, and many are told with other commands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.control import Gait
from tca_mj.envs.table import Entry, Table

_RETOLD = 5  # all but one in so many are told anew
_TOGETHER = 0.02  # of a cycle, within which legs are taken to step as in a mirror; an estimate


class MirroredReplayBuffer(ReplayBuffer):
    """A replay buffer that gives the first half of every batch as the task's mirror shows it.

    What a robot does is as good when left and right are swapped, where the task's tables say what
    that makes of an observation and of an action. Which memories a batch has is drawn as by
    ``ReplayBuffer``.

    With ``retelling`` four of five memories come as if another command had been given, which is
    drawn anew each time: what a body does is worth something else then, and no less true. And where
    the tables have a mirror that swaps front and rear, every second memory is shown in that, too:
    who has walked ahead knows how to walk back.
    """

    def __init__(
        self,
        *args: Any,
        observation: Table,
        action: Table,
        retelling: Any = None,
        seed: int = 0,
        **kwargs: Any,
    ) -> None:
        """Takes the arguments of ``ReplayBuffer``, and the tables of a task.

        Args:
            *args: As for ``ReplayBuffer``.
            observation: What is seen, scaled.
            action: What is done.
            retelling: What tells memories with other commands, as ``Retelling``; None for nothing.
            seed: Seed of those commands.
            **kwargs: As for ``ReplayBuffer``, which must not save memory here.

        Raises:
            ValueError: If the tables know no mirror.
        """
        super().__init__(*args, **kwargs)
        self._tables = observation, action
        self._ends = retelling is not None and all(
            any(entry.ends for entry in table.entries) for table in self._tables
        )
        self._retelling, self._random = retelling, np.random.default_rng(seed)
        self._notes = np.zeros((self.buffer_size, self.n_envs, 3))
        self._ways = np.zeros((self.n_envs, 2))  # along and across at the last step

    def begin(self) -> None:
        """All environments begin anew: what they gain counts from there."""
        self._ways[:] = 0.0

    def add(self, obs: Any, next_obs: Any, action: Any, reward: Any, done: Any, infos: Any) -> None:
        """Keeps a step of every environment."""
        if self._retelling is not None:
            noted = np.array([self._retelling.notes(info) for info in infos])
            gained = noted[:, :2] - self._ways
            self._notes[self.pos] = np.column_stack([gained, noted[:, 2]])
            self._ways = np.where(np.asarray(done)[:, None], 0.0, noted[:, :2])
        super().add(obs, next_obs, action, reward, done, infos)

    def _get_samples(self, batch_inds: NDArray[Any], env: Any = None) -> ReplayBufferSamples:
        where = batch_inds, np.random.randint(0, high=self.n_envs, size=len(batch_inds))
        seen, after = self.observations[where], self.next_observations[where]
        reward, done = self.rewards[where], self.dones[where] * (1.0 - self.timeouts[where])
        if self._retelling is not None:
            which = np.arange(len(batch_inds)) % _RETOLD > 0
            seen[which], after[which], reward[which] = self._retelling.told(
                seen[which], after[which], reward[which], self._notes[where][which], self._random
            )
        half = len(batch_inds) // 2

        def mirrored(rows: NDArray[Any], table: Table) -> torch.Tensor:
            rows[:half] = table.mirrored(rows[:half])
            if self._ends:
                source, sign = table.ends
                rows[::2] = rows[::2, source] * sign
            return self.to_torch(rows)

        observation, action = self._tables
        return ReplayBufferSamples(
            observations=mirrored(seen, observation),
            actions=mirrored(self.actions[where], action),
            next_observations=mirrored(after, observation),
            dones=self.to_torch(done.reshape(-1, 1)),
            rewards=self.to_torch(reward.reshape(-1, 1)),
        )


def mirrored_memory(
    tasks: TaskVecEnv, *, retold: bool = False, alike: bool = False, seed: int = 0,
    clock: tuple[int, ...] = (),
) -> dict[str, Any]:  # fmt: skip
    """Arguments of an off-policy learner of Stable-Baselines3 whose memories are mirrored.

        SAC("MlpPolicy", tasks, **mirrored_memory(tasks))

    Args:
        tasks: What it learns in, with scaled observations: running statistics know no mirror.
        retold: Whether memories are also told with other commands.
        alike: Whether actions have a number for each pair of a left and a right one, which are
            then told the same.
        seed: Seed of those commands.
        clock: What the mirror makes of sine and cosine of a gait's phase, as in ``Entry.mirror``,
            where an observation ends with them; see ``clock_mirror``.

    Raises:
        ValueError: If observations are not scaled, or the task knows no mirror or no commands.
    """
    if not tasks.scaled:
        raise ValueError("tasks must give scaled observations, got scaled=False")
    task = tasks.tasks.envs[0]
    for name, table in (("observation", task.observation), ("action", task.action)):
        if not table.symmetric:
            raise ValueError(f"tasks must know a mirror, got none in the table of its {name}")
    seen, action = task.observation, task.action
    if clock:
        seen = Table([*seen.entries, Entry("clock", 2, -1.0, 1.0, "-", mirror=clock)])
    if alike:
        one = Entry("alike", int(action.pairs.max()) + 1, -1.0, 1.0, "-")
        action = Table([replace(one, mirror=tuple(range(1, one.size + 1)))])
    retelling = getattr(task, "retelling", None)
    if retold and retelling is None:
        raise ValueError("tasks must follow commands to be told others, got a task without")
    return {
        "replay_buffer_class": MirroredReplayBuffer,
        "replay_buffer_kwargs": {
            "observation": seen, "action": action,
            "retelling": retelling if retold else None, "seed": seed,
        },
    }  # fmt: skip


def clock_mirror(gait: Gait) -> tuple[int, ...]:
    """What a mirror that swaps left and right makes of sine and cosine of a gait's phase.

    Args:
        gait: A gait whose legs are left and right by turns.

    Returns:
        The same where left and right legs step together, their negatives where they are half a
        cycle apart, as ``Entry.mirror``; empty where they are neither, to within a fiftieth of it.
    """
    left, right = np.array(gait.offset).reshape(-1, 2).T
    for shift, mirror in ((0.0, (1, 2)), (0.5, (-1, -2))):
        off = (right - left - shift + 0.5) % 1.0 - 0.5
        if np.abs(off).max() <= _TOGETHER:
            return mirror
    return ()

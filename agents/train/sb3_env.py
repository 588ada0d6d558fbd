"""The vector environment in the form that Stable-Baselines3 learns from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from tca_mj.checks import door
from tca_mj.envs.task import SimulatedTask
from tca_mj.envs.vector import TaskVector
from tca_mj.registry import episode_steps, find_task, task_class


def silence(model: BaseAlgorithm) -> None:
    """Gives a learner a logger that writes nowhere; its own makes a folder for temporary files."""
    model.set_logger(Logger(folder=None, output_formats=[]))


class TaskVecEnv(VecEnv):
    """Tasks that are stepped together, as a ``VecEnv``.

        env = TaskVecEnv.make("TCA/TetrapodWalk-v0", 8, scaled=True, control_period=0.5)
        model = SAC("MlpPolicy", env)

    It is, bit for bit, ``DummyVecEnv`` over the single tasks: an episode that is over is followed
    by the next one in the same step, with the last observation as ``terminal_observation`` in its
    info and ``TimeLimit.truncated`` where it was cut off. ``VecMonitor`` takes the place of
    ``Monitor``, which wraps single tasks.

    Options of the next reset are set by ``set_options``; those of every reset, also of the ones
    that follow an episode, are the vector environment's ``reset_options``.

    Attributes:
        tasks: The vector environment.
        scaled: Whether observations are scaled.
        practised: Options, on top of those, that every third task is reset with: what is hard.
    """

    @door
    def __init__(self, tasks: TaskVector, *, scaled: bool = False) -> None:
        """Takes a vector environment, whose own autoreset is not used.

        Args:
            tasks: The vector environment.
            scaled: Whether observations come as ``ScaledObservation`` makes them.

        Raises:
            ValueError: If an argument is not of its kind.
        """
        self.tasks, self.scaled = tasks, scaled
        self.practised: dict[str, Any] = {}
        table = tasks.envs[0].observation
        self._seen = table.scaled if scaled else np.asarray
        self._actions = np.zeros(tasks.action_space.shape or (), dtype=np.float32)
        space = table.scaled_space if scaled else tasks.single_observation_space
        super().__init__(tasks.num_envs, space, tasks.single_action_space)

    @classmethod
    def make(
        cls, id: str, num_envs: int, *, scaled: bool = False, **kwargs: Any
    ) -> TaskVecEnv:
        """Makes the vector environment, too.

        Args:
            id: Gymnasium id of a task, or ``module:id``.
            num_envs: Number of tasks.
            scaled: As for the class.
            **kwargs: Other arguments of ``TaskVector`` and of the task.

        Raises:
            ValueError: If the id is of no such task, or as ``TaskVector``.
        """
        limit = kwargs.pop("max_episode_steps", episode_steps(id, kwargs.get("control_period")))
        task, given = task_class(id), {**find_task(id).kwargs, **kwargs}
        tasks = TaskVector(task, num_envs=num_envs, max_episode_steps=limit, **given)
        return cls(tasks, scaled=scaled)

    def reset(self) -> NDArray[np.float32]:
        """Begins new episodes with the seeds and options that were set for this once."""
        begun = [
            self.tasks.restart(i, seed=seed, options=options or self._drill(i))
            for i, (seed, options) in enumerate(zip(self._seeds, self._options, strict=True))
        ]
        self.reset_infos = [info for _, info in begun]
        self._reset_seeds()
        self._reset_options()
        return self._seen(np.stack([observation for observation, _ in begun]))

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keeps the actions for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Steps all tasks, and begins a new episode where one is over; errors as the tasks'."""
        observations, infos = [], []
        rewards, dones = np.zeros(self.num_envs, np.float32), np.zeros(self.num_envs, bool)
        for i, outcome in enumerate(self.tasks.advance(self._actions)):
            assert outcome is not None  # all are stepped
            observation, rewards[i], terminated, truncated, info = outcome
            dones[i] = terminated or truncated
            info["TimeLimit.truncated"] = truncated and not terminated
            if dones[i]:
                info["terminal_observation"] = self._seen(observation)
                observation, self.reset_infos[i] = self.tasks.restart(i, options=self._drill(i))
            observations.append(observation)
            infos.append(info)
        return self._seen(np.stack(observations)), rewards, dones, infos

    def _drill(self, i: int) -> dict[str, Any] | None:
        """Options of the next reset of a task; None for those of every reset."""
        if not self.practised or i % 3:
            return None
        return {**(self.tasks.reset_options or {}), **self.practised}

    def close(self) -> None:
        """Closes the tasks."""
        self.tasks.close()

    def get_images(self) -> Sequence[Any]:
        """The picture of each task; None without a render mode."""
        return self.tasks.render()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the tasks."""
        return [env.get_wrapper_attr(attr_name) for env in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Sets an attribute of the tasks."""
        for env in self._chosen(indices):
            setattr(env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Calls a method of the tasks."""
        methods = [env.get_wrapper_attr(method_name) for env in self._chosen(indices)]
        return [method(*method_args, **kwargs) for method in methods]

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """False for each task: they have no wrappers."""
        return [False for _ in self._chosen(indices)]

    def _chosen(self, indices: VecEnvIndices) -> list[SimulatedTask]:
        return [self.tasks.envs[i] for i in self._get_indices(indices)]

"""n tasks of one kind as one vector environment, whose simulations run together on threads.

    envs = gymnasium.make_vec("TCA/TetrapodWalk-v0", num_envs=8, num_threads=2)

Every task is, bit for bit, what ``gymnasium.make`` gives: the same seeds and actions lead to the
same observations, rewards, flags and infos, at any number of tasks and of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import parse_env_id
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from tca_mj.batch import SimulationBatch
from tca_mj.checks import Count, door, instance, require_one_of, shown, text, whole
from tca_mj.envs.outcome import Observation, Outcome, together
from tca_mj.envs.table import commands
from tca_mj.envs.task import SimulatedTask
from tca_mj.registry import Envs, EpisodeSteps

Options = Mapping[str, Any] | None
Flags = NDArray[np.bool_]
_MODES = [mode.value for mode in AutoresetMode]


class TaskVector(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """Tasks of one kind, stepped together.

    By default an episode that ends is followed by the next one in the same step: the observation
    is the first one of the new episode, the last one of the old is in ``infos["final_obs"]``, its
    info in ``infos["final_info"]``. So every step of every task is a step of its simulation, and
    no action is thrown away. The other modes of Gymnasium are there for programs that want them.

    Attributes:
        envs: The tasks. They can be read and changed between steps.
        num_threads: Threads on which the simulations run.
        max_episode_steps: Steps after which an episode is truncated; None for no limit.
        reset_options: Options of each reset that is given none of its own, as those that begin a
            new episode by themselves; for example ``{"randomise": 0.2}``.
    """

    @door
    def __init__(
        self,
        task: Callable[..., SimulatedTask],
        *,
        num_envs: Envs = 1,
        num_threads: Count | None = None,
        max_episode_steps: EpisodeSteps | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        reset_options: Options = None,
        **kwargs: Any,
    ) -> None:
        """Builds the task once and copies it.

        Args:
            task: Its class.
            num_envs: Number of tasks, 1 to 1024.
            num_threads: Threads of the simulations; None for one for each core that this process
                may use. There are never more than tasks.
            max_episode_steps: Steps after which an episode is truncated; None for no limit.
            autoreset_mode: Gymnasium's mode: ``SameStep``, ``NextStep`` or ``Disabled``.
            reset_options: Options of each reset that is given none of its own.
            **kwargs: Arguments of the task.

        Raises:
            ValueError: If a number is out of bounds, the mode is unknown or the task cannot be
                built.
        """
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        threads = (cores or 1) if num_threads is None else num_threads
        require_one_of("autoreset_mode", getattr(autoreset_mode, "value", autoreset_mode), _MODES)
        first = task(**kwargs)
        self.envs: list[SimulatedTask] = [first, *(deepcopy(first) for _ in range(num_envs - 1))]
        self.num_envs = num_envs
        self.num_threads = min(threads, num_envs)
        self.max_episode_steps = max_episode_steps
        self.reset_options = reset_options
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**first.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = first.render_mode
        self.single_action_space = first.action_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.single_observation_space = first.observation_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._observations = np.zeros(self.observation_space.shape or (), dtype=np.float32)
        self._batch: SimulationBatch | None = None
        self._elapsed = np.full(num_envs, -1)  # steps of the episode, -1 before the first one
        self._over = np.zeros(num_envs, dtype=bool)

    @property
    def batch(self) -> SimulationBatch:
        """What steps the simulations; its threads start when it is first asked for.

        A process that was forked off starts its own.
        """
        if self._batch is None or self._batch.elsewhere:
            sims = [env.sim for env in self.envs]
            self._batch = SimulationBatch(sims, threads=self.num_threads)
        return self._batch

    def restart(
        self, i: int, *, seed: int | None = None, options: Options = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins a new episode of task ``i``, and touches no other; errors as its ``reset``.

        Raises:
            ClosedEnvironmentError: If the environment is closed.
        """
        self._must_be_open()
        whole("i", i, at_least=0, at_most=self.num_envs - 1)
        given = self.reset_options if options is None else options
        instance("options", given, Mapping | None)
        begun = self.envs[i].reset(seed=seed, options=None if given is None else dict(given))
        self._elapsed[i], self._over[i] = 0, False
        return begun

    def advance(
        self, actions: NDArray[np.float32], which: Flags | None = None
    ) -> list[Outcome | None]:
        """Steps tasks, and begins no new episode.

        Args:
            actions: An action for each task, of the shape of ``action_space``.
            which: Which of them are stepped, shape (num_envs,); all by default.

        Returns:
            What the ``step`` of each returns, with the time limit; None for who is not stepped.

        Raises:
            ValueError: If the actions have the wrong shape, are not finite or out of [-1, 1].
            ResetNeeded: If one of the tasks has not been reset.
            ClosedEnvironmentError: If the environment is closed.
        """
        self._must_be_open()
        told = commands("actions", actions, self.action_space.shape or ())
        stepped = np.ones(self.num_envs, dtype=bool) if which is None else which
        if getattr(stepped, "dtype", None) != np.bool_ or stepped.shape != (self.num_envs,):
            raise ValueError(f"which must be {self.num_envs} booleans in one array, got {which!r}")
        if (self._elapsed[stepped] < 0).any():
            raise ResetNeeded("the tasks must be reset before the first step")
        batch, first, going = self.batch, self.envs[0], stepped.copy()
        outcomes: list[Outcome | None] = [None] * self.num_envs
        for _ in range(first.repeats):
            drives = [
                env.drive(command) if go else None
                for env, command, go in zip(self.envs, told, going, strict=True)
            ]
            errors = batch.step(drives, first.interval)
            for i, (env, drive, error) in enumerate(zip(self.envs, drives, errors, strict=True)):
                if drive is not None:
                    now = together(outcomes[i], env.finish(drive, error))
                    outcomes[i], going[i] = now, not (now[2] or now[3])
            if not going.any():
                break
        for i, outcome in enumerate(outcomes):
            if outcome is None:
                continue
            observation, reward, terminated, truncated, info = outcome
            self._elapsed[i] += 1
            if self.max_episode_steps is not None:
                truncated = truncated or bool(self._elapsed[i] >= self.max_episode_steps)
            self._over[i] = terminated or truncated
            outcomes[i] = observation, reward, terminated, truncated, info
        return outcomes

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | Sequence[Options] | None = None,
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins new episodes.

        Args:
            seed: Seed of the first task, of which the others take the next ones; or a seed for
                each; or None.
            options: Options of all resets, or those of each. ``reset_mask`` in the former, shape
                (num_envs,), says who begins a new episode; the others are left where they are.

        Raises:
            ValueError: If there are too few seeds or options, or as the tasks' ``reset``.
            TypeError: If ``reset_mask`` is no array of booleans.
        """
        if isinstance(seed, int | np.integer):
            seed = [whole("seed", seed, at_least=0) + i for i in range(self.num_envs)]
        seeds = self._each("seed", seed)
        mask = np.ones(self.num_envs, dtype=bool)
        if isinstance(options, Mapping) and "reset_mask" in options:
            mask = _mask(options["reset_mask"], self.num_envs)
            options = {key: value for key, value in options.items() if key != "reset_mask"} or None
        given = self._each("options", options)
        infos: dict[str, Any] = {}
        for i in np.flatnonzero(mask).tolist():
            self._observations[i], info = self.restart(i, seed=seeds[i], options=given[i])
            infos = self._add_info(infos, info, i)
        return self._observations.copy(), infos

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float64], Flags, Flags, dict[str, Any]
    ]:  # fmt: skip
        """Steps all tasks, and begins new episodes as ``autoreset_mode`` says.

        Returns:
            Observations, rewards, terminations, truncations and infos in Gymnasium's form: for
            each key an array and, as ``_key``, for whom it holds.

        Raises:
            ValueError: As ``advance``.
            ResetNeeded: As ``advance``; or, without autoreset, if an episode is over.
        """
        mode = self.autoreset_mode
        if mode is AutoresetMode.DISABLED and self._over.any():
            over = np.flatnonzero(self._over).tolist()
            raise ResetNeeded(f"the episodes of the tasks {over} are over; reset them")
        going = ~self._over
        outcomes = self.advance(actions, going)
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), dtype=bool)
        ended: dict[str, Any] = {}
        each = []
        for i, outcome in enumerate(outcomes):
            if outcome is None:  # its episode was over before this step
                observation, info = self.restart(i)
            else:
                observation, rewards[i], terminated[i], truncated[i], info = outcome
                if self._over[i] and mode is AutoresetMode.SAME_STEP:
                    ended = self._add_info(ended, {"final_obs": observation, "final_info": info}, i)
                    observation, info = self.restart(i)
            self._observations[i] = observation
            each.append(info)
        infos = ended | self._gathered(each)
        return self._observations.copy(), rewards, terminated, truncated, infos

    def _gathered(self, infos: Sequence[dict[str, Any]]) -> dict[str, Any]:
        """What ``_add_info`` makes of the infos of all tasks; at once where they have like keys."""
        gathered: dict[str, Any] = {}
        if any(info.keys() != infos[0].keys() for info in infos):
            for i, info in enumerate(infos):
                gathered = self._add_info(gathered, info, i)
            return gathered
        for key, first in infos[0].items():
            values: list[Any] = [info[key] for info in infos]
            if isinstance(first, dict):
                array: Any = self._gathered(values)
            elif type(first) in (bool, int, float) or isinstance(first, np.number):
                array = np.array(values, dtype=type(first))
            elif isinstance(first, np.ndarray):
                array = np.array(values, dtype=first.dtype)
            else:
                array = np.full(self.num_envs, None, dtype=object)
                for i, value in enumerate(values):
                    array[i] = value
            gathered[key], gathered[f"_{key}"] = array, np.ones(self.num_envs, dtype=bool)
        return gathered

    def _each(self, name: str, values: Any) -> list[Any]:
        """One value for each task."""
        if values is None or isinstance(values, Mapping):
            return [values] * self.num_envs
        if not isinstance(values, Sequence | np.ndarray) or len(values) != self.num_envs:
            raise ValueError(f"{name} must be {self.num_envs} of them, got {shown(values)}")
        return list(values)

    def render(self) -> tuple[Any, ...]:
        """The picture of each task, as its ``render``; errors as ``advance``."""
        self._must_be_open()
        return tuple(env.render() for env in self.envs)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Calls a method of each task, or reads an attribute."""
        found = [env.get_wrapper_attr(name) for env in self.envs]
        return tuple(value(*args, **kwargs) if callable(value) else value for value in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each task."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets an attribute of each task: those of a list or tuple, or one value for all.

        Raises:
            ValueError: If a list or tuple does not have a value for each task.
        """
        values = self._each(
            "values", values if isinstance(values, list | tuple) else [values] * self.num_envs
        )
        for env, value in zip(self.envs, values, strict=True):
            env.set_wrapper_attr(name, value)

    @property  # type: ignore[misc]  # to be read only, as in Gymnasium's own vector environments
    def np_random(self) -> Any:
        """The generator of each task."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> Any:
        """The seed of each task's generator."""
        return self.get_attr("np_random_seed")

    def _must_be_open(self) -> None:
        if self.closed:
            raise ClosedEnvironmentError(f"{self.num_envs} tasks were closed; make them anew")

    def close_extras(self, **kwargs: Any) -> None:
        """Closes the tasks and ends the threads."""
        self._batch = None
        for env in self.envs:
            env.close()

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the threads: a copy goes on where this one is."""
        return self.__dict__ | {"_batch": None}


def _mask(mask: Any, size: int) -> Flags:
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"reset_mask must be an array of booleans, got {shown(mask)}")
    if mask.shape != (size,) or not mask.any():
        raise ValueError(f"reset_mask must have shape ({size},) and name a task, got {shown(mask)}")
    return mask


def register_task(
    id: str, task: type[SimulatedTask], *, max_episode_steps: int | None = None, **arguments: Any
) -> None:
    """Makes a task known to Gymnasium, alone and as several in one vector environment.

    Args:
        id: Its Gymnasium id, ``Place/Name-v0``.
        task: Its class.
        max_episode_steps: Number of control steps after which an episode is truncated.
        **arguments: Arguments of the class that make it this task; a caller's own come on top.

    Raises:
        ValueError: If the id is none, or the class no task.
    """
    if not (isinstance(task, type) and issubclass(task, SimulatedTask)):
        raise ValueError(f"task must be a class of a SimulatedTask, got {task!r}")
    try:
        parse_env_id(text("id", id))
    except gym.error.Error as error:
        raise ValueError(f"id must be Place/Name-v0, got {id!r}: {error}") from error
    if max_episode_steps is not None:
        whole("max_episode_steps", max_episode_steps, at_least=1)
    entry: Callable[..., Any] = task
    gym.register(
        id, entry_point=entry, vector_entry_point=partial(TaskVector, task),
        max_episode_steps=max_episode_steps, kwargs=arguments,
    )  # fmt: skip

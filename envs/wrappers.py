"""Wrappers of the tasks: what is added to an environment without changing it."""

from __future__ import annotations

import atexit
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.core import ActType, ObsType
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorWrapper
from gymnasium.vector.utils import batch_space

from tca_mj.checks import door
from tca_mj.envs.outcome import Observation, how_it_ended
from tca_mj.envs.table import Table
from tca_mj.envs.vector import TaskVector
from tca_mj.record import Recorder
from tca_mj.record.recorder import Chunk, Every, Radius


class ScaledObservation(
    gym.ObservationWrapper[Observation, Any, Observation], RecordConstructorArgs
):
    """Observations by the fixed centres and scales of the task's table, of the order of 1.

    What a learner needs, without statistics that a policy has to carry along; the table's units
    say what a number means. Left and right have the same scales.
    """

    @door
    def __init__(self, env: gym.Env[Observation, Any]) -> None:
        """Wraps a task.

        Args:
            env: What ``gymnasium.make`` makes of a task.

        Raises:
            ValueError: If it is no task of this package.
        """
        RecordConstructorArgs.__init__(self)
        gym.ObservationWrapper.__init__(self, env)
        self._table = _table(env.unwrapped)
        self.observation_space = self._table.scaled_space

    def observation(self, observation: Observation) -> Observation:
        """The observation, scaled."""
        return self._table.scaled(observation)


class VectorScaledObservation(VectorWrapper):
    """``ScaledObservation`` of a vector environment, in every autoreset mode."""

    @door
    def __init__(self, env: TaskVector) -> None:
        """Wraps several tasks.

        Args:
            env: What ``gymnasium.make_vec`` makes of a task.

        Raises:
            ValueError: If its tasks are none of this package.
        """
        super().__init__(env)
        self._table = _table(env.envs[0])
        self.single_observation_space = self._table.scaled_space
        self.observation_space = batch_space(self.single_observation_space, env.num_envs)

    def reset(self, **kwargs: Any) -> tuple[Any, dict[str, Any]]:
        """Begins new episodes; arguments as those of what is wrapped."""
        observations, infos = self.env.reset(**kwargs)
        return self._table.scaled(observations), infos

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Steps the tasks; the last observations of episodes that end are scaled, too."""
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        for i, last in enumerate(infos.get("final_obs", ())):
            if last is not None:
                infos["final_obs"][i] = self._table.scaled(last)
        return self._table.scaled(observations), rewards, terminated, truncated, infos


def _table(task: Any) -> Table:
    table = getattr(task, "observation", None)
    if not isinstance(table, Table):
        raise ValueError(f"env must have a table of its observation, got {task}")
    return table


class RecordRerun(gym.Wrapper[ObsType, ActType, ObsType, ActType], RecordConstructorArgs):
    """Records every step of an environment into one ``.rrd`` file.

    The file is made by the first ``reset``; making the wrapper, or making it again from its spec,
    touches no file. Further episodes go on in the same file: recorded time never runs back, and
    the events ``reset`` and ``episode 2, seed 3`` mark the place. Events are also written for
    success and for every other end of an episode, with its reason.

    The file is whole after ``close``, after leaving a ``with`` block by whatever exception, and
    after a program that ends by Ctrl-C or an error; only a process that is killed outright leaves
    it without its table of contents (see ``tca_mj.record.Recorder``).

    Recording never ends an episode. A file that cannot be begun, or that another recorder writes,
    is refused by the first ``reset``; what fails later, as on a full disk, ends the recording
    alone, with a ``RuntimeWarning``. A copy, also by pickle, goes on where this one is and records
    nothing: a file is that of one environment.

    Attributes:
        path: The file.
        recorder: What writes it; None before the first ``reset``, and if nothing is recorded.
        failure: Why nothing is recorded any more; empty if all is well.
        seconds: Time that the recording has taken so far on the caller's thread [s].
    """

    @door
    def __init__(
        self,
        env: gym.Env[ObsType, ActType],
        path: str | Path,
        *,
        application_id: str = "tca-mj",
        every: Every = 1,
        chunk: Chunk = 100,
        tca_radius: Radius | None = None,
        footer: bool = True,
    ) -> None:
        """Wraps ``env``; apart from ``env`` the arguments are those of ``Recorder``.

        Args:
            env: A task of this package: its ``unwrapped`` has the simulation as ``sim``.
            path: File to write, ending in ``.rrd``. What it held is lost at the first ``reset``.
            application_id: Name under which the viewer keeps layouts and groups recordings.
            every: Records every so many-th step, up to every millionth.
            chunk: Recorded steps that are collected before they are written, up to 10 000.
            tca_radius: Radius of the drawn TCAs, at most 1 m [m]; None for one that can be seen.
            footer: Ends the file with a table of contents.

        Raises:
            ValueError: If ``env`` has no simulation or a number is out of bounds.
        """
        if not hasattr(env.unwrapped, "sim"):
            raise ValueError(f"env must have a simulation as env.unwrapped.sim, got {env}")
        options: dict[str, Any] = {
            "application_id": application_id,
            "every": every,
            "chunk": chunk,
            "tca_radius": tca_radius,
            "footer": footer,
        }
        RecordConstructorArgs.__init__(self, path=str(path), **options)
        gym.Wrapper.__init__(self, env)
        self.path = Path(path)
        self.recorder: Recorder | None = None
        self.failure = ""
        self.seconds = 0.0
        self._options = options
        self._episode = 0
        self._closed = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObsType, dict[str, Any]]:
        """Resets the environment and records the beginning of an episode.

        Raises:
            RuntimeError: If the wrapper was closed: a new beginning would overwrite the file.
            ValueError, OSError: As ``Recorder``, if this is the first one.
        """
        self._need_open()
        observation, info = self.env.reset(seed=seed, options=options)
        if self.recorder is None and not self.failure:
            simulation: Any = self.env.unwrapped
            self.recorder = Recorder(simulation.sim, self.path, **self._options)
            atexit.register(self.recorder.close)
        self._episode += 1
        drawn = "" if seed is None else f", seed {seed}"
        with self._recording():
            if self.recorder is not None:
                self.recorder.event(f"episode {self._episode}{drawn}")
                if self._episode > 1:
                    self.recorder.frame()
        return observation, info

    def step(self, action: ActType) -> tuple[ObsType, Any, bool, bool, dict[str, Any]]:
        """Steps the environment and records where that led to.

        Raises:
            RuntimeError: If the wrapper was closed.
        """
        self._need_open()
        observation, reward, terminated, truncated, info = self.env.step(action)
        with self._recording():
            if self.recorder is not None:
                self.recorder.frame(info.get("reward_terms", {"reward": reward}))
                ending = how_it_ended(terminated, truncated, info)
                if ending is not None:
                    self.recorder.event(ending)
        return observation, reward, terminated, truncated, info

    def event(self, text: str) -> None:
        """Writes ``text`` beside the present time.

        Raises:
            RuntimeError: If the environment was not reset yet, or is closed.
        """
        self._need_open()
        if not self._episode:
            raise RuntimeError(f"nothing is recorded to {self.path} before the first reset")
        with self._recording():
            if self.recorder is not None:
                self.recorder.event(text)

    def close(self) -> None:
        """Finishes the file and closes the environment; it may be called again."""
        self._closed = True
        try:
            with self._recording():
                if self.recorder is not None:
                    self.recorder.close()
                    atexit.unregister(self.recorder.close)
        finally:
            self.env.close()

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the file."""
        return self.__dict__ | {"recorder": None, "failure": self.failure or "it is a copy"}

    def _need_open(self) -> None:
        if self._closed:
            raise RuntimeError(f"the recording {self.path} is closed")

    @contextmanager
    def _recording(self) -> Iterator[None]:
        """Takes the time of what is recorded, and ends the recording if that fails."""
        start = time.perf_counter()
        try:
            yield
        except Exception as error:
            broken, self.recorder = self.recorder, None
            self.failure = f"{type(error).__name__}: {error}"
            if broken is not None:
                atexit.unregister(broken.close)
                with suppress(Exception):
                    broken.close()
            warnings.warn(
                f"the recording {self.path} has ended: {self.failure}", RuntimeWarning, stacklevel=4
            )
        finally:
            self.seconds += time.perf_counter() - start

"""Processor time: of a call, of one function inside others, of the physics in a step."""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import mujoco
import numpy as np

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def taken(call: Callable[[], object]) -> float:
    """Processor time of the caller's thread that a call takes [s]."""
    start = time.thread_time()
    call()
    return time.thread_time() - start


def median(call: Callable[[], object], repetitions: int) -> float:
    """Median of the processor time of calls, after one that is not measured [s]."""
    call()
    return float(np.median([taken(call) for _ in range(repetitions)]))


class Timed:
    """A function that adds up the processor time of its calls, ``seconds`` [s]."""

    def __init__(self, plain: Callable[..., Any]) -> None:
        self.seconds, self.plain = 0.0, plain

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        start = time.thread_time()
        try:
            return self.plain(*arguments, **named)
        finally:
            self.seconds += time.thread_time() - start


@contextmanager
def stopwatch(owner: Any, name: str) -> Iterator[Timed]:
    """Times a function of an object while the context lasts."""
    own, timed = name in vars(owner), Timed(getattr(owner, name))
    setattr(owner, name, timed)
    try:
        yield timed
    finally:
        if own:
            setattr(owner, name, timed.plain)
        else:
            delattr(owner, name)


def in_physics() -> AbstractContextManager[Timed]:
    """A stopwatch for the calls of ``mj_step``."""
    return stopwatch(mujoco, "mj_step")


class Replay:
    """The physics steps of an environment's next step, taken beside it in one call of MuJoCo.

    The TCAs are held as they are.

    Attributes:
        count: How many there are in a step of the environment.
    """

    def __init__(self, env: Any) -> None:
        """Takes any environment with ``model``, ``data`` and the time of a step, ``dt`` [s]."""
        self.count = round(env.dt / env.model.opt.timestep)
        self._env, self._beside = env, mujoco.MjData(env.model)
        self._state = np.empty(mujoco.mj_stateSize(env.model, _STATE))

    def keep(self) -> None:
        """Keeps the environment's state."""
        mujoco.mj_getState(self._env.model, self._env.data, self._state, _STATE)

    def seconds(self) -> float:
        """Processor time of the steps from the state that was kept [s]."""
        mujoco.mj_setState(self._env.model, self._beside, self._state, _STATE)
        return taken(lambda: mujoco.mj_step(self._env.model, self._beside, self.count))

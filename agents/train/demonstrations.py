"""First memories of a learner: what a gait or a script does, told as temperatures to hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm

from tca_mj.agents.policies.actors import script_of
from tca_mj.agents.train.mirrored import MirroredReplayBuffer
from tca_mj.agents.train.successes import SuccessReplayBuffer
from tca_mj.control import Gait
from tca_mj.envs.task import SimulatedTask

# What each episode's gait is drawn from, so that memories know more than one way. Estimates: the
# share by which it is faster or slower, and the spread of what is added to actions from -1 to 1.
_HURRY, _NOISE = 0.1, 0.15
# The same of a script, one of them drawn for each episode: some go wrong.
_SPREADS = (0.0, 0.045, 0.09)


def demonstrate(
    model: BaseAlgorithm, tasks: list[SimulatedTask], gait: Callable[[SimulatedTask], Gait],
    steps: int, seed: int, pairs: NDArray[np.int64] | None = None,
) -> None:  # fmt: skip
    """Fills the memory of a new learner with steps of a gait, in place of steps by chance.

    Every episode begins somewhere in the cycle and goes a little faster or slower; every action is
    a little off. What is asked for is the temperature of the gait in the middle of each step.

    Args:
        model: An off-policy learner of Stable-Baselines3 with scaled observations.
        tasks: The tasks that are stepped there, whose actions are temperatures.
        gait: The gait of an episode that a task has just begun.
        steps: Steps of all tasks together.
        seed: Seed of what is drawn.
        pairs: Which number of an action each TCA gets, which asks for the mean of what the gait
            does; None where each has its own.
    """
    random = np.random.default_rng((seed, 2))
    phase, pace = np.zeros(len(tasks)), np.ones(len(tasks))
    gaits: dict[int, Gait] = {}

    def begin(i: int) -> None:
        phase[i], pace[i] = random.uniform(), random.uniform(1.0 - _HURRY, 1.0 + _HURRY)
        gaits[i] = gait(tasks[i])

    def act() -> NDArray[np.float64]:
        actions = np.stack([
            _asked(task, gaits[i], phase[i], pace[i]) for i, task in enumerate(tasks)
        ])  # fmt: skip
        if pairs is not None:
            actions = np.stack([actions[:, pairs == k].mean(axis=1) for k in np.unique(pairs)], 1)
        return actions + _NOISE * random.standard_normal(actions.shape)

    _live(model, len(tasks), begin, act, steps)


def show(model: BaseAlgorithm, tasks: list[SimulatedTask], steps: int, seed: int) -> None:
    """The same with steps of the task's script, which sees and does what a learner does.

    Actions are off by a noise whose spread is drawn for each episode.

    Args:
        model, tasks, steps, seed: As for ``demonstrate``.
    """
    random = np.random.default_rng((seed, 2))
    scripts = [script_of(task) for task in tasks]
    spread = np.zeros((len(tasks), 1))

    def begin(i: int) -> None:
        scripts[i].reset()
        spread[i] = random.choice(_SPREADS)

    def act() -> NDArray[np.float64]:
        each = zip(scripts, tasks, strict=True)
        actions = np.stack([script.act(task.seen()) for script, task in each])
        return actions + spread * random.standard_normal(actions.shape)

    _live(model, len(tasks), begin, act, steps)


def _live(
    model: BaseAlgorithm, count: int, begin: Callable[[int], None],
    act: Callable[[], NDArray[np.float64]], steps: int,
) -> None:  # fmt: skip
    """Fills the memory with what ``act`` does in ``count`` tasks whose episodes ``begin``."""
    env: Any = model.get_env()
    memory: Any = model.replay_buffer  # type: ignore[attr-defined]
    if isinstance(memory, SuccessReplayBuffer):
        memory.begin(showing=True)
    seen = env.reset()
    for i in range(count):
        begin(i)
    while model.num_timesteps < steps:
        actions = np.clip(act(), -1.0, 1.0).astype(np.float32)
        after, rewards, dones, infos = env.step(actions)
        last = after.copy()
        for i in np.flatnonzero(dones).tolist():
            last[i] = infos[i]["terminal_observation"]
            begin(i)
        memory.add(seen, last, actions, rewards, dones, infos)
        seen = after
        model.num_timesteps += count
    if isinstance(memory, MirroredReplayBuffer | SuccessReplayBuffer):
        memory.begin()  # the learner resets the tasks


def _asked(task: SimulatedTask, gait: Gait, phase: float, pace: float) -> NDArray[np.float64]:
    """The action that asks for a gait's temperatures in the middle of the coming step."""
    middle = task.sim.time + 0.5 * task.control_period
    return task.asking(gait.temperature(phase + pace * middle / gait.period))

"""The one loop in which a policy acts in a task."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies import Policy


@dataclass(frozen=True, slots=True)
class Step:
    """What a step has led to; the beginning of an episode is one without a reward.

    Attributes:
        observation: What is seen.
        reward: What it earned.
        terminated, truncated: Whether the episode is over.
        info: What the task says.
    """

    observation: NDArray[np.float32]
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]

    @property
    def over(self) -> bool:
        """Whether it is the last one of the episode."""
        return self.terminated or self.truncated


def rollout(
    env: gym.Env[Any, Any],
    policy: Policy,
    *,
    seed: int | None = None,
    options: Mapping[str, Any] | None = None,
) -> Iterator[Step]:
    """An episode: its beginning, then every step, to its end or until nobody asks for more.

    Args:
        env: The task.
        policy: Who acts; it is reset first.
        seed: Seed of the episode.
        options: Options of the reset.
    """
    policy.reset()
    observation, info = env.reset(seed=seed, options=dict(options) if options else None)
    step = Step(observation, 0.0, False, False, info)
    yield step
    while not step.over:
        observation, reward, terminated, truncated, info = env.step(policy.act(step.observation))
        step = Step(observation, float(reward), terminated, truncated, info)
        yield step

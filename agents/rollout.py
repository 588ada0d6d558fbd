"""The one loop in which a policy acts in a task, and what its steps have earned."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies import Policy
from tca_mj.envs.outcome import how_it_ended


@dataclass(frozen=True, slots=True)
class Step:
    """What a step has led to; the beginning of an episode is one without a reward.

    Attributes:
        observation: What is seen.
        reward: What it earned [1].
        terminated, truncated: Whether the episode is over.
        info: What the task says.
    """

    observation: NDArray[np.float32]
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]

    @property
    def ending(self) -> str:
        """Why the episode is over, in a few words; empty if it goes on."""
        return how_it_ended(self.terminated, self.truncated, self.info) or ""

    def succeeded(self, task: Any) -> bool:
        """Whether a task is done; a gait's is if it has come to the end of its time."""
        whole = self.truncated and "truncation_reason" not in self.info
        return bool(self.info["success"] or (whole and task.legs))


def rollout(
    env: gym.Env[Any, Any],
    policy: Policy,
    *,
    seed: int | None = None,
    options: Mapping[str, Any] | None = None,
    decided: Callable[[], None] = lambda: None,
) -> Iterator[Step]:
    """An episode: its beginning, then every step, to its end or until nobody asks for more.

    Args:
        env: The task.
        policy: Who acts; it is reset first.
        seed: Seed of the episode.
        options: Options of the reset.
        decided: Called when the policy has said what it does and nothing has happened yet. What
            it raises ends the episode, as what the policy raises does.
    """
    policy.reset()
    observation, info = env.reset(seed=seed, options=dict(options) if options else None)
    step = Step(observation, 0.0, False, False, info)
    yield step
    while not (step.terminated or step.truncated):
        action = policy.act(step.observation)
        decided()
        observation, reward, terminated, truncated, info = env.step(action)
        step = Step(observation, float(reward), terminated, truncated, info)
        yield step


def tally(sums: dict[str, float], reward: float, info: Mapping[str, Any]) -> None:
    """Adds to ``return``, ``length`` and each ``term_NAME`` what a step has earned.

    Args:
        sums: The sums so far, which are changed.
        reward: Reward of the step [1].
        info: What the task says of it.
    """
    sums["return"] += float(reward)
    sums["length"] += 1.0
    for name, term in info.get("reward_terms", {}).items():
        sums[f"term_{name}"] += float(term)


def earned(steps: Iterable[Step]) -> dict[str, float]:
    """Sums over a whole episode: ``return``, ``length``, ``success``, each reward term, and the
    ``speed`` [m/s] where there is one.

    Args:
        steps: The steps, as ``rollout`` yields them.
    """
    sums = defaultdict(float, dict.fromkeys(("return", "length", "success"), 0.0))
    for number, step in enumerate(steps):
        sums["success"] = float(step.info["success"])
        if "speed" in step.info:
            sums["speed"] = float(step.info["speed"])
        if number:
            tally(sums, step.reward, step.info)
    return dict(sums)

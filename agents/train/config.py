"""Settings of a training run by deep reinforcement learning, and a default for every task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import Checked, Count, Finite, Positive, number
from tca_mj.registry import task_class

ALGORITHMS = ("ppo", "sac", "td3")

_STEPS = 500_000  # of a run if neither the caller nor the task says: a guess


def _widths(name: str, value: tuple[int, ...]) -> None:
    if not value or min(value) < 1:
        raise ValueError(f"{name} must be widths of at least 1, got {value}")


Discount = Annotated[float, partial(number, above=0.0, at_most=1.0)]
Widths = Annotated[tuple[int, ...], _widths]


@dataclass(frozen=True, kw_only=True, slots=True)
class OnPolicy(Checked):
    """Settings of PPO, under the names of Stable-Baselines3.

    Attributes:
        n_steps: Steps of each environment between two updates.
        batch_size: Of the gradient.
        n_epochs: Passes over what was collected.
        learning_rate: Of Adam [1].
        gamma: Discount per step [1].
        gae_lambda: Of the advantage [1].
        clip_range: Of the probability ratio [1].
        ent_coef: Weight of the entropy [1].
        log_std_init: Logarithm of the standard deviation of the first actions [1].
        hidden: Widths of the hidden layers of actor and critic, with tanh.
    """

    n_steps: Count = 256
    batch_size: Count = 256
    n_epochs: Count = 10
    learning_rate: Positive = 3e-4
    gamma: Discount = 0.99
    gae_lambda: Finite = 0.95
    clip_range: Positive = 0.2
    ent_coef: Finite = 0.0
    log_std_init: Finite = -0.5
    hidden: Widths = (64, 64)


@dataclass(frozen=True, kw_only=True, slots=True)
class OffPolicy(Checked):
    """Settings of SAC and TD3, under the names of Stable-Baselines3.

    Attributes:
        buffer_size: Steps that are remembered.
        learning_starts: Steps with random actions before the first update.
        train_freq: Steps of each environment between two updates.
        gradient_steps: Gradient steps of each update.
        batch_size: Of the gradient.
        learning_rate: Of Adam [1].
        gamma: Discount per step [1].
        tau: Share by which the target network follows [1].
        noise: Standard deviation of TD3's actions [1]; SAC finds its own.
        hidden: Widths of the hidden layers of actor and critics, with ReLU.
    """

    buffer_size: Count = 200_000
    learning_starts: Count = 2000
    train_freq: Count = 1
    gradient_steps: Count = 4
    batch_size: Count = 256
    learning_rate: Positive = 1e-3
    gamma: Discount = 0.98
    tau: Positive = 0.01
    noise: Positive = 0.1
    hidden: Widths = (64, 64)


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainConfig(Checked):
    """Settings of a run.

    Attributes:
        task: Gymnasium id of a task of this package.
        algorithm: One of ``ALGORITHMS``.
        learner: The algorithm's settings.
        steps: Steps of all environments together.
        seed: Seed of everything that is drawn.
        envs: Environments that are stepped together.
        options: Options of every reset, in training and in evaluation.
        arguments: What the task is made with: ``action``, ``control_period``.
        residual: Largest correction of a gait's temperatures, which is what is learned then; 0 for
            a policy of its own [K].
        start: The gait that is corrected: ``scripted``, ``trot``, or a policy's file or name.
        interval: Steps between two rows of the curve, after which the state is written.
        evaluate_every: Intervals between two evaluations.
        evaluation_episodes: Episodes of an evaluation, the same each time.

    Raises:
        ValueError: If a field is out of range or unknown.
    """

    task: str
    algorithm: str
    learner: OnPolicy | OffPolicy
    steps: Count = _STEPS
    seed: int = 0
    envs: Count = 8
    options: Mapping[str, float] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    residual: Annotated[float, partial(number, at_least=0.0, at_most=50.0, unit="K")] = 0.0
    start: str = "scripted"
    interval: Count = 10_000
    evaluate_every: Count = 2
    evaluation_episodes: Count = 5

    def __post_init__(self) -> None:
        task = task_class(self.task)
        Checked.__post_init__(self)
        if self.algorithm not in ALGORITHMS:
            raise ValueError(f"algorithm must be one of {ALGORITHMS}, got {self.algorithm!r}")
        kind = OnPolicy if self.algorithm == "ppo" else OffPolicy
        if not isinstance(self.learner, kind):
            raise ValueError(f"learner must be {kind.__name__}, got {type(self.learner).__name__}")
        if self.residual and not task.legs:
            raise ValueError(f"residual must be 0 for {self.task}, which has no gait")
        if self.residual and self.arguments.get("action") != "power":
            raise ValueError("action must be 'power' where a gait is corrected")


def default_config(task: str, algorithm: str, **change: Any) -> TrainConfig:
    """The default for a task; tried to the end only where the task says in how many steps.

    Args:
        task: Gymnasium id.
        algorithm: One of ``ALGORITHMS``.
        change: Fields of ``TrainConfig`` that differ from it.

    Raises:
        ValueError: If a field is out of range or unknown.
    """
    known = task_class(task)
    arguments = {"action": "power"} if change.get("residual") else known.learning_arguments
    common: dict[str, Any] = {
        "learner": OnPolicy() if algorithm == "ppo" else OffPolicy(),
        "steps": known.learning_steps.get(algorithm, _STEPS),
        "options": dict(known.learning_options),
        "arguments": dict(arguments),
    }
    return TrainConfig(task=task, algorithm=algorithm, **common | change)

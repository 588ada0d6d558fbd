"""Settings of a training run by deep reinforcement learning, and a default for every task."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tca_mj.checks import require_count, require_positive
from tca_mj.registry import task_class

ALGORITHMS = ("ppo", "sac", "td3")

_STEPS = 500_000  # of a run if neither the caller nor the task says: a guess


@dataclass(frozen=True, kw_only=True, slots=True)
class OnPolicy:
    """Settings of PPO, under the names of Stable-Baselines3.

    Attributes:
        n_steps: Steps of each environment between two updates.
        batch_size: Of the gradient.
        n_epochs: Passes over what was collected.
        learning_rate: Of Adam.
        gamma: Discount per step.
        gae_lambda: Of the advantage.
        clip_range: Of the probability ratio.
        ent_coef: Weight of the entropy.
        log_std_init: Logarithm of the standard deviation of the first actions.
        hidden: Widths of the hidden layers of actor and critic, with tanh.
    """

    n_steps: int = 256
    batch_size: int = 256
    n_epochs: int = 10
    learning_rate: float = 3e-4
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    log_std_init: float = -0.5
    hidden: tuple[int, ...] = (64, 64)

    def __post_init__(self) -> None:
        require_count(n_steps=self.n_steps, batch_size=self.batch_size, n_epochs=self.n_epochs)
        require_positive(learning_rate=self.learning_rate, clip_range=self.clip_range)
        _require(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class OffPolicy:
    """Settings of SAC and TD3, under the names of Stable-Baselines3.

    Attributes:
        buffer_size: Steps that are remembered.
        learning_starts: Steps with random actions before the first update.
        train_freq: Steps of each environment between two updates.
        gradient_steps: Gradient steps of each update.
        batch_size: Of the gradient.
        learning_rate: Of Adam.
        gamma: Discount per step.
        tau: Share by which the target network follows.
        noise: Standard deviation of TD3's actions; SAC finds its own.
        hidden: Widths of the hidden layers of actor and critics, with ReLU.
    """

    buffer_size: int = 200_000
    learning_starts: int = 2000
    train_freq: int = 1
    gradient_steps: int = 4
    batch_size: int = 256
    learning_rate: float = 1e-3
    gamma: float = 0.98
    tau: float = 0.01
    noise: float = 0.1
    hidden: tuple[int, ...] = (64, 64)

    def __post_init__(self) -> None:
        require_count(
            buffer_size=self.buffer_size, learning_starts=self.learning_starts,
            train_freq=self.train_freq, gradient_steps=self.gradient_steps,
            batch_size=self.batch_size,
        )  # fmt: skip
        require_positive(learning_rate=self.learning_rate, tau=self.tau, noise=self.noise)
        _require(self)


def _require(settings: OnPolicy | OffPolicy) -> None:
    if not 0.0 < settings.gamma <= 1.0:
        raise ValueError(f"gamma must be above 0 and at most 1, got {settings.gamma}")
    if not settings.hidden or min(settings.hidden) < 1:
        raise ValueError(f"hidden must be widths of at least 1, got {settings.hidden}")


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainConfig:
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
    steps: int = _STEPS
    seed: int = 0
    envs: int = 8
    options: Mapping[str, float] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    residual: float = 0.0
    start: str = "scripted"
    interval: int = 10_000
    evaluate_every: int = 2
    evaluation_episodes: int = 5

    def __post_init__(self) -> None:
        task = task_class(self.task)
        if self.algorithm not in ALGORITHMS:
            raise ValueError(f"algorithm must be one of {ALGORITHMS}, got {self.algorithm!r}")
        kind = OnPolicy if self.algorithm == "ppo" else OffPolicy
        if not isinstance(self.learner, kind):
            raise ValueError(f"learner must be {kind.__name__}, got {type(self.learner).__name__}")
        require_count(
            steps=self.steps, envs=self.envs, interval=self.interval,
            evaluate_every=self.evaluate_every, evaluation_episodes=self.evaluation_episodes,
        )  # fmt: skip
        if not 0.0 <= self.residual <= 50.0:
            raise ValueError(f"residual must be between 0 and 50 K, got {self.residual}")
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
    learner: OnPolicy | OffPolicy = OnPolicy() if algorithm == "ppo" else OffPolicy()
    common: dict[str, Any] = {"task": task, "algorithm": algorithm, "learner": learner}
    known = task_class(task)
    common["steps"] = known.learning_steps.get(algorithm, _STEPS)
    common["options"] = dict(known.learning_options)
    residual = {"action": "power"} if change.get("residual") else known.learning_arguments
    common["arguments"] = dict(residual)
    return TrainConfig(**common | change)

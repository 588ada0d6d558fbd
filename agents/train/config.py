"""Settings of a training run by deep reinforcement learning, and a default for every task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import Checked, Share, door, number, require_one_of, shown, whole
from tca_mj.registry import Envs, task_class

ALGORITHMS = ("ppo", "sac", "td3")

_STEPS = 500_000  # of a run if neither the caller nor the task says: a guess


def _widths(name: str, value: Any) -> tuple[int, ...]:
    if not isinstance(value, tuple | list) or not 1 <= len(value) <= 16:
        raise ValueError(f"{name} must be 1 to 16 widths, got {shown(value)}")
    return tuple(whole(name, width, at_least=1, at_most=10_000) for width in value)


# No run takes more; what is beyond is a slip.
Part = Annotated[float, partial(number, above=0.0, at_most=1.0)]
Few = Annotated[int, partial(whole, at_least=1, at_most=10_000)]
Many = Annotated[int, partial(whole, at_least=1, at_most=1_000_000)]
Buffer = Annotated[int, partial(whole, at_least=1, at_most=10_000_000)]  # 6 GB of the largest task
Steps = Annotated[int, partial(whole, at_least=1, at_most=1_000_000_000)]
LearnerSeed = Annotated[int, partial(whole, at_least=0, at_most=2**32 - 1)]  # NumPy's old generator
Widths = Annotated[tuple[int, ...], _widths]


@dataclass(frozen=True, kw_only=True, slots=True)
class OnPolicy(Checked):
    """Settings of PPO, under the names of Stable-Baselines3.

    Attributes:
        n_steps: Steps of each environment between two updates, up to a million.
        batch_size: Of the gradient, up to a million.
        n_epochs: Passes over what was collected, up to 10 000.
        learning_rate: Of Adam, above 0 up to 1 [1].
        gamma: Discount per step, above 0 up to 1 [1].
        gae_lambda: Of the advantage, 0 to 1 [1].
        clip_range: Of the probability ratio, above 0 up to 1 [1].
        ent_coef: Weight of the entropy, -10 to 10 [1].
        log_std_init: Logarithm of the standard deviation of the first actions, -20 to 2 [1].
        hidden: Widths of the up to 16 hidden layers of actor and critic, with tanh; up to 10 000.

    Raises:
        ValueError: If a field is out of bounds.
    """

    n_steps: Many = 256
    batch_size: Many = 256
    n_epochs: Few = 10
    learning_rate: Part = 3e-4
    gamma: Part = 0.99
    gae_lambda: Share = 0.95
    clip_range: Part = 0.2
    ent_coef: Annotated[float, partial(number, at_least=-10.0, at_most=10.0)] = 0.0
    log_std_init: Annotated[float, partial(number, at_least=-20.0, at_most=2.0)] = -0.5
    hidden: Widths = (64, 64)


@dataclass(frozen=True, kw_only=True, slots=True)
class OffPolicy(Checked):
    """Settings of SAC and TD3, under the names of Stable-Baselines3.

    Attributes:
        buffer_size: Steps that are remembered, up to ten million.
        learning_starts: Steps with random actions before the first update, up to a billion.
        train_freq: Steps of each environment between two updates, up to a million.
        gradient_steps: Gradient steps of each update, up to 10 000.
        batch_size: Of the gradient, up to a million.
        learning_rate: Of Adam, above 0 up to 1 [1].
        gamma: Discount per step, above 0 up to 1 [1].
        tau: Share by which the target network follows, above 0 up to 1 [1].
        noise: Standard deviation of TD3's actions, above 0 up to 1 [1]; SAC finds its own.
        hidden: Widths of the up to 16 hidden layers of actor and critics, with ReLU; up to 10 000.

    Raises:
        ValueError: If a field is out of bounds.
    """

    buffer_size: Buffer = 200_000
    learning_starts: Steps = 2000
    train_freq: Many = 1
    gradient_steps: Few = 4
    batch_size: Many = 256
    learning_rate: Part = 1e-3
    gamma: Part = 0.98
    tau: Part = 0.01
    noise: Part = 0.1
    hidden: Widths = (64, 64)


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainConfig(Checked):
    """Settings of a run.

    Attributes:
        task: Gymnasium id of a task of this package.
        algorithm: One of ``ALGORITHMS``.
        learner: The algorithm's settings.
        steps: Steps of all environments together, up to a billion.
        seed: Seed of everything that is drawn, below 2**32.
        envs: Environments that are stepped together, up to 1024.
        options: Options of every reset, in training and in evaluation.
        arguments: What the task is made with: ``action``, ``control_period``.
        residual: Largest correction of a gait's temperatures, which is what is learned then; 0 for
            a policy of its own [K].
        start: The gait that is corrected: ``scripted``, ``trot``, or a policy's file or name.
        interval: Steps between two rows of the curve, after which the state is written, up to a
            billion.
        evaluate_every: Intervals between two evaluations, up to a million.
        evaluation_episodes: Episodes of an evaluation, the same each time, up to 10 000.

    Raises:
        ValueError: If a field is out of range or unknown.
    """

    task: str
    algorithm: str
    learner: OnPolicy | OffPolicy
    steps: Steps = _STEPS
    seed: LearnerSeed = 0
    envs: Envs = 8
    options: Mapping[str, float] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    residual: Annotated[float, partial(number, at_least=0.0, at_most=50.0, unit="K")] = 0.0
    start: str = "scripted"
    interval: Steps = 10_000
    evaluate_every: Many = 2
    evaluation_episodes: Few = 5

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        task = task_class(self.task)
        require_one_of("algorithm", self.algorithm, ALGORITHMS)
        kind = OnPolicy if self.algorithm == "ppo" else OffPolicy
        if not isinstance(self.learner, kind):
            raise ValueError(f"learner must be {kind.__name__}, got {self.learner!r}")
        if self.residual and not task.legs:
            raise ValueError(
                f"residual must be 0 for {self.task}, which has no gait, got {self.residual}"
            )
        if self.residual and self.arguments.get("action") != "power":
            raise ValueError(
                "arguments['action'] must be 'power' where a gait is corrected, got"
                f" {shown(self.arguments)}"
            )


@door
def default_config(task: str, algorithm: str, **change: Any) -> TrainConfig:
    """The default for a task; tried to the end only where the task says in how many steps.

    Args:
        task: Gymnasium id.
        algorithm: One of ``ALGORITHMS``.
        change: Fields of ``TrainConfig`` that differ from it.

    Raises:
        ValueError: If a field is out of range or unknown.
    """
    for name in change:
        require_one_of("change", name, [field.name for field in fields(TrainConfig)])
    known = task_class(task)
    arguments = {"action": "power"} if change.get("residual") else known.learning_arguments
    common: dict[str, Any] = {
        "learner": OnPolicy() if algorithm == "ppo" else OffPolicy(),
        "steps": known.learning_steps.get(algorithm, _STEPS),
        "options": dict(known.learning_options),
        "arguments": dict(arguments),
    }
    return TrainConfig(task=task, algorithm=algorithm, **common | change)

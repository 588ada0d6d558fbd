"""Settings of a training run by deep reinforcement learning, and a default for every task."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Annotated, Any

from tca_mj.agents.design import robot_of
from tca_mj.checks import Checked, Positive, Share, door, number, require_one_of, shown, whole
from tca_mj.envs.recipe import HELD, Recipe
from tca_mj.registry import DEEP, Envs, recipes, task_class

_STEPS = 500_000  # of a run if neither the caller nor the task says: a guess


def _widths(name: str, value: Any) -> tuple[int, ...]:
    if not isinstance(value, tuple | list) or not 1 <= len(value) <= 16:
        raise ValueError(f"{name} must be 1 to 16 widths, got {shown(value)}")
    return tuple(whole(name, width, at_least=1, at_most=10_000) for width in value)


def _entropy(name: str, value: Any) -> float | str:
    if not isinstance(value, str):
        return number(name, value, at_least=0.0, at_most=10.0)
    first = value.removeprefix("auto").removeprefix("_") or "1"
    if not value.startswith("auto") or not re.fullmatch(r"[0-9]{1,3}(\.[0-9]{1,9})?", first):
        raise ValueError(f"{name} must be a number, 'auto' or 'auto_0.1', got {shown(value)}")
    return value


def _target(name: str, value: Any) -> float | str:
    return value if value == "auto" else number(name, value, at_least=-1000.0, at_most=1000.0)


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
    """Settings of SAC, TD3, TQC and CrossQ, under the names of Stable-Baselines3.

    Attributes:
        buffer_size: Steps that are remembered, up to ten million.
        learning_starts: Steps with random actions before the first update, up to a billion.
        train_freq: Steps of each environment between two updates, up to a million.
        gradient_steps: Gradient steps of each update, up to 10 000.
        batch_size: Of the gradient, up to a million.
        learning_rate: Of Adam, above 0 up to 1 [1].
        last_rate: Share of it that is left at the end, to which it falls by and by, above 0 up to
            1 [1].
        gamma: Discount per step, above 0 up to 1 [1].
        tau: Share by which the target network follows, above 0 up to 1 [1]; CrossQ has none.
        ent_coef: Weight of the entropy, 0 to 10 [1]; or ``auto``, or ``auto_`` and the weight to
            begin with. TD3 has none.
        target_entropy: Entropy of an action that ``auto`` aims at, -1000 to 1000, or ``auto`` for
            minus the numbers of an action [1].
        n_steps: Steps whose rewards a memory adds up, up to 10 000; 1 with mirrored memories.
        imitation: Weight of what was shown where half of each batch is from there, 0 to 1000, see
            ``tca_mj.agents.train.successes`` [1].
        last_imitation: Share of it that is left at the end, to which it falls by and by [1].
        steady: Whether the actor's mean drives every second environment, without noise, whose
            quicker successes alone are imitated; only where something is shown.
        critics: How many there are, 2 to 100; more than 2 only where something is shown.
        use_sde: Whether noise depends on what is seen (gSDE); not of TD3.
        noise: Standard deviation of TD3's actions, above 0 up to 1 [1]; the others find their own.
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
    last_rate: Part = 1.0
    gamma: Part = 0.98
    tau: Part = 0.01
    ent_coef: Annotated[float | str, _entropy] = "auto"
    target_entropy: Annotated[float | str, _target] = "auto"
    n_steps: Few = 1
    imitation: Annotated[float, partial(number, at_least=0.0, at_most=1000.0)] = 0.0
    last_imitation: Share = 0.02
    steady: bool = False
    critics: Annotated[int, partial(whole, at_least=2, at_most=100)] = 2
    use_sde: bool = False
    noise: Part = 0.1
    hidden: Widths = (64, 64)


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainConfig(Checked):
    """Settings of a run.

    Attributes:
        task: Gymnasium id of a task of this package.
        algorithm: One of ``tca_mj.registry.DEEP``.
        learner: The algorithm's settings.
        steps: Steps of all environments together, up to a billion.
        seed: Seed of everything that is drawn, below 2**32.
        envs: Environments that are stepped together, up to 1024.
        options: Options of every reset, in training and in evaluation.
        arguments: What the task is made with: ``action``, ``control_period``, ``tca``.
        design: Figures of the robot that differ from the default, see
            ``tca_mj.agents.design.robot_of``.
        timestep: Physics time step in training; None for the task's own, which evaluations have in
            any case [s].
        scaled: Whether observations are scaled by the task's table; otherwise they and the rewards
            are normalised by running statistics.
        mirrored: Whether half of each batch of memories is mirrored, left for right.
        alike: Whether left and right TCAs are told the same: an action has a number for each pair.
        centred: Whether rewards count from the mean of the gait's first steps, near which a critic
            that knows nothing begins.
        retold: Whether memories are also told with other commands, and mirrored front for rear.
        growth: Options that grow from 0 to their value, and in how many steps: a robot first learns
            to get on, then wherever it is told.
        residual: Largest correction of a gait's temperatures, which is what is learned then; 0 for
            a policy of its own [K].
        start: The gait that is corrected, or else that makes the first steps, which memories are
            filled with before anything is learned: ``scripted``, ``trot``, or a policy's file or
            name; ``random`` for steps by chance. A task without legs knows ``scripted``.
        successes: Whether half of each batch of memories is from the script's episodes that
            succeeded. The best policy is then the one that earns most, discounted over the time
            that an episode took.
        practised: Options, on top of ``options``, that every third environment is reset with.
        limit: Duration after which episodes are cut off in the run; None for the task's own [s].
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
    options: Mapping[str, float | str] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    design: Mapping[str, Any] = field(default_factory=dict)
    timestep: Positive | None = None
    scaled: bool = False
    mirrored: bool = False
    alike: bool = False
    centred: bool = False
    retold: bool = False
    growth: Mapping[str, Steps] = field(default_factory=dict)
    residual: Annotated[float, partial(number, at_least=0.0, at_most=100.0, unit="K")] = 0.0
    start: str = "random"
    successes: bool = False
    practised: Mapping[str, Any] = field(default_factory=dict)
    limit: Positive | None = None
    interval: Steps = 10_000
    evaluate_every: Many = 2
    evaluation_episodes: Few = 5

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        task = task_class(self.task)
        require_one_of("algorithm", self.algorithm, DEEP)
        kind = OnPolicy if self.algorithm == "ppo" else OffPolicy
        if not isinstance(self.learner, kind):
            raise ValueError(f"learner must be {kind.__name__}, got {self.learner!r}")
        if self.mirrored and not (self.scaled and kind is OffPolicy):
            raise ValueError(
                f"mirrored must be False without memories of scaled observations, got True for"
                f" {self.algorithm}"
            )
        if self.retold and not self.mirrored:
            raise ValueError("retold must be False where memories are not mirrored, got True")
        if not isinstance(self.arguments.get("tca", ""), str):
            raise ValueError(
                "arguments['tca'] must be a name or a file, to be found again when a run goes on,"
                f" got {shown(self.arguments['tca'])}"
            )
        if self.design:
            robot_of(self.task, self.design)
        for name in self.growth:
            require_one_of("growth", name, list(self.options))
        if self.successes and not (self.scaled and self.algorithm == "sac" and not self.mirrored):
            raise ValueError(
                "successes must be False but for SAC with memories of scaled observations that are"
                f" not mirrored, got True for {self.algorithm}"
            )
        if kind is OffPolicy:
            imitation, n_steps = self.learner.imitation, self.learner.n_steps  # type: ignore[union-attr]
            if imitation and not self.successes:
                raise ValueError(f"learner.imitation must be 0 without successes, got {imitation}")
            if self.learner.steady and not self.successes:  # type: ignore[union-attr]
                raise ValueError("learner.steady must be False without successes, got True")
            critics = self.learner.critics  # type: ignore[union-attr]
            if critics != 2 and not self.successes:
                raise ValueError(f"learner.critics must be 2 without successes, got {critics}")
            if n_steps > 1 and (self.mirrored or self.algorithm == "crossq"):
                raise ValueError(
                    f"learner.n_steps must be 1 for CrossQ and mirrored memories, got {n_steps}"
                )
        if self.successes and self.start == "random":
            raise ValueError("successes must be False where no script is shown, got True")
        if self.residual and not task.legs:
            raise ValueError(
                f"residual must be 0 for {self.task}, which has no gait, got {self.residual}"
            )
        if self.residual and self.start == "random":
            raise ValueError("start must be a gait where one is corrected, got 'random'")
        if not self.residual and self.start != "random":
            known = task.legs or (task.script_holds and self.start == "scripted")
            if not known or kind is OnPolicy or not self.scaled:
                raise ValueError(
                    "start must be 'random' but for a task with legs, or with a script that tells"
                    " temperatures, and memories of scaled observations, got"
                    f" {shown(self.start)} for {self.task} and {self.algorithm}"
                )
            if self.arguments.get("action", "temperature") != "temperature":
                raise ValueError(
                    "arguments['action'] must be 'temperature' where a gait makes the first steps,"
                    f" got {shown(self.arguments)}"
                )
        if self.alike and (self.retold or not self.mirrored):
            raise ValueError(
                "alike must be False where memories are not mirrored or are told with other"
                " commands, got True"
            )
        if self.retold and self.residual:
            raise ValueError("retold must be False where a gait is corrected, got True")
        if self.centred and (self.residual or self.start == "random"):
            raise ValueError("centred must be False where no gait makes the first steps, got True")
        power = self.arguments.get("action", "temperature") == "power"
        if self.residual and self.scaled == power:
            raise ValueError(
                "scaled must be True where a gait's temperatures are asked for and corrected, False"
                f" where they are held by power, got {self.scaled}"
            )

    @property
    def made_with(self) -> dict[str, Any]:
        """What the task is made with: ``arguments``, and the robot of ``design``."""
        robot = robot_of(self.task, self.design) if self.design else {}
        return {**self.arguments, **robot}


@door
def default_config(task: str, algorithm: str | None = None, **change: Any) -> TrainConfig:
    """The default for a task: its recipe, where it has one for the algorithm.

    Args:
        task: Gymnasium id.
        algorithm: One of ``tca_mj.registry.DEEP``; None for the one that is best for the task,
            as far as that was tried.
        change: Fields of ``TrainConfig`` that differ from it. ``options`` and ``arguments`` come on
            top of the recipe's; with another control period the discount per step follows.

    Raises:
        ValueError: If a field is out of range or unknown.
    """
    for name in change:
        require_one_of("change", name, [field.name for field in fields(TrainConfig)])
    known = task_class(task)
    algorithm = algorithm or best_algorithm(task)
    recipe = recipes(task).get(algorithm, Recipe(steps=_STEPS)).given(change.get("options", {}))
    if change.get("residual"):
        recipe = _correcting(recipe, algorithm)
    asked = {**change.pop("arguments", {})}
    arguments = {"action": recipe.action, **recipe.arguments} | asked
    period = asked.get("control_period") or recipe.control_period
    if period is not None:
        arguments["control_period"] = period
    learner = dict(recipe.learner)
    if recipe.discount is not None:
        learner["gamma"] = recipe.discount ** (period or known.control_period)
    options = {**recipe.options, **change.pop("options", {})}
    growing = {name: steps for name, steps in recipe.growth.items() if options.get(name)}
    common: dict[str, Any] = {
        "learner": (OnPolicy if algorithm == "ppo" else OffPolicy)(**learner),
        "steps": recipe.steps,
        "options": options,
        "arguments": arguments,
        "timestep": recipe.timestep,
        "start": recipe.start,
        "scaled": recipe.scaled,
        "mirrored": recipe.mirrored,
        "alike": recipe.alike and not growing,
        "centred": recipe.centred and change.get("start", recipe.start) != "random",
        "retold": recipe.mirrored and bool(growing),
        "growth": growing,
        "successes": recipe.successes,
        "practised": {k: v for k, v in recipe.practised.items() if k not in options},
        "limit": recipe.limit,
    }
    own = {"interval": recipe.interval, "evaluation_episodes": recipe.episodes}
    common |= {name: value for name, value in own.items() if value is not None}
    return TrainConfig(task=task, algorithm=algorithm, **common | change)


def _correcting(recipe: Recipe, algorithm: str) -> Recipe:
    """How a gait is corrected in a task that is learned from nothing by ``recipe``."""
    if algorithm == "ppo":
        return Recipe(
            steps=recipe.steps, action="power", options=recipe.options, start="scripted"
        )
    return Recipe.held(
        10_000, 0.2, discount=0.8, start="scripted", timestep=recipe.timestep, episodes=8,
        options=recipe.options, mirrored=recipe.mirrored, alike=recipe.alike,
        learner={**HELD, "ent_coef": "auto_0.02", "target_entropy": -18.0},
    )  # fmt: skip


def best_algorithm(task: str) -> str:
    """The algorithm that is best for a task, as far as that was tried; errors as ``task_class``."""
    return next(iter(recipes(task)), DEEP[0])


def described(config: TrainConfig) -> str:
    """What is about to be learned and how, in a line or two.

    Args:
        config: The settings.
    """
    task = task_class(config.task)
    period = config.arguments.get("control_period") or task.control_period
    power = config.arguments.get("action") == "power"
    words = [
        f"{config.task}: {config.algorithm.upper()}, {config.steps} steps",
        f"{'power' if power else 'temperatures'} held for {period:g} s",
        *([f"physics at {1e3 * config.timestep:g} ms"] if config.timestep else []),
        *(["scaled observations"] if config.scaled else []),
        *(["mirrored memories"] if config.mirrored else []),
        *(["left and right told the same"] if config.alike else []),
        *(["rewards from the gait's on"] if config.centred else []),
        *(["told with other commands"] if config.retold else []),
        *([f"the gait '{config.start}' corrected by at most {config.residual:g} K"]
          if config.residual
          else [f"first steps by the gait '{config.start}'"]
          if config.start != "random" and task.legs
          else ["first steps by the script"] if config.start != "random" else []),
        *(["half of each batch what that did with success"] if config.successes else []),
        *(f"{name} grown in {steps} steps" for name, steps in config.growth.items()),
        *(f"{name} {value}" for name, value in config.options.items()),
        *(f"{name} {value} practised" for name, value in config.practised.items()),
        f"{config.envs} environments", f"seed {config.seed}",
    ]  # fmt: skip
    text = ", ".join(words)
    recipe = recipes(config.task).get(config.algorithm)
    if power and period < 0.3 and not config.residual and not (recipe and recipe.action == "power"):
        text += (
            f"\nwarning: power that changes every {period:g} s is noise to a TCA, which takes"
            " seconds: nothing is explored, and half the power, where policies begin, overheats."
            "\nTemperatures that are held for 0.4 to 1 s are learned"
        )
    return text

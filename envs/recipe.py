"""How a task is learned: what was tried, as data that a trainer takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import Checked, Positive, door, number, whole
from tca_mj.registry import ControlPeriod

_Steps = Annotated[int, partial(whole, at_least=1, at_most=1_000_000_000)]
_Discount = Annotated[float, partial(number, above=0.0, at_most=1.0)]

# The best of what was tried on gaits: docs/gaits.md.
HELD: Mapping[str, Any] = {
    "learning_rate": 1e-3, "last_rate": 0.1, "batch_size": 256, "tau": 0.01,
    "ent_coef": "auto_0.05", "learning_starts": 1200, "gradient_steps": 8, "hidden": (128, 128),
    "buffer_size": 50_000,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class Recipe(Checked):
    """How an algorithm learns a task.

    Attributes:
        steps: Steps of all environments together after which it was learned, up to a billion.
        control_period: Time of a step; None for the task's own [s].
        action: What the TCAs are told, as in ``TaskArguments``.
        timestep: Physics time step in training; None for the task's own, with which what was
            learned is evaluated in any case [s].
        options: Options of every reset.
        scaled: Whether observations are scaled by the table; otherwise they, and the rewards, are
            normalised by running statistics.
        mirrored: Whether half of each batch of memories is mirrored, left for right.
        alike: Whether left and right are told the same, so that there is half as much to learn;
            not while commands grow.
        centred: Whether rewards count from the mean of a gait's first steps.
        growth: Options that grow from 0 to the value that is given, and in how many steps. With one
            of them memories are also told with other commands, and mirrored front for rear.
        grown: Fields of this that are others where one of them is given.
        alone: The same where an option has a value, as ``{"object=pcb": {"steps": 20_000}}``; what
            of ``learner`` is named there comes on top of it.
        discount: What a reward is worth that comes a second later, above 0 up to 1; None for the
            learner's own, per step [1].
        start: Whose steps come first in the memory: those of a gait or script, as in
            ``TrainConfig``, or "random".
        successes: Whether half of each batch of memories is from the script's successes.
        practised: Options that every third environment is reset with.
        limit: Duration after which episodes are cut off in the run; None for the task's own [s].
        arguments: What else the task is made with, by name.
        episodes: Episodes of an evaluation; None for the trainer's own.
        learner: What else differs from the algorithm's defaults, under the names of
            Stable-Baselines3.
        interval: Steps between two points of the learning curve; None for the trainer's own.

    Raises:
        ValueError: If a field is out of bounds.
    """

    steps: _Steps
    control_period: ControlPeriod | None = None
    action: str = "temperature"
    timestep: Positive | None = None
    options: Mapping[str, float] = field(default_factory=dict)
    scaled: bool = False
    mirrored: bool = False
    alike: bool = False
    centred: bool = False
    growth: Mapping[str, int] = field(default_factory=dict)
    grown: Mapping[str, Any] = field(default_factory=dict)
    alone: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    discount: _Discount | None = None
    start: str = "random"
    successes: bool = False
    practised: Mapping[str, Any] = field(default_factory=dict)
    limit: Positive | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    episodes: _Steps | None = None
    learner: Mapping[str, Any] = field(default_factory=dict)
    interval: _Steps | None = None

    @door
    def given(self, options: Mapping[str, Any]) -> Recipe:
        """The recipe where options are given.

        Args:
            options: Their values, by name.

        Raises:
            ValueError: If ``options`` is no mapping.
        """
        found = self
        if any(options.get(name) for name in self.growth):
            found = replace(found, **self.grown)
        for case, fields in self.alone.items():
            name, _, value = case.partition("=")
            if str(options.get(name)) == value:
                learner = {**found.learner, **fields.get("learner", {})}
                found = replace(found, **{**fields, "learner": learner})
        return found

    @classmethod
    @door
    def held(cls, steps: int, control_period: float, **more: Any) -> Recipe:
        """SAC that tells temperatures and lets them be reached: what the gaits are learned by.

        Args:
            steps: Steps of all environments together.
            control_period: For which an action is held [s].
            **more: What else the recipe says.

        Raises:
            ValueError: If a field is out of bounds.
        """
        usual = {"discount": 0.94, "interval": 1000, "learner": HELD}
        return cls(steps=steps, control_period=control_period, scaled=True, **{**usual, **more})

"""How a task is learned: what was tried, as data that a trainer takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import Checked, Positive, number, whole
from tca_mj.registry import ControlPeriod

_Steps = Annotated[int, partial(whole, at_least=1, at_most=1_000_000_000)]
_Discount = Annotated[float, partial(number, above=0.0, at_most=1.0)]


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
        growth: Options that grow from 0 to the value that is given, and in how many steps. With one
            of them memories are also told with other commands, and mirrored front for rear.
        discount: What a reward is worth that comes a second later, above 0 up to 1; None for the
            learner's own, per step [1].
        start: Whose steps come first in the memory: those of a gait, as in ``TrainConfig``, or
            "random".
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
    growth: Mapping[str, int] = field(default_factory=dict)
    discount: _Discount | None = None
    start: str = "random"
    learner: Mapping[str, Any] = field(default_factory=dict)
    interval: _Steps | None = None

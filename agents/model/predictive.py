"""Control by prediction: the commands that come nearest to what is wanted, by a model or the task.

Every control period the next commands are chosen as a bounded problem of least squares over the
horizon, of which the first is given and the rest is where the next period begins (receding
horizon). Predictions are not linear in the commands: the problem is solved in a few rounds of
Gauss and Newton, each of which is exact for what is linear.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from tca_mj.agents.model.dynamics import TaskModel
from tca_mj.checks import Array, Checked, Count, NotNegative, Positive, Positives, door, whole
from tca_mj.drive import SimulationDiverged
from tca_mj.envs.task import SimulatedTask

Rows = dict[str, Array]
Output = Callable[[Rows], Array]
"""From rows of an observation, shape (..., size), to what is controlled, shape (..., n)."""
Ahead = Callable[[Array], tuple[Array, Array]]
"""From commands, shape (b, steps, acts), to outputs and excesses, shape (b, steps, n) each."""

_SHARES = (1.0, 0.5, 0.2, 0.05)  # of a step of Gauss and Newton that are tried

_Held = Annotated[int, partial(whole, at_least=1, at_most=10_000)]


@dataclass(frozen=True, kw_only=True, slots=True)
class Horizon(Checked):
    """What is planned, and what it costs.

    Attributes:
        holds: Steps for which each command is held; their sum is how far it looks ahead.
        effort: Weight of the square of a command above the one that leaves the robot alone, each
            step [1].
        change: Weight of the square of the change between commands that follow each other [1].
        excess: Weight of the square of an excess, each step [1].
        rounds: Of Gauss and Newton in a control period.
        probe: Change of a command by which slopes are found [1].
    """

    holds: tuple[_Held, ...] = (1, 1, 2, 2, 3, 3, 4, 4)
    effort: NotNegative = 0.0
    change: NotNegative = 0.0
    excess: NotNegative = 1.0
    rounds: Count = 2
    probe: Positive = 1e-4

    @property
    def steps(self) -> int:
        """How many steps it looks ahead."""
        return sum(self.holds)


@door
def planned(
    ahead: Ahead, wanted: Array, horizon: Horizon, *, before: Array, guess: Array, still: Array
) -> Array:
    """The commands of a horizon whose squares of errors and costs are least, within -1 and 1.

    Args:
        ahead: What commands lead to; of the excesses what is above 0 is charged.
        wanted: Outputs that are wanted, shape (steps, n), of the order of 1 if they miss [1].
        horizon: What is planned.
        before: The command of the last step, shape (acts,).
        guess: Where the search begins, shape (holds, acts).
        still: The command that leaves the robot alone, shape (acts,).

    Returns:
        Shape (holds, acts). It costs no more than the guess.
    """
    held, (count, acts) = np.array(horizon.holds), guess.shape
    steps, change = np.sqrt(horizon.effort * held)[:, None], np.sqrt(horizon.change)

    def residuals(plans: Array) -> Array:
        outputs, excesses = ahead(np.repeat(plans, held, axis=1))
        led = np.concatenate([np.broadcast_to(before, (len(plans), 1, acts)), plans], axis=1)
        parts = (outputs - wanted, np.sqrt(horizon.excess) * np.maximum(excesses, 0.0),
                 steps * (plans - still), change * np.diff(led, axis=1))  # fmt: skip
        return np.concatenate([part.reshape(len(plans), -1) for part in parts], axis=1)

    plan = np.clip(guess, -1.0, 1.0)
    for _ in range(horizon.rounds):
        way = np.where(plan > 0.0, -horizon.probe, horizon.probe).ravel()  # within the bounds
        moved = plan + np.diag(way).reshape(-1, count, acts)
        now, *near = residuals(np.concatenate([plan[None], moved]))
        slope = (np.array(near) - now).T / way
        factor: Any = np.linalg.qr(np.column_stack([slope, now]), mode="r")
        size, flat = plan.size, plan.ravel()
        room = (-1.0 - flat - 1e-12, 1.0 - flat + 1e-12)
        found = lsq_linear(factor[:, :size], -factor[:, size], bounds=room, method="bvls")
        step = found.x.reshape(plan.shape)
        tried = np.clip(plan + np.array(_SHARES)[:, None, None] * step, -1.0, 1.0)
        costs = (residuals(tried) ** 2).sum(axis=1)
        best = int(np.argmin(costs))
        if not costs[best] < now @ now:
            break
        plan = tried[best]
    return plan


class Foresight(Protocol):
    """What tells where commands lead."""

    def reset(self) -> None:
        """Called before every episode."""

    def look(self, observation: NDArray[np.float32], output: Output, excess: Output) -> Ahead:
        """What commands lead to from here.

        Args:
            observation: What is seen now.
            output: What is controlled.
            excess: What must not be above 0.
        """

    def done(self, command: Array) -> None:
        """Hears which command is given now."""


@dataclass
class ByModel(Checked):
    """Foresight by a model that was fitted.

    By how much its last steps were off it takes to go on, and learns that within ``averaging``: a
    robot that is not the one of the data is followed without a lasting error.

    Attributes:
        model: The model.
        averaging: Time in which it learns what is off; 0 for no correction [s].
    """

    model: TaskModel
    averaging: NotNegative = 0.5

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self.reset()

    def reset(self) -> None:
        """Forgets what was seen."""
        self._state: Array | None = None
        self._expected: Array | None = None
        driven, _, followed = self.model.view.sizes
        self._off = np.zeros(driven + followed)

    def look(self, observation: NDArray[np.float32], output: Output, excess: Output) -> Ahead:
        """See ``Foresight``."""
        view = self.model.view
        driven, remembered, _ = view.sizes
        state = view.states(observation.astype(np.float64)[None])[0]
        if self._expected is not None:
            means = slice(driven, driven + remembered)
            state[means] = self._expected[means]
            if self.averaging:
                share = 1.0 - np.exp(-view.period / self.averaging)
                self._off += share * np.delete(state - self._expected[: state.size], means)
        self._state = begun = self.model.begin(state)
        off = self._off.copy()

        def ahead(commands: Array) -> tuple[Array, Array]:
            start = np.broadcast_to(begun, (len(commands), begun.size))
            states = self.model.predict(start, commands, off)
            rows = view.read(states[..., : state.size])
            return output(rows), excess(rows)

        return ahead

    def done(self, command: Array) -> None:
        """See ``Foresight``."""
        assert self._state is not None
        self._expected = self.model.advance(self._state, command, self._off)


class BySimulation:
    """Foresight by the task itself: a copy is put into its state and tried.

    Attributes:
        task: The task, whose state is read and left alone.
    """

    @door
    def __init__(self, task: SimulatedTask) -> None:
        self.task = task
        self.reset()

    def reset(self) -> None:
        """Gives up the copy, which the next episode makes anew."""
        self._copy: SimulatedTask | None = None
        self._state: Any = None

    def look(self, observation: NDArray[np.float32], output: Output, excess: Output) -> Ahead:
        """See ``Foresight``; what the simulation does not survive stays as it was before."""
        copy = self._copy = self._copy or deepcopy(self.task)
        state = self._state = self.task.get_state(self._state)

        def tried(commands: Array) -> list[NDArray[np.float32]]:
            copy.set_state(state)
            seen = [observation]
            for command in commands:
                try:
                    for _ in range(copy.repeats):
                        drive = copy.drive(command)
                        copy.sim.step(drive.command, copy.interval, voltage=drive.voltage,
                                      fan=drive.fan)  # fmt: skip
                    seen.append(copy.seen())
                except SimulationDiverged:
                    seen.append(seen[-1])
            return seen[1:]

        def ahead(commands: Array) -> tuple[Array, Array]:
            rows = copy.observation.read(np.array([tried(each) for each in commands], dtype=float))
            return output(rows), excess(rows)

        return ahead

    def done(self, command: Array) -> None:
        """See ``Foresight``."""


def nothing(rows: Rows) -> Array:
    """No excess: shape (..., 0)."""
    first = next(iter(rows.values()))
    return np.zeros((*first.shape[:-1], 0))


@dataclass
class Predictive(Checked):
    """A policy that follows a course of outputs, which it knows ahead.

    Attributes:
        foresight: What tells where commands lead.
        output: What is controlled.
        wanted: Its course: from times since the reset, shape (k,) [s], to outputs, shape (k, n).
        scale: Error of an output that counts as 1, one number or shape (n,) [as ``output``].
        still: The action that leaves the robot alone, shape (acts,).
        period: Time of a step [s].
        horizon: What is planned.
        excess: What must not be above 0, of the order of 1 if it is too much.
    """

    foresight: Foresight
    output: Output
    wanted: Callable[[Array], Array]
    scale: Positives
    still: NDArray[np.float32]
    period: float
    horizon: Horizon = field(default_factory=Horizon)
    excess: Output = nothing
    phase = "predictive"

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self.foresight.reset()
        self._step = 0
        self._before: Array = self.still.astype(np.float64)
        self._plan = np.tile(self._before, (len(self.horizon.holds), 1))

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period."""
        horizon, scale = self.horizon, self.scale
        ahead_of = np.arange(self._step + 1, self._step + 1 + horizon.steps, dtype=np.float64)
        ahead = self.foresight.look(observation, lambda rows: self.output(rows) / scale,
                                    self.excess)  # fmt: skip
        still: Array = self.still.astype(np.float64)
        wanted = np.asarray(self.wanted(self.period * ahead_of) / scale, dtype=np.float64)
        plan = planned(ahead, wanted, horizon, before=self._before,
                       guess=self._plan, still=still)  # fmt: skip
        action = plan[0].astype(np.float32)
        self._before = action.astype(np.float64)
        self.foresight.done(self._before)
        # A step later: what each command of the plan is on average.
        held = np.array(horizon.holds)
        later = np.repeat(plan, held, axis=0)
        later = np.append(later[1:], later[-1:], axis=0)
        self._plan = np.add.reduceat(later, np.cumsum(held) - held) / held[:, None]
        self._step += 1
        return action

"""A walker that is told where to go: round a square, or from waypoint to waypoint."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies import Policy, load_policy, saved_policy
from tca_mj.checks import Positive, door

WALKER = "tetrapod-command"  # the shipped policy that follows commands

SIDE_TIME = 60.0
"""Time between two corners of the square [s]."""
WAYPOINTS = ((0.25, 0.0), (0.35, 0.2), (0.15, 0.3), (0.0, 0.0))
"""A course of waypoints, x and y [m]."""
REACHED = 0.02
"""How near is there [m]."""
_ROUND = 2.0 * math.pi
_TURN = math.radians(3.0)  # a change of direction below this is not worth an order

Order = tuple[str, dict[str, float]]
"""A word for what comes, and what the task is told, see ``TetrapodGait.order``."""


@dataclass(slots=True)
class Guided:
    """A policy whose task is given orders as it goes.

    Attributes:
        policy: Who acts.
        task: The task, a ``TetrapodGait``.
        guide: What gives orders: asked before each decision, None for no new one.
        phase: What it was told last, in a word.
    """

    policy: Policy
    task: Any
    guide: Callable[[Any], Iterator[Order | None]]
    phase: str = ""
    _orders: Iterator[Order | None] = field(default_factory=lambda: iter(()))

    def reset(self) -> None:
        """Begins the way anew."""
        self.policy.reset()
        self._orders = self.guide(self.task)
        self.phase = "start"

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Gives the order that is due, and lets the policy act on what is then seen."""
        order = next(self._orders, None)
        if order is not None:
            self.phase, told = order
            self.task.order(**told)
            observation = self.task.seen()
        return self.policy.act(observation)


def along_square(task: Any) -> Iterator[Order | None]:
    """Orders for four sides; the direction, not the robot, turns left after each ``SIDE_TIME``.

    Args:
        task: The task, whose time is asked for.
    """
    for side in range(4):
        direction = math.remainder(side * math.pi / 2.0, _ROUND)
        yield f"side {side + 1}", {"direction": direction}
        while task.sim.time < (side + 1) * SIDE_TIME - 1e-6:
            yield None
    yield "stand", {"speed": 0.0}


@dataclass(frozen=True, slots=True)
class AlongWaypoints:
    """From point to point, straight on, then stand.

    Attributes:
        points: x and y of each [m].
        reached: How near is there [m].
    """

    points: Sequence[tuple[float, float]] = WAYPOINTS
    reached: Positive = REACHED

    def __call__(self, task: Any) -> Iterator[Order | None]:
        """The orders."""
        for number, (x, y) in enumerate(self.points, 1):
            last: float | None = None
            while True:
                here_x, here_y = task.following.place
                if math.hypot(x - here_x, y - here_y) < self.reached:
                    break
                towards = math.atan2(y - here_y, x - here_x) - task.following.heading
                direction = math.remainder(towards, _ROUND)
                if last is not None and abs(math.remainder(direction - last, _ROUND)) < _TURN:
                    yield None
                    continue
                last = direction
                yield f"to {number}", {"direction": direction}
        yield "stand", {"speed": 0.0}


@door
def square(env: gym.Env[Any, Any]) -> Guided:
    """The shipped walker round a square.

    Args:
        env: A walking task, made with what the walker needs.

    Raises:
        ValueError: As ``load_policy``.
    """
    return Guided(load_policy(WALKER, env), env.unwrapped, along_square)


@door
def waypoints(env: gym.Env[Any, Any]) -> Guided:
    """The shipped walker along ``WAYPOINTS``.

    Args:
        env: As for ``square``.

    Raises:
        ValueError: As ``square``.
    """
    return Guided(load_policy(WALKER, env), env.unwrapped, AlongWaypoints())


def _needed() -> dict[str, Any]:
    """What the walker needs its task to be made with."""
    return dict(saved_policy(WALKER).arguments)


square.arguments = waypoints.arguments = _needed  # type: ignore[attr-defined]

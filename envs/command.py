"""Where a robot is told to go, and how well it follows: direction, speed, and rate of turning."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tca_mj.envs.options import Constant, Option, Setup
from tca_mj.envs.table import Table

Array: TypeAlias = NDArray[Any]

LEASH = 0.05  # a robot that is further behind than this need not make up for it [m]
# Way that a radian between where a robot looks and ought to look is worth. Estimate [m].
_LEVER = 0.1
# Of commands that memories are told with: spread of distances [m] and of headings [rad], and the
# share of those to go as fast as it can. Estimates: about what robots that follow them get to.
_SPREAD, _ASTRAY, _HURRIED = 0.01, 0.1, 0.6
_TIMES = 8.0, 20.0  # shortest and longest time between two commands that are drawn [s]


class Command(NamedTuple):
    """What a robot is told.

    Attributes:
        direction: Of travel, from the commanded heading to its left [rad].
        speed: In that direction [m/s].
        turning: Rate at which the commanded heading turns to the left [rad/s].
    """

    direction: float = 0.0
    speed: float = math.inf
    turning: float = 0.0


class Following(NamedTuple):
    """How a robot has followed its commands.

    Attributes:
        command: The present one.
        heading: Where it ought to look, from world x to y [rad].
        place: Where it was seen last, x and y [m].
        along: Way made in the commanded directions since the start [m].
        across: The same to the left of them [m].
        aside: Distance to the left of the way since the last command [m].
        lead: By how much it is ahead of the commanded speed since the last command, at least minus
            ``LEASH``; 0 while it is told to go as fast as it can [m].
        error: From where it looks to where it ought to, to the left [rad].
    """

    command: Command
    heading: float = 0.0
    place: tuple[float, float] = (0.0, 0.0)
    along: float = 0.0
    across: float = 0.0
    aside: float = 0.0
    lead: float = 0.0
    error: float = 0.0

    @property
    def course(self) -> float:
        """The commanded direction, from world x to y [rad]."""
        return self.heading + self.command.direction

    def told(self, command: Command) -> Following:
        """With another command from here on."""
        return self._replace(command=command, aside=0.0, lead=0.0)

    def moved(self, x: float, y: float, yaw: float, interval: float) -> Following:
        """What has become of it.

        Args:
            x, y: Where the robot is now [m].
            yaw: Where it looks, from world x to y [rad].
            interval: Time since it was seen last [s].
        """
        command = self.command
        middle = self.course + 0.5 * command.turning * interval
        dx, dy = x - self.place[0], y - self.place[1]
        gained = math.cos(middle) * dx + math.sin(middle) * dy
        strayed = math.cos(middle) * dy - math.sin(middle) * dx
        lead = max(self.lead + gained - command.speed * interval, -LEASH)
        heading = self.heading + command.turning * interval
        return Following(
            command=command,
            heading=heading,
            place=(x, y),
            along=self.along + gained,
            across=self.across + strayed,
            aside=self.aside + strayed,
            lead=lead if math.isfinite(command.speed) else 0.0,
            error=math.remainder(heading - yaw, 2.0 * math.pi),
        )

    def earned(self, before: Following, speed: float) -> dict[str, float]:
        """What that pays, by term of the reward; all are differences, by shaking nothing is earned.

        Args:
            before: What it was.
            speed: Speed that earns 1 per second [m/s].
        """
        return {
            "progress": (self.along - before.along) / speed,
            "drift": -0.5 * (abs(self.aside) - abs(before.aside)) / speed,
            "lead": -2.0 * (max(self.lead, 0.0) - max(before.lead, 0.0)) / speed,
            "turn": -_LEVER * (abs(self.error) - abs(before.error)) / speed,
        }


def command_options(*, fastest: float, turning: float, ways: tuple[float, ...]) -> list[Option]:
    """Rows of the table of reset options.

    Args:
        fastest: Speed from which on the command is to go as fast as it can [m/s].
        turning: Largest rate of turning [rad/s].
        ways: Directions that can be commanded [rad]; empty for all.
    """
    return [
        Option(
            name="direction", about="commanded direction, from world x to y", unit="rad",
            low=-math.pi, high=math.pi, draw=Constant(0.0), drawn="0",
            check=partial(_check_way, ways),
        ),
        Option(
            name="speed", about="commanded speed; the largest is as fast as it can", unit="m/s",
            low=0.0, high=fastest, draw=Constant(fastest), drawn="the largest",
        ),
        Option(
            name="turning", about="commanded rate of turning, to the left", unit="rad/s",
            low=-turning, high=turning, draw=Constant(0.0), drawn="0",
        ),
        Option(
            name="wander", about="share of these ranges from which commands are drawn and changed"
            f" after {_TIMES[0]:g} to {_TIMES[1]:g} s", low=0.0, high=1.0, draw=Constant(0.0),
            drawn="0",
        ),
    ]  # fmt: skip


def _check_way(ways: tuple[float, ...], value: Any) -> None:
    if ways and min(abs(math.remainder(value - way, 2.0 * math.pi)) for way in ways) > 1e-6:
        raise ValueError(f"direction must be one of {ways} here, got {value}")


def commanded(setup: Setup, fastest: float) -> Command:
    """The command that an episode begins with."""
    speed = setup["speed"] if setup["speed"] < fastest else math.inf
    return Command(setup["direction"], speed, setup["turning"])


def drawn(
    random: Any, wander: float, *, fastest: float, turning: float, ways: tuple[float, ...]
) -> tuple[Command, float]:
    """A command, and for how long it holds [s].

    Of ten commands six are to go as fast as it can, one is to stand; six do not turn.

    Args:
        random: The generator.
        wander: Share of the ranges.
        fastest, turning, ways: As for ``command_options``.
    """
    way, share, turn, choice, still, time = random.uniform(0.0, 1.0, 6).tolist()
    direction = (2.0 * way - 1.0) * math.pi * wander
    if ways:
        direction = ways[int(way * len(ways))] if wander > 0.0 else 0.0
    slow = 1.0 if choice < 0.7 else share
    speed = math.inf if choice < 0.6 else fastest * (1.0 - wander * slow)
    rate = (2.0 * turn - 1.0) * turning * wander if still > 0.6 else 0.0
    return Command(direction, speed, rate), _TIMES[0] + (_TIMES[1] - _TIMES[0]) * time


@dataclass(frozen=True, slots=True, eq=False)
class Retelling:
    """Tells memories of a step anew, as if other commands had been given.

    No command changes what a body does, but only what that is worth: what was learned on the way to
    the east is as true of the way to the north. Direction and heading are turned by angles that are
    drawn, speed and distances from the way are drawn; what was gained along and across the
    commanded direction turns with it, so that the reward is exactly what ``Following.earned`` pays.

    Attributes:
        table: What is seen.
        speed: Speed that earns 1 per second [m/s].
        fastest: Commanded speed that means as fast as it can [m/s].
        ways: Directions that can be commanded [rad]; empty for all.
        period: Time of a step [s].
    """

    table: Table
    speed: float
    fastest: float
    ways: tuple[float, ...]
    period: float

    def notes(self, info: Mapping[str, Any]) -> tuple[float, float, float]:
        """What is to be kept of a step: way along and across so far [m], and what was paid."""
        terms = info["reward_terms"]
        paid = terms["progress"] + terms["drift"] + terms["lead"] + terms["turn"]
        return info["distance"], info["across"], paid

    def told(
        self, seen: Array, after: Array, reward: Array, notes: Array, random: np.random.Generator
    ) -> tuple[Array, Array, Array]:
        """Observations before and after each step and what it earned, with other commands.

        Args:
            seen: Scaled observations before, shape (n, size).
            after: Those after.
            reward: What was earned, shape (n,).
            notes: Way gained along and across in the step, and what was paid, shape (n, 3).
            random: The generator.
        """
        n, rows, (centre, scale) = len(seen), self.table.slices, self.table.units
        if self.ways:
            turn = np.array(self.ways)[random.integers(len(self.ways), size=n)]
        else:
            turn = random.uniform(-math.pi, math.pi, n)
        tilt = random.normal(0.0, _ASTRAY, n)  # of the heading
        hurried = random.uniform(size=n) < _HURRIED
        told = np.where(hurried, np.inf, random.uniform(0.0, self.fastest, n))
        cosine, sine = np.cos(turn), np.sin(turn)
        along, across, paid = notes.T
        gained, strayed = cosine * along + sine * across, cosine * across - sine * along
        lead = np.where(hurried, 0.0, np.maximum(random.normal(0.0, _SPREAD, n), -LEASH))
        later = np.where(hurried, 0.0, np.maximum(lead + gained - told * self.period, -LEASH))
        aside = random.normal(0.0, _SPREAD, n)
        found = []
        error = []
        for seen_now, ahead, away in ((seen, lead, aside), (after, later, aside + strayed)):
            now = seen_now.copy()

            def put(name: str, values: Any, now: Array = now) -> None:
                where = rows[name]
                now[:, where] = (np.reshape(values, (n, -1)) - centre[where]) / scale[where]

            x, y = (now[:, rows["commanded direction"]] * scale[rows["commanded direction"]]).T
            put("commanded direction", np.stack([cosine * x - sine * y, sine * x + cosine * y], 1))
            put("commanded speed", np.minimum(told, self.fastest))
            put("lead", ahead)
            put("way aside", away)
            astray = now[:, rows["heading error"].start] * scale[rows["heading error"].start] + tilt
            error.append(np.abs(np.arctan2(np.sin(astray), np.cos(astray))))
            put("heading error", np.arctan2(np.sin(astray), np.cos(astray)))
            found.append(now)
        gain = gained - 0.5 * (np.abs(aside + strayed) - np.abs(aside))
        gain -= 2.0 * (np.maximum(later, 0.0) - np.maximum(lead, 0.0))
        gain -= _LEVER * (error[1] - error[0])
        return found[0], found[1], reward - paid + gain / self.speed

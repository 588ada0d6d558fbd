"""Where a robot is told to go, and how well it follows: direction, speed, and rate of turning."""

import math
from functools import partial
from typing import Any, NamedTuple

from tca_mj.envs.options import Constant, Option, Setup

LEASH = 0.05  # a robot that is further behind than this need not make up for it [m]
# Way that a radian between where a robot looks and ought to look is worth. Estimate [m].
_LEVER = 0.1
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
        aside: Distance to the left of the way since the last command [m].
        lead: By how much it is ahead of the commanded speed since the last command, at least minus
            ``LEASH``; 0 while it is told to go as fast as it can [m].
        error: From where it looks to where it ought to, to the left [rad].
    """

    command: Command
    heading: float = 0.0
    place: tuple[float, float] = (0.0, 0.0)
    along: float = 0.0
    aside: float = 0.0
    lead: float = 0.0
    error: float = 0.0

    @property
    def course(self) -> float:
        """The commanded direction, from world x to y [rad]."""
        return self.heading + self.command.direction

    def told(self, command: Command) -> "Following":
        """With another command from here on."""
        return self._replace(command=command, aside=0.0, lead=0.0)

    def moved(self, x: float, y: float, yaw: float, interval: float) -> "Following":
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
        lead = max(self.lead + gained - command.speed * interval, -LEASH)
        heading = self.heading + command.turning * interval
        return Following(
            command=command,
            heading=heading,
            place=(x, y),
            along=self.along + gained,
            aside=self.aside + math.cos(middle) * dy - math.sin(middle) * dx,
            lead=lead if math.isfinite(command.speed) else 0.0,
            error=math.remainder(heading - yaw, 2.0 * math.pi),
        )

    def earned(self, before: "Following", speed: float) -> dict[str, float]:
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

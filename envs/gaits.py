"""What a tetrapod sees, does and is asked for in its gaits, and by what recipe it learns them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.envs.command import Following
from tca_mj.envs.recipe import HELD, Recipe
from tca_mj.envs.stance import LEG_TCAS
from tca_mj.envs.table import Entry, Table
from tca_mj.robots.tetrapod import TetrapodSpec

_SIDES = (4, 5, 6, 1, 2, 3, 10, 11, 12, 7, 8, 9)  # TCAs of the legs, left and right swapped
_FEET = (4, -5, 6, 1, -2, 3, 10, -11, 12, 7, -8, 9)  # and the places of their feet
_ENDS = (7, 9, 8, 10, 12, 11, 1, 3, 2, 4, 6, 5)  # front and rear swapped, of TCAs
_ENDS_FEET = (-7, 8, 9, -10, 11, 12, -1, 2, 3, -4, 5, 6)  # and feet

FAR = 10.0  # way ahead or aside from which on it is seen as this [m]

OBSERVATION = Table(
    [
        Entry("TCA temperature", LEG_TCAS, -50.0, 300.0, "°C", centre=100.0, scale=75.0,
              mirror=_SIDES, ends=_ENDS),
        Entry("TCA length", LEG_TCAS, 0.0, 0.3, "m", centre=0.04, scale=0.01,
              mirror=_SIDES, ends=_ENDS),
        Entry("TCA tension", LEG_TCAS, 0.0, 5.0, "N", centre=0.2, scale=0.2,
              mirror=_SIDES, ends=_ENDS),
        Entry("orientation", 4, -1.0, 1.0, "quaternion wxyz", mirror=(1, -2, 3, -4),
              ends=(1, 2, -3, -4)),
        Entry("height", 1, -0.7, 0.7, "m", centre=0.03, scale=0.03),
        Entry("velocity", 3, -10.0, 10.0, "m/s", scale=0.05, mirror=(1, -2, 3), ends=(-1, 2, 3)),
        Entry("angular velocity", 3, -1000.0, 1000.0, "rad/s", scale=1.0, mirror=(-1, 2, -3),
              ends=(1, -2, -3)),
        Entry("foot position", 12, -0.7, 0.7, "m", scale=0.1, mirror=_FEET, ends=_ENDS_FEET),
        Entry("leg contact", 4, 0.0, 1.0, "1 if foot or plates touch something", centre=0.5,
              mirror=(2, 1, 4, 3), ends=(3, 4, 1, 2)),
        Entry("body bend", 1, -6.3, 6.3, "rad"),
        Entry("commanded direction", 2, -1.0, 1.0, "-", mirror=(1, -2), ends=(-1, 2)),
        Entry("commanded speed", 1, 0.0, 1.0, "m/s", centre=0.01, scale=0.01),
        Entry("lead", 1, -FAR, FAR, "m", scale=0.02),
        Entry("way aside", 1, -FAR, FAR, "m", scale=0.05, mirror=(-1,), ends=(-1,)),
        Entry("commanded turning", 1, -1.0, 1.0, "rad/s", scale=0.05, mirror=(-1,), ends=(-1,)),
        Entry("heading error", 1, -3.2, 3.2, "rad", scale=0.3, mirror=(-1,), ends=(-1,)),
    ]
)  # fmt: skip
ACTION = Table(
    [Entry("TCA heating", LEG_TCAS, -1.0, 1.0, "-", off=-1.0, mirror=_SIDES, ends=_ENDS)]
)


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitTask:
    """What one of the tasks asks for.

    Attributes:
        bend: Angle between the ends of the spines [rad].
        speed: The published speed [m/s]; Sun, Section 6.3.2.
        scripted: What the script walks at on the nominal robot, docs/tetrapod.md [m/s].
        beam: Height of the beam that the robot stands astride of, or None for the ground [m].
        yaw_range: Largest angle by which the robot may look aside at the start [rad].
        fastest: Commanded speed that means as fast as it can [m/s].
        turning: Largest commanded rate of turning [rad/s].
        ways: Directions that can be commanded [rad]; empty for all.
    """

    bend: float
    speed: float
    scripted: float
    beam: float | None = None
    yaw_range: float = 0.05
    fastest: float = 0.012
    turning: float = 0.05
    ways: tuple[float, ...] = ()


TASKS = {
    # Sun's crawling robot is "almost flat": it keeps the memorised shape.
    "crawl": GaitTask(bend=TetrapodSpec().memory_angle, speed=2.4e-3, scripted=4.3e-3),
    "walk": GaitTask(bend=math.radians(93.0), speed=9e-3, scripted=6.9e-3),
    # Sun prints neither the angle of the U nor the beam. Both (the beam in beam.xml, 34 mm wide)
    # are chosen so that legs press the beam while they are nearly straight: bent, they twist.
    "shimmy": GaitTask(bend=math.radians(215.0), speed=0.75e-3, scripted=3.3e-3, beam=0.12,
                       yaw_range=0.005, turning=0.0, ways=(0.0, math.pi)),
}


def told(now: Following, rotation: NDArray[np.float64], fastest: float) -> dict[str, ArrayLike]:
    """Rows of the table that say what is commanded, and how well it is followed.

    Args:
        now: That.
        rotation: Of the hub, its axes as columns, shape (3, 3).
        fastest: Commanded speed that means as fast as it can [m/s].
    """
    course = np.array([math.cos(now.course), math.sin(now.course)])
    return {
        "commanded direction": course @ rotation[:2, :2],
        "commanded speed": min(now.command.speed, fastest),
        "lead": min(now.lead, FAR),
        "way aside": min(max(now.aside, -FAR), FAR),
        "commanded turning": now.command.turning,
        "heading error": now.error,
    }


# After how many decisions it was learned, whose steps come first, and what else differs. The
# script's crawl moves all legs together, and so would the learner. On a beam left and right do the
# same: told so, half as many numbers are to be found, and what each is worth is seen the sooner.
_LEARNED: dict[str, tuple[int, str, dict[str, Any]]] = {
    "crawl": (6000, "trot", {}),
    "walk": (15_000, "scripted", {}),
    "shimmy": (12_000, "tetrapod-shimmy", {
        "options": {"randomise": 0.1}, "alike": True, "centred": True, "discount": 0.95,
        "interval": 2000,
        "learner": {**HELD, "learning_starts": 3000, "gradient_steps": 6,
                    "ent_coef": "auto_0.02"},
    }),
}  # fmt: skip
RECIPES = {
    gait: {
        "sac": Recipe.held(
            steps, 0.4, start=first, timestep=10e-3, mirrored=True, growth={"wander": 10_000},
            # All directions at once take a larger network, and from chance.
            grown={"steps": 32_000, "start": "random",
                   "learner": {**HELD, "hidden": (256, 256)}},
            **{"options": {"randomise": 0.2}, **more},
        ),
    }
    for gait, (steps, first, more) in _LEARNED.items()
}  # fmt: skip
"""By gait and algorithm."""

# All three shapes by one policy.
SPREAD = math.radians(10.0)  # by which a bend may be off that of its gait, at most [rad]
SHAPES = {
    "sac": Recipe.held(
        30_000, 0.4, timestep=10e-3, options={"randomise": 0.2, "bend_spread": math.radians(3.0)},
        mirrored=True, start="scripted", interval=2500,
        learner={**HELD, "hidden": (256, 256), "learning_starts": 3000},
    ),
}  # fmt: skip
"""By algorithm: how all shapes are learned at once."""

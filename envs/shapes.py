"""``TCA/TetrapodShapes-v0``: one robot that crawls flat, walks bent and shimmies as a U."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Unpack

import numpy as np

from tca_mj.checks import door
from tca_mj.drive import Timestep
from tca_mj.envs.gaits import OBSERVATION as OF_ONE
from tca_mj.envs.gaits import SHAPES, SPREAD, TASKS
from tca_mj.envs.options import Constant, Option, Options, Setup
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.table import Table
from tca_mj.envs.task import TaskArguments
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.envs.vector import TaskVector
from tca_mj.robots.tetrapod import TetrapodSpec

# The bend tells the shapes apart, and is therefore scaled to what it is: from flat to the U it goes
# from -0.8 to 0.9.
OBSERVATION = Table(
    [
        replace(row, centre=2.0, scale=2.0) if row.name == "body bend" else row
        for row in OF_ONE.entries
    ]
)
_ASIDE = (0.0, 5.0)  # where it is put down if not onto the beam: far from that [m]


class TetrapodShapes(TetrapodGait):
    """Get on as commanded in whatever shape the body has: what one policy has to do for all.

    An episode is one of the three of ``TetrapodGait``, flat or bent to a right angle on the ground,
    or as a U on the beam; which of them is drawn, or given as the option ``gait``. The beam and the
    ground are both there always. Action and observation are those of ``TetrapodGait``, but for the
    scale of the row "body bend", from which a policy can tell which of them it is.

    Reward, the sum of the terms in ``info["reward_terms"]``, as there, over the speed of the script
    in that shape in place of the published one, which is 0.23 to 1.8 times that:
        progress: Distance gained along the commanded direction over the script's speed [s].
        drift: Minus half of what is gained in distance from the commanded line, over that speed.
        lead: Minus twice what is gained in distance ahead of the commanded speed, over that speed.
        turn: Minus what is lost of the commanded heading, 0.1 m for a radian, over that speed.
        posture: Minus 0.2 (1 - cosine of the tilt), every 0.1 s.
        energy: Minus 0.002 per joule of electrical energy.
        heat: Minus 0.002 for every kelvin by which a TCA is above ``hot_temperature``, every 0.1 s.
        end: Minus 5 in the step in which the robot falls, or a TCA is too hot or torn.

    A seed draws the same robot as in the task of the single gait.

    Example:
        >>> from tca_mj.envs import TetrapodShapes
        >>> env = TetrapodShapes()
        >>> observation, info = env.reset(seed=0, options={"gait": "crawl"})
        >>> round(env.stance.bend(env.data), 1)
        0.3
    """

    scripted = "tca_mj.agents.scripts.tetrapod:EveryGait"
    table: ClassVar[Table] = OBSERVATION

    @door
    def __init__(
        self,
        *,
        robot: TetrapodSpec | None = None,
        body: str = "rigid",
        timestep: Timestep = 6.25e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene with the beam; for the rest see ``TetrapodGait``.

        Args:
            robot: The robot, by default the published one as far as it is known.
            body: One of ``tca_mj.envs.stance.BODIES``.
            timestep: Physics time step, of which ``control_period`` is a multiple [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is unknown or out of range, or the robot cannot be built.
        """
        super().__init__(gait="shimmy", robot=robot, body=body, timestep=timestep, **common)

    @classmethod
    def recipes_for(cls, arguments: Mapping[str, Any]) -> Mapping[str, Recipe]:
        """As every task's."""
        return SHAPES

    @property
    def reference(self) -> float:
        """The speed that earns 1 per second: that of the script [m/s]."""
        return self.task.scripted

    def _options(self) -> Options:
        flat, bent = TASKS["crawl"].bend, TASKS["shimmy"].bend
        own = {
            "bend": Option(
                name="bend", about="bend of its body, within 10° of that of the gait", unit="rad",
                low=flat - SPREAD, high=bent + SPREAD, draw=_draw_bend, drawn="drawn",
            ),
            "yaw": Option(
                name="yaw", about="where the robot looks, from world x to y", unit="rad",
                low=-0.05, high=0.05, draw=_draw_yaw, drawn="drawn, on the beam a tenth of it",
            ),
        }  # fmt: skip
        return Options(
            [
                Option(
                    name="gait", about="in which shape, and where", choices=tuple(TASKS),
                    draw=_draw_gait, drawn="drawn",
                ),
                Option(
                    name="bend_spread", about="by how much the bend that is drawn may be off",
                    unit="rad", low=0.0, high=SPREAD, draw=Constant(self.bend_range), drawn="1°",
                ),
                *(own.get(row.name, row) for row in super()._options().rows),
            ]
        )  # fmt: skip

    def prepare(self, setup: Setup) -> None:
        """Puts the robot down, on the ground or onto the beam, where it comes to rest."""
        task = TASKS[setup["gait"]]
        if abs(setup["bend"] - task.bend) > SPREAD + 1e-9:
            raise ValueError(
                f"bend must be within {SPREAD:.4g} rad of {task.bend:.4g} rad for {setup['gait']},"
                f" got {setup['bend']:.4g}"
            )
        self.gait, self.spot = setup["gait"], (0.0, 0.0) if task.beam else _ASIDE
        super().prepare(setup)


def _draw_gait(random: np.random.Generator, setup: Setup) -> str:
    """One of the three, from numbers that nothing else is drawn from."""
    ahead: Any = random.bit_generator
    return str(np.random.Generator(ahead.jumped()).choice(list(TASKS)))


def _draw_bend(random: np.random.Generator, setup: Setup) -> float:
    spread = setup["bend_spread"]
    return TASKS[setup["gait"]].bend + float(random.uniform(-spread, spread))


def _draw_yaw(random: np.random.Generator, setup: Setup) -> float:
    largest = TASKS[setup["gait"]].yaw_range
    return float(random.uniform(-largest, largest))


TetrapodShapesVector = partial(TaskVector, TetrapodShapes)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

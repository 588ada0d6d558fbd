"""Scripted gaits of the tetrapod: which TCA is hot when, and the power that makes it so.

The sequence of the legs is the published one (Sun, Section 6.3.2). All other figures were found by
a search for speed in each task: CMA-ES over period, starts, duties and temperatures, the same for
all legs, 120 to 216 gaits of which each went for half a minute; the walk's on feet of 6 mm.
"""

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tca_mj.control import Gait, Thermostat
from tca_mj.envs.stance import LEG_TCAS
from tca_mj.envs.tetrapod import OBSERVATION, TetrapodGait
from tca_mj.robots.tetrapod import TetrapodSpec, tetrapod
from tca_mj.tca import HeatSpec

CRAWL = Gait(
    period=2.9,
    offset=(0.0, 0.0, 0.0, 0.0),
    start=(0.0, 0.27, 0.63),
    duty=(0.65, 0.42, 0.49),
    hot=(169.0, 168.0, 168.0),
    warm=(55.0, 57.0, 53.0),
)
"""All four feet run round a loop together, like the flippers of a sea turtle."""

WALK = Gait(
    period=3.2,
    offset=(0.75, 0.25, 0.0, 0.5),
    start=(0.09, 0.21, 0.52),
    duty=(0.37, 0.33, 0.44),
    hot=(167.0, 169.0, 170.0),
    warm=(81.0, 82.0, 57.0),
)
"""An amble: rear left, front left, rear right, front right lift one after the other."""

TROT = replace(WALK, offset=(0.5, 0.0, 0.0, 0.5))
"""The walk's figures with diagonal legs together: not what was reported, a start for searches."""

SHIMMY = Gait(
    period=6.9,
    offset=(0.0, 0.0, 0.5, 0.5),
    start=(0.02, 0.15, 0.46),
    duty=(0.36, 0.36, 0.47),
    hot=(162.0, 170.0, 165.0),
    warm=(43.0, 28.0, 39.0),
)
"""Front and rear pair clamp the beam by turns, like a caterpillar."""

GAITS = MappingProxyType({"crawl": CRAWL, "walk": WALK, "shimmy": SHIMMY})

_LEFT = np.array([1.0, 0.0, 1.0, 0.0])  # which of the legs are on the left


@dataclass(slots=True)
class GaitPolicy:
    """A gait on feedback of the temperatures: an observation in, an action out.

    Attributes:
        gait: The gait.
        steering: How much cooler the legs of the side to turn to are kept, per angle between where
            the robot looks and where it ought to, one number or one for each leg [K/rad].
        robot: The robot it was told that it has.
        time: Time since the start [s].
    """

    gait: Gait
    steering: float | tuple[float, ...] = 0.0
    robot: TetrapodSpec = field(default_factory=TetrapodSpec)
    time: float = 0.0
    _thermostat: Thermostat = field(init=False)

    def __post_init__(self) -> None:
        heats = [tca.spec.heat for tca in tetrapod(self.robot).tcas[:LEG_TCAS]]
        heat = HeatSpec(
            capacity=np.array([heat.capacity for heat in heats]),
            loss=np.array([heat.loss for heat in heats]),
        )
        self._thermostat = Thermostat(heat=heat, max_power=TetrapodGait.max_power)

    @classmethod
    def of(cls, gait: str, robot: TetrapodSpec | None = None) -> "GaitPolicy":
        """The scripted policy of a task.

        Args:
            gait: ``crawl``, ``walk`` or ``shimmy``.
            robot: The robot, by default the one that is the default everywhere.

        Raises:
            ValueError: If there is no such gait.
        """
        if gait not in GAITS:
            raise ValueError(f"gait must be one of {list(GAITS)}, got {gait!r}")
        return cls(GAITS[gait], STEERING[gait], robot or TetrapodSpec())

    @property
    def phase(self) -> str:
        """What it does: a gait has no phases that are worth a name."""
        return "gait"

    @property
    def cycle(self) -> float:
        """Where in the cycle it is, 0 to 1."""
        return self.time / self.gait.period % 1.0

    def reset(self) -> None:
        """Starts anew."""
        self.time = 0.0

    def act(
        self, observation: NDArray[np.float32], correction: NDArray[np.float64] | float = 0.0
    ) -> NDArray[np.float32]:
        """The action for the next control period, shape (12,).

        Args:
            observation: What is seen.
            correction: Added to the temperatures of the gait, shape (12,) [K]. What it makes
                hotter than both the gait and ``TetrapodGait.hot_temperature`` is cut off there.
        """
        rows = OBSERVATION.read(observation.astype(np.float64))
        target = self.gait.temperature(self.time / self.gait.period).reshape(len(_LEFT), -1)
        x, y = rows["commanded direction"]
        aside = np.arctan2(y, x)
        weaker = np.clip(np.array(self.steering) * aside, -80.0, 80.0)
        side = _LEFT if aside > 0.0 else 1.0 - _LEFT
        target = (target - (np.abs(weaker) * side)[:, None]).ravel()
        limit = np.maximum(target, TetrapodGait.hot_temperature)
        self.time += TetrapodGait.control_period
        power = self._thermostat.power(
            rows["TCA temperature"], np.minimum(target + correction, limit)
        )
        action = 2.0 * power / TetrapodGait.max_power - 1.0
        return np.clip(action, -1.0, 1.0).astype(np.float32)


# The side that is to be turned to makes shorter strokes. Estimates that hold the direction.
STEERING = {"crawl": 600.0, "walk": 600.0, "shimmy": 0.0}

"""``TCA/TetrapodCourse-v0``: under a plate, over a beam, to a target (Sun, Section 6.3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import Checked, door
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.options import Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.outcome import Headway, Verdict
from tca_mj.envs.stance import CAMERAS, Stance, tetrapod_scene
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.robots.tetrapod import LEGS, SPINES, TetrapodSpec
from tca_mj.smp import HeaterSpec, SpineSpec

TCAS = 3 * len(LEGS) + SPINES

# TCAs with left and right swapped: those of the legs; the spines' stay.
_SIDES = (4, 5, 6, 1, 2, 3, 10, 11, 12, 7, 8, 9, 13, 14, 15)

OBSERVATION = Table(
    [
        Entry("TCA temperature", TCAS, -50.0, 300.0, "°C", centre=100.0, scale=75.0, mirror=_SIDES),
        Entry("TCA length", TCAS, 0.0, 0.9, "m", scale=0.05, mirror=_SIDES),
        Entry("TCA tension", TCAS, 0.0, 5.0, "N", centre=0.2, scale=0.2, mirror=_SIDES),
        Entry("spine temperature", SPINES, -50.0, 300.0, "°C", centre=70.0, scale=50.0),
        Entry("body angle", 1, -2.0 * np.pi, 2.0 * np.pi, "rad"),
        Entry("position", 3, -2.0, 2.0, "m", scale=0.5, mirror=(1, -2, 3)),
        Entry("orientation", 4, -1.0, 1.0, "quaternion wxyz", mirror=(1, -2, 3, -4)),
        Entry("velocity", 3, -10.0, 10.0, "m/s", scale=0.05, mirror=(1, -2, 3)),
        Entry("angular velocity", 3, -500.0, 500.0, "rad/s", scale=1.0, mirror=(-1, 2, -3)),
    ]
)
ACTION = Table(
    [
        Entry("TCA heating", TCAS, -1.0, 1.0, "-", off=-1.0, mirror=_SIDES),
        Entry("heater voltage", SPINES, -1.0, 1.0, "-", off=-1.0),
    ]
)

# With a fan, which blows at all spines: that of the module, Sun, Section 6.1.3.
FANNED = Table([*ACTION.entries, Entry("fan", 1, -1.0, 1.0, "on above 0", off=-1.0)])

# The module's 6.5 mm (Sun, Section 6.1.1) read as its extent in the plane of bending, its 5 mm as
# the width: with its TCA 4 mm from the axis the body can lift itself off the desk, with 2.5 mm, as
# in ``SpineSpec()``, it stops at 33° to 57°. The section is as stiff as that one's. Estimate.
LIFTING_SPINE = SpineSpec(width=5e-3, thickness=2.75e-3, module_height=6.5e-3, tca_offset=4e-3)

_START = 13e-3  # height of the flat robot's middle over the desk [m]
_TURNED = np.cos(np.radians(60.0))  # the body's z axis may not lean further
_FLAT = np.radians(40.0)  # body angle up to which the robot lies flat
_LOST = -0.08  # height of the middle at which the robot has dropped into the gap [m]
_COLD = 80.0  # temperature up to which a spine is rigid, Sun, Section 6.1.3 [°C]


@dataclass(frozen=True, kw_only=True, slots=True)
class Places(Checked):
    """Where things are along the course, read from its file.

    Attributes:
        stand: Where the whole robot is beyond the plate, with a hand's breadth to spare [m].
        first_edge: End of the first desk [m].
        second_edge: Start of the second desk [m].
        beam_end: End of the beam, over the second desk [m].
        target: Middle of the target [m].
        target_size: Half sizes of the target along x and y [m].
        beam_top: Height of the beam over the first desk [m].
        lower: Height of the second desk over the first [m].
        leg_station: Fore-aft distance of the legs' roots from the robot's middle [m].
    """

    stand: float
    first_edge: float
    second_edge: float
    beam_end: float
    target: float
    target_size: tuple[float, float]
    beam_top: float
    lower: float
    leg_station: float


def _default() -> TetrapodSpec:
    return TetrapodSpec(spine=LIFTING_SPINE, heater=HeaterSpec.fitted(LIFTING_SPINE))


def _draw_yaw(random: np.random.Generator, setup: Setup) -> float:
    return float(random.uniform(-1.0, 1.0) * np.radians(2.0))


_OPTIONS = Options(
    [
        Option(
            name="position", about="x and y of its middle", unit="m", shape=(2,), low=-5e-3,
            high=5e-3, draw=Uniform(-5e-3, 5e-3, 2), drawn="drawn",
        ),
        Option(
            name="yaw", about="heading", unit="rad", low=-np.radians(3.0), high=np.radians(3.0),
            draw=_draw_yaw,
            drawn="drawn, within 2°",
        ),
        *variation_options(),
    ]
)  # fmt: skip


class TetrapodCourse(SimulatedTask):
    """The whole course with one robot that changes its shape on the way.

    Crawl under a plate 30 mm above the desk, stand up, walk astride a beam until it bridges the
    gap to the next desk, clamp it, shimmy across, step off, walk to the target, lie down flat.

    Action, shape (18,), all in [-1, 1]; -1 is off, 1 the largest value, linear in between:
        0-11: temperature to hold, or power, of the legs' TCAs, three of each leg: front left,
            front right, rear left, rear right; each lifts, or draws down to the front, or down to
            the rear.
        12-14: the same of the spines' TCAs; see ``SimulatedTask``.
        15-17: voltage of the spines' heaters.
        18: with ``fan``, whether a fan blows at the spines, above 0.

    Observation, shape (62,): see ``OBSERVATION``. The body angle is the bend from rail to rail;
    position and velocity are those of the middle of the spines.

    Reward, the sum of the terms in ``info["reward_terms"]``:
        progress: 10 per metre of headway, negative for going back.
        touch: -0.1 for every 0.1 s in which the robot touches the plate or its posts.
        damage: -5 for each spine whose TCA is for the first time contracted while it is stiff.
        finish: 20 when the robot lies flat and rigid on the target, all of its body on it.
        energy: Minus 1e-5 per joule.

    Reset: cold, flat and at rest before the plate, moved and turned a little at random. ``options``
    is the table of all that can be given.

    Terminates at the finish, which is a success if nothing was touched or damaged, or when the
    robot has fallen. Truncates after the time limit, and with ``info["truncation_reason"]`` if a
    TCA or a spine is too hot, a TCA torn, or if the simulation diverged.
    """

    max_power: ClassVar[NDArray[np.float64]] = np.array([4.0] * 12 + [40.0] * 3)  # [W]
    max_voltage = 25.0  # Sun, Section 6.1.3 [V]
    max_temperature = 180.0  # annealing temperature of the TCAs, Sun, Table 2.1 [°C]
    terms = ("progress", "touch", "damage", "finish", "energy")
    energy_price = 1e-5
    cameras = (*CAMERAS, "overview")
    scripted = "tca_mj.agents.scripts.course:CourseWalker"
    scripted_arguments = {"action": "power"}
    robot_argument = ("robot", _default)
    film_speed = 30.0
    published_speed = {"crawl": 2.4e-3, "walk": 9e-3, "shimmy": 0.75e-3}  # Sun, Section 6.3.2 [m/s]

    @door
    def __init__(
        self,
        *,
        robot: TetrapodSpec | None = None,
        fan: bool = False,
        timestep: Timestep = 5e-3,
        tca_period: Timestep = 2.5e-2,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            robot: The robot, by default one with ``LIFTING_SPINE``.
            fan: Whether there is a fan, of 1 m/s, that can blow at the spines; its energy is not
                counted.
            timestep: Physics time step [s].
            tca_period: Time between two updates of the TCAs, a multiple of ``timestep`` [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is unknown or the robot cannot be built.
        """
        parts("tca_period", type(self).control_period, tca_period)
        self.robot = self._robot(robot, common)
        sim = tetrapod_scene(
            mjcf("course.xml"), {}, self.robot, timestep=timestep, period=tca_period
        )
        seen = OBSERVATION.covering({"TCA length": (0.0, float(sim.bank.longest.max()))})
        self.fan = fan
        self._open(sim, seen, FANNED if fan else ACTION, _OPTIONS, **common)
        self.stance = Stance(sim, self.robot)
        self._find(self.model)
        self.touched = False
        self._x, self._harmed = 0.0, 0
        self._try("robot", robot)

    def _find(self, model: mujoco.MjModel) -> None:
        """Looks up the addresses of what is observed and judged."""
        self._plate = {model.geom(name).id for name in ("glass", "post0", "post1")}

        def end(name: str, sign: float) -> float:
            geom = model.geom(name)
            return float(geom.pos[0] + sign * geom.size[0])

        def top(name: str) -> float:
            geom = model.geom(name)
            return float(geom.pos[2] + geom.size[2])

        target = model.geom("target")
        self.places = Places(
            stand=end("glass", 1.0) + self.robot.rail_length / 2.0 + 0.025,
            first_edge=end("desk1", 1.0),
            second_edge=end("desk2", -1.0),
            beam_end=end("beam", 1.0),
            target=float(target.pos[0]),
            target_size=(float(target.size[0]), float(target.size[1])),
            beam_top=top("beam"),
            lower=top("desk2"),
            leg_station=self.robot.leg_station,
        )

    @property
    def position(self) -> NDArray[np.float64]:
        """Position of the middle of the spines in the world, shape (3,) [m]."""
        return self.data.qpos[self.stance.root : self.stance.root + 3]

    @property
    def body_angle(self) -> float:
        """Bend of the body from rail to rail [rad]."""
        return self.stance.bend(self.data)

    def prepare(self, setup: Setup) -> None:
        """Lays the robot before the plate."""

        def place(data: mujoco.MjData) -> None:
            turn = [np.cos(setup["yaw"] / 2.0), 0.0, 0.0, np.sin(setup["yaw"] / 2.0)]
            data.qpos[self.stance.root : self.stance.root + 7] = [*setup["position"], _START, *turn]

        self.sim.reset(place)
        self.touched, self._harmed = False, 0
        self._x = float(self.position[0])

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCAs are told, voltage of the heaters, and the fan; see the class."""
        voltage = self.max_voltage * ((command[TCAS : TCAS + SPINES] + 1.0) / 2.0)
        blows = self.fan and bool(command[-1] > 0.0)
        return Drive(command=self.heated(command[:TCAS]), voltage=voltage, fan=blows)

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """Headway, what was touched and damaged, and whether the robot lies on the target."""
        x, touches = float(self.position[0]), self._touches()
        headway, self._x = x - self._x, x
        self.touched = self.touched or touches
        before, self._harmed = self._harmed, int(self.sim.spines.damaged.sum())
        finished = self._finished() and not harmed
        unharmed = not (self.touched or self._harmed)
        terms = {
            "progress": 10.0 * headway,
            "touch": -0.1 * self.share if touches else 0.0,
            "damage": -5.0 * (self._harmed - before),
            "finish": 20.0 if finished else 0.0,
        }
        ended = "fallen" if self._fallen() else None
        if finished and not unharmed:
            ended = "finished, but something was touched or damaged"
        return Verdict(terms=terms, success=finished and unharmed, ended=ended)

    def _touches(self) -> bool:
        """Whether the robot touches the plate or its posts."""
        contact = self.data.contact
        return any(int(g) in self._plate for g in contact.geom[: self.data.ncon].ravel())

    def _finished(self) -> bool:
        """Whether the robot lies flat and rigid with its body on the target."""
        x, y, _ = self.position
        half_x, half_y = self.places.target_size
        return bool(
            abs(x - self.places.target) <= half_x
            and abs(y) <= half_y
            and self.body_angle < _FLAT
            and self.sim.spines.temperature.max() < _COLD
        )

    def _fallen(self) -> bool:
        """Whether the robot has turned over or dropped into the gap."""
        _, x, y, _ = self.data.qpos[self.stance.root + 3 : self.stance.root + 7]
        return bool(1.0 - 2.0 * (x * x + y * y) < _TURNED or self.position[2] < _LOST)

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        data, sim = self.data, self.sim
        start, dof = self.stance.root, self.stance.motion
        turn = data.qpos[start + 3 : start + 7]
        return {
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA tension": sim.tension,
            "spine temperature": sim.spines.temperature,
            "body angle": self.body_angle,
            "position": self.position,
            "orientation": turn if turn[0] >= 0.0 else -turn,
            "velocity": data.qvel[dof : dof + 3],
            "angular velocity": data.qvel[dof + 3 : dof + 6],
        }

    def details(self) -> dict[str, Any]:
        """What was touched, the body's angle [rad] and the place of its middle [m]."""
        return {
            "touched_plate": self.touched,
            "body_angle": self.body_angle,
            "position": self.position.copy(),
        }

    def bent(self) -> float:
        """See ``body_angle``."""
        return self.body_angle

    def headway(self) -> Headway:
        """Along the course, from its beginning."""
        x, y, _ = self.position.tolist()
        weight = 9.81 * float(self.model.body_subtreemass[self.stance.hub])
        return Headway(along=x, aside=y, weight=weight)

    def outcome(self) -> dict[str, Any]:
        """Friction, and what was touched or damaged."""
        return {
            "friction": round(self.variation.friction, 6),
            "touched_plate": self.touched,
            "damaged": bool(self.sim.spines.damaged.any()),
        }


TetrapodCourseVector = partial(TaskVector, TetrapodCourse)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

"""``TCA/TetrapodCrawl-v0``, ``Walk`` and ``Shimmy``: a robot of one shape follows commands, as
fast as it can where nothing else is said (Sun, 6.3.2)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import door, number, require_one_of
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.command import (
    Command,
    Following,
    Retelling,
    command_options,
    commanded,
    drawn,
)  # fmt: skip
from tca_mj.envs.gaits import ACTION, OBSERVATION, RECIPES, TASKS, GaitTask, told
from tca_mj.envs.options import Constant, Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.outcome import Headway, TaskState, Verdict
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.stance import CAMERAS, Stance, tetrapod_scene
from tca_mj.envs.table import Table
from tca_mj.envs.task import SimulatedTask, TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.robots.tetrapod import LEGS, TetrapodSpec

# Updates of the TCAs in a control step, at least. With one in every physics step the searched walk
# is 1.0 % slower, the other gaits 0.3 % or less; with a single one the scripted walk is 1.2 %
# faster: scripts/tetrapod_contacts.py.
_UPDATES = 2
_SETTLING = 0.5  # time in which the robot comes to rest after it is put down [s]
_UPRIGHT = 0.5  # cosine of the tilt from which on it has fallen over
_STEEPEST = math.radians(10.0)  # largest slope of the ground [rad]
_GOLDEN = math.radians(137.5)  # angle between two pushes: they come from all sides
_SLID = 0.5  # speed at which it slides down a slope, fifty times what it walks [m/s]
_SUNK = 12e-3  # depth below its first height at which it has fallen off the beam [m]


def _fine_legs(spec: TetrapodSpec) -> dict[str, Any]:
    """Legs of ten nodes; their plates have the mass of the others'."""
    fill = spec.leg.plate_fill * (spec.leg.nodes + 1) / 11.0
    return {"robot": replace(spec, leg=replace(spec.leg, nodes=10, plate_fill=fill))}


def _fine_body(spec: TetrapodSpec) -> dict[str, Any]:
    """With these legs, every spine an elastic chain of its own."""
    return {**_fine_legs(replace(spec, nodes=6)), "body": "fine"}


class TetrapodGait(SimulatedTask):
    """Get on as commanded, cold and rigid in one shape, by the legs alone.

    The morphing tetrapod crawls flat, walks with its body bent to a right angle, or shimmies along
    a beam that its U-shaped body and its legs embrace. It senses its TCAs, its own motion and
    which legs touch; it acts by heating the three TCAs of each leg.

    Action, shape (12,), all in [-1, 1]: temperature to hold, or power, of the TCAs ``tca0``
    (lifts), ``tca1`` (front, down) and ``tca2`` (rear, down) of the legs front left, front right,
    rear left and rear right; see ``SimulatedTask``. Left and right are mirror images, which the
    tables say.

    A command is a heading that may turn, a direction of travel to the left of it, and a speed. It
    comes with ``reset``, with ``order`` at any time, or, with the option ``wander``, is drawn anew
    every 8 to 20 s. Without any, the robot is to go along x as fast as it can.

    Observation, shape (71,): see ``OBSERVATION``, whose rows have units and bounds. Orientation is
    that of the hub, the middle of the spines, in the world, with a first number that is not
    negative; height is the hub's above what the robot stands on. Velocities, feet (x, y, z of each
    leg's) and the commanded direction (x and y of a unit vector) are in the hub's frame: x forward,
    y left, z up. What is seen of how the command is followed is explained at ``Following``.

    Reward, the sum of the terms in ``info["reward_terms"]``. The first four pay for a change and
    take it back, so that nothing is earned by shaking:
        progress: Distance gained along the commanded direction over the published speed [s].
        drift: Minus half of what is gained in distance from the line of that direction through
            where it was commanded, over the published speed.
        lead: Minus twice what is gained in distance ahead of the commanded speed, over the
            published speed: faster than commanded is as bad as slower.
        turn: Minus what the robot gets away from the commanded heading, 0.1 m for a radian, over
            the published speed.
        posture: Minus 0.2 (1 - cosine of the tilt), every 0.1 s.
        energy: Minus 0.002 per joule of electrical energy.
        heat: Minus 0.002 for every kelvin by which a TCA is above ``hot_temperature``, every 0.1 s.
        end: Minus 5 in the step in which the robot falls, or a TCA is too hot or torn.

    Reset: the robot is put down at the origin and comes to rest, for 0.5 s that are not counted.
    Where it looks and how far its body is bent is drawn; ``options`` is the table of all that can
    be given: commands, a slope, pushes, and by how much the robot is off. On a slope it is gravity
    that is tilted, so that the world's z stays that of the ground.

    Terminates with ``info["termination_reason"]`` when the robot has fallen over or off the beam,
    or slides down a slope. Truncates after the time limit, and with ``info["truncation_reason"]``
    if a TCA is too hot or torn, or if the simulation diverged.

    Example:
        >>> from tca_mj.envs import TetrapodGait
        >>> env = TetrapodGait(gait="crawl")
        >>> observation, info = env.reset(seed=0)
        >>> observation.shape, env.action_space.shape
        ((71,), (12,))
    """

    # Of each TCA of a leg [W]. Estimate: through its cold 3.7 ohm about 1 A, the most that is
    # reported of bare TCAs, which bore it unharmed for 2 s (Sun, Section 2.2.2).
    max_power: ClassVar[float] = 4.0
    max_temperature: ClassVar[float] = 180.0  # annealing temperature, Sun, Table 2.1 [°C]
    hot_temperature: ClassVar[float] = 172.0  # from here on heat is charged [°C]
    terms = ("progress", "drift", "lead", "turn", "posture", "energy", "heat", "end")
    energy_price, heat_price, end_price = 0.002, 0.002, 5.0
    cameras = CAMERAS  # all follow the robot
    scripted = "tca_mj.agents.scripts.tetrapod:scripted"
    scripted_arguments = {"action": "power"}
    robot_argument = ("robot", TetrapodSpec)
    finer = {"legs": _fine_legs, "fine": _fine_body}
    legs = len(LEGS)
    table: ClassVar[Table] = OBSERVATION
    spot: tuple[float, float] = (0.0, 0.0)  # where it is put down, x and y [m]
    bend_range: ClassVar[float] = math.radians(1.0)  # largest deviation of the body's bend [rad]

    @door
    def __init__(
        self,
        *,
        gait: str = "walk",
        robot: TetrapodSpec | None = None,
        body: str = "rigid",
        timestep: Timestep = 6.25e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            gait: ``crawl``, ``walk`` or ``shimmy``.
            robot: The robot, by default the published one as far as it is known.
            body: One of ``tca_mj.envs.stance.BODIES``. The body is cold: ``rigid`` is all that its
                gaits need. ``elastic`` and ``fine`` have the spines' springs, heaters and TCAs and
                say what rigidity leaves out; with ``fine`` the legs are as the robot's, too.
            timestep: Physics time step, of which ``control_period`` is a multiple [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is unknown or out of range, or the robot cannot be built.
        """
        self.gait = require_one_of("gait", gait, list(TASKS))
        self.robot = self._robot(robot, common)
        objects = {} if self.task.beam is None else {"beam": mjcf("beam.xml")}
        sim = tetrapod_scene(
            mjcf("ground.xml"),
            objects,
            self.robot,
            timestep=timestep,
            period=_period(type(self).control_period, timestep),
            body=body,
            bend=self.task.bend,
        )
        self.stance = Stance(sim, self.robot)
        longest, spec = float(sim.bank.longest.max()), self.robot
        size = spec.spine.length + spec.rail_length + 2.0 * longest
        seen = self.table.covering(
            {"TCA length": (0.0, longest), "foot position": (-size, size), "height": (-size, size)}
        )
        self._open(sim, seen, ACTION, self._options(), **common)
        self._following = Following(Command())
        self._until, self._wander, self._first = math.inf, 0.0, 0.0
        self._bend, self._gravity = self.task.bend, (0.0, 0.0, -9.81)
        self._push, self._pushes, self._push_every, self._push_way = 0.0, 0, 1.0, 0.0
        self._try("robot", robot)

    @property
    def task(self) -> GaitTask:
        """What is asked for."""
        return TASKS[self.gait]

    @property
    def reference(self) -> float:
        """The speed that earns 1 per second [m/s]."""
        return self.task.speed

    @classmethod
    def recipes_for(cls, arguments: Mapping[str, Any]) -> Mapping[str, Recipe]:
        """As every task's; the gaits differ in whose steps come first."""
        return RECIPES[arguments.get("gait", "walk")]

    def _options(self) -> Options:
        task = self.task
        bends = task.bend - self.bend_range, task.bend + self.bend_range
        return Options(
            [
                Option(
                    name="yaw", about="where the robot looks, from world x to y", unit="rad",
                    low=-task.yaw_range, high=task.yaw_range, drawn="drawn",
                    draw=Uniform(-task.yaw_range, task.yaw_range),
                ),
                Option(
                    name="bend", about="bend of its body", unit="rad", low=bends[0], high=bends[1],
                    draw=self._draw_bend, drawn="drawn",
                ),
                *command_options(fastest=task.fastest, turning=task.turning, ways=task.ways),
                Option(
                    name="slope", about="slope of the ground", unit="rad", low=-_STEEPEST,
                    high=_STEEPEST, draw=Constant(0.0), drawn="0",
                ),
                Option(
                    name="slope_direction", about="where it rises to, from world x to y",
                    unit="rad", low=-math.pi, high=math.pi, draw=Constant(0.0), drawn="0",
                ),
                Option(
                    name="push", about="velocity by which the robot is pushed now and then",
                    unit="m/s", low=0.0, high=0.2, draw=Constant(0.0), drawn="0",
                ),
                Option(
                    name="push_every", about="time between pushes", unit="s", low=1.0, high=600.0,
                    draw=Constant(20.0), drawn="20",
                ),
                Option(
                    name="push_direction", about="of the first push, from world x to y; each"
                    " other is turned by 137.5°", unit="rad", low=-math.pi, high=math.pi,
                    draw=Uniform(-math.pi, math.pi), drawn="drawn",
                ),
                *variation_options(),
            ]
        )  # fmt: skip

    def _draw_bend(self, random: np.random.Generator, setup: Setup) -> float:
        return self.task.bend + random.uniform(-self.bend_range, self.bend_range)

    def prepare(self, setup: Setup) -> None:
        """Puts the robot down, where it comes to rest."""
        task = self.task
        self._bend, slope, uphill = setup["bend"], setup["slope"], setup["slope_direction"]
        across, down = -9.81 * math.sin(slope), -9.81 * math.cos(slope)
        self._gravity = across * math.cos(uphill), across * math.sin(uphill), down
        self.model.opt.gravity[:] = self._gravity
        self.sim.reset(
            self.stance.placer(
                bend=self._bend, position=self.spot, yaw=setup["yaw"], above=task.beam or 0.0
            )
        )
        self.sim.step(np.zeros(self.sim.n), _SETTLING)
        self.data.time = 0.0
        self._first = float(self.stance.position(self.data)[2])
        self._following = Following(commanded(setup, task.fastest), place=self._place()).moved(
            *self._place(), self._yaw(), 0.0
        )
        self._wander, self._until = setup["wander"], math.inf
        if self._wander:
            self._draw_command()
        self._push, self._pushes = setup["push"], 0
        self._push_every, self._push_way = setup["push_every"], setup["push_direction"]

    def order(
        self,
        *,
        direction: float | None = None,
        speed: float | None = None,
        turning: float | None = None,
        heading: float | None = None,
    ) -> None:
        """Gives another command, from the next step on; what is left out stays as it is.

        Args:
            direction: Of travel, from the commanded heading to its left [rad].
            speed: From the task's ``fastest`` on as fast as the robot can [m/s].
            turning: Rate at which the commanded heading turns to the left [rad/s].
            heading: The commanded heading, from world x to y [rad].

        Raises:
            ValueError: As the options of ``reset``.
        """
        old = self._following.command
        rows = {row.name: row for row in self.options.rows}
        given = {"direction": direction, "speed": speed, "turning": turning}
        kept = old._asdict() | {
            name: rows[name].checked(value) for name, value in given.items() if value is not None
        }
        if kept["speed"] >= self.task.fastest:
            kept["speed"] = math.inf
        self._following = self._following.told(Command(**kept))
        if heading is not None:
            self._following = self._following._replace(heading=number("heading", heading))

    @property
    def following(self) -> Following:
        """What the robot is told, and how it has followed that."""
        return self._following

    def _draw_command(self) -> None:
        task = self.task
        command, time = drawn(
            self.np_random, self._wander, fastest=task.fastest, turning=task.turning, ways=task.ways
        )
        self._following = self._following.told(command)
        self._until = self.sim.time + time

    def _place(self) -> tuple[float, float]:
        x, y, _ = self.stance.position(self.data).tolist()
        return x, y

    def _yaw(self) -> float:
        turn = self.stance.rotation(self.data)
        return math.atan2(turn[1, 0], turn[0, 0])

    def set_state(self, state: TaskState) -> None:
        """As every task's; a rigid body gets its shape back, the ground its slope."""
        super().set_state(state)
        self.stance.shape(self._bend)
        self.model.opt.gravity[:] = self._gravity

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the legs' TCAs are told; see the class."""
        if self._push and self.sim.time >= (self._pushes + 1) * self._push_every - 1e-9:
            way = self._push_way + self._pushes * _GOLDEN
            root = self.stance.motion
            self.data.qvel[root : root + 2] += self._push * np.array([math.cos(way), math.sin(way)])
            self._pushes += 1
        return Drive(command=self.heated(command))

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """Headway, and whether the robot has fallen."""
        before = self._following
        self._following = before.moved(*self._place(), self._yaw(), self.interval)
        tilt = 1.0 - float(self.stance.rotation(self.data)[2, 2])
        terms = self._following.earned(before, self.reference)
        terms["posture"] = -0.2 * self.share * tilt
        if self.sim.time >= self._until - 1e-9:
            self._draw_command()
        return Verdict(terms=terms, ended=self._fallen(tilt), seen=self._told())

    def _fallen(self, tilt: float) -> str | None:
        """How the robot has fallen or slid, or None."""
        if tilt > 1.0 - _UPRIGHT:
            return "fell over"
        if math.hypot(*self.stance.velocity(self.data)[0][:2]) > _SLID:
            return "slid away"
        if self.task.beam and self.stance.position(self.data)[2] < self._first - _SUNK:
            return "fell off the beam"
        return None

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        return {**self.stance.sensed(self.sim, self.task.beam or 0.0), **self._told()}

    def _told(self) -> dict[str, ArrayLike]:
        """Rows of the observation that say what is commanded, and how well it is followed."""
        turn = self.stance.rotation(self.data)
        return told(self._following, turn, self.task.fastest)

    @property
    def retelling(self) -> Retelling:
        """How memories are told with other commands."""
        task = self.task
        return Retelling(
            self.observation, self.reference, task.fastest, task.ways, self.control_period
        )

    def details(self) -> dict[str, Any]:
        """Headway [m], speed [m/s] and how far it looks from where it ought to [rad]."""
        time = self.sim.time
        return {
            "distance": self._following.along,
            "drift": self._following.aside,
            "across": self._following.across,
            "heading_error": self._following.error,
            "speed": self._following.along / time if time > 0.0 else 0.0,
        }

    def bent(self) -> float:
        """Angle between the ends of the spines [rad]."""
        return self.stance.bend(self.data)

    def headway(self) -> Headway:
        """From where it was put down."""
        weight = 9.81 * float(self.model.body_subtreemass[self.stance.hub])
        now = self._following
        return Headway(along=now.along, aside=now.aside, weight=weight)


def _period(control_period: float, timestep: float) -> float:
    """The longest time between updates of the TCAs of which there are enough in a control step.

    Raises:
        ValueError: If the control period is no multiple of the time step.
    """
    steps = parts("timestep", control_period, timestep)
    updates = next((n for n in range(_UPDATES, steps) if steps % n == 0), steps)
    return control_period / updates


TetrapodGaitVector = partial(TaskVector, TetrapodGait)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

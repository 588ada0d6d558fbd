"""``TCA/AdaptiveGrasp-v0``: a base that morphs to the size of an object, and fingers that pinch it.

After Sun, Section 6.3.1: a sponge, a can, a ping-pong ball and a glove.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import door, some
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.objects import named, stand, touching
from tca_mj.envs.options import Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.outcome import TaskState, Verdict
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.rewards import tolerance
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.model.part import Part
from tca_mj.model.scene import scene
from tca_mj.robots.adaptive_gripper import SIDES, AdaptiveGripperSpec, adaptive_gripper
from tca_mj.sim import Simulation

_TCAS = (1, 3, 2)  # of base, finger 0 and finger 1, left and right swapped

OBSERVATION = Table(
    [
        Entry("carriage height", 1, 0.0, 1.2, "m", centre=0.15, scale=0.05),
        Entry("carriage velocity", 1, -1.0, 1.0, "m/s", scale=0.04),
        Entry("spine temperature", 1, -50.0, 400.0, "°C", centre=70.0, scale=50.0),
        Entry("TCA temperature", 3, -50.0, 300.0, "°C", centre=100.0, scale=75.0, mirror=_TCAS),
        Entry("TCA length", 3, 0.0, 1.0, "m", centre=0.15, scale=0.07, mirror=_TCAS),
        Entry("TCA resistance", 3, 0.0, 40.0, "ohm", centre=11.0, scale=5.0, mirror=_TCAS),
        Entry("TCA tension", 3, 0.0, 5.0, "N", centre=0.2, scale=0.2, mirror=_TCAS),
        Entry("angle of the base", 1, -7.0, 7.0, "rad", centre=1.6, scale=1.6),
        Entry("its angular velocity", 1, -200.0, 200.0, "rad/s", scale=2.0),
        Entry("pads, x and z", 4, -1.2, 1.2, "m", scale=0.1, mirror=(-3, 4, -1, 2)),
        Entry("object width", 1, 0.0, 0.1, "m", centre=0.04, scale=0.02),
        Entry("object mass", 1, 0.0, 0.5, "kg", centre=6e-3, scale=5e-3),
        Entry("where to pinch it", 3, -1.2, 1.2, "m", scale=0.1, mirror=(-1, 2, 3)),
        Entry("object orientation", 4, -1.0, 1.0, "quaternion wxyz", mirror=(1, 2, -3, -4)),
        Entry("object velocity", 3, -10.0, 10.0, "m/s", scale=0.1, mirror=(-1, 2, 3)),
        Entry("time held", 1, 0.0, 10.0, "s", centre=5.0),
    ]
)
ACTION = Table(
    [
        Entry("heater voltage", 1, -1.0, 1.0, "-", off=-1.0),
        Entry("TCA heating", 3, -1.0, 1.0, "-", off=-1.0, mirror=_TCAS),
        Entry("fan", 1, -1.0, 1.0, "on above 0"),
        Entry("carriage velocity", 1, -1.0, 1.0, "-"),
    ]
)


@dataclass(frozen=True, slots=True)
class Thing:
    """An object, as its file in assets/mjcf has it.

    Attributes:
        width: Width where it is pinched [m].
        mass: Mass [kg].
        height: Height of its origin while it stands [m].
        pinched: How far above its origin it is pinched [m].
        parked: x and y of where it stands while it is not used [m].
    """

    width: float
    mass: float
    height: float
    pinched: float
    parked: tuple[float, float]


OBJECTS = {
    "sponge": Thing(50e-3, 2.0e-3, 20e-3, 6e-3, (-0.13, 0.10)),
    "can": Thing(66e-3, 14.0e-3, 61e-3, 34e-3, (-0.05, 0.14)),
    "ball": Thing(40e-3, 2.7e-3, 20e-3, -4e-3, (0.05, 0.13)),
    "glove": Thing(12e-3, 5.0e-3, 25e-3, 8e-3, (0.12, 0.10)),
}

_LIFTED = 10e-3  # height above the table at which an object counts as held [m]
_FREE = 0.3  # time untouched after which it is let go [s]
# Largest offset of the object in x, in which the pads close on it, and in y, where they cannot
# follow it [m].
_ASIDE = np.array([2e-3, 0.5e-3])
_LOST = 0.12  # distance from the middle at which it is out of reach [m]
_FOLDED = 1.5  # angle of a finger's joint at which it is crushed against something [rad]
_CLEAR = 0.2e-3  # height above the table of what is parked, so that nothing touches [m]



def _place(random: np.random.Generator, setup: Setup) -> NDArray[np.float64]:
    return random.uniform(-_ASIDE, _ASIDE)


def _check_place(place: NDArray[np.float64]) -> None:
    if (np.abs(place) > _ASIDE + 1e-9).any():
        raise ValueError(f"object_position must be within {_ASIDE} m of 0, got {place}")


_OPTIONS = Options(
    [
        Option(name="object", about="what is grasped", choices=tuple(OBJECTS)),
        Option(name="object_position", unit="m", shape=(2,), draw=_place, check=_check_place,
               about="x, within 2 mm, and y, within 0.5 mm, from below the gripper"),
        Option(name="start", about="angle of the cold base at the start", unit="rad",
               low=0.0, high=math.radians(230.0), draw=Uniform(0.0, math.radians(90.0)),
               drawn="drawn, up to 90°"),
        *variation_options(),
    ]
)  # fmt: skip


class AdaptiveGrasp(SimulatedTask):
    """Grasp objects of 12 to 66 mm, each of which needs another angle of the base.

    A module with a shape-memory spine hangs by its middle from a carriage that moves up and down; a
    soft finger hangs at each of its ends. Heated, the base is soft and its TCA bends it; cold it is
    rigid, and the fingers' TCAs make them pinch. To contract the base's TCA against a stiff spine
    damages it.

    Action, shape (6,), all in [-1, 1]:
        0: voltage of the base's heater; -1 is off, 1 is ``max_voltage``, linear in between.
        1-3: temperature to hold, or power, of the TCAs ``base.tca``, ``finger0.tca`` and
            ``finger1.tca``; see ``SimulatedTask``.
        4: fan at the base; it blows above 0.
        5: velocity of the carriage over its largest speed; positive is up.

    Observation, shape (35,): see ``OBSERVATION``, whose rows have units and bounds. The gripper is
    in the x-z plane; the middles of its pads' faces are listed as x and z of the one, then of the
    other.

    Reward, the sum of the terms in ``info["reward_terms"]``. The first three pay for progress and
    take it back:
        reach: Change of a measure from 0 to 1 of how close the pads are to where to pinch.
        lift: Change of a measure from 0 to 4 of how high the object is above the table, up to 10
            mm.
        hold: Change of the time for which it has been held without a break, up to 10 s [s].
        goal: 20 in the step in which it has been let go after that.
        energy: Minus 0.005 per joule of electrical energy of heater and TCAs.
        damage: Minus 10 in the step in which the base's TCA is damaged.

    It is held while it is 10 mm above the table and a finger touches it, and let go when no finger
    has touched it for 0.3 s.

    Reset: everything is cold, the base fixed in some angle above the object. ``options`` is the
    table of all that can be given.

    Terminates when the object, having been held for 10 s, has been let go (success), when it is out
    of reach, or when a finger is folded by being pressed on something. Truncates after the time
    limit, and with ``info["truncation_reason"]`` if the base's TCA is damaged, a TCA too hot or
    torn, the spine too hot, or if the simulation diverged.
    """

    max_voltage = 25.0  # Sun, Section 6.1.3 [V]
    max_power: ClassVar[NDArray[np.float64]] = np.array([40.0, 10.0, 10.0])  # estimates [W]
    response = 0.2  # twice the time between two updates; estimate [s]
    hold_time: ClassVar[float] = 10.0  # for which the object is to be held [s]
    terms = ("reach", "lift", "hold", "goal", "energy", "damage")
    energy_price = 0.005
    camera_prefix = "cameras."
    scripted = "tca_mj.agents.scripts.adaptive:scripted"
    scripted_arguments = {"action": "power"}
    robot_argument = ("gripper_spec", AdaptiveGripperSpec)
    recipes = {"sac": Recipe.held(8000, 0.5, mirrored=True)}
    film_speed = 4.0

    @door
    def __init__(
        self,
        *,
        gripper_spec: AdaptiveGripperSpec | None = None,
        timestep: Timestep = 5e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            gripper_spec: The gripper.
            timestep: Physics time step, a whole fraction of ``control_period``, in which TCAs and
                spine are updated once [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is out of range or the gripper cannot be built.
        """
        own = type(self).control_period
        parts("timestep", own, timestep)
        self.gripper_spec = self._robot(gripper_spec, common)
        sim = Simulation(_scene(self.gripper_spec), timestep=timestep, tca_period=own)
        longest = float(sim.bank.longest.max())
        size = self.gripper_spec.lift.travel[1] + longest
        around = (-size, size)
        seen = OBSERVATION.covering(
            {
                "carriage height": (0.0, size), "TCA length": (0.0, longest),
                "TCA resistance": (0.0, 2.0 * float(sim.resistance.max())),
                "pads, x and z": around, "where to pinch it": around,
            }
        )  # fmt: skip
        self._open(sim, seen, ACTION, _OPTIONS, **common)
        self._find(self.model)
        self.object = "ball"
        self.held_for, self._untouched, self._kept = 0.0, 0.0, False
        self._progress = self._measure()
        self._try("gripper_spec", gripper_spec)

    def _find(self, model: mujoco.MjModel) -> None:
        """Looks up the addresses of what is observed and set."""
        lift = model.joint("gripper.lift").id
        self._lift_q, self._lift_v = int(model.jnt_qposadr[lift]), int(model.jnt_dofadr[lift])
        names = [model.joint(i).name for i in range(model.njnt)]
        bends = [i for i, name in enumerate(names) if name.startswith("gripper.base.half")
                 and ".bend_x" in name]  # fmt: skip
        self._bend_q, self._bend_v = model.jnt_qposadr[bends], model.jnt_dofadr[bends]
        fingers = [i for i, name in enumerate(names) if name.startswith("gripper.finger")]
        self._fingers_q = model.jnt_qposadr[fingers]
        self._pads = [int(model.site(f"gripper.finger{i}.pad").id) for i in range(SIDES)]
        self._is_hand = named(model, "gripper.finger")
        self._is_object = {name: named(model, f"{name}.") for name in OBJECTS}
        self._bodies = {
            name: np.flatnonzero([model.body(i).name.startswith(f"{name}.")
                                  for i in range(model.nbody)]) for name in OBJECTS
        }  # fmt: skip
        free = {name: model.joint(f"{name}.free").id for name in OBJECTS}
        self._free_q = {name: int(model.jnt_qposadr[i]) for name, i in free.items()}
        self._free_v = {name: int(model.jnt_dofadr[i]) for name, i in free.items()}

    @property
    def thing(self) -> Thing:
        """The object of this episode."""
        return OBJECTS[self.object]

    @property
    def angle(self) -> float:
        """Angle by which the base is bent, positive towards its TCA [rad]."""
        return float(self.data.qpos[self._bend_q].sum())

    def prepare(self, setup: Setup) -> None:
        """Puts the gripper up, its cold base bent, and the objects where they belong."""
        self.object = setup["object"]
        self._park()

        def place(data: mujoco.MjData) -> None:
            data.qpos[self._lift_q] = data.act[0] = self.gripper_spec.lift.height
            data.qpos[self._bend_q] = setup["start"] / len(self._bend_q)
            for name, thing in OBJECTS.items():
                mine = name == self.object
                aside = setup["object_position"] if mine else thing.parked
                height = thing.height + (0.0 if mine else _CLEAR)
                stand(data, self._free_q[name], [*aside, height])

        self.sim.reset(place)
        self.held_for, self._untouched, self._kept = 0.0, 0.0, False
        self._progress = self._measure()

    def _park(self) -> None:
        """Lets what is not used float where it is: at rest it costs no contacts."""
        for name, bodies in self._bodies.items():
            self.model.body_gravcomp[bodies] = float(name != self.object)

    def set_state(self, state: TaskState) -> None:
        """As of all tasks; and the other objects float."""
        super().set_state(state)
        self._park()

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCAs are told, heater and fan and, at once, the carriage; see the class."""
        self.data.ctrl[0] = self.gripper_spec.lift.speed * command[5]
        return Drive(
            command=self.heated(command[1:4]), voltage=self.max_voltage * (command[0] + 1.0) / 2.0,
            fan=bool(command[4] > 0.0),
        )  # fmt: skip

    @property
    def height(self) -> float:
        """Height of the object above where it stands [m]."""
        return float(self.data.qpos[self._free_q[self.object] + 2]) - self.thing.height

    @property
    def touched(self) -> bool:
        """Whether a finger touches the object."""
        return touching(self.data, self._is_object[self.object], self._is_hand)

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """How near, how high and for how long the object has been held; whether it is let go."""
        touched = self.touched
        held = touched and self.height >= _LIFTED
        self.held_for = self.held_for + self.interval if held else 0.0
        self._kept = self._kept or self.held_for > self.hold_time - 1e-9
        self._untouched = 0.0 if touched else self._untouched + self.interval
        before, self._progress = self._progress, self._measure()
        terms = {name: value - before[name] for name, value in self._progress.items()}
        success = self._kept and self._untouched > _FREE - 1e-9 and not harmed
        terms["goal"] = 20.0 if success else 0.0
        terms["damage"] = -10.0 if some(self.sim.spines.damaged) else 0.0
        return Verdict(
            terms=terms, success=success, seen={"time held": self._time_held()},
            ended=None if success or harmed else self._lost(),
        )  # fmt: skip

    def _lost(self) -> str | None:
        """Why nothing can be grasped any more, or None."""
        if np.abs(self.data.qpos[self._fingers_q]).max() > _FOLDED:
            return "finger crushed"
        return "object out of reach" if np.hypot(*self._place()[:2]) > _LOST else None

    def _place(self) -> NDArray[np.float64]:
        start = self._free_q[self.object]
        return self.data.qpos[start : start + 3]

    def _time_held(self) -> float:
        return self.hold_time if self._kept else min(self.held_for, self.hold_time)

    def _pinched(self) -> NDArray[np.float64]:
        """Where to pinch the object [m]."""
        return self._place() + [0.0, 0.0, self.thing.pinched]

    def _measure(self) -> dict[str, float]:
        """How far the task has got, by reward term."""
        middle = self.data.site_xpos[self._pads].mean(axis=0)
        near = float(tolerance(math.dist(middle, self._pinched()), (0.0, 5e-3), margin=0.1))
        height = min(max(self.height / _LIFTED, 0.0), 1.0)
        return {"reach": near, "lift": 4.0 * height, "hold": self._time_held()}

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        data, sim, start = self.data, self.sim, self._free_q[self.object]
        turn, dofs = data.qpos[start + 3 : start + 7], self._free_v[self.object]
        return {
            "carriage height": data.qpos[self._lift_q],
            "carriage velocity": data.qvel[self._lift_v],
            "spine temperature": sim.spines.temperature,
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA resistance": sim.resistance,
            "TCA tension": sim.tension,
            "angle of the base": self.angle,
            "its angular velocity": data.qvel[self._bend_v].sum(),
            "pads, x and z": data.site_xpos[self._pads][:, [0, 2]].ravel(),
            "object width": self.thing.width,
            "object mass": self.thing.mass,
            "where to pinch it": self._pinched(),
            "object orientation": turn if turn[0] >= 0.0 else -turn,
            "object velocity": data.qvel[dofs : dofs + 3],
            "time held": self._time_held(),
        }

    def harm(self) -> str | None:
        """What the gripper does not survive, or None."""
        if some(self.sim.spines.damaged):
            return "damaged: the base's TCA contracted against a stiff spine"
        return super().harm()

    def details(self) -> dict[str, Any]:
        """Object, its height [m], whether it is touched, how long it was held, and the angle."""
        return {
            "object": self.object, "height": self.height, "touched": self.touched,
            "held_for": self._time_held(), "angle": self.angle,
        }  # fmt: skip

    def outcome(self) -> dict[str, Any]:
        """What was grasped, and for how long it was held [s]."""
        return {"object": self.object, "held_for": self._time_held()}

    def bent(self) -> float:
        """See ``angle``."""
        return self.angle


def _scene(spec: AdaptiveGripperSpec) -> Part:
    """The gripper above a table, with all objects; gravity on these can be turned off."""
    files = {name: mjcf(f"{name}.xml") for name in (*OBJECTS, "cameras")}
    part = scene(mjcf("arena.xml"), adaptive_gripper(spec), files, name="gripper")
    # Between pads as light as these the can slides by 5 mm/s where pyramids stand for cones.
    part.spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    for body in part.spec.bodies:
        if body.name.split(".")[0] in OBJECTS:
            body.gravcomp = 1.0
    return part


AdaptiveGraspVector = partial(TaskVector, AdaptiveGrasp)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

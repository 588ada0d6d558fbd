"""``TCA/ArmPickPlace-v0``: a soft arm lays an object into a cup (Sun, Section 4.1.4)."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, ClassVar, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import door, require_one_of
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.objects import named, stand, touching
from tca_mj.envs.options import Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.outcome import Verdict
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.rewards import tolerance
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.model.scene import scene
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.sim import Simulation

# Objects, with the width that the gripper has to reach round [m].
OBJECTS = {"screwdriver": 8e-3, "pcb": 3.6e-3}

OBSERVATION = Table(
    [
        Entry("base height", 1, 0.0, 0.6, "m", centre=0.12, scale=0.05),
        Entry("base velocity", 1, -1.0, 1.0, "m/s", scale=0.04),
        Entry("TCA temperature", 5, -50.0, 300.0, "°C", centre=100.0, scale=75.0),
        Entry("TCA length", 5, 0.0, 0.5, "m", centre=0.07, scale=0.04),
        Entry("TCA tension", 5, 0.0, 5.0, "N", centre=0.1, scale=0.1),
        Entry("gripper opening", 1, 0.0, 0.05, "m", centre=0.01, scale=0.01),
        Entry("gripper position", 3, -0.6, 0.6, "m", scale=0.05),
        Entry("gripper orientation", 4, -1.0, 1.0, "quaternion wxyz"),
        Entry("object width", 1, 0.0, 0.02, "m", centre=6e-3, scale=2e-3),
        Entry("object position", 3, -0.6, 0.6, "m", scale=0.05),
        Entry("object orientation", 4, -1.0, 1.0, "quaternion wxyz"),
        Entry("object velocity", 3, -10.0, 10.0, "m/s", scale=0.05),
        Entry("object angular velocity", 3, -2000.0, 2000.0, "rad/s", scale=2.0),
        Entry("object carried", 1, 0.0, 1.0, "1 once it has been lifted off its stand", centre=0.5),
        Entry("cup position", 3, -0.6, 0.6, "m", scale=0.025),
    ]
)
_FAR = 25e-3  # from where on an offset is seen as no larger [m]
OFFSETS = (
    Entry("gripper to object", 3, -_FAR, _FAR, "m", scale=5e-3),
    Entry("object to cup", 2, -_FAR, _FAR, "m", scale=1e-2),
    Entry("misalignment", 1, -np.pi / 2.0, np.pi / 2.0, "rad", scale=0.3),
    Entry("spare opening", 1, -_FAR, _FAR, "m", scale=3e-3),
)
"""Rows of an observation with ``offsets``: what the others say, as differences."""
ACTION = Table(
    [
        Entry("TCA heating", 5, -1.0, 1.0, "-", off=-1.0),
        Entry("base velocity", 1, -1.0, 1.0, "-"),
    ]
)

_STAND = 25e-3  # height of the objects' centres on their stands [m]
_LIFTED = 8e-3  # height above the stand at which an object counts as carried [m]
_PARKED = (0.06, 0.05)  # where the object that is not used stands [m]
# Turns the gripper's y and z axes, so that a gripper that hangs straight has no rotation.
_HANGING = np.array([1.0, -1.0, -1.0] * 3)
_CUP_RADIUS, _CUP_RIM = 12.5e-3, 16e-3  # of assets/mjcf/cup.xml [m]


def yaw(orientation: NDArray[np.float64]) -> float:
    """Angle about the world's z axis of a quaternion wxyz [rad]."""
    w, x, y, z = orientation
    return float(np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)))


def misaligned(long_side: float, gripper: float) -> float:
    """By which angle a gripper has to turn to lie across an object, half turns aside [rad].

    Args:
        long_side: Yaw of the object's long side [rad].
        gripper: Yaw of the gripper, along whose x axis the fingers close [rad].
    """
    return (long_side - np.pi / 2.0 - gripper + np.pi / 2.0) % np.pi - np.pi / 2.0


def _draw_object(random: np.random.Generator, setup: Setup) -> str:
    return list(OBJECTS)[int(random.integers(len(OBJECTS)))]


class ArmPickPlace(SimulatedTask):
    """Pick up an object under the arm and lay it into a cup.

    The arm hangs from a base that moves up and down. It senses its own TCAs and sees the object
    and the cup; it acts by heating its TCAs and moving its base.

    Action, shape (6,), all in [-1, 1]:
        0-4: temperature to hold, or power, of the TCAs ``bending.tca0`` to ``bending.tca2``,
            ``wrist.tca`` and ``gripper.tca``; see ``SimulatedTask``.
        5: velocity of the base over the arm's largest speed; positive is up.

    Observation, shape (43,): see ``OBSERVATION``, whose rows have units and bounds. Positions and
    orientations are those of the world; the gripper's are of the point where its tips meet when
    closed, with the fingers in its x-z plane and z from tips to mount, so that it is not turned
    while it hangs straight. The first number of a quaternion is not negative.

    With ``offsets`` it ends with the rows of ``OFFSETS``, shape (50,): millimetres decide here, of
    positions that differ by centimetres. They are of places no further than 25 mm apart;
    the misalignment is the angle by which the wrist has to turn, half turns aside.

    Reward, the sum of the terms in ``info["reward_terms"]``. The first two pay for progress and
    take it back, so that nothing is earned by staying where they are high:
        reach: Change of a measure from 0 to 1 of how close the gripper is to the object.
        carry: Change of a measure from 0 to 4 of how close the object is to the cup's axis, 0
            until it has been carried: lifted 8 mm off its stand.
        place: 20 in the step in which the object, having been carried, has rested in the cup for
            0.3 s, untouched by the arm.
        energy: Minus 0.002 per joule of electrical energy.

    Reset: the arm is cold and at rest above the object, which lies on its stand, moved and turned
    at random, with the cup somewhere on the side to which the arm bends best. ``options`` is the
    table of all that can be given.

    Terminates when the object rests in the cup (success) or has fallen out of reach. Truncates
    after the time limit, and with ``info["truncation_reason"]`` if a TCA is too hot or torn, or if
    the simulation diverged.
    """

    max_power: ClassVar[NDArray[np.float64]] = np.array([2.0, 2.0, 2.0, 28.0, 10.0])  # [W]
    max_temperature = 180.0  # annealing temperature of the TCAs, Sun, Table 2.1 [°C]
    object_range = 5e-3  # largest offset of the object in x and in y [m]
    yaw_range = (np.radians(120.0), np.radians(155.0))
    cup_range = (23e-3, 26.5e-3)  # distance of the cup's axis from the arm's [m]
    cup_angle = np.radians(20.0)  # of the cup's direction about -x
    terms = ("reach", "carry", "energy", "place")
    energy_price = 0.002
    cameras = ("front", "side", "close")
    scripted = "tca_mj.agents.scripts.arm:scripted"
    scripted_arguments = {"action": "power"}
    script_holds = True
    recipes = {
        "sac": Recipe.held(
            30_000, 0.2, discount=0.85, interval=2000, start="scripted", successes=True,
            limit=12.0, episodes=24, arguments={"offsets": True},
            practised={"object": "screwdriver"},
            alone={
                "object=pcb": {
                    "steps": 26_000, "discount": 0.9, "episodes": 150, "learner": {"steady": True},
                },
                "object=screwdriver": {
                    "steps": 24_000, "discount": 0.93, "episodes": 60,
                    "learner": {"last_imitation": 0.6},
                },
            },
            learner={
                "learning_rate": 5e-4, "batch_size": 256, "tau": 0.01, "ent_coef": "auto_0.05",
                "learning_starts": 6000, "gradient_steps": 16, "hidden": (128, 128),
                "buffer_size": 150_000, "n_steps": 3, "imitation": 10.0, "target_entropy": -12.0,
                "last_rate": 0.1, "last_imitation": 0.3, "critics": 4,
            },
        )
    }
    robot_argument = ("arm_spec", ArmSpec)
    film_speed = 4.0

    @door
    def __init__(
        self,
        *,
        arm_spec: ArmSpec | None = None,
        timestep: Timestep = 5e-3,
        offsets: bool = False,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            arm_spec: The arm, by default the published one.
            timestep: Physics time step; five of them must divide ``control_period`` [s].
            offsets: Whether offsets are seen, too, as rows of their own.
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If the render mode is unknown or the arm cannot be built.
        """
        parts("timestep", type(self).control_period, timestep, of=5)
        self.arm_spec = self._robot(arm_spec, common)
        require_one_of("arm_spec.bending.count", self.arm_spec.bending.count, (3,))
        files = ["cup", *(name for kind in OBJECTS for name in (kind, f"{kind}_stand"))]
        part = scene(
            mjcf("arena.xml"), arm(self.arm_spec), {f: mjcf(f"{f}.xml") for f in files}, name="arm"
        )
        sim = Simulation(part, timestep=timestep, tca_period=5.0 * timestep)
        size = self.arm_spec.height + float(sim.bank.longest.max())
        around = (-size, size)
        self._offsets = offsets
        rows = (*OBSERVATION.entries, *OFFSETS) if offsets else OBSERVATION.entries
        seen = Table(rows).covering(
            {
                "base height": (0.0, size), "TCA length": (0.0, float(sim.bank.longest.max())),
                "gripper position": around, "object position": around, "cup position": around,
            }
        )  # fmt: skip
        self._open(sim, seen, ACTION, self._options(), **common)
        self.object = "screwdriver"
        self._in_cup, self._carried = 0, False
        self._find(self.model)
        self._progress, _ = self._measure()
        self._try("arm_spec", arm_spec)

    def _options(self) -> Options:
        reach, (near, far) = self.object_range, self.cup_range
        return Options(
            [
                Option(
                    name="object", about="what is picked up", choices=tuple(OBJECTS), drawn="drawn",
                    draw=_draw_object,
                ),
                Option(
                    name="object_position", about="x and y on the table, from below the arm",
                    unit="m", shape=(2,), low=-reach, high=reach, drawn="drawn",
                    draw=Uniform(-reach, reach, 2),
                ),
                Option(
                    name="object_yaw", about="angle of the object's long side, from world x",
                    unit="rad", low=self.yaw_range[0], high=self.yaw_range[1], drawn="drawn",
                    draw=Uniform(*self.yaw_range),
                ),
                Option(
                    name="cup_position", unit="m", shape=(2,), draw=self._draw_cup, drawn="drawn",
                    about=f"x and y of the cup, {1e3 * near:g} to {1e3 * far:g} mm from the arm's",
                    check=self._check_cup,
                ),
                *variation_options(),
            ]
        )  # fmt: skip

    def _draw_cup(self, random: np.random.Generator, setup: Setup) -> NDArray[np.float64]:
        angle = np.pi + random.uniform(-self.cup_angle, self.cup_angle)
        return random.uniform(*self.cup_range) * np.array([np.cos(angle), np.sin(angle)])

    def _check_cup(self, place: NDArray[np.float64]) -> None:
        (near, far), distance = self.cup_range, float(np.hypot(*place))
        if not near - 1e-9 <= distance <= far + 1e-9:
            raise ValueError(
                f"cup_position must be {self.cup_range} m from 0, got {place} at {distance:.4f} m"
            )

    def _find(self, model: mujoco.MjModel) -> None:
        """Looks up the addresses of what is observed and set."""
        lift = model.joint("arm.lift").id
        self._lift_q, self._lift_v = int(model.jnt_qposadr[lift]), int(model.jnt_dofadr[lift])
        self._grasp = int(model.site("arm.gripper.grasp").id)
        self._tips = [int(model.site(f"arm.gripper.tip{i}").id) for i in range(2)]
        free = {kind: model.joint(f"{kind}.free").id for kind in OBJECTS}
        self._free_q = {kind: int(model.jnt_qposadr[i]) for kind, i in free.items()}
        self._free_v = {kind: int(model.jnt_dofadr[i]) for kind, i in free.items()}
        self._body = {kind: int(model.body(f"{kind}.{kind}").id) for kind in OBJECTS}
        self._stand = {k: int(model.body(f"{k}_stand.{k}_stand").mocapid[0]) for k in OBJECTS}
        self._cup = int(model.body("cup.cup").mocapid[0])
        self._is_arm = named(model, "arm.")
        self._is_object = {kind: named(model, f"{kind}.") for kind in OBJECTS}

    def prepare(self, setup: Setup) -> None:
        """Puts the arm up, and object and cup where they belong."""
        self.object = setup["object"]
        parked = next(kind for kind in OBJECTS if kind != self.object)

        def place(data: mujoco.MjData) -> None:
            data.qpos[self._lift_q] = data.act[0] = self.arm_spec.height
            self._place(data, parked, _PARKED, 0.0)
            self._place(data, self.object, setup["object_position"], setup["object_yaw"])
            data.mocap_pos[self._cup] = [*setup["cup_position"], 0.0]

        self.sim.reset(place)
        self._in_cup, self._carried = 0, False
        self._progress, _ = self._measure()

    def _place(self, data: mujoco.MjData, kind: str, position: ArrayLike, yaw: float) -> None:
        """Puts an object onto its stand and both where they belong."""
        pose = np.array([*np.asarray(position), _STAND])
        start = self._free_q[kind]
        stand(data, start, pose, yaw)
        data.mocap_pos[self._stand[kind]] = pose
        data.mocap_quat[self._stand[kind]] = data.qpos[start + 3 : start + 7]

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCAs are told and, at once, velocity of the base; see the class."""
        self.data.ctrl[0] = self.arm_spec.speed * command[5]
        return Drive(command=self.heated(command[:5]))

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """How near the object is to the gripper and to the cup, and whether it is lost."""
        before, (self._progress, rests) = self._progress, self._measure()
        terms = {name: value - before[name] for name, value in self._progress.items()}
        self._in_cup = self._in_cup + 1 if rests else 0
        success = self._in_cup * self.interval > 0.3 - 1e-9 and not harmed
        lost = bool(np.hypot(*self._position()[:2]) > 0.2)
        return Verdict(
            terms=terms | {"place": 20.0 if success else 0.0},
            success=success,
            ended="object out of reach" if lost and not (success or harmed) else None,
        )

    def _position(self) -> NDArray[np.float64]:
        return self.data.xpos[self._body[self.object]]

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        self._carried = self._carried or bool(self._position()[2] > _STAND + _LIFTED)
        data, sim = self.data, self.sim
        tips = data.site_xpos[self._tips]
        turn = np.empty(4)
        mujoco.mju_mat2Quat(turn, data.site_xmat[self._grasp] * _HANGING)
        dofs = self._free_v[self.object]
        object_turn = data.xquat[self._body[self.object]]
        values: dict[str, ArrayLike] = {
            "base height": data.qpos[self._lift_q],
            "base velocity": data.qvel[self._lift_v],
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA tension": sim.tension,
            "gripper opening": np.linalg.norm(tips[1] - tips[0]),
            "gripper position": data.site_xpos[self._grasp],
            "gripper orientation": turn if turn[0] >= 0.0 else -turn,
            "object width": OBJECTS[self.object],
            "object position": self._position(),
            "object orientation": object_turn if object_turn[0] >= 0.0 else -object_turn,
            "object velocity": data.qvel[dofs : dofs + 3],
            "object angular velocity": data.qvel[dofs + 3 : dofs + 6],
            "object carried": float(self._carried),
            "cup position": data.mocap_pos[self._cup],
        }
        return values | self._apart(values) if self._offsets else values

    def _apart(self, seen: dict[str, Any]) -> dict[str, ArrayLike]:
        """The rows of ``OFFSETS``."""
        place, cup = seen["object position"], seen["cup position"]
        offset = place - seen["gripper position"]
        yaws = yaw(seen["object orientation"]), yaw(seen["gripper orientation"])
        return {
            "gripper to object": np.clip(offset, -_FAR, _FAR),
            "object to cup": np.clip(cup[:2] - place[:2], -_FAR, _FAR),
            "misalignment": misaligned(*yaws),
            "spare opening": np.clip(seen["gripper opening"] - seen["object width"], -_FAR, _FAR),
        }

    def _measure(self) -> tuple[dict[str, float], bool]:
        """How far the task has got, by reward term, and whether the object rests in the cup."""
        data = self.data
        position, cup = self._position(), data.mocap_pos[self._cup]
        dofs = self._free_v[self.object]
        aside = math.hypot(position[0] - cup[0], position[1] - cup[1])
        inside = aside < _CUP_RADIUS and position[2] < _CUP_RIM
        still = inside and float(np.linalg.norm(data.qvel[dofs : dofs + 3])) < 0.02
        rests = still and self._carried and not self._touched()
        gap = math.dist(position, data.site_xpos[self._grasp])
        near = float(tolerance(gap, bounds=(0.0, 4e-3), margin=0.05))
        over = float(tolerance(aside, bounds=(0.0, 8e-3), margin=0.03))
        return {"reach": near, "carry": 4.0 * over * self._carried}, rests

    def _touched(self) -> bool:
        """Whether the arm touches the object."""
        return touching(self.data, self._is_object[self.object], self._is_arm)

    def details(self) -> dict[str, Any]:
        """The object, and whether the arm touches it."""
        return {"object": self.object, "touched": self._touched()}

    def bent(self) -> float:
        """Angle of the bending module's tip from straight down [rad]."""
        return self.sim.bend("arm.bending.body")

    def outcome(self) -> dict[str, Any]:
        """Where object and cup are [m]."""
        return {
            "object": self.object,
            "object_position": self._position().round(6).tolist(),
            "cup_position": self.data.mocap_pos[self._cup].round(6).tolist(),
        }


ArmPickPlaceVector = partial(TaskVector, ArmPickPlace)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

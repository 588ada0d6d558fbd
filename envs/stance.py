"""The tetrapod in a scene: how it is put there, and where it is."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Angle, Positive, door, number, require_one_of, row
from tca_mj.drive import Timestep
from tca_mj.model.part import Part
from tca_mj.model.scene import scene
from tca_mj.robots.tetrapod import LEGS, TetrapodSpec, rigid_tetrapod, set_rigid_bend, tetrapod
from tca_mj.robots.tetrapod_fine import fine_tetrapod
from tca_mj.sim import Simulation

Array = NDArray[np.float64]

LEG_TCAS = 3 * len(LEGS)

# Cameras that follow the robot: place about it and what they look at, from its middle [m].
_VIEWS = {
    "follow": ((0.24, -0.29, 0.17), (0.0, 0.0, -0.03)),
    "front": ((0.45, 0.0, 0.04), (0.0, 0.0, -0.01)),
    "side": ((0.0, -0.45, 0.04), (0.0, 0.0, -0.01)),
}
CAMERAS = tuple(_VIEWS)

BODIES = ("rigid", "elastic", "fine")

# A foot of 0.6 g is pushed and pulled by forces that accelerate it by 100 m/s². Where a contact is
# stiff from its first touch, a foot that is dragged loses the ground for single time steps, the
# more of them the shorter they are, and slips in each. Contacts therefore begin in a layer above
# the surface, soft at its outside (impedance) and stiff within, in which robot and ground come to
# rest where the surfaces are: the layer moves no surface. The thinner it is, the less it changes;
# in a thinner one than this, feet that land fall through it. What that and the other numbers do to
# speeds is in docs/tetrapod.md, by scripts/tetrapod_contacts.py.
_MARGIN, _IMPEDANCE = 0.2e-3, (0.1, 0.99, 0.3e-3, 0.5, 2.0)
_REST_TIME = 10e-3  # time constant of coming to rest; two time steps, MuJoCo's least, if more [s]
# The ratio keeps splayed legs from creeping apart: 0.04 mm in 20 s, 7 mm at a ratio of 10.
_IMPEDANCE_RATIO = 3000.0

_MARCH = 2e-3  # step downwards while the ground is looked for [m]
_SPREAD = 0.12  # largest bend of each node of a leg that starts beside a beam [rad]
_HALVINGS = 14
_scene = {"at_least": -10.0, "at_most": 10.0, "unit": "m"}  # no arena is larger
_Bend = Annotated[float, partial(number, at_least=-2.0 * math.pi, at_most=2.0 * math.pi)]
_Spot = Annotated[tuple[float, float], partial(row, shape=(2,), **_scene)]
_Height = Annotated[float, partial(number, **_scene)]


@door
def tetrapod_scene(
    arena: Path,
    objects: Mapping[str, Path],
    spec: TetrapodSpec,
    *,
    timestep: Timestep,
    period: Positive,
    body: str = "elastic",
    bend: float = 0.0,
) -> Simulation:
    """The robot ``robot`` in an arena, with contacts that suit its light feet and with ``CAMERAS``.

    Args:
        arena: MJCF file of the arena.
        objects: MJCF files of what is put into it, by name.
        spec: The robot.
        timestep: Physics time step [s].
        period: Time between two updates of the TCAs [s].
        body: One of ``BODIES``: ``rigid``, cold and of one shape (``rigid_tetrapod``);
            ``elastic``, the spines in one chain, which heat softens (``tetrapod``); or ``fine``,
            each spine a chain of its own (``fine_tetrapod``).
        bend: Bend for which a rigid one is built [rad].

    Raises:
        ValueError: If a file is missing, a time is bad or the robot cannot be built.
    """
    require_one_of("body", body, BODIES)
    require_one_of("robot.leg.count", spec.leg.count, (LEG_TCAS // len(LEGS),))
    if body == "fine":
        robot = fine_tetrapod(spec, nodes=spec.nodes, leg_nodes=spec.leg.nodes)
    else:
        robot = tetrapod(spec) if body == "elastic" else rigid_tetrapod(spec, bend=bend)
    part = scene(arena, robot, objects, name="robot")
    _soften(part, max(_REST_TIME, 2.0 * timestep))
    if body == "fine":  # its welds are harder than MuJoCo takes them otherwise
        part.spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    hub = part.spec.body("robot.hub")
    for name, (place, towards) in _VIEWS.items():
        camera = hub.add_camera(name=name, pos=place, quat=_looking(place, towards), fovy=38.0)
        camera.mode = mujoco.mjtCamLight.mjCAMLIGHT_TRACK
    return Simulation(part, timestep=timestep, tca_period=period)


def _looking(place: Sequence[float], towards: Sequence[float]) -> Array:
    """Quaternion of a camera at ``place``, level, that looks at ``towards``."""
    back = np.subtract(place, towards)
    right = np.array([-back[1], back[0], 0.0])
    axes = np.stack([right, np.cross(back, right), back])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turn = np.empty(4)
    mujoco.mju_mat2Quat(turn, axes.T.ravel())
    return turn


def _soften(part: Part, rest_time: float) -> None:
    option = part.spec.option
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = _IMPEDANCE_RATIO
    option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE  # four legs apart: two thirds of the time
    for geom in part.spec.geoms:
        if geom.priority > 0:  # the robot's: they decide on every contact
            geom.margin, geom.solimp, geom.solref = _MARGIN, _IMPEDANCE, (rest_time, 1.0)


class Stance:
    """Where to read and set the robot ``robot`` of a simulation.

    Attributes:
        hub: Id of the body in the middle of its spines.
        root, motion: Where its seven positions and six velocities begin.
        feet: Ids of the sites in the middle of its feet, in the order of ``LEGS``.
    """

    @door
    def __init__(self, sim: Simulation, spec: TetrapodSpec) -> None:
        """Looks up its addresses in ``sim``, which was built of ``spec``."""
        model = self._model = sim.model
        self.hub = int(model.body("robot.hub").id)
        self.feet = np.array([model.site(f"robot.{leg}.foot").id for leg in LEGS])
        root = model.joint("robot.root").id
        self.root, self.motion = int(model.jnt_qposadr[root]), int(model.jnt_dofadr[root])

        def address(names: list[str]) -> NDArray[np.int64]:
            return np.array(
                [model.jnt_qposadr[model.joint(name).id] for name in names], dtype=np.int64
            )

        joints = [model.joint(i).name for i in range(model.njnt)]
        self._nodes, self._rigid = spec.nodes, "robot.left.bend_x0" not in joints
        self._bend = 0.0  # of a rigid body
        sides = {} if self._rigid else {"left": -1.0, "right": 1.0}
        spine = {s: [f"robot.{s}.bend_x{i}" for i in range(spec.nodes)] for s in sides}
        self._bends = address([name for names in spine.values() for name in names])
        self._signs = np.repeat(list(sides.values()), spec.nodes)
        # Spines of the fine model that run beside the middle one, from the right rail to the left.
        beside = [name for name in joints if name.startswith("robot.outer") and ".bend_x" in name]
        self._beside = address(beside)
        nodes = range(spec.leg.nodes)
        self._lifts = np.stack(
            [address([f"robot.{leg}.rod.bend_y{i}" for i in nodes]) for leg in LEGS]
        )
        bodies = [model.body(int(body)).name for body in model.geom_bodyid]
        self._leg = np.full(model.ngeom, -1)  # which leg a geom belongs to
        for i, leg in enumerate(LEGS):
            self._leg[[name.startswith(f"robot.{leg}.") for name in bodies]] = i

    def bend(self, data: mujoco.MjData) -> float:
        """Angle between the ends of the spines, 0 if they are straight [rad]."""
        return self._bend if self._rigid else float(self._signs @ data.qpos[self._bends])

    @door
    def shape(self, bend: float) -> None:
        """Makes a rigid body one of another shape; an elastic one takes its own."""
        if self._rigid:
            self._bend = bend
            set_rigid_bend(self._model, bend, prefix="robot.")

    def position(self, data: mujoco.MjData) -> Array:
        """Of the hub in the world, shape (3,) [m]."""
        return data.xpos[self.hub]

    def rotation(self, data: mujoco.MjData) -> Array:
        """Of the hub: its x axis (forward), y axis (left) and z axis as columns, (3, 3)."""
        return data.xmat[self.hub].reshape(3, 3)

    def velocity(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Of the hub in its own frame: linear [m/s] and angular [rad/s], shape (3,) each."""
        v = data.qvel[self.motion : self.motion + 6]
        return self.rotation(data).T @ v[:3], v[3:]

    def feet_in_body(self, data: mujoco.MjData) -> Array:
        """Middles of the feet in the hub's frame, in the order of ``LEGS``, shape (4, 3) [m]."""
        return (data.site_xpos[self.feet] - self.position(data)) @ self.rotation(data)

    def touching(self, data: mujoco.MjData) -> Array:
        """1 for each leg that touches something with foot or plates, else 0, shape (4,)."""
        touched = np.zeros(len(LEGS))
        geoms = data.contact.geom
        if len(geoms):
            legs = self._leg[geoms]
            touched[legs[legs >= 0]] = 1.0
        return touched

    def sensed(self, sim: Simulation, above: float) -> dict[str, ArrayLike]:
        """What a gait sees of the robot: the rows of its table up to the bend of the body.

        Args:
            sim: The simulation.
            above: Height of what it stands on or astride of [m].
        """
        data, turn = sim.data, sim.data.xquat[self.hub]
        linear, angular = self.velocity(data)
        return {
            "TCA temperature": sim.temperature[:LEG_TCAS],
            "TCA length": sim.length[:LEG_TCAS],
            "TCA tension": sim.tension[:LEG_TCAS],
            "orientation": turn if turn[0] >= 0.0 else -turn,
            "height": self.position(data)[2] - above,
            "velocity": linear,
            "angular velocity": angular,
            "foot position": self.feet_in_body(data),
            "leg contact": self.touching(data),
            "body bend": self.bend(data),
        }

    @door
    def placer(
        self,
        *,
        bend: _Bend,
        position: _Spot = (0.0, 0.0),
        yaw: Angle = 0.0,
        above: _Height = 0.0,
    ) -> Callable[[mujoco.MjData], None]:
        """What ``Simulation.reset`` needs to put the robot onto what is below it.

        Its body is in shape and its legs are straight, or spread so far that the feet touch the
        sides of what it stands astride of.

        Args:
            bend: Angle between the ends of the spines, within a turn [rad].
            position: x and y of the hub, within 10 m [m].
            yaw: Direction that it looks into, from world x [rad].
            above: Height of what it is put onto, within 10 m [m].

        Raises:
            ValueError: If a number is out of bounds; when it is called, if there is nothing at that
                height.
        """

        def place(data: mujoco.MjData) -> None:
            self.shape(bend)
            data.qpos[self._bends] = self._signs * bend / (2 * self._nodes)
            data.qpos[self._beside] = -bend / (2 * self._nodes)
            turn = (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))
            data.qpos[self.root : self.root + 7] = (*position, above, *turn)

            def at(height: float, spread: float | Array) -> tuple[bool, NDArray[np.bool_]]:
                """Whether something is touched from above, and by which legs from the side."""
                data.qpos[self.root + 2] = height
                data.qpos[self._lifts] = np.broadcast_to(spread, len(LEGS))[:, None]
                mujoco.mj_kinematics(self._model, data)
                mujoco.mj_collision(self._model, data)
                contact = data.contact
                near = contact.dist < 0.0  # about where it will rest
                steep = np.abs(contact.frame[:, 2]) > 0.5
                legs = self._leg[contact.geom[near & ~steep]]
                return bool((near & steep).any()), np.isin(np.arange(len(LEGS)), legs)

            # Legs pointing down stand on their feet, those below a beam's top only hang beside it.
            aside = at(above - _MARCH, 0.0)[1].any()
            widest = _SPREAD if aside else 0.0
            high = above + 0.15
            while not at(high - _MARCH, widest)[0]:
                high -= _MARCH
                if high < above - 0.15:
                    raise ValueError(f"position must be above something, got {position}")
            height = _bisect(lambda z: not at(z, widest)[0], high - _MARCH, high)
            spread = np.full(len(LEGS), widest)
            for leg in range(len(LEGS) if aside else 0):  # each as wide as the beam is for it
                def free(angle: float, leg: int = leg) -> bool:
                    spread[leg] = angle
                    return not at(height, spread)[1][leg]

                spread[leg] = _bisect(free, 0.0, widest)
            at(height, spread)

        return place


def _bisect(free: Callable[[float], bool], low: float, high: float) -> float:
    """The smallest number from which on ``free`` holds, as it does at ``high``."""
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if free(middle) else (middle, high)
    return high

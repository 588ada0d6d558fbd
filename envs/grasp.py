"""``TCA/Grasp-v0``: soft fingers hold an object without power, from a time to another one."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, ClassVar, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import door
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.holding import HeldObject, held_rows, holding_options
from tca_mj.envs.objects import stand
from tca_mj.envs.options import Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.model.scene import scene
from tca_mj.robots.gripper import GripperSpec, gripper
from tca_mj.sim import Simulation

OBSERVATION = Table(
    [
        Entry("base height", 1, 0.0, 0.6, "m", centre=0.04, scale=0.01),
        Entry("base velocity", 1, -1.0, 1.0, "m/s", scale=0.04),
        Entry("TCA temperature", 1, -50.0, 300.0, "°C", centre=80.0, scale=60.0),
        Entry("TCA length", 1, 0.0, 0.5, "m", centre=0.1, scale=0.02),
        Entry("TCA resistance", 1, 0.0, 40.0, "ohm", centre=7.0, scale=0.5),
        Entry("TCA tension", 1, 0.0, 5.0, "N", centre=0.1, scale=0.1),
        Entry("tips of the fingers, x and z", 4, -0.6, 0.6, "m", scale=0.03, mirror=(-3, 4, -1, 2)),
        Entry("object width", 1, 0.0, 0.02, "m", centre=6e-3, scale=2e-3),
        Entry("object mass", 1, 0.0, 0.1, "kg", centre=8e-4, scale=5e-4),
        *held_rows(60.0),
    ]
)
ACTION = Table(
    [
        Entry("TCA heating", 1, -1.0, 1.0, "-", off=-1.0, mirror=(1,)),
        Entry("base velocity", 1, -1.0, 1.0, "-"),
    ]
)

WIDTHS, MASSES = (4e-3, 8e-3), (0.3e-3, 1.2e-3)  # of the objects [m, kg]
STIFFNESSES = (60.0, 2000.0)  # force per change of width [N/m]; 60 N/m is a soft foam's
_HALF_HEIGHT, _TRAY = 4.5e-3, 10e-3  # of assets/mjcf/block.xml and tray.xml [m]
_ASIDE = 1e-3  # largest offset of the object in x and in y [m]
_DAMPING = 5e-3  # Kelvin-Voigt time of the object's sides [s]


def _stiffness(random: np.random.Generator, setup: Setup) -> float:
    return float(math.exp(random.uniform(*np.log(STIFFNESSES))))


_OPTIONS = Options(
    [
        Option(name="width", about="width of the object", unit="m",
               low=WIDTHS[0], high=WIDTHS[1]),
        Option(name="stiffness", about="force per change of its width", unit="N/m",
               low=STIFFNESSES[0], high=STIFFNESSES[1], draw=_stiffness,
               drawn="drawn, its logarithm evenly"),
        Option(name="object_mass", about="its mass", unit="kg", low=MASSES[0], high=MASSES[1]),
        Option(name="object_position", about="x and y on the tray, from below the gripper",
               unit="m", shape=(2,), low=-_ASIDE, high=_ASIDE, draw=Uniform(-_ASIDE, _ASIDE, 2)),
        *holding_options(11.0, 14.0, 20.0, 30.0),
        *variation_options(),
    ]
)  # fmt: skip


class Grasp(HeldObject):
    """Hold an object from a commanded time to another one, then let it go.

    A normally closed pair of fingers hangs from a base that moves up and down. Its TCA opens it;
    cold, it holds without power.

    Action, shape (2,), all in [-1, 1]:
        0: temperature to hold, or power, of the TCA; see ``SimulatedTask``.
        1: velocity of the base over its largest speed; positive is up.

    Observation, shape (24,): see ``OBSERVATION``, whose rows have units and bounds. The fingers are
    in the x-z plane; their tips are listed as x and z of the one, then of the other.

    Reward, the sum of the terms in ``info["reward_terms"]``. The first two pay for progress and
    take it back:
        reach: Change of a measure from 0 to 1 of how close the tips are to the object.
        lift: Change of a measure from 0 to 4 of how high the object is above the tray, up to 6 mm.
        hold: 10 times the share of the commanded time for which it was held in this step.
        goal: 20 in the step in which it has been let go in time.
        energy: Minus 0.01 per joule of electrical energy.
        end: Minus 5 in the step in which the episode ends without success.

    It is held while it is 6 mm above the tray and a finger touches it, and let go when no finger
    has touched it for 0.3 s.

    Reset: the gripper is cold and above the object, whose width, stiffness and mass are drawn, as
    are the times. ``options`` is the table of all that can be given.

    Terminates when the object has been let go within 6 s of the commanded time (success), when it
    is not held when it should be, not let go in time or out of reach. Truncates after the time
    limit, and with ``info["truncation_reason"]`` if the TCA is too hot or torn, or if the
    simulation diverged.
    """

    max_power: ClassVar[float] = 10.0  # Sun, Section 4.1.4 [W]
    camera_prefix = "tray."
    scripted = "tca_mj.agents.scripts.grasp:scripted"
    robot_argument = ("gripper_spec", GripperSpec)
    recipes = {"sac": Recipe.held(8000, 0.5, mirrored=True)}
    film_speed = 2.0

    @door
    def __init__(
        self,
        *,
        gripper_spec: GripperSpec | None = None,
        timestep: Timestep = 5e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            gripper_spec: The gripper, by default the published one.
            timestep: Physics time step; five of them must divide ``control_period`` [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is out of range or the gripper cannot be built.
        """
        parts("timestep", type(self).control_period, timestep, of=5)
        self.gripper_spec = self._robot(gripper_spec, common)
        files = {name: mjcf(f"{name}.xml") for name in ("tray", "block")}
        part = scene(mjcf("arena.xml"), gripper(self.gripper_spec), files, name="gripper")
        sim = Simulation(part, timestep=timestep, tca_period=5.0 * timestep)
        longest = float(sim.bank.longest.max())
        size = self.gripper_spec.lift.travel[1] + longest
        around = (-size, size)
        seen = OBSERVATION.covering(
            {
                "base height": (0.0, size), "TCA length": (0.0, longest),
                "TCA resistance": (0.0, 2.0 * float(sim.resistance.max())),
                "tips of the fingers, x and z": around, "object position": around,
            }
        )  # fmt: skip
        self._open(sim, seen, ACTION, _OPTIONS, **common)
        self._find(self.model)
        self.width = WIDTHS[0]
        self._try("gripper_spec", gripper_spec)

    def _find(self, model: mujoco.MjModel) -> None:
        """Looks up the addresses of what is observed and set."""
        lift = model.joint("gripper.lift").id
        self._lift_q, self._lift_v = int(model.jnt_qposadr[lift]), int(model.jnt_dofadr[lift])
        self._sides = [int(model.joint(f"block.side{i}").id) for i in range(2)]
        tips = [f"gripper.fingers.tip{i}" for i in range(2)]
        self._follow(
            model, "block", ("block", "side0", "side1"), stands=_TRAY + _HALF_HEIGHT,
            fingers="gripper.", sites=tips,
        )  # fmt: skip
        self._tips = self._grip

    def prepare(self, setup: Setup) -> None:
        """Puts the gripper up, and makes the object what it is to be."""
        model, sides = self.model, self._sides
        self.width, self.object_mass = setup["width"], setup["object_mass"]
        self.hold_from = setup["hold_from"]
        self.hold_until = self.hold_from + setup["hold_for"]
        places, dofs = model.jnt_qposadr[sides], model.jnt_dofadr[sides]
        stiffness = 2.0 * setup["stiffness"]  # of one of two springs behind each other
        model.jnt_stiffness[sides] = stiffness
        model.dof_damping[dofs] = _DAMPING * stiffness
        model.qpos_spring[places] = self.width / 2.0
        self._weigh()

        def place(data: mujoco.MjData) -> None:
            data.qpos[self._lift_q] = data.act[0] = self.gripper_spec.lift.height
            where = [*setup["object_position"], _TRAY + _HALF_HEIGHT]
            stand(data, self._free_q, where)
            data.qpos[places] = self.width / 2.0

        self.sim.reset(place)
        self._begin()

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCA is told and, at once, velocity of the base; see the class."""
        self.data.ctrl[0] = self.gripper_spec.lift.speed * command[1]
        return Drive(command=self.heated(command[:1]))

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        data, sim = self.data, self.sim
        return {
            "base height": data.qpos[self._lift_q],
            "base velocity": data.qvel[self._lift_v],
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA resistance": sim.resistance,
            "TCA tension": sim.tension,
            "tips of the fingers, x and z": data.site_xpos[self._tips][:, [0, 2]].ravel(),
            "object width": self.width,
            "object mass": self.object_mass,
            **self.seen_of_it(),
        }

    def outcome(self) -> dict[str, Any]:
        """What the object was, and for how long it was held when it should be [s]."""
        return {"width": self.width, **super().outcome()}


GraspVector = partial(TaskVector, Grasp)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

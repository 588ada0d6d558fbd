"""``TCA/BistableGrasp-v0``: two bistable fingers carry a weight without power (Sun, 4.3.4)."""

from __future__ import annotations

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
from tca_mj.envs.rewards import tolerance
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.model.scene import scene
from tca_mj.modules.bistable import shaped
from tca_mj.robots.bistable_gripper import SIDES, BistableGripperSpec, bistable_gripper
from tca_mj.sim import Simulation

_TCAS = (3, 4, 1, 2)  # opens and closes finger 0, then finger 1; left and right swapped

OBSERVATION = Table(
    [
        Entry("carriage, y and z", 2, -0.6, 0.6, "m", scale=0.05, mirror=(1, 2)),
        Entry("carriage velocity, y and z", 2, -1.0, 1.0, "m/s", scale=0.04, mirror=(1, 2)),
        Entry("TCA temperature", 4, -50.0, 300.0, "°C", centre=80.0, scale=60.0, mirror=_TCAS),
        Entry("TCA length", 4, 0.0, 0.5, "m", centre=0.09, scale=0.01, mirror=_TCAS),
        Entry("TCA resistance", 4, 0.0, 40.0, "ohm", centre=7.0, scale=0.5, mirror=_TCAS),
        Entry("TCA tension", 4, 0.0, 5.0, "N", centre=0.1, scale=0.1, mirror=_TCAS),
        Entry("bend of the fingers", 2, -7.0, 7.0, "rad", scale=1.5, mirror=(2, 1)),
        Entry("rate of bend", 2, -1e5, 1e5, "rad/s", scale=5.0, mirror=(2, 1)),
        Entry("object mass", 1, 0.0, 0.5, "kg", centre=0.012, scale=0.008),
        *held_rows(150.0),
        Entry("where it is to go, y", 1, -0.1, 0.1, "m", scale=0.03),
    ]
)
ACTION = Table(
    [
        Entry("TCA heating", 4, -1.0, 1.0, "-", off=-1.0, mirror=_TCAS),
        Entry("carriage velocity, y and z", 2, -1.0, 1.0, "-", mirror=(1, 2)),
    ]
)

MASSES = (5e-3, 20e-3)  # of the object [kg]
_STANDS = 44e-3  # height of the middle of its head, of assets/mjcf/weight.xml [m]
_ASIDE = 1e-3  # largest offset of the object in x and in y [m]
_FAR = 40e-3  # largest distance to carry it [m]
_THERE = 5e-3  # distance from the goal at which it is there [m]
_GRASP = 22e-3  # how far below the fingers' roots an object is held; estimate [m]
_SETTLING = 0.3  # time in which the cold fingers come to rest [s]

_OPTIONS = Options(
    [
        Option(name="object_mass", about="mass of the object", unit="kg", low=MASSES[0],
               high=60e-3, draw=Uniform(*MASSES), drawn="drawn, up to 0.02"),
        Option(name="object_position", about="x and y on the table, from below the gripper",
               unit="m", shape=(2,), low=-_ASIDE, high=_ASIDE, draw=Uniform(-_ASIDE, _ASIDE, 2)),
        Option(name="goal", about="y of the place where it is to be let go", unit="m",
               low=-_FAR, high=_FAR),
        *holding_options(8.0, 10.0, 20.0, 120.0),
        *variation_options(),
    ]
)  # fmt: skip


class BistableGrasp(HeldObject):
    """Pick a weight up, hold it for a time with little energy, and let it go where commanded.

    Two bistable fingers hang from a carriage that moves up and down and sideways. Each has a TCA
    that opens it and one that closes it; both states hold without power.

    Action, shape (6,), all in [-1, 1]:
        0-3: temperature to hold, or power, of the TCAs that open and close finger 0, and finger 1;
            see ``SimulatedTask``.
        4, 5: velocity of the carriage along y and z over its largest speed.

    Observation, shape (38,): see ``OBSERVATION``, whose rows have units and bounds. The fingers
    bend in the x-z plane; a bend is positive inwards.

    Reward, the sum of the terms in ``info["reward_terms"]``. The first three pay for progress and
    take it back:
        reach: Change of a measure from 0 to 1 of how close the hand is to the object.
        lift: Change of a measure from 0 to 4 of how high the object is lifted, up to 6 mm.
        place: Change of a measure from 0 to 4 of how close the object is to where it is to go.
        hold: 10 times the share of the commanded time for which it was held in this step.
        goal: 20 in the step in which it has been let go in time, where it should be.
        energy: Minus 0.05 per joule of electrical energy.
        end: Minus 5 in the step in which the episode ends without success.

    It is held while it is lifted by 6 mm and a finger touches it, and let go when no finger
    has touched it for 0.3 s.

    Reset: the gripper is cold, open and above the object, whose mass and place are drawn, as are
    goal and times. ``options`` is the table of all that can be given.

    Terminates when the object has been let go within 10 s of the commanded time, standing within
    5 mm of the goal (success) or elsewhere, when it is not held when it should be, not let go in
    time, or out of reach. Truncates after the time limit, and with ``info["truncation_reason"]`` if
    a TCA is too hot or torn, or if the simulation diverged.
    """

    max_power: ClassVar[float] = 15.0  # of 1.5 A in 94 mm, Sun, Sections 4.3.4 and 2.3.1 [W]
    near: ClassVar[tuple[float, float]] = (4e-3, 0.06)
    release_time: ClassVar[float] = 10.0  # its TCAs take a while to open it [s]
    terms = ("reach", "lift", "place", "hold", "goal", "energy", "end")
    energy_price, end_price = 0.05, 5.0
    camera_prefix = "goal."
    scripted = "tca_mj.agents.scripts.bistable_grasp:scripted"
    robot_argument = ("gripper_spec", BistableGripperSpec)
    recipes = {"sac": Recipe.held(8000, 0.4, mirrored=True)}
    film_speed = 2.0

    @door
    def __init__(
        self,
        *,
        gripper_spec: BistableGripperSpec | None = None,
        timestep: Timestep = 1e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            gripper_spec: The gripper, by default the published one.
            timestep: Physics time step; twenty of them must divide ``control_period`` [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is out of range or the gripper cannot be built.
        """
        parts("timestep", type(self).control_period, timestep, of=20)
        self.gripper_spec = self._robot(gripper_spec, common)
        files = {name: mjcf(f"{name}.xml") for name in ("goal", "weight")}
        part = scene(mjcf("arena.xml"), bistable_gripper(self.gripper_spec), files, name="gripper")
        part.spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # what is held must not creep
        sim = Simulation(part, timestep=timestep, tca_period=20.0 * timestep)
        longest = float(sim.bank.longest.max())
        size = self.gripper_spec.lift.travel[1] + self.gripper_spec.across + longest
        seen = OBSERVATION.covering(
            {
                "carriage, y and z": (-size, size), "TCA length": (0.0, longest),
                "TCA resistance": (0.0, 2.0 * float(sim.resistance.max())),
                "object position": (-size, size),
            }
        )  # fmt: skip
        self._open(sim, seen, ACTION, _OPTIONS, **common)
        self.goal = 0.0
        self._find(self.model)
        self._try("gripper_spec", gripper_spec)

    def _find(self, model: mujoco.MjModel) -> None:
        """Looks up the addresses of what is observed and set."""
        slides = [model.joint(f"gripper.{name}").id for name in ("across", "lift")]
        drives = [model.actuator(f"gripper.{name}").id for name in ("across", "lift")]
        self._slide_q, self._slide_v = model.jnt_qposadr[slides], model.jnt_dofadr[slides]
        self._drives, self._acts = np.array(drives), model.actuator_actadr[drives]
        names = [model.joint(i).name for i in range(model.njnt)]
        nodes = np.array([
            [i for i, name in enumerate(names) if name.startswith(f"gripper.hand.finger{side}.")]
            for side in range(SIDES)
        ])  # fmt: skip
        self._bend_q, self._bend_v = model.jnt_qposadr[nodes], model.jnt_dofadr[nodes]
        self._mark = int(model.body("goal.mark").mocapid[0])
        self._follow(
            model, "weight", ("weight",), stands=_STANDS,
            fingers="gripper.hand.", sites=("gripper.mount",),
        )  # fmt: skip

    def prepare(self, setup: Setup) -> None:
        """Puts the open gripper up, and the object where it stands."""
        self.object_mass, self.goal = setup["object_mass"], setup["goal"]
        self.hold_from = setup["hold_from"]
        self.hold_until = self.hold_from + setup["hold_for"]
        self._weigh()
        finger = self.gripper_spec.finger
        opened = shaped(finger, finger.rod.states()[0])

        def place(data: mujoco.MjData) -> None:
            data.qpos[self._slide_q] = data.act[self._acts] = 0.0, self.gripper_spec.lift.height
            data.qpos[self._bend_q] = opened
            where = [*setup["object_position"], _STANDS]
            stand(data, self._free_q, where)
            data.mocap_pos[self._mark, 1] = self.goal

        self.sim.reset(place)
        self.sim.step(self.heated(np.full(self.sim.n, -1.0)), _SETTLING)
        self.sim.tca = self.sim.bank.rest()
        self.data.time = 0.0
        self._begin()

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCAs are told and, at once, velocity of the carriage; see the class."""
        spec = self.gripper_spec
        self.data.ctrl[self._drives] = command[4:] * (spec.across_speed, spec.lift.speed)
        return Drive(command=self.heated(command[:4]))

    @property
    def away(self) -> float:
        """Distance of the object from its goal along y [m]."""
        return abs(float(self.data.xpos[self._bodies[0], 1]) - self.goal)

    def astray(self) -> str | None:
        """Why an object that was let go is not where it should be, or None."""
        if abs(self.height) > 1e-3:
            return "fallen over"
        return f"let go {1e3 * self.away:.0f} mm from the goal" if self.away > _THERE else None

    def _measure(self) -> dict[str, float]:
        """How far the task has got, by reward term; an object is placed while it is lifted."""
        there = float(tolerance(self.away, bounds=(0.0, _THERE), margin=2.0 * _FAR))
        return {**super()._measure(), "place": 4.0 * there}

    def where(self) -> NDArray[np.float64]:
        """Where the hand would hold an object [m]."""
        hand: NDArray[np.float64] = self.data.site_xpos[self._grip[0]] - [0.0, 0.0, _GRASP]
        return hand

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        data, sim = self.data, self.sim
        return {
            "carriage, y and z": data.qpos[self._slide_q],
            "carriage velocity, y and z": data.qvel[self._slide_v],
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA resistance": sim.resistance,
            "TCA tension": sim.tension,
            "bend of the fingers": self.bends,
            "rate of bend": data.qvel[self._bend_v].sum(axis=1),
            "object mass": self.object_mass,
            **self.seen_of_it(),
            "where it is to go, y": self.goal,
        }

    @property
    def bends(self) -> NDArray[np.float64]:
        """Bend of each finger from end to end, positive inwards, shape (2,) [rad]."""
        bends: NDArray[np.float64] = self.data.qpos[self._bend_q].sum(axis=1)
        return bends

    def bent(self) -> float:
        """Mean of ``bends``."""
        return float(self.bends.mean())

    def outcome(self) -> dict[str, Any]:
        """What the object was, for how long it was held [s] and where it is from its goal [m]."""
        return {**super().outcome(), "goal": self.goal, "away": self.away}


BistableGraspVector = partial(TaskVector, BistableGrasp)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

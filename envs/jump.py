"""``TCA/Jump-v0``: a bistable module jumps from one state to the other (Sun, Section 4.3.4)."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, ClassVar, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import door
from tca_mj.envs.options import Option, Options, Setup, variation_options
from tca_mj.envs.outcome import Verdict
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments
from tca_mj.envs.vector import TaskVector
from tca_mj.model.scene import scene
from tca_mj.modules.bistable import shaped
from tca_mj.robots.jumper import JumperSpec, jumper
from tca_mj.sim import Drive, Haste, Simulation, Timestep

OBSERVATION = Table(
    [
        Entry("TCA temperature", 1, -50.0, 300.0, "°C", centre=80.0, scale=60.0),
        Entry("TCA length", 1, 0.0, 0.4, "m", centre=0.09, scale=0.01),
        Entry("TCA tension", 1, 0.0, 5.0, "N", centre=0.1, scale=0.1),
        Entry("bend", 1, -7.0, 7.0, "rad", scale=1.5),
        Entry("rate of bend", 1, -1e5, 1e5, "rad/s", scale=10.0),
        Entry("height", 1, -0.1, 2.0, "m", scale=0.03),
        Entry("vertical velocity", 1, -20.0, 20.0, "m/s", scale=0.5),
        Entry("clearance", 1, -0.1, 2.0, "m", scale=0.03),
    ]
)
ACTION = Table([Entry("TCA heating", 1, -1.0, 1.0, "-", off=-1.0)])
_OPTIONS = Options(
    [
        Option(
            name="bend", about="from state 1, in which it is let go, to come to rest",
            low=-0.1, high=0.1, unit="rad",
        ),
        *variation_options(),
    ]
)  # fmt: skip
_SETTLING = 0.3  # time in which the cold module comes to rest [s]
TIMESTEP = 5e-4  # of the physics [s]
PERIOD = 5e-3  # time between two updates of the TCA [s]
# While a node beside the ground bends faster than that: it takes some 20 ms from there to the
# strike. With half or a quarter of all steps the height is the same within 3 %; with twice these
# here it scatters by 10 %.
HASTE = Haste(speed=0.5, timestep=2.5e-5, tca_period=5e-4)


class Jump(SimulatedTask):
    """Jump as high as there is energy for.

    The robot is a bistable module that lies on the ground as an arch, in state 1. Its TCA pulls
    it over to state 2; what spine and band have stored lets it jump.

    The height is no prediction: damping of the module and contact are fitted to the published
    70 mm. What does not depend on them is when it jumps, and what is stored.

    Action, shape (1,), in [-1, 1]: temperature to hold, or power, of the TCA; see
    ``SimulatedTask``.

    Observation, shape (8,): see ``OBSERVATION``, whose rows have units and bounds. The bend is that
    from end to end, negative in state 1; height is that of the centre of mass over its start,
    clearance that of the lowest point over the ground.

    Reward, the sum of the terms in ``info["reward_terms"]``:
        height: What the greatest height so far has grown by, over 10 mm.
        energy: Minus 0.1 per joule of electrical energy.
        end: Minus 5 in the step in which the TCA is too hot or torn.

    Reset: cold and at rest in state 1, let go a little beside it. ``options`` is the table of all
    that can be given.

    Terminates when it sinks again after its lowest point was 5 mm above the ground (success).
    Truncates after the time limit, and with ``info["truncation_reason"]`` if the TCA is too hot or
    torn, or if the simulation diverged.
    """

    max_power: ClassVar[float] = 40.0  # of 2.5 A in 95 mm, Sun, Sections 4.3.4 and 2.3.1 [W]
    max_temperature: ClassVar[float] = 180.0  # annealing temperature, Sun, Table 2.1 [°C]
    control_period = 2e-2  # [s]
    response: ClassVar[float] = 0.1  # estimate, in which 40 W are 70 K [s]
    off_ground: ClassVar[float] = 5e-3  # clearance that is a jump [m]
    terms = ("height", "energy", "end")
    energy_price, end_price = 0.1, 5.0
    scripted = "tca_mj.agents.scripts.jump:scripted"
    robot_argument = ("jumper_spec", JumperSpec)
    recipes = {"sac": Recipe.held(8000, 0.1)}
    film_speed = 0.1

    @door
    def __init__(
        self,
        *,
        jumper_spec: JumperSpec | None = None,
        timestep: Timestep = TIMESTEP,
        tca_period: Timestep = PERIOD,
        haste: Haste | None = HASTE,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            jumper_spec: The robot, by default the published one.
            timestep: Physics time step [s].
            tca_period: Time between two updates of the TCA, a multiple of ``timestep`` [s].
            haste: Smaller steps while it snaps; None for none.
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is unknown or out of range, or the robot cannot be built.
        """
        self.jumper_spec = self._robot(jumper_spec, common)
        part = scene(mjcf("jump.xml"), jumper(self.jumper_spec), {})
        sim = Simulation(part, timestep=timestep, tca_period=tca_period, haste=haste)
        longest = float(sim.bank.longest.max())
        seen = OBSERVATION.covering({"TCA length": (0.0, longest)})
        model = sim.model
        ribs = [model.geom(i).id for i in range(model.ngeom) if ".rib" in model.geom(i).name]
        self._ribs = np.array(ribs)
        self._nodes = self.jumper_spec.module.nodes
        self._root = int(model.body("robot.root").id)
        self._state = self.jumper_spec.module.rod.states()[0]
        self._ground = self._best = 0.0
        self._jumped = False
        self._open(sim, seen, ACTION, _OPTIONS, **common)
        self._try("jumper_spec", jumper_spec)

    def prepare(self, setup: Setup) -> None:
        """Lays the robot on its ends, in state 1."""
        model, bend = self.model, self._state + setup["bend"]
        shape = shaped(self.jumper_spec.module, bend)

        def place(data: mujoco.MjData) -> None:
            data.qpos[:3] = 0.0
            data.qpos[3:7] = math.cos(bend / 4.0), 0.0, math.sin(bend / 4.0), 0.0
            data.qpos[7:] = shape
            mujoco.mj_kinematics(model, data)
            data.qpos[2] = -self._clearance(data)

        self.sim.reset(place)
        self.sim.step(self.heated(np.full(1, -1.0)), _SETTLING)
        self.sim.tca = self.sim.bank.rest()
        self.data.time = 0.0
        self._best, self._jumped, self._ground = 0.0, False, self._centre()

    def _clearance(self, data: mujoco.MjData) -> float:
        """Height of the lowest point [m]."""
        place, size = data.geom_xpos[self._ribs, 2], self.model.geom_size[self._ribs, 0]
        return float(np.min(place - size))

    def _centre(self) -> float:
        """Height of the centre of mass now: a physics step leaves where it was at its start [m]."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        return float(self.data.subtree_com[self._root, 2])

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCA is told; see the class."""
        return Drive(command=self.heated(command))

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """How high it has been, and whether that was a jump."""
        height = self._centre() - self._ground
        gained, self._best = max(0.0, height - self._best), max(height, self._best)
        self._jumped |= self._clearance(self.data) > self.off_ground
        success = self._jumped and height < self._best and not harmed
        return Verdict(terms={"height": gained / 1e-2}, success=success)

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        sim, data = self.sim, self.data
        height = self._centre() - self._ground
        mujoco.mj_comVel(self.model, data)
        mujoco.mj_subtreeVel(self.model, data)
        return {
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA tension": sim.tension,
            "bend": self.bent(),
            "rate of bend": float(data.qvel[6:].sum()),
            "height": height,
            "vertical velocity": data.subtree_linvel[self._root, 2],
            "clearance": self._clearance(data),
        }

    def details(self) -> dict[str, Any]:
        """The greatest height so far [m], and whether it has jumped."""
        return {"height": self._best, "jumped": self._jumped}

    def bent(self) -> float:
        """Angle from end to end, negative in state 1 [rad]."""
        return float(self.data.qpos[7:].sum())


JumpVector = partial(TaskVector, Jump)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

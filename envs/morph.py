"""``TCA/MorphModule-v0``: a module bends itself to an angle and keeps it (Sun, Section 6.1)."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import door, some
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.hanging import hang
from tca_mj.envs.options import Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.outcome import Verdict
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments, parts
from tca_mj.envs.vector import TaskVector
from tca_mj.model.part import Part
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.record.render import colour_tendons
from tca_mj.sim import Simulation

OBSERVATION = Table(
    [
        Entry("spine temperature", 1, -50.0, 400.0, "°C", centre=70.0, scale=50.0),
        Entry("TCA temperature", 1, -50.0, 300.0, "°C", centre=100.0, scale=75.0),
        Entry("TCA length", 1, 0.0, 1.0, "m", centre=0.22, scale=0.01),
        Entry("TCA resistance", 1, 0.0, 40.0, "ohm", centre=15.7, scale=0.3),
        Entry("TCA tension", 1, 0.0, 5.0, "N", centre=0.2, scale=0.2),
        Entry("angle", 1, -10.0, 10.0, "rad", centre=1.6, scale=1.6),
        Entry("angular velocity", 1, -200.0, 200.0, "rad/s", scale=1.0),
        Entry("commanded angle", 1, 0.0, 4.0, "rad", centre=1.6, scale=1.6),
        Entry("time at the goal", 1, 0.0, 3.0, "s"),
    ]
)
ACTION = Table(
    [
        Entry("heater voltage", 1, -1.0, 1.0, "-", off=-1.0),
        Entry("TCA heating", 1, -1.0, 1.0, "-", off=-1.0),
        Entry("fan", 1, -1.0, 1.0, "on above 0"),
    ]
)

_CLAMP = (-0.03, 0.0, 0.162)  # where the module hangs [m]
# z of the module down, its TCA towards x of the world, wxyz.
_HANGING = (0.0, math.sqrt(0.5), -math.sqrt(0.5), 0.0)
_COLD, _HOT = np.array([0.86, 0.74, 0.48]), np.array([0.90, 0.25, 0.12])  # of the spine
_ROLLED = 2.0 * math.pi  # angle at which the ends meet and the chain would pass itself [rad]
_EXACT = math.radians(1.0)  # error of an angle that does not count [rad]
_APART = math.radians(20.0)  # least distance of a drawn start from the goal [rad]


def _default() -> MorphingSpec:
    return MorphingSpec(motions=("bend_x",))


class MorphModule(SimulatedTask):
    """Bend a module with a shape-memory spine to an angle, so that it stays there unpowered.

    The module hangs from a clamp and bends in a vertical plane. Heated, its spine is soft, its
    weight pulls it straight and its TCA bends it; cold, the spine is rigid. To contract the TCA
    against a stiff spine damages it.

    Action, shape (3,), all in [-1, 1]:
        0: voltage of the heater; -1 is off, 1 is ``max_voltage``, linear in between.
        1: temperature to hold, or power, of the TCA; see ``SimulatedTask``.
        2: fan; it blows above 0.

    Observation, shape (9,): see ``OBSERVATION``, whose rows have units and bounds. The angle is
    that by which the module is bent from base to tip, positive towards the TCA.

    Reward, the sum of the terms in ``info["reward_terms"]``. The first two pay for progress and
    take it back:
        reach: Change of a measure from 0 to 1 of how close the angle is to the commanded one.
        fix: Change of a measure from 0 to 4 of how close the angle is that the spine would have
            without load: the memorised one while it is soft, the present one while it hardens.
        goal: 20 in the step in which the module has been at the goal for 3 s.
        energy: Minus 0.01 per joule of electrical energy of heater and TCA.
        damage: Minus 10 in the step in which the TCA is damaged.

    At the goal the module is within 3° of the commanded angle, its spine is rigid (below 80 °C),
    and heater, TCA and fan are off.

    Reset: cold and fixed in some angle, to be fixed in another one. ``options`` is the table of all
    that can be given.

    Terminates at the goal (success), and when the module is rolled up: bent by a full turn, where
    it would touch itself, which nothing here sees. Truncates after the time limit, and with
    ``info["truncation_reason"]`` if the TCA is damaged, too hot or torn, the spine too hot, or if
    the simulation diverged.
    """

    max_voltage = 25.0  # Sun, Section 6.1.3 [V]
    max_power = 40.0  # about 25 V at the TCA, Sun, Section 6.2.1 [W]
    response = 0.2  # twice the time between two updates, in which 40 W are 30 K; estimate [s]
    max_temperature = 180.0  # annealing temperature of the TCA, Sun, Table 2.1 [°C]
    tolerance = math.radians(3.0)  # Sun, Section 6.2.1, calls this steady [rad]
    hold_time = 3.0  # time at the goal [s]
    start_range = (0.0, math.pi)
    target_range = (math.radians(30.0), math.pi)
    terms = ("reach", "fix", "goal", "energy", "damage")
    energy_price = 0.01
    camera_prefix = "stand."
    scripted = "tca_mj.agents.scripts.morph:scripted"
    scripted_arguments = {"action": "power"}
    robot_argument = ("module_spec", _default)

    @door
    def __init__(
        self,
        *,
        module_spec: MorphingSpec | None = None,
        timestep: Timestep = 5e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            module_spec: The module, by default the published one, bending in its plane only.
            timestep: Physics time step, a whole fraction of ``control_period``, in which the TCA
                and the spine are updated once [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is out of range or the module cannot be built.
        """
        own = type(self).control_period
        parts("timestep", own, timestep)
        self.module_spec = self._robot(module_spec, common)
        part = hanging_module(self.module_spec)
        sim = Simulation(part, timestep=timestep, tca_period=own)
        longest = float(sim.bank.longest.max())
        seen = OBSERVATION.covering(
            {
                "TCA length": (0.0, longest),
                "TCA resistance": (0.0, 2.0 * float(sim.resistance.max())),
            }
        )
        self._open(sim, seen, ACTION, self._options(), **common)
        self.target = self.target_range[1]
        self._at_goal = 0
        self._find(self.model, part)
        self._progress = self._measure(self.angle)
        self._try("module_spec", module_spec)

    def _options(self) -> Options:
        return Options(
            [
                Option(
                    name="target", about="angle to fix", unit="rad",
                    low=self.target_range[0], high=self.target_range[1], drawn="drawn",
                    draw=Uniform(*self.target_range),
                ),
                Option(
                    name="start", about="angle at the start", unit="rad",
                    low=self.start_range[0], high=self.start_range[1], draw=self._draw_start,
                    drawn="drawn, not near the target",
                ),
                *variation_options(),
            ]
        )  # fmt: skip

    def _draw_start(self, random: np.random.Generator, setup: Setup) -> float:
        """Anywhere but near the goal."""
        (low, high), target, share = self.start_range, setup["target"], random.random()
        below = max(target - _APART - low, 0.0)
        above = max(high - target - _APART, 0.0)
        along = share * (below + above)
        return float(low + along if along < below else high - (below + above - along))

    def _find(self, model: mujoco.MjModel, part: Part) -> None:
        """Looks up the addresses of what is observed and set."""
        names = [name for name, _ in part.spines[0].joints]
        bends = np.array([".bend_x" in name for name in names])
        joints = [model.joint(name).id for name, bend in zip(names, bends, strict=True) if bend]
        self._bend_q = model.jnt_qposadr[joints]
        # 1 for a bend, 0 for what else there is: among the spine's joints, positions, velocities.
        self._bends, self._bent_q = bends.astype(np.float64), np.zeros(model.nq)
        self._bent_v = np.zeros(model.nv)
        self._bent_q[self._bend_q] = self._bent_v[model.jnt_dofadr[joints]] = 1.0
        geoms = [model.geom(i).name for i in range(model.ngeom)]
        self._polymer = np.flatnonzero([".polymer" in name for name in geoms])

    @property
    def angle(self) -> float:
        """Angle by which the module is bent, positive towards its TCA [rad]."""
        return float(self.data.qpos.dot(self._bent_q))

    @property
    def fixed_angle(self) -> float:
        """Angle that the spine would have at its present temperature without load [rad]."""
        return float(self.sim.spines.reference.dot(self._bends))

    def prepare(self, setup: Setup) -> None:
        """Bends the cold module to where it starts."""
        self.target = setup["target"]

        def place(data: mujoco.MjData) -> None:
            data.qpos[self._bend_q] = setup["start"] / len(self._bend_q)

        self.sim.reset(place)
        self._at_goal, self._bent = 0, self.angle  # which every observation brings up to date
        self._progress = self._measure(self._bent)

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """Voltage of the heater, what the TCA is told, and the fan; see the class."""
        heater, _, fan = command.tolist()
        return Drive(
            command=self.heated(command[1:2]),
            voltage=self.max_voltage * ((heater + 1.0) / 2.0),
            fan=fan > 0.0,
        )

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """How near the goal is, and how long the module has been there."""
        off = not (drive.voltage or drive.fan or any(self.sim.power.tolist()))
        before, self._progress = self._progress, self._measure(self._bent)
        self._at_goal = self._at_goal + 1 if off and self._fixed() else 0
        held = self._at_goal * self.interval
        success = held > self.hold_time - 1e-9 and not harmed
        terms = {name: value - before[name] for name, value in self._progress.items()}
        terms["goal"] = 20.0 if success else 0.0
        terms["damage"] = -10.0 if some(self.sim.spines.damaged) else 0.0
        return Verdict(
            terms=terms, success=success, seen={"time at the goal": min(held, self.hold_time)},
            ended="rolled up" if abs(self._bent) > _ROLLED and not success else None,
        )  # fmt: skip

    def _fixed(self) -> bool:
        """Whether the angle is the commanded one and the spine rigid."""
        rigid = self.sim.spines.temperature[0] < self.module_spec.spine.smp.rigid_below
        return bool(rigid and abs(self._bent - self.target) <= self.tolerance)

    def _measure(self, angle: float) -> dict[str, float]:
        """How far the task has got at an angle, by reward term."""

        def near(angle: float) -> float:
            beyond = max(abs(angle - self.target) - _EXACT, 0.0)
            return max(1.0 - beyond / math.pi, 0.0)

        self._keeps = self.fixed_angle
        return {"reach": near(angle), "fix": 4.0 * near(self._keeps)}

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        sim, self._bent = self.sim, self.angle
        length = sim.length
        return {
            "spine temperature": sim.spines.temperature,
            "TCA temperature": sim.temperature,
            "TCA length": length,
            "TCA resistance": sim.bank.resistance(sim.tca, length, strict=False),
            "TCA tension": sim.tension,
            "angle": self._bent,
            "angular velocity": self.data.qvel.dot(self._bent_v),
            "commanded angle": self.target,
            "time at the goal": min(self._at_goal * self.interval, self.hold_time),
        }

    def harm(self) -> str | None:
        """What the module does not survive, or None."""
        if some(self.sim.spines.damaged):
            return "damaged: the TCA contracted against a stiff spine"
        return super().harm()

    def details(self) -> dict[str, Any]:
        """The commanded, the present and the fixed angle [rad]."""
        return {"target": self.target, "angle": self._bent, "fixed_angle": self._keeps}

    def bent(self) -> float:
        """See ``angle``."""
        return self.angle

    def paint(self) -> None:
        """Gives TCA and spine the colours of their temperatures; no physics reads them."""
        model, sim = self.model, self.sim
        colour_tendons(model, sim.tendon, sim.temperature)
        heat = np.clip((sim.spines.temperature[0] - 25.0) / 95.0, 0.0, 1.0)
        model.geom_rgba[self._polymer, :3] = _COLD + heat * (_HOT - _COLD)


def hanging_module(spec: MorphingSpec) -> Part:
    """The scene: the module hangs from a stand and bends in the x-z plane.

    Args:
        spec: The module.
    """
    return hang(morphing_module(spec), _CLAMP, _HANGING, "morph_stand")


MorphModuleVector = partial(TaskVector, MorphModule)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

"""A robot, its task and its scripted policy, outside the package.

    PYTHONPATH=examples tca-mj demo --policy scripted --task own_task:Example/Nod-v0

A stick of silicone with one muscle along its side hangs from a clamp and is to nod to an angle.
"""

import math

import gymnasium as gym
import numpy as np

from tca_mj.assets import mjcf
from tca_mj.envs.options import Option, Options, Uniform, variation_options
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, Verdict
from tca_mj.envs.vector import TaskVector
from tca_mj.model.part import Part, new_spec
from tca_mj.model.scene import scene
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.sim import Drive, Simulation

OBSERVATION = Table(
    [
        Entry("TCA temperature", 1, -50.0, 300.0, "°C"),
        Entry("angle", 1, -4.0, 4.0, "rad"),
        Entry("commanded angle", 1, 0.0, 1.0, "rad"),
    ]
)
ACTION = Table([Entry("TCA heating", 1, -1.0, 1.0, "-", off=-1.0)])


def hung(stick):
    robot = Part(new_spec("nod"))
    robot.spec.worldbody.add_site(name="clamp", pos=[0.0, 0.0, 0.1], quat=[0.0, 1.0, 0.0, 0.0])
    robot.attach(stick, to="clamp", prefix="stick")
    return scene(mjcf("arena.xml"), robot, {}, name="robot")


class Nod(SimulatedTask):
    """Nod to an angle and stay there for a second."""

    max_power = 2.0  # [W]
    terms = ("near", "energy", "end")
    energy_price, end_price = 0.01, 1.0
    robot_argument = ("spec", lambda: BendingSpec(count=1))

    def __init__(self, *, spec=None, timestep=5e-3, **common):
        part = hung(bending_module(spec or BendingSpec(count=1)))
        options = Options(
            [
                Option(
                    name="angle", about="commanded angle", unit="rad", low=0.05, high=0.3,
                    draw=Uniform(0.05, 0.3), drawn="drawn",
                ),
                *variation_options(),
            ]
        )  # fmt: skip
        sim = Simulation(part, timestep=timestep, tca_period=type(self).control_period)
        self._open(sim, OBSERVATION, ACTION, options, **common)
        self.angle, self.held = 0.0, 0

    def prepare(self, setup):
        self.angle, self.held = setup["angle"], 0
        self.sim.reset()

    def drive(self, command):
        return Drive(command=self.heated(command))

    def observe(self):
        return {
            "TCA temperature": self.sim.temperature,
            "angle": self.bent(),
            "commanded angle": self.angle,
        }

    def judge(self, drive, harmed):
        gap = abs(self.bent() - self.angle)
        self.held = self.held + 1 if gap < math.radians(1.0) else 0
        return Verdict(terms={"near": -gap}, success=self.held >= 10 and not harmed)

    def bent(self):
        x, _, z = self.data.site("robot.stick.tip").xmat[2::3]  # along the stick
        return math.atan2(abs(x), -z)


class Nodding:
    """Warmer while the angle is too small, colder while it is too large."""

    phase = "nod"

    def __init__(self, task):
        self.coldest, self.hottest = 25.0, task.safe_temperature
        self.reset()

    def reset(self):
        self.target = 60.0

    def act(self, observation):
        seen = OBSERVATION.read(observation.astype(np.float64))
        error = float((seen["commanded angle"] - seen["angle"])[0])
        self.target = float(np.clip(self.target + 40.0 * error, self.coldest, 150.0))
        share = (self.target - self.coldest) / (self.hottest - self.coldest)
        return np.full(1, 2.0 * share - 1.0, dtype=np.float32)


Nod.scripted = Nodding


def NodVector(**arguments):
    """Several of them as one vector environment."""
    return TaskVector(Nod, **arguments)


gym.register(
    "Example/Nod-v0", entry_point=Nod, vector_entry_point=NodVector, max_episode_steps=300
)

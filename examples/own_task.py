"""A task for the robot of own_robot.py, with a script: turn the tip to an angle and keep it."""

import math

import numpy as np
from own_robot import TwoModules, two_modules

import tca_mj
from tca_mj.envs import Entry, Option, SimulatedTask, Verdict


class Turn(SimulatedTask):
    """Turn the tip to an angle and stay there for a second."""

    max_power = 2.0  # of each TCA [W]
    safe_temperature = 140.0  # the highest that an action can ask for [°C]
    terms = ("near", "energy", "end")
    energy_price, end_price = 0.01, 1.0  # per joule; for damage
    film_speed = 1.0  # in real time
    robot_argument = ("spec", TwoModules)
    rows = (
        Entry("TCA temperature", 9, -50.0, 300.0, "°C", centre=80.0, scale=60.0),
        Entry("angle", 1, 0.0, 6.0, "rad", scale=1.0),
        Entry("commanded angle", 1, 0.0, 6.0, "rad", scale=1.0),
    )
    option_rows = [Option(name="angle", about="commanded angle", unit="rad", low=0.2, high=0.8)]

    @staticmethod
    def scene(spec):
        return tca_mj.in_arena(two_modules(spec), pos=(0.0, 0.0, 0.13))

    def prepare(self, setup):
        self.sim.reset()
        self.angle, self.held = setup["angle"], 0

    def observe(self):
        angles = {"angle": self.bent(), "commanded angle": self.angle}
        return {"TCA temperature": self.sim.temperature, **angles}

    def judge(self, drive, harmed):
        gap = abs(self.bent() - self.angle)
        self.held = self.held + 1 if gap < math.radians(2.0) else 0
        return Verdict(terms={"near": -gap}, success=self.held >= 10 and not harmed)

    def bent(self):
        return self.sim.bend("robot.upper", "robot.lower")

    def script(self, observation):
        """Warms a TCA of each module, the more the further the tip is from the angle."""
        seen = self.observation.read(observation)
        missing = seen["commanded angle"] - seen["angle"]
        target = np.full(9, 25.0)
        target[[0, 6]] = seen["TCA temperature"][[0, 6]] + 40.0 * missing
        return np.clip((target - 25.0) / (140.0 - 25.0) * 2.0 - 1.0, -1.0, 1.0).astype(np.float32)


tca_mj.register_task("Example/Turn-v0", Turn, max_episode_steps=300)

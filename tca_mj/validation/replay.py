"""Sun, Fig. 4.6, replayed: the printed powers, open loop, beside what the scripted policy uses.

Printed are three powers for each of two objects and "2 s" for the wrist and the gripper
(Sections 4.1.1 and 4.1.2). The order of events is that of Section 4.1.4, all other times are
estimates. Nothing is grasped here: the object is a mass that hangs between the finger tips.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import groupby
from types import MappingProxyType
from typing import NamedTuple

import mujoco
import numpy as np

from tca_mj.agents.scripts.arm import PickAndPlace
from tca_mj.checks import Array
from tca_mj.envs.arm import ArmPickPlace
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.sim import Simulation
from tca_mj.validation.attitude import by_place

OBJECT = 1e-3  # mass of a screwdriver or a PCB that the arm lifts: an estimate [kg]
PERIOD = 0.1  # between two samples [s]
HEATING = 2.0  # of wrist and gripper, Sun, Sections 4.1.1 and 4.1.2 [s]
CLOSING = 0.5  # Sun, Fig. 4.2: off at 2 s, an object is held at 2.5 s [s]
LIFTING = 1.5  # an estimate [s]
_SPEED = 0.02  # of the base meanwhile, an estimate [m/s]
LONGEST = 30.0  # of the bend, an estimate [s]
_STILL = 0.3  # change of the bend within 2 s that counts as none [deg]


class Powers(NamedTuple):
    """The printed powers of one object.

    Attributes:
        wrist: For 2 s [W].
        gripper: For 2 s [W].
        bend: Of TCAs 1 and 2 of the bending module [W].
        turn: Reported turn of the wrist [deg].
    """

    wrist: float
    gripper: float
    bend: tuple[float, float]
    turn: float


# Sun, Section 4.1.4 and Fig. 4.6.
PRINTED: Mapping[str, Powers] = MappingProxyType({
    "screwdriver": Powers(14.0, 10.0, (0.6, 0.6), 45.0),
    "pcb": Powers(16.0, 8.0, (0.2, 0.8), 58.0),
})  # fmt: skip


@dataclass(slots=True)
class Course:
    """What an arm did; the lists have one entry per sample.

    Attributes:
        time: Time [s].
        phase: What it was doing.
        power: Power of the five TCAs [W].
        temperature: Their temperatures [°C].
        body: Temperatures of what they lie in [°C].
        wrist: Turn of the wrist [deg].
        opening: Distance between the finger tips [mm].
        bend: Angle of the bending module's tip, by its axis [deg].
        place: The same by its place, Sun, eq. (4.1) [deg].
        astray: Between the directions of the two, 0 as long as the module bends in a plane [deg].
        ending: Why it was over, if it did not come to its end.
    """

    time: list[float] = field(default_factory=list)
    phase: list[str] = field(default_factory=list)
    power: list[Array] = field(default_factory=list)
    temperature: list[Array] = field(default_factory=list)
    body: list[Array] = field(default_factory=list)
    wrist: list[float] = field(default_factory=list)
    opening: list[float] = field(default_factory=list)
    bend: list[float] = field(default_factory=list)
    place: list[float] = field(default_factory=list)
    astray: list[float] = field(default_factory=list)
    ending: str = ""

    def sample(self, sim: Simulation, phase: str, prefix: str = "") -> None:
        """Takes down how an arm is now."""
        data = sim.data
        mount, tip = (data.site(f"{prefix}{name}") for name in ("mount", "bending.tip"))
        frame = mount.xmat.reshape(3, 3)
        axis = frame.T @ tip.xmat.reshape(3, 3)[:, 2]
        place = by_place(frame.T @ (tip.xpos - mount.xpos), ArmSpec().bending.length)
        ends = [data.site(f"{prefix}gripper.tip{i}").xpos for i in range(2)]
        self.time.append(sim.time)
        self.phase.append(phase)
        self.power.append(sim.power.copy())
        self.temperature.append(sim.temperature.copy())
        self.body.append(sim.body_temperature.copy())
        self.wrist.append(wrist_turn(sim, prefix))
        self.opening.append(1e3 * float(np.linalg.norm(ends[1] - ends[0])))
        self.bend.append(math.degrees(math.acos(max(-1.0, min(1.0, axis[2])))))
        self.place.append(math.degrees(place.angle))
        turned = math.atan2(axis[1], axis[0]) - place.direction
        self.astray.append(abs(math.degrees(math.remainder(turned, 2.0 * math.pi))))

    def phases(self) -> list[tuple[str, slice]]:
        """The phases in their order, each with its samples."""
        found, start = [], 0
        for name, samples in groupby(self.phase):
            stop = start + len(list(samples))
            found.append((name, slice(start, stop)))
            start = stop
        return found


def wrist_turn(sim: Simulation, prefix: str = "") -> float:
    """Sum of the twists along the wrist, without a sign [deg]."""
    model = sim.model
    twists = [i for i in range(model.njnt)
              if model.joint(i).name.startswith(f"{prefix}wrist.body.twist")]  # fmt: skip
    return abs(math.degrees(float(sim.data.qpos[model.jnt_qposadr[twists]].sum())))


def loaded_arm(
    mass: float = OBJECT, *, timestep: float = 5e-3, tca_period: float = 2e-2
) -> Simulation:
    """The arm, cold, with a mass fixed between its finger tips.

    Args:
        mass: The mass [kg].
        timestep: As in ``Simulation`` [s].
        tca_period: As in ``Simulation`` [s].
    """
    spec, part = ArmSpec(), arm()
    grasp = part.spec.site("gripper.grasp")
    grasp.parent.add_geom(
        name="object", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-4, 0.0, 0.0],
        pos=list(grasp.pos), mass=mass, contype=0, conaffinity=0,
    )  # fmt: skip
    sim = Simulation(part, timestep=timestep, tca_period=tca_period)

    def place(data: mujoco.MjData) -> None:
        data.qpos[sim.model.joint("lift").qposadr] = data.act[0] = spec.height

    sim.reset(place)
    return sim


def replay(powers: Powers) -> Course:
    """Rotate for 2 s, open for 2 s, close, lift, bend until it moves no more, open for 2 s."""
    sim, course = loaded_arm(), Course()
    sim.step(np.zeros(5), 1.0)  # hangs at rest
    sim.data.time = 0.0
    course.sample(sim, "rotate")

    bend = [*powers.bend, 0.0]
    plan = (
        ("rotate", [0.0, 0.0, 0.0, powers.wrist, 0.0], HEATING),
        ("open", [0.0, 0.0, 0.0, 0.0, powers.gripper], HEATING),
        ("close", [0.0] * 5, CLOSING), ("lift", [0.0] * 5, LIFTING),
        ("bend", [*bend, 0.0, 0.0], LONGEST), ("release", [*bend, 0.0, powers.gripper], HEATING),
    )  # fmt: skip
    for name, power, time in plan:
        sim.data.ctrl[0] = _SPEED if name == "lift" else 0.0
        for k in range(round(time / PERIOD)):
            sim.step(np.array(power), PERIOD)
            course.sample(sim, name)
            moved = course.bend[-1] - course.bend[-21] if k >= 40 else np.inf
            if name == "bend" and abs(moved) < _STILL:
                break
    return course


def scripted(name: str, *, seed: int = 0, limit: float = 120.0) -> Course:
    """An episode of ``TCA/ArmPickPlace-v0`` by ``PickAndPlace``.

    Args:
        name: The object, ``"screwdriver"`` or ``"pcb"``.
        seed: Seed of the episode.
        limit: Time after which to stop [s].
    """
    task, policy, course = ArmPickPlace(action="power"), PickAndPlace(), Course()
    seen, _ = task.reset(seed=seed, options={"object": name})
    course.sample(task.sim, policy.phase, "arm.")
    while not course.ending:
        action = policy.act(seen)
        seen, _, terminated, truncated, info = task.step(action)
        course.sample(task.sim, policy.phase, "arm.")
        if terminated or truncated:
            reasons = info.get("truncation_reason") or info.get("termination_reason")
            course.ending = "success" if info["success"] else str(reasons)
        elif task.sim.time > limit - 1e-6:
            course.ending = f"stopped after {limit:g} s"
    task.close()
    return course

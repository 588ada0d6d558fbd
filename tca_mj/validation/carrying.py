"""What the bistable gripper carries, with its bands and without (Sun, Section 4.3.4)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np

from tca_mj.model.part import Part, new_spec
from tca_mj.modules.bistable import shaped
from tca_mj.robots.bistable_gripper import CLOSING, SIDES, BistableGripperSpec, bistable_hand
from tca_mj.sim import Simulation
from tca_mj.validation.facts import Finding, finding

GRAVITY = 9.81  # [m/s²]
OHMS = 6.7  # of 100 mm of TCA: 1.5 A are the 15 W of the task [ohm]
_TOP, _BELOW = 0.12, 22e-3  # height of the fingers' roots, and the head's middle below [m]
_HEAD, _MASS = 20e-3, 2e-3  # edge of the head, and its own mass [m, kg]
_RATE = 4e-3  # growth of the load [kg/s]
_LOST = 25e-3  # way after which it is lost [m]
_MOST = 0.15  # load at which it is given up [kg]
_PERIOD = 2e-2  # time between two updates of the TCAs [s]


def without_bands(spec: BistableGripperSpec) -> BistableGripperSpec:
    """The gripper with straight spines and no bands: traditional bending modules."""
    return replace(spec, finger=replace(spec.finger, band_ratio=0.0, angle=0.0))


def limit_load(
    spec: BistableGripperSpec, temperature: float = 25.0, timestep: float = 1e-3
) -> float:
    """Largest mass that the closed gripper carries by a cube of 20 mm, slowly loaded [kg].

    The cube moves only up and down. Suddenly loaded, what is carried scatters.

    Args:
        spec: The gripper.
        temperature: Temperature of the closing TCAs, whose silicone is as warm as it gets [°C].
        timestep: Physics time step [s].
    """
    part = Part(new_spec("carrying"))
    part.spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    part.spec.worldbody.add_site(name="top", pos=[0.0, 0.0, _TOP], quat=[0.0, 1.0, 0.0, 0.0])
    part.attach(bistable_hand(spec), to="top", prefix="hand")
    head = part.spec.worldbody.add_body(name="head", pos=[0.0, 0.0, _TOP - _BELOW])
    head.add_joint(
        name="way", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, -1.0], damping=[0.1, 0.0, 0.0]
    )
    head.add_geom(
        name="head", type=mujoco.mjtGeom.mjGEOM_BOX, size=[_HEAD / 2.0] * 3, mass=_MASS,
        contype=1, conaffinity=0, condim=3, friction=[0.8, 0.005, 1e-4], solref=[5e-3, 1.0],
        solimp=[0.95, 0.99, 5e-4, 0.5, 2.0],
    )  # fmt: skip
    sim = Simulation(part, timestep=timestep, tca_period=_PERIOD)
    data, body = sim.data, sim.model.body("head").id
    names = [sim.model.joint(i).name for i in range(sim.model.njnt)]
    closed = shaped(spec.finger, 0.05)  # just beyond the top

    def place(data: mujoco.MjData) -> None:
        for side in range(SIDES):
            mine = [i for i, name in enumerate(names) if name.startswith(f"hand.finger{side}.")]
            data.qpos[sim.model.jnt_qposadr[mine]] = closed

    warm = np.full(sim.n, 25.0)
    warm[list(CLOSING)] = temperature
    sim.reset(place)
    data.xfrc_applied[body, 2] = _MASS * GRAVITY
    sim.rest(warm, warming=1.0, longest=3.0)
    power, load, start = sim.keep(warm), 0.0, float(data.qpos[sim.model.joint("way").qposadr[0]])
    while load < _MOST:
        load += _RATE * _PERIOD
        data.xfrc_applied[body, 2] = (_MASS - load) * GRAVITY
        sim.step(power, _PERIOD)
        if float(data.qpos[sim.model.joint("way").qposadr[0]]) - start > _LOST:
            break
    return load


@cache
def steady(spec: BistableGripperSpec, current: float) -> float:
    """Temperature that a current keeps the closing TCA at for good [°C].

    Args:
        spec: The gripper.
        current: The current [A].
    """
    bank = Simulation(bistable_hand(spec)).bank
    low, high = 25.0, 250.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        used = float(bank.steady(np.full(2 * SIDES, middle))[1][CLOSING[0]])
        low, high = (middle, high) if used < OHMS * current**2 else (low, middle)
    return low


def findings() -> list[Finding]:
    """What is carried without power and with little, with bands and without."""
    spec = BistableGripperSpec()
    bare = without_bands(spec)
    little, more = steady(spec, 0.2), steady(spec, 0.5)
    cold, warm = limit_load(spec), limit_load(spec, little)
    driven = limit_load(bare, more)
    return [
        finding(
            "bistable-hold", 1e3 * cold, cold > 15e-3 and warm > 34e-3 and cold > driven,
            warm=1e3 * warm, little=little, bare=1e3 * limit_load(bare), driven=1e3 * driven,
            more=more,
        )
    ]  # fmt: skip

"""The bistable module (Sun, Section 4.3): triggering forces and snap in MuJoCo, and its facts.

Triggering forces are those of a cable that is pulled ever harder until the module goes over; the
snap is what follows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from tca_mj.agents.scripts.jump import JumpPolicy
from tca_mj.checks import Array
from tca_mj.envs.jump import Jump
from tca_mj.modules.bistable import BistableSpec, bistable_module, capstan, shaped
from tca_mj.validation.carrying import findings as carrying
from tca_mj.validation.facts import Finding, finding

ANGLES = (45.0, 50.0, 65.0, 75.0, 100.0)  # of the five spines, Sun, Fig. 4.14b [deg]
FIRST = math.radians(-30.0)  # bend at which a snap is taken to begin, and to end [rad]
LAST = math.radians(90.0)
_OVER = 0.3  # bend beyond which the module has gone over [rad]
_CLOSE = 3e-4  # how closely a triggering force is found, over that of theory
_PULL = 1.1  # tension that drives a snap, over the triggering one


def _module(spec: BistableSpec, timestep: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The module with cables, without its weight."""
    part = bistable_module(spec, drive="cables")
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    part.spec.option.timestep = timestep
    model: mujoco.MjModel = part.spec.compile()
    return model, mujoco.MjData(model)


def triggering(spec: BistableSpec, to: int) -> float:
    """Tension of a cable that brings the module to another state, in MuJoCo [N].

    Args:
        spec: The module.
        to: The state, 1 or 2. With no tension at all it is 0.
    """
    model, data = _module(spec, 5e-3)
    # Of the two integrators the one that comes to rest faster; where it rests is the same.
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    sign, cable = (-1.0, 1.0)[to - 1], model.actuator(f"to{to}").id
    expected = spec.rod.thresholds(spec.offset, friction=spec.friction)[to - 1]

    def goes_over(tension: float) -> bool:
        data.ctrl[cable], data.qvel[:] = tension, 0.0
        for _ in range(200):
            if spec.friction:
                capstan(model, f"to{to}", data.qpos, spec)
            mujoco.mj_step(model, data, 20)
            if sign * data.qpos.sum() > _OVER:
                return True
            if np.abs(data.qvel).max() < 1e-6:
                break
        return False

    data.qpos[:] = shaped(spec, -2.0 * sign)
    if goes_over(0.0):
        return 0.0
    low, high, rest = 0.0, 1.2 * max(expected, 0.02), data.qpos.copy()
    tension = 0.9 * expected
    while high - low > _CLOSE * high:
        data.qpos[:] = rest
        if goes_over(tension):
            high = tension
        else:
            low, rest = tension, data.qpos.copy()
        tension = 0.5 * (low + high)
    return tension


def landscape(spec: BistableSpec, bends: Array) -> Array:
    """Energy of springs and band in MuJoCo at bends, all else at rest, of the same shape [J].

    Args:
        spec: The module.
        bends: Angles of the tip [rad].
    """
    model, data = _module(spec, 5e-3)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    found = np.empty(len(bends))
    for i, bend in enumerate(bends):
        data.qpos[:], data.qvel[:] = shaped(spec, float(bend)), 0.0
        moment = spec.rod.moment(float(bend))
        for _ in range(400):  # a moment on the tip, as a cable's, keeps it there
            missing = spec.stiffness * (bend - data.qpos.sum())
            moment += 0.1 * missing
            data.qfrc_applied[:] = moment + 2.0 * missing
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        found[i] = data.energy[0]
    return found


class Snap(NamedTuple):
    """The way from -30 to 90 degrees, pulled by a cable with 1.1 times what triggers it.

    Attributes:
        speed: Largest speed of the tip [m/s].
        time: Time that it takes [s].
        freed: Energy that spring and band give and the cable adds, to the end [J].
        lost: Energy that damping takes and that is left in motion [J].
    """

    speed: float
    time: float
    freed: float
    lost: float


def snap(spec: BistableSpec, timestep: float, integrator: int | None = None) -> Snap:
    """A snap to state 2 in MuJoCo.

    Args:
        spec: The module, without friction.
        timestep: Time step [s].
        integrator: MuJoCo's number of it; None for the module's.
    """
    model, data = _module(spec, timestep)
    if integrator is not None:
        model.opt.integrator = integrator
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data.qpos[:] = shaped(spec, FIRST)
    tension = _PULL * spec.rod.thresholds(spec.offset).second
    data.ctrl[model.actuator("to2").id] = tension
    mujoco.mj_forward(model, data)
    begin, bend, six = float(data.energy.sum()), float(data.qpos.sum()), np.zeros(6)
    speed, taken, lost = 0.0, math.nan, 0.0
    tip, site = model.site("tip").id, mujoco.mjtObj.mjOBJ_SITE
    for _ in range(round(0.2 / timestep)):
        before, was = data.qvel.copy(), float(data.qpos.sum())
        mujoco.mj_step(model, data)
        lost += timestep * float(model.dof_damping @ (0.5 * (before + data.qvel)) ** 2)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_objectVelocity(model, data, site, tip, six, 0)
        speed = max(speed, float(np.linalg.norm(six[3:])))
        now = float(data.qpos.sum())
        if math.isnan(taken) and now > LAST:
            taken = data.time - timestep * (now - LAST) / (now - was)
    mujoco.mj_forward(model, data)
    moved = float(data.qpos.sum()) - bend
    freed = begin - float(data.energy[0]) + tension * spec.offset * moved
    return Snap(speed, taken, freed, lost + float(data.energy[1]))


def lines(spec: BistableSpec, angles: tuple[float, ...] = ANGLES) -> Array:
    """Triggering forces in MuJoCo over the spine's angle, shape (2, angles) [N].

    Args:
        spec: The module.
        angles: Angles of the spine [deg].
    """
    bent = [replace(spec, angle=math.radians(angle)) for angle in angles]
    return np.array([[triggering(one, to) for one in bent] for to in (1, 2)])


def _jump() -> Finding:
    """The jump of the script."""
    env, policy = Jump(), JumpPolicy()
    observation, info = env.reset(seed=0)
    ended, heated, hottest = False, 0.0, 0.0
    while not ended:
        action = policy.act(observation)
        heated += env.control_period * float(action[0] > 0.0)
        observation, _, terminated, truncated, info = env.step(action)
        ended, hottest = terminated or truncated, max(hottest, float(env.sim.temperature[0]))
    module = env.jumper_spec.module
    first, _, second = module.rod.states()
    stored = module.rod.energy(first) - module.rod.energy(second)
    weight = 9.81 * float(env.model.body_mass.sum())
    return finding(
        "bistable-jump", 1e3 * info["height"], share=100.0 * weight * info["height"] / stored,
        power=env.max_power,
        melts=25.0 + 0.3 * env.max_power / float(np.ravel(env.heat.capacity)[0]),
        hottest=hottest, time=heated,
    )  # fmt: skip


def findings(*, full: bool = True) -> list[Finding]:
    """Triggering forces over the spine's angle (Sun, Section 4.3.3).

    Args:
        full: Whether to look at all five spines and at friction, in some ten seconds.
    """
    spec = BistableSpec()
    angles = ANGLES if full else (45.0, 75.0, 100.0)
    force = lines(spec, angles)
    ideal = spec.stiffness / spec.offset * math.radians(1.0)  # slope of theory [N/deg]
    slopes = [
        float(Polynomial.fit(angles[:-1], row[:-1], 1).convert().coef[1]) / ideal for row in force
    ]
    zero = spec.angle + spec.rod.thresholds(1.0).second / spec.stiffness
    rows = [
        finding("triggering-lines", 100.0 * max(abs(slopes[0] - 1.0), abs(slopes[1] + 1.0)),
                first=slopes[0], second=slopes[1]),
        finding("triggering-zero", float(force[1, -1]),
                zero=math.degrees(zero)),
    ]  # fmt: skip
    if full:
        rubbed = replace(spec, angle=math.radians(45.0), friction=0.3)
        more = triggering(rubbed, 2) - float(force[1, 0])
        rows.append(finding("triggering-friction", more, more > 0.0, friction=rubbed.friction))
        rows.append(_jump())
    if full:
        rows += carrying()
    weight = 2e3 * (spec.body.mass + 2.0 * spec.embedded.of_length(0.1).mass)
    return [*rows, finding("bistable-weight", weight)]

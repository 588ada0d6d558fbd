"""What a jump of the jumper depends on, and where its energy goes (Sun, Section 4.3.4)."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco

from tca_mj.agents.scripts.jump import JumpPolicy
from tca_mj.envs.jump import HASTE, PERIOD, TIMESTEP, Jump
from tca_mj.sim import Haste

NOMINAL = {"tca_gain": 1.0, "heat_loss": 1.0, "ambient": 25.0}  # what seeds draw otherwise
_ALMOST = -0.55  # bend shortly before the module goes over [rad]
_WATCHED = 0.06  # time from there on: it has gone over, and flies [s]


def jumper_with(share: float) -> Jump:
    """The task with a share of all its time steps: of physics and TCA, also while it snaps."""
    haste = Haste(
        speed=HASTE.speed, timestep=share * HASTE.timestep, tca_period=share * HASTE.tca_period
    )
    return Jump(timestep=share * TIMESTEP, tca_period=share * PERIOD, haste=haste)


def jumped(env: Jump, seed: int = 0, **options: Any) -> dict[str, Any]:
    """Last information of an episode of the script."""
    policy, ended = JumpPolicy(), False
    observation, info = env.reset(seed=seed, options=options)
    while not ended:
        observation, _, terminated, truncated, info = env.step(policy.act(observation))
        ended = terminated or truncated
    return info


class Balance(NamedTuple):
    """Energies of a jump [J].

    Attributes:
        lost: What spring, band and weight have lost.
        kept: What motion has gained.
        taken: What damping took.
        given: What ground and TCA gave; negative if they took.
    """

    lost: float
    kept: float
    taken: float
    given: float

    @property
    def error(self) -> float:
        """What is not accounted for, over what is lost."""
        return (self.lost + self.given - self.taken - self.kept) / self.lost


def balance(timestep: float = HASTE.timestep) -> Balance:
    """Where the energy of a snap and its jump goes.

    Args:
        timestep: Physics time step, from shortly before the snap on [s].
    """
    env = Jump(action="power")
    env.reset(seed=0, options=NOMINAL)
    sim, model, data = env.sim, env.model, env.data
    while env.bent() < _ALMOST:
        sim.step([env.max_power], 1e-2)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    model.opt.timestep = timestep
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST  # as in haste
    mujoco.mj_forward(model, data)
    begin, taken, given = data.energy.copy(), 0.0, 0.0
    for _ in range(round(_WATCHED / timestep)):
        before = data.qvel.copy()
        mujoco.mj_step(model, data)
        speed = 0.5 * (before + data.qvel)
        taken += timestep * float(model.dof_damping @ speed**2)
        given += timestep * float((data.qfrc_constraint + data.qfrc_actuator) @ speed)
    mujoco.mj_forward(model, data)
    lost, kept = float(begin[0] - data.energy[0]), float(data.energy[1] - begin[1])
    return Balance(lost, kept, taken, given)

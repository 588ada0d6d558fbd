"""The whole state of a simulation as a value: to go on from, to go back to, to branch at."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import instance
from tca_mj.model.smooth import Strained
from tca_mj.sim import Simulation
from tca_mj.smp import HeaterSpec, SpinesState
from tca_mj.tca import HeatSpec, Pull, TcaState

Array = NDArray[np.float64]

# What a simulation writes to its model while it runs.
_WRITTEN = ("actuator_biasprm", "jnt_stiffness", "qpos_spring", "dof_damping")
_SPRINGS = ("stiffness", "rest", "damping")  # of the body's cells, which spines change


@dataclass(frozen=True, slots=True, eq=False)
class SimulationState:
    """Everything that a simulation does not have from its part; nothing in it changes.

    Friction, masses and other figures of the model are none of it: see ``tca_mj.variation``.

    Attributes:
        data: MuJoCo's state, with all that was computed from it.
        written: What the simulation has written to its model.
        tca: Thermal state of the TCAs.
        pull: Their law at the last update.
        power: Power of the last step [W].
        strained: The cells at the last update.
        springs: The cells' springs.
        spines: Heat and memory of the spines, voltages and damage.
        gain: Factor of the tensions.
        heat: Thermal constants of the TCAs.
        heater: Those of the spines; None without spines.
    """

    data: mujoco.MjData
    written: dict[str, Array]
    tca: TcaState
    pull: Pull
    power: Array
    strained: Strained
    springs: dict[str, Array]
    spines: tuple[SpinesState | None, Array, NDArray[np.bool_]]
    gain: float
    heat: HeatSpec
    heater: HeaterSpec | None


def get_state(sim: Simulation, old: SimulationState | None = None) -> SimulationState:
    """The state of a simulation between two steps; what happens to it later does not change it.

    Args:
        sim: The simulation.
        old: A state of it that is no longer wanted, whose memory is taken: a hundred times faster.
    """
    instance("sim", sim, Simulation)
    instance("old", old, SimulationState | None)
    spines = sim.spines
    if old is None:
        data = copy.copy(sim.data)
    else:
        data = old.data
        mujoco.mj_copyData(data, sim.model, sim.data)
    return SimulationState(
        data=data,
        written={name: getattr(sim.model, name).copy() for name in _WRITTEN},
        tca=sim.tca,
        pull=sim.pull,
        power=sim.power.copy(),
        strained=sim.strained,
        springs={name: getattr(sim.body, name).copy() for name in _SPRINGS},
        spines=(spines.state, spines.voltage.copy(), spines.damaged.copy()),
        gain=sim.gain,
        heat=sim.bank.heat,
        heater=spines.bank.heater if spines.n else None,
    )


def set_state(sim: Simulation, state: SimulationState) -> None:
    """Puts a simulation into a state of its own or of one that was built alike.

    From there it goes, bit for bit, where the other one went.

    Args:
        sim: The simulation, which is changed.
        state: The state, as ``get_state`` returns it.

    Raises:
        ValueError: If the simulation was built of another part.
    """
    instance("sim", sim, Simulation)
    instance("state", state, SimulationState)
    if state.data.qpos.shape != sim.data.qpos.shape or state.power.shape != sim.power.shape:
        raise ValueError(
            f"state must be of a simulation with {sim.data.qpos.size} positions and {sim.n} TCAs,"
            f" got {state.data.qpos.size} and {state.power.size}"
        )
    mujoco.mj_copyData(sim.data, sim.model, state.data)
    for name, values in state.written.items():
        getattr(sim.model, name)[:] = values
    for name, values in state.springs.items():
        getattr(sim.body, name)[:] = values
    spines: Any = sim.spines
    spines.state, spines.voltage, spines.damaged = (
        state.spines[0], state.spines[1].copy(), state.spines[2].copy()
    )  # fmt: skip
    sim.tca, sim.pull, sim.power = state.tca, state.pull, state.power.copy()
    sim.strained, sim.gain, sim.bank.heat = state.strained, state.gain, state.heat
    if state.heater is not None:
        spines.bank.heater = state.heater

"""What a simulation is told, how fine its steps are, and how it says that it is over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Checked, Positive, number

# 0.1 s is longer than a soft body swings, a microsecond shorter than any contact.
Timestep = Annotated[float, partial(number, at_least=1e-6, at_most=0.1, unit="s")]
# Surroundings in which TCAs and spines are cold, and were tried.
Ambient = Annotated[float, partial(number, at_least=-40.0, at_most=60.0, unit="°C")]

# Warnings after which MuJoCo has reset the state by itself.
DIVERGENCE = {
    int(warning): str(warning).rsplit("_", 1)[-1]
    for warning in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
}


class SimulationDiverged(ArithmeticError):
    """The simulation left the range of finite, physical states."""


class SimulationOverheated(SimulationDiverged):
    """A TCA would be hotter than the temperature at which its fibre melts."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Drive:
    """What drives a simulation, constant over a step; checked by ``Simulation.step``.

    Attributes:
        command: Command of the TCAs, in the unit of the simulation's supply, shape (n,).
        voltage: Voltage of the spines' heaters, shape (spines.n,) or one for all [V].
        fan: Whether air is blown at the spines, shape (spines.n,) or one for all.
    """

    command: NDArray[np.float64]
    voltage: ArrayLike = 0.0
    fan: ArrayLike = False


@dataclass(frozen=True, kw_only=True, slots=True)
class Haste(Checked):
    """Smaller steps while something of a robot snaps beside something that it can strike.

    Strikes ask for them: what snaps through free air takes the simulation's own. Beside something
    is what MuJoCo lists a contact for, which it does from the geoms' ``gap`` on. The integrator is
    ``implicitfast`` then, which does not damp what moves that fast.

    Attributes:
        speed: Speed of a hinge or slide above which it snaps [rad/s, m/s].
        timestep: Physics time step then [s].
        tca_period: Time between two updates of the TCAs then, a multiple of ``timestep`` and a
            whole fraction of the simulation's own [s].

    Raises:
        ValueError: If a number is out of range, or the period no multiple.
    """

    speed: Positive
    timestep: Timestep
    tca_period: Positive

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        whole_number("tca_period", self.tca_period, "timestep", self.timestep)

    @property
    def substeps(self) -> int:
        """Physics steps between two updates."""
        return round(self.tca_period / self.timestep)


def whole_number(name: str, whole: float, of: str, part: float) -> int:
    """How many times a time is in another one.

    Raises:
        ValueError: If that is no positive whole number.
    """
    count = round(whole / part)
    if count < 1 or abs(count * part - whole) > 1e-9:
        raise ValueError(f"{name} must be a positive multiple of {of} {part} s, got {whole}")
    return count

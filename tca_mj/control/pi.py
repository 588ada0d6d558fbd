"""PI control with a limited output, without wind-up, with gains that change near the goal.

    output = K_P e + I      dI/dt = K_I e      lowest <= output <= highest

A heater has limits on both sides: it cannot cool, and its supply ends. While the output is at a
limit the integral grows only in the direction that leads away from it. Sun, dissertation, Colorado
State University, Section 4.2.2, starts with a large K_P and lowers it for good once the error is
small: ``near``. At that moment the integral takes over what K_P e loses, so that the output
does not jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import (
    Array,
    Checked,
    NotNegatives,
    door,
    instance,
    limits,
    numbers,
    require_positive,
    within,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class PiSpec(Checked):
    """Gains and limits, scalars or arrays that broadcast with the errors (..., n).

    Attributes:
        proportional: K_P, not negative [unit of the output / unit of the error].
        integral: K_I, not negative [the same / s].
        lowest: Lower limit of the output [its unit].
        highest: Upper limit, above the lower one [its unit].
        near: Size of the error from which on ``near_proportional`` holds, for good; 0 is never
            [unit of the error].
        near_proportional: K_P from then on, not negative [as before].
        near_integral: K_I from then on; None is the same as before [as before].
    """

    proportional: NotNegatives
    integral: NotNegatives = 0.0
    lowest: Annotated[float | Array, numbers] = 0.0
    highest: Annotated[float | Array, limits] = math.inf
    near: NotNegatives = 0.0
    near_proportional: NotNegatives = 0.0
    near_integral: NotNegatives | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if not np.all(np.asarray(self.lowest) < self.highest):
            raise ValueError(f"highest must be above lowest {self.lowest}, got {self.highest}")


@dataclass(frozen=True, slots=True, eq=False)
class PiState:
    """State of n controllers, each array of shape (..., n).

    Attributes:
        integral: Integral part of the output [unit of the output].
        arrived: Whether the error has been as small as ``near`` once.
    """

    integral: Array
    arrived: NDArray[np.bool_]


@door
def pi_rest(shape: tuple[int, ...] = ()) -> PiState:
    """State before the first step.

    Args:
        shape: Shape of the errors, (..., n).
    """
    return PiState(np.zeros(shape), np.zeros(shape, dtype=bool))


def pi_step(spec: PiSpec, state: PiState, error: ArrayLike, dt: float) -> tuple[PiState, Array]:
    """One step of the controller.

    Args:
        spec: Gains and limits.
        state: State before the step, shape (..., n).
        error: Goal minus measurement, a shape that broadcasts with it [any unit].
        dt: Time since the last step, above 0 [s].

    Returns:
        State after the step, and the output, each of the broadcast shape.

    Raises:
        ValueError: If an error is not finite, or ``dt`` not above 0 and finite.
    """
    instance("spec", spec, PiSpec)
    instance("state", state, PiState)
    error = within("error", error)
    require_positive(dt=dt)
    arrives = ~state.arrived & (np.abs(error) <= spec.near) & (np.asarray(spec.near) > 0.0)
    arrived = state.arrived | arrives
    proportional = np.where(arrived, spec.near_proportional, spec.proportional)
    late = spec.integral if spec.near_integral is None else spec.near_integral
    rate = np.where(arrived, late, spec.integral) * error
    handed_over = (np.asarray(spec.proportional) - spec.near_proportional) * error
    integral = state.integral + np.where(arrives, handed_over, 0.0)
    wanted = proportional * error + integral + rate * dt
    # At a limit the integral may only go back.
    stuck = ((wanted > spec.highest) & (rate > 0.0)) | ((wanted < spec.lowest) & (rate < 0.0))
    integral = np.where(stuck, integral, integral + rate * dt)
    output = np.clip(proportional * error + integral, spec.lowest, spec.highest)
    return PiState(integral, arrived), output

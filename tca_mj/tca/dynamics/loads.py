"""What hangs at TCAs, what heats them, and the states of their motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, Checked, NotNegatives, Positive, Positives, door, numbers, within

Source = Literal["power", "voltage", "current"]

GRAVITY = 9.81  # [m/s^2]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Load(Checked):
    """What hangs at TCAs, scalars or arrays that broadcast with (..., n).

    Attributes:
        force: Pull on the TCA at the length ``reference`` [N].
        stiffness: Growth of the pull per contraction, not negative [N/m].
        reference: Length of the TCA at which the pull is ``force`` [m].
        mass: Mass that moves with the end, not negative [kg].
        damping: Force per speed of the end, of the TCA and what it moves, not negative [N s/m].
    """

    force: NotNegatives
    stiffness: NotNegatives = 0.0
    reference: NotNegatives = 0.0
    mass: NotNegatives = 0.0
    damping: NotNegatives = 0.0

    @classmethod
    @door
    def weight(cls, mass: NotNegatives, damping: NotNegatives = 0.0) -> Load:
        """A hanging mass [kg]."""
        weight = within("mass", mass, at_least=0.0, unit="kg") * GRAVITY
        return cls(force=weight, mass=mass, damping=damping)

    @classmethod
    @door
    def spring(
        cls,
        stiffness: float | Array,
        pretension: float | Array,
        reference: float | Array,
        mass: float | Array = 0.0,
        damping: float | Array = 0.0,
    ) -> Load:
        """A linear spring between the TCA's end and a wall, Sun, Section 3.4.4, case 2.

        Args:
            stiffness: Of the spring [N/m].
            pretension: Tension of both at the length ``reference``; there 0.05 N.
            reference: Length of the TCA at mounting [m].
            mass: Mass of what joins the two [kg].
            damping: As of ``Load`` [N s/m].
        """
        return cls(
            force=pretension, stiffness=stiffness, reference=reference, mass=mass, damping=damping
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Heating(Checked):
    """What heats and cools TCAs during a step, scalars or arrays that broadcast with (..., n).

    Attributes:
        source: Which quantity is held: "power" [W], "voltage" [V] or "current" [A].
        value: Its value [W], [V] or [A]; a power is not negative.
        air: Factor on the heat transfer coefficient: 1 still air, above 1 blown air, above 0.
    """

    source: Source = "power"
    value: Annotated[float | Array, numbers] = 0.0
    air: Positives = 1.0

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        within("value", self.value, at_least=0.0 if self.source == "power" else -math.inf)

    def power(self, resistance: ArrayLike) -> Array:
        """Joule heat in given resistances, the broadcast shape [W]."""
        ohms = within("resistance", resistance, above=0.0, unit="ohm")
        if self.source == "voltage":
            return np.square(self.value) / ohms
        if self.source == "current":
            return np.square(self.value) * ohms
        return self.value + 0.0 * ohms


@dataclass(frozen=True, slots=True, eq=False)
class LoadState:
    """State of n loaded TCAs, each array of shape (..., n).

    Attributes:
        length: Length of the TCA [m].
        velocity: Its rate, negative while it contracts; 0 in quasi-static motion [m/s].
        temperature: Temperature [°C].
        power: Mean electrical power of the step that led here, 0 before the first [W].
    """

    length: Array
    velocity: Array
    temperature: Array
    power: Array


@dataclass(frozen=True, slots=True, eq=False)
class Course(LoadState):
    """States over time: fields of ``LoadState``, shape (k, ..., n).

    Attributes:
        time: When, shape (k,) [s].
    """

    time: Array

    @classmethod
    @door
    def of(cls, states: LoadState, dt: Positive) -> Course:
        """States ``dt`` apart, (k, ..., n)."""
        time = dt * np.arange(len(states.length), dtype=np.float64)
        return cls(states.length, states.velocity, states.temperature, states.power, time)

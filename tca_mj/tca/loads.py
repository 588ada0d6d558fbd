"""What hangs at TCAs, what heats them, and the states of their motion."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import floats

Array = NDArray[np.float64]
Source = Literal["power", "voltage", "current"]

GRAVITY = 9.81  # [m/s^2]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Load:
    """What hangs at TCAs, scalars or arrays that broadcast with (..., n).

    Attributes:
        force: Pull on the TCA at the length ``reference`` [N].
        stiffness: Growth of the pull per contraction, not negative [N/m].
        reference: Length of the TCA at which the pull is ``force`` [m].
        mass: Mass that moves with the end, not negative [kg].
        damping: Force per speed of the end, of the TCA and what it moves, not negative [N s/m].
    """

    force: float | Array
    stiffness: float | Array = 0.0
    reference: float | Array = 0.0
    mass: float | Array = 0.0
    damping: float | Array = 0.0

    def __post_init__(self) -> None:
        for name in ("force", "stiffness", "reference", "mass", "damping"):
            _require(name, getattr(self, name))

    @classmethod
    def weight(cls, mass: float | Array, damping: float | Array = 0.0) -> "Load":
        """A hanging mass [kg]."""
        _require("mass", mass)
        return cls(force=np.multiply(mass, GRAVITY), mass=mass, damping=damping)

    @classmethod
    def spring(
        cls,
        stiffness: float | Array,
        pretension: float | Array,
        reference: float | Array,
        mass: float | Array = 0.0,
        damping: float | Array = 0.0,
    ) -> "Load":
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
class Heating:
    """What heats and cools TCAs during a step, scalars or arrays that broadcast with (..., n).

    Attributes:
        source: Which quantity is held: "power" [W], "voltage" [V] or "current" [A].
        value: Its value; a power is not negative.
        air: Factor on the heat transfer coefficient: 1 still air, above 1 blown air, above 0.
    """

    source: Source = "power"
    value: float | Array = 0.0
    air: float | Array = 1.0

    def __post_init__(self) -> None:
        if self.source not in get_args(Source):
            raise ValueError(f"source = {self.source!r} must be one of {get_args(Source)}")
        if not np.isfinite(floats("value", self.value)).all():
            raise ValueError(f"value = {self.value} must be finite")
        if self.source == "power":
            _require("value (a heater cannot cool)", self.value)
        air = floats("air", self.air)
        if not np.all((air > 0.0) & np.isfinite(air)):
            raise ValueError(f"air = {self.air} must be finite and above 0")

    def power(self, resistance: ArrayLike) -> Array:
        """Joule heat in given resistances, the broadcast shape [W]."""
        ohms = floats("resistance", resistance)
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
class Course:
    """States over time: ``time`` of shape (k,), the others (k, ..., n), as in ``LoadState``."""

    time: Array
    length: Array
    velocity: Array
    temperature: Array
    power: Array


def step_times(dt: float, steps: int) -> Array:
    return dt * np.arange(steps + 1, dtype=np.float64)


def _require(name: str, value: float | Array) -> None:
    number = floats(name, value)
    if not np.all((number >= 0.0) & np.isfinite(number)):
        raise ValueError(f"{name} = {value} must be finite and not below 0")

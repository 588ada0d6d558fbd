"""n TCAs advanced together: heat in, temperature and pull out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.tca.arrays import floats
from tca_mj.tca.coilrod import CoilRods
from tca_mj.tca.coilsurface import CoilSurfaces
from tca_mj.tca.sensing import WireTable, resistance
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.thermal import HeatSpec, heat_lost, power_from_voltage, step_temperature

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class TcaState:
    """State of n TCAs, each array of shape (..., n).

    Attributes:
        temperature: Temperature [°C].
        energy_in: Electrical energy taken in since the state of rest [J].
        energy_lost: Heat given to the air since then [J].
    """

    temperature: Array
    energy_in: Array
    energy_lost: Array


@dataclass(frozen=True, slots=True, eq=False)
class Pull:
    """Affine tension law of n TCAs about a length, each array of shape (..., n).

    The law F(l) = tension + stiffness (l - length) is not clipped: it is negative where the coil
    would push. The tension that a body feels is max(0, F).

    Attributes:
        tension: Tension at ``length`` [N].
        stiffness: Slope dF/dl at constant temperature [N/m].
        length: Length about which the law is linear [m].
    """

    tension: Array
    stiffness: Array
    length: Array

    def at(self, length: ArrayLike) -> Array:
        """Tension F(l) of the affine law, not clipped, shape (..., n) [N]."""
        return self.tension + self.stiffness * (np.asarray(length) - self.length)


class TcaBank:
    """n TCAs of any specs. Holds constants only: the state goes in and comes out.

    Every element of a result depends on its own TCA's inputs alone: a batch (m, n) gives,
    bit for bit, what m calls with (n,) give.

    Attributes:
        specs: The n specs.
        n: Number of TCAs.
        law: What computes tension and stiffness.
        heat: Thermal constants, fields of shape (n,).
        rest_length: Natural lengths, shape (n,) [m].
        minimum_length: Lengths at which the coils touch, shape (n,) [m].
        shortest: Shortest length that ``pull`` accepts, shape (n,) [m].
        longest: Longest length that ``pull`` accepts, shape (n,) [m].
        breaking_force: Tensions at which the TCAs break, shape (n,) [N].
        max_temperature: Upper ends of the range of the fibre's measurements, shape (n,) [°C].
    """

    def __init__(self, specs: Sequence[TcaSpec], law: Literal["rod", "surface"] = "rod") -> None:
        """Gathers the constants of ``specs``, and their surfaces if ``law`` needs them.

        Args:
            specs: The TCAs, at least one.
            law: "rod" solves rod theory anew each time; "surface" reads it from a table with a
                known error (``surface.SurfaceBound``), made on first use: a third of the time.

        Raises:
            ValueError: If ``specs`` is empty or there is no such ``law``.
            CalibrationError: If no table follows the rod of a TCA closely enough.
        """
        self.specs = tuple(specs)
        self.n = len(self.specs)
        if self.n == 0:
            raise ValueError("specs is empty; a bank needs at least 1 TCA")
        if law not in ("rod", "surface"):
            raise ValueError(f"law = {law!r} must be 'rod' or 'surface'")
        self.law = law
        self._coils: CoilRods | CoilSurfaces
        self._coils = CoilSurfaces(self.specs) if law == "surface" else CoilRods(self.specs)
        self._wire = WireTable.of(self.specs)
        heats = [spec.heat for spec in self.specs]
        self.heat = HeatSpec(
            capacity=_frozen([heat.capacity for heat in heats]),
            loss=_frozen([heat.loss for heat in heats]),
            ambient=_frozen([heat.ambient for heat in heats]),
        )
        self.rest_length = _frozen([spec.rest_length for spec in self.specs])
        self.minimum_length = _frozen([spec.minimum_length for spec in self.specs])
        self.shortest, self.longest = self._coils.shortest, self._coils.longest
        self.breaking_force = _frozen([spec.breaking_force for spec in self.specs])
        self.max_temperature = _frozen([spec.fibre.temperature_range[1] for spec in self.specs])

    def rest(self, batch_shape: tuple[int, ...] = ()) -> TcaState:
        """The state at ambient temperature with no energy counted, shape batch_shape + (n,)."""
        shape = (*batch_shape, self.n)
        return TcaState(
            temperature=np.broadcast_to(self.heat.ambient, shape).copy(),
            energy_in=np.zeros(shape),
            energy_lost=np.zeros(shape),
        )

    def pull(self, state: TcaState, length: ArrayLike) -> Pull:
        """Tension law at the present temperature.

        Args:
            state: State, shape (..., n).
            length: Length of every TCA, same shape [m].

        Returns:
            The affine law about ``length``.

        Raises:
            ValueError: If shapes differ, a length is outside ``shortest`` to ``longest``, or the
                heat leaves no modulus.
            CoilSolveError: If the shape of a coil is not found.
        """
        length = self._checked(state, "length", length)
        tension, stiffness = self._coils.tension(length, state.temperature)
        return Pull(tension, stiffness, length)

    def advance(
        self, state: TcaState, power: ArrayLike, length: ArrayLike, dt: float
    ) -> tuple[TcaState, Pull]:
        """Heats by ``dt`` at constant power, exactly, then evaluates the pull.

        Args:
            state: State at the start, shape (..., n).
            power: Electrical power, same shape, not negative [W].
            length: Length of every TCA, same shape; the pull is about it [m].
            dt: Length of the step, not negative [s].

        Returns:
            The state at the end of the step and the pull at its temperature.

        Raises:
            ValueError: If shapes differ, a power or ``dt`` is negative or not finite, or as
                ``pull``.
            CoilSolveError: If the shape of a coil is not found.
        """
        power = self._checked(state, "power", power)
        state = TcaState(
            temperature=step_temperature(state.temperature, power, self.heat, dt),
            energy_in=state.energy_in + power * dt,
            energy_lost=state.energy_lost + heat_lost(state.temperature, power, self.heat, dt),
        )
        return state, self.pull(state, length)

    def resistance(self, state: TcaState, length: ArrayLike) -> Array:
        """Resistance at given lengths, shape (..., n) [ohm]; errors as ``sensing.resistance``."""
        return resistance(self._wire, self._checked(state, "length", length), state.temperature)

    def power_at(self, state: TcaState, length: ArrayLike, voltage: ArrayLike) -> Array:
        """Power that a voltage drives through the present resistances, shape (..., n) [W].

        Args:
            state: State, shape (..., n).
            length: Length of every TCA, same shape [m].
            voltage: Voltage of either sign, same shape [V].
        """
        voltage = self._checked(state, "voltage", voltage)
        return power_from_voltage(voltage, self.resistance(state, length))

    def energy_stored(self, state: TcaState) -> Array:
        """Heat stored above ambient, C (T - T_amb), shape (..., n) [J]."""
        return self.heat.capacity * (state.temperature - self.heat.ambient)

    def overheated(self, state: TcaState) -> NDArray[np.bool_]:
        """Whether a TCA is above ``max_temperature``, where the laws extrapolate, (..., n)."""
        return state.temperature > self.max_temperature

    def broken(self, pull: Pull) -> NDArray[np.bool_]:
        """Whether a tension is above ``breaking_force``, shape (..., n); nothing is clipped."""
        return pull.tension > self.breaking_force

    def _checked(self, state: TcaState, name: str, values: ArrayLike) -> Array:
        values = floats(name, values)
        shape = state.temperature.shape
        if not shape or shape[-1] != self.n:
            raise ValueError(f"state has shape {shape}; it must be (..., {self.n})")
        if values.shape != shape:
            raise ValueError(f"{name} has shape {values.shape}; it must equal the state's, {shape}")
        return values


def _frozen(values: Sequence[float | Array]) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array

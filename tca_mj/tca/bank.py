"""n TCAs advanced together: heat in, temperature and pull out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, door, every, floats, instance, shown, some, within
from tca_mj.tca.arrays import column, frozen
from tca_mj.tca.laws.creep import CreepBank, CreepSpec, CreepState
from tca_mj.tca.laws.law import LawChoice, TensionLaw
from tca_mj.tca.laws.plies import law_of
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.laws.surface import CoilSurfaces
from tca_mj.tca.sensing.wire import WireTable, resistance
from tca_mj.tca.spec import TcaSpec, heat_of
from tca_mj.tca.supply import UNITS, Supply
from tca_mj.tca.thermal import HeatStep, power_from_voltage

_LAWS: dict[str, Callable[[Sequence[TcaSpec]], TensionLaw]]
_LAWS = {"rod": CoilRods, "surface": CoilSurfaces}


class Signal(NamedTuple):
    """What actuators show of themselves.

    Attributes:
        unit: Unit, ``-`` for none.
        values: Numbers, shape (..., n) [``unit``].
    """

    unit: str
    values: Array


class TcaMelted(ArithmeticError):
    """A TCA would be hotter than the temperature at which its fibre melts.

    Attributes:
        number: Which one, an index of the actuator axis.
        temperature: How hot it would be [°C].
    """

    def __init__(self, number: int, temperature: float, melting: float) -> None:
        super().__init__(number, temperature, melting)
        self.number, self.temperature, self.melting = number, temperature, melting

    def __str__(self) -> str:
        return f"TCA {self.number} {self.why}"

    @property
    def why(self) -> str:
        """What happened to it, without its name."""
        return f"would have {self.temperature:.0f} °C: its fibre melts at {self.melting:.0f} °C"


@dataclass(frozen=True, slots=True, eq=False)
class TcaState:
    """State of n TCAs, each array of shape (..., n).

    Attributes:
        temperature: Temperature [°C].
        body: Temperature of the body that a TCA lies in; for a bare one that of the air [°C].
        energy_in: Electrical energy taken in since the state of rest [J].
        energy_lost: Heat given to the air since then, by TCA and body [J].
    """

    temperature: Array
    body: Array
    energy_in: Array
    energy_lost: Array


@dataclass(frozen=True, slots=True, eq=False)
class CreepingState(TcaState):
    """State of n TCAs that creep.

    Attributes:
        shift: What their natural lengths have grown by, shape (..., n) [m].
    """

    shift: Array


class Pull(NamedTuple):
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
        return self.tension + self.stiffness * (within("length", length) - self.length)


class TcaBank:
    """n TCAs of any specs. Holds constants only: the state goes in and comes out.

    Every element of a result depends on its own TCA's inputs alone: a batch (m, n) gives,
    bit for bit, what m calls with (n,) give.

    Attributes:
        specs: The n specs.
        n: Number of TCAs.
        law: What computes tension and stiffness.
        kind: What they are.
        heat: Thermal constants, fields of shape (n,).
        creep: Creep of the TCAs, or None.
        supply: What a command means; by default it is a power.
        rest_length: Natural lengths, shape (n,) [m].
        minimum_length: Lengths at which the coils touch, shape (n,) [m].
        shortest: Shortest length that ``pull`` accepts, shape (n,) [m].
        longest: Longest length that ``pull`` accepts, shape (n,) [m].
        breaking_force: Tensions at which the TCAs break, infinite where that is not known, shape
            (n,) [N].
        max_temperature: Upper ends of the range of the fibre's measurements, shape (n,) [°C].
        melting_temperature: Temperatures that no TCA can have, shape (n,) [°C].
        embedded: Which TCAs lie in a body, shape (n,).

    Example:
        >>> from tca_mj import CATALOGUE, TcaBank
        >>> bank = TcaBank([CATALOGUE["free-stroke"]] * 2)
        >>> state, pull = bank.advance(bank.rest(), [1.0, 0.0], 1.1 * bank.rest_length, 0.5)
        >>> state.temperature.round()
        array([42., 25.])
    """

    kind = "TCA"

    @door
    def __init__(
        self, specs: Sequence[TcaSpec], law: LawChoice = "rod", creep: CreepSpec | None = None
    ) -> None:
        """Gathers the constants of ``specs``, and their surfaces if ``law`` needs them.

        Args:
            specs: The TCAs, at least one.
            law: "rod" solves rod theory anew each time; "surface" reads it from a table with a
                known error (``surface.SurfaceBound``), made on first use: a third of the time.
                A law of one's own is what makes a ``TensionLaw`` of the specs.
            creep: Constants by which the natural lengths creep under tension and heat, and
                tensions relax; None for none. The rod takes the place of the surface then.

        Raises:
            ValueError: If ``specs`` is empty, there is no such ``law``, one of one's own or
                several strands are to creep, or as ``CreepBank``.
            CalibrationError: If no table follows the rod of a TCA closely enough.
        """
        self.specs = tuple(specs)
        self.n = len(self.specs)
        if not callable(law) and law not in _LAWS:
            raise ValueError(f"law must be 'rod' or 'surface', got {law!r}")
        if creep is not None:
            if callable(law) or any(spec.plies is not None for spec in self.specs):
                raise ValueError(
                    f"creep must be None with a law of one's own or plies, got {shown(creep)}"
                )
            law = "rod"
        self.law = law
        self.creep = None if creep is None else CreepBank(self.specs, creep)
        self._coils = law_of(self.specs, law=law if callable(law) else _LAWS[law])
        for name in ("shortest", "longest", "tension"):
            if not hasattr(self._coils, name):
                raise ValueError(f"law must make a TensionLaw with {name}, got {shown(law)}")
        self._wire = WireTable.of(self.specs)
        self.heat = heat_of(self.specs)
        self.supply = Supply()
        self._heating: HeatStep | None = None
        self.rest_length = column(self.specs, "rest_length")
        self.minimum_length = column(self.specs, "minimum_length")
        self.shortest, self.longest = self._coils.shortest, self._coils.longest
        self.breaking_force = column(self.specs, "breaking_tension")
        self.max_temperature = frozen([spec.fibre.temperature_range[1] for spec in self.specs])
        self.melting_temperature = frozen([s.fibre.melting_temperature for s in self.specs])
        self.embedded = np.array([spec.body is not None for spec in self.specs])

    @property
    def channels(self) -> dict[str, str]:
        """Unit of what each TCA is told, by name."""
        return {self.supply.quantity: UNITS[self.supply.quantity]}

    def checked(self, command: ArrayLike) -> Array:
        """Commands, shape (n,), in the unit of ``supply``; errors as ``Supply.checked``."""
        return self.supply.checked(command, self.n)

    def signals(self, state: TcaState, length: ArrayLike) -> dict[str, Signal]:
        """What TCAs show besides length and tension."""
        instance("state", state, TcaState)
        shown = {
            "temperature": Signal("°C", state.temperature),
            "body temperature": Signal("°C", state.body),
            "resistance": Signal("ohm", self.resistance(state, length, strict=False)),
        }
        return shown | ({} if self.creep is None else {"creep": Signal("m", _shift(state))})

    @door
    def rest(self, batch_shape: tuple[int, ...] = ()) -> TcaState:
        """The state at ambient temperature with no energy counted, shape batch_shape + (n,)."""
        shape = (*batch_shape, self.n)
        ambient = np.broadcast_to(self.heat.ambient, shape)
        values = ambient.copy(), ambient.copy(), np.zeros(shape), np.zeros(shape)
        if self.creep is None:
            return TcaState(*values)
        return CreepingState(*values, shift=np.zeros(shape))

    def steady(self, temperature: ArrayLike) -> tuple[TcaState, Array]:
        """TCAs that have been at ``temperature`` for long, and the power that keeps them there.

        Args:
            temperature: Temperatures, at least that of the surroundings, shape (..., n) [°C].

        Returns:
            The state, its bodies as warm as they get, with no energy counted; and the power,
            shape (..., n) [W].

        Raises:
            ValueError: If the shape is wrong or a temperature is below that of the surroundings.
        """
        temperature = np.array(within("temperature", temperature))
        if temperature.shape[-1:] != (self.n,):
            raise ValueError(
                f"temperature must have shape (..., {self.n}), got {temperature.shape}"
            )
        ambient = self.heat.ambient
        if not every(temperature >= ambient):
            raise ValueError(
                f"temperature must be at least that of the surroundings, {ambient} °C,"
                f" got {temperature}"
            )
        state = replace(
            self.rest(temperature.shape[:-1]),
            temperature=temperature, body=self.heat.steady_body(temperature),
        )  # fmt: skip
        return state, self.heat.steady_loss * (temperature - ambient)

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
        law = self._coils
        if self.creep is not None:
            assert isinstance(law, CoilRods)
            law = self.creep.law(law, _shift(state))
        return Pull(*law.tension(length, state.temperature), length)

    def advance(
        self, state: TcaState, command: ArrayLike, length: ArrayLike, dt: float
    ) -> tuple[TcaState, Pull]:
        """Heats by ``dt``, then evaluates the pull; arguments and errors as ``warmed``, ``pull``.

        Returns:
            The state at the end of the step and the pull at its temperature.
        """
        state = self.warmed(state, command, length, dt)
        return state, self.pull(state, length)

    def warmed(
        self, state: TcaState, command: ArrayLike, length: ArrayLike, dt: float
    ) -> TcaState:
        """Heats by ``dt`` at constant power, exactly.

        Args:
            state: State at the start, shape (..., n).
            command: What ``supply`` makes power of, same shape; a power, not negative [W].
            length: Length of every TCA, same shape [m].
            dt: Length of the step, not negative [s].

        Returns:
            The state at the end of the step.

        Raises:
            ValueError: If shapes differ, or a power or ``dt`` is negative or not finite.
            TcaMelted: If a TCA would be hotter than its ``melting_temperature``.
        """
        power = self.supply.power(
            self._checked(state, self.supply.quantity, command), state.temperature, state.body,
            lambda: self.resistance(state, length),
        )  # fmt: skip
        within("power", power, at_least=0.0, unit="W")
        step = self._heating
        if step is None or step.heat is not self.heat or type(dt) is not float or step.dt != dt:
            step = self._heating = HeatStep.of(self.heat, dt)
        temperature, body, lost = step.advance(state.temperature, state.body, power)
        molten = temperature > self.melting_temperature
        if some(molten):
            worst = tuple(int(i) for i in np.argwhere(molten)[0])
            melting = float(self.melting_temperature[worst[-1]])
            raise TcaMelted(worst[-1], float(temperature[worst]), melting)
        values = temperature, body, state.energy_in + power * dt, state.energy_lost + lost
        if self.creep is None:
            return TcaState(*values)
        # The tension of the start and the mean temperature, over a period much shorter than creep.
        shift, tension = CreepState(_shift(state)), self.pull(state, length).tension
        warm = 0.5 * (state.temperature + temperature)
        return CreepingState(*values, shift=self.creep.step(shift, tension, warm, dt).shift)

    def resistance(self, state: TcaState, length: ArrayLike, *, strict: bool = True) -> Array:
        """Resistance at given lengths, shape (..., n) [ohm]; as ``sensing.wire.resistance``."""
        length = self._checked(state, "length", length)
        return resistance(self._wire, length, state.temperature, strict=strict)

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
        """Heat stored above ambient in TCAs and their bodies, shape (..., n) [J]."""
        instance("state", state, TcaState)
        heat = self.heat
        own = heat.capacity * (state.temperature - heat.ambient)
        return own + heat.body_capacity * (state.body - heat.ambient)

    def overheated(self, state: TcaState) -> NDArray[np.bool_]:
        """Whether a TCA is above ``max_temperature``, where the laws extrapolate, (..., n)."""
        instance("state", state, TcaState)
        return state.temperature > self.max_temperature

    def broken(self, pull: Pull) -> NDArray[np.bool_]:
        """Whether a tension is above ``breaking_force``, shape (..., n); nothing is clipped."""
        instance("pull", pull, Pull)
        return pull.tension > self.breaking_force

    def _checked(self, state: TcaState, name: str, values: ArrayLike) -> Array:
        instance("state", state, TcaState)
        values = floats(name, values)
        shape = state.temperature.shape
        if not shape or shape[-1] != self.n:
            raise ValueError(f"state must have shape (..., {self.n}), got {shape}")
        if values.shape != shape:
            raise ValueError(f"{name} must have the state's shape {shape}, got {values.shape}")
        return values


def _shift(state: TcaState) -> Array:
    """What natural lengths have crept by [m].

    Raises:
        ValueError: If the state is of TCAs that do not creep.
    """
    instance("state", state, CreepingState)
    shift: Array = state.shift  # type: ignore[attr-defined]
    return shift

"""What pulls at a body: one contract for TCAs and for every other kind of muscle with a tendon.

A *muscle* is what is laid into chains: a specification with the attributes of ``Muscle``. A *bank*
computes n of one kind together, as ``TcaBank`` does: it holds constants only, state goes in and
comes out, any axes of simulations stand before the axis of muscles. A simulation whose muscles are
of several kinds, or of one that is not a TCA, has a ``MixedBank``: to all that walk over muscles
(the coupled step, batches, states, recordings, energy, damage) it is one bank.

Besides muscles a robot has groups that move no tendon: shape-memory spines, and the motors of its
MuJoCo model. ``Group`` is how tables, plots and recordings see all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, within
from tca_mj.tca import (
    CalibrationError,
    CreepSpec,
    HeatSpec,
    LawChoice,
    Pull,
    Supply,
    TcaBank,
    TcaSpec,
    aged,
)
from tca_mj.tca.bank import Signal as Signal

AMBIENT = 25.0  # temperature of what has none of its own [°C]


@dataclass(frozen=True, kw_only=True, slots=True)
class Group:
    """Actuators of one kind in a simulation.

    Attributes:
        kind: What they are.
        names: Their names.
        channels: Units of what each is told, by name.
        signals: What they show, by name, one number for each.
    """

    kind: str
    names: tuple[str, ...]
    channels: Mapping[str, str]
    signals: Mapping[str, Signal]


class Muscle(Protocol):
    """Specification of a muscle that can be laid into chains.

    Attributes:
        rest_length: Length that it has in the unloaded body [m].
        mass: Mass [kg].
        outer_radius: Radius, for pictures [m].
    """

    rest_length: float
    mass: float
    outer_radius: float

    def of_length(self, length: float) -> Self:
        """The same muscle, cut to a rest length [m]."""

    @classmethod
    def bank(cls, specs: Sequence[Any]) -> MuscleBank:
        """Several of them as a bank."""


class MuscleBank(Protocol):
    """n muscles of one kind.

    A state is a frozen dataclass of arrays of shape (..., n), with ``energy_in`` [J] among them; if
    there is a ``temperature`` [°C], colours and limits of temperature follow it. If the bank has
    ``heat``, a ``HeatSpec`` of arrays, variations of heat loss and surroundings act on it.

    Attributes:
        kind: What they are.
        channels: Units of what each is told, by name.
        rest_length: Natural lengths, shape (n,) [m].
        shortest, longest: Between which lengths they have a law, shape (n,) [m].
        breaking_force: Tensions at which they break, shape (n,) [N].
    """

    kind: str
    channels: Mapping[str, str]
    rest_length: Array
    shortest: Array
    longest: Array
    breaking_force: Array

    def rest(self, batch_shape: tuple[int, ...] = ()) -> Any:
        """The state at rest, with no energy counted."""

    def checked(self, command: ArrayLike) -> Array:
        """Commands, shape (n,); a ``ValueError`` if they cannot be."""

    def advance(
        self, state: Any, command: Array, length: Array, dt: float
    ) -> tuple[Any, Pull]:
        """State after ``dt`` [s] of a constant command, and the law there about ``length``."""

    def pull(self, state: Any, length: Array) -> Pull:
        """The law at a state, linear about ``length``."""

    def signals(self, state: Any, length: Array) -> Mapping[str, Signal]:
        """What they show besides length and tension."""


@dataclass(frozen=True, slots=True, eq=False)
class MixedState:
    """State of muscles of several kinds.

    Attributes:
        parts: State of each kind.
        temperature: Of each muscle, shape (..., n); 25 °C for what has none.
        body: Of what it lies in, same shape [°C].
        energy_in: Energy taken in since the state of rest, same shape [J].
    """

    parts: tuple[Any, ...]
    temperature: Array
    body: Array
    energy_in: Array


class MixedBank:
    """n muscles of several kinds; see ``TcaBank``, whose place it takes, for what is not said.

    Attributes:
        specs: The n specifications.
        kinds: Bank of each kind, and the places of its muscles on the axis of all.
    """

    kind = "muscles"

    def __init__(
        self, specs: Sequence[Any], kinds: Sequence[tuple[NDArray[np.int64], Any]]
    ) -> None:
        self.specs, self.n = tuple(specs), len(specs)
        self.kinds = tuple(kinds)
        self.law = tuple(getattr(bank, "law", bank.kind) for _, bank in kinds)
        for name in ("rest_length", "shortest", "longest", "breaking_force"):
            setattr(self, name, self._joined([getattr(bank, name) for _, bank in kinds], np.nan))
        self.embedded = self._constant("embedded", 0.0) > 0.0
        self.max_temperature = self._constant("max_temperature", np.inf)

    rest_length: Array
    shortest: Array
    longest: Array
    breaking_force: Array

    def __copy__(self) -> MixedBank:
        """A bank whose heat and supply can be changed alone."""
        return MixedBank(self.specs, [(places, copy(bank)) for places, bank in self.kinds])

    def _joined(self, parts: Sequence[Any], missing: float) -> Array:
        """One array of the numbers of each kind, shape (..., n); None is ``missing``."""
        given = [np.asarray(part) for part in parts if part is not None]
        shape = np.broadcast_shapes(*(part.shape[:-1] for part in given)) if given else ()
        joined = np.full((*shape, self.n), missing)
        for (places, _), part in zip(self.kinds, parts, strict=True):
            if part is not None:
                joined[..., places] = part
        return joined

    def _constant(self, name: str, missing: float) -> Array:
        return self._joined([getattr(bank, name, None) for _, bank in self.kinds], missing)

    def _state(self, parts: Sequence[Any]) -> MixedState:
        def joined(name: str, missing: float) -> Array:
            every = [getattr(part, name, None) for part in parts]
            shape = np.shape(parts[0].energy_in)[:-1]
            filled = np.broadcast_to(missing, (*shape, self.n)).copy()
            for (places, _), part in zip(self.kinds, every, strict=True):
                if part is not None:
                    filled[..., places] = part
            return filled

        return MixedState(
            parts=tuple(parts), temperature=joined("temperature", AMBIENT),
            body=joined("body", AMBIENT), energy_in=joined("energy_in", 0.0),
        )  # fmt: skip

    def _pulls(self, pulls: Sequence[Pull]) -> Pull:
        names = ("tension", "stiffness", "length")
        return Pull(*(self._joined([getattr(p, name) for p in pulls], np.nan) for name in names))

    @property
    def heat(self) -> HeatSpec:
        """Thermal constants, fields of shape (..., n); without meaning where there are none."""
        found = [getattr(bank, "heat", None) for _, bank in self.kinds]
        usual = HeatSpec(capacity=1.0, loss=1.0, ambient=AMBIENT)
        return HeatSpec(
            **{
                field.name: self._joined(
                    [
                        None if heat is None else _wide(getattr(heat, field.name), places.size)
                        for heat, (places, _) in zip(found, self.kinds, strict=True)
                    ],
                    getattr(usual, field.name),
                )
                for field in fields(HeatSpec)
            }
        )

    @heat.setter
    def heat(self, heat: HeatSpec) -> None:
        for places, bank in self.kinds:
            if hasattr(bank, "heat"):
                bank.heat = _picked(heat, places)

    @property
    def supply(self) -> Supply:
        """What the commands of its TCAs mean."""
        return next((b.supply for _, b in self.kinds if isinstance(b, TcaBank)), Supply())

    @supply.setter
    def supply(self, supply: Supply) -> None:
        for places, bank in self.kinds:
            if isinstance(bank, TcaBank):
                bank.supply = _picked(supply, places)

    def checked(self, command: ArrayLike) -> Array:
        """As each kind's."""
        array = within("command", command, shape=(self.n,))
        return self._joined([bank.checked(array[places]) for places, bank in self.kinds], np.nan)

    def rest(self, batch_shape: tuple[int, ...] = ()) -> MixedState:
        """The state at rest."""
        return self._state([bank.rest(batch_shape) for _, bank in self.kinds])

    def advance(
        self, state: MixedState, command: Array, length: Array, dt: float
    ) -> tuple[MixedState, Pull]:
        """As each kind's."""
        done = [
            bank.advance(part, command[..., places], length[..., places], dt)
            for (places, bank), part in zip(self.kinds, state.parts, strict=True)
        ]
        return self._state([part for part, _ in done]), self._pulls([pull for _, pull in done])

    def warmed(self, state: MixedState, command: Array, length: Array, dt: float) -> MixedState:
        """The state that ``advance`` leads to."""
        return self.advance(state, command, length, dt)[0]

    def pull(self, state: MixedState, length: Array) -> Pull:
        """As each kind's."""
        return self._pulls(
            [
                bank.pull(part, length[..., places])
                for (places, bank), part in zip(self.kinds, state.parts, strict=True)
            ]
        )

    def resistance(self, state: MixedState, length: Array, *, strict: bool = True) -> Array:
        """Resistance of the TCAs, not a number for other kinds, shape (..., n) [ohm]."""
        found = [
            bank.resistance(part, length[..., places], strict=strict)
            if isinstance(bank, TcaBank) else None
            for (places, bank), part in zip(self.kinds, state.parts, strict=True)
        ]  # fmt: skip
        return self._joined(found, np.nan)

    def overheated(self, state: MixedState) -> NDArray[np.bool_]:
        """Whether a muscle is above its ``max_temperature``, shape (..., n)."""
        hot: NDArray[np.bool_] = state.temperature > self.max_temperature
        return hot


def muscle_group(
    bank: Any, state: Any, kind: str, length: Array, tension: Array, names: Sequence[str]
) -> Group:
    """The muscles of one kind in a bank, with what they show, length and tension among it."""
    kinds = getattr(bank, "kinds", ((np.arange(bank.n), bank),))
    parts = getattr(state, "parts", (state,))
    places, own, part = next(
        (places, own, part)
        for (places, own), part in zip(kinds, parts, strict=True) if own.kind == kind
    )  # fmt: skip
    signals = {
        "length": Signal("m", length[places]), "tension": Signal("N", tension[places]),
        "energy": Signal("J", part.energy_in), **own.signals(part, length[places]),
    }  # fmt: skip
    return Group(
        kind=kind, names=tuple(names[i] for i in places), channels=own.channels, signals=signals
    )


def _wide(values: Any, n: int) -> Array:
    array = np.asarray(values, dtype=np.float64)
    return array if array.ndim else np.full(n, array)


def _picked(value: Any, places: NDArray[np.int64]) -> Any:
    """A dataclass of arrays for some of the muscles."""
    if is_dataclass(value) and not isinstance(value, type):
        picked = {f.name: _picked(getattr(value, f.name), places) for f in fields(value)}
        return replace(value, **picked)
    return value[..., places] if isinstance(value, np.ndarray) and value.ndim else value


def bank_of(
    specs: Sequence[Any], law: LawChoice, ambient: float, creep: CreepSpec | None, cycles: float
) -> Any:
    """The bank of all muscles."""
    kinds: dict[type, list[int]] = {}
    for place, spec in enumerate(specs):
        kinds.setdefault(type(spec), []).append(place)
    banks = []
    for kind, places in kinds.items():
        own = [specs[i] for i in places]
        if kind is TcaSpec:
            banks.append((np.array(places), _tca_bank(own, law, ambient, creep, cycles)))
        else:
            banks.append((np.array(places), kind.bank(own)))  # type: ignore[attr-defined]
    if len(banks) == 1 and isinstance(banks[0][1], TcaBank):
        return banks[0][1]
    return MixedBank(specs, banks)


def _tca_bank(
    specs: Sequence[TcaSpec], law: LawChoice, ambient: float, creep: CreepSpec | None, cycles: float
) -> TcaBank:
    surrounded = tuple(replace(spec, ambient=ambient) for spec in specs)
    if cycles > 0.0:
        surrounded = tuple(aged(spec, cycles, creep or CreepSpec()) for spec in surrounded)
    try:
        return TcaBank(surrounded, law, creep)
    except CalibrationError:
        return TcaBank(surrounded, "rod", creep)

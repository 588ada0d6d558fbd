"""What a TCA with given constants would have shown in a set of measurements, and with what error.

Which quantity of a file is an outcome and which is given:

    in the file                          outcome                       given
    force                                force                         length, temperature
    length, no force                     length                        load (0 if none), temperature
    resistance and length alone          resistance                    length
    resistance besides                   resistance                    the length of the model
    time and power, voltage or current   temperature, length, force,   time, what drives, load or
                                         resistance                    length

``displacement`` is contraction and ``stretch`` extension, from the length that a line ``# length
[mm]: 45`` says; without it an outcome's start is one more unknown, and a given one's is the natural
length. Rows at rest are in equilibrium. A course starts at the temperature of the surroundings,
what drives is held from each row to the next (a voltage or current of pulses, for the share of the
time that ``duty`` says), the heat is exact and the length in equilibrium with
it, as in the quasi-static motion of ``LoadedTcas``.

What is given has errors, too: see ``latent``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from tca_mj.checks import Array, number, require_one_of, within
from tca_mj.tca.identify.data import DRIVES, UNITS, Data
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.laws.statics import hanging_length, tension
from tca_mj.tca.sensing.wire import WireTable, resistance
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.thermal import HeatStep

Law = Literal["rod", "love", "cst", "linear"]

LENGTHS = ("length", "displacement", "stretch")
HEAT = ("specific_heat", "heat_loss", "ambient", "body_conductance", "body_capacity", "body_loss",
        "line_density")  # fmt: skip
ELECTRIC = ("resistance_per_length", "stretch_resistance", "contraction_resistance")
_GRID = 128  # temperatures at which the resistance of a course is tabled
_NARROW = 10.0  # range of temperatures below which no table is tried [K]
_LOADS = 20  # different loads of one course


class Muscle(NamedTuple):
    """A TCA by a law; ``linear`` are the constants of the linear one."""

    tca: TcaSpec
    law: Law
    linear: Mapping[str, float]

    def hang(self, temperature: Array, load: Array, ends: Spin) -> Array:
        """Length under a load [m]."""
        if self.law != "linear":
            return hanging_length(self.tca, temperature, load, model=self.law, spin=ends)
        c = self.linear
        length = c["linear_length"] + load / c["linear_stiffness"] - self._contraction(temperature)
        return np.maximum(length, c["linear_shortest"])

    def pull(self, length: Array, temperature: Array, ends: Spin) -> Array:
        """Force at a length, none where it is slack [N]."""
        if self.law != "linear":
            force, _ = tension(self.tca, length, temperature, model=self.law, spin=ends)
        else:
            c = self.linear
            stretch = length - c["linear_length"] + self._contraction(temperature)
            force = c["linear_stiffness"] * stretch
        return np.maximum(force, 0.0)

    def _contraction(self, temperature: Array) -> Array:
        x = temperature - self.tca.fibre.reference_temperature
        c50, c100 = (self.linear[f"linear_contraction_{at}"] for at in (50, 100))
        return x * ((4.0 * c50 - c100) / 100.0 + x * (c100 - 2.0 * c50) / 5000.0)

    def ohms(self, length: Array) -> Array:
        """Resistance at a length [ohm]."""
        row = length[..., None]
        return resistance(WireTable.of([self.tca]), row, np.zeros_like(row))[..., 0]


def length_name(data: Data) -> str:
    """The quantity that says the length, empty if none is a column."""
    return next((name for name in LENGTHS if name in data.columns), "")


def length_is_given(data: Data) -> bool:
    """Whether the length is given and not an outcome."""
    alone = "resistance" in data.columns and data.given("load") is None and not data.stepped
    held = not length_name(data) and "length" in data.fixed
    return "force" in data.columns or alone or held


def outcomes(data: Data) -> tuple[str, ...]:
    """The quantities of a set that are predicted."""
    found = ["temperature"] if data.stepped else []
    found += [] if length_is_given(data) else [length_name(data)]
    return tuple(name for name in (*found, "force", "resistance") if name in data.columns)


def given_with_error(data: Data) -> tuple[str, ...]:
    """The quantities that are given, differ from row to row, and have errors."""
    found = [] if data.stepped else ["temperature", "load"]
    found += [length_name(data)] if length_is_given(data) else []
    return tuple(n for n in found if n in data.columns and np.ptp(data.columns[n]) > 0.0)


def has_zero(data: Data) -> bool:
    """Whether the length from which an outcome is counted is unknown."""
    name = length_name(data)
    return name in ("displacement", "stretch") and name in outcomes(data) and (
        "length" not in data.fixed
    )


def affects(name: str, data: Data) -> bool:
    """Whether a constant has to do with a set of measurements."""
    found, by_power = set(outcomes(data)), _power(data) is not None
    electric = "resistance" in found or (data.stepped and not by_power)
    if name in HEAT:
        return data.stepped
    if name in ELECTRIC:
        return electric
    if name in ("rest_length", "fibre_length"):
        return True
    return bool(found & {*LENGTHS, "force"}) or (electric and not length_is_given(data))


def assumed(data: Data, tca: TcaSpec) -> Data:
    """The set with a note on everything that it does not say and that is assumed.

    Raises:
        ValueError: If nothing can be predicted, or what is given is missing or no number.
    """
    for quantity, values in data.columns.items():
        require_one_of("quantity", quantity, tuple(UNITS))
        within(quantity, values, shape=(data.rows,))
    for quantity, value in data.fixed.items():
        require_one_of("quantity", quantity, tuple(UNITS))
        number(quantity, value)
    held, name = length_is_given(data), length_name(data)
    if not outcomes(data):
        raise ValueError(
            f"{data.name} must have what the TCA does (length, force, resistance, or temperature"
            f" in a course under a voltage, current or power), got columns {list(data.columns)}"
        )
    if held and not name and "length" not in data.fixed:
        raise ValueError(f"{data.name} must say the length of the TCA, a column or '# length [mm]:"
                         f" 45', got columns {list(data.columns)}")  # fmt: skip
    if held and name in ("displacement", "stretch") and "length" not in data.fixed:
        data = data.noted(f"{name} is counted from the natural length")
    mechanical = set(outcomes(data)) & {*LENGTHS, "force"}
    if mechanical and not held and data.given("load") is None:
        data = data.noted("no load is said: nothing hangs at the TCA")
    if mechanical and not data.stepped and data.given("temperature") is None:
        cold = tca.fibre.reference_temperature
        data = data.noted(f"no temperature is said: the TCA is cold, {cold:g} degC")
    if data.stepped and len(np.unique(_load(data))) > _LOADS:
        raise ValueError(f"{data.name} must have at most {_LOADS} different loads, got more")
    return data


def noise_of(data: Data, stated: Mapping[str, float]) -> dict[str, float]:
    """Standard deviation of what was measured, by quantity: as stated, or 0.5 K and 1 % of full
    scale, the largest value; a load is exact.

    Raises:
        ValueError: If that of an outcome is 0, as of a column of zeros.
    """
    found = {}
    for name in (*outcomes(data), *given_with_error(data)):
        usual = 0.01 * float(np.abs(data.columns[name]).max())
        usual = {"temperature": 0.5, "load": 0.0}.get(name, usual)
        least = {"above": 0.0} if name in outcomes(data) else {"at_least": 0.0}
        found[name] = number(f"noise of {name} in {data.name}", stated.get(name, usual), **least)
    return found


def predict(data: Data, muscle: Muscle, ends: Spin, zero: float = 0.0) -> Array:
    """The outcomes of a set, shape (k, number of them).

    Args:
        data: The measurements.
        muscle: The TCA.
        ends: Whether an end may spin.
        zero: Length from which an outcome is counted, if that is unknown [m].

    Raises:
        ValueError: If the laws have no answer.
        CoilSolveError: As ``hanging_length``.
    """
    tca, found = muscle.tca, outcomes(data)
    if data.stepped:
        temperature = _course(data, muscle, ends)
        acting = np.minimum(temperature, tca.fibre.melting_temperature - 1.0)  # of trials
    else:
        cold = tca.fibre.reference_temperature
        said = data.given("temperature")
        temperature = np.broadcast_to(np.asarray(cold if said is None else said), data.rows)
        acting = temperature
    result = {"temperature": temperature}
    if length_is_given(data):
        length = np.broadcast_to(_given_length(data, tca), data.rows)
    elif set(found) - {"temperature"}:
        length = muscle.hang(acting, _load(data), ends)
        start = data.fixed.get("length", zero)
        result |= {"length": length, "displacement": start - length, "stretch": length - start}
    if "force" in found:
        result["force"] = muscle.pull(length, acting, ends)
    if "resistance" in found:
        result["resistance"] = muscle.ohms(length)
    return np.stack([result[name] for name in found], axis=-1)


def _given_length(data: Data, tca: TcaSpec) -> Array:
    name = length_name(data)
    start = data.fixed.get("length", tca.rest_length)
    if not name:
        return np.asarray(start)
    column = data.columns[name]
    return {"length": column, "displacement": start - column, "stretch": start + column}[name]


def _power(data: Data) -> Array | None:
    """The power, if that does not depend on the TCA's resistance."""
    if "power" in data.columns:
        return data.columns["power"]
    if "voltage" in data.columns and "current" in data.columns:
        return duty(data) * np.abs(data.columns["voltage"] * data.columns["current"])
    return None


def duty(data: Data) -> Array:
    """Share of the time that voltage and current, which are those of pulses, are on, (k,) [1]."""
    return data.columns.get("duty", np.ones(data.rows))


def _load(data: Data) -> Array:
    load = data.given("load")
    return np.broadcast_to(np.asarray(0.0 if load is None else load), data.rows)


def _course(data: Data, muscle: Muscle, ends: Spin) -> Array:
    """Temperatures over time [°C]."""
    if "ambient" in data.fixed:
        muscle = muscle._replace(tca=replace(muscle.tca, ambient=data.fixed["ambient"]))
    ambient, power = muscle.tca.ambient, _power(data)
    kinds, which = np.unique(np.round(np.diff(data.columns["time"]), 12), return_inverse=True)
    heat = [HeatStep.of(muscle.tca.heat, float(kind)) for kind in kinds]
    constants = [
        tuple(map(float, (s.own, s.taken, s.warmed, s.body_own, s.given, s.body_warmed)))
        for s in heat
    ]
    drive = next(n for n in DRIVES if n in data.columns)
    on = duty(data) * np.square(data.columns[drive])
    driven = (on if power is None else power).tolist()
    ohms = _ohms(data, muscle, ends) if power is None else None

    x, y, found = 0.0, 0.0, [0.0]  # excess of the TCA and of its body over the surroundings
    for i, kind in enumerate(which.tolist()):
        own, taken, warmed, body_own, given, body_warmed = constants[kind]
        watts = driven[i]
        if ohms is not None:  # the power at the middle of the step
            first = ohms(i, ambient + x)
            watts = driven[i] / first if drive == "voltage" else driven[i] * first
            middle = ohms(i, ambient + x + 0.5 * (own * x + taken * y + warmed * watts))
            watts = driven[i] / middle if drive == "voltage" else driven[i] * middle
        x, y = (x + own * x + taken * y + warmed * watts,
                y + body_own * y + given * x + body_warmed * watts)  # fmt: skip
        found.append(x)
    return ambient + np.array(found)


def _ohms(data: Data, muscle: Muscle, ends: Spin) -> Callable[[int, float], float]:
    """Resistance in a row of a course at a temperature, from a table under each load.

    Where the laws end below the hottest temperature of the table, it ends there.
    """
    if length_is_given(data):
        held = muscle.ohms(np.broadcast_to(_given_length(data, muscle.tca), data.rows)).tolist()
        return lambda i, temperature: held[i]
    loads, which = np.unique(_load(data), return_inverse=True)
    row_of = which.tolist()
    low, high = muscle.tca.ambient, muscle.tca.fibre.melting_temperature - 1.0
    while True:
        grid = np.linspace(low, high, _GRID)
        try:
            under = [muscle.ohms(muscle.hang(grid, np.full(_GRID, load), ends)) for load in loads]
            break
        except (ValueError, ArithmeticError):
            if high - low < _NARROW:
                raise
            high = low + 0.8 * (high - low)
    rows, per = [each.tolist() for each in under], (_GRID - 1) / (high - low)

    def ohms(i: int, temperature: float) -> float:
        place = min(max((temperature - low) * per, 0.0), _GRID - 1.001)
        cell, row = int(place), rows[row_of[i]]
        return float(row[cell] + (place - cell) * (row[cell + 1] - row[cell]))

    return ohms

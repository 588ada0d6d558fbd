"""Measurements of a TCA as they lie in CSV files: read, converted to SI, mended or refused.

The first row says what the columns are, with units: ``time [s], voltage [V], temperature [degC],
length [mm]``. Lines that begin with # and say ``# load [g]: 30`` hold for every row, and ``# ends:
free`` says whether an end may spin. Everything that is not as it stands in the file is a note that
names file, row (as an editor counts them) and column.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args

import numpy as np

from tca_mj.checks import Array, door, require_one_of, shown
from tca_mj.files import write_whole
from tca_mj.hints import nearest
from tca_mj.tca.arrays import frozen
from tca_mj.tca.dynamics.loads import GRAVITY
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.spec import TcaSpec

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
_FORCES = {"N": 1.0, "mN": 1e-3, "g": 1e-3 * GRAVITY, "gf": 1e-3 * GRAVITY, "kg": GRAVITY}
_CELSIUS = dict.fromkeys(("degC", "°C", "C", "deg C"), 1.0)
_KELVIN = 273.15
# Factors to SI of the units that are understood, and by them the quantities.
UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType({
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
    "power": {"W": 1.0, "mW": 1e-3},
    "duty": {"1": 1.0, "%": 0.01},
    "temperature": _CELSIUS | {"K": 1.0},
    "ambient": _CELSIUS | {"K": 1.0},
    "length": _LENGTHS,
    "displacement": _LENGTHS,
    "stretch": _LENGTHS,
    "force": _FORCES,
    "load": _FORCES,
    "resistance": {"ohm": 1.0, "Ohm": 1.0, "Ω": 1.0, "mohm": 1e-3, "kohm": 1e3},
})  # fmt: skip
DRIVES = ("power", "voltage", "current")
SHOWN = {"time": "s", "voltage": "V", "current": "A", "power": "W", "duty": "1",
         "temperature": "degC",
         "ambient": "degC", "length": "m", "displacement": "m", "stretch": "m", "force": "N",
         "load": "N", "resistance": "ohm"}  # fmt: skip
"""Unit in which each quantity is kept."""

_HEAD = re.compile(r"\s*([^\[(]*?)\s*[\[(]\s*(.*?)\s*[\])]\s*")
_LINE = re.compile(r"#\s*([^:=]+?)\s*[:=]\s*(.*)")
_STRESS = 5e8  # shear in a fibre that no polymer bears, an estimate [Pa]
_FREEZING = 4.0  # [°C]
_LEFT_OUT = 0.1  # share of rows beyond what can be, up to which they are left out
_GAP = 5.0  # times the median step
_MOST = 100_000  # rows of one file
_LARGEST = 2**25  # bytes of one file


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Data:
    """One set of measurements, in SI units and degrees Celsius.

    Attributes:
        name: Of the file.
        columns: Values of each quantity, shape (k,).
        fixed: Quantities that have one value for all rows.
        ends: Whether an end may spin; None if that is not known.
        notes: What was mended or assumed.
    """

    name: str
    columns: Mapping[str, Array]
    fixed: Mapping[str, float]
    ends: Spin | None = None
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows k."""
        return len(next(iter(self.columns.values())))

    @property
    def stepped(self) -> bool:
        """Whether this is a course over time under a voltage, current or power."""
        return "time" in self.columns and any(name in self.columns for name in DRIVES)

    @door
    def given(self, name: str) -> Any:
        """A quantity, column or fixed; None if it is neither."""
        return self.columns.get(name, self.fixed.get(name))

    @door
    def noted(self, note: str) -> Data:
        """The same with one more note."""
        return replace(self, notes=(*self.notes, f"{self.name}: {note}"))


@door
def read_data(path: str | Path, tca: TcaSpec) -> Data:
    """Reads one set of measurements.

    Separators are commas, semicolons or tabs; with the last two a decimal comma is understood.

    Args:
        path: The CSV file.
        tca: The TCA as far as it is known: numbers that are impossible for it are refused, with
            the unit or the column that was probably meant.

    Raises:
        ValueError: If there is no header with units, nothing that can be fitted, a unit or end
            condition is unknown, or more than a tenth of a column's numbers are impossible.
        OSError: If it cannot be read.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            text = file.read(_LARGEST).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path.name} must be text in UTF-8, got {error}") from error
    lines = text.splitlines()
    fixed, ends, notes = _lines_above(path.name, lines)
    table = [(i, line) for i, line in enumerate(lines, 1)
             if line.strip() and not line.lstrip().startswith("#")]  # fmt: skip
    if len(table) < 2 or len(table) > _MOST:
        raise ValueError(f"{path.name} must have a header and 1 to {_MOST} rows below it, got"
                         f" {len(table)} lines")  # fmt: skip
    separator = max(";\t,", key=table[0][1].count)
    try:
        cells = list(csv.reader([line for _, line in table], delimiter=separator))
    except csv.Error as error:
        raise ValueError(f"{path.name} must be a table of numbers, got {error}") from error
    heads = [_head(f"{path.name}, row {table[0][0]}", cell, notes) for cell in cells[0]]
    names = [name for name, _ in heads if name]
    if len(set(names)) < len(names):
        raise ValueError(f"{path.name} must have every quantity once, got columns {names}")
    numbers, rows = _numbers(path.name, cells, heads, [i for i, _ in table], separator, notes)
    data = Data(
        name=path.name, columns=dict(zip(names, numbers.T, strict=True)), fixed=fixed, ends=ends,
        notes=tuple(notes),
    )  # fmt: skip
    data = _in_order(_possible(data, rows, tca, dict(heads)))
    if data.rows < 3:
        raise ValueError(f"{path.name} must have at least 3 good rows, got {data.rows}")
    return replace(data, columns={name: frozen(each) for name, each in data.columns.items()})


@door
def write_data(data: Data, path: str | Path) -> Path:
    """Writes measurements as ``read_data`` reads them, every digit kept.

    Args:
        data: The measurements.
        path: The file.

    Returns:
        The path.

    Raises:
        OSError: If it cannot be written.
    """
    said = [f"# {name} [{SHOWN[name]}]: {value!r}" for name, value in data.fixed.items()]
    said += [f"# ends: {data.ends}"] if data.ends else []
    said.append(",".join(f"{name} [{SHOWN[name]}]" for name in data.columns))
    rows = zip(*(each.tolist() for each in data.columns.values()), strict=True)
    said += [",".join(map(repr, row)) for row in rows]
    return write_whole(Path(path), ("\n".join(said) + "\n").encode())


def _lines_above(
    file: str, lines: list[str]
) -> tuple[dict[str, float], Spin | None, list[str]]:
    """What the lines with # say."""
    fixed: dict[str, float] = {}
    ends: Spin | None = None
    notes: list[str] = []
    for i, line in enumerate(lines, 1):
        found = _LINE.fullmatch(line.strip())
        if not found:
            continue
        where, (head, value) = f"{file}, row {i}", found.groups()
        if head.strip().lower() == "ends":
            ends = require_one_of(f"{where}: ends", value.strip(), get_args(Spin))
        elif _HEAD.fullmatch(head):
            name, unit = _head(where, head, notes)
            number = _number(value, comma=False)
            if not math.isfinite(number):
                raise ValueError(f"{where}: {name} must be a number, got {shown(value)}")
            if name:
                fixed[name] = _converted(name, unit, number)
    return fixed, ends, notes


def _head(where: str, cell: str, notes: list[str]) -> tuple[str, str]:
    """Quantity and unit of a column; an empty quantity if it is not used."""
    found = _HEAD.fullmatch(cell)
    if not found:
        raise ValueError(
            f"{where} must be a header with units, as 'time [s], temperature [degC], length [mm]',"
            f" got {shown(cell)}"
        )
    name, unit = found[1].strip().lower(), found[2]
    if name not in UNITS:
        notes.append(f"{where}: column {shown(cell)} is not used{nearest(name, UNITS)}")
        return "", unit
    require_one_of(f"{where}: unit of {name}", unit, tuple(UNITS[name]))
    if unit not in (SHOWN[name], *_CELSIUS, "Ohm", "Ω"):
        notes.append(f"{where}: {name} is converted from {unit} to {SHOWN[name]}")
    return name, unit


def _converted(name: str, unit: str, values: Any) -> Any:
    return values * UNITS[name][unit] - (_KELVIN if unit == "K" else 0.0)


def _number(cell: str, *, comma: bool) -> float:
    """A cell's number, NaN if it is none."""
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return math.nan


def _numbers(
    file: str, cells: list[list[str]], heads: list[tuple[str, str]], lines: list[int],
    separator: str, notes: list[str],
) -> tuple[Array, Array]:  # fmt: skip
    """Values of the used columns in SI, shape (k, c), and the lines that they stand in."""
    used = [j for j, (name, _) in enumerate(heads) if name]
    kept, rows, bad = [], [], []
    for i, row in zip(lines[1:], cells[1:], strict=True):
        row = row + [""] * (len(heads) - len(row))
        values = [_number(row[j], comma=separator != ",") for j in used]
        wrong = [j for j, value in zip(used, values, strict=True) if not abs(value) < 1e30]
        if wrong or len(row) > len(heads):
            j = wrong[0] if wrong else len(heads)
            what = shown(cells[0][j]) if wrong else f"{j + 1}, which has no header"
            bad.append(f"{file}, row {i}, column {what}: {shown(row[j])} is no number")
        else:
            kept.append(values)
            rows.append(i)
    if not kept or len(bad) > 0.5 * len(lines):
        raise ValueError(f"{file} must have numbers in at least half of its rows, got {bad[:3]}")
    notes += [f"{each}: row left out" for each in bad[:5]]
    if len(bad) > 5:
        notes.append(f"{file}: {len(bad) - 5} more rows without a number left out")
    array = np.array(kept).reshape(len(kept), len(used))
    for column, j in enumerate(used):
        array[:, column] = _converted(*heads[j], array[:, column])
    return array, np.array(rows)


def _bounds(tca: TcaSpec) -> dict[str, tuple[float, float]]:
    """What is possible for a TCA; half and twice the lengths, which may not be known well."""
    fibre = tca.fibre
    longest, shortest = tca.fibre_length, 0.25 * tca.minimum_length
    strongest = _STRESS * math.pi * fibre.radius**3 / (2.0 * tca.coil_radius)
    hottest = fibre.melting_temperature
    ohms = tca.resistance_per_length * tca.rest_length
    return {
        "time": (-1e7, 1e7), "voltage": (-200.0, 200.0), "current": (-20.0, 20.0),
        "power": (0.0, 1e3), "duty": (0.0, 1.0), "temperature": (-60.0, hottest),
        "ambient": (-60.0, 100.0),
        "length": (shortest, longest), "displacement": (-longest, longest),
        "stretch": (-longest, longest), "force": (-0.1 * strongest, strongest),
        "load": (0.0, strongest), "resistance": (1e-3 * ohms, 1e3 * ohms),
    }  # fmt: skip


def _possible(data: Data, rows: Array, tca: TcaSpec, units: Mapping[str, str]) -> Data:
    """Leaves out single rows with what cannot be; refuses columns of it."""
    bounds, good = _bounds(tca), np.ones(data.rows, dtype=bool)
    every: dict[str, Any] = {**data.fixed, **data.columns}
    for name, values in every.items():
        low, high = bounds[name]
        inside = np.atleast_1d((values >= low) & (values <= high))
        if np.mean(~inside) > _LEFT_OUT:
            seen = np.atleast_1d(values)[~inside]
            raise ValueError(
                f"{data.name}: {name} must be {low:.4g} to {high:.4g} {SHOWN[name]} for this TCA,"
                f" got {seen[0]:.6g}{_meant(data, name, bounds, units)}"
            )
        if not inside.all():
            good &= inside
            first = int(rows[~inside][0])
            data = data.noted(
                f"row {first}, column {name}: {values[~inside][0]:.6g} {SHOWN[name]} cannot be;"
                f" {int((~inside).sum())} such row(s) left out"
            )
    return replace(data, columns={name: each[good] for name, each in data.columns.items()})


def _meant(
    data: Data, name: str, bounds: Mapping[str, tuple[float, float]], units: Mapping[str, str]
) -> str:
    """What was probably meant by an impossible column: another unit, or another column."""

    def fits(values: Any, quantity: str) -> bool:
        low, high = bounds[quantity]
        return bool(np.mean((values >= low) & (values <= high)) > 1.0 - _LEFT_OUT)

    def raw(column: str) -> Any:
        shift = _KELVIN if units[column] == "K" else 0.0
        return (data.columns[column] + shift) / UNITS[column][units[column]]

    if name in data.columns:
        others = [
            other for other in data.columns
            if other != name and fits(_converted(name, units[name], raw(other)), name)
            and fits(_converted(other, units[other], raw(name)), other)
        ]  # fmt: skip
        # Swapped first where the other column is odd, too: no bench is freezing.
        cold = [n for n in others if n == "temperature" and np.median(data.columns[n]) < _FREEZING]
        if cold:
            return f"; are the columns {name} and {cold[0]} swapped?"
        for unit in UNITS[name]:
            if fits(_converted(name, unit, raw(name)), name):
                return f"; did you mean [{unit}]?"
        if others:
            return f"; are the columns {name} and {others[0]} swapped?"
    return ""


def _in_order(data: Data) -> Data:
    """Sorts a course by its time; says where there are gaps."""
    if "time" not in data.columns:
        return data
    time = data.columns["time"]
    if (np.diff(time) < 0.0).any():
        first = int(np.argmax(np.diff(time) < 0.0)) + 2
        data = data.noted(f"time falls at good row {first}: rows are sorted by time")
    order = np.argsort(time, kind="stable")
    keep = order[np.diff(time[order], prepend=-math.inf) > 0.0]
    if len(keep) < len(order):
        data = data.noted(f"{len(order) - len(keep)} row(s) repeat a time and are left out")
    columns = {name: each[keep] for name, each in data.columns.items()}
    data = replace(data, columns=columns)
    return _gaps(data) if data.stepped and data.rows > 2 else data


def _gaps(data: Data) -> Data:
    time = data.columns["time"]
    steps = np.diff(time)
    wide = np.flatnonzero(steps > _GAP * np.median(steps))
    if wide.size:
        at = int(wide[0])
        data = data.noted(
            f"{wide.size} gap(s) in time, the first of {steps[at]:.4g} s at {time[at]:.4g} s:"
            f" what drives the TCA is held over them"
        )
    return data



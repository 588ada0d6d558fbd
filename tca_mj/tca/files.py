"""TCAs as files: JSON in which every number has its unit and, where it is known, its source.

    {"format": "tca-mj TCA 1",
     "note": "the blue spool",
     "values": {
       "fibre.radius": {"value": 0.00021, "unit": "m", "kind": "measured", "error": 5e-06,
                        "data": "caliper, ten places"},
       "fibre_length": {"value": 0.175, "unit": "m"}, ...}}

A value has the name that it has in ``TcaSpec``, with dots. All must be there, so that a file means
the same for ever, but for what is None there: ``body``, ``plies``, ``breaking_force``.
Numbers are written with all their digits: what is read is what was written, to the last bit.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

from tca_mj.checks import Checked, Positive, door, shown
from tca_mj.files import write_whole
from tca_mj.hints import nearest
from tca_mj.tca.catalogue import CATALOGUE
from tca_mj.tca.materials import Source
from tca_mj.tca.spec import TcaSpec

FORMAT = "tca-mj TCA 1"
_LARGEST = 2**20  # bytes of a file: estimate, a TCA takes 4 kB
# Units as in the docstrings of the specifications; None for a word.
_UNITS: Mapping[str, str | list[str] | None] = {
    "fibre.radius": "m", "fibre.young": "Pa", "fibre.shear": "Pa", "fibre.filament_young": "Pa",
    "fibre.softening": "Pa/K", "fibre.load_softening": ["m²/rad²", "m/rad", "1"],
    "fibre.inserted_twist": "rad/m", "fibre.untwist_scale": "1",
    "fibre.expansion": ["1/K²", "1/K", "1"], "fibre.line_density": "kg/m",
    "fibre.specific_heat": "J/(kg K)", "fibre.reference_temperature": "°C",
    "fibre.temperature_range": "°C", "fibre.melting_temperature": "°C", "fibre.section": None,
    "fibre_length": "m", "coil_radius": "m", "pitch_angle": "rad", "minimum_pitch_angle": "rad",
    "breaking_force": "N", "resistance_per_length": "ohm/m", "stretch_resistance": "1",
    "contraction_resistance": "1", "heat_loss": "W/(m K)", "ambient": "°C",
    "body.conductance": "W/(m K)", "body.capacity": "J/(m K)", "body.loss": "W/(m K)",
    "contact_ratio": "1", "contact_smoothing": "1", "plies.strands": "1", "plies.lay_angle": "rad",
}  # fmt: skip

# What ``TcaSpec.from_measured`` guesses where something was not measured.
_GUESSED = (
    ("heat_loss", "heat_loss", "still air, by circumference as of silver-coated sewing thread"),
    ("minimum_pitch_angle", "contact_length", "close packing"),
)


@dataclass(frozen=True, kw_only=True, slots=True)
class TcaFile(Checked):
    """A TCA, and where its numbers come from.

    Attributes:
        spec: The TCA.
        provenance: Sources by the name of the number, as ``fibre.young``; of those that have one.
        note: What else is to be known.

    Raises:
        ValueError: If a source is that of a number that the TCA does not have, or has errors for
            more or less numbers than there are.
    """

    spec: TcaSpec
    provenance: Mapping[str, Source] = field(default_factory=dict)
    note: str = ""

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        values = dict(_flat(self.spec))
        for name, source in self.provenance.items():
            if name not in values:
                raise ValueError(
                    f"provenance must be of {list(values)}, got {shown(name)}"
                    f"{nearest(name, values)}"
                )
            value, error = values[name], source.error
            sizes = [len(x) if isinstance(x, tuple) else None for x in (value, error)]
            if error is not None and (isinstance(value, str) or sizes[0] != sizes[1]):
                raise ValueError(
                    f"provenance[{name!r}].error must have the form of the value {value!r},"
                    f" got {error!r}"
                )


@door
def measured_tca(
    *, errors: Mapping[str, Positive], sources: Mapping[str, Source] | None = None, note: str = "",
    **measured: Any,
) -> TcaFile:  # fmt: skip
    """A TCA from what was measured of it, and what the errors of that make of its numbers.

    Errors are taken for independent and small: each moves all numbers that follow from it, and the
    squares add up. That numbers move together, as pitch and radius with the natural length, is not
    kept.

    Args:
        errors: Standard errors of numbers in ``measured``, by name [their units].
        sources: Of numbers that were not measured, as ``Material.sources``.
        note: What else is to be known.
        **measured: Arguments of ``TcaSpec.from_measured``.

    Raises:
        ValueError: As ``TcaSpec.from_measured``, if there is an error of what was not measured, or
            one so large that what it makes of the measurements is no TCA.

    Example:
        >>> from tca_mj.tca import MATERIALS, measured_tca
        >>> mine = measured_tca(
        ...     fibre=MATERIALS["silver-coated nylon sewing thread"].measured, resistance=3.0,
        ...     rest_length=45e-3, fibre_length=175e-3, coils=63.0,
        ...     errors={"rest_length": 0.5e-3, "fibre_length": 1e-3},
        ... )
        >>> print(f"{mine.spec.coil_radius:.2e} m to {mine.provenance['coil_radius'].error:.0e} m")
        4.27e-04 m to 3e-06 m
    """
    spec = TcaSpec.from_measured(**measured)
    values = {name: value for name, value in _flat(spec) if isinstance(value, float)}
    square, by = dict.fromkeys(values, 0.0), {name: list[str]() for name in values}
    known = [name for name, value in measured.items() if isinstance(value, float | int)]
    for cause, error in errors.items():
        if cause not in known:
            raise ValueError(
                f"errors must be of {known}, got {shown(cause)}{nearest(cause, known)}"
            )
        moved = dict(_flat(TcaSpec.from_measured(**{**measured, cause: measured[cause] + error})))
        for name, value in values.items():
            if moved[name] != value:
                square[name] += (moved[name] - value) ** 2
                by[name].append(cause)
    found = {
        name: Source(
            kind="weighed" if "mass" in by[name] else "measured", error=math.sqrt(square[name]),
            data=f"from {', '.join(by[name])}",
        )
        for name in values if by[name]
    }  # fmt: skip
    guessed = {
        name: Source(kind="estimate", data=how) for name, cause, how in _GUESSED
        if measured.get(cause) is None
    }  # fmt: skip
    return TcaFile(spec=spec, provenance={**(sources or {}), **guessed, **found}, note=note)


@door
def write_tca(
    path: str | Path, spec: TcaSpec, provenance: Mapping[str, Source] | None = None, note: str = ""
) -> Path:
    """Writes a TCA as a file, in one go.

    Args:
        path: The file; it ends in ``.json``.
        spec: The TCA.
        provenance: Where its numbers come from, see ``TcaFile``.
        note: What else is to be known.

    Returns:
        The path.

    Raises:
        ValueError: If the ending is another, or as ``TcaFile``.
        OSError: If it cannot be written.
    """
    path, known = Path(path), TcaFile(spec=spec, provenance=provenance or {}, note=note)
    if path.suffix != ".json":
        raise ValueError(f"path must end in .json, got {path}")
    values = {}
    for name, value in _flat(spec):
        unit, source = _UNITS[name], known.provenance.get(name)
        entry = {"value": value} | ({} if unit is None else {"unit": unit})
        if source is not None:
            said = {"kind": source.kind, "error": source.error, "data": source.data or None}
            entry |= {key: each for key, each in said.items() if each is not None}
        values[name] = entry
    # One line for each number: what differs between two files is easily seen.
    head = {"format": FORMAT, "note": note}
    lines = [f"  {_json(name)}: {_json(entry)}" for name, entry in values.items()]
    text = f"{_json(head)[:-1]}, {_json('values')}: {{\n" + ",\n".join(lines) + "\n}}\n"
    return write_whole(path, text.encode())


@door
def read_tca(path: str | Path) -> TcaFile:
    """Reads a TCA from a file.

    Args:
        path: The file, as ``write_tca`` writes it.

    Raises:
        FileNotFoundError: If there is none.
        ValueError: With name, value and bound, if the file is none of a TCA: it is too large, no
            JSON, or of another format; a name is unknown, missing or there twice; a unit is not
            that of the value; a number is none or out of bounds.
    """
    with Path(path).open("rb") as file:
        content = file.read(_LARGEST + 1)
    try:
        if len(content) > _LARGEST:
            raise ValueError(f"file must have at most {_LARGEST} bytes, got more")
        return _parsed(content)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is no TCA: {error}") from error


@door
def find_tca(tca: TcaSpec | str | Path) -> TcaSpec:
    """A TCA that somebody has named.

    Args:
        tca: A name in ``CATALOGUE``, a file that ends in ``.json``, or the TCA itself.

    Raises:
        FileNotFoundError: If there is no such file.
        ValueError: If there is no such name, or as ``read_tca``.
    """
    if isinstance(tca, TcaSpec):
        return tca
    if Path(tca).suffix == ".json":
        return read_tca(tca).spec
    if tca not in CATALOGUE:
        raise ValueError(
            f"tca must be a TcaSpec, a file that ends in .json, or one of {sorted(CATALOGUE)},"
            f" got {shown(tca)}{nearest(tca, CATALOGUE)}"
        )
    return CATALOGUE[str(tca)]


@door
def with_tca(robot: Any, tca: TcaSpec | str | Path) -> Any:
    """A robot's specification with another TCA wherever it has one.

    What builds the robot cuts it to its routes and lays it into silicone as it does with its own.

    Args:
        robot: The specification, of a module or of what is made of modules.
        tca: The TCA, as for ``find_tca``.

    Raises:
        ValueError: If the robot has no TCA, it cannot have this one, or as ``find_tca``.

    Example:
        >>> from tca_mj import BendingSpec
        >>> from tca_mj.tca import with_tca
        >>> round(with_tca(BendingSpec(), "type-2-180").embedded.coils)
        143
    """
    found = find_tca(tca)

    def changed(spec: Any) -> Any:
        """The specification with it; None if it has no TCA."""
        if isinstance(spec, TcaSpec):
            return found
        if not is_dataclass(spec) or isinstance(spec, type):
            return None
        inside = {each.name: changed(getattr(spec, each.name)) for each in fields(spec)}
        new = {name: value for name, value in inside.items() if value is not None}
        return replace(spec, **new) if new else None

    result = changed(robot)
    if result is None:
        raise ValueError(f"robot must be a specification with a TCA, got {shown(robot)}")
    return result


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _flat(spec: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """The values of a specification by their names; without what is None."""
    for each in fields(spec):
        value = getattr(spec, each.name)
        if is_dataclass(value):
            yield from _flat(value, f"{before}{each.name}.")
        elif value is not None:
            yield f"{before}{each.name}", value


@cache
def _parts(kind: Any) -> Mapping[str, tuple[Any, bool]]:
    """Of each field of a specification the kind of specification that it is, or None; and whether
    it may be None."""
    found = {}
    for name, hint in get_type_hints(kind).items():
        members = get_args(hint) or (hint,)
        part = next((each for each in members if is_dataclass(each)), None)
        found[name] = part, type(None) in members
    return found


def _built(kind: Any, values: Mapping[str, Any], before: str = "") -> Any:
    given = {}
    for name, (part, optional) in _parts(kind).items():
        path = f"{before}{name}"
        there = path in values if part is None else any(n.startswith(f"{path}.") for n in values)
        if not there and not optional:
            raise ValueError(f"values must have {path!r} [{_unit(path)}], it is missing")
        if there:
            given[name] = values[path] if part is None else _built(part, values, f"{path}.")
    try:
        return kind(**given)
    except ValueError as error:
        raise ValueError(f"{before}{error}") from error


def _unit(name: str) -> str:
    return json.dumps(_UNITS.get(name, "a specification"), ensure_ascii=False).strip('"')


def _parsed(content: bytes) -> TcaFile:
    found = json.loads(
        content.decode(), object_pairs_hook=_once, parse_constant=_no_number,
    )  # fmt: skip
    _keys("the file", found, {"format", "note", "values"}, {"format", "values"})
    if found["format"] != FORMAT:
        raise ValueError(f"format must be {FORMAT!r}, got {shown(found['format'])}")
    entries = found["values"]
    _keys("values", entries, _UNITS.keys(), set())
    values, provenance = {}, {}
    for name, entry in entries.items():
        need = {"value"} if _UNITS[name] is None else {"value", "unit"}
        _keys(name, entry, {"value", "unit", "kind", "error", "data"}, need)
        if (unit := entry.pop("unit", None)) != _UNITS[name]:
            raise ValueError(f"unit of {name} must be {_unit(name)}, got {shown(unit)}")
        values[name] = entry.pop("value")
        if entry:
            _keys(name, entry, entry.keys(), {"kind"})
            try:
                provenance[name] = Source(**entry)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from error
    return TcaFile(
        spec=_built(TcaSpec, values), provenance=provenance, note=found.get("note", "")
    )  # fmt: skip


def _keys(what: str, found: Any, known: AbstractSet[str], needed: AbstractSet[str]) -> None:
    """Refuses what is no object, has a name that is not known, or lacks one that is needed."""
    if not isinstance(found, dict):
        raise ValueError(f"{what} must be an object in braces, got {shown(found)}")
    for name in found.keys() - known:
        raise ValueError(
            f"names in {what} must be of {sorted(known)}, got {shown(name)}{nearest(name, known)}"
        )
    for name in sorted(needed - found.keys()):
        raise ValueError(f"{what} must have {name!r}, it is missing")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"names must be there once, got {shown(twice)} twice")
    return found


def _no_number(word: str) -> Any:
    raise ValueError(f"values must be finite numbers, got {word}")

"""What an identification comes to, as a page, as data and as the file of a TCA."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.checks import door
from tca_mj.machine import versions
from tca_mj.pages import page, picture, table, write_result
from tca_mj.tca.files import write_tca
from tca_mj.tca.identify.constants import CONSTANTS, decoded, with_constants
from tca_mj.tca.identify.data import Data
from tca_mj.tca.identify.identified import Identification, Prediction
from tca_mj.tca.materials import Source

SPEC, REPORT = "tca.json", "report"
_STEP = 1e-4  # of differences, over the width
# What constants come to in the file of a TCA.
_VALUES = (
    *(f"fibre.{name}" for name in ("radius", "young", "shear", "softening", "expansion",
                                   "inserted_twist", "line_density", "specific_heat")),
    "fibre_length", "coil_radius", "pitch_angle", "minimum_pitch_angle", "resistance_per_length",
    "stretch_resistance", "contraction_resistance", "heat_loss", "ambient",
)  # fmt: skip
_BODY = ("body.conductance", "body.capacity", "body.loss")


@door
def sources(found: Identification) -> dict[str, Source]:
    """Where the fitted numbers of the TCA come from, for its file: errors follow from all
    constants that a number depends on; one that depends on what is not identified has none.

    Args:
        found: The identification.
    """
    fit, problem = found.fit, found.fit.problem
    names = [each.name for each in found.found if each.name in CONSTANTS]
    vague = {each.name for each in found.found if each.state == "not identified"}
    at = [problem.names.index(name) for name in names]
    covariance = fit.covariance[np.ix_(at, at)]
    values = _VALUES if found.tca.body is None else (*_VALUES, *_BODY)

    def tca(x: Any) -> Any:
        coded = zip(names, x, strict=True)
        return with_constants(problem.tca, {n: decoded(n, float(v)) for n, v in coded})

    here = tca(fit.x[at])
    slopes: dict[str, list[Any]] = {value: [] for value in values}
    for j, i in enumerate(at):
        moved = fit.x[at].copy()
        moved[j] += _STEP * problem.known[i].width
        there = tca(moved)
        for value in values:
            change = np.subtract(attrgetter(value)(there), attrgetter(value)(here))
            slopes[value].append(change / (moved[j] - fit.x[at][j]))
    result = {}
    data = ", ".join(each.name for each in found.data)
    for value in values:
        slope = np.array(slopes[value])
        by = [n for n, each in zip(names, slope, strict=True) if np.abs(each).max() > 0.0]
        unknown = sorted(vague & set(by))
        if unknown:
            result[value] = Source(kind="estimate", data=f"{data}: {unknown[0]} not identified")
        elif by:
            square = np.einsum("j...,ji,i...->...", slope, covariance, slope)
            error = np.sqrt(square).tolist()
            kept = tuple(error) if isinstance(error, list) else error
            result[value] = Source(kind="fitted", error=kept, data=data)
    return result


@door
def stated_errors(provenance: Mapping[str, Source]) -> dict[str, float]:
    """The errors that the file of a TCA states of what ruler, caliper and scale have said: for
    ``identify(..., errors=...)``.

    Args:
        provenance: Sources by the names of numbers, of ``TcaFile``.
    """
    found = {}
    for name, constant in CONSTANTS.items():
        own = provenance.get(name, provenance.get(f"fibre.{name}"))
        error = None if own is None or constant.own else own.error
        if isinstance(error, float) and error > 0.0:
            found[name] = error
    return found


@door
def write_identification(
    found: Identification, out: str | Path, held_out: Sequence[Data] = (), pictures: bool = False
) -> None:
    """Writes the TCA as ``tca.json`` and the report as ``report.json`` and ``report.md``.

    Args:
        found: The identification.
        out: The folder.
        held_out: Measurements that were not fitted, to be judged.
        pictures: Whether the page shows a picture of each set, see ``picture_name``.

    Raises:
        ValueError: As ``Identification.predict``.
        OSError: If they cannot be written.
    """
    out = Path(out)
    write_tca(out / SPEC, found.tca, sources(found), "; ".join(found.words))
    write_result(out, REPORT, result(found, held_out), report(found, held_out, pictures=pictures))


def picture_name(data: Data) -> str:
    """File of the picture of a set."""
    return f"{Path(data.name).stem}.png"


@door
def result(found: Identification, held_out: Sequence[Data] = ()) -> dict[str, Any]:
    """The same as data."""
    fit = found.fit

    def judged(data: Data, *more: tuple[str, float]) -> dict[str, Any]:
        inside = {each.outcome: each.inside for each in found.predict(data)}
        return {"name": data.name, "rows": data.rows, "within_95": inside, **dict(more),
                "notes": list(data.notes)}  # fmt: skip

    return {
        "law": found.law, "ends": found.ends, "words": list(found.words),
        "constants": [each._asdict() for each in found.found],
        "correlation": found.correlation.tolist(),
        "numbers": fit.problem.names, "covariance": fit.covariance.tolist(),
        "compared": [each._asdict() for each in found.compared],
        "sets": [judged(data, ("over_stated_errors", scale), ("errors_count", factor))
                 for data, scale, factor in zip(found.data, fit.scales.tolist(),
                                                fit.factors.tolist(), strict=True)],
        "loops": [each._asdict() for each in found.loops],
        "held_out": [judged(data) for data in held_out],
        "versions": versions("scipy"),
    }  # fmt: skip


@door
def report(
    found: Identification, held_out: Sequence[Data] = (), *, pictures: bool = False
) -> str:
    """The page of an identification, in Markdown.

    Args:
        found: The identification.
        held_out: Measurements that were not fitted, to be judged.
        pictures: Whether it shows a picture of each set, see ``picture_name``.

    Raises:
        ValueError: As ``Identification.predict``.
    """
    fit = found.fit
    names = [each.name for each in found.found]
    pairs = [
        f"{names[i]} and {names[j]} {found.correlation[i, j]:+.2f}"
        for i in range(len(names)) for j in range(i) if abs(found.correlation[i, j]) > 0.9
    ]  # fmt: skip
    sets = [
        [data.name, str(data.rows), f"{scale:.2f}", f"{factor / scale:.2f}", _inside(found, data)]
        for data, scale, factor in zip(found.data, fit.scales, fit.factors, strict=True)
    ]
    notes = [f"* {note}" for data in (*found.data, *held_out) for note in data.notes]
    return page(
        "# A TCA from measurements",
        [f"* {each}" for each in found.words],
        "## Constants",
        table(
            ["constant", "value", "unit", "standard error", "95 % interval", ""],
            [[f"`{each.name}`", f"{each.value:.5g}", each.unit, *_errors(each), each.state]
             for each in found.found],
        ),
        f"Correlated by more than 0.9: {'; '.join(pairs)}." if pairs else "",
        "## Sets",
        table(["file", "rows", "residuals over stated errors", "errors count, for order",
               "within 95 %"], sets),
        ["## Held out", "",
         *table(["file", "rows", "within 95 %"],
                [[d.name, str(d.rows), _inside(found, d)] for d in held_out])] if held_out else [],
        ["## Models", "",
         *table(["model", "ends", "Akaike's criterion above the best", "largest misfit"],
                [[c.law, c.ends or "as stated", f"{c.criterion:.1f}", f"{c.misfit:.2f}"]
                 for c in found.compared])] if found.compared else [],
        ["## Mended and assumed", "", *notes] if notes else [],
        *([picture(f"{d.name}: measured, expected and residuals", picture_name(d))
           for d in (*found.data, *held_out)] if pictures else []),
    )  # fmt: skip


def _errors(each: Any) -> list[str]:
    if each.interval is None:
        return ["", ""]
    return [f"{each.error:.2g}", f"{each.interval[0]:.5g} to {each.interval[1]:.5g}"]


def _inside(found: Identification, data: Data) -> str:
    def said(each: Prediction) -> str:
        return f"{each.outcome} {100 * each.inside:.1f} %"

    return ", ".join(map(said, found.predict(data)))

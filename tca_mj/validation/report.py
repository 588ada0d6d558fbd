"""The validation report of the TCA: recompute, judge, print, write."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from tca_mj import pages
from tca_mj.agents.progress import progress_bar
from tca_mj.machine import machine, versions
from tca_mj.validation import (
    creeping,
    drag,
    figures,
    gripping,
    heat,
    lifting,
    modules,
    race,
    sensors,
    strokes,
    theories,
    threads,
    touched,
)
from tca_mj.validation.facts import Finding, reasons, table, tally

# Heading, what finds its facts, and its figures, in the order of the report.
_CHAPTERS: dict[str, tuple[tuple[Callable[[], list[Finding]], ...], tuple[str, ...]]] = {
    "Strokes (Chapter 2)": (
        (strokes.free_strokes, strokes.contact_stops,
         partial(strokes.loaded_contractions, scanned=True),
         strokes.loaded_stroke, drag.findings, strokes.overlap, race.fastest, creeping.findings),
        ("strokes", "creep", "drag"),
    ),
    "Heat and resistance": ((heat.findings,), ()),
    "Sensing and control (Chapter 2)": (
        (sensors.findings, lifting.steps, lifting.demonstration),
        ("sensing", "control"),
    ),
    "Models (Chapter 3)": (
        (theories.moduli, theories.spread, theories.dynamics, theories.conical, theories.speed),
        ("fibre", "statics", "spring", "dynamics", "cone"),
    ),
    "Modules and arm (Chapter 4)": ((modules.findings, touched.findings), ()),
    "Adaptive gripper (Chapter 6)": ((gripping.findings,), ()),
}  # fmt: skip
# Width and height [inches], what draws it, and its caption.
_FIGURES: dict[str, tuple[float, float, Callable[[Any], None], str]] = {
    "strokes": (9.5, 7.4, figures.strokes_figure,
                "Displacement and length over temperature, ends free to spin; crosses: published."
                " Grey: beyond the data."),
    "creep": (8.0, 3.8, figures.creep_figure,
              "A weight of 20 g on type 1-180: instant stretch, creep when hot, temporary length."),
    "drag": (9.5, 3.8, figures.drag_figure,
             "A weight dragged over a sheet, and a kettle by five TCAs. Left: pull over the way"
             " that is done, at four temperatures, and the friction. Right: way over temperature."),
    "sensing": (9.5, 7.0, figures.sensing_figure,
                "Resistance of the TCA of Table 2.3 over length, displacement and force, and the"
                " third-order polynomial."),
    "control": (11.5, 6.6, figures.control_figure,
                "Step responses with self-sensing: integral and proportional gain, blown air,"
                " power, and the TCA that feels a weight and lifts it."),
    "fibre": (9.5, 3.8, figures.fibre_figure,
              "Untwist, and shear modulus over temperature under 0 to 60 g. The published"
              " polynomial of the load is not monotonic: it was fitted at 0, 30 and 60 g, and 30 g"
              " is like 0 g. Grey: beyond the data."),
    "statics": (11.5, 6.4, figures.statics_figure,
                "Length in the rod model, and how far Castigliano and Love are from it, over its"
                " largest contraction. Castigliano implicit (solid) and followed along the path"
                " (dashed)."),
    "spring": (9.5, 3.8, figures.spring_figure, "Case 2: the TCA pulls on a spring from a"
               " pretension of 0.05 N, heated by 5 V."),
    "dynamics": (11.5, 6.0, figures.dynamics_figure,
                 "Case 3: weights lifted by a constant voltage. Grey: above 160 °C."),
    "cone": (11.0, 4.6, figures.cone_figure, "The conical TCA without load."),
}  # fmt: skip


def all_findings() -> dict[str, list[Finding]]:
    """Every finding, by chapter of the report."""
    found = {}
    with progress_bar(len(_CHAPTERS), unit="chapters", leave=False) as bar:
        for name, (finders, _) in _CHAPTERS.items():
            found[name] = [row for find in finders for row in find()]
            bar.update()
    return found


def all_tables() -> dict[str, str]:
    """Tables of choices, as Markdown, by the chapter that they end."""
    return dict(zip(_CHAPTERS, (threads.table(), heat.table()), strict=False))


def validate_tca(out: Path | None = None) -> dict[str, Any]:
    """Recomputes every published fact about TCAs, in about two minutes.

    Args:
        out: Folder for ``report.json``, ``report.md`` and the figures ``validation_*.png``; None to
            write nothing.

    Returns:
        ``machine``, ``versions``, ``tally`` (number of findings by verdict), ``chapters``: by
        heading a list of findings as dictionaries, the fields of ``Finding``, and ``tables``: by
        heading a table of choices in Markdown.

    Raises:
        ImportError: If ``out`` is given and Matplotlib is not installed.
    """
    if out is not None:
        figures.need_matplotlib()
    chapters = all_findings()
    everything = [row for rows in chapters.values() for row in rows]
    result = {
        "machine": machine(), "versions": versions(), "tally": tally(everything),
        "chapters": {name: [asdict(row) for row in rows] for name, rows in chapters.items()},
        "tables": all_tables(),
    }  # fmt: skip
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        draw_figures(out)
    pages.write_result(out, "report", result, report(result, ""))
    return result


def draw_figures(out: Path) -> None:
    """Draws all figures into a folder that exists."""
    for name, (width, height, fill, _) in _FIGURES.items():
        figures.draw(out / f"validation_{name}.png", width, height, fill)


def report(result: dict[str, Any], pictures: str | None = None) -> str:
    """What ``validate_tca`` found, as Markdown.

    Args:
        result: What it returned.
        pictures: Path of the folder of the figures as seen from the text, with a slash at its end
            if it is another one; None for no figures.
    """
    counts = ", ".join(f"{number} {verdict}" for verdict, number in result["tally"].items())
    blocks = [pages.made_with(result), f"{sum(result['tally'].values())} facts: {counts}."]
    for name, rows in result["chapters"].items():
        found = [Finding(**row) for row in rows]
        blocks += [f"## {name}", table(found), reasons(found), result["tables"].get(name, "")]
        blocks += [pages.picture(_FIGURES[figure][3], f"{pictures}validation_{figure}.png")
                   for figure in _CHAPTERS[name][1] if pictures is not None]  # fmt: skip
    return pages.page(*blocks)

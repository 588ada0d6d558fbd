"""The validation report of the TCA: recompute, judge, print, write."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tca_mj.machine import machine, versions
from tca_mj.validation import (
    creeping,
    drag,
    figures,
    heat,
    lifting,
    modules,
    race,
    sensors,
    strokes,
    theories,
    threads,
)
from tca_mj.validation.facts import Finding, reasons, table, tally

# Heading, and figures with their captions, in the order of the report.
_CHAPTERS = {
    "Strokes (Chapter 2)": ("strokes", "creep", "drag"),
    "Heat and resistance": (),
    "Sensing and control (Chapter 2)": ("sensing", "control"),
    "Models (Chapter 3)": ("fibre", "statics", "spring", "dynamics", "cone"),
    "Modules and arm (Chapter 4)": (),
}
_CAPTIONS = {
    "strokes": "Displacement and length over temperature, ends free to spin; crosses: published."
    " Grey: beyond the data.",
    "creep": "A weight of 20 g on type 1-180: instant stretch, creep when hot, temporary length.",
    "drag": "A weight dragged over a sheet, and a kettle by five TCAs. Left: pull over the way that"
    " is done, at four temperatures, and the friction. Right: way over temperature.",
    "sensing": "Resistance of the TCA of Table 2.3 over length, displacement and force, and the"
    " third-order polynomial.",
    "control": "Step responses with self-sensing: integral and proportional gain, blown air,"
    " power, and the TCA that feels a weight and lifts it.",
    "fibre": "Untwist, and shear modulus over temperature under 0 to 60 g. The published polynomial"
    " of the load is not monotonic: it was fitted at 0, 30 and 60 g, and 30 g is like 0 g. Grey:"
    " beyond the data.",
    "statics": "Length in the rod model, and how far Castigliano and Love are from it, over its"
    " largest contraction. Castigliano implicit (solid) and followed along the path (dashed).",
    "spring": "Case 2: the TCA pulls on a spring from a pretension of 0.05 N, heated by 5 V.",
    "dynamics": "Case 3: weights lifted by a constant voltage. Grey: above 160 °C.",
    "cone": "The conical TCA without load.",
}


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """What both facts and figures are made of."""

    race: race.Race
    lifts: dict[tuple[float, int], theories.Lift]
    cone: theories.Cone
    integral: lifting.Response
    proportional: lifting.Response
    blown: lifting.Response
    answers: dict[int, lifting.Response]

    @classmethod
    def now(cls) -> "Runs":
        """Runs everything that takes more than a moment."""
        return cls(
            race=race.race(),
            lifts=theories.lifts(),
            cone=theories.cone(),
            integral=lifting.over_integral(),
            proportional=lifting.over_proportional(),
            blown=lifting.in_blown_air(),
            answers={grams: lifting.answer(grams) for grams in (20, 40)},
        )


def cheap_findings() -> list[Finding]:
    """The findings that take some seconds: no scans, control, cone or timing."""
    return [*strokes.findings(full=False), *drag.findings(), *race.fastest(),
            *creeping.findings(), *heat.findings(), *sensors.findings(),
            *theories.findings(full=False), *modules.findings(full=False)]  # fmt: skip


def all_findings(runs: Runs) -> dict[str, list[Finding]]:
    """Every finding, by chapter of the report."""
    scans = strokes.scan_of_choices(), strokes.scan_of_factors()
    chapters = [
        [*strokes.free_strokes(), *strokes.contact_stops(), *strokes.loaded_contractions(*scans),
         *strokes.loaded_stroke(), *drag.findings(), *strokes.overlap(),
         *race.fastest(runs.race), *creeping.findings()],
        heat.findings(),
        [*sensors.findings(), *lifting.steps(runs.integral, runs.proportional, runs.blown),
         *lifting.demonstration(runs.answers[20], runs.answers[40]), *lifting.finger()],
        [*theories.moduli(), *theories.spread(), *theories.dynamics(runs.lifts),
         *theories.conical(runs.cone), *theories.speed()],
        modules.findings(),
    ]  # fmt: skip
    return dict(zip(_CHAPTERS, chapters, strict=True))


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
    runs = Runs.now()
    chapters = all_findings(runs)
    everything = [row for rows in chapters.values() for row in rows]
    result = {
        "machine": machine(),
        "versions": versions(),
        "tally": tally(everything),
        "chapters": {name: [asdict(row) for row in rows] for name, rows in chapters.items()},
        "tables": all_tables(),
    }
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        draw_figures(runs, out)
        text = json.dumps(result, indent=2, ensure_ascii=False) + "\n"
        (out / "report.json").write_text(text, encoding="utf-8")
        (out / "report.md").write_text(report(result, "") + "\n", encoding="utf-8")
    return result


def draw_figures(runs: Runs, out: Path) -> None:
    """Draws all figures into a folder that exists."""
    fills: dict[str, tuple[float, float, Callable[[Any], None]]] = {
        "strokes": (9.5, 7.4, partial(figures.strokes_figure, race=runs.race)),
        "creep": (8.0, 3.8, partial(figures.creep_figure, found=creeping.experiment())),
        "drag": (9.5, 3.8, figures.drag_figure),
        "sensing": (9.5, 7.0, partial(figures.sensing_figure, curves=sensors.curves())),
        "control": (11.5, 6.6, partial(
            figures.control_figure, integral=runs.integral, proportional=runs.proportional,
            blown=runs.blown, answers=runs.answers)),
        "fibre": (9.5, 3.8, figures.fibre_figure),
        "statics": (11.5, 6.4, figures.statics_figure),
        "spring": (9.5, 3.8, figures.spring_figure),
        "dynamics": (11.5, 6.0, partial(figures.dynamics_figure, lifts=runs.lifts)),
        "cone": (11.0, 4.6, partial(figures.cone_figure, found=runs.cone)),
    }  # fmt: skip
    for name, (width, height, fill) in fills.items():
        figures.draw(out / f"validation_{name}.png", width, height, fill)


def report(result: dict[str, Any], pictures: str | None = None) -> str:
    """What ``validate_tca`` found, as Markdown.

    Args:
        result: What it returned.
        pictures: Path of the folder of the figures as seen from the text, with a slash at its end
            if it is another one; None for no figures.
    """
    where = result["machine"]
    kept = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    counts = ", ".join(f"{number} {verdict}" for verdict, number in result["tally"].items())
    lines = [f"{where['cpu']}, {where['cores']} cores; {where['system']}", kept, "",
             f"{sum(result['tally'].values())} facts: {counts}.", ""]  # fmt: skip
    for name, rows in result["chapters"].items():
        found = [Finding(**row) for row in rows]
        lines += [f"## {name}", "", table(found), "", reasons(found), ""]
        if name in result["tables"]:
            lines += [result["tables"][name], ""]
        for figure in _CHAPTERS[name] if pictures is not None else ():
            lines += [f"![{_CAPTIONS[figure]}]({pictures}validation_{figure}.png)", "",
                      f"*{_CAPTIONS[figure]}*", ""]  # fmt: skip
    return "\n".join(lines).rstrip()

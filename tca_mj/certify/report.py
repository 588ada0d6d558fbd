"""The certificate: how far the chain of every module is from theory; compute, print, write."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj import pages
from tca_mj.agents.progress import progress_bar
from tca_mj.certify.cases import Gap
from tca_mj.certify.claims import Claim, claims
from tca_mj.certify.outcomes import FULL, POSITION, ROTATION, TIMES, Effort, Outcome, outcomes
from tca_mj.certify.subjects import SUBJECTS
from tca_mj.machine import machine, versions
from tca_mj.validation.figures import draw, need_matplotlib

_NOTHING = 1e-6  # error below which there is no order to measure, and none is drawn [1, rad]
_FIELDS = ("position", "rotation")
_SHADES = {"hanging": "#0072b2", "lying": "#d55e00", "standing": "#8a4fa3"}
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#8a4fa3", "#56b4e9", "#b8860b", "#555555", "#cc3377",
            "#88aa00", "#003f7f", "#ff9955", "#44ccaa", "#bb99ee", "#aa7755")  # fmt: skip
_MARKERS = "o-", "s--"  # of the first so many modules, and of as many more
_ABREAST = 5  # modules side by side in a figure
_FIGURES = {
    "bend": "Error of the tip's place and rotation over its bend, at the default nodes. Dashed:"
    " 1 % of the length and 2°.",
    "nodes": "Error over the number of nodes: single cases thin, their median thick.",
}


def certify(
    names: Sequence[str] = (), *, out: Path | None = None, effort: Effort = FULL, seed: int = 0,
    workers: int | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Certifies modules, all of them within half an hour on two cores.

    Args:
        names: Some of ``SUBJECTS``, by default all. Single claims are checked with all only.
        out: Folder for ``report.json``, ``report.md`` and the figures ``accuracy_*.png``; None to
            write nothing.
        effort: How many cases are drawn, and how many of them are looked at more closely.
        seed: Of the cases.
        workers: Processes that share the work, by default one per core.

    Returns:
        ``machine``, ``versions``, ``effort``, ``seed``, ``seconds`` (that it took, and of
        processors), ``modules`` (outcomes by name) and ``claims``, as dictionaries.

    Raises:
        ValueError: If there is no such module.
        ImportError: If ``out`` is given and Matplotlib is not installed.
    """
    unknown = sorted(set(names) - set(SUBJECTS))
    if unknown:
        raise ValueError(f"modules must be some of {', '.join(SUBJECTS)}, got {unknown}")
    if out is not None:
        need_matplotlib()
    asked = [name for name in SUBJECTS if name in names] if names else list(SUBJECTS)
    cores = int(machine()["cores"]) if workers is None else workers
    begin, busy = time.perf_counter(), time.process_time()
    with progress_bar(effort.cases * len(asked), unit="cases", leave=False) as bar:
        rows = outcomes(asked, effort=effort, seed=seed, workers=cores, progress=bar.update)
    single = [] if names else claims()
    processor = time.process_time() - busy
    if cores > 1:  # the processes' own
        processor += sum(row.seconds for each in rows.values() for row in each)
    result = {
        "machine": machine(), "versions": versions(), "effort": effort._asdict(), "seed": seed,
        "seconds": {"wall": time.perf_counter() - begin, "processor": processor},
        "modules": {name: [asdict(row) for row in each] for name, each in rows.items()},
        "claims": [asdict(claim) for claim in single],
    }  # fmt: skip
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        draw_figures(rows, out)
    page = report(rows, single, result, pictures="")
    pages.write_result(out, "report", result, page, indent=1)
    return result | {"text": report(rows, single, result)}


def report(
    rows: dict[str, list[Outcome]], single: Sequence[Claim], result: dict[str, Any], *,
    pictures: str | None = None,
) -> str:  # fmt: skip
    """The certificate as Markdown.

    Args:
        rows: Outcomes by module.
        single: Claims.
        result: Machine, versions, effort, seed and seconds as in ``certify``.
        pictures: Path of the folder of the figures as seen from the text, with a slash at its end
            if it is another one; None for no figures.
    """
    drawn = {name: "" if pictures is None
             else pages.picture(caption, f"{pictures}accuracy_{name}.png")
             for name, caption in _FIGURES.items()}  # fmt: skip
    return pages.page(
        pages.made_with(result),
        f"{result['effort']['cases']} cases per module, seed {result['seed']}:"
        f" {result['seconds']['processor']:.0f} s of processor time.",
        "## Modules at their default nodes", _table(rows), _remarks(rows), drawn["bend"],
        "## Order", _orders(rows), drawn["nodes"],
        "## Checks of theory and simulation", _checks(rows),
        *(["## Single claims", _claims(single)] if single else ()),
    )  # fmt: skip


def _table(rows: dict[str, list[Outcome]]) -> list[str]:
    lines = []
    for name, every in rows.items():
        for posture in _SHADES:
            here = [row for row in every if row.posture == posture]
            if not here:
                continue
            verdict = "yes" if within(here) else f"**no**{_needed(name, here)}"
            errors = [(100.0 * gap.position, np.degrees(gap.rotation), 1e3 * gap.strain,
                       1e3 * gap.tension) for _, gap in _found(here)]  # fmt: skip
            columns = zip(*errors, strict=True)
            cells = [_spread(values) for values in columns] or ["-"] * 4
            lines.append([name, _nodes_of(name), posture, f"{len(here)}", *cells, verdict])
    heads = ["module", "nodes", "base", "cases", "tip [% of L]: median, 95 %, worst",
             "rotation [°]", "TCA length [‰]", "tension [mN]", "within 1 %, 2°"]  # fmt: skip
    return pages.table(heads, lines)


def _spread(values: Sequence[float]) -> str:
    return ", ".join(f"{each:.2f}" for each in np.percentile(values, [50.0, 95.0, 100.0]))


def within(rows: Iterable[Outcome]) -> bool:
    """Whether every answer is within 1 % of the length and 2°, and every case has one."""
    gaps = [row.gap for row in rows]
    return all(gap and gap.position < POSITION and gap.rotation < ROTATION for gap in gaps)


def _needed(name: str, rows: Sequence[Outcome]) -> str:
    """How many nodes second order asks for."""
    gaps = (gap for _, gap in _found(rows))
    excess = max((max(gap.position / POSITION, gap.rotation / ROTATION) for gap in gaps), default=0)
    nodes = max(SUBJECTS[name]().nodes)
    return f": {math.ceil(nodes * math.sqrt(excess))} nodes" if excess > 1.0 else ""


def _remarks(rows: dict[str, list[Outcome]]) -> Iterator[str]:
    """The worst cases, and those without an answer or with another one."""
    for name, every in rows.items():
        answered = _found(every)
        if not answered:
            yield f"* *{name}*: no case was answered."
            continue
        row, gap = max(answered, key=lambda pair: pair[1].position)
        line = (
            f"* *{name}*, {SUBJECTS[name]().what}. Worst: {100 * gap.position:.2f} % of L,"
            f" {np.degrees(gap.rotation):.2f}°, {1e6 * gap.length:.1f} µm, at {_said(row)}."
        )
        elsewhere = [row for row in every if row.elsewhere]
        if elsewhere:
            line += (
                f" In {len(elsewhere)} of {len(every)} cases the body has buckled and has two"
                " states at rest: left alone the chain sinks to the one, theory found the other;"
                " compared are the states next to each other."
            )
        failed = [row for row in every if row.failure]
        if failed:
            line += f" Without an answer: {len(failed)} ({_said(failed[0])}: {failed[0].failure})."
        yield line


def _said(row: Outcome) -> str:
    hot = ", ".join(f"{each:.0f}" for each in row.temperature)
    load = f"{1e3 * row.force:.1f} mN and {1e6 * row.moment:.0f} µN m" if row.force else "no load"
    bend = "" if row.bend is None else f", bent by {np.degrees(row.bend):.0f}°"
    return f"{hot} °C, {row.posture}, {load}{bend}"


def _ratios(rows: Iterable[Outcome], field: str) -> tuple[list[float], list[float]]:
    """Errors at N over those at 2 N, and at 2 N over 4 N, of the cases that were refined.

    Args:
        rows: Outcomes.
        field: "position" or "rotation".
    """
    kept = [errors for errors in _finer(rows, field) if errors[-1] > _NOTHING]
    return [one / two for one, two, _ in kept], [two / four for _, two, four in kept]


def _finer(rows: Iterable[Outcome], field: str) -> list[list[float]]:
    return [[getattr(each, field) for each in finer] for finer in _known(rows, "finer")]


def _orders(rows: dict[str, list[Outcome]]) -> list[str]:
    lines = []
    for name, every in rows.items():
        nodes, pairs = SUBJECTS[name]().nodes[0], [_ratios(every, field) for field in _FIELDS]
        count = max(len(coarse) for coarse, _ in pairs)
        lines.append([name, f"{nodes}, {2 * nodes}, {4 * nodes}", f"{count}"])
        for pair in pairs:
            lines[-1] += [f"{np.median(each):.2f} ({min(each):.2f} to {max(each):.2f})"
                          if each else "-" for each in pair]  # fmt: skip
            lines[-1].append(f"{np.log2(np.median(pair[1])):.2f}" if pair[1] else "-")
    heads = ["module", "nodes", "cases", "tip: N to 2 N, median (range)", "2 N to 4 N", "order",
             "rotation: N to 2 N", "2 N to 4 N", "order"]  # fmt: skip
    return pages.table(heads, lines)


def _checks(rows: dict[str, list[Outcome]]) -> list[str]:
    lines = []
    for name, every in rows.items():
        solvers, velocity, split = (_known(every, k) for k in ("solvers", "velocity", "split"))
        shear, run = ([100.0 * gap.position for gap in _known(every, k)] for k in ("shear", "run"))
        apart = f"{max(solvers):.0e} ({len(solvers)} cases)" if solvers else "-"
        if split:
            apart += (f"; in {len(split)} each found one of two states, and the chain has the"
                      f" other too, to {100 * max(split):.2f} %")  # fmt: skip
        lines.append([
            name, apart, _spread(shear) if shear else "-",
            f"{max(run):.4f} ({len(run)} cases)" if run else "-",
            f"{max(velocity):.0e}" if velocity else "-",
        ])  # fmt: skip
    return pages.table([
        "module", "two solvers of the theory: largest distance of the tips [m]",
        "what shear would move the tip [% of L]: median, 95 %, worst",
        "simulation from the cold against rest [% of L]", "velocity left [rad/s]",
    ], lines)  # fmt: skip


def _claims(single: Sequence[Claim]) -> list[str]:
    words = {True: "held", False: "**missed**", None: "cannot tell"}
    rows = ([claim.group, claim.what, claim.asked, claim.found, words[claim.held]]
            for claim in single)  # fmt: skip
    return pages.table(["", "case", "asked", "found", ""], rows)


def draw_figures(rows: Mapping[str, Sequence[Outcome]], out: Path) -> None:
    """Draws ``accuracy_bend.png`` and ``accuracy_nodes.png`` into a folder that exists."""
    abreast, deep = min(len(rows), _ABREAST), -(-len(rows) // _ABREAST)
    wide, high = max(4.2, 2.7 * abreast), 4.8 * deep + 0.4
    draw(out / "accuracy_bend.png", wide, high, lambda f: _bend(f, rows))
    draw(out / "accuracy_nodes.png", 11.0, 5.2, lambda f: _nodes(f, rows))


def _bend(figure: Any, rows: Mapping[str, Sequence[Outcome]]) -> None:
    """Error over bend."""
    abreast, deep = min(len(rows), _ABREAST), -(-len(rows) // _ABREAST)
    axes = figure.subplots(2 * deep, abreast, squeeze=False)
    pairs = axes.reshape(deep, 2, abreast).swapaxes(1, 2).reshape(-1, 2)
    for axis in pairs[len(rows) :].flat:
        axis.remove()
    for (above, below), (name, every) in zip(pairs, rows.items(), strict=False):
        for posture, shade in _SHADES.items():
            for loaded, face in ((True, shade), (False, "none")):
                some = [(row, gap) for row, gap in _found(every)
                        if row.posture == posture and (row.force > 0.0) == loaded]  # fmt: skip
                angle = [np.degrees(row.bend or 0.0) for row, _ in some]
                style = {"s": 16, "edgecolors": shade, "facecolors": face, "linewidths": 1.0}
                above.scatter(angle, [100.0 * gap.position for _, gap in some], **style)
                below.scatter(angle, [np.degrees(gap.rotation) for _, gap in some], **style)
        for axis, limit in ((above, 100.0 * POSITION), (below, np.degrees(ROTATION))):
            axis.axhline(limit, color="#666666", lw=1, ls="--")
        above.set(title=f"{name}, {_nodes_of(name)} nodes")
        below.set(xlabel="bend [°]")
    for above, below in pairs[: len(rows) : abreast]:
        above.set(ylabel="error of the tip [% of L]")
        below.set(ylabel="error of its rotation [°]")
    for axis in pairs[: len(rows)].flat:
        axis.set(ylim=(0.0, None))
    first = axes[0, 0]
    for posture, shade in _SHADES.items():
        first.scatter([], [], s=16, color=shade, label=posture)
    first.scatter([], [], s=16, edgecolors="#555555", facecolors="none", label="no load")
    figure.legend(loc="outside lower center", ncols=4)


def _nodes(figure: Any, rows: Mapping[str, Sequence[Outcome]]) -> None:
    """Error over the number of nodes."""
    axes = figure.subplots(1, 2)
    labels = "error of the tip [1/L]", "error of its rotation [rad]"
    for axis, field, label in zip(axes, _FIELDS, labels, strict=True):
        styles = product(_MARKERS, _COLOURS)
        for (marker, colour), (name, every) in zip(styles, rows.items(), strict=False):
            nodes = np.array(TIMES) * SUBJECTS[name]().nodes[0]
            errors = np.array([each for each in _finer(every, field) if max(each) > _NOTHING])
            if errors.size:
                drawn = np.maximum(errors, _NOTHING)
                axis.plot(nodes, drawn.T, "-", color=colour, lw=0.6, alpha=0.4)
                axis.plot(nodes, np.median(errors, axis=0), marker, color=colour, label=name)
        wide = np.array([8.0, 64.0])
        axis.plot(wide, 3e-3 * (8.0 / wide) ** 2, "k--", lw=1, label="second order")
        axis.set(xscale="log", yscale="log", xlabel="nodes of a module", ylabel=label)
        axis.set_xticks([8, 16, 32, 64], labels=["8", "16", "32", "64"])
        axis.minorticks_off()
    axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)


def _nodes_of(name: str) -> str:
    """The default nodes of a module, from base to tip."""
    return " + ".join(str(nodes) for nodes in SUBJECTS[name]().nodes)


def _known(rows: Iterable[Outcome], field: str) -> list[Any]:
    """A field of the outcomes that have it."""
    values = (getattr(row, field) for row in rows)
    return [value for value in values if value is not None]


def _found(rows: Iterable[Outcome]) -> list[tuple[Outcome, Gap]]:
    """The outcomes that have a gap, with it."""
    return [(row, row.gap) for row in rows if row.gap is not None]

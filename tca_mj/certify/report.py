"""The certificate: how far the chain of every module is from theory; compute, print, write."""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from tca_mj import pages
from tca_mj.certify.claims import Claim, claims
from tca_mj.certify.figures import draw_figures, nodes_of
from tca_mj.certify.outcomes import POSITION, ROTATION, Effort, Outcome, Spread, found, outcomes
from tca_mj.certify.subjects import SUBJECTS
from tca_mj.machine import machine, versions
from tca_mj.validation.figures import need_matplotlib

_NOTHING = 1e-6  # error below which there is no order to measure [1, rad]
_FIGURES = {
    "bend": "Error of the tip's place and rotation over its bend, at the default nodes. Dashed:"
    " 1 % of the length and 2°.",
    "nodes": "Error over the number of nodes: single cases thin, their median thick.",
}


def certify(
    names: Sequence[str] = (),
    *,
    out: Path | None = None,
    effort: Effort = Effort(),  # noqa: B008  (immutable)
    seed: int = 0,
    workers: int | None = None,
) -> dict[str, Any]:
    """Certifies modules, all of them within three minutes on two cores.

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
    with tqdm(total=effort.cases * len(asked), disable=None, unit="case", leave=False) as bar:
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
    rows: dict[str, list[Outcome]],
    single: Sequence[Claim],
    result: dict[str, Any],
    *,
    pictures: str | None = None,
) -> str:
    """The certificate as Markdown.

    Args:
        rows: Outcomes by module.
        single: Claims.
        result: Machine, versions, effort, seed and seconds as in ``certify``.
        pictures: Path of the folder of the figures as seen from the text, with a slash at its end
            if it is another one; None for no figures.
    """
    lines = [
        *pages.made_with(result), "",
        f"{result['effort']['cases']} cases per module, seed {result['seed']}:"
        f" {result['seconds']['processor']:.0f} s of processor time.", "",
        "## Modules at their default nodes", "", *_table(rows), "", *_remarks(rows), "",
        *_picture("bend", pictures),
        "## Order", "", *_orders(rows), "", *_picture("nodes", pictures),
        "## Checks of theory and simulation", "", *_checks(rows), "",
    ]  # fmt: skip
    if single:
        lines += ["## Single claims", "", *_claims(single), ""]
    return "\n".join(lines).rstrip()


def _picture(name: str, pictures: str | None) -> list[str]:
    if pictures is None:
        return []
    return pages.picture(_FIGURES[name], f"{pictures}accuracy_{name}.png")


def _table(rows: dict[str, list[Outcome]]) -> list[str]:
    lines = []
    for name, every in rows.items():
        subject = SUBJECTS[name]()
        for posture in ("hanging", "lying", "standing"):
            here = [row for row in every if row.posture == posture]
            gaps = [gap for _, gap in found(here)]
            verdict = "**no**"
            if gaps:
                verdict = "yes" if within(here) else f"**no**{_needed(max(subject.nodes), here)}"
            columns = zip(*((100.0 * gap.position, np.degrees(gap.rotation), 1e3 * gap.strain,
                             1e3 * gap.tension) for gap in gaps), strict=True)  # fmt: skip
            cells = [_spread(values) for values in columns] or ["-"] * 4
            if here:
                lines.append([name, nodes_of(name), posture, f"{len(here)}", *cells, verdict])
    heads = ["module", "nodes", "base", "cases", "tip [% of L]: median, 95 %, worst",
             "rotation [°]", "TCA length [‰]", "tension [mN]", "within 1 %, 2°"]  # fmt: skip
    return pages.table(heads, lines)


def _spread(values: Iterable[float]) -> str:
    return ", ".join(f"{each:.2f}" for each in Spread.of(values))


def within(rows: Iterable[Outcome]) -> bool:
    """Whether every answer is within 1 % of the length and 2°, and every case has one."""
    gaps = [row.gap for row in rows]
    return all(gap and gap.position < POSITION and gap.rotation < ROTATION for gap in gaps)


def _needed(nodes: int, rows: Sequence[Outcome]) -> str:
    """How many nodes second order asks for."""
    excess = max(max(gap.position / POSITION, gap.rotation / ROTATION) for _, gap in found(rows))
    return f": {math.ceil(nodes * math.sqrt(excess))} nodes" if excess > 1.0 else ""


def _remarks(rows: dict[str, list[Outcome]]) -> Iterator[str]:
    """The worst cases, and those without an answer or with another one."""
    for name, every in rows.items():
        answered = found(every)
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
    finer = [[getattr(each, field) for each in row.finer] for row in rows if row.finer]
    kept = [errors for errors in finer if errors[-1] > _NOTHING]
    return [one / two for one, two, _ in kept], [two / four for _, two, four in kept]


def _orders(rows: dict[str, list[Outcome]]) -> list[str]:
    lines = []
    for name, every in rows.items():
        nodes, cells, count = SUBJECTS[name]().nodes[0], [], 0
        for field in ("position", "rotation"):
            pair = _ratios(every, field)
            count = max(count, len(pair[0]))
            if not pair[0]:
                cells += ["-", "-", "-"]
                continue
            cells += [f"{np.median(each):.2f} ({min(each):.2f} to {max(each):.2f})"
                      for each in pair]  # fmt: skip
            cells.append(f"{np.log2(np.median(pair[1])):.2f}")
        lines.append([name, f"{nodes}, {2 * nodes}, {4 * nodes}", f"{count}", *cells])
    heads = ["module", "nodes", "cases", "tip: N to 2 N, median (range)", "2 N to 4 N", "order",
             "rotation: N to 2 N", "2 N to 4 N", "order"]  # fmt: skip
    return pages.table(heads, lines)


def _checks(rows: dict[str, list[Outcome]]) -> list[str]:
    lines = []
    for name, every in rows.items():
        solvers = [row.solvers for row in every if row.solvers is not None]
        shear = [100.0 * row.shear.position for row in every if row.shear is not None]
        run = [100.0 * row.run.position for row in every if row.run is not None]
        velocity = [row.velocity for row in every if row.velocity is not None]
        split = [row.split for row in every if row.split is not None]
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

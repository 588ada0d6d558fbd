"""Figures of the certificate: error over bend, and error over the number of nodes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.certify.outcomes import POSITION, ROTATION, TIMES, Outcome, found
from tca_mj.certify.subjects import SUBJECTS
from tca_mj.validation.figures import draw

_SHADES = {"hanging": "#0072b2", "lying": "#d55e00", "standing": "#8a4fa3"}
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#8a4fa3", "#56b4e9", "#b8860b", "#555555")
_FLOOR = 1e-6  # smaller errors are drawn here


def draw_figures(rows: Mapping[str, Sequence[Outcome]], out: Path) -> None:
    """Draws ``accuracy_bend.png`` and ``accuracy_nodes.png`` into a folder that exists."""
    draw(out / "accuracy_bend.png", max(4.2, 2.7 * len(rows)), 5.2, lambda f: _bend(f, rows))
    draw(out / "accuracy_nodes.png", 9.0, 4.4, lambda f: _nodes(f, rows))


def _bend(figure: Any, rows: Mapping[str, Sequence[Outcome]]) -> None:
    axes = figure.subplots(2, len(rows), squeeze=False, sharey="row")
    for column, (name, outcomes) in enumerate(rows.items()):
        above, below = axes[:, column]
        for posture, shade in _SHADES.items():
            here = [(row, gap) for row, gap in found(outcomes) if row.posture == posture]
            for loaded, face in ((True, shade), (False, "none")):
                some = [(row, gap) for row, gap in here if (row.force > 0.0) == loaded]
                angle = [np.degrees(row.bend or 0.0) for row, _ in some]
                style = {"s": 16, "edgecolors": shade, "facecolors": face, "linewidths": 1.0}
                above.scatter(angle, [100.0 * gap.position for _, gap in some], **style)
                below.scatter(angle, [np.degrees(gap.rotation) for _, gap in some], **style)
        above.axhline(100.0 * POSITION, color="#666666", lw=1, ls="--")
        below.axhline(np.degrees(ROTATION), color="#666666", lw=1, ls="--")
        above.set(title=f"{name}, {nodes_of(name)} nodes")
        below.set(xlabel="bend [°]")
    axes[0, 0].set(ylabel="error of the tip [% of L]", ylim=(0.0, None))
    axes[1, 0].set(ylabel="error of its rotation [°]", ylim=(0.0, None))
    for posture, shade in _SHADES.items():
        axes[0, 0].scatter([], [], s=16, color=shade, label=posture)
    axes[0, 0].scatter([], [], s=16, edgecolors="#555555", facecolors="none", label="no load")
    figure.legend(loc="outside lower center", ncols=4, fontsize=8, frameon=False)


def _nodes(figure: Any, rows: Mapping[str, Sequence[Outcome]]) -> None:
    axes = figure.subplots(1, 2)
    fields = ("position", "rotation")
    for colour, (name, outcomes) in zip(_COLOURS, rows.items(), strict=False):
        nodes = np.array(TIMES) * SUBJECTS[name]().nodes[0]
        for axis, field in zip(axes, fields, strict=True):
            errors = np.array(
                [[getattr(gap, field) for gap in row.finer] for row in outcomes if row.finer]
            )
            errors = errors[errors.max(axis=1, initial=0.0) > _FLOOR] if errors.size else errors
            if not len(errors):
                continue
            axis.plot(nodes, np.maximum(errors, _FLOOR).T, "-", color=colour, lw=0.6, alpha=0.4)
            axis.plot(nodes, np.median(errors, axis=0), "o-", color=colour, lw=2, label=name)
    labels = "error of the tip [1/L]", "error of its rotation [rad]"
    for axis, label in zip(axes, labels, strict=True):
        wide = np.array([8.0, 64.0])
        axis.plot(wide, 3e-3 * (8.0 / wide) ** 2, "k--", lw=1, label="second order")
        axis.set(xscale="log", yscale="log", xlabel="nodes of a module", ylabel=label)
        axis.set_xticks([8, 16, 32, 64], labels=["8", "16", "32", "64"])
        axis.minorticks_off()
    axes[0].legend(fontsize=8, frameon=False)


def nodes_of(name: str) -> str:
    """The default nodes of a module, from base to tip."""
    return " + ".join(str(nodes) for nodes in SUBJECTS[name]().nodes)

"""Figures of an identification: what was measured, what is expected, and what is left."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.tca.identify import Data, Followed, Identification
from tca_mj.tca.identify.data import DRIVES, SHOWN
from tca_mj.tca.identify.predict import given_with_error, length_name
from tca_mj.validation.figures import draw

_DOT, _LINE = "#0072b2", "#d55e00"


def residuals_picture(found: Identification, data: Data, path: Path) -> None:
    """Draws a set of measurements with its 95 % band above, and the residuals over the standard
    errors below, a column for each outcome.

    Args:
        found: The identification.
        data: The set, fitted or held out.
        path: Picture to write; its folder exists.

    Raises:
        ImportError: If Matplotlib is not installed.
        ValueError: As ``Identification.predict``.
    """
    known = found.predict(data)
    draw(path, 4.2 * len(known), 4.6, partial(_fill, data=data, known=known))


def log_picture(found: Followed, path: Path) -> None:
    """Draws a log over time: what drove the TCA, and what was measured, modelled and observed.

    Args:
        found: The log and what was made of it.
        path: Picture to write; its folder exists.

    Raises:
        ImportError: If Matplotlib is not installed.
    """
    drives = [name for name in (*DRIVES, "duty") if name in found.data.columns]
    draw(path, 7.5, 1.8 * (1 + len(found.model)), partial(_follow, found=found, drives=drives))


def _follow(figure: Any, found: Followed, drives: list[str]) -> None:
    columns, (top, *panels) = found.data.columns, figure.subplots(1 + len(found.model), sharex=True)
    time = columns["time"]
    for name in drives:
        top.plot(time, columns[name], lw=1, drawstyle="steps-post", label=f"{name} [{SHOWN[name]}]")
    top.set(title=found.data.name)
    for panel, (name, model) in zip(panels, found.model.items(), strict=True):
        if name in columns:
            panel.plot(time, columns[name], ".", color="#999999", ms=2, label="measured")
        panel.plot(time, model, color=_LINE, label="model")
        if name in found.observed:
            panel.plot(time, found.observed[name], color=_DOT, lw=1, label="observer")
        panel.set_ylabel(f"{name} [{SHOWN[name]}]")
    panels[-1].set_xlabel("time [s]")
    for panel in (top, *panels):
        panel.legend(loc="upper right")


def _fill(figure: Any, data: Data, known: Any) -> None:
    by = "time" if data.stepped else next(iter(given_with_error(data)), length_name(data))
    x = data.columns[by]
    order = np.argsort(x, kind="stable")
    panels = figure.subplots(2, len(known), sharex=True, height_ratios=(2, 1), squeeze=False)
    for (above, below), each in zip(panels.T, known, strict=True):
        above.plot(x, each.measured, ".", color=_DOT, ms=3, label="measured")
        # Under several loads there are several curves: dots as well.
        above.plot(x[order], each.expected[order], ".", color=_LINE, ms=1.5, label="expected")
        band = 1.96 * each.error
        above.vlines(x, each.expected - band, each.expected + band, color=_LINE, alpha=0.12, lw=1,
                     label="95 %")  # fmt: skip
        above.set(ylabel=f"{each.outcome} [{SHOWN[each.outcome]}]", title=data.name)
        below.plot(x, (each.measured - each.expected) / each.error, ".", color=_DOT, ms=3)
        for level in (-1.96, 1.96):
            below.axhline(level, color="#666666", lw=1, ls="--")
        below.set(ylabel="residual / error", xlabel=f"{by} [{SHOWN[by]}]")
    panels[0, 0].legend()

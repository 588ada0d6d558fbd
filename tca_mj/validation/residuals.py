"""Figures of an identification: what was measured, what is expected, and what is left."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.tca.identify import Data, Identification
from tca_mj.tca.identify.data import SHOWN
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

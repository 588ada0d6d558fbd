"""Colours of temperatures and of TCAs, the same in every picture, and the plot of a rollout.

Matplotlib is an optional dependency: it is imported when a plot is drawn, without ``pyplot`` and
thus without a display or global state.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, Finite, Share, door, floats, require_one_of, whole, within
from tca_mj.files import write_whole
from tca_mj.machine import how_to_install

COLDEST = 25.0  # lower end of the colour map: room temperature [°C]
# Upper end of the colour map and limit in the plot [°C]: the lower annealing temperature [Sun,
# dissertation, Colorado State University, sec. 2.1]; that it bounds operation is an estimate.
HOTTEST = 180.0
BREAKING_FORCE = 0.78  # limit in the plot [N]; Sun, dissertation, sec. 2.1.1

# Stops of the temperature map at equal steps of temperature: lightness, chroma and hue [deg] in
# OKLCh. Lightness grows evenly, so that equal steps of temperature look equal, in grey as well.
_HEAT = np.array([
    [0.34, 0.16, 266.0],  # dark blue
    [0.44, 0.19, 303.0],  # violet
    [0.545, 0.20, 357.0],  # crimson
    [0.65, 0.20, 387.0],  # red
    [0.75, 0.18, 418.0],  # orange
    [0.87, 0.17, 452.0],  # yellow
])  # fmt: skip

# OKLab to linear sRGB [B. Ottosson, "A perceptual color space for image processing", 2020].
_OKLAB_TO_LMS = np.array([
    [1.0, 0.3963377774, 0.2158037573],
    [1.0, -0.1055613458, -0.0638541728],
    [1.0, -0.0894841775, -1.2914855480],
])  # fmt: skip
_LMS_TO_RGB = np.array([
    [4.0767416621, -3.3077115913, 0.2309699292],
    [-1.2684380046, 2.6097574011, -0.3413193965],
    [-0.0041960863, -0.7034186147, 1.7076147010],
])  # fmt: skip


def _srgb(lightness: ArrayLike, chroma: ArrayLike, hue: ArrayLike) -> Array:
    """sRGB in [0, 1], shape (..., 3), of OKLCh colours; what a screen cannot show is clipped."""
    angle = np.radians(hue)
    parts = np.broadcast_arrays(lightness, chroma * np.cos(angle), chroma * np.sin(angle))
    lab = np.stack(parts, axis=-1)
    linear = np.clip((lab @ _OKLAB_TO_LMS.T) ** 3 @ _LMS_TO_RGB.T, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def temperature_colour(temperature: ArrayLike) -> Array:
    """Colour of a temperature: dark blue when cold, through red, to bright yellow when hot.

    Args:
        temperature: Temperature, shape (...) [°C]; clipped to ``COLDEST`` ... ``HOTTEST``; not a
            number is drawn like ``COLDEST``.

    Returns:
        sRGB in [0, 1], shape (..., 3).

    Raises:
        ValueError: If one is no real number.
    """
    warmer = np.nan_to_num(floats("temperature", temperature), nan=COLDEST) - COLDEST
    share = np.clip(warmer / (HOTTEST - COLDEST), 0.0, 1.0)
    stops = np.linspace(0.0, 1.0, len(_HEAT))
    return _srgb(*(np.interp(share, stops, column) for column in _HEAT.T))


@door
def series_colours(
    n: Annotated[int, partial(whole, at_least=0, at_most=10_000)], *, lightness: Share = 0.62
) -> Array:
    """``n`` colours for the curves of ``n`` TCAs, neighbours far apart in hue.

    Args:
        n: Number of colours, 0 to 10 000.
        lightness: Mean OKLab lightness, 0 to 1: about 0.6 on white, 0.75 on black [1].

    Returns:
        sRGB in [0, 1], shape (n, 3).

    Raises:
        ValueError: If a number is out of bounds.
    """
    index = np.arange(n)
    hue = 255.0 + 137.50776 * index  # golden angle: no two hues ever meet
    return _srgb(lightness + 0.07 * (index % 2), 0.15, hue)


def event_rows(widths: Sequence[float], positions: Sequence[float]) -> list[int]:
    """Row of each label, 0 the lowest, so that neither labels nor lines to labels cross a label.

    A label that reaches beyond the start of later ones stands above them.

    Args:
        widths: Widths of the labels.
        positions: Where they start, in ascending order.
    """
    rows = [0] * len(widths)
    for i in reversed(range(len(widths))):
        end = positions[i] + widths[i]
        later = (rows[j] for j in range(i + 1, len(rows)) if positions[j] < end)
        rows[i] = max(later, default=-1) + 1
    return rows


@door
def rollout_plot(
    path: str | Path, time: ArrayLike, power: ArrayLike, temperature: ArrayLike, tension: ArrayLike,
    bend: ArrayLike, names: Sequence[str], events: Sequence[tuple[float, str]] = (), *,
    body: ArrayLike | None = None, title: str = "", temperature_limit: Finite | None = HOTTEST,
    tension_limit: Finite | None = BREAKING_FORCE,
) -> None:  # fmt: skip
    """Draws power, temperature, tension and bend angle of a rollout, one above the other.

    Args:
        path: Picture to write, in one go; its folder is made if it is missing.
        time: Time of the samples, shape (frames,) [s].
        power: Electrical power, shape (frames, n) [W].
        temperature: Temperature, shape (frames, n) [°C].
        tension: Tension, shape (frames, n) [N].
        bend: Bend angle of the body, shape (frames,) [deg].
        names: Names of the n TCAs.
        events: Time [s] and short text of what happened, in any order.
        body: Temperature of what the TCAs lie in, shape (frames, n) [°C], drawn dotted beside
            theirs; None, or NaN for a bare TCA, is not drawn.
        title: Title above the plot.
        temperature_limit: Temperature drawn as a limit [°C], None for no line.
        tension_limit: Tension drawn as a limit [N], None for no line.

    Raises:
        ImportError: If Matplotlib is not installed.
        OSError: If the file cannot be written.
        ValueError: If the shapes do not fit, a time is not finite, or the path's ending is that of
            no picture.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.lines import Line2D
    except ImportError as error:
        raise ImportError(f"the plot needs Matplotlib: {how_to_install('demo')}") from error

    clock = within("time", time)
    panels = [
        ("power", floats("power", power), None, "W"),
        ("temperature", floats("temperature", temperature), temperature_limit, "°C"),
        ("tension", floats("tension", tension), tension_limit, "N"),
        ("bend angle", floats("bend", bend), None, "°"),
    ]
    panels = [
        (label, np.where(np.isfinite(values), values, np.nan), limit, unit)
        for label, values, limit, unit in panels
    ]
    for label, values, _, _ in panels:
        shape = (clock.size,) if label == "bend angle" else (clock.size, len(names))
        if clock.ndim != 1 or clock.size == 0 or values.shape != shape:
            raise ValueError(f"{label} must have shape {shape}, got {values.shape}")
    warm = None if body is None else floats("body", body)
    if warm is not None and warm.shape != panels[1][1].shape:
        raise ValueError(f"body must have the shape of temperature, got {warm.shape}")

    figure = Figure(figsize=(11.0, 8.6), dpi=150, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    left, right, bottom, top = 0.075, 0.84, 0.065, 0.93 if title else 0.965
    start, end = float(clock[0]), float(clock[-1])
    span = (end - start) or 1.0
    ordered = sorted(events, key=lambda event: event[0])

    # Rows of labels: measured as drawn, then the panels take what is left.
    renderer: Any = canvas.get_renderer()
    labels = [figure.text(0.0, 0.0, word, fontsize=8.5, color="#3c4043", va="bottom")
              for _, word in ordered]  # fmt: skip
    inches = 11.0 * (right - left)
    widths = [each.get_window_extent(renderer).width / figure.dpi + 0.12 for each in labels]
    anchors = [
        min((at - start) / span * inches, max(0.0, inches + 1.7 - width))
        for (at, _), width in zip(ordered, widths, strict=True)
    ]
    rows = event_rows(widths, anchors)
    header = 0.024 * (max(rows, default=-1) + 1) + (0.008 if rows else 0.0)

    grid = {"left": left, "right": right, "bottom": bottom, "top": top - header, "hspace": 0.12}
    axes: Any = figure.subplots(4, 1, sharex=True, gridspec_kw=grid)
    colours = series_colours(len(names), lightness=0.57)
    lines: list[Any] = []
    for axis, (label, values, limit, unit) in zip(axes, panels, strict=True):
        axis.set_facecolor("#fbfbfc")
        axis.grid(axis="y", color="#e3e5e8", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.set_ylabel(f"{label} [{unit}]", fontsize=10)
        axis.yaxis.set_label_coords(-0.062, 0.5)
        axis.tick_params(labelsize=9, length=3, color="#9aa0a6", labelbottom=axis is axes[-1])
        axis.spines[["top", "right"]].set_visible(False)
        axis.spines[["left", "bottom"]].set_color("#9aa0a6")
        if values.ndim == 1:
            axis.plot(clock, values, color="#30343a", linewidth=1.8)
            axis.axhline(0.0, color="#9aa0a6", linewidth=0.7, zorder=1)
        else:
            axis.set_prop_cycle(color=colours)
            drawn = axis.plot(clock, values, linewidth=1.6)
            lines = lines or drawn
            if warm is not None and label == "temperature":
                axis.plot(clock, warm, linewidth=1.3, linestyle=":")
                axis.annotate("dotted: the body that a TCA lies in", (0.0, 0.0), (6, 3),
                              "axes fraction", "offset points", color="#5f6368",
                              fontsize=8)  # fmt: skip
            axis.set_ylim(bottom=min(0.0, float(np.nanmin(values, initial=0.0))))
        if limit is not None:
            axis.axhline(limit, color="#c5221f", linewidth=1.1, linestyle=(0, (5, 3)))
            low, high = axis.get_ylim()
            axis.set_ylim(low, max(high, limit + 0.12 * (limit - low)))
            axis.annotate(f"limit {limit:g} {unit}", (1.0, limit), (-6, 2),
                          ("axes fraction", "data"), "offset points", color="#c5221f", fontsize=9,
                          ha="right", va="bottom")  # fmt: skip
    axes[-1].set_xlabel("time [s]", fontsize=10)
    axes[0].set_xlim(start, start + span)

    # Phases between two events are shaded in turn; a thin line leads from each event to its label.
    marks = [at for at, _ in ordered]
    for i, (at, until) in enumerate(zip(marks, [*marks[1:], end], strict=False)):
        for axis in axes:
            axis.axvline(at, color="#9aa0a6", linewidth=0.7, zorder=1)
            if i % 2 == 0 and until > at:
                axis.axvspan(at, until, color="#eceff4", linewidth=0.0, zorder=0)
    for at, text, anchor, row in zip(marks, labels, anchors, rows, strict=True):
        x, y = left + (at - start) / span * (right - left), top - header + 0.008 + 0.024 * row
        figure.add_artist(
            Line2D([x, x], [top - header, y + 0.016], color="#9aa0a6", linewidth=0.7))
        text.set_position((left + anchor / 11.0 + 0.004, y))

    if lines:
        figure.legend(lines, list(names), loc="upper left", title="TCA", alignment="left",
                      bbox_to_anchor=(right + 0.012, top - header), fontsize=9, title_fontsize=9,
                      frameon=False, handlelength=1.6, borderaxespad=0.0)  # fmt: skip
    if title:
        figure.text(left, 0.967, title, fontsize=13, color="#202124", va="center")
    save_figure(figure, Path(path))


def save_figure(figure: Any, path: Path, **more: Any) -> None:
    """Writes a figure of Matplotlib's in one go; its format is the ending of the path."""
    memory = io.BytesIO()
    known = list(figure.canvas.get_supported_filetypes())
    form = require_one_of("ending of path", path.suffix[1:] or "png", known)
    figure.savefig(memory, format=form, **more)
    write_whole(path, memory.getvalue())

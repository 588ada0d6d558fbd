"""Figures of the validation report, of the same kind as those of Sun's Chapters 2 and 3.

No measured curves are published, so that none are drawn: single published numbers are crosses.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.machine import how_to_install
from tca_mj.record.plots import save_figure, temperature_colour
from tca_mj.tca import CATALOGUE, Load, hanging_length, softening, untwist
from tca_mj.validation import drag, lifting, sensors, strokes, theories
from tca_mj.validation.creeping import experiment, four_lengths
from tca_mj.validation.race import race
from tca_mj.validation.strokes import heat_up, weight

_BLUE, _SKY, _GREEN, _ORANGE, _VIOLET = "#0072b2", "#56b4e9", "#009e73", "#d55e00", "#8a4fa3"
_COLOURS = (_BLUE, _ORANGE, _GREEN, _VIOLET, _SKY)
_SHADES = {theory.name: shade for theory, shade in zip(
    (theories.ROD, theories.CST, theories.LOVE), (_BLUE, _GREEN, _ORANGE), strict=True)}
_HOT = np.linspace(25.0, 180.0, 156)  # [°C]
_DATA_END = 160.0  # upper end of the measurements behind expansion and softening [°C]
_SPRING = 10.0  # stiffness of case 2, not published: an estimate [N/m]
_STYLE: Any = {"lines.linewidth": 2.0, "legend.fontsize": 8, "legend.frameon": False,
               "axes.titlesize": 10, "axes.spines.top": False}  # fmt: skip
_MOVED = {"xlabel": "time [s]", "ylabel": "displacement [mm]"}


def _curves(
    axis: Any, x: ArrayLike, curves: Mapping[str, ArrayLike], shades: Sequence[str] = _COLOURS,
    **look: Any,
) -> None:  # fmt: skip
    """Draws named curves over the same x, in the common colours."""
    for (name, y), shade in zip(curves.items(), shades, strict=False):
        axis.plot(x, y, color=shade, label=name, **look)


def _two(axis: Any, x: ArrayLike, curves: Mapping[str, ArrayLike]) -> None:
    """Draws a curve to the left axis, and one to the right, each in the colour of its label."""
    for panel, (label, y), shade in zip(
        (axis, axis.twinx()), curves.items(), (_BLUE, _ORANGE), strict=True
    ):
        panel.plot(x, y, color=shade)
        panel.set_ylabel(label, color=shade)


def _limit(
    axis: Any, height: float, x: float = 0.0, word: str = "", gap: float = 0.0, side: str = "top"
) -> None:
    """A level, and so far above it what it is."""
    axis.axhline(height, color="#666666", lw=1, ls="--")
    if word:
        axis.text(x, height + gap, word, fontsize=8, va=side)


def _heated(axis: Any, end: float = 180.0, **labels: Any) -> None:
    """The axis of temperatures up to an end [°C]; grey beyond the data."""
    axis.set(xlabel="temperature [°C]", xlim=(25, end), **labels)
    _beyond(axis, _DATA_END, end)


def _beyond(axis: Any, start: float, end: float) -> None:
    axis.axvspan(start, end, color="#ececec", zorder=0)


def strokes_figure(figure: Any) -> None:
    """Displacement and length over temperature of two types, and the race of four; as Fig. 2.5."""
    ((a, b), (c, d)), run = figure.subplots(2, 2), race()
    styles = {0: ":", 20: "--", 40: "-"}
    for axis, name, shade in ((b, "type-0-180", _BLUE), (c, "type-1-180", _ORANGE)):
        tca = CATALOGUE[name]
        for k, grams in enumerate((0, 10, 20, 30, 40, 50)):
            length = 1e3 * hanging_length(tca, _HOT, weight(grams))
            axis.plot(_HOT, length, color=temperature_colour(25.0 + 26.0 * k), label=f"{grams} g")
            if grams in styles:
                a.plot(_HOT, length[0] - length, styles[grams], color=shade,
                       label=f"{name[:6]}, {grams} g")  # fmt: skip
            if (name, grams) in strokes.CONTRACTIONS:
                at = 150.0, strokes.CONTRACTIONS[name, grams]
                a.plot(*at, "x", color=shade, ms=9, mew=2.5)
                a.annotate(f"{grams} g", at, (8, 3), textcoords="offset points", fontsize=8,
                           color=shade)  # fmt: skip
        # Below and above: the two lines of type 0 are close to each other.
        _limit(axis, 1e3 * tca.rest_length, 27.0, "natural", 1.0, "bottom")
        _limit(axis, 1e3 * tca.minimum_length, 27.0, "coils touch", -1.0)
        _heated(axis, ylabel="length [mm]", title=f"{name}, 0 to 50 g", ylim=(45, 170))
    a.plot([], [], "x", color="#555555", ms=8, mew=2.5, label="published")
    _heated(a, ylabel="displacement [mm]", title="two types, three weights")
    for (name, moved), shade in zip(run.displacement.items(), _COLOURS, strict=False):
        d.plot(run.time, moved, "--" if name.endswith("200") else "-", color=shade, label=name)
    d.set(**_MOVED, xlim=(0, 2), title="20 g, 1 A for 2 s")
    for axis in (a, d):
        axis.legend()
    b.legend(ncols=2, loc="upper right")


def creep_figure(figure: Any) -> None:
    """Temporary length of type 1-180; as Fig. 2.7."""
    axis, found = figure.subplots(), experiment()
    axis.plot(found.time, found.length, color=_BLUE)
    lengths = four_lengths(CATALOGUE["type-1-180"], "locked")
    for k, (value, at) in enumerate(zip(lengths, (60, 270, 474, 690), strict=True), start=1):
        axis.annotate(f"$l_{k}$ = {value:.1f} mm", (at, value), (0, 6), fontsize=9, ha="center",
                      textcoords="offset points")  # fmt: skip
    for time, word in found.events:
        if word in ("20 g", "heated", "unloaded"):
            axis.axvline(time, color="#999999", lw=1, ls=":")
            axis.text(time + 4, 63, word, fontsize=9, rotation=90, va="bottom")
    axis.set(xlabel="time [s]", ylabel="length [mm]", ylim=(62, 130), xlim=(0, found.time[-1]),
             title="type-1-180, ends glued: loaded, heated once, unloaded, heated again")


def drag_figure(figure: Any) -> None:
    """A weight dragged against friction, and five TCAs with a kettle; as Fig. 2.3c."""
    left, right = figure.subplots(1, 2)
    tca = CATALOGUE[drag.NAME]
    pull, way, end = drag.pull_of(tca), np.linspace(0.0, 0.066, 67), 0.48e3 * tca.rest_length
    _curves(left, 1e3 * way, {f"{hot:.0f} °C": [pull(tca.rest_length - x, hot) for x in way]
                              for hot in (130.0, drag.DATA, drag.ANNEALED, 240.0)})  # fmt: skip
    _limit(left, drag.FRICTION, 1.0, "friction", -0.015)
    left.axvline(end, color="#999999", lw=1, ls=":")
    left.text(end - 0.6, 0.02, "48 %", fontsize=8, ha="right")
    left.set(xlabel="way [mm]", ylabel="pull [N]", xlim=(0, 66), ylim=(0, 0.9),
             title=f"one {drag.NAME}")  # fmt: skip
    left.legend(loc="upper right")
    for count, style, shade, word in ((1, "-", _BLUE, "one, 0.4 N, 0.4 kg"),
                                      (drag.KETTLE[1], "--", _ORANGE, "five, 2 N, 2 kg")):
        run = drag.study(240.0, count)
        rising = run.temperature < 240.0
        right.plot(run.temperature[rising], 1e3 * run.moved[rising], style, color=shade, label=word)
    _heated(right, 240.0, ylabel="way [mm]", ylim=(0, 66),
            title="heated by 50 K/s; grey: beyond the data")  # fmt: skip
    right.legend(loc="upper left")


def sensing_figure(figure: Any) -> None:
    """Resistance over length, displacement, force, and the cubic; as Figs. 2.10 to 2.12."""
    ((a, b), (c, d)), curves = figure.subplots(2, 2), sensors.curves()
    for axis, way, title in ((a, "length", "heated at 12 V, over the length"),
                             (b, "displacement", "the same over the displacement")):
        for (grams, curve), shade in zip(curves.items(), _COLOURS, strict=True):
            axis.plot(1e3 * getattr(curve, way), curve.ohms, color=shade, label=f"{grams} g")
        axis.set(xlabel=f"{way} [mm]", ylabel="resistance [ohm]", title=title)
    forces = weight(1.0) * np.linspace(0.0, 50.0, 101)
    _two(c, forces, {"resistance [ohm]": sensors.stretched(forces),
                     "length [mm]": 1e3 * hanging_length(sensors.SENSED, 25.0, forces)})
    c.set(xlabel="force [N]", xlim=(0, 0.5), title="cold: resistance (blue) and length (orange)")
    for load, shade in ((20, _BLUE), (40, _ORANGE)):
        fit, ohms = sensors.cubic(curves[load], 0)
        d.plot(ohms, 1e3 * curves[load].displacement, ".", color=shade, ms=4, alpha=0.5)
        line = np.linspace(fit.lowest, fit.highest, 100)
        d.plot(line, 1e3 * fit.displacement(line), color=shade,
               label=f"{load} g, cubic, RMSE {1e3 * fit.rmse:.2f} mm")  # fmt: skip
    d.set(xlabel="measured resistance [ohm]", ylabel="displacement [mm]",
          title="one measurement and its cubic")  # fmt: skip
    for axis in (a, b, d):
        axis.legend()


def fibre_figure(figure: Any) -> None:
    """Untwist, and the shear modulus over heat and load; as Figs. 3.2 c and 3.4."""
    left, right = figure.subplots(1, 2)
    tca = CATALOGUE["free-stroke-made"]
    stiff = 1e-9 * tca.fibre.shear
    left.plot(_HOT, untwist(tca.fibre, _HOT), color=_BLUE)
    _heated(left, ylabel="untwist [rad/m]", title="untwist of the twisted fibre")
    _curves(right, _HOT, {
        f"{grams} g": stiff * softening(tca.fibre, _HOT, theories.load_torsion(tca, grams))
        for grams in (0, 15, 30, 45, 60)
    })  # fmt: skip
    _limit(right, 0.87 * stiff, 30.0, "13 % less", -0.0015)
    _heated(right, ylabel="shear modulus G [GPa]", title="free-stroke TCA under a weight")
    right.legend(loc="lower left", bbox_to_anchor=(0.0, 0.02))


def statics_figure(figure: Any) -> None:
    """Length under three weights in the rod model, and the others' distance; as Fig. 3.9."""
    at = theories.TEMPERATURES
    for row, (name, weights) in zip(figure.subplots(2, 3), theories.CASES.items(), strict=True):
        tca, rod = CATALOGUE[name], row[0]
        for axis, theory in zip(row[1:], (theories.CST, theories.LOVE), strict=True):
            for grams, shade in zip(weights, _COLOURS, strict=False):
                axis.plot(at, theories.distances(tca, grams, theory), color=shade)
                if theory is theories.CST:
                    path = theories.distances(tca, grams, theories.PATH)
                    axis.plot(at, path, "--", color=shade, lw=1.5)
            axis.set(ylim=(-25, 42), ylabel="distance from the rod [%]",
                     title=f"{name}: {theory.name}")  # fmt: skip
            axis.axhline(0.0, color="#666666", lw=1)
        _curves(rod, at, {f"{g} g": 1e3 * hanging_length(tca, at, weight(g)) for g in weights})
        rod.set(ylabel="length [mm]", title=f"{name}: rod")
        for axis in row:
            axis.set(xlabel="temperature [°C]", xlim=(25, 160))
        rod.legend(ncols=3, loc="lower left")
        rod.set_ylim(bottom=rod.get_ylim()[0] - 5.0)


def spring_figure(figure: Any) -> None:
    """A TCA that pulls on a spring, 5 V from a pretension of 0.05 N; as Fig. 3.10."""
    left, right = figure.subplots(1, 2)
    free = theories.crept_free_stroke(0)
    for theory in (theories.ROD, theories.CST, theories.LOVE):
        start = float(hanging_length(free, 25.0, 0.05, **theory.settings))  # type: ignore[arg-type]
        tcas = theories.lifting(0, theory, load=Load.spring(_SPRING, 0.05, start))
        course = heat_up(tcas, "voltage", 5.0, 0.02, 200)
        moved = start - course.length[:, 0]
        right.plot(course.time, 1e3 * moved, color=_SHADES[theory.name], label=theory.name)
        if theory is theories.ROD:
            _two(left, course.time, {"force [N]": 0.05 + _SPRING * moved,
                                     "temperature [°C]": course.temperature[:, 0]})
    left.set(xlabel="time [s]", xlim=(0, 4), title="rod: force and temperature")
    right.set(**_MOVED, xlim=(0, 4), title=f"against a spring of {_SPRING:g} N/m (an estimate)")
    right.legend(loc="lower right")


def dynamics_figure(figure: Any) -> None:
    """A voltage lifts a weight, three models, four cases; as Fig. 3.11."""
    panels = figure.subplot_mosaic([["0", "1", "bars"], ["2", "3", "bars"]])
    lifts, bars = theories.lifts(dt=0.01), panels["bars"]
    top = max(float(moved.max()) for lift in lifts.values() for moved in lift.displacement.values())
    for k, ((volts, grams), lift) in enumerate(lifts.items()):
        axis = panels[str(k)]
        _curves(axis, lift.time, lift.displacement, tuple(_SHADES.values()))
        late = lift.time[lift.temperature > _DATA_END]
        if late.size:
            _beyond(axis, float(late[0]), float(lift.time[-1]))
        axis.set(**_MOVED, xlim=(0, lift.time[-1]), ylim=(0, 1.05 * top),
                 title=f"{volts:g} V, {grams} g")  # fmt: skip
        for j, (name, error) in enumerate(lift.distances.items()):
            bars.bar(k + 0.36 * (j - 0.5), 100.0 * error, 0.34, color=_SHADES[name],
                     label=name if k == 0 else None)  # fmt: skip
    bars.set(ylabel="largest distance from the rod [%]", title="up to 160 °C")
    bars.set_xticks(range(len(lifts)), [f"{volts:g} V\n{grams} g" for volts, grams in lifts])
    panels["0"].legend(loc="upper left")
    bars.legend()


def cone_figure(figure: Any) -> None:
    """Shapes of the conical TCA, and heights over temperature; as Fig. 3.12."""
    (left, right), found = figure.subplots(1, 2, width_ratios=(1.5, 1.0)), theories.cone()
    for k, hot in enumerate((25, 55, 70, 85, 100, 115, 130)):
        shape, colour, shift = theories.heated_cone(hot), temperature_colour(hot), 27.0 * k
        x = 1e3 * (shape.position[:, 0] - shape.position[0, 0]) + shift
        z, depth = theories.heights(shape), shape.position[:, 1]
        front = depth < np.median(depth)
        left.plot(x, z, color=colour, lw=1.0, alpha=0.55)
        left.plot(np.where(front, x, np.nan), np.where(front, z, np.nan), color=colour, lw=2.2)
        left.plot(x[0], 0.0, "^", color=_BLUE, ms=8, zorder=3)
        left.plot(x[-1], z[-1], "o", color="#d00000", ms=6, zorder=3)
        left.text(shift, 65.0, f"{hot} °C", ha="center", fontsize=9)
    left.set(xticks=[], ylabel="height above the clamp [mm]", ylim=(-78, 75), aspect="equal",
             xlabel="from the side; triangle: clamped end, circle: free end")  # fmt: skip
    at = found.temperature
    right.fill_between(at, found.lowest, found.highest, color="#dfe7ee",
                       label="lowest to highest point")  # fmt: skip
    right.plot(at, found.end, color="#d00000", label="free end")
    right.axhline(0.0, color=_BLUE, lw=1)
    right.set(xlabel="temperature [°C]", ylabel="height above the clamp [mm]", xlim=(25, 160),
              ylim=(-92, 72))  # fmt: skip
    right.legend(loc="lower left")


def control_figure(figure: Any) -> None:
    """Step responses, power, and what it does with 20 and 40 g; as Figs. 2.13 and 2.14."""
    axes = a, b, c, d, e, f = figure.subplots(2, 3).ravel()
    integral, proportional, blown = (lifting.over_integral(), lifting.over_proportional(),
                                     lifting.in_blown_air())  # fmt: skip
    for axis, run, symbol, gains, title in (
        (a, integral, "$K_I$", lifting.INTEGRALS, "20 g, $K_P$ = 10"),
        (b, proportional, "$K_P$", lifting.PROPORTIONALS, "40 g, $K_I$ = 0.02"),
        (c, blown, "$K_I$", (0.0, 0.015), "20 g, air is blown (grey)"),
    ):
        names = [f"{symbol} = {gain:g}" for gain in gains]
        _curves(axis, run.time, dict(zip(names, run.displacement.T, strict=True)), lw=1.5)
        axis.set_title(title)
        if run is proportional:
            _curves(d, run.time, dict(zip(names, run.power.T, strict=True)), lw=1)
    _beyond(c, lifting.AIR_AT, blown.time[-1])
    d.set(title="power, 40 g", ylabel="power [W]", xlim=(0, 5), xlabel="time [s]")
    for grams, shade in ((20, _BLUE), (40, _ORANGE)):
        felt, answer = lifting.felt(lifting.hung(grams)), lifting.answer(grams)
        time = lifting.PERIOD * np.arange(1, len(felt) + 1)
        e.plot(time, felt, color=shade, lw=1.2, label=f"{grams} g")
        f.plot(answer.time, answer.displacement, color=shade, lw=1.5, label=f"{grams} g")
    e.set(title="cold, a weight is hung at 1 s", ylabel="sensed resistance [ohm]",
          xlabel="time [s]", xlim=(0, 4))  # fmt: skip
    f.set_title("and is lifted: twice 20 mm, or 40 mm")
    for axis in (a, b, c, f):
        _limit(axis, lifting.GOAL)
        axis.set(**_MOVED, ylim=(0, 75), xlim=(0, axis.get_lines()[0].get_xdata()[-1]))
    a.set_ylim(0, 1.05 * float(integral.displacement.max()))
    f.set_ylim(0, 50)
    for axis in axes:
        axis.legend(loc="lower right" if axis in (c, f) else "best")


def need_matplotlib() -> None:
    """Raises ImportError with what to do about it if Matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise ImportError(f"the figures need Matplotlib: {how_to_install('demo')}")


def draw(path: Path, width: float, height: float, fill: Callable[[Any], None]) -> None:
    """Draws one figure in the common style.

    Args:
        path: Picture to write; its folder exists.
        width: Width [inches].
        height: Height [inches].
        fill: Draws into the empty figure.

    Raises:
        ImportError: If Matplotlib is not installed.
    """
    need_matplotlib()
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    with rc_context(_STYLE):
        fill(figure)
    for axis in figure.axes:
        if str(axis.yaxis.get_label_position()) == "left":
            axis.grid(color="#e6e6e6")
            axis.set_axisbelow(True)
            axis.spines["right"].set_visible(False)
    save_figure(figure, path, dpi=110)

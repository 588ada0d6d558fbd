"""Figures of the validation report, of the same kind as those of Sun's Chapters 2 and 3.

No measured curves are published, so that none are drawn: single published numbers are crosses.
"""

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.record.plots import temperature_colour
from tca_mj.tca import CATALOGUE, Load, LoadedTcas, hanging_length, softening, untwist
from tca_mj.validation import drag, lifting, sensors, strokes, theories
from tca_mj.validation.creeping import experiment, four_lengths
from tca_mj.validation.race import race
from tca_mj.validation.strokes import heat_up, weight

_BLUE, _SKY, _GREEN, _ORANGE, _VIOLET = "#0072b2", "#56b4e9", "#009e73", "#d55e00", "#8a4fa3"
_COLOURS = (_BLUE, _ORANGE, _GREEN, _VIOLET, _SKY)
_SHADES = {theories.ROD: _BLUE, theories.CST: _GREEN, theories.LOVE: _ORANGE}
_GREY = "#ececec"
_DATA_END = 160.0  # upper end of the measurements behind expansion and softening [°C]
_SPRING = 10.0  # stiffness of case 2, not published: an estimate [N/m]


def _curves(
    axis: Any, x: ArrayLike, curves: Mapping[str, ArrayLike], lw: float = 2
) -> None:
    """Draws named curves over the same x, in the common colours."""
    for (name, y), colour in zip(curves.items(), _COLOURS, strict=False):
        axis.plot(x, y, color=colour, lw=lw, label=name)


def _limit(axis: Any, height: float) -> None:
    axis.axhline(height, color="#666666", lw=1, ls="--")


def strokes_figure(figure: Any) -> None:
    """Displacement and length over temperature of two types, and the race of four; as Fig. 2.5."""
    ((a, b), (c, d)), run = figure.subplots(2, 2), race()
    hot = np.linspace(25.0, 180.0, 156)
    for name, shade in (("type-0-180", _BLUE), ("type-1-180", _ORANGE)):
        for grams, style in ((0, ":"), (20, "--"), (40, "-")):
            length = hanging_length(CATALOGUE[name], hot, weight(grams))
            a.plot(hot, 1e3 * (length[0] - length), style, color=shade, lw=2,
                   label=f"{name[:6]}, {grams} g")  # fmt: skip
            printed = strokes.CONTRACTIONS.get((name, grams))
            if printed is not None:
                a.plot(150.0, printed, "x", color=shade, ms=9, mew=2.5)
                a.annotate(f"{grams} g", (150.0, printed), (8, 3), textcoords="offset points",
                           fontsize=8, color=shade)  # fmt: skip
    a.plot([], [], "x", color="#555555", ms=8, mew=2.5, label="published")
    a.set(ylabel="displacement [mm]", title="two types, three weights")
    for axis, name in ((b, "type-0-180"), (c, "type-1-180")):
        tca = CATALOGUE[name]
        for k, grams in enumerate((0, 10, 20, 30, 40, 50)):
            length = hanging_length(tca, hot, weight(grams))
            axis.plot(hot, 1e3 * length, color=temperature_colour(25.0 + 26.0 * k), lw=2,
                      label=f"{grams} g")  # fmt: skip
        # Below and above: the two lines of type 0 are close to each other.
        for height, word, gap, side in ((tca.rest_length, "natural", 1.0, "bottom"),
                                        (tca.minimum_length, "coils touch", -1.0, "top")):
            _limit(axis, 1e3 * height)
            axis.text(27, 1e3 * height + gap, word, fontsize=8, va=side)
        axis.set(ylabel="length [mm]", title=f"{name}, 0 to 50 g", ylim=(45, 170))
    for axis in (a, b, c):
        axis.set(xlabel="temperature [°C]", xlim=(25, 180))
        axis.axvspan(_DATA_END, 180, color=_GREY, zorder=0)
    for (name, moved), colour in zip(run.displacement.items(), _COLOURS, strict=False):
        style = "--" if name.endswith("200") else "-"
        d.plot(run.time, moved, style, color=colour, lw=2, label=name)
    d.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(0, 2), title="20 g, 1 A for 2 s")
    for axis in (a, d):
        axis.legend(fontsize=8, frameon=False)
    b.legend(fontsize=8, frameon=False, ncols=2, loc="upper right")


def creep_figure(figure: Any) -> None:
    """Temporary length of type 1-180; as Fig. 2.7."""
    axis, found = figure.subplots(), experiment()
    axis.plot(found.time, found.length, color=_BLUE, lw=2)
    l1, l2, l3, l4 = four_lengths(CATALOGUE["type-1-180"], "locked")
    for k, (value, at) in enumerate(((l1, 60), (l2, 270), (l3, 474), (l4, 690)), start=1):
        axis.annotate(f"$l_{k}$ = {value:.1f} mm", (at, value), (0, 6), fontsize=9, ha="center",
                      textcoords="offset points")  # fmt: skip
    for time, word in found.events:
        if word in ("20 g", "heated", "unloaded"):
            axis.axvline(time, color="#999999", lw=1, ls=":")
            axis.text(time + 4, 63, word, fontsize=9, rotation=90, va="bottom")
    axis.set(xlabel="time [s]", ylabel="length [mm]", ylim=(62, 130), xlim=(0, found.time[-1]))
    axis.set_title("type-1-180, ends glued: loaded, heated once, unloaded, heated again")


def drag_figure(figure: Any) -> None:
    """A weight dragged against friction, and five TCAs with a kettle; as Fig. 2.3c."""
    left, right = figure.subplots(1, 2)
    tca = CATALOGUE[drag.NAME]
    pull, way = drag.pull_of(tca), np.linspace(0.0, 0.066, 67)
    _curves(left, 1e3 * way, {f"{hot:.0f} °C": [pull(tca.rest_length - x, hot) for x in way]
                              for hot in (130.0, drag.DATA, drag.ANNEALED, 240.0)})  # fmt: skip
    _limit(left, drag.FRICTION)
    left.text(1.0, drag.FRICTION - 0.015, "friction", fontsize=8, va="top")
    left.axvline(0.48e3 * tca.rest_length, color="#999999", lw=1, ls=":")
    left.text(0.48e3 * tca.rest_length - 0.6, 0.02, "48 %", fontsize=8, ha="right")
    left.set(xlabel="way [mm]", ylabel="pull [N]", xlim=(0, 66), ylim=(0, 0.9),
             title=f"one {drag.NAME}")  # fmt: skip
    left.legend(fontsize=8, frameon=False, loc="upper right")
    one, five = (drag.study(240.0, count) for count in (1, drag.KETTLE[1]))
    rising = one.temperature < 240.0
    for run, style, colour, word in ((one, "-", _BLUE, "one, 0.4 N, 0.4 kg"),
                                     (five, "--", _ORANGE, "five, 2 N, 2 kg")):
        right.plot(run.temperature[rising], 1e3 * run.moved[rising], style, color=colour, lw=2,
                   label=word)  # fmt: skip
    right.axvspan(_DATA_END, 240, color=_GREY, zorder=0)
    right.set(xlabel="temperature [°C]", ylabel="way [mm]", xlim=(25, 240), ylim=(0, 66),
              title="heated by 50 K/s; grey: beyond the data")  # fmt: skip
    right.legend(fontsize=8, frameon=False, loc="upper left")


def sensing_figure(figure: Any) -> None:
    """Resistance over length, displacement, force, and the cubic; as Figs. 2.10 to 2.12."""
    ((a, b), (c, d)), curves = figure.subplots(2, 2), sensors.curves()
    for axis, way, title in ((a, "length", "heated at 12 V, over the length"),
                             (b, "displacement", "the same over the displacement")):
        for (grams, curve), colour in zip(curves.items(), _COLOURS, strict=True):
            axis.plot(1e3 * getattr(curve, way), curve.ohms, color=colour, lw=2, label=f"{grams} g")
        axis.set(xlabel=f"{way} [mm]", title=title)
    forces = weight(1.0) * np.linspace(0.0, 50.0, 101)
    c.plot(forces, sensors.stretched(forces), color=_BLUE, lw=2)
    c.set(xlabel="force [N]", xlim=(0, 0.5), title="cold: resistance (blue) and length (orange)")
    c.yaxis.label.set_color(_BLUE)
    twin = c.twinx()
    twin.plot(forces, 1e3 * hanging_length(sensors.SENSED, 25.0, forces), color=_ORANGE, lw=2)
    twin.set_ylabel("length [mm]", color=_ORANGE)
    for load, colour in ((20, _BLUE), (40, _ORANGE)):
        fit, ohms = sensors.cubic(curves[load], 0)
        d.plot(ohms, 1e3 * curves[load].displacement, ".", color=colour, ms=4, alpha=0.5)
        line = np.linspace(fit.lowest, fit.highest, 100)
        d.plot(line, 1e3 * fit.displacement(line), color=colour, lw=2,
               label=f"{load} g, cubic, RMSE {1e3 * fit.rmse:.2f} mm")  # fmt: skip
    d.set(xlabel="measured resistance [ohm]", ylabel="displacement [mm]",
          title="one measurement and its cubic")  # fmt: skip
    for axis in (a, b, c):
        axis.set_ylabel("resistance [ohm]")
    for axis in (a, b, d):
        axis.legend(fontsize=8, frameon=False)


def fibre_figure(figure: Any) -> None:
    """Untwist, and the shear modulus over heat and load; as Figs. 3.2 c and 3.4."""
    left, right = figure.subplots(1, 2)
    tca = CATALOGUE["free-stroke-made"]
    hot = np.linspace(25.0, 180.0, 156)
    left.plot(hot, untwist(tca.fibre, hot), color=_BLUE, lw=2)
    left.set(ylabel="untwist [rad/m]", title="untwist of the twisted fibre")
    stiff = 1e-9 * tca.fibre.shear
    _curves(right, hot, {
        f"{grams} g": stiff * softening(tca.fibre, hot, theories.load_torsion(tca, grams))
        for grams in (0, 15, 30, 45, 60)
    })  # fmt: skip
    low = 0.87 * stiff
    _limit(right, low)
    right.text(30, low - 0.0015, "13 % less", fontsize=8, va="top")
    right.set(ylabel="shear modulus G [GPa]", title="free-stroke TCA under a weight")
    right.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 0.02))
    for axis in (left, right):
        axis.set(xlabel="temperature [°C]", xlim=(25, 180))
        axis.axvspan(_DATA_END, 180, color=_GREY, zorder=0)


def statics_figure(figure: Any) -> None:
    """Length under three weights in the rod model, and the others' distance; as Fig. 3.9."""
    axes = figure.subplots(2, 3)
    at = theories.TEMPERATURES
    for row, (name, weights) in zip(axes, theories.CASES.items(), strict=True):
        tca = CATALOGUE[name]
        lengths = {f"{grams} g": 1e3 * hanging_length(tca, at, weight(grams)) for grams in weights}
        _curves(row[0], at, lengths)
        row[0].set(ylabel="length [mm]", title=f"{name}: rod")
        for axis, theory in zip(row[1:], (theories.CST, theories.LOVE), strict=True):
            for grams, colour in zip(weights, _COLOURS, strict=False):
                axis.plot(at, theories.distances(tca, grams, theory), color=colour, lw=2)
                if theory is theories.CST:
                    path = theories.distances(tca, grams, theories.PATH)
                    axis.plot(at, path, "--", color=colour, lw=1.5)
            axis.set(ylim=(-25, 42), ylabel="distance from the rod [%]")
            axis.set(title=f"{name}: {theory.name}")
            axis.axhline(0.0, color="#666666", lw=1)
        for axis in row:
            axis.set(xlabel="temperature [°C]", xlim=(25, 160))
        row[0].legend(fontsize=8, frameon=False, ncols=3, loc="lower left")
        row[0].set_ylim(bottom=row[0].get_ylim()[0] - 5.0)


def spring_figure(figure: Any) -> None:
    """A TCA that pulls on a spring, 5 V from a pretension of 0.05 N; as Fig. 3.10."""
    left, right = figure.subplots(1, 2)
    free = theories.crept_free_stroke(0)
    twin = left.twinx()
    for theory, colour in _SHADES.items():
        tcas = theories.lifting(0, theory)
        start = float(hanging_length(free, 25.0, 0.05, **theory.settings))  # type: ignore[arg-type]
        load = Load.spring(_SPRING, 0.05, start)
        tcas = LoadedTcas(tcas.specs, load, law=theories.law_of(tcas.specs[0], theory))
        course = heat_up(tcas, "voltage", 5.0, 0.02, 200)
        moved = start - course.length[:, 0]
        right.plot(course.time, 1e3 * moved, color=colour, lw=2, label=theory.name)
        if theory is theories.ROD:
            left.plot(course.time, 0.05 + _SPRING * moved, color=_BLUE, lw=2)
            twin.plot(course.time, course.temperature[:, 0], color=_ORANGE, lw=2)
    left.set(xlabel="time [s]", xlim=(0, 4), title="rod: force and temperature")
    left.set_ylabel("force [N]", color=_BLUE)
    twin.set_ylabel("temperature [°C]", color=_ORANGE)
    right.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(0, 4),
              title=f"against a spring of {_SPRING:g} N/m (an estimate)")  # fmt: skip
    right.legend(fontsize=8, frameon=False, loc="lower right")


def dynamics_figure(figure: Any) -> None:
    """A voltage lifts a weight, three models, four cases; as Fig. 3.11."""
    panels = figure.subplot_mosaic([["0", "1", "bars"], ["2", "3", "bars"]])
    lifts = theories.lifts(dt=0.01)
    colours = {theory.name: colour for theory, colour in _SHADES.items()}
    top = max(float(moved.max()) for lift in lifts.values() for moved in lift.displacement.values())
    for k, ((volts, grams), lift) in enumerate(lifts.items()):
        axis = panels[str(k)]
        for name, moved in lift.displacement.items():
            axis.plot(lift.time, moved, color=colours[name], lw=2, label=name)
        late = lift.time[lift.temperature > _DATA_END]
        if late.size:
            axis.axvspan(float(late[0]), float(lift.time[-1]), color=_GREY, zorder=0)
        axis.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(0, lift.time[-1]),
                 ylim=(0, 1.05 * top), title=f"{volts:g} V, {grams} g")  # fmt: skip
        known = lift.temperature <= _DATA_END
        rod, *others = (lift.displacement[name][known] for name in colours)
        for j, (name, moved) in enumerate(zip([*colours][1:], others, strict=True)):
            error = 100.0 * np.abs(moved - rod).max() / rod.max()
            panels["bars"].bar(k + 0.36 * (j - 0.5), error, 0.34, color=colours[name],
                               label=name if k == 0 else None)  # fmt: skip
    panels["0"].legend(fontsize=8, frameon=False, loc="upper left")
    panels["bars"].set(xticks=range(len(lifts)), ylabel="largest distance from the rod [%]",
                       title="up to 160 °C")  # fmt: skip
    panels["bars"].set_xticklabels([f"{volts:g} V\n{grams} g" for volts, grams in lifts])
    panels["bars"].legend(fontsize=8, frameon=False)


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
    left.set(xticks=[], ylabel="height above the clamp [mm]", ylim=(-78, 75), aspect="equal")
    left.set_xlabel("from the side; triangle: clamped end, circle: free end")
    at = found.temperature
    right.fill_between(at, found.lowest, found.highest, color="#dfe7ee",
                       label="lowest to highest point")  # fmt: skip
    right.plot(at, found.end, color="#d00000", lw=2, label="free end")
    right.axhline(0.0, color=_BLUE, lw=1)
    right.set(xlabel="temperature [°C]", ylabel="height above the clamp [mm]", xlim=(25, 160),
              ylim=(-92, 72))  # fmt: skip
    right.legend(loc="lower left", frameon=False, fontsize=8)


def control_figure(figure: Any) -> None:
    """Step responses, power, and what it does with 20 and 40 g; as Figs. 2.13 and 2.14."""
    ((a, b, c), (d, e, f)) = figure.subplots(2, 3)
    integral, proportional, blown = (lifting.over_integral(), lifting.over_proportional(),
                                     lifting.in_blown_air())  # fmt: skip
    for axis, run, symbol, gains in ((a, integral, "$K_I$", lifting.INTEGRALS),
                                     (b, proportional, "$K_P$", lifting.PROPORTIONALS),
                                     (c, blown, "$K_I$", (0.0, 0.015))):
        names = [f"{symbol} = {gain:g}" for gain in gains]
        _curves(axis, run.time, dict(zip(names, run.displacement.T, strict=True)), 1.5)
        if run is proportional:
            _curves(d, run.time, dict(zip(names, run.power.T, strict=True)), 1)
    a.set(title="20 g, $K_P$ = 10")
    b.set(title="40 g, $K_I$ = 0.02")
    c.set(title="20 g, air is blown (grey)")
    c.axvspan(lifting.AIR_AT, blown.time[-1], color=_GREY, zorder=0)
    d.set(title="power, 40 g", ylabel="power [W]", xlim=(0, 5), xlabel="time [s]")
    felt = {f"{grams} g": lifting.felt(lifting.hung(grams)) for grams in (20, 40)}
    _curves(e, lifting.PERIOD * np.arange(1, len(felt["20 g"]) + 1), felt, 1.2)
    answers = {f"{grams} g": lifting.answer(grams) for grams in (20, 40)}
    moved = {name: response.displacement[:, 0] for name, response in answers.items()}
    _curves(f, answers["20 g"].time, moved, 1.5)
    e.set(title="cold, a weight is hung at 1 s", ylabel="sensed resistance [ohm]",
          xlabel="time [s]", xlim=(0, 4))  # fmt: skip
    f.set(title="and is lifted: twice 20 mm, or 40 mm")
    for axis in (a, b, c, f):
        _limit(axis, lifting.GOAL)
        axis.set(xlabel="time [s]", ylabel="displacement [mm]", ylim=(0, 75))
        axis.set_xlim(0, axis.get_lines()[0].get_xdata()[-1])
    a.set_ylim(0, 1.05 * float(integral.displacement.max()))
    f.set_ylim(0, 50)
    for axis in (a, b, c, d, e, f):
        axis.legend(fontsize=8, frameon=False, loc="lower right" if axis in (c, f) else "best")


def need_matplotlib() -> None:
    """Raises ImportError with what to do about it if Matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise ImportError("the figures need Matplotlib: pip install 'tca-mj[demo]'")


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
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    fill(figure)
    for axis in figure.axes:
        axis.title.set_fontsize(10)
        axis.spines["top"].set_visible(False)
        if str(axis.yaxis.get_label_position()) == "left":
            axis.grid(color="#e6e6e6")
            axis.set_axisbelow(True)
            axis.spines["right"].set_visible(False)
    figure.savefig(path, dpi=110)

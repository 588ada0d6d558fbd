"""Figure of a search for TCAs: the front of the best, and one of them in a lift."""

from functools import partial
from pathlib import Path
from typing import Any

from tca_mj.tca.design import Designs, lifted
from tca_mj.validation.figures import draw

# Factor on the SI unit, and words, of what may be an aim.
_AXES = {
    "energy": (1.0, "energy of a lift [J]"), "temperature": (1.0, "hottest [°C]"),
    "length": (1e3, "length cold, loaded [mm]"), "rest_length": (1e3, "natural length [mm]"),
    "time": (1.0, "time of the lift [s]"), "return_time": (1.0, "return [s]"),
    "power": (1.0, "largest power [W]"), "current": (1.0, "largest current [A]"),
    "diameter": (1e3, "outer diameter [mm]"), "mass": (1e6, "mass of the fibre [mg]"),
    "spring_index": (1.0, "spring index"), "stress_share": (1.0, "share of the breaking stress"),
    "torsion": (1.0, "torsion by the load [rad/m]"),
}  # fmt: skip
_MOVED, _HEATED = "#0072b2", "#d55e00"


def designs_picture(found: Designs, path: Path) -> None:
    """Draws the front, two aims as axes and a third one as colour, and the chosen one over time.

    Args:
        found: What a search has found.
        path: Picture to write; its folder exists.

    Raises:
        ImportError: If Matplotlib is not installed.
    """
    draw(path, 10.0, 4.2, partial(_fill, found=found))


def _fill(figure: Any, found: Designs) -> None:
    from matplotlib.patheffects import withStroke

    front, course = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    x, y, *more = found.aims
    colour = _values(found, more[0]) if more else _MOVED
    dots = front.scatter(_values(found, x), _values(found, y), c=colour, s=18, cmap="viridis")
    if more:
        figure.colorbar(dots, ax=front, label=_AXES[more[0]][1])
    front.set(xlabel=_AXES[x][1], ylabel=_AXES[y][1], title="none is better in all")
    shown = found.spread(8)
    across, up = _values(found, x), _values(found, y)
    for number, i in enumerate(shown, 1):
        text = front.annotate(
            str(number), (across[i], up[i]), xytext=(5, 4), textcoords="offset points",
            fontweight="bold", zorder=5,
        )  # fmt: skip
        text.set_path_effects([withStroke(linewidth=3, foreground="white")])
    best = found.chosen
    front.plot(across[best], up[best], "o", mfc="none", mec=_HEATED, ms=11, mew=1.6)

    lift = lifted(found.wish, found.best)
    course.plot(lift.time, 1e3 * lift.contraction, color=_MOVED)
    course.axhline(1e3 * found.wish.stroke, color="#666666", lw=1, ls="--")
    course.set(xlabel="time [s]", title="number 1, lift and return")
    course.set_ylabel("contraction under the load [mm]", color=_MOVED)
    heat = course.twinx()
    heat.plot(lift.time, lift.temperature, color=_HEATED)
    heat.set_ylabel("temperature [°C]", color=_HEATED)


def _values(found: Designs, name: str) -> Any:
    return _AXES[name][0] * found.values(name)

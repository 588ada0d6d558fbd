"""What a recording shows: its curves by group, and the layout that it opens on."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import rerun
import rerun.blueprint as layout

from tca_mj.checks import Array
from tca_mj.record.plots import series_colours
from tca_mj.record.shapes import rgba_bytes

# What is recorded of each TCA, with its title and unit.
QUANTITIES = {
    "power": "Power [W]",
    "temperature": "Temperature [°C]",
    "tension": "Tension [N]",
    "length": "Length [m]",
    "resistance": "Resistance [Ω]",
}
BODY_QUANTITY, BODY_TITLE = "body_temperature", "Soft bodies [°C]"
_SHOWN = "body temperature"  # a signal of TCAs, which is shown as ``BODY_QUANTITY``
HEATER_QUANTITIES = {"voltage": "Spine heaters [V]", "temperature": "Spines [°C]"}

_LIGHTNESS = 0.75  # of the curves, on Rerun's dark ground
_LEGEND = 8  # curves whose names still fit beside a plot; the others show theirs when pointed at
_ROWS = 6  # of curves that are legible one above the other; of more, the last are tabs
_BACKGROUND = (226, 230, 236)
_AWAY = 1.05  # of the eye, over the size of what is there to be seen


class Group(NamedTuple):
    """Curves of one quantity, which are shown together.

    Attributes:
        title: What stands above them.
        paths: Their entities, shape (n,).
        styles: How they look.
        read: Their values now, shape (n,).
        legend: Whether their names stand beside them.
    """

    title: str
    paths: list[str]
    styles: list[rerun.SeriesLines]
    read: Callable[[], Array]
    legend: bool


def line_styles(names: Sequence[str]) -> list[rerun.SeriesLines]:
    """Curves of so many names, each in a colour of its own."""
    colours = rgba_bytes(series_colours(len(names), lightness=_LIGHTNESS))
    return [rerun.SeriesLines(colors=colour, names=name, widths=1.5)
            for colour, name in zip(colours, names, strict=True)]  # fmt: skip


def groups(simulation: Any) -> list[Group]:
    """The curves of a simulation, from top to bottom: a ``Recorded``, and what it has besides."""
    names, styles = simulation.tca_names, line_styles(simulation.tca_names)

    def paths(kind: str, names: Sequence[str], quantity: str) -> list[str]:
        return [f"/{kind}/{rerun.escape_entity_path_part(name)}/{quantity}" for name in names]

    found = [
        Group(title, paths("actuators", names, quantity), styles,
              partial(getattr, simulation, quantity), quantity == "power")
        for quantity, title in QUANTITIES.items()
    ]  # fmt: skip
    embedded = np.flatnonzero(getattr(simulation, "embedded", np.zeros(len(names), dtype=bool)))
    if embedded.size:
        found.insert(list(QUANTITIES).index("temperature") + 1, Group(
            BODY_TITLE, paths("actuators", [names[j] for j in embedded], BODY_QUANTITY),
            [styles[j] for j in embedded], lambda: simulation.body_temperature[embedded], False,
        ))  # fmt: skip
    # What other kinds of actuators show that the curves above do not.
    for group in getattr(simulation, "groups", ()):
        root, titles = group.kind.replace(" ", "_"), {
            name: f"{group.kind}: {name} [{signal.unit}]" for name, signal in group.signals.items()
            if name not in (*QUANTITIES, "energy") and (group.kind, name) != ("TCA", _SHOWN)
        }  # fmt: skip
        if group.kind == "spine":
            root, titles = "heaters", HEATER_QUANTITIES
        found += [
            Group(title, paths(root, group.names, name), line_styles(group.names),
                  partial(_shown, simulation, group.kind, name), True)
            for name, title in titles.items()
        ]  # fmt: skip
    return found


def _shown(simulation: Any, kind: str, name: str) -> Array:
    values: Array = simulation.group(kind).signals[name].values
    return values


def blueprint(
    shown: Sequence[Group], centre: Array, size: float, ground: float | None
) -> layout.Blueprint:
    """Robot to the left above reward and events, curves to the right, time standing still.

    The resistance, which is the length once more, comes last.

    Args:
        shown: The curves.
        centre: Where to look, shape (3,) [m].
        size: Size of what is there to be seen [m].
        ground: Height of the ground [m]; None without one.
    """
    away = np.array([0.55, -0.75, 0.4])
    eye = centre + _AWAY * size * away / np.linalg.norm(away)
    grid = layout.LineGrid3D(visible=False)
    if ground is not None:
        plane = rerun.components.Plane3D.XY.with_distance(ground + 5e-4 * size)
        spacing = 10.0 ** np.floor(np.log10(0.5 * size))
        grid = layout.LineGrid3D(
            visible=True, spacing=spacing, plane=plane, stroke_width=1.0, color=(120, 128, 140, 160)
        )
    view = layout.EyeControls3D(
        kind=layout.Eye3DKind.Orbital, position=eye, look_target=centre, eye_up=(0, 0, 1)
    )
    scene = layout.Spatial3DView(
        origin="/world", name="Robot", background=_BACKGROUND, line_grid=grid, eye_controls=view
    )
    curves: list[Any] = [
        layout.TimeSeriesView(origin="/", contents=group.paths, name=group.title,
                              plot_legend=layout.PlotLegend(
                                  corner=layout.Corner2D.RightTop,
                                  visible=group.legend and len(group.paths) <= _LEGEND))
        for group in sorted(shown, key=lambda group: group.title == QUANTITIES["resistance"])
    ]  # fmt: skip
    if len(curves) > _ROWS:
        curves[_ROWS - 1 :] = [layout.Tabs(*curves[_ROWS - 1 :])]
    reward = layout.TimeSeriesView(origin="/reward", name="Reward")
    columns = layout.TextLogColumns(timeline_columns=["sim_time"], text_log_columns=["body"])
    events = layout.TextLogView(origin="/events", name="Events", columns=columns)
    below = layout.Horizontal(reward, events, column_shares=[3, 2])
    return layout.Blueprint(
        layout.Horizontal(layout.Vertical(scene, below, row_shares=[5, 2]),
                          layout.Vertical(*curves), column_shares=[3, 2]),
        layout.BlueprintPanel(state="collapsed"),
        layout.SelectionPanel(state="collapsed"),
        layout.TimePanel(state="collapsed", timeline="sim_time", play_state="paused"),
    )  # fmt: skip

"""A running simulation written to a Rerun file.

A recording holds the bodies with their geometry, the TCAs as lines coloured by temperature, five
curves per TCA, reward terms and events, on the timelines ``sim_time`` and ``step``, and opens on a
ready-made layout. Frames are collected and sent in columns, a hundred at a time, so that a frame
costs some 0.1 ms and memory does not grow with the length of the rollout, apart from the file's
table of contents (see ``Recorder``).

Entities:

* ``/world/<body>``: pose of a body in the world. Dots in its name become slashes, ``leg0.piece3``
  is ``/world/leg0/piece3``. Poses are not relative to the parent body, so no body may stand above
  another: where ``leg0`` is a body as well, it is ``/world/leg0/_body``. Its geoms are below it,
  by kind. The geoms of MuJoCo's own world body are ``/world/scene``.
* ``/world/tca/<name>``: path of a TCA.
* ``/actuators/<name>/{power,temperature,tension,length,resistance}``: W, °C, N, m, ohm.
* ``/actuators/<name>/body_temperature`` of what a TCA lies in, if it is not bare: °C. An event
  says when a TCA gets hotter than what its law was measured at, or colder again.
* ``/heaters/<name>/{voltage,temperature}`` of the shape-memory spines, if there are any: V, °C.
* ``/reward/<term>`` and ``/events``.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, Self

import mujoco
import numpy as np
import rerun
import rerun.blueprint as layout
from numpy.typing import NDArray

from tca_mj.checks import require_count, require_positive
from tca_mj.plots import series_colours, temperature_colour
from tca_mj.shapes import body_paths, extent, ground_height, moving_bodies, rgba_bytes, shapes

QUANTITIES = {
    "power": "Power [W]",
    "temperature": "Temperature [°C]",
    "tension": "Tension [N]",
    "length": "Length [m]",
    "resistance": "Resistance [Ω]",
}

BODY_QUANTITY, BODY_TITLE = "body_temperature", "Soft bodies [°C]"
HEATER_QUANTITIES = {"voltage": "Spine heaters [V]", "temperature": "Spines [°C]"}

_LIGHTNESS = 0.75  # of the curves, on Rerun's dark ground
_LEGEND = 8  # curves whose names still fit beside a plot; the others show theirs when pointed at
_BACKGROUND = (226, 230, 236)

_POSITION = rerun.Transform3D.descriptor_translation()
_QUATERNION = rerun.Transform3D.descriptor_quaternion()
_SCALAR = rerun.Scalars.descriptor_scalars()
_STRIP = rerun.LineStrips3D.descriptor_strips()
_COLOUR = rerun.LineStrips3D.descriptor_colors()
_TEXT = rerun.TextLog.descriptor_text()


class Recorded(Protocol):
    """What is recorded of a simulation; ``tca_mj.sim.Simulation`` has it.

    The properties are float64 of shape (n,), one entry per TCA. Shape-memory spines are recorded
    too where there are some, and soft bodies: attributes ``spines``, ``embedded``,
    ``body_temperature`` and ``extrapolated`` as ``Simulation`` has them.
    """

    @property
    def model(self) -> mujoco.MjModel: ...
    @property
    def data(self) -> mujoco.MjData: ...
    @property
    def time(self) -> float: ...
    @property
    def tca_names(self) -> tuple[str, ...]: ...
    @property
    def tendon(self) -> NDArray[Any]: ...
    @property
    def power(self) -> NDArray[np.float64]: ...
    @property
    def temperature(self) -> NDArray[np.float64]: ...
    @property
    def tension(self) -> NDArray[np.float64]: ...
    @property
    def length(self) -> NDArray[np.float64]: ...
    @property
    def resistance(self) -> NDArray[np.float64]: ...


class Recorder:
    """Writes a simulation to a ``.rrd`` file; a context manager.

    Leaving the context by an exception or Ctrl-C writes what was collected. A process that is
    killed outright leaves the frames up to the last full chunk, in a file that lacks its table of
    contents: the viewer opens it, ``rerun rrd verify`` objects, and
    ``rerun rrd merge cut.rrd -o whole.rrd`` mends it.

    The recorder reads and never changes the simulation. Poses are those of the last evaluation of
    kinematics: after ``mj_step`` they are one physics step older than the time they stand at.
    """

    def __init__(
        self,
        simulation: Recorded,
        path: str | Path,
        *,
        application_id: str = "tca-mj",
        every: int = 1,
        chunk: int = 100,
        tca_radius: float | None = None,
        footer: bool = True,
    ) -> None:
        """Opens the file and writes geometry and layout.

        Args:
            simulation: What to record; its model must stay the same.
            path: File to write, usually ending in ``.rrd``; its folder is made if it is missing.
            application_id: Name under which the viewer keeps layouts and groups recordings.
            every: Records every so many-th frame.
            chunk: Recorded frames that are collected before they are written; twice as many
                cost half the time per frame, and more are lost when the process is killed.
            tca_radius: Radius of the drawn TCAs [m]; None for the tendon's own width, but no less
                than 1/400 of the robot's size.
            footer: Ends the file with a table of contents. Until then it is kept in memory, about
                0.8 kB per entity and chunk; without it memory is constant, but
                ``rerun rrd verify`` objects to the file.

        Raises:
            ValueError: If a number is not positive, or not whole where it counts.
        """
        require_count(every=every, chunk=chunk)
        if tca_radius is not None:
            require_positive(tca_radius=tca_radius)
        self.simulation = simulation
        self.path = Path(path)
        self._every = every
        self._chunk = chunk
        self._calls = 0
        self._filled = 0
        self._last = simulation.time
        self._offset = 0.0
        self._closed = False

        model, n = simulation.model, len(simulation.tca_names)
        paths = body_paths(model)
        moving = moving_bodies(model)
        self._bodies = np.array([b for b in paths if moving[b]], dtype=np.intp)
        self._body_paths = [paths[b] for b in self._bodies]
        self._clock = np.zeros(chunk)
        self._steps = np.zeros(chunk, dtype=np.int64)
        self._position = np.zeros((self._bodies.size, chunk, 3), dtype=np.float32)
        self._quaternion = np.zeros((self._bodies.size, chunk, 4), dtype=np.float32)
        self._curves = np.zeros((len(QUANTITIES), n, chunk))
        # TCAs that lie in a body; and those that were beyond what is measured, at the last frame.
        self._embedded = np.flatnonzero(getattr(simulation, "embedded", np.zeros(n, dtype=bool)))
        self._warmth = np.zeros((self._embedded.size, chunk))
        self._beyond = np.zeros(n, dtype=bool)
        spines = getattr(simulation, "spines", None)
        self._spines = spines if spines is not None and spines.n else None
        self._heaters: tuple[str, ...] = () if self._spines is None else self._spines.names
        self._heat = np.zeros((len(HEATER_QUANTITIES), len(self._heaters), chunk))
        empty = np.zeros((0, 3), dtype=np.float32)
        self._strips = [[empty] * chunk for _ in range(n)]
        self._rewards: dict[str, tuple[list[int], list[float]]] = {}
        self._reward_names: list[str] = []
        self._events: list[tuple[float, int, str]] = []

        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = rerun.RecordingStream(application_id)
        self._stream.save(self.path, write_footer=footer)
        centre, size = extent(model, simulation.data)
        ground = ground_height(model)
        embedded = tuple(simulation.tca_names[j] for j in self._embedded)
        blueprint = _blueprint(
            simulation.tca_names, embedded, self._heaters, centre, size, ground
        )
        self._stream.send_blueprint(blueprint)
        for entity, content in self._static(paths, moving, tca_radius, size):
            self._stream.log(entity, content, static=True, strict=True)
        self._stream.flush()

    def frame(self, reward_terms: Mapping[str, float] | None = None) -> None:
        """Collects one sample at the simulation's present time.

        ``step`` counts the calls. When the simulation was reset to time 0, recorded time goes on
        from the last frame and the event ``reset`` marks the place.

        Args:
            reward_terms: Terms of the reward of this step, by name.

        Raises:
            RuntimeError: If the recorder is closed.
        """
        time = self._now()
        step = self._calls
        self._calls += 1
        if step % self._every:
            return
        i, simulation, data = self._filled, self.simulation, self.simulation.data
        self._clock[i] = time
        self._steps[i] = step
        self._position[:, i] = data.xpos[self._bodies]
        self._quaternion[:, i] = data.xquat[self._bodies]
        for row, quantity in enumerate(QUANTITIES):
            self._curves[row, :, i] = getattr(simulation, quantity)
        if self._embedded.size:
            bodies: Any = simulation
            self._warmth[:, i] = bodies.body_temperature[self._embedded]
        self._tell_beyond()
        if self._spines is not None:
            for row, quantity in enumerate(HEATER_QUANTITIES):
                self._heat[row, :, i] = getattr(self._spines, quantity)
        points = data.wrap_xpos.reshape(-1, 3)
        starts = data.ten_wrapadr[simulation.tendon].tolist()
        counts = data.ten_wrapnum[simulation.tendon].tolist()
        for strips, start, count in zip(self._strips, starts, counts, strict=True):
            strips[i] = points[start : start + count].astype(np.float32)
        for term, value in (reward_terms or {}).items():
            frames, values = self._rewards.setdefault(term, ([], []))
            frames.append(i)
            values.append(float(value))
        self._filled += 1
        if self._filled == self._chunk:
            self._write()

    def _tell_beyond(self) -> None:
        """Logs which TCAs have left what their law was measured at, or have come back."""
        beyond = getattr(self.simulation, "extrapolated", self._beyond)
        for j in np.flatnonzero(beyond != self._beyond):
            where = "beyond" if beyond[j] else "within"
            text = f"{self.simulation.tca_names[j]}: {where} the measured temperatures"
            self._events.append((self._last + self._offset, self._calls - 1, text))
        self._beyond = np.array(beyond)

    def event(self, text: str) -> None:
        """Logs ``text`` at the simulation's present time, at the step of the next frame.

        An event before the first frame takes that frame, so that the recording has a beginning
        that can be looked at.

        Raises:
            RuntimeError: If the recorder is closed.
        """
        if self._calls == 0:
            self.frame()
        self._events.append((self._now(), self._calls, text))

    def close(self) -> None:
        """Writes what was collected and ends the file; it may be called again."""
        if self._closed:
            return
        self._closed = True
        try:
            self._write()
        finally:
            self._stream.disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _now(self) -> float:
        """Recorded time [s]: the simulation's, but never running back."""
        if self._closed:
            raise RuntimeError(f"the recording {self.path} is closed")
        time = self.simulation.time
        if time < self._last:
            self._offset += self._last
            self._events.append((self._offset, self._calls, "reset"))
        self._last = time
        return time + self._offset

    def _write(self) -> None:
        """Sends the collected frames and events in columns, and waits until they are in the file.

        The columns are put together from Rerun's batches rather than by ``Archetype.columns``,
        which takes twice the time. What was collected is forgotten at the end only: interrupted by
        Ctrl-C, it is sent again by ``close``, and a part twice rather than never.
        """
        k = self._filled
        times = _times(self._clock[:k], self._steps[:k])
        ones = _ones(k)
        if k:
            for path, position, quaternion in zip(
                self._body_paths, self._position, self._quaternion, strict=True
            ):
                xyzw = quaternion[:k, [1, 2, 3, 0]]  # MuJoCo has wxyz
                moved = rerun.components.Translation3DBatch(position[:k])
                turned = rerun.components.RotationQuatBatch(xyzw)
                self._send(path, times, (_POSITION, moved, ones), (_QUATERNION, turned, ones))
            heat = self._curves[list(QUANTITIES).index("temperature"), :, :k]
            colours = _packed(temperature_colour(heat))
            for j, name in enumerate(self.simulation.tca_names):
                for row, quantity in enumerate(QUANTITIES):
                    values = rerun.components.ScalarBatch(self._curves[row, j, :k])
                    self._send(_curve(name, quantity), times, (_SCALAR, values, ones))
                strips = self._strips[j][:k]
                # Only a path round an obstacle has now more points, now fewer: Rerun's slow way.
                even = len({len(strip) for strip in strips}) == 1
                lines = rerun.components.LineStrip3DBatch(np.array(strips) if even else strips)
                shades = rerun.components.ColorBatch(colours[j])
                self._send(_line(name), times, (_STRIP, lines, ones), (_COLOUR, shades, ones))
            for warmth, which in zip(self._warmth, self._embedded, strict=True):
                values = rerun.components.ScalarBatch(warmth[:k])
                path = _curve(self.simulation.tca_names[which], BODY_QUANTITY)
                self._send(path, times, (_SCALAR, values, ones))
            for j, name in enumerate(self._heaters):
                for row, quantity in enumerate(HEATER_QUANTITIES):
                    values = rerun.components.ScalarBatch(self._heat[row, j, :k])
                    self._send(_heater(name, quantity), times, (_SCALAR, values, ones))
        for term, (frames, amounts) in self._rewards.items():
            path = f"/reward/{rerun.escape_entity_path_part(term)}"
            if term not in self._reward_names:
                self._reward_names.append(term)
                colour = series_colours(len(self._reward_names), lightness=_LIGHTNESS)[-1]
                style = rerun.SeriesLines(colors=rgba_bytes(colour), names=term, widths=1.5)
                self._stream.log(path, style, static=True, strict=True)
            values = rerun.components.ScalarBatch(np.array(amounts))
            when = _times(self._clock[frames], self._steps[frames])
            self._send(path, when, (_SCALAR, values, _ones(len(frames))))
        if self._events:
            at, steps, texts = zip(*self._events, strict=True)
            when = _times(np.array(at), np.array(steps))
            said = rerun.components.TextBatch(texts)
            self._send("/events", when, (_TEXT, said, _ones(len(texts))))
        self._stream.flush()
        self._filled = 0
        self._rewards.clear()
        self._events.clear()

    def _send(self, path: str, times: list[rerun.TimeColumn], *columns: Any) -> None:
        made = [
            rerun.ComponentColumn(descriptor, batch, offsets=offsets)
            for descriptor, batch, offsets in columns
        ]
        self._stream.send_columns(path, times, made, strict=True)

    def _static(
        self, paths: dict[int, str], moving: NDArray[np.bool_], radius: float | None, size: float
    ) -> Iterator[tuple[str, Any]]:
        """What never changes: geometry, poses of what stands still, styles of the curves."""
        simulation = self.simulation
        model, data = simulation.model, simulation.data
        yield "/world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP
        for body, path in paths.items():
            if not moving[body]:
                w, x, y, z = data.xquat[body]
                quaternion = rerun.Quaternion(xyzw=[x, y, z, w])
                pose = rerun.Transform3D(translation=data.xpos[body], quaternion=quaternion)
                yield path, pose
            for kind, solid in shapes(model, body, size):
                yield f"{path}/{kind}", solid
        names, tendons = simulation.tca_names, simulation.tendon
        colours = series_colours(len(names), lightness=_LIGHTNESS)
        for j in self._embedded:
            shade = rgba_bytes(colours[j])
            style = rerun.SeriesLines(colors=shade, names=names[j], widths=1.5)
            yield _curve(names[j], BODY_QUANTITY), style
        for name, colour, tendon in zip(names, colours, tendons, strict=True):
            width = max(float(model.tendon_width[tendon]), size / 400.0)
            yield _line(name), rerun.LineStrips3D.from_fields(radii=radius or width)
            for quantity in QUANTITIES:
                style = rerun.SeriesLines(colors=rgba_bytes(colour), names=name, widths=1.5)
                yield _curve(name, quantity), style
        colours = series_colours(len(self._heaters), lightness=_LIGHTNESS)
        for name, colour in zip(self._heaters, colours, strict=True):
            for quantity in HEATER_QUANTITIES:
                style = rerun.SeriesLines(colors=rgba_bytes(colour), names=name, widths=1.5)
                yield _heater(name, quantity), style


def _packed(colour: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Opaque colours, shape (..., 3), as Rerun's 0xRRGGBBAA, shape (...)."""
    red, green, blue = np.moveaxis(rgba_bytes(colour).astype(np.uint32), -1, 0)
    return red << 24 | green << 16 | blue << 8 | np.uint32(255)


def _times(clock: NDArray[np.float64], steps: NDArray[np.int64]) -> list[rerun.TimeColumn]:
    nanoseconds = np.rint(1e9 * clock).astype("timedelta64[ns]")
    return [
        rerun.TimeColumn("sim_time", duration=nanoseconds),
        rerun.TimeColumn("step", sequence=steps),
    ]


def _ones(n: int) -> NDArray[np.int32]:
    """Where the rows of a column with one entry each begin and end."""
    return np.arange(n + 1, dtype=np.int32)


def _curve(name: str, quantity: str) -> str:
    return f"/actuators/{rerun.escape_entity_path_part(name)}/{quantity}"


def _heater(name: str, quantity: str) -> str:
    return f"/heaters/{rerun.escape_entity_path_part(name)}/{quantity}"


def _line(name: str) -> str:
    return f"/world/tca/{rerun.escape_entity_path_part(name)}"


def _blueprint(
    names: tuple[str, ...],
    embedded: tuple[str, ...],
    heaters: tuple[str, ...],
    centre: NDArray[np.float64],
    size: float,
    ground: float | None,
) -> layout.Blueprint:
    """Robot to the left above reward and events, curves to the right, time standing still."""
    away = np.array([0.55, -0.75, 0.4])
    eye = centre + 1.35 * size * away / np.linalg.norm(away)
    grid = layout.LineGrid3D(visible=False)
    if ground is not None:
        plane = rerun.components.Plane3D.XY.with_distance(ground + 5e-4 * size)
        spacing = 10.0 ** np.floor(np.log10(0.5 * size))
        grid = layout.LineGrid3D(
            visible=True, spacing=spacing, plane=plane, stroke_width=1.0, color=(120, 128, 140, 160)
        )
    scene = layout.Spatial3DView(
        origin="/world",
        name="Robot",
        background=_BACKGROUND,
        line_grid=grid,
        eye_controls=layout.EyeControls3D(
            kind=layout.Eye3DKind.Orbital, position=eye, look_target=centre, eye_up=(0, 0, 1)
        ),
    )
    curves = [
        layout.TimeSeriesView(
            origin="/",
            contents=[_curve(name, quantity) for name in names],
            name=title,
            plot_legend=layout.PlotLegend(
                corner=layout.Corner2D.RightTop,
                visible=quantity == "power" and len(names) <= _LEGEND,
            ),
        )
        for quantity, title in QUANTITIES.items()
    ]
    if embedded:
        contents = [_curve(name, BODY_QUANTITY) for name in embedded]
        bodies = layout.TimeSeriesView(
            origin="/", contents=contents, name=BODY_TITLE,
            plot_legend=layout.PlotLegend(visible=False),
        )  # fmt: skip
        curves.insert(list(QUANTITIES).index("temperature") + 1, bodies)
    if heaters:
        curves += [
            layout.TimeSeriesView(
                origin="/", contents=[_heater(name, quantity) for name in heaters], name=title
            )
            for quantity, title in HEATER_QUANTITIES.items()
        ]
    reward = layout.TimeSeriesView(origin="/reward", name="Reward")
    events = layout.TextLogView(
        origin="/events",
        name="Events",
        columns=layout.TextLogColumns(timeline_columns=["sim_time"], text_log_columns=["body"]),
    )
    below = layout.Horizontal(reward, events, column_shares=[3, 2])
    return layout.Blueprint(
        layout.Horizontal(
            layout.Vertical(scene, below, row_shares=[5, 2]),
            layout.Vertical(*curves),
            column_shares=[3, 2],
        ),
        layout.BlueprintPanel(state="collapsed"),
        layout.SelectionPanel(state="collapsed"),
        layout.TimePanel(state="collapsed", timeline="sim_time", play_state="paused"),
    )

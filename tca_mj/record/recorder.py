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
* ``/<kind>/<name>/<signal>`` of actuators of other kinds, as motors: what they show besides.
* ``/reward/<term>`` and ``/events``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Protocol

import numpy as np
import rerun
from numpy.typing import NDArray

from tca_mj.checks import Array, door, floats, instance, number, whole
from tca_mj.files import Claim, require_room
from tca_mj.record import shapes
from tca_mj.record.layout import QUANTITIES, Group, blueprint, groups, line_styles
from tca_mj.record.plots import temperature_colour
from tca_mj.record.render import Closing, Watched

__all__ = ["QUANTITIES", "Recorded", "Recorder"]

_FIRST, _MORE = 1 << 22, 1 << 20  # for geometry and layout; for a chunk besides its numbers [bytes]
_CONTENTS = 1000  # of the table of contents, for each entity and chunk [bytes]
_PATIENCE = 60.0  # until a file is given up that does not take what was sent [s]

Every = Annotated[int, partial(whole, at_least=1, at_most=1_000_000)]
Chunk = Annotated[int, partial(whole, at_least=1, at_most=10_000)]  # 100 MB of the largest robot
Radius = Annotated[float, partial(number, above=0.0, at_most=1.0, unit="m")]

# What is sent, and as what.
_POSITION = rerun.Transform3D.descriptor_translation(), rerun.components.Translation3DBatch
_QUATERNION = rerun.Transform3D.descriptor_quaternion(), rerun.components.RotationQuatBatch
_SCALAR = rerun.Scalars.descriptor_scalars(), rerun.components.ScalarBatch
_STRIP = rerun.LineStrips3D.descriptor_strips(), rerun.components.LineStrip3DBatch
_COLOUR = rerun.LineStrips3D.descriptor_colors(), rerun.components.ColorBatch
_TEXT = rerun.TextLog.descriptor_text(), rerun.components.TextBatch


class Recorded(Watched, Protocol):
    """What is recorded of a simulation; ``tca_mj.sim.Simulation`` has it.

    The properties are float64 of shape (n,), one entry per TCA. Shape-memory spines are recorded
    too where there are some, and soft bodies: attributes ``groups``, ``embedded``,
    ``body_temperature`` and ``extrapolated`` as ``Simulation`` has them.
    """

    @property
    def tca_names(self) -> tuple[str, ...]:
        """Names of the TCAs."""

    @property
    def power(self) -> Array:
        """Electrical power [W]."""

    @property
    def tension(self) -> Array:
        """Tension [N]."""

    @property
    def length(self) -> Array:
        """Length [m]."""

    @property
    def resistance(self) -> Array:
        """Electrical resistance [ohm]."""


class Recorder(Closing):
    """Writes a simulation to a ``.rrd`` file; a context manager.

    Leaving the context by an exception or Ctrl-C writes what was collected. A process that is
    killed outright leaves the frames up to the last full chunk, in a file that lacks its table of
    contents: the viewer opens it, ``rerun rrd verify`` objects, and
    ``rerun rrd merge cut.rrd -o whole.rrd`` mends it.

    The recorder reads and never changes the simulation. What a state has no value of, as one that
    has diverged, is not a number. Poses are those of the last evaluation of kinematics: after
    ``mj_step`` they are one physics step older than the time they stand at.

    A file is written by one recorder at a time. One that has been finished is overwritten.
    """

    @door
    def __init__(
        self, simulation: Recorded, path: str | Path, *, application_id: str = "tca-mj",
        every: Every = 1, chunk: Chunk = 100, tca_radius: Radius | None = None, footer: bool = True,
    ) -> None:  # fmt: skip
        """Opens the file and writes geometry and layout.

        Args:
            simulation: What to record; its model must stay the same.
            path: File to write, usually ending in ``.rrd``; its folder is made if it is missing.
            application_id: Name under which the viewer keeps layouts and groups recordings.
            every: Records every so many-th frame, up to every millionth.
            chunk: Recorded frames that are collected before they are written, up to 10 000; twice
                as many cost half the time per frame, and more are lost when the process is killed.
            tca_radius: Radius of the drawn TCAs, at most 1 m [m]; None for the tendon's own width,
                but no less than 1/400 of the robot's size.
            footer: Ends the file with a table of contents. Until then it is kept in memory, about
                0.8 kB per entity and chunk; without it memory is constant, but
                ``rerun rrd verify`` objects to the file.

        Raises:
            ValueError: If a number is out of bounds, or not whole where it counts, or another
                recorder writes this file now, in this process or another one.
            OSError: If the file cannot be written.
        """
        self.simulation, self.path = simulation, Path(path)
        self._every, self._chunk = every, chunk
        self._calls = self._filled = self._chunks = 0
        self._last, self._offset = simulation.time, 0.0
        self._closed = False

        model, n = simulation.model, len(simulation.tca_names)
        paths, moving = shapes.body_paths(model), shapes.moving_bodies(model)
        self._bodies = np.array([b for b in paths if moving[b]], dtype=np.intp)
        self._body_paths = [paths[b] for b in self._bodies]
        self._clock = np.zeros(chunk)
        self._steps = np.zeros(chunk, dtype=np.int64)
        self._position = np.zeros((self._bodies.size, chunk, 3), dtype=np.float32)
        self._quaternion = np.zeros((self._bodies.size, chunk, 4), dtype=np.float32)
        self._groups = groups(simulation)
        self._paths = [path for group in self._groups for path in group.paths]
        self._curves = np.zeros((len(self._paths), chunk))
        self._beyond = np.zeros(n, dtype=bool)  # what is measured, at the last frame
        empty = np.zeros((0, 3), dtype=np.float32)
        self._strips = [[empty] * chunk for _ in range(n)]
        self._lines = [f"/world/tca/{rerun.escape_entity_path_part(name)}"
                       for name in simulation.tca_names]  # fmt: skip
        self._rewards: dict[str, tuple[list[int], list[float]]] = {}
        self._reward_names: list[str] = []
        self._events: list[tuple[float, int, str]] = []

        self._claim = Claim(self.path)
        self._stream = rerun.RecordingStream(application_id)
        try:
            require_room(self.path, _FIRST)
            self._stream.save(self.path, write_footer=footer)
            centre, size = shapes.extent(model, simulation.data)
            self._stream.send_blueprint(
                blueprint(self._groups, centre, size, shapes.ground_height(model))
            )
            for entity, content in self._static(paths, moving, tca_radius, size):
                self._stream.log(entity, content, static=True, strict=True)
            self._flush()
        except BaseException:
            self._end()
            self.path.unlink(missing_ok=True)  # nothing is recorded yet
            raise

    def frame(self, reward_terms: Mapping[str, float] | None = None) -> None:
        """Collects one sample at the simulation's present time.

        ``step`` counts the calls. When the simulation was reset to time 0, recorded time goes on
        from the last frame and the event ``reset`` marks the place.

        Args:
            reward_terms: Terms of the reward of this step, by name.

        Raises:
            RuntimeError: If the recorder is closed.
            ValueError: If a term is no number.
        """
        rewards = _terms({} if reward_terms is None else reward_terms)
        time, step = self._now(), self._calls
        self._calls += 1
        if step % self._every:
            return
        i, simulation, data = self._filled, self.simulation, self.simulation.data
        self._clock[i], self._steps[i] = time, step
        self._curves[:, i] = np.concatenate([_values(group) for group in self._groups])
        self._tell_beyond()
        points = data.wrap_xpos.reshape(-1, 3)
        starts = data.ten_wrapadr[simulation.tendon].tolist()
        counts = data.ten_wrapnum[simulation.tendon].tolist()
        with np.errstate(over="ignore", invalid="ignore"):  # of what has diverged
            self._position[:, i] = data.xpos[self._bodies]
            self._quaternion[:, i] = data.xquat[self._bodies]
            for strips, start, count in zip(self._strips, starts, counts, strict=True):
                strips[i] = points[start : start + count].astype(np.float32)
        for term, value in rewards.items():
            frames, values = self._rewards.setdefault(term, ([], []))
            frames.append(i)
            values.append(value)
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
            ValueError: If it is no text.
        """
        instance("text", text, str)
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
            self._end()

    def _end(self) -> None:
        try:
            self._stream.disconnect()
        finally:
            self._claim.close()

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
        self._require_room()
        times = _times(self._clock[:k], self._steps[:k])
        if k:
            poses = zip(self._body_paths, self._position, self._quaternion, strict=True)
            for path, position, quaternion in poses:
                xyzw = quaternion[:k, [1, 2, 3, 0]]  # MuJoCo has wxyz
                self._send(path, times, (_POSITION, position[:k]), (_QUATERNION, xyzw))
            for path, curve in zip(self._paths, self._curves, strict=True):
                self._send(path, times, (_SCALAR, curve[:k]))
            n = len(self._strips)
            hot = list(QUANTITIES).index("temperature") * n
            colours = _packed(temperature_colour(self._curves[hot : hot + n, :k]))
            for name, every, colour in zip(self._lines, self._strips, colours, strict=True):
                strips = every[:k]
                # Only a path round an obstacle has now more points, now fewer: Rerun's slow way.
                even = len({len(strip) for strip in strips}) == 1
                lines = np.array(strips) if even else strips
                self._send(name, times, (_STRIP, lines), (_COLOUR, colour))
        for term, (frames, amounts) in self._rewards.items():
            path = f"/reward/{rerun.escape_entity_path_part(term)}"
            if term not in self._reward_names:
                self._reward_names.append(term)
                style = line_styles(self._reward_names)[-1]
                self._stream.log(path, style, static=True, strict=True)
            when = _times(self._clock[frames], self._steps[frames])
            self._send(path, when, (_SCALAR, np.array(amounts)))
        if self._events:
            at, steps, texts = zip(*self._events, strict=True)
            self._send("/events", _times(np.array(at), np.array(steps)), (_TEXT, texts))
        self._flush()
        self._filled = 0
        self._rewards.clear()
        self._events.clear()

    def _require_room(self) -> None:
        """Rerun loses what a full disk does not take, or waits for ever: it must not come to that.

        There must be room for a chunk now, and for the table of contents in the end.
        """
        self._chunks += 1
        numbers = self._position, self._quaternion, self._curves
        lines = (strip.nbytes for strips in self._strips for strip in strips[: self._filled])
        chunk = 2 * sum(each.nbytes for each in numbers) + sum(lines)
        entities = self._bodies.size + len(self._paths) + len(self._lines)
        require_room(self.path, _MORE + chunk, later=_CONTENTS * entities * self._chunks)

    def _flush(self) -> None:
        """Waits until what was sent is in the file."""
        try:
            self._stream.flush(timeout_sec=_PATIENCE)
        except RuntimeError as error:
            raise OSError(f"{self.path} cannot be written: {error}") from error

    def _send(self, path: str, times: list[rerun.TimeColumn], *columns: Any) -> None:
        made = [rerun.ComponentColumn(what, batch(values)) for (what, batch), values in columns]
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
                turned = rerun.Quaternion(xyzw=[x, y, z, w])
                yield path, rerun.Transform3D(translation=data.xpos[body], quaternion=turned)
            for kind, solid in shapes.shapes(model, body, size):
                yield f"{path}/{kind}", solid
        for path, tendon in zip(self._lines, simulation.tendon, strict=True):
            width = max(float(model.tendon_width[tendon]), size / 400.0)
            yield path, rerun.LineStrips3D.from_fields(radii=radius or width)
        for group in self._groups:
            yield from zip(group.paths, group.styles, strict=True)


def _values(group: Group) -> Array:
    """Values of a group's curves now; not numbers where the state is one that has none."""
    try:
        return group.read()
    except (ArithmeticError, ValueError):
        return np.full(len(group.paths), np.nan)


def _packed(colour: Array) -> NDArray[np.uint32]:
    """Opaque colours, shape (..., 3), as Rerun's 0xRRGGBBAA, shape (...)."""
    red, green, blue = np.moveaxis(shapes.rgba_bytes(colour).astype(np.uint32), -1, 0)
    return red << 24 | green << 16 | blue << 8 | np.uint32(255)


def _times(clock: Array, steps: NDArray[np.int64]) -> list[rerun.TimeColumn]:
    nanoseconds = np.rint(1e9 * clock).astype("timedelta64[ns]")
    return [
        rerun.TimeColumn("sim_time", duration=nanoseconds),
        rerun.TimeColumn("step", sequence=steps),
    ]


def _terms(given: Mapping[str, float]) -> dict[str, float]:
    """Terms of a reward; what has diverged may be no number."""
    instance("reward_terms", given, Mapping)
    found = {}
    for name, value in given.items():
        instance("names of reward_terms", name, str)
        array = floats(f"reward_terms[{name!r}]", value)
        if array.size != 1:
            raise ValueError(f"reward_terms[{name!r}] must be one number, got {value!r}")
        found[name] = array.item()
    return found

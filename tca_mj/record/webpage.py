"""A rollout as one web page that plays it: for who has a browser and nothing else.

The page holds geometry, poses and temperatures as numbers of 16 bits and a player of its own; it
asks no other host for anything and opens from a folder. Poses are exact to the 65,000th part of the
space in which the robot moves.
"""

from __future__ import annotations

import base64
import html
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array, Positive, door
from tca_mj.files import write_whole
from tca_mj.record.plots import COLDEST, HOTTEST, temperature_colour
from tca_mj.record.render import Closing, Watched
from tca_mj.record.shapes import body_paths, extent, moving_bodies, rgba, visible

_ROUND = 14  # corners of a round geom
_LARGEST = 32767  # of a number of 16 bits
_STOPS = 64  # of the scale of temperatures
_FRAMES = 20_000  # a page beyond is too large for a browser



class WebPage(Closing):
    """Writes a simulation to a page that replays it; a context manager.

        with WebPage(sim, "walk.html", title="A walk") as page:
            for ...:
                sim.step(...)
                page.frame()

    The page is written at the end, also when that comes by an exception. It reads and never changes
    the simulation. Planes are drawn as ground, TCAs as coils that redden with heat, other tendons
    as they are.
    """

    @door
    def __init__(
        self, simulation: Watched, path: str | Path, *, title: str = "Rollout",
        interval: Positive = 0.08, speed: Positive = 1.0, follow: bool = True,
    ) -> None:  # fmt: skip
        """Takes the geometry.

        Args:
            simulation: What to show; its model must stay the same.
            path: The page, ending in ``.html``.
            title: What stands above it.
            interval: Time between two kept frames; calls of ``frame`` in between are not kept [s].
            speed: Simulated seconds per second, until the spectator says another [1].
            follow: Whether the camera goes along with what moves; else all of the way is in view.

        Raises:
            ValueError: If an argument is not of its kind, or the ending is another.
        """
        self.path = Path(path)
        if self.path.suffix != ".html":
            raise ValueError(f"path must end in .html, got {path}")
        self._simulation, self._interval = simulation, interval
        self._about: dict[str, Any] = {"title": title, "speed": speed, "follow": follow}
        model, moving = simulation.model, moving_bodies(simulation.model)
        self._bodies = [b for b in body_paths(model) if b == 0 or moving[b]]
        fixed = [b for b in body_paths(model) if b != 0 and not moving[b]]
        self._meshes = [_body(model, simulation.data, b, fixed) for b in self._bodies]
        tcas = [int(tendon) for tendon in simulation.tendon]
        others = (t for t in range(model.ntendon) if t not in tcas and _seen(model, t))
        self._tendons = [*tcas, *others]
        self._times: list[float] = []
        self._poses: list[Array] = []
        self._paths: list[list[Array]] = []
        self._heat: list[Array] = []
        self._labels: list[str] = []
        self._closed = False

    def frame(self, label: str = "") -> None:
        """Keeps the present, if it is time to.

        Args:
            label: What is going on, shown above.

        Raises:
            RuntimeError: If the page is closed.
            ValueError: If there are more than 20,000 frames.
        """
        if self._closed:
            raise RuntimeError(f"the page {self.path} is closed")
        simulation, data = self._simulation, self._simulation.data
        if self._times and simulation.time < self._times[-1] + self._interval - 1e-9:
            return
        if len(self._times) == _FRAMES:
            raise ValueError(f"frames must be at most {_FRAMES}, got more: raise the interval")
        if not self._times:
            centre, size = extent(simulation.model, data)
            self._about |= {"centre": np.nan_to_num(centre).tolist(), "size": size}
        self._times.append(simulation.time)
        bodies = self._bodies
        self._poses.append(np.concatenate([data.xpos[bodies], data.xquat[bodies]], axis=1))
        points = data.wrap_xpos.reshape(-1, 3)
        self._paths.append([
            points[data.ten_wrapadr[t] : data.ten_wrapadr[t] + data.ten_wrapnum[t]].copy()
            for t in self._tendons
        ])  # fmt: skip
        self._heat.append(simulation.temperature.copy())
        self._labels.append(label)

    def close(self) -> None:
        """Writes the page; without a frame there is none."""
        if self._closed:
            return
        self._closed = True
        if self._times:
            write_whole(self.path, self._page().encode())

    def _page(self) -> str:
        poses, heat = np.nan_to_num(self._poses), np.nan_to_num(self._heat, nan=COLDEST)
        ways = np.concatenate([np.concatenate(each) for each in self._paths if each] or [poses[0]])
        ways = np.nan_to_num(ways[:, :3])
        ends = np.concatenate([poses[..., :3].reshape(-1, 3), ways])
        low, high = ends.min(axis=0), ends.max(axis=0)
        span = np.maximum(high - low, 1e-6)
        if not self._about["follow"]:
            size = max(self._about["size"], float(np.linalg.norm(span)))
            self._about |= {"centre": (0.5 * (low + high)).tolist(), "size": size}
        model, tendons = self._simulation.model, self._tendons
        counts = [[len(way) for way in each] for each in self._paths]
        facts = {
            **self._about, "low": low.tolist(), "span": span.tolist(),
            "times": np.round(self._times, 4).tolist(), "bodies": len(self._bodies),
            "positions": _small((poses[..., :3] - low) / span * 2.0 - 1.0),
            "turns": _small(poses[..., 3:]),
            "meshes": self._meshes,
            "counts": counts, "ways": _small((ways - low) / span * 2.0 - 1.0),
            "widths": [float(model.tendon_width[t]) for t in tendons],
            "lengths": [float(model.tendon_length0[t]) for t in tendons],
            "plain": model.tendon_rgba[tendons[heat.shape[1] :], :3].tolist(),
            "heat": np.round(heat, 1).tolist(),
            "labels": self._labels if len(set(self._labels)) > 1 else [],
            "scale": [COLDEST, HOTTEST], "colours": np.round(255.0 * temperature_colour(
                np.linspace(COLDEST, HOTTEST, _STOPS))).astype(int).tolist(),
        }  # fmt: skip
        player = (files("tca_mj.record") / "player.html").read_text(encoding="utf-8")
        data = json.dumps(facts, separators=(",", ":")).replace("</", "<\\/")
        title = html.escape(str(self._about["title"]))
        return player.replace("{{title}}", title).replace("{{facts}}", data)


def _seen(model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon that is no TCA, as a rubber band, is shown."""
    shown = model.tendon_group[tendon] <= 2 and model.tendon_rgba[tendon, 3] > 0.0
    return bool(shown and model.tendon_width[tendon] > 0.0)


def _small(values: Array) -> str:
    """Numbers from -1 to 1 as those of 16 bits."""
    whole = np.rint(_LARGEST * np.clip(values, -1.0, 1.0)).astype("<i2")
    return base64.b64encode(whole.tobytes()).decode()


def _body(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, fixed: list[int]
) -> dict[str, Any]:
    """Triangles of a body in its frame; those of the world with all that never moves."""
    corners, normals, colours, faces, count = [], [], [], [], 0
    for owner in (body, *(fixed if body == 0 else ())):
        for geom in visible(model, owner):
            made = _triangles(model, geom)
            if made is None:
                continue
            points, outward, triangles = made
            turn = data.geom_xmat[geom].reshape(3, 3) if body == 0 else _turn(model.geom_quat[geom])
            at = data.geom_xpos[geom] if body == 0 else model.geom_pos[geom]
            corners.append(points @ turn.T + at)
            normals.append(outward @ turn.T)
            colours.append(np.tile(255.0 * rgba(model, geom), (len(points), 1)))
            faces.append(triangles + count)
            count += len(points)
    plane = _ground(model) if body == 0 else None
    if not corners:
        return {"count": 0, "ground": plane}
    points = np.concatenate(corners)
    reach = float(np.abs(points).max()) or 1.0
    opaque = np.concatenate(colours)
    return {
        "count": sum(len(each) for each in faces) * 3, "reach": reach, "ground": plane,
        "corners": _small(points / reach), "normals": _small(np.concatenate(normals)),
        "colours": base64.b64encode(np.rint(opaque).astype(np.uint8).tobytes()).decode(),
        "faces": base64.b64encode(np.concatenate(faces).astype("<u4").tobytes()).decode(),
        "clear": bool(opaque[:, 3].min() < 250.0),
    }  # fmt: skip


def _ground(model: mujoco.MjModel) -> float | None:
    """Height of a plane that is fixed to the world [m]."""
    heights = [
        float(model.geom_pos[geom, 2]) for geom in visible(model, 0)
        if model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_PLANE)
    ]  # fmt: skip
    return max(heights, default=None)


def _turn(quaternion: NDArray[np.float64]) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _triangles(
    model: mujoco.MjModel, geom: int
) -> tuple[Array, Array, NDArray[np.int64]] | None:
    """Corners, normals and triangles of a geom in its frame; None for what is drawn otherwise."""
    kinds, size = mujoco.mjtGeom, model.geom_size[geom]
    kind = int(model.geom_type[geom])
    if kind == int(kinds.mjGEOM_BOX):
        return _box(size)
    if kind in (int(kinds.mjGEOM_SPHERE), int(kinds.mjGEOM_ELLIPSOID)):
        axes = size if kind == int(kinds.mjGEOM_ELLIPSOID) else np.full(3, size[0])
        points, normals, faces = _round(1.0, 0.0, ends=True)
        outward = normals / axes
        return points * axes, outward / np.linalg.norm(outward, axis=1, keepdims=True), faces
    if kind in (int(kinds.mjGEOM_CAPSULE), int(kinds.mjGEOM_CYLINDER)):
        return _round(size[0], size[1], ends=kind == int(kinds.mjGEOM_CAPSULE))
    if kind == int(kinds.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        first, many = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        faces = model.mesh_face[first : first + many]
        corner = model.mesh_vert[int(model.mesh_vertadr[mesh]) + faces].astype(np.float64)
        flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
        points = corner.reshape(-1, 3)
        return points, np.repeat(flat, 3, axis=0), np.arange(len(points)).reshape(-1, 3)
    return None


def _box(half: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    corners: list[Array] = []
    normals, faces = [], []
    for axis in range(3):
        for side in (1.0, -1.0):
            normal = np.zeros(3)
            normal[axis] = side
            u, v = np.roll(np.eye(3), -axis - 1, axis=0)[:2] * [[1.0], [side]]
            square = [normal + a * u + b * v for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
            k = len(corners)
            corners += square
            normals += [normal] * 4
            faces += [[k, k + 1, k + 2], [k, k + 2, k + 3]]
    return np.array(corners) * half, np.array(normals), np.array(faces)


def _round(radius: float, half: float, *, ends: bool) -> tuple[Array, Array, NDArray[np.int64]]:
    """A capsule about the third axis, or a cylinder with flat ends."""
    rings = []  # height, radius, and normal's height and radius
    if ends:
        for angle in np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9):
            up, out = np.sin(angle), np.cos(angle)
            for side in (-half, half) if abs(angle) < 1e-9 else (half if angle > 0 else -half,):
                rings.append((side + radius * up, radius * out, up, out))
    else:
        rings = [
            (-half, 0.0, -1.0, 0.0), (-half, radius, -1.0, 0.0), (-half, radius, 0.0, 1.0),
            (half, radius, 0.0, 1.0), (half, radius, 1.0, 0.0), (half, 0.0, 1.0, 0.0),
        ]  # fmt: skip
    turn = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    corners = np.array([[*(r * c), z] for z, r, _, _ in rings for c in circle])
    normals = np.array([[*(n * c), up] for _, _, up, n in rings for c in circle])
    faces = []
    for ring in range(len(rings) - 1):
        for i in range(_ROUND):
            a, b = ring * _ROUND + i, ring * _ROUND + (i + 1) % _ROUND
            faces += [[a, b, b + _ROUND], [a, b + _ROUND, a + _ROUND]]
    return corners, normals, np.array(faces)

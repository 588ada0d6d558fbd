"""TCAs drawn as coils: in a scene that is ready to be drawn, straight tendons become helices."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array

# A TCA has a coil every 0.7 mm, which no picture of a robot resolves: every second is drawn.
# Lengths in units of the tendon's radius, which is that of the coil outside.
_PITCH, _RADIUS, _WIRE = 2.4, 0.7, 0.38
_SIDES = 7  # pieces of a coil
_DARK = 0.35  # brightness of what is turned away
_UPRIGHT = 0.9  # of a first tangent, from which on another direction begins the coil


def wind(
    scene: mujoco.MjvScene, model: mujoco.MjModel, data: mujoco.MjData, tendons: NDArray[np.int64],
    height: int,
) -> None:  # fmt: skip
    """Draws coils in place of some tendons; a coil keeps its number of turns when it contracts.

    They are lines, a fraction of the cost of solids, shaded as if they were round.

    Args:
        scene: The scene, as ``mujoco.mjv_updateScene`` has left it; what is beyond its room is
            left out.
        model: Its model.
        data: Its state.
        tendons: Ids of the tendons.
        height: Height of the picture [pixels].
    """
    drawn = set(tendons.tolist())
    if not drawn:
        return
    for geom in scene.geoms[: scene.ngeom]:
        if geom.objtype == int(mujoco.mjtObj.mjOBJ_TENDON) and geom.objid in drawn:
            geom.size[:2] = _WIRE * geom.size[0] / 2.0  # a thread within the coil
    eye, points = scene.camera[0], data.wrap_xpos.reshape(-1, 3)
    fineness = height * eye.frustum_near / (2.0 * eye.frustum_top)  # pixels of 1 m at 1 m
    line, zero, frame = int(mujoco.mjtGeom.mjGEOM_LINE), np.zeros(3), np.eye(3).ravel()
    for tendon in tendons.tolist():
        first, width = data.ten_wrapadr[tendon], float(model.tendon_width[tendon])
        turns = max(1, round(float(model.tendon_length0[tendon]) / (_PITCH * width)))
        path = points[first : first + data.ten_wrapnum[tendon]]
        coil, out = _helix(path, turns, _RADIUS * width)
        towards = eye.pos - coil
        distance = np.linalg.norm(towards, axis=1)
        facing = np.einsum("ni,ni->n", out, towards) / distance
        shade = _DARK + (1.0 - _DARK) * (0.5 + 0.5 * facing)
        thick = np.maximum(fineness * 2.0 * _WIRE * width / distance, 1.0)
        colour = np.ones((len(coil), 4), dtype=np.float32)
        colour[:, :3] = shade[:, None] * model.tendon_rgba[tendon, :3]
        for k in range(min(len(coil) - 1, scene.maxgeom - scene.ngeom)):
            geom = scene.geoms[scene.ngeom]
            mujoco.mjv_initGeom(geom, line, zero, zero, frame, colour[k])
            mujoco.mjv_connector(geom, line, thick[k], coil[k], coil[k + 1])
            scene.ngeom += 1


def _helix(path: Array, turns: int, radius: float) -> tuple[Array, Array]:
    """Points of a helix about a path [m] and where out is there, shape (n, 3) each."""
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    path = path[np.append(True, step > 1e-9)]  # sites that lie on each other
    along = np.append(0.0, np.cumsum(step[step > 1e-9]))
    if len(path) < 2:
        return path, np.zeros_like(path)
    where = np.linspace(0.0, along[-1], _SIDES * turns + 1)
    middle = np.array([np.interp(where, along, column) for column in path.T]).T
    tangent = np.gradient(middle, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.array([0.0, 0.0, 1.0] if abs(tangent[0, 2]) < _UPRIGHT else [1.0, 0.0, 0.0])
    sides = np.empty_like(middle)
    for i, ahead in enumerate(tangent):  # carried along without turning about the path
        side = side - (side @ ahead) * ahead
        side /= np.linalg.norm(side)
        sides[i] = side
    turn = 2.0 * np.pi * turns * np.linspace(0.0, 1.0, len(middle))[:, None]
    out = np.cos(turn) * sides + np.sin(turn) * np.cross(tangent, sides)
    return middle + radius * out, out

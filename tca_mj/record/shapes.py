"""Bodies of a MuJoCo model as Rerun entities: their paths, their geoms, what moves."""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import rerun
from numpy.typing import NDArray

_VISIBLE_GROUPS = (0, 1, 2)  # geom groups that MuJoCo's own viewer shows
_UNSET = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default colour: a material replaces it


def body_paths(model: mujoco.MjModel) -> dict[int, str]:
    """Entity path of every body that has something to show, by body id."""
    shown = [b for b in range(model.nbody) if visible(model, b)]
    parts = {}
    for body in shown:
        name = model.body(body).name or f"body{body}"
        parts[body] = ("scene",) if body == 0 else tuple(name.split("."))
    above = {p[:i] for p in parts.values() for i in range(1, len(p))}
    taken: set[tuple[str, ...]] = {("tca",)}
    for body, part in parts.items():
        path = (*part, "_body") if part in above else part
        while path in taken:
            path = (*path[:-1], path[-1] + "_")
        taken.add(path)
        parts[body] = path
    return {
        body: "/world/" + "/".join(rerun.escape_entity_path_part(word) for word in part)
        for body, part in parts.items()
    }


def visible(model: mujoco.MjModel, body: int) -> list[int]:
    """Geoms of a body that are shown."""
    first = int(model.body_geomadr[body])
    geoms = range(first, first + int(model.body_geomnum[body])) if first >= 0 else range(0)
    return [g for g in geoms if model.geom_group[g] in _VISIBLE_GROUPS and rgba(model, g)[3] > 0]


def rgba(model: mujoco.MjModel, geom: int) -> NDArray[np.float64]:
    own, material = model.geom_rgba[geom], int(model.geom_matid[geom])
    if material >= 0 and np.array_equal(own, _UNSET):
        own = model.mat_rgba[material]
    return np.asarray(own, dtype=np.float64)


def moving_bodies(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Whether each body can move: it is not welded to the world, or it hangs on a mocap body."""
    mocap = model.body_mocapid[model.body_rootid] >= 0
    return np.asarray((model.body_weldid != 0) | mocap)


def extent(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[NDArray[np.float64], float]:
    """Centre (3,) and size [m] of what is shown and moves; of the whole model if nothing does."""
    moving = moving_bodies(model)
    geoms = [g for b in np.flatnonzero(moving) for g in visible(model, int(b))]
    if not geoms:
        return np.array(model.stat.center), float(model.stat.extent)
    reach = model.geom_rbound[geoms, None]
    low = (data.geom_xpos[geoms] - reach).min(axis=0)
    high = (data.geom_xpos[geoms] + reach).max(axis=0)
    return 0.5 * (low + high), float(np.linalg.norm(high - low))


def ground_height(model: mujoco.MjModel) -> float | None:
    """Height of the highest level plane that is fixed to the world [m], None without one."""
    heights = [
        float(model.geom_pos[g, 2])
        for g in visible(model, 0)
        if model.geom_type[g] == int(mujoco.mjtGeom.mjGEOM_PLANE)
        and _axis_z(model.geom_quat[g])[2] > 1.0 - 1e-9
    ]
    return max(heights, default=None)


def shapes(model: mujoco.MjModel, body: int, size: float) -> Iterator[tuple[str, Any]]:
    """Geometry of a body in its own frame: one entry per kind of geom, one per mesh."""
    solid = rerun.components.FillMode.Solid
    kinds: dict[int, list[int]] = {}
    for geom in visible(model, body):
        kinds.setdefault(int(model.geom_type[geom]), []).append(geom)
    types = mujoco.mjtGeom
    for kind, geoms in kinds.items():
        position, dimension = model.geom_pos[geoms], model.geom_size[geoms]
        look = {
            "quaternions": model.geom_quat[geoms][:, [1, 2, 3, 0]],
            "colors": rgba_bytes(np.array([rgba(model, g) for g in geoms])),
            "fill_mode": solid,
        }
        if kind == int(types.mjGEOM_PLANE):
            # A thin box below the surface; a plane without end reaches as far as one can see.
            thick = 0.002 * size
            half = np.where(dimension[:, :2] > 0.0, dimension[:, :2], 10.0 * size)
            half = np.column_stack([half, np.full(len(geoms), thick)])
            down = position - thick * _axis_z(model.geom_quat[geoms])
            yield "planes", rerun.Boxes3D(half_sizes=half, centers=down, **look)
        elif kind == int(types.mjGEOM_BOX):
            yield "boxes", rerun.Boxes3D(half_sizes=dimension, centers=position, **look)
        elif kind in (int(types.mjGEOM_CAPSULE), int(types.mjGEOM_CYLINDER)):
            look |= {"radii": dimension[:, 0], "lengths": 2.0 * dimension[:, 1]}
            if kind == int(types.mjGEOM_CYLINDER):
                yield "cylinders", rerun.Cylinders3D(centers=position, **look)
                continue
            # Rerun places a capsule by one end, MuJoCo by its centre.
            end = position - dimension[:, 1:2] * _axis_z(model.geom_quat[geoms])
            yield "capsules", rerun.Capsules3D(translations=end, **look)
        elif kind in (int(types.mjGEOM_SPHERE), int(types.mjGEOM_ELLIPSOID)):
            name, axes = ("ellipsoids", 3) if kind == types.mjGEOM_ELLIPSOID else ("spheres", 1)
            radii = np.broadcast_to(dimension[:, :axes], dimension.shape)
            yield name, rerun.Ellipsoids3D(half_sizes=radii, centers=position, **look)
        elif kind in (int(types.mjGEOM_MESH), int(types.mjGEOM_SDF)):
            for geom in geoms:
                yield f"mesh{geom}", _mesh(model, geom)


def _mesh(model: mujoco.MjModel, geom: int) -> rerun.Mesh3D:
    """Mesh of a geom in the body's frame, with a normal for each corner of each face.

    MuJoCo's normals are rounded off at the edges of a coarse mesh; where they leave the face by
    more than 60 deg, the face's own is taken, so that edges stay sharp.
    """
    mesh = int(model.geom_dataid[geom])
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    turn = matrix.reshape(3, 3)
    corner = model.mesh_vert[model.mesh_vertadr[mesh] + model.mesh_face[faces]]
    smooth = model.mesh_normal[model.mesh_normaladr[mesh] + model.mesh_facenormal[faces]]
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, None, :]
    flat = flat / np.maximum(np.linalg.norm(flat, axis=-1, keepdims=True), 1e-30)
    normal = np.where(np.sum(smooth * flat, axis=-1, keepdims=True) > 0.5, smooth, flat)
    return rerun.Mesh3D(
        vertex_positions=model.geom_pos[geom] + corner.reshape(-1, 3) @ turn.T,
        vertex_normals=normal.reshape(-1, 3) @ turn.T,
        triangle_indices=np.arange(corner.size // 3, dtype=np.uint32).reshape(-1, 3),
        albedo_factor=rgba_bytes(rgba(model, geom)),
    )


def _axis_z(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Third axis of frames, shape (..., 3), from MuJoCo's quaternions, shape (..., 4)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def rgba_bytes(colour: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Colours in [0, 1] as bytes, of the same shape."""
    return np.rint(255.0 * np.clip(colour, 0.0, 1.0)).astype(np.uint8)

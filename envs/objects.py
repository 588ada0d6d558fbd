"""Things that are grasped: what touches them, and how they stand and weigh."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray


def named(model: mujoco.MjModel, prefix: str) -> NDArray[np.bool_]:
    """Which geoms belong to bodies whose names begin so, shape (ngeom,).

    Args:
        model: The model.
        prefix: How the names begin.
    """
    return np.array([model.body(int(b)).name.startswith(prefix) for b in model.geom_bodyid])


def touching(data: mujoco.MjData, one: NDArray[np.bool_], other: NDArray[np.bool_]) -> bool:
    """Whether a geom of ``one`` touches a geom of ``other``, both as of ``named``."""
    pairs = data.contact.geom
    if len(pairs) == 0:
        return False
    return bool((one[pairs].any(axis=1) & other[pairs].any(axis=1)).any())


def stand(data: mujoco.MjData, start: int, place: ArrayLike, yaw: float = 0.0) -> None:
    """Puts a body with a free joint somewhere, turned about the vertical.

    Args:
        data: The state, which is changed.
        start: Where its positions begin in ``qpos``.
        place: Where its origin goes, shape (3,) [m].
        yaw: By how much it is turned [rad].
    """
    data.qpos[start : start + 3] = place
    data.qpos[start + 3 : start + 7] = [np.cos(yaw / 2.0), 0.0, 0.0, np.sin(yaw / 2.0)]


def weigh(model: mujoco.MjModel, bodies: Sequence[int], factor: float) -> None:
    """Multiplies masses and inertias of bodies that hang on nothing else.

    Args:
        model: The model, which is changed.
        bodies: Ids of a free body and all bodies on it.
        factor: The factor.
    """
    dofs = np.flatnonzero(np.isin(model.dof_bodyid, bodies))
    model.body_subtreemass[0] += (factor - 1.0) * model.body_mass[bodies].sum()
    for array in (model.body_mass, model.body_inertia, model.body_subtreemass):
        array[bodies] *= factor
    model.dof_M0[dofs] *= factor
    model.body_invweight0[bodies] /= factor
    model.dof_invweight0[dofs] /= factor

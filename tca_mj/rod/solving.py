"""What the solvers of a rod share: the path of growing loads, a nudge, and banded matrices."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array
from tca_mj.rod.errors import RodSolveError

S = TypeVar("S")

_NUDGE = 1e-2  # push off an unstable state [rad]


def load_up(
    start: S, solve: Callable[[S, S, float, float], S],
    fall: Callable[[S, float, float], tuple[float, S]] | None, shortest: float,
    goals: tuple[float, ...] = (1.0,),
) -> S:  # fmt: skip
    """Leads a rod from rest to the last of the goals, in steps as long as it can follow.

    Args:
        start: The rod at point 0 of the path.
        solve: From the two last states on the path, the next step over the last one, and the
            point it leads to, the state there.
        fall: What to do where steps of the shortest length fail: from the last state, its point
            and how far the next goal is, the step taken and the state after it; None gives up.
        shortest: Length of step at which to fall.
        goals: Rising points that no step may pass, as the path has corners there.

    Raises:
        RodSolveError: From ``fall``, or from ``solve`` without it.
    """
    state, at, step, taken = start, 0.0, 1.0, 1.0
    for goal in goals:
        last = state
        while at < goal:
            step = min(step, goal - at)
            try:
                found = solve(state, last, step / taken, at + step)
            except RodSolveError:
                if step > shortest:
                    step *= 0.5
                    continue
                if fall is None:
                    raise
                step, found = fall(state, at, goal - at)
            at += step
            last, state, taken = state, found, step
            step *= 2.0
    return state


def with_finer_meshes(solve: Callable[[int], S]) -> S:
    """What ``solve`` finds on the first of three meshes that it can, each twice as fine.

    Args:
        solve: From how many times as fine as the first a mesh is.

    Raises:
        RodSolveError: From the third.
    """
    for finer in (1, 2):
        with suppress(RodSolveError):
            return solve(finer)
    return solve(4)


def nudge(nodes: int) -> Array:
    """Small turns of the nodes of a clamped rod that leave an unstable state, (nodes, 3) [rad]."""
    arc = np.linspace(0.0, 1.0, nodes)[:, None]
    return _NUDGE * np.sin(np.pi * arc * [0.5, 1.5, 1.0] + [0.0, 0.0, 0.3])


def band_matrix(
    bands: tuple[int, int], size: int, entries: Iterable[tuple[Any, Any, ArrayLike]]
) -> Array:
    """A square matrix as ``scipy.linalg.solve_banded`` takes it.

    Args:
        bands: Diagonals below and above the main one.
        size: Number of rows.
        entries: Rows, columns and values of entries that are not zero, arrays that broadcast.

    Returns:
        The diagonals, the highest one first, shape (below + above + 1, size).
    """
    band = np.zeros((sum(bands) + 1, size))
    for row, column, value in entries:
        band[bands[1] + row - column, column] = value
    return band

"""Roots of rising functions inside a shrinking bracket, every element by itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array

Equation = Callable[[Array], tuple[Array, Array | float]]
"""Value and slope of a rising function."""

TOLERANCE = 1e-13  # error that a solved coil may have in length over fibre length
_CLOSED = 1e-14  # width of a bracket, or a correction, that ends the search
_STEPS = 200


class CoilSolveError(ArithmeticError):
    """The shape of a coil was not found.

    Attributes:
        residual: Largest error left in length/fibre_length [1].
    """

    def __init__(self, residual: float) -> None:
        super().__init__(
            f"coil not solved: length/fibre_length is off by {residual}, allowed {TOLERANCE}"
        )
        self.residual = residual


def closed(value: Array, step: Array, width: Array) -> NDArray[np.bool_]:
    """Whether a search is as close as it can get: no step left to take."""
    return (np.abs(step) <= _CLOSED) | (value == 0.0) | (width <= _CLOSED)


def bracketed(
    function: Equation, start: Array, low: float, high: float,
    done: Callable[[Array, Array, Array], NDArray[np.bool_]] = closed,
) -> Array:  # fmt: skip
    """Newton's method, and the middle of a bracket where it would leave that.

    Args:
        function: The function; NaN counts as too far from 0.
        start: First guesses, one dimension; one outside of the bracket is its middle instead.
        low: Lower end of the bracket, and the limit of the result where the function is positive
            everywhere.
        high: Upper end, the limit where it is negative everywhere.
        done: From value, Newton's step and width of the bracket, where a search is over.

    Raises:
        CoilSolveError: If one does not end.
    """
    below, above = np.full_like(start, low), np.full_like(start, high)
    point = np.where((start > low) & (start < high), start, 0.5 * (low + high))
    over = np.zeros(point.shape, dtype=bool)
    for _ in range(_STEPS):
        value, slope = function(point)
        short = (value < 0.0) | (np.isnan(value) & (point < 0.0))
        below = np.where(short & ~over, point, below)
        above = np.where(short | over, above, point)
        newton = point - value / slope
        over |= done(value, newton - point, above - below)
        if over.all():
            return point
        inside = (newton > below) & (newton < above)
        newton = np.where(inside, newton, 0.5 * (below + above))
        point = np.where(over, point, newton)
    raise CoilSolveError(float(np.max((above - below)[~over])))

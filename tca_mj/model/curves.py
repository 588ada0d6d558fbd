"""Smooth curves of TCAs through the cells of a chain: their lengths and what these depend on.

What stands before the axes named below is a batch: bodies built alike, at positions of their own.
Nothing here is rounded by a matrix product, whose order of summation depends on its size: a body
in a batch has, bit for bit, what it has alone.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.model.tendon import Crossing
from tca_mj.quadrature import GaussRule

# Gauss's rule along a cell, from 0 to 1: exact to 1e-8 for a quarter of a turn of a helix.
_RULE = GaussRule.of(4)
_POINTS, _WEIGHT = _RULE.node, _RULE.weight[:, None, None]


class Curves:
    """Curves through cells, one piece for each crossing of a cell.

    In a cell of length h that is turned by the rotation vector θ and stretched by e, with u = θ/h,
    a piece at the offset r(s) = (x, y) is ∫ |w| ds long,

        w = (x' - u₃ y, y' + u₃ x, 1 + e/h + u₁ y - u₂ x).
    """

    def __init__(self, crossings: Sequence[Crossing], cell: NDArray[np.int64]) -> None:
        """Reads the curves.

        Args:
            crossings: The pieces.
            cell: Which cell each is in, shape (crossings,).
        """
        count = len(crossings)
        self._cell = cell
        self._h = np.array([crossing.cell for crossing in crossings])
        offset, slope = np.empty((2, count, len(_POINTS), 2))
        for i, crossing in enumerate(crossings):
            start, end = crossing.span
            s = start + (end - start) * _POINTS
            offset[i] = crossing.leg.offset(s)
            slope[i] = crossing.leg.slope(s) * (end - start) / crossing.cell
        # At the points, with an axis for the batch, shape (points, 1, crossings).
        self._x, self._y = np.ascontiguousarray(offset.T)[:, :, None]
        self._dx, self._dy = np.ascontiguousarray(slope.T)[:, :, None]

    def lengths(self, motion: Array) -> tuple[Array, Array]:
        """Length of each piece, (..., crossings), and its slopes, (..., 4, crossings).

        Args:
            motion: Stretch [m] and rotation vector [rad] of each cell, shape (..., 4, cells).
        """
        lead = motion.shape[:-2]
        strain = motion.reshape(-1, *motion.shape[-2:]).take(self._cell, axis=-1) / self._h
        e, u1, u2, u3 = rows(strain)
        x, y = self._x, self._y
        wx = self._dx - u3 * y
        wy = self._dy + u3 * x
        wz = 1.0 + e + u1 * y - u2 * x
        norm = np.sqrt(wx * wx + wy * wy + wz * wz)
        each = self._h * np.add.reduce(_WEIGHT * norm, axis=0)
        share = _WEIGHT / norm
        wx *= share
        wy *= share
        wz *= share
        slope = np.empty_like(strain)
        np.add.reduce(wz, axis=0, out=slope[:, 0])
        np.add.reduce(wz * y, axis=0, out=slope[:, 1])
        np.add.reduce(wz * -x, axis=0, out=slope[:, 2])
        np.add.reduce(wy * x - wx * y, axis=0, out=slope[:, 3])
        return each.reshape(*lead, -1), slope.reshape(*lead, *slope.shape[1:])

    def straight(self) -> tuple[Array, Array]:
        """What the pieces are in the straight body.

        Returns:
            Their lengths, shape (crossings,) [m], and their second derivatives by the two bends of
            the cell, d²|w| = (|dw|² - (dw·w/|w|)²)/|w|, shape (2, crossings) [m]: the stiffness
            against bending that a tension has by them, per newton.
        """
        norm = np.sqrt(self._dx**2 + self._dy**2 + 1.0)
        length = np.sum(_WEIGHT * norm, axis=0)[0] * self._h
        per = 1.0 / self._h
        curving = [
            np.sum(_WEIGHT * ((lever**2 - (lever / norm) ** 2) / norm), axis=0)[0] * self._h
            for lever in (self._y * per, -self._x * per)
        ]
        return length, np.array(curving)


def summed(values: Array, place: NDArray[np.int64], size: int) -> Array:
    """Adds up the last axis by place, in its order; shape (..., k) to (..., size).

    Args:
        values: What is added up, shape (..., k).
        place: Where each goes, from 0 to size - 1, shape (k,).
        size: Number of places.
    """
    lead = values.shape[:-1]
    count = math.prod(lead)
    if lead:
        place = (place + size * np.arange(count)[:, None]).ravel()
    total: Array = np.bincount(place, values.ravel(), count * size).astype(np.float64, copy=False)
    return total.reshape(*lead, size) if lead else total


def rows(array: Array) -> tuple[Array, ...]:
    """The rows of the last axis but one, each of shape (..., k)."""
    return tuple(array if array.ndim == 2 else np.moveaxis(array, -2, 0))

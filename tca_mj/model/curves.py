"""Smooth curves of TCAs through the cells of a chain: their lengths and what these depend on.

What stands before the axes named below is a batch: bodies built alike, at positions of their own.
Nothing here is rounded by a matrix product, whose order of summation depends on its size: a body
in a batch has, bit for bit, what it has alone.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.model.sums import Form, Total, rows
from tca_mj.model.tendon import Crossing
from tca_mj.quadrature import GaussRule

# Gauss's rule along a cell, from 0 to 1: exact to 1e-8 for a quarter of a turn of a helix.
_RULE = GaussRule.of(4)
_POINTS = _RULE.node


class Curves:
    """Curves through cells, one piece for each crossing of a cell.

    In a cell of length h that is turned by the rotation vector θ and stretched by e, with u = θ/h,
    a piece at the offset r(s) = (x, y) is ∫ |w| ds long,

        w = (x' - u₃ y, y' + u₃ x, 1 + e/h + u₁ y - u₂ x).
    """

    def __init__(
        self, crossings: Sequence[Crossing], cell: NDArray[np.int64], cells: int
    ) -> None:
        """Reads the curves.

        Args:
            crossings: The pieces.
            cell: Which cell each is in, shape (crossings,).
            cells: Number of cells.
        """
        points, count = len(_POINTS), len(crossings)
        self._h = np.array([crossing.cell for crossing in crossings])
        self._cell = np.ones(4 * cells + 1)  # length of the cell of each motion
        self._cell[rows(0, 1, 2, 3, width=cells, columns=cell)] = np.tile(self._h, 4)
        offset, slope = np.empty((2, count, points, 2))
        for i, crossing in enumerate(crossings):
            start, end = crossing.span
            s = start + (end - start) * _POINTS
            offset[i] = crossing.leg.offset(s)
            slope[i] = crossing.leg.slope(s) * (end - start) / crossing.cell
        # At the points of all crossings, one row behind the other.
        x, y = self._offset = offset.T.reshape(2, -1)
        self._slope, self._weight = slope.T.reshape(2, -1), np.repeat(_RULE.weight, count)
        row, one = partial(rows, width=x.size), np.ones(x.size)
        moved = rows(3, 3, 0, 1, 2, width=cells, columns=np.tile(cell, points))
        moved = np.concatenate((np.full(3 * x.size, 4 * cells), moved))
        levers = [*self._slope, one, -y, x, one, y, -x]
        self._w = Form(row(0, 1, 2, 0, 1, 2, 2, 2), levers, moved, size=3 * x.size)
        arms, of = [one, y, -x, -y, x], row(2, 2, 2, 0, 1)
        self._slopes = Form(row(0, 1, 2, 3, 3), arms, of, size=4 * x.size)
        self._thrice = row(0, 0, 0)
        self._square = Total(self._thrice, x.size)
        point = partial(rows, width=count, columns=np.tile(np.arange(count), points))
        self._along, self._each = Total(point(0), count), Total(point(0, 1, 2, 3), 4 * count)

    def lengths(self, motion: Array) -> tuple[Array, Array]:
        """Length of each piece, (..., crossings), and its slopes, (..., 4, crossings).

        Args:
            motion: Stretch [m] and rotation vector [rad] of each cell, its rows one behind the
                other, and a 1 behind them, shape (..., 4 cells + 1).
        """
        w = self._w.of(motion / self._cell)
        norm = np.sqrt(self._square.of(w * w))
        each = self._h * self._along.of(self._weight * norm)
        w *= (self._weight / norm).take(self._thrice, axis=-1)
        slope = self._each.of(self._slopes.of(w))
        return each, slope.reshape(*each.shape[:-1], 4, -1)

    def straight(self) -> tuple[Array, Array]:
        """What the pieces are in the straight body.

        Returns:
            Their lengths, shape (crossings,) [m], and their second derivatives by the two bends of
            the cell, d²|w| = (|dw|² - (dw·w/|w|)²)/|w|, shape (2, crossings) [m]: the stiffness
            against bending that a tension has by them, per newton.
        """
        (dx, dy), (x, y) = self._slope, self._offset
        norm = np.sqrt(dx**2 + dy**2 + 1.0)
        per = 1.0 / np.tile(self._h, len(_POINTS))
        curving = [(lever**2 - (lever / norm) ** 2) / norm for lever in (y * per, x * per)]
        each = self._weight * np.array([norm, *curving])
        length, *curving = np.sum(each.reshape(3, len(_POINTS), -1), axis=1) * self._h
        return length, np.array(curving)

"""Smooth curves of TCAs through the cells of a chain: their lengths and what these depend on.

What stands before the axes named below is a batch: bodies built alike, at positions of their own.
Nothing here is rounded by a matrix product, whose order of summation depends on its size: a body
in a batch has, bit for bit, what it has alone.
"""

from collections.abc import Sequence
from typing import Any

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
        self, crossings: Sequence[Crossing], cell: NDArray[np.int64], moves: NDArray[np.bool_]
    ) -> None:
        """Reads the curves.

        Args:
            crossings: The pieces.
            cell: Which cell each is in, shape (crossings,).
            moves: Which motions the cells have, shape (4, cells). The others are 0; the slopes by
                them, which nobody asks for, too.
        """
        points, count, cells = len(_POINTS), len(crossings), moves.shape[1]
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
        # Row of w, motion, 4 being the constant, and lever; where the term is not always 0.
        (dx, dy), one = self._slope, np.ones(x.size)
        terms = ((0, 4, dx), (1, 4, dy), (2, 4, one),
                 (0, 3, -y), (1, 3, x), (2, 0, one), (2, 1, y), (2, 2, -x))  # fmt: skip
        within, moving = np.tile(cell, points), np.vstack((moves, np.ones(cells, np.bool_)))
        there = [np.flatnonzero((lever != 0.0) & moving[m, within]) for _, m, lever in terms]
        blocks = [(*term, k) for term, k in zip(terms, there, strict=True) if k.size]
        filled = sorted({row for row, *_ in blocks})
        place = {row: i * x.size for i, row in enumerate(filled)}
        to = [place[row] + k for row, _, _, k in blocks]
        of = [m * cells + within[k] * (m < 4) for _, m, _, k in blocks]
        levers = [lever[k] for *_, lever, k in blocks]
        self._w = Form(_joined(to), _joined(levers), _joined(of), size=len(filled) * x.size)
        self._again = np.tile(np.arange(x.size), len(filled))
        self._straight, self._square = len(filled) == 1, Total(self._again, x.size)
        # The slopes are the same terms the other way round, added up over the points.
        self._along = Total(np.tile(np.arange(count), points), count)
        moved = [i for i, (_, m, _, _) in enumerate(blocks) if m < 4]
        levers, of = [levers[i] for i in moved], [to[i] for i in moved]
        by = [blocks[i][1] * x.size + blocks[i][3] for i in moved]
        every = rows(0, 1, 2, 3, width=count, columns=self._along.place)
        self._each: Total | None = None
        places, size = _joined(by), 4 * x.size
        if np.unique(places).size == places.size:  # at once, where no point has a sum of its own
            places, size = every[places], 4 * count
        else:
            self._each = Total(every, 4 * count)
        self._slopes = Form(places, _joined(levers), _joined(of), size=size)

    def lengths(self, motion: Array) -> tuple[Array, Array]:
        """Length of each piece, (..., crossings), and its slopes, (..., 4, crossings).

        Args:
            motion: Stretch [m] and rotation vector [rad] of each cell, its rows one behind the
                other, and a 1 behind them, shape (..., 4 cells + 1).
        """
        w = self._w.of(motion / self._cell)
        norm = np.abs(w) if self._straight else np.sqrt(self._square.of(w * w))
        each = self._h * self._along.of(self._weight * norm)
        share = self._weight / norm
        w *= share if self._straight else share.take(self._again, axis=-1)
        slope = self._slopes.of(w)
        if self._each is not None:
            slope = self._each.of(slope)
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


def _joined(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Parts one behind the other; whole numbers if there are none, which is what places are."""
    return np.concatenate(parts) if parts else np.empty(0, np.int64)

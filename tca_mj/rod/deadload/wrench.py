"""Wrench along a clamped rod under a dead load at its free end: collocation and Newton's method.

In the frame of the section, with the reference strain u*, u = u* + C m and v = e_z + D n (C, D
diagonal compliances), the balance of a Cosserat rod without distributed loads reads

    m' = m x u + n x v        n' = n x u.

A force F fixed in the world is the same in every section, n = R^T F. So the orientations R are
not needed to find the wrench: n is known at the base, where R is, and m at the end. A
moment fixed in the world is a third vector c with c' = c x u, known at the base, and m = c
at the end. The equations are pure numbers: the caller scales them, curvatures to about one.

Collocation at Lobatto's three points, fourth order: y_mid = (y0 + y1)/2 + h/8 (f0 - f1) and
y1 - y0 = h/6 (f0 + 4 f_mid + f1), is a banded system in the values at the nodes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import LinAlgError, solve_banded

from tca_mj.checks import Array
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import hat
from tca_mj.rod.solving import band_matrix

_RESIDUAL = 1e-12  # goal of Newton's method, over the largest component of the wrench (at least 1)
_NEWTON_STEPS = 15
_HALVINGS = 3  # of one Newton step, until the residual falls

FULL = 2.0
"""Last point of the path from no load and no heat: at 1 all of the load, at 2 all of the heat."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DeadLoad:
    """The scaled problem on one mesh of N equal intervals.

    Attributes:
        step: Length h of an interval.
        reference: u* at nodes and middles in turn, shape (2 N + 1, 3).
        heat: What heating adds to u*, shape (3,).
        angular: Diagonal of C, shape (3,).
        linear: Diagonal of D, shape (3,).
        vectors: Force and, if there is one, moment in the frame of the base, shape (1 or 2, 3).
    """

    step: float
    reference: Array
    heat: Array
    angular: Array
    linear: Array
    vectors: Array

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return len(self.reference) // 2

    @property
    def size(self) -> int:
        """Unknowns per node: the moment and the vectors."""
        return 3 + self.vectors.size

    def unloaded(self, at: float) -> Array:
        """u of the unloaded rod at a point of the path, nodes and middles, (2 N + 1, 3)."""
        return self.reference + max(at - 1.0, 0.0) * self.heat

    def load(self, at: float) -> Array:
        """``vectors`` at a point of the path."""
        return min(at, 1.0) * self.vectors

    def newton(self, guess: Array, at: float = FULL) -> tuple[Array, float]:
        """Newton's method on one point of the path: load min(at, 1), heat max(at - 1, 0).

        Args:
            guess: State (m, n) or (m, n, c) at the nodes, shape (N + 1, 6 or 9).
            at: Point of the path.

        Returns:
            State, and the largest residual of the equations.

        Raises:
            RodSolveError: If it does not converge.
        """
        state = guess
        residual, jacobian = self._residual(state, at)
        size = float(np.abs(residual).max())
        for _ in range(_NEWTON_STEPS):
            goal = _RESIDUAL * max(1.0, float(np.abs(state).max()))
            if size <= goal:
                return state, size
            try:
                change = solve_banded(self._bands, self._banded(jacobian), -residual)
            except LinAlgError:
                break
            for halving in range(_HALVINGS + 1):
                trial = state + 0.5**halving * change.reshape(state.shape)
                with np.errstate(over="ignore", invalid="ignore"):
                    residual, jacobian = self._residual(trial, at)
                new = float(np.abs(residual).max())
                if new < size or new <= goal:
                    break
            else:
                break
            state, size = trial, new
        raise RodSolveError("Newton's method does not converge", size)

    def strain(self, state: Array, at: float = FULL) -> tuple[Array, Array]:
        """u and v at nodes and middles, two arrays of shape (2 N + 1, 3)."""
        reference = self.unloaded(at)
        slope, _ = self._slope(state, reference[::2])
        full = np.empty((2 * self.intervals + 1, self.size))
        full[::2] = state
        full[1::2] = self._middle(state, slope)
        angular = reference + self.angular * full[:, :3]
        return angular, np.array([0.0, 0.0, 1.0]) + self.linear * full[:, 3:6]

    def _middle(self, state: Array, slope: Array) -> Array:
        return 0.5 * (state[:-1] + state[1:]) + 0.125 * self.step * (slope[:-1] - slope[1:])

    def _slope(self, state: Array, reference: Array) -> tuple[Array, Array]:
        """y' and its derivative by y, shapes (n, size) and (n, size, size)."""
        turn = reference + self.angular * state[:, :3]
        stretch = np.array([0.0, 0.0, 1.0]) + self.linear * state[:, 3:6]
        slope = np.empty_like(state)
        jacobian = np.zeros((*state.shape, self.size))
        spin = hat(turn)
        for k in range(0, self.size, 3):
            part = slice(k, k + 3)
            slope[:, part] = np.cross(state[:, part], turn)
            jacobian[:, part, :3] = hat(state[:, part]) * self.angular
            jacobian[:, part, part] -= spin
        slope[:, :3] += np.cross(state[:, 3:6], stretch)
        jacobian[:, :3, 3:6] += hat(state[:, 3:6]) * self.linear - hat(stretch)
        return slope, jacobian

    def _residual(self, state: Array, at: float) -> tuple[Array, tuple[Array, Array]]:
        """All equations in the order base, intervals, end, and the blocks by y0 and y1."""
        reference = self.unloaded(at)
        h, one = self.step, np.eye(self.size)
        slope, jacobian = self._slope(state, reference[::2])
        middle, bent = self._slope(self._middle(state, slope), reference[1::2])
        gap = state[1:] - state[:-1] - h / 6.0 * (slope[:-1] + 4.0 * middle + slope[1:])
        before = -one - h / 6.0 * (jacobian[:-1] + bent @ (2.0 * one + 0.5 * h * jacobian[:-1]))
        after = one - h / 6.0 * (jacobian[1:] + bent @ (2.0 * one - 0.5 * h * jacobian[1:]))
        base = state[0, 3:] - self.load(at).ravel()
        end = state[-1, :3] - (state[-1, 6:9] if self.size > 6 else 0.0)
        return np.concatenate([base, gap.ravel(), end]), (before, after)

    @property
    def _bands(self) -> tuple[int, int]:
        """Diagonals below and above the main one."""
        return 2 * self.size - 4, self.size + 2

    def _banded(self, blocks: tuple[Array, Array]) -> Array:
        d, base = self.size, np.arange(self.size - 3)
        total = d * (self.intervals + 1)
        first = d * np.arange(self.intervals)[:, None, None]
        last, end = total - 3 + np.arange(3), total - d + np.arange(3)  # rows, columns of m
        entries: list[tuple[Any, Any, ArrayLike]] = [
            (base, base + 3, 1.0),
            (d - 3 + first + np.arange(d)[:, None], first + np.arange(2 * d), np.dstack(blocks)),
            (last, end, 1.0),
        ]
        if d > 6:
            entries.append((last, end + 6, -1.0))
        return band_matrix(self._bands, total, entries)

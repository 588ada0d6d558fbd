"""Stable equilibria of a rod under a dead load: the path to them, and where it snaps.

The wrench (``wrench``) is followed from the cold rod without load while first the load and then
the heat grows, as in an experiment. A soft rod that is pushed, or turns inside out, can lose
its stability on the way; Newton's method would find nothing there, or a state that no rod
stays in. The energy decides: with Theta_i the rotation vector from node i to i + 1,

    E = sum_i h/2 (Theta_i/h - u*) K (Theta_i/h - u*) - sum_i w_i (n_z + n D n/2),    n = R_i^T F

(the second sum is the load's work with the best stretch v, w_i are the trapezoidal weights) is
minimal in a stable state. It falls, by damped Newton steps, until it finds one; the
collocation of fourth order then takes over. A moment fixed in the world has no energy: with one,
the path is followed as long as it can be, and stability is not known.
"""

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from tca_mj.checks import Array
from tca_mj.rod.deadload.wrench import FULL, DeadLoad
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import (
    integrate_strain,
    quaternion_exp,
    quaternion_log,
    quaternion_matrix,
    quaternion_product,
)
from tca_mj.rod.solving import load_up, nudge

_Found = tuple[Array, float]  # state and largest residual

_IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
_AXIS = np.array([0.0, 0.0, 1.0])
_SHORTEST = 2.0**-6  # step along the path before the energy is asked
_STEPS = 400  # of the descent
# Stiffness that counts as none, over that of a straight rod's softest bending: a straight rod
# may buckle in any plane, and turns freely from one to the other.
_NEUTRAL = 1e-3
_FLAT = 1e-6  # goal for the gradient of the energy, in scaled moments
_DIFFERENCE = 1e-5  # of the gradient, for the Hessian [rad]


def follow(problem: DeadLoad) -> _Found:
    """The wrench at the nodes under the full load and heat.

    Returns:
        State, shape (N + 1, 6 or 9), and the largest residual of the equations.

    Raises:
        RodSolveError: If neither Newton's method nor the energy finds a state on the way.
    """
    start = np.zeros((problem.intervals + 1, problem.size)), 0.0
    if not problem.vectors.any():
        return start

    def solve(now: _Found, last: _Found, ratio: float, at: float) -> _Found:
        found, residual = problem.newton(now[0] + (now[0] - last[0]) * ratio, at)
        if not _stable(problem, found, at):
            raise RodSolveError("the state is not stable", residual)
        return found, residual

    def fall(now: _Found, at: float, left: float) -> tuple[float, _Found]:
        """The first step, of those that double up to ``left``, after which the rod has settled."""
        step = min(_SHORTEST, left)
        while True:
            try:
                return step, _snapped(problem, now[0], at, at + step)
            except RodSolveError:
                if step == left:
                    raise
                step = min(2.0 * step, left)

    goals = (1.0, FULL) if problem.heat.any() else (1.0,)
    return load_up(start, solve, None if problem.size > 6 else fall, _SHORTEST, goals)


def _stable(problem: DeadLoad, state: Array, at: float = FULL) -> bool:
    """Whether the energy is minimal in a solved state; True if a moment acts, which has none."""
    if problem.size > 6:
        return True
    energy = _Energy(problem, at)
    frames = energy.frames(state, at)
    # The discrete energy is stationary near this state, not in it, and only there the check is
    # sharp: two steps lead there.
    for share in (100.0, 10.0, 1.0):
        step = energy.newton_step(frames, share * energy.neutral)
        if step is None:
            return False
        frames = energy.turned(frames, step)
    return True


def _snapped(problem: DeadLoad, state: Array, before: float, at: float) -> tuple[Array, float]:
    """The stable state into which a rod falls that had ``state`` just before.

    Args:
        problem: The rod.
        state: Solved wrench at the point ``before`` of the path.
        before: Point of the path.
        at: Point of the path, a little further.

    Returns:
        State and largest residual.

    Raises:
        RodSolveError: If the descent does not end, or the collocation has no stable state there.
    """
    energy = _Energy(problem, at)
    found, residual = problem.newton(energy.wrench(energy.fallen(energy.frames(state, before))), at)
    if not _stable(problem, found, at):
        raise RodSolveError("the energy has no minimum nearby", residual)
    return found, residual


class _Energy:
    """The discrete energy as a function of the quaternions at the nodes, in the base's frame."""

    def __init__(self, problem: DeadLoad, at: float) -> None:
        self._problem = problem
        self._step = problem.step
        u = problem.unloaded(at)
        self._reference = (u[:-2:2] + 4.0 * u[1::2] + u[2::2]) / 6.0
        self._load = problem.load(at)[0]
        self._weight = np.full((problem.intervals + 1, 1), problem.step)
        self._weight[[0, -1]] *= 0.5
        length = problem.step * problem.intervals
        softest = (0.5 * np.pi / length) ** 2 / float(problem.angular.max())
        self.neutral = _NEUTRAL * softest

    def frames(self, state: Array, at: float) -> Array:
        """Quaternions at the nodes of a wrench."""
        strain = self._problem.strain(state, at)
        return integrate_strain(*strain, self._step, _IDENTITY)[0]

    def wrench(self, frames: Array) -> Array:
        """The state in these frames: the moment is the lever of the force about each node."""
        force = self._force(frames)
        stretch = _AXIS + self._problem.linear * force
        rotation = quaternion_matrix(frames)
        slope = np.einsum("nij,nj->ni", rotation, stretch)
        position = np.vstack([np.zeros(3), np.cumsum(slope[1:] + slope[:-1], axis=0)])
        moment = np.cross(0.5 * self._step * (position[-1] - position), self._load)
        return np.hstack([np.einsum("nij,ni->nj", rotation, moment), force])

    def fallen(self, frames: Array) -> Array:
        """The frames after the energy has fallen to a minimum.

        Raises:
            RodSolveError: If it has not after many steps.
        """
        frames = self.turned(frames, nudge(len(frames))[1:])
        value, damping, size = self._value(frames), 1e-2, np.inf
        for _ in range(_STEPS):
            size = float(np.abs(self._gradient(frames)[1:]).max())
            step = self.newton_step(frames, damping)
            if step is not None:
                if size < _FLAT and damping == self.neutral:
                    return frames
                step *= min(1.0, 0.3 / float(np.abs(step).max()))
                trial = self.turned(frames, step)
                new = self._value(trial)
                if new <= value + 1e-13 * abs(value):
                    frames, value = trial, new
                    damping = max(0.2 * damping, self.neutral)
                    continue
            damping = max(4.0 * damping, 1e-8)
        raise RodSolveError("the energy does not settle", size)

    def newton_step(self, frames: Array, damping: float) -> Array | None:
        """-(H + damping h)^-1 gradient, shape (N, 3); None unless H + damping h is positive."""
        band = self._hessian(frames)
        band[0] += damping * self._step
        try:
            factor = cholesky_banded(band, lower=True)
        except LinAlgError:
            return None
        step: Array = -cho_solve_banded((factor, True), self._gradient(frames)[1:].ravel())
        return step.reshape(-1, 3)

    def turned(self, frames: Array, angle: Array) -> Array:
        """The frames, all but the clamped one turned by ``angle`` about their own axes."""
        turned = frames.copy()
        turned[1:] = quaternion_product(frames[1:], quaternion_exp(angle))
        return turned

    def _force(self, frames: Array) -> Array:
        return np.einsum("nij,i->nj", quaternion_matrix(frames), self._load)

    def _turns(self, frames: Array) -> tuple[Array, Array]:
        """Theta and the moments of the intervals."""
        back = frames[:-1] * [1.0, -1.0, -1.0, -1.0]
        turn = quaternion_log(quaternion_product(back, frames[1:]))
        return turn, (turn / self._step - self._reference) / self._problem.angular

    def _value(self, frames: Array) -> float:
        turn, moment = self._turns(frames)
        bent = 0.5 * np.sum(moment * (turn - self._step * self._reference))
        force = self._force(frames)
        work = force[:, 2:] + 0.5 * np.sum(force * force * self._problem.linear, 1, keepdims=True)
        return float(bent - np.sum(self._weight * work))

    def _gradient(self, frames: Array) -> Array:
        """dE by a turn of each node about its own axes, shape (N + 1, 3)."""
        turn, moment = self._turns(frames)
        size = np.linalg.norm(turn, axis=1, keepdims=True)
        half = 0.5 * np.maximum(size, 1e-3)
        # Derivative of the logarithm: 1 -+ Theta x/2 + c Theta x Theta x.
        c = (1.0 - half / np.tan(half)) / np.square(2.0 * half)
        across = np.cross(turn, moment)
        twice = moment + c * np.cross(turn, across)
        force = self._force(frames)
        gradient = self._weight * np.cross(force, _AXIS + self._problem.linear * force)
        gradient[1:] += twice - 0.5 * across
        gradient[:-1] -= twice + 0.5 * across
        return gradient

    def _hessian(self, frames: Array) -> Array:
        """Lower band of the symmetric Hessian, the clamped node left out, shape (6, 3 N).

        Differences of the gradient: nodes three apart do not see each other, so that nine pairs
        of gradients give all of it.
        """
        count = len(frames) - 1
        blocks = np.zeros((count, 3, 3, 3))  # node, neighbour before/itself/after, row, column
        for first in range(3):
            nodes = np.arange(first, count, 3)
            for axis in range(3):
                angle = np.zeros((count, 3))
                angle[nodes, axis] = _DIFFERENCE
                change = self._gradient(self.turned(frames, angle))
                change -= self._gradient(self.turned(frames, -angle))
                padded = np.vstack([change / (2.0 * _DIFFERENCE), np.zeros(3)])
                for side in range(3):
                    blocks[nodes, side, :, axis] = padded[nodes + side]
        diagonal = 0.5 * (blocks[:, 1] + np.swapaxes(blocks[:, 1], 1, 2))
        below = blocks[:-1, 2] + np.swapaxes(blocks[1:, 0], 1, 2)
        band = np.zeros((6, 3 * count))
        for row in range(3):
            for column in range(row + 1):
                band[row - column, column::3] = diagonal[:, row, column]
            for column in range(3):
                band[3 + row - column, column : 3 * (count - 1) : 3] = 0.5 * below[:, row, column]
        return band

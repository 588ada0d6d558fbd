"""A plane, pre-curved rod whose ends a band pulls together: the bistable module by theory.

The rod bends and does nothing else (the elastica). Its curvature is a sum of Legendre polynomials,
κ(s) = Σ c_k P_k(2 s/L - 1)/L, of which c_0 is the angle θ of the tip; the band is a spring between
base and tip that cannot push. For a given θ the rod takes the other coefficients that make its
energy least, which Newton's method finds: that is the energy landscape U(θ). A cable at the
distance h from the axis shortens by h θ and so needs the tension U'(θ)/h; what it needs at most on
its way is the force that triggers the other state.

A uniform pre-curvature enters the energy as -EI/L θ0 θ and a constant alone. Hence both triggering
forces are straight lines over θ0: EI/L (θc - θ0)/h and EI/L (θc + θ0)/h, with θc that of a straight
rod.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Legendre, legendre
from scipy.optimize import brentq, minimize_scalar

from tca_mj.checks import Angle, Array, Checked, NotNegative, Positive, door, within

_TERMS = 13  # polynomials: the thresholds are exact by a millionth
_POINTS = 40  # of the quadrature
_TURN = 3.0  # bends that are looked at, to both sides [rad]
_STEP = 1e-5  # of a difference [rad]
_ROUNDS, _CLOSE = 60, 1e-11  # of Newton's method, the latter [rad]


class Thresholds(NamedTuple):
    """Tensions of a cable that trigger the other state.

    Attributes:
        first: That to state 1, the negative bend [N].
        second: That to state 2 [N]; not positive if there is only state 2.
    """

    first: float
    second: float


@cache
def _shapes() -> tuple[Array, Array, Array]:
    """Weights of the quadrature over 0 to 1, the polynomials there, and their integrals."""
    point, weight = legendre.leggauss(_POINTS)
    each = [Legendre.basis(k)(point) for k in range(_TERMS)]
    whole = [0.5 * Legendre.basis(k).integ(lbnd=-1.0)(point) for k in range(_TERMS)]
    return 0.5 * weight, np.array(each), np.array(whole)


@cache
def _sums() -> Array:
    """Weights of the integral of a function from 0 to each point of the quadrature."""
    weight = _shapes()[0]
    return np.tril(np.tile(weight, (_POINTS, 1))) - 0.5 * np.diag(weight)


@dataclass(frozen=True, kw_only=True, slots=True)
class BandedRod(Checked):
    """A rod with a band from base to tip.

    Attributes:
        length: Length L of the rod [m].
        stiffness: Bending stiffness of the whole rod, EI/L [N m/rad].
        angle: Angle θ0 of the tip of the unloaded rod without the band [rad].
        band: Stiffness of the band [N/m].
        band_length: Length of the slack band [m].
        force: Dead force on the tip, towards the positive bend and along the base [N].

    Raises:
        ValueError: If a number is out of range.
    """

    length: Positive
    stiffness: Positive
    angle: Angle
    band: NotNegative
    band_length: Positive
    force: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        within("force", self.force, shape=(2,), unit="N")

    @door
    def lumped(self, bend: Angle) -> float:
        """Energy of a rod that stays an arc (Sun, eq. 4.5; a slack band has none) [J].

        Args:
            bend: Angle θ of the tip [rad].
        """
        chord = self.length * float(np.sinc(0.5 * bend / math.pi))
        more = max(0.0, chord - self.band_length)
        return 0.5 * self.stiffness * (bend - self.angle) ** 2 + 0.5 * self.band * more**2

    @door
    def energy(self, bend: Angle) -> float:
        """Energy U of the rod at an angle θ of its tip [rad], all else free [J]."""
        return self._least(bend)[0]

    @door
    def tip(self, bend: Angle) -> tuple[float, float]:
        """Where the tip is then, towards the positive bend and along the base [m]."""
        turn = self._least(bend)[2] @ _shapes()[2]
        weight = self.length * _shapes()[0]
        return float(weight @ np.sin(turn)), float(weight @ np.cos(turn))

    @door
    def curvature(self, bend: Angle) -> tuple[float, ...]:
        """Coefficients c of the curvature there [rad]."""
        return tuple(self._least(bend)[2].tolist())

    @door
    def moment(
        self, bend: Angle, *, lumped: bool = False, friction: NotNegative = 0.0
    ) -> float:
        """Moment that keeps the rod at an angle of its tip: U'(θ), if there is no friction [N m].

        Args:
            bend: The angle [rad].
            lumped: Whether the rod stays an arc.
            friction: Of the cable in its channel: pulled at the base, its tension falls towards
                the tip by exp(-friction) for every radian that the channel turns (Euler). The
                moment is that at the base then.
        """
        if lumped:
            return (self.lumped(bend + _STEP) - self.lumped(bend - _STEP)) / (2.0 * _STEP)
        return self._least(bend, friction)[1]

    @door
    def thresholds(
        self, lever: Positive, *, lumped: bool = False, friction: NotNegative = 0.0
    ) -> Thresholds:
        """Tensions of a cable that trigger each state.

        Args:
            lever: Distance of the cable from the axis [m].
            lumped: As in ``moment``.
            friction: As in ``moment``.
        """

        def largest(sign: float) -> float:
            """Largest moment on the way to the top, from the other side."""

            def needed(bend: float) -> float:
                return sign * self.moment(-sign * bend, lumped=lumped, friction=friction)

            grid = np.linspace(0.0, _TURN, 31)
            best = int(np.argmax([needed(bend) for bend in grid]))
            ends = grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)]
            found = minimize_scalar(lambda bend: -needed(bend), bounds=ends, method="bounded")
            return float(-found.fun) / lever

        return Thresholds(largest(-1.0), largest(1.0))

    @door
    def states(self, *, lumped: bool = False) -> tuple[float, ...]:
        """Angles at which the rod rests by itself, stable and unstable in turn [rad].

        Args:
            lumped: As in ``moment``.
        """
        grid = np.linspace(-_TURN, _TURN, 62)
        values = [self.moment(bend, lumped=lumped) for bend in grid]
        found = [
            brentq(lambda bend: self.moment(bend, lumped=lumped), *ends)
            for *ends, left, right in zip(grid, grid[1:], values, values[1:], strict=False)
            if left * right < 0.0
        ]
        return tuple(float(angle) for angle in found)

    def _least(self, bend: float, friction: float = 0.0) -> tuple[float, float, Array]:
        """Energy at rest at an angle, the cable's moment there, and the coefficients."""
        weight, each, whole = _shapes()
        own = self.stiffness / (2.0 * np.arange(_TERMS) + 1.0)
        found, rest = np.zeros((2, _TERMS))
        push = np.array(self.force)
        found[0], rest[0] = bend, self.angle
        pulled = np.eye(_TERMS)[0]  # of a moment at the base, what moves each coefficient
        for _ in range(_ROUNDS):
            turn = found @ whole
            sine, cosine = np.sin(turn) * weight, np.cos(turn) * weight
            end = self.length * np.array([sine.sum(), cosine.sum()])
            chord = float(np.hypot(*end))
            more = max(0.0, chord - self.band_length)
            ends = self.length * np.array([whole @ cosine, -(whole @ sine)])
            along = end @ ends / chord
            slope = own * (found - rest) + self.band * more * along
            second = np.diag(own)
            if push.any():
                slope -= push @ ends
                second += self.length * (whole * (push[0] * sine + push[1] * cosine)) @ whole.T
            if more:
                bowed = (whole * (end[0] * sine + end[1] * cosine)) @ whole.T
                curved = (ends.T @ ends - np.outer(along, along) - self.length * bowed) / chord
                second += self.band * (np.outer(along, along) + more * curved)
            if friction:
                curvature = np.abs(found @ each)
                passed = np.array([curvature @ row for row in _sums()])
                pulled = each @ (weight * np.exp(-friction * passed))
            moment = float(slope[0] / pulled[0])
            change = -np.linalg.solve(second[1:, 1:], (slope - moment * pulled)[1:])
            found[1:] += change
            if np.abs(change).max() < _CLOSE:
                break
        energy = 0.5 * float(own @ (found - rest) ** 2) + 0.5 * self.band * more**2
        energy -= float(push @ end)
        return energy, moment, found

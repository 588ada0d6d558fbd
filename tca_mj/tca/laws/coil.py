"""What the static models of a coil share, and the first of them, the Cosserat rod.

All models describe a uniform helix of fibre by one unknown, s = sin b with b the pitch of the
fibre's sections, and give two things for it: the axial force and the length. Heat and load
soften all moduli alike, and a hot section stiffens bending and torsion alike, so that both are
taken out: laws are in phi, the force that the coil would need with the moduli and the section
of the reference temperature. The true force is phi e g^4, with e the share of the moduli left
and g the growth of a hot section's radius (1 for a cold one). Shear and stretch depend on g^2
only: their compliances are multiplied by g^2 instead.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.tca.laws.rod import Point, sheared
from tca_mj.tca.laws.roots import Equation, bracketed
from tca_mj.tca.spec import TcaSpec

Mask = NDArray[np.bool_] | slice
Spin = Literal["free", "locked"]

ALL = slice(None)
_ACCEPTED = 1e-9  # last correction of Newton's method: what is left is its square, times 1000


class Coil(NamedTuple):
    """Constants of one TCA with the moduli and the section of the reference temperature."""

    winding: float  # W* = cos(alpha*)/r* [rad/m]
    sin: float  # of alpha*
    bending: float  # EI [N m^2]
    torsion: float  # GJ [N m^2]
    shear: float  # 1/GA [1/N]
    stretch: float  # 1/EA [1/N]

    @classmethod
    def of(cls, tca: TcaSpec) -> "Coil":
        """Collects the numbers of ``tca``."""
        fibre = tca.fibre
        return cls(
            winding=tca.winding, sin=math.sin(tca.pitch_angle),
            bending=fibre.young * fibre.second_moment,
            torsion=fibre.shear * 2.0 * fibre.second_moment, shear=1.0 / (fibre.shear * fibre.area),
            stretch=1.0 / (fibre.young * fibre.area),
        )  # fmt: skip


class Heated(NamedTuple):
    """What the temperature does to the coil, arrays of one shape (``growth2`` may be a scalar)."""

    untwist: Array  # per fibre length, negative when hot [rad/m]
    growth2: Array  # g^2 of the section, 1 for a cold section
    unloaded: Array  # s of the heated coil without load; for rods only a first guess

    def part(self, mask: Mask) -> "Heated":
        """The elements of a mask."""
        growth2 = self.growth2[mask] if self.growth2.ndim else self.growth2
        return Heated(self.untwist[mask], growth2, self.unloaded[mask])


Law = Callable[[Heated, Array], Point]


def rod_law(coil: Coil, spin: Spin, *, rigid: bool = False) -> Law:
    """Cosserat rod as a uniform helix under an axial force, exact.

    The four equations of ``tca_mj.tca.laws.rod`` [Sun, dissertation, Colorado State University,
    eqs. (3.5)-(3.8)], there for locked ends. An end free to spin takes no axial moment, M = 0;
    then the winding W is unknown, and the first two equations, which are linear in W, give

        W(s) = (EI kappa* cos b + GJ (tau* + untwist) s) / (EI cos^2 b + GJ s^2).

    With locked ends W = cos(alpha*)/r*. In both cases, with D = 1/EA - 1/GA,

        phi + s D phi^2 = W ((GJ - EI) W s - GJ (tau* + untwist) + EI kappa* tan b)
        l/l_t           = s + phi (1/GA + s^2 D).

    Args:
        coil: Constants of the TCA.
        spin: Whether an end may spin about the axis.
        rigid: Whether to leave out shear and stretch, GA, EA -> infinity: Kirchhoff's rod.
    """
    cos = math.sqrt(1.0 - coil.sin * coil.sin)
    bent = coil.bending * coil.winding * cos  # EI kappa*
    bending, torsion, winding0 = coil.bending, coil.torsion, coil.winding
    twist0 = winding0 * coil.sin
    difference = torsion - bending
    excess0 = 0.0 if rigid else coil.stretch - coil.shear

    def law(heated: Heated, sin: Array) -> Point:
        sin2 = sin * sin
        cos2 = 1.0 - sin2
        cos = np.sqrt(cos2)
        tan = sin / cos
        twisted = torsion * (twist0 + heated.untwist)
        if spin == "free":
            inverse = 1.0 / (bending + difference * sin2)
            winding = (bent * cos + twisted * sin) * inverse
            turn = (twisted - bent * tan - (2.0 * difference) * sin * winding) * inverse
            lever = difference * winding
            torque = lever * sin - twisted + bent * tan
            pull = winding * torque
            slope = turn * (torque + lever * sin) + winding * (lever + bent / (cos2 * cos))
        else:
            turned = winding0 * difference
            pull = winding0 * (turned * sin - twisted + bent * tan)
            slope = winding0 * (turned + bent / (cos2 * cos))
        if rigid:
            return Point(pull, slope, sin, 1.0)
        growth2 = heated.growth2
        return sheared(sin, pull, slope, coil.shear * growth2, excess0 * growth2)

    return law


def solve(
    equation: Callable[[Mask], Equation], start: Array, low: float, high: float, steps: int
) -> Array:
    """Roots of rising functions, every element by itself: Newton's method, then brackets.

    An element's result does not depend on its neighbours: all take ``steps`` steps, and those
    that have not converged go on alone with a bracket.

    Args:
        equation: Gives the function for all elements (``ALL``) or for those of a mask.
        start: First guesses, one dimension.
        low: Lower end of the bracket, and the limit of the result where the function is positive
            everywhere.
        high: Upper end, the limit where it is negative everywhere. NaN, where a rod has no such
            state, counts as too far from 0.
        steps: Number of Newton's steps for all.

    Returns:
        Roots, same shape.

    Raises:
        CoilSolveError: If a bracketed search does not end.
    """
    point = start
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        function = equation(ALL)
        step = np.zeros_like(start)
        for _ in range(steps):
            value, slope = function(point)
            step = value / slope
            point = point - step
        wrong = ~((np.abs(step) <= _ACCEPTED) & (point > low) & (point < high))
        if wrong.any():
            point[wrong] = bracketed(equation(wrong), start[wrong], low, high)
    return point

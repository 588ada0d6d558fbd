"""Castigliano's model (CST) of a coil: two coefficients, a compliance and a lever of untwist.

Sun, dissertation, Colorado State University, eq. (3.29), with the signs of this package:

    l = l* + C F + A untwist          (untwist < 0 when hot)
    C = l_t (r^2 cos^2 b / GJ + r^2 sin^2 b / EI + cos^2 b / GA + sin^2 b / EA)
    A = l_t r cos b

These are for an end free to spin. With locked ends (the axial moment eliminated) A becomes
l_t r cos b / (cos^2 b + (EI/GJ) sin^2 b), and the terms of GJ and EI become
l_t r^2 / (GJ cos^2 b + EI sin^2 b). A coil keeps its number of turns here, r = cos b / W. Heat
comes first and load second, as in Sun, Fig. 3.8; sin b = s = l/l_t. Three schemes:

    linear    both coefficients at the natural shape alpha*
    implicit  each step with its coefficient at the shape that it ends in, solved
    path      each step in infinitely many small ones: ds = A d(untwist)/l_t, then ds = C dF/l_t
"""

import math
from typing import Literal

import numpy as np

from tca_mj.quadrature import GaussRule
from tca_mj.tca.laws.coil import Array, Coil, Heated, Law, Mask, Point, Spin, solve
from tca_mj.tca.laws.roots import Equation

Scheme = Literal["linear", "implicit", "path"]

# For the path under load; the integrand is smooth in artanh(s), and the error is below 1e-11 of the
# force up to 98 % of the fibre's length.
_RULE = GaussRule.of(12)
_STEPS = 5


def compliance(
    coil: Coil, spin: Spin, sin: Array | float, growth2: Array | float
) -> tuple[Array | float, Array | float]:
    """C/l_t at s = sin b and its slope over s; ``growth2`` as in ``Heated`` [1/N]."""
    sin2 = sin * sin
    cos2 = 1.0 - sin2
    stretch, shear = growth2 * coil.stretch, growth2 * coil.shear
    winding2 = coil.winding * coil.winding
    if spin == "free":
        twist, bend = 1.0 / (winding2 * coil.torsion), 1.0 / (winding2 * coil.bending)
        inner = cos2 * twist + sin2 * bend + shear
        slope = 2.0 * sin * (cos2 * (bend - twist) + stretch - inner)
        return cos2 * inner + sin2 * stretch, slope
    stiff = coil.torsion * cos2 + coil.bending * sin2
    slope = 2.0 * sin * (stretch - shear - coil.bending / (winding2 * stiff * stiff))
    return cos2 / (winding2 * stiff) + cos2 * shear + sin2 * stretch, slope


def unloaded(coil: Coil, spin: Spin, scheme: Scheme, untwist: Array) -> Array:
    """s of the heated coil before the load comes.

    Args:
        coil: Constants of the TCA.
        spin: Whether an end may spin about the axis.
        scheme: Where the coefficient A is taken.
        untwist: Untwist, one dimension [rad/m].
    """
    turn = untwist / coil.winding  # A untwist / l_t = lever turn
    sin0 = coil.sin
    if spin == "free":  # lever = cos^2 b
        if scheme == "linear":
            return sin0 + turn * (1.0 - sin0 * sin0)
        if scheme == "path":
            return np.tanh(math.atanh(sin0) + turn)
        total = sin0 + turn
        return 2.0 * total / (1.0 + np.sqrt(1.0 + 4.0 * (turn * total)))
    skew = coil.bending / coil.torsion - 1.0  # lever = cos^2 b / (1 + skew sin^2 b)
    first = sin0 + turn * ((1.0 - sin0 * sin0) / (1.0 + skew * sin0 * sin0))
    if scheme == "linear":
        return first

    def equation(mask: Mask) -> Equation:
        turned = turn[mask]
        if scheme == "path":
            goal = (turned + (1.0 + skew) * math.atanh(sin0)) - skew * sin0
            return lambda sin: (
                (1.0 + skew) * np.arctanh(sin) - skew * sin - goal,
                (1.0 + skew) / (1.0 - sin * sin) - skew,
            )

        def implicit(sin: Array) -> tuple[Array, Array]:
            size = 1.0 + skew * (sin * sin)
            value = sin - sin0 - turned * ((1.0 - sin * sin) / size)
            return value, 1.0 + turned * (2.0 * (1.0 + skew)) * sin / (size * size)

        return implicit

    return solve(equation, np.clip(first, -0.9, 0.9), -1.0, 1.0, _STEPS)


def cst_law(coil: Coil, spin: Spin, scheme: Scheme) -> Law:
    """Force over s in Castigliano's model; ``Heated.unloaded`` must be that of ``unloaded``.

    Args:
        coil: Constants of the TCA.
        spin: Whether an end may spin about the axis.
        scheme: Where the coefficient C is taken.
    """

    def linear(heated: Heated, sin: Array) -> Point:
        at_rest, _ = compliance(coil, spin, coil.sin, heated.growth2)
        inverse = 1.0 / (at_rest + np.zeros_like(sin))
        return Point((sin - heated.unloaded) * inverse, inverse, sin, 1.0)

    def implicit(heated: Heated, sin: Array) -> Point:
        here, slope = compliance(coil, spin, sin, heated.growth2)
        force = (sin - heated.unloaded) / here
        return Point(force, (1.0 - force * slope) / here, sin, 1.0)

    def path(heated: Heated, sin: Array) -> Point:
        # Integral of l_t ds / C = l_t (1 - s^2) du / C, u = artanh(s).
        start, end = np.arctanh(heated.unloaded), np.arctanh(sin)
        force = np.zeros_like(sin)
        for node, weight in zip(_RULE.node, _RULE.weight, strict=True):
            on_path = np.tanh(start + (end - start) * node)
            here, _ = compliance(coil, spin, on_path, heated.growth2)
            force = force + weight * (1.0 - on_path * on_path) / here
        here, _ = compliance(coil, spin, sin, heated.growth2)
        return Point((end - start) * force, 1.0 / (here + 0.0 * sin), sin, 1.0)

    return {"linear": linear, "implicit": implicit, "path": path}[scheme]


def first_guess(coil: Coil, heated: Heated, force: Array) -> Array:
    """A rough s for any model under a force phi, shape of ``force``."""
    base = heated.unloaded
    near, _ = compliance(coil, "free", base, heated.growth2)
    far = np.clip(base + force * near, -0.95, 0.95)
    near, _ = compliance(coil, "free", 0.5 * (base + far), heated.growth2)
    return np.clip(base + force * near, -0.95, 0.95)

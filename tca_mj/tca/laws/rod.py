"""Tension of a helical TCA from Cosserat rod theory, in closed form but for one scalar.

A uniform helix under an axial force F and an axial moment M that keeps both ends from turning
has constant strains, so that the boundary value problem of the rod [Sun, dissertation, Colorado
State University, eqs. (3.5)-(3.8)] collapses to four algebraic equations. With b the
pitch of the fibre's sections, W = dphi/ds = cos(alpha*)/r* the fixed winding, r the radius and
l the length of the coil over the length of the fibre:

    EI (W cos b - kappa*)           = M cos b - F r sin b      kappa* = W cos(alpha*)
    GJ (W sin b - tau* - untwist)   = M sin b + F r cos b      tau*   = W sin(alpha*)
    GA (l cos b - r W sin b)        = F cos b
    EA (r W cos b + l sin b - 1)    = F sin b

The last two give r and l; eliminating M and r leaves, with s = sin b and D = 1/EA - 1/GA,

    F + s D F^2 = q(s) := W ((GJ - EI) W s - GJ (tau* + untwist) + EI kappa* tan b)
    l(s)        = s + F (1/GA + s^2 D),

so F(s) is the root of a quadratic and l(s) = length/fibre_length is solved by Newton. Heat and
load soften all four stiffnesses alike: s is found with the moduli of the reference temperature,
and ``moduli.softened_tension`` turns that tension into the true one. Only +, -, *, / and
square roots are used, and every element is solved by itself, so that a result depends on
its own inputs alone, bit for bit, whatever batch it stands in.

Steep coils of fibres that are stiff in bending buckle: but for shear and stretch the slope dF/ds is
W^2 (GJ - EI (1 - cos(alpha*)/cos^3 b)), so that the tension *falls* with length where

    cos^3 b > cos(alpha*) / (1 - 2 G/E).

With the E/G = 5.5 of the catalogue that needs natural pitches above 0.88 rad, with E/G = 20 above
0.45 rad; the catalogue ends at 0.39 rad. There a length has one tension, but a load many lengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, door, floats, some, within
from tca_mj.tca.arrays import column, frozen
from tca_mj.tca.laws.roots import TOLERANCE, bracketed
from tca_mj.tca.moduli import FibreTable, radial_growth, softened, softening, untwist
from tca_mj.tca.spec import TcaSpec

# Newton's steps for every element. Three are enough for all but one ordinary length in 300; what
# has not converged goes on with a bracket around the root.
_STEPS = 3
_SHORTEST = 0.5  # of the minimum length: domain of the law
_LONGEST = 0.98  # of the fibre length: domain of the law


@dataclass(frozen=True, slots=True, eq=False)
class CoilShape:
    """Solved state of the coil itself, without the contact of its turns; arrays (..., n).

    Attributes:
        pitch: Pitch b of the fibre's sections [rad].
        radius: Radius r of the loaded coil [m].
        tension: Axial force F, negative when pushed [N].
        moment: Axial moment M that keeps the ends from turning [N m].
        softening: Share e of the moduli left [1].
    """

    pitch: Array
    radius: Array
    tension: Array
    moment: Array
    softening: Array


class Point(NamedTuple):
    """A law at s: force [N] and length over fibre length, with their slopes over s."""

    force: Array
    force_slope: Array
    ratio: Array
    ratio_slope: Array | float


class _Section(NamedTuple):
    """Constants of q(s) and l(s) at one temperature, arrays (..., n)."""

    constant: Array  # q = constant + linear s + tangent tan b [N]
    linear: Array
    tangent: Array
    shear: Array  # 1/GA [1/N]
    excess: Array  # D = 1/EA - 1/GA [1/N]


class CoilRods:
    """The tension law of n TCAs of any specs, evaluated together.

    Attributes:
        n: Number of TCAs.
        shortest: Lower end of the law's domain, half of the minimum length, shape (n,) [m].
        longest: Upper end of the law's domain, 98 % of the fibre length, shape (n,) [m].
        rest_stiffness: dF/dl of the cold coil at its natural length, shape (n,) [N/m].
        contact_stiffness: Stiffness of the coils pressed together, shape (n,) [N/m].
        minimum: Lengths at which the coils touch, shape (n,) [m].
        any_hot: Whether the section of a fibre grows with its temperature.
    """

    @door
    def __init__(self, specs: Sequence[TcaSpec]) -> None:
        """Gathers the constants.

        Args:
            specs: The n TCAs.

        Raises:
            ValueError: If ``specs`` is empty, or one has several strands: ``plies.law_of`` joins
                the law of its ``strand``, as banks do.
        """
        self.n = len(specs)
        if self.n == 0:
            raise ValueError("specs must hold at least 1 TCA, got none")
        for spec in specs:
            if spec.plies is not None:
                raise ValueError(f"specs must be single coils (TcaSpec.strand), got {spec.plies}")
        fibres = [spec.fibre for spec in specs]
        self._fibres = FibreTable.of(fibres)
        self._hot = np.array([fibre.section == "hot" for fibre in fibres])
        self.any_hot = bool(self._hot.any())

        young, shear, area, second_moment, radius = (
            column(fibres, name) for name in ("young", "shear", "area", "second_moment", "radius")
        )
        pitch = column(specs, "pitch_angle")
        self._bending = young * second_moment  # EI
        self._torsion = shear * (2.0 * second_moment)  # GJ
        self._winding = column(specs, "winding")
        self._curvature = self._winding * np.cos(pitch)
        self._twist = self._winding * np.sin(pitch)
        self._fibre_length = column(specs, "fibre_length")
        # Sun, Section 3.2.2 with the fibre's radius: 171 rad/m at 60 g on the free-stroke TCA.
        self._torsion_per_tension = radius * np.cos(pitch) / self._torsion

        self._untwisting = self._winding * self._torsion
        self._linear = self._winding * self._winding * (self._torsion - self._bending)
        self._tangent = self._winding * self._bending * self._curvature
        self._shear = 1.0 / (shear * area)
        self._excess = 1.0 / (young * area) - self._shear

        sin, cos = np.sin(pitch), np.cos(pitch)
        self._cosine = cos
        stiffness = self._torsion * cos**2 + self._bending * sin**2
        compliance = column(specs, "coil_radius") ** 2 / stiffness
        compliance += self._shear + sin**2 * self._excess
        self.rest_stiffness = frozen(1.0 / (self._fibre_length * compliance))
        self.contact_stiffness = frozen(column(specs, "contact_ratio") * self.rest_stiffness)
        self.minimum = column(specs, "minimum_length")
        self._onset = column(specs, "contact_smoothing") * self.minimum
        self.shortest = frozen(_SHORTEST * self.minimum)
        self.longest = frozen(_LONGEST * self._fibre_length)

    def crept(self, sine: Array) -> CoilRods:
        """The same coils at other natural lengths: they keep their turns and contact lengths.

        Args:
            sine: Natural length over the fibre's, shape (..., n); nothing is checked.

        Returns:
            Their law, of lengths and temperatures that have this shape, too.
        """
        rods, cos2 = copy(self), 1.0 - sine * sine
        cos = np.sqrt(cos2)
        rods._curvature, rods._twist = self._winding * cos, self._winding * sine
        rods._tangent = self._winding * self._bending * rods._curvature
        rods._torsion_per_tension = self._torsion_per_tension / self._cosine * cos
        compliance = cos2 / np.square(self._winding)
        compliance = compliance / (self._torsion * cos2 + self._bending * sine * sine)
        compliance += self._shear + sine * sine * self._excess
        rods.rest_stiffness = 1.0 / (self._fibre_length * compliance)
        ratio = self.contact_stiffness / self.rest_stiffness
        rods.contact_stiffness = ratio * rods.rest_stiffness
        return rods

    def tension(self, length: ArrayLike, temperature: ArrayLike) -> tuple[Array, Array]:
        """Tension of the coils at given lengths and temperatures, and its slope.

        Args:
            length: Length of the TCA, shape (..., n) [m].
            temperature: Temperature, same shape [°C].

        Returns:
            Tension F, negative when the coil is pushed [N], and stiffness dF/dl [N/m].

        Raises:
            ValueError: If a length is outside ``shortest`` to ``longest``, or a temperature
                leaves no modulus, or either is not a number.
            CoilSolveError: If the shape is not found.
        """
        length, temperature = self._checked(length, temperature)
        return self.finished(length, temperature, *self.unsoftened(length, temperature))

    def unsoftened(self, length: Array, temperature: Array) -> tuple[Array, Array]:
        """The smooth part of ``tension``, for tables of it; the arguments are not checked.

        Args:
            length: Length of the TCA, shape (..., n) [m].
            temperature: Temperature, same shape [°C].

        Returns:
            Tension that the coils would have with the moduli of the reference temperature, without
            contact [N], and its slope over the length [N/m].
        """
        _, stiff, slope = self._solve(length, temperature)
        return stiff, slope

    def finished(
        self, length: Array, temperature: Array, stiff: Array, slope: Array
    ) -> tuple[Array, Array]:
        """The rest of ``tension``: softening by heat and load, and contact; not checked.

        Args:
            length: Length of the TCA, shape (..., n) [m].
            temperature: Temperature, same shape [°C].
            stiff: Tension as from ``unsoftened`` [N].
            slope: Its slope over the length [N/m].

        Returns:
            Tension and stiffness as from ``tension``.
        """
        per_tension = self.torsion_per_tension(temperature)
        tension, share = softened(self._fibres, temperature, stiff, per_tension)
        slope = share * slope
        if not some(length < self.minimum):
            return tension, slope
        contact, contact_slope = self._contact(length)
        return tension - contact, slope + contact_slope

    def shape(self, length: ArrayLike, temperature: ArrayLike) -> CoilShape:
        """Shape and loads of the coils, contact left out; arguments and errors as ``tension``."""
        length, temperature = self._checked(length, temperature)
        sin, stiff, _ = self._solve(length, temperature)
        per_tension = self.torsion_per_tension(temperature)
        tension, _ = softened(self._fibres, temperature, stiff, per_tension)
        # Not F/f, which is 0/0 for a coil at rest.
        share = softening(self._fibres, temperature, per_tension * tension)
        cos = np.sqrt(1.0 - sin * sin)
        section = self._section(temperature)
        radius = (cos + stiff * sin * cos * section.excess) / self._winding
        growth4 = section.tangent / self._tangent
        bent = growth4 * self._bending * (self._winding * cos - self._curvature)
        twist = self._twist + untwist(self._fibres, temperature)
        twisted = growth4 * self._torsion * (self._winding * sin - twist)
        return CoilShape(
            pitch=np.arcsin(sin), radius=radius, tension=tension,
            moment=share * (bent * cos + twisted * sin), softening=share,
        )  # fmt: skip

    def _checked(self, length: ArrayLike, temperature: ArrayLike) -> tuple[Array, Array]:
        length, temperature = floats("length", length), floats("temperature", temperature)
        if length.shape[-1:] != (self.n,) or temperature.shape != length.shape:
            raise ValueError(
                f"length and temperature must have one shape (..., {self.n}), got {length.shape}"
                f" and {temperature.shape}"
            )
        require_domain(length, self.shortest, self.longest)
        return length, within("temperature", temperature, above=-273.15, unit="°C")

    def torsion_per_tension(self, temperature: Array) -> Array:
        """Torsion τ = F r_t cos α*/(G J) of the fibre per tension, of its section [rad/(m N)]."""
        if not self.any_hot:
            return self._torsion_per_tension
        growth = self._growth(temperature)
        return self._torsion_per_tension / (growth * growth * growth)

    def _growth(self, temperature: Array) -> Array | float:
        """Radius of the section over its radius when cold; 1 for a cold section."""
        if not self.any_hot:
            return 1.0
        return np.where(self._hot, 1.0 + radial_growth(self._fibres, temperature), 1.0)

    def _section(self, temperature: Array) -> _Section:
        """Constants of the scalar law at the moduli of the reference temperature."""
        bias = -self._untwisting * (self._twist + untwist(self._fibres, temperature))
        growth2 = np.square(self._growth(temperature))
        growth4 = growth2 * growth2
        return _Section(
            bias * growth4, self._linear * growth4, self._tangent * growth4, self._shear / growth2,
            self._excess / growth2,
        )  # fmt: skip

    def _solve(self, length: Array, temperature: Array) -> tuple[Array, Array, Array]:
        """sin b, tension and its slope over length [N/m], at the moduli of reference."""
        target = length / self._fibre_length
        section = self._section(temperature)
        sin = target
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            for _ in range(_STEPS):
                _, _, ratio, ratio_slope = _law(sin, section)
                sin = sin - (ratio - target) / ratio_slope
            stiff, slope, ratio, ratio_slope = _law(sin, section)
            residual = np.abs(ratio - target)
            if not (residual <= TOLERANCE).all():
                sin = _repaired(sin, ~(residual <= TOLERANCE), target, section)
                stiff, slope, ratio, ratio_slope = _law(sin, section)
        return sin, stiff, slope / (ratio_slope * self._fibre_length)

    def _contact(self, length: Array) -> tuple[Array, Array]:
        """Push of touching coils and -d/dl of it: zero, then a parabola, then a line."""
        depth = self.minimum - length
        onset = np.minimum(np.maximum(depth, 0.0), self._onset)
        beyond = np.maximum(depth - self._onset, 0.0)
        share = onset / self._onset
        stiffness = self.contact_stiffness
        return stiffness * (0.5 * onset * share + beyond), stiffness * share


@door
def coil_tension(spec: TcaSpec, length: ArrayLike, temperature: ArrayLike) -> tuple[Array, Array]:
    """Tension of one TCA, both ends glued, and its slope.

    Args:
        spec: The TCA.
        length: Length between its ends, any shape, broadcast with ``temperature`` [m].
        temperature: Temperature, any shape [°C].

    Returns:
        Tension F, not clipped: negative when the coil is pushed [N], and stiffness dF/dl [N/m].

    Raises:
        ValueError: If a length is outside half of the minimum length to 98 % of the fibre length,
            or a temperature leaves no modulus; or if it has several strands, which ``tension``
            takes.
        CoilSolveError: If the shape is not found.
    """
    length, temperature = np.broadcast_arrays(
        floats("length", length), floats("temperature", temperature)
    )
    tension, stiffness = CoilRods([spec]).tension(length[..., None], temperature[..., None])
    return tension[..., 0][()], stiffness[..., 0][()]


def require_domain(length: Array, shortest: Array, longest: Array, why: str = "") -> None:
    """Refuses lengths, (..., n), out of bounds, (n,) [m].

    Raises:
        ValueError: If there is one; ``why`` ends the message.
    """
    inside = (length >= shortest) & (length <= longest)
    if not inside.all():
        worst = tuple(int(i) for i in np.argwhere(~inside)[0])
        raise ValueError(
            f"length{list(worst)} must be from {shortest[worst[-1]]} m (half of the minimum length)"
            f" to {longest[worst[-1]]} m (98 % of the fibre length), got {length[worst]} m{why}"
        )


def sheared(
    sin: Array, pull: Array, slope: Array, shear: Array | float, excess: Array | float
) -> Point:
    """The state at s = sin b of a fibre that shears and stretches; NaN where there is none.

    Args:
        sin: s.
        pull: q(s) [N].
        slope: Its slope over s [N].
        shear: 1/GA [1/N].
        excess: D = 1/EA - 1/GA [1/N].
    """
    skew = sin * excess
    root = np.sqrt(1.0 + 4.0 * (skew * pull))
    force = 2.0 * pull / (1.0 + root)
    slope = (slope - excess * (force * force)) / root
    give = shear + sin * skew
    return Point(force, slope, sin + force * give, 1.0 + slope * give + 2.0 * (force * skew))


def _law(sin: Array, section: _Section) -> Point:
    """The law of a coil with locked ends."""
    constant, linear, tangent, shear, excess = section
    cos2 = 1.0 - sin * sin
    cos = np.sqrt(cos2)
    pull = constant + linear * sin + tangent * (sin / cos)
    pull_slope = linear + tangent / (cos2 * cos)
    return sheared(sin, pull, pull_slope, shear, excess)


def _repaired(sin: Array, wrong: NDArray[np.bool_], target: Array, section: _Section) -> Array:
    """Solves the elements marked ``wrong`` by Newton's method inside a shrinking bracket."""
    part = _Section(*(np.broadcast_to(field, target.shape)[wrong] for field in section))
    goal, repaired = target[wrong], sin.copy()

    def excess(sin: Array) -> tuple[Array, Array | float]:
        _, _, ratio, slope = _law(sin, part)
        return ratio - goal, slope

    repaired[wrong] = bracketed(
        excess, np.zeros_like(goal), -1.0, 1.0, lambda value, *_: np.abs(value) <= TOLERANCE
    )
    return repaired

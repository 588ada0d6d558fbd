"""Calibration surface: the rod's tension law F(l, T) as a table, with its error bound.

The rod (``laws.rod``) needs four rounds of Newton for the tension f that a coil would have with
the moduli of the reference temperature. That f depends on the length over the fibre's length and
on the temperature alone and is smooth, so it is tabulated: cubic Hermite polynomials in the
length, through values and slopes of the rod, and parabolas in the temperature. The slope that is
handed out is the exact derivative of the tension that is handed out; both are continuous in the
length. What is not smooth is not tabulated: the softening by load, which has a kink at F = 0 and
at the reference temperature, and the contact of the turns come from the rod's own closed forms.

The natural length and the reference temperature are knots, so that a cold TCA at rest is at rest
in the table, too, to rounding. A table is made in some 20 ms and kept while Python runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from tca_mj.checks import Array, door
from tca_mj.tca.arrays import frozen
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.moduli import radial_growth, softened
from tca_mj.tca.spec import TcaSpec

# Cells in length and temperature, or a few more; the next grid is taken if the bound is missed.
GRIDS = ((32, 40), (64, 80), (128, 160))
WIDE = (0.0, 200.0)  # temperatures in the table, wider if the fibre's measurements are [°C]
COLDEST = -200.0  # but no colder than this: an estimate of what nobody needs fast [°C]
FINER = 8  # error-check points per cell, each way
MARGIN = 1.25  # of the bound over the largest error seen at those points
ROUNDING = 1e-11  # the rod's own tolerance, as a tension [N] and as a share of the slope
TAUT = 0.05  # from this tension on the bound is relative [N]
ALLOWED = (1e-4, 2e-3, 2e-3)  # absolute [N], relative and slope error of an accepted table


class CalibrationError(ArithmeticError):
    """No table followed the rod of a TCA closely enough; ``CoilRods`` still holds."""


@dataclass(frozen=True, slots=True)
class SurfaceBound:
    """Largest errors of a surface against the rod, over its whole range.

    They are 1.25 times the largest seen on a grid 8 times finer, each way, than the table. With
    F the rod's tension, the tension is off by at most max(absolute, relative |F|).

    Attributes:
        absolute: Of the tension where it is below 0.05 N or the turns touch [N].
        relative: Over the tension or 0.05 N, what is more, where the turns do not touch [1].
        slope: Of dF/dl, contact left out, everywhere [1].
    """

    absolute: float
    relative: float
    slope: float


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Tension of one kind of coil at the moduli of the reference temperature.

    Coils that differ in length only (``TcaSpec.of_length``) share one.

    Attributes:
        shortest: Lowest length over fibre length in the table [1].
        longest: Highest one [1].
        coldest: Lowest temperature in the table [°C].
        hottest: Highest one [°C].
        tension: At evenly spaced lengths and temperatures, shape (p + 1, 2 q + 1) [N].
        slope: Its derivative by length over fibre length, same shape [N].
        bound: Error bound of the tension law made from this table.
    """

    shortest: float
    longest: float
    coldest: float
    hottest: float
    tension: Array
    slope: Array
    bound: SurfaceBound

    @property
    def cells(self) -> tuple[int, int]:
        """Cells (p, q) in length and in temperature."""
        return self.tension.shape[0] - 1, self.tension.shape[1] // 2

    def polynomials(self) -> Array:
        """Coefficients of u^i v^j in each cell, shape (p + 1, q + 1, 3, 4) as [.., j, i] [N].

        u and v run from 0 to 1 through a cell. The last cell in either direction lies beyond the
        table and serves its very edge, u = 0 or v = 0.
        """
        p, q = self.cells
        a = self.tension
        da = self.slope * ((self.longest - self.shortest) / p)
        step, rise = np.diff(a, axis=0), da[:-1]
        cubic = np.zeros((4, *a.shape))
        cubic[0], cubic[1] = a, da
        cubic[2, :-1] = 3.0 * step - 2.0 * rise - da[1:]
        cubic[3, :-1] = rise + da[1:] - 2.0 * step
        low, middle, high = cubic[..., :-1:2], cubic[..., 1::2], cubic[..., 2::2]
        table = np.zeros((p + 1, q + 1, 3, 4))
        table[:, :, 0] = cubic[..., ::2].transpose(1, 2, 0)
        table[:, :-1, 1] = (4.0 * middle - 3.0 * low - high).transpose(1, 2, 0)
        table[:, :-1, 2] = (2.0 * (low + high) - 4.0 * middle).transpose(1, 2, 0)
        return table

    def rises(self) -> bool:
        """Whether the tension rises with length in every point of every cell: a proof.

        The slope of a cell is a polynomial of degree 2 in u and in v, and lies between the
        smallest and the largest of its Bernstein coefficients.
        """
        cell = self.polynomials()[:-1, :-1]
        first, second, third = cell[..., 1], 2.0 * cell[..., 2], 3.0 * cell[..., 3]
        in_u = np.stack([first, first + 0.5 * second, first + second + third], axis=-1)
        one, v, v2 = in_u[..., 0, :], in_u[..., 1, :], in_u[..., 2, :]
        return bool(min(c.min() for c in (one, one + 0.5 * v, one + v + v2)) > 0.0)


@door
def calibrate(tca: TcaSpec) -> Surface:
    """The surface of a TCA's coil, made once.

    Args:
        tca: The TCA. Its length, heat, resistance, strength, contact and strands do not matter.

    Raises:
        CalibrationError: If no table follows the rod within 0.1 mN and 0.2 %, or the rod's own
            tension falls somewhere as the coil gets longer: steep coils of fibres with a large
            E/G buckle in torsion.
        CoilSolveError: If the rod itself has no solution somewhere in its domain.
    """
    return _calibrated(coil_alone(tca))


@lru_cache(maxsize=256)
def _calibrated(coil: TcaSpec) -> Surface:
    """Tabulates the rod and measures the error."""
    fibre, rods = coil.fibre, CoilRods([coil])
    low, high = fibre.temperature_range
    low, high = max(min(low, WIDE[0]), COLDEST), max(high, WIDE[1])
    if not (radial_growth(fibre, np.linspace(low, high, 400)) > -0.5).all():
        low, high = fibre.temperature_range
    shortest, longest = float(rods.shortest[0]), float(rods.longest[0])
    rest, bound = math.sin(coil.pitch_angle), SurfaceBound(1.0, 1.0, 1.0)
    for p, q in GRIDS:
        start, p = _knotted(shortest, rest, longest, p)
        coldest, q = _knotted(low, fibre.reference_temperature, high, q)
        length = np.linspace(start, longest, p + 1)
        tension, slope = solved(rods, length, np.linspace(coldest, high, 2 * q + 1))
        if not (slope > 0.0).all():
            raise CalibrationError("the rod's own tension falls with length; a surface must rise")
        surface = Surface(start, longest, coldest, high, frozen(tension), frozen(slope), bound)
        bound = _measured(coil, rods, surface)
        if surface.rises() and all(e <= a for e, a in zip(astuple(bound), ALLOWED, strict=True)):
            return replace(surface, bound=bound)
    raise CalibrationError(
        f"a table of {p} by {q} cells is off by {bound} or does not rise; allowed are {ALLOWED}"
    )


def _knotted(low: float, knot: float, high: float, cells: int) -> tuple[float, int]:
    """A start at or just below ``low``, and a number of cells from there to ``high``.

    The cells are not wider than asked for, and ``knot`` is on a border of two of them.
    """
    width = (high - low) / cells
    above = max(math.ceil((high - knot) / width - 1e-9), 1)
    width = (high - knot) / above
    below = max(math.ceil((knot - low) / width - 1e-9), 0)
    return knot - below * width, below + above


def coil_alone(tca: TcaSpec) -> TcaSpec:
    """The TCA with all that does not matter made the same for all; what is not named matters."""
    return replace(
        tca,
        fibre=replace(tca.fibre, line_density=1e-4, specific_heat=1.0),
        fibre_length=1.0, breaking_force=1.0, resistance_per_length=1.0, stretch_resistance=0.0,
        contraction_resistance=0.0, heat_loss=1.0, ambient=25.0, body=None,
        contact_ratio=1.0, contact_smoothing=0.5, plies=None,
    )  # fmt: skip


def solved(rods: CoilRods, length: Array, temperature: Array) -> tuple[Array, Array]:
    """The rod at the moduli of reference over a grid: tension, slope; lengths on axis 0."""
    grid = np.meshgrid(length, temperature, indexing="ij")
    stiff, slope = rods.unsoftened(grid[0][..., None], grid[1][..., None])
    return stiff[..., 0], slope[..., 0]


def _measured(coil: TcaSpec, rods: CoilRods, surface: Surface) -> SurfaceBound:
    """Compares softened tensions and slopes of table and rod on the finer grid."""
    p, q = surface.cells
    length = np.linspace(surface.shortest, surface.longest, FINER * p + 1)
    temperature = np.linspace(surface.coldest, surface.hottest, FINER * q + 1)
    # A spec may soften to nothing below the table's upper end; there the law raises anyway.
    fibre = coil.fibre
    fall = fibre.softening_rate * fibre.load_softening[2]
    temperature = temperature[fall * (temperature - fibre.reference_temperature) < 1.0]
    per = rods.torsion_per_tension(temperature[:, None])[..., 0]
    per_length = p / (surface.longest - surface.shortest)
    x = (length[:, None] - surface.shortest) * per_length
    t = (temperature - surface.coldest) * (q / (surface.hottest - surface.coldest))
    i, j = x.astype(np.intp), t.astype(np.intp)
    cell = surface.polynomials().reshape(p + 1, q + 1, 12).transpose(2, 0, 1)[:, i, j]
    read, read_slope = evaluate(cell, x - i, t - j)
    read, read_share = softened(fibre, temperature, read, per)
    stiff, slope = solved(rods, length, temperature)
    true, share = softened(fibre, temperature, stiff, per)
    error = np.abs(read - true)
    free = (length >= coil.minimum_length)[:, None]
    relative = error / np.maximum(true, TAUT)
    steep = np.abs(read_share * read_slope * per_length / (share * slope) - 1.0)
    return SurfaceBound(
        absolute=float(MARGIN * np.max(error, where=~free | (true < TAUT), initial=0.0)) + ROUNDING,
        relative=float(MARGIN * np.max(relative, where=free, initial=0.0)) + ROUNDING / TAUT,
        slope=float(MARGIN * steep.max()) + ROUNDING,
    )


def evaluate(cell: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """Value and derivative by u of polynomials of u and v, whose coefficients are (12, ...).

    NumPy is faster with v of the shape (4, ...) of what it multiplies.
    """
    cubic = cell[8:] * v
    cubic += cell[4:8]
    cubic *= v
    cubic += cell[:4]
    return _along(cubic, u)


def evaluate_one(cell: Sequence[float], u: float, v: float) -> tuple[float, float]:
    """``evaluate`` of one polynomial, to the bit: of few of them a tenth of the time."""
    rows = zip(cell[:4], cell[4:8], cell[8:], strict=True)
    return _along([(second * v + first) * v + zeroth for zeroth, first, second in rows], u)


def _along(cubic: Any, u: Any) -> tuple[Any, Any]:
    """Value and derivative by u of cubic polynomials: Horner's scheme for both at once."""
    c0, c1, c2, c3 = cubic
    u_c3 = u * c3
    b2 = c2 + u_c3
    b1 = c1 + u * b2
    return c0 + u * b1, b1 + u * (b2 + u_c3)

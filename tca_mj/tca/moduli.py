"""How temperature and load change a twisted fibre: growth, untwist and softening.

Every function takes one ``FibreSpec``, or a ``FibreTable`` of n fibres whose temperatures
stand on the last axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import LARGEST, Array, door, floats, within
from tca_mj.tca.arrays import ONE, ZERO, column, frozen
from tca_mj.tca.thread import FibreSpec


class FibreTable(NamedTuple):
    """What the laws of this file need of n fibres, each field an array of shape (n,).

    Field by field this is the ``FibreSpec`` attribute of the same name.

    Attributes:
        reference_temperature: Temperature T_0 of the natural shape [°C].
        inserted_twist: Twist per fibre length [rad/m].
        untwist_scale: Factor on the untwist [1].
        growth: (a2, a1) of the relative growth of the radius [1/K^2, 1/K].
        softening_rate: Relative fall of the moduli per kelvin [1/K].
        load_softening: Coefficients (mu2, mu1, mu0) of the load's influence on it.
    """

    reference_temperature: Array
    inserted_twist: Array
    untwist_scale: Array
    growth: tuple[Array, Array]
    softening_rate: Array
    load_softening: tuple[Array, Array, Array]

    @classmethod
    @door
    def of(cls, fibres: Sequence[FibreSpec]) -> FibreTable:
        """Collects the numbers of ``fibres``, in their order."""
        columns = [column(fibres, name) for name in cls._fields]
        parts: list[Any] = [tuple(frozen(each.T)) if each.ndim > 1 else each for each in columns]
        return cls(*parts)


Fibres = FibreSpec | FibreTable
_LEFT = "share of the modulus left at this temperature"


@door
def radial_growth(fibre: Fibres, temperature: ArrayLike) -> Array:
    """Relative growth of the fibre's radius, Gamma(T)/Gamma(T_0) - 1.

    Sun, dissertation, Colorado State University, eq. (3.2), divided by its value at the
    reference temperature: there the growth is exactly zero.

    Args:
        fibre: One fibre or a table of n.
        temperature: Temperature, shape (...) or (..., n) [°C].

    Returns:
        Growth, same shape [1].

    Raises:
        ValueError: If a temperature is not finite or so large that the growth is not.
    """
    temperature = floats("temperature", temperature)
    rise = temperature - fibre.reference_temperature
    a2, a1 = fibre.growth
    with np.errstate(over="ignore", invalid="ignore"):
        return within("radial growth at this temperature", rise * (a1 + a2 * rise))


@door
def untwist(fibre: Fibres, temperature: ArrayLike) -> Array:
    """Twist lost by heating, inserted_twist (1/Gamma - 1), Sun, eq. (3.4).

    Args:
        fibre: One fibre or a table of n.
        temperature: Temperature, shape (...) or (..., n) [°C].

    Returns:
        Untwist per fibre length, negative when hot, same shape [rad/m].

    Raises:
        ValueError: If the fibre would shrink to nothing (far outside the fitted range), or as
            ``radial_growth``.
    """
    growth = radial_growth(fibre, temperature)
    within("growth of the fibre's radius", growth, above=-1.0)
    twist = fibre.inserted_twist * fibre.untwist_scale
    return -twist * (growth / (1.0 + growth))


@door
def softening(fibre: Fibres, temperature: ArrayLike, torsion: ArrayLike = 0.0) -> Array:
    """Share e of the moduli that is left, E_f/E_f0 of Sun, eq. (3.11).

    It multiplies both E and G as measured at the reference temperature: yarn mechanics
    [Sun, eqs. (3.9), (3.10)] makes both proportional to the filament's E_f. The load counts only
    where it was measured: on a pulled (torsion >= 0) and warm (T >= T_0) fibre; elsewhere the
    polynomial keeps its value at zero torsion.

    Args:
        fibre: One fibre or a table of n.
        temperature: Temperature, shape (...) or (..., n) [°C].
        torsion: Torsion tau that the load causes at the cold shear modulus [rad/m].

    Returns:
        Share e, 1 at the reference temperature.

    Raises:
        ValueError: If nothing is left, E_f <= 0: beyond the range of the polynomial; or if a
            number is not finite.
    """
    temperature = floats("temperature", temperature)
    rise = temperature - fibre.reference_temperature
    fall = fibre.softening_rate * rise
    mu2, mu1, mu0 = fibre.load_softening
    torsion = np.maximum(within("torsion", torsion), 0.0)
    with np.errstate(over="ignore", invalid="ignore"):
        left = 1.0 - fall * mu0 - np.maximum(fall, 0.0) * (torsion * (mu1 + mu2 * torsion))
    return within(_LEFT, left, above=0.0)


@door
def softened_tension(
    fibre: Fibres, temperature: ArrayLike, stiff: ArrayLike, torsion_per_tension: ArrayLike
) -> tuple[Array, Array]:
    """Tension F of a coil whose tension at the cold moduli would be f: solves F = f e(T, F).

    All section stiffnesses soften alike, so the shape of the coil does not depend on e and
    its tension is proportional to it. With the torsion proportional to F, e is quadratic in F:

        f k mu2 c^2 F^2 + (1 + f k mu1 c) F - f (1 - k mu0) = 0,   k = softening_rate (T - T_0).

    Its root F >= 0 exists for every f >= 0 as long as 1 - k mu0 > 0. A pushed coil (f < 0)
    takes the moduli at zero torsion; the law and its slope are continuous there.

    Args:
        fibre: One fibre or a table of n.
        temperature: Temperature, shape (...) or (..., n) [°C].
        stiff: Tension f at the moduli of the reference temperature, broadcast [N].
        torsion_per_tension: Ratio c = tau/F [rad/(m N)].

    Returns:
        Tension F [N] and its slope dF/df [1].

    Raises:
        ValueError: If the heat alone leaves no modulus, or a number is not finite.
    """
    stiff, per_tension = within("stiff", stiff), within("torsion_per_tension", torsion_per_tension)
    return softened(fibre, floats("temperature", temperature), stiff, per_tension)


def softened(
    fibre: Fibres, temperature: Array, stiff: Array, torsion_per_tension: Array | float
) -> tuple[Array, Array]:
    """``softened_tension`` for solvers, whose trial states may be NaN: checks the modulus only."""
    rise = temperature - fibre.reference_temperature
    mu2, mu1, mu0 = fibre.load_softening
    fall = fibre.softening_rate * rise
    unloaded = within(_LEFT, ONE - fall * mu0, above=0.0)
    # Zero for a pushed or a cold coil, which leaves F = f (1 - k mu0).
    load = np.maximum(stiff, ZERO) * np.maximum(fall, ZERO) * torsion_per_tension
    return _loaded(stiff, load, load * mu1 + ONE, unloaded, torsion_per_tension, mu2, np.sqrt)


def softened_one(
    temperature: float, stiff: float, torsion_per_tension: float, reference: float, rate: float,
    mu2: float, mu1: float, mu0: float,
) -> tuple[float, float] | None:  # fmt: skip
    """``softened`` of one number, to the bit; None where it would raise.

    Args:
        temperature, stiff, torsion_per_tension: As there.
        reference: The fibre's ``reference_temperature`` [°C].
        rate: Its ``softening_rate``.
        mu2, mu1, mu0: Its ``load_softening``.
    """
    fall = rate * (temperature - reference)
    unloaded = 1.0 - fall * mu0
    if not 0.0 < unloaded <= LARGEST:
        return None
    load = max(stiff, 0.0) * max(fall, 0.0) * torsion_per_tension
    return _loaded(stiff, load, load * mu1 + 1.0, unloaded, torsion_per_tension, mu2, math.sqrt)


def _loaded(
    stiff: Any, load: Any, linear: Any, unloaded: Any, per: Any, mu2: Any,
    sqrt: Callable[[Any], Any],
) -> tuple[Any, Any]:  # fmt: skip
    """The root of the quadratic and its slope, of numbers or arrays."""
    twice = load + load  # twice and again: 4 load
    root = twice * mu2 * per * (stiff + stiff) * unloaded
    root = sqrt(linear * linear + root)
    left = (unloaded + unloaded) / (linear + root)
    return stiff * left, left / root

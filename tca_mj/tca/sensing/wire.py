"""Electrical resistance of a TCA against its length, and the length read back from it.

The silver-coated thread of a TCA with free stroke rises in resistance as it contracts and
falls as it is stretched, nearly alike at every load and speed [Sun, dissertation, Colorado State
University, Section 2.3.1]. The law is R = R_0 (1 - c strain), with the strain counted from the
natural length and two slopes: a cold TCA that is stretched loses little, 0.55 ohm per 50 %, a
heated one that contracts gains "~20 %" over its actuation (Section 3.1.1). It has no temperature
term, because none has been published: temperature and contraction rose together.

Three curves of it are measured there, and two of them disagree with one R(length). The resistance
of a cold TCA falls as a load stretches it (R-F). But hot TCAs start contracting from different
loaded lengths, after a heating cycle in which they crept, and their resistances over the
displacement from there nearly overlap (R-D): what a load stretches for good hardly counts. So
``resistance_displacement`` counts from the loaded start, and of the load it knows the elastic
stretch.

A sensor measures the mean current under a pulsed voltage, with noise and steps (``measured``),
and a polynomial of third order reads the displacement from it (``fit_displacement``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    Finite,
    NotNegative,
    Numbers,
    door,
    every,
    floats,
    instance,
    shown,
    whole,
    within,
)
from tca_mj.tca.arrays import FEW, ONE, ZERO, column
from tca_mj.tca.spec import TcaSpec


class WireTable(NamedTuple):
    """Electrical constants of n TCAs, each field of shape (n,).

    Attributes:
        rest_length: Natural length [m].
        rest_resistance: Resistance R_0 at the natural length [ohm].
        stretch: Relative fall of the resistance per unit strain beyond it [1].
        contraction: Relative rise of the resistance per unit contraction below it [1].
        each: The four of each TCA, as numbers.
    """

    rest_length: Array
    rest_resistance: Array
    stretch: Array
    contraction: Array
    each: list[list[float]]

    @classmethod
    @door
    def of(cls, specs: Sequence[TcaSpec]) -> WireTable:
        """Collects the numbers of ``specs``, in their order.

        Strands conduct side by side. Those that stand at an angle are longer than the TCA and
        strained less, by the square of its cosine: to first order in the strain.
        """
        rest_length, cos = column(specs, "rest_length"), np.cos(column(specs, "lay_angle"))
        strand = column(specs, "resistance_per_length") / (cos * column(specs, "strands"))
        columns = (
            rest_length, rest_length * strand, cos * cos * column(specs, "stretch_resistance"),
            cos * cos * column(specs, "contraction_resistance"),
        )  # fmt: skip
        return cls(*columns, np.array(columns).T.tolist())


def resistance(
    wire: WireTable, length: ArrayLike, temperature: ArrayLike, *, strict: bool = True
) -> Array:
    """Resistance of n TCAs.

    Args:
        wire: Constants of the n TCAs.
        length: Length of the TCAs, shape (..., n) [m].
        temperature: Temperature, shape (..., n) [°C]. It has no influence yet; callers give it
            so that a temperature term will not change their code.
        strict: Whether what has no resistance is refused; otherwise its resistance is not a number.

    Returns:
        Resistance, shape (..., n) [ohm].

    Raises:
        ValueError: If ``strict`` and a length is not positive and finite or so long that no
            resistance would be left, or if a temperature is not finite.
    """
    instance("wire", wire, WireTable)
    temperature, length = floats("temperature", temperature), floats("length", length)
    if length.shape == temperature.shape == wire.rest_length.shape and length.size <= FEW:
        few = _one_by_one(wire, length, temperature)
        if few is not None:
            return few
    with np.errstate(invalid="ignore"):
        short = ONE - length / wire.rest_length
        left = np.where(short < ZERO, wire.stretch, wire.contraction) * short + ONE
    good = np.minimum(length, left) > ZERO
    good = good & np.isfinite(temperature)
    if not every(good):
        if strict:
            within("temperature", temperature)
            within("length", length, above=0.0, unit="m")
            within("share of resistance left at this length", left, above=0.0)
        left = np.where(good, left, np.nan)
    return wire.rest_resistance * left


def _one_by_one(wire: WireTable, length: Array, temperature: Array) -> Array | None:
    """Resistance of few TCAs, to the bit; None if one has none."""
    found, rows = [], zip(length.tolist(), temperature.tolist(), wire.each, strict=True)
    for long, warm, (rest, ohms, stretch, contraction) in rows:
        short = 1.0 - long / rest
        left = (stretch if short < 0.0 else contraction) * short + 1.0
        if not (long > 0.0 and left > 0.0 and math.isfinite(warm)):
            return None
        found.append(ohms * left)
    return np.array(found)


@door
def sensed_length(wire: WireTable, resistance: ArrayLike) -> Array:
    """Length at which n TCAs have a given resistance: the inverse of ``resistance``.

    Args:
        wire: Constants of the n TCAs, both slopes above 0.
        resistance: Resistance, shape (..., n) [ohm].

    Returns:
        Length, shape (..., n) [m].

    Raises:
        ValueError: If a resistance is not positive and finite, or does not depend on length.
    """
    for name in ("stretch", "contraction"):
        within(name, getattr(wire, name), above=0.0)
    fall = 1.0 - within("resistance", resistance, above=0.0, unit="ohm") / wire.rest_resistance
    strain = fall / np.where(fall > 0.0, wire.stretch, wire.contraction)
    return wire.rest_length * (1.0 + strain)


@dataclass(frozen=True, kw_only=True, slots=True)
class SensingSpec(Checked):
    """What little load and temperature do to the resistance of a TCA that contracts.

    Attributes:
        load: Relative fall per load. It follows from the cold slope: the load stretches the TCA
            of Sun, Table 2.3, by F/(14.0 N/m) of its 110 mm and lowers the resistance by 0.123
            times that, while what it has crept does not count [1/N].
        temperature: Relative rise per kelvin at one displacement and load. None is published,
            as temperature and displacement rose together: the curve over the displacement
            contains it [1/K].
        reference_temperature: Temperature at which that rise is 0 [°C].
    """

    load: NotNegative = 0.123 / (14.0 * 0.110)
    temperature: Finite = 0.0
    reference_temperature: Finite = 25.0


@door
def resistance_displacement(
    wire: WireTable,
    displacement: ArrayLike,
    load: ArrayLike = 0.0,
    temperature: ArrayLike = 25.0,
    sensing: SensingSpec | None = None,
) -> Array:
    """R-D curve: resistance of n TCAs that have contracted from their loaded, crept length.

    R = R_0 (1 + c D/rest_length - a F + b (T - T_0)) with the slope c of contraction. The
    speed does not count, Sun, Section 2.3.1.

    Args:
        wire: Constants of the n TCAs.
        displacement: Contraction D from the start under that load, shape (..., n) [m].
        load: Load F, broadcast with it; measured up to 70 % of the breaking force, where it hardly
            counts (Sun, Section 2.3.1) [N].
        temperature: Temperature, broadcast with it [°C].
        sensing: Terms of load and temperature.

    Returns:
        Resistance, the broadcast shape [ohm].

    Raises:
        ValueError: If a number is not finite, a load negative, or no resistance would be left.
    """
    sensing = sensing or SensingSpec()
    displacement = within("displacement", displacement, unit="m")
    load = within("load", load, at_least=0.0, unit="N")
    rise = within("temperature", temperature) - sensing.reference_temperature
    left = 1.0 + wire.contraction * displacement / wire.rest_length - sensing.load * load
    left = left + sensing.temperature * rise
    return wire.rest_resistance * within("share of resistance left", left, above=0.0)


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementFit:
    """Displacement as a polynomial of the resistance, D(R).

    Attributes:
        polynomial: The polynomial [ohm] -> [m].
        rmse: Root of the mean squared error in the fitted points [m].
        lowest: Lowest resistance fitted [ohm].
        highest: Highest one [ohm].
    """

    polynomial: Polynomial
    rmse: float
    lowest: float
    highest: float

    def displacement(self, resistance: ArrayLike) -> Array:
        """Displacement, same shape [m]; beyond ``lowest`` and ``highest`` it extrapolates.

        Raises:
            ValueError: If a resistance is not finite.
        """
        return np.asarray(self.polynomial(within("resistance", resistance)))


@door
def fit_displacement(
    resistance: Numbers, displacement: ArrayLike, degree: int = 3
) -> DisplacementFit:
    """Fits D(R) of one TCA by least squares, Sun, Section 2.3.2: a polynomial of third order.

    Args:
        resistance: Measured resistances, shape (k,) [ohm].
        displacement: Displacements at which they were measured, shape (k,) [m].
        degree: Degree of the polynomial, not negative.

    Returns:
        The polynomial and its error.

    Raises:
        ValueError: If shapes differ, a number is not finite, or there are not more different
            resistances than ``degree``.
    """
    if resistance.ndim != 1:
        raise ValueError(f"resistance must have shape (k,), got {resistance.shape}")
    displacement = within("displacement", displacement, shape=resistance.shape)
    if resistance.size and not np.ptp(resistance):
        raise ValueError(
            "resistance must change with the displacement, as that of a TCA with a"
            f" contraction_resistance does, got {shown(resistance)}"
        )
    whole("degree", degree, at_least=0, at_most=np.unique(resistance).size - 1)
    polynomial = Polynomial.fit(resistance, displacement, degree)
    error = polynomial(resistance) - displacement
    return DisplacementFit(
        polynomial=polynomial, rmse=math.sqrt(float(np.mean(error * error))),
        lowest=float(resistance.min()), highest=float(resistance.max()),
    )  # fmt: skip

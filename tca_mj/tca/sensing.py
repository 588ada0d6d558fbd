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

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import floats
from tca_mj.tca.spec import TcaSpec

Array = NDArray[np.float64]


class WireTable(NamedTuple):
    """Electrical constants of n TCAs, each field of shape (n,).

    Attributes:
        rest_length: Natural length [m].
        rest_resistance: Resistance R_0 at the natural length [ohm].
        stretch: Relative fall of the resistance per unit strain beyond it [1].
        contraction: Relative rise of the resistance per unit contraction below it [1].
    """

    rest_length: Array
    rest_resistance: Array
    stretch: Array
    contraction: Array

    @classmethod
    def of(cls, specs: Sequence[TcaSpec]) -> "WireTable":
        """Collects the numbers of ``specs``, in their order."""
        rest_length = np.array([spec.rest_length for spec in specs])
        return cls(
            rest_length=rest_length,
            rest_resistance=rest_length * np.array([spec.resistance_per_length for spec in specs]),
            stretch=np.array([spec.stretch_resistance for spec in specs]),
            contraction=np.array([spec.contraction_resistance for spec in specs]),
        )


def resistance(wire: WireTable, length: ArrayLike, temperature: ArrayLike) -> Array:
    """Resistance of n TCAs.

    Args:
        wire: Constants of the n TCAs.
        length: Length of the TCAs, shape (..., n) [m].
        temperature: Temperature, shape (..., n) [°C]. It has no influence yet; callers give it
            so that a temperature term will not change their code.

    Returns:
        Resistance, shape (..., n) [ohm].

    Raises:
        ValueError: If a length is not positive and finite or so long that no resistance would
            be left, or if a temperature is not finite.
    """
    length = floats("length", length)
    temperature = floats("temperature", temperature)
    if not ((length > 0.0) & (length < math.inf)).all():
        raise ValueError(f"length = {length} m must be finite and above 0")
    if not np.isfinite(temperature).all():
        raise ValueError(f"temperature = {temperature} °C must be finite")
    strain = length / wire.rest_length - 1.0
    left = 1.0 - np.where(strain > 0.0, wire.stretch, wire.contraction) * strain
    if not (left > 0.0).all():
        bound = wire.rest_length * (1.0 + 1.0 / wire.stretch)
        raise ValueError(f"length = {length} m must be below {bound} m, where R would be 0")
    return wire.rest_resistance * left


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
    resistance = floats("resistance", resistance)
    if not ((resistance > 0.0) & (resistance < math.inf)).all():
        raise ValueError(f"resistance = {resistance} ohm must be finite and above 0")
    for name, slope in (("stretch", wire.stretch), ("contraction", wire.contraction)):
        if not (slope > 0.0).all():
            raise ValueError(f"{name} = {slope} must be above 0")
    fall = 1.0 - resistance / wire.rest_resistance
    strain = fall / np.where(fall > 0.0, wire.stretch, wire.contraction)
    return wire.rest_length * (1.0 + strain)


@dataclass(frozen=True, kw_only=True, slots=True)
class SensingSpec:
    """What little load and temperature do to the resistance of a TCA that contracts.

    Attributes:
        load: Relative fall per load. It follows from the cold slope: the load stretches the TCA
            of Sun, Table 2.3, by F/(14.0 N/m) of its 110 mm and lowers the resistance by 0.123
            times that, while what it has crept does not count [1/N].
        temperature: Relative rise per kelvin at one displacement and load. None is published,
            as temperature and displacement rose together: the curve over the displacement
            contains it [1/K].
        reference_temperature: Temperature at which that rise is 0 [°C].
        valid_share: Share of the breaking force up to which load hardly counts, Sun, Section 2.3.1.
    """

    load: float = 0.123 / (14.0 * 0.110)
    temperature: float = 0.0
    reference_temperature: float = 25.0
    valid_share: float = 0.7

    def __post_init__(self) -> None:
        for name in ("load", "temperature", "reference_temperature", "valid_share"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} = {getattr(self, name)} must be finite")
        if not self.load >= 0.0:
            raise ValueError(f"load = {self.load} must be 0 or more")
        if not 0.0 < self.valid_share <= 1.0:
            raise ValueError(f"valid_share = {self.valid_share} must be above 0 and at most 1")


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
        load: Load F, broadcast with it; up to ``valid_share`` of the breaking force that is
            what was measured [N].
        temperature: Temperature, broadcast with it [°C].
        sensing: Terms of load and temperature.

    Returns:
        Resistance, the broadcast shape [ohm].

    Raises:
        ValueError: If a number is not finite, a load negative, or no resistance would be left.
    """
    sensing = SensingSpec() if sensing is None else sensing
    displacement, load, temperature = (
        floats(name, array)
        for name, array in (
            ("displacement", displacement),
            ("load", load),
            ("temperature", temperature),
        )
    )
    for name, array in (("displacement", displacement), ("temperature", temperature)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name} = {array} must be finite")
    if not ((load >= 0.0) & (load < math.inf)).all():
        raise ValueError(f"load = {load} N must be finite and not below 0")
    left = 1.0 + wire.contraction * displacement / wire.rest_length - sensing.load * load
    left = left + sensing.temperature * (temperature - sensing.reference_temperature)
    if not (left > 0.0).all():
        raise ValueError(f"displacement = {displacement} m, load = {load} N: no resistance left")
    return wire.rest_resistance * left


def resistance_length(
    wire: WireTable,
    length: ArrayLike,
    start: ArrayLike,
    load: ArrayLike = 0.0,
    temperature: ArrayLike = 25.0,
    sensing: SensingSpec | None = None,
) -> Array:
    """R-L curve: as ``resistance_displacement``, over the length, one curve for every load.

    Args:
        wire: Constants of the n TCAs.
        length: Length, shape (..., n) [m].
        start: Loaded, crept length at which the displacement is 0, broadcast with it [m].
        load: As there [N].
        temperature: As there [°C].
        sensing: As there.

    Returns:
        Resistance, the broadcast shape [ohm].

    Raises:
        ValueError: As there, or if a length is not above 0.
    """
    length, start = floats("length", length), floats("start", start)
    for name, array in (("length", length), ("start", start)):
        if not ((array > 0.0) & (array < math.inf)).all():
            raise ValueError(f"{name} = {array} m must be finite and above 0")
    return resistance_displacement(wire, start - length, load, temperature, sensing)


def resistance_force(
    wire: WireTable, load: ArrayLike, stretched: Callable[[Array], Array]
) -> Array:
    """R-F curve of TCAs that are not heated: the resistance falls as a load stretches them.

    Args:
        wire: Constants of the n TCAs.
        load: Load, shape (..., n), not negative [N].
        stretched: Length of the cold TCAs under given loads, same shapes [N] -> [m].

    Returns:
        Resistance, shape (..., n) [ohm].

    Raises:
        ValueError: If a load is negative or not finite, or as ``resistance``.
    """
    load = floats("load", load)
    if not ((load >= 0.0) & (load < math.inf)).all():
        raise ValueError(f"load = {load} N must be finite and not below 0")
    return resistance(wire, stretched(load), 25.0)


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
        resistance = floats("resistance", resistance)
        if not np.isfinite(resistance).all():
            raise ValueError(f"resistance = {resistance} ohm must be finite")
        return np.asarray(self.polynomial(resistance))

    def covers(self, resistance: ArrayLike) -> NDArray[np.bool_]:
        """Whether a resistance [ohm] lies between those that were fitted, same shape."""
        resistance = floats("resistance", resistance)
        return (resistance >= self.lowest) & (resistance <= self.highest)


def fit_displacement(
    resistance: ArrayLike, displacement: ArrayLike, degree: int = 3
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
    resistance = floats("resistance", resistance)
    displacement = floats("displacement", displacement)
    if resistance.ndim != 1 or resistance.shape != displacement.shape:
        raise ValueError(
            f"resistance has shape {resistance.shape}, displacement {displacement.shape}; both "
            "must be (k,)"
        )
    for name, array in (("resistance", resistance), ("displacement", displacement)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name} = {array} must be finite")
    if degree < 0 or np.unique(resistance).size <= degree:
        raise ValueError(
            f"degree = {degree} must be 0 or more and below the number of different resistances, "
            f"{np.unique(resistance).size}"
        )
    polynomial = Polynomial.fit(resistance, displacement, degree)
    error = polynomial(resistance) - displacement
    return DisplacementFit(
        polynomial=polynomial,
        rmse=math.sqrt(float(np.mean(error * error))),
        lowest=float(resistance.min()),
        highest=float(resistance.max()),
    )

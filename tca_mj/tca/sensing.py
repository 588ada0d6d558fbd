"""Electrical resistance of a TCA against its length, and the length read back from it.

The silver-coated thread of a TCA with free stroke rises in resistance as it contracts and
falls as it is stretched, nearly alike at every load and speed [Sun, dissertation, Colorado State
University, Section 2.3.1]. The law is linear, R = R_0 (1 - c strain), with the strain counted
from the natural length; it has no temperature term yet, because none has been published.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.tca.spec import TcaSpec

Array = NDArray[np.float64]


class WireTable(NamedTuple):
    """Electrical constants of n TCAs, each field of shape (n,).

    Attributes:
        rest_length: Natural length [m].
        rest_resistance: Resistance R_0 at the natural length [ohm].
        strain_coefficient: Relative fall c of the resistance per unit strain [1].
    """

    rest_length: Array
    rest_resistance: Array
    strain_coefficient: Array

    @classmethod
    def of(cls, specs: Sequence[TcaSpec]) -> "WireTable":
        """Collects the numbers of ``specs``, in their order."""
        rest_length = np.array([spec.rest_length for spec in specs])
        return cls(
            rest_length=rest_length,
            rest_resistance=rest_length * np.array([spec.resistance_per_length for spec in specs]),
            strain_coefficient=np.array([spec.resistance_strain for spec in specs]),
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
    length = np.asarray(length, dtype=np.float64)
    temperature = np.asarray(temperature, dtype=np.float64)
    if not ((length > 0.0) & (length < math.inf)).all():
        raise ValueError(f"length = {length} m must be finite and above 0")
    if not np.isfinite(temperature).all():
        raise ValueError(f"temperature = {temperature} °C must be finite")
    left = 1.0 - wire.strain_coefficient * (length / wire.rest_length - 1.0)
    if not (left > 0.0).all():
        bound = wire.rest_length * (1.0 + 1.0 / wire.strain_coefficient)
        raise ValueError(f"length = {length} m must be below {bound} m, where R would be 0")
    return wire.rest_resistance * left


def sensed_length(wire: WireTable, resistance: ArrayLike) -> Array:
    """Length at which n TCAs have a given resistance: the inverse of ``resistance``.

    Args:
        wire: Constants of the n TCAs, strain coefficient above 0.
        resistance: Resistance, shape (..., n) [ohm].

    Returns:
        Length, shape (..., n) [m].

    Raises:
        ValueError: If a resistance is not positive and finite, or does not depend on length.
    """
    resistance = np.asarray(resistance, dtype=np.float64)
    if not ((resistance > 0.0) & (resistance < math.inf)).all():
        raise ValueError(f"resistance = {resistance} ohm must be finite and above 0")
    if not (wire.strain_coefficient > 0.0).all():
        raise ValueError(f"strain_coefficient = {wire.strain_coefficient} must be above 0")
    strain = (1.0 - resistance / wire.rest_resistance) / wire.strain_coefficient
    return wire.rest_length * (1.0 + strain)

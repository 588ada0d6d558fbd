"""Sums of products, over any axes of simulations before the last one.

NumPy takes as long for a dozen numbers as for one. Rows of numbers of cells therefore lie one
behind the other on one axis, and what is linear in them is a few calls: gather, multiply, add up.
It is added up in the order in which it is written, by itself for each simulation, which has, bit
for bit, what it has alone.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array

Places = NDArray[np.int64]


def rows(*numbers: int, width: int, columns: Places | None = None) -> Places:
    """Where columns, by default all, of rows of a width are if these lie one behind the other."""
    within = np.arange(width) if columns is None else columns
    places: Places = (np.array(numbers, np.int64)[:, None] * width + within).ravel()
    return places


class Total:
    """Adds up the last axis by place.

    Attributes:
        place: Where each number goes, shape (k,).
        size: Number of places.
    """

    def __init__(self, place: Places, size: int) -> None:
        self.place, self.size, self._some = place, size, place.size > 0
        self._same = np.array_equal(place, np.arange(size))  # whether there is nothing to add up
        self._many, self._places = 1, place  # of several arrays one behind the other

    def of(self, values: Array) -> Array:
        """Shape (..., k) to (..., size); the same array if each number has a place of its own."""
        if self._same:
            return values
        if values.ndim == 1 and self._some:
            return np.bincount(self.place, values, self.size)  # type: ignore[return-value]
        lead = values.shape[:-1]
        if not self._some:
            return np.zeros((*lead, self.size))
        many = math.prod(lead)
        if many != self._many:
            start = self.size * np.arange(many)[:, None]
            self._many, self._places = many, (start + self.place).ravel()
        total: Any = np.bincount(self._places, values.ravel(), many * self.size)
        return total.reshape(*lead, self.size)


class Form:
    """Sums of terms: a coefficient times a number of one array, or of one and of a second."""

    def __init__(
        self, place: Places, coefficient: ArrayLike, *factors: Places, size: int
    ) -> None:
        """Takes the terms.

        Args:
            place: Which sum each term is of, shape (k,).
            coefficient: Coefficients, one for each, for each row of them, or for all.
            factors: Where the numbers are in the first array, and in the second, shape (k,).
            size: Number of sums.
        """
        self._total, self._factors = Total(place, size), factors
        each = np.asarray(coefficient, dtype=np.float64).ravel()
        self._coefficient = np.repeat(each, place.size // max(each.size, 1))
        self._plain = bool((self._coefficient == 1.0).all())

    def of(self, first: Array, second: Array | None = None) -> Array:
        """The sums, shape (..., size)."""
        if first.ndim == 1:  # an index is found in half the time of take
            terms = first[self._factors[0]]
            if second is not None:
                terms *= second[self._factors[1]]
        else:
            terms = first.take(self._factors[0], axis=-1)
            if second is not None:
                terms *= second.take(self._factors[1], axis=-1)
        if not self._plain:
            terms *= self._coefficient
        return self._total.of(terms)

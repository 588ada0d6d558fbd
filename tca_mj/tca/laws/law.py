"""What a law of TCAs' tensions is: rod theory, its table, or one that somebody measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, Protocol

from tca_mj.checks import Array
from tca_mj.tca.spec import TcaSpec


class TensionLaw(Protocol):
    """Tension of n TCAs over length and temperature, each element by itself.

    Attributes:
        shortest: Lower end of the law's domain, shape (n,) [m].
        longest: Upper end, shape (n,) [m].
    """

    shortest: Array
    longest: Array

    def tension(self, length: Array, temperature: Array, /) -> tuple[Array, Array]:
        """Tension, negative where a TCA would push [N], and its slope over the length [N/m].

        Args:
            length: Length of the TCAs, shape (..., n) [m].
            temperature: Temperature, same shape [°C].

        Raises:
            ValueError: If a length is outside the domain, or a temperature has no law.
        """


# A law by name, or what makes one for the n TCAs that it is given.
LawChoice = Literal["rod", "surface"] | Callable[[Sequence[TcaSpec]], TensionLaw]
"""The name of a law, or what makes one of n specifications, as a class with ``specs`` does."""

"""The tension law of TCAs of several strands, from that of their strands; see ``spec.Plies``.

n strands of length L that stand at an angle to the TCA pull it with n F(L) l/L, and L^2 = l^2 + w^2
with a winding w that is kept. This is the derivative of n times a strand's energy by l, so that no
energy is made. Side by side, w = 0, it is n F(l).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca.arrays import column, frozen
from tca_mj.tca.laws.law import TensionLaw
from tca_mj.tca.laws.rod import require_domain
from tca_mj.tca.spec import TcaSpec


def along(length: Array, wound: float | Array) -> Array:
    """Length of the strands of a TCA of a length, (..., n) [m]; ``wound`` is the specs'."""
    return np.sqrt(length * length + wound * wound)


def across(strand: Array, wound: float | Array) -> Array:
    """Length of a TCA whose strands have a length, (..., n) [m]: the inverse of ``along``."""
    return np.sqrt(strand * strand - wound * wound)


def joined(
    length: Array, strand: Array, force: Array, slope: Array, strands: float | Array
) -> tuple[Array, Array]:
    """What strands pull together: tension [N] and its slope over the TCA's length [N/m].

    Args:
        length: Length of the TCA, (..., n) [m].
        strand: Length of its strands [m].
        force: Tension of one of them [N].
        slope: Its slope over their length [N/m].
        strands: Their number.
    """
    share = length / strand
    tilt = (1.0 - share * share) * (force / strand)
    return strands * (share * force), strands * (share * share * slope + tilt)


class PliedLaw:
    """A law of n TCAs, some of several strands, by a law of single strands.

    Attributes:
        strands: The law of the strands.
        shortest: Lower end of the law's domain, shape (n,) [m].
        longest: Upper end of the law's domain, shape (n,) [m].
    """

    def __init__(
        self, specs: Sequence[TcaSpec], law: Callable[[Sequence[TcaSpec]], TensionLaw]
    ) -> None:
        self.strands = law([spec.strand for spec in specs])
        self._count, self._wound = column(specs, "strands"), column(specs, "wound")
        self.shortest, self.longest = (
            frozen(across(np.maximum(end, self._wound), self._wound))
            for end in (self.strands.shortest, self.strands.longest)
        )

    def tension(self, length: Array, temperature: Array) -> tuple[Array, Array]:
        """Tension [N] and slope [N/m]; arguments and errors as those of the strands' law."""
        length = np.asarray(length, dtype=np.float64)
        require_domain(length, self.shortest, self.longest)
        strand = along(length, self._wound)
        inside = np.clip(strand, self.strands.shortest, self.strands.longest)  # but for rounding
        force, slope = self.strands.tension(inside, temperature)
        return joined(length, strand, force, slope, self._count)


def law_of(
    specs: Sequence[TcaSpec], law: Callable[[Sequence[TcaSpec]], TensionLaw]
) -> TensionLaw:
    """The law of n TCAs: of single strands that law itself, else ``PliedLaw``."""
    return law(specs) if all(spec.plies is None for spec in specs) else PliedLaw(specs, law)

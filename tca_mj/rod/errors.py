"""What a solver of a rod says where it finds no shape."""

from __future__ import annotations


class RodSolveError(ArithmeticError):
    """The shape of a rod was not found.

    Attributes:
        residual: What is left: the largest residual of the scaled equations, the slope of the
            energy, or the estimated error of the rod's end over its length; the message tells [1].
    """

    def __init__(self, what: str, residual: float) -> None:
        super().__init__(f"rod not solved: {what}; residual {residual:.3g}")
        self.residual = residual

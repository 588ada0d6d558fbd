"""Gauss's points and weights on one piece, and polynomials through points of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from tca_mj.checks import Array


@dataclass(frozen=True, eq=False)
class GaussRule:
    """Gauss's points of one piece, scaled to 0 .. 1: quadrature and collocation.

    Attributes:
        node: The q points, shape (q,).
        weight: Their weights b, sum 1, shape (q,).
        matrix: a_ij, the integral of the polynomial of point j from 0 to point i, shape (q, q).
        transform: From values at the points to coefficients of Legendre's P_k(2 s - 1), (q, q).
    """

    node: Array
    weight: Array
    matrix: Array
    transform: Array

    @classmethod
    def of(cls, count: int) -> "GaussRule":
        """The rule of ``count`` points, order 2 ``count``."""
        x, w = legendre.leggauss(count)
        degree = np.arange(count)
        transform = (degree + 0.5)[:, None] * (legendre.legvander(x, count - 1) * w[:, None]).T
        high = legendre.legvander(x, count)
        primitive = np.empty((count, count))  # of P_k(2 s - 1) from 0 to the points
        primitive[:, 0] = x + 1.0
        primitive[:, 1:] = (high[:, 2:] - high[:, : count - 1]) / (2.0 * degree[1:] + 1.0)
        return cls(0.5 * (x + 1.0), 0.5 * w, 0.5 * primitive @ transform, transform)


def lagrange(known: Array, at: Array) -> Array:
    """Values of Lagrange's polynomials of the known points, shape (..., number of these)."""
    basis = np.empty((*at.shape, len(known)))
    for j, node in enumerate(known):
        others = np.delete(known, j)
        basis[..., j] = np.prod((at[..., None] - others) / (node - others), axis=-1)
    return basis


def halved(
    edges: Sequence[Array], owner: NDArray[np.intp], marked: NDArray[np.bool_]
) -> list[Array]:
    """Ends of the pieces of several bodies after the marked pieces were halved.

    Args:
        edges: Ends of the pieces of each body, rising.
        owner: Body of each piece, shape (n,).
        marked: Which pieces to halve, shape (n,).
    """
    middles = [0.5 * (at[:-1] + at[1:])[marked[owner == k]] for k, at in enumerate(edges)]
    return [np.sort(np.concatenate(pair)) for pair in zip(edges, middles, strict=True)]

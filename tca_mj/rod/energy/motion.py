"""Frames along a rod from its strains: Gauss's collocation of G' = G A, with its derivatives.

G is a rigid motion R, p with one more column y, the sum of mass times position from base to here,

        [ R  p  y ]          [ u x  v  0 ]
    G = [ 0  1  m ]      A = [ 0    0  d ]
        [ 0  0  1 ]          [ 0    0  0 ]

for angular strain u, linear strain v and mass per length d, so that p' = R v and y' = d p. All
that a dead load or a weight works with, p and y at the tip, is linear in the last G. Gauss's
methods keep quadratic invariants: R stays a rotation to rounding, and the order at the ends of a
piece is twice the number of points (Hairer, Lubich, Wanner, Geometric Numerical Integration,
IV.2). Varying the strains in a sum over the points gives the adjoint of the same order.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array
from tca_mj.quadrature import GaussRule
from tca_mj.rod.lie import hat

# Derivatives of A by the six strains (u, v).
BASIS = np.zeros((6, 5, 5))
BASIS[:3, :3, :3] = hat(np.eye(3))
BASIS[[3, 4, 5], [0, 1, 2], 3] = 1.0


def rigid(rotation: ArrayLike, offset: ArrayLike) -> Array:
    """A rigid transform as a factor of G, shape (5, 5)."""
    factor = np.eye(5)
    factor[:3, :3], factor[:3, 3] = rotation, offset
    return factor


def lump(mass: float, centre: ArrayLike) -> Array:
    """A mass with its centre in the local frame, as a factor of G, shape (5, 5)."""
    factor = np.eye(5)
    factor[:3, 4] = mass * np.asarray(centre, dtype=np.float64)
    factor[3, 4] = mass
    return factor


@dataclass(frozen=True, eq=False)
class Pieces:
    """n pieces of a rod, each from the identity at its start.

    With dA_r the change of A at point r, the motion E over a piece changes by sum_r S_r dA_r T_r
    and, in second order, by the sum over r and q of S_r dA_r N_rq dA_q T_q.

    Attributes:
        motion: E, shape (n, 5, 5).
        ahead: S, from the start to the points, shape (n, q, 5, 5).
        behind: T, from the points to the end, times their weight, shape (n, q, 5, 5).
        between: N, shape (n, q, q, 5, 5).
    """

    motion: Array
    ahead: Array
    behind: Array
    between: Array

    @classmethod
    def of(cls, rule: GaussRule, length: Array, strain: Array, density: Array) -> "Pieces":
        """Integrates.

        Args:
            rule: Points of each piece.
            length: Lengths of the pieces, shape (n,).
            strain: Strains (u, v) at the points, shape (n, q, 6).
            density: Mass per length of the pieces, shape (n,).
        """
        n, q = strain.shape[:2]
        generator = np.tensordot(strain, BASIS, 1)
        generator[:, :, 3, 4] = density[:, None]
        generator *= length[:, None, None, None]
        # The stages S_q = 1 + sum_r a_qr S_r A_r, all side by side: S (1 - B) = (1, 1, ...).
        system = -np.einsum("qr,nrij->nriqj", rule.matrix, generator).reshape(n, 5 * q, 5 * q)
        system += np.eye(5 * q)
        inverse = np.linalg.inv(system).reshape(n, q, 5, q, 5).swapaxes(2, 3)
        ahead = inverse.sum(axis=1)
        ends = rule.weight[:, None, None] * generator
        motion = np.eye(5) + np.einsum("nqij,nqjk->nik", ahead, ends)
        back = np.einsum("npqij,nqjk->npik", inverse, ends)
        behind = rule.weight[:, None, None] * np.eye(5) + np.einsum(
            "qr,nqij->nrij", rule.matrix, back
        )
        between = np.einsum("pr,npqij->nrqij", rule.matrix, inverse)
        scale = length[:, None, None, None]
        return cls(motion, ahead, behind * scale, between * scale[..., None])

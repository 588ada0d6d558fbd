"""Rotations as quaternions h = (h0, h1, h2, h3), scalar first, of any length but zero.

A quaternion need not have unit length: its matrix divides by it, so that an integration of
h' = h u/2 cannot leave SO(3) [Sun, dissertation, Colorado State University, Section 3.4.2, eqs.
(3.32), (3.33)]. All functions act on the last axis and broadcast over the others.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def quaternion_product(left: ArrayLike, right: ArrayLike) -> Array:
    """Hamilton's product: the rotation ``right`` first, then ``left``; shapes (..., 4)."""
    a, b = np.asarray(left, dtype=np.float64), np.asarray(right, dtype=np.float64)
    a0, a1, a2, a3 = np.moveaxis(a, -1, 0)
    b0, b1, b2, b3 = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
            a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
            a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
            a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
        ],
        axis=-1,
    )


def quaternion_exp(angle: ArrayLike) -> Array:
    """Unit quaternion of a rotation vector (axis times angle), shape (..., 3) [rad]."""
    half = 0.5 * np.asarray(angle, dtype=np.float64)
    size = np.linalg.norm(half, axis=-1, keepdims=True)
    # np.sinc(x) is sin(pi x)/(pi x), without a division by zero at the identity.
    return np.concatenate([np.cos(size), np.sinc(size / np.pi) * half], axis=-1)


def quaternion_matrix(quaternion: ArrayLike) -> Array:
    """Rotation matrices of quaternions of any length, shape (..., 4) -> (..., 3, 3).

    Sun, eq. (3.33), with -h1² - h2² as its last entry.
    """
    h = np.asarray(quaternion, dtype=np.float64)
    h0, h1, h2, h3 = np.moveaxis(h, -1, 0)
    matrix = np.stack(
        [
            np.stack([-h2 * h2 - h3 * h3, h1 * h2 - h3 * h0, h1 * h3 + h2 * h0], axis=-1),
            np.stack([h1 * h2 + h3 * h0, -h1 * h1 - h3 * h3, h2 * h3 - h1 * h0], axis=-1),
            np.stack([h1 * h3 - h2 * h0, h2 * h3 + h1 * h0, -h1 * h1 - h2 * h2], axis=-1),
        ],
        axis=-2,
    )
    return np.eye(3) + 2.0 * matrix / np.sum(h * h, axis=-1)[..., None, None]


def matrix_quaternion(matrix: ArrayLike) -> Array:
    """Unit quaternion of one rotation matrix, shape (3, 3) -> (4,), with h0 >= 0.

    The eigenvector of Bar-Itzhack's symmetric matrix [J. Guidance 23(6), 2000]: no case
    distinction, accurate for every angle, and the nearest rotation of a matrix that is slightly off.

    Raises:
        ValueError: If the matrix is not a rotation (to 1e-6).
    """
    r = np.asarray(matrix, dtype=np.float64)
    if r.shape != (3, 3) or not (
        np.abs(r @ r.T - np.eye(3)).max() < 1e-6 and np.linalg.det(r) > 0.0
    ):
        raise ValueError(f"rotation must be a 3 x 3 rotation matrix, got {matrix!r}")
    symmetric = np.empty((4, 4))
    symmetric[0, 0] = np.trace(r)
    symmetric[0, 1:] = symmetric[1:, 0] = [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]
    symmetric[1:, 1:] = r + r.T - np.trace(r) * np.eye(3)
    quaternion: Array = np.linalg.eigh(symmetric)[1][:, -1]
    return -quaternion if quaternion[0] < 0.0 else quaternion


def running_product(quaternion: ArrayLike) -> Array:
    """Products q0, q0 q1, q0 q1 q2, ... along the second last axis, shape (n, 4).

    By doubling: log2(n) vectorised passes instead of a loop of n products.
    """
    product = np.array(quaternion, dtype=np.float64)
    reach = 1
    while reach < len(product):
        product[reach:] = quaternion_product(product[:-reach], product[reach:])
        reach *= 2
    return product


def hat(vector: ArrayLike) -> Array:
    """Matrices of the cross product: hat(a) b = a x b; shape (..., 3) -> (..., 3, 3)."""
    x, y, z = np.moveaxis(np.asarray(vector, dtype=np.float64), -1, 0)
    zero = np.zeros_like(x)
    rows = ([zero, -z, y], [z, zero, -x], [-y, x, zero])
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

"""Rotations as quaternions h = (h0, h1, h2, h3), scalar first, of any length but zero.

A quaternion need not have unit length: its matrix divides by it, so that an integration of
h' = h u/2 cannot leave SO(3) [Sun, dissertation, Colorado State University, Section 3.4.2, eqs.
(3.32), (3.33)]. All functions act on the last axis and broadcast over the others.
"""

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array


def quaternion_product(left: ArrayLike, right: ArrayLike) -> Array:
    """Hamilton's product: the rotation ``right`` first, then ``left``; shapes (..., 4)."""
    a, b = np.asarray(left, dtype=np.float64), np.asarray(right, dtype=np.float64)
    a0, a1, a2, a3 = np.moveaxis(a, -1, 0)
    b0, b1, b2, b3 = np.moveaxis(b, -1, 0)
    product = [
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
        a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
        a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    ]
    return np.stack(product, axis=-1)


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
    entries = [
        -h2 * h2 - h3 * h3, h1 * h2 - h3 * h0, h1 * h3 + h2 * h0,
        h1 * h2 + h3 * h0, -h1 * h1 - h3 * h3, h2 * h3 - h1 * h0,
        h1 * h3 - h2 * h0, h2 * h3 + h1 * h0, -h1 * h1 - h2 * h2,
    ]  # fmt: skip
    matrix = np.stack(entries, axis=-1).reshape(*h.shape[:-1], 3, 3)
    return np.eye(3) + 2.0 * matrix / np.sum(h * h, axis=-1)[..., None, None]


def matrix_quaternion(matrix: ArrayLike) -> Array:
    """Unit quaternion of one rotation matrix, shape (3, 3) -> (4,), with h0 >= 0.

    The eigenvector of Bar-Itzhack's symmetric matrix [J. Guidance 23(6), 2000]: no case
    distinction, accurate for every angle, and the nearest rotation of a matrix slightly off.

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


def screw_translation(angle: ArrayLike, move: ArrayLike) -> Array:
    """Where a steady screw motion takes the origin: translation of the exponential on SE(3).

    Args:
        angle: Rotation vector of the whole motion, shape (..., 3) [rad].
        move: Translation in the moving frame, shape (..., 3) [m].

    Returns:
        Translation in the frame at the start: with t = |angle|, move + (1 - cos t)/t² angle x move
        + (t - sin t)/t³ angle x (angle x move), shape (..., 3) [m].
    """
    angle, move = np.asarray(angle, dtype=np.float64), np.asarray(move, dtype=np.float64)
    size = np.linalg.norm(angle, axis=-1, keepdims=True)
    first = 0.5 * np.square(np.sinc(size / (2.0 * np.pi)))
    small = size < 0.1
    safe = np.where(small, 1.0, size)
    # Below 0.1 the series: t - sin t would lose digits; what is left out is below 1e-15.
    t2 = np.square(size)
    series = 1 / 6 - t2 / 120 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110)))
    second = np.where(small, series, (safe - np.sin(safe)) / safe**3)
    across = np.cross(angle, move)
    return move + first * across + second * np.cross(angle, across)


def integrate_strain(
    angular: ArrayLike, linear: ArrayLike, step: float, start: ArrayLike
) -> tuple[Array, Array]:
    """Solves h' = h u/2 and p' = R v, p(0) = 0, from strains in the moving frame.

    Magnus's expansion of fourth order on rigid motions: exact where the strains are constant.

    Args:
        angular: Turn per length u at nodes and middles in turn, shape (2 n + 1, 3) [rad/m].
        linear: Stretch v there, shape (2 n + 1, 3).
        step: Distance of the nodes [m].
        start: Quaternion at the first node, shape (4,).

    Returns:
        Quaternions, shape (n + 1, 4), and positions [m] at the nodes, shape (n + 1, 3).
    """
    u, v = np.asarray(angular, dtype=np.float64), np.asarray(linear, dtype=np.float64)
    u0, v0, u1, v1 = u[:-2:2], v[:-2:2], u[2::2], v[2::2]
    angle = step / 6.0 * (u0 + 4.0 * u[1::2] + u1) + step**2 / 12.0 * np.cross(u0, u1)
    move = step / 6.0 * (v0 + 4.0 * v[1::2] + v1)
    move += step**2 / 12.0 * (np.cross(u0, v1) + np.cross(v0, u1))
    quaternion = running_product(np.vstack([start, quaternion_exp(angle)]))
    pieces = np.einsum(
        "nij,nj->ni", quaternion_matrix(quaternion[:-1]), screw_translation(angle, move)
    )
    return quaternion, np.vstack([np.zeros(3), np.cumsum(pieces, axis=0)])


def quaternion_log(quaternion: ArrayLike) -> Array:
    """Rotation vectors, of length pi at most, of quaternions, shape (..., 4) -> (..., 3) [rad]."""
    h = np.asarray(quaternion, dtype=np.float64)
    h = np.where(h[..., :1] < 0.0, -h, h)
    size = np.linalg.norm(h[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(size, h[..., :1])
    # size/scalar is tan(half): dividing by the larger of the two loses nothing near zero.
    safe = np.where(size > 0.0, size, 1.0)
    return np.where(size > 0.0, 2.0 * half / safe, 2.0) * h[..., 1:]


def hat(vector: ArrayLike) -> Array:
    """Matrices of the cross product: hat(a) b = a x b; shape (..., 3) -> (..., 3, 3)."""
    v = np.asarray(vector, dtype=np.float64)
    matrix = np.zeros((*v.shape, 3))
    matrix[..., [2, 0, 1], [1, 2, 0]] = v
    matrix[..., [1, 2, 0], [2, 0, 1]] = -v
    return matrix

"""A fibre of any shape under heat and a dead load: the full boundary value problem of the rod.

In the frame of the section, with u = u* + untwist e_z + K_bt^-1 m and v = e_z + K_se^-1 n, the
balance of Sun, dissertation, Colorado State University, eqs. (3.6) to (3.8), reads

    m' = m x u + n x v        n' = n x u        R' = R hat(u)        p' = R v.

The base is clamped: R(0) and p(0) are given. A force F that keeps its direction acts at the
fibre's end, where the moment is M, zero by default. F is the same in every section,
n = R^T F, which is why the problem needs no orientations: n(0) = R(0)^T F at the base and
m(l_t) = M at the end (a moment M that is fixed in the world is carried along like n). That
leaves 6 (with M 9) smooth unknowns per section, constants for a uniform helix, and no
unknowns at all for a fibre without load. Frames and positions follow by integrating
h' = h u/2 and p' = R v (Section 3.4.2).

Collocation with Lobatto's three points (fourth order) turns this into banded equations; Newton
solves them along a path on which first the load grows and then the heat, as in an
experiment, and the mesh is halved until the end of the fibre stays where it is.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, solve_banded

from tca_mj.rod.lie import (
    hat,
    matrix_quaternion,
    quaternion_exp,
    quaternion_matrix,
    quaternion_product,
    running_product,
)
from tca_mj.tca.centreline import Centreline
from tca_mj.tca.moduli import radial_growth, softening, untwist
from tca_mj.tca.spec import FibreSpec

Array = NDArray[np.float64]

_RESIDUAL = 1e-11  # Newton's goal: change of the scaled wrench that a step leaves unexplained
_NEWTON_STEPS = 12
_SMALLEST_STEP = 1e-4  # of the path from the unloaded cold to the loaded hot fibre
_PER_TURN = 12  # intervals of the first mesh per turn of the frame
_FINEST = 60_000  # intervals


class RodSolveError(ArithmeticError):
    """The shape of a fibre was not found.

    Attributes:
        residual: What is left: Newton's largest residual, or the change of the end between the
            two finest meshes over the length of the fibre [1].
    """

    def __init__(self, what: str, residual: float, allowed: float) -> None:
        super().__init__(f"fibre not solved: {what}; {residual:.3g} is left, allowed {allowed:.3g}")
        self.residual = residual


@dataclass(frozen=True, slots=True, eq=False)
class FibreShape:
    """A solved fibre at n sections from base to end; the first axis of every array.

    Attributes:
        arc_length: Position along the unloaded fibre, shape (n,) [m].
        position: Points of the centre line, world frame, shape (n, 3) [m].
        quaternion: Orientation of the sections, scalar first, shape (n, 4).
        angular: Turn per length u in the section's frame, shape (n, 3) [rad/m].
        linear: Stretch v in the section's frame, (0, 0, 1) if unloaded, shape (n, 3).
        moment: Internal moment m in the section's frame, shape (n, 3) [N m].
        force: Internal force n in the section's frame, shape (n, 3) [N].
        error: Estimated error of the end's position [m].
        residual: Largest residual of the collocation equations [1].
    """

    arc_length: Array
    position: Array
    quaternion: Array
    angular: Array
    linear: Array
    moment: Array
    force: Array
    error: float
    residual: float

    @property
    def end(self) -> Array:
        """Position of the fibre's end, shape (3,) [m]."""
        return self.position[-1]

    @property
    def rotation(self) -> Array:
        """Frames of the sections, columns x, y, z, shape (n, 3, 3)."""
        return quaternion_matrix(self.quaternion)


class Stiffness(NamedTuple):
    """K of Sun, eq. (3.8): bending EI [N m²], torsion GJ [N m²], shear GA [N], stretch EA [N]."""

    bending: float
    torsion: float
    shear: float
    stretch: float


def fibre_stiffness(fibre: FibreSpec, temperature: float, torsion: float = 0.0) -> Stiffness:
    """Stiffness of the fibre's section, softened and, if it is of the "hot" kind, grown.

    Args:
        fibre: The fibre.
        temperature: Temperature [°C].
        torsion: Torsion that the load causes at the cold modulus, see ``softening`` [rad/m].

    Raises:
        ValueError: If no modulus is left.
    """
    share = float(softening(fibre, temperature, torsion))
    growth = 1.0 + float(radial_growth(fibre, temperature)) if fibre.section == "hot" else 1.0
    young, shear = share * fibre.young, share * fibre.shear
    second_moment, area = fibre.second_moment * growth**4, fibre.area * growth**2
    return Stiffness(young * second_moment, 2.0 * shear * second_moment, shear * area, young * area)


def solve_fibre(
    centreline: Centreline,
    fibre: FibreSpec,
    temperature: float,
    force: ArrayLike = (0.0, 0.0, 0.0),
    moment: ArrayLike = (0.0, 0.0, 0.0),
    *,
    tolerance: float = 1e-7,
    intervals: int | None = None,
) -> FibreShape:
    """Shape of a fibre, one end clamped, under heat and a dead load at its other end.

    The fibre does not touch itself, and its own weight is left out. The load softens it by the
    torsion F r_t cos(alpha)/(G J) [Sun, eq. (3.11)] if it pulls; sin(alpha) is the rise of the
    reference shape along F over the fibre's length, which for a helix is the pitch angle.

    Args:
        centreline: Reference shape and clamp.
        fibre: The twisted fibre.
        temperature: Temperature [°C].
        force: Force at the fibre's end, world frame, shape (3,) [N].
        moment: Moment on the fibre's end, world frame, shape (3,) [N m]; zero lets it spin.
        tolerance: Allowed error of the end's position over the length of the fibre.
        intervals: A mesh of so many equal intervals and no other; ``error`` is then NaN. By
            default the mesh is refined until ``tolerance`` is met.

    Raises:
        ValueError: If a number is not finite, or the temperature leaves no modulus.
        RodSolveError: If Newton's method fails on the way or the finest mesh misses the tolerance.
    """
    load = np.asarray(force, dtype=np.float64), np.asarray(moment, dtype=np.float64)
    for name, vector in zip(("force", "moment"), load, strict=True):
        if vector.shape != (3,) or not np.all(np.isfinite(vector)):
            raise ValueError(f"{name} must be three finite numbers, got {vector}")
    if not -273.15 < temperature < np.inf:
        raise ValueError(f"temperature = {temperature} °C must be finite and above -273.15")
    if not tolerance > 0.0:
        raise ValueError(f"tolerance = {tolerance} must be above 0")
    if intervals is not None and intervals < 1:
        raise ValueError(f"intervals = {intervals} must be at least 1")
    twist = float(untwist(fibre, temperature))
    problem = _Problem.of(centreline, fibre, temperature, load)
    if intervals is not None:
        mesh = problem.mesh(intervals)
        return problem.shape(mesh, *problem.follow(mesh, twist), twist, np.nan)
    count = problem.first_count(twist)
    mesh = problem.mesh(count)
    state, residual = problem.follow(mesh, twist)
    shape = problem.shape(mesh, state, residual, twist, np.nan)
    while True:
        count *= 2
        mesh = problem.mesh(count)
        middle = 0.5 * (state[1:] + state[:-1])
        guess = np.empty((count + 1, state.shape[1]))
        guess[::2], guess[1::2] = state, middle
        state, residual = problem.newton(mesh, guess, 1.0, twist)
        if state is None:
            raise RodSolveError("Newton failed on a finer mesh", residual, _RESIDUAL)
        finer = problem.shape(mesh, state, residual, twist, np.nan)
        change = float(np.linalg.norm(finer.end - shape.end)) / centreline.length
        # Fourth order: what is left is a fifteenth of the last change.
        if change / 15.0 <= tolerance:
            return problem.shape(mesh, state, residual, twist, change / 15.0 * centreline.length)
        if 2 * count > _FINEST:
            raise RodSolveError("the finest mesh is too coarse", change / 15.0, tolerance)
        shape = finer


class _Mesh(NamedTuple):
    step: float  # scaled length of an interval
    reference: Array  # scaled u* at nodes and middles, shape (2 n + 1, 3)
    arc: Array  # at nodes [m]


class _Problem:
    """The equations, scaled: lengths by the fibre's mean radius of curvature, moments by GJ."""

    def __init__(self) -> None: ...

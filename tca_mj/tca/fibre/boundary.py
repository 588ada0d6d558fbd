"""A fibre of any shape under heat and a dead load: the full boundary value problem of the rod.

Sun, dissertation, Colorado State University, eqs. (3.5) to (3.8), for one fibre whose base is
clamped, whose other end carries a force of fixed direction *at the fibre itself*, and is free to
turn (or carries a moment too). Unlike ``laws.rod``, which needs a uniform helix, this takes every
centre line, and knows the end turns of the coil. The wrench is found by ``rod.deadload``, the
shape then by integrating h' = h u/2, p' = R v (Section 3.4.2), exactly for constant strain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, door, number, require_positive, whole, within
from tca_mj.rod.deadload.descent import follow
from tca_mj.rod.deadload.wrench import DeadLoad
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import integrate_strain, matrix_quaternion, quaternion_matrix
from tca_mj.rod.solving import with_finer_meshes
from tca_mj.tca.fibre.centreline import Centreline
from tca_mj.tca.moduli import radial_growth, softening, untwist
from tca_mj.tca.thread import FibreSpec

_PER_TURN = 10  # intervals of the first mesh per turn of the frame
_FINEST = 50_000  # intervals


@dataclass(frozen=True, slots=True, eq=False)
class FibreShape:
    """A solved fibre at n sections from base to end, the first axis of every array.

    Attributes:
        arc_length: Position along the unloaded fibre, shape (n,) [m].
        position: Points of the centre line, world frame, shape (n, 3) [m].
        quaternion: Orientation of the sections, scalar first, shape (n, 4) [1].
        angular: Turn per length u in the section's frame, shape (n, 3) [rad/m].
        linear: Stretch v in the section's frame, (0, 0, 1) if unloaded, shape (n, 3) [1].
        moment: Internal moment m in the section's frame, shape (n, 3) [N m].
        force: Internal force n in the section's frame, shape (n, 3) [N].
        residual: Largest residual of the scaled equations [1].
        error: Estimated error of the end's position, NaN if only one mesh was solved [m].
    """

    arc_length: Array
    position: Array
    quaternion: Array
    angular: Array
    linear: Array
    moment: Array
    force: Array
    residual: float
    error: float

    @property
    def end(self) -> Array:
        """Position of the fibre's end, world frame, shape (3,) [m]."""
        return self.position[-1]

    @property
    def rotation(self) -> Array:
        """Frames of the sections, columns x, y, z, shape (n, 3, 3)."""
        return quaternion_matrix(self.quaternion)


class Stiffness(NamedTuple):
    """Stiffness of a fibre's section, Sun, eq. (3.8).

    Attributes:
        bending: EI [N m²].
        torsion: GJ [N m²].
        shear: GA [N].
        stretch: EA [N].
    """

    bending: float
    torsion: float
    shear: float
    stretch: float


@door
def fibre_stiffness(fibre: FibreSpec, temperature: float, torsion: float = 0.0) -> Stiffness:
    """Stiffness of the fibre's section: softened, and grown if ``fibre.section`` is "hot".

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


@door
def solve_fibre(
    centreline: Centreline,
    fibre: FibreSpec,
    temperature: float,
    force: ArrayLike = (0.0, 0.0, 0.0),
    moment: ArrayLike = (0.0, 0.0, 0.0),
    *,
    tolerance: float = 1e-6,
    intervals: Annotated[int, partial(whole, at_least=1, at_most=_FINEST)] | None = None,
) -> FibreShape:
    """Shape of a fibre, one end clamped, under heat and a dead load on its other end.

    The fibre may pass through itself (coils in contact are not known), and its own weight is left
    out. The load softens it [Sun, eq. (3.11)] if it pulls, by the torsion
    F r_t cos(alpha)/(G J); sin(alpha) is the rise of the reference shape along F over the
    fibre's length, the pitch angle of a helix.

    Args:
        centreline: Reference shape, and place and frame of the clamp.
        fibre: The twisted fibre.
        temperature: Temperature [°C].
        force: Force at the fibre's end, world frame, shape (3,) [N].
        moment: Moment on the fibre's end, world frame, shape (3,); zero lets it spin [N m].
        tolerance: Allowed error of the end's position over the fibre's length [1].
        intervals: Solves on one mesh of so many equal intervals, at most 50 000. By default
            the mesh is refined until ``tolerance`` is met.

    Raises:
        ValueError: If an argument is not finite or too small, or no modulus is left.
        RodSolveError: If Newton's method does not converge, or the finest mesh is too coarse.
    """
    force, moment = within("force", force, shape=(3,)), within("moment", moment, shape=(3,))
    number("temperature", temperature, above=-273.15, unit="°C")
    require_positive(tolerance=tolerance)
    torsion = _load_torsion(centreline, fibre, force)
    stiffness = fibre_stiffness(fibre, temperature, torsion)
    twist = float(untwist(fibre, temperature))

    def meshed(count: int) -> _Meshed:
        return _Meshed(centreline, stiffness, twist, force, moment, count)

    def followed(finer: int) -> tuple[FibreShape, Array]:
        mesh = meshed(finer * coarse)
        state, residual = follow(mesh.problem)
        return mesh.shape(state, residual), state

    if intervals is not None:
        coarse = intervals
        return followed(1)[0]

    coarse = max(8, math.ceil(_PER_TURN * _turns(centreline, twist)))
    shape, state = with_finer_meshes(followed)
    while True:
        count = 2 * (len(state) - 1)
        mesh = meshed(count)
        guess = np.empty((count + 1, mesh.problem.size))
        guess[::2] = state
        guess[1::2] = 0.5 * (state[1:] + state[:-1])
        state, residual = mesh.problem.newton(guess)
        # Fourth order: a fifteenth of the last change is left.
        finer = mesh.shape(state, residual, shape.end)
        if finer.error <= tolerance * centreline.length:
            return finer
        if 2 * count > _FINEST:
            raise RodSolveError("the finest mesh is too coarse", finer.error / centreline.length)
        shape = finer


def _turns(centreline: Centreline, twist: float) -> float:
    """Turns of the heated, unloaded fibre's frame."""
    at = np.linspace(0.0, centreline.length, 257)
    strain = within("strain(s)", centreline.strain(at), shape=(257, 3))
    rate = np.linalg.norm(strain + [0.0, 0.0, twist], axis=1)
    turns = float(np.mean(rate)) * centreline.length / (2.0 * math.pi)
    number("turns of the fibre's frame", turns, at_most=_FINEST / _PER_TURN)
    return turns


def _load_torsion(centreline: Centreline, fibre: FibreSpec, force: Array) -> float:
    """Torsion by which a pulling force softens the fibre, 0 if it pushes [rad/m]."""
    size = float(np.linalg.norm(force))
    if size == 0.0 or fibre.load_softening[:2] == (0.0, 0.0):
        return 0.0
    count = max(64, math.ceil(4 * _PER_TURN * _turns(centreline, 0.0)))
    u = centreline.strain(np.linspace(0.0, centreline.length, 2 * count + 1))
    v = np.broadcast_to([0.0, 0.0, 1.0], u.shape)
    start = matrix_quaternion(centreline.rotation)
    _, position = integrate_strain(u, v, centreline.length / count, start)
    sin = float(position[-1] @ force) / (size * centreline.length)
    if sin <= 0.0:
        return 0.0
    cold = 2.0 * fibre.shear * fibre.second_moment
    return size * fibre.radius * math.sqrt(max(0.0, 1.0 - sin * sin)) / cold


class _Meshed:
    """The problem on a mesh, in units of GJ and of a length: the mean radius of the frame's turn.

    Attributes:
        problem: The scaled problem.
    """

    def __init__(
        self, centreline: Centreline, stiffness: Stiffness, twist: float, force: Array,
        moment: Array, intervals: int,
    ) -> None:  # fmt: skip
        self._line, self._torsion = centreline, stiffness.torsion
        arc = np.linspace(0.0, centreline.length, 2 * intervals + 1)
        reference = np.asarray(centreline.strain(arc), dtype=np.float64)
        mean = float(np.mean(np.linalg.norm(reference, axis=1)))
        self._scale = scale = 1.0 / max(mean, 1.0 / centreline.length)
        vectors = force[None] * (scale**2 / stiffness.torsion)
        if moment.any():
            vectors = np.vstack([vectors, moment * (scale / stiffness.torsion)])
        ratio = stiffness.torsion / stiffness.bending
        stretch = np.array([stiffness.shear, stiffness.shear, stiffness.stretch])
        self.problem = DeadLoad(
            step=centreline.length / intervals / scale, reference=scale * reference,
            heat=np.array([0.0, 0.0, scale * twist]), angular=np.array([ratio, ratio, 1.0]),
            linear=stiffness.torsion / scale**2 / stretch, vectors=vectors @ centreline.rotation,
        )  # fmt: skip

    def shape(self, state: Array, residual: float, coarser: Array | None = None) -> FibreShape:
        """The shape that belongs to a solved wrench, in metres and newtons."""
        line, scale, intervals = self._line, self._scale, self.problem.intervals
        u, v = self.problem.strain(state)
        u /= scale
        start = matrix_quaternion(line.rotation)
        quaternion, moved = integrate_strain(u, v, line.length / intervals, start)
        position = line.position + moved
        change = math.nan if coarser is None else float(np.linalg.norm(position[-1] - coarser))
        return FibreShape(
            arc_length=np.linspace(0.0, line.length, intervals + 1), position=position,
            quaternion=quaternion, angular=u[::2], linear=v[::2],
            moment=state[:, :3] * (self._torsion / scale),
            force=state[:, 3:6] * (self._torsion / scale**2),
            residual=residual, error=change / 15.0,
        )  # fmt: skip

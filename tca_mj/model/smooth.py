"""Springs that make hinges and polylines rest like the smooth body that they stand for.

MuJoCo knows hinges with springs, and tendons that run straight from site to site. What is meant
is a body that is strained evenly within a cell: a cell of length h that is turned by the rotation
vector θ and stretched by e has u = θ/h and v = 1 + e/h, bends against its stiffness K with the
moment K (θ - θ0)/h, and a leg of a TCA at the offset r(s) = (x, y) has in it the length

    l = ∫ |w| ds,    w = r' + v e_z + u × r = (x' - u₃ y, y' + u₃ x, v + u₁ y - u₂ x),

as in Cosserat's theory. The loads on the joints that follow, K (θ - θ0)/h + F dl/dθ about the
hinges' axes, differ from those of MuJoCo's springs and tendons by little. The difference goes into
the references of the springs, renewed together with the tensions, so that nothing is left of it
in a body at rest. What is left is that a cell bends in its middle and not along an arc.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.model.chain import MOTIONS, Chain, Motion
from tca_mj.model.tendon import Crossing, RoutedTca

Array = NDArray[np.float64]

# Gauss's rule along a cell, from 0 to 1: exact to 1e-8 for a quarter of a turn of a helix.
_POINTS, _WEIGHTS = (np.polynomial.legendre.leggauss(4) + np.array([[1.0], [0.0]])) / 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Strained:
    """Cells and TCAs at some positions of the joints.

    Attributes:
        motion: Stretch [m] and rotation vector [rad] of each cell, shape (4, cells).
        length: Length of the smooth curve of each TCA, shape (n,) [m].
        each: Its length in each crossing, shape (crossings,) [m].
        slope: Derivatives of the length of each crossing by its cell's motion, (crossings, 4).
        half: Sine and cosine of half the angles of the hinges, shape (2, 3, cells).
        cotangent: Half of each cell's angle times the cotangent of it, shape (cells,).
    """

    motion: Array
    length: Array
    each: Array
    slope: Array
    half: Array
    cotangent: Array


class SmoothBody:
    """Cells of a compiled model and the TCAs that cross them.

    Attributes:
        stiffness: Of each cell against its motion, without TCAs, shape (4, cells) [N/m, N m/rad];
            zero for a motion that the chain leaves out.
        rest: Motion of each cell at rest, shape (4, cells) [m, rad].
        damping: Of each cell's motion, without TCAs, shape (4, cells) [N s/m, N m s/rad].
    """

    def __init__(
        self, model: mujoco.MjModel, tcas: Sequence[RoutedTca], chains: Iterable[Chain] = ()
    ) -> None:
        """Reads springs and tendons from ``model`` as it was compiled.

        Args:
            model: The model, which ``support`` and ``steady`` write to.
            tcas: TCAs in it; the cells that they cross are smooth.
            chains: Chains in it all of whose cells are smooth.
        """
        crossings = [crossing for tca in tcas for crossing in tca.crossings]
        cells = {tuple(joints.values()): joints for chain in chains for joints in chain.joints}
        cells |= {tuple(crossing.joints.values()): crossing.joints for crossing in crossings}
        number = {key: i for i, key in enumerate(cells)}
        self._model = model
        self._last: tuple[Array, Strained] | None = None  # asked for again at the next update
        self._tca = np.array([i for i, tca in enumerate(tcas) for _ in tca.crossings], np.int64)
        self._cell = np.array([number[tuple(c.joints.values())] for c in crossings], np.int64)
        self._read_cells(list(cells.values()))
        self._read_curves(crossings, len(tcas))
        self._read_tendons([model.tendon(tca.name).id for tca in tcas])
        self._read_polylines(crossings)
        self.rest = self.at(model.qpos_spring).motion.copy()

    def _read_cells(self, cells: Sequence[dict[Motion, str]]) -> None:
        """Which joint is which motion of which cell."""
        model, shape = self._model, (len(MOTIONS), len(cells))
        joint = np.full(shape, -1)
        self._order = np.ones(len(cells))  # -1 where the order of the joints is reversed
        for i, joints in enumerate(cells):
            for motion, name in joints.items():
                joint[MOTIONS.index(motion), i] = model.joint(name).id
            if [motion for motion in MOTIONS if motion in joints] != list(joints):
                self._order[i] = -1.0
        self._half, self._twice = 0.5 * self._order, 2.0 * self._order
        self._shape = shape
        self._where = np.flatnonzero(joint >= 0)
        # A slice where no motion is left out: a view instead of a copy.
        self._held = slice(None) if len(self._where) == joint.size else self._where
        self._joint = joint.ravel()[self._where]
        self._qpos, self._dof = model.jnt_qposadr[self._joint], model.jnt_dofadr[self._joint]
        self.damping = np.zeros(shape)
        self.damping.flat[self._where] = model.dof_damping[self._dof]
        self.stiffness = np.zeros(shape)
        self.stiffness.flat[self._where] = model.jnt_stiffness[self._joint]

    def _read_curves(self, crossings: Sequence[Crossing], tcas: int) -> None:
        """w = tangent + lever @ motion at the points of a crossing."""
        count, rows = len(crossings), 3 * len(_POINTS)
        self._h = np.array([crossing.cell for crossing in crossings])
        offset, slope = np.empty((2, count, len(_POINTS), 2))
        for i, crossing in enumerate(crossings):
            start, end = crossing.span
            s = start + (end - start) * _POINTS
            offset[i] = crossing.leg.offset(s)
            slope[i] = crossing.leg.slope(s) * (end - start) / crossing.cell
        x, y = np.moveaxis(offset, -1, 0)
        zero, one = np.zeros_like(x), np.ones_like(x)
        lever = np.array([[zero, zero, zero, -y], [zero, zero, zero, x], [one, y, -x, zero]])
        lever = np.moveaxis(lever, (0, 1), (2, 3)) / self._h[:, None, None, None]
        self._lever = lever.reshape(count, rows, len(MOTIONS))
        self._tangent = np.concatenate([slope, one[..., None]], axis=-1).reshape(count, rows)
        self._weight = self._h[:, None] * _WEIGHTS
        # Sums over the crossings of a cell and of a TCA.
        self._into_cells = np.zeros((count, self._shape[1]))
        self._into_cells[np.arange(count), self._cell] = 1.0
        self._into_tcas = np.zeros((count, tcas))
        self._into_tcas[np.arange(count), self._tca] = 1.0

    def _read_tendons(self, tendons: Sequence[int]) -> None:
        """Where MuJoCo keeps the tendons' derivatives by the cells' joints, in a sparse matrix."""
        model, row = self._model, {int(dof): i for i, dof in enumerate(self._dof)}
        entries = [
            (k, i, row[int(model.ten_J_colind[k])])
            for i, tendon in enumerate(tendons)
            for first in [int(model.ten_J_rowadr[tendon])]
            for k in range(first, first + int(model.ten_J_rownnz[tendon]))
            if int(model.ten_J_colind[k]) in row
        ]
        self._entries = np.array(entries, dtype=np.int64).reshape(-1, 3).T

    def _read_polylines(self, crossings: Sequence[Crossing]) -> None:
        """Stiffness that the polylines have by changing their direction.

        Against twist, per newton times the length of the crossing, shape (crossings,) [m²], and by
        how much that of the smooth curves exceeds it, per newton, shape (j, n) [m]: the spring of a
        bending joint grows with the tension.
        """
        polyline = np.zeros((len(crossings), len(MOTIONS)))
        for i, crossing in enumerate(crossings):
            for motion, curving in crossing.polyline.items():
                polyline[i, MOTIONS.index(motion)] = curving
        # d²|w| = (|dw|² - (dw·w/|w|)²)/|w| in the straight body.
        shape = (len(crossings), len(_POINTS), 3, len(MOTIONS))
        w, lever = self._tangent.reshape(shape[:3]), self._lever.reshape(shape)
        norm = np.linalg.norm(w, axis=-1)[..., None]
        along = np.einsum("kgi,kgim->kgm", w / norm, lever)
        curving = (np.sum(lever**2, axis=2) - along**2) / norm
        more = np.einsum("kg,kgm->km", self._weight, curving) - polyline
        more[:, [MOTIONS.index("stretch"), MOTIONS.index("twist")]] = 0.0

        self._twist = polyline[:, MOTIONS.index("twist")] * np.sum(norm[..., 0] * self._weight, 1)
        total = np.einsum("km,kc,kn->mcn", more, self._into_cells, self._into_tcas)
        self._more = total[np.unravel_index(self._where, self._shape)]

    @np.errstate(invalid="ignore", over="ignore")  # a diverged state has no shape
    def at(self, qpos: Array) -> Strained:
        """Cells and TCAs at the positions ``qpos`` of the model's joints.

        The hinges of a cell turn about x, y, z in this order: the product of three quaternions.
        In the reversed order they turn the reversed way if the angles are reversed.
        """
        position = qpos[self._qpos]
        if self._last is not None and np.array_equal(position, self._last[0]):
            return self._last[1]
        motion = np.zeros(self._shape)
        motion.reshape(-1)[self._held] = position
        angles = self._half * motion[1:]
        half = np.empty((2, *angles.shape))
        (sx, sy, sz), (cx, cy, cz) = np.sin(angles, out=half[0]), np.cos(angles, out=half[1])
        ss, cc, sc, cs = sx * sy, cx * cy, sx * cy, cx * sy
        motion[1] = sc * cz + cs * sz
        motion[2] = cs * cz - sc * sz
        motion[3] = cc * sz + ss * cz
        cosine = cc * cz - ss * sz
        # Half the angle is arctan(sine/cosine), and goes on continuously beyond half a turn.
        sine = np.sqrt(np.einsum("ik,ik->k", motion[1:], motion[1:])) + 1e-300
        ratio = np.arctan2(sine, cosine) / sine
        motion[1:] *= self._twice * ratio
        each, slope = self._curves(motion)
        length = each @ self._into_tcas
        strained = Strained(motion, length, each, slope, half, ratio * cosine)
        self._last = position, strained
        return strained

    def _curves(self, motion: Array) -> tuple[Array, Array]:
        w = self._tangent + (self._lever @ motion.T[self._cell, :, None])[..., 0]
        w = w.reshape(len(w), len(_POINTS), 3)
        norm = np.sqrt(np.einsum("kgi,kgi->kg", w, w))
        each = np.einsum("kg,kg->k", norm, self._weight)
        w *= (self._weight / norm)[..., None]
        return each, (w.reshape(len(w), 1, 3 * len(_POINTS)) @ self._lever)[:, 0]

    def support(self, data: mujoco.MjData, strained: Strained, tension: Array) -> None:
        """Sets the springs for tensions at the positions in ``data``.

        Args:
            data: State of the model, for whose positions ``mj_tendon`` was called.
            strained: The body at these positions.
            tension: Tensions of the TCAs, shape (n,) [N].
        """
        model = self._model
        load = self.stiffness * (strained.motion - self.rest)
        load += (strained.slope.T * tension[self._tca]) @ self._into_cells
        self._turn_to_hinges(load, strained)
        entry, tca, joint = self._entries
        owed = load.reshape(-1)[self._held]
        owed -= np.bincount(joint, tension[tca] * data.ten_J[entry], len(owed))
        stiffness = self.stiffness.reshape(-1)[self._held] + self._more @ tension
        model.jnt_stiffness[self._joint] = stiffness
        model.qpos_spring[self._qpos] = data.qpos[self._qpos] - owed / stiffness

    def places(self, joints: Sequence[str]) -> NDArray[np.int64]:
        """Indices of joints in the flattened arrays of shape (4, cells).

        Raises:
            ValueError: If a joint belongs to no smooth cell.
        """
        place = {
            int(joint): int(where) for joint, where in zip(self._joint, self._where, strict=True)
        }
        try:
            return np.array([place[self._model.joint(name).id] for name in joints], np.int64)
        except KeyError as error:
            raise ValueError(f"joints must be of cells that a TCA crosses, got {joints}") from error

    def steady(self, strained: Strained, tension: Array, time: float) -> None:
        """Keeps taut tendons from chattering.

        MuJoCo takes the stiffness that they have by changing their direction explicitly. Damping,
        which is implicit, of that stiffness times the time step makes it stable at any tension.
        The stiffness is one against twist and grows as the tendon in a cell gets shorter. In a
        bent cell the hinge across the bend twists the cell, too, by half the angle of the bend.

        Args:
            strained: The body as it is now.
            tension: Tensions of the TCAs, shape (n,) [N].
            time: Damping over that stiffness, at least the time step [s].
        """
        twist = (time * tension[self._tca] * self._twist / strained.each) @ self._into_cells
        damping = self.damping.copy()
        damping[1] += 0.25 * strained.motion[2] ** 2 * twist
        damping[2] += 0.25 * strained.motion[1] ** 2 * twist
        damping[3] += twist
        self._model.dof_damping[self._dof] = damping.reshape(-1)[self._held]

    def _turn_to_hinges(self, load: Array, strained: Strained) -> None:
        """Turns the moments on the rotation vectors, load[1:], to moments about the hinges."""
        t, m = self._order * strained.motion[1:], load[1:]
        (tx, ty, tz), (mx, my, mz) = t, m
        # By the transposed derivative of the logarithm, m - t × m/2 + c t × (t × m).
        square = np.einsum("ik,ik->k", t, t)
        c = (1.0 - strained.cotangent) / np.maximum(square, 1e-9)
        along = c * np.einsum("ik,ik->k", t, m)
        turned = strained.cotangent * m + along * t
        m0 = turned[0] - 0.5 * (ty * mz - tz * my)
        m1 = turned[1] - 0.5 * (tz * mx - tx * mz)
        m2 = turned[2] - 0.5 * (tx * my - ty * mx)
        # The axes of the outer hinges as the inner ones have turned them.
        sine = 2.0 * strained.half[0, 1:] * strained.half[1, 1:]
        (sy, sz), (cy, cz) = sine, 1.0 - 2.0 * strained.half[0, 1:] ** 2
        load[1] = cy * (cz * m0 - sz * m1) + sy * m2
        load[2] = sz * m0 + cz * m1
        load[3] = m2

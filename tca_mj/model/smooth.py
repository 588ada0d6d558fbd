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

What stands before the axes named below is a batch: bodies built alike, at positions of their own.
Nothing here is rounded by a matrix product, whose order of summation depends on its size: a body
in a batch has, bit for bit, what it has alone.
"""

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.model.chain import MOTIONS, Chain, Motion
from tca_mj.model.curves import Curves, rows, summed
from tca_mj.model.tendon import Crossing, RoutedTca


@dataclass(frozen=True, slots=True, eq=False)
class Strained:
    """Cells and TCAs at some positions of the joints.

    Attributes:
        motion: Stretch [m] and rotation vector [rad] of each cell, shape (..., 4, cells).
        length: Length of the smooth curve of each TCA, shape (..., n) [m].
        each: Its length in each crossing, shape (..., crossings) [m].
        slope: Derivatives of the length of each crossing by its cell's motion, shape
            (..., 4, crossings).
        sine: Sine of half the angles of the hinges, shape (..., 3, cells).
        cosine: Cosine of them, same shape.
        cotangent: Half of each cell's angle times the cotangent of it, shape (..., cells).
    """

    motion: Array
    length: Array
    each: Array
    slope: Array
    sine: Array
    cosine: Array
    cotangent: Array


class SmoothBody:
    """Cells of a compiled model and the TCAs that cross them.

    Attributes:
        stiffness: Of each cell against its motion, without TCAs, shape (..., 4, cells)
            [N/m, N m/rad]; zero for a motion that the chain leaves out.
        rest: Motion of each cell at rest, shape (..., 4, cells) [m, rad].
        damping: Of each cell's motion, without TCAs, shape (..., 4, cells) [N s/m, N m s/rad].
    """

    stiffness: Array
    rest: Array
    damping: Array

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
        self._last: tuple[bytes, Strained] | None = None  # asked for again at the next update
        self._tca = np.array([i for i, tca in enumerate(tcas) for _ in tca.crossings], np.int64)
        self._cell = np.array([number[tuple(c.joints.values())] for c in crossings], np.int64)
        self._read_cells(list(cells.values()))
        self._curves, self._tcas = Curves(crossings, self._cell), len(tcas)
        # Where the motions of each crossing's cell are, shape (4 crossings,).
        self._cells = (np.arange(len(MOTIONS))[:, None] * self._shape[1] + self._cell).ravel()
        self._read_tendons([model.tendon(tca.name).id for tca in tcas])
        self._read_polylines(crossings)
        self.rest = self.at(model.qpos_spring).motion.copy()

    @classmethod
    def batch(cls, bodies: Sequence["SmoothBody"]) -> "SmoothBody":
        """Bodies built alike as one, with an axis of bodies before all others.

        It computes for all of them what each computes for itself, and writes to no model.
        """
        every = copy(bodies[0])
        every._last = None
        every.gather(bodies)
        return every

    def gather(self, bodies: Sequence["SmoothBody"]) -> None:
        """Takes stiffness, rest and damping over from the bodies of the batch."""
        for name in ("stiffness", "rest", "damping"):
            setattr(self, name, np.stack([getattr(body, name) for body in bodies]))

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
        self.damping, self.stiffness = np.zeros((2, *shape))
        self._where = np.flatnonzero(joint >= 0)
        # A slice where no motion is left out: a view instead of a copy.
        self._held = slice(None) if len(self._where) == joint.size else self._where
        self._joint = joint.ravel()[self._where]
        self._qpos, self._dof = model.jnt_qposadr[self._joint], model.jnt_dofadr[self._joint]
        self.damping.flat[self._where] = model.dof_damping[self._dof]
        self.stiffness.flat[self._where] = model.jnt_stiffness[self._joint]

    def _read_tendons(self, tendons: Sequence[int]) -> None:
        """Where MuJoCo keeps the tendons' derivatives by the cells' joints, in a sparse matrix."""
        model, joint = self._model, {int(dof): i for i, dof in enumerate(self._dof)}
        entries = [
            (k, i, joint[int(model.ten_J_colind[k])])
            for i, tendon in enumerate(tendons)
            for first in [int(model.ten_J_rowadr[tendon])]
            for k in range(first, first + int(model.ten_J_rownnz[tendon]))
            if int(model.ten_J_colind[k]) in joint
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
        length, curved = self._curves.straight()
        self._twist = polyline[:, MOTIONS.index("twist")] * length
        total = np.zeros((*self._shape, self._tcas))
        bends = [MOTIONS.index("bend_x"), MOTIONS.index("bend_y")]
        for bend, more in zip(bends, curved - polyline[:, bends].T, strict=True):
            np.add.at(total[bend], (self._cell, self._tca), more)
        total = total[np.unravel_index(self._where, self._shape)]
        joint, tca = np.nonzero(total)
        self._more = joint, tca, total[joint, tca]

    @np.errstate(invalid="ignore", over="ignore")  # a diverged state has no shape
    def at(self, qpos: Array) -> Strained:
        """Cells and TCAs at the positions ``qpos`` of the model's joints.

        The hinges of a cell turn about x, y, z in this order: the product of three quaternions.
        In the reversed order they turn the reversed way if the angles are reversed.
        """
        position = qpos.take(self._qpos, axis=-1)
        key = position.tobytes()  # bits: 0 and -0 are not the same
        if self._last is not None and key == self._last[0]:
            return self._last[1]
        lead = position.shape[:-1]
        motion = np.zeros((*lead, self._shape[0] * self._shape[1]))
        motion[..., self._held] = position
        motion = motion.reshape(*lead, *self._shape)
        angles = self._half * motion[..., 1:, :]
        sine, cosine = np.sin(angles), np.cos(angles)
        (sx, sy, sz), (cx, cy, cz) = rows(sine), rows(cosine)
        ss, cc, sc, cs = sx * sy, cx * cy, sx * cy, cx * sy
        x, y, z = sc * cz + cs * sz, cs * cz - sc * sz, cc * sz + ss * cz
        real = cc * cz - ss * sz
        # Half the angle is arctan(imaginary/real), and goes on continuously beyond half a turn.
        imaginary = np.sqrt(x * x + y * y + z * z) + 1e-300
        ratio = np.arctan2(imaginary, real) / imaginary
        factor = self._twice * ratio
        for place, vector in zip(rows(motion)[1:], (x, y, z), strict=True):
            np.multiply(vector, factor, out=place)
        each, slope = self._curves.lengths(motion)
        length = summed(each, self._tca, self._tcas)
        strained = Strained(motion, length, each, slope, sine, cosine, ratio * real)
        self._last = key, strained
        return strained

    def keep(self, qpos: Array, strained: Strained) -> None:
        """What ``at`` has to return for ``qpos``, computed elsewhere."""
        self._last = qpos.take(self._qpos, axis=-1).tobytes(), strained

    def springs(
        self, strained: Strained, tension: Array, slope: Array, qpos: Array
    ) -> tuple[Array, Array]:
        """Stiffness and reference of the springs of the joints for tensions, shape (..., j) each.

        Args:
            strained: The body as it is now.
            tension: Tensions of the TCAs, shape (..., n) [N].
            slope: Derivatives of MuJoCo's tendons at ``qpos``, ``ten_J``, shape (..., nJten).
            qpos: Positions of the model's joints, shape (..., nq).
        """
        pulls = tension.take(self._tca, axis=-1)[..., None, :] * strained.slope
        lead = pulls.shape[:-2]
        load = self.stiffness * (strained.motion - self.rest)
        flat = (*lead, self._shape[0] * self._shape[1])
        pulls = summed(pulls.reshape(*lead, -1), self._cells, flat[-1])
        load += pulls.reshape(load.shape)
        self._turn_to_hinges(load, strained)
        owed = load.reshape(flat)[..., self._held]
        entry, tca, joint = self._entries
        pulled = tension.take(tca, axis=-1) * slope.take(entry, axis=-1)
        owed = owed - summed(pulled, joint, len(self._where))
        joint, tca, more = self._more
        stiffness = self.stiffness.reshape(flat)[..., self._held]
        stiffness = stiffness + summed(tension.take(tca, axis=-1) * more, joint, len(self._where))
        return stiffness, qpos.take(self._qpos, axis=-1) - owed / stiffness

    def support(self, data: mujoco.MjData, strained: Strained, tension: Array) -> None:
        """Sets the springs for tensions at the positions in ``data``.

        Args:
            data: State of the model, for whose positions ``mj_tendon`` was called.
            strained: The body at these positions.
            tension: Tensions of the TCAs, shape (n,) [N].
        """
        self.set_springs(*self.springs(strained, tension, data.ten_J, data.qpos))

    def set_springs(self, stiffness: Array, reference: Array) -> None:
        """Writes what ``springs`` computes, shape (j,) each, to the model."""
        self._model.jnt_stiffness[self._joint] = stiffness
        self._model.qpos_spring[self._qpos] = reference

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

    def damped(self, strained: Strained, tension: Array, time: float) -> Array:
        """Damping of the joints that keeps taut tendons from chattering, shape (..., j).

        MuJoCo takes the stiffness that they have by changing their direction explicitly. Damping,
        which is implicit, of that stiffness times the time step makes it stable at any tension.
        The stiffness is one against twist and grows as the tendon in a cell gets shorter. In a
        bent cell the hinge across the bend twists the cell, too, by half the angle of the bend.

        Args:
            strained: The body as it is now.
            tension: Tensions of the TCAs, shape (..., n) [N].
            time: Damping over that stiffness, at least the time step [s].
        """
        tension = tension.take(self._tca, axis=-1)
        twist = summed(time * tension * self._twist / strained.each, self._cell, self._shape[1])
        damping = self.damping.copy()
        _, bend_x, bend_y, _ = rows(strained.motion)
        _, across_y, across_x, along = rows(damping)
        across_y += 0.25 * bend_y**2 * twist
        across_x += 0.25 * bend_x**2 * twist
        along += twist
        lead = damping.shape[:-2]
        return damping.reshape(*lead, -1)[..., self._held]

    def set_damping(self, damping: Array) -> None:
        """Writes what ``damped`` computes, shape (j,), to the model."""
        self._model.dof_damping[self._dof] = damping

    def _turn_to_hinges(self, load: Array, strained: Strained) -> None:
        """Turns the moments on the rotation vectors, rows 1 to 3, to moments about the hinges."""
        tx, ty, tz = rows(self._order * strained.motion[..., 1:, :])
        row_x, row_y, row_z = rows(load)[1:]
        mx, my, mz = row_x.copy(), row_y.copy(), row_z.copy()
        # By the transposed derivative of the logarithm, m - t × m/2 + c t × (t × m).
        square = tx * tx + ty * ty + tz * tz
        cotangent = strained.cotangent
        c = (1.0 - cotangent) / np.maximum(square, 1e-9)
        along = c * (tx * mx + ty * my + tz * mz)
        m0 = cotangent * mx + along * tx - 0.5 * (ty * mz - tz * my)
        m1 = cotangent * my + along * ty - 0.5 * (tz * mx - tx * mz)
        m2 = cotangent * mz + along * tz - 0.5 * (tx * my - ty * mx)
        # The axes of the outer hinges as the inner ones have turned them.
        half = strained.sine[..., 1:, :]
        sy, sz = rows(2.0 * half * strained.cosine[..., 1:, :])
        cy, cz = rows(1.0 - 2.0 * half**2)
        np.add(cy * (cz * m0 - sz * m1), sy * m2, out=row_x)
        np.add(sz * m0, cz * m1, out=row_y)
        row_z[...] = m2

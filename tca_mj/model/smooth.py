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

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import partial
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.model.chain import MOTIONS, Chain, Motion
from tca_mj.model.curves import Curves
from tca_mj.model.sums import Form, Places, Total, rows
from tca_mj.model.tendon import Crossing, RoutedTca


class Strained(NamedTuple):
    """Cells and TCAs at some positions of the joints.

    Attributes:
        motion: Stretch [m] and rotation vector [rad] of each cell, shape (..., 4, cells).
        length: Length of the smooth curve of each TCA, shape (..., n) [m].
        each: Its length in each crossing, shape (..., crossings) [m].
        slope: Derivatives of the length of each crossing by its cell's motion, shape
            (..., 4, crossings).
        half: Sines of half the angles of the hinges, then cosines, shape (..., 6 cells).
        cotangent: Half of each cell's angle times the cotangent of it, shape (..., cells).
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
        self._curves = Curves(crossings, self._cell, self._moves())
        self._lengths, self._twists = Total(self._tca, len(tcas)), Total(self._cell, self._shape[1])
        # What tensions do by the slopes of crossings: to each joint, or to each motion of a cell.
        motions = rows(0, 1, 2, 3, width=self._shape[1], columns=self._cell)
        slope = np.flatnonzero(self._moves().ravel()[motions])
        place, size = motions[slope], 4 * self._shape[1]
        if self._planar:
            place, size = np.searchsorted(self._where, place), self._where.size
        self._pulls = Form(place, 1.0, np.tile(self._tca, 4)[slope], slope, size=size)
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
        order = np.ones(len(cells))  # -1 where the order of the joints is reversed
        for i, joints in enumerate(cells):
            for motion, name in joints.items():
                joint[MOTIONS.index(motion), i] = model.joint(name).id
            if [motion for motion in MOTIONS if motion in joints] != list(joints):
                order[i] = -1.0
        self._half, self._twice = np.tile(0.5 * order, 3), 2.0 * order
        self._shape = shape
        self._read_turns(np.tile(order, 3), partial(rows, width=len(cells)))
        self.damping, self.stiffness = np.zeros((2, *shape))
        self._where = np.flatnonzero(joint >= 0)
        self._joint = joint.ravel()[self._where]
        # Whether each cell has one hinge, about whose axis it turns; of each joint its cell, the
        # bend by a quarter of whose square it twists the cell, and whether it is the twist.
        self._planar = bool(((joint[1:] >= 0).sum(axis=0) <= 1).all())
        row, self._column = np.divmod(self._where, len(cells))
        self._across = np.array([0, 2, 1, 0])[row] * len(cells) + self._column
        self._quarter, self._along = 0.25 * ((row == 1) | (row == 2)), 1.0 * (row == 3)
        self._qpos, self._dof = model.jnt_qposadr[self._joint], model.jnt_dofadr[self._joint]
        self.damping.flat[self._where] = model.dof_damping[self._dof]
        self.stiffness.flat[self._where] = model.jnt_stiffness[self._joint]

    def _moves(self) -> NDArray[np.bool_]:
        """Motions that the cells can have, shape (4, cells): several hinges turn about any axis."""
        moves = np.zeros(self._shape, np.bool_)
        moves.flat[self._where] = True
        if not self._planar:
            moves[1:] = True
        return moves

    def _read_turns(self, order: Array, row: Callable[..., Places]) -> None:
        """The products that rotations of cells are made of.

        Args:
            order: -1 for each row of a vector of cells whose joints' order is reversed.
            row: Where rows of cells are.
        """
        size = order.size // 3
        self._thrice = row(0, 0, 0)
        self._one, self._small, self._tiny = np.full((3, size), [[1.0], [1e-9], [1e-300]])
        self._square = Total(self._thrice, size)
        # Of sines of x, y, z (rows 0 to 2) and cosines (3 to 5): those of x and y, and with z.
        self._xs, self._ys = row(0, 0, 3, 3), row(1, 4, 1, 4)
        signs = (1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0)
        factors = row(1, 2, 3, 3, 2, 1, 0, 0), row(5, 5, 2, 5, 2, 2, 5, 2)
        self._quaternion = Form(row(0, 1, 2, 3, 0, 1, 2, 3), signs, *factors, size=4 * size)
        # Of motions and loads, t and m in rows 1 to 3 and 5 to 7: t t, t m, -t × m/2.
        half = np.concatenate((np.ones(6 * size), -0.5 * order, 0.5 * order))
        factors = row(1, 2, 3, 1, 2, 3, 2, 3, 1, 3, 1, 2), row(1, 2, 3, 5, 6, 7, 7, 5, 6, 6, 7, 5)
        to = row(0, 0, 0, 1, 1, 1, 2, 3, 4, 2, 3, 4)
        self._products = Form(to, half, *factors, size=5 * size)
        # Of cosines and sines of y, z and a vector: its turn about z.
        factors = row(1, 3, 3, 1), row(0, 0, 1, 1)
        self._turned = Form(row(0, 1, 0, 1), (1.0, 1.0, -1.0, 1.0), *factors, size=2 * size)

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
        entry, tca, moved = np.array(entries, dtype=np.int64).reshape(-1, 3).T
        self._entries = Form(moved, 1.0, tca, entry, size=len(self._dof))

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
        self._twisting = bool(self._twist.any())  # whether a polyline resists twist at all
        total = np.zeros((*self._shape, self._lengths.size))
        bends = [MOTIONS.index("bend_x"), MOTIONS.index("bend_y")]
        for bend, more in zip(bends, curved - polyline[:, bends].T, strict=True):
            np.add.at(total[bend], (self._cell, self._tca), more)
        total = total[np.unravel_index(self._where, self._shape)]
        joint, tca = np.nonzero(total)
        self._more = Form(joint, total[joint, tca], tca, size=len(total))

    def at(self, qpos: Array) -> Strained:
        """Cells and TCAs at the positions ``qpos`` of the model's joints."""
        position = qpos.take(self._qpos, axis=-1)
        key = position.tobytes()  # bits: 0 and -0 are not the same
        if self._last is None or key != self._last[0]:
            self._last = key, self._strained(position)
        return self._last[1]

    @np.errstate(invalid="ignore", over="ignore")  # a diverged state has no shape
    def _strained(self, position: Array) -> Strained:
        """Cells and TCAs at positions of the cells' joints, shape (..., j).

        The hinges of a cell turn about x, y, z in this order: the product of three quaternions.
        In the reversed order they turn the reversed way if the angles are reversed.
        """
        lead, (rows, cells) = position.shape[:-1], self._shape
        flat = np.zeros((*lead, rows * cells + 1))
        flat.T[self._where], flat.T[-1] = position.T, 1.0
        motion = flat[..., :-1].reshape(*lead, rows, cells)
        if self._planar:  # each cell turns by the angle of its hinge
            each, slope = self._curves.lengths(flat)
            none = flat[..., :0]
            return Strained(motion, self._lengths.of(each), each, slope, none, none)
        turn = flat[..., cells:-1]
        angles = self._half * turn
        half = np.concatenate((np.sin(angles), np.cos(angles)), axis=-1)
        pairs = half.take(self._xs, axis=-1) * half.take(self._ys, axis=-1)
        quaternion = self._quaternion.of(pairs, half)
        vector, real = quaternion[..., : 3 * cells], quaternion[..., 3 * cells :]
        # Half the angle is arctan(imaginary/real), and goes on continuously beyond half a turn.
        imaginary = np.sqrt(self._square.of(vector * vector))
        imaginary += self._tiny
        ratio = np.arctan2(imaginary, real) / imaginary
        factor = (self._twice * ratio).take(self._thrice, axis=-1)
        np.multiply(vector, factor, out=turn)
        each, slope = self._curves.lengths(flat)
        return Strained(motion, self._lengths.of(each), each, slope, half, ratio * real)

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
        flat = (*tension.shape[:-1], -1)
        position = qpos.take(self._qpos, axis=-1)
        own = self.stiffness.reshape(flat).take(self._where, axis=-1)
        load = self._pulls.of(tension, strained.slope.reshape(flat))
        if self._planar:  # each motion is that of a joint
            load += own * (position - self.rest.reshape(flat).take(self._where, axis=-1))
        else:
            load += (self.stiffness * (strained.motion - self.rest)).reshape(flat)
            self._turn_to_hinges(load, strained)
            load = load.take(self._where, axis=-1)
        owed = load - self._entries.of(tension, slope)
        stiffness = own + self._more.of(tension)
        owed /= stiffness
        return stiffness, position - owed

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
        self._model.jnt_stiffness.put(self._joint, stiffness)
        self._model.qpos_spring.put(self._qpos, reference)

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
        own = self.damping.reshape(*tension.shape[:-1], -1).take(self._where, axis=-1)
        if not self._twisting:
            return own
        twist = (tension * time).take(self._tca, axis=-1) * self._twist / strained.each
        twist, flat = self._twists.of(twist), (*tension.shape[:-1], -1)
        across = strained.motion.reshape(flat).take(self._across, axis=-1)
        share = across * across * self._quarter + self._along
        return own + share * twist.take(self._column, axis=-1)

    def set_damping(self, damping: Array) -> None:
        """Writes what ``damped`` computes, shape (j,), to the model."""
        self._model.dof_damping.put(self._dof, damping)

    def _turn_to_hinges(self, load: Array, strained: Strained) -> None:
        """Turns the moments on the rotation vectors, rows 1 to 3, to moments about the hinges."""
        n = self._shape[1]
        motion = strained.motion.reshape(load.shape)
        both = np.concatenate((motion, load), axis=-1)
        products = self._products.of(both, both)
        # By the transposed derivative of the logarithm, m - t × m/2 + c t × (t × m).
        cotangent = strained.cotangent
        c = (self._one - cotangent) / np.maximum(products[..., :n], self._small)
        c *= products[..., n : 2 * n]
        m = cotangent.take(self._thrice, axis=-1) * load[..., n:]
        m += c.take(self._thrice, axis=-1) * motion[..., n:]
        m += products[..., 2 * n :]
        # The axes of the outer hinges as the inner ones have turned them.
        half = strained.half[..., n : 3 * n]
        twice = half + half
        cosine, sine = 1.0 - twice * half, twice * strained.half[..., 4 * n :]
        turned = self._turned.of(np.concatenate((cosine, sine), axis=-1), m)
        along, z = cosine[..., :n] * turned[..., :n], m[..., 2 * n :]
        np.add(along, sine[..., :n] * z, out=load[..., n : 2 * n])
        load[..., 2 * n : 3 * n], load[..., 3 * n :] = turned[..., n:], z

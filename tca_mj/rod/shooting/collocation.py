"""Steps along a loaded rod: frame and moment from one section to the next, with derivatives.

The state y = (h, m) is the section's orientation as a quaternion and the moment in the section,
in its own frame and in units of a given moment. The force in the section is known beforehand,
because dead loads are known: in the frame of the section n = R^T F. With the strain (u, v)
that belongs to the wrench (m, n),

    h' = h u/2        m' = m x u + n x v.

Gauss's collocation in four stages, eighth order, takes all steps at once. It keeps the length of a
quaternion, like every quadratic invariant [Hairer, Lubich & Wanner, Geometric Numerical
Integration, theorem IV.2.1].
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tca_mj.checks import Array
from tca_mj.quadrature import GaussRule
from tca_mj.rod.lie import hat, quaternion_matrix
from tca_mj.rod.sections import Sections

STAGES = 4
_RULE = GaussRule.of(STAGES)
NODES, WEIGHTS, _MATRIX = _RULE.node, _RULE.weight, _RULE.matrix


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The stages of I steps and how they depend on the state, P = I STAGES, and n tensions.

    Attributes:
        slope: y', shape (I, STAGES, 7).
        by_state: dy'/dy, shape (I, STAGES, 7, 7).
        by_tension: dy'/dF, shape (I, STAGES, 7, n).
        strain: xi, shape (P, 6).
        strain_by_state: dxi/dy, shape (P, 6, 7).
        strain_by_tension: dxi/dF, shape (P, 6, n).
        pull: dL/dF, which is also the derivative of the strands' length density by xi, (P, 6, n).
        density: Length density of all legs, shape (P, J).
    """

    slope: Array
    by_state: Array
    by_tension: Array
    strain: Array
    strain_by_state: Array
    strain_by_tension: Array
    pull: Array
    density: Array


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """I steps of collocation, anywhere on a rod.

    Attributes:
        length: Length of the steps, shape (I,) [m].
        sections: Sections at the stages, P = I STAGES.
        force: Force in these sections, world frame, shape (P, 3) [N].
        moment: Unit of the moment [N m].
        scale: Unit of the strains, shape (6,).
        shearable: Whether sections shear.
    """

    length: Array
    sections: Sections
    force: Array
    moment: float
    scale: Array
    shearable: bool

    def evaluate(
        self, stages: Array, tension: Array, share: float, guess: Array, varied: Sequence[int]
    ) -> Evaluation:
        """Slopes at given stages.

        Args:
            stages: y, shape (I, STAGES, 7).
            tension: Tensions of all strands, none as a last 0 [N].
            share: Of the force that acts.
            guess: Strain to start from, shape (P, 6).
            varied: Strands by whose tension to differentiate.

        Raises:
            RodSolveError: If no strain belongs to the wrench.
        """
        y = stages.reshape(-1, 7)
        h, m = y[:, :4], self.moment * y[:, 4:]
        n, turned = in_section(h, share * self.force)
        xi, compliance = self.sections.strain(
            np.concatenate([m, n], axis=1), tension, guess, self.scale, self.shearable
        )
        u, v = xi[:, :3], xi[:, 3:]
        spin = half_product(h)
        slope = np.empty_like(y)
        slope[:, :4] = (spin @ u[:, :, None])[:, :, 0]
        slope[:, 4:] = (cross(m, u) + cross(n, v)) / self.moment
        by_strain = np.zeros((len(y), 7, 6))
        by_strain[:, :4, :3] = spin
        by_strain[:, 4:, :3] = hat(m / self.moment)
        by_strain[:, 4:, 3:] = hat(n / self.moment)
        strain_by_state = np.empty((len(y), 6, 7))
        strain_by_state[:, :, :4] = compliance[:, :, 3:] @ turned
        strain_by_state[:, :, 4:] = self.moment * compliance[:, :, :3]
        by_state = by_strain @ strain_by_state
        by_state[:, :4, :4] += half_turn(u)
        by_state[:, 4:, :4] -= hat(v / self.moment) @ turned
        by_state[:, 4:, 4:] -= hat(u)
        density, tangent = self.sections.directions(xi)
        pull = self.sections.pull(tangent, varied)
        strain_by_tension = -compliance @ pull
        shape = (len(self.length), STAGES)
        return Evaluation(
            slope=slope.reshape(*shape, 7), by_state=by_state.reshape(*shape, 7, 7),
            by_tension=(by_strain @ strain_by_tension).reshape(*shape, 7, len(varied)), strain=xi,
            strain_by_state=strain_by_state, strain_by_tension=strain_by_tension, pull=pull,
            density=density,
        )  # fmt: skip

    def defect(self, start: Array, stages: Array, at: Evaluation) -> tuple[Array, Array]:
        """Residual of the stages, shape (I, STAGES, 7), and ends of the steps, shape (I, 7)."""
        step = self.length[:, None]
        residual = start[:, None] + step[..., None] * (_MATRIX @ at.slope) - stages
        return residual, start + step * (WEIGHTS @ at.slope)

    def condense(self, start: Array, stages: Array, at: Evaluation) -> tuple[Array, Array]:
        """Newton's method on the stages, in terms of the start of the steps.

        Returns:
            Change of the stages by a change of the start (7 columns), of the n tensions, and
            what is due in any case (1), shape (I, STAGES, 7, 8 + n), and the same for the end of
            the steps, shape (I, 7, 8 + n), with the end itself as the last column.
        """
        count, varied = len(self.length), at.by_tension.shape[-1]
        step = self.length[:, None, None]
        residual, landing = self.defect(start, stages, at)
        matrix = np.einsum("jk,ikyz->ijykz", -_MATRIX, step[..., None] * at.by_state)
        matrix = matrix.reshape(count, 7 * STAGES, 7 * STAGES)
        diagonal = np.arange(7 * STAGES)
        matrix[:, diagonal, diagonal] += 1.0
        right = np.empty((count, STAGES, 7, 8 + varied))
        right[..., :7] = np.eye(7)
        right[..., 7:-1] = np.einsum("jk,ikyn->ijyn", _MATRIX, step[..., None] * at.by_tension)
        right[..., -1] = residual
        change = np.linalg.solve(matrix, right.reshape(count, 7 * STAGES, -1))
        change = change.reshape(right.shape)
        end = step * np.einsum("j,ijyn->iyn", WEIGHTS, at.by_state @ change)
        end[..., :7] += np.eye(7)
        end[..., 7:-1] += step * np.einsum("j,ijyn->iyn", WEIGHTS, at.by_tension)
        end[..., -1] += landing
        return change, end

    def translation(self, stages: Array, strain: Array) -> Array:
        """How far each step leads, the integral of R v, world frame, shape (I, 3) [m]."""
        rotation = quaternion_matrix(stages[..., :4])
        along = np.einsum("ijab,ijb->ija", rotation, strain.reshape(*stages.shape[:2], 6)[..., 3:])
        return self.length[:, None] * (WEIGHTS @ along)


def in_section(quaternion: Array, force: Array) -> tuple[Array, Array]:
    """R^T F and its derivative by the quaternion, shapes (P, 3) and (P, 3, 4).

    In its homogeneous form, which is R^T F times the square of the quaternion's length.
    """
    h0, h = quaternion[:, :1], quaternion[:, 1:]
    along = np.einsum("pi,pi->p", h, force)[:, None]
    size = np.einsum("pi,pi->p", h, h)[:, None]
    turn = cross(h, force)
    turned = (h0 * h0 - size) * force + 2.0 * (along * h - h0 * turn)
    derivative = np.empty((len(force), 3, 4))
    derivative[:, :, 0] = 2.0 * (h0 * force - turn)
    mixed = h[:, :, None] * force[:, None, :]
    derivative[:, :, 1:] = mixed - np.swapaxes(mixed, 1, 2) + h0[:, :, None] * hat(force)
    diagonal = np.arange(3)
    derivative[:, diagonal, diagonal + 1] += along
    derivative[:, :, 1:] *= 2.0
    return turned, derivative


def half_product(quaternion: Array) -> Array:
    """Matrices of u -> h u/2, shape (P, 4) -> (P, 4, 3)."""
    matrix = np.empty((len(quaternion), 4, 3))
    matrix[:, 0] = -0.5 * quaternion[:, 1:]
    matrix[:, 1:] = 0.5 * hat(quaternion[:, 1:])
    diagonal = np.arange(3)
    matrix[:, diagonal + 1, diagonal] += 0.5 * quaternion[:, :1]
    return matrix


def half_turn(turn: Array) -> Array:
    """Matrices of h -> h u/2, shape (P, 3) -> (P, 4, 4)."""
    matrix = np.zeros((len(turn), 4, 4))
    matrix[:, 0, 1:] = -0.5 * turn
    matrix[:, 1:, 0] = 0.5 * turn
    matrix[:, 1:, 1:] = -0.5 * hat(turn)
    return matrix


def cross(left: Array, right: Array) -> Array:
    """Cross products, shape (P, 3); a few times faster than ``numpy.cross``."""
    x, y, z = left.T
    a, b, c = right.T
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=1)

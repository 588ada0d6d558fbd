"""Sections of a soft body with strands inside: which strain belongs to a wrench.

A strand runs at r = (x, y, 0) in the section's frame. Per length of the unloaded centre line it
has the length |w|, w = v + u x r + r', affine in the strain xi = (u, v): w = G xi + r'. Body and
strands together have the energy per length

    psi(xi) = (xi - xi*) K (xi - xi*)/2 + sum_a F_a |w_a|,    xi* = (u*, 0, 0, 1),

and the wrench in the section, moment then force, is its derivative: L = K (xi - xi*)
+ sum_a F_a G_a^T t_a with t = w/|w|. It is the sum of the strands and of the body around them,
so no load between the two appears in its balance. Tensions pull, so psi is strictly convex and
one strain belongs to a wrench; Newton's method finds it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import hat
from tca_mj.rod.problem import StaticProblem

_STRAIN_STEPS = 50
_CONVERGED = 1e-8  # last step of a strain, over 1/length for curvatures; it converges squarely
VANISHING = 1e-3  # length density at which a strand counts as compressed to nothing


@dataclass(frozen=True, slots=True, eq=False)
class Sections:
    """P sections, each with J legs of strands; a section with fewer has empty ones, r = 0.

    Attributes:
        stiffness: Diagonal of K: EI, EI, GJ, GA, GA, EA, shape (P, 6).
        reference: Unloaded strain xi*, shape (P, 6).
        gradient: G = dw/dxi of all legs, one below the other, shape (P, 3 J, 6).
        slope: r' of all legs, shape (P, 3 J).
        strand: To which strand each leg belongs, shape (P, J). The last one is none.
    """

    stiffness: Array
    reference: Array
    gradient: Array
    slope: Array
    strand: NDArray[np.intp]

    @classmethod
    def joined(cls, parts: "Sequence[Sections]") -> "Sections":
        """All sections of several batches with room for equally many legs."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def scaled(self, length: float, force: float) -> "Sections":
        """The same in units of a length and a force."""
        unit = np.array([length] * 3 + [1.0] * 3)
        return replace(
            self, stiffness=self.stiffness / (force * unit**2), reference=self.reference * unit,
            gradient=self.gradient / unit,
        )  # fmt: skip

    @property
    def offset(self) -> Array:
        """Where the legs run, shape (P, J, 2) [m]."""
        lever = self.gradient.reshape(*self.strand.shape, 3, 6)
        return np.stack([-lever[:, :, 2, 1], lever[:, :, 2, 0]], axis=-1)

    def directions(self, strain: Array) -> tuple[Array, Array]:
        """Length densities |w|, shape (P, J), and tangents t, shape (P, J, 3), of the legs."""
        w = ((self.gradient @ strain[:, :, None])[:, :, 0] + self.slope).reshape(
            *self.strand.shape, 3
        )
        density = np.sqrt(np.einsum("pja,pja->pj", w, w))
        return density, w / np.maximum(density, VANISHING)[:, :, None]

    def lengths(self, density: Array, weight: Array, count: int) -> Array:
        """Lengths of so many strands from those of legs per length, at sections of this weight."""
        each = weight.reshape(-1, 1) * density
        return np.bincount(self.strand.ravel(), each.ravel(), count).astype(np.float64)

    def pull(self, tangent: Array, strands: Sequence[int]) -> Array:
        """dL/dF of chosen strands: the sum of G^T t over their legs, shape (P, 6, n)."""
        mine = self.strand[:, :, None] == np.asarray(strands)
        each = tangent[..., None] * mine[:, :, None, :]
        flat = each.reshape(*self.slope.shape, len(strands))
        return np.swapaxes(self.gradient, 1, 2) @ flat

    def strain(
        self, wrench: Array, tension: Array, guess: Array, scale: Array, shearable: bool
    ) -> tuple[Array, Array]:
        """The strain under a wrench.

        Args:
            wrench: L, shape (P, 6).
            tension: Tensions of all strands, none as a last 0.
            guess: Strain to start from, shape (P, 6).
            scale: Size of the six strains, shape (6,).
            shearable: Whether v1 and v2 may differ from 0; if not, what they would feel is borne.

        Returns:
            xi, shape (P, 6), and the compliance dxi/dL, shape (P, 6, 6).

        Raises:
            RodSolveError: If it is not found, or a strand that pulls shortens to nothing.
        """
        free = np.arange(6) if shearable else np.array([0, 1, 2, 5])
        square = np.ix_(np.arange(len(wrench)), free, free)
        force = tension[self.strand]
        compliance = np.zeros((len(wrench), 6, 6))
        base = xi = guess
        step, gain, size = np.zeros_like(guess), np.zeros(len(guess)), np.inf
        for _ in range(_STRAIN_STEPS):
            density, tangent = self.directions(xi)
            drawn = (force[:, :, None] * tangent).reshape(self.slope.shape)
            rest = wrench - self.stiffness * (xi - self.reference)
            rest -= (drawn[:, None, :] @ self.gradient)[:, 0]
            # Convex: a slope that has turned round by more than half means too long a step.
            slope = np.einsum("pi,pi->p", rest, step)
            over = slope < -0.5 * gain
            if over.any():
                share = np.where(over, gain / np.where(over, gain - slope, 1.0), 1.0)
                step = step * share[:, None]
                gain = gain * share
                xi = base + step
                continue
            stiff = self.hessian(density, tangent, force)
            if not np.isfinite(stiff).all():
                break
            compliance[square] = np.linalg.inv(stiff[square])
            step = (compliance @ rest[:, :, None])[:, :, 0]
            gain = np.einsum("pi,pi->p", rest, step)
            base, xi = xi, xi + step
            size = float(np.max(np.abs(step) / scale, initial=0.0))
            if size < _CONVERGED:
                if (density[force > 0.0] < VANISHING).any():
                    break
                return xi, compliance
        raise RodSolveError("no strain found, a strand shortens to nothing", size)

    def hessian(self, density: Array, tangent: Array, force: Array) -> Array:
        """Second derivative of psi where ``directions`` are such, at these tensions of the legs."""
        gradient = self.gradient.reshape(*tangent.shape, 6)
        along = tangent[:, :, None, :] @ gradient
        across = (gradient - tangent[..., None] * along).reshape(self.gradient.shape)
        weight = np.repeat(force / np.maximum(density, VANISHING), 3, axis=1)
        stiff = np.swapaxes(across, 1, 2) @ (weight[:, :, None] * across)
        diagonal = np.arange(6)
        stiff[:, diagonal, diagonal] += self.stiffness
        return stiff


def place(problem: StaticProblem, k: int, at: ArrayLike) -> Sections:
    """Sections of one of the segments of a problem.

    Args:
        problem: All segments, and the numbers of their strands.
        k: Which of them.
        at: Where, from 0 at its base to 1 at its tip, shape (P,).
    """
    s = np.asarray(at, dtype=np.float64)
    segment = problem.segments[k]
    beam = segment.beam
    legs = max(sum(len(tuple(route.legs)) for route in each.routes) for each in problem.segments)
    lever, slope = np.zeros((len(s), legs, 3)), np.zeros((len(s), legs, 3))
    strand = np.full((len(s), legs), len(problem.tensions))
    numbered = zip(problem.strands[k], segment.routes, strict=True)
    own = [(i, leg) for i, route in numbered for leg in route.legs]
    for j, (i, leg) in enumerate(own):
        lever[:, j, :2] = leg.offset(s)
        slope[:, j, :2] = np.asarray(leg.slope(s)) / beam.length
        strand[:, j] = i
    gradient = np.empty((len(s), legs, 3, 6))
    gradient[..., :3] = -hat(lever)
    gradient[..., 3:] = np.eye(3)
    stiffness = [*beam.bending, beam.torsion, beam.shearing, beam.shearing, beam.stretching]
    return Sections(
        stiffness=np.tile(stiffness, (len(s), 1)), strand=strand,
        reference=np.tile([*beam.curvature, 0.0, 0.0, 1.0], (len(s), 1)),
        gradient=gradient.reshape(len(s), 3 * legs, 6), slope=slope.reshape(len(s), 3 * legs),
    )  # fmt: skip

"""Bodies in series under dead loads: what the balance knows before it is solved.

The force in every section follows from the loads beyond it, in the world's frame, and a rigid
piece between two bodies takes frame and moment from one to the next.
"""

import math

import numpy as np

from tca_mj.checks import Array
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import hat, matrix_quaternion, quaternion_matrix, quaternion_product
from tca_mj.rod.problem import Segment, StaticProblem
from tca_mj.rod.sections import Sections, place
from tca_mj.rod.shooting.collocation import NODES, Steps, half_turn, in_section

FINEST = 2000  # steps of the last mesh
_PER_TURN = 3  # steps of the first mesh per turn of a strand or of the unloaded body
_FEWEST = 4  # steps of the first mesh
_PROBES = np.linspace(0.0, 1.0, 129)  # where a route is looked at for its turns


class Series:
    """A problem whose segments stand on each other in a row, and the loads on its segments.

    Attributes:
        segments: The bodies.
        shearable: Whether they shear.
        reach: Length of all of them, the unit of length [m].
        moment: Unit of moments, that of the softest bending [N m].
        fixed: Given tensions of all strands, 0 where there is a law, and of none as a last 0 [N].
        laws: Laws by the numbers of their strands.
        strands: Numbers of the strands of each segment.
        turns: Quaternion of each base in the frame before.
        base: Force of all loads beyond the base of each segment, world frame [N].
        tip: The same beyond a section just below its tip.
        line_load: Weight per length of each segment [N/m].
        tip_moment: Moment on the last tip, world frame [N m].
    """

    def __init__(self, problem: StaticProblem) -> None:
        self._problem = problem
        self.segments: tuple[Segment, ...] = tuple(problem.segments)
        self.shearable = problem.shearable
        self.reach = sum(segment.beam.length for segment in self.segments)
        self.moment = min(min(segment.beam.bending) for segment in self.segments) / self.reach
        tensions = problem.tensions
        self.laws = {i: t for i, t in enumerate(tensions) if callable(t)}
        self.fixed = np.array([0.0 if callable(t) else float(t) for t in [*tensions, 0.0]])
        self.strands = problem.strands
        self.turns = [matrix_quaternion(segment.rotation) for segment in self.segments]
        gravity, load = np.asarray(problem.gravity), np.asarray(problem.tip_force)
        self.tip_moment = np.asarray(problem.tip_moment)
        self._weight = [segment.mass * gravity for segment in self.segments]
        self.line_load = [segment.beam.line_density * gravity for segment in self.segments]
        self.base, self.tip = [load] * len(self.segments), [load] * len(self.segments)
        for k in reversed(range(len(self.segments))):
            self.tip[k] = load = load + self._weight[k]
            self.base[k] = load = load + self.segments[k].beam.length * self.line_load[k]

    def first_mesh(self, finer: int) -> list[Array]:
        """Nodes of each segment, from 0 to 1, on a mesh ``finer`` times as fine as the first.

        Raises:
            RodSolveError: If the routes turn so often that it would be too fine.
        """
        steps = [max(_FEWEST, math.ceil(_PER_TURN * _turns(each))) for each in self.segments]
        if sum(steps) > FINEST:
            raise RodSolveError("the finest mesh is too coarse for the turns of routes", math.inf)
        return [np.linspace(0.0, 1.0, 1 + finer * count) for count in steps]

    def sections(self, k: int, at: Array) -> Sections:
        """Sections of segment k, ``at`` from 0 to 1."""
        return place(self._problem, k, at)

    def force(self, k: int, at: Array) -> Array:
        """Force in these sections, world frame, shape (P, 3) [N]."""
        above = self.segments[k].beam.length * (1.0 - at)[:, None]
        return self.tip[k] + above * self.line_load[k]

    def steps(self, start: list[Array], end: list[Array]) -> Steps:
        """Steps of collocation between given places of each segment, from 0 to 1."""
        sections, force, length = [], [], []
        for k, (low, high) in enumerate(zip(start, end, strict=True)):
            at = (low[:, None] + (high - low)[:, None] * NODES).ravel()
            sections.append(self.sections(k, at))
            force.append(self.force(k, at))
            length.append(self.segments[k].beam.length * (high - low))
        whole = np.concatenate(length), Sections.joined(sections), np.concatenate(force)
        scale = np.array([1.0 / self.reach] * 3 + [1.0] * 3)
        return Steps(*whole, self.moment, scale, self.shearable)

    def joint(self, k: int, node: Array, share: float) -> tuple[Array, Array]:
        """State at the base of segment k + 1 from that at the tip of segment k, and derivative."""
        turn, offset = self.turns[k + 1], self.segments[k + 1].offset
        moved, jacobian = np.empty(7), np.zeros((7, 7))
        moved[:4] = quaternion_product(node[:4], turn)
        # h -> h q is the part by q0 and twice h -> h u/2 with u the rest of q.
        jacobian[:4, :4] = 2.0 * half_turn(turn[None, 1:])[0] + turn[0] * np.eye(4)
        back = quaternion_matrix(turn).T
        own, by_frame = self._rigid(k, node, share)
        beyond, by_beyond = in_section(node[None, :4], share * self.base[k + 1][None])
        lever = hat(offset) / self.moment
        moved[4:] = back @ (node[4:] - own - lever @ beyond[0])
        jacobian[4:, :4] = -back @ (by_frame + lever @ by_beyond[0])
        jacobian[4:, 4:] = back
        return moved, jacobian

    def end(self, node: Array, share: float) -> tuple[Array, Array]:
        """Moment that the section at the last tip carries, and derivative by the frame."""
        own, by_frame = self._rigid(len(self.segments) - 1, node, share)
        applied, turned = in_section(node[None, :4], share / self.moment * self.tip_moment[None])
        return own + applied[0], by_frame + turned[0]

    def _rigid(self, k: int, node: Array, share: float) -> tuple[Array, Array]:
        """Moment about the tip of segment k of its rigid mass, in its frame and units."""
        weight, by_frame = in_section(node[None, :4], share * self._weight[k][None])
        lever = hat(self.segments[k].centre) / self.moment
        return lever @ weight[0], lever @ by_frame[0]


def _turns(segment: Segment) -> float:
    """By how many turns the legs wind round the centre line or bend, or the unloaded body does."""
    most = float(np.linalg.norm(segment.beam.curvature)) * segment.beam.length
    for route in segment.routes:
        for leg in route.legs:
            offset, slope = np.asarray(leg.offset(_PROBES)), np.asarray(leg.slope(_PROBES))
            tangent = np.hstack([slope, np.full((len(slope), 1), segment.beam.length)])
            for vector in (offset, tangent):
                size = np.linalg.norm(vector, axis=1, keepdims=True)
                unit = vector / np.maximum(size, 1e-12)
                most = max(most, float(np.sum(np.linalg.norm(np.diff(unit, axis=0), axis=1))))
    return most / (2.0 * math.pi)

"""The balance of bodies in series on one mesh: its equations, and Newton's method.

Unknown are the state y = (h, m) of ``collocation`` at the nodes and at the stages of the steps
between them, and the tensions of the strands that follow a law. Each step, and each rigid piece
between two bodies, leads where the next one starts; the first node has the frame of the clamp;
the moment at the last one is what is applied there; and each law gives its strand's tension.
Stages are eliminated step by step, the nodes form a banded system, and tensions come last.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import LinAlgError, solve_banded

from tca_mj.checks import Array
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import quaternion_exp, quaternion_product
from tca_mj.rod.problem import asked
from tca_mj.rod.shooting.collocation import NODES, STAGES, WEIGHTS, Evaluation, half_product
from tca_mj.rod.shooting.series import Series
from tca_mj.rod.solving import band_matrix

_RESIDUAL = 1e-12  # goal of Newton's method, over the largest number of the state
_NEWTON_STEPS = 25
_HALVINGS = 4  # of one Newton step, until the residual falls
_BANDS = (10, 3)  # diagonals below and above the main one
_FAR = 1e6  # numbers of the state that cannot come to any good


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Unknowns on a mesh.

    Attributes:
        nodes: y at the starts and ends of steps, shape (nodes, 7).
        stages: y at the stages, shape (steps, STAGES, 7).
        strain: Strain there, shape (steps STAGES, 6); only a first guess.
        tension: Tensions of the strands with a law, shape (n,) [N].
    """

    nodes: Array
    stages: Array
    strain: Array
    tension: Array

    def moved(self, nodes: Array, stages: Array, tension: Array) -> "State":
        """The state after a change; strands do not push."""
        return State(
            nodes=self.nodes + nodes, stages=self.stages + stages, strain=self.strain,
            tension=np.maximum(self.tension + tension, 0.0),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """The equations at a state.

    Attributes:
        at: The stages.
        landing: Where each step leads, shape (steps, 7).
        ahead: Where each link from one node to the next leads, shape (nodes - 1, 7).
        joints: Derivatives of the links that are rigid pieces, shape (joints, 7, 7).
        tip: Moment at the tip that is too much, in units, shape (3,).
        by_frame: Derivative of the moment that the tip carries by its frame, shape (3, 4).
        law: Tension that the laws ask for more, shape (n,) [N].
        slope: Slope of the laws, shape (n,) [N/m].
        size: Largest residual.
    """

    at: Evaluation
    landing: Array
    ahead: Array
    joints: Array
    tip: Array
    by_frame: Array
    law: Array
    slope: Array
    size: float


def drag(size: float, frames: Array) -> Array:
    """Moments on the nodes against turning away from given frames, so much per angle.

    Returns:
        What it adds to the moment behind each node, by the quaternion, shape (nodes, 3, 4).
    """
    return 4.0 * size * np.swapaxes(half_product(frames), 1, 2)


class Mesh:
    """The equations on one mesh.

    Attributes:
        series: The problem.
        nodes: Nodes of each segment, from 0 to 1.
        steps: The steps between them, in a row.
        total: Number of nodes.
        joints: Links that are rigid pieces: link i leads from node i to node i + 1.
        starts: Links that are steps, and so the nodes where they start.
        owner: Segment of each step.
    """

    def __init__(self, series: Series, nodes: list[Array]) -> None:
        self.series, self.nodes = series, nodes
        self.steps = series.steps([at[:-1] for at in nodes], [at[1:] for at in nodes])
        counts = np.array([len(at) for at in nodes])
        self.total = int(counts.sum())
        self.joints = np.cumsum(counts)[:-1] - 1
        self.starts = np.delete(np.arange(self.total - 1), self.joints)
        self.owner = np.repeat(np.arange(len(nodes)), counts - 1)

    def unloaded(self) -> State:
        """Without loads and tensions."""
        series = self.series
        start, nodes, stages = np.array([1.0, 0.0, 0.0, 0.0]), [], []
        for k, (segment, at) in enumerate(zip(series.segments, self.nodes, strict=True)):
            start = quaternion_product(start, series.turns[k])
            angle = segment.beam.length * np.asarray(segment.beam.curvature)
            inner = at[:-1, None] + np.diff(at)[:, None] * NODES
            nodes.append(quaternion_product(start, quaternion_exp(at[:, None] * angle)))
            stages.append(quaternion_product(start, quaternion_exp(inner[..., None] * angle)))
            start = nodes[-1][-1]
        frames, inner_frames = np.concatenate(nodes), np.concatenate(stages)
        return State(
            nodes=np.concatenate([frames, np.zeros((len(frames), 3))], axis=1),
            stages=np.concatenate([inner_frames, np.zeros((len(inner_frames), STAGES, 3))], axis=2),
            strain=self.steps.sections.reference,
            tension=np.zeros(len(series.laws)),
        )

    def newton(self, state: State, share: float, drag: Array | None = None) -> tuple[State, Look]:
        """Newton's method under a share of the loads and tensions.

        Raises:
            RodSolveError: If it does not converge.
        """
        look = self.look(state, share, drag)
        for _ in range(_NEWTON_STEPS):
            unit = self.series.moment / self.series.reach
            largest = max(1.0, float(state.tension.max(initial=0.0)) / unit,
                          float(np.abs(state.nodes).max()))  # fmt: skip
            goal = _RESIDUAL * largest
            state = replace(state, strain=look.at.strain)
            if look.size <= goal:
                return state, look
            change = self._step(state, look, drag)
            for halving in range(_HALVINGS + 1):
                trial = state.moved(*(0.5**halving * part for part in change))
                try:
                    new = self.look(trial, share, drag)
                except RodSolveError:
                    continue
                if new.size < look.size or new.size <= goal:
                    break
            else:
                break
            state, look = trial, new
        raise RodSolveError("Newton's method does not converge", look.size)

    def tensions(self, state: State, share: float) -> Array:
        """Tensions of all strands, none as a last 0 [N]."""
        tension = share * self.series.fixed
        tension[list(self.series.laws)] = state.tension
        return tension

    def lengths(self, density: Array, only: int | None = None) -> Array:
        """Lengths of all strands [m], and what belongs to none, from those of legs per length.

        Args:
            density: Those of the legs.
            only: The segment in which they are asked for; None for all.
        """
        weight = self.steps.length[:, None] * WEIGHTS
        if only is not None:
            weight = np.where((self.owner == only)[:, None], weight, 0.0)
        return self.steps.sections.lengths(density, weight, len(self.series.fixed))

    def look(self, state: State, share: float, drag: Array | None = None) -> Look:
        """The equations at a state under a share of the loads and tensions.

        Raises:
            RodSolveError: If the state runs away, or no strain belongs to it.
        """
        series = self.series
        largest = float(np.abs(state.nodes).max())
        if not max(largest, float(np.abs(state.stages).max())) < _FAR:
            raise RodSolveError("the state runs away", largest)
        at = self.steps.evaluate(
            state.stages, self.tensions(state, share), share, state.strain, list(series.laws)
        )
        residual, landing = self.steps.defect(state.nodes[self.starts], state.stages, at)
        ahead, joints = np.empty((self.total - 1, 7)), np.empty((len(self.joints), 7, 7))
        ahead[self.starts] = landing
        for k, node in enumerate(self.joints):
            ahead[node], joints[k] = series.joint(k, state.nodes[node], share)
        if drag is not None:
            ahead[:, 4:] += np.einsum("nay,ny->na", drag[1:], state.nodes[1:, :4])
        moment, by_frame = series.end(state.nodes[-1], share)
        tip = state.nodes[-1, 4:] - moment
        law, slope = np.zeros((2, len(series.laws)))
        if series.laws:
            lengths = self.lengths(at.density)
            for i, (strand, ask) in enumerate(series.laws.items()):
                law[i], slope[i] = asked(strand, ask, float(lengths[strand]))
        law = share * law - state.tension
        rest = (residual, ahead - state.nodes[1:], tip, state.nodes[0, :4] - series.turns[0],
                law * (series.reach / series.moment))  # fmt: skip
        size = max(float(np.abs(part).max(initial=0.0)) for part in rest)
        return Look(at, landing, ahead, joints, tip, by_frame, law, share * slope, size)

    def _step(self, state: State, look: Look, drag: Array | None) -> tuple[Array, Array, Array]:
        """Newton's change of nodes, stages and tensions."""
        right = np.zeros((7 * self.total, 1))
        right[:4, 0] = self.series.turns[0] - state.nodes[0, :4]
        right[4:-3, 0] = (look.ahead - state.nodes[1:]).ravel()
        right[-3:, 0] = -look.tip
        nodes, tension, condensed = self.response(state, look, drag, right, newton=True)
        start = nodes[self.starts, :, 0]
        rest = np.append(tension[:, 0], 1.0)
        factors = np.concatenate([start, np.tile(rest, (len(start), 1))], axis=1)
        stages = np.einsum("ijyn,in->ijy", condensed, factors)
        return nodes[..., 0], stages, tension[:, 0]

    def response(
        self, state: State, look: Look, drag: Array | None, right: Array, *, newton: bool = False
    ) -> tuple[Array, Array, Array]:
        """Solves the linearised equations.

        Args:
            state: Where they are linearised.
            look: The equations there.
            drag: What resists a fall, as ``drag`` gives it, if anything does.
            right: Right sides, one per column, in the order clamp, links, tip, (7 nodes, c).
            newton: Whether to add what is left of stages and laws to the first of them.

        Returns:
            Changes of the nodes, shape (nodes, 7, c), of the tensions, (n, c), and what
            ``Steps.condense`` gives for the stages.

        Raises:
            RodSolveError: If they have no solution.
        """
        at, few = look.at, len(look.law)
        condensed, end = self.steps.condense(state.nodes[self.starts], state.stages, at)
        transfer = np.empty((self.total - 1, 7, 7))
        transfer[self.starts], transfer[self.joints] = end[..., :7], look.joints
        blocks = np.zeros((self.total - 1, 7, few + 1))
        blocks[self.starts, :, :few] = end[..., 7:-1]
        blocks[self.starts, :, few] = end[..., -1] - look.landing
        links = blocks.reshape(-1, few + 1)
        both = np.zeros((len(right), few + right.shape[1]))
        both[4:-3, :few] = links[:, :few]
        both[:, few:] = right
        if newton:
            both[4:-3, few] += links[:, few]
        try:
            solved = solve_banded(_BANDS, self._banded(transfer, look.by_frame, drag), both)
        except LinAlgError:
            raise RodSolveError("the state is at a limit of the load", look.size) from None
        solved = solved.reshape(self.total, 7, -1)
        if not few:
            return solved, np.empty((0, right.shape[1])), condensed

        # F + dF = law + slope dl, with dl from the change of the nodes and the tensions themselves.
        weight = (self.steps.length[:, None] * WEIGHTS).ravel()[:, None, None]
        pull = np.swapaxes(weight * at.pull, 1, 2)
        by_state = (pull @ at.strain_by_state).reshape(-1, STAGES, few, 7)
        by_step = np.einsum("ijly,ijyn->iln", by_state, condensed)
        length = np.einsum("ily,iyn->ln", by_step[..., :7], solved[self.starts])
        length[:, :few] += by_step[..., 7:-1].sum(axis=0)
        length[:, :few] += (pull @ at.strain_by_tension).sum(axis=0)
        asked = look.slope[:, None] * length[:, few:]
        if newton:
            asked[:, 0] += look.law + look.slope * by_step[..., -1].sum(axis=0)
        matrix = np.eye(few) - look.slope[:, None] * length[:, :few]
        tension = np.linalg.solve(matrix, asked)
        return solved[..., few:] + solved[..., :few] @ tension, tension, condensed

    def _banded(self, transfer: Array, by_frame: Array, drag: Array | None) -> Array:
        """Rows in the order clamp, links -T dy_i + dy_(i+1), tip."""
        first, end = 7 * np.arange(self.total - 1)[:, None], 7 * self.total - 7
        three, four, seven = np.arange(3), np.arange(4), np.arange(7)
        block = first[:, None]
        entries: list[tuple[Any, Any, ArrayLike]] = [
            (four, four, 1.0),
            (block + 4 + seven[:, None], block + seven, -transfer),
            (first + 4 + seven, first + 7 + seven, 1.0),
            (end + 4 + three[:, None], end + four, -by_frame),
            (end + 4 + three, end + 4 + three, 1.0),
        ]
        if drag is not None:
            entries.append((block + 8 + three[:, None], block + 7 + four, -drag[1:]))
        return band_matrix(_BANDS, 7 * self.total, entries)

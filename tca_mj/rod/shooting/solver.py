"""Static shape of soft bodies in series from the balance of their sections: multiple shooting.

The total wrench of a section, strands and body together, obeys the balance of a plain rod under
the external loads alone, because strands pull between two points of the same body. These loads
are dead: so the force in every section is known beforehand, in the world's frame, and what is
sought is the moment and the frame at the start of each step, and the tensions of the strands
that follow a law (``equations``). The mesh is refined where two meshes in a row differ.

The loads and tensions grow together from zero, in one step if Newton's method goes there. Where
the state becomes unstable or ends, the body falls, against a drag, to the next stable one, and
the path goes on from there. A state that is left through a small disturbance is never returned.
"""

import math

import numpy as np

from tca_mj.checks import Array
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import quaternion_exp, quaternion_matrix, quaternion_product
from tca_mj.rod.problem import StaticProblem
from tca_mj.rod.shape import RodShape
from tca_mj.rod.shooting.collocation import STAGES, half_product, in_section
from tca_mj.rod.shooting.equations import Look, Mesh, State, drag
from tca_mj.rod.shooting.refinement import differences, refined, sample
from tca_mj.rod.shooting.series import FINEST, Series
from tca_mj.rod.solving import load_up, nudge, with_finer_meshes

_Found = tuple[State, Look]

_SHORTEST = 2.0**-6  # step along the path of loads before the body is let fall
_FALLS = 200
_LONGEST_FALL = 0.5  # turn in one of them [rad]
_AT_REST = 1e-3  # turn in a fall that counts as none [rad]
_STIFFEST = 1e6  # drag at which a fall is given up
_FLAT = 1e-6  # share of the smallest compliance that rounding errors may reach
_NEAR = 1e-4  # residual at which it may be a neutral mode that keeps Newton's method from its goal
_HOLD = 1e-5  # drag that holds it, in units of moment per turn
_SOFT = 1e5  # compliance of a mode that counts as neutral, in turn per unit of moment
_SPREAD = 0.01  # steps are halved that change by more than this share of the largest change
_CHANGE = 2e-8  # allowed change by the last refinement; 1/256 of it is left


def solve(problem: StaticProblem, points: int) -> tuple[RodShape, ...]:
    """Shapes of the segments, each at so many points at equal distances.

    Raises:
        ValueError: If a law has no answer for the unloaded body or one that cannot be.
        RodSolveError: If neither Newton's method nor a fall finds a stable state, the strands
            compress a body to nothing, or the finest mesh is too coarse.
    """
    series = Series(problem)
    rest = Mesh(series, series.first_mesh(2))
    lengths = rest.lengths(rest.steps.sections.directions(rest.steps.sections.reference)[0])
    for strand, law in series.laws.items():
        law(float(lengths[strand]))  # the law itself says what it does not like
    return tuple(_shapes(*_converged(series), points))


def _converged(series: Series) -> tuple[Mesh, State, Look]:
    """The state under the whole load, on a mesh that is fine enough."""

    def start(finer: int) -> tuple[Mesh, _Found]:
        mesh = Mesh(series, series.first_mesh(finer))
        return mesh, _follow(mesh)

    mesh, (state, look) = with_finer_meshes(start)
    marked, previous = np.ones(len(mesh.starts), dtype=bool), math.inf
    while True:
        finer, guess, parent, first = refined(mesh, state, marked)
        found = _solved(finer, guess, 1.0)
        change, local = differences(mesh, (state, look), finer, found, parent, first)
        # A kink in a route is halved and halved: there one small change may be an accident.
        slow = previous < 16.0 * change
        if change <= _CHANGE and not (slow and previous > 2.0 * _CHANGE):
            return finer, *found
        previous = change
        again = local > _SPREAD * float(local.max())
        if not again.any():  # what is not a number is never larger
            raise RodSolveError("the mesh finds no end", change)
        mesh, (state, look), marked = finer, found, again[parent]
        if len(marked) + int(marked.sum()) > FINEST:
            raise RodSolveError("the finest mesh is too coarse", change)


def _follow(mesh: Mesh) -> _Found:
    """The state under the whole loads and tensions, from the unloaded one.

    Raises:
        RodSolveError: If neither Newton's method nor a fall finds one on the way.
    """

    def solve(now: _Found, last: _Found, ratio: float, at: float) -> _Found:
        state, before = now[0], last[0]
        guess = state.moved(
            ratio * (state.nodes - before.nodes),
            ratio * (state.stages - before.stages),
            ratio * (state.tension - before.tension),
        )
        found, look = _solved(mesh, guess, at)
        if not _stable(mesh, found, look):
            raise RodSolveError("the state is not stable", look.size)
        return found, look

    def fall(now: _Found, at: float, left: float) -> tuple[float, _Found]:
        step = min(_SHORTEST, left)
        return step, _fallen(mesh, now[0], at + step)

    rest = mesh.unloaded()
    return load_up((rest, mesh.look(rest, 0.0)), solve, fall, _SHORTEST)


def _solved(mesh: Mesh, guess: State, share: float) -> _Found:
    """Newton's method, also for a body that turns freely and needs a light drag to stay.

    Raises:
        RodSolveError: If it does not converge.
    """
    try:
        return mesh.newton(guess, share)
    except RodSolveError as error:
        if error.residual > _NEAR:
            raise
    held, _ = mesh.newton(guess, share, drag(_HOLD, guess.nodes[:, :4]))
    return mesh.newton(held, share, drag(_HOLD, held.nodes[:, :4]))


def _stable(mesh: Mesh, state: State, look: Look, held: Array | None = None) -> bool:
    """Whether the body returns to a solved state when it is turned a little.

    Moments on the nodes turn them by a symmetric matrix, the inverse of the second derivative
    of the energy by these turns, with the laws of strands in it. A moment fixed in the world
    has no energy and makes it unsymmetric; then the question is whether a real mode has passed
    through no stiffness, and flutter is not asked for.
    """
    free = mesh.starts  # links to nodes that turn, each once
    rows = (7 * free[:, None] + np.array([8, 9, 10])).ravel()  # their equations for the moment
    right = np.zeros((7 * mesh.total, len(rows)))
    right[rows, np.arange(len(rows))] = -1.0
    moved, _, _ = mesh.response(state, look, held, right)
    frames = half_product(state.nodes[free + 1, :4])
    turned = 4.0 * np.swapaxes(frames, 1, 2) @ moved[free + 1, :4]
    turned = turned.reshape(len(rows), len(rows))
    if mesh.series.tip_moment.any():
        values = np.linalg.eigvals(turned)
        values = values.real[np.abs(values.imag) <= _FLAT * np.abs(values.real)]
    else:
        values = np.linalg.eigvalsh(0.5 * (turned + turned.T))
    # Very soft modes are neutral: a round rod that has buckled turns freely about its axis.
    unstable = (values < -_FLAT * float(np.abs(values).min(initial=math.inf))) & (values > -_SOFT)
    return not unstable.any()


def _fallen(mesh: Mesh, state: State, share: float) -> _Found:
    """The stable state to which the body falls from a given one.

    It falls against a drag that turns with it: each part of the fall is a step of Euler's backward
    method, and in it the body comes to rest near where it was.

    Raises:
        RodSolveError: If it does not come to rest.
    """
    frames = _nudged(state.nodes[:, :4], 0)
    strength, size = 100.0 / mesh.total, math.inf
    for attempt in range(1, _FALLS):
        resisting = drag(strength, frames)
        try:
            found, look = mesh.newton(state, share, resisting)
            turn = np.einsum("nqa,nq->na", half_product(frames), found.nodes[:, :4])
            size = 4.0 * float(np.abs(turn).max())
            if size > _LONGEST_FALL or not _stable(mesh, found, look, resisting):
                raise RodSolveError("the fall is too long", size)
        except RodSolveError:
            if strength > _STIFFEST:
                raise
            strength *= 4.0
            continue
        state, frames = found, found.nodes[:, :4]
        if size < _AT_REST:
            found, look = _solved(mesh, state, share)
            if _stable(mesh, found, look):
                return found, look
            frames = _nudged(frames, attempt)
        strength *= 0.4
    raise RodSolveError("the body does not come to rest", size)


def _nudged(frames: Array, way: int) -> Array:
    """Frames turned a little, each time in another way, so that a body leaves an unstable state."""
    turn = nudge(len(frames)) * np.cos(way * np.array([1.0, 2.0, 3.0]))
    return quaternion_product(frames, quaternion_exp(turn))


def _shapes(mesh: Mesh, state: State, look: Look, points: int) -> list[RodShape]:
    series, count = mesh.series, len(mesh.nodes)
    tension = mesh.tensions(state, 1.0)
    at = np.linspace(0.0, 1.0, points)
    # One short step of collocation leads from a node to each point: the polynomials of the steps
    # know the stages to fifth order, and one step of Newton's method squares what is left.
    within = [np.searchsorted(nodes[1:-1], at, side="right") for nodes in mesh.nodes]
    steps = series.steps([mesh.nodes[k][within[k]] for k in range(count)], [at] * count)
    parent = np.concatenate([np.flatnonzero(mesh.owner == k)[within[k]] for k in range(count)])
    share = steps.length / mesh.steps.length[parent]
    start, stages, strain = sample(mesh, state, parent, np.zeros(len(parent)), share)
    there = steps.evaluate(stages, tension, 1.0, strain, [])
    change, end = (part[..., -1] for part in steps.condense(start, stages, there))
    bent = there.strain + np.einsum("pxy,py->px", there.strain_by_state, change.reshape(-1, 7))
    walked = steps.translation(stages + change, bent)
    between = mesh.steps.translation(state.stages, look.at.strain)

    shapes = []
    base, frame, rotation = np.zeros(3), np.eye(3), quaternion_matrix(end[:, :4])
    for k, segment in enumerate(series.segments):
        mine = slice(k * points, (k + 1) * points)
        base = base + frame @ np.asarray(segment.offset)
        nodes = np.vstack([np.zeros(3), np.cumsum(between[mesh.owner == k], axis=0)])
        force, _ = in_section(end[mine, :4], series.force(k, at))
        wrench = np.concatenate([series.moment * end[mine, 4:], force], axis=1)
        strain, _ = series.sections(k, at).strain(
            wrench, tension, bent.reshape(-1, STAGES, 6)[mine, -1], steps.scale, series.shearable
        )
        hold = 0.0 - series.base[k]
        moment = 0.0 - series.moment * rotation[mine][0] @ end[mine][0, 4:]
        shape = RodShape(
            position=base + nodes[within[k]] + walked[mine], rotation=rotation[mine],
            arc_length=segment.beam.length * at, strain=strain, base_force=hold,
            tca_length=mesh.lengths(look.at.density, k)[list(series.strands[k])],
            base_moment=moment + np.cross(base, hold),
        )  # fmt: skip
        shapes.append(shape)
        base, frame = shape.position[-1], rotation[mine][-1]
    return shapes

"""Static shape of soft bodies with TCAs as the minimum of their energy over all configurations.

Unknown are the strains of the centre lines (``tca_mj.rod.energy.potential``); the frames follow. So
there are no conditions at the ends to meet, modules in series are rods behind each other, and the
pull of a strand is no load on the body but a part of its energy. Newton's method with the exact
Hessian goes down to a minimum: a stable shape. The loads grow together from zero, in steps in
which the rod turns by two radians at most, so that of several stable shapes it is the one that
the body is led to; where that one loses its stability, the energy falls to the next one.

A moment on the tip that is fixed in the world has no energy (it works on one way and not on
another one). With it the shape is one where the virtual work of all loads is zero, on the path of
the loads before a real mode has lost its stiffness; flutter is not asked for.
"""

from typing import cast

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.linalg.lapack import dgetrf, dgetrs

from tca_mj.checks import Array
from tca_mj.rod.energy.mesh import Mesh
from tca_mj.rod.energy.potential import Potential, State
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.problem import Segment, StaticProblem
from tca_mj.rod.sections import VANISHING
from tca_mj.rod.shape import RodShape
from tca_mj.rod.solving import load_up

# Lengths of a change of strain are turns or stretches of the whole rod.
_SETTLED = 1e-9  # last step of Newton's method, which is quadratic
_NOISE = 1e-12  # what is left where a mode has no stiffness and the step no meaning
_NEUTRAL = 1e-8  # stiffness, over the body's, of a mode that has none: a rod turning in its buckle
_NEAR = 1e-3  # the same on the path, before the whole load acts
_REACH = 2.0  # largest step
_ESCAPE = 0.1  # step away from a saddle
_QUICK, _PATIENT = 10, 200  # steps of Newton's method where it goes straight, and where not
_HALVINGS = 30
_SMALLEST = 1 / 64  # step of the load
_SHIFTS = 60  # of the Hessian, until they are 1e32 of the body's stiffness
_COLLAPSE = 0.05  # |w| of a strand, to which a failure is put down


def minimise(problem: StaticProblem, points: int = 65) -> tuple[RodShape, ...]:
    """Static shapes of soft bodies in series, by minimisation of their energy.

    Args:
        problem: Bodies, strands and loads.
        points: Points of each shape, from base to tip.

    Returns:
        One shape for each segment, positions and frames in the world. ``base_force`` and
        ``base_moment`` hold all that lies beyond the segment's base, the moment about the world's
        origin.

    Raises:
        RodSolveError: If no minimum is found, a strand shortens to nothing, or the strains are
            not smooth.
    """
    potential = Potential(problem, Mesh.of(cast(tuple[Segment, ...], problem.segments)))
    state = _followed(potential)
    while (rough := potential.rough(state.strain)).any():
        finer = potential.mesh.halved(rough)
        strain = potential.mesh.carried(state.strain, finer)
        potential = Potential(problem, finer)
        state = _rest(potential, strain, 1.0, patient=True)
    return potential.shapes(state, points)


def _followed(potential: Potential) -> State:
    """The rod at rest under the whole load, led there from the unloaded one.

    Raises:
        RodSolveError: If a part of the load finds no rest.
    """

    def solve(state: State, _: State, __: float, at: float) -> State:
        return _rest(potential, state.strain, at, patient=False)

    def fall(state: State, at: float, left: float) -> tuple[float, State]:
        step = min(_SMALLEST, left)
        return step, _rest(potential, state.strain, at + step, patient=True)

    return load_up(potential.at(potential.start, 0.0), solve, fall, _SMALLEST)


def _rest(potential: Potential, strain: Array, factor: float, *, patient: bool) -> State:
    """The rod at rest under a part of the load, by Newton's method.

    Args:
        potential: The energy.
        strain: First guess.
        factor: Part of the load.
        patient: Whether to go on where the method does not go straight to a minimum nearby: over
            any distance, with the energy falling, and away from saddles.

    Raises:
        RodSolveError: If it does not settle.
    """
    settled = _SETTLED if factor == 1.0 else _NEAR
    state = potential.at(strain, factor)
    for _ in range(_PATIENT if patient else _QUICK):
        step, stable = _newton_step(potential, state)
        size = potential.distance(step)
        if not (np.isfinite(size) and (patient or stable and size <= _REACH)):
            break
        if size < settled or _left(potential, state) < _NOISE:
            if stable:
                if size < settled:
                    state = potential.at(state.strain + step, factor)
                if state.shortest < VANISHING:
                    break
                return state
            step, size = _escape(potential, state), _ESCAPE
        new = _descended(potential, state, step * min(1.0, _REACH / size))
        if new is None:
            break
        state = new
    left = _left(potential, state)
    if state.shortest < _COLLAPSE:
        raise RodSolveError("a strand shortens to nothing somewhere", left)
    raise RodSolveError("the energy does not settle", left)


def _left(potential: Potential, state: State) -> float:
    """The gradient of the energy as the strain that it would cause in the body alone."""
    return potential.distance(potential.gradient(state) / potential.metric)


def _newton_step(potential: Potential, state: State) -> tuple[Array, bool]:
    """Newton's step, and whether the shape is stable here; if not, another step down."""
    hessian, twist = potential.hessian(state)
    gradient, body = potential.gradient(state).ravel(), potential.metric.ravel()
    shift = 0.0  # of the whole matrix, in units of the body's stiffness
    for _ in range(_SHIFTS):
        shifted = hessian + np.diag(shift * body)
        if potential.conservative:
            step = _solved_convex(shifted, -gradient)
        else:
            step = _solved_upright(shifted + twist, -gradient)
        if step is not None:
            return step.reshape(state.strain.shape), shift <= _NEUTRAL
        shift = max(4.0 * shift, 0.01) if shift else _NEUTRAL
    raise RodSolveError("no stiffness makes the energy convex", _left(potential, state))


def _solved_convex(matrix: Array, right: Array) -> Array | None:
    """Solution with a symmetric matrix; None unless it is positive definite."""
    try:
        solution: Array = cho_solve(cho_factor(matrix), right)
    except LinAlgError:
        return None
    return solution


def _solved_upright(matrix: Array, right: Array) -> Array | None:
    """Solution with any matrix; None unless its determinant is positive.

    On a path of loads the determinant changes its sign where a real mode loses its stiffness.
    """
    factors, pivots, _ = dgetrf(matrix)
    swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
    if np.prod(np.sign(np.diag(factors))) * (-1) ** swaps <= 0.0:
        return None
    return dgetrs(factors, pivots, right)[0]


def _escape(potential: Potential, state: State) -> Array:
    """A step away from a saddle along the mode of least stiffness."""
    hessian, _ = potential.hessian(state)
    scale = 1.0 / np.sqrt(potential.metric.ravel())
    mode = eigh(scale[:, None] * hessian * scale, subset_by_index=[0, 0])[1][:, 0] * scale
    mode *= np.sign(mode[np.argmax(np.abs(mode))])
    step: Array = mode.reshape(state.strain.shape)
    return _ESCAPE / potential.distance(step) * step


def _descended(potential: Potential, state: State, step: Array) -> State | None:
    """The state after as much of a step as lets the energy fall; None if nothing does."""
    noise = 1e-12 * (1.0 + state.elastic + abs(state.work) + state.tension @ state.length)
    for halving in range(_HALVINGS):
        new = potential.at(state.strain + 0.5**halving * step, state.factor)
        if not potential.conservative or potential.change(state, new) < noise:
            return new
    return None

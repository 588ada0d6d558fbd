"""A whole course of a loaded TCA at once: all steps of ``LoadedTcas.step`` as one banded system.

One TCA at a time costs NumPy some 0.1 ms per step, whatever the step. Where the heating is held,
the steps are equations of all lengths together, and Newton's method solves a window of them with
a banded matrix in a few iterations.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from scipy.linalg import solve_banded

from tca_mj.checks import Array, Positive, door
from tca_mj.rod.solving import band_matrix
from tca_mj.tca.dynamics.loads import Course, Heating, LoadState
from tca_mj.tca.dynamics.stepping import LoadedTcas, Steps

_NAMES = tuple(field.name for field in fields(LoadState))
_WINDOW = 1000  # steps that ``solve`` takes at once
_SHORT = 8  # steps below which it takes them one by one
_COURSE_STEPS = 20
_COURSE_ACCEPTED = 1e-10  # last correction of its lengths [m]
_WARMED = 1e-8  # last correction of its temperatures [K]


@door
def solve_course(
    tcas: LoadedTcas, state: LoadState, heating: Heating, dt: Positive, steps: Steps
) -> Course:
    """Dynamic motion as ``LoadedTcas.simulate``, all steps at once: for few TCAs much faster.

    The equations are those of ``step``, and the lengths those of ``simulate`` to 1e-10 m. They
    are solved together by Newton's method, whose linear systems are banded; where it does
    not converge the course is cut in halves, down to single steps.

    Args:
        tcas: The TCAs and their loads.
        state: State at time 0, shape (..., n).
        heating: Held throughout; ``value`` and ``air`` broadcast with (..., n).
        dt: Length of a step, above 0 [s].
        steps: Number of steps, 0 to 500 000.

    Returns:
        ``steps + 1`` states.

    Raises:
        ValueError: As ``step``.
        MotionSolveError: As ``step``.
    """
    parts: list[LoadState] = [tcas.simulate(state, heating, dt, 0)]
    done = 0
    window = _WINDOW
    while done < steps:
        size = min(window, steps - done)
        try:
            part = _window(tcas, state, heating, dt, size) if size > _SHORT else None
        except ValueError:  # a trial left what the law accepts; a step will if it really does
            part = None
        if part is None and size > _SHORT:
            window = size // 2
            continue
        if part is None:
            part = tcas.simulate(state, heating, dt, size)
        state = LoadState(*[getattr(part, name)[-1] for name in _NAMES])
        parts.append(LoadState(*[getattr(part, name)[1:] for name in _NAMES]))
        done += size
        window = _WINDOW
    whole = [np.concatenate([getattr(part, name) for part in parts]) for name in _NAMES]
    return Course.of(LoadState(*whole), dt)


def _window(
    tcas: LoadedTcas, state: LoadState, heating: Heating, dt: float, steps: int
) -> LoadState | None:
    """The same for a few hundred steps; None if Newton's method does not converge."""
    load, heat = tcas.load, tcas.heat
    shape = (steps, *state.length.shape)
    first = (state.length, state.velocity, state.temperature)
    length, velocity, temperature = (
        np.concatenate([start[None], np.broadcast_to(start, shape)]) for start in first
    )
    velocity[1:] = 0.0
    mass, damping = np.asarray(load.mass) / dt, 0.5 * np.asarray(load.damping)
    loss = np.broadcast_to(heat.loss * heating.air, shape[1:])
    half = -np.expm1((-0.5 * dt) * loss / heat.capacity)
    full = half * (2.0 - half)
    cooling = np.stack([np.ones(shape), np.broadcast_to(full - 1.0, shape)])
    for _ in range(_COURSE_STEPS):
        held = LoadState(*(a[:-1] for a in (length, velocity, temperature, temperature)))
        guess = held.length + 0.5 * dt * held.velocity
        power, _, _ = tcas.heated(held, heating, dt, guess)
        # Temperatures: T_i + (full - 1) T_(i-1) = full (T_amb + P_i/loss).
        source = full * (heat.ambient + power / loss)
        source[0] -= cooling[1, 0] * temperature[0]
        hot = _chained(cooling, source[None])[0]
        warmed = np.abs(hot - temperature[1:]).max()
        temperature[1:] = hot
        middle = temperature[:-1] + half * (heat.ambient + power / loss - temperature[:-1])
        points = 0.5 * (length[1:] + length[:-1])
        tension, slope = tcas.pull(points, middle, True)
        slope = 0.5 * (slope + load.stiffness)
        rate = 0.5 * (velocity[1:] + velocity[:-1])
        force = load.force + load.stiffness * (load.reference - points) - tension
        gap = np.stack([
            dt * rate - (length[1:] - length[:-1]),
            force - mass * (velocity[1:] - velocity[:-1]) - 2.0 * damping * rate,
        ])  # fmt: skip
        ones = np.ones(shape)
        correction = _chained(
            np.stack([
                np.stack([ones, slope]), np.stack([-0.5 * dt * ones, (mass + damping) * ones]),
                np.stack([-ones, slope]), np.stack([-0.5 * dt * ones, (damping - mass) * ones]),
            ]), gap)  # fmt: skip
        moved = float(np.abs(correction[0]).max())
        if not moved < 10.0:
            return None
        length[1:] += correction[0]
        velocity[1:] += correction[1]
        if moved <= _COURSE_ACCEPTED and warmed <= _WARMED:
            tcas.check_domain(length[1:])
            return LoadState(length, velocity, temperature, np.concatenate([power[:1], power]))
    return None


def _chained(matrix: Array, right: Array) -> Array:
    """Solves chains of k equal blocks, each coupled with the one before.

    Args:
        matrix: For one unknown per block shape (2, k, ...): its factor and that of the one before.
            For two unknowns shape (4, 2, k, ...): factors of the block's first and second
            unknown, then of those of the block before; the second axis is the equation.
        right: Right-hand sides, shape (unknowns, k, ...).

    Returns:
        Unknowns, shape of ``right``.
    """
    unknowns, k = right.shape[:2]
    # Chains one after another: (unknowns, k, ...) -> (chains, k, unknowns).
    side = np.moveaxis(right.reshape(unknowns, k, -1), (0, 1, 2), (2, 1, 0))
    factor = matrix.reshape(2, unknowns, unknowns, k, -1).swapaxes(3, 4).copy()
    factor[1, ..., 0] = 0.0  # nothing before the first block
    factor = factor.reshape(2, unknowns, unknowns, -1)
    first, bands = np.arange(0, side.size, unknowns), (2 * unknowns - 1, unknowns - 1)
    entries = (
        (first[late:] + row, first[: first.size - late] + column, factor[late, column, row, late:])
        for late, column, row in np.ndindex(2, unknowns, unknowns)
    )
    band = band_matrix(bands, side.size, entries)
    solution = solve_banded(bands, band, side.ravel(), overwrite_ab=True, check_finite=False)
    solved = np.moveaxis(solution.reshape(side.shape), (2, 1, 0), (0, 1, 2))
    return np.ascontiguousarray(solved).reshape(right.shape)

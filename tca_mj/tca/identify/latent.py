"""Residuals of measurements whose givens, temperatures and lengths, have errors as well.

Every row has true givens u that nobody knows. They are found row by row: those at which

    (x - u)^T S^-1 (x - u) + (y - f(u))^T N^-1 (y - f(u))

is least, with x and y what was measured, S and N the variances of their errors and f the model,
which is taken as a parabola about x, from its values one standard deviation to both sides. At the
least u, with f' its slopes there, that sum is r^T V^-1 r of

    r = y - f(u) - f' (x - u),      V = N + f' S f'^T,

so that the constants are fitted together with all true temperatures and lengths. V moves with the
constants: without that slopes would come out too small. Where f bends, r is not 0 in the mean:
the u that were found still have the variance P = (S^-1 + f'^T N^-1 f')^-1, and

    <r> = -1/2 sum of f''_ab P_ab

to second order, which is put right. What is left is of fourth order in the errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca.identify.data import Data
from tca_mj.tca.identify.predict import Muscle, given_with_error, outcomes, predict
from tca_mj.tca.laws.coil import Spin

_ROUNDS = 3  # of Gauss and Newton's steps to the true givens
_FARTHEST = 3.0  # standard deviations that they may be away: further out no parabola is trusted


def weighed(
    data: Data, muscle: Muscle, ends: Spin, noise: Mapping[str, float], zero: float = 0.0
) -> tuple[Array, Array, Array]:
    """Predictions (k, c) at what was given, residuals over their errors (k, c), and the errors of
    outcomes about the predictions (k, c).

    The residuals of a row are made independent by the factor of their variance.
    """
    names = [name for name in given_with_error(data) if noise[name] > 0.0]
    found = outcomes(data)
    measured = np.stack([data.columns[name] for name in found], axis=-1)
    own = np.square([noise[name] for name in found])
    model, slope, bend = _parabola(data, muscle, ends, zero, {n: noise[n] for n in names})
    # From here on givens count in their standard deviations: S is the unit matrix.
    off = np.zeros((data.rows, len(names)))  # u - x
    for _ in range(_ROUNDS if names else 1):
        steep = slope + np.einsum("kcab,kb->kca", bend, off)
        apart = measured - model - np.einsum("kca,ka->kc", slope, off)
        apart -= 0.5 * np.einsum("kcab,ka,kb->kc", bend, off, off)
        apart += np.einsum("kca,ka->kc", steep, off)
        variance = np.einsum("kca,kda->kcd", steep, steep) + np.diag(own)
        gain = np.linalg.solve(variance, steep)
        off = np.clip(np.einsum("kca,kc->ka", gain, apart), -_FARTHEST, _FARTHEST)
    left = np.eye(len(names)) - np.einsum("kca,kcb->kab", steep, gain)  # P
    apart += 0.5 * np.einsum("kcab,kab->kc", bend, left)
    factor = np.linalg.cholesky(variance)
    residual = np.asarray(np.linalg.solve(factor, apart[..., None])[..., 0], dtype=np.float64)
    return model, residual, np.sqrt(np.diagonal(variance, axis1=1, axis2=2))


def _parabola(
    data: Data, muscle: Muscle, ends: Spin, zero: float, noise: Mapping[str, float]
) -> tuple[Array, Array, Array]:
    """The model about the givens: (k, c), slopes (k, c, m) and second derivatives (k, c, m, m) per
    standard deviation of what has errors, of which there are m."""
    many = len(noise)
    units = np.eye(many)
    pairs = [(a, b) for a in range(many) for b in range(a)]
    moves = [np.zeros(many), *units, *-units, *(units[a] + units[b] for a, b in pairs)]

    def at(move: Array) -> dict[str, Array]:
        far = dict(zip(noise, move.tolist(), strict=True))
        return {name: each + far[name] * noise[name] if name in far else each
                for name, each in data.columns.items()}  # fmt: skip

    if data.stepped:  # each is a course of its own
        values = [predict(replace(data, columns=at(move)), muscle, ends, zero) for move in moves]
    else:  # the set, and below it once again for each move
        every = [at(move) for move in moves]
        columns = {name: np.concatenate([each[name] for each in every]) for name in data.columns}
        found = predict(replace(data, columns=columns), muscle, ends, zero)
        values = np.split(found, len(moves))
    model, up, down = values[0], values[1 : 1 + many], values[1 + many : 1 + 2 * many]
    slope = np.zeros((*model.shape, many))
    bend = np.zeros((*model.shape, many, many))
    for a in range(many):
        slope[..., a] = 0.5 * (up[a] - down[a])
        bend[..., a, a] = up[a] + down[a] - 2.0 * model
    for (a, b), both in zip(pairs, values[1 + 2 * many :], strict=True):
        crossed = both - up[a] - up[b] + model  # of third order where a differs from b
        bend[..., a, b] = bend[..., b, a] = crossed
    return model, slope, bend

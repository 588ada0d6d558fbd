"""Constants of a TCA by least squares over several sets of measurements, with their errors.

What is minimised is the sum of squared residuals over their errors (``latent.weighed``), each set
with a factor on the stated errors that its own residuals give, plus what is known of each constant
beforehand, ``Constant.width``. The latter is so little that it moves no constant that the data
identify, and makes the covariance of all of them, the unidentified too, a finite one: a constant is
called identified if the data leave less than a fifth of that width. So one that is only known
together with others gets their error, and none becomes exact because another was held.

Residuals that follow one another smoothly, as those of a wrong model do, count as fewer: where
their correlation from one to the next is beyond chance, the errors grow by ((1 + r)/(1 - r))^(1/2).
The intervals are profiles of the likelihood: as far out as the sum of squares, least over all other
constants, grows by the square of Student's quantile.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as student

from tca_mj.checks import Array
from tca_mj.tca.identify.constants import (
    CONSTANTS,
    LINEAR,
    MECHANICAL,
    constants_of,
    decoded,
    encoded,
    known_of,
    with_constants,
)
from tca_mj.tca.identify.data import Data
from tca_mj.tca.identify.latent import weighed
from tca_mj.tca.identify.predict import (
    Law,
    Muscle,
    affects,
    has_zero,
    noise_of,
    outcomes,
)
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.laws.statics import hanging_length
from tca_mj.tca.spec import TcaSpec

CLEAR = 10.0  # difference of Akaike's criterion, or of squares, that is no chance any more
SHARE = 0.2  # of the width beforehand that the data may leave of a constant they identify
_STEP = 1e-5  # of differences, over the width
_ROUNDS = 3  # of fits after a rough one, each with the factors that the last one gave
_CHANGE = 0.02  # of the factors, below which there is no other
_IMPOSSIBLE = 1e6  # residual where the laws have no answer
_PROFILED, _NEAR = 30, 0.02  # steps of a profile at most; how near to its end it is to come [1]
_FAR = 25.0  # rise of a profile, over that of its end, from which on a step was too long
_CONTACT = ("minimum_length", "linear_shortest")
_APART, _LOWER = 0.9, 10  # of the shortest length: there no coils touch; times that it is lowered
_FEW = 20  # rows of a set, below which nothing is said of their order
# Factors on moduli and growths at which a fit may start.
_STARTS = ((1.0, 1.0), (2.0, 1.0), (0.5, 1.0), (4.0, 1.0), (8.0, 1.0), (1.0, 2.0), (1.0, 0.5),
           (2.0, 2.0))  # fmt: skip


class Known(NamedTuple):
    """What is known of a number beforehand: its code, where the fit starts, and its error."""

    name: str
    start: float
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What is to be fitted.

    Attributes:
        data: The measurements.
        tca: The TCA as far as it is known.
        law: By which law.
        ends: Whether an end may spin, of each set.
        known: The numbers to be fitted: constants, then the zeros of sets, ``zero of NAME``.
        noise: Errors of each set, by quantity.
    """

    data: tuple[Data, ...]
    tca: TcaSpec
    law: Law
    ends: tuple[Spin, ...]
    known: tuple[Known, ...]
    noise: tuple[Mapping[str, float], ...]

    @classmethod
    def of(
        cls, data: Sequence[Data], tca: TcaSpec, law: Law, ends: Sequence[Spin],
        free: Sequence[str], errors: Mapping[str, float], noise: Mapping[str, float],
    ) -> Problem:  # fmt: skip
        """Gathers it; ``free`` and ``errors`` as in ``identify``."""
        value = constants_of(tca)
        names = [n for n in (*free, *errors) if any(affects(n, each) for each in data)]
        if law == "linear":
            names = [n for n in names if n not in MECHANICAL or n == "rest_length"]
        if all("ambient" in each.fixed for each in data if each.stepped):
            names = [n for n in names if n != "ambient"]
        known = []
        for name in dict.fromkeys(names):
            width = CONSTANTS[name].width
            if name in errors:
                error = errors[name] / (value[name] if CONSTANTS[name].log else 1.0)
                width = min(width, error)
            known.append(Known(name, encoded(name, value[name]), width))
        if law == "linear":
            start = _linear_start(tca)
            known += [Known(n, encoded(n, start[n]), LINEAR[n].width) for n in LINEAR]
        known += [Known(_zero(d), tca.rest_length, tca.rest_length) for d in data if has_zero(d)]
        stated = tuple(noise_of(each, noise) for each in data)
        return cls(tuple(data), tca, law, tuple(ends), tuple(known), stated)

    @property
    def names(self) -> list[str]:
        """Names of the numbers."""
        return [each.name for each in self.known]

    @property
    def start(self) -> Array:
        """Where the fit starts."""
        return np.array([each.start for each in self.known])

    @property
    def widths(self) -> Array:
        """What is known beforehand."""
        return np.array([each.width for each in self.known])

    def muscle(self, x: Array) -> Muscle:
        """The TCA of some numbers; ValueError if there is none."""
        coded = [(n, float(v)) for n, v in zip(self.names, x, strict=True) if " " not in n]
        values = {name: decoded(name, v) for name, v in coded}
        own = {name: value for name, value in values.items() if name in CONSTANTS}
        linear = {name: value for name, value in values.items() if name in LINEAR}
        return Muscle(with_constants(self.tca, own), self.law, linear)

    def one(self, i: int, x: Array, muscle: Muscle | None = None) -> tuple[Array, Array, Array]:
        """``weighed`` of one set."""
        data = self.data[i]
        zero = float(x[self.names.index(_zero(data))]) if has_zero(data) else 0.0
        return weighed(data, muscle or self.muscle(x), self.ends[i], self.noise[i], zero)

    def residuals(self, x: Array, scales: Array) -> Array:
        """All residuals over their errors, then what is known beforehand; large where the laws
        have no answer, so that a fit turns back."""
        beforehand = (x - self.start) / self.widths
        try:
            muscle = self.muscle(x)
            found = [self.one(i, x, muscle)[1].ravel() / scales[i] for i in range(len(self.data))]
        except (ValueError, ArithmeticError):
            return np.full(self.size + len(x), _IMPOSSIBLE)
        return np.concatenate([*found, beforehand])

    @property
    def size(self) -> int:
        """Number of measured outcomes."""
        return sum(each.rows * len(outcomes(each)) for each in self.data)

    def slopes(self, x: Array, scales: Array) -> Array:
        """Derivatives of the residuals; only of the sets that a number has to do with."""
        base = [self.one(i, x)[1] for i in range(len(self.data))]
        columns = []
        for j, known in enumerate(self.known):
            moved = x.copy()
            moved[j] += _STEP * known.width
            muscle, parts = self.muscle(moved), []
            for i, data in enumerate(self.data):
                there = self.one(i, moved, muscle)[1] if concerns(known.name, data) else base[i]
                parts.append(((there - base[i]) / (moved[j] - x[j]) / scales[i]).ravel())
            columns.append(np.concatenate(parts))
        return np.concatenate([np.array(columns).T, np.diag(1.0 / self.widths)])


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The least square of a problem.

    Attributes:
        problem: The problem.
        x: The numbers.
        covariance: Their covariance.
        scales: What the residuals of each set are over the stated errors.
        factors: The same with the correlation of neighbours in it, by which errors were multiplied.
        slopes: Derivatives of the residuals.
        quantile: Student's, at 97.5 %.
    """

    problem: Problem
    x: Array
    covariance: Array
    scales: Array
    factors: Array
    slopes: Array
    quantile: float

    @property
    def deviations(self) -> Array:
        """Standard deviations of the numbers."""
        return np.sqrt(np.diag(self.covariance))

    def left(self, name: str) -> float:
        """What the data leave of what was known of a number, in standard deviations.

        Of a constant that may be 0 that is its usual value, whatever was found.
        """
        j = self.problem.names.index(name)
        size = 1.0
        if name in CONSTANTS and CONSTANTS[name].usual:
            size = decoded(name, float(self.x[j])) / CONSTANTS[name].usual
        return float(self.deviations[j] / self.problem.widths[j]) * size

    @property
    def criterion(self) -> float:
        """Akaike's criterion with the factor of each set fitted: less is better, by 10 clearly."""
        sizes = [each.rows * len(outcomes(each)) for each in self.problem.data]
        likely = sum(n * math.log(s * s) for n, s in zip(sizes, self.scales, strict=True))
        return likely + 2.0 * len(self.x)

    def interval(self, name: str) -> tuple[float, float]:
        """95 % of a number by the profile of the likelihood, in its code."""
        j = self.problem.names.index(name)
        return self._end(j, -1.0), self._end(j, 1.0)

    def _end(self, j: int, sign: float) -> float:
        """Where the sum of squares, least over all other numbers, has grown by the square of the
        quantile.

        Gauss and Newton's steps over the others and a secant's along the number, with the slopes
        of the optimum, which every step mends by what it has seen (Broyden, in units of the
        errors). What no datum feels stays: coils that do not touch are not made to.
        """
        problem, slopes = self.problem, self.slopes.copy()
        metric = slopes.T @ slopes
        rest = slopes[: problem.size].any(axis=0) & (np.arange(len(self.x)) != j)
        point, seen = self.x, problem.residuals(self.x, self.factors)
        best, goal = float(seen @ seen), self.quantile**2
        away = self.quantile * float(self.deviations[j])
        step = np.where(rest, sign * away * self.covariance[:, j] / self.covariance[j, j], 0.0)
        step[j] = sign * away
        for _ in range(_PROFILED):
            there = problem.residuals(point + step, self.factors)
            if float(there @ there) > best + _FAR * goal:  # a bend, or no answer: less far
                step, away = 0.5 * step, away - 0.5 * sign * float(step[j])
                continue
            along = metric @ step
            slopes += np.outer(there - seen - slopes @ step, along) / float(step @ along)
            point, seen = point + step, there
            q, r = np.linalg.qr(slopes[:, rest])
            gain = q.T @ seen
            rise = float(seen @ seen) - float(gain @ gain) - best
            further = min(max(self.quantile / math.sqrt(max(rise, 1e-12)), 0.5), 2.0)
            if float(gain @ gain) < _NEAR * goal and abs(further - 1.0) < _NEAR:
                return float(self.x[j] + sign * away * further)
            step = np.zeros(len(self.x))
            step[j] = sign * away * (further - 1.0)
            step[rest] = -np.linalg.solve(r, gain + q.T @ slopes[:, j] * step[j])
            away *= further
        return float(self.x[j] + sign * away)


def fitted(problem: Problem, start: Array | None = None) -> Fit:
    """Fits a problem.

    Args:
        problem: The problem.
        start: Numbers to start from; None to look for a good start.

    Raises:
        ValueError: If the laws have no answer anywhere near the TCA as it is known.
    """
    scales = np.ones(len(problem.data))
    x = _best_start(problem) if start is None else start
    pure = scales
    for tolerance in (1e-4, *[1e-6] * _ROUNDS):
        x = least_squares(
            problem.residuals, x, jac=problem.slopes, args=(scales,), x_scale=problem.widths,
            method="lm", xtol=tolerance, ftol=tolerance, max_nfev=200,
        ).x  # fmt: skip
        pure, now = _scales(problem, x)
        settled = np.abs(now / scales - 1.0).max() < _CHANGE
        scales = now
        if settled and tolerance < 1e-5:
            break
    slopes = problem.slopes(x, scales)
    freedom = max(problem.size - len(x), 1)
    quantile = float(student.ppf(0.975, freedom))
    j = next((problem.names.index(name) for name in _CONTACT if name in problem.names), -1)
    if j >= 0 and slopes[: problem.size, j].any():
        apart = _without_contact(problem, x, scales, j)
        costs = [float(np.sum(problem.residuals(each, scales)[: problem.size] ** 2))
                 for each in (x, apart)]  # fmt: skip
        if costs[1] < costs[0] + CLEAR:
            x, slopes = apart, problem.slopes(apart, scales)
    covariance = np.asarray(np.linalg.inv(slopes.T @ slopes), dtype=np.float64)
    return Fit(problem, x, covariance, pure, scales, slopes, quantile)


def _without_contact(problem: Problem, x: Array, scales: Array, j: int) -> Array:
    """The best numbers, but for the length of contact, the j-th, if no coils touch.

    A few rows by chance too long at the hot end look like contact, and that is looked for in any
    number of them. So the square of Student's quantile is too little; it counts as models do.
    """
    apart = x.copy()
    seen = [float(each.columns["length"].min()) for each in problem.data
            if "length" in each.columns]  # fmt: skip
    shortest = min([*seen, math.exp(x[j])])
    apart[j] = min(problem.known[j].start, math.log(_APART * shortest))
    rest = np.arange(len(x)) != j

    def whole(inner: Array) -> Array:
        point = apart.copy()
        point[rest] = inner
        return point

    for _ in range(_LOWER):
        apart[rest] = least_squares(
            lambda inner: problem.residuals(whole(inner), scales), apart[rest],
            jac=lambda inner: problem.slopes(whole(inner), scales)[:, rest],
            x_scale=problem.widths[rest], method="lm", xtol=1e-6, ftol=1e-6, max_nfev=50,
        ).x  # fmt: skip
        if not problem.slopes(apart, scales)[: problem.size, j].any():
            break
        apart[j] += math.log(_APART)  # what is not held by contact may become shorter than was seen
    return apart


def _scales(problem: Problem, x: Array) -> tuple[Array, Array]:
    """Residuals of each set over the stated errors, without and with their correlation."""
    muscle, pure, grown = problem.muscle(x), [], []
    share = min(len(x) / problem.size, 0.9)
    for i, data in enumerate(problem.data):
        _, residual, _ = problem.one(i, x, muscle)
        found = math.sqrt(float(np.mean(residual**2)) / (1.0 - share))
        pure.append(max(found, 1e-6))
        ordered = residual[side_by_side(data)]
        grown.append(pure[-1] * math.sqrt(max(map(fewer, ordered.T))))
    return np.array(pure), np.array(grown)


def side_by_side(data: Data) -> NDArray[np.int64]:
    """The rows of a set side by side: over time, or under each load by what was varied."""
    if data.stepped:
        return np.argsort(data.columns["time"], kind="stable")
    by = ("temperature", "length", "stretch", "displacement")
    uneven = [n for n in by if n in data.columns and np.ptp(data.columns[n]) > 0.0][:1]
    keys = [data.columns[n] for n in (*uneven, "load") if n in data.columns]
    return np.lexsort(keys) if keys else np.arange(data.rows)


def fewer(residual: Array) -> float:
    """By how much too many rows there are, from the correlation of neighbours."""
    n, square = len(residual), float(np.sum(residual**2))
    if n < _FEW or square == 0.0:
        return 1.0
    r = min(float(np.sum(residual[1:] * residual[:-1])) / square, 0.98)
    return (1.0 + r) / (1.0 - r) if r > 3.0 / math.sqrt(n) else 1.0


def _best_start(problem: Problem) -> Array:
    """The best of some starts: moduli and growths may be far from those of any known thread."""
    trials = []
    for moduli, growths in _STARTS:
        x = problem.start
        for i, name in enumerate(problem.names):
            stiff = name in ("young", "shear", "linear_stiffness")
            grown = name.startswith(("growth", "linear_contraction"))
            x[i] += math.log(moduli if stiff else growths if grown else 1.0)
        found = problem.residuals(x, np.ones(len(problem.data)))
        trials.append((float(np.sum(np.minimum(found**2, _IMPOSSIBLE))), x))
    cost, best = min(trials, key=lambda each: each[0])
    if not cost < _IMPOSSIBLE * problem.size:
        problem.one(0, problem.start)  # says what is wrong
        problem.slopes(problem.start, np.ones(len(problem.data)))
    return best


def _linear_start(tca: TcaSpec) -> dict[str, float]:
    cold = tca.fibre.reference_temperature
    at_rest, *hot = hanging_length(tca, cold + np.array([0.0, 50.0, 100.0]), 0.0)
    stiffness = float(CoilRods([tca]).rest_stiffness[0])
    return {
        "linear_length": float(at_rest), "linear_stiffness": stiffness,
        "linear_contraction_50": float(at_rest - hot[0]),
        "linear_contraction_100": float(at_rest - hot[1]),
        "linear_shortest": tca.minimum_length,
    }  # fmt: skip


def _zero(data: Data) -> str:
    return f"zero of {data.name}"


def concerns(name: str, data: Data) -> bool:
    """Whether a number has to do with a set of measurements."""
    if " " in name:
        return name == _zero(data)
    return name in LINEAR or affects(name, data)


def natural(fit: Fit) -> dict[str, float]:
    """Standard errors of the constants in their own units (of a logarithm: relative error times
    the value)."""
    found = {}
    for name, number, deviation in zip(fit.problem.names, fit.x, fit.deviations, strict=True):
        if " " not in name:
            size = decoded(name, float(number)) if known_of(name).log else 1.0
            found[name] = float(deviation) * size
    return found


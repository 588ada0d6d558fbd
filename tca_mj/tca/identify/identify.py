"""From measurements to a TCA: what they identify, how well, by which model and end condition."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np

from tca_mj.checks import Array, NotNegative, Positive, door, require_one_of
from tca_mj.hints import nearest
from tca_mj.tca.identify.constants import CONSTANTS, constants_of, decoded, with_constants
from tca_mj.tca.identify.data import UNITS, Data
from tca_mj.tca.identify.fit import Fit, Known, Problem, fitted, natural
from tca_mj.tca.identify.predict import (
    LENGTHS,
    Law,
    affects,
    assumed,
    has_zero,
    outcomes,
    weighed,
)
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.spec import TcaSpec

_CLEAR, _EVEN = 10.0, 2.0  # differences of Akaike's criterion: no support left, and no difference
_MISFIT = 1.5  # residuals over stated errors, from which on a set is not described
_MEASURED = 0.7  # share of a stated error that is left of what data improve
_NORMAL = 1.959964  # 97.5 % of the normal distribution


class Found(NamedTuple):
    """One constant after the fit.

    Attributes:
        name: Its name in ``CONSTANTS``.
        value: Its value, in its unit.
        unit: That unit.
        state: "identified" by the data; "stated", with an error that the data do not improve; "not
            identified", where the value is no more than one that goes with the others.
        error: Standard error; None if it is not identified.
        interval: 95 %, a profile of the likelihood; None if it is not identified.
    """

    name: str
    value: float
    unit: str
    state: str
    error: float | None
    interval: tuple[float, float] | None


class Compared(NamedTuple):
    """One model and end condition.

    Attributes:
        law: "rod", "love", "cst" or "linear".
        ends: Of the sets that do not say theirs; None if all do.
        criterion: Akaike's criterion above the best.
        misfit: Largest ratio of residuals to stated errors in a set with lengths or forces.
    """

    law: Law
    ends: Spin | None
    criterion: float
    misfit: float


class Prediction(NamedTuple):
    """What a set of measurements shows and what is expected.

    Attributes:
        outcome: The quantity.
        measured: Measured values, shape (k,).
        expected: Expected ones, shape (k,).
        error: Standard error of what is measured about that, shape (k,): of the constants and of
            the measurement.
    """

    outcome: str
    measured: Array
    expected: Array
    error: Array

    @property
    def inside(self) -> float:
        """Share of the rows within 95 %."""
        return float(np.mean(np.abs(self.measured - self.expected) <= _NORMAL * self.error))


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """A TCA with errors.

    Attributes:
        tca: The TCA.
        law: The law that was fitted.
        ends: End condition of the sets that do not say theirs; None if all do.
        found: The constants that were free.
        compared: Models and end conditions, the best first; empty if they were not compared.
        words: What it comes to, in sentences.
        fit: The fit itself.
    """

    tca: TcaSpec
    law: Law
    ends: Spin | None
    found: tuple[Found, ...]
    compared: tuple[Compared, ...]
    words: tuple[str, ...]
    fit: Fit

    @property
    def data(self) -> tuple[Data, ...]:
        """The measurements, with notes on what was mended and assumed."""
        return self.fit.problem.data

    @property
    def correlation(self) -> Array:
        """Correlation of the constants ``found``, those that are not identified included."""
        n, size = len(self.found), self.fit.deviations
        return (self.fit.covariance / np.outer(size, size))[:n, :n]

    def predict(self, data: Data) -> tuple[Prediction, ...]:
        """What is expected of a set of measurements, also of one that was held out.

        Errors of measurement are those of the fitted sets with the same outcomes, else as stated.

        Raises:
            ValueError: If the set says too little, or its laws have no answer.
        """
        fit, data = self.fit, assumed(data, self.tca)
        old = fit.problem
        if data.name not in [each.name for each in old.data] and has_zero(data):
            raise ValueError(f"{data.name} must say '# length [mm]: ...', from which it counts")
        values = constants_of(self.tca)
        more = [n for n in values if CONSTANTS[n].own and affects(n, data) and n not in old.names]
        known = (*old.known, *(Known(n, _code(n, values[n]), CONSTANTS[n].width) for n in more))
        ends = data.ends or self.ends or "locked"
        problem = replace(
            Problem.of([data], old.tca, old.law, [ends], (), {}, {}), known=known,
            noise=tuple(_noise(old, data)),
        )  # fmt: skip
        x = np.append(fit.x, problem.start[len(old.known) :])
        covariance = np.diag(problem.widths**2)
        covariance[: len(fit.x), : len(fit.x)] = fit.covariance
        model, _, noise = problem.one(0, x)
        slopes = []
        for j, each in enumerate(known):
            moved = x.copy()
            moved[j] += 1e-4 * each.width
            there = problem.one(0, moved)[0] if affected(each.name, data) else model
            slopes.append((there - model) / (moved[j] - x[j]))
        spread = np.einsum("jkc,ji,ikc->kc", np.array(slopes), covariance, np.array(slopes))
        sizes = _sizes(fit, data)
        return tuple(
            Prediction(name, data.columns[name], model[:, i],
                       np.sqrt(spread[:, i] + (sizes[i] * noise[:, i]) ** 2))  # fmt: skip
            for i, name in enumerate(outcomes(data))
        )

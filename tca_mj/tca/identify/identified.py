"""From measurements to a TCA: what they identify, how well, by which model and end condition."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

import numpy as np

from tca_mj.checks import Array, NotNegative, Positive, door, require_one_of
from tca_mj.hints import nearest
from tca_mj.tca.identify.constants import (
    CONSTANTS,
    constants_of,
    decoded,
    encoded,
    known_of,
    with_constants,
)
from tca_mj.tca.identify.data import UNITS, Data
from tca_mj.tca.identify.fit import CLEAR, SHARE, Fit, Known, Problem, concerns, fitted, natural
from tca_mj.tca.identify.loops import Loop, loops, words_on
from tca_mj.tca.identify.predict import (
    LENGTHS,
    Law,
    affects,
    assumed,
    has_zero,
    noise_of,
    outcomes,
)
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.spec import TcaSpec

_EVEN = 2.0  # difference of Akaike's criterion that is none; at CLEAR no support is left
_MISFIT = 1.5  # residuals over stated errors, from which on a set is not described
_MEASURED = 0.7  # share of a stated error that is left of what data improve
_STEP = 1e-4  # of differences, over the width
_NORMAL = 1.959964  # 97.5 % of the normal distribution


Ends = Literal["free", "locked", "usual"]
"""Of all sets, or as usual: an end spins where a load hangs, none does where a force is read."""


class Found(NamedTuple):
    """One constant after the fit.

    Attributes:
        name: Its name in ``CONSTANTS``.
        value: Its value [``unit``].
        unit: That unit.
        state: "identified" by the data; "stated", with an error that the data do not improve; "not
            identified", where the value is no more than one that goes with the others.
        error: Standard error; None if it is not identified [``unit``].
        interval: 95 %, a profile of the likelihood; None if it is not identified [``unit``].
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
        ends: Of the sets that do not say theirs, one of ``Ends``; None if all do.
        criterion: Akaike's criterion above the best [1].
        misfit: Largest ratio of residuals to stated errors in a set [1].
    """

    law: Law
    ends: Ends | None
    criterion: float
    misfit: float


class Prediction(NamedTuple):
    """What a set of measurements shows and what is expected.

    Attributes:
        outcome: The quantity.
        measured: Measured values, shape (k,) [SI, °C].
        expected: Expected ones, shape (k,) [SI, °C].
        error: Standard error of what is measured about that, shape (k,): of the constants and of
            the measurement [SI, K].
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
        ends: End condition of the sets that do not say theirs, one of ``Ends``; None if all do.
        found: The constants that were free.
        compared: Models and end conditions, the best first; empty if they were not compared.
        words: What it comes to, in sentences.
        fit: The fit itself.
        noise: Errors of measurement as they were stated.
        loops: Loops between heating and cooling that the sets show.
    """

    tca: TcaSpec
    law: Law
    ends: Ends | None
    found: tuple[Found, ...]
    compared: tuple[Compared, ...]
    words: tuple[str, ...]
    fit: Fit
    noise: Mapping[str, float]
    loops: tuple[Loop, ...]

    @property
    def data(self) -> tuple[Data, ...]:
        """The measurements, with notes on what was mended and assumed."""
        return self.fit.problem.data

    @property
    def correlation(self) -> Array:
        """Correlation of the constants ``found``, those that are not identified included."""
        n, size = len(self.found), self.fit.deviations
        return (self.fit.covariance / np.outer(size, size))[:n, :n]

    @door
    def predict(self, data: Data) -> tuple[Prediction, ...]:
        """What is expected of a set of measurements, also of one that was held out.

        Errors of measurement are those of the fitted sets with the same outcomes, else as stated.

        Raises:
            ValueError: If the set says too little, or its laws have no answer.
        """
        fit, data = self.fit, assumed(data, self.tca)
        old = fit.problem
        if has_zero(data) and data.name not in [each.name for each in old.data]:
            raise ValueError(f"{data.name} must say from which length it counts, as"
                             f" '# length [mm]: 45', got {dict(data.fixed)}")  # fmt: skip
        values = constants_of(self.tca)
        more = [n for n in _asked(self.tca, None) if affects(n, data) and n not in old.names]
        beyond = [Known(n, encoded(n, values[n]), CONSTANTS[n].width) for n in more]
        problem = replace(
            old, data=(data,), ends=(_ends_of(data, self.ends),),
            known=(*old.known, *beyond), noise=(noise_of(data, self.noise),),
        )  # fmt: skip
        x = np.append(fit.x, [each.start for each in beyond])
        covariance = np.diag(problem.widths**2)
        covariance[: len(fit.x), : len(fit.x)] = fit.covariance
        model, _, noise = problem.one(0, x)
        slopes = np.zeros((len(x), *model.shape))
        for j, each in enumerate(problem.known):
            if concerns(each.name, data):
                moved = x.copy()
                moved[j] += _STEP * each.width
                slopes[j] = (problem.one(0, moved)[0] - model) / (moved[j] - x[j])
        spread = np.einsum("jkc,ji,ikc->kc", slopes, covariance, slopes)
        return tuple(
            Prediction(name, data.columns[name], model[:, i],
                       np.sqrt(spread[:, i] + (self._size(data, name) * noise[:, i]) ** 2))
            for i, name in enumerate(outcomes(data))
        )  # fmt: skip

    def _size(self, data: Data, name: str) -> float:
        """Errors of measurement over the stated ones: of the set itself, or of those like it."""
        sets = list(zip(self.data, self.fit.scales, strict=True))
        own = [scale for each, scale in sets if each.name == data.name]
        alike = [scale for each, scale in sets if name in outcomes(each)]
        return float(np.mean(own or alike or [1.0]))


@door
def identify(
    data: Sequence[Data],
    tca: TcaSpec,
    *,
    free: Sequence[str] | None = None,
    errors: Mapping[str, Positive] | None = None,
    law: Law = "rod",
    ends: Ends | None = None,
    noise: Mapping[str, NotNegative] | None = None,
    compare: bool = True,
) -> Identification:
    """Fits the constants of a TCA to measurements.

    Args:
        data: The sets of measurements, see ``read_data``.
        tca: The TCA as far as it is known: what is not free stays as it is here, what is free
            starts there.
        free: Constants to be fitted, names in ``CONSTANTS``; None for all that are not measured
            by a ruler or a balance.
        errors: Standard errors of constants that were measured, in their units: these are fitted,
            too, within that error, so that it counts in all others.
        law: The model, "rod" (which simulations use), "love", "cst" or "linear".
        ends: Whether an end may spin, in the sets that do not say so: in all, in none, or as
            usual; None to ask the data.
        noise: Standard deviations of what was measured, by quantity in SI units; default 0.5 K,
            1 % of full scale (the largest value) for all else, 0 for loads.
        compare: Whether to fit all other models and end conditions, too.

    Raises:
        ValueError: If a name is unknown, a set says too little, or no such TCA could have shown
            these measurements.
    """
    require_one_of("law", law, get_args(Law))
    stated, known = dict(noise or {}), dict(errors or {})
    for name in stated:
        require_one_of("quantity of noise", name, tuple(UNITS))
    asked = _asked(tca, free)
    _asked(tca, list(known))
    if not data or len({each.name for each in data}) < len(data):
        raise ValueError(
            f"data must be sets of different names, at least one, got {[d.name for d in data]}"
        )
    sets = [assumed(each, tca) for each in data]

    def fit_of(of: Law, at: Ends | None, start: Array | None = None) -> Fit:
        every = [_ends_of(each, at) for each in sets]
        problem = Problem.of(sets, tca, of, every, asked, known, stated)
        if not problem.known:
            raise ValueError(f"free must name constants that the data concern, got {asked}")
        return fitted(problem, start)

    mechanical = [d for d in sets if {*LENGTHS, "force"} & set(outcomes(d))]
    choices: list[Ends | None] = [ends]
    if ends is None and any(each.ends is None for each in mechanical):
        different = {tuple(_ends_of(d, at) for d in mechanical): at for at in get_args(Ends)}
        choices = [*different.values()]
    fits: dict[tuple[Law, Ends | None], Fit] = {}
    for at in choices:
        start = next(iter(fits.values())).x if fits else None
        fits[law, at] = fit_of(law, at, start)
    best = min(fits, key=lambda each: fits[each].criterion)
    for other in get_args(Law) if compare and mechanical else ():
        if other != law:
            alike = "linear" not in (law, other)
            with suppress(ValueError, ArithmeticError):  # a model may have no such shape
                fits[other, best[1]] = fit_of(other, best[1], fits[best].x if alike else None)
    fit, compared = fits[best], _compared(fits)
    found = tuple(_found(fit))
    values = {each.name: each.value for each in found}
    fibre = tca.fibre
    seen = [float(t) for d in sets for t in _extremes(d)]
    spec = with_constants(tca, {n: v for n, v in values.items() if n in CONSTANTS})
    if seen:
        low = min(min(seen), fibre.reference_temperature)
        high = max(max(seen), fibre.reference_temperature + 1.0)
        measured = replace(spec.fibre, temperature_range=(low, high))
        spec = replace(spec, fibre=measured)
    seen_loops = loops(fit)
    words = tuple(_words(fit, found, compared, best, _asked(tca, free), seen_loops))
    return Identification(spec, law, best[1], found, compared, words, fit, stated, seen_loops)


def _ends_of(data: Data, ends: Ends | None) -> Spin:
    """End condition of a set: its own, else the chosen one."""
    if data.ends or ends is None:
        return data.ends or "locked"
    if ends == "usual":
        return "locked" if "force" in outcomes(data) else "free"
    return ends


def _asked(tca: TcaSpec, free: Sequence[str] | None) -> list[str]:
    """The constants that are to be fitted."""
    has = constants_of(tca)
    if free is None:
        return [name for name in has if CONSTANTS[name].own]
    for name in free:
        if name not in has:
            raise ValueError(f"free must be of {list(has)}, got {name!r}{nearest(name, has)}")
    return list(free)


def _extremes(data: Data) -> list[float]:
    """Coldest and hottest of a set."""
    found = data.given("temperature")
    return [] if found is None else [float(np.min(found)), float(np.max(found))]


def _compared(fits: Mapping[tuple[Law, Ends | None], Fit]) -> tuple[Compared, ...]:
    least = min(fit.criterion for fit in fits.values())
    rows = [Compared(*key, fit.criterion - least, _misfit(fit)) for key, fit in fits.items()]
    return tuple(sorted(rows, key=lambda row: row.criterion))


def _misfit(fit: Fit) -> float:
    """Largest ratio of residuals to stated errors."""
    return float(fit.scales.max())


def _found(fit: Fit) -> list[Found]:
    found, errors = [], natural(fit)
    for known, x in zip(fit.problem.known, fit.x.tolist(), strict=True):
        name = known.name
        if name not in errors:
            continue
        stated = known.width < 0.5 * known_of(name).width
        good = fit.left(name) <= (_MEASURED if stated else SHARE)
        state = "identified" if good else "stated" if stated else "not identified"
        interval = None
        if state != "not identified":
            low, high = fit.interval(name)
            interval = decoded(name, low), decoded(name, high)
        found.append(Found(
            name, decoded(name, x), known_of(name).unit, state,
            None if interval is None else errors[name], interval,
        ))  # fmt: skip
    return found


def _words(
    fit: Fit, found: Sequence[Found], compared: Sequence[Compared],
    best: tuple[Law, Ends | None], asked: Sequence[str], seen: Sequence[Loop],
) -> list[str]:  # fmt: skip
    """What it comes to."""
    good = [each.name for each in found if each.state == "identified"]
    said = [f"These data identify {_list(good)}." if good else "These data identify nothing."]
    for each in found:
        if each.state == "not identified":
            known = CONSTANTS.get(each.name)
            would = f" It would take {known.measurement}." if known else ""
            said.append(f"They do not identify {each.name}; {each.value:.4g} {each.unit} goes with"
                        f" the other constants and has no error.{would}")  # fmt: skip
    said += _combinations(fit, [each.name for each in found if each.state == "not identified"])
    for name in asked:
        if name not in fit.problem.names and name in CONSTANTS:
            said.append(f"No data concern {name}, which stays as it was. It would take"
                        f" {CONSTANTS[name].measurement}.")  # fmt: skip
    for data, scale, factor in zip(fit.problem.data, fit.scales, fit.factors, strict=True):
        if scale > _MISFIT:
            said.append(f"{data.name}: residuals are {scale:.3g} times the stated errors. Columns,"
                        " units, the end condition or the model are wrong for it, or it is less"
                        " exact than was said.")  # fmt: skip
        if factor > 1.01 * scale:
            said.append(f"{data.name}: residuals follow one another: there is something in it that"
                        f" the model does not have; errors count {factor / scale:.2g}"
                        " times.")  # fmt: skip
    return [*said, *words_on(seen), *_verdict(compared, best)]


def _combinations(fit: Fit, names: Sequence[str]) -> list[str]:
    """Products of powers that are identified though their factors are not."""
    at = [fit.problem.names.index(name) for name in names]
    widths = fit.problem.widths[at]
    if len(at) < 2:
        return []
    squares, vectors = np.linalg.eigh(fit.covariance[np.ix_(at, at)] / np.outer(widths, widths))
    found = []
    for square, vector in zip(squares, vectors.T, strict=True):
        if math.sqrt(max(float(square), 0.0)) <= SHARE:
            powers = vector / widths
            powers = powers / powers[np.argmax(np.abs(powers))]
            error = math.sqrt(float(powers @ fit.covariance[np.ix_(at, at)] @ powers))
            terms = [f"{n}^{p:.2f}" for n, p in zip(names, powers, strict=True) if abs(p) > 0.1]
            if len(terms) > 1:
                found.append(f"Of these, {' '.join(terms)} is identified, to {100 * error:.2g} %.")
    return found


def _verdict(compared: Sequence[Compared], best: tuple[Law, Ends | None]) -> list[str]:
    """Which models the data support."""
    if len(compared) < 2:
        return []

    def named(each: Compared) -> str:
        at_ends = {"usual": ", ends free where it hangs and locked where it pulls",
                   "free": " with free ends", "locked": " with locked ends"}  # fmt: skip
        return each.law + ("" if each.law == "linear" else at_ends.get(each.ends or "", ""))

    first = compared[0]
    even = [named(each) for each in compared[1:] if each.criterion <= _EVEN]
    less = [named(each) for each in compared[1:] if _EVEN < each.criterion <= CLEAR]
    out = [named(each) for each in compared[1:] if each.criterion > CLEAR]
    said = [f"The data support {named(first)} most."]
    said += [f"They do not tell it from {_list(even)}."] if even else []
    said += [f"Less supported: {_list(less)}."] if less else []
    said += [f"Not supported: {_list(out)}."] if out else []
    if first.misfit > _MISFIT:
        said.append("None of them describes all sets to within the stated errors.")
    chosen = next(each for each in compared if (each.law, each.ends) == best)
    if chosen.criterion > CLEAR:
        said.append(f"The constants are those of {named(chosen)}, which was asked for.")
    return [" ".join(said)]


def _list(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)

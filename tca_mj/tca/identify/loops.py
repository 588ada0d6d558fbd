"""Hysteresis in measurements: whether heating and cooling show two branches, and what that does.

The laws have one length, or force, at one temperature. A loop of a width w is taken as

    outcome = f(T - s w/2),     s = 1 while it heats, -1 while it cools,

one more number of a set, in kelvin, found together with all constants to first order: with p the
derivative of the residuals r by w, J that by the constants and M = 1 - J (J^T J)^-1 J^T,

    w = -(M p) r/|M p|^2,      what it does to the constants if it is left out: (J^T J)^-1 J^T p w.

A set that only heats tells no loop: it would be taken for an error of the thermometer. What a
simulation has of hysteresis is a lag, ``tca.laws.creep.CreepSpec.lag``: where the rows have times
the width is told as one. A thermometer that lags looks the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca.identify.constants import CONSTANTS, LINEAR
from tca_mj.tca.identify.data import DRIVES, Data
from tca_mj.tca.identify.fit import Fit, fewer, side_by_side
from tca_mj.tca.identify.latent import weighed
from tca_mj.tca.identify.predict import outcomes, predict

_SURE = 4.0  # standard errors from which on a loop is one
_BOTH = 0.1  # share of the rows that heating and cooling have at least
_STEP = 0.01  # of differences [K]
_TURN = 6.0  # standard deviations of the temperature by which it goes back where it turns
_SHIFT = 0.5  # of its error, from which on a constant is said to move


_SIGNS = {True: "as if the TCA, or its thermometer, lagged",
          False: "the other way round than if it lagged"}  # fmt: skip


class Loop(NamedTuple):
    """A loop between heating and cooling.

    Attributes:
        name: Of the set.
        width: Between heating and cooling, positive where what cools lags [K].
        error: Its standard error [K].
        share: Largest difference of the outcome that it makes, of full scale [1].
        outcome: Which outcome that is.
        lag: The time by which the TCA, or the thermometer, would lag; None without times [s].
        moved: Where the constants would be with the loop in the fit, less where they are, over
            their standard errors [1].
        heated: How far they would be off, over their errors, had it only been heated [1].
    """

    name: str
    width: float
    error: float
    share: float
    outcome: str
    lag: float | None
    moved: Mapping[str, float]
    heated: Mapping[str, float]


def loops(fit: Fit) -> tuple[Loop, ...]:
    """The loops that are seen in the sets of a fit."""
    sets = range(len(fit.problem.data))
    found = (_loop(fit, i) for i in sets if {*outcomes(fit.problem.data[i])} - {"temperature"})
    return tuple(each for each in found if each is not None)


def _loop(fit: Fit, i: int) -> Loop | None:
    problem = fit.problem
    still = _at_rest(fit, i)
    temperature = still.columns.get("temperature")
    if temperature is None or np.ptp(temperature) == 0.0:
        return None
    noise = {**problem.noise[i], **({"temperature": 0.0} if problem.data[i].stepped else {})}
    off = problem.noise[i].get("temperature", 0.0)
    way = direction(temperature, max(_TURN * off, 0.05 * float(np.ptp(temperature))))
    if min(np.mean(way > 0.0), np.mean(way < 0.0)) < _BOTH:
        return None
    muscle, ends = problem.muscle(fit.x), problem.ends[i]
    zero = fit.x[problem.names.index(f"zero of {still.name}")] \
        if f"zero of {still.name}" in problem.names else 0.0  # fmt: skip

    def shifted(by: Array) -> Data:
        return replace(still, columns={**still.columns, "temperature": temperature - by})

    def slopes(by: Array) -> Array:
        """Of the residuals, by the width of a loop whose branches are ``by``."""
        moved = weighed(shifted(0.5 * _STEP * by), muscle, ends, noise, zero)[1]
        return (moved - weighed(still, muscle, ends, noise, zero)[1]) / _STEP

    before = sum(d.rows * len(outcomes(d)) for d in problem.data[:i])
    here = slice(before, before + still.rows * len(outcomes(problem.data[i])))

    def everywhere(part: Array) -> Array:
        """Of all residuals, with what is known beforehand; temperatures of a course stay."""
        rows = np.zeros((still.rows, len(outcomes(problem.data[i]))))
        rows[:, rows.shape[1] - part.shape[1] :] = part / fit.factors[i]
        found = np.zeros(len(fit.slopes))
        found[here] = rows.ravel()
        return found

    by_width = slopes(way)
    p, residual = everywhere(by_width), problem.residuals(fit.x, fit.factors)
    own = p - fit.slopes @ (fit.covariance @ (fit.slopes.T @ p))
    if not own @ own > 1e-12:
        return None
    width = float(-(own @ residual) / (own @ own))
    after = problem.one(i, fit.x, muscle)[1]
    after[:, after.shape[1] - by_width.shape[1] :] += width * by_width
    after = after[side_by_side(problem.data[i])]
    scale = np.sqrt(np.mean(after**2) * max(map(fewer, after.T))) / fit.factors[i]
    error = float(scale / np.sqrt(own @ own))
    if abs(width) < _SURE * error:
        return None
    warm, cool = (predict(shifted(0.5 * sign * width * way), muscle, ends, zero)
                  for sign in (1.0, -1.0))  # fmt: skip
    # With the loop in it the set is as exact as its residuals are then.
    sharper = np.ones(len(fit.slopes))
    sharper[here] /= scale

    def moves(change: Array) -> dict[str, float]:
        """How far the constants move over their errors where residuals change."""
        slope = fit.slopes * sharper[:, None]
        covariance = np.linalg.inv(slope.T @ slope)
        moved = -covariance @ (slope.T @ (sharper * change)) / np.sqrt(np.diag(covariance))
        named = zip(problem.names, moved.tolist(), strict=True)
        return {name: each for name, each in named if name in CONSTANTS or name in LINEAR}

    names = outcomes(still)
    shares = [float(np.abs(warm[:, c] - cool[:, c]).max() / np.abs(still.columns[name]).max())
              for c, name in enumerate(names)]  # fmt: skip
    largest = int(np.argmax(shares))
    return Loop(
        still.name, width, error, shares[largest], names[largest],
        _lag(problem.data[i], temperature, way, width), moves(p * width),
        moves(everywhere(slopes(np.ones(still.rows))) * -width),
    )  # fmt: skip


def _at_rest(fit: Fit, i: int) -> Data:
    """The set without times: a course has the temperatures that the fit gives it."""
    data = fit.problem.data[i]
    if not data.stepped:
        return data
    model = fit.problem.one(i, fit.x)[0]
    columns = {n: v for n, v in data.columns.items() if n not in ("time", "duty", *DRIVES)}
    return replace(data, columns={**columns, "temperature": model[:, 0]} if "temperature" in
                   outcomes(data) else columns)  # fmt: skip


def _lag(data: Data, temperature: Array, way: Array, width: float) -> float | None:
    """The lag that a loop comes to at the mean rate of the branches [s]."""
    if "time" not in data.columns:
        return None
    turns = np.flatnonzero(np.diff(way) != 0.0).tolist()
    branches = zip([0, *(each + 1 for each in turns)], [*turns, len(way) - 1], strict=True)
    travelled = sum(abs(float(temperature[b] - temperature[a])) for a, b in branches)
    time = float(data.columns["time"][-1] - data.columns["time"][0])
    return 0.5 * width * time / travelled if travelled > 0.0 and time > 0.0 else None


def direction(temperature: Array, turn: float) -> Array:
    """Whether each row, in its order, belongs to a heating (1) or a cooling (-1).

    Args:
        temperature: Temperatures in the order in which they were measured, shape (k,) [°C].
        turn: How far it must go back from its extreme to have turned there [K].
    """
    found = np.ones(len(temperature))
    up, extreme, begun = True, 0, 0
    first = temperature[0]
    for k, now in enumerate(temperature.tolist()):
        if begun == 0 and extreme == 0 and now < first - turn:  # it began by cooling
            up, extreme = False, k
        sign = 1.0 if up else -1.0
        if sign * (now - temperature[extreme]) >= 0.0:
            extreme = k
        elif sign * (temperature[extreme] - now) > turn:
            found[begun : extreme + 1] = sign
            up, begun, extreme = not up, extreme + 1, k
    found[begun:] = 1.0 if up else -1.0
    return found


def words_on(found: Sequence[Loop]) -> list[str]:
    """What loops come to, in sentences."""
    said = []
    for each in found:
        more = "" if each.lag is None else (
            f" At the rate of this course that is a lag of {each.lag:.2g} s (CreepSpec.lag)."
        )  # fmt: skip
        said.append(
            f"{each.name}: heating and cooling differ by {abs(each.width):.2g} K"
            f" (to {each.error:.1g} K), {100.0 * each.share:.2g} % of the full scale of"
            f" {each.outcome}, {_SIGNS[each.width > 0.0]}.{more} The laws have no loop: the"
            " constants are those of its middle."
        )
        own, heated = _list(each.moved), _list(each.heated)
        said.append(
            f"{each.name}: with the loop in the fit, constants would move, in their errors: {own}."
            if own else f"{each.name}: heating and cooling are even, so that the loop moves no"
            " constant by half of its error."
        )  # fmt: skip
        if heated:
            said.append(f"{each.name}: had it only been heated, they would be off by: {heated}.")
    return said


def _list(moved: Mapping[str, float]) -> str:
    return ", ".join(f"{n} {each:+.1f}" for n, each in moved.items() if abs(each) > _SHIFT)

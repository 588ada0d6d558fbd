"""What a robot did, and the figures of its model by which it does that: fits to its motion.

What belongs to a TCA alone is found on the bench (``tca.identify``). What a body adds, the modulus
of its silicone, how heat gets into it, where a TCA lies, shows only when it moves: here a
simulation is run through the same commands, and ``mujoco.minimize.least_squares`` moves the figures
until it does what was seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
from mujoco import minimize
from scipy import stats

from tca_mj.checks import Array, Checked, Numbers, Positive, door, number, shown, within
from tca_mj.drive import SimulationDiverged
from tca_mj.model.part import Part
from tca_mj.sim import Simulation
from tca_mj.tca import Supply

Build = Callable[[Mapping[str, float]], Part]
"""The robot whose figures have some values."""
Read = Mapping[str, Callable[[Simulation], float]]
"""What is seen, by name: one number of a simulation."""

_STEP = 1e-3  # of differences, relative: far above what a rest is exact to
_LOST = 1e3  # standard errors that a course counts as off which diverges
_SINGULAR = 1e-9  # share of what is seen in which figures must differ that are known apart
_VAGUE = 0.2  # relative error from which on a figure is not identified
_SURE = 0.95
_factor = partial(number, above=1.0, at_most=1e3)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Trace(Checked):
    """One course: what the robot was told, and what was seen of it. It begins cold and at rest.

    Attributes:
        time: When something was seen, from 0 on, shape (k,); every step a multiple of the period in
            which TCAs are updated, 0.02 s unless ``fit_traces`` is told another [s].
        command: What the TCAs were told from each time to the next one, shape (k - 1, n), in the
            unit of the supply.
        seen: What was measured, by name, shape (k,) each; not a number where nothing was.
        error: Standard error of each, in its unit.

    Raises:
        ValueError: If shapes do not fit, times do not rise from 0, or an error is missing.
    """

    time: Numbers
    command: Numbers
    seen: Mapping[str, Any]
    error: Mapping[str, Positive]

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        time = within("time", self.time)
        if time.ndim != 1 or len(time) < 2 or time[0] != 0.0 or not (np.diff(time) > 0.0).all():
            raise ValueError(f"time must rise from 0, got {shown(self.time)}")
        command = within("command", self.command)
        if command.ndim != 2 or len(command) != len(time) - 1:
            raise ValueError(
                f"command must have shape ({len(time) - 1}, n), a row from each time to the next,"
                f" got {command.shape}"
            )
        if not self.seen or set(self.error) != set(self.seen):
            raise ValueError(
                f"error must name what is seen, {sorted(self.seen)}, got {sorted(self.error)}"
            )
        for name, values in self.seen.items():
            array = np.asarray(values, dtype=np.float64)
            if array.shape != time.shape or np.isinf(array).any():
                raise ValueError(f"seen[{name!r}] must have shape {time.shape}, got {array.shape}")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TraceFit:
    """What was found.

    Attributes:
        values: The figures by name.
        relative_error: Their relative standard errors: by the stated ones, or by what is left if
            that is more [1].
        correlation: Of their logarithms, shape (p, p) [1].
        spread: Root mean square of what is left over the stated errors, 1 if model and errors
            are right [1].
        expected: What the robot does with these figures, as ``seen`` of each trace.
        freedom: Number of measurements less that of figures.
    """

    values: Mapping[str, float]
    relative_error: Mapping[str, float]
    correlation: Array
    spread: float
    expected: tuple[Mapping[str, Array], ...]
    freedom: int

    @door
    def identified(self, name: str) -> bool:
        """Whether the data leave less than a fifth of a figure open.

        Raises:
            KeyError: If it was not fitted.
        """
        return self.relative_error[name] < _VAGUE

    @door
    def interval(self, name: str) -> tuple[float, float]:
        """Ends of the 95 % interval of a figure, by Student's t and the slopes at the best one.

        Raises:
            KeyError: If it was not fitted.
        """
        half = float(stats.t.ppf(0.5 + _SURE / 2.0, self.freedom)) * self.relative_error[name]
        return self.values[name] * math.exp(-half), self.values[name] * math.exp(half)


@door
def fit_traces(
    build: Build, start: Mapping[str, Positive], traces: Sequence[Trace], read: Read, *,
    supply: Supply | None = None, tca_period: Positive = 0.02,
    factor: Annotated[float, _factor] = 5.0,
) -> TraceFit:  # fmt: skip
    """Figures of a robot with which it does what was seen.

    Args:
        build: Makes the robot of figures; those that it is given are the names of ``start``.
        start: First values of the figures, all positive: they are fitted as logarithms.
        traces: The courses.
        read: How what was seen is read from a simulation.
        supply: What commands are; None for power.
        tca_period: Time between two updates of the TCAs [s].
        factor: By how much a figure may differ from its start, up or down [1].

    Raises:
        ValueError: If a trace has what ``read`` does not know, fewer numbers than there are
            figures, or does not fit the robot.
        SimulationDiverged: If the robot cannot do this with its first figures.

    Example:
        >>> import numpy as np
        >>> from tca_mj import BendingSpec, Trace, bending_module, fit_traces
        >>> def build(figures):
        ...     return bending_module(BendingSpec(nodes=4, **figures))
        >>> read = {"bend": lambda sim: sim.bend("body")}
        >>> trace = Trace(time=[0.0, 1.0, 2.0], command=[[1.0, 0.0, 0.0]] * 2,
        ...               seen={"bend": [0.0, 0.3, 0.5]}, error={"bend": 0.02})
        >>> found = fit_traces(build, {"diameter": 4.5e-3}, [trace], read)
        >>> len(found.expected[0]["bend"])
        3
    """
    names = list(start)
    if not names or not traces:
        raise ValueError(f"start and traces must not be empty, got {names} and {len(traces)}")
    for trace in traces:
        unknown = sorted(set(trace.seen) - set(read))
        if unknown:
            raise ValueError(f"read must say how to see {unknown}, got {sorted(read)}")

    def figures(x: Array) -> dict[str, float]:
        return {name: start[name] * math.exp(by) for name, by in zip(names, x, strict=True)}

    def expected(x: Array) -> list[dict[str, Array]]:
        made = build(figures(x))
        sim = Simulation(made, supply=supply, tca_period=tca_period)
        return [_run(sim, trace, read) for trace in traces]

    columns = [(i, name) for i, trace in enumerate(traces) for name in trace.seen]
    seen = np.concatenate([np.asarray(traces[i].seen[name], np.float64) for i, name in columns])
    error = np.concatenate([np.full(len(traces[i].time), traces[i].error[name])
                            for i, name in columns])  # fmt: skip
    there = ~np.isnan(seen)

    def left(x: Array) -> Array:
        """Residuals over their errors, shape (m,)."""
        found = expected(x)
        values = np.concatenate([found[i][name] for i, name in columns])
        return ((values - seen) / error)[there]

    first = left(np.zeros(len(names)))  # what cannot be done at all says so
    if len(first) <= len(names):
        raise ValueError(
            f"traces must have more numbers than there are figures, {len(names)}, got {len(first)}"
        )

    def residual(points: Array) -> Array:
        found = []
        for x in points.T:
            try:
                found.append(left(x))
            except (SimulationDiverged, ValueError):  # no such robot
                found.append(np.full_like(first, _LOST))
        return np.array(found).T

    ends = math.log(factor) * np.ones((len(names), 1))
    best, log = minimize.least_squares(
        np.zeros((len(names), 1)), residual, bounds=[-ends, ends], eps=_STEP, xtol=1e-6,
        verbose=minimize.Verbosity.SILENT,
    )  # fmt: skip
    x = np.asarray(best).ravel()
    jacobian = _slopes(left, x)
    rest, freedom = left(x), len(first) - len(names)
    spread = math.sqrt(float(rest @ rest) / freedom)
    # Scaled by its own diagonal, where nothing that is seen moves by one of the figures.
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    weights, axes = np.linalg.eigh((jacobian / size).T @ (jacobian / size))
    inverse = axes / np.maximum(weights, _SINGULAR) @ axes.T
    root = np.sqrt(np.diag(inverse))
    sigma = max(spread, 1.0) * root / size
    correlation = inverse / np.outer(root, root)
    np.fill_diagonal(correlation, 1.0)
    return TraceFit(
        values=figures(x), relative_error=dict(zip(names, sigma.tolist(), strict=True)),
        correlation=correlation, spread=spread, expected=tuple(expected(x)), freedom=freedom,
    )  # fmt: skip


def _run(sim: Simulation, trace: Trace, read: Read) -> dict[str, Array]:
    """What a simulation does, told what the robot was told."""
    sim.reset()
    seen = {name: [read[name](sim)] for name in trace.seen}
    for command, time in zip(np.asarray(trace.command), np.diff(trace.time), strict=True):
        sim.step(command, round(float(time) / sim.tca_period) * sim.tca_period)
        for name, values in seen.items():
            values.append(read[name](sim))
    return {name: np.array(values, dtype=np.float64) for name, values in seen.items()}


def _slopes(left: Callable[[Array], Array], x: Array) -> Array:
    """Central differences of the residuals, shape (m, p); to one side at the end of what can be."""
    columns = []
    for by in _STEP * np.eye(len(x)):
        ends = []
        for side in (1.0, -1.0, 0.0):
            try:
                ends.append((side, left(x + side * by)))
            except (SimulationDiverged, ValueError):
                continue
        (right, above), (wrong, below), *_ = ends
        columns.append((above - below) / ((right - wrong) * _STEP))
    return np.array(columns).T

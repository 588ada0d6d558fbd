"""A logged bench experiment, run through the model: what it would have shown, beside what it did.

A log is a course over time under a power, a voltage, a current or pulses of a voltage, as
``read_data`` reads it. From the same rows an observer is fed, where they have a resistance or both
voltage and current: it knows of the TCA what a controller on the bench would know.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from tca_mj.checks import Array, door, shown
from tca_mj.tca.bank import TcaBank
from tca_mj.tca.identify.data import SHOWN, Data
from tca_mj.tca.identify.predict import (
    LENGTHS,
    Muscle,
    assumed,
    duty,
    has_zero,
    length_is_given,
    length_name,
    outcomes,
    predict,
)
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.laws.table import CalibrationError
from tca_mj.tca.sensing.observer import ObserverSpec, TcaObserver
from tca_mj.tca.spec import TcaSpec

_LEAST_NOISE = 1e-3  # of a resistance that is read, where rows do not scatter [ohm]
_ROUGH = 0.67448975 * np.sqrt(2.0)  # of the median step of white noise over its deviation


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A log and what was made of it.

    Attributes:
        data: The log, with notes on what was assumed.
        model: What the model shows, by quantity, shape (k,) each; in SI units and °C, as all here.
        observed: What the observer tells, likewise; empty if nothing could be read.
    """

    data: Data
    model: Mapping[str, Array]
    observed: Mapping[str, Array]

    @property
    def compared(self) -> tuple[str, ...]:
        """The quantities that were measured and that the model shows, too."""
        return tuple(name for name in self.model if name in self.data.columns)

    def words(self) -> list[str]:
        """The errors in words, a line for each quantity that was measured, and the notes."""
        time, lines = self.data.columns["time"], []
        for who, curves in (("model", self.model), ("observer", self.observed)):
            for name in curves:
                if name not in self.data.columns:
                    continue
                measured = self.data.columns[name]
                off = curves[name] - measured
                worst = int(np.argmax(np.abs(off)))
                unit, swing = SHOWN[name], float(np.ptp(measured))
                share = f", {100.0 * _rms(off) / swing:.1f} % of its range" if swing > 0.0 else ""
                side = "above" if np.mean(off) > 0.0 else "below"
                lines.append(
                    f"{who}, {name}: off by {_rms(off):.3g} {unit} (root of the mean"
                    f" square{share}), at most by {abs(off[worst]):.3g} {unit} at"
                    f" {time[worst]:.4g} s;"
                    f" on average {abs(np.mean(off)):.3g} {unit} {side} what was measured"
                )
        if not lines:
            lines.append("nothing was measured besides what drove the TCA: the model stands alone")
        return lines + [f"note: {note}" for note in self.data.notes]

    def as_data(self) -> Data:
        """The model as measurements, which ``write_data`` writes."""
        columns = {"time": self.data.columns["time"], **self.model}
        return replace(self.data, name=f"model of {self.data.name}", columns=columns, notes=())


def _rms(values: Array) -> float:
    """Root of the mean square [as the values]."""
    return float(np.sqrt(np.mean(np.square(values))))


@door
def follow_log(data: Data, tca: TcaSpec, ends: Spin | None = None) -> Followed:
    """Runs the model through a log: its power, voltage, current or pulses drive it, row by row.

    Args:
        data: The log. A length or a force that it has besides is what was measured of the free
            end; with ``force``, or a ``# length`` above the table, the length is given.
        tca: The TCA.
        ends: Whether an end may spin where the log does not say; None is locked.

    Returns:
        The log, the model and the observer.

    Raises:
        ValueError: If it is no course over time under something that drives, or the laws have no
            answer.
        CoilSolveError: As ``hanging_length``.
    """
    if not data.stepped:
        raise ValueError(
            "data must be a course: time, and a power, voltage or current, got columns"
            f" {shown(list(data.columns))}"
        )
    blank, columns = np.zeros(data.rows), dict(data.columns)  # outcomes, which nothing reads
    held = length_is_given(data)
    for name in ("temperature", "resistance", "force" if held else length_name(data) or "length"):
        columns.setdefault(name, blank)
    asked = replace(data, columns=columns)
    asked = assumed(asked, tca)
    spin: Spin = data.ends or ends or "locked"
    model = dict(zip(outcomes(asked), predict(asked, Muscle(tca, "rod", {}), spin).T, strict=True))
    name = length_name(data)
    if has_zero(asked):  # counted from where the log begins
        model[name] = model[name] - model[name][0] + data.columns[name][0]
    notes, observed = asked.notes, {}
    if spin == "locked":
        observed = _observed(data, tca)
    elif _ohms(data) is not None:
        notes += (f"{data.name}: the observer knows coils with locked ends alone and is left out",)
    if observed and name in LENGTHS[1:] and not held:
        sign = 1.0 if name == "stretch" else -1.0
        moved = sign * (observed["length"] - observed["length"][0])
        observed[name] = moved + data.columns[name][0]
    return Followed(
        replace(data, notes=notes), MappingProxyType(model), MappingProxyType(observed)
    )


def _ohms(data: Data) -> Array | None:
    """Resistance of each row, NaN where no current flows; None if nothing tells it."""
    columns = data.columns
    if "resistance" in columns:
        return columns["resistance"]
    if "voltage" not in columns or "current" not in columns:
        return None
    volts, amperes = columns["voltage"], columns["current"]
    flows = np.abs(amperes) > 0.01 * np.abs(amperes).max(initial=1e-9)
    return np.where(flows, np.abs(volts / np.where(flows, amperes, 1.0)), np.nan)


def _observed(data: Data, tca: TcaSpec) -> dict[str, Array]:
    """What an observer tells from power and resistance alone."""
    ohms, columns = _ohms(data), data.columns
    if ohms is None or not np.isfinite(ohms).any():
        return {}
    read = ohms[np.isfinite(ohms)]
    noise = float(np.median(np.abs(np.diff(read)))) / _ROUGH if read.size > 1 else 0.0
    if "ambient" in data.fixed:
        tca = replace(tca, ambient=data.fixed["ambient"])
    try:
        bank = TcaBank([tca], law="surface")
    except CalibrationError:
        bank = TcaBank([tca])
    observer = TcaObserver(bank, ObserverSpec(resistance_noise=max(noise, _LEAST_NOISE)))
    volts, amperes, power = (columns.get(name) for name in ("voltage", "current", "power"))
    estimate, on, rows = observer.begin(read[:1]), duty(data), []
    steps = np.diff(columns["time"], prepend=columns["time"][0])
    for i, (step, reading) in enumerate(zip(steps.tolist(), ohms.tolist(), strict=True)):
        if step > 0.0:
            now = float(observer.expected(estimate)[0])
            if power is not None:
                watts = power[i - 1]
            elif volts is not None and amperes is not None:
                watts = on[i - 1] * abs(volts[i - 1] * amperes[i - 1])
            elif volts is not None:
                watts = on[i - 1] * volts[i - 1] ** 2 / now
            else:
                watts = on[i - 1] * amperes[i - 1] ** 2 * now  # type: ignore[index]
            estimate = observer.predicted(estimate, watts, step)
        estimate = observer.corrected(estimate, reading)
        pull = observer.tension(estimate).tension
        rows.append((estimate.temperature[0], estimate.length[0], max(pull[0], 0.0)))
    return dict(zip(("temperature", "length", "force"), np.array(rows).T, strict=True))

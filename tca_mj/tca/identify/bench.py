"""What a bench would measure of a TCA: the files of an experiment that is still to be done."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Annotated

import numpy as np

from tca_mj.checks import Seed, door, whole
from tca_mj.tca.identify.data import Data
from tca_mj.tca.identify.predict import (
    Muscle,
    given_with_error,
    noise_of,
    outcomes,
    predict,
)
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.laws.statics import tension
from tca_mj.tca.spec import TcaSpec

Rows = Annotated[int, partial(whole, at_least=3, at_most=100_000)]
_HOT = 110.0  # above the reference, how far a bench heats [K]


@door
def simulated_bench(tca: TcaSpec, rows: Rows = 200, seed: Seed = 0) -> list[Data]:
    """Five sets of measurements of a TCA, with the errors of simple instruments.

    Lengths and forces are off by 1 % of full scale (the largest value), temperatures by 0.5 K,
    resistances by 1 %. What was set is exact: loads, voltages and times.

    Args:
        tca: The TCA, bare or in a body.
        rows: Rows of each set.
        seed: Of the errors.

    Returns:
        Length against temperature without load and with two loads, the end free to spin; force
        against stretch, cold, and force against temperature at one length, clamped; a step of
        voltage under a load, with temperature and length; resistance against length.
    """
    cold, rest, longest = tca.fibre.reference_temperature, tca.rest_length, 0.9 * tca.fibre_length
    # What stretches the cold TCA by half and a quarter, or as far as its fibre goes.
    far = min(1.5 * rest, 0.6 * longest + 0.4 * rest)
    heavy = float(tension(tca, far, cold, spin="free")[0])
    loads = np.array([0.0, 0.5 * heavy, heavy])[np.arange(rows) % 3]
    heated = np.linspace(cold, cold + _HOT, rows)
    still = np.full(rows, cold)
    ohms = tca.resistance_per_length * rest
    volts = math.sqrt(0.8 * _HOT * float(np.asarray(tca.heat.steady_loss)) * ohms)
    time = np.linspace(0.0, 10.0 * float(np.asarray(tca.heat.time_constant)), rows)
    lengths = np.linspace(rest, min(1.7 * rest, 0.8 * longest + 0.2 * rest), rows)
    sets: list[tuple[str, Spin | None, dict[str, np.ndarray], dict[str, float]]] = [
        ("length.csv", "free", {"temperature": heated, "load": loads, "length": heated}, {}),
        ("stretch.csv", "locked", {"temperature": still, "length": lengths, "force": still}, {}),
        ("force.csv", "locked", {"temperature": heated, "force": still}, {"length": 1.2 * rest}),
        ("step.csv", "free", {"time": time, "voltage": np.where(time < 0.6 * time[-1], volts, 0.0),
                              "temperature": still, "length": still},
         {"load": 0.5 * heavy}),
        ("resistance.csv", None, {"length": np.linspace(0.75 * rest, lengths[-1], rows),
                                  "resistance": still}, {}),
    ]  # fmt: skip
    random = np.random.default_rng(seed)
    return [
        measured(Data(name=name, columns=columns, fixed=fixed, ends=ends), tca, random)
        for name, ends, columns, fixed in sets
    ]


def measured(data: Data, tca: TcaSpec, random: np.random.Generator) -> Data:
    """A set with the true givens as its columns, turned into what instruments show."""
    model = predict(data, Muscle(tca, "rod", {}), data.ends or "locked")
    columns = {**data.columns, **dict(zip(outcomes(data), model.T, strict=True))}
    true = replace(data, columns=columns)
    noise = noise_of(true, {})
    shown = {*outcomes(data), *given_with_error(data)}
    return replace(true, columns={
        name: values + noise[name] * random.standard_normal(data.rows) if name in shown else values
        for name, values in columns.items()
    })  # fmt: skip

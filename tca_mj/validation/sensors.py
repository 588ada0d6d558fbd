"""Resistance over length, displacement and force, and the cubic read from it (Sun, 2.3)."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca import MODULE_TCAS, Load, LoadedTcas, TcaSpec, WireTable, hanging_length, resistance
from tca_mj.tca.sensing.sensor import measured
from tca_mj.tca.sensing.wire import DisplacementFit, fit_displacement, resistance_displacement
from tca_mj.validation.facts import Finding, finding
from tca_mj.validation.strokes import heat_up, settled, weight

SENSED = MODULE_TCAS["sensing"]
WIRE = WireTable.of([SENSED])
WEIGHTS = (10, 20, 30, 40, 50)  # Sun, Section 2.3.1 [g]
VOLTS = (12.0, 10.0)  # Sun, Section 2.3.1
Ohms = Callable[[Array, Array], Array]  # of length [m] and temperature [°C]
_RUNS = 20  # measurements over which an error is averaged


def crept(grams: float) -> TcaSpec:
    """The TCA after the heating cycle that comes before every experiment with a new weight."""
    return settled(SENSED, grams)


class Curve(NamedTuple):
    """A weight lifted by a voltage; shapes (k,)."""

    length: Array  # [m]
    displacement: Array  # [m]
    ohms: Array


def under(tca: TcaSpec, grams: float) -> tuple[LoadedTcas, Ohms, float]:
    """A TCA with a weight: both, its resistance, and its length at rest [m]."""
    load = Load.weight(1e-3 * grams)
    start = float(LoadedTcas([tca], load).rest().length[0])

    def ohms(length: Array, temperature: Array) -> Array:
        return resistance_displacement(WIRE, start - length, weight(grams), temperature)

    return LoadedTcas([tca], load, resistance=ohms), ohms, start


def lifted(grams: float, volts: float, duration: float) -> Curve:
    """Resistance while a voltage lifts a weight by up to 45 mm, from the crept, loaded length."""
    tcas, ohms, start = under(crept(grams), grams)
    course = heat_up(tcas, "voltage", volts, 0.01, round(100 * duration))
    moved = start - course.length[:, 0]
    kept = moved <= 0.045
    length = course.length[kept]
    return Curve(length[:, 0], moved[kept], ohms(length, course.temperature[kept])[:, 0])


def curves() -> dict[int, Curve]:
    """The five weights at 12 V."""
    return {grams: lifted(grams, VOLTS[0], 1.0) for grams in WEIGHTS}


def stretched(forces: Array) -> Array:
    """Resistance of the cold TCA under forces, shape (k,) [N] -> [ohm]."""
    return resistance(WIRE, hanging_length(SENSED, 25.0, forces)[:, None], 25.0)[:, 0]


def cubic(curve: Curve, seed: int) -> tuple[DisplacementFit, Array]:
    """Third-order polynomial fitted to one noisy measurement; and the measured resistances."""
    ohms = measured(curve.ohms, VOLTS[0], np.random.default_rng(seed))
    return fit_displacement(ohms, curve.displacement), ohms


def findings() -> list[Finding]:
    """Facts about the ``curves()``, and the error of the third-order polynomial D(R) of them."""
    found = curves()
    ohms = resistance(WIRE, SENSED.rest_length + np.array([[0.0], [0.055]]), 25.0)[:, 0]
    falls = stretched(weight(1.0) * np.linspace(0.0, 50.0, 26))
    rising = all(bool(np.all(np.diff(curve.ohms) > 0.0)) for curve in found.values())
    both = [*found.values(), *(lifted(grams, VOLTS[1], 1.5) for grams in (WEIGHTS[0], WEIGHTS[-1]))]
    at = np.array([np.interp(0.02, curve.displacement, curve.ohms) for curve in both])
    slope = float(WIRE.contraction[0] * WIRE.rest_resistance[0] / WIRE.rest_length[0])
    off = 1e3 * float(np.abs(at - at[: len(found)].mean()).max()) / slope
    light, heavy = (
        1e3 * float(np.mean([cubic(found[grams], seed)[0].rmse for seed in range(_RUNS)]))
        for grams in (20, 40)
    )
    return [
        finding("stretch-resistance", float(ohms[0] - ohms[1])),
        finding("heated-resistance", held=rising, light=found[10].ohms[[0, -1]],
                heavy=found[50].ohms[[0, -1]]),
        finding("pulled-resistance", held=bool(np.all(np.diff(falls) < 0.0)), falls=falls[[0, -1]]),
        finding("averaged-curve", off), finding("cubic-20-g", light), finding("cubic-40-g", heavy),
    ]  # fmt: skip

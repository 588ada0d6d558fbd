"""What is no number, or no possible one, every function of a TCA refuses: no NaN comes out."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    CoilRods,
    CoilSurfaces,
    Heating,
    HeatSpec,
    Load,
    LoadedTcas,
    TcaBank,
    WireTable,
    coil_tension,
    hanging_length,
    heat_lost,
    power_from_voltage,
    radial_growth,
    resistance,
    sensed_length,
    softened_tension,
    softening,
    step_temperature,
    tension,
    untwist,
)

TCA = CATALOGUE["free-stroke"]
FIBRE, WIRE, BANK = TCA.fibre, WireTable.of([TCA]), TcaBank([TCA], law="surface")
LIFTING = LoadedTcas([TCA], Load.weight(0.03))
RODS, TABLES = CoilRods([TCA]), CoilSurfaces([TCA])

# A function of numbers, and good ones for it.
CALLS = {
    "hanging_length": (lambda t, f: hanging_length(TCA, t, f), (100.0, 0.1)),
    "hanging_length love": (lambda t, f: hanging_length(TCA, t, f, model="love"), (100.0, 0.1)),
    "hanging_length cst": (lambda t, f: hanging_length(TCA, t, f, model="cst"), (100.0, 0.1)),
    "tension": (lambda x, t: tension(TCA, x, t), (0.05, 100.0)),
    "coil_tension": (lambda x, t: coil_tension(TCA, x, t), (0.05, 100.0)),
    "rods": (lambda x, t: RODS.tension([x], [t]), (0.05, 100.0)),
    "tables": (lambda x, t: TABLES.tension([x], [t]), (0.05, 100.0)),
    "advance": (lambda p, x: BANK.advance(BANK.rest(), [p], [x], 0.02)[1].tension, (1.0, 0.05)),
    "bank.resistance": (lambda x: BANK.resistance(BANK.rest(), [x]), (0.05,)),
    "power_at": (lambda v: BANK.power_at(BANK.rest(), [0.05], [v]), (5.0,)),
    "growth": (lambda t: radial_growth(FIBRE, t), (100.0,)),
    "untwist": (lambda t: untwist(FIBRE, t), (100.0,)),
    "softening": (lambda t, x: softening(FIBRE, t, x), (100.0, 50.0)),
    "softened_tension": (lambda t, f, c: softened_tension(FIBRE, t, f, c), (100.0, 0.1, 300.0)),
    "step_temperature": (lambda t, p: step_temperature(t, p, TCA.heat, 0.1), (50.0, 1.0)),
    "heat_lost": (lambda t, p: heat_lost(t, p, TCA.heat, 0.1), (50.0, 1.0)),
    "power_from_voltage": (power_from_voltage, (5.0, 3.0)),
    "resistance": (lambda x, t: resistance(WIRE, [x], [t]), (0.05, 100.0)),
    "sensed_length": (lambda r: sensed_length(WIRE, [r]), (3.0,)),
    "equilibrium": (lambda t: LIFTING.equilibrium([t]), (60.0,)),
    "weight": (lambda m: Load.weight(m).force, (0.03,)),
    "spring": (lambda k, f, r: Load.spring(k, f, r).stiffness, (10.0, 0.05, 0.045)),
    "heating": (lambda v, a: Heating(value=v, air=a).value, (1.0, 2.0)),
    "heat": (lambda c, h: HeatSpec(capacity=c, loss=h).time_constant, (0.04, 0.01)),
}
NO_NUMBERS = [math.nan, math.inf, -math.inf, 1j, np.complex128(0.05), "0.05", "x", None, 10**400]


@pytest.mark.parametrize("bad", NO_NUMBERS, ids=lambda bad: repr(bad)[:12])
@pytest.mark.parametrize("name", CALLS)
@pytest.mark.filterwarnings("error")
def test_no_number_is_refused(name, bad):
    function, good = CALLS[name]
    assert np.isfinite(function(*good)).all()
    for i in range(len(good)):
        with pytest.raises(ValueError):
            function(*good[:i], bad, *good[i + 1 :])


@pytest.mark.parametrize("empty", [np.empty(0), np.empty((3, 0))])
def test_nothing_in_is_nothing_out(empty):
    assert hanging_length(TCA, empty, empty).shape == empty.shape
    for array in tension(TCA, empty, 100.0):
        assert array.shape == empty.shape
    for array in coil_tension(TCA, empty, empty):
        assert array.shape == empty.shape


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"coil_radius": FIBRE.radius}, "spring index above 1"),
        ({"coil_radius": 0.5 * FIBRE.radius}, "spring index above 1"),
        ({"coil_radius": math.nan}, "coil_radius"),
        ({"fibre_length": -0.175}, "fibre_length"),
        ({"fibre_length": 1j}, "fibre_length"),
        ({"pitch_angle": 1.6}, "pitch_angle"),
        ({"breaking_force": 0.0}, "breaking_force"),
    ],
)
def test_impossible_coils_are_refused(change, match):
    with pytest.raises(ValueError, match=match):
        replace(TCA, **change)


def test_a_negative_length_is_refused_by_all_laws():
    for call in (lambda: tension(TCA, -0.05, 25.0), lambda: coil_tension(TCA, -0.05, 25.0),
                 lambda: TABLES.tension([-0.05], [25.0]), lambda: RODS.tension([-0.05], [25.0]),
                 lambda: BANK.pull(BANK.rest(), [-0.05])):  # fmt: skip
        with pytest.raises(ValueError, match=r"length.* must be .* got .*-0.05"):
            call()

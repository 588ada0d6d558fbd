"""Heat of a shape-memory spine: heater, still air, fan; and the correlations behind the fan."""

import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tca_mj.smp import HeaterSpec, HeaterState, SpineSpec, heat_spine
from tca_mj.smp.convection import Air, Slab, moving_air, radiation, still_air
from tca_mj.smp.heater import COOL_TO, FAN_COOL_TIME, HOLD_TEMPERATURE, fan_gain

SPINE = SpineSpec()
HEATER = HeaterSpec.fitted(SPINE)
HOT = HOLD_TEMPERATURE


def test_the_fan_cools_in_the_reported_time():
    """12 s within 10 %, from the 25 s in still air and the fan's 1 m/s; nothing is fitted to it."""
    time = HEATER.time_to(COOL_TO, HOT, fan=True)
    assert time == pytest.approx(FAN_COOL_TIME, rel=0.10)
    for hold in (110.0, 130.0):  # the unknown hold temperature hardly matters
        other = HeaterSpec.fitted(SPINE, hold_temperature=hold)
        assert other.time_to(COOL_TO, hold, fan=True) == pytest.approx(float(time), rel=0.01)


@pytest.mark.parametrize("factor", [0.3, 1.0, 4.0])
def test_heating_needs_neither_capacity_nor_resistance(factor):
    """t = τ ln(r/(r - 1)) from ambient to the hold temperature, r = (25 V/9.5 V)²."""
    spine = replace(SPINE, smp=replace(SPINE.smp, specific_heat=factor * 1300.0))
    heater = HeaterSpec.fitted(spine)
    ratio, tau = (25.0 / 9.5) ** 2, 25.0 / math.log(95.0 / 55.0)
    expected = tau * math.log(ratio / (ratio - 1.0))
    assert heater.time_to(HOT, 25.0, 25.0) == pytest.approx(expected, rel=1e-12)
    assert expected == pytest.approx(7.13, abs=0.01)


def test_the_simulated_spine_takes_the_times_of_the_closed_forms():
    """Heat at 25 V, hold 10 s at 9.5 V, cool with and without fan, in steps of 10 ms."""

    def until(state, voltage, fan, done):
        time = 0.0
        while not done(state.temperature[0]):
            state, time = heat_spine(HEATER, state, voltage, fan, 0.01), time + 0.01
        return state, time

    state, time = until(HeaterState.rest(HEATER, (1,)), 25.0, False, lambda at: at >= HOT)
    assert time == pytest.approx(7.13, abs=0.02)
    held = heat_spine(HEATER, state, 9.5, False, 10.0)
    assert held.temperature[0] == pytest.approx(HOT, abs=0.2)
    assert until(held, 0.0, False, lambda at: at <= 80.0)[1] == pytest.approx(25.0, abs=0.1)
    fan = float(HEATER.time_to(80.0, HOT, fan=True))
    assert until(held, 0.0, True, lambda at: at <= 80.0)[1] == pytest.approx(fan, abs=0.1)


def test_9_5_volts_hold_and_25_volts_must_be_switched_off():
    assert HEATER.settled(9.5) == pytest.approx(HOT, rel=1e-12)
    rise = (25.0 / 9.5) ** 2 * (HOT - 25.0)
    assert HEATER.settled(25.0) - 25.0 == pytest.approx(rise, rel=1e-12)
    assert HEATER.time_to(150.0, 25.0, 9.5) == math.inf
    times = HEATER.time_to([20.0, 25.0, HOT, 130.0, 80.0], HOT)
    np.testing.assert_allclose(times, [math.inf, math.inf, 0.0, math.inf, 25.0], rtol=1e-12)
    assert HEATER.time_to(25.0, 25.0) == 0.0


def test_energy_and_subdivision_of_a_batch():
    """Four spines with their own fans: in = stored + lost; two half steps are one."""
    heater = replace(HEATER, loss=HEATER.loss * np.array([1.0, 0.8, 1.2, 1.0]))
    voltage, fan = np.array([[25.0, 9.5, 0.0, 5.0]]), np.array([True, False, True, False])
    start = replace(HeaterState.rest(heater, (3, 4)), temperature=np.full((3, 4), 90.0))
    whole = heat_spine(heater, start, voltage, fan, 3.0)
    half = heat_spine(heater, heat_spine(heater, start, voltage, fan, 1.5), voltage, fan, 1.5)
    np.testing.assert_allclose(half.temperature, whole.temperature, rtol=1e-13)
    stored = heater.capacity * (whole.temperature - start.temperature)
    np.testing.assert_allclose(whole.energy_in, stored + whole.energy_lost, rtol=1e-9, atol=1e-9)
    assert (whole.temperature[:, 2] < 90.0).all() and whole.temperature.shape == (3, 4)
    alone = heat_spine(HEATER, replace(start, temperature=np.array([90.0])), 25.0, True, 3.0)
    assert alone.temperature[0] == whole.temperature[0, 0]


def test_correlations_against_a_textbook():
    """Incropera et al., Fundamentals of Heat and Mass Transfer, Examples 7.4, 9.4, Table A.4."""
    assert moving_air(12.7e-3, 10.0, 128.4, 26.2) == pytest.approx(96.0, rel=0.02)
    radiated = math.pi * 0.1 * 142.0 * radiation(165.0, 23.0, emissivity=0.85)
    assert radiated == pytest.approx(441.0, rel=0.005)
    air = Air(temperature=26.85)
    assert air.viscosity == pytest.approx(15.89e-6, rel=0.02)
    assert air.conductivity == pytest.approx(26.3e-3, rel=0.01)
    assert air.prandtl == pytest.approx(0.707, rel=0.01)


def test_correlations_against_others():
    """Hilpert (1933), Re 40 to 4000, and Morgan (1975), Ra 100 to 10000, for this spine.

    Morgan's still air takes 18 % more heat; the fan would then need 12.4 s instead of 11.3 s.
    """
    diameter, air = SPINE.equivalent_diameter, Air(temperature=61.5)
    reynolds = 1.0 * diameter / air.viscosity
    hilpert = 0.683 * reynolds**0.466 * air.prandtl ** (1 / 3) * air.conductivity / diameter
    assert moving_air(diameter, 1.0, 98.0, 25.0) == pytest.approx(hilpert, rel=0.05)
    buoyancy = 9.81 * (98.0 - 25.0) / (273.15 + 61.5)
    rayleigh = buoyancy * diameter**3 * air.prandtl / air.viscosity**2
    morgan = 0.850 * rayleigh**0.188 * air.conductivity / diameter
    assert still_air(diameter, 98.0, 25.0) == pytest.approx(morgan, rel=0.2)


@pytest.mark.parametrize(("biot", "root", "amplitude"), [
    (0.1, 0.3111, 1.0161), (1.0, 0.8603, 1.1191), (10.0, 1.4289, 1.2620)])  # fmt: skip
def test_a_plate_against_a_textbook(biot, root, amplitude):
    """Incropera et al., Table 5.1."""
    slab = Slab(thickness=2.0, conductivity=1.0, capacity=1.0, coefficient=biot)
    assert slab.biot == biot
    assert slab.root == pytest.approx(root, abs=6e-5)
    time = slab.centre_time(4.0)
    assert amplitude * math.exp(-(root**2) * time) == pytest.approx(0.25, rel=1e-3)


def test_a_thin_plate_is_lumped():
    slab = Slab(thickness=1e-4, conductivity=0.2, capacity=1.5e6, coefficient=20.0)
    assert slab.time_constant == pytest.approx(1.5e6 * 1e-4 / (2.0 * 20.0), rel=2e-3)


def test_a_breath_of_air_is_no_worse_than_still_air():
    assert fan_gain(SPINE, 1e-3, HOT, 25.0) == 1.0
    gains = [fan_gain(SPINE, speed, HOT, 25.0) for speed in (0.5, 1.0, 2.0)]
    assert gains == sorted(gains)


def test_the_fitted_loss_is_what_still_air_takes():
    """Not fitted: capacity by mass, area by the printed section, against the correlation."""
    area = 2.0 * (SPINE.width + SPINE.module_height) * SPINE.length
    handbook = still_air(SPINE.equivalent_diameter, 98.0, 25.0) + radiation(98.0, 25.0)
    assert HEATER.loss / area == pytest.approx(handbook, rel=0.25)


@pytest.mark.parametrize(("field", "value"), [
    ("capacity", 0.0), ("loss", -1.0), ("fan_gain", 0.9), ("resistance", 0.0),
    ("resistance", math.nan), ("ambient", -300.0)])  # fmt: skip
def test_a_heater_checks_itself(field, value):
    with pytest.raises(ValueError, match=field):
        replace(HEATER, **{field: value})
    with pytest.raises(ValueError, match="hold_temperature"):
        HeaterSpec.fitted(SPINE, hold_temperature=79.0)


def test_the_tables_of_the_page_are_what_the_script_prints():
    """After a change: python scripts/shape_memory.py --tables, and copy."""
    pytest.importorskip("matplotlib")
    root = Path(__file__).resolve().parent.parent
    script = runpy.run_path(str(root / "scripts" / "shape_memory.py"))
    page = (root / "docs" / "shape-memory.md").read_text(encoding="utf-8")
    for table in script["heat_tables"]():
        assert table in page

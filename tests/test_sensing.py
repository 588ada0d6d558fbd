"""Self-sensing: resistance curves, the polynomial that reads them, noise and pulses."""

import math

import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    Heating,
    Load,
    LoadedTcas,
    LoadState,
    WireTable,
    resistance,
    sensed_length,
)
from tca_mj.tca.arrays import FEW
from tca_mj.tca.sensing.sensor import (
    CurrentSensor,
    measured,
    moving_average,
    pulse_mean,
    pulse_power,
)
from tca_mj.tca.sensing.wire import (
    SensingSpec,
    fit_displacement,
    resistance_displacement,
)

# Sun, Table 2.3: natural length 110 mm, 6.7 ohm/dm made: 133.5 mm for 109 mm (Table 2.1).
TCA = CATALOGUE["type-2-180"].of_length(0.110)
WIRE = WireTable.of([TCA])
NO_LOAD = SensingSpec(load=0.0)
OHMS = 67.0 * 0.1335 * 110.0 / 109.0
SLOPE = 0.20 / 0.357 * OHMS / 0.110  # about 20 % over the free stroke of 35.7 % [ohm/m]


def stretched(load):
    return LoadedTcas([TCA], Load(force=load)).equilibrium(np.full(load.shape, 25.0))


def test_resistance_rises_with_contraction_by_what_is_published():
    """About 20 % over the free stroke of 35.7 % (Sun, Section 3.1.1 and Table 2.1)."""
    ohms = resistance_displacement(WIRE, np.array([[0.0], [0.357 * 0.110]]), sensing=NO_LOAD)
    assert ohms[0, 0] == pytest.approx(OHMS, rel=1e-12)
    assert ohms[1, 0] == pytest.approx(1.2 * OHMS, rel=1e-12)


def test_a_cold_pull_changes_it_by_what_is_published():
    """0.55 ohm for 50 % of a TCA of 109 mm (Sun, Section 2.3.1), and the kink at its length."""
    tca = CATALOGUE["type-2-180"]
    wire = WireTable.of([tca])
    at = tca.rest_length * np.array([[1.0], [1.5], [0.9]])
    rest, pulled, short = resistance(wire, at, 25.0)[:, 0]
    assert rest - pulled == pytest.approx(0.55, rel=1e-12)
    assert wire.contraction[0] > 4.0 * wire.stretch[0] > 0.0
    assert short - rest == pytest.approx(0.1 * 0.20 / 0.357 * rest, rel=1e-12)


def test_the_load_term_is_the_elastic_stretch():
    """A load stretches the cold TCA; its resistance falls by the cold slope. To 5 %."""
    for load in (0.05, 0.1):
        pulled = resistance(WIRE, stretched(np.array([[load]])), 25.0)[0, 0]
        heated = resistance_displacement(WIRE, [[0.0]], load)[0, 0]
        assert OHMS - heated == pytest.approx(OHMS - pulled, rel=0.05)


def test_without_a_load_it_is_the_law_of_the_length():
    length = np.linspace(0.05, 0.11, 11)[:, None]
    np.testing.assert_allclose(
        resistance_displacement(WIRE, TCA.rest_length - length), resistance(WIRE, length, 25.0),
        rtol=1e-14,
    )  # fmt: skip


def test_curves_over_displacement_nearly_overlap_and_those_over_length_do_not():
    """10 to 50 g: the averaged curve misleads by less than 20 % of a step of 40 mm."""
    loads = 9.81e-3 * np.array([10.0, 20.0, 30.0, 40.0, 50.0])
    displacement = np.linspace(0.0, 0.04, 21)[:, None]
    curves = resistance_displacement(WIRE, displacement, loads)
    off = (curves - curves.mean(axis=1, keepdims=True)) / SLOPE
    assert 0.0 < np.abs(off).max() < 0.2 * 0.040
    assert np.all(loads < 0.7 * TCA.breaking_force)  # what was measured, Sun, Section 2.3.1
    starts = stretched(loads[:, None])[:, 0]
    length = 0.12
    over_length = resistance_displacement(WIRE, starts - length, loads)
    assert np.ptp(over_length) > 2.0 * np.ptp(curves[0])
    assert np.all(np.diff(over_length) > 0.0)  # the heavier, the more it has contracted there


def test_the_curve_does_not_depend_on_the_speed():
    """The same weight lifted by 12 V and by 8 V: one resistance at one length."""
    tcas = LoadedTcas([TCA], Load.weight(0.02, 0.05))
    curves = []
    for volts, dt in ((12.0, 1e-3), (8.0, 2e-3)):
        course = tcas.simulate(tcas.rest(), Heating(source="voltage", value=volts), dt, 150)
        state = LoadState(course.length, course.velocity, course.temperature, course.power)
        curves.append((course.length[:, 0], tcas.resistance(state)[:, 0]))
    (fast, fast_ohms), (slow, slow_ohms) = curves
    order = np.argsort(fast)
    inside = slow > fast.min()
    assert np.ptp(slow[inside]) > 1e-3
    there = np.interp(slow[inside], fast[order], fast_ohms[order])
    np.testing.assert_allclose(slow_ohms[inside], there, rtol=1e-9)


def test_a_load_on_a_cold_tca_lowers_its_resistance():
    loads = np.linspace(0.0, 0.4, 9)[:, None]
    ohms = resistance(WIRE, stretched(loads), 25.0)
    assert ohms[0, 0] == pytest.approx(OHMS, rel=1e-9)
    assert np.all(np.diff(ohms[:, 0]) < 0.0)
    np.testing.assert_allclose(sensed_length(WIRE, ohms), stretched(loads), rtol=1e-12)


def test_terms_of_load_and_temperature():
    sensing = SensingSpec(load=0.1, temperature=1e-3)
    base = resistance_displacement(WIRE, [0.02], sensing=sensing)
    np.testing.assert_array_equal(base, resistance_displacement(WIRE, [0.02]))
    np.testing.assert_allclose(
        resistance_displacement(WIRE, [0.02], 0.5, sensing=sensing), base - 0.05 * OHMS
    )
    np.testing.assert_allclose(
        resistance_displacement(WIRE, [0.02], 0.0, 125.0, sensing), base + 0.1 * OHMS
    )


def test_a_cubic_is_fitted_exactly():
    rng = np.random.default_rng(1)
    ohms = rng.uniform(7.0, 8.0, 50)
    truth = np.polynomial.Polynomial([0.01, -0.2, 0.05, 0.003])
    fit = fit_displacement(ohms, truth(ohms))
    assert fit.rmse < 1e-13
    points = np.array([7.1, 7.9])
    np.testing.assert_allclose(fit.displacement(points), truth(points), atol=1e-12)
    assert (fit.lowest, fit.highest) == (ohms.min(), ohms.max())
    quintic = np.polynomial.Polynomial([0.0, 0.0, 0.0, 0.0, 0.0, 1e-6])
    third = fit_displacement(ohms, quintic(ohms))
    assert fit_displacement(ohms, quintic(ohms), 5).rmse < 1e-3 * third.rmse


def test_the_error_of_the_fit_is_that_of_the_noise():
    """RMSE = sigma_R / (dR/dD) but for the 4 coefficients: 0.22 mm reported at 20 g."""
    rng = np.random.default_rng(2)
    displacement = np.linspace(0.0, 0.04, 400)
    true = resistance_displacement(WIRE, displacement[:, None], 0.02 * 9.81)[:, 0]
    rmses = []
    for _ in range(20):
        fit = fit_displacement(measured(true, 12.0, rng), displacement)
        rmses.append(fit.rmse)
    sensor = CurrentSensor()
    sigma_current = math.hypot(sensor.noise, sensor.resolution / math.sqrt(12.0))
    theory = np.mean(true**2) / 12.0 * sigma_current / SLOPE
    assert np.mean(rmses) == pytest.approx(theory, rel=0.05)
    assert np.mean(rmses) == pytest.approx(0.2184e-3, rel=0.1)


def test_a_perfect_sensor_measures_the_resistance():
    perfect = CurrentSensor(resolution=0.0, noise=0.0)
    ohms = np.array([3.0, 7.37])
    rng = np.random.default_rng(0)
    np.testing.assert_allclose(measured(ohms, 12.0, rng, perfect, duty=0.3), ohms, rtol=1e-15)
    off = CurrentSensor(resolution=0.0, noise=0.0, gain_error=0.01)
    np.testing.assert_allclose(measured(ohms, 12.0, rng, off), ohms / 1.01, rtol=1e-14)


def test_the_steps_of_the_sensor():
    """The current is a whole number of steps, at most half a step off."""
    stepped = CurrentSensor(noise=0.0)
    ohms = np.linspace(7.0, 8.0, 200)
    current = 0.8 / measured(ohms, 0.8, np.random.default_rng(0), stepped)
    steps = current / stepped.resolution
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.abs(current - 0.8 / ohms).max() <= 0.5 * stepped.resolution * (1.0 + 1e-9)


def test_noise_is_reproducible_unbiased_and_of_its_size():
    sensor = CurrentSensor(resolution=0.0, noise=1e-3)
    ohms = np.full(20_000, 7.37)
    first = measured(ohms, 12.0, np.random.default_rng(5), sensor)
    np.testing.assert_array_equal(first, measured(ohms, 12.0, np.random.default_rng(5), sensor))
    sigma = 1e-3 * 7.37**2 / 12.0
    assert first.std() == pytest.approx(sigma, rel=0.03)
    assert abs(first.mean() - 7.37) < 4.0 * sigma / math.sqrt(20_000)


def test_pulses_are_averaged_exactly_over_whole_periods():
    duty = np.linspace(0.0, 1.0, 11)
    for phase in (0.0, 0.3, -2.7):
        np.testing.assert_allclose(pulse_mean(duty, 40.0, phase), duty, atol=1e-14)


def test_a_cut_pulse_is_off_by_less_than_its_bound():
    rng = np.random.default_rng(3)
    duty, phase = rng.random(2000), rng.random(2000)
    periods = rng.uniform(0.1, 20.0, 2000)
    error = np.abs(pulse_mean(duty, periods, phase) - duty)
    assert np.all(error <= duty * (1.0 - duty) / periods + 1e-14)
    time = (np.arange(100_000) + 0.5) / 100_000 * 3.7 + 0.4
    assert pulse_mean(0.35, 3.7, 0.4) == pytest.approx(np.mean(time % 1.0 < 0.35), abs=1e-4)
    # A window of one and a half pulses of 0.25 ms reads a third too much current.
    perfect = CurrentSensor(resolution=0.0, noise=0.0)
    ohms = measured([7.37], 12.0, np.random.default_rng(0), perfect, duty=0.5, window=0.375e-3)
    assert ohms[0] == pytest.approx(7.37 * 0.5 * 1.5, rel=1e-12)


def test_pulsed_power_is_that_of_the_wave():
    """duty V^2/R: the square is averaged, not the mean squared."""
    assert pulse_power(12.0, 0.25, 7.2) == pytest.approx(5.0, rel=1e-15)
    on = np.arange(1000) < 250
    assert pulse_power(12.0, 0.25, 7.2) == pytest.approx(np.mean((12.0 * on) ** 2 / 7.2), rel=1e-12)


def test_moving_average_of_a_step_and_of_noise():
    np.testing.assert_allclose(
        moving_average(np.ones(30), 10, start=0.0), 1.0 - 0.9 ** np.arange(1, 31), rtol=1e-13
    )
    np.testing.assert_array_equal(moving_average([3.0, 3.0], 5), [3.0, 3.0])
    noise = np.random.default_rng(0).standard_normal((4000, 50))
    late = moving_average(noise, 10)[100:]
    assert late.std() == pytest.approx(1.0 / math.sqrt(19.0), rel=0.02)
    np.testing.assert_allclose(moving_average(noise, 1), noise, atol=1e-14)


def test_bad_inputs_are_refused():
    rng = np.random.default_rng(0)
    for bad in (math.nan, math.inf, -1.0):
        with pytest.raises(ValueError):
            resistance_displacement(WIRE, bad)
        with pytest.raises(ValueError, match="load"):
            resistance_displacement(WIRE, 0.01, bad)
        with pytest.raises(ValueError, match="resistance"):
            measured([bad], 12.0, rng)
        with pytest.raises(ValueError, match="voltage"):
            measured([7.0], bad, rng)
        with pytest.raises(ValueError, match="duty"):
            measured([7.0], 12.0, rng, duty=bad)
        with pytest.raises(ValueError, match="window"):
            measured([7.0], 12.0, rng, window=bad)
        with pytest.raises(ValueError, match="duty"):
            pulse_mean(bad, 1.0)
        with pytest.raises(ValueError, match="periods"):
            pulse_mean(0.5, bad)
        with pytest.raises(ValueError, match="duty"):
            pulse_power(1.0, bad, 1.0)
        with pytest.raises(ValueError, match="resistance"):
            pulse_power(1.0, 0.5, bad)
        with pytest.raises(ValueError, match="load"):
            SensingSpec(load=bad)
        for name in ("resolution", "noise", "pulse_frequency", "gain_error"):
            with pytest.raises(ValueError, match=name):
                CurrentSensor(**{name: bad})
    with pytest.raises(ValueError, match="temperature"):
        resistance_displacement(WIRE, 0.01, temperature=math.nan)
    with pytest.raises(ValueError, match="mean current must be"):
        measured([7.37], 0.01, rng)  # 1.4 mA: less than two steps of the sensor
    with pytest.raises(ValueError, match="voltage"):
        pulse_power(math.nan, 0.5, 1.0)
    with pytest.raises(ValueError, match="phase"):
        pulse_mean(0.5, 1.0, math.inf)
    with pytest.raises(ValueError, match="shape"):
        fit_displacement([1.0, 2.0], [1.0])
    with pytest.raises(ValueError, match="degree"):
        fit_displacement([1.0, 2.0, 2.0, 3.0], [1.0, 2.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="finite"):
        fit_displacement([1.0, math.nan, 2.0, 3.0, 4.0], [1.0, 2.0, 2.0, 3.0, 1.0])
    with pytest.raises(ValueError, match="resistance"):
        fit_displacement(*np.arange(10.0).reshape(2, 5)).displacement(math.nan)
    with pytest.raises(ValueError, match="count"):
        moving_average([1.0], 0)
    for values in (1.0, [math.nan]):
        with pytest.raises(ValueError, match="values"):
            moving_average(values, 2)


@pytest.mark.parametrize("n", [1, FEW, FEW + 1])
def test_resistances_of_few_are_to_the_bit_those_of_many(n):
    """Also where there is none: it is no number then, or refused."""
    specs = (list(CATALOGUE.values()) * 2)[:n]
    wire, rng = WireTable.of(specs), np.random.default_rng(n)
    length = wire.rest_length * rng.uniform(0.4, 2.5, (200, n))
    length[::10, 0], length[5, -1], length[7, 0] = -0.01, math.inf, math.nan
    warm = rng.uniform(0.0, 180.0, (200, n))
    every = resistance(wire, length, warm, strict=False)
    each = np.array([
        resistance(wire, *pair, strict=False) for pair in zip(length, warm, strict=True)
    ])  # fmt: skip
    assert each.tobytes() == every.tobytes() and np.isnan(each[::10, 0]).all()
    for bad in (-0.01, math.inf, math.nan):
        with pytest.raises(ValueError, match="must be"):
            resistance(wire, np.full(n, bad), warm[0])

"""Heat balance: exact in time, closed in energy."""

import math

import numpy as np
import pytest

from tca_mj.tca import HeatSpec, heat_lost, power_from_voltage, step_temperature

HEAT = HeatSpec(capacity=0.04, loss=0.0133)


def test_temperature_decays_with_the_time_constant():
    tau = HEAT.capacity / HEAT.loss
    assert HEAT.time_constant == tau
    excess = step_temperature(125.0, 0.0, HEAT, tau) - 25.0
    assert excess == pytest.approx(100.0 / math.e, rel=1e-14)


def test_power_settles_at_the_balance_of_heat():
    """P = λ (T - T_amb) after a long time, P t / C at once."""
    assert step_temperature(25.0, 1.33, HEAT, 1e4) == pytest.approx(125.0, rel=1e-14)
    dt = 1e-6
    assert (step_temperature(25.0, 1.33, HEAT, dt) - 25.0) / dt == pytest.approx(
        1.33 / 0.04, rel=1e-6
    )


def test_a_tca_at_rest_stays_at_rest():
    assert step_temperature(25.0, 0.0, HEAT, 0.123) == 25.0
    assert heat_lost(25.0, 0.0, HEAT, 0.123) == 0.0
    assert step_temperature(80.0, 2.0, HEAT, 0.0) == 80.0
    assert heat_lost(80.0, 2.0, HEAT, 0.0) == 0.0


@pytest.mark.parametrize("parts", [2, 7, 1000])
def test_the_subdivision_of_a_step_does_not_matter(parts):
    temperature = np.array([25.0, 150.0, 90.0, 5.0])
    power = np.array([2.0, 0.0, 0.8, 0.1])
    whole = step_temperature(temperature, power, HEAT, 4.0)
    whole_lost = heat_lost(temperature, power, HEAT, 4.0)
    lost = np.zeros(4)
    for _ in range(parts):
        lost += heat_lost(temperature, power, HEAT, 4.0 / parts)
        temperature = step_temperature(temperature, power, HEAT, 4.0 / parts)
    np.testing.assert_allclose(temperature, whole, rtol=1e-12)
    np.testing.assert_allclose(lost, whole_lost, rtol=1e-12)


@pytest.mark.parametrize("dt", [1e-4, 0.02, 1.0, 30.0])
def test_energy_balance(dt):
    """Electrical energy = heat stored + heat lost; the two come from different formulas."""
    rng = np.random.default_rng(1)
    temperature, power = rng.uniform(0.0, 200.0, 50), rng.uniform(0.0, 5.0, 50)
    stored = HEAT.capacity * (step_temperature(temperature, power, HEAT, dt) - temperature)
    lost = heat_lost(temperature, power, HEAT, dt)
    scale = power * dt + np.abs(stored) + np.abs(lost) + HEAT.capacity * np.abs(temperature)
    np.testing.assert_array_less(np.abs(power * dt - stored - lost), 1e-12 * scale)


def test_heat_lost_is_the_integral_of_the_loss():
    """Gauss quadrature of λ (T - T_amb) over the exact course of T."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    dt = 5.0
    course = [float(step_temperature(140.0, 0.7, HEAT, 0.5 * dt * (x + 1.0))) for x in nodes]
    integral = 0.5 * dt * weights @ (0.0133 * (np.array(course) - 25.0))
    assert heat_lost(140.0, 0.7, HEAT, dt) == pytest.approx(integral, rel=1e-12)


def test_constants_may_differ_between_actuators():
    many = HeatSpec(
        capacity=np.array([0.04, 0.7]), loss=np.array([0.01, 0.02]), ambient=np.array([20.0, 30.0])
    )
    temperature, power = np.array([[50.0, 60.0], [70.0, 80.0]]), np.array([[1.0, 2.0], [0.0, 3.0]])
    together = step_temperature(temperature, power, many, 0.5)
    for i, (capacity, loss, ambient) in enumerate([(0.04, 0.01, 20.0), (0.7, 0.02, 30.0)]):
        alone = HeatSpec(capacity=capacity, loss=loss, ambient=ambient)
        np.testing.assert_array_equal(
            together[:, i], step_temperature(temperature[:, i], power[:, i], alone, 0.5)
        )


def test_bad_inputs_are_refused():
    for function in (step_temperature, heat_lost):
        for power in (-1e-9, math.nan, math.inf):
            with pytest.raises(ValueError, match="power"):
                function(25.0, power, HEAT, 0.1)
        for dt in (-0.1, math.nan, math.inf):
            with pytest.raises(ValueError, match="dt"):
                function(25.0, 1.0, HEAT, dt)
        with pytest.raises(ValueError, match="temperature"):
            function(math.nan, 1.0, HEAT, 0.1)
    for field, value in (("capacity", 0.0), ("loss", -1.0), ("ambient", math.nan)):
        with pytest.raises(ValueError, match=field):
            HeatSpec(**{"capacity": 1.0, "loss": 1.0, field: value})
    with pytest.raises(ValueError, match="capacity"):
        HeatSpec(capacity=np.array([1.0, 0.0]), loss=1.0)


def test_power_from_voltage():
    assert power_from_voltage(12.0, 6.0) == 24.0
    assert power_from_voltage(-12.0, 6.0) == 24.0
    for voltage, resistance in ((math.nan, 1.0), (1.0, 0.0), (1.0, math.inf), (1.0, -1.0)):
        with pytest.raises(ValueError):
            power_from_voltage(voltage, resistance)


def test_a_heat_loss_is_scaled_on_all_of_its_ways():
    heat = HeatSpec(capacity=1.0, loss=0.2, conductance=0.3, body_loss=0.4, body_capacity=2.0)
    more = heat.losing(1.5)
    assert more.steady_loss == pytest.approx(1.5 * heat.steady_loss, rel=1e-12)
    assert (more.capacity, more.body_capacity) == (heat.capacity, heat.body_capacity)
    with pytest.raises(ValueError, match="factor must be finite and above 0"):
        heat.losing(0.0)

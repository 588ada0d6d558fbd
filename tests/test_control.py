"""The PI controller: closed forms, limits, wind-up, the change of gains near the goal."""

import math

import numpy as np
import pytest

from tca_mj.control import PiSpec, PiState, pi_rest, pi_step


def course(spec, errors, dt=0.1, shape=()):
    state, outputs = pi_rest(shape), []
    for error in errors:
        state, output = pi_step(spec, state, error, dt)
        outputs.append(output)
    return state, np.array(outputs)


def test_the_output_is_the_sum_of_both_parts():
    """A constant error e over a time t: K_P e + K_I e t."""
    spec = PiSpec(proportional=2.0, integral=0.5, lowest=-10.0)
    _, outputs = course(spec, [3.0] * 20)
    time = 0.1 * np.arange(1, 21)
    np.testing.assert_allclose(outputs, 2.0 * 3.0 + 0.5 * 3.0 * time, rtol=1e-13)


def test_an_integral_leaves_no_error_and_its_absence_does():
    """First-order plant x' = (g u - x)/T: without K_I the error is 1/(1 + g K_P), with it zero.

    With it the slowest mode is a root of T s^2 + (1 + g K_P) s + g K_I = 0.
    """
    gain, lag, dt, goal = 0.5, 2.0, 1e-3, 1.0
    kp, ki = 4.0, np.array([0.0, 0.6])
    spec = PiSpec(proportional=kp, integral=ki, lowest=-100.0)
    state, x, errors = pi_rest((2,)), np.zeros(2), []
    for _ in range(20_000):
        errors.append(goal - x)
        state, u = pi_step(spec, state, goal - x, dt)
        x = x + dt * (gain * u - x) / lag
    assert errors[-1][0] == pytest.approx(1.0 / (1.0 + gain * kp), rel=1e-6)
    slow = (-(1.0 + gain * kp) + math.sqrt((1.0 + gain * kp) ** 2 - 4.0 * lag * gain * ki[1]))
    slow /= 2.0 * lag
    decay = errors[19_000][1] / errors[9_000][1]
    assert decay == pytest.approx(math.exp(slow * 10.0), rel=2e-3)


def test_limits_and_no_wind_up():
    """After 1000 s at the upper limit one step back is enough to leave it."""
    spec = PiSpec(proportional=1.0, integral=1.0, highest=5.0)
    state, outputs = course(spec, [100.0] * 10_000)
    assert np.all(outputs == 5.0)
    assert state.integral == 0.0
    _, output = pi_step(spec, state, 2.0, 0.1)
    assert output == pytest.approx(2.0 + 0.2)
    low, outputs = course(spec, [-100.0] * 100)
    assert np.all(outputs == 0.0) and low.integral == 0.0
    # The integral may go back from a limit that it has reached itself.
    state = PiState(np.array(6.0), np.array(False))
    state, output = pi_step(spec, state, -0.5, 0.1)
    assert state.integral == pytest.approx(5.95) and output == 5.0


def test_gains_change_for_good_and_without_a_jump():
    """Sun, Section 4.2.2: K_P = 20, from an error of 1° on 3."""
    spec = PiSpec(proportional=20.0, integral=0.08, lowest=-1e3, near=1.0, near_proportional=3.0)
    state, outputs = course(spec, [5.0, 2.0, 1.001, 0.999, 0.998, 4.0], dt=1e-3)
    assert state.arrived
    assert outputs[2] == pytest.approx(20.0 * 1.001, rel=1e-3)
    assert abs(outputs[3] - outputs[2]) < 0.05  # 17 without the hand-over
    assert outputs[4] - outputs[3] == pytest.approx(3.0 * -0.001 + 0.08e-3 * 0.998, rel=1e-6)
    assert outputs[5] - outputs[4] == pytest.approx(3.0 * 3.002, rel=1e-3)  # it stays with 3
    never = PiSpec(proportional=20.0, lowest=-1e3)
    assert not course(never, [0.0, 1.0])[0].arrived
    late = PiSpec(proportional=1.0, integral=1.0, lowest=-9.0, near=1.0, near_proportional=1.0,
                  near_integral=0.0)  # fmt: skip
    state, _ = course(late, [0.5] * 10)
    assert state.integral == pytest.approx(0.0)


def test_a_batch_is_its_rows_bit_for_bit():
    rng = np.random.default_rng(0)
    gains = rng.uniform(0.0, 5.0, (2, 4))
    errors = rng.normal(0.0, 3.0, (50, 4))
    together = PiSpec(proportional=gains[0], integral=gains[1], highest=8.0, near=0.5,
                      near_proportional=1.0)  # fmt: skip
    _, outputs = course(together, errors, shape=(4,))
    for i in range(4):
        alone = PiSpec(proportional=gains[0, i], integral=gains[1, i], highest=8.0, near=0.5,
                       near_proportional=1.0)  # fmt: skip
        np.testing.assert_array_equal(course(alone, errors[:, i])[1], outputs[:, i])


def test_bad_inputs_are_refused():
    good = {"proportional": 1.0, "integral": 1.0, "near": 1.0, "near_proportional": 1.0,
            "near_integral": 1.0}  # fmt: skip
    for name in good:
        for value in (-1.0, math.nan, math.inf):
            with pytest.raises(ValueError, match=name):
                PiSpec(**good | {name: value})
    with pytest.raises(ValueError, match="lowest"):
        PiSpec(proportional=1.0, lowest=math.nan)
    for highest in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="highest"):
            PiSpec(proportional=1.0, highest=highest)
    with pytest.raises(ValueError, match="error"):
        pi_step(PiSpec(proportional=1.0), pi_rest(), math.nan, 0.1)
    for dt in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="dt"):
            pi_step(PiSpec(proportional=1.0), pi_rest(), 1.0, dt)

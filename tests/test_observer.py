"""Temperature, length and tension from voltage and current: the filter against its own theory."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    MODULE_TCAS,
    Estimate,
    HeatStep,
    ObserverSpec,
    TcaBank,
    TcaObserver,
    in_silicone,
)

SENSING = MODULE_TCAS["sensing"]
WEIGHT = 0.02 * 9.81  # [N]
STROKE = SENSING.free_stroke * SENSING.rest_length
DT, RUNS = 0.05, 60
KNOWN = [0, 2, 3]  # of a bare TCA, whose body is the air


@pytest.fixture(scope="module")
def bank():
    return TcaBank([SENSING], law="surface")


def steps(mean, share, half, count):
    """Powers that go from one side of a mean to the other."""
    side = 1.0 - 2.0 * ((DT * np.arange(count)) % (2.0 * half) >= half - 1e-9)
    return mean * (1.0 + share * side)


def drawn(observer, powers, seed=0, runs=RUNS, ratio=None, spec=None):
    """True states, shape (k + 1, 4, runs, 1), and loads, drawn from what the filter believes."""
    rng, spec, bank = np.random.default_rng(seed), spec or observer.spec, observer.bank
    wander = np.sqrt(DT) * rng.standard_normal((2, len(powers), runs, 1))
    ratio = 1.0 + spec.loss_error * rng.standard_normal((runs, 1)) if ratio is None else ratio
    ratio = np.broadcast_to(ratio, (runs, 1))
    step = HeatStep.of(replace(bank.heat, loss=bank.heat.loss / ratio), DT)
    warm = 25.0 + spec.start_error * rng.standard_normal((runs, 1))
    load, air = np.full((runs, 1), WEIGHT), np.full((runs, 1), 25.0)
    states, loads = [np.stack([warm, air, observer.under_load(warm, load), ratio])], [load]
    for power, kelvin, newton in zip(powers, *wander, strict=True):
        warm = step.advance(warm, air, power + 0.0 * warm)[0] + spec.temperature_rate * kelvin
        load = load + spec.tension_rate * newton
        states.append(np.stack([warm, air, observer.under_load(warm, load), ratio]))
        loads.append(load)
    return np.array(states), np.array(loads), rng


def followed(observer, states, powers, rng, noise=10e-3):
    """Estimates and tensions after each step, from noisy resistances."""
    bank = observer.bank
    ohms = np.array([bank.resistance(replace(bank.rest(s[0].shape[:-1]), temperature=s[0]), s[2])
                     for s in states])  # fmt: skip
    ohms = ohms + noise * rng.standard_normal(ohms.shape)
    estimate = observer.begin(ohms[0])
    found = []
    for power, reading in zip(powers, ohms[1:], strict=True):
        estimate = observer.corrected(observer.predicted(estimate, power, DT), reading)
        found.append((estimate, observer.tension(estimate).tension))
    return [each for each, _ in found], np.array([tension for _, tension in found])


def nees(estimates, states):
    """Squared error over its covariance, (k, runs): of mean 3 for 3 states that are as sure."""
    found = []
    for estimate, state in zip(estimates, states[1:], strict=True):
        error = (estimate.mean - state)[KNOWN][..., 0]
        spread = np.moveaxis(estimate.covariance[np.ix_(KNOWN, KNOWN)][..., 0], -1, 0)
        found.append(np.einsum("ir,rij,jr->r", error, np.linalg.inv(spread), error))
    return np.array(found)


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def test_loads_that_vary_by_half_are_followed_by_voltage_and_current_alone(bank):
    """10 seeds, 10 mohm of noise in each reading of 100 Hz (bandwidth 50 Hz), nominal heat loss:
    tension within 5 % of the mean load, length within 2 % of the stroke, root of the mean square.
    """
    dt, seeds, count = 0.01, 10, 800
    observer, rng = TcaObserver(bank), np.random.default_rng(0)
    time = dt * np.arange(count + 1)
    phase = rng.uniform(0.0, 2.0 * np.pi, (seeds, 3))
    swing = np.sin(2.0 * np.pi * np.array([0.11, 0.23, 0.47]) * time[:, None, None] + phase).sum(-1)
    load = WEIGHT * (1.0 + 0.5 * swing / np.abs(swing).max(axis=0))[..., None]
    assert load.min() == pytest.approx(0.5 * WEIGHT, rel=0.2)
    step, warm = HeatStep.of(bank.heat, dt), np.full((seeds, 1), 25.0)
    exact = TcaBank([SENSING])  # the truth follows the rod, the filter its table
    truth = TcaObserver(exact)
    length = truth.under_load(warm, load[0])
    state = exact.rest((seeds,))

    def reading(volts):
        noisy = exact.resistance(state, length) + 10e-3 * rng.standard_normal((seeds, 1))
        return np.full_like(noisy, volts), volts / noisy

    estimate = observer.begin(np.divide(*reading(0.8)))
    off = []
    for now in load[1:]:
        power = 7.0**2 / exact.resistance(state, length)
        warm = step.advance(warm, warm, power)[0]
        state, length = replace(state, temperature=warm), truth.under_load(warm, now)
        estimate = observer.step(estimate, *reading(7.0), dt)
        tension = observer.tension(estimate).tension
        off.append([(tension - now) / WEIGHT, (estimate.length - length) / STROKE])
    late = rms(np.array(off)[100:, ..., 0], axis=0)
    assert warm.max() > 110.0
    assert late[0].max() < 0.05 and late[1].max() < 0.02


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_errors_are_as_large_as_the_filter_says_and_as_the_bound_allows(bank, share):
    """With a heat loss that is off by 20 %: consistent (NEES), and within 1.2 times the bound."""
    observer = TcaObserver(bank, ObserverSpec(loss_error=0.2, tension_rate=0.03))
    powers = steps(50.0 * bank.heat.loss[0], share, 2.0, 300)
    states, loads, rng = drawn(observer, powers)
    estimates, tension = followed(observer, states, powers, rng)
    late = slice(150, None)
    # Means over 60 independent runs, chi squared with 180 degrees of freedom: 2.4 to 3.6 in 95 %.
    assert 2.2 < nees(estimates, states)[late].mean() < 3.8
    bound = observer.bound(states, np.broadcast_to(powers[:, None, None], (300, RUNS, 1)), DT)
    error = rms((tension - loads[1:])[late])
    assert 0.7 < error / rms(bound[2][late]) < 1.2


def test_a_filter_that_believes_a_wrong_heat_loss_or_noise_is_found_out(bank):
    """The planted errors: nominal loss believed where it is off, and half of the noise."""
    told = ObserverSpec(loss_error=0.2, tension_rate=0.03)
    powers = steps(50.0 * bank.heat.loss[0], 0.0, 2.0, 200)
    for spec, noise in ((replace(told, loss_error=0.0), 10e-3), (told, 20e-3)):
        observer = TcaObserver(bank, spec)
        states, _, rng = drawn(observer, powers, spec=told)
        estimates, _ = followed(observer, states, powers, rng, noise)
        if spec.loss_error == 0.0:  # then the loss itself has no variance
            error = np.array([e.temperature - s[0] for e, s in zip(estimates, states[1:],
                                                                   strict=True)])  # fmt: skip
            sure = np.array([e.deviation[0] for e in estimates])
            assert np.mean(np.square(error / sure)[100:]) > 5.0
        else:
            assert nees(estimates, states)[100:].mean() > 5.0


def test_at_rest_resistance_cannot_tell_load_from_heat_and_steps_of_power_can(bank):
    observer = TcaObserver(bank, ObserverSpec(loss_error=0.2, tension_rate=0.003))
    mean = 50.0 * bank.heat.loss[0]
    assert observer.rank(75.0, WEIGHT, np.full(100, mean), DT) == 2
    assert observer.rank(75.0, WEIGHT, steps(mean, 0.5, 2.0, 100), DT) == 3

    # From rest, of which nothing but the length is known, the loss stays what it was believed.
    def left(share):
        powers = steps(mean, share, 2.0, 200)[:, None]
        warm = np.array([75.0])
        truth = [np.array([[75.0], [25.0], observer.under_load(warm, np.array([WEIGHT])), [1.0]])]
        step = HeatStep.of(bank.heat, DT)
        for power in powers:
            warm = step.advance(warm, np.array([25.0]), power)[0]
            length = observer.under_load(warm, np.array([WEIGHT]))
            truth.append(np.stack([warm, [25.0], length, [1.0]]))
        unknown = TcaObserver(bank, replace(observer.spec, start_error=10.0))
        return unknown.bound(np.array(truth), powers, DT)[0, -1, 0]

    assert left(0.0) > 6.0  # of 10 K, which 20 % of 50 K are
    assert left(0.5) < 0.25 * left(0.0)


EMBEDDED = in_silicone(CATALOGUE["free-stroke"], section=3e-5, perimeter=0.02)


@pytest.mark.parametrize("bandwidth", [0.0, 2.0])
@pytest.mark.parametrize("tca", [SENSING, EMBEDDED])
def test_the_filter_is_linearised_as_the_model_is(tca, bandwidth):
    """Derivatives of the state after a step, by those of the state before, one by one."""
    spec = ObserverSpec(loss_error=0.2, load_stiffness=5.0, load_bandwidth=bandwidth)
    observer = TcaObserver(TcaBank([tca]), spec)
    body = 40.0 if tca.body else 25.0
    mean = np.array([[90.0], [body], [0.95 * tca.rest_length], [1.1], [0.6]])
    mean = mean if bandwidth else mean[:4]
    _, jacobian, _, _ = observer._moved(mean, np.array(1.5), 0.1)
    for j, size in enumerate((0.05, 0.05, 1e-5, 1e-3, 1e-3)[: len(mean)]):
        ends = []
        for sign in (-1.0, 1.0):
            moved = mean.copy()
            moved[j] += sign * size
            ends.append(observer._moved(moved, np.array(1.5), 0.1)[0])
        slope = (ends[1] - ends[0])[:, 0] / (2.0 * size)
        assert jacobian[:, j, 0] == pytest.approx(slope, rel=2e-3, abs=1e-9), j


def test_a_load_that_stays_keeps_the_tension_while_the_tca_heats(bank):
    observer = TcaObserver(bank)
    warm = np.array([60.0])
    length = observer.under_load(warm, np.array([WEIGHT]))
    estimate = Estimate(np.stack([warm, [25.0], length, [1.0]]), np.zeros((4, 4, 1)))
    later = observer.predicted(estimate, 8.0, 0.2)
    assert later.temperature[0] > 80.0
    assert observer.tension(later).tension == pytest.approx([WEIGHT], rel=1e-4)


def test_a_load_comes_back_to_the_mean_that_is_believed(bank):
    """As exp(-2 pi f t), whatever the heat does; and its scatter to rate / sqrt(4 pi f)."""
    observer = TcaObserver(bank, ObserverSpec(load_bandwidth=0.5, temperature_rate=0.0))
    warm, load = np.array([60.0]), np.array([1.3 * WEIGHT])
    mean = np.stack([warm, [25.0], observer.under_load(warm, load), [1.0], [WEIGHT]])
    estimate = Estimate(mean, np.zeros((5, 5, 1)))
    for _ in range(4):
        estimate = observer.predicted(estimate, 8.0, 0.05)
    left = 0.3 * WEIGHT * np.exp(-np.pi * 0.2)
    assert observer.tension(estimate).tension == pytest.approx([WEIGHT + left], rel=1e-4)
    for _ in range(400):
        estimate = observer.predicted(estimate, 8.0, 0.05)
    tension, scatter = observer.tension(estimate)
    assert tension == pytest.approx([WEIGHT], rel=1e-6)
    assert scatter == pytest.approx([0.1 / np.sqrt(2.0 * np.pi)], rel=1e-3)
    assert estimate.deviation[4, 0] == 0.0
    wanders = TcaObserver(bank, replace(observer.spec, mean_rate=0.02))
    later = wanders.predicted(estimate, 8.0, 0.25)
    assert later.deviation[4, 0] == pytest.approx(0.01)


@pytest.mark.parametrize("bandwidth", [0.0, 1.0])
def test_at_rest_the_bound_is_what_the_heat_loss_leaves_open(bank, bandwidth):
    """Constant power tells nothing: the force stays as uncertain as F_T (T - T_amb) dr, and a load
    that comes back to an unknown mean changes nothing of that."""
    spec = ObserverSpec(
        loss_error=0.2, tension_rate=0.003, load_bandwidth=bandwidth, start_error=0.0,
        temperature_rate=0.0,
    )  # fmt: skip
    observer, warm = TcaObserver(bank, spec), np.array([75.0])
    length = observer.under_load(warm, np.array([WEIGHT]))
    state = np.stack([warm, [25.0], length, [1.0], [WEIGHT]])[: 5 if bandwidth else 4]
    power = 50.0 * bank.heat.loss[0]
    truth = np.broadcast_to(state, (1201, *state.shape))
    bound = observer.bound(truth, np.full((1200, 1), power), 0.01, steady_power=power)
    by_heat = observer._law(length, warm)[2]
    assert bound[0, -1] == pytest.approx([10.0], rel=1e-3)
    assert bound[2, -1] == pytest.approx(10.0 * np.abs(by_heat), rel=0.03)
    told = observer.bound(truth, np.full((1200, 1), power), 0.01)  # who knows the temperature
    assert told[2, -1] < 0.2 * bound[2, -1]


def test_a_reading_across_the_kink_of_the_resistance_is_weighed_as_it_should_be(bank):
    """The most likely state, sought on a grid: below the natural length the coils touch, and ten
    milliohms are 0.2 mm in place of 1 mm."""
    observer = TcaObserver(bank, ObserverSpec(tension_rate=1.0))
    rest = SENSING.rest_length
    grid = rest + 1e-6 * np.arange(-8000, 8001)[:, None]
    ohms = bank.resistance(bank.rest(grid.shape[:-1]), grid)
    for start, met in ((2e-3, -1e-3), (-2e-3, 2e-3), (-1e-3, 0.2e-3), (3e-3, -4e-3)):
        mean = np.array([[60.0], [25.0], [rest + start], [1.0]])
        covariance = np.zeros((4, 4, 1))
        covariance[2, 2] = (2e-3) ** 2
        read = bank.resistance(bank.rest(()), np.array([rest + met]))
        found = observer.corrected(Estimate(mean, covariance), read)
        cost = ((grid - mean[2]) / 2e-3) ** 2 + ((read - ohms) / 10e-3) ** 2
        assert found.length == pytest.approx(grid[np.argmin(cost)], abs=5e-5), (start, met)


def test_after_a_long_rest_temperature_and_heat_loss_are_off_together():
    bank = TcaBank([SENSING, EMBEDDED], law="surface")
    observer = TcaObserver(bank, ObserverSpec(loss_error=0.2, start_error=0.5))
    power = np.array([1.0, 0.8])
    estimate = observer.begin([7.2, 9.0], steady_power=power)
    step = HeatStep.of(bank.heat, 1e5)
    warm, body, _ = step.advance(np.full(2, 25.0), np.full(2, 25.0), power)
    assert estimate.temperature == pytest.approx(warm, rel=1e-9)
    assert estimate.body == pytest.approx(body, rel=1e-9)
    slope = estimate.covariance[0, 3] / estimate.covariance[3, 3]
    slower = HeatStep.of(bank.heat.losing(1.0 / 1.01), 1e5)
    moved = slower.advance(np.full(2, 25.0), np.full(2, 25.0), power)
    assert slope == pytest.approx((moved[0] - warm) / 0.01, rel=1e-6)
    assert estimate.covariance[1, 3] / 0.04 == pytest.approx((moved[1] - body) / 0.01, abs=1e-6)
    later = observer.predicted(estimate, power, 50.0)  # and so it stays
    assert later.covariance[0, 3] == pytest.approx(estimate.covariance[0, 3], rel=1e-3)
    with pytest.raises(ValueError, match="temperature must be None where steady_power tells it"):
        observer.begin([7.2, 9.0], 40.0, steady_power=power)


def test_many_are_as_one_and_no_current_is_no_reading():
    bank = TcaBank([SENSING, CATALOGUE["free-stroke"]], law="surface")
    observer = TcaObserver(bank, ObserverSpec(loss_error=0.2))
    ohms = bank.resistance(bank.rest(), 1.05 * bank.rest_length) * np.array([[1.0], [0.99], [1.02]])
    volts = np.array([[1.0, 2.0], [3.0, 0.0], [0.0, 1.5]])
    many = observer.step(observer.begin(ohms), volts, volts / ohms, 0.02)
    for i in range(3):
        one = observer.step(observer.begin(ohms[i]), volts[i], volts[i] / ohms[i], 0.02)
        assert np.array_equal(one.mean, many.mean[:, i])
        assert np.array_equal(one.covariance, many.covariance[:, :, i])
    blind = observer.predicted(observer.begin(ohms[1]), [9.0 / ohms[1, 0], 0.0], 0.02)
    assert many.mean[:, 1, 1] == pytest.approx(blind.mean[:, 1], rel=1e-12)
    assert many.deviation[2, 1, 0] < blind.deviation[2, 0]


def test_what_it_cannot_be_told():
    observer = TcaObserver(TcaBank([SENSING]))
    estimate = observer.begin([7.0])
    with pytest.raises(ValueError, match=r"resistance must have shape \(\.\.\., 1\)"):
        observer.begin([7.0, 7.0])
    with pytest.raises(ValueError, match="voltage \\* current must be finite and at least 0 W"):
        observer.step(estimate, [1.0], [-0.1], 0.1)
    with pytest.raises(ValueError, match="duty must be"):
        observer.step(estimate, [1.0], [0.1], 0.1, duty=1.5)
    with pytest.raises(ValueError, match="truth must have shape"):
        observer.bound(np.ones((3, 4, 1)), np.ones((3, 1)), 0.1)


def test_the_page_says_how_fast_a_load_may_be():
    """After a change: python scripts/load_bandwidth.py --page."""
    root = Path(__file__).parent.parent
    script = runpy.run_path(str(root / "scripts" / "load_bandwidth.py"))
    page = (root / "docs" / "bench.md").read_text("utf-8")
    rest = page.partition(f"<!-- {script['MARK']} -->")[2].partition("<!-- end -->")[0]
    rows = [line.strip("| ").split(" | ") for line in rest.split("\n")]
    found = {row[0]: dict(zip(script["CASES"], row[1:], strict=True)) for row in rows if row[1:]}
    fast, varied = "10", "known to 20 %, power ± 50 %, 4 s"
    assert script["cell"](float(fast), varied) == found[fast][varied]
    off = [float(cell.partition("(")[2].rstrip(")")) for speed, row in found.items()
           if speed.replace(".", "").isdigit() for cell in row.values()]  # fmt: skip
    assert len(off) == 18 and max(off) < 1.2

"""TCA and body: exact in time against a general matrix exponential, closed in energy, limits."""

from dataclasses import fields, replace

import mpmath
import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    BodyHeat,
    HeatSpec,
    HeatStep,
    TcaBank,
    TcaMelted,
    heat_lost,
    step_temperature,
)

STEPS = [1e-5, 0.02, 0.5, 2.0, 37.0, 1e4]


def constants(seed, n=40):
    """Of n TCAs whose capacities and conductances spread over three orders of magnitude."""
    rng = np.random.default_rng(seed)
    values = {f.name: 10.0 ** rng.uniform(-3.0, 0.0, n) for f in fields(HeatSpec)}
    values["ambient"] = rng.uniform(5.0, 40.0, n)
    values["loss"][::3] = 0.0  # all heat through the body
    return HeatSpec(**values)


def general(heat, i, dt, temperature, body, power):
    """The same by a general matrix exponential with 60 digits, energies included."""
    with mpmath.workdps(60):
        c, b, g, loss, out, ambient = (
            mpmath.mpf(float(getattr(heat, name)[i]))
            for name in ("capacity", "body_capacity", "conductance", "loss", "body_loss", "ambient")
        )
        rates = mpmath.matrix([
            [-(loss + g) / c, g / c, 0, 1 / c], [g / b, -(out + g) / b, 0, 0],
            [loss, out, 0, 0], [0, 0, 0, 0],
        ])  # fmt: skip
        start = mpmath.matrix([temperature - ambient, body - ambient, 0, power])
        x, y, lost, _ = mpmath.expm(rates * dt) * start
        return np.array([float(x + ambient), float(y + ambient), float(lost)])


@pytest.mark.parametrize("dt", STEPS)
def test_a_step_is_the_matrix_exponential(dt):
    heat, rng = constants(1), np.random.default_rng(2)
    temperature, body = rng.uniform(0.0, 200.0, 40), rng.uniform(0.0, 90.0, 40)
    power = rng.uniform(0.0, 3.0, 40)
    found = np.array(HeatStep.of(heat, dt).advance(temperature, body, power))
    exact = np.array([
        general(heat, i, dt, temperature[i], body[i], power[i]) for i in range(40)
    ]).T  # fmt: skip
    scale = np.array([200.0 + power / (heat.loss + heat.body_loss)] * 2 + [
        power * dt + 200.0 * (heat.capacity + heat.body_capacity)
    ])  # fmt: skip
    assert np.max(np.abs(found - exact) / scale) < 1e-12


@pytest.mark.parametrize("parts", [2, 7, 500])
def test_the_subdivision_of_a_step_does_not_matter(parts):
    heat = constants(3)
    state = np.full(40, 140.0), np.full(40, 60.0)
    whole, part = HeatStep.of(heat, 3.0), HeatStep.of(heat, 3.0 / parts)
    power = np.linspace(0.0, 2.0, 40)
    *ends, lost = whole.advance(*state, power)
    total = np.zeros(40)
    for _ in range(parts):
        *state, more = part.advance(*state, power)
        total += more
    np.testing.assert_allclose(state, ends, rtol=1e-12)
    scale = np.abs(lost) + power * 3.0 + 140.0 * (heat.capacity + heat.body_capacity)
    assert np.max(np.abs(total - lost) / scale) < 1e-12


@pytest.mark.parametrize("dt", STEPS)
def test_energy_in_is_stored_or_lost(dt):
    heat, rng = constants(4), np.random.default_rng(5)
    temperature, body = rng.uniform(0.0, 200.0, 40), rng.uniform(0.0, 90.0, 40)
    power = rng.uniform(0.0, 3.0, 40)
    hot, warm, lost = HeatStep.of(heat, dt).advance(temperature, body, power)
    stored = heat.capacity * (hot - temperature) + heat.body_capacity * (warm - body)
    scale = power * dt + 200.0 * (heat.capacity + heat.body_capacity)
    assert np.max(np.abs(power * dt - stored - lost) / scale) < 1e-12


@pytest.mark.parametrize("dt", STEPS)
def test_without_contact_it_is_the_bare_tca(dt):
    heat = replace(constants(6), conductance=np.zeros(40), loss=np.full(40, 0.013))
    temperature, power = np.linspace(0.0, 200.0, 40), np.linspace(0.0, 3.0, 40)
    body = np.full(40, 50.0)
    hot, _, lost = HeatStep.of(heat, dt).advance(temperature, body, power)
    np.testing.assert_allclose(hot, step_temperature(temperature, power, heat, dt), rtol=1e-12)
    body_alone = HeatSpec(
        capacity=heat.body_capacity, loss=heat.body_loss, ambient=heat.ambient
    )
    both = heat_lost(temperature, power, heat, dt) + heat_lost(body, 0.0, body_alone, dt)
    scale = power * dt + 200.0 * (heat.capacity + heat.body_capacity)
    assert np.max(np.abs(lost - both) / scale) < 1e-12


def test_in_perfect_contact_it_is_one_body():
    """C + C_b and λ + λ_b; what is left is of the order of rate over contact rate, 1e-9."""
    heat = replace(constants(7), conductance=np.full(40, 1e9))
    one = HeatSpec(
        capacity=heat.capacity + heat.body_capacity, loss=heat.loss + heat.body_loss,
        ambient=heat.ambient,
    )  # fmt: skip
    temperature, power = np.linspace(30.0, 200.0, 40), np.linspace(0.0, 3.0, 40)
    for dt in STEPS:
        hot, warm, lost = HeatStep.of(heat, dt).advance(temperature, temperature, power)
        exact = step_temperature(temperature, power, one, dt)
        np.testing.assert_allclose(hot, exact, rtol=1e-7)
        np.testing.assert_allclose(warm, exact, rtol=1e-7)
        np.testing.assert_allclose(lost, heat_lost(temperature, power, one, dt), rtol=1e-7,
                                   atol=1e-9)  # fmt: skip


def test_what_is_at_rest_stays_there():
    heat = constants(8)
    rest = np.array(heat.ambient)
    for dt in (0.0, 0.02, 5.0):
        hot, warm, lost = HeatStep.of(heat, dt).advance(rest, rest, np.zeros(40))
        np.testing.assert_array_equal(hot, rest)
        np.testing.assert_array_equal(warm, rest)
        np.testing.assert_array_equal(lost, 0.0)
    with pytest.raises(ValueError, match="dt"):
        HeatStep.of(heat, -1.0)


def test_the_steady_state_is_steady_and_the_body_can_be_followed():
    body = BodyHeat(conductance=0.4, capacity=22.0, loss=0.1)
    spec = replace(CATALOGUE["free-stroke"], body=body)
    bank = TcaBank([spec, CATALOGUE["free-stroke"]])
    state, power = bank.steady([120.0, 90.0])
    assert power == pytest.approx(bank.heat.keeping(state.temperature, state.body), rel=1e-12)
    later, _ = bank.advance(state, power, bank.rest_length, 100.0)
    np.testing.assert_allclose(later.temperature, state.temperature, rtol=1e-12)
    np.testing.assert_allclose(later.body, state.body, rtol=1e-12)
    assert later.body[1] == 25.0  # a bare TCA has the air round it
    # A body beside a TCA that is kept at one temperature, in one step and in many.
    body = bank.heat.body_after(bank.rest().body, [120.0, 90.0], 5.0)
    assert 25.0 < body[0] < state.body[0]
    for _ in range(50):
        state = replace(state, body=bank.heat.body_after(state.body, [120.0, 90.0], 0.1))
    np.testing.assert_allclose(bank.heat.body_after(state.body, [120.0, 90.0], 1e6),
                               bank.heat.steady_body([120.0, 90.0]), rtol=1e-12)  # fmt: skip
    for bad in ([24.0, 90.0], [np.nan, 90.0], [120.0]):
        with pytest.raises(ValueError, match="temperature"):
            bank.steady(bad)


def test_energy_of_a_bank_with_and_without_bodies():
    body = BodyHeat(conductance=2.0, capacity=9.0, loss=0.1)
    bank = TcaBank([CATALOGUE["free-stroke"], replace(CATALOGUE["free-stroke"], body=body)])
    state, rng = bank.rest(), np.random.default_rng(0)
    for _ in range(100):
        state, _ = bank.advance(state, rng.uniform(0.0, 1.5, 2), bank.rest_length, 0.05)
    np.testing.assert_allclose(
        bank.energy_stored(state) + state.energy_lost, state.energy_in, rtol=1e-12
    )
    np.testing.assert_array_equal(bank.embedded, [False, True])


def test_nothing_is_hotter_than_it_melts_at():
    bank = TcaBank([CATALOGUE["free-stroke"]] * 3)
    with pytest.raises(TcaMelted, match="TCA 1 would have .* its fibre melts at 260") as caught:
        bank.advance(bank.rest(), [0.0, 10.0, 0.0], bank.rest_length, 2.0)
    assert caught.value.number == 1
    exact = step_temperature(25.0, 10.0, CATALOGUE["free-stroke"].heat, 2.0)
    assert caught.value.temperature == pytest.approx(float(exact), rel=1e-12)
    hot, _ = bank.advance(bank.rest(), [0.0, 3.0, 0.0], bank.rest_length, 2.0)
    np.testing.assert_array_equal(bank.overheated(hot), [False, True, False])


def test_laws_of_a_bare_tca_refuse_a_body():
    heat = HeatSpec(capacity=0.03, loss=0.0, conductance=0.01, body_capacity=1.0, body_loss=0.01)
    with pytest.raises(ValueError, match="conductance"):
        step_temperature(25.0, 1.0, heat, 1.0)
    with pytest.raises(ValueError, match="loss"):
        HeatSpec(capacity=0.03, loss=0.0)
    for name in ("conductance", "body_loss"):
        with pytest.raises(ValueError, match=name):
            replace(heat, **{name: -1.0})
    with pytest.raises(ValueError, match="body_capacity"):
        replace(heat, body_capacity=0.0)


@pytest.mark.parametrize("seed", range(5))
def test_one_tca_alone_is_to_the_bit_one_of_many(seed):
    """Its step is computed with Python's numbers."""
    heat, rng = constants(seed, n=1), np.random.default_rng(seed)
    step = HeatStep.of(heat, 0.1)
    temperature, body, power = rng.uniform(0.0, 200.0, (3, 100, 1))
    every = step.advance(temperature, body, power)
    each = [step.advance(*now) for now in zip(temperature, body, power, strict=True)]
    assert np.array(each).transpose(1, 0, 2).tobytes() == np.array(every).tobytes()

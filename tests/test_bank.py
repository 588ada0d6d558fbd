"""n TCAs advanced together: batches, energy, resistance and refusals."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from tca_mj.modules.bending import bending_module
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, Pull, TcaBank, TcaState, WireTable, coil_tension, sensed_length
from tca_mj.tca.arrays import column

FREE_STROKE = CATALOGUE["free-stroke"]
HOT_SECTION = replace(FREE_STROKE, fibre=replace(FREE_STROKE.fibre, section="hot"), ambient=20.0)
SPECS = [*CATALOGUE.values(), HOT_SECTION]


def random_inputs(bank, shape, seed=0):
    rng = np.random.default_rng(seed)
    size = (*shape, bank.n)
    state = TcaState(
        rng.uniform(20.0, 160.0, size), rng.uniform(20.0, 90.0, size), rng.random(size),
        rng.random(size),
    )  # fmt: skip
    length = bank.shortest + rng.random(size) * (bank.longest - bank.shortest)
    return state, rng.uniform(0.0, 3.0, size), length


def test_a_bank_at_rest_neither_pulls_nor_cools():
    bank = TcaBank(list(CATALOGUE.values()))
    state, pull = bank.advance(bank.rest(), np.zeros(bank.n), bank.rest_length, 10.0)
    np.testing.assert_array_equal(state.temperature, 25.0)
    np.testing.assert_array_equal(state.energy_lost, 0.0)
    np.testing.assert_allclose(pull.tension, 0.0, atol=1e-12)
    assert not bank.broken(pull).any()
    assert not bank.overheated(state).any()


class Springs:
    """A law of one's own: TCAs as linear springs that shorten by 0.2 % per kelvin."""

    STIFFNESS = 20.0  # [N/m]

    def __init__(self, specs):
        self.rest = column(specs, "rest_length")
        self.shortest, self.longest = 0.5 * self.rest, 1.5 * self.rest

    def tension(self, length, temperature):
        free = self.rest * (1.0 - 2e-3 * (temperature - 25.0))
        return self.STIFFNESS * (length - free), np.full_like(length, self.STIFFNESS)


def test_a_law_of_ones_own_drives_a_bank():
    bank, law = TcaBank(SPECS, law=Springs), Springs(SPECS)
    assert bank.law is Springs
    np.testing.assert_array_equal([bank.shortest, bank.longest], [law.shortest, law.longest])
    state, power, length = random_inputs(bank, (3,))
    after, pull = bank.advance(state, power, length, 0.02)
    np.testing.assert_array_equal(pull.tension, law.tension(length, after.temperature)[0])
    np.testing.assert_array_equal(pull.stiffness, law.STIFFNESS)
    # Heat does not know the law.
    rods, _ = TcaBank(SPECS).advance(state, power, bank.rest_length + 0.0 * length, 0.02)
    np.testing.assert_array_equal(after.temperature, rods.temperature)


def test_a_law_of_ones_own_moves_a_body():
    sim = Simulation(bending_module(), law=Springs)
    for _ in range(20):
        sim.step([1.0, 0.0, 0.0], 0.02)
    law = Springs(sim.bank.specs)
    assert sim.temperature[0] > 35.0
    tension, _ = law.tension(sim.pull.length, sim.temperature)
    np.testing.assert_array_equal(sim.pull.tension, tension)
    assert sim.length[0] < law.rest[0] - 1e-3  # the module bends towards it


@pytest.mark.parametrize("contiguous", [True, False])
def test_a_batch_is_its_rows_bit_for_bit(contiguous):
    bank = TcaBank(SPECS)
    state, power, length = random_inputs(bank, (40,))
    if not contiguous:
        state = TcaState(*(np.asfortranarray(getattr(state, f.name)) for f in fields(state)))
        power, length = np.asfortranarray(power), np.asfortranarray(length)
    after, pull = bank.advance(state, power, length, 0.02)
    for i in range(40):
        row = TcaState(*(getattr(state, f.name)[i] for f in fields(state)))
        row_after, row_pull = bank.advance(row, power[i], length[i], 0.02)
        for name in ("temperature", "body", "energy_in", "energy_lost"):
            np.testing.assert_array_equal(getattr(row_after, name), getattr(after, name)[i])
        for name in ("tension", "stiffness", "length"):
            np.testing.assert_array_equal(getattr(row_pull, name), getattr(pull, name)[i])


def test_a_bank_is_its_tcas_bit_for_bit():
    bank = TcaBank(SPECS)
    state, _, length = random_inputs(bank, (), seed=3)
    pull = bank.pull(state, length)
    for i, spec in enumerate(SPECS):
        tension, stiffness = coil_tension(spec, length[i], state.temperature[i])
        assert (pull.tension[i], pull.stiffness[i]) == (tension, stiffness)


def test_batch_shapes():
    bank = TcaBank([FREE_STROKE, FREE_STROKE.of_length(0.11)])
    state = bank.rest((3, 4))
    assert state.temperature.shape == (3, 4, 2)
    pull = bank.pull(state, np.broadcast_to(bank.rest_length, (3, 4, 2)))
    assert pull.tension.shape == pull.stiffness.shape == (3, 4, 2)
    np.testing.assert_array_equal(TcaBank([HOT_SECTION]).rest().temperature, [20.0])


def test_heat_acts_before_the_pull():
    """The pull belongs to the temperature at the end of the step."""
    bank = TcaBank([FREE_STROKE])
    state, pull = bank.advance(bank.rest(), np.array([2.0]), bank.rest_length, 1.0)
    assert state.temperature[0] > 60.0
    tension, stiffness = coil_tension(FREE_STROKE, 0.045, state.temperature[0])
    assert (pull.tension[0], pull.stiffness[0]) == (tension, stiffness)


def test_energy_balance_over_many_steps():
    """Electrical energy = heat stored above ambient + heat lost, from rest."""
    bank = TcaBank(SPECS)
    state, rng = bank.rest((5,)), np.random.default_rng(2)
    length = np.broadcast_to(bank.rest_length, (5, bank.n))
    for _ in range(200):
        state, _ = bank.advance(state, rng.uniform(0.0, 1.5, (5, bank.n)), length, 0.02)
    balance = bank.energy_stored(state) + state.energy_lost
    np.testing.assert_allclose(balance, state.energy_in, rtol=1e-12)
    assert np.all(state.energy_in > 0.0)


def test_the_affine_law_is_the_tangent():
    """F(l + d) - law = F'' d^2/2: a tenth of the step, a hundredth of the error."""
    bank = TcaBank([FREE_STROKE])
    state = TcaBank([FREE_STROKE]).steady([120.0])[0]
    pull = bank.pull(state, np.array([0.045]))
    errors = []
    for step in (1e-3, 1e-4):
        length = np.array([0.045 + step])
        errors.append(abs(bank.pull(state, length).tension[0] - pull.at(length)[0]))
    assert errors[1] == pytest.approx(0.01 * errors[0], rel=0.2)


def test_results_do_not_depend_on_what_came_before():
    bank, other = TcaBank(SPECS), TcaBank(SPECS)
    state, power, length = random_inputs(bank, ())
    for seed in range(5):
        bank.advance(*random_inputs(bank, (2,), seed=seed), 0.1)
    first = bank.advance(state, power, length, 0.1)
    second = other.advance(state, power, length, 0.1)
    np.testing.assert_array_equal(first[0].temperature, second[0].temperature)
    np.testing.assert_array_equal(first[1].tension, second[1].tension)


def test_rupture_is_reported_and_not_clipped():
    bank = TcaBank([FREE_STROKE, CATALOGUE["self-coiled"]])
    np.testing.assert_array_equal(bank.breaking_force, [0.78, 0.240 * 9.81])
    pull = bank.pull(bank.rest(), np.array([0.085, 0.060]))
    np.testing.assert_array_equal(bank.broken(pull), [True, False])
    assert pull.tension[0] > 0.78
    slack = bank.pull(bank.rest(), bank.minimum_length)
    assert np.all(slack.tension < 0.0)


def test_overheating_is_reported():
    bank = TcaBank([FREE_STROKE, FREE_STROKE])
    np.testing.assert_array_equal(bank.max_temperature, [160.0, 160.0])
    state = bank.steady([159.0, 161.0])[0]
    np.testing.assert_array_equal(bank.overheated(state), [False, True])


def test_resistance_of_the_measured_tca():
    """Sun, Table 2.3 and Section 2.3.1: 6.7 ohm/dm made; 0.55 ohm less at 50 % strain on 110 mm."""
    spec = CATALOGUE["type-2-180"].of_length(0.110)
    bank = TcaBank([spec])
    rest = bank.resistance(bank.rest(), np.array([0.110]))
    stretched = bank.resistance(bank.rest(), np.array([0.165]))
    contracted = bank.resistance(bank.rest(), np.array([0.080]))
    made = 67.0 * 0.1335 * 110.0 / 109.0  # 109 mm in Table 2.1, 110 mm in Table 2.3
    assert rest[0] == pytest.approx(made, rel=1e-12)
    assert rest[0] - stretched[0] == pytest.approx(0.55 * 110.0 / 109.0, rel=1e-12)
    assert contracted[0] > rest[0]
    power = bank.power_at(bank.rest(), np.array([0.110]), np.array([12.0]))
    assert power[0] == pytest.approx(144.0 / made, rel=1e-12)


def test_length_is_read_back_from_the_resistance():
    bank = TcaBank(SPECS)
    state, _, length = random_inputs(bank, (6,))
    ohms = bank.resistance(state, length)
    np.testing.assert_allclose(sensed_length(WireTable.of(SPECS), ohms), length, rtol=1e-12)
    with pytest.raises(ValueError, match="resistance"):
        sensed_length(WireTable.of(SPECS), -ohms)
    blind = WireTable.of([replace(FREE_STROKE, stretch_resistance=0.0)])
    with pytest.raises(ValueError, match="stretch"):
        sensed_length(blind, [3.0])


def test_bad_inputs_are_refused():
    bank = TcaBank([FREE_STROKE, FREE_STROKE])
    rest, length, power = bank.rest(), bank.rest_length, np.ones(2)
    for bad in ([-1e-9, 1.0], [math.nan, 1.0], [math.inf, 1.0], [1.0], 1.0, np.ones((1, 2))):
        with pytest.raises(ValueError, match="power"):
            bank.advance(rest, bad, length, 0.1)
    for bad in ([math.nan, 0.045], [0.045, 0.2], [0.01, 0.045], [0.045], 0.045):
        with pytest.raises(ValueError, match="length"):
            bank.advance(rest, power, bad, 0.1)
    with pytest.raises(ValueError, match=r"length\[1\] must be from 0.014.*, got 0.2 m"):
        bank.pull(rest, [0.045, 0.2])
    for dt in (-0.1, math.nan):
        with pytest.raises(ValueError, match="dt"):
            bank.advance(rest, power, length, dt)
    with pytest.raises(ValueError, match="voltage"):
        bank.power_at(rest, length, [math.nan, 1.0])
    with pytest.raises(ValueError, match="length"):
        bank.resistance(rest, [0.0, 0.045])
    with pytest.raises(ValueError, match="length"):
        bank.resistance(rest, [0.045, 1.0])
    for shape in ((3,), ()):
        wrong = TcaState(*(np.full(shape, 25.0) for _ in range(4)))
        with pytest.raises(ValueError, match="state"):
            bank.pull(wrong, np.full(shape, 0.045))
    hot = replace(rest, temperature=np.full(2, math.nan))
    with pytest.raises(ValueError, match="temperature"):
        bank.pull(hot, length)
    with pytest.raises(ValueError, match="specs"):
        TcaBank([])


def test_constants_cannot_be_changed_by_accident():
    bank = TcaBank([FREE_STROKE])
    for array in (bank.rest_length, bank.breaking_force, bank.heat.capacity, bank.longest):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    assert isinstance(bank.pull(bank.rest(), bank.rest_length), Pull)

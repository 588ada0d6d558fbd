"""Creep and relaxation of TCAs in a bank and in a simulation, against their closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from tca_mj.batch import SimulationBatch
from tca_mj.drive import Drive
from tca_mj.modules.bending import bending_module
from tca_mj.sim import Simulation
from tca_mj.state import get_state, set_state
from tca_mj.tca import (
    CATALOGUE,
    CoilRods,
    CreepBank,
    CreepingState,
    CreepSpec,
    CreepState,
    Plies,
    TcaBank,
    TcaObserver,
    aged,
    relaxation_time,
)

TCA, OTHER = CATALOGUE["free-stroke"], CATALOGUE["type-1-180"]
CREEP = CreepSpec()
HOT = 150.0  # where the relaxation time is 1 s


def kept(bank, length, seconds, dt, temperature=HOT):
    """Tensions over time at one length and temperature, from the natural lengths on."""
    state, power = bank.steady(np.full(bank.n, temperature))
    found = [bank.pull(state, length).tension]
    for _ in range(round(seconds / dt)):
        state, pull = bank.advance(state, power, length, dt)
        found.append(pull.tension)
    return np.array(found), state


def test_the_law_of_crept_coils_is_that_of_coils_wound_so():
    creeping = CreepBank([TCA, OTHER])
    shift = np.array([[0.0, 0.0], [2e-3, 5e-3], [9e-3, 1e-3]])
    rods = creeping.law(CoilRods([TCA, OTHER]), shift)
    for share in (0.55, 1.0, 1.3):  # touching, at rest, stretched
        length = np.broadcast_to(share * np.array([TCA.rest_length, OTHER.rest_length]), (3, 2))
        temperature = np.full((3, 2), 90.0)
        found = np.array(rods.tension(length, temperature))
        for i in range(3):
            wound = CoilRods(creeping.crept(CreepState(shift[i])))
            expected = np.array(wound.tension(length[i], temperature[i]))
            assert found[:, i] == pytest.approx(expected, rel=1e-9, abs=1e-11)


def test_a_small_stretch_relaxes_as_its_closed_form_says():
    """Linear: F(t)/F(0) = q + (1 - q) exp(-t/(q tau)), with q = h/(h + S) left in the end.

    The cold stiffness is the one that ``settled`` counts with, and the one that pulls.
    """
    left = CREEP.half_stretch / (CREEP.half_stretch + CREEP.saturation)
    tau = float(relaxation_time(25.0, CREEP))
    dt = 0.02 * tau
    tension, _ = kept(TcaBank([TCA], creep=CREEP), 1.002 * np.array([TCA.rest_length]),
                      3.0 * tau, dt, 25.0)  # fmt: skip
    time = dt * np.arange(len(tension))
    expected = left + (1.0 - left) * np.exp(-time / (left * tau))
    assert tension[:, 0] / tension[0, 0] == pytest.approx(expected, abs=0.015)


def test_half_a_step_twice_is_a_step_and_hot_tensions_are_gone_in_seconds():
    bank, length = TcaBank([TCA], creep=CREEP), np.array([1.3 * TCA.rest_length])
    coarse, fine = (kept(bank, length, 2.4, dt)[0] for dt in (0.08, 0.04))
    assert fine[::2] == pytest.approx(coarse, abs=0.02 * coarse[0, 0])
    assert fine[-1, 0] < 0.95 * fine[0, 0]
    settled = bank.creep.settled(fine[-1])
    _, state = kept(bank, length, 12.0, 0.08)
    assert state.shift == pytest.approx(settled, rel=0.02)  # of the tension that is left


def test_a_load_stretches_it_for_twenty_hours_when_cold():
    """Sun, Section 2.2.2: 95 % are done in 20 h, and little in half an hour."""
    bank, observer = TcaBank([OTHER], creep=CREEP), TcaObserver(TcaBank([OTHER]))
    load, state = np.array([0.02 * 9.81]), bank.rest()
    goal = float(bank.creep.settled(load)[0])
    hour, done = 3600.0, {}
    rods = CoilRods([OTHER])
    for k in range(40):
        length = observer.under_load(np.array([25.0]), load)  # of an uncrept one: a start
        law = bank.creep.law(rods, state.shift)
        for _ in range(8):
            force, slope = law.tension(length, np.array([25.0]))
            length = length + (load - force) / slope
        state = bank.warmed(state, np.zeros(1), length, 0.5 * hour)
        done[0.5 * (k + 1)] = float(state.shift[0]) / goal
    assert done[20.0] == pytest.approx(0.95, abs=0.005)
    assert done[0.5] < 0.08


def moved(creep, steps=3, **more):
    sim = Simulation(bending_module(), creep=creep, timestep=4e-3, **more)
    sim.keep([140.0, 60.0, 60.0])
    for _ in range(steps):
        sim.step([1.5, 0.0, 0.3], 0.2)
    return sim


def test_without_the_flag_nothing_changes_and_with_constants_of_none_hardly_anything():
    plain = moved(None, law="rod")
    assert not isinstance(plain.tca, CreepingState) and "creep" not in plain.group("TCA").signals
    none = moved(CreepSpec(saturation=0.0), law="rod")
    assert np.array_equal(none.tca.shift, np.zeros(3))
    assert none.data.qpos == pytest.approx(plain.data.qpos, abs=1e-9)
    much = moved(CREEP, law="rod")
    assert much.tca.shift[0] > 1e-5 > much.tca.shift[1] > 0.0
    assert not np.array_equal(much.data.qpos, plain.data.qpos)


def test_what_has_crept_is_part_of_the_state_and_is_shown():
    sim = moved(CREEP)
    kept = get_state(sim)
    sim.step([1.0, 0.0, 0.0], 0.2)
    once = sim.data.qpos.copy(), sim.tca.shift.copy()
    other = Simulation(bending_module(), creep=CREEP, timestep=4e-3)
    set_state(other, kept)
    other.step([1.0, 0.0, 0.0], 0.2)
    assert np.array_equal(other.data.qpos, once[0])
    assert np.array_equal(other.group("TCA").signals["creep"].values, once[1])
    other.keep([60.0, 60.0, 60.0])
    assert np.array_equal(other.tca.shift, once[1])  # a temperature is no healing
    other.reset()
    assert np.array_equal(other.tca.shift, np.zeros(3))


def test_a_batch_creeps_as_single_simulations_bit_for_bit():
    sims = [Simulation(bending_module(), creep=CREEP) for _ in range(3)]
    alone = Simulation(bending_module(), creep=CREEP)
    batch, powers = SimulationBatch(sims[:2]), np.array([[1.5, 0.0, 0.3], [0.0, 2.0, 0.0]])
    for _ in range(3):
        batch.step([Drive(command=power) for power in powers], 0.2)
        alone.step(powers[1], 0.2)
    assert np.array_equal(sims[1].data.qpos, alone.data.qpos)
    assert np.array_equal(sims[1].tca.shift, alone.tca.shift)
    with pytest.raises(ValueError, match="sims must be built alike"):
        SimulationBatch([sims[2], Simulation(bending_module(), law="rod")])


def test_a_recording_shows_what_has_crept():
    from tca_mj.record.layout import groups

    titles = [group.title for group in groups(moved(CREEP, 1))]
    assert "TCA: creep [m]" in titles
    assert not any("creep" in g.title for g in groups(moved(None, 1)))


def test_aged_tcas_pull_less():
    new, old = (moved(None, cycles=n) for n in (0.0, 10e3))
    assert old.bank.specs[0] == aged(new.bank.specs[0], 10e3, CREEP)
    assert old.bank.pull(new.tca, new.length).tension[0] < new.pull.tension[0]


def test_what_cannot_creep_is_refused():
    with pytest.raises(ValueError, match="creep must be None with a law of one's own or plies"):
        TcaBank([TCA], CoilRods, creep=CREEP)
    with pytest.raises(ValueError, match="creep must be None with a law of one's own or plies"):
        TcaBank([replace(TCA, plies=Plies(strands=2))], creep=CREEP)
    with pytest.raises(ValueError, match="state must be a CreepingState"):
        bank = TcaBank([TCA], creep=CREEP)
        bank.pull(TcaBank([TCA]).rest(), bank.rest_length)

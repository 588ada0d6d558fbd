"""Muscles of another kind beside TCAs: the example outside the package, and the bank of all."""

import copy
import math
from pathlib import Path

import numpy as np
import pytest

from tca_mj.actuation import MixedBank
from tca_mj.batch import SimulationBatch
from tca_mj.drive import Drive
from tca_mj.model.part import Part, new_spec
from tca_mj.modules.bending import bending_module
from tca_mj.sim import Simulation
from tca_mj.state import get_state, set_state
from tca_mj.tca import TcaBank
from tca_mj.variation import Nominal, Variation

POWER = np.array([0.6, 0.8, 0.0])


@pytest.fixture
def own(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent / "examples"))
    import own_actuator

    return own_actuator


@pytest.fixture
def sim(own):
    return Simulation(own.sma_module())


def test_the_law_of_the_spring_is_that_of_the_wire(own):
    """k = G d^4/(8 D^3 n), with the modulus of martensite when cold and of austenite when hot."""
    spring = own.SmaSpring()
    bank = own.SmaBank([spring])
    cold = bank.rest()
    pull = bank.pull(cold, np.array([45e-3]))
    stiffness = 8e9 * 0.15e-3**4 / (8.0 * 1.5e-3**3 * 20)
    assert pull.stiffness == pytest.approx(stiffness)
    assert pull.tension == pytest.approx(stiffness * 3e-3)
    hot, pull = bank.advance(cold, np.array([1.0]), np.array([45e-3]), 60.0)
    assert pull.stiffness == pytest.approx(stiffness * 18.0 / 8.0)
    assert hot.energy_in == pytest.approx(60.0)


def test_what_was_austenite_stays_so_until_it_is_colder(own):
    """The loop of hysteresis: half transformed at 73 °C on heating, at 47 °C on cooling."""
    bank = own.SmaBank([own.SmaSpring()])
    state, length = bank.rest(), np.array([45e-3])
    keeps = [bank.heat.loss * (t - 25.0) for t in (73.0, 90.0, 60.0, 47.0)]
    shares = []
    for power in keeps:
        for _ in range(100):
            state, _ = bank.advance(state, power, length, 2.0)
        shares.append(state.austenite[0])
    assert shares == pytest.approx([0.5, 1.0, 1.0, 0.5], abs=1e-3)


def test_a_module_with_both_bends_to_the_side_of_what_is_hot(own, sim):
    sim.step(np.zeros(3), 1.0)
    cold = sim.data.site("tip").xpos.copy()
    sim.step([0.6, 0.0, 0.0], 8.0)
    hot = sim.data.site("tip").xpos.copy()
    assert hot[0] - cold[0] > 2e-3  # muscle 0 stands on the x side
    assert sim.energy == pytest.approx([0.6 * 8.0, 0.0, 0.0])
    assert sim.power == pytest.approx([0.6, 0.0, 0.0])
    spring, tcas = sim.groups
    assert (spring.kind, spring.names) == ("SMA spring", ("muscle0",))
    assert (tcas.kind, tcas.names) == ("TCA", ("muscle1", "muscle2"))
    assert spring.signals["austenite"].values == pytest.approx([1.0])
    assert spring.channels == tcas.channels == {"power": "W"}
    assert sim.tension[0] == pytest.approx(sim.pull.at(sim.length)[0], rel=0.02)


def test_tcas_alone_and_in_a_mixed_bank_are_the_same(own):
    """Bit for bit: a mixed bank adds nothing."""
    one, other = Simulation(bending_module()), Simulation(bending_module())
    tcas = other.bank
    other.bank = MixedBank(tcas.specs, [(np.array([2, 0, 1]), TcaBank(
        [tcas.specs[i] for i in (2, 0, 1)], "surface"))])
    other.reset()
    for sim in (one, other):
        sim.step(np.array([0.5, 1.0, 0.0]), 2.0)
    for name in ("temperature", "tension", "length", "energy", "resistance", "body_temperature"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert np.array_equal(one.data.qpos, other.data.qpos)


def test_several_go_together_where_each_goes_alone(own):
    sims = [Simulation(own.sma_module()) for _ in range(3)]
    alone = copy.deepcopy(sims)
    for each in (sims, alone):
        Nominal(each[1]).apply(Variation(heat_loss=1.3, ambient=30.0, tca_gain=0.9))
        each[1].reset()
    batch = SimulationBatch(sims, threads=2)
    for scale in (1.0, 0.3):
        drives = [Drive(command=scale * POWER * (1.0 + 0.1 * i)) for i in range(3)]
        assert batch.step(drives, 0.2) == [None] * 3
        for sim, drive in zip(alone, drives, strict=True):
            sim.step(drive.command, 0.2)
    for sim, other in zip(sims, alone, strict=True):
        assert np.array_equal(sim.data.qpos, other.data.qpos)
        assert np.array_equal(sim.temperature, other.temperature)
        assert np.array_equal(sim.tca.parts[0].austenite, other.tca.parts[0].austenite)


def test_a_state_comes_back_with_the_memory_of_the_wire(own, sim):
    sim.step(POWER, 2.0)
    state = get_state(sim)
    sim.step(POWER, 0.5)
    first = sim.data.qpos.copy(), sim.tca.parts[0].austenite.copy()
    set_state(sim, state)
    sim.step(POWER, 0.5)
    assert np.array_equal(sim.data.qpos, first[0])
    assert np.array_equal(sim.tca.parts[0].austenite, first[1])


def test_a_part_without_a_tca_is_simulated_too(own):
    part = own.sma_module()
    part.tcas = part.tcas[:1]
    sim = Simulation(part)
    sim.step([0.4], 1.0)
    assert sim.energy == pytest.approx([0.4])
    assert math.isnan(sim.resistance[0]) and sim.temperature[0] > 30.0


def test_bad_commands_are_refused_by_the_kind_that_gets_them(sim):
    for wrong in ([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0], [np.nan, 0.0, 0.0]):
        with pytest.raises(ValueError, match="must be"):
            sim.step(wrong, 0.1)


def test_motors_are_a_group():
    part = Part(new_spec("lift"))
    body = part.spec.worldbody.add_body(name="cart")
    body.add_geom(size=[0.01, 0.0, 0.0], mass=0.1)
    body.add_joint(name="lift", type=2, axis=[0, 0, 1], damping=1.0)
    part.spec.add_actuator(name="motor", target="lift", trntype=0, gainprm=[1.0] + 9 * [0.0])
    robot = bending_module()
    body.add_site(name="mount")
    part.attach(robot, to="mount", prefix="arm")
    sim = Simulation(part)
    assert [group.kind for group in sim.groups] == ["TCA", "motor"]
    assert sim.motors == ("motor",)
    sim.data.ctrl[0] = 2.0
    sim.step(np.zeros(3), 0.1)
    assert sim.groups[1].signals["force"].values == pytest.approx([2.0])
    assert sim.groups[1].signals["velocity"].values[0] > 0.0


def test_the_recording_shows_what_another_kind_shows(own, sim, tmp_path):
    from rerun.chunk import RrdReader

    from tca_mj.record import Recorder

    with Recorder(sim, tmp_path / "own.rrd") as recorder:
        for _ in range(3):
            sim.step([0.6, 0.0, 0.0], 1.0)
            recorder.frame()
    paths = {chunk.entity_path for chunk in RrdReader(tmp_path / "own.rrd").stream()}
    assert {"/SMA_spring/muscle0/austenite", "/actuators/muscle0/tension",
            "/actuators/muscle2/temperature"} <= paths


def test_a_task_with_another_kind_is_vectorised(own, monkeypatch):
    """A task of the kind, alone and two together: the same bits, and the energy of both."""
    import own_task

    from tca_mj import in_arena
    from tca_mj.envs import Entry, TaskVector

    class Mixed(own_task.Turn):
        robot_argument = None
        rows = (Entry("TCA temperature", 3, -50.0, 300.0, "°C"), *own_task.Turn.rows[1:])
        scene = staticmethod(lambda spec: in_arena(own.sma_module()))

        def bent(self):
            return self.sim.bend("robot.body")

    together, alone = TaskVector(Mixed, num_envs=2, action="power"), Mixed(action="power")
    together.reset(seed=[3, 4])
    alone.reset(seed=4)
    for command in (0.2, -0.5):
        outcomes = together.advance(np.full((2, 3), command, np.float32))
        observation, reward, *_, info = alone.step(np.full(3, command, np.float32))
        assert np.array_equal(outcomes[1][0], observation) and outcomes[1][1] == reward
        assert np.array_equal(outcomes[1][4]["energy"], info["energy"])
    assert (info["energy"] > 0.0).all()

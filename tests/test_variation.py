"""Variations of a robot: what they scale, and that nothing of them stays."""

import math

import mujoco
import numpy as np
import pytest

from tca_mj.assets import mjcf
from tca_mj.envs.stance import Stance, tetrapod_scene
from tca_mj.modules.bending import bending_module
from tca_mj.robots.tetrapod import TetrapodSpec
from tca_mj.sim import Simulation
from tca_mj.variation import Nominal, Variation

SPEC = TetrapodSpec()
ALL = Variation(friction=1.2, mass=0.9, tca_gain=1.1, heat_loss=0.8, ambient=30.0)


@pytest.fixture(scope="module")
def sim():
    return tetrapod_scene(mjcf("ground.xml"), {}, SPEC, timestep=5e-3, period=0.1)


@pytest.fixture
def nominal(sim):
    nominal = Nominal(sim)
    yield nominal
    nominal.apply(Variation())


def figures(sim):
    """All of the model that no step changes, and what else a variation may touch."""
    model = sim.model
    kept = {
        name: getattr(model, name).copy()
        for name in dir(model)
        if name.startswith(("body_", "geom_", "dof_", "tendon_", "actuator_"))
        and isinstance(getattr(model, name), np.ndarray)
        and name not in ("dof_damping", "actuator_biasprm")  # renewed by every step
    }
    heat, heater = sim.bank.heat, sim.spines.bank.heater
    return kept | {
        "gain": np.array(sim.gain), "loss": heat.loss, "ambient": heat.ambient,
        "spine loss": heater.loss, "spine ambient": heater.ambient,
    }  # fmt: skip


def course(sim, steps=4):
    """Where the robot is after it was put down and heated, to the last bit."""
    sim.reset(Stance(sim, SPEC).placer(bend=1.6))
    power = np.zeros(sim.n)
    power[:12] = 2.0
    for _ in range(steps):
        sim.step(power, 0.1)
    return sim.data.qpos.copy()


def test_factors_of_one_bring_back_the_simulation_bit_for_bit(sim, nominal):
    before, moved = figures(sim), course(sim)
    nominal.apply(ALL)
    assert not np.array_equal(course(sim), moved)
    nominal.apply(Variation())
    after = figures(sim)
    assert [name for name in before if not np.array_equal(before[name], after[name])] == []
    assert np.array_equal(course(sim), moved)


def test_applying_twice_is_applying_once(sim, nominal):
    nominal.apply(ALL)
    once = figures(sim)
    nominal.apply(Variation(mass=0.5))
    nominal.apply(ALL)
    nominal.apply(ALL)
    twice = figures(sim)
    assert [name for name in once if not np.array_equal(once[name], twice[name])] == []
    assert nominal.variation == ALL


def test_scaled_masses_are_those_of_a_model_of_that_mass(sim, nominal):
    """MuJoCo computes from the scaled masses what the variation has scaled by itself."""
    nominal.apply(Variation(mass=0.8))
    mine = figures(sim)
    mujoco.mj_setConst(sim.model, sim.data)
    theirs = figures(sim)
    for name in ("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0"):
        assert mine[name] == pytest.approx(theirs[name], rel=1e-6), name


def test_each_figure_scales_what_it_names(sim, nominal):
    plain = figures(sim)
    nominal.apply(ALL)
    varied = figures(sim)
    factors = {
        "geom_friction": 1.2, "body_mass": 0.9, "body_inertia": 0.9, "gain": 1.1, "loss": 0.8,
        "spine loss": 0.8,
    }  # fmt: skip
    for name, factor in factors.items():
        assert varied[name] == pytest.approx(factor * plain[name], rel=1e-12), name
    assert (varied["ambient"] == 30.0).all() and (varied["spine ambient"] == 30.0).all()
    sim.reset()
    assert (sim.temperature == 30.0).all() and (sim.spines.temperature == 30.0).all()


def test_the_gain_scales_tension_and_slope(sim, nominal):
    """At the same length and temperature; and what MuJoCo pulls with follows."""
    hot = np.full(sim.n, 60.0)
    pulls = []
    for gain in (1.0, 1.25):
        nominal.apply(Variation(tca_gain=gain))
        sim.reset()
        length = sim.length
        state = sim.bank.rest()
        state.temperature[:] = hot
        sim._hand_over(sim._pull(state, length))
        mujoco.mj_forward(sim.model, sim.data)
        pulls.append((sim.pull, sim.tension))
    (one, felt), (more, felt_more) = pulls
    assert more.tension == pytest.approx(1.25 * one.tension, rel=1e-12)
    assert more.stiffness == pytest.approx(1.25 * one.stiffness, rel=1e-12)
    assert felt_more == pytest.approx(1.25 * felt, rel=1e-6) and felt.min() > 0.01


def test_a_tca_in_steady_state_is_warmer_by_what_it_does_not_lose(sim, nominal):
    """P = λ (T - T_amb)."""
    nominal.apply(Variation(heat_loss=0.5, ambient=10.0))
    sim.reset()
    power = np.full(sim.n, 0.2)
    power[12:] = 0.0
    loss = float(np.asarray(sim.bank.specs[0].heat.loss))
    state, length = sim.tca, sim.length
    for _ in range(200):
        state, _ = sim.bank.advance(state, power, length, 0.5)
    assert state.temperature[:12] == pytest.approx(10.0 + 0.2 / (0.5 * loss), rel=1e-3)


def test_what_lies_in_silicone_varies_with_it():
    """All three conductances to the air are scaled, capacities are not."""
    module = Simulation(bending_module())
    before = module.bank.heat
    Nominal(module).apply(Variation(heat_loss=0.5, ambient=10.0))
    after = module.bank.heat
    for name, factor in (("conductance", 0.5), ("body_loss", 0.5), ("capacity", 1.0),
                         ("body_capacity", 1.0)):  # fmt: skip
        np.testing.assert_array_equal(getattr(after, name), factor * getattr(before, name))
    module.reset()
    assert (module.temperature == 10.0).all() and (module.body_temperature == 10.0).all()


def test_draws_are_scaled_by_the_spread():
    drawn = Variation.drawn([-1.0, 0.5, 0.0, 1.0, -0.4], 0.2)
    assert drawn == Variation(friction=0.8, mass=1.1, tca_gain=1.0, heat_loss=1.2, ambient=23.0)
    assert Variation.drawn([0.3] * 5, 0.0) == Variation()


@pytest.mark.parametrize(
    ("figures", "message"),
    [
        (
            {"friction": 0.0},
            "friction must be finite and at least 0.01 and at most 10, got 0.0",
        ),
        (
            {"mass": -1.0},
            "mass must be finite and at least 0.05 and at most 10, got -1.0",
        ),
        (
            {"tca_gain": math.nan},
            "tca_gain must be finite and at least 0.05 and at most 5, got nan",
        ),
        (
            {"heat_loss": math.inf},
            "heat_loss must be finite and at least 0.05 and at most 10, got inf",
        ),
        (
            {"ambient": -300.0},
            "ambient must be finite and at least -40 and at most 60 °C, got -300.0",
        ),
    ],
)
def test_impossible_variations_are_refused(figures, message):
    with pytest.raises(ValueError, match=message):
        Variation(**figures)


@pytest.mark.parametrize(
    ("draws", "spread", "message"),
    [
        ([0.0] * 4, 0.2, "draws must be 5 within -1 and 1"),
        ([0.0, 0.0, 0.0, 0.0, 1.1], 0.2, "draws must be 5 within -1 and 1"),
        ([0.0] * 5, 1.0, "spread must be finite and at least 0 and at most 0.95, got 1.0"),
    ],
)
def test_impossible_draws_are_refused(draws, spread, message):
    with pytest.raises(ValueError, match=message):
        Variation.drawn(draws, spread)

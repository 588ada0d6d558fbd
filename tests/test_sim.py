"""The coupled step: hand-over of the law, energy, reset, and what it refuses."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tca_mj.drive import SimulationDiverged, SimulationOverheated
from tca_mj.model import settle
from tca_mj.model.chain import add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.tendon import route_passes, route_tca
from tca_mj.modules.bending import BendingSpec, bending_module, silicone_cylinder
from tca_mj.modules.finger import finger_pair
from tca_mj.routes import Helix, leg_length
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, MATERIALS, HeatStep, Supply, Thermostat


def simulation(**options):
    part = bending_module()
    part.spec.option.gravity = [0.0, 0.0, 9.81]  # hanging
    return Simulation(part, **options)


def state(sim):
    """Everything that a simulation carries on, as bytes."""
    model, data = sim.model, sim.data
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION)
    physics = np.empty(size)
    mujoco.mj_getState(model, data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
    arrays = [
        physics, model.actuator_biasprm, model.jnt_stiffness, model.qpos_spring, model.dof_damping,
        sim.temperature, sim.energy, sim.tca.energy_lost, sim.tension, sim.length, sim.power,
    ]  # fmt: skip
    return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)


def tip(sim):
    return sim.data.site("tip").xpos.copy()


def test_it_starts_cold_at_rest_and_unloaded():
    sim = simulation()
    assert sim.time == 0.0 and sim.n == 3 and sim.tca_names == ("tca0", "tca1", "tca2")
    assert sim.temperature == pytest.approx(np.full(3, 25.0))
    assert sim.length == pytest.approx(sim.bank.rest_length, rel=1e-12)
    assert sim.tension == pytest.approx(np.full(3, 1e-10), abs=1e-12)  # just taut
    assert not sim.energy.any() and not sim.power.any()
    assert sim.resistance == pytest.approx(sim.bank.resistance(sim.tca, sim.length))
    assert np.all(sim.resistance > 0.0)
    cold = Simulation(bending_module(), ambient=5.0)
    assert cold.temperature == pytest.approx(np.full(3, 5.0))


def test_time_goes_on_by_the_duration():
    sim = simulation(timestep=4e-3)
    sim.step(np.zeros(3), 0.1)
    sim.step(np.zeros(3), 0.02)
    sim.step(np.zeros(3), 0.02)
    assert sim.time == pytest.approx(0.14, abs=1e-12)


def test_temperature_is_that_of_the_closed_form():
    """Twenty updates are as exact as one, of TCAs and of what they lie in."""
    sim, power = simulation(), np.array([0.5, 0.0, 1.5])
    sim.step(power, 0.4)
    cold = np.full(3, 25.0)
    once, warm, _ = HeatStep.of(sim.bank.heat, 0.4).advance(cold, cold, power)
    assert sim.temperature == pytest.approx(once, rel=1e-12)
    assert sim.body_temperature == pytest.approx(warm, rel=1e-12)
    assert sim.embedded.all() and 25.0 < warm[0] < once[0]


def test_energy_is_the_integral_of_the_power_and_is_not_lost():
    sim, given = simulation(), np.zeros(3)
    random = np.random.default_rng(3)
    for _ in range(10):
        power = random.uniform(0.0, 1.0, 3)
        sim.step(power, 0.1)
        given += 0.1 * power
        assert sim.power == pytest.approx(power, rel=1e-15)
    assert sim.energy == pytest.approx(given, rel=1e-12)
    stored = sim.bank.energy_stored(sim.tca)
    assert stored + sim.tca.energy_lost == pytest.approx(sim.energy, rel=1e-12)


def test_the_body_feels_the_law_of_the_bank():
    """At the update the affine law is the bank's; until the next one MuJoCo follows it."""
    sim = simulation()
    for power in ([1.5, 0.0, 0.0], [1.5, 0.5, 0.0], [0.0, 0.0, 2.0]):
        sim.step(power, 1.0)
        exact = sim.bank.pull(sim.tca, sim.pull.length)
        assert sim.pull.tension == pytest.approx(exact.tension, rel=1e-14)
        assert sim.pull.stiffness == pytest.approx(exact.stiffness, rel=1e-14)
        mujoco.mj_forward(sim.model, sim.data)
        # MuJoCo follows the polyline's change of length, the bank the smooth curve's.
        law = np.maximum(sim.pull.at(sim.length), 0.0)
        assert sim.tension == pytest.approx(law, rel=3e-3, abs=1e-15)
        now = np.maximum(sim.bank.pull(sim.tca, sim.length).tension, 0.0)
        assert sim.tension == pytest.approx(now, abs=2e-3 * now.max())
    assert sim.tension.max() > 0.02


def test_the_unclipped_law_is_handed_over():
    """A TCA that is slack at the update pulls as soon as it is stretched."""
    sim = simulation()
    slack = sim.bank.pull(sim.tca, sim.bank.rest_length - 1e-3)
    sim._hand_over(slack)
    assert slack.tension.max() < 0.0
    before = sim.data.ten_length[sim.tendon]
    for node in range(BendingSpec().nodes):
        sim.data.qpos[sim.model.joint(f"body.stretch{node}").qposadr[0]] = 4e-4
    mujoco.mj_forward(sim.model, sim.data)
    stretch = sim.data.ten_length[sim.tendon] - before
    assert stretch == pytest.approx(3.2e-3, rel=1e-9)
    law = slack.tension + slack.stiffness * stretch
    assert sim.tension == pytest.approx(law + 1e-10, rel=1e-10)
    assert sim.tension.min() > 0.0


@pytest.mark.parametrize("law", ["rod", "surface"])
def test_at_rest_no_rounding_decides_whether_a_tca_is_taut(law):
    """A clamped actuator has no implicit stiffness: a first step that is a tenth longer."""

    def first_step(error):
        sim = simulation(law=law)
        rest = sim.bank.pull(sim.tca, sim.length)
        sim._hand_over(rest._replace(tension=rest.tension + error))
        mujoco.mj_step(sim.model, sim.data)
        return sim.data.qpos.copy()

    plain = first_step(0.0)
    for error in (-1e-12, 1e-12):
        assert first_step(error) == pytest.approx(plain, rel=1e-6, abs=1e-15)
    assert np.abs(first_step(-2e-9) - plain).max() > 0.05 * np.abs(plain).max()  # it is seen


def test_a_slack_tca_does_not_push():
    """Bent by hand towards the cold TCA 0, whose law is negative there."""
    sim = simulation(timestep=2e-3)
    bends = [sim.model.joint(f"body.bend_y{i}").qposadr[0] for i in range(BendingSpec().nodes)]
    sim.data.qpos[bends] = 0.1
    mujoco.mj_forward(sim.model, sim.data)
    sim.step(np.zeros(3), 0.02)
    assert sim.pull.tension[0] < -1e-3
    assert sim.tension[0] == 0.0
    assert sim.tension[1:].min() > 0.0


def test_no_tension_is_ever_negative():
    """Heated at random, and cold again from one moment to the next."""
    sim, random = simulation(timestep=4e-3), np.random.default_rng(5)
    slack = 0
    for _ in range(200):
        sim.step(random.choice([0.0, 4.0], 3), 0.02)
        assert sim.tension.min() >= 0.0
        slack += int((sim.pull.tension < 0.0).any())
        if sim.temperature.max() > 100.0:
            sim.tca = sim.bank.rest()
    assert slack > 0


def transient(period):
    """Tip while it is bent by a heating TCA."""
    sim = simulation(timestep=1e-3, tca_period=period)
    sim.step([2.0, 0.0, 0.0], 0.64)
    return tip(sim)


def test_half_the_period_of_the_tcas_changes_a_transient_little():
    """First order in the period, because the temperature at its end is used throughout it."""
    exact = transient(1e-3)
    moved = np.linalg.norm(exact - tip(simulation()))
    error = {ms: np.linalg.norm(transient(1e-3 * ms) - exact) for ms in (4, 8, 16)}
    assert moved > 2e-3
    assert error[16] < 0.03 * moved
    assert error[8] / error[4] == pytest.approx(7.0 / 3.0, abs=0.2)
    assert error[16] / error[8] == pytest.approx(15.0 / 7.0, abs=0.2)


def test_the_period_does_not_move_the_shape_at_rest():
    def rest(period):
        sim = simulation(timestep=4e-3, tca_period=period)
        sim.step(sim.keep([90.0, 25.0, 25.0]), 6.0)
        return tip(sim)

    assert rest(4e-2) == pytest.approx(rest(4e-3), abs=1e-6)


def test_at_rest_it_has_the_shape_that_settle_finds():
    """The same chain under the same tensions, bent by its own curvature and by two TCAs."""
    body = replace(BendingSpec().body, curvature=(10.0, -30.0, 5.0))
    routes = (Helix(4e-3), Helix(4e-3, 0.5, 2.0))
    spec = new_spec("curved")
    chain = add_chain(spec.worldbody, body, nodes=8, name="body")
    chain.tip.add_site(name="tip", pos=[0.0, 0.0, chain.local(8)])
    tcas = []
    for i, route in enumerate(routes):
        tca = CATALOGUE["free-stroke"].of_length(leg_length(route, body.length, body.curvature))
        tcas.append(route_tca(spec, tca, route_passes(chain, route), name=f"tca{i}"))
    spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(Part(spec, tuple(tcas)), timestep=1e-2)  # its damping grows with the step
    sim.step(sim.keep([110.0, 90.0]), 15.0)
    shape = settle(body, routes, sim.tension, nodes=8)
    assert sim.tension.min() > 0.01
    assert tip(sim) == pytest.approx(shape.tip, abs=2e-6)
    assert sim.data.site("tip").xmat == pytest.approx(shape.rotation[-1].ravel(), abs=1e-4)


def test_one_long_step_is_many_short_ones():
    """Bit for bit."""
    whole, parts = simulation(), simulation()
    whole.step([1.0, 0.2, 0.0], 0.4)
    for _ in range(4):
        parts.step([1.0, 0.2, 0.0], 0.1)
    assert state(whole) == state(parts)


def test_robots_use_the_surface_and_the_rod_where_there_is_none():
    """Steep and soft in torsion: that coil's own tension falls with length."""
    assert simulation().bank.law == "surface"
    assert simulation(law="rod").bank.law == "rod"
    with pytest.raises(ValueError, match=r"law must be one of .* or a Callable, got 'table'"):
        simulation(law="table")
    part = bending_module()
    thread = MATERIALS["silver-coated nylon sewing thread"].measured
    fibre = replace(thread, radius=0.2e-3, young=7e9, shear=0.1e9)
    steep = replace(CATALOGUE["free-stroke"], fibre=fibre, coil_radius=1.2e-3, pitch_angle=0.8)
    length = part.tcas[0].spec.rest_length
    part.tcas = (replace(part.tcas[0], spec=steep.of_length(length)), *part.tcas[1:])
    sim = Simulation(part)
    assert sim.bank.law == "rod"
    sim.step(np.zeros(3), 0.02)


def test_surface_and_rod_move_a_body_alike():
    """To the error of the table, over 3 s with heated, cooling and slack TCAs."""
    courses = []
    for law in ("rod", "surface"):
        sim, course = simulation(timestep=4e-3, law=law), []
        for power in ([2.0, 0.4, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]):
            sim.step(power, 1.0)
            course.append(tip(sim))
        courses.append(np.array(course))
    moved = np.linalg.norm(np.diff(courses[0], axis=0), axis=1).min()
    assert np.abs(courses[1] - courses[0]).max() < 1e-4 * moved


def rollout(sim):
    for power in ([1.0, 0.0, 0.3], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]):
        sim.step(power, 0.2)
    return state(sim)


def test_a_reset_forgets_everything(tmp_path, monkeypatch):
    """Bit for bit, after a rollout and after a divergence; a second simulation changes nothing."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings into a file
    sim, other = simulation(), Simulation(finger_pair())
    start, end = state(sim), rollout(sim)
    sim.reset()
    assert state(sim) == start
    other.step([8.0], 0.5)
    assert rollout(sim) == end
    sim.data.qvel[:] = 1e12
    with pytest.raises(SimulationDiverged):
        sim.step(np.zeros(3), 0.1)
    sim.reset()
    assert state(sim) == start
    assert rollout(sim) == end
    assert rollout(simulation()) == end


@pytest.mark.parametrize("value", [1e12, math.nan, math.inf])
def test_divergence_is_reported(value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sim = simulation()
    sim.data.qvel[3] = value
    with pytest.raises(SimulationDiverged, match="the state diverged at"):
        sim.step(np.zeros(3), 0.1)


@pytest.mark.parametrize("power", [5.0, 200.0, 1e5])
def test_a_tca_above_the_melting_point_is_refused_by_name(power):
    """From 260 °C on there is no fibre: within seconds, within 0.1 s, at once."""
    sim = simulation()
    with pytest.raises(SimulationOverheated, match=r"tca1 would have \d+ °C: .* melts at 260"):
        sim.step([0.0, power, 0.0], 10.0)
    assert (sim.temperature <= 260.0).all()


def test_a_tca_beyond_its_measurements_is_flagged():
    sim = simulation()
    sim.step([0.0, 2.0, 0.0], 1.0)
    assert not sim.extrapolated.any()
    sim.step(sim.keep([25.0, 161.0, 159.0]), 0.02)
    assert sim.extrapolated.tolist() == [False, True, False]


def test_a_law_that_has_no_state_is_a_divergence():
    """A fibre that softens to nothing at 200 °C, below its melting point."""
    part = bending_module()
    fibre = replace(part.tcas[0].spec.fibre, softening=3.9e9 / 175.0,
                    load_softening=(0.0, 0.0, 1.0))  # fmt: skip
    part.tcas = tuple(replace(t, spec=replace(t.spec, fibre=fibre)) for t in part.tcas)
    sim = Simulation(part, law="rod")
    with pytest.raises(SimulationDiverged, match="the TCAs have no state at .* s: "):
        sim.step([3.0, 0.0, 0.0], 10.0)


@pytest.mark.parametrize("stretch", [-0.8, 5.0])
def test_a_tca_outside_of_its_law_is_a_divergence(stretch):
    """Squeezed or torn out by somebody who moved the joints."""
    sim, spec = simulation(), BendingSpec()
    for node in range(spec.nodes):
        address = sim.model.joint(f"body.stretch{node}").qposadr
        sim.data.qpos[address] = stretch * spec.length / spec.nodes
    mujoco.mj_forward(sim.model, sim.data)
    with pytest.raises(SimulationDiverged, match=r"tca0 has a length of .* m at .* s; its law"):
        sim.step(np.zeros(3), 0.1)


@pytest.mark.parametrize(
    ("power", "duration", "message"),
    [
        (np.zeros(2), 0.1, r"power must be finite numbers of shape \(3,\), got"),
        (0.0, 0.1, r"power must be finite numbers of shape \(3,\), got 0\.0"),
        ([0.0, -0.1, 0.0], 0.1, r"power must be .* at least 0 W, got \[0\.0, -0\.1, 0\.0\]"),
        ([0.0, math.nan, 0.0], 0.1, r"power must be finite .* got .*nan"),
        ([0.0, math.inf, 0.0], 0.1, r"power must be finite .* got .*inf"),
        (np.zeros(3), 0.11, r"duration must be a positive multiple of tca_period 0\.02 s, got 0"),
        (np.zeros(3), 0.0, r"duration must be a positive multiple .*, got 0\.0"),
        (np.zeros(3), -0.1, r"duration must be a positive multiple .*, got -0\.1"),
        (np.zeros(3), math.nan, "duration must be finite and at most 2000 s, got nan"),
        (np.zeros(3), math.inf, "duration must be finite and at most 2000 s, got inf"),
    ],
)
def test_a_bad_step_is_refused_and_changes_nothing(power, duration, message):
    sim = simulation()
    before = state(sim)
    with pytest.raises(ValueError, match=message):
        sim.step(power, duration)
    assert state(sim) == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"timestep": 0.0}, r"timestep must be finite and at least 1e-06 .* s, got 0\.0"),
        ({"timestep": -1e-3}, r"timestep must be finite and at least 1e-06 .*, got -0\.001"),
        ({"timestep": math.nan}, "timestep must be finite and at least 1e-06 .* got nan"),
        ({"timestep": 3e-3}, r"tca_period must be a positive multiple .* 0\.003 s, got 0\.02"),
        ({"tca_period": 0.0}, r"tca_period must be finite and above 0, got 0\.0"),
        ({"tca_period": math.nan}, "tca_period must be finite and above 0, got nan"),
        ({"ambient": -300.0}, r"ambient must be finite and at least -40 .* °C, got -300\.0"),
        ({"ambient": math.nan}, "ambient must be finite and at least -40 .*, got nan"),
    ],
)
def test_a_bad_simulation_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        simulation(**options)


def test_a_part_without_a_muscle_is_refused():
    part = Part(new_spec("bare"))
    add_chain(part, silicone_cylinder(0.04, 8e-3, 8e-3), nodes=4, name="bare")
    with pytest.raises(ValueError, match="part must have at least one muscle, got none in 'bare'"):
        Simulation(part)


def test_dm_controls_names_see_the_same_state():
    pytest.importorskip("dm_control")
    sim = simulation()
    physics = sim.physics()
    sim.step([1.0, 0.0, 0.0], 0.1)
    assert physics.named.data.site_xpos["tip"] == pytest.approx(sim.data.site("tip").xpos, abs=0.0)


def test_strong_pulls_do_not_chatter():
    """The geometric stiffness of taut TCAs is explicit; damping in step with it keeps it quiet.

    Without that the twist of this bent, loaded module diverges from a small kick.
    """
    part = bending_module()
    part.spec.option.gravity = [0.0, 0.0, 9.81]
    part.spec.body(f"body.piece{BendingSpec().nodes}").first_geom().mass += 4e-3
    sim, power = Simulation(part, timestep=5e-3, tca_period=25e-3), [1.3, 2.0, 2.0]
    sim.step(power, 8.0)
    assert sim.tension.max() > 0.2
    sim.data.qvel[sim.model.joint("body.twist6").dofadr[0]] = 1.0
    sim.step(power, 1.0)
    assert np.abs(sim.data.qvel).max() < 0.1


def test_at_rest_nothing_moves_whatever_the_supply_takes():
    sim = simulation()
    heat = sim.bank.heat
    thermostat = Thermostat(heat=heat, max_power=2.0)
    sim.bank.supply = Supply(quantity="temperature", max_power=2.0, thermostat=thermostat)
    told = sim.bank.supply
    target = np.array([110.0, 25.0, 60.0])
    assert sim.rest(target) < 3e-5
    assert sim.bank.supply is told
    assert sim.temperature == pytest.approx(target)
    place = sim.data.site("tip").xpos.copy()
    sim.bank.supply = Supply()
    sim.step(sim.keep(target), 2.0)
    assert np.linalg.norm(sim.data.site("tip").xpos - place) < 2e-6
    assert sim.rest(target, warming=0.0, longest=0.1, quiet=0.0) < 3e-5


def test_what_cannot_be_kept_is_no_rest():
    with pytest.raises(ValueError, match="temperature must be at least that of the surroundings"):
        simulation().rest([20.0, 25.0, 25.0], warming=0.0)

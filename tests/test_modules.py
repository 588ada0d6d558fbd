"""Modules and the arm: what theory and the published measurements ask of them."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.sim import Simulation

G = 9.81


def simulation(part, timestep=4e-3, gravity=G, **options):
    """A module that hangs from its base: gravity along +z of the module."""
    part.spec.option.gravity = [0.0, 0.0, gravity]
    return Simulation(part, timestep=timestep, **options)


def hold(sim, temperature, seconds=3.0):
    """Brings the TCAs to temperatures [°C] within a second, and holds them by constant power."""
    goal = np.broadcast_to(np.asarray(temperature, dtype=float), (sim.n,))
    for share in np.linspace(0.1, 1.0, 10):
        now = 25.0 + share * (goal - 25.0)
        sim.step(sim.keep(now), 0.1)
    sim.step(sim.keep(goal), seconds)
    assert sim.temperature == pytest.approx(goal)
    assert seconds < 3.0 or np.abs(sim.data.qvel).max() < 1e-2
    return sim


def tip(sim, site="tip"):
    return sim.data.site(site).xpos.copy()


def turn(sim, site="tip"):
    """Angle of a tip about the base's axis, -π to π."""
    frame = sim.data.site(site).xmat.reshape(3, 3)
    return float(np.arctan2(frame[1, 0] - frame[0, 1], frame[0, 0] + frame[1, 1]))


def bend(sim, site="tip"):
    """Angle between a tip's axis and the base's, and the direction of the bend from x."""
    axis = sim.data.site(site).xmat.reshape(3, 3)[:, 2]
    across = float(np.hypot(axis[0], axis[1]))
    return math.atan2(across, axis[2]), math.atan2(axis[1], axis[0])


def opening(sim):
    return float(np.linalg.norm(tip(sim, "tip0") - tip(sim, "tip1")))


# Builder by number of nodes, default nodes, site, length, temperatures at which it works.
WORKING = {
    "bending": (
        lambda n: bending_module(BendingSpec(nodes=n)),
        BendingSpec().nodes, "tip", BendingSpec().length, [120.0, 60.0, 25.0],
    ),
    "twisting": (
        lambda n: twisting_module(TwistingSpec(nodes=n)),
        TwistingSpec().nodes, "tip", TwistingSpec().length, [120.0],
    ),
    "finger": (
        lambda n: finger_pair(FingerPairSpec(nodes=n)),
        FingerPairSpec().nodes, "tip0", FingerPairSpec().length / 2.0, [120.0],
    ),
}  # fmt: skip


@pytest.mark.parametrize("module", WORKING)
def test_twice_the_nodes_move_the_tip_by_less_than_a_hundredth(module):
    build, nodes, site, length, hot = WORKING[module]
    coarse, fine = (tip(hold(simulation(build(n)), hot), site) for n in (nodes, 2 * nodes))
    assert np.linalg.norm(fine - coarse) < 0.01 * length


@pytest.mark.parametrize("module", WORKING)
def test_half_the_time_step_moves_the_tip_by_less_than_a_hundredth(module):
    """By far: the shape at rest does not depend on the time step."""
    build, nodes, site, length, hot = WORKING[module]
    coarse, fine = (
        tip(hold(simulation(build(nodes), timestep=step), hot, seconds=6.0), site)
        for step in (5e-3, 2.5e-3)
    )
    assert np.linalg.norm(fine - coarse) < 1e-4 * length


@pytest.mark.parametrize("module", WORKING)
def test_hot_tcas_put_no_load_on_the_base(module):
    """Base reaction = weight: 1e-5 N and 1e-7 N m, about the origin."""
    build, nodes, _, _, hot = WORKING[module]
    sim = hold(simulation(build(nodes)), np.maximum(np.array(hot) - 10.0, 25.0), seconds=8.0)
    assert sim.tension.max() > 0.05
    model, data = sim.model, sim.data
    mujoco.mj_forward(model, data)
    mujoco.mj_rnePostConstraint(model, data)
    force, moment = np.zeros(3), np.zeros(3)
    for body in np.flatnonzero(model.body_parentid == 0)[1:]:
        torque, push = data.cfrc_int[body].reshape(2, 3)
        force += push
        moment += torque + np.cross(data.subtree_com[model.body_rootid[body]], push)
    weight = model.body_mass[:, None] * model.opt.gravity
    assert force == pytest.approx(-weight.sum(axis=0), abs=1e-5)
    held = -np.cross(data.xipos, weight).sum(axis=0)
    assert moment == pytest.approx(held, abs=1e-7)


@pytest.mark.parametrize("count", [3, 4])
def test_equal_temperatures_do_not_bend(count):
    """But by the 3e-5 rad by which MuJoCo's step, blind to 1e-8 N m, lets the module creep."""
    sim = hold(simulation(bending_module(BendingSpec(count=count))), 120.0)
    assert np.ptp(sim.tension) < 5e-6 and sim.tension.min() > 0.05
    assert bend(sim)[0] < 3e-5
    assert tip(sim)[2] < 0.92 * BendingSpec().length


@pytest.mark.parametrize("index", range(3))
def test_the_module_bends_towards_its_hot_tca(index):
    hot = np.full(3, 25.0)
    hot[index] = 110.0
    angle, direction = bend(hold(simulation(bending_module()), hot))
    assert angle > 0.5
    gap = (direction - 2.0 * math.pi * index / 3.0 + math.pi) % (2.0 * math.pi) - math.pi
    assert abs(gap) < 0.01


def test_two_hot_tcas_share_the_direction():
    """Equal: right between them. The hotter one draws the bend to its side."""
    even = bend(hold(simulation(bending_module()), [110.0, 110.0, 25.0]))
    uneven = bend(hold(simulation(bending_module()), [110.0, 80.0, 25.0]))
    assert even[1] == pytest.approx(math.pi / 3.0, abs=0.01)
    assert 0.1 < uneven[1] < math.pi / 3.0 - 0.1


def test_more_power_bends_further_and_an_antagonist_less():
    """Sun, Section 4.1.3: the angle rises with the power of one TCA."""

    def angle(power):
        sim = simulation(bending_module())
        sim.step(power, 8.0)
        return bend(sim)[0]

    angles = [angle([p, 0.0, 0.0]) for p in (0.2, 0.4, 0.8)]
    assert angles[0] > 0.05
    assert angles[1] > 1.5 * angles[0] and angles[2] > 1.5 * angles[1]
    assert angle([0.8, 0.4, 0.4]) < 0.8 * angles[2]


@pytest.mark.parametrize("double", [False, True])
def test_the_hand_of_the_helix_is_the_sign_of_the_twist(double):
    spec = TwistingSpec(double=double, nodes=24)
    right = hold(simulation(twisting_module(spec)), 110.0)
    left = hold(simulation(twisting_module(replace(spec, turns=-spec.turns))), 110.0)
    assert turn(right) < -0.5
    assert turn(left) == pytest.approx(-turn(right), rel=1e-4)


def heated_twist(power, double=True):
    """Some power for 2 s from the cold [deg]."""
    nodes = TwistingSpec().nodes if double else 24
    sim = simulation(twisting_module(TwistingSpec(double=double, nodes=nodes)), gravity=G)
    total = 0.0
    for _ in range(20):
        before = turn(sim)
        sim.step([power], 0.1)
        total += (turn(sim) - before + math.pi) % (2.0 * math.pi) - math.pi
    assert sim.energy == pytest.approx([2.0 * power])
    return math.degrees(abs(total))


@pytest.mark.parametrize(("power", "angle"), [(14.0, 45.0), (16.0, 58.0)])
def test_the_wrist_turns_as_far_as_reported(power, angle):
    """Sun, Section 4.1.4, to 15 %, with nothing fitted to it."""
    assert heated_twist(power) == pytest.approx(angle, rel=0.15)


def test_the_double_helix_turns_further_than_the_single_one():
    """Sun, Section 4.1.2. The 180° of 28 W are missed: docs/validation.md says why."""
    double = heated_twist(28.0)
    assert 120.0 < double < 0.85 * 180.0
    assert double > 1.05 * heated_twist(28.0, double=False)


def test_the_gripper_is_closed_when_cold_and_opens_with_heat():
    sim = simulation(finger_pair())
    sim.step([0.0], 2.0)
    assert opening(sim) < 1e-3
    openings = [opening(hold(simulation(finger_pair()), hot)) for hot in (60.0, 90.0, 120.0)]
    assert np.all(np.diff([opening(sim), *openings]) > 1e-3)


def test_the_fingers_mirror_each_other():
    sim = hold(simulation(finger_pair()), 110.0)
    assert tip(sim, "tip0") == pytest.approx(tip(sim, "tip1") * [-1.0, 1.0, 1.0], abs=2e-6)
    assert abs(tip(sim, "tip0")[1]) < 2e-6


@pytest.mark.parametrize("module", WORKING)
def test_without_power_everything_returns_to_rest(module):
    build, nodes, site, length, hot = WORKING[module]
    sim = simulation(build(nodes))
    sim.step(np.zeros(sim.n), 3.0)
    start = tip(sim, site)
    hold(sim, hot, seconds=1.0)
    moved = np.linalg.norm(tip(sim, site) - start)
    for share in np.linspace(0.9, 0.0, 10):  # quicker than the air would
        now = 25.0 + share * (np.array(hot) - 25.0)
        sim.keep(now)
        sim.step(np.zeros(sim.n), 0.1)
    sim.keep(np.full(sim.n, 25.0))
    sim.step(np.zeros(sim.n), 4.0)
    assert moved > 0.01 * length
    assert np.linalg.norm(tip(sim, site) - start) < 1e-3 * length


def test_power_off_cools_into_the_silicone_and_that_to_the_air():
    """First to the silicone's temperature, with C/G and C_b in series, then with C_b/λ_b."""
    sim = simulation(bending_module())
    sim.step([1.0, 0.0, 0.0], 2.0)
    heat = sim.bank.heat
    body = heat.body_capacity[0]
    fast = 1.0 / (heat.conductance[0] * (1.0 / heat.capacity[0] + 1.0 / body))
    gap = sim.temperature[0] - sim.body_temperature[0]
    sim.step([0.0, 0.0, 0.0], 2.0)
    assert sim.temperature[0] - sim.body_temperature[0] == pytest.approx(
        gap * math.exp(-2.0 / fast), rel=0.02
    )
    sim.step([0.0, 0.0, 0.0], 8.0)
    warm, slow = sim.temperature[0] - 25.0, (heat.capacity[0] + body) / heat.body_loss[0]
    sim.step([0.0, 0.0, 0.0], 20.0)
    assert sim.temperature[0] - 25.0 == pytest.approx(warm * math.exp(-20.0 / slow), rel=0.02)


def test_a_cold_tca_is_at_rest_in_the_unloaded_body():
    """Without gravity nothing moves, whatever the module."""
    for build, nodes, *_ in WORKING.values():
        sim = simulation(build(nodes), gravity=0.0)
        assert sim.tension == pytest.approx(np.zeros(sim.n), abs=1e-9)
        assert sim.length == pytest.approx(sim.bank.rest_length, rel=1e-9)
        start = sim.data.qpos.copy()
        sim.step(np.zeros(sim.n), 1.0)
        assert sim.data.qpos == pytest.approx(start, abs=1e-6)


def test_the_arm_would_weigh_six_grams_with_a_bending_module_of_its_outline():
    """Sun, Section 4.1.4, without the carriage of the base; the module's section is thinner."""
    model, spec = arm().spec.compile(), ArmSpec().bending
    mass = model.body_mass.sum() - model.body("base").mass[0]
    section = math.pi / 4.0 * (spec.outer_diameter**2 - spec.diameter**2)
    assert mass < 4.0e-3
    assert mass + 1070.0 * section * spec.length == pytest.approx(6.0e-3, rel=0.05)


@pytest.mark.parametrize(
    ("part", "names"),
    [
        (bending_module, ["tca0", "tca1", "tca2"]),
        (twisting_module, ["tca"]),
        (finger_pair, ["tca"]),
        (
            arm,
            ["bending.tca0", "bending.tca1", "bending.tca2", "wrist.tca", "gripper.tca"],
        ),
    ],
)
def test_every_part_is_built_with_its_tcas_and_sites(part, names):
    built = part()
    assert [tca.name for tca in built.tcas] == names
    model = built.spec.compile()
    assert all(model.tendon(name).id >= 0 and model.actuator(name).id >= 0 for name in names)
    assert all(model.site(site).id >= 0 for site in built.sites.values())


def test_the_mass_of_a_module_is_silicone_and_tcas():
    spec = BendingSpec()
    part = bending_module(spec)
    mass = spec.body.mass + sum(tca.spec.mass for tca in part.tcas)
    assert part.spec.compile().body_mass.sum() == pytest.approx(mass, rel=1e-9)


def test_the_arm_hangs_from_its_base_and_moves_with_it():
    sim = Simulation(arm())
    lift = sim.model.joint("lift")
    sim.data.qpos[lift.qposadr] = sim.data.act[0] = ArmSpec().height
    sim.step(np.zeros(5), 1.0)
    before = tip(sim, "gripper.grasp")
    assert before[2] < ArmSpec().height - 70e-3
    sim.data.ctrl[0] = 0.02
    sim.step(np.zeros(5), 1.0)
    assert tip(sim, "gripper.grasp")[2] - before[2] == pytest.approx(0.02, abs=2e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: bending_module(BendingSpec(offset=5e-3)), r"route of tca0 must stay inside"),
        (lambda: bending_module(BendingSpec(length=-1.0)), "length must be .* above 0.*-1"),
        (lambda: bending_module(BendingSpec(diameter=0.0)), "diameter must be .* above 0, got 0"),
        (lambda: bending_module(BendingSpec(count=0)), "count must be at least 1, got 0"),
        (lambda: bending_module(BendingSpec(nodes=0)), "nodes must be at least 1, got 0"),
        (lambda: BendingSpec(offset=-1e-3), r"offset must be .* above 0, got -0\.001"),
        (lambda: BendingSpec(nodes=8.0), r"nodes must be a whole number, got 8\.0"),
        (lambda: BendingSpec(count=None), "count must be a whole number, got None"),
        (lambda: BendingSpec(diameter="thick"), "diameter must be a real number .* got 'thick'"),
        (lambda: TwistingSpec(radius=0.0), r"radius must be .* above 0, got 0\.0"),
        (lambda: TwistingSpec(tube=math.inf), "tube must be finite .* got inf"),
        (lambda: TwistingSpec(tube=1.2e-3), "tube must be finite and above 0.00127304 m"),
        (lambda: FingerPairSpec(closure=0.0), r"closure must be .* above 0 .*, got 0\.0"),
        (lambda: FingerPairSpec(layer=-1e-3), r"layer must be .* above 0, got -0\.001"),
        (lambda: FingerPairSpec(friction=-1.0), r"friction must be .* at least 0, got -1\.0"),
        (lambda: FingerPairSpec(friction=math.nan), "friction must be .* got nan"),
        (lambda: twisting_module(TwistingSpec(nodes=6)), "three sites per turn, got 2.40"),
        (lambda: twisting_module(TwistingSpec(double=False)), "three sites per turn, got 1.60"),
        (lambda: twisting_module(TwistingSpec(radius=6e-3)), r"route of tca must stay inside"),
        (lambda: twisting_module(TwistingSpec(length=math.nan)), "length must be .* got nan"),
        (lambda: finger_pair(FingerPairSpec(offset=9e-3)), "route of tca must stay inside"),
        (lambda: finger_pair(FingerPairSpec(width=0.0)), "above 0, got 0"),
        (lambda: finger_pair(FingerPairSpec(half_width=-1e-3)), "half_width must be .* at least 0"),
        (lambda: ArmSpec(connector=0.0), r"connector must be finite and above 0, got 0\.0"),
        (lambda: ArmSpec(speed=-1.0), r"speed must be finite and above 0, got -1\.0"),
        (lambda: ArmSpec(speed=math.inf), "speed must be finite and above 0, got inf"),
        (lambda: ArmSpec(travel=0.1), r"travel must be finite numbers of shape \(2,\), got 0\.1"),
        (lambda: ArmSpec(travel=(0.1, math.inf)), r"travel must be .* got \(0\.1, inf\)"),
        (lambda: ArmSpec(travel=(0.2, 0.1)), r"travel must be .* got \(0\.2, 0\.1\)"),
        (lambda: ArmSpec(height=0.5), r"height must be .* at most 0\.18 m, of travel, got 0\.5"),
    ],
)
def test_what_cannot_be_built_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()

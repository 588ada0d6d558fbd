"""``TCA/AdaptiveGrasp-v0`` and its gripper: geometry, theory, morphing, and that it holds."""

import math

import numpy as np
import pytest

from tca_mj.agents.scripts.adaptive import AdaptivePolicy
from tca_mj.certify.cases import Case, at_rest, gap, theory
from tca_mj.certify.rest import Load
from tca_mj.certify.subjects import read
from tca_mj.envs.adaptive import ACTION, OBJECTS, OBSERVATION, AdaptiveGrasp
from tca_mj.modules.morphing import MorphingSpec
from tca_mj.modules.soft_finger import SoftFingerSpec, soft_finger
from tca_mj.robots.adaptive_gripper import (
    AdaptiveGripperSpec,
    adaptive_gripper,
    hardened_gripper,
)
from tca_mj.sim import Simulation

OFF = ACTION.still


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it."""
    return AdaptiveGrasp(action="power")


def act(**rows):
    """An action with some rows away from off."""
    action = OFF.copy()
    for name, value in rows.items():
        action[ACTION.slices[name.replace("_", " ")]] = value
    return action


def weightless(spec, angle):
    """The gripper cold and fixed in an angle, without weight; its pads' distance."""
    part = adaptive_gripper(spec)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part, timestep=5e-3, tca_period=0.1)
    names = [sim.model.joint(i).name for i in range(sim.model.njnt)]
    bends = [i for i, name in enumerate(names) if name.startswith("base.") and "bend_x" in name]

    def place(data):
        data.qpos[sim.model.jnt_qposadr[bends]] = angle / len(bends)

    sim.reset(place)
    pads = [sim.data.site(f"finger{i}.pad").xpos for i in range(2)]
    return sim, pads


@pytest.mark.parametrize("degrees", [0.0, 100.0, 215.0])
def test_the_gap_is_that_of_two_arcs(degrees):
    spec = AdaptiveGripperSpec()
    _, (one, other) = weightless(spec, math.radians(degrees))
    # A chain sums up its arc by the trapezoidal rule: its end is nearer by (bend of a cell)²/12.
    length, angle = spec.base.spine.length, math.radians(degrees)
    out = length * (math.sin(angle / 2.0) / (angle / 2.0) if angle else 1.0)
    off = out * (angle / spec.base.nodes) ** 2 / 12.0
    assert one[0] - other[0] == pytest.approx(spec.gap(angle) - off, abs=2e-5)
    assert one[2] == pytest.approx(other[2], abs=1e-9) and abs(one[1]) < 1e-9
    assert spec.angle_for(spec.gap(math.radians(degrees))) == pytest.approx(
        math.radians(degrees), abs=1e-6
    )


def test_a_finger_under_working_loads_is_what_theory_says():
    """Pinching, pushed back at its end, and along it by what it carries: within 1 % of it."""
    subject = read(soft_finger(), what="finger", tips={"body": "tip"})
    for temperature, push, weight in ((25.0, 0.02, 0.02), (120.0, 0.05, 0.02), (160.0, 0.1, 0.07)):
        case = Case(
            temperature=np.array([temperature]), posture="hanging",
            load=Load(force=np.array([[-push, 0.0, weight]]), moment=np.zeros((1, 3)),
                      gravity=np.array([0.0, 0.0, 9.81])),
        )  # fmt: skip
        exact = theory(subject, case)
        off = gap(subject, at_rest(subject, case), exact)
        assert off.position < 0.01 and off.strain < 0.01
        assert exact.tension[0] > (0.1 if temperature > 100.0 else -1.0)


def test_the_hardened_gripper_under_its_grip_is_what_theory_says():
    """Base in the can's angle, one pad pushed outwards: within 1 % of the way to a tip."""
    part = hardened_gripper(angle=math.radians(158.0))
    subject = read(part, what="gripper")
    assert "finger1" in subject.tips[-1]  # theory loads one tip, the last
    force = np.zeros((len(subject.tips), 3))
    force[-1] = -0.07, 0.0, 0.07
    case = Case(
        temperature=np.array([60.0, 150.0]), posture="hanging",
        load=Load(force=force, moment=np.zeros_like(force), gravity=np.array([0.0, 0.0, 9.81])),
    )  # fmt: skip
    off = gap(subject, at_rest(subject, case), theory(subject, case))
    assert off.position < 0.01


def test_both_halves_bend_alike_and_as_one_module(shared):
    """Weightless, soft, its TCA warm: the angle of a module that is clamped at one end."""
    from tca_mj.smp.lumped import LumpedModule

    base = MorphingSpec(motions=("bend_x",))
    module = LumpedModule(base.spine, base.heater, base.sheathed)
    sim, _ = weightless(AdaptiveGripperSpec(), 0.0)
    sim.step([0.0, 0.0, 0.0], 7.5, voltage=25.0)
    power = sim.keep([120.0, 25.0, 25.0])
    sim.step(power, 3.0, voltage=9.5)
    names = [sim.model.joint(i).name for i in range(sim.model.njnt)]
    halves = [
        sum(float(sim.data.qpos[sim.model.jnt_qposadr[i]]) for i, name in enumerate(names)
            if name.startswith(f"base.half{side}.") and "bend_x" in name)
        for side in range(2)
    ]  # fmt: skip
    assert halves[0] == pytest.approx(halves[1], rel=1e-6)
    # The same tension bends a spine of this stiffness by F a L/(E I).
    spine = base.spine
    stiff = spine.smp.modulus(float(sim.spines.temperature[0])) * spine.second_moment
    stiff += base.body.bending[0]
    angle = float(sim.tension[0]) * 2.0 * spine.tca_offset * spine.length / stiff
    assert sum(halves) == pytest.approx(angle, rel=0.02)
    assert module.tca_length(np.array([sum(halves)]))[0] == pytest.approx(sim.length[0], rel=2e-3)


def test_the_objects_are_what_the_table_says(shared):
    model = shared.model
    for name, thing in OBJECTS.items():
        assert model.body_mass[shared._bodies[name]].sum() == pytest.approx(thing.mass, rel=1e-6)
        shared.reset(seed=0, options={"object": name})
        for _ in range(3):
            *_, info = shared.step(OFF)
        assert info["height"] == pytest.approx(0.0, abs=0.3e-3)  # it stands
        parked = [other for other in OBJECTS if other != name]
        for other in parked:
            place = shared.data.qpos[shared._free_q[other] :][:3]
            assert place[:2] == pytest.approx(OBJECTS[other].parked, abs=1e-9)
            assert place[2] == pytest.approx(OBJECTS[other].height + 0.2e-3, abs=1e-6)


def test_what_floats_is_taken_back_with_a_state(shared):
    shared.reset(seed=1, options={"object": "can"})
    state = shared.get_state()
    shared.reset(seed=2, options={"object": "glove"})
    shared.set_state(state)
    floats = shared.model.body_gravcomp[[shared._bodies[name][0] for name in OBJECTS]]
    assert floats.tolist() == [1.0, 0.0, 1.0, 1.0]


def test_heating_the_bases_tca_while_it_is_stiff_ends_the_episode(shared):
    shared.reset(seed=0, options={"object": "ball", "start": 0.0})
    for _ in range(20):
        *_, truncated, info = shared.step(act(TCA_heating=[-0.4, -1.0, -1.0]))
        if truncated:
            break
    assert truncated and "stiff spine" in info["truncation_reason"]
    assert info["reward_terms"]["damage"] == -10.0


@pytest.mark.parametrize("name", OBJECTS)
def test_the_script_morphs_by_the_resistance_and_hardens(shared, name):
    """Within 3° of its command once rigid; nothing of the observed angle is used."""
    policy = AdaptivePolicy()
    observation, info = shared.reset(seed=200, options={"object": name, "start": 0.5})
    hidden = OBSERVATION.slices["angle of the base"]
    for _ in range(350):
        observation[hidden] = np.nan
        action = policy.act(observation)
        if policy.phase == "lower":
            break
        observation, _, _, truncated, info = shared.step(action)
        assert not truncated
    assert policy.phase == "lower" and info["spine_temperature"][0] <= 80.0
    assert math.degrees(abs(info["angle"] - policy.angle)) < 3.0


@pytest.mark.parametrize("name", ["can"])
def test_the_script_holds_and_lets_go(shared, name):
    """The base already in the angle that suits the object; the whole way is in the docs."""
    policy = AdaptivePolicy(frozen=True)
    # Fixed there as an even arc: one that has hardened bends most in its middle, see the script.
    start = shared.gripper_spec.angle_for(OBJECTS[name].width + 2.0 * policy.gains.clearance)
    observation, info = shared.reset(seed=3, options={"object": name, "start": start})
    ended, hottest = False, 0.0
    while not ended:
        observation, _, terminated, truncated, info = shared.step(policy.act(observation))
        hottest, ended = max(hottest, info["temperature"].max()), terminated or truncated
        ended = ended or info["time"] > 110.0
    assert info["success"] and info["held_for"] == 10.0 and hottest < 172.0
    assert math.degrees(abs(info["angle"] - start)) < 3.0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: SoftFingerSpec(motions=("bend_x",)), "motions must contain 'bend_y'"),
        (lambda: SoftFingerSpec(pad_height=2e-3), "pad_height must be .* at least"),
        (lambda: AdaptiveGripperSpec(base=MorphingSpec(nodes=5)), "base.nodes must be even, got 5"),
        (lambda: AdaptiveGripperSpec().angle_for(0.3), "gap must be .* at most"),
    ],
)
def test_a_gripper_that_cannot_be_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()

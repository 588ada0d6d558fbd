"""``TCA/BistableGrasp-v0``: what the gripper carries, and that the script carries it unpowered."""


import pytest

from tca_mj.agents.scripts.bistable_grasp import BistableGraspPolicy
from tca_mj.envs.bistable_grasp import ACTION, OBSERVATION, BistableGrasp
from tca_mj.robots.bistable_gripper import BistableGripperSpec, bistable_gripper
from tca_mj.sim import Simulation
from tca_mj.validation.carrying import limit_load, without_bands
from tca_mj.validation.pulses import CLOSE, OPEN, endured

OFF = ACTION.still
SURE = {"tca_gain": 1.0, "heat_loss": 1.0, "ambient": 25.0}


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it."""
    return BistableGrasp()


def test_both_states_hold_without_power(shared):
    """Open is state 1, closed state 2, each near where theory has it without TCAs."""
    observation, info = shared.reset(seed=0)
    first, _, second = shared.gripper_spec.finger.rod.states()
    rows = OBSERVATION.read(observation)
    assert rows["bend of the fingers"] == pytest.approx([first, first], abs=0.25)
    for _ in range(5):
        observation, *_, info = shared.step(OFF)
    assert OBSERVATION.read(observation)["bend of the fingers"].max() < 0.8 * first
    assert info["energy"].sum() == 0.0
    sim = Simulation(bistable_gripper(), timestep=1e-3, tca_period=2e-2)
    names = [sim.model.joint(i).name for i in range(sim.model.njnt)]
    bends = [i for i, name in enumerate(names) if "finger" in name]
    dofs = sim.model.jnt_qposadr[bends]

    def place(data):
        data.qpos[dofs] = second / 10.0
        data.qpos[1] = data.act[1] = 0.1

    sim.reset(place)
    sim.step([0.0] * 4, 0.6)
    assert sim.data.qpos[dofs].reshape(2, 10).sum(axis=1) == pytest.approx(second, abs=0.3)


def test_the_limit_load_does_not_depend_on_the_step():
    """Slowly loaded; suddenly loaded it would scatter."""
    load = limit_load(BistableGripperSpec())
    assert load == pytest.approx(limit_load(BistableGripperSpec(), timestep=5e-4), rel=0.03)
    assert load > 34e-3


def test_bands_are_what_holds():
    bare = without_bands(BistableGripperSpec())
    cold, hot = limit_load(bare), limit_load(bare, 168.0)
    assert cold < 5e-3  # nothing but the start of the load
    assert cold < hot < limit_load(BistableGripperSpec())


def carried(env, seed, options):
    """Infos and rewards of an episode of the script."""
    policy = BistableGraspPolicy()
    observation, info = env.reset(seed=seed, options=options)
    infos, rewards, ended = [info], [], False
    while not ended:
        observation, reward, terminated, truncated, info = env.step(policy.act(observation))
        infos.append(info)
        rewards.append(reward)
        ended = terminated or truncated
    return infos, rewards


def test_the_script_carries_fifteen_grams_for_a_minute_without_power(shared):
    """And its own TCAs open it, below the temperature that is safe."""
    options = SURE | {"object_mass": 15e-3, "hold_from": 10.0, "hold_for": 60.0, "randomise": 0.2}
    infos, rewards = carried(shared, 0, options)
    last = infos[-1]
    assert last["success"] and last["held_for"] == pytest.approx(60.0, abs=0.11)
    held = [info for info in infos if 10.0 <= info["time"] <= 70.0]
    assert held[0]["energy"].sum() == held[-1]["energy"].sum()
    assert held[-1]["height"] > held[0]["height"] - 2e-3  # it hardly creeps
    assert max(info["temperature"].max() for info in infos) < shared.safe_temperature
    assert shared.away < 5e-3 and infos[-1]["time"] < 80.0
    terms = {name: sum(info["reward_terms"][name] for info in infos[1:]) for name in shared.terms}
    assert terms["hold"] == pytest.approx(10.0, abs=0.1) and terms["goal"] == 20.0
    assert sum(rewards) == pytest.approx(sum(terms.values()))


def test_a_current_that_would_melt_the_tca_alone_opens_the_gripper_in_time_that_is_safe():
    """1.5 A close it in the published 0.8 s; to open it they need longer than 1.5 s."""
    close, open_ = endured(CLOSE), endured(OPEN)
    melting = BistableGripperSpec().finger.tca.fibre.melting_temperature
    assert close.over < CLOSE.seconds and close.inside < BistableGrasp.safe_temperature
    assert open_.alone > melting and open_.inside < BistableGrasp.safe_temperature
    assert OPEN.seconds < open_.over < open_.safe_inside


def test_what_is_let_go_elsewhere_is_no_success(shared):
    shared.reset(seed=0, options={"goal": 20e-3, "hold_from": 8.0, "hold_for": 1.0})
    shared.data.time = 9.05  # and the object stands where it stood
    shared._untouched = 1.0
    *_, terminated, truncated, info = shared.step(OFF)
    assert terminated and not truncated and not info["success"]
    assert info["termination_reason"].startswith("let go 2")


def test_the_object_has_its_mass(shared):
    shared.reset(seed=1, options=SURE | {"object_mass": 12e-3, "mass": 1.2})
    assert shared.model.body_mass[shared._bodies].sum() == pytest.approx(14.4e-3)
    state = shared.get_state()
    shared.reset(seed=2, options={"object_mass": 6e-3})
    shared.set_state(state)
    assert shared.model.body_mass[shared._bodies].sum() == pytest.approx(14.4e-3)


def test_the_action_moves_the_carriage(shared):
    start = OBSERVATION.read(shared.reset(seed=0)[0])["carriage, y and z"]
    action = OFF.copy()
    action[ACTION.slices["carriage velocity, y and z"]] = 0.5, 1.0
    for _ in range(4):
        observation, *_ = shared.step(action)
    moved = OBSERVATION.read(observation)["carriage, y and z"] - start
    assert moved == pytest.approx([8e-3, 16e-3], rel=0.15)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: BistableGripperSpec(finger=1), r"finger must be"),
        (lambda: BistableGripperSpec(spacing=-1.0), r"spacing must be"),
        (lambda: BistableGrasp(timestep=3e-3), r"timestep must be 0\.1 s over a multiple of 20"),
        (lambda: bistable_gripper(1), r"spec must be"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()

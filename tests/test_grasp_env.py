"""``TCA/Grasp-v0``: what a block is, when it counts as held, and that the script holds it."""

import numpy as np
import pytest

from tca_mj.agents.scripts.grasp import GraspPolicy
from tca_mj.envs.grasp import ACTION, OBSERVATION, Grasp
from tca_mj.robots.gripper import GripperSpec, gripper
from tca_mj.robots.lift import LiftSpec
from tca_mj.validation.gripping import pinched

OFF = np.array([-1.0, 0.0], dtype=np.float32)
BLOCK = {"width": 6e-3, "stiffness": 200.0, "object_mass": 0.8e-3, "object_position": [0.0, 0.0]}


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it."""
    return Grasp()


def episode(env, policy, **reset):
    """All infos of an episode, and its rewards."""
    observation, info = env.reset(**reset)
    policy.reset()
    infos, rewards, ended = [info], [], False
    while not ended:
        observation, reward, terminated, truncated, info = env.step(policy.act(observation))
        infos.append(info)
        rewards.append(reward)
        ended = terminated or truncated
    return infos, rewards


def squeezed(env, width):
    """Force [N] that the cold gripper presses a hard block with, and how wide that still is [m]."""
    env.reset(seed=0, options=BLOCK | {"width": width, "stiffness": 2000.0})
    model, data = env.model, env.data
    model.opt.gravity[2] = 0.0
    env.sim.step([130.0], 5.0)
    middle = data.site_xpos[env._tips].mean(axis=0)
    data.qpos[env._free_q : env._free_q + 3] = middle + [0.0, 0.0, 1.5e-3]
    data.qvel[:] = 0.0
    env.sim.step([25.0], 2.0)
    env.sim.tca = env.sim.bank.rest()  # the silicone as cold as the TCA
    env.sim.step([25.0], 1.0)
    model.opt.gravity[2] = -9.81
    sides = data.qpos[model.jnt_qposadr[env._sides]]
    return 4000.0 * float(np.mean(width / 2.0 - sides)), float(sides.sum())


def test_the_force_grows_with_the_width_as_theory_says(shared):
    """Fig. 4.2c, on what the task holds: a block pressed by the fingers' inner edges."""
    forces = np.linspace(0.0, 0.14, 8)
    widths = pinched(forces, shearable=False)
    found = [squeezed(shared, width) for width in (4e-3, 6e-3, 8e-3)]
    pressed, left = (np.array(row) for row in zip(*found, strict=True))
    assert pressed == pytest.approx(np.interp(left, widths, forces), rel=0.08)
    slope = pressed @ left / (left @ left)
    assert np.abs(pressed - slope * left).max() < 0.1 * pressed.max()  # nearly linear


def test_the_block_is_what_was_asked_for(shared):
    _, info = shared.reset(seed=1, options=BLOCK)
    model = shared.model
    assert model.body_mass[shared._bodies].sum() == pytest.approx(0.8e-3)
    springs = model.jnt_stiffness[shared._sides]
    assert 1.0 / (1.0 / springs).sum() == pytest.approx(200.0)  # one behind the other
    assert shared.data.qpos[model.jnt_qposadr[shared._sides]].sum() == pytest.approx(6e-3)
    assert info["held_for"] == 0.0 and not info["touched"]
    shared.reset(seed=1, options=BLOCK | {"mass": 1.5})
    assert model.body_mass[shared._bodies].sum() == pytest.approx(1.2e-3)
    shared.reset(seed=1, options=BLOCK)
    whole = model.body_mass.sum()
    assert model.body_subtreemass[0] == pytest.approx(whole, rel=1e-12)


def test_the_block_keeps_its_mass_in_a_state_that_is_taken_back(shared):
    shared.reset(seed=1, options=BLOCK)
    state = shared.get_state()
    shared.reset(seed=2, options=BLOCK | {"object_mass": 0.4e-3})
    shared.set_state(state)
    assert shared.model.body_mass[shared._bodies].sum() == pytest.approx(0.8e-3)


def test_a_block_that_is_not_lifted_in_time_ends_the_episode(shared):
    shared.reset(seed=0, options=BLOCK | {"hold_from": 11.0})
    shared.data.time = 10.8
    *_, terminated, _, info = shared.step(OFF)
    assert not terminated
    _, reward, terminated, truncated, info = shared.step(OFF)
    assert terminated and not truncated and not info["success"]
    assert info["termination_reason"] == "not held at 11.0 s"
    assert info["reward_terms"]["end"] == -5.0 and reward < -4.9


def test_the_action_heats_and_moves_the_base(shared):
    observation, _ = shared.reset(seed=0, options=BLOCK)
    start = OBSERVATION.read(observation)
    for _ in range(3):
        observation, *_, info = shared.step(np.array([1.0, 1.0], np.float32))
    rows = OBSERVATION.read(observation)
    assert rows["base height"] - start["base height"] == pytest.approx(12e-3, rel=0.15)
    assert info["energy"].sum() == pytest.approx(3.0, rel=1e-6)  # 10 W for 0.3 s
    assert rows["TCA temperature"] == pytest.approx(shared.sim.temperature, rel=1e-6)
    assert ACTION.size == 2


@pytest.mark.parametrize("seed", [0, 3])
def test_the_script_holds_and_lets_go_in_time(shared, seed):
    infos, rewards = episode(shared, GraspPolicy(), seed=seed)
    last, due = infos[-1], shared.hold_until - shared.hold_from
    assert last["success"] and last["held_for"] == pytest.approx(due, abs=0.11)
    assert max(info["temperature"][0] for info in infos) < 165.0
    held = [info for info in infos if shared.hold_from <= info["time"] <= shared.hold_until]
    assert held[-1]["energy"][0] == held[0]["energy"][0]  # holding takes no energy
    terms = {name: sum(info["reward_terms"][name] for info in infos[1:]) for name in shared.terms}
    assert terms["hold"] == pytest.approx(10.0, abs=0.3) and terms["goal"] == 20.0
    assert sum(rewards) == pytest.approx(sum(terms.values()))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: LiftSpec(travel=(0.2, 0.1)), r"travel must be a low and a higher height"),
        (lambda: LiftSpec(height=0.5), r"height must be .* at most 0\.18 m, of travel, got 0\.5"),
        (lambda: GripperSpec(lift=0.1), r"lift must be"),
        (lambda: gripper(1), r"spec must be"),
    ],
)
def test_a_gripper_that_cannot_be_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()

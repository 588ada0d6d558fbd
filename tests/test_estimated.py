"""Tasks that see their TCAs as an observer tells them, by voltage and current."""

import gymnasium as gym
import numpy as np
import pytest

import tca_mj
from tca_mj.envs.vector import TaskVector
from tca_mj.registry import task_class

TASK = "TCA/BendReach-v0"


def heated(env, steps=40, seed=3):
    """Observations of an episode in which the TCAs are heated at random."""
    random, (first, _) = np.random.default_rng(seed), env.reset(seed=seed)
    actions = random.uniform(-1.0, 0.0, (steps, *env.action_space.shape)).astype(np.float32)
    return actions, [first, *(env.step(action)[0] for action in actions)]


def test_what_is_estimated_is_near_the_truth_and_the_rest_is_as_it_was():
    seen, true = tca_mj.make(TASK, estimated=True), tca_mj.make(TASK)
    (_, estimated), (_, real) = heated(seen), heated(true)
    table = true.unwrapped.observation
    mine, theirs = table.read(np.array(estimated)), table.read(np.array(real))
    off = {name: np.sqrt(np.mean((mine[name] - theirs[name]) ** 2)) for name in theirs}
    assert 0.0 < off.pop("TCA temperature") < 1.0
    stroke = true.unwrapped.sim.bank.rest_length[0] * 0.363
    assert 0.0 < off.pop("TCA length") < 0.04 * stroke  # a reading in 0.1 s, of 10 mohm
    assert 0.0 < off.pop("TCA tension") < 0.02
    assert set(off.values()) == {0.0}


def test_a_vector_environment_estimates_as_a_single_one_bit_for_bit():
    many = TaskVector(task_class(TASK), num_envs=2, estimated=True)
    many.reset(seed=[5, 3])
    one = tca_mj.make(TASK, estimated=True)
    actions, seen = heated(one, 10)
    for action, alone in zip(actions, seen[1:], strict=True):
        together = many.step(np.stack([np.full_like(action, -0.5), action]))[0]
        assert np.array_equal(together[1], alone)
    many.close()


def test_an_episode_goes_on_from_a_state_of_it_with_what_was_believed():
    env = tca_mj.make(TASK, estimated=True)
    actions, _ = heated(env, 10)
    task = env.unwrapped
    kept = task.get_state()
    once = [task.step(action)[0] for action in actions]
    task.set_state(kept)
    assert np.array_equal(once, [task.step(action)[0] for action in actions])


def test_only_tcas_that_are_seen_can_be_estimated():
    with pytest.raises(ValueError, match="estimated must be False unless all muscles are TCAs"):
        gym.make("TCA/FingerSense-v0", estimated=True)

"""The adapter for Stable-Baselines3: bit for bit its own ``DummyVecEnv`` over the single tasks."""

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

from tca_mj.agents.train.sb3_env import TaskVecEnv, silence
from tca_mj.registry import TASKS

QUICK = "TCA/MorphModule-v0"


def same(a, b) -> bool:
    """Equal in every bit, at any depth."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(*pair) for pair in zip(a, b, strict=True))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    return a == b


def both(id: str, n: int, limit: int):
    ours = TaskVecEnv.make(id, n, num_threads=2, max_episode_steps=limit)
    return ours, DummyVecEnv([lambda: gym.make(id, max_episode_steps=limit)] * n)


@pytest.mark.parametrize("id", [task.id for task in TASKS])
def test_it_is_bit_for_bit_the_dummy_over_single_tasks(id):
    ours, theirs = both(id, 2, 5)
    actions, ends = np.random.default_rng(0), 0
    for envs in (ours, theirs):
        envs.seed(5)
    assert same(ours.reset(), theirs.reset())
    assert same(ours.reset_infos, theirs.reset_infos)
    for _ in range(11):
        action = actions.uniform(-1.0, 1.0, (2, *ours.action_space.shape)).astype(np.float32)
        a, b = ours.step(action), theirs.step(action)
        assert same(a, b)
        assert same(ours.reset_infos, theirs.reset_infos)
        ends += sum("terminal_observation" in info for info in a[3])
    assert ends >= 4


def test_options_and_seeds_hold_for_one_reset():
    ours, theirs = both(QUICK, 2, 50)
    for envs in (ours, theirs):
        envs.seed(1)
        envs.set_options([{"target": 1.0}, {"target": 2.0}])
        envs.reset()
        assert envs.get_attr("target") == [1.0, 2.0]
        envs.reset()
    assert ours.get_attr("target") == theirs.get_attr("target") != [1.0, 2.0]


def test_options_of_every_reset():
    envs = TaskVecEnv.make(QUICK, 2, max_episode_steps=2, reset_options={"target": 1.0})
    envs.reset()
    for _ in range(2):
        _, _, dones, _ = envs.step(-np.ones((2, 3), np.float32))
    assert dones.all()
    assert [info["target"] for info in envs.reset_infos] == [1.0, 1.0]


def test_what_learners_ask_of_it():
    envs = TaskVecEnv.make(QUICK, 3)
    envs.reset()
    envs.set_attr("target", 1.5, indices=[0, 2])
    assert envs.get_attr("target", indices=[0, 2]) == [1.5, 1.5]
    assert envs.get_attr("target", indices=1) != [1.5]
    assert len(envs.env_method("command", np.zeros(3), indices=[1])) == 1
    assert envs.env_is_wrapped(Monitor) == [False] * 3
    assert envs.has_attr("sim") and not envs.has_attr("nothing")
    assert envs.render_mode is None and list(envs.get_images()) == [None] * 3
    envs.close()
    with pytest.raises(ValueError, match="task must be a SimulatedTask, got 'CartPole-v1'"):
        TaskVecEnv.make("CartPole-v1", 1)


def test_a_learner_learns_from_it_normalised():
    """PPO's rollouts of our environment and of the dummy lead to the same network."""
    policies = []
    for envs in both(QUICK, 2, 20):
        learner = PPO(
            "MlpPolicy", VecNormalize(VecMonitor(envs)), n_steps=32, batch_size=32, n_epochs=2,
            seed=0, device="cpu",
        )  # fmt: skip
        silence(learner)
        learner.learn(128)
        assert learner.ep_info_buffer and learner.ep_info_buffer[0]["l"] <= 20
        policies.append(learner.policy.state_dict())
    assert all((policies[0][key] == policies[1][key]).all() for key in policies[0])


def test_scaled_observations_are_those_of_the_table():
    """Also the last one of an episode, and at another control period."""
    made = [TaskVecEnv.make("TCA/BendReach-v0", 2, scaled=scaled, control_period=0.2,
                            max_episode_steps=2) for scaled in (False, True)]  # fmt: skip
    table = made[0].tasks.envs[0].observation
    for envs in made:
        envs.seed(3)
    plain, scaled = (envs.reset() for envs in made)
    assert np.array_equal(table.scaled(plain), scaled) and scaled[0] in made[1].observation_space
    for _ in range(2):
        actions = np.zeros((2, *made[0].action_space.shape), np.float32)
        (plain, *_, done, infos), (scaled, *_, others) = (envs.step(actions) for envs in made)
        assert np.array_equal(table.scaled(plain), scaled)
    assert done.all()
    for info, other in zip(infos, others, strict=True):
        last = info["terminal_observation"]
        assert np.array_equal(table.scaled(last), other["terminal_observation"])

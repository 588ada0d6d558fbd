"""``TCA/MorphModule-v0`` and its scripted policy."""

import hashlib
import math
from copy import copy
from dataclasses import replace

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from tca_mj.agents.scripts.morph import MorphPolicy
from tca_mj.control.morph import Phase
from tca_mj.envs.morph import ACTION, OBSERVATION, MorphModule
from tca_mj.smp import lumped

ID = "TCA/MorphModule-v0"
OFF = np.array([-1.0, -1.0, -1.0], dtype=np.float32)
HEAT = np.array([1.0, -1.0, -1.0], dtype=np.float32)
KEEP = np.array([2.0 * 9.5 / 25.0 - 1.0, -1.0, -1.0], dtype=np.float32)


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it; that resets forget everything is a test too."""
    return MorphModule(action="power")


def wild(env, steps, seed):
    """Random actions, at first such that nothing is harmed."""
    actions = np.random.default_rng(seed)
    for k in range(steps):
        action = actions.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        yield HEAT if k < 70 else np.array([KEEP[0], 0.3 * action[1] - 0.6, -1.0], np.float32)


def rollout(env, seed=7, steps=75):
    """Hash of all that an episode under random actions returns, to the last bit."""
    digest = hashlib.sha256()
    observation, info = env.reset(seed=seed)
    digest.update(observation.tobytes() + np.float64(info["target"]).tobytes())
    for action in wild(env, steps, seed):
        observation, reward, terminated, truncated, info = env.step(action)
        digest.update(observation.tobytes() + np.float64(reward).tobytes())
        digest.update(bytes([terminated, truncated]) + info["spine_temperature"].tobytes())
    digest.update(env.unwrapped.data.qpos.tobytes() + env.unwrapped.data.qvel.tobytes())
    return digest.hexdigest()


def episode(env, seed, **options):
    """The scripted policy; the rewards, every info, the policy."""
    policy, rewards, infos = MorphPolicy(), [], []
    observation, _ = env.reset(seed=seed, options=options)
    for _ in range(800):
        observation, reward, terminated, truncated, info = env.step(policy.act(observation))
        assert env.observation_space.contains(observation)
        rewards.append(reward)
        infos.append(info)
        if terminated or truncated:
            break
    return rewards, infos, policy


def test_it_is_registered_with_a_time_limit():
    env = gym.make(ID)
    assert isinstance(env.unwrapped, MorphModule)
    assert env.spec.max_episode_steps == 800
    env.reset(seed=0)
    env._elapsed_steps = env.spec.max_episode_steps - 1
    *_, truncated, info = env.step(OFF)
    assert truncated and "truncation_reason" not in info


def test_the_reward_is_the_sum_of_its_terms(shared):
    shared.reset(seed=1)
    energy = 0.0
    for action in wild(shared, 75, 1):
        _, reward, _, _, info = shared.step(action)
        assert reward == pytest.approx(sum(info["reward_terms"].values()), rel=1e-12, abs=1e-15)
        volts, watts = 12.5 * (action[0] + 1.0), 20.0 * (action[1] + 1.0)
        used = 0.1 * (volts**2 / float(shared.module_spec.heater.resistance) + watts)
        assert info["reward_terms"]["energy"] == pytest.approx(-0.01 * used, rel=1e-6)
        energy += used
    assert info["energy"][0] + info["heater_energy"][0] == pytest.approx(energy, rel=1e-6)


def test_the_observation_is_what_the_simulation_says(shared):
    shared.reset(seed=2)
    for action in wild(shared, 73, 2):
        observation, *_ = shared.step(action)
        assert OBSERVATION.outside(observation) == []
    rows, sim = OBSERVATION.read(observation), shared.sim
    assert rows["spine temperature"] == pytest.approx(sim.spines.temperature, rel=1e-6)
    assert rows["TCA temperature"] == pytest.approx(sim.temperature, rel=1e-6)
    assert rows["TCA length"] == pytest.approx(sim.length, rel=1e-6)
    assert rows["TCA resistance"] == pytest.approx(sim.resistance, rel=1e-6)
    assert rows["TCA tension"] == pytest.approx(sim.tension, rel=1e-6) and sim.tension > 2e-3
    assert rows["commanded angle"] == pytest.approx(shared.target, rel=1e-6)
    # The tip's axis in the x-z plane of the world, from straight down towards +x.
    data = copy(shared.data)
    mujoco.mj_kinematics(shared.model, data)
    axis = data.site("bench.module.tip").xmat.reshape(3, 3)[:, 2]
    assert rows["angle"] == pytest.approx(math.atan2(axis[0], -axis[2]), rel=1e-5)
    assert abs(axis[1]) < 1e-9
    assert rows["angular velocity"] == pytest.approx(shared.data.qvel.sum(), rel=1e-5)


def test_the_action_heats_cools_and_bends(shared):
    """-1 is off, 1 is 25 V or 40 W, the fan cools."""
    shared.reset(seed=3, options={"start": 0.0})
    for _ in range(70):
        *_, info = shared.step(HEAT)
    heater = shared.module_spec.heater
    assert info["heater_energy"] == pytest.approx([7.0 * 625.0 / heater.resistance])
    assert info["energy"] == pytest.approx([0.0]) and info["time"] == pytest.approx(7.0)
    *_, info = shared.step(np.array([-1.0, 0.0, -1.0], np.float32))
    assert info["energy"] == pytest.approx([2.0])
    dropped = []
    for fan in (-1.0, 1.0):
        before = info["spine_temperature"][0]
        *_, info = shared.step(np.array([-1.0, -1.0, fan], np.float32))
        dropped.append(before - info["spine_temperature"][0])
    assert dropped[1] / dropped[0] == pytest.approx(heater.fan_gain, rel=0.03)
    assert info["angle"] > 0.02


def test_options_do_not_shift_the_other_draws(shared):
    _, free = shared.reset(seed=11)
    _, told = shared.reset(seed=11, options={"start": 0.5})
    assert told["target"] == free["target"] and told["angle"] == pytest.approx(0.5)
    _, other = shared.reset(seed=11, options={"target": free["target"]})
    assert other["angle"] == free["angle"]
    _, far = shared.reset(seed=11, options={"target": 1.0})
    assert far["target"] == 1.0
    numbers = [shared.reset(seed=11, options=o)[1] and shared.np_random.random()
               for o in ({}, {"start": 1.0}, {"target": 1.0, "start": 1.0})]  # fmt: skip
    assert len(set(numbers)) == 1


def test_draws_fill_their_ranges_and_start_apart(shared):
    draws = []
    for seed in range(300):
        gym.Env.reset(shared, seed=seed)
        draws.append(shared.options.setup(shared.np_random, {}))
    target = np.degrees([draw["target"] for draw in draws])
    start = np.degrees([draw["start"] for draw in draws])
    assert 30.0 <= target.min() < 35.0 and 175.0 < target.max() <= 180.0
    assert target.mean() == pytest.approx(105.0, abs=4.0 * 150.0 / math.sqrt(12 * 300))
    assert 0.0 <= start.min() < 5.0 and 175.0 < start.max() <= 180.0
    assert 20.0 - 1e-9 <= np.abs(target - start).min() < 22.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weight": 1.0}, r"options must be some of \['ambient', .*'start'.*, got \['weight'\]"),
        ({"target": 0.2}, r"target must be between 0\.523599 and 3\.14159 rad, got 0\.2"),
        ({"target": math.nan}, r"target must be finite, got nan"),
        ({"target": (1.0, 2.0)}, r"target must be one finite number, got \(1"),
        ({"target": None}, r"target must be a real number .* got None"),
        ({"start": -0.1}, r"start must be between 0 and 3\.14159 rad, got -0\.1"),
    ],
)
def test_bad_options_are_refused(shared, options, message):
    with pytest.raises(ValueError, match=message):
        shared.reset(seed=0, options=options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"render_mode": "human"}, "render_mode must be one of .None, .* got 'human'"),
        ({"camera": "close"}, r"camera must be one of .None, .front., .side.., got 'close'"),
        ({"size": (0, 10)}, r"size\[0\] must be at least 1, got 0"),
        ({"timestep": 3e-3}, "timestep must be 0.1 s over a whole number, got 0.003"),
        ({"timestep": 0.0}, "timestep must be finite and at least 1e-06"),
    ],
)
def test_bad_arguments_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        MorphModule(**options)


def test_a_tca_heated_against_a_stiff_spine_ends_the_episode(shared):
    shared.reset(seed=0, options={"start": 0.0})
    for _ in range(5):
        _, _, terminated, truncated, info = shared.step(np.array([1.0, -0.5, -1.0], np.float32))
        if truncated:
            break
    assert truncated and not terminated and not info["success"] and info["damaged"]
    assert info["truncation_reason"].startswith("damaged: ")
    assert info["reward_terms"]["damage"] == -10.0
    _, info = shared.reset(seed=0)
    assert not info["damaged"]


@pytest.mark.parametrize("part", ["spine", "TCA"])
def test_too_much_heat_ends_the_episode(shared, part):
    where = f"bench.module.{part.lower()}"
    shared.reset(seed=0, options={"start": 0.0})
    for k in range(200):
        power = -0.4 if part == "TCA" and k >= 75 else -1.0
        voltage = KEEP[0] if part == "TCA" and k >= 70 else 1.0
        action = np.array([voltage, power, -1.0], np.float32)
        observation, _, _, truncated, info = shared.step(action)
        assert shared.observation_space.contains(observation)
        if truncated:
            break
        assert info["spine_temperature"].max() <= shared.max_spine_temperature
        assert info["temperature"].max() <= shared.max_temperature
    assert info["truncation_reason"].startswith(f"overheated: {where} above ")
    assert info["reward_terms"]["damage"] == 0.0


def test_a_module_that_rolls_up_has_not_diverged(shared):
    shared.reset(seed=0, options={"start": 0.0, "tca_gain": 3.3})
    for k in range(200):
        warm = k >= 75
        action = np.array([KEEP[0] if warm else 1.0, -0.66 if warm else -1.0, -1.0], np.float32)
        observation, _, terminated, truncated, info = shared.step(action)
        if terminated or truncated:
            break
    assert info["termination_reason"] == "rolled up" and not info["success"]
    assert info["angle"] > 2.0 * math.pi and observation in shared.observation_space


@pytest.mark.parametrize("seed", range(3))
def test_the_script_reaches_and_fixes_the_angle(shared, seed):
    rewards, infos, policy = episode(shared, seed)
    last = infos[-1]
    assert last["success"] and not last["damaged"]
    assert last["angle"] == pytest.approx(last["target"], abs=shared.tolerance)
    assert last["spine_temperature"][0] < 80.0 and last["time"] < 40.0
    assert max(info["temperature"][0] for info in infos) < 165.0
    assert last["energy"][0] + last["heater_energy"][0] < 550.0
    assert sum(rewards) > 14.0
    # It stays: the TCA cools, nothing is powered, and the angle does not move by 1°.
    for _ in range(200):
        *_, info = shared.step(OFF)
    assert info["angle"] == pytest.approx(last["angle"], abs=math.radians(1.0))
    assert info["energy"] == pytest.approx(last["energy"])
    assert policy.progress.phase is Phase.RELEASE


@pytest.mark.parametrize(
    ("name", "factor"), [("capacity", 1.2), ("capacity", 0.8), ("conductance", 0.8)]
)
def test_a_tube_that_is_known_to_20_percent_damages_nothing(monkeypatch, name, factor):
    """The script believes in the tube that is specified; the module has another one."""
    nominal = lumped.in_tube

    def other(tca, touching=0.0):
        tca = nominal(tca, touching)
        return replace(tca, body=replace(tca.body, **{name: factor * getattr(tca.body, name)}))

    monkeypatch.setattr(lumped, "in_tube", other)
    env = MorphModule(action="power")
    monkeypatch.setattr(lumped, "in_tube", nominal)
    believed = MorphPolicy().module_spec.sheathed.body
    real = env.sim.bank.specs[0].body
    assert getattr(real, name) == pytest.approx(factor * getattr(believed, name))
    _, infos, _ = episode(env, 4)
    assert infos[-1]["success"] and not infos[-1]["damaged"]


def test_the_goal_asks_for_rest(shared):
    """At the commanded angle, rigid and off for 3 s; being there with the fan on is not enough."""
    shared.reset(seed=0, options={"start": 1.0, "target": 1.04})
    fan = np.array([-1.0, -1.0, 1.0], np.float32)
    for action in (fan, *[OFF] * 29):
        observation, _, terminated, truncated, info = shared.step(action)
        assert not (terminated or truncated or info["success"])
    assert OBSERVATION.read(observation)["time at the goal"] == pytest.approx(2.9)
    _, _, terminated, _, info = shared.step(OFF)
    assert terminated and info["success"] and info["reward_terms"]["goal"] == 20.0
    shared.reset(seed=0, options={"start": 1.0, "target": 1.0})
    observation, *_ = shared.step(OFF)
    assert OBSERVATION.read(observation)["time at the goal"] == pytest.approx(0.1)
    shared.reset(seed=0, options={"start": 1.0, "target": 1.06})
    for _ in range(40):
        *_, info = shared.step(OFF)
    assert not info["success"]


def test_the_goal_asks_for_a_rigid_spine(shared):
    """At the commanded angle and off, but not below 80 °C yet: the time does not count."""
    shared.reset(seed=0, options={"start": 1.0, "target": 1.0})
    for _ in range(43):
        shared.step(HEAT)
    waited = 0
    for _ in range(100):
        observation, _, terminated, _, info = shared.step(OFF)
        assert abs(info["angle"] - info["target"]) < shared.tolerance
        if terminated:
            break
        if info["spine_temperature"][0] >= 80.0:
            waited += 1
            assert OBSERVATION.read(observation)["time at the goal"] == 0.0
    assert waited > 5 and info["success"] and info["spine_temperature"][0] < 80.0


def test_staying_where_it_is_good_earns_nothing(shared):
    """Reach and fix are changes: over any course they add up to its end minus its start."""
    shared.reset(seed=4, options={"start": 2.0, "target": 2.5})
    start, earned = dict(shared._progress), {"reach": 0.0, "fix": 0.0}
    for action in wild(shared, 90, 3):
        *_, info = shared.step(action)
        for name in earned:
            earned[name] += info["reward_terms"][name]
    for name, total in earned.items():
        assert total == pytest.approx(shared._progress[name] - start[name], abs=1e-12)
    assert earned["fix"] < -0.5  # softened: the shape is lost

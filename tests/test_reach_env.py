"""``TCA/BendReach-v0``, that its targets can be reached, and its scripted policy."""

import hashlib
import math
from copy import copy

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from tca_mj.agents.scripts.reach import ReachPolicy
from tca_mj.control import Thermostat
from tca_mj.envs.hanging import NoRest
from tca_mj.envs.reach import ACTION, OBSERVATION, BendReach
from tca_mj.modules.bending import BendingSpec
from tca_mj.record.render import RenderingUnavailable
from tca_mj.variation import Variation

ID = "TCA/BendReach-v0"
OFF = np.full(ACTION.size, -1.0, dtype=np.float32)
FULL = np.full(ACTION.size, 1.0, dtype=np.float32)


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it; that resets forget everything is a test too."""
    return BendReach(action="power")


def rollout(env, seed=7, steps=5, **options):
    """Hash of all that an episode under random actions returns, to the last bit."""
    digest = hashlib.sha256()
    observation, info = env.reset(seed=seed, options=options or {"randomise": 0.2})
    digest.update(observation.tobytes() + info["target"].tobytes())
    actions = np.random.default_rng(seed)
    for _ in range(steps):
        action = actions.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        digest.update(observation.tobytes() + np.float64(reward).tobytes())
        digest.update(bytes([terminated, truncated]) + info["temperature"].tobytes())
    digest.update(env.unwrapped.data.qpos.tobytes() + env.unwrapped.data.qvel.tobytes())
    return digest.hexdigest()


def thermostat(env):
    """What brings the TCAs of this very module to temperatures."""
    return Thermostat(heat=env.sim.bank.heat, max_power=env.max_power)


def heated(env, temperature, steps):
    """Infos of an episode in which the TCAs are brought to temperatures and kept there."""
    control, infos = thermostat(env), []
    for _ in range(steps):
        power = control.power(env.sim.temperature, temperature, env.sim.body_temperature)
        *_, info = env.step((2.0 * power / env.max_power - 1.0).astype(np.float32))
        infos.append(info)
    return infos


def test_the_time_limit_is_no_reason(shared):
    env = gym.wrappers.TimeLimit(shared, 1)
    env.reset(seed=0)
    *_, terminated, truncated, info = env.step(OFF)
    assert truncated and not terminated and "truncation_reason" not in info


def test_it_starts_cold_and_at_rest(shared):
    observation, info = shared.reset(seed=1)
    rows = OBSERVATION.read(observation)
    assert shared.observation_space.contains(observation)
    assert (rows["TCA temperature"] == 25.0).all() and (info["energy"] == 0.0).all()
    assert info["time"] == 0.0 and rows["time at the target"] == 0.0
    assert np.abs(rows["tip velocity"]).max() < 1e-4
    # Its weight stretches it: by less than half of it times the length over EA, as its TCAs help.
    body = shared.module_spec.body
    sag = 0.5 * 9.81 * body.line_density * body.length**2 / body.stretching
    x, y, z = rows["tip position"]
    assert abs(x) < 1e-6 and abs(y) < 1e-6 and -45e-3 - sag < z < -45e-3 - 0.2 * sag


@pytest.mark.parametrize(
    ("seed", "options"),
    [(0, {}), (1, {}), (2, {}), (3, {"randomise": 0.2}), (4, {"tca_gain": 1.5, "mass": 0.5}),
     (5, {"tca_gain": 0.5, "heat_loss": 2.0, "ambient": 5.0})],
)  # fmt: skip
def test_every_target_can_be_reached_and_kept(shared, seed, options):
    """From cold, with the power there is: heated to the temperatures of the target's draw."""
    _, info = shared.reset(seed=seed, options=options)
    wanted, heat = info["target_temperature"], shared.sim.bank.heat
    needed = heat.keeping(wanted, heat.ambient)  # while the silicone is cold; later it takes less
    assert wanted.max() <= shared.hottest_target and needed.max() <= 0.9 * shared.max_power + 1e-12
    assert info["distance_to_target"] > shared.tolerance
    infos = heated(shared, wanted, 90)
    assert infos[-1]["distance_to_target"] < 0.1e-3
    assert infos[-1]["temperature"] == pytest.approx(wanted, abs=0.2)
    assert max(info["temperature"].max() for info in infos) < shared.hot_temperature
    assert sum(info["success"] for info in infos) > 0


def test_where_it_rests_does_not_depend_on_what_was_before(shared):
    shared.reset(seed=0)
    static, random = shared.static, np.random.default_rng(3)
    for share in ((1.0, 0.0, 0.0), (1.0, 1.0, 0.0), *random.uniform(0.0, 1.0, (3, 3))):
        wanted = 25.0 + np.array(share) * (shared.hottest_target - 25.0)
        rest = static.at(wanted)
        static.at(25.0 + random.uniform(0.0, 1.0, 3) * 125.0)
        static.sim.step(static.sim.keep(wanted), 6.0)
        assert np.linalg.norm(static.tip() - rest) < 2e-5


def test_draws_fill_their_ranges(shared):
    rise = []
    for seed in range(500):
        gym.Env.reset(shared, seed=seed)
        rise.append(shared.options.setup(shared.np_random, {})["rise"])
    rise = np.array(rise)
    hottest = rise.max(axis=1)
    assert 0.5 <= hottest.min() < 0.51 and 0.99 < hottest.max() <= 1.0
    assert (rise.min(axis=1) <= 0.75 * hottest + 1e-12).all()
    counts = np.bincount(np.argmax(rise, axis=1))
    assert counts.min() > 130  # of 167
    # A draw of the least rise is still no target at which the cold module is already.
    shared.reset(seed=0)
    tip = shared.static.at(25.0 + 0.5 * np.array([1.0, 1.0, 0.75]) * 105.0)
    assert np.linalg.norm(tip - [0.0, 0.0, -45e-3]) > shared.tolerance


def test_a_given_target_is_found_or_refused(shared):
    _, free = shared.reset(seed=3)
    _, told = shared.reset(seed=3, options={"target": free["target"]})
    assert (told["target"] == free["target"]).all()
    assert told["target_temperature"] == pytest.approx(free["target_temperature"], abs=0.5)
    assert heated(shared, told["target_temperature"], 60)[-1]["distance_to_target"] < 0.15e-3
    with pytest.raises(ValueError, match=r"target must be where the tip can rest .* mm from there"):
        shared.reset(seed=0, options={"target": (0.03, 0.0, -0.04)})


def test_a_module_that_trembles_has_no_target_there(shared):
    """Two TCAs far hotter than 140 °C and one slack: no place of rest, so it is refused."""
    shared.reset(seed=0)
    with pytest.raises(NoRest, match=r"the tip moves .* m in 0\.1 s"):
        shared.static.at([170.0, 170.0, 25.0])
    _, info = shared.reset(seed=2, options={"tca_gain": 4.0})
    infos = heated(shared, info["target_temperature"], 90)
    assert infos[-1]["distance_to_target"] < 0.1e-3


def test_the_reward_is_the_sum_of_its_terms(shared):
    shared.reset(seed=1)
    random, energy = np.random.default_rng(1), 0.0
    for _ in range(5):
        action = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        before = shared._distance
        _, reward, _, _, info = shared.step(action)
        assert reward == pytest.approx(sum(info["reward_terms"].values()), rel=1e-12)
        used = 0.1 * float(np.sum(action.astype(float) + 1.0))
        gained = (before - info["distance_to_target"]) / 3e-3
        assert info["reward_terms"]["energy"] == pytest.approx(-0.02 * used)
        assert info["reward_terms"]["reach"] == pytest.approx(gained)
        energy += used
    assert info["energy"].sum() == pytest.approx(energy)


def test_shaking_and_staying_earn_nothing(shared):
    """Reach is a change: over any course it adds up to its end minus its start."""
    _, info = shared.reset(seed=4)
    first, earned = info["distance_to_target"], 0.0
    for k in range(60):
        *_, info = shared.step(FULL if k % 12 < 4 else OFF)
        earned += info["reward_terms"]["reach"]
    assert earned == pytest.approx((first - info["distance_to_target"]) / 3e-3)


def test_the_observation_is_what_the_simulation_says(shared):
    shared.reset(seed=2)
    for _ in range(10):
        observation, *_ = shared.step(np.array([0.6, -1.0, -0.5], np.float32))
    rows, sim = OBSERVATION.read(observation), shared.sim
    assert rows["TCA temperature"] == pytest.approx(sim.temperature, rel=1e-6)
    assert rows["TCA length"] == pytest.approx(sim.length, rel=1e-6)
    assert rows["TCA tension"] == pytest.approx(sim.tension, rel=1e-6) and sim.tension.min() > 2e-3
    tip = shared.data.site("bench.module.tip").xpos - [0.0, 0.0, 0.1]
    assert rows["tip position"] == pytest.approx(tip, rel=1e-6)
    later = copy(shared.data)
    mujoco.mj_integratePos(shared.model, later.qpos, later.qvel, 1e-5)
    mujoco.mj_kinematics(shared.model, later)
    now = copy(shared.data)
    mujoco.mj_kinematics(shared.model, now)
    way = later.site("bench.module.tip").xpos - now.site("bench.module.tip").xpos
    assert tip[0] > 1e-3 and abs(way[0]) > 1e-9
    assert rows["tip velocity"] == pytest.approx(way / 1e-5, abs=1e-3 * np.abs(way).max() / 1e-5)
    assert rows["target position"] == pytest.approx(shared.target, rel=1e-6)


def test_each_tca_bends_to_its_side(shared):
    for i in range(3):
        shared.reset(seed=0)
        action = OFF.copy()
        action[i] = 1.0
        for _ in range(15):
            observation, *_ = shared.step(action)
        x, y, _ = OBSERVATION.read(observation)["tip position"]
        angle = math.degrees(math.atan2(y, x)) % 360.0
        assert (angle + 120.0 * i + 1.0) % 360.0 == pytest.approx(1.0, abs=0.5)
        assert math.hypot(x, y) > 5e-3


def test_success_asks_for_a_second_at_the_target(shared):
    _, info = shared.reset(seed=5)
    wanted, control, held = info["target_temperature"], thermostat(shared), 0
    for _ in range(200):
        power = control.power(shared.sim.temperature, wanted, shared.sim.body_temperature)
        action = (2.0 * power / shared.max_power - 1.0).astype(np.float32)
        observation, _, terminated, truncated, info = shared.step(action)
        held = held + 1 if info["distance_to_target"] <= 3e-3 else 0
        seen = OBSERVATION.read(observation)["time at the target"]
        assert seen == pytest.approx(0.1 * held) and not truncated
        assert terminated == info["success"] == (held == 10)
        assert info["reward_terms"]["goal"] == (10.0 if terminated else 0.0)
        if terminated:
            break
    assert terminated


def test_too_much_heat_ends_the_episode(shared):
    shared.reset(seed=0, options={"heat_loss": 0.5})
    charged = 0.0
    for _ in range(60):
        observation, _, terminated, truncated, info = shared.step(FULL)
        assert shared.observation_space.contains(observation)
        terms, temperature = info["reward_terms"], info["temperature"]
        excess = np.maximum(temperature - 140.0, 0.0).sum()
        assert terms["heat"] == pytest.approx(-0.002 * excess)
        charged += terms["heat"]
        if truncated:
            break
    assert truncated and not terminated and charged < 0.0 and temperature.max() > 180.0
    assert info["truncation_reason"].startswith("overheated: bench.module.tca")
    assert terms["end"] == -5.0


def test_what_is_torn_has_not_diverged(shared):
    """Coils that touch pull with 20 N, four times what the observation holds."""
    shared.reset(seed=0, options={"tca_gain": 4.2, "heat_loss": 0.06})
    for _ in range(40):
        observation, *_, truncated, info = shared.step(FULL)
        if truncated:
            break
    assert info["truncation_reason"].startswith("torn: ") and info["tension"].max() > 5.0
    assert observation in shared.observation_space and info["cost"] >= 1.0


def test_options_do_not_shift_the_other_draws(shared):
    _, free = shared.reset(seed=11, options={"randomise": 0.2})
    _, told = shared.reset(seed=11, options={"randomise": 0.2, "mass": 1.0})
    assert told["variation"] == {**free["variation"], "mass": 1.0}
    told = {"target": free["target"], "mass": 1.1}
    numbers = [shared.reset(seed=11, options=o)[1] and shared.np_random.random()
               for o in ({}, {"randomise": 0.2}, told)]  # fmt: skip
    assert len(set(numbers)) == 1
    shared.reset(seed=11)
    assert shared.variation == Variation()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weight": 1.0}, r"options must be some of \['ambient', .*'weight'\]"),
        ({"target": (0.0, 0.0)}, r"target must be finite numbers of shape \(3,\)"),
        ({"target": (0.0, 0.0, math.nan)}, r"target must be finite"),
        ({"randomise": 0.6}, r"randomise must be between 0 and 0\.5, got 0\.6"),
        ({"mass": 0.0}, r"mass must be between 0\.05 and 10, got 0\.0"),
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
        ({"timestep": 3e-3}, "tca_period must be a positive multiple of timestep 0.003"),
        ({"module_spec": BendingSpec(count=4)}, "module_spec.count must be one of .3,., got 4"),
    ],
)
def test_bad_arguments_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        BendReach(**options)


@pytest.mark.parametrize(("seed", "spread"), [(0, 0.0), (1, 0.2), (2, 0.2)])
def test_the_script_reaches_the_target(shared, seed, spread):
    policy, total = ReachPolicy(), 0.0
    observation, info = shared.reset(seed=seed, options={"randomise": spread})
    first = info["distance_to_target"]
    for _ in range(80):
        observation, reward, terminated, truncated, info = shared.step(policy.act(observation))
        total += reward
        if terminated or truncated:
            break
    assert info["success"] and info["time"] < 6.0
    assert info["temperature"].max() < shared.hot_temperature
    assert total > 9.0 + (first - shared.tolerance) / shared.tolerance - 0.4
    # Feedback: it ends nearer to the target than the model alone would bring a module that is off.
    for _ in range(50):
        observation, *_, info = shared.step(policy.act(observation))
    assert info["distance_to_target"] < 0.1e-3


def test_the_target_is_drawn_where_it_is():
    env = gym.make(ID, render_mode="rgb_array", size=(64, 48))
    assert env.unwrapped.render_mode == "rgb_array"
    env.reset(seed=0)
    task = env.unwrapped
    drawn = task.data.geom("stand.target").xpos
    assert drawn == pytest.approx(task.target + [0.0, 0.0, 0.1], abs=1e-12)
    assert task.model.geom("stand.target").size[0] == task.tolerance
    try:
        picture = env.render()
    except RenderingUnavailable as reason:
        pytest.skip(str(reason))
    finally:
        env.close()
    assert picture.shape == (48, 64, 3) and picture.std() > 5.0

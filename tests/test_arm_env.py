"""``TCA/ArmPickPlace-v0`` and the tables of its spaces."""

import hashlib
import math
from functools import partial

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

from tca_mj.envs.arm import ACTION, OBJECTS, OBSERVATION, OFFSETS, ArmPickPlace
from tca_mj.envs.table import Entry, Table

ID = "TCA/ArmPickPlace-v0"
OFF = np.array([-1.0] * 5 + [0.0], dtype=np.float32)


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it; that resets forget everything is a test too."""
    return ArmPickPlace(action="power")


def rollout(env, seed=7, steps=4):
    """Hash of all that an episode under random actions returns, to the last bit."""
    digest = hashlib.sha256()
    observation, info = env.reset(seed=seed)
    actions = np.random.default_rng(seed)
    digest.update(observation.tobytes() + info["object"].encode())
    for _ in range(steps):
        action = actions.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        digest.update(observation.tobytes() + np.float64(reward).tobytes())
        digest.update(bytes([terminated, truncated]) + info["temperature"].tobytes())
    digest.update(env.unwrapped.data.qpos.tobytes() + env.unwrapped.data.qvel.tobytes())
    return digest.hexdigest()


def test_it_is_registered_with_a_time_limit():
    env = gym.make(ID)
    assert isinstance(env.unwrapped, ArmPickPlace)
    assert env.spec.max_episode_steps == gym.spec(ID).max_episode_steps
    env.reset(seed=0)
    env._elapsed_steps = env.spec.max_episode_steps - 1
    *_, truncated, info = env.step(OFF)
    assert truncated and "truncation_reason" not in info


def test_the_reward_is_the_sum_of_its_terms(shared):
    shared.reset(seed=1)
    random = np.random.default_rng(1)
    for _ in range(10):
        action = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        _, reward, _, _, info = shared.step(action)
        assert reward == pytest.approx(sum(info["reward_terms"].values()), rel=1e-15)
        power = shared.max_power * (action[:5].astype(float) + 1.0) / 2.0
        assert info["reward_terms"]["energy"] == pytest.approx(-0.002 * power.sum() * 0.1)


def test_observations_are_within_their_bounds(shared):
    for seed in range(2):
        random = np.random.default_rng(seed)
        observation, _ = shared.reset(seed=seed)
        assert shared.observation_space.contains(observation)
        for _ in range(12):
            action = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
            observation, *_ = shared.step(action)
            assert shared.observation_space.contains(observation)
            assert OBSERVATION.outside(observation) == []


def test_the_observation_is_what_the_simulation_says(shared):
    shared.reset(seed=2)
    observation, *_ = shared.step(np.array([1.0, -1.0, 0.0, 0.5, 0.3, 1.0], dtype=np.float32))
    rows, sim, data = OBSERVATION.read(observation), shared.sim, shared.data
    assert rows["TCA temperature"] == pytest.approx(sim.temperature, rel=1e-6)
    assert rows["TCA length"] == pytest.approx(sim.length, rel=1e-6)
    assert rows["TCA tension"] == pytest.approx(sim.tension, rel=1e-6)
    assert rows["base height"] == pytest.approx(data.joint("arm.lift").qpos, rel=1e-6)
    assert rows["gripper position"] == pytest.approx(data.site("arm.gripper.grasp").xpos, rel=1e-5)
    body = data.body(f"{shared.object}.{shared.object}")
    assert rows["object position"] == pytest.approx(body.xpos, rel=1e-5)
    tips = [data.site(f"arm.gripper.tip{i}").xpos for i in range(2)]
    assert rows["gripper opening"] == pytest.approx(np.linalg.norm(tips[0] - tips[1]), rel=1e-5)
    assert rows["object width"] == pytest.approx(OBJECTS[shared.object])
    assert np.linalg.norm(rows["gripper orientation"]) == pytest.approx(1.0, rel=1e-6)
    frame = np.empty(9)
    mujoco.mju_quat2Mat(frame, rows["gripper orientation"].astype(float))
    hanging = np.diag([1.0, -1.0, -1.0])  # of the gripper's frame, when nothing turns it
    site = data.site("arm.gripper.grasp").xmat.reshape(3, 3)
    assert frame.reshape(3, 3) == pytest.approx(site @ hanging, abs=1e-6)
    assert rows["gripper orientation"][0] > 0.9


def test_offsets_are_what_the_other_rows_say():
    """They come last, far ones are cut off, and nothing else changes."""
    plain, env = ArmPickPlace(), ArmPickPlace(offsets=True)
    assert env.observation.size == OBSERVATION.size + sum(row.size for row in OFFSETS)
    given = {"object": "pcb", "object_position": (1e-3, -2e-3), "object_yaw": 2.2}
    for task in (plain, env):
        task.reset(seed=4, options=given)
    down = np.array([-1.0, 0.2, -1.0, 0.5, 0.3, -1.0], dtype=np.float32)
    for _ in range(12):
        observation, *_ = env.step(down)
        assert np.array_equal(plain.step(down)[0], observation[: OBSERVATION.size])
        assert env.observation_space.contains(observation)
        rows = env.observation.read(observation.astype(float))
        apart = rows["object position"] - rows["gripper position"]
        assert rows["gripper to object"] == pytest.approx(apart.clip(-25e-3, 25e-3), abs=1e-7)
        way = rows["cup position"][:2] - rows["object position"][:2]
        assert rows["object to cup"] == pytest.approx(way.clip(-25e-3, 25e-3), abs=1e-7)
        spare = rows["gripper opening"] - rows["object width"]
        assert rows["spare opening"] == pytest.approx(spare, abs=1e-7)
    assert abs(apart[2]) < 25e-3  # near by now
    env.reset(seed=4, options=given)
    straight = float(env.observation.read(env.seen())["misalignment"][0])
    assert straight == pytest.approx(2.2 - math.pi / 2.0, abs=1e-3)  # the wrist is not turned yet


def test_the_action_heats_and_moves(shared):
    """-1 is off, 1 the largest power; the base follows its velocity."""
    shared.reset(seed=3)
    height = float(shared.data.joint("arm.lift").qpos[0])
    for _ in range(5):
        *_, info = shared.step(np.array([1, -1, -1, 0, -1, 0.5], dtype=np.float32))
    assert info["energy"] == pytest.approx([1.0, 0.0, 0.0, 7.0, 0.0], abs=1e-9)
    moved = float(shared.data.joint("arm.lift").qpos[0]) - height
    assert moved == pytest.approx(0.5 * shared.arm_spec.speed * 0.5, rel=0.1)
    assert info["time"] == pytest.approx(0.5)


def test_it_runs_in_parallel_processes(shared):
    envs = AsyncVectorEnv([partial(ArmPickPlace, action="power")] * 2)
    try:
        observation, info = envs.reset(seed=[7, 8])
        assert observation.shape == (2, OBSERVATION.size)
        alone, _ = shared.reset(seed=7)
        assert observation[0].tobytes() == alone.tobytes()
        stepped, *_ = envs.step(np.stack([OFF, OFF]))
        alone, *_ = shared.step(OFF)
        assert stepped[0].tobytes() == alone.tobytes()
    finally:
        envs.close()


def setup(env):
    """What a reset has drawn."""
    rows = OBSERVATION.read(env.unwrapped.seen())
    return {k: rows[k].copy() for k in ("object position", "object orientation", "cup position")}


@pytest.mark.parametrize("kind", OBJECTS)
def test_the_object_is_the_one_that_is_asked_for(shared, kind):
    _, info = shared.reset(seed=0, options={"object": kind})
    assert info["object"] == shared.object == kind
    assert np.abs(setup(shared)["object position"][:2]).max() <= shared.object_range + 1e-7


def test_without_a_wish_the_object_is_drawn(shared):
    drawn = []
    for seed in range(3):
        gym.Env.reset(shared, seed=seed)
        drawn.append(shared.options.setup(shared.np_random, {})["object"])
    assert [shared.reset(seed=seed)[1]["object"] for seed in range(3)] == drawn


def test_options_do_not_shift_the_other_draws(shared):
    shared.reset(seed=11)
    free = setup(shared)
    shared.reset(seed=11, options={"object_yaw": 2.3, "object_position": (1e-3, -2e-3)})
    told = setup(shared)
    assert told["cup position"] == pytest.approx(free["cup position"], abs=0.0)
    assert told["object position"][:2] == pytest.approx([1e-3, -2e-3], rel=1e-5)
    angle = 2.0 * math.atan2(told["object orientation"][3], told["object orientation"][0])
    assert angle == pytest.approx(2.3, rel=1e-5)
    x, y, _ = free["cup position"]
    shared.reset(seed=11, options={"cup_position": (-0.0255, 0.0)})
    other = setup(shared)
    assert other["object position"] == pytest.approx(free["object position"], abs=0.0)
    assert other["cup position"] == pytest.approx([-0.0255, 0.0, 0.0])
    assert shared.cup_range[0] <= math.hypot(x, y) <= shared.cup_range[1] + 1e-6


def test_draws_fill_their_ranges(shared):
    """200 seeds of each, uniform: mean within four standard errors, extremes near the ends."""
    draws = []
    for seed in range(200):
        gym.Env.reset(shared, seed=seed)
        draws.append(shared.options.setup(shared.np_random, {}))
    yaw = np.array([draw["object_yaw"] for draw in draws])
    low, high = shared.yaw_range
    assert low <= yaw.min() < low + 0.05 * (high - low)
    assert high - 0.05 * (high - low) < yaw.max() <= high
    assert yaw.mean() == pytest.approx((low + high) / 2.0, abs=4.0 * (high - low) / math.sqrt(2400))
    kinds = sum(draw["object"] == "pcb" for draw in draws)
    assert abs(kinds - 100) < 4.0 * math.sqrt(50)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"object": "hammer"}, r"object must be one of \('pcb', 'screwdriver'\), got 'hammer'"),
        ({"weight": 1.0}, r"options must be some of .*, got \['weight'\]"),
        ({"object_position": (6e-3, 0.0)}, r"object_position must be between -0\.005 and 0\.005 m"),
        ({"object_position": (0.0,)}, r"object_position must be finite numbers of shape \(2,\)"),
        ({"object_position": (math.nan, 0.0)}, "object_position must be finite"),
        ({"object_yaw": 0.0}, r"object_yaw must be between .* rad, got 0\.0"),
        ({"object_yaw": math.nan}, "object_yaw must be finite, got nan"),
        ({"cup_position": (0.0, 0.0)}, r"cup_position must be .* m from 0, got .*0\.0000 m"),
        ({"cup_position": (1.0, 0.0, 0.0)}, "cup_position must be finite numbers of shape"),
        ({"cup_position": (0.0, math.inf)}, "cup_position must be finite"),
    ],
)
def test_bad_options_are_refused(shared, options, message):
    with pytest.raises(ValueError, match=message):
        shared.reset(seed=0, options=options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"render_mode": "human"}, "render_mode must be one of .None, .* got 'human'"),
        ({"timestep": 3e-3}, "timestep must be 0.1 s over a multiple of 5, got 0.003"),
        ({"timestep": 0.0}, "timestep must be finite and at least 1e-06"),
    ],
)
def test_bad_arguments_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        ArmPickPlace(**options)


def test_an_overheated_tca_ends_the_episode(shared):
    shared.reset(seed=0)
    full = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0], dtype=np.float32)
    for _ in range(200):
        observation, _, terminated, truncated, info = shared.step(full)
        assert shared.observation_space.contains(observation)
        if truncated:
            break
        assert info["temperature"].max() <= shared.max_temperature
    assert truncated and not terminated and not info["success"]
    assert info["truncation_reason"].startswith(("overheated: ", "torn: "))
    assert shared.sim.temperature.max() > 100.0


def put(env, position):
    """Moves the object by hand, at rest."""
    joint = env.model.joint(f"{env.object}.free")
    env.data.qpos[joint.qposadr[0] : joint.qposadr[0] + 3] = position
    env.data.qvel[joint.dofadr[0] : joint.dofadr[0] + 6] = 0.0
    mujoco.mj_forward(env.model, env.data)


def test_an_object_out_of_reach_ends_the_episode(shared):
    shared.reset(seed=0)
    put(shared, [0.25, 0.0, 5e-3])
    *_, terminated, truncated, info = shared.step(OFF)
    assert terminated and not truncated and not info["success"]
    assert info["termination_reason"] == "object out of reach"


def drop(env, kind, height):
    """Lets an object fall into the cup; the last step and the sum of what was earned there."""
    env.reset(seed=0, options={"object": kind})
    cup = OBSERVATION.read(env.seen())["cup position"]
    put(env, cup + [0.0, 0.0, height])
    earned = 0.0
    for _ in range(15):
        *_, terminated, _, info = env.step(OFF)
        earned += info["reward_terms"]["place"] + info["reward_terms"]["carry"]
        if terminated:
            break
    return terminated, info, earned


@pytest.mark.parametrize("kind", OBJECTS)
def test_a_lifted_object_that_comes_to_rest_in_the_cup_is_a_success(shared, kind):
    """From 90 mm: after the first step it is still above its stand."""
    terminated, info, earned = drop(shared, kind, 90e-3)
    assert terminated and info["success"]
    assert info["reward_terms"]["place"] == 20.0 and earned < 20.0 + 15 * 0.4


def test_an_object_pushed_into_the_cup_is_none(shared):
    terminated, info, earned = drop(shared, "screwdriver", 10e-3)
    assert not terminated and not info["success"]
    assert earned == 0.0


def test_an_object_on_its_stand_is_no_success(shared):
    shared.reset(seed=0)
    for _ in range(10):
        _, reward, terminated, truncated, info = shared.step(OFF)
        assert not (terminated or truncated or info["success"])
        assert info["reward_terms"]["place"] == 0.0


TABLE = Table(
    [
        Entry("angle", 1, -3.0, 3.0, "rad"),
        Entry("force", 2, 0.0, 5.0, "N", centre=2.0, scale=0.5),
    ]
)


def test_a_table_packs_and_reads_its_rows():
    packed = TABLE.pack({"force": [1.0, 2.0], "angle": 0.5})
    assert packed.dtype == np.float32 and packed.tolist() == [0.5, 1.0, 2.0]
    rows = TABLE.read(np.stack([packed, 2 * packed]))
    assert rows["force"].tolist() == [[1.0, 2.0], [2.0, 4.0]]
    assert rows["angle"].tolist() == [[0.5], [1.0]]
    assert TABLE.space.contains(packed) and TABLE.space.shape == (3,)
    assert TABLE.space.low.tolist() == [-3.0, 0.0, 0.0]


def test_a_table_names_what_is_outside():
    assert TABLE.outside(np.array([3.0, 0.0, 5.0], dtype=np.float32)) == []
    assert TABLE.outside(np.array([3.1, 0.0, 5.0], dtype=np.float32)) == ["angle"]
    assert TABLE.outside(np.array([np.nan, 0.0, -1.0], dtype=np.float32)) == ["angle", "force"]


def test_a_table_is_also_markdown():
    lines = TABLE.markdown().splitlines()
    assert lines[0] == "| index | entry | low | high | unit | scale |"
    assert lines[2:] == [
        "| 0 | angle | -3 | 3 | rad | ± 3 |", "| 1-2 | force | 0 | 5 | N | 2 ± 0.5 |"
    ]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"angle": 0.0}, r"values must be \['angle', 'force'\], got \['angle'\]"),
        ({"angle": 0.0, "force": 1.0}, "force must have 2 numbers, got 1"),
        ({"angle": 0.0, "force": [1.0, 1.0], "more": 0.0}, "values must be .* got .*'more'"),
    ],
)
def test_a_table_refuses_other_rows(values, message):
    with pytest.raises(ValueError, match=message):
        TABLE.pack(values)


def test_staying_where_it_is_good_earns_nothing(shared):
    """Reach and carry are changes: over any course they add up to its end minus its start."""
    shared.reset(seed=4)
    start = dict(shared._progress)
    action = np.array([-1.0, -1.0, -1.0, -0.8, -0.5, -1.0], dtype=np.float32)
    earned = {"reach": 0.0, "carry": 0.0}
    for k in range(25):
        action[5] = -1.0 if k < 10 else 0.0
        *_, info = shared.step(action)
        for name in earned:
            earned[name] += info["reward_terms"][name]
    assert earned["reach"] > 0.1  # it went down towards the object
    for name, total in earned.items():
        assert total == pytest.approx(shared._progress[name] - start[name], abs=1e-12)

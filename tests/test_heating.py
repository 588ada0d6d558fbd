"""What an action tells the TCAs of a task, for how long, and that bounds follow the design."""

from dataclasses import replace

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from tca_mj.agents.policies.actors import scripted
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.scripts.course import CourseWalker
from tca_mj.agents.scripts.tetrapod import WALK
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.envs.reach import BendReach
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.modules.bending import BendingSpec
from tca_mj.registry import TASKS, episode_steps, make, task_class
from tca_mj.robots.tetrapod import TetrapodSpec

IDS = [task.id for task in TASKS]
WALKING = "TCA/TetrapodWalk-v0"


def bare(id, **arguments):
    return gym.make(id, disable_env_checker=True, **arguments).unwrapped


def asked(env, temperature):
    """The action that asks the TCAs for a temperature [°C]."""
    action = env.action.still
    share = (temperature - 25.0) / (env.safe_temperature - 25.0)
    action[env.action.slices["TCA heating"]] = 2.0 * share - 1.0
    return action


@pytest.mark.parametrize(
    ("id", "seconds"), [("TCA/BendReach-v0", 5.0), (WALKING, 5.0), ("TCA/ArmPickPlace-v0", 8.0)]
)
@pytest.mark.parametrize("heat_loss", [0.8, 1.0, 1.2])
def test_a_temperature_is_held_whatever_the_heat_loss(id, seconds, heat_loss):
    """To 1 K, by a thermostat that knows the nominal heat loss; to 0.1 K if it is right."""
    env = bare(id)
    env.reset(seed=0, options={"heat_loss": heat_loss})
    action = asked(env, 90.0)
    for _ in range(round(10.0 * seconds)):
        *_, info = env.step(action)
    driven = info["temperature"][: env.action.slices["TCA heating"].stop]
    assert driven == pytest.approx(90.0, abs=0.1 if heat_loss == 1.0 else 1.0)


def test_no_temperature_is_too_hot_for_a_robot_that_is_off():
    """An arm that loses a fifth less heat on a hot day, all TCAs off and on by turns."""
    env = bare("TCA/ArmPickPlace-v0")
    env.reset(seed=0, options={"heat_loss": 0.8, "ambient": 30.0})
    hottest = 0.0
    for number in range(100):
        action = asked(env, 25.0 if number % 30 > 20 else env.safe_temperature)
        *_, truncated, info = env.step(action)
        hottest = max(hottest, info["temperature"].max())
        assert not truncated, info.get("truncation_reason")
    assert 170.0 < hottest < env.safe_temperature + 4.0


def test_off_and_hottest_are_the_ends_of_the_action():
    env = bare("TCA/BendReach-v0")
    assert env.heated(np.array([-1.0, 0.0, 1.0])).tolist() == [25.0, 82.5, 140.0]
    fine = TetrapodGait(body="fine", timestep=2e-3)
    told = fine.heated(np.ones(12))
    assert (told[:12] == 172.0).all() and (told[12:] == 25.0).all()  # spines' TCAs stay off
    power = bare("TCA/ArmPickPlace-v0", action="power")
    assert power.heated(np.array([-1.0, 0.0, 1.0, 0.0, 1.0])).tolist() == [0, 1, 2, 14, 10]


def test_the_target_of_the_reach_does_not_hang_on_the_action():
    """It is where the tip rests at temperatures: those of the target lead there."""
    warm, powered = BendReach(), BendReach(action="power")
    for options in ({"randomise": 0.2}, {}):
        _, info = warm.reset(seed=3, options=options)
        _, same = powered.reset(seed=3, options=options)
        assert (info["target"] == same["target"]).all()
        assert (info["target_temperature"] == same["target_temperature"]).all()
    action = (2.0 * (info["target_temperature"] - 25.0) / 115.0 - 1.0).astype(np.float32)
    for _ in range(60):
        *_, info = warm.step(action)
    assert info["distance_to_target"] < 0.1e-3
    _, told = warm.reset(seed=3, options={"target": info["target"]})
    assert told["target_temperature"] == pytest.approx(info["target_temperature"], abs=0.5)


@pytest.mark.parametrize("id", IDS)
def test_an_episode_takes_as_long_at_any_control_period(id):
    own = make(id, disable_env_checker=True)
    longer = make(id, control_period=0.5, disable_env_checker=True)
    assert longer.unwrapped.control_period == longer.unwrapped.dt == 0.5
    duration = own.spec.max_episode_steps * own.unwrapped.control_period
    assert longer.spec.max_episode_steps * 0.5 == pytest.approx(duration)
    assert own.spec.max_episode_steps == episode_steps(id) == gym.spec(id).max_episode_steps
    assert make(id, control_period=0.5, max_episode_steps=7).spec.max_episode_steps == 7


def test_the_time_limit_comes_after_that_duration(monkeypatch):
    monkeypatch.setattr(gym.spec("TCA/BendReach-v0"), "max_episode_steps", 20)  # 2 s
    env = make("TCA/BendReach-v0", control_period=0.5)
    env.reset(seed=0)
    ends = [env.step(env.unwrapped.action.still)[3] for _ in range(4)]
    assert ends == [False, False, False, True]
    assert env.unwrapped.sim.time == pytest.approx(2.0)
    many = TaskVecEnv.make("TCA/BendReach-v0", 1, control_period=0.5)
    many.reset()
    assert [bool(many.step(-np.ones((1, 3)))[2][0]) for _ in range(4)] == ends


@pytest.mark.parametrize("period", [0.05, 0.15])
def test_a_control_period_can_be_any_number_of_updates(period):
    """Of the gaits' TCAs, 0.05 s; what is paid for a time is paid for the time that it took."""
    env, usual = bare(WALKING, control_period=period), bare(WALKING)
    for task in (env, usual):
        task.reset(seed=0)
        action = asked(task, 172.0)
        while task.sim.time < 0.3 - 1e-9:
            task.step(action)
        assert task.sim.time == pytest.approx(0.3)
    assert (env.sim.energy == usual.sim.energy).all()
    assert (env.data.qpos == usual.data.qpos).all()
    env.data.qpos[3:7] = [0.9, 0.0, np.sqrt(1.0 - 0.9**2), 0.0]
    mujoco.mj_kinematics(env.model, env.data)
    tilt = 1.0 - env.stance.rotation(env.data)[2, 2]
    leaning = env.judge(env.drive(np.zeros(12)), False).terms["posture"]  # after 0.05 s
    assert leaning == pytest.approx(-0.2 * 0.5 * tilt) and tilt > 0.1


def test_who_acts_by_power_refuses_temperatures():
    with pytest.raises(ValueError, match="action must be .*'power'"):
        CourseWalker(bare("TCA/TetrapodCourse-v0"))
    with pytest.raises(ValueError, match=r"action must be one of .'temperature', 'power'."):
        BendReach(action="voltage")
    for id in IDS:
        assert scripted(make(id, **task_class(id).scripted_arguments)) is not None


def test_a_gait_asks_for_its_temperatures_in_the_middle_of_the_time_for_which_they_are_held():
    env = make(WALKING, control_period=0.4)
    policy = GaitPolicy.in_task(env, WALK, (0.0,) * 4)
    seen, _ = env.reset(seed=0)
    for k in range(3):
        action = policy.act(seen)
        wanted = WALK.temperature((0.4 * k + 0.2) / WALK.period)
        assert env.unwrapped.heated(action.astype(float))[:12] == pytest.approx(wanted, abs=1e-4)
        seen, *_ = env.step(action)
    policy.reset()
    warmer = policy.act(seen, 1000.0)  # by more than is allowed
    hot = env.unwrapped.hot_temperature
    assert env.unwrapped.heated(warmer.astype(float))[:12] == pytest.approx([hot] * 12, abs=1e-4)


def test_the_bounds_are_those_of_the_pages_for_the_usual_robots():
    for id in IDS:
        env = bare(id)
        module = __import__(type(env).__module__, fromlist=["OBSERVATION"])
        assert env.observation.entries == module.OBSERVATION.entries


def long_module():
    return BendReach(module_spec=BendingSpec(length=0.15))


def long_legs():
    robot = TetrapodSpec()
    return TetrapodGait(robot=replace(robot, leg=replace(robot.leg, length=0.2)))


@pytest.mark.parametrize("build", [long_module, long_legs])
def test_bounds_follow_the_design(build):
    """What is longer than the published robot is no divergence."""
    env = build()
    observation, _ = env.reset(seed=0)
    longest = float(np.max(env.sim.length))
    assert longest > 0.14
    for number in range(20):
        assert env.observation_space.contains(observation)
        low, high = env.observation_space.low, env.observation_space.high
        where = env.observation.slices["TCA length"]
        assert (low[where] <= 0.0).all() and (high[where] > 1.5 * longest).all()
        action = asked(env, env.safe_temperature if number < 10 else 25.0)
        observation, _, _, truncated, info = env.step(action)
        assert not truncated, info.get("truncation_reason")
    env.data.qvel[:] = 1e5
    *_, truncated, info = env.step(action)
    assert truncated and info["truncation_reason"].startswith("diverged")

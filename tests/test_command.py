"""What a robot is told, how well it follows, and what that earns; slopes and pushes."""

import math
from itertools import pairwise

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from tca_mj.agents.scripts.guided import AlongWaypoints, Guided, along_square
from tca_mj.envs.command import LEASH, Command, Following, drawn
from tca_mj.envs.gaits import ACTION, OBSERVATION, TASKS
from tca_mj.envs.tetrapod import TetrapodGait

OFF = ACTION.still


@pytest.fixture(scope="module")
def walker():
    return TetrapodGait(gait="walk", action="power")


def walk(following, path, interval=0.1, yaw=0.0):
    """The following after each place of a path."""
    found = [following]
    for x, y in path:
        found.append(found[-1].moved(x, y, yaw, interval))
    return found


def test_headway_is_what_was_made_in_the_commanded_direction():
    east = Following(Command())
    one, two = walk(east, [(0.01, 0.0), (0.01, 0.02)])[1:]
    assert (one.along, one.aside, two.along, two.aside) == (0.01, 0.0, 0.01, 0.02)
    north = two.told(Command(direction=math.pi / 2.0))
    assert north.aside == 0.0 and north.along == two.along
    ahead = north.moved(0.01, 0.05, 0.0, 0.1)
    assert ahead.along == pytest.approx(0.04) and ahead.aside == pytest.approx(0.0, abs=1e-15)


def test_who_turns_as_told_on_a_circle_earns_the_whole_arc():
    """The chord of each step lies along the middle of its turn: all is headway, none is drift."""
    rate, speed, interval, n = 0.05, 0.01, 0.1, 600
    now = Following(Command(speed=speed, turning=rate))
    radius = speed / rate
    for k in range(1, n + 1):
        angle = rate * interval * k
        x, y = radius * math.sin(angle), radius * (1.0 - math.cos(angle))
        now = now.moved(x, y, angle, interval)
    chord = 2.0 * radius * math.sin(0.5 * rate * interval)
    assert now.along == pytest.approx(n * chord, rel=1e-12)
    assert now.aside == pytest.approx(0.0, abs=1e-12)
    assert now.error == pytest.approx(0.0, abs=1e-9) and abs(now.lead) < 1e-6


def test_a_terms_sum_does_not_depend_on_the_way_there():
    """Differences: a loop that ends where it began has earned nothing, at any commanded speed."""
    random = np.random.default_rng(0)
    for speed in (math.inf, 5e-3, 0.0):
        start = Following(Command(direction=0.3, speed=speed))
        path = [*random.normal(0.0, 2e-3, (50, 2)).tolist(), (0.0, 0.0)]
        steps = walk(start, path, interval=1e-9)
        sums = {}
        for before, after in pairwise(steps):
            for name, term in after.earned(before, 0.009).items():
                sums[name] = sums.get(name, 0.0) + term
        assert sums == pytest.approx(dict.fromkeys(sums, 0.0), abs=1e-9)


@pytest.mark.parametrize(("told", "best"), [(math.inf, 12e-3), (6e-3, 6e-3), (0.0, 0.0)])
def test_the_commanded_speed_earns_most(told, best):
    def earned(speed):
        now, total = Following(Command(speed=told)), 0.0
        for k in range(1, 601):
            after = now.moved(speed * 0.1 * k, 0.0, 0.0, 0.1)
            total += sum(after.earned(now, 0.009).values())
            now = after
        return total

    speeds = np.linspace(0.0, 12e-3, 13)
    assert speeds[np.argmax([earned(speed) for speed in speeds])] == pytest.approx(best)


def test_who_was_held_up_need_not_make_up_for_all_of_it():
    now = Following(Command(speed=0.01))
    for _ in range(1000):
        now = now.moved(0.0, 0.0, 0.0, 0.1)
    assert now.lead == -LEASH


def test_a_wrong_heading_is_charged_the_shorter_way_round():
    now = Following(Command()).moved(0.0, 0.0, math.radians(170.0), 0.1)
    assert now.error == pytest.approx(math.radians(-170.0))
    better = now.moved(0.0, 0.0, math.radians(200.0), 0.1)  # on through the back
    assert better.error == pytest.approx(math.radians(160.0))
    assert better.earned(now, 0.009)["turn"] > 0.0


def test_commands_are_drawn_within_their_ranges():
    random = np.random.default_rng(0)
    found = [drawn(random, 0.5, fastest=0.01, turning=0.05, ways=()) for _ in range(2000)]
    commands = [command for command, _ in found]
    assert all(8.0 <= time <= 20.0 for _, time in found)
    assert max(abs(c.direction) for c in commands) <= 0.5 * math.pi
    assert max(abs(c.turning) for c in commands) <= 0.025
    speeds = np.array([c.speed for c in commands])
    assert np.isinf(speeds).mean() == pytest.approx(0.6, abs=0.04)
    assert np.isclose(speeds, 0.005).mean() == pytest.approx(0.1, abs=0.03)  # as slow as half of it
    on_a_beam = {drawn(random, 1.0, fastest=0.01, turning=0.0, ways=(0.0, math.pi))[0].direction
                 for _ in range(50)}  # fmt: skip
    assert on_a_beam == {0.0, math.pi}


def test_orders_are_seen_from_the_next_observation_on(walker):
    walker.reset(seed=0, options={"yaw": 0.0})
    walker.order(direction=math.pi / 2.0, speed=4e-3, turning=0.03)
    rows = OBSERVATION.read(walker.step(OFF)[0])
    turned = 0.03 * 0.1  # what the heading has turned by in the step
    assert rows["commanded direction"] == pytest.approx([-turned, 1.0], abs=2e-3)
    assert rows["commanded speed"] == pytest.approx(4e-3)
    assert rows["commanded turning"] == pytest.approx(0.03)
    assert rows["heading error"] == pytest.approx(turned, abs=2e-3)
    walker.order(speed=TASKS["walk"].fastest, heading=0.2)
    assert walker.following.command.speed == math.inf
    assert walker.following.command.direction == math.pi / 2.0  # stays as it was
    rows = OBSERVATION.read(walker.seen())
    assert rows["lead"] == 0.0 and rows["commanded speed"] == np.float32(TASKS["walk"].fastest)
    for bad in ({"direction": 4.0}, {"speed": -1.0}, {"turning": 1.0}, {"heading": math.nan}):
        with pytest.raises(ValueError, match=f"{next(iter(bad))} must be"):
            walker.order(**bad)


def test_commands_that_wander_come_from_the_seed(walker):
    def commands(seed):
        walker.reset(seed=seed, options={"wander": 1.0})
        found = {walker.following.command}
        for _ in range(200):
            walker.step(OFF)
            found.add(walker.following.command)
        return found

    first, again, other = commands(3), commands(3), commands(4)
    assert first == again != other and len(first) in (2, 3)


def test_a_mirrored_robot_follows_a_mirrored_command():
    """What is seen of the mirrored way is the mirror image, with all commands and a slope."""
    envs = [TetrapodGait(gait="walk"), TetrapodGait(gait="walk")]
    common = {"speed": 6e-3, "slope": 0.05, "bend": TASKS["walk"].bend, "push": 0.02,
              "push_every": 1.0}  # fmt: skip
    left, right = (
        env.reset(seed=0, options={
            **common, "yaw": 0.03 * side, "direction": 0.5 * side, "turning": 0.02 * side,
            "slope_direction": 1.0 * side,
            "push_direction": 0.0,
        })[0]
        for env, side in zip(envs, (1.0, -1.0), strict=True)
    )  # fmt: skip
    random = np.random.default_rng(0)
    scale = OBSERVATION.units[1]
    for _ in range(9):  # before a push comes from another side
        np.testing.assert_allclose(OBSERVATION.mirrored(left) / scale, right / scale, atol=1e-3)
        action = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        left, *_ = envs[0].step(action)
        right, *_ = envs[1].step(ACTION.mirrored(action))


def _turned(table, row):
    source, sign = table.ends
    return row[source] * sign


@pytest.mark.parametrize("gait", ["walk", "shimmy"])
def test_front_and_rear_are_alike(gait):
    """Who walks ahead with his front legs walks back with his rear legs, to a rounding."""
    envs, beam = [TetrapodGait(gait=gait) for _ in range(2)], gait == "shimmy"
    here, there = (
        env.reset(seed=0, options={
            "bend": TASKS[gait].bend, "yaw": 0.0 if beam else 0.03 * side,
            "direction": (0.0 if beam else 0.5) if side > 0 else math.pi - (0.0 if beam else 0.5),
        })[0]
        for env, side in zip(envs, (1.0, -1.0), strict=True)
    )  # fmt: skip
    random, scale = np.random.default_rng(0), OBSERVATION.units[1]
    for _ in range(10):
        np.testing.assert_allclose(_turned(OBSERVATION, here) / scale, there / scale, atol=1e-5)
        action = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        here, one, *_ = envs[0].step(action)
        there, other, *_ = envs[1].step(_turned(ACTION, action))
        assert one == pytest.approx(other, abs=1e-6)


def test_a_slope_pulls_the_robot_down_by_its_sine(walker):
    """The feet hold on 10 degrees; their forces along the ground carry the weight's share."""
    slope, uphill = math.radians(10.0), 0.7
    walker.reset(seed=0, options={"slope": slope, "slope_direction": uphill})
    data, model = walker.data, walker.model
    assert np.linalg.norm(model.opt.gravity) == pytest.approx(9.81)
    for _ in range(20):
        walker.step(OFF)
    force, total = np.zeros(6), np.zeros(3)
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, force)
        total += data.contact.frame[i].reshape(3, 3).T @ force[:3]
    weight = float(model.body_subtreemass[walker.stance.hub]) * 9.81
    up = np.array([math.cos(uphill), math.sin(uphill)])
    assert abs(total[2]) == pytest.approx(weight * math.cos(slope), rel=0.02)
    assert abs(total[:2] @ up) == pytest.approx(weight * math.sin(slope), rel=0.05)
    walker.reset(seed=0)
    assert model.opt.gravity.tolist() == [0.0, 0.0, -9.81]


def test_a_push_changes_the_velocity_by_what_was_said(walker):
    walker.reset(seed=0, options={"push": 0.1, "push_every": 1.0, "push_direction": 0.5})
    root, before = walker.stance.motion, None
    for _ in range(11):
        before = walker.data.qvel[root : root + 2].copy()
        drive = walker.drive(np.full(12, -1.0))
        after = walker.data.qvel[root : root + 2].copy()
        walker.sim.step(drive.command, 0.1)
        walker.finish(drive, None)
    assert after - before == pytest.approx([0.1 * math.cos(0.5), 0.1 * math.sin(0.5)])


def test_a_state_brings_command_slope_and_pushes_back():
    env = TetrapodGait(gait="walk", control_period=0.5)
    random = np.random.default_rng(0)
    actions = random.uniform(-1.0, 1.0, (32, ACTION.size)).astype(np.float32)
    env.reset(seed=1, options={"slope": 0.1, "wander": 1.0, "push": 0.05, "push_every": 3.0})
    for action in actions[:10]:
        env.step(action)
    state, kept = env.get_state(), []
    for action in actions[10:]:
        kept.append(env.step(action)[0])
    env.reset(seed=2, options={"direction": 1.0})
    env.set_state(state)
    for action, expected in zip(actions[10:], kept, strict=True):
        np.testing.assert_array_equal(env.step(action)[0], expected)


class _Carried:
    """A policy that carries the robot along its commanded direction, 1 cm in each decision."""

    phase = "carried"

    def __init__(self, task):
        self.task = task

    def reset(self):
        pass

    def act(self, observation):
        x, y = OBSERVATION.read(observation)["commanded direction"]
        turn = self.task.stance.rotation(self.task.data)
        speed = OBSERVATION.read(observation)["commanded speed"][0]
        if speed > 0.0:
            step = turn @ [0.01 * x, 0.01 * y, 0.0]
            self.task.data.qpos[self.task.stance.root :][:2] += step[:2]
        return OFF


def test_a_square_turns_every_minute_and_then_stands(walker):
    walker.reset(seed=0)
    guide, orders = along_square(walker), []
    for moment in np.arange(0.0, 250.0, 0.5):
        walker.data.time = moment
        if (order := next(guide, None)) is not None:
            orders.append((moment, *order))
    times, words, told = zip(*orders, strict=True)
    assert times == (0.0, 60.0, 120.0, 180.0, 240.0)
    assert words == ("side 1", "side 2", "side 3", "side 4", "stand")
    turns = [np.exp(1j * each["direction"]) for each in told[:4]]
    assert turns == pytest.approx([1.0, 1j, -1.0, -1j]) and told[4] == {"speed": 0.0}


def test_a_guide_leads_from_waypoint_to_waypoint():
    env = gym.make("TCA/TetrapodWalk-v0", action="power")
    task, points = env.unwrapped, ((0.1, 0.0), (0.1, 0.1))
    policy = Guided(_Carried(task), task, AlongWaypoints(points))
    observation, _ = env.reset(seed=0, options={"yaw": 0.0})
    policy.reset()
    phases, places = [], []
    for _ in range(25):
        observation, *_ = env.step(policy.act(observation))
        phases.append(policy.phase)
        places.append(task.following.place)
    assert list(dict.fromkeys(phases)) == ["to 1", "to 2", "stand"]
    assert all(min(math.dist(place, point) for place in places) < 0.025 for point in points)
    assert math.dist(places[-1], points[-1]) < 0.025

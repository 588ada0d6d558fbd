"""The tetrapod's tasks of one shape, their physics, and the scripted gaits."""

import hashlib
import math

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from tca_mj.agents.scripts.tetrapod import GAITS, gait_policy
from tca_mj.envs.gaits import ACTION, OBSERVATION, TASKS
from tca_mj.envs.options import variation_of
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.robots.tetrapod import LEGS
from tca_mj.variation import Variation

IDS = {gait: f"TCA/Tetrapod{gait.capitalize()}-v0" for gait in TASKS}
OFF = np.full(ACTION.size, -1.0, dtype=np.float32)
VARIED = {"randomise": 0.2}


@pytest.fixture(scope="module")
def envs():
    """One environment of each task; that resets forget everything is a test too."""
    return {gait: TetrapodGait(gait=gait, action="power") for gait in TASKS}


@pytest.fixture
def walker(envs):
    return envs["walk"]


def rollout(env, seed=7, steps=3, options=None, restart=True):
    """Hash of all that an episode under random actions returns, to the last bit."""
    digest = hashlib.sha256()
    if restart:
        observation, _ = env.reset(seed=seed, options=options or VARIED)
        digest.update(observation.tobytes())
    actions = np.random.default_rng(seed)
    for _ in range(steps):
        action = actions.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        digest.update(observation.tobytes() + np.float64(reward).tobytes())
        digest.update(bytes([terminated, truncated]) + info["temperature"].tobytes())
    digest.update(env.unwrapped.data.qpos.tobytes() + env.unwrapped.data.qvel.tobytes())
    return digest.hexdigest()


def follow(env, policy, steps, seed=0, **options):
    """Information after an episode of a policy, and the infos of all steps."""
    observation, _ = env.reset(seed=seed, options=options)
    policy.reset()
    infos = []
    for _ in range(steps):
        observation, _, terminated, truncated, info = env.step(policy.act(observation))
        assert not (terminated or truncated), info
        infos.append(info)
    return infos


def test_the_time_limit_is_no_reason(walker):
    env = gym.wrappers.TimeLimit(walker, 1)
    env.reset(seed=0)
    *_, terminated, truncated, info = env.step(OFF)
    assert truncated and not terminated and "truncation_reason" not in info


@pytest.mark.parametrize("gait", TASKS)
def test_it_starts_at_rest_on_its_ground(envs, gait):
    env = envs[gait]
    observation, info = env.reset(seed=1)
    rows = OBSERVATION.read(observation)
    assert env.observation_space.contains(observation)
    assert info["time"] == 0.0 and info["distance"] == 0.0 and (info["energy"] == 0.0).all()
    assert (rows["TCA temperature"] == 25.0).all()
    assert np.abs(rows["velocity"]).max() < 2e-3
    assert rows["body bend"] == pytest.approx(TASKS[gait].bend, abs=math.radians(3.0))
    assert rows["leg contact"].tolist() == [1.0] * 4
    assert env.data.contact.dist.min() > -0.3e-3
    assert env.sim.spines.temperature == pytest.approx(25.0)


@pytest.mark.parametrize("gait", TASKS)
def test_it_is_put_down_without_violence(envs, gait):
    """Into the layer of its contacts but through nothing; legs beside a beam are spread."""
    env = envs[gait]
    env.sim.reset(env.stance.placer(bend=env.task.bend, above=env.task.beam or 0.0))
    assert 0.0 < env.data.contact.dist.min() < 0.5e-3
    env.data.qpos[2] -= 0.6e-3
    mujoco.mj_forward(env.model, env.data)
    assert -0.6e-3 < env.data.contact.dist.min() < 0.0
    env.reset(seed=0)
    low = {"crawl": 0.0, "walk": 60e-3, "shimmy": 0.12}[gait]  # not standing on the beam
    assert low < env.stance.position(env.data)[2] < low + 15e-3


@pytest.mark.parametrize("gait", TASKS)
def test_what_stands_still_stays(envs, gait):
    """Friction holds splayed legs: less than 0.1 mm in 20 s is 0.02 mm in 4 s."""
    env = envs[gait]
    env.reset(seed=0)
    for _ in range(10):
        env.step(OFF)
    before = env.data.site_xpos[env.stance.feet].copy()
    for _ in range(40):
        env.step(OFF)
    assert np.abs(env.data.site_xpos[env.stance.feet] - before).max() < 0.02e-3


def test_the_ground_carries_the_weight(walker):
    """Newton: forces of the four feet, over gravity, are the robot's mass."""
    for mass in (1.0, 1.2):
        walker.reset(seed=0, options={"mass": mass})
        for _ in range(5):
            walker.step(OFF)
        model, data, force = walker.model, walker.data, np.zeros(6)
        total = np.zeros(3)
        for i, contact in enumerate(data.contact):
            mujoco.mj_contactForce(model, data, i, force)
            total += contact.frame.reshape(3, 3).T @ force[:3]
        weight = 9.81 * mass * 21.862e-3  # of the default robot
        assert abs(total[2]) == pytest.approx(weight, rel=0.01)


def test_the_reward_is_the_sum_of_its_terms(walker):
    walker.reset(seed=1)
    random = np.random.default_rng(1)
    for _ in range(5):
        action = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
        _, reward, _, _, info = walker.step(action)
        assert reward == pytest.approx(sum(info["reward_terms"].values()), rel=1e-12)
        power = walker.max_power * (action.astype(float) + 1.0) / 2.0
        assert info["reward_terms"]["energy"] == pytest.approx(-0.002 * power.sum() * 0.1)
    assert tuple(info["reward_terms"]) == TetrapodGait.terms


def test_staying_where_it_is_good_earns_nothing(walker):
    """Progress and drift are changes: they add up to where the robot is at the end."""
    walker.reset(seed=0, options={"direction": 0.4})
    start = walker.stance.position(walker.data).copy()
    infos = follow(walker, gait_policy("walk"), 30, direction=0.4)
    for name, value in (
        ("progress", infos[-1]["distance"] / TASKS["walk"].speed),
        ("drift", -0.5 * abs(infos[-1]["drift"]) / TASKS["walk"].speed),
    ):
        earned = sum(info["reward_terms"][name] for info in infos)
        assert earned == pytest.approx(value, abs=1e-9)
    moved = walker.stance.position(walker.data) - start
    along = moved[0] * math.cos(0.4) + moved[1] * math.sin(0.4)
    assert infos[-1]["distance"] == pytest.approx(along, abs=1e-12) and along > 1e-3


def test_the_observation_is_what_the_simulation_says(walker):
    walker.reset(seed=2, options={"direction": 1.0, "yaw": 0.03})
    action = np.linspace(-1.0, 1.0, ACTION.size).astype(np.float32)
    for _ in range(5):
        observation, *_, info = walker.step(action)
    rows, sim, data = OBSERVATION.read(observation), walker.sim, walker.data
    assert rows["TCA temperature"] == pytest.approx(sim.temperature[:12], rel=1e-6)
    assert rows["TCA length"] == pytest.approx(sim.length[:12], rel=1e-6)
    assert rows["TCA tension"] == pytest.approx(sim.tension[:12], rel=1e-6)
    hub = data.body("robot.hub")
    assert rows["height"] == pytest.approx(hub.xpos[2], rel=1e-6)
    frame = np.empty(9)
    mujoco.mju_quat2Mat(frame, rows["orientation"].astype(float))
    frame = frame.reshape(3, 3)
    assert frame == pytest.approx(hub.xmat.reshape(3, 3), abs=1e-6)
    for i, leg in enumerate(LEGS):
        foot = hub.xpos + frame @ rows["foot position"][3 * i : 3 * i + 3]
        assert foot == pytest.approx(data.site(f"robot.{leg}.foot").xpos, abs=1e-6)
    ahead = frame @ [*rows["commanded direction"], 0.0]
    assert ahead[:2] == pytest.approx([math.cos(1.0), math.sin(1.0)], abs=1e-3)
    velocity = np.zeros(6)
    mujoco.mj_objectVelocity(
        walker.model, data, int(mujoco.mjtObj.mjOBJ_XBODY), walker.stance.hub, velocity, 1
    )
    assert rows["angular velocity"] == pytest.approx(velocity[:3], abs=5e-3)
    assert rows["velocity"] == pytest.approx(velocity[3:], abs=5e-4)
    assert info["energy"][:12] == pytest.approx(2.0 * (action + 1.0) * 0.5, rel=1e-6)
    # The body is rigid: its spines need neither heaters nor TCAs.
    assert info["energy"].shape == info["temperature"].shape == info["tension"].shape == (12,)
    assert info["heater_energy"].shape == (0,)
    fine = TetrapodGait(action="power", body="fine", timestep=2e-3)
    _, info = fine.reset(seed=0)
    assert info["energy"].shape == (15,) and info["heater_energy"].tolist() == [0.0] * 3


def test_velocities_are_those_in_the_body(walker):
    """A robot that looks to the left and moves along the world's x axis moves to its right."""
    walker.reset(seed=0)
    walker.data.qpos[3:7] = [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
    walker.data.qvel[:6] = [0.2, 0.0, 0.1, 0.0, 0.0, 3.0]
    mujoco.mj_forward(walker.model, walker.data)
    rows = OBSERVATION.read(walker.seen())
    assert rows["velocity"] == pytest.approx([0.0, -0.2, 0.1], abs=1e-6)
    assert rows["angular velocity"] == pytest.approx([0.0, 0.0, 3.0], abs=1e-6)
    assert rows["commanded direction"] == pytest.approx([0.0, -1.0], abs=1e-6)


@pytest.mark.parametrize("leg", range(4))
def test_each_tca_draws_its_foot_its_way(walker, leg):
    """In the air: the first lifts, the second draws forward, the third back; its own foot alone."""
    moved = {}
    for tca in range(3):
        walker.reset(seed=0)
        walker.model.opt.gravity[:] = 0.0
        walker.data.qpos[2] += 0.05
        before = OBSERVATION.read(walker.seen())["foot position"].reshape(4, 3)
        action = OFF.copy()
        action[3 * leg + tca] = 0.5
        for _ in range(15):
            observation, *_ = walker.step(action)
        after = OBSERVATION.read(observation)["foot position"].reshape(4, 3)
        moved[tca] = (after - before)[leg]
        others = np.delete(np.linalg.norm(after - before, axis=1), leg)
        assert others.max() < 0.25 * np.linalg.norm(moved[tca])
    walker.model.opt.gravity[2] = -9.81
    outwards = 1.0 if leg % 2 == 0 else -1.0
    assert moved[0][2] > 4e-3 and outwards * moved[0][1] > 4e-3
    assert moved[1][0] > 4e-3 and moved[2][0] < -4e-3
    assert abs(moved[0][0]) < 1e-3


def test_recording_changes_nothing(walker, tmp_path):
    plain = rollout(walker)
    with RecordRerun(gym.wrappers.TimeLimit(walker, 50), tmp_path / "a.rrd") as env:
        assert rollout(env) == plain
    assert env.path.stat().st_size > 10_000


def drawn(env, seed, **options):
    gym.Env.reset(env, seed=seed)
    setup = env.options.setup(env.np_random, options)
    return setup | {"variation": variation_of(setup)}


def test_options_do_not_shift_the_other_draws(walker):
    free = drawn(walker, 11, randomise=0.2)
    told = drawn(walker, 11, randomise=0.2, yaw=0.01, friction=0.7, direction=2.0)
    assert told["bend"] == free["bend"] and told["yaw"] == 0.01 and told["direction"] == 2.0
    assert told["variation"].friction == 0.7
    for name in ("mass", "tca_gain", "heat_loss", "ambient"):
        assert getattr(told["variation"], name) == getattr(free["variation"], name)
    plain = drawn(walker, 11)
    assert plain["variation"] == Variation() and plain["yaw"] == free["yaw"]
    walker.reset(seed=11, options={"randomise": 0.2})
    assert walker.variation == free["variation"]
    assert walker.sim.temperature == pytest.approx(free["variation"].ambient)
    walker.reset(seed=11)
    assert walker.variation == Variation()


def test_draws_fill_their_ranges(walker):
    """200 seeds, uniform: mean within four standard errors, extremes near the ends."""
    draws = [drawn(walker, seed, randomise=0.2) for seed in range(200)]
    columns = {
        "yaw": ([d["yaw"] for d in draws], 0.0, walker.task.yaw_range),
        "bend": ([d["bend"] for d in draws], walker.task.bend, walker.bend_range),
        "ambient": ([d["variation"].ambient for d in draws], 25.0, 5.0),
    } | {
        name: ([getattr(d["variation"], name) for d in draws], 1.0, 0.2)
        for name in ("friction", "mass", "tca_gain", "heat_loss")
    }
    table = []
    for values, middle, reach in columns.values():
        scaled = (np.array(values) - middle) / reach
        table.append(scaled)
        assert -1.0 <= scaled.min() < -0.95 and 0.95 < scaled.max() <= 1.0
        assert abs(scaled.mean()) < 4.0 / math.sqrt(3.0 * len(draws))
    correlation = np.corrcoef(table) - np.eye(len(table))
    assert np.abs(correlation).max() < 4.0 / math.sqrt(len(draws))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weight": 1.0}, r"options must be some of .*, got \['weight'\]"),
        ({"direction": 4.0}, r"direction must be between -3\.14159 and 3\.14159 rad, got 4\.0"),
        ({"direction": math.nan}, r"direction must be finite, got nan"),
        ({"yaw": 0.2}, r"yaw must be between -0\.05 and 0\.05 rad, got 0\.2"),
        ({"bend": 1.0}, r"bend must be between .* got 1\.0"),
        ({"randomise": 0.6}, r"randomise must be between 0 and 0\.5, got 0\.6"),
        ({"randomise": -0.1}, r"randomise must be between .* got -0\.1"),
        ({"friction": 0.0}, r"friction must be between 0.01 and 10, got 0"),
        ({"mass": (1.0, 2.0)}, r"mass must be one finite number"),
        ({"ambient": "warm"}, r"ambient must be a real number"),
    ],
)
def test_bad_options_are_refused(walker, options, message):
    with pytest.raises(ValueError, match=message):
        walker.reset(seed=0, options=options)


def test_a_beam_has_two_directions(envs):
    env = envs["shimmy"]
    env.reset(seed=0, options={"direction": math.pi})
    with pytest.raises(ValueError, match=r"direction must be one of \(0\.0, 3\.14.*got 0\.5"):
        env.reset(seed=0, options={"direction": 0.5})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"gait": "gallop"}, r"gait must be one of \('crawl', 'walk', 'shimmy'\), got 'gallop'"),
        ({"render_mode": "human"}, "render_mode must be one of .None, .* got 'human'"),
        ({"camera": "back"}, "camera must be one of .* got 'back'"),
        ({"body": "soft"}, r"body must be one of \('rigid', 'elastic', 'fine'\), got 'soft'"),
        ({"size": (0, 10)}, r"size\[0\] must be at least 1, got 0"),
        ({"timestep": 3e-3}, r"timestep must be 0\.1 s over a whole number, got 0\.003"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        TetrapodGait(**arguments)


def test_an_overheated_tca_ends_the_episode(walker):
    walker.reset(seed=0)
    action = OFF.copy()
    action[0] = 1.0
    charged = 0.0
    for _ in range(60):
        observation, _, terminated, truncated, info = walker.step(action)
        assert walker.observation_space.contains(observation)
        charged += info["reward_terms"]["heat"]
        if truncated:
            break
        assert info["temperature"].max() <= walker.max_temperature
        assert info["reward_terms"]["end"] == 0.0
    assert truncated and not terminated
    assert info["truncation_reason"].startswith("overheated: robot.front_left.tca0")
    assert info["reward_terms"]["end"] == -5.0 and charged < 0.0


def test_a_fall_ends_the_episode(envs):
    env = envs["walk"]
    env.reset(seed=0)
    env.data.qpos[3:7] = [math.cos(0.6), math.sin(0.6), 0.0, 0.0]  # on its side
    env.data.qpos[2] += 0.1
    *_, terminated, truncated, info = env.step(OFF)
    assert terminated and not truncated and info["termination_reason"] == "fell over"
    assert info["reward_terms"]["end"] == -5.0

    env = envs["shimmy"]
    env.reset(seed=0)
    env.data.qpos[1] += 0.3
    *_, terminated, _, info = env.step(OFF)
    assert terminated and info["termination_reason"] == "fell off the beam"


@pytest.mark.parametrize("gait", TASKS)
def test_the_scripted_gaits_get_on(envs, gait):
    """Two cycles after the first: at least half the published speed, without damage."""
    env, policy = envs[gait], gait_policy(gait)
    cycle = round(10 * GAITS[gait].period)
    infos = follow(env, policy, 3 * cycle)
    gained = infos[-1]["distance"] - infos[cycle - 1]["distance"]
    speed = gained / (infos[-1]["time"] - infos[cycle - 1]["time"])
    assert speed > 0.5 * TASKS[gait].speed
    assert abs(infos[-1]["drift"]) < 0.2 * infos[-1]["distance"]
    assert max(info["temperature"].max() for info in infos) < 175.0
    assert max(info["tension"].max() for info in infos) < 0.6


def test_a_rigid_body_is_as_good_as_an_elastic_one():
    """And shimmies, as on single spines, which is what lets it."""
    for gait, steps in (("walk", 60), ("shimmy", 150)):
        distance = [
            follow(
                TetrapodGait(gait=gait, action="power", body=body), gait_policy(gait), steps
            )[-1]["distance"]
            for body in ("rigid", "elastic")
        ]
        assert distance[0] > 5e-3
        # A beam's edges catch at the corners of the elastic body's coarser polygon.
        assert distance[0] == pytest.approx(distance[1], rel=0.02 if gait == "walk" else 0.25)


def test_the_walk_does_not_hang_on_the_time_step():
    """Nor on contacts that chatter: distances after a cycle and a half, at half the step, too."""
    policy = gait_policy("walk")
    distance = [
        follow(TetrapodGait(action="power", timestep=dt), policy, 90)[-1]["distance"]
        for dt in (6.25e-3, 3.125e-3)
    ]
    assert distance[0] == pytest.approx(distance[1], rel=0.02)


@pytest.mark.parametrize(("gait", "steps"), [("crawl", 90), ("walk", 90), ("shimmy", 150)])
def test_feet_land_without_sinking_in(envs, gait, steps, monkeypatch):
    """In no time step is a contact deeper than 0.3 mm, also where legs snap onto the beam.

    Once the robot has been put down: the flat one drops by 5 mm then.
    """
    step, depths = mujoco.mj_step, []

    def watched(model, data, count):
        for _ in range(count):
            step(model, data)
            depths.append(-data.contact.dist.min() if data.ncon else 0.0)

    monkeypatch.setattr(mujoco, "mj_step", watched)
    follow(envs[gait], gait_policy(gait), steps)
    timestep = envs[gait].model.opt.timestep
    walked = depths[round(0.5 / timestep) :]
    assert len(walked) == round(0.1 / timestep) * steps and max(walked) < 0.1e-3


SLOW = [pytest.param(gait, marks=pytest.mark.long) for gait in TASKS if gait != "walk"]


@pytest.mark.parametrize("gait", ["walk", *SLOW])
def test_mirrored_actions_end_in_the_mirror_image(envs, gait):
    """After 60 s, with a weaker left side, to a millionth of the distance."""
    env, policy = envs[gait], gait_policy(gait)
    straight = {"yaw": 0.0, "bend": TASKS[gait].bend}
    observation, _ = env.reset(seed=0, options=straight)
    actions = []
    for _ in range(600):
        action = policy.act(observation).reshape(4, 3)
        action[[0, 2]] = 0.9 * (action[[0, 2]] + 1.0) - 1.0
        actions.append(action)
        observation, *_ = env.step(action.ravel())
    one = env.data.qpos[:7].copy()
    env.reset(seed=0, options=straight)
    for action in actions:
        env.step(action[[1, 0, 3, 2]].ravel())
    other = env.data.qpos[:7] * [1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0]
    distance = float(np.hypot(*one[:2]))
    assert distance > 0.01 and np.abs(one[[1, 6]]).max() > 1e-5  # it went aside
    assert np.abs(one[:3] - other[:3]).max() < 1e-6 * distance
    assert np.abs(one[3:] - other[3:]).max() < 1e-6


@pytest.mark.parametrize("gait", ["walk", pytest.param("crawl", marks=pytest.mark.long)])
def test_contacts_do_not_make_the_speed(envs, gait):
    """Contacts without a layer, at a fifth of the step, and a layer twice as thick: within 5 %."""
    distance = []
    for change in (None, "hard", "thick"):
        timestep = 1e-3 if change == "hard" else 5e-3
        env = TetrapodGait(gait=gait, action="power", timestep=timestep)
        model = env.sim.model
        mine = np.flatnonzero(model.geom_priority > 0)
        if change == "hard":  # gives under a foot's load as much as a ball of silicone
            model.geom_margin[mine] = 0.0
            model.geom_solref[mine, 0] = 2e-3
            model.geom_solimp[mine, :2] = 0.9
        elif change == "thick":
            model.geom_margin[mine] *= 2.0
            model.geom_solimp[mine, 2] *= 2.0
        infos = follow(env, gait_policy(gait), 90)
        distance.append(infos[-1]["distance"] - infos[29]["distance"])
    assert distance[0] > 5e-3
    assert distance[0] == pytest.approx(distance[1], rel=0.05)
    assert distance[0] == pytest.approx(distance[2], rel=0.05)


def test_the_script_turns_to_where_it_is_told(walker):
    policy = gait_policy("walk")
    side = follow(walker, policy, 120, direction=0.6, yaw=0.0)[-1]
    assert side["drift"] < 0.0  # it began to the right of the line and turns left
    rows = OBSERVATION.read(walker.seen())
    heading = 0.6 - math.atan2(*rows["commanded direction"][::-1])
    assert heading > 0.05


def test_the_script_takes_only_known_gaits():
    with pytest.raises(ValueError, match="gait must be one of .* got 'trot'"):
        gait_policy("trot")
    assert set(GAITS) == set(TASKS)

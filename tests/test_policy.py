"""Policies as files: what is saved acts alike when it is read, and needs no training code."""

import itertools
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from tca_mj.agents.policies import Origin, SavedPolicy, files, load_policy, shipped
from tca_mj.agents.policies.actors import arguments_of
from tca_mj.agents.policies.network import Network
from tca_mj.agents.scripts.tetrapod import WALK, gait_policy
from tca_mj.control import Gait
from tca_mj.envs.gaits import ACTION, OBSERVATION
from tca_mj.modules.continuum_leg import LegSpec
from tca_mj.registry import make

WALKING = "TCA/TetrapodWalk-v0"
ORIGIN = Origin(algorithm="by hand", seed=3, steps=7, command="none", versions={"numpy": "2"})
STEERING = (600.0, 600.0, 500.0, 500.0)


def network(inputs: int, squash: str = "clip", activation: str = "tanh") -> Network:
    rng = np.random.default_rng(0)
    sizes = [inputs, 8, 5, ACTION.size]
    pairs = list(zip(sizes[1:], sizes[:-1], strict=True))
    return Network(
        weights=tuple(rng.normal(0.0, 0.5, pair).astype(np.float32) for pair in pairs),
        biases=tuple(rng.normal(0.0, 0.5, pair[0]).astype(np.float32) for pair in pairs),
        mean=rng.normal(size=inputs),
        var=rng.uniform(0.1, 2.0, inputs),
        clip=3.0,
        squash=squash,
        activation=activation,
    )


POLICIES = {
    "gait": SavedPolicy(task=WALKING, origin=ORIGIN, gait=WALK, steering=STEERING),
    "network": SavedPolicy(task=WALKING, origin=ORIGIN, network=network(OBSERVATION.size)),
    "residual": SavedPolicy(
        task=WALKING, origin=ORIGIN, gait=WALK, steering=STEERING, bound=20.0,
        network=network(OBSERVATION.size + 2, "tanh", "relu"),
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def env():
    return gym.make(WALKING, action="power")


def seen(n: int) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    rows = rng.uniform(OBSERVATION.space.low, OBSERVATION.space.high, (n, OBSERVATION.size))
    return list(rows.astype(np.float32))


@pytest.mark.parametrize("kind", POLICIES)
def test_a_policy_acts_alike_after_it_was_written_and_read(kind, env, tmp_path):
    saved = POLICIES[kind]
    path = saved.save(tmp_path / f"walker{files.KINDS[kind]}")
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    back = SavedPolicy.read(path)
    assert (back.kind, back.task, back.origin) == (kind, WALKING, ORIGIN)
    first, second = saved.make(env), load_policy(path, env)
    for policy in (first, second):
        policy.reset()
    for observation in seen(30):
        action = second.act(observation)
        np.testing.assert_array_equal(action, first.act(observation))
        assert env.action_space.contains(action)
    assert second.phase


def test_a_gait_file_is_the_scripted_policy(env):
    script, loaded = gait_policy("walk"), POLICIES["gait"].make(env)
    for observation in seen(70):
        observation[OBSERVATION.slices["commanded direction"]] = (1.0, 0.0)
        np.testing.assert_array_equal(loaded.act(observation), script.act(observation))


def test_a_correction_makes_hotter_up_to_the_limit_and_colder():
    def heated(correction):
        walker = gait_policy("walk")
        observation = np.zeros(OBSERVATION.size, dtype=np.float32)
        rows = OBSERVATION.slices
        observation[rows["TCA temperature"]] = 100.0
        observation[rows["commanded direction"]] = (1.0, 0.0)
        gait = walker.gait.temperature(0.0)
        observation[rows["TCA temperature"]] = gait
        return walker.act(observation, np.full(ACTION.size, correction)), gait

    plain, gait = heated(0.0)
    warmer, _ = heated(5.0)
    much, _ = heated(500.0)
    assert ((warmer > plain) == (gait < 172.0)).all() and (warmer[gait == 172.0] == plain[
        gait == 172.0]).all()  # fmt: skip
    hold = LegSpec().tca.of_length(LegSpec().length).heat
    full = (gait < 160.0) & (hold.keeping(172.0, 25.0) + hold.capacity * (172.0 - gait) / 0.4 > 4.0)
    assert full.any() and (much[full] == 1.0).all()  # the power's own limit
    assert (heated(-5.0)[0] < plain).all()


def test_a_network_does_what_its_formula_says():
    net = network(4, "tanh", "relu")
    x = np.array([1.0, -2.0, 30.0, 0.5], dtype=np.float32)
    h = np.clip((x - net.mean) / np.sqrt(net.var + 1e-8), -3.0, 3.0)
    for weight, bias in zip(net.weights[:-1], net.biases[:-1], strict=True):
        h = np.maximum(weight @ h + bias, 0.0)
    expected = np.tanh(net.weights[-1] @ h + net.biases[-1])
    np.testing.assert_allclose(net(x), expected, rtol=1e-5)
    assert net(x).dtype == np.float32
    loud = Network(weights=(9.0 * np.eye(4, dtype=np.float32),), biases=(np.zeros(4, np.float32),),
                   mean=np.zeros(4), var=np.ones(4))  # fmt: skip
    np.testing.assert_array_equal(loud(x), np.array([1.0, -1.0, 1.0, 1.0], dtype=np.float32))


def test_wrong_files_are_refused_by_name(env, tmp_path):
    with pytest.raises(FileNotFoundError, match="no shipped policy of that name"):
        load_policy("nobody", env)
    path = POLICIES["gait"].save(tmp_path / "walk.json")
    other = gym.make("TCA/TetrapodCrawl-v0", action="power")
    with pytest.raises(ValueError, match="must be a policy for TCA/TetrapodCrawl-v0, got .*Walk"):
        load_policy(path, other)
    header = json.loads(path.read_text())
    for change, message in (
        ({"format": 2}, "format must be 1, got 2"),
        ({"kind": "fuzzy"}, "kind must be one of"),
        ({"steering": [1.0]}, "steering must have 4 numbers"),
        ({"gait": header["gait"] | {"period": -1.0}}, "period must be finite and above 0"),
        ({"gait": header["gait"] | {"hot": "hot"}}, "hot must be a real number"),
        ({"origin": {}}, "is no policy"),
    ):
        path.write_text(json.dumps(header | change))
        with pytest.raises(ValueError, match=message):
            load_policy(path, env)
    path.write_bytes(b"\x00\xff")
    (tmp_path / "bad.npz").write_bytes(b"PK no")
    for bad in (path, tmp_path / "bad.npz"):
        with pytest.raises(ValueError, match="is no policy"):
            load_policy(bad, env)
    small = SavedPolicy(task=WALKING, origin=ORIGIN, network=network(5))
    with pytest.raises(ValueError, match="must turn 71 numbers into 12, got .* from 5 to 12"):
        load_policy(small.save(tmp_path / "small.npz"), env)
    with pytest.raises(ValueError, match=r"path must end in \.npz for a network"):
        small.save(tmp_path / "small.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bound": 0.0}, "bound must be above 0 K"),
        ({"gait": None, "steering": ()}, "bound must be above 0 K"),
        ({"gait": None, "network": None}, "neither"),
        ({"steering": (1.0, np.nan, 1.0, 1.0)}, "must be finite"),
    ],
)
def test_impossible_policies_are_refused(change, message):
    good = {"task": WALKING, "origin": ORIGIN, "gait": WALK, "steering": STEERING, "bound": 20.0,
            "network": POLICIES["residual"].network}  # fmt: skip
    SavedPolicy(**good)
    with pytest.raises(ValueError, match=message):
        SavedPolicy(**good | change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"activation": "gelu"}, "activation must be one of"),
        ({"squash": "sign"}, "squash must be one of"),
        ({"clip": 0.0}, "clip must be finite and above 0"),
        ({"var": -np.ones(4)}, "var must be finite and at least 0"),
        ({"var": np.ones(3)}, "var must be a row like mean"),
        ({"mean": np.full(4, np.nan)}, "mean must be finite, got"),
        ({"biases": ()}, "biases must be as many as weights"),
        ({"weights": (np.ones((12, 5), np.float32),)}, r"weights\[0\] must have the shape"),
    ],
)
def test_impossible_networks_are_refused(change, message):
    good = {"weights": (np.ones((12, 4), np.float32),), "biases": (np.ones(12, np.float32),),
            "mean": np.zeros(4), "var": np.ones(4)}  # fmt: skip
    Network(**good)
    with pytest.raises(ValueError, match=message):
        Network(**good | change)


SIDES = (np.array([1, 0, 2, 3]), np.array([1.0, 1.0, -1.0, 1.0], np.float32))  # of what is seen
PLACES = (np.array([2, 1, 0]), np.array([-1.0, 1.0, -1.0], np.float32))  # of what is done


@pytest.mark.parametrize("widths", [(), (5,), (6, 5)])
@pytest.mark.parametrize("squash", ["clip", "tanh"])
def test_a_network_made_alike_does_in_a_mirror_what_is_seen_there(widths, squash):
    random, sizes = np.random.default_rng(3), (4, *widths, 3)
    layers = list(itertools.pairwise(sizes))
    one = Network(
        weights=tuple(random.normal(size=(b, a)) for a, b in layers),
        biases=tuple(random.normal(size=b) for _, b in layers),
        mean=np.zeros(4), var=np.ones(4), squash=squash, activation="relu",
        units=np.array([[2.0, 2.0, 0.0, 1.0], [3.0, 3.0, 1.0, 0.5]]),
        bounds=np.array([[-0.5, -0.1, -0.7], [0.7, 0.2, 0.5]]),
    )  # fmt: skip
    (source, sign), (place, side) = SIDES, PLACES
    both = one.alike(SIDES, PLACES)
    for seen in random.normal(size=(20, 4)).astype(np.float32):
        image = seen[source] * sign
        np.testing.assert_allclose(both(image), both(seen)[place] * side, atol=1e-6)
        assert not np.allclose(one(image), one(seen)[place] * side, atol=1e-3)
        # Who does so already stays as it is.
        np.testing.assert_allclose(both.alike(SIDES, PLACES)(seen), both(seen), atol=1e-6)
    free = replace(one, squash="clip", bounds=np.array([[-1e3] * 3, [1e3] * 3]))
    np.testing.assert_allclose(  # the mean of what it asks for here and of that in the mirror
        free.alike(SIDES, PLACES)(seen), (free(seen) + free(image)[place] * side) / 2.0, atol=1e-5
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mean": np.array([1.0, 0.0, 0.0, 0.0])}, "mean must be the same in the mirror"),
        ({"mean": np.array([0.0, 0.0, 1.0, 0.0])}, "mean must be the same in the mirror"),
        ({"var": np.array([1.0, 2.0, 1.0, 1.0])}, "var must be the same in the mirror"),
        ({"units": np.array([[0.0] * 4, [1.0, 2.0, 1.0, 1.0]])}, "units must be the same"),
        ({"bounds": np.array([[-1.0, -1.0, -0.5], [1.0] * 3])}, "bounds must be the same"),
    ],
)
def test_a_network_of_unlike_sides_is_not_made_alike(change, message):
    one = Network(weights=(np.ones((3, 4)),), biases=(np.zeros(3),), mean=np.zeros(4),
                  var=np.ones(4))  # fmt: skip
    with pytest.raises(ValueError, match=message):
        replace(one, **change).alike(SIDES, PLACES)
    with pytest.raises(ValueError, match="action must mirror 3 numbers, got 4"):
        one.alike(SIDES, SIDES)
    with pytest.raises(ValueError, match="observation must mirror 4 numbers, got 3"):
        one.alike(PLACES, PLACES)


def test_a_policy_loads_without_what_trained_it(tmp_path):
    path = POLICIES["residual"].save(tmp_path / "walk.npz")
    code = (
        "import sys, gymnasium, tca_mj; from tca_mj.agents.policies import load_policy\n"
        f"env = gymnasium.make('{WALKING}', action='power')\n"
        f"p = load_policy({str(path)!r}, env); p.reset()\n"
        "p.act(env.reset(seed=0)[0])\n"
        "print([m for m in ('torch', 'stable_baselines3', 'cmaes') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize(
    ("arguments", "made", "message"),
    [
        ({"action": "power"}, {}, "action must be 'power' for this policy, got 'temperature'"),
        ({}, {"action": "power"}, "action must be 'temperature' for this policy, got 'power'"),
        (
            {"action": "power", "control_period": 0.2},
            {"action": "power"},
            "control_period must be 0.2 for this policy, got 0.1",
        ),
        (
            {"action": "power"},
            {"action": "power", "control_period": 0.05},
            "control_period must be 0.1 for this policy, got 0.05",
        ),
    ],
)
def test_a_policy_for_another_action_is_refused(arguments, made, message, tmp_path):
    """The file says what the task was made with, and with that it acts."""
    saved = SavedPolicy(
        task=WALKING, origin=ORIGIN, network=network(OBSERVATION.size), arguments=arguments
    )
    path = saved.save(tmp_path / "walker.npz")
    assert SavedPolicy.read(path).arguments == arguments == arguments_of(path, WALKING)
    with pytest.raises(ValueError, match=message):
        load_policy(path, make(WALKING, **made))
    needed = make(WALKING, **arguments)
    assert load_policy(path, needed).act(needed.reset(seed=0)[0]) in needed.action_space


def test_what_a_task_is_registered_with_needs_no_mention(tmp_path):
    told = {"action": "power", "control_period": 0.2}
    entry = "tca_mj.envs.tetrapod:TetrapodGait"
    gym.register("Example/Slow-v0", entry_point=entry, max_episode_steps=50, kwargs=told)
    try:
        saved = SavedPolicy(
            task="Example/Slow-v0", origin=ORIGIN, network=network(OBSERVATION.size), arguments={}
        )
        path = saved.save(tmp_path / "slow.npz")
        env = make("Example/Slow-v0", **arguments_of(path, "Example/Slow-v0"))
        assert env.unwrapped.heating == "power" and env.spec.max_episode_steps == 50
        load_policy(path, env)
        quick = make("Example/Slow-v0", control_period=0.1)
        assert quick.spec.max_episode_steps == 100
        with pytest.raises(ValueError, match="control_period must be 0.2 for this policy, got 0.1"):
            load_policy(path, quick)
    finally:
        gym.registry.pop("Example/Slow-v0")


def test_a_file_from_before_there_were_arguments_is_one_of_power(tmp_path):
    path = POLICIES["gait"].save(tmp_path / "walk.json")
    header = json.loads(path.read_text())
    del header["arguments"]
    path.write_text(json.dumps(header))
    assert SavedPolicy.read(path) == POLICIES["gait"]
    assert SavedPolicy.read(path).arguments == {"action": "power"}


def test_every_shipped_policy_can_be_loaded():
    for name, path in shipped().items():
        saved = SavedPolicy.read(path)
        policy = load_policy(name, make(saved.task, **saved.arguments))
        policy.reset()
        assert saved.origin.command and Path(path).suffix == files.KINDS[saved.kind]


def test_a_gait_with_rows_for_every_leg_is_the_same_gait():
    wide = Gait(
        period=WALK.period, offset=WALK.offset,
        **{name: (getattr(WALK, name),) * 4 for name in ("start", "duty", "hot", "warm")},
    )  # fmt: skip
    phase = np.linspace(0.0, 2.0, 41)
    np.testing.assert_array_equal(wide.temperature(phase), WALK.temperature(phase))
    assert wide.table("hot").shape == WALK.table("hot").shape == (4, 3)
    front = Gait(period=1.0, offset=(0.0, 0.5), start=((0.0, 0.25), (0.5, 0.75)), duty=(0.25, 0.25),
                 hot=((100.0, 110.0), (120.0, 130.0)), warm=(20.0, 30.0))  # fmt: skip
    assert front.temperature([0.0, 0.3]).tolist() == [
        [100.0, 30.0, 120.0, 30.0],
        [20.0, 110.0, 20.0, 130.0],
    ]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"hot": ((1.0, 2.0, 3.0),) * 3}, "hot must have 1 or 4 rows, got 3"),
        ({"hot": ((1.0, 2.0),) * 4}, "hot must have 3 numbers per leg, got 2"),
        ({"duty": ((0.5, 0.5, 0.5), (0.5, 1.5, 0.5)) * 2}, "duty must be finite and at least 0"),
        ({"warm": ((200.0, 25.0, 25.0),) * 4}, "warm must be at most hot"),
        ({"offset": ((0.0, 0.0), (0.0, 0.0))}, "offset must be a row"),
        ({"start": ((0.0, 0.1), (0.0,))}, "start must be a real number or an array"),
    ],
)
def test_impossible_gaits_are_refused(change, message):
    good = {name: getattr(WALK, name) for name in WALK.__dataclass_fields__}
    with pytest.raises(ValueError, match=message):
        Gait(**good | change)

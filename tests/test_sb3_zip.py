"""Models of Stable-Baselines3: they act as they did, their files run nothing, bad ones are said."""

import base64
import io
import json
import pickle
import struct
import subprocess
import sys
import tracemalloc
import warnings
import zipfile
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import onnxruntime
import pytest
import torch
from gymnasium import spaces
from sb3_contrib import ARS, TQC, TRPO, CrossQ, RecurrentPPO
from stable_baselines3 import A2C, DDPG, DQN, PPO, SAC, TD3
from stable_baselines3.common.torch_layers import FlattenExtractor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
from torch import nn

import tca_mj  # noqa: F401  (registers the ids)
from tca_mj.agents.policies import (
    Preprocessing,
    SavedPolicy,
    Statistics,
    archives,
    load_policy,
    read_zip,
    saved_policy,
)
from tca_mj.agents.policies.sb3_zip import Model
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.envs.wrappers import ScaledObservation

TASK = "TCA/MorphModule-v0"
SEEN, SAME = 9, 1e-6  # numbers of an observation; how much actions may differ


class Empty(gym.Env[Any, Any]):
    """Only spaces."""

    def __init__(self, seen: Any = None, acts: Any = None) -> None:
        self.observation_space = seen or spaces.Box(-50.0, 300.0, (SEEN,), np.float32)
        self.action_space = acts or spaces.Box(-1.0, 1.0, (3,), np.float32)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return self.observation_space.sample(), 0.0, False, False, {}


def untrained(kind: Any, env: Any, policy: str = "MlpPolicy", **arguments: Any) -> Any:
    """A model with random weights, biases and statistics of batches."""
    if issubclass(kind, SAC | TD3 | TQC | CrossQ | DQN):
        arguments["buffer_size"] = 2
    model = kind(policy, env, seed=0, device="cpu", **arguments)
    random = torch.Generator().manual_seed(0)
    with torch.no_grad():
        for name, value in model.policy.state_dict().items():
            if name.endswith("ra_var"):
                value.copy_(torch.rand(value.shape, generator=random) * 2.0 + 0.3)
            elif value.is_floating_point():
                value.add_(torch.randn(value.shape, generator=random) * 0.05)
            if name == "actor.mu.0.bias" and arguments.get("use_sde"):  # to where gSDE cuts off
                edge = arguments["policy_kwargs"].get("clip_mean", 2.0)
                value.add_(edge * torch.tensor([0.7, -0.7, 0.0]))
    return model


def box(low: Any, high: Any) -> Any:
    return spaces.Box(np.array(low, np.float32), np.array(high, np.float32))


def small(*actor: int, **more: Any) -> dict[str, Any]:
    return {"net_arch": {"pi": list(actor), "vf": [4], "qf": [4]}, **more}


WIDE = box([-1.0, 0.0, -0.25], [1.5, 0.5, 0.123456789])
CASES: dict[str, tuple[Any, Any, dict[str, Any]]] = {
    "ppo": (PPO, None, {}),
    "ppo, elu, not shared": (PPO, WIDE, {"policy_kwargs": {
        "net_arch": {"pi": [24, 7], "vf": [5]}, "activation_fn": nn.ELU,
        "share_features_extractor": False}}),
    "ppo, gsde": (PPO, WIDE, {"use_sde": True}),
    "ppo, gsde, squashed": (PPO, WIDE, {"use_sde": True, "policy_kwargs": {"squash_output": True}}),
    "a2c": (A2C, None, {"policy_kwargs": {"activation_fn": nn.ReLU}}),
    "a2c, linear": (A2C, None, {"policy_kwargs": {"net_arch": []}}),
    "trpo": (TRPO, None, {}),
    "sac": (SAC, None, {"policy_kwargs": small(32, 32)}),
    "sac, tanh": (SAC, WIDE, {"policy_kwargs": small(32, 16, 8, activation_fn=nn.Tanh)}),
    "sac, gsde": (SAC, None, {"use_sde": True, "policy_kwargs": small(32, 32)}),
    "sac, gsde, clipped": (SAC, WIDE, {"use_sde": True,
                                       "policy_kwargs": small(32, clip_mean=0.4)}),
    "sac, gsde, not clipped": (SAC, None, {"use_sde": True,
                                           "policy_kwargs": small(32, clip_mean=0.0)}),
    "td3": (TD3, None, {"policy_kwargs": small(40, 30)}),
    "ddpg": (DDPG, WIDE, {"policy_kwargs": small(40, 30, activation_fn=nn.LeakyReLU)}),
    "tqc": (TQC, None, {"policy_kwargs": small(32, 32, activation_fn=nn.SiLU)}),
    "crossq": (CrossQ, None, {"policy_kwargs": small(32, 32)}),
    "crossq, gsde": (CrossQ, WIDE, {"use_sde": True, "policy_kwargs": small(
        32, 16, activation_fn=nn.ELU, batch_norm_eps=0.02)}),
    "crossq, plain": (CrossQ, None, {"policy_kwargs": small(32, 32, batch_norm=False)}),
    "ars": (ARS, None, {"policy_kwargs": {"net_arch": [16]}}),
}  # fmt: skip


def in_onnx(policy: SavedPolicy, path: Path, observations: Any) -> Any:
    session = onnxruntime.InferenceSession(policy.to_onnx(path).read_bytes())
    return session.run(["action"], {"observation": observations})[0]


@pytest.mark.parametrize("case", CASES)
def test_actions_are_the_same_from_zip_npz_and_onnx(case: str, tmp_path: Path) -> None:
    kind, acts, arguments = CASES[case]
    model = untrained(kind, Empty(acts=acts), **arguments)
    model.save(tmp_path / "model.zip")
    random = np.random.default_rng(0)
    observations = random.normal(0.0, 1.0, (1000, SEEN)).astype(np.float32)
    observations[::10] *= 3.0
    expected, _ = model.predict(observations, deterministic=True)
    space = model.action_space
    assert (np.ptp(expected, axis=0) > 0.01 * (space.high - space.low)).all()
    read = Model.read(tmp_path / "model.zip")
    saved = SavedPolicy(task=TASK, origin=read.origin, network=read.network)
    again = SavedPolicy.read(saved.save(tmp_path / "model.npz"))
    assert read.network is not None and again.network is not None
    for network in (read.network, again.network):
        actions = np.array([network(observation) for observation in observations])
        np.testing.assert_allclose(actions, expected, rtol=0.0, atol=SAME)
        assert actions.dtype == np.float32
    elsewhere = in_onnx(again, tmp_path / "model.onnx", observations)
    np.testing.assert_allclose(elsewhere, expected, rtol=0.0, atol=SAME)
    np.testing.assert_allclose(elsewhere, actions, rtol=2e-7, atol=1e-9)  # a digit of float32
    assert (actions >= space.low - SAME).all() and (actions <= space.high + SAME).all()
    assert read.seen is not None
    np.testing.assert_allclose(read.seen[:, 0], [-50.0, 300.0])
    assert again.origin.seed == 0 and again.origin.versions["stable_baselines3"]


def test_a_linear_policy_of_ars_is_one_without_bias(tmp_path: Path) -> None:
    model = untrained(ARS, Empty(acts=WIDE), "LinearPolicy")
    model.save(tmp_path / "model.zip")
    network = Model.read(tmp_path / "model.zip").network
    assert network.squash == "clip" and not network.biases[0].any()
    observations = np.random.default_rng(0).normal(size=(100, SEEN)).astype(np.float32)
    actions = np.array([network(observation) for observation in observations])
    np.testing.assert_allclose(actions, model.predict(observations)[0], rtol=0.0, atol=SAME)


def test_a_batch_normalisation_takes_off_what_is_large(tmp_path: Path) -> None:
    """Observations of 100 ± 10, which a first layer on its own would round away."""
    model = untrained(CrossQ, Empty(), policy_kwargs=small(32, 32))
    with torch.no_grad():
        model.policy.actor.latent_pi[0].ra_mean.fill_(100.0)
        model.policy.actor.latent_pi[0].ra_var.fill_(100.0)
    model.save(tmp_path / "model.zip")
    network = Model.read(tmp_path / "model.zip").network
    observations = np.random.default_rng(0).normal(100.0, 10.0, (1000, SEEN)).astype(np.float32)
    actions = np.array([network(observation) for observation in observations])
    expected = model.predict(observations, deterministic=True)[0]
    np.testing.assert_allclose(actions, expected, rtol=0.0, atol=SAME)


@pytest.mark.parametrize("kind", [PPO, CrossQ])
@pytest.mark.parametrize("scaled", [False, True])
def test_what_it_was_trained_with_becomes_part_of_it(
    kind: Any, scaled: bool, tmp_path: Path
) -> None:
    """Scales of the task, then VecNormalize, then the model; with and without a pickle."""
    tasks = VecNormalize(TaskVecEnv.make(TASK, 1, scaled=scaled), clip_obs=2.0, epsilon=1e-6)
    model = untrained(kind, tasks, policy_kwargs=small(32, 32))
    model.save(tmp_path / "model.zip")
    env = gym.make(TASK)
    table: Any = env.unwrapped.observation  # type: ignore[attr-defined]
    random = np.random.default_rng(0)
    rows = random.uniform(table.space.low, table.space.high, (1000, table.size)).astype(np.float32)
    seen = table.scaled(rows) if scaled else rows
    tasks.obs_rms.update(seen)  # type: ignore[union-attr]
    tasks.obs_rms.var[0] = 1e-5  # type: ignore[union-attr]  # what hardly changed in the training
    tasks.save(str(tmp_path / "statistics.pkl"))
    np.savez(
        tmp_path / "statistics.npz", mean=tasks.obs_rms.mean, var=tasks.obs_rms.var,  # type: ignore[union-attr]
        clip=tasks.clip_obs, epsilon=tasks.epsilon,
    )  # fmt: skip
    expected = model.predict(tasks.normalize_obs(seen), deterministic=True)[0]
    assert expected.std() > 0.05
    for name, trust in (("statistics.npz", False), ("statistics.pkl", True)):
        statistics = Statistics.read(tmp_path / name, trust=trust)
        policy = read_zip(tmp_path / "model.zip", env, Preprocessing(statistics=statistics))
        acting = policy.make(env)
        actions = np.array([acting.act(row) for row in rows])
        np.testing.assert_allclose(actions, expected, rtol=0.0, atol=SAME)
        assert policy.network is not None and (policy.network.units is not None) == scaled
    np.testing.assert_allclose(
        in_onnx(policy, tmp_path / "a.onnx", rows), expected, rtol=0.0, atol=SAME
    )


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A model of ``Empty``."""
    untrained(PPO, Empty(), policy_kwargs=small(8)).save(tmp_path / "bare.zip")
    return tmp_path / "bare.zip"


def test_whether_it_saw_scaled_observations_is_told_from_their_bounds(tmp_path: Path) -> None:
    env, path = gym.make(TASK), tmp_path / "model.zip"
    task: Any = env.unwrapped
    row = env.reset(seed=0)[0]
    for scaled in (False, True):
        model = untrained(PPO, TaskVecEnv.make(TASK, 1, scaled=scaled), policy_kwargs=small(8))
        model.save(path)
        seen = task.observation.scaled(row) if scaled else row
        expected = model.predict(seen, deterministic=True)[0]
        np.testing.assert_allclose(load_policy(path, env).act(row), expected, rtol=0.0, atol=SAME)
    # The environment scales already.
    inside = load_policy(path, ScaledObservation(env))
    np.testing.assert_allclose(inside.act(seen), expected, rtol=0.0, atol=SAME)
    # Bounds that are neither's, as of a wrapper of one's own.
    wide = spaces.Box(-np.inf, np.inf, row.shape, np.float32)
    model = untrained(PPO, Empty(wide, env.action_space), policy_kwargs=small(8))
    model.save(path)
    with pytest.raises(ValueError, match=r"model\.zip must be said to be scaled or not.* neither"):
        load_policy(path, env)
    for scaled in (False, True):
        acting = load_policy(path, env, Preprocessing(scaled=scaled))
        seen = task.observation.scaled(row) if scaled else row
        expected = model.predict(seen, deterministic=True)[0]
        np.testing.assert_allclose(acting.act(row), expected, rtol=0.0, atol=SAME)


def test_it_says_what_its_task_was_made_with_when_it_is_kept(tmp_path: Path) -> None:
    tasks = TaskVecEnv.make(TASK, 1, scaled=True, control_period=0.2, action="power")
    untrained(PPO, tasks, policy_kwargs=small(8)).save(tmp_path / "model.zip")
    made = {"control_period": 0.2, "action": "power"}
    policy = saved_policy(tmp_path / "model.zip", TASK, made)
    assert policy.arguments == made and policy.task == TASK
    kept = policy.save(tmp_path / "model.npz")
    env = gym.make(TASK, **made)
    row = env.reset(seed=0)[0]
    one, other = (load_policy(path, env).act(row) for path in (tmp_path / "model.zip", kept))
    np.testing.assert_array_equal(one, other)
    with pytest.raises(ValueError, match="control_period must be 0.2 for this policy, got 0.1"):
        load_policy(kept, gym.make(TASK, action="power"))
    with pytest.raises(ValueError, match=r"task must name what .*model\.zip was trained in"):
        saved_policy(tmp_path / "model.zip")
    with pytest.raises(ValueError, match=r"must be a \.zip to be told how it sees the task"):
        load_policy(kept, env, Preprocessing(scaled=True))


def test_models_for_other_spaces_are_refused(bare: Path) -> None:
    env = gym.make(TASK)
    count = (env.observation_space.shape or ())[0]
    reach = gym.make("TCA/BendReach-v0")
    with pytest.raises(ValueError, match=r"must turn \d\d numbers into 3, got .* from 9 to 3"):
        load_policy(bare, reach)
    untrained(PPO, Empty(env.observation_space, WIDE), policy_kwargs=small(8)).save(bare)
    with pytest.raises(ValueError, match="must have the task's bounds of actions"):
        load_policy(bare, env)
    untrained(PPO, TaskVecEnv.make(TASK, 1), policy_kwargs=small(8)).save(bare)
    few = Statistics(mean=(0.0,), var=(1.0,), clip=10.0, epsilon=1e-8)
    with pytest.raises(ValueError, match=f"statistics must be of {count} numbers, got 1"):
        load_policy(bare, env, Preprocessing(statistics=few))


class Scaling(FlattenExtractor):
    """Has no tensors, and yet does something."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return super().forward(observations) * 0.01


PICTURE = spaces.Box(0, 255, (36, 36, 3), np.uint8)
TABLE = spaces.Dict({"a": spaces.Box(-1.0, 1.0, (2,), np.float32)})


@pytest.mark.parametrize(
    ("kind", "env", "policy", "settings", "said"),
    [
        (PPO, Empty(PICTURE), "CnnPolicy", None, "observation_space must be a Box of one row"),
        (PPO, Empty(TABLE), "MultiInputPolicy", None, "observation_space must be a Box"),
        (PPO, Empty(acts=spaces.Discrete(3)), "MlpPolicy", None, "action_space must be a Box"),
        (DQN, Empty(acts=spaces.Discrete(3)), "MlpPolicy", None, "policy's class must be of one"),
        (RecurrentPPO, Empty(), "MlpLstmPolicy", None, "those that remember cannot be known"),
        (PPO, Empty(), "MlpPolicy", {"activation_fn": nn.Mish}, "activation_fn must be one of"),
        (PPO, Empty(), "MlpPolicy", {"features_extractor_class": Scaling}, "no extractor"),
    ],
)  # fmt: skip
def test_what_cannot_be_known_from_a_zip_is_refused(
    kind: Any, env: Any, policy: str, settings: Any, said: str, tmp_path: Path
) -> None:
    kind(policy, env, device="cpu", policy_kwargs=settings,
         **({"buffer_size": 2} if kind is DQN else {"n_steps": 4, "batch_size": 4})
         ).save(tmp_path / "model.zip")  # fmt: skip
    with pytest.raises(ValueError, match=rf"model\.zip is no model .*{said}"):
        Model.read(tmp_path / "model.zip")


def test_a_class_of_ones_own_is_refused(tmp_path: Path) -> None:
    from stable_baselines3.sac.policies import SACPolicy

    class Own(SACPolicy):
        pass

    SAC(Own, Empty(), buffer_size=2, device="cpu").save(tmp_path / "model.zip")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="policy's class must be of one of"):
        Model.read(tmp_path / "model.zip")


def rewritten(path: Path, compression: int = zipfile.ZIP_STORED, **members: bytes | None) -> None:
    """Replaces members of a zip, ``policy_pth`` for ``policy.pth``; None takes one out."""
    with zipfile.ZipFile(path) as archive:
        content: dict[str, bytes | None] = {name: archive.read(name) for name in archive.namelist()}
    content |= {name.replace("_pth", ".pth"): value for name, value in members.items()}
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, value in content.items():
            if value is not None:
                archive.writestr(name, value)


def torch_file(**tensors: Any) -> bytes:
    memory = io.BytesIO()
    torch.save({name.replace("__", "."): tensor for name, tensor in tensors.items()}, memory)
    return memory.getvalue()


def member(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


def with_state(path: Path, **changes: Any) -> bytes:
    """``policy.pth`` with other tensors, ``__`` for a dot; None takes one out."""
    state = torch.load(io.BytesIO(member(path, "policy.pth")), weights_only=True)
    state |= {name.replace("__", "."): value for name, value in changes.items()}
    memory = io.BytesIO()
    torch.save({name: value for name, value in state.items() if value is not None}, memory)
    return memory.getvalue()


FIRST = "mlp_extractor__policy_net__0__weight"
BROKEN = {
    "a tensor that is not finite": (
        lambda path: {"policy_pth": with_state(path, **{FIRST: torch.full((8, 9), np.nan)})},
        r"weights\[0\] must be finite"),
    "shapes that do not fit": (
        lambda path: {"policy_pth": with_state(path, **{FIRST: torch.zeros(7, 9)})},
        "weights"),
    "a cube": (
        lambda path: {"policy_pth": with_state(path, **{FIRST: torch.zeros(8, 3, 3)})},
        "must be a row or a matrix"),
    "a tensor that is not contiguous": (
        lambda path: {"policy_pth": with_state(path, **{FIRST: torch.zeros(9, 8).T})},
        "must be contiguous"),
    "text in place of numbers": (
        lambda path: {"policy_pth": with_state(path, **{FIRST: torch.zeros(8, 9).bool()})},
        "must be a tensor of numbers"),
    "a layer that is missing": (
        lambda path: {"policy_pth": with_state(path, **{FIRST: None})},
        "linear layers with an activation between them"),
    "a layer of another kind": (
        lambda path: {"policy_pth": with_state(path, mlp_extractor__policy_net__2__weight=
                                               torch.zeros(8))},
        "linear layers with an activation between them"),
    "shared layers": (
        lambda path: {"policy_pth": with_state(path, mlp_extractor__shared_net__0__weight=
                                               torch.zeros(9, 9))},
        "shared layers are not read"),
    "no tensors": (lambda path: {"policy_pth": torch_file()}, "must have layers .* got none"),
    "junk": (lambda path: {"policy_pth": b"junk" * 100}, "not a zip file"),
    "a plain pickle": (lambda path: {"policy_pth": pickle.dumps({"a": 1})}, "not a zip file"),
    "an empty zip": (lambda path: {"policy_pth": b"PK\x05\x06" + bytes(18)}, "data.pkl"),
    "no policy": (lambda path: {"policy_pth": None}, "a member 'policy.pth' is missing"),
    "no data": (lambda path: {"data": None}, "a member 'data' is missing"),
    "data that is no JSON": (lambda path: {"data": b"{"}, "JSONDecodeError"),
    "data without end": (lambda path: {"data": b"[" * 100_000}, "RecursionError"),
    "data of another kind": (lambda path: {"data": b"[1, 2]"}, "TypeError"),
    "what is not written": (lambda path: {"setup.py": b""}, "writes no member 'setup.py'"),
    "too much text": (lambda path: {"data": b" " * 2**23}, "must unpack to at most"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", BROKEN)
def test_broken_models_are_refused_by_name(wrong: str, bare: Path) -> None:
    change, said = BROKEN[wrong]
    Model.read(bare)
    rewritten(bare, **change(bare))
    with pytest.raises(ValueError, match=rf"bare\.zip is no model .*{said}") as refusal:
        Model.read(bare)
    assert len(str(refusal.value)) < 600 and "\n" not in str(refusal.value)


def test_whatever_is_cut_off_or_changed_is_refused_or_read(bare: Path) -> None:
    """Ends at every length that is cut, and single bytes that are changed: ValueError or a model,
    nothing else and no warning."""
    whole, random = bare.read_bytes(), np.random.default_rng(0)
    for length in (*range(0, 60, 7), *random.integers(60, len(whole), 40)):
        bare.write_bytes(whole[:length])
        with pytest.raises(ValueError, match=r"bare\.zip is no model"):
            Model.read(bare)
    refused = 0
    for place in random.integers(0, len(whole), 200):
        changed = bytearray(whole)
        changed[place] ^= int(random.integers(1, 256))
        bare.write_bytes(changed)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                Model.read(bare)
            except ValueError as error:
                assert "bare.zip is no model" in str(error)
                refused += 1
    assert refused > 20


def test_memory_is_bounded_whatever_a_file_declares(
    bare: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archives, "LARGEST", 2**20)
    rewritten(bare, zipfile.ZIP_DEFLATED, policy_pth=bytes(2**24))
    assert bare.stat().st_size < 2**20
    with pytest.raises(ValueError, match="'policy.pth' must unpack to at most"):
        Model.read(bare)
    rewritten(bare, **{"other_pth": bytes(2**20)})
    with pytest.raises(ValueError, match="file must have at most 1048576 bytes, got more"):
        Model.read(bare)
    rewritten(bare, policy_pth=None, other_pth=None)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("policy.pth", bytes(2**24))
    lie = bytearray(content.getvalue())  # a kilobyte, it says in both places
    struct.pack_into("<L", lie, 22, 1000)
    struct.pack_into("<L", lie, lie.index(b"PK\x01\x02") + 24, 1000)
    tracemalloc.start()
    with pytest.raises(zipfile.BadZipFile, match="CRC"):
        archives.Archive(bytes(lie)).read("policy.pth")
    assert tracemalloc.get_traced_memory()[1] < 2**18
    tracemalloc.stop()
    with zipfile.ZipFile(bare, "a", zipfile.ZIP_LZMA) as archive:
        archive.writestr("policy.pth", bytes(2**24))
    with pytest.raises(ValueError, match="'policy.pth' must be stored or deflated"):
        Model.read(bare)


def test_a_declared_size_takes_no_memory(bare: Path, tmp_path: Path) -> None:
    """A terabyte in the directory of the zip, in a tensor, and in the header of an array."""
    good = bare.read_bytes()
    rewritten(bare, policy_pth=b"x" * 100)
    content = bytearray(bare.read_bytes())
    entry = content.index(b"PK\x01\x02", content.rindex(b"x" * 100))
    struct.pack_into("<LL", content, entry + 20, 2**32 - 2, 2**32 - 2)
    bare.write_bytes(content)
    with pytest.raises(ValueError, match="is no model"):
        Model.read(bare)
    bare.write_bytes(good)
    state = member(bare, "policy.pth")
    with zipfile.ZipFile(io.BytesIO(state)) as archive:
        said = archive.read("archive/data.pkl")
    small_one, large = b"K\x08K\x09\x86", b"J\xff\xff\xff\x7fJ\xff\xff\xff\x7f\x86"
    assert small_one in said  # the shape (8, 9) of the first layer
    memory = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(state)) as old, zipfile.ZipFile(memory, "w") as new:
        for name in old.namelist():
            value = old.read(name)
            changed = value.replace(small_one, large).replace(b"K\x09K\x01\x86",
                                                              large[:5] + b"K\x01\x86")
            new.writestr(name, changed if name.endswith("data.pkl") else value)
    rewritten(bare, policy_pth=memory.getvalue())
    with pytest.raises(ValueError, match="too big|buffer is smaller"):
        Model.read(bare)
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (137438953472,), }"
    array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(64)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        for name in ("mean", "var", "clip", "epsilon", "header"):
            archive.writestr(f"{name}.npy", array)
    for read in (Statistics.read, SavedPolicy.read):
        with pytest.raises(ValueError, match=r"a\.npz .*buffer is smaller"):
            read(tmp_path / "a.npz")


def test_a_zip_with_too_many_or_equal_members_is_refused(bare: Path) -> None:
    with warnings.catch_warnings(), zipfile.ZipFile(bare, "a") as archive:
        warnings.simplefilter("ignore")
        archive.writestr("data", "{}")
    with pytest.raises(ValueError, match="different names"):
        Model.read(bare)
    with zipfile.ZipFile(bare, "w") as archive:
        for number in range(archives.MEMBERS + 1):
            archive.writestr(f"{number}.pth", "")
    with pytest.raises(ValueError, match="at most 4096 members"):
        Model.read(bare)


class Bomb:
    """Writes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return Path.write_text, (self.path, "boom")


def test_nothing_in_a_zip_is_run(bare: Path, tmp_path: Path) -> None:
    """Bombs in ``data``, in tensors, in a file of torch's and in one that is none."""
    mark = tmp_path / "mark"
    bomb = pickle.dumps(Bomb(mark), protocol=2)
    pickle.loads(bomb)
    assert mark.read_text() == "boom"  # it works
    mark.unlink()
    data = json.loads(member(bare, "data"))
    for value in data.values():
        if isinstance(value, dict) and ":serialized:" in value:
            value[":serialized:"] = base64.b64encode(bomb).decode()
    data["policy_kwargs"][":serialized:"] = base64.b64encode(bomb).decode()
    rewritten(bare, data=json.dumps(data).encode(), pytorch_variables_pth=bomb,
              **{"policy.optimizer_pth": bomb, "other_pth": bomb})  # fmt: skip
    assert Model.read(bare).network.inputs == SEEN  # and what is plain is read
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w") as archive:
        archive.writestr("archive/data.pkl", pickle.dumps({"action_net.weight": Bomb(mark)}, 2))
    for content in (bomb, memory.getvalue()):
        rewritten(bare, policy_pth=content)
        with pytest.raises(ValueError, match="is no model"):
            Model.read(bare)
    assert not mark.exists()


def test_a_pickle_is_read_only_if_it_is_trusted(tmp_path: Path) -> None:
    path, mark = tmp_path / "statistics.pkl", tmp_path / "mark"
    path.write_bytes(pickle.dumps(Bomb(mark)))
    with pytest.raises(ValueError, match=r"statistics\.pkl must be trusted or an \.npz"):
        Statistics.read(path)
    (tmp_path / "statistics.npz").write_bytes(path.read_bytes())
    objects = np.array([Bomb(mark)], dtype=object)
    np.savez(tmp_path / "objects.npz", mean=objects, var=objects, clip=objects, epsilon=objects)
    for name in ("statistics.npz", "objects.npz"):
        for read in (Statistics.read, SavedPolicy.read):
            with pytest.raises(ValueError, match=name):
                read(tmp_path / name)
    assert not mark.exists()
    with pytest.raises(ValueError, match="no statistics of VecNormalize"):
        Statistics.read(path, trust=True)
    assert mark.exists()  # that is what trust means
    other = VecNormalize(DummyVecEnv([Empty]), norm_obs=False)
    other.save(str(path))
    with pytest.raises(ValueError, match="does not normalise observations"):
        Statistics.read(path, trust=True)


def test_neither_torch_nor_stable_baselines_is_needed(bare: Path) -> None:
    code = (
        "import sys\n"
        "sys.modules |= dict.fromkeys(('torch', 'stable_baselines3', 'sb3_contrib', 'onnx'))\n"
        "from tca_mj.agents.policies.sb3_zip import Model\n"
        f"print(Model.read({str(bare)!r}).network.outputs)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "3", done.stderr

"""Files that are not what they should be, and what reads them.

``READERS`` has a whole file of each kind and reads one: what it says has to be finite and within
the spaces of its task. ``damaged`` spoils a content: cuts it off, flips bits, puts another kind of
file in its place, and where a file has names and numbers puts in others, packed as they were.
"""

import io
import json
import math
import pickle
import random
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_samples import (
    TASK,
    bench_file,
    good,
    model_zip,
    muscle,
    recorded,
    shipped_policy,
    statistics,
    task_env,
)
from hypothesis import strategies as st

import tca_mj
from tca_mj.agents.evaluate import Evaluation
from tca_mj.agents.finished import EPISODES, kept
from tca_mj.agents.model import TaskModel, Transitions
from tca_mj.agents.policies import Preprocessing, SavedPolicy, Statistics, load_policy
from tca_mj.agents.sweep import RESULT, TRIALS, Sweep, run_sweep
from tca_mj.agents.train.config import TrainConfig
from tca_mj.agents.train.runs import RUN, STATE, RunFolder
from tca_mj.assets import mjcf
from tca_mj.model.scene import scene
from tca_mj.record import read
from tca_mj.tca import read_tca
from tca_mj.tca.identify import read_data

WALK = "TCA/TetrapodWalk-v0"
# What a number, a text or a list in a file may be instead.
TOKENS = (
    "NaN", "Infinity", "-Infinity", "1e999", "1e308", "-1e308", "1e-320", "-1", "0", "0.5", "1e30",
    "9" * 400, "9" * 5000, "2147483648", "9223372036854775808", "null", "true", "[]", "{}", '""',
    '"x"', '"1"', "[1, 2]", '{"x": 1}', "[" * 3000 + "]" * 3000, '"' + "x" * 100_000 + '"',
)  # fmt: skip
_TOKEN = re.compile(r'"[^"]*"|-?\d[\d.eE+-]*|\btrue\b|\bfalse\b|\bnull\b')
ARRAYS: tuple[Callable[[Any], Any], ...] = (
    lambda a: np.full_like(a, math.nan, dtype=float), lambda a: np.full_like(a, 1e30, dtype=float),
    lambda a: np.full_like(a, math.inf, dtype=float), lambda a: np.zeros(0), lambda a: a[..., None],
    lambda a: a.astype(complex), lambda a: a.astype(str), lambda a: a > 0, lambda a: -a,
    lambda a: a * 0, lambda a: np.float64(1.0), lambda a: np.append(a, a), lambda a: a.astype(int),
    lambda a: a.astype(np.float16), lambda a: np.asfortranarray(a), lambda a: a.astype(">f8"),
)  # fmt: skip


@dataclass(frozen=True)
class Reader:
    """How a kind of file is made, by what it is read, and how it is called."""

    whole: Callable[[], bytes]
    read: Callable[[Path], Any]
    suffix: str


def damages() -> st.SearchStrategy[tuple[str, float, int]]:
    """How a file is spoilt, where, and by what."""
    return st.tuples(st.sampled_from(sorted(DAMAGES)), st.floats(0.0, 1.0), st.integers(0, 10**6))


def spoilt(reader: str, damage: tuple[str, float, int]) -> Any:
    """What comes of a file of a kind that is damaged so."""
    how, share, number = damage
    path = Path(f"spoilt{READERS[reader].suffix}").absolute()
    content = DAMAGES[how](_whole(reader), share, random.Random(number))
    path.write_bytes(content)
    return READERS[reader].read(path)


@cache
def _whole(reader: str) -> bytes:
    return READERS[reader].whole()


def _flipped(content: bytes, share: float, draw: random.Random) -> bytes:
    bits = bytearray(content)
    for _ in range(draw.choice((1, 1, 1, 3, 30))):
        at = draw.randrange(len(bits))
        bits[at] ^= 1 << draw.randrange(8)
    return bytes(bits)


def _overwritten(content: bytes, share: float, draw: random.Random) -> bytes:
    start = int(share * len(content))
    length = draw.choice((1, 4, 8, 64, 512))
    byte = draw.choice((b"\0", b"\xff", b"\x7f", b" ", b"9", b"\n"))
    return content[:start] + byte * length + content[start + length * draw.choice((0, 1)) :]


def _another(content: bytes, share: float, draw: random.Random) -> bytes:
    others = (b"{}", b"[]", b"null", b"1", b'"x"', b"<mujoco/>", b"PK\x05\x06" + b"\0" * 18,
              b"\x89PNG\r\n", b"a,b\n1,2\n", b"\xff\xfe\0", b"NaN", pickle.dumps({}),
              *map(_whole, sorted(READERS)))  # fmt: skip
    return draw.choice(others)


def _retold(content: bytes, share: float, draw: random.Random) -> bytes:
    """Another number, text or list in place of one, within an archive if it is one."""
    if content[:2] == b"PK":
        return _repacked(content, draw)
    text = content.decode(errors="surrogateescape")
    found = list(_TOKEN.finditer(text))
    if not found:
        return content[::-1]
    one = draw.choice(found)
    token = draw.choice(TOKENS)
    if "<" in text[:200]:  # attributes of XML are in quotes
        bare = token.strip('"').replace("<", "")
        token = f'"{bare}"' if one.group().startswith('"') else bare
    return f"{text[: one.start()]}{token}{text[one.end() :]}".encode(errors="surrogateescape")


def _repacked(content: bytes, draw: random.Random) -> bytes:
    """An archive in which one member is spoilt, left out or there twice."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = draw.choice(sorted(members))
    if draw.random() < 0.1:
        del members[name]
    elif name.endswith(".npy"):
        array = np.load(io.BytesIO(members[name]))
        told = _retold(str(array).encode(), 0.0, draw).decode() if array.dtype.kind == "U" else None
        other = np.array(told) if told else draw.choice(ARRAYS)(array)
        file = io.BytesIO()
        np.save(file, other)
        members[name] = file.getvalue()
    else:
        members[name] = draw.choice((_retold, _flipped, _overwritten))(members[name], 0.5, draw)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for each, inner in members.items():
            archive.writestr(each, inner)
    return file.getvalue()


DAMAGES: dict[str, Callable[[bytes, float, random.Random], bytes]] = {
    "cut off": lambda content, share, draw: content[: int(share * len(content))],
    "empty": lambda content, share, draw: b"",
    "bits flipped": _flipped, "overwritten": _overwritten, "another file": _another,
    "other numbers": _retold, "twice": lambda content, share, draw: content * 2,
    "more behind": lambda content, share, draw: content + draw.randbytes(100),
    "noise": lambda content, share, draw: draw.randbytes(draw.choice((1, 100, 10_000))),
}  # fmt: skip
DAMAGES |= {f"other numbers {i}": _retold for i in range(6)}  # what comes deepest, more often


def _acts(path: Path, env: Any, preprocessing: Any = None) -> Any:
    """What a policy of a file does in its task."""
    policy = load_policy(path, env, preprocessing)
    observation, _ = env.reset(seed=0)
    policy.reset()
    action = policy.act(observation)
    assert env.action_space.contains(action), action
    return action, env.unwrapped.observation_space.shape


def _onnx() -> bytes:
    policy = SavedPolicy.read(shipped_policy("bend-reach"))
    return policy.to_onnx("whole.onnx").read_bytes()


def _config() -> Any:
    return good(TrainConfig)


def _run(path: Path, name: str) -> Any:
    """A folder of a run that holds the file under a name."""
    folder = Path("run")
    folder.mkdir(exist_ok=True)
    for file in (folder / RUN, folder / STATE):
        file.unlink(missing_ok=True)
    run = RunFolder(folder, _config(), "fuzzed")
    (folder / name).write_bytes(path.read_bytes())
    run = RunFolder(folder, _config(), "fuzzed")
    return run.load()


def _written(name: str) -> bytes:
    folder = Path("whole-run")
    RunFolder(folder, _config(), "fuzzed").save({"step": 3, "weights": np.arange(40.0)})
    return (folder / name).read_bytes()


def _sweep() -> Sweep:
    return Sweep(
        evaluation=Evaluation(task=TASK, policy="off", episodes=1, steps=1), axes={"seed": [1]}
    )


def _result() -> bytes:
    figures = {name: {"mean": 1.0, "low": 0.5, "high": 1.5} for name in ("return", "success")}
    return json.dumps({"point": {"seed": 1}, "figures": figures}).encode()


def _tabled(path: Path) -> Any:
    """A sweep whose only trial has found what the file says."""
    out = Path("sweep")
    folder = out / TRIALS / _sweep().trials()[0].name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RESULT).write_bytes(path.read_bytes())
    return run_sweep(_sweep(), out)


_EPISODE = {
    "key": "k", "seed": 3, "ending": "time", "return": 1.5, "success": 1.0, "duration": 3.0,
    "energy": 2.0, "peak_temperature": 90.0, "peak_tension": 0.4,
}  # fmt: skip


def _scene(path: Path) -> Any:
    sim = tca_mj.Simulation(scene(path, tca_mj.bending_module(), {}))
    sim.step(np.zeros(sim.n), 0.02)
    return sim.data.qpos.copy()


READERS: dict[str, Reader] = {
    "network.npz": Reader(
        lambda: shipped_policy("bend-reach").read_bytes(),
        lambda path: _acts(path, task_env(TASK, action="power")), ".npz",
    ),
    "gait.json": Reader(
        lambda: shipped_policy("tetrapod-walk").read_bytes(),
        lambda path: _acts(path, task_env(WALK, action="power")), ".json",
    ),
    "model.zip": Reader(
        model_zip,
        lambda path: _acts(path, task_env(TASK, action="power"), Preprocessing(scaled=True)),
        ".zip",
    ),
    "network.onnx": Reader(_onnx, lambda path: _acts(path, task_env(TASK, action="power")),
                           ".onnx"),
    "bench.csv": Reader(lambda: bench_file().read_bytes(),
                        lambda path: read_data(path, good(tca_mj.TcaSpec)), ".csv"),
    "tca.json": Reader(lambda: muscle().read_bytes(), read_tca, ".json"),
    "steps.npz": Reader(lambda: good(Transitions).save("whole.npz").read_bytes(),
                        Transitions.read, ".npz"),
    "task-model.npz": Reader(lambda: good(TaskModel).save("whole.npz").read_bytes(),
                             TaskModel.read, ".npz"),
    "statistics.npz": Reader(lambda: statistics().read_bytes(), Statistics.read, ".npz"),
    "recording.rrd": Reader(lambda: recorded().read_bytes(), read, ".rrd"),
    RUN: Reader(lambda: _written(RUN), lambda path: _run(path, RUN), ".json"),
    STATE: Reader(lambda: _written(STATE), lambda path: _run(path, STATE), ".pkl"),
    RESULT: Reader(_result, _tabled, ".json"),
    EPISODES: Reader(lambda: json.dumps(_EPISODE).encode() + b"\n", lambda path: kept(path, "k"),
                     ".jsonl"),
    "scene.xml": Reader(lambda: Path(mjcf("arena.xml")).read_bytes(), _scene, ".xml"),
}  # fmt: skip

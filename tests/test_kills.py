"""Killed outright at random moments: at most the last interval is lost, nothing stays behind, and
the same command ends as if it had never been.

``pytest -m long tests/test_kills.py`` kills every command twenty times and prints what came of it.
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import uuid
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tca_mj.agents.evaluate import Evaluation
from tca_mj.agents.finished import EPISODES, kept
from tca_mj.agents.output import read_json
from tca_mj.agents.policies import SavedPolicy
from tca_mj.agents.sweep import RESULT, TRIALS, Sweep
from tca_mj.agents.train.runs import STATE, RunFolder
from tca_mj.files import LOCK

pytestmark = pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")

REACH, MORPH, WALK = "TCA/BendReach-v0", "TCA/MorphModule-v0", "TCA/TetrapodWalk-v0"
PATIENCE = 900.0  # only against hanging [s]
EVALUATED = 40

TRAIN = f"""
import sys
from pathlib import Path
from tca_mj.agents.train.config import OnPolicy, TrainConfig
from tca_mj.agents.train.deep import train
learner = OnPolicy(n_steps=5, batch_size=10, n_epochs=1, hidden=(8,))
train(TrainConfig(learner=learner, task={MORPH!r}, algorithm="ppo", steps=100, envs=2, interval=10,
      evaluate_every=3, evaluation_episodes=1), Path("out"), video=False)
"""
SEARCH = f"""
import sys
from pathlib import Path
from tca_mj.agents.train.search import SearchConfig, search
if __name__ == "__main__":
    search(SearchConfig(task={WALK!r}, steps=700, population=5, settling=0.0, window=2.0,
           validation_episodes=1, validate_every=2), Path("out"), workers=2)
"""

DISTIL = f"""
import sys
from pathlib import Path
from tca_mj.agents.train import Teacher, distil_config
from tca_mj.agents.train.distil import distil
teachers = tuple(Teacher(policy=name) for name in ("tetrapod-walk-sac", "tetrapod-command"))
distil(distil_config({WALK!r}, teachers, steps=750, envs=1, gradient_steps=50, batch_size=32,
                     hidden=(8,)), Path("out"))
"""


def figures(folder: Path) -> Any:
    """What an evaluation has found."""
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))["figures"]


def episodes(folder: Path) -> int:
    """How many are kept, each of which is whole."""
    found = 0
    for file in folder.rglob(EPISODES):
        keys = {json.loads(line)["key"] for line in file.read_bytes().splitlines()[:-1]}
        found += sum(len(kept(file, key)) for key in keys)
    return found


def learned(folder: Path) -> int:
    """Steps of the last state, which is whole, and so are the policies."""
    for file in (*folder.glob("*.npz"), *folder.glob("best.json"), *folder.glob("last.json")):
        SavedPolicy.read(file)
    if not (folder / STATE).is_file():
        return 0
    run = RunFolder.__new__(RunFolder)
    run.path = folder
    state = run.load()
    return int(state["rows"][-1]["steps"] if isinstance(state, dict) else state[0].steps)


def told(folder: Path) -> int:
    """What a demo has written is one JSON or nothing."""
    if (folder / "summary.json").is_file():
        json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return 0


def trained(folder: Path) -> Any:
    """Curve and policies of a run, to the bit."""
    policies = [SavedPolicy.read(file) for file in sorted(folder.glob("[bl]*st.[nj]*"))]
    weights = [[each.tobytes() for each in policy.network.weights] if policy.network else policy
               for policy in policies]  # fmt: skip
    return (folder / "curve.csv").read_bytes(), weights


def played(folder: Path) -> Any:
    """Summary of a demo without its times, and which files there are."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    files = sorted(path.name for path in folder.iterdir())
    return {k: v for k, v in summary.items() if k not in ("wall", "real_time_factor")}, files


@dataclass(frozen=True)
class Command:
    """What is killed.

    Attributes:
        words: How it is called, into the folder ``out``.
        so_far: How far a folder is, with checks that it is whole.
        result: What is compared in the end.
        lingers: How long processes may live on [s]: Ray's own notice after a minute.
    """

    words: tuple[str, ...]
    so_far: Callable[[Path], int]
    result: Callable[[Path], Any]
    lingers: float = 20.0


CLI = ("-m", "tca_mj.cli")
OUT = ("--task", REACH, "--out", "out")
COMMANDS = {
    "eval": Command((*CLI, "eval", "random", *OUT, "--episodes", str(EVALUATED), "--steps", "60",
                     "--workers", "2"), episodes, figures),
    "train": Command(("-c", TRAIN), learned, trained),
    "train cma": Command(("search.py",), learned, trained),
    "distil": Command(("-c", DISTIL), learned, trained),
    "demo": Command((*CLI, "demo", "--policy", "random", *OUT, "--no-video"), told, played),
    "sweep": Command((*CLI, "sweep", "random", *OUT, "--episodes", "4", "--set", "seed=0,10",
                      "--set", "steps=150"), episodes,
                     lambda folder: (folder / "results.csv").read_bytes(), 90.0),
}  # fmt: skip


class Killer:
    """Runs a command in a folder of its own and kills it."""

    def __init__(self, command: Command, folder: Path) -> None:
        self.command, self.folder, self.out = command, folder, folder / "out"
        self.mark = uuid.uuid4().hex
        self.temporary = folder / "temporary"
        self.temporary.mkdir(parents=True)
        (folder / "search.py").write_text(SEARCH)
        self.environment = os.environ | {"TMPDIR": str(self.temporary), "TCA_MARK": self.mark}

    def start(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, *self.command.words], cwd=self.folder, env=self.environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def finish(self) -> tuple[float, float]:
        """Runs it to the end and returns how long that took, and how long it was at work [s]."""
        start, run = time.monotonic(), self.start()
        self.begun(run)
        begun = time.monotonic()
        assert run.wait(timeout=PATIENCE) in (0, 1)  # a demo that is no success
        return time.monotonic() - start, time.monotonic() - begun

    def begun(self, run: subprocess.Popen[bytes]) -> None:
        """Waits until a run has the folder or is over."""
        while run.poll() is None and not self.holds(run.pid):
            time.sleep(0.01)

    def holds(self, process: int) -> bool:
        """Whether a process, which may just have ended, has or had the folder last."""
        lock = self.out / LOCK
        return lock.exists() and f"process {process} " in lock.read_text()

    def alive(self) -> list[int]:
        """Processes that descend from the command, however far: they have its mark."""
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                marked = f"TCA_MARK={self.mark}".encode() in (folder / "environ").read_bytes()
                if marked and "\nState:\tZ" not in (folder / "status").read_text():
                    found.append(int(folder.name))
            except OSError:
                continue
        return found

    def gone(self, within: float) -> float:
        """How long it takes until none is left [s]."""
        start = time.monotonic()
        while self.alive():
            assert time.monotonic() - start < within
            time.sleep(0.05)
        return time.monotonic() - start

    def end(self) -> None:
        """Ends what a killed command has left running, without waiting for its own notice."""
        for process in self.alive():
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)

    def left(self) -> list[str]:
        """Hidden and temporary files."""
        inside = [path for path in self.out.rglob(".*") if path.name != ".validate_storage_marker"]
        outside = [path for path in self.temporary.iterdir() if "torchinductor" not in path.name]
        return [path.name for path in (*inside, *outside)]


def kill(name: str, times: int, folder: Path, seed: int) -> Counter[str]:
    """Kills a command, begins it again until it was killed often enough, and lets it end.

    Every other moment, by chance, is drawn from the time that it is at work, the others from all.

    Returns:
        Numbers of kills, of those that came while it had the folder and of those that found
        something finished there, of times that it had come to its end in between, and the longest
        time that a process has lived on [ms].
    """
    command, drawn = COMMANDS[name], random.Random(seed)
    whole = Killer(command, folder / "whole")
    duration, working = whole.finish()
    expected = command.result(whole.out)
    killer, found = Killer(command, folder / "killed"), Counter[str]()
    while found["kills"] < times:
        run, within = killer.start(), duration
        if drawn.random() < 0.5:  # most of what a short command does is to start
            killer.begun(run)
            within = working
        try:
            run.wait(timeout=drawn.uniform(0.0, within))
        except subprocess.TimeoutExpired:
            reached = command.so_far(killer.out) if killer.out.exists() else 0  # while it runs
            os.kill(run.pid, signal.SIGKILL)
            found["kills"] += 1
            found["at work"] += killer.holds(run.pid)
            run.wait()
            if command.lingers < 60.0:
                lived = int(1e3 * killer.gone(command.lingers))
                found["lived on [ms]"] = max(found["lived on [ms]"], lived)
            now = command.so_far(killer.out) if killer.out.exists() else 0
            assert now >= reached
            found["with something to keep"] += reached > 0
            continue
        found["ended before"] += 1
        assert command.result(killer.out) == expected and killer.left() == []
        shutil.rmtree(killer.out)
    killer.finish()
    assert command.result(killer.out) == expected
    assert killer.left() == []
    lived = int(1e3 * killer.gone(command.lingers))
    found["lived on [ms]"] = max(found["lived on [ms]"], lived)
    return found


@pytest.mark.parametrize("name", ["eval", "train", "demo"])
def test_a_few_kills(name, tmp_path):
    times = 2 if name == "demo" else 1
    assert kill(name, times, tmp_path, seed=len(name))["kills"] == times


def test_a_sweep_that_is_killed_goes_on(tmp_path):
    """With its first episode finished; the table is that of trials which Ray had no part in."""
    pytest.importorskip("ray")
    killer = Killer(COMMANDS["sweep"], tmp_path)
    run, deadline = killer.start(), time.monotonic() + PATIENCE
    try:
        while not (killer.out.exists() and episodes(killer.out)):
            assert run.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        os.kill(run.pid, signal.SIGKILL)
        run.wait()
        before = [line for path in killer.out.rglob(EPISODES)
                  for line in path.read_bytes().splitlines(keepends=True)]  # fmt: skip
    finally:
        killer.end()
    killer.finish()
    assert killer.left() == [] and killer.alive() == []
    sweep = Sweep(evaluation=Evaluation(task=REACH, policy="random", episodes=4),
                  axes={"seed": (0, 10), "steps": (150,)})  # fmt: skip
    after = {path.parent: path.read_bytes() for path in killer.out.rglob(EPISODES)}
    whole = [line for line in before if line.endswith(b"\n")]
    assert whole and all(any(line in text for text in after.values()) for line in whole)
    assert [text.count(b"\n") for text in after.values()] == [4, 4]
    for trial in sweep.trials():
        alone = trial.run(tmp_path / "alone" / trial.name)
        assert read_json(killer.out / TRIALS / trial.name / RESULT)["figures"] == alone["figures"]


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_many_kills(name, tmp_path, capsys):
    if name == "sweep":
        pytest.importorskip("ray")
    found = kill(name, 20, tmp_path, seed=6)
    lived = found["lived on [ms]"]
    told = f"{lived} ms" if lived < 100 else f"{1e-3 * lived:.2g} s"
    with capsys.disabled():  # a row of the table in docs/reliability.md
        print(f"\n| `{name}` | {found['at work']} | {found['with something to keep']} | {told} |")

"""MuJoCo's warnings are counted and written nowhere, and a handler of one's own stays."""

import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from tca_mj import cli
from tca_mj.cli import play
from tca_mj.model import mujoco_warnings
from tca_mj.model.mujoco_warnings import warning_counts, warning_line
from tca_mj.registry import make

QUICK = "TCA/BendReach-v0"

# A state that MuJoCo complains of, in everything that steps, also on threads and in processes.
DIVERGING = """
import multiprocessing, pickle
import gymnasium as gym, mujoco, numpy as np
import tca_mj
from tca_mj.model.mujoco_warnings import warning_counts

def go(task):
    task.data.qvel[:] = np.nan
    task.sim.step(np.zeros(task.sim.n), task.sim.tca_period * 4)

def diverges(task):
    task = pickle.loads(task)
    try:
        go(task)
    except tca_mj.SimulationDiverged:
        return warning_counts().total()

if __name__ == "__main__":
    task = gym.make("TCA/BendReach-v0").unwrapped
    task.reset(seed=0)
    there = pickle.dumps(task)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        print(pool.apply(diverges, (there,)) > 0)
    try:
        go(task)
    except tca_mj.SimulationDiverged:
        print(warning_counts().total() > 0)
    before = warning_counts().total()
    envs = gym.make_vec("TCA/BendReach-v0", num_envs=4, num_threads=2)
    envs.reset(seed=0)
    for env in envs.envs:
        env.data.qvel[:] = np.nan
    *_, truncated, _ = envs.step(np.zeros((4, 3), dtype=np.float32))
    print(truncated.all(), warning_counts().total() > before)
"""


def run(folder: Path, script: str) -> str:
    """What a script prints that runs in a folder."""
    path = folder.parent / f"{folder.name}.py"
    path.write_text(script)
    done = subprocess.run(
        [sys.executable, str(path)], cwd=folder, capture_output=True, text=True, timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def counting() -> Iterator[None]:
    """Whoever else listens by now, as dm_control does once it is imported."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(mujoco_warnings._count)
    yield
    mujoco.set_mju_user_warning(before)


@pytest.fixture
def empty(tmp_path: Path) -> Path:
    folder = tmp_path / "empty"
    folder.mkdir()
    return folder


def test_what_diverges_leaves_no_file(empty: Path) -> None:
    assert run(empty, DIVERGING).split() == ["True"] * 4
    assert list(empty.iterdir()) == []


def test_an_ordinary_crawl_leaves_no_file(empty: Path) -> None:
    told = "eval scripted --task TCA/TetrapodCrawl-v0 --episodes 1 --seed 3 --out ../results"
    done = subprocess.run(
        [sys.executable, "-m", "tca_mj.cli", *told.split()], cwd=empty, capture_output=True,
        text=True, timeout=300, check=False,
    )
    assert done.returncode == 0, done.stderr
    assert list(empty.iterdir()) == []


def test_nothing_listens_before_something_is_simulated(empty: Path) -> None:
    said = run(empty, """
import mujoco, tca_mj.sim, tca_mj.envs.arm, tca_mj.batch, tca_mj.cli
print(mujoco.get_mju_user_warning())
tca_mj.Simulation(tca_mj.bending_module())
print(mujoco.get_mju_user_warning() is not None)
""")  # fmt: skip
    assert said.split() == ["None", "True"]


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_handler_of_ones_own_stays(empty: Path, when: str) -> None:
    mine = "mujoco.set_mju_user_warning(mine.append)"
    begin = "sim = tca_mj.Simulation(tca_mj.bending_module())"
    said = run(empty, f"""
import mujoco, numpy as np, tca_mj
from tca_mj.model.mujoco_warnings import warning_counts
mine = []
{mine if when == "before" else begin}
{begin if when == "before" else mine}
again = tca_mj.Simulation(tca_mj.bending_module())
for each in (sim, again):
    each.data.qvel[:] = np.nan
    try:
        each.step(np.zeros(3), 0.1)
    except tca_mj.SimulationDiverged:
        pass
print(len(mine) > 0, warning_counts().total())
""")  # fmt: skip
    assert said.split() == ["True", "0"]
    assert list(empty.iterdir()) == []


def test_who_wants_mujocos_file_gets_it(empty: Path) -> None:
    run(empty, """
import mujoco, numpy as np, tca_mj
sim = tca_mj.Simulation(tca_mj.bending_module())
mujoco.set_mju_user_warning(None)
sim.reset()
tca_mj.Simulation(tca_mj.bending_module())
sim.data.qvel[:] = np.nan
try:
    sim.step(np.zeros(3), 0.1)
except tca_mj.SimulationDiverged:
    pass
""")  # fmt: skip
    assert [path.name for path in empty.iterdir()] == ["MUJOCO_LOG.TXT"]


@pytest.mark.usefixtures("counting")
def test_warnings_are_counted_by_kind_whatever_their_numbers() -> None:
    before = warning_counts()
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option><flag autoreset="disable"/></option><worldbody><body><freejoint/>'
        '<geom size="1"/></body></worldbody></mujoco>'
    )
    for dof in (0, 3, 4):
        data = mujoco.MjData(model)
        data.time, data.qvel[dof] = 1.5 * dof, np.nan
        mujoco.mj_step(model, data)
    kinds = [kind for kind in warning_counts() - before if "QVEL" in kind]
    assert len(kinds) == 1 and "at DOF #." in kinds[0] and "Time = #." in kinds[0]
    assert (warning_counts() - before)[kinds[0]] == 3
    warning_counts().clear()  # a copy
    assert warning_counts().total() >= 3


def test_a_line_of_warnings() -> None:
    assert warning_line(Counter()) == ""
    assert warning_line(Counter({"a": 1, "b": 12})) == "MuJoCo warned 13 times: 12 x b, 1 x a"


@pytest.mark.usefixtures("counting")
def test_a_command_says_at_its_end_what_was_warned_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*args: Any, **kwargs: Any) -> Any:
        env = make(*args, **kwargs)
        env.reset(seed=0)
        env.unwrapped.data.qvel[:] = np.nan
        env.step(np.zeros(3, dtype=np.float32))
        return env

    assert cli.main(["list", QUICK]) == 0
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(play, "make", broken)
    assert cli.main(["list", QUICK]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("MuJoCo warned ") and " x Nan, Inf or huge value in QVEL" in line

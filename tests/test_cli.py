"""The command line: what it prints, what it returns, what it does without a screen."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from tca_mj import cli, registry
from tca_mj.agents import demo
from tca_mj.agents.policies import Preprocessing
from tca_mj.agents.policies.actors import actor, arguments_of
from tca_mj.bench import single, vector
from tca_mj.envs.arm import ArmPickPlace
from tca_mj.envs.viewer import NoDisplay, ViewerEnvironment, ViewerPolicy, need_display

TASK = "TCA/ArmPickPlace-v0"
SUMMARY: dict[str, Any] = {
    "task": TASK,
    "policy": "scripted",
    "heater_energy": {},
    "success": True,
    "ending": "success",
    "duration": 31.5,
    "energy": {"a": 40.0, "b": 2.4},
    "peak_temperature": {"a": 140.2, "b": 25.0},
    "real_time_factor": 6.04,
    "files": ["rollout.rrd"],
}


@pytest.fixture
def answer(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A demo that does nothing; its summary, and under ``asked`` how it was called."""
    summary = dict(SUMMARY)

    def called(task: str, policy: str, **arguments: Any) -> dict[str, Any]:
        summary["asked"] = {"task": task, "policy": policy, **arguments}
        return summary

    monkeypatch.setattr(demo, "play", called)
    return summary


def test_the_demo_says_how_it_ended(
    answer: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--option", "object=pcb", "--option", "object_position=0.001,-0.002"]
    out = Path("runs/demo/pick-and-place")
    assert cli.main(["demo", "pick-and-place", *options, "--seed", "4", "--no-video"]) == 0
    assert answer["asked"] == {
        "task": TASK, "policy": "scripted", "seed": 4, "out": out, "video": False,
        "options": {"object": "pcb", "object_position": [0.001, -0.002]},
        "arguments": {}, "preprocessing": Preprocessing(),
    }  # fmt: skip
    said = capsys.readouterr().out
    assert f"scripted in {TASK}: success after 31.5 s, 42 J, at most 140 °C" in said
    assert str(out / "summary.json") in said and str(out / "rollout.rrd") in said


def test_a_demo_that_fails_returns_1(
    answer: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    answer |= {"success": False, "ending": "time limit"}
    assert cli.main(["demo", "pick-and-place"]) == 1
    assert "time limit after 31.5 s" in capsys.readouterr().out


def test_ctrl_c_returns_130(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(demo, "play", interrupted)
    assert cli.main(["demo", "pick-and-place", "--out", str(tmp_path)]) == 130
    assert f"what was recorded is in {tmp_path}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["demo", "pick-and-place", "--seed", "-1"], "at least 0"),
        (["demo", "pick-and-place", "--seed", "1.5"], "must be a whole number, got '1.5'"),
        (["demo", "pick-and-place", "--out", f"{__file__}/new/folder"], "must be a folder"),
        (["demo", "pick-and-place", "--option", "hammer"], "must be NAME=VALUE"),
        (["demo", "--task", "nowhere:Mine-v0", "--policy", "off"], "nowhere"),
        (["demo", "pick-and-place", "--out", __file__], "must be a folder"),
        (["demo", "juggle"], "juggle"),
        (["view", "TCA/Nothing-v0"], TASK),
        ([], "COMMAND"),
    ],
)
def test_a_wrong_command_returns_2_and_says_why(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    assert ended.value.code == 2
    assert named in capsys.readouterr().err


@pytest.mark.parametrize("command", [[], ["demo"], ["export"], ["view"], ["list"], ["bench"]])
def test_help_has_examples(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main([*command, "--help"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "examples:" in said or command[0] == "list"
    assert max(map(len, said.splitlines())) <= 100


def test_an_option_that_the_task_refuses_returns_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = ["--option", "object=hammer", "--out", str(tmp_path)]
    assert cli.main(["demo", "pick-and-place", *wrong]) == 2
    assert "object must be one of ('pcb', 'screwdriver'), got 'hammer'" in capsys.readouterr().err


def test_list_names_every_task_with_its_spaces(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["list"]) == 0
    said = capsys.readouterr().out
    for task in registry.TASKS:
        env = gym.make(task.id)
        assert task.id in said
        assert f"action {env.action_space.shape}" in said
        assert f"observation {env.observation_space.shape}" in said
    assert "Pick up an object under the arm and lay it into a cup." in said


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="others always have a screen")
def test_view_without_a_screen_says_what_to_do(tmp_path: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    for display in ({}, {"DISPLAY": ":98765"}):
        done = subprocess.run(
            [sys.executable, "-m", "tca_mj.cli", "view", TASK], cwd=tmp_path, timeout=60,
            env=environment | display, capture_output=True, text=True, check=False,
        )
        assert done.returncode == 2
        assert "there is no screen" in done.stderr and "xvfb-run" in done.stderr
        assert "Traceback" not in done.stderr and "Warning" not in done.stderr
        assert done.stdout == ""


@pytest.mark.parametrize("policy", cli.POLICIES)
def test_the_viewer_steps_the_task_itself(
    policy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The adapter without a window: one state, seen by MuJoCo and through dm_control."""
    pytest.importorskip("dm_control")
    monkeypatch.setenv("MUJOCO_GL", "disable")
    env = gym.make(TASK, **arguments_of(policy, TASK))
    shown = ViewerEnvironment(env, seed=2, options={"object": "pcb"})
    found = actor(policy, env, seed=2)
    act = ViewerPolicy(found.act, found.reset)
    step = shown.reset()
    assert step.first()
    task = env.unwrapped
    assert isinstance(task, ArmPickPlace)
    assert shown.physics.data.ptr is task.data
    for _ in range(3):
        action = act(step)
        shown.action_spec().validate(action)
        step = shown.step(action)
        shown.observation_spec().validate(step.observation)
    assert shown.physics.time() == pytest.approx(0.3)
    if policy == "off":
        assert task.sim.energy.max() == 0.0 and action[5] == 0.0
    lift = shown.physics.named.data.qpos["arm.lift"]
    assert float(np.ravel(lift)[0]) == task.data.joint("arm.lift").qpos[0]
    act.reset()
    assert shown.reset().first() and shown.physics.time() == 0.0


def test_a_window_or_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(NoDisplay, match="DISPLAY"):
        need_display()


def test_the_benchmark_writes_what_it_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of its figures, only that they exist: how fast a machine is is no test."""
    plain = single.benchmark
    monkeypatch.setattr(single, "benchmark", lambda **kw: plain(**(kw | {"scale": 0.01})))
    assert cli.main(["bench", "single", "--quick", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert said.startswith((tmp_path / "benchmark.md").read_text(encoding="utf-8"))
    result = json.loads((tmp_path / "benchmark.json").read_text(encoding="utf-8"))
    assert result["physics"]["no power"] > 0.0
    assert result["episode"]["all"]["ratio"] > 0.5
    assert result["episode"]["phases"]["align"]["outside"] > 0.0
    assert result["recording"]["share"] > 0.0
    assert result["bank"]["advance"] > 0.0
    assert min(result["tca"]["surface"], result["tca"]["rod"]) > 0.0
    with pytest.raises(ValueError, match="scale"):
        plain(scale=0.0)


def test_the_benchmark_of_many_tasks_writes_what_it_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, id = vector.benchmark, "TCA/MorphModule-v0"
    few = {"scale": 0.01, "ids": [id], "num_envs": 2}
    monkeypatch.setattr(vector, "benchmark", lambda **kw: plain(**(kw | few)))
    assert cli.main(["bench", "vector", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert said.startswith((tmp_path / "vector.md").read_text(encoding="utf-8"))
    result = json.loads((tmp_path / "vector.json").read_text(encoding="utf-8"))
    row = result["tasks"][id]
    assert row["physics_steps"] == 20
    for way in (row["single"], *row["vector"].values()):
        assert 0.0 < way["inside"] < way["cpu"]
    assert row["single"]["bare"] > 0.0
    assert set(row["vector"]) == {"1", "2"}
    assert result["training"] or "training" in result["left_out"]
    with pytest.raises(ValueError, match="scale"):
        plain(scale=0.0)

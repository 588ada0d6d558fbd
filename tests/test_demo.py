"""The demo writes what happened, however it ends and whatever the machine lacks."""

import json
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from tca_mj.agents import episode
from tca_mj.agents.demo import play
from tca_mj.envs.arm import ArmPickPlace
from tca_mj.record.render import RenderingUnavailable, gl_backend
from tca_mj.registry import DEMOS

OFF = np.array([-1.0, -1.0, -1.0, -1.0, -1.0, 0.0], dtype=np.float32)
TCAS = ["arm.bending.tca0", "arm.bending.tca1", "arm.bending.tca2", "arm.wrist.tca",
        "arm.gripper.tca"]  # fmt: skip


def pick_and_place(object: str = "screwdriver", policy: Any = "scripted", **more: Any) -> Any:
    arguments = None if policy == "scripted" else {"action": "power"}
    return play(
        "TCA/ArmPickPlace-v0", policy, options={"object": object}, arguments=arguments, **more
    )


class Stub:
    """Heats the first TCA, calls its second phase at 0.2 s, and may end everything at a step."""

    tries = 2

    def __init__(self, fault: BaseException | None = None, at: int = 4) -> None:
        self.fault, self.at, self.calls = fault, at, 0

    @property
    def phase(self) -> str:
        return "first" if self.calls < 3 else "second"

    def reset(self) -> None:
        self.calls = 0

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        self.calls += 1
        if self.calls > self.at and self.fault is not None:
            raise self.fault
        return np.array([0.0, *OFF[1:]], dtype=np.float32)


def summary_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def recorded(folder: Path) -> tuple[list[str], int]:
    """Events and number of frames of a recording."""
    events, frames = [], 0
    for chunk in RrdReader(folder / "rollout.rrd").stream().to_chunks():
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/events":
            events += np.ravel(batch.column("TextLog:text").to_pylist()).tolist()
        if chunk.entity_path == "/actuators/arm.wrist.tca/power" and not chunk.is_static:
            frames += batch.num_rows
    return events, frames


def verified(folder: Path) -> bool:
    program = [str(Path(sys.executable).parent / "rerun"), "rrd", "verify"]
    path = str(folder / "rollout.rrd")
    return subprocess.run([*program, path], capture_output=True, check=False).returncode == 0


def test_the_scripted_agent_for_a_moment(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    pytest.importorskip("matplotlib")
    try:
        gl_backend()
        drawn = ["rollout.mp4"]
    except RenderingUnavailable:
        drawn = []
    out = tmp_path / "new" / "folder"
    result = pick_and_place(object="pcb", seed=3, out=out, max_duration=0.4)
    assert result == summary_of(out)
    assert result["files"] == ["rollout.rrd", *drawn, "rollout.html", "rollout.png"]
    assert sorted(result["left_out"]) == sorted({"rollout.mp4"} - set(drawn))
    assert (result["success"], result["ending"]) == (False, "stopped after 0.4 s")
    assert (result["object"], result["seed"], result["duration"]) == ("pcb", 3, 0.4)
    assert result["phases"] == [{"name": "align", "start": 0.0, "duration": 0.4}]
    for quantity in ("energy", "peak_temperature", "peak_tension"):
        assert list(result[quantity]) == TCAS
    assert result["energy"]["arm.wrist.tca"] > 1.0  # the board lies askew: the wrist turns first
    # Wrist and gripper turn and open at once; what bends is warmed by 20 K/s, and aligns.
    peaks = result["peak_temperature"]
    assert min(peaks["arm.wrist.tca"], peaks["arm.gripper.tca"]) > 50.0
    assert max(peaks[f"arm.bending.tca{i}"] for i in range(3)) < 45.0
    assert result["real_time_factor"] > 0.1
    assert set(result["wall"]) >= {"simulation", "recording", "plot"}
    assert {"python", "tca-mj", "mujoco", "gymnasium", "numpy", "rerun-sdk"} == set(
        result["versions"]
    )
    assert result["machine"]["cores"] >= 1
    assert recorded(out) == (["episode 1, seed 3", "align"], 5)
    assert verified(out)
    # The printed object is where a fresh environment puts it.
    task = ArmPickPlace(action="power")
    _, _ = task.reset(seed=3, options={"object": "pcb"})
    start = task.data.body("pcb.pcb").xpos
    np.testing.assert_allclose(result["object_position"], start, atol=1e-3)


def test_energy_is_power_times_time(tmp_path: Path) -> None:
    result = pick_and_place(policy=Stub(), max_duration=0.5)
    power = 0.5 * ArmPickPlace.max_power[0]
    assert result["energy"]["arm.bending.tca0"] == pytest.approx(0.5 * power, abs=1e-4)
    assert sum(result["energy"].values()) == pytest.approx(0.5 * power, abs=1e-4)
    assert [(p["name"], p["start"], p["duration"]) for p in result["phases"]] == [
        ("first", 0.0, 0.2), ("second", 0.2, 0.3)
    ]
    assert (result["tries"], result["files"]) == (2, [])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("fault", "ending"),
    [
        (KeyboardInterrupt(), "interrupted"),
        (ZeroDivisionError("by nothing"), "error: ZeroDivisionError: by nothing"),
    ],
)
def test_an_interruption_keeps_what_was_recorded(
    tmp_path: Path, fault: BaseException, ending: str
) -> None:
    with pytest.raises(type(fault)):
        pick_and_place(policy=Stub(fault), out=tmp_path, video=False)
    result = summary_of(tmp_path)
    assert (result["ending"], result["success"], result["duration"]) == (ending, False, 0.4)
    assert recorded(tmp_path) == (["episode 1, seed 0", "first", "second"], 5)
    assert verified(tmp_path)
    assert not (tmp_path / "rollout.mp4").exists()


def test_a_second_ctrl_c_while_the_files_are_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def impatient(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(episode, "rollout_plot", impatient)
    with pytest.raises(KeyboardInterrupt):
        pick_and_place(policy=Stub(KeyboardInterrupt()), out=tmp_path, video=False)
    assert summary_of(tmp_path)["ending"] == "interrupted"
    assert verified(tmp_path)


def test_success_ends_the_demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = ArmPickPlace.step

    def lucky(task: ArmPickPlace, action: NDArray[np.float32]) -> Any:
        observation, reward, _, _, info = plain(task, action)
        done = task.sim.time > 0.25
        return observation, reward, done, False, info | {"success": done}

    monkeypatch.setattr(ArmPickPlace, "step", lucky)
    monkeypatch.setattr(episode, "rollout_plot", lambda *_, **__: None)
    result = pick_and_place(policy=Stub(), out=tmp_path, video=False)
    assert (result["success"], result["ending"], result["duration"]) == (True, "success", 0.3)
    assert recorded(tmp_path)[0][-1] == "success"


def test_without_opengl_only_the_film_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("imageio_ffmpeg")
    pytest.importorskip("matplotlib")
    monkeypatch.setenv("MUJOCO_GL", "disable")
    result = pick_and_place(policy=Stub(), out=tmp_path, max_duration=0.2)
    assert result["files"] == ["rollout.rrd", "rollout.html", "rollout.png"]
    assert "MUJOCO_GL=disable" in result["left_out"]["rollout.mp4"]
    assert "rollout.mp4 is left out: rendering is switched off" in capsys.readouterr().out


def test_without_the_demo_extra_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in ("imageio_ffmpeg", "matplotlib.figure"):
        monkeypatch.setitem(sys.modules, module, None)
    result = pick_and_place(policy=Stub(), out=tmp_path, max_duration=0.2)
    assert result["files"] == ["rollout.rrd", "rollout.html"]
    assert sorted(result["left_out"]) == ["rollout.mp4", "rollout.png"]
    assert capsys.readouterr().out.count("pip install 'matplotlib>=3.9' 'imageio>=2.34'") == 2


def test_importing_the_demo_loads_no_optional_package(tmp_path: Path) -> None:
    code = (
        "import sys, tca_mj.agents.demo; print([m for m in ('matplotlib', 'imageio', 'torch',"
        " 'imageio_ffmpeg', 'dm_control.viewer') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


def test_files_of_an_earlier_demo_do_not_stay(tmp_path: Path) -> None:
    for name in ("rollout.mp4", "rollout.png", "summary.json", "notes.txt"):
        (tmp_path / name).write_text("old")
    with pytest.raises(KeyboardInterrupt):
        pick_and_place(policy=Stub(KeyboardInterrupt(), at=0), out=tmp_path, video=False)
    assert not (tmp_path / "rollout.mp4").exists()
    assert (tmp_path / "notes.txt").read_text() == "old"
    assert summary_of(tmp_path)["duration"] == 0.0


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"object": "hammer"}, "hammer"),
        ({"max_duration": 0.0}, "max_duration"),
        ({"speed": float("nan")}, "speed"),
    ],
)
def test_wrong_arguments_are_refused_before_a_file_is_touched(
    tmp_path: Path, wrong: dict[str, Any], named: str
) -> None:
    (tmp_path / "rollout.rrd").write_text("precious")
    with pytest.raises(ValueError, match=named):
        pick_and_place(**({"out": tmp_path} | wrong))
    assert [p.name for p in tmp_path.iterdir()] == ["rollout.rrd"]
    assert (tmp_path / "rollout.rrd").read_text() == "precious"


def test_the_table_of_successes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The script goes on from its file, skips a line that was cut off, and counts."""
    script = runpy.run_path(str(Path(__file__).parent.parent / "scripts" / "success_table.py"))
    results = []
    for seed, kind in enumerate(("screwdriver", "pcb")):
        result = pick_and_place(object=kind, seed=0, policy=Stub(), max_duration=0.1)
        results.append(result | {"success": seed == 0})
    lines = [json.dumps(result) for result in results]
    (tmp_path / "results.jsonl").write_text("\n".join([*lines, lines[0][:50]]), encoding="utf-8")
    assert script["main"](["--seeds", "1", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "| screwdriver | 1 | 1 (100 %) |" in said
    assert "| pcb | 1 | 0 (0 %) |" in said
    assert "| all | 2 | 1 (50 %) |" in said
    assert (tmp_path / "table.md").read_text(encoding="utf-8") == said
    foreign = json.dumps(results[0] | {"versions": {"mujoco": "0.1"}})
    (tmp_path / "results.jsonl").write_text(foreign, encoding="utf-8")
    assert script["kept"](tmp_path / "results.jsonl") == {}


@pytest.mark.parametrize("name", DEMOS)
def test_every_demo_begins(name):
    """Its policy is there, and acts in its task as that is made for it."""
    demo = DEMOS[name]
    summary = play(
        demo.task, demo.policy, arguments=dict(demo.arguments), max_duration=0.4, progress=False
    )
    assert summary["duration"] >= 0.4 or summary["success"]  # a jump is over sooner
    assert summary["phases"] and "diverged" not in summary["ending"]

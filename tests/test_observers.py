"""What watches an episode never ends it: recordings, films, plots and summaries that fail."""

import copy
import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from numpy.typing import NDArray

from tca_mj.agents import demo, episode
from tca_mj.agents.demo import play
from tca_mj.cli import outcome
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.files import Claim, write_whole
from tca_mj.modules.bending import bending_module
from tca_mj.record import Recorder, plots
from tca_mj.record.film import Film
from tca_mj.record.reader import read
from tca_mj.record.render import RenderingUnavailable, gl_backend
from tca_mj.registry import TASKS, make
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE
from tca_mj.tca.sensing.wire import WireTable, resistance

QUICK = "TCA/BendReach-v0"
Action = NDArray[np.float32]


def torn_apart(task: Any, how: str) -> None:
    """Velocities of 300, which end in NaN; NaN at once; or finite lengths that no TCA has."""
    if how == "fast":
        task.data.qvel[:] = 300.0
    elif how == "NaN":
        task.data.qvel[:] = np.nan
    else:
        task.data.qpos[task.model.jnt_qposadr[task.model.jnt_type == 2]] += 0.5


def still(env: Any) -> Action:
    return np.zeros(env.action_space.shape, dtype=np.float32)


def pickled(env: Any) -> Any:
    return pickle.loads(pickle.dumps(env))


class Doing:
    """A policy that does something to its task at its third action."""

    phase = "acting"

    def __init__(self, does: Any = lambda: None) -> None:
        self.does, self.calls = does, 0

    def reset(self) -> None:
        self.calls = 0

    def act(self, observation: NDArray[np.float32]) -> Action:
        self.calls += 1
        if self.calls == 3:
            self.does()
        return np.zeros(3, dtype=np.float32)


@pytest.fixture(scope="module")
def opengl() -> None:
    pytest.importorskip("imageio_ffmpeg")
    try:
        gl_backend()
    except RenderingUnavailable as error:
        pytest.skip(str(error))


def verified(path: Path) -> bool:
    program = [sys.executable, "-m", "rerun", "rrd", "verify", str(path)]
    done = subprocess.run(program, capture_output=True, text=True, timeout=60, check=False)
    return done.returncode == 0 and "ERROR" not in done.stderr


WAYS = ("fast", "NaN", "long")


@pytest.mark.parametrize("id", [task.id for task in TASKS])
def test_a_recorded_task_diverges_as_a_bare_one_does(tmp_path: Path, id: str) -> None:
    bare = make(id, disable_env_checker=True)
    outcomes = []
    for env in (bare, RecordRerun(bare, tmp_path / "a.rrd")):
        for how in WAYS:
            env.reset(seed=0)
            torn_apart(env.unwrapped, how)
            _, reward, *over, info = env.step(still(env))
            outcomes.append((reward, over, info.get("truncation_reason")))
        env.reset(seed=1)
        env.step(still(env))
    env.close()
    assert outcomes[:3] == outcomes[3:]
    reasons = [reason for _, _, reason in outcomes[3:]]
    assert all(reason.startswith(("diverged", "damaged")) for reason in reasons[:2])
    assert verified(tmp_path / "a.rrd")
    found = read(tmp_path / "a.rrd")
    texts = [text for _, text in found.events]
    assert all(texts.count(reason) == reasons.count(reason) for reason in reasons if reason)
    curves = [c for name, c in found.curves.items() if name.endswith("/resistance")]
    assert all(len(curve.values) == 8 for curve in curves)
    assert np.isfinite([curve.values[[0, 2, 4, 6, 7]] for curve in curves]).all()
    assert np.isnan([curve.values[3] for curve in curves]).any() or "damaged" in reasons[1]


def test_a_signal_without_a_value_is_not_a_number(tmp_path: Path) -> None:
    """The other TCAs keep theirs."""
    sim = Simulation(bending_module())
    with Recorder(sim, tmp_path / "a.rrd") as recorder:
        recorder.frame()
        sim.length_offset[1] += 50.0
        recorder.frame()
    (shown,) = (g.signals["resistance"].values for g in sim.groups)
    seen = np.array([
        read(tmp_path / "a.rrd").curves[f"actuators/{name}/resistance"].values
        for name in sim.tca_names
    ])  # fmt: skip
    for values in (sim.resistance, shown, seen[:, 1]):
        assert np.isnan(values).tolist() == [False, True, False]
    assert np.isfinite(seen[:, 0]).all()


def test_only_a_strict_resistance_refuses() -> None:
    wire = WireTable.of([CATALOGUE["free-stroke"]] * 6)
    length = wire.rest_length * np.array([1.0, np.nan, np.inf, -1.0, 0.0, 1e3])
    loose = resistance(wire, length, np.full(6, 25.0), strict=False)
    assert np.isnan(loose).tolist() == [False, *[True] * 5]
    assert loose[0] == wire.rest_resistance[0]
    assert np.isnan(resistance(wire, wire.rest_length, np.full(6, np.nan), strict=False)).all()
    for wrong in length[1:]:
        with pytest.raises(ValueError, match="got"):
            resistance(wire, np.full(6, wrong), 25.0)


@pytest.mark.parametrize("way", [copy.deepcopy, copy.copy, pickled])
@pytest.mark.parametrize("begun", [False, True])
def test_a_copy_goes_on_and_records_nothing(tmp_path: Path, way: Any, begun: bool) -> None:
    env: Any = RecordRerun(gym.make(QUICK, disable_env_checker=True), tmp_path / "a.rrd", chunk=1)
    if begun:
        env.reset(seed=3)
    other = way(env)
    if way is copy.copy:  # they share the task
        assert other.recorder is None
        env.close()
        return
    if not begun:
        env.reset(seed=3)
        other.reset(seed=3)
    other.event("unheard")
    for _ in range(3):
        mine, yours = env.step(still(env)), other.step(still(env))
        np.testing.assert_array_equal(mine[0], yours[0])
    other.close()
    other.close()
    env.close()
    found = read(tmp_path / "a.rrd")
    assert [text for _, text in found.events] == ["episode 1, seed 3"]
    assert all(len(curve.values) == 4 for n, curve in found.curves.items() if "power" in n)
    assert verified(tmp_path / "a.rrd")


def test_what_holds_a_file_or_a_window_says_that_it_cannot_be_copied(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    sim = Simulation(bending_module())
    with Recorder(sim, tmp_path / "a.rrd") as recorder, Film(sim, tmp_path / "a.mp4") as film:
        for held in (recorder, film):
            for way in (copy.copy, copy.deepcopy, pickle.dumps):
                with pytest.raises(TypeError, match="cannot be copied: it holds an open file"):
                    way(held)


def test_two_recorders_do_not_write_one_file(tmp_path: Path) -> None:
    sim, path = Simulation(bending_module()), tmp_path / "new" / "a.rrd"
    begin = (
        "import sys; from tca_mj import Simulation, bending_module; from tca_mj.record import"
        " Recorder\nRecorder(Simulation(bending_module()), sys.argv[1]).close()"
    )

    def elsewhere() -> subprocess.CompletedProcess[str]:
        told = [sys.executable, "-c", begin, str(path)]
        return subprocess.run(told, capture_output=True, text=True, timeout=60, check=False)

    with Recorder(sim, path, chunk=1) as recorder:
        recorder.frame()
        with pytest.raises(ValueError, match=r"path must be .* nothing writes now, got .*a\.rrd"):
            Recorder(sim, path)
        assert "nothing writes now" in elsewhere().stderr
        env = RecordRerun(gym.make(QUICK, disable_env_checker=True), path)
        with pytest.raises(ValueError, match="nothing writes now"):
            env.reset(seed=0)
        env.close()
        recorder.frame()
    assert verified(path)
    assert len(read(path).curves["actuators/tca0/power"].values) == 2
    assert elsewhere().returncode == 0  # what is finished may be overwritten
    assert read(path).curves == {}


@pytest.mark.usefixtures("opengl")
def test_two_films_do_not_write_one_file(tmp_path: Path) -> None:
    sim, path = Simulation(bending_module()), tmp_path / "a.mp4"
    films = [Film(sim, path, width=64, height=64) for _ in range(3)]
    films[0].frame()
    with pytest.raises(ValueError, match=r"nothing writes now, got .*a\.mp4"):
        films[1].frame()
    for film in films[:2]:
        film.close()
    size = path.stat().st_size
    assert size > 0
    films[2].frame()
    films[2].close()
    assert path.stat().st_size == size


def test_a_claim_leaves_no_trace(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("kept")
    for path in (old, new):
        claim = Claim(path)
        with pytest.raises(ValueError, match="nothing writes now"):
            Claim(path)
        claim.close()
        claim.close()
        Claim(path).close()
    assert [p.name for p in tmp_path.iterdir()] == ["old"]
    assert old.read_text() == "kept"


def test_what_is_not_written_whole_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_whole(tmp_path / "a", b"old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"new")
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    assert path.read_bytes() == b"old"


def test_a_full_disk_ends_the_recording_and_not_the_episode(tmp_path: Path) -> None:
    """In a process whose files may have 150 kB once the recording has begun."""
    script = """
import json, resource, sys, warnings
import gymnasium as gym, numpy as np
from tca_mj.envs.wrappers import RecordRerun
env = RecordRerun(gym.make("TCA/BendReach-v0"), sys.argv[1], chunk=5)
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    env.reset(seed=0)
    resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))
    rewards = [env.step(np.zeros(3, dtype=np.float32))[1] for _ in range(60)]
    env.reset(seed=0)
    env.event("unheard")
    env.close()
said = [str(w.message) for w in said if w.category is RuntimeWarning]
print(json.dumps([rewards, env.failure, said]))
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "a.rrd")], capture_output=True, text=True,
        timeout=120, check=False,
    )
    rewards, failure, said = json.loads(done.stdout)
    assert failure and said == [f"the recording {tmp_path / 'a.rrd'} has ended: {failure}"]
    env = gym.make(QUICK)
    env.reset(seed=0)
    assert rewards == [float(env.step(still(env))[1]) for _ in range(60)]


def test_a_file_that_cannot_be_begun_is_refused(tmp_path: Path) -> None:
    env = RecordRerun(gym.make(QUICK, disable_env_checker=True), tmp_path)  # a folder
    for _ in range(2):
        with pytest.raises(OSError, match="directory"):
            env.reset(seed=0)
    env.close()


def reach(out: Path, policy: Any = None, **more: Any) -> dict[str, Any]:
    return play(QUICK, policy or Doing(), out=out, max_duration=0.5, **more)


def strict(path: Path) -> Any:
    """JSON without infinity and NaN, which no other program reads."""

    def refuse(word: str) -> None:
        raise ValueError(word)

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


@pytest.mark.parametrize("how", WAYS)
def test_a_demo_of_what_diverges_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    pytest.importorskip("matplotlib")
    made: list[Any] = []
    monkeypatch.setattr(demo, "make", lambda *a, **k: made.append(make(*a, **k)) or made[-1])
    tear = Doing(lambda: torn_apart(made[0].unwrapped, how))
    result = reach(tmp_path, tear, video=False)
    assert result == strict(tmp_path / "summary.json")
    assert result["ending"].startswith("diverged") and "diverged" in outcome(result)
    assert result["files"] == ["rollout.rrd", "rollout.html", "rollout.png"]
    assert result["left_out"] == {}
    assert result["duration"] == pytest.approx(0.3, abs=0.1)
    assert read(tmp_path / "rollout.rrd").events[-1][1] == result["ending"]


@pytest.mark.parametrize("missing", ["/nowhere/ffmpeg", None])
@pytest.mark.usefixtures("opengl")
def test_without_an_encoder_only_the_film_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str | None
) -> None:
    if missing is None:
        def none() -> str:
            raise RuntimeError("No ffmpeg exe could be found.")

        monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", none)
    else:
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", missing)
    result = reach(tmp_path)
    assert result["ending"] == "stopped after 0.5 s"
    assert result["files"] == ["rollout.rrd", "rollout.html", "rollout.png"]
    assert "ffmpeg" in result["left_out"]["rollout.mp4"]


@pytest.mark.usefixtures("opengl")
def test_an_encoder_that_dies_cuts_the_film_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, calls = Film.frame, []

    def dying(film: Film) -> None:
        calls.append(film.simulation.time)
        if len(calls) == 3:
            raise OSError("broken pipe")
        plain(film)

    monkeypatch.setattr(Film, "frame", dying)
    result = reach(tmp_path)
    assert (result["duration"], len(calls)) == (0.5, 3)
    assert result["left_out"] == {"rollout.mp4": "broken pipe"}
    assert result["files"] == ["rollout.rrd", "rollout.mp4", "rollout.html", "rollout.png"]
    assert "rollout.mp4 is cut off: broken pipe" in capsys.readouterr().out


def test_what_fails_at_the_end_leaves_the_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError("no space left")

    with (
        monkeypatch.context() as patch,
        pytest.warns(RuntimeWarning, match="has ended: OSError: no space left"),
    ):
        patch.setattr(episode, "rollout_plot", full)
        patch.setattr(Recorder, "_write", full)
        result = reach(tmp_path, video=False)
    assert result == strict(tmp_path / "summary.json")
    assert result["ending"] == "stopped after 0.5 s"
    assert result["left_out"] == {
        "rollout.png": "no space left", "rollout.rrd": "OSError: no space left"
    }

    def blocked() -> None:  # from the third action on
        monkeypatch.setattr(episode, "write_json", full)

    result = reach(tmp_path / "other", Doing(blocked), video=False)
    assert result["left_out"]["summary.json"] == "no space left"
    assert result["duration"] == 0.5


def test_what_cannot_be_begun_is_refused_by_a_demo(tmp_path: Path) -> None:
    with (
        Recorder(Simulation(bending_module()), tmp_path / "rollout.rrd"),
        pytest.raises(ValueError, match="nothing writes now"),
    ):
        reach(tmp_path, video=False)
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        reach(tmp_path / "file" / "folder", video=False)


def test_a_plot_leaves_out_what_is_no_number(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    clock = np.linspace(0.0, 1.0, 5)
    curves = np.outer(clock, [1.0, 2.0])
    curves[3, 0], curves[4] = np.nan, np.inf
    bend = np.full(5, np.nan)
    plots.rollout_plot(tmp_path / "a.png", clock, curves, curves, -curves, bend, ["a", "b"])
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"

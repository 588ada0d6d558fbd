"""Files are whole at any moment, folders have one owner, and what is broken is told by name."""

import errno
import json
import os
import pickle
import re
import signal
import stat
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest

from tca_mj import cli, files
from tca_mj.agents.finished import EPISODES, begun, keep, kept
from tca_mj.agents.output import read_json
from tca_mj.agents.sweep import RESULT, TRIALS
from tca_mj.agents.train.runs import RUN, STATE, RunFolder
from tca_mj.agents.train.search import SearchConfig
from tca_mj.files import LOCK, PART, append_whole, claimed, require_room, write_whole
from tca_mj.record import Recorder, recorder

REACH, WALK = "TCA/BendReach-v0", "TCA/TetrapodWalk-v0"
EVAL = ["eval", "off", "--task", REACH, "--episodes", "2", "--steps", "2"]
DEMO = ["demo", "--policy", "off", "--task", REACH, "--no-video"]
PPO = ["train", REACH, "--algo", "ppo", "--steps", "9", "--no-video"]
CMA = ["train", WALK, "--algo", "cma", "--steps", "9"]
SWEEP = ["sweep", "off", "--task", REACH, "--set", "steps=2"]

unix = pytest.mark.skipif(sys.platform == "win32", reason="there are no such locks and limits")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def full(*_: object, **__: object) -> None:
    """Stands for a call that the disk has no room for."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@unix
def test_a_link_that_lies_there_is_replaced_and_not_followed(tmp_path):
    other, path = tmp_path / "other", tmp_path / "result.json"
    other.write_text("precious")
    for planted in (path, tmp_path / f".{path.name}.tmp"):  # the name that was once used
        planted.symlink_to(other)
    write_whole(path, b"new")
    assert other.read_text() == "precious" and not path.is_symlink() and path.read_text() == "new"
    mask = os.umask(0o027)
    try:
        mode = write_whole(path, b"newer").stat().st_mode
    finally:
        os.umask(mask)
    assert stat.S_IMODE(mode) == 0o640


def test_what_cannot_be_written_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = write_whole(tmp_path / "a", b"old\n")
    with monkeypatch.context() as patch:
        patch.setattr(files.os, "fsync", full)
        for write in (write_whole, append_whole):
            with pytest.raises(OSError, match="No space left on device.*/a'"):
                write(path, b"new")
    assert path.read_bytes() == b"old\n" and names(tmp_path) == ["a"]
    append_whole(path, b"more")
    assert path.read_bytes() == b"old\nmore"
    monkeypatch.setattr(files.shutil, "disk_usage", lambda _: type("Usage", (), {"free": 99}))
    require_room(path, 50, later=49)
    with pytest.raises(OSError, match="No space left on device.*/a'"):
        require_room(path, 50, later=50)
    assert names(tmp_path) == ["a"]


@unix
def test_a_folder_has_one_owner_who_leaves_nothing(tmp_path):
    folder = tmp_path / "new" / "run"
    with claimed(folder):
        said = f"run is in use by process {os.getpid()} on .*: wait for its end, or take another"
        with pytest.raises(BlockingIOError, match=said), claimed(folder):
            pass
        (folder / "result").touch()
    assert names(folder) == ["result"]
    with pytest.raises(ZeroDivisionError), claimed(tmp_path / "wrong"):
        raise ZeroDivisionError
    assert not (tmp_path / "wrong").exists()
    (folder / "old").touch()
    (folder / LOCK).symlink_to(folder / "old")  # nobody is led elsewhere
    with pytest.raises(OSError, match="symbolic links"), claimed(folder):
        pass


@unix
def test_a_kill_releases_the_folder_and_what_was_half_done_goes(tmp_path):
    script = (
        "import sys, time; from pathlib import Path; from tca_mj.files import claimed\n"
        "with claimed(Path(sys.argv[1])):\n    print('has it', flush=True); time.sleep(600)"
    )
    owner = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE)
    assert owner.stdout and owner.stdout.readline() == b"has it\n"
    with pytest.raises(BlockingIOError, match=f"process {owner.pid}"), claimed(tmp_path):
        pass
    os.kill(owner.pid, signal.SIGKILL)
    owner.communicate()
    (tmp_path / f".0123{PART}").write_bytes(b"half")
    (tmp_path / f".film{PART}").mkdir()
    (tmp_path / f".film{PART}" / "rollout.mp4").touch()
    (tmp_path / ".mine.part").touch()
    with claimed(tmp_path):
        assert names(tmp_path) == [".mine.part", LOCK]
    assert names(tmp_path) == [".mine.part"]


@unix
def test_a_drive_without_locks_is_warned_of_and_no_other_system_locks(tmp_path, monkeypatch):
    (tmp_path / f".0123{PART}").touch()  # may be somebody's who works here

    def unsupported(*_):
        raise OSError(errno.ENOTSUP, "not here")

    with monkeypatch.context() as patch:
        patch.setattr(files.fcntl, "flock", unsupported)
        with pytest.warns(RuntimeWarning, match="cannot be locked"), claimed(tmp_path):
            assert names(tmp_path) == [f".0123{PART}"]
    monkeypatch.setattr(files.sys, "platform", "win32")
    with claimed(tmp_path), claimed(tmp_path):
        assert names(tmp_path) == [f".0123{PART}"]


@unix
@pytest.mark.parametrize("command", [EVAL, DEMO, PPO, CMA, SWEEP], ids=lambda c: " ".join(c[:4:3]))
def test_two_commands_in_one_folder(command, tmp_path, capsys):
    with claimed(tmp_path):
        assert cli.main([*command, "--out", str(tmp_path)]) == 2
        assert f"{tmp_path} is in use by process {os.getpid()}" in capsys.readouterr().err
        assert names(tmp_path) == [LOCK]
    assert names(tmp_path) == []


@pytest.mark.parametrize("command", [EVAL, DEMO, PPO, CMA, SWEEP], ids=lambda c: " ".join(c[:4:3]))
def test_a_full_disk_ends_a_command_with_a_line(command, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(files.os, "fsync", full)
    assert cli.main([*command, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.strip().endswith(": No space left on device") and "out/" in said
    left = names(tmp_path / "out") if (tmp_path / "out").exists() else []
    assert [name for name in left if name.startswith(".")] == []


@unix
def test_a_demo_under_a_limit_of_files(tmp_path):
    """By the system itself: Rerun, given what a file does not take, would wait for ever."""
    script = (
        "import resource, sys; from tca_mj.cli import main\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)); sys.exit(main())"
    )
    command = [sys.executable, "-c", script, *DEMO, "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert done.stderr.endswith("out/rollout.rrd: File too large\n")
    assert not (tmp_path / "out").exists()


def test_a_recording_ends_before_the_disk_is_full(tmp_path, monkeypatch):
    from tca_mj.modules.bending import bending_module
    from tca_mj.sim import Simulation

    sim = Simulation(bending_module())
    made = Recorder(sim, tmp_path / "a.rrd", chunk=2)
    made.frame()
    monkeypatch.setattr(recorder, "require_room", full)
    with pytest.raises(OSError, match="No space left"):
        made.frame()
    with pytest.raises(OSError, match="No space left"):
        made.close()
    made.close()
    with pytest.raises(OSError, match="No space left"):
        Recorder(sim, tmp_path / "b.rrd")
    assert names(tmp_path) == ["a.rrd"]


def test_files_are_written_in_one_place():
    """Whole ones; Rerun and the encoder of films write theirs as they go."""
    root = Path(__file__).parent.parent
    writing = re.compile(
        r"\.write_(text|bytes)\(|\bopen\([^)\n]*[\"'][wax]b?\+?[\"']|savefig\((?!memory)"
    )
    found = {
        path.relative_to(root).as_posix()
        for folder in ("tca_mj", "agents", "envs") for path in (root / folder).rglob("*.py")
        if writing.search(path.read_text(encoding="utf-8"))
    }  # fmt: skip
    assert found == {"tca_mj/files.py"}


BROKEN = {"empty": b"", "list": b"[]", "null": b"null", "cut off": b'{"config": {"ta',
          "deep": b"[" * 100_000, "no text": b"\xff\xfe\x00", "other": b'{"config": []}'}


@pytest.mark.parametrize("content", BROKEN.values(), ids=BROKEN)
def test_a_broken_run_is_told_by_name_and_left_as_it_is(content, tmp_path, capsys):
    for name in (RUN, STATE):
        folder = tmp_path / name
        folder.mkdir()
        if name == STATE:
            RunFolder(folder, SearchConfig(task=WALK, steps=9), "")
        (folder / name).write_bytes(content)
        assert cli.main([*CMA, "--out", str(folder)]) == 2
        said = capsys.readouterr().err
        assert f"{folder / name} " in said and "broken" in said and len(said) < 400
        assert (folder / name).read_bytes() == content


def test_a_state_is_whole_or_refused_before_it_is_unpickled(tmp_path):
    folder = RunFolder(tmp_path, SearchConfig(task=WALK), "")
    assert folder.load() is None
    folder.save({"steps": 3})
    assert folder.load() == {"steps": 3}
    path = tmp_path / STATE
    whole = path.read_bytes()
    harmful = pickle.dumps(Harmful(tmp_path / "harm"))
    for content in (whole[:-1], whole[:40], b"x" + whole[1:], harmful, harmful + whole[-32:]):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"state\.pkl is broken, or of an older version"):
            folder.load()
    assert not (tmp_path / "harm").exists()
    folder.save(Gone())
    path.write_bytes(_digested(path.read_bytes()[:-32].replace(b"Gone", b"Lost")))
    with pytest.raises(ValueError, match="of another version .*Lost"):
        folder.load()
    path.write_bytes(whole)
    (tmp_path / RUN).unlink()
    with pytest.raises(ValueError, match=r"holds state\.pkl without run\.json"):
        RunFolder(tmp_path, SearchConfig(task=WALK), "")


class Gone:
    """A class that another version does not have."""


class Harmful:
    """Touches a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def _digested(content: bytes) -> bytes:
    import hashlib

    return content + hashlib.sha256(content).digest()


EPISODE = {"seed": 4, "steps": 1, "ending": "time limit", "return": 1.0, "success": True,
           "duration": 0.1, "energy": 1.0, "peak_temperature": 25.0, "peak_tension": 0.1}


def test_only_episodes_are_read_of_a_file_of_episodes(tmp_path, capsys):
    path = tmp_path / EPISODES
    keep(path, "k", EPISODE)
    good = path.read_bytes()
    spoilt = [{"key": "k", **EPISODE, **change} for change in (
        {"seed": "4"}, {"seed": None}, {"return": "1"}, {"return": None}, {"energy": [1.0]},
        {"return": float("nan")}, {"ending": 3}, {"key": 7}, {"speed": {}}, {"duration": 10**400},
    )]  # fmt: skip
    lines = [b"[]", b"null", b"3", b"{", b"", b"[" * 9000, b"\xff\xfe", good[:-20],
             *(json.dumps(row).encode() for row in spoilt), b'{"key": "k", "seed": 1}']  # fmt: skip
    path.write_bytes(b"\n".join(lines) + b"\n" + good + good[:30])
    assert kept(path, "k") == {4: EPISODE} and kept(path, "other") == {}
    assert begun(path, "k") == {4: EPISODE}
    assert f"{len(lines) + 1} lines that are no episodes are left out" in capsys.readouterr().err
    assert path.read_bytes() == good
    keep(path, "k", {**EPISODE, "seed": 5})
    keep(path, "other", EPISODE)
    assert sorted(begun(path, "k")) == [4, 5] and capsys.readouterr().err == ""
    assert begun(path, "k", fresh=True) == {} and sorted(kept(path, "other")) == [4]


def test_memory_does_not_grow_with_a_broken_file(tmp_path):
    path = tmp_path / EPISODES
    with path.open("wb") as file:
        file.truncate(200_000_000)  # a single line, sparse on disk
    (tmp_path / RUN).write_bytes(b" " * 20_000_000)
    tracemalloc.start()
    try:
        assert kept(path, "k") == {}
        with pytest.raises(ValueError, match="must hold an object as JSON"):
            read_json(tmp_path / RUN)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 40_000_000  # twice what a file of JSON may have


@pytest.mark.parametrize("content", [b"[]", b"{", b'{"point": {}}', b'{"point":1, "figures":{}}'])
def test_a_broken_result_of_a_trial(content, tmp_path, capsys):
    from tca_mj.agents.evaluate import Evaluation
    from tca_mj.agents.sweep import Sweep

    (trial,) = Sweep(
        evaluation=Evaluation(task=REACH, policy="off", episodes=5), axes={"steps": (2,)}
    ).trials()
    file = tmp_path / TRIALS / trial.name / RESULT
    write_whole(file, content)
    assert cli.main([*SWEEP, "--out", str(tmp_path)]) == 2
    assert f"{file} must" in capsys.readouterr().err

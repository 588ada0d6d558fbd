"""Whatever ends a process: what is finished is kept, nothing runs on, and nothing hangs."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError

from tca_mj import cli
from tca_mj.agents.finished import EPISODES
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.cli.signals import Signals
from tca_mj.record.render import Offscreen, RenderingUnavailable, gl_backend
from tca_mj.registry import TASKS

REACH = "TCA/BendReach-v0"
PATIENCE = 300.0  # only against hanging [s]

unix = pytest.mark.skipif(sys.platform == "win32", reason="needs signals and forks")


def started(*command: str, **more) -> subprocess.Popen[str]:
    """A command in a group of processes of its own; Ctrl-C is heard even if it is not here."""
    return subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        **more,
    )  # fmt: skip


def group_is_gone(process: subprocess.Popen[str], within: float = 20.0) -> bool:
    """Whether all of the group of a process that has ended end as well."""
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@unix
@pytest.mark.parametrize(
    ("sent", "code"), [(["SIGTERM"], 143), (["SIGINT", "SIGINT"], 130), (["SIGHUP"], 129)]
)
def test_a_signal_ends_a_command_that_keeps_what_is_finished(sent, code, tmp_path):
    """To all processes of the command, as a terminal and a batch system send it."""
    if signal.getsignal(getattr(signal, sent[0])) is signal.SIG_IGN:
        pytest.skip(f"{sent[0]} is ignored here, as under nohup, and so by what is started")
    command = ["eval", "off", "--task", REACH, "--episodes", "10000", "--steps", "2",
               "--workers", "2", "--out", str(tmp_path)]  # fmt: skip
    run = started("-m", "tca_mj.cli", *command)
    episodes, deadline = tmp_path / EPISODES, time.monotonic() + PATIENCE
    # The first of two lines is on the disk: one that a signal finds half-way is taken back.
    while not (episodes.is_file() and episodes.read_bytes().count(b"\n") > 1):
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)
    for name in sent:
        os.killpg(run.pid, getattr(signal, name))
    _, said = run.communicate(timeout=PATIENCE)
    assert run.returncode == code and "Traceback" not in said and group_is_gone(run)
    assert said.endswith(f"; what was finished is in {tmp_path}\n")
    assert [path.name for path in tmp_path.iterdir()] == [EPISODES]
    lines = episodes.read_bytes().splitlines(keepends=True)
    assert cli.main([*command[:5], str(len(lines)), *command[6:8], "--out", str(tmp_path)]) == 0
    assert episodes.read_bytes().startswith(b"".join(lines))


@unix
def test_workers_end_with_whoever_started_them(tmp_path):
    """By kill -9, amid jobs that would take for ever."""
    script = tmp_path / "script.py"
    script.write_text(
        "import time\nfrom tca_mj.agents.workers import Workers\n"
        "def job(n):\n    print(n, flush=True)\n    time.sleep(1e6)\n"
        "if __name__ == '__main__':\n"
        "    with Workers(2) as workers:\n        list(workers.run(job, [(1,), (2,)]))\n"
    )
    run = started(str(script))
    assert run.stdout and {run.stdout.readline(), run.stdout.readline()} == {"1\n", "2\n"}
    os.kill(run.pid, signal.SIGKILL)
    run.communicate(timeout=PATIENCE)  # which the workers' output would keep open
    assert group_is_gone(run)


@unix
def test_signals_that_are_ignored_stay_so_and_handlers_come_back():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as by nohup
    try:
        mine = signal.getsignal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt), Signals() as signals:
            os.kill(os.getpid(), signal.SIGHUP)
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(10.0)
        assert signals.heard is signal.SIGTERM and signal.getsignal(signal.SIGTERM) is mine
        with Signals() as signals:
            signals.over(leaving=False)
            os.kill(os.getpid(), signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) is mine
    finally:
        signal.signal(signal.SIGHUP, before)
    found = []
    thread = threading.Thread(target=lambda: found.append(cli.main(["list", REACH])))
    thread.start()
    thread.join()
    assert found == [0]  # where there can be no handlers


@unix
def test_a_signal_amid_an_import_ends_with_its_code(tmp_path):
    """CPython dies of SIGINT itself where that has struck in text that is executed."""
    (tmp_path / "stopping.py").write_text(
        "exec('import os, signal, time\\nos.kill(os.getpid(), signal.SIGTERM)\\ntime.sleep(9)')"
    )
    run = started("-m", "tca_mj.cli", "list", "stopping:Mine-v0", cwd=tmp_path,
                  env=os.environ | {"PYTHONPATH": str(tmp_path)})  # fmt: skip
    _, said = run.communicate(timeout=PATIENCE)
    assert (run.returncode, said) == (143, "ended by SIGTERM\n")


def test_processes_are_started_in_one_place():
    """What else starts some leaves them behind when it is killed."""
    root = Path(__file__).parent.parent
    pools = re.compile(r"^ *(import|from) (multiprocessing|concurrent\.futures)\b", re.MULTILINE)
    assert [
        str(path.relative_to(root))
        for folder in ("tca_mj", "agents", "envs", "scripts", "examples")
        for path in (root / folder).rglob("*.py") if pools.search(path.read_text(encoding="utf-8"))
    ] == [str(Path("agents", "workers.py"))]  # fmt: skip


FORKED = """
import os, signal, sys
import gymnasium as gym, numpy as np, tca_mj
envs = gym.make_vec(sys.argv[1], num_envs=2, num_threads=2)
envs.reset(seed=0)
action = np.zeros(envs.action_space.shape, np.float32)
envs.step(action)
batch = envs.batch
seen = []
for what in ("step", "close", "exit", "batch"):
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        if what == "exit":
            sys.exit(0)
        if what == "batch":
            try:
                batch.step([None, None], 0.1)
            except RuntimeError as error:
                os.write(write, str(error).encode())
        else:
            getattr(envs, what)(*[action] * (what == "step"))
            os.write(write, what.encode())
        del envs, batch
        os._exit(0)
    os.close(write)
    said = os.read(read, 1000).decode()
    print(what, os.waitpid(child, 0)[1], said)
print(np.isfinite(envs.step(action)[0]).all())
envs.close()
"""


@unix
def test_a_forked_child_of_a_vector_environment_does_not_hang(tmp_path):
    """It steps on threads of its own, closes and ends; the batch itself is refused there."""
    run = started("-c", FORKED, REACH, cwd=tmp_path)
    said, errors = run.communicate(timeout=PATIENCE)
    step, close, ended, batch, on = said.splitlines()
    assert (step, close, ended.strip()) == ("step 0 step", "close 0 close", "exit 0"), errors
    assert batch.startswith("batch 0 a batch must be stepped by the process that made it")
    assert on == "True"


@pytest.mark.parametrize("task", [task.id for task in TASKS])
def test_a_closed_vector_environment_does_nothing(task):
    envs = gym.make_vec(task, num_envs=1)
    envs.reset(seed=0)
    action = np.zeros(envs.action_space.shape, np.float32)
    envs.close()
    envs.close()
    for call in (lambda: envs.step(action), envs.reset, lambda: envs.restart(0), envs.render,
                 lambda: envs.advance(action)):  # fmt: skip
        with pytest.raises(ClosedEnvironmentError, match="closed"):
            call()


def test_so_does_one_of_stable_baselines3():
    envs = TaskVecEnv.make(REACH, 2)
    envs.reset()
    envs.close()
    with pytest.raises(ClosedEnvironmentError, match="closed"):
        envs.step(np.zeros((2, 3), np.float32))


def need_opengl() -> None:
    try:
        gl_backend()
    except RenderingUnavailable as error:
        pytest.skip(str(error))


def in_thread(call) -> list:
    """What a call in another thread returns or raises."""
    found = []

    def attempt() -> None:
        try:
            found.append(call())
        except Exception as error:
            found.append(error)

    thread = threading.Thread(target=attempt, name="another")
    thread.start()
    thread.join()
    return found


def test_a_picture_is_drawn_by_the_thread_that_opened_the_camera():
    need_opengl()
    env = gym.make(REACH, render_mode="rgb_array", size=(64, 64))
    env.reset(seed=0)
    first = env.render()
    (error,) = in_thread(env.render)
    assert isinstance(error, RuntimeError) and "thread that opened it (MainThread)" in str(error)
    np.testing.assert_array_equal(env.render(), first)
    (camera,) = in_thread(lambda: Offscreen(env.unwrapped.model, width=64, height=64))
    with pytest.raises(RuntimeError, match=r"thread that opened it \(another\)"):
        camera.draw(env.unwrapped.data)
    camera.close()
    assert in_thread(env.close) == [None]  # neither complains
    with pytest.raises(RuntimeError, match="closed"):
        camera.draw(env.unwrapped.data)


CAMERA = """
import os, signal, sys
import gymnasium as gym, tca_mj
env = gym.make("TCA/BendReach-v0", render_mode="rgb_array", size=(64, 64))
env.reset(seed=0)
env.render()
child = os.fork()
if child == 0:
    signal.alarm(60)
    try:
        env.render()
    except RuntimeError as error:
        print(error, flush=True)
    env.close()
    sys.exit(0)
print(os.waitpid(child, 0)[1], flush=True)
env.render()
"""


@unix
def test_a_forked_child_does_not_draw_and_does_not_hang(tmp_path):
    need_opengl()
    run = started("-c", CAMERA, cwd=tmp_path)
    said, errors = run.communicate(timeout=PATIENCE)
    refused, ended = said.splitlines()
    assert "process and thread that opened it" in refused and ended == "0", errors
    assert run.returncode == 0 and "Traceback" not in errors


def test_progress_is_told_without_a_terminal(tmp_path, capsys, monkeypatch):
    """With what has been earned, the rate and the time that is left; a line for each state."""
    monkeypatch.setattr("tca_mj.agents.progress.SECONDS", 0.0)
    monkeypatch.chdir(tmp_path)
    common = ["--out", str(tmp_path / "out")]
    for command, unit in (
        (["eval", "random", "--task", REACH, "--episodes", "3", "--steps", "2"], "episodes"),
        (["demo", "--policy", "off", "--task", REACH, "--no-video"], "s"),
    ):
        cli.main([*command, *common])
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) >= 4 and all(f" {unit}, " in line for line in lines), lines
        assert all(" left, " in line and f" {unit}/s" in line for line in lines[1:])
        assert "return=" in lines[2] and not any("\r" in line for line in lines)


EVAL = ["eval", "off", "--task", REACH, "--episodes", "1", "--steps", "2", "--out", "out"]
BUFFERED = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}


@unix
@pytest.mark.parametrize("words", [["list", REACH], ["--help"], EVAL], ids=" ".join)
def test_nobody_is_left_to_read(words, tmp_path):
    """As ``tca-mj list | head``: no error, and the code that a shell knows; so of both streams."""
    for both in (False, True):
        run = subprocess.Popen(
            [sys.executable, "-m", "tca_mj.cli", *words], cwd=tmp_path, env=BUFFERED,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT if both else subprocess.PIPE,
        )  # fmt: skip
        assert run.stdout
        run.stdout.close()
        if run.stderr:
            said = run.stderr.read().decode()
            assert "pipe" not in said.lower() and "Traceback" not in said
            run.stderr.close()
        assert run.wait() == 141


@unix
@pytest.mark.parametrize("words", ["list", "--help"])
def test_head_has_the_first_line(words, tmp_path):
    """By a shell: 0 if all was written before ``head`` had seen enough."""
    script = f"{sys.executable} -m tca_mj.cli {words} | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, env=BUFFERED, capture_output=True,
                          text=True, timeout=PATIENCE, check=False)  # fmt: skip
    first, code = done.stdout.splitlines()
    assert first and (code, done.stderr) in (("0", ""), ("141", ""))


@unix
def test_output_that_cannot_be_written_is_told_in_a_line():
    """A full disk; and an output that was closed is none."""
    command = [sys.executable, "-m", "tca_mj.cli", "list", REACH]
    for words in (command, [*command[:-2], "--help"]) if Path("/dev/full").exists() else ():
        with open("/dev/full", "w") as full:
            done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True,
                                  env=BUFFERED, check=False)  # fmt: skip
        assert done.returncode == 2 and done.stderr.endswith(": No space left on device\n")
        assert len(done.stderr.splitlines()) == 1
    closed = ["sh", "-c", 'exec "$@" >&-', "sh", *command]
    done = subprocess.run(closed, capture_output=True, text=True, env=BUFFERED, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("value", ["nonsense", "cgl" if sys.platform != "darwin" else "egl"])
def test_a_way_to_opengl_that_is_not_there_is_told(value):
    done = subprocess.run([sys.executable, "-m", "tca_mj.cli", "list", REACH], check=False,
                          env=os.environ | {"MUJOCO_GL": value}, capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("tca-mj list: MUJOCO_GL must name a way to OpenGL")
    assert f"got {value!r}" in done.stderr and len(done.stderr.splitlines()) == 1


LONG = "x" * 300


@pytest.mark.parametrize(
    "command",
    [
        ["eval", LONG, "--task", REACH], ["eval", "off", "--task", REACH, "--out", LONG],
        ["eval", "off", "--task", LONG], ["demo", "--policy", LONG, "--task", REACH],
        ["export", LONG], ["view", LONG], ["certify", LONG], ["bench", "--out", LONG],
        ["train", "TCA/TetrapodWalk-v0", "--algo", "cma", "--start", LONG],
        ["train", "TCA/TetrapodWalk-v0", "--algo", "ppo", "--residual", "9", "--start", LONG],
        ["sweep", LONG, "--task", REACH, "--out", "out"],
        ["sweep", "off", "--task", REACH, "--out", "out", "--set", f"policy={LONG}"],
        ["eval", "off", "--task", REACH, "--timestep", "1e-12"],
    ],
    ids=lambda words: " ".join(word[:9] for word in words),
)  # fmt: skip
def test_what_is_too_long_or_too_small_is_refused(command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        code = cli.main(command)
    except SystemExit as ended:
        code = ended.code
    said = capsys.readouterr().err
    assert code == 2 and f"tca-mj {command[0]}: " in said
    assert list(Path().iterdir()) == []

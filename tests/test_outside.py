"""A task, its robot and its script in a folder outside the package: every command works on it."""

import json
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from tca_mj import cli
from tca_mj.agents.evaluate import Evaluation, evaluate
from tca_mj.agents.sweep import Sweep
from tca_mj.agents.train.config import OffPolicy, TrainConfig
from tca_mj.bench import vector
from tca_mj.envs.wrappers import RecordRerun

ROOT = Path(__file__).parent.parent
TURN = "own_task:Example/Turn-v0"


@pytest.fixture(autouse=True)
def examples(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "examples"))


def test_it_is_listed_and_its_options_with_it(capsys):
    assert cli.main(["list", TURN]) == 0
    said = capsys.readouterr().out
    assert "Turn the tip to an angle" in said and "options angle, randomise" in said


def test_it_is_evaluated_also_off_and_by_design(tmp_path, capsys):
    command = ["eval", "scripted", "--task", TURN, "--episodes", "2", "--out", str(tmp_path)]
    assert cli.main([*command, "--randomise", "0.1"]) == 0
    assert "success" in capsys.readouterr().out
    off = evaluate(Evaluation(task=TURN, policy="off", steps=5, episodes=1))
    assert off["episodes"][0]["energy"] == 0.0
    longer = Evaluation(task=TURN, design={"length": 0.06}).make()
    assert longer.unwrapped.data.site("robot.tip").xpos[2] == pytest.approx(0.01, abs=2e-3)


def test_it_is_demonstrated_and_recorded(tmp_path, capsys):
    command = ["demo", "--policy", "scripted", "--task", TURN, "--no-video"]
    options = ["--option", "angle=0.5", "--out", str(tmp_path)]
    assert cli.main([*command, *options]) == 0
    assert f"scripted in {TURN}: success" in capsys.readouterr().out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["phases"][0]["name"] == "script" and "rollout.rrd" in summary["files"]
    with RecordRerun(gym.make(TURN), tmp_path / "own.rrd") as env:
        env.reset(seed=0)
        env.step(np.zeros(9, dtype=np.float32))
    assert (tmp_path / "own.rrd").stat().st_size > 1000


def test_it_is_learned_and_what_was_learned_acts(tmp_path, capsys):
    pytest.importorskip("stable_baselines3")
    from tca_mj.agents.train.deep import train

    config = TrainConfig(
        task=TURN, algorithm="sac", learner=OffPolicy(learning_starts=20, hidden=(8,)), steps=60,
        envs=2, interval=40, evaluation_episodes=1,
    )  # fmt: skip
    train(config, tmp_path / "run", video=False, progress=False)
    command = ["eval", str(tmp_path / "run"), "--task", TURN, "--episodes", "1"]
    assert cli.main([*command, "--steps", "5", "--out", str(tmp_path / "eval")]) == 0
    assert "return" in capsys.readouterr().out


def test_it_can_be_viewed_where_there_is_a_screen(monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert cli.main(["view", TURN]) == 2
    assert "no screen" in capsys.readouterr().err


def test_it_is_swept_and_timed():
    sweep = Sweep(evaluation=Evaluation(task=TURN), axes={"design.length": (0.05, 0.06)})
    lengths = [trial.evaluation(Path()).make().unwrapped.sim.model for trial in sweep.trials()]
    assert lengths[0].body_mass.sum() < lengths[1].body_mass.sum()
    assert TURN in vector.benchmark(ids=[TURN], num_envs=2, scale=0.1)["tasks"]


def test_the_machinery_names_no_task_and_no_robot():
    """The files that belong to a task may: scripted policies and gaits."""
    name = re.compile(r"TCA/\w|Tetrapod|tetrapod|ArmPick|BendReach|MorphModule|PickAndPlace|Course")
    files = [p for p in (ROOT / "agents").rglob("*.py") if p.parent.name != "scripts"]
    files += (ROOT / "tca_mj" / "cli").glob("*.py")
    assert len(files) > 15
    for path in files:
        code = re.sub(r'""".*?"""|"""\\\n.*?"""', "", path.read_text(), flags=re.DOTALL)
        found = [line for line in code.splitlines() if name.search(line)]
        assert (path.name, found) == (path.name, [])


def test_what_cannot_be_registered_is_refused():
    from tca_mj.envs import SimulatedTask, register_task

    class Bare(SimulatedTask):
        def observe(self):
            return {}

        def judge(self, drive, harmed):
            return None

    with pytest.raises(ValueError, match="task must be a class of a SimulatedTask, got 'Bare'"):
        register_task("Example/Bare-v0", "Bare")
    with pytest.raises(ValueError, match="id must be Place/Name-v0, got 'Example/Bare v0'"):
        register_task("Example/Bare v0", Bare)
    with pytest.raises(ValueError, match="max_episode_steps must be at least 1, got 0"):
        register_task("Example/Bare-v0", Bare, max_episode_steps=0)
    with pytest.raises(ValueError, match="scene must be what builds the robot of Bare, got None"):
        Bare()


def test_options_are_drawn_evenly_by_default():
    from tca_mj.envs import Option, Options

    rows = [
        Option(name="angle", about="an angle", low=1.0, high=3.0),
        Option(name="place", about="a place", low=0.0, high=0.1, shape=(2,)),
        Option(name="side", about="a side", choices=("left", "right")),
    ]
    random = np.random.default_rng(0)
    drawn = [Options(rows).setup(random, {}) for _ in range(400)]
    angles = np.array([each["angle"] for each in drawn])
    assert 1.0 < angles.min() < 1.05 and 2.95 < angles.max() < 3.0
    assert angles.mean() == pytest.approx(2.0, abs=0.1)
    assert drawn[0]["place"].shape == (2,)
    assert {each["side"] for each in drawn} == {"left", "right"}
    with pytest.raises(ValueError, match="draw of angle must be given where a bound is infinite"):
        Option(name="angle", about="an angle", low=1.0)

"""Evaluations: their figures, that they go on, and that processes change nothing."""

import json
import math
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import tca_mj  # noqa: F401  (registers the ids)
from tca_mj import cli
from tca_mj.agents import evaluate as module
from tca_mj.agents.demo import play
from tca_mj.agents.evaluate import Evaluation, cell, evaluate, figures, report
from tca_mj.agents.finished import EPISODES
from tca_mj.agents.policies import Origin, SavedPolicy
from tca_mj.agents.policies.actors import actor, arguments_of
from tca_mj.agents.scripts.tetrapod import WALK
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.registry import TASKS, make

REACH, WALKING = "TCA/BendReach-v0", "TCA/TetrapodWalk-v0"
SHORT = Evaluation(task=REACH, policy="random", episodes=3, steps=4, randomise=0.2)


def row(seed, **known):
    return {"seed": seed, "steps": 1, "ending": "time limit", "return": 1.0, "success": True,
            "duration": 1.0, "energy": 10.0, "peak_temperature": 100.0, "peak_tension": 0.1,
            **known}  # fmt: skip


def test_means_and_intervals_are_those_of_the_textbook():
    rows = [row(i, **{"return": float(i + 1), "success": i < 2}) for i in range(4)]
    found = figures(rows)
    half = 3.182446 * math.sqrt(5.0 / 3.0) / 2.0  # Student's t for 3 degrees of freedom
    assert found["return"] == pytest.approx(
        {"mean": 2.5, "low": 2.5 - half, "high": 2.5 + half, "least": 1.0, "most": 4.0}
    )
    # Wilson for 2 of 4, z = 1.959964
    share, z, n = 0.5, 1.959964, 4
    centre = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    assert found["success"]["low"] == pytest.approx(centre - half, rel=1e-5)
    assert found["success"]["high"] == pytest.approx(centre + half, rel=1e-5)
    assert "speed" not in found and "cost_of_transport" not in found
    alone = figures(rows[:1])["return"]
    assert alone["mean"] == 1.0 and alone["low"] is None and alone["high"] is None


def test_ratios_are_of_sums_and_only_of_headway():
    def walked(*distances):
        return [row(i, distance=d, drift=0.0, speed=d, weight=0.2)
                for i, d in enumerate(distances)]  # fmt: skip

    found = figures(walked(0.1, 0.3))
    assert found["energy_per_metre"]["mean"] == pytest.approx(20.0 / 0.4)
    assert found["cost_of_transport"]["mean"] == pytest.approx(20.0 / (0.2 * 0.4))
    per_metre = found["energy_per_metre"]
    assert per_metre["least"] == pytest.approx(10.0 / 0.3) == per_metre["low"]
    assert per_metre["most"] == pytest.approx(100.0) == per_metre["high"]
    same = figures(walked(0.2, 0.2, 0.2))["energy_per_metre"]
    assert same["low"] == pytest.approx(50.0) == same["high"]
    assert figures(walked(0.1, -0.1))["cost_of_transport"]["mean"] is None
    once = figures(walked(0.3, -0.1))["energy_per_metre"]
    assert once["mean"] == pytest.approx(100.0) and once["low"] is None


def test_the_number_of_processes_changes_nothing(tmp_path):
    alone = evaluate(SHORT, progress=False)
    several = evaluate(SHORT, out=tmp_path, workers=2, progress=False)
    assert several["episodes"] == alone["episodes"]
    assert [r["seed"] for r in alone["episodes"]] == [0, 1, 2]
    assert len({r["return"] for r in alone["episodes"]}) == 3
    assert json.loads((tmp_path / "summary.json").read_text())["figures"] == alone["figures"]
    assert "| return |" in (tmp_path / "summary.md").read_text()


def test_an_interrupted_evaluation_goes_on(tmp_path, monkeypatch):
    ran, run = [], module.run_episode

    def counted(evaluation, seed):
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(seed)
        return run(evaluation, seed)

    monkeypatch.setattr(module, "run_episode", counted)
    with pytest.raises(KeyboardInterrupt):
        evaluate(SHORT, out=tmp_path, progress=False)
    file = tmp_path / EPISODES
    assert len(file.read_text().splitlines()) == 2
    file.write_text(file.read_text()[:-20])  # the machine broke down while it wrote
    ran.clear()
    summary = evaluate(SHORT, out=tmp_path, progress=False)
    assert ran == [1, 2]
    monkeypatch.undo()
    assert summary["episodes"] == evaluate(SHORT, progress=False)["episodes"]
    whole = file.read_text().splitlines()
    assert sum('"return"' in line for line in whole) >= 3 and whole[-1].endswith("}")


def test_what_differs_is_not_mixed(tmp_path, monkeypatch):
    evaluate(replace(SHORT, episodes=1), out=tmp_path, progress=False)
    ran, run = [], module.run_episode
    monkeypatch.setattr(module, "run_episode", lambda e, s: ran.append(s) or run(e, s))
    evaluate(replace(SHORT, episodes=2), out=tmp_path, progress=False)
    assert ran == [1]
    evaluate(replace(SHORT, episodes=1, steps=5), out=tmp_path, progress=False)
    evaluate(replace(SHORT, episodes=1, policy="off"), out=tmp_path, progress=False)
    assert ran == [1, 0, 0]
    evaluate(replace(SHORT, episodes=2), out=tmp_path, progress=False)
    assert ran == [1, 0, 0]
    evaluate(replace(SHORT, episodes=2), out=tmp_path, progress=False, fresh=True)
    assert ran == [1, 0, 0, 0, 1]


def saved(folder, gait=WALK):
    origin = Origin(algorithm="none", seed=0, steps=0)
    policy = SavedPolicy(task=WALKING, origin=origin, gait=gait, steering=(600.0,) * 4)
    return policy.save(folder / "best.json")


def test_a_saved_policy_is_known_by_its_contents(tmp_path):
    saved(tmp_path)
    evaluation = Evaluation(task=WALKING, policy=str(tmp_path), episodes=1, steps=3)
    key = evaluation.key()
    assert replace(evaluation, episodes=5, seed=3).key() == key
    assert replace(evaluation, policy=str(tmp_path / "best.json")).key() == key
    summary = evaluate(evaluation, progress=False)
    script = evaluate(replace(evaluation, policy="scripted"), progress=False)
    assert summary["episodes"] == script["episodes"]  # the file holds the script's gait
    saved(tmp_path, replace(WALK, period=5.0))
    assert evaluation.key() != key


def test_a_gaits_figures_are_those_of_the_episode():
    evaluation = Evaluation(task=WALKING, episodes=1, seed=4, steps=6, randomise=0.2)
    found = evaluate(evaluation, progress=False)["episodes"][0]
    env = TetrapodGait(action="power")
    observation, info = env.reset(seed=4, options={"randomise": 0.2})
    policy, total, hottest = actor("scripted", env), 0.0, 0.0
    for _ in range(6):
        observation, reward, *_, info = env.step(policy.act(observation))
        total, hottest = total + reward, max(hottest, info["temperature"].max())
    assert found["return"] == total and found["peak_temperature"] == hottest
    assert found["distance"] == info["distance"] and found["drift"] == abs(info["drift"])
    assert found["speed"] == pytest.approx(info["speed"]) and found["duration"] == info["time"]
    assert found["energy"] == pytest.approx(info["energy"].sum())
    mass = info["variation"]["mass"] * 21.862e-3
    assert found["weight"] == pytest.approx(9.81 * mass, rel=1e-3)
    assert found["success"] and found["ending"] == "time limit" and found["steps"] == 6


def test_success_of_a_gait_is_to_come_to_the_end(monkeypatch):
    monkeypatch.setattr(TetrapodGait, "max_temperature", 40.0)
    evaluation = Evaluation(task=WALKING, policy="random", episodes=1, steps=9)
    found = evaluate(evaluation, progress=False)["episodes"][0]
    assert not found["success"] and found["ending"].startswith("overheated") and found["steps"] < 9


@pytest.mark.parametrize("model", ["legs", "fine"])
def test_a_finer_model_is_the_same_robot(model):
    used = gym.make(WALKING).unwrapped
    env = Evaluation(task=WALKING, model=model).make()
    task = env.unwrapped
    mass = [float(t.model.body_subtreemass[t.stance.hub]) for t in (used, task)]
    assert mass[1] == pytest.approx(mass[0], rel=1e-6)
    assert task.model.nv == {"legs": 126, "fine": 270}[model] and used.model.nv == 42
    task.sim.reset(task.stance.placer(bend=1.5))
    assert task.stance.bend(task.data) == pytest.approx(1.5)
    if model == "fine":  # its three spines are in one shape: the welds are closed
        ends = [task.data.body(f"robot.{name}.{end}").xpos for name, end in WELDED(task)]
        assert np.abs(ends[0][1:] - ends[1][1:]).max() < 1e-6
    env.close()


def WELDED(task):
    """Bodies that the first weld joins."""
    import mujoco

    model = task.model
    weld = int(np.flatnonzero(model.eq_type == int(mujoco.mjtEq.mjEQ_WELD))[0])
    names = [model.body(int(i)).name for i in (model.eq_obj1id[weld], model.eq_obj2id[weld])]
    return [tuple(name.removeprefix("robot.").split(".", 1)) for name in names]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"task": "TCA/Nothing-v0"}, r"task must be one of \['TCA/ArmPickPlace-v0'"),
        ({"model": "fine"}, r"model must be one of \('used',\), got 'fine'"),
        (
            {"task": WALKING, "model": "coarse"},
            r"model must be one of \('used', 'legs', 'fine'\), got 'coarse'",
        ),
        ({"randomise": 0.6}, "randomise must be finite and at least 0 and at most 0.5, got 0.6"),
        ({"episodes": 0}, "episodes must be at least 1, got 0"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
        ({"steps": 0}, "steps must be at least 1, got 0"),
    ],
)
def test_bad_settings_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        replace(SHORT, **wrong)


def test_an_unknown_policy_is_said_before_anything_runs(tmp_path):
    with pytest.raises(FileNotFoundError, match="no shipped policy"):
        evaluate(replace(SHORT, policy="nobody"), out=tmp_path / "new", progress=False)
    with pytest.raises(FileNotFoundError, match=r"none of best\.json, best\.npz"):
        evaluate(replace(SHORT, policy=str(tmp_path)), out=tmp_path / "new", progress=False)
    (tmp_path / "last.npz").touch()
    with pytest.raises(FileNotFoundError, match=r"it stands at .*last\.npz"):
        evaluate(replace(SHORT, policy=str(tmp_path)), out=tmp_path / "new", progress=False)
    saved(tmp_path)
    with pytest.raises(ValueError, match="must be a policy for TCA/BendReach-v0, got "):
        evaluate(replace(SHORT, policy=str(tmp_path)), out=tmp_path / "new", progress=False)
    with pytest.raises(ValueError, match="workers must be at least 1, got 0"):
        evaluate(SHORT, workers=0)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("task", [task.id for task in TASKS])
@pytest.mark.parametrize("name", ["scripted", "off", "random"])
def test_everyone_can_act_in_every_task(task, name):
    env = make(task, **arguments_of(name, task))
    policy = actor(name, env, seed=1)
    observation, _ = env.reset(seed=0)
    policy.reset()
    action = policy.act(observation)
    assert env.action_space.contains(action) and isinstance(policy.phase, str)
    env.close()


def test_the_command_evaluates(tmp_path, capsys):
    command = ["eval", "off", "--task", REACH, "--episodes", "2", "--steps", "3",
               "--out", str(tmp_path)]  # fmt: skip
    assert cli.main(command) == 0
    said = capsys.readouterr().out
    assert "| energy [J] | 0.0 | 0.0 to 0.0 |" in said and "* 2 x time limit" in said
    assert cli.main(["eval", "nobody", "--task", REACH, "--out", str(tmp_path)]) == 2
    assert "no shipped policy" in capsys.readouterr().err


def test_any_policy_can_be_played(tmp_path, capsys):
    command = ["demo", "--policy", "off", "--task", REACH, "--no-video", "--out", str(tmp_path)]
    summary = play(REACH, "off", out=tmp_path, video=False, max_duration=0.3, progress=False)
    assert summary["duration"] == pytest.approx(0.3) and abs(summary["return"]) < 1e-6
    assert (tmp_path / "rollout.rrd").stat().st_size > 0
    assert json.loads((tmp_path / "summary.json").read_text())["policy"] == "off"
    for wrong in (command[:3], ["demo"], ["demo", "tetrapod", *command[1:5]]):
        assert cli.main(wrong) == 2
        assert "give a demo's name, or --policy and --task" in capsys.readouterr().err
    assert cli.main(["demo", "--policy", "nobody", "--task", REACH, "--out", str(tmp_path)]) == 2


def test_report_and_cells_have_units():
    summary = evaluate(replace(SHORT, episodes=2), progress=False)
    text = report(summary)
    assert "| peak temperature [°C] |" in text and "random in TCA/BendReach-v0, 2 episodes" in text
    figure = {"mean": 5e-3, "low": 4e-3, "high": 6e-3, "least": 0.0, "most": 0.0}
    assert cell("speed", figure) == "5.00 (4.00 to 6.00)"
    assert cell("speed", figure, interval=False) == "5.00"

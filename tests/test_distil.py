"""One policy of several: it does what each does with its options, and goes on where it stopped."""

import csv
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

import tca_mj
from tca_mj.agents.policies import Network, Origin, SavedPolicy
from tca_mj.agents.policies.contracts import contract
from tca_mj.agents.train import DistilConfig, Teacher, distil_config
from tca_mj.agents.train.distil import POLICY, distil
from tca_mj.cli import main
from tca_mj.envs.vector import TaskVector
from tca_mj.registry import episode_steps

TASK = "TCA/BendReach-v0"
MADE = {"action": "temperature", "control_period": 2.0}


def teacher(path, action, *, task=TASK, arguments=None, **change):
    """A policy that does the same whatever it sees."""
    arguments = arguments or MADE
    env = tca_mj.make(task, **arguments)
    seen, acts = env.observation_space.shape[0], env.action_space.shape[0]
    network = Network(
        weights=(np.zeros((acts, seen)),), biases=(np.broadcast_to(np.arctanh(action), acts),),
        mean=np.zeros(seen), var=np.ones(seen), squash="tanh",
    )  # fmt: skip
    saved = SavedPolicy(
        task=task, network=network, arguments=arguments, made_for=contract(env),
        origin=Origin(algorithm="hand", seed=None, steps=0),
    )  # fmt: skip
    env.close()
    return str(replace(saved, **change).save(path))


@pytest.fixture
def two(tmp_path):
    """Two that do different things to different targets."""
    left = teacher(tmp_path / "left.npz", np.array([0.6, -0.4, 0.0]))
    right = teacher(tmp_path / "right.npz", np.array([-0.7, 0.2, -0.3]))
    return (
        Teacher(policy=left, options={"rise": [0.9, 0.9, 0.1]}),
        Teacher(policy=right, options={"rise": [0.1, 0.4, 0.9]}),
    )


def tiny(teachers, **change):
    usual = {"envs": 4, "steps": 120, "gradient_steps": 120, "batch_size": 32, "hidden": (16,),
             "learning_rate": 0.02}  # fmt: skip
    return distil_config(TASK, teachers, **usual | change)


def written(folder):
    network = SavedPolicy.read(folder / POLICY).network
    return (folder / "curve.csv").read_bytes(), [each.tobytes() for each in network.weights]


def test_the_pupil_does_what_each_teacher_does_with_its_options(two, tmp_path):
    saved = distil(tiny(two), tmp_path / "run", progress=False)
    env = tca_mj.make(TASK, **saved.arguments)
    for each in two:
        seen, _ = env.reset(seed=99, options=each.options)
        policy = saved.make(env)
        for _ in range(3):
            action = policy.act(seen)
            assert action == pytest.approx(each.saved.network(seen), abs=0.1)
            seen, *_ = env.step(action)
    rows = list(csv.DictReader((tmp_path / "run" / "curve.csv").read_text().splitlines()))
    assert [float(row["steps"]) for row in rows] == [40, 80, 120]  # 10 in an episode of 20 s
    assert rows[0]["error"] == ""  # the teachers drive
    assert 0.0 < float(rows[2]["error"]) < 0.1 and {"error_0", "return_1"} < rows[0].keys()
    assert saved.origin.algorithm == "dagger" and saved.origin.steps == 120
    assert saved.made_for == contract(env) and "rise=" in saved.origin.source
    assert tca_mj.agents.policies.load_policy(tmp_path / "run", env)


def test_a_run_that_is_broken_off_ends_as_one_that_is_not(two, tmp_path, monkeypatch):
    config = tiny(two, envs=2, steps=60, gradient_steps=20)
    distil(config, tmp_path / "whole", progress=False)
    again = distil(config, tmp_path / "again", progress=False)
    assert written(tmp_path / "again") == written(tmp_path / "whole")
    other = distil(replace(config, seed=1), tmp_path / "other", progress=False)
    assert (again.network.weights[0] != other.network.weights[0]).any()
    advance, left = TaskVector.advance, 0

    def breaking(self, actions, which=None):
        nonlocal left
        left -= 1
        if left < 0:
            raise KeyboardInterrupt
        return advance(self, actions, which)

    monkeypatch.setattr(TaskVector, "advance", breaking)
    for left in (4, 17, 8, 99):  # noqa: B007
        with suppress(KeyboardInterrupt):
            distil(config, tmp_path / "parts", progress=False)
    assert written(tmp_path / "parts") == written(tmp_path / "whole")
    # Made longer it is what it would have been.
    distil(replace(config, steps=40), tmp_path / "short", progress=False)
    distil(config, tmp_path / "short", progress=False)
    assert written(tmp_path / "short") == written(tmp_path / "whole")


def test_settings_are_those_of_the_task(two):
    config = distil_config("TCA/TetrapodShapes-v0", two, options={"randomise": 0.1})
    assert config.options["randomise"] == 0.1 and config.options["bend_spread"] > 0.0
    assert config.timestep == 0.01
    assert distil_config(TASK, two).options == {}
    assert episode_steps(TASK, 2.0) == 10


def test_who_cannot_be_learned_from_is_refused(two, tmp_path):
    power = teacher(tmp_path / "power.npz", np.zeros(3), arguments={**MADE, "action": "power"})
    other = teacher(tmp_path / "other.npz", 0.0, task="TCA/MorphModule-v0")
    for policy, options, said in (
        (str(tmp_path / "none.npz"), {}, "no file"),
        ("tetrapod-walk", {}, "teacher must be a network, got tetrapod-walk, a gait"),
        (power, {}, "same arguments, got .*temperature.* and, of .*power.npz"),
        (other, {}, r"must see and do what TCA/BendReach-v0 has, got .*other.npz: observation"),
        (two[0].policy, {"targets": 1.0}, "options must be some of .*targets"),
    ):
        teachers = (two[0], Teacher(policy=policy, options=options))
        with pytest.raises((ValueError, FileNotFoundError), match=said):
            distil(tiny(teachers), tmp_path / "run", progress=False)
        assert not (tmp_path / "run").exists()
    for wrong, said in (
        ({"teachers": ()}, "teachers must be 1 to 64, got 0"),
        ({"task": "TCA/None-v0"}, "task must be one of"),
        ({"noise": 1.5}, "noise must be"),
        ({"arguments": {"timestep": ()}}, r"arguments\['timestep'\] must be values, got \(\)"),
    ):
        with pytest.raises(ValueError, match=said):
            DistilConfig(**{"task": TASK, "teachers": two} | wrong)


def test_another_teacher_of_the_same_name_is_noticed(two, tmp_path):
    distil(tiny(two, envs=2, steps=20), tmp_path / "run", progress=False)
    with pytest.raises(ValueError, match="holds a run with seed 0, not 1"):
        distil(tiny(two, envs=2, steps=20, seed=1), tmp_path / "run", progress=False)
    teacher(tmp_path / "left.npz", np.array([0.1, 0.1, 0.1]))
    with pytest.raises(ValueError, match="must hold a run with these teachers"):
        distil(tiny(two, envs=2, steps=20), tmp_path / "run", progress=False)


def test_the_command_says_what_it_did(two, tmp_path, capsys):
    left, right = (each.policy for each in two)
    asked = [f"{left}:rise=0.9,0.9,0.1", f"{right}:rise=0.1,0.4,0.9", "--task", TASK,
             "--steps", "40", "--envs", "2", "--argument", "timestep=0.005,0.01"]  # fmt: skip
    assert main(["distil", *asked, "--out", str(tmp_path / "run")]) == 0
    assert str(tmp_path / "run" / POLICY) in capsys.readouterr().out
    saved = SavedPolicy.read(tmp_path / "run" / POLICY)
    assert saved.origin.command.startswith(f"tca-mj distil {left}:rise=")
    assert saved.origin.command.endswith("timestep=0.005,0.01 --steps 40 --envs 2 --seed 0")
    rows = list(csv.DictReader((tmp_path / "run" / "curve.csv").read_text().splitlines()))
    assert [float(row["steps"]) for row in rows] == [40]  # two of each kind, 10 steps
    with pytest.raises(SystemExit):
        main(["distil", ":gait=walk", "--task", TASK])
    assert "must be POLICY:NAME=VALUE" in capsys.readouterr().err
    assert main(["distil", "tetrapod-walk", "--task", TASK, "--out", str(tmp_path / "no")]) == 2
    assert "must be a network" in capsys.readouterr().err

"""Sweeps: their settings and tables; with Ray, that a lost process costs nothing."""

import csv
import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from tca_mj import cli
from tca_mj.agents import cluster as clusters
from tca_mj.agents import sweep as module
from tca_mj.agents.design import designed, robot_of
from tca_mj.agents.evaluate import Evaluation
from tca_mj.agents.finished import EPISODES
from tca_mj.agents.policies import SavedPolicy, contract, shipped
from tca_mj.agents.sweep import TRIALS, Sweep, run_sweep
from tca_mj.robots.tetrapod import TetrapodSpec
from tca_mj.tca import CATALOGUE

REACH, WALK = "TCA/BendReach-v0", "TCA/TetrapodWalk-v0"
SHORT = Evaluation(task=REACH, policy="random", episodes=2, steps=3)


def one_by_one(trials, out, workers, address, failures):
    """In place of Ray: the trials one after the other in this process."""
    for trial in trials:
        trial.run(out / TRIALS / trial.name)
    return {}


def test_designs_are_single_figures():
    spec = TetrapodSpec()
    design = {"leg.length": 0.05, "leg.tca.pitch_angle": 0.25, "leg.tca": "type-2-180", "nodes": 3}
    other = designed(spec, design)
    assert other.leg.length == 0.05 and other.nodes == 3 and other.spine == spec.spine
    assert other.leg.tca == CATALOGUE["type-2-180"].of_pitch(0.25)
    assert robot_of(REACH, {"offset": 3e-3})["module_spec"].offset == 3e-3


@pytest.mark.parametrize(
    ("design", "message"),
    [
        ({"leg.size": 1.0}, r"design 'leg.size': the name must be one of \['length'"),
        ({"leg.length": "long"}, "design 'leg.length' must be a real number .* got 'long'"),
        ({"leg.tca": "no-such"}, "design 'leg.tca': tca must be .* one of .* got 'no-such'"),
        ({"leg.length": -1.0}, "length"),
    ],
)
def test_bad_designs_are_refused(design, message):
    with pytest.raises(ValueError, match=message):
        Evaluation(task=WALK, design=design)


def test_every_combination_is_run_and_tabled(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_tune", one_by_one)
    axes = {"design.length": (0.04, 0.05), "policy": ("off", "random")}
    sweep = Sweep(evaluation=SHORT, axes=axes)
    found = run_sweep(sweep, tmp_path)
    points = [{"design.length": length, "policy": who} for length in (0.04, 0.05)
              for who in ("off", "random")]  # fmt: skip
    assert [row["point"] for row in found] == points
    with (tmp_path / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["design.length"]) for row in rows] == [0.04, 0.04, 0.05, 0.05]
    assert [float(row["energy"]) > 0.1 for row in rows] == [False, True, False, True]
    assert float(rows[1]["return"]) != float(rows[3]["return"])  # another robot
    assert float(rows[1]["return_low"]) < float(rows[1]["return"]) < float(rows[1]["return_high"])
    page = (tmp_path / "results.md").read_text().splitlines()
    assert page[0].startswith("| design.length | policy | return | success [%] |")
    assert len(page) == 6
    # Called again with one value more, only what is missing is run.
    ran = []

    def counted(trials, *more):
        ran.extend(trial.point for trial in trials)
        return one_by_one(trials, *more)

    monkeypatch.setattr(module, "_tune", counted)
    more = Sweep(evaluation=SHORT, axes={"design.length": (0.04, 0.05), "policy": ("off",)})
    assert run_sweep(more, tmp_path) == [found[0], found[2]] and ran == []
    wider = Sweep(evaluation=SHORT, axes={"design.length": (0.04, 0.06), "policy": ("off",)})
    run_sweep(wider, tmp_path)
    assert ran == [{"design.length": 0.06, "policy": "off"}]


def test_several_tasks_are_an_axis(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(module, "_tune", one_by_one)
    command = ["sweep", "off", "--task", REACH, "--task", WALK, "--episodes", "2"]
    assert cli.main([*command, "--set", "steps=2", "--out", str(tmp_path)]) == 0
    with (tmp_path / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["task"] for row in rows] == [REACH, WALK]
    assert [bool(row["speed"]) for row in rows] == [False, True]  # a module gets nowhere
    assert (tmp_path / "results.png").stat().st_size > 10_000
    assert "results.png" in capsys.readouterr().out
    trained = Sweep(evaluation=SHORT, algorithm="sac", axes={"task": (REACH, WALK)})
    assert [trial.config().task for trial in trained.trials()] == [REACH, WALK]


def test_trials_that_fail_are_named_and_the_others_tabled(tmp_path, monkeypatch):
    def half(trials, out, *more):
        one_by_one(trials[:1], out, *more)
        return {"the second": "ValueError"}

    monkeypatch.setattr(module, "_tune", half)
    sweep = Sweep(evaluation=SHORT, axes={"seed": (0, 5)})
    with pytest.raises(RuntimeError, match="1 trials ended in an error: .*the second"):
        run_sweep(sweep, tmp_path)
    assert len((tmp_path / "results.csv").read_text().splitlines()) == 2


def test_settings_of_a_training_reach_it():
    pytest.importorskip("cmaes")
    sweep = Sweep(evaluation=Evaluation(task=WALK), algorithm="cma",
                  axes={"train.sigma": (0.02, 0.05), "train.seed": (3,)})  # fmt: skip
    configs = [trial.config() for trial in sweep.trials()]
    assert [config.sigma for config in configs] == [0.02, 0.05]
    assert all(config.seed == 3 and config.task == WALK for config in configs)
    folder = Path("somewhere")
    assert sweep.trials()[0].evaluation(folder).policy == "somewhere"
    assert len({trial.name for trial in sweep.trials()}) == 2
    deep = Sweep(evaluation=SHORT, algorithm="sac", axes={"train.learner.gamma": (0.9,),
                 "train.steps": (1000,)})  # fmt: skip
    config = deep.trials()[0].config()
    assert config.learner.gamma == 0.9 and config.steps == 1000 and config.task == REACH


def test_a_robot_and_what_moves_it_are_designed_together(tmp_path, monkeypatch):
    """Each length gets a training of its own, on that robot, and is evaluated on it."""
    pytest.importorskip("stable_baselines3")
    monkeypatch.setattr(module, "_tune", one_by_one)
    sweep = Sweep(evaluation=SHORT, algorithm="sac", axes={
        "train.design.length": (0.045, 0.05), "train.steps": (16,), "train.interval": (16,),
        "train.evaluation_episodes": (1,), "train.learner.learning_starts": (8,),
    })  # fmt: skip
    run_sweep(sweep, tmp_path)
    for trial, length in zip(sweep.trials(), (0.045, 0.05), strict=True):
        folder = tmp_path / TRIALS / trial.name
        policy = SavedPolicy.read(folder / "best.npz")
        assert policy.made_for["robot"]["length"] == length
        assert contract(trial.evaluation(folder).make())["robot"]["length"] == length
    assert len({trial.name for trial in sweep.trials()}) == 2
    aside = Sweep(evaluation=SHORT, algorithm="sac", axes={"design.length": (0.05,)})
    (trial,) = aside.trials()
    assert trial.config().design == {} and trial.evaluation(tmp_path).design == {"length": 0.05}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axes": {"size": (1,)}}, "'size' must be design.PATH, with an algorithm train.FIELD"),
        ({"axes": {"train.seed": (1,)}}, "'train.seed' must be design.PATH"),
        ({"axes": {"seed": ()}}, "seed must have one or more values, all different"),
        ({"axes": {"seed": (1, 1)}}, "seed must have one or more values, all different"),
        ({"axes": {"seed": (-1,)}}, "seed must be at least 0, got -1"),
        ({"axes": {}, "algorithm": "luck"}, "algorithm must be one of .* got 'luck'"),
        ({"axes": {"train.size": (1,)}, "algorithm": "sac"}, "change must be one of .* got 'size'"),
        ({"axes": {"policy": ("off",)}, "algorithm": "sac"}, "'policy' must be"),
        ({"axes": {"train.design.length": (0.05,)}}, "'train.design.length' must be design.PATH"),
        ({"axes": {"train.design.legnth": (0.05,)}, "algorithm": "sac"}, "did you mean 'length'"),
    ],
)
def test_bad_sweeps_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Sweep(**{"evaluation": SHORT, **change})


def test_the_command_sweeps(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "_tune", one_by_one)
    command = ["sweep", "off", "--task", REACH, "--episodes", "1", "--out", str(tmp_path)]
    assert cli.main([*command, "--set", "steps=2", "--set", "design.offset=0.003,0.004"]) == 0
    said = capsys.readouterr().out
    assert "| steps | design.offset | return |" in said and "| 2 | 0.003 |" in said
    assert cli.main([*command, "--set", "stepps=2"]) == 2
    assert cli.main([*command, "--algo", "sac"]) == 2
    assert cli.main([*command[:1], *command[2:]]) == 2
    with pytest.raises(SystemExit):
        cli.main([*command, "--set", "steps"])


def test_without_ray_it_says_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    command = ["sweep", "off", "--task", REACH, "--set", "steps=2", "--out", str(tmp_path)]
    assert cli.main(command) == 2
    assert "pip install 'ray[tune]>=2.50'" in capsys.readouterr().err


def descendants():
    """Ids and names of the processes that this one has started, by way of others too."""
    parents, names = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            names[int(folder.name)] = (folder / "cmdline").read_text()
        except OSError:
            continue  # it has just ended
        parents[int(folder.name)] = int(fields[1])
    found = {}
    for process, name in names.items():
        above = process
        while above in parents and above != os.getpid():
            above = parents[above]
        if above == os.getpid() != process:
            found[process] = name
    return found


def listening(processes):
    """Addresses on which processes wait for connections, hexadecimal as in /proc."""
    held = set()
    for process in processes:
        for link in Path(f"/proc/{process}/fd").glob("*"):
            with suppress(OSError):  # it was just closed
                held.add(os.readlink(link))
    rows = [line.split() for kind in ("tcp", "tcp6")
            for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]]  # fmt: skip
    return {row[1].partition(":")[0] for row in rows
            if row[3] == "0A" and f"socket:[{row[9]}]" in held}  # fmt: skip


# 127.0.0.1, and the same in IPv6's clothes; "everything" would be zeros.
LOOPBACK = {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_a_trial_whose_process_is_lost_goes_on(tmp_path, monkeypatch):
    """By Ray: a worker is killed outright as soon as it has finished an episode. Meanwhile nobody
    outside can connect, and nothing is left: no process, no folder, no token.
    """
    pytest.importorskip("ray")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    made = SavedPolicy.read(shipped()["bend-reach"]).save("policy.npz")
    evaluation = Evaluation(task=REACH, policy=str(made), episodes=4, steps=150)
    sweep = Sweep(evaluation=evaluation, axes={"seed": (0, 10)})
    killed, seen = [], set()

    def kill():
        while not over.wait(0.02):
            started = descendants()
            seen.update(listening(started))
            done = [path for path in tmp_path.glob(f"out/{TRIALS}/*/evaluation/{EPISODES}")
                    if path.stat().st_size]  # fmt: skip
            workers = [pid for pid, name in started.items() if name.startswith("ray::ImplicitFunc")]
            if done and workers and not killed:
                os.kill(workers[0], signal.SIGKILL)
                killed.append(workers[0])

    over = threading.Event()
    killer = threading.Thread(target=kill)
    killer.start()
    before = set(descendants())
    try:
        found = run_sweep(sweep, tmp_path / "out", workers=2)
    finally:
        over.set()
        killer.join()
    assert killed and seen and seen <= LOOPBACK
    for row, trial in zip(found, sweep.trials(), strict=True):
        assert row["figures"] == trial.run(tmp_path / "alone" / trial.name)["figures"]
        folder = tmp_path / "out" / TRIALS / trial.name
        lines = (folder / "evaluation" / EPISODES).read_text().splitlines()
        first = int(trial.point["seed"])
        seeds = [json.loads(line)["seed"] for line in lines]
        assert seeds == list(range(first, first + 4))  # what was finished was not run again
    left = set(descendants()) - before
    assert not [name for name in map(descendants().get, left) if name and "ray" in name]
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["ray", "results.csv", "results.md", "results.png", "sweep.json", "trials"]
    assert not (tmp_path / "home").exists()
    with clusters._temporary(tmp_path / "out") as own:
        assert [own] == list(own.parent.glob(f"{own.name[:-8]}*"))


def test_a_second_cluster_starts_in_the_same_process(tmp_path):
    """Ray remembers the token of the first one."""
    pytest.importorskip("ray")
    script = f"""
from pathlib import Path
import ray
from tca_mj.agents.cluster import cluster
for name in "ab":
    with cluster(Path({str(tmp_path)!r}, name), 1, None):
        print(ray.get(ray.remote(lambda: name.upper()).remote()))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=False
    )
    assert (done.returncode, done.stdout.split()) == (0, ["A", "B"]), done.stderr


def test_what_a_killed_sweep_left_of_ray_is_removed(tmp_path, monkeypatch):
    monkeypatch.setenv("RAY_TMPDIR", str(tmp_path))
    monkeypatch.setattr(clusters, "_SHORT", 1000)
    with clusters._temporary(tmp_path / "out") as first, clusters._temporary(tmp_path / "other"):
        (first / "session").mkdir()
        with clusters._temporary(tmp_path / "out") as second:
            assert not first.exists() and first.name[:-8] == second.name[:-8]
            assert len(list(tmp_path.iterdir())) == 2
    assert list(tmp_path.iterdir()) == []

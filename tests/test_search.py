"""The search for gaits: the space, the score, and that a run that was killed goes on unchanged."""

import csv
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from tca_mj.agents.policies import Origin, SavedPolicy
from tca_mj.agents.scripts.tetrapod import GAITS, STEERING, WALK
from tca_mj.agents.train import search as searching
from tca_mj.agents.train.gait_score import Headway, Reference, Trial, run_trial, score
from tca_mj.agents.train.gait_space import PERIOD, GaitSpace
from tca_mj.agents.train.search import TROT, SearchConfig, search
from tca_mj.agents.workers import Workers
from tca_mj.cli import main

FIRST = cache(searching.first_gait)  # for which a robot is built
EVERY = GAITS | {"trot": replace(WALK, offset=TROT)}


@pytest.mark.parametrize("name", EVERY)
def test_a_gait_comes_back_from_its_point(name):
    gait = EVERY[name]
    steering = (STEERING.get(name, 100.0),) * 4
    space = GaitSpace(centre=gait, hottest=172.0)
    point = space.encode(gait, steering)
    cyclic = [i for i, n in enumerate(space.names) if "offset" in n or "start" in n]
    np.testing.assert_allclose(point[cyclic], 0.5, atol=1e-12)
    back, steered = space.decode(point)
    phase = np.arange(0.0013, 1.0, 0.01)
    np.testing.assert_allclose(back.temperature(phase), gait.temperature(phase), rtol=1e-12)
    assert back.period == pytest.approx(gait.period) and steered == pytest.approx(steering)


def test_points_come_back_from_their_gaits_about_any_centre():
    rng = np.random.default_rng(0)
    space, other = (GaitSpace(centre=gait, hottest=172.0) for gait in (WALK, EVERY["crawl"]))
    for point in rng.uniform(0.0, 1.0, (50, len(space.names))):
        gait, steering = space.decode(point)
        np.testing.assert_allclose(space.encode(gait, steering), point, atol=1e-9)
        assert PERIOD[0] <= gait.period <= PERIOD[1]
        assert np.max(gait.table("hot")) <= 172.0
        # About another centre the gait is the same, begun at another time.
        again, _ = other.decode(other.encode(gait, steering))
        shift = (again.offset[0] - again.table("start")[0, 0]) - (
            gait.offset[0] - gait.table("start")[0, 0]
        )
        phase = np.arange(0.0013, 1.0, 0.02)
        same = again.temperature(phase - shift) - gait.temperature(phase)
        assert np.mean(np.abs(same) > 1e-6) < 0.01  # but for roundings at a switch


def test_folding_goes_round_and_back():
    space = GaitSpace(centre=WALK, hottest=172.0)
    folded = dict(zip(space.names, space.fold(np.full(len(space.names), 1.1)), strict=True))
    assert folded["offset1"] == folded["rear.start2"] == pytest.approx(0.1)
    assert folded["period"] == folded["front.hot0"] == pytest.approx(0.9)
    below = dict(zip(space.names, space.fold(np.full(len(space.names), -0.2)), strict=True))
    assert below["offset3"] == pytest.approx(0.8) and below["rear.warm1"] == pytest.approx(0.2)


def test_a_lopsided_gait_is_no_centre():
    lopsided = replace(WALK, hot=(WALK.hot, (150.0, 160.0, 150.0)) * 2)
    with pytest.raises(ValueError, match="hot must be the same left and right"):
        GaitSpace(centre=lopsided, hottest=172.0)
    with pytest.raises(ValueError, match="steering must be the same left and right"):
        GaitSpace(centre=WALK, hottest=172.0).encode(WALK, (1.0, 2.0, 3.0, 3.0))
    with pytest.raises(ValueError, match="point must be finite and at least 0 and at most 1"):
        GaitSpace(centre=WALK, hottest=172.0).decode(np.full(28, 1.5))


GOOD = Headway(
    speed=6e-3, aside=0.0, power=16.0, temperature=172.0, tension=0.4, missed=0.0, steps=100
)
SCRIPTED = Reference(speed=5e-3, power=16.0)


@pytest.mark.parametrize(
    ("change", "term", "value"),
    [
        ({}, "speed", 1.2),
        ({"power": 19.2}, "energy", -2.0 * (1.2 - 0.98 * 1.2)),
        ({"aside": -1.8e-3}, "drift", -2.0 * (0.3 - 0.1)),
        ({"temperature": 179.0}, "heat", -0.3),
        ({"tension": 0.75}, "tension", -0.5),
        ({"missed": 0.25}, "fall", -1.25),
    ],
)
def test_each_term_of_the_score(change, term, value):
    clean = score([GOOD], SCRIPTED)
    assert clean["score"] == clean["speed"] == pytest.approx(1.2)
    judged = score([replace(GOOD, **change)], SCRIPTED)
    assert judged[term] == pytest.approx(value)
    assert judged["score"] == pytest.approx(1.2 + (0.0 if term == "speed" else value))
    both = score([GOOD, replace(GOOD, **change)], SCRIPTED)
    if term not in ("speed", "energy", "drift"):  # these are charged from a limit of the mean on
        assert both[term] == pytest.approx(value / 2.0)


def brief(**change):
    quick = replace(WALK, period=2.0)
    good = {"task": "TCA/TetrapodWalk-v0", "gait": quick, "steering": (600.0,) * 4, "seed": 2,
            "options": {"randomise": 0.2}, "settling": 2.0, "window": 2.0}  # fmt: skip
    return Trial(**good | change)


def test_a_trial_depends_on_itself_alone():
    first = run_trial(brief())
    assert first.steps == 40 and first.missed == 0.0
    assert run_trial(brief(seed=3)) != first
    assert run_trial(brief()) == first


def test_a_trial_that_ends_early_says_how_much_it_missed(monkeypatch):
    """A TCA at 172 °C is too hot if 150 °C is the limit."""
    monkeypatch.setattr("tca_mj.envs.tetrapod.TetrapodGait.max_temperature", 100.0)
    found = run_trial(brief())
    assert 0 < found.steps < 40
    assert found.missed == pytest.approx(1.0 - found.steps / 40.0)


class Model:
    """Stands for ``Workers``: a speed that falls with the distance from a hidden gait."""

    def __init__(self, stop_after: int | None = None) -> None:
        self.left, self.done = stop_after, 0

    def __call__(self, workers):
        return self

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def run(self, function, jobs):
        space = GaitSpace(centre=WALK, hottest=172.0)
        for i, (job,) in reversed(list(enumerate(jobs))):
            if self.left is not None and self.done >= self.left:
                raise KeyboardInterrupt
            self.done += 1
            away = space.encode(job.gait, job.steering) - space.encode(WALK, (600.0,) * 4) - 0.1
            noise = 1.0 + 1e-3 * (job.seed % 7)
            yield i, replace(GOOD, speed=5e-3 * noise * (2.0 - float(away @ away)))


WALKING = "TCA/TetrapodWalk-v0"
TINY = SearchConfig(
    task=WALKING, steps=9000, population=8, episodes=2, validate_every=3, validation_episodes=2
)


@pytest.fixture(autouse=True)
def built_once(monkeypatch):
    monkeypatch.setattr(searching, "first_gait", FIRST)


@pytest.mark.usefixtures("without_board")
def test_a_search_that_is_stopped_anywhere_goes_on_with_nothing_lost(monkeypatch, tmp_path):
    whole = Model()
    monkeypatch.setattr(searching, "Workers", whole)
    expected = search(TINY, tmp_path / "whole", progress=False)
    assert whole.done == 2 + 2 + 5 * 18 + 2 * 2
    curve = (tmp_path / "whole" / "curve.csv").read_bytes()
    rows = list(csv.DictReader(curve.decode().splitlines()))
    assert int(rows[-1]["steps"]) >= 8800 and len(rows) == 5
    assert float(rows[-1]["best_score"]) > float(rows[0]["top_score"]) - 0.1

    parts, found = [], None
    while found is None:
        parts.append(Model(stop_after=9))
        monkeypatch.setattr(searching, "Workers", parts[-1])
        try:
            found = search(TINY, tmp_path / "parts", progress=False)
        except KeyboardInterrupt:
            assert len(parts) < 20
    assert len(parts) == 11 and sum(part.done for part in parts) == whole.done  # none ran twice
    assert found == expected
    assert (tmp_path / "parts" / "curve.csv").read_bytes() == curve


def test_a_gait_is_searched_for_the_robot_of_a_design(monkeypatch, tmp_path):
    """Every episode is walked by that robot, the gait says so, and no other run goes on with it."""
    asked = []

    class Noted(Model):
        def run(self, function, jobs):
            asked.extend(job.robot for (job,) in jobs)
            return super().run(function, jobs)

    monkeypatch.setattr(searching, "Workers", Noted())
    config = replace(TINY, steps=1, design={"leg.length": 0.06})
    found = search(config, tmp_path, progress=False)
    assert found.made_for["robot"]["leg.length"] == 0.06
    assert {robot["robot"].leg.length for robot in asked} == {0.06}
    with pytest.raises(ValueError, match="design"):
        search(replace(config, design={}), tmp_path, progress=False)
    with pytest.raises(ValueError, match="did you mean 'length'"):
        replace(TINY, design={"leg.lenght": 0.06})


def test_tensorboard_has_every_point_once(monkeypatch, tmp_path):
    found = None
    for stop in range(20, 200, 20):
        monkeypatch.setattr(searching, "Workers", Model(stop_after=stop))
        try:
            found = search(TINY, tmp_path, progress=False)
        except KeyboardInterrupt:
            assert found is None
    monkeypatch.setattr(searching, "Workers", Model())
    assert search(TINY, tmp_path, progress=False) == found  # there is nothing to do
    rows = list(csv.DictReader((tmp_path / "curve.csv").read_text().splitlines()))
    shown = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    for name in ("score_mean", "validation_score"):
        points = [(event.step, event.value) for event in shown.Scalars(f"search/{name}")]
        some = [row for row in rows if row[name]]
        assert len(some) >= 2 and [step for step, _ in points] == [int(r["steps"]) for r in some]
        assert [value for _, value in points] == pytest.approx([float(r[name]) for r in some])


@pytest.mark.usefixtures("without_board")
def test_a_search_finds_what_is_better(monkeypatch, tmp_path):
    monkeypatch.setattr(searching, "Workers", Model())
    config = replace(TINY, steps=60_000, sigma=0.1)
    found = search(config, tmp_path, progress=False)
    best = brief(gait=found.gait, steering=found.steering)
    reached, start = (
        score([r for _, r in Model().run(run_trial, [(trial,)])], SCRIPTED)["speed"]
        for trial in (best, brief(gait=WALK))
    )
    assert start == pytest.approx(1.72, abs=0.01) and reached > start + 0.1
    assert SavedPolicy.read(tmp_path / "best.json") == found
    # It can be made longer, and not be taken for another run.
    longer = search(replace(config, steps=62_000), tmp_path, progress=False)
    assert longer.origin.steps > found.origin.steps
    with pytest.raises(ValueError, match="holds a run with seed 0, not 1"):
        search(replace(config, seed=1), tmp_path, progress=False)


SCRIPT = """
import sys
from pathlib import Path
from tca_mj.agents.train.search import SearchConfig, search
search(SearchConfig(**eval(sys.argv[1])), Path(sys.argv[2]), workers=2)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
@pytest.mark.usefixtures("without_board")
def test_a_killed_search_goes_on_to_the_same_curve(tmp_path):
    """By kill -9, with two processes that end with it; the other run has one and no break."""
    origin = Origin(algorithm="by hand", seed=0, steps=0)
    start = SavedPolicy(task=TINY.task, origin=origin, gait=replace(WALK, period=2.0),
                        steering=(600.0,) * 4).save(tmp_path / "start.json")  # fmt: skip
    settings = {"task": WALKING, "start": str(start), "steps": 160, "population": 5, "episodes": 1,
                "settling": 0.0, "window": 2.0, "validation_episodes": 1,
                "validate_every": 2}  # fmt: skip
    out = tmp_path / "killed"
    command = [sys.executable, "-c", SCRIPT, repr(settings), str(out)]
    run = subprocess.Popen(command, start_new_session=True)
    deadline = time.monotonic() + 600.0  # only against hanging
    curve = out / "curve.csv"
    while not (curve.is_file() and b"\n1," in curve.read_bytes()):
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    while True:  # the workers notice
        try:
            os.killpg(run.pid, 0)
        except ProcessLookupError:
            break
        assert time.monotonic() < deadline
        time.sleep(0.05)
    config = SearchConfig(**settings)
    found = search(config, out, workers=1, progress=False)
    expected = search(config, tmp_path / "whole", workers=1, progress=False)
    assert found == expected
    assert curve.read_bytes() == (tmp_path / "whole" / "curve.csv").read_bytes()
    assert list((out / "tensorboard").iterdir())


def test_an_error_in_a_process_arrives_and_so_does_its_end():
    with Workers(2) as workers:
        with pytest.raises(ValueError, match="randomise must be"):
            list(workers.run(run_trial, [(brief(options={"randomise": 0.9}),)]))
        for process in workers._processes:
            process.kill()
        with pytest.raises(ChildProcessError, match="a process that ran episodes has ended"):
            list(workers.run(run_trial, [(brief(),), (brief(),)]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": "TCA/ArmPickPlace-v0"}, "task must have four legs"),
        ({"steps": 0}, "steps must be"),
        ({"population": 4}, "population must be at least 5"),
        ({"sigma": 0.0}, "sigma must be finite and above 0"),
        ({"options": 0.2}, "options must be"),
        ({"window": 26.0}, "window must be finite and at least 0.1 and at most 25 s"),
    ],
)
def test_impossible_settings_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        SearchConfig(**{"task": WALKING} | change)


def test_the_command_teaches_and_refuses(tmp_path, capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["train", "--help"])
    assert "the same command again goes on" in capsys.readouterr().out
    out = ["--out", str(tmp_path / "run")]
    assert main(["train", "TCA/ArmPickPlace-v0", "--algo", "cma", *out]) == 2
    assert "task must have four legs" in capsys.readouterr().err
    walk = ["train", "TCA/TetrapodWalk-v0", "--algo", "cma"]
    assert main([*walk, "--start", "nobody", *out]) == 2
    assert "no shipped policy of that name" in capsys.readouterr().err
    assert not Path(out[1]).exists()
    for wrong in (["--steps", "0"], ["--seed", "1", "--seeds", "2"], ["--algo", "guess"]):
        with pytest.raises(SystemExit, match="2"):
            main([*walk, *wrong])


def test_the_command_runs_one_search_for_each_seed(monkeypatch, tmp_path):
    asked = []

    def called(config, out, *, workers, command, address):
        asked.append((config.seed, config.steps, out.name, workers, command, address))

    monkeypatch.setattr(searching, "search", called)
    arguments = ["train", "TCA/TetrapodWalk-v0", "--algo", "cma", "--seeds", "2", "--steps", "9"]
    assert main([*arguments, "--out", str(tmp_path), "--workers", "3"]) == 0
    command = "tca-mj train TCA/TetrapodWalk-v0 --algo cma --steps 9 --seeds 2"
    assert asked == [(seed, 9, f"seed_{seed}", 3, command, None) for seed in (0, 1)]

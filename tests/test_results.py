"""The page of results: written by its script, and still what the policies do."""

import json
import runpy
from pathlib import Path

import pytest

from tca_mj.agents.evaluate import METRICS, Evaluation, evaluate
from tca_mj.agents.policies import SavedPolicy, shipped
from tca_mj.registry import TASKS

ROOT = Path(__file__).resolve().parent.parent
RESULTS = json.loads((ROOT / "docs" / "results.json").read_text(encoding="utf-8"))
SHARE = 0.6  # of the documented figure, in an episode that is half as long and begins cold
GAITS = [task.id for task in TASKS if "gait" in task.kwargs]


def documented():
    """Task, agent and figures of all that do something on purpose."""
    for task, agents in RESULTS.items():
        for name, conditions in agents.items():
            if name not in ("random", "off") and "nominal" in conditions:
                yield task, name, conditions["nominal"]["figures"]


def test_the_page_is_what_its_script_makes_of_the_data():
    script = runpy.run_path(str(ROOT / "scripts" / "results_page.py"))
    page = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    for task, found in RESULTS.items():
        assert "\n".join(script["table"](task, found)) in page
    assert script["INTRODUCTION"] in page
    training = (ROOT / "docs" / "training.md").read_text(encoding="utf-8")
    assert "\n".join(script["shipped_table"](RESULTS)) in training
    tetrapod = (ROOT / "docs" / "tetrapod.md").read_text(encoding="utf-8")
    assert "\n".join(script["scripts_table"](RESULTS)) in tetrapod
    model = (ROOT / "docs" / "tetrapod-model.md").read_text(encoding="utf-8")
    assert "\n".join(script["models_table"](RESULTS)) in model
    names = {name for shown in script["SHOWN"].values() for name in shown}
    assert names <= METRICS.keys()


def test_every_shipped_policy_is_on_the_page():
    """If not: python scripts/results_page.py"""
    there = {(task, name) for task, name, _ in documented()}
    files = {(SavedPolicy.read(path).task, name) for name, path in shipped().items()}
    assert files - there == set()
    assert {name for _, name in there} - {"scripted"} <= set(shipped())


@pytest.mark.parametrize(
    ("task", "name", "figures"),
    [pytest.param(*each, id=f"{each[0]}-{each[1]}") for each in documented() if each[0] in GAITS],
)
def test_a_gait_is_about_as_fast_as_documented(task, name, figures):
    settings = Evaluation(task=task, policy=name, episodes=1, steps=300)
    found = evaluate(settings, progress=False)["episodes"][0]
    assert found["success"]
    assert found["speed"] >= SHARE * figures["speed"]["mean"]
    assert found["peak_temperature"] <= figures["peak_temperature"]["most"] + 5.0


@pytest.mark.parametrize(
    ("task", "name", "figures"),
    [pytest.param(*each, id=f"{each[0]}-{each[1]}")
     for each in documented() if each[0] == "TCA/BendReach-v0"],
)  # fmt: skip
def test_a_target_is_reached_about_as_often_as_documented(task, name, figures):
    settings = Evaluation(task=task, policy=name, episodes=2, seed=100)
    found = evaluate(settings, progress=False)["figures"]
    assert found["success"]["mean"] >= SHARE * figures["success"]["mean"]


def test_the_page_of_gaits_is_what_its_script_makes_of_the_data():
    script = runpy.run_path(str(ROOT / "scripts" / "gait_page.py"))
    results = json.loads((ROOT / "docs" / "gaits.json").read_text(encoding="utf-8"))
    page = (ROOT / "docs" / "gaits.md").read_text(encoding="utf-8")
    assert script["INTRODUCTION"] in page and script["BY_HAND"] in page
    for found in results.values():
        assert "\n".join(script["table"](script["HEADS"], script["rows_of"](found))) in page
        assert len(found["seeds"]) == len(script["SEEDS"]) == 5


def test_the_page_of_shapes_is_what_its_script_makes_of_the_data(tmp_path, monkeypatch):
    """After a change: python scripts/shapes_page.py --page."""
    script = runpy.run_path(str(ROOT / "scripts" / "shapes_page.py"))
    page = tmp_path / "shapes.md"
    page.write_text(script["PAGE"].read_text(encoding="utf-8"), encoding="utf-8")
    kept = json.loads(script["DATA"].read_text(encoding="utf-8"))
    monkeypatch.setitem(script["write_page"].__globals__, "PAGE", page)
    script["write_page"](kept)
    assert page.read_text(encoding="utf-8") == script["PAGE"].read_text(encoding="utf-8")
    for kind in script["ROBOTS"]:
        for gait in script["TASKS"]:
            assert sum(script["shares"](kept, kind, gait)) / len(kept) >= 0.9

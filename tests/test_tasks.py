"""Every task of the registry, and one outside the package, keeps what tasks have to keep."""

from pathlib import Path

import pytest

from tca_mj.envs.morph import OBSERVATION, MorphModule
from tca_mj.envs.task import Verdict
from tca_mj.registry import TASKS
from tca_mj.testing import CHECKS, check_task

OUTSIDE = "own_task:Example/Nod-v0"
IDS = [*(task.id for task in TASKS), OUTSIDE]


@pytest.fixture(autouse=True)
def quiet(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent / "examples"))
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log of what diverges


@pytest.mark.parametrize("check", CHECKS)
@pytest.mark.parametrize("id", IDS)
def test_a_task_keeps_what_tasks_have_to(id, check):
    CHECKS[check](id)


def planted_reward(self, drive, harmed):
    return Verdict(terms={"bonus": 1.0})


def planted_start(self, setup):
    PREPARE(self, setup)
    PREPARED.append(0)
    self.target -= 1e-6 * len(PREPARED)  # depends on how many episodes there were


PREPARE, PREPARED = MorphModule.prepare, []


@pytest.mark.parametrize(
    ("check", "attribute", "planted", "said"),
    [
        ("tables", "observe", lambda self: dict.fromkeys(OBSERVATION.slices, -9.0), "out of"),
        ("tables", "_info", lambda self, success: {"time": 0.0}, "info lacks"),
        ("reward", "judge", planted_reward, "terms are not those of the class"),
        ("seeds", "prepare", planted_start, "the same seed gives other bits"),
        ("state", "_episode", lambda self: {}, "a state that was taken back leads elsewhere"),
    ],
)
def test_what_is_not_kept_is_said(monkeypatch, check, attribute, planted, said):
    """A planted error is found, and by what it breaks."""
    monkeypatch.setattr(MorphModule, attribute, planted)
    with pytest.raises(AssertionError, match=said):
        CHECKS[check]("TCA/MorphModule-v0")


def test_a_task_that_does_not_exist_is_no_task():
    with pytest.raises(ValueError, match="task must be one of"):
        check_task("TCA/Nothing-v0")

"""Every task of the registry, and one outside the package, keeps what tasks have to keep."""

from pathlib import Path

import pytest

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


def test_what_is_not_kept_is_said(monkeypatch):
    """A planted error in each of four places is found by the check of that name."""
    from tca_mj.envs.morph import MorphModule

    id = "TCA/MorphModule-v0"
    judge, prepare = MorphModule.judge, MorphModule.prepare

    def unstable(self, setup):
        prepare(self, setup)
        self.target += 1e-9 * id_of_episode.pop()

    id_of_episode = list(range(1000))
    for name, attribute, planted in (
        ("tables", "details", lambda self: {"time": self.sim.time, "energy": 0.0}),
        ("reward", "energy_price", 0.02),
        ("seeds", "prepare", unstable),
        ("state", "_episode", lambda self: {}),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(MorphModule, attribute, planted)
            if name == "reward":
                patch.setattr(MorphModule, "judge", lambda self, drive, harmed: judge(
                    self, drive, harmed).__class__(terms={"more": 1.0}))  # fmt: skip
            with pytest.raises((AssertionError, AttributeError, TypeError)):
                CHECKS[name](id)
    with pytest.raises(ValueError, match="task must be one of"):
        check_task("TCA/Nothing-v0")

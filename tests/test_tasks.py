"""Every task of the registry, and one outside the package, keeps what tasks have to keep."""

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from tca_mj.envs.morph import OBSERVATION, MorphModule
from tca_mj.envs.outcome import Verdict
from tca_mj.envs.table import Entry, Table
from tca_mj.registry import TASKS
from tca_mj.testing import CHECKS, check_task

OUTSIDE = "own_task:Example/Turn-v0"
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


# Options that make the start of an episode its own mirror image, and those of the mirror image.
MIRRORED = {
    "TCA/AdaptiveGrasp-v0": ({"object": "can", "object_position": [1e-3, 3e-4]},
                             {"object": "can", "object_position": [-1e-3, 3e-4]}),
    "TCA/BendReach-v0": ({"rise": [0.3, 0.8, 0.1]}, {"rise": [0.3, 0.1, 0.8]}),
    # So weak that nothing snaps: a snap makes more of a rounding.
    "TCA/BistableGrasp-v0": ({"object_position": [8e-4, 3e-4], "goal": 0.02, "tca_gain": 0.5},
                             {"object_position": [-8e-4, 3e-4], "goal": 0.02, "tca_gain": 0.5}),
    "TCA/Grasp-v0": ({"object_position": [8e-4, 3e-4]}, {"object_position": [-8e-4, 3e-4]}),
    "TCA/TetrapodCourse-v0": ({"position": [0.0, 2e-3], "yaw": 0.02},
                              {"position": [0.0, -2e-3], "yaw": -0.02}),
    "TCA/TetrapodShapes-v0": ({"gait": "shimmy", "yaw": 0.0, "direction": 0.0},) * 2,
    **{
        f"TCA/Tetrapod{gait}-v0": ({"yaw": yaw, "bend": bend, "direction": direction},
                                   {"yaw": -yaw, "bend": bend, "direction": -direction})
        for gait, bend, yaw, direction in (
            ("Crawl", 0.35, 0.02, 0.7), ("Walk", 1.62, 0.02, -0.4), ("Shimmy", 3.75, 0.0, 0.0),
        )
    },
}  # fmt: skip


@pytest.mark.parametrize("id", MIRRORED)
def test_the_mirror_that_a_task_declares_is_that_of_its_physics(id):
    """Mirrored actions from the mirrored start lead to mirrored observations."""
    one, other = (gym.make(id, disable_env_checker=True).unwrapped for _ in range(2))
    seen, image = (
        task.reset(seed=0, options=options)[0]
        for task, options in zip((one, other), MIRRORED[id], strict=True)
    )
    random = np.random.default_rng(0)
    for number in range(12):
        assert one.observation.mirrored(seen) == pytest.approx(image, rel=1e-4, abs=1e-5), number
        action = random.uniform(-1.0, 1.0, one.action.size).astype(np.float32)
        seen, *_ = one.step(action)
        image, *_ = other.step(one.action.mirrored(action))


def test_pairs_are_what_a_mirror_swaps():
    table = gym.make("TCA/TetrapodWalk-v0", disable_env_checker=True).unwrapped.action
    told = np.random.default_rng(0).uniform(-1.0, 1.0, 6)[table.pairs]
    np.testing.assert_array_equal(table.mirrored(told), told)
    assert sorted(table.pairs) == sorted(2 * [*range(6)])
    turned = Table([Entry("turn", 2, -1.0, 1.0, "rad", mirror=(-2, -1))])
    with pytest.raises(ValueError, match="mirror without signs"):
        _ = turned.pairs


@pytest.mark.parametrize("id", [task.id for task in TASKS])
def test_every_task_says_whether_left_and_right_are_alike(id):
    task = gym.make(id, disable_env_checker=True).unwrapped
    assert task.observation.symmetric == task.action.symmetric == (id in MIRRORED)
    if id not in MIRRORED:
        with pytest.raises(ValueError, match="mirror"):
            task.action.mirrored(task.action.still)

"""The vector environment of every task: bit for bit Gymnasium's own over the single tasks."""

import pickle
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from tca_mj.envs.vector import TaskVector
from tca_mj.record.render import RenderingUnavailable
from tca_mj.registry import TASKS

IDS = [task.id for task in TASKS]
QUICK = "TCA/MorphModule-v0"  # the task whose step takes a millisecond


def native(id: str, n: int, **kwargs: Any) -> TaskVector:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = gym.make_vec(id, num_envs=n, **kwargs)
    assert isinstance(envs, TaskVector)
    return envs


def serial(id: str, n: int, mode: AutoresetMode = AutoresetMode.SAME_STEP, **kwargs: Any):
    return SyncVectorEnv([lambda: gym.make(id, **kwargs)] * n, autoreset_mode=mode)


def options_of(envs: TaskVector) -> dict[str, float] | None:
    """Robots that are off by as much as they may be, where a task has such an option."""
    try:
        envs.envs[0].reset(options={"randomise": 0.2})
    except ValueError:
        return None
    return {"randomise": 0.2}


def same(a: Any, b: Any) -> bool:
    """Equal in type, shape and every bit, at any depth."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(*pair) for pair in zip(a, b, strict=True))
    if isinstance(a, np.ndarray):
        if not (isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape):
            return False
        return same(a.tolist(), b.tolist()) if a.dtype == object else a.tobytes() == b.tobytes()
    return type(a) is type(b) and a == b


def differing(a: Any, b: Any) -> list[str]:
    """Which parts of two results of ``reset`` or ``step`` are not the same."""
    names = ["observations", "rewards", "terminated", "truncated", "infos"]
    names = names if len(a) == 5 else [names[0], names[-1]]
    parts = {n: (x, y) for n, x, y in zip(names, a, b, strict=True) if not same(x, y)}
    keys = [k for k in parts.get("infos", [{}])[0] if not same(*(i.get(k) for i in parts["infos"]))]
    return [*parts, *keys]


@pytest.mark.parametrize("id", IDS)
def test_every_task_is_bit_for_bit_the_single_one(id):
    """200 steps of two tasks, their episodes cut short so that four end by time alone."""
    n, steps, limit = 2, 100, 40
    ours = native(id, n, num_threads=2, max_episode_steps=limit)
    theirs = serial(id, n, max_episode_steps=limit)
    options, actions = options_of(ours), np.random.default_rng(1)
    seeds = [7, 100]
    first = [envs.reset(seed=seeds, options=options) for envs in (ours, theirs)]
    assert differing(*first) == []
    ends = 0
    for k in range(steps):
        action = actions.uniform(-1.0, 1.0, ours.action_space.shape).astype(np.float32)
        a, b = ours.step(action), theirs.step(action)
        assert (k, differing(a, b)) == (k, [])
        ends += int((a[2] | a[3]).sum())
    assert ends >= n * (steps // limit)
    ours.close()
    theirs.close()


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("n", [1, 4])
def test_every_autoreset_mode_is_gymnasiums(mode, n):
    ours = native(QUICK, n, num_threads=2, max_episode_steps=9, autoreset_mode=mode)
    theirs = serial(QUICK, n, mode, max_episode_steps=9)
    assert ours.metadata["autoreset_mode"] is mode
    actions = np.random.default_rng(0)
    assert differing(ours.reset(seed=3), theirs.reset(seed=3)) == []
    for _ in range(150):
        action = actions.uniform(-1.0, 0.0, ours.action_space.shape).astype(np.float32)
        a, b = ours.step(action), theirs.step(action)
        assert differing(a, b) == []
        over = a[2] | a[3]
        if mode is AutoresetMode.DISABLED and over.any():
            with pytest.raises(ResetNeeded, match="over"):
                ours.step(action)
            again = [envs.reset(options={"reset_mask": over.copy()}) for envs in (ours, theirs)]
            assert differing(*again) == []


def test_one_that_diverges_ends_as_alone_and_the_others_go_on():
    ours, theirs = native(QUICK, 3, num_threads=2), serial(QUICK, 3)
    for envs in (ours, theirs):
        envs.reset(seed=0)
    off = -np.ones(ours.action_space.shape, dtype=np.float32)
    for k in range(6):
        if k in (2, 4):
            for envs in (ours, theirs):
                envs.envs[1].unwrapped.data.qvel[:] = np.nan
        a, b = ours.step(off), theirs.step(off)
        assert differing(a, b) == []
        assert a[3].tolist() == [False, k in (2, 4), False]
        if a[3].any():
            assert a[4]["final_info"]["truncation_reason"][1].startswith("diverged")


def test_a_reset_of_some_leaves_the_others_where_they_are():
    ours, theirs = native(QUICK, 3), serial(QUICK, 3)
    for envs in (ours, theirs):
        envs.reset(seed=0)
    off = -np.ones(ours.action_space.shape, dtype=np.float32)
    mask = np.array([False, True, False])
    for k in range(8):
        if k == 4:
            given = {"reset_mask": mask, "start": 0.5}
            again = [envs.reset(seed=[9, 8, 7], options=dict(given)) for envs in (ours, theirs)]
            assert differing(*again) == []
            assert given["reset_mask"] is mask
        assert differing(ours.step(off), theirs.step(off)) == []
    bad: Any
    for bad, error in (
        ([True] * 3, TypeError), (np.ones(3), TypeError), (np.ones(2, bool), ValueError),
        (np.zeros(3, bool), ValueError),
    ):  # fmt: skip
        with pytest.raises(error, match="reset_mask"):
            ours.reset(options={"reset_mask": bad})


def test_options_may_differ_and_may_last():
    envs = native(QUICK, 2, max_episode_steps=3, reset_options={"target": 1.0})
    _, infos = envs.reset(seed=0, options=[{"target": 2.0}, None])
    assert infos["target"].tolist() == [2.0, 1.0]
    for _ in range(3):
        *_, infos = envs.step(-np.ones(envs.action_space.shape, dtype=np.float32))
    assert infos["target"].tolist() == [1.0, 1.0]
    for seed, options, name in ((None, [None], "options"), ([1], None, "seed")):
        with pytest.raises(ValueError, match=f"{name} must be 2"):
            envs.reset(seed=seed, options=options)


def test_threads_change_nothing():
    results = []
    for threads in (1, 2):
        envs, actions = native(QUICK, 4, num_threads=threads), np.random.default_rng(0)
        seen = [envs.reset(seed=0)]
        for _ in range(20):
            seen.append(envs.step(actions.uniform(-1.0, 1.0, envs.action_space.shape)))
        results.append(seen)
    assert same(*results)


def test_a_copy_goes_on_where_the_original_is():
    envs = native(QUICK, 3)
    envs.reset(seed=0)
    action = np.zeros(envs.action_space.shape, dtype=np.float32)
    envs.step(action)
    copy = pickle.loads(pickle.dumps(envs))
    for _ in range(20):
        assert differing(envs.step(action), copy.step(action)) == []


def test_what_is_refused_moves_nobody():
    envs = native(QUICK, 2)
    with pytest.raises(ResetNeeded, match="before the first step"):
        envs.step(np.zeros((2, 3), dtype=np.float32))
    envs.reset(seed=0)
    for bad in (np.zeros(3), np.full((2, 3), np.nan), np.full((2, 3), 1.1)):
        with pytest.raises(ValueError, match="actions must be"):
            envs.step(bad)
    assert [env.sim.time for env in envs.envs] == [0.0, 0.0]
    for bad in ({"num_envs": 0}, {"num_threads": 0}, {"max_episode_steps": 0}, {"camera": "none"}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            native(QUICK, **{"n": bad.pop("num_envs", 1)}, **bad)


def test_attributes_and_methods_of_the_tasks():
    envs = native(QUICK, 2)
    envs.reset(seed=[5, 6])
    assert envs.np_random_seed == (5, 6)
    assert len(envs.np_random) == 2
    envs.set_attr("target", [1.0, 2.0])
    assert envs.get_attr("target") == (1.0, 2.0)
    envs.set_attr("target", 1.5)
    assert envs.get_attr("target") == (1.5, 1.5)
    assert envs.call("command", np.zeros(3))[1].tolist() == [0.0] * 3
    assert envs.render() == (None, None)
    with pytest.raises(ValueError, match="values must be 2"):
        envs.set_attr("target", [1.0])
    assert envs.spec is not None and envs.spec.id == QUICK
    envs.close()


def test_gymnasiums_wrappers_accept_it():
    from gymnasium.wrappers.vector import RecordEpisodeStatistics

    envs = RecordEpisodeStatistics(native(QUICK, 2, max_episode_steps=4))
    envs.reset(seed=0)
    total = np.zeros(2)
    for _ in range(4):
        _, rewards, _, truncated, infos = envs.step(-np.ones((2, 3), dtype=np.float32))
        total += rewards
    assert truncated.all()
    assert infos["episode"]["r"] == pytest.approx(total)
    assert infos["episode"]["l"].tolist() == [4, 4]


def test_a_picture_of_each():
    envs = native(QUICK, 2, render_mode="rgb_array", size=(64, 48))
    envs.reset(seed=0, options=[{"start": 0.0}, {"start": 3.0}])
    try:
        first, second = envs.render()
    except RenderingUnavailable as reason:
        pytest.skip(str(reason))
    finally:
        envs.close()
    assert first.shape == second.shape == (48, 64, 3)
    assert (first != second).any()

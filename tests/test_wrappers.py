"""Recording changes nothing but that there is a file, and it is whole; scaling only numbers."""

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from rerun.chunk import RrdReader

from tca_mj.envs.arm import ArmPickPlace
from tca_mj.envs.outcome import how_it_ended
from tca_mj.envs.wrappers import RecordRerun, ScaledObservation, VectorScaledObservation


@pytest.fixture(scope="module")
def task() -> ArmPickPlace:
    return ArmPickPlace()


def read(path: Path) -> dict[str, dict[str, list[Any]]]:
    """Columns of a recording by entity and component."""
    columns: dict[str, dict[str, list[Any]]] = defaultdict(lambda: defaultdict(list))
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            columns[chunk.entity_path][name] += column.to_pylist()
    return columns


def texts(path: Path) -> list[str]:
    return np.ravel(read(path)["/events"]["TextLog:text"]).tolist()


def values(path: Path, entity: str) -> list[float]:
    return [row[0] for row in read(path)[entity]["Scalars:scalars"] if row]


def verified(path: Path) -> bool:
    program = [str(Path(sys.executable).parent / "rerun"), "rrd", "verify", str(path)]
    return subprocess.run(program, capture_output=True, timeout=60, check=False).returncode == 0


def test_every_step_is_in_the_file_with_reward_and_events(
    task: ArmPickPlace, tmp_path: Path
) -> None:
    env = RecordRerun(gym.wrappers.TimeLimit(task, 3), tmp_path / "new" / "a.rrd")
    assert not env.path.exists()  # nothing is overwritten before there is something to write
    rewards, heats = [], []
    with env:
        for episode in range(2):
            env.reset(seed=4 if episode == 0 else None)
            env.event("begin")
            truncated = False
            while not truncated:
                _, _, _, truncated, info = env.step(np.zeros(6, dtype=np.float32))
                rewards.append(info["reward_terms"]["energy"])
                heats.append(task.sim.temperature[4])
    assert texts(env.path) == [
        "episode 1, seed 4", "begin", "time limit", "reset", "episode 2", "begin", "time limit"
    ]
    np.testing.assert_allclose(values(env.path, "/reward/energy"), rewards)
    seen = values(env.path, "/actuators/arm.gripper.tca/temperature")
    assert seen == [25.0, *heats[:3], 25.0, *heats[3:]]  # each reset is a frame as well
    clock = [t.total_seconds() for t in read(env.path)["/world/tca/arm.gripper.tca"]["sim_time"]]
    np.testing.assert_allclose(clock, [0.0, 0.1, 0.2, 0.3, 0.3, 0.4, 0.5, 0.6], atol=1e-9)
    assert verified(env.path)
    assert env.seconds > 0.0


def test_recording_changes_nothing(task: ArmPickPlace, tmp_path: Path) -> None:
    action = np.array([0.5, -0.5, 0.0, 1.0, -1.0, 0.3], dtype=np.float32)

    def run(env: gym.Env[Any, Any]) -> list[Any]:
        first, _ = env.reset(seed=1)
        return [first, *(env.step(action)[:2] for _ in range(5))]

    plain = run(task)
    env = RecordRerun(task, tmp_path / "a.rrd", chunk=2)
    for one, other in zip(plain, run(env), strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        np.testing.assert_array_equal(one[1], other[1])
    env.close()


def test_the_interface_stays_gymnasiums(tmp_path: Path) -> None:
    env = RecordRerun(ArmPickPlace(), tmp_path / "a.rrd")
    with pytest.warns(UserWarning) as complaints:
        check_env(env, skip_render_check=True)
    (complaint,) = complaints  # of there being any wrapper; nothing else
    assert "different from the unwrapped version" in str(complaint.message)
    env.close()
    assert verified(tmp_path / "a.rrd")


def test_the_spec_makes_the_wrapper_again(tmp_path: Path) -> None:
    env = RecordRerun(gym.make("TCA/ArmPickPlace-v0"), tmp_path / "a.rrd", every=2)
    assert env.spec is not None
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert isinstance(again, RecordRerun)
    assert again.path == env.path and not again.path.exists()
    assert again.get_wrapper_attr("control_period") == 0.1
    env.close()
    again.close()


def test_an_error_in_the_environment_leaves_a_whole_file(
    task: ArmPickPlace, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match="shape"), RecordRerun(task, tmp_path / "a.rrd") as env:
        env.reset(seed=0)
        env.step(np.zeros(6, dtype=np.float32))
        env.step(np.zeros(5, dtype=np.float32))
    assert len(values(tmp_path / "a.rrd", "/reward/energy")) == 1
    assert verified(tmp_path / "a.rrd")


@pytest.mark.parametrize("ending", ["raise KeyboardInterrupt", "1 / 0", "sys.exit(3)", ""])
def test_a_program_that_never_closes_leaves_a_whole_file(tmp_path: Path, ending: str) -> None:
    script = f"""
import sys
import numpy as np
from tca_mj.envs.arm import ArmPickPlace
from tca_mj.envs.wrappers import RecordRerun, ScaledObservation, VectorScaledObservation
env = RecordRerun(ArmPickPlace(), {json.dumps(str(tmp_path / "a.rrd"))})
env.reset(seed=0)
for _ in range(3):
    env.step(np.zeros(6, dtype=np.float32))
{ending}
"""
    subprocess.run([sys.executable, "-c", script], capture_output=True, timeout=60, check=False)
    assert len(values(tmp_path / "a.rrd", "/reward/energy")) == 3
    assert verified(tmp_path / "a.rrd")


def test_a_closed_recording_is_not_begun_anew(task: ArmPickPlace, tmp_path: Path) -> None:
    env = RecordRerun(task, tmp_path / "a.rrd")
    with pytest.raises(RuntimeError, match="before the first reset"):
        env.event("too early")
    env.reset(seed=0)
    env.close()
    env.close()
    size = env.path.stat().st_size
    with pytest.raises(RuntimeError, match="closed"):
        env.reset(seed=0)
    assert env.path.stat().st_size == size


def test_what_cannot_be_recorded_is_refused(task: ArmPickPlace, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="sim"):
        RecordRerun(gym.make("CartPole-v1"), tmp_path / "a.rrd")
    with pytest.raises(ValueError, match="chunk must be at least 1, got 0"):
        RecordRerun(task, tmp_path / "a.rrd", chunk=0)
    with pytest.raises(ValueError, match="tca_radius"):
        RecordRerun(task, tmp_path / "a.rrd", tca_radius=0.0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("terminated", "truncated", "info", "said"),
    [
        (False, False, {}, None),
        (True, False, {"success": True}, "success"),
        (True, False, {"termination_reason": "object out of reach"}, "object out of reach"),
        (False, True, {"truncation_reason": "overheated: x"}, "overheated: x"),
        (False, True, {"success": False}, "time limit"),
    ],
)
def test_the_end_of_an_episode_has_a_reason(
    terminated: bool, truncated: bool, info: dict[str, Any], said: str | None
) -> None:
    assert how_it_ended(terminated, truncated, info) == said


QUICK = "TCA/MorphModule-v0"


def by_hand(task: Any, observation: Any) -> Any:
    """(x - centre) / scale, row by row of the table."""
    rows = []
    for entry in task.observation.entries:
        scale = entry.scale if entry.scale is not None else (entry.high - entry.low) / 2.0
        rows.append((observation[task.observation.slices[entry.name]] - entry.centre) / scale)
    return np.concatenate(rows)


def test_scaled_observations_are_those_of_the_table() -> None:
    plain = gym.make("TCA/BendReach-v0")
    env = ScaledObservation(gym.make("TCA/BendReach-v0"))
    task: Any = plain.unwrapped
    low, high = plain.observation_space.low, plain.observation_space.high  # type: ignore[attr-defined]
    np.testing.assert_allclose(env.observation_space.low, by_hand(task, low), rtol=1e-6)
    np.testing.assert_allclose(env.observation_space.high, by_hand(task, high), rtol=1e-6)
    seen, (scaled, _) = plain.reset(seed=2)[0], env.reset(seed=2)
    action = np.array([0.5, -1.0, 0.0], dtype=np.float32)
    for _ in range(20):
        assert scaled in env.observation_space and scaled.dtype == np.float32
        np.testing.assert_allclose(scaled, by_hand(task, seen), rtol=1e-5, atol=1e-6)
        seen, reward, *_ = plain.step(action)
        scaled, other, *_ = env.step(action)
        assert reward == other
    assert 0.3 < np.abs(scaled).max() < 5.0
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))  # type: ignore[union-attr]
    assert isinstance(again, ScaledObservation)


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_scaled_vector_environments_are_the_scaled_single_ones(mode: str) -> None:
    """Also the last observations of episodes that a time limit ends."""
    told = {"max_episode_steps": 3, "autoreset_mode": mode}
    plain = gym.make_vec(QUICK, num_envs=2, **told)
    envs = VectorScaledObservation(gym.make_vec(QUICK, num_envs=2, **told))
    single = ScaledObservation(gym.make(QUICK))
    assert envs.single_observation_space == single.observation_space
    assert envs.observation_space.shape == (2, *(single.observation_space.shape or ()))
    task: Any = single.unwrapped
    seen, scaled = plain.reset(seed=[5, 6])[0], envs.reset(seed=[5, 6])[0]
    np.testing.assert_array_equal(scaled[0], single.reset(seed=5)[0])
    random, ends = np.random.default_rng(0), 0
    for _ in range(8):
        np.testing.assert_array_equal(scaled, task.observation.scaled(seen))
        assert scaled in envs.observation_space
        actions = random.uniform(-1.0, 0.0, (2, 3)).astype(np.float32)
        seen, rewards, *_, infos = plain.step(actions)
        scaled, others, *_, told_infos = envs.step(actions)
        np.testing.assert_array_equal(rewards, others)
        assert ("final_obs" in told_infos) == ("final_obs" in infos)
        for i in np.flatnonzero(infos.get("_final_obs", [])):
            np.testing.assert_array_equal(
                told_infos["final_obs"][i], task.observation.scaled(infos["final_obs"][i])
            )
            assert np.abs(told_infos["final_obs"][i]).max() < 10.0
            ends += 1
    assert (ends >= 4) == (mode == "SameStep")


def test_what_has_no_table_is_not_scaled() -> None:
    with pytest.raises(ValueError, match="table of its observation"):
        ScaledObservation(gym.make("CartPole-v1"))

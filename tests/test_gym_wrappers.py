"""Gymnasium's wrappers around our vector environment: the table of the training page is true."""

import re
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import gymnasium.wrappers.vector as wrappers
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled

import tca_mj  # noqa: F401  (registers the ids)

PAGE = Path(__file__).parent.parent / "docs" / "training.md"
TASK, STEPS = "TCA/MorphModule-v0", 3


def told() -> dict[str, str]:
    """What the table says of each wrapper."""
    text = PAGE.read_text(encoding="utf-8")
    table = text[text.index("| wrapper | same-step |") :].partition("\n\n")[0]
    rows = [line.split("|")[1:3] for line in table.splitlines()[2:]]
    return {name: said.strip() for names, said in rows for name in re.findall(r"`(\w+)`", names)}


def made(mode: str = "SameStep", **more: Any) -> Any:
    return gym.make_vec(TASK, num_envs=2, max_episode_steps=STEPS, autoreset_mode=mode, **more)


def arguments(name: str, folder: Path) -> dict[str, Any]:
    """What a wrapper has to be told."""
    plain = made()
    seen, acts = plain.single_observation_space, plain.single_action_space
    single: Any = gym.wrappers
    return {
        "TransformObservation": {"func": lambda seen: seen},
        "TransformAction": {"func": lambda action: action},
        "TransformReward": {"func": lambda reward: reward},
        "VectorizeTransformObservation": {"wrapper": single.TransformObservation,
                                          "func": lambda seen: seen, "observation_space": seen},
        "VectorizeTransformAction": {"wrapper": single.TransformAction,
                                     "func": lambda action: action, "action_space": acts},
        "VectorizeTransformReward": {"wrapper": single.TransformReward, "func": lambda r: r},
        "FilterObservation": {"filter_keys": ["a"]},
        "ReshapeObservation": {"shape": (3, 3)},
        "ResizeObservation": {"shape": (3, 3)},
        "RescaleObservation": {"min_obs": np.float32(-1.0), "max_obs": np.float32(1.0)},
        "DtypeObservation": {"dtype": np.float64},
        "RescaleAction": {"min_action": np.float32(-2.0), "max_action": np.float32(2.0)},
        "ClipReward": {"min_reward": -1.0, "max_reward": 1.0},
        "RecordVideo": {"video_folder": str(folder), "episode_trigger": lambda _: True},
        "ArrayConversion": {"env_xp": np, "target_xp": pytest.importorskip("torch")},
    }.get(name, {})  # fmt: skip


def through(name: str, folder: Path, mode: str = "SameStep") -> None:
    """Steps a wrapped environment beyond the end of an episode."""
    pictured = name in ("RecordVideo", "HumanRendering")
    env = made(mode, **({"render_mode": "rgb_array", "size": (64, 64)} if pictured else {}))
    env = getattr(wrappers, name)(env, **arguments(name, folder))
    env.reset(seed=0)
    for _ in range(STEPS + 2):
        env.step(np.zeros(env.action_space.shape, np.float32))


def test_the_table_names_every_wrapper() -> None:
    assert sorted(told()) == sorted(wrappers.__all__)


@pytest.mark.parametrize("name", wrappers.__all__)
@pytest.mark.filterwarnings("ignore")
def test_a_wrapper_takes_our_vector_environment_or_not(name: str, tmp_path: Path) -> None:
    said = told()[name]
    if said == "not tried":
        pytest.skip("the page says nothing of it")
    try:
        through(name, tmp_path)
    except (DependencyNotInstalled, ModuleNotFoundError) as error:
        pytest.skip(str(error))
    except (ValueError, BufferError):
        assert said == "refused"
    else:
        assert said == "taken"


@pytest.mark.parametrize(
    "name",
    ["TransformObservation", "VectorizeTransformObservation", "DtypeObservation",
     "FlattenObservation", "ReshapeObservation", "NormalizeObservation", "RescaleObservation"],
)  # fmt: skip
def test_in_the_next_step_observations_are_transformed(name: str, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        through(name, tmp_path, "NextStep")


def test_statistics_of_episodes_are_those_of_the_episodes() -> None:
    """Sums of rewards, where the next episode begins in the same step."""
    env = wrappers.RecordEpisodeStatistics(made())
    env.reset(seed=0)
    total, ends = np.zeros(2), 0
    for _ in range(2 * STEPS):
        _, rewards, _, truncated, infos = env.step(-np.ones(env.action_space.shape, "f4"))
        total += rewards
        if truncated.any():
            found = infos["episode"] if "episode" in infos else infos["final_info"]["episode"]
            np.testing.assert_allclose(found["r"], total)
            assert (found["l"] == STEPS).all()
            total, ends = np.zeros(2), ends + 1
    assert ends == 2

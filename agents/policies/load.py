"""Policies by name or file, made ready for a task: those of this package, and from outside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np

from tca_mj.agents.policies.contracts import ROBOT, contract, differences
from tca_mj.agents.policies.files import KINDS, Policy, SavedPolicy
from tca_mj.agents.policies.network import Network
from tca_mj.agents.policies.preprocessing import Preprocessing
from tca_mj.agents.policies.sb3_zip import Model
from tca_mj.checks import door
from tca_mj.envs.task import HEATINGS
from tca_mj.hints import nearest
from tca_mj.registry import find_task, make

ZIP = ".zip"  # of a model of Stable-Baselines3
BEST = ("best.json", "best.npz", "best_model.zip")  # the last by its EvalCallback
LAST = ("last.json", "last.npz")  # where a run stands


@door
def load_policy(
    source: str | Path,
    env: gym.Env[Any, Any],
    preprocessing: Preprocessing | None = None,
    *,
    other_robot: bool = False,
) -> Policy:
    """A policy from a file, ready to act in an environment.

    Args:
        source: As for ``find``. A ``.zip`` is a model of Stable-Baselines3, see ``read_zip``.
        env: The Gymnasium environment; its task has to be the policy's.
        preprocessing: As for ``read_zip``; files of this package say it themselves.
        other_robot: Whether the robot may be another than the one that the policy was made for.

    Raises:
        FileNotFoundError: If there is no such file, nor a shipped policy of that name.
        ValueError: If the file is no policy, or one for another task; or if the task is not as it
            was when the policy was made, with what differs.

    Example:
        >>> import tca_mj
        >>> from tca_mj.agents.policies import load_policy
        >>> env = tca_mj.make("TCA/BendReach-v0", action="power")
        >>> observation, info = env.reset(seed=0)
        >>> load_policy("bend-reach", env).act(observation).round(1)
        array([-0.9,  1. , -0.8], dtype=float32)
    """
    path = find(source)
    if path.suffix == ZIP:
        return read_zip(path, env, preprocessing).make(env)
    require_untold(path, preprocessing)
    saved = SavedPolicy.read(path)
    spec = env.spec
    if spec is not None and spec.id != saved.task.rpartition(":")[2]:
        raise ValueError(f"source must be a policy for {spec.id}, got {source} for {saved.task}")
    require_arguments(saved.arguments, env)
    _require_contract(path, saved.made_for, env, other_robot)
    if saved.network is not None:
        _require_spaces(path, saved.network, 2 if saved.kind == "residual" else 0, env)
    return saved.make(env)


@door
def saved_policy(
    source: str | Path,
    task: str | None = None,
    arguments: Mapping[str, Any] | None = None,
    preprocessing: Preprocessing | None = None,
) -> SavedPolicy:
    """A policy from a file, to be written in another form.

    Args:
        source: As for ``find``.
        task: Gymnasium id, or ``module:id``, of the task that a ``.zip`` was trained in.
        arguments: What that task was made with.
        preprocessing: As for ``read_zip``.

    Raises:
        FileNotFoundError: If there is no such file, nor a shipped policy of that name.
        ValueError: If the file is no policy, or no task is named for a ``.zip``.
    """
    path = find(source)
    if path.suffix != ZIP:
        require_untold(path, preprocessing)
        return SavedPolicy.read(path)
    if task is None:
        raise ValueError(f"task must name what {path} was trained in, got None (--task)")
    env = make(task, disable_env_checker=True, **(arguments or {}))
    try:
        return replace(read_zip(path, env, preprocessing), task=task)
    finally:
        env.close()


@door
def require_arguments(arguments: Mapping[str, Any], env: gym.Env[Any, Any]) -> None:
    """Refuses an environment that was made with other arguments than a policy needs.

    Args:
        arguments: What the policy needs.
        env: The environment.

    Raises:
        ValueError: If one of ``action`` and ``control_period`` differs.
    """
    task: Any = env.unwrapped
    given = {"action": task.heating, "control_period": task.control_period}
    usual = {"action": HEATINGS[0], "control_period": type(task).control_period}
    usual |= {} if env.spec is None else dict(find_task(env.spec.id).kwargs)
    for name, value in given.items():
        needed = arguments.get(name) or usual[name]
        if needed != value:
            raise ValueError(f"{name} must be {needed!r} for this policy, got {value!r}")


def _require_contract(
    path: Path, made_for: Mapping[str, Any], env: gym.Env[Any, Any], other_robot: bool
) -> None:
    """Refuses an environment that is not what a policy was made for."""
    needed = {name: part for name, part in made_for.items() if not (other_robot and name == ROBOT)}
    apart = differences(needed, contract(env)) if needed else []
    if apart:
        hint = " (other_robot=True takes it)" if apart[-1].startswith(ROBOT) else ""
        raise ValueError(f"env must be what {path} was made for, got {' | '.join(apart)}{hint}")


@door
def find(source: str | Path) -> Path:
    """The file of a policy.

    Args:
        source: Path of a file, or of the folder of a training run, whose best policy is taken; or
            the name of a shipped policy.

    Raises:
        FileNotFoundError: If there is none.
    """
    path, known = Path(source), shipped()
    if path.is_file():
        return path
    if path.is_dir():
        best = next((path / name for name in BEST if (path / name).is_file()), None)
        if best is None:
            last = [f"{path / name}" for name in LAST if (path / name).is_file()]
            hint = f"; the run has judged none yet, it stands at {last[0]}" if last else ""
            raise FileNotFoundError(f"none of {', '.join(BEST)} in {source}{hint}")
        return best
    if str(source) in known:
        return known[str(source)]
    raise FileNotFoundError(
        f"no file {path}, and no shipped policy of that name; shipped are {sorted(known)}"
        f"{nearest(str(source), known)}"
    )


def shipped() -> dict[str, Path]:
    """The files of the policies that come with the package, by name."""
    folder = Path(str(files("tca_mj.agents.policies")))
    found = sorted(folder.glob("*")) if folder.is_dir() else []
    return {path.stem: path for path in found if path.suffix in KINDS.values()}


@door
def read_zip(
    path: str | Path, env: gym.Env[Any, Any], preprocessing: Preprocessing | None = None
) -> SavedPolicy:
    """A model as a policy for a task.

    Args:
        path: The zip that ``model.save`` has written.
        env: The Gymnasium environment, made with what it was made with when the model was trained.
        preprocessing: What became of the observations; by default what can be found out.

    Raises:
        FileNotFoundError: If there is none.
        ValueError: As ``Model.read``, if it is a model for other spaces, or if it has to be said
            whether observations were scaled.
    """
    task: Any = env.unwrapped
    how, model = preprocessing or Preprocessing(), Model.read(path)
    _require_spaces(path, model.network, 0, env)
    scaled, own = how.scaled, cast("Any", env.observation_space)
    if scaled is None:
        by_table = task.observation.scaled_space
        plain, fits = (
            model.seen is not None and np.allclose(model.seen, [space.low, space.high], rtol=1e-5)
            for space in (own, by_table)
        )
        scaled = fits and not (plain and own != task.observation_space)  # the environment does it
        if plain == scaled:
            raise ValueError(
                f"{path} must be said to be scaled or not: the bounds of its observations fit"
                f" {'both' if plain else 'neither'} the task's own and those of ScaledObservation;"
                " --scaled if it was trained with that, else --no-scaled (Preprocessing)"
            )
    return SavedPolicy(
        task=type(task).__name__ if env.spec is None else env.spec.id,
        origin=model.origin,
        network=model.preprocessed(task.observation.units if scaled else None, how.statistics),
        arguments={"action": task.heating, "control_period": task.control_period},
    )


def require_untold(source: str | Path, preprocessing: Preprocessing | None) -> None:
    """Raises ValueError if somebody says how a policy sees that knows it itself."""
    if preprocessing not in (None, Preprocessing()):
        raise ValueError(f"policy must be a {ZIP} to be told how it sees the task, got {source}")


def _require_spaces(path: str | Path, network: Network, own: int, env: Any) -> None:
    """Refuses a network for other spaces; it may see some numbers of its ``own``."""
    seen, acts = env.observation_space.shape[0], env.action_space
    if (network.inputs - own, network.outputs) != (seen, acts.shape[0]):
        raise ValueError(
            f"source must turn {seen} numbers into {acts.shape[0]}, got {path} from"
            f" {network.inputs - own} to {network.outputs}"
        )
    low, high = (-1.0, 1.0) if network.bounds is None else network.bounds
    if not (np.allclose(acts.low, low) and np.allclose(acts.high, high)):
        raise ValueError(
            f"{path} must have the task's bounds of actions, {acts.low} to {acts.high}, got"
            f" {low} to {high}"
        )

"""Who acts in a task, by name: its script, nobody, chance, or a saved policy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies import Policy, Preprocessing, SavedPolicy, load_policy
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.policies.load import ZIP, find, require_arguments, require_untold
from tca_mj.checks import Seed, door
from tca_mj.control import Gait
from tca_mj.registry import make, task_class

NAMES = ("scripted", "off", "random")
TROT = (0.5, 0.0, 0.0, 0.5)  # offsets of four legs, diagonal ones together


@dataclass(slots=True)
class Blind:
    """Acts without a look at what is seen.

    Attributes:
        phase: What it is called.
        draw: Gives the next action.
    """

    phase: str
    draw: Callable[[], NDArray[np.float32]]

    def reset(self) -> None:
        """Nothing is remembered; what is random goes on."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The next action, whatever is seen."""
        return self.draw()


@dataclass(slots=True)
class Script:
    """Acts by a method of the task.

    Attributes:
        act: The method, from an observation to the action for the next control period.
        phase: What it is called.
    """

    act: Callable[[NDArray[np.float32]], NDArray[np.float32]]
    phase: str = "script"

    def reset(self) -> None:
        """Nothing is remembered."""


@door
def actor(
    name: str | Path, env: gym.Env[Any, Any], *, seed: Seed = 0,
    preprocessing: Preprocessing | None = None, other_robot: bool = False,
) -> Policy:
    """Who acts in an environment.

    Args:
        name: One of ``NAMES``, the name of a shipped policy, a policy's file, a model of
            Stable-Baselines3 (``.zip``), or the folder of a training run, whose best policy is
            taken; or ``module:callable`` of what makes a policy from the environment, which is
            imported. If that has ``arguments``, or a function of that name that returns them, the
            task is made with them.
        env: The Gymnasium environment.
        seed: Seed of what is random.
        preprocessing: What became of the observations of a model of Stable-Baselines3, see
            ``tca_mj.agents.policies.load.read_zip``.
        other_robot: Whether a policy may act on another robot than the one it was made for.

    Raises:
        FileNotFoundError: If there is no such policy.
        ValueError: If it is one for another task, or the task has no script.
    """
    maker = called(name)
    if maker is not None:
        require_untold(name, preprocessing)
        made: Policy = maker(env)
        return made
    if str(name) not in NAMES:
        return load_policy(name, env, preprocessing, other_robot=other_robot)
    require_untold(name, preprocessing)
    if name == "scripted":
        return scripted(env)
    if name == "random":
        uniform, size = np.random.default_rng(seed).uniform, env.action_space.shape
        return Blind("random", lambda: uniform(-1.0, 1.0, size).astype(np.float32))
    task: Any = env.unwrapped
    return Blind("off", task.action.still.copy)


@door
def arguments_of(name: str | Path, task: str) -> dict[str, Any]:
    """Arguments of a task that a policy needs it to be made with.

    Args:
        name: As for ``actor``; a model of Stable-Baselines3 does not say.
        task: Gymnasium id, or ``module:id``.

    Raises:
        ValueError, FileNotFoundError: As ``actor``.
    """
    if name == "scripted":
        return dict(task_class(task).scripted_arguments)
    maker = called(name)
    if maker is not None:
        needed = getattr(maker, "arguments", {})
        return dict(needed() if callable(needed) else needed)
    path = None if str(name) in NAMES else find(name)
    return {} if path is None or path.suffix == ZIP else dict(SavedPolicy.read(path).arguments)


def called(name: str | Path) -> Callable[[Any], Policy] | None:
    """What ``module:callable`` names; None for anything else.

    Raises:
        ValueError: If there is no such module or callable.
    """
    module, colon, attribute = str(name).rpartition(":")
    if not colon or Path(name).exists() or not module.replace(".", "_").isidentifier():
        return None
    try:
        found: Callable[[Any], Policy] = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"name must be module:callable, got {name}: {error}") from error
    return found


@door
def scripted(env: gym.Env[Any, Any]) -> Policy:
    """The scripted policy of an environment's task.

    Args:
        env: The environment.

    Raises:
        ValueError: If it has none, or the task was not made with ``scripted_arguments``.
    """
    task: Any = env.unwrapped
    maker = task.scripted
    if maker is None and hasattr(task, "script"):
        return Script(task.script)
    if maker is None:
        raise ValueError(f"policy must be another than 'scripted', got {type(task).__name__}")
    require_arguments(task.scripted_arguments, env)
    return script_of(task)


def script_of(task: Any) -> Policy:
    """What ``task.scripted`` makes, whatever the task was made with."""
    maker = task.scripted
    if isinstance(maker, str):
        module, _, name = maker.partition(":")
        maker = getattr(import_module(module), name)
    policy: Policy = maker(task)
    return policy


@door
def first_gait(task: str, start: str) -> tuple[Gait, tuple[float, ...]]:
    """The gait from which something starts, and its steering per leg [K/rad].

    Args:
        task: Gymnasium id.
        start: ``scripted``; ``trot``, which is the same with diagonal legs together, half a cycle
            after the others; or a policy's file or name.

    Raises:
        FileNotFoundError: If ``start`` is no policy.
        ValueError: If it is a policy without a gait.
    """
    if start not in ("scripted", "trot"):
        saved = SavedPolicy.read(find(start))
        if saved.gait is None:
            raise ValueError(f"start must have a gait, got {start}, a {saved.kind}")
        return saved.gait, saved.steering
    env = make(task, disable_env_checker=True, **arguments_of("scripted", task))
    script = scripted(env)
    env.close()
    if not isinstance(script, GaitPolicy):
        raise ValueError(f"start must be a policy with a gait, got {start}, which {task} has not")
    gait = replace(script.gait, offset=TROT) if start == "trot" else script.gait
    return gait, tuple(np.broadcast_to(script.steering, gait.legs).tolist())


@door
def first_gaits(task: str, start: str) -> Callable[[Any], Gait]:
    """The gait from which something starts, where that may depend on what an episode draws.

    Args:
        task: Gymnasium id.
        start: As for ``first_gait``.

    Returns:
        A function from a task, whose episode has begun, to the gait: that of its script's method
        ``gait_of``, where it has one.

    Raises:
        FileNotFoundError, ValueError: As ``first_gait``.
    """
    if start == "scripted":
        env = make(task, disable_env_checker=True, **arguments_of("scripted", task))
        several: Callable[[Any], Gait] | None = getattr(scripted(env), "gait_of", None)
        env.close()
        if several is not None:
            return several
    gait, _ = first_gait(task, start)
    return lambda task: gait

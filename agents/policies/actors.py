"""Who acts in a task, by name: its script, nobody, chance, or a saved policy."""

from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies import Policy, SavedPolicy, find, load_policy, require_arguments
from tca_mj.registry import task_class

NAMES = ("scripted", "off", "random")

@dataclass(slots=True)
class Still:
    """No power, and everything else in the middle of its range.

    Attributes:
        action: The action, always the same.
    """

    action: NDArray[np.float32]

    @property
    def phase(self) -> str:
        return "off"

    def reset(self) -> None:
        """Nothing is remembered."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action, whatever is seen."""
        return self.action.copy()


@dataclass(slots=True)
class Chance:
    """Actions drawn evenly from the whole space.

    Attributes:
        size: Length of an action.
        seed: Seed of the first episode; every further episode goes on drawing.
    """

    size: int
    seed: int = 0
    _random: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(self.seed)

    @property
    def phase(self) -> str:
        return "random"

    def reset(self) -> None:
        """Nothing is remembered."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """An action, whatever is seen."""
        return self._random.uniform(-1.0, 1.0, self.size).astype(np.float32)


def actor(name: str | Path, env: Any, *, seed: int = 0) -> Policy:
    """Who acts in an environment.

    Args:
        name: One of ``NAMES``, the name of a shipped policy, a policy's file, or the folder of a
            training run, whose best policy is taken.
        env: The Gymnasium environment.
        seed: Seed of what is random.

    Raises:
        FileNotFoundError: If there is no such policy.
        ValueError: If it is one for another task, or the task has no script.
    """
    if str(name) not in NAMES:
        return load_policy(best_of(name), env)
    if name == "scripted":
        return scripted(env)
    if name == "random":
        return Chance(env.action_space.shape[0], seed)
    return Still(env.unwrapped.action.still)


def arguments_of(name: str | Path, task: str) -> dict[str, Any]:
    """Arguments of a task that a policy needs it to be made with; errors as ``actor``.

    Args:
        name: As for ``actor``.
        task: Gymnasium id, or ``module:id``.
    """
    if name == "scripted":
        return dict(task_class(task).scripted_arguments)
    return {} if str(name) in NAMES else dict(SavedPolicy.read(find(best_of(name))).arguments)


def scripted(env: Any) -> Policy:
    """The scripted policy of an environment's task.

    Raises:
        ValueError: If it has none, or the task was not made with ``scripted_arguments``.
    """
    task = env.unwrapped
    maker = task.scripted
    if maker is None:
        raise ValueError(f"policy 'scripted': {type(task).__name__} has none")
    require_arguments(task.scripted_arguments, env)
    if isinstance(maker, str):
        module, _, name = maker.partition(":")
        maker = getattr(import_module(module), name)
    policy: Policy = maker(task)
    return policy


def best_of(name: str | Path) -> str | Path:
    """The file of the best policy, if ``name`` is the folder of a training run; else ``name``."""
    if not Path(name).is_dir():
        return name
    for file in ("best.json", "best.npz"):
        if (Path(name) / file).is_file():
            return Path(name) / file
    raise FileNotFoundError(f"no best.json and no best.npz in {name}")

"""The Gymnasium ids of the package.

The tasks live in ``tca_mj.envs``, the last layer but one, and yet ``import tca_mj`` has to make
their ids known. So this file names them as strings, which Gymnasium resolves in ``gymnasium.make``,
and imports nothing but Gymnasium itself and what checks arguments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Annotated, Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator

from tca_mj.checks import Checked, door, quantity, shown, whole

ControlPeriod = Annotated[float, partial(quantity, above=0.0, at_most=60.0, unit="s")]
"""Time of a step of a task: in a minute each of these robots has come to rest."""
MOST_EPISODE = 10_000_000
"""Most steps of an episode, 11 days of the shortest control period in use, 0.1 s."""
EpisodeSteps = Annotated[int, partial(whole, at_least=1, at_most=MOST_EPISODE)]
MOST_ENVS = 1024
"""Most tasks of one vector environment: as many of the largest robot take 5 GB of memory."""
Envs = Annotated[int, partial(whole, at_least=1, at_most=MOST_ENVS)]


DEEP = ("sac", "ppo", "td3", "tqc", "crossq")
"""What learns by gradients, by Stable-Baselines3 and sb3-contrib."""
ALGORITHMS = (*DEEP, "cma")
"""What learns: those, and the search over the figures of a gait."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Task(Checked):
    """What Gymnasium has to know of a task before its code is loaded.

    Attributes:
        id: Gymnasium id, ``TCA/<Name>-v<n>``.
        entry_point: ``module:class`` of the environment.
        max_episode_steps: Number of control steps after which ``TimeLimit`` truncates.
        kwargs: Arguments of the class that make it this task; a caller's own come on top.
    """

    id: str
    entry_point: str
    max_episode_steps: EpisodeSteps
    kwargs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def vector_entry_point(self) -> str:
        """``module:function`` of the vector environment: beside the class, named after it."""
        return f"{self.entry_point}Vector"


# The tasks of this package.
TASKS = (
    Task(
        id="TCA/ArmPickPlace-v0",
        entry_point="tca_mj.envs.arm:ArmPickPlace",
        max_episode_steps=1000,
    ),
    Task(
        id="TCA/MorphModule-v0",
        entry_point="tca_mj.envs.morph:MorphModule",
        max_episode_steps=800,
    ),
    Task(
        id="TCA/BendReach-v0",
        entry_point="tca_mj.envs.reach:BendReach",
        max_episode_steps=200,
    ),
    Task(
        id="TCA/FingerSense-v0",
        entry_point="tca_mj.envs.finger:FingerSense",
        max_episode_steps=1500,
    ),
    Task(
        id="TCA/Grasp-v0",
        entry_point="tca_mj.envs.grasp:Grasp",
        max_episode_steps=600,
    ),
    Task(
        id="TCA/AdaptiveGrasp-v0",
        entry_point="tca_mj.envs.adaptive:AdaptiveGrasp",
        max_episode_steps=1200,
    ),
    Task(
        id="TCA/BistableGrasp-v0",
        entry_point="tca_mj.envs.bistable_grasp:BistableGrasp",
        max_episode_steps=2000,
    ),
    Task(
        id="TCA/Jump-v0",
        entry_point="tca_mj.envs.jump:Jump",
        max_episode_steps=150,
    ),
    *(
        Task(
            id=f"TCA/Tetrapod{gait.capitalize()}-v0",
            entry_point="tca_mj.envs.tetrapod:TetrapodGait",
            max_episode_steps=600,
            kwargs={"gait": gait},
        )
        for gait in ("crawl", "walk", "shimmy")
    ),
    Task(
        id="TCA/TetrapodShapes-v0",
        entry_point="tca_mj.envs.shapes:TetrapodShapes",
        max_episode_steps=600,
    ),
    Task(
        id="TCA/TetrapodCourse-v0",
        entry_point="tca_mj.envs.course:TetrapodCourse",
        max_episode_steps=15000,
    ),
)


def register() -> None:
    """Registers every task that Gymnasium does not know yet; further calls change nothing."""
    for task in TASKS:
        if task.id not in gymnasium.registry:
            gymnasium.register(
                task.id,
                entry_point=task.entry_point,
                vector_entry_point=task.vector_entry_point,
                max_episode_steps=task.max_episode_steps,
                kwargs=dict(task.kwargs),
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class Demo(Checked):
    """An episode worth seeing.

    Attributes:
        name: What one types.
        task: Gymnasium id.
        policy: Who acts, as ``tca_mj.agents.policies.actors.actor`` knows it.
        arguments: What the task is made with besides what the policy needs.
    """

    name: str
    task: str
    policy: str = "scripted"
    arguments: Mapping[str, Any] = field(default_factory=dict)


_GUIDED = "tca_mj.agents.scripts.guided"
_SHOWN = (
    Demo(name="pick-and-place", task="TCA/ArmPickPlace-v0"),
    Demo(name="grasp", task="TCA/Grasp-v0"),
    Demo(name="adaptive-grasp", task="TCA/AdaptiveGrasp-v0"),
    Demo(name="bistable-grasp", task="TCA/BistableGrasp-v0"),
    Demo(name="tetrapod", task="TCA/TetrapodCourse-v0"),
    Demo(name="finger", task="TCA/FingerSense-v0"),
    Demo(name="jump", task="TCA/Jump-v0"),
    *(
        Demo(
            name=way,
            task="TCA/TetrapodWalk-v0",
            policy=f"{_GUIDED}:{way}",
            arguments={"max_episode_steps": 625},
        )
        for way in ("square", "waypoints")
    ),
)
DEMOS = {demo.name: demo for demo in _SHOWN}
"""What ``tca-mj demo`` shows, by name."""


@door
def find_task(task: str) -> EnvSpec:
    """What Gymnasium knows of a task.

    Args:
        task: Its id; ``module:id`` imports the module first, which registers it.

    Raises:
        ValueError: If there is no such module or task.
    """
    module, _, name = task.rpartition(":")
    try:
        if module:
            import_module(module)
        return gymnasium.spec(name)
    except (ImportError, gymnasium.error.Error) as error:
        known = [known.id for known in TASKS]
        raise ValueError(
            f"task must be one of {known}, or module:id of another, got {shown(task)}: {error}"
        ) from error


@door
def task_class(task: str) -> Any:
    """The class of a task, a ``tca_mj.envs.task.SimulatedTask``.

    Args:
        task: Gymnasium id, or ``module:id``.

    Raises:
        ValueError: As ``find_task``, or if it is none.
    """
    entry = find_task(task).entry_point
    found = load_env_creator(entry) if isinstance(entry, str) else entry
    if not hasattr(found, "robot_argument"):
        raise ValueError(f"task must be a SimulatedTask, got {task!r}, made by {entry}")
    return found


@door
def recipes(task: str) -> Any:
    """How a task is learned, a ``tca_mj.envs.recipe.Recipe`` by algorithm; the first was best.

    Args:
        task: Gymnasium id, or ``module:id``.

    Raises:
        ValueError: As ``task_class``.
    """
    return task_class(task).recipes_for(find_task(task).kwargs)


@door
def episode_steps(task: str, control_period: ControlPeriod | None = None) -> int | None:
    """Steps of an episode of a task's own length; None if it has no limit.

    Args:
        task: Gymnasium id, or ``module:id``.
        control_period: Time of a step, if it is not the task's own [s].

    Raises:
        ValueError: As ``find_task``.
    """
    spec = find_task(task)
    steps = spec.max_episode_steps
    if steps is None or control_period is None:
        return steps
    own = spec.kwargs.get("control_period") or task_class(task).control_period
    return max(1, round(steps * own / control_period))


@door
def make(task: str, *, max_episode_steps: EpisodeSteps | None = None, **arguments: Any) -> Any:
    """``gymnasium.make``, where an episode takes as long as the task's own at any control period.

    Args:
        task: Gymnasium id, or ``module:id``.
        max_episode_steps: Steps after which an episode is truncated instead.
        **arguments: Of ``gymnasium.make`` and of the task.

    Raises:
        ValueError: As ``find_task``.

    Example:
        >>> import tca_mj
        >>> env = tca_mj.make("TCA/BendReach-v0", control_period=0.2)
        >>> env.spec.max_episode_steps  # of 0.1 s there are 200
        100
    """
    steps = max_episode_steps or episode_steps(task, arguments.get("control_period"))
    return gymnasium.make(task, max_episode_steps=steps, **arguments)

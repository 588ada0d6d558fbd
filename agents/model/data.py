"""Data sets of what a task did under commands that are disturbed at random."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies import Policy, actor, arguments_of, contract
from tca_mj.agents.policies.archives import LARGEST, LONGEST, arrays, content_of, why
from tca_mj.agents.progress import progress_bar
from tca_mj.checks import (
    Checked,
    Count,
    Seed,
    door,
    flags,
    number,
    quantity,
    shown,
    text,
    whole,
    within,
)
from tca_mj.envs.vector import TaskVector
from tca_mj.files import write_whole
from tca_mj.registry import Envs, EpisodeSteps, episode_steps, find_task, task_class

KIND, FORMAT = "transitions", 1

# Estimates: an actuator of heat needs some seconds, its body the better part of a minute.
_SHORTEST, _LONGEST = 0.2, 6.0  # time for which a disturbance is held [s]
_CALM = 0.3  # share of the time in which a command is not disturbed [1]

_Episodes = Annotated[int, partial(whole, at_least=1, at_most=100_000)]
_STEPS = {
    "observation": "f4", "action": "f4", "next_observation": "f4", "reward": "f8",
    "terminated": "?", "truncated": "?",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Transitions(Checked):
    """Steps of a task, one episode behind the other.

    Attributes:
        task: Gymnasium id, or ``module:id``.
        observation: What was seen before each step, shape (n, seen), float32 [as the task].
        action: What was done, shape (n, acts), float32 [1].
        next_observation: What was seen after it, shape as before [as the task].
        reward: What it earned, shape (n,) [1].
        terminated, truncated: Whether it ended the episode, shape (n,).
        length: Number of steps of each episode, shape (episodes,).
        seed: Seed of each episode.
        made_for: The contract of the task, see ``tca_mj.agents.policies.contract``.
        policies: Who acted, below the disturbances, in one episode after the other, by turns.
        options: Options of every reset.
        arguments: What the task was made with.

    Raises:
        ValueError: If shapes do not fit or numbers are not finite.
    """

    task: str
    observation: NDArray[np.float32]
    action: NDArray[np.float32]
    next_observation: NDArray[np.float32]
    reward: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    length: NDArray[np.int64]
    seed: NDArray[np.int64]
    made_for: Mapping[str, Any]
    policies: tuple[str, ...] = ("off",)
    options: Mapping[str, Any] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        count = int(within("length", self.length, at_least=1.0).sum())
        within("seed", self.seed, at_least=0.0, shape=self.length.shape)
        seen, acts = (_width(self.made_for, name) for name in ("observation", "action"))
        widths = {"observation": (seen,), "next_observation": (seen,), "action": (acts,)}
        for name, kind in _STEPS.items():
            value, shape = getattr(self, name), (count, *widths.get(name, ()))
            number_of = flags(name, value) * 1.0 if kind == "?" else value
            within(name, number_of, shape=shape)

    @property
    def period(self) -> float:
        """Time of a step [s]."""
        return period_of(self.made_for)

    def episodes(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Of each episode what was seen, shape (steps + 1, seen), and done, shape (steps, acts)."""
        ends = np.cumsum(self.length)
        for start, end in zip(ends - self.length, ends, strict=True):
            last = self.next_observation[end - 1 : end]
            seen = np.concatenate([self.observation[start:end], last])
            yield seen.astype(np.float64), self.action[start:end].astype(np.float64)

    @door
    def save(self, path: str | Path) -> Path:
        """Writes the file, an ``.npz``, in one go."""
        header = {"kind": KIND, "format": FORMAT, "task": self.task, "policies": self.policies,
                  "options": dict(self.options), "arguments": dict(self.arguments),
                  "made_for": dict(self.made_for)}  # fmt: skip
        found = {name: getattr(self, name) for name in (*_STEPS, "length", "seed")}
        return packed(path, header, found)

    @classmethod
    @door
    def read(cls, path: str | Path) -> Transitions:
        """Reads a file.

        Raises:
            FileNotFoundError: If there is none.
            ValueError: If it is no data set, or larger than 256 MB, packed or not.
        """
        try:
            header, found = opened(path, KIND, FORMAT)
            steps = {name: found[name].astype(kind) for name, kind in _STEPS.items()}
            header["policies"] = tuple(header["policies"])
            return cls(length=found["length"], seed=found["seed"], **steps, **header)
        except FileNotFoundError:
            raise
        except Exception as error:
            raise ValueError(f"{path} is no data set: {why(error)}") from error


def packed(path: str | Path, header: Mapping[str, Any], found: Mapping[str, Any]) -> Path:
    """Writes arrays by name, with a header that becomes JSON, into an ``.npz`` in one go."""
    memory, said = io.BytesIO(), np.array(json.dumps(header))
    np.savez_compressed(memory, header=said, **found)
    return write_whole(Path(path), memory.getvalue())


def opened(path: str | Path, kind: str, newest: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Header and arrays of a file of this package; whatever is wrong with it is an exception.

    Args:
        path: The file, an ``.npz``.
        kind: What it has to be.
        newest: Its format.
    """
    found: dict[str, Any] = arrays(content_of(path))
    said = str(found.pop("header"))
    if len(said) > LONGEST:
        raise ValueError(f"header must have at most {LONGEST} characters, got {len(said)}")
    header = json.loads(said, parse_constant=_refused)
    if (header.pop("kind"), header.pop("format")) != (kind, newest):
        raise ValueError(f"kind must be {kind!r} in format {newest}")
    return header, found


def _refused(constant: str) -> None:
    raise ValueError(f"numbers of the header must be finite, got {constant}")


def rows_of(made_for: Mapping[str, Any], table: str) -> dict[str, tuple[int, float, float]]:
    """Size, centre and scale of each row of a table; what has no scale is taken as it is.

    Args:
        made_for: The contract of a task.
        table: ``observation`` or ``action``.

    Raises:
        ValueError: If it is no contract.
    """
    try:
        return {
            str(name): (
                whole(f"size of {name}", size, at_least=1, at_most=10_000),
                number(f"centre of {name}", centre),
                quantity(f"scale of {name}", 1.0 if scale is None else scale, above=0.0),
            )
            for name, (size, _, centre, scale) in made_for[table].items()
        }
    except (LookupError, TypeError, AttributeError) as error:
        raise ValueError(
            f"made_for must be the contract of a task with its {table}, got {shown(made_for)}"
        ) from error


def period_of(made_for: Mapping[str, Any]) -> float:
    """Time of a step of a task by its contract [s].

    Raises:
        ValueError: If it is no contract.
    """
    try:
        return quantity("control_period", made_for["timing"]["control_period"], above=0.0)
    except (LookupError, TypeError) as error:
        raise ValueError(
            f"made_for must be the contract of a task with its timing, got {shown(made_for)}"
        ) from error


def _width(made_for: Mapping[str, Any], table: str) -> int:
    return sum(size for size, _, _ in rows_of(made_for, table).values())


@door
def collect(
    task: str,
    *,
    episodes: _Episodes = 100,
    steps: EpisodeSteps | None = None,
    seed: Seed = 0,
    policies: Sequence[str] = ("off",),
    hottest: float | None = None,
    options: Mapping[str, Any] | None = None,
    arguments: Mapping[str, Any] | None = None,
    envs: Envs = 8,
    threads: Count | None = None,
    progress: bool = False,
) -> Transitions:
    """Runs episodes of a task and keeps every step.

    Each number of an action is what the policy says, and for 0.2 to 6 s at a time (evenly on a
    logarithmic scale) it is moved by a drawn share of the way towards a drawn number in [-1, 1];
    for 30 % of these times it is not. Everything that is drawn comes from ``seed`` and the number
    of the episode, so that nothing depends on ``envs`` and ``threads``.

    Args:
        task: Gymnasium id, or ``module:id``.
        episodes: How many, at most 100 000.
        steps: Of an episode at most; None for the task's own time limit.
        seed: Seed of the first episode; the next ones follow.
        policies: Who acts, as ``tca_mj.agents.policies.actor`` knows them, by turns.
        hottest: Temperature of a TCA beyond which an episode is cut off; None for the task's
            ``hot_temperature`` [°C].
        options: Options of every reset.
        arguments: Of the task, besides those that the policies need; ``tca`` as a name or a file.
        envs: Tasks that run side by side.
        threads: Threads of their simulations; None for one for each core.
        progress: Whether to show how far it is.

    Raises:
        FileNotFoundError: If there is no such policy.
        ValueError: If there is no such task, a policy is not for it, or the data set would be
            larger than 256 MB.
    """
    within("policies", [len(policies)], at_least=1.0)
    given: dict[str, Any] = dict(arguments or {})
    if given.get("tca") is not None:
        text("arguments['tca']", given["tca"])  # to be found again
    for name in policies:
        given |= {k: v for k, v in arguments_of(text("policies", name), task).items()
                  if given.get(k) is None}  # fmt: skip
    limit = steps or episode_steps(task, given.get("control_period"))
    limit = whole("steps of a task without a time limit", limit, at_least=1)
    tasks = TaskVector(
        task_class(task), num_envs=min(envs, episodes), num_threads=threads,
        max_episode_steps=limit, reset_options=options, **{**find_task(task).kwargs, **given},
    )  # fmt: skip
    first = tasks.envs[0]
    made_for = contract(first)
    width = 2 * _width(made_for, "observation") + _width(made_for, "action")
    size = episodes * limit * (4 * width + 10)
    if size > LARGEST:
        raise ValueError(
            f"episodes must be at most {LARGEST // (size // episodes)} of {limit} steps, for"
            f" {LARGEST} bytes, got {episodes}"
        )
    hot = first.hot_temperature if hottest is None else hottest
    actors = [[actor(name, env) for name in policies] for env in tasks.envs]
    rows: list[list[tuple[Any, ...]]] = [[] for _ in range(episodes)]
    number, begun, going = [-1] * tasks.num_envs, 0, 0
    seen: list[Any] = [None] * tasks.num_envs
    disturbed: list[Any] = [None] * tasks.num_envs
    with progress_bar(episodes, unit="episodes", progress=progress) as bar:
        while True:
            for i in range(tasks.num_envs):
                if number[i] < 0 and begun < episodes:
                    number[i], begun, going = begun, begun + 1, going + 1
                    seen[i], _ = tasks.restart(i, seed=seed + number[i])
                    policy = actors[i][number[i] % len(policies)]
                    policy.reset()
                    disturbed[i] = _Disturbed(policy, (seed, number[i]), first.control_period)
            if not going:
                break
            running = np.array(number) >= 0
            actions = np.zeros(tasks.action_space.shape or (), dtype=np.float32)
            for i in np.flatnonzero(running).tolist():
                actions[i] = disturbed[i].act(seen[i])
            for i, outcome in enumerate(tasks.advance(actions, running)):
                if outcome is None:
                    continue
                after, reward, terminated, truncated, info = outcome
                truncated = truncated or bool((info["temperature"] > hot).any())
                rows[number[i]].append(
                    (seen[i], actions[i].copy(), after, reward, terminated, truncated)
                )
                seen[i] = after
                if terminated or truncated:
                    number[i], going = -1, going - 1
                    bar.update()
    tasks.close()
    columns = zip(*(row for episode in rows for row in episode), strict=True)
    return Transitions(
        task=task, policies=tuple(policies), options=dict(options or {}), arguments=given,
        made_for=made_for, seed=seed + np.arange(episodes),
        length=np.array([len(episode) for episode in rows]),
        **{name: np.array(column, dtype=kind)
           for (name, kind), column in zip(_STEPS.items(), columns, strict=True)},
    )  # fmt: skip


class _Disturbed:
    """A policy whose commands are disturbed, each number at its own times."""

    def __init__(self, policy: Policy, seed: tuple[int, int], period: float) -> None:
        self._policy, self._random = policy, np.random.default_rng(seed)
        self._shortest, self._longest = np.log([_SHORTEST / period, _LONGEST / period])
        self._left: NDArray[np.int64] = np.zeros(0, dtype=np.int64)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The next action."""
        said, draw = self._policy.act(observation), self._random
        if not self._left.size:
            self._left = np.zeros(said.size, dtype=np.int64)
            self._level, self._share = np.zeros((2, said.size))
        for k in np.flatnonzero(self._left <= 0):
            self._left[k] = round(float(np.exp(draw.uniform(self._shortest, self._longest))))
            self._level[k] = draw.uniform(-1.0, 1.0)
            self._share[k] = draw.uniform() * (draw.uniform() > _CALM)
        self._left -= 1
        moved: NDArray[np.float32] = (said + self._share * (self._level - said)).astype(np.float32)
        return moved

"""A soak: very many random steps of all tasks, and what came up in them that must not.

Every task is stepped in three ways: alone, as a vector environment, and as one whose actions are
powers. The ways take turns, the cheap ones more of them: one whose steps cost four times as much
gets half the time, and an eighth of the steps. What a turn does is drawn from the seed, the way and
the turn's number alone, and can thus be repeated. Half the episodes begin with options of ``reset``
that are drawn within their bounds; actions are drawn for every step, are at one bound or the other,
or are held.

Faults, which must not be: an exception; a number in an observation, a reward or an info that is
none; an observation outside its space; an episode that diverged; and, where actions are
temperatures, a TCA above ``max_temperature``.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import require_count
from tca_mj.envs.options import Options
from tca_mj.envs.outcome import how_it_ended
from tca_mj.machine import machine, versions
from tca_mj.model.mujoco_warnings import warning_counts
from tca_mj.pages import made_with, page, table, write_result
from tca_mj.registry import TASKS, find_task, make

WAYS = ("single", "vector", "vector, power")
TURN = 1000  # steps of a turn; in a vector environment of each of its tasks
TASKS_AT_ONCE = 4
_LINE = 30.0  # time between two lines on the progress [s]
_EXAMPLES = 20  # faults that are kept in words
Random = np.random.Generator


class Seen(NamedTuple):
    """What a step of one task has led to.

    Attributes:
        observation: The observation, the last one of an episode that ended.
        reward: What was earned.
        info: What the task said.
        ending: Why the episode is over; None if it goes on.
    """

    observation: NDArray[np.float32]
    reward: float
    info: dict[str, Any]
    ending: str | None


def soak(
    *, steps: int = 1_000_000, seed: int = 0, out: Path | None = None, ids: Sequence[str] = (),
    turn: int = TURN, say: Callable[[str], object] = print,
) -> dict[str, Any]:  # fmt: skip
    """Takes random steps of tasks, and counts.

    Args:
        steps: How many, of all tasks together.
        seed: Seed of all that is drawn.
        out: Folder for ``soak.json``, written after every turn, and ``soak.md``; a soak that is
            there is gone on with. None to write nothing.
        ids: The tasks, also ``module:id``; by default all.
        turn: Steps of a turn, in a vector environment of each of its tasks.
        say: What is called with a line on the progress now and then.

    Returns:
        ``ways``: for each task and way the turns, ``steps``, ``episodes``, processor time
        ``seconds`` [s], ``hottest`` TCA [°C], and counts of ``endings``, ``faults`` and MuJoCo's
        ``warnings``; ``examples`` of faults; ``memory``: run, steps and memory [MB] after each
        turn; ``plan``, ``machine``, ``versions``. ``report`` says what they are.

    Raises:
        ValueError: If a number is below 1, there is no such task, or another soak is in ``out``.
    """
    require_count(steps=steps, turn=turn)
    tasks = list(ids) or [task.id for task in TASKS]
    plan = {"seed": seed, "turn": turn, "tasks": [find_task(id).id for id in tasks]}
    result = _begun(out, plan)
    run = 1 + max((row[0] for row in result["memory"]), default=0)
    made: dict[int, Any] = {}
    spoken = time.monotonic()
    while _total(result) < steps:
        ways = result["ways"]
        number = min(range(len(ways)), key=lambda i: _had(ways[i]))
        way = ways[number]
        start, before = time.process_time(), warning_counts()
        if number not in made:
            made[number] = _make(tasks[number // len(WAYS)], way["way"])
        random = np.random.default_rng([seed, number, way["turns"]])
        _take(made[number], way, random, turn, result["examples"])
        way["warnings"] = Counter(way["warnings"]) + (warning_counts() - before)
        way["turns"] += 1
        way["seconds"] += time.process_time() - start
        result["memory"].append([run, _total(result), _memory()])
        last = _total(result) >= steps
        write_result(out, "soak", result, report(result))
        if last or time.monotonic() > spoken + _LINE:
            spoken = time.monotonic()
            say(_line(result, steps))
    for env in made.values():
        env.close()
    return result


def report(result: dict[str, Any]) -> str:
    """What ``soak`` found, as Markdown."""
    rows = [
        [f"{way['task']}, {way['way']}", f"{way['steps']:,}", f"{way['episodes']:,}",
         f"{1e3 * way['seconds'] / max(way['steps'], 1):.1f} ms",
         f"{way['hottest']:.1f} °C", _counts(way["endings"]), _counts(way["faults"]),
         _counts(way["warnings"])]
        for way in result["ways"]
    ]  # fmt: skip
    grown = [
        f"{steps:,}: {megabytes:.0f} MB" for steps, megabytes in _grown(result)
    ]
    return page(
        [*made_with(result),
         f"{_total(result):,} steps from seed {result['plan']['seed']}, in turns of"
         f" {result['plan']['turn']}"],
        table(["", "steps", "episodes", "processor time of a step", "hottest TCA", "ends", "faults",
               "warnings of MuJoCo"], rows),
        f"Memory of the last process after so many steps: {'; '.join(grown)}" if grown else "",
        *(f"Fault: {each}" for each in result["examples"]),
    )  # fmt: skip


def faults(result: dict[str, Any]) -> int:
    """How many faults a soak has found."""
    return sum(sum(way["faults"].values()) for way in result["ways"])


def _begun(out: Path | None, plan: dict[str, Any]) -> dict[str, Any]:
    """The soak that is in a folder, or a new one."""
    path = None if out is None else out / "soak.json"
    if path is not None and path.is_file():
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if found.get("plan") != plan:
            raise ValueError(f"out must be a folder without another soak, got {out}")
        return found
    return {
        "plan": plan, "machine": machine(), "versions": versions(), "memory": [], "examples": [],
        "ways": [
            {"task": id, "way": way, "turns": 0, "steps": 0, "episodes": 0, "seconds": 0.0,
             "hottest": 0.0, "endings": {}, "faults": {}, "warnings": {}}
            for id in plan["tasks"] for way in WAYS
        ],
    }  # fmt: skip


def _had(way: dict[str, Any]) -> float:
    """How much a way has had: the one with the least is next."""
    seconds: float = way["seconds"]
    return seconds * math.sqrt(seconds / max(way["steps"], 1))


def _make(id: str, way: str) -> Any:
    action = "power" if way.endswith("power") else "temperature"
    if way == "single":
        return make(id, action=action, disable_env_checker=True)
    return gym.make_vec(id, num_envs=TASKS_AT_ONCE, action=action)


def _take(env: Any, way: dict[str, Any], random: Random, turn: int, examples: list[str]) -> None:
    """One turn, whose findings are added to what is known of its way."""
    endings, wrong = Counter(way["endings"]), Counter(way["faults"])
    task = getattr(env, "envs", [env.unwrapped])[0]
    limit = np.inf if task.heating == "power" else task.max_temperature
    steps = 0

    def note(fault: str, more: str = "") -> None:
        wrong[fault] += 1
        if len(examples) < _EXAMPLES:
            where = f"{way['task']}, {way['way']}, turn {way['turns']}, step {steps}"
            examples.append(f"{where}: {fault}{more}")

    try:
        for seen in (_single if way["way"] == "single" else _vector)(env, random, turn):
            steps += 1
            kind, hottest = _kind(seen.ending or ""), np.max(seen.info["temperature"])
            for fault in _wrong(seen, env):
                note(fault)
            if seen.ending is not None:
                endings[kind] += 1
                way["episodes"] += 1
            if kind == "diverged":
                note(kind, f", {seen.ending}")
            if hottest > limit:
                note("TCA too hot", f", {hottest:.1f} °C")
            way["hottest"] = max(way["hottest"], float(hottest))
    except Exception as error:
        note(type(error).__name__, f", {error}")
    way["steps"] += max(steps, 1)  # a way that fails at once does not go on for ever
    way["endings"], way["faults"] = endings, wrong


def _kind(ending: str) -> str:
    """Why an episode ended, without what differs from one to the next."""
    return re.sub(r" at [0-9.]+ s", "", ending.partition(":")[0])


def _wrong(seen: Seen, env: Any) -> Iterator[str]:
    """What is wrong with what a step has led to."""
    space = getattr(env, "single_observation_space", env.observation_space)
    if not np.isfinite(seen.observation).all():
        yield "observation is no number"
    elif not space.contains(seen.observation):
        yield "observation outside its space"
    if not np.isfinite(seen.reward):
        yield "reward is no number"
    for name in ("time", "energy", "temperature", "body_temperature", "tension"):
        if not (np.isfinite(seen.info[name]).all() or (seen.ending or "").startswith("diverged")):
            yield f"{name} in info is no number"


def _single(env: Any, random: Random, steps: int) -> Iterator[Seen]:
    """Steps of one task."""
    over, hand = True, _Hand(random, env.action_space)
    for _ in range(steps):
        if over:
            options = drawn(env.unwrapped.options, random)
            env.reset(seed=int(random.integers(2**31)), options=options)
            hand.change()
        observation, reward, terminated, truncated, info = env.step(hand.act())
        over = terminated or truncated
        yield Seen(observation, reward, info, how_it_ended(terminated, truncated, info))


def _vector(envs: Any, random: Random, steps: int) -> Iterator[Seen]:
    """Steps of all tasks of a vector environment."""
    options, n = envs.envs[0].options, envs.num_envs
    hands = [_Hand(random, envs.single_action_space) for _ in range(n)]
    envs.reset(
        seed=[int(random.integers(2**31)) for _ in range(n)],
        options=[drawn(options, random) for _ in range(n)],
    )
    for _ in range(steps):
        envs.reset_options = drawn(options, random)
        results = envs.step(np.stack([hand.act() for hand in hands]))
        observations, rewards, terminated, truncated, infos = results
        for i, hand in enumerate(hands):
            observation, said = observations[i], infos
            if terminated[i] or truncated[i]:
                observation, said = infos["final_obs"][i], infos["final_info"]
                hand.change()
            info = {
                key: value[i] for key, value in said.items()
                if isinstance(value, np.ndarray) and said.get(f"_{key}", np.zeros(n))[i]
            }
            ending = how_it_ended(bool(terminated[i]), bool(truncated[i]), info)
            yield Seen(observation, float(rewards[i]), info, ending)


class _Hand:
    """Random actions, which change their manner from episode to episode."""

    def __init__(self, random: Random, space: Any) -> None:
        self._random, self._space = random, space
        self.change()

    def change(self) -> None:
        """Another manner: at random, at the bounds, or held for some steps."""
        self._manner = self._random.choice(["random", "bounds", "held"])
        self._left, self._action = 0, self._space.low

    def act(self) -> NDArray[np.float32]:
        """An action."""
        low, high = self._space.low, self._space.high
        if self._manner == "bounds":
            return np.where(self._random.random(low.shape) < 0.5, low, high)
        if self._manner == "random" or not self._left:
            self._action = self._random.uniform(low, high).astype(np.float32)
            self._left = int(self._random.integers(5, 100))
        self._left -= 1
        return self._action


def drawn(options: Options, random: Random) -> dict[str, Any] | None:
    """Values of some options, each within its bounds, factors by their logarithm; or None."""
    found: dict[str, Any] = {}
    for row in options.rows:
        chosen = random.random() < 0.4
        if row.choices:
            value: Any = str(random.choice(row.choices))
        elif 0.0 < 10.0 * row.low <= row.high:  # factors: as often below 1 as above
            value = float(np.exp(random.uniform(np.log(row.low), np.log(row.high))))
        elif np.isfinite([row.low, row.high]).all():
            value = random.uniform(row.low, row.high, row.shape or None)
        else:
            continue
        try:
            row.checked(value)
        except ValueError:  # within the bounds, and yet impossible
            continue
        if chosen:
            found[row.name] = value
    return found if random.random() < 0.5 else None


def _total(result: dict[str, Any]) -> int:
    return sum(way["steps"] for way in result["ways"])


def _memory() -> float:
    """Memory of this process [MB]: what it has now, or, where the system does not say, the most."""
    status = Path("/proc/self/statm")
    if status.is_file():
        pages = int(status.read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    if sys.platform == "win32":
        return float("nan")
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / (1e6 if sys.platform == "darwin" else 1e3)


def _grown(result: dict[str, Any]) -> list[tuple[int, float]]:
    """Steps and memory of the last process: when every way has had a turn, at 10 %, at the end."""
    memory = result["memory"]
    rows = [(steps, megabytes) for run, steps, megabytes in memory if run == memory[-1][0]]
    rows = rows[len(result["ways"]) - 1 :]
    if len(rows) < 3:
        return rows
    tenth = rows[0][0] + 0.1 * (rows[-1][0] - rows[0][0])
    return [rows[0], next(row for row in rows[1:] if row[0] >= tenth), rows[-1]]


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in Counter(counts).most_common())


def _line(result: dict[str, Any], steps: int) -> str:
    ways = result["ways"]
    warned = sum(sum(way["warnings"].values()) for way in ways)
    return (
        f"{_total(result):,} of {steps:,} steps, {sum(way['episodes'] for way in ways):,} episodes,"
        f" {sum(way['seconds'] for way in ways) / 60.0:.0f} min of processor time:"
        f" {faults(result)} faults, {warned} warnings of MuJoCo, {result['memory'][-1][2]:.0f} MB"
    )

"""How fast many tasks run here: one by one, together on one thread and on two, and in training.

Several tasks of each kind go the same way, step by step, under random actions with everything in
contact that touches: first as single environments in turn, then as a vector environment. As the
two are the same bit for bit, so is the work. Every way is taken several times, in turns, and of
each step the fastest counts, because what else runs on a machine only slows it. What one thread
does is compared in processor time; how much faster two are, by the clock on the wall, which holds
only on a machine with two idle cores. The processor time in MuJoCo's calls says what two idle
cores would make of it, if nothing but these calls were shared.

For comparison Gymnasium's Ant-v5, and the bare ``mj_step`` calls of every environment: as many
from the same state in one call, with the TCAs held as they were.
"""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from tca_mj.agents.progress import progress_bar
from tca_mj.bench.clock import Replay, in_physics, stopwatch
from tca_mj.checks import number
from tca_mj.envs.task import SimulatedTask
from tca_mj.envs.vector import TaskVector
from tca_mj.machine import machine, versions
from tca_mj.pages import made_with, page, table, write_result
from tca_mj.registry import TASKS, recipes

# What is aimed at: steps per second on two threads over those on one, and on one thread over those
# of single environments; for tasks whose physics is most of the work.
TARGETS = {"two_threads": 1.7, "per_thread": 1.0}
_PEER = "Ant-v5"
Actions = np.ndarray[Any, np.dtype[np.float32]]
Times = dict[str, list[float]]


def benchmark(
    *, scale: float = 1.0, out: Path | None = None, ids: Sequence[str] = (), num_envs: int = 32,
) -> dict[str, Any]:  # fmt: skip
    """Measures everything, about five minutes.

    Args:
        scale: Share of the full number of steps and repetitions.
        out: Folder for ``vector.json`` and ``vector.md``; None to write nothing.
        ids: The tasks, also ``module:id``; by default all. The first of them that states for how
            long it is learned, or else the first, is the one that is trained.
        num_envs: How many of each kind; a thread waits for the other at the end of each step, which
            matters the less, the more there are.

    Returns:
        ``machine``, ``versions``, ``load`` (before and after), ``tasks`` and ``training``, with
        times per step of one task in s; ``report`` says what they are. What cannot be measured,
        as a package is missing, is left out: ``left_out`` says why.

    Raises:
        ValueError: If ``scale`` is not above 0 and at most 1, or there is no such task.
    """
    number("scale", scale, above=0.0, at_most=1.0)
    n, steps, repetitions = num_envs, max(int(8 * scale), 2), max(int(4 * scale), 1)
    result: dict[str, Any] = {
        "machine": machine(), "versions": versions(), "load": [os.getloadavg()[0]],
        "num_envs": n, "steps": steps, "repetitions": repetitions,
        "tasks": {}, "training": {}, "by_recipe": {}, "left_out": {},
    }  # fmt: skip
    chosen = list(ids) or [task.id for task in TASKS]
    trained = next((id for id in chosen if recipes(id)), chosen[0])
    with progress_bar(len(chosen) + 1, unit="tasks", leave=False) as bar:
        for id in [*chosen, _PEER]:
            with _if_installed(id, result):
                result["tasks"][id] = _task(id, n, steps, repetitions)
            bar.update()
    with _if_installed("training", result):
        result["training"] = _training(trained, max(int(1024 * scale), 64), min(n, 8))
    held = [id for id in chosen if any(recipe.scaled for recipe in recipes(id).values())]
    coarser = [id for id in held if any(recipe.timestep for recipe in recipes(id).values())]
    by_recipe = next(iter(coarser + held), None)
    if by_recipe is not None:
        with _if_installed("by_recipe", result):
            result["by_recipe"] = _by_recipe(by_recipe, max(int(800 * scale), 64))
    result["load"].append(os.getloadavg()[0])
    write_result(out, "vector", result, report(result))
    return result


def report(result: dict[str, Any]) -> str:
    """What ``benchmark`` measured, as Markdown."""
    load = result["load"]
    rates, ratios = [], []
    for id, row in result["tasks"].items():
        single, vector = row["single"], row["vector"]
        walls = [single["wall"], *(times["wall"] for times in vector.values())]
        cells = [f"{1.0 / wall:.0f}" for wall in walls] + [""] * (3 - len(walls))
        rates.append([id, *cells, f"{row['physics_steps'] / walls[-1]:,.0f}"])
        pairs = [(single["cpu"], single[name]) for name in ("inside", "bare")]
        if vector:
            one, two = vector["1"], vector["2"]
            shared = one["cpu"] - 0.5 * one["inside"]
            pairs += [(single["cpu"], one["cpu"]), (one["wall"], two["wall"]), (one["cpu"], shared)]
        cells = [f"{slow / fast:.2f}" for slow, fast in pairs]
        ratios.append([id, *cells, *[""] * (5 - len(cells))])
    trained = [[name, f"{rate:.0f}"] for name, rate in result["training"].items()]
    learned = [[name, f"{rate:.1f}", f"{rate * period:.1f}"]
               for name, (rate, period) in result["by_recipe"].items()]  # fmt: skip
    return page(
        [*made_with(result),
         f"{result['num_envs']} tasks of each kind, {result['steps']} steps, of each the fastest of"
         f" {result['repetitions']}; load of the machine: {load[0]:.1f} before, {load[1]:.1f}"
         " after"],
        table(["env steps per second", "single", "vector, 1 thread", "vector, 2 threads",
               "physics steps per second, 2 threads"], rates),
        table(["", "single env.step over its mj_steps", "over bare mj_steps",
               f"one thread, vector over single (aim: {TARGETS['per_thread']:g})",
               f"2 threads over 1 (aim: {TARGETS['two_threads']:g})", "by processor time"],
              ratios),
        table(["training with PPO", "frames per second"], trained) if trained else "",
        table(["training by a task's recipe, its learning included", "decisions per second",
               "seconds of the robot per second"], learned) if learned else "",
        *(f"Left out: {name}, {why}" for name, why in result["left_out"].items()),
    )  # fmt: skip


@contextmanager
def _if_installed(name: str, result: dict[str, Any]) -> Iterator[None]:
    try:
        yield
    except (ImportError, gym.error.DependencyNotInstalled) as error:
        result["left_out"][name] = str(error)


def _task(id: str, n: int, steps: int, repetitions: int) -> dict[str, Any]:
    """Times of all ways to step n tasks of a kind, per step of one task [s]."""
    first = gym.make(id)
    singles = [first, *(deepcopy(first) for _ in range(n - 1))]
    vectors: dict[str, Any] = {}
    if isinstance(first.unwrapped, SimulatedTask):
        vectors = {str(k): gym.make_vec(id, num_envs=n, num_threads=k) for k in (1, 2)}
    space = first.action_space
    assert isinstance(space, gym.spaces.Box) and space.shape is not None
    drawn = np.random.default_rng(0).uniform(space.low, space.high, (steps, n, *space.shape))
    actions = drawn.astype(np.float32)
    found = []
    for _ in range(repetitions):
        ways = {"single": _single(singles, actions)}
        found.append(ways | {k: _vector(envs, actions) for k, envs in vectors.items()})
    count = Replay(first.unwrapped).count
    for env in (*singles, *vectors.values()):
        env.close()
    # Every repetition does the same in its k-th step.
    best = {
        way: {
            name: float(np.min([taken[way][name] for taken in found], axis=0).sum()) / (n * steps)
            for name in found[0][way]
        }
        for way in found[0]
    }
    return {"physics_steps": count, "single": best.pop("single"), "vector": best}


def _both(call: Callable[[], Any], times: Times) -> Any:
    """Adds the time of a call on the wall and of the processor."""
    start, began = time.perf_counter(), time.thread_time()
    result = call()
    times["cpu"].append(time.thread_time() - began)
    times["wall"].append(time.perf_counter() - start)
    return result


def _single(envs: Sequence[gym.Env[Any, Any]], actions: Actions) -> Times:
    """Times of each step: on the wall, of the processor, of it in mj_step, of a bare replay."""
    replays = [Replay(env.unwrapped) for env in envs]
    for i, env in enumerate(envs):
        env.reset(seed=i)
    times: Times = {name: [] for name in ("wall", "cpu", "inside", "bare")}
    for row in actions:
        for env, replay, action in zip(envs, replays, row, strict=True):
            replay.keep()
            with in_physics() as inside:
                _, _, terminated, truncated, _ = _both(partial(env.step, action), times)
            times["inside"].append(inside.seconds)
            times["bare"].append(replay.seconds())
            if terminated or truncated:
                env.reset()
    return times


def _vector(envs: TaskVector, actions: Actions) -> Times:
    """Times of each step of all: on the wall, of the caller's thread, of it in MuJoCo's calls."""
    envs.reset(seed=0)
    times: Times = {name: [] for name in ("wall", "cpu", "inside")}
    physics = envs.batch.physics
    for row in actions:
        with (
            stopwatch(physics, "step") as step,
            stopwatch(physics, "forward") as forward,
            stopwatch(envs, "restart") as restart,
        ):
            _both(partial(envs.step, row), times)
        for clock in ("wall", "cpu"):
            times[clock][-1] -= restart.seconds
        times["inside"].append(step.seconds + forward.seconds)
    return times


def _training(id: str, frames: int, n: int) -> dict[str, float]:
    """Frames per second of PPO on the wall, its updates included, with one thread of torch."""
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

    from tca_mj.agents.train.sb3_env import TaskVecEnv, silence

    def one_by_one(id: str) -> VecEnv:
        return DummyVecEnv([lambda: gym.make(id)] * n)

    ways: dict[str, Callable[[], VecEnv]] = {
        f"{id}, {n} single tasks (DummyVecEnv)": partial(one_by_one, id),
        f"{id}, {n} tasks on 1 thread": partial(TaskVecEnv.make, id, n, num_threads=1),
        f"{id}, {n} tasks on 2 threads": partial(TaskVecEnv.make, id, n, num_threads=2),
        f"{_PEER}, {n} single tasks (DummyVecEnv)": partial(one_by_one, _PEER),
    }
    threads, rollout = torch.get_num_threads(), max(frames // (2 * n), 1)
    torch.set_num_threads(1)
    rates = {}
    try:
        for name, make in ways.items():
            envs = make()
            learner = PPO(
                "MlpPolicy", envs, n_steps=rollout, batch_size=rollout * n, seed=0, device="cpu"
            )
            silence(learner)
            start = time.perf_counter()
            learner.learn(2 * rollout * n)
            rates[name] = 2 * rollout * n / (time.perf_counter() - start)
            envs.close()
    finally:
        torch.set_num_threads(threads)
    return rates


def _by_recipe(id: str, decisions: int) -> dict[str, tuple[float, float]]:
    """Decisions per second of processor time, and the time of one [s], of a task's recipe.

    The same learner with the same settings, but for mirrored memories, learns the peer beside it.
    """
    import torch
    from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

    from tca_mj.agents.train.config import OffPolicy, default_config
    from tca_mj.agents.train.deep import learner
    from tca_mj.agents.train.sb3_env import TaskVecEnv, silence

    config = default_config(id)
    assert isinstance(config.learner, OffPolicy)  # they alone have mirrored memories
    config = replace(config, learner=replace(config.learner, learning_starts=config.envs))
    peer: Any = gym.make(_PEER).unwrapped
    own = {} if config.timestep is None else {"timestep": config.timestep}
    tasks = TaskVecEnv.make(
        id, config.envs, scaled=True, num_threads=1, reset_options=dict(config.options),
        **config.arguments, **own,
    )  # fmt: skip
    peers = DummyVecEnv([lambda: gym.make(_PEER)] * config.envs)
    ways: list[tuple[str, Any, VecEnv, float]] = [
        (f"{id} ({config.algorithm.upper()})", config, tasks, config.arguments["control_period"]),
        (f"{_PEER}, the same settings", replace(config, mirrored=False), peers, peer.dt),
    ]
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    rates = {}
    try:
        for name, settings, envs, period in ways:
            model = learner(settings, envs)
            silence(model)
            start = time.process_time()
            model.learn(decisions)
            rates[name] = decisions / (time.process_time() - start), period
            envs.close()
    finally:
        torch.set_num_threads(threads)
    return rates

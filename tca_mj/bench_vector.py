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

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from tca_mj.bench import Stopwatch
from tca_mj.envs.vector import TaskVector
from tca_mj.machine import machine, versions
from tca_mj.registry import TASKS

# What is aimed at: steps per second on two threads over those on one, and on one thread over those
# of single environments; for the arm and the tetrapod, whose physics is most of the work.
TARGETS = {"two_threads": 1.7, "per_thread": 1.0}
_PEER = "Ant-v5"
_TRAINED = "TCA/TetrapodWalk-v0"
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
Actions = NDArray[np.float32]


def benchmark(
    *,
    scale: float = 1.0,
    out: Path | None = None,
    ids: Sequence[str] | None = None,
    num_envs: int = 32,
) -> dict[str, Any]:
    """Measures everything, about five minutes.

    Args:
        scale: Share of the full number of steps and repetitions.
        out: Folder for ``vector.json`` and ``vector.md``; None to write nothing.
        ids: The tasks; None for all.
        num_envs: How many of each kind; a thread waits for the other at the end of each step, which
            matters the less, the more there are.

    Returns:
        ``machine``, ``versions``, ``load`` (before and after), ``tasks`` and ``training``, with
        times per step of one task in s; ``report`` says what they are. What cannot be measured,
        as a package is missing, is left out: ``left_out`` says why.

    Raises:
        ValueError: If ``scale`` is not above 0 and at most 1.
    """
    if not 0.0 < scale <= 1.0:
        raise ValueError(f"scale must be above 0 and at most 1, got {scale}")
    n, steps, repetitions = num_envs, max(int(8 * scale), 2), max(int(4 * scale), 1)
    result: dict[str, Any] = {
        "machine": machine(), "versions": versions(), "load": [os.getloadavg()[0]],
        "num_envs": n, "steps": steps, "repetitions": repetitions,
        "tasks": {}, "training": {}, "left_out": {},
    }  # fmt: skip
    chosen = [task.id for task in TASKS] if ids is None else list(ids)
    for id in tqdm([*chosen, _PEER], disable=None, unit="task", leave=False):
        with _if_installed(id, result):
            result["tasks"][id] = _task(id, n, steps, repetitions)
    with _if_installed("training", result):
        result["training"] = _training(max(int(1024 * scale), 64), min(n, 8))
    result["load"].append(os.getloadavg()[0])
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        text = json.dumps(result, indent=2, ensure_ascii=False) + "\n"
        (out / "vector.json").write_text(text, encoding="utf-8")
        (out / "vector.md").write_text(report(result) + "\n", encoding="utf-8")
    return result


def report(result: dict[str, Any]) -> str:
    """What ``benchmark`` measured, as Markdown."""
    where, load = result["machine"], result["load"]
    kept = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    lines = [
        f"{where['cpu']}, {where['cores']} cores; {where['system']}",
        kept,
        f"{result['num_envs']} tasks of each kind, {result['steps']} steps, of each the fastest"
        f" of {result['repetitions']}; load of the machine: {load[0]:.1f} before,"
        f" {load[1]:.1f} after",
        "",
        "| env steps per second | single | vector, 1 thread | vector, 2 threads"
        " | physics steps per second, 2 threads |",
        "|---|---|---|---|---|",
    ]
    for id, row in result["tasks"].items():
        cells = [f"{1.0 / row['single']['wall']:.0f}"]
        for threads in ("1", "2"):
            vector = row["vector"].get(threads)
            cells.append(f"{1.0 / vector['wall']:.0f}" if vector else "")
        fastest = row["vector"].get("2", row["single"])["wall"]
        cells.append(f"{row['physics_steps'] / fastest:,.0f}")
        lines.append(f"| {id} | {' | '.join(cells)} |")
    lines += [
        "",
        "| | single env.step over its mj_steps | over bare mj_steps"
        f" | one thread, vector over single (aim: {TARGETS['per_thread']:g})"
        f" | 2 threads over 1 (aim: {TARGETS['two_threads']:g}) | by processor time |",
        "|---|---|---|---|---|---|",
    ]
    for id, row in result["tasks"].items():
        single, vector = row["single"], row["vector"]
        cells = [f"{single['cpu'] / single[name]:.2f}" for name in ("inside", "bare")]
        if vector:
            one, two = vector["1"], vector["2"]
            rest = one["cpu"] - one["inside"]
            cells += [
                f"{single['cpu'] / one['cpu']:.2f}",
                f"{one['wall'] / two['wall']:.2f}",
                f"{one['cpu'] / (rest + 0.5 * one['inside']):.2f}",
            ]
        else:
            cells += [""] * 3
        lines.append(f"| {id} | {' | '.join(cells)} |")
    if result["training"]:
        lines += ["", "| training with PPO | frames per second |", "|---|---|"]
        lines += [f"| {name} | {rate:.0f} |" for name, rate in result["training"].items()]
    lines += [f"\nLeft out: {name}, {why}" for name, why in result["left_out"].items()]
    return "\n".join(lines)


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
    task: Any = first.unwrapped
    vectors: dict[str, Any] = {}
    if id.startswith("TCA/"):
        vectors = {str(k): gym.make_vec(id, num_envs=n, num_threads=k) for k in (1, 2)}
    space = first.action_space
    assert isinstance(space, gym.spaces.Box) and space.shape is not None
    drawn = np.random.default_rng(0).uniform(space.low, space.high, (steps, n, *space.shape))
    actions = drawn.astype(np.float32)
    found = []
    for _ in range(repetitions):
        ways = {"single": _single(singles, actions)}
        found.append(ways | {k: _vector(envs, actions) for k, envs in vectors.items()})
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
    return {
        "physics_steps": round(task.dt / task.model.opt.timestep),
        "single": best.pop("single"),
        "vector": best,
    }


def _single(envs: Sequence[gym.Env[Any, Any]], actions: Actions) -> dict[str, list[float]]:
    """Times of each step: on the wall, of the processor, of it in mj_step, of a bare replay."""
    tasks: list[Any] = [env.unwrapped for env in envs]
    beside = [mujoco.MjData(task.model) for task in tasks]
    state = np.empty(mujoco.mj_stateSize(tasks[0].model, _STATE))
    count = round(tasks[0].dt / tasks[0].model.opt.timestep)
    for i, env in enumerate(envs):
        env.reset(seed=i)
    times: dict[str, list[float]] = {name: [] for name in ("wall", "cpu", "inside", "bare")}
    for row in actions:
        for env, task, data, action in zip(envs, tasks, beside, row, strict=True):
            mujoco.mj_getState(task.model, task.data, state, _STATE)
            with Stopwatch(mujoco, "mj_step") as inside:
                start, began = time.perf_counter(), time.thread_time()
                _, _, terminated, truncated, _ = env.step(action)
                times["cpu"].append(time.thread_time() - began)
                times["wall"].append(time.perf_counter() - start)
            times["inside"].append(inside.seconds)
            mujoco.mj_setState(task.model, data, state, _STATE)
            began = time.thread_time()
            mujoco.mj_step(task.model, data, count)
            times["bare"].append(time.thread_time() - began)
            if terminated or truncated:
                env.reset()
    return times


def _vector(envs: TaskVector, actions: Actions) -> dict[str, list[float]]:
    """Times of each step of all: on the wall, of the caller's thread, of it in MuJoCo's calls."""
    envs.reset(seed=0)
    times: dict[str, list[float]] = {name: [] for name in ("wall", "cpu", "inside")}
    physics = envs.batch.physics
    for row in actions:
        with (
            Stopwatch(physics, "step") as step,
            Stopwatch(physics, "forward") as forward,
            Stopwatch(envs, "restart") as restart,
        ):
            start, began = time.perf_counter(), time.thread_time()
            envs.step(row)
            times["cpu"].append(time.thread_time() - began - restart.seconds)
            times["wall"].append(time.perf_counter() - start - restart.seconds)
        times["inside"].append(step.seconds + forward.seconds)
    return times


def _training(frames: int, n: int) -> dict[str, float]:
    """Frames per second of PPO on the wall, its updates included, with one thread of torch."""
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

    from tca_mj.agents.sb3_env import TaskVecEnv

    ways: dict[str, Callable[[], VecEnv]] = {
        f"{_TRAINED}, {n} single tasks (DummyVecEnv)": lambda: DummyVecEnv(
            [lambda: gym.make(_TRAINED)] * n
        ),
        f"{_TRAINED}, {n} tasks on 1 thread": lambda: TaskVecEnv.make(_TRAINED, n, num_threads=1),
        f"{_TRAINED}, {n} tasks on 2 threads": lambda: TaskVecEnv.make(_TRAINED, n, num_threads=2),
        f"{_PEER}, {n} single tasks (DummyVecEnv)": lambda: DummyVecEnv(
            [lambda: gym.make(_PEER)] * n
        ),
    }
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    rates = {}
    try:
        for name, make in ways.items():
            envs = make()
            rollout = max(frames // (2 * n), 1)
            learner = PPO(
                "MlpPolicy", envs, n_steps=rollout, batch_size=rollout * n, seed=0, device="cpu"
            )
            start = time.perf_counter()
            learner.learn(2 * rollout * n)
            rates[name] = 2 * rollout * n / (time.perf_counter() - start)
            envs.close()
    finally:
        torch.set_num_threads(threads)
    return rates

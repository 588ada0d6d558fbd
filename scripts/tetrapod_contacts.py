"""Contacts and cost of the tetrapod's scripted gaits; prints the table of docs/tetrapod.md.

    python scripts/tetrapod_contacts.py    half a minute; the last two rows want an idle core

Slide: the largest way of a foot while the robot stands for 20 s. Deepest: the deepest contact in
any physics step of 60 s. Half: the distance at half the time step over that at the whole one, after
12, 10 and 28 s. Time: of ``env.step``, the fastest of three runs of 20 s; over its physics steps.
"""

import time
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np

from tca_mj.agents.tetrapod_gaits import GAITS, GaitPolicy
from tca_mj.envs.tetrapod import ACTION, TetrapodGait
from tca_mj.machine import machine, versions

HALVED = {"crawl": 120, "walk": 100, "shimmy": 280}  # control steps
STEP = mujoco.mj_step


def follow(env: TetrapodGait, steps: int) -> float:
    """Distance that the script covers in some control steps [m]."""
    policy = GaitPolicy.of(env.gait)
    observation, info = env.reset(seed=0)
    for _ in range(steps):
        observation, *_, info = env.step(policy.act(observation))
    return float(info["distance"])


def slide(gait: str) -> float:
    """Largest shift of a foot while nothing is heated for 20 s [m]."""
    env = TetrapodGait(gait=gait)
    env.reset(seed=0)
    before = env.data.site_xpos[env.stance.feet].copy()
    for _ in range(200):
        env.step(np.full(ACTION.size, -1.0, dtype=np.float32))
    return float(np.linalg.norm(env.data.site_xpos[env.stance.feet] - before, axis=1).max())


def deepest(gait: str) -> tuple[float, float]:
    """Deepest contact in any physics step of 60 s [m], and the mean number of contacts."""
    depths, counts = [0.0], []

    def watched(model: Any, data: Any, steps: int = 1) -> None:
        for _ in range(steps):
            STEP(model, data)
            counts.append(data.ncon)
            depths.append(-data.contact.dist.min() if data.ncon else 0.0)

    with patch.object(mujoco, "mj_step", watched):
        follow(TetrapodGait(gait=gait), 600)
    return float(max(depths)), float(np.mean(counts))


def cost(gait: str, steps: int = 200) -> tuple[float, float]:
    """Time of ``env.step`` [s], and that over the time of its physics steps."""
    env, policy, inside = TetrapodGait(gait=gait), GaitPolicy.of(gait), [0.0]

    def timed(*arguments: Any) -> None:
        start = time.perf_counter()
        STEP(*arguments)
        inside[0] += time.perf_counter() - start

    found = []
    for _ in range(3):
        policy.reset()
        observation, _ = env.reset(seed=0)
        whole, inside[0] = 0.0, 0.0
        with patch.object(mujoco, "mj_step", timed):
            for _ in range(steps):
                action = policy.act(observation)
                start = time.perf_counter()
                observation, *_ = env.step(action)
                whole += time.perf_counter() - start
        found.append((whole / steps, whole / inside[0]))
    return min(found)


def main() -> None:
    """Prints machine, versions and the table."""
    rows: dict[str, list[str]] = {}
    for gait in GAITS:
        depth, contacts = deepest(gait)
        whole, half = (
            follow(TetrapodGait(gait=gait, timestep=dt), HALVED[gait]) for dt in (5e-3, 2.5e-3)
        )
        seconds, ratio = cost(gait)
        for name, value in {
            "slide": f"{1e3 * slide(gait):.2f} mm",
            "deepest": f"{1e3 * depth:.2f} mm",
            "contacts at a time": f"{contacts:.0f}",
            "half the time step": f"{100.0 * (half / whole - 1.0):+.1f} %",
            "env.step": f"{1e3 * seconds:.1f} ms, {0.1 / seconds:.0f} times real time",
            "env.step over its physics": f"{ratio:.2f}",
        }.items():
            rows.setdefault(name, []).append(value)
    about = {**machine(), **versions()}
    print("; ".join(f"{key} {value}" for key, value in about.items()))
    print(f"\n| | {' | '.join(GAITS)} |\n|---|---|---|---|")
    print("\n".join(f"| {name} | {' | '.join(cells)} |" for name, cells in rows.items()))


if __name__ == "__main__":
    main()

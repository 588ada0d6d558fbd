"""What a step of each task costs besides its physics, one task at a time.

    python scripts/step_ratio.py              prints a table
    python scripts/step_ratio.py --keep NAME  and keeps it by that name in docs/step_ratio.json
    python scripts/step_ratio.py --page       writes what is kept into docs/benchmarks.md

It runs in a checkout of an older version, too, and keeps there what can be carried over.
Random actions in the lower half of their range, 60 steps; of each step the fastest of 5, by the
clock, which leaves out what other programs took; the median over the steps.
"""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np

import tca_mj

ROOT = Path(__file__).resolve().parent.parent
KEPT, PAGE = ROOT / "docs" / "step_ratio.json", ROOT / "docs" / "benchmarks.md"
MARK = "scripts/step_ratio.py"
STEPS, REPEATS = 60, 5

_step = mujoco.mj_step


def measured(task: str) -> dict[str, float]:
    """Times of ``env.step`` and of the ``mj_step`` calls in it [s], and their ratio."""
    inside = 0

    def timed(*arguments: Any) -> None:
        nonlocal inside
        began = time.perf_counter_ns()
        _step(*arguments)
        inside += time.perf_counter_ns() - began

    env: Any = gym.make(task, disable_env_checker=True).unwrapped
    actions = np.random.default_rng(0).uniform(-1.0, 0.0, (STEPS, *env.action_space.shape))
    times = np.empty((REPEATS, STEPS, 2))
    mujoco.mj_step = timed
    try:
        for row in times:
            env.reset(seed=0)
            for i, action in enumerate(actions.astype(np.float32)):
                inside, began = 0, time.perf_counter_ns()
                _, _, terminated, truncated, _ = env.step(action)
                row[i] = time.perf_counter_ns() - began, inside
                if terminated or truncated:
                    env.reset(seed=0)
    finally:
        mujoco.mj_step = _step
        env.close()
    whole, physics = times[times[..., 0].argmin(axis=0), np.arange(STEPS)].T * 1e-9
    return {
        "step": float(np.median(whole)), "physics": float(np.median(physics)),
        "ratio": float(np.median(whole / physics)),
    }  # fmt: skip


def lines(kept: dict[str, Any]) -> list[str]:
    """The table of what was kept, one column for each name."""
    names = list(kept)
    rows = ["| | " + " | ".join(f"{name}: env.step, mj_steps in it | ratio" for name in names)]
    rows += ["|---" * (1 + 2 * len(names))]
    for task in kept[names[-1]]:
        cells = [task]
        for name in names:
            found = kept[name].get(task)
            cells += ["", ""] if found is None else [
                f"{1e3 * found['step']:.3g}, {1e3 * found['physics']:.3g} ms",
                f"{found['ratio']:.2f}",
            ]  # fmt: skip
        rows.append("| " + " | ".join(cells))
    return [row + " |" for row in rows]


def main() -> int:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", metavar="NAME", help="what to keep the times as")
    parser.add_argument("--page", action="store_true", help="write what is kept into the page")
    asked = parser.parse_args()
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    if asked.page:
        from tca_mj.pages import write_between  # no older version has it

        write_between(PAGE, MARK, lines(kept))
        return 0
    tasks = [task for task in gym.registry if task.startswith("TCA/")]
    found = {task: measured(task) for task in tasks}
    print("\n".join(lines({f"tca-mj {tca_mj.__version__}": found})))
    if asked.keep:
        KEPT.write_text(json.dumps(kept | {asked.keep: found}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

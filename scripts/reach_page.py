"""The picture and the tables of docs/reach.md.

    python scripts/reach_page.py                    draws docs/pictures/reach.png
    python scripts/reach_page.py --tables           prints the tables; takes four minutes
"""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np

from tca_mj.agents.scripts.reach import ReachPolicy
from tca_mj.drive import SimulationDiverged
from tca_mj.envs.hanging import NoRest, StaticTip
from tca_mj.envs.reach import ACTION, BendReach
from tca_mj.modules.bending import BendingSpec
from tca_mj.pages import folder_of_pictures

Act = Callable[[Any], Any]
SEEDS = range(20)


def episode(env: BendReach, act: Act, seed: int, **options: float) -> dict[str, Any]:
    """The last information of an episode, its return, and where the tip is after 20 s."""
    observation, info = env.reset(seed=seed, options=options)
    total, ended, last = 0.0, False, info
    for _ in range(200):
        observation, reward, terminated, truncated, info = env.step(act(observation))
        if not ended:
            total, ended, last = total + reward, terminated or truncated, info
    return {**last, "return": total, "stays": info["distance_to_target"]}


def baselines() -> str:
    """What does what, as Markdown."""
    env, policy = BendReach(action="power"), ReachPolicy()
    blind = ReachPolicy(averaging=1e9)  # so long that it learns nothing of what it misses
    random = np.random.default_rng(0)

    def fresh(script: ReachPolicy) -> Act:
        script.reset()
        return script.act

    agents: dict[str, Callable[[], Act]] = {
        "script": lambda: fresh(policy),
        "script without feedback": lambda: fresh(blind),
        "random": lambda: lambda seen: random.uniform(-1, 1, ACTION.size).astype(np.float32),
        "off": lambda: lambda seen: np.full(ACTION.size, -1.0, np.float32),
    }
    lines = [
        "| agent | module | at the target | after [s] | return | energy [J] | hottest [°C]"
        " | off after 20 s [mm] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, start in agents.items():
        for module, spread in (("nominal", 0.0), ("± 20 %", 0.2)):
            ends = [episode(env, start(), seed, randomise=spread) for seed in SEEDS]
            won = [end for end in ends if end["success"]]
            times = np.array([end["time"] for end in won])
            after = f"{np.median(times):.1f}" if won else ""
            after += f" ({times.min():.1f} to {times.max():.1f})" if won else ""
            stays = 1e3 * np.array([end["stays"] for end in ends])
            energy = np.mean([end["energy"].sum() for end in ends])
            lines.append(
                f"| {name} | {module} | {len(won)} of {len(ends)} | {after}"
                f" | {np.mean([end['return'] for end in ends]).round(1) + 0.0:.1f} | {energy:.0f}"
                f" | {max(end['temperature'].max() for end in ends):.0f}"
                f" | {np.median(stays):.2f} (at most {stays.max():.2f}) |"
            )
    return "\n".join(lines)


def history(cases: int = 60) -> str:
    """Whether the place of rest depends on what was before, as Markdown."""
    lines = ["| hottest | gain 0.8 | gain 1 | gain 1.2 | gain 1.5 |", "|---|---|---|---|---|"]
    static = StaticTip(BendingSpec())
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    for hottest in (130.0, 140.0, 150.0, 160.0, 170.0):
        row = []
        for gain in (0.8, 1.0, 1.2, 1.5):
            static.sim.gain = gain
            random, worst = np.random.default_rng(0), 0.0
            shares = [*corners, *random.uniform(0.0, 1.0, (cases - len(corners), 3))]
            restless = 0
            for share in shares:
                ends = 25.0 + share * (hottest - 25.0)
                try:
                    rest = static.at(ends)
                    static.at(25.0 + random.uniform(0.0, 1.0, 3) * (hottest - 25.0))
                except (NoRest, SimulationDiverged):
                    restless += 1
                    continue
                static.sim.step(static.sim.keep(ends), 6.0)
                worst = max(worst, float(np.linalg.norm(static.tip() - rest)))
            row.append(f"{1e6 * worst:.0f} µm" + (f", {restless} without rest" if restless else ""))
        lines.append(f"| {hottest:.0f} °C | {' | '.join(row)} |")
    return "\n".join(lines)


def picture(path: Path) -> None:
    """Cold, and at three targets."""
    env = BendReach(action="power", render_mode="rgb_array", size=(400, 440))
    policy = ReachPolicy()
    panels = []
    for seed, steps in ((4, 0), (4, 200), (8, 200), (10, 200)):
        observation, _ = env.reset(seed=seed)
        policy.reset()
        for _ in range(steps):
            observation, _, terminated, _, _ = env.step(policy.act(observation))
            if terminated:
                break
        panels.append(env.render())
    env.close()
    imageio.imwrite(path, np.concatenate([p for p in panels if p is not None], axis=1))


def main() -> None:
    out = folder_of_pictures(__doc__, Path("docs/pictures"))
    if out is None:
        print(baselines(), history(), sep="\n\n", flush=True)
    else:
        picture(out / "reach.png")


if __name__ == "__main__":
    main()

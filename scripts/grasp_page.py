"""The picture and the tables of docs/grasp.md.

    python scripts/grasp_page.py                    draws docs/pictures/grasp.png
    python scripts/grasp_page.py --tables           prints the tables; about a minute of one core
"""

import math
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np

from tca_mj import pages
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.scripts.grasp import GraspPolicy
from tca_mj.agents.workers import Workers
from tca_mj.envs.grasp import Grasp
from tca_mj.validation.gripping import pinched

SEEDS = range(20)
MOMENTS = {"open": 3.0, "close": 1.2, "hold": 1.0, "release": 1.0}  # after a phase begins [s]


def run(seed: int, spread: float) -> dict[str, Any]:
    """What happened in one episode of the script."""
    env, policy = Grasp(), GraspPolicy()
    observation, info = env.reset(seed=seed, options={"randomise": spread})
    ended, hottest, holding = False, 0.0, 0.0
    while not ended:
        phase, before = policy.phase, info["energy"][0]
        observation, _, terminated, truncated, info = env.step(policy.act(observation))
        ended, hottest = terminated or truncated, max(hottest, float(info["temperature"][0]))
        holding += float(info["energy"][0] - before) if phase in ("lift", "hold") else 0.0
    why = info.get("termination_reason") or info.get("truncation_reason") or ""
    return env.outcome() | {
        "stiffness": float(env.model.jnt_stiffness[env._sides[0]]) / 2.0, "why": why,
        "success": info["success"], "time": info["time"], "energy": float(info["energy"][0]),
        "hottest": hottest, "holding": holding,
    }  # fmt: skip


def spread_of(values: list[float], digits: int = 0) -> str:
    """Median (least to most)."""
    middle = float(np.median(values))
    return f"{middle:.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def episodes() -> str:
    """How the script does, as Markdown."""
    cases = [(seed, spread) for spread in (0.0, 0.2) for seed in SEEDS]
    found: dict[int, dict[str, Any]] = {}
    with Workers(2) as processes, progress_bar(len(cases), unit="episodes") as bar:
        for place, row in processes.run(run, cases):
            found[place] = row
            bar.update()
    rows = []
    for name, group in (("nominal", list(SEEDS)), ("± 20 %", [20 + seed for seed in SEEDS])):
        ends = [found[place] for place in group]
        won = [end for end in ends if end["success"]]
        rows.append([
            name, f"{len(won)} of {len(ends)}", spread_of([end["energy"] for end in ends]),
            f"{max(end['holding'] for end in ends):.0f}",
            spread_of([end["hottest"] for end in ends]),
            spread_of([end["time"] for end in ends]),
        ])  # fmt: skip
    lost = [end for end in found.values() if not end["success"]]
    said = [f"* {1e3 * end['width']:.1f} mm, {1e3 * end['object_mass']:.2f} g,"
            f" {end['stiffness']:.0f} N/m: {end['why']}" for end in lost]  # fmt: skip
    heads = ["gripper", "held and let go in time", "energy [J]", "of it while it holds [J]",
             "hottest [°C]", "duration [s]"]  # fmt: skip
    return "\n".join([*pages.table(heads, rows), "", *said])


def forces() -> str:
    """Force of the cold and the warm gripper on a block over its width, by theory, as Markdown."""
    widths, rows = np.arange(2.0, 9.0, 1.5), []
    for temperature in (25.0, 45.0):
        pulls = np.linspace(0.0, 0.16, 17)
        force = 1e3 * np.interp(widths, 1e3 * pinched(pulls, temperature), pulls)
        slope = force @ widths / (widths @ widths)
        bow = 100.0 * float(np.abs(force - slope * widths).max() / force.max())
        rows.append([f"{temperature:.0f} °C", *(f"{f:.0f}" for f in force), f"{bow:.0f} %"])
    heads = ["TCA", *(f"{w:.1f} mm" for w in widths), "off a straight line"]
    return "\n".join(pages.table(heads, rows))


def filmed(
    env: Any, policy: Any, observation: Any, moments: dict[str, float]
) -> dict[str, Any]:
    """A picture of each phase of a policy, so long after it began, to the end of an episode [s]."""
    panels: dict[str, Any] = {}
    ended = False
    while not ended:
        action = policy.act(observation)
        if policy.phase not in panels and policy.since >= moments.get(policy.phase, math.inf):
            panels[policy.phase] = env.render()
        observation, _, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
    return panels


def picture(path: Path) -> None:
    """Open, closed, holding, and letting go."""
    env, policy = Grasp(render_mode="rgb_array", size=(400, 440)), GraspPolicy()
    observation, _ = env.reset(seed=3, options={"width": 7e-3, "stiffness": 150.0})
    panels = filmed(env, policy, observation, MOMENTS)
    env.close()
    imageio.imwrite(path, np.concatenate(list(panels.values()), axis=1))


def main() -> None:
    out = pages.folder_of_pictures(__doc__, Path("docs/pictures"))
    if out is None:
        print(forces(), episodes(), sep="\n\n", flush=True)
    else:
        picture(out / "grasp.png")


if __name__ == "__main__":
    main()

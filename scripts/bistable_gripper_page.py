"""The picture and the tables of docs/bistable-gripper.md.

    python scripts/bistable_gripper_page.py              draws docs/pictures/bistable-gripper.png
    python scripts/bistable_gripper_page.py --tables     prints the tables; minutes of one core
"""

import math
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
from grasp_page import filmed

from tca_mj import BistableGripperSpec, pages
from tca_mj.agents.scripts.bistable_grasp import BistableGraspPolicy
from tca_mj.envs.bistable_grasp import BistableGrasp
from tca_mj.validation.carrying import limit_load, without_bands

SEEDS = range(10)
MOMENTS = {"lower": 0.1, "calm": 0.3, "carry": 4.0, "leave": 0.8}  # after a phase begins [s]
NOMINAL = {"tca_gain": 1.0, "heat_loss": 1.0, "ambient": 25.0}


def limits() -> str:
    """Limit loads with and without bands, and over the time step, as Markdown."""
    spec, hot = BistableGripperSpec(), (25.0, 80.0, 120.0, 168.0)
    rows = [
        [name, *(f"{1e3 * limit_load(one, temperature):.0f}" for temperature in hot)]
        for name, one in (("with bands", spec), ("without", without_bands(spec)))
    ]
    steps = (2e-3, 1e-3, 5e-4, 2e-4)
    fine = [["limit [g]", *(f"{1e3 * limit_load(spec, 25.0, step):.1f}" for step in steps)]]
    return "\n".join([
        *pages.table(["limit [g], closing TCAs at", *(f"{t:.0f} °C" for t in hot)], rows), "",
        *pages.table(["time step", *(f"{1e3 * step:g} ms" for step in steps)], fine),
    ])  # fmt: skip


def run(seed: int) -> list[str]:
    """An episode with 15 g held for a minute, as a row."""
    env, policy = BistableGrasp(), BistableGraspPolicy()
    options = NOMINAL | {"object_mass": 15e-3, "hold_from": 10.0, "hold_for": 60.0,
                         "randomise": 0.2}  # fmt: skip
    observation, info = env.reset(seed=seed, options=options)
    ended, hottest, used = False, 0.0, {}
    while not ended:
        observation, _, terminated, truncated, info = env.step(policy.act(observation))
        ended, hottest = terminated or truncated, max(hottest, float(info["temperature"].max()))
        used[policy.phase] = env.energy
    why = info.get("termination_reason") or info.get("truncation_reason") or "let go"
    opened = used.get("leave", math.nan)
    closed = used.get("calm", math.nan)
    return [
        str(seed), f"{info['variation']['friction']:.2f}, {info['variation']['mass']:.2f}",
        f"{info['held_for']:.0f}", f"{closed:.0f}, {used.get('carry', math.nan) - closed:.0f},"
        f" {opened - closed:.0f}", f"{hottest:.0f}", f"{1e3 * env.away:.1f}", why,
    ]  # fmt: skip


def picture(path: Path) -> None:
    """Open, closed, carrying, and let go."""
    env = BistableGrasp(render_mode="rgb_array", size=(400, 440), camera="side")
    policy = BistableGraspPolicy()
    observation, _ = env.reset(seed=0, options={"object_mass": 15e-3, "goal": 30e-3})
    panels = filmed(env, policy, observation, MOMENTS)
    if "leave" not in panels:
        panels["leave"] = env.render()
    env.close()
    imageio.imwrite(path, np.concatenate(list(panels.values()), axis=1))


def main() -> None:
    out = pages.folder_of_pictures(__doc__, Path("docs/pictures"))
    if out is None:
        heads = ["seed", "friction, mass", "held [s]", "energy to close, hold, open [J]",
                 "hottest [°C]", "from the goal [mm]", "end"]  # fmt: skip
        print(limits(), "\n".join(pages.table(heads, [run(seed) for seed in SEEDS])), sep="\n\n")
    else:
        picture(out / "bistable-gripper.png")


if __name__ == "__main__":
    main()

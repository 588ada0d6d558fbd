"""The picture and the table of docs/adaptive-grasp.md.

    python scripts/adaptive_page.py                    draws docs/pictures/adaptive-grasp.png
    python scripts/adaptive_page.py --tables           prints the table; some minutes of one core
"""

import math
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np

from tca_mj import pages
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.scripts.adaptive import AdaptivePolicy
from tca_mj.agents.workers import Workers
from tca_mj.envs.adaptive import OBJECTS, AdaptiveGrasp

# What else the script is told: as it is; the base left flat; left in the angle for one object.
BASES = {"morphing": None, "frozen flat": 0.0, "frozen for the ball": "ball"}
SEEDS = {"morphing": 5, "frozen flat": 2, "frozen for the ball": 2}  # of each object


def run(name: str, seed: int, base: str) -> dict[str, Any]:
    """What happened in one episode of the script."""
    env, kept = AdaptiveGrasp(action="power"), BASES[base]
    policy = AdaptivePolicy(frozen=kept is not None)
    options: dict[str, Any] = {"object": name}
    if isinstance(kept, str):
        gap = OBJECTS[kept].width + 2.0 * policy.gains.clearance
        options["start"] = env.gripper_spec.angle_for(gap)
    elif kept is not None:
        options["start"] = kept
    observation, info = env.reset(seed=seed, options=options)
    ended, hottest, hardened, nearest, held = False, 0.0, math.nan, math.inf, 0.0
    while not ended:
        action = policy.act(observation)
        if policy.phase == "lower" and math.isnan(hardened):
            hardened = env.angle - policy.angle
        observation, _, terminated, truncated, info = env.step(action)
        gap = float(np.ptp(env.data.site_xpos[env._pads][:, 0]))
        hottest, nearest = max(hottest, float(info["temperature"].max())), min(nearest, gap)
        held, ended = max(held, info["held_for"]), terminated or truncated
        ended = ended or (policy.phase == "done" and policy.since > 8.0)
    return {
        "success": info["success"], "held": held, "off": math.degrees(abs(hardened)),
        "angle": math.degrees(policy.angle), "hottest": hottest, "time": info["time"],
        "energy": float(info["energy"].sum() + info["heater_energy"].sum()), "nearest": nearest,
        "why": info.get("truncation_reason") or info.get("termination_reason") or "",
    }  # fmt: skip


def table() -> str:
    """How the script does, with the base and without, as Markdown."""
    cases = [(name, seed, base) for base, seeds in SEEDS.items() for name in OBJECTS
             for seed in range(seeds)]  # fmt: skip
    found: dict[int, dict[str, Any]] = {}
    with Workers(2) as processes, progress_bar(len(cases), unit="episodes") as bar:
        for place, row in processes.run(run, cases):
            found[place] = row
            bar.update()
    rows = []
    for base in BASES:
        for name, thing in OBJECTS.items():
            ends = [found[i] for i, case in enumerate(cases) if (case[0], case[2]) == (name, base)]
            won = [end for end in ends if end["success"]]
            morphed = base == "morphing"
            rows.append([
                base, f"{name}, {1e3 * thing.width:.0f} mm, {1e3 * thing.mass:.1f} g",
                f"{len(won)} of {len(ends)}", f"{ends[0]['angle']:.0f}°" if morphed else "-",
                f"{max(end['off'] for end in ends):.1f}°" if morphed else "-",
                f"{np.median([end['energy'] for end in ends]):.0f}" if morphed else "-",
                f"{max(end['hottest'] for end in ends):.0f}",
                f"{np.median([end['time'] for end in ends]):.0f}" if morphed else "-",
                f"{1e3 * min(end['nearest'] for end in ends):.0f}",
            ])  # fmt: skip
    lost = [f"* {cases[i][2]}, {cases[i][0]}, seed {cases[i][1]}: held for {end['held']:.1f} s"
            f" {end['why']}" for i, end in sorted(found.items()) if not end["success"]]
    heads = ["base", "object", "lifted, held for 10 s, let go", "commanded", "off when hard",
             "energy [J]", "hottest TCA [°C]", "duration [s]", "least gap [mm]"]  # fmt: skip
    return "\n".join([*pages.table(heads, rows), "", *lost])


def picture(path: Path) -> None:
    """Flat, soft, hardened, pinching; and each object held."""
    env = AdaptiveGrasp(action="power", render_mode="rgb_array", size=(420, 380))
    panels: list[Any] = []
    for name in OBJECTS:
        policy, ended, held = AdaptivePolicy(), False, False
        observation, _ = env.reset(seed=0, options={"object": name, "start": 0.0})
        last = ""
        while not (ended or held):
            action = policy.act(observation)
            first = policy.phase != last and name == "can"
            held = policy.phase == "carry" and policy.since > 1.0
            if held or (first and policy.phase in ("soften", "morph", "harden", "pinch")):
                panels.append(env.render())
            last = policy.phase
            observation, _, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
    env.close()
    order = [1, 2, 3, 4, 0, 5, 6, 7]  # the sponge came before the can
    rows = [np.concatenate([panels[i] for i in order[k : k + 4]], axis=1) for k in (0, 4)]
    imageio.imwrite(path, np.concatenate(rows))


def main() -> None:
    out = pages.folder_of_pictures(__doc__, Path("docs/pictures"))
    if out is None:
        print(table(), flush=True)
    else:
        picture(out / "adaptive-grasp.png")


if __name__ == "__main__":
    main()

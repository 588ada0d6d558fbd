"""The picture and the tables of docs/adaptive-grasp.md.

    python scripts/adaptive_page.py                    draws docs/pictures/adaptive-grasp.png
    python scripts/adaptive_page.py --tables           prints the tables; ten minutes of two cores
"""

import math
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np

from tca_mj import pages
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.scripts.adaptive import AdaptiveGains, AdaptivePolicy
from tca_mj.agents.workers import Workers
from tca_mj.envs.adaptive import OBJECTS, AdaptiveGrasp

# What else the script is told: as it is; the base left flat; left in the angle for one object.
BASES = {"morphing": None, "frozen flat": 0.0, "frozen for the ball": "ball"}
SEEDS = range(100, 105)  # of each object and base; nothing was tuned on them
TUNED = range(2)  # seeds on which the frozen bases are tuned
# What they are tuned over: temperature of the fingers' TCAs, and its rise by the mass; as it is
# for the morphing base, and up to what a task can ask for.
GAINS = (AdaptiveGains(), *(AdaptiveGains(warm=float(warm), per_mass=0.0)
                            for warm in (80, 98, 115, 130, 150, 172)))  # fmt: skip


def run(name: str, seed: int, base: str, gains: AdaptiveGains) -> dict[str, Any]:
    """What happened in one episode of the script."""
    env, kept = AdaptiveGrasp(action="power"), BASES[base]
    policy = AdaptivePolicy(frozen=kept is not None, gains=gains)
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
        lost = policy.phase == "set down" and held == 0.0
        ended = ended or lost or (policy.phase == "done" and policy.since > 8.0)
    return {
        "success": info["success"], "held": held, "off": math.degrees(abs(hardened)),
        "angle": math.degrees(policy.angle), "hottest": hottest, "time": info["time"],
        "energy": float(info["energy"].sum() + info["heater_energy"].sum()), "nearest": nearest,
        "why": info.get("truncation_reason") or info.get("termination_reason") or "",
    }  # fmt: skip


Case = tuple[str, int, str, AdaptiveGains]


def all_of(cases: list[Case]) -> dict[Case, dict[str, Any]]:
    """What happened in each of some episodes."""
    found: dict[Case, dict[str, Any]] = {}
    with Workers(2) as processes, progress_bar(len(cases), unit="episodes") as bar:
        for place, row in processes.run(run, cases):
            found[cases[place]] = row
            bar.update()
    return found


def tuned() -> tuple[dict[str, AdaptiveGains], list[str]]:
    """The gains with which each base does best on ``TUNED``, and the search as Markdown."""
    frozen = [base for base, kept in BASES.items() if kept is not None]
    found = all_of([(name, seed, base, gains) for base in frozen for gains in GAINS
                    for name in OBJECTS for seed in TUNED])  # fmt: skip
    best, rows = {"morphing": AdaptiveGains()}, []
    for base in frozen:
        ends = [[row for case, row in found.items() if case[2:] == (base, gains)]
                for gains in GAINS]  # fmt: skip
        did = [(sum(end["success"] for end in each), sum(end["held"] for end in each))
               for each in ends]  # fmt: skip
        best[base] = GAINS[did.index(max(did))]
        gaps = [1e3 * min(end["nearest"] for end in each) for each in ends]
        rows.append([base, *(f"{won}, {held:.0f} s, {gap:.0f} mm"
                             for (won, held), gap in zip(did, gaps, strict=True))])  # fmt: skip
    names = [f"{g.warm:.0f} °C" + (" + 4.7 K/g" if g.per_mass else "") for g in GAINS]
    head = f"let go of {len(OBJECTS) * len(TUNED)}, held, least gap"
    return best, pages.table([head, *names], rows)


def table() -> str:
    """How the script does, with the base and without, as Markdown."""
    best, search = tuned()
    found = all_of([(name, seed, base, best[base]) for base in BASES for name in OBJECTS
                    for seed in SEEDS])  # fmt: skip
    rows = []
    for base in BASES:
        for name, thing in OBJECTS.items():
            ends = [row for case, row in found.items() if (case[0], case[2]) == (name, base)]
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
    lost = [f"* {case[2]}, {case[0]}, seed {case[1]}: held for {end['held']:.1f} s {end['why']}"
            for case, end in found.items() if not end["success"]]  # fmt: skip
    heads = ["base", "object", "lifted, held for 10 s, let go", "commanded", "off when hard",
             "energy [J]", "hottest TCA [°C]", "duration [s]", "least gap [mm]"]  # fmt: skip
    return "\n".join([*search, "", *pages.table(heads, rows), "", *lost])


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

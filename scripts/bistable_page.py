"""The pictures and the tables of docs/bistable.md and docs/jump.md.

    python scripts/bistable_page.py             draws docs/pictures/bistable.png and jump.png
    python scripts/bistable_page.py --tables    prints the tables
"""

import math
from dataclasses import replace
from pathlib import Path

import imageio.v3 as imageio
import matplotlib.pyplot as plt
import mujoco
import numpy as np

from tca_mj import BistableSpec, pages
from tca_mj.agents.scripts.jump import JumpPolicy
from tca_mj.envs.jump import HASTE, Jump
from tca_mj.validation.bistable import ANGLES, Snap, landscape, lines, snap
from tca_mj.validation.jumping import NOMINAL, balance, jumped, jumper_with
from tca_mj.validation.pulses import PULSES, endured

SPEC = BistableSpec()
KINDS = {"symmetric": 0.0, "asymmetric": 50.0, "monostable": 110.0}  # angle of the spine [deg]


def at(angle: float) -> BistableSpec:
    """The module with a spine of so many degrees."""
    return replace(SPEC, angle=math.radians(angle))


def forces(folder: Path) -> None:
    """Energy landscapes and triggering forces by arc, by theory and by MuJoCo."""
    figure, axes = plt.subplots(1, 4, figsize=(14, 3.4))
    bends = np.radians(np.linspace(-150.0, 150.0, 61))
    for axis, (kind, angle) in zip(axes, KINDS.items(), strict=False):
        rod = at(angle).rod
        axis.plot(np.degrees(bends), [1e3 * rod.lumped(b) for b in bends], ":", label="arc")
        axis.plot(np.degrees(bends), [1e3 * rod.energy(b) for b in bends], label="elastica")
        some = bends[5:-5:5]
        axis.plot(np.degrees(some), 1e3 * landscape(at(angle), some), "k.", label="MuJoCo")
        axis.set(title=f"{kind}, θ0 = {angle:.0f}°", xlabel="bend [°]", ylabel="energy [mJ]")
    axes[0].legend()
    force = lines(SPEC)
    for name, lumped, style in (("arc", True, ":"), ("elastica", False, "-")):
        theory = [at(a).rod.thresholds(SPEC.offset, lumped=lumped) for a in ANGLES]
        for k in (0, 1):
            axes[3].plot(ANGLES, [max(0.0, row[k]) for row in theory], f"C{k}{style}",
                         label=f"F_t{k + 1}, {name}")  # fmt: skip
    axes[3].plot(ANGLES, force.T, "k.")
    axes[3].set(title="triggering forces", xlabel="θ0 [°]", ylabel="tension of a cable [N]")
    axes[3].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(folder / "bistable.png", dpi=110)


def jumping(folder: Path) -> None:
    """Four moments of a jump."""
    env, policy, pictures = Jump(render_mode="rgb_array", size=(400, 360)), JumpPolicy(), []
    observation, _ = env.reset(seed=0)
    ended = False
    while not ended:
        pictures.append(env.render())
        observation, _, terminated, truncated, _ = env.step(policy.act(observation))
        ended = terminated or truncated
    last = len(pictures) - 1
    shown = [pictures[i] for i in (0, last - 4, last - 3, last)]
    imageio.imwrite(folder / "jump.png", np.concatenate(shown, axis=1))


def tables() -> str:
    """Triggering forces, the snap, the published pulses and the jump, as Markdown."""
    force = lines(SPEC)
    rows = ["| θ0 [°] | F_t1: arc, elastica, MuJoCo [N] | F_t2 [N] | states at rest [°] |",
            "|---|---|---|---|"]  # fmt: skip
    for k, angle in enumerate(ANGLES):
        rod = at(angle).rod
        arc, exact = (rod.thresholds(SPEC.offset, lumped=lumped) for lumped in (True, False))
        cells = (f"{max(0.0, a):.3f}, {max(0.0, b):.3f}, {c:.3f}" for a, b, c in
                 zip(arc, exact, force[:, k], strict=True))  # fmt: skip
        rest = ", ".join(f"{math.degrees(state):.0f}" for state in rod.states()[::2])
        rows.append(f"| {angle:.0f} | {' | '.join(cells)} | {rest} |")
    rows += ["", "| step [ms] | implicitfast: m/s, ms, balance | discrete |", "|---|---|---|"]

    def told(found: Snap) -> str:
        return f"{found.speed:.2f}, {1e3 * found.time:.1f}, {found.lost / found.freed:.3f}"

    for step in (2.0, 1.0, 0.5, 0.2, 0.1, 0.02):
        both = (snap(SPEC, 1e-3 * step, kind) for kind in
                (None, int(mujoco.mjtIntegrator.mjINT_DISCRETE)))  # fmt: skip
        rows.append(f"| {step:g} | {' | '.join(told(found) for found in both)} |")
    return "\n".join([*rows, "", *pulses(), "", *steps(), "", seeds()])


def pulses() -> list[str]:
    """The published pulses and the longest safe ones, as Markdown."""
    safe = f"{Jump.safe_temperature:.0f} °C"
    heads = ["to", "published", "then, alone [°C]", "in the robot [°C]", "has gone over",
             f"{safe} after, alone [s]", "in the robot [s]"]  # fmt: skip
    rows = []
    for pulse in PULSES:
        found = endured(pulse)
        rows.append([
            pulse.name, f"{pulse.amperes:g} A, {pulse.seconds:g} s", f"{found.alone:.0f}",
            f"{found.inside:.0f}", f"after {found.over:.2f} s, at {found.hot:.0f} °C",
            f"{found.safe_alone:.2f}", f"{found.safe_inside:.2f}",
        ])  # fmt: skip
    return pages.table(heads, rows)


def steps() -> list[str]:
    """Height and balance of a jump over its time steps, as Markdown."""
    rows = []
    for name, share in (("twice", 2.0), ("the task's", 1.0), ("half", 0.5), ("a quarter", 0.25)):
        height = jumped(jumper_with(share), **NOMINAL)["height"]
        found = balance(share * HASTE.timestep)
        rows.append([
            name, f"{1e3 * height:.1f}", f"{1e3 * found.lost:.2f}", f"{1e3 * found.taken:.2f}",
            f"{-1e3 * found.given:.2f}", f"{1e3 * found.kept:.2f}", f"{100.0 * found.error:.1f} %",
        ])  # fmt: skip
    heads = ["all steps", "height [mm]", "freed [mJ]", "to damping", "to ground and TCA",
             "to motion", "not accounted for"]  # fmt: skip
    return pages.table(heads, rows)


def seeds() -> str:
    """How high it jumps with friction and mass off by up to 20 %."""
    env = Jump()
    found = [jumped(env, seed, randomise=0.2, **NOMINAL) for seed in range(10)]
    heights = [1e3 * info["height"] for info in found]
    won = sum(info["success"] for info in found)
    return f"seeds 0 to 9: {won} of 10, {min(heights):.0f} to {max(heights):.0f} mm"


if __name__ == "__main__":
    folder = pages.folder_of_pictures(__doc__, Path("docs/pictures"))
    if folder is None:
        print(tables())
    else:
        forces(folder)
        jumping(folder)

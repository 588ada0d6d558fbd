"""The pictures and the tables of docs/finger.md.

    python scripts/finger_page.py             draws docs/pictures/finger.png and finger_answer.png
    python scripts/finger_page.py --tables    prints the tables; takes some minutes
"""

import math
from pathlib import Path

import imageio.v3 as imageio
import numpy as np

from tca_mj.agents.scripts.finger import TRIGGER, FingerPolicy, bending_run
from tca_mj.envs.finger import FingerSense
from tca_mj.pages import folder_of_pictures
from tca_mj.record.plots import save_figure
from tca_mj.tca.sensing.wire import fit_displacement
from tca_mj.validation.touched import SETTLED, TARGET, answer

TOUCHES, ANSWERS, EPISODES = range(10), range(3), range(4)
# When a picture is taken, after the trigger [s]; before it the finger waits.
MOMENTS = (-0.7, 0.02, 1.0, 1.4, 4.0)


def touches() -> str:
    """Ten touches, a minute without one, and what follows some of them, as Markdown."""
    env, policy = FingerSense(action="power"), FingerPolicy()

    def felt(seed: int, seconds: float, **options: float) -> bool:
        """Whether the script feels a touch."""
        policy.reset()
        observation, _ = env.reset(seed=seed, options=options)
        while env.sim.time < seconds and policy.phase == "watch":
            observation, *_ = env.step(policy.act(observation))
        return policy.phase != "watch"

    right = sum(felt(seed, 4.0, touch_time=1.0) for seed in TOUCHES)
    alarms = felt(100, 60.0, touch_time=600.0)
    found = [answer(seed=seed) for seed in ANSWERS]
    shown = []
    for figures, unit in (
        ([each.rise for each in found], "s"), ([each.angle.max() for each in found], "°"),
        ([each.error for each in found], "%"),
        ([each.temperature.max() for each in found], "°C"),
    ):
        shown.append(" ".join(f"{figure:.2f}" for figure in figures) + f" {unit}")
    return "\n".join([
        "| what | figure |", "|---|---|",
        f"| touches of 85 to 95° that were felt, seeds 0 to 9 | {right} of {len(TOUCHES)} |",
        f"| false alarms in 60 s without a touch | {alarms:d} |",
        f"| rise, trigger to 54°, seeds 0 to 2 | {shown[0]} |",
        f"| largest angle | {shown[1]} |",
        f"| mean error from {SETTLED:g} s on | {shown[2]} |",
        f"| hottest TCA | {shown[3]} |",
    ])  # fmt: skip


def episodes() -> str:
    """Whole episodes of the task, as Markdown."""
    lines = ["| finger | held for 8 s | after [s] | return | energy [J] |", "|---|---|---|---|---|"]
    env, policy = FingerSense(action="power"), FingerPolicy()
    for name, spread in (("nominal", 0.0), ("± 20 %", 0.2)):
        ends = []
        for seed in EPISODES:
            policy.reset()
            observation, _ = env.reset(seed=seed, options={"randomise": spread})
            total = 0.0
            for _ in range(1500):
                observation, reward, terminated, truncated, info = env.step(policy.act(observation))
                total += reward
                if terminated or truncated:
                    break
            ends.append((info["success"], info["time"], total, info["energy"].sum()))
        won, time, earned, energy = (np.array(column) for column in zip(*ends, strict=True))
        lines.append(
            f"| {name} | {won.sum()} of {won.size} | {np.median(time[won]):.1f} |"
            f" {np.mean(earned):.1f} | {np.mean(energy):.0f} |"
        )
    return "\n".join(lines)


def supplies() -> str:
    """What the voltage decides, as Markdown."""
    lines = ["| supply [V] | rise [s] | overshoot to [°] | error from 5 s on [%] | hottest [°C] |",
             "|---|---|---|---|---|"]  # fmt: skip
    for volts in (4.0, 5.0, 6.0, 12.0):
        found = answer(voltage=volts)
        lines.append(f"| {volts:g} | {found.rise:.2f} | {found.angle.max():.0f} |"
                     f" {found.error:.1f} | {found.temperature.max():.0f} |")  # fmt: skip
    return "\n".join(lines)


def plot(path: Path) -> None:
    """The answer to a touch, as Fig. 4.8b, and the fit."""
    from matplotlib.figure import Figure

    found, run = answer(), bending_run()
    fit = fit_displacement(run.resistance, run.angle)
    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    (a, b), (c, d) = figure.subplots(2, 2)
    a.plot(found.time, found.angle, color="#0072b2")
    a.axhspan(0.95 * TARGET, 1.05 * TARGET, color="#dddddd", zorder=0)
    a.set(ylabel="angle [°]", xlabel="time after the trigger [s]")
    b.plot(found.time, found.reading, color="#bbbbbb", lw=0.6, label="reading")
    b.plot(found.time, found.resistance, color="#d55e00", label="moving average")
    b.axhline(found.resistance[:25].mean() - TRIGGER, color="#666666", lw=1, ls="--",
              label="trigger")  # fmt: skip
    b.set(ylabel="resistance [ohm]", xlabel="time after the trigger [s]")
    b.legend(frameon=False)
    c.plot(found.time, found.temperature, color="#d55e00", label="TCA [°C]")
    c.plot(found.time, found.silicone, color="#009e73", label="silicone [°C]")
    c.set(ylabel="temperature [°C]", xlabel="time after the trigger [s]")
    power = c.twinx()
    power.plot(found.time, found.power, color="#8a4fa3", lw=0.8)
    power.set_ylabel("power of both [W]", color="#8a4fa3")
    c.legend(frameon=False, loc="center right")
    d.plot(run.resistance, np.degrees(run.angle), ".", color="#bbbbbb", label="5 V")
    ohms = np.linspace(run.resistance.min(), run.resistance.max(), 100)
    d.plot(ohms, np.degrees(fit.displacement(ohms)), color="#0072b2",
           label=f"cubic, error {math.degrees(fit.rmse):.1f}°")  # fmt: skip
    d.set(xlabel="resistance [ohm]", ylabel="angle [°]")
    d.legend(frameon=False)
    save_figure(figure, path)


def picture(path: Path) -> None:
    """The finger waiting, touched, swinging back, rising and holding."""
    env = FingerSense(action="power", render_mode="rgb_array", size=(300, 360))
    policy = FingerPolicy()
    found = answer()
    observation, _ = env.reset(seed=0, options={"touch_time": 1.0})
    moments = [moment - found.time[0] for moment in MOMENTS]
    panels = []
    while len(panels) < len(moments):
        if env.sim.time >= moments[len(panels)]:
            panels.append(env.render())
        observation, *_ = env.step(policy.act(observation))
    env.close()
    imageio.imwrite(path, np.concatenate([p for p in panels if p is not None], axis=1))


def main() -> None:
    out = folder_of_pictures(__doc__, Path("docs/pictures"))
    if out is None:
        for table in (touches, supplies, episodes):
            print(table(), flush=True, end="\n\n")
    else:
        plot(out / "finger_answer.png")
        picture(out / "finger.png")


if __name__ == "__main__":
    main()

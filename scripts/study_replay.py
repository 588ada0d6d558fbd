"""Fig. 4.6 replayed, beside the script: docs/pictures/study_replay.png and its table.

The arm at the powers of Sun, dissertation, Colorado State University, Section 4.1.4, open loop,
with the object as a mass; and an episode of TCA/ArmPickPlace-v0 by the scripted policy.
"""

import numpy as np
import studies
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from studies import BLUE, GREEN, GREY, ORANGE, PURPLE

from tca_mj.validation.replay import PRINTED, Course, replay, scripted

SHOWN = "screwdriver"  # in the figure
RUNS = {"printed powers": lambda name: replay(PRINTED[name]), "script": scripted}
TCAS = dict(zip(("bending 1", "bending 2", "bending 3", "wrist", "gripper"),
                (BLUE, GREEN, PURPLE, ORANGE, GREY), strict=True))  # fmt: skip


def compute() -> dict[tuple[str, str], Course]:
    return {(name, kind): run(name) for name in PRINTED for kind, run in RUNS.items()}


def table(data: dict[tuple[str, str], Course]) -> str:
    rows = []
    for (name, kind), course in data.items():
        for phase, part in course.phases():
            i = part.stop - 1
            power = np.mean(course.power[max(part.start, 1) : part.stop], axis=0)
            hot, body = course.temperature[i], course.body[i]
            heat = [f"{t:.0f} ({b:.0f})" for t, b in zip(hot, body, strict=True)]
            rows.append([
                f"{name}, {kind}", phase, f"{course.time[i]:.1f} s",
                ", ".join(f"{p:.1f}" for p in power), f"{course.wrist[i]:.0f}°",
                f"{course.opening[i]:.1f} mm", f"{course.bend[i]:.0f}°", f"{course.place[i]:.0f}°",
                ", ".join(heat[:3]), heat[3], heat[4],
            ])  # fmt: skip
        if course.ending:
            rows.append([f"{name}, {kind}", course.ending, *["-"] * 9])
    head = ["run", "phase", "until", "mean power, TCAs 1 to 3, wrist, gripper [W]", "wrist",
            "opening", "bend, tangent", "eq. (4.1)", "TCAs 1 to 3 (silicone) [°C]", "wrist",
            "gripper"]  # fmt: skip
    return studies.markdown(head, rows)


def draw(figure: Figure, data: dict[tuple[str, str], Course]) -> None:
    figure.set_size_inches(10.5, 7.6)
    axes = figure.subplots(3, 2, sharex="col", sharey="row", height_ratios=(1.0, 0.7, 1.0))
    for k, kind in enumerate(RUNS):
        course = data[SHOWN, kind]
        _angles(axes[0, k], course)
        axes[0, k].set_title(f"{SHOWN}, {kind}", fontsize=10)
        power, heat, body = (np.array(x) for x in (course.power, course.temperature, course.body))
        for i, (name, colour) in enumerate(TCAS.items()):
            axes[1, k].plot(course.time, power[:, i], color=colour, lw=1.5)
            axes[2, k].plot(course.time, heat[:, i], color=colour, lw=1.8, label=name)
            axes[2, k].plot(course.time, body[:, i], color=colour, lw=1.2, ls="--")
        axes[2, k].set_xlabel("time [s]")
        for axis in axes[:, k]:
            for _, part in course.phases()[1:]:
                axis.axvline(course.time[part.start - 1], color="#bbbbbb", lw=0.8)
    axes[2, 0].plot([], [], color="#111111", lw=1.2, ls="--", label="silicone")
    axes[0, 0].set(ylabel="angle [°], opening [mm]", ylim=(0, 65))
    axes[1, 0].set(ylabel="power [W]", ylim=(0, 15))
    axes[2, 0].set(ylabel="temperature [°C]", ylim=(20, 170))
    axes[0, 0].legend(loc="upper right", frameon=False, fontsize=9)
    axes[2, 0].legend(loc="upper right", frameon=False, fontsize=9, ncols=2)


def _angles(axis: Axes, course: Course) -> None:
    lines = (("turn of the wrist", course.wrist, ORANGE, "-"),
             ("bend, tangent", course.bend, BLUE, "-"),
             ("bend, eq. (4.1)", course.place, BLUE, "--"),
             ("opening of the gripper", course.opening, GREY, "-"))  # fmt: skip
    for name, values, colour, style in lines:
        axis.plot(course.time, values, color=colour, ls=style, lw=1.8, label=name)


if __name__ == "__main__":
    studies.publish("replay", __doc__, compute, table, draw)

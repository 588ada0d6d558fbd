"""Draws docs/pictures/morphing_*.png of docs/morphing.md; --tables prints its tables instead.

    MUJOCO_GL=egl python scripts/morphing_module.py

Without a way to OpenGL only the tables can be had.
"""

import math
import time
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import mujoco
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from shape_memory import shade, shown

from tca_mj.agents.scripts.morph import MorphPolicy
from tca_mj.control.morph import Measurement, Phase
from tca_mj.envs.morph import MorphModule, hanging_module
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.pages import folder_of_pictures
from tca_mj.record.render import Offscreen, colour_tendons
from tca_mj.sim import Simulation
from tca_mj.smp.lumped import LumpedModule

G, WEIGHT = 9.81, 15e-3  # Sun, Fig. 6.1: 15 g at the tip
BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#666666"
DOWN = {"to its own side": (0, -1, 0), "to the other side": (0, 1, 0), "across": (1, 0, 0),
        "along the base": (0, 0, 1), "against the base": (0, 0, -1)}  # fmt: skip


class Bench:
    """A module in a simulation, and what is asked of it."""

    def __init__(self, part: Any = None, *, gravity: Any = None, period: float = 0.1,
                 timestep: float = 5e-3, **spec: Any) -> None:  # fmt: skip
        self.spec = MorphingSpec(**spec)
        part = part or morphing_module(self.spec)
        if gravity is not None:
            part.spec.option.gravity = list(gravity)
        self.names = [n for n, _ in part.spines[0].joints if ".bend_x" in n]
        self.sim = Simulation(part, timestep=timestep, tca_period=period)
        model = self.sim.model
        self.tip = model.body(part.sites[next(iter(part.sites))]).id
        self.qpos = np.array([model.joint(n).qposadr[0] for n in self.names])

    @property
    def angle(self) -> float:
        """Bending angle [deg]."""
        return math.degrees(float(self.sim.data.qpos[self.qpos].sum()))

    def fix(self, angle: float) -> None:
        """Cold, and fixed in an arc of an angle [deg]."""

        def place(data: mujoco.MjData) -> None:
            data.qpos[self.qpos] = math.radians(angle) / len(self.qpos)

        self.sim.reset(place)

    def hang(self, mass: float) -> None:
        """Hangs a weight to the tip, or takes it away."""
        self.sim.data.xfrc_applied[self.tip, :3] = mass * self.sim.model.opt.gravity

    def soften(self, power: float = 0.0) -> None:
        """25 V until 118 °C, then 9.5 V until nothing moves."""
        self.sim.step([power], 7.0, voltage=25.0)
        self.sim.step([power], 6.0, voltage=9.5)

    def rotation(self) -> NDArray[np.float64]:
        """Rotation of the tip."""
        return self.sim.data.xmat[self.tip].reshape(3, 3).copy()


def play(bench: Bench, target: float | None, dt: float = 0.1) -> list[dict[str, Any]]:
    """One sequence; a row for every step."""
    sequence, sim, rows = MorphPolicy(bench.spec).sequence, bench.sim, []
    progress = sequence.start(target)
    while not progress.over:
        seen = Measurement(float(sim.spines.temperature[0]), float(sim.resistance[0]))
        progress, command = sequence.step(progress, seen, dt)
        sim.step([command.tca_power], dt, voltage=command.heater_voltage, fan=command.fan)
        rows.append(dict(time=sim.time, phase=progress.phase, command=command, angle=bench.angle,
                         spine=float(sim.spines.temperature[0]), tca=float(sim.temperature[0]),
                         tube=float(sim.body_temperature[0]),
                         ohm=float(sim.resistance[0])))  # fmt: skip
    return rows


def holding_table() -> str:
    """How far 15 g turn the tip of a cold module, fixed in several angles, in Markdown."""
    lines = ["| weight pulls | " + " | ".join(f"{a}°" for a in HELD) + " |",
             "|---" * (len(HELD) + 1) + "|"]  # fmt: skip
    for name, down in DOWN.items():
        bench = Bench(gravity=G * np.array(down))
        turned = []
        for angle in HELD:
            bench.fix(angle)
            bench.sim.step([0.0], 2.0)
            before = bench.rotation()
            bench.hang(WEIGHT)
            bench.sim.step([0.0], 2.0)
            turn = np.clip((np.trace(before.T @ bench.rotation()) - 1.0) / 2.0, -1.0, 1.0)
            turned.append(math.degrees(math.acos(turn)))
        lines.append(f"| {name} | " + " | ".join(f"{t:.1f}°" for t in turned) + " |")
    return "\n".join(lines)


HELD = (0, 45, 90, 135, 180, 240)


def lumped_table() -> str:
    """Angle without gravity against the module with one angle, in Markdown."""
    bench = Bench(gravity=(0, 0, 0), period=0.025)
    lumped = LumpedModule(bench.spec.spine, bench.spec.heater, bench.spec.sheathed)
    state, moments = lumped.rest(), (10.0, 15.0, 25.0, 30.0, 40.0, 60.0)
    heat = lumped.bank.heat
    lines = ["| time | spine | MuJoCo | one angle | |", "|---" * 5 + "|"]
    for k in range(600):
        now = 0.1 * k
        volts = 25.0 if now < 6.95 else 9.5 if now < 24.95 else 0.0
        wanted = np.full(1, min(130.0, 25.0 + 10.0 * (now - 7.5)))
        watts = float(heat.keeping(wanted, state.tca.body)[0]) if 7.45 < now < 34.95 else 0.0
        fan = now > 24.95
        bench.sim.step([watts], 0.1, voltage=volts, fan=fan)
        for _ in range(4):
            state = lumped.step(state, volts, watts, fan, 0.025)
        if any(abs(now + 0.1 - moment) < 0.01 for moment in moments):
            other = math.degrees(state.angle[0])
            lines.append(f"| {now + 0.1:.0f} s | {bench.sim.spines.temperature[0]:.0f} °C |"
                         f" {bench.angle:.2f}° | {other:.2f}° |"
                         f" {100.0 * (bench.angle / other - 1.0):+.2f} % |")  # fmt: skip
    return "\n".join(lines)


def node_table() -> str:
    """Soft, bent and under its weight: tip and angle over the number of nodes, in Markdown."""
    lines = ["| nodes | angle | tip off | angle | tip off |", "|---" * 5 + "|"]
    counts, found = (5, 10, 20, 40), []
    for temperature in (107.0, 165.0):
        row = []
        for nodes in counts:
            bench = Bench(gravity=(0, 0, G), motions=("bend_x",), nodes=nodes)
            bench.soften()
            bench.sim.step(bench.sim.keep([temperature]), 60.0, voltage=9.5)
            row.append((bench.angle, bench.sim.data.xpos[bench.tip].copy()))
        found.append(row)
    for i, nodes in enumerate(counts):
        cells = []
        for row in found:
            off = 1e3 * float(np.linalg.norm(row[i][1] - row[-1][1]))
            cells.append(f" {row[i][0]:.2f}° | {off:.2f} mm |" if i + 1 < len(counts)
                         else f" {row[i][0]:.2f}° | |")  # fmt: skip
        lines.append(f"| {nodes} |" + "".join(cells))
    return "\n".join(lines)


def at_voltage(bench: Bench, volts: float, goal: float | None, dt: float = 0.05) -> float:
    """Time to an angle [deg] at a constant voltage, or for None until steady (3° in 20 s)."""
    bench.sim.reset()
    bench.soften()
    angles, back, sim = [0.0], round(20.0 / dt), bench.sim
    while goal is None or angles[-1] < goal:
        sim.step([volts**2 / sim.resistance[0]], dt, voltage=9.5)
        angles.append(bench.angle)
        if goal is None and len(angles) > back and angles[-1] - angles[-1 - back] < 3.0:
            return dt * (len(angles) - 1 - back)
    return dt * (len(angles) - 1)


def speed_table() -> str:
    """How fast the soft module is, in Markdown."""
    lines = ["| | reported | without gravity | hanging |", "|---" * 4 + "|"]
    cells: list[list[str]] = [[], [], []]
    for gravity in ((0, 0, 0), (0, 0, G)):
        bench = Bench(gravity=gravity, motions=("bend_x",), period=0.05)
        cells[0].append(f"{at_voltage(bench, 25.0, 240.0, 0.05):.1f} s")
        bench.sim.reset()
        rows = play(bench, math.pi)
        morph = [r for r in rows if r["phase"] in (Phase.MORPH, Phase.HOLD)]
        late = [r["time"] for r in morph if abs(r["angle"] - 180.0) > 3.0]
        closed = max(late) - morph[0]["time"] + 0.2
        _, power = bench.sim.bank.steady([morph[-1]["tca"]])
        opened = at_voltage(bench, math.sqrt(float(power[0]) * morph[-1]["ohm"]), None)
        cells[1].append(f"{closed:.1f} s")
        cells[2].append(f"{opened:.0f} s, {opened / closed:.0f} times as long")
    names = (("240° at 25 V, soft", "1 s"), ("180° by closed loop", "within 3 s"),
             ("180° by constant voltage", "100 times as long"))  # fmt: skip
    for (name, reported), row in zip(names, cells, strict=True):
        lines.append(f"| {name} | {reported} | {row[0]} | {row[1]} |")
    return "\n".join(lines)


def policy_table(seeds: int = 10) -> str:
    """What the scripted policy achieves in the task, in Markdown."""
    env, policy, rows = MorphModule(action="power"), MorphPolicy(), []
    lines = ["| seed | start | target | fixed | time | TCA | heater | hottest TCA | reward |",
             "|---" * 9 + "|"]  # fmt: skip
    for seed in range(seeds):
        observation, info = env.reset(seed=seed)
        policy.reset()
        start, total, hottest, ended = info["angle"], 0.0, 0.0, False
        while not ended and env.sim.time < 79.95:
            observation, reward, success, cut, info = env.step(policy.act(observation))
            total, ended = total + reward, success or cut
            hottest = max(hottest, float(info["temperature"][0]))
        rows.append(info["success"])
        angles = (math.degrees(a) for a in (start, info["target"], info["angle"]))
        joules = f"{info['energy'][0]:.0f} J | {info['heater_energy'][0]:.0f} J"
        lines.append(
            f"| {seed} | "
            + " | ".join(f"{a:.1f}°" for a in angles)
            + f" | {info['time']:.1f} s | {joules} | {hottest:.0f} °C | {total:.1f} |"
        )
    return "\n".join([f"{sum(rows)} of {seeds}", "", *lines])


def draw_course(path: Path) -> None:
    """Angle, temperatures and powers over a sequence to 150° and one back."""
    bench = Bench(gravity=(0, 0, G), motions=("bend_x",))
    rows = [*play(bench, math.radians(150.0)), *play(bench, None)]
    at, spans = np.array([r["time"] for r in rows]), shown(rows)
    volts = [r["command"].heater_voltage for r in rows]
    heater = [float(bench.spec.heater.power(volt)) for volt in volts]
    figure = Figure(figsize=(8.0, 7.6), layout="constrained")
    axes = figure.subplots(4, 2, sharex="col", sharey="row",
                           width_ratios=[b - a for a, b in spans])  # fmt: skip
    for column, span in zip(axes.T, spans, strict=True):
        for axis in column:
            shade(axis, rows, span, 174.0 if axis is column[0] else 0.0)
        column[0].plot(at, [r["angle"] for r in rows], color=BLUE, lw=2)
        column[0].plot([0.0, at[-1]], [150.0, 150.0], "--", color=GREY, lw=0.8)
        column[1].plot(at, [r["spine"] for r in rows], color=ORANGE, lw=2, label="spine")
        column[1].plot(at, [r["tca"] for r in rows], color=BLUE, lw=2, label="TCA")
        column[1].plot(at, [r["tube"] for r in rows], "--", color=GREEN, lw=2, label="tube")
        column[2].plot(at, volts, color=ORANGE, lw=2, label="heater")
        column[3].plot(at, heater, color=ORANGE, lw=2, label="heater")
        column[3].plot(at, [r["command"].tca_power for r in rows], color=BLUE, lw=2, label="TCA")
        column[3].set(xlabel="time [s]", xlim=span)
    axes[0, 0].set(ylabel="angle [°]", ylim=(-10, 195))
    axes[1, 0].set(ylabel="temperature [°C]", ylim=(20, 165))
    axes[2, 0].set(ylabel="voltage [V]", ylim=(-1, 29))
    axes[3, 0].set(ylabel="power [W]")
    for axis in axes[1:, 1]:
        axis.legend(loc="upper right", frameon=False)
    for axis in axes.flat:
        axis.grid(color="#e6e6e6")
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)


def draw_shapes(path: Path) -> None:
    """Straight; soft and bent; fixed without power; with 15 g; recovered."""
    spec = MorphingSpec(motions=("bend_x",))
    part = hanging_module(spec)
    weight = part.spec.worldbody.add_body(name="weight", mocap=True, pos=[0.0, 0.0, -0.1])
    brass = [0.75, 0.58, 0.25, 1.0]
    weight.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[5e-3, 5e-3, 0.0],
                    pos=[0.0, 0.0, -26e-3], rgba=brass, contype=0, conaffinity=0)  # fmt: skip
    weight.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[3e-4, 0.0, 0.0],
                    fromto=[0.0, 0.0, 0.0, 0.0, 0.0, -21e-3], rgba=[0.2, 0.2, 0.2, 1.0],
                    contype=0, conaffinity=0)  # fmt: skip
    bench = Bench(part, motions=("bend_x",))
    sim, pictures, angles = bench.sim, [], []
    polymer = [i for i in range(sim.model.ngeom) if ".polymer" in sim.model.geom(i).name]

    def shoot(mass: float = 0.0) -> None:
        bench.hang(mass)
        sim.step([0.0], 2.0) if mass else None
        sim.data.mocap_pos[0] = sim.data.xpos[bench.tip] if mass else [0.0, 0.0, -0.1]
        mujoco.mj_forward(sim.model, sim.data)
        colour_tendons(sim.model, sim.tendon, sim.temperature)
        heat = np.clip((sim.spines.temperature[0] - 25.0) / 95.0, 0.0, 1.0)
        sim.model.geom_rgba[polymer, :3] = [
            c + heat * (h - c) for c, h in zip((0.86, 0.74, 0.48), (0.9, 0.25, 0.12), strict=True)
        ]
        with Offscreen(
            sim.model, width=640, height=480, camera="stand.front", coils=sim.tendon
        ) as screen:
            pictures.append(screen.draw(sim.data)[10:, 115:525])
        angles.append(bench.angle)

    shoot()
    sequence = MorphPolicy(spec).sequence
    progress = sequence.start(math.radians(135.0))
    taken = False
    while not progress.over:
        seen = Measurement(float(sim.spines.temperature[0]), float(sim.resistance[0]))
        progress, command = sequence.step(progress, seen, 0.1)
        sim.step([command.tca_power], 0.1, voltage=command.heater_voltage, fan=command.fan)
        if progress.phase is Phase.HOLD and not taken and progress.elapsed > 8.0:
            shoot()
            taken = True
    shoot()
    shoot(WEIGHT)
    bench.hang(0.0)
    play(bench, None)
    shoot()
    print("shapes:", ", ".join(f"{angle:.1f}°" for angle in angles))
    imageio.imwrite(path, np.concatenate(pictures, axis=1))


def overhead() -> str:
    """env.step against the mj_steps in it, in processor time, in Markdown."""
    env, policy = MorphModule(action="power"), MorphPolicy()
    observation, _ = env.reset(seed=0)
    plain, inside, rows = mujoco.mj_step, [0.0], []

    def timed(*arguments: Any) -> None:
        begin = time.thread_time()
        plain(*arguments)
        inside[0] += time.thread_time() - begin

    mujoco.mj_step = timed
    try:
        for _ in range(300):
            action, inside[0] = policy.act(observation), 0.0
            begin = time.thread_time()
            observation, _, success, cut, _ = env.step(action)
            rows.append((time.thread_time() - begin, inside[0]))
            if success or cut:
                break
    finally:
        mujoco.mj_step = plain
    step, physics = np.median(np.array(rows), axis=0)
    return (f"env.step {1e3 * step:.2f} ms, {env.dt / step:.0f} times real time;"
            f" mj_steps in it {1e3 * physics:.2f} ms; ratio {step / physics:.2f}")  # fmt: skip


def main() -> None:
    out = folder_of_pictures(__doc__, Path(__file__).parents[1] / "docs/pictures")
    if out is None:
        for table in (holding_table, lumped_table, node_table, speed_table, policy_table, overhead):
            print(table(), end="\n\n", flush=True)
        return
    draw_course(out / "morphing_course.png")
    draw_shapes(out / "morphing_shapes.png")


if __name__ == "__main__":
    main()

"""Draws docs/pictures/smp_*.png of docs/shape-memory.md; --tables prints its tables instead."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tca_mj.control.morph import ClosedLoop, Measurement, MorphSequence, Phase
from tca_mj.control.pi import PiSpec
from tca_mj.pages import folder_of_pictures
from tca_mj.smp import HeaterSpec, SmpSpec, SpineSpec, SpineState, advance, recovery, spring
from tca_mj.smp.heater import COOL_TIME, FAN_COOL_TIME, HOLD_TEMPERATURE
from tca_mj.smp.lumped import LumpedModule, ModuleState, in_tube
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.sensing.wire import fit_displacement

SMP, SPINE, TCA = SmpSpec(), SpineSpec(), CATALOGUE["free-stroke"]
HEATER = HeaterSpec.fitted(SPINE)
BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#666666"
SHADE = {Phase.SOFTEN: "#fbe3d0", Phase.MORPH: "#f7efe2", Phase.HOLD: "#e8f1e4",
         Phase.HARDEN: "#dfeaf5", Phase.RELEASE: "#f2f2f2"}  # fmt: skip
BETWEEN = (Phase.DONE, Phase.SOFTEN)


def module(tca: TcaSpec | None = None) -> LumpedModule:
    """With a kind of TCA, by default the one that lies loosely in its tube."""
    return LumpedModule(SPINE, HEATER, (tca or in_tube(TCA)).of_length(2.0 * SPINE.length))


def closed_loop(body: LumpedModule) -> MorphSequence:
    """The sequence, with the third-order polynomial of the module's own resistance."""
    angles, cold = np.radians(np.linspace(0.0, 260.0, 27)), body.bank.rest()
    ohms = [body.bank.resistance(cold, body.tca_length(np.full(1, a)))[0] for a in angles]
    fit = fit_displacement(ohms, angles)
    pi = PiSpec(proportional=25.0, integral=25.0, highest=40.0)
    drive = ClosedLoop(pi=pi, angle_of=lambda ohm: float(fit.displacement(ohm)))
    return MorphSequence(drive=drive, fading_time=body.fading_time)


def play(
    body: LumpedModule, targets: tuple[float | None, ...], dt: float = 0.05
) -> list[dict[str, Any]]:
    """Runs one sequence after the other; a row for every step."""
    sequence, state, rows = closed_loop(body), body.rest(), []
    for target in targets:
        progress = sequence.start(target)
        while not progress.over:
            seen = Measurement(float(state.heater.temperature[0]), body.resistance(state))
            progress, command = sequence.step(progress, seen, dt)
            state = body.step(state, *command, dt)
            rows.append(dict(time=dt * (len(rows) + 1), phase=progress.phase, command=command,
                             angle=math.degrees(state.angle[0]), tension=float(state.tension[0]),
                             spine=float(state.heater.temperature[0]),
                             tca=float(state.tca.temperature[0]),
                             tube=float(state.tca.body[0]), state=state))  # fmt: skip
    return rows


def softened(body: LumpedModule) -> ModuleState:
    state = body.rest()
    while state.heater.temperature[0] < HOLD_TEMPERATURE:
        state = body.step(state, 25.0, 0.0, False, 0.05)
    return state


def time_at_voltage(body: LumpedModule, volts: float, goal: float | None, dt: float) -> float:
    """Time to an angle [deg] at a constant voltage, or for None until steady (3° in 20 s)."""
    state, angles = softened(body), [0.0]
    back = round(20.0 / dt)
    while goal is None or angles[-1] < goal:
        power = volts**2 / body.resistance(state)
        state = body.step(state, 9.5, power, False, dt)
        angles.append(math.degrees(state.angle[0]))
        if goal is None and len(angles) > back and angles[-1] - angles[-1 - back] < 3.0:
            return dt * (len(angles) - 1 - back)
    return dt * (len(angles) - 1)


def heat_tables() -> tuple[str, str]:
    """Heating and cooling, and the same for other hold temperatures, in Markdown."""
    heat = float(HEATER.time_to(HOLD_TEMPERATURE, 25.0, 25.0))
    fan = float(HEATER.time_to(80.0, HOLD_TEMPERATURE, fan=True))
    first = [
        "| | reported | here | |", "|---|---|---|---|",
        f"| still air, hold to 80 °C | {COOL_TIME:.0f} s | {COOL_TIME:.0f} s | fitted |",
        f"| fan, hold to 80 °C | {FAN_COOL_TIME:.0f} s | {fan:.1f} s |"
        f" predicted, {100.0 * (fan / FAN_COOL_TIME - 1.0):+.0f} % |",
        f"| 25 V, 25 °C to hold | no number | {heat:.1f} s | predicted |",
        f"| 9.5 V holds | no number | {HOLD_TEMPERATURE:.0f} °C | estimate |",
    ]  # fmt: skip
    second = ["| hold temperature | τ | 25 V to hold | fan to 80 °C |", "|---" * 4 + "|"]
    for hold in (110.0, 115.0, 120.0, 130.0):
        heater = HeaterSpec.fitted(SPINE, hold_temperature=hold)
        second.append(
            f"| {hold:.0f} °C | {heater.heat().time_constant:.1f} s |"
            f" {heater.time_to(hold, 25.0, 25.0):.1f} s |"
            f" {heater.time_to(80.0, hold, fan=True):.1f} s |"
        )
    return "\n".join(first), "\n".join(second)


def speed_table() -> str:
    """How fast the module is, for three ways in which its TCA can lie, in Markdown."""
    ways = {"loosely in the tube": in_tube(TCA), "touching it all round": in_tube(TCA, 1.0),
            "bare": TCA}  # fmt: skip
    lines = ["| TCA | 240° at 25 V | 180° by closed loop | 180° by constant voltage |",
                "|---" * 4 + "|"]  # fmt: skip
    for name, tca in ways.items():
        body = module(tca)
        rows = play(body, (math.pi,), 0.1)
        morph = [r for r in rows if r["phase"] in (Phase.MORPH, Phase.HOLD)]
        late = [r["time"] for r in morph if abs(r["angle"] - 180.0) > 3.0]
        closed = max(late) - morph[0]["time"] + 0.2
        last = [r for r in rows if r["phase"] is Phase.HARDEN][-1]["state"]
        _, power = body.bank.steady(last.tca.temperature)
        volts = math.sqrt(float(power[0]) * body.resistance(last))
        lines.append(
            f"| {name} | {time_at_voltage(body, 25.0, 240.0, 0.02):.1f} s |"
            f" {closed:.1f} s | {time_at_voltage(body, volts, None, 0.1):.0f} s |"
        )
    return "\n".join(lines)


def draw_modulus(figure: Figure) -> None:
    axis, at = figure.subplots(), np.linspace(40.0, 150.0, 500)
    axis.axvspan(SMP.rigid_below, SMP.soft_above, color="#f7efe2")
    axis.semilogy(at, SMP.modulus(at) / 1e6, color=BLUE, lw=2)
    axis.plot([110.0, 150.0], [50.0, 50.0], color="#333333", lw=1.2)
    axis.text(149.0, 54.0, "reported: below 50 MPa", ha="right", va="bottom", fontsize=9)
    largest = SPINE.largest_modulus(math.radians(240.0), 0.78) / 1e6
    axis.plot([110.0, 150.0], [largest, largest], "--", color=ORANGE, lw=1.2)
    axis.text(149.0, largest * 1.08, "0.78 N per leg reach 240°", ha="right", va="bottom",
              fontsize=9, color=ORANGE)  # fmt: skip
    axis.text(79.0, 300.0, "reported:\nrigid", ha="right", fontsize=9)
    axis.set(xlabel="temperature [°C]", ylabel="Young's modulus [MPa]", xlim=(40, 150),
             ylim=(4, 4000))  # fmt: skip


def draw_heat(figure: Figure) -> None:
    axis = figure.subplots()
    heat = float(HEATER.time_to(HOLD_TEMPERATURE, 25.0, 25.0))
    tau, gain = float(HEATER.heat().time_constant), float(HEATER.fan_gain)
    rise, cool = np.linspace(0.0, heat, 50), np.linspace(0.0, 50.0, 200)
    excess = float(HEATER.settled(25.0)) - 25.0
    axis.plot(rise, 25.0 + excess * -np.expm1(-rise / tau), color=ORANGE, lw=2, label="25 V")
    axis.plot([heat, heat + 10.0], [HOLD_TEMPERATURE] * 2, color=GREEN, lw=2, label="9.5 V")
    begin = heat + 10.0
    for factor, colour, label in ((1.0, BLUE, "off, still air"), (gain, GREY, "off, fan")):
        course = 25.0 + (HOLD_TEMPERATURE - 25.0) * np.exp(-factor * cool / tau)
        axis.plot(begin + cool, course, color=colour, lw=2, label=label)
    axis.plot(begin + COOL_TIME, 80.0, "o", color=BLUE)
    axis.annotate("25 s, fitted", (begin + COOL_TIME, 80.0), (8, 6),
                  textcoords="offset points", fontsize=9)  # fmt: skip
    axis.plot(begin + FAN_COOL_TIME, 80.0, "o", mfc="white", mec=GREY, mew=1.5, zorder=3)
    axis.annotate("12 s reported", (begin + FAN_COOL_TIME, 80.0), (-8, -14), ha="right",
                  textcoords="offset points", fontsize=9)  # fmt: skip
    axis.axhline(80.0, color="#bbbbbb", lw=0.8)
    axis.set(xlabel="time [s]", ylabel="temperature of the spine [°C]", xlim=(0, 65),
             ylim=(20, 130))  # fmt: skip
    axis.legend(loc="upper right", frameon=False)


def draw_fixing(figure: Figure) -> None:
    """Angle over temperature: soften, load, cool, unload, reheat to three temperatures."""
    axis, torque = figure.subplots(), 0.9 * SMP.modulus(HOLD_TEMPERATURE) * math.pi
    state, angle = SpineState.rest(SMP, np.zeros(1)), np.zeros(1)
    courses = (("soften", ORANGE, np.linspace(40.0, 120.0, 200), 0.0),
               ("cool, loaded", BLUE, np.linspace(120.0, 40.0, 200), torque),
               ("reheat, free", GREEN, np.linspace(40.0, 120.0, 400), 0.0))  # fmt: skip
    for label, colour, temperatures, load in courses:
        angles = []
        for temperature in temperatures:
            modulus, reference = spring(SMP, state)
            angle = reference + load / modulus
            angles.append(math.degrees(angle[0]))
            state = advance(SMP, state, angle, temperature)
        width = 4.5 if load else 2.0  # the other two lie on it
        axis.plot(temperatures, angles, color=colour, lw=width, label=label)
    left = 1.0 - recovery(SMP, 110.0)
    axis.annotate(f"at 110 °C {100.0 * left:.0f} % are left", (110.0, 162.0 * left), (100.0, 60.0),
                  ha="right", fontsize=9, arrowprops={"arrowstyle": "-", "lw": 0.8})  # fmt: skip
    axis.annotate("", (121.5, 160.0), (121.5, 2.0), arrowprops={"arrowstyle": "->", "lw": 1.2})
    axis.text(122.3, 80.0, "load", fontsize=9)
    axis.text(41.0, 148.0, "unload: 0.2 % spring back", fontsize=9)
    axis.set(xlabel="temperature [°C]", ylabel="angle [°]", xlim=(40, 127), ylim=(-5, 175))
    axis.legend(loc="center left", frameon=False)


def shown(rows: list[dict[str, Any]]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Two spans of time [s]: each of two sequences until 25 s after its spine is rigid."""
    pairs = zip(rows, rows[1:], strict=False)
    again = next(b["time"] for a, b in pairs if (a["phase"], b["phase"]) == BETWEEN)
    rigid = [r["time"] for r in rows if r["phase"] is Phase.HARDEN]
    first = max(time for time in rigid if time < again)
    return (0.0, first + 25.0), (again - 5.0, rigid[-1] + 25.0)


def shade(axis: Axes, rows: list[dict[str, Any]], span: tuple[float, float], height: float) -> None:
    """Colours the phases, and names them at a height if there is one."""
    inside = [r for r in rows if span[0] <= r["time"] <= span[1]]
    start = 0
    for i in range(1, len(inside) + 1):
        if i == len(inside) or inside[i]["phase"] is not inside[start]["phase"]:
            phase = inside[start]["phase"]
            ends = inside[start]["time"], inside[i - 1]["time"]
            axis.axvspan(*ends, color=SHADE.get(phase, "white"), lw=0)
            if height and ends[1] - ends[0] > 5.5:
                axis.text(sum(ends) / 2.0, height, str(phase), ha="center", fontsize=8)
            start = i


def draw_morph(figure: Figure) -> None:
    """Both sequences; the time in which the TCA only cools is left out between them."""
    rows = play(module(), (math.pi, None))
    time, spans = np.array([r["time"] for r in rows]), shown(rows)
    axes = figure.subplots(3, 2, sharex="col", sharey="row",
                           width_ratios=[b - a for a, b in spans])  # fmt: skip
    heater = [float(HEATER.power(r["command"].heater_voltage)) for r in rows]
    for column, span in zip(axes.T, spans, strict=True):
        for axis in column:
            shade(axis, rows, span, 192.0 if axis is column[0] else 0.0)
        column[0].plot(time, [r["angle"] for r in rows], color=BLUE, lw=2)
        column[1].plot(time, [r["spine"] for r in rows], color=ORANGE, lw=2, label="spine")
        column[1].plot(time, [r["tca"] for r in rows], color=BLUE, lw=2, label="TCA")
        column[1].plot(time, [r["tube"] for r in rows], "--", color=GREEN, lw=2, label="tube")
        column[2].plot(time, heater, color=ORANGE, lw=2, label="heater")
        column[2].plot(time, [r["command"].tca_power for r in rows], color=BLUE, lw=2,
                       label="TCA")  # fmt: skip
        column[2].set(xlabel="time [s]", xlim=span)
    axes[0, 0].set(ylabel="angle [°]", ylim=(-10, 215))
    axes[1, 0].set(ylabel="temperature [°C]", ylim=(20, 150))
    axes[2, 0].set(ylabel="power [W]")
    for axis in axes[1:, 1]:
        axis.legend(loc="upper right", frameon=False)


def main() -> None:
    out = folder_of_pictures(__doc__, Path(__file__).parents[1] / "docs/pictures")
    if out is None:
        return print(*heat_tables(), speed_table(), sep="\n\n")
    for draw in (draw_modulus, draw_heat, draw_fixing, draw_morph):
        size = (8.0, 6.2) if draw is draw_morph else (8.0, 4.3)
        draw(figure := Figure(figsize=size, layout="constrained"))
        for axis in figure.axes:
            axis.grid(color="#e6e6e6")
            axis.set_axisbelow(True)
            axis.spines[["top", "right"]].set_visible(False)
        figure.savefig(out / f"smp_{draw.__name__[5:]}.png", dpi=120)


if __name__ == "__main__":
    main()

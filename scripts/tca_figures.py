"""Draws the figures of docs/tca.md, docs/pictures/tca_*.png; --tables prints tables instead."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

from tca_mj import pages
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec
from tca_mj.modules.morphing import MorphingSpec
from tca_mj.modules.twisting import TwistingSpec
from tca_mj.pages import folder_of_pictures
from tca_mj.record.plots import temperature_colour
from tca_mj.rod import solve_static
from tca_mj.routes import parallel
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, CoilRods, HeatStep, TcaBank, TcaSpec, coil_tension, law_at
from tca_mj.tca.embedding import CHANNEL_CONTACT

COLOURS = {"type-0-180": "#56b4e9", "type-1-180": "#0072b2", "type-2-200": "#009e73",
           "free-stroke": "#d55e00", "self-coiled": "#8a4fa3"}  # fmt: skip
CASES = (  # TCA, load [g], final temperature [°C], reported contraction
    ("type-0-180", 0, 150, "4 mm"), ("type-1-180", 0, 150, "20 mm"),
    ("type-0-180", 40, 150, "24 mm"), ("type-1-180", 40, 150, "44 mm"),
    ("type-2-200", 10, 160, "55 %"), ("type-2-200", 10, 220, "55 %"),
    ("free-stroke", 30, 160, "-"), ("free-stroke", 60, 160, "-"))  # fmt: skip
PASSIVE = 0.85 / 220.0  # printed modulus of a TCA neither heated nor loaded, over a hot one's [1]
ALMOST_NONE = 1e-6


def held_length(spec: TcaSpec, temperature: float, load: float = 0.0) -> float:
    """Length at which the TCA carries ``load`` [N]."""
    ends = 0.55 * spec.minimum_length, 0.97 * spec.fibre_length
    return float(brentq(lambda at: coil_tension(spec, at, temperature)[0] - load, *ends))


def tables() -> tuple[str, str]:
    """The catalogue, and contractions under load, in Markdown."""
    rows = ["| TCA | rest length [mm] | minimum length [mm] | free stroke [%] | coils | mass [mg] |"
            " heat capacity [mJ/K] | time constant [s] | cold stiffness [N/m] |"
            " blocked force at 125 °C [mN] |", "|---" * 10 + "|"]  # fmt: skip
    for name, s in CATALOGUE.items():
        numbers = (f"{1e3 * s.rest_length:.1f}", f"{1e3 * s.minimum_length:.1f}",
                   f"{100.0 * (1.0 - s.minimum_length / s.rest_length):.1f}", f"{s.coils:.0f}",
                   f"{1e6 * s.mass:.1f}", f"{1e3 * s.heat.capacity:.1f}",
                   f"{s.heat.time_constant:.1f}", f"{CoilRods([s]).rest_stiffness[0]:.1f}",
                   f"{1e3 * coil_tension(s, s.rest_length, 125.0)[0]:.0f}")  # fmt: skip
        rows.append(f"| `{name}` | {' | '.join(numbers)} |")
    lines = ["| TCA | load | 25 °C to | reported | cold section | hot section |", "|---" * 6 + "|"]
    for name, grams, hot, reported in CASES:
        lines.append(f"| `{name}` | {grams} g | {hot} °C | {reported} |")
        for section in ("cold", "hot"):
            s = replace(CATALOGUE[name], fibre=replace(CATALOGUE[name].fibre, section=section))
            start, end = (held_length(s, at, 9.81e-3 * grams) for at in (25.0, hot))
            lines[-1] += f" {1e3 * (start - end):.1f} mm, {100.0 * (1.0 - end / start):.0f} % |"
    return "\n".join(rows), "\n".join(lines)


def embedding_table() -> str:
    """How TCAs lie in their modules, and what heat gets out of them."""

    def told(*tcas: TcaSpec) -> str:
        found = {f"{tca.body.conductance:.2g} W/(m K)": 0 for tca in tcas if tca.body}
        return ", ".join(found)

    return "\n".join(pages.table(["where", "how it lies", "G per length", "kind"], [
        ["bending module, morphing module", "loosely, in air",
         told(BendingSpec().embedded, MorphingSpec().sheathed),
         f"the gap is fitted, {CHANNEL_CONTACT:g} W/(m K): 2 W and 0.4 W bend the module by 120°"
         " (Sun, Section 4.1.3)"],
        ["gripper", "bent to a ring, it touches half round", told(FingerPairSpec().embedded),
         "estimate, no fit"],
        ["wrist", "in a tube that is wound with it, it touches all round",
         told(TwistingSpec().embedded), "estimate, no fit"],
    ]))  # fmt: skip


def softer(spec: TcaSpec, share: float) -> TcaSpec:
    """A TCA whose moduli are a share of its own."""
    fibre = spec.fibre
    return replace(
        spec, fibre=replace(fibre, young=share * fibre.young, shear=share * fibre.shear)
    )


def heated_bend(power: float, shares: Sequence[float], conductance: float | None) -> float:
    """Angle of the bending module after 2 s of a power on TCA 0 and a fifth of it on TCA 1 [deg].

    Without gravity. ``shares`` are those of the TCAs' moduli, ``conductance`` is from a TCA to its
    silicone, per length [W/(m K)], if it is another one.
    """
    part = bending_module()
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    tcas = []
    for tca, share in zip(part.tcas, shares, strict=True):
        spec = softer(tca.spec, share)
        if conductance is not None and spec.body is not None:
            spec = replace(spec, body=replace(spec.body, conductance=conductance))
        tcas.append(replace(tca, spec=spec))
    part.tcas = tuple(tcas)
    simulation = Simulation(part)
    simulation.step([power, power / 5.0, 0.0], 2.0)
    x, y, z = simulation.data.site("tip").xmat.reshape(3, 3)[:, 2]
    return math.degrees(math.atan2(math.hypot(x, y), z))


def antagonist_tables() -> tuple[str, str]:
    """What TCAs that are not heated cost the bending module of its angle."""
    rows = [
        [name, *(f"{heated_bend(watts, (1.0, share, share), g):.0f}°" for watts in (2.0, 1.0))]
        for name, share, g in (
            ("the model", 1.0, None),
            ("antagonists a fifth as stiff (0.2)", 0.2, None),
            ("antagonists with the published passive modulus (0.85/220)", PASSIVE, None),
            ("antagonists without tension (1e-6)", ALMOST_NONE, None),
            ("the model, no heat lost (`conductance=1e-6`)", 1.0, ALMOST_NONE),
        )
    ]
    heads = ["after 2 s, by the tip's tangent, no gravity", "2 W + 0.4 W", "1 W + 0.2 W"]
    spec, tca = BendingSpec(), bending_module().tcas[0].spec
    hot = law_at(tca, 100.0)

    def bend(share: float) -> float:
        third = law_at(softer(tca, share), 25.0) if share else 0.0
        shape = solve_static(spec.body, parallel(3, spec.offset), [third, hot, hot])
        return math.degrees(shape.bend_angle)

    alone = bend(0.0)
    held = [[name, f"{bend(share):.0f}°", f"{100.0 * (alone / bend(share) - 1.0):.0f} %"]
            for name, share in (("as here", 1.0), ("a fifth as stiff", 0.2),
                                ("published passive modulus", PASSIVE))]  # fmt: skip
    held += [["no tension", f"{alone:.0f}°", ""], ["reported", "", "more than 40 %"]]
    said = ["third TCA", "bend, no gravity", "without its tension, larger by"]
    return "\n".join(pages.table(heads, rows)), "\n".join(pages.table(said, held))


def draw_tension(figure: Figure) -> None:
    spec, axis, length = CATALOGUE["free-stroke"], figure.subplots(), np.linspace(24, 72, 1500)
    axis.set(xlabel="length [mm]", ylabel="tension [N]", xlim=(24, 72), ylim=(-0.09, 0.85))
    axis.axvspan(24, 1e3 * spec.minimum_length, color="#ececec")
    axis.axhspan(-0.09, 0, color="#f7efe2")
    for hot in (175, 150, 125, 100, 75, 25):
        force, colour = coil_tension(spec, 1e-3 * length, hot)[0], temperature_colour(hot)
        label = f"{hot} °C" + (", extrapolated" if hot > spec.fibre.temperature_range[1] else "")
        axis.plot(length, np.where(force > 0, force, np.nan), color=colour, lw=2, label=label)
        axis.plot(length, np.where(force < 0, force, np.nan), ":", color=colour, lw=1.2)
        axis.plot(1e3 * held_length(spec, hot), 0.0, "o", color=colour, ms=5, zorder=3)
    axis.axhline(spec.breaking_force, color="#333333", lw=1, ls="--")
    axis.axvline(1e3 * spec.rest_length, color="#333333", lw=1, ls="--")
    for x, y, text in ((24.5, 0.5, "coils touch"), (50, -0.055, "slack: the body feels no force"),
                       (45.4, 0.72, "rest length"), (24.5, 0.795, "breaks")):  # fmt: skip
        axis.text(x, y, text, fontsize=9)
    axis.legend(loc="lower right", bbox_to_anchor=(1.01, 0.085), frameon=False)


def draw_stroke(figure: Figure) -> None:
    (left, right), hot = figure.subplots(1, 2), np.linspace(25.0, 200.0, 141)
    for name, colour in COLOURS.items():
        spec = CATALOGUE[name]
        free = [100.0 * held_length(spec, at) / spec.rest_length for at in hot]
        left.plot(hot, free, color=colour, lw=2, label=name)
        right.plot(hot, coil_tension(spec, spec.rest_length, hot)[0], color=colour, lw=2)
    for axis, label in ((left, "unloaded length / rest length [%]"),
                        (right, "blocked force at the rest length [N]")):  # fmt: skip
        axis.set(xlabel="temperature [°C]", ylabel=label, xlim=(25.0, 200.0))
        axis.axvspan(160.0, 200.0, color="#ececec")
        axis.set_title("extrapolated", fontsize=9, loc="right")
    left.legend(loc="lower left", frameon=False)


def draw_heat(figure: Figure) -> None:
    """Three ways in which 45 mm of TCA lie, heated by the same power."""
    axis, time = figure.subplots(), np.arange(401) / 10.0
    axis.set(xlabel="time [s]", ylabel="temperature [°C]", xlim=(0, 40), ylim=(20, 140))
    axis.axvspan(0, 10, color="#f7efe2")
    bare = CATALOGUE["free-stroke"]
    loose, tight = BendingSpec().embedded, TwistingSpec().embedded
    for spec, colour, name in (
        (bare, "#d55e00", "bare"), (loose, "#0072b2", "loosely in the bending module"),
        (tight, "#009e73", "in the wrist's wound tube"),
    ):  # fmt: skip
        bank = TcaBank([spec.of_length(0.045)])
        state, step, course = bank.rest(), HeatStep.of(bank.heat, 0.1), [[25.0, 25.0]]
        hot, body = state.temperature, state.body
        for start in time[:-1]:
            hot, body, _ = step.advance(hot, body, np.full(1, 1.2 * (start < 10.0)))
            course.append([hot[0], body[0]])
        own, around = np.transpose(course)
        axis.plot(time, own, color=colour, lw=2, label=name)
        if spec.body is not None:
            axis.plot(time, around, color=colour, lw=1.3, ls=":")
    axis.text(5, 134, "1.2 W", fontsize=9, ha="center")
    axis.text(25, 134, "off; dotted: the silicone round the TCA", fontsize=9, ha="center")
    axis.legend(loc="center right", frameon=False)


def main() -> None:
    out = folder_of_pictures(__doc__, Path(__file__).parents[1] / "docs/pictures")
    if out is None:
        return print(*tables(), embedding_table(), *antagonist_tables(), sep="\n\n")
    for draw in (draw_tension, draw_stroke, draw_heat):
        draw(figure := Figure(figsize=(8.0, 4.3), layout="constrained"))
        for axis in figure.axes:
            axis.grid(color="#e6e6e6")
            axis.spines[["top", "right"]].set_visible(False)
        figure.savefig(out / f"tca_{draw.__name__[5:]}.png", dpi=120)


if __name__ == "__main__":
    main()

"""What a search for TCAs comes to: a lift over time, a page, data, and files of the TCAs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from tca_mj.checks import Array, Positive, door, instance, whole
from tca_mj.machine import versions
from tca_mj.pages import page, picture, table, write_result
from tca_mj.tca.design.candidates import judged
from tca_mj.tca.design.search import Design, Designs
from tca_mj.tca.design.wish import Wish
from tca_mj.tca.dynamics.loads import Heating, Load
from tca_mj.tca.dynamics.stepping import LoadedTcas
from tca_mj.tca.files import write_tca
from tca_mj.tca.laws.creep import CreepBank
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.materials import Source
from tca_mj.tca.sensing.wire import WireTable, resistance

REPORT, PICTURE, BEST = "report", "designs.png", "tca.json"
_MEASURED_TORSION = 171.0  # of the load's softening; Sun, free-stroke TCA at 60 g [rad/m]
_NEAR = 0.01  # of a limit's range: a design that near is said to press on it
_STEPS_A_LIFT = 400
_RULE_OFF = 0.15  # of the predicted natural length: 64.8 mm for 76.1 mm
_Count = Annotated[int, partial(whole, at_least=1, at_most=100)]

# Figure, title of its column, factor on the SI unit, and format.
_COLUMNS = (
    ("energy", "energy [J]", 1.0, ".2f"), ("temperature", "hottest [°C]", 1.0, ".0f"),
    ("length", "length cold, loaded [mm]", 1e3, ".0f"), ("time", "time [s]", 1.0, ".2f"),
    ("return_time", "return [s]", 1.0, ".1f"), ("current", "current [A]", 1.0, ".2f"),
    ("diameter", "diameter [mm]", 1e3, ".2f"), ("mass", "mass [mg]", 1e6, ".0f"),
    ("stress_share", "of breaking stress", 1.0, ".2f"),
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Lifted:
    """One lift and return over time.

    Attributes:
        time: Since the supply was switched on, shape (k,) [s].
        contraction: From the cold length under the load, shape (k,) [m].
        temperature: Shape (k,) [°C].
    """

    time: Array
    contraction: Array
    temperature: Array


@door
def lifted(wish: Wish, design: Design, dt: Positive | None = None) -> Lifted:
    """A design, stepped through time: the full voltage until the stroke is reached, then none.

    Heat and motion are those of ``LoadedTcas``, without inertia: what the search takes integrals
    of, in steps, and so a check of it.

    Args:
        wish: The lift.
        design: The TCA.
        dt: Length of a step; None for a 400th of the shorter of lift and return [s].

    Raises:
        ValueError: As ``LoadedTcas``.
    """
    tca, strand = design.tca, design.tca.strand
    load = wish.load / tca.strands
    law = None
    if wish.creep is not None:
        bank = CreepBank([strand], wish.creep)
        law = bank.law(CoilRods([strand]), bank.settled([load])).tension
    tcas = LoadedTcas([strand], Load(force=load), law=law)
    wire = WireTable.of([strand])
    figures = design.figures
    if dt is None:
        dt = min(float(figures.time), float(figures.return_time)) / _STEPS_A_LIFT
    states = [tcas.rest()]
    cold = float(states[0].length[0])
    while cold - float(states[-1].length[0]) < wish.stroke:
        if len(states) * dt > 2.0 * float(figures.time):
            break
        ohms = float(resistance(wire, states[-1].length, states[-1].temperature)[0])
        limited = wish.voltage / ohms > wish.current / tca.strands
        heating = (
            Heating(source="current", value=wish.current / tca.strands) if limited
            else Heating(source="voltage", value=wish.voltage)
        )  # fmt: skip
        states.append(tcas.step(states[-1], heating, dt, "quasistatic"))
    for _ in range(math.ceil(1.2 * float(figures.return_time) / dt)):
        states.append(tcas.step(states[-1], Heating(value=0.0), dt, "quasistatic"))
    return Lifted(
        time=dt * np.arange(len(states), dtype=np.float64),
        contraction=cold - np.array([float(state.length[0]) for state in states]),
        temperature=np.array([float(state.temperature[0]) for state in states]),
    )


@door
def report(found: Designs, keep: _Count = 8, *, picture_too: bool = False) -> str:
    """The designs as a page in Markdown.

    Args:
        found: What was found.
        keep: How many designs are shown.
        picture_too: Whether the page shows ``designs.png``.
    """
    best, shown = found.best, found.spread(keep)
    wish = found.wish
    titles = ["", *(title for _, title, _, _ in _COLUMNS), "strands", "core [mm]", "groove [°]",
              "fibre [mm]", "thread"]  # fmt: skip
    rows = [[str(number), *_cells(found.front[i])] for number, i in enumerate(shown, 1)]
    return page(
        "# TCAs for a lift",
        f"Wanted: {1e3 * wish.stroke:g} mm under {wish.load:g} N within {wish.time:g} s, from a"
        f" supply of {wish.voltage:g} V. {found.evaluated} windings were tried; {len(found.front)}"
        f" are left, none of them better in one of {', '.join(found.aims)} without being worse"
        " in another. The first one below is nearest to the best of all of these.",
        table(titles, rows),
        picture("The front: first aim, second aim, colour the third. Right: the first design,"
                " stepped through a lift and its return", PICTURE) if picture_too else "",
        "## How to wind the first one",
        [f"* {line}" for line in _recipe(best, found.space.annealing_temperature)],
        "## What to know",
        [f"* {line}" for line in _cautions(found)],
    )  # fmt: skip


def _cells(design: Design) -> Iterator[str]:
    for name, _, factor, form in _COLUMNS:
        yield f"{factor * float(getattr(design.figures, name)):{form}}"
    how = design.winding
    yield str(how.strands)
    yield f"{1e3 * how.core_diameter:.2f}"
    yield f"{math.degrees(how.groove_pitch_angle):.1f}"
    yield f"{1e3 * how.fibre_length:.0f}"
    yield how.thread


def _recipe(design: Design, oven: float) -> Iterator[str]:
    how, tca = design.winding, design.tca
    fibre = tca.fibre
    turn = math.pi * (how.core_diameter + 2.0 * fibre.radius) * math.tan(how.groove_pitch_angle)
    turns = fibre.inserted_twist / (2.0 * math.pi)
    yield (f"Twist {how.thread} by {turns:.0f} turns per metre, and cut"
           f" {how.strands} x {1e3 * how.fibre_length:.0f} mm of the twisted fibre.")
    yield (f"Wind each on a core of {1e3 * how.core_diameter:.2f} mm, {1e3 * turn:.2f} mm"
           f" per turn ({math.degrees(how.groove_pitch_angle):.1f}°), {tca.coils:.0f} turns;"
           f" anneal at {oven:g} °C.")
    yield (f"Off the mandrel it is to creep to {1e3 * tca.rest_length:.1f} mm, and to"
           f" {1e3 * float(design.figures.length):.1f} mm under the load; measure both.")
    ohms = tca.resistance_per_length * tca.rest_length / tca.strands
    yield (f"{tca.strands} side by side, connected in parallel, have {ohms:.2f} ohm."
           if tca.strands > 1 else f"It has {ohms:.2f} ohm.")  # fmt: skip


def _cautions(found: Designs) -> Iterator[str]:
    best, space, wish = found.best, found.space, found.wish
    figures, how = best.figures, best.winding
    ends = {
        "core_diameter": how.core_diameter, "groove_pitch_angle": how.groove_pitch_angle,
        "fibre_length": how.fibre_length, "strands": how.strands,
        "spring_index": float(figures.spring_index),
    }  # fmt: skip
    for name, value in ends.items():
        low, high = getattr(space, name)
        for end in (low, high) if high > low else ():
            if abs(value - end) <= _NEAR * (high - low):
                yield f"`{name}` is at the end of its range, {end:.4g}: a wider one may do better."
    near = {
        name: getattr(wish, name) for name in ("time", "return_time", "current", "length",
                                               "diameter")
    } | {"stress_share": space.stress_share}  # fmt: skip
    for name, limit in near.items():
        if float(getattr(figures, name)) > (1.0 - _NEAR) * limit:
            yield f"`{name}` is at its limit, {limit:.4g}."
    yield ("The natural length is predicted by a rule that was fitted to two TCAs of one thread,"
           f" and has been off by {100.0 * _RULE_OFF:.0f} % on another."
           + "".join(f" {each}." for each in _other_lengths(found)))
    yield ("Resistance and heat loss per length of fibre, and how close coils touch, are taken from"
           " the TCA by which the thread is known; the loss is that of still air, and of strands"
           " that hang apart.")
    yield ("Both ends are glued. The constants of creep are those of one thread, silver-coated"
           " nylon." if wish.creep is not None else "Both ends are glued. Creep is left out.")
    softened = best.tca.fibre.load_softening[:2] != (0.0, 0.0)
    if softened and float(figures.torsion) > _MEASURED_TORSION:
        yield (f"The load twists the fibre by {float(figures.torsion):.0f} rad/m; how that softens"
               f" it was measured up to {_MEASURED_TORSION:g}.")
    if best.tca.breaking_force is None:
        yield "At which stress this thread breaks is not known: nothing limits it here."


def _other_lengths(found: Designs) -> Iterator[str]:
    """What becomes of the best design if its natural length is not what is predicted: sentences."""
    tca = found.best.tca
    for words, share in (("shorter", 1.0 - _RULE_OFF), ("longer", 1.0 + _RULE_OFF)):
        sine = share * math.sin(tca.pitch_angle)
        if sine <= math.sin(tca.minimum_pitch_angle):
            yield f"If it is that much {words}, its coils touch"
            continue
        figures, _ = judged(found.wish, found.space, [tca.of_pitch(math.asin(sine))])
        if np.isfinite(figures.time[0]):
            yield (f"If it is that much {words}, the lift takes {figures.time[0]:.2f} s and"
                   f" {figures.temperature[0]:.0f} °C")  # fmt: skip
        else:
            yield f"If it is that much {words}, the stroke is not reached"


@door
def write_designs(
    found: Designs, out: str | Path, keep: _Count = 8, *, picture_too: bool = False
) -> None:
    """Writes the page, the same as data, and files of TCAs: ``tca.json`` and ``tca-2.json``, ...

    Args:
        found: What was found.
        out: The folder.
        keep: How many designs are shown and written.
        picture_too: As of ``report``.

    Raises:
        OSError: If they cannot be written.
    """
    instance("found", found, Designs)
    out = Path(out)
    shown = found.spread(keep)
    for number, i in enumerate(shown, 1):
        design = found.front[i]
        name = BEST if number == 1 else f"tca-{number}.json"
        write_tca(out / name, design.tca, _sources(design), f"designed; {_words(design)}")
    write_result(out, REPORT, result(found), report(found, keep, picture_too=picture_too))


def result(found: Designs) -> dict[str, Any]:
    """The whole front as data."""
    wish = {name: value for name, value in asdict(found.wish).items() if value != math.inf}
    return {
        "versions": versions("pymoo"), "wish": wish, "aims": list(found.aims),
        "evaluated": found.evaluated, "chosen": found.chosen,
        "front": [
            {"winding": asdict(each.winding),
             "figures": {name: float(value) for name, value in each.figures._asdict().items()}}
            for each in found.front
        ],
    }  # fmt: skip


def _words(design: Design) -> str:
    how = design.winding
    return (
        f"{how.thread} on a core of {1e3 * how.core_diameter:.3f} mm,"
        f" {math.degrees(how.groove_pitch_angle):.2f}°"
    )


def _sources(design: Design) -> dict[str, Source]:
    """Where the numbers of a designed TCA come from: none of it was measured on this one."""
    rule = Source(kind="estimate", data=f"designed: {_words(design)}")
    thread = Source(kind="estimate", data=f"of {design.winding.thread}, per length of fibre")
    return {
        **dict.fromkeys(("fibre_length", "coil_radius", "pitch_angle"), rule),
        **dict.fromkeys(("minimum_pitch_angle", "resistance_per_length", "heat_loss"), thread),
    }  # fmt: skip

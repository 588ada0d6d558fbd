"""Temporary length and ageing of type 1-180 (Sun, Section 2.2.2)."""


from typing import NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca import CATALOGUE, TcaSpec, hanging_length
from tca_mj.tca.laws.creep import CreepBank, CreepSpec, aged, relaxation_time
from tca_mj.validation.facts import Finding, finding
from tca_mj.validation.strokes import Ends, contraction, weight

_HOUR = 3600.0
# Durations [s]: at rest, cold with the weight, hot, cold again (100 s, Sun); estimates otherwise.
_LOADED, _HEATED, _HOT, _COOLED = 120.0, 300.0, 4.0, 100.0


def four_lengths(tca: TcaSpec, ends: Ends) -> Array:
    """Lengths l1 to l4 [mm]: natural; just loaded with 20 g; crept; unloaded again."""
    bank, load = CreepBank([tca]), weight(20)
    (crept,) = bank.crept(bank.cycle(bank.rest(), load))
    return np.array([
        1e3 * float(hanging_length(now, 25.0, force, spin=ends))
        for now, force in ((tca, 0.0), (tca, load), (crept, load), (crept, 0.0))
    ])  # fmt: skip


def findings() -> list[Finding]:
    """Order l1 < l2 < l4 < l3, and what was fitted; loss of stroke in 10,000 cycles at 2 MPa."""
    rows = []
    new = CATALOGUE["type-1-180"]
    named: dict[Ends, str] = {"locked": "glued", "free": "free to spin"}
    for ends, name in named.items():
        l1, l2, l3, l4 = four_lengths(new, ends)
        rows.append(finding("four-lengths", float(l4 - l2), bool(l1 < l2 < l4 < l3),
                            name=name, l1=l1, l2=l2, l3=l3, l4=l4))  # fmt: skip
    bank = CreepBank([new])
    after = bank.step(bank.rest(), weight(20), 25.0, 20.0 * _HOUR)
    old = aged(new, 10e3, CreepSpec())
    loss = 100.0 * (1.0 - contraction(old, 20, 100.0) / contraction(new, 20, 100.0))
    return [
        *rows,
        finding("creep-cold", 100.0 * float(after.shift[0] / bank.settled([weight(20)])[0])),
        finding("creep-hot", float(relaxation_time(150.0, CreepSpec()))),
        finding("ageing", loss),
    ]  # fmt: skip


class Experiment(NamedTuple):
    """Length of type 1-180 over time: loaded with 20 g, heated once, unloaded, heated again.

    Attributes:
        time: Shape (k,) [s].
        length: Shape (k,) [mm].
        events: Time [s] and what happens.
    """

    time: Array
    length: Array
    events: tuple[tuple[float, str], ...]


def experiment() -> Experiment:
    """Runs it, heated to 150 °C for a few seconds at a time."""
    bank = CreepBank([CATALOGUE["type-1-180"]])
    state, now = bank.rest(), 0.0
    rows, events = [], []
    plan = (  # duration, load [g], temperature, what begins
        (_LOADED, 0.0, 25.0, "no load"), (_HEATED, 20.0, 25.0, "20 g"),
        (_HOT, 20.0, 150.0, "heated"), (_COOLED, 20.0, 25.0, "cold"),
        (_HEATED, 0.0, 25.0, "unloaded"), (_HOT, 0.0, 150.0, "heated"),
        (_COOLED, 0.0, 25.0, "cold"),
    )  # fmt: skip
    for duration, grams, temperature, word in plan:
        events.append((now, word))
        for step in [0.0, *[duration / 20.0] * 20]:
            state = bank.step(state, weight(grams), temperature, step)
            now += step
            (tca,) = bank.crept(state)
            length = hanging_length(tca, temperature, weight(grams), spin="locked")
            rows.append((now, 1e3 * float(length)))
    time, length = np.array(rows).T
    return Experiment(time, length, tuple(events))

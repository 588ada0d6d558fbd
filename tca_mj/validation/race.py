"""Four types of TCA heated by the same current: which is fastest (Sun, Section 2.2.2)."""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca import CATALOGUE, Load, LoadedTcas, TcaSpec
from tca_mj.tca.dynamics.loads import Course
from tca_mj.validation.facts import Finding, fitted, trend
from tca_mj.validation.strokes import TYPES, heat_up

NAMES = tuple(name for name in TYPES if name != "type-0-180")


class Race(NamedTuple):
    """Four types under 20 g, 1 A for 2 s: displacement over time.

    Attributes:
        time: Time, shape (k,) [s].
        displacement: By name, each of shape (k,) [mm].
        hottest: Highest temperature [°C].
    """

    time: Array
    displacement: dict[str, Array]
    hottest: float


@cache
def race() -> Race:
    """Runs it: "fabricated with precursor threads of the same length, and thus resistance"."""
    course = run((CATALOGUE[name] for name in NAMES), 0.01)
    moved = 1e3 * (course.length[0] - course.length)
    return Race(course.time, dict(zip(NAMES, moved.T, strict=True)),
                float(course.temperature.max()))  # fmt: skip


def run(tcas: Iterable[TcaSpec], dt: float) -> Course:
    """TCAs under 20 g and 1 A for 2 s, in steps of ``dt`` [s]."""
    loaded = LoadedTcas(list(tcas), Load.weight(0.020))
    return heat_up(loaded, "current", 1.0, dt, round(2.0 / dt))


def ahead(found: Race, name: str, rival: str) -> tuple[bool, float]:
    """Whether a type is ahead of a rival until its own coils touch, and when they do [s].

    They touch once all but 2 mm of the way to its last displacement, or to contact, are done.
    """
    tca = CATALOGUE[name]
    start = float(LoadedTcas([tca], Load.weight(0.020)).rest().length[0])
    far = 1e3 * (start - tca.minimum_length) - 2.0
    moved = found.displacement[name]
    until = int(np.argmax(moved >= far)) if (moved >= far).any() else len(moved)
    first = slice(1, until)
    return bool(np.all(moved[first] > found.displacement[rival][first])), float(
        found.time[min(until, len(moved) - 1)]
    )


def fastest(found: Race | None = None) -> list[Finding]:
    """Which of the four types is fastest at 1 A, and which goes furthest."""
    found = race() if found is None else found
    end = {name: float(moved[-1]) for name, moved in found.displacement.items()}
    first, rival = found.displacement["type-2-180"], found.displacement["type-1-180"]
    share = 100.0 * float(rival[50] / first[50] - 1.0)
    behind = found.time[(rival > first) & (found.time > 0.0)]
    until = float(behind.max()) if behind.size else 0.0
    source = "Section 2.2.2"
    faster = {k: ahead(found, f"type-{k}-180", f"type-{k}-200") for k in (1, 2)}
    largest = max(end.values())
    return [
        fitted(source, "20 g, 1 A for 2 s: largest displacement", "60 mm", f"{largest:.0f} mm",
               "the loss to air of the TCAs of Chapter 2, `_AIR_LOSS` in `tca/catalogue.py`."
               f" The hottest of the four has {found.hottest:.0f} °C after 2 s, which is beyond the"
               " data.", value=largest),
        trend(source, "20 g, 1 A: annealed at 180 °C against 200 °C", "180 °C is faster",
              "of either groove type -180 ahead until its coils touch",
              ", ".join(f"{k}-180 {'ahead' if held else 'not ahead'} until {when:.1f} s"
                        for k, (held, when) in faster.items()),
              all(held for held, _ in faster.values())),
        trend(source, "20 g, 1 A for 2 s: annealed at 200 °C against 180 °C",
              "200 °C goes further", "of either groove type -200 ahead after 2 s",
              ", ".join(f"{name[5:]} {value:.0f}" for name, value in end.items()) + " mm",
              all(end[f"type-{k}-200"] > end[f"type-{k}-180"] for k in (1, 2))),
        trend(source, "20 g, 1 A: type 1-180 slows down", "and ends below type 2-180",
              "its coils touch first, and it is behind after 2 s",
              f"they touch after {faster[1][1]:.1f} s; {end['type-1-180']:.0f} and"
              f" {end['type-2-180']:.0f} mm after 2 s",
              faster[1][1] < faster[2][1] and end["type-1-180"] < end["type-2-180"]),
        trend(source, "20 g, 1 A: type 2-180 against type 1-180", "type 2-180 responds faster",
              "type 2-180 ahead all the time", f"behind until {until:.2f} s", until == 0.0,
              value=until,
              reason=f"Type 1-180 is {share:.0f} % ahead after 0.5 s and falls behind when its"
              " coils touch: the coil with the smaller pitch untwists into more contraction."),
    ]  # fmt: skip

"""Four types of TCA heated by the same current: which is fastest (Sun, Section 2.2.2)."""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca import CATALOGUE, Load, LoadedTcas, TcaSpec
from tca_mj.tca.dynamics.loads import Course
from tca_mj.validation.facts import Finding, finding
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
    behind = found.time[(rival > first) & (found.time > 0.0)]
    until = float(behind.max()) if behind.size else 0.0
    faster = {k: ahead(found, f"type-{k}-180", f"type-{k}-200") for k in (1, 2)}
    leads = ", ".join(f"{k}-180 {'ahead' if held else 'not ahead'} until {when:.1f} s"
                      for k, (held, when) in faster.items())  # fmt: skip
    return [
        finding("race-largest", max(end.values()), hottest=found.hottest),
        finding("race-annealed", held=all(held for held, _ in faster.values()), shown=leads),
        finding("race-furthest",
                held=all(end[f"type-{k}-200"] > end[f"type-{k}-180"] for k in (1, 2)),
                shown=", ".join(f"{name[5:]} {value:.0f}" for name, value in end.items())),
        finding("race-slows", held=faster[1][1] < faster[2][1]
                and end["type-1-180"] < end["type-2-180"], touch=faster[1][1], end=end),
        finding("race-pitch", until, until == 0.0,
                share=100.0 * float(rival[50] / first[50] - 1.0)),
    ]  # fmt: skip

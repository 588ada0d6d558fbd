"""One thread or two: the facts of Chapter 2 with the stiffness and untwist that are open.

Sun, dissertation, Colorado State University, twists the same thread under the same weight in
Chapters 2 and 3. Its moduli were measured in Chapter 3, on a circle of 0.21 mm radius; in Chapter 2
the thread is 0.34 mm thick. The moduli on the thickness give a second thread whose EI and GJ are
2.3 times smaller. This file compares both, and the free factor on the untwist.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from tca_mj import pages
from tca_mj.tca import CATALOGUE, hanging_length, tension
from tca_mj.validation import strokes
from tca_mj.validation.creeping import four_lengths
from tca_mj.validation.drag import ANNEALED, FRICTION
from tca_mj.validation.facts import words
from tca_mj.validation.race import NAMES, run
from tca_mj.validation.strokes import CONTRACTIONS, DEVIATION, STOPS, THICKNESS, Choice, overlaps

_ONE = Choice(CATALOGUE["free-stroke"].fibre.radius, softened=True)
_TWO = Choice(THICKNESS / 2.0)
# What the moduli are taken on, softened by the load as in Chapter 3 or not, in words.
THREADS: Mapping[str, Choice] = MappingProxyType({
    "one thread (in use)": _ONE,
    "one thread, not softened": _ONE._replace(softened=False),
    "one thread, hot section": _ONE._replace(section="hot"),
    "one thread, untwist x 1.6": _ONE._replace(untwist=1.6),
    "two threads (before)": _TWO,
    "two threads, hot section": _TWO._replace(section="hot"),
    "two threads, untwist x 1.7": _TWO._replace(untwist=1.7),
})  # fmt: skip


class Facts(NamedTuple):
    """What a thread gives, in the order of the table."""

    contractions: tuple[float, ...]  # those of ``CONTRACTIONS`` [mm]
    stroke: float  # of type 2-200 under 10 g to 160 °C [%]
    annealed: float  # the same to 200 °C [%]
    pull: float  # of type 2-200 at its natural length, 160 °C [N]
    end: float  # the same at the end of the free stroke, 200 °C [N]
    overlap: tuple[float, float]  # below 70 °C, types 0 and 1 [mm]
    temporary: float  # l4 - l2 of type 1-180 with ends free to spin [mm]
    largest: float  # displacement after 1 A for 2 s under 20 g [mm]

    @property
    def held(self) -> tuple[bool, ...]:
        """Which of eleven facts it holds."""
        found = dict(zip(CONTRACTIONS, self.contractions, strict=True))
        return (
            *(max(stop, CONTRACTIONS[name, 0]) - DEVIATION <= found[name, 0]
              <= min(stop, CONTRACTIONS[name, 0]) + DEVIATION for name, stop in STOPS.items()),
            *(abs(found[name, 40] - CONTRACTIONS[name, 40]) <= DEVIATION for name in STOPS),
            50.0 <= self.annealed <= 60.0, self.pull >= FRICTION, self.end >= FRICTION,
            *(off <= DEVIATION for off in self.overlap), self.temporary > 0.0,
            abs(self.largest - 60.0) <= 6.0,
        )  # fmt: skip


def facts(thread: Choice) -> Facts:
    """Computes them."""
    tca = thread.tca("type-2-200")
    cold, data, annealed = hanging_length(tca, [25.0, 160.0, ANNEALED], strokes.weight(10))
    _, second, _, fourth = four_lengths(thread.tca("type-1-180"), "free")
    course = run(map(thread.tca, NAMES), 0.02)
    return Facts(
        contractions=tuple(thread.contractions().tolist()),
        stroke=100.0 * float(1.0 - data / cold), annealed=100.0 * float(1.0 - annealed / cold),
        pull=float(tension(tca, tca.rest_length, 160.0, spin="locked")[0]),
        end=float(tension(tca, 0.52 * tca.rest_length + 0.5e-3, ANNEALED, spin="locked")[0]),
        overlap=(overlaps(thread.tca("type-0-180"))[0], overlaps(thread.tca("type-1-180"))[0]),
        temporary=float(fourth - second),
        largest=1e3 * float((course.length[0] - course.length[-1]).max()),
    )  # fmt: skip


def table() -> str:
    """The table, as Markdown, and what it says."""
    rows = [["*published*", "4, 20", "24, 44", "55", "0.4, 0.4", f"up to {DEVIATION}", "above 0",
             "60", "", ""]]  # fmt: skip
    for name, thread in THREADS.items():
        row = facts(thread)
        a, b, c, d = row.contractions
        rows.append([
            name, f"{a:.1f}, {b:.1f}", f"{c:.1f}, {d:.1f}",
            f"{row.stroke:.0f}, {row.annealed:.0f}", f"{row.pull:.2f}, {max(row.end, 0.0):.2f}",
            f"{row.overlap[0]:.1f}, {row.overlap[1]:.1f}", f"{row.temporary:.1f}",
            f"{row.largest:.0f}", f"{sum(row.held)}", "no" if thread.untwist == 1.0 else "yes",
        ])  # fmt: skip
    heads = ["thread", "0 g, types 0, 1 [mm]", "40 g [mm]", "55 % under 10 g [%]",
             "0.4 N, start and end [N]", "below 70 °C [mm]", "l4 - l2 [mm]", "1 A, 2 s [mm]",
             "held of 11", "fitted"]  # fmt: skip
    return pages.page(words("thread-choices"), pages.table(heads, rows), words("thread-result"))

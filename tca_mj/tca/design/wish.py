"""What a TCA is wanted for, and what it may be wound of."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import Checked, Finite, Positive, edge, number, row, shown, whole
from tca_mj.hints import size
from tca_mj.tca.catalogue import CATALOGUE
from tca_mj.tca.laws.creep import CreepSpec
from tca_mj.tca.mandrel import BRILL_TRANSITION
from tca_mj.tca.spec import TcaSpec


def _most(name: str, value: Any) -> float:
    """A limit: a positive number, or infinity for none."""
    return number(name, value, above=0.0) if edge(name, value) < math.inf else math.inf


def _span(name: str, value: Any, **bounds: Any) -> tuple[float, ...]:
    """The least and the largest of something."""
    low, high = row(name, value, shape=(2,), **bounds)
    number(f"{name}[1]", high, at_least=low)
    return low, high


def _counts(name: str, value: Any) -> tuple[int, ...]:
    """The least and the largest number of something."""
    low, high = row(name, value, shape=(2,))
    if not (low.is_integer() and high.is_integer()):
        raise ValueError(f"{name} must be two whole numbers, got {shown(value)}")
    first = whole(f"{name}[0]", int(low), at_least=1)
    return first, whole(f"{name}[1]", int(high), at_least=first, at_most=100)


_Most = Annotated[float, _most]
_Lengths = Annotated[tuple[float, float], partial(_span, above=0.0, at_most=10.0, unit="m")]
_Cores = Annotated[tuple[float, float], partial(_span, above=0.0, at_most=0.05, unit="m")]
_Angles = Annotated[tuple[float, float], partial(_span, above=0.0, below=0.5 * math.pi, unit="rad")]
_Indices = Annotated[tuple[float, float], partial(_span, above=1.0)]
_Strands = Annotated[tuple[int, int], _counts]
_Part = Annotated[float, partial(number, above=0.0, at_most=1.0)]


@dataclass(frozen=True, kw_only=True, slots=True)
class Wish(Checked):
    """A lift: a TCA that carries a load contracts by a stroke, in still air, both ends glued.

    It carries the load cold, too, and has crept under it: a TCA that lifts 30 g is a quarter longer
    for it, and its stroke is another one.

    Attributes:
        stroke: How far it has to contract under the load [m].
        load: What it carries all the time [N].
        time: In which time from cold, at most [s].
        voltage: Of the supply; the TCA gets all of it until the stroke is reached [V].
        current: Largest current of the supply; infinity for no limit [A].
        return_time: Longest time in which it gives back nine tenths of the stroke, cooling [s].
        length: Longest length that it may have, cold and under the load [m].
        diameter: Largest outer diameter [m].
        temperature: Hottest temperature; infinity for where the measurements of each thread
            (``fibre.temperature_range``) end, beyond which nothing is designed [°C].
        creep: Constants of creep; None for a TCA that has not crept yet.
    """

    stroke: Annotated[float, partial(size, kind="strokes of TCAs", at_most=1.0)]
    load: Annotated[float, partial(size, kind="loads of TCAs", at_most=1e3, unit="N")]
    time: Positive
    voltage: Positive
    current: _Most = math.inf
    return_time: _Most = math.inf
    length: _Most = math.inf
    diameter: _Most = math.inf
    temperature: _Most = math.inf
    creep: CreepSpec | None = field(default_factory=CreepSpec)


def _threads() -> dict[str, TcaSpec]:
    return {"free-stroke": CATALOGUE["free-stroke"]}


@dataclass(frozen=True, kw_only=True, slots=True)
class Space(Checked):
    """What TCAs may be wound of: thread, mandrel, pitch, length, and strands side by side.

    A thread is known by a TCA of it. From that come the fibre, resistance and heat loss per
    fibre length, how the resistance follows the length, how close coils come before they touch
    (over close packing), and the shear stress at which it broke. That those are the same in another
    coil of the same thread is an assumption; see ``designed``.

    Attributes:
        threads: TCAs of the threads that there are, by name.
        core_diameter: Least and largest diameter of the mandrel's core, the inner diameter of
            the coil [m].
        groove_pitch_angle: Least and largest pitch angle on the mandrel; the measurements behind
            ``kept_share`` are at 16 and 23 degrees [rad].
        fibre_length: Least and largest length of twisted fibre in one strand [m].
        strands: Fewest and most strands side by side.
        spring_index: Least and largest ratio of the coil's radius to the fibre's. An estimate: the
            published coils have 1.1 to 2.2. The laws know no upper limit, and wide coils lift
            farther; that they are soft, sway and tangle is not in them.
        annealing_temperature: Of the oven; at 200 °C and above a coil keeps the pitch of its
            mandrel [°C].
        stress_share: Largest share of the stress at which the thread broke. An estimate: Sun,
            dissertation, Colorado State University, Section 2.3.1, loads up to 0.7.
    """

    threads: Mapping[str, TcaSpec] = field(default_factory=_threads)
    core_diameter: _Cores = (0.2e-3, 2.0e-3)
    groove_pitch_angle: _Angles = (0.21, 0.52)
    fibre_length: _Lengths = (0.05, 3.0)
    strands: _Strands = (1, 4)
    spring_index: _Indices = (1.1, 2.5)
    annealing_temperature: Finite = 180.0
    stress_share: _Part = 0.5

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if not self.threads:
            raise ValueError("threads must hold at least one TCA, got none")
        for name, tca in self.threads.items():
            if tca.plies is not None or tca.body is not None:
                got = shown(tca.plies or tca.body)
                raise ValueError(f"threads[{name!r}] must be a bare TCA of one strand, got {got}")
            number(
                f"annealing_temperature ({name})", self.annealing_temperature,
                above=BRILL_TRANSITION, below=tca.fibre.melting_temperature, unit="°C",
            )  # fmt: skip

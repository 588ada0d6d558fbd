"""Heat capacity, loss to air and resistance: every thermal fact under every reading of them.

What is printed does not hold together: the weighed mass, the loss that was identified and the
resistance per length cannot all be right, and each may be read in more than one way. So all facts
are computed under all readings, with one table. "Sun" is J. Sun's dissertation, Colorado State
University.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tca_mj import pages
from tca_mj.modules.bistable import BistableSpec
from tca_mj.smp.convection import moving_air, radiation, still_air
from tca_mj.tca import CATALOGUE, Heating, Load, LoadedTcas, TcaBank, TcaMelted, TcaSpec
from tca_mj.tca.dynamics.loads import Course
from tca_mj.validation.facts import Finding, finding, words
from tca_mj.validation.race import NAMES, run
from tca_mj.validation.sensors import SENSED, crept
from tca_mj.validation.strokes import heat_up
from tca_mj.validation.theories import crept_free_stroke

THREAD = 0.350  # Sun, Table 2.1 [m]
MEASURED = (0.8, 0.080)  # voltage and current of the cold TCA of 110 mm, Sun, Section 2.3.1 [V, A]
WARMED = (1.0, 2.0)  # how much they warm it, by an infrared camera [K]
LARGEST = 60.0  # displacement after 1 A for 2 s under 20 g, Sun, Section 2.2.2 [mm]
FINGER = 6.6  # two TCAs of 45 mm, Sun, Section 4.2.2 [ohm]
ACCELERATION = 0.2  # of 20 g at 10 and 12 V at most, Sun, Section 2.3.1 [m/s^2]
PULSES = ((1.5, 0.8), (2.5, 0.3))  # on a TCA of 100 mm, Sun, Section 4.3.4 [A, s]
SILICONE = BistableSpec().embedded.body  # about a TCA of the bistable finger
_COIL = CATALOGUE["free-stroke"]
_SENSED_MADE = 0.1335  # made length of the TCA of Table 2.3 [m]
_MADE = CATALOGUE["free-stroke-made"].rest_length / _COIL.rest_length
_COMPUTED = 1300.0 * math.pi * 0.21e-3**2  # density of Sun, Table 3.1, on its circle [kg/m]
_STILL = 23.0 * 2.5 * 2.0 * math.pi  # h c_s 2 pi, Sun, Table 3.1 and Section 3.1.1 [W/(m^2 K)]

# Readings of what 6.7 ohm/dm belong to: ohm of a TCA by its thread, made and natural length [m].
READINGS = {
    "natural": lambda thread, made, natural: 67.0 * natural,
    "made": lambda thread, made, natural: 67.0 * made,
    "80 mA": lambda thread, made, natural: 10.0 * thread / THREAD,
    "thread": lambda thread, made, natural: 67.0 * thread,
}
LOSSES = {"0.17": _STILL * 0.17e-3, "0.21": _STILL * 0.21e-3, "32 mW/K": 0.032 / THREAD,
          "56 mW/K": 0.0555 / THREAD, "64 mW/K": 0.064 / THREAD}  # fmt: skip
SLOPES = {"6 %": 0.55 / (67.0 * 0.110) / 0.5, "20 %": _COIL.contraction_resistance}


class Candidate(NamedTuple):
    """One reading of everything."""

    weighed: bool = True
    loss: str = "56 mW/K"
    resistance: str = "made"
    slope: str = "20 %"

    @property
    def words(self) -> str:
        """What it is, in the words of the table."""
        mass = "weighed" if self.weighed else "computed"
        return f"{mass}, {self.loss}, {self.resistance}, {self.slope}"

    def tca(self, tca: TcaSpec, made: float, like: TcaSpec | None = None) -> TcaSpec:
        """A bare TCA under it, of the resistance of one ``like`` it that was made so long [m]."""
        like = like or tca
        density = tca.fibre.line_density if self.weighed else _COMPUTED
        ohms = READINGS[self.resistance](like.fibre_length, made, like.rest_length)
        return replace(
            tca, fibre=replace(tca.fibre, line_density=density), heat_loss=LOSSES[self.loss],
            resistance_per_length=ohms / tca.rest_length,
            contraction_resistance=SLOPES[self.slope],
        )  # fmt: skip


class Heated(NamedTuple):
    """What a candidate gives; None where the fibre would melt.

    Attributes:
        mass: Of a TCA of Chapter 2 [mg].
        current: Of the cold TCA of 110 mm at 0.8 V [mA].
        warming: Its rise at that current [K].
        race: Hottest of the four types after 1 A for 2 s [°C].
        largest: Largest displacement then [mm].
        volts: The free-stroke TCA after 4 s at 5 and 6 V under 30 g [°C].
        acceleration: Of 20 g at 12 V until 40 mm [m/s^2].
        hold: Power that holds 20 g at 40 mm [W].
        pulses: A TCA of 100 mm after 1.5 A for 0.8 s and 2.5 A for 0.3 s, bare [°C].
        soft: The same in silicone [°C].
        finger: Two TCAs of 45 mm [ohm].
    """

    mass: float
    current: float
    warming: float
    race: float | None
    largest: float | None
    volts: tuple[float | None, float | None]
    acceleration: float
    hold: float
    pulses: tuple[float | None, ...]
    soft: tuple[float | None, ...]
    finger: float

    @property
    def held(self) -> tuple[bool, ...]:
        """Which of eight facts it holds, in the order of the table."""
        return (
            abs(self.mass / 32.0 - 1.0) <= 0.1,
            abs(self.current - 80.0) <= 10.0,
            WARMED[0] <= self.warming <= WARMED[1],
            self.largest is not None and abs(self.largest - LARGEST) <= 6.0,
            None not in self.volts,
            self.acceleration <= ACCELERATION,
            None not in self.pulses and None not in self.soft,
            abs(self.finger / FINGER - 1.0) <= 0.1,
        )


def heated(candidate: Candidate) -> Heated:
    """All thermal facts under one candidate."""
    sensed = candidate.tca(SENSED, _SENSED_MADE)
    ohms, loss = sensed.resistance_per_length * sensed.rest_length, sensed.heat.loss
    hottest, largest = _race(candidate)
    long = candidate.tca(_COIL.of_length(0.100), 0.100 * _MADE)
    short = candidate.tca(_COIL, _COIL.rest_length * _MADE)
    acceleration, hold = _lift(candidate)
    return Heated(
        mass=1e6 * sensed.mass, current=1e3 * MEASURED[0] / ohms,
        warming=MEASURED[0] ** 2 / ohms / float(loss), race=hottest, largest=largest,
        volts=(_lifted(candidate, 5.0), _lifted(candidate, 6.0)),
        acceleration=acceleration, hold=hold,
        pulses=tuple(pulse(long, *at) for at in PULSES),
        soft=tuple(pulse(replace(long, body=SILICONE), *at) for at in PULSES),
        finger=2.0 * short.resistance_per_length * short.rest_length,
    )  # fmt: skip


def _melts(specs: Sequence[TcaSpec], heat: Callable[[], Course]) -> Course | None:
    """What TCAs do; None where one melts."""
    try:
        course = heat()
    except ValueError:  # no modulus is left
        return None
    return course if course.temperature.max() < specs[0].fibre.melting_temperature else None


def _race(candidate: Candidate) -> tuple[float | None, float | None]:
    # One thread, one resistance (Section 2.2.2): that of the TCA of Table 2.3.
    specs = [candidate.tca(CATALOGUE[name], _SENSED_MADE, SENSED) for name in NAMES]
    course = _melts(specs, lambda: run(specs, 0.02))
    if course is None:
        return None, None
    moved = 1e3 * (course.length[0] - course.length[-1])
    return float(course.temperature.max()), float(moved.max())


def _lifted(candidate: Candidate, volts: float) -> float | None:
    tca = candidate.tca(crept_free_stroke(30), _COIL.rest_length * _MADE, _COIL)
    tcas = LoadedTcas([tca], Load.weight(0.030))
    course = _melts([tca], lambda: heat_up(tcas, "voltage", volts, 0.02, 200))
    return None if course is None else float(course.temperature[-1, 0])


def _lift(candidate: Candidate) -> tuple[float, float]:
    """Largest acceleration of 20 g at 12 V up to 40 mm; power that holds it there."""
    tca = candidate.tca(crept(20), _SENSED_MADE, SENSED)
    tcas = LoadedTcas([tca], Load.weight(0.020))
    state, moved, hot, dt = tcas.rest(), [0.0], 25.0, 0.005
    start = float(state.length[0])
    while moved[-1] < 0.040 and len(moved) < 2000:
        state = tcas.step(state, Heating(source="voltage", value=12.0), dt, "quasistatic")
        moved.append(start - float(state.length[0]))
        hot = float(state.temperature[0])
    path = np.array(moved)
    rate = np.convolve(np.diff(path, 2) / dt**2, np.ones(5) / 5.0, "valid")
    return float(np.abs(rate).max()), float(tca.heat.loss) * (hot - 25.0)


def pulse(tca: TcaSpec, amperes: float, seconds: float) -> float | None:
    """Temperature after a constant current at the natural length [°C]; None if it melts."""
    bank = TcaBank([tca])
    power = amperes**2 * bank.resistance(bank.rest(), bank.rest_length)
    try:
        state, _ = bank.advance(bank.rest(), power, bank.rest_length, seconds)
    except TcaMelted:
        return None
    return float(state.temperature[0])


IN_USE = Candidate()
DEFAULTS = Candidate(loss="0.21", resistance="natural")  # of ``TcaSpec``


def candidates() -> list[Candidate]:
    """What the table shows: the two in use, and each with one reading changed."""
    shown = [IN_USE, DEFAULTS]
    for start in shown[:2]:
        shown.append(start._replace(weighed=False))
        shown += [start._replace(loss=loss) for loss in LOSSES]
        shown += [start._replace(resistance=reading) for reading in READINGS]
        shown.append(start._replace(slope="6 %"))
    return list(dict.fromkeys(shown))


def bounds(hot: float) -> dict[str, float]:
    """What air takes from type 2-180 per length of thread at a temperature [W/(m K)].

    Natural convection and radiation from the coil's outer cylinder alone, and from a single thread
    that no neighbour shields, lie below and above what a coil in still air can lose; and the single
    thread in a draught of 0.4 m/s.
    """
    thick, coil = 0.34e-3, 1.08e-3  # Sun, Table 2.1 [m]
    share = CATALOGUE["type-2-180"].rest_length / THREAD
    glow = radiation(hot, 25.0)
    return {
        "outer cylinder": math.pi * coil * share * (still_air(coil, hot, 25.0) + glow),
        "single thread": math.pi * thick * (still_air(thick, hot, 25.0) + glow),
        "in a draught": math.pi * thick * (moving_air(thick, 0.4, hot, 25.0) + glow),
    }


def table() -> str:
    """The table of the candidates, as Markdown, and what it says."""
    rows = [["*published*", "32", "around 80", "1 to 2", "undamaged", "60", "undamaged",
             "up to 0.2", "", "undamaged", "undamaged", "6.6", "of 8"]]  # fmt: skip
    for one in candidates():
        row = heated(one)
        star = r"\*\* " if one == IN_USE else r"\* " if one == DEFAULTS else ""
        rows.append([
            f"{star}{one.words}", f"{row.mass:.0f}", f"{row.current:.0f}", f"{row.warming:.1f}",
            _hot(row.race), _hot(row.largest), _hot(*row.volts), f"{row.acceleration:.2f}",
            f"{row.hold:.1f}", _hot(*row.pulses), _hot(*row.soft), f"{row.finger:.1f}",
            f"{sum(row.held)}",
        ])  # fmt: skip
    heads = ["mass, loss, resistance, slope", "mass [mg]", "0.8 V [mA]", "warms [K]",
             "1 A, 2 s [°C]", "moves [mm]", "5, 6 V [°C]", "12 V [m/s²]", "holds 40 mm [W]",
             "1.5, 2.5 A bare [°C]", "in silicone [°C]", "finger [ohm]", "held"]  # fmt: skip
    cold, hot = ([1e3 * taken for taken in bounds(at).values()] for at in (27.0, 160.0))
    default, in_use = (1e3 * LOSSES[one.loss] for one in (DEFAULTS, IN_USE))
    air = words("heat-air", cold=cold, hot=hot, default=default, in_use=in_use)
    return pages.page(words("heat-choices"), pages.table(heads, rows), air, words("heat-result"))


def _hot(*values: float | None) -> str:
    return ", ".join("-" if value is None else f"{value:.0f}" for value in values)


def findings() -> list[Finding]:
    """Masses, current, warming, resistances, pulses."""
    found, default = heated(IN_USE), heated(DEFAULTS)
    solid = 1e6 * 1300.0 * math.pi * 0.17e-3**2
    hottest = max(math.inf if value is None else value
                  for value in (*default.pulses, *default.soft))  # fmt: skip
    return [
        finding("thread-mass", 1e6 * 4 * 23.5e-6 * THREAD),
        finding("twisted-mass", 1e6 * _COIL.fibre.line_density, low=0.9 * solid, high=1.1 * solid),
        finding("cold-current", found.current, default=default),
        finding("warming", found.warming, low=WARMED[0], high=WARMED[1], default=default),
        finding("contraction-resistance", 100.0 * _COIL.contraction_resistance * 0.357),
        finding("acceleration", found.acceleration, found.acceleration <= ACCELERATION),
        finding("pulses", hottest, high=_COIL.fibre.melting_temperature, soft=_hot(*default.soft)),
        finding("finger-resistance", default.finger, low=0.9 * FINGER, high=1.1 * FINGER,
                found=found),
    ]  # fmt: skip

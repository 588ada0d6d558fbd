"""A TCA that senses itself lifts a weight to a goal (Sun, Section 2.3.2).

The loop as reported: a PI controller on the displacement that a cubic reads from the resistance,
a pulsed voltage of 12 V, a current sensor with noise and a modified moving average. Not reported
and thus estimates, or fitted where it says so: what one unit of output is, the period of the loop
and the length of the filter.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, floats
from tca_mj.control import PiSpec, pi_rest, pi_step
from tca_mj.tca import Heating, Load, LoadedTcas, LoadState, TcaSpec, resistance
from tca_mj.tca.sensing.sensor import measured, moving_average, pulse_power
from tca_mj.tca.sensing.wire import fit_displacement, resistance_displacement
from tca_mj.validation.facts import Finding, finding
from tca_mj.validation.sensors import SENSED, WIRE, crept, under
from tca_mj.validation.strokes import DEVIATION, weight

SUPPLY = 12.0  # Sun, Section 2.3.2 [V]
SENSING = 0.8  # voltage when only sensing, Sun, Section 2.3.1 [V]
GOAL = 40.0  # Sun, Section 2.3.2 [mm]
PERIOD = 0.01  # of the loop, an estimate [s]
# Output (K_P times mm) at which the voltage is on all the time: the Arduino Uno of Section 2.3.1
# has pulses of 8 bits, and the 4 kHz of Section 2.3.2 are one of their frequencies (16 MHz/8/510).
FULL = 255.0
# Samples of the moving average: fitted to the overshoot at K_P = 20, and none at 10, under 40 g.
FILTER = 20
_LEAST = 0.02  # share of the time that the voltage is on at least, to sense: an estimate
_LATE = 5.0  # the steady state is the mean of the last seconds [s]
BLOWN = 2.0  # factor of blown air on the heat transfer, an estimate
_RINGING = 0.5  # K_I that is "too large": an estimate
_HOLD = 5.0  # lifting and 2 s of holding, an estimate [s]


class Response(NamedTuple):
    """Lifts, m at a time; arrays of shape (k, m) but for the time.

    Attributes:
        time: Shape (k,) [s].
        displacement: True displacement [mm].
        power: Electrical power [W].
        temperature: Temperature [°C].
    """

    time: Array
    displacement: Array
    power: Array
    temperature: Array

    @property
    def steady(self) -> Array:
        """Mean displacement of the last seconds, shape (m,) [mm]."""
        return self.displacement[self.time > self.time[-1] - _LATE].mean(axis=0)

    @property
    def swings(self) -> NDArray[np.int_]:
        """How often it is off the goal by more than ``DEVIATION`` to the other side, shape (m,)."""
        off = (self.displacement - GOAL).T
        sides = (np.sign(column[np.abs(column) > DEVIATION]) for column in off)
        return np.array([np.count_nonzero(np.diff(side)) for side in sides])

    def rise(self, share: float = 0.8) -> Array:
        """Time at which a share of the goal is reached, shape (m,) [s]."""
        return self.time[np.argmax(self.displacement >= share * GOAL, axis=0)]


def controller(proportional: ArrayLike, integral: ArrayLike) -> PiSpec:
    """The controller: K_P as printed, per mm; K_I as printed, per mm and sample."""
    per_error, per_sample = (floats("gain", gain)[:, None] for gain in (proportional, integral))
    return PiSpec(proportional=per_error, integral=per_sample / PERIOD,
                  lowest=_LEAST * FULL, highest=FULL)  # fmt: skip


def lift(
    grams: float, spec: PiSpec, *, tca: TcaSpec | None = None,
    goal: Callable[[float], float] = lambda time: GOAL,
    air: Callable[[float], float] = lambda time: 1.0, duration: float = 15.0, seed: int = 0,
) -> Response:  # fmt: skip
    """Lifts a weight in m loops at a time.

    Args:
        grams: The weight.
        spec: Controllers, fields of shape (m, 1).
        tca: The TCA; None is the one of Table 2.3, crept under the weight.
        goal: Displacement over time [s] -> [mm].
        air: Factor on the heat transfer over time.
        duration: Length of the run [s].
        seed: Of the sensor's noise.
    """
    tcas, ohms, start = under(crept(grams) if tca is None else tca, grams)
    # The curve of this weight, known before (Section 2.3.2).
    known = np.linspace(0.0, 0.06, 61)
    cubic = fit_displacement(resistance_displacement(WIRE, known[:, None], weight(grams))[:, 0],
                             known)  # fmt: skip
    m = np.shape(spec.proportional)[0]
    rng = np.random.default_rng(seed)
    state, memory = tcas.rest((m,)), pi_rest((m, 1))
    duty = np.full((m, 1), _LEAST)
    still = np.broadcast_to(ohms(state.length, state.temperature), (FILTER, m, 1))
    mean = measured(still, SENSING, rng).mean(axis=0)
    steps = round(duration / PERIOD)
    record = np.empty((3, steps, m))
    for k in range(steps):
        now = ohms(state.length, state.temperature)
        mean = mean + (measured(now, SUPPLY, rng, duty=duty) - mean) / FILTER
        error = goal(k * PERIOD) - 1e3 * cubic.displacement(mean)
        memory, output = pi_step(spec, memory, error, PERIOD)
        duty = output / FULL
        power = pulse_power(SUPPLY, duty, now)
        heating = Heating(value=power, air=air(k * PERIOD))
        state = tcas.step(state, heating, PERIOD, "quasistatic")
        record[:, k] = 1e3 * (start - state.length[:, 0]), power[:, 0], state.temperature[:, 0]
    return Response(PERIOD * np.arange(1.0, steps + 1.0), *record)


INTEGRALS = (0.0, 0.01, 0.015, _RINGING)
PROPORTIONALS = (5.0, 10.0, 20.0)
AIR_AT = 15.0  # when the air is blown, an estimate [s]


@cache
def over_integral() -> Response:
    """20 g, K_P = 10, the K_I of ``INTEGRALS``."""
    return lift(20, controller(np.full(4, 10.0), INTEGRALS))


@cache
def over_proportional() -> Response:
    """40 g, K_I = 0.02, the K_P of ``PROPORTIONALS``."""
    return lift(40, controller(PROPORTIONALS, np.full(3, 0.02)))


@cache
def in_blown_air() -> Response:
    """20 g, K_P = 10, without K_I and with 0.015; air is blown from ``AIR_AT`` on."""
    return lift(20, controller([10.0, 10.0], [0.0, 0.015]), duration=30.0,
                air=lambda time: BLOWN if time >= AIR_AT else 1.0)  # fmt: skip


def hung(grams: float) -> Array:
    """True resistance of a cold TCA at which a weight is hung after 1 s, shape (400,) [ohm]."""
    bare = LoadState(np.array([SENSED.rest_length]), np.zeros(1), np.array([25.0]), np.zeros(1))
    # It bounces: damping an estimate.
    tcas = LoadedTcas([SENSED], Load.weight(1e-3 * grams, 0.05))
    course = tcas.simulate(bare, Heating(), PERIOD, 300)
    length = np.concatenate([np.full(100, SENSED.rest_length), course.length[1:, 0]])
    return resistance(WIRE, length[:, None], 25.0)[:, 0]


def felt(ohms: Array, seed: int = 0) -> Array:
    """What the sensor and the filter make of it, same shape [ohm]."""
    rng = np.random.default_rng(seed)
    read = measured(ohms, SENSING, rng)
    return moving_average(read, FILTER, start=read[:20].mean())


def recognised(ohms: Array) -> int:
    """Weight, 0, 20 or 40 g, from the resistance before and in the last second."""
    fall = float(ohms[50:100].mean() - ohms[-100:].mean())

    def off(grams: float) -> float:
        hangs = LoadedTcas([SENSED], Load.weight(1e-3 * grams)).rest()
        return abs(WIRE.rest_resistance[0] - resistance(WIRE, hangs.length, 25.0)[0] - fall)

    return min((0, 20, 40), key=off)


@cache
def answer(grams: int) -> Response:
    """What it does once it has felt a weight: 20 mm, 2 s, 20 mm more; or 40 mm."""

    def goal(time: float) -> float:
        return 20.0 if grams == 20 and time < _HOLD else 40.0

    return lift(grams, controller([10.0], [0.1]), tca=SENSED, goal=goal, duration=2.0 * _HOLD)


def steps() -> list[Finding]:
    """Step responses."""
    integral, proportional, blown = over_integral(), over_proportional(), in_blown_air()
    error = 100.0 * (1.0 - integral.steady / GOAL)
    rise, swings = proportional.rise(), integral.swings
    over = 100.0 * (proportional.displacement.max(axis=0) / GOAL - 1.0)
    before = blown.displacement[blown.time <= AIR_AT][-1]
    lowest = blown.displacement[blown.time > AIR_AT].min(axis=0)
    end = blown.displacement[-100:].mean(axis=0)
    back = 100.0 * (end - lowest) / (before - lowest)
    calm, windy = (blown.power[which][-100:, 1].mean() for which in (blown.time <= AIR_AT, ...))
    return [
        finding("steady-error", error[2], bool(np.all(np.diff(error[:3]) < 0.0)), error=error),
        finding("ringing", float(swings[3]), bool(swings[3] >= 3 > swings[2]), swings=swings,
                ringing=_RINGING, deviation=DEVIATION, hottest=integral.temperature[:, 3].max()),
        finding("rise", held=bool(np.all(np.diff(rise) < 0.0)), rise=rise,
                late=100.0 * (1.0 - proportional.steady / GOAL)),
        finding("overshoot", over[2], lower=max(over[1], 0.0), filter=FILTER),
        finding("blown-air", back[1], bool(back[1] > 50.0 and back[1] > back[0]), back=back,
                loses=before[1] - lowest[1], calm=calm, windy=windy),
    ]  # fmt: skip


def demonstration(runs: int = 20) -> list[Finding]:
    """Feels 20 or 40 g and lifts it accordingly."""
    twice, once = answer(20), answer(40)
    true = {grams: hung(grams) for grams in (20, 40)}
    right = sum(recognised(felt(ohms, seed)) == grams
                for grams, ohms in true.items() for seed in range(runs))  # fmt: skip
    courses = twice.displacement[twice.time < _HOLD], twice.displacement, once.displacement
    reached = [float(course[-200:].mean()) for course in courses]
    near = all(abs(r / aim - 1.0) < 0.05 for r, aim in zip(reached, (20, 40, 40), strict=True))
    return [finding("feels", held=right == 2 * runs, right=right, runs=2 * runs),
            finding("lifts", held=near, reached=reached)]  # fmt: skip

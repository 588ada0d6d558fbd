"""TCAs that drag a weight over a sheet, against dry friction (Sun, Section 2.1.1, Fig. 2.3c).

    m v' = n max(0, F(l, T)) - f sign(v)      at rest while n F <= f

Coulomb's law: friction f does not depend on the speed and holds what it can at rest. What is
printed is the peak of the friction, 0.4 N for one TCA; here the weight slides with the same. Its
mass is not printed: that of the kettle per TCA, 2 kg/5, is taken.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from tca_mj.checks import Array, number, require_positive
from tca_mj.tca import CATALOGUE, CoilRods, TcaSpec, tension
from tca_mj.validation.facts import Finding, finding
from tca_mj.validation.strokes import TYPES

Pull = Callable[[float, float], float]
"""(length [m], temperature [°C]) -> tension of one TCA [N]."""

NAME = "type-2-200"
FRICTION = 0.4  # peak, Sun, Section 2.1.1 [N]
STROKE = 48.0  # over which one TCA drags, there [%]
KETTLE = (2.0, 5, 60.0)  # mass, number of TCAs, way, there [kg, 1, mm]
DATA = 160.0  # upper end of the measurements behind untwist and moduli [°C]
ANNEALED = TYPES[NAME][1]  # above it the coil would lose its shape [°C]
_HEATING = 50.0  # how fast the TCA is heated in the figure, an estimate [K/s]
_STEP = 1e-3  # [s]


class Dragged(NamedTuple):
    """A weight dragged from rest; arrays of shape (k,).

    Attributes:
        time: Time [s].
        temperature: Temperature of the TCAs [°C].
        moved: Way of the weight [m].
        speed: Its speed [m/s].
        force: Pull of all TCAs [N].
        work: What they have done [J].
        rubbed: What friction has taken [J].
    """

    time: Array
    temperature: Array
    moved: Array
    speed: Array
    force: Array
    work: Array
    rubbed: Array


def pull_of(tca: TcaSpec) -> Pull:
    """Tension of a TCA with glued ends, not below 0."""
    coil = CoilRods([tca])
    return lambda length, hot: max(float(coil.tension([length], [hot])[0][0]), 0.0)


def drag(
    pull: Pull, start: float, temperature: Array, *, mass: float, friction: float, count: int = 1,
    dt: float = _STEP,
) -> Dragged:
    """Drags a weight from rest.

    Each step is implicit in the friction: the weight stops in it where friction could hold it,
    and never turns round by friction. The pull is that at the start of the step.

    Args:
        pull: Tension of one TCA.
        start: Length at which it begins [m].
        temperature: At the end of each step, shape (k,) [°C].
        mass: Mass that moves, above 0 [kg].
        friction: Friction, not negative [N].
        count: Number of TCAs in parallel.
        dt: Length of a step, above 0 [s].

    Raises:
        ValueError: If mass or step is not above 0, or friction below 0.
    """
    require_positive(mass=mass, dt=dt)
    number("friction", friction, at_least=0.0)
    moved, speed, work, rubbed = 0.0, 0.0, 0.0, 0.0
    rows = []
    for hot in temperature:
        force = count * pull(start - moved, float(hot))
        driven = speed + force / mass * dt
        left = max(abs(driven) - friction / mass * dt, 0.0)
        before, speed = speed, float(np.copysign(left, driven))
        way = 0.5 * (before + speed) * dt
        moved += way
        work += force * way
        # What held the weight at the end of a step may be less than the friction.
        rubbed += (force - mass * (speed - before) / dt) * way
        rows.append((moved, speed, force, work, rubbed))
    columns = np.array(rows, dtype=np.float64).T
    time = dt * np.arange(1.0, len(temperature) + 1.0, dtype=np.float64)
    return Dragged(time, temperature, *columns)


def heated(to: float, rate: float = _HEATING, rest: float = 1.5) -> Array:
    """Temperatures of a steady heating from 25 °C at a rate [K/s], and a rest at its end."""
    ramp = np.arange(25.0, to, rate * _STEP)
    return np.concatenate([ramp, np.full(round(rest / _STEP), to)])


def study(to: float, count: int = 1, rate: float = _HEATING) -> Dragged:
    """One TCA, or ``count`` with as much weight and friction each."""
    tca = CATALOGUE[NAME]
    mass = KETTLE[0] / KETTLE[1]
    return drag(pull_of(tca), tca.rest_length, heated(to, rate), mass=count * mass,
                friction=count * FRICTION, count=count)  # fmt: skip


def findings() -> list[Finding]:
    """The pull, the way of one, and the kettle."""
    tca = CATALOGUE[NAME]

    def holds(length: float, hot: float) -> float:
        return float(tension(tca, length, hot, spin="locked")[0])

    blocked = holds(tca.rest_length, DATA)
    # Heated at once it swings past the balance, and the mass does not matter: the furthest of all.
    share, slow = (100.0 * float(study(ANNEALED, rate=rate).moved[-1]) / tca.rest_length
                   for rate in (1e4, 5.0))  # fmt: skip
    touching = (1.0 - 0.01 * STROKE) * tca.rest_length + 0.5e-3
    slides = holds(touching, ANNEALED)
    ends = brentq(lambda hot: holds(touching, hot) - FRICTION, ANNEALED, 259.0, xtol=0.1)
    mass, count, way = KETTLE
    five = count * holds(tca.rest_length - 1e-3 * way, ANNEALED)
    return [
        finding("pull", blocked, name=NAME, low=FRICTION),
        finding("drag", share, name=NAME, low=STROKE - 1.5, high=STROKE + 1.5, annealed=ANNEALED,
                slow=slow, slides=slides, ends=ends),
        finding("kettle", mass=mass, all=count * blocked, five=five, annealed=ANNEALED,
                coefficient=five / mass / 9.81),
    ]  # fmt: skip

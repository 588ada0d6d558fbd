"""Coils that can be wound, and what each of them does under a load: all of a generation at once.

A coil of thread of known data is wound on a mandrel and annealed (``TcaSpec.from_mandrel``). Under
the load F it is as long as its tension says at each temperature; the stroke is wanted at one length
and is reached at the temperature T_1 at which the coil pulls with F there. From the surroundings'
T_0 at a constant voltage U, C dT/dt = P(T) - λ (T - T_0) with P = U^2/R(l(T)), at most I^2 R. With
the power at the end, the excess Δ = P(T_1)/λ would be reached in the long run, and over
y = -ln(1 - (T - T_0)/Δ) time and energy are integrals of smooth functions, which Gauss's rule
takes; an exponential, where R is constant, exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, door
from tca_mj.quadrature import GaussRule
from tca_mj.tca.arrays import column
from tca_mj.tca.design.wish import Space, Wish
from tca_mj.tca.laws.creep import CreepBank
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.laws.roots import bracketed
from tca_mj.tca.sensing.wire import WireTable, resistance
from tca_mj.tca.spec import Plies, TcaSpec, heat_of

_RULE = GaussRule.of(8)
_GIVEN_BACK = 0.9  # of the stroke, in the return time
RARELY = 1e3  # what is infinite counts as so many times its limit
_LEAST_GAP = 1.02  # of the groove's sine over that of touching coils: with less it is no free coil
_LIMITED = ("time", "return_time", "current", "length", "diameter")
_HALVINGS = 45  # of the range of temperatures, to 1e-11 K


@dataclass(frozen=True, kw_only=True, slots=True)
class Winding:
    """How a TCA is wound.

    Attributes:
        thread: Name of the thread.
        core_diameter: Of the mandrel's core [m].
        groove_pitch_angle: On the mandrel [rad].
        fibre_length: Of twisted fibre in a strand [m].
        strands: Side by side.
    """

    thread: str
    core_diameter: float
    groove_pitch_angle: float
    fibre_length: float
    strands: int


class Figures(NamedTuple):
    """What TCAs do under the load, each of shape (n,).

    Attributes:
        temperature: At which the stroke is reached; infinite if it never is [°C].
        time: Until it is, from cold, at the full voltage; infinite if that cannot [s].
        return_time: From there, cooling, until nine tenths of the stroke are given back [s].
        energy: Electrical, until the stroke is reached [J].
        power: Largest on the way [W].
        current: Largest on the way [A].
        length: Cold, under the load [m].
        rest_length: Cold, without load [m].
        diameter: Outer diameter [m].
        mass: Of the fibre [kg].
        spring_index: Radius of the coil over that of the fibre [1].
        stress_share: Shear stress over that at which the thread broke; 0 if that is unknown [1].
        torsion: Of the fibre by the load [rad/m].
    """

    temperature: Array
    time: Array
    return_time: Array
    energy: Array
    power: Array
    current: Array
    length: Array
    rest_length: Array
    diameter: Array
    mass: Array
    spring_index: Array
    stress_share: Array
    torsion: Array


# What designs may break, and in which words a message says so.
BOUNDS = {
    "carried": "the load stretches the coil too far", "stroke": "the stroke is not reached",
    **{name: name for name in (*_LIMITED, "spring_index", "stress_share")},
    "gap": "the coils touch on the mandrel",
}  # fmt: skip


@door
def designed(thread: TcaSpec, winding: Winding, annealing_temperature: float) -> TcaSpec:
    """The TCA that a winding gives, of a thread that is known by another TCA.

    Fibre and heat loss are those of the thread; resistance per length of fibre, how it follows the
    length, and how much further than close packing apart the coils touch are taken to be the same.
    The breaking force is that of equal shear stress, so that thinner coils bear more; it falls with
    one over the coil's radius. The natural length is predicted (``from_mandrel``), and to be
    measured once the TCA is there.

    Args:
        thread: The TCA by which the thread is known.
        winding: How the new one is wound.
        annealing_temperature: Of the oven [°C].

    Raises:
        ValueError: As ``TcaSpec.from_mandrel``, also if the coils would touch on the mandrel.
    """
    fibre = thread.fibre
    coil = TcaSpec.from_mandrel(
        fibre=fibre, fibre_length=winding.fibre_length, core_diameter=winding.core_diameter,
        groove_pitch_angle=winding.groove_pitch_angle, annealing_temperature=annealing_temperature,
        minimum_pitch_angle=math.asin(_touching(thread, winding.core_diameter)),
        resistance_per_length=1.0, heat_loss=thread.heat_loss,
    )  # fmt: skip
    sine = math.sin(coil.pitch_angle)
    own = thread.resistance_per_length * thread.rest_length / thread.fibre_length
    straight = 1.0 / sine - 1.0  # strain of the straight fibre
    force = thread.breaking_force
    return replace(
        coil,
        resistance_per_length=own / sine, ambient=thread.ambient,
        # A flat coil has far to go until it is straight: half of its resistance is left there.
        stretch_resistance=min(thread.stretch_resistance, 0.5 / straight),
        contraction_resistance=thread.contraction_resistance,
        breaking_force=None if force is None else force * _lever(thread) / _lever(coil),
        contact_ratio=thread.contact_ratio, contact_smoothing=thread.contact_smoothing,
        plies=None if winding.strands == 1 else Plies(strands=winding.strands),
    )  # fmt: skip


def _touching(thread: TcaSpec, core: float) -> float:
    """Sine of the pitch at which coils of a thread touch on a core: of the turns' distance."""
    radius = 0.5 * core + thread.fibre.radius
    return math.sin(thread.minimum_pitch_angle) * thread.coil_radius / radius


def _lever(coil: TcaSpec) -> float:
    """Torsional moment in the fibre over the tension of the coil at rest [m]."""
    return coil.coil_radius * math.cos(coil.pitch_angle)


def tightest(thread: TcaSpec, core_diameter: float) -> float:
    """Least pitch angle of a groove in which a thread is wound to a coil that is free [rad]."""
    return math.asin(min(1.0, _LEAST_GAP * _touching(thread, core_diameter)))


def judged(
    wish: Wish, space: Space, coils: Sequence[TcaSpec], short: ArrayLike = 0.0
) -> tuple[Figures, Array]:
    """What n TCAs do, and by how much they break each of ``BOUNDS``.

    Args:
        wish: The lift.
        space: What they may be wound of.
        coils: The TCAs, bare, their strands side by side.
        short: By how much the groove of each is less than the tightest, shape (n,) or 0 [rad].

    Returns:
        Their figures, and an array of shape (bounds, n), each over its limit, 0 where it is kept.
    """
    lift = _Lift(wish, coils)
    found = lift.figures()
    low, high = space.spring_index
    over = {
        "carried": 1.0 - lift.most / lift.load,
        "stroke": np.maximum(1.0 - lift.pulled / lift.load, lift.minimum / lift.goal - 1.0),
        **{name: _over(getattr(found, name), getattr(wish, name)) for name in _LIMITED},
        "spring_index": np.maximum(low - found.spring_index, found.spring_index - high),
        "stress_share": found.stress_share / space.stress_share - 1.0,
        "gap": np.broadcast_to(short, len(coils)),
    }  # fmt: skip
    broken = np.array([over[name] for name in BOUNDS])
    return found, np.clip(broken, 0.0, RARELY)


def _over(values: Array, limit: float) -> Array:
    """By how much values are over a limit, over that."""
    return np.zeros_like(values) if limit == math.inf else values / limit - 1.0


class _Lift:
    """TCAs that carry a load, and what heats them.

    Attributes:
        load: Of each strand [N].
        most: What a strand pulls with when it is stretched to its longest, cold [N].
        cold: Length, cold, under the load [m].
        goal: Length when the stroke is reached [m].
        pulled: What a strand pulls with there when it is hottest [N].
        minimum: Length at which the coils touch [m].
    """

    def __init__(self, wish: Wish, coils: Sequence[TcaSpec]) -> None:
        self._wish, self._coils = wish, coils
        self._heat, self._wires = heat_of(coils), WireTable.of(coils)
        self._ambient = np.broadcast_to(self._heat.ambient, len(coils)).astype(np.float64)
        self._hottest = np.array([
            min(wish.temperature, coil.fibre.temperature_range[1]) for coil in coils
        ])  # fmt: skip
        self.load = wish.load / column(coils, "strands")
        strands = [coil.strand for coil in coils]
        self._rods = CoilRods(strands)
        if wish.creep is not None:
            bank = CreepBank(strands, wish.creep)
            self._rods = bank.law(self._rods, bank.settled(self.load))
        self.minimum = column(coils, "minimum_length")
        self.most, _ = self._rods.tension(self._rods.longest, self._ambient)
        self.cold = self._hanging(self._ambient)
        self.goal = np.maximum(self.cold - wish.stroke, self._rods.shortest)
        self.pulled, _ = self._rods.tension(self.goal, self._hottest)

    def _hanging(self, temperature: Array) -> Array:
        """Length under the load, or the longest there is, (..., n) [m]."""
        low = self._rods.shortest
        span = self._rods.longest - low

        def excess(share: Array) -> tuple[Array, Array]:
            force, slope = self._rods.tension(low + share * span, temperature)
            return force - self.load, slope * span

        start = np.broadcast_to((self._wires.rest_length - low) / span, temperature.shape)
        return low + span * bracketed(excess, start, 0.0, 1.0)

    def _pulling(self, length: Array) -> Array:
        """Temperature at which the strands pull with the load at a length [°C]."""
        low, high = self._ambient, self._hottest
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            weak = self._rods.tension(length, middle)[0] < self.load
            low, high = np.where(weak, middle, low), np.where(weak, high, middle)
        return high

    def _power(self, temperature: Array) -> tuple[Array, Array]:
        """Power [W] and current [A] of the supply at temperatures, (..., n)."""
        ohms = resistance(self._wires, self._hanging(temperature), temperature)
        current = np.minimum(self._wish.voltage / ohms, self._wish.current)
        return current * current * ohms, current

    def figures(self) -> Figures:
        """What they do."""
        coils, heat, ambient = self._coils, self._heat, self._ambient
        reached = (self.pulled >= self.load) & (self.goal >= self.minimum) & (self.most > self.load)
        hot = np.where(reached, self._pulling(self.goal), self._hottest)
        part = np.maximum(self.cold - (1.0 - _GIVEN_BACK) * self._wish.stroke, self._rods.shortest)
        back = np.where(reached, self._pulling(part), self._hottest)

        rise, (last, _) = hot - ambient, self._power(hot)
        limit = last / heat.loss
        warm = reached & (limit > rise)
        end = -np.log1p(-np.where(warm, rise / limit, 0.5))
        y = _RULE.node[:, None] * end
        slope = limit * np.exp(-y)
        power, current = self._power(ambient + np.minimum(limit - slope, rise))
        net = power - heat.loss * (limit - slope)
        pace = _RULE.weight[:, None] * end * heat.capacity * slope / net
        warm = warm & (net > 0.0).all(axis=0)
        first, start = self._power(ambient)
        never = np.where(reached, 0.0, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            cooling = np.asarray(heat.time_constant) * np.log(rise / (back - ambient))
        return Figures(
            temperature=hot + never, time=np.where(warm, pace.sum(axis=0), np.inf),
            return_time=cooling + never,
            energy=np.where(warm, (pace * power).sum(axis=0), np.inf),
            power=np.maximum(first, power.max(axis=0)),
            current=np.maximum(start, current.max(axis=0)), length=self.cold,
            rest_length=column(coils, "rest_length"), diameter=2.0 * column(coils, "outer_radius"),
            mass=column(coils, "mass"),
            spring_index=column(coils, "coil_radius") / [coil.fibre.radius for coil in coils],
            stress_share=self._wish.load / column(coils, "breaking_tension"),
            torsion=self.load * self._rods.torsion_per_tension(hot),
        )  # fmt: skip

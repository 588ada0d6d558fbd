"""Motion of TCAs that lift weights or pull on springs, heated by power, voltage or current.

Along the axis of a TCA of length l, with a mass m at its end, a damper b and a load,

    m l'' + b l' = load(l) - max(0, F(l, T))        load(l) = force + stiffness (reference - l)

For a hanging weight force = m g. This is Sun, dissertation, Colorado State University, eqs.
(3.18) and (3.31), with the weight in it and with the tension F as what restores: as printed the
weight accelerates without bound. The TCA's own mass, less than a thousandth of the weight's,
is left out as it is there. F comes from any law F(l, T); heat is that of ``thermal``.

A step is of second order and does not need to be short. Heat: exact for the power at the middle of
the step, which is found first (resistance changes slowly with the length). Motion: the
implicit midpoint rule at the temperature there, one equation per TCA that rises with the length, so
that it has one solution at any step. The rule neither damps nor feeds an oscillation. A step much
longer than its period (0.2 s at 30 g) leaves it undamped, where ``"quasistatic"`` motion
is the better choice: every length is the equilibrium of its temperature. Under 30 and 50 g, from
rest at a constant voltage of 5 or 6 V, the two differ by less than 0.1 mm until the turns touch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple
from functools import partial
from typing import Annotated, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import (
    Array,
    Positive,
    door,
    instance,
    require_one_of,
    require_positive,
    whole,
    within,
)
from tca_mj.tca.arrays import column, stacked
from tca_mj.tca.dynamics.loads import Course, Heating, Load, LoadState
from tca_mj.tca.laws.plies import law_of
from tca_mj.tca.laws.rod import CoilRods, require_domain
from tca_mj.tca.sensing import wire
from tca_mj.tca.spec import TcaSpec, heat_of
from tca_mj.tca.thermal import require_bare

LengthLaw = Callable[[Array, Array], tuple[Array, Array]]
"""(length, temperature), each (..., n) -> (tension, not clipped, and its slope over length)."""
ResistanceLaw = Callable[[Array, Array], Array]
"""(length, temperature), each (..., n) -> resistance [ohm]."""
Motion = Literal["dynamic", "quasistatic"]
Steps = Annotated[int, partial(whole, at_least=0, at_most=500_000)]
"""Steps of one course. Each costs some 0.1 ms, and its state is kept."""

# A correction of Newton's method at which the next one is not made: it would be below 1e-8 m
# even where the turns start to touch at steps of 0.05 s, and below 1e-11 m at 1 ms.
_ACCEPTED = 1e-6
_STEPS = 8
_CLOSED = 1e-13  # width of a bracket that ends the bracketed search [m]
_BRACKETED_STEPS = 200
_LEFT = 1e-6  # force that it may leave: more is a jump in the law [N]


class MotionSolveError(ArithmeticError):
    """No length was found at which load, tension and inertia balance.

    Attributes:
        residual: Largest force left [N].
    """

    def __init__(self, residual: float) -> None:
        super().__init__(f"motion not solved: a force of {residual} N is left")
        self.residual = residual


class LoadedTcas:
    """n TCAs, each with its load. Holds constants only: the state goes in and comes out.

        tcas = LoadedTcas([CATALOGUE["free-stroke"]], Load.weight(0.03))
        course = tcas.simulate(tcas.rest(), Heating(value=1.5), dt=1e-3, steps=2000)

    A batch (m, n) gives, bit for bit, what m runs with (n,) give, if the law and
    ``resistance`` do.

    Attributes:
        specs: The n specs.
        n: Number of TCAs.
        load: What hangs at them.
        heat: Thermal constants in still air, fields of shape (n,).
        shortest: Shortest length that the law is asked for, shape (n,) [m].
        longest: Longest one, shape (n,) [m].
    """

    @door
    def __init__(
        self,
        specs: Sequence[TcaSpec],
        load: Load,
        *,
        law: LengthLaw | None = None,
        resistance: ResistanceLaw | None = None,
    ) -> None:
        """Gathers the constants.

        Args:
            specs: The TCAs, at least one.
            load: Their loads, fields of shape (n,), or (m, n) for a batch of m.
            law: Tension law of the n TCAs, rising with the length from half of the minimum
                length to 98 % of the fibre's; None is rod theory with locked ends. A table,
                ``CoilSurfaces(specs).tension``, takes a third of the time.
            resistance: Their resistances; None is the one of the specs.

        Raises:
            ValueError: If ``specs`` is empty or a TCA lies in a body.
        """
        self.specs = tuple(specs)
        self.load = load
        rods = law_of(self.specs, CoilRods)
        self.n = len(self.specs)
        self.shortest, self.longest = rods.shortest, rods.longest
        self._law: LengthLaw = rods.tension if law is None else law
        self._resistance = resistance or partial(wire.resistance, wire.WireTable.of(self.specs))
        self._rest_length = column(self.specs, "rest_length")
        self.heat = heat_of(self.specs)
        require_bare(self.heat)

    @door
    def rest(self, batch_shape: tuple[int, ...] = ()) -> LoadState:
        """Equilibrium at ambient temperature, shape batch_shape + (n,); errors: ``equilibrium``."""
        shape = np.broadcast_shapes((*batch_shape, self.n), np.shape(self.load.force))
        temperature = np.broadcast_to(self.heat.ambient, shape).copy()
        length = self.equilibrium(temperature)
        return LoadState(length, np.zeros_like(length), temperature, np.zeros_like(length))

    @door
    def equilibrium(self, temperature: ArrayLike, guess: ArrayLike | None = None) -> Array:
        """Length at which tension and load balance, the static solution.

        Args:
            temperature: Temperature, shape (..., n) [°C].
            guess: A length nearby, same shape; None if there is none [m].

        Returns:
            Length, shape (..., n) [m].

        Raises:
            ValueError: If no length between ``shortest`` and ``longest`` carries the load.
            MotionSolveError: If it is not found, as for a law that does not rise.
        """
        temperature = self._sized("temperature", temperature)
        start = self._sized("guess", self._rest_length if guess is None else guess)
        load = self.load
        goal = load.force + load.stiffness * load.reference
        shape = np.broadcast_shapes(temperature.shape, np.shape(goal))
        temperature = np.broadcast_to(temperature, shape)
        length = np.broadcast_to(start, shape)
        length = self._balance(length, temperature, 0.0, goal, 1e-9, slack=False)
        self.check_domain(length)
        return length

    def _sized(self, name: str, values: ArrayLike) -> Array:
        """Finite numbers, shape (..., n)."""
        array = within(name, values)
        if array.shape[-1:] != (self.n,):
            raise ValueError(f"{name} must have shape (..., {self.n}), got {array.shape}")
        return array

    @door
    def tension(self, state: LoadState) -> Array:
        """Tension that the load feels, not below 0, shape (..., n) [N]."""
        return np.maximum(self._law(state.length, state.temperature)[0], 0.0)

    @door
    def resistance(self, state: LoadState) -> Array:
        """Resistance, shape (..., n) [ohm]."""
        return self._resistance(state.length, state.temperature)

    def step(
        self, state: LoadState, heating: Heating, dt: float, motion: Motion = "dynamic"
    ) -> LoadState:
        """Advances by one step of second order at constant ``heating``.

        Args:
            state: State at the start, shape (..., n).
            heating: Held during the step.
            dt: Length of the step, above 0 [s].
            motion: "dynamic", or "quasistatic" without inertia and damping.

        Returns:
            State at the end.

        Raises:
            ValueError: If ``dt`` or ``motion`` is wrong, a dynamic load has no mass, a length
                leaves ``shortest`` to ``longest``, or the law refuses the temperature.
            MotionSolveError: As ``equilibrium``.
        """
        require_positive(dt=dt)
        instance("state", state, LoadState)
        instance("heating", heating, Heating)
        require_one_of("motion", motion, get_args(Motion))
        if motion == "quasistatic":
            return self._creep_along(state, heating, dt)
        load, half = self.load, 0.5 * dt
        mass = within("mass in dynamic motion", load.mass, above=0.0, unit="kg")
        guess = state.length + half * state.velocity
        power, middle, temperature = self.heated(state, heating, dt, guess)
        # With v and l at the middle of the step the rule is one equation in l,
        # inert (l - l0) - m v0/half + F(l) = load(l).
        per_half = mass / half
        inert = (per_half + load.damping) / half
        goal = load.force + load.stiffness * load.reference
        goal = goal + inert * state.length + per_half * state.velocity
        length = self._balance(guess, middle, inert, goal, _ACCEPTED, slack=True)
        velocity = (length - state.length) / half
        end = 2.0 * length - state.length
        self.check_domain(end)
        return LoadState(end, 2.0 * velocity - state.velocity, temperature, power)

    @door
    def simulate(
        self,
        state: LoadState,
        heating: Heating | Callable[[float], Heating],
        dt: Positive,
        steps: Steps,
        motion: Motion = "dynamic",
    ) -> Course:
        """Runs ``steps`` steps; arguments and errors as ``step``.

        Args:
            state: State at time 0.
            heating: Held throughout, or a function of the time at the start of a step [s].
            dt: Length of a step [s].
            steps: Number of steps, 0 to 500 000: all states are kept.
            motion: As in ``step``.

        Returns:
            ``steps + 1`` states.
        """
        states = [state]
        for i in range(steps):
            held = heating(i * dt) if callable(heating) else heating
            state = self.step(state, held, dt, motion)
            states.append(state)
        first, last = astuple(states[0]), states[-1].length
        states[0] = LoadState(*[np.broadcast_arrays(array, last)[0] for array in first])
        return Course.of(stacked(states), dt)

    def _creep_along(self, state: LoadState, heating: Heating, dt: float) -> LoadState:
        """A quasi-static step: the power is that at the equilibrium in its middle."""
        guess = state.length
        if heating.source != "power":
            _, middle, _ = self.heated(state, heating, dt, guess)
            guess = self.equilibrium(middle, guess)
        power, _, temperature = self.heated(state, heating, dt, guess)
        length = self.equilibrium(temperature, guess)
        return LoadState(length, np.zeros_like(length), temperature, power)

    def heated(
        self, state: LoadState, heating: Heating, dt: float, length: Array
    ) -> tuple[Array, Array, Array]:
        """Power, temperature in the middle and at the end of a step; ``length`` in the middle."""
        heat = self.heat
        loss = heat.loss * heating.air
        half = -np.expm1((-0.5 * dt) * loss / heat.capacity)
        if heating.source == "power":
            power = np.broadcast_to(np.asarray(heating.value, np.float64), state.length.shape)
        else:
            # The resistance at the middle; with the temperature there if it depends on it.
            length = np.minimum(np.maximum(length, self.shortest), self.longest)
            first = heating.power(self._resistance(length, state.temperature))
            settled = heat.ambient + first / loss
            middle = state.temperature + half * (settled - state.temperature)
            power = heating.power(self._resistance(length, middle))
        rise = heat.ambient + power / loss - state.temperature
        middle = state.temperature + half * rise
        return power, middle, state.temperature + (half * (2.0 - half)) * rise

    def pull(self, length: Array, temperature: Array, slack: bool) -> tuple[Array, Array]:
        """Tension and slope; beyond the law's domain, where trial lengths may fall, its tangent."""
        inside = np.minimum(np.maximum(length, self.shortest), self.longest)
        tension, slope = self._law(inside, temperature)
        tension = tension + slope * (length - inside)
        if slack and tension.min() < 0.0:
            taut = tension > 0.0
            return np.where(taut, tension, 0.0), np.where(taut, slope, 0.0)
        return tension, slope

    def _balance(
        self, length: Array, temperature: Array, inert: float | Array, goal: float | Array,
        accepted: float, *, slack: bool,
    ) -> Array:  # fmt: skip
        """Solves (inert + load stiffness) l + F(l) = goal by Newton's method from ``length``."""
        fixed = inert + np.asarray(self.load.stiffness, dtype=np.float64)
        pull = partial(self.pull, temperature=temperature, slack=slack)
        done = np.zeros(np.broadcast_shapes(length.shape, np.shape(goal)), dtype=bool)
        length = np.broadcast_to(length, done.shape)
        for _ in range(_STEPS):
            tension, slope = pull(length)
            correction = (goal - fixed * length - tension) / (fixed + slope)
            length = np.where(done, length, length + correction)
            done = done | (np.abs(correction) <= accepted)
            if done.all():
                return length
        return self._bracketed(length, done, pull, fixed, goal)

    def _bracketed(
        self, length: Array, done: NDArray[np.bool_], pull: Callable[[Array], tuple[Array, Array]],
        fixed: Array, goal: float | Array,
    ) -> Array:  # fmt: skip
        """The same, for the elements that are not ``done``, inside a shrinking bracket."""
        # In dynamics a trial may overshoot the domain by its inertia; it is widened for that.
        span = self.longest - self.shortest
        low = np.broadcast_to(self.shortest - span, done.shape)
        high = np.broadcast_to(self.longest + span, done.shape)
        point = np.where(done, length, np.clip(length, low, high))
        excess: Array = np.zeros(done.shape)
        for _ in range(_BRACKETED_STEPS):
            tension, slope = pull(point)
            excess = fixed * point + tension - goal
            low = np.where(excess < 0.0, point, low)
            high = np.where(excess > 0.0, point, high)
            with np.errstate(divide="ignore", invalid="ignore"):
                newton = point - excess / (fixed + slope)
            inside = (newton > low) & (newton < high)
            new = np.where(inside, newton, 0.5 * (low + high))
            now = done | (high - low <= _CLOSED) | (np.abs(new - point) <= _CLOSED)
            now |= excess == 0.0
            point = np.where(done | (excess == 0.0), point, new)
            done = now
            if done.all():
                # A root beyond the bracket is left to the check of the domain.
                edge = point <= self.shortest - 0.99 * span
                edge |= point >= self.longest + 0.99 * span
                left = np.where(edge, 0.0, np.abs(excess))
                if (left <= _LEFT).all():
                    return point
                break
        raise MotionSolveError(float(np.nan_to_num(np.abs(excess), nan=np.inf).max()))

    def check_domain(self, length: Array) -> None:
        """Raises ValueError, with what may be wrong, if a length [m] is outside the law's."""
        why = ": the load is too large for this TCA, or too small, or moves too fast"
        require_domain(length, self.shortest, self.longest, why)

"""The bending morphing module with one angle: constant curvature, no inertia, no weight.

The simplest thing that softens, bends, hardens and recovers. It answers in microseconds what a
chain of links must agree with, and serves the tests and figures of sequences.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tca_mj.checks import Array, Numbers, door, number
from tca_mj.smp.damage import Damage, DamageSpec, flag_damage, soft_bending_rate
from tca_mj.smp.fixing import SpineState, advance, spring
from tca_mj.smp.heater import HeaterSpec, HeaterState, heat_spine
from tca_mj.smp.material import SpineSpec
from tca_mj.tca import Pull, TcaBank, TcaSpec, TcaState
from tca_mj.tca.embedding import in_silicone

# Outer diameter of the silicone tube round the TCA: an estimate, half the module's 5 mm [m].
TUBE_DIAMETER = 2.5e-3


class ModuleSolveError(ArithmeticError):
    """The balance of the module's torques was not found."""


@door
def in_tube(tca: TcaSpec, touching: float = 0.0) -> TcaSpec:
    """A TCA in its silicone tube.

    Args:
        tca: The kind of TCA.
        touching: Share of its circumference that touches the tube, 0 to 1. Estimate: it lies
            loosely there, as it shrinks into the tube in its training (Sun, Section 6.1.1).

    Raises:
        ValueError: If the TCA is as thick as the tube or more, or the share is none.
    """
    radius = 0.5 * TUBE_DIAMETER
    number("tca.outer_radius", tca.outer_radius, below=radius, unit="m, of the tube")
    section, perimeter = math.pi * (radius**2 - tca.outer_radius**2), 2.0 * math.pi * radius
    return in_silicone(tca, section=section, perimeter=perimeter, touching=touching)


@door
def sheathed(tca: TcaSpec, spine: SpineSpec) -> TcaSpec:
    """A TCA in its tube, U-shaped along the spine and unloaded when the spine is straight.

    Args:
        tca: The kind of TCA; it is cut to twice the spine's length.
        spine: The spine.
    """
    return in_tube(tca).of_length(2.0 * spine.length)


@dataclass(frozen=True, slots=True, eq=False)
class ModuleState:
    """State of one module, each array of shape (1,).

    Attributes:
        heater: Temperature and energy of the spine.
        spine: Shape memory of the spine; its angle is that of the whole length.
        tca: Thermal state of the TCA.
        angle: Bending angle [rad].
        tension: Tension of the TCA, not below 0 [N].
        damage: Flags of the last step.
    """

    heater: HeaterState
    spine: SpineState
    tca: TcaState
    angle: Array
    tension: Array
    damage: Damage


class LumpedModule:
    """A spine and a U-shaped TCA in balance: E I/L (angle - reference) = 2 a F + moment.

    Attributes:
        spine: The spine.
        heater: Its heater.
        bank: The TCA.
        damage: Bounds of the damage rule.
    """

    @door
    def __init__(
        self, spine: SpineSpec, heater: HeaterSpec, tca: TcaSpec, damage: DamageSpec | None = None
    ) -> None:
        """Combines a spine and its TCA.

        Args:
            spine: The spine.
            heater: Its heater.
            tca: The TCA, of about twice the spine's length.
            damage: Bounds of the damage rule, by default those of ``DamageSpec``.
        """
        self.spine = spine
        self.heater = heater
        self.bank = TcaBank([tca])
        self.damage = damage or DamageSpec.of(spine.smp)

    @property
    def fading_time(self) -> float:
        """C_b/(G + λ_b), in which a TCA that is kept hot warms its tube; 0 if it is bare [s]."""
        heat = self.bank.heat
        if not self.bank.embedded[0]:
            return 0.0
        return float(np.squeeze(heat.body_capacity / (heat.conductance + heat.body_loss)))

    @door
    def rest(self, memory: float = 0.0) -> ModuleState:
        """Cold and unloaded, in the memorised shape [rad]."""
        heater = HeaterState.rest(self.heater, (1,))
        flags = np.zeros(1, dtype=bool)
        return ModuleState(
            heater=heater,
            spine=SpineState.rest(self.spine.smp, np.full(1, memory), heater.temperature),
            tca=self.bank.rest(), angle=np.full(1, memory), tension=np.zeros(1),
            damage=Damage(flags, flags, flags),
        )  # fmt: skip

    @door
    def tca_length(self, angle: Numbers) -> Array:
        """Length of the TCA at an angle, both legs on the inner side, shape (1,) [m]."""
        return 2.0 * (self.spine.length - self.spine.tca_offset * angle)

    @door
    def resistance(self, state: ModuleState) -> float:
        """Resistance of the TCA, from which the angle is sensed [ohm]."""
        return float(self.bank.resistance(state.tca, self.tca_length(state.angle))[0])

    @door
    def step(
        self, state: ModuleState, heater_voltage: float, tca_power: float, fan: bool, dt: float,
        moment: float = 0.0,
    ) -> ModuleState:  # fmt: skip
        """Advances by ``dt``: heat exactly, shape fixing at the old angle, then the balance.

        Args:
            state: State at the start.
            heater_voltage: Voltage of the heater wire [V].
            tca_power: Power of the TCA [W].
            fan: Whether the fan cools the spine.
            dt: Length of the step; errors are of first order in it [s].
            moment: Uniform moment from outside, positive in the TCA's direction [N m].

        Raises:
            ValueError: If an input is out of range.
            TcaMelted: If the TCA would be hotter than its fibre melts at.
            ModuleSolveError: If no balance is found.
        """
        heater = heat_spine(self.heater, state.heater, heater_voltage, fan, dt)
        spine = advance(self.spine.smp, state.spine, state.angle, heater.temperature)
        length = self.tca_length(state.angle)
        before = self.bank.pull(state.tca, length)
        tca, after = self.bank.advance(state.tca, np.full(1, tca_power), length, dt)
        angle, pull = self._balance(spine, tca, after, state.angle, moment)
        rise = (after.tension - before.tension) / dt if dt > 0.0 else np.zeros(1)
        tension = np.maximum(pull.tension, 0.0)
        modulus, _ = spring(self.spine.smp, spine)
        cooling = heater.temperature < state.heater.temperature
        rate = soft_bending_rate(self.spine, rise)
        damage = flag_damage(modulus, cooling, np.maximum(after.tension, 0.0), rate, self.damage)
        return ModuleState(heater, spine, tca, angle, tension, damage)

    def _balance(
        self, spine: SpineState, tca: TcaState, pull: Pull, angle: Array, moment: float
    ) -> tuple[Array, Pull]:
        """Newton's method from the old angle; the TCA is slack where it would push."""
        modulus, reference = spring(self.spine.smp, spine)
        stiffness = modulus * self.spine.second_moment / self.spine.length
        lever = 2.0 * self.spine.tca_offset
        for _ in range(50):
            taut = pull.tension > 0.0
            residual = stiffness * (angle - reference) - moment
            residual = residual - lever * np.where(taut, pull.tension, 0.0)
            slope = stiffness + lever * lever * np.where(taut, pull.stiffness, 0.0)
            change = residual / slope
            angle = angle - change
            pull = self.bank.pull(tca, self.tca_length(angle))
            if abs(change[0]) < 1e-12:
                return angle, pull
        raise ModuleSolveError(f"no balance found near {angle[0]:.4g} rad, left {change[0]:.2g}")

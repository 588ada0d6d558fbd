"""Position, force and impedance of TCAs, by what an observer tells of them.

Whatever is wanted of a TCA is a temperature: the one at which a coil of some length pulls with
some tension, F(l, T) = F. A thermostat brings it there, with the temperature of the same observer:

    position     l is wanted, the tension is the one that is estimated, whatever load that is
    force        F is wanted, the length is the estimated one
    impedance    F = F0 + K (l - l0) is wanted at the estimated length

The estimates lie on the law, and so the temperature that is wanted is the estimated one only where
the estimated length is the wanted one: a heat loss that the observer does not know makes both
temperatures wrong alike, and leaves no error of position, as long as the one that is believed is
below the thermostat's limit. Of force it does, as a resistance does not tell heat from load
(``tca.sensing.observer``). An observer that estimates the heat loss, too, tells the thermostat.

Friction that makes the stroke lag (``tca.laws.creep.hysteresis_damping``) acts on the load, not on
the coil: it is part of the estimated tension, and so made up for without being known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, Checked, Numbers, door, within
from tca_mj.tca.bank import TcaBank
from tca_mj.tca.sensing.observer import Estimate, TcaObserver
from tca_mj.tca.supply import Thermostat

_HALVINGS = 20  # of some 150 K


@door
def goal_temperature(bank: TcaBank, length: Numbers, tension: Numbers, hottest: float) -> Array:
    """Temperature at which TCAs of given lengths pull with given tensions.

    That of the surroundings where even a cold one pulls as much, ``hottest`` where no hot one does.
    ``pulling_temperature`` is the same of one TCA, refuses what is out of reach and is exact.

    Args:
        bank: The n TCAs.
        length: Lengths, shape (..., n), brought to where the law holds [m].
        tension: Tensions, a shape that broadcasts with it [N].
        hottest: Highest temperature [°C].

    Returns:
        Temperature, the broadcast shape, to a millionth of the way [°C].

    Raises:
        ValueError: If a number is not finite, or the last axis is not n.
    """
    length, tension = np.broadcast_arrays(length, tension)
    length = np.clip(length, bank.shortest, bank.longest)
    state = bank.rest(length.shape[:-1])
    low = np.broadcast_to(bank.heat.ambient, length.shape)
    high = np.maximum(within("hottest", hottest), low)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        state.temperature[...] = middle
        weak = bank.pull(state, length).tension < tension
        low, high = np.where(weak, middle, low), np.where(weak, high, middle)
    return 0.5 * (low + high)


@dataclass(frozen=True, slots=True, eq=False)
class TcaServo(Checked):
    """What drives TCAs by their estimates. Nothing is remembered: an estimate goes in, a power out.

        servo = TcaServo(observer, Thermostat(heat=bank.heat, max_power=5.0, response=0.1))
        for ...:
            estimate = observer.step(estimate, voltage, current, dt)
            power = servo.position(estimate, length)

    Attributes:
        observer: What estimates them.
        thermostat: What brings them to a temperature, with its limits.
    """

    observer: TcaObserver
    thermostat: Thermostat

    @door
    def position(self, estimate: Estimate, length: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        """Power that brings TCAs to a length, under whatever load they have, shape (..., n) [W].

        Args:
            estimate: What is believed of them.
            length: Wanted length, broadcast with it [m].
            rate: By how much it changes, for courses: it is led by the thermostat's response [m/s].

        Raises:
            ValueError: If a number is not finite.
        """
        ahead = within("rate", rate) * self.thermostat.response
        pull = self.observer.tension(estimate).tension
        return self._held(estimate, within("length", length) + ahead, pull)

    @door
    def force(self, estimate: Estimate, tension: ArrayLike) -> Array:
        """Power that brings TCAs to a tension at the length that they have, (..., n) [W].

        Args:
            estimate: What is believed of them.
            tension: Wanted tension, broadcast with it [N].

        Raises:
            ValueError: If a number is not finite.
        """
        return self._held(estimate, estimate.length, within("tension", tension))

    @door
    def impedance(
        self, estimate: Estimate, tension: ArrayLike, stiffness: ArrayLike, length: ArrayLike
    ) -> Array:
        """Power that makes TCAs springs, F = tension + stiffness (l - length), (..., n) [W].

        Args:
            estimate: What is believed of them.
            tension: Tension at ``length`` [N].
            stiffness: Wanted stiffness, harder or softer than the coil's own [N/m].
            length: Length at which they pull with ``tension`` [m].

        Raises:
            ValueError: If a number is not finite.
        """
        off = estimate.length - within("length", length)
        return self.force(
            estimate, within("tension", tension) + within("stiffness", stiffness) * off
        )

    def _held(self, estimate: Estimate, length: Array, tension: Array) -> Array:
        shape = estimate.length.shape
        try:
            length, tension = np.broadcast_to(length, shape), np.broadcast_to(tension, shape)
        except ValueError as error:
            raise ValueError(
                f"length and tension must broadcast with the estimate's {shape}, got"
                f" {np.shape(length)} and {np.shape(tension)}"
            ) from error
        hottest = float(np.max(self.thermostat.max_temperature))
        goal = goal_temperature(self.observer.bank, length, tension, hottest)
        thermostat, loss = self.thermostat, estimate.loss
        if (loss != 1.0).any():  # what keeps a temperature is what the observer says that is lost
            thermostat = replace(thermostat, heat=thermostat.heat.losing(loss))
        return thermostat.power(estimate.temperature, goal, estimate.body)

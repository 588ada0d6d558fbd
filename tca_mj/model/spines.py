"""The shape-memory spines of a running simulation: heat, memory, and what their cells feel."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import LARGEST, Array, flags, some, within
from tca_mj.model.smooth import SmoothBody
from tca_mj.model.spine import RoutedSpine
from tca_mj.model.sums import Total, rows
from tca_mj.smp import DamageSpec, SpineBank, SpinesState
from tca_mj.smp.damage import damaging
from tca_mj.tca.arrays import frozen, row, stacked


class Spines:
    """n spines and the m motions of cells that they stiffen.

    A cell may be shared by several spines, and has a stiffness of its own besides. What stands
    before the axes named below is a batch, as in ``SmoothBody``.

    Attributes:
        n: Number of spines.
        names: Their names, in the order of the heater axis.
        state: Heat and shape memory; None if there are no spines.
        voltage: Voltages of the heaters in the last step, shape (..., n) [V].
        damaged: Whether a TCA has been contracted against a stiff spine since the last reset,
            shape (..., n).
    """

    def __init__(
        self, spines: Sequence[RoutedSpine], body: SmoothBody, tcas: Sequence[str], ambient: float
    ) -> None:
        """Finds the spines' joints among the cells of ``body``, whose springs they change.

        Raises:
            ValueError: If a joint is of no cell that a TCA crosses, or a TCA does not exist.
        """
        self.n = len(spines)
        self.names = tuple(spine.name for spine in spines)
        self.damaged = np.zeros(self.n, dtype=bool)
        self.voltage = self._off = np.zeros(self.n)
        self._still, self._blown = self.damaged, np.ones(self.n, dtype=bool)
        self.state: SpinesState | None = None
        self._sprung: Any = (None, None)  # state for which springs were computed last, and these
        if not self.n:
            return
        unknown = [tca for spine in spines for tca, _ in spine.tcas if tca not in tcas]
        if unknown:
            raise ValueError(f"tcas of a spine must be some of {tuple(tcas)}, got {unknown}")
        specs = [spine.spec for spine in spines]
        pairs = [(i, *joint) for i, spine in enumerate(spines) for joint in spine.joints]
        owner = np.array([i for i, _, _ in pairs], np.int64)
        self._place = body.places([name for _, name, _ in pairs])
        self._share = np.array([share for _, _, share in pairs])
        self._time = np.array([spine.damping_time for spine in spines])[owner]
        heaters = [replace(spine.heater, ambient=ambient) for spine in spines]
        self.bank = SpineBank(specs, heaters, owner)
        # Of each pair of a spine and one of its TCAs: the TCA, how far it turns the soft spine, and
        # a joint of the spine; and the first pair of each spine.
        turned = [(i, *each) for i, spine in enumerate(spines) for each in spine.tcas]
        spine = np.array([i for i, _, _ in turned])
        self._tca = np.array([tcas.index(tca) for _, tca, _ in turned])
        self._rate = np.array([turn for _, _, turn in turned])
        self._joint = np.searchsorted(owner, spine)
        self._pair = np.searchsorted(spine, np.arange(self.n))
        self._damage = DamageSpec.of(self.bank.smp)
        self._slack, self._soft = frozen(self._damage.slack), frozen(self._damage.soft_modulus)
        self._body = body
        stiffness, rest, damping = body.stiffness.copy(), body.rest.copy(), body.damping.copy()
        # What the cells have without spines: stiffness, moment at angle 0, damping. Where nothing
        # is stiff, a stiffness of 1 keeps the rest.
        held = stiffness.ravel() > 0.0
        held[self._place] = True
        self._void = np.where(held, 0.0, 1.0).reshape(stiffness.shape)
        self._own = np.array([stiffness, stiffness * rest + self._void * rest, damping])
        self._rest = rest
        place = rows(0, 1, 2, width=rest.size, columns=self._place)
        self._cells = Total(place, self._own.size)

    @classmethod
    def batch(cls, many: Sequence["Spines"], body: SmoothBody) -> "Spines":
        """Spines built alike as one, with an axis for them before all others.

        Args:
            many: The spines of each simulation.
            body: The batch of their bodies, whose springs are changed.
        """
        every = copy(many[0])
        if every.n:
            every._body = body
            every.bank = copy(every.bank)
            every.bank.heater = stacked([spines.bank.heater for spines in many])
            for name in ("state", "damaged", "voltage"):
                setattr(every, name, stacked([getattr(spines, name) for spines in many]))
        return every

    def give_back(self, i: int, one: "Spines") -> None:
        """Makes ``one`` what the spines ``i`` of this batch are now."""
        if self.n:
            one.state = row(self.state, i)
            one.damaged = self.damaged[i].copy()
            one.voltage = self.voltage[i].copy()
            body, every = one._body, self._body
            body.stiffness, body.rest = every.stiffness[i], every.rest[i]
            body.damping = every.damping[i]

    @property
    def temperature(self) -> Array:
        """Temperature of each spine, shape (n,) [°C]."""
        return np.zeros(0) if self.state is None else self.state.heat.temperature

    @property
    def energy(self) -> Array:
        """Electrical energy put into each heater since the last reset, shape (n,) [J]."""
        return np.zeros(0) if self.state is None else self.state.heat.energy_in

    @property
    def reference(self) -> Array:
        """Angle of each joint at which its spines would pull no more, shape (m,) [rad]."""
        if self.state is not None and self._sprung[0] is not self.state:
            self._sprung = self.state, self.bank.spring(self.state)
        return self._sprung[1].reference

    def reset(self, motion: Array) -> None:
        """Cold, and fixed in the cells' motions, shape (..., 4, cells) [rad]."""
        self.damaged = np.zeros(self.n, dtype=bool)
        self.voltage = np.zeros(self.n)
        if self.n:
            memory = self._rest.reshape(-1)[self._place]
            self.state = self.bank.rest(memory, self._angles(motion))
            self._stiffen(self.state)

    def checked(self, voltage: ArrayLike, fan: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
        """Voltages and fans as arrays of shape (n,).

        Raises:
            ValueError: If one has the wrong shape or is not finite, or there are no spines.
        """
        if type(voltage) is float and type(fan) is bool:
            if voltage == 0.0 and not fan:  # as without any spine
                return self._off, self._still
            if self.n and abs(voltage) <= LARGEST:
                return self._off + voltage, self._blown if fan else self._still
        volts, blown, shape = within("voltage", voltage), flags("fan", fan), (self.n,)
        for name, array in (("voltage", volts), ("fan", blown)):
            if array.shape not in ((), shape):
                raise ValueError(f"{name} must have shape {shape}, got {array.shape}")
            if not self.n and array.any():
                raise ValueError(
                    f"{name} must be 0: there is no shape-memory spine, and TCAs are driven by the"
                    f" command, got {array}"
                )
        return volts + self._off, blown | self._still

    def advance(
        self, voltage: Array, fan: NDArray[np.bool_], motion: Array, dt: float
    ) -> Array:
        """Heats the spines for ``dt`` and sets the springs of their cells.

        Args:
            voltage: Voltages of the heaters, shape (..., n) [V].
            fan: Whether air is blown at them, shape (..., n).
            motion: Present motion of all cells, shape (..., 4, cells) [m, rad].
            dt: Length of the step [s].

        Returns:
            Modulus of the spine at each of its pairs with a TCA, shape (..., pairs) [Pa].
        """
        assert self.state is not None
        self.voltage = voltage
        state = self.state = self.bank.advance(self.state, voltage, fan, self._angles(motion), dt)
        return self._stiffen(state).take(self._joint, axis=-1)

    def resist(self, modulus: Array, tension: Array) -> bool:
        """Whether a taut TCA pulls at a stiff spine, which one that contracts would damage.

        Args:
            modulus: What ``advance`` returns.
            tension: Tensions of all TCAs, on the last axis [N].
        """
        taut = tension > self._slack
        return some(taut) and some((modulus > self._soft) & taut.take(self._tca, axis=-1))

    def judge(self, modulus: Array, tension: Array, tension_rate: Array) -> None:
        """Notes which spines a TCA is damaged by; what is rising at constant length contracts.

        Args:
            modulus: What ``advance`` returns.
            tension: Tensions of all TCAs, on the last axis [N].
            tension_rate: Their change at constant length [N/s].
        """
        harmed = damaging(
            modulus, tension.take(self._tca, axis=-1),
            self._rate * tension_rate.take(self._tca, axis=-1), self._damage,
        )  # fmt: skip
        if some(harmed):
            self.damaged = self.damaged | np.logical_or.reduceat(harmed, self._pair, axis=-1)

    def _stiffen(self, state: SpinesState) -> Array:
        """Sets the springs of the cells; returns the modulus of the spine at each joint [Pa]."""
        self._sprung = state, self.bank.spring(state)
        modulus, reference = self._sprung[1]
        added = self._share * modulus
        found = np.concatenate((added, added * reference, self._time * added), axis=-1)
        found = self._cells.of(found).reshape(*added.shape[:-1], *self._own.shape)
        found += self._own
        body = self._body
        body.stiffness, body.damping = found[..., 0, :, :], found[..., 2, :, :]
        body.rest = found[..., 1, :, :] / (body.stiffness + self._void)
        return modulus

    def _angles(self, motion: Array) -> Array:
        """Angles of the m joints, shape (..., m) [rad]."""
        return motion.reshape(*motion.shape[:-2], -1).take(self._place, axis=-1)

"""The shape-memory spines of a running simulation: heat, memory, and what their cells feel."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, flags, within
from tca_mj.model.curves import summed
from tca_mj.model.smooth import SmoothBody
from tca_mj.model.spine import RoutedSpine
from tca_mj.smp import DamageSpec, SpineBank, SpinesState, flag_damage, soft_bending_rate
from tca_mj.tca.arrays import row, stacked


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
        self.voltage = np.zeros(self.n)
        self.state: SpinesState | None = None
        if not self.n:
            return
        unknown = [spine.tca for spine in spines if spine.tca not in tcas]
        if unknown:
            raise ValueError(f"tca of a spine must be one of {tuple(tcas)}, got {unknown}")
        specs = [spine.spec for spine in spines]
        self._rate = np.array([float(soft_bending_rate(spec, 1.0)) for spec in specs])
        pairs = [(i, *joint) for i, spine in enumerate(spines) for joint in spine.joints]
        owner = np.array([i for i, _, _ in pairs], np.int64)
        self._place = body.places([name for _, name, _ in pairs])
        self._share = np.array([share for _, _, share in pairs])
        self._time = np.array([spine.damping_time for spine in spines])[owner]
        heaters = [replace(spine.heater, ambient=ambient) for spine in spines]
        self.bank = SpineBank(specs, heaters, owner)
        self._tca = np.array([tcas.index(spine.tca) for spine in spines])
        self._damage = DamageSpec.of(self.bank.smp)
        self._body = body
        self._own = body.stiffness.copy(), body.rest.copy(), body.damping.copy()

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

    def reset(self, motion: Array) -> None:
        """Cold, and fixed in the cells' motions, shape (..., 4, cells) [rad]."""
        self.damaged = np.zeros(self.n, dtype=bool)
        self.voltage = np.zeros(self.n)
        if self.n:
            memory = self._own[1].reshape(-1)[self._place]
            self.state = self.bank.rest(memory, self._angles(motion))
            self._stiffen(self.state)

    def checked(self, voltage: ArrayLike, fan: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
        """Voltages and fans as arrays of shape (n,).

        Raises:
            ValueError: If one has the wrong shape or is not finite, or there are no spines.
        """
        volts, blown = within("voltage", voltage), flags("fan", fan)
        for name, array in (("voltage", volts), ("fan", blown)):
            if array.shape not in ((), (self.n,)):
                raise ValueError(f"{name} must have shape ({self.n},), got {array.shape}")
            if not self.n and array.any():
                raise ValueError(
                    f"{name} must be 0: there is no shape-memory spine, and TCAs are driven by the"
                    f" command, got {array}"
                )
        return np.full(self.n, volts), np.full(self.n, blown)

    def advance(
        self, voltage: Array, fan: NDArray[np.bool_], motion: Array, tension: Array,
        tension_rate: Array, dt: float,
    ) -> None:  # fmt: skip
        """Heats the spines for ``dt`` and sets the springs of their cells.

        Args:
            voltage: Voltages of the heaters, shape (..., n) [V].
            fan: Whether air is blown at them, shape (..., n).
            motion: Present motion of all cells, shape (..., 4, cells) [m, rad].
            tension: Tensions of all TCAs, on the last axis [N].
            tension_rate: Their change at constant length [N/s].
            dt: Length of the step [s].
        """
        assert self.state is not None
        self.voltage = np.array(voltage)
        before = self.state.heat.temperature
        self.state = self.bank.advance(self.state, voltage, fan, self._angles(motion), dt)
        now = self.state.heat.temperature
        flags = flag_damage(
            modulus=self.bank.smp.modulus(now), cooling=now < before,
            tension=np.maximum(tension.take(self._tca, axis=-1), 0.0),
            bending_rate=self._rate * tension_rate.take(self._tca, axis=-1), spec=self._damage,
        )  # fmt: skip
        self.damaged = self.damaged | flags.damaged
        self._stiffen(self.state)

    def _stiffen(self, state: SpinesState) -> None:
        modulus, reference = self.bank.spring(state)
        stiffness, rest, damping = self._own
        added = self._share * modulus
        shape = (*added.shape[:-1], *stiffness.shape)

        def cells(values: Array) -> Array:
            return summed(values, self._place, stiffness.size).reshape(shape)

        total = stiffness + cells(added)
        moment = stiffness * rest + cells(added * reference)
        body, own = self._body, np.broadcast_to(rest, shape).copy()
        body.rest = np.divide(moment, total, out=own, where=total > 0.0)
        body.stiffness = total
        body.damping = damping + cells(self._time * added)

    def _angles(self, motion: Array) -> Array:
        """Angles of the m joints, shape (..., m) [rad]."""
        return motion.reshape(*motion.shape[:-2], -1).take(self._place, axis=-1)

"""Several spines advanced together, with all joints that they stiffen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, door, instance, shown, within
from tca_mj.smp.fixing import SpineState, Spring, spring, with_glass
from tca_mj.smp.heater import HeaterSpec, HeaterState, heated
from tca_mj.smp.material import SmpSpec, SpineSpec
from tca_mj.tca.arrays import column
from tca_mj.tca.thermal import BareStep

_KEPT = 16  # of what a step does with some of the fans on, how many are kept at once


@dataclass(frozen=True, slots=True, eq=False)
class SpinesState:
    """State of n spines and of their m joints.

    Attributes:
        heat: Temperatures and energies, arrays of shape (..., n).
        memory: Shape memory of the joints, arrays of shape (..., m).
    """

    heat: HeaterState
    memory: SpineState


class SpineBank:
    """n spines of one material; joint j belongs to the spine ``owner[j]``.

    Attributes:
        smp: The material.
        heater: Heaters, fields of shape (n,).
        owner: Index of each joint's spine, shape (m,).
    """

    @door
    def __init__(
        self, specs: Sequence[SpineSpec], heaters: Sequence[HeaterSpec], owner: ArrayLike
    ) -> None:
        """Combines the spines.

        Args:
            specs: The n spines.
            heaters: Their heaters.
            owner: Index of each joint's spine, shape (m,).

        Raises:
            ValueError: If there is no spine, the numbers differ, the materials differ, or an
                owner does not exist.
        """
        if not len(specs) or len(specs) != len(heaters):
            raise ValueError(
                f"specs and heaters must be as many, at least 1, got {len(specs)}, {len(heaters)}"
            )
        if any(spec.smp != specs[0].smp for spec in specs):
            raise ValueError("specs must all be of one material smp")
        index = within("owner", owner, at_least=0.0, below=len(specs))
        if index.ndim != 1 or (index % 1.0).any():
            raise ValueError(f"owner must be indices, shape (m,), got {shown(owner)}")
        self.owner = index.astype(np.int64)
        self.smp: SmpSpec = specs[0].smp
        names = [field.name for field in fields(HeaterSpec)]
        self.heater = HeaterSpec(**{name: column(heaters, name) for name in names})
        self._heating: tuple[HeaterSpec, dict[tuple[float, bytes], BareStep]] | None = None

    @property
    def n(self) -> int:
        """Number of spines."""
        return len(np.asarray(self.heater.capacity))

    @door
    def rest(self, memory: ArrayLike, shape: ArrayLike | None = None) -> SpinesState:
        """Cold spines without stress.

        Args:
            memory: Memorised angles, shape (..., m) [rad].
            shape: Angles in which they were fixed, the same shape; by default the memorised ones.
                Between the two only the rubber pulls, as after an ideal fixing [rad].

        Raises:
            ValueError: If an angle is not finite, or the shapes differ.
        """
        memory = within("memory", memory)
        if memory.shape[-1:] != self.owner.shape:
            raise ValueError(f"memory must have shape (..., {self.owner.size}), got {memory.shape}")
        heat = HeaterState.rest(self.heater, (*memory.shape[:-1], self.n))
        state = SpineState.rest(self.smp, memory, heat.temperature[..., self.owner])
        if shape is not None:
            # The glass is strained so far that it holds the rubber in the shape.
            shape = within("shape", shape, shape=memory.shape)
            frozen = shape + self.smp.rubbery / state.glass * (shape - memory)
            state = SpineState(state.memory, frozen, state.glass)
        return SpinesState(heat, state)

    def advance(
        self, state: SpinesState, voltage: Array, fan: NDArray[np.bool_], angle: Array, dt: float
    ) -> SpinesState:
        """Heats the spines for ``dt``, then lets glass form or melt at the present angles.

        Args:
            state: State at the start.
            voltage: Voltages of the heaters, shape (..., n) [V].
            fan: Whether air is blown at the spines, shape (..., n).
            angle: Angles of the joints, shape (..., m) [rad].
            dt: Length of the step [s].

        Raises:
            ValueError: If a spine gets a temperature that is not finite. Inputs are not checked.
        """
        heater, of = self.heater, (dt, fan.tobytes())
        if self._heating is None or self._heating[0] is not heater:
            self._heating = heater, {}
        steps = self._heating[1]
        step = steps.get(of)
        if step is None:
            if len(steps) == _KEPT:
                steps.clear()
            step = steps[of] = BareStep.of(heater, heater.losing(fan), dt)
        heat = heated(step, state.heat, voltage * voltage / heater.resistance, dt)
        glass = self.smp.glass(heat.temperature).take(self.owner, axis=-1)
        return SpinesState(heat, with_glass(state.memory, angle, glass))

    def spring(self, state: SpinesState) -> Spring:
        """Modulus [Pa] and reference [rad] of each joint, shape (..., m)."""
        instance("state", state, SpinesState)
        return spring(self.smp, state.memory)

"""Simulations of one built part, stepped together on the threads of ``mujoco.batch``.

Every simulation goes where it goes alone, bit for bit. Between two steps a ``Simulation`` is the
whole truth about itself: it can be read, reset, changed or stepped on its own at will, and its
model may have friction, masses or heat losses of its own. A step takes all states over from the
simulations, advances them, and gives them back.

TCAs, springs and spines are computed for all simulations in one go, by the code that a single
one uses, with an axis of simulations before all others. Only the ordinary course of a step is
computed so. Whatever is out of the ordinary (a length or a temperature for which there is no law,
a state that MuJoCo complains of) makes a simulation go through the step again on its own, from
where it was, so that it breaks off exactly as it would have alone, and touches no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import mujoco
import mujoco.batch
import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Count, door, instance, shown
from tca_mj.couple import Inputs, advance, measure, write
from tca_mj.drive import DIVERGENCE, Drive, SimulationDiverged
from tca_mj.forks import Held, keep_for_ever
from tca_mj.model.smooth import SmoothBody, Strained
from tca_mj.model.spines import Spines
from tca_mj.sim import Simulation
from tca_mj.tca import CoilSolveError, Pull, TcaBank, TcaMelted, TcaState
from tca_mj.tca.arrays import stacked, unstacked

Array = NDArray[np.float64]

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_POSITIONS = int(mujoco.mjtStage.mjSTAGE_POS)
_NOTHING = int(mujoco.mjtStage.mjSTAGE_NONE)


class SimulationBatch(Held):
    """n simulations built alike, stepped together, in the process that has made it.

    Attributes:
        sims: The simulations.
        threads: Threads on which MuJoCo runs; the result does not depend on it.
        physics: MuJoCo's batch, which has a model and a state for each of them.
    """

    @door
    def __init__(self, sims: Sequence[Simulation], *, threads: Count = 1) -> None:
        """Takes simulations of the same part with the same time steps.

        Raises:
            ValueError: If there is none, they differ, one is there twice, or ``threads`` is
                below 1.
        """
        super().__init__()
        self.sims = tuple(sims)
        if not self.sims:
            raise ValueError("sims must hold at least 1 simulation, got none")
        if len({id(sim) for sim in self.sims}) < len(self.sims):
            raise ValueError("sims must be different objects")
        first = self.sims[0]
        other = [i for i, sim in enumerate(self.sims) if not _alike(first, sim)]
        if other:
            raise ValueError(f"sims must be built alike, number {other[0]} is not as the first")
        self.threads = threads
        models = [sim.model for sim in self.sims]
        self.physics = mujoco.batch.Batch(
            first.model, len(self.sims), min(threads, len(self.sims)), persistent=True
        )
        self.physics.set_models(models)
        self._models = models
        self._tendon_length, self._tendon_slope = (
            self.physics.bind(name) for name in ("ten_length", "ten_J")
        )
        self._speeds = self.physics.bind("qvel")
        self._body = SmoothBody.batch([sim.body for sim in self.sims])
        self._parts: list[Any] = []
        self._bank: Any = None

    def step(
        self, drives: Sequence[Drive | None], duration: float
    ) -> list[SimulationDiverged | None]:
        """Advances each simulation by ``duration`` [s] as ``Simulation.step`` does.

        Args:
            drives: What drives each of them; None lets one stand still.
            duration: Time to advance by [s].

        Returns:
            For each, why it broke off, or None.

        Raises:
            ValueError: As ``Simulation.step``; then none of them has moved.
            RuntimeError: In a process that was forked off: the threads are not there.
        """
        if self.elsewhere:
            raise RuntimeError(
                "a batch must be stepped by the process that made it, not by one forked off it,"
                " where its threads are not; make one there"
            )
        if not isinstance(drives, Sequence) or len(drives) != len(self.sims):
            raise ValueError(f"drives must be a list of {len(self.sims)}, got {shown(drives)}")
        for drive in drives:
            instance("a drive", drive, Drive | None)
        updates = self.sims[0].updates(duration)
        moving = [i for i, drive in enumerate(drives) if drive is not None]
        inputs = [
            sim.checked(drive.command, drive.voltage, drive.fan)
            for sim, drive in zip(self.sims, drives, strict=True)
            if drive is not None
        ]
        errors: list[SimulationDiverged | None] = [None] * len(self.sims)
        if not moving:
            return errors
        try:
            strayed = self._run(np.array(moving), inputs, updates)
        except (CoilSolveError, TcaMelted, ValueError, mujoco.batch.SimulationError):
            strayed = moving
        for i in strayed:
            drive = drives[i]
            assert drive is not None
            try:
                self.sims[i].step(
                    drive.command, duration, voltage=drive.voltage, fan=drive.fan
                )
            except SimulationDiverged as error:
                errors[i] = error
        return errors

    def __del__(self) -> None:
        if hasattr(self, "physics") and self.elsewhere:
            keep_for_ever(self.physics)  # it would wait for its threads

    def _bank_of(self, sims: Sequence[Simulation]) -> Any:
        """The TCAs of simulations as one bank; made anew only if a heat or a supply is another."""
        parts = [*(sim.bank.heat for sim in sims), sims[0].bank.supply]
        same = len(parts) == len(self._parts)
        if not (same and all(a is b for a, b in zip(parts, self._parts, strict=True))):
            self._parts, self._bank = parts, copy(sims[0].bank)
            self._bank.heat = stacked(parts[:-1])
        return self._bank

    def _run(self, ids: NDArray[np.int64], inputs: Sequence[Inputs], updates: int) -> Sequence[int]:
        """The ordinary course of ``step`` for the simulations ``ids``.

        Returns:
            Those for which it is not the right one, and which are as they were before.
        """
        sims, batch = [self.sims[i] for i in ids], self.physics
        every = _Every(self._body, self._bank_of(sims), sims, inputs)
        which = None if len(ids) == len(self.sims) else ids
        rows: Any = slice(None) if which is None else ids
        for i, sim in zip(ids, sims, strict=True):
            mujoco.mj_getState(sim.model, sim.data, batch.state[i], _STATE)
            batch.warning[i, :, 0] = sim.data.warning.lastinfo
            batch.warning[i, :, 1] = sim.data.warning.number
        batch.set_models(self._models)
        batch.forward(which, _POSITIONS)
        astray = np.zeros(len(ids), dtype=bool)
        for left in reversed(range(updates)):
            if sims[0].haste is not None:  # what snaps may take steps of its own
                astray |= [sim.snaps(v) for sim, v in zip(sims, self._speeds[rows], strict=True)]
            astray |= every.advance(batch.qpos[rows])
            every.hand_over(
                np.flatnonzero(~astray),
                batch.qpos[rows],
                self._tendon_length[rows],
                self._tendon_slope[rows],
            )
            batch.set_models(self._models)  # which were written to
            batch.step(which, sims[0].substeps, _POSITIONS if left else _NOTHING)
        astray |= (batch.warning[rows][:, list(DIVERGENCE), 1] > 0).any(axis=-1)
        for values in (batch.qpos, self._speeds):
            astray |= ~np.isfinite(values[rows]).all(axis=-1)
        every.locate(batch.qpos[rows])
        for k in np.flatnonzero(~astray):
            batch.get_data(int(ids[k]), sims[k].data)
            every.give_back(int(k))
        return [int(i) for i in ids[astray]]


def _alike(first: Simulation, other: Simulation) -> bool:
    """Whether two simulations were built of the same part, with the same time steps."""
    return (
        first.tca_names == other.tca_names
        and first.spines.names == other.spines.names
        and (first.substeps, first.tca_period) == (other.substeps, other.tca_period)
        and (first.bank.law, first.bank.specs) == (other.bank.law, other.bank.specs)
        and np.array_equal(first.length_offset, other.length_offset)
        and first.bank.supply.like(other.bank.supply)
        and _creep(first) == _creep(other)
        and first.haste == other.haste
    )


def _creep(sim: Simulation) -> Any:
    """Constants by which its TCAs creep; None if they do not."""
    creeping = getattr(sim.bank, "creep", None)
    return creeping and creeping.creep


class _Every:
    """State and constants of some simulations, with an axis for them before all others."""

    def __init__(
        self,
        body: SmoothBody,
        bank: TcaBank,
        sims: Sequence[Simulation],
        inputs: Sequence[Inputs],
    ) -> None:
        first = sims[0]
        self.sims = sims
        self.inputs: Inputs = stacked(inputs)
        self.period, self.steadiness = first.tca_period, first.steadiness
        self.bank = bank
        self.tca: TcaState = stacked([sim.tca for sim in sims])
        self.gain = np.array([[sim.gain] for sim in sims])
        self.offset = np.stack([sim.length_offset for sim in sims])
        self.body = body
        self.body.gather([sim.body for sim in sims])
        self.spines = Spines.batch([sim.spines for sim in sims], self.body)
        self.pull: Pull
        self.power: Array
        self.strained: Strained
        self.now: tuple[list[Array], list[Strained]]
        self.ended: list[Any]

    def advance(self, qpos: Array) -> NDArray[np.bool_]:
        """Heats TCAs and spines for a period; where a length has no law, shape (m,)."""
        self.strained, length, inside = measure(self.body, self.bank, qpos, self.offset)
        motion = self.strained.motion
        astray: NDArray[np.bool_] = np.logical_not(inside.all(axis=-1))
        if astray.any():  # is thrown away, and must not stop the others
            length = np.where(inside, length, self.bank.rest_length)
            motion = np.where(astray[:, None, None], self.body.rest, motion)
        tca, self.pull = advance(
            self.bank, self.spines, self.tca, self.inputs, length=length, motion=motion,
            gain=self.gain, period=self.period,
        )  # fmt: skip
        self.power = (tca.energy_in - self.tca.energy_in) / self.period
        self.tca = tca
        return astray

    def hand_over(
        self, which: NDArray[np.int64], qpos: Array, tendon_length: Array, tendon_slope: Array
    ) -> None:
        """Writes what MuJoCo has to know to the models of the simulations ``which``."""
        writes = write(
            self.body, self.strained, self.pull, qpos=qpos,
            tendon_length=tendon_length.take(self.sims[0].tendon, axis=-1),
            tendon_slope=tendon_slope, steadiness=self.steadiness,
        )  # fmt: skip
        each = unstacked(writes)
        for k in which:
            self.sims[k].take(each[k])

    def locate(self, qpos: Array) -> None:
        """Computes the bodies where they are now, which tasks ask for next."""
        self.now = list(qpos.copy()), unstacked(self.body.at(qpos))
        self.ended = unstacked((self.tca, self.pull, self.strained, self.power.copy()))

    def give_back(self, k: int) -> None:
        """Makes simulation ``k`` what a step of its own would have made of it."""
        sim = self.sims[k]
        sim.tca, sim.pull, sim.strained, sim.power = self.ended[k]
        self.spines.give_back(k, sim.spines)
        qpos, strained = self.now
        sim.body.keep(qpos[k], strained[k])

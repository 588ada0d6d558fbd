"""The coupled step: electrical power, heat and tension of the TCAs, motion of the body.

The TCAs' law F(l, T) is evaluated once per ``tca_period`` and handed to MuJoCo linearised in the
length, F + k (l' - l), as a native actuator that MuJoCo evaluates in every physics step. Holding
the tension constant instead would make a stiff TCA a delayed spring, which oscillates.

The tendons are polylines through sites. Each TCA's length is that of the smooth curve which its
polyline stands for, l + ½ Σ c θ², with the coefficients c of ``RoutedTca.stiffening``; the joints
get the matching springs c F, so that the tension does the work that the length says.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.model.part import Part
from tca_mj.tca import CoilSolveError, Pull, TcaBank, TcaState

# Warnings after which MuJoCo has reset the state by itself.
_DIVERGENCE = {
    int(warning): str(warning).rsplit("_", 1)[-1]
    for warning in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
}


class SimulationDiverged(ArithmeticError):
    """The simulation left the range of finite, physical states."""


class Simulation:
    """A built part with its TCAs, in motion.

    Attributes:
        model: Compiled MuJoCo model.
        data: MuJoCo's state.
        bank: The TCAs.
        tca: Their thermal state.
        pull: Their linearised law at the last update.
        tca_names: Names, in the order of the actuator axis.
        tendon: Ids of their tendons in ``model``, shape (n,).
        tca_period: Time between two updates of the TCAs [s].
    """

    def __init__(
        self, part: Part, *, timestep: float = 2e-3, tca_period: float = 2e-2, ambient: float = 25.0
    ) -> None:
        """Compiles ``part``; its specification can still be changed and compiled again.

        Args:
            part: What to simulate.
            timestep: Physics time step [s].
            tca_period: Time between two updates of the TCAs, a multiple of ``timestep`` [s].
            ambient: Temperature of the surroundings and of the cold TCAs [°C].

        Raises:
            ValueError: If a time is not positive or the period is no multiple of the time step.
        """
        if not (np.isfinite(timestep) and timestep > 0.0):
            raise ValueError(f"timestep must be finite and above 0 s, got {timestep}")
        substeps = round(tca_period / timestep) if np.isfinite(tca_period) else 0
        if substeps < 1 or abs(substeps * timestep - tca_period) > 1e-9:
            raise ValueError(
                f"tca_period must be a positive multiple of timestep {timestep} s, got {tca_period}"
            )
        part.spec.option.timestep = timestep
        self.model: mujoco.MjModel = part.spec.compile()
        self.data = mujoco.MjData(self.model)
        self.tca_period = tca_period
        self.tca_names = tuple(tca.name for tca in part.tcas)
        self.bank = TcaBank(tuple(replace(tca.spec, ambient=ambient) for tca in part.tcas))
        self._substeps = substeps

        model = self.model
        self.tendon = np.array([model.tendon(name).id for name in self.tca_names], dtype=np.int64)
        self._actuator = np.array(
            [model.actuator(name).id for name in self.tca_names], dtype=np.int64
        )

        # Joints whose stiffness depends on the tensions: k = k0 + coupling @ tension.
        self._joint, self._coupling = _matrix(model, [tca.stiffening for tca in part.tcas])
        self._joint_qpos = model.jnt_qposadr[self._joint]
        self._stiffness = model.jnt_stiffness[self._joint].copy()
        self._spring = model.qpos_spring[self._joint_qpos].copy()
        # The stiffness from a tendon's change of direction is explicit in MuJoCo. Damping, which
        # is implicit, of that stiffness times the time step keeps it stable at any tension.
        hinge, self._geometric = _matrix(model, [tca.geometric for tca in part.tcas])
        self._hinge_dof = model.jnt_dofadr[hinge]
        self._damping = model.dof_damping[self._hinge_dof].copy()

        # The bodies' unloaded shape is that of their springs; TCAs are measured from there.
        scalar = model.jnt_type >= int(mujoco.mjtJoint.mjJNT_SLIDE)
        address = model.jnt_qposadr[scalar]
        self.data.qpos[address] = model.qpos_spring[address]
        self._start = self.data.qpos.copy()
        self._locate()
        rest = np.array([tca.spec.rest_length + tca.stretch for tca in part.tcas])
        self._length_offset = np.zeros(self.n)
        self._length_offset = rest - self.length
        self.tca: TcaState
        self.pull: Pull
        self.reset()

    def reset(self, place: Callable[[mujoco.MjData], None] | None = None) -> None:
        """Back to the unloaded shape at ambient temperature, whatever happened before.

        Args:
            place: Called with the data to put the robot and its objects where they start, before
                anything is computed from it.
        """
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:] = self._start
        if place is not None:
            place(data)
        self.tca = self.bank.rest()
        self.power = np.zeros(self.n)
        self._locate()
        self._hand_over(self.bank.pull(self.tca, self.length))
        mujoco.mj_forward(model, data)

    def _locate(self) -> None:
        """Computes positions and tendon lengths, and no more, from the joints."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)

    @property
    def n(self) -> int:
        """Number of TCAs."""
        return len(self.tca_names)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    @property
    def temperature(self) -> NDArray[np.float64]:
        """Temperature of each TCA, shape (n,) [°C]."""
        return self.tca.temperature

    @property
    def length(self) -> NDArray[np.float64]:
        """Length of each TCA along its route, shape (n,) [m]."""
        angle = self.data.qpos[self._joint_qpos]
        smooth = 0.5 * ((angle * angle) @ self._coupling)
        return self.data.ten_length[self.tendon] + smooth + self._length_offset

    @property
    def tension(self) -> NDArray[np.float64]:
        """Tension each TCA exerts on the body, shape (n,) [N]; a slack TCA has none."""
        return 0.0 - self.data.actuator_force[self._actuator]

    @property
    def resistance(self) -> NDArray[np.float64]:
        """Electrical resistance of each TCA, shape (n,) [ohm]."""
        return self.bank.resistance(self.tca, self.length)

    @property
    def energy(self) -> NDArray[np.float64]:
        """Electrical energy put into each TCA so far, shape (n,) [J]."""
        return self.tca.energy_in

    def physics(self) -> Any:
        """dm_control's named view of this model and data, which it shares.

        For example ``physics().named.data.site_xpos["bending.tip"]``.
        """
        from dm_control.mujoco import Physics, wrapper  # loads OpenGL bindings: only if asked for

        return Physics(wrapper.MjData(self.data))

    def step(self, power: ArrayLike, duration: float) -> None:
        """Advances by ``duration`` [s] at constant electrical ``power``, shape (n,) [W].

        Raises:
            ValueError: If the power has the wrong shape, is negative or not finite, or the
                duration is no multiple of ``tca_period``.
            SimulationDiverged: If the state is no longer finite, or a TCA is shorter, longer or
                hotter than its law holds for.
        """
        power = np.array(power, dtype=np.float64)
        if power.shape != (self.n,):
            raise ValueError(f"power must have shape ({self.n},), got {power.shape}")
        if not (np.isfinite(power).all() and (power >= 0.0).all()):
            raise ValueError(f"power must be finite and at least 0 W, got {power}")
        updates = round(duration / self.tca_period) if np.isfinite(duration) else 0
        if updates < 1 or abs(updates * self.tca_period - duration) > 1e-9:
            raise ValueError(
                f"duration must be a positive multiple of tca_period {self.tca_period} s,"
                f" got {duration}"
            )
        model, data = self.model, self.data
        self.power = power
        for _ in range(updates):
            length = self.length
            self._check_length(length)
            try:
                self.tca, pull = self.bank.advance(self.tca, power, length, self.tca_period)
            except (CoilSolveError, ValueError) as error:  # far too hot for the law
                raise SimulationDiverged(
                    f"the TCAs have no state at {self.time:.3f} s: {error}"
                ) from error
            self._hand_over(pull)
            mujoco.mj_step(model, data, self._substeps)
        self._check()

    def _hand_over(self, pull: Pull) -> None:
        """Gives MuJoCo the law F + k (l' - l) and the chains the stiffness they are owed."""
        self.pull = pull
        model = self.model
        tendon_length = self.data.ten_length[self.tendon]
        bias = model.actuator_biasprm
        bias[self._actuator, 0] = -pull.tension + pull.stiffness * tendon_length
        bias[self._actuator, 1] = -pull.stiffness
        tension = np.maximum(pull.tension, 0.0)
        stiffness = self._stiffness + self._coupling @ tension
        model.jnt_stiffness[self._joint] = stiffness
        steady = model.opt.timestep * (self._geometric @ tension)
        model.dof_damping[self._hinge_dof] = self._damping + steady
        # The added spring pulls towards the straight joint, the body's own to its reference.
        model.qpos_spring[self._joint_qpos] = self._stiffness * self._spring / stiffness

    def _check_length(self, length: NDArray[np.float64]) -> None:
        inside = (length > self.bank.shortest) & (length < self.bank.longest)
        if not inside.all():
            self._check()
            i = int(np.argmin(inside))
            raise SimulationDiverged(
                f"{self.tca_names[i]} has a length of {length[i]:.5g} m at {self.time:.3f} s; its"
                f" law holds from {self.bank.shortest[i]:.5g} to {self.bank.longest[i]:.5g} m"
            )

    def _check(self) -> None:
        data = self.data
        number = data.warning.number
        bad = [name for warning, name in _DIVERGENCE.items() if number[warning] > 0]
        if bad or not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
            names = ", ".join(bad) or "not finite"
            raise SimulationDiverged(
                f"the state diverged at {data.time:.3f} s ({names}); a smaller timestep or less"
                " power may help"
            )


def _matrix(
    model: mujoco.MjModel, columns: Sequence[Sequence[tuple[str, float]]]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Ids of the joints named in any column, and their values, shape (joints, columns)."""
    joints = sorted({model.joint(name).id for column in columns for name, _ in column})
    row = {joint: i for i, joint in enumerate(joints)}
    matrix = np.zeros((len(joints), len(columns)))
    for i, column in enumerate(columns):
        for name, value in column:
            matrix[row[model.joint(name).id], i] += value
    return np.array(joints, dtype=np.int64), matrix

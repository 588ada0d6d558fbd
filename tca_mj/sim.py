"""A simulation: a built part with its TCAs and spines, in motion.

The TCAs' law is evaluated once per ``tca_period`` and handed to MuJoCo linearised; how, and why,
is in ``tca_mj.couple``.

MuJoCo's tendons are polylines through sites, its bodies chains of hinges. A TCA's length is that
of the smooth curve that its polyline stands for, and the joints get springs that make the tension
do the work that this length says: see ``tca_mj.model.smooth``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.actuation import Group, Signal, bank_of, muscle_group
from tca_mj.checks import (
    NotNegative,
    Numbers,
    Positive,
    door,
    every,
    number,
    require_one_of,
    shown,
    text,
)
from tca_mj.couple import Inputs, Writes, advance, measure, write
from tca_mj.drive import (
    DIVERGENCE,
    Ambient,
    Haste,
    SimulationDiverged,
    SimulationOverheated,
    Timestep,
    whole_number,
)
from tca_mj.drive import (
    Drive as Drive,
)
from tca_mj.model.build import stage
from tca_mj.model.moved import spare_joints
from tca_mj.model.mujoco_warnings import count_warnings
from tca_mj.model.part import Part
from tca_mj.model.smooth import SmoothBody
from tca_mj.model.spines import Spines
from tca_mj.rod.shape import bend
from tca_mj.tca import (
    CoilSolveError,
    CreepingState,
    CreepSpec,
    LawChoice,
    Pull,
    Supply,
    TcaMelted,
    TcaState,
)

# Physics steps between two updates of the TCAs, and in one call: MuJoCo cannot be interrupted in
# the former, and takes some ten microseconds for each of a small robot.
MOST_SUBSTEPS, MOST_STEPS = 10_000, 1_000_000
# Physics steps after which is looked whether the state has diverged: one that is no number takes
# the solver all its iterations, of a robot with many contacts half a second for each step. Of one
# with few degrees of freedom, whose steps cost less, there are more: so many over their number.
_RUN, _RUN_BY_FREEDOM = 5, 640
_NO_WARNING = bytes(4 * int(mujoco.mjtWarning.mjNWARNING))  # how many there were of each kind
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_SNAPPING = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)

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
        substeps: Number of physics steps in it.
        power: Electrical power in the last period, shape (n,) [W].
        body: The springs that stand for its cells.
        strained: The cells at the last update.
        actuator: Ids of the TCAs' actuators, shape (n,).
        steadiness: Time over which the damping of taut tendons is made, see ``body`` [s].
        length_offset: Lengths of the TCAs over those of their curves in ``body``, shape (n,) [m].
        spines: The shape-memory spines, if there are any.
        chains: Its chains by name.
        gain: Factor of every tension over the TCAs' law, see ``tca_mj.variation``.
        breakable: Whether it is known of a TCA when it breaks.
        haste: Smaller steps while something snaps, or None.

    Example:
        >>> from tca_mj import Simulation, bending_module
        >>> sim = Simulation(bending_module())
        >>> sim.step([1.0, 0.0, 0.0], 0.5)  # powers [W], for 0.5 s
        >>> sim.temperature.round()
        array([41., 25., 25.])
    """

    @door
    def __init__(
        self,
        part: Part,
        *,
        timestep: Timestep = 2e-3,
        tca_period: Positive = 2e-2,
        ambient: Ambient = 25.0,
        law: LawChoice = "surface",
        supply: Supply | None = None,
        haste: Haste | None = None,
        creep: CreepSpec | None = None,
        cycles: NotNegative = 0.0,
    ) -> None:
        """Compiles ``part``; its specification can still be changed and compiled again.

        A part without a light gets ``tca_mj.model.build.stage``.

        Args:
            part: What to simulate.
            timestep: Physics time step, 1 µs to 0.1 s [s].
            tca_period: Time between two updates of the TCAs, a multiple of ``timestep``, at most
                10 000 times as long [s].
            ambient: Temperature of the surroundings and of the cold TCAs, -40 to 60 °C [°C].
            law: What computes the TCAs' tensions, see ``TcaBank``. If a coil has no "surface",
                which no published one lacks, the exact "rod" takes its place; ``bank.law`` tells.
            supply: What the commands of ``step`` mean; by default they are powers.
            haste: Smaller steps while something snaps; None for none.
            creep: Constants by which the TCAs creep and relax, see ``tca.laws.creep``; None for
                none. They begin as trained ones do, at their natural lengths.
            cycles: Heating cycles that they have behind them, by which they have ``aged``, with
                these constants or, without them, the default ones [1].

        Raises:
            ValueError: If a number is out of range, a period is no multiple of the time step,
                there is no such ``law``, or MuJoCo cannot compile the part.
        """
        number("tca_period", tca_period, at_most=MOST_SUBSTEPS * timestep, unit="s")
        substeps = whole_number("tca_period", tca_period, "timestep", timestep)
        if haste is not None:
            whole_number("tca_period", tca_period, "haste.tca_period", haste.tca_period)
        self.haste = haste
        count_warnings()
        part.spec.option.timestep = timestep
        try:
            if not part.spec.lights:  # of no influence but on pictures, which would be black
                stage(part)
            self.model: mujoco.MjModel = part.spec.compile()
        except ValueError as error:
            name = part.spec.modelname
            raise ValueError(f"part must compile, got {name!r}: {error}") from error
        spare_joints(self.model)
        self.data = mujoco.MjData(self.model)
        self.tca_period = tca_period
        self.chains = part.members
        self.tca_names = tuple(tca.name for tca in part.tcas)
        if not part.tcas:
            raise ValueError(
                f"part must have at least one muscle, got none in {part.spec.modelname!r}: add_tca"
                " lays one into a chain"
            )
        self.bank = bank_of([tca.spec for tca in part.tcas], law, ambient, creep, cycles)
        self.bank.supply = supply or Supply()
        self.substeps = substeps
        self._run = max(_RUN, _RUN_BY_FREEDOM // max(self.model.nv, 1))
        self._lasting = math.nan, 0  # a duration, and how many updates it takes
        self.breakable = bool(np.isfinite(self.bank.breaking_force).any())
        self.gain = 1.0

        model = self.model
        self.tendon = np.array([model.tendon(name).id for name in self.tca_names], dtype=np.int64)
        self.actuator = np.array(
            [model.actuator(name).id for name in self.tca_names], dtype=np.int64
        )
        # Where the model keeps the constants and then the slopes of their forces.
        width = model.actuator_biasprm.shape[1]
        self._force = np.concatenate((width * self.actuator, width * self.actuator + 1))

        self.body = SmoothBody(model, part.tcas)
        # What is renewed only every period needs more damping than the time step (by trial).
        self.steadiness = _steadiness(timestep, tca_period)
        self.spines = Spines(part.spines, self.body, self.tca_names, ambient)

        # The bodies' unloaded shape is that of their springs; TCAs are measured from there.
        scalar = model.jnt_type >= int(mujoco.mjtJoint.mjJNT_SLIDE)
        address = model.jnt_qposadr[scalar]
        self.data.qpos[address] = model.qpos_spring[address]
        self._start = self.data.qpos.copy()
        self._scalar = model.jnt_dofadr[scalar]
        rest = np.array([tca.spec.rest_length + tca.stretch for tca in part.tcas])
        self.length_offset = self._zeros = np.zeros(self.n)
        self.length_offset = rest - self.length
        self.tca: TcaState
        self.pull: Pull
        self.reset()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Out of a pickle, perhaps in another process."""
        self.__dict__.update(state)
        count_warnings()

    @door
    def reset(self, place: Callable[[mujoco.MjData], None] | None = None) -> None:
        """Back to the unloaded shape at ambient temperature, whatever happened before.

        Args:
            place: Called with the data to put the robot and its objects where they start, before
                anything is computed from it. Shape-memory spines are cold and fixed in the shape
                that it leaves them in.
        """
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:] = self._start
        if place is not None:
            place(data)
        self.tca = self.bank.rest()
        self.power = np.zeros(self.n)
        self.strained = self.body.at(data.qpos)
        self.spines.reset(self.strained.motion)
        self._hand_over(self._pull(self.tca, self.strained.length + self.length_offset))
        mujoco.mj_forward(model, data)

    def keep(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Puts the TCAs at temperatures at which they have been for long, and what they lie in.

        Energies count from here. The tensions are those of before until the next step.

        Args:
            temperature: Temperatures, shape (n,), not below the surroundings' [°C].

        Returns:
            The power that keeps them there, shape (n,) [W].

        Raises:
            ValueError: As ``TcaBank.steady``.
        """
        steady, power = self.bank.steady(temperature)
        if isinstance(self.tca, CreepingState):
            steady = replace(steady, shift=self.tca.shift)
        self.tca = steady
        return power

    @door
    def rest(
        self, temperature: Numbers, *, warming: NotNegative = 1.0,
        longest: Annotated[float, partial(number, above=0.0, at_most=1000.0, unit="s")] = 20.0,
        quiet: NotNegative = 3e-5,
    ) -> float:  # fmt: skip
        """Warms the TCAs and waits until nothing moves any more: an equilibrium as a user finds it.

        Commands are powers meanwhile, whatever ``bank.supply`` says.

        Args:
            temperature: Temperatures, shape (n,), not below the surroundings' [°C].
            warming: Time in which they are led there [s].
            longest: Time after which it ends at the latest, a multiple of 0.1 s, at most 1000 s
                [s].
            quiet: Largest velocity of a joint with which it ends before [m/s, rad/s].

        Returns:
            The largest velocity of a joint that is left [m/s, rad/s].

        Raises:
            ValueError: As ``keep``; or as ``step``, if 0.1 s are no multiple of ``tca_period``.
            SimulationDiverged: As ``step``.
        """
        if np.shape(temperature) not in ((), (self.n,)):
            raise ValueError(f"temperature must be one or {self.n}, got {shown(temperature)}")
        ambient, left = np.asarray(self.bank.heat.ambient), np.inf
        told, self.bank.supply = self.bank.supply, Supply()
        try:
            for time in 0.1 * np.arange(1, round(10.0 * longest) + 1):
                share = min(time / warming, 1.0) if warming else 1.0
                self.step(self.keep(ambient + share * (temperature - ambient)), 0.1)
                left = float(np.abs(self.data.qvel).max(initial=0.0))
                if share == 1.0 and left < quiet:
                    break
        finally:
            self.bank.supply = told
        return left

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
    def body_temperature(self) -> NDArray[np.float64]:
        """Temperature of what each TCA lies in, shape (n,); of the air if it is bare [°C]."""
        return self.tca.body

    @property
    def embedded(self) -> NDArray[np.bool_]:
        """Which TCAs lie in a soft body, shape (n,)."""
        return self.bank.embedded

    @property
    def extrapolated(self) -> NDArray[np.bool_]:
        """Which TCAs are hotter than what was measured, shape (n,): their law is a guess there."""
        return self.bank.overheated(self.tca)

    @property
    def length(self) -> NDArray[np.float64]:
        """Length of each TCA along its route, shape (n,) [m]."""
        return self.body.at(self.data.qpos).length + self.length_offset

    @property
    def tension(self) -> NDArray[np.float64]:
        """Tension each TCA exerts on the body, shape (n,) [N]; a slack TCA has none.

        It is 1e-10 N above the law's, see ``tca_mj.couple``.
        """
        return self._zeros - self.data.actuator_force.take(self.actuator)

    @property
    def resistance(self) -> NDArray[np.float64]:
        """Electrical resistance of each TCA, shape (n,) [ohm].

        Not a number of one that has none, as its length or temperature is beyond all bounds.
        """
        return self.bank.resistance(self.tca, self.length, strict=False)

    @property
    def energy(self) -> NDArray[np.float64]:
        """Electrical energy put into each TCA so far, shape (n,) [J]."""
        return self.tca.energy_in

    def bend(self, *chains: str) -> float:
        """Angle by which the end of a chain is turned from its base, beyond half a turn too [rad].

        Of what has diverged it is not a number.

        Args:
            *chains: Its name; of several, each standing on the one before, the end of the last is
                meant, and the base of the first.

        Raises:
            ValueError: If there is no such chain.
        """
        unknown = [name for name in chains if text("chains", name) not in self.chains]
        if unknown or not chains:
            raise ValueError(f"chains must be some of {list(self.chains)}, got {unknown or chains}")
        bodies = [
            self.model.body(member.body(piece)).id
            for member in (self.chains[name] for name in chains)
            for piece in range(member.nodes + 1)
        ]
        axes = self.data.xmat[bodies].reshape(-1, 3, 3)[:, :, 2]
        return bend(axes) if np.isfinite(axes).all() else math.nan

    @property
    def motors(self) -> tuple[str, ...]:
        """Names of the model's actuators that are no muscles, in the order of ``data.ctrl``."""
        mine = set(self.actuator.tolist())
        model = self.model
        return tuple(model.actuator(i).name for i in range(model.nu) if i not in mine)

    @property
    def groups(self) -> tuple[Group, ...]:
        """Everything that drives the body, kind by kind: muscles, spines, motors."""
        return tuple(self.group(kind) for kind in self._kinds)

    @property
    def _kinds(self) -> list[str]:
        kinds = [bank.kind for _, bank in getattr(self.bank, "kinds", ((None, self.bank),))]
        return kinds + ["spine"] * bool(self.spines.n) + ["motor"] * bool(self.motors)

    def group(self, kind: str) -> Group:
        """One of ``groups``: "TCA", the kind of another bank, "spine" or "motor".

        Raises:
            ValueError: If there is none of this kind.
        """
        require_one_of("kind", kind, self._kinds)
        if kind == "spine":
            spines = self.spines
            return Group(
                kind=kind, names=spines.names, channels={"voltage": "V", "fan": "-"},
                signals={
                    "temperature": Signal("°C", spines.temperature),
                    "voltage": Signal("V", spines.voltage), "energy": Signal("J", spines.energy),
                    "damage": Signal("-", spines.damaged.astype(np.float64)),
                },
            )  # fmt: skip
        if kind == "motor":
            data, ids = self.data, [self.model.actuator(name).id for name in self.motors]
            slides = self.model.jnt_type[self.model.actuator_trnid[ids, 0]] == _SLIDE
            place, speed, load = (
                ("m", "m/s", "N") if slides.all() else ("m or rad", "m/s or rad/s", "N or N m")
            )
            return Group(
                kind=kind, names=self.motors, channels={"ctrl": "-"},
                signals={
                    "position": Signal(place, data.actuator_length[ids]),
                    "velocity": Signal(speed, data.actuator_velocity[ids]),
                    "force": Signal(load, data.actuator_force[ids]),
                },
            )  # fmt: skip
        return muscle_group(
            self.bank, self.tca, kind, self.length, self.tension, self.tca_names
        )

    def physics(self) -> Any:
        """dm_control's named view of this model and data, which it shares.

        For example ``physics().named.data.site_xpos["bending.tip"]``.

        Raises:
            ImportError: If dm-control is not installed, see ``tca_mj.envs.rewards``.
        """
        try:
            from dm_control.mujoco import Physics, wrapper  # loads OpenGL: only if asked for
        except ModuleNotFoundError as missing:
            raise ImportError("the named view is that of dm-control, which is not installed; the"
                              " places are in data.site(name), too") from missing  # fmt: skip
        return Physics(wrapper.MjData(self.data))

    def step(
        self,
        command: ArrayLike,
        duration: float,
        *,
        voltage: ArrayLike = 0.0,
        fan: ArrayLike = False,
    ) -> None:
        """Advances by ``duration`` [s] with constant commands.

        Args:
            command: Command of the TCAs, shape (n,): powers [W], or what ``bank.supply`` says.
            duration: Time to advance by, at most a million physics steps: some minutes of
                computing, in which nothing can be said [s].
            voltage: Voltage of the spines' heaters, shape (spines.n,) or one for all [V].
            fan: Whether air is blown at the spines, shape (spines.n,) or one for all.

        Raises:
            ValueError: If the command has the wrong shape, is negative or not finite, the voltage
                or the fan has the wrong shape, is not finite, or there are no spines, or the
                duration is no multiple of ``tca_period`` or too long.
            SimulationOverheated: If a TCA would be hotter than its fibre melts at.
            SimulationDiverged: If the state is no longer finite, or a TCA is shorter, longer or
                hotter than its law holds for.
        """
        inputs = self.checked(command, voltage, fan)
        updates = self.updates(duration)
        for _ in range(updates):
            if self.haste is not None and self.snaps(self.data.qvel) and self._beside():
                self._hurry(inputs, self.haste)
            else:
                self._update(inputs, self.tca_period, self.substeps)
        self._check()

    def snaps(self, qvel: NDArray[np.float64]) -> bool:
        """Whether something snaps at these velocities, shape (nv,), by what ``haste`` says."""
        fastest = np.abs(qvel.take(self._scalar)).max(initial=0.0)
        return self.haste is not None and bool(fastest > self.haste.speed)

    def _beside(self) -> bool:
        """Whether something is where it touches, or nearly."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_collision(self.model, self.data)
        return bool(self.data.ncon)

    def _hurry(self, inputs: Inputs, haste: Haste) -> None:
        """One period in smaller steps."""
        option = self.model.opt
        own = option.timestep, option.integrator, self.steadiness
        option.timestep, option.integrator = haste.timestep, _SNAPPING
        self.steadiness = _steadiness(haste.timestep, haste.tca_period)
        try:
            for _ in range(round(self.tca_period / haste.tca_period)):
                self._update(inputs, haste.tca_period, haste.substeps)
        finally:
            option.timestep, option.integrator, self.steadiness = own

    def _update(self, inputs: Inputs, period: float, substeps: int) -> None:
        """TCAs and spines, and then the body, go on by a period [s]."""
        model, data = self.model, self.data
        self.strained, length, inside = measure(
            self.body, self.bank, data.qpos, self.length_offset
        )
        self._check_length(length, inside)
        try:
            tca, pull = advance(
                self.bank, self.spines, self.tca, inputs, length=length,
                motion=self.strained.motion, gain=self.gain, period=period,
            )  # fmt: skip
            self.power = (tca.energy_in - self.tca.energy_in) / period
            self.tca = tca
        except TcaMelted as melted:
            raise SimulationOverheated(
                f"{self.tca_names[melted.number]} {melted.why}, at {self.time:.3f} s"
            ) from melted
        except (CoilSolveError, ValueError) as error:  # far too hot for the law
            raise SimulationDiverged(
                f"the TCAs have no state at {self.time:.3f} s: {error}"
            ) from error
        self._hand_over(pull)
        for done in range(0, substeps, self._run):
            mujoco.mj_step(model, data, min(self._run, substeps - done))
            if data.warning.number.tobytes() != _NO_WARNING:
                self._check()

    def checked(self, command: ArrayLike, voltage: ArrayLike, fan: ArrayLike) -> Inputs:
        """Command, shape (n,), voltage and fan, shape (spines.n,) each, for ``step``.

        Raises:
            ValueError: As ``step``.
        """
        return Inputs(self.bank.checked(command), *self.spines.checked(voltage, fan))

    def updates(self, duration: float) -> int:
        """How many updates of the TCAs a duration [s] takes.

        Raises:
            ValueError: If it is no multiple of ``tca_period``, or more than a million of physics
                steps.
        """
        if type(duration) is float and duration == self._lasting[0]:
            return self._lasting[1]
        longest = MOST_STEPS // self.substeps * self.tca_period
        updates = round(number("duration", duration, at_most=longest, unit="s") / self.tca_period)
        if updates < 1 or abs(updates * self.tca_period - duration) > 1e-9:
            raise ValueError(
                f"duration must be a positive multiple of tca_period {self.tca_period} s,"
                f" got {duration}"
            )
        self._lasting = float(duration), updates
        return updates

    def _pull(self, tca: TcaState, length: NDArray[np.float64]) -> Pull:
        pull = self.bank.pull(tca, length)
        return Pull(self.gain * pull.tension, self.gain * pull.stiffness, pull.length)

    def _hand_over(self, pull: Pull) -> None:
        """Gives MuJoCo the law of the TCAs, and the joints the springs that go with it."""
        self.pull = pull
        self._locate()
        data = self.data
        self.take(
            write(
                self.body, self.strained, pull, qpos=data.qpos,
                tendon_length=data.ten_length.take(self.tendon), tendon_slope=data.ten_J,
                steadiness=self.steadiness,
            )
        )  # fmt: skip

    def take(self, writes: Writes) -> None:
        """Writes what ``tca_mj.couple.write`` computes to the model."""
        force, stiffness, reference, damping = writes
        self.model.actuator_biasprm.put(self._force, force)
        self.body.set_springs(stiffness, reference)
        self.body.set_damping(damping)

    def _check_length(self, length: NDArray[np.float64], inside: NDArray[np.bool_]) -> None:
        if not every(inside):
            self._check()
            i = int(np.argmin(inside))
            raise SimulationDiverged(
                f"{self.tca_names[i]} has a length of {length[i]:.5g} m at {self.time:.3f} s; its"
                f" law holds from {self.bank.shortest[i]:.5g} to {self.bank.longest[i]:.5g} m"
            )

    def _check(self) -> None:
        data = self.data
        number, q, v = data.warning.number, data.qpos, data.qvel
        if number.tobytes() == _NO_WARNING and math.isfinite(q.dot(q) + v.dot(v)):
            return
        bad = [name for warning, name in DIVERGENCE.items() if number[warning]]
        if bad or not (every(np.isfinite(q)) and every(np.isfinite(v))):
            names = ", ".join(bad) or "not finite"
            raise SimulationDiverged(
                f"the state diverged at {data.time:.3f} s ({names}); a smaller timestep or less"
                " power may help"
            )


def _steadiness(timestep: float, tca_period: float) -> float:
    """Time over which the damping of taut tendons is made [s]."""
    return max(timestep, 0.4 * tca_period)

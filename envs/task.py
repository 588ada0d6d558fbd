"""What all tasks share: the course of an episode, how tools reach it, and its picture."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, ClassVar, TypedDict, Unpack

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import door, quantity, require_one_of, shown, some, whole
from tca_mj.drive import Drive, SimulationDiverged, Timestep
from tca_mj.envs.options import Option, Options, Setup, variation_of, variation_options
from tca_mj.envs.outcome import (
    Action,
    Headway,
    Observation,
    Outcome,
    TaskState,
    Verdict,
    broken_off,
    finite,
    harm,
    measured,
    together,
)
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.table import Entry, Table, commands
from tca_mj.model.part import Part
from tca_mj.record.render import Offscreen, Pixels, colour_tendons
from tca_mj.registry import ControlPeriod
from tca_mj.sim import Simulation
from tca_mj.state import get_state, set_state
from tca_mj.tca import (
    Estimate,
    HeatSpec,
    ObserverSpec,
    Supply,
    TcaBank,
    TcaObserver,
    TcaSpec,
    Thermostat,
    with_tca,
)
from tca_mj.variation import AMBIENT, Nominal, Variation

# What of a task may change in an episode has one of these types; and what never does, by name.
_VALUES = (bool, int, float, str, tuple, dict, np.ndarray, np.generic)
_BUILT = (
    "render_mode", "_camera", "_size", "spec", "metadata",
    "heating", "control_period", "interval", "repeats", "share", "_off", "_half_range", "_own_tca",
)  # fmt: skip
_DAMAGE = frozenset(("TCA temperature", "TCA tension"))  # rows that are out of bounds by damage
_ESTIMATED = {"TCA temperature", "TCA length", "TCA tension"}  # rows that an observer can fill
HEATINGS = ("temperature", "power")  # what a number of an action means to a TCA


class TaskArguments(TypedDict, total=False):
    """Arguments that every task takes, besides its own.

    Attributes:
        action: What the TCAs are told, ``temperature`` (by default) or ``power``.
        control_period: Time of a step, a multiple of the time between two updates of the TCAs, at
            most 60 s; by default the class's [s].
        render_mode: None or ``"rgb_array"``.
        camera: Camera of the pictures, one of the class's ``cameras``; by default the first.
        size: Width and height of the pictures, 1 to 8192, by default 960 by 720 [pixels].
        tca: The muscle of the robot in place of its own: a TCA, its name in ``CATALOGUE`` or its
            file, see ``tca_mj.tca.with_tca``. It is cut to its routes and laid into silicone as
            the robot's own; the robot has to get through its first step with it.
        estimated: Whether temperature, length and tension of the TCAs are seen as a
            ``TcaObserver`` tells them from voltage and current; by default they are the true ones.
    """

    action: str
    control_period: float | None
    render_mode: str | None
    camera: str
    size: tuple[int, int]
    tca: TcaSpec | str | Path | None
    estimated: bool


class SimulatedTask(gym.Env[Observation, Action], ABC):
    """A task that runs a ``Simulation``; its heirs say what is seen, done and paid for.

    The episode is run here, in one order. ``reset`` draws the options, varies the robot and has
    the heir ``prepare`` it. A step is ``drive``, in which the heir says what the action does to
    the simulation, then the simulation, then ``finish``: has the simulation broken off, is
    something seen out of its bounds, other than by damage, is a TCA damaged (``harm``), what has
    been earned and is the episode over (``judge``). A vector environment calls drive and finish
    for each of its tasks and lets all simulations run between them.

    A task has an ``__init__`` of its own, or says in its class what it is made of: ``scene``,
    ``rows`` and ``option_rows``; then its action heats all TCAs.

    The row "TCA heating" of an action says, from -1 to 1, with ``action="temperature"`` which
    temperature a thermostat holds each TCA at until the next action, from that of the surroundings
    (25 °C; off) to ``safe_temperature``; with ``action="power"`` its power, from 0 to
    ``max_power``.

    A step may take longer than the task's own control period: it is then several of them with one
    action, whose rewards add up, or as much of them as there is until the episode ends.

    Reward: the heir's terms, and ``energy``, minus ``energy_price`` per joule of electrical energy;
    ``heat``, minus ``heat_price`` per kelvin by which a TCA is above ``hot_temperature``, and
    ``end``, minus ``end_price`` in the step in which something is damaged or ends the episode
    without success. ``terms`` names all of them; those that nothing was earned by are 0.

    Every ``info`` has ``time`` [s]; ``energy`` of each TCA and ``heater_energy`` of each spine
    since the reset [J]; ``temperature`` and ``body_temperature`` of the TCAs and what they lie in,
    ``spine_temperature`` [°C]; ``extrapolated``, whether a TCA is hotter than what its law was
    measured at; ``tension`` [N]; ``damaged``, whether a TCA was contracted against a stiff spine;
    ``variation``, by how much the robot is off; ``success``; after a step also ``reward_terms`` and
    ``cost``, apart from the reward: for each TCA above ``hot_temperature`` its share of the way to
    ``max_temperature``, and 1 for damage. Where the simulation has diverged, what is not finite is
    0 there.

    Attributes:
        sim: The simulation.
        observation: Table of what is seen.
        action: Table of what is done.
        options: Table of the options of ``reset``.
        cameras: Names of the cameras, behind ``camera_prefix``.
        heating: What the TCAs are told, one of ``HEATINGS``.
        control_period: Time of one step [s].
        interval: Time after which the task judges, a part of it [s].
        max_power: Largest power of the TCAs that an action drives, one number or one for each [W].
        safe_temperature: Highest temperature that an action can ask for [°C].
        response: Time in which the thermostats would make up for an error; None for that between
            two updates of the TCAs. They know the nominal heat loss: on a robot that loses more or
            less they are off, the less the faster they are [s].
        max_temperature: Temperature of a TCA that ends an episode [°C].
        max_spine_temperature: Temperature of a spine that ends an episode [°C].
        hot_temperature: Temperature from which on heat is charged [°C].
        terms: Names of the terms of the reward.
        scripted: ``module:callable`` that makes its scripted policy from the task, or such a
            callable. A task that needs no memory for it may have a method ``script`` instead, from
            an observation to an action.
        scripted_arguments: Arguments of ``__init__`` that its scripted policy needs.
        script_holds: Whether what ``scripted`` makes tells temperatures, too, in a task that takes
            those, and as long as that holds them: then a learner can begin with its steps.
        robot_argument: Argument of ``__init__`` that is the robot's specification, and what makes
            the default one; None if it has none.
        legs: Legs, each with the same TCAs, that a gait can drive; 0 if none can.
        film_speed: Simulated seconds per second of film.
        published_speed: Speeds of the real robot by the stage that shows them [m/s].
        recipes: How it is learned, by algorithm; the first is what was best. ``recipes_for`` says
            it of a class that is several tasks.
        observer: What estimates the TCAs, or None: with ``estimated``. It believes the nominal heat
            loss, knows the temperatures at the reset and that of the surroundings, and reads
            power and resistance once in ``interval``.
        observer_spec: How far it trusts its model and its readings, whose noise is drawn so.
        finer: Finer models of the robot by name: each turns the specification into arguments of
            ``__init__``, the finer specification among them.
        scene: What builds the robot in its scene from its specification.
        rows: Rows of ``observation``.
        option_rows: Rows of ``options``, before those that all tasks have.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}
    cameras: ClassVar[tuple[str, ...]] = ("front", "side")
    camera_prefix: ClassVar[str] = ""
    control_period: float = 0.1
    max_power: ClassVar[float | NDArray[np.float64]]
    safe_temperature: ClassVar[float] = 172.0
    response: ClassVar[float | None] = None
    max_temperature: ClassVar[float] = 180.0
    max_spine_temperature: ClassVar[float] = 160.0  # an estimate, as in ``MorphSequence``
    hot_temperature: ClassVar[float] = np.inf
    terms: ClassVar[tuple[str, ...]] = ("energy",)
    energy_price: ClassVar[float] = 0.0
    heat_price: ClassVar[float] = 0.0
    end_price: ClassVar[float] = 0.0
    scripted: ClassVar[str | Callable[[Any], Any] | None] = None
    scripted_arguments: ClassVar[Mapping[str, Any]] = {}
    script_holds: ClassVar[bool] = False
    robot_argument: ClassVar[tuple[str, Callable[[], Any]] | None] = None
    finer: ClassVar[Mapping[str, Callable[[Any], dict[str, Any]]]] = {}

    observer_spec: ClassVar[ObserverSpec] = ObserverSpec()

    scene: ClassVar[Callable[[Any], Part] | None] = None
    rows: ClassVar[Sequence[Entry]] = ()
    option_rows: ClassVar[Sequence[Option]] = ()

    legs: ClassVar[int] = 0
    film_speed: ClassVar[float] = 8.0
    published_speed: ClassVar[Mapping[str, float]] = {}
    recipes: ClassVar[Mapping[str, Recipe]] = {}

    sim: Simulation
    observation: Table
    action: Table
    options: Options
    heating: str
    interval: float
    render_mode: str | None
    _camera: str
    _size: tuple[int, int]
    _screen: Offscreen | None = None
    _own_tca: bool = False
    observer: TcaObserver | None = None
    _believed: tuple[NDArray[np.float64], ...] = ()  # mean, covariance, and the energy so far
    _off: NDArray[np.float64]
    _half_range: float | NDArray[np.float64]

    @door
    def __init__(
        self, *, spec: Any = None, timestep: Timestep = 5e-3, **common: Unpack[TaskArguments]
    ) -> None:
        """Builds what the class says.

        Args:
            spec: The robot's specification; None for what ``robot_argument`` makes, ``spec`` being
                its name there, or for none.
            timestep: Physics time step, of which ``control_period`` is a multiple [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If the class has no scene, an argument is unknown or out of range, or the
                robot cannot be built.
        """
        kind = type(self)
        if kind.scene is None:
            raise ValueError(f"scene must be what builds the robot of {kind.__name__}, got None")
        if kind.robot_argument is not None:
            spec = self._robot(spec, common)
        part = kind.scene(spec)
        sim = Simulation(part, timestep=timestep, tca_period=kind.control_period)
        heating = Entry("TCA heating", sim.n, -1.0, 1.0, "-", off=-1.0)
        options = Options([*kind.option_rows, *variation_options()])
        self._open(sim, Table(kind.rows), Table([heating]), options, **common)

    @door
    def _open(
        self,
        sim: Simulation,
        observation: Table,
        commands: Table,
        options: Options,
        *,
        action: str = HEATINGS[0],
        control_period: ControlPeriod | None = None,
        render_mode: str | None = None,
        camera: str | None = None,
        size: tuple[Pixels, Pixels] = (960, 720),
        tca: TcaSpec | str | Path | None = None,
        estimated: bool = False,
    ) -> None:
        """Takes what the task is made of, and ``TaskArguments``; to be called once by ``__init__``.

        Raises:
            ValueError: If an argument is unknown or out of range, the control period no multiple
                of the time between two updates of the TCAs, or muscles that are no TCAs are to be
                estimated.
        """
        if tca is not None:  # ``_robot`` would have taken it
            raise ValueError(f"tca must be None for {type(self).__name__}, got {shown(tca)}")
        require_one_of("render_mode", render_mode, (None, *self.metadata["render_modes"]))
        require_one_of("camera", camera, (None, *self.cameras))
        self.render_mode, self._size = render_mode, size
        self._camera = self.camera_prefix + (camera or self.cameras[0])
        heating = require_one_of("action", action, HEATINGS)
        self.sim, self.heating = sim, heating
        self.observation, self.action, self.options = observation, commands, options
        self.observation_space, self.action_space = observation.space, commands.space
        self._nominal = Nominal(sim)
        self._varied: dict[str, float] = asdict(self.variation)
        self._used = 0.0
        own, asked = type(self).control_period, control_period
        self.control_period = own if asked is None else asked
        self.interval = own if _times(own, self.control_period) else sim.tca_period
        self.repeats = _times(self.interval, self.control_period)
        if not self.repeats:
            raise ValueError(
                f"control_period must be a multiple of {sim.tca_period} s, the time between two"
                f" updates of the TCAs, got {asked}"
            )
        self.share = self.interval / own  # of a price per step that each judgement takes
        if estimated:
            if not isinstance(sim.bank, TcaBank) or not _ESTIMATED & observation.slices.keys():
                raise ValueError(
                    f"estimated must be False unless all muscles are TCAs and one of"
                    f" {sorted(_ESTIMATED)} is seen, got True"
                )
            nominal = TcaBank(sim.bank.specs, sim.bank.law)
            self.observer = TcaObserver(nominal, self.observer_spec)
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / self.control_period))}
        self._off, self._half_range = np.zeros(sim.n), self.max_power / 2.0  # what TCAs are told
        if heating == "temperature":
            self._off = np.full(sim.n, AMBIENT)
            self._half_range = (self.safe_temperature - AMBIENT) / 2.0
            row = commands.slices["TCA heating"]
            power = np.ones(sim.n)  # those that no action drives are off
            # One number may heat several TCAs, each with a power of its own.
            power[: max(np.size(self.max_power), row.stop - row.start)] = self.max_power
            thermostat = Thermostat(
                heat=self.heat, max_power=power, max_temperature=self.safe_temperature,
                response=self.response or sim.tca_period,
            )  # fmt: skip
            sim.bank.supply = Supply(quantity="temperature", max_power=power, thermostat=thermostat)

    def heated(self, command: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the simulation's TCAs are told by the row "TCA heating", shape (sim.n,).

        Args:
            command: Of the first TCAs, from -1 to 1; the others are off.
        """
        warm = (command + 1.0) * self._half_range + self._off[: command.size]
        return warm if warm.size == self.sim.n else np.append(warm, self._off[warm.size :])

    @classmethod
    def recipes_for(cls, arguments: Mapping[str, Any]) -> Mapping[str, Recipe]:
        """The recipes of the task that the class is with some arguments, by algorithm.

        Args:
            arguments: Those with which the task is registered.
        """
        return cls.recipes

    def asking(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """The command by which ``heated`` asks for temperatures; beyond its bounds if they are.

        Args:
            temperature: Of the first TCAs, where they are what an action says [°C].
        """
        wanted = np.asarray(temperature, dtype=np.float64)
        return (wanted - self._off[: wanted.size]) / self._half_range - 1.0

    def prepare(self, setup: Setup) -> None:
        """Begins an episode: resets the simulation and puts everything where it starts.

        Args:
            setup: A value for every option.
        """
        self.sim.reset()

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """Translates a command, the action within its bounds, to what drives the simulation."""
        return Drive(command=self.heated(command))

    @abstractmethod
    def observe(self) -> dict[str, ArrayLike]:
        """What is seen: a value for every row of ``observation``."""

    @abstractmethod
    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """What a step has led to. It is not asked after a step that has diverged.

        Args:
            drive: What drove the simulation.
            harmed: Whether something is damaged: there is no success then.
        """

    def seen(self) -> Observation:
        """The observation."""
        values = self.observe()
        if self._believed:
            values |= self._estimated({e.name: e for e in self.observation.entries})
        return self.observation.pack(values)

    def _estimated(self, rows: Mapping[str, Entry]) -> dict[str, ArrayLike]:
        """The rows of the TCAs by the observer, within their bounds."""
        assert self.observer is not None
        now = Estimate(*self._believed[:2])
        tension = self.observer.tension(now).tension
        values = {"temperature": now.temperature, "length": now.length, "tension": tension}
        found = {f"TCA {name}": value for name, value in values.items()}
        return {
            name: np.clip(value[: rows[name].size], rows[name].low, rows[name].high)
            for name, value in found.items() if name in rows
        }  # fmt: skip

    def _sense(self) -> None:
        """The observer reads power and resistance of the TCAs."""
        if self.observer is None or not np.isfinite(self.sim.resistance).all():
            return
        sim, noise = self.sim, self.observer_spec.resistance_noise
        ohms = np.maximum(sim.resistance + noise * self.np_random.standard_normal(sim.n), noise)
        if not self._believed:
            bank = self.observer.bank
            bank.heat = replace(bank.heat, ambient=sim.bank.heat.ambient)
            now = self.observer.begin(ohms, sim.temperature)
        else:
            mean, covariance, before = self._believed
            power = np.maximum(sim.energy - before, 0.0) / self.interval
            now = self.observer.predicted(Estimate(mean, covariance), power, self.interval)
            now = self.observer.corrected(now, ohms)
        self._believed = now.mean, now.covariance, sim.energy.copy()

    def details(self) -> dict[str, Any]:
        """What ``info`` says besides."""
        return {}

    def outcome(self) -> dict[str, Any]:
        """What the summary of a demo says of the end of its episode, besides what all have."""
        return {}

    def bent(self) -> float:
        """By which angle the robot is bent, for plots [rad]; not a number if that means nothing."""
        return float("nan")

    def headway(self) -> Headway | None:
        """How the robot gets on; None if it is not to."""
        return None

    @property
    def heat(self) -> HeatSpec:
        """Thermal constants of the TCAs as they were built, fields of shape (n,)."""
        return self._nominal.heat

    @property
    def variation(self) -> Variation:
        """By how much the robot of this episode is off."""
        return self._nominal.variation

    @property
    def energy(self) -> float:
        """Electrical energy put into TCAs and heaters since the reset [J]."""
        energy, spines = _sum(self.sim.energy), self.sim.spines
        return energy + _sum(spines.energy) if spines.n else energy

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode; ``self.options`` is the table of the options.

        Raises:
            ValueError: If an option is unknown or out of its range, or no seed a seed; or if the
                robot does not come to rest with them.
        """
        super().reset(seed=None if seed is None else whole("seed", seed, at_least=0))
        setup = self.options.setup(self.np_random, {} if options is None else options)
        variation = variation_of(setup)
        self._nominal.apply(variation)
        self._varied = asdict(variation)
        try:
            self.prepare(setup)
        except SimulationDiverged as error:
            raise ValueError(
                f"options must leave a robot that comes to rest, got {self._varied}: {error}"
            ) from error
        self._used, self._believed = self.energy, ()
        self._sense()
        return self.seen(), self._info(success=False)

    def _robot(self, given: Any, common: TaskArguments) -> Any:
        """The specification of the robot: the one given, or where that is None the default one.

        To be called by ``__init__`` at its start. It takes the argument ``tca`` out of ``common``.

        Raises:
            ValueError: If there is no such TCA.
            FileNotFoundError: If its file is not there.
        """
        assert self.robot_argument is not None
        robot = self.robot_argument[1]() if given is None else given
        tca = common.pop("tca", None)
        self._own_tca = tca is not None
        return robot if tca is None else with_tca(robot, tca)

    def _try(self, name: str, robot: Any) -> None:
        """Refuses a robot that was given, not None, if it does not get through its first step.

        To be called by ``__init__`` at its end.
        """
        if self._own_tca:
            robot = getattr(self, name)
        if robot is None:
            return
        try:
            outside = self.observation.outside(self.reset(seed=0)[0])
            why = f"{outside} out of bounds" if outside else None
            why = why or self.step(self.action.still)[4].get("truncation_reason")
        except ValueError as error:
            why = str(error)
        if why:
            raise ValueError(
                f"{name} must be one that gets through its first step, got {shown(robot)}: {why}"
            )
        self._np_random = self._np_random_seed = None  # nothing was drawn yet

    def finish(self, drive: Drive, error: SimulationDiverged | None) -> Outcome:
        """What the step has led to; see the class.

        Args:
            drive: What ``drive`` returned.
            error: Why the simulation broke off, or None.
        """
        table, sim = self.observation, self.sim
        reason = broken_off(error)
        harmed = None if error else self.harm()
        self._sense()
        observation = self.seen()
        outside = table.outside(observation)
        if outside:
            explained = harmed and _DAMAGE.issuperset(outside) and np.isfinite(observation).all()
            if not explained:
                reason = reason or f"diverged: {', '.join(outside)} out of bounds"
            observation = table.bounded(observation)
        terms = dict.fromkeys(self.terms, 0.0)
        success, ended, cost = False, None, 0.0
        if reason is None:  # nothing is known of a diverged state
            reason = harmed
            verdict = self.judge(drive, reason is not None)
            terms |= verdict.terms
            success, ended = verdict.success, verdict.ended
            for name, value in verdict.seen.items():
                observation[table.slices[name]] = value
            if math.isfinite(self.hot_temperature):
                above = sim.temperature - self.hot_temperature
                excess = float(np.maximum(above, 0.0).sum()) if some(above > 0.0) else 0.0
                if self.heat_price:
                    terms["heat"] = -self.heat_price * self.share * excess
                if self.hot_temperature < self.max_temperature:
                    cost = excess / (self.max_temperature - self.hot_temperature)
            if self.end_price and (reason or ended):
                terms["end"] = -self.end_price
        used, self._used = self._used, self.energy
        terms["energy"] = -self.energy_price * (self._used - used)
        info: dict[str, Any] = {"reward_terms": terms, "cost": cost + (reason is not None)}
        info |= self._info(success=success)
        if reason is not None:
            info["truncation_reason"] = reason
        if ended is not None:
            info["termination_reason"] = ended
        if error is not None or outside:
            info = finite(info)
            terms = info["reward_terms"]
        terminated, truncated = success or ended is not None, reason is not None
        return observation, float(sum(terms.values())), terminated, truncated, info

    def get_state(self, old: TaskState | None = None) -> TaskState:
        """The state of the episode between two steps: simulation, generator, and what is judged.

        A time limit that Gymnasium's wrapper keeps is none of it.

        Args:
            old: A state of this task that is no longer wanted, whose memory is taken.
        """
        kept = self._episode()
        return TaskState(
            simulation=get_state(self.sim, None if old is None else old.simulation),
            variation=self.variation,
            random=deepcopy(self.np_random.bit_generator.state),
            episode=deepcopy(kept),
        )

    def set_state(self, state: TaskState) -> None:
        """Goes back to a state of this task, or to one of a task that was built alike.

        Raises:
            ValueError: If it is of another task.
        """
        if state.episode.keys() != self._episode().keys():
            raise ValueError(f"state must be of a {type(self).__name__} that was built alike")
        self._nominal.apply(state.variation)
        set_state(self.sim, state.simulation)
        self.np_random.bit_generator.state = state.random
        self.__dict__.update(deepcopy(dict(state.episode)))

    def _episode(self) -> dict[str, Any]:
        """What of the task may change in an episode."""
        return {
            key: value for key, value in self.__dict__.items()
            if key not in _BUILT and isinstance(value, _VALUES)
        }  # fmt: skip

    def harm(self) -> str | None:
        """What the robot does not survive, or None."""
        return harm(self.sim, self.max_temperature, self.max_spine_temperature)

    def _info(self, *, success: bool) -> dict[str, Any]:
        return {
            **measured(self.sim), "variation": self._varied.copy(), "success": success,
            **self.details(),
        }  # fmt: skip

    def command(self, action: Action) -> NDArray[np.float64]:
        """The action as finite numbers within -1 and 1.

        Raises:
            ValueError: If the action has the wrong shape, is not finite or out of [-1, 1].
        """
        return commands("action", action, self.action_space.shape or ())

    def step(self, action: Action) -> Outcome:
        """Runs the simulation for ``control_period``, or until the episode ends; see the class.

        Raises:
            ValueError: If the action has the wrong shape, is not finite or out of [-1, 1].
        """
        command, outcome = self.command(action), None
        for _ in range(self.repeats):
            drive = self.drive(command)
            error = None
            try:
                self.sim.step(drive.command, self.interval, voltage=drive.voltage, fan=drive.fan)
            except SimulationDiverged as diverged:
                error = diverged
            outcome = together(outcome, self.finish(drive, error))
            if outcome[2] or outcome[3]:
                break
        assert outcome is not None
        return outcome

    # What tools that know Gymnasium's own MuJoCo environments look for.
    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.sim.model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state."""
        return self.sim.data

    @property
    def dt(self) -> float:
        """Time of one step [s]."""
        return self.control_period

    @property
    def camera(self) -> str:
        """Name of the camera of the pictures."""
        return self._camera

    def paint(self) -> None:
        """Gives what is hot the colour of its temperature; no physics reads it."""
        colour_tendons(self.model, self.sim.tendon, self.sim.temperature)

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the scene, shape (height, width, 3), or None without a render mode.

        Raises:
            RenderingUnavailable: If there is no OpenGL.
        """
        if self.render_mode is None:
            return None
        if self._screen is None:
            width, height = self._size
            self._screen = Offscreen(
                self.model, width=width, height=height, camera=self._camera, coils=self.sim.tendon
            )
        self.paint()
        return self._screen.draw(self.data)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the window: a copy goes on where this one is."""
        return self.__dict__ | {"_screen": None}

    def close(self) -> None:
        """Frees what rendering took."""
        if self._screen is not None:
            self._screen.close()
            self._screen = None


def parts(name: str, time: float, part: float, *, of: int = 1) -> int:
    """How many times ``part`` makes up a time, a multiple of ``of``.

    Raises:
        ValueError: If it is no such number; ``name`` is what ``part`` is called.
    """
    count = _times(quantity(name, part, above=0.0), time)
    if not count or count % of:
        number = f"multiple of {of}" if of > 1 else "whole number"
        raise ValueError(f"{name} must be {time} s over a {number}, got {part}")
    return count


def _sum(values: NDArray[np.float64]) -> float:
    return values.item() if values.size == 1 else float(np.add.reduce(values))


def _times(part: float, time: float) -> int:
    """How many times a time makes up another; 0 if that is no whole number."""
    count = round(time / part)
    return count if abs(count * part - time) < 1e-9 else 0

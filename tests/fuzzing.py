"""Calls what the package offers with hostile arguments, and judges what comes of it.

``surfaces`` walks what the packages offer and finds functions, constructors, class methods and
methods, whoever adds one; of the tasks in the registry it finds the arguments, the options of
``reset``, the figures of the robot and the action. A call gets what its annotations ask for, but
for an argument or two that are hostile: not a number, huge, of a wrong kind, shape or
specification. It may return something without a NaN, or raise ``ValueError`` with name, value and
bound, or what its docstring says under ``Raises:``, within 30 s.

``python tests/fuzzing.py 10000 FOLDER`` tries ten thousand cases, goes on where it was stopped,
and writes a table.
"""

import datetime
import faulthandler
import inspect
import math
import re
import resource
import signal
import sys
import typing
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import gymnasium as gym
import mujoco
import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from test_names import offered

import tca_mj
from tca_mj import checks, control, rod, variation
from tca_mj.agents.design import designed
from tca_mj.agents.policies.network import Network
from tca_mj.agents.train.config import OffPolicy
from tca_mj.assets import mjcf
from tca_mj.envs.task import SimulatedTask, TaskArguments
from tca_mj.envs.vector import TaskVector
from tca_mj.model.chain import Chain
from tca_mj.model.tendon import route_passes
from tca_mj.modules.bending import bending_module
from tca_mj.registry import TASKS, task_class
from tca_mj.registry import find_task as task_spec

SEVERAL = object()  # what stands for the default of *arguments, of which one is given
SECONDS = 30  # longest time of a case
MEMORY = 6 << 30  # largest memory that a case may take besides [bytes]

# What is no door, and why: modules, and things in them.
_PROGRAM = "a program that runs for minutes; its command is fuzzed"
_KERNEL = "a kernel: arrays of numbers that were checked"
_SCREEN = "needs a screen"
_ACTS = "acts on what a task has shown"
NO_DOOR = {
    **dict.fromkeys(
        ("bench", "validation", "certify", "cli", "agents.train.deep", "agents.train.search.search",
         "agents.sweep.Trial", "agents.sweep.run_sweep"), _PROGRAM),
    **dict.fromkeys(
        (
            "tca.laws.rod.CoilRods.unsoftened", "tca.laws.rod.CoilRods.finished",
            "tca.laws.rod.CoilRods.torsion_per_tension", "tca.thermal.HeatStep.advance",
            "sim.Simulation.take", "tca.dynamics.stepping.LoadedTcas.heated",
            "tca.dynamics.stepping.LoadedTcas.pull", "tca.supply.Supply.power",
            "tca.dynamics.stepping.LoadedTcas.check_domain", "tca.supply.Supply.like", "actuation",
            "smp.bank.SpineBank.advance", "envs.options.Uniform.__call__",
            "envs.options.Constant.__call__",
        ),
        _KERNEL,
    ),
    **dict.fromkeys(
        (
            "agents.policies.files.NetworkPolicy", "agents.policies.files.ResidualPolicy",
            "agents.policies.files.with_clock", "agents.policies.gait.GaitPolicy.act",
            "agents.policies.network.Network.__call__", "agents.scripts.arm.PickAndPlace.act",
            "agents.scripts.morph.MorphPolicy.act", "agents.scripts.reach.ReachPolicy.act",
            "agents.scripts.course.CourseWalker", "agents.policies.gait.GaitPolicy.told_of",
            "envs.wrappers", "envs.table.Table.scaled", "envs.table.Table.mirrored",
            "envs.table.Table.read", "envs.table.Table.outside", "envs.table.Table.bounded",
            "envs.task", "envs.vector", "agents.train.sb3_env", "agents.policies.actors.Blind",
            "agents.rollout",
        ),
        _ACTS,
    ),
    **dict.fromkeys(("envs.viewer", "record.render.Offscreen", "record.film.Film.frame",
                     "record.render.gl_backend"), _SCREEN),
}  # fmt: skip


class Hangs(BaseException):
    """A case took longer than ``SECONDS``."""


class NoSample(LookupError):
    """Nothing is known that an argument could be."""


@dataclass(frozen=True)
class Surface:
    """What is called: its name, the function, and the kind of object that it is a method of.

    ``named`` are parameters that the function takes as ``**named``, with values near which things
    become wrong.
    """

    name: str
    function: Callable[..., Any]
    owner: Any = None
    errors: frozenset[str] = frozenset()
    named: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, tuple[Any, Any]]:
        """Annotation and default of each parameter by name."""
        if self.named:
            return {name: (Any, None) for name in self.named}
        return _parameters(self.function)

    def call(self, arguments: Mapping[str, Any]) -> Any:
        given = dict(arguments)
        before = () if self.owner is None else (good(self.owner, "self", self.name),)
        several = tuple(given.pop(n) for n, (_, d) in self.parameters.items() if d is SEVERAL)
        return self.function(*before, *several, **given)


@cache
def _parameters(function: Any) -> dict[str, tuple[Any, Any]]:
    target = function.__init__ if inspect.isclass(function) else function
    target = getattr(target, "__func__", target)
    try:
        hints = typing.get_type_hints(target, include_extras=True)
    except (NameError, TypeError):
        hints = {}
    found = inspect.signature(target).parameters.values()
    return {
        p.name: (hints.get(p.name, Any), SEVERAL if p.kind is p.VAR_POSITIONAL else p.default)
        for p in found if p.kind is not p.VAR_KEYWORD and p.name not in ("self", "cls")
    }  # fmt: skip


def surfaces() -> Iterator[Surface]:
    """All that the packages offer, each once, by the module that defines it."""
    seen = set()
    for thing in offered().values():
        module = getattr(thing, "__module__", None)
        if id(thing) in seen or not isinstance(module, str) or not module.startswith("tca_mj."):
            continue
        seen.add(id(thing))
        name = f"{module.removeprefix('tca_mj.')}.{getattr(thing, '__name__', '')}"
        if not _closed(name) and inspect.isclass(thing):
            yield from _of_class(name, thing)
        elif not _closed(name) and inspect.isfunction(thing):
            yield Surface(name, thing, errors=_errors(thing))


def tasks() -> Iterator[Surface]:
    """What can be said to the tasks of the registry."""
    for task in TASKS:
        kind = task_class(task.id)
        known = dict.fromkeys([*_parameters(kind), *TaskArguments.__annotations__], ())
        yield Surface(f"{task.id} arguments", partial(_constructed, task.id), named=known)
        rows = {row.name: _near(row.low, row.high) for row in _task(task.id).options.rows}
        yield Surface(f"{task.id} options", partial(_begun, task.id), named={"seed": ()} | rows)
        size = _task(task.id).action.size
        actions = tuple(np.full(size, value) for value in (-1.1, -1.0, 0.3, 1.0, np.nan))
        yield Surface(f"{task.id} action", partial(_acted, task.id), named={"action": actions})
        robot = {
            path: tuple(type(value)(factor * value) for factor in (0.1, 0.4, 0.8, 1.3, 2.5, 10.0))
            for path, value in figures(kind.robot_argument[1]())
        }
        yield Surface(f"{task.id} robot", partial(_robot, task.id), named=robot)
        yield Surface(f"{task.id} vector", partial(_vector, task.id), named=dict.fromkeys(
            ("num_envs", "num_threads", "max_episode_steps", "autoreset_mode", "reset_options"), ()
        ))


def _near(low: float, high: float) -> tuple[float, ...]:
    """Bounds that are there, what is just beyond them, and what is between."""
    bounds = [bound for bound in (low, high) if math.isfinite(bound)]
    beyond = [low - 1e-3 * abs(low) - 1e-6, high + 1e-3 * abs(high) + 1e-6]
    between = [low + share * (high - low) for share in (0.2, 0.7)] if bounds[1:] else []
    return (*bounds, *(value for value in beyond if math.isfinite(value)), *between)


def figures(spec: Any, before: str = "") -> Iterator[tuple[str, float]]:
    """Path and value of each number of a specification and of those in it."""
    for each in fields(spec):
        value = getattr(spec, each.name)
        if is_dataclass(value):
            yield from figures(value, f"{before}{each.name}.")
        elif isinstance(value, float | int) and not isinstance(value, bool):
            yield f"{before}{each.name}", value


@cache
def _task(id: str) -> Any:
    return tca_mj.make(id).unwrapped


def _constructed(id: str, **arguments: Any) -> None:
    task_class(id)(**task_spec(id).kwargs | arguments)


def _begun(id: str, **said: Any) -> Any:
    task, seed = _task(id), said.pop("seed", 0)
    return _first_step(task, task.reset(seed=seed, options=said))


def _first_step(task: Any, begun: Any) -> Any:
    """What the first steps of an episode say, which has to be within the declared spaces."""
    outcome = task.step(task.action.still)
    for seen in (begun[0], outcome[0]):
        assert task.observation_space.contains(seen), task.observation.outside(seen)
    reason = outcome[4].get("truncation_reason", "")
    assert not reason.startswith("diverged"), reason
    return begun, outcome


def _acted(id: str, action: Any) -> Any:
    task = _task(id)
    task.reset(seed=0)
    outcome = task.step(action)
    assert task.observation_space.contains(outcome[0]), task.observation.outside(outcome[0])
    return outcome


def _robot(id: str, **design: Any) -> Any:
    kind = task_class(id)
    argument, default = kind.robot_argument
    robot = designed(default(), design)
    task = kind(**task_spec(id).kwargs, **{argument: robot})
    return _first_step(task, task.reset(seed=0))


def _vector(id: str, **arguments: Any) -> None:
    TaskVector(task_class(id), **task_spec(id).kwargs, **arguments)


def _closed(name: str) -> bool:
    parts = name.split(".")
    return any(".".join(parts[: i + 1]) in NO_DOOR for i in range(len(parts)))


def is_value(kind: Any) -> bool:
    """Whether a class is one of results: plain data that nobody checks until it is used."""
    named = issubclass(kind, tuple) and hasattr(kind, "_fields")
    return named or (is_dataclass(kind) and not issubclass(kind, checks.Checked))


def _of_class(name: str, kind: Any) -> Iterator[Surface]:
    if getattr(kind, "_is_protocol", False) or issubclass(kind, BaseException | Enum):
        return
    if hasattr(kind, "robot_argument"):  # a task: walked by the registry
        return
    if not (inspect.isabstract(kind) or is_value(kind)):
        yield Surface(name, kind, errors=_errors(kind) | _errors(kind.__init__))
    for key, member in vars(kind).items():
        if (key.startswith("_") and key != "__call__") or f"{name}.{key}" in NO_DOOR:
            continue
        if isinstance(member, classmethod | staticmethod):
            bound = getattr(kind, key)
            yield Surface(f"{name}.{key}", bound, errors=_errors(bound))
        elif inspect.isfunction(member):
            yield Surface(f"{name}.{key}", member, owner=kind, errors=_errors(member))


def _errors(function: Any) -> frozenset[str]:
    """Names of the errors under ``Raises:`` in a docstring."""
    said = re.search(r"Raises:\n(.*)", function.__doc__ or "", re.DOTALL)
    return frozenset(re.findall(r"\b[A-Z]\w+(?=[,:])", said.group(1))) if said else frozenset()


_TASK = "TCA/BendReach-v0"


def _spiral(t: Any) -> Any:
    return 0.01 * np.stack([np.cos(t), np.sin(t), 0.1 * t], axis=-1)


def _shipped(name: str) -> Path:
    from tca_mj.agents.policies import shipped

    return shipped()[name]


def _setup() -> dict[str, Any]:
    setup: dict[str, Any] = _env(_TASK).unwrapped.options.setup(np.random.default_rng(0), {})
    return setup


@cache
def _recorded() -> Path:
    from tca_mj.record import Recorder

    path = Path("good.rrd").absolute()
    with Recorder(good(tca_mj.Simulation), path) as recorder:
        recorder.frame()
    return path


@cache
def _statistics() -> Path:
    path = Path("statistics.npz").absolute()
    np.savez(path, mean=np.zeros(3), var=np.ones(3), clip=10.0, epsilon=1e-8)
    return path


@cache
def _exported() -> tuple[Any, Any]:
    part = bending_module()
    return tca_mj.Simulation(part), part.spec


# What an argument is where its annotation does not say: by parameter, in SI units.
BY_NAME: dict[str, Any] = {
    "length": 0.045, "temperature": 60.0, "dt": 0.02, "tension": 0.1, "radius": 4e-3,
    "count": 3, "phase": 0.5, "s": 0.5, "angle": 0.5, "time": 1.0, "force": 0.05, "mass": 0.03,
    "diameter": 9e-3, "outer_diameter": 9e-3, "young": 1e5, "shear": 4e4, "density": 1000.0,
    "body_length": 0.045, "half_width": 1e-3, "offset": 4e-3, "turns": 2.0, "voltage": 1.0,
    "resistance": 3.0, "power": 0.5, "surface": 60.0, "ambient": 25.0, "speed": 1.0,
    "hot": 120.0, "cold": 25.0, "nodes": 4, "rest_length": 0.05, "pitch_angle": 0.3,
    "displacement": 0.01, "load": 0.1, "target": 60.0, "weight": 0.1, "tension_rate": 0.01,
    "name": "tca9", "width": 5e-3, "height": 5e-3, "inner": 6e-4, "outer": 2e-3, "duration": 0.02,
    "start": 80.0, "seed": 1, "modulus": 1e8, "excess_ratio": 2.0, "cooling": True,
    "bending_rate": 0.0, "memory": 0.1, "error": 0.1, "duty": 0.5, "periods": 3.0, "stiff": 0.1,
    "passes": lambda: route_passes(_samples()[Chain](), good(tca_mj.Helix)),
    "torsion_per_tension": 200.0, "section": 3e-5, "perimeter": 0.02, "cycles": 2,
}  # fmt: skip
# Words by which messages call parameters.
SAID_AS = {"given": "options", "temperatures": "temperature", "drives": "drive", "value": "x"}
# The same for single surfaces.
BY_SURFACE: dict[str, dict[str, Any]] = {
    "rod.beam.Outline": {"half_width": 4e-3, "half_height": 4e-3},
    "control.gait.Gait": {
        "offset": (0.0, 0.5), "start": (0.0, 0.5), "duty": (0.5, 0.5), "hot": (150.0, 150.0),
        "warm": (40.0, 40.0), "period": 3.0,
    },
    "control.gait.Gait.table": {"name": "hot"},
    "model.part.Part.attach": {"to": "tip", "prefix": "more", "names": None},
    "model.scene.load": {"path": lambda: mjcf("arena.xml")},
    "model.scene.scene": {"arena": lambda: mjcf("arena.xml")},
    "record.plots.rollout_plot": {
        "time": [0.0, 1.0], "bend": [0.0, 1.0], "names": ["a"],
        **{name: [[1.0], [2.0]] for name in ("power", "temperature", "tension")},
        "path": "plot.png",
    },
    "record.reader.read": {"path": lambda: _recorded()},
    "sim.Simulation.bend": {"chains": "body"},
    "sim.Simulation.keep": {"temperature": [60.0] * 3},
    "sim.Simulation.rest": {"temperature": [30.0] * 3},
    "sim.Simulation.group": {"kind": "TCA"},
    "sim.Simulation.step": {"command": [0.1] * 3},
    "sim.Simulation.checked": {"command": [0.1] * 3, "voltage": 0.0, "fan": False},
    "smp.heater.fan_gain": {"start": 120.0},
    "smp.heater.HeaterSpec.losing": {"fan": True}, "smp.heater.heat_spine": {"fan": True},
    "smp.bank.SpineBank": {"owner": [0]},
    "rod.shape.bend": {"axes": [[0.0, 0.0, 1.0], [0.0, 0.1, 0.995]]},
    "variation.Variation.bounds": {"name": "mass"},
    "record.render.colour_tendons": {"tendon": [0], "temperature": [60.0]},
    "model.spine.sheath": {"**": lambda: {
        "length": 0.1, "line_density": 0.03, "outline": good(rod.Outline),
    }},
    "routes.Helix.between": {"start": 0.0, "end": 0.5},
    "routes.leg_length": {"leg": lambda: good(tca_mj.Helix)},
    "model.mujoco_warnings.warning_line": {"counts": lambda: Counter({"x": 1})},
    "tca.fibre.centreline.Centreline.of_curve": {
        "position": lambda: _spiral, "end": 6.0, "start": 0.0,
    },
    "tca.fibre.centreline.Centreline.of_points": {"points": lambda: _spiral(np.linspace(0, 6, 50))},
    "tca.laws.creep.CreepBank.fresh": {"length": [0.05]},
    "tca.sensing.wire.fit_displacement": {
        "resistance": [3.0, 3.1, 3.2, 3.3, 3.4], "displacement": [0.0, 1e-3, 2e-3, 3e-3, 4e-3],
    },
    "tca.spec.TcaSpec": {
        "minimum_pitch_angle": 0.2, "fibre_length": 0.175, "coil_radius": 0.43e-3,
    },
    "tca.spec.TcaSpec.from_mandrel": {
        "core_diameter": 4e-4, "fibre_length": 0.175, "groove_pitch_angle": 0.35,
    },
    "tca.mandrel.kept_share": {"groove_pitch_angle": 0.35, "annealing_temperature": 180.0},
    "tca.supply.Supply.checked": {"n": 1},
    "variation.Nominal.apply": {"variation": lambda: variation.Variation()},
    "rod.beam.Outline.contains": {"x": 1e-3, "y": 1e-3},
    "agents.episode.Episode": {"names": (_TASK, "off"), "out": None, "options": {}, "seed": 1},
    "agents.episode.Episode.run": {"limit": 0.2, "speed": 1.0, "progress": False},
    "agents.evaluate.cell": {"name": "return"}, "agents.evaluate.label": {"name": "return"},
    "agents.evaluate.figures": {"rows": [{"return": 1.0}]},
    "agents.policies.files.SavedPolicy.to_onnx": {"path": "network.onnx"},
    "agents.policies.load.saved_policy": {"source": "bend-reach"},
    "agents.policies.preprocessing.Statistics.read": {"path": lambda: _statistics()},
    "agents.policies.sb3_zip.Model.preprocessed": {"statistics": None, "units": None},
    "assets.mjcf": {"name": "arena.xml"},
    "envs.hanging.hang": {"place": (0.0, 0.0, 0.1), "turn": (1.0, 0.0, 0.0, 0.0),
                          "stand": "reach_stand"},
    "exported.frozen": {"sim": lambda: _exported()[0], "spec": lambda: _exported()[1]},
    "agents.policies.actors.scripted": {"env": lambda: _env(_TASK, action="power")},
    "agents.policies.load.load_policy": {
        "source": "bend-reach", "env": lambda: _env(_TASK, action="power"),
    },
    "agents.policies.load.require_arguments": {"arguments": {}},
    "agents.policies.gait.GaitPolicy.in_task": {
        "env": lambda: _env("TCA/TetrapodWalk-v0", action="power"), "steering": 0.0,
    },
    "agents.scripts.arm.scripted": {"task": lambda: _env("TCA/ArmPickPlace-v0").unwrapped},
    "agents.scripts.morph.scripted": {"task": lambda: _env("TCA/MorphModule-v0").unwrapped},
    "agents.scripts.tetrapod.scripted": {"task": lambda: _env("TCA/TetrapodWalk-v0").unwrapped},
    "agents.scripts.reach.scripted": {"task": lambda: _env(_TASK).unwrapped},
    "control.morph.ClosedLoop": {
        "pi": lambda: control.PiSpec(proportional=1.0, highest=2.0),
        "angle_of": lambda: math.sqrt,
    },
    "agents.policies.network.Network": {
        "weights": lambda: (np.ones((1, 2), np.float32),), "mean": lambda: np.zeros(2),
        "biases": lambda: (np.zeros(1, np.float32),), "var": lambda: np.ones(2),
    },
    "agents.policies.files.SavedPolicy.make": {"env": lambda: _env(_TASK, action="power")},
    "envs.table.numbers": {"value": [0.5], "shape": (1,)},
    "envs.options.Option.checked": {"value": 0.5},
    "envs.options.Option": {"**": lambda: {"draw": lambda random, setup: 0.5}},
    "envs.options.Options.setup": {"given": {}},
    "tca.fibre.centreline.Centreline": {
        "strain": lambda: lambda s: np.zeros((*np.shape(s), 3)), "rotation": lambda: np.eye(3),
        "position": (0.0, 0.0, 0.0),
    },
    "record.film.Film": {"path": "film.mp4"},
    "record.recorder.Recorder": {"path": "made.rrd"},
    "variation.Variation.drawn": {"draws": [0.1] * 5, "spread": 0.2},
    "envs.hanging.StaticTip.at": {"temperature": [60.0, 30.0, 30.0]},
    "envs.hanging.StaticTip.inverse": {"target": [5e-3, 0.0, -0.044], "hottest": 100.0},
    "envs.table.Entry": {"low": 0.0, "high": 1.0},
    "envs.table.Table.pack": {"values": lambda: _samples()[SimulatedTask]().observe()},
    "envs.options.variation_of": {"setup": lambda: _setup()},
    "agents.design.robot_of": {"task": _TASK, "design": lambda: {"length": 0.05}},
    "agents.design.designed": {"spec": lambda: tca_mj.BendingSpec(), "design": {}},
    "agents.demo.play": {"task": _TASK, "max_duration": 0.2, "policy": "off", "video": False},
    "agents.evaluate.Evaluation": {"task": _TASK},
    "agents.evaluate.run_episode": {"seed": 1},
    "agents.policies.actors.arguments_of": {"name": "off", "task": _TASK},
    "agents.policies.actors.best_of": {"name": "off"},
    "agents.policies.actors.actor": {"name": "off"},
    "agents.policies.actors.first_gait": {"task": "TCA/TetrapodWalk-v0", "start": "scripted"},
    "agents.policies.files.SavedPolicy": {
        "task": _TASK, "**": lambda: {"network": good(Network)},
    },
    "agents.policies.files.SavedPolicy.save": {"path": "saved.npz"},
    "agents.policies.files.SavedPolicy.read": {"path": lambda: _shipped("bend-reach")},
    "agents.policies.load.find": {"source": "bend-reach"},
    "agents.scripts.tetrapod.gait_policy": {"gait": "walk"},
    "agents.sweep.Sweep": {"axes": {"seed": [1, 2]}},
    "agents.train.config.TrainConfig": {
        "task": _TASK, "algorithm": "sac", "learner": lambda: _samples()[OffPolicy](),
    },
    "agents.train.config.default_config": {"task": _TASK, "algorithm": "sac"},
    "agents.train.search.SearchConfig": {"task": "TCA/TetrapodWalk-v0"},
    "agents.train.gait_space.GaitSpace": {"hottest": 172.0},
    "agents.train.gait_space.GaitSpace.encode": {"steering": (0.0,) * 4},
    "agents.train.gait_space.GaitSpace.decode": {"point": [0.5] * 28},
    "agents.train.gait_space.GaitSpace.fold": {"point": [0.5] * 28},
    "registry.make": {"task": _TASK}, "registry.find_task": {"task": _TASK},
    "registry.task_class": {"task": _TASK}, "registry.episode_steps": {"task": _TASK},
}  # fmt: skip


def good(hint: Any, name: str = "", surface: str = "") -> Any:
    """Something that an argument can be.

    Raises:
        NoSample: If nothing is known.
    """
    special = BY_SURFACE.get(surface, {})
    if name in special:
        return _made(special[name])
    origin, inner = get_origin(hint), get_args(hint)
    samples = _samples()
    if isinstance(hint, typing.Hashable) and hint in samples:
        return samples[hint]()
    for kind in (origin, inner[0] if origin is Annotated else None):
        if isinstance(kind, type) and kind in samples:
            return samples[kind]()
    if hint is bool:
        return True
    if hint in (ArrayLike, checks.Array) or hint == checks.Numbers:
        return np.array([BY_NAME.get(name, 0.5)])
    if origin is np.ndarray:
        return np.array([BY_NAME.get(name, 0.5)])
    if (name in BY_NAME and hint is not str) or name == "name":
        return _made(BY_NAME[name])
    if origin is Annotated:
        return _bounded(hint)
    if origin is Literal:
        return inner[0]
    if origin in (Union, UnionType):
        return _first(inner, name)
    if origin is tuple:
        return tuple(good(each, name) for each in inner if each is not Ellipsis)
    if origin in (Sequence, list):
        return [good(inner[0], name)]
    if origin in (Mapping, dict):
        return {}
    if inspect.isclass(hint) and is_dataclass(hint):
        return hint(**_needed(hint, surface))
    plain = {float: 1.0, int: 2, str: "x", bytes: b"x"}
    if hint in plain:
        return plain[hint]
    raise NoSample(f"{surface}: {name}: {hint}")


def _made(value: Any) -> Any:
    return value() if inspect.isfunction(value) else value


def _needed(kind: Any, surface: str = "") -> dict[str, Any]:
    parameters = _parameters(kind).items()
    return {n: good(h, n, surface) for n, (h, d) in parameters if d is inspect.Parameter.empty}


def _bounded(hint: Any) -> Any:
    inner, *checkers = get_args(hint)
    bounds: dict[str, float] = {}
    for checker in checkers:
        bounds |= getattr(checker, "keywords", {})
    low = bounds.get("above", bounds.get("at_least"))
    high = bounds.get("below", bounds.get("at_most"))
    whole = inner is int
    if low is None and high is None:
        value: Any = 1.0
    elif low is None or high is None:
        value = (low + 1.0) if high is None else high - 1.0
    else:
        value = math.sqrt(low * high) if low > 0.0 else low + 0.1 * (high - low)
    value = max(int(value), bounds.get("at_least", 0)) if whole else float(value)
    shape = bounds.get("shape")
    return (value,) * shape[0] if shape else value


def _first(members: Sequence[Any], name: str) -> Any:
    for member in members:
        try:
            if member is not NoneType:
                return good(member, name)
        except NoSample:
            continue
    if NoneType in members:
        return None
    raise NoSample(f"{name}: {members}")


@cache
def _samples() -> dict[Any, Callable[[], Any]]:
    from tca_mj import actuation, smp, tca
    from tca_mj.agents.episode import Episode
    from tca_mj.agents.evaluate import Evaluation
    from tca_mj.agents.policies import Policy, SavedPolicy, shipped
    from tca_mj.agents.policies.actors import Script, actor
    from tca_mj.agents.scripts.tetrapod import WALK
    from tca_mj.agents.train.config import TrainConfig
    from tca_mj.batch import SimulationBatch
    from tca_mj.envs.hanging import StaticTip
    from tca_mj.envs.options import Constant, Option, Options
    from tca_mj.envs.table import Entry, Table
    from tca_mj.model.chain import add_chain
    from tca_mj.model.part import Part, new_spec
    from tca_mj.model.tendon import Pass, RoutedTca
    from tca_mj.modules.bending import silicone_cylinder
    from tca_mj.record.film import Film
    from tca_mj.record.recorder import Recorded, Recorder
    from tca_mj.record.render import Closing, Watched
    from tca_mj.rod import BeamSpec, Outline, Segment
    from tca_mj.routes import Helix, Route, UTurn
    from tca_mj.sim import Drive, Simulation
    from tca_mj.smp.lumped import LumpedModule
    from tca_mj.state import SimulationState, get_state

    fibre = tca.CATALOGUE["free-stroke"]
    bank = cache(lambda: tca.TcaBank([fibre]))
    creeping = cache(lambda: tca.CreepBank([fibre]))
    lifting = cache(lambda: tca.LoadedTcas([fibre], tca.Load.weight(0.03)))
    heater = smp.HeaterSpec.fitted(smp.SpineSpec())
    spines = cache(lambda: smp.SpineBank([smp.SpineSpec()], [heater], [0]))
    lumped = cache(lambda: LumpedModule(smp.SpineSpec(), heater, fibre.of_length(0.23)))
    simulated = cache(lambda: Simulation(bending_module()))
    beam = silicone_cylinder(0.045, 9e-3, 9e-3)

    def chain() -> Chain:
        spec = new_spec("fuzzed")
        return add_chain(spec.worldbody, beam, nodes=4, name="body")

    def bent() -> Simulation:
        simulated().reset()
        return simulated()

    def env() -> Any:
        made = _env("TCA/BendReach-v0")
        made.reset(seed=0)
        return made

    def loop() -> control.ClosedLoop:
        return control.ClosedLoop(
            pi=control.PiSpec(proportional=1.0, highest=2.0), angle_of=lambda ohms: 0.1
        )

    muscles = [fibre]
    return {
        tca.TcaSpec: lambda: fibre, tca.FibreSpec: lambda: fibre.fibre,
        tca.FibreSpec | tca.FibreTable: lambda: fibre.fibre,
        tca.TcaBank: bank, tca.TcaState: lambda: bank().rest(),
        tca.Pull: lambda: bank().pull(bank().rest(), [0.045]),
        tca.CreepBank: creeping, tca.CreepState: lambda: creeping().rest(),
        tca.LoadedTcas: lifting, tca.LoadState: lambda: lifting().rest(),
        tca.Load: lambda: tca.Load.weight(0.03), tca.Heating: lambda: tca.Heating(value=0.5),
        tca.WireTable: lambda: tca.WireTable.of(muscles),
        tca.FibreTable: lambda: tca.FibreTable.of([fibre.fibre]),
        tca.CoilRods: lambda: tca.CoilRods(muscles),
        tca.CoilSurfaces: lambda: tca.CoilSurfaces(muscles),
        tca.Surface: lambda: tca.calibrate(fibre), tca.ConicalTca: lambda: tca.CONICAL,
        tca.HeatSpec: lambda: bank().heat, tca.HeatStep: lambda: tca.HeatStep.of(bank().heat, 0.02),
        tca.Centreline: lambda: tca.Centreline.of_tca(fibre),
        tca.Thermostat: lambda: tca.Thermostat(heat=bank().heat, max_power=2.0),
        tca.Supply: tca.Supply,
        Polynomial: lambda: Polynomial([0.0, 1.0]),
        np.random.Generator: lambda: np.random.default_rng(0),
        BeamSpec: lambda: beam, Helix: lambda: Helix(3e-3),
        UTurn: lambda: UTurn.parallel(3e-3, 1e-3),
        Route: lambda: Helix(3e-3), Segment: lambda: Segment(beam, [Helix(3e-3)], [0.05]),
        Part: bending_module, Chain: chain, Pass: lambda: Pass(chain(), Helix(3e-3)),
        RoutedTca: lambda: bending_module().tcas[0],
        mujoco.MjSpec: lambda: new_spec("fuzzed"), mujoco.MjsBody: lambda: new_spec("x").worldbody,
        mujoco.MjModel: lambda: simulated().model, mujoco.MjData: lambda: simulated().data,
        Simulation: bent, SimulationState: lambda: get_state(bent()),
        SimulationBatch: lambda: SimulationBatch([bent()]),
        Drive: lambda: Drive(command=np.zeros(3)),
        smp.HeaterSpec: lambda: heater, smp.SpineBank: spines,
        smp.SpinesState: lambda: spines().rest([0.1]),
        smp.HeaterState: lambda: smp.HeaterState.rest(heater, (1,)),
        smp.SpineState: lambda: smp.SpineState.rest(smp.SmpSpec(), np.array([0.1])),
        LumpedModule: lumped, control.PiState: control.pi_rest,
        control.Gait: lambda: WALK, control.ClosedLoop: loop,
        control.MorphSequence: lambda: control.MorphSequence(drive=loop()),
        control.MorphState: lambda: control.MorphState(control.Phase.SOFTEN, 0.5),
        control.Phase: lambda: control.Phase.SOFTEN,
        control.Measurement: lambda: control.Measurement(25.0, 15.0),
        actuation.MuscleBank: bank,
        gym.Env: env, SimulatedTask: lambda: env().unwrapped,
        Table: lambda: env().unwrapped.observation,
        Entry: lambda: Entry("x", 1, 0.0, 1.0, "-"), StaticTip: lambda: env().unwrapped.static,
        SavedPolicy: lambda: SavedPolicy.read(next(iter(shipped().values()))),
        Evaluation: lambda: Evaluation(task="TCA/BendReach-v0", policy="off", episodes=1, steps=1),
        TrainConfig: lambda: TrainConfig(
            task="TCA/BendReach-v0", algorithm="sac", learner=OffPolicy(), steps=2
        ),
        OffPolicy: OffPolicy, variation.Nominal: lambda: variation.Nominal(bent()),
        smp.Damage: lambda: smp.Damage(*[np.zeros(1, bool)] * 3),
        Outline: lambda: Outline(4e-3, 4e-3),
        Episode: lambda: Episode(
            env(), actor("off", env()), names=(_TASK, "off"), seed=1, out=None, options={}
        ),
        Policy: lambda: actor("off", env()), Script: lambda: Script(act=lambda seen: seen),
        Constant: lambda: Constant(0.5),
        Option: lambda: Option(
            name="x", about="", draw=lambda *_: 0.5, drawn="", low=0.0, high=1.0
        ),
        Options: lambda: env().unwrapped.options, Watched: bent, Recorded: bent,
        Recorder: lambda: Recorder(bent(), "sample.rrd"), Film: lambda: Film(bent(), "sample.mp4"),
        Closing: lambda: Film(bent(), "sample.mp4"),
        Network: lambda: SavedPolicy.read(_shipped("bend-reach")).network,
        Path: lambda: Path("fuzzed"), str | Path: lambda: "fuzzed",
    }  # fmt: skip




@cache
def _env(id: str, **arguments: Any) -> Any:
    made = tca_mj.make(id, **arguments)
    made.reset(seed=0)
    return made


HOSTILE: dict[str, Callable[[], Any]] = {
    "nan": lambda: math.nan, "inf": lambda: math.inf, "-inf": lambda: -math.inf,
    "-0.0": lambda: -0.0, "0": lambda: 0, "-1": lambda: -1, "tiny": lambda: 5e-324,
    "1e-9": lambda: 1e-9, "1e30": lambda: 1e30, "1e308": lambda: 1e308, "-1e308": lambda: -1e308,
    "400 digits": lambda: 10**400, "-400 digits": lambda: -(10**400),
    "5000 digits": lambda: 10**5000, "2**63": lambda: 2**63, "1e6": lambda: 10**6,
    "1.5": lambda: 1.5, "64.5": lambda: 64.5, "text": lambda: "x", "number as text": lambda: "0.05",
    "no text": lambda: "", "complex": lambda: 1j, "complex array": lambda: np.array([1.0 + 0j]),
    "None": lambda: None, "true": lambda: True, "bytes": lambda: b"1", "object": object,
    "date": lambda: datetime.date(2020, 1, 1), "numpy date": lambda: np.datetime64("2020-01-01"),
    "no list": list, "no tuple": tuple, "no dict": dict, "no array": lambda: np.array([]),
    "masked": lambda: np.ma.masked_array([0.05], mask=[True]),
    "part masked": lambda: np.ma.masked_array([0.05, 0.06, 0.07], mask=[False, True, False]),
    "nan array": lambda: np.array([math.nan]), "wrong shape": lambda: np.full((2, 3, 4), 0.05),
    "many axes": lambda: np.full((1,) * 12, 0.05), "ragged": lambda: [[0.05], [0.05, 0.06]],
    "texts": lambda: ["x", "y"], "objects": lambda: np.array([None, "x"], dtype=object),
    "set": lambda: {0.05}, "mixed": lambda: [0.05, "x"], "function": lambda: len,
    "class": lambda: int,
    "a TCA": lambda: good(tca_mj.TcaSpec), "a beam": lambda: good(tca_mj.BeamSpec),
    "a route": lambda: good(tca_mj.Helix), "an arm": lambda: tca_mj.ArmSpec(),
    "a fibre": lambda: good(tca_mj.TcaSpec).fibre, "path": lambda: Path("nowhere"),
}  # fmt: skip


def hostile(near: Sequence[Any] = ()) -> st.SearchStrategy[Any]:
    """What an argument may be that nobody has asked for; a text is a name in ``HOSTILE``."""
    numbers = st.floats() | st.floats(-10.0, 10.0) | st.integers() | st.integers(-5, 50)
    rows = st.lists(numbers, min_size=1, max_size=5)
    strange = st.sampled_from(sorted(HOSTILE))
    return strange | numbers | rows | (st.sampled_from(list(near)) if near else strange)


@st.composite
def cases(draw: Any, surface: Surface) -> "Case":
    """A call with one or two hostile arguments, if there are any."""
    names = list(surface.parameters)
    some = st.lists(st.sampled_from(names), min_size=1, max_size=2, unique=True)
    chosen = draw(some) if names else []
    return Case(surface, {name: draw(hostile(surface.named.get(name, ()))) for name in chosen})


def tried(surface: Surface, count: int, turn: int = 0) -> list[tuple[str, str]]:
    """Cases and complaints: so many, the same ones each time; another turn has others."""
    found: list[tuple[str, str]] = []

    @seed(zlib.crc32(f"{surface.name} {turn}".encode()))
    @settings(max_examples=count, phases=[Phase.generate], database=None, deadline=None,
              suppress_health_check=list(HealthCheck))
    @given(cases(surface))
    def one(case: Case) -> None:
        found.append((case.about, case.complaint()))

    one()
    return found


# How a file is refused: by its path, with what is wrong with it.
_OF_A_FILE = re.compile(r"is no (policy|model)|has no statistics|must be trusted")


@dataclass
class Case:
    """A call: which arguments are hostile, and with what; the others are good."""

    surface: Surface
    hostile: dict[str, Any] = field(default_factory=dict)

    def arguments(self) -> dict[str, Any]:
        parameters = self.surface.parameters
        given = dict(_made(BY_SURFACE.get(self.surface.name, {}).get("**", {})))
        for name, (hint, default) in parameters.items():
            needed = default is inspect.Parameter.empty or default is SEVERAL
            if name not in self.hostile and needed:
                given[name] = good(hint, name, self.surface.name)
        for name, kind in self.hostile.items():
            given[name] = HOSTILE[kind]() if isinstance(kind, str) else kind
        return given

    @property
    def about(self) -> str:
        """The case in words."""
        said = {name: kind if isinstance(kind, str) else checks.shown(kind)
                for name, kind in self.hostile.items()}  # fmt: skip
        return f"{self.surface.name} with {said}"

    def complaint(self) -> str:
        """What is wrong with what comes of it; empty if nothing is."""
        arguments = self.arguments()
        try:
            with guarded():
                result = self.surface.call(arguments)
                if inspect.isgenerator(result):
                    result = next(result, None)
                where = nan_in(result)
        except Hangs:
            return f"takes longer than {SECONDS} s"
        except (KeyboardInterrupt, SystemExit):
            raise
        except ValueError as error:
            return self._style(str(error))
        except BaseException as error:  # of a library in another language, too
            names = {kind.__name__ for kind in type(error).__mro__}
            return "" if names & self.surface.errors else f"{type(error).__name__}: {error}"[:300]
        return f"NaN in {where}" if where else ""

    def _style(self, said: str) -> str:
        """Whether a refusal says what is wrong."""
        if not ("must" in said and "got" in said or _OF_A_FILE.search(said)):
            return f"ValueError without must and got: {said}"[:300]
        names = [name.rpartition(".")[2] for name in self.surface.parameters]
        if not any(word in said for name in names for word in (name, SAID_AS.get(name, name))):
            return f"ValueError names none of {names}: {said}"[:300]
        if len(said) > 1000:
            return f"ValueError of {len(said)} letters: {said[:200]}"
        return ""


def nan_in(value: Any, where: str = "result", depth: int = 0) -> str:
    """Where in a value a NaN is; empty if there is none."""
    if depth > 6:
        return ""
    if isinstance(value, float | complex | np.floating):
        return where if value != value else ""
    if isinstance(value, np.ndarray):
        return where if value.dtype.kind in "fc" and np.isnan(value).any() else ""
    items: Any = ()
    if is_dataclass(value) and not isinstance(value, type):
        items = [(f".{f.name}", getattr(value, f.name, None)) for f in fields(value)]
    elif isinstance(value, Mapping):
        items = [(f"[{k!r}]", v) for k, v in value.items()]
    elif isinstance(value, list | tuple):
        items = [(f"[{i}]", v) for i, v in enumerate(value[:50])]
    return next((f for k, v in items if (f := nan_in(v, where + k, depth + 1))), "")


@contextmanager
def guarded() -> Iterator[None]:
    """A case that hangs is broken off; if it cannot be, the process ends and says where."""

    def late(*_: Any) -> None:
        raise Hangs

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(SECONDS)
    faulthandler.dump_traceback_later(2 * SECONDS, exit=True, file=sys.__stderr__)
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY, hard))
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        faulthandler.cancel_dump_traceback_later()
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)

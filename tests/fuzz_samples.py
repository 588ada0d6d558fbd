"""What arguments can be: good ones by annotation, name and surface, and hostile ones.

``good`` finds something that an argument can be; ``HOSTILE`` is what nobody has asked for.
"""

import datetime
import inspect
import io
import math
import typing
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import gymnasium as gym
import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

import tca_mj
from tca_mj import checks, control, rod, variation
from tca_mj.agents.model import TaskModel, Transitions, View
from tca_mj.agents.policies.files import SavedPolicy
from tca_mj.agents.policies.network import Network
from tca_mj.agents.train.config import OffPolicy
from tca_mj.agents.train.distil import Teacher
from tca_mj.assets import mjcf
from tca_mj.envs.task import SimulatedTask
from tca_mj.envs.vector import TaskVector
from tca_mj.model.chain import Chain
from tca_mj.model.tendon import route_passes
from tca_mj.modules.bending import bending_module
from tca_mj.registry import task_class

SEVERAL = object()  # what stands for the default of *arguments, of which one is given


class NoSample(LookupError):
    """Nothing is known that an argument could be."""


@cache
def parameters_of(function: Any) -> dict[str, tuple[Any, Any]]:
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


TASK = "TCA/BendReach-v0"


def _spiral(t: Any) -> Any:
    return 0.01 * np.stack([np.cos(t), np.sin(t), 0.1 * t], axis=-1)


def shipped_policy(name: str) -> Path:
    from tca_mj.agents.policies import shipped

    return shipped()[name]


@cache
def model_zip() -> bytes:
    """A model of Stable-Baselines3."""
    from stable_baselines3 import PPO

    from tca_mj.envs.wrappers import ScaledObservation

    scaled = ScaledObservation(task_env(TASK, action="power"))
    small = {"net_arch": {"pi": [4], "vf": [2]}}
    model = PPO("MlpPolicy", scaled, policy_kwargs=small, seed=0, device="cpu", n_steps=2,
                batch_size=2)  # fmt: skip
    file = io.BytesIO()
    model.save(file)
    return file.getvalue()


@cache
def _model_file() -> Path:
    path = Path("good_model.zip").absolute()
    path.write_bytes(model_zip())
    return path


def _setup() -> dict[str, Any]:
    setup: dict[str, Any] = task_env(TASK).unwrapped.options.setup(np.random.default_rng(0), {})
    return setup


@cache
def recorded() -> Path:
    from tca_mj.record import Recorder

    path = Path("good.rrd").absolute()
    with Recorder(good(tca_mj.Simulation), path) as recorder:
        recorder.frame()
    return path


@cache
def muscle() -> Path:
    from tca_mj.tca import MATERIALS, write_tca

    sources = MATERIALS["silver-coated nylon sewing thread"].sources
    return write_tca(Path("muscle.json").absolute(), good(tca_mj.TcaSpec), sources)


@cache
def bench_file() -> Path:
    """A set of measurements."""
    from tca_mj.tca.identify import simulated_bench, write_data

    data = simulated_bench(good(tca_mj.TcaSpec), rows=5)[1]
    return write_data(data, Path("bench.csv").absolute())


@cache
def statistics() -> Path:
    path = Path("statistics.npz").absolute()
    np.savez(path, mean=np.zeros(3), var=np.ones(3), clip=10.0, epsilon=1e-8)
    return path


def _logged() -> Any:
    from tca_mj.tca.identify import Data

    time = np.array([0.0, 0.5, 1.0])
    columns = {"time": time, "voltage": 1.0 + time, "length": 0.05 - 1e-3 * time}
    return Data(name="log.csv", columns=columns, fixed={"load": 0.1})


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
    "steps": 3, "torsion_per_tension": 200.0, "section": 3e-5, "perimeter": 0.02, "cycles": 2,
}  # fmt: skip
# The same for single surfaces.
BY_SURFACE: dict[str, dict[str, Any]] = {
    "robots.adaptive_gripper.AdaptiveGripperSpec.angle_for": {"gap": 0.04},
    "modules.morphing_square.TwistMorphingSpec.temperature_for": {"angle": -0.5},
    "modules.morphing_square.Morphing3dSpec.temperatures": {"direction": 0.5},
    "tca.laws.statics.pulling_temperature": {"force": 0.05},
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
    **dict.fromkeys(
        ("agents.policies.sb3_zip.Model.read", "agents.policies.load.read_zip"),
        {"path": lambda: _model_file()},
    ),
    "record.reader.read": {"path": lambda: recorded()},
    "drive.Haste": {"timestep": 1e-4, "tca_period": 1e-3},
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
    "tca.design.wish.Wish": {"stroke": 8e-3, "load": 0.2, "time": 5.0, "voltage": 4.0},
    "tca.design.candidates.Winding": {
        "thread": "free-stroke", "core_diameter": 4e-4, "groove_pitch_angle": 0.35,
        "fibre_length": 0.2, "strands": 1,
    },
    "tca.design.candidates.designed": {"annealing_temperature": 180.0},
    "tca.design.search.find_designs": {
        "aims": ["energy", "mass"], "population": 8, "generations": 2,
    },
    "tca.design.reporting.lifted": {"dt": 0.05},
    "tca.design.search.Designs.values": {"name": "energy"},
    "tca.design.reporting.write_designs": {"out": "designs"},
    "record.webpage.WebPage": {"path": "page.html"},
    "traces.Trace": {
        "time": [0.0, 1.0], "command": [[1.0, 0.0, 0.0]], "seen": {"bend": [0.0, 0.3]},
        "error": {"bend": 0.02},
    },
    "traces.TraceFit.identified": {"name": "length"},
    "traces.TraceFit.interval": {"name": "length"},
    "tca.identify.logged.follow_log": {"data": lambda: _logged()},
    "tca.sensing.observer.TcaObserver.begin": {"temperature": 25.0},
    "tca.sensing.observer.TcaObserver.step": {"voltage": [1.0], "current": [0.3]},
    "tca.sensing.observer.TcaObserver.bound": {
        "truth": lambda: np.array([[60.0], [25.0], [0.05], [1.0]]) + np.zeros((2, 4, 1)),
        "power": [[0.5]],
    },
    "tca.sensing.observer.TcaObserver.rank": {"powers": [0.5, 1.0], "load": 0.1},
    "tca.spec.TcaSpec": {
        "minimum_pitch_angle": 0.2, "fibre_length": 0.175, "coil_radius": 0.43e-3,
    },
    "tca.spec.TcaSpec.from_mandrel": {
        "core_diameter": 4e-4, "fibre_length": 0.175, "groove_pitch_angle": 0.35,
        "resistance_per_length": 67.0,
    },
    "tca.spec.TcaSpec.from_measured": {"**": lambda: {"fibre_length": 0.175, "coils": 60.0}},
    "tca.thread.FibreSpec": {"**": lambda: {
        field.name: getattr(good(tca_mj.TcaSpec).fibre, field.name)
        for field in fields(good(tca_mj.TcaSpec).fibre)
    }},
    "tca.materials.Material.fibre": {
        "radius": 2e-4, "inserted_twist": 4000.0, "line_density": 1e-4,
    },
    "tca.identify.bench.simulated_bench": {"rows": 5},
    "tca.identify.constants.with_constants": {"values": lambda: {"shear": 0.2e9}},
    "tca.identify.data.read_data": {"path": lambda: bench_file()},
    "tca.identify.data.write_data": {"path": "made.csv"},
    "tca.identify.identified.identify": {"free": ["shear"], "compare": False},
    "tca.identify.reporting.write_identification": {"out": "identified", "held_out": []},
    "tca.files.read_tca": {"path": lambda: muscle()}, "tca.files.write_tca": {"path": "made.json"},
    "tca.files.measured_tca": {"errors": {"coils": 0.5}, "**": lambda: {
        "fibre": good(tca_mj.TcaSpec).fibre, "rest_length": 0.05, "resistance": 3.0,
        "fibre_length": 0.175, "coils": 60.0,
    }},
    "tca.files.find_tca": {"tca": "free-stroke"},
    "tca.files.with_tca": {"robot": lambda: tca_mj.BendingSpec(), "tca": "free-stroke"},
    "tca.mandrel.kept_share": {"groove_pitch_angle": 0.35, "annealing_temperature": 180.0},
    "tca.supply.Supply.checked": {"n": 1},
    "variation.Nominal.apply": {"variation": lambda: variation.Variation()},
    "rod.problem.Spring.pull": {"way": [0.1, 0.0, 0.02]},
    "rod.beam.Outline.contains": {"x": 1e-3, "y": 1e-3},
    "agents.episode.Episode": {"names": (TASK, "off"), "out": None, "options": {}, "seed": 1},
    "agents.episode.Episode.run": {"limit": 0.2, "speed": 1.0, "progress": False},
    "agents.evaluate.cell": {"name": "return"}, "agents.evaluate.label": {"name": "return"},
    "agents.evaluate.figures": {"rows": [{"return": 1.0}]},
    "agents.policies.files.SavedPolicy.to_onnx": {"path": "network.onnx"},
    "agents.policies.load.saved_policy": {"source": "bend-reach"},
    "agents.policies.preprocessing.Statistics.read": {"path": lambda: statistics()},
    "agents.policies.sb3_zip.Model.parsed": {"content": lambda: model_zip()},
    "agents.policies.sb3_zip.Model.preprocessed": {"statistics": None, "units": None},
    "assets.mjcf": {"name": "arena.xml"},
    "envs.hanging.hang": {"place": (0.0, 0.0, 0.1), "turn": (1.0, 0.0, 0.0, 0.0),
                          "stand": "reach_stand"},
    "exported.frozen": {"sim": lambda: _exported()[0], "spec": lambda: _exported()[1]},
    "agents.policies.actors.scripted": {"env": lambda: task_env(TASK, action="power")},
    "agents.policies.load.load_policy": {
        "source": "bend-reach", "env": lambda: task_env(TASK, action="power"),
    },
    "agents.policies.load.require_arguments": {"arguments": {}},
    "agents.policies.gait.GaitPolicy.in_task": {
        "env": lambda: task_env("TCA/TetrapodWalk-v0", action="power"), "steering": 0.0,
    },
    "agents.scripts.arm.scripted": {"task": lambda: task_env("TCA/ArmPickPlace-v0").unwrapped},
    "agents.scripts.bistable_grasp.scripted": {
        "task": lambda: task_env("TCA/BistableGrasp-v0").unwrapped,
    },
    "agents.scripts.finger.scripted": {"task": lambda: task_env("TCA/FingerSense-v0").unwrapped},
    "agents.scripts.jump.scripted": {"task": lambda: task_env("TCA/Jump-v0").unwrapped},
    "agents.scripts.morph.scripted": {"task": lambda: task_env("TCA/MorphModule-v0").unwrapped},
    "agents.scripts.tetrapod.scripted": {"task": lambda: task_env("TCA/TetrapodWalk-v0").unwrapped},
    "agents.scripts.reach.scripted": {"task": lambda: task_env(TASK).unwrapped},
    "control.morph.ClosedLoop": {
        "pi": lambda: control.PiSpec(proportional=1.0, highest=2.0),
        "angle_of": lambda: math.sqrt,
    },
    "agents.policies.network.Network.alike": {
        "observation": lambda: _same(SavedPolicy.read(shipped_policy("bend-reach")).network.inputs),
        "action": lambda: _same(SavedPolicy.read(shipped_policy("bend-reach")).network.outputs),
    },
    "agents.policies.network.Network": {
        "weights": lambda: (np.ones((1, 2), np.float32),), "mean": lambda: np.zeros(2),
        "biases": lambda: (np.zeros(1, np.float32),), "var": lambda: np.ones(2),
    },
    "agents.policies.files.SavedPolicy.make": {"env": lambda: task_env(TASK, action="power")},
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
    "agents.design.robot_of": {"task": TASK, "design": lambda: {"length": 0.05}},
    "agents.design.designed": {"spec": lambda: tca_mj.BendingSpec(), "design": {}},
    "agents.demo.play": {"task": TASK, "max_duration": 0.2, "policy": "off", "video": False},
    "agents.evaluate.Evaluation": {"task": TASK},
    "agents.evaluate.run_episode": {"seed": 1},
    "agents.policies.actors.arguments_of": {"name": "off", "task": TASK},
    "agents.policies.actors.best_of": {"name": "off"},
    "agents.policies.actors.actor": {"name": "off"},
    **dict.fromkeys(("agents.policies.actors.first_gait", "agents.policies.actors.first_gaits"),
                    {"task": "TCA/TetrapodWalk-v0", "start": "scripted"}),
    "agents.policies.files.SavedPolicy": {
        "task": TASK, "**": lambda: {"network": good(Network)},
    },
    "agents.policies.files.SavedPolicy.save": {"path": "saved.npz"},
    "agents.policies.files.SavedPolicy.read": {"path": lambda: shipped_policy("bend-reach")},
    "agents.policies.load.find": {"source": "bend-reach"},
    "agents.scripts.tetrapod.gait_policy": {"gait": "walk"},
    "agents.sweep.Sweep": {"axes": {"seed": [1, 2]}},
    "agents.train.config.TrainConfig": {
        "task": TASK, "algorithm": "sac", "learner": lambda: _samples()[OffPolicy](),
    },
    "agents.train.config.default_config": {"task": TASK, "algorithm": "sac"},
    **dict.fromkeys(("agents.train.distil.DistilConfig", "agents.train.distil.distil_config"),
                    {"task": TASK, "teachers": lambda: (good(Teacher),)}),
    "agents.train.distil.Teacher": {"policy": "bend-reach"},
    "agents.train.search.SearchConfig": {"task": "TCA/TetrapodWalk-v0"},
    "agents.train.sb3_env.TaskVecEnv.make": {"id": TASK},
    "envs.wrappers.RecordRerun": {"path": "wrapped.rrd"},
    "agents.train.gait_space.GaitSpace": {"hottest": 172.0},
    "agents.train.gait_space.GaitSpace.encode": {"steering": (0.0,) * 4},
    "agents.train.gait_space.GaitSpace.decode": {"point": [0.5] * 28},
    "agents.train.gait_space.GaitSpace.fold": {"point": [0.5] * 28},
    "agents.model.data.collect": {
        "task": TASK, "**": lambda: {"episodes": 1, "steps": 3, "threads": 1},
    },
    "agents.model.data.Transitions": {
        field.name: lambda name=field.name: getattr(good(Transitions), name)
        for field in fields(Transitions)
    },
    "agents.model.data.Transitions.read": {"path": lambda: good(Transitions).save("steps.npz")},
    "agents.model.dynamics.View": {
        "made_for": lambda: good(View).made_for, "driven": ("TCA temperature",),
    },
    "agents.model.dynamics.TaskModel": {
        "kind": "split", "weights": lambda: good(TaskModel).weights,
    },
    "agents.model.dynamics.TaskModel.read": {"path": lambda: good(TaskModel).save("fitted.npz")},
    "agents.model.fit.prediction_errors": {
        "steps": 2, "output": lambda: lambda rows: rows["TCA temperature"],
    },
    "registry.make": {"task": TASK}, "registry.find_task": {"task": TASK},
    "registry.task_class": {"task": TASK}, "registry.recipes": {"task": TASK},
    "registry.episode_steps": {"task": TASK},
}  # fmt: skip


def good(hint: Any, name: str = "", surface: str = "") -> Any:
    """Something that an argument can be.

    Raises:
        NoSample: If nothing is known.
    """
    special = BY_SURFACE.get(surface, {})
    if name in special:
        return made(special[name])
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
        return made(BY_NAME[name])
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


def made(value: Any) -> Any:
    return value() if inspect.isfunction(value) else value


def _needed(kind: Any, surface: str = "") -> dict[str, Any]:
    parameters = parameters_of(kind).items()
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
    from tca_mj.agents.model import ByModel, Horizon, collect, fit_model
    from tca_mj.agents.model.predictive import Foresight
    from tca_mj.agents.policies import Policy, SavedPolicy, shipped
    from tca_mj.agents.policies.actors import Script, actor
    from tca_mj.agents.scripts.tetrapod import WALK
    from tca_mj.agents.train.config import TrainConfig
    from tca_mj.batch import SimulationBatch
    from tca_mj.drive import Drive
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
    from tca_mj.record.webpage import WebPage
    from tca_mj.rod import BeamSpec, Outline, Segment
    from tca_mj.routes import Helix, Route, UTurn
    from tca_mj.sim import Simulation
    from tca_mj.smp.lumped import LumpedModule
    from tca_mj.state import SimulationState, get_state
    from tca_mj.tca.design import Design, Designs, Space, Winding, Wish, find_designs
    from tca_mj.tca.identify import (
        Data,
        Followed,
        Identification,
        follow_log,
        identify,
        read_data,
    )
    from tca_mj.traces import TraceFit

    fibre = tca.CATALOGUE["free-stroke"]
    bank = cache(lambda: tca.TcaBank([fibre]))
    creeping = cache(lambda: tca.CreepBank([fibre]))
    watching = cache(lambda: tca.TcaObserver(bank()))
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
        made = task_env("TCA/BendReach-v0")
        made.reset(seed=0)
        return made

    def loop() -> control.ClosedLoop:
        return control.ClosedLoop(
            pi=control.PiSpec(proportional=1.0, highest=2.0), angle_of=lambda ohms: 0.1
        )

    measured = cache(lambda: read_data(bench_file(), fibre))
    identified = cache(lambda: identify([measured()], fibre, free=["shear"], compare=False))
    wish = Wish(stroke=8e-3, load=0.2, time=5.0, voltage=4.0)
    found = cache(lambda: find_designs(wish, population=20, generations=6))

    @cache
    def steps() -> Transitions:
        return collect(TASK, episodes=2, steps=4, arguments={"action": "power"}, threads=1)

    def view() -> View:
        return View(made_for=steps().made_for, driven=("TCA temperature",))

    muscles = [fibre]
    return {
        Transitions: steps, View: view, TaskModel: lambda: fit_model(steps(), view()),
        Foresight: lambda: ByModel(fit_model(steps(), view())), Horizon: Horizon,
        Data: measured, Identification: identified,
        TraceFit: lambda: TraceFit(
            values={"length": 0.05}, relative_error={"length": 0.1}, spread=1.0, expected=(),
            correlation=np.eye(1), freedom=10,
        ),
        Wish: lambda: wish, Space: Space, Designs: found, Design: lambda: found().best,
        Winding: lambda: found().best.winding,
        WebPage: lambda: WebPage(bent(), "sample.html"),
        tca.TcaSpec: lambda: fibre, tca.FibreSpec: lambda: fibre.fibre,
        tca.FibreSpec | tca.FibreTable: lambda: fibre.fibre,
        tca.Material: lambda: tca.MATERIALS["nylon monofilament"],
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
        Followed: lambda: follow_log(_logged(), fibre),
        tca.TcaObserver: watching, tca.Estimate: lambda: watching().begin([3.0]),
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
        control.TcaServo: lambda: control.TcaServo(watching(), good(tca.Thermostat)),
        LumpedModule: lumped, control.PiState: control.pi_rest,
        control.Gait: lambda: WALK, control.ClosedLoop: loop,
        control.MorphSequence: lambda: control.MorphSequence(drive=loop()),
        control.MorphState: lambda: control.MorphState(control.Phase.SOFTEN, 0.5),
        control.Phase: lambda: control.Phase.SOFTEN,
        control.Measurement: lambda: control.Measurement(25.0, 15.0),
        actuation.MuscleBank: bank,
        TaskVector: lambda: TaskVector(task_class(TASK), num_envs=2),
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
            env(), actor("off", env()), names=(TASK, "off"), seed=1, out=None, options={}
        ),
        Policy: lambda: actor("off", env()), Script: lambda: Script(act=lambda seen: seen),
        Constant: lambda: Constant(0.5),
        Option: lambda: Option(
            name="x", about="", draw=lambda *_: 0.5, drawn="", low=0.0, high=1.0
        ),
        Options: lambda: env().unwrapped.options, Watched: bent, Recorded: bent,
        Recorder: lambda: Recorder(bent(), "sample.rrd"), Film: lambda: Film(bent(), "sample.mp4"),
        Closing: lambda: Film(bent(), "sample.mp4"),
        Network: lambda: SavedPolicy.read(shipped_policy("bend-reach")).network,
        Path: lambda: Path("fuzzed"), str | Path: lambda: "fuzzed",
    }  # fmt: skip




def _same(count: int) -> Any:
    return np.arange(count), np.ones(count, np.float32)  # a mirror in which nothing is another


@cache
def task_env(id: str, **arguments: Any) -> Any:
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
    "class": lambda: bool,
    "a TCA": lambda: good(tca_mj.TcaSpec), "a beam": lambda: good(tca_mj.BeamSpec),
    "a route": lambda: good(tca_mj.Helix), "an arm": lambda: tca_mj.ArmSpec(),
    "a fibre": lambda: good(tca_mj.TcaSpec).fibre, "path": lambda: Path("nowhere"),
}  # fmt: skip


def spread_of(surface: str) -> dict[str, Any]:
    """What a surface needs besides the parameters that it names."""
    more: dict[str, Any] = made(BY_SURFACE.get(surface, {}).get("**", {}))
    return more


def hostile_of(kind: Any) -> Any:
    """What a case says is hostile: a value, or the name of one in ``HOSTILE``."""
    return HOSTILE[kind]() if isinstance(kind, str) else kind

"""Calls what the package offers with hostile arguments, and judges what comes of it.

``surfaces`` walks what the packages offer and finds functions, constructors, class methods and
methods, whoever adds one; of the tasks in the registry the arguments, the options of ``reset``,
the figures of the robot and the action, alone and side by side; and the files that are read. A
call gets what its annotations ask for, but for an argument or two that are hostile: not a number,
huge, of a wrong kind, shape or specification. It may return something without a NaN, or raise
``ValueError`` with name, value and bound, or what its docstring says under ``Raises:``, within
30 s.

``python tests/fuzzing.py 10000 FOLDER`` tries ten thousand cases, goes on where it was stopped,
and prints a table.
"""

import faulthandler
import inspect
import json
import math
import os
import re
import resource
import signal
import sys
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_files import READERS, damages, spoilt
from fuzz_samples import HOSTILE, SEVERAL, good, hostile_of, parameters_of, spread_of
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from test_names import offered

import tca_mj
from tca_mj import checks
from tca_mj.agents.design import designed
from tca_mj.envs.task import TaskArguments
from tca_mj.envs.vector import TaskVector
from tca_mj.pages import table
from tca_mj.registry import TASKS, task_class
from tca_mj.registry import find_task as task_spec

SECONDS = 30  # of computing, longest time of a case; ten times that on the clock
MEMORY = 16 << 30  # address space that a case may take besides [bytes]

# What is no door, and why: modules, things in them, and with a star all methods in them.
_PROGRAM = "a program that runs for minutes"
_KERNEL = "a kernel: arrays of numbers that were checked"
_SCREEN = "needs a screen"
_ACTS = "acts on what a task has shown"
NO_DOOR = {
    **dict.fromkeys(
        ("bench", "validation", "certify", "cli", "agents.train.deep", "agents.train.search.search",
         "agents.sweep.Trial", "agents.sweep.run_sweep", "traces.fit_traces"), _PROGRAM),
    **dict.fromkeys(
        (
            "tca.laws.rod.CoilRods.unsoftened", "tca.laws.rod.CoilRods.finished",
            "tca.laws.rod.CoilRods.torsion_per_tension", "tca.thermal.HeatStep.advance",
            "sim.Simulation.take", "sim.Simulation.snaps",
            "tca.dynamics.stepping.LoadedTcas.heated",
            "tca.dynamics.stepping.LoadedTcas.pull", "tca.supply.Supply.power",
            "tca.dynamics.stepping.LoadedTcas.check_domain", "tca.laws.creep.CreepBank.law",
            "tca.laws.rod.CoilRods.crept",
            "tca.supply.Supply.like", "actuation",
            *(f"agents.model.dynamics.{name}" for name in (
                "View.lift", "View.scaled", "View.remember", "View.read", "View.states",
                "TaskModel.begin", "TaskModel.advance", "TaskModel.predict",
            )),
            "smp.bank.SpineBank.advance", "envs.options.Uniform.__call__",
            "envs.options.Constant.__call__",
        ),
        _KERNEL,
    ),
    **dict.fromkeys(
        (
            "agents.model.predictive.*", "agents.model.predictive.Predictive",
            "agents.policies.files.NetworkPolicy", "agents.policies.files.ResidualPolicy",
            "agents.policies.files.with_clock", "agents.policies.gait.GaitPolicy.act",
            "agents.policies.network.Network.__call__", "agents.scripts.arm.PickAndPlace.act",
            "agents.scripts.finger.FingerPolicy.act",
            "agents.scripts.morph.MorphPolicy.act", "agents.scripts.reach.ReachPolicy.act",
            "agents.scripts.course.CourseWalker", "agents.policies.gait.GaitPolicy.told_of",
            "agents.scripts.adaptive.AdaptivePolicy.act", "agents.scripts.grasp.GraspPolicy.act",
            "agents.scripts.jump.JumpPolicy.act",
            "agents.scripts.bistable_grasp.BistableGraspPolicy.act",
            "envs.wrappers.*", "envs.table.Table.scaled", "envs.table.Table.mirrored",
            "envs.table.Table.read", "envs.table.Table.outside", "envs.table.Table.bounded",
            "envs.task", "envs.vector", "agents.train.sb3_env.*", "agents.policies.actors.Blind",
            "agents.rollout", "agents.scripts.guided", "agents.train.mirrored",
            "agents.train.successes",
            "envs.command.Following", "envs.command.Retelling.notes", "envs.command.Retelling.told",
        ),
        _ACTS,
    ),
    **dict.fromkeys(("envs.viewer", "record.render.Offscreen", "record.film.Film.frame",
                     "record.render.gl_backend"), _SCREEN),
}  # fmt: skip
# Where not a number is what a result says, as its docstring does.
NAN_MEANS_NONE = ("tca.bank.TcaBank.signals",)
# Words by which messages call parameters.
SAID_AS = {
    "given": "options", "temperatures": "temperature", "drives": "drive", "value": "x",
    "command": "power", "arena": "path", "chains": "joints", "routes": "tensions",
}
# Kinds of surfaces, as they are counted.
CONSTRUCTOR, FUNCTION, METHOD = "constructors", "functions and class methods", "methods"
ARGUMENTS, OPTIONS, ACTION = "arguments of tasks", "options of `reset`", "actions"
ROBOT, VECTOR, FILE = "specifications of robots", "vector environments", "files that are read"


class Hangs(BaseException):
    """A case took longer than ``SECONDS``."""


@dataclass(frozen=True)
class Surface:
    """What is called: its name, what it is, the function, and the kind of object it is a method of.

    ``named`` are parameters that the function takes as ``**named``: for each what is hostile to it,
    or values near which things become wrong.
    """

    name: str
    kind: str
    function: Callable[..., Any]
    owner: Any = None
    errors: frozenset[str] = frozenset()
    named: Mapping[str, Any] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, tuple[Any, Any]]:
        """Annotation and default of each parameter by name."""
        if self.named:
            return {name: (Any, None) for name in self.named}
        return parameters_of(self.function)

    def call(self, arguments: Mapping[str, Any]) -> Any:
        given = dict(arguments)
        before = () if self.owner is None else (good(self.owner, "self", self.name),)
        several = tuple(given.pop(n) for n, (_, d) in self.parameters.items() if d is SEVERAL)
        return self.function(*before, *several, **given)


def surfaces() -> list[Surface]:
    """All there is."""
    return [*_of_packages(), *_of_tasks(), *_of_files()]


def _of_packages() -> Iterator[Surface]:
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
            yield Surface(name, FUNCTION, thing, errors=_errors(thing))


def _of_tasks() -> Iterator[Surface]:
    """What can be said to the tasks of the registry."""
    vector = dict.fromkeys(
        ("num_envs", "num_threads", "max_episode_steps", "autoreset_mode", "reset_options"), ()
    )
    for id in (task.id for task in TASKS):
        kind, task = task_class(id), _task(id)
        known = dict.fromkeys([*parameters_of(kind), *TaskArguments.__annotations__], ())
        yield Surface(f"{id} arguments", ARGUMENTS, partial(_constructed, id), named=known)
        rows = {row.name: _near(row.low, row.high) for row in task.options.rows}
        yield Surface(f"{id} options", OPTIONS, partial(_begun, id), named={"seed": ()} | rows)
        n = task.action.size
        yield Surface(f"{id} action", ACTION, partial(_acted, id), named={"action": _full(n)})
        robot = {
            path: tuple(type(value)(factor * value) for factor in (0.1, 0.4, 0.8, 1.3, 2.5, 10.0))
            for path, value in figures(kind.robot_argument[1]())
        }
        yield Surface(f"{id} robot", ROBOT, partial(_robot, id), named=robot)
        yield Surface(f"{id} vector", VECTOR, partial(_vector, id), named=vector)
        said = {
            "options": _said(task.options.names), "seed": ([0, None], [1]), "actions": _full(2, n),
        }
        yield Surface(f"{id} vector reset and step", VECTOR, partial(_together, id), named=said,
                      errors=_errors(TaskVector.reset))  # fmt: skip


def _of_files() -> Iterator[Surface]:
    for name in READERS:
        yield Surface(name, FILE, partial(_read, name), errors=frozenset({"SimulationDiverged"}),
                      named={"content": damages()})  # fmt: skip


def _read(name: str, content: Any = None) -> Any:
    return None if content is None else spoilt(name, content)


def _full(*shape: int) -> tuple[Any, ...]:
    """Actions: some that are, and some out of bounds or shape."""
    values = (-1.1, -1.0, 0.3, 1.0, np.nan)
    others = np.zeros((*shape, 1)), np.zeros(shape[1:])
    return (*(np.full(shape, value) for value in values), *others)


def _said(names: Sequence[str]) -> tuple[Any, ...]:
    """Options of two tasks: for both, for each, for one of them, and wrong ones."""
    mask = np.array([True, False])
    wrong = mask.astype(float), [True, False], mask[:1], 1
    each = [{name: value} for name in names for value in (math.nan, "x", 0.1)]
    masks = [{"reset_mask": m} for m in (mask, ~mask, *wrong)]
    return (*each, *masks, [{}, None], [{}], [None, 1], [{"nothing": 1.0}, {}])


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


@cache
def _two(id: str) -> Any:
    tasks = TaskVector(task_class(id), num_envs=2, **task_spec(id).kwargs)
    tasks.reset(seed=0)
    return tasks


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


def _acted(id: str, **said: Any) -> Any:
    task = _task(id)
    task.reset(seed=0)
    outcome = task.step(said.get("action", task.action.still))
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


def _together(id: str, **said: Any) -> Any:
    tasks = _two(id)
    begun = tasks.reset(seed=said.get("seed", 0), options=said.get("options"))
    outcome = tasks.step(said.get("actions", np.stack([_task(id).action.still] * 2)))
    for seen in (begun[0], outcome[0]):
        assert tasks.observation_space.contains(seen), seen
    return begun, outcome


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
        yield Surface(name, CONSTRUCTOR, kind, errors=_errors(kind) | _errors(kind.__init__))
    for key, member in vars(kind).items():
        if (key.startswith("_") and key != "__call__") or f"{name}.{key}" in NO_DOOR:
            continue
        if isinstance(member, classmethod | staticmethod):
            bound = getattr(kind, key)
            yield Surface(f"{name}.{key}", FUNCTION, bound, errors=_errors(bound))
        elif inspect.isfunction(member) and f"{name.rpartition('.')[0]}.*" not in NO_DOOR:
            yield Surface(f"{name}.{key}", METHOD, member, owner=kind, errors=_errors(member))


def _errors(function: Any) -> frozenset[str]:
    """Names of the errors under ``Raises:`` in a docstring."""
    said = re.search(r"Raises:\n(.*)", function.__doc__ or "", re.DOTALL)
    return frozenset(re.findall(r"\b[A-Z]\w+(?=[,:])", said.group(1))) if said else frozenset()


def hostile(near: Any = ()) -> st.SearchStrategy[Any]:
    """What an argument may be that nobody has asked for; a text is a name in ``HOSTILE``."""
    if isinstance(near, st.SearchStrategy):
        return near
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


def each_argument(surface: Surface, turn: int = 0) -> Iterator["Case"]:
    """A case for each argument, in which it is something strange; another turn has others."""
    strange = sorted(HOSTILE)
    for name in surface.parameters:
        if not isinstance(surface.named.get(name), st.SearchStrategy):
            start = zlib.crc32(f"{surface.name} {name}".encode())
            yield Case(surface, {name: strange[(start + turn) % len(strange)]})


def tried(surface: Surface, count: int, turn: int = 0) -> list["Outcome"]:
    """What comes of so many cases, the same ones each time; another turn has others."""
    found: list[Outcome] = []

    @seed(zlib.crc32(f"{surface.name} {turn}".encode()))
    @settings(max_examples=count, phases=[Phase.generate], database=None, deadline=None,
              suppress_health_check=list(HealthCheck))
    @given(cases(surface))
    def one(case: Case) -> None:
        found.append(case.outcome())

    one()
    return found


@dataclass(frozen=True)
class Outcome:
    """A case in words, whether it was refused, and what is wrong with that; empty if nothing is."""

    case: str
    refused: bool
    fault: str = ""


@dataclass
class Case:
    """A call: which arguments are hostile, and with what; the others are good."""

    surface: Surface
    hostile: dict[str, Any] = field(default_factory=dict)

    def arguments(self) -> dict[str, Any]:
        given = dict(spread_of(self.surface.name))
        for name, (hint, default) in self.surface.parameters.items():
            needed = default is inspect.Parameter.empty or default is SEVERAL
            if name not in self.hostile and needed:
                given[name] = good(hint, name, self.surface.name)
        return given | {name: hostile_of(kind) for name, kind in self.hostile.items()}

    @property
    def about(self) -> str:
        """The case in words."""
        said = {name: kind if isinstance(kind, str) else checks.shown(kind)
                for name, kind in self.hostile.items()}  # fmt: skip
        return f"{self.surface.name} with {said}"

    def outcome(self) -> Outcome:
        """What comes of it."""
        arguments = self.arguments()
        try:
            with guarded():
                result = self.surface.call(arguments)
                if inspect.isgenerator(result):
                    result = next(result, None)
                where = nan_in(result)
        except Hangs:
            return Outcome(self.about, False, f"takes longer than {SECONDS} s")
        except (KeyboardInterrupt, SystemExit):
            raise
        except ValueError as error:
            return Outcome(self.about, True, self._style(str(error)))
        except BaseException as error:  # of a library in another language, too
            names = {kind.__name__ for kind in type(error).__mro__}
            said = "" if names & self.surface.errors else f"{type(error).__name__}: {error}"[:300]
            return Outcome(self.about, not said, said)
        expected = self.surface.name in NAN_MEANS_NONE
        return Outcome(self.about, False, f"NaN in {where}" if where and not expected else "")

    def _style(self, said: str) -> str:
        """What a refusal does not say; empty if it says what is wrong."""
        if len(said) > 1000:
            return f"ValueError of {len(said)} letters: {said[:200]}"
        if self.surface.kind == FILE:
            named = any(word in said for word in _FILES)
            return "" if named else f"ValueError names no file: {said}"[:300]
        if not ("must" in said and "got" in said or _OF_A_FILE.search(said)):
            return f"ValueError without must and got: {said}"[:300]
        names = [name.rpartition(".")[2] for name in self.surface.parameters]
        words = {word for name in names for word in (name, SAID_AS.get(name, name))}
        words |= {"fuzzed"} if _OF_A_FILE.search(said) else set()  # the file's name
        kinds = [hostile_of(kind) for kind in self.hostile.values()]
        derived = any(isinstance(kind, int | float) for kind in kinds)  # what follows from it
        said_of = [each for kind in kinds for each in (kind if isinstance(kind, list) else [kind])]
        words |= {str(key) for each in said_of if isinstance(each, Mapping) for key in each}
        if not (derived or any(word in said for word in words)):
            return f"ValueError names none of {names}: {said}"[:300]
        return ""


# How a file is refused: by its path, with what is wrong with it.
_OF_A_FILE = re.compile(r"is no (policy|model|data set)|has no statistics|must be trusted")
_FILES = ("spoilt", "path", "source", "part", "run.json", "state.pkl", "result.json")


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

    before = [signal.signal(which, late) for which in (signal.SIGPROF, signal.SIGALRM)]
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    signal.setitimer(signal.ITIMER_REAL, 10 * SECONDS)
    faulthandler.dump_traceback_later(20 * SECONDS, exit=True, file=sys.__stderr__)
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
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        for which, handler in zip((signal.SIGPROF, signal.SIGALRM), before, strict=True):
            signal.signal(which, handler)


def main(count: int, folder: Path) -> int:
    """Tries at least so many cases, a surface and a turn at a time, and prints what came of them.

    What is done is kept in ``cases.jsonl``; what a process did not survive is a fault.
    """
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)
    notes = Path("cases.jsonl")
    rows = [json.loads(line) for line in notes.read_text().splitlines()] if notes.exists() else []
    begun = {(row["surface"], row["turn"]) for row in rows}
    done = sum(len(row.get("outcomes", ())) for row in rows)
    every = surfaces()
    with notes.open("a", buffering=1) as file:
        turn = 0
        while done < count:
            for surface in (each for each in every if (each.name, turn) not in begun):
                about = {"surface": surface.name, "kind": surface.kind, "turn": turn}
                file.write(json.dumps(about) + "\n")
                found = [case.outcome() for case in each_argument(surface, turn)]
                found += tried(surface, PER_TURN[surface.kind], turn)
                outcomes = [(each.case, each.refused, each.fault) for each in found]
                file.write(json.dumps(about | {"outcomes": outcomes}) + "\n")
                done += len(found)
            turn += 1
    return report([json.loads(line) for line in notes.read_text().splitlines()])


PER_TURN = {FILE: 60, ACTION: 20, VECTOR: 10} | dict.fromkeys(
    (CONSTRUCTOR, FUNCTION, METHOD, ARGUMENTS, OPTIONS, ROBOT), 8
)


def report(rows: Sequence[dict[str, Any]]) -> int:
    """Prints faults and the table, and returns the number of faults."""
    whole = {(row["surface"], row["turn"]): row for row in rows if "outcomes" in row}
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in PER_TURN}
    names: dict[str, set[str]] = {kind: set() for kind in PER_TURN}
    for row in rows:
        count = counts[row["kind"]]
        names[row["kind"]].add(row["surface"])
        if "outcomes" not in row and (row["surface"], row["turn"]) not in whole:
            print(f"{row['surface']}, turn {row['turn']}: ended the process")
            count["faults"] += 1
        for case, refused, fault in row.get("outcomes", ()):
            count["cases"] += 1
            count["faults" if fault else "refused" if refused else "accepted"] += 1
            if fault:
                print(f"{case}: {fault}")
    columns = ("cases", "refused", "accepted", "faults")
    counts["together"] = sum(counts.values(), Counter())
    names["together"] = set().union(*names.values())
    lines = [[kind, str(len(names[kind])), *(str(counts[kind][c]) for c in columns)]
             for kind in counts]  # fmt: skip
    print("\n".join(table(["what", "of them", *columns], lines)))
    return counts["together"]["faults"]


if __name__ == "__main__":
    sys.exit(min(1, main(int(sys.argv[1]), Path(sys.argv[2]))))

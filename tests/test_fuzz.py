"""Whatever an argument or a file is, it is refused by name and bound or does what it should.

``tests/fuzzing.py`` has the walk and the judge; ``pytest -m long tests/test_fuzz.py`` tries ten
thousand cases, and ``python tests/fuzzing.py COUNT FOLDER`` as many as you like.
"""

import inspect
import math
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import fuzzing
import numpy as np
import pytest
from fuzzing import (
    ACTION,
    ARGUMENTS,
    CONSTRUCTOR,
    FILE,
    FUNCTION,
    METHOD,
    NO_DOOR,
    OPTIONS,
    PER_TURN,
    ROBOT,
    VECTOR,
    Case,
    Surface,
    each_argument,
    figures,
    surfaces,
    tried,
)

import tca_mj
from tca_mj.registry import TASKS, task_class

# Cases of a surface besides one for each argument, in the ordinary run.
FEW = {FILE: 24, ACTION: 6, VECTOR: 4} | dict.fromkeys(
    (CONSTRUCTOR, FUNCTION, METHOD, ARGUMENTS, OPTIONS, ROBOT), 3
)
EVERY = surfaces()


@pytest.fixture(scope="module", autouse=True)
def somewhere(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What is written lies apart, and samples that are files stay for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("fuzz"))
        yield


def of_kind(kind: str) -> list[Surface]:
    return [surface for surface in EVERY if surface.kind == kind]


@pytest.mark.parametrize("kind", FEW)
def test_what_is_hostile_is_refused_or_harmless(kind):
    faults, refused, accepted = [], 0, 0
    for surface in of_kind(kind):
        found = [case.outcome() for case in each_argument(surface)]
        assert kind == FILE or len(found) == len(surface.parameters)
        for outcome in [*found, *tried(surface, FEW[kind])]:
            faults += [f"{outcome.case}: {outcome.fault}"] if outcome.fault else []
            refused, accepted = refused + outcome.refused, accepted + (not outcome.refused)
    assert not faults, "\n".join(faults)
    assert refused and accepted  # else nothing gets in, or nothing is tried


@pytest.mark.parametrize("kind", FEW)
def test_good_arguments_are_accepted(kind):
    """Else a hostile one might be refused for the sake of another."""
    found = [(s.name, Case(s).outcome()) for s in of_kind(kind)]
    assert [(name, o.fault) for name, o in found if o.refused or o.fault] == []


def test_nothing_is_left_out():
    """As many surfaces as there were, and every task with all its options and figures."""
    counts = Counter(surface.kind for surface in EVERY)
    least = {CONSTRUCTOR: 80, FUNCTION: 145, METHOD: 115, FILE: 12}
    assert {kind: counts[kind] for kind in least if counts[kind] < least[kind]} == {}
    named = {surface.name: set(surface.named) for surface in EVERY}
    for task in TASKS:
        made = tca_mj.make(task.id).unwrapped
        assert named[f"{task.id} options"] == {"seed", *made.options.names}
        robot = dict(figures(task_class(task.id).robot_argument[1]()))
        assert robot and named[f"{task.id} robot"] == set(robot)
        arguments = inspect.signature(task_class(task.id)).parameters.values()
        own = {p.name for p in arguments if p.kind is not p.VAR_KEYWORD}
        assert named[f"{task.id} arguments"] >= own | {"action", "control_period", "size"}
        assert f"{task.id} action" in named and f"{task.id} vector reset and step" in named
    assert len(set(named)) == len(EVERY)


def _exists(name: str) -> bool:
    """Whether something of the package has a name: a module, or what is in one, or in a class."""
    thing: Any = tca_mj
    for part in name.split("."):
        path = getattr(thing, "__path__", None)
        if path is not None and find_spec(f"{thing.__name__}.{part}") is not None:
            thing = import_module(f"{thing.__name__}.{part}")
        else:
            thing = getattr(thing, part, None)
    return thing is not None


def test_what_is_no_door_exists():
    """A name that is left out is one of what the package has."""
    assert [name for name in NO_DOOR if not _exists(name.removesuffix(".*"))] == []


class Careless:
    """Functions that are wrong, each in one way."""

    @staticmethod
    def unchecked(length: float) -> float:
        return length / 0.1

    @staticmethod
    def unnamed(length: float) -> float:
        raise ValueError("a value is wrong")

    @staticmethod
    def undocumented(length: float) -> float:
        raise KeyError("length")

    @staticmethod
    def unending(length: float) -> float:
        while True:
            pass

    @staticmethod
    def nothing(length: float) -> dict[str, Any]:
        return {"found": [np.array([1.0, math.nan])]}


@pytest.mark.parametrize(
    ("name", "fault"),
    [("unchecked", "TypeError"), ("unnamed", "without must and got"), ("undocumented", "KeyError"),
     ("unending", "takes longer"), ("nothing", "NaN in result['found'][0]")],
)  # fmt: skip
def test_the_judge_finds(name, fault, monkeypatch):
    monkeypatch.setattr(fuzzing, "SECONDS", 1)
    surface = Surface(name, FUNCTION, getattr(Careless, name))
    assert fault in Case(surface, {"length": "text"}).outcome().fault


def test_cases_are_the_same_each_time():
    surface = next(surface for surface in EVERY if surface.name == "tca.spec.TcaSpec")
    first, again, other = tried(surface, 9), tried(surface, 9), tried(surface, 9, turn=1)
    assert first == again != other


@pytest.mark.long
def test_ten_thousand_cases():
    assert fuzzing.main(10_000, Path("ten-thousand")) == 0


def test_every_kind_is_counted():
    assert set(FEW) == set(PER_TURN) == {surface.kind for surface in EVERY}

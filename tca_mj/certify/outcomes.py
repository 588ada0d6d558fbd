"""Every case of a module answered by theory and by MuJoCo, and what many of them say together."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tca_mj.agents.workers import Workers
from tca_mj.certify.cases import (
    Case,
    Gap,
    as_run,
    at_rest,
    bent,
    draw,
    gap,
    shapes,
    theory,
    tips_of,
)
from tca_mj.certify.rest import Rest
from tca_mj.certify.subjects import SUBJECTS, Subject
from tca_mj.drive import SimulationDiverged
from tca_mj.model import NotSettledError
from tca_mj.rod import RodSolveError
from tca_mj.tca import TcaSpec

POSITION, ROTATION = 0.01, np.radians(2.0)  # what a default number of nodes is allowed
TIMES = (1, 2, 4)  # multiples of the default nodes by which the order is measured
_ELSEWHERE = 0.05  # error from which on the chain rests in another state [1]


class Effort(NamedTuple):
    """How many cases of each module are drawn, and how many of them are looked at more closely.

    Attributes:
        cases: Cases by theory and by MuJoCo at the default nodes.
        finer: The first of them, with two and four times the nodes too.
        runs: The first of them, as a simulation that is heated from the cold too.
        solvers: The first of them, by the other solver of the theory too.
    """

    cases: int = 60
    finer: int = 10
    runs: int = 6
    solvers: int = 20


# What ``tca-mj certify`` does.
FULL = Effort()


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """One case. What was not asked or not found is None.

    Attributes:
        temperature: Temperatures of the TCAs [°C].
        posture: How the base is held.
        force: Size of the force on a tip [N].
        moment: Size of the moment on a tip [N m].
        bend: Angle by which the tip is turned from the unloaded shape, by theory [rad].
        gap: MuJoCo at the default nodes from theory.
        finer: The same at ``TIMES`` the default nodes.
        elsewhere: Whether the chain, left alone, sinks to another state than that which theory
            found; ``gap`` is then that of the chain's state next to the latter.
        shear: The theory with shear from that without.
        run: The simulation, heated from the cold, from the module at rest.
        velocity: Largest velocity of a joint that the simulation has left [rad/s].
        solver: Which solver of the theory found the state; "energy" where "shooting" did not.
        solvers: Largest distance of a tip between the two solvers of the theory [m].
        split: Where these found two different states instead: how far the chain's state next to
            that of "energy" is from it [1].
        failure: Why there is no gap.
        seconds: Processor time [s].
    """

    temperature: tuple[float, ...]
    posture: str
    force: float
    moment: float
    bend: float | None = None
    gap: Gap | None = None
    finer: tuple[Gap, ...] | None = None
    elsewhere: bool = False
    shear: Gap | None = None
    run: Gap | None = None
    velocity: float | None = None
    solver: str = "shooting"
    solvers: float | None = None
    split: float | None = None
    failure: str | None = None
    seconds: float = 0.0


def judge(subject: Subject, case: Case, number: int, effort: Effort) -> Outcome:
    """Answers one case.

    Args:
        subject: The module.
        case: The case.
        number: Its number: the first ones are looked at more closely.
        effort: How many those are.
    """
    begin = time.process_time()
    asked: dict[str, Any] = {
        "temperature": tuple(float(each) for each in case.temperature),
        "posture": case.posture,
        "force": float(np.linalg.norm(case.load.force[0])),
        "moment": float(np.linalg.norm(case.load.moment[0])),
    }
    found: dict[str, Any] = {}
    try:
        exact, found["bend"], found["solver"] = _exact(subject, case)
        alone = chain = at_rest(subject, case)
        found["gap"] = gap(subject, chain, exact)
        near = found["solver"] if found["gap"].position > _ELSEWHERE else None
        if near is not None:
            found["elsewhere"] = True
            chain = at_rest(subject, case, near=near)
            found["gap"] = gap(subject, chain, exact)
        found["shear"] = _shear(subject, case, exact)
        if number < effort.finer:
            finer = [at_rest(subject, case, times, near=near) for times in TIMES[1:]]
            found["finer"] = tuple(gap(subject, each, exact) for each in (chain, *finer))
        if number < effort.runs:
            end, found["velocity"] = as_run(subject, case)
            found["run"] = gap(subject, end, alone)
        if number < effort.solvers and found["solver"] == "shooting":
            other = theory(subject, case, solver="energy")
            if gap(subject, other, exact).position > _ELSEWHERE:
                chain = at_rest(subject, case, near="energy")
                found["split"] = gap(subject, chain, other).position
            else:
                away = np.linalg.norm(other.position - exact.position, axis=1)
                found["solvers"] = float(away.max())
    except (RodSolveError, NotSettledError, SimulationDiverged) as error:
        found["failure"] = str(error)
    return Outcome(**asked, **found, seconds=time.process_time() - begin)


def _exact(subject: Subject, case: Case) -> tuple[Rest, float, str]:
    """What theory answers, how far the tips are bent, and which solver has found it."""
    solver = subject.solver
    try:
        found = list(shapes(subject, case, solver=solver))
    except RodSolveError:
        if solver == "energy":
            raise
        solver = "energy"
        found = list(shapes(subject, case, solver=solver))
    return tips_of(subject, case, found), bent(subject, found), solver


def _shear(subject: Subject, case: Case, exact: Rest) -> Gap | None:
    """What shear would change; a body that shears may rest in another state."""
    try:
        change = gap(subject, theory(subject, case, shearable=True), exact)
    except RodSolveError:
        return None
    return change if change.position < _ELSEWHERE else None


def outcomes(
    names: Sequence[str], *, effort: Effort = FULL, seed: int = 0, workers: int = 1,
    progress: Callable[[], Any] = lambda: None, tca: TcaSpec | None = None,
) -> dict[str, list[Outcome]]:  # fmt: skip
    """Answers the cases of some modules.

    Args:
        names: Some of ``SUBJECTS``.
        effort: How much.
        seed: Of the cases.
        workers: Processes that share the work; it has no influence on the outcomes.
        progress: Called after every case.
        tca: The modules' muscle; None for their own.
    """
    tasks = [(name, number) for number in range(effort.cases) for name in names]
    answer = partial(_one, effort=effort, seed=seed, tca=tca)
    found: dict[int, Outcome] = {}
    with Workers(workers) as processes:
        for number, outcome in processes.run(answer, [(task,) for task in tasks]):
            found[number] = outcome
            progress()
    each = [(name, found[number]) for number, (name, _) in enumerate(tasks)]
    return {name: [outcome for of, outcome in each if of == name] for name in names}


def _one(task: tuple[str, int], effort: Effort, seed: int, tca: TcaSpec | None) -> Outcome:
    name, number = task
    subject = SUBJECTS[name](tca)
    return judge(subject, draw(subject, name, number + 1, seed)[-1], number, effort)

"""Black-box search for gaits: CMA-ES over the figures of a gait, in processes or on a cluster.

In every generation the scripted gait walks the same episodes as the others, which are scored
against it. Nothing depends on how many processes there are, on the order in which they finish, or
on whether the run was interrupted: all draws of a generation come from the seed and its number.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from tca_mj.agents.cluster import ClusterWorkers
from tca_mj.agents.design import robot_of
from tca_mj.agents.output import write_csv
from tca_mj.agents.policies import SavedPolicy
from tca_mj.agents.policies.actors import TROT, first_gait
from tca_mj.agents.policies.contracts import contract, differences
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.train.config import Few, LearnerSeed, Many, Steps
from tca_mj.agents.train.gait_score import (
    Headway,
    Reference,
    Trial,
    run_trial,
    score,
    walking,
)
from tca_mj.agents.train.gait_space import GaitSpace
from tca_mj.agents.train.runs import CURVE, RunFolder, drawn
from tca_mj.agents.workers import Processes, Workers
from tca_mj.checks import Checked, door, number, whole
from tca_mj.control import Gait
from tca_mj.files import claimed
from tca_mj.registry import task_class
from tca_mj.tca import find_tca

BEST, LAST = "best.json", "last.json"

Found = list[list[Headway]]
Steered = tuple[Gait, tuple[float, ...]]  # a gait and its steering


@dataclass(frozen=True, kw_only=True, slots=True)
class SearchConfig(Checked):
    """Settings of a search.

    Attributes:
        task: Gymnasium id of a task with four legs that a gait can drive.
        steps: Control steps of all episodes together after which no generation begins, up to a
            billion.
        seed: Seed of everything that is drawn, below 2**32.
        start: Where the search begins: ``scripted``, ``trot``, or a policy's file or name.
        sigma: First step size, the cube of all gaits having edges of 1 [1]. With 0.03 one in five
            gaits about the scripted walk is better than it, with 0.1 none.
        population: Gaits per generation, 5 to 10 000.
        episodes: Episodes per gait, the same for all of a generation, up to 10 000.
        options: Options of every episode; a robot of its own has ``randomise`` 0 and its numbers.
        tca: The robot's muscle, a file or a name in ``tca_mj.CATALOGUE``; None for its own.
        design: Figures of the robot that differ from the default, see
            ``tca_mj.agents.design.robot_of``.
        settling: Time of each episode that is not judged, as in ``Trial`` [s].
        window: Time that is judged [s].
        validate_every: Generations after which the middle of the search is judged, by the same
            episodes each time; the best in these is what the search finds.
        validation_episodes: How many these are, up to 10 000.

    Raises:
        ValueError: If a field is out of range.
    """

    task: str
    steps: Steps = 150_000
    seed: LearnerSeed = 0
    start: str = "scripted"
    sigma: Annotated[float, partial(number, above=0.0, at_most=0.5)] = 0.03
    population: Annotated[int, partial(whole, at_least=5, at_most=10_000)] = 14
    episodes: Few = 1
    options: Mapping[str, float] = field(default_factory=lambda: {"randomise": 0.2})
    settling: Annotated[float, partial(number, at_least=0.0, at_most=20.0, unit="s")] = 10.0
    window: Annotated[float, partial(number, at_least=0.1, at_most=25.0, unit="s")] = 20.0
    validate_every: Many = 8
    validation_episodes: Few = 8
    tca: str | None = None
    design: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.design:
            robot_of(self.task, self.design)
        if task_class(self.task).legs != len(TROT):
            raise ValueError(f"task must have four legs that a gait can drive, got {self.task!r}")


@dataclass(frozen=True, kw_only=True, slots=True)
class SearchState:
    """Where a search stands. A step of the search makes a new one.

    Attributes:
        optimiser: Its distribution.
        reference: The scripted gait in the validation's episodes.
        generation: Generations that are finished.
        steps: Control steps so far.
        best: The best score in the validation's episodes, and its point.
        rows: The curve.
    """

    optimiser: CMA
    reference: Reference | None = None
    generation: int = 0
    steps: int = 0
    best: tuple[float, NDArray[np.float64]] | None = None
    rows: tuple[dict[str, float | int], ...] = ()


@door
def search(
    config: SearchConfig, out: Path, *, workers: Processes = 2, command: str = "",
    progress: bool = True, address: str | None = None,
) -> SavedPolicy:
    """Searches for a gait, or goes on with the search that ``out`` holds.

    Into ``out`` go ``run.json``, ``state.pkl``, ``curve.csv``, ``best.json`` (the best gait so far
    by the validation's episodes), ``last.json`` (the middle of the search) and ``tensorboard``. The
    state is replaced after every generation, and after Ctrl-C with the episodes that are finished.

    Args:
        config: The settings.
        out: Folder of the run.
        workers: Processes that run episodes; no result depends on it.
        command: What to note as the command.
        progress: Whether to show how far it is.
        address: Of a running Ray cluster, whose cores run the episodes instead of ``workers``, as
            ``ray.init`` takes it.

    Returns:
        The best gait.

    Raises:
        ImportError, ConnectionError: If Ray is not installed, or there is no cluster at
            ``address``.
        FileNotFoundError, ValueError: If the settings do not fit, or not to the run in ``out``; a
            muscle's file is what it holds.
        BlockingIOError: If another process works in ``out``.
        OSError: If something cannot be written.
        KeyboardInterrupt: As it came, after everything was written.
    """
    robot = {} if config.tca is None else {"tca": find_tca(config.tca)}
    robot |= robot_of(config.task, config.design) if config.design else {}
    made_for = _relied_on(config.task, robot)
    gait, steering = first_gait(config.task, config.start)
    space = GaitSpace(centre=gait, hottest=task_class(config.task).hot_temperature)
    point = space.encode(gait, steering)
    optimiser = CMA(
        mean=point, sigma=config.sigma, population_size=config.population, seed=config.seed
    )
    with ExitStack() as ends:
        ends.enter_context(claimed(out))
        folder = RunFolder(out, config, command)
        state, known, *noted = folder.load() or (SearchState(optimiser=optimiser), {})
        if apart := differences(noted[0], made_for) if noted else []:
            raise ValueError(f"{out} holds a run in another task, {' | '.join(apart)}")
        board = folder.tensorboard(int(state.rows[-1]["steps"]) if state.rows else 0)
        ends.callback(board.close)
        bar = progress_bar(config.steps, unit="steps", done=state.steps, progress=progress)
        ends.callback(bar.close)
        run = _Search(config, folder, space, point, state, known, board, robot, made_for)
        ends.callback(run.save)
        if address is None:
            run.processes = ends.enter_context(Workers(workers))
        else:
            run.processes = ends.enter_context(ClusterWorkers(out, address))
        run.prepare()
        while run.state.steps < config.steps:
            run.generation()
            if run.state.generation % config.validate_every == 0:
                run.validate()
            run.save()
            run.show()
            bar.set_postfix(run.shown(), refresh=False)
            bar.update(run.state.steps - bar.n)
        if run.validate():
            run.show("validation")
    return run.policy(best=True)


@dataclass
class _Search:
    """A search under way.

    Attributes:
        first: Its first point.
        state: Where it stands, replaced as a whole.
        known: Episodes that are finished of a step of the search that is not.
        board: TensorBoard's.
        robot: What tasks are made with: the robot's muscle, another robot.
        made_for: What its gaits rely on, parts of a contract.
        processes: Who runs episodes.
    """

    config: SearchConfig
    folder: RunFolder
    space: GaitSpace
    first: NDArray[np.float64]
    state: SearchState
    known: dict[tuple[str, int], Headway]
    board: Any
    robot: dict[str, Any]
    made_for: dict[str, Any]
    processes: Workers | ClusterWorkers = field(init=False)

    def __post_init__(self) -> None:
        self._scripted = first_gait(self.config.task, "scripted")

    def prepare(self) -> None:
        """Judges the scripted gait and the first one, and what was interrupted."""
        if self.state.reference is None:
            found = self._run("reference", [self._scripted], self._validation())
            steps = self.state.steps + _steps(found)
            self.state = replace(self.state, reference=Reference.of(found[0]), steps=steps)
        if self.state.best is None:
            self._judge("first", self.first)
            self.save()
        if self.state.generation and self.state.generation % self.config.validate_every == 0:
            self.validate()
        self.show()

    def generation(self) -> None:
        """Draws gaits, runs their episodes and moves the distribution."""
        state, number = self.state, self.state.generation
        seeds = drawn(self.config.seed, number + 1, 1 + self.config.episodes)
        optimiser = _copy(state.optimiser)
        optimiser.reseed_rng(seeds[0])
        points = [optimiser.ask() for _ in range(self.config.population)]
        gaits = [self.space.decode(self.space.fold(point)) for point in points]
        found = self._run(f"generation {number}", [self._scripted, *gaits], seeds[1:])
        reference = Reference.of(found[0])
        judged = [score(episodes, reference) for episodes in found[1:]]
        optimiser.tell([(point, -row["score"]) for point, row in zip(points, judged, strict=True)])
        every = [headway for episodes in found[1:] for headway in episodes]
        steps = state.steps + _steps(found)
        row = {
            "generation": number + 1,
            "steps": steps,
            "sigma": float(optimiser._sigma),
            "score_mean": float(np.mean([row["score"] for row in judged])),
            **{f"top_{k}": v for k, v in max(judged, key=lambda row: row["score"]).items()},
            "speed_mean_m_per_s": float(np.mean([headway.speed for headway in every])),
            "power_mean_w": float(np.mean([headway.power for headway in every])),
            "temperature_max_celsius": max(headway.temperature for headway in every),
            "tension_max_n": max(headway.tension for headway in every),
            "early_ends": sum(headway.missed > 0.0 for headway in every),
        }
        # Through a copy, as it will be after an interruption: it forgets the state of the draws.
        self.state = replace(
            state, optimiser=_copy(optimiser), generation=number + 1, steps=steps,
            rows=(*state.rows, row),
        )  # fmt: skip

    def validate(self) -> bool:
        """Judges the middle of the search, unless that was done before."""
        rows = self.state.rows
        new = bool(rows) and "validation_score" not in rows[-1]
        if new:
            middle = self.space.fold(self.state.optimiser.mean)
            self._judge(f"validation {self.state.generation}", middle)
        return new

    def _judge(self, label: str, point: NDArray[np.float64]) -> None:
        """Scores a point in the validation's episodes, and keeps it if it is the best."""
        state = self.state
        assert state.reference is not None
        found = self._run(label, [self.space.decode(point)], self._validation())
        judged, best = score(found[0], state.reference), state.best
        if best is None or judged["score"] > best[0]:
            best = judged["score"], point
        row = {
            **{f"validation_{name}": value for name, value in judged.items()},
            "validation_speed_m_per_s": float(np.mean([h.speed for h in found[0]])),
            "validation_power_w": float(np.mean([h.power for h in found[0]])),
            "best_score": best[0],
        }
        rows = (*state.rows[:-1], state.rows[-1] | row) if state.rows else ()
        self.state = replace(state, best=best, rows=rows, steps=state.steps + _steps(found))

    def _run(self, label: str, gaits: Sequence[Steered], seeds: Sequence[int]) -> Found:
        """Episodes of each gait, one for each seed; those that are known are not run again."""
        config, n = self.config, len(seeds)
        jobs = [
            Trial(
                task=config.task, gait=gait, steering=steering, seed=seed,
                options=config.options, settling=config.settling, window=config.window,
                robot=self.robot,
            )
            for gait, steering in gaits
            for seed in seeds
        ]  # fmt: skip
        self.known = {key: value for key, value in self.known.items() if key[0] == label}
        missing = [i for i in range(len(jobs)) if (label, i) not in self.known]
        for i, headway in self.processes.run(run_trial, [(jobs[i],) for i in missing]):
            self.known[label, missing[i]] = headway
        found = [self.known[label, i] for i in range(len(jobs))]
        return [found[i : i + n] for i in range(0, len(found), n)]

    def _validation(self) -> list[int]:
        return drawn(self.config.seed, 0, self.config.validation_episodes)

    def show(self, kind: str = "") -> None:
        """Shows the last row in TensorBoard, or what of it begins with ``kind``."""
        self.folder.require_room()
        row = self.state.rows[-1] if self.state.rows else {}
        for name, value in row.items():
            if name.startswith(kind):
                self.board.add_scalar(f"search/{name}", value, int(row["steps"]))
        self.board.flush()

    def shown(self) -> dict[str, str]:
        """What the progress bar says."""
        row, best = self.state.rows[-1], self.state.best[0] if self.state.best else np.nan
        shown = {"generation": f"{self.state.generation}", "best": f"{best:.3f}"}
        speed = f"{1e3 * row['speed_mean_m_per_s']:.2f} mm/s"
        return shown | {"mean": f"{row['score_mean']:.3f}", "speed": speed}

    def policy(self, *, best: bool) -> SavedPolicy:
        """The best gait, or the middle of the search."""
        state, config = self.state, self.config
        point = self.space.fold(state.optimiser.mean)
        if best and state.best is not None:
            point = state.best[1]
        gait, steering = self.space.decode(point)
        source = f"CMA-ES from the gait '{config.start}', generation {state.generation}"
        origin = self.folder.origin("cma", state.steps, source)
        muscle = {} if config.tca is None else {"tca": config.tca}
        return SavedPolicy(
            task=config.task, origin=origin, gait=gait, steering=steering,
            arguments={"action": "power", **muscle}, made_for=self.made_for,
        )  # fmt: skip

    def save(self) -> None:
        """Writes the state, then what follows from it."""
        self.folder.save((self.state, self.known, self.made_for))
        write_csv(self.folder.path / CURVE, self.state.rows)
        self.policy(best=True).save(self.folder.path / BEST)
        self.policy(best=False).save(self.folder.path / LAST)


def _relied_on(task: str, robot: Mapping[str, Any]) -> dict[str, Any]:
    """What a gait relies on of its task: not on what else is seen."""
    found = contract(walking(task, **robot))
    return {name: part for name, part in found.items() if name != "observation"}


def _steps(found: Found) -> int:
    return sum(headway.steps for episodes in found for headway in episodes)


def _copy(optimiser: CMA) -> CMA:
    return pickle.loads(pickle.dumps(optimiser))

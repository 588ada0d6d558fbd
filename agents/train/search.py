"""Black-box search for gaits: CMA-ES over the figures of a gait, in several processes.

In every generation the scripted gait walks the same episodes as the others, which are scored
against it. Nothing depends on how many processes there are, on the order in which they finish, or
on whether the run was interrupted: all draws of a generation come from the seed and its number.
"""

import multiprocessing
import pickle
import signal
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray
from tqdm import tqdm

from tca_mj.agents.policies import Origin, SavedPolicy, find
from tca_mj.agents.policies.actors import arguments_of, scripted
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.train.gait_score import Headway, Reference, Trial, run_trial, score
from tca_mj.agents.train.gait_space import GaitSpace
from tca_mj.agents.train.runs import CURVE, LIBRARIES, RunFolder
from tca_mj.checks import require_count
from tca_mj.control import Gait
from tca_mj.machine import versions
from tca_mj.registry import make, task_class

TROT = (0.5, 0.0, 0.0, 0.5)  # offsets of four legs, diagonal ones together
BEST, LAST = "best.json", "last.json"


@dataclass(frozen=True, kw_only=True, slots=True)
class SearchConfig:
    """Settings of a search.

    Attributes:
        task: Gymnasium id of a task with four legs that a gait can drive.
        steps: Control steps of all episodes together after which no generation begins.
        seed: Seed of everything that is drawn.
        start: Where the search begins: ``scripted``, ``trot``, or a policy's file or name.
        sigma: First step size, the cube of all gaits having edges of 1. With 0.03 one in five
            gaits about the scripted walk is better than it, with 0.1 none.
        population: Gaits per generation.
        episodes: Episodes per gait, the same for all of a generation.
        randomise: Spread of the robots in them.
        settling: Time of each episode that is not judged, as in ``Trial`` [s].
        window: Time that is judged [s].
        validate_every: Generations after which the middle of the search is judged, by the same
            episodes each time; the best in these is what the search finds.
        validation_episodes: How many these are.

    Raises:
        ValueError: If a field is out of range.
    """

    task: str
    steps: int = 150_000
    seed: int = 0
    start: str = "scripted"
    sigma: float = 0.03
    population: int = 14
    episodes: int = 1
    randomise: float = 0.2
    settling: float = 10.0
    window: float = 20.0
    validate_every: int = 8
    validation_episodes: int = 8

    def __post_init__(self) -> None:
        if task_class(self.task).legs != len(TROT):
            raise ValueError(f"task must have four legs that a gait can drive, got {self.task!r}")
        require_count(
            steps=self.steps, episodes=self.episodes, validate_every=self.validate_every,
            validation_episodes=self.validation_episodes,
        )  # fmt: skip
        if self.population < 5:
            raise ValueError(f"population must be at least 5, got {self.population}")
        if not 0.0 < self.sigma <= 0.5:
            raise ValueError(f"sigma must be above 0 and at most 0.5, got {self.sigma}")
        for name, low, high in (
            ("randomise", 0.0, 0.5), ("settling", 0.0, 20.0), ("window", 0.1, 25.0)
        ):  # fmt: skip
            if not low <= getattr(self, name) <= high:
                value = getattr(self, name)
                raise ValueError(f"{name} must be between {low} and {high}, got {value}")


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


def first_gait(task: str, start: str) -> tuple[Gait, tuple[float, ...]]:
    """The gait from which something starts, and its steering per leg [K/rad].

    Args:
        task: Gymnasium id.
        start: ``scripted``; ``trot``, which is the same with diagonal legs together, half a cycle
            after the others; or a policy's file or name.

    Raises:
        FileNotFoundError: If ``start`` is no policy.
        ValueError: If it is a policy without a gait.
    """
    if start in ("scripted", "trot"):
        env = make(task, disable_env_checker=True, **arguments_of("scripted", task))
        script = scripted(env)
        env.close()
        if not isinstance(script, GaitPolicy):
            raise ValueError(f"start must be a policy with a gait: the script of {task} has none")
        gait = replace(script.gait, offset=TROT) if start == "trot" else script.gait
        steering = script.steering
        return gait, steering if isinstance(steering, tuple) else (steering,) * gait.legs
    saved = SavedPolicy.read(find(start))
    if saved.gait is None:
        raise ValueError(f"start must have a gait, {start} is a {saved.kind}")
    return saved.gait, saved.steering


def search(
    config: SearchConfig, out: Path, *, workers: int = 2, command: str = "", progress: bool = True
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
        progress: Whether to show a progress bar, where there is a terminal.

    Returns:
        The best gait.

    Raises:
        FileNotFoundError, ValueError: If the settings do not fit, or not to the run in ``out``.
        KeyboardInterrupt: As it came, after everything was written.
    """
    require_count(workers=workers)
    gait, steering = first_gait(config.task, config.start)
    space = GaitSpace(centre=gait, hottest=task_class(config.task).hot_temperature)
    point = space.encode(gait, steering)
    folder = RunFolder(out, config, command)
    optimiser = CMA(
        mean=point, sigma=config.sigma, population_size=config.population, seed=config.seed
    )
    state, known = folder.load() or (SearchState(optimiser=optimiser), {})
    run = _Search(config, folder, space, point, state, known, command)
    board = folder.tensorboard(state.steps)
    bar = tqdm(
        total=config.steps, initial=state.steps, unit="step", unit_scale=True,
        disable=None if progress else True,
    )  # fmt: skip
    try:
        with Trials(workers) as trials:
            run.prepare(trials)
            while run.state.steps < config.steps:
                run.generation(trials)
                if run.state.generation % config.validate_every == 0:
                    run.validate(trials)
                run.save()
                for name, value in run.state.rows[-1].items():
                    board.add_scalar(f"search/{name}", value, run.state.steps)
                board.flush()
                bar.update(run.state.steps - bar.n)
                bar.set_postfix(run.shown())
            run.validate(trials)
    finally:
        run.save()
        bar.close()
        board.close()
    return run.policy(best=True)


class _Search:
    """A search under way.

    Attributes:
        state: Where it stands, replaced as a whole.
        known: Episodes that are finished of a step of the search that is not.
    """

    def __init__(
        self,
        config: SearchConfig,
        folder: RunFolder,
        space: GaitSpace,
        first: NDArray[np.float64],
        state: SearchState,
        known: dict[tuple[str, int], Headway],
        command: str,
    ) -> None:
        self.config, self.folder, self.space, self.first = config, folder, space, first
        self.state, self.known, self.command = state, known, command
        self._scripted = first_gait(config.task, "scripted")

    def prepare(self, trials: "Trials") -> None:
        """Judges the scripted gait and the first one, and what was interrupted."""
        if self.state.reference is None:
            (found,) = self._run(trials, "reference", [self._scripted], self._validation())
            self.state = replace(
                self.state, reference=Reference.of(found), steps=self.state.steps + _steps([found])
            )
        if self.state.best is None:
            self._judge(trials, "first", self.first)
            self.save()
        if self.state.generation and self.state.generation % self.config.validate_every == 0:
            self.validate(trials)

    def generation(self, trials: "Trials") -> None:
        """Draws gaits, runs their episodes and moves the distribution."""
        state, number = self.state, self.state.generation
        seeds = self._seeds(number, 1 + self.config.episodes)
        optimiser = _copy(state.optimiser)
        optimiser.reseed_rng(seeds[0])
        points = [optimiser.ask() for _ in range(self.config.population)]
        gaits = [self.space.decode(self.space.fold(point)) for point in points]
        found = self._run(trials, f"generation {number}", [self._scripted, *gaits], seeds[1:])
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

    def validate(self, trials: "Trials") -> None:
        """Judges the middle of the search, unless that is done."""
        rows = self.state.rows
        if rows and "validation_score" not in rows[-1]:
            middle = self.space.fold(self.state.optimiser.mean)
            self._judge(trials, f"validation {self.state.generation}", middle)

    def _judge(self, trials: "Trials", label: str, point: NDArray[np.float64]) -> None:
        """Scores a point in the validation's episodes, and keeps it if it is the best."""
        state = self.state
        assert state.reference is not None
        found = self._run(trials, label, [self.space.decode(point)], self._validation())
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

    def _run(
        self,
        trials: "Trials",
        label: str,
        gaits: Sequence[tuple[Gait, tuple[float, ...]]],
        seeds: Sequence[int],
    ) -> list[list[Headway]]:
        """Episodes of each gait, one for each seed; those that are known are not run again."""
        jobs = [
            Trial(
                task=self.config.task, gait=gait, steering=steering, seed=seed,
                randomise=self.config.randomise, settling=self.config.settling,
                window=self.config.window,
            )
            for gait, steering in gaits
            for seed in seeds
        ]  # fmt: skip
        self.known = {key: value for key, value in self.known.items() if key[0] == label}
        missing = [i for i in range(len(jobs)) if (label, i) not in self.known]
        for i, headway in trials.run([jobs[i] for i in missing]):
            self.known[label, missing[i]] = headway
        found = [self.known[label, i] for i in range(len(jobs))]
        n = len(seeds)
        return [found[i : i + n] for i in range(0, len(found), n)]

    def _seeds(self, number: int, n: int) -> list[int]:
        random = np.random.default_rng((self.config.seed, number + 1))
        return random.integers(2**31, size=n).tolist()

    def _validation(self) -> list[int]:
        return self._seeds(-1, self.config.validation_episodes)

    def shown(self) -> dict[str, str]:
        """What the progress bar says."""
        row = self.state.rows[-1]
        best = self.state.best[0] if self.state.best else np.nan
        return {
            "generation": f"{self.state.generation}",
            "best": f"{best:.3f}",
            "mean": f"{row['score_mean']:.3f}",
            "speed": f"{1e3 * row['speed_mean_m_per_s']:.2f} mm/s",
        }

    def policy(self, *, best: bool) -> SavedPolicy:
        """The best gait, or the middle of the search."""
        state, config = self.state, self.config
        point = self.space.fold(state.optimiser.mean)
        if best and state.best is not None:
            point = state.best[1]
        gait, steering = self.space.decode(point)
        origin = Origin(
            algorithm="cma", seed=config.seed, steps=state.steps, command=self.command,
            source=f"CMA-ES from the gait '{config.start}', generation {state.generation}",
            versions=versions(*LIBRARIES),
        )  # fmt: skip
        return SavedPolicy(task=config.task, origin=origin, gait=gait, steering=steering)

    def save(self) -> None:
        """Writes the state, then what follows from it."""
        self.folder.save((self.state, self.known))
        self.folder.write_curves({CURVE: self.state.rows})
        self.policy(best=True).save(self.folder.path / BEST)
        self.policy(best=False).save(self.folder.path / LAST)


def _steps(found: Sequence[Sequence[Headway]]) -> int:
    return sum(headway.steps for episodes in found for headway in episodes)


def _copy(optimiser: CMA) -> CMA:
    return pickle.loads(pickle.dumps(optimiser))


class Trials:
    """Runs episodes in processes of their own, or in this one if there is only one."""

    def __init__(self, workers: int) -> None:
        self._n = workers if workers > 1 else 0
        self._processes: list[BaseProcess] = []
        self._pipes: list[Any] = []

    def __enter__(self) -> "Trials":
        # Spawned: nothing of this process, of its threads above all, is carried over. Ctrl-C is
        # for this process alone; one that is started while it is ignored never hears of it.
        context = multiprocessing.get_context("spawn")
        alone = threading.current_thread() is threading.main_thread()
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if self._n and alone else None
        try:
            for _ in range(self._n):
                ours, theirs = context.Pipe()
                process = context.Process(target=_work, args=(theirs,), daemon=True)
                process.start()
                theirs.close()
                self._pipes.append(ours)
                self._processes.append(process)
        finally:
            if before is not None:
                signal.signal(signal.SIGINT, before)
        return self

    def __exit__(self, *error: object) -> None:
        for pipe, process in zip(self._pipes, self._processes, strict=True):
            process.kill()  # it has nothing to lose
            pipe.close()

    def run(self, jobs: Sequence[Trial]) -> Iterator[tuple[int, Headway]]:
        """Yields the number of each job and what came of it, in any order.

        Raises:
            RuntimeError: If a process has ended.
        """
        if not self._n:
            yield from ((i, run_trial(job)) for i, job in enumerate(jobs))
            return
        waiting, free = list(enumerate(jobs))[::-1], list(self._pipes)
        busy: dict[Any, int] = {}
        while waiting or busy:
            try:
                while free and waiting:
                    free[-1].send(waiting[-1][1])
                    busy[free.pop()] = waiting.pop()[0]
                ready: list[Any] = wait(list(busy))
                found = [(pipe, pipe.recv()) for pipe in ready]
            except (EOFError, OSError) as error:
                raise RuntimeError("a process that ran episodes has ended") from error
            for pipe, headway in found:
                if isinstance(headway, Exception):
                    raise headway
                free.append(pipe)
                yield busy.pop(pipe), headway


def _work(pipe: Any) -> None:
    """A process that runs episodes until the other end of its pipe is gone."""
    try:
        while True:
            job = pipe.recv()
            try:
                found: Headway | Exception = run_trial(job)
            except Exception as error:
                found = error
            pipe.send(found)
    except (EOFError, OSError):
        return

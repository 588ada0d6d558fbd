"""An episode under way: what is seen of it, filmed, recorded and summed up, however it ends.

What watches never ends it: a recording, a film or a plot that fails is left out or cut off, with
the reason, and the episode goes on.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from tca_mj.agents.output import plain, write_json
from tca_mj.agents.policies import Policy
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.rollout import Step, rollout
from tca_mj.checks import Seed, door, number
from tca_mj.envs.outcome import Headway
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.machine import machine, versions
from tca_mj.record.film import Film, FilmSpeed
from tca_mj.record.plots import rollout_plot
from tca_mj.record.webpage import WebPage

Duration = Annotated[float, partial(number, above=0.0, at_most=86_400.0, unit="s")]

SUMMARY, RECORDING, VIDEO, PLOT = "summary.json", "rollout.rrd", "rollout.mp4", "rollout.png"
PAGE = "rollout.html"

_FPS = 20.0  # of the film: a picture costs as much as half a second of simulation
_BAR = "{desc:9} |{bar}| {n:.1f} of at most {total:.0f} s simulated, {elapsed} real"


class Episode:
    """One episode under way, and what was seen of it so far."""

    @door
    def __init__(
        self,
        env: gym.Env[Any, Any],
        policy: Policy,
        *,
        names: tuple[str, str],
        seed: Seed,
        out: Path | None,
        options: Mapping[str, Any] | None = None,
        files: Sequence[str] = (RECORDING, VIDEO, PAGE, PLOT),
    ) -> None:
        """Resets policy and environment; only then are the files in ``out`` touched.

        Args:
            env: The task.
            policy: Who acts.
            names: What task and policy are called.
            seed: Seed of the episode.
            out: Folder for the files; None to write nothing.
            options: Options of the reset.
            files: What is written besides ``SUMMARY``; ``RECORDING`` always is.

        Raises:
            ValueError: If an argument is not of its kind, or as the ``reset`` of the task.
        """
        task: Any = env.unwrapped
        self.task, self.sim, self.policy = task, task.sim, policy
        self.names, self.seed, self.out, self.files = names, seed, out, files
        steps = None if env.spec is None else env.spec.max_episode_steps
        self.limit = np.inf if steps is None else steps * task.control_period  # [s]
        self.recording = None if out is None else RecordRerun(env, out / RECORDING)
        self.env = self.recording or env
        self.ending = ""
        self.total = 0.0  # of the rewards
        self.held_until = ""  # phase in which an object was last touched
        self.wall: dict[str, float] = defaultdict(float)
        self.left_out: dict[str, str] = {}
        self._film: Film | None = None
        self._page: WebPage | None = None
        self.clock: list[float] = []
        self.places: list[Headway | None] = []
        self.samples: dict[str, list[Any]] = defaultdict(list)
        self.phases: list[tuple[float, str]] = []
        self._steps = rollout(
            self.env, policy, seed=seed, options=options, decided=self._note_phase
        )
        self.last = next(self._steps)
        self._note_phase()
        self._see(self.last)

    @door
    def run(self, limit: Duration, *, speed: FilmSpeed, progress: bool) -> dict[str, Any]:
        """Goes on to the end, and writes what happened.

        Args:
            limit: Simulated time after which to stop, at most a day [s].
            speed: Simulated seconds per second of film.
            progress: Whether to show how far it is.

        Returns:
            The summary, see ``tca_mj.agents.demo.play``.
        """
        # What is called back at the end, the last first, whatever happens to the others.
        with ExitStack() as ends:
            if self.out is not None:
                for name in (VIDEO, PAGE, PLOT):
                    (self.out / name).unlink(missing_ok=True)
                write_json(self.out / SUMMARY, self.summary())
                ends.callback(self._write, self.out)
                if PLOT in self.files:
                    ends.callback(self._plot, self.out / PLOT)
            ends.callback(self.env.close)
            ends.callback(self._end_film)
            ends.callback(self._end_page)
            bar = progress_bar(limit, unit="s", progress=progress, terminal=_BAR)
            ends.callback(bar.close)
            try:
                if VIDEO in self.files and self.out is not None:
                    self._attempt("video", VIDEO, partial(self._begin_film, self.out, speed))
                if PAGE in self.files and self.out is not None:
                    self._attempt("page", PAGE, partial(self._begin_page, self.out, speed))
                self._film_on()
                while not self.ending:
                    self._go_on()
                    bar.set_description_str(self.policy.phase, refresh=False)
                    bar.set_postfix({"return": f"{self.total:.2f}"}, refresh=False)
                    bar.update(self.clock[-1] - bar.n)
                    if not self.ending and self.clock[-1] > limit - 1e-6:
                        self.ending = f"stopped after {limit:g} s"
            except BaseException as error:
                wrong = f"error: {type(error).__name__}: {error}"
                self.ending = "interrupted" if isinstance(error, KeyboardInterrupt) else wrong
                raise
        return self.summary()

    def _go_on(self) -> None:
        """One control period."""
        recorded = self._recorded()
        with self._timed("simulation"):
            self.last = next(self._steps)
        self.wall["simulation"] -= self._recorded() - recorded
        self._see(self.last)
        self.ending = self.last.ending
        self._film_on()

    def _see(self, step: Step) -> None:
        sim = self.sim
        self.total += step.reward
        self.clock.append(sim.time)
        for name in ("power", "temperature", "tension"):
            self.samples[name].append(np.array(getattr(sim, name)))
        self.samples["body"].append(np.where(sim.embedded, sim.body_temperature, np.nan))
        self.samples["bend"].append(np.degrees(self.task.bent()))
        self.places.append(self.task.headway())
        if step.info.get("touched", False) and not step.succeeded(self.task):
            self.held_until = self.phases[-1][1]

    def _note_phase(self) -> None:
        """Notes what the policy is doing from now on, if that is new."""
        phase = self.policy.phase
        if not self.phases or phase != self.phases[-1][1]:
            self.phases.append((self.sim.time, phase))
            if self.recording is not None:
                self.recording.event(phase)

    def summary(self) -> dict[str, Any]:
        """What is known of the episode so far; see ``tca_mj.agents.demo.play`` for the keys."""
        names, spines, end = self.sim.tca_names, self.sim.spines, self.clock[-1]
        self.wall["recording"] = self._recorded()
        if self.recording is not None and self.recording.failure:
            self.left_out[RECORDING] = self.recording.failure
        found = {
            "task": self.names[0],
            "policy": self.names[1],
            "seed": self.seed,
            "success": self.last.succeeded(self.task),
            "return": self.total,
            "held_until": self.held_until,
            "ending": self.ending or "still running",
            "duration": round(end, 6),
            "wall": {purpose: round(seconds, 3) for purpose, seconds in self.wall.items()},
            "real_time_factor": round(end / max(self.wall["simulation"], 1e-9), 2),
            "phases": [
                {"name": name, "start": round(start, 6), "duration": round(until - start, 6)}
                for name, start, until in self._spans()
            ],
            "energy": _by_name(names, self.sim.energy),
            "peak_temperature": _by_name(names, np.nanmax(self.samples["temperature"], axis=0)),
            "peak_tension": _by_name(names, np.nanmax(self.samples["tension"], axis=0)),
            **self._headway(),
            "versions": versions(),
            "machine": machine(),
            "files": [n for n in self.files if self.out is not None and (self.out / n).is_file()],
            "left_out": self.left_out,
            "heater_energy": dict(zip(spines.names, spines.energy.tolist(), strict=True)),
            **self.task.outcome(),
        }
        tries = {"tries": self.policy.tries} if hasattr(self.policy, "tries") else {}
        return plain(found | tries)

    def _spans(self) -> list[tuple[str, float, float]]:
        """Name, start and end of each phase."""
        ends = [*(start for start, _ in self.phases[1:]), self.clock[-1]]
        return [(name, start, end) for (start, name), end in zip(self.phases, ends, strict=True)]

    def _headway(self) -> dict[str, Any]:
        """How far a robot has got that is to get on, and how fast in each phase.

        What has diverged is nowhere: it got as far as it was before.
        """
        seen = [
            (time, place.along, place.aside)
            for time, place in zip(self.clock, self.places, strict=True)
            if place is not None and np.isfinite([place.along, place.aside]).all()
        ]
        if not seen:
            return {}
        clock, way = np.split(np.array(seen), [1], axis=1)
        rows = []
        for name, start, end in self._spans():
            ends = np.interp([start, end], clock[:, 0], way[:, 0])
            distance = float(ends[1] - ends[0])
            speed = round(distance / max(end - start, 1e-9), 6)
            row = {"name": name, "distance": round(distance, 6), "speed": speed}
            rows.append(row | {"published": self.task.published_speed.get(name)})
        distance, drift = (way[-1] - way[0]).tolist()
        return {"distance": distance, "drift": drift, "speeds": rows}

    def _write(self, out: Path) -> None:
        try:
            write_json(out / SUMMARY, self.summary())
        except OSError as error:
            self._left_out(SUMMARY, error)

    def _begin_film(self, out: Path, speed: float) -> None:
        path, camera = out / VIDEO, self.task.camera
        self._film = Film(self.sim, path, fps=_FPS, speed=speed, camera=camera)

    def _film_on(self) -> None:
        """Films the present, and keeps it for the page; what fails is left out from here on."""
        film = self._film
        if film is not None and not self._attempt("video", VIDEO, film.frame):
            self._film = None
            with suppress(Exception):
                film.close()
        page = self._page
        if page is not None:
            kept = partial(page.frame, self.policy.phase)
            if not self._attempt("page", PAGE, kept):
                self._end_page()

    def _begin_page(self, out: Path, speed: float) -> None:
        title = f"{self.names[0]}, {self.names[1]}, seed {self.seed}"
        interval = max(self.task.control_period, speed / _FPS)
        self._page = WebPage(
            self.sim, out / PAGE, title=title, interval=interval, speed=speed,
            follow=self.task.headway() is not None,
        )  # fmt: skip

    def _end_page(self) -> None:
        page, self._page = self._page, None
        if page is not None:
            self._attempt("page", PAGE, page.close)

    def _end_film(self) -> None:
        if self._film is not None:
            self._attempt("video", VIDEO, self._film.close)

    def _plot(self, path: Path) -> None:
        self._attempt("plot", PLOT, partial(self._draw, path))

    def _draw(self, path: Path) -> None:
        samples = {name: np.array(rows) for name, rows in self.samples.items()}
        task, policy = self.names
        rollout_plot(
            path,
            self.clock,
            samples["power"],
            samples["temperature"],
            samples["tension"],
            samples["bend"],
            [name.partition(".")[2] for name in self.sim.tca_names],
            self.phases,
            body=samples["body"] if self.sim.embedded.any() else None,
            title=f"{policy} in {task}, seed {self.seed}: {self.ending}",
        )

    def _attempt(self, purpose: str, name: str, do: Callable[[], object]) -> bool:
        """Whether something went well that may fail and must not end the episode."""
        with self._timed(purpose):
            try:
                do()
            except Exception as error:
                self._left_out(name, error)
                return False
        return True

    def _left_out(self, name: str, error: Exception) -> None:
        """Notes why a file is not there, or not whole."""
        self.left_out[name] = str(error) or type(error).__name__
        there = self.out is not None and (self.out / name).is_file()
        tqdm.write(f"{name} is {'cut off' if there else 'left out'}: {self.left_out[name]}")

    @contextmanager
    def _timed(self, purpose: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.wall[purpose] += time.perf_counter() - start

    def _recorded(self) -> float:
        """Time spent on the recording so far [s]."""
        return 0.0 if self.recording is None else self.recording.seconds


def _by_name(names: tuple[str, ...], values: NDArray[np.float64]) -> dict[str, float]:
    return {name: round(float(value), 4) for name, value in zip(names, values, strict=True)}

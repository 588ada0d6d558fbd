"""An episode under way: what is seen of it, filmed, recorded and summed up, however it ends."""

import json
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from tca_mj.agents.policies import Policy
from tca_mj.envs.task import Headway, how_it_ended
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.files import write_whole
from tca_mj.machine import machine, versions
from tca_mj.record.film import Film
from tca_mj.record.plots import rollout_plot
from tca_mj.record.render import RenderingUnavailable

SUMMARY, RECORDING, VIDEO, PLOT = "summary.json", "rollout.rrd", "rollout.mp4", "rollout.png"

_FPS = 20.0  # of the film: a picture costs as much as half a second of simulation
_BAR = "{desc:9} |{bar}| {n:.1f} of at most {total:.0f} s simulated, {elapsed} real"


class Episode:
    """One episode under way, and what was seen of it so far."""

    def __init__(
        self,
        env: gym.Env[Any, Any],
        policy: Policy,
        *,
        seed: int,
        out: Path | None,
        options: Mapping[str, Any] | None = None,
        title: str = "",
    ) -> None:
        """Resets the environment; only then are the files in ``out`` touched.

        Args:
            env: The task, wrapped in ``RecordRerun`` if there is to be a recording.
            policy: Who acts.
            seed: Seed of the episode.
            out: Folder for the files; None to write nothing.
            options: Options of the reset.
            title: What the plot is called, before how it ended.
        """
        self.env, self.policy, self.seed, self.out = env, policy, seed, out
        task: Any = env.unwrapped
        self.task, self.sim = task, task.sim
        self.ending = ""
        self.success = False
        self.total = 0.0  # of the rewards
        self.held_until = ""  # phase in which an object was last touched
        self.wall: dict[str, float] = defaultdict(float)
        self.left_out: dict[str, str] = {}
        self._film: Film | None = None
        self._title = title
        self.observation, self.info = env.reset(seed=seed, options=dict(options or {}))
        self.clock: list[float] = []
        self.places: list[Headway | None] = []
        self.samples: dict[str, list[Any]] = defaultdict(list)
        self.phases: list[tuple[float, str]] = [(0.0, policy.phase)]
        self._event(policy.phase)
        self._sample()

    def run(
        self,
        limit: float,
        *,
        speed: float,
        video: bool,
        progress: bool,
        summary: Callable[[], dict[str, Any]],
    ) -> dict[str, Any]:
        """Goes on to the end, and writes what happened.

        Args:
            limit: Simulated time after which to stop [s].
            speed: Simulated seconds per second of film.
            video: Whether to make the film.
            progress: Whether to show a progress bar, where there is a terminal.
            summary: What is to be written of the episode.

        Returns:
            The summary.
        """
        if self.out is not None:
            for name in (VIDEO, PLOT):
                (self.out / name).unlink(missing_ok=True)
            self._write(summary)
        # What is called back at the end, the last first, whatever happens to the others.
        with ExitStack() as ends:
            if self.out is not None:
                ends.callback(self._write, summary)
                ends.callback(self._plot)
            ends.callback(self.env.close)
            ends.callback(self._end_film)
            bar = tqdm(total=limit, bar_format=_BAR, disable=None if progress else True)
            ends.callback(bar.close)
            with self._named_errors():
                if video:
                    self._begin_film(speed)
                while not self.ending:
                    self.step()
                    bar.set_description_str(self.policy.phase, refresh=False)
                    bar.update(self.clock[-1] - bar.n)
                    if not self.ending and self.clock[-1] > limit - 1e-6:
                        self.ending = f"stopped after {limit:g} s"
        return summary()

    def step(self) -> None:
        """One control period."""
        recorded = self._recorded()
        with self._timed("simulation"):
            action = self.policy.act(self.observation)
            phase = self.policy.phase
            if phase != self.phases[-1][1]:
                self.phases.append((self.sim.time, phase))
                self._event(phase)
            step = self.env.step(action)
        self.observation, reward, terminated, truncated, self.info = step
        self.total += float(reward)
        self.wall["simulation"] -= self._recorded() - recorded
        self.wall["recording"] = self._recorded()
        self._sample()
        self.ending = how_it_ended(terminated, truncated, self.info) or ""
        whole = truncated and "truncation_reason" not in self.info
        self.success = self.info["success"] or bool(whole and self.task.legs)
        if self.info.get("touched", False) and not self.success:
            self.held_until = phase
        if self._film is not None:
            with self._timed("video"):
                self._film.frame()

    def summary(self) -> dict[str, Any]:
        """What is known of every episode so far; see ``tca_mj.agents.demo`` for the keys."""
        names, end = self.sim.tca_names, self.clock[-1]
        starts = [start for start, _ in self.phases]
        written = [RECORDING, VIDEO, PLOT]
        return {
            "seed": self.seed,
            "success": self.success,
            "return": self.total,
            "held_until": self.held_until,
            "ending": self.ending or "still running",
            "duration": round(end, 6),
            "wall": {purpose: round(seconds, 3) for purpose, seconds in self.wall.items()},
            "real_time_factor": round(end / max(self.wall["simulation"], 1e-9), 2),
            "phases": [
                {"name": name, "start": round(start, 6), "duration": round(until - start, 6)}
                for (start, name), until in zip(self.phases, [*starts[1:], end], strict=True)
            ],
            "energy": _by_name(names, self.sim.energy),
            "peak_temperature": _by_name(names, np.max(self.samples["temperature"], axis=0)),
            "peak_tension": _by_name(names, np.max(self.samples["tension"], axis=0)),
            **self._headway(),
            "versions": versions(),
            "machine": machine(),
            "files": [n for n in written if self.out is not None and (self.out / n).is_file()],
            "left_out": self.left_out,
        }

    def _headway(self) -> dict[str, Any]:
        """How far a robot has got that is to get on, and how fast in each phase."""
        way = np.array([[place.along, place.aside] for place in self.places if place is not None])
        if not len(way):
            return {}
        rows = []
        starts = [start for start, _ in self.phases]
        for (start, name), end in zip(self.phases, [*starts[1:], self.clock[-1]], strict=True):
            ends = np.interp([start, end], self.clock, way[:, 0])
            distance = float(ends[1] - ends[0])
            rows.append(
                {
                    "name": name,
                    "distance": round(distance, 6),
                    "speed": round(distance / max(end - start, 1e-9), 6),
                    "published": self.task.published_speed.get(name),
                }
            )
        distance, drift = (way[-1] - way[0]).tolist()
        return {"distance": distance, "drift": drift, "speeds": rows}

    def _write(self, summary: Callable[[], dict[str, Any]]) -> None:
        """Replaces the file in one go, so that there is always a whole one."""
        if self.out is not None:
            self.wall["recording"] = self._recorded()
            text = json.dumps(summary(), indent=2, ensure_ascii=False) + "\n"
            write_whole(self.out / SUMMARY, text.encode())

    def _begin_film(self, speed: float) -> None:
        """Films the first frame; without OpenGL or an encoder it says so and goes on without."""
        if self.out is not None:
            with self._timed("video"), self._attempt(VIDEO):
                path = self.out / VIDEO
                self._film = Film(self.sim, path, fps=_FPS, speed=speed, camera=self.task.camera)
                self._film.frame()

    def _end_film(self) -> None:
        """Finishes the film."""
        if self._film is not None:
            with self._timed("video"):
                self._film.close()

    def _plot(self) -> None:
        """Draws the rollout; without Matplotlib it says so."""
        if self.out is not None:
            samples = {name: np.array(rows) for name, rows in self.samples.items()}
            with self._timed("plot"), self._attempt(PLOT):
                rollout_plot(
                    self.out / PLOT,
                    self.clock,
                    samples["power"],
                    samples["temperature"],
                    samples["tension"],
                    samples["bend"],
                    [name.partition(".")[2] for name in self.sim.tca_names],
                    self.phases,
                    body=samples["body"] if self.sim.embedded.any() else None,
                    title=f"{self._title}, seed {self.seed}: {self.ending}",
                )

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        """Notes what ended the episode from outside."""
        try:
            yield
        except KeyboardInterrupt:
            self.ending = "interrupted"
            raise
        except BaseException as error:
            self.ending = f"error: {type(error).__name__}: {error}"
            raise

    @contextmanager
    def _attempt(self, name: str) -> Iterator[None]:
        """Lets a file be left out if the machine lacks what it takes."""
        try:
            yield
        except (ImportError, RenderingUnavailable) as error:
            self.left_out[name] = str(error)
            self._film = None if name == VIDEO else self._film
            tqdm.write(f"{name} is left out: {error}")

    @contextmanager
    def _timed(self, purpose: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.wall[purpose] += time.perf_counter() - start

    def _recorded(self) -> float:
        """Time spent on the recording so far [s]."""
        return self.env.seconds if isinstance(self.env, RecordRerun) else 0.0

    def _event(self, text: str) -> None:
        if isinstance(self.env, RecordRerun):
            self.env.event(text)

    def _sample(self) -> None:
        sim = self.sim
        self.clock.append(sim.time)
        for name in ("power", "temperature", "tension"):
            self.samples[name].append(np.array(getattr(sim, name)))
        self.samples["body"].append(np.where(sim.embedded, sim.body_temperature, np.nan))
        self.samples["bend"].append(np.degrees(self.task.bent()))
        self.places.append(self.task.headway())


def _by_name(names: tuple[str, ...], values: NDArray[np.float64]) -> dict[str, float]:
    return {name: round(float(value), 4) for name, value in zip(names, values, strict=True)}

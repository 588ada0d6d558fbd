"""The scripted pick and place from beginning to end, with everything that is kept of it."""

import json
import os
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from tca_mj.agents.scripted import PickAndPlace
from tca_mj.envs.arm import OBSERVATION, ArmPickPlace
from tca_mj.envs.wrappers import RecordRerun, how_it_ended
from tca_mj.film import Film
from tca_mj.machine import machine, versions
from tca_mj.plots import rollout_plot
from tca_mj.render import RenderingUnavailable

TASK = "TCA/ArmPickPlace-v0"
SUMMARY, RECORDING, VIDEO, PLOT = "summary.json", "rollout.rrd", "rollout.mp4", "rollout.png"

_FPS = 20.0  # of the film: a picture costs as much as half a second of simulation
_BAR = "{desc:9} |{bar}| {n:.1f} of at most {total:.0f} s simulated, {elapsed} real"


class Policy(Protocol):
    """A policy that works in phases, as ``tca_mj.agents.scripted.PickAndPlace`` does."""

    @property
    def phase(self) -> str: ...
    @property
    def tries(self) -> int: ...
    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]: ...


def pick_and_place(
    *,
    object: str = "screwdriver",
    seed: int = 0,
    out: Path | None = None,
    video: bool = True,
    speed: float = 4.0,
    max_duration: float | None = None,
    policy: Policy | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Runs one episode of ``TCA/ArmPickPlace-v0`` and writes what happened.

    Into ``out`` go ``summary.json``, ``rollout.rrd``, ``rollout.mp4`` and ``rollout.png``; files
    of these names that lay there are replaced. However the episode ends, by Ctrl-C or an error
    too, they hold all that happened until then. What this machine cannot make (a film without
    OpenGL or imageio, a plot without Matplotlib) is left out with a line that says why.

    Args:
        object: ``"screwdriver"`` or ``"pcb"``.
        seed: Seed of the episode: where the object and the cup are.
        out: Folder for the files, made if it is missing; None to write nothing.
        video: Whether to make the film, which takes longer than the simulation.
        speed: Simulated seconds per second of film.
        max_duration: Simulated time after which to stop [s]; None for the task's own limit.
        policy: Who acts; None for a new ``PickAndPlace``.
        progress: Whether to show a progress bar, where there is a terminal.

    Returns:
        The summary, with

        * ``task``, ``object``, ``seed``, ``success``, and ``ending``: why it was over
        * ``duration`` [s]: simulated time
        * ``wall`` [s]: real time by purpose
        * ``real_time_factor``: simulated over real time of environment and policy alone
        * ``tries``: how often the policy went for the object
        * ``phases``: name, start and duration [s] of each
        * ``energy`` [J], ``peak_temperature`` [°C], ``peak_tension`` [N] of each TCA
        * ``object_position``, ``cup_position`` at the end [m]
        * ``versions``, ``machine``
        * ``files`` that were written, and ``left_out``: why others were not

    Raises:
        ValueError: If ``object``, ``speed`` or ``max_duration`` cannot be used.
        KeyboardInterrupt: As it came, after everything was written.
    """
    if max_duration is not None and not max_duration > 0.0:
        raise ValueError(f"max_duration must be above 0 s, got {max_duration}")
    if not (np.isfinite(speed) and speed > 0.0):
        raise ValueError(f"speed must be finite and above 0, got {speed}")
    env: gym.Env[Any, Any] = gym.make(TASK)
    limit = max_duration or np.inf
    if env.spec is not None and env.spec.max_episode_steps is not None:
        limit = min(limit, env.spec.max_episode_steps * ArmPickPlace.control_period)
    if out is not None:
        env = RecordRerun(env, out / RECORDING)
    episode = _Episode(env, policy or PickAndPlace(), object, seed, out)

    # What is called back at the end, the last first, whatever happens to the others.
    with ExitStack() as ends:
        if out is not None:
            ends.callback(episode.write_summary)
            ends.callback(episode.plot)
        ends.callback(env.close)
        ends.callback(episode.end_film)
        bar = tqdm(total=limit, bar_format=_BAR, disable=None if progress else True)
        ends.callback(bar.close)
        with episode.named_errors():
            if video:
                episode.begin_film(speed)
            while not episode.ending:
                episode.step()
                bar.set_description_str(episode.policy.phase, refresh=False)
                bar.update(episode.clock[-1] - bar.n)
                if not episode.ending and episode.clock[-1] > limit - 1e-6:
                    episode.ending = f"stopped after {limit:g} s"
    return episode.summary()


class _Episode:
    """One episode under way, and what was seen of it so far."""

    def __init__(
        self, env: gym.Env[Any, Any], policy: Policy, object: str, seed: int, out: Path | None
    ) -> None:
        """Resets the environment; only then are the files in ``out`` touched."""
        self.env, self.policy, self.object, self.seed, self.out = env, policy, object, seed, out
        task: Any = env.unwrapped
        self.sim = task.sim
        self._tip = self.sim.model.site("arm.bending.tip").id
        self.ending = ""
        self.success = False
        self.held_until = ""  # phase in which the arm last touched the object
        self.wall: dict[str, float] = defaultdict(float)
        self.left_out: dict[str, str] = {}
        self._film: Film | None = None
        self.observation, _ = env.reset(seed=seed, options={"object": object})
        self.clock: list[float] = []
        self._samples: dict[str, list[Any]] = defaultdict(list)
        self._phases: list[tuple[float, str]] = [(0.0, policy.phase)]
        self._event(policy.phase)
        self._sample()
        if out is not None:
            for name in (VIDEO, PLOT):
                (out / name).unlink(missing_ok=True)
            self.write_summary()

    def step(self) -> None:
        """One control period."""
        recorded = self._recorded()
        with self._timed("simulation"):
            action = self.policy.act(self.observation)
            phase = self.policy.phase
            if phase != self._phases[-1][1]:
                self._phases.append((self.sim.time, phase))
                self._event(phase)
            self.observation, _, terminated, truncated, info = self.env.step(action)
        self.wall["simulation"] -= self._recorded() - recorded
        self.wall["recording"] = self._recorded()
        self._sample()
        self.success = bool(info.get("success", False))
        if info.get("touched", False) and not self.success:
            self.held_until = phase
        self.ending = how_it_ended(terminated, truncated, info) or ""
        if self._film is not None:
            with self._timed("video"):
                self._film.frame()

    def summary(self) -> dict[str, Any]:
        """What ``pick_and_place`` returns, of the episode so far."""
        names, end = self.sim.tca_names, self.clock[-1]
        seen = OBSERVATION.read(np.asarray(self.observation, dtype=np.float64))
        starts = [start for start, _ in self._phases]
        written = [RECORDING, VIDEO, PLOT]
        return {
            "task": TASK,
            "object": self.object,
            "seed": self.seed,
            "success": self.success,
            "ending": self.ending or "still running",
            "duration": round(end, 6),
            "wall": {purpose: round(seconds, 3) for purpose, seconds in self.wall.items()},
            "real_time_factor": round(end / max(self.wall["simulation"], 1e-9), 2),
            "tries": self.policy.tries,
            "held_until": self.held_until,
            "phases": [
                {"name": name, "start": round(start, 6), "duration": round(until - start, 6)}
                for (start, name), until in zip(self._phases, [*starts[1:], end], strict=True)
            ],
            "energy": _by_name(names, self.sim.energy),
            "peak_temperature": _by_name(names, np.max(self._samples["temperature"], axis=0)),
            "peak_tension": _by_name(names, np.max(self._samples["tension"], axis=0)),
            "object_position": [round(float(x), 6) for x in seen["object position"]],
            "cup_position": [round(float(x), 6) for x in seen["cup position"]],
            "versions": versions(),
            "machine": machine(),
            "files": [n for n in written if self.out is not None and (self.out / n).is_file()],
            "left_out": self.left_out,
        }

    def write_summary(self) -> None:
        """Replaces the file in one go, so that there is always a whole one."""
        if self.out is not None:
            self.wall["recording"] = self._recorded()
            text = json.dumps(self.summary(), indent=2, ensure_ascii=False) + "\n"
            beside = self.out / f".{SUMMARY}"
            beside.write_text(text, encoding="utf-8")
            os.replace(beside, self.out / SUMMARY)

    def begin_film(self, speed: float) -> None:
        """Films the first frame; without OpenGL or an encoder it says so and goes on without."""
        if self.out is not None:
            with self._timed("video"), self._attempt(VIDEO):
                path = self.out / VIDEO
                self._film = Film(self.sim, path, fps=_FPS, speed=speed, camera="front")
                self._film.frame()

    def end_film(self) -> None:
        """Finishes the film."""
        if self._film is not None:
            with self._timed("video"):
                self._film.close()

    def plot(self) -> None:
        """Draws the rollout; without Matplotlib it says so."""
        if self.out is not None:
            samples = {name: np.array(rows) for name, rows in self._samples.items()}
            with self._timed("plot"), self._attempt(PLOT):
                rollout_plot(
                    self.out / PLOT,
                    self.clock,
                    samples["power"],
                    samples["temperature"],
                    samples["tension"],
                    samples["bend"],
                    [name.removeprefix("arm.") for name in self.sim.tca_names],
                    self._phases,
                    title=f"{self.object}, seed {self.seed}: {self.ending}",
                )

    @contextmanager
    def named_errors(self) -> Iterator[None]:
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
            self._samples[name].append(np.array(getattr(sim, name)))
        # Angle between the bending module's tip and straight down, which is its z axis at rest.
        down = -sim.data.site_xmat[self._tip][8]
        self._samples["bend"].append(np.degrees(np.arccos(np.clip(down, -1.0, 1.0))))


def _by_name(names: tuple[str, ...], values: NDArray[np.float64]) -> dict[str, float]:
    return {name: round(float(value), 4) for name, value in zip(names, values, strict=True)}

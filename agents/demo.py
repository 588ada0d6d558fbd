"""Demos from beginning to end, with everything that is kept of them."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from tca_mj.agents.actors import actor
from tca_mj.agents.course import CourseWalker
from tca_mj.agents.episode import RECORDING, Episode, Policy
from tca_mj.agents.evaluate import Evaluation
from tca_mj.agents.scripted import PickAndPlace
from tca_mj.envs.arm import OBSERVATION, ArmPickPlace
from tca_mj.envs.course import TetrapodCourse
from tca_mj.envs.morph import MorphModule
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.envs.wrappers import RecordRerun

TASK = "TCA/ArmPickPlace-v0"
COURSE = "TCA/TetrapodCourse-v0"

# Speeds of the real robot, Sun, Section 6.3.2, by the stage that shows them [m/s].
PUBLISHED_SPEED = {"crawl": 2.4e-3, "walk": 9e-3, "shimmy": 0.75e-3}


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
    env, limit = _made(TASK, out, speed, max_duration)
    task = _task(env)
    acting: Any = policy or PickAndPlace()
    episode = Episode(
        env, acting, seed=seed, out=out, bend=lambda: _bent(task), options={"object": object},
        title=object,
    )  # fmt: skip

    def summary() -> dict[str, Any]:
        seen = OBSERVATION.read(np.asarray(episode.observation, dtype=np.float64))
        return {
            "task": TASK,
            "object": object,
            **episode.summary(),
            "tries": acting.tries,
            "held_until": episode.held_until,
            "object_position": [round(float(x), 6) for x in seen["object position"]],
            "cup_position": [round(float(x), 6) for x in seen["cup position"]],
        }

    return episode.run(limit, speed=speed, video=video, progress=progress, summary=summary)


def tetrapod_course(
    *,
    seed: int = 0,
    out: Path | None = None,
    randomise: float = 0.0,
    video: bool = True,
    speed: float = 30.0,
    max_duration: float | None = None,
    policy: Policy | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Runs one episode of ``TCA/TetrapodCourse-v0`` and writes what happened.

    Files and their fate are those of ``pick_and_place``.

    Args:
        seed: Seed of the episode: where the robot starts, and its friction.
        out: Folder for the files, made if it is missing; None to write nothing.
        randomise: Share by which the friction is drawn at random, 0 to 0.5.
        video: Whether to make the film.
        speed: Simulated seconds per second of film.
        max_duration: Simulated time after which to stop [s]; None for the task's own limit.
        policy: Who acts; None for a new ``CourseWalker``.
        progress: Whether to show a progress bar, where there is a terminal.

    Returns:
        The summary: the keys of ``pick_and_place`` that do not speak of an object, and

        * ``friction``: factor of the friction
        * ``touched_plate``: whether the robot touched the plate or its posts
        * ``damaged``: whether a TCA was contracted against a stiff spine
        * ``heater_energy`` [J] of each spine
        * ``speeds``: for each stage name, ``distance`` [m], ``speed`` and ``published`` [m/s]

    Raises:
        ValueError: If ``randomise``, ``speed`` or ``max_duration`` cannot be used.
        KeyboardInterrupt: As it came, after everything was written.
    """
    env, limit = _made(COURSE, out, speed, max_duration)
    task = _task(env)
    acting: Any = policy or CourseWalker(task)
    places: list[float] = []

    def bend() -> float:
        places.append(float(task.position[0]))
        return _bent(task)

    episode = Episode(
        env, acting, seed=seed, out=out, bend=bend, options={"randomise": randomise},
        camera="follow", title="course",
    )  # fmt: skip

    def summary() -> dict[str, Any]:
        common = episode.summary()
        return {
            "task": COURSE,
            **common,
            "friction": round(float(episode.info["variation"]["friction"]), 6),
            "touched_plate": bool(episode.info["touched_plate"]),
            "damaged": bool(task.sim.spines.damaged.any()),
            "heater_energy": {k: round(v, 4) for k, v in episode.info["heater_energy"].items()},
            "speeds": _speeds(common["phases"], np.array(episode.clock), np.array(places)),
        }

    return episode.run(limit, speed=speed, video=video, progress=progress, summary=summary)


def play(
    task: str,
    policy: str | Path,
    *,
    seed: int = 0,
    out: Path | None = None,
    randomise: float = 0.0,
    video: bool = True,
    speed: float = 8.0,
    max_duration: float | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Runs one episode of any policy in any task and writes what happened.

    Files and their fate are those of ``pick_and_place``.

    Args:
        task: Gymnasium id.
        policy: Who acts, see ``tca_mj.agents.actors.actor``.
        seed: Seed of the episode.
        out: Folder for the files, made if it is missing; None to write nothing.
        randomise: Share by which the robot is off, see ``tca_mj.agents.evaluate.Evaluation``.
        video: Whether to make the film.
        speed: Simulated seconds per second of film.
        max_duration: Simulated time after which to stop [s]; None for the task's own limit.
        progress: Whether to show a progress bar, where there is a terminal.

    Returns:
        The summary: the keys of ``pick_and_place`` that do not speak of an object, and

        * ``policy``, ``heater_energy`` [J] of each spine, ``return``
        * ``distance`` and ``drift`` [m], of a robot that gets on

    Raises:
        FileNotFoundError: If there is no such policy.
        ValueError: If it is for another task, or an argument cannot be used.
        KeyboardInterrupt: As it came, after everything was written.
    """
    options = Evaluation(task=task, policy=str(policy), randomise=randomise).options
    env, limit = _made(task, None, speed, max_duration)
    acting = actor(policy, env, seed=seed)  # before a file is touched
    acting.reset()
    told = _task(env)
    episode = Episode(
        env if out is None else RecordRerun(env, out / RECORDING), acting, seed=seed, out=out,
        bend=lambda: _bent(told), options=options, camera=told.camera, title=f"{policy} in {task}",
    )  # fmt: skip

    def summary() -> dict[str, Any]:
        heater = dict(zip(told.sim.spines.names, told.sim.spines.energy.tolist(), strict=True))
        known = {key: float(episode.info.get(key, np.nan)) for key in ("distance", "drift")}
        return {
            "task": task, "policy": str(policy), **episode.summary(), "heater_energy": heater,
            "return": episode.total, **{k: v for k, v in known.items() if np.isfinite(v)},
        }  # fmt: skip

    return episode.run(limit, speed=speed, video=video, progress=progress, summary=summary)


def _made(
    task: str, out: Path | None, speed: float, max_duration: float | None
) -> tuple[gym.Env[Any, Any], float]:
    """The task, recorded if there is a folder, and its time limit [s]."""
    if max_duration is not None and not max_duration > 0.0:
        raise ValueError(f"max_duration must be above 0 s, got {max_duration}")
    if not (np.isfinite(speed) and speed > 0.0):
        raise ValueError(f"speed must be finite and above 0, got {speed}")
    env: gym.Env[Any, Any] = gym.make(task)
    limit = max_duration or np.inf
    if env.spec is not None and env.spec.max_episode_steps is not None:
        limit = min(limit, env.spec.max_episode_steps * _task(env).control_period)
    return (env if out is None else RecordRerun(env, out / RECORDING)), limit


def _task(env: gym.Env[Any, Any]) -> Any:
    return env.unwrapped


def _bent(task: Any) -> float:
    """What of the robot is bent, by which angle [deg]: spines, or the bending module's tip."""
    if isinstance(task, TetrapodGait):
        return float(np.degrees(task.stance.bend(task.data)))
    if isinstance(task, TetrapodCourse):
        return float(np.degrees(task.body_angle))
    if isinstance(task, MorphModule):
        return float(np.degrees(task.angle))
    name = "arm.bending.tip" if isinstance(task, ArmPickPlace) else "bench.module.tip"
    down = -task.data.site(name).xmat[8]  # the module's z axis is straight down at rest
    return float(np.degrees(np.arccos(np.clip(down, -1.0, 1.0))))


def _speeds(
    phases: list[dict[str, Any]], clock: np.ndarray, place: np.ndarray
) -> list[dict[str, Any]]:
    """Headway of each stage."""
    rows = []
    for phase in phases:
        ends = np.interp([phase["start"], phase["start"] + phase["duration"]], clock, place)
        distance = float(ends[1] - ends[0])
        rows.append(
            {
                "name": phase["name"],
                "distance": round(distance, 6),
                "speed": round(distance / max(phase["duration"], 1e-9), 6),
                "published": PUBLISHED_SPEED.get(phase["name"]),
            }
        )
    return rows

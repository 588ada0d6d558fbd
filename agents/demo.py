"""Demos from beginning to end, with everything that is kept of them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from tca_mj.agents.episode import PAGE, PLOT, RECORDING, VIDEO, Duration, Episode
from tca_mj.agents.policies import Policy, Preprocessing
from tca_mj.agents.policies.actors import actor, arguments_of
from tca_mj.checks import Seed, door
from tca_mj.files import claimed
from tca_mj.record.film import FilmSpeed
from tca_mj.registry import make


@door
def play(
    task: str,
    policy: str | Path | Policy = "scripted",
    *,
    seed: Seed = 0,
    options: Mapping[str, Any] | None = None,
    arguments: Mapping[str, Any] | None = None,
    preprocessing: Preprocessing | None = None,
    out: Path | None = None,
    video: bool = True,
    speed: FilmSpeed | None = None,
    max_duration: Duration | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Runs one episode of any policy in any task and writes what happened.

    Into ``out`` go ``summary.json``, ``rollout.rrd``, ``rollout.mp4``, ``rollout.html`` and
    ``rollout.png``; files of these names that lay there are replaced. However the episode ends, by
    Ctrl-C or an error too, they hold all that happened until then. What this machine cannot make (a
    film without OpenGL or imageio, a plot without Matplotlib) is left out with a line that says
    why, and so is what fails meanwhile, as on a full disk: nothing of that ends the episode. What
    begins no file is refused: a folder that cannot be written, or in which another demo writes its
    recording.

    Args:
        task: Gymnasium id, or ``module:id``.
        policy: Who acts: a policy, or what ``tca_mj.agents.policies.actors.actor`` knows by name.
        seed: Seed of the episode.
        options: Options of the reset.
        arguments: Of the task, on top of what a policy with a name needs.
        preprocessing: What became of the observations of a model of Stable-Baselines3.
        out: Folder for the files, made if it is missing; None to write nothing.
        video: Whether to make the film, which takes longer than the simulation.
        speed: Simulated seconds per second of film [1]; None for what suits the task.
        max_duration: Simulated time after which to stop, at most a day [s]; None for the task's own
            limit, where there is one.
        progress: Whether to show how far it is.

    Returns:
        The summary, None in place of numbers that a diverged end does not have, with

        * ``task``, ``policy``, ``seed``, ``success``, ``return``, and ``ending``: why it was over
        * ``duration`` [s]: simulated time
        * ``wall`` [s]: real time by purpose
        * ``real_time_factor``: simulated over real time of environment and policy alone
        * ``phases``: name, start and duration [s] of each
        * ``energy`` [J], ``peak_temperature`` [°C], ``peak_tension`` [N] of each TCA, and
          ``heater_energy`` [J] of each spine
        * ``tries`` of a policy that counts them, ``held_until``: when something was last touched
        * of a robot that gets on ``distance`` and ``drift`` [m]; and ``speeds``: for each phase
          ``distance`` [m], ``speed`` and ``published`` [m/s]
        * what the task says of its end (``SimulatedTask.outcome``)
        * ``versions``, ``machine``
        * ``files`` that were written, and ``left_out``: why others were not, or not to the end

    Raises:
        FileNotFoundError: If there is no such policy.
        ValueError: If it is for another task, or an argument cannot be used.
        BlockingIOError: If another process works in ``out``.
        OSError: If something cannot be written.
        KeyboardInterrupt: As it came, after everything was written.

    Example:
        >>> from tca_mj.agents import play
        >>> summary = play("TCA/BendReach-v0", max_duration=0.5, progress=False)
        >>> summary["duration"], summary["ending"]
        (0.5, 'stopped after 0.5 s')
    """
    named = isinstance(policy, str | Path)
    needed = arguments_of(str(policy), task) if named else {}
    env: gym.Env[Any, Any] = make(task, **needed | dict(arguments or {}))
    # Before a file is touched.
    acting = (
        actor(policy, env, seed=seed, preprocessing=preprocessing)
        if isinstance(policy, str | Path) else policy
    )  # fmt: skip
    name = str(policy) if named else type(policy).__name__
    files = (RECORDING, VIDEO, PAGE, PLOT) if video else (RECORDING, PAGE, PLOT)
    with nullcontext() if out is None else claimed(out):
        episode = Episode(
            env, acting, names=(task, name), seed=seed, out=out, options=options, files=files
        )
        limit = min(max_duration or np.inf, episode.limit)
        if limit == np.inf:
            raise ValueError(f"max_duration must be given for {task}, which has no end, got None")
        return episode.run(limit, speed=speed or episode.task.film_speed, progress=progress)

"""How good a policy is: episodes of a task, their figures, means and intervals.

Finished episodes are kept (``tca_mj.agents.finished``); a second run goes on where the first one
stopped. An episode depends on its seed and on the settings alone, not on the process that runs it
or on the episodes before it.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import tca_mj  # noqa: F401  (registers the tasks in a new process)
from tca_mj.agents.design import robot_of
from tca_mj.agents.finished import EPISODES, begun, keep
from tca_mj.agents.policies import Policy, Preprocessing
from tca_mj.agents.policies.actors import NAMES, actor, arguments_of, called
from tca_mj.agents.policies.load import find
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.rollout import rollout
from tca_mj.agents.workers import Processes, Workers
from tca_mj.checks import Checked, Seed, door, number, require_one_of, whole
from tca_mj.drive import Timestep
from tca_mj.files import claimed
from tca_mj.machine import machine, versions
from tca_mj.pages import table, write_result
from tca_mj.registry import EpisodeSteps, episode_steps, make, task_class
from tca_mj.tca import find_tca

REPORT = "summary.md"
_Real = Annotated[float, number]  # also one that is 0 but for rounding

# Name, unit, factor to the unit, and digits of what is reported.
METRICS = {
    "return": ("", 1.0, 2),
    "success": ("%", 100.0, 0),
    "duration": ("s", 1.0, 1),
    "speed": ("mm/s", 1e3, 2),
    "distance": ("mm", 1e3, 1),
    "drift": ("mm", 1e3, 1),
    "heading_error": ("°", 180.0 / np.pi, 1),
    "energy": ("J", 1.0, 1),
    "energy_per_metre": ("kJ/m", 1e-3, 2),
    "cost_of_transport": ("", 1.0, 0),
    "peak_temperature": ("°C", 1.0, 1),
    "peak_tension": ("N", 1.0, 3),
}
_RATIOS = ("energy_per_metre", "cost_of_transport")
_LEVEL, _RESAMPLES = 0.95, 10_000
Episodes = Annotated[int, partial(whole, at_least=1, at_most=10_000)]
"""How many at most: means are then known to a hundredth of what single ones differ by."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Evaluation(Checked):
    """What is evaluated.

    Attributes:
        task: Gymnasium id, or ``module:id``.
        policy: Who acts, see ``tca_mj.agents.policies.actors.actor``.
        episodes: How many episodes, 1 to 10 000.
        seed: Seed of the first one; the others follow.
        randomise: Share by which the robot is off, the task's option ``randomise``; 0 is nominal.
        steps: Control steps after which an episode is over; None for the task's own limit, where
            there is one.
        model: ``used``, or the name of one of the task's finer models.
        timestep: Physics time step [s]; None for the task's own.
        design: Figures of the robot that differ from the default, see
            ``tca_mj.agents.design.robot_of``.
        arguments: What the task is made with, on top of what the policy's file says: ``action``,
            ``control_period``, ``tca``.
        preprocessing: What became of the observations of a model of Stable-Baselines3.
        options: Options of every reset besides ``randomise``.

    Raises:
        ValueError: If something is unknown or out of range.
    """

    task: str
    policy: str = "scripted"
    episodes: Episodes = 10
    seed: Seed = 0
    randomise: Annotated[float, partial(number, at_least=0.0, at_most=0.5)] = 0.0
    steps: EpisodeSteps | None = None
    model: str = "used"
    timestep: Timestep | None = None
    design: Mapping[str, Any] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    preprocessing: Preprocessing = Preprocessing()
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        require_one_of("model", self.model, ("used", *task_class(self.task).finer))
        if self.steps is None and episode_steps(self.task) is None:
            raise ValueError(f"steps must be given for {self.task}, which has no end, got None")
        if self.design:
            robot_of(self.task, self.design)

    @property
    def begins_with(self) -> dict[str, Any]:
        """Options of the reset."""
        return {**({"randomise": self.randomise} if self.randomise else {}), **self.options}

    def key(self) -> str:
        """Tells apart what must not be mixed: settings, the policy's contents, versions."""
        settings = asdict(self)
        del settings["episodes"], settings["seed"]
        for name, usual in (
            ("design", {}), ("arguments", {}), ("preprocessing", Preprocessing()), ("options", {}),
        ):  # fmt: skip
            if getattr(self, name) == usual:
                del settings[name]
        for made in ("arguments", "design"):  # a file is what it holds
            if made in settings:
                settings[made] = {
                    name: repr(find_tca(value)) if str(value).endswith(".json") else value
                    for name, value in settings[made].items()
                }  # fmt: skip
        if self.policy not in NAMES:
            content = b"" if called(self.policy) else find(self.policy).read_bytes()
            settings["policy"] = self.policy if not content else hashlib.sha256(content).hexdigest()
        text = json.dumps([settings, versions()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def make(self) -> gym.Env[Any, Any]:
        """The environment, as the policy needs it.

        Raises:
            ValueError: If the time step does not fit.
        """
        more = arguments_of(self.policy, self.task) | dict(self.arguments)
        more |= {} if self.timestep is None else {"timestep": self.timestep}
        task = task_class(self.task)
        if self.design:
            more |= robot_of(self.task, self.design)
        if self.model != "used":
            argument, default = task.robot_argument
            more |= task.finer[self.model](more.get(argument) or default())
        return make(self.task, max_episode_steps=self.steps, **more)

    @door
    def actor(self, env: gym.Env[Any, Any], seed: Seed) -> Policy:
        """Who acts in an environment; errors as ``tca_mj.agents.policies.actors.actor``."""
        other = bool(self.design) or self.model != "used"
        return actor(
            self.policy, env, seed=seed, preprocessing=self.preprocessing, other_robot=other
        )


@door
def run_episode(evaluation: Evaluation, seed: Seed) -> dict[str, Any]:
    """Runs one episode.

    Args:
        evaluation: What is evaluated.
        seed: Seed of the episode.

    Returns:
        ``seed``, ``steps``, ``ending``, and the figures of ``METRICS``: ``return``; ``success``
        (what the task calls so; of a gait, whether it came to the end of its time); ``duration``
        [s]; ``speed`` [m/s], ``distance`` and ``drift`` (its size) [m] where the robot gets on, and
        the largest ``heading_error`` (its size) [rad] where it has one;
        ``energy`` of TCAs and heaters [J]; ``weight`` [N] there; ``peak_temperature`` [°C] and
        ``peak_tension`` [N] of the TCAs.
    """
    env = evaluation.make()
    try:
        policy = evaluation.actor(env, seed)
        task: Any = env.unwrapped
        episode = rollout(env, policy, seed=seed, options=evaluation.begins_with)
        step, start = next(episode), task.headway()
        total, hottest, tightest, steps, astray = 0.0, -np.inf, 0.0, 0, 0.0
        for step in episode:
            total, steps = total + step.reward, steps + 1
            hottest = max(hottest, float(task.sim.temperature.max()))
            tightest = max(tightest, float(task.sim.tension.max()))
            astray = max(astray, abs(step.info.get("heading_error", 0.0)))
        row = {
            "seed": seed,
            "steps": steps,
            "ending": step.ending,
            "return": total,
            "success": step.succeeded(task),
            "duration": float(task.sim.time),
            "energy": float(task.energy),
            "peak_temperature": hottest,
            "peak_tension": tightest,
        }
        end = task.headway()
        if start is not None and end is not None:
            along = end.along - start.along
            row |= {
                "distance": along,
                "drift": abs(end.aside - start.aside),
                "speed": along / task.sim.time,
                "weight": end.weight,
            }
        if "heading_error" in step.info:
            row["heading_error"] = astray
        return row
    finally:
        env.close()


@door
def evaluate(
    evaluation: Evaluation,
    *,
    out: Path | None = None,
    workers: Processes = 1,
    fresh: bool = False,
    progress: bool = True,
) -> dict[str, Any]:
    """Runs what is missing of the episodes, and sums up.

    Args:
        evaluation: What is evaluated.
        out: Folder for ``episodes.jsonl``, ``summary.json`` and ``summary.md``; None to write
            nothing.
        workers: Processes, 1 to 1024; nothing depends on their number.
        fresh: Whether to run again what the folder holds. Episodes of other settings, policies or
            versions of packages are not taken; changes of the code are not seen.
        progress: Whether to show how far it is.

    Returns:
        ``settings``, ``key``, ``figures`` (see ``figures``), ``episodes`` by seed, ``versions``,
        ``machine``.

    Raises:
        FileNotFoundError: If there is no such policy.
        ValueError: If it is for another task, or ``workers`` is out of bounds.
        BlockingIOError: If another process works in ``out``.
        OSError: If something cannot be written.
        KeyboardInterrupt: As it came; the episodes that were finished are kept.
    """
    key = evaluation.key()
    env = evaluation.make()
    evaluation.actor(env, evaluation.seed)  # before any process starts: who is wrong is told now
    env.close()
    seeds = range(evaluation.seed, evaluation.seed + evaluation.episodes)
    with nullcontext() if out is None else claimed(out):
        done = {} if out is None else begun(out / EPISODES, key, fresh=fresh)
        missing = [seed for seed in seeds if seed not in done]
        bar = progress_bar(
            len(seeds), unit="episodes", done=len(seeds) - len(missing), progress=progress
        )
        with bar, Workers(min(workers, len(missing))) as processes:
            for _, row in processes.run(run_episode, [(evaluation, seed) for seed in missing]):
                done[row["seed"]] = row
                if out is not None:
                    keep(out / EPISODES, key, row)
                mean = np.mean([row["return"] for row in done.values()])
                bar.set_postfix({"return": f"{mean:.2f}"}, refresh=False)
                bar.update()
        return _summed_up(evaluation, [done[seed] for seed in seeds], key, out)


def _summed_up(
    evaluation: Evaluation, rows: list[dict[str, Any]], key: str, out: Path | None
) -> dict[str, Any]:
    """The summary, which is also written."""
    summary = {
        "settings": asdict(evaluation),
        "key": key,
        "figures": figures(rows),
        "episodes": rows,
        "versions": versions(),
        "machine": machine(),
    }
    write_result(out, "summary", summary, report(summary))
    return summary


@door
def figures(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float | None]]:
    """Means over episodes, with 95 % intervals, of the ``METRICS`` that the rows have.

    Each has ``mean``, ``low`` and ``high`` (the interval, None where there is none), ``least`` and
    ``most``. Intervals are Student's t, Wilson's for ``success``. Energy per metre and cost of
    transport E/(m g d) are ratios of sums over episodes, with percentiles of 10 000 bootstrap
    resamples of the episodes; they are None if the robot did not get on.

    Args:
        rows: Episodes, as ``run_episode`` returns them; at least one.

    Raises:
        ValueError: If there is none, or a figure of one is missing or no number.
    """
    if not rows:
        raise ValueError("rows must be episodes, got none")
    columns = {name: np.array([_figure(name, row) for row in rows])
               for name in (*METRICS, "weight") if name in rows[0]}  # fmt: skip
    found: dict[str, dict[str, float | None]] = {}
    for name in METRICS:
        if name in _RATIOS and "distance" in columns:
            per = columns["weight"] if name == "cost_of_transport" else 1.0
            found[name] = _ratio(columns["energy"], columns["distance"] * per)
        elif name in columns:
            values = columns[name]
            low, high = _interval(name, values)
            found[name] = {
                "mean": float(values.mean()), "low": low, "high": high,
                "least": float(values.min()), "most": float(values.max()),
            }  # fmt: skip
    return found


def _figure(name: str, row: Mapping[str, Any]) -> float:
    """One figure of an episode."""
    found = row.get(name)
    return float(found) if isinstance(found, bool | np.bool_) else number(name, found)


def _interval(name: str, values: NDArray[np.float64]) -> tuple[float | None, float | None]:
    """Wilson's interval of ``success``, Student's of a mean."""
    from scipy import stats  # loaded late: it takes a second

    n, mean = len(values), float(values.mean())
    if name == "success":
        test = stats.binomtest(round(float(values.sum())), n)
        share = test.proportion_ci(_LEVEL, method="wilson")
        return float(share.low), float(share.high)
    if n < 2:
        return None, None
    half = float(stats.t.ppf(0.5 + _LEVEL / 2.0, n - 1) * stats.sem(values))
    return mean - half, mean + half


def _ratio(above: NDArray[np.float64], below: NDArray[np.float64]) -> dict[str, float | None]:
    """Ratio of the sums; its extremes are those of single episodes."""
    nothing: dict[str, float | None] = dict.fromkeys(("mean", "low", "high", "least", "most"))
    if below.sum() <= 0.0:
        return nothing
    mean = float(above.sum() / below.sum())
    if (below <= 0.0).any():
        return {**nothing, "mean": mean}
    each = above / below
    drawn = np.random.default_rng(0).integers(len(above), size=(_RESAMPLES, len(above)))
    tail = 100.0 * (1.0 - _LEVEL) / 2.0
    low, high = np.percentile(above[drawn].sum(axis=1) / below[drawn].sum(axis=1),
                              [tail, 100.0 - tail])  # fmt: skip
    interval = {} if len(above) < 2 else {"low": float(low), "high": float(high)}
    extremes = {"least": float(each.min()), "most": float(each.max())}
    return {**nothing, "mean": mean, **interval, **extremes}


def label(name: str) -> str:
    """A figure's name and unit, as the title of a row or column.

    Args:
        name: Name of the figure, one of ``METRICS``.

    Raises:
        ValueError: If there is no such figure.
    """
    unit = METRICS[require_one_of("name", name, list(METRICS))][0]
    return name.replace("_", " ") + (f" [{unit}]" if unit else "")


@door
def cell(name: str, figure: Mapping[str, _Real | None], *, interval: bool = True) -> str:
    """A figure in its unit: mean, and the interval in brackets.

    Args:
        name: Name of the figure, one of ``METRICS``.
        figure: Its mean and interval, as ``figures`` returns them.
        interval: Whether the interval is wanted.

    Raises:
        ValueError: If there is no such figure.
    """
    require_one_of("name", name, list(METRICS))
    text, low, high, *_ = _shown(name, figure)
    return f"{text} ({low} to {high})" if interval and low else text


def _shown(name: str, figure: Mapping[str, float | None]) -> list[str]:
    """Mean, low, high, least and most of a figure in its unit, empty where there is none."""
    _, factor, digits = METRICS[name]
    values = [figure.get(key) for key in ("mean", "low", "high", "least", "most")]
    return ["" if v is None else f"{round(factor * v, digits) + 0.0:.{digits}f}" for v in values]


def report(summary: dict[str, Any]) -> str:
    """A summary as Markdown."""
    settings, rows = summary["settings"], summary["episodes"]
    lines = []
    for name, figure in summary["figures"].items():
        mean, low, high, *extremes = _shown(name, figure)
        lines.append([label(name), mean, f"{low} to {high}" if low else "", *extremes])
    return "\n".join(
        [
            f"{settings['policy']} in {settings['task']}, {len(rows)} episodes: mean, 95 % interval"
            " (Student's t; success: Wilson; energy per metre and cost of transport: bootstrap)",
            "",
            *table(["figure", "mean", "95 % interval", "least", "most"], lines),
            "",
            *endings(rows),
        ]
    )


def endings(rows: Iterable[dict[str, Any]]) -> list[str]:
    """How the episodes ended, as Markdown."""
    counts = Counter(row["ending"] for row in rows)
    return [f"* {count} x {ending}" for ending, count in sorted(counts.items())]

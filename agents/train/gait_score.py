"""How good a gait is: headway over whole cycles, and the score by which a search ranks gaits."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field
from itertools import islice
from typing import Any

import gymnasium as gym
import numpy as np

from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.rollout import rollout
from tca_mj.checks import Checked, Positive
from tca_mj.control import Gait

# Where penalties begin, somewhat within what is demanded of a gait, and how much they cost. The
# demands: no more energy per metre than the scripted gait, a drift below 20 %, at most 180 °C and
# 0.78 N. Weights are estimates: what breaks a demand by a tenth costs as much as a fifth of the
# speed.
ENERGY_SHARE, ENERGY_WEIGHT = 0.98, 2.0  # of the energy per metre of the reference
DRIFT_SHARE, DRIFT_WEIGHT = 0.1, 2.0  # of the distance
HOTTEST, HEAT_WEIGHT = 176.0, 0.1  # [°C], [1/K]
TENSION, TENSION_WEIGHT = 0.70, 10.0  # [N], [1/N]
SLOWEST = 0.2  # share of the reference's speed that the drift is counted against at least


@dataclass(frozen=True, kw_only=True, slots=True)
class Trial:
    """One episode to run.

    Attributes:
        task: Gymnasium id of a task with legs.
        gait: The gait.
        steering: As in ``GaitPolicy``, per leg [K/rad].
        seed: Seed of the episode.
        options: Options of the episode, whose way is straight ahead.
        settling: Time that is not judged, in which the TCAs become warm; rounded to whole cycles
            [s].
        window: Time that is judged, rounded to whole cycles, at least one [s].
        robot: What its task is made with besides: the robot's muscle, another robot.
    """

    task: str
    gait: Gait
    steering: tuple[float, ...]
    seed: int
    options: Mapping[str, float]
    settling: float
    window: float
    robot: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, slots=True)
class Headway:
    """What came of an episode after the time for settling.

    Attributes:
        speed: Along the commanded direction [m/s].
        aside: Drift across it, positive to the left [m/s].
        power: Mean electrical power [W].
        temperature: Highest of a leg's TCA [°C].
        tension: Largest of a leg's TCA [N].
        missed: Share of the episode that was missed because it ended early.
        steps: Control steps that were run.
    """

    speed: float
    aside: float
    power: float
    temperature: float
    tension: float
    missed: float
    steps: int


def run_trial(trial: Trial) -> Headway:
    """Runs an episode. What comes out depends on ``trial`` alone."""
    env = walking(trial.task, **trial.robot)
    policy = GaitPolicy.in_task(env, trial.gait, trial.steering)
    period, tcas = policy.control_period, np.size(policy.heat.capacity)
    cycle = trial.gait.period / period
    first = round(round(trial.settling / trial.gait.period) * cycle)
    steps = first + round(max(1, round(trial.window / trial.gait.period)) * cycle)
    options = {**trial.options, "direction": 0.0}
    episode = rollout(env, policy, seed=trial.seed, options=options)
    infos = [step.info for step in islice(episode, steps + 1)]
    done = len(infos) - 1
    begin, end = infos[min(first, done)], infos[-1]
    # An early end leaves less distance for the same time; the power is that of the time walked.
    judged = (steps - first) * period
    walked = max(done - first, 1) * period
    return Headway(
        speed=(end["distance"] - begin["distance"]) / judged,
        aside=(end["drift"] - begin["drift"]) / judged,
        power=float(np.sum(end["energy"] - begin["energy"])) / walked,
        temperature=float(np.max([info["temperature"][:tcas] for info in infos[1:]])),
        tension=float(np.max([info["tension"][:tcas] for info in infos[1:]])),
        missed=1.0 - done / steps,
        steps=done,
    )


@functools.cache  # one in each process
def walking(task: str, **robot: Any) -> gym.Env[Any, Any]:
    """The environment of a trial's task, made with a muscle or another robot, too."""
    return gym.make(task, disable_env_checker=True, action="power", **robot)


@dataclass(frozen=True, kw_only=True, slots=True)
class Reference(Checked):
    """The gait that others are compared with: its mean speed [m/s] and electrical power [W]."""

    speed: Positive
    power: Positive

    @classmethod
    def of(cls, trials: Sequence[Headway]) -> "Reference":
        """That of the episodes of the scripted gait."""
        return cls(
            speed=float(np.mean([trial.speed for trial in trials])),
            power=float(np.mean([trial.power for trial in trials])),
        )


def score(trials: Sequence[Headway], reference: Reference) -> dict[str, float]:
    """Judges a gait by its episodes.

    Args:
        trials: At least one.
        reference: The scripted gait of the task.

    Returns:
        ``score``, the larger the better: ``speed`` minus ``energy``, ``drift``, ``heat``,
        ``tension`` and ``fall``, with v the mean speed over the reference's and p the mean power
        over the reference's:
        speed: v.
        energy: 2 max(0, p - 0.98 v); p/v is energy per metre over the reference's.
        drift: 2 max(0, d - 0.1), d the mean of what is drifted over the distance, which is
            counted as at least a fifth of the reference's.
        heat: 0.1 for each kelvin by which the hottest TCA is above 176 °C, mean.
        tension: 10 for each newton by which the tightest TCA is above 0.70 N, mean.
        fall: Share of the episodes that ended early, and mean share of the time that they missed.
    """
    speeds, aside, powers, temperature, tension, missed, _ = (
        np.array(column, dtype=np.float64) for column in zip(*map(astuple, trials), strict=True)
    )
    speed = float(speeds.mean()) / reference.speed
    power = float(powers.mean()) / reference.power
    distance = np.maximum(speeds, SLOWEST * reference.speed)
    drift = float(np.mean(np.abs(aside) / distance))
    terms = {
        "speed": speed,
        "energy": -ENERGY_WEIGHT * max(0.0, power - ENERGY_SHARE * speed),
        "drift": -DRIFT_WEIGHT * max(0.0, drift - DRIFT_SHARE),
        "heat": -HEAT_WEIGHT * float(np.mean(np.maximum(temperature - HOTTEST, 0.0))),
        "tension": -TENSION_WEIGHT * float(np.mean(np.maximum(tension - TENSION, 0.0))),
        "fall": -float(np.mean((missed > 0.0) + missed)),
    }
    return {"score": sum(terms.values()), **terms}

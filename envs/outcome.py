"""What a step of a task leads to, and what an episode is, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import some
from tca_mj.drive import SimulationDiverged, SimulationOverheated
from tca_mj.sim import Simulation
from tca_mj.state import SimulationState
from tca_mj.variation import Variation

Observation = NDArray[np.float32]
Action = NDArray[np.float32]
Outcome = tuple[Observation, float, bool, bool, dict[str, Any]]
"""What ``step`` returns: observation, reward, terminated, truncated and info."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Verdict:
    """What a task says of a step that went well.

    Attributes:
        terms: Its own terms of the reward.
        success: Whether the task is done, which ends the episode.
        ended: What else ends it, or None.
        seen: Rows of the observation that judging has changed.
    """

    terms: Mapping[str, float]
    success: bool = False
    ended: str | None = None
    seen: Mapping[str, ArrayLike] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, slots=True)
class Headway:
    """How a robot gets on.

    Attributes:
        along: Distance along its way [m].
        aside: Distance from the line of its way, positive to the left [m].
        weight: Weight of the robot [N].
    """

    along: float
    aside: float
    weight: float


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TaskState:
    """The state of an episode.

    Attributes:
        simulation: That of the simulation.
        variation: By how much the robot is off.
        random: That of the generator.
        episode: What the task itself remembers.
    """

    simulation: SimulationState
    variation: Variation
    random: Mapping[str, Any]
    episode: Mapping[str, Any]


def together(before: Outcome | None, now: Outcome) -> Outcome:
    """Outcome of two intervals of one step, the later of which is ``now``."""
    if before is None:
        return now
    observation, _, terminated, truncated, info = now
    earned = before[4]["reward_terms"]
    terms = {name: earned[name] + term for name, term in info["reward_terms"].items()}
    info |= {"reward_terms": terms, "cost": before[4]["cost"] + info["cost"]}
    return observation, float(sum(terms.values())), terminated, truncated, info


def measured(sim: Simulation) -> dict[str, Any]:
    """What every ``info`` says of a simulation; see ``SimulatedTask``."""
    spines = sim.spines
    return {
        "time": sim.time,
        "energy": sim.energy.copy(),
        "heater_energy": spines.energy.copy(),
        "temperature": sim.temperature.copy(),
        "body_temperature": sim.body_temperature.copy(),
        "spine_temperature": spines.temperature.copy(),
        "extrapolated": sim.extrapolated,
        "tension": sim.tension,
        "damaged": spines.damaged.copy(),
    }


def finite(info: dict[str, Any]) -> dict[str, Any]:
    """An info in which what is not finite is 0."""
    return {
        key: finite(value) if isinstance(value, dict)
        else np.nan_to_num(value, posinf=0.0, neginf=0.0) if np.asarray(value).dtype.kind == "f"
        else value
        for key, value in info.items()
    }  # fmt: skip


def harm(sim: Simulation, hottest: float, hottest_spine: float) -> str | None:
    """What a robot does not survive, or None.

    Args:
        sim: Its simulation.
        hottest: Temperature that its TCAs survive [°C].
        hottest_spine: Temperature that its spines survive [°C].
    """
    hot = sim.temperature > hottest
    if some(hot):
        name = sim.tca_names[int(np.argmax(hot))]
        return f"overheated: {name} above {hottest} °C"
    burnt = sim.spines.temperature > hottest_spine
    if some(burnt):
        name = sim.spines.names[int(np.argmax(burnt))]
        return f"overheated: {name} above {hottest_spine} °C"
    if not sim.breakable:
        return None
    torn = sim.tension > sim.bank.breaking_force
    if some(torn):
        i = int(np.argmax(torn))
        return f"torn: {sim.tca_names[i]} above {sim.bank.breaking_force[i]} N"
    return None


def broken_off(error: SimulationDiverged | None) -> str | None:
    """Why a simulation broke off, as a reason to truncate an episode; None if it did not."""
    if error is None:
        return None
    kind = "overheated" if isinstance(error, SimulationOverheated) else "diverged"
    return f"{kind}: {error}"


def how_it_ended(terminated: bool, truncated: bool, info: dict[str, Any]) -> str | None:
    """Why an episode is over, in a few words; None if it goes on."""
    if terminated:
        return "success" if info.get("success") else info.get("termination_reason", "terminated")
    if truncated:
        return info.get("truncation_reason", "time limit")
    return None

"""The tetrapod's course in less time: shapes change faster, and learned gaits carry the robot.

What takes time to change a shape is that spines cool: from 116 to 75 °C in 27 s in still air, in
12 s with the fan. Here they are warmed while the robot still walks, cool as soon as the body has
its shape, and the legs go on at 88 °C, where the spines are half as stiff as cold ones, while the
TCAs hold the shape until they are rigid.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies.files import SavedPolicy
from tca_mj.agents.policies.load import find
from tca_mj.agents.policies.network import Network
from tca_mj.agents.scripts.course import HURRY, STEP, Bend, CourseWalker, Go
from tca_mj.agents.scripts.tetrapod import CRAWL, WALK
from tca_mj.control import Gait
from tca_mj.envs.command import Command, Following
from tca_mj.envs.course import Places, TetrapodCourse
from tca_mj.envs.gaits import TASKS, told
from tca_mj.envs.table import Table
from tca_mj.registry import task_class
from tca_mj.variation import AMBIENT

Array = NDArray[np.float64]

SHOVE = Gait(
    period=4.35, offset=(0.0, 0.0, 0.017, 0.017),
    start=((0.09, 0.173, 0.555),) * 2 + ((0.09, 0.391, 0.781),) * 2,
    duty=((0.404, 0.438, 0.553),) * 2 + ((0.314, 0.395, 0.430),) * 2,
    hot=((159.0, 161.0, 158.0),) * 2 + ((171.0, 171.0, 172.0),) * 2,
    warm=((67.0, 75.0, 57.0),) * 2 + ((84.0, 58.0, 53.0),) * 2,
)  # fmt: skip
"""How to get onto the beam: all legs together, those of the rear more strongly. Searched by CMA-ES
(``scripts/stroke_search.py mount``), begun with ``PUSH`` with as hot TCAs, on three robots that are
off in everything (seeds 300, 308 and 309), physics at 10 ms: on it in 35, 58 and 35 s, where that
takes 60, 171 and 47."""

CLASP = Gait(
    period=5.82, offset=(0.0, 0.0, 0.434, 0.434),
    start=((0.02, 0.142, 0.499),) * 2 + ((0.02, 0.150, 0.502),) * 2,
    duty=((0.391, 0.465, 0.523),) * 2 + ((0.375, 0.511, 0.487),) * 2,
    hot=((168.0, 170.0, 172.0),) * 2 + ((170.0, 169.0, 170.0),) * 2,
    warm=((66.0, 25.0, 34.0),) * 2 + ((45.0, 26.0, 32.0),) * 2,
)  # fmt: skip
"""The shimmy on this beam, which is wider than that of the shimmy's own task, and of a body that
clamps by what its TCAs can. Searched by CMA-ES (``scripts/stroke_search.py shimmy``), begun with
the searched gait of that task, on robots whose TCAs are weak or whose body is heavy (seeds 308, 315
and 317), physics at 10 ms: off the beam in 56, 52 and 56 s. Their geometric mean is 55 s, where
that gait has 64."""

# Turn over the way aside [rad/m], and the largest [rad]: by trial, on seeds 219, 303 and 310.
_BACK, _MOST = 8.0, 0.12
_TURN = 2.0 * math.pi

SCRIPTED: dict[str, Any] = {"crawl": CRAWL, "walk": WALK, "mount": SHOVE, "shimmy": HURRY[:1]}
LEARNED: dict[str, Any] = {"crawl": "crawl", "walk": "walk", "mount": SHOVE, "shimmy": ("shimmy",)}
SPECIALISTS = {gait: f"tetrapod-{gait}-sac" for gait in TASKS}
SHAPES = dict.fromkeys(TASKS, "tetrapod-shapes")


def quick(places: Places, gaits: Mapping[str, Any]) -> tuple[Go | Bend, ...]:
    """The course, stage by stage.

    Args:
        places: Where things are along it.
        gaits: ``Go.gait`` of the stages: "crawl", "walk" (twice), "mount" and "shimmy" (twice).
    """
    station, edge, end = places.leg_station, places.first_edge, places.beam_end
    walking, wide = math.radians(95.0), math.radians(115.0)
    # A gait that gets stuck, as a learned one may where it has not learned to be, is relieved.
    crawl: dict[str, Any] = {"gait": (gaits["crawl"], CRAWL), "steers": True, "pace": 2e-3}
    walk: dict[str, Any] = {"gait": (gaits["walk"], WALK), "steers": True, "pace": 2e-3}
    # Weak TCAs need more time for a stroke than the shimmy gives them.
    found = SavedPolicy.read(find("tetrapod-shimmy")).gait
    assert found is not None
    # Which are tried below 3.5 and 1.5 mm/s: by trial, on seeds 300 to 318.
    strokes = (CLASP, replace(found, period=1.6 * found.period), HURRY[2])
    astride: dict[str, Any] = {
        "gait": (*gaits["shimmy"], *strokes), "above": places.beam_top, "clings": True,
        "pace": (3.5e-3, 1.5e-3, 1.5e-3),
    }  # fmt: skip
    brisk: dict[str, Any] = {"brisk": True, "stiff": 88.0, "rest": 0.0}
    return (
        Go(name="crawl", until=places.stand, **crawl),
        Bend(name="stand up", angle=walking, steps=WALK, ahead=0.03, **brisk),
        # Some stand with their front legs over the edge before; from there, too, they mount.
        Go(name="walk", until=edge - station + 0.019, patience=5.0, **walk),
        # A robot that falls back as it comes to lie on the beam needs a minute to make up for it.
        Go(name="mount", gait=gaits["mount"], until=edge + station + 0.004, patience=90.0,
           steers=True),
        Bend(name="clamp", angle=math.radians(220.0), short=math.radians(15.0), reaching=True,
             ahead=0.01, **brisk),
        Go(name="shimmy", until=end - 0.005, patience=200.0, **astride),
        # On until the last spine has left the beam, 5 mm wide and 40 mm behind the middle.
        Go(name="step off", until=end + 0.0445, patience=60.0, **astride),
        *(
            Bend(name="open", angle=math.radians(angle), steps=STEP, braced=True, enough=wide,
                 **{**brisk, "rest": 10.0})
            for angle in (165.0, 130.0, *(104.0,) * 6)
        ),
        # All of the body is on the target from 15 mm before its middle.
        Go(name="walk on", until=places.target - 0.014, above=places.lower, **walk),
        Bend(name="lie down", angle=None, steps=STEP, ahead=0.05, brisk=True, rest=0.0),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class LearnedGait:
    """A learned gait, with what its policy and its task say of it.

    Attributes:
        network: The policy's network.
        period: For how long it holds what it asks for [s].
        table: What it sees.
        hottest: Temperature that an action of 1 asks for [°C].
    """

    network: Network
    period: float
    table: Table
    hottest: float

    @classmethod
    def of(cls, saved: SavedPolicy) -> LearnedGait:
        """That of a policy.

        Raises:
            ValueError: If the policy has no network, asks for something else than the temperatures
                of four legs, or sees something else than its task shows.
        """
        task = task_class(saved.task)
        if saved.network is None:
            raise ValueError(f"policy must have a network, got a {saved.kind} for {saved.task}")
        if saved.arguments.get("action", "temperature") != "temperature":
            raise ValueError(f"policy must ask for temperatures, got {dict(saved.arguments)}")
        table: Table | None = getattr(task, "table", None)
        if table is None or task.legs != 4:
            raise ValueError(f"policy must be for a task with four legs, got {saved.task}")
        seen = [[row.name, row.size, row.unit] for row in table.entries]
        learned = [[name, *row[:2]] for name, row in saved.made_for.get("observation", {}).items()]
        if learned and learned != seen:
            raise ValueError(f"policy must see what {saved.task} shows, {seen}, got {learned}")
        period = saved.arguments.get("control_period") or task.control_period
        return cls(network=saved.network, period=float(period), table=table,
                   hottest=float(task.safe_temperature))  # fmt: skip

    def temperatures(self, rows: Mapping[str, Any]) -> Array:
        """What it asks for, shape (4, 3), where it sees some rows [°C]."""
        asked = self.network(self.table.pack(rows)).astype(np.float64)
        return (AMBIENT + (asked + 1.0) * (self.hottest - AMBIENT) / 2.0).reshape(4, 3)


class Learned:
    """What learned gaits ask of the legs on the course: temperatures, each held as it learned to.

    They see what they saw when they learned: the robot's own motion, TCAs, feet and contacts, and
    how far it is off the line down the middle of the course.
    """

    def __init__(self, task: TetrapodCourse, policies: Mapping[str, str]) -> None:
        """Reads the policies.

        Args:
            task: The task.
            policies: Name or file of the policy of each shape.

        Raises:
            FileNotFoundError: If there is no such policy.
            ValueError: As ``LearnedGait.of``.
        """
        self._task = task
        self.gaits = {
            gait: LearnedGait.of(SavedPolicy.read(find(name))) for gait, name in policies.items()
        }
        self._following, self._time = Following(Command()), 0.0
        self._asked = np.full((4, 3), AMBIENT)

    def __call__(self, gait: str, above: float, begins: bool) -> Array:
        """Temperatures, shape (4, 3) [°C]; see ``CourseWalker``."""
        task, learned, shape = self._task, self.gaits[gait], TASKS[gait]
        x, y, _ = task.position.tolist()
        turn = task.stance.rotation(task.data)
        yaw, dt = math.atan2(turn[1, 0], turn[0, 0]), task.control_period
        if begins:
            new = Following(Command(), place=(x, y), aside=y)
            self._following, self._time = new.moved(x, y, yaw, 0.0), 0.0
        else:
            self._following = self._following.moved(x, y, yaw, dt)
        period = learned.period
        if self._time % period < dt / 2.0 or period - self._time % period < dt / 2.0:
            rows = task.stance.sensed(task.sim, above)
            # On the ground it is told to look back to the line: from 10 mm aside by 5 degrees.
            ahead = 0.0 if shape.beam else min(max(-_BACK * y, -_MOST), _MOST)
            now = self._following._replace(heading=ahead, error=math.remainder(ahead - yaw, _TURN))
            rows |= told(now, turn, shape.fastest)
            self._asked = learned.temperatures(rows)
        self._time += dt
        return self._asked.copy()


def scripted(env: gym.Env[Any, Any]) -> CourseWalker:
    """With the scripted crawl and walk; mount and shimmy try searched strokes, as the others do."""
    return _walker(env, SCRIPTED)


def searched(env: gym.Env[Any, Any]) -> CourseWalker:
    """With the searched gaits that come with the package."""
    found: dict[str, Any] = {
        gait: SavedPolicy.read(find(f"tetrapod-{gait}")).gait for gait in SPECIALISTS
    }
    return _walker(env, SCRIPTED | found | {"shimmy": (found["shimmy"],)})


def specialists(env: gym.Env[Any, Any]) -> CourseWalker:
    """With the gaits that were learned each by its own."""
    return _walker(env, LEARNED, SPECIALISTS)


def shapes(env: gym.Env[Any, Any]) -> CourseWalker:
    """With the one policy that has learned all shapes."""
    return _walker(env, LEARNED, SHAPES)


def _walker(
    env: gym.Env[Any, Any], gaits: Mapping[str, Any], policies: Mapping[str, str] | None = None
) -> CourseWalker:
    task: Any = env.unwrapped
    learned = None if policies is None else Learned(task, policies)
    return CourseWalker(task, quick(task.places, gaits), learned)


for _maker in (scripted, searched, specialists, shapes):
    _maker.arguments = {"action": "power", "fan": True}  # type: ignore[attr-defined]

"""The scripted controller of the tetrapod's course: crawl, stand up, walk, clamp, shimmy, lie down.

The course is a list of stages. A stage either walks to a place with a gait, or changes the shape
of the body: soften the spines, bend them with their TCAs to an angle, hold it, let the spines
harden, release. All it knows is the observation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.scripts.tetrapod import CRAWL, SHIMMY, WALK
from tca_mj.checks import Checked, Edge, door, shown, within
from tca_mj.control import Gait, Thermostat
from tca_mj.envs.course import OBSERVATION, Places, TetrapodCourse
from tca_mj.robots.tetrapod import SPINES

Array = NDArray[np.float64]

PUSH = replace(WALK, offset=(0.0,) * 4)
"""The walk with both legs of a pair together, where the body does not rest on its legs."""

HURRY = (
    replace(SHIMMY, period=11.5, hot=(170.0, 150.0, 170.0)),
    replace(SHIMMY, period=14.0, hot=(172.0,) * 3),
    replace(
        SHIMMY, period=11.6, start=(0.02, 0.24, 0.5), hot=(172.0, 170.0, 165.0), warm=(25.0,) * 3
    ),
)
"""The shimmy with stronger strokes: the beam is wider than the one of its task. How well the body
embraces it differs from robot to robot, and which of these gets on."""

STEP = Gait(
    period=4.0, offset=(0.0, 0.5, 0.5, 0.0), start=(0.0, 0.5, 0.5), duty=(0.5,) * 3,
    hot=(150.0,) * 3, warm=(40.0,) * 3,
)  # fmt: skip
"""Steps with little headway: a foot that is lifted does not hold the body down by its friction."""

_OFF = 25.0  # temperature at which nothing is heated [°C]
# A leg curled inwards: where friction holds its foot, it turns the rail outwards.
_BRACED = (_OFF, 168.0, 168.0)
_LIFTED = (165.0, _OFF, _OFF)
_REACHING = (165.0, 165.0, _OFF)  # a leg lifted and bent forward


Row = tuple[float, ...]


def _paces(name: str, value: Any) -> float | Row:
    pace = within(name, value, at_least=0.0)
    if pace.ndim > 1:
        raise ValueError(f"{name} must be a number or a row of numbers, got {shown(value)}")
    return tuple(pace.tolist()) if pace.ndim else float(pace)


Paces = Annotated[float | Row, _paces]


@dataclass(frozen=True, kw_only=True, slots=True)
class Go(Checked):
    """Move with a gait until the middle of the body is at ``until`` [m].

    Attributes:
        name: Name of the stage.
        gait: Whose temperatures the legs follow; several are tried in turn where one does not get
            on, or is slower than ``pace``. A name is that of a shape in which the walker has
            learned to get on.
        until: Where the stage ends, along x [m].
        patience: Time without headway after which the stage ends wherever the body is [s].
        steers: Whether the legs of one side become weaker where the heading is off.
        above: Height of what the robot stands on, of which a learned gait sees its own [m].
        pace: Headway below which another gait is tried, one number for all or one for each but
            the first; where no other is tried, the fastest goes on [m/s]. 0 to try another only
            where there is no headway.
        clings: Whether the spines' TCAs go on pulling: without them a rigid U gives way by a
            degree, which is all that weak ones have clamped by.
    """

    name: str
    gait: Gait | str | tuple[Gait | str, ...]
    until: float
    patience: Edge = math.inf
    steers: bool = False
    above: float = 0.0
    pace: Paces = 0.0
    clings: bool = False

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        others = len(self.gait) - 1 if isinstance(self.gait, tuple) else 0
        if isinstance(self.pace, tuple) and len(self.pace) != others:
            raise ValueError(f"pace must be {others} numbers, one for each gait but the first, got"
                             f" {shown(self.pace)}")  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class Bend(Checked):
    """Change the shape of the body; legs that do not step are left cold.

    Attributes:
        name: Name of the stage.
        angle: Bend from rail to rail [rad]; None is the memorised shape, which needs no TCA.
        steps: Gait of the legs while the body bends, so that friction does not hold it.
        braced: Whether the legs curl inwards from beginning to end, which opens the body.
        reaching: Whether the rear legs reach forward while the body is soft, clear of the desk;
            later all legs walk, until the body is bent.
        enough: Bend up to which the stage is left out; None: never [rad].
        ahead: Way before the stage's place from which on the spines are warmed, still rigid [m].
        brisk: Whether the spines begin to cool as soon as the body has its shape, with the fan.
        stiff: Temperature of the spines below which the legs go on. The TCAs hold the shape until
            they are below ``CourseWalker.rigid`` [°C].
        rest: Time after that in which the legs come back where they were braced, or stand [s].
        short: By how much the bend may fall short where the TCAs can do no more [rad].
    """

    name: str
    angle: float | None
    steps: Gait | None = None
    braced: bool = False
    reaching: bool = False
    enough: float | None = None
    ahead: float = 0.0
    brisk: bool = False
    stiff: float = 75.0
    rest: float = 10.0
    short: float = math.radians(8.0)


@door
def stages(places: Places) -> tuple[Go | Bend, ...]:
    """The course, stage by stage.

    Args:
        places: Where things are along it.
    """
    station, edge, end = places.leg_station, places.first_edge, places.beam_end
    walking, wide = np.radians(95.0), np.radians(115.0)
    return (
        Go(name="crawl", gait=CRAWL, until=places.stand, steers=True),
        Bend(name="stand up", angle=walking, steps=WALK),
        # On until the front feet have left the desk wherever they swing; then the rear ones push,
        # until the roots of their legs have left it as well.
        Go(name="walk", gait=WALK, until=edge - station + 0.019, steers=True),
        Go(name="mount", gait=PUSH, until=edge + station + 0.004, patience=25.0, steers=True),
        Bend(name="clamp", angle=np.radians(213.0), reaching=True),
        Go(name="shimmy", gait=HURRY, until=end - 0.005, patience=200.0),
        # On until the rear spine has left the beam; the front legs clamp its lower end by then.
        Go(name="step off", gait=HURRY, until=end + station - 0.015, patience=60.0),
        # As wide each time as curled legs can open it; between, the legs stretch.
        *(
            Bend(name="open", angle=np.radians(angle), steps=STEP, braced=True, rest=20.0,
                 enough=wide)
            for angle in (165.0, 130.0, 97.0, 97.0, 97.0)
        ),
        Go(name="walk on", gait=WALK, until=places.target, steers=True),
        Bend(name="lie down", angle=None, steps=STEP),
    )


class CourseWalker:
    """Walks the course: ``act`` turns an observation into an action.

    Its gains, thresholds and waiting times were found by trial in this task.
    """

    soft = 116.0  # spines are hot enough to be bent [°C]
    rigid = 75.0  # spines are cold enough to be let go [°C]
    warm = 80.0  # spines are warmed to this ahead of a change of shape, and still rigid [°C]
    walkable = math.radians(100.0)  # less bent its belly may lie on the beam's lower end [rad]
    easing = 0.3  # by which the TCAs cool while spines that cool fast become stiff [K/s]
    clinging = 0.05  # the same of rigid ones that still pull [K/s]
    hottest = 172.0  # temperature that no TCA is to exceed [°C]
    stalled = 35.0  # time without headway after which another gait is tried [s]
    trial = 15.0  # time after which the headway of a gait is judged by its pace [s]

    def __init__(
        self,
        env: TetrapodCourse,
        plan: Sequence[Go | Bend] | None = None,
        learned: Callable[[str, float, bool], Array] | None = None,
    ) -> None:
        """Reads limits and places of a task, never its state.

        Args:
            env: The task.
            plan: The course, stage by stage; by default ``stages``.
            learned: What learned gaits ask of the legs, shape (4, 3) [°C], from the name of a
                shape, the height of what the robot stands on [m], and whether the stage begins.

        Raises:
            ValueError: If the action is not the power of the TCAs.
        """
        if env.heating != "power":
            raise ValueError(f"action must be 'power' for this policy, got {env.heating!r}")
        self._dt = env.control_period
        self._max_power = env.max_power
        self._voltage = env.max_voltage
        self._plan = stages(env.places) if plan is None else tuple(plan)
        self._learned, self._fan = learned, env.fan
        self._thermostat = Thermostat(
            heat=env.sim.bank.heat, max_power=env.max_power, max_temperature=self.hottest
        )
        self.reset()

    def reset(self) -> None:
        """Back to the start of the course."""
        self._number = 0
        self._held = _OFF  # temperature at which the spines' TCAs hold a shape that cools
        self._body = np.array(self._thermostat.heat.ambient)  # unseen, but followed
        self._enter()

    @property
    def phase(self) -> str:
        """Name of the present stage; "done" at the end."""
        return self._plan[self._number].name if self._number < len(self._plan) else "done"

    def _enter(self) -> None:
        self._time = 0.0  # in this stage, or this part of it
        self._part = "soften"
        self._best, self._since = -math.inf, 0.0  # foremost place in this stage, and when
        self._choice, self._tried = 0, 0.0  # which gait of several, and since when
        self._from, self._headway = math.nan, dict[int, float]()  # its start, and that of each
        self._integral = 0.0
        self._target = 25.0  # of the spines' TCAs
        self._angle: float | None = None
        self._back = False  # whether the body has opened too far and is bent back

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The next action."""
        seen = OBSERVATION.read(observation)
        while self._number < len(self._plan) and self._over(seen):
            known = self._choice, self._headway
            self._number += 1
            self._enter()
            if self._goes_on():
                self._choice, self._headway = known
        legs, spines, voltage = np.full((4, 3), _OFF), _OFF, np.zeros(3)
        blows = seen["spine temperature"].max() > self.rigid
        if self._number < len(self._plan):
            stage = self._plan[self._number]
            if isinstance(stage, Go):
                # To relax is harmless, to contract is not.
                eased = self._held - (self.easing if blows else self.clinging) * self._dt
                self._held = eased if blows or stage.clings else _OFF
                legs, spines = self._walk(stage, seen), self._held
                voltage = self._warmed(stage, seen)
            else:
                legs, spines, voltage = self._bend(stage, seen)
                self._held = spines
        self._time += self._dt
        target = np.concatenate([np.maximum(legs, 25.0).ravel(), np.full(3, spines)])
        now = seen["TCA temperature"]
        power = self._thermostat.power(now, target, self._body)
        self._body = self._thermostat.heat.body_after(self._body, now, self._dt)
        fan = [float(blows and not voltage.any())] if self._fan else []
        action = np.concatenate([power / self._max_power, voltage / self._voltage, fan])
        return (2.0 * action - 1.0).astype(np.float32)

    def _over(self, seen: dict[str, Array]) -> bool:
        stage = self._plan[self._number]
        if isinstance(stage, Go):
            x = float(seen["position"][0])
            if stage.pace and isinstance(stage.gait, tuple):
                self._judge(x, stage.gait, stage.pace)
            if x > self._best + 2e-3:
                self._best, self._since = x, self._time
                self._tried = self._tried if stage.pace else self._time
            elif self._time - self._tried > self.stalled and not stage.pace:
                self._choice, self._tried = self._choice + 1, self._time
            return x >= stage.until or self._time - self._since > stage.patience
        if stage.enough is not None and self._time == 0.0:
            return float(seen["body angle"][0]) <= stage.enough
        return self._part == "done"

    def _goes_on(self) -> bool:
        """Whether the stage has the gaits of the one before, whose headway is known."""
        before, now = self._plan[self._number - 1], self._plan[self._number : self._number + 1]
        return bool(now and isinstance(before, Go) and isinstance(now[0], Go) and before.pace
                    and now[0].gait == before.gait)  # fmt: skip

    def _judge(self, x: float, gaits: Sequence[Gait | str], paces: float | Row) -> None:
        """Goes on with the gait, another one, or the fastest of all that were tried."""
        if math.isnan(self._from):
            self._from = x
        if self._time - self._tried < self.trial:
            return
        found = self._headway
        found[self._choice] = (x - self._from) / (self._time - self._tried)
        self._choice = max(found, key=found.__getitem__)
        other = len(found)  # the first that was not tried
        if other < len(gaits):
            pace = paces[other - 1] if isinstance(paces, tuple) else paces
            if found[self._choice] < pace:
                self._choice = other
        self._from, self._tried = x, self._time

    def _walk(self, stage: Go, seen: dict[str, Array]) -> Array:
        gaits = stage.gait if isinstance(stage.gait, tuple) else (stage.gait,)
        gait = gaits[self._choice % len(gaits)]
        if isinstance(gait, str):
            assert self._learned is not None
            return self._learned(gait, stage.above, self._time == 0.0)
        legs = gait.temperature(self._time / gait.period).reshape(4, 3)
        if stage.steers:
            w, _, _, z = seen["orientation"]
            away = 2.0 * np.arctan2(z, w) + 3.0 * seen["position"][1]
            weaker = np.clip(600.0 * away, -80.0, 80.0)
            legs[[0, 2]] -= max(-weaker, 0.0)
            legs[[1, 3]] -= max(weaker, 0.0)
        return legs

    def _warmed(self, stage: Go, seen: dict[str, Array]) -> Array:
        """Voltages that warm the spines ahead of the stage that comes next."""
        coming = self._plan[self._number + 1] if self._number + 1 < len(self._plan) else None
        left = stage.until - float(seen["position"][0])
        if not isinstance(coming, Bend) or left > coming.ahead:
            return np.zeros(3)
        return np.where(seen["spine temperature"] < self.warm, self._voltage, 0.0)

    def _bend(self, stage: Bend, seen: dict[str, Array]) -> tuple[Array, float, Array]:
        """Temperatures of the legs and of the spines' TCAs, and voltages of the heaters."""
        hot, cold = seen["spine temperature"].min(), seen["spine temperature"].max()
        boost = np.where(seen["spine temperature"] < self.soft - 1.0, self._voltage, 9.5)
        angle = float(seen["body angle"][0])
        before = angle if self._angle is None else self._angle
        self._angle = before + (angle - before) * self._dt / 0.6
        rate = (self._angle - before) / self._dt
        error = 0.0 if stage.angle is None else float(np.degrees(stage.angle - self._angle - rate))
        stepping, voltage = False, np.zeros(3)
        if self._part == "soften":
            voltage = np.full(3, self._voltage)
            if hot > self.soft:
                self._go_on("bend")
        elif self._part in ("bend", "hold"):
            voltage = np.zeros(3) if stage.brisk and self._part == "hold" else boost
            if stage.angle is None:
                stepping = True  # or the feet hold the body as it is
                flat = stage.brisk and self._time > 5.0 and abs(rate) < np.radians(0.5)
                if self._time > 15.0 or flat:
                    self._go_on("harden")
            else:
                gain = 0.6 if self._part == "bend" else 0.2
                self._integral += gain * np.clip(error, -30.0, 30.0) * self._dt
                self._integral = float(np.clip(self._integral, -60.0, 150.0))
                wanted = 60.0 + np.clip(error, -60.0, 60.0) + self._integral
                self._target = float(np.clip(wanted, 25.0, self.hottest))
                if self._part == "bend":
                    stepping = abs(error) > 3.0
                    # As far as it gets: a TCA that is off lets go no further, a hot one is spent.
                    spent = self._target < 26.0 if stage.braced else self._target >= self.hottest
                    short = 50.0 if stage.braced else math.degrees(stage.short)
                    near = abs(error) < (short if spent else 5.0)
                    # Opened further than asked it need not be bent back, but to where it walks.
                    opened = stage.brisk and stage.braced and error > 0.0
                    near = near or (opened and angle > self.walkable)
                    # Curled legs would hold it open, and stretched ones without steps, too.
                    self._back = self._back or (opened and angle < self.walkable)
                    still = near and abs(rate) < np.radians(1.0)
                    if (still and self._time > 5.0) or self._time > 60.0:
                        self._go_on("hold")
                elif self._time > (2.0 if stage.brisk else 6.0):
                    # As warm as they are, and no warmer: to contract now would damage them.
                    now = seen["TCA temperature"][-SPINES:]
                    self._target = float(now.min() - 1.0 if stage.brisk else now.mean())
                    self._go_on("harden")
        elif self._part == "harden":
            if stage.brisk and stage.angle is not None:
                self._target -= self.easing * self._dt
            if cold < stage.stiff:
                self._go_on("release" if stage.angle is not None and stage.rest else "done")
        elif self._part == "release":
            self._target = 25.0
            stepping = stage.braced
            if self._time > stage.rest:
                self._go_on("done")
        legs = np.full((4, 3), _OFF)
        if stage.reaching and self._part in ("soften", "bend"):
            lifting = self._part == "soften" and self._time < 3.0
            legs[2:] = _LIFTED if lifting else _REACHING
            if stage.brisk:  # with its front legs it holds the beam, or may fall to one side
                legs[:2] = _BRACED
            if self._part == "bend" and self._time > 4.0:  # they shake the body level
                shake = PUSH if stage.brisk else WALK
                legs = shake.temperature(self._time / shake.period).reshape(4, 3)
        elif stage.braced and self._part != "release" and not self._back:
            legs[:] = _BRACED
        elif (stepping or self._back) and stage.steps is not None:
            legs = stage.steps.temperature(self._time / stage.steps.period).reshape(4, 3)
        return legs, self._target, voltage

    def _go_on(self, part: str) -> None:
        self._part, self._time = part, 0.0

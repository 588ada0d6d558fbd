"""What the tasks share in which an object is held from a commanded time to another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.drive import Drive
from tca_mj.envs.objects import named, touching, weigh
from tca_mj.envs.options import Option, Uniform
from tca_mj.envs.outcome import TaskState, Verdict
from tca_mj.envs.rewards import tolerance
from tca_mj.envs.table import Entry
from tca_mj.envs.task import SimulatedTask

_LIFTED = 6e-3  # height at which an object counts as held [m]
_FREE = 0.3  # time untouched after which an object is let go [s]
_LOST = 0.1  # distance from below where the gripper starts at which it is out of reach [m]


def held_rows(latest: float) -> tuple[Entry, ...]:
    """Rows of an observation that ``HeldObject.seen_of_it`` fills.

    Args:
        latest: Latest time at which an object is to be let go [s].
    """
    return (
        Entry("object position", 3, -0.6, 0.6, "m", scale=0.02, mirror=(-1, 2, 3)),
        Entry("object orientation", 4, -1.0, 1.0, "quaternion wxyz", mirror=(1, 2, -3, -4)),
        Entry("object velocity", 3, -10.0, 10.0, "m/s", scale=0.05, mirror=(-1, 2, 3)),
        Entry("time until it is to be held", 1, -3600.0, latest, "s", scale=10.0),
        Entry("time until it is to be let go", 1, -3600.0, latest, "s", scale=10.0),
    )


def holding_options(first: float, last: float, latest: float, longest: float) -> list[Option]:
    """When an object is to be held.

    Args:
        first: Earliest time from which on [s].
        last: The latest that is drawn [s].
        latest: The latest that can be given [s].
        longest: Longest duration [s].
    """
    return [
        Option(name="hold_from", about="time from which on it is to be held", unit="s",
               low=first, high=latest, draw=Uniform(first, last), drawn=f"drawn, up to {last:g}"),
        Option(name="hold_for", about="for how long", unit="s", low=1.0, high=longest,
               draw=Uniform(4.0, 10.0), drawn="drawn, from 4 to 10"),
    ]  # fmt: skip


class HeldObject(SimulatedTask):
    """A task in which an object is lifted, held from a commanded time to another one, and let go.

    It is held while it is 6 mm above where it stood and a finger touches it, and let go when no
    finger has touched it for 0.3 s. The task ends when it is not held when it should be, not let go
    within ``release_time``, or out of reach.

    Attributes:
        near: Distance of hand and object over which coming closer is paid for [m].
        object_mass: Mass of the object of this episode [kg].
        hold_from: Time from which on it is to be held [s].
        hold_until: Time until which it is [s].
        held_for: For how long it was held when it should be [s].
    """

    release_time: ClassVar[float] = 6.0  # after which the object must have been let go [s]
    near: ClassVar[tuple[float, float]] = (4e-3, 0.03)
    terms: ClassVar[tuple[str, ...]] = ("reach", "lift", "hold", "goal", "energy", "end")
    energy_price, end_price = 0.01, 5.0

    def _follow(
        self, model: mujoco.MjModel, name: str, bodies: Sequence[str], *, stands: float,
        fingers: str, sites: Sequence[str],
    ) -> None:  # fmt: skip
        """Looks up what is held and what holds it.

        Args:
            model: The model.
            name: Name of the object, the prefix of its names; it has a free joint ``free``.
            bodies: Its bodies, without the prefix, the first one is where it is.
            stands: Height of its origin while it stands [m].
            fingers: Prefix of the names of what can touch it.
            sites: Sites in whose middle the object is to be.
        """
        free = model.joint(f"{name}.free").id
        self._free_q, self._free_v = int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free])
        self._bodies = [int(model.body(f"{name}.{body}").id) for body in bodies]
        self._built_mass = float(model.body_mass[self._bodies].sum())
        self._is_object, self._is_hand = named(model, f"{name}."), named(model, fingers)
        self._grip = [int(model.site(site).id) for site in sites]
        self._stands = stands
        self.object_mass = self._built_mass
        self.hold_from, self.hold_until = 0.0, 0.0
        self._begin()

    def _begin(self) -> None:
        """Nothing has been held yet."""
        self.held_for, self._untouched = 0.0, 0.0
        self._progress = self._measure()

    def _weigh(self) -> None:
        weigh(self.model, self._bodies, self.object_mass / self._built_mass)

    def set_state(self, state: TaskState) -> None:
        """As of all tasks; the object has its mass of then, too."""
        super().set_state(state)
        self._weigh()

    @property
    def height(self) -> float:
        """Height of the object above where it stands [m]."""
        return float(self.data.xpos[self._bodies[0], 2]) - self._stands

    @property
    def touched(self) -> bool:
        """Whether a finger touches the object."""
        return touching(self.data, self._is_object, self._is_hand)

    @property
    def held(self) -> bool:
        """Whether the object is held."""
        return self.height >= _LIFTED and self.touched

    def astray(self) -> str | None:
        """Why an object that was let go is not where it should be, or None."""
        return None

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """Whether the object is held when it should be, and let go after that."""
        before, self._progress = self._progress, self._measure()
        terms = {name: value - before[name] for name, value in self._progress.items()}
        now, due = self.sim.time, self.hold_until - self.hold_from
        wanted = self.hold_from - 1e-9 < now < self.hold_until + 1e-9
        held, ended, success = self.held, None, False
        self._untouched = 0.0 if self.touched else self._untouched + self.interval
        if wanted and held:
            self.held_for += self.interval
        elif wanted:
            ended = f"not held at {now:.1f} s"
        elif now > self.hold_until:
            free = self._untouched > _FREE - 1e-9 and not harmed
            wrong = self.astray() if free else None
            success = free and wrong is None
            late = now > self.hold_until + self.release_time + 1e-9
            ended = f"not let go at {now:.1f} s" if late and not free else wrong
        if math.hypot(*self.data.xpos[self._bodies[0], :2]) > _LOST and not success:
            ended = ended or "object out of reach"
        terms["hold"] = 10.0 * self.interval / due if wanted and held else 0.0
        terms["goal"] = 20.0 if success else 0.0
        return Verdict(terms=terms, success=success, ended=None if harmed else ended)

    def _measure(self) -> dict[str, float]:
        """How far the task has got, by reward term."""
        data = self.data
        middle = data.site_xpos[self._grip].mean(axis=0)
        gap = math.dist(middle, data.xpos[self._bodies[0]])
        bound, margin = self.near
        near = float(tolerance(gap, bounds=(0.0, bound), margin=margin))
        return {"reach": near, "lift": 4.0 * min(max(self.height / _LIFTED, 0.0), 1.0)}

    def seen_of_it(self) -> dict[str, ArrayLike]:
        """Values of ``held_rows``."""
        data = self.data
        turn: NDArray[np.float64] = data.qpos[self._free_q + 3 : self._free_q + 7]
        return {
            "object position": data.xpos[self._bodies[0]],
            "object orientation": turn if turn[0] >= 0.0 else -turn,
            "object velocity": data.qvel[self._free_v : self._free_v + 3],
            "time until it is to be held": self.hold_from - self.sim.time,
            "time until it is to be let go": self.hold_until - self.sim.time,
        }

    def details(self) -> dict[str, Any]:
        """Height of the object [m], whether a finger touches it, and for how long it was held."""
        return {"height": self.height, "touched": self.touched, "held_for": self.held_for}

    def outcome(self) -> dict[str, Any]:
        """What the object was, and for how long it was held when it should be [s]."""
        return {
            "object_mass": self.object_mass, "held_for": self.held_for,
            "hold_from": self.hold_from, "hold_until": self.hold_until,
        }  # fmt: skip

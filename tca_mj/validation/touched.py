"""A finger that feels a touch by its resistance and then bends (Sun, Section 4.2).

The task ``TCA/FingerSense-v0`` with its script, whose gains, trigger and voltage are the printed
ones. Units of the gains, filter and sample are those of ``lifting``: the same board.
"""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from tca_mj.agents.scripts.finger import GAINS, SUPPLY, TRIGGER, FingerPolicy, bending_run
from tca_mj.checks import Array
from tca_mj.control import PiSpec
from tca_mj.envs.finger import FingerSense
from tca_mj.tca.sensing.wire import fit_displacement
from tca_mj.validation.facts import Finding, finding

TARGET = 60.0  # Sun, Section 4.2.2 [deg]
SETTLED = 5.0  # after the trigger: the steady error is that of the mean from then on [s]
HELD = 8.0  # Sun, Section 4.2.2 [s]
_RMSE = 1.6337  # of the cubic, Sun, Section 4.2.1 [deg]
_RISEN = 0.9  # share of the target that is the end of the rise: an estimate
_PART = 3.0  # of the hold, in which vibration is looked at: an estimate [s]
_LONGEST = 20.0  # a trigger and what follows [s]


class _Powerful(FingerSense):
    """The task with a supply of more than 12 V, so that the script's own decides."""

    max_power = 6.0 * FingerSense.max_power


class Answer(NamedTuple):
    """What the finger does once it is touched; shapes (k,).

    Attributes:
        time: Time after the trigger, negative before [s].
        angle: True angle [deg].
        resistance: Filtered [ohm].
        reading: Not filtered [ohm].
        temperature: Of the pair of TCAs [°C].
        silicone: Of what they lie in [°C].
        power: Of both [W].
    """

    time: Array
    angle: Array
    resistance: Array
    reading: Array
    temperature: Array
    silicone: Array
    power: Array

    @property
    def rise(self) -> float:
        """Time until 90 % of the target [s]."""
        return float(self.time[np.argmax((self.time > 0.0) & (self.angle >= _RISEN * TARGET))])

    @property
    def steady(self) -> Array:
        """Angles from ``SETTLED`` to the end of the hold [deg]."""
        return self.angle[(self.time >= SETTLED) & (self.time <= self.rise + HELD)]

    @property
    def error(self) -> float:
        """Mean error of these over the target [%]."""
        return 100.0 * abs(float(self.steady.mean()) / TARGET - 1.0)

    def away(self, start: float, end: float) -> float:
        """Largest distance from the target between two times [deg]."""
        meant = (self.time >= start) & (self.time <= end)
        return float(np.abs(self.angle[meant] - TARGET).max())

    @property
    def first(self) -> float:
        """``away`` in the first 3 s after the rise [deg]."""
        return self.away(self.rise, self.rise + _PART)

    @property
    def last(self) -> float:
        """``away`` in the last 3 s of the hold [deg]."""
        return self.away(self.rise + HELD - _PART, self.rise + HELD)


@cache
def answer(gains: PiSpec = GAINS, *, seed: int = 0, voltage: float = SUPPLY) -> Answer:
    """Touches the finger, and watches it for ``HELD`` after the rise and a little longer.

    Args:
        gains: Gains of the script.
        seed: Of the episode: touch and noise.
        voltage: Supply of the script [V].
    """
    env = _Powerful(action="power")
    policy = FingerPolicy(gains=gains, voltage=voltage, max_power=float(env.max_power[0]))
    observation, _ = env.reset(seed=seed, options={"touch_time": 1.0})
    rows: list[list[float]] = []
    felt = np.inf
    while env.sim.time < min(felt + SETTLED + HELD, _LONGEST):
        seen = env.observation.read(observation)
        now = env.sim.time, np.degrees(env.bent()), seen["resistance"], seen["resistance reading"]
        hot, warm, power = env.sim.temperature[0], env.sim.body_temperature[0], env.sim.power.sum()
        rows.append([*(float(np.squeeze(each)) for each in now), hot, warm, power])
        observation, *_ = env.step(policy.act(observation))
        if policy.phase != "watch":
            felt = min(felt, rows[-1][0])
    course = np.array(rows).T
    return Answer(course[0] - felt, *course[1:])


def findings() -> list[Finding]:
    """All of them."""
    found, run = answer(), bending_run()
    fast, slow = (
        answer(replace(GAINS, proportional=gain, near_proportional=gain)) for gain in (20.0, 3.0)
    )
    fit = np.degrees(fit_displacement(run.resistance, run.angle).rmse)
    touched = found.time <= 0.0
    rest = float(found.resistance[:25].mean())
    return [
        finding("finger-leads", rest),
        finding("finger-trigger", -float(found.angle[touched].min()),
                held=bool(found.time[0] < 0.0), trigger=TRIGGER),
        finding("finger-rise", found.rise, peak=found.angle.max()),
        finding("finger-error", found.error, mean=found.steady.mean(),
                silicone=found.silicone[found.time >= SETTLED][[0, -1]]),
        finding("finger-fit", fit, 0.5 * _RMSE < fit < 2.0 * _RMSE, hot=run.temperature),
        finding("finger-gains", held=found.rise < slow.rise and found.last < fast.last,
                rise=(found.rise, slow.rise), last=(found.last, fast.last)),
        finding("finger-vibration", found.first, found.last < 0.5 * found.first, last=found.last),
    ]  # fmt: skip

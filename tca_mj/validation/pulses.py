"""Published pulses of current on the bistable robots, and how long they may last.

They are printed as current and time, without what the TCA weighs (Sun, Section 4.3.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tca_mj.agents.scripts.bistable_grasp import BistableGraspPolicy
from tca_mj.envs.bistable_grasp import BistableGrasp
from tca_mj.envs.jump import Jump
from tca_mj.robots.bistable_gripper import CLOSING, OPENING
from tca_mj.tca.supply import Supply
from tca_mj.validation.jumping import NOMINAL

_LONGEST = 30.0  # after which a current is called safe for good [s]


class Pulse(NamedTuple):
    """A published pulse.

    Attributes:
        name: What it is to do.
        amperes: Current of each TCA that it is for [A].
        seconds: For so long.
    """

    name: str
    amperes: float
    seconds: float


CLOSE = Pulse("bistable gripper, close", 1.5, 0.8)
OPEN = Pulse("bistable gripper, open", 1.5, 1.5)
JUMP = Pulse("jumper", 2.5, 0.3)
PULSES = (CLOSE, OPEN, JUMP)


@dataclass(frozen=True, kw_only=True, slots=True)
class Endured:
    """What a pulse does to a TCA of the mass that the scales say.

    Attributes:
        alone: Temperature after it if nothing takes heat from the TCA [°C].
        inside: The same in the robot [°C].
        safe_alone: Time after which the lone TCA has the highest temperature that a task asks for,
            ``SimulatedTask.safe_temperature``, at this current [s].
        safe_inside: The same in the robot, inf if it has not within half a minute [s].
        over: Time after which all of the robot has gone over, inf if it has not by then [s].
        hot: Temperature of the TCA then, the last one if it has not [°C].
    """

    alone: float
    inside: float
    safe_alone: float
    safe_inside: float
    over: float
    hot: float


def endured(pulse: Pulse) -> Endured:
    """What one of ``PULSES`` does, on the robot that it was printed for."""
    env, heated, to = _ready(pulse)
    sim, period, safe, first = env.sim, env.sim.tca_period, env.safe_temperature, heated[0]
    told = np.zeros(sim.n)
    told[heated] = pulse.amperes
    power = pulse.amperes**2 * float(sim.resistance[first])
    rate = power / float(sim.bank.specs[first].heat.capacity)
    time, hot, over = [0.0], [float(sim.temperature[first])], math.inf
    sim.bank.supply = Supply(quantity="current")
    while time[-1] < pulse.seconds or (hot[-1] < safe and time[-1] < _LONGEST):
        sim.step(told, period)
        time.append(period * len(time))
        hot.append(float(sim.temperature[heated].max()))
        bends = env.bent() if isinstance(env, Jump) else env.bends
        if over == math.inf and np.all(to * bends > 0.0):
            over = time[-1]
    return Endured(
        alone=hot[0] + rate * pulse.seconds,
        inside=float(np.interp(pulse.seconds, time, hot)),
        safe_alone=(safe - hot[0]) / rate,
        safe_inside=float(np.interp(safe, hot, time)) if hot[-1] >= safe else math.inf,
        over=over,
        hot=float(np.interp(over, time, hot)),
    )


def _ready(pulse: Pulse) -> tuple[Jump | BistableGrasp, list[int], float]:
    """A task just before a pulse, the TCAs that it is for, and the sign of the bend to reach."""
    if pulse == JUMP:
        jump = Jump(action="power")
        jump.reset(seed=0, options=NOMINAL)
        return jump, [0], 1.0
    env, policy = BistableGrasp(), BistableGraspPolicy()
    observation, _ = env.reset(
        seed=0, options=NOMINAL | {"object_mass": 15e-3, "hold_from": 8.0, "hold_for": 5.0}
    )
    phase, which, to = ("close", CLOSING, 1.0) if pulse == CLOSE else ("open", OPENING, -1.0)
    while True:
        action = policy.act(observation)
        if policy.phase == phase:
            return env, list(which), to
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            raise AssertionError(f"the script does not come to {phase!r}: {info}")


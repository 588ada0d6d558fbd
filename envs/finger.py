"""``TCA/FingerSense-v0``: a finger feels by its TCAs that it is touched, and bends (Sun, 4.2)."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, ClassVar, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import door
from tca_mj.drive import Drive, Timestep
from tca_mj.envs.hanging import CLAMP, hang
from tca_mj.envs.options import Constant, Option, Options, Setup, Uniform, variation_options
from tca_mj.envs.outcome import Verdict
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments
from tca_mj.envs.vector import TaskVector
from tca_mj.modules.innervated import PAIR, InnervatedFingerSpec, innervated_finger
from tca_mj.sim import Simulation

PERIOD = 0.02  # time between two readings, updates of the TCAs and actions [s]
NOISE = 10e-3  # of a reading [ohm]; what ``CurrentSensor`` has at 5 V
# Readings that the moving average stands for: the 0.2 s of 20 samples of 10 ms which are fitted in
# ``tca_mj.validation.lifting`` to the overshoot of the same board and filter.
FILTER = 10

OBSERVATION = Table(
    [
        Entry("resistance", 1, 0.0, 20.0, "ohm", centre=6.6, scale=0.2),
        Entry("resistance reading", 1, 0.0, 20.0, "ohm", centre=6.6, scale=0.2),
        Entry("lowest resistance", 1, 0.0, 20.0, "ohm", centre=6.6, scale=0.2),
        Entry("TCA power", 1, 0.0, 5.0, "W", scale=1.0),
        Entry("commanded angle", 1, 0.0, 2.0, "rad", centre=1.0, scale=0.5),
        Entry("time at the goal", 1, 0.0, 8.0, "s"),
    ]
)
ACTION = Table([Entry("TCA heating", 1, -1.0, 1.0, "-", off=-1.0)])

_DOWN = (0.0, 1.0, 0.0, 0.0)  # z of the finger down, its pair of TCAs towards x, wxyz
_SETTLING = 0.5  # time in which the cold finger comes to rest [s]
# A touch: how long the hand takes to come, press, stay, go back and leave [s]. Estimates.
_TOUCH = np.cumsum([0.0, 0.3, 1.0, 0.3, 0.4, 0.3])
_WAY = (0.0, 1.0, 2.0, 2.0, 1.0, 0.0)  # 0 away, 1 at the finger, 2 pressed as far as it goes
_PRESSED = float(_TOUCH[2])
_AWAY = (0.06, -0.034)  # where the hand waits, x and z from the clamp [m]
_AT = 0.85  # where it touches the finger, over its length
# Turn of the tip of a finger that is pushed there, over that of one that is bent evenly to the same
# place: by beam theory 3/4 of ``_AT``, 0.64, for small bends, and by trial for large ones.
_TURNED = 0.7
_HAND = 6e-3  # its radius, as in the scene [m]


class SensedFinger:
    """A hanging finger in its scene, its bend and its resistance.

    Attributes:
        spec: The finger.
        sim: Its simulation.
    """

    @door
    def __init__(
        self, spec: InnervatedFingerSpec | None = None, *, timestep: Timestep = 5e-3
    ) -> None:
        """Builds the scene.

        Args:
            spec: The finger, by default the published one.
            timestep: Physics time step, of which ``PERIOD`` is a multiple [s].

        Raises:
            ValueError: If the finger cannot be built, or the time step does not fit.
        """
        self.spec = spec or InnervatedFingerSpec()
        part = hang(innervated_finger(self.spec), CLAMP.tolist(), _DOWN, "finger_stand")
        self.sim = Simulation(part, timestep=timestep, tca_period=PERIOD)
        model = self.sim.model
        joints = [i for i in range(model.njnt) if ".bend_y" in model.joint(i).name]
        self._bends = model.jnt_qposadr[joints]

    @property
    def angle(self) -> float:
        """Angle by which the finger is bent towards its pair of TCAs [rad]."""
        return float(self.sim.data.qpos[self._bends].sum())

    @property
    def resistance(self) -> float:
        """Resistance between the leads of the pair; not a number where it has none [ohm]."""
        return float(self.spec.leads + self.sim.resistance[:PAIR].sum())


class FingerSense(SimulatedTask):
    """Wait to be touched; then bend to an angle and hold it, by one's own resistance alone.

    A hand bends the hanging finger away from its pair of TCAs, which are stretched, so that their
    resistance falls. After it the finger is to bend by ``target`` towards the pair and stay there
    for 8 s, while its silicone warms up. Nobody tells that the hand was there.

    Action, shape (1,), in [-1, 1]: temperature to hold, or power, of each TCA of the pair, which
    are in series; see ``SimulatedTask``. The third TCA is never heated.

    Observation, shape (6,): see ``OBSERVATION``, whose rows have units and bounds. The resistance
    is that between the leads; readings are noisy, the first row is their moving average, the third
    one its lowest value so far.

    Reward, the sum of the terms in ``info["reward_terms"]``:
        reach: Change of a measure from 0 to 5 of how close the angle is to what it ought to be: to
            rest before the touch, to ``target`` from when the hand has pressed.
        goal: 10 in the step in which the angle has been within 3° of ``target`` for 8 s.
        energy: Minus 0.01 per joule of electrical energy.
        heat: Minus 0.0004 for every kelvin by which a TCA is above ``hot_temperature``, every
            20 ms.
        end: Minus 5 in the step in which a TCA is too hot or torn, or of a false alarm.

    Reset: cold and at rest, the hand away. ``options`` is the table of all that can be given.

    Terminates at the goal (success), and if it bends by 10° before the hand comes (false alarm).
    Truncates after the time limit, and with ``info["truncation_reason"]`` if a TCA is too hot or
    torn, or if the simulation diverged.
    """

    # Of each TCA: 5 V (Sun, Section 4.2.1) at the 6.6 ohm of both and their leads [W].
    max_power: ClassVar[NDArray[np.float64]] = np.full(PAIR, 1.84)
    max_temperature: ClassVar[float] = 180.0  # annealing temperature, Sun, Table 2.1 [°C]
    hot_temperature: ClassVar[float] = 140.0  # the finger is bent by more than 130° there [°C]
    safe_temperature: ClassVar[float] = 130.0  # [°C]
    control_period = PERIOD  # [s]
    tolerance: ClassVar[float] = math.radians(3.0)  # 5 % of 60°, Sun, Section 4.2.2 [rad]
    hold_time: ClassVar[float] = 8.0  # time at the goal, Sun, Section 4.2.2 [s]
    alarm: ClassVar[float] = math.radians(10.0)  # bend that is a false alarm; estimate [rad]
    terms = ("reach", "goal", "energy", "heat", "end")
    energy_price, heat_price, end_price = 0.01, 4e-4, 5.0
    camera_prefix = "stand."
    film_speed = 2.0
    scripted = "tca_mj.agents.scripts.finger:scripted"
    scripted_arguments = {"action": "power"}
    robot_argument = ("finger_spec", InnervatedFingerSpec)
    recipes = {"sac": Recipe.held(8000, 0.2)}

    @door
    def __init__(
        self,
        *,
        finger_spec: InnervatedFingerSpec | None = None,
        timestep: Timestep = 5e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            finger_spec: The finger, by default the published one.
            timestep: Physics time step, of which ``control_period`` is a multiple [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is unknown or out of range, or the finger cannot be built.
        """
        self.sensed = SensedFinger(self._robot(finger_spec, common), timestep=timestep)
        self.finger_spec = self.sensed.spec
        most = 3.0 * self.sensed.resistance
        rows = ("resistance", "resistance reading", "lowest resistance")
        seen = OBSERVATION.covering(dict.fromkeys(rows, (0.0, most)))
        self._open(self.sensed.sim, seen, ACTION, _OPTIONS, **common)
        self._hand = int(self.model.body("stand.hand").mocapid[0])
        self.target = self.touch = self.touch_time = self.noise = 0.0
        self._bent = self._filtered = self._mean = self._lowest = self._drawn = 0.0
        self._at_goal = 0
        self._try("finger_spec", finger_spec)

    def prepare(self, setup: Setup) -> None:
        """The cold finger comes to rest; the sensor has been on for long."""
        self.target, self.noise = setup["target"], setup["noise"]
        self.touch, self.touch_time = setup["touch"], setup["touch_time"]
        self._move_hand(0.0)
        self.sim.reset()
        self._move_hand(0.0)
        self.sim.step(self._off, _SETTLING)
        self.sim.tca = self.sim.bank.rest()
        self.data.time = 0.0
        self._at_goal, self._bent = 0, self.sensed.angle
        white, mean = self.np_random.standard_normal(2)
        settled = self.noise / math.sqrt(2.0 * FILTER - 1.0)  # of the moving average
        self._mean, self._drawn = self.sensed.resistance + settled * float(mean), float(white)
        self._lowest = math.inf

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the pair is told; the hand moves, and the next reading's noise is drawn."""
        self._mean, self._drawn = self._filtered, float(self.np_random.standard_normal())
        self._move_hand(self.sim.time + self.interval)
        return Drive(command=self.heated(np.repeat(command, PAIR)))

    def _move_hand(self, time: float) -> None:
        """Puts the hand where it is at a time of the episode [s]."""
        way = float(np.interp(time - self.touch_time, _TOUCH, _WAY))
        x, z = self._pressing(max(way - 1.0, 0.0) * self.touch / _TURNED)
        near = min(way, 1.0)
        place = CLAMP + np.array([
            near * x + (1.0 - near) * _AWAY[0], 0.0, near * z + (1.0 - near) * _AWAY[1],
        ])  # fmt: skip
        self.data.mocap_pos[self._hand] = place

    def _pressing(self, bend: float) -> tuple[float, float]:
        """Where the hand touches an evenly bent finger, x and z from the clamp [m]."""
        cylinder = self.finger_spec.cylinder
        turned, reach = max(_AT * bend, 1e-6), _AT * cylinder.length
        across = cylinder.outer_diameter / 2.0 + _HAND
        sin, cos = math.sin(turned), math.cos(turned)
        return (
            reach * (cos - 1.0) / turned + across * cos,
            -reach * sin / turned - across * sin,
        )

    @property
    def asked(self) -> bool:
        """Whether the hand has pressed: from now on the angle ought to be the target."""
        return self.sim.time > self.touch_time + _PRESSED - 1e-9

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """How near the angle is to what it ought to be, and how long it has been there."""
        ought = self.target if self.asked else 0.0
        before, self._bent = self._bent, self.sensed.angle
        near = self.asked and abs(self._bent - self.target) <= self.tolerance
        self._at_goal = self._at_goal + 1 if near else 0
        success = self._held > self.hold_time - 1e-9 and not harmed
        early = self.sim.time < self.touch_time and self._bent > self.alarm
        reach = (abs(before - ought) - abs(self._bent - ought)) / math.pi
        return Verdict(
            terms={"reach": 5.0 * reach, "goal": 10.0 if success else 0.0},
            success=success,
            ended="false alarm: it bent before it was touched" if early else None,
            seen={"time at the goal": min(self._held, self.hold_time)},
        )

    @property
    def _held(self) -> float:
        """Time at the goal [s]."""
        return self._at_goal * self.interval

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        reading = self.sensed.resistance + self.noise * self._drawn
        self._filtered = self._mean + (reading - self._mean) / FILTER
        self._lowest = min(self._lowest, self._filtered)
        return {
            "resistance": self._filtered,
            "resistance reading": reading,
            "lowest resistance": self._lowest,
            "TCA power": self.sim.power[0],
            "commanded angle": self.target,
            "time at the goal": min(self._held, self.hold_time),
        }

    def details(self) -> dict[str, Any]:
        """The commanded and the true angle [rad], and whether the hand has pressed."""
        return {"target": self.target, "angle": self._bent, "asked": self.asked}

    def bent(self) -> float:
        """Angle by which the finger is bent towards its pair of TCAs [rad]."""
        return self.sensed.angle


_OPTIONS = Options(
    [
        Option(
            name="target", about="angle to hold", unit="rad", low=math.radians(30.0),
            high=math.radians(75.0), draw=Constant(math.radians(60.0)), drawn="60°",
        ),
        Option(
            name="touch", about="angle, about, by which the hand bends the finger", unit="rad",
            low=0.0, high=math.radians(105.0),
            draw=Uniform(math.radians(85.0), math.radians(95.0)), drawn="drawn, 85 to 95°",
        ),
        Option(
            name="touch_time", about="when the hand sets out", unit="s", low=0.5, high=600.0,
            draw=Uniform(1.0, 4.0), drawn="drawn, 1 to 4 s",
        ),
        Option(
            name="noise", about="standard deviation of a reading", unit="ohm", low=0.0, high=0.1,
            draw=Constant(NOISE), drawn="0.01",
        ),
        *variation_options(),
    ]
)  # fmt: skip

FingerSenseVector = partial(TaskVector, FingerSense)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

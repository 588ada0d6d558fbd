"""``TCA/BendReach-v0``: three TCAs bring the tip of a soft module to a point (Sun, 4.1.3)."""

from __future__ import annotations

from functools import partial
from typing import Any, ClassVar, Unpack

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import door
from tca_mj.drive import Drive, SimulationDiverged, Timestep
from tca_mj.envs.hanging import CLAMP, PERIOD, TCAS, NoRest, StaticTip
from tca_mj.envs.options import Constant, Option, Options, Setup, variation_options
from tca_mj.envs.outcome import Verdict
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import SimulatedTask, TaskArguments
from tca_mj.envs.vector import TaskVector
from tca_mj.modules.bending import BendingSpec

_SIDES = (1, 3, 2)  # TCAs, left and right of the x-z plane swapped

OBSERVATION = Table(
    [
        Entry("TCA temperature", TCAS, -50.0, 300.0, "°C", centre=80.0, scale=60.0, mirror=_SIDES),
        Entry("TCA length", TCAS, 0.0, 0.2, "m", centre=0.045, scale=0.01, mirror=_SIDES),
        Entry("TCA tension", TCAS, 0.0, 5.0, "N", centre=0.2, scale=0.2, mirror=_SIDES),
        Entry("tip position", 3, -0.2, 0.2, "m", scale=0.03, mirror=(1, -2, 3)),
        Entry("tip velocity", 3, -10.0, 10.0, "m/s", scale=0.05, mirror=(1, -2, 3)),
        Entry("target position", 3, -0.2, 0.2, "m", scale=0.03, mirror=(1, -2, 3)),
        Entry("time at the target", 1, 0.0, 1.0, "s"),
    ]
)
ACTION = Table([Entry("TCA heating", TCAS, -1.0, 1.0, "-", off=-1.0, mirror=_SIDES)])

_SETTLING = 0.5  # time in which the cold module comes to rest [s]
_SHRINK = 0.8  # rise of temperature is cut to this share until the module comes to rest
_TRIES = 12  # as often at most, which leaves a twelfth of it
_NEAR = 1e-4  # how near to a given target the module has to rest [m]
_SUPPLY = 0.9  # share of the largest power that is enough to stay at a target
_COLDER, _COLDEST = 1.0, 0.75  # largest rise of the other two TCAs over that of the hottest


def _rise(random: np.random.Generator, setup: Setup) -> NDArray[np.float64]:
    most = random.uniform(0.5, 1.0)
    shares = [1.0, random.uniform(0.0, _COLDER), random.uniform(0.0, _COLDEST)]
    return (most * np.array(shares))[random.permutation(TCAS)]


_OPTIONS = Options(
    [
        Option(
            name="rise", shape=(TCAS,), low=0.0, high=1.0, draw=_rise, drawn="drawn",
            about="rise of the TCAs' temperatures at the target over the largest",
        ),
        Option(
            name="target", about="the target, from the clamp, instead", unit="m", shape=(3,),
            draw=Constant(None), drawn="where the tip rests at that rise",
        ),
        *variation_options(),
    ]
)  # fmt: skip


class BendReach(SimulatedTask):
    """Bring the tip of a hanging bending module to a point, and keep it there.

    Action, shape (3,), all in [-1, 1]: temperature to hold, or power, of the TCAs ``tca0`` to
    ``tca2``, which bend the module to x and to 120° and 240° from there, clockwise seen from above;
    see ``SimulatedTask``.

    Observation, shape (19,): see ``OBSERVATION``, whose rows have units and bounds. Positions are
    from the clamp, with the axes of the world: z up, so that the cold tip is at z = -45 mm.

    Reward, the sum of the terms in ``info["reward_terms"]``:
        reach: What the distance between tip and target has shrunk by, over 3 mm.
        goal: 10 in the step in which the tip has been within 3 mm of the target for 1 s.
        energy: Minus 0.02 per joule of electrical energy.
        heat: Minus 0.002 for every kelvin by which a TCA is above ``hot_temperature``, every 0.1 s.
        end: Minus 5 in the step in which a TCA is too hot or torn.

    The first is a difference: staying somewhere and shaking earn nothing.

    Reset: cold and at rest. The target is where the tip of this very module rests while its TCAs
    have temperatures that are drawn between that of the surroundings and ``hottest_target``, or
    what 90 % of the power can keep: it can be reached, and kept. A target that is given is refused
    if the module cannot rest there. ``options`` is the table of all that can be given.

    Terminates at the goal (success). Truncates after the time limit, and with
    ``info["truncation_reason"]`` if a TCA is too hot or torn, or if the simulation diverged.
    """

    max_power: ClassVar[float] = 2.0  # of each TCA, as in the arm [W]
    max_temperature: ClassVar[float] = 180.0  # annealing temperature, Sun, Table 2.1 [°C]
    hot_temperature: ClassVar[float] = 140.0  # 20 K below where the module may not rest [°C]
    hottest_target: ClassVar[float] = 130.0  # of a TCA, at rest at the target [°C]
    safe_temperature: ClassVar[float] = 140.0  # [°C]
    control_period = PERIOD  # [s]
    tolerance: ClassVar[float] = 3e-3  # [m]
    hold_time: ClassVar[float] = 1.0  # time at the target [s]
    terms = ("reach", "goal", "energy", "heat", "end")
    energy_price, heat_price, end_price = 0.02, 0.002, 5.0
    camera_prefix = "stand."
    scripted = "tca_mj.agents.scripts.reach:scripted"
    scripted_arguments = {"action": "power"}
    robot_argument = ("module_spec", BendingSpec)
    recipes = dict.fromkeys(("sac", "ppo"), Recipe(steps=60_000, action="power"))

    @door
    def __init__(
        self,
        *,
        module_spec: BendingSpec | None = None,
        timestep: Timestep = 5e-3,
        **common: Unpack[TaskArguments],
    ) -> None:
        """Builds the scene.

        Args:
            module_spec: The module, by default the published one; with three TCAs.
            timestep: Physics time step, of which ``control_period`` is a multiple [s].
            **common: See ``TaskArguments``.

        Raises:
            ValueError: If an argument is unknown or out of range, or the module cannot be built.
        """
        self.module_spec = self._robot(module_spec, common)
        self.static = StaticTip(self.module_spec, timestep=timestep)
        longest = float(self.static.sim.bank.longest.max())
        size = max(longest, 1.5 * self.module_spec.length)
        seen = OBSERVATION.covering(
            {
                "TCA length": (0.0, longest), "tip position": (-size, size),
                "target position": (-size, size),
            }
        )  # fmt: skip
        self._open(self.static.sim, seen, ACTION, _OPTIONS, **common)
        self._mocap = int(self.model.body("stand.target").mocapid[0])
        self.target = np.zeros(3)
        self.target_temperature = self.sim.temperature.copy()
        self._at_target = 0
        self._distance = self._gap()
        self._try("module_spec", module_spec)

    def prepare(self, setup: Setup) -> None:
        """Finds the target; then the cold module comes to rest."""
        if setup["target"] is None:
            self.target, self.target_temperature = self._drawn_target(setup["rise"])
        else:
            self.target = setup["target"]
            self.target_temperature = self._given_target(self.target)
        self.sim.reset()
        self.sim.step(np.zeros(TCAS), _SETTLING)
        self.sim.tca = self.sim.bank.rest()
        self.data.time = 0.0
        self.data.mocap_pos[self._mocap] = CLAMP + self.target
        mujoco.mj_forward(self.model, self.data)
        self._at_target = 0
        self._distance = self._gap()

    def _drawn_target(
        self, rise: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the tip rests at shares of the largest rise of temperature; and the temperatures.

        A module so far off that it finds no rest there is heated less.

        Raises:
            ValueError: If it finds none at a twelfth of that.
        """
        ambient, hottest = self.sim.bank.heat.ambient, self._hottest()
        for _ in range(_TRIES):
            temperature = ambient + rise * (hottest - ambient)
            try:
                return self.static.at(temperature), temperature
            except (NoRest, SimulationDiverged):
                rise = _SHRINK * rise
        spec = self.module_spec
        raise ValueError(
            f"module_spec must be one that rests with its TCAs {(rise / _SHRINK).max():.0%} of the"
            f" way to {hottest:.0f} °C warm, as a shorter, thicker or stiffer one may, got"
            f" {spec.length} m by {spec.diameter} m with {self._varied}"
        )

    def _given_target(self, target: NDArray[np.float64]) -> NDArray[np.float64]:
        """Temperatures at which the tip rests at a given target."""
        hottest = self._hottest()
        try:
            temperature, _, gap = self.static.inverse(target, hottest)
        except NoRest as error:
            raise ValueError(f"target must be one at rest, got {target}: {error}") from error
        if gap > _NEAR:
            raise ValueError(
                f"target must be where the tip can rest with TCAs of up to {hottest:.0f} °C, got"
                f" {target}, {1e3 * gap:.1f} mm from there"
            )
        return temperature

    def _hottest(self) -> float:
        """Highest temperature at a target: ``hottest_target``, or what the power can keep."""
        heat = self.sim.bank.heat
        kept = heat.ambient + _SUPPLY * self.max_power / (heat.loss + heat.conductance)
        return min(self.hottest_target, float(np.min(kept)))

    def drive(self, command: NDArray[np.float64]) -> Drive:
        """What the TCAs are told; see the class."""
        return Drive(command=self.heated(command))

    def judge(self, drive: Drive, harmed: bool) -> Verdict:
        """How far the tip is from the target, and how long it has been there."""
        before, self._distance = self._distance, self._gap()
        self._at_target = self._at_target + 1 if self._distance <= self.tolerance else 0
        success = self._held > self.hold_time - 1e-9 and not harmed
        return Verdict(
            terms={
                "reach": (before - self._distance) / self.tolerance,
                "goal": 10.0 if success else 0.0,
            },
            success=success,
            seen={"time at the target": min(self._held, self.hold_time)},
        )

    @property
    def _held(self) -> float:
        """Time at the target [s]."""
        return self._at_target * self.interval

    def _gap(self) -> float:
        """Distance of tip and target [m]."""
        return float(np.linalg.norm(self.static.tip() - self.target))

    def observe(self) -> dict[str, ArrayLike]:
        """See ``OBSERVATION``."""
        self.static.locate()
        sim = self.sim
        return {
            "TCA temperature": sim.temperature,
            "TCA length": sim.length,
            "TCA tension": sim.tension,
            "tip position": self.static.tip(),
            "tip velocity": self.static.velocity(),
            "target position": self.target,
            "time at the target": min(self._held, self.hold_time),
        }

    def details(self) -> dict[str, Any]:
        """The target [m], temperatures that reach it [°C], and how far the tip is from it [m]."""
        return {
            "target": self.target.copy(),
            "target_temperature": self.target_temperature.copy(),
            "distance_to_target": self._distance,
        }

    def bent(self) -> float:
        """Angle of the tip from straight down [rad]."""
        return self.sim.bend("bench.module.body")


BendReachVector = partial(TaskVector, BendReach)  # several, stepped together
"""Several of them as one vector environment, made by ``gymnasium.make_vec``."""

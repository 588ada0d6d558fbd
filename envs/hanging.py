"""A bending module that hangs from a stand, and where its tip rests."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.assets import mjcf
from tca_mj.checks import door, number, require_one_of, within
from tca_mj.drive import Timestep
from tca_mj.model.chain import Place, Quaternion
from tca_mj.model.part import Part, new_spec
from tca_mj.model.scene import scene
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.sim import Simulation
from tca_mj.tca import Supply

TCAS = 3
PERIOD = 0.1  # time between two updates of the TCAs [s]

CLAMP = np.array([0.0, 0.0, 0.1])  # where the module hangs [m]
_DOWN = (0.0, 1.0, 0.0, 0.0)  # z of the module down, its TCA 0 towards x of the world, wxyz
_RESTING = 4.0  # time after which a module at constant temperatures rests, see the docs [s]
_AT_REST = 5e-5  # way of the tip in the last control period of that, if it does [m]
_FOUND = 2e-5  # how near the search for temperatures comes, if it can [m]
# Changes of temperature to find a slope, of one round of the search, and the least of one [K].
_PROBE, _STRIDE, _FINEST = 1.0, 30.0, 0.5


class NoRest(ArithmeticError):
    """The module does not come to rest."""


class StaticTip:
    """Where the tip of a hanging module rests, found by letting it come to rest.

    Attributes:
        sim: The module in its scene; what is asked for changes its state.
    """

    @door
    def __init__(self, spec: BendingSpec, *, timestep: Timestep = 5e-3) -> None:
        """Builds the scene.

        Args:
            spec: The module, with three TCAs.
            timestep: Physics time step, of which ``PERIOD`` is a multiple [s].

        Raises:
            ValueError: If the module has not three TCAs or cannot be built, or the time step fits
                ``PERIOD`` not.
        """
        require_one_of("module_spec.count", spec.count, (TCAS,))
        self.sim = Simulation(
            hang(bending_module(spec), CLAMP.tolist(), _DOWN, "reach_stand"),
            timestep=timestep, tca_period=PERIOD,
        )  # fmt: skip
        self._tip = int(self.sim.model.site("bench.module.tip").id)

    def locate(self) -> None:
        """Computes where the tip is now: a physics step leaves where it was at its start."""
        model, data = self.sim.model, self.sim.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)

    def tip(self) -> NDArray[np.float64]:
        """Where the tip was when it was last located, from the clamp, shape (3,) [m]."""
        return self.sim.data.site_xpos[self._tip] - CLAMP

    def velocity(self) -> NDArray[np.float64]:
        """Velocity that the tip had then, shape (3,) [m/s]."""
        six, site = np.empty(6), mujoco.mjtObj.mjOBJ_SITE
        mujoco.mj_objectVelocity(self.sim.model, self.sim.data, site, self._tip, six, 0)
        return six[3:]

    def at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Where the tip rests at constant temperatures of the TCAs.

        The unloaded module gets the temperatures at once and is then left alone for 4 s, with the
        power that its heat loss takes.

        Args:
            temperature: Temperatures, shape (3,), from that of the surroundings to 400 °C [°C].

        Raises:
            ValueError: If a temperature is out of bounds.
            NoRest: If the tip still moves then.
            SimulationDiverged: If the module leaves what the TCAs' law holds for.
        """
        sim = self.sim
        shape, coldest = (TCAS,), sim.bank.heat.ambient.min() - 1e-9
        temperature = within(
            "temperature", temperature, at_least=coldest, at_most=400.0, unit="°C", shape=shape
        ).copy()
        sim.reset()
        power = sim.keep(temperature)
        given, sim.bank.supply = sim.bank.supply, Supply()  # a task may command temperatures
        try:
            sim.step(power, _RESTING - PERIOD)
            before = self.tip()
            sim.step(power, PERIOD)
        finally:
            sim.bank.supply = given
        moved = float(np.linalg.norm(self.tip() - before))
        if moved > _AT_REST:
            raise NoRest(f"the tip moves {moved:.2g} m in {PERIOD} s at {temperature} °C")
        return self.tip()

    def inverse(
        self, target: ArrayLike, hottest: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Temperatures at which the tip rests as near to ``target`` as it can.

        Args:
            target: A place, from the clamp, shape (3,) [m].
            hottest: Temperature that no TCA may pass, above that of the surroundings [°C].

        Returns:
            The temperatures, shape (3,) [°C]; the derivative of the tip's place by them, shape
            (3, 3) [m/K]; and how far the tip is from the target [m].

        Raises:
            NoRest, SimulationDiverged: As ``at``.
            ValueError: If the target is no place, or the temperature out of bounds.
        """
        target, ambient = within("target", target, shape=(3,)), self.sim.bank.heat.ambient
        number("hottest", hottest, at_least=float(ambient.max()), at_most=400.0, unit="°C")
        # The TCA on the target's side is the hottest.
        angle = -2.0 * np.pi / TCAS * np.arange(TCAS)
        aside = np.cos(angle) * target[0] + np.sin(angle) * target[1]
        share = np.clip(0.4 + aside / 0.04, 0.1, 0.9)
        found, stride = ambient + share * (hottest - ambient), _STRIDE
        tip = self.at(found)
        slope, gap = self._slope(found, tip, hottest), float(np.linalg.norm(tip - target))
        while gap > _FOUND and stride > _FINEST:
            change = np.linalg.lstsq(slope, target - tip, rcond=None)[0]
            change /= max(1.0, np.abs(change).max() / stride)
            tried = np.clip(found + change, ambient, hottest)
            there = self.at(tried)
            left = float(np.linalg.norm(there - target))
            if left < 0.9 * gap:
                found, tip, gap, stride = tried, there, left, _STRIDE
                slope = self._slope(found, tip, hottest)
            else:  # too far: the slope is another one there
                stride = 0.5 * float(np.abs(change).max())
        return found, slope, gap

    def _slope(
        self, temperature: NDArray[np.float64], tip: NDArray[np.float64], hottest: float
    ) -> NDArray[np.float64]:
        """Derivative of the tip's place, ``tip`` at these temperatures, shape (3, 3) [m/K]."""
        moved = np.where(temperature + _PROBE > hottest, -_PROBE, _PROBE)
        return np.stack(
            [(self.at(temperature + way) - tip) / way.sum() for way in np.diag(moved)], axis=-1
        )


@door
def hang(module: Part, place: Place, turn: Quaternion, stand: str) -> Part:
    """A scene in which ``module``, of that name, hangs from a stand.

    Args:
        module: What hangs.
        place: Where its base is [m].
        turn: Turn of its base, a quaternion wxyz.
        stand: Name of the MJCF file of the stand.
    """
    robot = Part(new_spec("bench"))
    robot.spec.worldbody.add_site(name="clamp", pos=place, quat=turn, group=4)
    robot.attach(module, to="clamp", prefix="module")
    return scene(mjcf("arena.xml"), robot, {"stand": mjcf(f"{stand}.xml")}, name="bench")

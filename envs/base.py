"""What all tasks share: a simulation, how tools reach it, and its picture."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.envs.table import numbers
from tca_mj.render import Offscreen, colour_tendons
from tca_mj.sim import Drive, Simulation, SimulationDiverged, SimulationOverheated

Observation = NDArray[np.float32]
Action = NDArray[np.float32]
Outcome = tuple[Observation, float, bool, bool, dict[str, Any]]
"""What ``step`` returns: observation, reward, terminated, truncated and info."""


class SimulatedTask(gym.Env[Observation, Action], ABC):
    """A task that runs a ``Simulation``; its heirs say what is seen, done and paid for.

    A step is ``begin``, which says what the action does to the simulation, then the simulation,
    then ``finish``, which judges where that has led. A vector environment calls the two for each
    of its tasks and lets all simulations run between them.

    Attributes:
        sim: The simulation.
        control_period: Time of one step [s].
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}
    control_period: ClassVar[float] = 0.1
    sim: Simulation
    render_mode: str | None
    _camera: str
    _size: tuple[int, int]
    _screen: Offscreen | None = None

    def _look(
        self,
        render_mode: str | None,
        camera: str,
        size: tuple[int, int],
        *,
        cameras: Sequence[str],
        prefix: str = "",
    ) -> None:
        """Keeps how the task is to be drawn: by ``camera``, one of ``cameras``.

        Raises:
            ValueError: If the mode or the camera is unknown, or the size below a pixel.
        """
        modes = self.metadata["render_modes"]
        if render_mode not in (None, *modes):
            raise ValueError(f"render_mode must be None or one of {modes}, got {render_mode!r}")
        if camera not in cameras:
            raise ValueError(f"camera must be one of {list(cameras)}, got {camera!r}")
        if numbers("size", size, (2,)).min() < 1.0:
            raise ValueError(f"size must be at least 1 pixel each way, got {size}")
        self.render_mode = render_mode
        self._camera, self._size = prefix + camera, size

    @abstractmethod
    def begin(self, command: NDArray[np.float64]) -> Drive:
        """Translates a command, the action within its bounds, to what drives the simulation."""

    @abstractmethod
    def finish(self, drive: Drive, error: SimulationDiverged | None) -> Outcome:
        """What the control step has led to.

        Args:
            drive: What ``begin`` returned.
            error: Why the simulation broke off, or None.
        """

    def command(self, action: Action) -> NDArray[np.float64]:
        """The action as finite numbers within -1 and 1.

        Raises:
            ValueError: If the action has the wrong shape, is not finite or out of [-1, 1].
        """
        command = numbers("action", action, self.action_space.shape or ())
        if np.abs(command).max() > 1.0 + 1e-6:
            raise ValueError(f"action must be within -1 and 1, got {command}")
        return np.clip(command, -1.0, 1.0)

    def step(self, action: Action) -> Outcome:
        """Runs the simulation for ``control_period``; see the class.

        Raises:
            ValueError: If the action has the wrong shape, is not finite or out of [-1, 1].
        """
        drive = self.begin(self.command(action))
        error = None
        try:
            self.sim.step(drive.power, self.control_period, voltage=drive.voltage, fan=drive.fan)
        except SimulationDiverged as diverged:
            error = diverged
        return self.finish(drive, error)

    # What tools that know Gymnasium's own MuJoCo environments look for.
    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.sim.model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state."""
        return self.sim.data

    @property
    def dt(self) -> float:
        """Time of one step [s]."""
        return self.control_period

    @property
    def camera(self) -> str:
        """Name of the camera of the pictures."""
        return self._camera

    def paint(self) -> None:
        """Gives what is hot the colour of its temperature; no physics reads it."""
        colour_tendons(self.model, self.sim.tendon, self.sim.temperature)

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the scene, shape (height, width, 3), or None without a render mode.

        Raises:
            RenderingUnavailable: If there is no OpenGL.
        """
        if self.render_mode is None:
            return None
        if self._screen is None:
            width, height = self._size
            self._screen = Offscreen(self.model, width=width, height=height, camera=self._camera)
        self.paint()
        return self._screen.draw(self.data)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the window: a copy goes on where this one is."""
        return self.__dict__ | {"_screen": None}

    def close(self) -> None:
        """Frees what rendering took."""
        if self._screen is not None:
            self._screen.close()
            self._screen = None


def heat_of_tcas(sim: Simulation) -> dict[str, Any]:
    """What every task's ``info`` says of heat, arrays of shape (n,).

    Returns:
        ``temperature`` of the TCAs; ``body_temperature`` of what they lie in, the air's if they are
        bare [°C]; and ``extrapolated``, whether a TCA is hotter than what its law was measured at.
    """
    return {
        "temperature": sim.temperature.copy(),
        "body_temperature": sim.body_temperature.copy(),
        "extrapolated": sim.extrapolated,
    }


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

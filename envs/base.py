"""What all tasks share: a simulation, how tools reach it, and its picture."""

from typing import Any, ClassVar

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.render import Offscreen, colour_tendons
from tca_mj.sim import Simulation

Observation = NDArray[np.float32]
Action = NDArray[np.float32]


class SimulatedTask(gym.Env[Observation, Action]):
    """A task that runs a ``Simulation``; its heirs say what is seen, done and paid for.

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

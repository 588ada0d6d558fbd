"""An interactive window on a task: dm_control's viewer, driven by a Gymnasium environment.

Keys: space starts and pauses, backspace begins the next episode, = and - change the speed, F1
lists the others. The mouse turns and moves the view; with Ctrl it pulls at a body that was chosen
by a double click.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from typing import Any

import dm_env  # type: ignore[import-untyped]
import gymnasium as gym
import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from tca_mj.envs.outcome import how_it_ended
from tca_mj.record.render import colour_tendons

Action = NDArray[np.float32]
Choice = Callable[[NDArray[np.float32]], Action]

_HIDDEN = 5  # group of sites that the viewer does not show unless asked


class NoDisplay(RuntimeError):
    """A window cannot be opened here; the message says why."""


class ViewerEnvironment(dm_env.Environment):
    """A task of this package as dm_control's viewer wants it: one view of the same simulation.

    Every step of the viewer is one control period of the task. Nothing is copied: what the viewer
    shows, and what the mouse pulls at, is the task's own MuJoCo state.

    Attributes:
        env: The task.
        physics: Its model and state, as dm_control's ``Physics``.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,
    ) -> None:
        """Resets ``env``.

        Args:
            env: The task; its ``unwrapped`` has the simulation as ``sim``.
            seed: Seed of the first episode; later ones go on from there.
            options: Options of every reset.
        """
        self.env = env
        self._seed = seed
        self._options = options
        task: Any = env.unwrapped
        self._sim = task.sim
        env.reset(seed=seed, options=options)
        # The sites that lead the TCAs would hide them.
        self._sim.model.site_group[:] = _HIDDEN
        self.physics = self._sim.physics()

    def reset(self) -> dm_env.TimeStep:
        """Begins an episode."""
        observation, _ = self.env.reset(seed=self._seed, options=self._options)
        self._seed = None
        self._paint()
        return dm_env.restart(observation)

    def step(self, action: Any) -> dm_env.TimeStep:
        """One control period; how the episode ended is printed."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._paint()
        ending = how_it_ended(terminated, truncated, info)
        if ending is not None:
            print(f"the episode ended after {self._sim.time:.1f} s: {ending}")
        if terminated:
            return dm_env.termination(float(reward), observation)
        if truncated:
            return dm_env.truncation(float(reward), observation)
        return dm_env.transition(float(reward), observation)

    def action_spec(self) -> Any:
        """Shape and bounds of an action."""
        return _spec(self.env.action_space)

    def observation_spec(self) -> Any:
        """Shape and bounds of an observation."""
        return _spec(self.env.observation_space)

    def _paint(self) -> None:
        sim = self._sim
        colour_tendons(sim.model, sim.tendon, sim.temperature)


class ViewerPolicy:
    """A policy as dm_control's viewer wants it.

    Attributes:
        choose: An observation in, an action out.
        begin: Called before every new episode.
    """

    def __init__(self, choose: Choice, begin: Callable[[], object] | None = None) -> None:
        self.choose, self.begin = choose, begin

    def __call__(self, time_step: dm_env.TimeStep) -> Action:
        return self.choose(time_step.observation)

    def reset(self) -> None:
        """Called by the viewer when it starts an episode anew."""
        if self.begin is not None:
            self.begin()


def _spec(space: gym.Space[Any]) -> specs.BoundedArray:
    if not isinstance(space, gym.spaces.Box):
        raise ValueError(f"space must be a Box, got {space}")
    return specs.BoundedArray(space.shape, space.dtype, space.low, space.high)


def need_display() -> None:
    """Opens and closes a small window.

    Raises:
        NoDisplay: If that fails.
    """
    if sys.platform.startswith("linux"):
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise NoDisplay("neither DISPLAY nor WAYLAND_DISPLAY is set")
    import glfw

    with warnings.catch_warnings(record=True) as complaints:
        warnings.simplefilter("always")
        try:
            works = bool(glfw.init())
            if works:
                glfw.window_hint(glfw.VISIBLE, 0)
                window = glfw.create_window(64, 64, "", None, None)
                glfw.default_window_hints()
                works = bool(window)
                if window:
                    glfw.destroy_window(window)
        except glfw.GLFWError as error:
            raise NoDisplay(str(error)) from error
    if not works:
        raise NoDisplay("; ".join(str(c.message) for c in complaints) or "no window was opened")


def launch(
    env: gym.Env[Any, Any],
    policy: ViewerPolicy,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    title: str = "tca-mj",
) -> None:
    """Opens the window and returns when it is closed.

    The environment variable ``MUJOCO_GL`` is set to ``glfw`` for this process: a window cannot be
    had otherwise, and dm_control reads it when it is imported.

    Args:
        env: A task of this package.
        policy: Who acts.
        seed: Seed of the first episode; the others follow.
        options: Options of every reset.
        title: Title of the window.

    Raises:
        NoDisplay: If no window can be opened.
        ImportError: If dm-control is not installed, see ``tca_mj.envs.rewards``.
    """
    need_display()
    os.environ["MUJOCO_GL"] = "glfw"
    try:
        from dm_control import viewer
    except ModuleNotFoundError as missing:
        raise ImportError("the window is that of dm-control, which is not installed") from missing

    shown = ViewerEnvironment(env, seed=seed, options=options)
    viewer.launch(shown, policy=policy, title=title, width=1280, height=960)

"""Pictures and films of a simulation, drawn without a screen.

Nothing is loaded before the first picture. Which way to OpenGL works on a machine can only be
found out by trying, and a bad driver may end the process that tries: it is tried in a process of
its own, once. ``MUJOCO_GL`` (``egl``, ``osmesa``, ``glfw``) names one way and is then the only one
that is tried; ``mujoco`` itself may have been imported before.

On Debian and Ubuntu ``egl`` needs the packages ``libegl1`` and ``libgl1-mesa-dri`` (or a graphics
driver), ``osmesa`` needs ``libosmesa6``.
"""

from __future__ import annotations

import atexit
import functools
import importlib
import os
import subprocess
import sys
import threading
import weakref
from typing import Annotated, Any, Protocol, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import door, floats, instance, shown, whole
from tca_mj.forks import Held, keep_for_ever
from tca_mj.record.coils import wind
from tca_mj.record.plots import COLDEST, HOTTEST, temperature_colour

Pixels = Annotated[int, functools.partial(whole, at_least=1, at_most=8192)]
"""Width or height of a picture: twice that of a large screen, in every OpenGL's reach."""

_PROBE = """
import importlib, sys
import mujoco
context = importlib.import_module("mujoco." + sys.argv[1]).GLContext(64, 64)
context.make_current()
drawing = mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), 100)
drawing.free()
context.free()
"""
_PROBE_SECONDS = 60.0
_STOPS, _LARGE = 12, 480  # boxes of the scale; height from which on letters are large [pixels]
_OFF = ("disable", "disabled", "off", "false", "0")
_ANY = ("", "enable", "enabled", "on", "true", "1")


class RenderingUnavailable(RuntimeError):
    """Pictures cannot be drawn here; the message says what to install."""


class Closing:
    """A context manager that is closed at its end; there is one of it, no copy and no pickle."""

    def __reduce_ex__(self, protocol: Any) -> Any:
        name = type(self).__name__
        raise TypeError(f"a {name} cannot be copied: it holds an open file or a window")

    def close(self) -> None:
        """Gives back what it holds; it may be called again."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Watched(Protocol):
    """What a camera needs of a simulation; ``tca_mj.sim.Simulation`` has it."""

    @property
    def model(self) -> mujoco.MjModel:
        """Compiled model."""

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def tendon(self) -> NDArray[Any]:
        """Ids of the TCAs' tendons, shape (n,)."""

    @property
    def temperature(self) -> NDArray[np.float64]:
        """Temperature of each TCA, shape (n,) [°C]."""


def gl_backend() -> str:
    """Name of a way to OpenGL that works here: ``egl``, ``osmesa``, ``glfw`` or ``cgl``.

    The first call starts short processes that try; the answer is kept.

    Raises:
        RenderingUnavailable: If none works, or ``MUJOCO_GL`` forbids or names one that fails.
    """
    # PyOpenGL binds itself to one platform for the life of the process.
    bound = os.environ.get("PYOPENGL_PLATFORM", "") if "OpenGL.platform" in sys.modules else ""
    return _working_backend(os.environ.get("MUJOCO_GL", "").lower().strip(), bound.lower())


@functools.cache
def _working_backend(wanted: str, bound: str) -> str:
    if wanted in _OFF:
        raise RenderingUnavailable(f"rendering is switched off by MUJOCO_GL={wanted}; unset it")
    if wanted not in _ANY:
        candidates: tuple[str, ...] = ({"glx": "glfw", "wgl": "glfw"}.get(wanted, wanted),)
    elif sys.platform.startswith("linux"):
        screen = "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
        candidates = ("egl", "glfw", "osmesa") if screen else ("egl", "osmesa")
    else:
        candidates = ("cgl", "glfw") if sys.platform == "darwin" else ("glfw",)
    if bound in ("egl", "osmesa"):
        candidates = tuple(c for c in candidates if c == bound or c not in ("egl", "osmesa"))
    failures = []
    for candidate in candidates:
        failure = _probe(candidate)
        if failure is None:
            return candidate
        failures.append(f"{candidate}: {failure}")
    raise RenderingUnavailable(
        "no OpenGL for drawing without a screen. On Debian or Ubuntu install "
        "'libegl1 libgl1-mesa-dri' (MUJOCO_GL=egl) or 'libosmesa6' (MUJOCO_GL=osmesa); on a "
        "machine with a graphics card its driver brings EGL; everything else of the package "
        f"works without pictures. Tried {'; '.join(failures) or 'nothing: ' + bound + ' is bound'}"
    )


@functools.cache
def _probe(backend: str) -> str | None:
    """None if a process that draws with ``backend`` lives, else why it does not."""
    environment = dict(os.environ, MUJOCO_GL=backend)
    environment.pop("PYOPENGL_PLATFORM", None)
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PROBE, backend], env=environment, capture_output=True,
            text=True, timeout=_PROBE_SECONDS, check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if done.returncode == 0:
        return None
    # A driver that fails is noisy at exit, too: the first error is the cause.
    errors = [line for line in done.stderr.splitlines() if "Error" in line.split(":")[0]]
    return errors[0].strip() if errors else f"the process that tried ended with {done.returncode}"


def colour_tendons(model: mujoco.MjModel, tendon: ArrayLike, temperature: ArrayLike) -> None:
    """Gives tendons the colours of their temperatures, in ``model.tendon_rgba``.

    Only pictures change: MuJoCo's physics does not read colours.

    Args:
        model: Model whose colours are written.
        tendon: Ids of the tendons, shape (n,).
        temperature: Their temperatures, shape (n,) [°C].

    Raises:
        ValueError: If there is no such tendon, or there are other than n temperatures.
    """
    instance("model", model, mujoco.MjModel)
    ids, colours = _tendons(model, "tendon", tendon), temperature_colour(temperature)
    if colours.shape != (ids.size, 3):
        raise ValueError(f"temperature must be {ids.size} numbers, got {shown(temperature)}")
    model.tendon_rgba[ids, :3] = colours


def _tendons(model: mujoco.MjModel, name: str, tendon: ArrayLike) -> NDArray[np.int64]:
    ids = floats(name, tendon, empty=True)
    if ids.ndim != 1 or (ids % 1.0).any() or ((ids < 0) | (ids >= model.ntendon)).any():
        raise ValueError(f"{name} must be ids below {model.ntendon} in a row, got {shown(tendon)}")
    return ids.astype(np.int64)


class Offscreen(Closing, Held):
    """A camera and the memory it draws into; a context manager.

    OpenGL ties a drawing to the thread that opened it. Another one, or a process that was forked
    off, is refused; closed there, the memory is given back when the program ends.
    """

    @door
    def __init__(
        self, model: mujoco.MjModel, *, width: Pixels = 960, height: Pixels = 720,
        camera: int | str | mujoco.MjvCamera = -1, coils: ArrayLike = (),
    ) -> None:  # fmt: skip
        """Sets up OpenGL.

        Args:
            model: Model to draw.
            width: Width of the pictures, 1 to 8192 [pixels].
            height: Height of the pictures, 1 to 8192 [pixels].
            camera: Id or name of a camera of the model, a camera of one's own, or -1 for the
                model's overview.
            coils: Ids of tendons that are drawn as coils.

        Raises:
            RenderingUnavailable: If OpenGL cannot be had.
            ValueError: If the size is out of bounds, or the camera or a tendon does not exist.
        """
        Held.__init__(self)
        self._thread = threading.current_thread()
        self.camera = _camera(model, camera)
        self.model, self._coils = model, _tendons(model, "coils", coils)
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._scene = mujoco.MjvScene(model, maxgeom=20_000)
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0  # the sites that lead the TCAs would hide them
        self._gl: Any = None
        self._drawing: Any = None
        backend = gl_backend()
        try:
            self._gl = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
            self._gl.make_current()
            # The model states the size of MuJoCo's buffer; ours counts for this one drawing.
            screen = model.vis.global_
            size = screen.offwidth, screen.offheight
            screen.offwidth, screen.offheight = width, height
            try:
                scale = mujoco.mjtFontScale
                font = scale.mjFONTSCALE_150 if height >= _LARGE else scale.mjFONTSCALE_50
                self._drawing = mujoco.MjrContext(model, int(font))
            finally:
                screen.offwidth, screen.offheight = size
            mujoco.mjr_setBuffer(int(mujoco.mjtFramebuffer.mjFB_OFFSCREEN), self._drawing)
        except Exception as error:
            self.close()
            raise RenderingUnavailable(f"OpenGL by {backend} failed: {error}") from error
        # What is still open at exit must go before the OpenGL library does, which would complain.
        self._at_exit = functools.partial(_close, weakref.ref(self))
        atexit.register(self._at_exit)

    def draw(self, data: mujoco.MjData, caption: str = "") -> NDArray[np.uint8]:
        """Picture of ``data``, shape (height, width, 3).

        Args:
            data: What to draw.
            caption: What to write into a corner; with it comes a scale of the colours of
                temperatures.

        Raises:
            RuntimeError: If it is closed, or was opened by another thread or process.
        """
        if self._drawing is None:
            raise RuntimeError("the camera is closed")
        if self._foreign:
            raise RuntimeError(
                "a camera must draw in the process and thread that opened it"
                f" ({self._thread.name}): render there, or make an environment or camera for each"
            )
        self._gl.make_current()
        mujoco.mjv_updateScene(
            self.model, data, self._option, None, self.camera,
            int(mujoco.mjtCatBit.mjCAT_ALL), self._scene,
        )
        wind(self._scene, self.model, data, self._coils, self._rectangle.height)
        mujoco.mjr_render(self._rectangle, self._scene, self._drawing)
        if caption:
            self._write(caption)
        pixels = np.empty((self._rectangle.height, self._rectangle.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(pixels, None, self._rectangle, self._drawing)
        return np.ascontiguousarray(pixels[::-1])  # OpenGL counts rows from below

    def _write(self, caption: str) -> None:
        """A caption on the left, and a scale of temperatures on the right of the lower edge."""
        high, wide = self._rectangle.height, self._rectangle.width
        corner = int(mujoco.mjtGridPos.mjGRID_BOTTOMLEFT)
        font = int(mujoco.mjtFont.mjFONT_NORMAL)
        mujoco.mjr_overlay(font, corner, self._rectangle, caption, "", self._drawing)
        unit = max(high // 60, 4)
        stops = np.linspace(COLDEST, HOTTEST, _STOPS)
        left = wide - (_STOPS + 1) * unit
        for k, colour in enumerate(temperature_colour(stops).tolist()):
            box = mujoco.MjrRect(left + k * unit, unit, unit, unit)
            mujoco.mjr_rectangle(box, *colour, 1.0)
        above = mujoco.MjrRect(0, 2 * unit, wide, high - 2 * unit)
        corner, ends = int(mujoco.mjtGridPos.mjGRID_BOTTOMRIGHT), f"{COLDEST:g} to {HOTTEST:g} C"
        mujoco.mjr_overlay(font, corner, above, ends, "", self._drawing)

    def close(self) -> None:
        """Gives the memory back; it may be called again."""
        if self._foreign:
            keep_for_ever(self._drawing, self._gl)
            self._drawing = self._gl = None
        if self._drawing is not None:
            self._gl.make_current()
            self._drawing.free()
            self._drawing = None
        if self._gl is not None:
            self._gl.free()
            self._gl = None
            atexit.unregister(getattr(self, "_at_exit", _close))

    @property
    def _foreign(self) -> bool:
        return self.elsewhere or self._thread is not threading.current_thread()


def _close(reference: weakref.ref[Offscreen]) -> None:
    camera = reference()
    if camera is not None:
        camera.close()


def _camera(model: mujoco.MjModel, camera: int | str | mujoco.MjvCamera) -> mujoco.MjvCamera:
    if isinstance(camera, mujoco.MjvCamera):
        return camera
    made = mujoco.MjvCamera()
    if isinstance(camera, str):
        index = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_CAMERA), camera)
    else:
        index = camera
    if camera == -1:
        mujoco.mjv_defaultFreeCamera(model, made)
    elif 0 <= index < model.ncam:
        made.type, made.fixedcamid = int(mujoco.mjtCamera.mjCAMERA_FIXED), index
    else:
        raise ValueError(f"camera must be one of the model's {model.ncam}, or -1, got {camera!r}")
    return made

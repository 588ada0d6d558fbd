"""Films of a simulation, drawn by ``tca_mj.record.render``.

They need imageio and imageio-ffmpeg, which are loaded when the first one is begun.
"""

from __future__ import annotations

import importlib
import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import mujoco

from tca_mj.checks import door, number, shown
from tca_mj.files import Claim
from tca_mj.machine import how_to_install
from tca_mj.record.render import Closing, Offscreen, Pixels, Watched, colour_tendons

# A player shows no more; and the slowest film shows each step, the fastest an hour in a second.
_Fps = Annotated[float, partial(number, at_least=1.0, at_most=240.0)]
FilmSpeed = Annotated[float, partial(number, at_least=1e-3, at_most=3600.0)]


def clock(time: float, speed: float) -> str:
    """What a film's clock says: the time of the simulation [s], and how fast it goes by [1]."""
    said = f"{time:.{1 + max(0, math.ceil(-math.log10(speed)))}f} s"
    if speed == 1.0:
        return said
    return f"{said}, {max(speed, 1.0 / speed):.3g} times as {'fast' if speed > 1.0 else 'slow'}"


class Film(Closing):
    """A simulation filmed at a steady rate, whatever its control period; a context manager.

    TCAs are drawn as coils in the colours of their temperatures, of which there is a scale; a clock
    says the time of the simulation, and by how much the film is faster.

    The file is an mp4 (H.264, yuv420p). Frames go to the encoder one by one and are not kept. It is
    written by one film at a time; one that has been finished is overwritten by the first frame.
    """

    @door
    def __init__(
        self, simulation: Watched, path: str | Path, *, fps: _Fps = 30.0, speed: FilmSpeed = 1.0,
        width: Pixels = 960, height: Pixels = 720, camera: int | str | mujoco.MjvCamera = -1,
    ) -> None:  # fmt: skip
        """Prepares the file; OpenGL is set up by the first frame.

        Args:
            simulation: What to film.
            path: File to write, ending ``.mp4``; its folder is made if it is missing.
            fps: Frames per second of the film, 1 to 240 [1/s].
            speed: Simulated seconds per second of film, 0.001 to 3600 [1].
            width: Width, a multiple of 16 up to 8192 [pixels].
            height: Height, a multiple of 16 up to 8192 [pixels].
            camera: As in ``Offscreen``.

        Raises:
            ImportError: If imageio, imageio-ffmpeg or its encoder is not installed.
            ValueError: If a number is out of range.
        """
        if width % 16 or height % 16:
            raise ValueError(f"size must be multiples of 16 pixels, got {width} x {height}")
        self.simulation, self.path = simulation, Path(path)
        if self.path.suffix != ".mp4":
            raise ValueError(f"path must end in .mp4, got {shown(path)}")
        self._imageio = _imageio()
        self._writer: Any = None
        self._claim: Claim | None = None
        self._fps, self._rate = fps, fps / speed
        self._speed = speed
        self._size = width, height
        self._camera = camera
        self._view: Offscreen | None = None
        self._start = self._last = simulation.time
        self._written = 0

    def frame(self) -> None:
        """Films the present; call it after every step, as often as you like.

        Draws only when a frame is due, and repeats it when several are. A simulation that was
        reset is filmed on without a gap.

        Raises:
            RenderingUnavailable: If OpenGL cannot be had.
            ValueError: If another film writes this file now.
            OSError: If it cannot be written, or the encoder has ended.
        """
        time = self.simulation.time
        if time < self._last:
            self._start += time - self._last
        self._last = time
        due = int((time - self._start) * self._rate + 1e-6) + 1 - self._written
        if due <= 0:
            return
        model = self.simulation.model
        if self._view is None or self._view.model is not model:
            self._close_view()
            width, height = self._size
            self._view = Offscreen(
                model, width=width, height=height, camera=self._camera,
                coils=self.simulation.tendon,
            )  # fmt: skip
        colour_tendons(model, self.simulation.tendon, self.simulation.temperature)
        picture = self._view.draw(self.simulation.data, clock(time, self._speed))
        if self._writer is None:
            self._claim = Claim(self.path)
            self._writer = self._imageio.get_writer(
                self.path, format="FFMPEG", mode="I", fps=self._fps, codec="libx264",
                pixelformat="yuv420p", quality=8, macro_block_size=16, ffmpeg_log_level="error",
            )
        for _ in range(due):
            self._writer.append_data(picture)
        self._written += due

    def close(self) -> None:
        """Finishes the file; it may be called again."""
        self._close_view()
        writer, self._writer = self._writer, None
        try:
            if writer is not None:
                writer.close()
        finally:
            if self._claim is not None:
                self._claim.close()

    def _close_view(self) -> None:
        if self._view is not None:
            self._view.close()
            self._view = None


def _imageio() -> Any:
    """The imageio module that makes films."""
    try:
        importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
        return importlib.import_module("imageio.v2")
    except (ImportError, RuntimeError) as error:
        raise ImportError(
            f"films need imageio and imageio-ffmpeg: {how_to_install('demo')} ({error})"
        ) from error

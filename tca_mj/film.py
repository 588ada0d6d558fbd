"""Pictures and films of a simulation in files: png, jpg and mp4, drawn by ``tca_mj.render``.

Files need imageio, films also imageio-ffmpeg; both are loaded when the first file is written.
"""

import importlib
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.render import Offscreen, Watched, colour_tendons


def still(
    simulation: Watched,
    path: str | Path | None = None,
    *,
    width: int = 960,
    height: int = 720,
    camera: int | str | mujoco.MjvCamera = -1,
) -> NDArray[np.uint8]:
    """One picture of ``simulation`` now, TCAs coloured by temperature.

    Args:
        simulation: What to look at.
        path: File to write as well, by its ending ``.png`` or ``.jpg``; None for none.
        width: Width [pixels].
        height: Height [pixels].
        camera: As in ``Offscreen``.

    Returns:
        The picture, shape (height, width, 3).

    Raises:
        RenderingUnavailable: If OpenGL cannot be had.
        ImportError: If ``path`` is given and imageio is not installed.
    """
    with Offscreen(simulation.model, width=width, height=height, camera=camera) as view:
        colour_tendons(simulation.model, simulation.tendon, simulation.temperature)
        picture = view.draw(simulation.data)
    if path is not None:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        _imageio().imwrite(path, picture)
    return picture


class Video:
    """An mp4 file (H.264, yuv420p) that frames are appended to; a context manager.

    Frames go to the encoder one by one and are not kept.
    """

    def __init__(self, path: str | Path, *, fps: float = 30.0) -> None:
        """Prepares the file; it is made when the first frame comes.

        Args:
            path: File to write, ending ``.mp4``; its folder is made if it is missing.
            fps: Frames per second of the film [1/s].

        Raises:
            ImportError: If imageio or imageio-ffmpeg is not installed.
            ValueError: If ``fps`` is not positive or the ending differs.
        """
        if not (np.isfinite(fps) and fps > 0.0):
            raise ValueError(f"fps must be finite and above 0, got {fps}")
        self.path = Path(path)
        if self.path.suffix != ".mp4":
            raise ValueError(f"path must end in .mp4, got {self.path}")
        self.fps = fps
        self._imageio = _imageio("imageio_ffmpeg")
        self._writer: Any = None

    def append(self, frame: NDArray[np.uint8]) -> None:
        """Appends a frame, shape (height, width, 3), both multiples of 16.

        Raises:
            ValueError: If the size is no multiple of 16, which some players cannot show.
        """
        if frame.ndim != 3 or frame.shape[0] % 16 or frame.shape[1] % 16:
            raise ValueError(f"frame must be (16 k, 16 m, 3) pixels, got {frame.shape}")
        if self._writer is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = self._imageio.get_writer(
                self.path, format="FFMPEG", mode="I", fps=self.fps, codec="libx264",
                pixelformat="yuv420p", quality=8, macro_block_size=16, ffmpeg_log_level="error",
            )
        self._writer.append_data(frame)

    def close(self) -> None:
        """Finishes the file; it may be called again."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Film:
    """A simulation filmed at a steady rate, whatever its control period; a context manager."""

    def __init__(
        self,
        simulation: Watched,
        path: str | Path,
        *,
        fps: float = 30.0,
        speed: float = 1.0,
        width: int = 960,
        height: int = 720,
        camera: int | str | mujoco.MjvCamera = -1,
    ) -> None:
        """Prepares the file; OpenGL is set up by the first frame.

        Args:
            simulation: What to film.
            path: File to write, ending ``.mp4``.
            fps: Frames per second of the film [1/s].
            speed: Simulated seconds per second of film.
            width: Width, a multiple of 16 [pixels].
            height: Height, a multiple of 16 [pixels].
            camera: As in ``Offscreen``.

        Raises:
            ImportError: If imageio or imageio-ffmpeg is not installed.
            ValueError: If a number is out of range.
        """
        if not (np.isfinite(speed) and speed > 0.0):
            raise ValueError(f"speed must be finite and above 0, got {speed}")
        if width < 16 or height < 16 or width % 16 or height % 16:
            raise ValueError(f"width, height must be multiples of 16, got {width}, {height}")
        self.simulation = simulation
        self._video = Video(path, fps=fps)
        self._rate = fps / speed
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
            self._view = Offscreen(model, width=width, height=height, camera=self._camera)
        colour_tendons(model, self.simulation.tendon, self.simulation.temperature)
        picture = self._view.draw(self.simulation.data)
        for _ in range(due):
            self._video.append(picture)
        self._written += due

    def close(self) -> None:
        """Finishes the file; it may be called again."""
        self._close_view()
        self._video.close()

    def _close_view(self) -> None:
        if self._view is not None:
            self._view.close()
            self._view = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _imageio(*also: str) -> Any:
    """The imageio module; ``also`` names what it needs besides."""
    try:
        for name in also:
            importlib.import_module(name)
        return importlib.import_module("imageio.v2")
    except ImportError as error:
        raise ImportError(
            "pictures and films need imageio and imageio-ffmpeg: pip install 'tca-mj[demo]'"
        ) from error

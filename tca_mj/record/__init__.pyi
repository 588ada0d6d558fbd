from tca_mj.record.film import Film
from tca_mj.record.layout import QUANTITIES
from tca_mj.record.plots import rollout_plot, series_colours, temperature_colour
from tca_mj.record.reader import Curve, Recording, read, write_csv
from tca_mj.record.recorder import Recorded, Recorder
from tca_mj.record.render import (
    Offscreen,
    RenderingUnavailable,
    Watched,
    colour_tendons,
    gl_backend,
)
from tca_mj.record.webpage import WebPage

__all__ = [
    "Curve", "Film", "Offscreen", "QUANTITIES", "Recorded", "Recorder", "Recording",
    "RenderingUnavailable", "Watched", "WebPage", "colour_tendons", "gl_backend", "read",
    "rollout_plot", "series_colours", "temperature_colour", "write_csv",
]  # fmt: skip

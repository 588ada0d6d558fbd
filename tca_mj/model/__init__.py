"""From beams and routes to MuJoCo: chains of links, tendons, scenes."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

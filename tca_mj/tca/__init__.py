"""Physics of twisted-and-coiled actuators (TCAs): heat, tension, resistance; n at a time."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

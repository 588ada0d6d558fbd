"""Controllers: what turns an error into a voltage or a power, n actuators at a time."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

"""A spine of shape-memory polymer: modulus, heater, shape fixing and recovery, damage rule."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

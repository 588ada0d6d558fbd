"""A TCA for a purpose: which thread, mandrel, pitch, length and strands do what is wanted."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

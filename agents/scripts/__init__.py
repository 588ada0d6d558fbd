"""Scripted policies of the tasks: feedback on what is seen, no replay."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

"""Learned models of tasks: data sets of steps, models fitted to them, control by prediction."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

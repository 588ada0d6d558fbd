"""Learned models of tasks: data sets of their steps, models fitted to them, control by prediction."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

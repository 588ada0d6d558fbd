"""Gymnasium tasks, imported as ``tca_mj.envs``; their ids are in ``tca_mj.registry``."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

"""Robots, one file each: modules attached to modules.

Most builders have the names of their files: ``from tca_mj.robots.arm import arm``,
``from tca_mj.robots.tetrapod import tetrapod``, or ``tca_mj.arm`` and ``tca_mj.tetrapod``.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

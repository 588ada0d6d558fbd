"""Soft modules, one file each: a spec and the builder of its part.

One builder has the name of its file: ``from tca_mj.modules.continuum_leg import continuum_leg``, or
``tca_mj.continuum_leg``.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

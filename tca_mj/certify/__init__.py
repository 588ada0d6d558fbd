"""How far the chain of every module is from the theory of rods, computed anew by one command."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

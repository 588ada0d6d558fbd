"""Elastic beams and rods: rotations, static shapes, and the loads that a TCA puts on its route."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)

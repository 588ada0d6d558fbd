"""Elastic beams and rods: rotations, static shapes, and the loads that a TCA puts on its route."""

from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.rod.deadload import RodSolveError
from tca_mj.rod.shape import RodShape

__all__ = ["BeamSpec", "Outline", "RodShape", "RodSolveError"]

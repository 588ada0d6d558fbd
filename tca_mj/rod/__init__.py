"""Elastic beams and rods: rotations, static shapes, and the loads that a TCA puts on its route."""

from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.problem import Segment, StrandLaw
from tca_mj.rod.shape import RodShape
from tca_mj.rod.static import solve_series, solve_static

__all__ = [
    "BeamSpec", "Outline", "RodShape", "RodSolveError", "Segment", "StrandLaw", "solve_series",
    "solve_static",
]  # fmt: skip

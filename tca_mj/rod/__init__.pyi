from tca_mj.rod.banded import BandedRod, Thresholds
from tca_mj.rod.beam import BeamSpec, Outline, torsion_constant
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.problem import Segment, Spring, StrandLaw
from tca_mj.rod.shape import RodShape, bend
from tca_mj.rod.static import solve_series, solve_static

__all__ = [
    "BandedRod", "BeamSpec", "Outline", "RodShape", "RodSolveError", "Segment", "Spring",
    "StrandLaw", "Thresholds", "bend", "solve_series", "solve_static", "torsion_constant",
]  # fmt: skip

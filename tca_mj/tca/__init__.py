"""Physics of twisted-and-coiled actuators (TCAs): heat, tension, resistance; n at a time."""

from tca_mj.tca.bank import Pull, TcaBank, TcaMelted, TcaState
from tca_mj.tca.calibration import calibrate
from tca_mj.tca.catalogue import MODULE_TCAS
from tca_mj.tca.centreline import CONICAL, Centreline, ConicalTca
from tca_mj.tca.coilbvp import FibreShape, Stiffness, fibre_stiffness, solve_fibre
from tca_mj.tca.coilrod import CoilRods, CoilSolveError, Helix, coil_tension
from tca_mj.tca.coilsurface import CoilSurfaces
from tca_mj.tca.course import solve_course
from tca_mj.tca.creep import CreepBank, CreepSpec, CreepState
from tca_mj.tca.dynamics import LoadedTcas, MotionSolveError
from tca_mj.tca.loads import Heating, Load, LoadState
from tca_mj.tca.moduli import FibreTable, radial_growth, softened_tension, softening, untwist
from tca_mj.tca.sensing import WireTable, resistance, sensed_length
from tca_mj.tca.spec import CATALOGUE, FREE_STROKE_CREPT, FibreSpec, TcaSpec
from tca_mj.tca.statics import beyond_breaking, hanging_length, law_at, outside_fit, tension
from tca_mj.tca.surface import CalibrationError, Surface, SurfaceBound
from tca_mj.tca.thermal import (
    BodyHeat,
    HeatSpec,
    HeatStep,
    heat_lost,
    power_from_voltage,
    step_temperature,
)

__all__ = [
    "BodyHeat",
    "CATALOGUE",
    "CONICAL",
    "MODULE_TCAS",
    "CalibrationError",
    "Centreline",
    "CoilRods",
    "CoilSolveError",
    "CoilSurfaces",
    "ConicalTca",
    "CreepBank",
    "CreepSpec",
    "CreepState",
    "FREE_STROKE_CREPT",
    "FibreShape",
    "FibreSpec",
    "FibreTable",
    "HeatSpec",
    "HeatStep",
    "Heating",
    "Helix",
    "Load",
    "LoadState",
    "LoadedTcas",
    "MotionSolveError",
    "Pull",
    "Stiffness",
    "Surface",
    "SurfaceBound",
    "TcaBank",
    "TcaMelted",
    "TcaSpec",
    "TcaState",
    "WireTable",
    "beyond_breaking",
    "calibrate",
    "coil_tension",
    "fibre_stiffness",
    "hanging_length",
    "heat_lost",
    "law_at",
    "outside_fit",
    "power_from_voltage",
    "radial_growth",
    "resistance",
    "sensed_length",
    "softened_tension",
    "softening",
    "solve_course",
    "solve_fibre",
    "step_temperature",
    "tension",
    "untwist",
]

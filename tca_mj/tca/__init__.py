"""Physics of twisted-and-coiled actuators (TCAs): heat, tension, resistance; n at a time."""

from tca_mj.tca.bank import Pull, TcaBank, TcaMelted, TcaState
from tca_mj.tca.catalogue import CATALOGUE, FREE_STROKE_CREPT, MODULE_TCAS
from tca_mj.tca.dynamics.banded import solve_course
from tca_mj.tca.dynamics.loads import Heating, Load, LoadState
from tca_mj.tca.dynamics.stepping import LoadedTcas, MotionSolveError
from tca_mj.tca.fibre.boundary import FibreShape, Stiffness, fibre_stiffness, solve_fibre
from tca_mj.tca.fibre.centreline import CONICAL, Centreline, ConicalTca
from tca_mj.tca.laws.creep import CreepBank, CreepSpec, CreepState
from tca_mj.tca.laws.law import LawChoice, TensionLaw
from tca_mj.tca.laws.rod import CoilRods, CoilShape, coil_tension
from tca_mj.tca.laws.roots import CoilSolveError
from tca_mj.tca.laws.statics import hanging_length, law_at, tension
from tca_mj.tca.laws.surface import CoilSurfaces
from tca_mj.tca.laws.table import CalibrationError, Surface, SurfaceBound, calibrate
from tca_mj.tca.moduli import FibreTable, radial_growth, softened_tension, softening, untwist
from tca_mj.tca.sensing.wire import WireTable, resistance, sensed_length
from tca_mj.tca.spec import FibreSpec, TcaSpec
from tca_mj.tca.supply import Supply, Thermostat
from tca_mj.tca.thermal import (
    BodyHeat,
    HeatSpec,
    HeatStep,
    heat_lost,
    power_from_voltage,
    step_temperature,
)

__all__ = [
    "BodyHeat", "CATALOGUE", "CONICAL", "MODULE_TCAS", "CalibrationError", "Centreline",
    "CoilRods", "CoilShape", "CoilSolveError", "CoilSurfaces", "ConicalTca", "CreepBank",
    "CreepSpec", "CreepState", "FREE_STROKE_CREPT", "FibreShape", "FibreSpec", "FibreTable",
    "HeatSpec", "HeatStep", "Heating", "Load", "LoadState", "LawChoice", "LoadedTcas",
    "MotionSolveError", "Pull", "Stiffness", "Supply", "Surface", "SurfaceBound", "TcaBank",
    "TcaMelted", "TcaSpec", "TcaState", "TensionLaw", "Thermostat", "WireTable", "calibrate",
    "coil_tension", "fibre_stiffness", "hanging_length", "heat_lost", "law_at",
    "power_from_voltage", "radial_growth", "resistance", "sensed_length", "softened_tension",
    "softening", "solve_course", "solve_fibre", "step_temperature", "tension", "untwist",
]  # fmt: skip

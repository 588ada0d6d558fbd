from tca_mj.tca.bank import CreepingState, Pull, Signal, TcaBank, TcaMelted, TcaState
from tca_mj.tca.catalogue import CATALOGUE, FREE_STROKE_CREPT, MODULE_TCAS
from tca_mj.tca.dynamics.banded import solve_course
from tca_mj.tca.dynamics.loads import Course, Heating, Load, LoadState
from tca_mj.tca.dynamics.stepping import LoadedTcas, MotionSolveError
from tca_mj.tca.embedding import in_silicone, ring_conductance, silicone_body
from tca_mj.tca.fibre.boundary import FibreShape, Stiffness, fibre_stiffness, solve_fibre
from tca_mj.tca.fibre.centreline import CONICAL, Centreline, ConicalTca
from tca_mj.tca.files import TcaFile, find_tca, measured_tca, read_tca, with_tca, write_tca
from tca_mj.tca.laws.creep import (
    CreepBank,
    CreepSpec,
    CreepState,
    aged,
    hysteresis_damping,
    relaxation_time,
)
from tca_mj.tca.laws.law import LawChoice, TensionLaw
from tca_mj.tca.laws.rod import CoilRods, CoilShape, coil_tension
from tca_mj.tca.laws.roots import CoilSolveError
from tca_mj.tca.laws.statics import hanging_length, law_at, pulling_temperature, tension
from tca_mj.tca.laws.surface import CoilSurfaces
from tca_mj.tca.laws.table import CalibrationError, Surface, SurfaceBound, calibrate
from tca_mj.tca.mandrel import kept_share
from tca_mj.tca.materials import MATERIALS, Material, Source
from tca_mj.tca.moduli import FibreTable, radial_growth, softened_tension, softening, untwist
from tca_mj.tca.sensing.observer import Estimate, ObserverSpec, Sensed, TcaObserver
from tca_mj.tca.sensing.sensor import (
    CurrentSensor,
    measured,
    moving_average,
    pulse_mean,
    pulse_power,
)
from tca_mj.tca.sensing.wire import (
    DisplacementFit,
    SensingSpec,
    WireTable,
    fit_displacement,
    resistance,
    resistance_displacement,
    sensed_length,
)
from tca_mj.tca.spec import Plies, TcaSpec
from tca_mj.tca.supply import Supply, Thermostat
from tca_mj.tca.thermal import (
    BodyHeat,
    HeatSpec,
    HeatStep,
    heat_lost,
    power_from_voltage,
    step_temperature,
)
from tca_mj.tca.thread import FibreSpec, still_air_loss

__all__ = [
    "BodyHeat", "CATALOGUE", "CONICAL", "CalibrationError", "Centreline", "CoilRods", "CoilShape",
    "CoilSolveError", "CoilSurfaces", "ConicalTca", "Course", "CreepBank", "CreepSpec",
    "CreepState", "CreepingState", "CurrentSensor", "DisplacementFit", "Estimate",
    "FREE_STROKE_CREPT", "FibreShape", "FibreSpec", "FibreTable", "HeatSpec", "HeatStep", "Heating",
    "LawChoice", "Load", "LoadState", "LoadedTcas", "MATERIALS", "MODULE_TCAS", "Material",
    "MotionSolveError", "ObserverSpec", "Plies", "Pull", "Sensed", "SensingSpec", "Signal",
    "Source", "Stiffness", "Supply", "Surface", "SurfaceBound", "TcaBank", "TcaFile", "TcaMelted",
    "TcaObserver", "TcaSpec", "TcaState", "TensionLaw", "Thermostat", "WireTable", "aged",
    "calibrate", "coil_tension", "fibre_stiffness", "find_tca", "fit_displacement",
    "hanging_length", "heat_lost", "hysteresis_damping", "in_silicone", "kept_share", "law_at",
    "measured", "measured_tca", "moving_average", "power_from_voltage", "pulling_temperature",
    "pulse_mean", "pulse_power", "radial_growth", "read_tca", "relaxation_time", "resistance",
    "resistance_displacement", "ring_conductance", "sensed_length", "silicone_body",
    "softened_tension", "softening", "solve_course", "solve_fibre", "step_temperature",
    "still_air_loss", "tension", "untwist", "with_tca", "write_tca",
]  # fmt: skip

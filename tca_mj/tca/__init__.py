"""Physics of twisted-and-coiled actuators (TCAs): heat, tension, resistance; n at a time."""

from tca_mj.tca.bank import Pull, TcaBank, TcaState
from tca_mj.tca.coilrod import CoilRods, CoilSolveError, Helix, coil_tension
from tca_mj.tca.moduli import FibreTable, radial_growth, softened_tension, softening, untwist
from tca_mj.tca.sensing import WireTable, resistance, sensed_length
from tca_mj.tca.spec import CATALOGUE, FibreSpec, TcaSpec
from tca_mj.tca.thermal import HeatSpec, heat_lost, power_from_voltage, step_temperature

__all__ = [
    "CATALOGUE",
    "CoilRods",
    "CoilSolveError",
    "FibreSpec",
    "FibreTable",
    "HeatSpec",
    "Helix",
    "Pull",
    "TcaBank",
    "TcaSpec",
    "TcaState",
    "WireTable",
    "coil_tension",
    "heat_lost",
    "power_from_voltage",
    "radial_growth",
    "resistance",
    "sensed_length",
    "softened_tension",
    "softening",
    "step_temperature",
    "untwist",
]

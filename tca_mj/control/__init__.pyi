from tca_mj.control.gait import Gait
from tca_mj.control.morph import (
    ClosedLoop,
    Command,
    Measurement,
    MorphSequence,
    MorphState,
    OpenLoop,
    Phase,
)
from tca_mj.control.pi import PiSpec, PiState, pi_rest, pi_step
from tca_mj.control.servo import TcaServo, goal_temperature
from tca_mj.tca.supply import Thermostat as Thermostat

__all__ = [
    "ClosedLoop", "Command", "Gait", "Measurement", "MorphSequence", "MorphState", "OpenLoop",
    "Phase", "PiSpec", "PiState", "TcaServo", "goal_temperature", "pi_rest", "pi_step",
]  # fmt: skip

"""The scripted policy of ``TCA/MorphModule-v0``: Sun's sequence, by the TCA's own resistance."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, number
from tca_mj.control.morph import ClosedLoop, Measurement, MorphSequence, MorphState
from tca_mj.control.pi import PiSpec
from tca_mj.envs.morph import OBSERVATION, MorphModule
from tca_mj.modules.morphing import MorphingSpec
from tca_mj.smp.lumped import LumpedModule
from tca_mj.tca.sensing.wire import DisplacementFit, fit_displacement

# Gains of the angle's controller, tuned on the module, hanging and weightless. Far away a large
# gain and little integral, or it would overshoot; within 10°, for good, a gain that keeps away from
# the 2 Hz at which the soft module swings, and an integral that follows the tube as it warms.
GAINS = PiSpec(
    proportional=40.0, integral=5.0, near=math.radians(10.0), near_proportional=12.0,
    near_integral=20.0, highest=MorphModule.max_power,
)  # fmt: skip
# Over the fading time that the tube is said to have: a power that falls too fast relaxes the TCA by
# some tenths of a degree, one that falls too slowly damages it. Estimate: tubes are known to 20 %.
FADING = 1.3


def calibrate(spec: MorphingSpec, largest: float = math.radians(260.0)) -> DisplacementFit:
    """Third-order polynomial from the TCA's resistance to the angle, fitted to the model.

    Sun, Section 6.2.2, fits it to measurements.

    Args:
        spec: The module.
        largest: Largest angle of the fit [rad].
    """
    module = _lumped(spec)
    angles, cold = np.linspace(0.0, largest, 27), module.bank.rest()
    lengths = [module.tca_length(np.full(1, angle)) for angle in angles]
    ohms = [float(module.bank.resistance(cold, length)[0]) for length in lengths]
    return fit_displacement(ohms, angles)


def _lumped(spec: MorphingSpec) -> LumpedModule:
    """The same module with one angle."""
    return LumpedModule(spec.spine, spec.heater, spec.sheathed)


@dataclass
class MorphPolicy(Checked):
    """Soften, morph, hold, harden, release: an observation in, an action out.

    It looks at the thermistor, the TCA's resistance and the commanded angle, and at nothing else
    of the observation.

    Attributes:
        module_spec: The module it was told that it has.
        gains: PI gains from the error of the angle [rad] to the TCA's power [W].
        sequence: The phases.
        progress: Where it stands; None before the first observation.
    """

    module_spec: MorphingSpec = field(default_factory=MorphingSpec)
    gains: PiSpec = field(default_factory=lambda: GAINS)
    progress: MorphState | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self._fit = calibrate(self.module_spec)
        self.sequence = MorphSequence(
            drive=ClosedLoop(pi=self.gains, angle_of=self.angle_of),
            fading_time=FADING * _lumped(self.module_spec).fading_time,
        )

    def angle_of(self, resistance: float) -> float:
        """Angle [rad] that a resistance [ohm] tells."""
        return float(self._fit.displacement(number("resistance", resistance)))

    @property
    def phase(self) -> str:
        """Name of the present phase."""
        return "" if self.progress is None else self.progress.phase.value

    def reset(self) -> None:
        """Starts anew."""
        self.progress = None

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (3,)."""
        rows = OBSERVATION.read(observation.astype(np.float64))
        if self.progress is None:
            self.progress = self.sequence.start(float(rows["commanded angle"][0]))
        seen = Measurement(float(rows["spine temperature"][0]), float(rows["TCA resistance"][0]))
        self.progress, command = self.sequence.step(self.progress, seen, MorphModule.control_period)
        heater = 2.0 * command.heater_voltage / MorphModule.max_voltage - 1.0
        tca = 2.0 * command.tca_power / MorphModule.max_power - 1.0
        return np.array([heater, tca, 1.0 if command.fan else -1.0], dtype=np.float32)


def scripted(task: Any) -> MorphPolicy:
    """The scripted policy of a ``MorphModule``."""
    return MorphPolicy(task.module_spec)

"""The scripted policy of ``TCA/FingerSense-v0``: Sun's trigger and PI controller (Section 4.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array, Checked, NotNegative, Positive, Seed, door, number
from tca_mj.control.pi import PiSpec, pi_rest, pi_step
from tca_mj.envs.finger import FILTER, NOISE, OBSERVATION, PERIOD, FingerSense, SensedFinger
from tca_mj.modules.innervated import PAIR, InnervatedFingerSpec, Volts
from tca_mj.tca.sensing.wire import DisplacementFit, fit_displacement

SUPPLY = 5.0  # of the pair; Sun, Section 4.2.1, for the run of the fit: the only one printed [V]
TRIGGER = 0.2  # fall of the resistance that is a touch; Sun, Section 4.2.2 [ohm]
# Output (K_P times degrees) at which the voltage is on all the time, and the time of a sample: as
# in ``tca_mj.validation.lifting``, of the same board.
FULL, SAMPLE = 255.0, 0.01
GAINS = PiSpec(  # Sun, Section 4.2.2: 20, then 3 within 1°; 0.08 per sample
    proportional=20.0, integral=0.08 / SAMPLE, near=1.0, near_proportional=3.0, highest=FULL
)
_LARGEST = math.radians(100.0)  # where the run of the fit ends, before the TCAs get too hot [rad]
_LONGEST = 10.0  # when it ends at the latest [s]
_BEFORE = 25  # readings whose mean is the resistance at rest


class Run(NamedTuple):
    """The finger bent by a constant voltage.

    Attributes:
        resistance: Readings, a centred mean of ``FILTER`` of them, shape (k,) [ohm].
        angle: Angles, shape (k,) [rad].
        temperature: Of the pair in the end [°C].
    """

    resistance: Array
    angle: Array
    temperature: float


@door
def bending_run(
    spec: InnervatedFingerSpec | None = None, *, noise: NotNegative = NOISE, seed: Seed = 0
) -> Run:
    """Bends a finger by ``SUPPLY`` to 100°, as for the fit of Sun, Section 4.2.1.

    Args:
        spec: The finger.
        noise: Standard deviation of a reading [ohm].
        seed: Of the noise.

    Raises:
        ValueError: If the finger cannot be built.
    """
    finger, rng = SensedFinger(spec), np.random.default_rng(seed)
    power = np.zeros(finger.sim.n)
    ohms: list[float] = []
    angles: list[float] = []
    while finger.angle < _LARGEST and finger.sim.time < _LONGEST:
        power[:PAIR] = finger.spec.heating(SUPPLY, finger.resistance)
        finger.sim.step(power, PERIOD)
        ohms.append(finger.resistance + noise * float(rng.standard_normal()))
        angles.append(finger.angle)
    # After the run, so that the mean is no late one.
    mean = np.convolve(ohms, np.full(FILTER, 1.0 / FILTER), mode="valid")
    first = FILTER // 2
    middle = np.array(angles[first : first + mean.size])
    return Run(mean, middle, float(finger.sim.temperature[0]))


def calibrate(spec: InnervatedFingerSpec) -> DisplacementFit:
    """Third-order polynomial from the resistance of a finger [ohm] to its angle [rad]."""
    run = bending_run(spec)
    return fit_displacement(run.resistance, run.angle)


@dataclass
class FingerPolicy(Checked):
    """Watch the resistance, and once it has fallen bend and hold: observation in, action out.

    It looks at the filtered resistance and the commanded angle, and at nothing else.

    Attributes:
        finger_spec: The finger it was told that it has.
        gains: PI gains from the error of the angle [deg] to the output, which is ``FULL`` where the
            voltage is on all the time.
        trigger: Fall of the resistance that is a touch [ohm].
        voltage: Voltage of the pulses [V].
        max_power: Power of each TCA at an action of 1 [W].
    """

    finger_spec: InnervatedFingerSpec = field(default_factory=InnervatedFingerSpec)
    gains: PiSpec = field(default_factory=lambda: GAINS)
    trigger: Positive = TRIGGER
    voltage: Volts = SUPPLY
    max_power: Positive = float(FingerSense.max_power[0])

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        self._fit = calibrate(self.finger_spec)
        self.reset()

    def reset(self) -> None:
        """Starts anew."""
        self._seen: list[float] = []
        self._control = pi_rest()
        self.phase = "watch"

    def angle_of(self, resistance: float) -> float:
        """Angle [rad] that a resistance [ohm] tells."""
        return float(self._fit.displacement(number("resistance", resistance)))

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period, shape (1,)."""
        rows = OBSERVATION.read(observation.astype(np.float64))
        ohms, power = float(rows["resistance"][0]), 0.0
        if self.phase == "watch":
            self._seen = [*self._seen, ohms][:_BEFORE]
            if ohms < np.mean(self._seen) - self.trigger:
                self.phase = "bend"
        if self.phase != "watch":
            error = float(rows["commanded angle"][0]) - self.angle_of(ohms)
            self._control, output = pi_step(
                self.gains, self._control, math.degrees(error), PERIOD
            )
            self.phase = "hold" if self._control.arrived else "bend"
            power = self.finger_spec.heating(self.voltage, ohms, float(output) / FULL)
        return np.array([min(2.0 * power / self.max_power - 1.0, 1.0)], dtype=np.float32)


def scripted(task: Any) -> FingerPolicy:
    """The scripted policy of a ``FingerSense``."""
    return FingerPolicy(task.finger_spec)

"""What a real circuit measures of a TCA's resistance: noise, resolution and pulsed heating."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import (
    Array,
    Checked,
    NotNegative,
    Numbers,
    Positive,
    door,
    number,
    whole,
    within,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class CurrentSensor(Checked):
    """What measures a TCA's resistance: its mean current under a pulsed voltage.

    Attributes:
        resolution: Step of the current, Sun, Section 2.3.1: INA 219 [A].
        gain_error: Relative error of the current that is the same in all measurements of one
            sensor, there up to 0.01; 0 is a calibrated one.
        noise: Standard deviation of a mean current, fitted to a root mean squared error of
            0.22 mm of D(R) at 20 g and 12 V (Sun, Section 2.3.2) [A].
        pulse_frequency: Of the pulsed voltage, Sun, Section 2.3.2 [Hz].
    """

    resolution: NotNegative = 0.8e-3
    gain_error: Annotated[float, partial(number, above=-1.0, below=1.0)] = 0.0
    noise: NotNegative = 1.3e-3
    pulse_frequency: Positive = 4e3


@door
def measured(
    resistance: ArrayLike,
    voltage: ArrayLike,
    rng: np.random.Generator,
    sensor: CurrentSensor | None = None,
    *,
    duty: ArrayLike = 1.0,
    window: float | None = None,
) -> Array:
    """Resistance as a sensor reports it: mean voltage over the measured mean current.

    Args:
        resistance: True resistance, shape (..., n) [ohm].
        voltage: Voltage of the pulses, above 0, broadcast with it; 0.8 V where only sensing [V].
        rng: Source of the noise, one number per resistance.
        sensor: The sensor.
        duty: Share of the time that the voltage is on, above 0 to 1, broadcast with it.
        window: Time over which the current is averaged, starting with a pulse. The voltage is
            not measured: its mean is taken as duty times voltage, which a window that cuts a pulse
            off violates. None is a whole number of pulses [s].

    Returns:
        Measured resistance, the broadcast shape [ohm].

    Raises:
        ValueError: If an argument is out of range, or a mean current is not above 10 steps of the
            sensor and 10 standard deviations of its noise: too small to divide by.
    """
    sensor = sensor or CurrentSensor()
    resistance = within("resistance", resistance, above=0.0, unit="ohm")
    voltage = within("voltage", voltage, above=0.0, unit="V")
    share = duty = within("duty", duty, above=0.0, at_most=1.0)
    if window is not None:
        share = pulse_mean(duty, within("window", window, above=0.0) * sensor.pulse_frequency)
    least = 10.0 * max(sensor.resolution, sensor.noise)
    current = within("mean current", share * voltage / resistance, above=least, unit="A")
    noise = sensor.noise * rng.standard_normal(current.shape)
    current = (1.0 + sensor.gain_error) * current + noise
    if sensor.resolution > 0.0:
        current = sensor.resolution * np.round(current / sensor.resolution)
    return duty * voltage / current


@door
def pulse_mean(duty: ArrayLike, periods: ArrayLike, phase: ArrayLike = 0.0) -> Array:
    """Share of a window in which a pulsed voltage is on, exactly.

    It is on during the first ``duty`` of every period. Over p periods the share differs from
    ``duty`` by at most duty (1 - duty)/p, and not at all if p is whole.

    Args:
        duty: Share of a period that it is on, 0 to 1.
        periods: Length of the window, above 0, broadcast with it [periods].
        phase: Start of the window, broadcast with it [periods].

    Returns:
        Share, the broadcast shape [1].

    Raises:
        ValueError: If an argument is out of range or not finite.
    """
    duty = within("duty", duty, at_least=0.0, at_most=1.0)
    periods, phase = within("periods", periods, above=0.0), within("phase", phase)

    def on_until(time: Array) -> Array:
        whole = np.floor(time)
        return whole * duty + np.minimum(time - whole, duty)

    return (on_until(phase + periods) - on_until(phase)) / periods


@door
def pulse_power(voltage: ArrayLike, duty: ArrayLike, resistance: ArrayLike) -> Array:
    """Mean power of a pulsed voltage, duty V^2/R and not (duty V)^2/R, broadcast [W].

    Args:
        voltage: Voltage of the pulses [V].
        duty: Share of the time that it is on, 0 to 1 [1].
        resistance: Resistance, above 0 [ohm].

    Raises:
        ValueError: If ``duty`` is not 0 to 1, a voltage is not finite, or a resistance not above 0.
    """
    voltage, duty = within("voltage", voltage), within("duty", duty, at_least=0.0, at_most=1.0)
    return duty * voltage * voltage / within("resistance", resistance, above=0.0, unit="ohm")


@door
def moving_average(
    values: Numbers, count: Annotated[int, partial(whole, at_least=1, at_most=10**9)],
    start: ArrayLike | None = None,
) -> Array:  # fmt: skip
    """Modified moving average over axis 0, the filter of Sun, Section 2.3.2.

    y += (x - y)/count: white noise leaves with 1/sqrt(2 count - 1) of its deviation, a step
    arrives after some ``count`` samples.

    Args:
        values: Samples, shape (k, ...) [any unit].
        count: Number of samples it stands for, 1 to a thousand million.
        start: Average before the first sample [the same unit]; None is the first sample itself.

    Returns:
        Averages, same shape [the same unit].

    Raises:
        ValueError: If ``count`` is out of range, there is no axis, a sample is not finite, or
            ``start`` has another shape than one.
    """
    values = within("values", values)
    if values.ndim == 0:
        raise ValueError(f"values must have an axis of samples, got {values}")
    averages = np.empty_like(values)
    average = values[:1].sum(axis=0) if start is None else within("start", start)
    if average.shape not in ((), values.shape[1:]):
        raise ValueError(f"start must have the shape {values.shape[1:]}, got {average.shape}")
    for i, value in enumerate(values):
        average = average + (value - average) / count
        averages[i] = average
    return averages

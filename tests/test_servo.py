"""Position, force and impedance by an observer, on a TCA whose figures it does not all know."""

import numpy as np
import pytest

from tca_mj.control import TcaServo, goal_temperature
from tca_mj.tca import (
    CATALOGUE,
    MODULE_TCAS,
    CoilSurfaces,
    Estimate,
    Heating,
    Load,
    LoadedTcas,
    ObserverSpec,
    TcaBank,
    TcaObserver,
    Thermostat,
    hysteresis_damping,
    pulling_temperature,
)
from tca_mj.tca.laws.creep import CreepSpec

SENSING = MODULE_TCAS["sensing"]
WEIGHT = 0.02 * 9.81  # [N]
DT = 0.04


@pytest.fixture(scope="module")
def servo():
    bank = TcaBank([SENSING], law="surface")
    thermostat = Thermostat(heat=bank.heat, max_power=15.0, response=0.2, max_temperature=160.0)
    return TcaServo(TcaObserver(bank, ObserverSpec(tension_rate=0.05)), thermostat)


def run(servo, power_of, *, load, seconds=8.0, losses=(1.0,), motion="quasistatic"):
    """Lengths, tensions, times of TCAs that lose more or less heat than is believed; 2 mohm noise.

    Args:
        power_of: From an estimate and the time to a power.
        load: From the time to a load.
    """
    tcas = LoadedTcas([SENSING], load(0.0), law=CoilSurfaces([SENSING]).tension)
    rng, air = np.random.default_rng(0), np.array(losses)[:, None]
    state = tcas.rest((air.size,))

    def reading():
        return tcas.resistance(state) + 2e-3 * rng.standard_normal(state.length.shape)

    estimate, rows = servo.observer.begin(reading()), []
    for k in range(round(seconds / DT)):
        power = power_of(estimate, k * DT)
        tcas.load = load(k * DT)
        state = tcas.step(state, Heating(value=power, air=air), DT, motion)
        estimate = servo.observer.corrected(
            servo.observer.predicted(estimate, power, DT), reading()
        )
        rows.append((state.length[:, 0], tcas.tension(state)[:, 0]))
    length, tension = np.array(rows).swapaxes(0, 1)
    return length, tension, DT * np.arange(1, len(length) + 1)


def test_a_goal_is_the_temperature_of_brents_method():
    tca = CATALOGUE["free-stroke"]
    bank = TcaBank([tca, tca])
    lengths = np.array([[0.9, 1.0], [1.1, 1.2]]) * tca.rest_length
    pull = np.array([[0.05, 0.1], [0.2, 0.35]])
    goal = goal_temperature(bank, lengths, pull, 160.0)
    for at, tension, temperature in zip(lengths.flat, pull.flat, goal.flat, strict=True):
        assert temperature == pytest.approx(pulling_temperature(tca, at, tension), abs=2e-4)
    assert goal_temperature(bank, tca.rest_length + np.zeros(2), [-1.0, 9.0], 160.0) == (
        pytest.approx([25.0, 160.0], abs=2e-4)
    )


def test_a_wrong_heat_loss_leaves_no_error_of_position_but_one_of_force(servo):
    """The estimates lie on the law: l is right because R tells it, F is as wrong as T is."""
    losses = (0.8, 1.0, 1.2)
    goal = SENSING.rest_length - 0.015
    length, _, _ = run(servo, lambda e, t: servo.position(e, goal), losses=losses,
                       load=lambda t: Load.weight(0.02))  # fmt: skip
    assert length[-25:].mean(axis=0) == pytest.approx(3 * [goal], abs=0.3e-3)
    spring = Load.spring(20.0, 0.1, SENSING.rest_length)
    _, tension, _ = run(servo, lambda e, t: servo.force(e, WEIGHT), losses=losses,
                        load=lambda t: spring)  # fmt: skip
    less, nominal, more = tension[-25:].mean(axis=0)
    assert nominal == pytest.approx(WEIGHT, rel=0.02)
    assert less > 1.02 * WEIGHT and more < 0.98 * WEIGHT


def test_a_length_is_held_while_the_load_varies_by_half(servo):
    goal = SENSING.rest_length - 0.015

    def load(time):
        return Load(force=WEIGHT * (1.0 + 0.5 * np.sin(2.0 * np.pi * 0.1 * time)))

    length, _, time = run(servo, lambda e, t: servo.position(e, goal), load=load, seconds=14.0)
    off = np.abs(length - goal)[time > 4.0]
    loose = 0.5 * WEIGHT / 14.0  # what the coil's own stiffness would let it move by [m]
    assert off.max() < 0.2 * loose


@pytest.mark.parametrize("stiffness", [7.0, 28.0])
def test_a_tca_becomes_a_spring_of_the_stiffness_that_is_wanted(servo, stiffness):
    """Loads that rise slowly stretch it by that, half or twice as stiff as the coil itself."""
    middle = SENSING.rest_length
    for share in (0.8, 1.2):
        length, tension, _ = run(
            servo, lambda e, t: servo.impedance(e, WEIGHT, stiffness, middle),
            load=lambda t, share=share: Load(force=share * WEIGHT), seconds=10.0,
        )  # fmt: skip
        wanted = middle + (share - 1.0) * WEIGHT / stiffness
        assert length[-50:].mean() == pytest.approx(wanted, abs=0.4e-3), share


def test_a_stroke_that_lags_is_made_up_for_without_being_known(servo):
    """Up and down the same course, a stroke with friction differs by its loop: hysteresis."""
    middle, swing, speed = SENSING.rest_length - 0.005, 0.006, 2.0 * np.pi * 0.1
    damping = 8.0 * hysteresis_damping(SENSING, CreepSpec())  # so large that it is seen

    def width(power_of):
        length, _, time = run(
            servo, power_of, load=lambda t: Load.weight(0.02, damping), seconds=20.0,
            motion="dynamic",
        )  # fmt: skip
        late = time > 10.0
        wave = np.exp(1j * speed * time[late])
        return abs(np.imag(np.vdot(wave, length[late, 0] - middle)) * 2.0 / late.sum())

    def open_loop(_, time):
        goal = middle - swing * np.cos(speed * time)
        heat = servo.observer.bank.heat
        warm = goal_temperature(servo.observer.bank, np.array([goal]), WEIGHT, 160.0)
        return np.maximum(heat.loss * (warm - heat.ambient), 0.0)

    def closed(estimate, time):
        return servo.position(estimate, middle - swing * np.cos(speed * time),
                              swing * speed * np.sin(speed * time))  # fmt: skip

    assert width(closed) < 0.35 * width(open_loop)


def test_the_thermostat_is_told_how_much_heat_is_lost(servo):
    """At its goal a TCA gets what keeps it there: the nominal loss over r."""
    warm, heat = np.array([80.0]), servo.observer.bank.heat
    length = servo.observer.under_load(warm, np.array([WEIGHT]))
    for ratio in (1.0, 0.5, 1.25):
        mean = np.stack([warm, [25.0], length, [ratio]])
        power = servo.position(Estimate(mean, np.zeros((4, 4, 1))), length)
        assert power == pytest.approx(heat.loss * 55.0 / ratio, rel=1e-3)


def test_what_a_servo_cannot_be_told(servo):
    estimate = servo.observer.begin([7.3])
    with pytest.raises(ValueError, match="length must be finite"):
        servo.position(estimate, np.nan)
    with pytest.raises(ValueError, match="stiffness must be finite"):
        servo.impedance(estimate, 0.1, np.inf, 0.1)
    assert servo.force(estimate, 0.0) == pytest.approx([0.0], abs=1e-4)  # off

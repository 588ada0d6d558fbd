"""The morphing sequence: phases, goals, no damage, every way out leaves everything off."""

import math
import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tca_mj.control.morph import (
    OFF,
    ClosedLoop,
    Command,
    Measurement,
    MorphSequence,
    MorphState,
    OpenLoop,
    Phase,
)
from tca_mj.control.pi import PiSpec
from tca_mj.smp import HeaterSpec, SpineSpec
from tca_mj.smp.lumped import LumpedModule, sheathed
from tca_mj.tca import CATALOGUE
from tca_mj.tca.sensing.wire import fit_displacement

SPINE = SpineSpec()
TCA = sheathed(CATALOGUE["free-stroke"], SPINE)
MODULE = LumpedModule(SPINE, HeaterSpec.fitted(SPINE), TCA)
PI = PiSpec(proportional=25.0, integral=25.0, highest=40.0)
NORMAL = [Phase.SOFTEN, Phase.MORPH, Phase.HOLD, Phase.HARDEN, Phase.RELEASE, Phase.DONE]


@cache
def calibration():
    """Angle over resistance, third order, fitted as in Sun, Section 6.2.2."""
    angles = np.radians(np.linspace(0.0, 260.0, 27))
    cold = MODULE.bank.rest()
    ohms = [MODULE.bank.resistance(cold, MODULE.tca_length(np.full(1, a)))[0] for a in angles]
    return fit_displacement(ohms, angles)


def closed(release_time=20.0, **changes):
    drive = ClosedLoop(pi=PI, angle_of=lambda ohm: float(calibration().displacement(ohm)))
    changes = {"fading_time": MODULE.fading_time} | changes
    return MorphSequence(drive=drive, release_time=release_time, **changes)


def play(sequence, target, module=MODULE, state=None, dt=0.1, noise=0.0, longest=600.0):
    """Runs a sequence on a module; returns the module, the sequence and a log."""
    state = state or module.rest()
    progress, log, time = sequence.start(target), [], 0.0
    rng = np.random.default_rng(2)
    while not progress.over and time < longest:
        ohm = module.resistance(state) * (1.0 + noise * rng.standard_normal())
        seen = Measurement(float(state.heater.temperature[0]), ohm)
        progress, command = sequence.step(progress, seen, dt)
        state, time = module.step(state, *command, dt), time + dt
        log.append((time, progress.phase, state, command))
    return state, progress, log


def phases(log):
    found = [log[0][1]]
    for _, phase, _, _ in log:
        if phase is not found[-1]:
            found.append(phase)
    return found


def degrees(state):
    return math.degrees(state.angle[0])


def harmed(log):
    return any(state.damage.damaged[0] for _, _, state, _ in log)


@pytest.mark.parametrize("goal", [60.0, 120.0, 180.0, 240.0])
def test_a_closed_loop_reaches_and_fixes_an_angle(goal):
    """Sun, Section 6.2.2: within 3 s, then steady; fixed within 3° and without damage."""
    state, progress, log = play(closed(), math.radians(goal))
    assert phases(log) == NORMAL and progress.phase is Phase.DONE
    assert degrees(state) == pytest.approx(goal, abs=3.0)
    begin = next(time for time, phase, _, _ in log if phase is Phase.MORPH)
    active = (Phase.MORPH, Phase.HOLD, Phase.HARDEN)
    late = [t for t, phase, s, _ in log if phase in active and abs(degrees(s) - goal) > 3.0]
    assert max(late) - begin < 3.0
    assert not harmed(log)
    assert max(state.tca.temperature[0] for _, _, state, _ in log) < 180.0


def test_voltages_fan_and_power_in_each_phase():
    _, _, log = play(closed(), math.pi)
    commands = {phase: [c for _, p, _, c in log if p is phase] for phase in Phase}
    assert all(c == Command(25.0, 0.0, False) for c in commands[Phase.SOFTEN])
    for phase in (Phase.MORPH, Phase.HOLD):
        assert all(c.heater_voltage == 9.5 and not c.fan for c in commands[phase])
    assert all(c.heater_voltage == 0.0 and c.fan for c in commands[Phase.HARDEN])
    assert all(c == OFF for c in commands[Phase.RELEASE])
    # Stiff: nothing is sensed any more, and the power goes on holding the TCA's temperature.
    stiff = [
        (c.tca_power, s.tca.temperature[0], MODULE.bank.heat.keeping(*heat(s))[0])
        for _, p, s, c in log
        if p is Phase.HARDEN and s.heater.temperature[0] < 108.0
    ]
    powers, temperatures, keeping = map(np.array, zip(*stiff, strict=True))
    assert np.ptp(temperatures) < 0.2
    assert powers == pytest.approx(keeping, rel=0.02)
    assert powers[-1] < 0.8 * powers[0]  # as the tube warms


def heat(state):
    return state.tca.temperature, state.tca.body


def test_power_that_stayed_would_contract_the_tca():
    """The tube warms on while the spine hardens: without ``fading_time`` that is damage."""
    assert harmed(play(closed(fading_time=0.0), math.pi)[2])


@pytest.mark.parametrize("settled", [2.0, 5.0])
@pytest.mark.parametrize("dt", [0.05, 0.2])
def test_the_power_goes_on_falling_as_it_fell(settled, dt):
    """P = a + b exp(-t/τ) until the spine hardens, and from there on, unseen; it never rises.

    Within 1 %: of how the means began (1 + n) exp(-n) is left, n = hold_time/average_time.
    """
    tau, volts = 10.0, 10.0
    for falling in (6.0, 0.0, -1.0):
        sequence = MorphSequence(drive=OpenLoop(voltage=volts, settle_time=1.0), fading_time=tau)
        state, time, last = at(Phase.MORPH), 0.0, None
        while state.phase is not Phase.RELEASE:
            power = settled + falling * math.exp(-time / tau)
            hardened = state.phase is Phase.HARDEN and state.elapsed > 1.0
            spine = SOFT if not hardened else 79.0 if state.elapsed > 9.0 else 100.0
            state, command = sequence.step(state, Measurement(spine, volts**2 / power), dt)
            if hardened and state.phase is Phase.HARDEN:
                if falling >= 0.0:
                    assert command.tca_power == pytest.approx(power, rel=1e-2)
                else:
                    assert command.tca_power < power
                    assert last is None or command.tca_power == last
                last = command.tca_power
            time += dt
        assert last is not None


def test_recovery_needs_no_tca_and_the_released_shape_no_power():
    """With the release as it is by default: the TCA must have cooled, or it would pull again."""
    bent, _, _ = play(closed(release_time=180.0), math.pi)
    assert bent.tca.temperature[0] < 28.0
    later = MODULE.step(bent, 0.0, 0.0, False, 600.0)
    assert degrees(later) == pytest.approx(degrees(bent), abs=0.1)
    flat, progress, log = play(closed(), None, state=bent)
    assert phases(log) == [p for p in NORMAL if p is not Phase.MORPH]
    assert progress.phase is Phase.DONE
    assert abs(degrees(flat)) < 3.0
    assert all(command.tca_power == 0.0 for _, _, _, command in log)


def test_shape_after_shape():
    """90°, then a U, then 90° again: each from the last one, nothing accumulates."""
    state = None
    for goal in (90.0, 200.0, 90.0):
        state, _, log = play(closed(), math.radians(goal), state=state)
        assert degrees(state) == pytest.approx(goal, abs=3.0)
        assert not harmed(log)


@pytest.mark.parametrize("loss", [0.8, 1.2])
@pytest.mark.parametrize("ambient", [15.0, 35.0])
def test_other_rooms_and_losses_do_no_damage(loss, ambient):
    """At a loss 20 % higher 9.5 V hold 104 °C, which is stiff: the heater must notice."""
    heater = replace(MODULE.heater, loss=loss * MODULE.heater.loss, ambient=ambient)
    module = LumpedModule(SPINE, heater, replace(TCA, ambient=ambient))
    state, progress, log = play(closed(), math.pi, module, noise=2e-5)
    assert progress.phase is Phase.DONE and phases(log) == NORMAL
    assert degrees(state) == pytest.approx(180.0, abs=4.0)
    assert not harmed(log)
    soft = [s.heater.temperature[0] for _, p, s, _ in log if p in (Phase.MORPH, Phase.HOLD)]
    assert min(soft) > 110.0 and max(soft) < 150.0


def test_an_open_loop_is_slow_and_fixes_what_its_voltage_gives():
    """The same angle by a constant voltage: steady only after a multiple of the 3 s."""
    _, _, log = play(closed(), math.pi)
    bent = next(s for _, p, s, _ in reversed(log) if p is Phase.HARDEN)
    power = MODULE.bank.steady(bent.tca.temperature)[1][0]
    voltage = math.sqrt(power * MODULE.resistance(bent))
    sequence = MorphSequence(drive=OpenLoop(voltage=voltage), release_time=20.0)
    state, progress, log = play(sequence, math.pi, dt=0.1)
    assert progress.phase is Phase.DONE and not harmed(log)
    assert degrees(state) == pytest.approx(180.0, abs=3.0)
    morph = [(t, degrees(s)) for t, p, s, _ in log if p is Phase.MORPH]
    steady = next(t for (t, a), (_, b) in zip(morph, morph[200:], strict=False) if b - a < 3.0)
    assert steady - morph[0][0] > 6.0
    assert phases(log) == NORMAL


def test_the_course_hardly_depends_on_the_step():
    coarse, fine = (play(closed(), 2.0, dt=dt)[0] for dt in (0.2, 0.05))
    assert degrees(coarse) == pytest.approx(degrees(fine), abs=1.0)


# --- ways out

SOFT, ANGLE_0 = 116.5, 15.41  # a soft spine, and about the resistance when straight
TO = math.pi


def at(phase, **changes):
    return MorphState(phase, TO, **changes)


@pytest.mark.parametrize("phase", [Phase.SOFTEN, Phase.MORPH, Phase.HOLD, Phase.HARDEN])
@pytest.mark.parametrize(
    ("seen", "fault"),
    [
        (Measurement(math.nan, ANGLE_0), "temperature reads nan"),
        (Measurement(115.0, math.nan), "resistance reads nan"),
        (Measurement(115.0, 0.0), "resistance reads 0"),
        (Measurement(161.0, ANGLE_0), "spine is at 161"),
    ],
)
def test_impossible_measurements_switch_everything_off(phase, seen, fault):
    state, command = closed().step(at(phase), seen, 0.1)
    assert command == OFF and state.phase is Phase.FAULT and fault in state.fault
    again, command = closed().step(state, Measurement(115.0, ANGLE_0), 0.1)
    assert again is state and command == OFF and state.over


@pytest.mark.parametrize(
    ("phase", "seen", "limit"),
    [
        (Phase.SOFTEN, Measurement(60.0, ANGLE_0), 15.0),  # the thermistor has come off
        (Phase.MORPH, Measurement(SOFT, ANGLE_0), 60.0),  # the TCA is torn
        (Phase.HOLD, Measurement(SOFT, ANGLE_0), 60.0),
        (Phase.HARDEN, Measurement(90.0, ANGLE_0), 120.0),  # the air is too hot
    ],
)
def test_nothing_goes_on_for_ever(phase, seen, limit):
    sequence, state, time = closed(), at(phase), 0.0
    while not state.over:
        state, command = sequence.step(state, seen, 0.5)
        time += 0.5
        assert time < limit + 2.0
    assert time > limit and command == OFF and f"{phase} did not end" in state.fault


def test_a_lost_thermistor_cannot_burn_the_spine():
    """Reading 25 °C for ever, the heater stops below 250 °C."""
    progress, spine = closed().start(TO), MODULE.rest()
    while not progress.over:
        progress, command = closed().step(progress, Measurement(25.0, ANGLE_0), 0.1)
        spine = MODULE.step(spine, *command, 0.1)
    assert progress.phase is Phase.FAULT
    assert spine.heater.temperature[0] < 250.0


@pytest.mark.parametrize("phase", [Phase.SOFTEN, Phase.MORPH, Phase.HOLD, Phase.HARDEN])
def test_abort_switches_off_at_once_and_a_restart_works(phase):
    sequence = closed(release_time=5.0)
    state = sequence.abort(at(phase))
    for _ in range(100):
        state, command = sequence.step(state, Measurement(math.nan, math.nan), 0.1)
        assert command == OFF
    assert state.phase is Phase.DONE
    state, command = sequence.step(sequence.start(1.0), Measurement(SOFT, ANGLE_0), 0.1)
    assert state.phase is Phase.MORPH and command.tca_power > 0.0
    done = MorphState(Phase.DONE)
    assert sequence.abort(done) is done


def test_a_spine_that_grows_stiff_stops_the_tca():
    """Below 110 °C the TCA is off and the spine is heated again, from the start."""
    for phase in (Phase.MORPH, Phase.HOLD):
        state, command = closed().step(at(phase, elapsed=3.0), Measurement(109.0, ANGLE_0), 0.1)
        assert state.phase is Phase.SOFTEN and command == Command(25.0, 0.0, False)


def test_the_heater_boosts_with_hysteresis():
    state, volts = at(Phase.MORPH), []
    for temperature in (116.0, 113.5, 112.9, 114.0, 115.9, 116.1, 114.0):
        state, command = closed().step(state, Measurement(temperature, ANGLE_0), 0.1)
        volts.append(command.heater_voltage)
    assert volts == [9.5, 9.5, 25.0, 25.0, 25.0, 9.5, 9.5]


def test_holding_counts_only_unbroken_time():
    target = calibration().displacement(ANGLE_0)
    good, bad = Measurement(SOFT, ANGLE_0), Measurement(SOFT, ANGLE_0 * 1.01)
    sequence, state = closed(), MorphState(Phase.HOLD, float(target))
    for seen, steps, steady in ((good, 50, 5.0), (bad, 1, 0.0), (good, 99, 9.9)):
        for _ in range(steps):
            state, _ = sequence.step(state, seen, 0.1)
        assert state.steady == pytest.approx(steady) and state.phase is Phase.HOLD
    for phase in (Phase.HOLD, Phase.HARDEN):
        state, _ = sequence.step(state, good, 0.1)
        assert state.phase is phase


def test_the_state_is_a_value():
    """A step changes nothing that it was given, and a state can be stored and continued."""
    sequence, seen = closed(), Measurement(SOFT, ANGLE_0)
    state = at(Phase.MORPH)
    first, again = sequence.step(state, seen, 0.1), sequence.step(state, seen, 0.1)
    assert first[1] == again[1] and state.elapsed == 0.0
    stored = pickle.loads(pickle.dumps(first[0]))
    assert sequence.step(stored, seen, 0.1)[1] == sequence.step(first[0], seen, 0.1)[1]


@pytest.mark.parametrize(
    ("field", "value"),
    [("heat_voltage", 9.0), ("hold_voltage", -1.0), ("rigid_temperature", 115.0),
     ("highest_temperature", 112.0), ("hold_limit", 5.0), ("margin", 0.0),
     ("soften_limit", math.inf), ("average_time", math.nan), ("fading_time", -1.0)],
)  # fmt: skip
def test_a_sequence_checks_itself(field, value):
    with pytest.raises(ValueError, match=field.replace("heat_voltage", "voltage")):
        closed(**{field: value})


def test_drives_targets_and_steps_check_themselves():
    with pytest.raises(ValueError, match="voltage"):
        OpenLoop(voltage=0.0)
    with pytest.raises(ValueError, match="highest power"):
        ClosedLoop(pi=replace(PI, highest=math.inf), angle_of=float)
    with pytest.raises(ValueError, match="lowest power"):
        ClosedLoop(pi=replace(PI, lowest=-1.0), angle_of=float)
    with pytest.raises(ValueError, match="target"):
        closed().start(math.nan)
    with pytest.raises(ValueError, match="dt"):
        closed().step(closed().start(0.0), Measurement(25.0, 15.0), 0.0)

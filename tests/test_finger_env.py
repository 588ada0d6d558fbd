"""``TCA/FingerSense-v0``, the finger that it is about, and its scripted policy."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tca_mj.agents.scripts.finger import (
    FULL,
    GAINS,
    SUPPLY,
    TRIGGER,
    FingerPolicy,
    bending_run,
    calibrate,
)
from tca_mj.envs.finger import ACTION, FILTER, OBSERVATION, PERIOD, FingerSense, SensedFinger
from tca_mj.modules.bending import BendingSpec
from tca_mj.modules.innervated import InnervatedFingerSpec, innervated_finger
from tca_mj.sim import Simulation
from tca_mj.validation.touched import findings as touched_findings

OFF = np.full(ACTION.size, -1.0, dtype=np.float32)
FULL_ON = np.full(ACTION.size, 1.0, dtype=np.float32)
DEGREE = math.radians(1.0)


@pytest.fixture(scope="module")
def shared():
    return FingerSense(action="power")


@pytest.fixture(scope="module")
def policy():
    return FingerPolicy()


def touched(env, policy, seconds, seed=0, **options):
    """An episode with the script: after each step time, angle [deg], observation, info."""
    policy.reset()
    observation, _ = env.reset(seed=seed, options=options)
    rows = []
    for _ in range(round(seconds / PERIOD)):
        observation, reward, terminated, truncated, info = env.step(policy.act(observation))
        rows.append((info["time"], math.degrees(info["angle"]), policy.phase, reward, info))
        if terminated or truncated:
            break
    return rows


def test_cold_tcas_are_slack_and_nothing_pulls():
    spec = InnervatedFingerSpec()
    part = innervated_finger(spec)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part)
    sim.step(np.zeros(3), 0.5)
    assert sim.tension.max() < 1e-9 and np.abs(sim.data.qpos).max() < 1e-9
    assert sim.length == pytest.approx(np.full(3, 40e-3), rel=1e-9)
    assert [tca.stretch for tca in part.tcas] == pytest.approx([-5e-3] * 3)
    # Sun, Table 2.3 and Section 3.1.1: 6.7 ohm/dm of 45 mm, which are 5 mm shorter.
    one = 67.0 * 45e-3 * (1.0 + 0.20 / 0.357 * 5.0 / 45.0)
    assert sim.resistance == pytest.approx(np.full(3, one), rel=1e-6)


def test_the_finger_has_its_silicone_once():
    """Whatever is said per length of TCA: the silicone is as long as the finger."""
    spec = InnervatedFingerSpec()
    section = math.pi * 4.5e-3**2 / 4.0
    heat, plain = spec.embedded.heat, BendingSpec(length=40e-3).embedded.of_length(40e-3).heat
    assert 3.0 * heat.body_capacity == pytest.approx(1070.0 * 1300.0 * section * 40e-3)
    assert heat.conductance == pytest.approx(plain.conductance)
    assert heat.body_loss == pytest.approx(plain.body_loss)
    assert heat.capacity == pytest.approx(45.0 / 40.0 * plain.capacity)
    mass = spec.cylinder.body.mass + 3.0 * spec.embedded.mass
    assert innervated_finger(spec).spec.compile().body_mass.sum() == pytest.approx(mass)


def test_the_power_of_two_in_series_with_their_leads():
    """All of V²/R but what the leads take, by halves."""
    spec = InnervatedFingerSpec()
    current = 5.0 / 6.6
    assert spec.heating(5.0, 6.6) == pytest.approx(current**2 * 3.2)
    assert spec.heating(5.0, 6.6, 0.25) == pytest.approx(0.25 * current**2 * 3.2)
    assert FingerSense.max_power == pytest.approx(np.full(2, spec.heating(SUPPLY, 6.6)), rel=2e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: InnervatedFingerSpec(tca_length=39e-3), "tca_length must be .*at least 0.04"),
        (lambda: InnervatedFingerSpec(tca_length=70e-3), "tca_length must be .*below 0.06"),
        (lambda: InnervatedFingerSpec(leads=-1.0), "leads must be .*at least 0"),
        (lambda: InnervatedFingerSpec(cylinder=BendingSpec(count=4)), "cylinder.count must be"),
        (lambda: InnervatedFingerSpec().heating(5.0, 0.1), "resistance must be .*above 0.2"),
        (lambda: InnervatedFingerSpec().heating(5.0, 6.0, 1.5), "duty must be .*at most 1"),
        (lambda: FingerSense(timestep=3e-3), "timestep|tca_period"),
        (lambda: FingerPolicy(trigger=0.0), "trigger must be .*above 0"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_bent_by_hand_its_resistance_falls_by_geometry(shared):
    """Parallel TCAs: by 2 mm, their lever, per radian, whatever the shape; and stretched by it."""
    shared.reset(seed=0, options={"noise": 0.0, "touch_time": 0.5})
    rest, least, angle = shared.sensed.resistance, math.inf, 0.0
    length = shared.sim.length[:2].sum()
    for _ in range(round(1.8 / PERIOD)):
        *_, info = shared.step(OFF)
        if shared.sensed.resistance < least:
            least, angle = shared.sensed.resistance, info["angle"]
            longer = shared.sim.length[:2].sum() - length
    assert -115.0 < math.degrees(angle) < -80.0
    # The hand also squeezes the finger, by less than a tenth of that.
    assert longer == pytest.approx(-2.0 * angle * 2e-3, rel=0.1)
    assert rest - least == pytest.approx(67.0 * 0.20 / 0.357 * longer, rel=1e-6)
    assert rest - least > 1.1 * TRIGGER


def test_the_sensor_is_a_moving_average_of_noisy_readings(shared):
    observation, _ = shared.reset(seed=3, options={"touch_time": 600.0, "noise": 0.02})
    seen = [OBSERVATION.read(observation)]
    for _ in range(400):
        seen.append(OBSERVATION.read(shared.step(OFF)[0]))
    reading, mean, least = (
        np.array([each[name] for each in seen]).ravel()
        for name in ("resistance reading", "resistance", "lowest resistance")
    )
    true = shared.sensed.resistance
    assert reading.std() == pytest.approx(0.02, rel=0.15)
    assert reading.mean() == pytest.approx(true, abs=4.0 * 0.02 / 20.0)
    assert mean.std() == pytest.approx(0.02 / math.sqrt(2 * FILTER - 1), rel=0.35)
    assert np.diff(mean) == pytest.approx((reading[1:] - mean[:-1]) / FILTER, abs=1e-5)
    assert (least == np.minimum.accumulate(mean)).all()
    again, _ = shared.reset(seed=3, options={"touch_time": 600.0, "noise": 0.0})
    assert OBSERVATION.read(again)["resistance"] == pytest.approx(true, abs=1e-4)


def test_the_cubic_knows_the_angle(policy):
    """As reported, 1.6° (Sun, Section 4.2.1): a straight line and noise here."""
    fit = policy._fit
    assert 0.5 * DEGREE < fit.rmse < 2.0 * DEGREE
    finger = SensedFinger()
    for hot in (90.0, 100.0):
        finger.sim.rest([hot, hot, 25.0], longest=4.0, quiet=1e-2)
        assert finger.angle > 15.0 * DEGREE
        assert policy.angle_of(finger.resistance) == pytest.approx(finger.angle, abs=3.0 * DEGREE)
    quiet = bending_run(noise=0.0)
    assert quiet.temperature < 130.0 and quiet.angle.max() > 90.0 * DEGREE
    assert calibrate(InnervatedFingerSpec()).rmse == fit.rmse


def test_it_feels_the_touch_bends_and_holds(shared, policy):
    """Sun, Section 4.2.2: rise about 1.5 s, error within 5 % while the silicone warms."""
    rows = touched(shared, policy, 20.0, touch_time=1.0)
    time, angle = (np.array([row[i] for row in rows]) for i in (0, 1))
    phases = [row[2] for row in rows]
    felt = time[phases.index("bend")]
    # While the hand presses; the filter takes 0.2 s.
    assert 1.3 < felt < 2.8 and angle[: phases.index("bend") + 1].min() < -60.0
    rise = time[(time > felt) & (angle > 54.0)][0] - felt
    assert 1.0 < rise < 2.0
    held = angle[time > felt + 5.0]
    assert held.mean() == pytest.approx(60.0, rel=0.05) and held.size * PERIOD > 5.0
    info = rows[-1][4]
    assert info["success"] and info["time"] < 20.0
    assert info["body_temperature"][0] > 40.0 > info["body_temperature"][2]
    assert max(row[4]["temperature"].max() for row in rows) < 130.0
    total = sum(row[3] for row in rows)
    terms = [sum(row[4]["reward_terms"][name] for row in rows) for name in ("reach", "goal")]
    assert terms[1] == 10.0 and terms[0] > 0.0 and 8.0 < total < 16.0


def test_untouched_it_stays_where_it_is(shared, policy):
    """No false alarm in 60 s, with the noise of its sensor; the filter is far from the trigger."""
    policy.reset()
    observation, _ = shared.reset(seed=1, options={"touch_time": 600.0})
    ohms = float(OBSERVATION.read(observation)["resistance"][0])
    still = shared.sensed.resistance
    random = np.random.default_rng(1)
    for reading in still + 0.01 * random.standard_normal(round(60.0 / PERIOD)):
        ohms += (reading - ohms) / FILTER
        seen = OBSERVATION.pack({
            "resistance": ohms, "resistance reading": reading, "lowest resistance": ohms,
            "TCA power": 0.0, "commanded angle": 1.0, "time at the goal": 0.0,
        })  # fmt: skip
        assert (policy.act(seen) == OFF).all()
    assert policy.phase == "watch"


def test_a_light_touch_is_none(shared, policy):
    rows = touched(shared, policy, 3.5, touch_time=0.5, touch=30.0 * DEGREE)
    assert min(row[1] for row in rows) < -10.0 and {row[2] for row in rows} == {"watch"}


def test_who_does_not_wait_is_a_false_alarm(shared):
    shared.reset(seed=0, options={"touch_time": 600.0})
    for _ in range(150):
        *_, terminated, truncated, info = shared.step(FULL_ON)
        if terminated or truncated:
            break
    assert terminated and not truncated and not info["success"]
    assert info["termination_reason"].startswith("false alarm")
    assert info["reward_terms"]["end"] == -5.0
    assert 10.0 < math.degrees(info["angle"]) < 20.0


def test_waiting_out_a_touch_earns_nothing(shared):
    """Reach is a change: the hand comes and goes, and what is left is what was not done."""
    shared.reset(seed=0, options={"touch_time": 0.5})
    earned = 0.0
    for _ in range(round(4.0 / PERIOD)):
        *_, info = shared.step(OFF)
        earned += info["reward_terms"]["reach"]
    assert info["asked"] and abs(info["angle"]) < 2.0 * DEGREE
    # It ought to be at the target since the hand pressed, from where it had taken it.
    assert earned == pytest.approx(0.0, abs=0.1)


def test_the_pair_is_heated_alike_and_the_third_tca_never(shared):
    for heating in ("power", "temperature"):
        env = shared if heating == "power" else FingerSense()
        env.reset(seed=0)
        for _ in range(10):
            *_, info = env.step(FULL_ON)
        one, other, third = info["energy"]
        assert one == other > 0.2 and third == 0.0
        if heating == "power":
            assert one == pytest.approx(0.2 * 1.84)


def test_gains_are_the_printed_ones():
    assert (GAINS.proportional, GAINS.near, GAINS.near_proportional) == (20.0, 1.0, 3.0)
    assert GAINS.integral == pytest.approx(0.08 / 0.01) and GAINS.highest == FULL == 255.0
    with pytest.raises(ValueError, match="highest must be above"):
        replace(GAINS, highest=-1.0)


def test_the_page_of_validation_says_what_is_found():
    """After a change: python scripts/validation_page.py."""
    page = Path(__file__).resolve().parent.parent / "docs" / "validation-modules.md"
    text, rows = page.read_text(encoding="utf-8"), touched_findings()
    assert [row.fact for row in rows if f"| {row.model} | {row.verdict} |" not in text] == []
    assert {row.verdict for row in rows} == {"held", "trend held", "fitted"}

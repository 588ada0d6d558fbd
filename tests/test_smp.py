"""Shape-memory spine: modulus, fixing and recovery, energy, damage rule, the whole module."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tca_mj.smp import (
    SOFT_MODULUS,
    DamageSpec,
    HeaterSpec,
    SmpSpec,
    SpineSpec,
    SpineState,
    advance,
    fixity,
    flag_damage,
    recovery,
    soft_bending_rate,
    spring,
    stored_energy,
)
from tca_mj.smp.heater import HOLD_TEMPERATURE
from tca_mj.smp.lumped import TUBE_DIAMETER, LumpedModule, in_tube, sheathed
from tca_mj.tca import CATALOGUE

SMP = SmpSpec()
SPINE = SpineSpec()
HEATER = HeaterSpec.fitted(SPINE)
HOT = HOLD_TEMPERATURE
RNG = np.random.default_rng(6)


# --- modulus


def test_the_modulus_is_what_was_reported():
    """Sun, Section 6.1.3: below 50 MPa above 110 °C, rigid below 80 °C."""
    hot, cold = np.linspace(110.0, 250.0, 200), np.linspace(-20.0, 80.0, 200)
    assert (SMP.modulus(hot) < SOFT_MODULUS).all()
    assert (SMP.modulus(cold) >= 0.9 * SMP.glassy * (1.0 - 1e-12)).all()
    assert (SMP.modulus(cold) < SMP.glassy).all()
    assert SMP.modulus(80.0) == pytest.approx(SMP.rigid_share * SMP.glassy, rel=1e-12)
    assert (SMP.modulus(hot) >= SMP.rubbery).all() and (SMP.glass(hot) > 0.0).all()


def test_the_logarithm_of_the_modulus_is_a_sigmoid():
    """log E is odd about the middle, and the log-odds of its share are linear in T."""
    offset = np.linspace(0.0, 30.0, 61)
    product = SMP.modulus(SMP.middle + offset) * SMP.modulus(SMP.middle - offset)
    np.testing.assert_allclose(product, SMP.glassy * SMP.rubbery, rtol=1e-12)
    temperature = np.linspace(80.0, 110.0, 31)
    span = math.log(SMP.glassy / SMP.rubbery)
    share = np.log(SMP.modulus(temperature) / SMP.rubbery) / span
    odds = np.log(share / (1.0 - share))
    np.testing.assert_allclose(np.diff(odds), -1.0 / SMP.width, rtol=1e-9)


def test_slope_is_the_derivative():
    temperature, h = np.linspace(20.0, 180.0, 81), 1e-4
    central = (SMP.modulus(temperature + h) - SMP.modulus(temperature - h)) / (2.0 * h)
    np.testing.assert_allclose(SMP.slope(temperature), central, rtol=1e-6, atol=1.0)


def test_extreme_temperatures_give_the_limits():
    limits = [SMP.glassy, SMP.rubbery]
    np.testing.assert_allclose(SMP.modulus([-273.0, 5000.0]), limits, rtol=1e-14)
    np.testing.assert_array_equal(SMP.slope([-273.0, 5000.0]), [0.0, 0.0])


@pytest.mark.parametrize(
    ("field", "value"),
    [("glassy", -1.0), ("rubbery", 3e9), ("rigid_share", 1.0), ("rigid_share", 0.01),
     ("rigid_below", 120.0), ("soft_above", math.inf), ("conductivity", math.nan)],
)  # fmt: skip
def test_a_material_checks_itself(field, value):
    with pytest.raises(ValueError, match=field):
        replace(SMP, **{field: value})


# --- spine


def test_the_spine_can_hold_15_g_and_reach_240_degrees():
    """Sun, Figure 6.1 and Section 6.2.1; the section is an estimate between these two."""
    assert SMP.modulus(HOT) < SPINE.largest_modulus(math.radians(240.0), 0.78)
    assert SPINE.sag(0.015 * 9.81, 25.0) < math.radians(3.0)
    thinner, thicker = replace(SPINE, thickness=2.3e-3), replace(SPINE, thickness=3.5e-3)
    assert thinner.sag(0.015 * 9.81, 25.0) > math.radians(3.0)
    assert SMP.modulus(HOT) > thicker.largest_modulus(math.radians(240.0), 0.78)


def test_largest_modulus_is_the_balance_of_torques():
    angle, tension = 3.0, 0.5
    modulus = SPINE.largest_modulus(angle, tension)
    moment = modulus * SPINE.second_moment * angle / SPINE.length
    assert moment == pytest.approx(2.0 * tension * SPINE.tca_offset, rel=1e-14)


# --- fixing and recovery


def balance(smp, state, torque):
    """Angle at which the joint carries a torque over I/ds."""
    modulus, reference = spring(smp, state)
    return reference + torque / modulus


def course(smp, state, temperatures, torque=0.0):
    """Quasi-static course of temperature at a torque over I/ds; returns state and angle."""
    angle = balance(smp, state, torque)
    for temperature in temperatures:
        state = advance(smp, state, angle, temperature)
        angle = balance(smp, state, torque)
    return state, angle


HEATING, COOLING = np.linspace(25.0, HOT, 400), np.linspace(HOT, 25.0, 400)


def test_cooling_is_the_rule_of_balanced_torques():
    """reference' = q - (E_hot/E_cold) (q - reference), for any state and angle."""
    memory, angle = RNG.normal(size=50), RNG.normal(size=50)
    state = SpineState.rest(SMP, memory, 105.0)
    state = advance(SMP, state, RNG.normal(size=50), 100.0)
    before = spring(SMP, state)
    after = spring(SMP, advance(SMP, state, angle, 60.0))
    expected = angle - before.modulus / after.modulus * (angle - before.reference)
    np.testing.assert_allclose(after.reference, expected, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(after.modulus, SMP.modulus(60.0), rtol=1e-14)
    torque = after.modulus * (angle - after.reference)
    np.testing.assert_allclose(torque, before.modulus * (angle - before.reference), rtol=1e-7)


def test_a_shape_is_fixed_and_recovered():
    """Bent hot, cooled under load, unloaded: 1 - E_hot/E_cold is left. Reheated: E_g/E of it."""
    memory = np.array([0.0, 0.3, -0.2])
    state, angle = course(SMP, SpineState.rest(SMP, memory), HEATING)
    np.testing.assert_allclose(angle, memory, rtol=0, atol=1e-15)
    torque = 4e6
    bent = balance(SMP, state, torque)
    state, cold = course(SMP, state, COOLING, torque)
    np.testing.assert_allclose(cold, bent, rtol=1e-12)  # nothing moves while it cools
    free = balance(SMP, state, 0.0)
    kept = (free - memory) / (bent - memory)
    np.testing.assert_allclose(kept, fixity(SMP, HOT, 25.0), rtol=1e-12)
    assert (kept > 0.99).all()
    state, warm = course(SMP, state, HEATING)
    back = 1.0 - (warm - memory) / (state.frozen - memory)
    np.testing.assert_allclose(back, recovery(SMP, HOT), rtol=1e-12)
    assert (back > 0.99).all()
    _, molten = course(SMP, state, [400.0])
    np.testing.assert_allclose(molten, memory, rtol=0, atol=1e-15)


def test_cycles_without_load_do_not_drift():
    """At the memory nothing ever moves; a fixed shape shrinks by the same factor every cycle."""
    start = SpineState.rest(SMP, np.array([0.4, -1.0]))
    state = start
    for _ in range(5):
        state, angle = course(SMP, state, [*HEATING, *COOLING])
        np.testing.assert_allclose(angle, start.memory, rtol=0, atol=1e-15)
    hot = advance(SMP, start, start.memory, HOT)
    state = advance(SMP, hot, start.memory + 1.0, 25.0)
    left = [1.0]
    for _ in range(4):
        state, angle = course(SMP, state, [*HEATING, *COOLING])
        left.append(float((angle - start.memory)[0]))
    ratios = np.divide(left[1:], left[:-1])
    np.testing.assert_allclose(ratios[1:], ratios[1], rtol=1e-6)
    assert abs(ratios[1]) < 0.02 and left[-1] < 1e-7


def test_the_order_of_steps_does_not_matter_at_a_constant_angle():
    state = SpineState.rest(SMP, np.zeros(4), 130.0)
    angle = np.array([0.1, -0.3, 2.0, 0.0])
    once = advance(SMP, state, angle, 40.0)
    for temperature in np.linspace(130.0, 40.0, 77):
        state = advance(SMP, state, angle, temperature)
    np.testing.assert_allclose(state.frozen, once.frozen, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(state.glass, once.glass, rtol=1e-12)


@pytest.mark.parametrize("steps", [50, 200])
def test_a_load_that_grows_while_it_cools(steps):
    """Every new load meets the modulus of its moment: q = ∫ dM/E; first order in the step."""

    def error(n):
        temperature = np.linspace(HOT, 60.0, n + 1)
        torque = np.linspace(0.0, 4e6, n + 1)
        state = SpineState.rest(SMP, np.zeros(1), HOT)
        angle = np.zeros(1)
        for i in range(1, n + 1):
            state = advance(SMP, state, angle, temperature[i])
            angle = balance(SMP, state, torque[i])
        fine = np.linspace(HOT, 60.0, 200001)
        return float(angle[0]) - np.trapezoid(4e6 / SMP.modulus(fine), fine) / (60.0 - HOT)

    assert error(2 * steps) / error(steps) == pytest.approx(0.5, abs=0.03)


def test_temperature_never_adds_elastic_energy():
    memory, frozen, angle = RNG.normal(size=(3, 1000))
    state = SpineState(memory, frozen, SMP.glass(RNG.uniform(60.0, 130.0, 1000)))
    before = stored_energy(SMP, state, angle)
    after = stored_energy(SMP, advance(SMP, state, angle, RNG.uniform(60, 130, 1000)), angle)
    assert (after <= before * (1.0 + 1e-12)).all()
    # Melting gives up the glass's energy in proportion, exactly.
    halved = advance(SMP, state, angle, 300.0)
    lost = 0.5 * state.glass * (angle - frozen) ** 2
    np.testing.assert_allclose(before - stored_energy(SMP, halved, angle), lost, rtol=1e-6)


def test_no_closed_course_yields_work():
    """Random courses of temperature and angle that end where they began, 500 at a time."""
    n, steps = 500, 60
    angle = RNG.normal(size=(steps + 1, n))
    temperature = RNG.uniform(70.0, 125.0, (steps, n))
    state = SpineState.rest(SMP, np.zeros(n), 25.0)
    angle[0] = angle[-1] = 0.0
    work = np.zeros(n)
    for i in range(steps):
        modulus, reference = spring(SMP, state)
        change = angle[i + 1] - angle[i]
        work += modulus * (0.5 * (angle[i + 1] + angle[i]) - reference) * change
        state = advance(SMP, state, angle[i + 1], temperature[i])
    assert (work > stored_energy(SMP, state, 0.0)).all()


def test_unloading_returns_the_energy_of_the_rubber_only():
    """Reheated, a fixed spine can lift what its rubbery network stored, and no more."""
    hot = SpineState.rest(SMP, np.zeros(1), 300.0)
    fixed = advance(SMP, hot, np.ones(1), 25.0)
    assert stored_energy(SMP, fixed, 1.0) == pytest.approx(0.5 * SMP.rubbery, rel=1e-12)
    molten = advance(SMP, fixed, np.ones(1), 300.0)
    assert stored_energy(SMP, molten, 1.0) == pytest.approx(0.5 * SMP.rubbery, rel=1e-12)


def test_batches_and_bad_angles():
    state = SpineState.rest(SMP, np.zeros((2, 3)), np.array([[25.0], [120.0]]))
    assert state.glass.shape == state.memory.shape == (2, 3)
    state = advance(SMP, state, np.ones((2, 3)), np.array([[120.0], [25.0]]))
    np.testing.assert_array_equal(state.frozen[0], 0.0)
    np.testing.assert_allclose(state.frozen[1], 1.0, rtol=1e-4)
    with pytest.raises(ValueError, match="angle"):
        advance(SMP, state, np.full((2, 3), np.nan), 25.0)
    with pytest.raises(ValueError, match="temperature"):
        advance(SMP, state, np.ones((2, 3)), math.nan)


# --- damage


def test_the_damage_rule():
    fast = 2.0 * DamageSpec().steady_rate
    cases = (  # modulus, cooling, tension, rate: damaged, inaccurate, hardening
        (9e6, True, 0.3, fast, False, False, False),  # soft: that is how it morphs
        (1e8, True, 0.3, fast, True, False, True),
        (1e8, False, 0.3, fast, True, False, False),  # TCA before the spine is soft
        (1e8, True, 0.3, 0.5 * fast * 0.9, False, False, True),  # steady
        (1e8, True, 0.3, -fast, False, True, True),
        (1e8, True, 0.0, fast, False, False, True),  # slack
        (2.4e9, True, 0.3, -fast, False, False, False),  # rigid: release
        (2.4e9, True, 0.3, fast, True, False, False),
    )
    columns = [np.array(column) for column in zip(*cases, strict=True)]
    flags = flag_damage(*columns[:4])
    for found, expected in zip(flags, columns[4:], strict=True):
        np.testing.assert_array_equal(found, expected)
    with pytest.raises(ValueError, match="tension"):
        flag_damage(1e8, True, math.nan, 0.0)
    with pytest.raises(ValueError, match="soft_modulus"):
        DamageSpec(soft_modulus=3e9)


def test_bending_rate_is_that_of_a_soft_spine():
    """A rise of tension bends the rubbery spine by 2 a dF L/(E_r I)."""
    angle = soft_bending_rate(SPINE, 0.1) * 2.0
    moment = SMP.rubbery * SPINE.second_moment * angle / SPINE.length
    assert moment == pytest.approx(2.0 * SPINE.tca_offset * 0.2, rel=1e-14)


# --- the whole module, lumped

MODULE = LumpedModule(SPINE, HEATER, sheathed(CATALOGUE["free-stroke"], SPINE))
WATTS = float(MODULE.bank.steady([150.0])[1][0])  # keep the TCA at 150 °C [W]


def run(state, *, heater=0.0, power=0.0, fan=False, time, dt=0.1, moment=0.0):
    """Steps a module; returns its state and whether damage was flagged on the way."""
    damaged = False
    for _ in range(round(time / dt)):
        state = MODULE.step(state, heater, power, fan, dt, moment)
        damaged |= bool(state.damage.damaged[0])
    return state, damaged


@cache
def bent():
    """Softened, and bent by a constant power until TCA and tube are steady."""
    state, _ = run(MODULE.rest(), heater=25.0, time=7.0, dt=0.5)
    return run(state, heater=9.5, power=WATTS, time=500.0, dt=0.5)


def test_the_tube_holds_what_its_section_weighs():
    """Ecoflex, 1070 kg/m³ and 1300 J/(kg K), round two legs; λ_b by its outside, 15 W/(m² K)."""
    heat, legs, coil = MODULE.bank.heat, 2.0 * SPINE.length, CATALOGUE["free-stroke"]
    section = math.pi * (TUBE_DIAMETER**2 / 4.0 - coil.outer_radius**2)
    assert heat.body_capacity[0] == pytest.approx(1070.0 * 1300.0 * section * legs)
    assert heat.body_loss[0] == pytest.approx(15.0 * math.pi * TUBE_DIAMETER * legs)
    rate = (heat.conductance[0] + heat.body_loss[0]) / heat.body_capacity[0]
    assert MODULE.fading_time == pytest.approx(1.0 / rate)


def test_the_fading_time_is_that_of_the_power_at_one_temperature():
    """P - P_end falls by 1/e in it, while the TCA is kept at 150 °C; that of a bare one stays."""
    heat, hot, cold = MODULE.bank.heat, np.full(1, 150.0), np.full(1, 25.0)
    warm = heat.body_after(cold, hot, MODULE.fading_time)
    powers = [heat.keeping(hot, body)[0] for body in (cold, warm, heat.steady_body(hot))]
    assert (powers[1] - powers[2]) / (powers[0] - powers[2]) == pytest.approx(math.exp(-1.0))
    bare = LumpedModule(SPINE, HEATER, CATALOGUE["free-stroke"].of_length(2.0 * SPINE.length))
    assert bare.fading_time == 0.0


def test_the_reported_second_lies_between_a_loose_and_a_touching_tube():
    """Sun, Section 6.2.1: 240° in 1 s at 25 V; loose is within a factor of two of it."""
    times = []
    for touching in (0.0, 1.0):
        tca = in_tube(CATALOGUE["free-stroke"], touching).of_length(2.0 * SPINE.length)
        module, time = LumpedModule(SPINE, HEATER, tca), 0.0
        state = module.rest()
        for _ in range(140):
            state = module.step(state, 25.0, 0.0, False, 0.05)
        while state.angle[0] < math.radians(240.0):
            state = module.step(state, 9.5, 25.0**2 / module.resistance(state), False, 0.02)
            time += 0.02
        times.append(time)
    assert 0.5 < times[0] < 1.0 < times[1] < 5.0


def test_the_module_balances_its_torques():
    state, _ = bent()
    modulus, reference = spring(SMP, state.spine)
    stiffness = modulus * SPINE.second_moment / SPINE.length
    torque = stiffness * (state.angle - reference)
    assert torque[0] == pytest.approx(2.0 * SPINE.tca_offset * state.tension[0], rel=1e-9)
    assert math.radians(150) < state.angle[0] < math.radians(240)


def test_a_steady_tca_is_safe_and_a_heated_one_is_not():
    state, damaged = bent()
    assert not damaged
    shape, damaged = run(state, power=WATTS, fan=True, time=11.3)
    assert not damaged
    assert shape.heater.temperature[0] < 81.0
    assert shape.angle[0] == pytest.approx(state.angle[0], abs=math.radians(0.1))
    assert run(state, power=1.4 * WATTS, fan=True, time=11.3)[1]
    relaxed, damaged = run(state, power=0.4 * WATTS, fan=True, time=11.3)
    assert not damaged and relaxed.angle[0] < state.angle[0] - math.radians(10.0)


def test_a_released_shape_holds_a_load_without_power_and_recovers():
    state, _ = bent()
    shape, _ = run(state, power=WATTS, time=40.0, dt=0.2)
    free, _ = run(shape, time=300.0, dt=1.0)  # the tube cools in 48 s
    assert free.tension[0] < 1e-3
    assert free.angle[0] == pytest.approx(state.angle[0], abs=math.radians(2.0))
    # The moment of 15 g at the middle of the module, at every section.
    loaded, _ = run(free, time=100.0, dt=1.0, moment=-0.015 * 9.81 * 0.5 * SPINE.length)
    assert free.angle[0] - loaded.angle[0] < math.radians(3.0)
    flat, _ = run(loaded, heater=25.0, time=6.8, dt=0.2)
    flat, _ = run(flat, heater=9.5, time=30.0, dt=0.5)
    assert abs(flat.angle[0]) < math.radians(3.0)


def test_the_module_converges_in_the_step():
    """Cooling while the TCA still heats up: first order."""
    state, _ = run(MODULE.rest(), heater=25.0, time=7.0, dt=0.5)
    steps = (0.4, 0.2, 0.1, 0.05)
    angles = [float(run(state, power=5.0, time=16.0, dt=dt)[0].angle[0]) for dt in steps]
    changes = np.diff(angles)
    assert changes[2] / changes[1] == pytest.approx(0.5, abs=0.05)
    assert abs(changes[2]) < math.radians(0.5)

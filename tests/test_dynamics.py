"""Motion of loaded TCAs: closed forms, order of convergence, energy and the static limit."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tca_mj.tca import (
    CATALOGUE,
    CoilRods,
    CoilSolveError,
    Heating,
    Load,
    LoadedTcas,
    LoadState,
    MotionSolveError,
    coil_tension,
)
from tca_mj.tca.dynamics.banded import _chained, solve_course
from tca_mj.tca.dynamics.loads import Course

TCA = CATALOGUE["free-stroke"]
MASS = 0.03  # [kg]
G = 9.81


def spring(stiffness=20.0, length=0.045):
    """The law of a linear spring: what the closed forms know."""
    return lambda x, _: (stiffness * (x - length), np.full_like(x, stiffness))


def state_of(length, velocity=0.0, temperature=25.0):
    return LoadState(*(np.array([v]) for v in (length, velocity, temperature, 0.0)))


def test_a_linear_spring_swings_with_the_frequency_of_the_midpoint_rule():
    """l - l_e = a cos(w' t) with tan(w' dt/2) = w dt/2, for steps short and long."""
    tcas = LoadedTcas([TCA], Load.weight(MASS), law=spring())
    rest = tcas.rest().length[0]
    assert rest == pytest.approx(0.045 + MASS * G / 20.0, rel=1e-12)
    omega = math.sqrt(20.0 / MASS)
    for dt in (1e-3, 0.03, 0.2):
        course = tcas.simulate(state_of(rest + 4e-3), Heating(), dt, 400)
        theory = 4e-3 * np.cos(2.0 / dt * math.atan(0.5 * omega * dt) * course.time)
        np.testing.assert_allclose(course.length[:, 0] - rest, theory, atol=1e-10)


def test_a_damped_swing_dies_out_at_its_rate():
    """a exp(-b t/2m); the rule's own error is (w dt)^2/12 = 6e-5 of the time."""
    damping = 0.2
    tcas = LoadedTcas([TCA], Load.weight(MASS, damping), law=spring())
    rest = tcas.rest().length[0]
    course = tcas.simulate(state_of(rest + 4e-3), Heating(), 1e-3, 1000)
    rate, omega2 = damping / (2.0 * MASS), 20.0 / MASS
    energy = 0.5 * course.velocity**2 + 0.5 * omega2 * (course.length - rest) ** 2
    energy += rate * course.velocity * (course.length - rest)  # what decays without ripple
    np.testing.assert_allclose(energy, energy[0] * np.exp(-2.0 * rate * course.time)[:, None],
                               rtol=2e-3)  # fmt: skip


def test_the_damper_takes_exactly_what_is_lost():
    tcas = LoadedTcas([TCA], Load.weight(MASS, 0.3), law=spring())
    rest = tcas.rest().length[0]
    course = tcas.simulate(state_of(rest + 4e-3), Heating(), 5e-3, 200)
    energy = 0.5 * MASS * course.velocity**2 + 0.5 * 20.0 * (course.length - rest) ** 2
    taken = 0.3 * 5e-3 * (0.5 * (course.velocity[1:] + course.velocity[:-1])) ** 2
    np.testing.assert_allclose(energy[:-1] - energy[1:], taken, atol=1e-15)


def test_free_flight_of_a_slack_tca_is_a_parabola():
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    start = state_of(0.044, velocity=-0.3)
    course = tcas.simulate(start, Heating(), 1e-3, 50)
    t = course.time[:, None]
    np.testing.assert_allclose(course.length, 0.044 - 0.3 * t + 0.5 * G * t * t, atol=1e-14)
    np.testing.assert_array_equal(tcas.tension(start), 0.0)


def mechanical_energy(course):
    """Kinetic + elastic + weight, the elastic part by quadrature of the tension."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    base, length = 0.055, course.length[:, 0]
    points = base + 0.5 * (length[:, None] - base) * (nodes + 1.0)
    force, _ = coil_tension(TCA, points, course.temperature[:, :1])
    elastic = 0.5 * (length - base) * (force @ weights)
    return 0.5 * MASS * course.velocity[:, 0] ** 2 + elastic - MASS * G * length


def test_an_undamped_weight_keeps_its_energy():
    """No drift in 20 swings on the rod; the ripple falls with the square of the step."""
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    start = state_of(tcas.rest().length[0] + 6e-3)
    ripples = []
    for dt in (8e-3, 4e-3):
        energy = mechanical_energy(tcas.simulate(start, Heating(), dt, round(4.0 / dt)))
        swing = 0.5 * 25.0 * 6e-3**2
        error = (energy - energy[0]) / swing
        ripples.append(np.ptp(error))
        half = error.size // 2
        assert abs(error[:half].mean() - error[half:].mean()) < 0.05 * ripples[-1] + 1e-12
    assert ripples[0] < 1e-3
    assert ripples[1] == pytest.approx(0.25 * ripples[0], rel=0.1)


def course_of_the_ode(tcas, heating, start, duration):
    """The same problem as an ordinary differential equation, solved to 1e-10."""
    load, heat = tcas.load, tcas.heat

    def rate(_, y):
        state = state_of(*y)
        power = heating.power(tcas.resistance(state))
        lost = heat.loss * heating.air * (state.temperature - heat.ambient)
        pull = load.force + load.stiffness * (load.reference - state.length)
        pull = pull - load.damping * state.velocity - tcas.tension(state)
        return [y[1], (pull / load.mass).item(), ((power - lost) / heat.capacity).item()]

    y0 = [float(a[0]) for a in (start.length, start.velocity, start.temperature)]
    solved = solve_ivp(rate, (0.0, duration), y0, method="DOP853", rtol=1e-10, atol=1e-13)
    return solved.y[:, -1]


@pytest.mark.parametrize("source, value", [("power", 1.6), ("voltage", 2.2), ("current", 0.75)])
@pytest.mark.parametrize("load", [
    Load.weight(MASS, 0.05),
    Load.spring(12.0, 0.25, 0.056, mass=0.01, damping=0.02),
])  # fmt: skip
def test_steps_converge_to_the_differential_equation_with_order_two(source, value, load):
    tcas = LoadedTcas([TCA], load)
    heating = Heating(source=source, value=value, air=1.5)
    start = tcas.rest()
    start = LoadState(start.length + 2e-3, start.velocity, start.temperature, start.power)
    exact = course_of_the_ode(tcas, heating, start, 0.3)
    errors = []
    for steps in (60, 120):
        course = tcas.simulate(start, heating, 0.3 / steps, steps)
        end = [course.length[-1, 0], course.velocity[-1, 0], course.temperature[-1, 0]]
        errors.append(np.abs(np.array(end) - exact) / [1e-3, 2e-2, 10.0])
    assert np.max(errors[1]) < 0.1
    np.testing.assert_allclose(errors[1][:2], 0.25 * errors[0][:2], rtol=0.1)
    # With a held power the temperature is exact; else it is of second order, too.
    assert errors[1][2] < max(0.35 * errors[0][2], 1e-9)


def test_the_quasistatic_path_is_of_second_order_in_its_heat():
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    heating = Heating(source="voltage", value=2.2)

    def end(steps):
        course = tcas.simulate(tcas.rest(), heating, 2.0 / steps, steps, "quasistatic")
        return course.length[-1, 0]

    fine = end(512)
    assert abs(end(16) - fine) == pytest.approx(0.25 * abs(end(8) - fine), rel=0.1)
    assert abs(end(8) - fine) < 2e-5


def test_the_equilibrium_is_where_the_rod_carries_the_load():
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    for temperature in (25.0, 90.0, 160.0):
        length = tcas.equilibrium([temperature])[0]
        theory = brentq(lambda x, t=temperature: coil_tension(TCA, x, t)[0] - MASS * G, 0.03, 0.12,
                        xtol=1e-15, rtol=1e-14)  # fmt: skip
        assert length == pytest.approx(theory, abs=1e-12)


@pytest.mark.parametrize("name, power", [("free-stroke", 1.2), ("type-0-180", 6.0)])
def test_at_constant_power_a_damped_weight_comes_to_rest_in_the_static_solution(name, power):
    """Type 0 runs into the contact of its turns on the way."""
    tcas = LoadedTcas([CATALOGUE[name]], Load.weight(5e-3, 0.2))
    course = tcas.simulate(tcas.rest(), Heating(value=power), 0.05, 1000)
    settled = 25.0 + power / tcas.heat.loss
    np.testing.assert_allclose(course.temperature[-1], settled, rtol=1e-6)
    np.testing.assert_allclose(course.length[-1], tcas.equilibrium(settled), atol=1e-7)
    if name == "type-0-180":
        assert course.length[-1, 0] < CATALOGUE[name].minimum_length


@pytest.mark.parametrize("dt", [1e-3, 0.05, 0.5])
def test_steps_of_any_length_are_stable(dt):
    """A weight dropped from its unloaded length swings between that and twice the stretch."""
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    rest = tcas.rest().length[0]
    course = tcas.simulate(state_of(TCA.rest_length), Heating(), dt, 300)
    assert np.abs(course.length - rest).max() < 1.05 * (rest - TCA.rest_length)
    hot = tcas.simulate(tcas.rest(), Heating(value=1.5), dt, 100)
    assert hot.length.max() < rest + 1e-3


@pytest.mark.parametrize("mass, volts", [(0.03, 5.0), (0.03, 6.0), (0.05, 5.0), (0.05, 6.0)])
def test_inertia_hardly_matters(mass, volts):
    """Sun, Section 3.4.4, case 3; 6.7 ohm/dm of *fibre*, or 5 V would melt it. Below 0.15 mm.

    An equilibrium that sets off with speed v leaves the weight behind it by v/w at most, and swings
    it by that; w is the frequency of weight and coil. 10 % for what is not linear.
    """
    def ohms(length, _):
        return 67.0 * 0.175 * (1.0 - 0.149 * (length / TCA.rest_length - 1.0))

    tcas = LoadedTcas([TCA], Load.weight(mass), resistance=ohms)
    heating = Heating(source="voltage", value=volts)
    moving = tcas.simulate(tcas.rest(), heating, 5e-3, 200)
    still = tcas.simulate(tcas.rest(), heating, 5e-3, 200, "quasistatic")
    speed = np.abs(np.diff(still.length[:, 0])).max() / 5e-3
    stiffness = float(CoilRods([TCA]).tension(tcas.rest().length, np.array([25.0]))[1][0])
    behind = np.abs(moving.length - still.length).max()
    assert behind < 1.1 * speed / np.sqrt(stiffness / mass)
    assert behind < 0.15e-3
    assert np.ptp(still.length) > 1e-3


def test_a_spring_of_a_linear_tca_has_a_closed_form():
    """k (l - n(T)) = p + s (l_0 - l): with n = 45 mm - 0.1 mm/K (T - 25)."""
    def law(length, temperature):
        natural = 0.045 - 1e-4 * (temperature - 25.0)
        return 20.0 * (length - natural), np.full_like(length, 20.0)

    start = 0.045 + 0.05 / 20.0
    tcas = LoadedTcas([TCA], Load.spring(30.0, 0.05, start), law=law)
    assert tcas.rest().length[0] == pytest.approx(start, abs=1e-12)
    temperature = np.array([[25.0], [60.0], [125.0]])
    theory = start - 20.0 * 1e-4 * (temperature - 25.0) / 50.0
    length = tcas.equilibrium(temperature)
    np.testing.assert_allclose(length, theory, atol=1e-12)
    course = tcas.simulate(tcas.rest(), Heating(value=1.0), 0.1, 50, "quasistatic")
    np.testing.assert_allclose(
        tcas.tension(LoadState(*(a[-1] for a in (course.length, course.velocity,
                                                 course.temperature, course.power)))),
        0.05 + 30.0 * (start - course.length[-1]), rtol=1e-9)  # fmt: skip


def test_heat_of_a_held_source():
    """T = T_amb + P/(air λ) (1 - exp(-air λ t/C)), with P = V^2/R or I^2 R of a held length."""
    stiff = LoadedTcas([TCA], Load.weight(MASS, 1.0), law=spring(1e7))
    ohms = stiff.resistance(stiff.rest())[0]
    assert ohms == pytest.approx(67.0 * TCA.rest_length, rel=1e-5)
    heat = TCA.heat
    for source, value, power in (("power", 2.0, 2.0), ("voltage", 2.0, 4.0 / ohms),
                                 ("current", 0.5, 0.25 * ohms)):  # fmt: skip
        for air in (1.0, 4.0):
            heating = Heating(source=source, value=value, air=air)
            course = stiff.simulate(stiff.rest(), heating, 0.25, 8)
            loss = air * heat.loss
            theory = 25.0 - power / loss * np.expm1(-loss * course.time / heat.capacity)
            np.testing.assert_allclose(course.temperature[:, 0], theory, rtol=1e-6)
            np.testing.assert_allclose(course.power[1:], power, rtol=1e-6)


def test_blown_air_cools_faster_and_lets_the_weight_down():
    tcas = LoadedTcas([TCA], Load.weight(MASS, 0.1))
    hot = tcas.equilibrium([120.0])
    start = LoadState(hot, np.zeros(1), np.array([120.0]), np.zeros(1))
    still = tcas.simulate(start, Heating(), 0.01, 100)
    blown = tcas.simulate(start, Heating(air=3.0), 0.01, 100)
    assert blown.temperature[-1, 0] < still.temperature[-1, 0] < 120.0
    assert blown.length[-1, 0] > still.length[-1, 0] > hot[0]


def test_a_voltage_heats_less_the_more_the_tca_contracts_and_a_current_more():
    """Resistance rises with contraction (Sun, Section 2.3.1)."""
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    voltage = tcas.simulate(tcas.rest(), Heating(source="voltage", value=2.0), 0.02, 100)
    current = tcas.simulate(tcas.rest(), Heating(source="current", value=0.7), 0.02, 100)
    assert voltage.length[-1, 0] < voltage.length[0, 0] - 2e-3
    assert voltage.power[-1, 0] < 0.995 * voltage.power[1, 0]
    assert current.power[-1, 0] > 1.005 * current.power[1, 0]


def test_heating_may_be_a_function_of_time():
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    course = tcas.simulate(
        tcas.rest(), lambda t: Heating(value=1.0 if t < 0.0999 else 0.0), 0.01, 20
    )
    assert isinstance(course, Course)
    np.testing.assert_array_equal(course.power[:, 0], [0.0] + 10 * [1.0] + 10 * [0.0])
    assert np.argmax(course.temperature) == 10


def test_a_batch_is_its_rows_bit_for_bit():
    """With weights, springs, slack, contact, and every source, moving and not."""
    rng = np.random.default_rng(4)
    specs = [TCA, CATALOGUE["type-0-180"]]
    m = 12
    load = Load(
        force=rng.uniform(0.02, 0.4, (m, 2)), stiffness=rng.uniform(0.0, 10.0, (m, 2)),
        reference=np.array([0.05, 0.07]), mass=rng.uniform(0.005, 0.04, (m, 2)), damping=0.05,
    )  # fmt: skip
    value = rng.uniform(0.5, 2.0, (m, 2))
    for source, motion, dt in (("voltage", "dynamic", 0.02), ("power", "dynamic", 1e-3),
                               ("current", "quasistatic", 0.1)):  # fmt: skip
        whole = LoadedTcas(specs, load)
        heating = Heating(source=source, value=value)
        course = whole.simulate(whole.rest(), heating, dt, 30, motion)
        for i in range(m):
            row = Load(force=load.force[i], stiffness=load.stiffness[i],
                       reference=load.reference, mass=load.mass[i], damping=0.05)  # fmt: skip
            one = LoadedTcas(specs, row)
            single = one.simulate(
                one.rest(), Heating(source=source, value=value[i]), dt, 30, motion
            )
            for name in ("length", "velocity", "temperature", "power"):
                np.testing.assert_array_equal(getattr(single, name), getattr(course, name)[:, i])


@pytest.mark.parametrize("source, value", [("power", 1.6), ("voltage", 2.2), ("current", 0.75)])
def test_all_steps_at_once_are_the_steps_one_by_one(source, value):
    """With a weight and a spring, two kinds of TCA, in a batch, through slack and contact."""
    load = Load(force=np.array([0.2, 0.04]), stiffness=np.array([0.0, 4.0]),
                reference=0.06, mass=np.array([0.02, 0.004]), damping=0.03)  # fmt: skip
    tcas = LoadedTcas([TCA, CATALOGUE["type-0-180"]], load)
    rest = tcas.rest((2,))
    start = LoadState(rest.length, np.array([[0.0, 0.0], [-0.5, -0.2]]),
                      np.array([[25.0, 25.0], [70.0, 140.0]]), rest.power)  # fmt: skip
    heating = Heating(source=source, value=value, air=np.array([1.0, 2.0]))
    one, all_ = (
        tcas.simulate(start, heating, 2e-3, 150), solve_course(tcas, start, heating, 2e-3, 150)
    )
    tension = tcas.tension(LoadState(one.length, one.velocity, one.temperature, one.power))
    assert (tension == 0.0).any()
    assert (one.length[..., 1] < CATALOGUE["type-0-180"].minimum_length).any()
    np.testing.assert_array_equal(all_.time, one.time)
    np.testing.assert_allclose(all_.length, one.length, atol=1e-9)
    np.testing.assert_allclose(all_.velocity, one.velocity, atol=1e-6)
    np.testing.assert_allclose(all_.temperature, one.temperature, atol=1e-7)
    np.testing.assert_allclose(all_.power, one.power, rtol=1e-9)


def test_all_steps_at_once_where_newton_fails_for_all():
    """The course is cut until it converges: the knee that needs a bracket in every step."""
    def law(length, _):
        x = (length - 0.06) / 2e-5
        return 0.3 + 0.2 * np.arctan(x), 0.2 / 2e-5 / (1.0 + x * x)

    tcas = LoadedTcas([TCA], Load.weight(0.03, 0.1), law=law)
    start = state_of(0.058, velocity=0.1)
    one, all_ = (
        tcas.simulate(start, Heating(), 0.01, 40), solve_course(tcas, start, Heating(), 0.01, 40)
    )
    np.testing.assert_allclose(all_.length, one.length, atol=1e-7)
    assert solve_course(tcas, start, Heating(), 0.01, 0).length.shape == (1, 1)
    with pytest.raises(ValueError, match="moves too fast"):
        solve_course(tcas, state_of(0.05, velocity=-20.0), Heating(), 1e-2, 50)


@pytest.mark.parametrize("unknowns", [1, 2])
def test_chained_blocks_are_solved_one_after_another(unknowns):
    """B_i x_i + C_i x_(i-1) = r_i for several chains, x_(-1) = 0."""
    rng = np.random.default_rng(7)
    k, chains = 6, (2, 3)
    shape = (2, k, *chains) if unknowns == 1 else (4, 2, k, *chains)
    matrix = rng.uniform(-1.0, 1.0, shape)
    right = rng.uniform(-1.0, 1.0, (unknowns, k, *chains))
    # (here or before, equation, unknown, k, chains)
    block = matrix.reshape(2, unknowns, unknowns, k, *chains).swapaxes(1, 2)
    solved = _chained(matrix, right)
    left = np.einsum("eukab,ukab->ekab", block[0], solved)
    left[:, 1:] += np.einsum("eukab,ukab->ekab", block[1][:, :, 1:], solved[:, :-1])
    np.testing.assert_allclose(left, right, atol=1e-10)


def test_one_weight_of_many_states():
    tcas = LoadedTcas([TCA, TCA], Load.weight(MASS))
    state = tcas.step(tcas.rest((3,)), Heating(value=np.array([[0.0], [1.0], [2.0]])), 0.1)
    assert state.length.shape == (3, 2)
    assert np.all(np.diff(state.temperature[:, 0]) > 0.0)


def test_the_bracketed_search_solves_what_newton_does_not():
    """A law with a sharp knee, on which Newton's method jumps to and fro."""
    def law(length, _):
        x = (length - 0.06) / 1e-4
        return 0.3 + 0.2 * np.arctan(x), 0.2 / 1e-4 / (1.0 + x * x)

    tcas = LoadedTcas([TCA], Load(force=0.32), law=law)
    theory = 0.06 + 1e-4 * math.tan(0.1)
    assert tcas.equilibrium([25.0])[0] == pytest.approx(theory, abs=1e-12)


def test_bad_inputs_are_refused():
    tcas = LoadedTcas([TCA], Load.weight(MASS))
    rest = tcas.rest()
    for dt in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="dt"):
            tcas.step(rest, Heating(), dt)
    with pytest.raises(ValueError, match="motion"):
        tcas.step(rest, Heating(), 0.1, "fast")
    with pytest.raises(ValueError, match="source"):
        Heating(source="heat")
    for value in (-1.0, math.nan, math.inf, [1.0, math.nan]):
        with pytest.raises(ValueError, match="value"):
            Heating(value=value)
    assert Heating(source="voltage", value=-2.0).power(2.0) == 2.0
    for air in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="air"):
            Heating(air=air)
    for name in ("force", "stiffness", "reference", "mass", "damping"):
        for value in (-1e-9, math.nan, math.inf):
            with pytest.raises(ValueError, match=name):
                Load(**({"force": 0.1} | {name: value}))
    with pytest.raises(ValueError, match="mass"):
        Load.weight(math.nan)
    with pytest.raises(ValueError, match="mass"):
        LoadedTcas([TCA], Load(force=0.3)).step(rest, Heating(), 0.1)
    with pytest.raises(ValueError, match="specs"):
        LoadedTcas([], Load(force=0.1))
    with pytest.raises(ValueError, match="too large"):
        LoadedTcas([TCA], Load.weight(50.0)).rest()
    with pytest.raises(ValueError, match="temperature"):
        tcas.equilibrium([math.nan])
    with pytest.raises(ValueError, match="moves too fast"):
        tcas.simulate(state_of(0.05, velocity=-20.0), Heating(), 1e-2, 5)
    assert issubclass(MotionSolveError, ArithmeticError)
    assert issubclass(CoilSolveError, ArithmeticError)


def test_a_law_that_falls_is_an_error_and_not_a_length():
    def law(length, _):
        return np.where(length < 0.06, 0.5, 0.1), np.full_like(length, math.nan)

    with pytest.raises((MotionSolveError, ValueError)):
        LoadedTcas([TCA], Load(force=0.3), law=law).rest()


def test_the_default_law_is_the_rod_with_locked_ends():
    own = LoadedTcas([TCA], Load.weight(MASS))
    given = LoadedTcas([TCA], Load.weight(MASS), law=CoilRods([TCA]).tension)
    heating = Heating(value=1.0)
    np.testing.assert_array_equal(
        own.step(own.rest(), heating, 0.01).length, given.step(given.rest(), heating, 0.01).length
    )

"""The bistable module against the elastica with its band, and its snap against small steps."""

import math
from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tca_mj.certify.cases import Case, at_rest, gap, theory
from tca_mj.certify.rest import Load
from tca_mj.certify.subjects import SUBJECTS, read
from tca_mj.modules.bistable import BistableSpec, bistable_module, shaped
from tca_mj.sim import Simulation
from tca_mj.tca import law_at
from tca_mj.validation.bistable import snap, triggering

SPEC = BistableSpec()
HOLD = SPEC.stiffness / SPEC.offset  # tension that bends the module by a radian [N]


def at(angle, **more):
    """The module with a spine of so many degrees."""
    return replace(SPEC, angle=math.radians(angle), **more)


@cache
def thresholds(angle):
    return at(angle).rod.thresholds(SPEC.offset)


def test_the_band_is_the_one_that_was_fitted():
    """To the zero of F_t2 at 100 degrees: this proves nothing, it keeps the constant true."""
    assert math.degrees(thresholds(0.0).second / HOLD) == pytest.approx(100.0, abs=0.1)
    arc = SPEC.rod.thresholds(SPEC.offset, lumped=True)
    assert arc.second / HOLD < thresholds(50.0).second / HOLD  # the arc is the stiffer guess


@pytest.mark.parametrize("angle", [30.0, 50.0, 75.0])
def test_triggering_forces_of_theory_are_lines_over_the_angle(angle):
    straight, bent = thresholds(0.0), thresholds(angle)
    assert bent.second - straight.second == pytest.approx(-HOLD * math.radians(angle), rel=1e-5)
    assert bent.first - straight.first == pytest.approx(HOLD * math.radians(angle), rel=1e-5)


@pytest.mark.parametrize("force", [(0.0, 0.0), (-0.05, 0.02)])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_states_of_theory_are_in_balance(force, which):
    """Section by section, from the base on: curvature times EI is the moment of what pulls."""
    rod = replace(SPEC.rod, force=force)
    tip = np.array(rod.tip(rod.states()[which]))
    chord = float(np.hypot(*tip))
    x, z = force - max(0.0, 1.0 - rod.band_length / chord) * rod.band * tip
    bending = rod.stiffness * rod.length

    def slope(_, state):
        moment = x * (tip[1] - state[1]) - z * (tip[0] - state[0])
        turn = rod.angle / rod.length + moment / bending
        return [math.sin(state[2]), math.cos(state[2]), turn]

    end = solve_ivp(slope, (0.0, rod.length), [0.0, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:2, -1]
    assert end == pytest.approx(tip, abs=1e-7)


def test_landscapes_have_the_published_kinds():
    two = at(0.0).rod.states()
    assert len(two) == 3 and two[0] == pytest.approx(-two[2]) and abs(two[1]) < 1e-6
    rod = SPEC.rod
    first, top, second = rod.states()
    assert rod.energy(top) - rod.energy(first) < 0.3 * (rod.energy(top) - rod.energy(second))
    assert len(at(105.0).rod.states()) == 1
    # A cable does the work of the landscape.
    bends = np.linspace(first, top, 61)
    work = np.trapezoid([rod.moment(float(bend)) for bend in bends], bends)
    assert work == pytest.approx(rod.energy(top) - rod.energy(first), rel=1e-3)


@pytest.mark.parametrize("angle", [45.0, 75.0])
def test_triggering_forces_in_mujoco_are_those_of_theory(angle):
    for to in (1, 2):
        force = triggering(at(angle), to)
        assert force == pytest.approx(thresholds(angle)[to - 1], rel=0.02)


def test_beyond_a_hundred_degrees_there_is_one_state():
    assert triggering(at(103.0), 2) == 0.0


def test_friction_of_the_cable_asks_for_more():
    """As theory with Euler's law along the channel says; the whole way turns by some radians."""
    rubbed = at(45.0, friction=0.3)
    expected = rubbed.rod.thresholds(SPEC.offset, friction=0.3).second
    assert expected > 1.1 * thresholds(45.0).second
    assert triggering(rubbed, 2) == pytest.approx(expected, rel=0.03)


def test_the_snap_is_that_of_small_steps():
    coarse, fine = snap(SPEC, 5e-4), snap(SPEC, 5e-5)
    assert coarse.speed == pytest.approx(fine.speed, rel=0.03)
    assert coarse.time == pytest.approx(fine.time, rel=0.03)
    assert coarse.lost == pytest.approx(coarse.freed, rel=0.03)
    # The integrator of the other models damps it.
    damped = snap(SPEC, 5e-4, int(mujoco.mjtIntegrator.mjINT_DISCRETE))
    assert damped.speed < 0.96 * fine.speed and damped.lost < 0.95 * damped.freed


@pytest.mark.parametrize("temperature", [25.0, 80.0, 120.0])
@pytest.mark.parametrize("force", [0.0, 0.05])
def test_the_module_rests_where_theory_says(temperature, force):
    """State 2, its TCA hot, a weight on the tip: within 1 % of the length."""
    part = bistable_module(SPEC)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    end = part.spec.site("tip").parent.add_body(name="end", pos=part.spec.site("tip").pos)
    end.ipos, end.mass, end.inertia, end.explicitinertial = [0.0] * 3, 1e-9, [1e-15] * 3, 1
    sim = Simulation(part, timestep=5e-4, tca_period=1e-2)

    def place(data):
        data.qpos[:] = shaped(SPEC, 2.0)
        data.xfrc_applied[sim.model.body("end").id, 0] = -force

    sim.reset(place)
    sim.step(sim.keep([25.0, temperature]), 1.0)
    tip = sim.data.site("tip").xpos[[0, 2]]
    rod = replace(SPEC.rod, force=(-force, 0.0))
    moment = 2.0 * SPEC.offset * float(sim.tension @ [-1.0, 1.0])  # of two legs each
    bend = brentq(lambda angle: rod.moment(angle) - moment, 1.0, 2.9)
    assert tip == pytest.approx(rod.tip(bend), abs=0.01 * SPEC.length)
    assert sim.tension[1] > 0.05 or temperature < 100.0


@pytest.mark.parametrize(
    ("name", "hot"), [("bistable-1", [80.0, 25.0]), ("bistable-2", [80.0, 110.0])]
)
def test_theory_with_stretch_and_the_elastica_agree(name, hot):
    """The body of any strain with a spring, by least energy, and the plane sum of polynomials."""
    subject = SUBJECTS[name]()
    still = np.zeros((1, 3))
    load = Load(force=still + [0.01, 0.0, 0.0], moment=still, gravity=np.zeros(3))
    case = Case(temperature=np.array(hot), posture="hanging", load=load)
    found = theory(subject, case)
    ((_, _, x), _, (_, _, z)) = found.rotation[0]
    bend = float(np.arctan2(x, z))
    rod = replace(SPEC.rod, force=(0.01, 0.0))
    assert (bend < -0.5) == (name == "bistable-1")
    assert found.position[0, [0, 2]] == pytest.approx(rod.tip(bend), abs=1e-5)
    moment = 2.0 * SPEC.offset * float(found.tension @ [-1.0, 1.0])
    assert rod.moment(bend) == pytest.approx(moment, abs=0.01 * abs(moment) + 5e-6)
    apart = gap(subject, at_rest(subject, case, near="energy"), found)
    assert 1e-6 < apart.position < 0.01


def test_a_band_that_is_not_as_built_is_seen():
    """The model's band is what theory gets of it; its elastica knows the specification's."""
    part = bistable_module(SPEC)
    part.spec.tendon("band").stiffness = [1.05 * SPEC.band, 0.0, 0.0]
    (segment,) = read(part, what="").limbs([0.0, 0.0])[0].segments
    (spring,) = segment.springs
    assert spring.stiffness == pytest.approx(1.05 * SPEC.band)
    assert spring.length == SPEC.band_length and spring.start == spring.end == (0.0, 0.0, 0.0)


def triggers(spec, temperature):
    """Least moment of a U over what the module asks of it, on its way from state 2 to the top."""
    first, top, second = spec.rod.states()
    tca = spec.embedded.of_length(2.0 * spec.length + spec.slack)
    law, cold = law_at(tca, temperature), law_at(tca, 25.0)
    shares = []
    for bend in np.linspace(top + 0.1, second - 0.1, 21):
        way = 2.0 * spec.offset * float(bend)
        pull = law(2.0 * spec.length + way)[0] - max(0.0, cold(2.0 * spec.length - way)[0])
        shares.append(-2.0 * spec.offset * pull / spec.rod.moment(float(bend)))
    return min(shares)


def test_a_safe_tca_triggers_both_states():
    """As it did; with a spine that is left half as wide again it could not."""
    assert 1.1 < triggers(SPEC, 172.0) < 1.15
    assert triggers(replace(SPEC, window=0.6), 172.0) < 0.95
    assert SPEC.rod.thresholds(SPEC.offset).second < SPEC.rod.thresholds(SPEC.offset).first
    # One that is weaker by a fifth does not open it below 180 °C, at which the tasks end.
    assert 0.8 * triggers(SPEC, 180.0) < 0.96 < 0.86 * triggers(SPEC, 172.0)


def test_slack_is_what_the_tca_is_longer_by():
    part = bistable_module(SPEC)
    sim = Simulation(part)
    assert [tca.spec.rest_length for tca in part.tcas] == pytest.approx([94e-3, 94e-3])
    sim.data.qpos[:] = 0.0
    assert sim.length == pytest.approx([90e-3, 90e-3], abs=2e-4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"offset": 3.9e-3}, r"offset must be .* at most 0\.0033"),
        ({"band_length": 46e-3}, r"band_length must be .* below 0\.045"),
        ({"bodies": 3}, r"bodies must be one of \(1, 2\), got 3"),
        ({"motions": ("twist",)}, r"motions must contain 'bend_y'"),
        ({"angle": 50.0}, r"angle must be .* rad"),
    ],
)
def test_bad_modules_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        BistableSpec(**given)

"""Morphing modules that twist and that bend to any side: balance, kept and recovered shapes."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tca_mj import (
    Morphing3dSpec,
    Simulation,
    TwistMorphingSpec,
    morphing_3d_module,
    twist_morphing_module,
)
from tca_mj.certify.rest import Load, rest
from tca_mj.certify.solid import solid
from tca_mj.modules import square_spine
from tca_mj.rod import torsion_constant
from tca_mj.smp import HeaterSpec, SpineSpec, fixity, recovery
from tca_mj.tca import law_at

TWIST, SPACE = TwistMorphingSpec(), Morphing3dSpec()
SMP = TWIST.spine.smp
SOFT, COLD = 120.0, 25.0
G = 9.81


class Bench:
    """A weightless module in a simulation."""

    def __init__(self, spec):
        self.spec = spec
        self.build = twist_morphing_module if isinstance(spec, TwistMorphingSpec) else (
            morphing_3d_module)  # fmt: skip
        part = self.build(spec)
        part.spec.option.gravity = [0.0, 0.0, 0.0]
        self.sim = Simulation(part, timestep=5e-3, tca_period=0.1)
        self.tip = self.sim.model.body("tip").id

    def soften(self):
        """25 V until it is soft, then 9.5 V, which hold 120 °C."""
        self.sim.step(np.zeros(self.sim.n), 6.0, voltage=25.0)
        self.sim.step(np.zeros(self.sim.n), 1.0, voltage=9.5)
        return self

    def hold(self, temperature, seconds=25.0):
        """TCAs that have been at temperatures for long, until nothing moves."""
        self.power = self.sim.keep(temperature)
        self.sim.step(self.power, seconds, voltage=9.5)
        assert np.abs(self.sim.data.qvel).max() < 1e-3
        return self

    def harden(self):
        """The TCAs still hold, then are cold: the module is left alone."""
        self.sim.step(self.power, 60.0, fan=True)
        assert self.sim.spines.temperature[0] < 30.0 and not self.sim.spines.damaged.any()
        self.sim.step(self.sim.keep([COLD] * self.sim.n), 2.0)
        assert not self.sim.power.any() and not self.sim.spines.voltage.any()

    @property
    def rotation(self):
        return self.sim.data.xmat[self.tip].reshape(3, 3).copy()

    @property
    def twist(self):
        """About the axis [rad]."""
        return math.atan2(self.rotation[1, 0], self.rotation[0, 0])

    @property
    def bend(self):
        """Where the tip's axis points: how far from the base's, and to which side [rad]."""
        x, y, z = self.rotation[:, 2]
        return math.atan2(math.hypot(x, y), z), math.atan2(y, x)


@cache
def twisted():
    """Soft, turned by 120°."""
    return Bench(TWIST).soften().hold([TWIST.temperature_for(-2.0 * math.pi / 3.0)])


def test_the_torques_of_the_twisted_module_are_in_balance():
    """G J φ/L = 2 F R² (ω - φ/L)/q, q the length of a leg over that of the spine."""
    bench, size = twisted(), TWIST.spine
    modulus = float(SMP.modulus(bench.sim.spines.temperature[0]))
    modulus += 2e-3 * SMP.rubbery * size.second_moment / torsion_constant(3.2e-3, 3.2e-3) * 2.8
    torsion = modulus / 2.8 * torsion_constant(size.width, size.thickness)
    rate, wound = -bench.twist / size.length, 6.0 * math.pi / size.length
    leg = bench.sim.length[0] / 2.0 / size.length
    torque = 2.0 * bench.sim.tension[0] * size.tca_offset**2 * (wound - rate) / leg
    assert torsion * rate == pytest.approx(torque, rel=2e-4)
    assert bench.twist == pytest.approx(-2.0 * math.pi / 3.0, rel=0.01)


def test_it_twists_and_does_not_bend():
    assert twisted().bend[0] < 1e-6
    assert twisted().sim.data.xpos[twisted().tip, :2] == pytest.approx([0.0, 0.0], abs=1e-8)


def test_a_left_handed_helix_is_the_mirror_image():
    bench = Bench(replace(TWIST, turns=-3.0)).soften()
    bench.hold([bench.spec.temperature_for(2.0 * math.pi / 3.0)])
    assert bench.twist == pytest.approx(-twisted().twist, abs=1e-6)


def test_the_twist_is_kept_without_power_and_given_back():
    """1 - E(hot)/E(cold) of it; heated without the TCA, 1 - E_r/E(T) is left."""
    bench = Bench(TWIST).soften().hold([TWIST.temperature_for(-1.5)])
    hot, before = float(bench.sim.spines.temperature[0]), bench.twist
    assert before == pytest.approx(-1.5, rel=0.01)
    bench.harden()
    kept = bench.twist
    assert kept / before == pytest.approx(float(fixity(SMP, hot, COLD)), abs=2e-5)
    bench.sim.step([0.0], 100.0)
    assert bench.twist == pytest.approx(kept, abs=1e-9)
    bench.soften().sim.step([0.0], 30.0, voltage=9.5)
    left = 1.0 - float(recovery(SMP, bench.sim.spines.temperature[0]))
    assert bench.twist / before == pytest.approx(left, rel=0.05)
    assert 0.0 < left < 0.02


@pytest.mark.parametrize(
    ("direction", "angle"), [(0.0, 90.0), (35.0, 120.0), (150.0, 60.0), (-100.0, 90.0)]
)
def test_it_bends_to_the_commanded_side_by_the_commanded_angle(direction, angle):
    """Constant curvature by the balance of moments; at 119.2 °C the spine is stiffer than told."""
    told = SPACE.temperatures(math.radians(direction), math.radians(angle))
    bench = Bench(SPACE).soften().hold(told)
    found, side = (math.degrees(each) for each in bench.bend)
    assert found == pytest.approx(angle, rel=0.01)
    assert side == pytest.approx(direction, abs=0.2)
    assert abs(float(bench.sim.data.qpos.sum())) < 10.0


def test_a_bend_between_two_tcas_is_kept_without_power_and_given_back():
    """The stretched third TCA pulls it straight by a thousandth more than its own springback."""
    bench = Bench(SPACE).soften().hold(SPACE.temperatures(0.6, 1.5))
    hot, (before, side) = float(bench.sim.spines.temperature[0]), bench.bend
    bench.harden()
    kept, now = bench.bend
    own = float(fixity(SMP, hot, COLD))
    assert own - 1e-3 < kept / before < own and now == pytest.approx(side, abs=1e-3)
    bench.soften().sim.step(np.zeros(3), 30.0, voltage=9.5)
    assert bench.bend[0] < 0.02 * before


def test_cold_it_is_as_stiff_to_all_sides_as_the_published_one_in_its_plane():
    """F L²/(2 E I) under 15 g; three TCAs that are just taut or slack add little."""
    sag = float(SpineSpec().sag(15e-3 * G, COLD))
    found = []
    for angle in np.arange(0.0, 2.0 * math.pi, 0.25 * math.pi):
        bench = Bench(SPACE)
        push = 15e-3 * G * np.array([math.cos(angle), math.sin(angle), 0.0])
        bench.sim.data.xfrc_applied[bench.tip, :3] = push
        bench.sim.step(np.zeros(3), 2.0)
        found.append(bench.bend[0])
        assert bench.bend[1] == pytest.approx(math.remainder(angle, 2.0 * math.pi), abs=1e-3)
    assert found == pytest.approx([float(SPACE.spine.sag(15e-3 * G, COLD))] * 8, rel=5e-3)
    assert found[0] == pytest.approx(sag, rel=0.05)


@pytest.mark.parametrize("number", range(3))
def test_any_tca_that_pulls_at_the_stiff_spine_is_damaged(number):
    bench, power = Bench(SPACE), np.zeros(3)
    power[number] = 3.0
    bench.sim.step(power, 0.5)
    assert bench.sim.spines.damaged.tolist() == [True]
    bench.sim.reset()
    bench.sim.step(np.zeros(3), 0.5)
    assert not bench.sim.spines.damaged.any()


def test_the_same_course_has_the_same_bits():
    def course():
        bench = Bench(TWIST)
        bench.sim.step([0.0], 2.0, voltage=25.0)
        bench.sim.step([1.0], 1.0, voltage=25.0)
        return bench.sim.data.qpos.tobytes(), bench.sim.tca.temperature.tobytes()

    assert course() == course()


@pytest.mark.parametrize(
    ("spec", "temperature"), [(TWIST, [110.0]), (SPACE, [130.0, 70.0, 25.0])]
)
def test_the_simulation_of_a_hot_spine_ends_where_the_certified_springs_rest(spec, temperature):
    """What is certified has springs in place of the spine: at its temperature they are the same."""
    bench = Bench(spec).soften().hold(temperature, 40.0)
    springs = solid(bench.build(spec), float(bench.sim.spines.temperature[0])).part
    none = np.zeros((1, 3))
    laws = [law_at(tca.spec, hot) for tca, hot in zip(springs.tcas, temperature, strict=True)]
    end = rest(springs, ["tip"], laws, Load(force=none, moment=none, gravity=np.zeros(3)))
    away = np.linalg.norm(end.position[0] - bench.sim.data.xpos[bench.tip])
    assert away < 1e-4 * spec.spine.length and bench.twist**2 + bench.bend[0] ** 2 > 0.5
    assert end.length == pytest.approx(bench.sim.length, rel=1e-4)


def test_a_cold_module_that_was_fixed_in_a_bend_rests_where_the_certified_springs_do():
    push, bent = np.array([[0.05, -0.02, 0.03]]), (0.9 / 0.115, -1.1 / 0.115, 0.0)
    bench = Bench(SPACE)
    springs = solid(morphing_3d_module(SPACE), COLD, {"spine": bent}).part
    compiled = springs.spec.compile()

    def fix(data):
        for i in range(compiled.njnt):
            place = bench.sim.model.joint(compiled.joint(i).name).qposadr[0]
            data.qpos[place] = compiled.qpos_spring[compiled.jnt_qposadr[i]]

    bench.sim.reset(fix)
    bench.sim.data.xfrc_applied[bench.tip, :3] = push[0]
    bench.sim.step(np.zeros(3), 3.0)
    laws = [law_at(tca.spec, COLD) for tca in springs.tcas]
    load = Load(force=push, moment=np.zeros((1, 3)), gravity=np.zeros(3))
    end = rest(springs, ["tip"], laws, load)
    moved = np.linalg.norm(end.position[0] - bench.sim.data.xpos[bench.tip])
    assert moved < 1e-5 * SPACE.spine.length
    assert end.length == pytest.approx(bench.sim.length, abs=1e-7)


def test_heat_goes_with_the_surface():
    """The published spine cools in its 25 s; one of less section over its perimeter sooner."""
    assert HeaterSpec.alike(SpineSpec()) == HeaterSpec.fitted(SpineSpec())
    square = HeaterSpec.alike(square_spine(60e-3))
    time = float(square.time_to(80.0, 120.0))
    assert time == pytest.approx(25.0 * 0.8 / (6.5 * 2.5 / 18.0), rel=1e-9)
    per_surface = square.loss / (4.0 * 3.2e-3 * 60e-3)
    published = HeaterSpec.fitted(SpineSpec())
    assert per_surface == pytest.approx(published.loss / (2.0 * 9e-3 * 115e-3), rel=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: replace(TWIST, motions=("bend_x",)), "motions must contain 'twist', and turns"),
        (lambda: replace(TWIST, turns=0.0), "motions must contain 'twist', and turns not be 0"),
        (lambda: twist_morphing_module(replace(TWIST, nodes=6)), "at least three sites per turn"),
        (lambda: TWIST.temperature_for(0.5), "angle must be between 0 and -18.85 rad"),
        (lambda: TWIST.temperature_for(-6.0), "force must be at most"),
        (lambda: replace(SPACE, count=2), "count must be at least 3, got 2"),
        (lambda: replace(SPACE, motions=("bend_x",)), "motions must contain 'bend_x' and 'bend_y'"),
        (lambda: SPACE.temperatures(0.0, 5.0), "force must be at most"),
        (lambda: SPACE.temperatures(0.0, -1.0), "angle must be finite and at least 0"),
        (lambda: square_spine(0.0), "length must be finite and above 0, got 0.0"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()

"""Static shapes by the least energy, against closed forms and the balance of every section."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk

from tca_mj.quadrature import GaussRule
from tca_mj.rod import BeamSpec, RodSolveError, Segment
from tca_mj.rod.energy.mesh import Mesh
from tca_mj.rod.energy.motion import Pieces
from tca_mj.rod.energy.potential import Potential
from tca_mj.rod.energy.solver import minimise
from tca_mj.rod.problem import StaticProblem
from tca_mj.routes import Helix, UTurn, parallel

L, A = 45e-3, 4e-3
BODY = BeamSpec.circular(
    length=L, diameter=4.5e-3, young=0.125e6, shear=0.125e6 / 3.0, density=1070.0
)
EI, GJ, EA = BODY.bending[0], BODY.torsion, BODY.stretching
STIFF = replace(BODY, stretching=1e9 * EI / L**2, shearing=1e9 * EI / L**2)
CURVED = replace(BODY, bending=(1.7 * EI, EI), curvature=(12.0, -25.0, 30.0))


def linear(rest, stiffness):
    """Law of a strand that is slack below its rest length."""
    return lambda length: (stiffness * (length - rest), stiffness) if length > rest else (0.0, 0.0)


def shape(routes=(), tensions=(), beam=BODY, points=65, **loads):
    return minimise(
        StaticProblem(segments=[Segment(beam, routes, tensions)], **loads), points=points
    )[0]


def turn_about_axis(one):
    """Integral of the twist along the rod, by Simpson's rule."""
    weight = np.ones(len(one.arc_length))
    weight[1:-1:2], weight[2:-1:2] = 4.0, 2.0
    return weight @ one.strain[:, 2] * (one.arc_length[1] - one.arc_length[0]) / 3.0


@pytest.mark.parametrize("force", [0.01, 0.04, 0.12])
@pytest.mark.parametrize("phase", [0.0, 1.0])
def test_one_straight_strand_bends_the_body_to_an_arc(force, phase):
    one = shape([Helix(A, phase=phase)], [force])
    curvature, stretch = force * A / EI, 1.0 - force / EA
    angle = curvature * one.arc_length
    along = np.array([math.cos(phase), math.sin(phase), 0.0])
    expected = (1.0 - np.cos(angle))[:, None] * along + np.sin(angle)[:, None] * [0.0, 0.0, 1.0]
    assert np.abs(one.position - expected * stretch / curvature).max() < 1e-10 * L
    assert one.tca_length == pytest.approx([L * (stretch - curvature * A)], rel=1e-10)


def test_shapes_known_from_other_solvers():
    """Round silicone rod, d = 4.5 mm, E = 0.125 MPa: tips by two other codes, to 0.01 mm."""
    pushed = shape([Helix(A)], [0.02], tip_force=(0.0, 2e-3, 0.0))
    assert pushed.tip == pytest.approx([22.596e-3, 18.267e-3, 28.046e-3], abs=1e-6)
    assert math.degrees(turn_about_axis(pushed)) == pytest.approx(19.6, abs=0.05)
    wound = shape([Helix(A, 1.0)], [0.02])
    assert wound.tip == pytest.approx([0.672e-3, 11.545e-3, 41.679e-3], abs=1e-6)
    assert math.degrees(turn_about_axis(wound)) == pytest.approx(-56.7, abs=0.05)
    assert shape(parallel(3, A), [0.05] * 3).tip == pytest.approx([0, 0, 41.605e-3], abs=1e-6)


def test_a_tip_moment_winds_the_rod_to_circles():
    one = shape(tip_moment=(0.0, 4.0 * math.pi * EI / L, 0.0))
    angle = 4.0 * math.pi * one.arc_length / L
    circle = np.stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)
    assert np.abs(one.position - circle * L / (4.0 * math.pi)).max() < 1e-9 * L


def test_a_torque_twists_and_a_weight_stretches():
    """u3 = M/GJ; v3 = 1 + (m + density (L - s)) g/EA below a base that holds all."""
    moment, mass, g = 0.9 * GJ / L, 1e-3, 9.81
    segment = Segment(BODY, (), (), mass=mass)
    problem = StaticProblem(segments=[segment], tip_moment=(0, 0, moment), gravity=(0.0, 0.0, g))
    one = minimise(problem)[0]
    s = one.arc_length
    load = mass * s + BODY.line_density * (L * s - s**2 / 2.0)
    assert np.abs(one.position[:, 2] - s - load * g / EA).max() < 1e-11 * L
    assert np.abs(one.rotation[:, 0, 0] - np.cos(moment * s / GJ)).max() < 1e-11
    assert np.abs(one.rotation[:, 1, 0] - np.sin(moment * s / GJ)).max() < 1e-11
    assert one.base_force == pytest.approx([0.0, 0.0, -(mass + BODY.mass) * g], rel=1e-12)
    assert one.base_moment == pytest.approx([0.0, 0.0, -moment], rel=1e-12)


@pytest.mark.parametrize("ratio", [0.98, 1.02, 2.5])
def test_a_column_buckles_at_eulers_load_and_follows_the_elastica(ratio):
    """P/Pc = (2 K/pi)², height (2 E/K - 1) L, modulus sin(half the tip's angle) [Euler]."""
    load = ratio * math.pi**2 * EI / 4.0 / L**2
    one = shape(beam=STIFF, tip_force=(0.0, 0.0, -load))
    if ratio < 1.0:
        assert np.abs(one.tip - [0.0, 0.0, L]).max() < 1e-7 * L
        return
    m = brentq(lambda m: (2.0 * ellipk(m) / math.pi) ** 2 - ratio, 1e-6, 0.999, xtol=1e-15)
    assert one.bend_angle == pytest.approx(2.0 * math.asin(math.sqrt(m)), abs=1e-6)
    assert one.tip[2] == pytest.approx((2.0 * ellipe(m) / ellipk(m) - 1.0) * L, abs=1e-7 * L)


def stress(segment, one, tensions):
    """Moment and force in the sections, in their frames, by the strains: K dxi + F (r x t, t)."""
    beam, s = segment.beam, one.arc_length / segment.beam.length
    stiffness = [*beam.bending, beam.torsion, beam.shearing, beam.shearing, beam.stretching]
    wrench = stiffness * (one.strain - [*beam.curvature, 0.0, 0.0, 1.0])
    for route, tension in zip(segment.routes, tensions, strict=True):
        for leg in route.legs:
            r, slope = np.zeros((len(s), 3)), np.zeros((len(s), 3))
            r[:, :2], slope[:, :2] = leg.offset(s), leg.slope(s) / beam.length
            w = one.strain[:, 3:] + np.cross(one.strain[:, :3], r) + slope
            pull = tension * w / np.linalg.norm(w, axis=1, keepdims=True)
            wrench += np.hstack([np.cross(r, pull), pull])
    return wrench[:, :3], wrench[:, 3:]


def rich_problem(**changes):
    """Two modules, the second one across the tip of the first, with everything on them."""
    first = Segment(
        CURVED, [Helix(A, 1.3), UTurn.parallel(3e-3, 1e-3, 2.0)], [0.012, linear(0.085, 0.6)],
        rotation=Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix(), offset=(1e-3, 2e-3, 3e-3),
        mass=4e-4, centre=(2e-3, 0.0, 3e-3),
    )  # fmt: skip
    second = Segment(
        replace(BODY, length=30e-3), [Helix(A, phase=2.0), Helix(3e-3)],
        [linear(0.02, 0.8), linear(0.06, 0.8)],
        rotation=Rotation.from_rotvec([0.0, 1.2, 0.4]).as_matrix(), offset=(0.0, 3e-3, 2e-3),
        mass=2e-4, centre=(0.0, 1e-3, 2e-3),
    )  # fmt: skip
    loads = {"tip_force": (4e-4, -6e-4, 3e-4), "gravity": (3.0, -2.0, -6.0)}
    return StaticProblem(segments=[first, second], **{**loads, **changes})


@pytest.mark.parametrize("moment", [(0.0, 0.0, 0.0), (1e-5, -2e-5, 1.5e-5)])
def test_every_section_is_in_balance(moment):
    """What the strains and strands carry holds the loads beyond, lump by lump."""
    problem = rich_problem(tip_moment=moment)
    shapes = minimise(problem, points=257)
    assert shapes[1].tca_length[1] < 0.06  # one strand is slack
    force, gravity = np.asarray(problem.tip_force), np.asarray(problem.gravity)
    moment = moment + np.cross(shapes[1].tip, force)  # of all beyond, about the origin
    for segment, one in zip(problem.segments[::-1], shapes[::-1], strict=True):
        centre = one.tip + one.rotation[-1] @ segment.centre
        force = force + segment.mass * gravity
        moment = moment + np.cross(centre, segment.mass * gravity)
        weight = segment.beam.line_density * gravity
        sums = CubicSpline(one.arc_length, one.position).antiderivative()(one.arc_length)
        beyond = sums[-1] - sums
        forces = force + (one.arc_length[-1] - one.arc_length)[:, None] * weight
        moments = moment + np.cross(beyond, weight) - np.cross(one.position, forces)
        tensions = [
            law(length)[0] if callable(law) else law
            for law, length in zip(segment.tensions, one.tca_length, strict=True)
        ]
        carried, pulled = stress(segment, one, tensions)
        to_section = np.swapaxes(one.rotation, 1, 2)
        assert np.abs(pulled - np.einsum("nij,nj->ni", to_section, forces)).max() < 1e-9
        assert np.abs(carried - np.einsum("nij,nj->ni", to_section, moments)).max() < 1e-7 * EI / L
        assert -one.base_force == pytest.approx(forces[0], rel=1e-9)
        force, moment = forces[0], moment + np.cross(beyond[0], weight)
        assert np.abs(one.base_moment + moment).max() < 1e-7 * EI / L


def test_strains_are_those_of_the_frames_and_lengths_those_of_the_curves():
    problem = rich_problem()
    for segment, one in zip(problem.segments, minimise(problem, points=257), strict=True):
        s, back = one.arc_length, np.swapaxes(one.rotation, 1, 2)
        speed = CubicSpline(s, one.position).derivative()(s)
        assert np.abs(np.einsum("nij,nj->ni", back, speed) - one.strain[:, 3:]).max() < 1e-5
        spin = back @ CubicSpline(s, one.rotation).derivative()(s)
        bent = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        assert np.abs(bent - one.strain[:, :3]).max() < 1e-5 * np.abs(one.strain).max()
        assert np.abs(back @ one.rotation - np.eye(3)).max() < 1e-12
        for route, length in zip(segment.routes, one.tca_length, strict=True):
            measured = 0.0
            for leg in route.legs:
                offset = np.zeros((len(s), 3))
                offset[:, :2] = leg.offset(s / segment.beam.length)
                curve = one.position + np.einsum("nij,nj->ni", one.rotation, offset)
                density = np.linalg.norm(CubicSpline(s, curve).derivative()(s), axis=1)
                measured += CubicSpline(s, density).integrate(0.0, s[-1])
            assert measured == pytest.approx(length, rel=1e-6)


def test_a_rod_cut_in_two_is_the_same_rod():
    beam, half = CURVED, replace(CURVED, length=0.4 * L)
    rest = replace(CURVED, length=0.6 * L)
    loads = {"tip_force": (1e-3, -5e-4, 0.0), "gravity": (0.0, 3.0, -9.0)}
    whole = shape([Helix(A, 1.5, 0.3)], [0.02], beam=beam, points=6, **loads)
    cut = minimise(
        StaticProblem(
            segments=[
                Segment(half, [Helix(A, 0.6, 0.3)], [0.02]),
                Segment(rest, [Helix(A, 0.9, 0.3 + 1.2 * math.pi)], [0.02]),
            ],
            **loads,
        ),
        points=2,
    )
    assert np.abs(cut[0].tip - whole.position[2]).max() < 1e-10 * L
    assert np.abs(cut[1].tip - whole.tip).max() < 1e-10 * L
    assert np.abs(cut[1].rotation[-1] - whole.rotation[-1]).max() < 1e-9
    assert cut[0].tca_length + cut[1].tca_length == pytest.approx(whole.tca_length, rel=1e-10)
    assert cut[0].base_moment == pytest.approx(whole.base_moment, rel=1e-9)


def test_turning_the_world_turns_the_shape():
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    straight, turned = rich_problem(), rich_problem()
    first, second = turned.segments
    first = replace(first, rotation=turn @ first.rotation, offset=turn @ first.offset)
    turned = StaticProblem(
        segments=[first, second],
        tip_force=turn @ turned.tip_force,
        gravity=turn @ turned.gravity,
    )
    one, other = minimise(straight)[1], minimise(turned)[1]
    assert np.abs(other.position - one.position @ turn.T).max() < 1e-10 * L
    assert np.abs(other.base_moment - turn @ one.base_moment).max() < 1e-9 * EI / L


def test_a_law_gives_the_shape_of_the_tension_that_it_ends_at():
    routes, law = [UTurn.double_helix(A, 1.2)], linear(0.08, 0.4)
    one = shape(routes, [law], beam=CURVED)
    tension = law(one.tca_length[0])[0]
    assert 0.004 < tension < 0.05
    assert np.abs(shape(routes, [tension], beam=CURVED).tip - one.tip).max() < 1e-10 * L
    slack = shape(routes, [linear(0.2, 0.4)], beam=CURVED, tip_force=(1e-3, 0.0, 0.0))
    none = shape(beam=CURVED, tip_force=(1e-3, 0.0, 0.0))
    assert np.abs(slack.tip - none.tip).max() < 1e-10 * L


def test_without_shear_the_rod_is_the_limit_of_great_shear_stiffness():
    routes, tensions = [Helix(A, 0.7), UTurn.parallel(3e-3, 1e-3)], [0.02, 0.01]
    loads = {"tip_force": (0.0, 2e-3, -1e-3), "tip_moment": (1e-5, 0.0, 0.0)}
    one = shape(routes, tensions, shearable=False, **loads)
    assert not one.strain[:, 3:5].any()
    gaps = []
    for stiffness in (1e3, 1e4):
        limit = replace(BODY, shearing=stiffness * BODY.shearing)
        gaps.append(np.abs(shape(routes, tensions, beam=limit, **loads).tip - one.tip).max())
    assert gaps[1] < 1e-6 * L
    assert gaps[0] / gaps[1] == pytest.approx(10.0, rel=0.01)


def test_twice_the_stiffness_under_twice_the_load_has_the_same_shape():
    stiff = replace(
        BODY,
        bending=(2 * EI, 2 * EI),
        torsion=2 * GJ,
        stretching=2 * EA,
        shearing=2 * BODY.shearing,
    )
    one = shape([Helix(A, 1.0)], [0.03], tip_force=(0.0, 1e-3, 0.0))
    two = shape([Helix(A, 1.0)], [0.06], beam=stiff, tip_force=(0.0, 2e-3, 0.0))
    assert np.abs(one.position - two.position).max() < 1e-11 * L


def random_state(moment=(0.0, 0.0, 0.0), shearable=True):
    rng = np.random.default_rng(5)
    problem = rich_problem(tip_moment=moment, shearable=shearable)
    potential = Potential(problem, Mesh([np.array([0.0, 0.3, 1.0]), np.array([0.0, 1.0])]))
    strain = potential.unloaded + 0.2 * rng.normal(size=potential.unloaded.shape)
    return potential, strain, rng.normal(size=strain.shape)


@pytest.mark.parametrize("moment", [(0.0, 0.0, 0.0), (2e-4, -3e-4, 4e-4)])
@pytest.mark.parametrize("shearable", [True, False])
def test_gradient_and_hessian_are_derivatives_of_the_energy(moment, shearable):
    potential, strain, way = random_state(moment, shearable)
    state = potential.at(strain, 0.7)
    up, down = potential.at(strain + 1e-5 * way, 0.7), potential.at(strain - 1e-5 * way, 0.7)
    slope = np.sum(potential.gradient(state) * way)
    assert potential.change(down, up) / 2e-5 == pytest.approx(slope, rel=1e-7)
    hessian, twist = potential.hessian(state)
    change = (potential.gradient(up) - potential.gradient(down)).ravel() / 2e-5
    exact = (hessian + twist) @ way.ravel()
    assert np.abs(change - exact).max() < 1e-7 * np.abs(exact).max()
    assert np.abs(hessian - hessian.T).max() < 1e-12 * np.abs(hessian).max()
    assert np.abs(twist + twist.T).max() <= 1e-15 and bool(twist.any()) == (
        not potential.conservative
    )


def test_the_energy_is_least_at_rest():
    problem = rich_problem()
    mesh = Mesh([np.linspace(0.0, 1.0, 4)] * 2)
    potential, size = Potential(problem, mesh), sum(each.beam.length for each in problem.segments)
    strain = np.concatenate(
        [
            CubicSpline(one.arc_length / one.arc_length[-1], one.strain)(mesh.points(index))
            for index, one in enumerate(minimise(problem, points=257))
        ]
    ) * ([size] * 3 + [1.0] * 3)
    rest, rng = potential.at(strain, 1.0), np.random.default_rng(1)
    for _ in range(20):
        way = rng.normal(size=strain.shape) * 10.0 ** rng.uniform(-2.5, -0.5)
        assert potential.change(rest, potential.at(strain + way, 1.0)) > 0.0


def test_frames_have_twice_the_order_of_the_points():
    """Gauss's method: error over one piece of step h as h^(2 q + 1), here q = 3, to a circle."""
    rule, errors = GaussRule.of(3), []
    for angle in (1.0, 0.5):
        strain = np.tile([0.3, 0.8, -0.5, 0.1, 0.2, 1.0], (1, 3, 1))
        motion = Pieces.of(rule, np.array([angle]), strain, np.array([0.0])).motion[0]
        exact = Rotation.from_rotvec(angle * strain[0, 0, :3]).as_matrix()
        errors.append(np.abs(motion[:3, :3] - exact).max())
        assert np.abs(motion[:3, :3] @ motion[:3, :3].T - np.eye(3)).max() < 1e-14
    assert math.log2(errors[0] / errors[1]) == pytest.approx(7.0, abs=0.3)


def test_what_has_no_solution_is_refused_with_the_residual():
    with pytest.raises(RodSolveError, match="shortens to nothing") as caught:
        shape([Helix(A)], [1.5 * EI / A**2])
    assert caught.value.residual > 1e-6
    kinked = SimpleNamespace(
        offset=lambda s: np.stack([A * np.sign(np.abs(s - 0.45) - 0.14), 0.0 * np.asarray(s)], -1),
        slope=lambda s: np.zeros((*np.shape(s), 2)),
    )
    with pytest.raises(RodSolveError, match="not smooth"):
        shape([SimpleNamespace(legs=(kinked,))], [0.01])

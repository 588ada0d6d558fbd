"""Routes of TCAs: closed-form lengths, hands and phases."""

import math

import numpy as np
import pytest

from tca_mj.routes import Helix, UTurn, leg_length, parallel

LENGTH, RADIUS = 45e-3, 4e-3


def total(route, curvature=(0.0, 0.0, 0.0)):
    return sum(leg_length(leg, LENGTH, curvature) for leg in route.legs)


def test_a_parallel_route_is_as_long_as_the_body():
    assert total(Helix(RADIUS, phase=0.7)) == pytest.approx(LENGTH, rel=1e-14)


@pytest.mark.parametrize("turns", [-3.0, 0.25, 1.0, 5.0])
def test_a_helix_is_an_unrolled_triangle(turns):
    """sqrt(L² + (2π n a)²)."""
    theory = math.hypot(LENGTH, 2.0 * math.pi * turns * RADIUS)
    assert total(Helix(RADIUS, turns)) == pytest.approx(theory, rel=1e-14)


def test_a_folded_tca_is_as_long_as_its_two_legs():
    u = UTurn.parallel(2.5e-3, 0.8e-3)
    assert total(u) == pytest.approx(2.0 * LENGTH, rel=1e-14)
    double = UTurn.double_helix(RADIUS, 2.5)
    assert total(double) == pytest.approx(2.0 * total(Helix(RADIUS, 2.5)), rel=1e-14)


@pytest.mark.parametrize("bend", [-180.0, -40.0, 90.0])
@pytest.mark.parametrize("phase", [0.0, 1.0, math.pi / 2.0, math.pi])
def test_a_parallel_route_in_a_bent_body_is_an_arc(bend, phase):
    """Bent about y by u, the fibre at x has the radius 1/u - x, and y makes no difference."""
    theory = LENGTH * (1.0 - bend * RADIUS * math.cos(phase))
    assert total(Helix(RADIUS, phase=phase), (0.0, bend, 0.0)) == pytest.approx(theory, rel=1e-13)


def test_bending_about_x_shortens_what_lies_at_negative_y():
    """The same about the other axis: 1 + u_x y."""
    route = Helix(RADIUS, phase=-math.pi / 2.0)
    assert total(route, (40.0, 0.0, 0.0)) == pytest.approx(LENGTH * (1.0 - 40.0 * RADIUS))


def test_reference_twist_adds_to_the_turns_of_a_helix():
    """A parallel route in a body twisted by τ is a helix of τ L / 2π turns; a helix unwinds."""
    twist = 2.0 * math.pi * 2.0 / LENGTH
    wound = total(Helix(RADIUS, 2.0))
    assert total(Helix(RADIUS), (0.0, 0.0, twist)) == pytest.approx(wound, rel=1e-13)
    assert total(Helix(RADIUS, -2.0), (0.0, 0.0, twist)) == pytest.approx(LENGTH, rel=1e-13)


def test_a_helix_in_a_bent_body_against_its_integral():
    """sqrt((1 - u a cos φ)² + (2π n a / L)²), integrated with another rule."""
    bend, turns = 60.0, 3.0
    nodes, weights = np.polynomial.legendre.leggauss(60)
    s = (nodes + 1.0) / 2.0
    axial = 1.0 - bend * RADIUS * np.cos(2.0 * np.pi * turns * s)
    around = 2.0 * np.pi * turns * RADIUS / LENGTH
    theory = LENGTH * float(weights @ np.hypot(axial, around)) / 2.0
    assert total(Helix(RADIUS, turns), (0.0, bend, 0.0)) == pytest.approx(theory, rel=1e-12)


def test_positive_turns_are_right_handed():
    """Going up, a right-handed helix turns from x towards y."""
    quarter = Helix(RADIUS, 1.0).offset(0.25)
    assert quarter == pytest.approx([0.0, RADIUS], abs=1e-17)
    assert Helix(RADIUS, -1.0).offset(0.25) == pytest.approx([0.0, -RADIUS], abs=1e-17)


def test_the_phase_is_the_angle_at_the_base():
    phase = 0.3
    start = RADIUS * np.array([math.cos(phase), math.sin(phase)])
    assert Helix(RADIUS, 2.0, phase).offset(0.0) == pytest.approx(start, rel=1e-14)


def test_the_slope_is_the_derivative_of_the_offset():
    helix, s, step = Helix(RADIUS, 1.5, 0.4), np.linspace(0.1, 0.9, 9), 1e-6
    numeric = (helix.offset(s + step) - helix.offset(s - step)) / (2.0 * step)
    assert helix.slope(s) == pytest.approx(numeric, rel=1e-8, abs=1e-10)
    assert helix.offset(s).shape == helix.slope(s).shape == (9, 2)


@pytest.mark.parametrize("direction", [0.0, 2.0])
def test_the_legs_of_a_u_lie_where_they_are_told(direction):
    out, back = UTurn.parallel(2.5e-3, 0.8e-3, direction).legs
    along = np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    assert out.offset(0.5) == pytest.approx(2.5e-3 * along - 0.8e-3 * across, abs=1e-17)
    assert back.offset(0.5) == pytest.approx(2.5e-3 * along + 0.8e-3 * across, abs=1e-17)


def test_the_legs_of_a_double_helix_face_each_other():
    out, back = UTurn.double_helix(RADIUS, 2.5, 0.2).legs
    s = np.linspace(0.0, 1.0, 7)
    assert out.offset(s) == pytest.approx(-back.offset(s), abs=1e-16)
    assert out.turns == back.turns == 2.5


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_parallel_routes_stand_at_equal_angles(count):
    routes = parallel(count, RADIUS, phase=0.1)
    points = np.array([route.offset(0.0) for route in routes])
    assert len(routes) == count
    assert routes[0].phase == 0.1
    if count > 1:
        assert points.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-17)
        gaps = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
        assert gaps == pytest.approx(2.0 * RADIUS * math.sin(math.pi / count), rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Helix(-1e-3), r"radius must be finite and at least 0, got -0\.001"),
        (lambda: Helix(math.nan), "radius must be finite and at least 0, got nan"),
        (lambda: Helix(1e-3, math.inf), "turns must be finite .* got inf"),
        (lambda: Helix(1e-3, phase=math.nan), "phase must be finite and at least -1000"),
        (lambda: UTurn.parallel(1e-3, -1e-3), r"half_width must be .* at least 0 m, got -0\.001"),
        (lambda: UTurn.parallel(1e-3, math.nan), "half_width must be .* got nan"),
        (lambda: parallel(0, 1e-3), "count must be at least 1, got 0"),
    ],
)
def test_bad_routes_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()

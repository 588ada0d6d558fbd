"""Static shapes of soft bodies with strands: closed forms, elastica, work, balance, symmetry."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import quad, simpson, solve_bvp
from scipy.optimize import brentq, fsolve
from scipy.special import ellipk, ellipkinc

from tca_mj.rod import BeamSpec, RodSolveError, Segment, solve_series, solve_static
from tca_mj.rod.lie import quaternion_exp, quaternion_matrix, screw_translation
from tca_mj.routes import Helix, UTurn, leg_length, parallel

E, G, LENGTH, OFFSET = 0.125e6, 0.125e6 / 3.0, 45e-3, 4e-3
BODY = BeamSpec.circular(length=LENGTH, diameter=4.5e-3, young=E, shear=G, density=1070.0)
EI, EA = BODY.bending[0], BODY.stretching
RIGID = replace(BODY, stretching=1e7 * EA, shearing=1e7 * BODY.shearing)  # bends and twists only
SPOT = Helix(OFFSET)
GRAVITY = np.array([1.0, 2.0, -9.81])


@dataclass(frozen=True)
class Cord:
    """An elastic strand that goes slack, a StrandLaw."""

    stiffness: float
    rest: float

    def __call__(self, length):
        taut = length > self.rest
        return (self.stiffness * (length - self.rest), self.stiffness) if taut else (0.0, 0.0)


@dataclass(frozen=True)
class Spiral:
    """A route that is none of the library's: radius and angle are curved functions of s."""

    radius: float = 2e-3
    growth: float = 1.5e-3
    turns: float = 1.2

    @property
    def legs(self):
        return (self,)

    def offset(self, s):
        s = np.asarray(s)
        radius, angle = self.radius + self.growth * s**2, 2.0 * np.pi * self.turns * s**2
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

    def slope(self, s):
        s = np.asarray(s)
        x, y = np.moveaxis(self.offset(s), -1, 0)
        grow, turn = 2.0 * self.growth * s / np.hypot(x, y), 4.0 * np.pi * self.turns * s
        return np.stack([grow * x - turn * y, grow * y + turn * x], axis=-1)


@dataclass(frozen=True)
class Kinked:
    """Two straight pieces from one point to another and on to a third."""

    points: tuple
    kink: float

    @property
    def legs(self):
        return (self,)

    def offset(self, s):
        x, y = np.array(self.points).T
        at = [0.0, self.kink, 1.0]
        return np.stack([np.interp(s, at, x), np.interp(s, at, y)], axis=-1)

    def slope(self, s):
        a, b, c = np.array(self.points)
        before = (np.asarray(s) < self.kink)[..., None]
        return np.where(before, (b - a) / self.kink, (c - b) / (1.0 - self.kink))


def mm(*values):
    return pytest.approx(np.array(values) * 1e-3, abs=5.1e-7)


def close(expected, size=LENGTH, tolerance=1e-9):
    return pytest.approx(np.asarray(expected), rel=0.0, abs=tolerance * size)


# Numbers of independent implementations.


@pytest.mark.parametrize(
    ("tension", "tip", "angle"),
    [
        (0.01, (15.344, 0.0, 41.051), 41.0),
        (0.02, (26.790, 0.0, 30.830), 82.0),
        (0.04, (30.218, 0.0, 4.259), 164.0),
    ],
)
def test_one_straight_strand_against_published_numbers(tension, tip, angle):
    shape = solve_static(BODY, [SPOT], [tension])
    assert shape.tip == mm(*tip)
    assert math.degrees(shape.bend_angle) == pytest.approx(angle, abs=0.05)


def turned_about_the_axis(shape):
    return math.degrees(simpson(shape.strain[:, 2], x=shape.arc_length))


def test_a_load_across_against_published_numbers():
    shape = solve_static(BODY, [SPOT], [0.02], tip_force=(0.0, 2e-3, 0.0))
    assert shape.tip == mm(22.596, 18.267, 28.046)
    assert turned_about_the_axis(shape) == pytest.approx(19.6, abs=0.05)


def test_helices_against_published_numbers():
    one = solve_static(BODY, [Helix(OFFSET, 1.0)], [0.02])
    assert one.tip == mm(0.672, 11.545, 41.679)
    assert turned_about_the_axis(one) == pytest.approx(-56.7, abs=0.05)
    five = solve_static(replace(BODY, length=16e-3), [Helix(3.5e-3, 5.0)], [0.02])
    assert five.tip == mm(0.0035, 0.0438, 15.9755)


# Strands alone: the wrench in every section is zero, so the strain follows from algebra.


@pytest.mark.parametrize("phase", [0.0, 0.8, 4.0])
def test_a_straight_strand_bends_into_an_arc(phase):
    """Curvature F a/EI, stretch 1 - F/EA: exact, because |w| is linear in them."""
    force = 0.05
    shape = solve_static(BODY, [Helix(OFFSET, phase=phase)], [force])
    curvature, stretch = force * OFFSET / EI, 1.0 - force / EA
    angle = curvature * LENGTH
    radius = stretch / curvature
    plane = np.array([math.cos(phase), math.sin(phase), 0.0])
    tip = radius * ((1.0 - math.cos(angle)) * plane + [0.0, 0.0, math.sin(angle)])
    assert shape.tip == close(tip)
    assert shape.strain[:, 5] == pytest.approx(stretch, rel=1e-12)
    assert shape.tca_length[0] == close(LENGTH * (stretch - curvature * OFFSET))


def test_three_equal_strands_shorten_and_do_not_bend():
    shape = solve_static(BODY, parallel(3, OFFSET, 0.3), [0.05] * 3)
    assert shape.tip == close([0.0, 0.0, LENGTH * (1.0 - 0.15 / EA)], tolerance=1e-12)
    assert shape.tip[2] == pytest.approx(41.605e-3, abs=5e-7)


def test_straight_strands_in_a_box_curved_at_rest():
    """Each principal axis by itself; then the body is a helix, a motion of constant strain."""
    box = BeamSpec.box(length=35e-3, width=6e-3, height=3e-3, young=E, shear=G, density=1070.0,
                       curvature=(20.0, -30.0, 40.0))  # fmt: skip
    # At the corner of a body with twist a strand is no longer straight: on the axis it is.
    shape = solve_static(box, [Helix(0.0)], [0.03])
    angular, linear = np.array(box.curvature), np.array([0.0, 0.0, 1.0 - 0.03 / box.stretching])
    assert shape.tip == close(screw_translation(angular * 35e-3, linear * 35e-3), 35e-3)
    assert shape.rotation[-1] == pytest.approx(
        quaternion_matrix(quaternion_exp(angular * 35e-3)), abs=1e-9
    )
    flat = replace(box, curvature=(20.0, -30.0, 0.0))
    x, y, force = 1.5e-3, 0.7e-3, 0.03
    bent = solve_static(flat, [Helix(math.hypot(x, y), phase=math.atan2(y, x))], [force])
    assert bent.strain[:, 0] == pytest.approx(20.0 - force * y / flat.bending[0], rel=1e-10)
    assert bent.strain[:, 1] == pytest.approx(-30.0 + force * x / flat.bending[1], rel=1e-10)


@pytest.mark.parametrize("turns", [2.5, -1.5])
def test_a_double_helix_twists_and_shortens(turns):
    """GJ u3 = -2 F dl/du3, EA (v3 - 1) = -2 F dl/dv3 with l = sqrt(v3² + a² (u3 + 2 pi n/L)²)."""
    force, wind = 0.02, 2.0 * math.pi * turns / LENGTH

    def rest(strain):
        twist, stretch = strain
        density = math.hypot(stretch, OFFSET * (twist + wind))
        return [
            BODY.torsion * twist / OFFSET**2 + 2.0 * force * (twist + wind) / density,
            EA * (stretch - 1.0) + 2.0 * force * stretch / density,
        ]

    twist, stretch = fsolve(rest, [0.0, 1.0], xtol=1e-12)
    shape = solve_static(BODY, [UTurn.double_helix(OFFSET, turns)], [force])
    assert shape.tip == close([0.0, 0.0, LENGTH * stretch])
    assert shape.strain[:, 2] == pytest.approx(twist, rel=1e-9)
    density = math.hypot(stretch, OFFSET * (twist + wind))
    assert shape.tca_length[0] == close(2.0 * LENGTH * density)


def test_a_helix_is_a_steady_screw_in_the_frame_that_turns_with_it():
    """There all strains are constant: the tip is one exponential on SE(3)."""
    turns = 3.0
    wind = 2.0 * math.pi * turns / LENGTH
    shape = solve_static(BODY, [Helix(OFFSET, turns)], [0.02], points=2)
    u, v = shape.strain[0, :3], shape.strain[0, 3:]
    screw = (u + [0.0, 0.0, wind]) * LENGTH
    assert shape.tip == close(screw_translation(screw, v * LENGTH))
    # And the strain is that of least energy: nothing is left of the section's wrench.
    w = v + [0.0, OFFSET * (u[2] + wind), -OFFSET * u[1]]
    pull = 0.02 * w / np.linalg.norm(w)
    stiffness = np.array([EI, EI, BODY.torsion, BODY.shearing, BODY.shearing, EA])
    elastic = stiffness * (shape.strain[0] - [0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    drawn = np.concatenate([np.cross([OFFSET, 0.0, 0.0], pull), pull])
    assert elastic + drawn == pytest.approx(np.zeros(6), abs=1e-14)


# Loads on a plain rod.


@pytest.mark.parametrize("load", [0.5, 2.0, 10.0, 30.0])
def test_elastica_under_a_load_across(load):
    """Elliptic integrals [Bisshopp & Drucker, Quart. Appl. Math. 3, 1945], load = P L²/EI."""

    def reach(k):
        return ellipk(k * k) - ellipkinc(math.asin(1.0 / (k * math.sqrt(2.0))), k * k)

    k = brentq(lambda k: reach(k) - math.sqrt(load), math.sqrt(0.5) + 1e-12, 1.0 - 1e-13)
    tip_angle = math.asin(2.0 * k * k - 1.0)
    shape = solve_static(RIGID, [], [], tip_force=(load * EI / LENGTH**2, 0.0, 0.0))
    assert math.pi / 2.0 - shape.bend_angle == pytest.approx(math.pi / 2.0 - tip_angle, abs=1e-6)
    along = LENGTH * math.sqrt(2.0 / load * math.sin(tip_angle))
    assert shape.tip[2] == pytest.approx(along, rel=2e-6)
    across = quad(
        lambda t: math.sin(t) / math.sqrt(math.sin(tip_angle) - math.sin(t)),
        0.0, tip_angle, weight=None, points=[tip_angle],
    )[0]  # fmt: skip
    assert shape.tip[0] == pytest.approx(LENGTH / math.sqrt(2.0 * load) * across, rel=1e-6)


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.5])
def test_a_buckled_column_is_eulers(angle):
    """L sqrt(P/EI) = K(sin(alpha/2)), alpha the angle of the tip; no disturbance is given."""
    load = (ellipk(math.sin(angle / 2.0) ** 2) / LENGTH) ** 2 * EI
    shape = solve_static(RIGID, [], [], tip_force=(0.0, 0.0, -load))
    assert shape.bend_angle == pytest.approx(angle, rel=1e-6)


@pytest.mark.parametrize(("share", "buckled"), [(0.99, False), (1.02, True)])
def test_a_standing_column_buckles_under_its_own_weight(share, buckled):
    """At w L³/EI = 7.8373 [Greenhill, 1881]."""
    gravity = share * 7.83735 * EI / LENGTH**3 / RIGID.line_density
    shape = solve_static(RIGID, [], [], gravity=(0.0, 0.0, -gravity))
    assert (shape.bend_angle > 0.1) == buckled


def test_a_heavy_rod_against_the_pendulum_equation():
    """EI theta'' = -w (L - s) cos(theta), theta from the horizontal rod's slope; w across z."""
    weight = 15.0 * EI / LENGTH**3
    s = np.linspace(0.0, 1.0, 65)

    def slope(s, y):
        return np.array([y[1], -15.0 * (1.0 - s) * np.cos(y[0])])

    theory = solve_bvp(slope, lambda a, b: np.array([a[0], b[1]]), s, np.zeros((2, 65)), tol=1e-9)
    shape = solve_static(RIGID, [], [], gravity=(-weight / RIGID.line_density, 0.0, 0.0))
    angle = theory.sol(s)[0]
    assert np.arctan2(-shape.rotation[:, 0, 2], shape.rotation[:, 2, 2]) == pytest.approx(
        angle, abs=2e-7
    )


def test_shear_and_stretch_of_a_stocky_rod():
    """Timoshenko's P L³/3EI + P L/GA; a rod that cannot shear lacks the second."""
    load = 1e-6 * EI / LENGTH**2
    full = solve_static(BODY, [], [], tip_force=(load, 0.0, 0.0)).tip[0]
    stiff = solve_static(BODY, [], [], tip_force=(load, 0.0, 0.0), shearable=False)
    assert stiff.tip[0] == pytest.approx(load * LENGTH**3 / (3.0 * EI), rel=1e-6)
    assert full - stiff.tip[0] == pytest.approx(load * LENGTH / BODY.shearing, rel=1e-6)
    pulled = solve_static(BODY, [], [], tip_force=(0.0, 0.0, 0.1), shearable=False)
    assert pulled.tip[2] == pytest.approx(LENGTH * (1.0 + 0.1 / EA), rel=1e-10)


def test_without_shear_the_section_stays_across():
    shape = solve_static(BODY, [Helix(OFFSET, 1.0)], [0.03], tip_force=(2e-3, 0.0, 0.0),
                         shearable=False)  # fmt: skip
    assert (shape.strain[:, 3:5] == 0.0).all()
    tangent = np.gradient(shape.position, shape.arc_length, axis=0, edge_order=2)[1:-1]
    stretch = shape.strain[1:-1, 5:]
    assert tangent == pytest.approx(stretch * shape.rotation[1:-1, :, 2], abs=2e-3)


# Work and balance, for everything at once.

ROUTES = [Helix(OFFSET, 1.3, 0.4), UTurn.parallel(3e-3, 1e-3, 2.0), Spiral()]
TENSIONS = [0.02, 0.015, 0.03]
CURVED = replace(BODY, curvature=(5.0, -8.0, 12.0))
FORCE = np.array([1e-3, -0.5e-3, 1.5e-3])


def loaded(tensions=TENSIONS, force=FORCE, **change):
    options = {"tip_force": force, "gravity": GRAVITY} | change
    return solve_static(CURVED, ROUTES, tensions, **options)


@pytest.mark.parametrize("shearable", [True, False])
def test_work_is_conserved(shearable):
    """Maxwell: dl_a/dF_b = dl_b/dF_a, dx_i/dF_a = -dl_a/dP_i, dx_i/dP_j = dx_j/dP_i."""
    step = 1e-4
    columns = []
    for i in range(6):
        ends = []
        for sign in (1.0, -1.0):
            change = np.zeros(6)
            change[i] = sign * step * 0.02
            shape = loaded(list(np.array(TENSIONS) - change[:3]), FORCE + change[3:],
                           shearable=shearable)  # fmt: skip
            ends.append(np.concatenate([shape.tca_length, shape.tip]))
        columns.append((ends[0] - ends[1]) / (0.04 * step))
    compliance = np.array(columns)
    assert compliance == pytest.approx(compliance.T, abs=3e-7 * np.abs(compliance).max())
    assert (np.linalg.eigvalsh(compliance + compliance.T) > 0.0).all()


def test_what_holds_the_base_balances_all_loads():
    moment = np.array([2e-5, 1e-5, -3e-5])
    shape = loaded(tip_moment=moment, points=401)
    weight = CURVED.line_density * GRAVITY
    assert shape.base_force == pytest.approx(-FORCE - LENGTH * weight, rel=1e-14)
    lever = simpson(shape.position, x=shape.arc_length, axis=0)
    loads = moment + np.cross(shape.tip, FORCE) + np.cross(lever, weight)
    assert shape.base_moment == pytest.approx(-loads, abs=1e-9 * np.abs(loads).max())


def test_strands_alone_ask_nothing_of_the_base():
    shape = solve_static(CURVED, ROUTES, TENSIONS)
    assert not shape.base_force.any()
    assert shape.base_moment == pytest.approx(np.zeros(3), abs=1e-18)
    assert shape.bend_angle > 0.3


def test_without_load_the_body_is_at_rest():
    shape = solve_static(CURVED, ROUTES, [0.0, Cord(1.0, 1.0), 0.0])
    angle = np.array(CURVED.curvature) * LENGTH
    assert shape.tip == close(screw_translation(angle, [0.0, 0.0, LENGTH]), tolerance=1e-12)
    lengths = [
        sum(leg_length(leg, LENGTH, CURVED.curvature, points=20001) for leg in route.legs)
        for route in ROUTES
    ]
    assert shape.tca_length == pytest.approx(lengths, rel=1e-8)


def test_energy_agrees():
    """The other solver: the minimum of the energy, with its own discretisation."""
    shape, other = loaded(), loaded(solver="energy")
    assert shape.position == close(other.position, tolerance=1e-9)
    assert shape.rotation == pytest.approx(other.rotation, abs=1e-8)
    assert shape.tca_length == close(other.tca_length, tolerance=1e-9)
    assert shape.base_moment == pytest.approx(other.base_moment, abs=1e-9 * EI / LENGTH)


# Symmetry and scale.


def test_twice_the_modulus_and_twice_the_loads_change_nothing():
    twice = replace(CURVED, bending=(2.0 * EI, 2.0 * EI), torsion=2.0 * BODY.torsion,
                    stretching=2.0 * EA, shearing=2.0 * BODY.shearing)  # fmt: skip
    shape = loaded()
    other = solve_static(twice, ROUTES, [2.0 * tension for tension in TENSIONS],
                         tip_force=2.0 * FORCE, gravity=2.0 * GRAVITY)  # fmt: skip
    assert other.position == close(shape.position, tolerance=1e-10)


def test_a_turned_clamp_turns_everything():
    turn = quaternion_matrix(quaternion_exp([0.4, -1.1, 2.0]))
    segment = Segment(CURVED, ROUTES, TENSIONS, rotation=turn, offset=(0.1, 0.2, -0.3))
    (moved,) = solve_series([segment], tip_force=turn @ FORCE, gravity=turn @ GRAVITY)
    shape = loaded()
    assert moved.position == close([0.1, 0.2, -0.3] + shape.position @ turn.T, tolerance=1e-10)
    assert moved.rotation == pytest.approx(turn @ shape.rotation, abs=1e-10)
    assert moved.base_force == pytest.approx(turn @ shape.base_force, abs=1e-12)
    lever = np.cross([0.1, 0.2, -0.3], moved.base_force)
    assert moved.base_moment - lever == pytest.approx(turn @ shape.base_moment, abs=1e-12)


def test_a_mirrored_helix_mirrors_the_shape():
    right = solve_static(BODY, [Helix(OFFSET, 1.3)], [0.03], tip_force=(1e-3, 2e-3, 0.0))
    left = solve_static(BODY, [Helix(OFFSET, -1.3)], [0.03], tip_force=(1e-3, -2e-3, 0.0))
    assert left.position * [1.0, -1.0, 1.0] == close(right.position, tolerance=1e-10)


def test_the_points_of_the_answer_do_not_matter():
    few, many = loaded(points=3), loaded(points=101)
    assert few.position == close(many.position[::50], tolerance=1e-11)
    assert few.strain == pytest.approx(many.strain[::50], abs=1e-7)
    assert (few.tca_length == many.tca_length).all()


def test_the_answer_is_smooth_in_the_load():
    """Halfway between two close loads lies the middle of their shapes, to second order."""
    tips = np.array([loaded(force=FORCE * share).tip for share in (0.99, 1.0, 1.01)])
    first, second = tips[2] - tips[0], tips[2] - 2.0 * tips[1] + tips[0]
    assert np.linalg.norm(second) < 0.02 * np.linalg.norm(first)


# Laws.


def test_an_antagonist_resists():
    """EI u = (F - f) a, EA (1 - v) = F + f, f = k L (v + u a - 1)."""
    force, stiffness = 0.03, 5.0
    matrix = np.array([[EI, 0.0, OFFSET], [0.0, -EA, -1.0],
                       [stiffness * LENGTH * OFFSET, stiffness * LENGTH, -1.0]])  # fmt: skip
    u, v, passive = np.linalg.solve(matrix, [force * OFFSET, force - EA, stiffness * LENGTH])
    routes = [SPOT, Helix(OFFSET, phase=math.pi)]
    shape = solve_static(BODY, routes, [force, Cord(stiffness, LENGTH)])
    assert passive > 5e-3
    assert shape.strain[:, 1] == pytest.approx(u, rel=1e-10)
    assert shape.strain[:, 5] == pytest.approx(v, rel=1e-12)
    assert shape.tca_length == close(LENGTH * np.array([v - u * OFFSET, v + u * OFFSET]))


def test_a_slack_strand_does_nothing():
    cord = Cord(50.0, LENGTH)
    shape = solve_static(BODY, [SPOT, Helix(OFFSET, phase=0.1)], [0.03, cord])
    assert shape.tip == close(solve_static(BODY, [SPOT], [0.03]).tip)
    assert shape.tca_length[1] < LENGTH


@pytest.mark.parametrize("stiffness", [1.0, 30.0, 3e3])
def test_a_law_gives_what_its_tension_gives(stiffness):
    cords = [Cord(stiffness, 0.98 * LENGTH * rest) for rest in (1.07, 1.9, 1.0)]
    shape = loaded(cords)
    tensions = [cord(length)[0] for cord, length in zip(cords, shape.tca_length, strict=True)]
    assert max(tensions) > 5e-3
    assert loaded(tensions).position == close(shape.position, tolerance=1e-7)


# Series.


def test_two_halves_are_one():
    """With a helix, gravity and loads: nothing marks the cut."""
    turns, phase = 1.4, 0.3
    half = replace(BODY, length=LENGTH / 2.0)
    routes = [[Helix(OFFSET, turns / 2.0, phase), SPOT],
              [Helix(OFFSET, turns / 2.0, phase + math.pi * turns), SPOT]]  # fmt: skip
    loads = {"tip_force": FORCE, "gravity": GRAVITY, "tip_moment": (1e-5, 0.0, 2e-5)}
    lower, upper = solve_series([Segment(half, each, [0.02, 0.01]) for each in routes], **loads)
    whole = solve_static(BODY, [Helix(OFFSET, turns, phase), SPOT], [0.02, 0.01], **loads)
    assert upper.tip == close(whole.tip)
    assert lower.tip == close(whole.position[32])
    assert upper.rotation[-1] == pytest.approx(whole.rotation[-1], abs=1e-8)
    assert lower.base_moment == pytest.approx(whole.base_moment, abs=1e-9 * EI / LENGTH)
    assert lower.tca_length + upper.tca_length == close(whole.tca_length)
    held = -FORCE - LENGTH / 2.0 * BODY.line_density * GRAVITY
    assert upper.base_force == pytest.approx(held, rel=1e-12)


@pytest.mark.parametrize("kink", [0.37, 0.123])
def test_a_kink_in_a_route_is_an_interface(kink):
    """Where a strand bends sharply it pushes; a mesh that knows nothing of it finds that.

    At 0.123 two meshes in a row take it to be at 1/8.
    """
    points = ((4e-3, 0.0), (1e-3, 3e-3), (-2e-3, 1e-3))
    whole = solve_static(BODY, [Kinked(points, kink)], [0.03], tip_force=FORCE)
    a, b, c = points
    parts = [
        Segment(replace(BODY, length=share * LENGTH), [Kinked((p, middle, q), 0.5)], [0.03])
        for share, p, middle, q in (
            (kink, a, tuple(np.add(a, b) / 2.0), b),
            (1.0 - kink, b, tuple(np.add(b, c) / 2.0), c),
        )
    ]
    lower, upper = solve_series(parts, tip_force=FORCE)
    assert whole.tip == close(upper.tip, tolerance=3e-8)
    assert whole.tca_length == close(lower.tca_length + upper.tca_length, tolerance=3e-8)


def test_a_rigid_mass_is_a_load_that_goes_with_the_tip():
    mass, centre = 1e-3, np.array([3e-3, -1e-3, 5e-3])
    segment = Segment(CURVED, ROUTES, TENSIONS, mass=mass, centre=centre)
    (shape,) = solve_series([segment], tip_force=FORCE, gravity=GRAVITY)
    weight = mass * GRAVITY
    moment = np.cross(shape.rotation[-1] @ centre, weight)
    same = loaded(force=FORCE + weight, tip_moment=moment)
    assert same.position == close(shape.position)
    assert same.base_moment == pytest.approx(shape.base_moment, abs=1e-9 * EI / LENGTH)


def test_a_rigid_piece_between_two_bodies():
    """The second body stands on the first one's tip, turned and shifted, and loads it there."""
    turn = quaternion_matrix(quaternion_exp([0.3, 0.7, -0.4]))
    first = Segment(BODY, [SPOT], [0.02], mass=5e-4, centre=(0.0, 1e-3, 2e-3))
    second = Segment(CURVED, ROUTES, TENSIONS, rotation=turn, offset=(1e-3, 2e-3, 4e-3))
    lower, upper = solve_series([first, second], tip_force=FORCE, gravity=GRAVITY)
    frame = lower.rotation[-1]
    assert upper.position[0] == close(lower.tip + frame @ [1e-3, 2e-3, 4e-3])
    assert upper.rotation[0] == pytest.approx(frame @ turn, abs=1e-10)
    # Clamped as it stands, the upper body has the same shape; it and the mass load the lower.
    alone = Segment(CURVED, ROUTES, TENSIONS, rotation=upper.rotation[0],
                    offset=upper.position[0])  # fmt: skip
    (same,) = solve_series([alone], tip_force=FORCE, gravity=GRAVITY)
    assert same.position == close(upper.position)
    weight = 5e-4 * GRAVITY
    load = weight - upper.base_force
    moment = np.cross(frame @ [0.0, 1e-3, 2e-3], weight)
    moment -= upper.base_moment + np.cross(-lower.tip, upper.base_force)
    below = solve_static(BODY, [SPOT], [0.02], tip_force=load, tip_moment=moment, gravity=GRAVITY)
    assert below.position == close(lower.position)
    assert below.base_moment == pytest.approx(lower.base_moment, abs=1e-9 * EI / LENGTH)


def test_the_arm_is_the_same_to_both_solvers():
    """Bending module with three TCAs and wrist with a double helix, hanging."""
    wrist = BeamSpec.circular(length=16e-3, diameter=6e-3, young=E, shear=G, density=1070.0)
    segments = [
        Segment(BODY, parallel(3, OFFSET), [0.04, 0.01, 0.0], rotation=np.diag([1.0, -1.0, -1.0]),
                mass=1e-4, centre=(0.0, 0.0, 0.75e-3)),
        Segment(wrist, [UTurn.double_helix(3.5e-3, 2.5)], [0.03], offset=(0.0, 0.0, 1.5e-3),
                mass=2e-3, centre=(0.0, 0.0, 9e-3)),
    ]  # fmt: skip
    shot = solve_series(segments, gravity=(0.0, 0.0, -9.81))
    least = solve_series(segments, gravity=(0.0, 0.0, -9.81), solver="energy")
    for one, other in zip(shot, least, strict=True):
        assert one.tip == pytest.approx(other.tip, abs=1e-9)
        assert one.rotation[-1] == pytest.approx(other.rotation[-1], abs=1e-7)


# What cannot be solved, and what is refused.


@pytest.mark.parametrize("tensions", [[0.7, 0.7, 0.7], [1.9, 0.0, 0.0]])
def test_a_body_that_is_drawn_to_nothing_is_an_error(tensions):
    with pytest.raises(RodSolveError, match="a strand shortens to nothing") as caught:
        solve_static(BODY, parallel(3, OFFSET), tensions)
    assert math.isfinite(caught.value.residual)


def test_a_law_without_answer_speaks_for_itself():
    def law(length):
        raise ValueError(f"length {length:.3f} is too long for me")

    with pytest.raises(ValueError, match="length 0.045 is too long for me"):
        solve_static(BODY, [SPOT], [law])


@pytest.mark.parametrize("answer", [(-0.01, 0.0), (math.nan, 0.0), (0.01, -1.0)])
def test_a_law_that_pushes_is_refused(answer):
    with pytest.raises(ValueError, match="law of strand 0 at .* must be finite and at least 0 N"):
        solve_static(BODY, [SPOT], [lambda length: answer])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"beam": 3}, "beam must be a BeamSpec, got 3"),
        ({"routes": SPOT}, "routes must be a sequence"),
        ({"routes": [7]}, r"routes\[0\] must be a Helix .* or have legs of its own, got 7"),
        ({"tensions": [0.1, 0.1]}, "tensions must be one per route, 1, got 2"),
        ({"tensions": 0.1}, r"tensions must be a sequence, got 0\.1"),
        ({"tensions": [-0.1]}, r"tensions\[0\] must be finite and at least 0 N, got -0\.1"),
        ({"tensions": [math.nan]}, r"tensions\[0\] must be a number or a StrandLaw, got nan"),
        ({"tip_force": (0.0, 1.0)}, r"tip_force must be finite numbers of shape \(3,\), got"),
        ({"tip_moment": (0.0, 1.0, math.inf)}, "tip_moment must be finite, got"),
        ({"gravity": "down"}, "gravity must be a real number or an array of them, got 'down'"),
        ({"solver": "guess"}, "solver must be one of .* got 'guess'"),
        ({"points": 1}, "points must be at least 2, got 1"),
        ({"shearable": "no"}, "shearable must be True or False, got 'no'"),
    ],
)
def test_bad_arguments_are_refused(change, message):
    arguments = {"beam": BODY, "routes": [SPOT], "tensions": [0.01]} | change
    three = [arguments.pop(name) for name in ("beam", "routes", "tensions")]
    with pytest.raises(ValueError, match=message):
        solve_static(*three, **arguments)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rotation": np.eye(2)}, r"rotation must be finite numbers of shape \(3, 3\)"),
        ({"rotation": -np.eye(3)}, "rotation must be a 3 x 3 rotation matrix"),
        ({"offset": (0.0, 0.0)}, r"offset must be finite numbers of shape \(3,\)"),
        ({"mass": -1.0}, r"mass must be finite and at least 0, got -1\.0"),
        ({"centre": (0.0, 0.0, math.nan)}, "centre must be finite, got"),
    ],
)
def test_a_bad_segment_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Segment(BODY, [SPOT], [0.01], **change)


def test_a_slope_per_metre_is_refused():
    """The likeliest slip in a route of one's own."""

    class PerMetre(Spiral):
        def slope(self, s):
            return super().slope(s) / LENGTH

    with pytest.raises(ValueError, match=r"slope\(s\) of routes\[0\] must be the derivative"):
        Segment(BODY, [PerMetre()], [0.01])


def test_a_series_needs_a_segment():
    with pytest.raises(ValueError, match="segments must be at least one Segment"):
        solve_series([])

"""Chains against the theory of rods: closed forms, solutions of the Cosserat equations, orders."""

import math
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq, fsolve
from scipy.spatial.transform import Rotation
from scipy.special import ellipk, ellipkinc

from tca_mj.model import NotSettledError, settle
from tca_mj.model.chain import add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.smooth import SmoothBody
from tca_mj.model.tendon import route_passes, route_tca
from tca_mj.rod import BeamSpec, solve_static
from tca_mj.routes import Helix, UTurn, leg_length, parallel
from tca_mj.tca import CATALOGUE

# One parallel TCA at 4 mm bends this beam by 41° per 0.01 N.
BEAM = BeamSpec.circular(
    length=45e-3, diameter=4.5e-3, young=0.125e6, shear=0.125e6 / 3.0, density=1070.0,
    outer_diameter=9e-3,
)  # fmt: skip
L, EI, EA = BEAM.length, BEAM.bending[0], BEAM.stretching
TCA = Helix(4e-3)


def arc(curvature, stretch):
    """Tip of an arc that starts along z and bends towards x."""
    angle = curvature * L
    tip = np.array([1.0 - math.cos(angle), 0.0, math.sin(angle)])
    return stretch / curvature * tip


def off(shape, tip):
    """Distance of a shape's tip from where it should be, over the length."""
    return float(np.linalg.norm(shape.tip - tip)) / L


# Solutions of Cosserat's equations without shear, in which TCAs are internal: the section's wrench
# is that of the strains plus the sum of F [r x t; t] (shooting, to 1e-8 m): routes, tensions [N],
# tip force [N], tip [mm], rotation vector of the tip [deg], length of the TCA [mm].
SOLVED = {
    "parallel, force across": (
        [TCA], [0.02], (0.0, 2e-3, 0.0),
        (22.6062, 18.2294, 28.0566), (-39.510, 78.286, 12.556), 38.9990,
    ),
    "U, force across": (
        [UTurn.parallel(2.5e-3, 0.8e-3)], [0.01], (0.0, 1e-3, 0.0),
        (17.6313, 11.0604, 37.4381), (-22.110, 50.735, 5.508), 84.6444,
    ),
    "three unlike": (
        parallel(3, 4e-3), [0.02, 0.012, 0.004], (0.0, 0.0, 0.0),
        (17.4627, 10.0821, 37.2962), (-28.398, 49.187, 0.0), 40.7513,
    ),
    "helix": (
        [Helix(4e-3, 1.0)], [0.02], (0.0, 0.0, 0.0),
        (0.6670, 11.5115, 41.8446), (0.0, -11.485, -47.971), 44.8238,
    ),
    "left helix, force across": (
        [Helix(4e-3, -1.0)], [0.01], (1e-3, 0.0, 0.0),
        (11.3829, -5.0157, 42.7893), (5.366, 18.399, 29.904), 48.1543,
    ),
    "five turns": (
        [Helix(4e-3, 5.0)], [0.02], (0.0, 0.0, 0.0),
        (0.0363, 0.7705, 44.8320), (0.0, -1.922, -115.275), 125.1738,
    ),
    "five turns, force across": (
        [Helix(4e-3, 5.0)], [0.02], (1e-3, 0.0, 0.0),
        (11.0605, 0.7304, 43.1727), (-21.481, 11.728, -113.979), 125.1767,
    ),
}  # fmt: skip


def errors(case, nodes):
    """Error of the tip over L, of its rotation [deg] and of the TCA's length over itself."""
    routes, tensions, force, tip, rotation, length = SOLVED[case]
    shape = settle(BEAM, routes, tensions, nodes=nodes, tip_force=force)
    turn = Rotation.from_rotvec(rotation, degrees=True).as_matrix()
    left = np.degrees(Rotation.from_matrix(shape.rotation[-1].T @ turn).magnitude())
    path = shape.tca_length[0] / (length * 1e-3) - 1.0
    return off(shape, np.array(tip) * 1e-3), float(left), float(path)


@pytest.mark.parametrize("case", SOLVED)
def test_the_error_falls_with_the_square_of_the_number_of_nodes(case):
    few = 24 if "five" in case else 16  # five nodes per turn
    coarse, fine = errors(case, few), errors(case, 2 * few)
    assert coarse[0] / fine[0] == pytest.approx(4.0, abs=0.3)
    if case == "three unlike":  # a plane bend by TCAs alone: its angle is exact
        assert coarse[1] < 1e-3
    else:
        assert coarse[1] / fine[1] == pytest.approx(4.0, abs=0.6)
    assert abs(fine[2]) < 0.27 * abs(coarse[2]) + 1e-6


@pytest.mark.parametrize(
    ("case", "tip", "rotation", "path"),
    [
        ("parallel, force across", 0.003, 0.32, 1e-4),
        ("U, force across", 0.0015, 0.13, 2e-5),
        ("three unlike", 0.0012, 1e-3, 2e-6),
        ("helix", 0.0024, 0.6, 5.2e-3),
        ("left helix, force across", 0.0017, 0.11, 2.5e-3),
    ],
)
def test_the_error_at_eight_nodes(case, tip, rotation, path):
    """The table in the documentation."""
    found = errors(case, 8)
    assert found[0] < tip and found[1] < rotation and abs(found[2]) < path


@pytest.mark.parametrize("case", ["five turns", "five turns, force across"])
def test_five_turns_need_three_nodes_each(case):
    """The rotation of 115° within a thousandth."""
    tip, rotation, path = errors(case, 16)
    assert tip < 1e-3 and rotation < 0.1 and abs(path) < 2e-3


def test_a_double_helix_is_exact():
    """It twists and shortens evenly: nothing for a cell to lose.

    Balance: GJ u = -2 F a² (w + u)/|t|, EA (v - 1) = -2 F v/|t|, |t|² = v² + a² (w + u)², w the
    turns as an angle per length.
    """
    force, a, rate = 0.02, 4e-3, 2.0 * math.pi * 2.5 / L

    def unbalanced(x):
        t = np.array([a * (rate + x[0]), x[1]])
        t *= 2.0 * force / np.linalg.norm(t)
        return BEAM.torsion * x[0] + a * t[0], EA * (x[1] - 1.0) + t[1]

    u, v = fsolve(unbalanced, (0.0, 1.0), xtol=1e-13)
    shape = settle(BEAM, [UTurn.double_helix(a, 2.5)], [force], nodes=8)
    assert math.degrees(u * L) < -150.0
    assert shape.strain == pytest.approx(np.tile([0, 0, u, 0, 0, v], (9, 1)), rel=1e-6, abs=1e-6)
    assert shape.tca_length[0] == pytest.approx(2.0 * L * np.hypot(v, a * (rate + u)), rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_random_bodies_within_a_hundredth_of_theory(seed):
    """Up to 90°, loaded at the tip, at eight nodes; one of each kind of route."""
    rng = np.random.default_rng(seed)
    length, angle = rng.uniform(30e-3, 80e-3), rng.uniform(0.0, 2.0 * math.pi)
    if seed % 2:
        body = BeamSpec.circular(length=length, diameter=5e-3, young=2e5, shear=0.7e5, density=1e3)
    else:
        body = BeamSpec.box(
            length=length, width=4e-3, height=6e-3, young=1e5, shear=0.4e5, density=1e3
        )
    routes = [
        (Helix(2e-3, phase=angle),), (UTurn.parallel(2e-3, 1e-3, angle),),
        parallel(3, 2e-3, angle), (Helix(2e-3, 0.8, angle),),
    ][seed]  # fmt: skip
    limit = min(body.bending)
    tensions = list(rng.uniform(0.5, 1.0, len(routes)) * limit / (2e-3 * length))
    if seed == 1:
        tensions = [0.5 * tensions[0]]
    load = {
        "tip_force": 0.5 * limit / length**2 * rng.uniform(-1.0, 1.0, 3),
        "tip_moment": 0.2 * limit / length * rng.uniform(-1.0, 1.0, 3),
        "gravity": rng.uniform(-3.0, 3.0, 3),
    }
    theory = solve_static(body, routes, tensions, shearable=False, **load)
    error = []
    for nodes in (8, 16):
        shape = settle(body, routes, tensions, nodes=nodes, **load)
        turn = Rotation.from_matrix(shape.rotation[-1].T @ theory.rotation[-1]).magnitude()
        error.append([np.linalg.norm(shape.tip - theory.tip) / length, turn])
        assert shape.tca_length == pytest.approx(theory.tca_length, rel=0.02 / nodes)
        assert shape.base_force == pytest.approx(theory.base_force, abs=1e-9)
    assert 5.0 < math.degrees(theory.bend_angle) < 100.0
    assert error[0][0] < 0.01 and math.degrees(error[0][1]) < 1.0
    assert np.divide(*error) == pytest.approx([4.0, 4.0], abs=0.3)


def test_a_tca_may_pull_by_a_law():
    """Springs with slack: the same shape as with the tensions that come out."""
    laws = [
        lambda length: (max(0.0, 1.5 * (length - 0.03)), 1.5 if length > 0.03 else 0.0),
        lambda length: (max(0.0, 0.5 * (length - 0.06)), 0.5 if length > 0.06 else 0.0),
    ]
    routes = [TCA, Helix(4e-3, phase=2.0)]
    shape = settle(BEAM, routes, laws, nodes=8, tip_force=(0.0, 5e-4, 0.0))
    tension = [law(length)[0] for law, length in zip(laws, shape.tca_length, strict=True)]
    assert 0.005 < tension[0] < 0.02 and tension[1] == 0.0
    same = settle(BEAM, routes, tension, nodes=8, tip_force=(0.0, 5e-4, 0.0))
    assert same.position == pytest.approx(shape.position, abs=1e-10)


def test_a_tca_may_run_outside_of_the_body():
    """The published module has its TCAs at 4 mm in a body of 4.5 mm diameter."""
    thin = BeamSpec.circular(
        length=L, diameter=4.5e-3, young=0.125e6, shear=0.125e6 / 3.0, density=1070.0
    )
    assert settle(thin, [TCA], [0.02], nodes=8).tip == pytest.approx(
        settle(BEAM, [TCA], [0.02], nodes=8).tip, abs=1e-9
    )


def test_the_length_of_a_tca_is_what_its_tension_works_on():
    """U = -F l + ∫ l dF, U the energy of the joints: exact for any number of nodes."""

    def length(force):
        return settle(BEAM, [TCA], [force], nodes=6).tca_length[0]

    node, weight = np.polynomial.legendre.leggauss(6)
    forces = 0.015 * (node + 1.0)
    integral = 0.015 * sum(w * length(force) for w, force in zip(weight, forces, strict=True))
    strain = settle(BEAM, [TCA], [0.03], nodes=6).strain[0]
    energy = 0.5 * L * (EI * strain[1] ** 2 + EA * (strain[5] - 1.0) ** 2)
    assert integral - 0.03 * length(0.03) == pytest.approx(energy, rel=1e-6)


@pytest.mark.parametrize(
    ("force", "tip", "angle"),
    [
        (0.01, (15.344, 0.0, 41.051), 41.0),
        (0.02, (26.790, 0.0, 30.830), 82.0),
        (0.04, (30.218, 0.0, 4.259), 164.0),
    ],
)
def test_a_parallel_tca_bends_to_an_arc(force, tip, angle):
    """u = F a/EI, v = 1 - F/EA; the numbers are those of the full Cosserat theory [mm, deg]."""
    curvature, stretch = force * 4e-3 / EI, 1.0 - force / EA
    assert arc(curvature, stretch) == pytest.approx(np.array(tip) * 1e-3, abs=6e-7)
    assert math.degrees(curvature * L) == pytest.approx(angle, abs=0.05)
    tip = arc(curvature, stretch)
    error = {n: off(settle(BEAM, [TCA], [force], nodes=n), tip) for n in (8, 16)}
    assert error[8] < {0.01: 0.001, 0.02: 0.0025, 0.04: 0.007}[force]
    assert error[8] / error[16] == pytest.approx(4.0, abs=0.1)
    shape = settle(BEAM, [TCA], [force], nodes=4)
    assert shape.bend_angle == pytest.approx(curvature * L, rel=1e-9)
    assert shape.tca_length[0] == pytest.approx((stretch - curvature * 4e-3) * L, rel=1e-9)


def test_the_strains_are_those_of_the_arc():
    """Constant curvature: every cell carries the same."""
    shape = settle(BEAM, [TCA], [0.02], nodes=8)
    assert np.ptp(shape.strain, axis=0) == pytest.approx(np.zeros(6), abs=1e-6)
    theory = [0.0, 0.02 * 4e-3 / EI, 0.0, 0.0, 0.0, 1.0 - 0.02 / EA]
    assert shape.strain[0] == pytest.approx(theory, rel=1e-9, abs=1e-6)
    assert shape.arc_length == pytest.approx(np.linspace(0.0, L, 9))
    assert shape.position.shape == (9, 3) and shape.rotation.shape == (9, 3, 3)
    assert shape.position[0] == pytest.approx(np.zeros(3), abs=1e-18)


@pytest.mark.parametrize(("force", "nodes"), [(0.01, 8), (0.02, 8), (0.01, 16), (0.04, 16)])
def test_without_springs_for_it_the_polyline_bends_too_far(monkeypatch, force, nodes):
    """EI θ/h = F (a cos(θ/2) + h/2 sin(θ/2)) for a node, where theory has EI θ/h = F a."""
    cell = L / nodes

    def unbalanced(angle):
        chord = 0.5 * (1.0 - force / EA) * cell
        lever = 4e-3 * math.cos(0.5 * angle) + chord * math.sin(0.5 * angle)
        return EI * angle / cell - force * lever

    monkeypatch.setattr(SmoothBody, "support", lambda *_: None)
    plain = settle(BEAM, [TCA], [force], nodes=nodes).strain[0, 1] * cell
    assert plain == pytest.approx(brentq(unbalanced, 0.0, 1.0), rel=1e-3)
    assert plain / (force * 4e-3 / EI * cell) - 1.0 > 0.005


@pytest.mark.parametrize("nodes", [1, 2, 8])
def test_a_tip_moment_about_the_axis_twists_exactly(nodes):
    """M L / GJ; one node is enough."""
    shape = settle(BEAM, [], [], nodes=nodes, tip_moment=(0.0, 0.0, 3e-5))
    assert shape.twist_angle == pytest.approx(3e-5 * L / BEAM.torsion, rel=1e-9)
    assert shape.tip == pytest.approx([0.0, 0.0, L], abs=1e-12)


@pytest.mark.parametrize("nodes", [1, 2, 8])
def test_an_axial_load_stretches_exactly(nodes):
    shape = settle(BEAM, [], [], nodes=nodes, tip_force=(0.0, 0.0, 0.1))
    assert shape.tip == pytest.approx([0.0, 0.0, L * (1.0 + 0.1 / EA)], abs=1e-12)
    weight = settle(BEAM, [], [], nodes=nodes, gravity=(0.0, 0.0, 9.81))
    stretch = BEAM.mass * 9.81 * L / (2.0 * EA)
    assert weight.tip[2] - L == pytest.approx(stretch, rel=1e-9)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_tip_moment_bends_to_an_arc(axis):
    """Ninety degrees about x or y, second order."""
    moment = np.zeros(3)
    moment[axis] = 0.5 * math.pi * EI / L
    tip = 2.0 * L / math.pi * np.array([1.0, 0.0, 1.0] if axis else [0.0, -1.0, 1.0])
    error = [off(settle(BEAM, [], [], nodes=n, tip_moment=moment), tip) for n in (8, 16)]
    assert error[0] < 3.5e-3
    assert error[0] / error[1] == pytest.approx(4.0, abs=0.1)


def elastica(load):
    """Tip angle and deflections over L of a cantilever under a tip force across, P L²/EI = load.

    sqrt(load) = K(k) - F(φ, k) with k² = (1 + sin α)/2, sin φ = 1/(k sqrt 2), α the tip's angle
    (Bisshopp & Drucker, Quarterly of Applied Mathematics 3, 1945).
    """

    def phi(alpha):
        return math.asin(math.sqrt(1.0 / (1.0 + math.sin(alpha))))

    def gap(alpha):
        m = (1.0 + math.sin(alpha)) / 2.0
        return ellipk(m) - ellipkinc(phi(alpha), m) - math.sqrt(load)

    alpha = brentq(gap, 1e-6, 0.5 * math.pi - 1e-9, xtol=1e-14)
    along = math.sqrt(2.0 * math.sin(alpha) / load)
    # Across by quadrature: y' = sin θ, with s(θ) from the first integral.
    u, weight = np.polynomial.legendre.leggauss(200)
    root = math.sqrt(math.sin(alpha)) * (u + 1.0) / 2.0  # sin α - sin θ = root²
    sine = math.sin(alpha) - root**2
    weight = weight * math.sqrt(math.sin(alpha)) / 2.0
    across = float(weight @ (sine * math.sqrt(2.0 / load) / np.sqrt(1.0 - sine**2)))
    return alpha, along, across


def test_the_elastica():
    """P L²/EI = 1, 2 and 5: 0.4613, 0.7817, 1.2154 rad (Bisshopp & Drucker)."""
    for load, angle in ((1.0, 0.4613), (2.0, 0.7817), (5.0, 1.2154)):
        assert elastica(load)[0] == pytest.approx(angle, abs=1e-3)
    stiff = replace(BEAM, stretching=1e6 * EA)
    _, along, across = elastica(10.0)
    tip = L * np.array([0.0, across, along])
    force = (0.0, 10.0 * EI / L**2, 0.0)
    error = [off(settle(stiff, [], [], nodes=n, tip_force=force), tip) for n in (8, 16)]
    assert error[0] < 0.01
    assert error[0] / error[1] == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize("nodes", [4, 8])
def test_a_curved_body_rests_on_its_circle(nodes):
    """The pieces are the sides of a polygon about the arc: exact at the ends of the cells.

    A TCA on the outside is longer than the body by u a L, whatever the number of nodes.
    """
    bent = replace(BEAM, length=17.5e-3, curvature=(0.0, -170.0, 0.0))
    shape = settle(bent, [Helix(2.5e-3)], [0.0], nodes=nodes)
    angle = 170.0 * 17.5e-3
    circle = np.array([math.cos(angle) - 1.0, 0.0, math.sin(angle)]) / 170.0
    assert shape.bend_angle == pytest.approx(angle)
    assert shape.tip == pytest.approx(circle, abs=1e-12)
    assert shape.tca_length[0] == pytest.approx(17.5e-3 * (1.0 + 170.0 * 2.5e-3), rel=1e-12)
    assert shape.strain == pytest.approx(np.tile([0.0, -170.0, 0, 0, 0, 1], (nodes + 1, 1)))


@pytest.mark.parametrize("force", [0.02, 0.04])
def test_a_tca_straightens_a_curved_body(force):
    """u = u0 + F a/EI, as for a straight one; the error is that of the arcs alone."""
    bent = replace(BEAM, curvature=(0.0, -30.0, 0.0))
    curvature = -30.0 + force * 4e-3 / EI
    for nodes in (8, 16):
        shape = settle(bent, [TCA], [force], nodes=nodes)
        change = abs(shape.strain[0, 1] - curvature) / (force * 4e-3 / EI)
        angle = max(30.0, abs(curvature)) * L / nodes
        assert change < 0.18 * angle**2


@pytest.mark.parametrize("count", [3, 5])
def test_equal_tensions_shorten_and_do_not_bend(count):
    """Three times 0.05 N: 41.605 mm."""
    force = 0.15 / count
    shape = settle(BEAM, parallel(count, 4e-3), [force] * count, nodes=8)
    assert shape.tip == pytest.approx([0.0, 0.0, L * (1.0 - 0.15 / EA)], abs=1e-9)
    assert shape.tip[2] == pytest.approx(41.605e-3, abs=5e-7)
    assert shape.bend_angle < 1e-9 and abs(shape.twist_angle) < 1e-9


@pytest.mark.parametrize("turns", [1.0, 2.0])
def test_a_helix_untwists_towards_its_hand(turns):
    """A right-handed helix turns the tip clockwise seen from above, the mirror image the other."""
    right = settle(BEAM, [Helix(4e-3, turns)], [0.02], nodes=16)
    left = settle(BEAM, [Helix(4e-3, -turns)], [0.02], nodes=16)
    assert right.twist_angle < -0.3
    assert left.twist_angle == pytest.approx(-right.twist_angle, rel=1e-9)
    assert left.tip == pytest.approx(right.tip * [1.0, -1.0, 1.0], abs=1e-9)


def test_turning_route_and_load_turns_the_shape():
    """A round body has no preferred direction: 0.7 rad about the axis."""
    turn = Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix()
    force = np.array([5e-4, 1e-3, 0.0])
    shape = settle(BEAM, [TCA], [0.02], nodes=16, tip_force=force)
    turned = settle(BEAM, [Helix(4e-3, phase=0.7)], [0.02], nodes=16, tip_force=turn @ force)
    assert turned.tip == pytest.approx(turn @ shape.tip, abs=1e-9)


def scaled(factor):
    stiff = {name: factor * getattr(BEAM, name) for name in ("torsion", "stretching", "shearing")}
    return replace(BEAM, bending=(factor * EI, factor * EI), **stiff)


def test_stiffness_and_load_may_be_scaled_together():
    shape = settle(BEAM, [TCA], [0.02], nodes=8, tip_force=(0.0, 1e-3, 0.0))
    double = settle(scaled(2.0), [TCA], [0.04], nodes=8, tip_force=(0.0, 2e-3, 0.0))
    assert double.position == pytest.approx(shape.position, abs=1e-11)


@pytest.mark.parametrize("change", [{"line_density": 50.0}, {"damping_time": 3.0}])
def test_statics_know_neither_mass_nor_damping(change):
    """And so not the pseudo-time step, which is a multiple of L² sqrt(line density / EI)."""
    shape = settle(BEAM, [TCA], [0.03], nodes=8, tip_force=(0.0, 1e-3, 0.0))
    other = settle(replace(BEAM, **change), [TCA], [0.03], nodes=8, tip_force=(0.0, 1e-3, 0.0))
    assert other.position == pytest.approx(shape.position, abs=1e-10)


@pytest.mark.parametrize("change", [{"_STEP": 0.3}, {"_DAMPING": (5.0,)}, {"_BATCH": 7}])
def test_statics_know_no_pseudo_time(monkeypatch, change):
    shape = settle(BEAM, [TCA], [0.03], nodes=8, tip_force=(0.0, 1e-3, 0.0))
    for name, value in change.items():
        monkeypatch.setattr(sys.modules["tca_mj.model.at_rest"], name, value)
    other = settle(BEAM, [TCA], [0.03], nodes=8, tip_force=(0.0, 1e-3, 0.0))
    assert other.position == pytest.approx(shape.position, abs=1e-10)


def test_the_base_holds_load_and_weight_and_no_tension():
    """Force and moment balance of the whole; the TCAs are inside."""
    force, moment = np.array([1e-3, 2e-3, -1e-3]), np.array([1e-5, 0.0, 2e-5])
    gravity = np.array([0.0, 0.0, 9.81])
    shape = settle(BEAM, parallel(3, 4e-3), [0.03, 0.02, 0.0], nodes=32,
                   tip_force=force, tip_moment=moment, gravity=gravity)  # fmt: skip
    assert shape.base_force == pytest.approx(-force - BEAM.mass * gravity, abs=1e-12)
    centre = np.trapezoid(shape.position, shape.arc_length, axis=0) / L
    weight = np.cross(centre, BEAM.mass * gravity)
    held = -moment - np.cross(shape.tip, force) - weight
    assert shape.base_moment == pytest.approx(held, abs=1e-3 * np.linalg.norm(weight))

    free = settle(BEAM, [TCA, Helix(4e-3, 1.0)], [0.02, 0.02], nodes=8)
    assert free.base_force == pytest.approx(np.zeros(3), abs=1e-11)
    assert free.base_moment == pytest.approx(np.zeros(3), abs=1e-13)


@pytest.mark.parametrize("route", [TCA, Helix(4e-3, 1.0), UTurn.double_helix(4e-3, 1.0)])
def test_a_tca_neither_moves_nor_turns_a_body_that_floats(route):
    """Its force on the six freedoms of the whole is zero: it pulls on nothing outside."""
    spec = new_spec("floating")
    base = spec.worldbody.add_body(name="base")
    base.add_freejoint()
    base.add_geom(size=[1e-3, 1e-3, 1e-3], mass=1e-3)
    chain = add_chain(base, BEAM, nodes=8, name="body")
    length = sum(leg_length(leg, L) for leg in route.legs)
    route_tca(spec, CATALOGUE["free-stroke"].of_length(length), route_passes(chain, route),
              name="tca")  # fmt: skip
    model = spec.compile()
    data = mujoco.MjData(model)
    model.actuator_biasprm[0, 0] = -0.5
    data.qpos[7:] = 0.3 * np.random.default_rng(1).standard_normal(model.nq - 7)
    data.qpos[7:][model.jnt_type[1:] == int(mujoco.mjtJoint.mjJNT_SLIDE)] *= 1e-3
    mujoco.mj_forward(model, data)
    assert np.abs(data.qfrc_actuator[6:]).max() > 1e-4
    assert data.qfrc_actuator[:3] == pytest.approx(np.zeros(3), abs=1e-14)
    assert data.qfrc_actuator[3:6] == pytest.approx(np.zeros(3), abs=1e-16)


def built(nodes=5, **options):
    spec = new_spec("test")
    return spec, add_chain(spec.worldbody, BEAM, nodes=nodes, name="body", **options)


def test_the_chain_has_the_mass_and_the_stiffness_of_the_beam():
    spec, chain = built()
    model = spec.compile()
    assert model.body_mass.sum() == pytest.approx(BEAM.mass, rel=1e-12)
    assert chain.nodes == 5 and len(chain.pieces) == 6 and chain.tip is chain.pieces[-1]
    assert chain.points == pytest.approx(np.linspace(0.0, L, 6))
    for motion, whole in (("stretch", EA), ("bend_x", EI), ("bend_y", EI), ("twist", BEAM.torsion)):
        springs = [model.joint(joints[motion]).stiffness[0] for joints in chain.joints]
        assert 1.0 / np.sum(1.0 / np.array(springs)) == pytest.approx(whole / L, rel=1e-12)


def test_nodes_stand_half_a_cell_from_the_ends_and_their_joints_are_mirrored():
    spec, chain = built()
    model = spec.compile()
    nodes = np.cumsum([model.body(piece.name).pos[2] for piece in chain.pieces[1:]])
    assert nodes == pytest.approx((np.arange(5) + 0.5) * L / 5)
    orders = [tuple(joints) for joints in chain.joints]
    assert all(orders[i] == orders[i + 1][::-1] for i in range(4))


def test_motions_may_be_left_out():
    spec, chain = built(motions=("bend_y", "bend_x"))
    assert chain.motions == ("bend_x", "bend_y")
    assert spec.compile().nv == 10


def test_pieces_never_touch_each_other():
    """Bent by half a turn the skins overlap; only objects and ground see them."""
    spec, _ = built(nodes=16)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[model.jnt_axis[:, 0] == 1.0] = math.pi / 16
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def lay(route, length=None, nodes=8, **options):
    spec, chain = built(nodes=nodes)
    rest = sum(leg_length(leg, L) for leg in route.legs) if length is None else length
    tca = CATALOGUE["free-stroke"].of_length(rest)
    return spec, route_tca(spec, tca, route_passes(chain, route), name="tca", **options)


def test_a_stretched_tca_is_shorter_than_its_route():
    _, routed = lay(TCA, length=0.9 * L, stretch=0.1 * L)
    assert routed.path_length == pytest.approx(L) and routed.stretch == pytest.approx(0.1 * L)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: built(nodes=0), "nodes must be at least 1, got 0"),
        (lambda: built(motions=("bend",)), r"motions\[0\] must be one of .*, got 'bend'"),
        (lambda: built(motions=()), r"motions must be some of .*, got \(\)"),
        (lambda: lay(Helix(5e-3)), r"route of tca must stay inside .* \(0\.00500, 0\.00000\) m"),
        (lambda: lay(Helix(4e-3, 5.0)), "at least three sites per turn, got 1.60"),
        (lambda: lay(TCA, length=0.044), r"route's length 0\.045000 m, got 0\.044000 m"),
        (lambda: lay(TCA, stretch=1e-3), r"route's length 0\.045000 m, got 0\.046000 m"),
    ],
)
def test_what_cannot_be_built_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_tca_needs_a_leg():
    spec, _ = built()
    with pytest.raises(ValueError, match="passes must name at least one leg, got none"):
        route_tca(spec, CATALOGUE["free-stroke"], (), name="tca")


def test_parts_are_attached_by_name():
    def part():
        spec, chain = built(nodes=2)
        chain.tip.add_site(name="tip", pos=[0.0, 0.0, chain.local(2)])
        tca = CATALOGUE["free-stroke"]
        routed = route_tca(spec, tca, route_passes(chain, TCA), name="tca")
        return Part(spec, (routed,), {"tip": "tip"})

    whole = part()
    whole.attach(part(), to="tip", prefix="upper")
    assert [tca.name for tca in whole.tcas] == ["tca", "upper.tca"]
    assert whole.sites["upper.tip"] == "upper.tip"
    model = whole.spec.compile()
    assert {model.tendon(tca.name).id for tca in whole.tcas} == {0, 1}
    crossings = [crossing for tca in whole.tcas for crossing in tca.crossings]
    assert len(crossings) == 4
    assert all(model.joint(name).id >= 0 for item in crossings for name in item.joints.values())
    with pytest.raises(ValueError, match="to must be a site of this part, .* got 'top'"):
        whole.attach(part(), to="top", prefix="third")
    with pytest.raises(ValueError, match=r"new names, got 'upper': \['upper\.tca'\] exist"):
        whole.attach(part(), to="upper.tip", prefix="upper")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tensions": [-0.1]}, r"tensions\[0\] must be finite and at least 0 N, got"),
        ({"tensions": [0.1, 0.1]}, "tensions must be one per route, 1, got 2"),
        ({"tensions": [math.nan]}, r"tensions\[0\] must be a number or a StrandLaw, got nan"),
        ({"tip_force": (0.0, 1.0)}, r"tip_force must be finite numbers of shape \(3,\)"),
        ({"tip_moment": (0.0, 1.0, math.inf)}, "tip_moment must be finite, got"),
        ({"gravity": 9.81}, r"gravity must be finite numbers of shape \(3,\), got 9\.81"),
        ({"nodes": 0}, "nodes must be at least 1, got 0"),
    ],
)
def test_bad_questions_are_refused(change, message):
    arguments = {"routes": [TCA], "tensions": [0.1], "nodes": 8} | change
    with pytest.raises(ValueError, match=message):
        settle(BEAM, **arguments)


def test_a_chain_without_rest_says_how_far_off_it_is(monkeypatch, tmp_path):
    """A force that no small shape of the beam can bear; MuJoCo warns in its log file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys.modules["tca_mj.model.at_rest"], "_MOST", 50)
    with pytest.raises(NotSettledError, match="allowed 1e-11") as caught:
        settle(BEAM, [TCA], [5.0], nodes=8)
    assert caught.value.residual > 1e-6

"""The rod's full boundary value problem against closed forms and a second formulation."""

import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import fsolve
from scipy.special import ellipe, ellipk

import tca_mj.rod.deadload.descent as equilibrium
import tca_mj.rod.deadload.wrench as deadload
import tca_mj.tca.fibre.boundary as coilbvp
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import (
    hat,
    integrate_strain,
    matrix_quaternion,
    quaternion_exp,
    quaternion_log,
    quaternion_matrix,
    quaternion_product,
    running_product,
    screw_translation,
)
from tca_mj.tca import CATALOGUE, CoilRods, untwist
from tca_mj.tca.fibre.boundary import fibre_stiffness, solve_fibre
from tca_mj.tca.fibre.centreline import CONICAL, Centreline, ConicalTca

MADE = CATALOGUE["free-stroke-made"]
FIBRE = MADE.fibre
UNSOFTENED = replace(MADE, fibre=replace(FIBRE, load_softening=(0.0, 0.0, 1.0)))
GRAM = 9.81e-3  # [N]
EX, EY, EZ = np.eye(3)


def coil(coils, tca=MADE):
    """A piece of a TCA with so many coils."""
    return tca.of_length(tca.rest_length * coils / tca.coils)


def straight(length):
    """A straight fibre along x."""
    return Centreline.of_points(np.linspace(0.0, length, 7)[:, None] * EX)


# --- rotations


def test_quaternions_are_rotations_of_any_length():
    rng = np.random.default_rng(1)
    angle = rng.normal(size=(50, 3))
    unit = quaternion_exp(angle)
    matrix = quaternion_matrix(unit)
    np.testing.assert_allclose(quaternion_matrix(-3.7 * unit), matrix, atol=1e-14)
    np.testing.assert_allclose(
        matrix @ np.swapaxes(matrix, 1, 2), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-14
    )
    small = angle / np.maximum(1.0, np.linalg.norm(angle, axis=1, keepdims=True) / 3.0)
    np.testing.assert_allclose(quaternion_log(quaternion_exp(small)), small, atol=1e-14)
    assert not quaternion_log(quaternion_exp(np.zeros(3))).any()
    np.testing.assert_allclose(
        quaternion_matrix(quaternion_product(unit[:-1], unit[1:])), matrix[:-1] @ matrix[1:],
        atol=1e-14,
    )  # fmt: skip
    for r in matrix:
        np.testing.assert_allclose(quaternion_matrix(matrix_quaternion(r)), r, atol=1e-14)
    product = np.eye(3)
    for r, whole in zip(matrix, quaternion_matrix(running_product(unit)), strict=True):
        product = product @ r
        np.testing.assert_allclose(whole, product, atol=1e-13)
    half_turn = np.diag([1.0, -1.0, -1.0])
    np.testing.assert_allclose(quaternion_matrix(matrix_quaternion(half_turn)), half_turn)
    for wrong in (np.zeros((3, 3)), -np.eye(3), np.eye(2)):
        with pytest.raises(ValueError, match="rotation"):
            matrix_quaternion(wrong)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 0.0999, 0.1001, 2.0])
def test_screw_translation_is_the_series_of_the_exponential(size):
    angle = size * np.array([2.0, -1.0, 2.0]) / 3.0
    move = np.array([0.3, 1.0, -0.4])
    term = total = move
    for k in range(2, 40):
        term = hat(angle) @ term / k
        total = total + term
    np.testing.assert_allclose(screw_translation(angle, move), total, rtol=1e-14, atol=1e-15)


def test_frames_solve_the_quaternion_equation_with_order_four():
    """h' of Sun, eq. (3.32), left unnormalised, by an independent integrator."""

    def u(s):
        return np.array([np.sin(3.0 * s), 2.0 - s, 1.0 + np.cos(2.0 * s)])

    def v(s):
        return np.array([0.1 * s, 0.0, 1.0 + 0.2 * np.sin(s)])

    def slope(s, y):
        (x, y_, z), h = u(s), y[:4]
        matrix = np.array([[0, -x, -y_, -z], [x, 0, z, -y_], [y_, -z, 0, x], [z, y_, -x, 0]])
        return np.concatenate([0.5 * matrix @ h, quaternion_matrix(h) @ v(s)])

    start = np.array([2.0, 0.0, -1.0, 0.5])  # not of unit length
    exact = solve_ivp(slope, (0.0, 3.0), [*start, 0, 0, 0], "DOP853", rtol=1e-13, atol=1e-14).y
    error = []
    for n in (20, 40, 80):
        s = np.linspace(0.0, 3.0, 2 * n + 1)
        h, p = integrate_strain(u(s).T, np.array([v(x) for x in s]), 3.0 / n, start)
        turn = quaternion_matrix(h[-1]) - quaternion_matrix(exact[:4, -1])
        error.append([np.abs(turn).max(), np.abs(p[-1] - exact[4:, -1]).max()])
    rate = np.log2(np.divide(error[:-1], error[1:]))
    assert np.all(rate > 3.7) and np.all(np.array(error[-1]) < 1e-6)


# --- reference shapes


def test_the_conical_spiral_reaches_the_published_lengths():
    """Sun, Table 3.2: 57 mm made, 145 mm of fibre, 5.3 coils; 8.2 mm below the cone's tip."""
    assert CONICAL.fibre_length == pytest.approx(145e-3, abs=0.2e-3)
    assert CONICAL.coils == pytest.approx(5.3, abs=0.1)
    # From the tip itself the same fibre would make 63 mm.
    assert CONICAL.arc_length(63e-3) == pytest.approx(145e-3, abs=1e-3)


def test_strain_and_start_of_the_conical_tca_reproduce_its_spiral():
    line = CONICAL.centreline()
    shape = solve_fibre(line, CONICAL.fibre, 25.0, tolerance=1e-12)
    spiral = CONICAL.position(CONICAL.height(shape.arc_length))
    assert np.abs(shape.position - spiral).max() < 1e-11
    assert shape.error < 1e-12
    np.testing.assert_allclose(shape.rotation[:, :, 1] @ EZ > 0, True)  # right-handed, rising


def test_arc_length_curvature_and_torsion_against_differences():
    z, d = np.linspace(9e-3, 64e-3, 12), 1e-5
    points = CONICAL.position(z[:, None] + d * np.arange(-3, 4))
    weights = (  # of central differences over seven points: first, second and third derivative
        np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * d),
        np.array([2, -27, 270, -490, 270, -27, 2]) / (180 * d**2),
        np.array([1, -8, 13, 0, -13, 8, -1]) / (8 * d**3),
    )
    first, second, third = (np.einsum("nki,k->ni", points, w) for w in weights)
    cross = np.cross(first, second)
    speed, area = np.linalg.norm(first, axis=1), np.linalg.norm(cross, axis=1)
    np.testing.assert_allclose(CONICAL.curvature(z), area / speed**3, rtol=1e-7)
    np.testing.assert_allclose(CONICAL.torsion(z), np.sum(cross * third, 1) / area**2, rtol=1e-4)
    slope = (CONICAL.arc_length(z + d) - CONICAL.arc_length(z - d)) / (2 * d)
    np.testing.assert_allclose(slope, speed, rtol=1e-6)
    s = np.linspace(0.0, CONICAL.fibre_length, 9)
    back = CONICAL.arc_length(CONICAL.height(s)) - CONICAL.arc_length(CONICAL.start)
    np.testing.assert_allclose(back, s, atol=1e-15)


@pytest.mark.parametrize(("temperature", "force"), [(25.0, 0.0), (90.0, 0.0), (60.0, 5e-3)])
def test_points_of_a_curve_are_enough(temperature, force):
    """The spiral known only as p(z), in frames of its own, moves like the analytic one."""
    spec = CONICAL
    known = Centreline.of_curve(spec.position, spec.start, spec.start + spec.made_length, 1001)
    assert known.length == pytest.approx(spec.fibre_length, rel=1e-11)
    numeric = solve_fibre(known, spec.fibre, temperature, force * EZ, tolerance=1e-8)
    analytic = solve_fibre(spec.centreline(), spec.fibre, temperature, force * EZ, tolerance=1e-8)
    assert np.linalg.norm(numeric.end - analytic.end) < 1e-7 * spec.fibre_length


def test_a_curve_through_points_is_of_order_four():
    """And keeps its frame where it is straight: a wave has no curvature at its inflections."""

    def wave(x):
        return np.stack([x, 2e-3 * np.sin(200.0 * x), np.zeros_like(x)], axis=-1)

    error = []
    for samples in (51, 101, 201):
        line = Centreline.of_curve(wave, 0.0, 0.1, samples)
        shape = solve_fibre(line, FIBRE, 25.0, tolerance=1e-10)
        error.append(np.linalg.norm(shape.end - wave(0.1)))
    assert np.all(np.log2(np.divide(error[:-1], error[1:])) > 3.7)
    assert error[-1] < 1e-4 * line.length


# --- the uniform helix


class LockedHelix:
    """A loaded TCA with locked ends as ``CoilRods.helix`` has it, hanging along -z."""

    def __init__(self, tca, length, temperature):
        helix = CoilRods([tca]).shape(np.array([length]), np.array([temperature]))
        self.pitch, self.radius = helix.pitch[0], helix.radius[0]
        self.tension, self.winding = helix.tension[0], tca.winding
        self.fall = length / tca.fibre_length
        sin, cos = math.sin(self.pitch), math.cos(self.pitch)
        # In the section's frame: down along the axis, and around it.
        down, around = np.array([0.0, cos, sin]), np.array([0.0, -sin, cos])
        self.u = self.winding * down
        self.v = self.radius * self.winding * around + self.fall * down
        self.m = helix.moment[0] * down + self.tension * self.radius * around
        self.n = self.tension * down

    def place(self, s):
        """Frame and position at s, which may be complex."""
        phi = self.winding * s
        inwards = np.array([-np.cos(phi), np.sin(phi), 0.0])
        around = np.array([-np.sin(phi), -np.cos(phi), 0.0])
        tangent = math.cos(self.pitch) * around - math.sin(self.pitch) * EZ
        frame = np.stack([inwards, np.cross(tangent, inwards), tangent], axis=1)
        return frame, -self.radius * inwards - self.fall * s * EZ


@pytest.mark.parametrize("temperature", [25.0, 160.0])
@pytest.mark.parametrize("share", [0.8, 1.0, 1.4])
def test_the_uniform_helix_satisfies_the_differential_equations(temperature, share):
    """Sun, eqs. (3.6) to (3.8), residuals over the size of the terms, by a complex step."""
    tca = MADE
    helix = LockedHelix(tca, share * tca.rest_length, temperature)
    torsion = helix.tension * FIBRE.radius * math.cos(tca.pitch_angle)
    torsion /= 2.0 * FIBRE.shear * FIBRE.second_moment
    k = fibre_stiffness(FIBRE, temperature, torsion)
    hot = Centreline.of_tca(tca).strain(np.zeros(1))[0] + untwist(FIBRE, temperature) * EZ
    bend, stretch = np.array(k)[[0, 0, 1]], np.array(k)[[2, 2, 3]]
    law = (bend * (helix.u - hot) - helix.m) / (k.torsion * tca.winding)
    assert np.abs(law).max() < 1e-10
    assert np.abs(stretch * (helix.v - EZ) - helix.n).max() < 1e-10 * k.shear
    for s in np.linspace(0.0, tca.fibre_length, 5):
        frame, position = helix.place(s + 1e-20j)
        slope, r = frame.imag / 1e-20, frame.real
        assert np.abs(slope - r @ hat(helix.u)).max() < 1e-8 * tca.winding
        assert np.abs(position.imag / 1e-20 - r @ helix.v).max() < 1e-8
        balance = slope @ helix.m + np.cross(r @ helix.v, r @ helix.n)
        assert np.abs(balance).max() < 1e-8 * k.torsion * tca.winding**2
        assert np.abs(slope @ helix.n).max() < 1e-8 * k.torsion * tca.winding**3


@pytest.mark.parametrize("coils", [10, 40])
def test_with_the_loads_of_the_uniform_helix_the_solver_returns_it(coils):
    """Clamped in its own frame, with its own moment at the fibre's end: no end effects are left."""
    tca, temperature = coil(coils, UNSOFTENED), 120.0
    helix = LockedHelix(tca, 1.1 * tca.rest_length, temperature)
    frame, start = helix.place(0.0)
    line = replace(Centreline.of_tca(tca), position=start, rotation=frame)
    last, end = helix.place(tca.fibre_length)
    shape = solve_fibre(
        line, tca.fibre, temperature, -helix.tension * EZ, last @ helix.m, tolerance=1e-8
    )
    np.testing.assert_allclose(shape.end, end, atol=1e-7 * tca.fibre_length)
    for found, exact in ((shape.angular, helix.u), (shape.linear, helix.v), (shape.moment, helix.m),
                         (shape.force, helix.n)):  # fmt: skip
        assert np.abs(found - exact).max() < 5e-6 * np.abs(exact).max()
    np.testing.assert_allclose(shape.rotation[-1], last, atol=5e-6)
    assert shape.residual < 1e-12


def free_helix_length(tca, temperature, load):
    """Length of the uniform helix whose ends may spin: the four equations with M = 0."""
    fibre, r0, pitch = tca.fibre, tca.coil_radius, tca.pitch_angle
    torsion = load * fibre.radius * math.cos(pitch) / (2.0 * fibre.shear * fibre.second_moment)
    k = fibre_stiffness(fibre, temperature, torsion)
    kappa = math.cos(pitch) ** 2 / r0
    tau = math.sin(pitch) * math.cos(pitch) / r0 + float(untwist(fibre, temperature))

    def equations(x):
        b, wind, r, fall = x[0], x[1] / r0, x[2] * r0, x[3]
        s, c = math.sin(b), math.cos(b)
        return (
            r0 * (wind * c - kappa + load * r * s / k.bending),
            r0 * (wind * s - tau - load * r * c / k.torsion),
            fall * c - r * wind * s - load * c / k.shear,
            r * wind * c + fall * s - 1.0 - load * s / k.stretch,
        )

    found, _, ok, _ = fsolve(
        equations, [pitch, math.cos(pitch), 1.0, math.sin(pitch)], full_output=True, xtol=1e-13
    )
    assert ok == 1
    return found[3] * tca.fibre_length


def test_the_free_helix_of_this_file_is_the_published_one():
    """175 mm of fibre hang 67.61, 78.66 and 88.58 mm down under 2, 30 and 60 g (rod theory)."""
    for grams, length in ((2.0, 67.61e-3), (30.0, 78.66e-3), (60.0, 88.58e-3)):
        assert free_helix_length(MADE, 25.0, grams * GRAM) == pytest.approx(length, rel=2e-4)


@pytest.mark.parametrize("temperature", [25.0, 160.0])
@pytest.mark.parametrize("grams", [2.0, 30.0, 60.0])
def test_end_effects_vanish_with_the_number_of_coils(grams, temperature):
    """The ends add the same length to every coil: its share halves as the coils double."""
    added = {}
    for coils, bound in ((10, 0.02), (20, 0.01), (40, 0.005)):
        tca = coil(coils)
        shape = solve_fibre(Centreline.of_tca(tca), tca.fibre, temperature, -grams * GRAM * EZ)
        uniform = free_helix_length(tca, temperature, grams * GRAM)
        added[coils] = -shape.end[2] - uniform
        assert abs(added[coils]) < bound * uniform
        assert shape.error < 1e-6 * tca.fibre_length
        # The load hangs from the fibre's end, which has come to the axis.
        if grams > 2.0:
            assert np.hypot(*shape.end[:2]) < 0.4 * tca.coil_radius
    assert added[20] == pytest.approx(added[10], rel=0.1)
    assert added[40] == pytest.approx(added[20], rel=0.05)


# --- the whole problem


def test_the_equations_as_published_by_another_solver():
    """Position, non-unit quaternion and world-frame wrench in SciPy's solver, 4 coils at 30 g."""
    tca, temperature, load = coil(4), 120.0, -30.0 * GRAM * EZ
    line, length = Centreline.of_tca(tca), tca.fibre_length
    shape = solve_fibre(line, tca.fibre, temperature, load, tolerance=1e-9)
    torsion = np.linalg.norm(load) * FIBRE.radius * math.cos(tca.pitch_angle)
    torsion /= 2.0 * FIBRE.shear * FIBRE.second_moment
    k = np.array(fibre_stiffness(FIBRE, temperature, torsion))
    a = tca.coil_radius
    hot = a * (line.strain(np.zeros(1))[0] + untwist(FIBRE, temperature) * EZ)
    moments, forces = k[1] / a, k[1] / a**2  # units, with lengths in coil radii

    def slope(s, y):
        rotation = quaternion_matrix(y[3:7].T)
        u = hot + np.einsum("nji,jn->ni", rotation, y[7:10]) * (k[1] / k[[0, 0, 1]])
        local = np.einsum("nji,jn->ni", rotation, y[10:])
        v = EZ + local * forces / k[[2, 2, 3]]
        travel = np.einsum("nij,nj->in", rotation, v)
        spin = 0.5 * quaternion_product(y[3:7].T, np.insert(u, 0, 0.0, axis=1)).T
        turn = -np.cross(travel.T, y[10:].T).T
        return np.vstack([travel, spin, turn, np.zeros_like(travel)])

    h0, p0 = matrix_quaternion(line.rotation), line.position / a

    def ends(first, last):
        return np.concatenate(
            [first[:3] - p0, first[3:7] - h0, last[7:10], last[10:] - load / forces]
        )

    mesh = np.linspace(0.0, length / a, 201)
    start = solve_fibre(line, tca.fibre, 25.0, intervals=200)  # the cold coil without load
    guess = np.vstack([start.position.T / a, start.quaternion.T, np.zeros((6, 201))])
    found = solve_bvp(slope, ends, mesh, guess, tol=1e-7, max_nodes=4000)
    assert found.success
    np.testing.assert_allclose(shape.end, a * found.y[:3, -1], atol=1e-6 * length)
    base = quaternion_matrix(found.y[3:7, 0]).T @ found.y[7:10, 0] * moments
    np.testing.assert_allclose(shape.moment[0], base, atol=1e-5 * np.abs(base).max())


def test_convergence_is_of_order_four():
    line, force = CONICAL.centreline(), np.array([1e-3, 0.0, 5e-3])
    exact = solve_fibre(line, CONICAL.fibre, 60.0, force, intervals=2048)
    error, wrong = [], []
    for intervals in (128, 256, 512):
        shape = solve_fibre(line, CONICAL.fibre, 60.0, force, intervals=intervals)
        assert len(shape.position) == intervals + 1 and math.isnan(shape.error)
        error.append(np.linalg.norm(shape.end - exact.end))
        wrong.append(np.abs(shape.moment - exact.moment[:: 2048 // intervals]).max())
    assert np.all(np.log2(np.divide(error[:-1], error[1:])) > 3.7)
    assert np.all(np.log2(np.divide(wrong[:-1], wrong[1:])) > 3.7)
    # The estimate that ends the refinement is not too small.
    chosen = solve_fibre(line, CONICAL.fibre, 60.0, force, tolerance=1e-6)
    assert np.linalg.norm(chosen.end - exact.end) < 1.2 * chosen.error
    assert chosen.error <= 1e-6 * line.length


def test_wrench_and_shape_belong_together():
    """The moment is the lever of the force, and force along moment is kept: first integrals."""
    force = np.array([2e-3, -1e-3, 8e-3])
    shape = solve_fibre(CONICAL.centreline(), CONICAL.fibre, 70.0, force, tolerance=1e-9)
    frames = shape.rotation
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", frames, shape.force), np.tile(force, (len(frames), 1)), atol=1e-9
    )
    lever = np.cross(shape.end - shape.position, force)
    world = np.einsum("nij,nj->ni", frames, shape.moment)
    np.testing.assert_allclose(world, lever, atol=1e-7 * np.abs(lever).max())
    assert np.abs(np.sum(shape.force * shape.moment, axis=1)).max() < 1e-9 * np.abs(lever).max()


def test_a_moment_bends_a_straight_fibre_to_a_circle():
    length, turns = 50e-3, 0.75
    moment = fibre_stiffness(FIBRE, 25.0).bending * 2.0 * np.pi * turns / length
    shape = solve_fibre(straight(length), FIBRE, 25.0, moment=moment * EZ, tolerance=1e-10)
    radius = length / (2.0 * np.pi * turns)
    angle = 2.0 * np.pi * turns
    end = radius * np.array([math.sin(angle), 1.0 - math.cos(angle), 0.0])
    np.testing.assert_allclose(shape.end, end, atol=1e-9 * length)


@pytest.mark.parametrize("degrees", [20.0, 60.0, 120.0])
def test_a_pushed_straight_fibre_buckles_to_the_elastica(degrees):
    """Euler's load, and beyond it the elliptic integrals; the straight state is not stable."""
    length, k = 100e-3, math.sin(math.radians(degrees) / 2.0)
    line = straight(length)
    bending = fibre_stiffness(FIBRE, 25.0).bending
    euler = bending * (np.pi / (2.0 * length)) ** 2
    below = solve_fibre(line, FIBRE, 25.0, -0.99 * euler * EX)
    np.testing.assert_allclose(below.end, [length, 0.0, 0.0], atol=1e-5 * length)
    force = bending * (float(ellipk(k * k)) / length) ** 2
    shape = solve_fibre(line, FIBRE, 25.0, -force * EX)
    along = length * (2.0 * float(ellipe(k * k)) / float(ellipk(k * k)) - 1.0)
    across = 2.0 * k * length / float(ellipk(k * k))
    assert shape.end[0] == pytest.approx(along, abs=1e-4 * length)
    assert np.hypot(*shape.end[1:]) == pytest.approx(across, abs=1e-4 * length)


def test_the_solved_state_has_the_least_energy():
    """First variation zero, second positive, of an energy written and differentiated here."""
    tca, temperature = coil(10), 160.0
    load = -60.0 * GRAM * EZ
    line = Centreline.of_tca(tca)
    shape = solve_fibre(line, tca.fibre, temperature, load, intervals=2000)
    torsion = 60.0 * GRAM * FIBRE.radius * math.cos(tca.pitch_angle)
    torsion /= 2.0 * FIBRE.shear * FIBRE.second_moment
    k = np.array(fibre_stiffness(FIBRE, temperature, torsion))
    hot = line.strain(shape.arc_length) + untwist(FIBRE, temperature) * EZ
    s = shape.arc_length / tca.fibre_length

    def energy(size, waves, amplitude):
        """Every section turned by w about its own axes; u changes by w' + u x w + O(w^2)."""
        w = size * np.sin(np.pi * np.outer(s, waves)) @ amplitude
        dw = size * np.cos(np.pi * np.outer(s, waves)) * (np.pi * waves) @ amplitude
        angle = np.maximum(np.linalg.norm(w, axis=1, keepdims=True), 1e-4)
        turned = quaternion_matrix(quaternion_exp(w))
        across, twice = np.cross(w, dw), np.cross(w, np.cross(w, dw))
        first, second = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
        rate = (dw - first * across + second * twice) / tca.fibre_length
        u = np.einsum("nji,nj->ni", turned, shape.angular) + rate
        n = np.einsum("nji,nj->ni", turned, shape.force)
        density = 0.5 * np.sum(k[[0, 0, 1]] * (u - hot) ** 2, 1)
        density -= n[:, 2] + 0.5 * np.sum(n * n / k[[2, 2, 3]], 1)
        return np.trapezoid(density, shape.arc_length)

    rng = np.random.default_rng(2)
    for _ in range(8):
        waves = rng.integers(1, 24, 3) + 0.5  # free at the end, clamped at the base
        amplitude = rng.normal(size=(3, 3))
        there, here, back = (energy(size, waves, amplitude) for size in (0.05, 0.0, -0.05))
        curvature = there - 2.0 * here + back
        assert curvature > 0.0
        assert abs(there - back) < 0.05 * curvature
        there, back = energy(1e-4, waves, amplitude), energy(-1e-4, waves, amplitude)
        assert abs(there - back) / 2e-4 < 1e-3 * curvature / 0.05


# --- the conical TCA


@pytest.fixture(scope="module")
def heated():
    """Shapes of the unloaded conical TCA at 25 to 160 °C."""
    line = CONICAL.centreline()
    return {t: solve_fibre(line, CONICAL.fibre, float(t)) for t in range(25, 161)}


def height(shape):
    """Height of the centre line above the clamp [m]."""
    return shape.position[:, 2] - shape.position[0, 2]


def rises(shape):
    """Rise of the five turns from the small to the big one, as they are wound [m]."""
    edges = CONICAL.start + CONICAL.made_length - CONICAL.pitch * np.arange(5, -1, -1)
    s = CONICAL.arc_length(edges) - CONICAL.arc_length(CONICAL.start)
    return np.diff(np.interp(s, shape.arc_length, shape.position[:, 2]))


def test_the_conical_tca_turns_inside_out(heated):
    """Sun, Section 3.4.5: big turns pass small ones, the stroke goes to both sides."""
    assert height(heated[25])[-1] == pytest.approx(57e-3)
    # The end is above the clamp at 70 °C and nearly as far below at 115 °C.
    assert height(heated[70])[-1] > 0.3 * 57e-3
    assert height(heated[115])[-1] < -0.8 * 57e-3
    ends = [height(heated[t])[-1] for t in range(25, 151)]
    assert np.all(np.diff(ends) < 0.0)
    # Turn by turn, the biggest first; four of the five hang down at 115 °C.
    first_down = [next((t for t in heated if rises(heated[t])[k] < 0.0), 999) for k in range(5)]
    assert first_down == sorted(first_down, reverse=True)
    assert list(np.sign(rises(heated[70]))) == [1, 1, 1, 1, -1]
    assert list(np.sign(rises(heated[115]))) == [1, -1, -1, -1, -1]


def test_the_stroke_of_the_conical_tca_is_above_100_percent(heated):
    stroke = {t: 1.0 - height(heated[t])[-1] / height(heated[25])[-1] for t in heated}
    assert stroke[80] < 1.0 < stroke[85]
    assert stroke[115] > 1.8
    assert stroke[150] > 2.4


def test_the_conical_tca_never_lies_in_one_plane(heated):
    """Neither level, nor in any other plane, at any temperature."""
    for shape in heated.values():
        assert np.ptp(height(shape)) > 0.3 * 57e-3
        middle = shape.position - shape.position.mean(axis=0)
        normal = np.linalg.svd(middle, full_matrices=False)[2][2]
        assert np.ptp(middle @ normal) > 6e-3  # 15 diameters of the fibre


def test_without_load_no_equation_is_solved(heated):
    """The strain is the reference strain plus the untwist, exactly."""
    line = CONICAL.centreline()
    for t in (25, 90, 160):
        shape = heated[t]
        hot = line.strain(shape.arc_length) + float(untwist(CONICAL.fibre, float(t))) * EZ
        np.testing.assert_allclose(shape.angular, hot, rtol=1e-13, atol=1e-10)
        assert not shape.moment.any() and not shape.force.any() and shape.residual == 0.0


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.01), (0.0, 0.0, -0.005), (0.01, 0.0, 0.0)])
def test_a_soft_fibre_that_snaps_is_followed_to_a_stable_state(force):
    """A hot conical TCA under 0.5 to 1 g: balanced, with frames and positions to the tolerance."""
    shape = solve_fibre(CONICAL.centreline(), CONICAL.fibre, 90.0, force, tolerance=1e-7)
    lever = np.cross(shape.end - shape.position, force)
    world = np.einsum("nij,nj->ni", shape.rotation, shape.moment)
    np.testing.assert_allclose(world, lever, atol=1e-5 * np.abs(lever).max())
    assert shape.residual < 1e-11


def test_the_table_of_the_page_is_what_the_script_prints():
    """After a change: python scripts/conical_tca.py --table, and copy into docs/coil-bvp.md."""
    pytest.importorskip("matplotlib")
    root = Path(__file__).resolve().parent.parent
    script = runpy.run_path(str(root / "scripts" / "conical_tca.py"))
    assert script["table"]() in (root / "docs" / "coil-bvp.md").read_text(encoding="utf-8")


# --- errors


def test_a_hot_section_is_stiffer():
    hot = replace(FIBRE, section="hot")
    growth = 1.0 + 3.5e-6 * (160.0**2 - 25.0**2) - 6.7e-5 * 135.0
    ratio = np.array(fibre_stiffness(hot, 160.0)) / np.array(fibre_stiffness(FIBRE, 160.0))
    np.testing.assert_allclose(ratio, [growth**4, growth**4, growth**2, growth**2], rtol=5e-3)


def test_the_load_softens_a_helix_like_the_uniform_one():
    """171 rad/m at 60 g, Sun, Section 3.5.2, from the reference shape; none if pushed."""
    line = Centreline.of_tca(MADE)
    torsion = coilbvp._load_torsion(line, FIBRE, -60.0 * GRAM * EZ)
    assert torsion == pytest.approx(171.0, abs=1.0)
    assert coilbvp._load_torsion(line, FIBRE, 60.0 * GRAM * EZ) == 0.0


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"force": (0.0, 0.0)}, "force"),
        ({"force": (0.0, 0.0, math.nan)}, "force"),
        ({"moment": (math.inf, 0.0, 0.0)}, "moment"),
        ({"temperature": math.nan}, "temperature"),
        ({"temperature": -300.0}, "temperature"),
        ({"temperature": 5000.0}, "modulus"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"intervals": 0}, "intervals"),
    ],
)
def test_bad_arguments_are_refused(change, match):
    arguments = {"temperature": 25.0} | change
    with pytest.raises(ValueError, match=match):
        solve_fibre(CONICAL.centreline(), CONICAL.fibre, **arguments)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Centreline.helix(radius=0.0, pitch_angle=0.2, length=0.1), "radius"),
        (lambda: Centreline.helix(radius=1e-3, pitch_angle=1.6, length=0.1), "pitch_angle"),
        (lambda: Centreline.helix(radius=1e-3, pitch_angle=0.2, length=-0.1), "length"),
        (lambda: replace(CONICAL.centreline(), position=np.zeros(2)), "position"),
        (lambda: replace(CONICAL.centreline(), rotation=2.0 * np.eye(3)), "rotation"),
        (lambda: Centreline.of_points(np.eye(3)), "points"),
        (lambda: Centreline.of_points(np.zeros((9, 3))), "points"),
        (lambda: Centreline.of_points(np.full((9, 3), math.nan)), "points"),
        (lambda: Centreline.of_points(np.arange(27.0).reshape(9, 3), np.zeros(9)), "parameter"),
        (lambda: replace(CONICAL, pitch=0.0), "pitch"),
        (lambda: replace(CONICAL, cone_angle=4.0), "cone_angle"),
        (lambda: replace(CONICAL, start=math.nan), "start"),
    ],
)
def test_bad_shapes_are_refused(make, match):
    with pytest.raises(ValueError, match=match):
        make()
    assert isinstance(CONICAL, ConicalTca)


def test_no_convergence_is_an_error_with_its_residual(monkeypatch):
    line = Centreline.of_tca(coil(10))
    monkeypatch.setattr(coilbvp, "_FINEST", 200)
    with pytest.raises(RodSolveError, match="mesh") as caught:
        solve_fibre(line, FIBRE, 100.0, -0.3 * EZ, tolerance=1e-13)
    assert caught.value.residual > 1e-13
    monkeypatch.setattr(deadload, "_NEWTON_STEPS", 1)
    monkeypatch.setattr(equilibrium, "_STEPS", 1)
    with pytest.raises(RodSolveError, match="energy") as caught:
        solve_fibre(line, FIBRE, 100.0, -0.3 * EZ)
    assert caught.value.residual > 0.0
    with pytest.raises(RodSolveError, match="Newton"):
        solve_fibre(line, FIBRE, 100.0, -0.3 * EZ, 1e-5 * EX)

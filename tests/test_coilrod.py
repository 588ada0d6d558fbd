"""The coil's tension law against rod theory, written out a second time here."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, root

import tca_mj.tca.laws.rod as coilrod
import tca_mj.tca.laws.roots as roots
from tca_mj.tca import CATALOGUE, CoilRods, CoilSolveError, coil_tension

FREE_STROKE = CATALOGUE["free-stroke"]
HOT_SECTION = replace(FREE_STROKE, fibre=replace(FREE_STROKE.fibre, section="hot"))
SPECS = [*CATALOGUE.values(), HOT_SECTION]
IDS = [*CATALOGUE, "free-stroke with hot section"]


class Theory:
    """Stiffnesses and strains of the dissertation's formulas at one temperature."""

    def __init__(self, spec, temperature):
        fibre = spec.fibre
        c2, c1, c0 = fibre.expansion
        t0 = fibre.reference_temperature
        gamma = (c2 * temperature**2 + c1 * temperature + c0) / (c2 * t0**2 + c1 * t0 + c0)
        radius = fibre.radius * (gamma if fibre.section == "hot" else 1.0)
        self.EI = fibre.young * math.pi * radius**4 / 4.0
        self.GJ = fibre.shear * math.pi * radius**4 / 2.0
        self.EA = fibre.young * math.pi * radius**2
        self.GA = fibre.shear * math.pi * radius**2
        self.W = math.cos(spec.pitch_angle) / spec.coil_radius
        self.kappa = math.cos(spec.pitch_angle) ** 2 / spec.coil_radius
        tau = math.sin(spec.pitch_angle) * math.cos(spec.pitch_angle) / spec.coil_radius
        self.tau = tau + fibre.inserted_twist * fibre.untwist_scale * (1.0 / gamma - 1.0)
        self.fall = fibre.softening / fibre.filament_young * (temperature - t0)
        self.mu = fibre.load_softening
        self.torsion_per_tension = radius * math.cos(spec.pitch_angle) / self.GJ

    def left(self, tension):
        torsion = self.torsion_per_tension * max(tension, 0.0)
        return 1.0 - self.fall * np.polyval(self.mu, torsion)

    def residuals(self, pitch, moment, tension, radius, length, left):
        """The four equations of the helix, each over the size of its terms."""
        s, c, W = math.sin(pitch), math.cos(pitch), self.W
        bent = left * self.EI * (W * c - self.kappa)
        twisted = left * self.GJ * (W * s - self.tau)
        sheared = left * self.GA * (length * c - radius * W * s)
        stretched = left * self.EA * (radius * W * c + length * s - 1.0)
        torque = left * self.GJ * W
        return np.array(
            [
                (bent - (moment * c - tension * radius * s)) / torque,
                (twisted - (moment * s + tension * radius * c)) / torque,
                (sheared - tension * c) / (left * self.GA),
                (stretched - tension * s) / (left * self.EA),
            ]
        )


def lengths(spec, count, longest=0.9):
    return np.linspace(0.5001 * spec.minimum_length, longest * spec.fibre_length, count)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_a_cold_tca_at_its_natural_length_does_not_pull(spec):
    tension, _ = coil_tension(spec, spec.rest_length, spec.fibre.reference_temperature)
    assert abs(tension) < 1e-12


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_small_strain_stiffness_is_castiglianos_with_locked_ends(spec):
    """Energy of a helix under F and M, ends kept from turning: 1/K = C_FF - C_FM^2/C_MM."""
    theory = Theory(spec, spec.fibre.reference_temperature)
    s, c, r = math.sin(spec.pitch_angle), math.cos(spec.pitch_angle), spec.coil_radius
    c_ff = r**2 * (c**2 / theory.GJ + s**2 / theory.EI) + c**2 / theory.GA + s**2 / theory.EA
    c_fm = r * s * c * (1.0 / theory.GJ - 1.0 / theory.EI)
    c_mm = s**2 / theory.GJ + c**2 / theory.EI
    locked = 1.0 / (spec.fibre_length * (c_ff - c_fm**2 / c_mm))
    _, stiffness = coil_tension(spec, spec.rest_length, spec.fibre.reference_temperature)
    assert stiffness == pytest.approx(locked, rel=1e-12)
    assert CoilRods([spec]).rest_stiffness[0] == pytest.approx(locked, rel=1e-12)
    # An end free to turn is softer: the difference is not lost in the tolerance.
    assert locked * spec.fibre_length * c_ff > 1.01


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_small_heating_pulls_by_stiffness_times_kinematic_coefficient(spec):
    """F = -K A dtheta with locked ends: A = l_t r cos / (cos^2 + (EI/GJ) sin^2)."""
    rise = 1e-3
    hot = spec.fibre.reference_temperature + rise
    theory, cold = Theory(spec, hot), Theory(spec, spec.fibre.reference_temperature)
    s, c = math.sin(spec.pitch_angle), math.cos(spec.pitch_angle)
    lever = spec.fibre_length * spec.coil_radius * c / (c**2 + theory.EI / theory.GJ * s**2)
    _, stiffness = coil_tension(spec, spec.rest_length, spec.fibre.reference_temperature)
    tension, _ = coil_tension(spec, spec.rest_length, hot)
    assert tension == pytest.approx(-stiffness * lever * (theory.tau - cold.tau), rel=1e-4)
    assert tension > 0.0


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
@pytest.mark.parametrize("temperature", [20.0, 25.0, 100.0, 160.0])
def test_the_four_equations_of_the_helix_hold(spec, temperature):
    length = lengths(spec, 15, 0.97)[:, None]
    helix = CoilRods([spec]).shape(length, np.full_like(length, temperature))
    theory = Theory(spec, temperature)
    for i in range(len(length)):
        left = theory.left(helix.tension[i, 0]) if temperature > 25.0 else 1.0 - theory.fall
        assert helix.softening[i, 0] == pytest.approx(left, rel=1e-10)
        error = theory.residuals(
            helix.pitch[i, 0], helix.moment[i, 0], helix.tension[i, 0], helix.radius[i, 0],
            length[i, 0] / spec.fibre_length, left,
        )  # fmt: skip
        assert np.max(np.abs(error)) < 1e-10


@pytest.mark.parametrize("spec", [FREE_STROKE, HOT_SECTION, CATALOGUE["type-2-200"]])
@pytest.mark.parametrize("share", [1.1, 1.5, 2.5])
def test_tension_against_a_general_root_finder(spec, share):
    """All four equations and the implicit softening at once, from a crude guess."""
    length = share * spec.minimum_length / spec.fibre_length
    theory = Theory(spec, 140.0)

    def equations(unknown):
        pitch, moment, tension, radius = unknown * scale
        return theory.residuals(pitch, moment, tension, radius, length, theory.left(tension))

    scale = np.array([1.0, theory.GJ * theory.W, 1.0, spec.coil_radius])
    found = root(equations, np.array([math.asin(length), 0.0, 0.1, 1.0]), tol=1e-15)
    assert np.max(np.abs(found.fun)) < 1e-13
    tension, _ = coil_tension(spec, length * spec.fibre_length, 140.0)
    assert tension == pytest.approx(found.x[2], rel=1e-9)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
@pytest.mark.parametrize("temperature", [25.0, 90.0, 160.0])
def test_stiffness_against_a_complex_step(spec, temperature):
    """dF/dl = (dF/db)/(dl/db), the explicit chain differentiated without cancellation."""
    theory = Theory(spec, temperature)
    length = np.linspace(1.001 * spec.minimum_length, 0.6 * spec.fibre_length, 9)[:, None]
    rods = CoilRods([spec])
    pitch = rods.shape(length, np.full_like(length, temperature)).pitch[:, 0]
    _, stiffness = rods.tension(length, np.full_like(length, temperature))
    for i, b in enumerate(pitch):
        b = complex(b, 1e-30)
        s, c, W = cmath.sin(b), cmath.cos(b), theory.W
        torque = theory.GJ * c * (W * s - theory.tau) - theory.EI * s * (W * c - theory.kappa)
        skew = s * c * (1.0 / theory.EA - 1.0 / theory.GA)
        # F r = torque with r = (cos b + F skew)/W
        stiff = (cmath.sqrt(c * c + 4.0 * skew * W * torque) - c) / (2.0 * skew)
        ratio = s + stiff * (c * c / theory.GA + s * s / theory.EA)
        mu2, mu1, mu0 = theory.mu if stiff.real > 0.0 else (0.0, 0.0, theory.mu[2])
        per = theory.torsion_per_tension
        quadratic = stiff * theory.fall * mu2 * per**2
        linear = 1.0 + stiff * theory.fall * mu1 * per
        tension = stiff * (1.0 - theory.fall * mu0) / linear
        if abs(quadratic) > 0.0:
            constant = -stiff * (1.0 - theory.fall * mu0)
            discriminant = cmath.sqrt(linear * linear - 4.0 * quadratic * constant)
            tension = -2.0 * constant / (linear + discriminant)
        slope = tension.imag / ratio.imag / spec.fibre_length
        assert stiffness[i, 0] == pytest.approx(slope, rel=1e-9)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
@pytest.mark.parametrize("temperature", [25.0, 100.0, 160.0])
def test_stiffness_against_finite_differences(spec, temperature):
    """Of the whole law, touching coils included."""
    length, step = lengths(spec, 200), 1e-6 * spec.rest_length
    _, stiffness = coil_tension(spec, length[1:], temperature)
    above = coil_tension(spec, length[1:] + step, temperature)[0]
    below = coil_tension(spec, length[1:] - step, temperature)[0]
    np.testing.assert_allclose(stiffness, (above - below) / (2.0 * step), rtol=1e-5)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_tension_rises_with_length(spec):
    length = lengths(spec, 500)
    for temperature in (25.0, 90.0, 160.0):
        tension, stiffness = coil_tension(spec, length, temperature)
        assert np.all(np.diff(tension) > 0.0)
        assert np.all(stiffness > 0.0)


@pytest.mark.parametrize("stiff", [5.4545, 10.0, 30.0])
@pytest.mark.parametrize("pitch", [0.3, 0.6, 0.9, 1.1])
def test_steep_coils_that_are_stiff_in_bending_buckle(stiff, pitch):
    """dF/ds = W² (GJ - EI (1 - cos α*/cos³ b)): it falls where cos³ b > cos α*/(1 - 2 G/E).

    That leaves out shear and stretch, which move the border by 1/100 of a coil this slender.
    """
    fibre = replace(FREE_STROKE.fibre, young=stiff * 0.22e9)
    spec = replace(FREE_STROKE, fibre=fibre, pitch_angle=pitch, minimum_pitch_angle=0.02,
                   coil_radius=10.0 * fibre.radius, stretch_resistance=0.0)  # fmt: skip
    rods = CoilRods([spec])
    length = np.linspace(spec.minimum_length, rods.longest, 500)
    cold = np.full_like(length, 25.0)
    border = (math.cos(pitch) / (1.0 - 2.0 / stiff)) ** (1.0 / 3.0)
    excess = np.cos(rods.shape(length, cold).pitch) - border
    clear = np.abs(excess) > 0.01
    _, slope = rods.tension(length, cold)
    assert np.array_equal((slope < 0.0)[clear], (excess > 0.0)[clear])
    assert clear.any() and (slope > 0.0).any()


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_tension_rises_with_temperature(spec):
    """Up to loads where the softening outweighs the untwist, far above those in use."""
    temperature = np.linspace(25.0, 160.0, 136)
    for length in np.linspace(spec.minimum_length, 1.2 * spec.rest_length, 7):
        tension, _ = coil_tension(spec, length, temperature)
        assert np.all(np.diff(tension) > 0.0)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_touching_coils_take_the_pull_away(spec):
    """No contact above the minimum length; below it the pull is gone within 2 %."""
    low = spec.minimum_length
    rods = CoilRods([spec])
    for temperature in (100.0, 150.0):
        for length in (low, 1.01 * low, spec.rest_length):
            at = np.array([length]), np.array([temperature])
            assert rods.tension(*at)[0] == rods.shape(*at).tension
    # Type 2-200 and the made shape are too long to close at 150 °C; the others press.
    blocked, _ = coil_tension(spec, low, 150.0)
    if blocked > 0.0:
        free = brentq(lambda length: float(coil_tension(spec, length, 150.0)[0]), 0.6 * low, low)
        assert 0.98 * low < free < low
    assert coil_tension(spec, 0.95 * low, 150.0)[0] < 0.0


def test_contact_sets_in_without_a_jump():
    """Tension and stiffness are continuous at both ends of the onset."""
    spec, tiny = FREE_STROKE, 1e-10
    for knot in (spec.minimum_length, spec.minimum_length * (1.0 - spec.contact_smoothing)):
        tension, stiffness = coil_tension(spec, np.array([knot - tiny, knot + tiny]), 150.0)
        assert abs(tension[1] - tension[0]) < 1e-6
        assert stiffness[0] == pytest.approx(stiffness[1], rel=1e-4)
    _, pressed = coil_tension(spec, 0.9 * spec.minimum_length, 25.0)
    _, at_rest = coil_tension(spec, spec.rest_length, 25.0)
    assert pressed == pytest.approx(spec.contact_ratio * at_rest, rel=0.03)


def test_unloaded_contraction_ends_at_the_contact():
    """Sun, Section 2.2.1, 0 g, 25 to 150 °C: type 1-180 20 mm, type 0 4 mm: its free stroke."""
    for name, reported in (("type-1-180", 20e-3), ("type-0-180", 4e-3)):
        spec = CATALOGUE[name]
        free = brentq(
            lambda length: float(coil_tension(spec, length, 150.0)[0]),  # noqa: B023
            0.6 * spec.minimum_length,
            spec.rest_length,
        )
        contraction = spec.rest_length - free
        # The hot coil presses its touching turns together by less than 1 mm more.
        assert 0.0 < contraction - (spec.rest_length - spec.minimum_length) < 1e-3
        assert contraction == pytest.approx(reported, abs=2e-3)


def test_twice_the_length_is_half_the_stiffness():
    spec = FREE_STROKE
    double = spec.of_length(2.0 * spec.rest_length)
    length = np.linspace(0.55 * spec.minimum_length, 2.0 * spec.rest_length, 20)
    tension, stiffness = coil_tension(spec, length, 120.0)
    tension2, stiffness2 = coil_tension(double, 2.0 * length, 120.0)
    np.testing.assert_allclose(tension2, tension, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(stiffness2, 0.5 * stiffness, rtol=1e-9)


def test_one_call_is_the_law_element_by_element():
    """Neither a search within brackets nor touching coils disturb the neighbours."""
    spec = FREE_STROKE
    length = np.array([0.02, 0.045, 0.97 * 0.175, 0.06])
    tension, stiffness = coil_tension(spec, length, 150.0)
    assert tension[0] < -1.0
    for i in range(4):
        alone = coil_tension(spec, length[i], 150.0)
        assert (tension[i], stiffness[i]) == (alone[0], alone[1])


@pytest.mark.parametrize(
    ("length", "temperature", "match"),
    [
        (0.49 * FREE_STROKE.minimum_length, 25.0, "length"),
        (0.981 * FREE_STROKE.fibre_length, 25.0, "length"),
        (math.nan, 25.0, "length"),
        (0.045, math.nan, "temperature"),
        (0.045, -300.0, "temperature"),
        (0.045, 5000.0, "modulus"),
        (0.045, math.inf, "temperature"),
    ],
)
def test_outside_its_domain_the_law_refuses(length, temperature, match):
    with pytest.raises(ValueError, match=match):
        coil_tension(FREE_STROKE, length, temperature)


def test_wrong_shapes_are_refused():
    rods = CoilRods([FREE_STROKE, FREE_STROKE])
    for length, temperature in ((0.045, 25.0), (np.full(3, 0.045), np.full(3, 25.0)),
                                (np.full(2, 0.045), np.full((1, 2), 25.0))):  # fmt: skip
        with pytest.raises(ValueError, match="shape"):
            rods.tension(length, temperature)


def test_no_convergence_is_an_error(monkeypatch):
    monkeypatch.setattr(coilrod, "_STEPS", 0)
    monkeypatch.setattr(roots, "_STEPS", 2)
    with pytest.raises(CoilSolveError) as caught:
        coil_tension(FREE_STROKE, 0.06, 150.0)
    assert caught.value.residual > 1e-13
    monkeypatch.undo()
    monkeypatch.setattr(coilrod, "_STEPS", 0)  # the bracketed search alone finds the same
    bracketed, _ = coil_tension(FREE_STROKE, 0.06, 150.0)
    monkeypatch.undo()
    assert coil_tension(FREE_STROKE, 0.06, 150.0)[0] == pytest.approx(bracketed, rel=1e-11)

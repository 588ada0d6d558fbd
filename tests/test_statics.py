"""Three static models of a TCA: against rod theory written out again, and against each other."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, root

import tca_mj.tca.laws.castigliano as castigliano
import tca_mj.tca.laws.coil as laws
import tca_mj.tca.laws.roots as roots
from tca_mj.tca import (
    CATALOGUE,
    FREE_STROKE_CREPT,
    CoilRods,
    coil_tension,
    hanging_length,
    tension,
)

GRAM = 9.81e-3  # [N]
MADE = CATALOGUE["free-stroke-made"]
HOT_SECTION = replace(MADE, fibre=replace(MADE.fibre, section="hot"))
SPECS = [*CATALOGUE.values(), HOT_SECTION, *FREE_STROKE_CREPT.values()]
IDS = [*CATALOGUE, "hot section", *(f"crept {name}" for name in FREE_STROKE_CREPT)]
SPINS = ["free", "locked"]
MODELS = [
    *({"model": model, "spin": spin} for model, spin in product(["rod", "love"], SPINS)),
    *(
        {"model": "cst", "spin": spin, "scheme": scheme}
        for spin, scheme in product(SPINS, ["linear", "implicit", "path"])
    ),
]
every_model = pytest.mark.parametrize("kind", MODELS, ids=lambda kind: " ".join(kind.values()))
every_spec = pytest.mark.parametrize("spec", SPECS, ids=IDS)


class Theory:
    """Stiffnesses and strains of the dissertation's formulas at one temperature and load."""

    def __init__(self, spec, temperature, load):
        fibre = spec.fibre
        c2, c1, c0 = fibre.expansion
        t0 = fibre.reference_temperature
        gamma = (c2 * temperature**2 + c1 * temperature + c0) / (c2 * t0**2 + c1 * t0 + c0)
        radius = fibre.radius * (gamma if fibre.section == "hot" else 1.0)
        polar = math.pi * radius**4 / 2.0
        torsion = load * radius * math.cos(spec.pitch_angle) / (fibre.shear * polar)
        fall = fibre.softening / fibre.filament_young * (temperature - t0)
        left = 1.0 - fall * np.polyval(fibre.load_softening, torsion)
        self.EI = left * fibre.young * math.pi * radius**4 / 4.0
        self.GJ = left * fibre.shear * math.pi * radius**4 / 2.0
        self.EA = left * fibre.young * math.pi * radius**2
        self.GA = left * fibre.shear * math.pi * radius**2
        self.alpha, self.r = spec.pitch_angle, spec.coil_radius
        self.W = math.cos(self.alpha) / self.r
        self.kappa = math.cos(self.alpha) ** 2 / self.r
        self.tau = math.sin(self.alpha) * math.cos(self.alpha) / self.r
        self.untwist = fibre.inserted_twist * fibre.untwist_scale * (1.0 / gamma - 1.0)
        self.l_t, self.rest = spec.fibre_length, spec.fibre_length * math.sin(self.alpha)

    def rod(self, load, spin):
        """Length from all four equations of the helix, with b, r, l and M or W unknown."""
        size = self.GJ * self.W

        def residuals(unknown):
            b, r, ratio = unknown[0], unknown[1] * self.r, unknown[2]
            moment = 0.0 if spin == "free" else unknown[3] * size
            W = self.W * (unknown[3] if spin == "free" else 1.0)
            s, c = math.sin(b), math.cos(b)
            return [
                (self.EI * (W * c - self.kappa) - (moment * c - load * r * s)) / size,
                (self.GJ * (W * s - self.tau - self.untwist) - (moment * s + load * r * c)) / size,
                ratio * c - r * W * s - load * c / self.GA,
                r * W * c + ratio * s - 1.0 - load * s / self.EA,
            ]

        start = [self.alpha, 1.0, math.sin(self.alpha), 1.0 if spin == "free" else 0.0]
        found = root(residuals, start, tol=1e-14)
        assert np.max(np.abs(found.fun)) < 1e-11
        return self.l_t * found.x[2]

    def lever(self, s, spin):
        """A of Castigliano's theorem; the coil keeps its turns, r = cos/W."""
        c2 = 1.0 - s * s
        share = 1.0 if spin == "free" else c2 + self.EI / self.GJ * s * s
        return self.l_t * c2 / self.W / share

    def compliance(self, s, spin):
        """1/K of Castigliano's theorem: C_FF, and with locked ends C_FF - C_FM^2 / C_MM."""
        c = math.sqrt(1.0 - s * s)
        r = c / self.W
        c_ff = r**2 * (c**2 / self.GJ + s**2 / self.EI) + c**2 / self.GA + s**2 / self.EA
        if spin == "locked":
            c_fm = r * s * c * (1.0 / self.GJ - 1.0 / self.EI)
            c_ff -= c_fm**2 / (s**2 / self.GJ + c**2 / self.EI)
        return self.l_t * c_ff


def contraction(spec, load, hot=160.0, **kind):
    cold, hot = hanging_length(spec, [25.0, hot], load, **kind)
    return cold - hot


@pytest.mark.parametrize(
    ("weight", "cold", "stroke"), [(2, 67.61, 24.16), (30, 78.66, 20.44), (60, 88.58, 11.59)]
)
def test_free_stroke_tca_of_table_3_2(weight, cold, stroke):
    """Printed pitch as the reference under every load, cold section, free ends, 25 to 160 °C."""
    length = 1e3 * hanging_length(MADE, [25.0, 160.0], weight * GRAM)
    assert length[0] == pytest.approx(cold, rel=1e-4)
    assert length[0] - length[1] == pytest.approx(stroke, abs=0.006)
    # Far from touching (28.7 mm), so that these numbers do not know the contact.
    assert length[1] > 43.0 > 1e3 * MADE.minimum_length


def test_distances_between_the_models():
    """Contractions at 60 g and 160 °C over the rod's: Love locked, the others free."""
    rod = contraction(MADE, 60 * GRAM)
    love = contraction(MADE, 60 * GRAM, model="love") / rod - 1.0
    implicit = contraction(MADE, 60 * GRAM, model="cst", scheme="implicit") / rod - 1.0
    path = contraction(MADE, 60 * GRAM, model="cst", scheme="path") / rod - 1.0
    assert 0.30 < love < 0.45 and 0.20 < implicit < 0.32 and 0.0 < path < 0.10
    assert (love, implicit, path) == pytest.approx((0.383, 0.260, 0.078), abs=1e-3)
    # The error grows with the load in all of them.
    for kind in ({"model": "love"}, {"model": "cst"}, {"model": "cst", "scheme": "path"}):
        low = contraction(MADE, 2 * GRAM, **kind) / contraction(MADE, 2 * GRAM) - 1.0
        assert abs(low) < 0.1
        assert abs(low) < contraction(MADE, 60 * GRAM, **kind) / rod - 1.0


@every_spec
@pytest.mark.parametrize("spin", SPINS)
@pytest.mark.parametrize("temperature", [10.0, 25.0, 100.0, 160.0])
def test_rod_against_a_general_root_finder(spec, spin, temperature):
    for share in (0.05, 0.3, 0.6):
        load = share * spec.breaking_force
        theory = Theory(spec, temperature, load if temperature > 25.0 else 0.0)
        length = hanging_length(spec, temperature, load, spin=spin)
        expected = theory.rod(load, spin)
        if expected > spec.minimum_length:
            assert length == pytest.approx(expected, rel=1e-9)
        else:
            assert 0.95 * spec.minimum_length < length < spec.minimum_length


@every_spec
def test_locked_rod_is_that_of_coil_rods(spec):
    """In and out of contact, to the rounding of either."""
    length = np.linspace(0.51 * spec.minimum_length, 0.9 * spec.fibre_length, 200)
    for temperature in (0.0, 25.0, 90.0, 170.0):
        force, stiffness = tension(spec, length, temperature)
        expected, slope = coil_tension(spec, length, temperature)
        np.testing.assert_allclose(force, expected, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(stiffness, slope, rtol=1e-10)
        pulled = (expected >= 0.0) & (expected < 0.5 * spec.breaking_force)
        hung = hanging_length(spec, temperature, expected[pulled], spin="locked")
        np.testing.assert_allclose(hung, length[pulled], rtol=1e-10)
    coil = laws.Coil.of(spec)
    compliance, _ = castigliano.compliance(coil, "locked", coil.sin, 1.0)
    assert CoilRods([spec]).contact_stiffness[0] == pytest.approx(
        spec.contact_ratio / (spec.fibre_length * compliance), rel=1e-12
    )


@pytest.mark.parametrize("spin", SPINS)
def test_without_shear_and_stretch_the_rod_is_kirchhoffs(spin):
    """A thin fibre of the same EI and GJ: what is left is proportional to 1/GA."""
    plain = replace(MADE, fibre=replace(MADE.fibre, load_softening=(0.0, 0.0, 1.0)))
    temperature, load = np.array([25.0, 90.0, 160.0])[:, None], np.array([0.1, 0.3, 0.6])

    def thin(scale):
        fibre = plain.fibre
        stiff = {name: getattr(fibre, name) * scale**-4 for name in ("young", "shear")}
        return replace(plain, fibre=replace(fibre, radius=scale * fibre.radius, **stiff))

    kirchhoff = hanging_length(plain, temperature, load, model="love", spin="free")
    errors = [
        hanging_length(thin(scale), temperature, load, spin=spin) - kirchhoff
        for scale in (1e-1, 1e-2)
    ]
    if spin == "free":
        np.testing.assert_allclose(errors[1], 1e-2 * errors[0], rtol=0.02)
        assert np.max(np.abs(errors[1])) < 1e-5 * plain.rest_length
    else:
        # When cold, Love's shape of reference is the right one; when hot, it is not.
        love = hanging_length(plain, temperature, load, model="love")
        distance = np.abs(hanging_length(thin(1e-3), temperature, load, spin=spin) / love - 1.0)
        assert np.max(distance[0]) < 1e-7 and np.min(distance[2]) > 0.05


@every_spec
@pytest.mark.parametrize("temperature", [25.0, 110.0, 150.0])
def test_love_is_the_corrected_equation_3_27(spec, temperature):
    """l = l* + A untwist + F/K, A = l_t r*/cos(alpha*), cos^2(alpha^h) before GJ *and* EI."""
    load = 0.4 * spec.breaking_force
    theory = Theory(spec, temperature, load)
    length = hanging_length(spec, temperature, load, model="love")
    s, s_h = length / theory.l_t, math.sin(theory.alpha) + theory.untwist / theory.W
    c, c_h = math.sqrt(1.0 - s * s), math.sqrt(1.0 - s_h * s_h)
    r_h = c_h / theory.W
    stiff = theory.GJ + theory.EI * s / c * (c_h - c) / (s - s_h)
    expected = theory.rest + theory.l_t * theory.r / math.cos(theory.alpha) * theory.untwist
    expected += load * theory.l_t * r_h**2 / (c_h**2 * stiff)
    if length > spec.minimum_length:
        assert length == pytest.approx(expected, rel=1e-10)


@every_spec
@pytest.mark.parametrize("spin", SPINS)
@pytest.mark.parametrize("scheme", ["linear", "implicit", "path"])
def test_castigliano_is_the_rod_for_small_strains(spec, spin, scheme):
    """Same slopes over load and temperature at rest; Love's lever is another one."""
    theory = Theory(spec, 25.0, 0.0)
    s = math.sin(spec.pitch_angle)
    kind = {"model": "cst", "spin": spin, "scheme": scheme}
    step, rise = 1e-6, 1e-4
    for model in ({"spin": spin}, kind):
        stretch = hanging_length(spec, 25.0, step, **model) - spec.rest_length
        assert stretch / step == pytest.approx(theory.compliance(s, spin), rel=1e-4)
        shift = hanging_length(spec, 25.0 + rise, 0.0, **model) - spec.rest_length
        hot = Theory(spec, 25.0 + rise, 0.0)
        assert shift / hot.untwist == pytest.approx(theory.lever(s, spin), rel=1e-4)
    shift = hanging_length(spec, 25.0 + rise, 0.0, model="love") - spec.rest_length
    lever = spec.fibre_length * spec.coil_radius / math.cos(spec.pitch_angle)
    assert shift / hot.untwist == pytest.approx(lever, rel=1e-4)


@every_spec
@pytest.mark.parametrize("spin", SPINS)
def test_schemes_of_castigliano(spec, spin):
    """Heat first, load second: linear by hand, implicit by bisection, path by Runge-Kutta."""
    temperature, load = 140.0, 0.4 * spec.breaking_force
    theory = Theory(spec, temperature, load)
    l_t, s0 = theory.l_t, math.sin(theory.alpha)
    linear = theory.rest + theory.lever(s0, spin) * theory.untwist
    linear += load * theory.compliance(s0, spin)
    heated = brentq(
        lambda s: l_t * (s - s0) - theory.lever(s, spin) * theory.untwist, -0.9, s0, xtol=1e-15
    )
    implicit = l_t * brentq(
        lambda s: l_t * (s - heated) - load * theory.compliance(s, spin), heated, 0.99, xtol=1e-15
    )
    path = s0
    for slope, span in ((theory.lever, theory.untwist), (theory.compliance, load)):
        path = solve_ivp(
            lambda _, s, slope=slope: [slope(s[0], spin) / l_t], (0.0, span), [path],
            rtol=1e-11, atol=1e-13,
        ).y[0, -1]  # fmt: skip
    for scheme, expected in (("linear", linear), ("implicit", implicit), ("path", l_t * path)):
        length = hanging_length(spec, temperature, load, model="cst", spin=spin, scheme=scheme)
        if expected > spec.minimum_length:
            assert length == pytest.approx(expected, rel=1e-9)


@every_spec
@pytest.mark.parametrize("spin", SPINS)
def test_path_of_castigliano_far_out(spec, spin):
    """F = integral of dl / C up to 97 % of the fibre's length."""
    theory = Theory(spec, 25.0, 0.0)
    start = math.sin(theory.alpha)
    expected, _ = quad(lambda s: theory.l_t / theory.compliance(s, spin), start, 0.97, epsrel=1e-12)
    force, _ = tension(spec, 0.97 * theory.l_t, 25.0, model="cst", spin=spin, scheme="path")
    assert force == pytest.approx(expected, rel=1e-10)


def test_an_end_that_may_spin_gives_way():
    """Softer under load when cold; heat shortens it more: 13 to 22 % of the stroke."""
    assert hanging_length(MADE, 25.0, 0.3) > hanging_length(MADE, 25.0, 0.3, spin="locked")
    for weight in (2, 30, 60):
        share = contraction(MADE, weight * GRAM, spin="locked") / contraction(MADE, weight * GRAM)
        assert 0.76 < share < 0.88
    # Each model's own condition is what None means.
    for model, spin in (("rod", "free"), ("cst", "free"), ("love", "locked")):
        assert hanging_length(MADE, 120.0, 0.3, model=model) == hanging_length(
            MADE, 120.0, 0.3, model=model, spin=spin
        )


@every_spec
@every_model
def test_tension_is_the_inverse_of_hanging_length(spec, kind):
    load = np.array([0.0, 0.02, 0.2, 0.5]) * spec.breaking_force
    temperature = np.array([15.0, 25.0, 80.0, 125.0, 160.0, 180.0])[:, None]
    length = hanging_length(spec, temperature, load, **kind)
    assert length.shape == (6, 4) and np.all(np.isfinite(length))
    force, _ = tension(spec, length, temperature, **kind)
    np.testing.assert_allclose(force, np.broadcast_to(load, (6, 4)), atol=3e-10)


@every_spec
@every_model
def test_slope_of_tension(spec, kind):
    """Positive, and that of finite differences, also where coils touch."""
    low = 0.97 * spec.minimum_length
    length = np.linspace(low, 1.4 * spec.rest_length, 60)
    step = 1e-6 * spec.rest_length
    for temperature in (25.0, 90.0, 150.0):
        _, stiffness = tension(spec, length, temperature, **kind)
        above, _ = tension(spec, length + step, temperature, **kind)
        below, _ = tension(spec, length - step, temperature, **kind)
        np.testing.assert_allclose(stiffness, (above - below) / (2.0 * step), rtol=2e-5)
        assert np.all(stiffness > 0.0)


@every_model
def test_length_rises_with_load_and_falls_with_heat(kind):
    """With heat where the load does not soften the fibre."""
    length = hanging_length(MADE, [[25.0], [90.0], [160.0]], np.linspace(0.0, 0.7, 100), **kind)
    assert np.all(np.diff(length, axis=1) > 0.0)
    spec = CATALOGUE["type-2-200"]
    length = hanging_length(spec, np.linspace(25.0, 180.0, 80)[:, None], [0.0, 0.1, 0.3], **kind)
    assert np.all(np.diff(length, axis=0) < 0.0)


@every_model
def test_hot_coils_stop_where_they_touch(kind):
    """Sun, Section 2.2.1: type 1-180 contracts 20 mm without load, 25 to 150 °C."""
    spec = CATALOGUE["type-1-180"]
    length = hanging_length(spec, np.linspace(25.0, 180.0, 400), 0.0, **kind)
    assert np.all(np.diff(length) < 0.0) and np.max(np.abs(np.diff(length))) < 0.4e-3
    assert 0.97 * spec.minimum_length < length[-1] < spec.minimum_length
    assert contraction(spec, 0.0, 150.0, **kind) == pytest.approx(20e-3, abs=2e-3)


def test_a_hot_section_is_stiffer():
    """60 g, 25 to 160 °C: 11.6 mm with a cold section, 21.4 mm with a hot one."""
    assert contraction(HOT_SECTION, 60 * GRAM) == pytest.approx(21.4e-3, abs=0.1e-3)
    assert contraction(HOT_SECTION, 60 * GRAM) > 1.8 * contraction(MADE, 60 * GRAM)


def test_a_crept_tca_is_longer_when_cold():
    lengths = [hanging_length(spec, 25.0, 0.1) for spec in FREE_STROKE_CREPT.values()]
    assert np.all(np.diff(lengths) > 0.0)
    for spec in FREE_STROKE_CREPT.values():
        assert spec.coils == pytest.approx(MADE.coils, rel=1e-12)
        assert spec.minimum_length == pytest.approx(MADE.minimum_length, rel=1e-12)


@every_model
def test_a_batch_is_its_rows(kind):
    """Bit for bit, in any shape, with elements that touch or converge badly among them."""
    spec = CATALOGUE["type-1-180"]
    rng = np.random.default_rng(1)
    temperature, load = rng.uniform(0.0, 180.0, (20, 30)), rng.uniform(0.0, 0.7, (20, 30))
    length = hanging_length(spec, temperature, load, **kind)
    force, stiffness = tension(spec, length, temperature, **kind)
    for row in (0, 7, 19):
        alone = hanging_length(spec, temperature[row], load[row], **kind)
        np.testing.assert_array_equal(alone, length[row])
        pull = tension(spec, length[row], temperature[row], **kind)
        np.testing.assert_array_equal(pull, (force[row], stiffness[row]))
    assert hanging_length(spec, temperature[3, 4], load[3, 4], **kind) == length[3, 4]
    assert np.ndim(hanging_length(spec, 25.0, 0.1, **kind)) == 0
    assert hanging_length(spec, np.empty((0, 3)), 0.1, **kind).shape == (0, 3)


def test_more_than_one_chunk():
    load = np.linspace(0.0, 0.6, 10_000)
    length = hanging_length(MADE, 100.0, load)
    for few in (slice(None, None, 999), slice(4090, 4100), slice(8185, 8195), slice(9990, None)):
        np.testing.assert_array_equal(length[few], hanging_length(MADE, 100.0, load[few]))


@every_model
def test_brackets_alone_find_the_same(kind, monkeypatch):
    spec = CATALOGUE["type-1-180"]
    temperature, load = [[20.0], [100.0], [170.0]], [0.0, 0.1, 0.6]
    length = hanging_length(spec, temperature, load, **kind)
    monkeypatch.setattr(laws, "_ACCEPTED", -1.0)
    np.testing.assert_allclose(hanging_length(spec, temperature, load, **kind), length, rtol=1e-10)
    force, _ = tension(spec, length, temperature, **kind)
    np.testing.assert_allclose(force, np.broadcast_to(load, (3, 3)), atol=1e-9)
    monkeypatch.setattr(roots, "_STEPS", 1)
    with pytest.raises(ArithmeticError) as caught:
        hanging_length(spec, temperature, load, **kind)
    assert caught.value.residual > 0.0


@pytest.mark.parametrize(
    ("temperature", "load", "kind", "match"),
    [
        (25.0, -1e-9, {}, "load must be finite and at least 0 N, got -1e-09"),
        (25.0, math.nan, {}, "load must be finite .* got nan"),
        (25.0, math.inf, {}, "load must be finite .* got inf"),
        (math.nan, 0.1, {}, "temperature must be finite .* got nan"),
        (-280.0, 0.1, {}, "temperature must be .* above -273.15 .* got -280.0"),
        (260.0, 0.1, {}, "temperature must be .* below 260 °C, got 260.0"),
        (
            [25.0, 150.0],
            [0.1, 2.0],
            {},
            "load must be below 1.16.* no modulus at 150.0 °C, got 2.0 N",
        ),
        (25.0, 200.0, {}, r"load must be at most \d+\.\d+ N at 25.0 °C .* got 200.0 N"),
        (25.0, 5.0, {"model": "cst", "scheme": "linear"}, "at most 2.35.* got 5.0 N"),
        (25.0, 300.0, {"model": "love"}, "at most .* got 300.0 N"),
        ([25.0, 30.0], [0.1, 0.2, 0.3], {}, "broadcast"),
        (25.0, 0.1, {"model": "beam"}, "model must be .* got 'beam'"),
        (25.0, 0.1, {"spin": "both"}, "spin must be .* got 'both'"),
        (25.0, 0.1, {"scheme": "explicit"}, "scheme must be .* got 'explicit'"),
    ],
)
def test_bad_loads_are_refused(temperature, load, kind, match):
    with pytest.raises(ValueError, match=match):
        hanging_length(MADE, temperature, load, **kind)


@every_model
def test_the_bound_on_the_load_is_sharp(kind):
    """The tension at 98 % of the fibre's length is accepted, a little more is not."""
    spec = CATALOGUE["self-coiled"]
    bound, _ = tension(spec, 0.98 * spec.fibre_length, 100.0, **kind)
    length = hanging_length(spec, 100.0, (1.0 - 1e-9) * bound, **kind)
    assert length == pytest.approx(0.98 * spec.fibre_length, rel=1e-7)
    with pytest.raises(ValueError, match=f"at most {str(bound)[:8]}"):
        hanging_length(spec, 100.0, 1.001 * bound, **kind)


def test_the_bound_on_the_softening_is_sharp():
    with pytest.raises(ValueError, match="must be below") as caught:
        hanging_length(MADE, 150.0, 3.0)
    bound = float(str(caught.value).split("below ")[1].split()[0])
    with pytest.raises(ValueError, match="leaves no modulus"):
        hanging_length(MADE, 150.0, 1.0001 * bound)
    with pytest.raises(ValueError, match="to have a length"):  # a modulus, but almost none
        hanging_length(MADE, 150.0, 0.9999 * bound)


@pytest.mark.parametrize("length", [0.49 * MADE.minimum_length, 0.172, -0.01, math.nan])
def test_bad_lengths_are_refused(length):
    with pytest.raises(ValueError, match="length must be finite and at least"):
        tension(MADE, length, 25.0)


def test_love_refuses_a_coil_that_untwists_beyond_every_helix():
    wild = replace(MADE, fibre=replace(MADE.fibre, untwist_scale=10.0))
    with pytest.raises(ValueError, match="sine of the unloaded pitch"):
        hanging_length(wild, 160.0, 0.1, model="love")
    assert hanging_length(wild, 160.0, 0.1) < wild.minimum_length


@pytest.mark.parametrize("spin", SPINS)
def test_a_coil_that_would_turn_inside_out_is_held_by_the_contact(spin):
    """Without contact a rod of spring index 1.1 has states of any pull there, or none at all."""
    fibre = replace(MADE.fibre, untwist_scale=10.0)
    tight = replace(MADE, fibre=fibre, coil_radius=1.1 * fibre.radius)
    length = hanging_length(tight, [120.0, 160.0, 200.0], 0.0, spin=spin)
    assert np.all((length > 0.98 * tight.minimum_length) & (length < tight.minimum_length))
    force, _ = tension(tight, length, [120.0, 160.0, 200.0], spin=spin)
    np.testing.assert_allclose(force, 0.0, atol=1e-8)


def test_what_is_beyond_the_data_is_computed():
    assert np.all(np.isfinite(hanging_length(MADE, [0.0, 200.0], 0.8)))

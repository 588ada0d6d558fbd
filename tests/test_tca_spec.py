"""The specs, the published TCAs, and how heat and load change the fibre."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    MATERIALS,
    MODULE_TCAS,
    BodyHeat,
    FibreTable,
    TcaSpec,
    radial_growth,
    softened_tension,
    softening,
    untwist,
)

FREE_STROKE = CATALOGUE["free-stroke"]
LOADED = FREE_STROKE.fibre
THREAD = MATERIALS["silver-coated nylon sewing thread"].measured


@pytest.mark.parametrize(
    ("name", "natural", "free_stroke"),
    [  # Sun, dissertation, Colorado State University, Table 2.1
        ("type-0-180", 61e-3, 0.057),
        ("type-1-180", 88e-3, 0.204),
        ("type-2-180", 109e-3, 0.357),
        ("type-1-200", 96e-3, 0.272),
        ("type-2-200", 134e-3, 0.480),
    ],
)
def test_free_strokes_of_chapter_2(name, natural, free_stroke):
    """All but type 0 have the same contact length: one number gives four free strokes."""
    spec = CATALOGUE[name]
    assert spec.rest_length == pytest.approx(natural, rel=1e-12)
    assert 1.0 - spec.minimum_length / spec.rest_length == pytest.approx(free_stroke, abs=0.015)


def test_free_stroke_tca_of_chapter_3():
    """Table 3.2: 45 mm natural, 66.75 mm made, 63 coils; the two shapes are one coil."""
    made = CATALOGUE["free-stroke-made"]
    assert FREE_STROKE.rest_length == pytest.approx(0.045, rel=1e-12)
    assert made.rest_length == pytest.approx(0.06675, rel=1e-3)
    assert FREE_STROKE.coils == pytest.approx(63.0, abs=0.5)
    assert made.coils == pytest.approx(FREE_STROKE.coils, rel=1e-12)
    assert made.minimum_length == pytest.approx(FREE_STROKE.minimum_length, rel=1e-12)
    free_stroke = 1.0 - FREE_STROKE.minimum_length / FREE_STROKE.rest_length
    assert free_stroke == pytest.approx(0.357, abs=0.015)
    assert CATALOGUE["self-coiled"].rest_length == pytest.approx(0.056, rel=1e-3)


def test_coils_of_the_catalogue_do_not_overlap():
    """Neighbouring turns are 2 pi r sin(pitch) apart, at least a fibre's diameter when cold.

    In Chapter 2 that was measured across, 0.34 mm (Table 2.1), with the coil's outer diameter.
    """
    for name, spec in CATALOGUE.items():
        gap = 2.0 * math.pi * spec.coil_radius * math.sin(spec.pitch_angle)
        assert gap > (0.34e-3 if name.startswith("type-") else 2.0 * spec.fibre.radius)
        assert spec.minimum_length < spec.rest_length < spec.fibre_length


def test_masses_of_what_was_weighed():
    """117 mg per twisted metre three ways, and 32 mg for each TCA of Chapter 2 (Sun, 2.1.1)."""
    named = 4 * 23.5e-6 * 218.0 / 175.0  # 235/36 dtex, 4 ply; 218 mm become 175 mm (Table 3.2)
    conical = 4 * 23.5e-6 * 181.0 / 145.0  # 181 mm become 145 mm, the same thread
    measured = 1300.0 * math.pi * 0.17e-3**2  # Table 3.1 on the 0.34 mm of Table 2.1
    for density in (named, conical, measured):
        assert FREE_STROKE.fibre.line_density == pytest.approx(density, rel=0.01)
    assert FREE_STROKE.fibre.line_density == pytest.approx(117e-6, rel=0.1)
    for name, spec in CATALOGUE.items():
        if name.startswith("type-"):  # one 0.03 g, five 0.16 g
            assert spec.mass == pytest.approx(0.16e-3 / 5, rel=0.1)
            assert spec.mass == pytest.approx(0.03e-3, rel=0.1)
        else:
            assert spec.mass / spec.fibre_length == pytest.approx(117e-6, rel=0.1)
    for spec in MODULE_TCAS.values():
        assert spec.mass / spec.fibre_length == pytest.approx(117e-6, rel=0.1) or (
            spec.mass == pytest.approx(32e-6, rel=0.1)
        )


def test_mass_and_heat_from_the_fibre():
    spec = FREE_STROKE
    assert spec.heat.capacity == pytest.approx(spec.mass * 1267.0, rel=1e-12)
    assert spec.heat.loss == pytest.approx(23.0 * 2.5 * 2.0 * math.pi * 0.21e-3 * 0.175, rel=1e-12)
    # 2.0 s with what was weighed, 3.0 s with the density of Table 3.1 on its circle.
    assert spec.heat.time_constant == pytest.approx(1.95, abs=0.01)


def test_in_a_body_all_heat_goes_through_it():
    body = BodyHeat(conductance=0.4, capacity=20.0, loss=0.2)
    embedded = replace(FREE_STROKE, body=body)
    heat, length = embedded.heat, FREE_STROKE.rest_length
    assert heat.capacity == FREE_STROKE.heat.capacity
    assert (heat.loss, heat.conductance) == (0.0, 0.4 * length)
    assert (heat.body_capacity, heat.body_loss) == (20.0 * length, 0.2 * length)
    assert embedded.mass == FREE_STROKE.mass
    for name in ("conductance", "capacity", "loss"):
        for bad in (0.0, -1.0, math.inf, math.nan, "much"):
            with pytest.raises(ValueError, match=name):
                replace(body, **{name: bad})


def test_of_length_keeps_thread_and_coil():
    """Mass, coils, heat and contact length are proportional; the geometry does not change."""
    bare = replace(FREE_STROKE, body=BodyHeat(conductance=0.4, capacity=20.0, loss=0.2))
    double = bare.of_length(2.0 * bare.rest_length)
    for name in ("rest_length", "minimum_length", "fibre_length", "coils", "mass"):
        assert getattr(double, name) == pytest.approx(2.0 * getattr(bare, name), rel=1e-14)
    assert double.heat.capacity == pytest.approx(2.0 * bare.heat.capacity, rel=1e-14)
    assert double.heat.time_constant == pytest.approx(bare.heat.time_constant, rel=1e-14)
    assert (double.coil_radius, double.pitch_angle) == (bare.coil_radius, bare.pitch_angle)
    assert double.heat.body_loss == pytest.approx(2.0 * bare.heat.body_loss, rel=1e-14)
    assert FREE_STROKE.of_length(0.1).body is None


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("fibre_length", 0.0),
        ("fibre_length", math.inf),
        ("coil_radius", 0.21e-3),  # spring index 1
        ("pitch_angle", math.pi / 2.0),
        ("pitch_angle", 0.1),  # below the minimum pitch
        ("minimum_pitch_angle", 0.0),
        ("minimum_pitch_angle", 0.3),
        ("breaking_force", -1.0),
        ("resistance_per_length", math.nan),
        ("stretch_resistance", -0.1),
        ("stretch_resistance", 0.5),  # no resistance left at full stretch
        ("contraction_resistance", math.inf),
        ("heat_loss", 0.0),
        ("ambient", -300.0),
        ("body", 0.3),
        ("contact_ratio", 0.0),
        ("contact_smoothing", 0.0),
    ],
)
def test_bad_tcas_are_refused(field, value):
    with pytest.raises(ValueError, match=field):
        replace(FREE_STROKE, **{field: value})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("radius", 0.0),
        ("young", math.nan),
        ("shear", -1.0),
        ("filament_young", math.inf),
        ("line_density", 0.0),
        ("specific_heat", 0.0),
        ("softening", -1.0),
        ("softening", 0.1e9),  # nothing left at 160 °C
        ("inserted_twist", -1.0),
        ("untwist_scale", math.nan),
        ("load_softening", (0.0, -1.0, 1.0)),
        ("load_softening", (0.0, 1.0)),
        ("expansion", (0.0, 0.0, -1.0)),
        ("expansion", (1.0, -120.0, 3599.0)),  # negative inside the range only
        ("expansion", (math.nan, 0.0, 1.0)),
        ("temperature_range", (30.0, 160.0)),
        ("temperature_range", (25.0, 25.0)),
        ("section", "warm"),
    ],
)
def test_bad_fibres_are_refused(field, value):
    with pytest.raises(ValueError, match=field):
        replace(THREAD, **{field: value})


def test_of_length_refuses_nonsense():
    for length in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="rest_length"):
            FREE_STROKE.of_length(length)


def test_specs_are_values():
    assert TcaSpec(**{name: getattr(FREE_STROKE, name) for name in FREE_STROKE.__slots__}) == (
        FREE_STROKE
    )
    assert hash(FREE_STROKE) == hash(replace(FREE_STROKE))
    with pytest.raises(TypeError):
        CATALOGUE["new"] = FREE_STROKE  # type: ignore[index]


def test_growth_is_the_published_polynomial_over_its_value_at_rest():
    """Gamma(T)/Gamma(25 °C) - 1, zero at 25 °C to the last bit."""
    temperature = np.linspace(-20.0, 200.0, 45)
    gamma = 3.5e-6 * temperature**2 - 6.7e-5 * temperature + 1.0
    gamma0 = 3.5e-6 * 25.0**2 - 6.7e-5 * 25.0 + 1.0
    growth = radial_growth(THREAD, temperature)
    np.testing.assert_allclose(growth, gamma / gamma0 - 1.0, rtol=0, atol=1e-15)
    assert radial_growth(THREAD, 25.0) == 0.0


def test_a_hot_fibre_untwists():
    """A filament of constant length keeps r theta: theta falls as the radius grows."""
    fibre = THREAD
    for temperature in (25.0, 80.0, 160.0):
        lost = float(untwist(fibre, temperature))
        radius = 1.0 + float(radial_growth(fibre, temperature))
        assert radius * (fibre.inserted_twist + lost) == pytest.approx(4710.0, rel=1e-14)
    assert untwist(fibre, 25.0) == 0.0
    assert np.all(np.diff(untwist(fibre, np.linspace(25.0, 160.0, 50))) < 0.0)
    assert untwist(replace(fibre, untwist_scale=1.6), 100.0) == pytest.approx(
        1.6 * untwist(fibre, 100.0), rel=1e-14
    )


@pytest.mark.parametrize("temperature", [75.0, 100.0, 125.0, 150.0, 160.0])
def test_untwist_against_the_second_published_fit(temperature):
    """Sun, Chapter 5, fits the same measurement in rad/m directly; its value at 25 °C is offset."""
    second = np.poly1d([-0.0161, 0.3338, -7.7311])
    expected = second(temperature) - second(25.0)
    assert untwist(THREAD, temperature) == pytest.approx(expected, rel=0.06)


def test_moduli_at_the_reference_temperature_are_the_measured_ones():
    for torsion in (0.0, 50.0, 171.0):
        assert softening(LOADED, 25.0, torsion) == 1.0


def test_softening_by_heat_and_load():
    """E_f = 3.9 GPa - 0.0011 GPa/K dT lambda(tau); lambda = 1, 1, 5.68 at 0, 85.5, 171 rad/m."""
    for torsion, factor in ((0.0, 1.0), (85.5, 1.0), (171.0, 5.68)):
        left = 1.0 - 0.0011 * 135.0 * factor / 3.9
        # The polynomial's printed coefficients have three digits.
        assert softening(LOADED, 160.0, torsion) == pytest.approx(left, abs=0.01)
    # Sun, Section 3.2.2: more than 13 % when hot and loaded.
    assert softening(LOADED, 160.0, 171.0) < 0.87
    # A pushed or a cold fibre does not know of the load.
    assert softening(LOADED, 160.0, -100.0) == softening(LOADED, 160.0, 0.0)
    assert softening(LOADED, 10.0, 171.0) == softening(LOADED, 10.0, 0.0) > 1.0


def test_60_grams_twist_the_free_stroke_fibre_by_171_rad_per_metre():
    spec = CATALOGUE["free-stroke-made"]
    shear_stiffness = spec.fibre.shear * 2.0 * spec.fibre.second_moment
    torsion = 0.060 * 9.81 * spec.fibre.radius * math.cos(spec.pitch_angle) / shear_stiffness
    assert torsion == pytest.approx(171.0, rel=0.01)


def test_no_modulus_is_an_error():
    for call in (
        lambda: softening(LOADED, 26.0 + 3.9 / 0.0011),
        lambda: softening(LOADED, 160.0, 500.0),
        lambda: softening(LOADED, math.nan),
        lambda: softened_tension(LOADED, 4000.0, 0.1, 300.0),
    ):
        with pytest.raises(ValueError, match="modulus"):
            call()
    with pytest.raises(ValueError, match="radius"):
        untwist(replace(LOADED, expansion=(-1e-5, 0.0, 1.0)), 400.0)


@pytest.mark.parametrize("temperature", [0.0, 25.0, 26.0, 90.0, 160.0, 200.0])
def test_softened_tension_solves_its_implicit_equation(temperature):
    """F = f e(T, tau(F)), and dF/df by the implicit function theorem's finite difference."""
    per_tension = 302.0
    stiff = np.linspace(-1.0, 5.0, 301)
    tension, slope = softened_tension(LOADED, temperature, stiff, per_tension)
    left = softening(LOADED, temperature, per_tension * tension)
    np.testing.assert_allclose(tension, stiff * left, rtol=1e-13, atol=1e-16)
    assert np.all(np.diff(tension) > 0.0)
    step = 1e-5
    above = softened_tension(LOADED, temperature, stiff + step, per_tension)[0]
    below = softened_tension(LOADED, temperature, stiff - step, per_tension)[0]
    np.testing.assert_allclose(slope, (above - below) / (2.0 * step), rtol=3e-5)


def test_softened_tension_is_smooth_through_zero():
    for temperature in (25.0, 150.0):
        tension, slope = softened_tension(LOADED, temperature, np.array([-1e-9, 0.0, 1e-9]), 302.0)
        assert tension[1] == 0.0
        np.testing.assert_allclose(slope, slope[1], rtol=1e-6)


def test_a_table_of_fibres_is_its_fibres():
    fibres = [THREAD, LOADED, CATALOGUE["self-coiled"].fibre, CATALOGUE["type-0-180"].fibre]
    table = FibreTable.of(fibres)
    temperature = np.array([25.0, 60.0, 110.0, 160.0])
    for i, fibre in enumerate(fibres):
        assert untwist(table, temperature)[i] == untwist(fibre, temperature[i])
        assert softening(table, temperature, 30.0)[i] == softening(fibre, temperature[i], 30.0)

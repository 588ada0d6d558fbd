"""Calibration surfaces against the rod; the bank on them."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    MATERIALS,
    BodyHeat,
    CalibrationError,
    CoilRods,
    CoilSurfaces,
    TcaBank,
    TcaState,
    calibrate,
)
from tca_mj.tca.arrays import FEW

FREE_STROKE = CATALOGUE["free-stroke"]
THREAD = MATERIALS["silver-coated nylon sewing thread"].measured
HOT_SECTION = replace(FREE_STROKE, fibre=replace(FREE_STROKE.fibre, section="hot"), ambient=20.0)
SPECS = [*CATALOGUE.values(), HOT_SECTION]
IDS = [*CATALOGUE, "free-stroke with hot section"]


def random_points(spec, count, seed=0, hottest=180.0):
    rods = CoilRods([spec])
    rng = np.random.default_rng(seed)
    length = rng.uniform(rods.shortest, rods.longest, (count, 1))
    # Half of them where robots work, near the natural length.
    near = np.clip(
        spec.rest_length * rng.uniform(0.6, 2.0, (count, 1)), rods.shortest, rods.longest
    )
    length = np.where(rng.random((count, 1)) < 0.5, length, near)
    return length, rng.uniform(25.0, hottest, (count, 1))


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_error_is_within_the_stored_bound_and_that_within_the_demand(spec):
    """0.2 % from 0.05 N on, 0.1 mN below, from 25 to 180 °C over the whole range of lengths."""
    bound = calibrate(spec).bound
    assert bound.absolute < 2e-6
    assert bound.relative < 2e-5
    assert bound.slope < 2e-4
    length, temperature = random_points(spec, 100_000)
    tension, slope = CoilSurfaces([spec]).tension(length, temperature)
    exact, exact_slope = CoilRods([spec]).tension(length, temperature)
    error = np.abs(tension - exact)
    assert np.all(error <= np.maximum(bound.absolute, bound.relative * np.abs(exact)))
    assert np.all(np.abs(slope / exact_slope - 1.0) <= bound.slope)
    taut = exact >= 0.05
    assert np.max(error[taut] / exact[taut]) < 2e-3
    assert np.max(error[~taut]) < 1e-4
    # Nor is the bound an idle one: away from contact the error comes near it.
    share = (error / np.maximum(exact, 0.05))[length >= spec.minimum_length]
    assert 0.3 * bound.relative < np.max(share) <= bound.relative


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
@pytest.mark.parametrize("temperature", [0.0, 25.0, 26.3, 117.7, 180.0, 200.0])
def test_tension_rises_with_length(spec, temperature):
    coils = CoilSurfaces([spec])
    length = np.linspace(coils.shortest, coils.longest, 20_001)
    tension, slope = coils.tension(length, np.full_like(length, temperature))
    assert np.all(np.diff(tension, axis=0) > 0.0)
    assert np.all(slope > 0.0)
    assert calibrate(spec).rises()


def test_the_proof_of_rising_sees_a_dip():
    surface = calibrate(FREE_STROKE)
    slope = surface.slope.copy()
    slope[7, 12] *= -1.0
    assert not replace(surface, slope=slope).rises()


@pytest.mark.parametrize("spec", [FREE_STROKE, HOT_SECTION, CATALOGUE["type-0-180"]])
def test_no_jump_across_the_cells(spec):
    """Tension and slope are continuous over length, the tension also over temperature."""
    coils, surface = CoilSurfaces([spec]), calibrate(spec)
    p, q = surface.cells
    ends = spec.fibre_length * surface.shortest, spec.fibre_length * surface.longest
    knot = np.linspace(*ends, p + 1)[1:-1, None, None]
    knot = knot[knot[:, 0, 0] > 1.001 * coils.shortest]
    temperature = np.array([0.0, 2.5, 25.0, 61.3, 180.0])[None, :, None]
    knot, temperature = np.broadcast_arrays(knot, temperature)
    tiny = 1e-12 * spec.fibre_length
    below, slope_below = coils.tension(knot - tiny, temperature)
    above, slope_above = coils.tension(knot + tiny, temperature)
    np.testing.assert_allclose(above, below, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(slope_above, slope_below, rtol=1e-9)

    knot = np.linspace(surface.coldest, surface.hottest, q + 1)[1:-1, None, None]
    length = np.linspace(coils.shortest, coils.longest, 50)[None, :, :]
    length, knot = np.broadcast_arrays(length, knot)
    below, slope_below = coils.tension(length, knot - 1e-10)
    above, slope_above = coils.tension(length, knot + 1e-10)
    # The softening by load starts like a square root at the reference temperature, with far
    # more tension than a TCA bears; the rod does the same.
    calm = np.abs(knot - spec.fibre.reference_temperature) > 1.0
    np.testing.assert_allclose(above[calm], below[calm], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(slope_above[calm], slope_below[calm], rtol=1e-6)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_the_slope_is_that_of_the_surface_itself(spec):
    """Central differences, in length over fibre length; contact and cell borders included."""
    coils = CoilSurfaces([spec])
    length, temperature = random_points(spec, 2000, seed=5)
    step = 1e-6 * spec.fibre_length
    length = np.clip(length, coils.shortest + step, coils.longest - step)
    _, slope = coils.tension(length, temperature)
    above, _ = coils.tension(length + step, temperature)
    below, _ = coils.tension(length - step, temperature)
    np.testing.assert_allclose(slope, (above - below) / (2.0 * step), rtol=2e-4)
    smooth = np.abs(length - spec.minimum_length) > 0.01 * spec.minimum_length
    np.testing.assert_allclose(slope[smooth], ((above - below) / (2.0 * step))[smooth], rtol=2e-6)


def test_edges_of_the_table_are_inside():
    for spec in SPECS:
        coils = CoilSurfaces([spec])
        for temperature in (coils.coldest, coils.hottest):
            read = coils.tension(coils.longest, temperature)
            exact = coils.rods.tension(coils.longest, temperature)
            np.testing.assert_allclose(read, exact, rtol=1e-9)
            read = coils.tension(coils.shortest, temperature)  # inside of a cell
            exact = coils.rods.tension(coils.shortest, temperature)
            np.testing.assert_allclose(read, exact, rtol=1e-4)


@pytest.mark.parametrize("spec", SPECS, ids=IDS)
def test_a_cold_tca_at_its_natural_length_does_not_pull(spec):
    """It is a knot of the table, also of a coil cut to another length."""
    for tca in (spec, spec.of_length(0.7 * spec.rest_length)):
        temperature = np.array([spec.fibre.reference_temperature])
        tension, slope = CoilSurfaces([tca]).tension(np.array([tca.rest_length]), temperature)
        assert abs(tension[0]) < 1e-12
        assert slope == pytest.approx(CoilRods([tca]).rest_stiffness, rel=1e-11)


@pytest.mark.parametrize(
    "reference", [("reference_temperature", 31.7), ("temperature_range", (-230.0, 160.0))]
)
def test_any_reference_temperature_is_a_knot(reference):
    fibre = replace(FREE_STROKE.fibre, **dict([reference]))
    spec = replace(FREE_STROKE, fibre=fibre)
    surface, cold = calibrate(spec), fibre.reference_temperature
    assert surface.coldest <= 0.0 and surface.hottest == 200.0
    tension, _ = CoilSurfaces([spec]).tension(np.array([spec.rest_length]), np.array([cold]))
    assert abs(tension[0]) < 1e-12


def test_coils_that_differ_in_length_or_heat_only_share_a_surface():
    longer = FREE_STROKE.of_length(0.11)
    other = replace(longer, ambient=30.0, body=BodyHeat(conductance=1.0, capacity=1.0, loss=1.0),
                    contact_ratio=9.0)
    assert calibrate(FREE_STROKE) is calibrate(longer) is calibrate(other)
    coils, rods = CoilSurfaces([longer, other]), CoilRods([longer, other])
    length = np.linspace(coils.shortest, coils.longest, 300)
    temperature = np.full_like(length, 140.0)
    read, exact = coils.tension(length, temperature), rods.tension(length, temperature)
    np.testing.assert_allclose(read[0], exact[0], rtol=2e-5, atol=1e-6)
    np.testing.assert_allclose(read[1], exact[1], rtol=1e-4)


def test_outside_its_temperatures_the_rod_answers():
    coils, rods = CoilSurfaces([FREE_STROKE] * 4), CoilRods([FREE_STROKE] * 4)
    length = np.full(4, 0.05)
    temperature = np.array([-1e-9, 100.0, 200.0, 210.0])
    read, exact = coils.tension(length, temperature), rods.tension(length, temperature)
    alone = coils.tension(length, np.full(4, 100.0))
    for a, b, c in zip(read, exact, alone, strict=True):
        assert (a[0], a[3]) == (b[0], b[3])
        assert a[1] == c[1] != b[1]  # unmoved by its neighbours
        assert a[2] == pytest.approx(b[2], rel=1e-5)


@pytest.mark.parametrize(
    ("length", "temperature", "match"),
    [
        (0.49 * FREE_STROKE.minimum_length, 25.0, "length"),
        (0.981 * FREE_STROKE.fibre_length, 25.0, "length"),
        (math.nan, 25.0, "length"),
        (0.045, math.nan, "temperature"),
        (0.045, 5000.0, "modulus"),
    ],
)
def test_outside_its_domain_it_refuses_as_the_rod_does(length, temperature, match):
    with pytest.raises(ValueError, match=match):
        CoilSurfaces([FREE_STROKE]).tension(np.array([length]), np.array([temperature]))
    with pytest.raises(ValueError, match="shape"):
        CoilSurfaces([FREE_STROKE]).tension(length, temperature)


def test_a_coil_that_buckles_has_no_surface():
    """Steep, soft in torsion: the rod's own tension falls with length."""
    fibre = replace(THREAD, radius=0.2e-3, young=7e9, shear=0.1e9)
    spec = replace(FREE_STROKE, fibre=fibre, coil_radius=1.2e-3, pitch_angle=0.8)
    with pytest.raises(CalibrationError, match="falls with length"):
        calibrate(spec)


def test_fine_tables_for_unusual_coils():
    """A thick fibre in a steep coil: a finer grid is taken, and the bound still met."""
    fibre = replace(THREAD, radius=1e-3, section="hot")
    spec = replace(FREE_STROKE, fibre=fibre, coil_radius=1.3e-3, pitch_angle=0.5)
    surface = calibrate(spec)
    assert surface.cells > (32, 40)
    assert surface.bound.relative < 2e-3


# The bank


def random_inputs(bank, shape, seed=0):
    rng = np.random.default_rng(seed)
    size = (*shape, bank.n)
    # Some start outside the table and are solved by the rod.
    state = TcaState(
        rng.uniform(-10.0, 215.0, size), rng.uniform(20.0, 90.0, size), rng.random(size),
        rng.random(size),
    )  # fmt: skip
    length = bank.shortest + rng.random(size) * (bank.longest - bank.shortest)
    return state, rng.uniform(0.0, 3.0, size), length


@pytest.mark.parametrize("contiguous", [True, False])
def test_a_batch_is_its_rows_bit_for_bit(contiguous):
    bank = TcaBank(SPECS, law="surface")
    state, power, length = random_inputs(bank, (40,))
    if not contiguous:
        state = TcaState(*(np.asfortranarray(getattr(state, f.name)) for f in fields(state)))
        power, length = np.asfortranarray(power), np.asfortranarray(length)
    after, pull = bank.advance(state, power, length, 0.02)
    for i in range(40):
        row = TcaState(*(getattr(state, f.name)[i] for f in fields(state)))
        row_after, row_pull = bank.advance(row, power[i], length[i], 0.02)
        np.testing.assert_array_equal(row_after.temperature, after.temperature[i])
        for name in ("tension", "stiffness", "length"):
            np.testing.assert_array_equal(getattr(row_pull, name), getattr(pull, name)[i])


def test_a_bank_is_its_tcas_bit_for_bit():
    bank = TcaBank(SPECS, law="surface")
    state, _, length = random_inputs(bank, (), seed=3)
    pull = bank.pull(state, length)
    for i, spec in enumerate(SPECS):
        alone = TcaBank([spec], law="surface").pull(
            TcaState(*(getattr(state, f.name)[i : i + 1] for f in fields(state))),
            length[i : i + 1],
        )
        assert (alone.tension[0], alone.stiffness[0]) == (pull.tension[i], pull.stiffness[i])


def test_the_banks_two_laws_agree():
    rod, surface = TcaBank(SPECS), TcaBank(SPECS, law="surface")
    assert (rod.law, surface.law) == ("rod", "surface")
    state, power, length = random_inputs(rod, (500,))
    exact_state, exact = rod.advance(state, power, length, 0.02)
    read_state, read = surface.advance(state, power, length, 0.02)
    np.testing.assert_array_equal(read_state.temperature, exact_state.temperature)
    np.testing.assert_allclose(read.tension, exact.tension, rtol=2e-5, atol=1e-6)
    np.testing.assert_allclose(read.stiffness, exact.stiffness, rtol=2e-4)
    with pytest.raises(ValueError, match="law"):
        TcaBank(SPECS, law="table")


@pytest.mark.parametrize("n", range(1, FEW + 2))
def test_few_tcas_read_one_by_one_are_to_the_bit_what_many_read_at_once(n):
    """Also where coils touch, where they are colder or hotter than the table, and one too many."""
    specs = (list(CATALOGUE.values()) * 2)[:n]
    law, rng = CoilSurfaces(specs), np.random.default_rng(n)
    least, most = law.rods.shortest, law.rods.longest
    length = least + (most - least) * rng.uniform(0.001, 0.999, (400, n))
    temperature = rng.uniform(-40.0, 230.0, (400, n)) if n % 2 else rng.uniform(0, 180, (400, n))
    every = law.tension(length, temperature)
    each = np.array([law.tension(*pair) for pair in zip(length, temperature, strict=True)])
    assert np.array(every).tobytes() == np.ascontiguousarray(each.transpose(1, 0, 2)).tobytes()

"""Beams: section constants in closed form."""

import math
from dataclasses import replace

import pytest

from tca_mj.rod import BeamSpec, Outline
from tca_mj.rod.beam import torsion_constant

E, G = 0.125e6, 0.125e6 / 3.0
ROUND = {"length": 45e-3, "diameter": 4.5e-3, "young": E, "shear": G, "density": 1070.0}
BOX = {"length": 35e-3, "width": 6e-3, "height": 3e-3, "young": E, "shear": G, "density": 1070.0}


def test_a_round_section_has_the_textbook_constants():
    beam, r = BeamSpec.circular(**ROUND), 2.25e-3
    assert beam.bending == pytest.approx((E * math.pi * r**4 / 4.0,) * 2, rel=1e-14)
    assert beam.torsion == pytest.approx(G * math.pi * r**4 / 2.0, rel=1e-14)
    assert beam.stretching == pytest.approx(E * math.pi * r**2, rel=1e-14)
    assert beam.shearing == pytest.approx(G * math.pi * r**2, rel=1e-14)
    assert beam.mass == pytest.approx(1070.0 * math.pi * r**2 * 45e-3, rel=1e-14)
    assert beam.outline == Outline(r, r)


def test_the_outline_changes_mass_and_contour_but_no_stiffness():
    thin, thick = BeamSpec.circular(**ROUND), BeamSpec.circular(**ROUND, outer_diameter=9e-3)
    assert thick.mass == pytest.approx(4.0 * thin.mass, rel=1e-14)
    assert thick.outline == Outline(4.5e-3, 4.5e-3)
    assert replace(thick, outline=thin.outline, line_density=thin.line_density) == thin


def test_a_box_has_the_textbook_constants():
    beam = BeamSpec.box(**BOX)
    assert beam.bending[0] == pytest.approx(E * 6e-3 * 3e-3**3 / 12.0, rel=1e-14)  # about x
    assert beam.bending[1] == pytest.approx(E * 3e-3 * 6e-3**3 / 12.0, rel=1e-14)  # about y
    assert beam.stretching == pytest.approx(E * 18e-6, rel=1e-14)
    assert beam.shearing == pytest.approx(G * 18e-6, rel=1e-14)
    assert beam.torsion == pytest.approx(G * 37.05e-12, rel=1e-4)
    assert beam.mass == pytest.approx(1070.0 * 18e-6 * 35e-3, rel=1e-14)
    assert beam.outline == Outline(3e-3, 1.5e-3, round=False)


def test_the_torsion_constant_of_a_square():
    """0.140577 a⁴ (Timoshenko & Goodier, Theory of Elasticity, table in section 109)."""
    assert torsion_constant(2e-3, 2e-3) == pytest.approx(0.140577 * 2e-3**4, rel=1e-5)


def test_the_torsion_constant_of_3_by_6_mm():
    """0.22868 a b³; the polar moment would be 67.5 mm⁴."""
    assert torsion_constant(3e-3, 6e-3) == pytest.approx(0.22868 * 6e-3 * 3e-3**3, rel=2e-5)
    assert torsion_constant(3e-3, 6e-3) == pytest.approx(37.05e-12, rel=1e-4)


@pytest.mark.parametrize("ratio", [20.0, 100.0, 1000.0])
def test_the_torsion_constant_of_a_thin_strip(ratio):
    """b t³/3 (1 - 0.630 t/b)."""
    thin = torsion_constant(ratio * 1e-3, 1e-3)
    assert thin == pytest.approx(ratio * 1e-12 / 3.0 * (1.0 - 0.63025 / ratio), rel=1e-5)


def test_the_torsion_constant_does_not_know_which_side_is_which():
    assert torsion_constant(3e-3, 6e-3) == torsion_constant(6e-3, 3e-3)
    assert torsion_constant(6e-3, 12e-3) == pytest.approx(16.0 * torsion_constant(3e-3, 6e-3))


def test_the_contour_holds_what_is_inside():
    disc, box = Outline(2e-3, 2e-3), Outline(3e-3, 1e-3, round=False)
    assert disc.contains(1.4e-3, 1.4e-3) and not disc.contains(1.5e-3, 1.5e-3)
    assert box.contains(-3e-3, 1e-3)
    assert not box.contains(3.1e-3, 0.0) and not box.contains(0.0, -1.1e-3)
    assert disc.area == pytest.approx(math.pi * 4e-6) and box.area == pytest.approx(12e-6)


@pytest.mark.parametrize("field", sorted(ROUND))
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_bad_round_beam_is_refused(field, value):
    with pytest.raises(ValueError, match=f"{field} must be finite and above 0, got {value}"):
        BeamSpec.circular(**{**ROUND, field: value})


@pytest.mark.parametrize("field", sorted(BOX))
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_bad_box_is_refused(field, value):
    with pytest.raises(ValueError, match=f"{field} must be finite and above 0, got {value}"):
        BeamSpec.box(**{**BOX, field: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bending": (1.0, -1.0)}, r"bending must be finite and above 0, got \(1\.0, -1\.0\)"),
        ({"torsion": 0.0}, "torsion must be finite and above 0, got 0"),
        ({"stretching": math.nan}, "stretching must be finite and above 0, got nan"),
        ({"shearing": 0.0}, "shearing must be finite and above 0, got 0"),
        ({"line_density": 0.0}, "line_density must be finite and above 0, got 0"),
        ({"curvature": (0.0, 1.0)}, r"curvature must be finite numbers of shape \(3,\), got"),
        ({"curvature": (0.0, math.nan, 0.0)}, "curvature must be finite, got"),
        ({"damping_time": -1.0}, "damping_time must be finite and at least 0, got -1"),
    ],
)
def test_a_bad_beam_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(BeamSpec.circular(**ROUND), **change)


def test_a_bad_outer_diameter_is_refused():
    with pytest.raises(ValueError, match=r"outer_diameter must be .* above 0, got -0\.009"):
        BeamSpec.circular(**ROUND, outer_diameter=-9e-3)


@pytest.mark.parametrize(
    ("half_width", "half_height", "message"),
    [
        (0.0, 1e-3, r"half_width must be finite and above 0, got 0\.0"),
        (1e-3, math.nan, "half_height must be finite and above 0, got nan"),
        (1e-3, 2e-3, "half_height must be half_width 0.001 m in a round outline, got 0.002"),
    ],
)
def test_a_bad_outline_is_refused(half_width, half_height, message):
    with pytest.raises(ValueError, match=message):
        Outline(half_width, half_height)

"""The law of a TCA at a temperature, as a body feels it."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.integrate import quad

from tca_mj.tca import CATALOGUE, coil_tension, hanging_length, law_at, tension

TCA = CATALOGUE["free-stroke"]
LONGEST = 0.98 * TCA.fibre_length
KINDS = [
    {"model": model, "spin": spin}
    for model, spin in product(["rod", "love", "cst"], ["free", "locked"])
]
every_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: " ".join(kind.values()))


@every_kind
@pytest.mark.parametrize("temperature", [25.0, 80.0, 150.0])
def test_taut_it_is_the_models_tension_and_slack_it_is_nothing(kind, temperature):
    length = np.linspace(0.5 * TCA.minimum_length, LONGEST, 300)
    force, slope = law_at(TCA, temperature, **kind)(length)
    exact, exact_slope = tension(TCA, length, temperature, **kind)
    taut = exact > 0.0
    assert 0 < np.count_nonzero(taut) < 300
    np.testing.assert_array_equal(force, np.where(taut, exact, 0.0))
    np.testing.assert_array_equal(slope, np.where(taut, exact_slope, 0.0))


@every_kind
def test_it_goes_slack_at_the_unloaded_length(kind):
    law, free = law_at(TCA, 100.0, **kind), hanging_length(TCA, 100.0, 0.0, **kind)
    assert law(free - 1e-8) == (0.0, 0.0)
    force, slope = law(free + 1e-8)
    assert force == pytest.approx(1e-8 * slope, rel=1e-3) and slope > 1.0


def test_its_own_energy_is_the_integral_of_the_tension():
    """Work done on the TCA between two lengths, by the slope's integral and by the tension's."""
    law = law_at(TCA, 120.0)
    rise, _ = quad(lambda length: law(length)[1], 0.03, 0.06, points=[0.0336], limit=200)
    assert rise == pytest.approx(law(0.06)[0] - law(0.03)[0], rel=1e-6)


def test_the_usual_law_is_that_of_glued_rods():
    law = law_at(TCA, 140.0)
    force, slope = coil_tension(TCA, 0.05, 140.0)
    assert law(0.05) == pytest.approx((force, slope), rel=1e-9)
    assert np.isscalar(law(0.05)[0]) and law(np.empty((0, 3)))[0].shape == (0, 3)
    assert law([[0.04], [0.05]])[0][1, 0] == law(0.05)[0]


def test_pressed_together_it_is_slack_down_to_no_length():
    """A search for a body's shape may try such lengths."""
    for temperature in (25.0, 160.0):
        force, slope = law_at(TCA, temperature)(np.linspace(0.0, 0.5 * TCA.minimum_length, 9))
        assert not force.any() and not slope.any()


@pytest.mark.parametrize(
    "length", [-1e-9, 0.981 * TCA.fibre_length, math.nan, math.inf, 0.05j, "long", None, [[1], 2]]
)
def test_bad_lengths_are_refused(length):
    with pytest.raises(ValueError, match="length must be"):
        law_at(TCA, 25.0)(length)


@pytest.mark.parametrize(
    ("temperature", "kind", "match"),
    [
        (math.nan, {}, "temperature must be finite, got nan"),
        (-300.0, {}, "temperature must be .* above -273.15 and below 260 °C, got -300.0"),
        (260.0, {}, "temperature must be .* below 260 °C, got 260.0"),
        ([25.0, 30.0], {}, "temperature must be one finite number"),
        ("hot", {}, "temperature must be a real number .* got 'hot'"),
        (25.0, {"model": "beam"}, "model must be .* got 'beam'"),
        (25.0, {"spin": "both"}, "spin must be .* got 'both'"),
    ],
)
def test_bad_questions_are_refused(temperature, kind, match):
    with pytest.raises(ValueError, match=match):
        law_at(TCA, temperature, **kind)


def test_a_contact_too_soft_to_stop_the_pull_is_refused():
    fibre = replace(TCA.fibre, untwist_scale=3.0)
    soft = replace(TCA, fibre=fibre, contact_ratio=0.01)
    assert law_at(soft, 25.0)(0.0) == (0.0, 0.0)
    with pytest.raises(ValueError, match="contact_ratio must be larger .* got 0.01"):
        law_at(soft, 150.0)

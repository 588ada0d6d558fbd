"""The page of other packages: its tables are of what was measured, and its rod is an exact one."""

import json
import sys

import numpy as np
import pytest
from test_docs import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import comparison_page  # noqa: E402
import comparison_peers  # noqa: E402

from tca_mj.certify.cable import FORCE, LENGTH, force_tip  # noqa: E402
from tca_mj.rod import BeamSpec, solve_static  # noqa: E402


def test_the_exact_tip_is_that_of_the_elastica():
    """Without shear and stretch (Bisshopp & Drucker, 1945); with them it is nearly there."""
    case = comparison_page.case_of(comparison_page.YOUNG, [4], [1e-2])
    small, large = case["loads"]
    tip = force_tip() / LENGTH  # at the same P L²/EI
    assert comparison_page.LOADS["large"] == pytest.approx(10.0) and FORCE > 0.0
    assert comparison_peers.off(case, large, *(case["length"] * tip[1:])) < 0.3
    thin = BeamSpec.circular(length=1.0, diameter=1e-3, young=1e6, shear=1e6, density=1e3)
    force = 10.0 * thin.bending[0]
    exact = solve_static(thin, [], [], tip_force=(force, 0.0, 0.0), shearable=False)
    np.testing.assert_allclose(exact.tip[[0, 2]], tip[1:], atol=2e-5)
    assert small["across"] < large["across"] and json.dumps(case)


def test_a_simulation_of_the_rod_ends_where_it_rests():
    case = comparison_page.case_of(comparison_page.YOUNG, [4], [1e-2])
    case["loads"] = case["loads"][1:]
    (row,) = comparison_page.ours(case)
    assert 1.0 < row["error"] < 4.0 and row["step"] == 1e-2 and row["cost"] > 0.0


def test_the_tables_take_the_coarsest_that_is_good_enough():
    def row(pieces, error, **more):
        return {"load": "large", "pieces": pieces, "error": error, "cost": 2e-3} | more

    soft = {
        "here": [row(4, 2.5, step=1e-2), row(8, 0.7, step=5e-3), row(16, 0.2, step=2e-3)],
        "there": [row(4, 3.0), row(8, 1.5)],
    }
    tasks = {"this": {"cost": 1e-3, "period": 0.1}}
    text = comparison_page.tables(soft, {"here": [row(8, 0.71, step=1e-3)]}, tasks)
    assert "| here | large | 2.50 | 0.70 | 0.20 |" in text
    assert "| here | silicone | 8 | 0.70 | 5 | 2 |" in text
    assert "| there | silicone | | not reached | | |" in text
    assert "| this | 1000 | 0.1 | 100 |" in text


def test_the_page_has_what_was_measured():
    head, mark, below = comparison_page.PAGE.read_text(encoding="utf-8").partition(
        comparison_page.MARK
    )
    assert mark and "## Measured" in head and "## Sources" in head
    for name in ("tca-mj", "PyElastica, as documented", "PyElastica, from the middle", "SoRoMoX"):
        assert f"| {name}" in below
    assert "cores" in below and "numba" in below

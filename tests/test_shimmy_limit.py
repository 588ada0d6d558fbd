"""What limits the shimmy: speeds over whole cycles, legs in step, a search that begins there."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tca_mj.agents.policies.actors import first_gait

SCRIPT = runpy.run_path(str(Path(__file__).parent.parent / "scripts" / "shimmy_limit.py"))
GAIT = first_gait(SCRIPT["TASK"], SCRIPT["START"])[0]


def test_speeds_are_those_of_whole_cycles():
    """A robot that rocks to and fro once in a cycle gets on as fast as one that does not."""
    gaits = [replace(GAIT, period=period) for period in (3.3, 5.6, 7.1)]
    clock = SCRIPT["PERIOD"] * np.arange(round(SCRIPT["longest"](gaits) / SCRIPT["PERIOD"]) + 1)
    ways = np.stack(
        [4e-3 * clock + 2e-3 * np.sin(2.0 * np.pi * clock / g.period) for g in gaits], axis=1
    )
    speeds = SCRIPT["over_cycles"](ways, gaits)
    np.testing.assert_allclose(speeds, 4e-3, rtol=0.01)  # read between decisions of 0.2 s


def test_both_legs_of_a_pair_go_in_step():
    gait = SCRIPT["together"](GAIT)
    hot = gait.temperature(np.linspace(0.0, 1.0, 50)).reshape(50, 4, 3)
    np.testing.assert_array_equal(hot[:, 0], hot[:, 1])
    np.testing.assert_array_equal(hot[:, 2], hot[:, 3])


def test_the_same_gait_goes_the_same_way_on_the_same_robot():
    """And a search of one generation, whose first middle is the start, can find nothing else."""
    start = SCRIPT["together"](GAIT)
    vector = SCRIPT["tasks"](3)
    slow = replace(start, hot=tuple(tuple(w + 5.0 for w in row) for row in start.warm))
    ways = SCRIPT["travelled"](vector, [start, start, slow], [1000] * 3, 8.0)
    assert ways.shape == (41, 3)
    np.testing.assert_array_equal(ways[:, 0], ways[:, 1])
    assert ways[-1, 0] > 0.01 and abs(ways[-1, 2]) < 0.5 * ways[-1, 0]
    found = SCRIPT["sought"](start, 1000, 1)
    assert found.period == pytest.approx(start.period)
    np.testing.assert_allclose(found.table("hot"), start.table("hot"))

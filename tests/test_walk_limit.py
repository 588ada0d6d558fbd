"""The bound on the walk: temperatures that repeat, and a speed that falls with the period."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.modules.continuum_leg import LegSpec
from tca_mj.tca import step_temperature

SCRIPT = runpy.run_path(str(Path(__file__).parent.parent / "scripts" / "walk_limit.py"))
HEAT = LegSpec().tca.of_length(LegSpec().length).heat
HOTTEST = TetrapodGait.hot_temperature


@pytest.mark.parametrize("power", [2.0, 4.0, 1e3])
@pytest.mark.parametrize("heated", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("period", [0.5, 4.0, 20.0])
def test_a_cycle_repeats_within_its_limits(period, heated, power):
    """A step of cooling less leads from its end to its start; it is as hot as power allows."""
    course = SCRIPT["cycle"](HEAT, period, heated, power, HOTTEST)
    dt = period / len(course)
    rise = (course[0] - step_temperature(course[-1], 0.0, HEAT, dt)) / dt
    used = rise * HEAT.capacity / np.exp(-0.5 * HEAT.loss * dt / HEAT.capacity)
    assert used <= power * (1.0 + 1e-3)
    assert course.max() <= HOTTEST + 1e-6
    assert course.max() == pytest.approx(HOTTEST) or used == pytest.approx(power, rel=1e-3)


def test_the_bound_by_hand():
    """A foot as far as its TCAs' temperatures differ: a long cycle takes the whole way."""

    def place(front, rear, grid):
        return 1e-4 * (front - rear)

    swing, speed = SCRIPT["bound"](place, HEAT, 60.0, 4.0)
    assert swing == pytest.approx(2e-4 * (HOTTEST - 25.0), rel=0.02)
    assert speed == pytest.approx(swing / 30.0)
    speeds = [SCRIPT["bound"](place, HEAT, period, 4.0)[1] for period in (0.5, 2.0, 8.0, 60.0)]
    assert speeds == sorted(speeds, reverse=True)
    # In a short cycle the one cools while the other heats: no faster than both slopes allow.
    cooling = HEAT.loss * (HOTTEST - 25.0) / HEAT.capacity
    heating = 4.0 / HEAT.capacity
    assert speeds[0] < 1e-4 * (cooling + heating)

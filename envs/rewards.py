"""How near is near enough, on a scale from 0 to 1: what rewards and their progress are made of.

It is dm-control's ``tolerance`` wherever dm-control is installed. That package needs labmaze, which
has no wheels for Python 3.13 and later and otherwise is built with bazel; there, dm-control is not
asked for. The closed form below then takes its place, to the last bit, and what else dm-control
does (``Simulation.physics`` and the window of ``tca-mj view``) says that it is missing.
"""

import numpy as np


def closed_form(
    x: float, bounds: tuple[float, float], margin: float, sigmoid: str = "gaussian",
    value_at_margin: float = 0.1,
) -> float:  # fmt: skip
    """1 within bounds, and less the farther beyond; ``tolerance`` of ``dm_control.utils.rewards``.

    Args:
        x: A number [any unit].
        bounds: Lower and upper bound [the same unit].
        margin: Distance from a bound at which ``value_at_margin`` is left, above 0 [the same unit].
        sigmoid: "gaussian" or "linear".
        value_at_margin: What is left there, above 0 for "gaussian" [1].
    """
    low, high = bounds
    far = np.float64(low - x if x < low else x - high) / margin
    if low <= x <= high:
        return 1.0
    if sigmoid == "linear":
        fallen = far * (1.0 - value_at_margin)
        return float(1.0 - fallen) if abs(fallen) < 1.0 else 0.0
    return float(np.exp(-0.5 * (far * np.sqrt(-2.0 * np.log(value_at_margin))) ** 2))


try:
    from dm_control.utils.rewards import tolerance as tolerance
except ModuleNotFoundError:
    tolerance = closed_form

"""How much of the shape of its mandrel a coil keeps after annealing."""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise
from typing import Annotated

from tca_mj.checks import door
from tca_mj.hints import angle

# Sun, dissertation, Colorado State University, Section 2.1.1: annealed at the Brill transition of
# nylon 6,6 or below, a coil closes off its mandrel; annealed at 200 °C it "can almost maintain
# the made length".
BRILL_TRANSITION = 160.0  # [°C]
_KEEPS_ALL = 200.0  # [°C]
# At 180 °C, and the change per degree of the groove's pitch: fitted to types 1-180 and 2-180 of
# Sun, Table 2.1, (88 - 70)/(93.9 - 70) at 15.57° and (109 - 70)/(134.2 - 70) at 22.54°, in mm.
_MEASURED = 180.0  # [°C]
_FLATTER = 15.57  # [°]
_KEPT = 0.752
_KEPT_SLOPE = -0.0207  # [1/°]

Pitch = Annotated[float, partial(angle, below=0.5 * math.pi)]
"""A pitch angle, of a groove or a coil."""


@door
def kept_share(groove_pitch_angle: Pitch, annealing_temperature: float) -> float:
    """Share of the gap between the coils that a TCA keeps when it creeps to its natural length.

    Natural length = contact length + share (made length - contact length). Piecewise linear in
    the annealing temperature and linear in the pitch, fitted to the four TCAs with free stroke of
    Sun, Table 2.1; it extrapolates from two pitches.

    Args:
        groove_pitch_angle: Pitch angle on the mandrel [rad].
        annealing_temperature: Temperature of the oven [°C].

    Returns:
        Share, 0 at 160 °C and below to 1 at 200 °C and above.
    """
    middle = _KEPT + _KEPT_SLOPE * (math.degrees(groove_pitch_angle) - _FLATTER)
    middle = min(max(middle, 0.0), 1.0)
    known = ((BRILL_TRANSITION, 0.0), (_MEASURED, middle), (_KEEPS_ALL, 1.0))
    for (t1, kept1), (t2, kept2) in pairwise(known):
        if t1 <= annealing_temperature < t2:
            return kept1 + (kept2 - kept1) * (annealing_temperature - t1) / (t2 - t1)
    return 0.0 if annealing_temperature < BRILL_TRANSITION else 1.0

"""What geoms of a robot touch, as their settings in MuJoCo."""

from collections.abc import Sequence
from typing import Any

TOUCHES_NOTHING: dict[str, Any] = {"contype": 0, "conaffinity": 0, "mass": 0.0}
"""A geom that is only seen."""


def surface(friction: Sequence[float], **more: Any) -> dict[str, Any]:
    """Surface of what touches ground and objects, but nothing of the robot.

    Pieces overlap in a bent beam, so bit 0 of contype is for objects and ground only.

    Args:
        friction: Sliding, torsional and rolling friction.
        **more: Further settings of the geom, or others in place of these.
    """
    return {
        "contype": 0, "conaffinity": 1, "condim": 3, "friction": list(friction),
        "solref": [5e-3, 1.0], "solimp": [0.95, 0.99, 5e-4, 0.5, 2.0],
    } | more  # fmt: skip

"""The finger pair by itself, hanging from a base that moves only up and down (Sun, 4.1.1)."""

from __future__ import annotations

from dataclasses import dataclass, field

from tca_mj.checks import Checked, door
from tca_mj.model.part import Part, new_spec
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.robots.lift import LiftSpec, add_lift


@dataclass(frozen=True, kw_only=True, slots=True)
class GripperSpec(Checked):
    """The fingers and what they hang from.

    Attributes:
        fingers: The normally closed pair.
        lift: The carriage. Heights and speed are estimates.

    Raises:
        ValueError: If a field is something else.
    """

    fingers: FingerPairSpec = field(default_factory=FingerPairSpec)
    lift: LiftSpec = field(
        default_factory=lambda: LiftSpec(height=0.048, travel=(0.026, 0.06), speed=0.04)
    )


@door
def gripper(spec: GripperSpec | None = None) -> Part:
    """Builds the gripper, its fingers in the x-z plane; see ``LiftSpec`` for its slide ``lift``.

    Args:
        spec: The gripper, by default the published one.

    Returns:
        A part with the TCA ``fingers.tca`` and the sites ``fingers.tip0``, ``fingers.tip1`` and
        ``fingers.grasp``.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or GripperSpec()
    part = Part(new_spec("gripper"))
    add_lift(part.spec, spec.lift)
    part.attach(finger_pair(spec.fingers), to="mount", prefix="fingers")
    return part

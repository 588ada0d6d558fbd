"""Two bistable fingers that hang from a carriage (Sun, Section 4.3.4).

State 2 of each finger is towards the other one: the gripper closes easily, holds without power, and
is hard to open. Each finger has two TCAs, one that closes it and one that opens it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco

from tca_mj.checks import Checked, NotNegative, Positive, door
from tca_mj.hints import Length
from tca_mj.model.part import Part, new_spec, set_options
from tca_mj.model.surface import TOUCHES_NOTHING, surface
from tca_mj.modules.bistable import BistableSpec, bistable_module
from tca_mj.robots.lift import LiftSpec, add_bridge, add_lift

SIDES = 2
CLOSING, OPENING = (1, 3), (0, 2)  # of the gripper's TCAs; Sun, Section 4.3.4, counts from 1
_RIDGE = 1.5e-3  # radius of the ridges that touch; estimate [m]
_QUATS = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))  # of the fingers in the mount: x inwards


@dataclass(frozen=True, kw_only=True, slots=True)
class BistableGripperSpec(Checked):
    """Fingers and carriage.

    Attributes:
        finger: One of the two fingers: a spine of 50° (Sun, Section 4.3.4).
        spacing: Distance between the fingers' spines at their roots [m]. Estimate.
        lift: The carriage. Heights and speed are estimates.
        across: How far the carriage moves to either side, along y [m]. Estimate.
        across_speed: How fast at most [m/s]. Estimate.
        friction: Coefficient of friction of a finger and what it touches. Estimate: silicone.

    Raises:
        ValueError: If a field is something else or out of range.
    """

    finger: BistableSpec = field(default_factory=BistableSpec)
    spacing: Length = 30e-3
    lift: LiftSpec = field(
        default_factory=lambda: LiftSpec(height=0.085, travel=(0.05, 0.12), speed=0.04)
    )
    across: Length = 0.06
    across_speed: Positive = 0.04
    friction: NotNegative = 1.0


@door
def bistable_gripper(spec: BistableGripperSpec | None = None) -> Part:
    """Builds the gripper, its fingers in the x-z plane; see ``LiftSpec`` for its slide ``lift``.

    Args:
        spec: The gripper, by default the published one.

    Returns:
        A part with all of ``bistable_hand``, ``hand.`` in front.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or BistableGripperSpec()
    part = Part(new_spec("bistable_gripper"))
    bridge = add_bridge(part.spec, spec.across, spec.across_speed)
    base = add_lift(part.spec, spec.lift, on=bridge)
    base.add_geom(
        name="plate", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0.0, 0.0, 1.5e-3],
        size=[spec.spacing / 2.0 + 6e-3, 7e-3, 1.5e-3], rgba=[0.3, 0.32, 0.36, 1.0],
        **TOUCHES_NOTHING,
    )  # fmt: skip
    part.attach(bistable_hand(spec), to="mount", prefix="hand")
    return part


@door
def bistable_hand(spec: BistableGripperSpec | None = None) -> Part:
    """Builds the two fingers alone: the middle of their roots at the origin, their axes along z.

    Args:
        spec: The gripper.

    Returns:
        A part with the TCAs ``finger0.to1`` (opens), ``finger0.to2`` (closes) and those of
        ``finger1``, and the sites ``finger0.tip`` and ``finger1.tip``.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or BistableGripperSpec()
    part = Part(new_spec("hand"))
    for side in range(SIDES):
        x = (side - 0.5) * spec.spacing
        part.spec.worldbody.add_site(
            name=f"root{side}", pos=[x, 0.0, 0.0], quat=list(_QUATS[side]), group=4
        )
        finger = bistable_module(spec.finger, collide=False)
        set_options(finger.spec)  # nothing is asked of these that a step of 1 ms does not give
        part.attach(finger, to=f"root{side}", prefix=f"finger{side}")
        _add_ridges(part, f"finger{side}.body", spec)
    return part


def _add_ridges(part: Part, chain: str, spec: BistableGripperSpec) -> None:
    """What of a finger touches: two ridges along its inner side.

    They are round, so that a bent finger is smooth, where boxes would catch what slides by their
    edges.
    """
    member, finger = part.members[chain], spec.finger
    touch = surface((spec.friction, 0.005, 1e-4), mass=0.0, rgba=[0.93, 0.93, 0.9, 0.6])
    face, side = finger.thickness / 2.0 - _RIDGE, finger.width / 2.0 - _RIDGE
    for piece in range(member.nodes + 1):
        length = member.piece * (0.5 if piece in (0, member.nodes) else 1.0)
        for index, y in enumerate((-side, side)):
            part.spec.body(member.body(piece)).add_geom(
                name=f"{chain}.ridge{index}.{piece}", type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=[face, y, 0.0, face, y, length], size=[_RIDGE, 0.0, 0.0], **touch,
            )  # fmt: skip

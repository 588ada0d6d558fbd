"""The soft arm of Sun, Sections 4.1.4 and 5.3.2: bending module, wrist and gripper in series.

The arm hangs from a base that moves only up and down.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

import mujoco

from tca_mj.checks import Checked, door
from tca_mj.hints import Mass, Section, size
from tca_mj.model.part import Part, new_spec
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.robots.lift import LiftSpec, add_lift


@dataclass(frozen=True, kw_only=True, slots=True)
class ArmSpec(Checked):
    """The arm and its base.

    Attributes:
        bending: The arm proper.
        twisting: The wrist.
        gripper: The hand.
        connector: Thickness of the rigid discs between the modules [m]. Estimate.
        connector_mass: Mass of each of them [kg]. Estimate: printed plastic, half filled. The arm
            weighs 3.6 g then; 6 g are published (Sun, Section 4.1.4), with leads and clamp.
        height: Height of the base above the ground at the start [m].
        travel: Lowest and highest height of the base [m].
        speed: Largest speed of the base [m/s]. Estimate.

    Raises:
        ValueError: If a number is not finite and positive, or the height is outside the travel.
    """

    bending: BendingSpec = field(default_factory=BendingSpec)
    twisting: TwistingSpec = field(default_factory=TwistingSpec)
    gripper: FingerPairSpec = field(default_factory=FingerPairSpec)
    connector: Section = 1.5e-3
    connector_mass: Mass = 0.1e-3
    height: float = 0.14
    travel: tuple[float, float] = (0.07, 0.18)
    speed: Annotated[float, partial(size, kind="slides", at_most=10.0, unit="m/s")] = 0.04

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        _ = self.lift  # which refuses what a carriage cannot do

    @property
    def lift(self) -> LiftSpec:
        """The carriage that is its base."""
        return LiftSpec(height=self.height, travel=self.travel, speed=self.speed)


@door
def arm(spec: ArmSpec | None = None) -> Part:
    """Builds the arm, hanging from a base whose slide ``lift`` moves it up and down.

    The slide's position is the height above the ground. It is driven by the actuator ``lift``,
    whose control is a velocity [m/s].

    Args:
        spec: The arm, by default the published one.

    Returns:
        A part with the TCAs ``bending.tca0`` to ``bending.tca2``, ``wrist.tca`` and
        ``gripper.tca``, in this order, and the sites ``bending.tip``, ``wrist.tip``,
        ``gripper.tip0``, ``gripper.tip1`` and ``gripper.grasp``.

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import ArmSpec, BendingSpec, arm
        >>> long = arm(ArmSpec(bending=BendingSpec(length=60e-3)))
        >>> [round(1e3 * tca.path_length) for tca in long.tcas[:3]]  # [mm]
        [60, 60, 60]
    """
    spec = spec or ArmSpec()
    mjspec = new_spec("arm")
    add_lift(mjspec, spec.lift)
    part = Part(mjspec)
    part.attach(bending_module(spec.bending), to="mount", prefix="bending")
    _connector(part, "bending.tip", spec, spec.bending.outer_diameter / 2.0)
    part.attach(twisting_module(spec.twisting), to="bending.tip.far", prefix="wrist")
    _connector(part, "wrist.tip", spec, spec.twisting.outer_diameter / 2.0)
    part.attach(finger_pair(spec.gripper), to="wrist.tip.far", prefix="gripper")
    return part


def _connector(part: Part, site: str, spec: ArmSpec, radius: float) -> None:
    """A rigid disc on the tip ``site`` of a module, with the site ``<site>.far`` behind it."""
    near = part.spec.site(site)
    z = float(near.pos[2])
    near.parent.add_geom(
        name=f"{site}.connector", type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, spec.connector / 2.0, 0.0], pos=[0.0, 0.0, z + spec.connector / 2.0],
        mass=spec.connector_mass, rgba=[0.3, 0.32, 0.36, 1.0], contype=0, conaffinity=1,
    )  # fmt: skip
    near.parent.add_site(name=f"{site}.far", pos=[0.0, 0.0, z + spec.connector], group=4)

"""The adaptive gripper: a morphing module held in its middle, a soft finger at each end.

Sun, Section 6.3.1 and Fig. 6.10: the base morphs to the size of the object and hardens, then the
fingers pinch. The base hangs from a carriage that moves only up and down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import mujoco

from tca_mj.checks import Angle, Checked, door, number
from tca_mj.hints import Mass
from tca_mj.model.chain import Chain, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.spine import route_spine
from tca_mj.model.tendon import Pass, lay_tca
from tca_mj.modules.morphing import MorphingSpec, dress
from tca_mj.modules.soft_finger import SoftFingerSpec, soft_finger
from tca_mj.robots.lift import LiftSpec, add_lift
from tca_mj.smp.lumped import in_tube

SIDES = 2
_COLD = 25.0  # temperature of a base that has hardened for good [°C]
_HALF = math.sqrt(0.5)
# Rotations of the halves' bases in the mount, wxyz: z to its +x or -x, -y, the side of the TCA, to
# its z, which points down.
_FRAMES = ((0.5, -0.5, 0.5, -0.5), (0.5, -0.5, -0.5, 0.5))
_INWARDS = (_HALF, 0.0, 0.0, -_HALF)  # of a finger at a half's end: its x to the half's -y


@dataclass(frozen=True, kw_only=True, slots=True)
class AdaptiveGripperSpec(Checked):
    """Base, fingers and carriage.

    Attributes:
        base: The morphing module; its ``nodes``, an even number, are those of both halves.
        fingers: One of the two fingers.
        lift: The carriage. Heights and speed are estimates.
        joint_mass: Mass of each of the parts that snap a finger onto the base [kg]. Estimate:
            printed plastic.

    Raises:
        ValueError: If a field is something else, or the number of nodes is odd.
    """

    base: MorphingSpec = field(default_factory=lambda: MorphingSpec(motions=("bend_x",)))
    fingers: SoftFingerSpec = field(default_factory=SoftFingerSpec)
    lift: LiftSpec = field(
        default_factory=lambda: LiftSpec(height=0.225, travel=(0.08, 0.24), speed=0.04)
    )
    joint_mass: Mass = 0.2e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.base.nodes % SIDES:
            raise ValueError(f"base.nodes must be even, got {self.base.nodes}")

    def gap(self, angle: float) -> float:
        """Distance between the pads' faces while the fingers are straight [m].

        The base is two arcs, each of half its length and bent by half the angle.

        Args:
            angle: Bend of the whole base [rad].

        Raises:
            ValueError: If the angle is not finite.
        """
        half = 0.5 * number("angle", angle, unit="rad")
        reach = self.fingers.length - 0.5 * self.fingers.pad
        out = 0.5 * self.base.spine.length * float(math.sin(half) / half if half else 1.0)
        across = reach * math.cos(half) - self.fingers.face * math.sin(half)
        return 2.0 * (out + across)

    def angle_for(self, gap: float) -> float:
        """Bend of the base at which the pads are so far apart [rad].

        Args:
            gap: Distance of their faces [m].

        Raises:
            ValueError: If it is out of reach of a base bent by up to 240° (Sun, Section 6.2).
        """
        low, high = 0.0, math.radians(240.0)
        number("gap", gap, at_least=self.gap(high), at_most=self.gap(low), unit="m")
        for _ in range(60):  # the gap falls with the angle
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.gap(middle) > gap else (low, middle)
        return 0.5 * (low + high)


@door
def adaptive_gripper(spec: AdaptiveGripperSpec | None = None) -> Part:
    """Builds the gripper, which bends in the x-z plane; see ``LiftSpec`` for its slide ``lift``.

    Args:
        spec: The gripper.

    Returns:
        A part with the TCAs ``base.tca``, ``finger0.tca`` and ``finger1.tca``, the spine
        ``base.spine`` and the sites ``finger0.tip``, ``finger0.pad`` and those of the other one.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or AdaptiveGripperSpec()
    part = Part(new_spec("adaptive"))
    carriage = add_lift(part.spec, spec.lift)
    carriage.add_geom(
        name="rod", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[3e-3, 6e-3, 0.0],
        pos=[0.0, 0.0, 2e-3], rgba=[0.6, 0.62, 0.65, 1.0], contype=0, conaffinity=0, mass=0.0,
    )  # fmt: skip
    part.attach(_base(spec), to="mount", prefix="base")
    for side in range(SIDES):
        part.attach(soft_finger(spec.fingers), to=f"base.end{side}", prefix=f"finger{side}")
    return part


def _base(spec: AdaptiveGripperSpec) -> Part:
    """The morphing module, held in its middle: two halves with one spine and one TCA."""
    base = spec.base
    mjspec = new_spec("base")
    half = replace(base.body, length=base.body.length / SIDES)
    halves = []
    for side in range(SIDES):
        chain = add_chain(
            mjspec.worldbody, half, nodes=base.nodes // SIDES, name=f"half{side}",
            motions=base.motions, quat=_FRAMES[side], rgba=(0.0, 0.0, 0.0, 0.0), collide=False,
        )  # fmt: skip
        dress(chain, base, f"half{side}.")
        _joint(chain, spec, side)
        halves.append(chain)
    # From the end of half 0 to that of half 1 on one side, and back on the other.
    first, second = halves
    there = Pass(first, base.route.out, down=True), Pass(second, base.route.back)
    back = Pass(second, base.route.out, down=True), Pass(first, base.route.back)
    tca = lay_tca(mjspec, in_tube(base.tca), (*there, *back), name="tca")
    spine = route_spine(
        base.spine, base.heater, halves, name="spine", tca="tca", damping_time=base.damping_time
    )
    return Part(mjspec, (tca,), {}, (spine,))


@door
def hardened_gripper(spec: AdaptiveGripperSpec | None = None, angle: Angle = math.pi) -> Part:
    """The gripper without its carriage, its base cold and fixed in an angle: an elastic beam.

    So rod theory knows it, too, which knows no shape-memory spine.

    Args:
        spec: The gripper.
        angle: The angle, positive towards the base's TCA, which is left out: it is slack [rad].

    Returns:
        A part with the fingers' TCAs and the sites of ``adaptive_gripper``.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or AdaptiveGripperSpec()
    base, smp = spec.base, spec.base.spine.smp
    stiff = float(smp.modulus(_COLD)) * base.spine.second_moment
    beam = replace(
        base.body, length=base.body.length / SIDES, curvature=(angle / base.body.length, 0.0, 0.0),
        bending=(stiff + base.body.bending[0], 10.0 * stiff), torsion=stiff, stretching=1e5,
        shearing=1e5,
    )  # fmt: skip
    part = Part(new_spec("hardened"))
    for side in range(SIDES):
        chain = add_chain(
            part, beam, nodes=base.nodes // SIDES, name=f"half{side}", motions=base.motions,
            quat=_FRAMES[side], collide=False,
        )  # fmt: skip
        _joint(chain, spec, side)
        part.attach(soft_finger(spec.fingers), to=f"end{side}", prefix=f"finger{side}")
    return part


def _joint(chain: Chain, spec: AdaptiveGripperSpec, side: int) -> None:
    """The part at the end of a half on which a finger snaps, and the site for the finger."""
    end = chain.local(chain.nodes)
    chain.tip.add_geom(
        name=f"joint{side}", type=mujoco.mjtGeom.mjGEOM_BOX, size=[5.5e-3, 3e-3, 2e-3],
        pos=[0.0, 0.0, end], mass=spec.joint_mass, rgba=[0.3, 0.32, 0.36, 1.0], contype=0,
        conaffinity=0,
    )  # fmt: skip
    chain.tip.add_site(name=f"end{side}", pos=[0.0, 0.0, end], quat=list(_INWARDS), group=4)

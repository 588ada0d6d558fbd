"""A normally closed pair of soft fingers that one U-shaped TCA opens (Sun, Section 4.1.1).

The gripper is one soft body, held in the middle and bent to a ring whose ends meet. Its TCA runs
on the outside of the ring, through the whole body and back; contracting, it straightens the body
and the fingers open. Cold, they close and hold an object without power.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated

from tca_mj.checks import Checked, NotNegative, door
from tca_mj.hints import Length, Modulus, Section, angle, size
from tca_mj.model.chain import Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.tendon import Pass, lay_tca
from tca_mj.modules.bending import SILICONE_YOUNG
from tca_mj.rod.beam import BeamSpec
from tca_mj.routes import UTurn
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.embedding import SILICONE_DENSITY, in_silicone

_across = partial(size, kind="sections of soft modules", at_least=-0.1, at_most=0.1)
_HALF = math.sqrt(0.5)
# Rotations of the fingers' bases, wxyz: z to +x or -x of the mount, x (the outside) to its -z.
_FRAMES = ((_HALF, 0.0, _HALF, 0.0), (0.0, -_HALF, 0.0, _HALF))


@dataclass(frozen=True, kw_only=True, slots=True)
class FingerPairSpec(Checked):
    """A soft body bent to a ring, and the TCA that opens it.

    The body is a laminate: a soft core between two layers of a stiffer elastomer. The published
    sections, 3 x 6 mm (Sun, Section 5.3) and 3 x 5 mm (Section 4.1.1), are read as core and as
    thickness with the layers; then the TCA, 2.5 mm off the centre, lies on the outer surface.

    Attributes:
        length: Length of the whole body, both fingers [m]. Sun, Section 4.1.1.
        width: Section across the bending plane [m]. Sun, Section 5.3.
        core: Thickness of the core in the bending plane [m]. Sun, Section 5.3.
        layer: Thickness of each layer [m]. Estimate: with the core it makes the 5 mm of
            Section 4.1.1.
        layer_young: Young's modulus of the layers [Pa]. Estimate for a platinum-cure silicone of
            Shore hardness 10A; the layers carry most of the gripping force.
        offset: Distance of the TCA from the centre line, on the outside [m]. Sun, Section 5.3.2.
        half_width: Half the distance between the two legs of the U [m]. Estimate.
        closure: Angle by which each finger is bent when nothing is between them [rad]. Half a
            turn closes the ring.
        nodes: Nodes of each finger. With 8 its tip lies within 1 % of a finger's length of theory,
            opened to a straight body too.
        friction: Coefficient of sliding friction of the silicone [1]. Estimate.
        tca: The kind of TCA, cut to the route's length in the closed gripper. It lies on
            half the wall of its bent channel.

    Raises:
        ValueError: If a dimension is not finite and positive, a number of nodes not whole, or the
            friction negative.
    """

    length: Length = 35e-3
    width: Section = 6e-3
    core: Section = 3e-3
    layer: Section = 1e-3
    layer_young: Modulus = 0.25e6
    offset: Annotated[float, _across] = 2.5e-3
    half_width: Annotated[float, _across] = 1.5e-3
    closure: Annotated[float, partial(angle, below=2.0 * math.pi)] = math.pi
    nodes: Nodes = 8
    friction: NotNegative = 1.0
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])

    @property
    def thickness(self) -> float:
        """Thickness of core and layers [m]."""
        return self.core + 2.0 * self.layer

    @property
    def body(self) -> BeamSpec:
        """One finger: section x is thickness, outside positive; it bends about y.

        The layers add what a plate of theirs of the full thickness has more than the core's.
        """
        whole = self._plate(self.thickness, self.layer_young)
        gap = self._plate(self.core, self.layer_young)
        core = self._plate(self.core, SILICONE_YOUNG)
        plates = (core, whole, gap)
        bend_x, bend_y = ((a + b - c) for a, b, c in zip(*(p.bending for p in plates), strict=True))
        return replace(
            whole, bending=(bend_x, bend_y), torsion=core.torsion + whole.torsion - gap.torsion,
            stretching=core.stretching + whole.stretching - gap.stretching,
            shearing=core.shearing + whole.shearing - gap.shearing,
            curvature=(0.0, -self.closure / whole.length, 0.0),
        )  # fmt: skip

    def _plate(self, thickness: float, young: float) -> BeamSpec:
        return BeamSpec.box(
            length=self.length / 2.0, width=thickness, height=self.width,
            young=young, shear=young / 3.0, density=SILICONE_DENSITY,
        )  # fmt: skip

    @property
    def embedded(self) -> TcaSpec:
        """The TCA in its bent channel, pressed to its wall; each leg has half of the body."""
        section, perimeter = self.thickness * self.width / 2.0, self.thickness + self.width
        return in_silicone(self.tca, section=section, perimeter=perimeter, touching=0.5)

    @property
    def route(self) -> UTurn:
        """The TCA's two legs along one finger."""
        return UTurn.parallel(self.offset, self.half_width)


@door
def finger_pair(spec: FingerPairSpec | None = None) -> Part:
    """Builds the gripper: held at the origin, the fingers in the x-z plane, their tips below z.

    The z axis of the base points from the mount to where the finger tips meet.

    Args:
        spec: The gripper, by default the published one.

    Returns:
        A part with the TCA ``tca`` and the sites ``tip0``, ``tip1`` (finger tips) and ``grasp``
        (point of the mount's frame where the tips meet).

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import finger_pair
        >>> sorted(finger_pair().sites)
        ['grasp', 'tip0', 'tip1']
    """
    spec = spec or FingerPairSpec()
    body, route = spec.body, spec.route
    mjspec = new_spec("gripper")
    ring = spec.length / (2.0 * spec.closure)  # radius of the closed ring's centre line
    fingers = []
    for side in range(2):
        finger = add_chain(
            mjspec.worldbody, body, nodes=spec.nodes, name=f"finger{side}",
            pos=[0.0, 0.0, spec.thickness / 2.0], quat=_FRAMES[side],
            friction=(spec.friction, 0.005, 0.0001),
        )  # fmt: skip
        finger.mark_tip(f"tip{side}")
        fingers.append(finger)
    grasp = [0.0, 0.0, spec.thickness / 2.0 + 2.0 * ring]
    mjspec.worldbody.add_site(name="grasp", pos=grasp, group=4)
    # From the tip of finger 0 to that of finger 1 on one side, and back on the other.
    first, second = fingers
    there = Pass(first, route.out, down=True), Pass(second, route.back)
    back = Pass(second, route.out, down=True), Pass(first, route.back)
    routed = lay_tca(mjspec, spec.embedded, (*there, *back), name="tca")
    return Part(mjspec, (routed,), {"tip0": "tip0", "tip1": "tip1", "grasp": "grasp"})

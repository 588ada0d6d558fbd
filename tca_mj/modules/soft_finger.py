"""A soft finger that a sheathed TCA bends to its inner side (Sun, Section 6.3.1).

Its root is at the origin, its axis along z; the inner side, with TCA and pad, is that of +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import mujoco

from tca_mj.checks import Checked, NotNegative, Positive, door, number
from tca_mj.hints import Length, Mass, Modulus, Section
from tca_mj.model.build import add_tca
from tca_mj.model.chain import MOTIONS, Chain, Motion, Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.surface import TOUCHES_NOTHING, surface
from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.routes import UTurn
from tca_mj.smp.lumped import TUBE_DIAMETER, in_tube
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.embedding import SILICONE_DENSITY

_RIB = 15e-3  # distance of the ribs that hold the tube; estimate [m]
# Radius of the two ridges of a pad, which stand for rubber that yields. A ball rests between them,
# while between flat pads it turns the fingers, which twist easily, and rolls out. Estimate [m].
_RIDGE = 2e-3
_RUBBER = [0.20, 0.22, 0.25, 1.0]


@dataclass(frozen=True, kw_only=True, slots=True)
class SoftFingerSpec(Checked):
    """A strip of rubber, a TCA in a tube beside it, and a pad at its end.

    Sun shows the finger and prints no dimension of it: all of them are estimates.

    Attributes:
        length: Length of the strip [m].
        width: Its extent across the plane of bending [m].
        thickness: Its extent in that plane [m].
        young: Young's modulus of the strip [Pa]. A rubber of Shore hardness 45A: softer, it would
            curl beside the object instead of pressing it.
        offset: Distance of the TCA from the strip's axis [m]. At half of it the TCA would bend the
            finger to a touch and hardly press.
        half_width: Half the distance between the two legs of the U [m].
        pad: Extent of the pad along the finger [m].
        pad_width: Its extent across [m].
        pad_height: Its height over the strip, so that nothing else touches [m].
        pad_mass: Its mass [kg]. Silicone.
        friction: Coefficient of sliding friction of the pad [1]. Silicone on plastic.
        motions: Motions of each node.
        nodes: Nodes of the chain.
        tca: The kind of TCA, cut to twice the length, loosely in a silicone tube.
        damping_time: Kelvin-Voigt time [s].

    Raises:
        ValueError: If a dimension is not finite and positive, the pad higher than the tube is far,
            or the bend in the finger's plane is missing.
    """

    length: Length = 45e-3
    width: Section = 10e-3
    thickness: Section = 3.5e-3
    young: Modulus = 2e6
    offset: Section = 6e-3
    half_width: Section = 2.5e-3
    pad: Section = 10e-3
    pad_width: Section = 14e-3
    pad_height: Section = 6e-3
    pad_mass: Mass = 0.55e-3
    friction: NotNegative = 1.0
    motions: tuple[Motion, ...] = MOTIONS
    nodes: Nodes = 6
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])
    damping_time: Positive = 1e-2

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("pad_height", self.pad_height, at_least=self.reach - self.thickness / 2.0, unit="m")
        if "bend_y" not in self.motions:
            raise ValueError(f"motions must contain 'bend_y', got {self.motions}")

    @property
    def reach(self) -> float:
        """Distance of the tube's inner side from the axis [m]."""
        return self.offset + TUBE_DIAMETER / 2.0

    @property
    def face(self) -> float:
        """Distance of the pad's face from the axis [m]."""
        return self.thickness / 2.0 + self.pad_height

    @property
    def body(self) -> BeamSpec:
        """The strip: section x is thickness, it bends about y; it carries the weight of the tube.

        The tube is soft and loosely held and bears nothing.
        """
        strip = BeamSpec.box(
            length=self.length, width=self.thickness, height=self.width, young=self.young,
            shear=self.young / 3.0, density=SILICONE_DENSITY, damping_time=self.damping_time,
        )  # fmt: skip
        tube = math.pi * ((TUBE_DIAMETER / 2.0) ** 2 - self.tca.outer_radius**2)
        return replace(
            strip, line_density=strip.line_density + 2.0 * SILICONE_DENSITY * tube,
            outline=Outline(self.reach, self.width / 2.0, round=False),
        )  # fmt: skip

    @property
    def route(self) -> UTurn:
        """The two legs of the TCA, on the inner side."""
        return UTurn.parallel(self.offset, self.half_width)


@door
def soft_finger(spec: SoftFingerSpec | None = None) -> Part:
    """Builds the finger.

    Args:
        spec: The finger.

    Returns:
        A part with the TCA ``tca`` and the sites ``tip`` (end of the axis) and ``pad`` (middle of
        the pad's face).

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or SoftFingerSpec()
    part = Part(new_spec("finger"), sites={"tip": "tip", "pad": "pad"})
    chain = add_chain(
        part, spec.body, nodes=spec.nodes, name="body", motions=spec.motions,
        rgba=(0.0, 0.0, 0.0, 0.0), collide=False,
    )  # fmt: skip
    add_tca(part, chain, spec.route, in_tube(spec.tca), name="tca")
    _dress(chain, spec)
    chain.mark_tip("tip")
    end = chain.local(chain.nodes)
    deep, half = (spec.pad_height - _RIDGE) / 2.0, spec.pad / 2.0
    chain.tip.add_geom(
        name="pad", type=mujoco.mjtGeom.mjGEOM_BOX, rgba=_RUBBER,
        size=[deep, spec.pad_width / 2.0, half],
        pos=[spec.thickness / 2.0 + deep, 0.0, end - half],
        **TOUCHES_NOTHING | {"mass": spec.pad_mass},
    )  # fmt: skip
    for index, side in enumerate((-1.0, 1.0)):
        chain.tip.add_geom(
            name=f"ridge{index}", type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[_RIDGE, half - _RIDGE, 0.0], rgba=_RUBBER,
            pos=[spec.face - _RIDGE, side * (spec.pad_width / 2.0 - _RIDGE), end - half],
            **surface((spec.friction, 0.005, 1e-4), mass=0.0),
        )  # fmt: skip
    chain.tip.add_site(name="pad", pos=[spec.face, 0.0, end - spec.pad / 2.0], group=4)
    return part


def _dress(chain: Chain, spec: SoftFingerSpec) -> None:
    """What is seen: strip, the two legs' tube, and the ribs that hold it."""
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    ribs = {round(chain.nodes * i * _RIB / spec.length) for i in range(1 + chain.nodes)}
    for index, piece in enumerate(chain.pieces):
        half = chain.extent(index) / 2.0
        middle = [0.0, 0.0, half]
        piece.add_geom(
            name=f"strip{index}", type=box, pos=middle, rgba=[0.55, 0.63, 0.72, 1.0],
            size=[spec.thickness / 2.0, spec.width / 2.0, half], **TOUCHES_NOTHING,
        )  # fmt: skip
        for leg, side in enumerate((-1.0, 1.0)):
            piece.add_geom(
                name=f"tube{leg}.{index}", type=cylinder, size=[TUBE_DIAMETER / 2.0, half, 0.0],
                pos=[spec.offset, side * spec.half_width, half], rgba=[0.92, 0.93, 0.95, 0.3],
                **TOUCHES_NOTHING,
            )  # fmt: skip
        if index in ribs:
            height = spec.offset - spec.thickness / 2.0
            piece.add_geom(
                name=f"rib{index}", type=box, rgba=[0.55, 0.63, 0.72, 1.0],
                pos=[spec.thickness / 2.0 + height / 2.0, 0.0, chain.local(index)],
                size=[height / 2.0, spec.width / 2.0, 0.8e-3], **TOUCHES_NOTHING,
            )  # fmt: skip

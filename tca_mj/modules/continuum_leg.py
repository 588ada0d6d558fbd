"""The tetrapod's continuum leg: an elastic rod, rigid plates and three TCAs (Sun, Fig. 6.13B)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated

import mujoco

from tca_mj.checks import Angle, Checked, Positive, door, number, whole
from tca_mj.hints import Length, Mass, Section
from tca_mj.model.build import add_tca
from tca_mj.model.chain import Chain, Motion, Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.surface import TOUCHES_NOTHING, surface
from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.routes import Helix
from tca_mj.tca import CATALOGUE, TcaSpec

CARBON_YOUNG = 130e9  # pultruded carbon-fibre rod along its fibres; estimate from data sheets [Pa]
CARBON_SHEAR = 4.5e9  # the same, in shear along the fibres; estimate [Pa]
CARBON_DENSITY = 1550.0  # the same; estimate [kg/m³]
_SIDE = 0.9  # share of a plate's side that its capsule fills; the ends close the corner
PRINTED_DENSITY = 1200.0  # printed resin and PLA, solid; estimate [kg/m³]


@dataclass(frozen=True, kw_only=True, slots=True)
class LegSpec(Checked):
    """A leg. Sun names its parts but prints no dimension, so all of them are estimates.

    Attributes:
        length: Length of the rod between root and foot [m]. Estimate: with legs of this length
            the robot in its U shape is a third as wide as it is flat (Sun, Section 6.3.2).
        rod_diameter: Diameter of the carbon-fibre rod [m]. Estimate: of the rods that are sold the
            thinnest whose Euler load as a clamped column is twice what it carries when two legs
            bear the robot, 0.12 N; that of 0.4 mm is 0.13 N, that of 0.5 mm 0.33 N.
        offset: Distance of the TCAs from the rod [m]. Estimate.
        phase: Angle of the first TCA from the leg's x axis [rad].
        count: Number of TCAs, at equal angles from ``phase`` on, 2 to 100.
        plate_radius: Radius of the plates [m]. Estimate.
        plate_thickness: Thickness of the plates [m]. Estimate.
        plate_fill: Share of a plate's disc that is not cut out. Estimate.
        foot_radius: Radius of the round foot [m]. Estimate: then foot and not the rim of the last
            plate touches as long as the leg leans by less than 58 degrees, and the flat robot is
            25 mm high.
        foot_mass: Mass of the foot [kg]. Estimate: a solid ball of silicone rubber, 1070 kg/m³.
        plate_friction: Coefficient of friction of the plates. Estimate: printed plastic on glass.
        friction: Coefficient of friction of the foot. Estimate: silicone rubber on glass or a
            varnished desk.
        damping_time: Kelvin-Voigt time of the leg [s]. Estimate: the TCAs' loss, as the rod has
            almost none.
        motions: Motions of each node. Without twist a foot under load is off by millimetres.
        nodes: Nodes of the chain, each with a plate behind it. A foot of three that twist is at
            most 0.3 mm off theory at 0.05 N and 0.5 mm at 0.1 N; in the walk it carries 0.07 N.
        tca: The kind of TCA, cut to the leg's length.

    Raises:
        ValueError: If a dimension is not finite and positive, a number not whole, the TCAs lie
            outside the plates, or one of the two bends is missing.
    """

    length: Length = 55e-3
    rod_diameter: Section = 0.5e-3
    offset: Section = 8e-3
    phase: Angle = 0.0
    count: Annotated[int, partial(whole, at_least=2, at_most=100)] = 3
    plate_radius: Section = 9e-3
    plate_thickness: Section = 1e-3
    plate_fill: Annotated[float, partial(number, above=0.0, at_most=1.0)] = 0.5
    foot_radius: Section = 5e-3
    foot_mass: Mass = 0.56e-3
    friction: Positive = 0.8
    plate_friction: Positive = 0.3
    damping_time: Positive = 20e-3
    motions: tuple[Motion, ...] = ("bend_x", "bend_y", "twist")
    nodes: Nodes = 3
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("offset", self.offset, below=self.plate_radius, unit="m, plate_radius")
        if not {"bend_x", "bend_y"} <= set(self.motions):
            raise ValueError(f"motions must contain 'bend_x' and 'bend_y', got {self.motions}")

    @property
    def body(self) -> BeamSpec:
        """The rod, with the outline of its plates."""
        rod = BeamSpec.circular(
            length=self.length, diameter=self.rod_diameter, young=CARBON_YOUNG, shear=CARBON_SHEAR,
            density=CARBON_DENSITY, damping_time=self.damping_time,
        )  # fmt: skip
        return replace(rod, outline=Outline(self.plate_radius, self.plate_radius))

    @property
    def plate_mass(self) -> float:
        """Mass of one plate [kg]."""
        disc = math.pi * self.plate_radius**2 * self.plate_thickness
        return PRINTED_DENSITY * self.plate_fill * disc


@door
def continuum_leg(spec: LegSpec | None = None, *, mirrored: bool = False) -> Part:
    """Builds the leg: root at the origin, rod along z, TCA 0 at ``phase`` from x.

    Args:
        spec: The leg.
        mirrored: Whether the TCAs follow each other clockwise, as in a leg of the other side.

    Returns:
        A part with the TCAs ``tca0``, ``tca1``, ..., the sites ``tip`` (the end of the rod) and
        ``foot`` (the middle of the foot), and the geom ``foot``.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or LegSpec()
    part = Part(new_spec("leg"), sites={"tip": "tip", "foot": "foot"})
    chain = add_chain(
        part.spec.worldbody, spec.body, nodes=spec.nodes, name="rod", motions=spec.motions,
        rgba=(0.1, 0.1, 0.1, 0.0), collide=False,
    )  # fmt: skip
    turn = (-2.0 if mirrored else 2.0) * math.pi / spec.count
    _dress(chain, spec, turn)
    _foot(chain, spec)
    for i in range(spec.count):
        add_tca(part, chain, Helix(spec.offset, phase=spec.phase + turn * i), spec.tca)
    return part


def _dress(chain: Chain, spec: LegSpec, turn: float) -> None:
    """The rod that is seen, and a plate at the point of each piece, from TCA to TCA by ``turn``."""
    for index, piece in enumerate(chain.pieces):
        middle = chain.local(index)
        piece.add_geom(
            name=f"rod{index}", type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0.0, 0.0, 0.0, 0.0, 0.0, chain.extent(index)],
            size=[spec.rod_diameter / 2.0, 0.0, 0.0], rgba=[0.12, 0.12, 0.13, 1.0],
            **TOUCHES_NOTHING,
        )  # fmt: skip
        for side in range(spec.count):  # a frame with the TCAs' holes in its corners
            angles = [spec.phase + turn * (side + k) for k in (0, 1)]
            first, last = (
                [spec.offset * math.cos(a), spec.offset * math.sin(a), middle] for a in angles
            )
            # It ends before the next side begins, so that a corner has one contact, not two.
            last = [a + _SIDE * (b - a) for a, b in zip(first, last, strict=True)]
            piece.add_geom(
                name=f"plate{index}.{side}", type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=[*first, *last], size=[spec.plate_thickness, 0.0, 0.0],
                mass=spec.plate_mass / spec.count, rgba=[0.93, 0.55, 0.15, 1.0],
                **surface((spec.plate_friction, 0.002, 1e-4), priority=1),
            )  # fmt: skip


def _foot(chain: Chain, spec: LegSpec) -> None:
    """The foot, and the sites ``tip`` and ``foot``."""
    end = chain.local(spec.nodes)
    chain.tip.add_geom(
        name="foot", type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=[0.0, 0.0, end + spec.foot_radius],
        size=[spec.foot_radius, 0.0, 0.0], mass=spec.foot_mass, rgba=[0.2, 0.22, 0.25, 1.0],
        **surface((spec.friction, 0.002, 1e-4), priority=1, condim=4),
    )  # fmt: skip
    chain.mark_tip("tip")
    chain.mark_tip("foot", spec.foot_radius)

"""The bending morphing module: a shape-memory spine and a U-shaped TCA (Sun, Section 6.1).

Hot, the spine is soft and the TCA bends it; cold, it is rigid and keeps its shape without power.
The section's y axis lies in the plane of bending, x across it. The TCA runs on the side of -y, so
that a positive angle of ``bend_x`` bends the module towards its TCA.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

import mujoco

from tca_mj.checks import Checked, Positive, door
from tca_mj.hints import Mass, Section, size
from tca_mj.model.chain import Chain, Motion, Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.spine import route_spine, sheath
from tca_mj.model.surface import surface
from tca_mj.model.tendon import route_passes, route_tca
from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.routes import UTurn
from tca_mj.smp import HeaterSpec, SpineSpec
from tca_mj.smp.lumped import TUBE_DIAMETER, sheathed
from tca_mj.tca import CATALOGUE, TcaSpec

# Stiffness of what is round the spine (tube, wires) over that of the soft spine. Estimate: the
# silicone of the tube, 0.1 MPa, has 0.002 of the soft spine's bending stiffness.
SHEATH = 2e-3
_weight = partial(size, kind="parts of soft robots", at_least=0.0, at_most=0.5, unit="kg")
_PROTRUSIONS = 6  # pairs that hold the tube; Sun, Fig. 6.1, shows them, the number is an estimate


@dataclass(frozen=True, kw_only=True, slots=True)
class MorphingSpec(Checked):
    """A bending morphing module.

    Attributes:
        spine: Spine, and where the TCA runs.
        heater: Heater wire, fitted to the module's natural cooling.
        tca: The kind of TCA, cut to twice the spine's length.
        mass: Mass of spine, protrusions, tube and wires, without the TCA [kg]. Estimate: 2.2 g of
            epoxy, 1 g of silicone, 0.3 g of wire.
        half_width: Half the distance between the two legs of the U [m]. Estimate.
        tip_mass: Mass of a weight fixed to the tip [kg].
        damping_time: Kelvin-Voigt time of the spine [s]. Estimate: a loss factor of 0.2 at the
            2 Hz at which the soft module swings.
        motions: Motions of each node. The axis hardly stretches: at 240° the TCA would be 8 %
            shorter than the bend alone makes it.
        nodes: Nodes of the chain.

    Raises:
        ValueError: If a number is out of range.
    """

    spine: SpineSpec = field(default_factory=SpineSpec)
    heater: HeaterSpec = field(default_factory=lambda: HeaterSpec.fitted(SpineSpec()))
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])
    mass: Mass = 3.5e-3
    half_width: Section = 1.6e-3
    tip_mass: Annotated[float, _weight] = 0.0
    damping_time: Positive = 20e-3
    motions: tuple[Motion, ...] = ("bend_x", "bend_y", "twist")
    nodes: Nodes = 10

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if "bend_x" not in self.motions:
            raise ValueError(f"motions must contain 'bend_x', got {self.motions}")

    @property
    def body(self) -> BeamSpec:
        """What the chain has besides the shape-memory spine."""
        spine, size = self.spine, self.spine.tca_offset + TUBE_DIAMETER / 2.0
        return sheath(
            spine, SHEATH, length=spine.length, line_density=self.mass / spine.length,
            outline=Outline(spine.width / 2.0, size, round=False),
        )  # fmt: skip

    @property
    def sheathed(self) -> TcaSpec:
        """The TCA in its tube."""
        return sheathed(self.tca, self.spine)

    @property
    def route(self) -> UTurn:
        """The two legs of the TCA, on the side of -y."""
        return UTurn.parallel(self.spine.tca_offset, self.half_width, -math.pi / 2.0)


@door
def morphing_module(spec: MorphingSpec | None = None) -> Part:
    """Builds the module: clamped at the origin, straight along z, memorised straight.

    Args:
        spec: The module, by default the published one.

    Returns:
        A part with the TCA ``tca``, the spine ``spine``, the site ``tip`` and the body ``tip``
        at the same place: an external force on it acts on the end of the spine's axis.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or MorphingSpec()
    mjspec = new_spec("morphing")
    chain = add_chain(
        mjspec.worldbody, spec.body, nodes=spec.nodes, name="spine", motions=spec.motions,
        rgba=(0.0, 0.0, 0.0, 0.0), collide=False,
    )  # fmt: skip
    dress(chain, spec)
    tca = route_tca(mjspec, spec.sheathed, route_passes(chain, spec.route), name="tca")
    spine = route_spine(
        spec.spine, spec.heater, [chain], name="spine", tca="tca", damping_time=spec.damping_time
    )
    add_end(chain)
    if spec.tip_mass > 0.0:
        chain.tip.add_geom(
            name="weight", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[6e-3, 0.0, 0.0],
            pos=[0.0, 0.0, chain.local(spec.nodes)], mass=spec.tip_mass,
            rgba=[0.72, 0.55, 0.25, 1.0], contype=0, conaffinity=1,
        )  # fmt: skip
    return Part(mjspec, (tca,), {"tip": "tip"}, (spine,))


def add_end(chain: Chain) -> None:
    """Gives the end of a module's spine the site ``tip``, and a body there for external forces."""
    end = chain.tip.add_body(name="tip", pos=[0.0, 0.0, chain.local(chain.nodes)])
    end.ipos = [0.0, 0.0, 0.0]  # a body without mass is pushed where its centre of mass is said
    end.add_site(name="tip", group=4)


def dress(
    chain: Chain, spec: MorphingSpec, name: str = "", sides: Sequence[float] = (-1.0,)
) -> None:
    """What is seen and touched: polymer, protrusions on its inner side, the two legs' tube.

    Args:
        chain: The module, or a part of it.
        spec: The module.
        name: What the names of the geoms begin with.
        sides: On which sides tubes are, as signs of y.
    """
    spine, radius = spec.spine, TUBE_DIAMETER / 2.0
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    polymer, silicone = [0.86, 0.72, 0.42, 1.0], [0.92, 0.93, 0.95, 0.3]
    look = surface((0.3, 0.002, 1e-4), mass=0.0)
    legs = [(y, x) for y in sides for x in (-1.0, 1.0)]
    held = {round(chain.nodes * i / (_PROTRUSIONS - 1)) for i in range(_PROTRUSIONS)}
    for index, piece in enumerate(chain.pieces):
        whole = chain.extent(index)
        middle = whole / 2.0
        piece.add_geom(
            name=f"{name}polymer{index}", type=box, pos=[0.0, 0.0, middle],
            size=[spine.width / 2.0, spine.thickness / 2.0, middle], rgba=polymer, **look,
        )  # fmt: skip
        for leg, (y, x) in enumerate(legs):
            piece.add_geom(
                name=f"{name}tube{leg}.{index}", type=cylinder, size=[radius, middle, 0.0],
                pos=[x * spec.half_width, y * spine.tca_offset, middle], rgba=silicone, **look,
            )  # fmt: skip
        if index in held:
            at = {0: 1.5e-3, chain.nodes: whole - 1.5e-3}.get(index, middle)
            for leg, (y, x) in enumerate(legs):
                across = x * (spine.width / 2.0 - 0.3e-3)
                piece.add_geom(
                    name=f"{name}protrusion{leg}.{index}", type=box, size=[0.5e-3, radius, 1.5e-3],
                    pos=[across, y * (spine.tca_offset - 0.6e-3), at], rgba=polymer, **look,
                )  # fmt: skip

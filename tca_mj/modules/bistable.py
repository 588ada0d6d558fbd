"""The bistable bending module: a pre-curved spine in silicone and a rubber band (Sun, Section 4.3).

The band runs from the base of the spine to its tip, through a hole in it, and pulls the ends
together, so that the straight module is the top between two bends at rest. A cable or a U-shaped
TCA on each side pulls it over. The section's x axis lies in the plane of bending: a positive bend
leads to +x, which is *state 2*, to which the spine is curved; *state 1* is the other one.

The spine is stiff against all but bending in that plane, so that this is the only motion of a node.

A snap lasts some twenty milliseconds, and the integrator of the other models damps what moves that
fast. ``snapping`` gives a specification the one with which peak speed and time of a snap are those
of small steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Literal

import mujoco
import numpy as np

from tca_mj.checks import Array, Checked, NotNegative, door, number, require_one_of
from tca_mj.hints import Length, Modulus, Section, angle
from tca_mj.model.chain import Chain, Motion, Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.surface import TOUCHES_NOTHING
from tca_mj.model.tendon import path_length, route_passes, route_tca
from tca_mj.modules.bending import SILICONE_SHEAR, SILICONE_YOUNG
from tca_mj.rod.banded import BandedRod
from tca_mj.rod.beam import BeamSpec, Outline, torsion_constant
from tca_mj.routes import UTurn
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.embedding import SILICONE_DENSITY, in_silicone

NYLON_DENSITY = 1000.0  # NylonX, nylon with carbon fibres, data sheet of MatterHackers [kg/m³]
NYLON_POISSON = 0.4  # estimate, of nylon
RUBBER_MASS = 0.21e-3  # of a size 19 band of 1/16": 178 x 1.6 x 0.8 mm at 930 kg/m³ [kg]
# Stiffness of the band over that of the module. Fitted to one fact: "F_t2 is almost zero when
# θ = 100°" (Sun, Section 4.3.3), by the theory of ``BandedRod`` with the printed 32 and 45 mm.
BAND_RATIO = 5.405e4  # [1/m²]
SIDES = (-1.0, 1.0)
"""Where the cable or TCA of state 1 lies, and that of state 2, along x."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BistableSpec(Checked):
    """A bistable module.

    Stiffness and lever of the published one are not printed. What is: a band cannot be as stiff as
    a folded one (some 300 N/m) while a TCA of this kind still pulls the module over.

    Attributes:
        length: Length of the spine [m]. Sun, Section 4.3.2.
        width: Width of spine and bodies, along y [m]. The same.
        thickness: Thickness of spine and two bodies, along x [m]. The same.
        spine: Thickness of the spine [m]. The same.
        spine_young: Young's modulus of the printed spine [Pa]. Estimate.
        window: Share of the spine's width that the hole for the band leaves. Estimate: with these
            two a TCA of 172 °C pulls a module of 50° into both states, as it did, with an eighth
            to spare; beyond 0.5 it could no more.
        fill: Share of the bodies that is silicone and no slot, channel or hole. Estimate: a
            gripper of two weighs 4.0 g with it, 4.2 g are printed (Sun, Section 4.3.4).
        bodies: 2, or 1 if the body on the side of -x is left out, as in the jumper.
        angle: Angle θ0 of the unloaded spine [rad]. Sun, Section 4.3.4: 50° in the gripper.
        band_length: Length of the slack band [m]. Sun, Section 4.3.2.
        band_ratio: Stiffness of the band over the module's [1/m²]; see ``BAND_RATIO``.
        offset: Distance of the channels from the spine [m]. Estimate: TCAs just under the surface.
        half_width: Half the distance between the legs of a U [m]. Estimate.
        slack: By how much a TCA is longer than its way through the straight module [m]. Estimate:
            of the 100 mm of Section 4.3.4 some 6 lie in the turn, half a circle.
        friction: Coefficient of friction of a cable in its channel; TCAs have none.
        grip: Coefficient of friction of the surface.
        damping_time: Kelvin-Voigt time [s]. Estimate: of silicone, whose share of the stiffness
            is about half.
        motions: Motions of each node.
        nodes: Nodes of the chain.
        tca: The kind of TCA.

    Raises:
        ValueError: If a number is out of range, or the channels are outside of the bodies.
    """

    length: Length = 45e-3
    width: Section = 10e-3
    thickness: Section = 8e-3
    spine: Section = 0.35e-3
    spine_young: Modulus = 1.6e9
    window: Annotated[float, partial(number, above=0.0, at_most=1.0)] = 0.4
    fill: Annotated[float, partial(number, above=0.0, at_most=1.0)] = 0.45
    bodies: Literal[1, 2] = 2
    angle: Annotated[float, partial(angle, above=-math.pi, below=math.pi)] = math.radians(50.0)
    band_length: Length = 32e-3
    band_ratio: NotNegative = BAND_RATIO
    offset: Section = 3.35e-3
    half_width: Section = 2e-3
    slack: NotNegative = 4e-3
    friction: NotNegative = 0.0
    grip: NotNegative = 1.0
    damping_time: NotNegative = 5e-3
    motions: tuple[Motion, ...] = ("bend_y",)
    nodes: Nodes = 10
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        require_one_of("bodies", self.bodies, (1, 2))
        if "bend_y" not in self.motions:
            raise ValueError(f"motions must contain 'bend_y', got {self.motions}")
        number("spine", self.spine, below=self.thickness, unit="m, thickness")
        number("band_length", self.band_length, below=self.length, unit="m, length")
        outer = self.thickness / 2.0 - self.tca.outer_radius
        number("offset", self.offset, at_most=outer, unit="m, thickness/2 less the TCA's radius")

    @property
    def body(self) -> BeamSpec:
        """Spine and bodies without TCAs, the axis in the spine, with the weight of the band."""
        wide, thick, thin, share = self.width, self.thickness, self.spine, self.bodies / 2.0
        soft, plate = self.fill * share * wide * (thick - thin), self.window * wide * thin
        second = self.fill * share * (thick**3 - thin**3) / 12.0
        shear = self.spine_young / (2.0 + 2.0 * NYLON_POISSON)
        weight = SILICONE_DENSITY * soft + NYLON_DENSITY * plate + RUBBER_MASS / self.length
        return BeamSpec(
            length=self.length,
            bending=(
                self.spine_young * self.window * thin * wide**3 / 12.0,
                SILICONE_YOUNG * second * wide + self.spine_young * plate * thin**2 / 12.0,
            ),
            torsion=self.fill * share * SILICONE_SHEAR * torsion_constant(wide, thick)
            + self.window * shear * torsion_constant(wide, thin),
            stretching=SILICONE_YOUNG * soft + self.spine_young * plate,
            shearing=SILICONE_SHEAR * soft + shear * plate,
            line_density=weight, outline=Outline(thick / 2.0, wide / 2.0, round=False),
            curvature=(0.0, self.angle / self.length, 0.0), damping_time=self.damping_time,
        )  # fmt: skip

    @property
    def drawn(self) -> BeamSpec:
        """The body whose chain has pieces as long as the body's cells.

        Pieces of a pre-curved chain are sides of a polygon about its arc, which are longer. That
        is right near the unloaded shape, where this module never is: the band would pull more.
        """
        body, turn = self.body, 0.5 * self.angle / self.nodes
        factor = math.tan(turn) / turn if turn else 1.0
        return replace(
            body, length=body.length / factor, line_density=factor * body.line_density,
            bending=(body.bending[0] / factor, body.bending[1] / factor),
            torsion=body.torsion / factor, curvature=(0.0, factor * body.curvature[1], 0.0),
        )  # fmt: skip

    @property
    def stiffness(self) -> float:
        """Bending stiffness k_b of the module [N m/rad]."""
        return self.body.bending[1] / self.length

    @property
    def rod(self) -> BandedRod:
        """The module to theory."""
        return BandedRod(
            length=self.length, stiffness=self.stiffness, angle=self.angle, band=self.band,
            band_length=self.band_length,
        )  # fmt: skip

    @property
    def band(self) -> float:
        """Stiffness k_l of the band [N/m]."""
        return self.band_ratio * self.stiffness

    @property
    def embedded(self) -> TcaSpec:
        """A TCA in its channel, each leg with its share of the silicone.

        Where the module is bent a TCA that pulls lies on a wall.
        """
        section = self.fill * self.width * self.thickness / 4.0
        perimeter = self.width / 2.0 + self.thickness / 2.0
        return in_silicone(self.tca, section=section, perimeter=perimeter, touching=0.5)

    def route(self, side: float) -> UTurn:
        """The legs of the TCA on a side of ``SIDES``.

        Raises:
            ValueError: If the side is no number.
        """
        number("side", side)
        return UTurn.parallel(self.offset, self.half_width, 0.0 if side > 0.0 else math.pi)


@door
def bistable_module(
    spec: BistableSpec | None = None,
    *,
    drive: Literal["tcas", "cables"] = "tcas",
    collide: bool = True,
) -> Part:
    """Builds the module: clamped at the origin, its axis along z at the base, curved to +x.

    Args:
        spec: The module, by default a finger of the published gripper.
        drive: What lies in the channels. A cable is a tendon with the actuator of its name, whose
            control is its tension [N].
        collide: Whether its two bodies touch objects and ground.

    Returns:
        A part with the TCAs, or cables, ``to1`` and ``to2``, which pull to the state of this
        number, the tendon ``band`` and the sites ``base`` and ``tip``. With one body there is no
        channel, and so nothing in it, on the other side.

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import bistable_module
        >>> [tca.name for tca in bistable_module().tcas]
        ['to1', 'to2']
    """
    spec = spec or BistableSpec()
    require_one_of("drive", drive, ("tcas", "cables"))
    part = Part(new_spec("bistable"), sites={"base": "base", "tip": "tip"})
    snapping(part.spec)
    chain = add_chain(
        part, spec.drawn, nodes=spec.nodes, name="body", motions=spec.motions,
        collide=collide and spec.bodies == 2, friction=(spec.grip, 0.005, 0.0001),
        rgba=(0.93, 0.93, 0.9, 0.45 if spec.bodies == 2 else 0.0),
    )  # fmt: skip
    chain.pieces[0].add_site(name="base", group=4)
    chain.mark_tip("tip")
    _dress(chain, spec)
    if spec.band_ratio:
        band = part.spec.add_tendon(
            name="band", stiffness=[spec.band, 0.0, 0.0], springlength=[0.0, spec.band_length],
            width=0.8e-3, rgba=[0.75, 0.55, 0.3, 1.0],
        )  # fmt: skip
        band.wrap_site("base")
        band.wrap_site("tip")
    for number_, side in list(enumerate(SIDES, 1))[2 - spec.bodies :]:
        if drive == "cables":
            _add_cable(chain, f"to{number_}", -side * spec.offset, part.spec)
            continue
        passes = route_passes(chain, spec.route(side))
        straight = 2.0 * spec.length + spec.slack
        tca = spec.embedded.of_length(straight)
        stretch = path_length(passes) - straight
        part.tcas += (route_tca(part.spec, tca, passes, name=f"to{number_}", stretch=stretch),)
    return part


@door
def snapping(spec: mujoco.MjSpec) -> None:
    """Gives a specification the integrator for snaps.

    Args:
        spec: The specification, which is changed.
    """
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def _add_cable(chain: Chain, name: str, arm: float, spec: mujoco.MjSpec) -> None:
    """A cable without stretch, whose length is the sum of arm times bend of the nodes."""
    tendon = spec.add_tendon(name=name)
    for joints in chain.joints:
        tendon.wrap_joint(joints["bend_y"], arm)
    actuator = spec.add_actuator(
        name=name, trntype=mujoco.mjtTrn.mjTRN_TENDON, target=name, ctrlrange=[0.0, 1e3],
    )  # fmt: skip
    actuator.set_to_motor()
    actuator.gear[0] = -1.0


@door
def shaped(spec: BistableSpec, bend: float) -> Array:
    """Angles of the nodes of the module as theory has it, shape (nodes,) [rad].

    Args:
        spec: The module.
        bend: Angle of its tip [rad].
    """
    points = (2.0 * np.arange(spec.nodes) + 1.0) / spec.nodes - 1.0
    shape = np.polynomial.legendre.legval(points, spec.rod.curvature(bend))
    return np.asarray(shape) / spec.nodes


def capstan(model: mujoco.MjModel, name: str, qpos: Array, spec: BistableSpec) -> None:
    """Lets the tension of a cable that is pulled at the base fall along its channel.

    By Euler's law it falls by exp(-μ) for every radian that the channel turns. To be called where
    the shape has changed.

    Args:
        model: The model, which is changed.
        name: The cable.
        qpos: Positions of the joints [rad].
        spec: The module, for lever and friction.
    """
    tendon = model.tendon(name).id
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    joints = model.wrap_objid[first : first + count]
    turn = np.abs(qpos[model.jnt_qposadr[joints]])
    passed = np.cumsum(turn) - 0.5 * turn  # a cell turns evenly
    arm = math.copysign(spec.offset, model.wrap_prm[first])
    model.wrap_prm[first : first + count] = arm * np.exp(-spec.friction * passed)


def _dress(chain: Chain, spec: BistableSpec) -> None:
    """The spine that is seen, and where one body is left out the other one, too."""
    box, high = mujoco.mjtGeom.mjGEOM_BOX, spec.width / 2.0
    for index, piece in enumerate(chain.pieces):
        middle = chain.extent(index) / 2.0
        piece.add_geom(
            name=f"spine{index}", type=box, pos=[0.0, 0.0, middle],
            size=[spec.spine / 2.0, high, middle], rgba=[0.12, 0.12, 0.13, 1.0], **TOUCHES_NOTHING,
        )  # fmt: skip
        if spec.bodies == 1:
            half = spec.thickness / 4.0
            piece.add_geom(
                name=f"silicone{index}", type=box, pos=[half, 0.0, middle],
                size=[half, high, middle], rgba=[0.93, 0.93, 0.9, 0.45], **TOUCHES_NOTHING,
            )  # fmt: skip

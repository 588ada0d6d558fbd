"""The morphing tetrapod of Sun, Section 6.3.2: three parallel spines, two rails, four legs.

x points forward, y to the left, z up. The spines run across the body from rail to rail; the robot
bends about the fore-aft axis, from flat to the shape of a U. The tree starts in the middle of the
spines, so that the model is as symmetric as the robot.

The three spines bend alike, because rigid rails hold their ends. They are therefore one chain whose
joints all three of them stiffen, each at its own temperature.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Annotated, Any

import mujoco

from tca_mj.checks import Checked, Finite, Positive, door, whole
from tca_mj.hints import Length, Mass, Section, angle
from tca_mj.model.chain import Chain, Motion, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.spine import lumped_torsion, route_spine, sheath
from tca_mj.model.surface import TOUCHES_NOTHING, surface
from tca_mj.model.tendon import Pass, RoutedTca, lay_tca
from tca_mj.modules.continuum_leg import LegSpec, continuum_leg
from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.routes import Helix, TcaCount
from tca_mj.smp import HeaterSpec, SpineSpec
from tca_mj.smp.lumped import in_tube
from tca_mj.tca import CATALOGUE, TcaSpec

LEGS = ("front_left", "front_right", "rear_left", "rear_right")  # names, in order
SIDES = {"left": 1.0, "right": -1.0}  # the sign of y
SPINES = 3  # how many

MOST_NODES = 32  # of a leg or half of a spine: with 32 each a physics step takes a second
FewNodes = Annotated[int, partial(whole, at_least=1, at_most=MOST_NODES)]
_Bend = Annotated[float, partial(angle, above=-math.pi, below=math.pi)]
# Stiffness of what is round a spine (tube, wires) over that of the soft spine. Estimate.
_SHEATH = 0.01


@dataclass(frozen=True, kw_only=True, slots=True)
class TetrapodSpec(Checked):
    """The robot. Sun prints its length, its height when flat and its speeds; the rest is estimated.

    Attributes:
        leg: A leg.
        spine: A spine, as in the morphing module.
        heater: Heater wire of a spine, fitted to the module's natural cooling.
        tca: The kind of TCA that bends a spine, cut to twice its length.
        module_mass: Mass of a spine with tube, wires and protrusions, without the TCA [kg].
            Estimate: 2.2 g of epoxy, 1 g of silicone and 0.3 g of wire.
        spacing: Fore-aft distance of neighbouring spines [m]. Estimate.
        memory_angle: Bend of the memorised shape, from rail to rail [rad]. Estimate of "almost
            flat", Sun, Section 6.3.2.
        rail_length: Length of a rail [m]. Sun: the robot is about 150 mm long.
        rail_width: Extent of a rail across the body [m]. Estimate.
        rail_mass: Mass of a rail with the sockets of its legs [kg]. Estimate.
        leg_station: Fore-aft distance of a leg's root from the middle [m]. Estimate.
        leg_height: Height of a leg's root above the spines' plane [m]. Estimate: flat, the robot is
            about 25 mm high.
        belly_friction: Coefficient of friction of spines and rails. Estimate: printed plastic and
            epoxy on glass.
        nodes: Nodes of each half of the spines, 1 to 32, as of each leg.

    Raises:
        ValueError: If a dimension is not finite and positive, or a number not whole or out of
            bounds.
    """

    leg: LegSpec = field(default_factory=LegSpec)
    spine: SpineSpec = field(default_factory=SpineSpec)
    heater: HeaterSpec = field(default_factory=lambda: HeaterSpec.fitted(SpineSpec()))
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])
    module_mass: Mass = 3.5e-3
    spacing: Length = 40e-3
    memory_angle: _Bend = math.radians(20.0)
    rail_length: Length = 150e-3
    rail_width: Section = 6e-3
    rail_mass: Mass = 3e-3
    leg_station: Length = 62e-3
    leg_height: Section = 6e-3
    belly_friction: Positive = 0.3
    nodes: FewNodes = 4

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        whole("leg.nodes", self.leg.nodes, at_most=MOST_NODES)

    @property
    def places(self) -> tuple[float, ...]:
        """Fore-aft positions of the spines, from the rear one on [m]."""
        return tuple(self.spacing * (i - (SPINES - 1) / 2) for i in range(SPINES))

    @door
    def body(self, *, count: TcaCount, length: Positive, curves: float) -> BeamSpec:
        """Some of the spines as one beam, but for what shape memory adds.

        Args:
            count: How many spines.
            length: Length of the beam [m].
            curves: -1 if the beam of the memorised shape bends towards its y axis, else 1.
        """
        half_width = self.spine.width / 2.0 if count == 1 else self.spacing + self.spine.width
        return sheath(
            self.spine, _SHEATH * count, length=length,
            line_density=count * self.module_mass / self.spine.length,
            outline=Outline(half_width, self.spine.module_height, round=False),
            curvature=(curves * self.memory_angle / self.spine.length, 0.0, 0.0),
        )  # fmt: skip


@door
def tetrapod(spec: TetrapodSpec | None = None) -> Part:
    """Builds the robot: the middle of the spines at the origin, on a free joint ``root``.

    Args:
        spec: The robot, by default the published one as far as it is known.

    Returns:
        A part with the TCAs ``<leg>.tca0`` (lifts the leg), ``<leg>.tca1`` (front, down) and
        ``<leg>.tca2`` (rear, down) for each of ``LEGS``, then ``spine0`` (rear) to ``spine2``;
        the spines ``spine0`` to ``spine2``; and the sites ``<leg>.foot`` and ``<leg>.tip``.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or TetrapodSpec()
    part, halves = trunk(spec, count=SPINES, nodes=spec.nodes, motions=("bend_x", "twist"))
    mjspec = part.spec
    attach_legs(part, spec.leg)
    torsion = 2 * lumped_torsion(spec.spine, spec.places, 2 * spec.nodes)[spec.nodes :]
    for i, x in enumerate(spec.places):
        name = f"spine{i}"
        part.tcas += (route_spine_tca(mjspec, halves, spec, x, name),)
        spine = route_spine(
            spec.spine, spec.heater, list(halves.values()), name=name, tca=name, torsion=torsion
        )
        part.spines += (spine,)
    return part


@door
def rigid_tetrapod(
    spec: TetrapodSpec | None = None, *, bend: Finite = 0.0, nodes: FewNodes = 8
) -> Part:
    """Builds the robot of ``tetrapod`` with cold spines: its body is rigid, its legs alone move.

    Cold, the three spines give by 1.8 rad/(N m): half of the robot's weight on one foot, at the
    lever of a leg, bends them by 0.6 degrees. The heaters have nothing to do and are left out; of
    the spines' TCAs there is only what is seen and what they weigh.

    Args:
        spec: The robot.
        bend: Bend of the body from rail to rail, which ``set_rigid_bend`` changes [rad].
        nodes: Nodes of each half of the spines. They move nothing, so that more than an elastic
            body has cost little; what rests on a beam's edges touches a surface that is rounder.

    Returns:
        A part with the TCAs and sites of the legs of ``tetrapod``, and the same bodies.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or TetrapodSpec()
    part, halves = trunk(spec, count=SPINES, nodes=nodes, motions=("bend_x",))
    mjspec = part.spec
    for side, chain in halves.items():
        for piece, joints in zip(chain.pieces[1:], chain.joints, strict=True):
            mjspec.delete(mjspec.joint(joints["bend_x"]))
            piece.quat = _bent(bend, SIDES[side], nodes)
    attach_legs(part, spec.leg)
    for i, x in enumerate(spec.places):  # their TCAs are seen and have a mass
        _draw(mjspec, route_spine_tca(mjspec, halves, spec, x, f"spine{i}"), halves)
    return part


def _draw(mjspec: mujoco.MjSpec, tca: RoutedTca, halves: Mapping[str, Chain]) -> None:
    """Puts rods that touch nothing where the tendon is, which would be computed in every step."""
    tendon = mjspec.tendon(tca.name)
    width, colour = float(tendon.width), tendon.rgba.copy()
    mjspec.delete(mjspec.actuator(tca.name))
    mjspec.delete(tendon)
    for chain in halves.values():
        for index, piece in enumerate(chain.pieces):
            end = chain.extent(index)
            for site in [site for site in piece.sites if site.name.startswith(f"{tca.name}.")]:
                x, y, _ = site.pos
                piece.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=[x, y, 0.0, x, y, end],
                    size=[width, 0.0, 0.0], rgba=colour, **TOUCHES_NOTHING,
                )  # fmt: skip
                mjspec.delete(site)


@door
def set_rigid_bend(model: mujoco.MjModel, bend: float, *, prefix: str = "") -> None:
    """Gives the body of a compiled ``rigid_tetrapod`` another bend.

    Args:
        model: The model.
        bend: Bend from rail to rail [rad].
        prefix: What stands before the robot's names in ``model``.
    """
    names = [model.body(i).name for i in range(model.nbody)]
    for side, sign in SIDES.items():
        pieces = [i for i, name in enumerate(names) if name.startswith(f"{prefix}{side}.piece")]
        model.body_quat[pieces[1:]] = _bent(bend, sign, len(pieces) - 1)


def _bent(bend: float, sign: float, nodes: int) -> tuple[float, float, float, float]:
    """Turn of one node of a half that is bent as a part of the whole, wxyz."""
    half = -sign * bend / (4.0 * nodes)
    return math.cos(half), math.sin(half), 0.0, 0.0


def trunk(
    spec: TetrapodSpec, *, count: int, nodes: int, motions: Sequence[Motion]
) -> tuple[Part, dict[str, Chain]]:
    """The free hub, two halves of the spines from there on, and the rails at their ends.

    Args:
        spec: The robot.
        count: How many spines the halves stand for, all or the middle one.
        nodes: Nodes of each half.
        motions: Motions of each node.

    Returns:
        The part, and its halves by their sides.
    """
    part, places = Part(new_spec("tetrapod")), dict(enumerate(spec.places))
    hub = part.spec.worldbody.add_body(name="hub")
    hub.add_freejoint(name="root")
    halves = {}
    for side, sign in SIDES.items():
        # The chain's x axis points forward; its y axis down in the left half, up in the right.
        body = spec.body(count=count, length=spec.spine.length / 2.0, curves=-sign)
        halves[side] = chain = add_chain(
            hub, body, nodes=nodes, name=side, motions=motions, rgba=(0.0, 0.0, 0.0, 0.0),
            quat=(math.sqrt(0.5), -sign * math.sqrt(0.5), 0.0, 0.0), collide=False,
        )  # fmt: skip
        add_rail(chain, spec, sign)
        # What the halves have in common, on the hub, is one thing to touch.
        common = chain.piece / 2.0 * sign
        seen = places if count == SPINES else {SPINES // 2: 0.0}
        dress(chain, spec, down=sign, places=seen, behind=common)
    return part, halves


def attach_legs(part: Part, leg: LegSpec) -> None:
    """Attaches a leg to each of the rails' four sites; their TCAs in the order of ``LEGS``."""
    for side in SIDES:
        for place in ("front", "rear"):
            child = continuum_leg(leg, mirrored=side == "right")
            part.attach(child, to=f"{side}.{place}", prefix=f"{place}_{side}")
    order = {name: i for i, name in enumerate(LEGS)}
    part.tcas = tuple(sorted(part.tcas, key=lambda tca: order[tca.name.split(".")[0]]))


def dress(
    chain: Chain, spec: TetrapodSpec, *, down: float, places: Mapping[int, float],
    behind: float = 0.0,
) -> None:  # fmt: skip
    """What of spines is seen and touched, tube below and polymer above.

    Args:
        chain: The chain.
        spec: The robot.
        down: 1 if the chain's y axis points down, -1 if up.
        places: x in the chain of each spine, by its number [m].
        behind: How far the first piece reaches behind the chain's root; minus its length leaves
            it out [m].
    """
    size, below = spec.spine, down * spec.spine.module_height / 2.0
    layers = (
        ("spine", 0.0, size.thickness, [0.86, 0.78, 0.52, 1.0]),
        ("tube", below, size.module_height - size.thickness, [0.9, 0.9, 0.88, 0.6]),
    )
    for index, piece in enumerate(chain.pieces):
        end = chain.extent(index)
        begin = 0.0 if index else -behind
        half, middle = (end - begin) / 2.0, (end + begin) / 2.0
        if half <= 0.0:
            continue
        for (i, x), (part, y, height, rgba) in product(places.items(), layers):
            piece.add_geom(
                name=f"{chain.name}.{part}{i}.{index}", type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[x, y, middle], size=[size.width / 2.0, height / 2.0, half],
                rgba=rgba, **_belly(spec),
            )  # fmt: skip


def _belly(spec: TetrapodSpec, mass: float = 0.0) -> dict[str, Any]:
    """Mass and surface of what the robot may lie on."""
    return surface((spec.belly_friction, 0.002, 1e-4), priority=1, mass=mass)


def add_rail(chain: Chain, spec: TetrapodSpec, sign: float) -> None:
    """A rail at the end of a half, with the sites ``<side>.front`` and ``<side>.rear`` for legs.

    It is as high as the modules that it holds and flush with them, so that what lies on it is not
    carried by their tubes as well.
    """
    tip, end = chain.tip, chain.local(chain.nodes)
    middle, up = end + spec.rail_width / 2.0, -sign  # of the chain's y axis
    height = spec.spine.module_height
    low = -up * (height - spec.spine.thickness) / 2.0  # of the modules' middle
    grey = [0.25, 0.3, 0.36, 1.0]
    tip.add_geom(
        name=f"{chain.name}.rail", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0.0, low, middle],
        size=[spec.rail_length / 2.0, height / 2.0, spec.rail_width / 2.0],
        rgba=grey, **_belly(spec, spec.rail_mass),
    )  # fmt: skip
    # The leg's z axis points outwards, x up.
    turn = -sign * math.pi / 4.0
    for place, x in (("front", spec.leg_station), ("rear", -spec.leg_station)):
        tip.add_geom(
            name=f"{chain.name}.{place}.socket", type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[x, up * spec.leg_height / 2.0, middle],
            size=[4e-3, (spec.leg_height + height) / 2.0, spec.rail_width / 2.0],
            rgba=grey, **TOUCHES_NOTHING,
        )  # fmt: skip
        tip.add_site(
            name=f"{chain.name}.{place}", group=4,
            pos=[x, up * spec.leg_height, end + spec.rail_width],
            quat=[math.cos(turn), 0.0, 0.0, math.sin(turn)],
        )  # fmt: skip


def route_spine_tca(
    mjspec: mujoco.MjSpec, halves: Mapping[str, Chain], spec: TetrapodSpec, x: float, name: str
) -> RoutedTca:
    """The U-shaped TCA below the spine at ``x``: from rail to rail and back."""
    passes = []
    for out, sides in ((1.0, ("right", "left")), (-1.0, ("left", "right"))):
        for side in sides:
            place = x + out * spec.spine.width / 4.0
            below = SIDES[side] * spec.spine.tca_offset
            leg = Helix(math.hypot(place, below), phase=math.atan2(below, place))
            passes.append(Pass(halves[side], leg, down=side == sides[0]))
    return lay_tca(mjspec, in_tube(spec.tca), passes, name=name)

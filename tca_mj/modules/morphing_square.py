"""Morphing modules with a square spine: one twists, one bends to any side (Sun, Section 7.2).

Sun builds the module that bends in one plane and names twisting and bending in space as what may
follow; nothing of these two is printed, so that their sizes are choices. A square spine is as stiff
to any side as the published one is in its plane, and a strip of its stiffness would twist less.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

import mujoco
import numpy as np

from tca_mj.checks import Angle, Checked, Positive, door, quantity, whole
from tca_mj.hints import Mass
from tca_mj.model.build import add_tca
from tca_mj.model.chain import MOTIONS, Chain, Motion, Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.spine import SHEAR_RATIO, route_spine, sheath
from tca_mj.model.surface import surface
from tca_mj.modules.morphing import SHEATH, add_end
from tca_mj.rod.beam import BeamSpec, Outline, torsion_constant
from tca_mj.routes import Route, Turns, UTurn, parallel
from tca_mj.smp import HOLD_TEMPERATURE, HeaterSpec, SpineSpec
from tca_mj.smp.lumped import TUBE_DIAMETER, in_tube
from tca_mj.tca import CATALOGUE, TcaSpec, law_at, pulling_temperature

_SIDE = 3.2e-3  # of the square whose second moment is that of 6.5 x 2.5 mm [m]
_OFFSET = 3.6e-3  # of the TCAs: a tube of 2.5 mm on the corners of the square [m]
_ROUNDS = 50  # of fixed-point iterations; each takes a hundredth or less of the error on
_LEG = 4  # straight pieces that are drawn for the tube in a piece of the body

AroundCount = Annotated[int, partial(whole, at_least=3, at_most=6)]
_turned = partial(quantity, at_least=-4.0 * math.pi, at_most=4.0 * math.pi, unit="rad")
_bent = partial(quantity, at_least=0.0, at_most=2.0 * math.pi, unit="rad")


@door
def square_spine(length: Positive) -> SpineSpec:
    """A square spine as stiff in bending as the published one.

    Args:
        length: Length [m].
    """
    return SpineSpec(
        length=length, width=_SIDE, thickness=_SIDE, tca_offset=_OFFSET,
        module_height=2.0 * _OFFSET + TUBE_DIAMETER,
    )  # fmt: skip


def _around(spine: SpineSpec, mass: float) -> BeamSpec:
    """What a module has besides its spine: tubes, ribs and wires, in a round outline."""
    radius = spine.tca_offset + TUBE_DIAMETER / 2.0
    return sheath(
        spine, SHEATH, length=spine.length, line_density=mass / spine.length,
        outline=Outline(radius, radius),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class TwistMorphingSpec(Checked):
    """A morphing module that twists: a square spine in a double helix of one folded TCA.

    Of straight TCAs none twists, of helices a double one does not bend. More turns twist further,
    and less and less so, and the TCA gets longer: at 140 °C 1, 2, 3 and 4 turns turn the tip by
    71, 119, 149 and 169° with 128, 150, 181 and 217 mm of TCA.

    Attributes:
        spine: Spine, and how far from its axis the TCA runs. Its length is a choice.
        heater: Heater wire; it loses as much heat per surface as that of the published module.
        tca: The kind of TCA, cut to the route.
        turns: Turns of each of the two legs over the module; positive is right-handed, and then a
            pull turns the tip clockwise, seen from the tip [1]. A choice, see above.
        mass: Mass of spine, tube, ribs and wires, without the TCA [kg]. Estimate: 0.7 g of epoxy,
            0.8 g of silicone, 0.2 g of wire.
        damping_time: Kelvin-Voigt time of the spine [s]. Estimate, as of the bending module.
        motions: Motions of each node.
        nodes: Nodes of the chain, at least three per turn.

    Raises:
        ValueError: If a number is out of range, or the motions do not contain "twist".

    Example:
        >>> from tca_mj import TwistMorphingSpec
        >>> spec = TwistMorphingSpec()
        >>> round(spec.temperature_for(-1.57))  # that turns the hot module by a quarter [°C]
        109
    """

    spine: SpineSpec = field(default_factory=lambda: square_spine(60e-3))
    heater: HeaterSpec = field(default_factory=lambda: HeaterSpec.alike(square_spine(60e-3)))
    turns: Turns = 3.0
    mass: Mass = 1.7e-3
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])
    nodes: Nodes = 12
    motions: tuple[Motion, ...] = MOTIONS
    damping_time: Positive = 20e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if "twist" not in self.motions or not self.turns:
            raise ValueError("motions must contain 'twist', and turns not be 0, got"
                             f" {self.motions} and {self.turns}")  # fmt: skip

    @property
    def body(self) -> BeamSpec:
        """What the chain has besides the shape-memory spine."""
        return _around(self.spine, self.mass)

    @property
    def route(self) -> UTurn:
        """The TCA, folded in half and wound round the spine."""
        return UTurn.double_helix(self.spine.tca_offset, self.turns)

    @property
    def sheathed(self) -> TcaSpec:
        """The TCA in its tube, cut to the route of the straight module."""
        return in_tube(self.tca).of_length(2.0 * self._leg(0.0, 1.0))

    def _leg(self, twist: float, along: float) -> float:
        """Length of a leg at a twist [rad/m] and a stretch [1]."""
        wound = 2.0 * math.pi * self.turns / self.spine.length
        return self.spine.length * math.hypot(along, self.spine.tca_offset * (wound + twist))

    @property
    def turn(self) -> float:
        """Angle by which a tension turns the soft spine, as long as it is small [rad/N]."""
        return 1.0 / self._tension(1.0, self.spine.smp.rubbery, 0.0)[0]

    def _tension(self, angle: float, modulus: float, twist: float) -> tuple[float, float]:
        """Tension that holds an angle [N], and the stretch [1], at a twist of the legs [rad/m].

        Torque and pull of two legs at the radius R, q their length per length of the spine:
        2 F R² (ω + u)/q = G J u and 2 F v/q = E A (1 - v).
        """
        spine, stretch, force = self.spine, 1.0, 0.0
        torsion = modulus * SHEAR_RATIO * torsion_constant(spine.width, spine.thickness)
        wound = abs(2.0 * math.pi * self.turns / spine.length) - abs(twist)
        for _ in range(_ROUNDS):
            legs = 2.0 * spine.length / self._leg(twist, stretch)
            force = torsion * abs(angle) / spine.length / (spine.tca_offset**2 * wound * legs)
            stretch = 1.0 - legs * force * stretch / (modulus * spine.width * spine.thickness)
        return force, stretch

    @door
    def temperature_for(
        self, angle: Annotated[float, _turned], spine: float = HOLD_TEMPERATURE
    ) -> float:
        """Temperature of the TCA that holds an angle of the hot, weightless module [°C].

        Args:
            angle: Turn of the tip about the axis, x towards y; its sign is not that of ``turns``
                [rad].
            spine: Temperature of the spine [°C].

        Raises:
            ValueError: If the sign is the other one, or the angle out of the TCA's reach.
        """
        if angle * self.turns > 0.0 or abs(angle) > abs(2.0 * math.pi * self.turns):
            raise ValueError(
                f"angle must be between 0 and {-2.0 * math.pi * self.turns:.4g} rad, what unwinds"
                f" the helix, got {angle:.4g}"
            )
        modulus, twist = float(self.spine.smp.modulus(spine)), angle / self.spine.length
        force, stretch = self._tension(angle, modulus, twist)
        return pulling_temperature(self.sheathed, 2.0 * self._leg(twist, stretch), force)


@dataclass(frozen=True, kw_only=True, slots=True)
class Morphing3dSpec(Checked):
    """A morphing module that bends to any side: a square spine with straight TCAs round it.

    Attributes:
        spine: Spine, and how far from its axis the TCAs run. As long as the published module, and
            as stiff in every direction as that is in its plane.
        heater: Heater wire; it loses as much heat per surface as that of the published module.
        count: Number of TCAs, at equal angles from the x axis on; two bend to a side between them.
        mass: Mass of spine, tubes, ribs and wires, without the TCAs [kg]. Estimate: 1.4 g of
            epoxy, 1.5 g of silicone, 0.3 g of wire.
        tca: The kind of TCA, cut to the spine's length.
        motions: Motions of each node.
        damping_time: Kelvin-Voigt time of the spine [s]. Estimate, as of the bending module.
        nodes: Nodes of the chain.

    Raises:
        ValueError: If a number is out of range, or the motions are not at least both bends.

    Example:
        >>> from tca_mj import Morphing3dSpec
        >>> [round(t) for t in Morphing3dSpec().temperatures(direction=0.5, angle=1.5)]  # [°C]
        [130, 92, 25]
    """

    spine: SpineSpec = field(default_factory=lambda: square_spine(115e-3))
    heater: HeaterSpec = field(default_factory=lambda: HeaterSpec.alike(square_spine(115e-3)))
    count: AroundCount = 3
    motions: tuple[Motion, ...] = MOTIONS
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])
    mass: Mass = 3.2e-3
    damping_time: Positive = 20e-3
    nodes: Nodes = 10

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if not {"bend_x", "bend_y"} <= set(self.motions):
            raise ValueError(f"motions must contain 'bend_x' and 'bend_y', got {self.motions}")

    @property
    def body(self) -> BeamSpec:
        """What the chain has besides the shape-memory spine."""
        return _around(self.spine, self.mass)

    @property
    def routes(self) -> tuple[Route, ...]:
        """Where the TCAs run, the first one on the side of x."""
        return parallel(self.count, self.spine.tca_offset)

    @property
    def sheathed(self) -> TcaSpec:
        """A TCA in its tube, cut to the straight module."""
        return in_tube(self.tca).of_length(self.spine.length)

    @door
    def temperatures(
        self, direction: Angle, angle: Annotated[float, _bent], spine: float = HOLD_TEMPERATURE
    ) -> tuple[float, ...]:
        """Temperatures of the TCAs that bend the hot, weightless module evenly to a side [°C].

        The two TCAs next to that side are heated; the others are as cold as their surroundings, and
        those on the far side, which are stretched, pull the other way.

        Args:
            direction: Side to which the tip goes, an angle from x towards y [rad].
            angle: How far the module is bent [rad].
            spine: Temperature of the spine [°C].

        Raises:
            ValueError: If the angle is out of the TCAs' reach.
        """
        size, tca = self.spine, self.sheathed
        modulus, cold = float(size.smp.modulus(spine)), law_at(tca, tca.ambient)
        sides = 2.0 * math.pi * np.arange(self.count) / self.count
        shorter = size.tca_offset * angle * np.cos(direction - sides)
        first = math.floor(direction % (2.0 * math.pi) / (2.0 * math.pi / self.count))
        pair = [first % self.count, (first + 1) % self.count]
        levers = size.tca_offset * np.array([np.cos(sides), np.sin(sides)])
        wanted = modulus * size.second_moment * angle / size.length
        moment = wanted * np.array([math.cos(direction), math.sin(direction)])
        stretch, force = 1.0, np.zeros(self.count)
        for _ in range(_ROUNDS):
            length = size.length * stretch - shorter
            force = np.array(cold(length)[0])
            force[pair] = 0.0
            force[pair] = np.linalg.solve(levers[:, pair], moment - levers @ force)
            stretch = 1.0 - float(force.sum()) / (modulus * size.width * size.thickness)
        return tuple(
            pulling_temperature(tca, float(length[i]), max(float(force[i]), 0.0))
            if i in pair else tca.ambient for i in range(self.count)
        )  # fmt: skip


@door
def twist_morphing_module(spec: TwistMorphingSpec | None = None) -> Part:
    """Builds the module: clamped at the origin, straight along z, memorised straight.

    Args:
        spec: The module.

    Returns:
        A part with the TCA ``tca``, the spine ``spine``, the site ``tip`` and the body ``tip`` at
        the same place.

    Raises:
        ValueError: If the geometry cannot be built, for example with too few nodes per turn.

    Example:
        >>> from tca_mj import Simulation, twist_morphing_module
        >>> Simulation(twist_morphing_module()).spines.names
        ('spine',)
    """
    spec = spec or TwistMorphingSpec()
    return _square_module("twist_morphing", spec, {"tca": spec.route}, spec.turn)


@door
def morphing_3d_module(spec: Morphing3dSpec | None = None) -> Part:
    """Builds the module: clamped at the origin, straight along z, TCA 0 on the x side.

    Args:
        spec: The module.

    Returns:
        A part with the TCAs ``tca0``, ``tca1``, ..., the spine ``spine``, the site ``tip`` and the
        body ``tip`` at the same place.

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import morphing_3d_module
        >>> [tca.name for tca in morphing_3d_module().tcas]
        ['tca0', 'tca1', 'tca2']
    """
    spec = spec or Morphing3dSpec()
    size = spec.spine
    turn = size.tca_offset * size.length / (size.smp.rubbery * size.second_moment)
    routes = {f"tca{i}": route for i, route in enumerate(spec.routes)}
    return _square_module("morphing_3d", spec, routes, turn)


def _square_module(name: str, spec: Any, routes: Mapping[str, Route], turn: float) -> Part:
    """A straight module on a square spine.

    Args:
        name: Name of the model.
        spec: The module.
        routes: Routes by the names of their TCAs.
        turn: Angle by which each of these turns the soft spine per tension [rad/N].
    """
    part = Part(new_spec(name), sites={"tip": "tip"})
    chain = add_chain(
        part.spec.worldbody, spec.body, nodes=spec.nodes, name="spine", motions=spec.motions,
        rgba=(0.0, 0.0, 0.0, 0.0), collide=False,
    )  # fmt: skip
    _dress_square(chain, spec.spine, routes)
    for key, route in routes.items():
        add_tca(part, chain, route, in_tube(spec.tca), name=key)
    part.spines = (
        route_spine(
            spec.spine, spec.heater, [chain], name="spine", tca=dict.fromkeys(routes, turn),
            damping_time=spec.damping_time,
        ),
    )  # fmt: skip
    add_end(chain)
    return part


def _dress_square(chain: Chain, spine: SpineSpec, routes: Mapping[str, Route]) -> None:
    """What is seen and touched: polymer, tubes along the routes, and the ribs that hold these."""
    look, radius = surface((0.3, 0.002, 1e-4), mass=0.0), TUBE_DIAMETER / 2.0
    polymer, silicone = [0.86, 0.72, 0.42, 1.0], [0.92, 0.93, 0.95, 0.3]
    legs = [leg for route in routes.values() for leg in route.legs]
    for index, piece in enumerate(chain.pieces):
        whole = chain.extent(index)
        begin = 0.0 if index == 0 else (index - 0.5) * chain.cell
        piece.add_geom(
            name=f"polymer{index}", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0.0, 0.0, whole / 2.0],
            size=[spine.width / 2.0, spine.thickness / 2.0, whole / 2.0], rgba=polymer, **look,
        )  # fmt: skip
        for number, leg in enumerate(legs):
            along = np.linspace(0.0, whole, _LEG + 1 if leg.turns else 2)
            points = np.column_stack([leg.offset((begin + along) / chain.beam.length), along])
            for part, (start, end) in enumerate(zip(points, points[1:], strict=False)):
                piece.add_geom(
                    name=f"tube{number}.{index}.{part}", type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                    fromto=[*start, *end], size=[radius, 0.0, 0.0], rgba=silicone, **look,
                )  # fmt: skip
            at = chain.local(index)
            foot = leg.offset(chain.points[index] / chain.beam.length)
            piece.add_geom(
                name=f"rib{number}.{index}", type=mujoco.mjtGeom.mjGEOM_CAPSULE, rgba=polymer,
                fromto=[0.0, 0.0, at, *((1.0 - radius / spine.tca_offset) * foot), at],
                size=[0.5e-3, 0.0, 0.0], **look,
            )  # fmt: skip

"""A grid of morphing modules as one part: a flat lattice that becomes a vault, a dome or a saddle.

Sun, Section 7.2, names a grid surface of bending modules as what may follow. Each member of the
lattice is such a module, shorter, with a TCA above its spine and one below, so that it bends to
either side; it has its own heater. Members are clamped into rigid junctions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, NamedTuple

import mujoco
import numpy as np

from tca_mj.checks import Array, Checked, door, quantity, whole
from tca_mj.hints import Mass, Section
from tca_mj.model.build import add_tca
from tca_mj.model.chain import Chain, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.spine import route_spine
from tca_mj.model.surface import surface
from tca_mj.model.weld import weld
from tca_mj.modules.morphing import MorphingSpec, dress
from tca_mj.modules.morphing_square import square_spine
from tca_mj.rod.lie import matrix_quaternion
from tca_mj.routes import UTurn
from tca_mj.smp import HOLD_TEMPERATURE, HeaterSpec
from tca_mj.smp.lumped import TUBE_DIAMETER, in_tube
from tca_mj.tca import law_at, pulling_temperature

MOST_CELLS = 240  # of all members; a step takes a time that grows with their third power
SIDES = {"up": 1.0, "down": -1.0}  # of the TCAs of a member, as signs of the grid's z

Junction = tuple[int, int]
"""Row and column of a junction."""
Junctions = Annotated[int, partial(whole, at_least=1, at_most=32)]
_bent = partial(quantity, at_least=-math.pi, at_most=math.pi, unit="rad")
Bend = Annotated[float, _bent]


class Beam(NamedTuple):
    """A member between two junctions.

    Attributes:
        name: ``x<row>.<column>`` or ``y<row>.<column>``, after the first of its junctions.
        start: The junction nearer to the one that is held.
        end: The other one.
        closing: Whether the other one is held by another member, too: this one closes a loop.
    """

    name: str
    start: Junction
    end: Junction
    closing: bool


def _member() -> MorphingSpec:
    square = square_spine(30e-3)
    offset = (square.thickness + TUBE_DIAMETER) / 2.0  # tubes on the faces of the spine
    spine = replace(square, tca_offset=offset, module_height=2.0 * offset + TUBE_DIAMETER)
    return MorphingSpec(
        spine=spine, heater=HeaterSpec.alike(spine), half_width=1.3e-3, mass=1.0e-3, nodes=4
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class MorphingGridSpec(Checked):
    """A rectangular lattice of members in the x-y plane, held at the junction in its middle.

    Attributes:
        rows: Junctions along y, 1 to 32.
        columns: Junctions along x, 1 to 32.
        member: A member, by default 30 mm long with a square spine: both are choices. A lattice
            that curves to both sides also shears; its members then bend in its plane, where a strip
            is too stiff: with the published section a saddle of 30° in each member snaps towards a
            vault. Mass, an estimate: 0.36 g of epoxy, 0.52 g of silicone, 0.12 g of wires.
        junction: Side of a junction, a rigid square as thick as a member is wide [m]. Estimate.
        junction_mass: Its mass [kg]. Estimate: printed plastic.

    Raises:
        ValueError: If a number is out of range, there are less than two junctions, all members
            have more than 240 nodes together (a bound for the work of a step), or the member has a
            weight at its tip.

    Example:
        >>> from tca_mj import MorphingGridSpec
        >>> spec = MorphingGridSpec(rows=2, columns=3)
        >>> len(spec.members), round(1e3 * spec.pitch)  # [mm]
        (7, 38)
    """

    rows: Junctions = 3
    columns: Junctions = 3
    member: MorphingSpec = field(default_factory=_member)
    junction: Section = 8e-3
    junction_mass: Mass = 0.4e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.rows * self.columns < 2:
            raise ValueError(
                f"rows and columns must make 2 junctions or more, got {self.rows}, {self.columns}"
            )
        cells = self.member.nodes * len(self.members)
        if cells > MOST_CELLS:
            raise ValueError(
                f"nodes of all members must be at most {MOST_CELLS}, got {cells}: {self.rows} by"
                f" {self.columns} junctions, {self.member.nodes} nodes in each member"
            )
        if self.member.tip_mass:
            raise ValueError(f"member.tip_mass must be 0, got {self.member.tip_mass}")

    @property
    def pitch(self) -> float:
        """Distance of junctions next to each other in the flat grid [m]."""
        return self.member.spine.length + self.junction

    @property
    def held(self) -> Junction:
        """The junction that is held."""
        return (self.rows - 1) // 2, (self.columns - 1) // 2

    @property
    def members(self) -> tuple[Beam, ...]:
        """All members, those that reach a junction first before those that close loops."""
        reached, front = {self.held}, [self.held]
        found: list[Beam] = []
        for one in front:
            for other in self._next(one):
                if other not in reached:
                    reached.add(other)
                    front.append(other)
                    found.append(Beam(_named(one, other), one, other, closing=False))
        names = {beam.name for beam in found}
        for one in front:
            for other in self._next(one):
                if _named(one, other) not in names:
                    names.add(_named(one, other))
                    found.append(Beam(_named(one, other), one, other, closing=True))
        return tuple(found)

    def _next(self, one: Junction) -> Iterator[Junction]:
        """The junctions next to one."""
        row, column = one
        for other in ((row, column + 1), (row, column - 1), (row + 1, column), (row - 1, column)):
            if 0 <= other[0] < self.rows and 0 <= other[1] < self.columns:
                yield other

    @door
    def member_temperatures(
        self, angle: Bend, spine: float = HOLD_TEMPERATURE
    ) -> tuple[float, float]:
        """Temperatures of the TCAs above and below that bend a soft, free member [°C].

        E I θ/L = 2 a (F - F'), where F' is the pull of the other TCA, cold and stretched.

        Args:
            angle: Bend of the member, positive where its end goes up [rad].
            spine: Temperature of its spine [°C].

        Raises:
            ValueError: If the angle is out of the TCAs' reach.
        """
        size, half = self.member.spine, abs(angle) * self.member.spine.tca_offset
        tca = self.member.sheathed
        against = float(law_at(tca, tca.ambient)(2.0 * (size.length + half))[0])
        moment = float(size.bending(spine)) * abs(angle) / size.length
        force = against + moment / (2.0 * size.tca_offset)
        hot = pulling_temperature(tca, 2.0 * (size.length - half), force)
        return (hot, tca.ambient) if angle >= 0.0 else (tca.ambient, hot)

    @door
    def temperatures(
        self, along_x: Bend = 0.0, along_y: Bend = 0.0, spine: float = HOLD_TEMPERATURE
    ) -> Array:
        """Temperatures of all TCAs, in their order, that bend all members alike [°C].

        One of the angles makes a vault, two of a sign a bowl or a dome, two of opposite signs a
        saddle. A lattice that curves to both sides also has to shear, and bends less than a member
        does that is free.

        Args:
            along_x: Bend of each member along x, positive where the edge goes up [rad].
            along_y: Bend of each member along y [rad].
            spine: Temperature of the spines [°C].

        Returns:
            Shape (2 members,).

        Raises:
            ValueError: If an angle is out of the TCAs' reach.
        """
        bends = {"x": along_x, "y": along_y}
        pairs = {axis: self.member_temperatures(bend, spine) for axis, bend in bends.items()}
        return np.array([each for beam in self.members for each in pairs[beam.name[0]]])


def _named(one: Junction, other: Junction) -> str:
    row, column = min(one, other)
    return f"{'x' if one[0] == other[0] else 'y'}{row}.{column}"


@door
def morphing_grid(spec: MorphingGridSpec | None = None) -> Part:
    """Builds the grid, flat and memorised flat, its middle junction at the origin and held.

    Args:
        spec: The grid.

    Returns:
        A part with, for each member, the TCAs ``<member>.up`` and ``<member>.down`` and the spine
        ``<member>.spine``, and a site ``junction<row>.<column>`` in the middle of each junction.

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import MorphingGridSpec, morphing_grid
        >>> part = morphing_grid(MorphingGridSpec(rows=1, columns=2))
        >>> [tca.name for tca in part.tcas], [spine.name for spine in part.spines]
        (['x0.0.up', 'x0.0.down'], ['x0.0.spine'])
    """
    spec = spec or MorphingGridSpec()
    part, size = Part(new_spec("morphing_grid")), spec.member
    bodies = {spec.held: (part.spec.worldbody, np.zeros(3), np.eye(3))}
    _add_junction(part, spec, spec.held, *bodies[spec.held])
    for beam in spec.members:
        body, origin, axes = bodies[beam.start]
        way = np.array([beam.end[1] - beam.start[1], beam.end[0] - beam.start[0], 0.0])
        # The chain's z axis leads away from where the grid is held, its y axis up.
        frame = np.column_stack([np.cross([0.0, 0.0, 1.0], way), [0.0, 0.0, 1.0], way])
        base = _middle(spec, beam.start) + 0.5 * spec.junction * way
        chain = add_chain(
            body, size.body, nodes=size.nodes, name=beam.name, motions=size.motions,
            pos=(axes.T @ (base - origin)).tolist(),
            quat=matrix_quaternion(axes.T @ frame).tolist(),
            rgba=(0.0, 0.0, 0.0, 0.0), collide=False,
        )  # fmt: skip
        dress(chain, size, f"{beam.name}.", sides=tuple(SIDES.values()))
        if beam.closing:
            weld(part.spec, bodies[beam.end][0], chain.tip, name=f"{beam.name}.closed")
        else:
            end = base + (size.spine.length - chain.local(size.nodes)) * way
            bodies[beam.end] = (chain.tip, end, frame)
            _add_junction(part, spec, beam.end, *bodies[beam.end])
        _move(part, chain, spec, beam.name)
    return part


def _middle(spec: MorphingGridSpec, junction: Junction) -> Array:
    """Where the middle of a junction of the flat grid is [m]."""
    row, column = (spec.pitch * (a - b) for a, b in zip(junction, spec.held, strict=True))
    return np.array([column, row, 0.0])


def _add_junction(
    part: Part, spec: MorphingGridSpec, junction: Junction, body: mujoco.MjsBody, origin: Array,
    axes: Array,
) -> None:  # fmt: skip
    """A junction on the body that holds it, which stands at ``origin`` with ``axes``."""
    name, half = f"junction{junction[0]}.{junction[1]}", spec.junction / 2.0
    place = (axes.T @ (_middle(spec, junction) - origin)).tolist()
    thick = spec.member.spine.tca_offset
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=place, rgba=[0.3, 0.32, 0.36, 1.0],
        size=(np.abs(axes.T) @ [half, half, thick]).tolist(),
        **surface((0.3, 0.002, 1e-4), mass=spec.junction_mass),
    )  # fmt: skip
    body.add_site(name=name, pos=place, group=4)
    part.sites[name] = name


def _move(part: Part, chain: Chain, spec: MorphingGridSpec, name: str) -> None:
    """The TCAs and the spine of a member."""
    size = spec.member
    for side, sign in SIDES.items():
        route = UTurn.parallel(size.spine.tca_offset, size.half_width, sign * math.pi / 2.0)
        add_tca(part, chain, route, in_tube(size.tca), name=f"{name}.{side}")
    turn = 2.0 * size.spine.tca_offset * size.spine.length
    turn /= size.spine.smp.rubbery * size.spine.second_moment
    part.spines += (
        route_spine(
            size.spine, size.heater, [chain], name=f"{name}.spine",
            tca={f"{name}.{side}": turn for side in SIDES}, damping_time=size.damping_time,
        ),
    )  # fmt: skip

"""A soft beam as a chain of rigid pieces in MuJoCo.

The beam is cut into n cells of length h = L/n. Each cell bends, twists and stretches at one
*node* in its middle, so the rigid pieces between the nodes have lengths h/2, h, ..., h, h/2. A
node is up to four joints of one body, with EI/h, GJ/h and EA/h as stiffness. The order of the
joints is mirrored from node to node: finite rotations about several axes do not commute, and
neither do a rotation and a stretch, and the mirror cancels the first-order part of that error.

MuJoCo's own ``<composite type="cable">`` is not used: it cannot stretch, its stiffness cannot be
changed while the simulation runs, and MuJoCo 4 no longer has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, Literal, Protocol

import mujoco
import numpy as np

from tca_mj.checks import Array, door, row, shown, whole
from tca_mj.model.surface import surface
from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.rod.lie import quaternion_exp, quaternion_matrix

# What a joint of a chain lets its two pieces do.
Motion = Literal["stretch", "bend_x", "bend_y", "twist"]
MOTIONS: tuple[Motion, ...] = ("stretch", "bend_x", "bend_y", "twist")  # all of them

# Axis of each motion in the piece's frame, z along the beam.
_AXIS = {"stretch": (0, 0, 1), "bend_x": (1, 0, 0), "bend_y": (0, 1, 0), "twist": (0, 0, 1)}
HINGES = {"bend_x": 0, "bend_y": 1, "twist": 2}  # component of the curvature


# The time of a step grows with the third power: 128 nodes take two hundred times as long as 8.
MOST_NODES = 128
Nodes = Annotated[int, partial(whole, at_least=1, at_most=MOST_NODES)]


def _quaternion(name: str, value: Any) -> tuple[float, ...]:
    found = row(name, value, shape=(4,))
    if not any(found):
        raise ValueError(f"{name} must be a rotation, got {shown(value)}")
    return found


Place = Annotated[Sequence[float], partial(row, shape=(3,))]
Quaternion = Annotated[Sequence[float], _quaternion]
Colour = Annotated[Sequence[float], partial(row, shape=(4,), at_least=0.0, at_most=1.0)]
Friction = Annotated[Sequence[float], partial(row, shape=(3,), at_least=0.0)]


@dataclass(frozen=True, slots=True)
class Member:
    """What a built part remembers of a chain: which beam it stands for, and how it is cut.

    Attributes:
        name: Prefix of all names of the chain.
        beam: The beam.
        nodes: Number n of nodes.
        motions: Which motions each node has.
    """

    name: str
    beam: BeamSpec
    nodes: int
    motions: tuple[Motion, ...]

    @door
    def renamed(self, prefix: str) -> Member:
        """The same chain in a part whose names all got ``prefix`` in front."""
        return replace(self, name=prefix + self.name)

    @property
    def cell(self) -> float:
        """Length h of a cell [m]."""
        return self.beam.length / self.nodes

    @property
    def piece(self) -> float:
        """Length of a whole piece, see ``Chain`` [m]."""
        half_turn = 0.5 * self.cell * float(np.linalg.norm(self.beam.curvature[:2]))
        # Pieces of length h would put the nodes on a smaller circle than the beam's.
        return self.cell if half_turn == 0.0 else self.cell * float(np.tan(half_turn)) / half_turn

    def joints(self, node: int) -> dict[Motion, str]:
        """Names of the joints of a node by their motion, from base to tip."""
        whole("node", node, at_least=0, at_most=self.nodes - 1)
        order = self.motions if node % 2 == 0 else self.motions[::-1]
        return {motion: f"{self.name}.{motion}{node}" for motion in order}

    def body(self, piece: int) -> str:
        """Name of the body of a piece."""
        return f"{self.name}.piece{self._piece(piece)}"

    def skin(self, piece: int) -> str:
        """Name of the geom with its mass and surface."""
        return f"{self.name}.skin{self._piece(piece)}"

    def local(self, piece: int) -> float:
        """z of the piece's point in the piece's own frame [m]."""
        return 0.0 if self._piece(piece) == 0 else self.piece / 2.0

    def _piece(self, piece: int) -> int:
        return whole("piece", piece, at_least=0, at_most=self.nodes)


class Holder(Protocol):
    """What a chain is built into and remembered by; ``tca_mj.model.part.Part`` is one."""

    spec: mujoco.MjSpec
    chains: tuple[Member, ...]


@dataclass(frozen=True, slots=True)
class Chain:
    """A beam built into a MuJoCo specification.

    Attributes:
        name: Prefix of all names of the chain.
        beam: What was built.
        cell: Length h of a cell [m].
        piece: Length of a whole piece, h or, in a curved beam, the side of the polygon about the
            unloaded arc [m].
        motions: Which motions each node has.
        pieces: The n + 1 rigid pieces from base to tip.
        points: Positions along the beam, 0 to L, of the pieces' middles: the base, the cells'
            ends and the tip, shape (n + 1,) [m]. TCAs may be held at these points.
        joints: Names of the joints, one mapping from motion to name per node.
    """

    name: str
    beam: BeamSpec
    cell: float
    piece: float
    motions: tuple[Motion, ...]
    pieces: tuple[mujoco.MjsBody, ...]
    points: Array
    joints: tuple[dict[Motion, str], ...]

    @property
    def nodes(self) -> int:
        """Number n of nodes."""
        return len(self.joints)

    @property
    def member(self) -> Member:
        """What a part remembers of it."""
        return Member(self.name, self.beam, self.nodes, self.motions)

    @property
    def tip(self) -> mujoco.MjsBody:
        """The last piece; its frame sits at the last node, the tip is half a piece further."""
        return self.pieces[-1]

    def local(self, piece: int) -> float:
        """z of the piece's point in the piece's own frame [m]."""
        return self.member.local(piece)

    def extent(self, piece: int) -> float:
        """Length of a piece; the first and the last one are half as long as the others [m]."""
        whole("piece", piece, at_least=0, at_most=self.nodes)
        return self.piece * (0.5 if piece in (0, self.nodes) else 1.0)

    @door
    def mark_tip(self, name: str, beyond: float = 0.0) -> None:
        """Adds the site ``name`` on the axis, ``beyond`` the tip [m]."""
        z = self.local(self.nodes) + beyond
        self.tip.add_site(name=name, pos=[0.0, 0.0, z], group=4)


@door
def add_chain(
    parent: mujoco.MjsBody | Holder,
    spec: BeamSpec,
    *,
    nodes: Nodes,
    name: str,
    on: Chain | mujoco.MjsBody | None = None,
    motions: Sequence[Motion] = MOTIONS,
    pos: Place = (0.0, 0.0, 0.0),
    quat: Quaternion = (1.0, 0.0, 0.0, 0.0),
    rgba: Colour = (0.95, 0.91, 0.85, 0.35),
    friction: Friction = (1.0, 0.005, 0.0001),
    collide: bool = True,
) -> Chain:
    """Adds a beam to a part, its base at ``pos`` and its axis along the local z.

    Args:
        parent: The part, which remembers the chain; or a body of its specification that holds the
            base, and only the TCAs that are laid into the chain remember it.
        spec: The beam.
        nodes: Number of nodes, 1 to 128.
        name: Prefix of all names.
        on: What it stands on in the part: a chain, at whose tip ``pos`` and ``quat`` begin, or a
            body; None for the part's base.
        motions: Motions of each node; leave out those the part does not need.
        pos: Position of the base in the parent's frame [m].
        quat: Orientation of the base, wxyz.
        rgba: Colour.
        friction: Sliding, torsional and rolling friction of the surface.
        collide: Whether the pieces touch objects and ground. They never touch each other.

    Returns:
        The chain.

    Raises:
        ValueError: If there are no nodes or too few for the curvature, no motions, or an unknown
            motion; if the part has a chain of that name, or ``on`` is given without a part.

    Example:
        >>> from tca_mj import Part, add_chain, new_spec
        >>> from tca_mj.modules import silicone_cylinder
        >>> part = Part(new_spec("finger"))
        >>> beam = silicone_cylinder(45e-3, 4.5e-3, 9e-3)
        >>> chain = add_chain(part.spec.worldbody, beam, nodes=8, name="finger")
        >>> len(chain.joints)
        8
    """
    if not motions:
        raise ValueError(f"motions must be some of {MOTIONS}, got {motions}")
    kept: tuple[Motion, ...] = tuple(motion for motion in MOTIONS if motion in motions)
    member = Member(name, spec, nodes, kept)
    cell = member.cell
    half_turn = 0.5 * cell * float(np.linalg.norm(spec.curvature[:2]))
    if half_turn > 0.4 * np.pi:
        raise ValueError(f"nodes must be at least {int(np.ceil(nodes * half_turn / 0.4 / np.pi))}"
                         f" for the curvature {spec.curvature}, got {nodes}")  # fmt: skip
    body, place = _place(parent, member, on, pos)
    length = member.piece
    look = surface(friction, conaffinity=int(collide), rgba=list(rgba))
    mass = spec.mass / nodes
    stiffness = dict(zip(MOTIONS, (spec.stretching, *spec.bending, spec.torsion), strict=True))

    piece = body.add_body(name=member.body(0), pos=place, quat=list(quat))
    _add_skin(piece, member.skin(0), length / 2.0, spec.outline, mass=0.5 * mass, **look)
    pieces, joints = [piece], []
    for node in range(nodes):
        reach = length / 2.0 if node == 0 else length
        piece = piece.add_body(name=member.body(node + 1), pos=[0.0, 0.0, reach])
        names = member.joints(node)
        rest = hinge_angles(cell * np.array(spec.curvature), reverse=tuple(names) != kept)
        for motion, joint in names.items():
            spring = stiffness[motion] / cell
            _add_joint(piece, joint, motion, spring, spec.damping_time, rest)
        joints.append(names)
        share = 1.0 if node < nodes - 1 else 0.5
        skin = member.skin(node + 1)
        _add_skin(piece, skin, share * length, spec.outline, mass=share * mass, **look)
        pieces.append(piece)
    points = np.linspace(0.0, spec.length, nodes + 1)
    return Chain(name, spec, cell, length, kept, tuple(pieces), points, tuple(joints))


def _place(
    parent: mujoco.MjsBody | Holder, member: Member, on: Any, pos: Sequence[float]
) -> tuple[mujoco.MjsBody, list[float]]:
    """The body that holds a chain, and where in it; a part remembers the chain."""
    if isinstance(parent, mujoco.MjsBody):
        if on is not None:
            raise ValueError(f"on must be left out where parent is a body, got {on!r}")
        return parent, list(pos)
    known = [other.name for other in parent.chains]
    if member.name in known:
        raise ValueError(f"name must be new among the part's chains {known}, got {member.name!r}")
    parent.chains = (*parent.chains, member)
    if not isinstance(on, Chain):
        return (parent.spec.worldbody if on is None else on), list(pos)
    return on.tip, [pos[0], pos[1], pos[2] + on.local(on.nodes)]


def hinge_angles(turn: Array, *, reverse: bool) -> Array:
    """Angles of hinges about x, y, z, in this or the reverse order, that make a rotation [rad]."""
    r = quaternion_matrix(quaternion_exp(-turn if reverse else turn))
    angles = np.array([np.arctan2(-r[1, 2], r[2, 2]), np.arcsin(r[0, 2]),
                       np.arctan2(-r[0, 1], r[0, 0])])  # fmt: skip
    return -angles if reverse else angles


def _add_joint(
    body: mujoco.MjsBody, name: str, motion: Motion, stiffness: float, time: float, rest: Array
) -> None:
    hinge = motion != "stretch"
    body.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_HINGE if hinge else mujoco.mjtJoint.mjJNT_SLIDE,
        axis=list(_AXIS[motion]), stiffness=[stiffness, 0.0, 0.0],
        damping=[time * stiffness, 0.0, 0.0], springref=rest[HINGES[motion]] if hinge else 0.0,
    )  # fmt: skip


def _add_skin(
    body: mujoco.MjsBody, name: str, length: float, outline: Outline, **look: Any
) -> None:
    """Mass, shape and surface of a piece."""
    half = length / 2.0
    shape, size = mujoco.mjtGeom.mjGEOM_CYLINDER, [outline.half_width, half, 0.0]
    if not outline.round:
        shape = mujoco.mjtGeom.mjGEOM_BOX
        size = [outline.half_width, outline.half_height, half]
    body.add_geom(name=name, type=shape, size=size, pos=[0.0, 0.0, half], **look)

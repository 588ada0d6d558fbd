"""A part whose shape-memory spines stay at one temperature: an elastic one, which theory knows.

At a constant temperature a spine is a linear spring (``tca_mj.smp.fixing``): hot it pulls to the
memorised shape, cold to the one that it is fixed in. MuJoCo's joints get the springs that a
simulation would give them; theory takes the section of the spine's specification, and not these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from tca_mj.certify.parts import Outside
from tca_mj.model.chain import HINGES, Member, hinge_angles
from tca_mj.model.part import Part
from tca_mj.model.spine import SHEAR_RATIO, RoutedSpine
from tca_mj.model.tendon import RoutedTca
from tca_mj.rod import BeamSpec, torsion_constant
from tca_mj.routes import leg_length

Curvature: TypeAlias = tuple[float, float, float]
_EVEN = 1e-9  # part of a stiffness by which that of other cells may differ


class Solid(NamedTuple):
    """An elastic part in place of one with spines.

    Attributes:
        part: The part, with springs in place of its spines.
        beams: What the chains with spines are to theory, by name.
    """

    part: Part
    beams: Mapping[str, BeamSpec]


def solid(
    part: Part, temperature: float, fixed: Mapping[str, Curvature] | None = None
) -> Solid:
    """The elastic part that a part with spines is at a temperature.

    Args:
        part: The part, which stays as it is.
        temperature: Temperature of all spines [°C].
        fixed: Curvatures (of the beam, in its own frame) in which chains were fixed, by name; a
            chain that is not named is in its memorised shape [1/m].

    Raises:
        Outside: If a spine stiffens a chain in part, or unevenly.
    """
    spec, bent = part.spec.copy(), fixed or {}
    motion = {
        name: (member.cell * np.array(bent[member.name]), node, which)
        for member in part.members.values() if member.name in bent
        for node in range(member.nodes) for which, name in member.joints(node).items()
    }  # fmt: skip
    for spine in part.spines:
        modulus = float(spine.spec.smp.modulus(temperature))
        for name, share in spine.joints:
            joint, added = spec.joint(name), modulus * share
            own, rest = float(joint.stiffness[0]), float(joint.springref)
            goal = rest if name not in motion else _angle(*motion[name])
            joint.springref = (own * rest + added * goal) / (own + added)
            joint.stiffness = [own + added, 0.0, 0.0]
            joint.damping = [float(joint.damping[0]) + spine.damping_time * added, 0.0, 0.0]
    beams: dict[str, BeamSpec] = {}
    for spine in part.spines:
        for member in _stiffened(part, spine):
            beam = beams.get(member.name, member.beam)
            beams[member.name] = _with(beam, spine, temperature, bent.get(member.name))
    tcas = tuple(_along(tca, bent) for tca in part.tcas)
    return Solid(Part(spec, tcas, dict(part.sites), (), part.chains), beams)


def _angle(turn: np.ndarray, node: int, motion: str) -> float:
    """Position of a joint in a cell that is turned, and not stretched."""
    if motion not in HINGES:
        return 0.0
    return float(hinge_angles(turn, reverse=node % 2 == 1)[HINGES[motion]])


def _stiffened(part: Part, spine: RoutedSpine) -> list[Member]:
    """The chains that a spine runs through."""
    shares, found = dict(spine.joints), []
    for member in part.members.values():
        cells = [member.joints(node) for node in range(member.nodes)]
        inside = [name in shares for cell in cells for name in cell.values()]
        if not any(inside):
            continue
        if not all(inside):
            raise Outside(part, f"has the spine {spine.name!r} in a part of {member.name!r}")
        for motion in member.motions:
            each = np.array([shares[cell[motion]] for cell in cells])
            if np.ptp(each) > _EVEN * each.max():
                what = f"has the spine {spine.name!r} stiffen {member.name!r} unevenly"
                raise Outside(part, what)
        found.append(member)
    return found


def _with(
    beam: BeamSpec, spine: RoutedSpine, temperature: float, curvature: Curvature | None
) -> BeamSpec:
    """A beam together with a spine of a section along it."""
    size = spine.spec
    modulus, area = float(size.smp.modulus(temperature)), size.width * size.thickness
    added = modulus * np.array([
        area * size.thickness**2 / 12.0, area * size.width**2 / 12.0,
        SHEAR_RATIO * torsion_constant(size.width, size.thickness),
    ])  # fmt: skip
    own = np.array([*beam.bending, beam.torsion])
    goal = np.array(beam.curvature if curvature is None else curvature)
    bend_x, bend_y, torsion = (own + added).tolist()
    x, y, z = ((own * beam.curvature + added * goal) / (own + added)).tolist()
    return replace(
        beam, bending=(bend_x, bend_y), torsion=torsion, curvature=(x, y, z),
        stretching=beam.stretching + modulus * area,
        shearing=beam.shearing + SHEAR_RATIO * modulus * area,
    )  # fmt: skip


def _along(tca: RoutedTca, bent: Mapping[str, Curvature]) -> RoutedTca:
    """A TCA in a part whose unloaded shape is another one than it was cut for."""
    if not any(run.chain.name in bent for run in tca.runs):
        return tca
    length = sum(
        leg_length(run.leg, run.chain.beam.length, bent.get(run.chain.name, (0.0, 0.0, 0.0)))
        for run in tca.runs
    )
    return replace(tca, path_length=length, stretch=length - tca.spec.rest_length)

"""A TCA laid into chains: sites along its route, a spatial tendon and its actuator.

A taut TCA between sites is a polyline, and where it crosses a node its length is not quite that
of the smooth curve it stands for. With one site in the middle of each piece, a straight TCA at
offset a crosses a node bent by θ with the length

    l = h cos(θ/2) - 2 a sin(θ/2)        instead of        h - a θ,

so a tension F adds the spurious stiffness -F h/4 to each bending joint: the chain bends too far
by F h²/(4 EI). ``RoutedTca.crossings`` says what is needed to give the difference back to the
joints; ``tca_mj.model.smooth`` does it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import mujoco
import numpy as np

from tca_mj.actuation import Muscle
from tca_mj.checks import Array, Checked, by_type, door, shown
from tca_mj.model.chain import Chain, Member, Motion
from tca_mj.routes import AnyRoute, Helix, leg_length
from tca_mj.tca import TcaSpec


@dataclass(frozen=True, slots=True)
class Pass(Checked):
    """One leg of a TCA through one chain.

    Attributes:
        chain: The chain.
        leg: The leg, described from base to tip.
        down: Whether the TCA follows it from tip to base.

    Raises:
        ValueError: If a field is something else.
    """

    chain: Chain
    leg: Helix
    down: bool = False


def _passes(name: str, value: Any) -> Any:
    if not isinstance(value, Sequence) or not all(isinstance(each, Pass) for each in value):
        raise ValueError(
            f"{name} must be those of route_passes(chain, route), got {shown(value)}"
        )
    return value


Passes = Annotated[Sequence[Pass], _passes]
AnyMuscle = Annotated[TcaSpec, by_type(TcaSpec | Muscle)]
"""A TCA, or a muscle of another kind, which type checkers take for one."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """One leg of a TCA in one cell of a chain.

    Attributes:
        joints: Names of the joints of the cell's node, from base to tip.
        cell: Length h of the cell [m].
        leg: The leg.
        span: Where the cell starts and ends along the leg, in [0, 1].
        polyline: Second derivatives of the tendon's length by the hinges' angles in the straight
            body [m/rad²]: per newton, the stiffness that the tension gives the hinges.
    """

    joints: dict[Motion, str]
    cell: float
    leg: Helix
    span: tuple[float, float]
    polyline: dict[Motion, float]


@dataclass(frozen=True, slots=True)
class Run:
    """What a routed TCA remembers of a pass.

    Attributes:
        chain: The chain.
        leg: The leg, described from base to tip.
        down: Whether the TCA follows it from tip to base.
        mass: Mass of the TCA along it [kg].
    """

    chain: Member
    leg: Helix
    down: bool
    mass: float


@dataclass(frozen=True, slots=True)
class RoutedTca:
    """A TCA in a built part.

    Attributes:
        name: Dotted name, also the name of its tendon and its actuator in MuJoCo.
        spec: The TCA.
        path_length: Length of the smooth route in the unloaded body [m]; there the TCA has its
            rest length plus ``stretch``.
        stretch: Pre-stretch in the unloaded body, negative for a TCA with slack [m].
        crossings: The cells that it crosses, one by one.
        runs: Its legs, one by one.
    """

    name: str
    spec: TcaSpec
    path_length: float
    stretch: float
    crossings: tuple[Crossing, ...]
    runs: tuple[Run, ...]

    @door
    def renamed(self, prefix: str) -> RoutedTca:
        """The same TCA in a part whose names all got ``prefix`` in front."""
        crossings = tuple(
            replace(item, joints={motion: prefix + name for motion, name in item.joints.items()})
            for item in self.crossings
        )
        runs = tuple(replace(run, chain=run.chain.renamed(prefix)) for run in self.runs)
        return replace(self, name=prefix + self.name, crossings=crossings, runs=runs)


@door
def route_passes(chains: Chain | Sequence[Chain], route: AnyRoute) -> tuple[Pass, ...]:
    """The passes of a route: up along the first leg, down the second, ...

    Args:
        chains: The chain; or several, each standing on the one before, to which the route is one
            body, so that a helix has its turns over all of them.
        route: The route.

    Raises:
        ValueError: If it is no route.
    """
    if isinstance(chains, Chain):
        return tuple(Pass(chains, leg, down=bool(i % 2)) for i, leg in enumerate(route.legs))
    ends = np.cumsum([0.0, *(chain.beam.length for chain in chains)])
    ends /= ends[-1] or 1.0
    spans = list(zip(chains, ends, ends[1:], strict=False))
    return tuple(
        Pass(chain, leg.between(float(start), float(end)), down=bool(i % 2))
        for i, leg in enumerate(route.legs)
        for chain, start, end in (spans[::-1] if i % 2 else spans)
    )


@door
def route_tca(
    spec: mujoco.MjSpec,
    tca: AnyMuscle,
    passes: Passes,
    *,
    name: str,
    stretch: float = 0.0,
    ideal: bool = False,
) -> RoutedTca:
    """Lays a TCA along passes through chains and gives it a tendon and an actuator.

    The actuator's force is affine in the tendon's length, so that MuJoCo itself evaluates the
    TCA's linearised law in every physics step; it can pull but never push.

    Args:
        spec: Specification the chains were built in.
        tca: The TCA; its rest length must be that of the route, see ``of_length``.
        passes: Where it runs.
        name: Its name.
        stretch: Pre-stretch [m].
        ideal: Whether it is without mass and may leave the body's outline.

    Returns:
        The routed TCA.

    Raises:
        ValueError: If the route leaves the body, is a helix with less than three sites per turn,
            or its length is not the TCA's.
    """
    length = path_length(passes)
    if abs(tca.rest_length + stretch - length) > 1e-6 * length:
        raise ValueError(
            f"rest_length + stretch of {name} must be its route's length {length:.6f} m,"
            f" got {tca.rest_length + stretch:.6f} m"
        )
    width = tca.outer_radius
    tendon = spec.add_tendon(name=name, width=width, rgba=[0.1, 0.2, 0.6, 1.0])
    crossings: list[Crossing] = []
    whole = math.fsum(item.chain.beam.length for item in passes)
    weight = 0.0 if ideal else tca.mass
    runs = tuple(
        Run(item.chain.member, item.leg, item.down, weight * (item.chain.beam.length / whole))
        for item in passes
    )
    for index, (item, run) in enumerate(zip(passes, runs, strict=True)):
        if not ideal:
            _check_inside(item, name)
            _add_mass(item, run.mass)
        offsets = _site_offsets(item)
        for number in range(len(offsets))[:: -1 if item.down else 1]:
            site = f"{name}.leg{index}.site{number}"
            pos = [*offsets[number], item.chain.local(number)]
            item.chain.pieces[number].add_site(name=site, pos=pos, size=[width] * 3, group=4)
            tendon.wrap_site(site)
        crossings += _crossings(item, offsets)
    spec.add_actuator(
        name=name, trntype=mujoco.mjtTrn.mjTRN_TENDON, target=name,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED, gainprm=np.zeros(10),
        biastype=mujoco.mjtBias.mjBIAS_AFFINE, biasprm=np.zeros(10),
        # Slack at zero; no real TCA comes near the other bound.
        forcelimited=1, forcerange=[-1e3, 0.0],
    )  # fmt: skip
    return RoutedTca(name, tca, length, stretch, tuple(crossings), runs)


@door
def lay_tca(
    spec: mujoco.MjSpec, tca: AnyMuscle, passes: Passes, *, name: str,
    ideal: bool = False,
) -> RoutedTca:  # fmt: skip
    """``route_tca`` of a TCA cut to the length of its passes, which raises the errors.

    Args:
        spec: Specification the chains were built in.
        tca: The kind of TCA.
        passes: Where it runs.
        name: Its name.
        ideal: Whether it is without mass and may leave the body's outline.
    """
    return route_tca(spec, tca.of_length(path_length(passes)), passes, name=name, ideal=ideal)


@door
def path_length(passes: Passes) -> float:
    """Length of a route in the unloaded bodies [m].

    Args:
        passes: Where it runs.

    Raises:
        ValueError: If it has no leg, or is no passes.
    """
    if not passes:
        raise ValueError("passes must name at least one leg, got none")
    return sum(leg_length(p.leg, p.chain.beam.length, p.chain.beam.curvature) for p in passes)


def _add_mass(item: Pass, mass: float) -> None:
    """Spreads the mass of a leg over the pieces, which carry half a cell more or less each."""
    for number, piece in enumerate(item.chain.pieces):
        cells = 0.5 if number in (0, item.chain.nodes) else 1.0
        piece.first_geom().mass += mass * cells / item.chain.nodes


def _check_inside(item: Pass, name: str) -> None:
    outline = item.chain.beam.outline
    for s in np.linspace(0.0, 1.0, 65):
        x, y = item.leg.offset(s)
        if not outline.contains(x, y):
            raise ValueError(
                f"route of {name} must stay inside the body's outline of half size"
                f" ({outline.half_width}, {outline.half_height}) m, got ({x:.5f}, {y:.5f}) m"
            )


def _site_offsets(item: Pass) -> Array:
    """Offsets of the sites, one in each piece's frame, shape (pieces, 2) [m].

    The chords of a helix run closer to the axis than the helix. The radius is enlarged so that
    the lever arm about the axis, |r x t|, is that of the helix: R² sin(φ)/chord = a² φ/arc, φ the
    angle between two sites. Beyond a quarter of a turn between them it grows no more.
    """
    s = item.chain.points / item.chain.beam.length
    offsets = item.leg.offset(s)
    angle = 2.0 * np.pi * abs(item.leg.turns) * float(np.max(np.diff(s)))
    if angle == 0.0 or item.leg.radius == 0.0:
        return offsets
    if angle > 2.0 / 3.0 * np.pi + 1e-9:
        raise ValueError(
            f"nodes of {item.chain.name} must give a helix at least three sites per turn,"
            f" got {2.0 * np.pi / angle:.2f}"
        )
    rise = item.chain.beam.length * float(np.max(np.diff(s)))
    share = min(1.0, 0.5 * np.pi / angle)
    angle, rise = share * angle, share * rise
    lever = item.leg.radius**2 * angle / np.hypot(rise, item.leg.radius * angle)
    # R² sin φ = lever sqrt(rise² + 4 R² sin²(φ/2)): a quadratic in R².
    a, b, c = np.sin(angle) ** 2, -4.0 * (lever * np.sin(angle / 2.0)) ** 2, -((lever * rise) ** 2)
    radius = np.sqrt((-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))
    return offsets * (radius / item.leg.radius)


_HINGES: tuple[Motion, ...] = ("bend_x", "bend_y", "twist")  # about x, y, z


def _crossings(item: Pass, offsets: Array) -> list[Crossing]:
    """The cells that a leg crosses, from base to tip."""
    chain, points = item.chain, item.chain.points
    scale = chain.piece / chain.cell
    result = []
    for node, joints in enumerate(chain.joints):
        height = (node + 0.5) * chain.cell
        below = np.array([*offsets[node], scale * (points[node] - height)])
        above = np.array([*offsets[node + 1], scale * (points[node + 1] - height)])
        curving = {
            motion: _second_derivative(below, above, axis)
            for axis, motion in enumerate(_HINGES)
            if motion in joints
        }
        span = (node / chain.nodes, (node + 1) / chain.nodes)
        result.append(Crossing(joints, chain.cell, item.leg, span, curving))
    return result


def _second_derivative(below: Array, above: Array, axis: int) -> float:
    """d²|R(θ) above - below|/dθ² at θ = 0, R a rotation about ``axis`` at the origin."""
    across = [i for i in range(3) if i != axis]
    length = float(np.linalg.norm(above - below))
    first = -float(below @ np.cross(np.eye(3)[axis], above)) / length
    return (float(below[across] @ above[across]) - first**2) / length

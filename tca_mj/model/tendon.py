"""A TCA laid into chains: sites along its route, a spatial tendon and its actuator.

A taut TCA between sites is a polyline, and where it crosses a node its length is not quite that
of the smooth curve it stands for. With one site in the middle of each piece, a straight TCA at
offset a crosses a node bent by θ with the length

    l = h cos(θ/2) - 2 a sin(θ/2)        instead of        h - a θ,

so a tension F adds the spurious stiffness -F h/4 to each bending joint: the chain bends too far
by F h²/(4 EI). ``RoutedTca.crossings`` says what is needed to give the difference back to the
joints; ``tca_mj.model.smooth`` does it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.model.chain import Chain, Motion
from tca_mj.routes import Helix, Route, leg_length
from tca_mj.tca import TcaSpec


@dataclass(frozen=True, slots=True)
class Pass:
    """One leg of a TCA through one chain.

    Attributes:
        chain: The chain.
        leg: The leg, described from base to tip.
        down: Whether the TCA follows it from tip to base.
    """

    chain: Chain
    leg: Helix
    down: bool = False


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
class RoutedTca:
    """A TCA in a built part.

    Attributes:
        name: Dotted name, also the name of its tendon and its actuator in MuJoCo.
        spec: The TCA.
        path_length: Length of the smooth route in the unloaded body [m]; there the TCA has its
            rest length plus ``stretch``.
        stretch: Pre-stretch in the unloaded body, negative for a TCA with slack [m].
        crossings: The cells that it crosses, one by one.
    """

    name: str
    spec: TcaSpec
    path_length: float
    stretch: float
    crossings: tuple[Crossing, ...]

    def renamed(self, prefix: str) -> "RoutedTca":
        """The same TCA in a part whose names all got ``prefix`` in front."""
        crossings = tuple(
            replace(item, joints={motion: prefix + name for motion, name in item.joints.items()})
            for item in self.crossings
        )
        return replace(self, name=prefix + self.name, crossings=crossings)


def route_passes(chain: Chain, route: Route) -> tuple[Pass, ...]:
    """The passes of a route through one chain: up along the first leg, down the second, ..."""
    return tuple(Pass(chain, leg, down=bool(i % 2)) for i, leg in enumerate(route.legs))


def route_tca(
    spec: mujoco.MjSpec,
    tca: TcaSpec,
    passes: Sequence[Pass],
    *,
    name: str,
    sites: int | None = None,
    stretch: float = 0.0,
    inside: bool = True,
) -> RoutedTca:
    """Lays a TCA along passes through chains and gives it a tendon and an actuator.

    The actuator's force is affine in the tendon's length, so that MuJoCo itself evaluates the
    TCA's linearised law in every physics step; it can pull but never push.

    Args:
        spec: Specification the chains were built in.
        tca: The TCA; its rest length must be that of the route, see ``of_length``.
        passes: Where it runs.
        name: Its name.
        sites: Points on each chain that hold the TCA, base and tip included; by default all.
        stretch: Pre-stretch [m].
        inside: Whether the route must stay inside the body's outline.

    Returns:
        The routed TCA.

    Raises:
        ValueError: If the route leaves the body, is a helix with less than three sites per turn,
            has more sites than the chain has pieces, or
            its length is not the TCA's.
    """
    if not passes:
        raise ValueError("passes must name at least one leg, got none")
    length = sum(leg_length(p.leg, p.chain.beam.length, p.chain.beam.curvature) for p in passes)
    if abs(tca.rest_length + stretch - length) > 1e-6 * length:
        raise ValueError(
            f"rest_length + stretch of {name} must be its route's length {length:.6f} m,"
            f" got {tca.rest_length + stretch:.6f} m"
        )
    width = tca.coil_radius + tca.fibre.radius  # as thick as the coil
    tendon = spec.add_tendon(name=name, width=width, rgba=[0.1, 0.2, 0.6, 1.0])
    crossings: list[Crossing] = []
    for index, item in enumerate(passes):
        if inside:
            _check_inside(item, name)
        _add_mass(item, tca.mass / len(passes))
        held = _held_points(item.chain, sites, name)
        offsets = _site_offsets(item, held)
        for number in range(len(held)) if not item.down else reversed(range(len(held))):
            site = f"{name}.leg{index}.site{number}"
            piece = int(held[number])
            item.chain.pieces[piece].add_site(
                name=site,
                pos=[*offsets[number], item.chain.local(piece)],
                size=[width, width, width],
                group=4,
            )
            tendon.wrap_site(site)
        crossings += _crossings(item, held, offsets)
    actuator = spec.add_actuator(name=name)
    actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON
    actuator.target = name
    actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    actuator.gainprm = np.zeros(10)
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.biasprm = np.zeros(10)
    actuator.forcelimited = 1
    actuator.forcerange = [-1e3, 0.0]  # slack at zero; no real TCA comes near the other bound
    return RoutedTca(
        name=name,
        spec=tca,
        path_length=length,
        stretch=stretch,
        crossings=tuple(crossings),
    )


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
                f"route of {name} must stay inside the body: offset ({x:.5f}, {y:.5f}) m is"
                f" outside its outline of half size ({outline.half_width}, {outline.half_height}) m"
            )


def _held_points(chain: Chain, sites: int | None, name: str) -> NDArray[np.int64]:
    """Indices of the pieces that hold the TCA."""
    pieces = len(chain.pieces)
    count = pieces if sites is None else sites
    if not 2 <= count <= pieces:
        raise ValueError(
            f"sites of {name} must be between 2 and the {pieces} pieces of {chain.name},"
            f" got {count}"
        )
    return np.unique(np.round(np.linspace(0, pieces - 1, count)).astype(np.int64))


def _site_offsets(item: Pass, held: NDArray[np.int64]) -> NDArray[np.float64]:
    """Offsets of the sites in their pieces' frames, shape (k, 2) [m].

    The chords of a helix run closer to the axis than the helix. The radius is enlarged so that
    the lever arm about the axis, |r x t|, is that of the helix: R² sin(φ)/chord = a² φ/arc, φ the
    angle between two sites. Beyond a quarter of a turn between them it grows no more.
    """
    s = item.chain.points[held] / item.chain.beam.length
    offsets = item.leg.offset(s)
    angle = 2.0 * np.pi * abs(item.leg.turns) * float(np.max(np.diff(s)))
    if angle == 0.0 or item.leg.radius == 0.0:
        return offsets
    if angle > 2.0 / 3.0 * np.pi + 1e-9:
        raise ValueError(
            f"a helix needs at least three sites per turn, got {2.0 * np.pi / angle:.2f}:"
            f" give {item.chain.name} more nodes or the route fewer turns"
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


def _crossings(item: Pass, held: NDArray[np.int64], offsets: NDArray[np.float64]) -> list[Crossing]:
    """The cells that a leg crosses, from base to tip."""
    chain, points = item.chain, item.chain.points
    scale = chain.piece / chain.cell
    result = []
    for k in range(len(held) - 1):
        for node in range(int(held[k]), int(held[k + 1])):  # between two neighbouring sites
            height = (node + 0.5) * chain.cell
            below = np.array([*offsets[k], scale * (points[held[k]] - height)])
            above = np.array([*offsets[k + 1], scale * (points[held[k + 1]] - height)])
            curving = {
                motion: _second_derivative(below, above, axis)
                for axis, motion in enumerate(_HINGES)
                if motion in chain.joints[node]
            }
            span = (node / chain.nodes, (node + 1) / chain.nodes)
            result.append(Crossing(chain.joints[node], chain.cell, item.leg, span, curving))
    return result


def _second_derivative(below: NDArray[np.float64], above: NDArray[np.float64], axis: int) -> float:
    """d²|R(θ) above - below|/dθ² at θ = 0, R a rotation about ``axis`` at the origin."""
    across = [i for i in range(3) if i != axis]
    length = float(np.linalg.norm(above - below))
    first = -float(below @ np.cross(np.eye(3)[axis], above)) / length
    return (float(below[across] @ above[across]) - first**2) / length

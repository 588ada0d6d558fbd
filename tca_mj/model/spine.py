"""A shape-memory spine in a chain: whose joints it stiffens, and how much."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

from tca_mj.checks import Checked, Positive, door, require_positive, whole
from tca_mj.model.chain import Chain, Motion
from tca_mj.rod.beam import BeamSpec, torsion_constant
from tca_mj.smp import HeaterSpec, SpineSpec, soft_bending_rate

# Shear modulus over Young's modulus, at any temperature: Poisson's ratio 0.35 when glassy, 0.5 when
# rubbery; between the two. An estimate.
SHEAR_RATIO = 1.0 / 2.8


@dataclass(frozen=True, slots=True)
class RoutedSpine(Checked):
    """A spine in a built part.

    Attributes:
        name: Dotted name.
        spec: The spine.
        heater: Its heater wire.
        joints: Names of the joints that it stiffens, and the stiffness of each per modulus
            [m³/rad], or [m] for a slide.
        tcas: Names of the TCAs that deform it, and the angle by which each turns the soft spine
            per tension [rad/N].
        damping_time: Kelvin-Voigt time: damping over stiffness of these joints [s].

    Raises:
        ValueError: If a stiffness, an angle or the damping time is not positive, or a joint or a
            TCA comes twice or not at all.
    """

    name: str
    spec: SpineSpec
    heater: HeaterSpec
    joints: tuple[tuple[str, float], ...]
    tcas: tuple[tuple[str, float], ...]
    damping_time: Positive = 5e-3

    @door
    def renamed(self, prefix: str) -> RoutedSpine:
        """The same with a prefix before all names."""
        joints = tuple((prefix + joint, share) for joint, share in self.joints)
        tcas = tuple((prefix + tca, turn) for tca, turn in self.tcas)
        return replace(self, name=prefix + self.name, tcas=tcas, joints=joints)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        for field, pairs in (("joints", self.joints), ("tcas", self.tcas)):
            require_positive(**dict(pairs))
            if not 0 < len(pairs) == len({name for name, _ in pairs}):
                raise ValueError(f"{field} of {self.name} must differ, at least 1, got {pairs}")


@door
def route_spine(
    spec: SpineSpec,
    heater: HeaterSpec,
    chains: Sequence[Chain],
    *,
    name: str,
    tca: str | Mapping[str, float],
    torsion: float | Sequence[float] | None = None,
    damping_time: Positive = 5e-3,
) -> RoutedSpine:
    """Lets a spine stiffen the joints of the chains it runs through.

    The chain's own joints are built soft: their stiffness is what the spine does not account for.
    Bending about the chain's x axis is the spine's soft direction.

    Args:
        spec: The spine.
        heater: Its heater wire.
        chains: The chains, one behind the other.
        name: Its name.
        tca: Name of the TCA that bends it as ``spec`` says; or the names of several, and the angle
            by which each turns the soft spine per tension [rad/N].
        torsion: Torsional stiffness over the modulus E [m⁴], of all nodes or of each of the chains'
            nodes in their order; by default that of its section.
        damping_time: Kelvin-Voigt time [s]. Estimate.

    Raises:
        ValueError: If a number is not positive, or ``torsion`` has not one for each node.
    """
    nodes = [(chain.cell, joints) for chain in chains for joints in chain.joints]
    if torsion is None:
        torsion = SHEAR_RATIO * torsion_constant(spec.width, spec.thickness)
    each = list(torsion) if isinstance(torsion, Sequence) else [torsion] * len(nodes)
    if len(each) != len(nodes):
        raise ValueError(f"torsion must be one number or {len(nodes)}, got {len(each)}")
    require_positive(**{f"torsion[{i}]": value for i, value in enumerate(each)})
    section: dict[Motion, float] = {
        "bend_x": spec.second_moment,
        "bend_y": spec.thickness * spec.width**3 / 12.0,
        "stretch": spec.width * spec.thickness,
    }
    joints = [
        (joint, (twist if motion == "twist" else section[motion]) / cell)
        for (cell, node), twist in zip(nodes, each, strict=True)
        for motion, joint in node.items()
    ]
    tcas = {tca: float(soft_bending_rate(spec, 1.0))} if isinstance(tca, str) else tca
    return RoutedSpine(name, spec, heater, tuple(joints), tuple(tcas.items()), damping_time)


@door
def sheath(spec: SpineSpec, share: float, **more: Any) -> BeamSpec:
    """What a chain has besides its shape-memory spines: tube, wires, what is seen and weighs.

    Args:
        spec: A spine.
        share: Stiffness of what is round the spines against bending and twist, over that of one
            soft spine [1].
        **more: The other fields of the beam.
    """
    soft = share * spec.smp.rubbery * spec.second_moment
    along = soft / spec.thickness**2
    return BeamSpec(bending=(soft, soft), torsion=soft, stretching=along, shearing=along, **more)


@door
def lumped_torsion(
    spec: SpineSpec, places: Sequence[float],
    nodes: Annotated[int, partial(whole, at_least=1, at_most=1000)],
) -> tuple[float, ...]:  # fmt: skip
    """Torsional stiffness over E of one of several parallel spines between two rigid rails [m⁴].

    Rails that pitch against each other by φ do two things. They twist each spine evenly, against
    J G/E. And they bend the one at the distance d from the axis out of line by d φ, its ends
    clamped, against 12 I d²/L²: it lies along d φ (3 s² - 2 s³), so that this part of the twist is
    6 s (1 - s) of its mean. A chain that stands for all of them twists by both in proportion to
    what they bear. For straight spines the sum is exact. Bent into an arc the chain follows three
    spines within 3 % in pitch up to 205°, because the twist is where it is in them.

    Args:
        spec: The spine.
        places: Distances d of the spines from the axis; the result is their mean [m].
        nodes: Number of equal cells from rail to rail, 1 to 1000.

    Returns:
        One number per cell.

    Raises:
        ValueError: If there is no place, or ``nodes`` is out of range.
    """
    if not places:
        raise ValueError("places must have at least 1, got none")
    spread = math.fsum(d * d for d in places) / len(places)
    even = SHEAR_RATIO * torsion_constant(spec.width, spec.thickness)
    uneven = 12.0 * spec.second_moment * spread / spec.length**2
    middles = [(i + 0.5) / nodes for i in range(nodes)]
    twist = [even + uneven * 6.0 * s * (1.0 - s) for s in middles]
    mean = math.fsum(twist) / nodes
    return tuple((even + uneven) * mean / each for each in twist)

"""A shape-memory spine in a chain: whose joints it stiffens, and how much."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from tca_mj.model.chain import Chain, Motion
from tca_mj.rod.beam import require_positive, torsion_constant
from tca_mj.smp import HeaterSpec, SpineSpec

# Shear modulus over Young's modulus, at any temperature: Poisson's ratio 0.35 when glassy, 0.5 when
# rubbery; between the two. An estimate.
SHEAR_RATIO = 1.0 / 2.8


@dataclass(frozen=True, slots=True)
class RoutedSpine:
    """A spine in a built part.

    Attributes:
        name: Dotted name.
        spec: The spine.
        heater: Its heater wire.
        joints: Names of the joints that it stiffens, and the stiffness of each per modulus
            [m³/rad], or [m] for a slide.
        tca: Name of the TCA that bends it.
        damping_time: Kelvin-Voigt time: damping over stiffness of these joints [s].

    Raises:
        ValueError: If a stiffness or the damping time is not positive, or a joint comes twice.
    """

    name: str
    spec: SpineSpec
    heater: HeaterSpec
    joints: tuple[tuple[str, float], ...]
    tca: str
    damping_time: float = field(default=5e-3)

    def renamed(self, prefix: str) -> "RoutedSpine":
        """The same with a prefix before all names."""
        joints = tuple((prefix + joint, share) for joint, share in self.joints)
        return replace(self, name=prefix + self.name, tca=prefix + self.tca, joints=joints)

    def __post_init__(self) -> None:
        require_positive(damping_time=self.damping_time, **dict(self.joints))
        if len({name for name, _ in self.joints}) < len(self.joints):
            raise ValueError(f"joints of {self.name} must differ, got {self.joints}")


def route_spine(
    spec: SpineSpec,
    heater: HeaterSpec,
    chains: Sequence[Chain],
    *,
    name: str,
    tca: str,
    torsion: float | None = None,
    damping_time: float = 5e-3,
) -> RoutedSpine:
    """Lets a spine stiffen the joints of the chains it runs through.

    The chain's own joints are built soft: their stiffness is what the spine does not account for.
    Bending about the chain's x axis is the spine's soft direction.

    Args:
        spec: The spine.
        heater: Its heater wire.
        chains: The chains, one behind the other.
        name: Its name.
        tca: Name of the TCA that bends it.
        torsion: Torsional stiffness over the modulus E [m⁴]; by default that of its section.
        damping_time: Kelvin-Voigt time [s]. Estimate.

    Raises:
        ValueError: If a number is not positive.
    """
    if torsion is None:
        torsion = SHEAR_RATIO * torsion_constant(spec.width, spec.thickness)
    require_positive(torsion=torsion)
    section: dict[Motion, float] = {
        "bend_x": spec.second_moment,
        "bend_y": spec.thickness * spec.width**3 / 12.0,
        "twist": torsion,
        "stretch": spec.width * spec.thickness,
    }
    joints = [
        (joint, section[motion] / chain.cell)
        for chain in chains
        for node in chain.joints
        for motion, joint in node.items()
    ]
    return RoutedSpine(name, spec, heater, tuple(joints), tca, damping_time)


def lumped_torsion(spec: SpineSpec, places: Sequence[float]) -> float:
    """Torsional stiffness over E of one of several parallel spines between two rigid rails [m⁴].

    Rails that pitch against each other by φ twist each spine, J G/E, and bend the one at the distance
    d from the axis out of line by d φ, its ends clamped: 12 E I d²/L³ φ, seen as a torsion of
    12 I d²/L². Exact for straight spines and small angles.

    Args:
        spec: The spine.
        places: Distances d of the spines from the axis; the result is their mean [m].
    """
    spread = math.fsum(d * d for d in places) / len(places)
    straight = SHEAR_RATIO * torsion_constant(spec.width, spec.thickness)
    return straight + 12.0 * spec.second_moment * spread / spec.length**2

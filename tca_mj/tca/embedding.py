"""TCAs that lie in silicone: the body that takes up their heat.

How a TCA lies in its channel decides how well it is cooled, and the printed powers need more than
one way: 44 W per metre bend a straight module by 120° where 250 W/m turn the wrist by no more than
180°, and a gripper of 100 W/m closes within half a second.

* *Loosely* in a straight channel (bending module, finger, tube along a spine): the TCA is sewn
  through, or shrinks in its tube, and hangs in air. The conductance of that gap,
  ``CHANNEL_CONTACT``, is fitted; it is the only fitted number here.
* *Pressed to one side* of a bent channel (ring-shaped gripper): a TCA that pulls lies on the wall
  with its tension over the radius of curvature. It touches half round: an estimate.
* *All round* in a tube that is wound with it (wrist): nothing is in between. An estimate, too.

Where a TCA touches, silicone conducts its heat away. Silicone has one temperature here. What it
takes to warm it, from the TCA's surface to its mean, is the resistance of a ring whose outer
surface lets nothing out: exact once the ring warms evenly, and for the first seconds off by some
per cent (``tests/test_embedding.py`` compares with the diffusion of heat in the ring).
"""

from __future__ import annotations

import math
from dataclasses import replace

from tca_mj.checks import door, number, require_positive
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.thermal import BodyHeat

SILICONE_DENSITY = 1070.0  # Ecoflex 00-30, data sheet of Smooth-On [kg/m³]
# Heat per mass: estimate, handbooks have 1.1 to 1.5 kJ/(kg K) for silicone rubber [J/(kg K)].
SILICONE_SPECIFIC_HEAT = 1300.0
# Conductivity: estimate, the middle of 0.2 to 0.3 W/(m K) of handbooks [W/(m K)].
SILICONE_CONDUCTIVITY = 0.25
# From a body of 9 mm to still air: estimate, 9 W/(m² K) of natural convection (Churchill & Chu) and
# 6 of radiation at 45 °C [W/(m² K)].
BODY_TO_AIR = 15.0
# From a TCA to the wall of a channel in which it lies loosely, per length of TCA. Fitted to one
# fact: 2 W and 0.4 W for 2 s bend the 3D bending module by about 120° (Sun, Section 4.1.3), by
# eq. (4.1), standing. It is a ring of air between a coil of 1.2 mm and a channel of about 2 mm.
CHANNEL_CONTACT = 0.415


@door
def silicone_body(
    tca: TcaSpec, *, section: float, perimeter: float, touching: float = 0.0
) -> BodyHeat:
    """The silicone round each strand of a TCA.

    Args:
        tca: The TCA, for its outer radius.
        section: Cross-section of the silicone that belongs to the strand [m²].
        perimeter: Length of its outline that air touches [m].
        touching: Share of the TCA's circumference that lies on the wall, 0 to 1; the rest is
            ``CHANNEL_CONTACT`` away from it.

    Raises:
        ValueError: If a length is not positive or the share not between 0 and 1.
    """
    require_positive(section=section, perimeter=perimeter)
    number("touching", touching, at_least=0.0, at_most=1.0)
    inner = tca.outer_radius
    through = ring_conductance(inner, math.sqrt(inner**2 + section / math.pi))
    loosely = 1.0 / (1.0 / CHANNEL_CONTACT + 1.0 / through)
    return BodyHeat(
        conductance=touching * through + (1.0 - touching) * loosely,
        capacity=SILICONE_DENSITY * SILICONE_SPECIFIC_HEAT * section,
        loss=BODY_TO_AIR * perimeter,
    )


@door
def in_silicone(
    tca: TcaSpec, *, section: float, perimeter: float, touching: float = 0.0
) -> TcaSpec:
    """A TCA with the silicone round it; errors as ``silicone_body``.

    Args:
        tca: The TCA.
        section: Cross-section of the silicone that belongs to each of its strands [m²].
        perimeter: Length of its outline that air touches [m].
        touching: Share of the TCA's circumference that lies on the wall, 0 to 1 [1].
    """
    body = silicone_body(tca, section=section, perimeter=perimeter, touching=touching)
    return replace(tca, body=body)


@door
def ring_conductance(inner: float, outer: float) -> float:
    """From the inner surface of a ring of silicone to its mean temperature, per length [W/(m K)].

    For a ring that warms evenly, heated inside and insulated outside; from Carslaw & Jaeger,
    Conduction of Heat in Solids, Section 7.9, with a constant flux:
    2 π k/(b⁴ ln(b/a)/(b² - a²)² - (3 b² - a²)/(4 (b² - a²))).

    Args:
        inner: Inner radius a [m].
        outer: Outer radius b [m].

    Raises:
        ValueError: If they are not 0 < inner < outer.
    """
    require_positive(inner=inner)
    number("outer", outer, above=inner)
    a, b = inner * inner, outer * outer
    gap = b - a
    shape = b * b * math.log(outer / inner) / gap**2 - (3.0 * b - a) / (4.0 * gap)
    return 2.0 * math.pi * SILICONE_CONDUCTIVITY / shape

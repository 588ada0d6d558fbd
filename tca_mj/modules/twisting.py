"""The twisting module: a silicone cylinder wrapped by one TCA (Sun, Section 4.1.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tca_mj.checks import Checked, door, number
from tca_mj.hints import Length, Section
from tca_mj.model.chain import Nodes
from tca_mj.model.part import Part
from tca_mj.modules.bending import silicone_cylinder, straight_module
from tca_mj.rod.beam import BeamSpec
from tca_mj.routes import Helix, Route, UTurn
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.embedding import in_silicone


@dataclass(frozen=True, kw_only=True, slots=True)
class TwistingSpec(Checked):
    """A cylinder with a TCA wound round it as a single or a double helix.

    Attributes:
        length: Length of the module [m]. Sun, Section 5.3.2.
        diameter: Diameter of the section that carries load [m]. Estimate: the circle on which
            the TCA lies, so that the inner half of the wound tube carries load and the outer half
            does not. With the printed 4.5 mm the double helix would turn less than the single one,
            against the measurement; that takes more than 4.7 mm, and 5.1 mm in a chain, which
            does not shear.
        outer_diameter: Diameter of the body with the wrapped tube [m]. Sun, Section 4.1.4:
            the arm is 10 mm wide.
        radius: Distance of the TCA from the centre line [m]. Sun, Section 5.3.2.
        turns: Turns of TCA on the module, over both halves if it is folded [-]; Sun,
            Section 5.3.2. Positive is right-handed: then a pull turns the tip clockwise, seen
            from the tip.
        double: Whether the TCA is folded in half first.
        nodes: Nodes of the chain, at least three per turn of each leg. With 8 the double helix is
            exact by a tenth of a per cent at any tension.
        tca: The kind of TCA, cut to the route's length.
        tube: Outer diameter of the elastomer tube round the TCA [m]. Five rounds "as close as
            possible" on 16 mm (Sun, Sections 4.1.2 and 5.3.2) are 3.2 mm.

    Raises:
        ValueError: If a dimension is not finite and positive, or a number of nodes not whole.

    Example:
        >>> from tca_mj import TwistingSpec, twisting_module
        >>> module = twisting_module(TwistingSpec(turns=4.0))
        >>> round(1e3 * module.tcas[0].path_length)  # [mm]
        94
    """

    length: Length = 16e-3
    diameter: Section = 7e-3
    outer_diameter: Section = 10e-3
    radius: Section = 3.5e-3
    turns: float = 5.0
    double: bool = True
    nodes: Nodes = 8
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])
    tube: Section = 3.2e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("tube", self.tube, above=2.0 * self.tca.outer_radius, unit="m, the TCA's width")

    @property
    def embedded(self) -> TcaSpec:
        """The TCA in its wound tube, tightly; half of the tube's outside meets air."""
        section = math.pi * (self.tube**2 / 4.0 - self.tca.outer_radius**2)
        perimeter = math.pi * self.tube / 2.0
        return in_silicone(self.tca, section=section, perimeter=perimeter, touching=1.0)

    @property
    def body(self) -> BeamSpec:
        """The soft body without its TCA."""
        return silicone_cylinder(self.length, self.diameter, self.outer_diameter)

    @property
    def route(self) -> Route:
        """Where the TCA runs."""
        if self.double:
            return UTurn.double_helix(self.radius, self.turns / 2.0)
        return Helix(self.radius, self.turns)


@door
def twisting_module(spec: TwistingSpec | None = None) -> Part:
    """Builds the module: base at the origin, axis along z.

    Args:
        spec: The module, by default the published one.

    Returns:
        A part with the TCA ``tca`` and the site ``tip``.

    Raises:
        ValueError: If the geometry cannot be built, for example with too few nodes per turn.

    Example:
        >>> from tca_mj import Simulation, twisting_module
        >>> sim = Simulation(twisting_module())
        >>> sim.rest([120.0]) < 1e-4  # at 120 °C [rad/s]
        True
    """
    spec = spec or TwistingSpec()
    routes = {"tca": spec.route}
    return straight_module("twisting", spec.body, spec.nodes, spec.embedded, routes)

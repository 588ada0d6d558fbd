"""The 3D bending module: a silicone cylinder with three parallel TCAs (Sun, Section 4.1.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from tca_mj.checks import Checked, Positive, door
from tca_mj.hints import Length, Section
from tca_mj.model.build import add_tca
from tca_mj.model.chain import Nodes, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.rod.beam import BeamSpec
from tca_mj.routes import Route, TcaCount, parallel
from tca_mj.tca import CATALOGUE, TcaSpec
from tca_mj.tca.embedding import SILICONE_DENSITY, in_silicone

SILICONE_YOUNG = 0.125e6  # Ecoflex 00-30, Sun, Section 5.3 [Pa]
SILICONE_SHEAR = SILICONE_YOUNG / 3.0  # incompressible, Sun, Section 5.3 [Pa]


@door
def silicone_cylinder(
    length: Positive, diameter: Positive, outer_diameter: Positive
) -> BeamSpec:
    """A cylinder of Ecoflex 00-30.

    Args:
        length: Length [m].
        diameter: Diameter of the section that carries load [m].
        outer_diameter: Diameter of the body that is seen and touched, and holds the TCAs [m].
    """
    return BeamSpec.circular(
        length=length, diameter=diameter, outer_diameter=outer_diameter,
        young=SILICONE_YOUNG, shear=SILICONE_SHEAR, density=SILICONE_DENSITY,
    )  # fmt: skip


def straight_module(
    name: str, body: BeamSpec, nodes: Nodes, tca: TcaSpec, routes: Mapping[str, Route]
) -> Part:
    """A soft body with its base at the origin and its axis along z.

    Args:
        name: Name of the model.
        body: The body.
        nodes: Nodes of its chain.
        tca: The kind of TCA, cut to each of the routes.
        routes: Routes by the names of their TCAs.

    Returns:
        A part with these TCAs and the site ``tip``.

    Raises:
        ValueError: If the geometry cannot be built, or the routes have no names.
    """
    if not isinstance(routes, Mapping):
        raise ValueError(f"routes must be routes by the names of their TCAs, got {routes!r}")
    part = Part(new_spec(name), sites={"tip": "tip"})
    chain = add_chain(part.spec.worldbody, body, nodes=nodes, name="body")
    chain.mark_tip("tip")
    for key, route in routes.items():
        add_tca(part, chain, route, tca, name=key)
    return part


@dataclass(frozen=True, kw_only=True, slots=True)
class BendingSpec(Checked):
    """A cylinder with parallel TCAs.

    The published figures contradict each other: TCAs 4 mm from the centre do not fit a body of
    4.5 mm diameter (Sun, Section 5.3.1), yet only the stiffness of that section agrees with the
    measured angles. So the printed 4.5 mm are the section of silicone, which carries load, has
    weight and takes up heat, and 9 mm are the outline that is seen and touched, without weight.
    A solid body of 9 mm as soft as one of 4.5 mm could not stand: its weight would be three times
    what buckles it.

    Attributes:
        length: Length of the module [m]. Sun, Section 5.3.1.
        diameter: Diameter of the section of silicone [m]. Sun, Section 5.3.
        outer_diameter: Diameter of the outline [m]. Estimate: 4.5 mm read as a radius.
        offset: Distance of the TCAs from the centre line [m]. Sun, Section 5.3.1.
        count: Number of TCAs, at equal angles from the x axis on.
        nodes: Nodes of the chain. With 8 the tip lies within 1 % of the length of theory, with
            a load too, and up to half a turn.
        tca: The kind of TCA, cut to the module's length.

    Raises:
        ValueError: If a dimension is not finite and positive, or a number of pieces not whole.

    Example:
        >>> from tca_mj import BendingSpec, bending_module
        >>> spec = BendingSpec(length=60e-3, count=4)
        >>> len(bending_module(spec).tcas)
        4
    """

    length: Length = 45e-3
    diameter: Section = 4.5e-3
    outer_diameter: Section = 9e-3
    offset: Section = 4e-3
    count: TcaCount = 3
    nodes: Nodes = 8
    tca: TcaSpec = field(default_factory=lambda: CATALOGUE["free-stroke"])

    @property
    def body(self) -> BeamSpec:
        """The soft body without its TCAs."""
        beam = silicone_cylinder(self.length, self.diameter, self.outer_diameter)
        return replace(beam, line_density=SILICONE_DENSITY * math.pi * self.diameter**2 / 4.0)

    @property
    def embedded(self) -> TcaSpec:
        """The TCA in its channel, loosely, with its share of the silicone."""
        section = math.pi * self.diameter**2 / 4.0 / self.count
        perimeter = math.pi * self.outer_diameter / self.count
        return in_silicone(self.tca, section=section, perimeter=perimeter)


@door
def bending_module(spec: BendingSpec | None = None) -> Part:
    """Builds the module: base at the origin, axis along z, TCA 0 on the x side.

    Args:
        spec: The module, by default the published one.

    Returns:
        A part with the TCAs ``tca0``, ``tca1``, ... and the site ``tip``.

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import BendingSpec, bending_module
        >>> [tca.name for tca in bending_module(BendingSpec(length=60e-3)).tcas]
        ['tca0', 'tca1', 'tca2']
    """
    spec = spec or BendingSpec()
    routes = {f"tca{i}": route for i, route in enumerate(parallel(spec.count, spec.offset))}
    return straight_module("bending", spec.body, spec.nodes, spec.embedded, routes)

"""The innervated finger: three TCAs, two of which drive it and tell how it is bent (Sun, 4.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Annotated

from tca_mj.checks import Checked, NotNegative, Positive, Share, door, number, require_one_of
from tca_mj.hints import Length
from tca_mj.model.chain import add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.tendon import route_passes, route_tca
from tca_mj.modules.bending import BendingSpec
from tca_mj.routes import Helix, parallel
from tca_mj.tca import TcaSpec
from tca_mj.tca.thermal import BodyHeat

Volts = Annotated[float, partial(number, at_least=-100.0, at_most=100.0, unit="V")]
PAIR = 2  # TCAs in series, which are driven and sensed; Sun, Fig. 4.7b
_TCAS = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class InnervatedFingerSpec(Checked):
    """A soft cylinder with three parallel TCAs that are longer than it.

    "Based on the length of channels" of a finger of 40 mm, all TCAs are cut to 45 mm, sewn in and
    glued at both ends (Sun, Section 4.2.1): read as 5 mm of slack. Cold, nothing pulls; the two
    that are driven first take up their slack, and the third one hinders them only beyond 80°.

    Attributes:
        cylinder: The silicone, with three TCAs. Length: Sun, Section 4.2.1. The section is not
            printed: that of the 3D bending module.
        tca_length: Natural length of the TCAs [m]. Sun, Section 4.2.1.
        leads: NotNegative of what leads to the two TCAs [ohm]. Fitted to the 6.6 ohm at rest (Sun,
            Section 4.2.2), of which the TCAs have 6.4 by their length in the finger.

    Raises:
        ValueError: If a number is not positive, there are not three TCAs, or the TCAs are shorter
            than the finger or so long that their coils touch in it.

    Example:
        >>> from tca_mj import InnervatedFingerSpec
        >>> spec = InnervatedFingerSpec()
        >>> round(1e3 * spec.slack, 1)  # [mm]
        5.0
    """

    cylinder: BendingSpec = field(default_factory=lambda: BendingSpec(length=40e-3))
    tca_length: Length = 45e-3
    leads: NotNegative = 0.2

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        require_one_of("cylinder.count", self.cylinder.count, (_TCAS,))
        least, tca = self.cylinder.length, self.cylinder.tca
        most = least * tca.rest_length / tca.minimum_length  # there its coils touch
        number("tca_length", self.tca_length, at_least=least, below=most, unit="m")

    @property
    def slack(self) -> float:
        """By how much a TCA is longer than its channel [m]."""
        return self.tca_length - self.cylinder.length

    @property
    def embedded(self) -> TcaSpec:
        """The TCA with its share of the silicone, which is as long as the finger."""
        tca, share = self.cylinder.embedded, self.cylinder.length / self.tca_length
        assert tca.body is not None
        body = {each.name: share * getattr(tca.body, each.name) for each in fields(BodyHeat)}
        return replace(tca.of_length(self.tca_length), body=BodyHeat(**body))

    @property
    def routes(self) -> tuple[Helix, ...]:
        """Where the TCAs run: the pair on both sides of x, the third opposite."""
        return parallel(_TCAS, self.cylinder.offset, phase=-math.pi / _TCAS)

    @door
    def heating(self, voltage: Volts, resistance: Positive, duty: Share = 1.0) -> float:
        """Power of each TCA of the pair under a pulsed voltage [W].

        Args:
            voltage: Voltage between the leads, of either sign, at most 100 V [V].
            resistance: Resistance between them, more than ``leads`` [ohm].
            duty: Share of the time that the voltage is on, 0 to 1.

        Raises:
            ValueError: If a number is out of range.
        """
        number("resistance", resistance, above=self.leads, unit="ohm, leads")
        return duty * (voltage / resistance) ** 2 * (resistance - self.leads) / PAIR


@door
def innervated_finger(spec: InnervatedFingerSpec | None = None) -> Part:
    """Builds the finger: base at the origin, axis along z; its pair of TCAs bends it to x.

    Args:
        spec: The finger, by default the published one.

    Returns:
        A part with the TCAs ``tca0`` and ``tca1`` (the pair) and ``tca2``, and the site ``tip``.

    Raises:
        ValueError: If the geometry cannot be built.

    Example:
        >>> from tca_mj import innervated_finger
        >>> [tca.name for tca in innervated_finger().tcas]
        ['tca0', 'tca1', 'tca2']
    """
    spec = spec or InnervatedFingerSpec()
    body, nodes = spec.cylinder.body, spec.cylinder.nodes
    part = Part(new_spec("finger"), sites={"tip": "tip"})
    chain = add_chain(part.spec.worldbody, body, nodes=nodes, name="body")
    chain.mark_tip("tip")
    part.tcas = tuple(
        route_tca(
            part.spec, spec.embedded, route_passes(chain, route), name=f"tca{i}",
            stretch=-spec.slack,
        )
        for i, route in enumerate(spec.routes)
    )  # fmt: skip
    return part

"""What a twisted-and-coiled actuator (TCA) is made of: a coil of fibre, or several.

Published ones stand in ``catalogue.py``. "Sun" below is J. Sun's dissertation, Colorado State
University.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Annotated

from tca_mj.checks import (
    Checked,
    NotNegative,
    Positive,
    Temperature,
    door,
    number,
    quantity,
    whole,
)
from tca_mj.hints import angle, size
from tca_mj.tca.arrays import column
from tca_mj.tca.mandrel import BRILL_TRANSITION, kept_share
from tca_mj.tca.thermal import BodyHeat, HeatSpec
from tca_mj.tca.thread import FibreSpec, still_air_loss

_UPRIGHT = math.pi / 2.0  # pitch of a straight fibre [rad]
_length = partial(size, kind="threads", at_most=10.0)
_coil = partial(size, kind="coils", at_most=0.05)
_pitch = partial(angle, below=_UPRIGHT)


@dataclass(frozen=True, kw_only=True, slots=True)
class Plies(Checked):
    """Equal strands, each a coil of its own, that pull as one TCA, current through all of them.

    Side by side they have the TCA's length and share its tension: exact. Wound round each other
    they are longer, and their winding w is kept: strand^2 = length^2 + w^2. That is exact for
    strands that only pull, on a cylinder that keeps its radius; left out are what bends and twists
    the strands' own axes, how their twists hold each other, and friction between them.

    Attributes:
        strands: How many, 2 to 100 [1].
        lay_angle: Angle between strands and TCA at the natural length, 0 for side by side, below
            pi/4 [rad].
    """

    strands: Annotated[int, partial(whole, at_least=2, at_most=100)]
    lay_angle: Annotated[
        float, partial(quantity, at_least=0.0, below=math.pi / 4.0, unit="rad")
    ] = 0.0  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class TcaSpec(Checked):
    """One TCA: a fibre wound to a helix, and its heat and resistance; or several such strands.

    Attributes:
        fibre: The twisted fibre.
        fibre_length: Length l_t of the twisted fibre in the coil [m].
        coil_radius: Radius r* of the fibre's centre line at the natural length [m].
        pitch_angle: Pitch angle alpha* at the natural length [rad].
        minimum_pitch_angle: Pitch angle at which neighbouring coils touch [rad].
        breaking_force: Tension at which a coil breaks; None if that is not known [N].
        resistance_per_length: Electrical resistance per *natural length* of a coil (not per fibre
            length) [ohm/m].
        stretch_resistance: Relative fall of the resistance per unit strain of a coil that is
            stretched beyond its natural length [1].
        contraction_resistance: Relative rise of the resistance per unit contraction below the
            natural length [1].
        heat_loss: Heat lost to still air per length of *fibre* and excess temperature of a bare
            TCA; of several strands, by each [W/(m K)].
        ambient: Temperature of the surroundings [°C].
        body: The soft body that the TCA lies in and gives its heat to; None for a bare TCA.
        contact_ratio: Stiffness of touching coils over that of the cold coil: an estimate [1].
        contact_smoothing: Range over which the contact sets in, as a share of the minimum
            length: an estimate [1].
        plies: Several strands, all that stands above being that of each; None for one. In still air
            each loses its heat as if it hung alone, which strands that touch do not quite.

    Example:
        >>> from tca_mj import CATALOGUE
        >>> tca = CATALOGUE["free-stroke"].of_length(50e-3)
        >>> round(1e3 * tca.minimum_length, 1)  # where its coils touch [mm]
        31.9
    """

    fibre: FibreSpec
    fibre_length: Annotated[float, _length]
    coil_radius: Annotated[float, _coil]
    pitch_angle: Annotated[float, _pitch]
    minimum_pitch_angle: float
    breaking_force: Positive | None = None
    resistance_per_length: Positive
    stretch_resistance: float = 0.0
    contraction_resistance: NotNegative = 0.0
    heat_loss: Positive
    ambient: Temperature = 25.0
    body: BodyHeat | None = None
    contact_ratio: Positive = 50.0
    contact_smoothing: Annotated[float, partial(number, above=0.0, below=1.0)] = 0.005
    plies: Plies | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("coil_radius (spring index above 1)", self.coil_radius, above=self.fibre.radius)
        angle("minimum_pitch_angle", self.minimum_pitch_angle, below=self.pitch_angle)
        stretch = max(1.0 / math.sin(self.pitch_angle) - 1.0, 1e-300)  # there no resistance is left
        number("stretch_resistance", self.stretch_resistance, at_least=0.0, below=1.0 / stretch)
        # Beyond it the strands lie across before their coils touch.
        across = math.sin(self.minimum_pitch_angle) / math.sin(self.pitch_angle)
        number("plies.lay_angle", self.lay_angle, below=math.asin(across), unit="rad")

    @classmethod
    @door
    def from_measured(
        cls,
        *,
        fibre: FibreSpec,
        rest_length: Annotated[float, _length],
        resistance: Positive,
        fibre_length: Annotated[float, _length] | None = None,
        outer_diameter: Annotated[float, _coil] | None = None,
        coils: Positive | None = None,
        thickness: Annotated[float, _coil] | None = None,
        contact_length: Annotated[float, _length] | None = None,
        mass: Annotated[float, partial(size, kind="TCAs", at_most=1.0, unit="kg")] | None = None,
        stretch_resistance: NotNegative = 0.0,
        contraction_resistance: NotNegative = 0.0,
        breaking_force: Positive | None = None,
        heat_loss: Positive | None = None,
        plies: Plies | None = None,
    ) -> TcaSpec:
        """A TCA that lies on the bench, from what ruler, caliper, scale and ohmmeter say of it.

        Of fibre length, outer diameter and number of coils two are given, and the third follows.

        Args:
            fibre: The twisted fibre.
            rest_length: Natural length, cold, without load, after its training [m].
            resistance: Resistance from end to end at that length [ohm].
            fibre_length: Length of the twisted fibre in the coil, before it was wound [m].
            outer_diameter: Of the coil, across [m].
            coils: Their number.
            thickness: Of the twisted fibre, across, which is taken off the outer diameter; None for
                twice ``fibre.radius``, though that is of the circle that carries load [m].
            contact_length: Length when it is hot and its coils touch, the natural one less the free
                stroke; None for close packing, which real threads do not reach: see
                ``from_mandrel`` [m].
            mass: Of the fibre in the coil, from which ``fibre.line_density`` follows; None keeps
                what the fibre has [kg].
            stretch_resistance: Relative fall of the resistance per strain when it is pulled; 0 if
                that was not measured, and then nobody can sense by it [1].
            contraction_resistance: Relative rise per contraction when it is hot; likewise [1].
            breaking_force: Tension at which it breaks; None if that is not known [N].
            heat_loss: As in ``TcaSpec``; None for ``still_air_loss``, an estimate [W/(m K)].
            plies: If it has several strands. Lengths, resistance, mass and breaking force are then
                those of all together; diameter, coils, thickness and fibre length those of each.

        Raises:
            ValueError: If a number is out of range, as in millimetres or grams, if not two of the
                three are given, or they are no coil.
        """
        given = {"fibre_length": fibre_length, "outer_diameter": outer_diameter, "coils": coils}
        known = [name for name, value in given.items() if value is not None]
        if len(known) != 2:
            raise ValueError(f"two of {list(given)} must be given, got {known}")
        strands, lay = (1, 0.0) if plies is None else (plies.strands, plies.lay_angle)
        along = rest_length / math.cos(lay)
        half = fibre.radius if thickness is None else 0.5 * thickness
        if fibre_length is not None:
            number("rest_length", rest_length, below=fibre_length * math.cos(lay), unit="m")
        if outer_diameter is not None:
            radius = number("outer_diameter", outer_diameter, above=2.0 * half) / 2.0 - half
        elif fibre_length is not None and coils is not None:
            radius = math.sqrt(fibre_length**2 - along**2) / (2.0 * math.pi * coils)
        if fibre_length is None and coils is not None:
            fibre_length = math.hypot(along, 2.0 * math.pi * radius * coils)
        assert fibre_length is not None
        touching = _closest(radius, half)
        if contact_length is not None:
            number("contact_length", contact_length, below=rest_length, unit="m, the rest_length")
            wound = along * math.sin(lay)
            touching = math.asin(math.hypot(contact_length, wound) / fibre_length)
        if mass is not None:
            fibre = replace(fibre, line_density=mass / (strands * fibre_length))
        return cls(
            fibre=fibre, fibre_length=fibre_length, coil_radius=radius,
            pitch_angle=math.asin(along / fibre_length), minimum_pitch_angle=touching,
            breaking_force=breaking_force and breaking_force / (strands * math.cos(lay)),
            resistance_per_length=strands * resistance / along,
            stretch_resistance=stretch_resistance / math.cos(lay) ** 2,
            contraction_resistance=contraction_resistance / math.cos(lay) ** 2,
            heat_loss=still_air_loss(fibre) if heat_loss is None else heat_loss, plies=plies,
        )  # fmt: skip

    @classmethod
    @door
    def from_mandrel(
        cls,
        *,
        fibre: FibreSpec,
        fibre_length: Annotated[float, _length],
        core_diameter: Annotated[float, _coil],
        groove_pitch_angle: Annotated[float, _pitch],
        resistance_per_length: Positive,
        annealing_temperature: float | None = None,
        rest_length: Annotated[float, _length] | None = None,
        minimum_pitch_angle: float | None = None,
        breaking_force: Positive | None = None,
        heat_loss: Positive | None = None,
    ) -> TcaSpec:
        """A TCA from its making: fibre in a helical groove, annealed; Sun, Section 2.1.1.

        The made length is fibre_length sin(groove pitch), the radius on the mandrel is (core +
        fibre diameter)/2. Off it the coil keeps its turns and creeps to its natural length. That is
        *predicted*, contact length + ``kept_share`` (made length - contact length), by a rule that
        was fitted to two TCAs of one thread: on another it has been off by 15 %. Whoever has the
        TCA measures it and gives ``rest_length``, or takes ``from_measured``.

        Args:
            fibre: The twisted fibre.
            fibre_length: Its length in the coil [m].
            core_diameter: Diameter of the mandrel's core, the coil's inner diameter [m].
            groove_pitch_angle: Pitch angle of the groove, alpha_m [rad].
            resistance_per_length: As in ``TcaSpec`` [ohm/m].
            annealing_temperature: Temperature of the oven [°C]; None for the coil as made.
            rest_length: Natural length as measured, in place of the predicted one [m].
            minimum_pitch_angle: Pitch angle at which the coils touch; None is close packing,
                asin(r_t/(pi r)), 8.4° in Table 2.1, where real threads touch at 11.53° [rad].
            breaking_force: As in ``TcaSpec`` [N].
            heat_loss: As in ``TcaSpec``; None for ``still_air_loss``, an estimate [W/(m K)].

        Returns:
            The TCA at its natural length, other numbers at their defaults.

        Raises:
            ValueError: If a number is out of range, as in millimetres or degrees, or the coils
                touch (annealed too cold).
        """
        radius = 0.5 * core_diameter + fibre.radius
        if minimum_pitch_angle is None:
            minimum_pitch_angle = _closest(radius, fibre.radius)
        angle("minimum_pitch_angle", minimum_pitch_angle, below=groove_pitch_angle)
        kept = 1.0
        if annealing_temperature is not None:
            number("annealing_temperature", annealing_temperature, above=BRILL_TRANSITION,
                   below=fibre.melting_temperature)  # fmt: skip
            kept = kept_share(groove_pitch_angle, annealing_temperature)
        contact, made = math.sin(minimum_pitch_angle), math.sin(groove_pitch_angle)
        coil = cls(
            fibre=fibre, fibre_length=fibre_length, coil_radius=radius,
            pitch_angle=groove_pitch_angle, minimum_pitch_angle=minimum_pitch_angle,
            resistance_per_length=resistance_per_length, breaking_force=breaking_force,
            heat_loss=still_air_loss(fibre) if heat_loss is None else heat_loss,
        )  # fmt: skip
        sine = contact + kept * (made - contact)
        if rest_length is not None:
            sine = number("rest_length", rest_length, above=contact * fibre_length,
                          below=fibre_length, unit="m") / fibre_length  # fmt: skip
        return coil.of_pitch(math.asin(sine))

    @property
    def strands(self) -> int:
        """Number of strands."""
        return 1 if self.plies is None else self.plies.strands

    @property
    def lay_angle(self) -> float:
        """Angle between strands and TCA at the natural length, 0 unless it is plied [rad]."""
        return 0.0 if self.plies is None else self.plies.lay_angle

    @property
    def strand(self) -> TcaSpec:
        """One of the strands, alone; the TCA itself if it has but one."""
        return self if self.plies is None else replace(self, plies=None)

    @property
    def wound(self) -> float:
        """How far a strand goes round the TCA's axis, w; 0 unless it is plied [m]."""
        return self.fibre_length * math.sin(self.pitch_angle) * math.sin(self.lay_angle)

    @property
    def rest_length(self) -> float:
        """Natural length, l_t sin(alpha*) of one strand: no load, reference temperature [m]."""
        return self.fibre_length * math.sin(self.pitch_angle) * math.cos(self.lay_angle)

    @property
    def minimum_length(self) -> float:
        """Length at which neighbouring coils touch [m]."""
        touching, wound = self.fibre_length * math.sin(self.minimum_pitch_angle), self.wound
        return touching if wound == 0.0 else math.sqrt(touching**2 - wound**2)

    @property
    def free_stroke(self) -> float:
        """Contraction without load until the coils touch, over the natural length [1]."""
        return 1.0 - self.minimum_length / self.rest_length

    @property
    def winding(self) -> float:
        """Angle W about a coil's axis per fibre length, cos(alpha*)/r* [rad/m]."""
        return math.cos(self.pitch_angle) / self.coil_radius

    @property
    def coils(self) -> float:
        """Number of coils of a strand."""
        return self.winding * self.fibre_length / (2.0 * math.pi)

    @property
    def outer_radius(self) -> float:
        """Radius of the outer surface; of several strands in a ring in which they touch [m]."""
        coil = self.coil_radius + self.fibre.radius
        return coil if self.plies is None else coil * (1.0 + 1.0 / math.sin(math.pi / self.strands))

    @property
    def breaking_tension(self) -> float:
        """Tension at which it breaks, infinite where that is not known [N].

        Strands break together; wound ones lie straighter when they are stretched, and hold more.
        """
        if self.breaking_force is None:
            return math.inf
        return self.breaking_force * self.strands * math.cos(self.lay_angle)

    @property
    def mass(self) -> float:
        """Mass of the fibre of all strands, without a body [kg]."""
        return self.fibre.line_density * self.fibre_length * self.strands

    @property
    def heat(self) -> HeatSpec:
        """Lumped thermal constants, Sun, eq. (3.1); in a body all heat goes through that."""
        capacity, length, body = self.mass * self.fibre.specific_heat, self.rest_length, self.body
        if body is None:
            loss = self.heat_loss * self.fibre_length * self.strands
            return HeatSpec(capacity=capacity, loss=loss, ambient=self.ambient)
        return HeatSpec(
            capacity=capacity, loss=0.0, ambient=self.ambient,
            conductance=body.conductance * length, body_capacity=body.capacity * length,
            body_loss=body.loss * length,
        )  # fmt: skip

    @door
    def of_length(self, rest_length: float) -> TcaSpec:
        """A piece of the same coil (in the same body) with another natural length [m]."""
        _length("rest_length", rest_length)
        return replace(self, fibre_length=rest_length / self.rest_length * self.fibre_length)

    @door
    def of_pitch(self, pitch_angle: float) -> TcaSpec:
        """The same coil crept to another natural pitch angle [rad]; it keeps its turns.

        The coil's radius follows, cos(pitch)/winding; the contact length stays, and how far strands
        are wound.
        """
        _pitch("pitch_angle", pitch_angle)
        radius, plies = math.cos(pitch_angle) / self.winding, self.plies
        if plies is not None and plies.lay_angle:
            sine = self.wound / (self.fibre_length * math.sin(pitch_angle))
            plies = replace(plies, lay_angle=math.asin(min(sine, 1.0)))
        return replace(self, pitch_angle=pitch_angle, coil_radius=radius, plies=plies)


def _closest(coil: float, fibre: float) -> float:
    """Pitch angle of coils that touch, of the radii of coil and fibre: close packing [rad].

    Raises:
        ValueError: If it is none: the coil is thinner than the fibre.
    """
    number("radius of the coil", coil, above=fibre / math.pi, unit="m")
    return math.asin(fibre / (math.pi * coil))


def heat_of(specs: Sequence[TcaSpec]) -> HeatSpec:
    """Thermal constants of n TCAs, fields of shape (n,) that cannot be written to."""
    heats = [spec.heat for spec in specs]
    return HeatSpec(**{field.name: column(heats, field.name) for field in fields(HeatSpec)})

"""What a twisted-and-coiled actuator (TCA) is made of.

"Sun" below is J. Sun's dissertation, Colorado State University; its Chapter 2 and its
Chapter 3 twist the same thread under the same weight, so that one fibre is behind both, but for
the inserted twist and the mass per length, which are printed twice. What was weighed is a number of
its own and does not follow from the radius, which is the one that the moduli were fitted with.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Annotated, Literal

from tca_mj.checks import (
    Checked,
    NotNegative,
    Positive,
    Temperature,
    Triple,
    door,
    number,
    quantity,
    within,
)
from tca_mj.hints import angle, modulus, size
from tca_mj.tca.arrays import column
from tca_mj.tca.mandrel import BRILL_TRANSITION, kept_share
from tca_mj.tca.thermal import BodyHeat, HeatSpec

_ABSOLUTE_ZERO = -273.15  # [°C]
_UPRIGHT = math.pi / 2.0  # pitch of a straight fibre [rad]
_STRETCH_TO_SHEAR = 0.1, 1000.0  # bounds of E/G, estimates: 2 to 3 if isotropic, nylon to 15
_STEEPEST = 10.0  # slope of filaments around a fibre; fibres coil by themselves from about 1 on

_Modulus = Annotated[float, partial(modulus, typed=1e9)]
_LineDensity = Annotated[float, partial(size, kind="fibres", at_most=0.1, unit="kg/m")]
_length = partial(size, kind="threads", at_most=10.0)
_coil = partial(size, kind="coils", at_most=0.05)
_pitch = partial(angle, below=_UPRIGHT)


@dataclass(frozen=True, kw_only=True, slots=True)
class FibreSpec(Checked):
    """The twisted fibre (thread) of a TCA. Defaults: Sun, Tables 3.1 and Section 3.2.2.

    Attributes:
        radius: Radius r_t of the circle that carries load, when cold: the moduli were fitted with
            it (Sun, Table 3.1). Fibre measured across is 0.34 mm thick [m].
        young: Measured longitudinal Young's modulus E at the reference temperature, 0.1 to 1000
            times ``shear`` [Pa].
        shear: Measured longitudinal shear modulus G at the reference temperature [Pa].
        filament_young: Young's modulus E_f0 of the filament, nylon 6,6 [Pa].
        softening: Fall of E_f per kelvin, Sun, eq. (3.11) [Pa/K].
        load_softening: Coefficients (mu2, mu1, mu0) of the polynomial lambda(tau) by which
            a torsion tau [rad/m] multiplies that fall, Sun, eq. (3.11). (0, 0, 1) is no
            influence of the load. The other published set, (3.24e-4, -0.027, 1), was
            fitted to three loads of the free-stroke TCA up to 60 g (tau = 171 rad/m) and is
            an extrapolation beyond.
        inserted_twist: Twist inserted before annealing, per fibre length, at most 10 / ``radius``
            [rad/m].
        untwist_scale: Factor on the untwist, 1 unless a coil was fitted with another, at most 10
            [1].
        expansion: Coefficients (c2, c1, c0) of the ratio of hot to cold fibre radius,
            Gamma(T) = c2 T^2 + c1 T + c0 with T in °C, Sun, Section 3.1.2. The constant term
            is the one near 1. The laws divide Gamma by its value at the
            reference temperature, so that a cold TCA is at rest.
        line_density: Mass per length of twisted fibre [kg/m]. The thread is sold as 235/36 dtex,
            4 ply, 94 mg per metre, and 218 mm of it become 175 mm (Sun, Section 2.1.1 and Table
            3.2): 117 mg/m. The other printed data agree, 1300 kg/m^3 (Table 3.1) on 0.34 mm
            (Table 2.1) is 118 mg/m; on the circle that carries load it would be 180 mg/m.
        specific_heat: Heat capacity per mass [J/(kg K)].
        reference_temperature: Temperature T_0 at which the TCA has its natural shape [°C].
        temperature_range: Lowest and highest temperature of the measurements behind
            ``expansion`` and ``softening`` [°C]; the laws extrapolate beyond it.
        melting_temperature: Temperature above which there is no fibre [°C]: an estimate from
            handbook values of nylon 6,6, 255 to 265 °C.
        section: Whether A, I and J belong to the cold radius or grow with Gamma. An open
            choice, not settled by the source: "cold" is an assumption.
    """

    radius: Annotated[float, partial(size, kind="fibres", at_most=5e-3)] = 0.21e-3
    young: _Modulus = 1.2e9
    shear: _Modulus = 0.22e9
    filament_young: _Modulus = 3.9e9
    softening: float = 0.0011e9
    load_softening: Triple = (0.0, 0.0, 1.0)
    inserted_twist: NotNegative = 4710.0
    untwist_scale: Annotated[float, partial(quantity, at_least=0.0, at_most=10.0)] = 1.0
    expansion: Triple = (3.5e-6, -6.7e-5, 1.0)
    line_density: _LineDensity = 4 * 23.5e-6 * 218.0 / 175.0
    specific_heat: Positive = 1267.0
    reference_temperature: float = 25.0
    temperature_range: tuple[float, float] = (25.0, 160.0)
    melting_temperature: float = 260.0
    section: Literal["cold", "hot"] = "cold"

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        (mu2, mu1, mu0), (c2, c1, c0) = self.load_softening, self.expansion
        low, high = (share * self.shear for share in _STRETCH_TO_SHEAR)
        number("young", self.young, at_least=low, at_most=high, unit="Pa")
        number("inserted_twist", self.inserted_twist, at_most=_STEEPEST / self.radius, unit="rad/m")
        low, high = within("temperature_range", self.temperature_range, shape=(2,),
                           above=_ABSOLUTE_ZERO)  # fmt: skip
        reference = number("reference_temperature", self.reference_temperature)
        if not low <= reference < high:
            raise ValueError(
                f"temperature_range must hold the reference_temperature {reference} below its"
                f" upper end, got {self.temperature_range}"
            )
        number("melting_temperature", self.melting_temperature, above=high)
        if not (mu2 >= 0.0 and mu0 > 0.0 and (mu1 >= 0.0 or mu1 * mu1 < 4.0 * mu2 * mu0)):
            raise ValueError(
                "load_softening must be positive for every torsion from 0 on,"
                f" got {self.load_softening}"
            )
        bound = self.filament_young / (high - reference) / mu0  # no modulus left at the upper end
        number("softening", self.softening, at_least=0.0, below=bound)
        checked = [low, high, reference]
        if c2 != 0.0 and low < -c1 / (2.0 * c2) < high:
            checked.append(-c1 / (2.0 * c2))
        if not all(c2 * t * t + c1 * t + c0 > 0.0 for t in checked):
            raise ValueError(
                f"expansion must be above 0 from {low} to {high} °C, got {self.expansion}"
            )

    @property
    def growth(self) -> tuple[float, float]:
        """(a2, a1) of Gamma(T)/Gamma(T_0) = 1 + a1 (T - T_0) + a2 (T - T_0)^2 [1/K^2, 1/K]."""
        c2, c1, c0 = self.expansion
        t0 = self.reference_temperature
        gamma0 = c2 * t0 * t0 + c1 * t0 + c0
        return c2 / gamma0, (c1 + 2.0 * c2 * t0) / gamma0

    @property
    def softening_rate(self) -> float:
        """Relative fall of both moduli per kelvin without load [1/K]."""
        return self.softening / self.filament_young

    @property
    def area(self) -> float:
        """Cross-section A when cold [m^2]."""
        return math.pi * self.radius**2

    @property
    def second_moment(self) -> float:
        """Second moment of area I when cold [m^4]; the polar moment J is twice as large."""
        return math.pi * self.radius**4 / 4.0


@dataclass(frozen=True, kw_only=True, slots=True)
class TcaSpec(Checked):
    """One TCA: a fibre wound to a helix, and its heat and resistance.

    Attributes:
        fibre: The twisted fibre.
        fibre_length: Length l_t of the twisted fibre in the coil [m].
        coil_radius: Radius r* of the fibre's centre line at the natural length [m].
        pitch_angle: Pitch angle alpha* at the natural length [rad].
        minimum_pitch_angle: Pitch angle at which neighbouring coils touch [rad].
        breaking_force: Tension at which the TCA breaks, Sun, Section 2.1.1, type 2-200 [N].
        resistance_per_length: Electrical resistance per *natural length* of the TCA (not per
            fibre length), Sun, Table 2.3: 6.7 ohm/dm [ohm/m].
        stretch_resistance: Relative fall of the resistance per unit strain of a TCA that is
            stretched beyond its natural length. Sun, Section 2.3.1: 0.55 ohm for 50 % on a cold
            TCA of 110 mm, which has 7.37 ohm: 0.55/7.37/0.5 [1].
        contraction_resistance: Relative rise of the resistance per unit contraction below the
            natural length. Fitted to "~20 %" over the actuation (Sun, Section 3.1.1), which is the
            free stroke of 35.7 % (Table 2.1) [1].
        heat_loss: Heat lost to still air per length of *fibre* and excess temperature of a bare
            TCA, h c_s 2 pi r_t. Sun, Table 3.1 and Section 3.1.1: h = 23 W/(m^2 K), c_s = 2.5, r_t
            = 0.21 mm. Only the product was identified, by a regression (Section 3.5.2), so that it
            is one number here, and the same for all TCAs of this thread [W/(m K)].
        ambient: Temperature of the surroundings [°C].
        body: The soft body that the TCA lies in and gives its heat to; None for a bare TCA.
        contact_ratio: Stiffness of touching coils over that of the cold coil: an estimate [1].
        contact_smoothing: Range over which the contact sets in, as a share of the minimum
            length: an estimate [1].

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
    breaking_force: Positive = 0.78
    resistance_per_length: Positive = 67.0
    stretch_resistance: float = 0.55 / (67.0 * 0.110) / 0.5
    contraction_resistance: NotNegative = 0.20 / 0.357
    heat_loss: Positive = 23.0 * 2.5 * 2.0 * math.pi * 0.21e-3
    ambient: Temperature = 25.0
    body: BodyHeat | None = None
    contact_ratio: Positive = 50.0
    contact_smoothing: Annotated[float, partial(number, above=0.0, below=1.0)] = 0.005

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("coil_radius (spring index above 1)", self.coil_radius, above=self.fibre.radius)
        angle("minimum_pitch_angle", self.minimum_pitch_angle, below=self.pitch_angle)
        stretch = max(1.0 / math.sin(self.pitch_angle) - 1.0, 1e-300)  # there no resistance is left
        number("stretch_resistance", self.stretch_resistance, at_least=0.0, below=1.0 / stretch)

    @classmethod
    @door
    def from_mandrel(
        cls,
        *,
        fibre: FibreSpec,
        fibre_length: float,
        core_diameter: float,
        groove_pitch_angle: float,
        annealing_temperature: float | None = None,
        minimum_pitch_angle: float | None = None,
    ) -> TcaSpec:
        """A TCA from its making: fibre in a helical groove, annealed; Sun, Section 2.1.1.

        The made length is fibre_length sin(groove pitch), the radius on the mandrel is (core +
        fibre diameter)/2. Off it the coil keeps its turns and creeps to its natural length,
        contact length + ``kept_share`` (made length - contact length).

        Args:
            fibre: The twisted fibre.
            fibre_length: Its length in the coil [m].
            core_diameter: Diameter of the mandrel's core, the coil's inner diameter [m].
            groove_pitch_angle: Pitch angle of the groove, alpha_m [rad].
            annealing_temperature: Temperature of the oven [°C]; None for the coil as made.
            minimum_pitch_angle: Pitch angle at which the coils touch; None is close packing,
                asin(r_t/(pi r)), 8.4° in Table 2.1, where real threads touch at 11.53° [rad].

        Returns:
            The TCA at its natural length, other numbers at their defaults.

        Raises:
            ValueError: If a number is out of range, as in millimetres or degrees, or the coils
                touch (annealed too cold).
        """
        _length("fibre_length", fibre_length)
        _coil("core_diameter", core_diameter)
        _pitch("groove_pitch_angle", groove_pitch_angle)
        radius = 0.5 * core_diameter + fibre.radius
        if minimum_pitch_angle is None:
            minimum_pitch_angle = math.asin(fibre.radius / (math.pi * radius))
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
        )  # fmt: skip
        return coil.of_pitch(math.asin(contact + kept * (made - contact)))

    @property
    def rest_length(self) -> float:
        """Natural length l_t sin(alpha*): no load, reference temperature [m]."""
        return self.fibre_length * math.sin(self.pitch_angle)

    @property
    def minimum_length(self) -> float:
        """Length at which neighbouring coils touch [m]."""
        return self.fibre_length * math.sin(self.minimum_pitch_angle)

    @property
    def free_stroke(self) -> float:
        """Contraction without load until the coils touch, over the natural length [1]."""
        return 1.0 - self.minimum_length / self.rest_length

    @property
    def winding(self) -> float:
        """Angle W about the coil's axis per fibre length, cos(alpha*)/r* [rad/m]."""
        return math.cos(self.pitch_angle) / self.coil_radius

    @property
    def coils(self) -> float:
        """Number of coils."""
        return self.winding * self.fibre_length / (2.0 * math.pi)

    @property
    def outer_radius(self) -> float:
        """Radius of the coil's outer surface [m]."""
        return self.coil_radius + self.fibre.radius

    @property
    def mass(self) -> float:
        """Mass of the fibre, without a body [kg]."""
        return self.fibre.line_density * self.fibre_length

    @property
    def heat(self) -> HeatSpec:
        """Lumped thermal constants, Sun, eq. (3.1); in a body all heat goes through that."""
        capacity, length, body = self.mass * self.fibre.specific_heat, self.rest_length, self.body
        if body is None:
            loss = self.heat_loss * self.fibre_length
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

        The coil's radius follows, cos(pitch)/winding; the contact length stays.
        """
        _pitch("pitch_angle", pitch_angle)
        radius = math.cos(pitch_angle) / self.winding
        return replace(self, pitch_angle=pitch_angle, coil_radius=radius)


def heat_of(specs: Sequence[TcaSpec]) -> HeatSpec:
    """Thermal constants of n TCAs, fields of shape (n,) that cannot be written to."""
    heats = [spec.heat for spec in specs]
    return HeatSpec(**{field.name: column(heats, field.name) for field in fields(HeatSpec)})

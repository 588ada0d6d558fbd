"""The twisted fibre that a TCA is wound of.

Nothing here is the number of a thread: materials stand in ``materials.py``. "Sun" below is J. Sun's
dissertation, Colorado State University.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import partial
from typing import Annotated, Any, Literal

from tca_mj.checks import Checked, NotNegative, Positive, Triple, door, number, quantity, within
from tca_mj.hints import modulus, size

_ABSOLUTE_ZERO = -273.15  # [°C]
_STRETCH_TO_SHEAR = 0.1, 1000.0  # bounds of E/G, estimates: 2 to 3 if isotropic, nylon to 15
_STEEPEST = 10.0  # slope of filaments around a fibre; fibres coil by themselves from about 1 on

# Default of what has none; else Python would say which arguments are missing, and not what to do.
_ASKED: Any = None

_Modulus = Annotated[float, partial(modulus, typed=1e9)]
_LineDensity = Annotated[float, partial(size, kind="fibres", at_most=0.1, unit="kg/m")]


@dataclass(frozen=True, kw_only=True, slots=True)
class FibreSpec(Checked):
    """The twisted fibre (thread) of a TCA.

    It has no number of its own but for what is 1, or no influence, if nothing else is known. A
    fibre of a known material is ``MATERIALS[name].fibre(...)``.

    Attributes:
        radius: Radius r_t of the circle that carries load, when cold: the one that the moduli were
            found with. A thread measured across may be thinner [m].
        young: Measured longitudinal Young's modulus E at the reference temperature, 0.1 to 1000
            times ``shear`` [Pa].
        shear: Measured longitudinal shear modulus G at the reference temperature [Pa].
        filament_young: Young's modulus E_f0 of the filament; of a monofilament ``young`` [Pa].
        softening: Fall of E_f per kelvin, Sun, eq. (3.11) [Pa/K].
        load_softening: Coefficients (mu2, mu1, mu0) of the polynomial lambda(tau) by which
            a torsion tau [rad/m] multiplies that fall, Sun, eq. (3.11). (0, 0, 1) is no
            influence of the load.
        inserted_twist: Twist inserted before annealing, per fibre length, at most 10 / ``radius``
            [rad/m].
        untwist_scale: Factor on the untwist, 1 unless a coil was fitted with another, at most 10
            [1].
        expansion: Coefficients (c2, c1, c0) of the ratio of hot to cold fibre radius,
            Gamma(T) = c2 T^2 + c1 T + c0 with T in °C, Sun, Section 3.1.2. The constant term
            is the one near 1. The laws divide Gamma by its value at the
            reference temperature, so that a cold TCA is at rest.
        line_density: Mass per length of twisted fibre, as weighed: it does not follow from
            ``radius`` [kg/m].
        specific_heat: Heat capacity per mass [J/(kg K)].
        reference_temperature: Temperature T_0 at which the TCA has its natural shape [°C].
        temperature_range: Lowest and highest temperature of the measurements behind
            ``expansion`` and ``softening`` [°C]; the laws extrapolate beyond it.
        melting_temperature: Temperature above which there is no fibre [°C].
        section: Whether A, I and J belong to the cold radius or grow with Gamma. An open
            choice, not settled by the source: "cold" is an assumption.

    Raises:
        ValueError: If a number is out of bounds, or one is left out that only a material has.
    """

    radius: Annotated[float, partial(size, kind="fibres", at_most=5e-3)] = _ASKED
    young: _Modulus = _ASKED
    shear: _Modulus = _ASKED
    filament_young: _Modulus = _ASKED
    softening: float = _ASKED
    load_softening: Triple = (0.0, 0.0, 1.0)
    inserted_twist: NotNegative = _ASKED
    untwist_scale: Annotated[float, partial(quantity, at_least=0.0, at_most=10.0)] = 1.0
    expansion: Triple = _ASKED
    line_density: _LineDensity = _ASKED
    specific_heat: Positive = _ASKED
    reference_temperature: float = 25.0
    temperature_range: tuple[float, float] = _ASKED
    melting_temperature: float = _ASKED
    section: Literal["cold", "hot"] = "cold"

    def __post_init__(self) -> None:
        missing = [each.name for each in fields(self) if getattr(self, each.name) is None]
        if missing:
            raise ValueError(
                f"{', '.join(missing)} must be given, got nothing: name the material by"
                " MATERIALS[...].fibre(radius=..., inserted_twist=..., line_density=...), or say"
                " all numbers of another one"
            )
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


@door
def still_air_loss(fibre: FibreSpec) -> float:
    """Heat lost to still air by a thread of which it was not measured [W/(m K)].

    By the circumference of its circle, h c_s 2 pi r_t with h = 23 W/(m² K) and c_s = 2.5, which
    were identified on one silver-coated thread (Sun, Table 3.1 and Section 3.1.1). Of another
    thread it is an estimate, good to a factor of two: a smooth one has less surface.

    Args:
        fibre: The thread.
    """
    return 23.0 * 2.5 * 2.0 * math.pi * fibre.radius

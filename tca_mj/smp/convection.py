"""Heat from a slender body to air: still, moving, radiated; and what conduction inside adds.

Only ratios and checks come from here: the loss of a spine is fitted to its natural cooling.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated

from scipy.optimize import brentq

from tca_mj.checks import Checked, Positive, Share, door, number, quantity

_ZERO = 273.15  # 0 °C [K]
_STEFAN_BOLTZMANN = 5.670374e-8  # [W/(m² K⁴)]
_GRAVITY = 9.81  # [m/s²]


AirTemperature = Annotated[float, partial(number, at_least=-100.0, at_most=600.0, unit="°C")]
"""Within the range of the laws for air."""
Diameter = Annotated[float, partial(quantity, above=0.0, at_most=1.0, unit="m")]
"""Of what is slender; beyond, the flow of air is another one."""
Speed = Annotated[float, partial(quantity, above=0.0, at_most=100.0, unit="m/s")]
"""Below a third of the speed of sound, as the laws ask for."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Air(Checked):
    """Dry air at atmospheric pressure.

    Attributes:
        temperature: Temperature [°C].
    """

    temperature: AirTemperature

    @property
    def expansion(self) -> float:
        """Thermal expansion of an ideal gas, 1/T [1/K]."""
        return 1.0 / (self.temperature + _ZERO)

    @property
    def viscosity(self) -> float:
        """Kinematic viscosity: Sutherland's law over the density of an ideal gas [m²/s]."""
        kelvin = self.temperature + _ZERO
        return self._dynamic_viscosity * 287.05 * kelvin / 101325.0

    @property
    def conductivity(self) -> float:
        """Thermal conductivity, U.S. Standard Atmosphere 1976, eq. (53) [W/(m K)]."""
        kelvin = self.temperature + _ZERO
        return 2.64638e-3 * kelvin**1.5 / (kelvin + 245.4 * 10.0 ** (-12.0 / kelvin))

    @property
    def prandtl(self) -> float:
        """Prandtl number [1]."""
        return self._dynamic_viscosity * 1007.0 / self.conductivity

    @property
    def _dynamic_viscosity(self) -> float:
        kelvin = self.temperature + _ZERO
        return 1.458e-6 * kelvin**1.5 / (kelvin + 110.4)


@door
def still_air(diameter: Diameter, surface: AirTemperature, ambient: AirTemperature) -> float:
    """Coefficient of natural convection from a long horizontal cylinder [W/(m² K)].

    Churchill & Chu, Int. J. Heat Mass Transfer 18, 1049 (1975), for Ra up to 1e12.

    Args:
        diameter: Diameter [m].
        surface: Temperature of the surface, above ``ambient`` [°C].
        ambient: Temperature of the air [°C].

    Raises:
        ValueError: If a number is out of range or the surface not hotter than the air.
    """
    number("surface", surface, above=ambient, unit="°C, of ambient")
    air = Air(temperature=0.5 * (surface + ambient))
    buoyancy = _GRAVITY * air.expansion * (surface - ambient)
    rayleigh = buoyancy * diameter**3 * air.prandtl / air.viscosity**2
    shape = (1.0 + (0.559 / air.prandtl) ** (9 / 16)) ** (8 / 27)
    nusselt = (0.6 + 0.387 * rayleigh ** (1 / 6) / shape) ** 2
    return nusselt * air.conductivity / diameter


@door
def moving_air(
    diameter: Diameter, speed: Speed, surface: AirTemperature, ambient: AirTemperature
) -> float:
    """Coefficient of forced convection from a long cylinder across the stream [W/(m² K)].

    Churchill & Bernstein, J. Heat Transfer 99, 300 (1977), for Re Pr above 0.2.

    Args:
        diameter: Diameter [m].
        speed: Speed of the air [m/s].
        surface: Temperature of the surface [°C].
        ambient: Temperature of the air [°C].

    Raises:
        ValueError: If a number is out of range.
    """
    air = Air(temperature=0.5 * (surface + ambient))
    reynolds = speed * diameter / air.viscosity
    shape = (1.0 + (0.4 / air.prandtl) ** (2 / 3)) ** 0.25
    nusselt = 0.62 * math.sqrt(reynolds) * air.prandtl ** (1 / 3) / shape
    nusselt = 0.3 + nusselt * (1.0 + (reynolds / 282000.0) ** (5 / 8)) ** 0.8
    return nusselt * air.conductivity / diameter


@door
def radiation(surface: AirTemperature, ambient: AirTemperature, emissivity: Share = 0.9) -> float:
    """Coefficient of radiation to surroundings at the temperature of the air [W/(m² K)].

    Args:
        surface: Temperature of the surface [°C].
        ambient: Temperature of the surroundings [°C].
        emissivity: Emissivity, 0 to 1 [1]; the default is an estimate for polymers.

    Raises:
        ValueError: If a number is out of range.
    """
    hot, cold = surface + _ZERO, ambient + _ZERO
    return emissivity * _STEFAN_BOLTZMANN * (hot * hot + cold * cold) * (hot + cold)


@dataclass(frozen=True, kw_only=True, slots=True)
class Slab(Checked):
    """A plate that cools from both faces: the slowest mode of conduction.

    Carslaw & Jaeger, Conduction of Heat in Solids, Section 3.11.

    Attributes:
        thickness: Thickness [m].
        conductivity: Thermal conductivity [W/(m K)].
        capacity: Heat capacity per volume [J/(m³ K)].
        coefficient: Heat-transfer coefficient at the faces [W/(m² K)].

    Raises:
        ValueError: If a number is not positive.
    """

    thickness: Positive
    conductivity: Positive
    capacity: Positive
    coefficient: Positive

    @property
    def biot(self) -> float:
        """Resistance inside over resistance outside, h (t/2)/k [1]."""
        return 0.5 * self.coefficient * self.thickness / self.conductivity

    @property
    def root(self) -> float:
        """Smallest root ζ of ζ tan ζ = Bi [1]."""
        biot = self.biot
        return float(brentq(lambda z: z * math.sin(z) - biot * math.cos(z), 0.0, 0.5 * math.pi))

    @property
    def time_constant(self) -> float:
        """Time constant of the slowest mode [s]; c t/(2 h) if Bi is small."""
        diffusivity = self.conductivity / self.capacity
        return (0.5 * self.thickness / self.root) ** 2 / diffusivity

    @door
    def centre_time(self, excess_ratio: float) -> float:
        """Time until the centre of a uniformly hot plate is cooled by a ratio, first mode [s].

        Args:
            excess_ratio: Excess over the air at the start, over that at the end; at least 1.2,
                where the higher modes have died out.

        Raises:
            ValueError: If the ratio is smaller.
        """
        number("excess_ratio", excess_ratio, at_least=1.2)
        z = self.root
        amplitude = 4.0 * math.sin(z) / (2.0 * z + math.sin(2.0 * z))
        return self.time_constant * math.log(amplitude * excess_ratio)

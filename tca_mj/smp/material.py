"""Modulus of a shape-memory polymer over temperature, and the spine made of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from tca_mj.checks import Array, Checked, Finite, Positive, door, number, require_positive, within
from tca_mj.hints import Length, Modulus, Section, modulus
from tca_mj.tca.arrays import frozen

# Above 110 °C the modulus is below this, Sun, dissertation, Colorado State University, 6.1.3 [Pa].
SOFT_MODULUS = 50e6


@dataclass(frozen=True, kw_only=True)
class SmpSpec(Checked):
    """A shape-memory epoxy: Epon 828 with 6 wt% diethylaminopropylamine (Sun, Section 6.1.1).

    The logarithm of the modulus falls from glassy to rubbery along a sigmoid about the middle of
    the reported transition; its width is set by what is left of the modulus at the lower end.

    Attributes:
        glassy: Young's modulus far below the transition [Pa]. Estimate: epoxies of bisphenol A
            cured by amines have 2 to 3 GPa.
        rubbery: Young's modulus far above it [Pa]. Estimate: such networks have 5 to 20 MPa
            (rubber elasticity, 3 ρ R T / M_c, gives 6 MPa for M_c = 1.9 kg/mol between
            crosslinks), and the spine must not have more than ``SpineSpec.largest_modulus``.
        rigid_below: Lower end of the transition: rigid below it, Sun, Section 6.1.3 [°C].
        soft_above: Upper end: less than 50 MPa above it, Sun, Section 6.1.3 [°C].
        rigid_share: Share of the glassy modulus left at ``rigid_below``: an estimate of "rigid".
        density: Density, an estimate: that of the resin [kg/m³].
        specific_heat: Mean specific heat between room and 120 °C, an estimate [J/(kg K)].
        conductivity: Thermal conductivity, an estimate for unfilled epoxy [W/(m K)].

    Raises:
        ValueError: If a number is out of range.
    """

    glassy: Annotated[float, partial(modulus, typed=1e9)] = 2.5e9
    rubbery: Modulus = 6e6
    rigid_below: float = 80.0
    soft_above: Finite = 110.0
    rigid_share: float = 0.9
    density: Positive = 1160.0
    specific_heat: Positive = 1300.0
    conductivity: Positive = 0.2

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("rubbery", self.rubbery, below=self.glassy, unit="Pa")
        number("rigid_below", self.rigid_below, above=-273.15, below=self.soft_above, unit="°C")
        half = math.sqrt(self.rubbery / self.glassy)  # what is left at the middle
        number("rigid_share", self.rigid_share, above=half, below=1.0)

    @cached_property
    def middle(self) -> float:
        """Temperature at which the modulus is the geometric mean of its limits [°C]."""
        return 0.5 * (self.rigid_below + self.soft_above)

    @cached_property
    def width(self) -> float:
        """Scale w of the sigmoid 1/(1 + exp((T - middle)/w)) [K]."""
        lost = math.log(self.rigid_share) / math.log(self.rubbery / self.glassy)
        return (self.middle - self.rigid_below) / math.log((1.0 - lost) / lost)

    @cached_property
    def _sigmoid(self) -> tuple[Array, Array, Array, Array]:
        """Its middle, scale and height ln(glassy/rubbery), and what it is a factor on."""
        height = math.log(self.glassy / self.rubbery)
        return frozen(self.middle), frozen(-self.width), frozen(height), frozen(self.rubbery)

    def modulus(self, temperature: ArrayLike) -> Array:
        """Young's modulus E(T), any shape [Pa].

        Raises:
            ValueError: If a temperature is not finite.
        """
        return self.rubbery + self.glass(temperature)

    def glass(self, temperature: ArrayLike) -> Array:
        """E(T) - rubbery: the modulus that forms on cooling and melts on heating [Pa].

        Raises:
            ValueError: If a temperature is not finite.
        """
        return np.expm1(self._decades(temperature)[0]) * self._sigmoid[3]

    def slope(self, temperature: ArrayLike) -> Array:
        """dE/dT, never above 0 [Pa/K].

        Raises:
            ValueError: If a temperature is not finite.
        """
        height, share = self._decades(temperature)
        return -self.rubbery * np.exp(height) * height * (1.0 - share) / self.width

    def _decades(self, temperature: ArrayLike) -> tuple[Array, Array]:
        """ln(E/rubbery) and the sigmoid, 1 when cold and 0 when hot."""
        temperature = within("temperature", temperature)
        middle, width, height, _ = self._sigmoid
        share = expit((temperature - middle) / width)
        return share * height, share


@dataclass(frozen=True, kw_only=True, slots=True)
class SpineSpec(Checked):
    """The spine of the bending morphing module, and where its TCA runs.

    Sun, Section 6.1.1, prints the module's 115 x 6.5 x 5 mm and neither the spine's section nor
    the TCA's offset. Estimate: the 5 mm are the spine and, glued to its protrusions, the silicone
    tube with the TCA, half each. A thinner spine would not hold 15 g within 3° when glassy, a
    thicker one would not reach 240° when soft (``sag``, ``largest_modulus``).

    Attributes:
        smp: What the spine is made of.
        length: Length [m]. Sun, Section 6.1.1.
        width: Extent across the plane of bending [m]. Sun, Section 6.1.1.
        thickness: Extent of the spine in the plane of bending [m]. Estimate.
        module_height: Extent of the whole module in that plane [m]. Sun, Section 6.1.1.
        tca_offset: Distance of both legs of the TCA from the spine's axis [m]. Estimate: half
            the spine and half a tube of 2.5 mm.

    Raises:
        ValueError: If a dimension is not positive, or the spine thicker than the module.
    """

    smp: SmpSpec = field(default_factory=SmpSpec)
    length: Length = 115e-3
    width: Section = 6.5e-3
    thickness: Section = 2.5e-3
    module_height: Section = 5e-3
    tca_offset: Section = 2.5e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("thickness", self.thickness, at_most=self.module_height, unit="m")

    @property
    def second_moment(self) -> float:
        """Second moment of area in the plane of bending, width thickness³/12 [m⁴]."""
        return self.width * self.thickness**3 / 12.0

    @property
    def mass(self) -> float:
        """Mass of the polymer without protrusions, wires, tube and TCA [kg]."""
        return self.smp.density * self.length * self.width * self.thickness

    @property
    def heat_capacity(self) -> float:
        """Heat capacity of the polymer [J/K]."""
        return self.mass * self.smp.specific_heat

    @property
    def equivalent_diameter(self) -> float:
        """Diameter of the cylinder with the module's perimeter, for the air round it [m]."""
        return 2.0 * (self.width + self.module_height) / math.pi

    @door
    def bending(self, temperature: ArrayLike) -> Array:
        """Bending stiffness E(T) I, any shape [N m²]."""
        return self.smp.modulus(temperature) * self.second_moment

    @door
    def largest_modulus(self, angle: float, tension: float) -> float:
        """Modulus at which two legs of TCA still bend the spine by an angle: 2 F a L/(θ I) [Pa].

        A straight spine, uniform moment, no load; 240° at 0.78 N per leg is the reported largest
        angle (Sun, Section 6.2.1) at the reported strength of a TCA (Section 2.1.1).

        Args:
            angle: Bending angle θ of the whole spine [rad].
            tension: Tension F of each leg [N].

        Raises:
            ValueError: If one of them is not positive.
        """
        require_positive(angle=angle, tension=tension)
        return 2.0 * tension * self.tca_offset * self.length / (angle * self.second_moment)

    @door
    def sag(self, weight: float, temperature: ArrayLike) -> Array:
        """Turn of the tip of the straight, horizontal spine under a weight: F L²/(2 E I) [rad].

        Args:
            weight: Force F at the tip [N].
            temperature: Temperature, any shape [°C].
        """
        return 0.5 * weight * self.length**2 / self.bending(temperature)

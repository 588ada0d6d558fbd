"""What a soft beam is made of: section, stiffness, mass and reference shape."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np

from tca_mj.checks import Checked, NotNegative, Positive, Triple, door, row
from tca_mj.hints import size


@dataclass(frozen=True, slots=True)
class Outline(Checked):
    """Outer contour of a section: what is seen and touched, and what holds the TCAs.

    Attributes:
        half_width: Half the extent along the section's x axis, or the radius of a disc [m].
        half_height: Half the extent along y [m].
        round: Whether the section is a disc (then both halves are equal).

    Raises:
        ValueError: If a half is not finite and positive, or those of a disc differ.
    """

    half_width: Annotated[float, partial(size, kind="soft bodies", at_most=1.0)]
    half_height: Annotated[float, partial(size, kind="soft bodies", at_most=1.0)]
    round: bool = True

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.round and self.half_width != self.half_height:
            raise ValueError(
                f"half_height must be half_width {self.half_width} m in a round outline,"
                f" got {self.half_height}"
            )

    @door
    def contains(self, x: float, y: float, tolerance: NotNegative = 1e-9) -> bool:
        """Whether the point (x, y) [m] of the section lies inside the contour."""
        if self.round:
            return bool(np.hypot(x, y) <= self.half_width + tolerance)
        inside_x = abs(x) <= self.half_width + tolerance
        return bool(inside_x and abs(y) <= self.half_height + tolerance)

    @property
    def area(self) -> float:
        """Area inside the contour [m²]."""
        if self.round:
            return np.pi * self.half_width**2
        return 4.0 * self.half_width * self.half_height


@dataclass(frozen=True, kw_only=True, slots=True)
class BeamSpec(Checked):
    """A uniform soft beam with z along its centre line.

    The stiffness belongs to the *effective* section, mass and contact to the *outline*; the two
    differ where a body has holes or is glued together from several materials.

    Attributes:
        length: Length L of the unloaded centre line [m].
        bending: Bending stiffness EI about the section's x and y axes [N m²].
        torsion: Torsional stiffness GJ [N m²].
        stretching: Axial stiffness EA [N].
        shearing: Shear stiffness GA, without a shear factor [N].
        line_density: Mass per length [kg/m].
        outline: Outer contour of the section.
        curvature: Curvature u of the unloaded body in its own frame, shape (3,) [1/m].
        damping_time: Kelvin-Voigt time: damping over stiffness [s]. The default is an estimate
            for platinum-cure silicone.

    Raises:
        ValueError: If a number is not finite or not positive where it must be.
    """

    length: Annotated[float, partial(size, kind="soft bodies", at_most=10.0)]
    bending: Annotated[tuple[float, float], partial(row, shape=(2,), above=0.0)]
    torsion: Positive
    stretching: Positive
    shearing: Positive
    line_density: Positive
    outline: Outline
    curvature: Triple = (0.0, 0.0, 0.0)
    damping_time: NotNegative = 1e-2

    @property
    def mass(self) -> float:
        """Mass of the beam [kg]."""
        return self.line_density * self.length

    @classmethod
    @door
    def circular(
        cls,
        *,
        length: Positive,
        diameter: Positive,
        young: Positive,
        shear: Positive,
        density: Positive,
        outer_diameter: Positive | None = None,
        **more: Any,
    ) -> BeamSpec:
        """A round beam.

        Args:
            length: Length [m].
            diameter: Diameter of the section that carries load [m].
            young: Young's modulus E [Pa].
            shear: Shear modulus G [Pa].
            density: Density of the whole body [kg/m³].
            outer_diameter: Diameter of the outline, ``diameter`` by default [m].
            **more: ``curvature`` and ``damping_time``, as in the class.

        Raises:
            ValueError: If a dimension or a modulus is not positive.
        """
        outer = diameter if outer_diameter is None else outer_diameter
        area = np.pi * diameter**2 / 4.0
        inertia = np.pi * diameter**4 / 64.0
        outline = Outline(outer / 2.0, outer / 2.0)
        return cls(
            length=length, bending=(young * inertia, young * inertia),
            torsion=2.0 * shear * inertia, stretching=young * area, shearing=shear * area,
            line_density=density * outline.area, outline=outline, **more,
        )  # fmt: skip

    @classmethod
    @door
    def box(
        cls,
        *,
        length: Positive,
        width: Positive,
        height: Positive,
        young: Positive,
        shear: Positive,
        density: Positive,
        **more: Any,
    ) -> BeamSpec:
        """A beam of rectangular section, ``width`` along x and ``height`` along y; else as round.

        The torsion constant is Saint-Venant's, by its series (Timoshenko & Goodier, Theory of
        Elasticity, section 109), not the polar moment, which is too large by 1.8 for 3 x 6 mm.

        Raises:
            ValueError: If a dimension or a modulus is not positive.
        """
        area = width * height
        return cls(
            length=length,
            bending=(young * width * height**3 / 12.0, young * height * width**3 / 12.0),
            torsion=shear * torsion_constant(width, height), stretching=young * area,
            shearing=shear * area, line_density=density * area,
            outline=Outline(width / 2.0, height / 2.0, round=False), **more,
        )  # fmt: skip


@door
def torsion_constant(width: Positive, height: Positive) -> float:
    """Saint-Venant's torsion constant J of a rectangle [m⁴].

    J = a b³ (1/3 - 64/π⁵ b/a Σ tanh(nπa/2b)/n⁵), n odd, a the longer side
    (Timoshenko & Goodier, Theory of Elasticity, section 109).

    Args:
        width: One side [m].
        height: The other side [m].
    """
    longer, shorter = max(width, height), min(width, height)
    n = np.arange(1, 40, 2, dtype=np.float64)
    series = np.sum(np.tanh(n * np.pi * longer / (2.0 * shorter)) / n**5)
    return float(longer * shorter**3 * (1 / 3 - 64.0 / np.pi**5 * shorter / longer * series))

"""When a TCA is harmed by a spine that will not give way.

Sun, dissertation, Colorado State University, Section 6.2.1: to go on contracting a TCA while the
spine becomes rigid damages it for good; to go on relaxing it does no harm but the held angle
becomes inaccurate. Stiffening is safe once the angle changes by less than 3° in 20 s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import Array, Checked, Numbers, Positive, door, flags, instance, number, within
from tca_mj.smp.material import SOFT_MODULUS, SmpSpec, SpineSpec

Flags = NDArray[np.bool_]

# A bending module is steady when it turns less than this, Sun, Section 6.2.1 [rad/s].
STEADY_RATE = math.radians(3.0) / 20.0


@dataclass(frozen=True, kw_only=True, slots=True)
class DamageSpec(Checked):
    """Bounds of the rule.

    Attributes:
        soft_modulus: The spine gives way below this modulus [Pa]. Sun, Section 6.1.3: 50 MPa,
            reached at 110 °C at the latest.
        rigid_modulus: From this modulus on the shape is fixed and a TCA may relax [Pa]; the
            default is that of ``SmpSpec()`` at 80 °C.
        steady_rate: Rate of bending, of the spine if it were soft, up to which a TCA is neither
            contracting nor relaxing [rad/s]. Sun, Section 6.2.1: 3° in 20 s.
        slack: Tension up to which a TCA is slack and can neither be harmed nor move anything,
            an estimate [N].

    Raises:
        ValueError: If a bound is not finite or not positive, or soft is not below rigid.
    """

    soft_modulus: Positive = SOFT_MODULUS
    rigid_modulus: Positive = 2.25e9
    steady_rate: Positive = STEADY_RATE
    slack: Positive = 1e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        number("soft_modulus", self.soft_modulus, below=self.rigid_modulus, unit="Pa")

    @classmethod
    @door
    def of(cls, smp: SmpSpec) -> DamageSpec:
        """Bounds for a material: rigid is its modulus at the lower end of its transition."""
        return cls(rigid_modulus=float(smp.modulus(smp.rigid_below)))


class Damage(NamedTuple):
    """What goes wrong, each array of booleans of shape (..., n).

    Attributes:
        damaged: A TCA contracts against a spine that is stiff: it takes permanent damage.
        inaccurate: A TCA relaxes while the spine stiffens: the shape is not the held one.
        hardening: The spine is between soft and rigid, and cooling.
    """

    damaged: Flags
    inaccurate: Flags
    hardening: Flags


@door
def soft_bending_rate(spine: SpineSpec, tension_rate: Numbers) -> Array:
    """How fast a TCA would bend the spine if it were soft: 2 a L/(E_r I) dF/dt [rad/s].

    That is the motion which the TCA is commanded to make, whatever the spine allows.

    Args:
        spine: The spine with both legs of its TCA.
        tension_rate: Rise of the tension of a leg at constant length, for example
            dF/dT times dT/dt, shape (..., n) [N/s].
    """
    stiffness = spine.smp.rubbery * spine.second_moment
    lever = 2.0 * spine.tca_offset * spine.length / stiffness
    return lever * tension_rate


def flag_damage(
    modulus: ArrayLike,
    cooling: ArrayLike,
    tension: ArrayLike,
    bending_rate: ArrayLike,
    spec: DamageSpec | None = None,
) -> Damage:
    """Applies the rule to n TCAs.

    A spine that is rigid, or stiff and getting hotter, counts as stiff: heating the TCA before
    the spine has softened strains it just as much.

    Args:
        modulus: Young's modulus of the spine, shape (..., n) [Pa].
        cooling: Whether the spine's temperature falls, shape (..., n).
        tension: Tension of the TCA, shape (..., n) [N].
        bending_rate: Rate at which the TCA would bend a soft spine (``soft_bending_rate``),
            positive when it contracts, shape (..., n) [rad/s].
        spec: Bounds.

    Returns:
        Flags, shape (..., n).

    Raises:
        ValueError: If a number is not finite.
    """
    spec = DamageSpec() if spec is None else spec
    instance("spec", spec, DamageSpec)
    modulus, rate = within("modulus", modulus), within("bending_rate", bending_rate)
    tension = within("tension", tension)
    taut, stiff = tension > spec.slack, modulus > spec.soft_modulus
    hardening = stiff & (modulus < spec.rigid_modulus) & flags("cooling", cooling)
    return Damage(
        damaged=damaging(modulus, tension, rate, spec),
        inaccurate=hardening & taut & (rate < -spec.steady_rate),
        hardening=hardening & np.ones_like(taut),
    )


def damaging(modulus: Array, tension: Array, bending_rate: Array, spec: DamageSpec) -> Flags:
    """Where a TCA is damaged; as ``flag_damage``, but nothing is checked."""
    contracting = (tension > spec.slack) & (bending_rate > spec.steady_rate)
    harmed: Flags = contracting & (modulus > spec.soft_modulus)
    return harmed

"""The constants of a TCA that measurements may identify, and how they are parametrised.

Only what enters the laws by itself is a constant here. The untwist is a product of inserted twist,
its scale and the growth of the fibre, so that the growths at 50 and 100 K above the reference are
fitted (they are read more easily than three coefficients, and are far less correlated) and the
twist is taken as counted. Softening and the filament's modulus are one rate; a heat capacity is
mass times ``specific_heat``. The coil's radius and the fibre's enter with fourth powers of
themselves beside the moduli: they are measured, not fitted, but a ruler's error may be stated.

All are positive and fitted as logarithms, but for the temperature of the surroundings. Before the
data each is known roughly: to a factor e^2 or so to both sides of where it starts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from tca_mj.checks import Finite, door, require_one_of
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.thread import FibreSpec

_FORCE_COLD = "force against stretch to half as long again or more, cold, or loads hung on it"
_STEP = "a step of power, or of voltage and current, with the temperature, until it is steady"


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant that measurements may identify.

    Attributes:
        unit: Its unit.
        meaning: What it is, in words.
        measurement: What identifies it, in words.
        width: How well it is known before any data: standard deviation of its logarithm, or, of
            a temperature, of itself; estimates [1 or K].
        own: Whether it is fitted without being asked for.
        log: Whether it is fitted as a logarithm.
        usual: Of one that may be 0, its size: where a fit starts if the TCA says 0, and what it is
            measured against; estimates [``unit``].
    """

    unit: str
    meaning: str
    measurement: str
    width: float = 1.0
    own: bool = True
    log: bool = True
    usual: float = 0.0


# The constants by name, in the order of reports.
CONSTANTS: Mapping[str, Constant] = MappingProxyType({
    "rest_length": Constant(
        "m", "natural length", "its length without load at the reference temperature", 0.5),
    "minimum_length": Constant(
        "m", "length at which the coils touch",
        "length against temperature without load until it shortens no more", 0.5),
    "young": Constant(
        "Pa", "Young's modulus", "force against stretch to twice as long or more, cold"),
    "shear": Constant("Pa", "shear modulus", _FORCE_COLD),
    "softening_rate": Constant(
        "1/K", "relative fall of both moduli per kelvin",
        "length against temperature under two or three loads, or force at two fixed lengths",
        usual=3e-4),
    "growth_50": Constant(
        "1", "growth of the fibre's radius 50 K above the reference, by its product with the"
        " inserted twist", "length against temperature from cold to hot, or force at a length"),
    "growth_100": Constant(
        "1", "the same 100 K above the reference", "the same up to 100 K above or more"),
    "resistance_per_length": Constant(
        "ohm/m", "resistance per natural length", "resistance against length"),
    "stretch_resistance": Constant(
        "1", "fall of the resistance per strain beyond the natural length",
        "resistance against length beyond the natural one", usual=0.15),
    "contraction_resistance": Constant(
        "1", "rise of the resistance per contraction below the natural length",
        "resistance against length below the natural one", usual=0.5),
    "specific_heat": Constant(
        "J/(kg K)", "heat capacity per mass, by its product with the mass", _STEP),
    "heat_loss": Constant("W/(m K)", "heat lost to the air per length of fibre", _STEP),
    "ambient": Constant("degC", "temperature of the surroundings", _STEP, 10.0, log=False),
    "body_conductance": Constant("W/(m K)", "conductance to the body round it", _STEP),
    "body_capacity": Constant(
        "J/(m K)", "heat capacity of the body round it", f"{_STEP}, some minutes long"),
    "body_loss": Constant(
        "W/(m K)", "heat lost by the body round it", f"{_STEP}, some minutes long"),
    "fibre_length": Constant("m", "length of the fibre", "a ruler, before winding", own=False),
    "radius": Constant("m", "radius of the fibre", "a micrometer or microscope", own=False),
    "coil_radius": Constant("m", "radius of the coil", "outer diameter, or turns", own=False),
    "inserted_twist": Constant("rad/m", "inserted twist", "counted while twisting", own=False),
    "line_density": Constant("kg/m", "mass per length of the fibre", "a balance", own=False),
})  # fmt: skip

# The linear model of Sun, eqs. (2.1) and (2.2), F = k (l - l_n) + k (contraction by heat), with the
# contraction as a polynomial of second order, and the contact as a least length.
LINEAR: Mapping[str, Constant] = MappingProxyType({
    "linear_length": Constant("m", "natural length l_n", "", 0.5),
    "linear_stiffness": Constant("N/m", "stiffness k", "", 2.0),
    "linear_contraction_50": Constant("m", "contraction at 50 K", "", 1.0),
    "linear_contraction_100": Constant("m", "contraction at 100 K", "", 1.0),
    "linear_shortest": Constant("m", "least length", "", 0.5),
})  # fmt: skip
MECHANICAL = ("rest_length", "minimum_length", "young", "shear", "softening_rate", "growth_50",
              "growth_100", "fibre_length", "radius", "coil_radius", "inserted_twist")  # fmt: skip

_FIBRE = ("young", "shear", "radius", "inserted_twist", "line_density", "specific_heat")
_OWN = ("resistance_per_length", "stretch_resistance", "contraction_resistance", "heat_loss",
        "ambient")  # fmt: skip
_BODY = {"body_conductance": "conductance", "body_capacity": "capacity", "body_loss": "loss"}


@door
def constants_of(tca: TcaSpec) -> dict[str, float]:
    """The constants that a TCA has, by name; those of a body only if it lies in one.

    Args:
        tca: The TCA.
    """
    a2, a1 = tca.fibre.growth
    found = {name: getattr(tca.fibre, name) for name in (*_FIBRE, "softening_rate")}
    found |= {name: getattr(tca, name) for name in (*_OWN, "fibre_length", "coil_radius")}
    found |= {"rest_length": tca.rest_length, "minimum_length": tca.minimum_length}
    found |= {f"growth_{x}": (a1 + a2 * x) * x for x in (50, 100)}
    if tca.body is not None:
        found |= {name: getattr(tca.body, of) for name, of in _BODY.items()}
    return {name: found[name] for name in CONSTANTS if name in found}


@door
def with_constants(tca: TcaSpec, values: Mapping[str, Finite]) -> TcaSpec:
    """The same TCA with some constants changed; what is not named stays, bit for bit.

    Another natural length keeps the turns, unless the coil's radius is changed, too.

    Args:
        tca: The TCA.
        values: Values by the names in ``CONSTANTS``, in their units.

    Raises:
        ValueError: If there is no such constant or no such TCA.
    """
    for name in values:
        require_one_of("name of a constant", name, tuple(CONSTANTS))
    fibre: dict[str, Any] = {name: values[name] for name in _FIBRE if name in values}
    if "softening_rate" in values:
        fibre["softening"] = values["softening_rate"] * tca.fibre.filament_young
    if "growth_50" in values or "growth_100" in values:
        fibre["expansion"] = _expansion(tca.fibre, {**constants_of(tca), **values})
    own: dict[str, Any] = {name: values[name] for name in _OWN if name in values}
    shaped = {"rest_length", "minimum_length", "fibre_length"} & set(values)
    if shaped:
        long = values.get("fibre_length", tca.fibre_length)
        along = values.get("rest_length", tca.rest_length) / math.cos(tca.lay_angle)
        wound = along * math.sin(tca.lay_angle)
        shortest = values.get("minimum_length", tca.minimum_length)
        rest, touching = along / long, math.hypot(shortest, wound) / long
        if not 0.0 < touching < rest < 1.0:
            raise ValueError(
                "minimum_length and rest_length over fibre_length must rise from 0 to 1, got"
                f" {touching} and {rest}"
            )
        pitch = math.asin(rest)
        own |= {"fibre_length": long, "pitch_angle": pitch,
                "minimum_pitch_angle": math.asin(touching),
                "coil_radius": math.cos(pitch) / tca.winding}  # fmt: skip
    if "coil_radius" in values:
        own["coil_radius"] = values["coil_radius"]
    body = {of: values[name] for name, of in _BODY.items() if name in values}
    if body and tca.body is not None:
        own["body"] = replace(tca.body, **body)
    return replace(tca, fibre=replace(tca.fibre, **fibre), **own)


def _expansion(fibre: FibreSpec, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Coefficients of Gamma with two growths above the reference temperature."""
    g50, g100, t0 = values["growth_50"], values["growth_100"], fibre.reference_temperature
    a1, a2 = (4.0 * g50 - g100) / 100.0, (g100 - 2.0 * g50) / 5000.0
    return a2, a1 - 2.0 * a2 * t0, 1.0 - a1 * t0 + a2 * t0 * t0


def known_of(name: str) -> Constant:
    """The constant of a name, of a TCA or of the linear model."""
    return CONSTANTS[name] if name in CONSTANTS else LINEAR[name]


def encoded(name: str, value: float) -> float:
    """The number that is fitted for a constant.

    Raises:
        ValueError: If the constant must be positive and is not.
    """
    if not known_of(name).log:
        return value
    value = value or known_of(name).usual
    if not value > 0.0:
        raise ValueError(f"{name} must be above 0 where the fit starts, got {value}")
    return math.log(value)


def decoded(name: str, number: float) -> float:
    """The constant for a number that was fitted; OverflowError if there is none."""
    return math.exp(number) if known_of(name).log else number

"""Length of a TCA under a load, and tension at a length: three models side by side.

    model       what it is                                             file
    "rod"       Cosserat rod as a uniform helix, exact                  coil.py
    "love"      torsion and bending only, Love's equation               love.py
    "cst"       Castigliano's two coefficients, three schemes           castigliano.py

All use the same untwist, the same softening by heat and load, a cold or hot section as the
fibre says, and the same contact of the coils, that of ``CoilRods``: from ``minimum_length`` on
downwards a spring of ``contact_ratio`` times the stiffness of the cold coil with locked ends,
which sets in over ``contact_smoothing`` of that length. Every TCA's reference, where it is free of
stress at the reference temperature, is the shape that its spec states (``pitch_angle``,
``coil_radius``), under any load. For a TCA that has crept under a load state the crept pitch:
``tca.of_pitch(...)``.

An end is "free" to spin about the axis (a hanging weight) or "locked" (glued). That is 13 to
22 % of the stroke. Love's equation has locked ends; with ``spin="free"`` the model "love" is the
rod without shear and stretch, which is what is left of it without that assumption.

A fibre stiffer in shear than in stretch (G > E), which no thread is, can make a coil that snaps
between several lengths; then one of them is returned, or ``CoilSolveError`` raised.

Loads above ``breaking_force`` and temperatures outside ``fibre.temperature_range`` are computed:
the laws extrapolate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from tca_mj.checks import (
    Array,
    NotNegative,
    Positive,
    Temperature,
    door,
    require_one_of,
    within,
)
from tca_mj.tca.laws.castigliano import Scheme
from tca_mj.tca.laws.coil import Spin
from tca_mj.tca.laws.model import CoilModel, Model
from tca_mj.tca.laws.plies import across, along, joined
from tca_mj.tca.laws.roots import CoilSolveError
from tca_mj.tca.spec import TcaSpec

Ends = tuple[float, float]
_CHUNK = 4096  # elements solved at a time: what fits into a processor's cache
# Of wound strands the load sets the angle and the angle their share of it: how often that is tried,
# and by how much its cosine may still change.
_TURNS, _SETTLED = 100, 1e-13


@door
def hanging_length(
    tca: TcaSpec,
    temperature: ArrayLike,
    load: ArrayLike,
    *,
    model: Model = "rod",
    spin: Spin | None = None,
    scheme: Scheme = "implicit",
) -> Array:
    """Length at which a TCA carries a load [m], in the broadcast shape.

    Args:
        tca: The TCA.
        temperature: Below the fibre's melting, broadcast with ``load`` [°C].
        load: Axial force, not negative, any shape [N].
        model: "rod", "love" or "cst".
        spin: Whether an end is "free" to spin or both are "locked"; None as
            the model's own equations: "locked" for "love", else "free".
        scheme: Where "cst" takes its coefficients: at the natural shape
            ("linear"), the deformed one ("implicit"), on the way ("path").

    Raises:
        ValueError: If an argument is out of range, or leaves no modulus or no
            helix, or stretches the coil beyond 98 % of the fibre's length.
        CoilSolveError: If the shape is not found.
    """
    if spin is None:
        spin = "locked" if model == "love" else "free"
    problem = _checked_model(tca, model, spin, scheme)
    load = within("load", load, at_least=0.0, unit="N")

    def hang(temperature: Array, load: Array) -> tuple[Array]:
        each, share, off = load / tca.strands, np.array(math.cos(tca.lay_angle)), math.inf
        for _ in range(_TURNS):
            strand = problem.hang(temperature, each / share)
            length = across(strand, tca.wound)
            off = float(np.max(np.abs(length / strand - share), initial=0.0))
            if tca.wound == 0.0 or off <= _SETTLED:
                return (length,)
            share = length / strand
        raise CoilSolveError(off)

    (length,) = _in_chunks(hang, _checked(tca, temperature), load)
    return length


@door
def tension(
    tca: TcaSpec,
    length: ArrayLike,
    temperature: ArrayLike,
    *,
    model: Model = "rod",
    spin: Spin = "locked",
    scheme: Scheme = "implicit",
) -> tuple[Array, Array]:
    """Tension of a TCA at a length, and its slope: the inverse of ``hanging_length``.

    Ends are locked unless stated otherwise, as in a body; state the same ``spin`` as for
    ``hanging_length`` to get its inverse. For "rod" with locked ends this is ``coil_tension``.

    Args:
        tca: The TCA.
        length: Length between the ends, any shape, broadcast with ``temperature`` [m].
        temperature: Temperature, any shape [°C].
        model: "rod", "love" or "cst".
        spin: Whether an end is "free" to spin or both are "locked".
        scheme: As in ``hanging_length``.

    Returns:
        Tension F, not clipped: negative when the coil is pushed [N], and stiffness dF/dl at
        constant temperature [N/m], each of the broadcast shape.

    Raises:
        ValueError: If a length is outside half of the minimum length to 98 % of the fibre's; if a
            temperature is not above absolute zero and below the fibre's melting temperature, or
            leaves no modulus or no helix; if a name is unknown.
        CoilSolveError: If the shape is not found.
    """
    law, (shortest, longest) = _law(tca, _checked_model(tca, model, spin, scheme))
    length = within("length", length, at_least=shortest, at_most=longest, unit="m")
    force, stiffness = _in_chunks(law, length, _checked(tca, temperature))
    return force, stiffness


@door
def pulling_temperature(
    tca: TcaSpec, length: Positive, force: NotNegative, *, hottest: Temperature = 180.0
) -> float:
    """Temperature at which a TCA of a length pulls with a force; the inverse of ``tension``.

    Args:
        tca: The TCA, whose ends are locked, as in a body.
        length: Its length [m].
        force: Its tension [N].
        hottest: Temperature from which on there is none [°C]. Sun, Table 2.1, anneals at 180 °C.

    Returns:
        The temperature, not below that of the surroundings [°C].

    Raises:
        ValueError: If the length is out of range, or the TCA pulls less even when it is hottest.
        CoilSolveError: As ``tension``.

    Example:
        >>> from tca_mj.tca import CATALOGUE, pulling_temperature
        >>> tca = CATALOGUE["free-stroke"]
        >>> print(f"{pulling_temperature(tca, 1.2 * tca.rest_length, 0.354):.0f} °C")
        100 °C
    """

    def over(temperature: float) -> float:
        return float(tension(tca, length, temperature)[0]) - force

    if over(tca.ambient) >= 0.0:
        return tca.ambient
    most = over(hottest)
    if most < 0.0:
        raise ValueError(
            f"force must be at most {force + most:.4g} N, what the TCA pulls with at"
            f" {hottest:g} °C, got {force:.4g}"
        )
    return float(brentq(over, tca.ambient, hottest, xtol=1e-6))


@door
def law_at(
    tca: TcaSpec,
    temperature: float,
    *,
    spin: Spin = "locked",
    model: Model = "rod",
    scheme: Scheme = "implicit",
) -> Callable[[ArrayLike], tuple[Array, Array]]:
    """What a body feels of a TCA that is kept at a temperature: max(0, F) over the length.

    Args:
        tca: The TCA.
        temperature: Its temperature [°C].
        spin: As in ``tension``.
        model: As in ``tension``.
        scheme: As in ``hanging_length``.

    Returns:
        A function of the length [m], of any shape, that gives the tension [N], never negative,
        and its slope [N/m], both of that shape. Slack, also where the coils would push each
        other, both are 0. It raises ValueError for a length that is not between 0 and 98 % of the
        fibre's, and CoilSolveError as ``tension``.

    Raises:
        ValueError: As ``tension``, or if coils that are pressed to half of the minimum length
            still pull.

    Example:
        >>> from tca_mj.tca import CATALOGUE, law_at
        >>> tca = CATALOGUE["free-stroke"]
        >>> force, slope = law_at(tca, 100.0)(1.2 * tca.rest_length)
        >>> print(f"{force:.3f} N, {slope:.1f} N/m")
        0.354 N, 20.0 N/m
    """
    pull, (shortest, longest) = _law(tca, _checked_model(tca, model, spin, scheme))
    hot = _checked(tca, temperature, ())
    pressed, _ = pull(np.array([shortest]), hot[None])
    if pressed[0] > 0.0:
        raise ValueError(
            f"contact_ratio must be larger for {temperature} °C, where the coils pull with"
            f" {pressed[0]} N at half of their minimum length, got {tca.contact_ratio}"
        )

    def law(length: ArrayLike) -> tuple[Array, Array]:
        length = within("length", length, at_least=0.0, at_most=longest, unit="m")
        inside = np.maximum(length.ravel(), shortest)
        force, slope = pull(inside, np.broadcast_to(hot, inside.shape))
        taut = (force > 0.0).reshape(length.shape)
        force, slope = force.reshape(length.shape), slope.reshape(length.shape)
        return np.where(taut, force, 0.0)[()], np.where(taut, slope, 0.0)[()]

    return law


def _checked_model(tca: TcaSpec, model: Model, spin: Spin, scheme: Scheme) -> CoilModel:
    require_one_of("model", model, get_args(Model))
    require_one_of("spin", spin, get_args(Spin))
    require_one_of("scheme", scheme, get_args(Scheme))
    return CoilModel.of(tca.strand, model, spin, scheme)


def _law(tca: TcaSpec, problem: CoilModel) -> tuple[Callable[[Array, Array], Any], Ends]:
    """Tension and slope of a TCA by the model of its strands, and between which lengths."""
    if tca.plies is None:
        return problem.tension, problem.domain
    wound, (shortest, longest) = tca.wound, problem.domain

    def law(length: Array, temperature: Array) -> tuple[Array, Array]:
        strand = along(length, wound)
        inside = np.clip(strand, shortest, longest)  # but for rounding
        return joined(length, strand, *problem.tension(inside, temperature), tca.strands)

    ends = across(np.maximum(problem.domain, wound), wound)
    return law, (float(ends[0]), float(ends[1]))


def _checked(tca: TcaSpec, temperature: ArrayLike, shape: tuple[int, ...] | None = None) -> Array:
    """Temperatures [°C] at which there is a fibre."""
    melting = tca.fibre.melting_temperature
    return within("temperature", temperature, above=-273.15, below=melting, unit="°C", shape=shape)


def _in_chunks(solve: Callable[..., tuple[Array, ...]], *arrays: Array) -> list[Array]:
    """What a solver of one dimension gives for arrays of any shape, broadcast together."""
    first, *_ = every = np.broadcast_arrays(*arrays)
    parts = [
        solve(*[array.ravel()[begin : begin + _CHUNK] for array in every])
        for begin in range(0, max(first.size, 1), _CHUNK)
    ]
    return [np.concatenate(part).reshape(first.shape)[()] for part in zip(*parts, strict=True)]

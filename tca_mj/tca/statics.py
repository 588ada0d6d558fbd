"""Length of a TCA under a load, and tension at a length: three models side by side.

    model       what it is                                             file
    "rod"       Cosserat rod as a uniform helix, exact                  laws.py
    "love"      torsion and bending only, Love's equation               laws.py
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

Loads above ``breaking_force`` and temperatures outside ``fibre.temperature_range`` are computed
(the laws extrapolate); ``beyond_breaking`` and ``outside_fit`` tell which they are.
"""

from collections.abc import Callable
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.checks import floats
from tca_mj.tca.balance import Balance, Model
from tca_mj.tca.castigliano import Scheme
from tca_mj.tca.laws import Array, Spin
from tca_mj.tca.spec import TcaSpec

_CHUNK = 4096  # elements solved at a time: what fits into a processor's cache


def hanging_length(
    tca: TcaSpec,
    temperature: ArrayLike,
    load: ArrayLike,
    *,
    model: Model = "rod",
    spin: Spin | None = None,
    scheme: Scheme = "implicit",
) -> Array:
    """Length at which a TCA carries a load.

    Args:
        tca: The TCA.
        temperature: Temperature, any shape, broadcast with ``load`` [°C].
        load: Axial force, not negative, any shape [N].
        model: "rod", "love" or "cst".
        spin: Whether an end is "free" to spin or both are "locked". None is what the model's own
            equations assume: "locked" for "love", "free" for the others.
        scheme: Where "cst" takes its coefficients: at the natural shape ("linear"), at the
            deformed one ("implicit") or along the way ("path"). The other models ignore it.

    Returns:
        Length between the ends, the broadcast shape [m].

    Raises:
        ValueError: If a load is negative or needs a length beyond 98 % of the fibre's, or leaves
            no modulus; if a temperature is not above absolute zero and below the fibre's
            melting temperature, or leaves no modulus or no helix; if a name is unknown.
        CoilSolveError: If the shape is not found.
    """
    if spin is None:
        spin = "locked" if model == "love" else "free"
    problem = _checked_model(tca, model, spin, scheme)
    temperature, load = _broadcast(temperature=temperature, load=load)
    _check_temperature(tca, temperature)
    _check("load", load, "N", 0.0, np.inf)
    length = np.empty(load.size)
    flat_t, flat_f = temperature.ravel(), load.ravel()
    for begin in range(0, load.size, _CHUNK):
        part = slice(begin, begin + _CHUNK)
        length[part] = problem.hang(flat_t[part], flat_f[part])
    return length.reshape(load.shape)[()]


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
    problem = _checked_model(tca, model, spin, scheme)
    length, temperature = _broadcast(length=length, temperature=temperature)
    _check_temperature(tca, temperature)
    _check("length", length, "m", problem.shortest, problem.longest)
    force, stiffness = np.empty(length.size), np.empty(length.size)
    flat_l, flat_t = length.ravel(), temperature.ravel()
    for begin in range(0, length.size, _CHUNK):
        part = slice(begin, begin + _CHUNK)
        force[part], stiffness[part] = problem.pull(flat_l[part], flat_t[part])
    return force.reshape(length.shape)[()], stiffness.reshape(length.shape)[()]


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
    """
    problem = _checked_model(tca, model, spin, scheme)
    hot = floats("temperature", temperature)
    if hot.ndim:
        raise ValueError(f"temperature has shape {hot.shape}; it must be one number")
    _check_temperature(tca, hot)
    pressed, _ = tension(tca, problem.shortest, hot, model=model, spin=spin, scheme=scheme)
    if pressed > 0.0:
        raise ValueError(
            f"at {temperature} °C the coils pull with {pressed} N at half of their minimum length; "
            f"contact_ratio = {tca.contact_ratio} must be larger"
        )

    def law(length: ArrayLike) -> tuple[Array, Array]:
        length = floats("length", length)
        _check("length", length, "m", 0.0, problem.longest)
        inside = np.maximum(length.ravel(), problem.shortest)
        force, slope = problem.pull(inside, np.broadcast_to(hot, inside.shape))
        taut = (force > 0.0).reshape(length.shape)
        force, slope = force.reshape(length.shape), slope.reshape(length.shape)
        return np.where(taut, force, 0.0)[()], np.where(taut, slope, 0.0)[()]

    return law


def beyond_breaking(tca: TcaSpec, load: ArrayLike) -> NDArray[np.bool_]:
    """Whether a load [N] is above ``tca.breaking_force``, same shape; nothing is clipped.

    What is not a number counts as above.
    """
    return ~(floats("load", load) <= tca.breaking_force)


def outside_fit(tca: TcaSpec, temperature: ArrayLike) -> NDArray[np.bool_]:
    """Whether a temperature [°C] is outside ``tca.fibre.temperature_range``, same shape.

    The laws of untwist and softening were measured inside that range and extrapolate outside.
    """
    low, high = tca.fibre.temperature_range
    temperature = floats("temperature", temperature)
    return ~((temperature >= low) & (temperature <= high))


def _checked_model(tca: TcaSpec, model: Model, spin: Spin, scheme: Scheme) -> Balance:
    for name, value, choice in (("model", model, Model), ("spin", spin, Spin),
                                ("scheme", scheme, Scheme)):  # fmt: skip
        if value not in get_args(choice):
            raise ValueError(f"{name} = {value!r} must be one of {get_args(choice)}")
    return Balance.of(tca, model, spin, scheme)


def _broadcast(**arrays: ArrayLike) -> tuple[Array, Array]:
    (name1, first), (name2, second) = (
        (name, floats(name, array)) for name, array in arrays.items()
    )
    try:
        first, second = np.broadcast_arrays(first, second)
    except ValueError as error:
        raise ValueError(
            f"{name1} has shape {first.shape}, {name2} {second.shape}; they must broadcast"
        ) from error
    return first, second


def _check(name: str, values: Array, unit: str, low: float, high: float) -> None:
    inside = (values >= low) & (values <= high) & np.isfinite(values)
    if not inside.all():
        worst = values[~inside].flat[0]
        raise ValueError(
            f"{name} = {worst} {unit} must be finite and lie in {low} to {high} {unit}"
        )


def _check_temperature(tca: TcaSpec, values: Array) -> None:
    high = tca.fibre.melting_temperature
    inside = (values > -273.15) & (values < high)
    if not inside.all():
        worst = values[~inside].flat[0]
        raise ValueError(
            f"temperature = {worst} °C must lie strictly between -273.15 and {high} °C"
        )

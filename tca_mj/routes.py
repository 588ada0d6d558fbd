"""Curves along which a TCA is laid in a soft body.

A route is a tuple of *legs*. A leg is a curve in the body frame, given by its offset from the
centre line as a function of s, which runs from 0 at the body's base to 1 at its tip. The TCA
follows the first leg from base to tip, the second one from tip to base, and so on; between two
legs it crosses over inside the end section. One TCA has one tension, the same in all its legs.

Body frame: z along the centre line from base to tip, x and y in the cross-section.
"""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, Protocol

import numpy as np

from tca_mj.checks import (
    Angle,
    Array,
    Checked,
    NotNegative,
    Numbers,
    Positive,
    Share,
    Triple,
    door,
    number,
    quantity,
    whole,
)
from tca_mj.hints import size

_radius = partial(size, kind="soft bodies", at_least=0.0, at_most=1.0)
MOST_TCAS = 100  # side by side: at a width of 1.3 mm they would fill a circle of 40 mm
MOST_TURNS = 1000.0  # in one body: as close as TCAs lie, they would fill more than a metre

TcaCount = Annotated[int, partial(whole, at_least=1, at_most=MOST_TCAS)]
Turns = Annotated[float, partial(quantity, at_least=-MOST_TURNS, at_most=MOST_TURNS)]


@dataclass(frozen=True, slots=True)
class Helix(Checked):
    """A TCA wound round the centre line; ``turns=0`` gives the parallel route.

    Attributes:
        radius: Distance to the centre line, not negative [m].
        turns: Number of turns over the whole body, at most 1000; positive is right-handed.
        phase: Angle at the base, from the cross-section's x axis towards y [rad].

    Raises:
        ValueError: If a number is not finite or out of range.

    Example:
        >>> from tca_mj import Helix
        >>> Helix(4e-3, turns=0.25).offset([0.0, 1.0]).round(4)  # at both ends [m]
        array([[0.004, 0.   ],
               [0.   , 0.004]])
    """

    radius: Annotated[float, _radius]
    turns: Turns = 0.0
    phase: Angle = 0.0

    @property
    def legs(self) -> tuple[Helix, ...]:
        """The route as a tuple of legs: a helix is its own single leg."""
        return (self,)

    @door
    def offset(self, s: Numbers) -> Array:
        """Offset from the centre line at ``s`` in [0, 1], shape (..., 2) [m]."""
        angle = self.phase + 2.0 * np.pi * self.turns * s
        return self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    @door
    def slope(self, s: Numbers) -> Array:
        """Derivative of the offset by ``s``, shape (..., 2) [m]."""
        rate = 2.0 * np.pi * self.turns
        angle = self.phase + rate * s
        return self.radius * rate * np.stack([-np.sin(angle), np.cos(angle)], axis=-1)

    @door
    def between(self, start: Share, end: Share) -> Helix:
        """The part of it from ``start`` to ``end`` in [0, 1], for a body of that part's length."""
        phase = self.phase + 2.0 * np.pi * self.turns * start
        return replace(self, turns=self.turns * (end - start), phase=phase)


@dataclass(frozen=True, slots=True)
class UTurn(Checked):
    """One TCA folded in half: out along one leg, back along another one.

    Two parallel legs make the U of a bending finger, two helices of the same hand the double
    helix of a twisting module.

    Attributes:
        out: The leg from base to tip.
        back: The leg from tip to base, also described from base to tip.

    Raises:
        ValueError: If a leg is no ``Helix``.
    """

    out: Helix
    back: Helix

    @property
    def legs(self) -> tuple[Helix, ...]:
        """The two legs, in the order in which the TCA follows them."""
        return (self.out, self.back)

    @classmethod
    @door
    def parallel(cls, offset: float, half_width: float, direction: float = 0.0) -> UTurn:
        """A U of two straight legs.

        Args:
            offset: Distance of the plane of the U from the centre line [m].
            half_width: Half the distance between the legs, not negative [m].
            direction: Angle of the offset, from x towards y [rad].

        Raises:
            ValueError: If the half width is negative.
        """
        number("half_width", half_width, at_least=0.0, unit="m")
        radius, angle = float(np.hypot(offset, half_width)), float(np.arctan2(half_width, offset))
        return cls(Helix(radius, phase=direction - angle), Helix(radius, phase=direction + angle))

    @classmethod
    @door
    def double_helix(cls, radius: NotNegative, turns: Turns, phase: Angle = 0.0) -> UTurn:
        """A TCA folded in half and wound as two helices of ``turns`` turns, half a turn apart."""
        return cls(Helix(radius, turns, phase), Helix(radius, turns, phase + np.pi))


class Route(Protocol):
    """Anything that can say which legs it has."""

    @property
    def legs(self) -> tuple[Helix, ...]:
        """Legs in the order in which the TCA follows them, alternately up and down the body."""


def require_route(name: str, route: Any) -> Any:
    """A route, as it is.

    Args:
        name: What it is called, for the message.
        route: The route.

    Raises:
        ValueError: If it has no legs; that several routes are none is said, too.
    """
    if tuple(getattr(route, "legs", ())):
        return route
    several = isinstance(route, Sequence) and any(hasattr(each, "legs") for each in route)
    hint = "; these are several, one for each TCA, as parallel(...) gives them" if several else ""
    raise ValueError(
        f"{name} must be a Helix or a UTurn, or have legs of its own, got {reprlib.repr(route)}"
        f"{hint}"
    )


AnyRoute = Annotated[Route, require_route]


@door
def parallel(count: TcaCount, radius: NotNegative, phase: Angle = 0.0) -> tuple[Helix, ...]:
    """Routes of ``count`` straight TCAs at equal angles round the centre line.

    Args:
        count: Number of TCAs, 1 to 100.
        radius: Their distance to the centre line, not negative [m].
        phase: Angle of the first one, from the cross-section's x axis towards y [rad].

    Raises:
        ValueError: If a number is out of range.

    Example:
        >>> from tca_mj import parallel
        >>> [round(route.phase, 2) for route in parallel(3, 4e-3)]
        [0.0, 2.09, 4.19]
    """
    return tuple(Helix(radius, phase=phase + 2.0 * np.pi * i / count) for i in range(count))


@door
def leg_length(
    leg: Any, body_length: Positive, curvature: Triple = (0.0, 0.0, 0.0),
    points: Annotated[int, partial(whole, at_least=2, at_most=1_000_000)] = 513,
) -> float:  # fmt: skip
    """Length of a leg in a body of uniform reference curvature.

    Integrates |w|, w = e_z + u x r + r', the tangent of the leg per length of the centre line
    (kinematics of an off-centre curve in a Cosserat rod).

    Args:
        leg: The leg.
        body_length: Length of the centre line [m].
        curvature: Reference curvature u of the body in its own frame, shape (3,) [1/m].
        points: Number of points of the trapezoid rule, 2 to a million.

    Returns:
        Path length [m].

    Raises:
        ValueError: If ``leg`` is a whole route or several, or a number out of range.
    """
    if not hasattr(leg, "slope"):
        legs = len(require_route("leg", leg).legs)
        raise ValueError(f"leg must be one leg, got a route with {legs}: add up those of its legs")
    s = np.linspace(0.0, 1.0, points)
    r = leg.offset(s)
    slope = leg.slope(s) / body_length
    u = curvature
    (x, y), (dx, dy) = r.T, slope.T
    w = np.stack([dx - u[2] * y, dy + u[2] * x, 1.0 + u[0] * y - u[1] * x], axis=-1)
    return float(np.trapezoid(np.linalg.norm(w, axis=-1), s) * body_length)

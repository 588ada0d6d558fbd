"""The question that every static solver of soft bodies answers: bodies, strands and loads."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from numbers import Integral
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, Checked, NotNegative, Positive, Triple, number, within
from tca_mj.rod.beam import BeamSpec
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.lie import matrix_quaternion
from tca_mj.routes import AnyRoute, require_route

_PROBES = (np.arange(512) + 0.5) / 512  # where a leg of a route is tried
_OFF = 0.1  # part of a leg's way in the section by which its slope may miss it at the probes


class StrandLaw(Protocol):
    """How hard a strand pulls: a TCA at some temperature, an elastic cord."""

    def __call__(self, length: float, /) -> tuple[Any, Any]:
        """Tension, never below 0 [N], and its slope, never below 0 [N/m], at a length [m]: numbers.

        The length is that of the whole route, all legs together.
        """


@dataclass(frozen=True, kw_only=True, slots=True)
class Spring(Checked):
    """A straight spring that cannot push, like a rubber band, from the world to a body's tip.

    Attributes:
        stiffness: Force over what it is longer than slack [N/m].
        length: Length at which it is slack [m].
        start: Where it is fixed in the world [m].
        end: Where it is fixed in the tip's frame [m].

    Raises:
        ValueError: If a number is out of range.
    """

    stiffness: Positive
    length: NotNegative
    start: Triple = (0.0, 0.0, 0.0)
    end: Triple = (0.0, 0.0, 0.0)

    def pull(self, way: ArrayLike) -> Array:
        """Force on its end [N].

        Args:
            way: From its start to its end, shape (3,) [m].

        Returns:
            The force, shape (3,); none where it is slack.

        Raises:
            ValueError: If the shape is wrong or a number not finite.
        """
        way = within("way", way, shape=(3,))
        long = float(np.linalg.norm(way))
        more = max(0.0, long - self.length)
        return -self.stiffness * more / long * way if more else np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class Segment(Checked):
    """One soft body of several, its strands and what is rigid at its two ends.

    Attributes:
        beam: The body, with the base's z axis along its centre line.
        routes: Routes of the k strands, which are weightless.
        tensions: For each of them its tension, at least 0 [N], or its law.
        rotation: Axes of the base, as columns, in the frame of the tip that it stands on (of the
            world if it stands there), shape (3, 3) [1].
        offset: Position of the base in that frame, shape (3,) [m].
        mass: Rigid mass at the tip [kg].
        centre: Centre of that mass in the tip's frame, shape (3,) [m].
        strands: Names of the strands, all different. Routes of the same name in several segments
            are one strand, with one tension, whose law is asked for the length of all of them.
            None if every route is a strand of its own.
        base: Number of the segment on whose tip it stands, -1 for the world; None for the segment
            before it, and the world for the first.
        springs: Springs that pull on its tip.
        start: Curvature, shape (3,) [1/m], with which the body sets out on the path of loads, to
            come to its own one on the way: it tells which of several states is meant. None for its
            own from the start.

    Raises:
        ValueError: If a shape is wrong, a number not finite, a tension or mass negative, the
            rotation no rotation, a route has no legs of the expected form, or a strand's name comes
            twice.
    """

    beam: BeamSpec
    routes: Sequence[AnyRoute]
    tensions: Sequence[float | StrandLaw]
    _: KW_ONLY
    rotation: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    offset: ArrayLike = (0.0, 0.0, 0.0)
    mass: NotNegative = 0.0
    centre: ArrayLike = (0.0, 0.0, 0.0)
    strands: Sequence[Hashable] | None = None
    base: int | None = None
    springs: tuple[Spring, ...] = ()
    start: Triple | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        object.__setattr__(self, "routes", _tuple("routes", self.routes))
        object.__setattr__(self, "tensions", _tuple("tensions", self.tensions))
        if len(self.tensions) != len(self.routes):
            raise ValueError(
                f"tensions must be one per route, {len(self.routes)}, got {len(self.tensions)}"
            )
        for i, tension in enumerate(self.tensions):
            if not callable(tension):
                number(f"tensions[{i}]", tension, at_least=0.0, unit="N")
        for i, route in enumerate(self.routes):
            _require_legs(f"routes[{i}]", route)
        if self.strands is not None:
            object.__setattr__(self, "strands", _tuple("strands", self.strands))
            same = len(self.routes) == len(self.strands) == len(set(self.strands))
            if not (same and all(name == name for name in self.strands)):
                raise ValueError(
                    f"strands must be {len(self.routes)} different names, one per route, got"
                    f" {self.strands}"
                )
        _keep(self, (3, 3), "rotation")
        matrix_quaternion(self.rotation)  # raises unless it is a rotation
        _keep(self, (3,), "offset", "centre")


@dataclass(frozen=True, slots=True, eq=False)
class StaticProblem:
    """Segments on each other, the first one clamped to the world, under dead loads.

    Attributes:
        segments: At least one, each after that which it stands on.
        tip_force: Force on the last segment's tip, world frame, shape (3,) [N].
        tip_moment: Moment on it, world frame, shape (3,) [N m].
        gravity: Acceleration of gravity, world frame, shape (3,) [m/s²]. It acts on the bodies'
            line densities and the rigid masses.
        shearable: Whether sections shear; without, the linear strain is (0, 0, v3).
        bases: Number of the segment that each stands on, -1 for the world.
        strands: Numbers of the strands of each segment, counted in the order of the segments.
        tensions: Tension or law of each strand, in the order of their numbers.

    Raises:
        ValueError: If there is no segment, a shape is wrong or a number not finite, a segment
            stands on none before it, a strand has two tensions, or a spring pulls where another
            segment stands.
    """

    segments: Sequence[Segment]
    tip_force: ArrayLike = (0.0, 0.0, 0.0)
    tip_moment: ArrayLike = (0.0, 0.0, 0.0)
    gravity: ArrayLike = (0.0, 0.0, 0.0)
    shearable: bool = True
    bases: tuple[int, ...] = field(init=False)
    strands: tuple[tuple[int, ...], ...] = field(init=False)
    tensions: tuple[float | StrandLaw, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", _tuple("segments", self.segments))
        if not self.segments or not all(isinstance(each, Segment) for each in self.segments):
            raise ValueError(f"segments must be at least one Segment, got {self.segments!r}")
        _keep(self, (3,), "tip_force", "tip_moment", "gravity")
        if not isinstance(self.shearable, bool | np.bool_):
            raise ValueError(f"shearable must be True or False, got {self.shearable!r}")
        bases = tuple(i - 1 if s.base is None else s.base for i, s in enumerate(self.segments))
        for i, base in enumerate(bases):
            if not isinstance(base, Integral) or not -1 <= base < i:
                raise ValueError(
                    f"base of segments[{i}] must be None, or a whole number from -1 to {i - 1},"
                    f" got {base!r}"
                )
            if base >= 0 and self.segments[base].springs:
                raise ValueError(
                    f"springs of segments[{base}] must be none where segments[{i}] stands on it"
                )
        known: dict[Hashable, int] = {}
        tensions: list[float | StrandLaw] = []
        for i, segment in enumerate(self.segments):
            for strand, tension in zip(_names(i, segment), segment.tensions, strict=True):
                first = known.setdefault(strand, len(known))
                if first == len(tensions):
                    tensions.append(tension)
                elif tension is not tensions[first] and tension != tensions[first]:
                    raise ValueError(
                        f"tensions of the strand {strand!r} must be one in all segments, got"
                        f" {tensions[first]!r} and {tension!r}"
                    )
        strands = tuple(
            tuple(known[strand] for strand in _names(i, segment))
            for i, segment in enumerate(self.segments)
        )
        for name, value in (("bases", bases), ("strands", strands), ("tensions", tuple(tensions))):
            object.__setattr__(self, name, value)


def asked(strand: int, law: float | StrandLaw, length: float) -> tuple[float, float]:
    """Tension [N] and slope [N/m] of a strand, by its number, at a length [m].

    Raises:
        ValueError: If that is not finite or pushes.
        RodSolveError: If the law has no answer.
    """
    if not callable(law):
        return float(law), 0.0
    try:
        answer = law(length)
    except (ValueError, ArithmeticError) as error:
        raise RodSolveError(
            f"the law of strand {strand} has no answer at {length:.6g} m: {error}", math.inf
        ) from error
    where = f"by the law of strand {strand} at {length:.6g} m"
    return (
        number(f"tension {where}", answer[0], at_least=0.0, unit="N"),
        number(f"slope {where}", answer[1], at_least=0.0, unit="N/m"),
    )


def _names(i: int, segment: Segment) -> Sequence[Hashable]:
    """Names of the strands of segment i; a strand without one has one that no other has."""
    if segment.strands is not None:
        return segment.strands
    return [("strand", i, j) for j in range(len(segment.routes))]


def _tuple(field: str, values: Any) -> tuple[Any, ...]:
    try:
        return tuple(values)
    except TypeError:
        raise ValueError(f"{field} must be a sequence, got {values!r}") from None


def _keep(spec: Segment | StaticProblem, shape: tuple[int, ...], *fields: str) -> None:
    """Makes fields read-only arrays of finite numbers."""
    for name in fields:
        array = within(name, getattr(spec, name), shape=shape).copy()
        array.flags.writeable = False
        object.__setattr__(spec, name, array)


def _require_legs(field: str, route: Any) -> None:
    for leg in require_route(field, route).legs:
        for name in ("offset", "slope"):
            if not callable(getattr(leg, name, None)):
                raise ValueError(f"legs of {field} must have the method {name}(s), got {leg!r}")
            within(f"{name}(s) of {field}", getattr(leg, name)(_PROBES), shape=(len(_PROBES), 2))
        slope = np.asarray(leg.slope(_PROBES), dtype=np.float64)
        run = np.diff(np.asarray(leg.offset(np.array([0.0, 1.0])), dtype=np.float64), axis=0)[0]
        off = float(np.abs(slope.mean(axis=0) - run).max())
        if off > _OFF * float(np.linalg.norm(slope, axis=1).mean()) + 1e-12:
            raise ValueError(
                f"slope(s) of {field} must be the derivative of offset(s) by s from 0 to 1, got one"
                f" that misses offset(1) - offset(0) = {run} by {off:.3g} m"
            )

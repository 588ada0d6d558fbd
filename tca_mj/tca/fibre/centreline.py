"""Reference shapes of a fibre: helices, the conical spiral, and any curve given by its points.

A shape is stored as the strain u*(s) of its frames, the turn per length in the frame itself, and
where it starts. Frames have z along the tangent; how they turn about it is free, because the
section is round. "Sun" is J. Sun's dissertation, Colorado State University.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from tca_mj.checks import Array, Checked, Positive, door, number, require_positive, whole, within
from tca_mj.quadrature import GaussRule
from tca_mj.rod.lie import matrix_quaternion, quaternion_exp, quaternion_matrix, running_product
from tca_mj.tca.catalogue import CATALOGUE
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.thread import FibreSpec

# Gauss's points on [0, 1]: two for the frames, four for the length.
_FRAMES, _RULE = GaussRule.of(2), GaussRule.of(4)
_NEWTON_STEPS = 50


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Centreline(Checked):
    """The fibre's reference shape: what it takes without load at the reference temperature.

    Attributes:
        length: Length l_t of the fibre [m].
        strain: u*(s): arc length, shape (n,) [m], to the turn per length of the frame in its own
            axes, shape (n, 3) [rad/m]; (0, curvature, torsion) for Frenet's frame.
        position: Where the fibre starts, world frame, shape (3,) [m].
        rotation: Frame at the start, columns x, y, z, with z along the fibre, shape (3, 3) [1].

    Raises:
        ValueError: If the length is not above 0, or position and rotation are none.
    """

    length: Positive
    strain: Callable[[Array], Array]
    position: Annotated[Array, partial(within, shape=(3,))]
    rotation: Annotated[Array, partial(within, shape=(3, 3))]

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        matrix_quaternion(self.rotation)

    @classmethod
    @door
    def helix(cls, *, radius: float, pitch_angle: float, length: float) -> Centreline:
        """A right-handed helix that hangs down from z = 0 about the world's z axis.

        p* = (r cos phi, -r sin phi, -s sin alpha*), phi = s cos(alpha*)/r: Sun, eq. (3.12), turned
        about x so that it runs down as the frames of eqs. (3.13) and (3.16) do.

        Args:
            radius: Radius r of the centre line [m].
            pitch_angle: Pitch angle alpha* [rad].
            length: Length of the fibre [m].

        Raises:
            ValueError: If the radius is not above 0 or the angle not between -pi/2 and pi/2.
        """
        require_positive(radius=radius)
        number("pitch_angle", pitch_angle, above=-0.5 * math.pi, below=0.5 * math.pi)
        sin, cos = math.sin(pitch_angle), math.cos(pitch_angle)
        strain = np.array([0.0, cos * cos / radius, cos * sin / radius])
        return cls(
            length=length,
            strain=lambda s: np.broadcast_to(strain, (*np.shape(s), 3)),
            position=np.array([radius, 0.0, 0.0]),
            rotation=np.array([[-1.0, 0.0, 0.0], [0.0, sin, -cos], [0.0, -cos, -sin]]),
        )

    @classmethod
    @door
    def of_tca(cls, tca: TcaSpec) -> Centreline:
        """The helix of a TCA at its natural length, hanging down."""
        return cls.helix(
            radius=tca.coil_radius, pitch_angle=tca.pitch_angle, length=tca.fibre_length
        )

    @classmethod
    @door
    def of_curve(
        cls, position: Callable[[Array], ArrayLike], start: float, end: float,
        samples: Annotated[int, partial(whole, at_least=6, at_most=500_000)] = 4001,
    ) -> Centreline:  # fmt: skip
        """Any curve p(t), t from ``start`` to ``end``; t need not be the arc length.

        Args:
            position: Parameter, shape (n,), to points, shape (n, 3) [m].
            start: First parameter.
            end: Last parameter.
            samples: Points at which it is evaluated, 6 to 500 000; 100 on each turn give 1e-8 of
                the length.

        Raises:
            ValueError: As ``of_points``.
        """
        parameter = np.linspace(start, end, samples)
        return cls.of_points(position(parameter), parameter)

    @classmethod
    @door
    def of_points(cls, points: ArrayLike, parameter: ArrayLike | None = None) -> Centreline:
        """The smooth curve through given points: a spline of degree five.

        Its frames turn about the tangent as little as possible (u_z* = 0, Bishop's frame), so that
        straight pieces do no harm. The error falls with the fourth power of the spacing.

        Args:
            points: Points from base to tip, at least 6, shape (n, 3) [m].
            parameter: Values of the curve's parameter there, rising, shape (n,); by default the
                length of the polyline through the points.

        Raises:
            ValueError: If there are too few points, they are not finite, coincide, or the
                parameter does not rise.
        """
        points = within("points", points)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 6:
            raise ValueError(f"points must have shape (n, 3) with n from 6 on, got {points.shape}")
        gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        within("gaps between points", gaps, above=0.0)
        t = np.append(0.0, np.cumsum(gaps)) if parameter is None else parameter
        t = within("parameter", t, shape=points.shape[:1])
        step = within("steps of the parameter", np.diff(t), above=0.0)
        spline = make_interp_spline(t, points, k=5)
        first, second = spline.derivative(1), spline.derivative(2)

        def turn(at: Array) -> Array:  # turn of the tangent per parameter, world frame
            d1 = first(at)
            return np.cross(d1, second(at)) / np.sum(d1 * d1, axis=-1, keepdims=True)

        at = t[:-1, None] + step[:, None] * _RULE.node
        pieces = step * (np.linalg.norm(first(at), axis=-1) @ _RULE.weight)
        arc = np.append(0.0, np.cumsum(pieces))
        speed = np.linalg.norm(first(t), axis=1)
        tangent = first(t[0]) / speed[0]
        normal = np.eye(3)[np.argmin(np.abs(tangent))]
        normal = np.cross(np.cross(tangent, normal), tangent)
        normal /= np.linalg.norm(normal)
        rotation = np.stack([normal, np.cross(tangent, normal), tangent], axis=1)
        # R' = hat(w) R by Magnus's expansion, fourth order. The steps multiply from the left:
        # conjugates turn that into a running product from the right.
        w = turn(t[:-1, None] + step[:, None] * _FRAMES.node)
        angle = 0.5 * step[:, None] * (w[:, 0] + w[:, 1])
        angle -= math.sqrt(3.0) / 12.0 * np.square(step)[:, None] * np.cross(w[:, 0], w[:, 1])
        turns = np.vstack([matrix_quaternion(rotation), np.zeros((len(step), 4))])
        turns[1:] = quaternion_exp(angle)
        back = running_product(turns * [1.0, -1.0, -1.0, -1.0])  # matrices R^T
        strain = np.einsum("nij,nj->ni", quaternion_matrix(back), turn(t) / speed[:, None])
        strain[:, 2] = 0.0
        return cls(
            length=float(arc[-1]), strain=make_interp_spline(arc, strain, k=5),
            position=points[0].copy(), rotation=rotation,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class ConicalTca(Checked):
    """A TCA wound on a cone, an Archimedean spiral of constant pitch [Sun, eq. (3.36)].

    p*(z) = (b z cos(a z), b z sin(a z), z), with z the height above the cone's tip; it is clamped
    at its small end and runs up the world's z axis.

    Attributes:
        fibre: The twisted fibre.
        pitch: Rise per turn, 2 pi/a [m].
        cone_angle: Full angle of the cone, b = tan(cone_angle/2) [rad].
        start: Height above the cone's tip at which the fibre begins [m].
        made_length: Height of the spiral [m].

    Raises:
        ValueError: If a length or the angle is not above 0 or too large.
    """

    fibre: FibreSpec
    pitch: Positive
    cone_angle: Annotated[float, partial(number, above=0.0, below=math.pi)]
    start: Positive
    made_length: Positive

    @property
    def winding(self) -> float:
        """a: angle about the axis per height [rad/m]."""
        return 2.0 * math.pi / self.pitch

    @property
    def slope(self) -> float:
        """b: radius per height [1]."""
        return math.tan(0.5 * self.cone_angle)

    @property
    def coils(self) -> float:
        """Number of coils."""
        return self.made_length / self.pitch

    @property
    def fibre_length(self) -> float:
        """Length of the twisted fibre [m]."""
        end = self.arc_length(self.start + self.made_length)
        return float(end - self.arc_length(self.start))

    def arc_length(self, z: ArrayLike) -> Array:
        """Length of the spiral from the cone's tip to heights z [m]; Sun, eq. (3.37) corrected."""
        z, a, b = within("z", z), self.winding, self.slope
        root = np.sqrt(1.0 + b * b * (1.0 + np.square(a * z)))
        length = np.arcsinh(a * b * z / math.sqrt(1.0 + b * b)) * (1.0 + b * b) / (2.0 * a * b)
        return 0.5 * z * root + length

    def position(self, z: ArrayLike) -> Array:
        """Points of the spiral at heights z above the cone's tip, shape (..., 3) [m]."""
        z = within("z", z)
        a, b = self.winding, self.slope
        return np.stack([b * z * np.cos(a * z), b * z * np.sin(a * z), z], axis=-1)

    def curvature(self, z: ArrayLike) -> Array:
        """Curvature at heights z [1/m]; Sun, eq. (3.38) corrected."""
        a, b, az2 = self.winding, self.slope, np.square(self.winding * within("z", z))
        top = a * b * np.sqrt(4.0 + az2 + np.square(b * (2.0 + az2)))
        return top / (1.0 + b * b * (1.0 + az2)) ** 1.5

    def torsion(self, z: ArrayLike) -> Array:
        """Torsion at heights z [rad/m]; Sun, eq. (3.39)."""
        a, b, az2 = self.winding, self.slope, np.square(self.winding * within("z", z))
        return a * (6.0 + az2) / (4.0 + az2 + np.square(b * (2.0 + az2)))

    def height(self, s: ArrayLike) -> Array:
        """Heights z at arc lengths s from the fibre's start [m]: arc_length(z) inverted."""
        goal = within("s", s) + self.arc_length(self.start)
        a, b = self.winding, self.slope
        z = goal / math.sqrt(1.0 + b * b)  # too large: arc_length is convex, Newton falls to it
        for _ in range(_NEWTON_STEPS):
            step = (self.arc_length(z) - goal) / np.sqrt(1.0 + b * b * (1.0 + np.square(a * z)))
            z = z - step
            if np.all(np.abs(step) <= 1e-14 * self.made_length):
                break
        return z

    def centreline(self) -> Centreline:
        """The spiral in Frenet's frame, which it starts with as well (in place of eq. (3.41))."""

        def strain(s: Array) -> Array:
            z = self.height(s)
            return np.stack([np.zeros_like(z), self.curvature(z), self.torsion(z)], axis=-1)

        z, a, b = self.start, self.winding, self.slope
        sin, cos = math.sin(a * z), math.cos(a * z)
        d1 = np.array([b * cos - a * b * z * sin, b * sin + a * b * z * cos, 1.0])
        d2 = a * b * np.array([-2.0 * sin - a * z * cos, 2.0 * cos - a * z * sin, 0.0])
        tangent = d1 / np.linalg.norm(d1)
        binormal = np.cross(d1, d2)
        binormal /= np.linalg.norm(binormal)
        return Centreline(
            length=self.fibre_length, strain=strain, position=self.position(z),
            rotation=np.stack([np.cross(binormal, tangent), binormal, tangent], axis=1),
        )  # fmt: skip


# Sun, Tables 3.1 and 3.2 and Section 3.4.1: pitch 10.6 mm on a cone of 12 degrees, 57 mm high as
# made, 145 mm of fibre, 5.3 coils. The start is fitted to those 145 mm: from the cone's tip
# they would reach 63 mm.
CONICAL = ConicalTca(
    fibre=CATALOGUE["free-stroke"].fibre, pitch=10.6e-3, cone_angle=math.radians(12.0),
    start=8.2e-3, made_length=57e-3,
)  # fmt: skip

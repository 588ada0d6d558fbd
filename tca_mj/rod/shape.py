"""What every solver of a soft body's static shape returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tca_mj.checks import Array, within

_STRAIGHT = 1e-9  # what turns less bends in no plane [rad]


def bend(axes: Array) -> float:
    """Angle by which the last of the axes along a rod is turned from the first, beyond half a turn.

    The angle between two axes ends at half a turn. Which of those that go on from there it is, the
    way there tells: the axes seen in the plane in which they turn most.

    Args:
        axes: Unit vectors from base to tip, shape (n, 3), less than half a turn apart [1].

    Returns:
        The angle, never negative; of two axes at most π [rad].

    Raises:
        ValueError: If there are less than two axes, or they are none.
    """
    axes = within("axes", axes, at_least=-1.0 - _STRAIGHT, at_most=1.0 + _STRAIGHT)
    if axes.ndim != 2 or axes.shape[1] != 3 or len(axes) < 2:
        raise ValueError(f"axes must be finite numbers of shape (n, 3), n at least 2, got {axes}")
    first, last = axes[0], axes[-1]
    angle = float(np.arctan2(np.linalg.norm(np.cross(first, last)), first @ last))
    about = np.cross(axes[:-1], axes[1:]).sum(axis=0)
    across = np.cross(about, first)
    size = float(np.linalg.norm(across))
    if size < _STRAIGHT:
        return angle
    seen = abs(float(np.unwrap(np.arctan2(axes @ across / size, axes @ first))[-1]))
    turns = 2.0 * np.pi * np.round(np.array([seen - angle, seen + angle]) / (2.0 * np.pi))
    choices = turns + np.array([angle, -angle])
    return float(abs(choices[np.argmin(np.abs(choices - seen))]))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RodShape:
    """A loaded rod at rest, given at n points from base to tip.

    World frame: the base is at the origin, the unloaded rod starts along +z. A solver that does
    not know the strains leaves them out.

    Attributes:
        position: Points of the centre line, shape (n, 3) [m].
        rotation: Frames of the sections as matrices, columns x, y, z, shape (n, 3, 3) [1].
        arc_length: Position of the points along the unloaded centre line, shape (n,) [m].
        strain: Twist of the centre line in the section's frame, angular u [1/m] then linear v,
            u the curvature at rest and v = (0, 0, 1) if nothing pulls, shape (n, 6); or None.
        tca_length: Length of each TCA along its route, shape (k,) [m].
        base_force: Force that holds the base, shape (3,) [N].
        base_moment: Moment that holds the base, about the origin, shape (3,) [N m].
    """

    position: Array
    rotation: Array
    arc_length: Array
    strain: Array | None
    tca_length: Array
    base_force: Array
    base_moment: Array

    @property
    def tip(self) -> Array:
        """Position of the tip, shape (3,) [m]."""
        return self.position[-1]

    @property
    def bend_angle(self) -> float:
        """Angle by which the tip's axis is turned from the base's [rad].

        It goes on beyond half a turn where there are points enough to tell, see ``bend``.
        """
        return bend(self.rotation[:, :, 2])

    @property
    def twist_angle(self) -> float:
        """Angle by which the tip is turned about the rod's axis, -π to π [rad].

        That is the rotation left after the shortest one that takes the base's axis to the
        tip's; positive turns x towards y. It has no meaning where the rod bends by half a turn.
        """
        turn = self.rotation[0].T @ self.rotation[-1]
        return float(np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))

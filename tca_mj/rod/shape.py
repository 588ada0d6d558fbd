"""What every solver of a soft body's static shape returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tca_mj.checks import Array


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
        """Angle between the tip's axis and the base's, 0 to π [rad]."""
        base, tip = self.rotation[0, :, 2], self.rotation[-1, :, 2]
        return float(np.arctan2(np.linalg.norm(np.cross(base, tip)), base @ tip))

    @property
    def twist_angle(self) -> float:
        """Angle by which the tip is turned about the rod's axis, -π to π [rad].

        That is the rotation left after the shortest one that takes the base's axis to the
        tip's; positive turns x towards y. It has no meaning where the rod bends by half a turn.
        """
        turn = self.rotation[0].T @ self.rotation[-1]
        return float(np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))

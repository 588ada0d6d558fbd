"""Love's model of a coil: torsion and bending of a fibre with locked ends.

"Sun" is J. Sun, dissertation, Colorado State University.
"""

import numpy as np

from tca_mj.checks import Array, within
from tca_mj.tca.laws.coil import Coil, Heated, Law
from tca_mj.tca.laws.rod import Point


def love_law(coil: Coil) -> Law:
    """Love's model, whose ends are locked: Sun, eqs. (3.19), (3.24)-(3.26).

    The heated coil without load has the old winding and the new torsion, s_h = sin(alpha*) +
    untwist/W, and the load deforms it from there:

        phi = GJ W^2 (s - s_h) - EI W^2 tan b (cos b - cos b_h),   l = l_t s.

    This is eq. (3.27) with A = l_t r*/cos(alpha*) if there cos^2(alpha^h) multiplies the term of
    EI, too. Taking the *heated* shape's curvature as the unstressed one is the only difference
    from Kirchhoff's rod with locked ends, and it does not vanish for small heating.

    Args:
        coil: Constants of the TCA.
    """
    torsion = coil.torsion * coil.winding**2
    bending = coil.bending * coil.winding**2

    def law(heated: Heated, sin: Array) -> Point:
        cos2 = 1.0 - sin * sin
        cos = np.sqrt(cos2)
        cos_h = np.sqrt(1.0 - heated.unloaded * heated.unloaded)
        force = torsion * (sin - heated.unloaded) - bending * (sin - sin / cos * cos_h)
        slope = (torsion - bending) + bending * cos_h / (cos2 * cos)
        return Point(force, slope, sin, 1.0)

    return law


def love_unloaded(coil: Coil, untwist: Array) -> Array:
    """s_h = sin(alpha*) + untwist/W of Love's equation, Sun, eq. (3.19) with (3.24).

    Args:
        coil: Constants of the TCA.
        untwist: Untwist, any shape [rad/m].

    Raises:
        ValueError: If no helix has that torsion.
    """
    sine = coil.sin + untwist / coil.winding
    return within("sine of the unloaded pitch in Love's model", sine, above=-1.0, below=1.0)

"""Where each published TCA is found, and those of the modules and experiments, cut to length.

    what                                          where
    five types of Sun, Table 2.1                  ``CATALOGUE["type-0-180"]`` ... ("type-2-200")
    free-stroke TCA of Tables 3.1, 3.2            ``CATALOGUE["free-stroke"]``, as made
                                                  ``CATALOGUE["free-stroke-made"]``
    the same, crept under 0, 2, 30, 60 g          ``FREE_STROKE_CREPT["30 g"]``
    self-coiled TCA of Tables 3.1, 3.2            ``CATALOGUE["self-coiled"]``
    conical TCA of Tables 3.1, 3.2, Section 3.5.3 ``CONICAL``: no helix, so that it is a
                                                  ``ConicalTca`` for ``solve_fibre``
    TCAs of modules and experiments               ``MODULE_TCAS``, here
    any other, from fibre and mandrel             ``TcaSpec.from_mandrel``

The comments beside the definitions (``spec.py``, ``centreline.py``) give each constant's source.
"Sun" is J. Sun, dissertation, Colorado State University.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

from tca_mj.tca.spec import CATALOGUE, TcaSpec

# The modules of Chapters 4 and 5 use the free-stroke TCA, type 2-180 on the thread of Chapter 3
# (Section 3.4.1). Its length in a module is the natural one, without prestretch: assumed, as
# trained TCAs are sewn in (Section 2.2.2). Builders of the modules cut their TCAs to the route
# themselves and add the sheath; these entries are bare and say what is printed.
_THREAD = CATALOGUE["free-stroke"]

MODULE_TCAS: Mapping[str, TcaSpec] = MappingProxyType(
    {
        # Table 2.3, self-sensing and control: 350 mm of thread, 110 mm natural, 133.5 mm made,
        # 6.7 ohm/dm. Called type 1-180 there; the lengths are those of type 2-180.
        "sensing": CATALOGUE["type-2-180"].of_pitch(math.asin(0.110 / 0.350)),
        # Section 4.1.1, Fig. 4.2: U-shaped, 70 mm in all.
        "gripper": _THREAD.of_length(0.070),
        # Section 5.3.2: one helix of 5 turns at 3.5 mm from the axis on 16 mm. The length is that
        # of this curve.
        "twisting": _THREAD.of_length(math.hypot(2.0 * math.pi * 5.0 * 3.5e-3, 16e-3)),
        # Sections 4.1.3, 5.3.1: three of them, 45 mm.
        "bending": _THREAD.of_length(0.045),
        # Section 4.2.1: three of them, cut to 45 mm, in a finger of 40 mm. Two in series have
        # 6.0 ohm by the 6.7 ohm/dm of Table 2.3; 6.6 ohm are reported with their leads.
        "finger": _THREAD.of_length(0.045),
    }
)

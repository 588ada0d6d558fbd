"""Where each published TCA is found, and those of the modules and experiments, cut to length.

    what                                          where
    five types of Sun, Table 2.1                  ``CATALOGUE["type-0-180"]`` ... ("type-2-200")
    free-stroke TCA of Tables 3.1, 3.2            ``CATALOGUE["free-stroke"]``, as made
                                                  ``CATALOGUE["free-stroke-made"]``
    the same, crept under 0, 2, 30, 60 g          ``FREE_STROKE_CREPT["30 g"]``
    self-coiled TCA of Tables 3.1, 3.2            ``CATALOGUE["self-coiled"]``
    conical TCA of Tables 3.1, 3.2, Section 3.5.3 ``CONICAL``: no helix, so that it is a
                                                  ``ConicalTca`` for ``solve_fibre``
    TCAs of modules and experiments               ``MODULE_TCAS``
    any other, from ruler, caliper and scale      ``TcaSpec.from_measured``
    or from fibre and mandrel                     ``TcaSpec.from_mandrel``

The comments beside the definitions (also in ``spec.py`` and ``fibre/centreline.py``) give each
constant's source. "Sun" is J. Sun, dissertation, Colorado State University.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from tca_mj.tca.materials import MATERIALS, Named
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.thread import still_air_loss

_THREAD = MATERIALS["silver-coated nylon sewing thread"].measured
# Sun, Table 3.1. The softening by load was fitted to three loads of the free-stroke TCA up to 60 g
# (171 rad/m) and is an extrapolation beyond.
_THREAD_3 = replace(_THREAD, load_softening=(3.24e-4, -0.027, 1.0))
# Sun, Section 2.1.1 and Table 2.1: the same thread, twisted under the same 240 g, with 287 turns on
# 350 mm. Stiffnesses, softening and expansion are therefore those measured in Chapter 3, on the
# circle that they were measured with: what is 0.34 mm thick here is a thickness. With the moduli of
# Chapter 3 on a circle of 0.34 mm, EI and GJ would be 2.3 times too small, and the published pull,
# temporary length and loaded stroke of these TCAs are missed (``tca_mj.validation.threads``).
# Five TCAs weigh 0.16 g, one 0.03 g: 32 mg on 350 mm, as weighed. (350 mm of the thread before it
# is twisted would be 33 mg, 350 mm after it, as the lengths of Table 2.1 need, 41 mg.)
_THREAD_2 = replace(
    _THREAD_3, inserted_twist=2.0 * math.pi * 287.0 / 0.350, line_density=32e-6 / 0.350
)


# Breaking force: measured on type 2-200 (Section 2.1.1). Resistance: Table 2.3, 6.7 ohm/dm. Its
# fall when stretched: Section 2.3.1, 0.55 ohm for 50 % on a cold TCA of 110 mm, of 7.37 ohm. Its
# rise in contraction is fitted to "~20 %" over the actuation (Section 3.1.1), which is the free
# stroke of 35.7 % (Table 2.1). Heat loss: only a product was identified, by a regression (Section
# 3.5.2), so that it is one number, and the same for all TCAs of this thread.
_SILVER: dict[str, Any] = {
    "breaking_force": 0.78, "resistance_per_length": 67.0,
    "stretch_resistance": 0.55 / (67.0 * 0.110) / 0.5, "contraction_resistance": 0.20 / 0.357,
    "heat_loss": still_air_loss(_THREAD),
}  # fmt: skip
# All TCAs of Chapter 2 have the resistance of the same thread (Sun, Section 2.2.2). Table 2.3 has
# 6.7 ohm/dm and does not say of what. "Around 80 mA" at 0.8 V (Section 2.3.1) are 10 ohm and chose
# the made length, 8.9 ohm (89 mA); the natural one would be 7.4 ohm, the thread 23 ohm [ohm].
_THREAD_OHMS = 67.0 * 0.1335
# Heat that these TCAs lose, per length of thread: fitted to the largest displacement, 60 mm after
# 1 A for 2 s under 20 g (Section 2.2.2). 56 mW/K of 350 mm lie between the 32 and 64 mW/K that an
# infrared camera gives (1 to 2 °C at those 64 mW). They are twice what was identified in Chapter 3
# (``TcaSpec.heat_loss``), and more than still air takes: ``tca_mj.validation.heat`` has the table
# of both [W/(m K)].
_AIR_LOSS = 0.0555 / 0.350


def _type(natural: float, contact: float = 0.350 * math.sin(math.radians(11.53))) -> TcaSpec:
    """Sun, Table 2.1: 350 mm of thread; the lengths are taken, the natural pitch follows.

    The coil radius is that of the outer diameter, (1.08 - 0.34)/2 mm, and agrees with mandrel and
    thread, (0.405 + 0.34)/2 mm. Coils that were made in a groove touch at the made length of type
    0: 11.53°, 70 mm. Resistance and loss are those of Chapter 2, see above.
    """
    own = {
        "resistance_per_length": _THREAD_OHMS / natural, "heat_loss": _AIR_LOSS,
        "stretch_resistance": 0.55 / _THREAD_OHMS / 0.5,
    }  # fmt: skip
    return TcaSpec(
        fibre=_THREAD_2, fibre_length=0.350, coil_radius=0.37e-3,
        pitch_angle=math.asin(natural / 0.350), minimum_pitch_angle=math.asin(contact / 0.350),
        **_SILVER | own,
    )  # fmt: skip


# Sun, Table 3.2, free-stroke: 175 mm of fibre made at 22.42° with a coil radius of 0.408 mm.
# The coils touch at the close packing of that helix, asin(fibre diameter / (2 pi r)) = 9.43°:
# 36 % below the natural length of 45 mm, like the measured 35.7 % of type 2-180 (Table 2.1).
_FREE_STROKE_MADE = TcaSpec(
    fibre=_THREAD_3, fibre_length=0.175, coil_radius=0.408e-3, pitch_angle=math.radians(22.42),
    minimum_pitch_angle=math.asin(0.42 / (2.0 * math.pi * 0.408)), **_SILVER,
)  # fmt: skip
# The same at its natural length of 45 mm: 14.90°; the number of coils is kept, so that
# r = 0.408 mm cos(14.90°)/cos(22.42°) = 0.427 mm.
_FREE_STROKE = replace(
    _FREE_STROKE_MADE,
    pitch_angle=math.asin(0.045 / 0.175),
    coil_radius=math.cos(math.asin(0.045 / 0.175)) / _FREE_STROKE_MADE.winding,
)
# Sun, Table 3.2, self-coiled. Fitted to its measured stroke: 1.6 times the untwist (comment in
# the code published with Sun et al., github.com/jiefengsun/TCA-TRO). The load does not soften it:
# the published polynomial would leave no modulus at the 200 g that it lifts. Contact: close
# packing. Breaking force: an estimate from the 240 g under which the thread is twisted, above
# which it "may easily break" (Section 2.1.1).
_SELF_COILED = TcaSpec(
    fibre=replace(_THREAD, untwist_scale=1.6), fibre_length=0.175, coil_radius=0.227e-3,
    pitch_angle=math.radians(18.66), minimum_pitch_angle=math.asin(0.42 / (2.0 * math.pi * 0.227)),
    **_SILVER | {"breaking_force": 0.240 * 9.81},
)  # fmt: skip

# The free-stroke TCA after it has crept under a weight in grams, which is its reference under that
# weight: pitch angles in the code published with Sun et al., github.com/jiefengsun/TCA-TRO. 15°
# at 0 g is the natural length.
FREE_STROKE_CREPT: Mapping[str, TcaSpec] = MappingProxyType(
    Named({
        f"{weight} g": _FREE_STROKE_MADE.of_pitch(math.radians(pitch))
        for weight, pitch in ((0, 15.0), (2, 16.0), (30, 20.0), (60, 22.0))
    })
)  # fmt: skip

# Published TCAs by name, as long as they were made.
CATALOGUE: Mapping[str, TcaSpec] = MappingProxyType(
    Named({
        # The contact length of type 0 follows from its free stroke of 5.7 %: the coils must touch
        # below its natural length, which is shorter than its made length.
        "type-0-180": _type(0.061, contact=0.061 * (1.0 - 0.057)),
        "type-1-180": _type(0.088),
        "type-2-180": _type(0.109),
        "type-1-200": _type(0.096),
        "type-2-200": _type(0.134),
        "free-stroke": _FREE_STROKE,
        "free-stroke-made": _FREE_STROKE_MADE,
        "self-coiled": _SELF_COILED,
    })
)  # fmt: skip

# The modules of Chapters 4 and 5 use the free-stroke TCA, type 2-180 on the thread of Chapter 3
# (Section 3.4.1). Its length in a module is the natural one, without prestretch: assumed, as
# trained TCAs are sewn in (Section 2.2.2). Builders of the modules cut their TCAs to the route
# themselves and add the sheath; these entries are bare and say what is printed.
_CUT = CATALOGUE["free-stroke"]

# TCAs of the modules and experiments, cut to length, by where they are found.
MODULE_TCAS: Mapping[str, TcaSpec] = MappingProxyType(
    Named({
        # Table 2.3, self-sensing and control: 350 mm of thread, 110 mm natural, 133.5 mm made,
        # 6.7 ohm/dm. Called type 1-180 there; the lengths are those of type 2-180.
        "sensing": CATALOGUE["type-2-180"].of_pitch(math.asin(0.110 / 0.350)),
        # Section 4.1.1, Fig. 4.2: U-shaped, 70 mm in all.
        "gripper": _CUT.of_length(0.070),
        # Section 5.3.2: one helix of 5 turns at 3.5 mm from the axis on 16 mm. The length is that
        # of this curve.
        "twisting": _CUT.of_length(math.hypot(2.0 * math.pi * 5.0 * 3.5e-3, 16e-3)),
        # Sections 4.1.3, 5.3.1: three of them, 45 mm.
        "bending": _CUT.of_length(0.045),
        # Section 4.2.1: three of them, cut to 45 mm, in a finger of 40 mm. Two in series have
        # 6.0 ohm by the 6.7 ohm/dm of Table 2.3; 6.6 ohm are reported with their leads.
        "finger": _CUT.of_length(0.045),
    })
)  # fmt: skip

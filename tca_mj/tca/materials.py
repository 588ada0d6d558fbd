"""Materials by name, each the fibre that was measured, with the sources of its numbers.

"Sun" is J. Sun's dissertation, Colorado State University; its Chapter 2 and its Chapter 3 twist the
same thread under the same weight, so that one fibre is behind both, but for the inserted twist and
the mass per length, which are printed twice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, Any, Literal

from tca_mj.checks import Checked, NotNegative, Positive, door, quantity, row
from tca_mj.hints import nearest
from tca_mj.tca.thread import FibreSpec


def _error(name: str, value: Any) -> float | tuple[float, ...]:
    """A standard error, or one for each number of a row; not negative."""
    check = row if isinstance(value, list | tuple) else quantity
    return check(name, value, at_least=0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Source(Checked):
    """Where a number comes from.

    Attributes:
        kind: ``weighed``, ``measured`` (by ruler, caliper, meter), ``fitted`` to data,
            ``published``, or an ``estimate``.
        error: Standard error, of a row one for each of its numbers; None if it is not known [the
            number's unit].
        data: From what: files of data, a publication, or how.
    """

    kind: Literal["weighed", "measured", "fitted", "published", "estimate"]
    error: Annotated[float | tuple[float, ...], _error] | None = None
    data: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class Material(Checked):
    """A material, known by a fibre of it that somebody has measured.

    Attributes:
        measured: That fibre.
        sources: Where its numbers come from, by their names in files of TCAs (``fibre.young``).
    """

    measured: FibreSpec
    sources: Mapping[str, Source]

    @door
    def fibre(
        self, *, radius: Positive, inserted_twist: NotNegative, line_density: Positive
    ) -> FibreSpec:
        """Another fibre of the same material; all else is as measured.

        Moduli of a twisted thread belong to its twist: at another one than that of ``measured``
        they are an estimate.

        Args:
            radius: Of the circle that carries load [m].
            inserted_twist: Twist per fibre length [rad/m].
            line_density: Mass per length of the twisted fibre [kg/m].

        Raises:
            ValueError: As ``FibreSpec``.
        """
        return replace(
            self.measured, radius=radius, inserted_twist=inserted_twist, line_density=line_density
        )


class Named(dict[str, Any]):
    """Things by name; who asks for another one is told which there are."""

    def __missing__(self, name: object) -> Any:
        raise KeyError(f"name must be one of {sorted(self)}, got {name!r}{nearest(name, self)}")


def _sources(**kinds: Source) -> dict[str, Source]:
    return {f"fibre.{name}": source for name, source in kinds.items()}


_TABLE = Source(kind="published", data="Sun, Table 3.1")
_SEWING_THREAD = Material(
    # The moduli were fitted with this radius; measured across the fibre is 0.34 mm thick.
    measured=FibreSpec(
        radius=0.21e-3, young=1.2e9, shear=0.22e9, filament_young=3.9e9, softening=0.0011e9,
        inserted_twist=4710.0, expansion=(3.5e-6, -6.7e-5, 1.0),
        # The thread is sold as 235/36 dtex, 4 ply, 94 mg per metre, and 218 mm of it become 175 mm
        # (Section 2.1.1 and Table 3.2): 117 mg/m. The other printed data agree, 1300 kg/m^3 (Table
        # 3.1) on 0.34 mm (Table 2.1) is 118 mg/m; on the circle that carries load it would be 180.
        line_density=4 * 23.5e-6 * 218.0 / 175.0,
        specific_heat=1267.0, temperature_range=(25.0, 160.0), melting_temperature=260.0,
    ),
    sources=_sources(
        radius=_TABLE, young=_TABLE, shear=_TABLE, inserted_twist=_TABLE, specific_heat=_TABLE,
        filament_young=Source(kind="published", data="Sun, Section 3.2.2; of nylon 6,6"),
        softening=Source(kind="published", data="Sun, eq. (3.11)"),
        load_softening=Source(kind="estimate", data="no influence of the load; another set was"
                              " fitted to the free-stroke TCA up to 60 g (171 rad/m)"),
        expansion=Source(kind="published", data="Sun, Section 3.1.2"),
        line_density=Source(kind="published", data="Sun, Section 2.1.1 and Table 3.2"),
        temperature_range=Source(kind="published", data="Sun, Section 3.2.2"),
        melting_temperature=Source(kind="estimate", data="handbooks, nylon 6,6: 255 to 265 °C"),
    ),
)  # fmt: skip

# A coil that was measured by the Kinetic Research Group, University of Illinois, and published with
# PyElastica (github.com/GazzolaLab/PyElastica, examples/ArtificialMusclesCases): 18.3 coils on
# 25 mm, mean radius 0.816 mm, force at 18 lengths, at 25 and at 120 °C.
_COIL = "force of a coil at 120 °C, Kinetic Research Group, published with PyElastica"
_DATA = Source(kind="published", data="Kinetic Research Group, with PyElastica")
_GROWTH = 3.51e-4  # per kelvin; across drawn nylon handbooks have 1e-4 cold to 4e-4 hot
_MONOFILAMENT = Material(
    measured=FibreSpec(
        radius=0.37e-3, young=1.925e9, shear=1.925e9 / 3.0, filament_young=1.925e9, softening=0.0,
        inserted_twist=2.0 * math.pi * 487.125, expansion=(0.0, _GROWTH, 1.0 - 25.0 * _GROWTH),
        line_density=1090.0 * math.pi * 0.37e-3**2, specific_heat=1700.0,
        temperature_range=(25.0, 120.0), melting_temperature=215.0,
    ),
    sources=_sources(
        radius=_DATA, young=_DATA, inserted_twist=_DATA,
        shear=Source(kind="estimate", data="a third of young, as if isotropic and incompressible"),
        filament_young=Source(kind="published", data="young: there is but one filament"),
        # The modulus of bulk nylon falls to a fifth there, and the coil's stiffness does not.
        softening=Source(kind="fitted", data=f"{_COIL}: it rises as steeply as cold"),
        load_softening=Source(kind="estimate", data="no influence of the load"),
        expansion=Source(kind="fitted", data=f"{_COIL}: 2.008 N at the natural length"),
        line_density=Source(kind="published", data="1090 kg/m³, with PyElastica"),
        specific_heat=Source(kind="estimate", data="handbooks, nylon 6: 1.6 to 1.7 kJ/(kg K)"),
        temperature_range=Source(kind="published", data=_COIL),
        melting_temperature=Source(kind="estimate", data="handbooks, nylon 6: 215 to 220 °C"),
    ),
)  # fmt: skip

# Materials by name. A name tells what was measured, not every thread that is sold under it.
MATERIALS: Mapping[str, Material] = MappingProxyType(
    Named({
        "silver-coated nylon sewing thread": _SEWING_THREAD, "nylon monofilament": _MONOFILAMENT,
    })
)  # fmt: skip

"""Four types of TCA heated by the same current: which is fastest (Sun, Section 2.2.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tca_mj.tca import CATALOGUE
from tca_mj.tca.dynamics import Heating, Load, LoadedTcas
from tca_mj.validation.facts import Finding, trend
from tca_mj.validation.strokes import TYPES

Array = NDArray[np.float64]

# Sun, Table 2.3: 6.7 ohm per dm of a TCA of 110 mm, made of 350 mm of thread [ohm].
THREAD_RESISTANCE = 6.7 * 1.10


@dataclass(frozen=True, slots=True, eq=False)
class Race:
    """Four types under 20 g, 1 A for 2 s: displacement over time.

    Attributes:
        time: Time, shape (k,) [s].
        displacement: By name, each of shape (k,) [mm].
        hottest: Highest temperature [°C].
    """

    time: Array
    displacement: dict[str, Array]
    hottest: float


def race() -> Race:
    """Runs it: "fabricated with precursor threads of the same length, and thus resistance"."""
    names = [name for name in TYPES if name != "type-0-180"]
    tcas = LoadedTcas([CATALOGUE[name] for name in names], Load.weight(0.020))
    heating = Heating(value=1.0**2 * THREAD_RESISTANCE)
    course = tcas.simulate(tcas.rest(), heating, 0.01, 200, "quasistatic")
    moved = 1e3 * (course.length[0] - course.length)
    return Race(course.time, {name: moved[:, i] for i, name in enumerate(names)},
                float(course.temperature.max()))  # fmt: skip


def fastest(found: Race | None = None) -> list[Finding]:
    """Which of the four types is fastest at 1 A."""
    found = race() if found is None else found
    end = {name: float(moved[-1]) for name, moved in found.displacement.items()}
    listed = ", ".join(f"{name[5:]} {value:.0f}" for name, value in end.items()) + " mm"
    first, rival = found.displacement["type-2-180"], found.displacement["type-1-180"]
    behind = found.time[(rival > first) & (found.time > 0.0)]
    until = float(behind.max()) if behind.size else 0.0
    share = 100.0 * float(rival[100] / first[100] - 1.0)
    middle = {name: float(moved[100]) for name, moved in found.displacement.items()}
    source = "Section 2.2.2"
    note = (f"{found.hottest:.0f} °C after 2 s: beyond the data. All four have the resistance of"
            f" the same thread, {THREAD_RESISTANCE:.2f} ohm.")  # fmt: skip
    return [
        trend(source, "20 g, 1 A for 2 s: largest displacement", "type 2-180, up to 60 mm",
              "type 2-180 ahead of all after 2 s", listed, max(end, key=end.__getitem__) ==
              "type-2-180", note=note, value=end["type-2-180"]),
        trend(source, "20 g, 1 A: annealed at 180 °C against 200 °C", "180 °C is faster",
              "of either groove type -180 ahead after 1 s",
              ", ".join(f"{name[5:]} {value:.1f}" for name, value in middle.items()) + " mm",
              all(middle[f"type-{k}-180"] > middle[f"type-{k}-200"] for k in (1, 2))),
        trend(source, "20 g, 1 A: type 2-180 against type 1-180", "type 2-180 responds faster",
              "type 2-180 ahead all the time", f"behind until {until:.2f} s", until == 0.0,
              value=until,
              reason=f"Type 1-180 is {share:.0f} % ahead after 1 s and falls behind when its coils"
              " touch. In the model the coil with the smaller pitch untwists into more"
              " contraction; that type 1-180 slows down and ends below type 2-180 is reported,"
              " too."),
    ]  # fmt: skip

"""Rod, Love and Castigliano side by side, and the cone: the facts of Chapter 3."""

import time
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca import CATALOGUE, LoadedTcas, TcaSpec, hanging_length, softening, tension
from tca_mj.tca.catalogue import FREE_STROKE_CREPT
from tca_mj.tca.dynamics.loads import Heating, Load
from tca_mj.tca.fibre.boundary import FibreShape, solve_fibre
from tca_mj.tca.fibre.centreline import CONICAL
from tca_mj.validation.facts import Finding, finding
from tca_mj.validation.strokes import heat_up, settled, weight

TEMPERATURES = np.linspace(25.0, 160.0, 28)
# Sun, Section 3.4.4: weights [g] under which the two TCAs were heated.
CASES = {"free-stroke-made": (2, 30, 60), "self-coiled": (50, 100, 200)}
# Sun, Section 3.4.4, case 3: voltage [V] and weight [g].
LIFTS = ((5.0, 30), (5.0, 50), (6.0, 30), (6.0, 50))
# Sun, Section 3.4.4: seconds per simulated second, at steps of 0.05 s.
PUBLISHED_SPEED = {"rod": 24.0, "cst": 2.0}


class Theory(NamedTuple):
    """A model with the end condition that it is known with."""

    name: str
    model: str
    spin: str
    scheme: str = "implicit"

    @property
    def settings(self) -> dict[str, str]:
        """Keywords of ``hanging_length`` and ``tension``."""
        return {"model": self.model, "spin": self.spin, "scheme": self.scheme}


ROD = Theory("rod", "rod", "free")
CST = Theory("Castigliano", "cst", "free")
PATH = Theory("Castigliano, path-following", "cst", "free", "path")
LOVE = Theory("Love", "love", "locked")


def contractions(tca: TcaSpec, grams: float, theory: Theory) -> Array:
    """Contractions from 25 °C to ``TEMPERATURES``, shape (28,) [mm]."""
    length = hanging_length(tca, TEMPERATURES, weight(grams), **theory.settings)  # type: ignore[arg-type]
    return 1e3 * (length[0] - length)


def distances(tca: TcaSpec, grams: float, theory: Theory) -> Array:
    """Difference from the rod over the rod's largest contraction, shape (28,) [%]."""
    rod = contractions(tca, grams, ROD)
    return 100.0 * (contractions(tca, grams, theory) - rod) / rod.max()


def moduli() -> list[Finding]:
    """E and G as measured, and their fall with heat and load."""
    fibre, tca = CATALOGUE["free-stroke"].fibre, CATALOGUE["free-stroke-made"]
    fall, heat = (100.0 * (1.0 - float(softening(fibre, 160.0, torsion)))
                  for torsion in (load_torsion(tca, 60), 0.0))  # fmt: skip
    gpa = [1e-9 * modulus for modulus in (fibre.young, fibre.shear, fibre.filament_young)]
    return [finding("moduli", gpa=gpa), finding("fall-of-g", fall, heat=heat)]


def load_torsion(tca: TcaSpec, grams: float) -> float:
    """Torsion by which a weight softens a fibre, F r_t cos(alpha*)/(G J) [rad/m]."""
    fibre = tca.fibre
    lever = fibre.radius * np.cos(tca.pitch_angle)
    return float(weight(grams) * lever / (fibre.shear * 2.0 * fibre.second_moment))


def spread() -> list[Finding]:
    """Distances of Love and Castigliano from the rod: order, size, growth."""
    rows = []
    for name, weights in CASES.items():
        tca = CATALOGUE[name]
        found = {theory.name: [np.abs(distances(tca, grams, theory)) for grams in weights]
                 for theory in (CST, LOVE)}  # fmt: skip
        largest = {key: [float(values.max()) for values in rows] for key, rows in found.items()}
        shown = "; ".join(f"{key} " + ", ".join(f"{error:.1f}" for error in errors)
                          for key, errors in largest.items()) + " %"  # fmt: skip
        cases = f"{name}, " + "/".join(str(grams) for grams in weights) + " g, 25 to 160 °C"
        heavy = {key: values[-1] for key, values in found.items()}
        first = len(TEMPERATURES) // 2 + 1
        warming = "; ".join(f"{key} {values[first]:.1f} to {values[-1]:.1f}"
                            for key, values in heavy.items())  # fmt: skip
        rows += [
            finding("statics-order", cases=cases, shown=shown, held=all(
                cst < love for cst, love in zip(*largest.values(), strict=True))),
            finding("statics-load", cases=cases, shown=shown, held=all(
                np.all(np.diff(errors) > 0.0) for errors in largest.values())),
            finding("statics-heat", name=name, grams=weights[-1], shown=warming,
                    start=TEMPERATURES[first], held=all(
                        np.all(np.diff(values[1:]) > 0.0) for values in heavy.values())),
        ]  # fmt: skip
    made = {theory.name: distances(CATALOGUE["free-stroke-made"], 60, theory)[-1]
            for theory in (CST, PATH, LOVE)}  # fmt: skip
    return [*rows, finding("love", made[LOVE.name]), finding("castigliano", made[CST.name]),
            finding("castigliano-path", abs(made[PATH.name]))]  # fmt: skip


def crept_free_stroke(grams: float) -> TcaSpec:
    """The free-stroke TCA crept under a weight, its reference under it.

    Published pitches at 0, 2, 30 and 60 g; between them the law that is fitted to two of these.
    """
    if f"{grams:g} g" in FREE_STROKE_CREPT:
        return FREE_STROKE_CREPT[f"{grams:g} g"]
    return settled(FREE_STROKE_CREPT["0 g"], grams)


def lifting(
    grams: float, theory: Theory, source: str = "fibre", load: Load | None = None
) -> LoadedTcas:
    """The free-stroke TCA, crept under a weight, that lifts it.

    Args:
        grams: The weight.
        theory: The model of its tension.
        source: Whether 6.7 ohm/dm are counted per length of "fibre" or of "tca".
        load: What it lifts instead.
    """
    tca = crept_free_stroke(grams)
    per_length = 67.0 * (tca.fibre_length / tca.rest_length if source == "fibre" else 1.0)
    tca = replace(tca, resistance_per_length=per_length)

    def law(length: Array, temperature: Array) -> tuple[Array, Array]:
        return tension(tca, length, temperature, **theory.settings)  # type: ignore[arg-type]

    return LoadedTcas([tca], load or Load.weight(1e-3 * grams), law=law)


class Lift(NamedTuple):
    """One case of Section 3.4.4, case 3, in three models; shapes (k,).

    Attributes:
        time: Time [s].
        temperature: Temperature in the rod model [°C].
        displacement: By name of the model, the rod first [mm].
    """

    time: Array
    temperature: Array
    displacement: dict[str, Array]

    @property
    def distances(self) -> dict[str, float]:
        """Largest distance from the rod up to 160 °C over its displacement, of the others [1]."""
        known = self.temperature <= 160.0
        rod, *others = (moved[known] for moved in self.displacement.values())
        return {name: float(np.abs(moved - rod).max() / rod.max())
                for name, moved in zip([*self.displacement][1:], others, strict=True)}  # fmt: skip


@cache
def lifts(*, dt: float) -> dict[tuple[float, int], Lift]:
    """The four cases: a constant voltage from rest for 4 s, in steps of ``dt`` [s]."""
    found, steps = {}, round(4.0 / dt)
    for volts, grams in LIFTS:
        courses = {theory.name: heat_up(lifting(grams, theory), "voltage", volts, dt, steps)
                   for theory in (ROD, CST, LOVE)}  # fmt: skip
        rod = courses[ROD.name]
        found[volts, grams] = Lift(
            rod.time, rod.temperature[:, 0],
            {name: 1e3 * (c.length[0, 0] - c.length[:, 0]) for name, c in courses.items()},
        )  # fmt: skip
    return found


def dynamics(dt: float = 0.01) -> list[Finding]:
    """Distances of Love and Castigliano from the rod while a voltage heats the TCA."""
    found = lifts(dt=dt)
    errors = {case: lift.distances.values() for case, lift in found.items()}
    shown = "; ".join(f"{volts:g} V {grams} g {100 * cst:.0f}, {100 * love:.0f}"
                      for (volts, grams), (cst, love) in errors.items())  # fmt: skip
    hottest = max(float(lift.temperature[-1]) for lift in found.values())
    bare = lifting(30, ROD, "tca")
    ohms, loss = float(bare.resistance(bare.rest())[0]), float(np.ravel(bare.heat.loss)[0])
    return [finding("dynamics", held=all(cst < love for cst, love in errors.values()), shown=shown,
                    settles=25.0 + 25.0 / ohms / loss, hottest=hottest)]  # fmt: skip


def heated_cone(temperature: float) -> FibreShape:
    """The conical TCA without load."""
    return solve_fibre(CONICAL.centreline(), CONICAL.fibre, temperature)


def heights(shape: FibreShape) -> Array:
    """Heights of its sections above the clamp [mm]."""
    return 1e3 * (shape.position[:, 2] - shape.position[0, 2])


def rises(shape: FibreShape) -> Array:
    """Heights gained by each whole turn, from the smallest at the clamp to the largest [mm]."""
    bounds = CONICAL.start + CONICAL.pitch * np.arange(int(CONICAL.coils) + 1)
    arc = CONICAL.arc_length(bounds) - CONICAL.arc_length(CONICAL.start)
    return np.diff(np.interp(arc, shape.arc_length, heights(shape)))


@dataclass(frozen=True, slots=True, eq=False)
class Cone:
    """The conical TCA over temperature.

    Attributes:
        temperature: Shape (k,) [°C].
        end: Height of the free end above the clamp, shape (k,) [mm].
        lowest: Height of the lowest point, shape (k,) [mm].
        highest: Height of the highest point, shape (k,) [mm].
        rises: Height gained by each turn, shape (k, 5) [mm].
    """

    temperature: Array
    end: Array
    lowest: Array
    highest: Array
    rises: Array


@cache
def cone(step: float = 1.0) -> Cone:
    """Solves the boundary value problem from 25 to 160 °C."""
    temperature = np.arange(25.0, 160.0 + 0.5 * step, step)
    shapes = [heated_cone(float(hot)) for hot in temperature]
    z = [heights(shape) for shape in shapes]
    return Cone(temperature, np.array([h[-1] for h in z]), np.array([h.min() for h in z]),
                np.array([h.max() for h in z]), np.array([rises(s) for s in shapes]))  # fmt: skip


def conical(found: Cone | None = None) -> list[Finding]:
    """Dual-side stroke, coils that pass each other, and no plane."""
    found = cone() if found is None else found
    stroke = 100.0 * (1.0 - found.end / found.end[0])
    at, middle = (int(np.argmin(np.abs(found.temperature - hot))) for hot in (115.0, 85.0))
    span = found.highest - found.lowest
    ordered = bool(np.all(np.diff(found.rises[1:], axis=1) < 0.0))
    warm = found.rises[middle]
    return [
        finding("cone-stroke", stroke[at]),
        finding("cone-level", float(np.interp(0.0, -found.end, found.temperature))),
        finding("cone-order", held=ordered and warm[0] > 0.0 > warm[-1],
                turns=", ".join(f"{rise:.1f}" for rise in warm)),
        finding("cone-plane", float(span.min()), low=2e3 * CONICAL.fibre.radius),
    ]  # fmt: skip


def speed(duration: float = 5.0, dt: float = 0.05) -> list[Finding]:
    """How much faster than published 30 g hang at 5 V, by processor time."""
    rows = []
    for theory in (ROD, CST):
        tcas = lifting(30, theory)
        if theory is ROD:  # the rod's own solver, with glued ends; the others are as fast
            tcas = LoadedTcas(tcas.specs, tcas.load)
        start, heating = tcas.rest(), Heating(source="voltage", value=5.0)
        tcas.simulate(start, heating, dt, 5)
        begin = time.thread_time()
        tcas.simulate(start, heating, dt, round(duration / dt))
        published, seconds = PUBLISHED_SPEED[theory.model], time.thread_time() - begin
        rows.append(finding("speed", published * duration / seconds, name=theory.name,
                            published=published))  # fmt: skip
    return rows


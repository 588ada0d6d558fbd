"""Strokes of the five types of TCA of Chapter 2, hanging in an oven.

"Sun" is J. Sun's dissertation, Colorado State University; weights are in grams, as printed there.
"""

import math
from dataclasses import replace
from itertools import product
from typing import Literal, NamedTuple, get_args

import numpy as np
from scipy.optimize import brentq

from tca_mj.checks import Array
from tca_mj.tca import CATALOGUE, LoadedTcas, TcaSpec, hanging_length
from tca_mj.tca.dynamics.loads import GRAVITY, Course, Heating
from tca_mj.tca.laws.creep import CreepBank, CreepState
from tca_mj.validation.facts import Finding, finding, words

Ends = Literal["free", "locked"]

# Sun, Table 2.1: groove [°], annealing [°C], made length, natural length [mm], free stroke [%].
TYPES = {
    "type-0-180": (11.53, 180.0, 70.0, 61.0, 5.7),
    "type-1-180": (15.57, 180.0, 94.0, 88.0, 20.4),
    "type-2-180": (22.54, 180.0, 133.5, 109.0, 35.7),
    "type-1-200": (15.57, 200.0, 96.0, 96.0, 27.2),
    "type-2-200": (22.54, 200.0, 134.0, 134.0, 48.0),
}
# Sun, Section 2.2.1: largest standard deviation of the displacements of Fig. 2.5 a to c [mm].
DEVIATION = 2.14
# Sun, Section 2.2.1: contractions from 25 to 150 °C [mm] under a weight [g].
CONTRACTIONS = {("type-0-180", 0): 4.0, ("type-1-180", 0): 20.0,
                ("type-0-180", 40): 24.0, ("type-1-180", 40): 44.0}  # fmt: skip
# What the lengths of Table 2.1 leave until the coils touch, its shortest lengths rounded [mm].
STOPS = {"type-0-180": 3.2, "type-1-180": 17.7}
THICKNESS = 0.34e-3  # of the thread, measured across, Sun, Table 2.1 [m]
_POINTS = 1.5  # allowed error of a free stroke, percentage points


def weight(grams: float) -> float:
    """Force of a mass in grams [N]."""
    return 1e-3 * grams * GRAVITY


def contraction(tca: TcaSpec, grams: float, hot: float, ends: Ends = "free") -> float:
    """Contraction of a hanging TCA from 25 °C to ``hot`` [mm]."""
    cold, warm = hanging_length(tca, [25.0, hot], weight(grams), spin=ends)
    return 1e3 * float(cold - warm)


def settled(tca: TcaSpec, grams: float) -> TcaSpec:
    """A TCA once it has crept under a weight."""
    bank = CreepBank([tca])
    return bank.crept(CreepState(bank.settled([weight(grams)])))[0]


def heat_up(
    tcas: LoadedTcas, source: Literal["voltage", "current"], value: float, dt: float, steps: int
) -> Course:
    """TCAs under their loads from rest, heated steadily and without inertia.

    Args:
        tcas: The TCAs and their loads.
        source: What is constant.
        value: How much it is [V, A].
        dt: Length of a step [s].
        steps: Number of steps.
    """
    heating = Heating(source=source, value=value)
    return tcas.simulate(tcas.rest(), heating, dt, steps, "quasistatic")


def free_strokes() -> list[Finding]:
    """Free strokes of Table 2.1 from the catalogue, and from fibre and mandrel."""
    rows = [finding("contact-length", 1e3 * CATALOGUE["type-2-180"].minimum_length)]
    for name, (*_, printed) in TYPES.items():
        key = "free-stroke-of-type-0" if name == "type-0-180" else "free-stroke"
        rows.append(finding(key, 100.0 * CATALOGUE[name].free_stroke, name=name, printed=printed,
                            low=printed - _POINTS, high=printed + _POINTS))  # fmt: skip
    return rows + from_mandrels()


def made_from_mandrel(name: str) -> TcaSpec:
    """A type of Table 2.1 from its thread, core and groove; raises ValueError for type 0.

    Where the table's angles and lengths disagree, the lengths are taken, as in the catalogue:
    350 mm at the 15.57° of types 1-180 and 1-200 are 93.9 mm, where it has 94 and 96 mm.
    """
    _, annealed, made, *_ = TYPES[name]
    if name == "type-0-180":
        raise ValueError(f"name must be a type coiled in a groove, got {name!r}")
    return TcaSpec.from_mandrel(
        fibre=replace(CATALOGUE[name].fibre, radius=THICKNESS / 2.0), fibre_length=0.350,
        core_diameter=0.405e-3, groove_pitch_angle=math.asin(made / 350.0),
        annealing_temperature=annealed, minimum_pitch_angle=math.radians(11.53),
        resistance_per_length=CATALOGUE[name].resistance_per_length,
    )  # fmt: skip


def from_mandrels() -> list[Finding]:
    """What annealing keeps of the made length, for types that are coiled in a groove."""
    kept = [100.0 * made_from_mandrel(name).rest_length / (1e-3 * TYPES[name][2])
            for name in ("type-1-180", "type-2-180")]  # fmt: skip
    rows = [finding("kept-length", kept[1], kept=kept),
            finding("free-stroke-of-type-0-from-mandrel")]  # fmt: skip
    for name in ("type-1-200", "type-2-200"):
        by_angle = 1.0 - math.sin(math.radians(11.53)) / math.sin(math.radians(TYPES[name][0]))
        printed, stroke = TYPES[name][4], 100.0 * made_from_mandrel(name).free_stroke
        rows.append(finding(
            "free-stroke-from-mandrel", stroke, name=name, printed=printed,
            low=printed - _POINTS, high=printed + _POINTS, by_angle=100.0 * by_angle,
        ))  # fmt: skip
    return rows


def contact_stops() -> list[Finding]:
    """Contraction without load to 150 °C: tests the contact stop and nothing else."""
    rows = []
    for name, stop in STOPS.items():
        printed = CONTRACTIONS[name, 0]
        low, high = max(stop, printed) - DEVIATION, min(stop, printed) + DEVIATION
        rows.append(finding("contact-stop", contraction(CATALOGUE[name], 0, 150.0), name=name,
                            printed=printed, low=low, high=high, stop=stop,
                            deviation=DEVIATION))  # fmt: skip
    return rows


Section = Literal["cold", "hot"]
Reference = Literal["natural", "crept"]


class Choice(NamedTuple):
    """One set of what the source leaves open."""

    radius: float  # of the thread [m]
    section: Section = "cold"
    ends: Ends = "free"
    reference: Reference = "natural"
    softened: bool = False  # by the load
    untwist: float = 1.0  # factor
    moduli: float = 1.0  # factor

    def tca(self, name: str) -> TcaSpec:
        """A type of the catalogue under this choice, without creep."""
        tca = CATALOGUE[name]
        return replace(tca, fibre=replace(
            tca.fibre, radius=self.radius, section=self.section, untwist_scale=self.untwist,
            young=self.moduli * tca.fibre.young, shear=self.moduli * tca.fibre.shear,
            load_softening=_LOADED if self.softened else (0.0, 0.0, 1.0),
        ))  # fmt: skip

    def contractions(self) -> Array:
        """The four contractions of ``CONTRACTIONS`` [mm], NaN where no modulus is left."""
        values = []
        for name, grams in CONTRACTIONS:
            tca = self.tca(name)
            try:
                if self.reference == "crept" and grams:
                    tca = settled(tca, grams)
                values.append(contraction(tca, grams, 150.0, self.ends))
            except ValueError:
                values.append(math.nan)
        return np.array(values)

    @property
    def words(self) -> str:
        """Its settings in words."""
        load = "softened by the load" if self.softened else "not softened by the load"
        text = (f"thread radius {1e3 * self.radius:g} mm, {self.section} section, {self.ends} ends,"
                f" {self.reference} reference, {load}")  # fmt: skip
        if (self.untwist, self.moduli) != (1.0, 1.0):
            text += f", untwist times {self.untwist:g}, moduli times {self.moduli:g}"
        return text


_LOADED = CATALOGUE["free-stroke"].fibre.load_softening
_RADII = (THICKNESS / 2.0, CATALOGUE["free-stroke"].fibre.radius)  # Tables 2.1 and 3.1


class Scan(NamedTuple):
    """Sets that were tried for the contractions, the best first, those without a modulus last.

    Attributes:
        choices: The sets.
        values: Their contractions in the order of ``CONTRACTIONS``, shape (k, 4) [mm].
        errors: Largest difference from what is printed, shape (k,) [mm].
    """

    choices: tuple[Choice, ...]
    values: Array
    errors: Array

    @classmethod
    def of(cls, choices: list[Choice]) -> "Scan":
        """Computes the contractions of all sets."""
        values = np.array([choice.contractions() for choice in choices])
        errors = np.abs(values - np.array(list(CONTRACTIONS.values()))).max(axis=1)
        order = np.argsort(errors)
        return cls(tuple(choices[i] for i in order), values[order], errors[order])


def scan_of_choices() -> Scan:
    """All sets of published constants: 2 radii, sections, ends, references, softening or not."""
    kinds = get_args(Section), get_args(Ends), get_args(Reference)
    return Scan.of([Choice(*each) for each in product(_RADII, *kinds, (False, True))])


def scan_of_factors() -> Scan:
    """The sets without creep and softening, with untwist and moduli scaled to fit."""
    untwist, moduli = np.arange(0.8, 2.7, 0.2), (0.7, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)
    kinds = product(_RADII, get_args(Section), get_args(Ends), untwist, moduli)
    return Scan.of([
        Choice(radius, section, ends, untwist=round(float(u), 2), moduli=m)
        for radius, section, ends, u, m in kinds
    ])  # fmt: skip


def loaded_contractions(*, scanned: bool = False) -> list[Finding]:
    """Contractions under 40 g, and what scans of everything that is open give, if ``scanned``."""
    none, one = (hanging_length(tca, 25.0, weight(40)) - tca.rest_length
                 for tca in (CATALOGUE[name] for name in STOPS))  # fmt: skip
    between = 1e3 * float(one - none)  # cold stretch of type 1 less that of type 0 [mm]
    scans = f" {_scans()}" if scanned else ""
    return [
        finding("loaded-contraction", contraction(CATALOGUE[name], 40, 150.0), name=name,
                printed=mm, low=mm - DEVIATION, high=mm + DEVIATION, less=-between,
                touching=14.5 + between, scans=scans)
        for name, mm in ((name, CONTRACTIONS[name, 40]) for name in STOPS)
    ]  # fmt: skip


def _scans() -> str:
    """The best of both scans, in words."""
    scan, factors = scan_of_choices(), scan_of_factors()
    best, fitted_best = (" / ".join(f"{mm:.1f}" for mm in each.values[0])
                         for each in (scan, factors))  # fmt: skip
    return words("scans", scan=scan, sets=len(scan.choices), best=best, fitted_best=fitted_best,
                 factors=factors, scaled=len(factors.choices), deviation=DEVIATION)  # fmt: skip


def loaded_stroke() -> list[Finding]:
    """Stroke of type 2-200 under 10 g, until its coils touch."""
    tca, load = CATALOGUE["type-2-200"], weight(10)
    annealed = TYPES["type-2-200"][1]
    cold, data, hot = hanging_length(tca, [25.0, 160.0, annealed], load)

    def above_contact(temperature: float, grams: float) -> float:
        return float(hanging_length(tca, temperature, weight(grams))) - tca.minimum_length

    meets, bare = (brentq(lambda hot, w=grams: above_contact(hot, w), 120.0, 250.0, xtol=0.1)
                   for grams in (10.0, 0.0))  # fmt: skip
    return [
        finding("loaded-stroke", 100.0 * float(1.0 - hot / cold), annealed=annealed, meets=meets,
                touching=100.0 * (1.0 - tca.minimum_length / float(cold)), bare=bare,
                data=100.0 * float(1.0 - data / cold)),
        finding("breaking-force", tca.breaking_tension),
    ]  # fmt: skip


def overlaps(tca: TcaSpec) -> tuple[float, float]:
    """How far curves of 0, 20 and 40 g are from their mean below 70 °C, and at 150 °C [mm]."""
    hot = np.linspace(25.0, 150.0, 51)[:, None]
    length = hanging_length(tca, hot, weight(1.0) * np.array([0.0, 20.0, 40.0]))
    moved = 1e3 * (length[0] - length)
    off = np.abs(moved - moved.mean(axis=1, keepdims=True)).max(axis=1)
    return float(off[hot[:, 0] <= 70.0].max()), float(off[-1])


def overlap() -> list[Finding]:
    """Below 70 °C the curves of 0, 20 and 40 g nearly overlap."""
    found = {name: overlaps(CATALOGUE[name]) for name in STOPS}
    return [finding("overlap", early, early <= DEVIATION, name=name, late=late, deviation=DEVIATION)
            for name, (early, late) in found.items()]  # fmt: skip

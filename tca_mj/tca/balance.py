"""Balance of one TCA: the law of a model, softening, hot section and contact together."""

from typing import Literal, NamedTuple

import numpy as np

from tca_mj.tca import castigliano
from tca_mj.tca.castigliano import Scheme, cst_law, first_guess
from tca_mj.tca.coilrod import CoilSolveError
from tca_mj.tca.laws import (
    ALL,
    Array,
    Coil,
    Equation,
    Heated,
    Law,
    Mask,
    Point,
    Spin,
    love_law,
    love_unloaded,
    rod_law,
    solve,
)
from tca_mj.tca.moduli import radial_growth, softened, softening, untwist
from tca_mj.tca.spec import TcaSpec

Model = Literal["rod", "love", "cst"]

_SHORTEST = 0.5  # of the minimum length: domain of the laws, as that of CoilRods
_LONGEST = 0.98  # of the fibre length: domain of the laws, as that of CoilRods
_STEPS = 4
_SOLVED = 1e-9  # error in s that a solution may have; it is 1e-13 unless there is none


class Balance(NamedTuple):
    """One TCA in one model; all arrays have one dimension and the same length.

    Attributes:
        tca: The TCA.
        coil: Its constants.
        law: The model's force and length over s.
        model: Name of the model.
        spin: Whether an end may spin.
        scheme: Scheme of "cst".
        torsion_per_tension: tau/F = r_t cos(alpha*)/(G_0 J) with the cold section, Sun, Section
            3.2.2 with the fibre's radius; a hot section has 1/g^3 of it [rad/(m N)].
        contact: Stiffness of the coils pressed together [N/m].
        shortest: Lower end of the domain of lengths [m].
        longest: Upper end [m].
    """

    tca: TcaSpec
    coil: Coil
    law: Law
    model: Model
    spin: Spin
    scheme: Scheme
    torsion_per_tension: float
    contact: float
    shortest: float
    longest: float

    @classmethod
    def of(cls, tca: TcaSpec, model: Model, spin: Spin, scheme: Scheme) -> "Balance":
        """Prepares a model of a TCA."""
        coil = Coil.of(tca)
        if model == "cst":
            law = cst_law(coil, spin, scheme)
        elif model == "love" and spin == "locked":
            law = love_law(coil)
        else:
            law = rod_law(coil, spin, rigid=model == "love")
        at_rest, _ = castigliano.compliance(coil, "locked", coil.sin, 1.0)
        return cls(
            tca=tca,
            coil=coil,
            law=law,
            model=model,
            spin=spin,
            scheme=scheme,
            torsion_per_tension=tca.fibre.radius * tca.winding * tca.coil_radius / coil.torsion,
            contact=tca.contact_ratio / (tca.fibre_length * float(at_rest)),
            shortest=_SHORTEST * tca.minimum_length,
            longest=_LONGEST * tca.fibre_length,
        )

    def heated(self, temperature: Array) -> Heated:
        """What the temperatures [°C] do to the coil; errors as ``untwist``, ``love_unloaded``."""
        twist = untwist(self.tca.fibre, temperature)
        growth2 = np.ones(())
        if self.tca.fibre.section == "hot":
            growth2 = np.square(1.0 + radial_growth(self.tca.fibre, temperature))
        if self.model == "cst":
            start = castigliano.unloaded(self.coil, self.spin, self.scheme, twist)
        elif self.model == "love" and self.spin == "locked":
            start = love_unloaded(self.coil, twist, temperature)
        else:
            start = castigliano.unloaded(self.coil, "free", "implicit", twist)
        return Heated(twist, growth2, start)

    def hang(self, temperature: Array, load: Array) -> Array:
        """Lengths [m] at which the coil carries loads [N]; see ``statics.hanging_length``."""
        heated = self.heated(temperature)
        share = self.softened(heated, temperature, load) * np.square(heated.growth2)
        force = load / share

        def equation(mask: Mask) -> Equation:
            part, goal = heated.part(mask), force[mask]

            def excess(sin: Array) -> tuple[Array, Array]:
                point = self.law(part, sin)
                return point.force - goal, point.force_slope

            return excess

        sin = solve(equation, first_guess(self.coil, heated, force), -1.0, 1.0, _STEPS)
        point = self.at(heated, sin)
        length = point.ratio * self.tca.fibre_length
        error = np.abs((point.force - force) / point.force_slope)
        touching = (length < self.tca.minimum_length) | (np.isnan(length) & (sin < 0.0))
        if touching.any():
            part = heated.part(touching)
            length[touching], error[touching] = self.press(
                part, temperature[touching], load[touching]
            )
        self.check_load(length, temperature, load)
        _check_solved(error)
        return length

    def press(self, heated: Heated, temperature: Array, load: Array) -> tuple[Array, Array]:
        """Lengths of coils that touch [m]: solves tension(s) = load; and the error left in s."""

        def equation(mask: Mask) -> Equation:
            part, hot, goal = heated.part(mask), temperature[mask], load[mask]

            def excess(sin: Array) -> tuple[Array, Array]:
                point = self.law(part, sin)
                force, left = self.loaded(part, hot, point.force)
                push, push_slope = self.push(point.ratio * self.tca.fibre_length)
                slope = push_slope * self.tca.fibre_length * point.ratio_slope
                return force - push - goal, left * point.force_slope + slope

            return excess

        # Where the contact has set in by half.
        depth = 1.0 - 0.5 * self.tca.contact_smoothing
        start = np.full_like(load, depth * self.tca.minimum_length / self.tca.fibre_length)
        sin = solve(equation, start, -1.0, 1.0, _STEPS)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            value, slope = equation(ALL)(sin)
        return self.at(heated, sin).ratio * self.tca.fibre_length, np.abs(value / slope)

    def pull(self, length: Array, temperature: Array) -> tuple[Array, Array]:
        """Tensions [N] and slopes [N/m] at lengths [m]; see ``statics.tension``."""
        heated = self.heated(temperature)
        target = length / self.tca.fibre_length

        def equation(mask: Mask) -> Equation:
            part, goal = heated.part(mask), target[mask]

            def excess(sin: Array) -> tuple[Array, Array]:
                point = self.law(part, sin)
                return point.ratio - goal, point.ratio_slope + 0.0 * sin

            return excess

        sheared = self.model == "rod"  # elsewhere length/fibre_length is s itself
        sin = solve(equation, target, -1.0, 1.0, _STEPS) if sheared else target
        point = self.at(heated, sin)
        _check_solved(np.abs(point.ratio - target))
        force, left = self.loaded(heated, temperature, point.force)
        push, push_slope = self.push(length)
        slope = left * point.force_slope / (point.ratio_slope * self.tca.fibre_length)
        return force - push, slope + push_slope

    def at(self, heated: Heated, sin: Array) -> Point:
        """The law at s; NaN where a rod has no such state."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            return self.law(heated, sin)

    def loaded(self, heated: Heated, temperature: Array, force: Array) -> tuple[Array, Array]:
        """True force of the coils and its slope over phi."""
        growth4 = np.square(heated.growth2)
        ratio = self.torsion_ratio(heated)
        force, left = softened(self.tca.fibre, temperature, force * growth4, ratio)
        return force, left * growth4

    def push(self, length: Array) -> tuple[Array, Array]:
        """Push of touching coils and -d/dl of it: zero, then a parabola, then a line."""
        onset = self.tca.contact_smoothing * self.tca.minimum_length
        depth = np.maximum(self.tca.minimum_length - length, 0.0)
        share = np.minimum(depth, onset) / onset
        beyond = np.maximum(depth - onset, 0.0)
        return self.contact * (0.5 * onset * share * share + beyond), self.contact * share

    def torsion_ratio(self, heated: Heated) -> Array:
        """tau/F with the section as it is: r_t/J [rad/(m N)]."""
        return self.torsion_per_tension / (heated.growth2 * np.sqrt(heated.growth2))

    def softened(self, heated: Heated, temperature: Array, load: Array) -> Array:
        """Share of the moduli that heat and load leave; the errors tell which is too much."""
        fibre, ratio = self.tca.fibre, self.torsion_ratio(heated)
        softening(fibre, temperature)
        try:
            return softening(fibre, temperature, ratio * load)
        except ValueError as error:
            # The largest torsion: fall (mu2 tau^2 + mu1 tau + mu0) = 1.
            fall = fibre.softening_rate * (temperature - fibre.reference_temperature)
            mu2, mu1, mu0 = fibre.load_softening
            rest = 1.0 / np.maximum(fall, 1e-300) - mu0
            bound = 2.0 * rest / (mu1 + np.sqrt(mu1 * mu1 + 4.0 * mu2 * rest))
            bound = bound / ratio
            i = int(np.argmax(load / bound))
            raise ValueError(
                f"load = {load[i]} N leaves no modulus at {temperature[i]} °C; "
                f"it must be below {bound[i]} N"
            ) from error

    def check_load(self, length: Array, temperature: Array, load: Array) -> None:
        """Raises ValueError with the bound if a load's length is outside the domain."""
        short, far = length < self.shortest, ~(length <= self.longest)
        for wrong, edge, word in (
            (far, self.longest, "at most"),
            (short, self.shortest, "at least"),
        ):
            if wrong.any():
                i = int(np.argmax(wrong))
                bound, _ = self.pull(np.array([edge]), temperature[i : i + 1])
                raise ValueError(
                    f"load = {load[i]} N at {temperature[i]} °C has no length between "
                    f"{self.shortest} and {self.longest} m; it must be {word} {bound[0]} N"
                )


def _check_solved(error: Array) -> None:
    if not (error <= _SOLVED).all():
        raise CoilSolveError(float(np.nan_to_num(error, nan=np.inf).max()))

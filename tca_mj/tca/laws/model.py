"""One TCA in one model: the model's law, softening, hot section and contact together."""

from collections.abc import Callable
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from tca_mj.checks import Array
from tca_mj.tca.laws import castigliano
from tca_mj.tca.laws.castigliano import Scheme, cst_law, first_guess
from tca_mj.tca.laws.coil import ALL, Coil, Heated, Law, Mask, Spin, rod_law, solve
from tca_mj.tca.laws.love import love_law, love_unloaded
from tca_mj.tca.laws.rod import CoilRods, Point
from tca_mj.tca.laws.roots import CoilSolveError, Equation
from tca_mj.tca.moduli import radial_growth, softening, untwist
from tca_mj.tca.spec import TcaSpec

Model = Literal["rod", "love", "cst"]
Excess = Callable[[Mask, Heated, Point], tuple[Array, Array | float]]
"""Value and slope over s for the elements of a mask: these heated, and the law at s."""

_STEPS = 4
_SOLVED = 1e-9  # error in s that a solution may have; it is 1e-13 unless there is none


class CoilModel(NamedTuple):
    """One TCA in one model; all arrays have one dimension and the same length.

    Attributes:
        tca: The TCA.
        rods: The same as a rod, for what all models share: domain, softening and contact.
        coil: Its constants.
        law: The model's force and length over s.
        unloaded: From the untwist [rad/m] to s of the heated coil without load.
        sheared: Whether length/fibre_length is not s itself.
    """

    tca: TcaSpec
    rods: CoilRods
    coil: Coil
    law: Law
    unloaded: Callable[[Array], Array]
    sheared: bool

    @classmethod
    def of(cls, tca: TcaSpec, model: Model, spin: Spin, scheme: Scheme) -> "CoilModel":
        """Prepares a model of a TCA."""
        coil = Coil.of(tca)
        if model == "love" and spin == "locked":
            law, unloaded = love_law(coil), partial(love_unloaded, coil)
        elif model == "cst":
            law = cst_law(coil, spin, scheme)
            unloaded = partial(castigliano.unloaded, coil, spin, scheme)
        else:
            law = rod_law(coil, spin, rigid=model == "love")
            unloaded = partial(castigliano.unloaded, coil, "free", "implicit")
        return cls(tca, CoilRods([tca]), coil, law, unloaded, model == "rod")

    @property
    def domain(self) -> tuple[float, float]:
        """Shortest and longest length of the law [m]."""
        return float(self.rods.shortest[0]), float(self.rods.longest[0])

    def heated(self, temperature: Array) -> Heated:
        """What the temperatures [°C] do to the coil; errors as ``untwist``, ``love_unloaded``."""
        twist = untwist(self.tca.fibre, temperature)
        growth2 = np.ones(())
        if self.tca.fibre.section == "hot":
            growth2 = np.square(1.0 + radial_growth(self.tca.fibre, temperature))
        return Heated(twist, growth2, self.unloaded(twist))

    def hang(self, temperature: Array, load: Array) -> Array:
        """Lengths [m] at which the coil carries loads [N]; see ``statics.hanging_length``."""
        heated = self.heated(temperature)
        force = load / (self.softened(temperature, load) * np.square(heated.growth2))
        sin = self.solved(
            heated, first_guess(self.coil, heated, force),
            lambda mask, _, point: (point.force - force[mask], point.force_slope),
        )  # fmt: skip
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
        fibre_length = self.tca.fibre_length

        def excess(mask: Mask, part: Heated, point: Point) -> tuple[Array, Array]:
            length = point.ratio * fibre_length
            tension, slope = self.finished(part, temperature[mask], point, length)
            return tension - load[mask], slope * point.ratio_slope * fibre_length

        # Where the contact has set in by half.
        depth = 1.0 - 0.5 * self.tca.contact_smoothing
        start = np.full_like(load, depth * self.tca.minimum_length / fibre_length)
        point = self.at(heated, self.solved(heated, start, excess))
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            value, slope = excess(ALL, heated, point)
        return point.ratio * fibre_length, np.abs(value / slope)

    def tension(self, length: Array, temperature: Array) -> tuple[Array, Array]:
        """Tensions [N] and slopes [N/m] at lengths [m]; see ``statics.tension``."""
        heated = self.heated(temperature)
        sin = target = length / self.tca.fibre_length
        if self.sheared:
            sin = self.solved(
                heated, target,
                lambda mask, _, point: (point.ratio - target[mask], point.ratio_slope),
            )  # fmt: skip
        point = self.at(heated, sin)
        _check_solved(np.abs(point.ratio - target))
        return self.finished(heated, temperature, point, length)

    def solved(self, heated: Heated, start: Array, excess: Excess) -> Array:
        """s at which what rises with s is 0."""

        def equation(mask: Mask) -> Equation:
            part = heated.part(mask)
            return lambda sin: excess(mask, part, self.law(part, sin))

        return solve(equation, start, -1.0, 1.0, _STEPS)

    def at(self, heated: Heated, sin: Array) -> Point:
        """The law at s; NaN where a rod has no such state."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            return self.law(heated, sin)

    def finished(
        self, heated: Heated, temperature: Array, point: Point, length: Array
    ) -> tuple[Array, Array]:
        """True tension, softened and with the contact, and its slope over the length."""
        growth4 = np.square(heated.growth2)
        slope = growth4 * point.force_slope / (point.ratio_slope * self.tca.fibre_length)
        return self.rods.finished(length, temperature, point.force * growth4, slope)

    def softened(self, temperature: Array, load: Array) -> Array:
        """Share of the moduli that heat and load leave; the errors tell which is too much."""
        fibre, ratio = self.tca.fibre, self.rods.torsion_per_tension(temperature)
        softening(fibre, temperature)
        try:
            return softening(fibre, temperature, ratio * load)
        except ValueError as error:
            # The largest torsion: fall (mu2 tau^2 + mu1 tau + mu0) = 1.
            fall = fibre.softening_rate * (temperature - fibre.reference_temperature)
            mu2, mu1, mu0 = fibre.load_softening
            rest = 1.0 / np.maximum(fall, 1e-300) - mu0
            bound = 2.0 * rest / (mu1 + np.sqrt(mu1 * mu1 + 4.0 * mu2 * rest)) / ratio
            i = int(np.argmax(load / bound))
            raise ValueError(
                f"load must be below {bound[i]} N, which leaves no modulus at {temperature[i]} °C,"
                f" got {load[i]} N"
            ) from error

    def check_load(self, length: Array, temperature: Array, load: Array) -> None:
        """Raises ValueError with the bound if a load's length is outside the domain."""
        shortest, longest = self.domain
        for wrong, edge, word in (
            (~(length <= longest), longest, "at most"), (length < shortest, shortest, "at least"),
        ):  # fmt: skip
            if wrong.any():
                i = int(np.argmax(wrong))
                bound, _ = self.tension(np.array([edge]), temperature[i : i + 1])
                raise ValueError(
                    f"load must be {word} {bound[0]} N at {temperature[i]} °C to have a length"
                    f" between {shortest} and {longest} m, got {load[i]} N"
                )


def _check_solved(error: Array) -> None:
    if not (error <= _SOLVED).all():
        raise CoilSolveError(float(np.nan_to_num(error, nan=np.inf).max()))

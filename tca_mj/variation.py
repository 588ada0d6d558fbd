"""How far a robot differs from its description: friction, mass, muscle gain, heat loss, ambient.

What is learned or tuned on one robot has to work on the next, whose figures are a few per cent
off. ``Nominal`` keeps the figures that a simulation was built with and scales from them, never
from what it scaled before: applying twice is applying once, and factors of one bring back the
simulation as it was built, bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np

from tca_mj.checks import Checked, bounds, door, instance, number, require_one_of, shown
from tca_mj.drive import Ambient
from tca_mj.sim import Simulation
from tca_mj.smp import HeaterSpec
from tca_mj.tca import HeatSpec

Heat = TypeVar("Heat", HeatSpec, HeaterSpec)

AMBIENT = 25.0  # temperature of the surroundings if nothing is said [°C]
MOST_SPREAD = 0.95  # of factors, none of which may be below its bound
AMBIENT_SPREAD = 25.0  # what a spread of 1 means for it [K]

# Arrays of a model that are proportional to all masses, to their inverse, and to friction. The
# inverse ones, which MuJoCo takes at compilation, set how soft contacts and limits are.
_MASSES = ("body_mass", "body_inertia", "body_subtreemass", "dof_M0")
_INVERSE = ("body_invweight0", "dof_invweight0", "tendon_invweight0")
_FRICTION = ("geom_friction",)


# By how much a robot can be off: as far as the robots of all tasks come to rest, move and are seen
# within the bounds of their observations.
_Friction = Annotated[float, partial(number, at_least=0.01, at_most=10.0)]
_Mass = Annotated[float, partial(number, at_least=0.05, at_most=10.0)]
_Gain = Annotated[float, partial(number, at_least=0.05, at_most=5.0)]
_Loss = Annotated[float, partial(number, at_least=0.05, at_most=10.0)]


@dataclass(frozen=True, kw_only=True, slots=True)
class Variation(Checked):
    """Factors over what a simulation was built with, and the temperature of its surroundings.

    Attributes:
        friction: Of all coefficients of friction, 0.01 to 10 [1].
        mass: Of all masses and inertias, 0.05 to 10 [1].
        tca_gain: Of the tension of every TCA, and so of its slope, 0.05 to 5 [1].
        heat_loss: Of the heat that TCAs, the bodies that they lie in and spines lose per excess
            temperature, 0.05 to 10 [1].
        ambient: Temperature of the surroundings, at which everything starts, -40 to 60 °C [°C].

    Raises:
        ValueError: If a number is out of these bounds.
    """

    friction: _Friction = 1.0
    mass: _Mass = 1.0
    tca_gain: _Gain = 1.0
    heat_loss: _Loss = 1.0
    ambient: Ambient = AMBIENT

    @classmethod
    def bounds(cls, name: str) -> tuple[float, float]:
        """Least and largest value of a field.

        Raises:
            ValueError: If there is no such field.
        """
        require_one_of("name", name, cls.names())
        return bounds(get_type_hints(cls, include_extras=True)[name])

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the fields, in the order of ``drawn``."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    @door
    def drawn(cls, draws: Sequence[float], spread: float) -> Variation:
        """A variation from one uniform draw for each field.

        Args:
            draws: Numbers between -1 and 1, one for each of ``names``.
            spread: Factors are 1 + spread times a draw, the ambient temperature is 25 °C + 25 K
                times spread times the last one; 0 to 0.95.

        Raises:
            ValueError: If numbers are missing or out of range.
        """
        if len(draws) != len(cls.names()) or not all(-1.0 <= draw <= 1.0 for draw in draws):
            raise ValueError(
                f"draws must be {len(cls.names())} within -1 and 1, got {shown(draws)}"
            )
        number("spread", spread, at_least=0.0, at_most=MOST_SPREAD)
        *factors, last = (spread * float(draw) for draw in draws)
        friction, mass, tca_gain, heat_loss = (1.0 + factor for factor in factors)
        return cls(
            friction=friction,
            mass=mass,
            tca_gain=tca_gain,
            heat_loss=heat_loss,
            ambient=AMBIENT + AMBIENT_SPREAD * last,
        )


class Nominal:
    """What a simulation was built with.

    Attributes:
        variation: What was applied last.
        heat: Thermal constants of the TCAs.
    """

    @door
    def __init__(self, sim: Simulation) -> None:
        """Keeps the figures of a simulation.

        Args:
            sim: The simulation, to which no variation has been applied.
        """
        self._sim = sim
        self._figures = {
            name: getattr(sim.model, name).copy() for name in _MASSES + _INVERSE + _FRICTION
        }
        self.heat = sim.bank.heat
        self._heater = sim.spines.bank.heater if sim.spines.n else None
        self._last: Any = None, None  # heat loss and ambient of before, and what they made
        self._gain = sim.gain
        self.variation = Variation()

    def apply(self, variation: Variation) -> None:
        """Makes the simulation that of a robot that is off by ``variation``.

        To be followed by ``Simulation.reset``: the temperatures and tensions that the simulation
        has at the moment are those of before.
        """
        instance("variation", variation, Variation)
        sim, model = self._sim, self._sim.model
        for names, factor in (
            (_MASSES, variation.mass),
            (_INVERSE, 1.0 / variation.mass),
            (_FRICTION, variation.friction),
        ):
            for name in names:
                getattr(model, name)[:] = factor * self._figures[name]
        sim.gain = self._gain * variation.tca_gain
        sim.bank.heat, heater = self._heats(variation.heat_loss, variation.ambient)
        if heater is not None:
            sim.spines.bank.heater = heater
        self.variation = variation

    def _heats(self, loss: float, ambient: float) -> tuple[HeatSpec, HeaterSpec | None]:
        """Constants of TCAs and spines; what a bank has computed from the last ones holds on."""
        if (loss, ambient) != self._last[0]:
            more = {name: loss * getattr(self.heat, name) for name in ("conductance", "body_loss")}
            heater = None if self._heater is None else _varied(self._heater, loss, ambient)
            self._last = (loss, ambient), (_varied(self.heat, loss, ambient, **more), heater)
        return self._last[1]


def _varied(heat: Heat, factor: float, ambient: float, **more: Any) -> Heat:
    loss = factor * np.asarray(heat.loss)
    return replace(heat, loss=loss, ambient=np.full_like(loss, ambient), **more)

"""Reset options as a table: name, shape, bounds, and how each is drawn if it is not given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tca_mj.checks import (
    Checked,
    Count,
    Edge,
    Finite,
    door,
    instance,
    require_one_of,
    shown,
    within,
)  # fmt: skip
from tca_mj.hints import nearest
from tca_mj.variation import AMBIENT, AMBIENT_SPREAD, Variation

Setup = dict[str, Any]
"""What an episode begins with: a value for every option of the task."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Option(Checked):
    """A row of the table.

    Attributes:
        name: What it is called.
        about: What it means, in a few words.
        unit: Unit, ``-`` for none.
        shape: Shape of the numbers.
        low: Lower bound of each of them [``unit``].
        high: Upper bound [``unit``].
        choices: What can be chosen, if it is no number.
        draw: Its value if none is given, from the episode's generator and the rows above; it is
            called in any case, so that a value that is given shifts no other draw. None for one of
            the choices, or evenly between the bounds.
        drawn: How that is done, in a few words.
        check: Raises a ``ValueError`` for a value that bounds do not exclude.

    Raises:
        ValueError: If there is nothing to draw from, or a field is not of its kind.
    """

    name: str
    about: str
    draw: Callable[[np.random.Generator, Setup], Any] | None = None
    drawn: str = "drawn"
    unit: str = "-"
    shape: tuple[int, ...] = ()
    low: Edge = -np.inf
    high: Edge = np.inf
    choices: tuple[str, ...] = ()
    check: Callable[[Any], None] | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        bounded = self.choices or np.isfinite([self.low, self.high]).all()
        if self.draw is None and not bounded:
            raise ValueError(
                f"draw of {self.name} must be given where a bound is infinite, got None between"
                f" {self.low} and {self.high}"
            )

    def value(self, random: np.random.Generator, setup: Setup) -> Any:
        """Its value if none is given, drawn after those in ``setup``."""
        if self.draw is not None:
            return self.draw(random, setup)
        if self.choices:
            return str(random.choice(self.choices))
        return random.uniform(self.low, self.high, self.shape or None)

    def checked(self, value: Any) -> Any:
        """A value that was given: a string, a float or an array.

        Raises:
            ValueError: If it cannot be.
        """
        if self.choices:
            return require_one_of(self.name, value, sorted(self.choices))
        array = within(self.name, value, shape=self.shape).copy()
        if array.min() < self.low - 1e-9 or array.max() > self.high + 1e-9:
            raise ValueError(
                f"{self.name} must be between {self.low:.6g} and {self.high:.6g}"
                f"{'' if self.unit == '-' else ' ' + self.unit}, got {shown(value)}"
            )
        if self.check is not None:
            self.check(array)
        return array if self.shape else float(array)


class Options:
    """The options of a task's ``reset``.

    Attributes:
        rows: The rows, in the order in which they are drawn.
    """

    @door
    def __init__(self, rows: Sequence[Option]) -> None:
        self.rows = tuple(rows)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rows."""
        return tuple(row.name for row in self.rows)

    def setup(self, random: np.random.Generator, given: Mapping[str, Any]) -> Setup:
        """A value for every option: the one that is given, or else one that is drawn.

        Raises:
            ValueError: If an option is unknown or cannot have its value.
        """
        instance("random", random, np.random.Generator)
        instance("options", given, Mapping)
        unknown = [key for key in given if key not in self.names]
        if unknown:
            raise ValueError(
                f"options must be some of {sorted(self.names)}, got {shown(unknown)}"
                f"{nearest(unknown[0], self.names)}"
            )
        found: Setup = {}
        for row in self.rows:
            drawn = row.value(random, found)
            found[row.name] = row.checked(given[row.name]) if row.name in given else drawn
        return found

    def markdown(self) -> str:
        """The table as Markdown, for the documentation."""
        lines = ["| option | what | values | unit | by default |", "|---|---|---|---|---|"]
        for row in self.rows:
            values = " or ".join(f'`"{choice}"`' for choice in row.choices)
            if not values:
                bounds = (row.low, row.high)
                values = " to ".join(f"{bound:.4g}" for bound in bounds if np.isfinite(bound))
                values = (f"{row.shape[0]} numbers, " if row.shape else "") + (values or "any")
            lines.append(f"| `{row.name}` | {row.about} | {values} | {row.unit} | {row.drawn} |")
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Constant:
    """Draws nothing, and gives a value.

    Attributes:
        value: The value.
    """

    value: Any

    def __call__(self, random: np.random.Generator, setup: Setup) -> Any:
        return self.value


@dataclass(frozen=True, slots=True)
class Uniform(Checked):
    """Draws numbers between two others, in the unit of the option.

    Attributes:
        low: Least number [unit of the option].
        high: Largest number [unit of the option].
        size: How many; None for one number, which is no array.
    """

    low: Finite
    high: Finite
    size: Count | None = None

    def __call__(self, random: np.random.Generator, setup: Setup) -> Any:
        return random.uniform(self.low, self.high, self.size)


@dataclass(frozen=True, slots=True)
class _Varied:
    """Draws a field of ``Variation`` by the spreads that are options, too."""

    name: str

    def __call__(self, random: np.random.Generator, setup: Setup) -> float:
        spread = setup["randomise"]
        if self.name == "friction":
            spread = max(spread, setup["randomise_friction"])
        share = float(spread * random.uniform(-1.0, 1.0))
        return AMBIENT + AMBIENT_SPREAD * share if self.name == "ambient" else 1.0 + share


def variation_options() -> tuple[Option, ...]:
    """By how much the robot is off: spreads, then the fields of ``Variation``."""
    about = {
        "friction": "factor of all coefficients of friction",
        "mass": "factor of all masses and inertias",
        "tca_gain": "factor of the tension of every TCA",
        "heat_loss": "factor of the heat that TCAs, what they lie in, and spines lose",
        "ambient": "temperature of the surroundings, at which everything starts",
    }
    return (
        Option(
            name="randomise", about="share by which the robot is off; 0.2 is 20 % and 5 K",
            low=0.0, high=0.5, draw=Constant(0.0), drawn="0",
        ),
        Option(
            name="randomise_friction", about="the same of its friction, if that is more",
            low=0.0, high=0.5, draw=Constant(0.0), drawn="0",
        ),
        *(
            Option(
                name=name, about=about[name], draw=_Varied(name),
                low=Variation.bounds(name)[0], high=Variation.bounds(name)[1],
                unit="°C" if name == "ambient" else "-",
                drawn="25, or drawn" if name == "ambient" else "1, or drawn",
            )
            for name in Variation.names()
        ),
    )  # fmt: skip


def variation_of(setup: Setup) -> Variation:
    """By how much the robot of an episode is off.

    Raises:
        ValueError: If a figure cannot be.
    """
    return Variation(**{name: setup[name] for name in Variation.names()})

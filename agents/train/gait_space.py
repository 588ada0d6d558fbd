"""Gaits as points of a unit cube, in which a search may look for better ones."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, door, number, within
from tca_mj.control import Gait

Array = NDArray[np.float64]

# Bounds of the search. Estimates, wide about all scripted gaits.
PERIOD = (2.0, 20.0)  # [s], on a logarithmic scale
DUTY = (0.05, 0.95)
COOLEST = 60.0  # least temperature of what is hot [°C]
COLD = 25.0  # a TCA is kept between here and ``hot`` where it is not hot [°C]
STEERING = (0.0, 1200.0)  # [K/rad]

_FRONT, _REAR = slice(0, 2), slice(2, 4)  # left and right leg of each pair
_PAIRS = {"front": _FRONT, "rear": _REAR}
_TCAS = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitSpace(Checked):
    """Gaits of four legs with three TCAs whose left and right legs share their figures.

    Every number of ``encode`` lies between 0 and 1: the period; the offsets of all legs but the
    first; for front and rear pair the start of all TCAs but the first, and duty, hot and warm of
    all; the steering of each pair. Offsets and starts are cyclic and have those of ``centre`` at
    0.5; what is left out only shifts the others. Warm is a share of the way from 25 °C to hot.

    Attributes:
        centre: The gait about which offsets and starts are counted.
        hottest: Largest temperature of a gait, above 60 up to 400 °C [°C].

    Raises:
        ValueError: If it has not four legs with three TCAs, or is not the same left and right.
    """

    centre: Gait
    hottest: Annotated[float, partial(number, above=COOLEST, at_most=400.0, unit="°C")]

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.centre.table("start").shape != (4, _TCAS):
            raise ValueError(
                f"centre must have 4 legs with {_TCAS} TCAs, got {self.centre.table('start').shape}"
            )
        for name in ("start", "duty", "hot", "warm"):
            table = self.centre.table(name)
            if not all((table[pair][0] == table[pair][1]).all() for pair in _PAIRS.values()):
                raise ValueError(f"{name} must be the same left and right, got {table.tolist()}")

    @property
    def names(self) -> tuple[str, ...]:
        """What the numbers of a point stand for."""
        found = ["period", "offset1", "offset2", "offset3"]
        for pair in _PAIRS:
            found += [f"{pair}.start{i}" for i in range(1, _TCAS)]
            found += [f"{pair}.{name}{i}" for name in ("duty", "hot", "warm") for i in range(_TCAS)]
            found.append(f"{pair}.steering")
        return tuple(found)

    def fold(self, point: Array) -> Array:
        """Brings finite numbers into the cube: cyclic ones go round, others are reflected."""
        point = within("point", point, shape=(len(self.names),))
        cyclic = np.array(["offset" in name or ".start" in name for name in self.names])
        mirrored = 1.0 - np.abs(point % 2.0 - 1.0)
        return np.where(cyclic, point % 1.0, mirrored)

    @door
    def encode(self, gait: Gait, steering: tuple[float, ...]) -> Array:
        """The point of a gait, shape (n,); what is out of bounds goes to the nearest bound.

        Args:
            gait: A gait of the same left and right.
            steering: One number per leg, those of a pair the same [K/rad].

        Raises:
            ValueError: If left and right differ, or there are not four numbers.
        """
        replace(self, centre=gait)
        within("steering", steering, shape=(4,))
        if any(steering[pair][0] != steering[pair][1] for pair in _PAIRS.values()):
            raise ValueError(f"steering must be the same left and right, got {steering}")
        offset, start = np.array(gait.offset), gait.table("start")
        shift = start[:, 0] - self.centre.table("start")[:, 0]
        offset, start = offset - shift, start - shift[:, None]
        offset -= offset[0] - self.centre.offset[0]
        point = [_share(math.log(gait.period), *np.log(PERIOD))]
        point += list((offset - self.centre.offset + 0.5)[1:] % 1.0)
        for pair in _PAIRS.values():
            i = pair.start
            point += list((start[i] - self.centre.table("start")[i] + 0.5)[1:] % 1.0)
            hot = gait.table("hot")[i]
            point += [_share(duty, *DUTY) for duty in gait.table("duty")[i]]
            point += [_share(value, COOLEST, self.hottest) for value in hot]
            warm = gait.table("warm")[i] - COLD  # none where hot is cold, too
            point += list(np.divide(warm, hot - COLD, out=np.zeros(_TCAS), where=hot > COLD))
            point.append(_share(steering[i], *STEERING))
        return np.clip(point, 0.0, 1.0)

    def decode(self, point: Array) -> tuple[Gait, tuple[float, ...]]:
        """The gait of a point, and its steering per leg [K/rad].

        Raises:
            ValueError: If the point has the wrong length or numbers out of 0 to 1.
        """
        point = within("point", point, at_least=0.0, at_most=1.0, shape=(len(self.names),))
        offset = np.array(self.centre.offset)
        offset[1:] = (offset[1:] + point[1:4] - 0.5) % 1.0
        tables: dict[str, list[tuple[float, ...]]] = defaultdict(list)
        steering: list[float] = []
        for pair, numbers in zip(_PAIRS.values(), point[4:].reshape(2, -1), strict=True):
            starts, duty, hot, warm = np.split(numbers[:-1], (2, 5, 8))
            start = self.centre.table("start")[pair.start]
            start[1:] = (start[1:] + starts - 0.5) % 1.0
            hot = _between(hot, COOLEST, self.hottest)
            warm = np.minimum(COLD + warm * (hot - COLD), hot)
            rows = {"start": start, "duty": _between(duty, *DUTY), "hot": hot, "warm": warm}
            for name, row in rows.items():
                tables[name] += [tuple(row.tolist())] * 2
            steering += [float(_between(numbers[-1], *STEERING))] * 2
        gait = Gait(
            period=math.exp(_between(point[0], *np.log(PERIOD))),
            offset=tuple(offset.tolist()),
            **{name: tuple(rows) for name, rows in tables.items()},
        )
        return gait, tuple(steering)


def _share(value: float, low: float, high: float) -> float:
    return (value - low) / (high - low)


def _between(share: Any, low: float, high: float) -> Any:
    return np.minimum(low + share * (high - low), high)

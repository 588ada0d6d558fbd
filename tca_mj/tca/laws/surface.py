"""The tension law of n TCAs, read from their surfaces: three times as fast as the rods."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, door, every, floats
from tca_mj.tca.arrays import FEW, column
from tca_mj.tca.laws.rod import CoilRods
from tca_mj.tca.laws.table import calibrate, evaluate, evaluate_one
from tca_mj.tca.moduli import FibreTable, softened_one
from tca_mj.tca.spec import TcaSpec


class CoilSurfaces:
    """The tension law of n TCAs from their surfaces; used as ``CoilRods``, which it stands for.

    Elements outside the surface's temperatures are solved by the rod, and every element depends
    on its own inputs alone, bit for bit.

    Attributes:
        n: Number of TCAs.
        rods: The rods of the same TCAs.
        surfaces: The surface of each TCA.
        shortest: Lower end of the law's domain, shape (n,) [m].
        longest: Upper end of the law's domain, shape (n,) [m].
        coldest: Lowest temperature in the tables, shape (n,) [°C].
        hottest: Highest temperature in the tables, shape (n,) [°C].
    """

    @door
    def __init__(self, specs: Sequence[TcaSpec]) -> None:
        """Calibrates the coils that have not been yet.

        Args:
            specs: The n TCAs.

        Raises:
            ValueError: If ``specs`` is empty.
            CalibrationError: If no table follows the rod of one closely enough.
        """
        self.rods = CoilRods(specs)
        self.n = self.rods.n
        known = {key: calibrate(tca) for key, tca in {id(tca): tca for tca in specs}.items()}
        self.surfaces = tuple(known[id(tca)] for tca in specs)
        self.shortest, self.longest = self.rods.shortest, self.rods.longest
        self.coldest = column(self.surfaces, "coldest")
        self.hottest = column(self.surfaces, "hottest")
        p, q = np.array([surface.cells for surface in self.surfaces]).T
        fibre_length = column(specs, "fibre_length")
        ends = np.array([(surface.shortest, surface.longest) for surface in self.surfaces]).T
        self._per_metre = p / (fibre_length * (ends[1] - ends[0]))
        # Of lengths and, behind them, temperatures: domain, and first cell and cells per unit.
        self._least = np.concatenate((self.shortest, self.coldest))
        self._most = np.concatenate((self.longest, self.hottest))
        self._start = np.concatenate((fibre_length * ends[0], self.coldest))
        per_kelvin = q / (self.hottest - self.coldest)
        self._per_unit = np.concatenate((self._per_metre, per_kelvin))
        # All tables side by side, one column per cell.
        offset, columns, size = {}, [], 0
        for surface in {id(surface): surface for surface in self.surfaces}.values():
            offset[id(surface)] = float(size)
            columns.append(surface.polynomials().reshape(-1, 12).T)
            size += columns[-1].shape[1]
        self._table = np.ascontiguousarray(np.concatenate(columns, axis=1))
        self._offset = np.array([offset[id(surface)] for surface in self.surfaces])
        self._row = q + 1.0
        self._each = self._numbers(specs) if self.n <= FEW and not self.rods.any_hot else []
        self._cells = np.ascontiguousarray(self._table.T) if self._each else self._table.T

    def _numbers(self, specs: Sequence[TcaSpec]) -> list[tuple[float, ...]]:
        """What ``_one_by_one`` needs of each TCA."""
        rods, n, fibres = self.rods, self.n, FibreTable.of([spec.fibre for spec in specs])
        bounds = (np.maximum(self.shortest, rods.minimum), self.longest, self.coldest, self.hottest)
        cells = self._start[:n], self._per_metre, self._start[n:], self._per_unit[n:]
        twist, rate = rods.torsion_per_tension(self.coldest), fibres.softening_rate
        fibre = twist, fibres.reference_temperature, rate, *fibres.load_softening
        columns = *bounds, *cells, self._row, self._offset, *fibre
        return list(zip(*(column.tolist() for column in columns), strict=True))

    def tension(self, length: ArrayLike, temperature: ArrayLike) -> tuple[Array, Array]:
        """Tension of the coils and its slope over length; all as ``CoilRods.tension``."""
        length, temperature = floats("length", length), floats("temperature", temperature)
        if self._each and length.shape == temperature.shape == (self.n,):
            found = self._one_by_one(length, temperature)
            if found is not None:
                return found
        if length.shape == temperature.shape and length.shape[-1:] == (self.n,):
            at = np.concatenate((length, temperature), axis=-1)
            if every(at >= self._least) and every(at <= self._most):
                return self._read(at, length, temperature)
        exact = self.rods.tension(length, temperature)  # raises if anything is wrong
        inside = (temperature >= self.coldest) & (temperature <= self.hottest)
        near = np.clip(temperature, self.coldest, self.hottest)
        read = self._read(np.concatenate((length, near), axis=-1), length, near)
        return np.where(inside, read[0], exact[0]), np.where(inside, read[1], exact[1])

    def _one_by_one(self, length: Array, temperature: Array) -> tuple[Array, Array] | None:
        """``tension`` of few TCAs, to the bit, in half the time; None if one is out of bounds."""
        tensions, slopes, each = [], [], zip(length.tolist(), temperature.tolist(), strict=True)
        for (long, warm), numbers in zip(each, self._each, strict=True):
            least, most, cold, hot, start, per_metre, low, per_kelvin, row, offset, *fibre = numbers
            if not (least <= long <= most and cold <= warm <= hot):
                return None
            x, y = (long - start) * per_metre, (warm - low) * per_kelvin
            i, j = math.floor(x), math.floor(y)
            cell = self._cells[int(i * row + (j + offset))].tolist()
            stiff, slope = evaluate_one(cell, x - i, y - j)
            soft = softened_one(warm, stiff, *fibre)
            if soft is None:
                return None
            tensions.append(soft[0])
            slopes.append(soft[1] * (slope * per_metre))
        return np.array(tensions), np.array(slopes)

    def _read(self, at: Array, length: Array, temperature: Array) -> tuple[Array, Array]:
        inside = (at - self._start) * self._per_unit
        cell = np.floor(inside)
        inside -= cell
        row, place = cell[..., : self.n], cell[..., self.n :]
        found = self._table.take((row * self._row + (place + self._offset)).astype(np.intp), axis=1)
        u, v = inside[..., : self.n], inside[..., self.n :]
        stiff, slope = evaluate(found, u, np.array((v, v, v, v)))
        return self.rods.finished(length, temperature, stiff, slope * self._per_metre)

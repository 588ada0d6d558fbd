"""Calibration surface: the rod's tension law F(l, T) and dF/dl from a table, with its error bound.

The rod (``coilrod``) needs four rounds of Newton for the tension f that a coil would have with
the moduli of the reference temperature. That f depends on the length over the fibre's length and
on the temperature alone and is smooth, so it is tabulated: cubic Hermite polynomials in the
length, through values and slopes of the rod, and parabolas in the temperature. The slope that is
handed out is the exact derivative of the tension that is handed out; both are continuous in the
length. What is not smooth is not tabulated: the softening by load, which has a kink at F = 0 and
at the reference temperature, and the contact of the turns come from the rod's own closed forms.

A surface is built in some 20 ms and kept in memory, and as a file in the user's cache folder if
that can be written, whose name is a hash of all that the table follows from.
"""

import contextlib
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, astuple, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj import __version__
from tca_mj.tca import coilrod, moduli, spec
from tca_mj.tca.coilrod import CoilRods
from tca_mj.tca.moduli import radial_growth, softened_tension
from tca_mj.tca.spec import TcaSpec

Array = NDArray[np.float64]

_FORMAT = 1  # of the cache file
_HOME_CACHE = {"win32": ("AppData", "Local"), "darwin": ("Library", "Caches")}
# Cells in length and temperature; the next finer grid is taken if the bound is missed.
_GRIDS = ((32, 40), (64, 80), (128, 160))
_WIDE = (0.0, 200.0)  # temperatures in the table, wider if the fibre's measurements are [°C]
_FINER = 8  # error-check points per cell, each way
_MARGIN = 1.25  # of the bound over the largest error seen at those points
_ROUNDING = 1e-11  # the rod's own tolerance, as a tension [N] and as a share of the slope
_TAUT = 0.05  # from this tension on the bound is relative [N]
_ALLOWED = (1e-4, 2e-3, 2e-3)  # absolute [N], relative and slope error of an accepted table


class CalibrationError(ArithmeticError):
    """No table followed the rod of a TCA closely enough; ``CoilRods`` still holds."""


@dataclass(frozen=True, slots=True)
class SurfaceBound:
    """Largest errors of a surface against the rod, over its whole range.

    They are 1.25 times the largest seen on a grid 8 times finer, each way, than the table. With
    F the rod's tension, the tension is off by at most max(absolute, relative |F|).

    Attributes:
        absolute: Of the tension where it is below 0.05 N or the turns touch [N].
        relative: Over the tension or 0.05 N, what is more, where the turns do not touch [1].
        slope: Of dF/dl, contact left out, everywhere [1].
    """

    absolute: float
    relative: float
    slope: float


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Tension of one kind of coil at the moduli of the reference temperature.

    Coils that differ in length only (``TcaSpec.of_length``) share one.

    Attributes:
        shortest: Lowest length over fibre length in the table [1].
        longest: Highest one [1].
        coldest: Lowest temperature in the table [°C].
        hottest: Highest one [°C].
        tension: At evenly spaced lengths and temperatures, shape (p + 1, 2 q + 1) [N].
        slope: Its derivative by length over fibre length, same shape [N].
        bound: Error bound of the tension law made from this table.
    """

    shortest: float
    longest: float
    coldest: float
    hottest: float
    tension: Array
    slope: Array
    bound: SurfaceBound

    @property
    def cells(self) -> tuple[int, int]:
        """Cells (p, q) in length and in temperature."""
        return self.tension.shape[0] - 1, self.tension.shape[1] // 2

    def polynomials(self) -> Array:
        """Coefficients of u^i v^j in each cell, shape (p + 1, q + 1, 3, 4) as [.., j, i] [N].

        u and v run from 0 to 1 through a cell. The last cell in either direction lies beyond the
        table and serves its very edge, u = 0 or v = 0.
        """
        p, q = self.cells
        a = self.tension
        da = self.slope * ((self.longest - self.shortest) / p)
        step, rise = np.diff(a, axis=0), da[:-1]
        cubic = np.zeros((4, *a.shape))
        cubic[0], cubic[1] = a, da
        cubic[2, :-1] = 3.0 * step - 2.0 * rise - da[1:]
        cubic[3, :-1] = rise + da[1:] - 2.0 * step
        low, middle, high = cubic[..., :-1:2], cubic[..., 1::2], cubic[..., 2::2]
        table = np.zeros((p + 1, q + 1, 3, 4))
        table[:, :, 0] = cubic[..., ::2].transpose(1, 2, 0)
        table[:, :-1, 1] = (4.0 * middle - 3.0 * low - high).transpose(1, 2, 0)
        table[:, :-1, 2] = (2.0 * (low + high) - 4.0 * middle).transpose(1, 2, 0)
        return table

    def rises(self) -> bool:
        """Whether the tension rises with length in every point of every cell: a proof.

        The slope of a cell is a polynomial of degree 2 in u and in v, and lies between the
        smallest and the largest of its Bernstein coefficients.
        """
        cell = self.polynomials()[:-1, :-1]
        first, second, third = cell[..., 1], 2.0 * cell[..., 2], 3.0 * cell[..., 3]
        in_u = np.stack([first, first + 0.5 * second, first + second + third], axis=-1)
        one, v, v2 = in_u[..., 0, :], in_u[..., 1, :], in_u[..., 2, :]
        return bool(min(c.min() for c in (one, one + 0.5 * v, one + v + v2)) > 0.0)


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

    def __init__(self, specs: Sequence[TcaSpec]) -> None:
        self.rods = CoilRods(specs)
        self.n = self.rods.n
        known = {key: calibrate(tca) for key, tca in {id(tca): tca for tca in specs}.items()}
        self.surfaces = tuple(known[id(tca)] for tca in specs)
        self.shortest, self.longest = self.rods.shortest, self.rods.longest
        self.coldest = np.array([surface.coldest for surface in self.surfaces])
        self.hottest = np.array([surface.hottest for surface in self.surfaces])
        self._minimum = np.array([tca.minimum_length for tca in specs])
        p, q = np.array([surface.cells for surface in self.surfaces]).T
        self._per_metre = p / (self.longest - self.shortest)
        self._per_kelvin = q / (self.hottest - self.coldest)
        # All tables side by side, one column per cell.
        offset, columns, size = {}, [], 0
        for surface in {id(surface): surface for surface in self.surfaces}.values():
            offset[id(surface)] = float(size)
            columns.append(surface.polynomials().reshape(-1, 12).T)
            size += columns[-1].shape[1]
        self._table = np.ascontiguousarray(np.concatenate(columns, axis=1))
        self._offset = np.array([offset[id(surface)] for surface in self.surfaces])
        self._row = q + 1.0
        for array in vars(self).values():
            if isinstance(array, np.ndarray):
                array.setflags(write=False)

    def tension(self, length: ArrayLike, temperature: ArrayLike) -> tuple[Array, Array]:
        """Tension of the coils and its slope over length; all as ``CoilRods.tension``."""
        length = np.asarray(length, dtype=np.float64)
        temperature = np.asarray(temperature, dtype=np.float64)
        if length.shape == temperature.shape and length.shape[-1:] == (self.n,):
            inside = (length >= self.shortest) & (length <= self.longest)
            inside &= (temperature >= self.coldest) & (temperature <= self.hottest)
            if inside.all():
                return self._read(length, temperature)
        exact = self.rods.tension(length, temperature)  # raises if anything is wrong
        inside = (temperature >= self.coldest) & (temperature <= self.hottest)
        read = self._read(length, np.clip(temperature, self.coldest, self.hottest))
        return np.where(inside, read[0], exact[0]), np.where(inside, read[1], exact[1])

    def _read(self, length: Array, temperature: Array) -> tuple[Array, Array]:
        rods = self.rods
        x = (length - self.shortest) * self._per_metre
        t = (temperature - self.coldest) * self._per_kelvin
        i, j = np.floor(x), np.floor(t)
        cell = (i * self._row + (j + self._offset)).astype(np.intp)
        stiff, slope = _polynomial(self._table.take(cell, axis=1), x - i, t - j)
        per = rods.torsion_per_tension(temperature)
        tension, share = softened_tension(rods._fibres, temperature, stiff, per)
        slope = slope * self._per_metre * share
        if not (length < self._minimum).any():
            return tension, slope
        contact, contact_slope = rods._contact(length)
        return tension - contact, slope + contact_slope


def calibrate(tca: TcaSpec) -> Surface:
    """The surface of a TCA's coil: from memory, else from the cache folder, else built.

    Args:
        tca: The TCA. Its length, heat, resistance, strength and contact do not matter.

    Raises:
        CalibrationError: If no table follows the rod within 0.1 mN and 0.2 %, or the rod's own
            tension falls somewhere as the coil gets longer: steep coils of fibres with a large
            E/G buckle in torsion.
        CoilSolveError: If the rod itself has no solution somewhere in its domain.
    """
    return _calibrated(_coil_alone(tca))


@lru_cache(maxsize=256)
def _calibrated(coil: TcaSpec) -> Surface:
    return load_or_build(coil, cache_folder())


def cache_folder() -> Path | None:
    """The user's folder for files that can be made again; None if there is no home."""
    xdg = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if xdg.is_absolute():
        return xdg / "tca-mj"
    local = os.environ.get("LOCALAPPDATA", "")
    if sys.platform == "win32" and local:
        return Path(local) / "tca-mj" / "Cache"
    try:
        return Path.home().joinpath(*_HOME_CACHE.get(sys.platform, (".cache",)), "tca-mj")
    except RuntimeError:
        return None


def load_or_build(tca: TcaSpec, folder: Path | None) -> Surface:
    """The surface from a file of ``folder``; else built, and written there if possible.

    A file that is missing, damaged or made from other inputs is no error. Errors: ``calibrate``.
    """
    coil = _coil_alone(tca)
    if folder is None:
        return build(coil)
    inputs = _inputs(coil)
    path = folder / f"surface-{hashlib.sha256(inputs.encode()).hexdigest()[:40]}.bin"
    surface = _read_file(path, inputs)
    if surface is None:
        surface = build(coil)
        _write_file(path, inputs, surface)
    return surface


def build(tca: TcaSpec) -> Surface:
    """Tabulates the rod of a TCA and measures the error; errors as ``calibrate``."""
    coil = _coil_alone(tca)
    rods = CoilRods([coil])
    low, high = coil.fibre.temperature_range
    low, high = min(low, _WIDE[0]), max(high, _WIDE[1])
    if not (radial_growth(coil.fibre, np.linspace(low, high, 400)) > -0.5).all():
        low, high = coil.fibre.temperature_range
    ends, bound = (float(rods.shortest[0]), float(rods.longest[0])), SurfaceBound(1.0, 1.0, 1.0)
    for p, q in _GRIDS:
        length = np.linspace(*ends, p + 1)
        tension, slope = _solved(rods, length, np.linspace(low, high, 2 * q + 1))
        if not (slope > 0.0).all():
            raise CalibrationError("the rod's own tension falls with length; a surface must rise")
        surface = Surface(*ends, low, high, _frozen(tension), _frozen(slope), bound)
        bound = _measured(coil, rods, surface)
        if surface.rises() and all(e <= a for e, a in zip(astuple(bound), _ALLOWED, strict=True)):
            return replace(surface, bound=bound)
    raise CalibrationError(
        f"a table of {p} by {q} cells is off by {bound} or does not rise; allowed are {_ALLOWED}"
    )


def _coil_alone(tca: TcaSpec) -> TcaSpec:
    """The TCA with all that does not matter made the same for all; what is not named matters."""
    return replace(
        tca,
        fibre=replace(tca.fibre, density=1.0, specific_heat=1.0),
        fibre_length=1.0, breaking_force=1.0, resistance_per_length=1.0, resistance_strain=0.0,
        convection=1.0, roughness=1.0, ambient=25.0, sheath_capacity=0.0, sheath_area=None,
        contact_ratio=1.0, contact_smoothing=0.5,
    )  # fmt: skip


def _solved(rods: CoilRods, length: Array, temperature: Array) -> tuple[Array, Array]:
    """The rod at the moduli of reference over a grid: tension, slope; lengths on axis 0."""
    grid = np.meshgrid(length, temperature, indexing="ij")
    _, stiff, slope = rods._solve(grid[0][..., None], grid[1][..., None])
    return stiff[..., 0], slope[..., 0]


def _measured(coil: TcaSpec, rods: CoilRods, surface: Surface) -> SurfaceBound:
    """Compares softened tensions and slopes of table and rod on the finer grid."""
    p, q = surface.cells
    length = np.linspace(surface.shortest, surface.longest, _FINER * p + 1)
    temperature = np.linspace(surface.coldest, surface.hottest, _FINER * q + 1)
    # A spec may soften to nothing below the table's upper end; there the law raises anyway.
    fibre = coil.fibre
    fall = fibre.softening_rate * fibre.load_softening[2]
    temperature = temperature[fall * (temperature - fibre.reference_temperature) < 1.0]
    per = rods.torsion_per_tension(temperature[:, None])[..., 0]
    per_length = p / (surface.longest - surface.shortest)
    x = (length[:, None] - surface.shortest) * per_length
    t = (temperature - surface.coldest) * (q / (surface.hottest - surface.coldest))
    i, j = x.astype(np.intp), t.astype(np.intp)
    cell = surface.polynomials().reshape(p + 1, q + 1, 12).transpose(2, 0, 1)[:, i, j]
    read, read_slope = _polynomial(cell, x - i, t - j)
    read, read_share = softened_tension(fibre, temperature, read, per)
    stiff, slope = _solved(rods, length, temperature)
    true, share = softened_tension(fibre, temperature, stiff, per)
    error = np.abs(read - true)
    free = (length >= coil.minimum_length)[:, None]
    relative = error / np.maximum(true, _TAUT)
    steep = np.abs(read_share * read_slope * per_length / (share * slope) - 1.0)
    return SurfaceBound(
        absolute=float(_MARGIN * np.max(error, where=~free | (true < _TAUT), initial=0.0))
        + _ROUNDING,
        relative=float(_MARGIN * np.max(relative, where=free, initial=0.0)) + _ROUNDING / _TAUT,
        slope=float(_MARGIN * steep.max()) + _ROUNDING,
    )


def _polynomial(cell: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """Value and derivative by u of a cell's polynomial; ``cell``, (12, ...), is overwritten."""
    cubic = cell[8:]
    cubic *= v
    cubic += cell[4:8]
    cubic *= v
    cubic += cell[:4]
    c0, c1, c2, c3 = cubic
    u_c3 = u * c3  # Horner's scheme for both at once
    b2 = c2 + u_c3
    b1 = c1 + u * b2
    return c0 + u * b1, b1 + u * (b2 + u_c3)


def _inputs(coil: TcaSpec) -> str:
    """All that a table follows from, as text.

    With the rod's answers at some points: a law edited while in use is not what its source says.
    """
    rods = CoilRods([coil])
    length = np.linspace(rods.shortest[0], rods.longest[0], 9)
    answers = _solved(rods, length, np.linspace(*coil.fibre.temperature_range, 5))
    laws = hashlib.sha256(np.stack(answers).tobytes())
    with contextlib.suppress(OSError):  # a package without readable source has its version
        for module in (coilrod, moduli, spec, sys.modules[__name__]):
            laws.update(Path(str(module.__file__)).read_bytes())
    numbers = [_FORMAT, _GRIDS, _WIDE, _FINER, _MARGIN, _ROUNDING, _TAUT, _ALLOWED]
    inputs = {"version": __version__, "laws": laws.hexdigest(), "numbers": numbers}
    return json.dumps(inputs | {"coil": asdict(coil)}, sort_keys=True, default=float)


def _read_file(path: Path, inputs: str) -> Surface | None:
    """The surface in a file; None if there is none, or it is damaged or of other inputs."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(data[32:]).digest() != data[:32]:
        return None
    head, _, numbers = data[32:].partition(b"\n")
    header: dict[str, Any] = json.loads(head)
    if header["inputs"] != inputs:
        return None
    tension, slope = np.frombuffer(numbers, "<f8").reshape(2, *header["shape"])
    shortest, longest, coldest, hottest = header["ends"]
    bound = SurfaceBound(*header["bound"])
    return Surface(shortest, longest, coldest, hottest, _frozen(tension), _frozen(slope), bound)


def _write_file(path: Path, inputs: str, surface: Surface) -> None:
    """Writes the file in one step, so that no one ever reads half of it; or gives up."""
    ends = surface.shortest, surface.longest, surface.coldest, surface.hottest
    shape, bound = surface.tension.shape, astuple(surface.bound)
    header = {"inputs": inputs, "shape": shape, "ends": ends, "bound": bound}
    content = json.dumps(header).encode() + b"\n"
    content += np.stack([surface.tension, surface.slope]).astype("<f8").tobytes()
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".tmp")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            os.replace(name, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(name)
            raise


def _frozen(values: Array) -> Array:
    array = np.ascontiguousarray(values, dtype=np.float64)
    array.setflags(write=False)
    return array

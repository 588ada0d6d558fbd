"""Surfaces that are kept: in memory, and as files in the user's cache folder.

A file's name is a hash of all that the table in it follows from, so that one made for another coil
or by other code is never read. The folder need not exist nor be writable.
"""

import contextlib
import hashlib
import json
import os
import sys
import tempfile
from dataclasses import asdict, astuple
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj import __version__
from tca_mj.tca import coilrod, moduli, spec, surface
from tca_mj.tca.coilrod import CoilRods
from tca_mj.tca.spec import TcaSpec
from tca_mj.tca.surface import Surface, SurfaceBound, build, coil_alone, frozen, solved

_FORMAT = 1  # of the cache file
_HOME_CACHE = {"win32": ("AppData", "Local"), "darwin": ("Library", "Caches")}


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
    return _calibrated(coil_alone(tca))


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
    coil = coil_alone(tca)
    if folder is None:
        return build(coil)
    inputs = _inputs(coil)
    path = folder / f"surface-{hashlib.sha256(inputs.encode()).hexdigest()[:40]}.bin"
    table = _read_file(path, inputs)
    if table is None:
        table = build(coil)
        _write_file(path, inputs, table)
    return table


def _inputs(coil: TcaSpec) -> str:
    """All that a table follows from, as text.

    With the rod's answers at some points: a law edited while in use is not what its source says.
    """
    rods = CoilRods([coil])
    length = np.linspace(rods.shortest[0], rods.longest[0], 9)
    answers = solved(rods, length, np.linspace(*coil.fibre.temperature_range, 5))
    laws = hashlib.sha256(np.stack(answers).tobytes())
    with contextlib.suppress(OSError):  # a package without readable source has its version
        for module in (coilrod, moduli, spec, surface):
            laws.update(Path(str(module.__file__)).read_bytes())
    numbers = [_FORMAT, surface.GRIDS, surface.WIDE, surface.COLDEST, surface.FINER]
    numbers += [surface.MARGIN, surface.ROUNDING, surface.TAUT, surface.ALLOWED]
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
    return Surface(shortest, longest, coldest, hottest, frozen(tension), frozen(slope), bound)


def _write_file(path: Path, inputs: str, table: Surface) -> None:
    """Writes the file in one step, so that no one ever reads half of it; or gives up."""
    ends = table.shortest, table.longest, table.coldest, table.hottest
    shape, bound = table.tension.shape, astuple(table.bound)
    header = {"inputs": inputs, "shape": shape, "ends": ends, "bound": bound}
    content = json.dumps(header).encode() + b"\n"
    content += np.stack([table.tension, table.slope]).astype("<f8").tobytes()
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

"""What a result was made with: the versions and the machine, to be written beside it."""

import os
import platform
import shlex
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

# Distributions whose version changes results or files.
RELEVANT = ("tca-mj", "mujoco", "gymnasium", "numpy", "rerun-sdk")


def versions(*more: str) -> dict[str, str]:
    """Versions of Python and of the packages that results depend on, by name.

    Args:
        more: Distributions on which they depend besides.
    """
    found = {"python": platform.python_version()}
    for name in (*RELEVANT, *more):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def how_to_install(extra: str) -> str:
    """The command that installs the packages of an extra, under the names that an index has."""
    try:
        everything = requires("tca-mj") or []
    except PackageNotFoundError:
        everything = []
    needed = [text.partition(";")[0] for text in everything if text.endswith(f'"{extra}"')]
    # A checkout that is not installed, or was before there was this extra, says itself what it is.
    return f"pip install {shlex.join(needed or ['-e', f'.[{extra}]'])}"


def machine() -> dict[str, str | int]:
    """The processor's model, the number of cores this process may use, and the system."""
    model = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                model = line.partition(":")[2].strip()
                break
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {"cpu": model, "cores": cores or 1, "system": platform.platform()}

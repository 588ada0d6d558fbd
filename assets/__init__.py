"""Static files of the package, imported as ``tca_mj.assets``."""

from pathlib import Path

from tca_mj.checks import door, shown
from tca_mj.hints import nearest

__all__ = ["mjcf"]

_MJCF = Path(__file__).resolve().parent / "mjcf"


@door
def mjcf(name: str) -> Path:
    """Finds a file of the package's MJCF folder, in an editable as in a plain install.

    Args:
        name: Path below the folder, with forward slashes, such as ``"pcb.xml"``.

    Returns:
        The absolute path of the file.

    Raises:
        ValueError: If there is no such file; the message lists those that are.
    """
    known = {
        path.relative_to(_MJCF).as_posix(): path for path in _MJCF.rglob("*") if path.is_file()
    }
    if name not in known:
        raise ValueError(
            f"name must be one of {', '.join(sorted(known)) or 'none'}, got {shown(name)}"
            f"{nearest(name, known)}"
        )
    return known[name]

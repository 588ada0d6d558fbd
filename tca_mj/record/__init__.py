"""What a simulation did, to be looked at: recordings, pictures, films and plots.

``Recorder`` and ``QUANTITIES`` are loaded when they are asked for: Rerun is slow to import, and
who draws pictures does not need it.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tca_mj.record.recorder import QUANTITIES, Recorder

__all__ = ["QUANTITIES", "Recorder"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from tca_mj.record import recorder

    return getattr(recorder, name)

"""What a process holds that one forked off it can neither use nor free: threads, drawings."""

import ctypes
import os
from typing import Any


class Held:
    """Something that belongs to the process that made it."""

    def __init__(self) -> None:
        self._process = os.getpid()

    @property
    def elsewhere(self) -> bool:
        """Whether this is another process: one forked off it."""
        return os.getpid() != self._process


def keep_for_ever(*things: Any) -> None:
    """Lets Python never free things, not even at its end: freeing them would hang or fail."""
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))

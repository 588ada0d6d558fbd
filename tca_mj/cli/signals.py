"""Signals that end a command as Ctrl-C does."""

import signal
import threading
from collections.abc import Mapping
from typing import Any


class Signals:
    """While it lasts, signals to stop raise KeyboardInterrupt, but for those that whoever started
    the program wants ignored (``nohup``).

    Attributes:
        heard: The last one.
    """

    def __init__(self) -> None:
        self.heard = signal.SIGINT
        names = ("SIGINT", "SIGTERM", "SIGHUP")
        known = [getattr(signal, name) for name in names if hasattr(signal, name)]
        here = threading.current_thread() is threading.main_thread()
        found = {number: signal.getsignal(number) for number in known if here}
        self._before = {k: v for k, v in found.items() if v is not signal.SIG_IGN}

    def __enter__(self) -> "Signals":
        self._handle(dict.fromkeys(self._before, self._stop))
        return self

    def __exit__(self, *error: object) -> None:
        self._handle(self._before)

    def over(self, *, leaving: bool) -> None:
        """Lets none be heard any more; to the end of the program if it is leaving."""
        self._handle(dict.fromkeys(self._before, signal.SIG_IGN))
        if leaving:
            self._before = {}

    def _stop(self, number: int, frame: object) -> None:
        self.heard = signal.Signals(number)
        raise KeyboardInterrupt

    def _handle(self, handlers: Mapping[signal.Signals, Any]) -> None:
        for number, handler in handlers.items():
            signal.signal(number, handler)

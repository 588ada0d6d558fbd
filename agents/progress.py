"""How far something is: a bar on a terminal; elsewhere, as in a batch job, a line now and then."""

import sys
from typing import Any

from tqdm import tqdm

SECONDS = 30.0  # between two lines
_LINE = "{desc} {n_fmt} of {total_fmt}{unit}, {elapsed} gone, {remaining} left, {rate_fmt}{postfix}"


class _Log:
    """Standard error for a bar, with a line of its own for each state."""

    def write(self, text: str) -> None:
        if text.strip():
            print(text.strip(), file=sys.stderr, flush=True)

    def flush(self) -> None:
        """Nothing is held back."""


def progress_bar(
    total: float, *, unit: str, done: float = 0, progress: bool = True,
    terminal: str | None = None, leave: bool = True,
) -> Any:  # fmt: skip
    """A bar of tqdm's, which also closes a ``with`` block.

    Args:
        total: What there is to do.
        unit: What is counted, in the plural.
        done: What was done before.
        progress: Whether to show it at all.
        terminal: Form of the bar on a terminal, as tqdm's ``bar_format``.
        leave: Whether the bar stays on the terminal at its end.
    """
    few = isinstance(total, int) and total < 1000
    shown: dict[str, Any] = {
        "total": total, "initial": done, "unit": f" {unit}", "unit_scale": not few,
    }  # fmt: skip
    if sys.stderr is not None and sys.stderr.isatty():
        return tqdm(**shown, bar_format=terminal, leave=leave, disable=not progress)
    return tqdm(**shown, bar_format=_LINE, file=_Log(), mininterval=SECONDS, disable=not progress)

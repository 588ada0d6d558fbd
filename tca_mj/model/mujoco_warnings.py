"""What MuJoCo warns of, counted instead of written into files.

MuJoCo by itself appends every warning to ``MUJOCO_LOG.TXT`` in the working folder. It has one
handler of warnings for the whole process, threads included, and so the count is the process's, too.
What a single simulation was warned of, if it is about its state, is in its ``data.warning``.
"""

import re
from collections import Counter

import mujoco

from tca_mj.checks import door

_heard: Counter[str] = Counter()
_asked = False


def count_warnings() -> None:
    """Counts MuJoCo's warnings from now on, unless the process has a handler of its own.

    Everything of this package that compiles a model calls it, and so does a simulation that comes
    out of a pickle; importing does not. Only the first call in a process does anything: a handler
    that was set by ``mujoco.set_mju_user_warning`` stays, one that is set later takes this one's
    place, and after ``mujoco.set_mju_user_warning(None)`` MuJoCo writes its file again.
    """
    global _asked
    if not _asked:
        _asked = True
        if mujoco.get_mju_user_warning() is None:
            mujoco.set_mju_user_warning(_count)


def _count(text: str) -> None:
    _heard[re.sub(r"\d([\d.e+-]*\d)?", "#", text)] += 1


def warning_counts() -> Counter[str]:
    """How often MuJoCo has warned of what in this process, with ``#`` for every number."""
    return Counter(_heard)


@door
def warning_line(counts: Counter[str]) -> str:
    """Warnings in a line, the most frequent first; empty if there are none.

    Args:
        counts: As ``warning_counts`` returns them, or the difference of two of these.
    """
    each = ", ".join(f"{count} x {text}" for text, count in counts.most_common())
    return f"MuJoCo warned {counts.total()} times: {each}" if each else ""

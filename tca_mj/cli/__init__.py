"""The command ``tca-mj``. What its subcommands need is loaded when one of them runs."""

import argparse
import os
import signal
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, TextIO

import tca_mj
from tca_mj.cli import check, design, learn, log, model, own, play
from tca_mj.cli.arguments import POLICIES, filled
from tca_mj.cli.play import outcome, speed_table
from tca_mj.cli.signals import Signals
from tca_mj.registry import ALGORITHMS

__all__ = ["ALGORITHMS", "POLICIES", "main", "outcome", "speed_table"]

_EXAMPLES = """\
examples:
  tca-mj list                                   the tasks, their options, demos and policies
  tca-mj demo {demo} --out runs/demo    an episode, recorded and filmed
  rerun runs/demo/rollout.rrd                   look at what happened
  tca-mj view {task}               watch it in a window
  tca-mj train TASK --algo sac                  learn a task
  tca-mj eval scripted --task TASK              how good a policy is
  tca-mj collect TASK --out FILE                what a task does under any commands, as data
  tca-mj bench --out runs/bench                 how fast it is on this machine
  tca-mj validate tca --out runs/validation     the models against what is published
  tca-mj certify --out runs/certificate         the chains against the theory of rods
  tca-mj certify my_robots:two_modules          a robot of one's own, the same way
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code.

    SIGTERM and SIGHUP end a command as Ctrl-C does: what it has is kept. A second one, while that
    is written, cuts this short.

    Args:
        argv: Arguments without the name of the program; None for those of the process, which is
            to end then.

    Raises:
        SystemExit: With code 2 if the arguments are wrong, 0 after ``--help`` or ``--version``.
    """
    if os.getcwd() not in sys.path:  # where one's own robots and tasks are: module:name
        sys.path.append(os.getcwd())
    arguments = argparse.Namespace(command="", kept=[], needs=lambda: "")
    with Signals() as signals:
        try:
            return _run(argv, arguments)
        except KeyboardInterrupt:
            signals.over(leaving=argv is None)
            heard = signals.heard
            said = "interrupted" if heard is signal.SIGINT else f"ended by {heard.name}"
            _end("; ".join([said, *arguments.kept]))
            exec("")  # CPython would die of SIGINT if that had struck inside another exec
            return 128 + heard
        except BrokenPipeError:  # who reads has seen enough, as head
            _end()
            return 128 + 13
        except (ImportError, OSError, ValueError) as error:
            hint = arguments.needs() if isinstance(error, ImportError) else ""
            _end(f"tca-mj {arguments.command}: {_said(error)}{hint}")
            return 2


def _run(argv: Sequence[str] | None, arguments: argparse.Namespace) -> int:
    """Reads the command and runs it; what it has said, a help too, is out when this ends."""
    before = _warnings()
    try:
        _parser().parse_args(argv, arguments)
        _check_rendering()
        return arguments.run(arguments)
    finally:
        for stream in _streams():
            stream.flush()
        warned = _warnings() - before
        if warned:
            from tca_mj.model.mujoco_warnings import warning_line

            print(warning_line(warned), file=sys.stderr)


def _end(line: str = "") -> None:
    """Says a last line on standard error, if that is still read. What nobody took, a pipe, a full
    disk or a terminal that is gone, is dropped: Python would complain of it as it ends.
    """
    with suppress(OSError):
        print(line, end="\n" if line else "", file=sys.stderr)
    for stream in _streams():
        try:
            stream.flush()
        except OSError:
            with suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _streams() -> list[TextIO]:
    """Standard output and error, where they are not closed."""
    return [stream for stream in (sys.stdout, sys.stderr) if stream is not None]


def _warnings() -> Counter[str]:
    """How often MuJoCo has warned of what; nothing if nothing has loaded it."""
    counting: Any = sys.modules.get("tca_mj.model.mujoco_warnings")
    return Counter() if counting is None else counting.warning_counts()


def _check_rendering() -> None:
    """Refuses a ``MUJOCO_GL`` with which MuJoCo cannot even be imported; nothing where it is unset.

    Raises:
        ValueError: With the reason.
    """
    wanted = os.environ.get("MUJOCO_GL")
    if not wanted:
        return
    try:
        import mujoco  # noqa: F401
    except Exception as error:
        raise ValueError(
            "MUJOCO_GL must name a way to OpenGL that is installed here (egl, osmesa, glfw), or be"
            f" 'disable', or not be set, got {wanted!r}: {error}"
        ) from error


def _said(error: Exception) -> str:
    """What an error says."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tca-mj", description=tca_mj.__doc__.splitlines()[0], epilog=filled(_EXAMPLES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"tca-mj {tca_mj.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for part in (play, learn, model, check, own, log, design):
        part.add_commands(commands)
    return parser

"""The command ``tca-mj``. What its subcommands need is loaded when one of them runs."""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from typing import Any

import tca_mj
from tca_mj.cli import check, learn, play
from tca_mj.cli.arguments import ALGORITHMS, POLICIES, filled
from tca_mj.cli.play import outcome, speed_table

__all__ = ["ALGORITHMS", "POLICIES", "main", "outcome", "speed_table"]

_EXAMPLES = """\
examples:
  tca-mj list                                   the tasks, their options, demos and policies
  tca-mj demo {demo} --out runs/demo    an episode, recorded and filmed
  rerun runs/demo/rollout.rrd                   look at what happened
  tca-mj view {task}               watch it in a window
  tca-mj train TASK --algo sac                  learn a task
  tca-mj eval scripted --task TASK              how good a policy is
  tca-mj bench --out runs/bench                 how fast it is on this machine
  tca-mj validate tca --out runs/validation     the models against what is published
  tca-mj certify --out runs/certificate         the chains against the theory of rods
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code.

    Args:
        argv: Arguments without the name of the program; None for those of the process.

    Raises:
        SystemExit: With code 2 if the arguments are wrong, 0 after ``--help`` or ``--version``.
    """
    arguments = _parser().parse_args(argv)
    before = _warnings()
    try:
        return arguments.run(arguments)
    except KeyboardInterrupt:
        print("; ".join(["interrupted", *arguments.kept]), file=sys.stderr)
        return 130
    except (ConnectionError, FileNotFoundError, ImportError, ValueError) as error:
        hint = arguments.needs if isinstance(error, ImportError) else ""
        print(f"tca-mj {arguments.command}: {error}{hint}", file=sys.stderr)
        return 2
    finally:
        warned = _warnings() - before
        if warned:
            from tca_mj.model.mujoco_warnings import warning_line

            print(warning_line(warned), file=sys.stderr)


def _warnings() -> Counter[str]:
    """How often MuJoCo has warned of what; nothing if nothing has loaded it."""
    counting: Any = sys.modules.get("tca_mj.model.mujoco_warnings")
    return Counter() if counting is None else counting.warning_counts()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tca-mj", description=tca_mj.__doc__.splitlines()[0], epilog=filled(_EXAMPLES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"tca-mj {tca_mj.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for part in (play, learn, check):
        part.add_commands(commands)
    return parser

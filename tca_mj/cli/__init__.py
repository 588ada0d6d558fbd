"""The command ``tca-mj``. What its subcommands need is loaded when one of them runs."""

import argparse
import sys
from collections.abc import Sequence

import tca_mj
from tca_mj.cli import check, learn, play
from tca_mj.cli.arguments import ALGORITHMS, POLICIES
from tca_mj.cli.play import outcome, speed_table

__all__ = ["ALGORITHMS", "POLICIES", "main", "outcome", "speed_table"]

_EXAMPLES = """\
examples:
  tca-mj demo pick-and-place                    the arm puts a screwdriver into a cup
  tca-mj demo pick-and-place --option object=pcb --seed 3 --out runs/board
  tca-mj demo tetrapod                          the tetrapod crawls, walks, shimmies and lies down
  rerun runs/board/rollout.rrd                  look at what happened
  tca-mj list                                   the tasks
  tca-mj view TCA/ArmPickPlace-v0               watch it in a window
  tca-mj train TCA/TetrapodWalk-v0 --algo cma   search a faster gait
  tca-mj eval scripted --task TCA/TetrapodWalk-v0 --out runs/walk     how good a policy is
  tca-mj demo --policy scripted --task TCA/BendReach-v0     any policy, recorded and filmed
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
    try:
        return arguments.run(arguments)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tca-mj", description=tca_mj.__doc__.splitlines()[0], epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"tca-mj {tca_mj.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for part in (play, learn, check):
        part.add_commands(commands)
    return parser

"""Figures of the package itself: ``bench`` its speed, ``validate`` and ``certify`` its models."""

import argparse
import sys

from tca_mj.cli.arguments import Commands, add_command, parse_folder, parse_seed

_VALIDATE = """\
Recomputes every published fact about TCAs (Sun, dissertation, Colorado State University, Chapters 2
and 3) and prints it beside the model's value, the band and the verdict. Takes half a minute.

Writes into the folder --out:
  report.json          the same as data
  report.md            the same as text
  validation_*.png     figures (needs `pip install 'tca-mj[demo]'`)

A fact that is missed is no failure of the command: its exit code is 0.
"""

_CERTIFY = """\
Compares the MuJoCo chain of every module, at its default nodes, with the theory of rods: error of
the tip's place and rotation and of the TCAs' lengths over the working range, in cases drawn by
seed, and the order of the error. All modules take some minutes of processor time.

Modules: bending, twisting, twisting-single, finger, arm. By default all, and single claims.

Writes into the folder --out:
  report.json          the same as data, case by case
  report.md            the same as text
  accuracy_*.png       figures (needs `pip install 'tca-mj[demo]'`)

An error beyond 1 % of the length or 2 degrees is no failure of the command: its exit code is 0.
"""


def add_commands(commands: Commands) -> None:
    """Adds bench, validate and certify."""
    bench = add_command(commands, "bench", _bench, help="measure the speed on this machine")
    bench.add_argument(
        "part", nargs="?", choices=["single", "vector"],
        help="single: TCAs, arm and recordings, a minute; vector: many tasks at once and training,"
        " some minutes; default: both",
    )
    bench.add_argument("--out", type=parse_folder, help="folder for the results, JSON and Markdown")
    bench.add_argument("--quick", action="store_true", help="a tenth of the measurements")

    validate = add_command(
        commands, "validate", _validate, help="compare the models with what is published",
        text=_VALIDATE,
    )
    validate.add_argument("subject", choices=["tca"], help="what to validate")
    validate.add_argument("--out", type=parse_folder, help="folder; default: write nothing")

    certify = add_command(
        commands, "certify", _certify, help="compare the chains with the theory of rods",
        text=_CERTIFY,
    )
    certify.add_argument("module", nargs="*", help="which modules; default: all")
    certify.add_argument("--out", type=parse_folder, help="folder; default: write nothing")
    certify.add_argument("--seed", type=parse_seed, default=0, help="of the cases; default 0")


def _bench(arguments: argparse.Namespace) -> int:
    from tca_mj import bench, bench_vector

    scale, written = 0.1 if arguments.quick else 1.0, []
    if arguments.part != "vector":
        print(bench.report(bench.benchmark(scale=scale, out=arguments.out)), flush=True)
        written.append("benchmark")
    if arguments.part != "single":
        print("\n" if written else "", end="")
        print(bench_vector.report(bench_vector.benchmark(scale=scale, out=arguments.out)))
        written.append("vector")
    for name in written if arguments.out else []:
        print(f"\n{arguments.out / f'{name}.md'}\n{arguments.out / f'{name}.json'}")
    return 0


def _validate(arguments: argparse.Namespace) -> int:
    from tca_mj.validation.report import report, validate_tca

    try:
        print(report(validate_tca(arguments.out)))
    except ImportError as error:
        print(f"tca-mj validate: {error}", file=sys.stderr)
        return 2
    if arguments.out:
        print(f"\n{arguments.out / 'report.md'}\n{arguments.out / 'report.json'}")
    return 0


def _certify(arguments: argparse.Namespace) -> int:
    from tca_mj.certify.report import certify

    try:
        result = certify(arguments.module, out=arguments.out, seed=arguments.seed)
    except (ImportError, ValueError) as error:
        print(f"tca-mj certify: {error}", file=sys.stderr)
        return 2
    print(result["text"])
    if arguments.out:
        print(f"\n{arguments.out / 'report.md'}\n{arguments.out / 'report.json'}")
    return 0

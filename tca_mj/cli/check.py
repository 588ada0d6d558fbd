"""Figures of the package itself: ``bench`` its speed, ``validate`` and ``certify`` its models."""

import argparse
from pathlib import Path

from tca_mj.cli.arguments import Commands, add, add_command


def add_commands(commands: Commands) -> None:
    """Adds bench, validate and certify."""
    bench = add_command(commands, "bench", _bench, help="measure the speed on this machine")
    add(bench, "part", "single: TCAs, one task and its recordings, a minute; vector: many tasks at"
        " once and training, some minutes; soak: random steps of all tasks, an hour; default: the"
        " first two", nargs="?", choices=["single", "vector", "soak"])  # fmt: skip
    add(bench, "--task", "which, by id or module:id, several times for several; default: all, and"
        " of them the first with a demo", action="append", default=[], dest="tasks")  # fmt: skip
    add(bench, "--out", "folder for the results, JSON and Markdown; a soak that is there goes on")
    add(bench, "--quick", "a tenth of the measurements", action="store_true")
    add(bench, "--steps", "of a soak, in all; default 1000000", default=1_000_000)
    add(bench, "--seed", "of a soak; default 0")

    validate = add_command(commands, "validate", _validate,
                           help="compare the models with what is published")  # fmt: skip
    add(validate, "subject", "what to validate", choices=["tca"])
    add(validate, "--out", "folder; default: write nothing")

    certify = add_command(commands, "certify", _certify,
                          help="compare the chains with the theory of rods")  # fmt: skip
    add(certify, "module", "which modules; default: all", nargs="*")
    add(certify, "--out", "folder; default: write nothing")
    add(certify, "--seed", "of the cases; default 0")


def _bench(arguments: argparse.Namespace) -> int:
    """Measures the speed on this machine, or, with `soak`, looks for faults in very many random
    steps: exceptions, numbers that are none, observations out of bounds, divergence, growth.

    Exit code: 0, or 1 if a soak has found a fault.

    examples:
      tca-mj bench --out runs/bench
      tca-mj bench soak --out runs/soak      goes on where it was killed
    """
    from tca_mj.bench import single, soak, vector

    scale, out, tasks = 0.1 if arguments.quick else 1.0, arguments.out, arguments.tasks
    if arguments.part == "soak":
        steps = max(int(scale * arguments.steps), 1)
        arguments.kept += [f"the same command goes on in {out}"] if out else []
        result = soak.soak(steps=steps, seed=arguments.seed, out=out, ids=tasks, say=_say)
        _show(soak.report(result), out, "soak")
        return 1 if soak.faults(result) else 0
    if arguments.part != "vector":
        found = single.benchmark(scale=scale, out=out, task=tasks[0] if tasks else None)
        _show(single.report(found), out, "benchmark")
    if arguments.part is None:
        print()
    if arguments.part != "single":
        _show(vector.report(vector.benchmark(scale=scale, out=out, ids=tasks)), out, "vector")
    return 0


def _validate(arguments: argparse.Namespace) -> int:
    """Recomputes every published fact about TCAs (Sun, dissertation, Colorado State University,
    Chapters 2 and 3) and prints it beside the model's value, the band and the verdict. Takes half a
    minute.

    Writes into the folder --out:
      report.json          the same as data
      report.md            the same as text
      validation_*.png     figures (needs the extra demo)

    A fact that is missed is no failure of the command: its exit code is 0.
    """
    from tca_mj.validation.report import report, validate_tca

    _show(report(validate_tca(arguments.out)), arguments.out, "report")
    return 0


def _certify(arguments: argparse.Namespace) -> int:
    """Compares the MuJoCo chain of every module, at its default nodes, with the theory of rods:
    error of the tip's place and rotation and of the TCAs' lengths over the working range, in cases
    drawn by seed, and the order of the error. All modules take some minutes of processor time.

    By default all modules, and single claims; the refusal of any other word names the modules.

    Writes into the folder --out:
      report.json          the same as data, case by case
      report.md            the same as text
      accuracy_*.png       figures (needs the extra demo)

    An error beyond 1 % of the length or 2 degrees is no failure of the command: its exit code is 0.
    """
    from tca_mj.certify.report import certify

    result = certify(arguments.module, out=arguments.out, seed=arguments.seed)
    _show(result["text"], arguments.out, "report")
    return 0


def _say(line: str) -> None:
    print(line, flush=True)


def _show(text: str, out: Path | None, name: str) -> None:
    """Prints a result, and where it was written."""
    print(text, flush=True)
    if out is not None:
        print(f"\n{out / f'{name}.md'}\n{out / f'{name}.json'}")

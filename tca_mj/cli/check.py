"""Figures of the package itself: ``bench`` its speed, ``validate`` and ``certify`` its models."""

import argparse
from functools import partial
from pathlib import Path

from tca_mj.cli.arguments import Commands, add, add_command, parse_number


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
    add(certify, "module", "which modules, or module:function that builds a robot; default: all"
        " modules", nargs="*")  # fmt: skip
    add(certify, "--out", "folder; default: write nothing")
    add(certify, "--seed", "of the modules' cases; default 0")
    add(certify, "--tca", "the modules' muscle, or argument of the function: a file or a name in"
        " tca_mj.CATALOGUE; default: their own")  # fmt: skip
    above_0 = partial(parse_number, above=0.0)
    robot = certify.add_argument_group("of a robot that module:function builds")
    add(robot, "--hot", "temperature of a hot TCA, or one for each; default 120", type=parse_number,
        nargs="+", metavar="CELSIUS")  # fmt: skip
    add(robot, "--gravity", "x, y and z in m/s²; default: the robot's", type=parse_number, nargs=3,
        metavar=("X", "Y", "Z"))  # fmt: skip
    add(robot, "--spine", "temperature at which its shape-memory spines stay", type=parse_number,
        metavar="CELSIUS")  # fmt: skip
    add(robot, "--nodes", "argument of the function; default: its own")
    add(robot, "--tolerance", "of the tip, in %% of the length; default 1", type=above_0,
        metavar="PERCENT")  # fmt: skip
    add(robot, "--angle", "tolerance of the tip's frame; default 2", type=above_0,
        metavar="DEGREES")  # fmt: skip
    add(robot, "--workers", "processes; default: one per core")


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

    module:function certifies a robot of one's own, what that function returns: cold, each TCA hot,
    each two and all, without gravity and with it. The module is looked for in this folder, too.
    What the theory does not cover (motors, contact, loops) is refused by its name, and so are
    spines of shape-memory polymer unless --spine says how hot they are.

    Writes into the folder --out:
      report.json          the same as data, case by case
      report.md            the same as text
      accuracy_*.png       figures, of modules only (needs the extra demo)

    Exit code: of modules 0, also where an error is beyond 1 % of the length or 2 degrees; of a
    robot 1 where one is beyond the tolerances or a case has no answer.

    examples:
      tca-mj certify bending arm --out runs/certificate
      tca-mj certify bending --tca mine.json
      tca-mj certify my_robots:two_modules --hot 100 --gravity 0 0 9.81
    """
    robots = [name for name in arguments.module if ":" in name]
    if robots:
        return _certify_robots(robots, arguments)
    named = ("hot", "gravity", "spine", "nodes", "tolerance", "angle")
    given = [f"--{name}" for name in named if getattr(arguments, name) is not None]
    if given:
        raise ValueError(f"{given[0]} is for a robot, module:function")
    from tca_mj.certify.report import certify

    result = certify(
        arguments.module, out=arguments.out, seed=arguments.seed, tca=arguments.tca,
        **({} if arguments.workers is None else {"workers": arguments.workers}),
    )  # fmt: skip
    _show(result["text"], arguments.out, "report")
    return 0


def _say(line: str) -> None:
    print(line, flush=True)


def _certify_robots(robots: list[str], arguments: argparse.Namespace) -> int:
    """Certifies robots of one's own."""
    if len(robots) < len(arguments.module):
        raise ValueError(f"give modules or robots, got {' '.join(arguments.module)}")
    from math import radians

    from tca_mj.certify.robots import certify_robot
    from tca_mj.machine import machine

    asked = {"hot": arguments.hot and (arguments.hot if arguments.hot[1:] else arguments.hot[0]),
             "gravity": arguments.gravity, "nodes": arguments.nodes, "spine": arguments.spine,
             "tca": arguments.tca,
             "position": arguments.tolerance and arguments.tolerance / 100.0,
             "rotation": arguments.angle and radians(arguments.angle)}  # fmt: skip
    asked = {name: value for name, value in asked.items() if value is not None}
    held = True
    for robot in robots:
        out = arguments.out
        if out is not None and len(robots) > 1:
            out = out / robot.rpartition(":")[2]
        result = certify_robot(
            robot, out=out, workers=arguments.workers or int(machine()["cores"]), **asked
        )
        _show(result["text"], out, "report")
        held = held and result["within"]
    return 0 if held else 1


def _show(text: str, out: Path | None, name: str) -> None:
    """Prints a result, and where it was written."""
    print(text, flush=True)
    if out is not None:
        print(f"\n{out / f'{name}.md'}\n{out / f'{name}.json'}")

"""What the files of the command share: its choices, the types of arguments, how one adds a command.

An argument that its type refuses ends the program with code 2 and the reason.
"""

import argparse
import math
import os
import re
from collections.abc import Callable
from functools import partial
from inspect import cleandoc
from pathlib import Path
from typing import Any, TypeAlias

from tca_mj.checks import LARGEST
from tca_mj.registry import DEMOS, TASKS, find_task

POLICIES = ("scripted", "off", "random")  # who acts besides saved policies

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_command(
    commands: Commands, name: str, run: Callable[[argparse.Namespace], int], *, help: str,
    extra: str = "",
) -> argparse.ArgumentParser:  # fmt: skip
    """Adds a command, still without arguments.

    Args:
        commands: Where to.
        name: What one types.
        run: What it does with its arguments; returns the exit code. Its docstring is the command's
            help, as ``filled`` completes it. Errors of the user's it leaves to ``main``, and in the
            list ``kept`` of its arguments it notes what is left if it is broken off.
        help: One line for the list of commands.
        extra: Extra of the package that it needs, to be named where something is not installed.

    Returns:
        The parser of its arguments.
    """
    parser = commands.add_parser(
        name, help=help, description=filled(cleandoc(run.__doc__ or "")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run, command=name, kept=[], needs=partial(_needed, extra))
    return parser


def _needed(extra: str) -> str:
    from tca_mj.machine import how_to_install

    return f"; {how_to_install(extra)}" if extra else ""


def add(parser: argparse._ActionsContainer, name: str, help: str, **more: Any) -> None:
    """Adds an argument, of the kind that it is in all commands: see ``_KINDS``."""
    parser.add_argument(name, help=help, **{**_KINDS.get(name, {}), **more})


def add_how_made(parser: argparse.ArgumentParser) -> None:
    """Adds the robot's muscle, and what a policy's file says of its task but a .zip does not."""
    add(parser, "--tca", "the robot's muscle: a file, as tca_mj.tca.write_tca writes it, or a name"
        " in tca_mj.CATALOGUE; default: the robot's own")  # fmt: skip
    group = parser.add_argument_group(
        "how a model of Stable-Baselines3 (.zip) was trained",
        "Its file says neither what the task was made with nor how it saw it: say what differs from"
        "\nthe defaults. Other policies say it themselves.",
    )
    add(group, "--action", "what the TCAs are told; default: the policy's, else the task's",
        choices=("temperature", "power"))  # fmt: skip
    add(group, "--control-period", "time of a step [s]; default: the policy's, else the task's",
        type=parse_seconds, metavar="SECONDS")  # fmt: skip
    add(group, "--scaled", "whether it saw scaled observations, as TaskVecEnv(scaled=True) and"
        " ScaledObservation give them; default: told from the bounds of what it saw",
        action=argparse.BooleanOptionalAction, default=None)  # fmt: skip
    add(group, "--normalize", "statistics of the VecNormalize that it was trained in: an .npz of"
        " mean, var, clip and epsilon, or its pickle", type=Path, metavar="FILE")  # fmt: skip
    add(group, "--trust", "read that pickle, which runs whatever is in it; a .zip needs no trust",
        action="store_true")  # fmt: skip


def how_made(arguments: argparse.Namespace) -> dict[str, Any]:
    """What ``add_how_made`` has read: ``arguments`` of the task, and ``preprocessing``.

    Raises:
        FileNotFoundError: If there are no such statistics.
        ValueError: If they cannot be read, or not without trust.
    """
    from tca_mj.agents.policies import Preprocessing, Statistics

    given = {name: getattr(arguments, name) for name in ("action", "control_period", "tca")}
    path = arguments.normalize
    statistics = None if path is None else Statistics.read(path, trust=arguments.trust)
    return {
        "arguments": {name: value for name, value in given.items() if value is not None},
        "preprocessing": Preprocessing(scaled=arguments.scaled, statistics=statistics),
    }


def filled(text: str) -> str:
    """A help's text with the first task for ``{task}`` and the first demo for ``{demo}``."""
    return text.format(task=TASKS[0].id, demo=next(iter(DEMOS)))


def parse_seed(text: str, *, least: int = 0, most: int = 2**32 - 1) -> int:
    """A whole number from ``least`` to ``most``; of seeds the largest that all learners take."""
    digits = text.strip()
    if not re.fullmatch(r"[+-]?[0-9]+", digits):
        raise argparse.ArgumentTypeError(f"must be a whole number, got {_short(text)}")
    endless = -math.inf if digits[0] == "-" else math.inf
    number = int(digits) if len(digits) < 100 else endless
    if not least <= number <= most:
        bound = f"at least {least}" if number < least else f"at most {most}"
        raise argparse.ArgumentTypeError(f"must be {bound}, got {_short(digits)}")
    return int(number)


def parse_number(text: str, *, above: float = -math.inf, unit: str = "") -> float:
    """A finite number above a bound."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not max(above, -LARGEST) < number <= LARGEST:
        bound = f" above {above:g}{unit}" if above > -math.inf else ""
        raise argparse.ArgumentTypeError(f"must be a number{bound}, got {_short(text)}")
    return number


def _short(text: str) -> str:
    """A word as a message shows it."""
    return repr(text if len(text) <= 80 else f"{text[:40]}...{text[-20:]}")


# How many at most: as the functions behind the commands take them.
_COUNTS = {
    "--episodes": 10_000, "--steps": 1_000_000_000, "--workers": 1024, "--envs": 1024,
    "--seeds": 1000, "--nodes": 128,
}  # fmt: skip
parse_seconds = partial(parse_number, above=0.0, unit=" s")


def parse_task(text: str) -> str:
    """A task's id, or ``module:id`` of one outside this package."""
    try:
        find_task(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return text


def parse_option(text: str) -> tuple[str, Any]:
    """An option of a task and its value, from ``NAME=VALUE`` or ``NAME=VALUE,VALUE,...``."""
    name, values = parse_axis(text)
    return name, values[0] if len(values) == 1 else list(values)


def parse_axis(text: str) -> tuple[str, tuple[Any, ...]]:
    """A setting and its values, from ``NAME=VALUE,VALUE,...``; numbers where they are."""
    name, _, values = text.partition("=")
    if not name or not values:
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE,..., got {_short(text)}")

    def value(part: str) -> float | int | str:
        for kind in (int, float):
            try:
                return kind(part)
            except ValueError:
                continue
        return part

    return name, tuple(value(part) for part in values.split(","))


def parse_teacher(text: str) -> tuple[str, dict[str, Any]]:
    """A policy and options of a task, from ``POLICY:NAME=VALUE:NAME=VALUE``."""
    policy, options = text, dict[str, Any]()
    while ":" in policy and "=" in policy.rpartition(":")[2]:
        policy, _, last = policy.rpartition(":")
        name, value = parse_option(last)
        options = {name: value, **options}
    if not policy:
        raise argparse.ArgumentTypeError(f"must be POLICY:NAME=VALUE, got {_short(text)}")
    return policy, options


def parse_folder(text: str) -> Path:
    """A folder that one may write into, there or to be made."""
    path = Path(text)
    try:
        there = next((p for p in (path, *path.absolute().parents) if p.exists()), path)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"must be a folder: {error.strerror}") from error
    if not there.is_dir():
        raise argparse.ArgumentTypeError(f"must be a folder, {there} is a file")
    if not os.access(there, os.W_OK):
        raise argparse.ArgumentTypeError(f"must be a folder to write into, {there} is not")
    return path


def task_name(task: str) -> str:
    """Name of a task's folder."""
    return task.rpartition(":")[2].rpartition("/")[2].rpartition("-v")[0]


_TASK = {"type": parse_task, "metavar": "TASK"}
_KINDS: dict[str, dict[str, Any]] = {
    "task": _TASK,
    "--task": _TASK,
    "--out": {"type": parse_folder},
    "--seed": {"type": parse_seed, "default": 0},
    "--tca": {"metavar": "FILE"},
    **{name: {"type": partial(parse_seed, least=1, most=most)} for name, most in _COUNTS.items()},
}

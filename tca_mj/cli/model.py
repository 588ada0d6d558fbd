"""Models of tasks: ``collect`` makes a data set of steps, ``fit`` a model from it."""

import argparse
from operator import itemgetter
from pathlib import Path
from typing import Any

from tca_mj.cli.arguments import (
    Commands,
    add,
    add_command,
    parse_number,
    parse_option,
    parse_seconds,
    parse_seed,
)


def add_commands(commands: Commands) -> None:
    """Adds collect and fit."""
    collect = add_command(commands, "collect", _collect, help="make a data set of a task's steps")
    add(collect, "task", "its id")
    add(collect, "--out", "file, .npz", type=Path, required=True, metavar="FILE")
    add(collect, "--episodes", "default 100", default=100)
    add(collect, "--steps", "of an episode at most; default: the task's")
    add(collect, "--seed", "of the first episode; default 0")
    add(collect, "--policy", "who acts below the disturbances; given several times, by turns;"
        " default off", action="append", dest="policies", metavar="POLICY")  # fmt: skip
    add(collect, "--hottest", "temperature of a TCA that cuts an episode off [°C]; default: from"
        " where on the task charges for heat", type=parse_number, metavar="CELSIUS")  # fmt: skip
    add(collect, "--option", "an option of every reset; may be given several times",
        action="append", default=[], type=parse_option, metavar="NAME=VALUE",
        dest="options")  # fmt: skip
    add(collect, "--action", "what the TCAs are told; default: the policies', else the task's",
        choices=("temperature", "power"))  # fmt: skip
    add(collect, "--control-period", "time of a step [s]; default: by task", type=parse_seconds,
        metavar="SECONDS")  # fmt: skip
    add(collect, "--tca", "the robot's muscle: a file or a name in tca_mj.CATALOGUE; default: the"
        " robot's own")  # fmt: skip
    add(collect, "--envs", "tasks side by side; default 8", default=8)

    fit = add_command(commands, "fit", _fit, help="fit a model to a data set", extra="rl")
    add(fit, "data", "a file of `collect`", type=Path, metavar="DATA")
    add(fit, "--out", "file, .npz", type=Path, required=True, metavar="FILE")
    add(fit, "--driven", "row of the observation that commands drive; may be given several times",
        action="append", required=True, metavar="ROW")  # fmt: skip
    add(fit, "--followed", "row that follows those; may be given several times", action="append",
        default=[], metavar="ROW")  # fmt: skip
    add(fit, "--kind", "default split", choices=("split", "linear", "bilinear", "network"),
        default="split")  # fmt: skip
    add(fit, "--degree", "of the products of driven numbers; default 4", type=parse_seed,
        default=4, metavar="N")  # fmt: skip
    add(fit, "--memory", "time constant of a running mean [s]; may be given several times;"
        " default 3, 10 and 30", action="append", type=parse_seconds, dest="memories",
        metavar="SECONDS")  # fmt: skip
    add(fit, "--seed", "of a network; default 0")
    add(fit, "--test", "another file of `collect`, on which the errors are measured", type=Path,
        metavar="DATA")  # fmt: skip


def _collect(arguments: argparse.Namespace) -> int:
    """Runs episodes of a task under commands that are disturbed at random, and writes all their
    steps into one file of arrays: observation, action, next_observation, reward, terminated,
    truncated; length and seed of the episodes; and in its header the task, its options and rows.
    The same command gives the same file, whatever --envs is.

    examples:
      tca-mj collect {task} --episodes 100 --out runs/steps.npz
      tca-mj collect TASK --policy off --policy scripted --option randomise=0.1 --out runs/mixed.npz
      tca-mj collect my_robots:Mine/Reach-v0 --action power --out runs/mine.npz
    """
    from tca_mj.agents.model import collect

    how = {name: getattr(arguments, name) for name in ("action", "control_period", "tca")}
    found = collect(
        arguments.task, episodes=arguments.episodes, steps=arguments.steps, seed=arguments.seed,
        policies=tuple(arguments.policies or ("off",)), hottest=arguments.hottest,
        options=dict(arguments.options), envs=arguments.envs, progress=True,
        arguments={name: value for name, value in how.items() if value is not None},
    )  # fmt: skip
    found.save(arguments.out)
    print(f"{found.length.sum()} steps of {found.length.size} episodes\n  {arguments.out}")
    return 0


def _fit(arguments: argparse.Namespace) -> int:
    """Fits a model to a data set: how commands drive some rows of the observation, and how others
    follow those. With --test it prints how far predictions of 1, 5 and 20 s are off that know the
    commands alone: root of the mean square, and most. A network needs the extra rl.

    example:
      tca-mj fit runs/steps.npz --driven "TCA temperature" --followed "tip position" \\
          --test runs/others.npz --out runs/model.npz
    """
    from tca_mj.agents.model import Transitions, View, fit_model, prediction_errors
    from tca_mj.pages import table

    data = Transitions.read(arguments.data)
    view = View(
        made_for=data.made_for, driven=tuple(arguments.driven),
        followed=tuple(arguments.followed), degree=arguments.degree,
        memories=tuple(arguments.memories or (3.0, 10.0, 30.0)),
    )  # fmt: skip
    test = None if arguments.test is None else Transitions.read(arguments.test)
    model = fit_model(data, view, arguments.kind, seed=arguments.seed)
    model.save(arguments.out)
    if test is not None:
        ahead = {t: round(t / view.period) for t in (1, 5, 20)}
        ahead = {t: n for t, n in ahead.items() if 1 <= n <= test.length.max()}
        rows: list[list[str]] = []
        for name in (*view.driven, *view.followed):
            unit = data.made_for["observation"][name][1]
            rows.append([f"{name} [{unit}]"])
            for steps in ahead.values():
                off: Any = prediction_errors(model, test, steps, itemgetter(name))
                rows[-1].append(f"{(off**2).mean() ** 0.5:.3g} ({abs(off).max():.3g})")
        print("\n".join(table(["off after", *(f"{t} s" for t in ahead)], rows)))
    print(f"  {arguments.out}")
    return 0

"""Policies: ``eval`` measures one, ``train`` makes one, ``distil`` makes one of several, ``sweep``
evaluates or trains at many settings."""

import argparse
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from tca_mj.cli.arguments import (
    Commands,
    add,
    add_command,
    add_how_made,
    how_made,
    parse_axis,
    parse_number,
    parse_option,
    parse_seconds,
    parse_teacher,
    task_name,
)
from tca_mj.registry import ALGORITHMS


def add_commands(commands: Commands) -> None:
    """Adds eval, train, distil and sweep."""
    evaluation = add_command(commands, "eval", _eval, help="measure how good a policy is")
    add(evaluation, "policy", "who acts", metavar="POLICY")
    add(evaluation, "--task", "its id", required=True)
    add(evaluation, "--episodes", "default 10", default=10)
    add(evaluation, "--seed", "of the first episode; default 0")
    add(evaluation, "--randomise", "share by which the robot is drawn to be off, 0 to 0.5;"
        " default 0", type=parse_number, default=0.0, metavar="SHARE")  # fmt: skip
    add(evaluation, "--option", "an option of every reset; may be given several times",
        action="append", default=[], type=parse_option, metavar="NAME=VALUE",
        dest="options")  # fmt: skip
    add(evaluation, "--steps", "of an episode; default: the task's")
    add(evaluation, "--model", "used, or one of the task's finer models, as `list` has it",
        default="used")  # fmt: skip
    add(evaluation, "--timestep", "of the physics; default: the task's", type=parse_seconds)
    add(evaluation, "--out", "folder; default runs/eval/TASK-POLICY")
    add(evaluation, "--workers", "processes; default 1", default=1)
    add(evaluation, "--fresh", "forget what the folder holds", action="store_true")
    add_how_made(evaluation)

    train = add_command(commands, "train", _train, help="train a policy", extra="rl")
    add(train, "task", "its id")
    add(train, "--algo", "how; default: what was best for the task", choices=ALGORITHMS)
    add(train, "--steps", "steps of the task in all; default: by task")
    add(train, "--option", "an option of every reset; may be given several times", action="append",
        default=[], type=parse_option, metavar="NAME=VALUE", dest="options")  # fmt: skip
    add(train, "--action", "what the TCAs are told; default: by task",
        choices=("temperature", "power"))  # fmt: skip
    add(train, "--control-period", "time of a step [s]; default: by task", type=parse_seconds,
        metavar="SECONDS")  # fmt: skip
    add(train, "--tca", "the robot's muscle: a file or a name in tca_mj.CATALOGUE")
    some = train.add_mutually_exclusive_group()
    add(some, "--seed", "default 0")
    add(some, "--seeds", "runs with seeds 0 to K-1, into OUT/seed_0, ...", metavar="K")
    add(train, "--out", "folder; default runs/train/TASK-ALGO")
    add(train, "--workers", "processes of cma; default 2", default=2)
    add(train, "--address", "of a running Ray cluster whose cores run cma's episodes; default:"
        " --workers processes")  # fmt: skip
    add(train, "--envs", "environments at a time; not of cma")
    add(train, "--residual", "correct a gait by at most K kelvin", type=parse_number, metavar="K")
    add(train, "--video", "film the best network at the end; --no-video leaves that for later",
        action=argparse.BooleanOptionalAction, default=True)  # fmt: skip
    add(train, "--start", "gait to begin with or to correct: scripted, trot, a policy's file or"
        " name, random for none; default: by task, scripted for cma", metavar="GAIT")  # fmt: skip

    distil = add_command(commands, "distil", _distil, help="make one policy of several", extra="rl")
    add(distil, "teachers", "who is learned from, and the options of the task with which it knows"
        " what to do", nargs="+", type=parse_teacher, metavar="POLICY:NAME=VALUE")  # fmt: skip
    add(distil, "--task", "its id", required=True)
    add(distil, "--option", "an option of every reset besides; may be given several times",
        action="append", default=[], type=parse_option, metavar="NAME=VALUE",
        dest="options")  # fmt: skip
    add(distil, "--argument", "an argument that the task is made with; with several values, as many"
        " environments with each", action="append", default=[], type=parse_axis,
        metavar="NAME=VALUE,...", dest="made_with")  # fmt: skip
    add(distil, "--steps", "steps of the task in all; default 15000")
    add(distil, "--envs", "environments at a time, of each kind; default 6")
    add(distil, "--seed", "default 0")
    add(distil, "--out", "folder; default runs/distil/TASK")

    sweep = add_command(
        commands, "sweep", _sweep, help="evaluate or train at many settings", extra="sweep"
    )
    add(sweep, "policy", "who acts; not with --algo", nargs="?", metavar="POLICY")
    add(sweep, "--task", "its id; may be given several times", action="append", required=True,
        dest="tasks")  # fmt: skip
    add(sweep, "--algo", "train this way, then evaluate", choices=ALGORITHMS)
    add(sweep, "--set", "values of a setting; may be given several times", action="append",
        default=[], type=parse_axis, metavar="NAME=VALUE,...", dest="axes")  # fmt: skip
    add(sweep, "--episodes", "of each evaluation; default 5", default=5)
    add(sweep, "--workers", "trials at a time; default 2", default=2)
    add(sweep, "--address", "of a running Ray cluster; default: one in this machine")
    add(sweep, "--out", "folder; seen by all machines", required=True)
    add_how_made(sweep)


def _eval(arguments: argparse.Namespace) -> int:
    """Runs episodes of a policy in a task and writes into the folder --out:
      episodes.jsonl   one line for each finished episode; the same command again goes on from there
      summary.json     mean, 95 % interval, least and most of every figure, the settings, versions
      summary.md       the same as text

    Figures: return, success (of a gait: the end of its time was reached), duration, speed,
    distance, drift, energy, energy per metre, cost of transport E/(m g d), peak temperature and
    tension. Intervals of means are Student's t over episodes, of success Wilson's, of the two
    ratios bootstrap. Nothing depends on --workers.

    POLICY is scripted, off (no power), random, a shipped policy's name, a policy's file, the
    folder of a training run, whose best policy is taken, or a model that Stable-Baselines3 or
    sb3-contrib has saved (.zip), which is read without running anything that is in it.

    examples:
      tca-mj eval scripted --task {task} --episodes 20 --randomise 0.2
      tca-mj eval runs/train/FOLDER --task TASK --workers 2
      tca-mj eval walk.zip --task TASK --control-period 0.5
      tca-mj eval scripted --task TASK --model fine --timestep 0.002 --episodes 3
    """
    from tca_mj.agents.evaluate import REPORT, Evaluation, evaluate, report

    name = f"{task_name(arguments.task)}-{Path(arguments.policy).stem}"
    out = arguments.out or Path("runs/eval") / name
    settings = ("task", "policy", "episodes", "seed", "randomise", "steps", "model", "timestep")
    given = {key: getattr(arguments, key) for key in settings}
    given["options"] = dict(arguments.options)
    evaluation = Evaluation(**given, **how_made(arguments))
    arguments.kept.append(f"what was finished is in {out}")
    summary = evaluate(evaluation, out=out, workers=arguments.workers, fresh=arguments.fresh)
    print(f"{report(summary)}\n\n{out / REPORT}")
    return 0


def _train(arguments: argparse.Namespace) -> int:
    """Trains a policy for a task and writes the run into the folder --out. Ctrl-C and even kill -9
    lose at most the last interval: the same command again goes on with the run. What is drawn comes
    from --seed alone; with the same seed the curve is the same to the last digit, interrupted or
    not.

      sac, ppo, td3, tqc, crossq
             deep reinforcement learning by Stable-Baselines3, for every task. Without --algo, and
             without other settings, a task is learned by its recipe: what was best of what was
             tried (docs/training.md). Of a gait task the gait --start fills the first memories of
             a learner that has any; with --residual K a policy corrects that gait's temperatures
             by at most K kelvin.
      cma    searches the figures of a gait on four legs (CMA-ES), from the scripted one, in about
             10 minutes on two cores. Episodes run in --workers processes or on a cluster, on whose
             number nothing depends.

    The folder holds
      run.json        settings, command, versions, machine
      state.pkl       where the run stands; only go on with runs that you trust
      curve.csv       the learning curve; tensorboard/ has the same: `tensorboard --logdir FOLDER`
      best.json, best.npz   the best policy so far (a gait, a network):
                      `tca-mj view TASK --policy FOLDER/best.npz`
      last.json, last.npz   the policy where the run stands
      evaluations.csv, best.rrd, best.mp4   evaluations of a network and an episode of the best

    Needs the extra rl. Exit code: 0 when the run is done, 2 if the command was wrong,
    130 after Ctrl-C.

    examples:
      tca-mj train {task} --out runs/learned
      tca-mj train TASK --option NAME=VALUE --steps 40000 --seeds 5 --out runs/five
      tca-mj train TASK --algo cma --start trot --seeds 3 --out runs/trot
      tca-mj train TASK --residual 40 --start GAIT --out runs/corrected
    """
    import tca_mj.agents.train.deep as training
    import tca_mj.agents.train.search as searching
    from tca_mj.agents.train.config import best_algorithm, default_config, described

    algorithm = arguments.algo or best_algorithm(arguments.task)
    base = arguments.out or Path("runs/train") / f"{task_name(arguments.task)}-{algorithm}"
    several = range(arguments.seeds) if arguments.seeds else None
    command, cma = _command(arguments), algorithm == "cma"
    how = ("action", "control_period", "tca")
    asked = {name: getattr(arguments, name) for name in how if getattr(arguments, name) is not None}
    if cma and asked.keys() - {"tca"}:
        raise ValueError("--action and --control-period are not for --algo cma")
    if arguments.address is not None and not cma:
        raise ValueError("--address is for --algo cma; many trainings at once are a sweep's")
    for seed in several or [arguments.seed]:
        out = base / f"seed_{seed}" if several else base
        arguments.kept[:] = [f"the same command goes on with {out}"]
        given: dict[str, Any] = {"seed": seed}
        for option in ("steps", "start") if cma else ("steps", "start", "envs", "residual"):
            if getattr(arguments, option) is not None:
                given[option] = getattr(arguments, option)
        if cma:
            config = searching.SearchConfig(task=arguments.task, tca=arguments.tca, **given)
            config = replace(config, options={**config.options, **dict(arguments.options)})
            searching.search(
                config, out, workers=arguments.workers, command=command, address=arguments.address
            )
        else:
            given |= {"arguments": asked, "options": dict(arguments.options)}
            settings = default_config(arguments.task, algorithm, **given)
            print(described(settings), file=sys.stderr)
            training.train(settings, out, command=command, video=False)
            if arguments.video:
                arguments.kept[:] = [f"{out} is finished but for its film, which the same command"
                                     f" makes, or tca-mj demo --policy {shlex.quote(str(out))}"
                                     f" --task {arguments.task}"]  # fmt: skip
                print("filming the best policy; Ctrl-C leaves that for later", file=sys.stderr)
                training.film(settings, out)
        print(f"  {out / ('best.json' if cma else 'best.npz')}")
    return 0


def _command(arguments: argparse.Namespace) -> str:
    """The command of a training run, to be noted."""
    words = ["tca-mj", "train", arguments.task]
    left_out = {"seed": bool(arguments.seeds)}
    for option in ("algo", "steps", "action", "control_period", "tca", "envs", "residual", "start",
                   "seeds", "seed"):  # fmt: skip
        value = getattr(arguments, option)
        if value is not None and not left_out.get(option):
            number = f"{value:g}" if isinstance(value, float) else str(value)
            words += [f"--{option.replace('_', '-')}", number]
    for name, value in arguments.options:
        words += ["--option", f"{name}={value}"]
    return shlex.join(words)


def _distil(arguments: argparse.Namespace) -> int:
    """Makes one policy of several that see and do the same, and writes the run into the folder
    --out. Each teacher knows what to do with some options of the task; the pupil, a network of two
    layers of 256, learns what all of them do, in episodes that it drives itself (DAgger). Options
    and time step are those of the task's recipe where nothing else is said. Ctrl-C and even kill -9
    lose at most a round, in which each environment makes as many steps as an episode has: the same
    command again goes on with the run. With the same --seed and teachers the policy is the same
    to the last digit.

    The folder holds
      best.npz        the policy after the last round
      curve.csv       for each round how far the pupil, as it was before, was off its teachers
                      (error, of actions from -1 to 1, as the root of the mean square), in all and
                      for each, and what it earned
      run.json        settings, command, versions, machine
      state.pkl       where the run stands; only go on with runs that you trust

    A teacher is a policy's file, a shipped policy's name or the folder of a training run. It has to
    be a network; observations may be scaled otherwise. Needs the extra rl.

    examples:
      tca-mj distil runs/a:NAME=VALUE runs/b:NAME=VALUE --task TASK --out runs/one
      tca-mj distil POLICY --task {task} --argument NAME=VALUE,VALUE
    """
    import tca_mj.agents.train.distil as distilling

    out = arguments.out or Path("runs/distil") / task_name(arguments.task)
    given: dict[str, Any] = {"seed": arguments.seed, "options": dict(arguments.options),
                             "arguments": dict(arguments.made_with)}  # fmt: skip
    for name in ("steps", "envs"):
        if getattr(arguments, name) is not None:
            given[name] = getattr(arguments, name)
    teachers = tuple(
        distilling.Teacher(policy=policy, options=options) for policy, options in arguments.teachers
    )
    words = ["tca-mj", "distil"]
    words += [":".join([policy, *(_given(*each) for each in options.items())])
              for policy, options in arguments.teachers]  # fmt: skip
    words += ["--task", arguments.task]
    for option, pairs in (("option", arguments.options), ("argument", arguments.made_with)):
        for each in pairs:
            words += [f"--{option}", _given(*each)]
    for name in ("steps", "envs", "seed"):
        if getattr(arguments, name) is not None:
            words += [f"--{name}", str(getattr(arguments, name))]
    arguments.kept.append(f"the same command goes on with {out}")
    config = distilling.distil_config(arguments.task, teachers, **given)
    distilling.distil(config, out, command=shlex.join(words))
    print(f"  {out / distilling.POLICY}")
    return 0


def _given(name: str, value: Any) -> str:
    """An option as it is typed."""
    several = value if isinstance(value, list | tuple) else [value]
    return f"{name}={','.join(map(str, several))}"


def _sweep(arguments: argparse.Namespace) -> int:
    """Runs an evaluation, or a training and the evaluation of its best policy, at all combinations
    of the values that --set names, side by side by Ray Tune, and writes into the folder --out:
      results.csv   one row for each combination: means and 95 % intervals, in SI units
      results.md    the same as text
      results.png   the same as a figure, where Matplotlib is installed
      trials/       the folder of each, in which it goes on where it stopped

    A trial whose process or machine is lost is begun again and goes on; so does the whole sweep
    with the same command. Needs the extra sweep.

    --set NAME=VALUE,VALUE,... with NAME
      seed, policy, randomise, episodes, steps, model, timestep    of `tca-mj eval`
      design.PATH                 a figure of the robot: design.leg.length,
                                  design.leg.tca (name in the catalogue),
                                  design.leg.tca.pitch_angle, ...
      train.FIELD                 with --algo: train.seed, train.learner.learning_rate, ...
      train.design.PATH           with --algo: of the robot that is trained and evaluated, so that
                                  each design gets the gait that suits it
    A single value sets what is the same in all of them.

    examples:
      tca-mj sweep scripted --task TASK --episodes 3 --out runs/legs \\
          --set design.leg.length=0.05,0.055,0.06 --set design.leg.rod_diameter=4e-4,4.5e-4
      tca-mj sweep --algo sac --task {task} --out runs/rates \\
          --set train.seed=0,1,2 --set train.learner.learning_rate=0.001,0.0003 \\
          --set train.steps=40000
    """
    from tca_mj.agents.evaluate import Evaluation
    from tca_mj.agents.policies import Preprocessing
    from tca_mj.agents.sweep import FIGURE, PAGE, TABLE, Sweep, run_sweep

    if (arguments.policy is None) == (arguments.algo is None):
        raise ValueError("give POLICY or --algo")
    how = how_made(arguments)
    untold = how["preprocessing"] == Preprocessing() and not how["arguments"].keys() - {"tca"}
    if arguments.algo and not untold:
        raise ValueError("how a model was trained is said of POLICY, not with --algo")
    evaluation = Evaluation(
        task=arguments.tasks[0], policy=arguments.policy or "off", episodes=arguments.episodes,
        **how,
    )  # fmt: skip
    axes = ({"task": arguments.tasks} if arguments.tasks[1:] else {}) | dict(arguments.axes)
    arguments.kept.append(f"the same command goes on with {arguments.out}")
    sweep = Sweep(evaluation=evaluation, axes=axes, algorithm=arguments.algo)
    try:
        run_sweep(sweep, arguments.out, workers=arguments.workers, address=arguments.address)
    except RuntimeError as error:
        print(f"tca-mj sweep: {error}", file=sys.stderr)
        return 1
    print((arguments.out / PAGE).read_text(encoding="utf-8"))
    written = (arguments.out / name for name in (TABLE, PAGE, FIGURE))
    print("\n".join(str(file) for file in written if file.is_file()))
    return 0

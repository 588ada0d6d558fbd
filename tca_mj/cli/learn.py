"""Policies: ``eval`` measures one, ``train`` makes one, ``sweep`` does so at many settings."""

import argparse
import sys
from pathlib import Path
from typing import Any

from tca_mj.cli.arguments import (
    ALGORITHMS,
    Commands,
    add_command,
    parse_axis,
    parse_count,
    parse_folder,
    parse_seed,
    parse_task,
    task_name,
)

_EVAL = """\
Runs episodes of a policy in a task and writes into the folder --out:
  episodes.jsonl   one line for each finished episode; the same command again goes on from there
  summary.json     mean, 95 % interval, least and most of every figure, the settings, versions
  summary.md       the same as text

Figures: return, success (of a gait: the end of its time was reached), duration, speed, distance,
drift, energy, energy per metre, cost of transport E/(m g d), peak temperature and tension.
Intervals of means are Student's t over episodes, of success Wilson's, of the two ratios bootstrap.
Nothing depends on --workers.

POLICY is scripted, off (no power), random, a shipped policy's name, a policy's file, or the folder
of a training run, whose best policy is taken.

examples:
  tca-mj eval scripted --task TCA/BendReach-v0 --episodes 20 --randomise 0.2
  tca-mj eval runs/train/TetrapodWalk-cma --task TCA/TetrapodWalk-v0 --workers 2
  tca-mj eval scripted --task TCA/TetrapodWalk-v0 --model fine --timestep 0.002 --episodes 3
"""

_TRAIN = """\
Trains a policy for a task and writes the run into the folder --out. Ctrl-C and even kill -9 lose
at most the last interval: the same command again goes on with the run. What is drawn comes from
--seed alone; with the same seed the curve is the same to the last digit, interrupted or not.

  cma    searches the figures of a tetrapod's gait (CMA-ES), from the scripted one; a gait task
         takes about 10 minutes on two cores. Episodes run in --workers processes, on whose number
         nothing depends.
  ppo, sac, td3
         deep reinforcement learning by Stable-Baselines3, for every task. The defaults of each
         task are in tca_mj.agents.config. With --residual K the policy of a gait task corrects the
         temperatures of the gait --start by at most K kelvin.

The folder holds
  run.json        settings, command, versions, machine
  state.pkl       where the run stands; only go on with runs that you trust
  curve.csv       the learning curve; tensorboard/ has the same: `tensorboard --logdir FOLDER`
  best.json, best.npz   the best policy so far (a gait, a network):
                  `tca-mj view TASK --policy FOLDER/best.npz`
  last.json, last.npz   the policy where the run stands
  evaluations.csv, best.rrd, best.mp4   evaluations of a network and an episode of the best

Needs `pip install 'tca-mj[rl]'`. Exit code: 0 when the run is done, 2 if the command was wrong,
130 after Ctrl-C.

examples:
  tca-mj train TCA/TetrapodWalk-v0 --algo cma --seed 0 --out runs/walk
  tca-mj train TCA/TetrapodWalk-v0 --algo cma --start trot --seeds 3 --out runs/trot
  tca-mj train TCA/TetrapodWalk-v0 --algo ppo --residual 20 --steps 300000 --out runs/corrected
"""

_SWEEP = """\
Runs an evaluation, or a training and the evaluation of its best policy, at all combinations of the
values that --set names, side by side by Ray Tune, and writes into the folder --out:
  results.csv   one row for each combination: means and 95 % intervals, in SI units
  results.md    the same as text
  trials/       the folder of each, in which it goes on where it stopped

A trial whose process or machine is lost is begun again and goes on; so does the whole sweep with
the same command. Needs `pip install 'tca-mj[sweep]'`.

--set NAME=VALUE,VALUE,... with NAME
  seed, policy, randomise, episodes, steps, model, timestep    of `tca-mj eval`
  design.PATH                 a figure of the robot: design.leg.length, design.leg.rod_diameter,
                              design.leg.tca (name in the catalogue), design.leg.tca.pitch_angle
  train.FIELD                 with --algo: train.seed, train.steps, train.learner.learning_rate, ...
A single value sets what is the same in all of them.

examples:
  tca-mj sweep scripted --task TCA/TetrapodWalk-v0 --episodes 3 --out runs/legs \\
      --set design.leg.length=0.05,0.055,0.06 --set design.leg.rod_diameter=0.0004,0.00045
  tca-mj sweep --algo sac --task TCA/BendReach-v0 --out runs/rates \\
      --set train.seed=0,1,2 --set train.learner.learning_rate=0.001,0.0003 --set train.steps=40000
"""


def add_commands(commands: Commands) -> None:
    """Adds eval, train and sweep."""
    evaluation = add_command(
        commands, "eval", _eval, help="measure how good a policy is", text=_EVAL
    )
    evaluation.add_argument("policy", metavar="POLICY", help="who acts")
    evaluation.add_argument(
        "--task", type=parse_task, metavar="TASK", required=True, help="its id"
    )
    evaluation.add_argument("--episodes", type=parse_count, default=10, help="default 10")
    evaluation.add_argument(
        "--seed", type=parse_seed, default=0, help="of the first episode; default 0"
    )
    evaluation.add_argument(
        "--randomise", type=float, default=0.0, metavar="SHARE",
        help="share by which the robot is drawn to be off, 0 to 0.5; default 0",
    )
    evaluation.add_argument("--steps", type=parse_count, help="of an episode; default: the task's")
    evaluation.add_argument(
        "--model", default="used", help="used, or one of the task's finer models, as `list` has it",
    )
    evaluation.add_argument("--timestep", type=float, help="of the physics; default: the task's")
    evaluation.add_argument(
        "--out", type=parse_folder, help="folder; default runs/eval/TASK-POLICY"
    )
    evaluation.add_argument("--workers", type=parse_count, default=1, help="processes; default 1")
    evaluation.add_argument("--fresh", action="store_true", help="forget what the folder holds")

    train = add_command(commands, "train", _train, help="train a policy", text=_TRAIN)
    train.add_argument("task", type=parse_task, metavar="TASK", help="its id")
    train.add_argument("--algo", choices=ALGORITHMS, required=True, help="how")
    train.add_argument(
        "--steps", type=parse_count, help="steps of the task in all; default: by task"
    )
    some = train.add_mutually_exclusive_group()
    some.add_argument("--seed", type=parse_seed, default=0, help="default 0")
    some.add_argument(
        "--seeds", type=parse_count, metavar="K",
        help="runs with seeds 0 to K-1, into OUT/seed_0, ...",
    )
    train.add_argument("--out", type=parse_folder, help="folder; default runs/train/TASK-ALGO")
    train.add_argument("--workers", type=parse_count, default=2, help="processes of cma; default 2")
    train.add_argument("--envs", type=parse_count, help="environments of ppo, sac, td3 at a time")
    train.add_argument(
        "--residual", type=float, metavar="K", help="correct a gait by at most K kelvin"
    )
    train.add_argument(
        "--video", action=argparse.BooleanOptionalAction, default=True,
        help="film the best network at the end",
    )
    train.add_argument(
        "--start", default="scripted", metavar="GAIT",
        help="gait to begin with or to correct: scripted (default), trot, a policy's file or name",
    )

    sweep = add_command(
        commands, "sweep", _sweep, help="evaluate or train at many settings", text=_SWEEP
    )
    sweep.add_argument("policy", nargs="?", metavar="POLICY", help="who acts; not with --algo")
    sweep.add_argument("--task", type=parse_task, metavar="TASK", required=True, help="its id")
    sweep.add_argument("--algo", choices=ALGORITHMS, help="train this way, then evaluate")
    sweep.add_argument(
        "--set", action="append", default=[], type=parse_axis, metavar="NAME=VALUE,...",
        dest="axes", help="values of a setting; may be given several times",
    )
    sweep.add_argument(
        "--episodes", type=parse_count, default=5, help="of each evaluation; default 5"
    )
    sweep.add_argument("--workers", type=parse_count, default=2, help="trials at a time; default 2")
    sweep.add_argument("--address", help="of a running Ray cluster; default: one in this machine")
    sweep.add_argument(
        "--out", type=parse_folder, required=True, help="folder; seen by all machines"
    )


def _eval(arguments: argparse.Namespace) -> int:
    from tca_mj.agents.evaluate import REPORT, Evaluation, evaluate, report

    name = f"{task_name(arguments.task)}-{Path(arguments.policy).stem}"
    out = arguments.out or Path("runs/eval") / name
    settings = ("task", "policy", "episodes", "seed", "randomise", "steps", "model", "timestep")
    try:
        evaluation = Evaluation(**{key: getattr(arguments, key) for key in settings})
        summary = evaluate(
            evaluation, out=out, workers=arguments.workers, fresh=arguments.fresh
        )
    except KeyboardInterrupt:
        print(f"interrupted; what was finished is in {out}", file=sys.stderr)
        return 130
    except (FileNotFoundError, ValueError) as error:
        print(f"tca-mj eval: {error}", file=sys.stderr)
        return 2
    print(f"{report(summary)}\n\n{out / REPORT}")
    return 0


def _train(arguments: argparse.Namespace) -> int:
    try:
        import tca_mj.agents.search as searching
        import tca_mj.agents.train as training
        from tca_mj.agents.config import default_config
    except ImportError as error:
        print(f"tca-mj train: {error}; pip install 'tca-mj[rl]'", file=sys.stderr)
        return 2
    base = arguments.out or Path("runs/train") / f"{task_name(arguments.task)}-{arguments.algo}"
    several = range(arguments.seeds) if arguments.seeds else None
    command, cma = _command(arguments), arguments.algo == "cma"
    for seed in several or [arguments.seed]:
        out = base / f"seed_{seed}" if several else base
        given: dict[str, Any] = {"seed": seed, "start": arguments.start}
        for option in ("steps",) if cma else ("steps", "envs", "residual"):
            if getattr(arguments, option) is not None:
                given[option] = getattr(arguments, option)
        try:
            if cma:
                config = searching.SearchConfig(task=arguments.task, **given)
                searching.search(config, out, workers=arguments.workers, command=command)
            else:
                settings = default_config(arguments.task, arguments.algo, **given)
                training.train(settings, out, command=command, video=arguments.video)
        except (FileNotFoundError, ValueError) as error:
            print(f"tca-mj train: {error}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            print(f"interrupted; the same command goes on with {out}", file=sys.stderr)
            return 130
        print(f"  {out / ('best.json' if cma else 'best.npz')}")
    return 0


def _command(arguments: argparse.Namespace) -> str:
    """The command of a training run, to be noted."""
    import shlex

    words = ["tca-mj", "train", arguments.task, "--algo", arguments.algo]
    for option in ("steps", "envs", "residual", "start", "seeds", "seed"):
        value = getattr(arguments, option)
        if value is not None and not (option == "seed" and arguments.seeds):
            words += [f"--{option}", f"{value:g}" if isinstance(value, float) else str(value)]
    return shlex.join(words)


def _sweep(arguments: argparse.Namespace) -> int:
    from tca_mj.agents.evaluate import Evaluation
    from tca_mj.agents.sweep import PAGE, TABLE, Sweep, run_sweep

    if (arguments.policy is None) == (arguments.algo is None):
        print("tca-mj sweep: give POLICY or --algo", file=sys.stderr)
        return 2
    try:
        sweep = Sweep(
            evaluation=Evaluation(
                task=arguments.task, policy=arguments.policy or "off", episodes=arguments.episodes
            ),
            axes=dict(arguments.axes),
            algorithm=arguments.algo,
        )
        run_sweep(
            sweep, arguments.out, workers=arguments.workers, address=arguments.address
        )
    except ImportError as error:
        print(f"tca-mj sweep: {error}; pip install 'tca-mj[sweep]'", file=sys.stderr)
        return 2
    except (ConnectionError, FileNotFoundError, ValueError) as error:
        print(f"tca-mj sweep: {error}", file=sys.stderr)
        return 2
    except RuntimeError as error:
        print(f"tca-mj sweep: {error}", file=sys.stderr)
        return 1
    print((arguments.out / PAGE).read_text(encoding="utf-8"))
    print(f"{arguments.out / TABLE}\n{arguments.out / PAGE}")
    return 0

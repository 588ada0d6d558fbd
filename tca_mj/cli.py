"""The command ``tca-mj``. What its subcommands need is loaded when one of them runs."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tca_mj
from tca_mj.registry import TASKS

OBJECTS = ("screwdriver", "pcb")
DEMOS = ("pick-and-place", "tetrapod")
MODELS = ("used", "legs", "fine")
POLICIES = ("scripted", "off", "random")
ALGORITHMS = ("cma", "ppo", "sac", "td3")

_EXAMPLES = """\
examples:
  tca-mj demo pick-and-place                    the arm puts a screwdriver into a cup
  tca-mj demo pick-and-place --object pcb --seed 3 --out runs/board
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

_DEMO = """\
Runs one scripted episode, or with --policy and --task one of any policy in any task, and writes
into the folder --out:
  summary.json   success, energy, peak temperatures, duration, versions, machine
  rollout.rrd    everything over time; open it with `rerun rollout.rrd`
  rollout.mp4    a film (needs OpenGL and `pip install 'tca-mj[demo]'`)
  rollout.png    power, temperature, tension and bend (needs `pip install 'tca-mj[demo]'`)

Exit code: 0 if the demo succeeds (the object lies in the cup, the tetrapod on its target), 1 if
not, 2 if the command was wrong, 130 after Ctrl-C, which keeps what was recorded until then.

examples:
  tca-mj demo pick-and-place --object pcb
  tca-mj demo pick-and-place --seed 7 --no-video      much faster
  tca-mj demo tetrapod --randomise 0.2 --seed 3       with 20 % more or less friction
  tca-mj demo --policy scripted --task TCA/TetrapodWalk-v0
  tca-mj demo --policy runs/train/TetrapodWalk-cma/best.json --task TCA/TetrapodWalk-v0
"""

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

_VIEW = """\
Opens a window in which the task runs. Space starts and pauses, backspace begins the next episode,
= and - change the speed, ] goes to the next camera, F1 lists all keys.

Policies: scripted (the task's own), off (no power), random, the name of one that comes with the
package (`tca-mj list` shows them), or the file of a trained one.

examples:
  tca-mj view TCA/ArmPickPlace-v0
  tca-mj view TCA/ArmPickPlace-v0 --policy random --seed 1
"""

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

_TRAIN = """\
Trains a policy for a task and writes the run into the folder --out. Ctrl-C and even kill -9 lose
at most the last interval: the same command again goes on with the run. What is drawn comes from
--seed alone; with the same seed the curve is the same to the last digit, interrupted or not.

  cma    searches the figures of a tetrapod's gait (CMA-ES), from the scripted one; a gait task
         takes about 20 minutes on two cores. Episodes run in --workers processes, on whose number
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

_NO_DISPLAY = """\
tca-mj view: there is no screen to open a window on ({reason}).
Without a screen you can
  * record the task and look at the recording on any machine:
      tca-mj demo pick-and-place --out runs/demo
      rerun runs/demo/rollout.rrd
  * log in with a remote desktop, or with X forwarding (ssh -X)
  * run it on a screen that only exists in memory, for a test:
      xvfb-run -s "-screen 0 1280x960x24" tca-mj view {task}\
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
    style = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="tca-mj", description=tca_mj.__doc__.splitlines()[0], epilog=_EXAMPLES,
        formatter_class=style,
    )
    parser.add_argument("--version", action="version", version=f"tca-mj {tca_mj.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    demo = commands.add_parser(
        "demo", help="run a scripted demo and record it", description=_DEMO, formatter_class=style
    )
    demo.add_argument("name", nargs="?", choices=DEMOS, help="which demo")
    demo.add_argument("--policy", help=f"{', '.join(POLICIES)}, a shipped one, a file or a run")
    demo.add_argument(
        "--task", choices=[task.id for task in TASKS], metavar="TASK", help="the policy's task"
    )
    demo.add_argument(
        "--object", choices=OBJECTS, default="screwdriver", help="what pick-and-place picks up"
    )
    demo.add_argument(
        "--randomise", type=float, default=0.0, metavar="SHARE",
        help="share by which the robot is off (tetrapod: its friction), 0 to 0.5; default 0",
    )
    demo.add_argument("--seed", type=_seed, default=0, help="places of object and cup; default 0")
    demo.add_argument("--out", type=_folder, help="folder; default runs/demo/ and what")
    demo.add_argument(
        "--video", action=argparse.BooleanOptionalAction, default=True,
        help="make the film, which takes most of the time",
    )
    demo.set_defaults(run=_demo)

    tasks = commands.add_parser("list", help="list the tasks, with their spaces")
    tasks.set_defaults(run=_list)

    view = commands.add_parser(
        "view", help="watch a task in a window", description=_VIEW, formatter_class=style
    )
    view.add_argument("task", choices=[task.id for task in TASKS], metavar="TASK", help="its id")
    view.add_argument(
        "--policy", default="scripted", help=f"{', '.join(POLICIES)}, a shipped one or a file"
    )
    view.add_argument("--object", choices=OBJECTS, help="default: drawn at random")
    view.add_argument("--seed", type=_seed, default=0, help="seed of the first episode; default 0")
    view.set_defaults(run=_view)

    evaluation = commands.add_parser(
        "eval", help="measure how good a policy is", description=_EVAL, formatter_class=style
    )
    evaluation.add_argument("policy", metavar="POLICY", help="who acts")
    evaluation.add_argument(
        "--task", choices=[task.id for task in TASKS], metavar="TASK", required=True, help="its id"
    )
    evaluation.add_argument("--episodes", type=_count, default=10, help="default 10")
    evaluation.add_argument("--seed", type=_seed, default=0, help="of the first episode; default 0")
    evaluation.add_argument(
        "--randomise", type=float, default=0.0, metavar="SHARE",
        help="share by which the robot is drawn to be off, 0 to 0.5; default 0",
    )
    evaluation.add_argument("--steps", type=_count, help="of an episode; default: the task's")
    evaluation.add_argument(
        "--model", choices=MODELS, default="used",
        help="of the tetrapod: used, legs (finer, they twist), fine (and single spines)",
    )
    evaluation.add_argument("--timestep", type=float, help="of the physics; default: the task's")
    evaluation.add_argument("--out", type=_folder, help="folder; default runs/eval/TASK-POLICY")
    evaluation.add_argument("--workers", type=_count, default=1, help="processes; default 1")
    evaluation.add_argument("--fresh", action="store_true", help="forget what the folder holds")
    evaluation.set_defaults(run=_eval)

    train = commands.add_parser(
        "train", help="train a policy", description=_TRAIN, formatter_class=style
    )
    train.add_argument("task", choices=[task.id for task in TASKS], metavar="TASK", help="its id")
    train.add_argument("--algo", choices=ALGORITHMS, required=True, help="how")
    train.add_argument("--steps", type=_count, help="steps of the task in all; default: by task")
    some = train.add_mutually_exclusive_group()
    some.add_argument("--seed", type=_seed, default=0, help="default 0")
    some.add_argument(
        "--seeds", type=_count, metavar="K", help="runs with seeds 0 to K-1, into OUT/seed_0, ..."
    )
    train.add_argument("--out", type=_folder, help="folder; default runs/train/TASK-ALGO")
    train.add_argument("--workers", type=_count, default=2, help="processes of cma; default 2")
    train.add_argument("--envs", type=_count, help="environments of ppo, sac, td3 at a time")
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
    train.set_defaults(run=_train)

    sweep = commands.add_parser(
        "sweep", help="evaluate or train at many settings", description=_SWEEP,
        formatter_class=style,
    )
    sweep.add_argument("policy", nargs="?", metavar="POLICY", help="who acts; not with --algo")
    sweep.add_argument(
        "--task", choices=[task.id for task in TASKS], metavar="TASK", required=True, help="its id"
    )
    sweep.add_argument("--algo", choices=ALGORITHMS, help="train this way, then evaluate")
    sweep.add_argument(
        "--set", action="append", default=[], type=_axis, metavar="NAME=VALUE,...", dest="axes",
        help="values of a setting; may be given several times",
    )
    sweep.add_argument("--episodes", type=_count, default=5, help="of each evaluation; default 5")
    sweep.add_argument("--workers", type=_count, default=2, help="trials at a time; default 2")
    sweep.add_argument("--address", help="of a running Ray cluster; default: one in this machine")
    sweep.add_argument("--out", type=_folder, required=True, help="folder; seen by all machines")
    sweep.set_defaults(run=_sweep)

    bench = commands.add_parser("bench", help="measure the speed on this machine")
    bench.add_argument(
        "part", nargs="?", choices=["single", "vector"],
        help="single: TCAs, arm and recordings, a minute; vector: many tasks at once and training,"
        " some minutes; default: both",
    )
    bench.add_argument("--out", type=_folder, help="folder for the results, JSON and Markdown")
    bench.add_argument("--quick", action="store_true", help="a tenth of the measurements")
    bench.set_defaults(run=_bench)

    validate = commands.add_parser(
        "validate", help="compare the models with what is published", description=_VALIDATE,
        formatter_class=style,
    )
    validate.add_argument("subject", choices=["tca"], help="what to validate")
    validate.add_argument("--out", type=_folder, help="folder; default: write nothing")
    validate.set_defaults(run=_validate)

    certify = commands.add_parser(
        "certify", help="compare the chains with the theory of rods", description=_CERTIFY,
        formatter_class=style,
    )
    certify.add_argument("module", nargs="*", help="which modules; default: all")
    certify.add_argument("--out", type=_folder, help="folder; default: write nothing")
    certify.add_argument("--seed", type=_seed, default=0, help="of the cases; default 0")
    certify.set_defaults(run=_certify)
    return parser


def _count(text: str) -> int:
    if _seed(text) < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return int(text)


def _axis(text: str) -> tuple[str, tuple[Any, ...]]:
    name, _, values = text.partition("=")
    if not name or not values:
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE,..., got {text!r}")

    def value(part: str) -> float | int | str:
        for kind in (int, float):
            try:
                return kind(part)
            except ValueError:
                continue
        return part

    return name, tuple(value(part) for part in values.split(","))


def _seed(text: str) -> int:
    if not text.strip().lstrip("-").isdecimal():
        raise argparse.ArgumentTypeError(f"must be a whole number, got {text!r}")
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"must be at least 0, got {value}")
    return value


def _folder(text: str) -> Path:
    path = Path(text)
    there = next((p for p in (path, *path.absolute().parents) if p.exists()), path)
    if not there.is_dir():
        raise argparse.ArgumentTypeError(f"must be a folder, {there} is a file")
    if not os.access(there, os.W_OK):
        raise argparse.ArgumentTypeError(f"must be a folder to write into, {there} is not")
    return path


def _demo(arguments: argparse.Namespace) -> int:
    from tca_mj.agents.demo import pick_and_place, play, tetrapod_course

    free = arguments.policy is not None
    if free == (arguments.name is not None) or free != (arguments.task is not None):
        print("tca-mj demo: give a demo's name, or --policy and --task", file=sys.stderr)
        return 2
    course = arguments.name == "tetrapod"
    place = _short(arguments.task) if free else "tetrapod" if course else arguments.object
    out = arguments.out or Path("runs/demo") / place
    try:
        if free:
            summary = play(
                arguments.task, arguments.policy, seed=arguments.seed, out=out,
                randomise=arguments.randomise, video=arguments.video,
            )  # fmt: skip
        elif course:
            summary = tetrapod_course(
                seed=arguments.seed, out=out, randomise=arguments.randomise, video=arguments.video
            )
        else:
            summary = pick_and_place(
                object=arguments.object, seed=arguments.seed, out=out, video=arguments.video
            )
    except KeyboardInterrupt:
        print(f"interrupted; what was recorded is in {out}", file=sys.stderr)
        return 130
    except (FileNotFoundError, ValueError) as error:
        print(f"tca-mj demo: {error}", file=sys.stderr)
        return 2
    if course:
        print(speed_table(summary))
    print(outcome(summary))
    for name in ["summary.json", *summary["files"]]:
        print(f"  {out / name}")
    return 0 if summary["success"] else 1


def outcome(summary: dict[str, Any]) -> str:
    """One line on how a demo ended, from its summary."""
    if "policy" in summary:
        where = "has success" if summary["success"] else "has come to its end"
        who = f"{summary['policy']} in {summary['task']}"
        energy = sum(summary["energy"].values()) + sum(summary["heater_energy"].values())
    elif "object" in summary:
        where = "is in the cup" if summary["success"] else "is not in the cup"
        who, energy = f"the {summary['object']}", sum(summary["energy"].values())
    else:
        where = "lies on its target" if summary["success"] else "is not on its target"
        who = "the tetrapod"
        energy = sum(summary["energy"].values()) + sum(summary["heater_energy"].values())
    return (
        f"{who} {where} ({summary['ending']}) after {summary['duration']:.1f} s,"
        f" {energy:.0f} J, at most {max(summary['peak_temperature'].values()):.0f} °C;"
        f" simulated at {summary['real_time_factor']:.1f} times real time"
    )


def speed_table(summary: dict[str, Any]) -> str:
    """Headway of the course's stages against what is published, as Markdown."""
    lines = ["| stage | time | distance | speed | published |", "|---|---|---|---|---|"]
    for phase, row in zip(summary["phases"], summary["speeds"], strict=True):
        published = "" if row["published"] is None else f"{1e3 * row['published']:.2f} mm/s"
        lines.append(
            f"| {row['name']} | {phase['duration']:.0f} s | {1e3 * row['distance']:.0f} mm |"
            f" {1e3 * row['speed']:.2f} mm/s | {published} |"
        )
    return "\n".join(lines)


def _list(arguments: argparse.Namespace) -> int:
    import gymnasium

    from tca_mj.agents.policy import SavedPolicy, shipped

    policies = {name: SavedPolicy.read(path) for name, path in shipped().items()}
    for task in TASKS:
        env = gymnasium.make(task.id, disable_env_checker=True)
        about = (type(env.unwrapped).__doc__ or "").strip().partition("\n")[0]
        print(task.id)
        print(f"    {about}")
        print(f"    action {env.action_space.shape}, observation {env.observation_space.shape}")
        for name, policy in policies.items():
            if policy.task == task.id:
                print(f"    policy {name}: {policy.kind} by {policy.origin.algorithm}")
        env.close()
    return 0


def _view(arguments: argparse.Namespace) -> int:
    from tca_mj.envs.viewer import NoDisplay, launch, need_display

    try:
        need_display()
    except NoDisplay as error:
        print(_NO_DISPLAY.format(reason=error, task=arguments.task), file=sys.stderr)
        return 2
    import gymnasium

    env = gymnasium.make(arguments.task)
    try:
        policy = _policy(arguments.policy, env, arguments.seed)
    except (FileNotFoundError, ValueError) as error:
        print(f"tca-mj view: {error}", file=sys.stderr)
        return 2
    options = {"object": arguments.object} if arguments.object else None
    print("space starts and pauses, backspace begins the next episode, F1 lists all keys")
    launch(env, policy, seed=arguments.seed, options=options, title=arguments.task)
    return 0


def _policy(name: str, env: Any, seed: int) -> Any:
    """A policy for the viewer."""
    from tca_mj.agents.actors import actor
    from tca_mj.envs.viewer import ViewerPolicy

    found = actor(name, env, seed=seed)
    return ViewerPolicy(found.act, found.reset)


def _short(task: str) -> str:
    """Name of a task's folder."""
    return task.partition("/")[2].partition("-")[0]


def _eval(arguments: argparse.Namespace) -> int:
    from tca_mj.agents.evaluate import REPORT, Evaluation, evaluate, report

    name = f"{_short(arguments.task)}-{Path(arguments.policy).stem}"
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
    name = arguments.task.partition("/")[2].partition("-")[0]
    base = arguments.out or Path("runs/train") / f"{name}-{arguments.algo}"
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


if __name__ == "__main__":
    sys.exit(main())

"""To look at: ``demo`` records, ``export`` rewrites, ``list`` names and ``view`` shows tasks."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from tca_mj.cli.arguments import (
    POLICIES,
    Commands,
    add,
    add_command,
    add_how_made,
    how_made,
    parse_option,
    task_name,
)
from tca_mj.pages import table
from tca_mj.registry import DEMOS, TASKS, find_task, make, task_class

_NO_DISPLAY = """\
tca-mj view: there is no screen to open a window on ({reason}).
Without a screen you can
  * record the task and look at the recording on any machine:
      tca-mj demo --policy scripted --task {task} --out runs/demo
      rerun runs/demo/rollout.rrd
  * log in with a remote desktop, or with X forwarding (ssh -X)
  * run it on a screen that only exists in memory, for a test:
      xvfb-run -s "-screen 0 1280x960x24" tca-mj view {task}\
"""


def add_commands(commands: Commands) -> None:
    """Adds demo, export, list and view."""
    demo = add_command(commands, "demo", _demo, help="run a demo and record it")
    add(demo, "name", f"which demo: {', '.join(DEMOS)}", nargs="?", choices=list(DEMOS),
        metavar="NAME")  # fmt: skip
    add(demo, "--policy", f"{', '.join(POLICIES)}, a shipped one, a file or a run")
    add(demo, "--task", "the policy's task")
    add(demo, "--out", "folder; default runs/demo/TASK")
    add(demo, "--video", "make the film, which takes most of the time",
        action=argparse.BooleanOptionalAction, default=True)  # fmt: skip

    export = add_command(
        commands, "export", _export, help="write a recording as a table, a policy as ONNX",
        extra="onnx",
    )  # fmt: skip
    add(export, "source", "a recording (.rrd), or with --onnx or --npz a policy: its file or name",
        metavar="FILE")  # fmt: skip
    into = export.add_mutually_exclusive_group()
    add(into, "--csv", "table to write; default: beside the recording", type=Path)
    add(into, "--onnx", "network to write, for other runtimes", type=Path)
    add(into, "--npz", "policy to write, which says what its task is made with", type=Path)
    add(export, "--task", "what a .zip was trained in")

    tasks = add_command(commands, "list", _list, help="list the tasks, with their spaces")
    add(tasks, "task", "only these, or module:id", nargs="*")

    view = add_command(commands, "view", _view, help="watch a task in a window")
    add(view, "task", "its id")
    add(view, "--policy", f"{', '.join(POLICIES)}, a shipped one, a file or a run",
        default="scripted")  # fmt: skip
    for parser in (demo, view, export):
        add_how_made(parser)
    for parser in (demo, view):
        add(parser, "--seed", "of the first episode; default 0")
        add(parser, "--option", "an option of the task's reset; may be given several times",
            action="append", default=[], type=parse_option, metavar="NAME=VALUE",
            dest="options")  # fmt: skip


def _demo(arguments: argparse.Namespace) -> int:
    """Runs one episode that is worth seeing, or with --policy and --task one of any policy in any
    task, and writes into the folder --out:
      summary.json   success, energy, peak temperatures, duration, versions, machine
      rollout.rrd    everything over time; open it with `rerun rollout.rrd`
      rollout.mp4    a film (needs OpenGL and the extra demo)
      rollout.html   the same to be turned and replayed in any browser
      rollout.png    power, temperature, tension, bend (needs the extra demo)

    Exit code: 0 if the episode is a success (a gait: it came to the end of its time), 1 if not, 2
    if the command was wrong, 130 after Ctrl-C, which keeps what was recorded until then.

    examples:
      tca-mj demo {demo} --seed 7 --no-video      much faster
      tca-mj demo --policy scripted --task {task} --option NAME=VALUE
      tca-mj demo --policy runs/train/FOLDER --task my_robots:Mine/Reach-v0
      tca-mj demo --policy walk.zip --task {task} --control-period 0.5
    """
    from tca_mj.agents.demo import play

    named = arguments.name is not None
    if named == (arguments.policy is not None) or named == (arguments.task is not None):
        raise ValueError("give a demo's name, or --policy and --task")
    demo = DEMOS[arguments.name] if named else None
    task, policy = (demo.task, demo.policy) if demo else (arguments.task, arguments.policy)
    how = how_made(arguments)
    if demo:
        how["arguments"] = {**demo.arguments, **how["arguments"]}
    out = arguments.out or Path("runs/demo") / (arguments.name or task_name(task))
    arguments.kept.append(f"what was recorded is in {out}")
    summary = play(
        task, policy, seed=arguments.seed, out=out, options=dict(arguments.options),
        video=arguments.video, **how,
    )  # fmt: skip
    if len(summary.get("speeds", ())) > 1:
        print(speed_table(summary))
    print(outcome(summary))
    for name in ["summary.json", *summary["files"]]:
        print(f"  {out / name}")
    return 0 if summary["success"] else 1


def outcome(summary: dict[str, Any]) -> str:
    """One line on how a demo ended.

    Args:
        summary: What ``tca_mj.agents.play`` returns.
    """
    energy = sum(summary["energy"].values()) + sum(summary["heater_energy"].values())
    return (
        f"{summary['policy']} in {summary['task']}: {summary['ending']} after"
        f" {summary['duration']:.1f} s, {energy:.0f} J,"
        f" at most {max(summary['peak_temperature'].values()):.0f} °C;"
        f" simulated at {summary['real_time_factor']:.1f} times real time"
    )


def speed_table(summary: dict[str, Any]) -> str:
    """Headway of a demo's phases against what is published, as Markdown.

    Args:
        summary: What ``tca_mj.agents.play`` returns of a robot that gets on.
    """
    rows = [
        [row["name"], f"{phase['duration']:.0f} s", f"{1e3 * row['distance']:.0f} mm",
         *("" if speed is None else f"{1e3 * speed:.2f} mm/s"
           for speed in (row["speed"], row["published"]))]
        for phase, row in zip(summary["phases"], summary["speeds"], strict=True)
    ]  # fmt: skip
    return "\n".join(table(["stage", "time", "distance", "speed", "published"], rows))


def _export(arguments: argparse.Namespace) -> int:
    """Writes the curves of a recording as one table: a row for every time, a column with its unit
    for every curve. In Python, `tca_mj.record.read` gives the same as arrays.

    With --onnx, writes the network of a policy for other runtimes: `observation`, float32 of shape
    (batch, n) in the units of the task, becomes `action`; normalisation is part of it. Needs the
    extra onnx. With --npz, writes a model of Stable-Baselines3 as a policy of this package, which
    then says itself what is said of it here.

    examples:
      tca-mj export runs/demo/{demo}/rollout.rrd
      tca-mj export rollout.rrd --csv curves.csv
      tca-mj export walk.zip --task {task} --control-period 0.5 --npz walk.npz
      tca-mj export walk.npz --onnx walk.onnx
    """
    if arguments.onnx or arguments.npz:
        from tca_mj.agents.policies import saved_policy

        policy = saved_policy(arguments.source, arguments.task, **how_made(arguments))
        print(policy.to_onnx(arguments.onnx) if arguments.onnx else policy.save(arguments.npz))
        return 0
    from tca_mj.record.reader import read, write_csv

    path = arguments.csv or Path(arguments.source).with_suffix(".csv")
    recording = read(arguments.source)
    write_csv(recording, path)
    print(f"{path}: {len(recording.curves)} curves")
    return 0


def _list(arguments: argparse.Namespace) -> int:
    from tca_mj.agents.policies import SavedPolicy, shipped

    policies = {name: SavedPolicy.read(path) for name, path in shipped().items()}
    for task in arguments.task or [task.id for task in TASKS]:
        env = make(task, disable_env_checker=True)
        about = (type(env.unwrapped).__doc__ or "").strip().partition("\n")[0]
        print(task)
        print(f"    {about}")
        print(f"    action {env.action_space.shape}, observation {env.observation_space.shape}")
        print(f"    options {', '.join(env.unwrapped.options.names)}")
        if task_class(task).finer:
            print(f"    finer models {', '.join(task_class(task).finer)}")
        demos = [demo.name for demo in DEMOS.values() if demo.task == find_task(task).id]
        if demos:
            print(f"    demo {', '.join(demos)}")
        for name, policy in policies.items():
            if policy.task == find_task(task).id:
                print(f"    policy {name}: {policy.kind} by {policy.origin.algorithm}")
        env.close()
    return 0


def _view(arguments: argparse.Namespace) -> int:
    """Opens a window in which the task runs. Space starts and pauses, backspace begins the next
    episode, = and - change the speed, ] goes to the next camera, F1 lists all keys.

    Policies: scripted (the task's own), off (no power), random, the name of one that comes with the
    package (`tca-mj list` shows them), the file of a trained one, or a model that Stable-Baselines3
    or sb3-contrib has saved (.zip).

    examples:
      tca-mj view {task}
      tca-mj view {task} --policy random --seed 1
      tca-mj view {task} --policy walk.zip --control-period 0.5
    """
    from tca_mj.envs.viewer import NoDisplay, ViewerPolicy, launch, need_display

    try:
        need_display()
    except NoDisplay as error:
        print(_NO_DISPLAY.format(reason=error, task=arguments.task), file=sys.stderr)
        return 2
    from tca_mj.agents.policies.actors import actor, arguments_of

    how, policy = how_made(arguments), arguments.policy
    env = make(arguments.task, **arguments_of(policy, arguments.task) | how["arguments"])
    found = actor(policy, env, seed=arguments.seed, preprocessing=how["preprocessing"])
    print("space starts and pauses, backspace begins the next episode, F1 lists all keys")
    launch(env, ViewerPolicy(found.act, found.reset), seed=arguments.seed,
           options=dict(arguments.options) or None, title=arguments.task)  # fmt: skip
    return 0

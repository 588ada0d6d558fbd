"""To look at: ``demo`` records an episode, ``list`` names the tasks, ``view`` opens a window."""

import argparse
import sys
from pathlib import Path
from typing import Any

from tca_mj.cli.arguments import (
    DEMOS,
    OBJECTS,
    POLICIES,
    TASK_IDS,
    Commands,
    add_command,
    parse_folder,
    parse_seed,
    task_name,
)
from tca_mj.registry import TASKS

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

_VIEW = """\
Opens a window in which the task runs. Space starts and pauses, backspace begins the next episode,
= and - change the speed, ] goes to the next camera, F1 lists all keys.

Policies: scripted (the task's own), off (no power), random, the name of one that comes with the
package (`tca-mj list` shows them), or the file of a trained one.

examples:
  tca-mj view TCA/ArmPickPlace-v0
  tca-mj view TCA/ArmPickPlace-v0 --policy random --seed 1
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


def add_commands(commands: Commands) -> None:
    """Adds demo, list and view."""
    demo = add_command(
        commands, "demo", _demo, help="run a scripted demo and record it", text=_DEMO
    )
    demo.add_argument("name", nargs="?", choices=DEMOS, help="which demo")
    demo.add_argument("--policy", help=f"{', '.join(POLICIES)}, a shipped one, a file or a run")
    demo.add_argument("--task", choices=TASK_IDS, metavar="TASK", help="the policy's task")
    demo.add_argument(
        "--object", choices=OBJECTS, default="screwdriver", help="what pick-and-place picks up"
    )
    demo.add_argument(
        "--randomise", type=float, default=0.0, metavar="SHARE",
        help="share by which the robot is off (tetrapod: its friction), 0 to 0.5; default 0",
    )
    demo.add_argument(
        "--seed", type=parse_seed, default=0, help="places of object and cup; default 0"
    )
    demo.add_argument("--out", type=parse_folder, help="folder; default runs/demo/ and what")
    demo.add_argument(
        "--video", action=argparse.BooleanOptionalAction, default=True,
        help="make the film, which takes most of the time",
    )

    add_command(commands, "list", _list, help="list the tasks, with their spaces")

    view = add_command(commands, "view", _view, help="watch a task in a window", text=_VIEW)
    view.add_argument("task", choices=TASK_IDS, metavar="TASK", help="its id")
    view.add_argument(
        "--policy", default="scripted", help=f"{', '.join(POLICIES)}, a shipped one or a file"
    )
    view.add_argument("--object", choices=OBJECTS, help="default: drawn at random")
    view.add_argument(
        "--seed", type=parse_seed, default=0, help="seed of the first episode; default 0"
    )


def _demo(arguments: argparse.Namespace) -> int:
    from tca_mj.agents.demo import pick_and_place, play, tetrapod_course

    free = arguments.policy is not None
    if free == (arguments.name is not None) or free != (arguments.task is not None):
        print("tca-mj demo: give a demo's name, or --policy and --task", file=sys.stderr)
        return 2
    course = arguments.name == "tetrapod"
    place = task_name(arguments.task) if free else "tetrapod" if course else arguments.object
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

"""Draws docs/pictures/film_<Task>.webp: an episode of each task, by its best policy that is here.

    MUJOCO_GL=egl python scripts/task_films.py               all of them
    MUJOCO_GL=egl python scripts/task_films.py TCA/Jump-v0   one of them

The pages of tasks in the reference show them. The scripted policy acts, or the shipped one that is
named below.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tca_mj.agents.policies import actor, arguments_of
from tca_mj.agents.rollout import rollout
from tca_mj.record.film import clock
from tca_mj.record.render import Offscreen
from tca_mj.registry import TASKS, make, task_class

SIZE = (384, 288)  # of a picture [pixels]
COUNT, SHOWN = 36, 0.18  # pictures, and for how long each [s]
LONGEST = 40.0  # of an episode that does not end before [s]
COURSE = "TCA/TetrapodCourse-v0"  # is shown to its end, with three times as many pictures
# Whom to watch; others are scripted.
ACTORS = {
    "TCA/BendReach-v0": "bend-reach", "TCA/TetrapodCrawl-v0": "tetrapod-crawl-sac",
    "TCA/TetrapodWalk-v0": "tetrapod-walk-sac", "TCA/TetrapodShimmy-v0": "tetrapod-shimmy-sac",
    "TCA/TetrapodShapes-v0": "tetrapod-shapes",
    COURSE: "tca_mj.agents.scripts.course_quick:shapes",
}  # fmt: skip


def film(id: str) -> tuple[list[Image.Image], float]:
    """Pictures of an episode, evenly over it, and how much faster than life they are.

    Args:
        id: The task.
    """
    name = ACTORS.get(id, "scripted")
    arguments: dict[str, Any] = arguments_of(name, id)
    env = make(id, disable_env_checker=True, **arguments)
    task: Any = env.unwrapped
    most = np.inf if id == COURSE else round(LONGEST / task.control_period)
    count = 3 * COUNT if id == COURSE else COUNT
    policy = actor(name, env, seed=0)
    steps = 0  # once without pictures: how long it is
    for _ in rollout(env, policy, seed=0):
        steps += 1
        if steps > most and task_class(id).legs:
            break
    wanted = set(np.linspace(0, steps - 1, count).round().astype(int))
    fast = float(f"{(steps - 1) * task.control_period / (len(wanted) * SHOWN):.2g}")
    pictures = []
    with Offscreen(task.model, width=SIZE[0], height=SIZE[1], camera=task.camera,
                   coils=task.sim.tendon) as screen:  # fmt: skip
        for i, _ in enumerate(rollout(env, policy, seed=0)):
            if i in wanted:
                task.paint()
                shown = clock((i + 1) * task.control_period, fast)
                pictures.append(Image.fromarray(screen.draw(task.data, shown)))
            if i >= steps - 1:
                break
    env.close()
    return pictures, fast


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("tasks", nargs="*", help="ids; without any, all")
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    asked = parser.parse_args()
    for id in asked.tasks or [task.id for task in TASKS]:
        pictures, fast = film(id)
        path = asked.out / f"film_{id.partition('/')[2].partition('-')[0]}.webp"
        pictures[0].save(
            path, save_all=True, append_images=pictures[1:], duration=round(1e3 * SHOWN), loop=0,
            quality=55, method=6,
        )  # fmt: skip
        print(f"{path}: {path.stat().st_size >> 10} KiB, {fast:.2g} times real time", flush=True)


if __name__ == "__main__":
    main()

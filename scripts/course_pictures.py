"""Draws the tetrapod's three shapes side by side, and the course in a strip of pictures.

python scripts/course_pictures.py --out docs/pictures            # both, some minutes
python scripts/course_pictures.py --shapes-only
"""

import argparse
from pathlib import Path

import imageio.v3 as imageio
import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.scripts.course import CourseWalker
from tca_mj.agents.scripts.tetrapod import gait_policy
from tca_mj.envs.course import TetrapodCourse
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.record.render import Offscreen, colour_tendons
from tca_mj.sim import Simulation

# Time at which a gait is seen [s], distance of the camera, height of what it looks at over the
# middle of the robot [m].
SHAPES = {"crawl": (5.0, 0.42, 0.03), "walk": (4.5, 0.42, -0.03), "shimmy": (8.5, 0.36, -0.05)}
# Time after the start of each stage at which its picture is taken [s].
MOMENTS = {"crawl": 50.0, "stand up": 14.0, "walk": 12.0, "mount": 20.0, "clamp": 45.0,
           "shimmy": 45.0, "open": 100.0, "walk on": 25.0}  # fmt: skip
LAST = "lie down"  # its picture is the last of all


def view(model: mujoco.MjModel, x: float, distance: float, azimuth: float, elevation: float,
         height: float = 0.03) -> mujoco.MjvCamera:  # fmt: skip
    """A camera that looks at the place ``x`` along the course."""
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, camera)
    camera.lookat[:] = [x, 0.0, height]
    camera.distance, camera.azimuth, camera.elevation = distance, azimuth, elevation
    return camera


def picture(sim: Simulation, camera: mujoco.MjvCamera, size: tuple[int, int]) -> NDArray[np.uint8]:
    """One picture, TCAs in the colours of their temperatures."""
    colour_tendons(sim.model, sim.tendon, sim.temperature)
    with Offscreen(
        sim.model, width=size[0], height=size[1], camera=camera, coils=sim.tendon
    ) as screen:
        return screen.draw(sim.data)


def shapes(out: Path) -> None:
    """Crawling, walking and clamping a beam, as in the tasks of single gaits."""
    frames = []
    for gait, (seconds, distance, up) in SHAPES.items():
        env, policy = TetrapodGait(gait=gait, action="power"), gait_policy(gait)
        observation, _ = env.reset(seed=0)
        for _ in range(round(seconds / env.control_period)):
            observation, *_ = env.step(policy.act(observation))
        x, _, z = env.stance.position(env.data)
        camera = view(env.model, float(x), distance, 152.0, -14.0, float(z) + up)
        frames.append(picture(env.sim, camera, (560, 480)))
    imageio.imwrite(out / "tetrapod.png", np.concatenate(frames, axis=1))


def close(env: TetrapodCourse) -> NDArray[np.uint8]:
    """A picture of the robot where it is."""
    x, _, z = env.position
    camera = view(env.model, float(x) + 0.02, 0.5, 118.0, -14.0, float(z) - 0.03)
    return picture(env.sim, camera, (480, 360))


def course(out: Path, seed: int) -> None:
    """A picture of each stage."""
    env = TetrapodCourse(action="power")
    observation, _ = env.reset(seed=seed)
    walker, frames, since, stage = CourseWalker(env), {}, 0.0, ""
    ended = False
    while not ended:
        action = walker.act(observation)
        since = since + env.control_period if walker.phase == stage else 0.0
        stage = walker.phase
        if stage not in frames and since >= MOMENTS.get(stage, np.inf):
            frames[stage] = close(env)
            print(f"{env.sim.time:6.1f} s  {stage}", flush=True)
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
    frames[LAST] = close(env)
    missing = [stage for stage in MOMENTS if stage not in frames]
    if missing or not info["success"]:
        raise SystemExit(f"no picture of {missing}, success {info['success']}")
    order = [frames[stage] for stage in (*MOMENTS, LAST)]
    rows = [np.concatenate(order[i : i + 3], axis=1) for i in (0, 3, 6)]
    imageio.imwrite(out / "course.jpg", np.concatenate(rows), quality=85)


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shapes-only", action="store_true")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    shapes(args.out)
    if not args.shapes_only:
        course(args.out, args.seed)
    print(f"the pictures are in {args.out}")


if __name__ == "__main__":
    main()

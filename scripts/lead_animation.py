"""Draws docs/pictures/tetrapod.webp: the tetrapod crawls, walks and shimmies, by learned gaits.

    MUJOCO_GL=egl python scripts/lead_animation.py
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tca_mj.agents.policies import load_policy
from tca_mj.record.film import clock
from tca_mj.record.render import Offscreen
from tca_mj.registry import make

# By task: who drives it, and from how far the camera looks at the robot, and how much above it [m].
SHOWN = {
    "TCA/TetrapodCrawl-v0": ("tetrapod-crawl-sac", 0.34, -0.02),
    "TCA/TetrapodWalk-v0": ("tetrapod-walk-sac", 0.31, -0.03),
    "TCA/TetrapodShimmy-v0": ("tetrapod-shimmy-sac", 0.29, -0.04),
}
WARM, SHOWN_FOR = 12.0, 24.0  # until a gait is steady, and what is shown of it [s]
HELD = 0.4  # of the learned gaits; a picture at the end of each decision [s]
SPEED = 4  # simulated seconds per second
SIZE = (400, 340)  # of each picture [pixels]


def frames(task: str, policy: str, distance: float, up: float) -> list[NDArray[np.uint8]]:
    """Pictures of a gait, by a camera that goes along."""
    env = make(task, control_period=HELD, disable_env_checker=True)
    own, actor, shown = env.unwrapped, load_policy(policy, env), []
    observation, info = env.reset(seed=0)
    camera = mujoco.MjvCamera()
    camera.distance, camera.azimuth, camera.elevation = distance, 142.0, -22.0
    start = None
    with Offscreen(
        own.model, width=SIZE[0], height=SIZE[1], camera=camera, coils=own.sim.tendon
    ) as screen:
        while info["time"] < WARM + SHOWN_FOR - 1e-6:
            observation, *_, info = env.step(actor.act(observation))
            if info["time"] < WARM - 1e-6:
                continue
            x, y, z = own.stance.position(own.data)
            start = start or (float(x), float(z), info["time"])
            gone, since = float(x) - start[0], info["time"] - start[2]
            speed = f", {1e3 * gone / since:.1f} mm/s" if since > 4.0 else ""
            camera.lookat[:] = [x, y, start[1] + up]
            own.paint()
            name = task.partition("Tetrapod")[2].partition("-")[0].lower()
            shown.append(screen.draw(own.data, f"{name}{speed}\n{clock(info['time'], SPEED)}"))
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    out = parser.parse_args().out / "tetrapod.webp"
    films = [frames(task, *how) for task, how in SHOWN.items()]
    pictures = [Image.fromarray(np.concatenate(row, axis=1)) for row in zip(*films, strict=True)]
    pictures[0].save(
        out, save_all=True, append_images=pictures[1:], duration=round(1e3 * HELD / SPEED),
        loop=0, quality=60, method=6,
    )  # fmt: skip
    print(f"{out}: {len(pictures)} pictures, {out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()

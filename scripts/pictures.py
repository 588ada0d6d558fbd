"""Draws the pictures of the documentation: the arm holding an object, and its phases in a strip.

    python scripts/pictures.py --out docs/pictures
"""

import argparse
from pathlib import Path

import imageio.v3 as imageio
import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.scripts.arm import PHASES, PickAndPlace
from tca_mj.envs.arm import ArmPickPlace
from tca_mj.record.render import Offscreen, colour_tendons

# Time after the start of each phase at which its picture is taken [s].
MOMENTS = {"align": 0.5, "open": 0.8, "lower": 0.5, "pinch": 0.4, "lift": 0.3, "turn back": 0.0,
           "bend": 1.2, "release": 1.0}  # fmt: skip
HERO = ("bend", 1.5)


def view(distance: float, azimuth: float, height: float, elevation: float) -> mujoco.MjvCamera:
    """A camera that looks at the arm."""
    camera = mujoco.MjvCamera()
    camera.lookat[:] = [-0.012, 0.0, height]
    camera.distance, camera.azimuth, camera.elevation = distance, azimuth, elevation
    return camera


def draw(env: ArmPickPlace, camera: mujoco.MjvCamera, width: int, height: int) -> NDArray[np.uint8]:
    """One picture, TCAs in the colours of their temperatures."""
    colour_tendons(env.model, env.sim.tendon, env.sim.temperature)
    with Offscreen(
        env.model, width=width, height=height, camera=camera, coils=env.sim.tendon
    ) as screen:
        return screen.draw(env.data)


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--object", default="screwdriver")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)

    env, policy = ArmPickPlace(action="power"), PickAndPlace()
    observation, _ = env.reset(seed=args.seed, options={"object": args.object})
    frames: dict[str, NDArray[np.uint8]] = {}
    ended = False
    while not ended and policy.phase != "done":
        action = policy.act(observation)
        phase = policy.phase
        if phase not in frames and policy.since >= MOMENTS.get(phase, np.inf):
            frames[phase] = draw(env, view(0.215, 108.0, 0.075, -10.0), 400, 480)
        if (phase, round(policy.since, 1)) == HERO:
            # From where the screwdriver, which the wrist keeps turned, is seen from its side.
            hero = draw(env, view(0.15, 14.0, 0.05, -12.0), 1280, 960)
            imageio.imwrite(args.out / "arm.png", hero)
        observation, _, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
    missing = [phase for phase in PHASES if phase in MOMENTS and phase not in frames]
    if missing:
        raise SystemExit(f"no picture of {missing}: they were shorter than their moment")
    rows = [np.concatenate([frames[p] for p in PHASES[i : i + 4]], axis=1) for i in (0, 4)]
    imageio.imwrite(args.out / "phases.jpg", np.concatenate(rows), quality=85)
    print(f"arm.png and phases.jpg are in {args.out}")


if __name__ == "__main__":
    main()

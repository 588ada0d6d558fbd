"""Static scenes: an arena from a file, with objects from files put into it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco

from tca_mj.assets import mjcf
from tca_mj.checks import door
from tca_mj.model.chain import Place
from tca_mj.model.part import Part, set_options


@door
def load(path: str | Path) -> mujoco.MjSpec:
    """Reads an MJCF file into a specification.

    Args:
        path: The file.

    Raises:
        ValueError: If the file does not exist or is no MJCF.
    """
    if not Path(path).is_file():
        raise ValueError(f"path must be an MJCF file, got {path}")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise ValueError(f"path must be an MJCF file, got {path}: {error}") from error


@door
def scene(
    arena: str | Path, robot: Part, objects: Mapping[str, str | Path], *, name: str = "robot",
    pos: Place = (0.0, 0.0, 0.0),
) -> Part:  # fmt: skip
    """Puts a robot and objects into an arena.

    The robot's names get ``name`` and a dot in front, an object's names its key and a dot.

    Args:
        arena: MJCF file of the arena; its visual settings become the scene's.
        robot: The robot; it is used up. Its integrator becomes the scene's.
        objects: MJCF files of the objects, by the name that each gets in the scene. Each file's
            bodies are put into the world where the file says.
        name: Name of the robot in the scene.
        pos: Where its base is [m].

    Returns:
        The scene as a part, whose TCAs and named sites are the robot's.
    """
    spec = load(arena)
    set_options(spec)
    spec.option.integrator = robot.spec.option.integrator
    origin = spec.worldbody.add_site(name="origin", group=4)
    part = Part(spec)
    place = "place" if any(pos) else "origin"
    if any(pos):
        spec.worldbody.add_site(name=place, pos=list(pos), group=4)
    part.attach(robot, to=place, prefix=name)
    for key, path in objects.items():
        spec.attach(load(path), site=origin, prefix=f"{key}.")
    return part


@door
def in_arena(robot: Part, *, pos: Place = (0.0, 0.0, 0.1), name: str = "robot") -> Part:
    """Puts a robot into the arena that comes with the package: a table, a light and cameras.

    The table is at z = 0. The cameras ``front`` and ``side`` see what is within 6 cm of its middle,
    and up to 14 cm above it.

    Args:
        robot: The robot, whose base is held; it is used up.
        pos: Where its base is [m].
        name: Its name; its names get that and a dot in front.

    Returns:
        The scene as a part.
    """
    return scene(mjcf("arena.xml"), robot, {}, name=name, pos=pos)

"""Static scenes: an arena from a file, with objects from files put into it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco

from tca_mj.checks import door
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
    arena: str | Path, robot: Part, objects: Mapping[str, str | Path], *, name: str = "robot"
) -> Part:
    """Puts a robot and objects into an arena.

    The robot's names get ``name`` and a dot in front, an object's names its key and a dot.

    Args:
        arena: MJCF file of the arena; its visual settings become the scene's.
        robot: The robot; it is used up.
        objects: MJCF files of the objects, by the name that each gets in the scene. Each file's
            bodies are put into the world where the file says.
        name: Name of the robot in the scene.

    Returns:
        The scene as a part, whose TCAs and named sites are the robot's.
    """
    spec = load(arena)
    set_options(spec)
    origin = spec.worldbody.add_site(name="origin", group=4)
    part = Part(spec)
    part.attach(robot, to="origin", prefix=name)
    for key, path in objects.items():
        spec.attach(load(path), site=origin, prefix=f"{key}.")
    return part

"""Robots by single figures of their design: a path such as ``leg.rod_diameter`` and its value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from tca_mj.checks import door, number, shown, whole
from tca_mj.hints import nearest
from tca_mj.registry import task_class
from tca_mj.tca import TcaSpec, find_tca


@door
def robot_of(task: str, design: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a task's class that make its robot differ from the default.

    Args:
        task: Gymnasium id.
        design: Values by path. A TCA (``leg.tca``) takes the name of a catalogue's entry or a file;
            its ``pitch_angle`` [rad] changes the coil at the same thread (``TcaSpec.of_pitch``).

    Raises:
        ValueError: If the task has no such robot, there is no such figure, or the value cannot be.
    """
    robot = task_class(task).robot_argument
    if robot is None:
        raise ValueError(f"design must be empty for {task}, got {shown(design)}")
    argument, default = robot
    return {argument: designed(default(), design)}


@door
def designed(spec: Any, design: Mapping[str, Any]) -> Any:
    """A specification with other figures.

    Args:
        spec: The specification, which stays as it is.
        design: Values by path, such as ``leg.rod_diameter``.

    Raises:
        ValueError: If it is no specification, or as ``robot_of``.
    """
    if not is_dataclass(spec) or isinstance(spec, type):
        raise ValueError(f"spec must be a specification, got {shown(spec)}")
    # Whole TCAs first, then what is changed in them.
    for path in sorted(design, key=lambda path: path.count(".")):
        spec = _changed(spec, path, f"design {path!r}", design[path])
    return spec


def _changed(spec: Any, path: str, design: str, value: Any) -> Any:
    name, _, rest = path.partition(".")
    known = [field.name for field in fields(spec)] if is_dataclass(spec) else []
    if name not in known:
        raise ValueError(
            f"{design}: the name must be one of {known}, got {shown(name)}{nearest(name, known)}"
        )
    now = getattr(spec, name)
    if rest:
        return replace(spec, **{name: _changed(now, rest, design, value)})
    if isinstance(now, TcaSpec):
        try:
            return replace(spec, **{name: find_tca(value)})
        except (OSError, ValueError) as error:
            raise ValueError(f"{design}: {error}") from error
    if isinstance(now, float):
        value = number(design, value)
    elif isinstance(now, int) and not isinstance(now, bool):
        value = whole(design, value)
    if isinstance(spec, TcaSpec) and name == "pitch_angle":
        return spec.of_pitch(value)
    return replace(spec, **{name: value})

"""Robots by single figures of their design: a path such as ``leg.rod_diameter`` and its value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from tca_mj.hints import nearest
from tca_mj.registry import task_class
from tca_mj.tca import CATALOGUE, TcaSpec


def robot_of(task: str, design: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a task's class that make its robot differ from the default.

    Args:
        task: Gymnasium id.
        design: Values by path. A TCA (``leg.tca``) takes the name of a catalogue's entry; its
            ``pitch_angle`` [rad] changes the coil at the same thread (``TcaSpec.of_pitch``).

    Raises:
        ValueError: If the task has no such robot, there is no such figure, or the value cannot be.
    """
    robot = task_class(task).robot_argument
    if robot is None:
        raise ValueError(f"design must be empty for {task}, got {sorted(design)}")
    argument, default = robot
    return {argument: designed(default(), design)}


def designed(spec: Any, design: Mapping[str, Any]) -> Any:
    """A specification with other figures; errors as ``robot_of``.

    Args:
        spec: The specification, which stays as it is.
        design: Values by path, such as ``leg.rod_diameter``.
    """
    # Whole TCAs first, then what is changed in them.
    for path in sorted(design, key=lambda path: path.count(".")):
        spec = _changed(spec, path, path, design[path])
    return spec


def _changed(spec: Any, path: str, whole: str, value: Any) -> Any:
    name, _, rest = path.partition(".")
    known = [field.name for field in fields(spec)] if is_dataclass(spec) else []
    if name not in known:
        raise ValueError(
            f"design {whole!r}: {name!r} must be one of {known}{nearest(name, known)}"
        )
    now = getattr(spec, name)
    if rest:
        return replace(spec, **{name: _changed(now, rest, whole, value)})
    if isinstance(now, TcaSpec):
        if value not in CATALOGUE:
            raise ValueError(
                f"design {whole!r} must be one of {list(CATALOGUE)}, got {value!r}"
                f"{nearest(value, CATALOGUE)}"
            )
        return replace(spec, **{name: CATALOGUE[value]})
    if isinstance(spec, TcaSpec) and name == "pitch_angle":
        return spec.of_pitch(value)
    if isinstance(value, str) or isinstance(now, bool) != isinstance(value, bool):
        raise ValueError(f"design {whole!r} must be a number like {now!r}, got {value!r}")
    return replace(spec, **{name: type(now)(value) if isinstance(now, float) else value})

"""Robots by single figures of their design: a path such as ``leg.rod_diameter`` and its value."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from tca_mj.modules.bending import BendingSpec
from tca_mj.modules.morphing import MorphingSpec
from tca_mj.registry import TASKS
from tca_mj.robots.arm import ArmSpec
from tca_mj.robots.tetrapod import TetrapodSpec
from tca_mj.tca import CATALOGUE, TcaSpec

# Argument of each task's class that is the robot, and the default.
_ROBOTS: dict[str, tuple[str, Any]] = {
    "ArmPickPlace": ("arm_spec", ArmSpec),
    "BendReach": ("module_spec", BendingSpec),
    "MorphModule": ("module_spec", lambda: MorphingSpec(motions=("bend_x",))),
    "TetrapodGait": ("robot", TetrapodSpec),
}


def robot_of(task: str, design: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a task's class that make its robot differ from the default.

    Args:
        task: Gymnasium id.
        design: Values by path. A TCA (``leg.tca``) takes the name of a catalogue's entry; its
            ``pitch_angle`` [rad] changes the coil at the same thread (``TcaSpec.of_pitch``).

    Raises:
        ValueError: If the task has no such robot, there is no such figure, or the value cannot be.
    """
    name = next(known.entry_point for known in TASKS if known.id == task).partition(":")[2]
    if name not in _ROBOTS:
        raise ValueError(f"design must be empty for {task}, got {sorted(design)}")
    argument, default = _ROBOTS[name]
    return {argument: designed(default(), design)}


def designed(spec: Any, design: Mapping[str, Any]) -> Any:
    """A specification with other figures; see ``robot_of``."""
    # Whole TCAs first, then what is changed in them.
    for path in sorted(design, key=lambda path: path.count(".")):
        spec = _changed(spec, path, path, design[path])
    return spec


def _changed(spec: Any, path: str, whole: str, value: Any) -> Any:
    name, _, rest = path.partition(".")
    known = [field.name for field in fields(spec)] if is_dataclass(spec) else []
    if name not in known:
        raise ValueError(f"design {whole!r}: {name!r} must be one of {known}")
    now = getattr(spec, name)
    if rest:
        return replace(spec, **{name: _changed(now, rest, whole, value)})
    if isinstance(now, TcaSpec):
        if value not in CATALOGUE:
            raise ValueError(f"design {whole!r} must be one of {list(CATALOGUE)}, got {value!r}")
        return replace(spec, **{name: CATALOGUE[value]})
    if isinstance(spec, TcaSpec) and name == "pitch_angle":
        return spec.of_pitch(value)
    if isinstance(value, str) or isinstance(now, bool) != isinstance(value, bool):
        raise ValueError(f"design {whole!r} must be a number like {now!r}, got {value!r}")
    return replace(spec, **{name: type(now)(value) if isinstance(now, float) else value})

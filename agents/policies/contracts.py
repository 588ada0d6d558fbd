"""What a policy was made for: the tables, the timing and the robot of a task, to be compared."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import gymnasium as gym

from tca_mj.checks import door, shown

Contract = Mapping[str, Mapping[str, Any]]
"""What a policy can rely on, part by part: rows, timing and figures by name."""
ROBOT = "robot"
"""The part of a contract that a policy can do without, at its own risk."""
_SHOWN = 4  # differences that a message names


@door
def contract(env: gym.Env[Any, Any]) -> dict[str, Any]:
    """What a policy can rely on in an environment.

    Args:
        env: The environment.

    Returns:
        ``observation`` and ``action``: for each row its name, size, unit, centre and scale;
        ``timing``: the control period [s], and what the TCAs are told; ``robot``: every figure of
        the specification by its path, empty where there is none.

    Raises:
        ValueError: If an argument is not of its kind.
    """
    task: Any = env.unwrapped
    argument = None if task.robot_argument is None else task.robot_argument[0]
    spec = None if argument is None else getattr(task, argument, None)
    found = {
        **{
            name: {
                row.name: [row.size, row.unit, row.centre, row.scale]
                for row in getattr(task, name).entries
            }
            for name in ("observation", "action")
        },
        "timing": {"control_period": task.control_period, "action": task.heating},
        ROBOT: {} if spec is None else dict(_flat("", asdict(spec))),
    }  # fmt: skip
    plain: dict[str, Any] = json.loads(json.dumps(found))
    return plain


@door
def digest(made_for: Contract) -> str:
    """A contract in 16 letters.

    Args:
        made_for: The contract.

    Raises:
        ValueError: If an argument is not of its kind.
    """
    text = json.dumps(made_for, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@door
def differences(needed: Contract, given: Contract) -> list[str]:
    """Where two contracts differ, in words, part by part. What is None is as good as missing.

    Args:
        needed: What a policy was made for.
        given: What an environment has.

    Raises:
        ValueError: If an argument is not of its kind.
    """
    found = []
    for part in needed:
        mine, other = needed[part], given.get(part, {})
        names = [*mine, *(name for name in other if name not in mine)]
        apart = [
            f"{name!r} {_said(mine, name)}, not {_said(other, name)}"
            for name in names if mine.get(name) != other.get(name)
        ]  # fmt: skip
        if not apart and part != ROBOT and list(mine) != list(other):
            apart = ["its rows in another order"]
        if apart:
            more = f" and {len(apart) - _SHOWN} more" if len(apart) > _SHOWN else ""
            found.append(f"{part}: {'; '.join(apart[:_SHOWN])}{more}")
    return found


def _said(rows: Mapping[str, Any], name: str) -> str:
    return shown(rows[name]) if name in rows else "missing"


def _flat(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{path}.{name}" if path else str(name), inner)
    elif value is None or isinstance(value, bool | int | float | str):
        yield path, value
    elif isinstance(value, list | tuple) and len(value) <= 100:
        for i, inner in enumerate(value):
            yield from _flat(f"{path}[{i}]", inner)
    else:
        yield path, repr(value)[:200]

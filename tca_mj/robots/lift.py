"""The carriage from which a hand hangs: it moves up and down, and sideways on a bridge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import mujoco

from tca_mj.checks import Checked, number, within
from tca_mj.hints import size
from tca_mj.model.surface import TOUCHES_NOTHING

_DOWN = (0.0, 1.0, 0.0, 0.0)  # z to -z, half a turn about x


@dataclass(frozen=True, kw_only=True, slots=True)
class LiftSpec(Checked):
    """How high the carriage goes, and how fast.

    Attributes:
        height: Height above the ground at the start [m].
        travel: Lowest and highest height [m].
        speed: Largest speed [m/s]. Estimate.

    Raises:
        ValueError: If a number is not finite and positive, or the height is outside the travel.
    """

    height: float = 0.14
    travel: tuple[float, float] = (0.07, 0.18)
    speed: Annotated[float, partial(size, kind="slides", at_most=10.0, unit="m/s")] = 0.04

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        low, high = within("travel", self.travel, shape=(2,), above=0.0, unit="m")
        size("travel", float(high), kind="slides", at_most=10.0)
        if not low < high:
            raise ValueError(f"travel must be a low and a higher height, got {self.travel}")
        size("height", self.height, kind="slides", at_most=10.0)
        number("height", self.height, at_least=low, at_most=high, unit="m, of travel")


def add_bridge(mjspec: mujoco.MjSpec, reach: float, speed: float) -> mujoco.MjsBody:
    """Adds what carries a carriage along y: the body ``bridge`` with its slide ``across``.

    It is driven by the actuator ``across``, whose control is a velocity [m/s].

    Args:
        mjspec: The specification, which is changed.
        reach: How far it goes to either side [m].
        speed: Its largest speed [m/s].
    """
    bridge = mjspec.worldbody.add_body(name="bridge", explicitinertial=True, mass=0.1,
                                       inertia=[1e-5, 1e-5, 1e-5])  # fmt: skip
    _drive(mjspec, bridge, "across", (0.0, 1.0, 0.0), (-reach, reach), speed)
    return bridge


def add_lift(
    mjspec: mujoco.MjSpec, spec: LiftSpec, *, on: mujoco.MjsBody | None = None
) -> mujoco.MjsBody:
    """Adds the carriage: the body ``base``, its slide ``lift`` and the site ``mount`` below it.

    The slide's position is the height above the ground. It is driven by the actuator ``lift``,
    whose control is a velocity [m/s]. The mount's z points down.

    Args:
        mjspec: The specification, which is changed.
        spec: The carriage.
        on: What carries it; None if nothing moves it but its slide.
    """
    base = (on or mjspec.worldbody).add_body(name="base")
    _drive(mjspec, base, "lift", (0.0, 0.0, 1.0), spec.travel, spec.speed)
    base.add_geom(
        name="carriage", type=mujoco.mjtGeom.mjGEOM_BOX, size=[14e-3, 14e-3, 4e-3],
        pos=[0.0, 0.0, 4e-3], rgba=[0.25, 0.27, 0.3, 1.0], **TOUCHES_NOTHING | {"mass": 0.1},
    )  # fmt: skip
    base.add_site(name="mount", quat=list(_DOWN), group=4)
    return base


def _drive(
    mjspec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, axis: tuple[float, ...],
    travel: tuple[float, float], speed: float,
) -> None:  # fmt: skip
    """Gives a body a slide and an actuator that moves it at a velocity, within its travel."""
    body.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=list(axis), ref=0.0,
        range=list(travel), limited=True,
    )  # fmt: skip
    drive = mjspec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
    drive.set_to_intvelocity(kp=2000.0, dampratio=1.0)
    drive.ctrlrange = [-speed, speed]
    drive.actlimited = 1
    drive.actrange = list(travel)

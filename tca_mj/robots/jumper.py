"""The jumping robot of Sun, Section 4.3.4: one bistable module that lies on the ground.

Only the body on the side of state 2 is there, so that the spine touches the ground. In state 1 the
robot is an arch on its two ends; its TCA triggers state 2, and the middle of the spine strikes the
ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import mujoco

from tca_mj.checks import Checked, NotNegative, Positive, door
from tca_mj.model.part import Part, new_spec, set_options
from tca_mj.model.surface import surface
from tca_mj.modules.bistable import BistableSpec, bistable_module

_NEAR = 4e-3  # height below which a rib counts as beside the ground, see ``Haste`` [m]


def _module() -> BistableSpec:
    return BistableSpec(bodies=1, spine=0.5e-3, angle=math.radians(75.0), damping_time=0.76e-3)


@dataclass(frozen=True, kw_only=True, slots=True)
class JumperSpec(Checked):
    """A jumper: a bistable module on the ground.

    Attributes:
        module: The module: one body, a spine of 0.5 mm and 75° (Sun, Section 4.3.4). Its
            ``damping_time`` is fitted to the published 70 mm, together with ``contact``.
        contact: Time constant of a contact [s]. Fitted, see ``module``.
        friction: Coefficient of friction with the ground. Estimate: a printed spine on a desk.

    Raises:
        ValueError: If a number is out of range.
    """

    module: BistableSpec = field(default_factory=_module)
    contact: Positive = 2e-3
    friction: NotNegative = 0.4


@door
def jumper(spec: JumperSpec | None = None) -> Part:
    """Builds the jumper: free, its base at the origin, its axis along x and state 2 upwards.

    Args:
        spec: The jumper, by default the published one.

    Returns:
        A part with the TCA ``module.to2``, the free joint ``free`` and the sites ``module.base``
        and ``module.tip``.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or JumperSpec()
    mjspec = new_spec("jumper")
    root = mjspec.worldbody.add_body(name="root")
    root.add_freejoint(name="free")
    half = math.sqrt(0.5)  # z to x, and so x to -z: turned over about z to have x upwards
    root.add_site(name="mount", quat=[0.0, half, 0.0, half], group=4)
    part = Part(mjspec)
    module = bistable_module(spec.module)
    set_options(module.spec)  # what strikes asks for more than another integrator, see ``Haste``
    part.attach(module, to="mount", prefix="module")
    touch = surface(
        (spec.friction, 0.002, 1e-4), solref=[spec.contact, 1.0], mass=0.0, gap=_NEAR
    )
    wide, radius = spec.module.width / 2.0, spec.module.spine / 2.0
    member = part.members["module.body"]
    for piece in range(member.nodes + 1):
        body = mjspec.body(member.body(piece))
        z = member.local(piece)
        body.add_geom(
            name=f"module.rib{piece}", type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0.0, -wide, z, 0.0, wide, z], size=[radius, 0.0, 0.0],
            rgba=[0.12, 0.12, 0.13, 1.0], **touch,
        )  # fmt: skip
    return part

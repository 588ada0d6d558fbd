"""What a robot of one's own is built with: TCAs laid into chains, and a stage to look at it on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from tca_mj.checks import Array, door
from tca_mj.model.chain import Chain
from tca_mj.model.part import Part
from tca_mj.model.tendon import RoutedTca, lay_tca, route_passes
from tca_mj.routes import AnyRoute
from tca_mj.tca import TcaSpec, find_tca

VIEW = "view"  # the camera of a stage
_ANGLE = 35.0  # from its lower to its upper edge [deg]
_ROOM = 1.4  # what it sees over the part's size
_NO_SIZE = 0.1  # size of a part in which nothing is seen [m]


@door
def add_tca(
    part: Part,
    chain: Chain | Sequence[Chain],
    route: AnyRoute,
    tca: TcaSpec | str | Path,
    *,
    name: str | None = None,
) -> RoutedTca:
    """Lays a TCA along a route through a chain, cut to the route's length, and adds it to the part.

    Args:
        part: The part, in whose specification the chain was built.
        chain: The chain, as ``add_chain`` returns it; or several, each standing on the one before,
            which the route runs through as if they were one.
        route: Where it runs: ``Helix`` (with 0 turns a straight line), ``UTurn``, or one of
            ``parallel(...)``.
        tca: The kind of TCA, its name in ``CATALOGUE`` or its file; its own length does not matter.
        name: Its name; by default ``tca0``, ``tca1`` and so on.

    Returns:
        The routed TCA, which is the last of ``part.tcas`` now.

    Raises:
        ValueError: If the kind is unknown, the route no route or out of the body, or the name
            taken.

    Example:
        >>> from tca_mj import Helix, Part, add_chain, add_tca, new_spec
        >>> from tca_mj.modules import silicone_cylinder
        >>> part = Part(new_spec("finger"))
        >>> beam = silicone_cylinder(45e-3, 4.5e-3, 9e-3)
        >>> chain = add_chain(part.spec.worldbody, beam, nodes=8, name="finger")
        >>> add_tca(part, chain, Helix(3e-3), "free-stroke").path_length
        0.045
    """
    if isinstance(tca, str | Path):
        tca = find_tca(tca)
    name = f"tca{len(part.tcas)}" if name is None else name
    if name in [other.name for other in part.tcas]:
        raise ValueError(f"name must be new in this part, got {name!r} again")
    chains = [chain] if isinstance(chain, Chain) else chain
    laid = lay_tca(part.spec, tca, route_passes(chains, route), name=name)
    part.tcas = (*part.tcas, laid)
    return laid


@door
def stage(part: Part, *, floor: float | None = None) -> None:
    """Gives a bare part a sky, a light and the camera ``view``; a simulation does it by itself.

    The camera looks along y at the middle of the part as it was built, with room to move.

    Args:
        part: The part, which has no light of its own.
        floor: Height of a floor, which carries what falls on it; None for none [m].
    """
    spec = part.spec
    spec.add_texture(
        name="stage.sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, width=128, height=128,
        rgb1=[0.93, 0.95, 0.98], rgb2=[0.72, 0.78, 0.86],
    )  # fmt: skip
    spec.worldbody.add_light(
        name="stage.light", pos=[0.3, -0.6, 1.2], dir=[-0.2, 0.4, -0.8], diffuse=[0.5, 0.5, 0.5]
    )
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.4, 0.4, 0.4]
    middle, radius = _extent(spec)
    away = _ROOM * radius / math.tan(math.radians(_ANGLE / 2.0))
    spec.worldbody.add_camera(
        name=VIEW, pos=(middle + away * np.array([0.0, -0.98, 0.2])).tolist(), fovy=_ANGLE,
        xyaxes=[1.0, 0.0, 0.0, 0.0, 0.2, 0.98],
    )  # fmt: skip
    if floor is not None:
        spec.worldbody.add_geom(
            name="stage.floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.01],
            pos=[0.0, 0.0, floor], rgba=[0.8, 0.81, 0.83, 1.0], friction=[0.8, 0.002, 1e-4],
        )  # fmt: skip


def _extent(spec: mujoco.MjSpec) -> tuple[Array, float]:
    """Middle of all geoms that have an end, and the radius of a ball about it that holds them."""
    model: mujoco.MjModel = spec.copy().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    ends = model.geom_rbound > 0.0
    if not ends.any():
        return np.zeros(3), _NO_SIZE
    place, size = data.geom_xpos[ends], model.geom_rbound[ends, None]
    low, high = (place - size).min(axis=0), (place + size).max(axis=0)
    return (low + high) / 2.0, float(np.linalg.norm(high - low)) / 2.0

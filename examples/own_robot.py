"""A robot of one's own: two soft modules that hang in a row, nine TCAs, straight and helical."""

import math
from dataclasses import dataclass

import tca_mj


@dataclass(frozen=True, kw_only=True)
class TwoModules:
    length: float = 45e-3  # of each module [m]
    radius: float = 3.2e-3  # distance of the TCAs from the middle [m]


def two_modules(spec=None, nodes=8):
    """Three TCAs bend the upper module, three twist it by a quarter turn, three bend the lower."""
    spec = spec or TwoModules()
    part = tca_mj.Part(tca_mj.new_spec("two_modules"))
    soft = tca_mj.modules.silicone_cylinder(spec.length, 8e-3, 8e-3)  # Ecoflex 00-30
    down = (0.0, 1.0, 0.0, 0.0)  # half a turn about x
    upper = tca_mj.add_chain(part, soft, nodes=nodes, name="upper", quat=down)
    lower = tca_mj.add_chain(part, soft, nodes=nodes, name="lower", on=upper)
    for route in tca_mj.parallel(3, spec.radius):
        tca_mj.add_tca(part, upper, route, "free-stroke")
    for phase in (60.0, 180.0, 300.0):
        helix = tca_mj.Helix(spec.radius, turns=0.25, phase=math.radians(phase))
        tca_mj.add_tca(part, upper, helix, "free-stroke")
    for route in tca_mj.parallel(3, spec.radius):
        tca_mj.add_tca(part, lower, route, "free-stroke")
    lower.mark_tip("tip")
    return part

"""A robot of one's own: two soft modules in a row, nine TCAs on straight and helical routes."""

import math

import tca_mj
from tca_mj.modules.bending import silicone_cylinder

LENGTH, RADIUS = 45e-3, 3.2e-3  # of each module; distance of the TCAs from the middle [m]


def two_modules():
    """Six TCAs run through the lower module, three of them on through the upper one."""
    part = tca_mj.Part(tca_mj.new_spec("two_modules"))
    soft = silicone_cylinder(LENGTH, 8e-3, 8e-3)  # its elastic and its outer diameter
    lower = tca_mj.add_chain(part.spec.worldbody, soft, nodes=8, name="lower")
    upper = tca_mj.add_chain(
        lower.tip, soft, nodes=8, name="upper", pos=(0.0, 0.0, lower.local(lower.nodes))
    )
    for route in tca_mj.parallel(3, RADIUS):  # bend the lower module
        tca_mj.add_tca(part, lower, route, "free-stroke")
    for i in range(3):  # twist it: a quarter of a turn
        phase = math.radians(60.0 + 120.0 * i)
        tca_mj.add_tca(part, lower, tca_mj.Helix(RADIUS, turns=0.25, phase=phase), "free-stroke")
    for route in tca_mj.parallel(3, RADIUS, phase=math.radians(30.0)):  # bend the upper one
        tca_mj.add_tca(part, upper, route, "free-stroke")
    upper.mark_tip("tip")
    part.sites["tip"] = "tip"
    return part


if __name__ == "__main__":
    sim = tca_mj.Simulation(two_modules())
    sim.rest([120.0, 25, 25, 25, 25, 25, 25, 120.0, 25])
    print("the tip is at", (1e3 * sim.data.site("tip").xpos).round(1), "mm")

"""A finer model of the tetrapod, which tells what the model that is used leaves out.

Each of the three spines is a chain of its own that bends about both axes, twists and stretches, and
the legs twist. The middle spine is in the tree. The other two start at the right rail, and welds
close them at the left one. It has several times the degrees of freedom and is for comparisons.
"""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco

from tca_mj.checks import door
from tca_mj.model.build import add_tca
from tca_mj.model.chain import MOTIONS, Chain, Motion, add_chain
from tca_mj.model.part import Part
from tca_mj.model.spine import route_spine
from tca_mj.model.weld import weld
from tca_mj.robots.tetrapod import (
    FewNodes,
    TetrapodSpec,
    attach_legs,
    dress,
    route_spine_tca,
    trunk,
)
from tca_mj.routes import UTurn
from tca_mj.smp.lumped import in_tube

_LEG_MOTIONS: tuple[Motion, ...] = ("bend_x", "bend_y", "twist")


@door
def fine_tetrapod(
    spec: TetrapodSpec | None = None, *, nodes: FewNodes = 6, leg_nodes: FewNodes = 10
) -> Part:
    """Builds the robot of ``tetrapod`` with more degrees of freedom; names are the same.

    Args:
        spec: The robot, but for its numbers of nodes and the motions of its legs.
        nodes: Nodes of each half of each spine, 1 to 32.
        leg_nodes: Nodes of each leg, 1 to 32.

    Returns:
        A part with the TCAs, spines and sites of ``tetrapod``. The chains of the spines are
        ``left`` and ``right`` for the halves of the middle one, ``outer0`` and ``outer2`` for the
        others.

    Raises:
        ValueError: If the geometry cannot be built.
    """
    spec = spec or TetrapodSpec()
    part, halves = trunk(spec, count=1, nodes=nodes, motions=MOTIONS)
    mjspec = part.spec
    outer = {i: _outer(mjspec, halves, spec, i) for i in (0, 2)}
    attach_legs(part, replace(spec.leg, nodes=leg_nodes, motions=_LEG_MOTIONS))
    for i in range(len(spec.places)):
        name = f"spine{i}"
        if i in outer:
            chains = [outer[i]]
            route = UTurn.parallel(spec.spine.tca_offset, spec.spine.width / 4.0, math.pi / 2.0)
            add_tca(part, outer[i], route, in_tube(spec.tca), name=name)
        else:
            chains = list(halves.values())
            part.tcas += (route_spine_tca(mjspec, halves, spec, 0.0, name),)
        part.spines += (route_spine(spec.spine, spec.heater, chains, name=name, tca=name),)
    return part


def _outer(
    mjspec: mujoco.MjSpec, halves: dict[str, Chain], spec: TetrapodSpec, number: int
) -> Chain:
    """The whole spine ``number``, from the right rail to a weld at the left one."""
    right, left = halves["right"], halves["left"]
    x, name = spec.places[number], f"outer{number}"
    chain = add_chain(
        right.tip, spec.body(count=1, length=spec.spine.length, curves=-1.0),
        nodes=2 * right.nodes, name=name, motions=MOTIONS,
        pos=(x, 0.0, right.local(right.nodes)), quat=(0.0, 1.0, 0.0, 0.0),
        rgba=(0.0, 0.0, 0.0, 0.0), collide=False,
    )  # fmt: skip
    dress(chain, spec, down=1.0, places={number: 0.0})
    weld(mjspec, left.tip, chain.tip, name=name)
    return chain

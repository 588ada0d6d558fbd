"""Errors of a chain against the theory of rods, as Markdown: two tables of docs/soft-bodies.md.

    python scripts/chain_table.py    seconds of one core

The first is the angle under one parallel TCA, without and with what gives the difference of
polyline and curve back to the joints. The second is the error of the tip's place over the length,
of the tip's rotation and of the TCA's length over its own, with 8, 16 and 32 nodes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np

from tca_mj.model import settle
from tca_mj.model.smooth import SmoothBody
from tca_mj.pages import command_line, table
from tca_mj.rod import BeamSpec, RodShape, solve_static
from tca_mj.routes import AnyRoute, Helix, UTurn, parallel

OFFSET, NODES = 4e-3, (8, 16, 32)
BODY = BeamSpec.circular(
    length=45e-3, diameter=4.5e-3, outer_diameter=9e-3, young=0.125e6, shear=0.125e6 / 3,
    density=1070,
)  # fmt: skip
PLAIN = replace(BODY, shearing=1e7 * BODY.shearing)  # the theory without shear
EXACT = 1e-6  # what is below this on all three counts, of the length, rad and of the TCA's length
STRAIGHT = ((0.01, 8), (0.02, 8), (0.04, 8), (0.02, 4), (0.02, 16))  # tensions [N], nodes
# Name, routes, tensions [N], force on the tip [N], fewest nodes: three sites for each turn.
CASES: tuple[tuple[str, Sequence[AnyRoute], Sequence[float], tuple[float, float, float], int], ...]
CASES = (
    ("parallel TCA, 41°", [Helix(OFFSET)], [0.01], (0.0, 0.0, 0.0), 8),
    ("parallel TCA, 82°", [Helix(OFFSET)], [0.02], (0.0, 0.0, 0.0), 8),
    ("parallel TCA, 164°", [Helix(OFFSET)], [0.04], (0.0, 0.0, 0.0), 8),
    ("82°, 2 mN across the plane", [Helix(OFFSET)], [0.02], (0.0, 2e-3, 0.0), 8),
    ("U, 0.01 N, 1 mN across the plane",
     [UTurn.parallel(2.5e-3, 0.8e-3)], [0.01], (0.0, 1e-3, 0.0), 8),
    ("three unlike tensions", parallel(3, OFFSET), [0.02, 0.012, 0.004], (0.0, 0.0, 0.0), 8),
    ("helix of one turn, 0.02 N (-48°)", [Helix(OFFSET, 1.0)], [0.02], (0.0, 0.0, 0.0), 8),
    ("left helix, 1 mN across", [Helix(OFFSET, -1.0)], [0.01], (1e-3, 0.0, 0.0), 8),
    ("helix of five turns, 0.02 N (-115°)", [Helix(OFFSET, 5.0)], [0.02], (0.0, 0.0, 0.0), 16),
    ("the same, 1 mN across", [Helix(OFFSET, 5.0)], [0.02], (1e-3, 0.0, 0.0), 16),
    ("double helix of 2.5 turns (-184°)",
     [UTurn.double_helix(OFFSET, 2.5)], [0.02], (0.0, 0.0, 0.0), 8),
)  # fmt: skip


def polylines() -> list[str]:
    """How far a chain bends too far under one parallel TCA; by theory the curvature is F a/EI."""
    stiff, rows = BODY.bending[0], []
    for force, nodes in STRAIGHT:
        exact, cell = force * OFFSET / stiff * BODY.length, BODY.length / nodes
        question: Any = BODY, [Helix(OFFSET)], [force]
        with mock.patch.object(SmoothBody, "support", lambda *_: None):
            without = settle(*question, nodes=nodes).bend_angle / exact - 1.0
        left = settle(*question, nodes=nodes).bend_angle / exact - 1.0
        rows.append([
            f"{force:g} N", f"{math.degrees(exact):.0f}°", f"{nodes}", f"{100.0 * without:+.2f} %",
            f"{100.0 * force * cell**2 / (4.0 * stiff):.2f} %",
            "exact" if abs(left) < 1e-9 else f"{100.0 * left:+.2g} %",
        ])  # fmt: skip
    return table(["tension", "angle", "nodes", "without", "F h²/(4 EI)", "with"], rows)


def errors(found: RodShape, exact: RodShape) -> str:
    """What a chain is off: place over the length, rotation, length of the first TCA over itself."""
    place = float(np.linalg.norm(found.tip - exact.tip)) / BODY.length
    turn = found.rotation[-1].T @ exact.rotation[-1]
    angle = math.acos(min(max((float(np.trace(turn)) - 1.0) / 2.0, -1.0), 1.0))
    path = abs(float(found.tca_length[0] / exact.tca_length[0]) - 1.0)
    if max(place, angle, path) < EXACT:
        return "exact"
    digits = 2 if place >= 9.95e-5 else 3
    return f"{100.0 * place:.{digits}f} %, {math.degrees(angle):.2f}°, {100.0 * path:.2f} %"


def against_theory() -> list[str]:
    """Errors by the number of nodes, against Cosserat's equations without shear."""
    rows = []
    for name, routes, tensions, force, fewest in CASES:
        exact = solve_static(PLAIN, routes, tensions, tip_force=force)
        rows.append([name, *(
            errors(settle(BODY, routes, tensions, nodes=n, tip_force=force), exact)
            if n >= fewest else "-" for n in NODES
        )])  # fmt: skip
    return table(["case", *(f"{n} nodes" for n in NODES)], rows)


def main() -> None:
    command_line(__doc__).parse_args()
    print("\n".join([*polylines(), "", *against_theory()]))


if __name__ == "__main__":
    main()

"""Error of the modules by number of nodes, at rest and hot, as Markdown.

    python scripts/node_table.py                      all modules, some minutes
    python scripts/node_table.py finger --nodes 4 6 8

Each module hangs at rest with its TCAs held at temperatures at which they work. Its tip's place
and rotation are compared with those of the same module with many nodes; the TCAs' own law and the
module's weight are part of it.
"""

import argparse
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tca_mj.model.part import Part
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.sim import Simulation

Build = Callable[[int], Part]
MODULES: dict[str, tuple[Build, str, float, list[list[float]]]] = {
    "bending": (
        lambda n: bending_module(BendingSpec(nodes=n)), "tip", BendingSpec().length,
        [[100, 25, 25], [120, 25, 25], [120, 100, 25], [160, 90, 90], [160, 25, 25]],
    ),
    "twisting": (
        lambda n: twisting_module(TwistingSpec(nodes=n)), "tip", TwistingSpec().length,
        [[80], [120], [160]],
    ),
    "finger": (
        lambda n: finger_pair(FingerPairSpec(nodes=n)), "tip0", FingerPairSpec().length / 2,
        [[25], [100], [120], [140], [160]],
    ),
}  # fmt: skip
DEFAULT = BendingSpec().nodes  # that of all three, in bold
# Largest velocity of a joint at which a part rests for sure, and with which MuJoCo's solver may let
# it creep (docs/soft-bodies.md, The integrator) [m/s, rad/s].
AT_REST, CREEP = 1e-6, 1e-2


def at_rest(part: Part, temperature: Sequence[float]) -> Simulation:
    """The hanging part with its TCAs at the given temperatures, once it moves no more.

    Raises:
        RuntimeError: If it still moves after 9 s.
    """
    part.spec.option.gravity = [0.0, 0.0, 9.81]
    sim = Simulation(part, timestep=4e-3)
    if sim.rest(temperature, longest=9.0, quiet=AT_REST) > CREEP:
        raise RuntimeError(f"at {temperature} °C the part does not come to rest")
    return sim


def tip(sim: Simulation, site: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Place and rotation matrix of a site."""
    return sim.data.site(site).xpos.copy(), sim.data.site(site).xmat.reshape(3, 3).copy()


def angle(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Angle between two rotations [°]."""
    return float(np.degrees(np.arccos(np.clip((np.trace(one.T @ other) - 1) / 2, -1, 1))))


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("module", nargs="*", help=f"some of {', '.join(MODULES)}; default: all")
    parser.add_argument("--nodes", type=int, nargs="+", default=[4, 6, 8, 10, 12, 16, 24])
    parser.add_argument("--reference", type=int, default=64)
    args = parser.parse_args(argv)
    unknown = sorted(set(args.module) - set(MODULES))
    if unknown:
        parser.error(f"unknown modules {unknown}, known are {sorted(MODULES)}")
    print("| module | TCAs [°C] | " + " | ".join(f"{n} nodes" for n in args.nodes) + " |")
    print("|---|---|" + "---|" * len(args.nodes))
    for name in args.module or MODULES:
        build, site, length, cases = MODULES[name]
        for case in cases:
            exact = at_rest(build(args.reference), case)
            place, turn = tip(exact, site)
            cells = []
            for nodes in args.nodes:
                try:
                    sim = at_rest(build(nodes), case)
                except ValueError:  # too few nodes for the route
                    cells.append("-")
                    continue
                except RuntimeError:
                    cells.append("no rest")
                    continue
                at, turned = tip(sim, site)
                error = 100.0 * float(np.linalg.norm(at - place)) / length
                bold = "**" if nodes == DEFAULT else ""
                cells.append(f"{bold}{error:.2f} %, {angle(turn, turned):.1f}°{bold}")
            print(f"| {name} | {', '.join(map(str, case))} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()

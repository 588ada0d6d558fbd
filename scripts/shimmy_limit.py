"""What limits the shimmy: the searched gait told as temperatures, and sought on single robots.

    python scripts/shimmy_limit.py                       the first three of the 16 robots
    python scripts/shimmy_limit.py --seeds 1014 --generations 30
    python scripts/shimmy_limit.py --replay              held for longer, in other cycles

Prints tables of docs/gaits.md. Gaits ask for temperatures every 0.2 s, for those in the middle of
each time. On single robots CMA-ES begins with the gait that ships and looks for speed alone,
whatever it costs, over whole cycles; then both gaits walk that robot for 60 s from cold. Physics
runs at 10 ms.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from tca_mj.agents.policies.actors import first_gait
from tca_mj.agents.train.gait_space import GaitSpace
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.control import Gait
from tca_mj.pages import table

Array = NDArray[np.float64]

TASK, START = "TCA/TetrapodShimmy-v0", "tetrapod-shimmy"
PERIOD = 0.2  # between two temperatures [s]
COARSE = 10e-3  # physics time step of the search [s]
WARM, JUDGED = 6.0, 16.0  # time that is not judged, and that is, rounded to whole cycles [s]
WHOLE = 60.0  # an episode [s]
ROBOTS = tuple(range(1000, 1016))  # those of docs/gaits.md
HOLDS = (0.2, 0.4, 0.5)  # [s]
PERIODS = (5.0, 5.3, 5.9, 6.4, 7.2)  # [s]
SIGMA, POPULATION = 0.04, 15  # of the search; the cube of all gaits has edges of 1


def tasks(count: int, held: float = PERIOD) -> Any:
    """So many tasks that are told temperatures, on one thread."""
    return TaskVecEnv.make(
        TASK, count, control_period=held, timestep=COARSE, num_threads=1, max_episode_steps=None
    ).tasks


def travelled(vector: Any, gaits: Sequence[Gait], seeds: Sequence[int], duration: float) -> Array:
    """Way of each gait on its robot, after every decision, shape (decisions + 1, gaits) [m]."""
    for i, seed in enumerate(seeds):
        vector.restart(i, seed=seed, options={"randomise": 0.2})
    ways, held = [np.zeros(len(gaits))], vector.envs[0].control_period
    for step in range(round(duration / held)):
        middle = (step + 0.5) * held
        asked = np.stack([
            vector.envs[0].asking(gait.temperature(middle / gait.period)) for gait in gaits
        ])  # fmt: skip
        outcomes = vector.advance(np.clip(asked, -1.0, 1.0).astype(np.float32))
        ways.append(np.array([outcome[4]["distance"] for outcome in outcomes]))
    return np.array(ways)


def over_cycles(ways: Array, gaits: Sequence[Gait]) -> Array:
    """Speed of each gait over whole cycles, once it is warm [m/s]."""
    clock, speeds = PERIOD * np.arange(len(ways)), []
    for way, gait in zip(ways.T, gaits, strict=True):
        first = round(WARM / gait.period) * gait.period
        last = first + max(1, round(JUDGED / gait.period)) * gait.period
        speeds.append(float(np.diff(np.interp([first, last], clock, way))[0]) / (last - first))
    return np.array(speeds)


def longest(gaits: Sequence[Gait]) -> float:
    """Time after which all of them have been judged [s]."""
    return max(WARM + JUDGED + 1.5 * gait.period for gait in gaits) + PERIOD


def together(gait: Gait) -> Gait:
    """The gait with the legs of each pair in step."""
    front, rear = gait.offset[0], gait.offset[2]
    return replace(gait, offset=(front, front, rear, rear))


def sought(start: Gait, seed: int, generations: int) -> Gait:
    """The fastest middle of a search on one robot, whose first middle is the start."""
    space = GaitSpace(centre=start, hottest=172.0)
    optimiser = CMA(mean=space.encode(start, (0.0,) * 4), sigma=SIGMA, seed=0,
                    population_size=POPULATION)  # fmt: skip
    vector, best = tasks(POPULATION + 1), (-np.inf, start)
    for _ in range(generations):
        points = [optimiser.ask() for _ in range(POPULATION)]
        middle = np.array(optimiser.mean)
        gaits = [together(space.decode(space.fold(p))[0]) for p in [*points, middle]]
        seeds = [seed] * len(gaits)
        found = over_cycles(travelled(vector, gaits, seeds, longest(gaits)), gaits)
        optimiser.tell([(p, -1e3 * v) for p, v in zip(points, found[:-1], strict=True)])
        if found[-1] > best[0]:
            best = found[-1], gaits[-1]
    vector.close()
    return best[1]


def replayed(start: Gait) -> list[str]:
    """The gait on the 16 robots: held for some times, and with other periods."""
    rows, best = [], np.zeros(len(ROBOTS))
    for held in HOLDS:
        speeds = _on_robots(start, held)
        best = np.maximum(best, speeds) if held == PERIOD else best
        rows.append([f"{held:g} s", f"{start.period:.2f} s", f"{1e3 * speeds.mean():.2f}"])
    for period in PERIODS:
        speeds = _on_robots(replace(start, period=period), PERIOD)
        rows.append([f"{PERIOD:g} s", f"{period:.2f} s", f"{1e3 * speeds.mean():.2f}"])
        best = np.maximum(best, speeds)
    rows.append([f"{PERIOD:g} s", "the best of these for each robot", f"{1e3 * best.mean():.2f}"])
    return table(["held for", "cycle", "16 robots [mm/s]"], rows)


def _on_robots(gait: Gait, held: float) -> Array:
    """Its speed on each of the 16 robots, 60 s from cold [m/s]."""
    vector = tasks(len(ROBOTS), held)
    speeds: Array = travelled(vector, [gait] * len(ROBOTS), ROBOTS, WHOLE)[-1] / WHOLE
    vector.close()
    return speeds


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1000, 1001, 1002])
    parser.add_argument("--generations", type=int, default=15)
    parser.add_argument("--replay", action="store_true", help="nothing is sought")
    arguments = parser.parse_args(argv)
    start, rows = together(first_gait(TASK, START)[0]), []
    if arguments.replay:
        print("\n".join(replayed(start)))
        return
    vector = tasks(2)
    for seed in arguments.seeds:
        begun = time.process_time()
        own = sought(start, seed, arguments.generations)
        spent = time.process_time() - begun
        shipped, adapted = travelled(vector, [start, own], [seed] * 2, WHOLE)[-1] / WHOLE
        rows.append([f"{seed}", f"{1e3 * shipped:.2f}", f"{1e3 * adapted:.2f}",
                     f"{100.0 * (adapted / shipped - 1.0):+.1f} %", f"{own.period:.1f}",
                     f"{spent / 60.0:.1f}"])  # fmt: skip
        print("\t".join(rows[-1]), flush=True)
    print("\n".join(table(["seed", "the gait that ships [mm/s]", "sought on this robot [mm/s]",
                           "gain", "its cycle [s]", "processor time [min]"], rows)))  # fmt: skip


if __name__ == "__main__":
    main()

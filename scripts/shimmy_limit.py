"""What limits the shimmy: the searched gait told as temperatures, and sought on single robots.

    python scripts/shimmy_limit.py                       the first three of the 16 robots
    python scripts/shimmy_limit.py --seeds 1014 --generations 30
    python scripts/shimmy_limit.py --replay              held for longer, in other cycles
    python scripts/shimmy_limit.py --replay --gait FILE  another gait, in its own task, held so
    python scripts/shimmy_limit.py --free 12 14          any temperatures, in cycles of so many
    python scripts/shimmy_limit.py --free 14 --robot 1008  the same on one of the 16 robots

Prints tables of docs/gaits.md. Gaits ask for temperatures every 0.2 s, for those in the middle of
each time. On single robots CMA-ES begins with the gait that ships and looks for speed alone,
whatever it costs, over whole cycles; then both gaits walk that robot for 60 s from cold. Free of
any form, each pair of TCAs has a temperature for each 0.4 s of a cycle; the search begins with
those of the shipped gait or policy, on the robot that is off by nothing unless another is named.
Physics runs at 10 ms.
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
from tca_mj.agents.policies.files import SavedPolicy
from tca_mj.agents.policies.load import find
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
HOLDS = (0.2, 0.3, 0.4, 0.5)  # [s]
PERIODS = (5.0, 5.3, 5.9, 6.4, 7.2)  # [s]
REPLAYED = ["cycle", "16 robots [mm/s]", "nominal, 60 s", "nominal, whole cycles"]
SIGMA, POPULATION = 0.04, 15  # of the search; the cube of all gaits has edges of 1
STEP = 0.4  # for which a temperature is held where a cycle may have any [s]
FREE_SIGMA, FREE_POPULATION = 0.08, 19  # of that search; an action is from -1 to 1


def tasks(count: int, held: float = PERIOD, task: str = TASK) -> Any:
    """So many tasks that are told temperatures, on one thread."""
    return TaskVecEnv.make(
        task, count, control_period=held, timestep=COARSE, num_threads=1, max_episode_steps=None
    ).tasks


def travelled(
    vector: Any, gaits: Sequence[Gait], seeds: Sequence[int], duration: float, off: float = 0.2
) -> Array:
    """Way of each gait on its robot, after every decision, shape (decisions + 1, gaits) [m]."""
    for i, seed in enumerate(seeds):
        vector.restart(i, seed=seed, options={"randomise": off})
    ways, held = [np.zeros(len(gaits))], vector.envs[0].control_period
    for step in range(round(duration / held)):
        middle = (step + 0.5) * held
        asked = np.stack([
            vector.envs[0].asking(gait.temperature(middle / gait.period)) for gait in gaits
        ])  # fmt: skip
        outcomes = vector.advance(np.clip(asked, -1.0, 1.0).astype(np.float32))
        ways.append(np.array([outcome[4]["distance"] for outcome in outcomes]))
    return np.array(ways)


def over_cycles(ways: Array, gaits: Sequence[Gait], held: float = PERIOD) -> Array:
    """Speed of each gait over whole cycles, once it is warm [m/s]."""
    clock, speeds = held * np.arange(len(ways)), []
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


def both_sides(program: Array) -> Array:
    """Actions of twelve TCAs, shape (..., 12), of those of the six that are on the left."""
    legs = program.reshape(*program.shape[:-1], 2, 1, 3)
    return np.broadcast_to(legs, (*legs.shape[:-3], 2, 2, 3)).reshape(*program.shape[:-1], 12)


def program_of(name: str, cycle: int) -> Array:
    """What a policy asks of the left TCAs in a cycle of so many decisions, shape (cycle, 6)."""
    saved, vector = SavedPolicy.read(find(name)), tasks(1, STEP)
    held, env = saved.arguments.get("control_period"), vector.envs[0]
    if saved.task != TASK or (saved.gait is None and held != STEP):
        raise ValueError(f"policy must be one of {TASK} that holds for {STEP} s, got {name}")
    if saved.gait is not None:
        phases = (np.arange(cycle) + 0.5) / cycle
        asked = np.stack([env.asking(together(saved.gait).temperature(phase)) for phase in phases])
    else:
        assert saved.network is not None
        observation, _ = env.reset(seed=0)
        rows = []
        for _ in range(8 * cycle):
            rows.append(saved.network(observation))
            observation = env.step(rows[-1])[0]
        asked = np.mean(np.reshape(rows[4 * cycle :], (4, cycle, 12)), axis=0)
    vector.close()
    return np.clip(asked.reshape(cycle, 2, 2, 3)[:, :, 0], -1.0, 1.0).reshape(cycle, 6)


def marched(
    vector: Any, programs: Sequence[Array], duration: float, robot: int | None = None
) -> Array:
    """Way of each program on a robot, (decisions + 1, programs); None is off by nothing [m]."""
    off = 0.0 if robot is None else 0.2
    for i in range(len(programs)):
        vector.restart(i, seed=robot or 0, options={"randomise": off})
    ways = [np.zeros(len(programs))]
    for step in range(round(duration / STEP)):
        asked = np.stack([both_sides(each[step % len(each)]) for each in programs])
        outcomes = vector.advance(np.clip(asked, -1.0, 1.0).astype(np.float32))
        ways.append(np.array([outcome[4]["distance"] for outcome in outcomes]))
    return np.array(ways)


def freed(name: str, cycle: int, generations: int, robot: int | None = None) -> list[str]:
    """A row of the table of programs of any form: how fast the first one is, and the best."""
    first, begun = program_of(name, cycle), time.process_time()
    optimiser = CMA(mean=first.ravel(), sigma=FREE_SIGMA, seed=0,
                    population_size=FREE_POPULATION)  # fmt: skip
    warm = round(WARM / STEP / cycle) * cycle
    last = warm + max(1, round(JUDGED / STEP / cycle)) * cycle
    vector, best = tasks(FREE_POPULATION + 1, STEP), (-np.inf, first)
    for generation in range(generations):
        points = [optimiser.ask() for _ in range(FREE_POPULATION)]
        programs = [point.reshape(cycle, 6) for point in [*points, np.array(optimiser.mean)]]
        ways = marched(vector, programs, STEP * last, robot)
        found = (ways[last] - ways[warm]) / (STEP * (last - warm))
        optimiser.tell([(p, -1e3 * v) for p, v in zip(points, found[:-1], strict=True)])
        if found[-1] > best[0]:
            best = found[-1], programs[-1]
        if generation % 10 == 0:
            print(f"{name}, {cycle}: {generation}, {1e3 * found[-1]:.2f} mm/s", flush=True)
    vector.close()
    vector = tasks(2, STEP)
    speeds = marched(vector, [first, best[1]], WHOLE, robot)[-1] / WHOLE
    vector.close()
    name += "" if robot is None else f", robot {robot}"
    return [name, f"{STEP * cycle:.1f} s", f"{1e3 * speeds[0]:.2f}", f"{1e3 * speeds[1]:.2f}",
            f"{1e3 * best[0]:.2f}", f"{(time.process_time() - begun) / 60.0:.0f}"]  # fmt: skip


def replayed(start: Gait, task: str = TASK) -> list[str]:
    """The gait on the 16 robots: held for some times, and the shimmy with other periods."""
    rows, best = [], np.zeros(len(ROBOTS))
    for held in HOLDS:
        speeds = _on_robots(start, held, task)
        best = np.maximum(best, speeds) if held == PERIOD else best
        rows.append([f"{held:g} s", f"{start.period:.2f} s", f"{1e3 * speeds.mean():.2f}",
                     *_nominal(start, held, task)])  # fmt: skip
    if task != TASK:
        return table(["held for", *REPLAYED], rows)
    for period in PERIODS:
        speeds = _on_robots(replace(start, period=period), PERIOD)
        rows.append([f"{PERIOD:g} s", f"{period:.2f} s", f"{1e3 * speeds.mean():.2f}",
                     *_nominal(replace(start, period=period), PERIOD, task)])  # fmt: skip
        best = np.maximum(best, speeds)
    rows.append([f"{PERIOD:g} s", "the best of these for each robot", f"{1e3 * best.mean():.2f}",
                 "", ""])  # fmt: skip
    return table(["shimmy held for", *REPLAYED], rows)


def _nominal(gait: Gait, held: float, task: str) -> list[str]:
    """Its speed on the robot that is off by nothing, 60 s from cold and over whole cycles."""
    vector = tasks(1, held, task)
    ways = travelled(vector, [gait], [0], WHOLE, 0.0)
    vector.close()
    return [f"{1e3 * v:.2f}" for v in (ways[-1, 0] / WHOLE, over_cycles(ways, [gait], held)[0])]


def _on_robots(gait: Gait, held: float, task: str = TASK) -> Array:
    """Its speed on each of the 16 robots, 60 s from cold [m/s]."""
    vector = tasks(len(ROBOTS), held, task)
    speeds: Array = travelled(vector, [gait] * len(ROBOTS), ROBOTS, WHOLE)[-1] / WHOLE
    vector.close()
    return speeds


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1000, 1001, 1002])
    parser.add_argument("--generations", type=int, default=15)
    parser.add_argument("--replay", action="store_true", help="nothing is sought")
    parser.add_argument("--gait", metavar="FILE", help="another gait, with --replay")
    parser.add_argument("--free", type=int, nargs="+", metavar="DECISIONS", help="of a cycle")
    parser.add_argument("--robot", type=int, choices=ROBOTS, metavar="SEED", help="of --free")
    parser.add_argument("--begin", default=START, help="policy that a free search begins with")
    arguments = parser.parse_args(argv)
    if arguments.free:
        print("\n".join(table(
            ["begun with", "cycle", "as it begins, 60 s [mm/s]", "best, 60 s", "best, whole cycles",
             "processor time [min]"],
            [freed(arguments.begin, cycle, arguments.generations, arguments.robot)
             for cycle in arguments.free],
        )))  # fmt: skip
        return
    if arguments.gait:
        saved = SavedPolicy.read(find(arguments.gait))
        if not arguments.replay or saved.gait is None:
            parser.error(f"argument --gait: must be a gait, with --replay, got {arguments.gait}")
        print("\n".join(replayed(saved.gait, saved.task)))
        return
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

"""Seeks the strokes that carry the tetrapod onto the course's beam, and along it, by CMA-ES.

    python scripts/stroke_search.py mount
    python scripts/stroke_search.py shimmy --seeds 308 315 317 --generations 30

Robots that are off by 20 % in everything walk the course up to that stage, led by the one policy.
From there every gait that is tried moves a copy of each of them. What counts is the time until the
stage is over (of the shimmy: until the robot is off the beam), in the geometric mean over the
robots; who is not there after the limit is taken to go on at the same speed. Physics runs at 10 ms.
A gait moves left and right legs together, and is rounded before it is tried. What came out stands
in tca_mj/agents/scripts/course_quick.py.
"""

from __future__ import annotations

import argparse
import copy
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from tca_mj.agents.policies.files import SavedPolicy
from tca_mj.agents.policies.load import find
from tca_mj.agents.scripts import course_quick
from tca_mj.agents.scripts.course import PUSH, CourseWalker, Go
from tca_mj.agents.train.gait_space import GaitSpace
from tca_mj.agents.workers import Workers
from tca_mj.control import Gait
from tca_mj.registry import make

TASK = "TCA/TetrapodCourse-v0"
OPTIONS = {"randomise": 0.2}
STAGES = {"mount": ("mount",), "shimmy": ("shimmy", "step off")}
COARSE = {"timestep": 10e-3, "tca_period": 50e-3}  # of the physics [s]
LIMIT = {"mount": 50.0, "shimmy": 75.0}  # [s]
SEEDS = {"mount": (300, 308, 309), "shimmy": (308, 315, 317)}
SIGMA, POPULATION = 0.04, 15  # of the search; the cube of all gaits has edges of 1
IDLE, LEAST = 20.0, 15e-3  # who has not got this far by then is given up [s, m]
FAILED = 1e3  # time of one that falls or breaks off [s]


class Moment(NamedTuple):
    """A robot where a stage begins, with who leads it and what was seen last."""

    env: Any
    walker: CourseWalker
    observation: NDArray[np.float32]


@cache  # of each process
def begun(stage: str, seed: int) -> Moment:
    """Where the one policy has led a robot to when the stage begins."""
    arguments = course_quick.shapes.arguments  # type: ignore[attr-defined]
    env: Any = make(TASK, **arguments, **COARSE)
    walker = course_quick.shapes(env)
    observation, _ = env.reset(seed=seed, options=OPTIONS)
    while walker.phase != stage:
        observation, _, ended, cut, info = env.step(walker.act(observation))
        if ended or cut:
            raise RuntimeError(f"seed {seed} does not get to {stage}: {info}")
    return Moment(env, walker, observation)


def lasted(moment: Moment, stage: str, gait: Gait) -> float:
    """Time until a gait has carried a copy of the robot to the end of the stage [s]."""
    env, walker, observation = copy.deepcopy(moment)
    task, first = env.unwrapped, walker._number
    plan = list(walker._plan)
    for i, each in enumerate(plan[first : first + len(STAGES[stage])], first):
        assert isinstance(each, Go)
        plan[i] = replace(each, gait=(gait,))
    walker._plan = tuple(plan)
    begin, end = float(task.position[0]), plan[first + len(STAGES[stage]) - 1].until
    now = before = begin
    spent = 0.0
    while walker.phase in STAGES[stage] and spent < LIMIT[stage]:
        observation, _, ended, cut, _ = env.step(walker.act(observation))
        spent += task.control_period
        before, now = now, float(task.position[0])
        if ended or cut:
            return FAILED
        if spent > IDLE and now - begin < LEAST:
            break
    if now < end:
        return min(FAILED, spent * (end - begin) / max(now - begin, 1e-4))
    late = (now - end) / max(now - before, 1e-6)
    return spent - task.control_period * min(late, 1.0)


def together(gait: Gait) -> Gait:
    """The gait with the legs of each pair in step."""
    front, rear = gait.offset[0], gait.offset[2]
    return replace(gait, offset=(front, front, rear, rear))


def first_gait(stage: str) -> Gait:
    """Where the search begins."""
    if stage == "mount":
        return replace(PUSH, hot=(CourseWalker.hottest,) * 3)
    found = SavedPolicy.read(find("tetrapod-shimmy")).gait
    assert found is not None
    return together(found)


def times(stage: str, seeds: Sequence[int], gait: Gait) -> list[float]:
    """How long it takes each of the robots [s]."""
    return [lasted(begun(stage, seed), stage, gait) for seed in seeds]


def rounded(gait: Gait) -> Gait:
    """The gait with as many digits as are written down."""
    digits = {"period": 2, "offset": 3, "start": 3, "duty": 3, "hot": 0, "warm": 0}
    return Gait(**{
        name: np.round(getattr(gait, name), count).tolist() for name, count in digits.items()
    })  # fmt: skip


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", choices=STAGES)
    parser.add_argument("--seeds", type=int, nargs="+", help="of the robots")
    parser.add_argument("--generations", type=int, default=30)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args(argv)
    stage, seeds = args.stage, tuple(args.seeds or SEEDS[args.stage])
    begin = first_gait(stage)
    space = GaitSpace(centre=begin, hottest=CourseWalker.hottest)
    optimiser = CMA(mean=space.encode(begin, (0.0,) * 4), sigma=SIGMA, seed=0,
                    population_size=POPULATION)  # fmt: skip
    best, clock = (math.inf, begin, list[float]()), time.monotonic()
    print(f"robots {', '.join(map(str, seeds))}; a generation is {POPULATION} gaits")
    with Workers(args.workers) as workers:
        for generation in range(args.generations):
            points = [optimiser.ask() for _ in range(POPULATION)]
            gaits = [rounded(together(space.decode(space.fold(point))[0]))
                     for point in (np.array(optimiser.mean), *points)]  # fmt: skip
            found_by = dict(workers.run(times, [(stage, seeds, gait) for gait in gaits]))
            rows = [found_by[i] for i in range(len(gaits))]
            worth = [float(np.mean(np.log(row))) for row in rows]
            optimiser.tell(list(zip(points, worth[1:], strict=True)))
            found = int(np.argmin(worth))
            better = worth[found] < best[0]
            if better:
                best = worth[found], gaits[found], rows[found]
            print(f"generation {generation + 1}: middle {math.exp(worth[0]):.1f} s, best so far"
                  f" {math.exp(best[0]):.1f} s ({', '.join(f'{t:.0f}' for t in best[2])}), "
                  f"{time.monotonic() - clock:.0f} s gone", flush=True)  # fmt: skip
            if better:
                print(best[1], flush=True)


if __name__ == "__main__":
    main()

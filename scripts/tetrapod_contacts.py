"""What the tetrapod's gaits owe to contacts and steps; prints the tables of docs/tetrapod.md.

    python scripts/tetrapod_contacts.py    about ten minutes on two cores; times want idle ones

Distances are those of 60 s from seed 0 over the one with everything as in the task. Hard: contacts
with a time constant of 1 ms at a step of 0.5 ms, whose layer at the surface is an eighth of the
task's, 25 um, or which have none. Contacts, halved and doubled: every number of them, none of which
says anything of the robot. Half the step; TCAs handed over in every physics step. Deepest: in any
physics step of 60 s, from when the robot has been put down. Slide: the largest way of a foot while
the robot stands for 20 s. Time: processor time of ``env.step``, the fastest of three runs of 20 s;
over its physics steps.

The last table is about hard contacts: the searched walk, 20 s, at shorter and shorter steps. Lost:
how often in a second a foot loses its contact. Dragged: mean speed of a foot while it carries, over
50 ms, 0.03 to 0.06 N, and how much of this time it touches what it is dragged over.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np

from tca_mj.agents.policies import load_policy
from tca_mj.agents.scripts.tetrapod import GAITS, gait_policy
from tca_mj.agents.workers import Workers
from tca_mj.envs.gaits import ACTION
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.machine import machine, versions
from tca_mj.pages import command_line
from tca_mj.robots.tetrapod import LEGS

STEPS = 600  # control steps, 60 s
STEP = mujoco.mj_step
STEP_TIME = 6.25e-3  # the task's own [s]
WHO = ("script", "searched")


class Contacts:
    """The numbers of a model's contacts that are of the robot."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Finds the geoms."""
        self.model, self.geoms = model, np.flatnonzero(model.geom_priority > 0)

    def hard(self, layer: float, impedance: float, seconds: float = 1e-3) -> None:
        """At rest after ``seconds``; ``impedance`` is the one at the first touch of the layer."""
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        self.layer(layer / self.model.geom_margin[self.geoms[0]])
        self.model.geom_solref[self.geoms, 0] = seconds
        self.model.geom_solimp[self.geoms, 0] = impedance
        if not layer:
            self.model.geom_solimp[self.geoms, 2] = 1e-3

    def layer(self, factor: float) -> None:
        """Makes the layer thicker, and what is in it wider."""
        self.model.geom_margin[self.geoms] *= factor
        self.model.geom_solimp[self.geoms, 2] *= factor

    def outside(self, factor: float) -> None:
        """Changes the impedance at the outside of the layer."""
        self.model.geom_solimp[self.geoms, 0] *= factor

    def give(self, factor: float) -> None:
        """Changes how far the impedance deep in the layer is from 1."""
        impedance = self.model.geom_solimp[self.geoms, 1]
        self.model.geom_solimp[self.geoms, 1] = 1.0 - factor * (1.0 - impedance)

    def rest(self, factor: float) -> None:
        """Changes the time constant of coming to rest."""
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        self.model.geom_solref[self.geoms, 0] *= factor

    def ratio(self, factor: float) -> None:
        """Changes how much stiffer friction is than what carries."""
        self.model.opt.impratio *= factor


Change = Callable[[Contacts], None]
HARD: dict[str, Change] = {
    "hard": lambda contacts: contacts.hard(25e-6, 0.1),
    "hard, no layer": lambda contacts: contacts.hard(0.0, 0.95),
}
CHANGES: dict[str, Callable[[Contacts, float], None]] = {
    "thickness of the layer": Contacts.layer,
    "impedance outside": Contacts.outside,
    "1 - impedance deep inside": Contacts.give,
    "time of coming to rest": Contacts.rest,
    "stiffness of friction": Contacts.ratio,
}


@dataclass(frozen=True, kw_only=True)
class Run:
    """One episode of 60 s: a gait, by whom, and what is changed."""

    gait: str
    who: str
    row: str
    timestep: float = STEP_TIME
    period: float | None = None  # between two updates of the TCAs; None for the task's own [s]
    watched: bool = False  # look into every physics step


def change(run: Run, model: mujoco.MjModel) -> None:
    """Changes the contacts as ``run.row`` says."""
    contacts = Contacts(model)
    if run.row in HARD:
        HARD[run.row](contacts)
    name, _, by = run.row.rpartition(" x ")
    if name in CHANGES:
        CHANGES[name](contacts, float(by))


def follow(run: Run) -> tuple[Run, float, float]:
    """Distance [m] and deepest contact in any physics step [m] of an episode."""
    env = TetrapodGait(gait=run.gait, action="power", timestep=run.timestep)
    change(run, env.sim.model)
    if run.period is not None:
        env.sim.tca_period, env.sim.substeps = run.period, round(run.period / run.timestep)
        env.sim.steadiness = max(run.timestep, 0.4 * run.period)
    random = np.random.default_rng(0)
    policy = None
    if run.who != "random":
        searched = run.who == "searched"
        policy = load_policy(f"tetrapod-{run.gait}", env) if searched else gait_policy(run.gait)
    deepest, down = 0.0, False

    def watch(model: Any, data: Any, steps: int = 1) -> None:
        nonlocal deepest
        for _ in range(steps):
            STEP(model, data)
            if down and data.ncon:
                deepest = max(deepest, -float(data.contact.dist.min()))

    with patch.object(mujoco, "mj_step", watch if run.watched else STEP):
        observation, info = env.reset(seed=0)
        down = True
        for number in range(STEPS):
            drawn = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
            action = drawn if policy is None else policy.act(observation)
            observation, _, terminated, truncated, info = env.step(action)
            if policy is None and (terminated or truncated):
                down = False
                observation, info = env.reset(seed=number)
                down = True
    return run, float(info["distance"]), deepest


def drag(row: str, timestep: float) -> list[str]:
    """What happens to the feet of the searched walk on hard contacts; cells of the last table."""
    env = TetrapodGait(gait="walk", action="power", timestep=timestep)
    HARD[row](Contacts(env.sim.model))
    policy = load_policy("tetrapod-walk", env)
    feet = [env.model.site(name).id for name in (f"robot.{leg}.foot" for leg in LEGS)]
    bodies = [env.model.body(int(body)).name for body in env.model.geom_bodyid]
    owner = np.full(env.model.ngeom, -1)
    for i, leg in enumerate(LEGS):
        owner[[name.startswith(f"robot.{leg}.") for name in bodies]] = i
    forces, places, wrench = [], [], np.zeros(6)

    def watch(model: Any, data: Any, steps: int = 1) -> None:
        for _ in range(steps):
            STEP(model, data)
            force = np.zeros(len(LEGS))
            for number, pair in enumerate(data.contact.geom):
                mujoco.mj_contactForce(model, data, number, wrench)
                force[owner[pair].max()] += wrench[0] if owner[pair].max() >= 0 else 0.0
            forces.append(force)
            places.append(data.site_xpos[feet].copy())

    observation, info = env.reset(seed=0)
    with patch.object(mujoco, "mj_step", watch):
        for _ in range(200):
            observation, *_, info = env.step(policy.act(observation))
    width = round(0.05 / timestep)
    touching = np.array(forces) > 1e-5
    sums = np.cumsum(np.array(forces), axis=0)
    mean = (sums[width:] - sums[:-width]) / width
    place = np.array(places)[..., :2]
    way = np.linalg.norm(place[width:] - place[:-width], axis=-1)
    light = (mean > 0.03) & (mean < 0.06)
    lost = np.diff(touching.astype(int), axis=0) < 0
    return [
        f"{1e3 * info['speed']:.2f} mm/s",
        f"{lost.sum() / 20.0 / len(LEGS):.0f} times a second",
        f"{1e3 * way[light].mean() / 0.05:.1f} mm/s",
        f"{100.0 * touching[width // 2 : width // 2 + len(light)][light].mean():.0f} %",
    ]


def slide(gait: str) -> float:
    """Largest shift of a foot while nothing is heated for 20 s [m]."""
    env = TetrapodGait(gait=gait, action="power")
    env.reset(seed=0)
    before = env.data.site_xpos[env.stance.feet].copy()
    for _ in range(200):
        env.step(np.full(ACTION.size, -1.0, dtype=np.float32))
    return float(np.linalg.norm(env.data.site_xpos[env.stance.feet] - before, axis=1).max())


def cost(gait: str, steps: int = 200) -> tuple[float, float]:
    """Processor time of ``env.step`` [s], and that over the time of its physics steps."""
    env, policy, inside = TetrapodGait(gait=gait, action="power"), gait_policy(gait), [0.0]

    def timed(*arguments: Any) -> None:
        start = time.process_time()
        STEP(*arguments)
        inside[0] += time.process_time() - start

    found = []
    for _ in range(3):
        policy.reset()
        observation, _ = env.reset(seed=0)
        whole, inside[0] = 0.0, 0.0
        with patch.object(mujoco, "mj_step", timed):
            for _ in range(steps):
                action = policy.act(observation)
                start = time.process_time()
                observation, *_ = env.step(action)
                whole += time.process_time() - start
        found.append((whole / steps, whole / inside[0]))
    return min(found)


def runs() -> list[Run]:
    """All episodes, the longest first."""
    found = []
    for gait in GAITS:
        for who in WHO:
            found += [Run(gait=gait, who=who, row=row, timestep=5e-4) for row in HARD]
            found += [
                Run(gait=gait, who=who, row="task", watched=True),
                Run(gait=gait, who=who, row="half the time step", timestep=STEP_TIME / 2.0),
                Run(gait=gait, who=who, row="TCAs in every step", period=STEP_TIME),
                Run(gait=gait, who=who, row="TCAs once a control step", period=0.1),
            ]
            found += [
                Run(gait=gait, who=who, row=f"{name} x {by}") for name in CHANGES for by in (0.5, 2)
            ]
        found.append(Run(gait=gait, who="random", row="task", watched=True))
    return sorted(found, key=lambda run: run.timestep)


def table(names: list[str], rows: dict[str, list[str]]) -> None:
    """Prints a table."""
    print(f"\n| | {' | '.join(names)} |\n|---|{'---|' * len(names)}")
    print("\n".join(f"| {name} | {' | '.join(cells)} |" for name, cells in rows.items()))


def main() -> None:
    """Prints machine, versions and the tables."""
    command_line(__doc__).parse_args()
    print("; ".join(f"{key} {value}" for key, value in {**machine(), **versions()}.items()))
    costs = {gait: cost(gait) for gait in GAITS}
    drags = [(row, step) for row in HARD for step in (5e-4, 2.5e-4, 1.25e-4)]
    with Workers(2) as workers:
        dragged = [each for _, each in sorted(workers.run(drag, drags), key=lambda row: row[0])]
        found = [each for _, each in workers.run(follow, [(run,) for run in runs()])]
    by = {(run.gait, run.who, run.row): (way, depth) for run, way, depth in found}
    rows: dict[str, list[str]] = {}
    columns = [(gait, who) for gait in GAITS for who in WHO]
    for column in columns:
        own = by[*column, "task"][0]
        for row in (
            *HARD, "half the time step", "TCAs in every step", "TCAs once a control step"
        ):  # fmt: skip
            other = by[*column, row][0]
            better = row in HARD or row == "TCAs in every step"
            share = own / other if better else other / own
            name = f"task over {row}" if better else f"{row} over task"
            name += ", 0.5 ms" if row in HARD else ""
            rows.setdefault(name, []).append(f"{100.0 * (share - 1.0):+.1f} %")
        for name in CHANGES:
            shares = [100.0 * (by[*column, f"{name} x {x}"][0] / own - 1.0) for x in (0.5, 2)]
            cell = f"{shares[0]:+.1f}, {shares[1]:+.1f} %"
            rows.setdefault(f"{name}, halved and doubled", []).append(cell)
        depth = by[*column, "task"][1]
        rows.setdefault("speed", []).append(f"{1e3 * own / (0.1 * STEPS):.2f} mm/s")
        rows.setdefault("deepest contact", []).append(f"{1e3 * depth:.2f} mm")
    table([f"{gait}, {who}" for gait, who in columns], rows)
    last: dict[str, list[str]] = {}
    for gait in GAITS:
        seconds, ratio = costs[gait]
        for name, value in {
            "slide while standing for 20 s": f"{1e3 * slide(gait):.2f} mm",
            "deepest under random actions": f"{1e3 * by[gait, 'random', 'task'][1]:.2f} mm",
            "env.step": f"{1e3 * seconds:.1f} ms, {0.1 / seconds:.0f} times real time",
            "env.step over its physics": f"{ratio:.2f}",
        }.items():
            last.setdefault(name, []).append(value)
    table(list(GAITS), last)
    table(
        ["speed", "contact lost", "dragged", "touches then"],
        {f"{row}, step {1e3 * step:g} ms": cells for (row, step), cells in
         zip(drags, dragged, strict=True)},
    )  # fmt: skip


if __name__ == "__main__":
    main()

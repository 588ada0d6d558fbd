"""What the tetrapod's gaits owe to contacts and steps; prints the tables of docs/tetrapod.md.

    python scripts/tetrapod_contacts.py    about ten minutes on two cores; times want idle ones

Distances are those of 60 s from seed 0 over the one with everything as in the task. Hard: contacts
without a layer at the surface, at a step of 0.5 ms, with time constants of 1 ms, or of 2 ms, which
makes a foot give as much as a ball of silicone does. Contacts, halved and doubled: every number of
them that says nothing of the robot. Half the step; TCAs handed over in every physics step. Deepest:
in any physics step of 60 s. Slide: the largest way of a foot while the robot stands for 20 s. Time:
processor time of ``env.step``, the fastest of three runs of 20 s; over its physics steps.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pool
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np

from tca_mj.agents.policy import load_policy
from tca_mj.agents.tetrapod_gaits import GAITS, GaitPolicy
from tca_mj.envs.tetrapod import ACTION, TetrapodGait
from tca_mj.machine import machine, versions

STEPS = 600  # control steps, 60 s
STEP = mujoco.mj_step
WHO = ("script", "learned")


class Contacts:
    """The numbers of a model's contacts that are of the robot, in two groups of geoms."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Finds the geoms of legs and body."""
        mine = np.flatnonzero(model.geom_priority > 0)
        names = [model.geom(int(i)).name for i in mine]
        leg = np.array([name.endswith(".foot") or ".plate" in name for name in names])
        self.model, self.groups = model, {"leg": mine[leg], "body": mine[~leg]}
        self.all = mine

    def hard(self, seconds: float, impedance: tuple[float, float]) -> None:
        """No layer at the surface; at rest after ``seconds``."""
        self.model.geom_margin[self.all] = 0.0
        self.model.geom_solref[self.all, 0] = seconds
        self.model.geom_solimp[self.all, :2] = impedance

    def layer(self, group: str, factor: float) -> None:
        """Makes the layer of ``leg`` or ``body`` thicker, and what is in it wider."""
        self.model.geom_margin[self.groups[group]] *= factor
        self.model.geom_solimp[self.groups[group], 2] *= factor

    def outside(self, group: str, factor: float) -> None:
        """Changes the impedance at the outside of the layer, which is at most 0.95."""
        impedance = self.model.geom_solimp[self.groups[group], 0]
        self.model.geom_solimp[self.groups[group], 0] = np.minimum(factor * impedance, 0.95)

    def give(self, group: str, factor: float) -> None:
        """Changes how far the impedance deep in the layer is from 1."""
        impedance = self.model.geom_solimp[self.groups[group], 1]
        self.model.geom_solimp[self.groups[group], 1] = 1.0 - factor * (1.0 - impedance)

    def rest(self, factor: float) -> None:
        """Changes the time constant of coming to rest."""
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        self.model.geom_solref[self.all, 0] *= factor

    def ratio(self, factor: float) -> None:
        """Changes how much stiffer friction is than what carries."""
        self.model.opt.impratio *= factor


Change = Callable[[Contacts], None]
HARD: dict[str, Change] = {
    "hard": lambda contacts: contacts.hard(1e-3, (0.95, 0.99)),
    "as stiff as silicone": lambda contacts: contacts.hard(2e-3, (0.9, 0.9)),
}
CHANGES: dict[str, Callable[[Contacts, float], None]] = {
    "layer of the legs": lambda contacts, by: contacts.layer("leg", by),
    "layer of the body": lambda contacts, by: contacts.layer("body", by),
    "impedance outside, legs": lambda contacts, by: contacts.outside("leg", by),
    "impedance outside, body": lambda contacts, by: contacts.outside("body", by),
    "1 - impedance deep inside, legs": lambda contacts, by: contacts.give("leg", by),
    "1 - impedance deep inside, body": lambda contacts, by: contacts.give("body", by),
    "time of coming to rest": Contacts.rest,
    "stiffness of friction": Contacts.ratio,
}


@dataclass(frozen=True, kw_only=True)
class Run:
    """One episode of 60 s: a gait, by whom, and what is changed."""

    gait: str
    who: str
    row: str
    timestep: float = 5e-3
    every_step: bool = False  # hand the TCAs over in every physics step
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
    env = TetrapodGait(gait=run.gait, timestep=run.timestep)
    change(run, env.sim.model)
    if run.every_step:
        env.sim.tca_period, env.sim.substeps = run.timestep, 1
        env.sim.steadiness = run.timestep
    random = np.random.default_rng(0)
    policy = None
    if run.who != "random":
        learned = run.who == "learned"
        policy = load_policy(f"tetrapod-{run.gait}", env) if learned else GaitPolicy.of(run.gait)
    deepest = 0.0

    def watch(model: Any, data: Any, steps: int = 1) -> None:
        nonlocal deepest
        for _ in range(steps):
            STEP(model, data)
            if data.ncon:
                deepest = max(deepest, -float(data.contact.dist.min()))

    with patch.object(mujoco, "mj_step", watch if run.watched else STEP):
        observation, info = env.reset(seed=0)
        for number in range(STEPS):
            drawn = random.uniform(-1.0, 1.0, ACTION.size).astype(np.float32)
            action = drawn if policy is None else policy.act(observation)
            observation, _, terminated, truncated, info = env.step(action)
            if policy is None and (terminated or truncated):
                observation, info = env.reset(seed=number)
    return run, float(info["distance"]), deepest


def slide(gait: str) -> float:
    """Largest shift of a foot while nothing is heated for 20 s [m]."""
    env = TetrapodGait(gait=gait)
    env.reset(seed=0)
    before = env.data.site_xpos[env.stance.feet].copy()
    for _ in range(200):
        env.step(np.full(ACTION.size, -1.0, dtype=np.float32))
    return float(np.linalg.norm(env.data.site_xpos[env.stance.feet] - before, axis=1).max())


def cost(gait: str, steps: int = 200) -> tuple[float, float]:
    """Processor time of ``env.step`` [s], and that over the time of its physics steps."""
    env, policy, inside = TetrapodGait(gait=gait), GaitPolicy.of(gait), [0.0]

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
                Run(gait=gait, who=who, row="half the time step", timestep=2.5e-3),
                Run(gait=gait, who=who, row="TCAs in every step", every_step=True),
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
    print("; ".join(f"{key} {value}" for key, value in {**machine(), **versions()}.items()))
    costs = {gait: cost(gait) for gait in GAITS}
    with Pool(2) as pool:
        found = list(pool.imap_unordered(follow, runs(), chunksize=1))
    by = {(run.gait, run.who, run.row): (way, depth) for run, way, depth in found}
    rows: dict[str, list[str]] = {}
    columns = [(gait, who) for gait in GAITS for who in WHO]
    for column in columns:
        own = by[*column, "task"][0]
        for row in (*HARD, "half the time step", "TCAs in every step"):
            other = by[*column, row][0]
            share = own / other if row in HARD else other / own
            name = f"task over {row}, 0.5 ms" if row in HARD else f"{row} over task"
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


if __name__ == "__main__":
    main()

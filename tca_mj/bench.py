"""How fast it runs here: the TCAs alone, the arm, its task, its recordings.

Every figure is a median over single steps, in processor time: machines are noisy, and what else
runs on them must not count. Physics and TCAs use one thread, so that processor time is what passes
on a machine with nothing else to do. ``env.step`` is compared with the ``mj_step`` calls in it,
timed in place, and with a bare replay: as many steps in one call from the state that it started
from, with the TCAs as they were, now before and now after it. What a recording costs includes the
threads that write it. The TCA that is measured alone is the free-stroke TCA of the catalogue.
"""

import json
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Self

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from tca_mj.agents.scripted import PickAndPlace
from tca_mj.envs.arm import ArmPickPlace
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.machine import machine, versions
from tca_mj.sim import Simulation
from tca_mj.tca import (
    CATALOGUE,
    CoilRods,
    CoilSurfaces,
    Heating,
    Load,
    LoadedTcas,
    hanging_length,
    solve_course,
)

# What is aimed at: real-time factor of the arm, env.step over its physics steps, the recorder's
# share of the simulation's time; seconds per solution of the rod and per look-up of the surface,
# and how many times faster than the published rod a hanging weight moves.
TARGETS = {
    "real_time_factor": 5.0,
    "step_ratio": 1.25,
    "recording_share": 0.20,
    "rod": 1e-6,
    "surface": 2e-7,
    "dynamics_factor": 1000.0,
}
# What a simulated second took with the published rod [s]; Sun, dissertation, Colorado State
# University, Section 3.4.4.
PUBLISHED = 24.0

_HOT = 120.0  # steady temperature of the bending TCA of the hot bent arm [°C]
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def benchmark(*, scale: float = 1.0, out: Path | None = None) -> dict[str, Any]:
    """Measures everything, about a minute.

    Args:
        scale: Share of the full number of repetitions and of the episode's length.
        out: Folder for ``benchmark.json`` and ``benchmark.md``; None to write nothing.

    Returns:
        ``machine``, ``versions``, ``tca``, ``model`` (the arm's size), ``arm`` (idle and hot),
        ``episode`` (by phase), ``recording`` and ``bank``; processor times in s; ``report`` says
        what they are.

    Raises:
        ValueError: If ``scale`` is not above 0 and at most 1.
    """
    if not 0.0 < scale <= 1.0:
        raise ValueError(f"scale must be above 0 and at most 1, got {scale}")
    task = ArmPickPlace()
    steps = max(int(400 * scale), 4)
    repetitions = max(int(100 * scale), 2)
    tca = _tca(scale)
    with tqdm(total=3 * repetitions + 2 * steps, disable=None, unit="step", leave=False) as bar:
        task.reset(seed=0)
        idle = _arm(task.sim, np.zeros(task.sim.n), repetitions, bar.update)
        task.reset(seed=0)
        hot = _arm(task.sim, _heating(task.sim), repetitions, bar.update)
        result = {
            "machine": machine(),
            "versions": versions(),
            "tca": tca,
            "model": {
                "degrees_of_freedom": int(task.model.nv),
                "bodies": int(task.model.nbody),
                "tcas": task.sim.n,
                "timestep": float(task.model.opt.timestep),
                "tca_period": task.sim.tca_period,
                "control_period": task.control_period,
            },
            "arm": {"idle": idle, "hot and bent": hot},
            "episode": _episode(task, steps, bar.update),
            "recording": _recording(task, steps, bar.update),
            "bank": _bank(task.sim, 20 * repetitions),
        }
    task.close()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        text = json.dumps(result, indent=2, ensure_ascii=False) + "\n"
        (out / "benchmark.json").write_text(text, encoding="utf-8")
        (out / "benchmark.md").write_text(report(result) + "\n", encoding="utf-8")
    return result


def report(result: dict[str, Any]) -> str:
    """What ``benchmark`` measured, as Markdown."""
    where, model = result["machine"], result["model"]
    kept = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    lines = [
        f"{where['cpu']}, {where['cores']} cores; {where['system']}",
        f"{kept}",
        "",
        *_tca_report(result["tca"]),
        "",
        f"Scene of the arm: {model['degrees_of_freedom']} degrees of freedom,"
        f" {model['bodies']} bodies, {model['tcas']} TCAs; time step"
        f" {1e3 * model['timestep']:g} ms, TCAs every {1e3 * model['tca_period']:g} ms,"
        f" control every {1e3 * model['control_period']:g} ms.",
        "",
        f"| physics and TCAs, one core | times real time (aim: {TARGETS['real_time_factor']:g}) |",
        "|---|---|",
    ]
    for name, factor in result["arm"].items():
        lines.append(f"| {name} arm | {factor:.1f} |")
    phases = result["episode"]["phases"]
    for name, row in phases.items():
        lines.append(f"| demo, {name} | {row['real_time_factor']:.1f} |")
    lines += [
        "",
        "| | env.step | the mj_steps in it | ratio"
        f" (aim: {TARGETS['step_ratio']:g}) | ratio to a bare replay |",
        "|---|---|---|---|---|",
    ]
    for name, row in {**phases, "all of it": result["episode"]["all"]}.items():
        lines.append(
            f"| {name} | {1e3 * row['step']:.2f} ms | {1e3 * row['inside']:.2f} ms"
            f" | {row['ratio']:.3f} | {row['replay_ratio']:.3f} |"
        )
    recording, bank = result["recording"], result["bank"]
    lines += [
        "",
        "| | |",
        "|---|---|",
        f"| opening a recording | {1e3 * recording['opening']:.0f} ms |",
        f"| recording a step, caller's thread | {1e6 * recording['per_step']:.0f} µs |",
        f"| recording, all threads, share of the simulation's time"
        f" (aim: below {100 * TARGETS['recording_share']:.0f} %)"
        f" | {100 * recording['share']:.1f} % |",
        f"| recording, size | {1e-3 * recording['bytes_per_second']:.0f} kB per simulated second |",
        f"| bank.advance, {model['tcas']} TCAs | {1e6 * bank['advance']:.0f} µs |",
    ]
    return "\n".join(lines)


def _tca(scale: float) -> dict[str, float]:
    """Times of the laws per TCA, and of a simulated second of a hanging weight per TCA."""
    repetitions, steps = max(int(40 * scale), 2), max(int(1000 * scale), 100)
    tca, load, random = CATALOGUE["free-stroke"], Load.weight(0.03), np.random.default_rng(0)

    def median(call: Callable[[], object], repetitions: int = repetitions) -> float:
        call()
        taken = []
        for _ in range(repetitions):
            start = time.thread_time()
            call()
            taken.append(time.thread_time() - start)
        return float(np.median(taken))

    n = 10_000
    specs = [tca] * n
    rods, surfaces = CoilRods(specs), CoilSurfaces(specs)
    length = tca.rest_length * random.uniform(0.8, 1.6, n)
    temperature, weight = random.uniform(25.0, 160.0, n), random.uniform(0.02, 0.6, n)
    result = {
        "rod": median(partial(rods.tension, length, temperature)) / n,
        "hanging_length": median(partial(hanging_length, tca, temperature, weight)) / n,
        "surface": median(partial(surfaces.tension, length, temperature)) / n,
    }

    dt, heating = 1e-3, Heating(source="power", value=0.6)
    few = max(repetitions // 8, 2)
    for law in ("rod", "surface"):
        for name, m in (("one", 1), ("thousand", 1000)):
            several = [tca] * m
            tension = None if law == "rod" else CoilSurfaces(several).tension
            lifting = LoadedTcas(several, load, law=tension)
            state = lifting.rest()
            stepped = median(partial(lifting.simulate, state, heating, dt, steps), few)
            result[f"steps, {name}, {law}"] = stepped / (m * steps * dt)
            if m == 1:
                at_once = median(partial(solve_course, lifting, state, heating, dt, steps), few)
                result[f"course, {name}, {law}"] = at_once / (steps * dt)
    return result


def _tca_report(tca: dict[str, float]) -> list[str]:
    lines = [
        "| 10,000 TCAs in one call | per TCA | aim |",
        "|---|---|---|",
        f"| rod, tension and slope at a length | {1e6 * tca['rod']:.3f} µs"
        f" | {1e6 * TARGETS['rod']:g} µs |",
        f"| rod, length under a load | {1e6 * tca['hanging_length']:.3f} µs"
        f" | {1e6 * TARGETS['rod']:g} µs |",
        f"| surface, tension and slope | {1e6 * tca['surface']:.3f} µs"
        f" | {1e6 * TARGETS['surface']:g} µs |",
        f"| rod over surface | {tca['rod'] / tca['surface']:.1f} | |",
        "",
        f"| a hanging weight, 1 s in 1 ms steps | per TCA | faster than {PUBLISHED:g} s"
        f" (aim: {TARGETS['dynamics_factor']:,.0f} times) |",
        "|---|---|---|",
    ]
    ways = {
        "steps, one": "step by step",
        "course, one": "all steps at once",
        "steps, thousand": "a thousand TCAs, step by step",
    }
    for key, way in ways.items():
        for law in ("rod", "surface"):
            taken = tca[f"{key}, {law}"]
            factor = PUBLISHED / taken
            lines.append(f"| {way}, {law} | {1e3 * taken:.3g} ms | {factor:,.0f} times |")
    return lines


def _arm(
    sim: Simulation, power: NDArray[np.float64], repetitions: int, tick: Callable[[], object]
) -> float:
    """Real-time factor of ``Simulation.step``, after half as many steps that are not measured."""
    period = ArmPickPlace.control_period
    taken = []
    for k in range(-(repetitions // 2), repetitions):
        start = time.thread_time()
        sim.step(power, period)
        if k >= 0:
            taken.append(time.thread_time() - start)
        tick()
    return period / float(np.median(taken))


def _heating(sim: Simulation) -> NDArray[np.float64]:
    """Power that keeps the second bending TCA hot and the others cold."""
    power = np.zeros(sim.n)
    heat = sim.bank.specs[1].heat
    power[1] = heat.keeping(_HOT, heat.ambient)  # while its body is cold
    return power


class Stopwatch:
    """Adds up the time spent in one function of an object; a context manager."""

    def __init__(self, owner: Any, name: str) -> None:
        self.seconds = 0.0
        self.plain = getattr(owner, name)
        self._owner, self._name = owner, name
        self._own = name in vars(owner)

    def __enter__(self) -> Self:
        setattr(self._owner, self._name, self._timed)
        return self

    def __exit__(self, *_: object) -> None:
        if self._own:
            setattr(self._owner, self._name, self.plain)
        else:
            delattr(self._owner, self._name)

    def _timed(self, *arguments: Any, **named: Any) -> Any:
        start = time.thread_time()
        try:
            return self.plain(*arguments, **named)
        finally:
            self.seconds += time.thread_time() - start


def _episode(task: ArmPickPlace, steps: int, tick: Callable[[], object]) -> dict[str, Any]:
    """The scripted demo, every step of it against its own physics steps."""
    model = task.model
    state = np.empty(mujoco.mj_stateSize(model, _STATE))
    beside = mujoco.MjData(model)
    count = round(task.control_period / model.opt.timestep)

    def bare() -> float:
        mujoco.mj_setState(model, beside, state, _STATE)
        start = time.thread_time()
        mujoco.mj_step(model, beside, count)
        return time.thread_time() - start

    policy = PickAndPlace()
    observation, _ = task.reset(seed=0, options={"object": "screwdriver"})
    rows: list[tuple[float, float, float, float]] = []
    phases: list[str] = []
    for k in range(steps):
        action = policy.act(observation)
        mujoco.mj_getState(model, task.data, state, _STATE)
        alone = bare() if k % 2 else 0.0
        with Stopwatch(mujoco, "mj_step") as inside, Stopwatch(task.sim, "step") as coupled:
            start = time.thread_time()
            observation, _, terminated, truncated, _ = task.step(action)
            taken = time.thread_time() - start
        rows.append((taken, alone or bare(), inside.seconds, coupled.seconds))
        phases.append(policy.phase)
        tick()
        if terminated or truncated:
            break
    table, names = np.array(rows), np.array(phases)
    found = {name: names == name for name in dict.fromkeys(phases)}
    return {
        "phases": {name: _row(table[which]) for name, which in found.items()},
        "all": _row(table),
    }


def _row(table: NDArray[np.float64]) -> dict[str, float]:
    step, alone, inside, coupled = table.T
    return {
        "step": float(np.median(step)),
        "inside": float(np.median(inside)),
        "outside": float(np.median(step - inside)),
        "ratio": float(np.median(step / inside)),
        "replay_ratio": float(np.median(step / alone)),
        "real_time_factor": ArmPickPlace.control_period / float(np.median(coupled)),
    }


class _Clocked(gym.Wrapper[Any, Any, Any, Any]):
    """Adds up the processor time of the steps below it."""

    seconds = 0.0

    def step(self, action: Any) -> Any:
        start = time.thread_time()
        result = self.env.step(action)
        self.seconds += time.thread_time() - start
        return result


def _recording(task: ArmPickPlace, steps: int, tick: Callable[[], object]) -> dict[str, float]:
    """What a recording adds to an episode, the work of its threads and its closing included."""
    clocked = _Clocked(task)
    with tempfile.TemporaryDirectory() as folder:
        env = RecordRerun(clocked, Path(folder) / "benchmark.rrd")
        observation, _ = env.reset(seed=0, options={"object": "screwdriver"})
        opening, done = env.seconds, 0
        policy, deciding = PickAndPlace(), 0.0
        begin = time.process_time()
        for _ in range(steps):
            start = time.thread_time()
            action = policy.act(observation)
            deciding += time.thread_time() - start
            observation, _, terminated, truncated, _ = env.step(action)
            done += 1
            tick()
            if terminated or truncated:
                break
        env.close()
        everything = time.process_time() - begin
        size = env.path.stat().st_size
    return {
        "opening": opening,
        "per_step": (env.seconds - opening) / done,
        "share": (everything - deciding - clocked.seconds) / clocked.seconds,
        "bytes_per_second": size / (done * task.control_period),
    }


def _bank(sim: Simulation, repetitions: int) -> dict[str, float]:
    """Time of one update of all TCAs of the arm."""
    power, length, taken = np.ones(sim.n), sim.length, []
    for _ in range(repetitions):
        start = time.thread_time()
        sim.bank.advance(sim.tca, power, length, sim.tca_period)
        taken.append(time.thread_time() - start)
    return {"advance": float(np.median(taken))}

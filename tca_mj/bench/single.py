"""How fast it runs here: the TCAs alone, a task at work, its recordings.

Every figure is a median over single steps, in processor time: machines are noisy, and what else
runs on them must not count. Physics and TCAs use one thread, so that processor time is what passes
on a machine with nothing else to do. ``env.step`` is compared with the ``mj_step`` calls in it,
timed in place, and with a bare replay: as many steps in one call from the state that it started
from, with the TCAs as they were, now before and now after it. What a recording costs includes the
threads that write it. The TCA that is measured alone is the free-stroke TCA of the catalogue.
"""

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.policies import Policy
from tca_mj.agents.policies.actors import arguments_of, scripted
from tca_mj.agents.progress import progress_bar
from tca_mj.bench.clock import Replay, Timed, in_physics, median, stopwatch, taken
from tca_mj.checks import Array, number
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.machine import machine, versions
from tca_mj.pages import made_with, page, table, write_result
from tca_mj.registry import DEMOS, make
from tca_mj.tca import CATALOGUE, CoilRods, CoilSurfaces, Heating, Load, LoadedTcas
from tca_mj.tca.dynamics.banded import solve_course
from tca_mj.tca.laws.statics import hanging_length

# What is aimed at: real-time factor of a task, env.step over its physics steps, the recorder's
# share of the simulation's time; seconds per solution of the rod and per look-up of the surface,
# and how many times faster than the published rod a hanging weight moves.
TARGETS = {
    "real_time_factor": 5.0, "step_ratio": 1.25, "recording_share": 0.20, "rod": 1e-6,
    "surface": 2e-7, "dynamics_factor": 1000.0,
}  # fmt: skip
# What a simulated second took with the published rod [s]; Sun, dissertation, Colorado State
# University, Section 3.4.4.
PUBLISHED = 24.0

_HOT = 120.0  # steady temperature of the one TCA that is heated [°C]


def benchmark(
    *, scale: float = 1.0, out: Path | None = None, task: str | None = None
) -> dict[str, Any]:
    """Measures everything, about a minute.

    Args:
        scale: Share of the full number of repetitions and of the episode's length.
        out: Folder for ``benchmark.json`` and ``benchmark.md``; None to write nothing.
        task: Id of a task with a script, or ``module:id``; None for the first with a demo.

    Returns:
        ``machine``, ``versions``, ``task``, ``tca``, ``model`` (the scene's size), ``physics``
        (without power and with a hot TCA), ``episode`` (by phase), ``recording`` and ``bank``;
        processor times in s; ``report`` says what they are.

    Raises:
        ValueError: If ``scale`` is not above 0 and at most 1, or there is no such task.
    """
    number("scale", scale, above=0.0, at_most=1.0)
    id = task or next(iter(DEMOS.values())).task
    env = make(id, disable_env_checker=True, **arguments_of("scripted", id)).unwrapped
    policy = scripted(env)
    steps, repetitions = max(int(400 * scale), 4), max(int(100 * scale), 2)
    tca = _tca(scale)
    with progress_bar(3 * repetitions + 2 * steps, unit="steps", leave=False) as bar:
        result = {
            "machine": machine(), "versions": versions(), "task": id, "tca": tca,
            "model": {
                "degrees_of_freedom": int(env.model.nv), "bodies": int(env.model.nbody),
                "tcas": env.sim.n, "timestep": float(env.model.opt.timestep),
                "tca_period": env.sim.tca_period, "control_period": env.control_period,
            },
            "physics": {
                "no power": _physics(env, False, repetitions, bar.update),
                f"one TCA at {_HOT:g} °C": _physics(env, True, repetitions, bar.update),
            },
            "episode": _episode(env, policy, steps, bar.update),
            "recording": _recording(env, policy, steps, bar.update),
            "bank": {"advance": median(
                partial(env.sim.bank.advance, env.sim.tca, np.ones(env.sim.n), env.sim.length,
                        env.sim.tca_period), 20 * repetitions)},
        }  # fmt: skip
    env.close()
    write_result(out, "benchmark", result, report(result))
    return result


def report(result: dict[str, Any]) -> str:
    """What ``benchmark`` measured, as Markdown."""
    model, phases = result["model"], result["episode"]["phases"]
    recording, bank = result["recording"], result["bank"]
    factors = result["physics"] | {
        f"script, {name}": row["real_time_factor"] for name, row in phases.items()
    }
    return page(
        made_with(result),
        *_tca_report(result["tca"]),
        f"Scene of {result['task']}: {model['degrees_of_freedom']} degrees of freedom,"
        f" {model['bodies']} bodies, {model['tcas']} TCAs; time step"
        f" {1e3 * model['timestep']:g} ms, TCAs every {1e3 * model['tca_period']:g} ms,"
        f" control every {1e3 * model['control_period']:g} ms.",
        table(
            ["physics and TCAs, one core",
             f"times real time (aim: {TARGETS['real_time_factor']:g})"],
            ([name, f"{factor:.1f}"] for name, factor in factors.items()),
        ),
        table(
            ["", "env.step", "the mj_steps in it", f"ratio (aim: {TARGETS['step_ratio']:g})",
             "ratio to a bare replay"],
            ([name, f"{1e3 * row['step']:.2f} ms", f"{1e3 * row['inside']:.2f} ms",
              f"{row['ratio']:.3f}", f"{row['replay_ratio']:.3f}"]
             for name, row in {**phases, "all of it": result["episode"]["all"]}.items()),
        ),
        table(["", ""], [
            ["opening a recording", f"{1e3 * recording['opening']:.0f} ms"],
            ["recording a step, caller's thread", f"{1e6 * recording['per_step']:.0f} µs"],
            ["recording, all threads, share of the simulation's time"
             f" (aim: below {100 * TARGETS['recording_share']:.0f} %)",
             f"{100 * recording['share']:.1f} %"],
            ["recording, size",
             f"{1e-3 * recording['bytes_per_second']:.0f} kB per simulated second"],
            [f"bank.advance, {model['tcas']} TCAs", f"{1e6 * bank['advance']:.0f} µs"],
        ]),
    )  # fmt: skip


def _tca(scale: float) -> dict[str, float]:
    """Times of the laws per TCA, and of a simulated second of a hanging weight per TCA."""
    repetitions, steps = max(int(40 * scale), 2), max(int(1000 * scale), 100)
    tca, load, random = CATALOGUE["free-stroke"], Load.weight(0.03), np.random.default_rng(0)

    n = 10_000
    specs = [tca] * n
    rods, surfaces = CoilRods(specs), CoilSurfaces(specs)
    length = tca.rest_length * random.uniform(0.8, 1.6, n)
    temperature, weight = random.uniform(25.0, 160.0, n), random.uniform(0.02, 0.6, n)
    calls: dict[str, Callable[[], object]] = {
        "rod": partial(rods.tension, length, temperature),
        "hanging_length": partial(hanging_length, tca, temperature, weight),
        "surface": partial(surfaces.tension, length, temperature),
    }
    result = {name: median(call, repetitions) / n for name, call in calls.items()}

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


def _tca_report(tca: dict[str, float]) -> list[list[str]]:
    batches = {
        "rod, tension and slope at a length": ("rod", "rod"),
        "rod, length under a load": ("hanging_length", "rod"),
        "surface, tension and slope": ("surface", "surface"),
    }
    ways = {
        "steps, one": "step by step",
        "course, one": "all steps at once",
        "steps, thousand": "a thousand TCAs, step by step",
    }
    moved = {f"{way}, {law}": tca[f"{key}, {law}"]
             for key, way in ways.items() for law in ("rod", "surface")}  # fmt: skip
    return [
        table(["10,000 TCAs in one call", "per TCA", "aim"], [
            *([what, f"{1e6 * tca[key]:.3f} µs", f"{1e6 * TARGETS[aim]:g} µs"]
              for what, (key, aim) in batches.items()),
            ["rod over surface", f"{tca['rod'] / tca['surface']:.1f}", ""],
        ]),
        table(
            ["a hanging weight, 1 s in 1 ms steps", "per TCA",
             f"faster than {PUBLISHED:g} s (aim: {TARGETS['dynamics_factor']:,.0f} times)"],
            ([what, f"{1e3 * seconds:.3g} ms", f"{PUBLISHED / seconds:,.0f} times"]
             for what, seconds in moved.items()),
        ),
    ]  # fmt: skip


def _physics(env: Any, hot: bool, repetitions: int, tick: Callable[[], object]) -> float:
    """Real-time factor of ``Simulation.step``, after half as many steps that are not measured.

    If it is to be hot, one TCA gets the power that keeps it so while its body is cold.
    """
    env.reset(seed=0)
    sim, which = env.sim, env.sim.n // 3
    heat, power = sim.bank.specs[which].heat, np.zeros(sim.n)
    if hot:
        power[which] = heat.keeping(_HOT, heat.ambient)
    seconds = []
    for _ in range(repetitions // 2 + repetitions):
        seconds.append(taken(lambda: sim.step(power, env.control_period)))
        tick()
    return float(env.control_period / np.median(seconds[repetitions // 2 :]))


def _run(
    step: Callable[[Any], Any], policy: Policy, seen: Any, steps: int, tick: Callable[[], object]
) -> tuple[int, float]:
    """Runs the script from what a reset showed; steps done and processor time it took [s]."""
    policy.reset()
    act, done, ended = Timed(policy.act), 0, False
    while done < steps and not ended:
        seen, _, terminated, truncated, _ = step(act(seen))
        done, ended = done + 1, terminated or truncated
        tick()
    return done, act.seconds


def _episode(
    task: Any, policy: Policy, steps: int, tick: Callable[[], object]
) -> dict[str, Any]:
    """The scripted episode, every step of it against its own physics steps, by phase."""
    replay, phases = Replay(task), []
    rows: list[tuple[float, ...]] = []

    def dissected(action: Any) -> Any:
        replay.keep()
        alone, step = replay.seconds() if len(rows) % 2 else 0.0, Timed(task.step)
        with in_physics() as inside, stopwatch(task.sim, "step") as coupled:
            result = step(action)
        alone = alone or replay.seconds()
        rows.append((step.seconds, alone, inside.seconds, coupled.seconds))
        phases.append(policy.phase)
        return result

    _run(dissected, policy, task.reset(seed=0)[0], steps, tick)

    def row(part: Array) -> dict[str, float]:
        step, alone, inside, coupled = part.T
        times = {
            "step": step, "inside": inside, "outside": step - inside, "ratio": step / inside,
            "replay_ratio": step / alone, "real_time_factor": task.control_period / coupled,
        }  # fmt: skip
        return {name: float(np.median(values)) for name, values in times.items()}

    times, names = np.array(rows), np.array(phases)
    by_phase = {name: row(times[names == name]) for name in dict.fromkeys(phases)}
    return {"phases": by_phase, "all": row(times)}


def _recording(
    task: Any, policy: Policy, steps: int, tick: Callable[[], object]
) -> dict[str, float]:
    """What a recording adds to an episode, the work of its threads and its closing included."""
    with tempfile.TemporaryDirectory() as folder, stopwatch(task, "step") as clocked:
        env = RecordRerun(task, Path(folder) / "benchmark.rrd")
        seen, _ = env.reset(seed=0)
        opening, begin = env.seconds, time.process_time()
        done, deciding = _run(env.step, policy, seen, steps, tick)
        env.close()
        everything = time.process_time() - begin
        size = env.path.stat().st_size
    return {
        "opening": opening,
        "per_step": (env.seconds - opening) / done,
        "share": (everything - deciding - clocked.seconds) / clocked.seconds,
        "bytes_per_second": size / (done * task.control_period),
    }

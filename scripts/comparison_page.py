"""Measures tca-mj beside other packages and writes the tables of docs/comparison.md.

    python scripts/comparison_page.py tca-mj pyelastica=OTHER/bin/python soromox=... myosuite=...

For each a Python that has the package: `python -m venv OTHER; OTHER/bin/pip install pyelastica`.
What was measured is kept in runs/comparison: those that are not named stay as they are. Some
minutes of one core each.
"""

import argparse
import json
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from comparison_peers import frequency, off, step_time

import tca_mj
from tca_mj import pages
from tca_mj.files import write_whole
from tca_mj.machine import machine, versions
from tca_mj.model import settle
from tca_mj.rod import BeamSpec, solve_static

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "comparison.md"
MARK = "<!-- Written by scripts/comparison_page.py from here on. -->"
LENGTH, RADIUS, DENSITY, YOUNG = 0.2, 5e-3, 1070.0, 0.125e6  # Ecoflex 00-30, ten times as long
LOADS = {"small": 1.0, "large": 10.0}  # tip force, as P L²/EI
STIFFER = 1000.0  # Young's modulus of the second rod over that of the first
KEPT = ROOT / "runs" / "comparison"  # what was measured, by package
NAMES = {"tca-mj": "tca-mj", "pyelastica": "PyElastica", "soromox": "SoRoMoX",
         "myosuite": "MyoSuite"}  # fmt: skip
TASKS = {"tca-mj": "tca-mj: `TCA/BendReach-v0`",
         "myosuite": "MyoSuite: `myoElbowPose1D6MRandom-v0`"}  # fmt: skip
BOUND = 1.0  # error at which cost is compared [% of the length]


def rod(young: float) -> BeamSpec:
    """The rod, of silicone or stiffer."""
    return BeamSpec.circular(
        length=LENGTH, diameter=2.0 * RADIUS, young=young, shear=young / 3.0, density=DENSITY
    )


def case_of(young: float, pieces: list[int], steps: list[float]) -> dict[str, Any]:
    """The rod, its loads, and the exact theory's tips under them, with shear and stretch.

    Args:
        young: Young's modulus [Pa].
        pieces: Numbers of pieces that are tried.
        steps: Time steps, the largest first [s].
    """
    beam, loads = rod(young), []
    for name, load in LOADS.items():
        force = load * beam.bending[0] / LENGTH**2
        exact = solve_static(beam, [], [], tip_force=(force, 0.0, 0.0))
        loads.append({"name": name, "force": force, "across": exact.tip[0], "along": exact.tip[2]})
    case = {"length": LENGTH, "radius": RADIUS, "density": DENSITY, "young": young,
            "shear": young / 3.0, "loads": loads, "pieces": pieces, "steps": steps}  # fmt: skip
    return case | {"seconds": 19.0 / frequency(case)}  # critically damped: at rest to 1e-8


def ours(case: dict[str, Any]) -> list[dict[str, Any]]:
    """The chain of this package at rest, and what a second of its simulation takes.

    A simulation has muscles: here one of a millionth of the stiffness of its kind.
    """
    beam = rod(case["young"])
    thread = tca_mj.CATALOGUE["free-stroke"].of_length(LENGTH)
    fibre = replace(thread.fibre, young=1200.0, shear=220.0)
    rows = []
    for load in case["loads"]:
        force = np.array([load["force"], 0.0, 0.0])
        for nodes in case["pieces"]:
            clock = time.process_time()
            still = settle(beam, [], [], nodes=nodes, tip_force=force)
            rest = time.process_time() - clock
            error = off(case, load, still.tip[0], still.tip[2])
            for step in case["steps"]:
                part = tca_mj.Part(tca_mj.new_spec("rod"))
                part.spec.option.gravity = [0.0, 0.0, 0.0]
                chain = tca_mj.add_chain(part, beam, nodes=nodes, name="rod")
                tca_mj.add_tca(part, chain, tca_mj.Helix(1e-3), replace(thread, fibre=fibre))
                chain.mark_tip("tip")
                end = chain.tip.add_body(name="load", pos=[0.0, 0.0, chain.local(nodes)])
                end.ipos = [0.0, 0.0, 0.0]  # MuJoCo applies forces at centres of mass
                sim = tca_mj.Simulation(part, timestep=step, tca_period=max(step, 0.01))
                sim.data.xfrc_applied[sim.model.body("load").id, :3] = force
                clock = time.process_time()
                for _ in range(100):
                    sim.step([0.0], 0.1)
                cost = (time.process_time() - clock) / 10.0
                sim.rest([25.0], longest=1000.0, quiet=1e-7)
                tip = sim.data.site("tip").xpos
                if abs(off(case, load, tip[0], tip[2]) - error) < 0.02:  # as at rest
                    break
            else:
                raise ArithmeticError(f"{nodes} nodes do not come to rest where they do at rest")
            rows.append({"kind": "simulated", "load": load["name"], "pieces": nodes,
                         "error": error, "step": step, "cost": cost, "rest": rest})  # fmt: skip
    return rows


def peer(name: str, python: str, case: dict[str, Any]) -> dict[str, Any]:
    """What a package measures of itself.

    Raises:
        RuntimeError: If it does not work there, with what it said.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cases.json"
        path.write_text(json.dumps({name: case}), encoding="utf-8")
        command = [python, str(ROOT / "scripts" / "comparison_peers.py"), name, str(path)]
        place = {"NUMBA_CACHE_DIR": folder, "PATH": "/usr/bin:/bin", "HOME": folder}
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=place)
    if done.returncode:
        raise RuntimeError(f"{name} failed:\n{done.stderr[-2000:]}")
    found: dict[str, Any] = json.loads(done.stdout.rpartition("result:")[2])
    return found


def own_steps() -> float:
    """Processor time of a step of the smallest task, with random actions [s]."""
    env = tca_mj.make("TCA/BendReach-v0")
    env.reset(seed=0)
    return step_time(env)


def ms(seconds: float) -> str:
    """A time in milliseconds, to three digits."""
    return f"{1e3 * seconds:.3g}" if seconds < 1.0 else f"{1e3 * seconds:.0f}"


def tables(soft: dict[str, Any], stiff: dict[str, Any], tasks: dict[str, Any]) -> str:
    """The measured part of the page.

    Args:
        soft: Rows of the rod of silicone by package and kind.
        stiff: Likewise of the one a thousand times as stiff.
        tasks: Cost of a step [s], period [s] and what else is known, by task.
    """
    count = sorted({row["pieces"] for rows in soft.values() for row in rows})
    errors = []
    for name, rows in soft.items():
        for load in LOADS:
            found = {row["pieces"]: row["error"] for row in rows if row["load"] == load}
            cells = [f"{found[n]:.2f}" if n in found else "" for n in count]
            errors.append([name, load, *cells])
    costs = []
    for which, data in (("silicone", soft), ("1000 times as stiff", stiff)):
        for name, rows in data.items():
            good = [row for row in rows if row["load"] == "large" and row["error"] <= BOUND]
            if not good:
                costs.append([name, which, "", "not reached", "", ""])
                continue
            row = min(good, key=lambda each: each["pieces"])
            step = ms(row["step"]) if "step" in row else "by error"
            costs.append([name, which, str(row["pieces"]), f"{row['error']:.2f}", step,
                          ms(row["cost"])])  # fmt: skip
    steps = [
        [name, f"{1e6 * each['cost']:.0f}", f"{each['period']:g}",
         f"{each['period'] / each['cost']:.0f}"] for name, each in tasks.items()
    ]  # fmt: skip
    return pages.page(
        "Error of the tip, in % of the length, by the number of pieces:",
        pages.table(["package", "load", *map(str, count)], errors),
        f"The coarsest of these within {BOUND:g} % under the large load, the largest time step of"
        " those tried that is stable, and processor time for a simulated second:",
        pages.table(["package", "rod", "pieces", "error [%]", "time step [ms]", "cost [ms]"],
                    costs),
        "A step of the smallest task of each, with random actions:",
        pages.table(["task", "step [µs]", "period [s]", "times real time"], steps),
    )  # fmt: skip


def measured(name: str, python: str) -> dict[str, Any]:
    """All that is measured of one package: ``soft``, ``stiff`` and what else is known.

    Args:
        name: The package.
        python: A Python that has it; any for tca-mj itself.
    """
    few, more = [4, 8, 16, 32], [4, 8, 16, 32, 64, 128]
    explicit = [4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5]
    quick = [each / 30.0 for each in explicit]
    if name == "tca-mj":
        steps = [1e-2, 5e-3, 2e-3, 1e-3, 5e-4]
        return {"soft": ours(case_of(YOUNG, few, steps)), "cost": own_steps(), "period": 0.1,
                "stiff": ours(case_of(STIFFER * YOUNG, [8], steps))}  # fmt: skip
    if name == "myosuite":
        return peer(name, python, {})
    tried, again = (more, [8, 128]) if name == "pyelastica" else (few[:3], [8])
    found = peer(name, python, case_of(YOUNG, tried, explicit))
    stiff = peer(name, python, case_of(STIFFER * YOUNG, again, quick))
    return {**found, "soft": found.pop("rows"), "stiff": stiff["rows"]}


def page(results: dict[str, Any]) -> str:
    """What is written, from the results by package."""
    sets: dict[str, dict[str, Any]] = {"soft": {}, "stiff": {}}
    for name, result in results.items():
        for kind in dict.fromkeys(row["kind"] for row in result.get("soft", [])):
            title = NAMES[name] if name in ("tca-mj", "soromox") else f"{NAMES[name]}, {kind}"
            for which, rows in sets.items():
                rows[title] = [row for row in result[which] if row["kind"] == kind]
    tasks = {TASKS[name]: results[name] for name in TASKS if name in results}
    firsts = [f"{NAMES[name]} {each['first']:.1f} s" for name, each in results.items()
              if "first" in each]  # fmt: skip
    made: dict[str, str] = {}
    for each in results.values():
        made |= each.get("versions", {})
    ids = "".join(f" {NAMES[name]} has {each['tasks']} ids of tasks."
                  for name, each in results.items() if "tasks" in each)  # fmt: skip
    rest = max(row["rest"] for row in results["tca-mj"]["soft"])
    kept = ", ".join(f"{name} {number}" for name, number in made.items())
    return pages.page(
        tables(sets["soft"], sets["stiff"], tasks),
        f"From importing to the first result, compiling and all: {', '.join(firsts)}."
        f" tca-mj's `settle` finds the rest itself, in {ms(rest)} ms at most.{ids}",
        f"The others: {kept}.",
        pages.made_with({"machine": machine(), "versions": versions()}),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("packages", nargs="*", metavar="PACKAGE=PYTHON")
    for each in parser.parse_args().packages:
        name, _, python = each.partition("=")
        if name not in NAMES:
            parser.error(f"packages must be of {', '.join(NAMES)}, got {name}")
        print(f"measures {name}", flush=True)
        write_whole(KEPT / f"{name}.json", json.dumps(measured(name, python)).encode())
    results = {name: json.loads((KEPT / f"{name}.json").read_text("utf-8")) for name in NAMES
               if (KEPT / f"{name}.json").exists()}  # fmt: skip
    if "tca-mj" not in results:
        parser.error("packages must have had tca-mj once")
    head = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    write_whole(PAGE, f"{head}{MARK}\n\n{page(results)}\n".encode())


if __name__ == "__main__":
    main()

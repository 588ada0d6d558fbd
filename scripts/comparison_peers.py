"""What of other packages is measured for docs/comparison.md, run by a Python that has one of them.

    OTHER/bin/python scripts/comparison_peers.py pyelastica CASES.json     prints results as JSON

``scripts/comparison_page.py`` writes the cases and calls this; nothing of tca-mj is imported.
Times are of the processor, and what was compiled before is not in them.
"""

import argparse
import json
import os
import time
from typing import Any

import numpy as np


def step_time(env: Any) -> float:
    """Processor time of a step of a task that was reset, with random actions [s]."""
    for count in (100, 3000):
        clock = time.process_time()
        for _ in range(count):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                env.reset()
    return (time.process_time() - clock) / count


def frequency(case: dict[str, Any]) -> float:
    """Of the first bending mode of the unloaded rod [rad/s]."""
    section = np.pi * case["radius"] ** 2
    bending = case["young"] * section * case["radius"] ** 2 / 4.0
    return 3.516 * float(np.sqrt(bending / (case["density"] * section)) / case["length"] ** 2)


def off(case: dict[str, Any], load: dict[str, Any], across: float, along: float) -> float:
    """Distance of a tip from the exact one, in % of the length."""
    gap = np.hypot(across - load["across"], along - load["along"])
    return float(100.0 * gap / case["length"])


def pyelastica(case: dict[str, Any]) -> dict[str, Any]:
    """A rod of PyElastica that is clamped, loaded at its tip and left alone, explicitly in time.

    ``as documented`` its first node and first director are held, as in its examples: half an
    element does not bend. ``from the middle`` the rod begins half an element behind the clamp.
    """
    begun = time.process_time()
    import elastica as ea
    from elastica.timestepper import integrate

    class System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
        pass

    def run(pieces: int, force: float, step: float, behind: bool, seconds: float) -> Any:
        length = case["length"] * (pieces / (pieces - 0.5) if behind else 1.0)
        start = np.array([0.0, 0.0, case["length"] - length])
        system = System()
        rod = ea.CosseratRod.straight_rod(
            pieces, start, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), length,
            case["radius"], case["density"], youngs_modulus=case["young"],
            shear_modulus=case["shear"],
        )  # fmt: skip
        system.append(rod)
        system.constrain(rod).using(
            ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        system.add_forcing_to(rod).using(
            ea.EndpointForces, np.zeros(3), np.array([force, 0.0, 0.0]), ramp_up_time=0.1
        )
        system.dampen(rod).using(
            ea.AnalyticalLinearDamper, uniform_damping_constant=2.0 * frequency(case),
            time_step=step,
        )  # fmt: skip
        system.finalize()
        clock = time.process_time()
        steps = round(seconds / step)
        integrate(ea.PositionVerlet(), system, seconds, steps, progress_bar=False)
        return rod.position_collection[:, -1].copy(), (time.process_time() - clock) / seconds

    run(5, 0.0, case["steps"][-1], False, 0.01)
    first, rows = time.process_time() - begun, []
    for behind in (False, True):
        for load in case["loads"]:
            for pieces in case["pieces"]:
                for step in case["steps"]:  # the largest that is stable
                    tip, cost = run(pieces, load["force"], step, behind, case["seconds"])
                    error = off(case, load, tip[0], tip[2])
                    if np.isfinite(tip).all() and error < 25.0:
                        break
                kind = "from the middle" if behind else "as documented"
                rows.append({"kind": kind, "load": load["name"], "pieces": pieces, "error": error,
                             "step": step, "cost": cost})  # fmt: skip
    return {"first": first, "rows": rows}


def soromox(case: dict[str, Any]) -> dict[str, Any]:
    """A plane rod of SoRoMoX, of pieces of constant strain: at rest by Newton's method.

    Its cost in time is that of swinging freely from there, for a third of the first period, without
    damping, which would make an explicit solver's steps smaller.
    """
    os.environ["JAX_PLATFORMS"] = "cpu"
    begun = time.process_time()
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    from soromox.systems.components.links import LinkSpec
    from soromox.systems.pcs.planar_pcs import PlanarPCS

    rows: list[dict[str, Any]] = []
    first = 0.0
    end = jnp.array(case["length"])
    for pieces in case["pieces"]:
        link = LinkSpec.circular(
            radius=case["radius"], length=case["length"] / pieces, density=case["density"],
            reference_strain=[0.0, 1.0, 0.0], young_modulus=case["young"],
            shear_modulus=case["shear"],
        )  # fmt: skip
        robot = PlanarPCS.from_links(
            [link] * pieces, gravity=jnp.zeros(2), base_pose=jnp.zeros(3)
        )

        def energy(q: Any, force: Any, robot: Any = robot) -> Any:
            return robot.elastic_energy(q) - force * robot.forward_kinematics(q, end)[2]

        slope, curve = jax.jit(jax.grad(energy)), jax.jit(jax.hessian(energy))
        q = jnp.zeros(robot.num_coordinates)
        slope(q, 0.0).block_until_ready(), curve(q, 0.0).block_until_ready()
        first = first or time.process_time() - begun

        def swing(time_now: Any, y: Any, unused: Any, robot: Any = robot) -> Any:
            return robot.forward_dynamics(time_now, y, (jnp.zeros(robot.num_actuators),))

        def solved(y: Any, swing: Any = swing) -> Any:
            return diffrax.diffeqsolve(
                diffrax.ODETerm(swing), diffrax.Tsit5(), 0.0, case["seconds"] / 8.0, 1e-4, y,
                stepsize_controller=diffrax.PIDController(rtol=1e-3, atol=1e-5),
                max_steps=200_000,
            ).ys  # fmt: skip

        run = jax.jit(solved)
        for load in case["loads"]:
            q = jnp.zeros(robot.num_coordinates)
            for force in np.linspace(0.1, 1.0, 10) * load["force"]:
                for _ in range(30):
                    change = jnp.linalg.solve(curve(q, force), slope(q, force))
                    q = q - change
                    if float(jnp.abs(change).max()) < 1e-10:
                        break
            _, along, across = np.array(robot.forward_kinematics(q, end))
            y = jnp.concatenate([q, jnp.zeros_like(q)])
            run(y).block_until_ready()
            clock = time.process_time()
            run(y).block_until_ready()
            cost = 8.0 * (time.process_time() - clock) / case["seconds"]
            rows.append({"kind": "plane", "load": load["name"], "pieces": pieces,
                         "error": off(case, load, across, along), "cost": cost})  # fmt: skip
    return {"first": first, "rows": rows}


def myosuite(case: dict[str, Any]) -> dict[str, Any]:
    """Steps of the smallest task of MyoSuite, with random actions."""
    begun = time.process_time()
    from myosuite import make_env, myosuite_env_suite

    env = make_env("myoElbowPose1D6MRandom-v0")
    env.reset(seed=0)
    first = time.process_time() - begun
    return {"first": first, "tasks": len(myosuite_env_suite), "period": float(env.unwrapped.dt),
            "cost": step_time(env)}  # fmt: skip


def main() -> None:
    from importlib.metadata import version

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=("pyelastica", "soromox", "myosuite"))
    parser.add_argument("path", help="the cases, a JSON file")
    asked = parser.parse_args()
    name, path = asked.name, asked.path
    with open(path, encoding="utf-8") as file:
        case = json.load(file)[name]
    result = {"pyelastica": pyelastica, "soromox": soromox, "myosuite": myosuite}[name](case)
    others = {"pyelastica": ("numba",), "soromox": ("jax",), "myosuite": ("mujoco", "gymnasium")}
    result["versions"] = {each: version(each) for each in (name, *others[name], "numpy")}
    print("result:", json.dumps(result))


if __name__ == "__main__":
    main()

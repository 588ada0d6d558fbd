"""Compares our chain with MuJoCo's own cable against closed forms, as a Markdown table.

    python scripts/cable_comparison.py

The cable is ``<composite type="cable">`` with the plugin mujoco.elasticity.cable. Where the
installed MuJoCo has no such plugin, as from version 4 on, its columns stay empty.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np

from tca_mj.certify.cable import (
    BEAM,
    EI,
    FORCE,
    LENGTH,
    MOMENT,
    cable,
    cable_tip,
    force_tip,
    moment_tip,
    off,
)
from tca_mj.machine import machine
from tca_mj.model import settle
from tca_mj.model.chain import add_chain
from tca_mj.model.part import new_spec
from tca_mj.pages import command_line

NODES = (4, 8, 16, 32)
LIGHT = 1e-4  # damping time where stability is measured [s]
SERIES = (0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # [s]


def chain_model(nodes: int, timestep: float, scale: float = 1.0) -> mujoco.MjModel:
    """Our chain without TCAs."""
    spec = new_spec("chain")
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.timestep = timestep
    body = replace(
        BEAM,
        bending=(scale * EI, scale * EI),
        torsion=scale * BEAM.torsion,
        stretching=scale * BEAM.stretching,
        damping_time=LIGHT,
    )
    add_chain(spec.worldbody, body, nodes=nodes, name="body", collide=False)
    return spec.compile()


def microseconds(model: mujoco.MjModel, steps: int = 2000) -> float:
    """Processor time of a step, the best of five."""
    data = mujoco.MjData(model)
    best = np.inf
    for _ in range(5):
        begin = time.thread_time()
        mujoco.mj_step(model, data, steps)
        best = min(best, time.thread_time() - begin)
    return 1e6 * best / steps


def survives(model: mujoco.MjModel) -> bool:
    """Whether a beam that was hit does not swing wider and wider for half a second."""
    data = mujoco.MjData(model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    slide = model.jnt_type[model.dof_jntid] == int(mujoco.mjtJoint.mjJNT_SLIDE)
    data.qvel[:] = np.where(slide, 1e-4, 1.0) * np.random.default_rng(0).standard_normal(model.nv)
    for _ in range(max(1, round(0.5 / model.opt.timestep))):
        mujoco.mj_step(model, data)
        if not np.abs(data.qvel).max() < 100.0:
            return False
    return True


def largest_timestep(build: Callable[[float], mujoco.MjModel | None]) -> str:
    """Largest stable time step [ms] of a coarse series."""
    for timestep in SERIES:
        model = build(timestep)
        if model is None:
            return "-"
        if survives(model):
            return f"{1e3 * timestep:g} ms"
    return f"below {1e3 * SERIES[-1]:g} ms"


def percent(tip: np.ndarray | None, theory: np.ndarray) -> str:
    error = off(tip, theory)
    return "-" if error is None else f"{100.0 * error:.2f} %"


def table() -> str:
    """Errors of the tip over the length, time of a step, and largest time steps."""
    lines = [
        "| nodes | chain: 90° by a moment | cable | chain: elastica, PL²/EI = 10 | cable"
        " | chain: µs per step | cable: µs per step |",
        "|---|---|---|---|---|---|---|",
    ]
    stiff = replace(BEAM, stretching=1e6 * BEAM.stretching)
    none = np.zeros(3)
    for nodes in NODES:
        moment, force = np.array([0.0, MOMENT, 0.0]), np.array([0.0, FORCE, 0.0])
        bent = settle(stiff, [], [], nodes=nodes, tip_moment=moment).tip
        pushed = settle(stiff, [], [], nodes=nodes, tip_force=force).tip
        model = cable(nodes, timestep=1e-4, damping=1e-9)
        cells = [
            percent(bent, moment_tip()),
            percent(cable_tip(nodes, none, moment), moment_tip()),
            percent(pushed, force_tip()),
            percent(cable_tip(nodes, force, none), force_tip()),
            f"{microseconds(chain_model(nodes, 2e-3)):.0f}",
            "-" if model is None else f"{microseconds(model):.0f}",
        ]
        lines.append(f"| {nodes} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def limits(nodes: int = 16) -> str:
    """Largest stable time steps, lightly damped, for silicone and for a stiff spine."""
    lines = [f"| {nodes} nodes | E = 0.125 MPa | E = 125 MPa |", "|---|---|---|"]
    for name, integrator in (
        ("chain, discrete", None),
        ("cable, Euler", "Euler"),
        ("cable, implicitfast", "implicitfast"),
        ("cable, discrete", "discrete"),
    ):
        cells = []
        for scale in (1.0, 1000.0):
            damping = LIGHT * scale * EI * nodes / LENGTH

            def build(
                h: float,
                kind: str | None = integrator,
                scale: float = scale,
                damping: float = damping,
            ) -> mujoco.MjModel | None:
                if kind is None:
                    return chain_model(nodes, h, scale)
                return cable(nodes, timestep=h, damping=damping, integrator=kind, scale=scale)

            cells.append(largest_timestep(build))
        lines.append(f"| {name} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines)


def main() -> None:
    command_line(__doc__).parse_args()
    where = machine()
    print(f"MuJoCo {mujoco.__version__}, {where['cpu']}, one core\n")
    if cable(4, timestep=1e-3, damping=1e-6) is None:
        print("This MuJoCo has no plugin mujoco.elasticity.cable: its columns stay empty.\n")
    print(table(), "\nLargest stable time step of a series [ms]:\n", limits(), sep="\n")
    stretch = settle(BEAM, [], [], nodes=8, tip_force=(0.0, 0.0, 0.1)).tip[2] / LENGTH - 1.0
    print(f"\nStretch under 0.1 N: chain {100 * stretch:.2f} %, theory"
          f" {100 * 0.1 / BEAM.stretching:.2f} %, cable 0 %.")  # fmt: skip


if __name__ == "__main__":
    main()

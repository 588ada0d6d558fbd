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
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

from tca_mj.machine import machine
from tca_mj.model import settle
from tca_mj.model.chain import beam
from tca_mj.model.part import new_spec
from tca_mj.rod import BeamSpec

# The bending module's section of Ecoflex 00-30: a cable of capsules has the same EI and GJ.
YOUNG, DIAMETER, DENSITY = 0.125e6, 4.5e-3, 1070.0
BEAM = BeamSpec.circular(
    length=45e-3, diameter=DIAMETER, young=YOUNG, shear=YOUNG / 3.0, density=DENSITY
)
LENGTH, EI = BEAM.length, BEAM.bending[0]
MOMENT = 0.5 * np.pi * EI / LENGTH  # bends by 90°
FORCE = 10.0 * EI / LENGTH**2
NODES = (4, 8, 16, 32)
LIGHT = 1e-4  # damping time where stability is measured [s]
SERIES = (0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # [s]

CABLE = """
<mujoco>
  <extension><plugin plugin="mujoco.elasticity.cable"/></extension>
  <option gravity="0 0 0" timestep="{timestep}" integrator="{integrator}"/>
  <worldbody><body name="base">
    <composite type="cable" prefix="c" curve="0 0 s" count="{points} 1 1" size="{length} 1 1"
               initial="none">
      <plugin plugin="mujoco.elasticity.cable">
        <config key="bend" value="{young}"/><config key="twist" value="{shear}"/>
      </plugin>
      <joint kind="main" damping="{damping}"/>
      <geom type="capsule" size="{radius}" density="{density}" contype="0" conaffinity="0"/>
    </composite>
  </body></worldbody>
</mujoco>
"""


def cable(
    bodies: int,
    *,
    timestep: float,
    damping: float,
    integrator: str = "implicitfast",
    scale: float = 1.0,
) -> mujoco.MjModel | None:
    """A cable of so many rigid bodies, clamped at its base along z, or None without the plugin."""
    text = CABLE.format(
        timestep=timestep, integrator=integrator, points=bodies + 1, length=LENGTH,
        young=scale * YOUNG, shear=scale * YOUNG / 3.0, damping=damping,
        radius=DIAMETER / 2.0, density=DENSITY,
    )  # fmt: skip
    try:
        return mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        if "plugin" in str(error) or "composite" in str(error):
            return None
        raise


def moment_tip() -> np.ndarray:
    """Tip of the quarter circle."""
    return 2.0 * LENGTH / np.pi * np.array([1.0, 0.0, 1.0])


def force_tip() -> np.ndarray:
    """Tip of the elastica under a force along y (Bisshopp & Drucker, 1945)."""
    load = FORCE * LENGTH**2 / EI

    def gap(angle: float) -> float:
        m = (1.0 + np.sin(angle)) / 2.0
        return float(ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m) - np.sqrt(load))

    sine = np.sin(brentq(gap, 1e-6, 0.5 * np.pi - 1e-9, xtol=1e-14))
    node, weight = np.polynomial.legendre.leggauss(200)
    root = np.sqrt(sine) * (node + 1.0) / 2.0
    slope = sine - root**2
    across = np.sqrt(0.5 * sine / load) * (weight @ (slope / np.sqrt(1.0 - slope**2)))
    return LENGTH * np.array([0.0, across, np.sqrt(2.0 * sine / load)])


def cable_tip(bodies: int, force: np.ndarray, moment: np.ndarray) -> np.ndarray | None:
    """Tip of the loaded cable at rest: Newton on the joint loads, the load in ten parts."""
    model = cable(bodies, timestep=1e-3, damping=0.0)
    if model is None:
        return None
    data = mujoco.MjData(model)
    tip = model.site("cS_last").id
    body = int(model.site_bodyid[tip])

    def unbalanced(share: float, position: np.ndarray) -> np.ndarray:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = position, 0.0, 0.0
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_applyFT(
            model, data, share * force, share * moment, data.site_xpos[tip], body,
            data.qfrc_applied,
        )  # fmt: skip
        mujoco.mj_forward(model, data)
        return data.qfrc_smooth.copy()

    position = data.qpos.copy()
    for share in np.linspace(0.1, 1.0, 10):
        for _ in range(20):
            now = unbalanced(share, position)
            if np.abs(now).max() < 1e-9 * EI / LENGTH:
                break
            slope = np.empty((model.nv, model.nv))
            for i in range(model.nv):
                moved, push = position.copy(), np.zeros(model.nv)
                push[i] = 1e-6
                mujoco.mj_integratePos(model, moved, push, 1.0)
                slope[:, i] = (unbalanced(share, moved) - now) / 1e-6
            mujoco.mj_integratePos(model, position, -np.linalg.solve(slope, now), 1.0)
        else:
            raise ArithmeticError(f"a cable of {bodies} bodies does not come to rest")
    unbalanced(1.0, position)
    return data.site_xpos[tip].copy()


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
    beam(spec.worldbody, body, nodes=nodes, name="body", collide=False)
    return spec.compile()


def microseconds(model: mujoco.MjModel, steps: int = 2000) -> float:
    """Time of a step, the best of five."""
    data = mujoco.MjData(model)
    best = np.inf
    for _ in range(5):
        begin = time.perf_counter()
        mujoco.mj_step(model, data, steps)
        best = min(best, time.perf_counter() - begin)
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
            return f"{1e3 * timestep:g}"
    return f"below {1e3 * SERIES[-1]:g}"


def percent(tip: np.ndarray | None, theory: np.ndarray) -> str:
    if tip is None:
        return "-"
    # The cable's frames are turned about its axis: only along and across count.
    across = np.hypot(tip[0], tip[1]) - np.hypot(theory[0], theory[1])
    return f"{100.0 * np.hypot(across, tip[2] - theory[2]) / LENGTH:.2f}"


def table() -> str:
    """Errors of the tip in % of the length, time of a step, and largest time steps."""
    lines = [
        "| nodes | chain: 90° by a moment | cable | chain: elastica, PL²/EI = 10 | cable"
        " | chain: µs per step | cable |",
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

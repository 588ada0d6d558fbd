"""MuJoCo's own cable, against which the chain is checked, and closed forms for both.

The cable is ``<composite type="cable">`` with the plugin mujoco.elasticity.cable. MuJoCo 4 no
longer has it.
"""

import mujoco
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

from tca_mj.checks import Array
from tca_mj.model.mujoco_warnings import count_warnings
from tca_mj.rod import BeamSpec

# The bending module's section of Ecoflex 00-30: a cable of capsules has the same EI and GJ.
YOUNG, DIAMETER, DENSITY = 0.125e6, 4.5e-3, 1070.0
BEAM = BeamSpec.circular(
    length=45e-3, diameter=DIAMETER, young=YOUNG, shear=YOUNG / 3.0, density=DENSITY
)
LENGTH, EI = BEAM.length, BEAM.bending[0]
MOMENT = 0.5 * np.pi * EI / LENGTH  # bends by 90° [N m]
FORCE = 10.0 * EI / LENGTH**2  # [N]

_CABLE = """
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
    bodies: int, *, timestep: float, damping: float, integrator: str = "implicitfast",
    scale: float = 1.0,
) -> mujoco.MjModel | None:  # fmt: skip
    """A cable of so many rigid bodies, clamped at its base along z, or None without the plugin.

    Args:
        bodies: Number of bodies.
        timestep: Time step [s].
        damping: Damping of its joints [N m s/rad].
        integrator: MuJoCo's name of it.
        scale: Stiffness over that of ``BEAM``.
    """
    text = _CABLE.format(
        timestep=timestep, integrator=integrator, points=bodies + 1, length=LENGTH,
        young=scale * YOUNG, shear=scale * YOUNG / 3.0, damping=damping,
        radius=DIAMETER / 2.0, density=DENSITY,
    )  # fmt: skip
    count_warnings()
    try:
        return mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        if "plugin" in str(error) or "composite" in str(error):
            return None
        raise


def moment_tip() -> Array:
    """Tip of the quarter circle, shape (3,) [m]."""
    return 2.0 * LENGTH / np.pi * np.array([1.0, 0.0, 1.0])


def force_tip() -> Array:
    """Tip of the elastica under a force along y (Bisshopp & Drucker, 1945), shape (3,) [m]."""
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


def cable_tip(bodies: int, force: Array, moment: Array) -> Array | None:
    """Tip of the loaded cable at rest: Newton on the joint loads, the load in ten parts.

    Args:
        bodies: Number of bodies.
        force: Force on the tip, shape (3,) [N].
        moment: Moment on the tip, shape (3,) [N m].

    Returns:
        The tip, shape (3,) [m], or None without the plugin.

    Raises:
        ArithmeticError: If it does not come to rest.
    """
    model = cable(bodies, timestep=1e-3, damping=0.0)
    if model is None:
        return None
    data = mujoco.MjData(model)
    tip = model.site("cS_last").id
    body = int(model.site_bodyid[tip])

    def unbalanced(share: float, position: Array) -> Array:
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


def off(tip: Array | None, exact: Array) -> float | None:
    """Distance of a tip from where it should be, over the length.

    The cable's frames are turned about its axis: only along and across count.
    """
    if tip is None:
        return None
    across = np.hypot(tip[0], tip[1]) - np.hypot(exact[0], exact[1])
    return float(np.hypot(across, tip[2] - exact[2]) / LENGTH)

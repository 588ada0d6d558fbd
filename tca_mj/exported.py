"""A built part as one MJCF file for plain MuJoCo: its TCAs pull as they do at given temperatures.

In a simulation the TCAs' law is handed to MuJoCo anew every few milliseconds, and so are the
springs that make polylines stand for smooth curves (``tca_mj.model.smooth``). The file holds both
as they are at rest at these temperatures, linear in the tendons' lengths; at that rest they are
exact, and about it they are as good as a tangent. Heat, and what it changes, is none of it.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import door, floats, shown
from tca_mj.drive import SimulationDiverged
from tca_mj.files import write_whole
from tca_mj.model.part import Part
from tca_mj.sim import Simulation

REST = "rest"  # the keyframe of the rest that was found
_STILL = 1e-2  # velocity with which MuJoCo's solver lets a joint creep at rest [rad/s, m/s]


@door
def export(
    part: Part, path: str | Path | None = None, *, temperatures: ArrayLike | None = None
) -> str:
    """Writes a part as MJCF whose TCAs pull with their law frozen at temperatures.

    The part is led to rest at them, from its unloaded shape, a part on a free joint without weight,
    which the file has again. The file has that rest as the keyframe
    ``rest``; from any other place near it MuJoCo comes there by itself.

    Args:
        part: What is exported; it stays as it is.
        path: The file; None to return the text only.
        temperatures: Temperatures of the n TCAs, shape (n,), or one for all; None for those of the
            surroundings [°C].

    Returns:
        The text of the file.

    Raises:
        ValueError: If the temperatures have the wrong shape or are below the surroundings'.
        OSError: If the file cannot be written.
        SimulationDiverged: If there is no rest at them.
    """
    own = part.copy()
    sim = Simulation(own)
    ambient = np.broadcast_to(sim.bank.heat.ambient, sim.n)
    if (sim.model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)).any():
        sim.model.opt.gravity[:] = 0.0  # nothing holds it: its shape as it floats
    asked = floats("temperatures", ambient if temperatures is None else temperatures)
    if asked.shape not in ((), (sim.n,)):
        raise ValueError(f"temperatures must be one or {sim.n}, got {shown(temperatures)}")
    left = sim.rest(asked)
    if left > _STILL:
        raise SimulationDiverged(
            f"the part does not come to rest at temperatures {temperatures!r}: a joint still moves"
            f" at {left:.3g} rad/s or m/s"
        )
    return frozen(sim, own.spec, path)


@door
def frozen(sim: Simulation, spec: mujoco.MjSpec, path: str | Path | None = None) -> str:
    """``export`` of a simulation as it is now.

    Args:
        sim: The simulation.
        spec: What it was compiled from; the law and the springs are written to it.
        path: The file; None to return the text only.

    Raises:
        ValueError: If it is another specification.
        OSError: If the file cannot be written.
    """
    model = sim.model
    if not all(spec.actuator(name) for name in sim.tca_names) or len(spec.joints) != model.njnt:
        raise ValueError(f"spec must be what sim was compiled from, got {spec.modelname!r}")
    for joint in spec.joints:
        number = joint.id
        if model.jnt_type[number] < int(mujoco.mjtJoint.mjJNT_SLIDE):
            continue  # free or a ball
        joint.stiffness[0] = model.jnt_stiffness[number]
        joint.springref = model.qpos_spring[model.jnt_qposadr[number]]
        joint.damping[0] = model.dof_damping[model.jnt_dofadr[number]]
    for name, number in zip(sim.tca_names, sim.actuator, strict=True):
        spec.actuator(name).biasprm = model.actuator_biasprm[number]
    (spec.key(REST) or spec.add_key(name=REST)).qpos = sim.data.qpos
    text: str = spec.to_xml()
    if path is not None:
        write_whole(Path(path), text.encode())
    return text

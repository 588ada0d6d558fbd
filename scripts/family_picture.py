"""Draws docs/pictures/family.png: all modules and robots side by side.

    MUJOCO_GL=egl python scripts/family_picture.py

Another one is one more line of ``family``.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import imageio.v3 as imageio
import mujoco
import numpy as np
from beyond_page import Course, view
from matplotlib.figure import Figure

import tca_mj
from tca_mj.modules import shaped
from tca_mj.pages import folder_of_pictures

_COLD, _ABREAST, _PIXELS = 25.0, 5, (400, 340)
_U, _DOME = math.radians(135.0), math.radians(-30.0)


class Shown(NamedTuple):
    """One of the family.

    Attributes:
        name: What stands below it.
        build: What builds it.
        hot: Temperatures of its TCAs, or one for all [°C].
        look: From where the camera looks, and how high: azimuth and elevation [deg].
        fixed: Bend that each chain with a spine is fixed in, if any [rad].
        soft: Whether its spines are soft while its TCAs are hot, and cold when it is drawn.
        snapped: Its bistable modules, and the state in which they are, 0 or 2, if it has such.
        away: Distance of the camera over the diagonal of what it looks at.
    """

    name: str
    build: Callable[[], tca_mj.Part]
    hot: float | Sequence[float] = _COLD
    look: tuple[float, float] = (90.0, -12.0)
    fixed: float = 0.0
    soft: bool = False
    snapped: tuple[tca_mj.BistableSpec, int] | None = None
    away: float = 1.15


def family() -> tuple[Shown, ...]:
    """All of them, one a line."""
    twist, space, grid = (
        tca_mj.TwistMorphingSpec(nodes=24), tca_mj.Morphing3dSpec(), tca_mj.MorphingGridSpec()
    )  # fmt: skip
    return (
        Shown("bending module", tca_mj.bending_module, [105.0, 25.0, 25.0], (90, -10)),
        Shown("twisting module", tca_mj.twisting_module, 110.0, (70, -15)),
        Shown("innervated finger", tca_mj.innervated_finger, [95.0, 95.0, 25.0], (90, -10)),
        Shown("bistable module", tca_mj.bistable_module, _COLD, (90, -10),
              snapped=(tca_mj.BistableSpec(), 2)),
        Shown("continuum leg", tca_mj.continuum_leg, [110.0, 25.0, 25.0], (60, -10)),
        Shown("arm", tca_mj.arm, _COLD, (110, -10)),
        Shown("gripper", tca_mj.gripper, 60.0, (110, 5), away=0.85),
        Shown("adaptive gripper", tca_mj.adaptive_gripper, _COLD, (105, 0), _U),
        Shown("tetrapod", tca_mj.tetrapod, _COLD, (125, -22), away=1.0),
        Shown("jumper", tca_mj.jumper, _COLD, (90, -15), snapped=(tca_mj.JumperSpec().module, 0)),
        Shown("bistable gripper", tca_mj.bistable_gripper, _COLD, (105, 0),
              snapped=(tca_mj.BistableGripperSpec().finger, 0)),
        Shown("morphing module", tca_mj.morphing_module, _COLD, (170, -10), _U),
        Shown("morphing module that twists", lambda: tca_mj.twist_morphing_module(twist),
              [twist.temperature_for(-0.5 * math.pi)], (100, -12), soft=True, away=1.35),
        Shown("... that bends to any side", lambda: tca_mj.morphing_3d_module(space),
              space.temperatures(0.6, 1.8), (100, -25), soft=True),
        Shown("grid of morphing modules", lambda: tca_mj.morphing_grid(grid),
              tuple(grid.temperatures(_DOME, _DOME)), (120, -22), soft=True),
    )  # fmt: skip


def drawn(one: Shown) -> np.ndarray:
    """A picture of one."""
    course = Course(one.build())
    sim = course.sim
    hot = np.broadcast_to(np.asarray(one.hot, dtype=float), sim.n)
    if one.fixed:
        joints = [name for spine in one.build().spines for name, _ in spine.joints]
        bends = [name for name in joints if "bend_x" in name]

        def place(data: mujoco.MjData) -> None:
            for name in bends:
                data.qpos[sim.model.joint(name).qposadr[0]] = one.fixed / len(bends)

        sim.reset(place)
    elif one.snapped:
        module, state = one.snapped
        bend = module.rod.states()[state]
        nodes = [i for i in range(sim.model.njnt) if "bend_y" in sim.model.joint(i).name]

        def snap(data: mujoco.MjData) -> None:
            shape = shaped(module, bend)
            data.qpos[sim.model.jnt_qposadr[nodes]] = np.tile(shape, len(nodes) // len(shape))
            if sim.model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE:  # lies on its two ends
                data.qpos[3:7] = math.cos(bend / 4.0), 0.0, math.sin(bend / 4.0), 0.0

        sim.reset(snap)
    elif one.soft:
        course.soften()
        course.deform(hot)
        course.harden()
    elif (hot > _COLD).any():
        for share in np.linspace(0.1, 1.0, 10):
            power = sim.keep(_COLD + share * (hot - _COLD))
            sim.step(power, 0.1)
        sim.step(power, 1.5)
    mujoco.mj_forward(sim.model, sim.data)
    reach = sim.model.geom_rbound[:, None]
    low, high = (sim.data.geom_xpos - reach).min(axis=0), (sim.data.geom_xpos + reach).max(axis=0)
    away = one.away * float(np.linalg.norm(high - low))
    return course.shot(view((low + high) / 2.0, away, *one.look), *_PIXELS)


def main() -> None:
    out = folder_of_pictures(__doc__, Path(__file__).parents[1] / "docs/pictures")
    if out is None:
        raise SystemExit("this script has no tables")
    width, height = _PIXELS
    every = family()
    deep = -(-len(every) // _ABREAST)
    figure = Figure(figsize=(_ABREAST * width / 100, deep * (height + 30) / 100), dpi=100)
    axes = figure.subplots(deep, _ABREAST, squeeze=False).ravel()
    figure.subplots_adjust(left=0, right=1, bottom=30 / (deep * (height + 30)), top=1,
                           wspace=0.01, hspace=30 / height)  # fmt: skip
    for axis in axes:
        axis.set_axis_off()
    for axis, one in zip(axes, every, strict=False):
        axis.imshow(drawn(one))
        axis.set_title(one.name, y=-0.09, fontsize=13)
    figure.savefig(out / "family.png", dpi=70)
    picture = imageio.imread(out / "family.png")
    print(out / "family.png", picture.shape)


if __name__ == "__main__":
    main()

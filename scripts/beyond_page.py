"""Draws docs/pictures/beyond_*.png of docs/beyond.md; --tables prints its tables instead.

    MUJOCO_GL=egl python scripts/beyond_page.py

Without a way to OpenGL only the tables can be had. A minute or two of one core.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj import (
    Morphing3dSpec,
    MorphingGridSpec,
    Part,
    Simulation,
    TwistMorphingSpec,
    morphing_3d_module,
    morphing_grid,
    pages,
    twist_morphing_module,
)
from tca_mj.certify.grids import lattices
from tca_mj.certify.outcomes import Effort, outcomes
from tca_mj.pages import folder_of_pictures
from tca_mj.record.render import Offscreen, colour_tendons
from tca_mj.smp import HOLD_TEMPERATURE, fixity

_COLD = 25.0  # [°C]
_DOWN = (0.0, 1.0, 0.0, 0.0)  # half a turn about x
_TWISTS, _SIDES = (-45.0, -90.0, -180.0), ((0.0, 60.0), (60.0, 90.0), (150.0, 120.0))
_GRIDS = {"vault": (40.0, 0.0), "dome": (-30.0, -30.0), "saddle": (30.0, -30.0)}

# What is compared with the theory of rods.
CERTIFIED = {
    "morphing": "the published module, soft", "morphing-cold": "fixed at 180°",
    "morphing-twist": "soft", "morphing-twist-cold": "fixed at -90°", "morphing-3d": "soft",
    "morphing-3d-cold": "fixed at 90° between two TCAs",
    "grid-member": "soft, with a junction at its end",
    "soft-finger": "finger of the adaptive gripper",
    "adaptive-gripper": "its base hardened at 180°",
}  # fmt: skip


class Course:
    """A part that is softened, deformed, hardened, left alone and heated again."""

    def __init__(self, part: Part) -> None:
        part.spec.option.gravity = [0.0, 0.0, 0.0]
        # Shapes at rest are asked for, and no motion: a long time step.
        self.sim = Simulation(part, timestep=20e-3, tca_period=0.1)
        self.off = np.zeros(self.sim.n)

    def _spines(self, temperature: float) -> None:
        """Spines at a temperature at once: glass forms and melts at the shape of the moment."""
        spines = self.sim.spines
        assert spines.state is not None
        heat = replace(spines.state.heat, temperature=np.full(spines.n, temperature))
        spines.state = replace(spines.state, heat=heat)
        heater = spines.bank.heater
        self.volts = np.sqrt((temperature - _COLD) * heater.loss * heater.resistance)

    def soften(self) -> None:
        """As 9.5 V hold it."""
        self._spines(HOLD_TEMPERATURE)
        self.sim.step(self.off, 0.5, voltage=self.volts)

    def deform(self, temperatures: Sequence[float] | NDArray[np.float64]) -> None:
        """Heats the TCAs in two seconds and lets everything settle."""
        told = np.asarray(temperatures)
        for share in np.linspace(0.05, 1.0, 20):
            self.power = self.sim.keep(_COLD + share * (told - _COLD))
            self.sim.step(self.power, 0.1, voltage=self.volts)
        self.sim.step(self.power, 10.0, voltage=self.volts)

    def harden(self) -> None:
        """Cold spines while the TCAs hold; then everything is off and cold."""
        self._spines(_COLD)
        self.sim.step(self.power, 0.5)
        if self.sim.spines.damaged.any():
            raise SystemExit("a TCA was damaged")
        self.sim.step(self.sim.keep(np.full(self.sim.n, _COLD)), 1.5)

    def recover(self) -> None:
        """The heaters alone."""
        self._spines(HOLD_TEMPERATURE)
        self.sim.step(self.off, 6.0, voltage=self.volts)

    @property
    def tip(self) -> NDArray[np.float64]:
        """Rotation of the tip."""
        return self.sim.data.body("tip").xmat.reshape(3, 3).copy()

    def shot(self, camera: mujoco.MjvCamera, width: int, height: int) -> NDArray[np.uint8]:
        """A picture, in the colours of the temperatures."""
        sim, model = self.sim, self.sim.model
        mujoco.mj_forward(model, sim.data)
        colour_tendons(model, sim.tendon, sim.temperature)
        warm = float(sim.spines.temperature.max(initial=_COLD))
        heat = np.clip((warm - _COLD) / 95.0, 0.0, 1.0)
        cold, hot = np.array([0.86, 0.74, 0.48]), np.array([0.9, 0.25, 0.12])
        polymer = [i for i in range(model.ngeom) if "polymer" in model.geom(i).name]
        model.geom_rgba[polymer, :3] = cold + heat * (hot - cold)
        with Offscreen(
            model, width=width, height=height, camera=camera, coils=sim.tendon
        ) as screen:
            return screen.draw(sim.data)


def view(
    at: Sequence[float], distance: float, azimuth: float, elevation: float
) -> mujoco.MjvCamera:
    """A camera that looks at a place [m]; angles in degrees."""
    camera = mujoco.MjvCamera()
    camera.lookat[:] = at
    camera.distance, camera.azimuth, camera.elevation = distance, azimuth, elevation
    return camera


def flagged(part: Part) -> Part:
    """With a flag at the tip, that is seen and nothing else."""
    part.spec.body("tip").add_geom(
        name="flag", type=mujoco.mjtGeom.mjGEOM_BOX, size=[7e-3, 0.4e-3, 3e-3],
        pos=[7e-3, 0.0, 3e-3], rgba=[0.1, 0.45, 0.65, 1.0], contype=0, conaffinity=0, mass=0.0,
    )  # fmt: skip
    return part


def turned(tip: NDArray[np.float64]) -> float:
    """Turn about z [deg]."""
    return math.degrees(math.atan2(tip[1, 0], tip[0, 0]))


def bent(tip: NDArray[np.float64]) -> tuple[float, float]:
    """Bend, and the side to which it goes [deg]."""
    x, y, z = tip[:, 2]
    return math.degrees(math.atan2(math.hypot(x, y), z)), math.degrees(math.atan2(y, x))


def places(sim: Simulation, spec: MorphingGridSpec) -> NDArray[np.float64]:
    """Middles of the junctions of a grid [m]."""
    mujoco.mj_forward(sim.model, sim.data)
    return np.array([[sim.data.site(f"junction{i}.{j}").xpos for j in range(spec.columns)]
                     for i in range(spec.rows)])  # fmt: skip


def kept_share(course: Course) -> float:
    """Share of a shape that theory says is kept."""
    return 100.0 * float(fixity(course.sim.spines.bank.smp, HOLD_TEMPERATURE, _COLD))


def turns_table() -> str:
    """How far 140 °C twist the soft module, over the turns of its helix."""
    rows = []
    for turns in (1.0, 2.0, 3.0, 4.0):
        spec, low, high = replace(TwistMorphingSpec(), turns=turns), 0.0, math.pi
        for _ in range(24):
            middle = 0.5 * (low + high)
            try:
                within = spec.temperature_for(-middle) < 140.0
            except ValueError:
                within = False
            low, high = (middle, high) if within else (low, middle)
        rows.append([f"{turns:.0f}", f"{math.degrees(low):.0f}°",
                     f"{1e3 * spec.sheathed.rest_length:.0f} mm"])  # fmt: skip
    return "\n".join(pages.table(["turns of each leg", "twist at 140 °C", "TCA"], rows))


def module_table() -> str:
    """Commanded, found soft, kept cold, and left after reheating."""
    rows = []
    for angle in _TWISTS:
        spec = TwistMorphingSpec()
        course = Course(twist_morphing_module(spec))
        told = [spec.temperature_for(math.radians(angle))]
        rows.append(_row(course, f"twist {angle:.0f}°", told, lambda tip: turned(tip)))
    for side, angle in _SIDES:
        space = Morphing3dSpec()
        course = Course(morphing_3d_module(space))
        told = list(space.temperatures(math.radians(side), math.radians(angle)))
        rows.append(_row(course, f"bend {angle:.0f}° to {side:.0f}°", told,
                         lambda tip: bent(tip)[0], lambda tip: bent(tip)[1]))  # fmt: skip
    heads = ["command", "TCAs [°C]", "soft", "cold, without power", "kept", "of it by theory",
             "heated again"]  # fmt: skip
    return "\n".join(pages.table(heads, rows))


def _row(
    course: Course, what: str, told: Sequence[float], size: Callable[[Any], float],
    side: Callable[[Any], float] | None = None,
) -> list[str]:  # fmt: skip
    course.soften()
    course.deform(told)
    soft, to = size(course.tip), f" to {side(course.tip):.1f}°" if side else ""
    course.harden()
    cold = size(course.tip)
    course.recover()
    return [what, ", ".join(f"{each:.0f}" for each in told), f"{soft:.1f}°{to}", f"{cold:.1f}°",
            f"{100.0 * cold / soft:.2f} %", f"{kept_share(course):.2f} %",
            f"{size(course.tip):.1f}°"]  # fmt: skip


def grid_table(out: Path | None = None) -> str:
    """Shapes of the grid; with ``out`` its picture, too."""
    spec, rows, shots = MorphingGridSpec(), [], []
    camera = view((0.0, 0.0, -0.003), 0.14, 125.0, -28.0)
    for name, angles in _GRIDS.items():
        course = Course(morphing_grid(spec))
        if out is not None and not shots:
            shots.append(course.shot(camera, 420, 280))
        course.soften()
        course.deform(spec.temperatures(*(math.radians(angle) for angle in angles)))
        soft = 1e3 * places(course.sim, spec)[..., 2]
        course.harden()
        cold = 1e3 * places(course.sim, spec)[..., 2]
        if out is not None:
            shots.append(course.shot(camera, 420, 280))
        course.recover()
        left = 1e3 * places(course.sim, spec)[..., 2]
        told = ", ".join(f"{angle:.0f}°" for angle in angles)
        each = [f"{z[1, 2]:.2f}, {z[2, 1]:.2f}, {z[2, 2]:.2f}" for z in (soft, cold)]
        largest = np.unravel_index(np.argmax(np.abs(soft)), soft.shape)
        rows.append([name, told, *each, f"{100.0 * cold[largest] / soft[largest]:.2f} %",
                     f"{kept_share(course):.2f} %", f"{np.abs(left).max():.2f}"])  # fmt: skip
    if out is not None:
        imageio.imwrite(out, np.concatenate(shots, axis=1))
    heads = ["shape", "members along x, y", "soft: edges at x and y, corner [mm]",
             "cold, without power [mm]", "kept", "by theory", "heated again [mm]"]  # fmt: skip
    return "\n".join(pages.table(heads, rows))


def size_table() -> str:
    """Time of a physics step over the size of the grid."""
    rows = []
    for number in (2, 3, 4):
        spec = MorphingGridSpec(rows=number, columns=number)
        part = morphing_grid(spec)
        sim = Simulation(part, timestep=5e-3, tca_period=0.1)
        sim.step(np.zeros(sim.n), 0.1)
        begin = time.process_time()
        sim.step(np.zeros(sim.n), 0.5)
        taken = (time.process_time() - begin) / 100
        rows.append([f"{number} x {number}", f"{len(spec.members)}", f"{sim.n}",
                     f"{sim.model.nv}", f"{sim.model.neq}", f"{1e3 * taken:.2g}"])  # fmt: skip
    heads = ["junctions", "members, heaters", "TCAs", "joints", "loops", "step [ms]"]
    return "\n".join(pages.table(heads, rows))


def certified_table(cases: int = 10) -> str:
    """The worst of the first cases of each module against the theory of rods."""
    found = outcomes(list(CERTIFIED), effort=Effort(cases, finer=0, runs=0, solvers=0))
    rows = []
    for name, what in CERTIFIED.items():
        gaps = [one.gap for one in found[name] if one.gap is not None]
        tip, turn = (max(getattr(gap, of) for gap in gaps) for of in ("position", "rotation"))
        rows.append([f"`{name}`: {what}", f"{len(gaps)}", f"{100.0 * tip:.2f} %",
                     f"{math.degrees(turn):.2f}°"])  # fmt: skip
    return "\n".join(pages.table(["certified", "cases", "tip", "rotation"], rows))


def lattice_table() -> str:
    """What is known of soft grids."""
    rows = [[case, against, f"{100.0 * error:.2g} %", f"{100.0 * bound:g} %"]
            for case, against, error, bound in lattices()]  # fmt: skip
    return "\n".join(pages.table(["soft grid", "compared with", "error", "bound"], rows))


def draw_twist(path: Path) -> None:
    """Memorised; soft and twisted; cold, without power; heated again."""
    spec, shots = TwistMorphingSpec(nodes=24), []  # for a tube that looks round
    camera = view((0.0, 0.0, 0.032), 0.105, 100.0, -12.0)
    course = Course(flagged(twist_morphing_module(spec)))

    def shoot() -> None:
        shots.append(course.shot(camera, 240, 440))

    shoot()
    course.soften()
    course.deform([spec.temperature_for(-math.pi)])
    shoot()
    course.harden()
    shoot()
    course.recover()
    shoot()
    imageio.imwrite(path, np.concatenate(shots, axis=1))


def draw_sides(path: Path) -> None:
    """Fixed to several sides, cold and without power."""
    spec, shots = Morphing3dSpec(), []
    camera = view((0.0, 0.0, 0.041), 0.205, 70.0, -35.0)
    for side, angle in ((0.0, 0.0), (0.0, 90.0), (120.0, 90.0), (180.0, 90.0), (240.0, 120.0)):
        course = Course(morphing_3d_module(spec))
        if angle:
            course.soften()
            course.deform(spec.temperatures(math.radians(side), math.radians(angle)))
            course.harden()
        shots.append(course.shot(camera, 380, 380))
    imageio.imwrite(path, np.concatenate(shots, axis=1))


def main() -> None:
    out = folder_of_pictures(__doc__, Path(__file__).parents[1] / "docs/pictures")
    if out is None:
        for table in (
            turns_table, module_table, grid_table, size_table, certified_table, lattice_table
        ):  # fmt: skip
            print(table(), end="\n\n", flush=True)
        return
    draw_twist(out / "beyond_twist.png")
    draw_sides(out / "beyond_sides.png")
    grid_table(out / "beyond_grid.png")


if __name__ == "__main__":
    main()

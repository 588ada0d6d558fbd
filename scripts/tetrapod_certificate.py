"""Compares the tetrapod's model with a finer one and with theory; prints tables as Markdown.

    python scripts/tetrapod_certificate.py rails bending legs gaits rods

``rails``: how far the two rails give under loads between them. ``bending``: how far the soft body
is bent by its TCAs. ``legs``: where a loaded foot is. ``gaits``: how fast scripted gaits are.
``rods``: how fast all gaits are on legs with other rods.
"""

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tca_mj.agents.policies import load_policy
from tca_mj.agents.scripts.tetrapod import GAITS, gait_policy
from tca_mj.certify.rest import Load, rest
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.model.part import Part
from tca_mj.model.spine import SHEAR_RATIO
from tca_mj.modules.continuum_leg import LegSpec, continuum_leg
from tca_mj.robots.tetrapod import TetrapodSpec, tetrapod
from tca_mj.robots.tetrapod_fine import fine_tetrapod
from tca_mj.rod import solve_static
from tca_mj.rod.beam import torsion_constant
from tca_mj.routes import Helix, UTurn, leg_length
from tca_mj.sim import Simulation
from tca_mj.tca import law_at

Array = NDArray[np.float64]
RODS, WHO = (0.40e-3, 0.45e-3, 0.50e-3), ("scripted", "searched")
SPEC = TetrapodSpec()
SPINE = SPEC.spine
COLD = 25.0


# The rails, by theory.


def arc(angle: float, points: int = 400) -> tuple[Array, Array, float]:
    """Middles of the elements of a spine in the plane x = 0, their frames, and their length.

    The middle of the line between its ends is the origin; the frames are x, normal, tangent.
    """
    length = SPINE.length
    s = (np.arange(points) + 0.5) / points - 0.5
    turn, curvature = -angle * s, angle / length
    end = angle / 2.0
    y, z = np.sin(angle * s) / curvature, (np.cos(angle * s) - math.cos(end)) / curvature
    place = np.stack([np.zeros(points), y, z], axis=1)
    tangent = np.stack([np.zeros(points), np.cos(turn), np.sin(turn)], axis=1)
    across = np.tile([1.0, 0.0, 0.0], (points, 1))
    frames = np.stack([across, np.cross(tangent, across), tangent], axis=2)
    return place, frames, length / points


def compliance(angle: float, stiffness: tuple[float, float, float, float]) -> Array:
    """Turn and shift of one end against the other by moment and force, about the chord's middle.

    Args:
        angle: Bend of the arc [rad].
        stiffness: Against bending about x and about the normal, twist, and stretch.
    """
    place, frames, step = arc(angle)
    motions = [np.hstack([frames[:, :, j], np.cross(place, -frames[:, :, j])]) for j in range(3)]
    # v = w x (ref - p) = -w x p = p x w, with the reference at the origin.
    motions.append(np.hstack([np.zeros_like(place), frames[:, :, 2]]))
    return sum(step / k * m.T @ m for k, m in zip(stiffness, motions, strict=True))


def body_compliance(angle: float, modulus: float) -> Array:
    """That of the three spines between the rails, each clamped at both ends."""
    section = np.array([SPINE.second_moment, SPINE.thickness * SPINE.width**3 / 12.0,
                        SHEAR_RATIO * torsion_constant(SPINE.width, SPINE.thickness),
                        SPINE.width * SPINE.thickness])  # fmt: skip
    one = np.linalg.inv(compliance(angle, tuple(modulus * section)))
    total = np.zeros((6, 6))
    for x in SPEC.places:
        move = np.eye(6)
        move[3:, :3] = [[0.0, 0.0, 0.0], [0.0, 0.0, x], [0.0, -x, 0.0]]  # w x (x, 0, 0)
        total += move.T @ one @ move
    return np.linalg.inv(total)


# The robots in MuJoCo.


class Bench:
    """A robot without weight and ground, in either model."""

    def __init__(self, build: Callable[..., Part], *, timestep: float, loss: float = 1.0,
                 **options: Any) -> None:  # fmt: skip
        part = build(SPEC, **options)
        part.spec.option.gravity = [0.0, 0.0, 0.0]
        part.spines = tuple(
            replace(spine, damping_time=loss * spine.damping_time) for spine in part.spines
        )
        _hard_welds(part)
        self.sim = Simulation(part, timestep=timestep, tca_period=0.02)
        self.shape = shape(self.sim.model)
        self.rails = [self.sim.model.geom(f"{side}.rail").id for side in ("left", "right")]

    def fix(self, angle: float) -> None:
        """Cold, and fixed in arcs of an angle [rad]."""

        def place(data: mujoco.MjData) -> None:
            for address, per_angle in self.shape:
                data.qpos[address] = per_angle * angle

        self.sim.reset(place)

    @property
    def angle(self) -> float:
        """Bend between the rails [rad]."""
        left, right = (self.sim.data.geom_xmat[i].reshape(3, 3) for i in self.rails)
        turn = -Rotation.from_matrix(left @ right.T).as_rotvec()[0]
        return float(turn - math.pi) % (2.0 * math.pi)  # both z axes point outwards

    def load(self, wrench: Array) -> Array:
        """What the left rail turns and moves against the right one, about the chord's middle.

        Args:
            wrench: Moment [N m] and force [N] on the left rail, the opposite on the right one.
        """
        data, model = self.sim.data, self.sim.model
        mujoco.mj_forward(model, data)
        left, right = self._frames()
        middle = sum(frame @ [0.0, 0.0, -SPEC.rail_width / 2.0, 1.0] for frame in (left, right)) / 2
        for rail, sign in zip(self.rails, (1.0, -1.0), strict=True):
            body = int(model.geom_bodyid[rail])
            arm = middle[:3] - data.xipos[body]
            data.xfrc_applied[body, :3] = sign * wrench[3:]
            data.xfrc_applied[body, 3:] = sign * (wrench[:3] + np.cross(arm, wrench[3:]))
        self.sim.step(np.zeros(self.sim.n), 0.4)
        mujoco.mj_forward(model, data)
        data.xfrc_applied[:] = 0.0
        new_left, new_right = self._frames()
        change = right @ np.linalg.inv(new_right) @ new_left @ np.linalg.inv(left)
        turn = Rotation.from_matrix(change[:3, :3]).as_rotvec()
        return np.concatenate([turn, (change @ middle - middle)[:3]])

    def _frames(self) -> list[Array]:
        """Frames of the left and the right rail where spines end, shape (4, 4), z outwards."""
        frames = []
        for rail in self.rails:
            frame = np.eye(4)
            frame[:3, :3] = self.sim.data.geom_xmat[rail].reshape(3, 3)
            below = self.sim.model.geom_pos[rail, 1] * frame[:3, 1]
            frame[:3, 3] = self.sim.data.geom_xpos[rail] - below
            frames.append(frame)
        return frames

    def soft(self, spines: float, tcas: float, seconds: float) -> None:
        """Softens the body and heats the spines' TCAs, both to temperatures [°C], in steps."""
        sim = self.sim
        assert sim.spines.state is not None
        state = sim.spines.state
        heat = replace(state.heat, temperature=np.full(sim.spines.n, spines))
        volts = np.sqrt(sim.spines.bank.heater.loss * (spines - COLD)
                        * sim.spines.bank.heater.resistance)  # fmt: skip
        sim.spines.state = replace(state, heat=heat)
        now = np.full(sim.n, COLD)
        now[-3:] = tcas
        sim.step(sim.keep(now), seconds, voltage=volts)


def shape(model: mujoco.MjModel) -> list[tuple[int, float]]:
    """Addresses of the joints that bend the body, and their shares of its angle."""
    nodes = max(int(model.joint(i).name.split("bend_x")[1]) + 1 for i in range(model.njnt)
                if model.joint(i).name.split(".")[-2:-1] == ["left"] and "bend_x" in
                model.joint(i).name)  # fmt: skip
    shares = []
    for i in range(model.njnt):
        chain, _, joint = model.joint(i).name.rpartition(".")
        side = {"right": 1.0}.get(chain.split(".")[-1], -1.0)
        if joint.startswith("bend_x") and not chain.endswith("rod"):
            shares.append((int(model.jnt_qposadr[i]), side / (2 * nodes)))
    return shares


def _hard_welds(part: Part) -> None:
    part.spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)


MODELS = {"model": (tetrapod, {}), "finer": (fine_tetrapod, {"leg_nodes": 2})}
LOADS = ("bend", "pitch", "yaw", "sway", "width", "height")  # turn about x, y, z; force along them


def measured(bench: Bench, angle: float) -> Array:
    """Compliances of the body between its rails, cold and fixed in an arc, shape (6,)."""
    diagonal = np.empty(6)
    for i in range(6):
        wrench = np.zeros(6)
        wrench[i] = 1e-4 if i < 3 else 1e-2
        moved = []
        for sign in (1.0, -1.0):  # the tubes round the spines pull without a load, too
            bench.fix(angle)
            moved.append(bench.load(sign * wrench)[i])
        diagonal[i] = (moved[0] - moved[1]) / (2.0 * wrench[i])
    return diagonal


def rails() -> list[str]:
    """Table of compliances."""
    lines = [
        "| angle | load | theory | finer | model | model over theory |",
        "|---|---|---|---|---|---|",
    ]
    for degrees in (20.0, 95.0, 215.0):
        exact = np.diag(body_compliance(math.radians(degrees), float(SPINE.smp.modulus(COLD))))
        found = {}
        for name, (build, options) in MODELS.items():
            found[name] = measured(Bench(build, timestep=1e-3, **options), math.radians(degrees))
        for i, load in enumerate(LOADS):
            unit = "rad/(N m)" if i < 3 else "m/N"
            lines.append(
                f"| {degrees:.0f}° | {load} | {exact[i]:.3g} {unit} | {found['finer'][i]:.3g}"
                f" | {found['model'][i]:.3g} | {found['model'][i] / exact[i]:.2f} |"
            )
    return lines


# The soft body.


def soft_angle(spines: float, tcas: float, *, stretches: bool = True) -> float:
    """Bend of a spine by its own TCA, by theory [rad]."""
    section = SPINE.width * SPINE.thickness
    tubes = SPEC.body(count=1, length=SPINE.length, curves=-1.0)
    modulus = float(SPINE.smp.modulus(spines))
    bending = modulus * SPINE.second_moment + tubes.bending[0]
    beam = replace(
        tubes, bending=(bending, 100.0 * bending), torsion=100.0 * bending,
        stretching=modulus * section * (1.0 if stretches else 1e6), shearing=modulus * section,
    )  # fmt: skip
    route = UTurn.parallel(SPINE.tca_offset, SPINE.width / 4.0, math.pi / 2.0)
    length = sum(leg_length(leg, beam.length, beam.curvature) for leg in route.legs)
    law = law_at(SPEC.tca.of_length(length), tcas)
    turns = solve_static(beam, [route], [law], shearable=False, points=65)
    # beyond half a turn the angle between the ends is ambiguous: sum over the points
    steps = np.swapaxes(turns.rotation[:-1], 1, 2) @ turns.rotation[1:]
    return float(-Rotation.from_matrix(steps).as_rotvec()[:, 0].sum())


def bending() -> list[str]:
    """Table of the soft body's angle over the temperature of its TCAs."""
    lines = [
        "| spines | TCAs | theory | without stretch | finer | model |",
        "|---|---|---|---|---|---|",
    ]
    benches = {
        name: Bench(build, timestep=5e-3, loss=20.0, **options)
        for name, (build, options) in MODELS.items()
    }
    for spines in (110.0, 120.0):
        for bench in benches.values():
            bench.fix(SPEC.memory_angle)
        for tcas in (60.0, 90.0, 120.0, 150.0):
            row = []
            for bench in benches.values():
                bench.soft(spines, tcas, 4.0)
                row.append(bench.angle)
            exact = [soft_angle(spines, tcas, stretches=flag) for flag in (True, False)]
            cells = " | ".join(f"{math.degrees(each):.1f}°" for each in (*exact, *reversed(row)))
            lines.append(f"| {spines:.0f} °C | {tcas:.0f} °C | {cells} |")
    return lines


# The legs.


def leg_tip(spec: LegSpec, temperature: tuple[float, ...], load: Load) -> Array:
    """Where the end of the rod is at rest, in MuJoCo [m]."""
    part = continuum_leg(spec)
    laws = [law_at(tca.spec, t) for tca, t in zip(part.tcas, temperature, strict=True)]
    return rest(part, ["tip"], laws, load).position[0]


def leg_theory(temperature: tuple[float, ...], load: Load, torsion: float = 1.0) -> Array:
    """The same by theory; ``torsion`` multiplies the rod's [m]."""
    spec = SPEC.leg
    routes = [Helix(spec.offset, phase=spec.phase + 2.0 * math.pi * i / spec.count)
              for i in range(spec.count)]  # fmt: skip
    laws = [law_at(spec.tca.of_length(spec.length), t) for t in temperature]
    beam = replace(spec.body, torsion=torsion * spec.body.torsion)
    return solve_static(beam, routes, laws, tip_force=load.force[0], tip_moment=load.moment[0],
                        gravity=load.gravity, shearable=False, points=2).tip  # fmt: skip


def foot_load(force: Array) -> Load:
    """A force on the foot of a leg that stands nearly straight: its lever beyond the rod's end."""
    lever = np.array([0.0, 0.0, SPEC.leg.foot_radius])
    return Load(force=force[None], moment=np.cross(lever, force)[None], gravity=np.zeros(3))


TEMPERATURES = ((25.0, 25.0, 25.0), (60.0, 90.0, 90.0), (160.0, 90.0, 90.0), (60.0, 160.0, 160.0),
                (165.0, 25.0, 25.0), (25.0, 25.0, 165.0), (90.0, 160.0, 25.0))  # fmt: skip


def legs() -> list[str]:
    """Table of the foot's place: what the model is off, and of that, what the missing twist is."""
    spec = SPEC.leg
    others = {
        f"{n} nodes{' (in use)' if n == spec.nodes else ''}": replace(spec, nodes=n)
        for n in (3, 4, 5, 10)
    }  # fmt: skip
    others |= {"5, no twist": replace(spec, nodes=5, motions=("bend_x", "bend_y"))}
    rng = np.random.default_rng(0)
    directions = np.vstack([np.eye(3), -np.eye(3), rng.standard_normal((4, 3))])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    names = " | ".join(others)
    lines = [f"| foot load | moves the foot | twistless theory | {names} |",
             "|---" * (3 + len(others)) + "|"]  # fmt: skip
    for size in (0.0, 0.02, 0.05, 0.1):
        off: dict[str, list[float]] = {name: [] for name in ("moved", "theory", *others)}
        for temperature in TEMPERATURES:
            alone = leg_theory(temperature, foot_load(np.zeros(3)))
            for direction in directions[: 1 if size == 0.0 else None]:
                load = foot_load(size * direction)
                exact = leg_theory(temperature, load)
                off["moved"].append(np.linalg.norm(exact - alone))
                stiff = leg_theory(temperature, load, torsion=1e4)
                off["theory"].append(np.linalg.norm(stiff - exact))
                for name, other in others.items():
                    found = leg_tip(other, temperature, load)
                    off[name].append(np.linalg.norm(found - exact))
        cells = [f"{1e3 * np.mean(each):.2f} ({1e3 * max(each):.2f}) mm" for each in off.values()]
        lines.append(f"| {size:g} N | {' | '.join(cells)} |")
    return lines


# The gaits.


def headway(gait: str, seconds: float, **options: Any) -> Array:
    """Speed along and across the way of a scripted gait after its first cycles, shape (2,) [m/s].

    Args:
        gait: The gait.
        seconds: Time that counts, rounded to whole cycles.
        **options: Of ``TetrapodGait``.
    """
    env, policy = TetrapodGait(gait=gait, action="power", **options), gait_policy(gait)
    period = policy.gait.period / env.control_period
    first, last = (round(math.ceil(n) * period) for n in (100.0 / period, 10.0 * seconds / period))
    observation, begin = env.reset(seed=0)
    info = begin
    for i in range(first + last):
        observation, *_, info = env.step(policy.act(observation))
        if i == first - 1:
            begin = info
    moved = [info[key] - begin[key] for key in ("distance", "drift")]
    return np.array(moved) / (last * env.control_period)


def gaits(seconds: float = 24.0) -> list[str]:
    """Table of the scripted gaits, by model."""
    ten = replace(SPEC.leg, nodes=10, plate_fill=SPEC.leg.plate_fill * (SPEC.leg.nodes + 1) / 11.0)
    twistless = replace(SPEC.leg, motions=("bend_x", "bend_y"))
    cases: dict[str, dict[str, Any]] = {
        "the one in use": {},
        "time step of 2.5 ms": {"timestep": 2.5e-3},
        "elastic body, three spines in a chain": {"body": "elastic"},
        "ten nodes a leg": {"robot": replace(SPEC, leg=ten)},
        "legs that cannot twist": {"robot": replace(SPEC, leg=twistless)},
        "elastic body, single spines, ten nodes a leg, 2 ms": {
            "body": "fine", "robot": replace(SPEC, leg=ten, nodes=6), "timestep": 2e-3,
        },
    }  # fmt: skip
    names = list(GAITS)
    lines = [f"| model | {' | '.join(f'{name} [mm/s]' for name in names)} |",
             "|---" * (1 + len(names)) + "|"]  # fmt: skip
    used = [headway(name, seconds)[0] for name in names]
    for model, options in cases.items():
        cells = []
        for name, speed in zip(names, used, strict=True):
            along, _ = headway(name, seconds, **options)
            cells.append(f"{1e3 * along:.2f} ({round(100.0 * (along / speed - 1.0)):+d} %)")
        lines.append(f"| {model} | {' | '.join(cells)} |")
    return lines


def rods(seconds: float = 60.0) -> list[str]:
    """Table of the gaits on legs with thinner and thicker rods, by whom."""
    lines = [f"| rod | {' | '.join(f'{name}, {who} [mm/s]' for name in GAITS for who in WHO)} |",
             "|---" * (1 + len(GAITS) * len(WHO)) + "|"]  # fmt: skip
    for diameter in RODS:
        robot = replace(SPEC, leg=replace(SPEC.leg, rod_diameter=diameter))
        cells = []
        for name in GAITS:
            for who in WHO:
                env = TetrapodGait(gait=name, action="power", robot=robot)
                learned = who == "searched"
                policy = (
                    load_policy(f"tetrapod-{name}", env, other_robot=True) if learned
                    else gait_policy(name)
                )  # fmt: skip
                observation, info = env.reset(seed=0)
                done = False
                while info["time"] < seconds - 1e-9 and not done:
                    observation, _, fell, broke, info = env.step(policy.act(observation))
                    done = fell or broke
                ended = f" until {info['time']:.0f} s" if done else ""
                cells.append(f"{1e3 * info['speed']:.2f}{ended}")
        lines.append(f"| {1e3 * diameter:.2f} mm | {' | '.join(cells)} |")
    return lines


TABLES = {"rails": rails, "bending": bending, "legs": legs, "gaits": gaits, "rods": rods}


def main() -> None:
    """Prints the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[*TABLES, []], default=[])
    for name in parser.parse_args().tables or list(TABLES):
        print("\n".join(TABLES[name]()), end="\n\n", flush=True)


if __name__ == "__main__":
    main()

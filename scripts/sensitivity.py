"""How much each constant that is estimated or fitted moves the headline results.

Prints the table of docs/sensitivity.md: every constant at the ends of its plausible range, all
others at their defaults. ``--write`` puts it into the page.
"""

import argparse
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest import mock

import mujoco
import numpy as np

from tca_mj.agents.scripts.tetrapod import gait_policy
from tca_mj.agents.workers import Workers
from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.modules import continuum_leg as leg
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.robots.tetrapod import TetrapodSpec
from tca_mj.rod import solve_static
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, TcaSpec, embedding, law_at
from tca_mj.validation.attitude import by_place

PAGE = Path(__file__).parents[1] / "docs/sensitivity.md"
MARKER = "<!-- Written by scripts/sensitivity.py from here on. -->\n"
GAIT_TIME = 60.0  # [s]


@dataclass(frozen=True, kw_only=True)
class World:
    """The specs that a result is computed from, and module constants that differ from theirs."""

    tca: TcaSpec = CATALOGUE["free-stroke"]
    bending: BendingSpec = field(default_factory=BendingSpec)
    weight: float = 4.5e-3  # diameter of the bending module's silicone that has weight [m]
    wrist: TwistingSpec = field(default_factory=TwistingSpec)
    gripper: FingerPairSpec = field(default_factory=FingerPairSpec)
    arm: ArmSpec = field(default_factory=ArmSpec)
    robot: TetrapodSpec = field(default_factory=TetrapodSpec)
    patches: tuple[tuple[Any, str, float], ...] = ()

    def with_tca(self) -> "World":
        """Everything made of ``tca``."""
        tca = self.tca
        return replace(
            self, bending=replace(self.bending, tca=tca), wrist=replace(self.wrist, tca=tca),
            gripper=replace(self.gripper, tca=tca),
            robot=replace(self.robot, tca=tca, leg=replace(self.robot.leg, tca=tca)),
        )  # fmt: skip

    @contextmanager
    def patched(self) -> Iterator[None]:
        """Module constants as in ``patches``, while it lasts."""
        held = [mock.patch.object(owner, name, value) for owner, name, value in self.patches]
        for each in held:
            each.start()
        try:
            yield
        finally:
            for each in held:
                each.stop()


def bending_of(world: World, power: float) -> float:
    """Bend of the standing module after 2 s of power and a fifth of it, by eq. (4.1) [deg]."""
    spec = world.bending
    part = bending_module(spec)
    weigh(part.spec, "", world)
    part.spec.option.gravity = [0.0, 0.0, -9.81]
    sim = Simulation(part, timestep=5e-3)
    sim.step(np.zeros(3), 2.0)
    sim.keep(np.full(3, 25.0))
    sim.step([power, power / 5.0, 0.0], 2.0)
    return math.degrees(by_place(sim.data.site("tip").xpos, spec.length).angle)


def weigh(mjspec: mujoco.MjSpec, prefix: str, world: World) -> None:
    """Gives the bending module the weight of ``world.weight``."""
    spec = world.bending
    pieces = [g for g in mjspec.geoms if g.name.startswith(f"{prefix}body") and g.mass > 0.0]
    extra = spec.body.mass * ((world.weight / 4.5e-3) ** 2 - 1.0)
    whole = sum(g.mass for g in pieces)
    for geom in pieces:
        geom.mass += extra * geom.mass / whole


def turning(world: World) -> float:
    """Turn of the wrist after 14 W for 2 s [deg]."""
    part = twisting_module(world.wrist)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part)
    sim.step([14.0], 2.0)
    model = sim.model
    twists = [i for i in range(model.njnt) if "twist" in model.joint(i).name]
    return abs(math.degrees(sum(sim.data.qpos[model.jnt_qposadr[i]] for i in twists)))


def opening(world: World) -> float:
    """Opening of the gripper after 10 W for 2 s [mm]."""
    part = finger_pair(world.gripper)
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    sim = Simulation(part)
    sim.step([10.0], 2.0)
    tips = [sim.data.site(f"tip{i}").xpos for i in range(2)]
    return 1e3 * float(np.linalg.norm(tips[1] - tips[0]))


def gripping(world: World) -> float:
    """Force that pulls the tips of the cold gripper 10 mm apart, by rod theory [mN]."""
    spec = world.gripper
    whole = finger_pair(spec).tcas[0].spec
    law = law_at(whole.of_length(whole.rest_length / 2.0), 25.0)
    forces = np.linspace(0.0, 0.3, 31)
    width = [2e3 * solve_static(spec.body, [spec.route], [law], tip_force=(0, 0, f)).tip[2]
             for f in forces]  # fmt: skip
    return 1e3 * float(np.interp(10.0, width, forces))


def carrying(world: World) -> float:
    """Bend of the arm's module with 1 g in the gripper, 0.2 and 0.8 W for 20 s [deg]."""
    spec = replace(world.arm, bending=world.bending, twisting=world.wrist, gripper=world.gripper)
    part = arm(spec)
    weigh(part.spec, "bending.", world)
    part.spec.geom("wrist.tip.connector").mass += 1e-3
    sim = Simulation(part, timestep=5e-3)
    sim.reset(lambda data: _lift(data, spec.height))
    sim.step([0.2, 0.8, 0.0, 0.0, 0.0], 20.0)
    axis = sim.data.site("bending.tip").xmat.reshape(3, 3)[:, 2]
    return math.degrees(math.acos(-axis[2]))


def _lift(data: mujoco.MjData, height: float) -> None:
    data.qpos[0] = data.act[0] = height


def walking(world: World, gait: str = "walk") -> float:
    """Speed of the scripted walk over a minute [mm/s]."""
    env = TetrapodGait(gait=gait, action="power", robot=world.robot)
    policy = gait_policy(gait, world.robot)
    observation, info = env.reset(seed=0)
    for _ in range(round(GAIT_TIME / env.control_period)):
        observation, _, terminated, truncated, info = env.step(policy.act(observation))
        if terminated or truncated:
            return math.nan
    return 1e3 * float(info["speed"])


RESULTS: dict[str, tuple[str, Callable[[World], float]]] = {
    "bend 2 W": ("°", lambda world: bending_of(world, 2.0)),
    "bend 1 W": ("°", lambda world: bending_of(world, 1.0)),
    "wrist 14 W": ("°", turning),
    "opening 10 W": (" mm", opening),
    "grip 10 mm": (" mN", gripping),
    "arm's bend": ("°", carrying),
    "walk": (" mm/s", walking),
}
BODY = ("bend 2 W", "bend 1 W", "arm's bend")
ALL = tuple(RESULTS)


@dataclass(frozen=True)
class Constant:
    """One constant, its kind and what it may be instead.

    Attributes:
        name: What it is.
        kind: ``estimate``, ``fitted`` or ``choice``.
        base: The value in use, as text.
        values: What else it may plausibly be, as text and as a change of the world.
        moves: Results that it can move.
    """

    name: str
    kind: str
    base: str
    values: tuple[tuple[str, Callable[[World], World]], ...]
    moves: tuple[str, ...]


def patch(owner: Any, name: str, value: float) -> Callable[[World], World]:
    return lambda world: replace(world, patches=(*world.patches, (owner, name, value)))


def tca(**changes: Any) -> Callable[[World], World]:
    def change(world: World) -> World:
        fibre = {k: v for k, v in changes.items() if hasattr(world.tca.fibre, k)}
        rest = {k: v for k, v in changes.items() if k not in fibre}
        spec = replace(world.tca, fibre=replace(world.tca.fibre, **fibre), **rest)
        return replace(world, tca=spec).with_tca()

    return change


def part(which: str, **changes: Any) -> Callable[[World], World]:
    def change(world: World) -> World:
        if which == "leg":
            robot = replace(world.robot, leg=replace(world.robot.leg, **changes))
            return replace(world, robot=robot)
        return replace(world, **{which: replace(getattr(world, which), **changes)})

    return change


def touching(owner: type, share: float) -> Callable[[World], World]:
    """The same spec with another share of the wall touched."""
    plain = embedding.in_silicone

    def with_share(spec: TcaSpec, **given: Any) -> TcaSpec:
        return plain(spec, **(given | {"touching": share}))

    module = __import__(owner.__module__, fromlist=["in_silicone"])
    return lambda world: replace(
        world, patches=(*world.patches, (module, "in_silicone", with_share))
    )


def between(
    name: str, kind: str, base: str, low: tuple[str, Any], high: tuple[str, Any] | None,
    moves: tuple[str, ...],
) -> Constant:  # fmt: skip
    return Constant(name, kind, base, (low,) if high is None else (low, high), moves)


CONSTANTS = (
    between("section of the fibre", "choice", "cold", ("hot", tca(section="hot")), None, ALL),
    between("softening by load", "choice", "printed", ("none", tca(load_softening=(0.0, 0.0, 1.0))),
            None, ALL),
    between("pitch at which coils touch", "estimate", "9.4°",
            ("8.4°", tca(minimum_pitch_angle=math.radians(8.4))),
            ("11.5°", tca(minimum_pitch_angle=math.radians(11.5))), ALL),
    between("stiffness of touching coils", "estimate", "50", ("10", tca(contact_ratio=10.0)),
            ("200", tca(contact_ratio=200.0)), ALL),
    between("heat lost by a bare TCA", "published product", "76 mW/(K m)",
            ("61", tca(heat_loss=0.061)), ("137", tca(heat_loss=0.137)), ("walk",)),
    between("contact in a channel", "fitted", "0.415 W/(m K)",
            ("0.30", patch(embedding, "CHANNEL_CONTACT", 0.30)),
            ("0.55", patch(embedding, "CHANNEL_CONTACT", 0.55)), (*BODY, "opening 10 W")),
    between("specific heat of silicone", "estimate", "1.3 kJ/(kg K)",
            ("1.1", patch(embedding, "SILICONE_SPECIFIC_HEAT", 1100.0)),
            ("1.5", patch(embedding, "SILICONE_SPECIFIC_HEAT", 1500.0)), ALL[:-1]),
    between("conductivity of silicone", "estimate", "0.25 W/(m K)",
            ("0.20", patch(embedding, "SILICONE_CONDUCTIVITY", 0.20)),
            ("0.30", patch(embedding, "SILICONE_CONDUCTIVITY", 0.30)), ALL[:-1]),
    between("from silicone to air", "estimate", "15 W/(m² K)",
            ("10", patch(embedding, "BODY_TO_AIR", 10.0)),
            ("20", patch(embedding, "BODY_TO_AIR", 20.0)), ALL[:-1]),
    between("share of wall touched, gripper", "estimate", "0.5",
            ("0.3", touching(FingerPairSpec, 0.3)), ("0.8", touching(FingerPairSpec, 0.8)),
            ("opening 10 W",)),
    between("share of wall touched, wrist", "estimate", "1",
            ("0.7", touching(TwistingSpec, 0.7)), None, ("wrist 14 W",)),
    between("silicone that has weight", "choice", "4.5 mm",
            ("9 mm", lambda world: replace(world, weight=9e-3)), None, BODY),
    between("diameter that carries the wrist", "estimate", "7 mm",
            ("6 mm", part("wrist", diameter=6e-3)), ("8 mm", part("wrist", diameter=8e-3)),
            ("wrist 14 W",)),
    between("gripper's layers", "estimate", "1.0 mm", ("1.3 mm", part("gripper", layer=1.3e-3)),
            None, ("opening 10 W", "grip 10 mm")),
    between("modulus of the layers", "estimate", "0.25 MPa",
            ("0.15", part("gripper", layer_young=0.15e6)),
            ("0.40", part("gripper", layer_young=0.40e6)), ("opening 10 W", "grip 10 mm")),
    between("discs between modules", "estimate", "0.1 g each",
            ("0.02 g", part("arm", connector_mass=0.02e-3)),
            ("1.2 g", part("arm", connector_mass=1.2e-3)), ("arm's bend",)),
    between("rod of a leg", "estimate", "0.50 mm", ("0.40", part("leg", rod_diameter=0.40e-3)),
            ("0.45", part("leg", rod_diameter=0.45e-3)), ("walk",)),
    between("modulus of the rod", "estimate", "130 GPa", ("110", patch(leg, "CARBON_YOUNG", 110e9)),
            ("150", patch(leg, "CARBON_YOUNG", 150e9)), ("walk",)),
    between("shear modulus of the rod", "estimate", "4.5 GPa",
            ("3", patch(leg, "CARBON_SHEAR", 3e9)), ("6", patch(leg, "CARBON_SHEAR", 6e9)),
            ("walk",)),
    between("TCAs from the rod", "estimate", "8 mm", ("7 mm", part("leg", offset=7e-3)),
            ("8.8 mm", part("leg", offset=8.8e-3)), ("walk",)),
    between("length of a leg", "estimate", "55 mm", ("50 mm", part("leg", length=50e-3)),
            ("60 mm", part("leg", length=60e-3)), ("walk",)),
    between("friction of a foot", "estimate", "0.8", ("0.6", part("leg", friction=0.6)),
            ("1.0", part("leg", friction=1.0)), ("walk",)),
    between("mass of a foot", "estimate", "0.56 g", ("0.3 g", part("leg", foot_mass=0.3e-3)),
            ("1 g", part("leg", foot_mass=1e-3)), ("walk",)),
    between("plates of a leg, filled", "estimate", "0.5", ("0.3", part("leg", plate_fill=0.3)),
            ("0.8", part("leg", plate_fill=0.8)), ("walk",)),
    between("damping time of a leg", "estimate", "20 ms",
            ("10 ms", part("leg", damping_time=10e-3)), ("40 ms", part("leg", damping_time=40e-3)),
            ("walk",)),
    between("mass of a spine's module", "estimate", "3.5 g",
            ("3.0 g", part("robot", module_mass=3.0e-3)),
            ("4.5 g", part("robot", module_mass=4.5e-3)), ("walk",)),
    between("mass of a rail", "estimate", "3 g", ("2 g", part("robot", rail_mass=2e-3)),
            ("5 g", part("robot", rail_mass=5e-3)), ("walk",)),
)  # fmt: skip



def compute(job: tuple[int | None, int, str]) -> float:
    """Result ``job[2]`` with value ``job[1]`` of constant ``job[0]``, None for the defaults."""
    which, value, result = job
    world = World() if which is None else CONSTANTS[which].values[value][1](World())
    with world.patched():
        return RESULTS[result][1](world.with_tca())


def table(processes: int) -> str:
    """The table, and below it the constants by the largest change that they make."""
    jobs: list[tuple[int | None, int, str]] = [(None, 0, name) for name in RESULTS]
    for i, constant in enumerate(CONSTANTS):
        jobs += [(i, k, name) for k in range(len(constant.values)) for name in constant.moves]
    with Workers(processes) as workers:
        done = workers.run(compute, [(job,) for job in jobs])
        found = {jobs[i]: result for i, result in done}
    base = {name: found[None, 0, name] for name in RESULTS}
    heads = [f"{name}: {base[name]:.3g}{unit}" for name, (unit, _) in RESULTS.items()]
    lines = [f"| constant | kind | in use | instead | {' | '.join(heads)} |",
             "|---" * (4 + len(heads)) + "|"]  # fmt: skip
    largest: list[tuple[float, str, str]] = []
    for i, constant in enumerate(CONSTANTS):
        for k, (text, _) in enumerate(constant.values):
            cells = []
            for name in RESULTS:
                change = 100.0 * (found.get((i, k, name), math.nan) / base[name] - 1.0)
                moved = name in constant.moves
                known = "fails" if math.isnan(change) else f"{change:+.0f} %"
                cells.append(known if moved else "")
                if moved and not math.isnan(change):
                    largest.append((abs(change), constant.name, name))
            lines.append(f"| {constant.name} | {constant.kind} | {constant.base} | {text} |"
                         f" {' | '.join(cells)} |")  # fmt: skip
    lines += ["", "| result | three constants that move it most |", "|---|---|"]
    for name in RESULTS:
        mine: dict[str, float] = {}
        for change, constant_name, result in largest:
            if result == name:
                mine[constant_name] = max(change, mine.get(constant_name, 0.0))
        top = sorted(mine.items(), key=lambda item: -item[1])[:3]
        lines.append(f"| {name} | {', '.join(f'{c} ({v:.0f} %)' for c, v in top)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--write", action="store_true", help="write it into docs/sensitivity.md")
    args = parser.parse_args()
    text = table(args.processes)
    print(text)
    if args.write:
        introduction, marker, _ = PAGE.read_text(encoding="utf-8").partition(MARKER)
        if not marker:
            raise SystemExit(f"{PAGE} has no line {MARKER!r}")
        PAGE.write_text(f"{introduction}{MARKER}\n{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""Cases drawn by seed, their answers by theory and by MuJoCo, and the differences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tca_mj.certify.parts import Limb
from tca_mj.certify.rest import Law, Load, Rest, rest, run
from tca_mj.certify.subjects import Subject, slack
from tca_mj.checks import Array
from tca_mj.rod import RodShape, solve_series
from tca_mj.rod.shape import bend
from tca_mj.tca import law_at

GRAVITY = 9.81  # [m/s²]
_COLD = 0.3  # share of the TCAs that are left cold
_FREE = 0.4  # share of the cases without a load on the tips
_MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Case:
    """What a module is asked.

    Attributes:
        temperature: Temperatures of its TCAs, shape (n,) [°C].
        posture: "hanging", "lying" or "standing".
        load: Loads on its t tips, and gravity.
    """

    temperature: Array
    posture: str
    load: Load


@dataclass(frozen=True, kw_only=True, slots=True)
class Gap:
    """How far a chain is from theory: the worst tip and the worst TCA.

    Attributes:
        position: Distance of the tip from where it should be, over the length of its limb [1].
        rotation: Angle between its frames [rad].
        length: Error of the length of a TCA [m].
        strain: The same over the length of its route [1].
        tension: Error of the tension of a TCA [N].
    """

    position: float
    rotation: float
    length: float
    strain: float
    tension: float


def draw(subject: Subject, name: str, count: int, seed: int) -> list[Case]:
    """Cases over the working range of a module.

    Args:
        subject: The module.
        name: Its name: the cases of two modules have nothing in common.
        count: How many.
        seed: Seed; the first cases of a longer list are the shorter list.
    """
    rng = np.random.default_rng([seed, *name.encode()])
    tips, tcas, low_high = len(subject.tips), len(subject.tcas), subject.temperature
    cases = []
    for _ in range(count):
        temperature = rng.uniform(*low_high, size=tcas)
        # Not all cold: a module at rest is no case.
        cold = rng.random(tcas) < _COLD
        if not cold.all():
            temperature[cold] = low_high[0]
        posture = str(rng.choice(subject.postures))
        across = rng.uniform(0.0, 2.0 * np.pi)
        loaded = rng.random() >= _FREE
        force = subject.force * rng.random() * _direction(rng) * loaded
        moment = subject.moment * rng.random() * _direction(rng) * loaded
        gravity = np.array(subject.down) * (-1.0 if posture == "standing" else 1.0)
        if posture == "lying":
            gravity = np.array([np.cos(across), np.sin(across), 0.0])
            gravity = np.array([0.0, 1.0, 0.0]) if subject.mirrored else gravity
            gravity = np.array([np.sign(np.cos(across)), 0.0, 0.0]) if subject.plane else gravity
        if subject.plane:
            force, moment = force * [1.0, 0.0, 1.0], moment * [0.0, 1.0, 0.0]
        sides = [np.ones(3), _MIRROR] if subject.mirrored else [np.ones(3)] * tips
        load = Load(
            force=np.array([side * force for side in sides]),
            # A moment is an axial vector: its mirror image has the other sign besides.
            moment=np.array([side * moment * side.prod() for side in sides]),
            gravity=GRAVITY * gravity,
        )
        cases.append(Case(temperature=temperature, posture=posture, load=load))
    return cases


def _direction(rng: np.random.Generator) -> Array:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def theory(
    subject: Subject, case: Case, *, shearable: bool = False, solver: str | None = None
) -> Rest:
    """What rod theory answers; errors as ``shapes``."""
    return tips_of(subject, case, list(shapes(subject, case, shearable=shearable, solver=solver)))


def tips_of(
    subject: Subject, case: Case, found: Sequence[tuple[Limb, Sequence[RodShape]]]
) -> Rest:
    """The tips and the TCAs of shapes that theory has found."""
    laws, tips = _laws(subject, case), []
    length = np.zeros(len(laws))
    for limb, bodies in found:
        for shape, numbers in zip(bodies, limb.tcas, strict=True):
            np.add.at(length, list(numbers), shape.tca_length)
        tips += [bodies[tip] for tip in limb.tips]
    return Rest(
        position=np.array([tip.tip for tip in tips]),
        rotation=np.array([tip.rotation[-1] for tip in tips]),
        length=length,
        tension=np.array([law(each)[0] for law, each in zip(laws, length, strict=True)]),
    )


def shapes(
    subject: Subject, case: Case, *, shearable: bool = False, solver: str | None = None,
    points: int = 17,
) -> Iterator[tuple[Limb, Sequence[RodShape]]]:  # fmt: skip
    """The limbs of a module and the shapes of their bodies by theory.

    Args:
        subject: The module.
        case: The case.
        shearable: As in ``solve_series``.
        solver: The same; None for the subject's.
        points: The same.

    Raises:
        RodSolveError: If no state is found.
    """
    tip = -1
    for limb in subject.limbs(_laws(subject, case)):
        tip += len(limb.tips)
        yield limb, solve_series(
            limb.segments, tip_force=case.load.force[tip], tip_moment=case.load.moment[tip],
            gravity=case.load.gravity, shearable=shearable, solver=solver or subject.solver,
            points=points,
        )  # fmt: skip


def at_rest(subject: Subject, case: Case, times: int = 1, *, near: str | None = None) -> Rest:
    """What the module answers with so many times its default nodes, once it is at rest.

    Args:
        subject: The module.
        case: The case.
        times: Multiple of the default nodes.
        near: Of several states at rest, that next to theory's by this solver is meant.

    Raises:
        NotSettledError: If no rest is found.
        RodSolveError: If ``near`` and theory finds no state.
    """
    start = None if near is None else _joints(subject, case, times, near)
    part, laws = subject.build(times), _laws(subject, case)
    return rest(part, subject.tips, laws, case.load, start=start)


def _joints(subject: Subject, case: Case, times: int, solver: str) -> dict[str, float]:
    """Positions of the joints whose cells are strained as theory says in their middles."""
    joints = {}
    for limb, bodies in shapes(subject, case, solver=solver, points=65):
        for shape, chain, (start, end) in zip(bodies, limb.chains, limb.cells, strict=True):
            nodes = times * (end - start)
            cell = shape.arc_length[-1] / nodes
            middles = cell * (np.arange(nodes) + 0.5)
            assert shape.strain is not None
            strain = np.array(
                [np.interp(middles, shape.arc_length, column) for column in shape.strain.T]
            )
            for node, turn, stretch in zip(
                range(times * start, times * end), cell * strain[:3].T, strain[5], strict=True
            ):
                # The order of the joints is mirrored from node to node.
                order = "xyz" if node % 2 == 0 else "zyx"
                angles = Rotation.from_rotvec(turn).as_euler(order.upper())
                for axis, angle in zip(order, angles, strict=True):
                    motion = "twist" if axis == "z" else f"bend_{axis}"
                    joints[f"{chain}.{motion}{node}"] = float(angle)
                joints[f"{chain}.stretch{node}"] = cell * float(stretch - 1.0)
    return joints


def as_run(subject: Subject, case: Case) -> tuple[Rest, float]:
    """What a user sees of the module: its simulation, and the velocity that is left in the end."""
    part, step = subject.build(1), subject.timestep
    return run(part, subject.tips, case.temperature, case.load, timestep=step)


def gap(subject: Subject, found: Rest, exact: Rest) -> Gap:
    """How far an answer is from another one."""
    away = np.linalg.norm(found.position - exact.position, axis=1)
    turned = Rotation.from_matrix(np.swapaxes(exact.rotation, 1, 2) @ found.rotation)
    longer = np.abs(found.length - exact.length)
    return Gap(
        position=float(np.max(away / subject.reach)),
        rotation=float(np.max(turned.magnitude())),
        length=float(np.max(longer)),
        strain=float(np.max(longer / [tca.rest_length for tca in subject.tcas])),
        tension=float(np.max(np.abs(found.tension - exact.tension))),
    )


def bent(subject: Subject, found: Sequence[tuple[Limb, Sequence[RodShape]]]) -> float:
    """Largest angle by which a tip's axis is turned from the unloaded shape [rad].

    It goes on beyond half a turn, see ``tca_mj.rod.shape.bend``.

    Args:
        subject: The module.
        found: Its limbs and their shapes.
    """
    angles = []
    for limb, bodies in found:
        unloaded = [
            replace(each, tensions=[slack] * len(each.tensions), springs=(), start=None)
            for each in limb.segments
        ]
        starts = solve_series(unloaded, solver=subject.solver, points=len(bodies[0].arc_length))
        for tip in limb.tips:
            way = limb.way(tip)
            one, other = (np.concatenate([each[i].rotation for i in way])
                          for each in (starts, bodies))  # fmt: skip
            angles.append(bend(np.einsum("nji,nj->ni", one, other[:, :, 2])))
    return max(angles)


def _laws(subject: Subject, case: Case) -> list[Law]:
    """One for each TCA; that of TCAs alike at one temperature is the same."""
    pairs = list(zip(subject.tcas, case.temperature.tolist(), strict=True))
    known = {pair: law_at(*pair) for pair in dict.fromkeys(pairs)}
    return [known[pair] for pair in pairs]

"""What rod theory sees of a built part: bodies, strands and rigid masses, from the part's record.

A part remembers which beams its chains stand for, and where the TCAs run in them. Their stiffness,
weight and routes are taken from there and not from the MuJoCo model, so that a model that is wrong
is found to be so. What is rigid (where a chain stands, what is fixed to it and what that weighs)
only the model knows, as it does of springs: tendons that only pull, straight from what stands still
to the end of a chain.

A chain is one body to theory, or several behind each other: it is cut where something rigid sits on
one of its pieces, or another chain stands there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np

from tca_mj.checks import Array
from tca_mj.model.chain import Member
from tca_mj.model.part import Part
from tca_mj.model.tendon import RoutedTca
from tca_mj.rod import BeamSpec, Segment, Spring, StrandLaw
from tca_mj.rod.lie import quaternion_matrix
from tca_mj.routes import Helix
from tca_mj.tca import TcaSpec

_NOTHING = 1e-12  # mass that counts as none [kg]
_WORLD = ("", 0)
_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)

Place = tuple[str, int]
"""A section that something is rigid with: chain and piece; the world has none."""


class Limb(NamedTuple):
    """Soft bodies from the base to one tip or to several, as theory sees them.

    Attributes:
        segments: The bodies.
        tcas: For each of them, which of the part's TCAs its strands are.
        chains: For each of them, the name of its chain in the part.
        cells: For each of them, the first of the chain's cells in it, and that after its last.
        tips: Numbers of the bodies whose tips are looked at.
    """

    segments: tuple[Segment, ...]
    tcas: tuple[tuple[int, ...], ...]
    chains: tuple[str, ...]
    cells: tuple[tuple[int, int], ...]
    tips: tuple[int, ...]

    def way(self, tip: int) -> tuple[int, ...]:
        """Numbers of the bodies from the base to one of them."""
        base = self.segments[tip].base
        base = tip - 1 if base is None else base
        return (tip,) if base < 0 else (*self.way(base), tip)


class Outside(ValueError):
    """A part has something that rod theory does not know."""

    def __init__(self, part: Part, what: str) -> None:
        super().__init__(f"part must be what rod theory covers, {part.spec.modelname!r} {what}")


class Fixed(NamedTuple):
    """Where something is rigid: a section, and the motion from its frame, shape (4, 4) [m]."""

    place: Place
    motion: Array


@dataclass(frozen=True, slots=True)
class Legs:
    """Parts of the legs of one TCA in one body."""

    legs: tuple[Helix, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """One of the bodies, but for the laws of its strands."""

    segment: Segment
    tcas: tuple[int, ...]
    chain: str
    cells: tuple[int, int]


class Seen:
    """A part as theory sees it.

    Attributes:
        chains: Its chains, each after that which it stands on.
    """

    def __init__(
        self, part: Part, beams: Mapping[str, BeamSpec] | None = None,
        starts: Mapping[str, tuple[float, float, float]] | None = None,
    ) -> None:  # fmt: skip
        """Reads the part.

        Args:
            part: The part, which stays as it is.
            beams: For chains that are not what they were built as, by name, what they are.
            starts: Curvatures with which chains set out, by name, as in ``Segment``.

        Raises:
            Outside: If there is something that theory does not know; it names the part, what it is
                and the body.
        """
        self._part, self._members, self._beams = part, part.members, beams or {}
        self._starts = starts or {}
        model = part.spec.copy().compile()
        _require_known(part, model)
        self.chains = tuple(sorted(
            self._members.values(), key=lambda member: int(model.body(member.body(0)).id)
        ))  # fmt: skip
        self._where = self._placed(model)
        self._require_bound(model)
        self._weights = self._weighed(model)
        self._springs = self._sprung(model)
        self._bodies = self._cut(model)

    @property
    def branches(self) -> bool:
        """Whether the bodies do not stand on each other in one row."""
        bases = [body.segment.base for body in self._bodies]
        return bases != list(range(-1, len(bases) - 1))

    @property
    def sprung(self) -> bool:
        """Whether springs pull on the bodies."""
        return bool(self._springs)

    def limb(self, laws: Sequence[StrandLaw], tips: Iterable[str] | None = None) -> Limb:
        """All bodies.

        Args:
            laws: Laws of the part's TCAs.
            tips: Chains whose tips are looked at; None for all.
        """
        ends = {body.chain: i for i, body in enumerate(self._bodies)}
        segments = tuple(
            replace(body.segment, tensions=[laws[i] for i in body.tcas]) for body in self._bodies
        )
        return Limb(
            segments, tuple(body.tcas for body in self._bodies),
            tuple(body.chain for body in self._bodies), tuple(body.cells for body in self._bodies),
            tuple(ends[name] for name in ([c.name for c in self.chains] if tips is None else tips)),
        )  # fmt: skip

    def _placed(self, model: mujoco.MjModel) -> list[Fixed]:
        """What each body is rigid with."""
        pieces = {
            model.body(member.body(piece)).id: (member, piece)
            for member in self._members.values()
            for piece in range(member.nodes + 1)
        }
        where = [Fixed(_WORLD, np.eye(4))]
        for body in range(1, model.nbody):
            member, piece = pieces.get(body, (None, 0))
            mine = {model.joint(int(j)).name: int(j)
                    for j in np.flatnonzero(model.jnt_bodyid == body)}  # fmt: skip
            asked = set(member.joints(piece - 1).values()) if member and piece else set()
            if set(mine) != asked:
                raise Outside(self._part, _odd_joints(model, body, mine, asked))
            if member and piece:
                back = np.eye(4)
                back[2, 3] = -member.local(piece)
                where.append(Fixed((member.name, piece), back))
                continue
            below, motion = where[model.body_parentid[body]], np.eye(4)
            motion[:3, :3] = quaternion_matrix(model.body_quat[body])
            motion[:3, 3] = model.body_pos[body]
            where.append(Fixed(below.place, below.motion @ motion))
        return where

    def _weighed(self, model: mujoco.MjModel) -> dict[Place, tuple[float, Array]]:
        """Mass and its centre of what is rigid with each section, besides chain and TCAs."""
        moments = model.body_mass[:, None] * np.hstack([np.ones((model.nbody, 1)), model.body_ipos])
        for member in self.chains:
            for piece in range(member.nodes + 1):
                name = member.skin(piece)
                skin = self._part.spec.geom(name)
                if skin is None:
                    what = f"has lost the geom {name!r} of the body {member.body(piece)!r}"
                    raise Outside(self._part, what)
                own = float(skin.mass) * np.array([1.0, *model.geom(name).pos])
                moments[model.body(member.body(piece)).id] -= own
        found: dict[Place, tuple[float, Array]] = {}
        for (place, motion), (mass, *moment) in zip(self._where, moments, strict=True):
            if place == _WORLD or abs(mass) < _NOTHING:
                continue
            there = motion[:3, :3] @ moment + mass * motion[:3, 3]
            old, sum_of = found.get(place, (0.0, np.zeros(3)))
            found[place] = old + mass, sum_of + there
        return {place: (mass, moment / mass) for place, (mass, moment) in found.items()}

    def _sprung(self, model: mujoco.MjModel) -> dict[Place, tuple[Spring, ...]]:
        """The springs on the ends of chains."""
        ends = {(member.name, member.nodes) for member in self.chains}
        ends -= {self._where[model.body(member.body(0)).id].place for member in self.chains}
        found: dict[Place, tuple[Spring, ...]] = {}
        for number in range(model.ntendon):
            name = model.tendon(number).name
            if name in {tca.name for tca in self._part.tcas}:
                continue
            first = int(model.tendon_adr[number])
            sites = [int(site) for site in model.wrap_objid[first : first + 2]]
            held = [self._where[int(model.site_bodyid[site])] for site in sites]
            if held[0].place != _WORLD:
                sites, held = sites[::-1], held[::-1]
            place = held[1].place
            if held[0].place != _WORLD or place not in ends:
                what = f"has the spring {name!r}, which is not from what stands still to the end"
                raise Outside(self._part, f"{what} of a chain")
            start, end = (
                tuple((fixed.motion @ [*model.site_pos[site], 1.0])[:3].tolist())
                for fixed, site in zip(held, sites, strict=True)
            )
            spring = Spring(
                stiffness=float(model.tendon_stiffness[number]),
                length=float(model.tendon_lengthspring[number, 1]), start=start, end=end,
            )  # fmt: skip
            found[place] = (*found.get(place, ()), spring)
        return found

    def _cut(self, model: mujoco.MjModel) -> list[_Body]:
        bases = {each.name: self._where[model.body(each.body(0)).id] for each in self.chains}
        marked = {*self._weights, *(base.place for base in bases.values())}
        bodies: list[_Body] = []
        ends = {_WORLD: -1}
        for member in self.chains:
            name, base = member.name, bases[member.name]
            cuts = [i for i in range(1, member.nodes) if (name, i) in marked]
            start = 0
            for end in (*cuts, member.nodes):
                bodies.append(self._one(member, start, end, ends[base.place], base.motion))
                ends[name, end] = len(bodies) - 1
                start, base = end, Fixed((name, end), np.eye(4))
        return bodies

    def _one(self, member: Member, start: int, end: int, base: int, motion: Array) -> _Body:
        """The body from the section at one piece of a chain to that at another one."""
        low, high = start / member.nodes, end / member.nodes
        runs = [
            (i, [run for run in tca.runs if run.chain.name == member.name])
            for i, tca in enumerate(self._part.tcas)
        ]
        mass = sum(run.mass for _, mine in runs for run in mine)
        beam = self._beams.get(member.name, member.beam)
        weight, centre = self._weights.get((member.name, end), (0.0, np.zeros(3)))
        whole = (low, high) == (0.0, 1.0)
        routes = [
            (i, Legs(tuple(run.leg if whole else run.leg.between(low, high) for run in mine)))
            for i, mine in runs if mine
        ]  # fmt: skip
        segment = Segment(
            replace(
                beam, length=beam.length * (high - low),
                line_density=beam.line_density + mass / beam.length,
            ),
            [route for _, route in routes], [0.0] * len(routes),
            strands=[i for i, _ in routes], base=base, rotation=motion[:3, :3],
            offset=motion[:3, 3], mass=weight, centre=centre,
            springs=self._springs.get((member.name, end), ()),
            start=self._starts.get(member.name),
        )  # fmt: skip
        return _Body(segment, tuple(i for i, _ in routes), member.name, (start, end))

    def _require_bound(self, model: mujoco.MjModel) -> None:
        """TCAs run from body to body only where these are rigid with each other."""
        for tca in self._part.tcas:
            for one, next in zip(tca.runs, tca.runs[1:], strict=False):
                left = one.chain.body(0 if one.down else one.chain.nodes)
                entered = next.chain.body(next.chain.nodes if next.down else 0)
                places = [self._where[model.body(name).id].place for name in (left, entered)]
                if places[0] != places[1]:
                    what = (f"has the TCA {tca.name!r} span freely from the body {left!r} to"
                            f" {entered!r}")  # fmt: skip
                    raise Outside(self._part, what)


def _require_known(part: Part, model: mujoco.MjModel) -> None:
    """Nothing pulls, holds or closes a loop but chains and TCAs."""
    if not part.members:
        raise Outside(part, "has no chain that it remembers: build it with add_chain(part, ...)")
    if not part.tcas:
        raise Outside(part, "has no TCA")
    for tca in part.tcas:
        if not isinstance(tca.spec, TcaSpec):
            what = f"has the muscle {tca.name!r} in the body {_first(tca)!r}, a"
            raise Outside(part, f"{what} {type(tca.spec).__name__} and no TCA")
    for spine in part.spines:
        body = model.body(int(model.jnt_bodyid[model.joint(spine.joints[0][0]).id])).name
        what = f"has the shape-memory spine {spine.name!r} in the body {body!r}, whose temperature"
        raise Outside(part, f"{what} is not said")
    for number in range(model.neq):
        bodies = [_held(model, number, int(which[number])) for which in
                  (model.eq_obj1id, model.eq_obj2id)]  # fmt: skip
        what = f"has the equality {model.equality(number).name!r} of {' and '.join(bodies)}"
        raise Outside(part, f"{what}, which closes a loop")
    names = {tca.name for tca in part.tcas}
    for number in range(model.ntendon):
        if model.tendon(number).name not in names and not _is_spring(model, number):
            what = f"has the tendon {model.tendon(number).name!r}, which is no TCA's and no spring"
            raise Outside(part, what)
    for number in range(model.nu):
        if model.actuator(number).name not in names:
            what = f"has the actuator {model.actuator(number).name!r}"
            if int(model.actuator_trntype[number]) == int(mujoco.mjtTrn.mjTRN_JOINT):
                joint = int(model.actuator_trnid[number, 0])
                what += f" on the body {model.body(int(model.jnt_bodyid[joint])).name!r}"
            raise Outside(part, f"{what}, which is no TCA's")
    odd = (model.jnt_limited != 0) | (model.dof_frictionloss[model.jnt_dofadr] > 0.0)
    for number in np.flatnonzero(odd).tolist():
        body = model.body(int(model.jnt_bodyid[number])).name
        what = f"has limits or dry friction in the joint {model.joint(number).name!r}"
        raise Outside(part, f"{what} of the body {body!r}")


def _is_spring(model: mujoco.MjModel, number: int) -> bool:
    """Whether a tendon is straight and pulls in proportion to what it is too long, no more."""
    first, count = int(model.tendon_adr[number]), int(model.tendon_num[number])
    straight = count == 2 and (model.wrap_type[first : first + 2] == _SITE).all()
    more = (model.tendon_stiffnesspoly[number], model.tendon_frictionloss[number])
    proportional = not any(np.any(each) for each in more) and not model.tendon_limited[number]
    pulls = model.tendon_stiffness[number] > 0.0 and model.tendon_lengthspring[number, 0] == 0.0
    return bool(straight and proportional and pulls)


def _first(tca: RoutedTca) -> str:
    return tca.runs[0].chain.body(0)


def _held(model: mujoco.MjModel, number: int, which: int) -> str:
    """What an equality holds."""
    kind = int(model.eq_objtype[number])
    joints = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)
    if int(model.eq_type[number]) in joints:
        return "its joints or tendons"
    name = mujoco.mj_id2name(model, kind, which) or "world"
    return f"the {'body' if kind == int(mujoco.mjtObj.mjOBJ_BODY) else 'site'} {name!r}"


def _odd_joints(
    model: mujoco.MjModel, body: int, mine: Mapping[str, int], asked: set[str]
) -> str:
    """What is said of a body whose joints are not those of a node."""
    name = model.body(body).name
    more = sorted(set(mine) - asked)
    if not more:
        return f"has lost the joint {min(asked - set(mine))!r} of the body {name!r}"
    free = int(model.jnt_type[mine[more[0]]]) == int(mujoco.mjtJoint.mjJNT_FREE)
    return (f"has the{' free' if free else ''} joint {more[0]!r} in the body {name!r}, which is of"
            " no chain that it remembers")  # fmt: skip

"""What is certified: each module as it is built and as theory sees it, and where it works.

A new module or limb is one more function and one more entry of ``SUBJECTS``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

from tca_mj.certify.parts import Limb, Seen
from tca_mj.certify.solid import Solid, solid
from tca_mj.model.chain import MOTIONS, Member
from tca_mj.model.part import Part
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.bistable import BistableSpec, bistable_module
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.innervated import InnervatedFingerSpec, innervated_finger
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.modules.morphing_square import (
    Morphing3dSpec,
    TwistMorphingSpec,
    morphing_3d_module,
    twist_morphing_module,
)
from tca_mj.modules.soft_finger import SoftFingerSpec, soft_finger
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.robots.adaptive_gripper import AdaptiveGripperSpec, hardened_gripper
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.robots.morphing_grid import MorphingGridSpec, morphing_grid
from tca_mj.rod import BeamSpec, Segment, StrandLaw
from tca_mj.smp import HOLD_TEMPERATURE
from tca_mj.tca import TcaSpec, with_tca

# Axes of the fingers' bases in the mount, as columns: z to its +x or -x, x to its -z.
_FINGERS = (
    ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)),
    ((0.0, 0.0, -1.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)),
)


@dataclass(frozen=True, kw_only=True, slots=True)
class Subject:
    """A module or a robot's limb.

    Attributes:
        what: What it is, in a few words.
        nodes: Its default numbers of nodes, from base to tip.
        build: The built part with that many times the default nodes, its base held.
        tcas: Its TCAs.
        limbs: The same for theory, one limb per tip, from the laws of its TCAs.
        tips: Sites at the ends of the limbs.
        postures: Which way the base is held: "hanging", "lying", "standing".
        force: Largest force on a tip [N].
        moment: Largest moment on a tip [N m].
        mirrored: Whether the loads on the second tip mirror those on the first, x to -x, and
            gravity keeps that mirror.
        plane: Whether all loads lie in the plane of x and z, as the chain bends in no other one.
        down: Direction in which the module hangs, shape (3,).
        temperature: Coldest and hottest a TCA becomes [°C].
        solver: Which solver of the theory is asked first.
        timestep: Of its simulation; None for the default one [s].
    """

    what: str
    nodes: tuple[int, ...]
    build: Callable[[int], Part]
    tcas: tuple[TcaSpec, ...]
    limbs: Callable[[Sequence[StrandLaw]], tuple[Limb, ...]]
    tips: tuple[str, ...] = ("tip",)
    postures: tuple[str, ...] = ("hanging", "lying", "standing")
    force: float = 0.0
    moment: float = 0.0
    mirrored: bool = False
    plane: bool = False
    down: tuple[float, float, float] = (0.0, 0.0, 1.0)
    temperature: tuple[float, float] = (25.0, 160.0)
    solver: str = "shooting"
    timestep: float | None = None

    @property
    def reach(self) -> tuple[float, ...]:
        """Length of the soft bodies on the way to each tip [m]."""
        limbs = self.limbs([slack] * len(self.tcas))
        return tuple(
            sum(limb.segments[i].beam.length for i in limb.way(tip))
            for limb in limbs for tip in limb.tips
        )  # fmt: skip


_ROOM = 25.0  # temperature of a cold spine [°C]


def slack(length: float) -> tuple[float, float]:
    """The law of a TCA that does not pull."""
    return 0.0, 0.0


def _finer(spec: Any, times: int) -> Any:
    return replace(spec, nodes=times * spec.nodes)


def read(part: Part, *, what: str, build: Callable[[int], Part] | None = None,
         tips: Mapping[str, str] | None = None, beams: Mapping[str, BeamSpec] | None = None,
         starts: Mapping[str, tuple[float, float, float]] | None = None,
         **more: Any) -> Subject:  # fmt: skip
    """A part as a subject, to theory what the part remembers of itself.

    Args:
        part: The part; it stays as it is.
        what: What it is, in a few words.
        build: The built part with that many times the default nodes; None if that cannot be.
        tips: Sites at the ends of chains that are looked at, by the chains' names; None for all
            ends.
        beams: For chains that are not what they were built as, by name, what they are.
        starts: Curvatures with which chains set out to theory, by name, as in ``Segment``.
        **more: Other fields of the subject.

    Raises:
        Outside: If theory does not cover it.
    """
    seen = Seen(part, beams, starts)

    def copied(times: int) -> Part:
        """The part with sites at the ends of its chains."""
        own = part.copy()
        for member in seen.chains:
            body = own.spec.body(member.body(member.nodes))
            body.add_site(name=_end(member), pos=[0.0, 0.0, member.local(member.nodes)], group=4)
        return own

    def limbs(laws: Sequence[StrandLaw]) -> tuple[Limb, ...]:
        return (seen.limb(laws, tips=tips),)

    return Subject(
        what=what, nodes=tuple(member.nodes for member in seen.chains), build=build or copied,
        tcas=tuple(tca.spec for tca in part.tcas), limbs=limbs,
        tips=tuple(tips.values()) if tips else tuple(_end(member) for member in seen.chains),
        solver="energy" if seen.branches or seen.sprung else "shooting", **more,
    )  # fmt: skip


def _end(member: Member) -> str:
    return f"{member.name}.certified"


def _module(
    module: Callable[[Any], Part], spec: Any, what: str, force: float, moment: float
) -> Subject:
    """A module of one body."""

    def build(times: int) -> Part:
        return module(_finer(spec, times))

    return read(build(1), what=what, build=build, tips={"body": "tip"}, force=force, moment=moment)


def _bending(spec: BendingSpec) -> Subject:
    what = f"bending module, {spec.count} parallel TCAs"
    return _module(bending_module, spec, what, force=5e-3, moment=2e-5)


def _innervated(spec: InnervatedFingerSpec) -> Subject:
    def build(times: int) -> Part:
        return innervated_finger(replace(spec, cylinder=_finer(spec.cylinder, times)))

    return read(
        build(1), what="innervated finger, 3 parallel TCAs with slack", build=build,
        tips={"body": "tip"}, force=5e-3, moment=2e-5, temperature=(25.0, 130.0),
    )  # fmt: skip


def _twisting(spec: TwistingSpec) -> Subject:
    how = "double helix of 2.5 turns" if spec.double else f"helix of {spec.turns:g} turns"
    what = f"twisting module, {how}"
    return _module(twisting_module, spec, what, force=2e-2, moment=1e-4)


def _morphing(
    module: Callable[[Any], Part], spec: Any, what: str,
    curvature: tuple[float, float, float] | None = None, **more: Any,
) -> Subject:  # fmt: skip
    """A module with a shape-memory spine: hot, or cold and fixed in a curvature [1/m]."""
    temperature = HOLD_TEMPERATURE if curvature is None else _ROOM
    fixed = {"spine": curvature} if curvature is not None else None

    def build(times: int) -> Part:
        return solid(module(_finer(spec, times)), temperature, fixed).part

    part, beams = solid(module(spec), temperature, fixed)
    return read(part, what=what, build=build, tips={"spine": "tip"}, beams=beams, **more)


def _finger(spec: FingerPairSpec) -> Subject:
    def build(times: int) -> Part:
        return finger_pair(_finer(spec, times))

    def halved(law: StrandLaw, length: float) -> tuple[float, float]:
        """The TCA's law over the length in one finger, where it is the same in both."""
        tension, slope = law(2.0 * length)
        return tension, 2.0 * slope

    def limbs(laws: Sequence[StrandLaw]) -> tuple[Limb, ...]:
        body = replace(
            spec.body, line_density=spec.body.line_density + 0.5 * tcas[0].mass / spec.body.length
        )
        place = (0.0, 0.0, spec.thickness / 2.0)
        strands = ((spec.route,), (partial(halved, laws[0]),))
        return tuple(
            Limb((Segment(body, *strands, rotation=frame, offset=place),), ((0,),),
                 (f"finger{side}",), ((0, spec.nodes),), (0,))
            for side, frame in enumerate(_FINGERS)
        )  # fmt: skip

    tcas = tuple(tca.spec for tca in build(1).tcas)
    return Subject(
        what="pair of fingers, one U through both", nodes=(spec.nodes,),
        build=build, tcas=tcas, limbs=limbs,
        tips=("tip0", "tip1"), force=2e-2, moment=5e-5, mirrored=True,
    )  # fmt: skip


def _arm(spec: ArmSpec) -> Subject:
    """Bending module and wrist in series; the hand is a rigid mass."""
    hand = finger_pair(spec.gripper)
    mass = spec.gripper.body.mass * 2.0 + hand.tcas[0].spec.mass
    # The closed hand is a ring; its centre lies on the axis.
    ring = spec.gripper.length / (2.0 * spec.gripper.closure)
    centre = spec.connector + spec.gripper.thickness / 2.0 + ring

    def build(times: int) -> Part:
        part = arm(replace(spec, bending=_finer(spec.bending, times),
                           twisting=_finer(spec.twisting, times)))  # fmt: skip
        mjspec = part.spec
        for name in ("lift", "gripper.tca"):
            mjspec.delete(mjspec.actuator(name))
        mjspec.delete(mjspec.tendon("gripper.tca"))
        mjspec.delete(mjspec.joint("lift"))
        for side in range(2):
            mjspec.delete(mjspec.body(f"gripper.finger{side}.piece0"))
        tip = mjspec.site("wrist.tip")
        body = tip.parent.add_body(name="hand", pos=tip.pos)
        body.ipos, body.mass, body.inertia = [0.0, 0.0, centre], mass, [1e-8, 1e-8, 1e-8]
        body.explicitinertial = 1
        return Part(mjspec, part.tcas[:-1])

    return read(
        build(1), what="arm: bending module and wrist, the hand a mass", build=build,
        tips={"wrist.body": "wrist.tip"}, postures=("hanging",), force=5e-3, moment=2e-5,
        down=(0.0, 0.0, -1.0),
    )  # fmt: skip


def _soft_finger(spec: SoftFingerSpec) -> Subject:
    return _module(soft_finger, spec, "finger of the adaptive gripper", force=5e-2, moment=2e-4)


def _adaptive(spec: AdaptiveGripperSpec, angle: float) -> Subject:
    """The adaptive gripper, its base hardened in an angle; of a tree only one tip can be loaded."""

    def build(times: int) -> Part:
        finer = replace(spec, base=_finer(spec.base, times), fingers=_finer(spec.fingers, times))
        return hardened_gripper(finer, angle)

    return read(
        build(1), what=f"adaptive gripper, its base hardened at {math.degrees(angle):.0f}°",
        build=build, tips={f"finger{i}.body": f"finger{i}.tip" for i in range(2)},
        postures=("hanging",),
    )  # fmt: skip


def _grid_member(spec: MorphingGridSpec, what: str, **more: Any) -> Subject:
    """A grid of a single member, with the junction at its end."""
    end = "x0.0.end"

    def elastic(times: int) -> Solid:
        finer = replace(spec, member=_finer(spec.member, times))
        found = solid(morphing_grid(finer), HOLD_TEMPERATURE)
        (member,) = found.part.members.values()
        body = found.part.spec.body(member.body(member.nodes))
        body.add_site(name=end, pos=[0.0, 0.0, member.local(member.nodes)])
        return found

    part, beams = elastic(1)
    return read(
        part, what=what, build=lambda times: elastic(times).part, tips={"x0.0": end}, beams=beams,
        **more,
    )  # fmt: skip


def _bistable(spec: BistableSpec, state: int) -> Subject:
    """The module in one of its states; to state 1 theory sets out from a spine curved that way."""

    def build(times: int) -> Part:
        return bistable_module(_finer(spec, times), collide=False)

    side = (-1.0, 1.0)[state - 1]
    return read(
        build(1), what=f"bistable module in state {state}", build=build, tips={"body": "tip"},
        beams={"body": spec.body}, starts={"body": (0.0, side * spec.body.curvature[1], 0.0)},
        force=5e-2, moment=2e-4, plane=True, timestep=5e-4,
    )  # fmt: skip


_QUARTER, _HALF = 0.5 * math.pi, math.pi
_ACROSS = 1.0  # direction of the bend of the module that bends to any side [rad]
# Largest loads on morphing modules. Cold: 15 g at the end, Sun, Fig. 6.1. Hot they weigh as much as
# a soft spine bears: the published one falls over when it stands, and so does the square one.
_SOFT: dict[str, Any] = {"force": 1e-2, "moment": 2e-4, "temperature": (25.0, 140.0)}
_STIFF: dict[str, Any] = {"force": 0.147, "moment": 2e-3, "temperature": (25.0, 30.0)}
_HANGS: dict[str, Any] = {"postures": ("hanging", "lying")}


def _with(spec: Any, tca: TcaSpec | None) -> Any:
    """A module's specification with a muscle; None for its own."""
    return spec if tca is None else with_tca(spec, tca)


# What is certified, made when it is asked for, by name; with a muscle in place of its own.
SUBJECTS: Mapping[str, Callable[..., Subject]] = MappingProxyType({
    "bending": lambda tca=None: _bending(_with(BendingSpec(), tca)),
    "twisting": lambda tca=None: _twisting(_with(TwistingSpec(), tca)),
    "twisting-single": lambda tca=None: _twisting(_with(TwistingSpec(double=False, nodes=16), tca)),
    "innervated": lambda tca=None: _innervated(_with(InnervatedFingerSpec(), tca)),
    "finger": lambda tca=None: _finger(_with(FingerPairSpec(), tca)),
    "soft-finger": lambda tca=None: _soft_finger(_with(SoftFingerSpec(), tca)),
    "bistable-1": lambda tca=None: _bistable(_with(BistableSpec(), tca), 1),
    "bistable-2": lambda tca=None: _bistable(_with(BistableSpec(), tca), 2),
    "adaptive-gripper": lambda tca=None: _adaptive(_with(AdaptiveGripperSpec(), tca), _HALF),
    "arm": lambda tca=None: _arm(_with(ArmSpec(), tca)),
    "morphing": lambda tca=None: _morphing(
        morphing_module, _with(MorphingSpec(motions=MOTIONS), tca),
        "morphing module, soft", **_SOFT, **_HANGS),
    "morphing-cold": lambda tca=None: _morphing(
        morphing_module, _with(MorphingSpec(motions=MOTIONS), tca),
        "morphing module, fixed at 180°",
        (_HALF / MorphingSpec().spine.length, 0.0, 0.0), **_STIFF),
    "morphing-twist": lambda tca=None: _morphing(
        twist_morphing_module, _with(TwistMorphingSpec(), tca),
        "morphing module that twists, soft", **_SOFT),
    "morphing-twist-cold": lambda tca=None: _morphing(
        twist_morphing_module, _with(TwistMorphingSpec(), tca),
        "morphing module that twists, fixed at -90°",
        (0.0, 0.0, -_QUARTER / TwistMorphingSpec().spine.length), **_STIFF),
    "morphing-3d": lambda tca=None: _morphing(
        morphing_3d_module, _with(Morphing3dSpec(), tca),
        "morphing module that bends to any side, soft", **_SOFT, **_HANGS),
    "morphing-3d-cold": lambda tca=None: _morphing(
        morphing_3d_module, _with(Morphing3dSpec(), tca),
        "the same, fixed at 90° between two TCAs",
        (-math.sin(_ACROSS) * _QUARTER / Morphing3dSpec().spine.length,
         math.cos(_ACROSS) * _QUARTER / Morphing3dSpec().spine.length, 0.0), **_STIFF),
    "grid-member": lambda tca=None: _grid_member(
        _with(MorphingGridSpec(rows=1, columns=2, member=replace(
            MorphingGridSpec().member, motions=MOTIONS)), tca),
        "grid of a single member, soft", **_SOFT),
})  # fmt: skip

"""What is certified: each module as it is built and as theory sees it, and where it works.

A new module or limb is one more function and one more entry of ``SUBJECTS``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

from tca_mj.model.part import Part
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.rod import BeamSpec, Segment, StrandLaw
from tca_mj.routes import Route, parallel
from tca_mj.tca import TcaSpec

# Axes of the fingers' bases in the mount, as columns: z to its +x or -x, x to its -z.
_FINGERS = (
    ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)),
    ((0.0, 0.0, -1.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)),
)
_DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))  # axes of the arm's base

class Limb(NamedTuple):
    """Soft bodies in series from the base to one tip, as theory sees them.

    Attributes:
        segments: The bodies.
        tcas: For each of them, which of the part's TCAs its strands are.
        chains: For each of them, the name of its chain in the part.
    """

    segments: tuple[Segment, ...]
    tcas: tuple[tuple[int, ...], ...]
    chains: tuple[str, ...]


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
        down: Direction in which the module hangs, shape (3,).
        temperature: Coldest and hottest a TCA becomes [°C].
    """

    what: str
    nodes: tuple[int, ...]
    build: Callable[[int], Part]
    tcas: tuple[TcaSpec, ...]
    limbs: Callable[[Sequence[StrandLaw]], tuple[Limb, ...]]
    tips: tuple[str, ...] = ("tip",)
    postures: tuple[str, ...] = ("hanging", "lying", "standing")
    force: float
    moment: float
    mirrored: bool = False
    down: tuple[float, float, float] = (0.0, 0.0, 1.0)
    temperature: tuple[float, float] = (25.0, 160.0)

    @property
    def reach(self) -> tuple[float, ...]:
        """Length of the soft bodies of each limb [m]."""
        limbs = self.limbs([slack] * len(self.tcas))
        return tuple(sum(each.beam.length for each in limb.segments) for limb in limbs)


def slack(length: float) -> tuple[float, float]:
    """The law of a TCA that does not pull."""
    return 0.0, 0.0


def _tcas(build: Callable[[int], Part]) -> tuple[TcaSpec, ...]:
    return tuple(tca.spec for tca in build(1).tcas)


def _loaded(body: BeamSpec, tcas: Sequence[TcaSpec], share: float = 1.0) -> BeamSpec:
    """A body that carries the mass of its TCAs, or a share of it."""
    more = sum(tca.mass for tca in tcas) * share / body.length
    return replace(body, line_density=body.line_density + more)


def _finer(spec: Any, times: int) -> Any:
    return replace(spec, nodes=times * spec.nodes)


def _module(
    module: Callable[[Any], Part], spec: Any, routes: Sequence[Route], what: str, force: float,
    moment: float,
) -> Subject:  # fmt: skip
    """A module of one body, its TCAs on routes through it."""

    def build(times: int) -> Part:
        return module(_finer(spec, times))

    def limbs(laws: Sequence[StrandLaw]) -> tuple[Limb, ...]:
        segment = Segment(_loaded(spec.body, tcas), routes, laws)
        return (Limb((segment,), (tuple(range(len(routes))),), ("body",)),)

    tcas = _tcas(build)
    return Subject(what=what, nodes=(spec.nodes,), build=build, tcas=tcas, limbs=limbs,
                   force=force, moment=moment)  # fmt: skip


def _bending(spec: BendingSpec) -> Subject:
    what, routes = f"bending module, {spec.count} parallel TCAs", parallel(spec.count, spec.offset)
    return _module(bending_module, spec, routes, what, force=5e-3, moment=2e-5)


def _twisting(spec: TwistingSpec) -> Subject:
    how = "double helix of 2.5 turns" if spec.double else f"helix of {spec.turns:g} turns"
    what = f"twisting module, {how}"
    return _module(twisting_module, spec, (spec.route,), what, force=2e-2, moment=1e-4)


def _finger(spec: FingerPairSpec) -> Subject:
    def build(times: int) -> Part:
        return finger_pair(_finer(spec, times))

    def halved(law: StrandLaw, length: float) -> tuple[float, float]:
        """The TCA's law over the length in one finger, where it is the same in both."""
        tension, slope = law(2.0 * length)
        return tension, 2.0 * slope

    def limbs(laws: Sequence[StrandLaw]) -> tuple[Limb, ...]:
        body = _loaded(spec.body, tcas, share=0.5)
        place = (0.0, 0.0, spec.thickness / 2.0)
        strands = ((spec.route,), (partial(halved, laws[0]),))
        return tuple(
            Limb((Segment(body, *strands, rotation=frame, offset=place),), ((0,),),
                 (f"finger{side}",))
            for side, frame in enumerate(_FINGERS)
        )  # fmt: skip

    tcas = _tcas(build)
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

    def limbs(laws: Sequence[StrandLaw]) -> tuple[Limb, ...]:
        bending, twisting = spec.bending, spec.twisting
        count = bending.count
        end = spec.connector_mass + mass
        first = Segment(
            _loaded(bending.body, tcas[:count]), parallel(count, bending.offset), laws[:count],
            rotation=_DOWN, mass=spec.connector_mass, centre=(0.0, 0.0, spec.connector / 2.0),
        )  # fmt: skip
        second = Segment(
            _loaded(twisting.body, tcas[count:]), (twisting.route,), laws[count:],
            offset=(0.0, 0.0, spec.connector), mass=end,
            centre=(0.0, 0.0, (spec.connector_mass * spec.connector / 2.0 + mass * centre) / end),
        )  # fmt: skip
        chains = ("bending.body", "wrist.body")
        return (Limb((first, second), (tuple(range(count)), (count,)), chains),)

    tcas = _tcas(build)
    return Subject(
        what="arm: bending module and wrist, the hand a mass",
        nodes=(spec.bending.nodes, spec.twisting.nodes), build=build, tcas=tcas, limbs=limbs,
        tips=("wrist.tip",), postures=("hanging",), force=5e-3, moment=2e-5, down=(0.0, 0.0, -1.0),
    )  # fmt: skip


# What is certified, made when it is asked for, by name.
SUBJECTS: Mapping[str, Callable[[], Subject]] = MappingProxyType({
    "bending": lambda: _bending(BendingSpec()),
    "twisting": lambda: _twisting(TwistingSpec()),
    "twisting-single": lambda: _twisting(TwistingSpec(double=False, nodes=16)),
    "finger": lambda: _finger(FingerPairSpec()),
    "arm": lambda: _arm(ArmSpec()),
})  # fmt: skip

"""What the grippers hold, by rod theory; facts about the adaptive one (Sun, Section 6.3.1)."""

import math

import numpy as np

from tca_mj.agents.scripts.adaptive import AdaptiveGains
from tca_mj.checks import Array
from tca_mj.envs.adaptive import OBJECTS
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.soft_finger import SoftFingerSpec
from tca_mj.robots.adaptive_gripper import AdaptiveGripperSpec
from tca_mj.rod import RodShape, solve_static
from tca_mj.smp.lumped import in_tube
from tca_mj.tca import law_at
from tca_mj.validation.facts import Finding, finding

GRAVITY = 9.81  # [m/s²]
_HOTTEST = 160.0  # up to which the TCAs' law was measured [°C]

_ROUNDS = 5  # of the search for where a force acts; each gains a digit


def pinched(forces: Array, temperature: float = 25.0, *, shearable: bool = True) -> Array:
    """Width of a block that the finger pair presses with some force, by rod theory [m].

    The ends of the fingers lean towards each other, so that they press by their inner edges, half
    their thickness from the axis.

    Args:
        forces: Force of each finger, shape (n,) [N].
        temperature: Temperature of the TCA [°C].
        shearable: Whether the fingers shear; chains do not.
    """
    spec = FingerPairSpec()
    length = finger_pair(spec).tcas[0].spec.rest_length / 2.0
    law = law_at(spec.embedded.of_length(length), temperature)
    edge, widths = np.array([-spec.thickness / 2.0, 0.0, 0.0]), []
    for force in forces:
        push, lever = np.array([0.0, 0.0, float(force)]), np.zeros(3)
        for _ in range(_ROUNDS):
            shape = solve_static(
                spec.body, [spec.route], [law], tip_force=push, tip_moment=np.cross(lever, push),
                shearable=shearable,
            )  # fmt: skip
            lever = shape.rotation[-1] @ edge
        widths.append(2.0 * float(shape.tip[2] + lever[2]))
    return np.array(widths)


def findings() -> list[Finding]:
    """All of them, in some seconds."""
    return [base(), grip()]


def base() -> Finding:
    """Which angle each object asks for, and what fingers on a flat base can reach."""
    spec, gains = AdaptiveGripperSpec(), AdaptiveGains()
    angles = [
        math.degrees(spec.angle_for(thing.width + 2.0 * gains.clearance))
        for thing in OBJECTS.values()
    ]
    pads = []
    for temperature in (60.0, 100.0, 130.0, _HOTTEST):
        shape = _finger(spec.fingers, temperature, 0.0)
        inwards = float((shape.rotation[-1] @ [spec.fingers.face, 0.0, 0.0])[2])
        pads.append(spec.base.spine.length + 2.0 * (float(shape.tip[2]) + inwards))
    widest = max(thing.width for thing in OBJECTS.values())
    return finding(
        "adaptive-base", max(angles) - min(angles), max(angles) < 240.0 and min(pads) > widest,
        listed=", ".join(f"{angle:.0f}" for angle in angles), flat=1e3 * min(pads),
        widest=1e3 * widest,
    )  # fmt: skip


def grip() -> Finding:
    """Friction of the two pads over the weight of each object, at the script's temperatures."""
    spec, gains = SoftFingerSpec(), AdaptiveGains()
    shares = []
    for thing in OBJECTS.values():
        press = pressed(spec, gains.warm + gains.per_mass * thing.mass, gains.clearance)
        shares.append(2.0 * spec.friction * press / (thing.mass * GRAVITY))
    listed = ", ".join(f"{share:.1f}" for share in shares)
    return finding("adaptive-grip", min(shares), min(shares) > 1.0, listed=listed)


def pressed(spec: SoftFingerSpec, temperature: float, way: float) -> float:
    """Force with which a finger presses what it touches so far from where it hangs straight [N].

    Args:
        spec: The finger.
        temperature: Temperature of its TCA [°C].
        way: The way [m].
    """
    low, high = 0.0, 1.0
    for _ in range(20):  # the way falls with the force
        middle = 0.5 * (low + high)
        far = float(_finger(spec, temperature, middle).tip[0]) > way
        low, high = (middle, high) if far else (low, middle)
    return 0.5 * (low + high)


def _finger(spec: SoftFingerSpec, temperature: float, force: float) -> RodShape:
    """The weightless finger, pushed outwards at its end."""
    tca = in_tube(spec.tca).of_length(2.0 * spec.length)
    law = law_at(tca, temperature)
    return solve_static(spec.body, [spec.route], [law], tip_force=(-force, 0.0, 0.0))

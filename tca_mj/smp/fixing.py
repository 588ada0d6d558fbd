"""Shape fixing on cooling and shape recovery on heating, as a value and pure functions.

Two networks act in parallel on every joint (or on every section's curvature):

* the rubbery network, of constant modulus, which is stress-free in the memorised shape;
* the glassy network, whose modulus E_g(T) = E(T) - rubbery comes and goes with temperature. Glass
  that forms is stress-free in the shape of that moment; glass that melts takes its stress along.

With q the angle, the stress over the modulus is

    E_r (q - memory) + E_g (q - frozen)        E_g' frozen' = E_g frozen + (E_g' - E_g) q  growing
                                               frozen' = frozen                            melting

Both are one linear spring E (q - reference) with E = E_r + E_g. On cooling its reference moves by
reference' = q - (E/E') (q - reference): the torque does not change when glass forms. Melting
drops the energy ½ E_g (q - frozen)² in proportion, forming adds none, so that no course of
temperatures yields work that was not put in. A frozen part that grows and stores the strain of its
moment is the idea of Liu et al., Int. J. Plasticity 22, 279 (2006).

Glass melts in proportion, not last in first out: a temperature that goes up and down inside the
transition lets a loaded spine creep towards the shape that the rubbery network alone would hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, Temperatures, door, instance, within
from tca_mj.smp.material import SmpSpec
from tca_mj.tca.arrays import ZERO, frozen

_LEAST = frozen(5e-324)  # the least number that is not 0


@dataclass(frozen=True, slots=True, eq=False)
class SpineState:
    """State of n joints, each array of shape (..., n).

    Attributes:
        memory: Memorised angle of each joint [rad].
        frozen: Angle at which the glass of each joint is stress-free [rad].
        glass: Modulus E_g of the glass [Pa].
    """

    memory: Array
    frozen: Array
    glass: Array

    @classmethod
    @door
    def rest(cls, smp: SmpSpec, memory: ArrayLike, temperature: ArrayLike = 25.0) -> SpineState:
        """A spine in its memorised shape at a temperature, without stress.

        Raises:
            ValueError: If a number is not finite.
        """
        memory = within("memory", memory)
        glass = np.broadcast_arrays(smp.glass(temperature), memory)[0].copy()
        return cls(memory + np.zeros_like(glass), memory + np.zeros_like(glass), glass)


class Spring(NamedTuple):
    """The linear spring that a joint is at present, each array of shape (..., n).

    Attributes:
        modulus: Young's modulus E; times I/ds it is the joint's stiffness [Pa].
        reference: Angle without torque [rad].
    """

    modulus: Array
    reference: Array


def advance(
    smp: SmpSpec, state: SpineState, angle: ArrayLike, temperature: ArrayLike
) -> SpineState:
    """Lets glass form or melt until it is that of a temperature, at a constant angle.

    Exact for a constant angle, whatever the size of the change of temperature, as long as it goes
    one way; halves of a change give what the whole gives.

    Args:
        smp: The material.
        state: State at the start, shape (..., n).
        angle: Angle of each joint meanwhile, shape (..., n) [rad].
        temperature: Temperature at the end, shape (..., n), or one for all joints [°C].

    Returns:
        State at the end, same shape.

    Raises:
        ValueError: If a number is not finite.
    """
    instance("smp", smp, SmpSpec)
    instance("state", state, SpineState)
    glass = smp.glass(temperature) + np.zeros_like(state.glass)
    return with_glass(state, within("angle", angle), glass)


def with_glass(state: SpineState, angle: Array, glass: Array) -> SpineState:
    """``advance`` to a modulus of the glass, which is not below 0. Nothing is checked."""
    # Share of new glass in all of it; without any glass there is nothing to move.
    share = np.maximum(glass - state.glass, ZERO)
    share /= np.maximum(glass, _LEAST)
    return SpineState(state.memory, state.frozen + share * (angle - state.frozen), glass)


def spring(smp: SmpSpec, state: SpineState) -> Spring:
    """Both networks as one spring; torque = modulus (I/ds) (angle - reference).

    Args:
        smp: The material.
        state: State, shape (..., n).
    """
    instance("smp", smp, SmpSpec)
    instance("state", state, SpineState)
    modulus = state.glass + smp.rubbery
    share = state.glass / modulus
    return Spring(modulus, state.memory + share * (state.frozen - state.memory))


@door
def stored_energy(smp: SmpSpec, state: SpineState, angle: ArrayLike) -> Array:
    """Elastic energy of each joint over I/ds, shape (..., n) [Pa rad²].

    ½ E_r (q - memory)² + ½ E_g (q - frozen)²; what layers of glass frozen at different angles
    store against each other is not in it, because it never does work.

    Args:
        smp: The material.
        state: State of the joints, shape (..., n).
        angle: Their angles q, shape (..., n) [rad].

    Raises:
        ValueError: If an angle is not finite.
    """
    angle = within("angle", angle)
    soft, hard = angle - state.memory, angle - state.frozen
    return 0.5 * (smp.rubbery * soft * soft + state.glass * hard * hard)


@door
def fixity(smp: SmpSpec, hot: Temperatures, cold: Temperatures) -> Array:
    """Share of a deformation kept after cooling under load and unloading, 1 - E_hot/E_cold [1].

    Args:
        smp: The material.
        hot: Temperature at which it was deformed [°C].
        cold: Temperature at which it is unloaded [°C].
    """
    return 1.0 - smp.modulus(hot) / smp.modulus(cold)


@door
def recovery(smp: SmpSpec, hot: Temperatures) -> Array:
    """Share of a fixed deformation that heating without load takes back, E_r/E(hot) [1].

    Args:
        smp: The material.
        hot: Temperature to which it is heated [°C].
    """
    return smp.rubbery / smp.modulus(hot)

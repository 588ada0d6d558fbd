"""The coupled step of TCAs, spines and body, over any axes of simulations before all others.

A period goes: where is the body (``measure``), what do heat and power make of TCAs and spines
there (``advance``), and what has MuJoCo to know of it until the next one (``write``). One
simulation and a batch of them call the same functions; each element of a result depends on its own
simulation alone.

The TCAs' law F(l, T) is handed to MuJoCo linearised in the length, F + k (l' - l), as a native
actuator that MuJoCo evaluates in every physics step. Holding the tension constant instead would
make a stiff TCA a delayed spring, which oscillates.

MuJoCo leaves a force that is clamped out of its implicit step: a slack TCA has no stiffness. In
the unloaded shape cold TCAs are just between slack and taut, and the sign of a rounding would
decide; a first step from rest differs by a tenth between the two. Every TCA therefore pulls
1e-10 N more than its law, far above any rounding and far below any weight: at rest it is taut.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tca_mj.model.smooth import SmoothBody, Strained
from tca_mj.model.spines import Spines
from tca_mj.tca import Pull, TcaBank, TcaState
from tca_mj.tca.arrays import ZERO, frozen

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_TAUT = frozen(1e-10)  # tension added to each TCA's law, so that at rest it is taut [N]


class Inputs(NamedTuple):
    """What drives TCAs and spines for a period.

    Attributes:
        command: Command of the TCAs, in the unit of their supply, shape (..., n).
        voltage: Voltage of the spines' heaters, shape (..., spines) [V].
        fan: Whether air is blown at the spines, shape (..., spines).
    """

    command: Array
    voltage: Array
    fan: Flags


Writes = tuple[Array, Array, Array, Array]
"""What a model gets until the next period: forces of the actuators, affine in the tendons' lengths,
constants and then slopes, shape (..., 2 n) [N, N/m]; stiffness, reference and damping of the joints
of the cells, shape (..., j) each."""


def measure(
    body: SmoothBody, bank: TcaBank, qpos: Array, offset: Array
) -> tuple[Strained, Array, Flags]:
    """The cells, the TCAs' lengths [m], and which of these have a law, shape (..., n) each."""
    strained = body.at(qpos)
    length = strained.length + offset
    return strained, length, (length > bank.shortest) & (length < bank.longest)


def advance(
    bank: TcaBank,
    spines: Spines,
    tca: TcaState,
    inputs: Inputs,
    *,
    length: Array,
    motion: Array,
    gain: Array | float,
    period: float,
) -> tuple[TcaState, Pull]:
    """Heats TCAs and spines for a period; the spines change in place.

    Args:
        bank: The TCAs.
        spines: The spines.
        tca: Thermal state of the TCAs.
        inputs: What drives them.
        length: Lengths of the TCAs, shape (..., n) [m].
        motion: Motion of the cells, shape (..., 4, cells).
        gain: Factor of the tensions, shape (..., 1) or a number.
        period: Length of the period [s].

    Returns:
        The thermal state at its end, and the law of the TCAs there.

    Raises:
        ValueError, TcaMelted, CoilSolveError: As ``TcaBank.advance``.
    """
    gain = np.asarray(gain)
    if not spines.n:
        later, pull = bank.advance(tca, inputs.command, length, period)
        return later, Pull(pull.tension * gain, pull.stiffness * gain, length)
    later = bank.warmed(tca, inputs.command, length, period)
    pull = bank.pull(later, length)
    tension = pull.tension * gain
    modulus = spines.advance(inputs.voltage, inputs.fan, motion, period)
    if spines.resist(modulus, tension):
        rise = (pull.tension - bank.pull(tca, length).tension) / period * gain
        spines.judge(modulus, tension, rise)
    return later, Pull(tension, pull.stiffness * gain, length)


def write(
    body: SmoothBody,
    strained: Strained,
    pull: Pull,
    *,
    qpos: Array,
    tendon_length: Array,
    tendon_slope: Array,
    steadiness: float,
) -> Writes:
    """What the models have to know: the TCAs' law, and the springs that go with it.

    Args:
        body: The bodies.
        strained: Their cells at ``qpos``.
        pull: The law about the present lengths.
        qpos: Positions of the models' joints, shape (..., nq).
        tendon_length: Lengths of MuJoCo's tendons there, shape (..., n) [m].
        tendon_slope: Their derivatives, ``ten_J``, shape (..., nJten).
        steadiness: Time over which the damping of taut tendons is made [s].
    """
    tension = np.maximum(pull.tension, ZERO)
    stiffness, reference = body.springs(strained, tension, tendon_slope, qpos)
    constant = pull.stiffness * tendon_length - (pull.tension + _TAUT)
    force = np.concatenate((constant, -pull.stiffness), axis=-1)
    return force, stiffness, reference, body.damped(strained, tension, steadiness)

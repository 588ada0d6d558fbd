"""Silicone round a TCA: the ring's resistance against the diffusion of heat in it."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.finger import FingerPairSpec
from tca_mj.modules.twisting import TwistingSpec
from tca_mj.smp.convection import radiation, still_air
from tca_mj.tca import CATALOGUE, HeatStep
from tca_mj.tca import embedding as silicone
from tca_mj.tca.embedding import ring_conductance, silicone_body
from tca_mj.tca.spec import heat_of

TCA = CATALOGUE["free-stroke"]
VOLUMETRIC = silicone.SILICONE_DENSITY * silicone.SILICONE_SPECIFIC_HEAT


def diffusion(spec, power, time, rings=200):
    """Temperature of a TCA on the wall of a ring of silicone, insulated outside, per metre [°C]."""
    inner = spec.outer_radius
    outer = math.sqrt(inner**2 + spec.body.capacity / VOLUMETRIC / math.pi)
    edges = np.linspace(inner, outer, rings + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    capacity = VOLUMETRIC * math.pi * (edges[1:] ** 2 - edges[:-1] ** 2)
    capacity = np.append(spec.heat.capacity / spec.rest_length, capacity)
    radii = np.append(inner, middle)
    between = 2.0 * math.pi * silicone.SILICONE_CONDUCTIVITY / np.log(radii[1:] / radii[:-1])
    flow = np.zeros((rings + 2, rings + 2))
    for i, g in enumerate(between):
        flow[i, i] -= g / capacity[i]
        flow[i, i + 1] += g / capacity[i]
        flow[i + 1, i + 1] -= g / capacity[i + 1]
        flow[i + 1, i] += g / capacity[i + 1]
    flow[0, -1] = power / capacity[0]
    start = np.zeros(rings + 2)
    start[-1] = 1.0
    return 25.0 + (expm(flow * time) @ start)[0]


@pytest.mark.parametrize(("power", "time"), [(126.0, 2.0), (252.0, 2.0), (126.0, 4.0)])
def test_the_wrists_two_nodes_are_near_diffusion(power, time):
    """14 and 28 W on 111 mm for 2 s: the rise is within 6 %, and nearer later."""
    spec = TwistingSpec().embedded
    exact = diffusion(spec, power, time)
    length = spec.rest_length
    step = HeatStep.of(heat_of([spec]), time)
    hot, _, _ = step.advance(np.full(1, 25.0), np.full(1, 25.0), np.full(1, power * length))
    assert hot[0] - 25.0 == pytest.approx(exact - 25.0, rel=0.06 if time < 3.0 else 0.03)


def test_a_ring_that_warms_evenly():
    """In the quasi-steady state the TCA is q/g above the ring's mean, exactly."""
    spec, power = TwistingSpec().embedded, 50.0
    later = diffusion(spec, power, 60.0)
    own, body = spec.heat.capacity / spec.rest_length, spec.body.capacity
    into = power * body / (own + body)  # what goes into the ring
    mean = 25.0 + (power * 60.0 - own * (later - 25.0)) / body
    assert later - mean == pytest.approx(into / spec.body.conductance, rel=2e-3)


def test_conductance_lies_between_channel_and_ring():
    section, around = 5e-6, 9e-3
    loose, half, tight = (
        silicone_body(TCA, section=section, perimeter=around, touching=share)
        for share in (0.0, 0.5, 1.0)
    )
    inner = TCA.outer_radius
    ring = ring_conductance(inner, math.sqrt(inner**2 + section / math.pi))
    assert tight.conductance == ring
    assert loose.conductance == pytest.approx(1.0 / (1.0 / silicone.CHANNEL_CONTACT + 1.0 / ring))
    assert half.conductance == pytest.approx(0.5 * (loose.conductance + tight.conductance))
    assert loose.capacity == pytest.approx(1070.0 * 1300.0 * section)
    # A gap of air conducts better than free air cools: the fit is on the right side of that.
    assert loose.conductance > TCA.heat.loss / TCA.rest_length
    # And it is what a ring of air of 0.02 to 0.03 W/(m K) conducts, in a channel of 1.5 to 2.5 mm.
    low, high = (2.0 * math.pi * k / math.log(0.5 * d / 0.6e-3)
                 for k, d in ((0.026, 2.5e-3), (0.03, 1.5e-3)))  # fmt: skip
    assert low < silicone.CHANNEL_CONTACT < high


def test_the_body_loses_what_correlations_say():
    """Natural convection from a horizontal cylinder of 9 mm, and radiation, at 45 °C."""
    natural, radiated = still_air(9e-3, 45.0, 25.0), radiation(45.0, 25.0)
    assert natural + radiated == pytest.approx(silicone.BODY_TO_AIR, rel=0.1)


def test_modules_have_all_their_silicone():
    """Capacities of the strands add up to mass times specific heat."""
    bending, gripper, wrist = BendingSpec(), FingerPairSpec(), TwistingSpec()
    for spec, mass, length in (
        (bending.embedded, bending.body.mass / 3.0, bending.length),
        (gripper.embedded, gripper.body.mass / 2.0, gripper.length / 2.0),
    ):
        capacity = spec.body.capacity * length
        assert capacity == pytest.approx(silicone.SILICONE_SPECIFIC_HEAT * mass, rel=1e-12)
    assert wrist.embedded.body.capacity < VOLUMETRIC * math.pi * wrist.tube**2 / 4.0
    assert [tca.spec.body is None for tca in bending_module().tcas] == [False] * 3


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"section": 0.0}, "section"),
        ({"perimeter": math.nan}, "perimeter"),
        ({"perimeter": math.inf}, "perimeter"),
        ({"touching": 1.1}, "touching"),
        ({"touching": -0.1}, "touching"),
    ],
)
def test_bad_bodies_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        silicone_body(TCA, **({"section": 1e-5, "perimeter": 1e-2} | given))


def test_a_ring_needs_two_radii():
    with pytest.raises(ValueError, match="outer"):
        ring_conductance(2e-3, 1e-3)

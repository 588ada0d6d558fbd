"""Shape-memory spines in a simulation: stiffness, fixing, recovery, heat, damage, reset, names."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tca_mj.model.chain import MOTIONS, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.spine import SHEAR_RATIO, RoutedSpine, lumped_torsion, route_spine
from tca_mj.model.tendon import route_passes, route_tca
from tca_mj.rod import BeamSpec
from tca_mj.rod.beam import Outline, torsion_constant
from tca_mj.routes import UTurn
from tca_mj.sim import Simulation
from tca_mj.smp import HeaterSpec, SmpSpec, SpineSpec, fixity, recovery
from tca_mj.smp.bank import SpineBank
from tca_mj.tca import CATALOGUE

SPINE = SpineSpec(length=40e-3)
HEATER = HeaterSpec.fitted(SPINE)
SMP = SPINE.smp
NODES = 3
OWN = 1e-6  # bending stiffness of what is round the spine [N m²]
LOSS = 0.1  # Kelvin-Voigt time of all [s]
HOLD, BOOST = 9.5, 25.0  # [V]


def piece(motions=MOTIONS, name="spine"):
    """A short spine with its TCA, clamped, weightless, its tip a body that can be loaded."""
    body = BeamSpec(
        length=SPINE.length, bending=(OWN, OWN), torsion=OWN, stretching=1.0, shearing=1.0,
        line_density=0.03, outline=Outline(4e-3, 4e-3, round=False), damping_time=LOSS,
    )  # fmt: skip
    mjspec = new_spec("piece")
    mjspec.option.gravity = [0.0, 0.0, 0.0]
    chain = add_chain(mjspec.worldbody, body, nodes=NODES, name=name, motions=motions)
    route = UTurn.parallel(SPINE.tca_offset, 1.6e-3, -math.pi / 2.0)
    tca = CATALOGUE["free-stroke"].of_length(2.0 * SPINE.length)
    routed = route_tca(mjspec, tca, route_passes(chain, route), name="tca")
    tip = chain.tip.add_body(name="tip", pos=[0.0, 0.0, chain.local(NODES)])
    tip.ipos = [0.0, 0.0, 0.0]
    spine = route_spine(SPINE, HEATER, [chain], name=name, tca="tca", damping_time=LOSS)
    return Part(mjspec, (routed,), {}, (spine,))


def simulation(part=None):
    return Simulation(part or piece(), timestep=5e-3, tca_period=0.05)


def heat_to(sim, temperature):
    """Puts the spines at temperatures [°C] at once, as they are bent now, and sets their springs.

    Returns the voltages that hold them there.
    """
    spines = sim.spines
    goal = np.broadcast_to(np.asarray(temperature, dtype=float), spines.n)
    spines.state = replace(spines.state, heat=replace(spines.state.heat, temperature=goal))
    heater = spines.bank.heater
    volts = np.sqrt(heater.loss * (goal - heater.ambient) * heater.resistance)
    sim.step(np.zeros(sim.n), 0.05, voltage=volts)
    assert spines.temperature == pytest.approx(goal)
    return volts


def angle(sim, name="spine"):
    """Bend about x [rad]."""
    joints = [sim.model.joint(f"{name}.bend_x{i}").qposadr[0] for i in range(NODES)]
    return float(sim.data.qpos[joints].sum())


def push(sim, moment):
    """A moment about x on the tip [N m]: the spine bends evenly."""
    sim.data.xfrc_applied[sim.model.body("tip").id, 3] = moment


def everything(sim):
    """All that a simulation carries on, as bytes."""
    model, data, state = sim.model, sim.data, sim.spines.state
    physics = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
    arrays = [
        physics, model.actuator_biasprm, model.jnt_stiffness, model.qpos_spring, model.dof_damping,
        sim.temperature, sim.energy, sim.tension, sim.length, sim.spines.temperature,
        sim.spines.energy, state.heat.energy_lost, state.memory.memory, state.memory.frozen,
        state.memory.glass, sim.spines.damaged,
    ]  # fmt: skip
    return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)


# Stiffness.

CELL = SPINE.length / NODES
SECTION = {  # per modulus and length of a cell
    "bend_x": SPINE.width * SPINE.thickness**3 / 12.0,
    "bend_y": SPINE.thickness * SPINE.width**3 / 12.0,
    "twist": SHEAR_RATIO * torsion_constant(SPINE.width, SPINE.thickness),
    "stretch": SPINE.width * SPINE.thickness,
}


@pytest.mark.parametrize("temperature", [25.0, 80.0, 95.0, 110.0, 130.0])
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_joint_is_as_stiff_as_the_modulus_of_the_moment_says(temperature, motion):
    """E(T) times the section's share, over the length of a cell, and what the chain has itself."""
    sim = simulation()
    heat_to(sim, temperature)
    own = (1.0 if motion == "stretch" else OWN) / CELL
    modulus = float(SMP.modulus(sim.spines.temperature[0]))
    expected = own + modulus * SECTION[motion] / CELL
    for node in range(NODES):
        joint = sim.model.joint(f"spine.{motion}{node}")
        assert joint.stiffness[0] == pytest.approx(expected, rel=1e-6)
        if motion in ("bend_x", "stretch"):  # bend_y and twist are damped for taut TCAs, too
            assert joint.damping[0] == pytest.approx(LOSS * expected, rel=1e-6)


def two_spines():
    """A second spine of the same kind, with its own heater, in the same chain."""
    part = piece()
    part.spines += (replace(part.spines[0], name="other"),)
    return part


def test_spines_that_share_a_joint_add_up_each_at_its_temperature():
    sim = simulation(two_spines())
    heat_to(sim, [25.0, 120.0])
    modulus = float(np.sum(SMP.modulus([25.0, 120.0])))
    expected = (OWN + modulus * SECTION["bend_x"]) / CELL
    assert sim.model.joint("spine.bend_x1").stiffness[0] == pytest.approx(expected, rel=1e-6)
    assert sim.spines.names == ("spine", "other")


# Shape memory.

COLD, HOT = 25.0, 105.0  # hot, there is still some glass [°C]
E_COLD, E_HOT = float(SMP.modulus(COLD)), float(SMP.modulus(HOT))
MOMENT = 0.8 * E_HOT * SPINE.second_moment / SPINE.length  # bends the hot spine by 0.8 rad


def test_a_shape_is_fixed_by_cooling_and_recovered_by_heating():
    """Soft, a moment bends it by M L/(E_hot I). Cooling under load changes nothing, without load
    M L/(E_cold I) springs back, and heat brings back E_r/E_hot of it."""
    sim = simulation()
    volts = heat_to(sim, HOT)
    push(sim, MOMENT)
    sim.step([0.0], 3.0, voltage=volts)
    bent = MOMENT * SPINE.length / (E_HOT * SPINE.second_moment + OWN)
    assert angle(sim) == pytest.approx(bent, rel=1e-4)
    sim.step([0.0], 250.0, fan=True)
    assert sim.spines.temperature[0] < COLD + 0.01
    assert angle(sim) == pytest.approx(bent, rel=1e-3)
    push(sim, 0.0)
    sim.step([0.0], 1.0)
    kept = angle(sim)
    assert kept / bent == pytest.approx(float(fixity(SMP, HOT, COLD)), abs=1e-3)
    assert kept / bent > 0.99
    heat_to(sim, HOT)
    sim.step([0.0], 6.0, voltage=volts)
    # What is round the spine helps the rubber.
    helped = OWN / (E_HOT * SPINE.second_moment)
    back = (float(recovery(SMP, HOT)) + helped) / (1.0 + helped)
    assert 1.0 - angle(sim) / kept == pytest.approx(back, abs=5e-3)
    assert 0.3 < back < 0.9
    volts = heat_to(sim, 150.0)  # no glass is left
    sim.step([0.0], 5.0, voltage=volts)
    assert abs(angle(sim)) < 0.02 * bent


def test_the_spines_tca_bends_it_soft_and_not_rigid():
    rigid, soft = simulation(), simulation()
    volts = heat_to(soft, HOT)
    for sim in (rigid, soft):
        sim.step(sim.keep([130.0]), 2.0, voltage=volts if sim is soft else 0.0)
    assert angle(soft) > math.radians(20.0)
    assert 0.0 < angle(rigid) < math.radians(0.5)


def test_a_spine_is_reset_into_any_shape_and_stays_in_it():
    """Fixed as by an ideal cooling: only what is round it pulls it back, OWN/(E_cold I) of it."""
    sim = simulation()

    def place(data):
        data.qpos[sim.model.joint("spine.bend_x0").qposadr[0]] = 0.5

    sim.reset(place)
    assert angle(sim) == 0.5
    sim.step([0.0], 1.0)
    lost = OWN / (E_COLD * SPINE.second_moment)
    assert angle(sim) == pytest.approx(0.5 * (1.0 - lost), rel=1e-5)


# Heat.


def test_a_heater_takes_what_its_voltage_drives_and_loses_or_stores_it():
    sim = simulation(two_spines())
    sim.step([0.0], 2.0, voltage=[BOOST, HOLD])
    sim.step([0.0], 1.0, voltage=[0.0, -HOLD], fan=[True, False])
    given = np.array([2.0 * BOOST**2, 3.0 * HOLD**2]) / float(HEATER.resistance)
    assert sim.spines.energy == pytest.approx(given, rel=1e-12)
    heat = sim.spines.state.heat
    stored = float(HEATER.capacity) * (sim.spines.temperature - COLD)
    assert stored + heat.energy_lost == pytest.approx(given, rel=1e-12)
    assert sim.energy == pytest.approx([0.0])  # the TCA's


def test_a_fan_cools_and_the_surroundings_are_those_of_the_simulation():
    calm, windy = simulation(), simulation()
    for sim in (calm, windy):
        heat_to(sim, 100.0)
        sim.step([0.0], 5.0, fan=sim is windy)
    assert windy.spines.temperature[0] < calm.spines.temperature[0] - 5.0
    winter = Simulation(piece(), ambient=5.0)
    winter.step([0.0], 0.1)
    assert winter.spines.temperature == pytest.approx([5.0])


# Damage.


@pytest.mark.parametrize(("temperature", "harmed"), [(25.0, True), (95.0, True), (125.0, False)])
def test_a_tca_heated_against_a_stiff_spine_is_harmed(temperature, harmed):
    sim = simulation()
    volts = heat_to(sim, temperature)
    assert not sim.spines.damaged.any()
    sim.step([4.0], 1.0, voltage=volts)
    assert bool(sim.spines.damaged[0]) is harmed
    sim.step([0.0], 1.0, voltage=volts)
    assert bool(sim.spines.damaged[0]) is harmed  # it does not heal
    sim.reset()
    assert not sim.spines.damaged.any()


# Reset and names.


def test_a_reset_simulation_does_the_same_again_to_the_bit():
    sim = simulation()

    def course():
        sim.step([0.0], 4.0, voltage=BOOST)
        sim.step([3.0], 2.0, voltage=HOLD)
        sim.step([0.0], 2.0, fan=True)
        return everything(sim)

    first = everything(sim)
    end = course()
    sim.reset()
    assert everything(sim) == first
    assert course() == end
    fresh = simulation()
    assert everything(fresh) == first


def test_a_part_that_is_attached_takes_its_spines_along():
    world = Part(new_spec("world"))
    world.spec.option.gravity = [0.0, 0.0, 0.0]
    for name, x in (("left", 0.0), ("right", 0.1)):
        world.spec.worldbody.add_site(name=f"{name}_base", pos=[x, 0.0, 0.0])
        world.attach(piece(), to=f"{name}_base", prefix=name)
    assert [spine.name for spine in world.spines] == ["left.spine", "right.spine"]
    assert [name for name, _ in world.spines[1].tcas] == ["right.tca"]
    assert {joint.split(".")[0] for joint, _ in world.spines[1].joints} == {"right"}
    sim = simulation(world)
    heat_to(sim, [COLD, HOT])
    stiff, soft = (sim.model.joint(f"{n}.spine.bend_x0").stiffness[0] for n in ("left", "right"))
    assert (stiff - OWN / CELL) / (soft - OWN / CELL) == pytest.approx(E_COLD / E_HOT, rel=1e-5)
    clash = piece()
    clash.tcas = (replace(clash.tcas[0], name="other"),)
    with pytest.raises(ValueError, match="left.spine"):
        world.attach(clash, to="left_base", prefix="left")


# What is refused.


def test_bad_spines_are_refused():
    part = piece()
    spine = part.spines[0]
    with pytest.raises(ValueError, match="must differ"):
        replace(spine, joints=(*spine.joints, spine.joints[0]))
    with pytest.raises(ValueError, match="damping_time"):
        replace(spine, damping_time=0.0)
    with pytest.raises(ValueError, match="bend_x0"):
        RoutedSpine("spine", SPINE, HEATER, (("bend_x0", -1.0),), (("tca", 1.0),))
    for changed, message in (
        (replace(spine, tcas=(("nobody", 1.0),)), "tcas of a spine must be some of"),
        (replace(spine, joints=(("free", 1.0),)), "cells that a TCA crosses"),
    ):
        other = piece()
        other.spec.worldbody.add_body(name="free").add_joint(name="free")
        other.spec.body("free").add_geom(size=[1e-3, 0.0, 0.0], mass=1e-3)
        other.spines = (changed,)
        with pytest.raises(ValueError, match=message):
            Simulation(other)


def test_bad_torsions_are_refused():
    spec = new_spec("test")
    body = BeamSpec(length=SPINE.length, bending=(OWN, OWN), torsion=OWN, stretching=1.0,
                    shearing=1.0, line_density=0.03, outline=Outline(4e-3, 4e-3))  # fmt: skip
    chain = add_chain(spec.worldbody, body, nodes=NODES, name="spine")
    with pytest.raises(ValueError, match="one number or 3"):
        route_spine(SPINE, HEATER, [chain], name="spine", tca="tca", torsion=(1e-12,) * 2)
    with pytest.raises(ValueError, match=r"torsion\[1\]"):
        route_spine(SPINE, HEATER, [chain], name="spine", tca="tca", torsion=(1e-12, 0.0, 1e-12))
    each = (1e-12, 2e-12, 3e-12)
    spine = route_spine(SPINE, HEATER, [chain], name="spine", tca="tca", torsion=each)
    shares = dict(spine.joints)
    assert [shares[f"spine.twist{i}"] * CELL for i in range(3)] == pytest.approx(each, rel=1e-12)
    for nodes in (0, 2.5):
        with pytest.raises(ValueError, match="nodes"):
            lumped_torsion(SPINE, (0.0, 0.01), nodes)


@pytest.mark.parametrize("voltage", [[1.0, 2.0], math.nan, [math.inf]])
def test_bad_voltages_are_refused(voltage):
    sim = simulation()
    before = everything(sim)
    with pytest.raises(ValueError, match="voltage"):
        sim.step([0.0], 0.1, voltage=voltage)
    with pytest.raises(ValueError, match="fan"):
        sim.step([0.0], 0.1, fan=[True, False])
    assert everything(sim) == before


def test_bad_banks_are_refused():
    other = replace(SPINE, smp=SmpSpec(rubbery=5e6))
    for specs, heaters, owner, message in (
        ([], [], [], "at least 1"),
        ([SPINE], [HEATER, HEATER], [0], "as many"),
        ([SPINE, other], [HEATER, HEATER], [0, 1], "one material"),
        ([SPINE], [HEATER], [1], "owner"),
        ([SPINE], [HEATER], [-1], "owner"),
        ([SPINE], [HEATER], [[0]], "owner"),
    ):
        with pytest.raises(ValueError, match=message):
            SpineBank(specs, heaters, owner)


def test_a_spine_at_rest_in_a_shape_has_no_torque_in_it():
    bank = SpineBank([SPINE, SPINE], [HEATER, HEATER], [0, 0, 1])
    memory, shape = np.array([0.1, 0.0, -0.2]), np.array([0.5, -1.0, 0.0])
    assert bank.spring(bank.rest(memory, shape)).reference == pytest.approx(shape, abs=1e-12)
    assert bank.spring(bank.rest(memory)).reference == pytest.approx(memory, abs=1e-15)
    assert bank.n == 2


def test_a_simulation_without_spines_has_none():
    part = piece()
    part.spines = ()
    sim = simulation(part)
    sim.step([0.5], 0.1)
    assert sim.spines.n == 0 and sim.spines.state is None
    assert sim.spines.temperature.shape == sim.spines.energy.shape == (0,)
    with pytest.raises(ValueError, match="voltage"):
        sim.step([0.5], 0.1, voltage=[9.5])

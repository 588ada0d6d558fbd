"""The tetrapod's model: sizes, masses, symmetry, momentum, and what its lumped spines leave out."""

import importlib
import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tca_mj.certify.rest import Load, rest
from tca_mj.model.spine import SHEAR_RATIO, lumped_torsion
from tca_mj.modules.continuum_leg import LegSpec, continuum_leg
from tca_mj.robots.tetrapod import (
    LEGS,
    SIDES,
    SPINES,
    TetrapodSpec,
    rigid_tetrapod,
    set_rigid_bend,
    tetrapod,
)
from tca_mj.robots.tetrapod_fine import fine_tetrapod
from tca_mj.rod import solve_static
from tca_mj.rod.beam import torsion_constant
from tca_mj.routes import parallel
from tca_mj.sim import Simulation
from tca_mj.tca import law_at

SPEC = TetrapodSpec()
ACROSS, ALONG = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, 1.0])
COLD = 25.0


def floating(part=None, **options):
    """The robot without weight and ground."""
    part = part or tetrapod()
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    return Simulation(part, **({"timestep": 5e-3, "tca_period": 0.025} | options))


@pytest.fixture
def certificate(monkeypatch):
    """The script that compares the models."""
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parent.parent / "scripts"))
    return importlib.import_module("tetrapod_certificate")


@pytest.fixture(scope="module")
def still():
    sim = floating()
    mujoco.mj_forward(sim.model, sim.data)
    return sim


def mirrored(name, mirror):
    """Name of what is at the mirrored place."""
    pairs = [("left", "right")] if mirror is ACROSS else [("front", "rear")]
    for a, b in pairs:
        name = name.replace(a, "?").replace(b, a).replace("?", b)
    return name


def extent(sim, seen):
    """Size of what is seen, in the hub's frame, shape (3,) [m]."""
    model, data = sim.model, sim.data
    corners = []
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        if "skin" in model.geom(geom).name or not seen(body):
            continue
        turn = data.geom_xmat[geom].reshape(3, 3)
        middle = data.geom_xpos[geom] + turn @ model.geom_aabb[geom, :3]
        half = np.abs(turn) @ model.geom_aabb[geom, 3:]
        corners += [middle - half, middle + half]
    return np.ptp(corners, axis=0)


def ends(sim):
    """Where the left and the right end of the spines are, shape (3,) each [m]."""
    found = []
    for side in SIDES:
        rail, body = sim.model.geom(f"{side}.rail"), sim.data.body(f"{side}.piece{SPEC.nodes}")
        along = rail.pos[2] - rail.size[2]
        found.append(body.xpos + along * body.xmat.reshape(3, 3)[:, 2])
    return found


# Sizes and masses.


def test_it_is_as_large_as_the_published_one(still):
    """Sun, Section 6.3.2: 2.4 mm/s are 0.016 body lengths/s, 150 mm; 25 mm high when flat."""
    length, _, height = extent(still, lambda body: True)
    assert length == pytest.approx(2.4 / 0.016 * 1e-3, abs=1e-3)
    assert height == pytest.approx(25e-3, abs=1e-3)
    # Between the spines' ends is what the modules are long; the rails are outside.
    left, right = ends(still)
    chord = 2.0 * math.sin(SPEC.memory_angle / 2.0) / SPEC.memory_angle * SPEC.spine.length
    assert left - right == pytest.approx([0.0, chord, 0.0], abs=2e-3 * chord)
    # A rail is as high as the modules and flush with them.
    rail, tube, spine = (still.model.geom(f"left.{name}") for name in (
        "rail", f"tube1.{SPEC.nodes}", f"spine1.{SPEC.nodes}"))  # fmt: skip
    assert rail.pos[1] + rail.size[1] == pytest.approx(tube.pos[1] + tube.size[1])
    assert rail.pos[1] - rail.size[1] == pytest.approx(spine.pos[1] - spine.size[1])


def test_the_middle_of_the_tubes_is_one_thing_to_touch(still):
    """Both halves begin on the hub: what lies on it has the contacts of one box."""
    for i in range(3):
        tube = still.model.geom(f"left.tube{i}.0")
        assert tube.pos[2] == pytest.approx(0.0, abs=1e-15)
        length = SPEC.spine.length / SPEC.nodes / 4.0
        assert tube.size[2] == pytest.approx(length, rel=0.01)
    names = [still.model.geom(i).name for i in range(still.model.ngeom)]
    assert "right.tube0.0" not in names and "right.tube0.1" in names


def test_it_weighs_what_its_parts_weigh(still):
    model, leg = still.model, SPEC.leg
    legs = sum(model.body(i).mass[0] for i in range(model.nbody) if ".rod." in model.body(i).name)
    tcas = [tca.spec.mass for tca in tetrapod().tcas]
    rod = 1550.0 * math.pi / 4.0 * leg.rod_diameter**2 * leg.length
    plates = (leg.nodes + 1) * 1200.0 * 0.5 * math.pi * leg.plate_radius**2 * leg.plate_thickness
    assert legs == pytest.approx(4.0 * (rod + plates + leg.foot_mass) + sum(tcas[:12]), rel=1e-9)
    body = 3.0 * SPEC.module_mass + 2.0 * SPEC.rail_mass + sum(tcas[12:])
    assert model.body_mass.sum() == pytest.approx(body + legs, rel=1e-9)
    assert 20e-3 < model.body_mass.sum() < 25e-3


def test_tcas_spines_and_sites_have_their_names(still):
    names = [f"{leg}.tca{i}" for leg in LEGS for i in range(3)]
    assert still.tca_names == (*names, "spine0", "spine1", "spine2")
    assert still.spines.names == ("spine0", "spine1", "spine2")
    part = tetrapod()
    assert set(part.sites) == {f"{leg}.{site}" for leg in LEGS for site in ("tip", "foot")}
    rear_to_front = [still.data.geom(f"left.spine{i}.0").xpos[0] for i in range(3)]
    assert rear_to_front == pytest.approx([-SPEC.spacing, 0.0, SPEC.spacing], abs=1e-12)
    for i in range(3):
        assert still.data.site(f"spine{i}.leg0.site0").xpos[0] == pytest.approx(
            (i - 1) * SPEC.spacing + SPEC.spine.width / 4.0, abs=1e-12
        )
    for name, (x, y) in zip(LEGS, ((1, 1), (1, -1), (-1, 1), (-1, -1)), strict=True):
        foot = still.data.site(f"{name}.foot").xpos
        assert foot[0] == pytest.approx(x * SPEC.leg_station, abs=1e-12)
        assert np.sign(foot[1]) == y


# Symmetry.


@pytest.mark.parametrize("mirror", [ACROSS, ALONG], ids=["left-right", "front-rear"])
def test_its_mirror_image_is_itself(still, mirror):
    """Places, masses and inertia of all bodies; places of all TCAs' sites."""
    model, data = still.model, still.data

    def inertia(body):
        turn = data.ximat[body].reshape(3, 3)
        return turn @ np.diag(model.body_inertia[body]) @ turn.T

    for body in range(1, model.nbody):
        other = model.body(mirrored(model.body(body).name, mirror)).id
        assert model.body_mass[other] == pytest.approx(model.body_mass[body], rel=1e-12)
        assert data.xipos[other] == pytest.approx(mirror @ data.xipos[body], abs=1e-12)
        image = mirror @ inertia(body) @ mirror
        assert inertia(other) == pytest.approx(image, abs=1e-6 * np.trace(image))
    for leg in LEGS:
        for tca, image in ((0, 0), (1, 1), (2, 2)) if mirror is ACROSS else ((0, 0), (1, 2)):
            for site in range(SPEC.leg.nodes + 1):
                here = data.site(f"{leg}.tca{tca}.leg0.site{site}").xpos
                there = data.site(f"{mirrored(leg, mirror)}.tca{image}.leg0.site{site}").xpos
                assert there == pytest.approx(mirror @ here, abs=1e-12)


def heated(power, voltage):
    """Places of the feet about the hub, and its frame, after two seconds."""
    sim = floating()
    sim.step(power, 2.0, voltage=voltage)
    mujoco.mj_forward(sim.model, sim.data)
    feet = {leg: sim.data.site(f"{leg}.foot").xpos.copy() for leg in LEGS}
    return feet, sim.data.body("hub").xmat.reshape(3, 3).copy()


@pytest.mark.parametrize("mirror", [ACROSS, ALONG], ids=["left-right", "front-rear"])
def test_mirrored_powers_make_mirrored_motions(mirror):
    power = {f"{leg}.tca{i}": 0.0 for leg in LEGS for i in range(3)}
    power |= {"front_left.tca1": 2.5, "front_left.tca0": 1.0, "rear_right.tca2": 2.0}
    power |= {"spine0": 8.0, "spine1": 0.0, "spine2": 2.0}
    voltage = {"spine0": 20.0, "spine1": 5.0, "spine2": 25.0}

    def image(name):
        name = mirrored(name, mirror)
        if mirror is ALONG:
            swap = {"tca1": "tca2", "tca2": "tca1", "spine0": "spine2", "spine2": "spine0"}
            stem, dot, last = name.rpartition(".")
            name = stem + dot + swap.get(last, last)
        return name

    one = heated(list(power.values()), list(voltage.values()))
    two = heated([power[image(n)] for n in power], [voltage[image(n)] for n in voltage])
    for leg in LEGS:
        there = mirror @ one[0][leg]
        assert two[0][mirrored(leg, mirror)] == pytest.approx(there, abs=1e-9)
    assert two[1] == pytest.approx(mirror @ one[1] @ mirror, abs=1e-9)
    moved = one[0]["front_left"] - ACROSS @ one[0]["front_right"]
    assert np.linalg.norm(moved) > 3e-3  # there was something to compare


@pytest.mark.parametrize(("tca", "direction"), [(0, (0, 0, 1)), (1, (1, 0, 0)), (2, (-1, 0, 0))])
def test_tcas_move_the_feet_as_the_builder_says(tca, direction):
    """Up; down and to the front; down and to the rear, on all legs."""
    power = np.zeros(15)
    power[tca:12:3] = 3.0
    feet, _ = heated(power, 0.0)
    rest_of, _ = heated(np.zeros(15), 0.0)
    for leg in LEGS:
        moved = feet[leg] - rest_of[leg]
        assert np.dot(direction, moved) > 3e-3
        if tca:
            assert moved[2] < -1e-3


# Momentum.


def test_tcas_and_spines_put_no_net_force_on_the_robot():
    """All forces are internal: afloat, its centre of mass stays and it gets no momentum."""
    sim = floating()
    random = np.random.default_rng(2)
    model, data = sim.model, sim.data
    mujoco.mj_forward(model, data)
    start = data.subtree_com[0].copy()
    fastest = 0.0
    for _ in range(6):
        power = np.where(random.random(15) < 0.5, random.uniform(1.0, 4.0, 15), 0.0)
        sim.step(power, 0.5, voltage=[25.0, 22.0, 24.0])
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        fastest = max(fastest, float(np.abs(data.qvel[6:]).max()))
        assert data.subtree_com[0] == pytest.approx(start, abs=1e-6 * SPEC.rail_length)
        # A thousandth of what one leg of 1.3 g has that is moved at 2 mm/s, 0.1 m off the middle.
        leg = 1e-3 * 1.3e-3 * 2e-3 / model.body_subtreemass[0]
        assert np.abs(data.subtree_linvel[0]).max() < leg
        assert np.abs(data.subtree_angmom[0]).max() < 2.6e-10
    assert fastest > 0.03 and sim.tension.max() > 0.2


# What is left out.


@pytest.mark.parametrize("degrees", [20.0, 95.0, 215.0])
def test_rails_give_as_if_three_spines_joined_them(certificate, degrees):
    """Bend, pitch, width and height against each other; yaw is up to 2.3 times too soft."""
    angle = math.radians(degrees)
    exact = certificate.body_compliance(angle, float(SPEC.spine.smp.modulus(COLD)))
    assert exact == pytest.approx(exact.T, rel=1e-9, abs=1e-12)
    found = certificate.measured(certificate.Bench(tetrapod, timestep=1e-3), angle)
    ratio = dict(zip(certificate.LOADS, found / np.diag(exact), strict=True))
    assert ratio["bend"] == pytest.approx(1.0, abs=5e-3)
    assert ratio["pitch"] == pytest.approx(1.0, abs=0.03)
    assert ratio["height"] == pytest.approx(1.0, abs=0.03)
    assert ratio["width"] == pytest.approx(1.0, abs=0.05)
    assert 1.4 < ratio["yaw"] < 2.4
    assert 0.1 < ratio["sway"] < 0.8


def test_the_theory_of_arcs_is_that_of_straight_spines_in_the_limit(certificate):
    """EI/L, EA/L, 12 EI/L³ and the frame's stiffness by hand."""
    size, length = SPEC.spine, SPEC.spine.length
    found = np.linalg.inv(certificate.body_compliance(1e-4, 1.0))
    spread = sum(x * x for x in SPEC.places)
    across = size.thickness * size.width**3 / 12.0
    area = size.width * size.thickness
    turn = SHEAR_RATIO * torsion_constant(size.width, size.thickness)
    expected = [
        3.0 * size.second_moment / length,
        3.0 * turn / length + 12.0 * size.second_moment / length**3 * spread,
        3.0 * across / length + area / length * spread,
        36.0 * across / length**3,
        3.0 * area / length,
        36.0 * size.second_moment / length**3,
    ]
    assert np.diag(found) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("spines", [COLD, 90.0, 120.0])
def test_without_power_it_keeps_the_memorised_shape(certificate, spines):
    bench = certificate.Bench(tetrapod, timestep=5e-3)
    bench.soft(spines, COLD, 1.0)
    assert bench.angle == pytest.approx(SPEC.memory_angle, abs=1e-8)


@pytest.mark.parametrize("tcas", [60.0, 120.0])
def test_the_soft_body_bends_as_a_spine_that_does_not_stretch(certificate, tcas):
    """Rigid rails hold three equal spines: each bends as if it were alone."""
    bench = certificate.Bench(tetrapod, timestep=5e-3, loss=20.0)
    bench.soft(120.0, tcas, 4.0)
    exact = certificate.soft_angle(120.0, tcas, stretches=False)
    assert bench.angle == pytest.approx(exact, rel=1e-3)
    stretching = certificate.soft_angle(120.0, tcas)
    assert 0.98 * exact < stretching < exact


def test_lumped_torsion_is_exact_for_straight_spines(certificate):
    """J G/E + 12 I d²/L², however many cells; more compliant in the middle than at the rails."""
    size = SPEC.spine
    spread = sum(x * x for x in SPEC.places) / 3.0
    expected = SHEAR_RATIO * torsion_constant(size.width, size.thickness)
    expected += 12.0 * size.second_moment * spread / size.length**2
    for nodes in (1, 2, 8, 100):
        each = lumped_torsion(size, SPEC.places, nodes)
        assert len(each) == nodes and each == pytest.approx(each[::-1])
        assert nodes / sum(1.0 / k for k in each) == pytest.approx(expected, rel=1e-12)
    assert each[50] < each[0]
    pitch = certificate.body_compliance(1e-3, 1.0)[1, 1]
    assert pitch == pytest.approx(size.length / 3.0 / expected, rel=1e-4)


@pytest.mark.parametrize("shape", ["free", "closed"])
def test_the_finer_model_is_the_same_robot(shape, still):
    fine = floating(fine_tetrapod(nodes=2, leg_nodes=SPEC.leg.nodes))
    assert fine.tca_names == still.tca_names and fine.spines.names == still.spines.names
    mujoco.mj_forward(fine.model, fine.data)
    assert fine.model.body_mass.sum() == pytest.approx(still.model.body_mass.sum(), rel=1e-9)
    assert fine.length == pytest.approx(still.length, rel=1e-6)
    if shape == "closed":
        assert np.abs(fine.data.efc_pos).max() < 1e-12  # the welds have nothing to do
    assert extent(fine, lambda body: True)[::2] == pytest.approx(
        extent(still, lambda body: True)[::2], abs=5e-4
    )


# What of the robot its tendons move.


@pytest.mark.parametrize("build", [tetrapod, rigid_tetrapod])
def test_rows_of_tendons_are_without_the_joints_that_carry_them(build, monkeypatch):
    """A second of heated legs goes to 1e-9 where it goes with all joints in the rows."""

    def heated():
        part = build()
        part.spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE  # as tasks have it
        sim = floating(part)
        power = np.zeros(sim.n)
        power[:12] = np.random.default_rng(0).uniform(0.0, 3.0, 12)
        sim.step(power, 1.0)
        return sim

    spared = heated()
    with monkeypatch.context() as patch:
        patch.setattr("tca_mj.sim.spare_joints", lambda model: None)
        whole = heated()
    model, nodes = spared.model, SPEC.leg.nodes
    for name, tendon in zip(spared.tca_names, spared.tendon, strict=True):
        first, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
        moved = model.dof_jntid[model.ten_J_colind[first : first + count]]
        joints = [model.joint(int(joint)).name for joint in moved]
        assert "root" not in joints
        if not name.startswith("spine"):
            leg = name.split(".")[0]
            assert count == 3 * nodes and all(each.startswith(f"{leg}.rod.") for each in joints)
    assert whole.model.ten_J_rownnz.sum() > 1.5 * model.ten_J_rownnz.sum()
    assert np.abs(spared.data.qpos - whole.data.qpos).max() < 1e-9
    assert np.abs(whole.data.qvel).max() > 1e-3
    assert spared.tension == pytest.approx(whole.tension, abs=1e-9)


# The body when it is cold.


@pytest.mark.parametrize("bend", [SPEC.memory_angle, math.radians(93.0), math.radians(215.0)])
def test_the_rigid_robot_is_the_elastic_one_in_one_shape(bend):
    """All bodies are where they are in the elastic robot, and weigh what they weigh there."""
    elastic, rigid = floating(), floating(rigid_tetrapod(bend=1.0, nodes=SPEC.nodes))
    set_rigid_bend(rigid.model, bend)
    rigid.reset()
    for side, sign in SIDES.items():
        for i in range(SPEC.nodes):
            joint = elastic.model.joint(f"{side}.bend_x{i}")
            elastic.data.qpos[joint.qposadr] = -sign * bend / (2 * SPEC.nodes)
    mujoco.mj_forward(elastic.model, elastic.data)
    mujoco.mj_forward(rigid.model, rigid.data)
    assert rigid.model.nv == 6 + 4 * 9 and elastic.model.nv == rigid.model.nv + 16
    assert rigid.tca_names == elastic.tca_names[:-SPINES] and rigid.spines.n == 0
    assert rigid.length == pytest.approx(elastic.length[:-SPINES], rel=1e-12)
    for i in range(elastic.model.nbody):
        name = elastic.model.body(i).name
        assert rigid.model.body(name).mass == pytest.approx(elastic.model.body(i).mass, rel=1e-12)
        assert rigid.data.body(name).xpos == pytest.approx(elastic.data.body(i).xpos, abs=1e-12)
        assert rigid.data.body(name).xmat == pytest.approx(elastic.data.body(i).xmat, abs=1e-9)
    names = [rigid.model.geom(i).name for i in range(rigid.model.ngeom)]
    other = [elastic.model.geom(i).name for i in range(elastic.model.ngeom)]
    assert [name for name in names if name] == [name for name in other if name]
    # Rods that touch nothing stand for the spines' tendons, one at each of their sites.
    drawn = [i for i, name in enumerate(names) if not name and rigid.model.geom_type[i] == 5]
    sites = [elastic.model.site(i).name for i in range(elastic.model.nsite)]
    assert len(drawn) == sum(name.startswith("spine") for name in sites) == 60
    assert not (rigid.model.geom_contype[drawn].any() or rigid.model.geom_conaffinity[drawn].any())


def test_cold_spines_are_as_good_as_rigid():
    """Half of the robot on one foot, at the lever of a leg, bends the cold body by 0.6 degrees."""
    weight = 9.81 * float(rigid_tetrapod().spec.compile().body_mass.sum())
    stiffness = 3.0 * float(SPEC.spine.smp.modulus(COLD)) * SPEC.spine.second_moment
    turn = 0.5 * weight * SPEC.leg.length * SPEC.spine.length / stiffness
    assert math.degrees(turn) == pytest.approx(0.6, abs=0.03)


# Legs.


def rest_of_leg(spec, temperatures, force):
    """Place of the rod's end at rest, in MuJoCo and by theory [m]."""
    part = continuum_leg(spec)
    laws = [law_at(tca.spec, t) for tca, t in zip(part.tcas, temperatures, strict=True)]
    zero = np.zeros((1, 3))
    load = Load(force=np.array([force]), moment=zero, gravity=zero[0])
    found = rest(part, ["tip"], laws, load).position[0]
    routes = parallel(3, spec.offset, spec.phase)
    exact = solve_static(spec.body, routes, laws, tip_force=force, shearable=False, points=2)
    return found, exact.tip


TWISTLESS = replace(LegSpec(), motions=("bend_x", "bend_y"), nodes=5)


@pytest.mark.parametrize("temperatures", [(160.0, 25.0, 25.0), (60.0, 160.0, 90.0)])
def test_a_leg_bends_as_theory_says(temperatures):
    found, exact = rest_of_leg(LegSpec(), temperatures, (0.0, 0.0, 0.0))
    assert np.linalg.norm(exact - [0.0, 0.0, LegSpec().length]) > 5e-3
    assert np.linalg.norm(found - exact) < 2e-4
    found, exact = rest_of_leg(replace(LegSpec(), nodes=6), temperatures, (0.0, 0.0, 0.0))
    assert np.linalg.norm(found - exact) < 5e-5


def test_a_leg_under_load_twists_as_theory_says():
    """A force across the plane of the bend twists the rod by its lever; in the plane it does not.

    Twice the nodes are off by a quarter. A leg that cannot twist is off by what it leaves out.
    """
    temperatures, across, along = (165.0, 25.0, 25.0), (0.0, 0.05, 0.0), (0.03, 0.0, -0.04)
    found, exact = rest_of_leg(LegSpec(), temperatures, across)
    finer, same = rest_of_leg(replace(LegSpec(), nodes=6), temperatures, across)
    assert same == pytest.approx(exact)
    off = np.linalg.norm(found - exact)
    assert off < 5e-4 and np.linalg.norm(finer - exact) == pytest.approx(off / 4.0, rel=0.25)
    twistless, _ = rest_of_leg(TWISTLESS, temperatures, across)
    assert 1e-3 < np.linalg.norm(twistless - exact) < 2e-3
    found, exact = rest_of_leg(LegSpec(), temperatures, along)
    twistless, _ = rest_of_leg(TWISTLESS, temperatures, along)
    assert max(np.linalg.norm(found - exact), np.linalg.norm(twistless - exact)) < 5e-4


def test_the_plates_of_a_mirrored_leg_are_the_mirror_image():
    """Corners and the gaps beside them: what a side of the robot touches with."""
    legs = [continuum_leg(mirrored=side).spec.compile() for side in (False, True)]
    for i in range(legs[0].ngeom):
        name = legs[0].geom(i).name
        one, other = (model.geom(name) for model in legs)
        assert other.pos == pytest.approx(one.pos * [1.0, -1.0, 1.0], abs=1e-15), name
        ends = []
        for geom in (one, other):
            axis = np.empty(9)
            mujoco.mju_quat2Mat(axis, geom.quat)
            ends.append(axis.reshape(3, 3)[:, 2] * geom.size[1])
        # A capsule has no front: its axis may point either way.
        image = ends[0] * [1.0, -1.0, 1.0]
        assert min(np.abs(ends[1] - image).max(), np.abs(ends[1] + image).max()) < 1e-12, name


def test_a_mirrored_leg_is_the_mirror_image():
    tips = []
    for side in (False, True):
        part = continuum_leg(mirrored=side)
        part.spec.option.gravity = [0.0, 0.0, 0.0]
        sim = Simulation(part)
        sim.step(sim.keep([60.0, 140.0, 25.0]), 1.0)
        mujoco.mj_kinematics(sim.model, sim.data)
        tips.append(sim.data.site("foot").xpos.copy())
    assert abs(tips[0][1]) > 5e-3
    assert tips[1] == pytest.approx(tips[0] * [1.0, -1.0, 1.0], abs=1e-9)


def test_a_leg_carries_its_share_of_the_weight(still):
    """Standing on straight legs: below Euler's load of a rod clamped at one end."""
    leg = SPEC.leg
    euler = math.pi**2 * leg.body.bending[0] / (2.0 * leg.length) ** 2
    assert 9.81 * still.model.body_mass.sum() / 4.0 < 0.5 * euler


# What is refused.


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("module_mass", -1.0), ("spacing", math.nan),
        ("memory_angle", 3.5), ("memory_angle", math.nan), ("rail_length", math.inf),
        ("rail_width", 0.0), ("rail_mass", 0.0), ("leg_station", -1e-3),
        ("leg_height", 0.0), ("belly_friction", 0.0), ("nodes", 0), ("nodes", 2.5),
    ],
)  # fmt: skip
def test_bad_robots_are_refused(field, value):
    with pytest.raises(ValueError, match=field):
        replace(SPEC, **{field: value})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("length", 0.0), ("rod_diameter", -1.0), ("offset", 9e-3), ("offset", 0.0),
        ("phase", math.inf), ("count", 0), ("plate_radius", math.nan), ("plate_thickness", 0.0),
        ("plate_fill", 1.1), ("plate_fill", 0.0), ("foot_radius", 0.0), ("foot_mass", 0.0),
        ("friction", -0.1), ("plate_friction", 0.0), ("damping_time", 0.0), ("nodes", 0),
        ("motions", ("bend_x", "twist")),
    ],
)  # fmt: skip
def test_bad_legs_are_refused(field, value):
    with pytest.raises(ValueError, match=field):
        replace(LegSpec(), **{field: value})

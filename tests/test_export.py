"""Parts as MJCF for plain MuJoCo: the same shapes at the temperatures at which they were frozen."""

import runpy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tca_mj.exported import REST, export
from tca_mj.modules.bending import bending_module
from tca_mj.modules.continuum_leg import continuum_leg
from tca_mj.modules.finger import finger_pair
from tca_mj.modules.twisting import twisting_module
from tca_mj.sim import Simulation

SCRIPT = runpy.run_path(str(Path(__file__).parent.parent / "scripts" / "export_robots.py"))


def hanging(builder):
    part = builder()
    part.spec.option.gravity = [0.0, 0.0, 9.81]
    return part


@pytest.mark.parametrize(
    ("builder", "temperatures", "length"),
    [
        (bending_module, [110.0, 25.0, 60.0], 45e-3),
        (twisting_module, 120.0, 45e-3),
        (continuum_leg, [150.0, 25.0, 100.0], 50e-3),
        (finger_pair, 90.0, 60e-3),
    ],
)
def test_plain_mujoco_comes_to_the_rest_of_the_simulation(
    builder, temperatures, length, tmp_path
):
    """From the unloaded shape, within 0.002 % of the length; TCAs have the simulation's lengths."""
    export(hanging(builder), tmp_path / "robot.xml", temperatures=temperatures)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    for _ in range(round(6.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)

    sim = Simulation(hanging(builder))
    sim.rest(np.broadcast_to(temperatures, sim.n))
    mujoco.mj_forward(sim.model, sim.data)
    moved = np.linalg.norm(sim.data.xpos - data.xpos, axis=1).max()
    assert moved < 2e-5 * length
    assert data.ten_length == pytest.approx(sim.data.ten_length, abs=2e-5 * length)
    assert -data.actuator_force == pytest.approx(sim.tension, abs=2e-5)
    assert np.abs(sim.data.xpos - Simulation(hanging(builder)).data.xpos).max() > 2e-4


def test_the_keyframe_is_the_rest(tmp_path):
    text = export(hanging(bending_module), temperatures=[100.0, 25.0, 25.0])
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(REST).id)
    mujoco.mj_forward(model, data)
    before = data.xpos.copy()
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert np.abs(data.xpos - before).max() < 1e-6


def test_a_part_exports_itself(tmp_path):
    """The method is the function, and takes what it takes."""
    part = bending_module()
    text = part.export(tmp_path / "robot.xml", temperatures=[100.0, 25.0, 25.0])
    assert text == export(part, temperatures=[100.0, 25.0, 25.0])
    assert (tmp_path / "robot.xml").read_text(encoding="utf-8") == text
    with pytest.raises(ValueError, match="temperatures must be a real number"):
        part.export(temperatures="hot")


def test_what_is_exported_stays_as_it_was():
    part = bending_module()
    before = part.spec.to_xml()
    export(part, temperatures=60.0)
    assert part.spec.to_xml() == before


def test_colder_than_the_surroundings_is_refused():
    with pytest.raises(ValueError, match="temperature must be at least that of the surroundings"):
        export(bending_module(), temperatures=10.0)


@pytest.mark.parametrize("name", SCRIPT["BUILDERS"])
def test_the_files_in_the_folder_are_current(name):
    """If not: python scripts/export_robots.py"""
    kept = mujoco.MjModel.from_xml_path(str(SCRIPT["FOLDER"] / f"{name}.xml"))
    now = mujoco.MjModel.from_xml_string(export(SCRIPT["BUILDERS"][name]()))
    assert kept.nq == now.nq and kept.ngeom == now.ngeom and kept.ntendon == now.ntendon
    for array in ("body_mass", "body_pos", "geom_size", "jnt_stiffness", "actuator_biasprm",
                  "qpos_spring", "tendon_width", "geom_friction"):  # fmt: skip
        one, other = getattr(kept, array), getattr(now, array)
        assert one == pytest.approx(other, rel=1e-4, abs=1e-7), array


def test_the_folder_holds_nothing_else():
    files = {path.stem for path in SCRIPT["FOLDER"].iterdir()}
    assert files == set(SCRIPT["BUILDERS"])


def test_what_nothing_holds_does_not_fall_while_its_shape_is_found():
    """The robot's keyframe is where it was built, and its weight is in the file."""
    model = mujoco.MjModel.from_xml_path(str(SCRIPT["FOLDER"] / "tetrapod.xml"))
    assert np.abs(model.key(REST).qpos[:3]).max() < 1e-3
    assert model.opt.gravity[2] == -9.81

"""The smooth body that a chain stands for: loads from an energy, rotations, rest."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tca_mj.model.chain import add_chain
from tca_mj.model.part import new_spec
from tca_mj.model.smooth import SmoothBody
from tca_mj.model.tendon import route_passes, route_tca
from tca_mj.rod import BeamSpec
from tca_mj.routes import Helix, UTurn, leg_length
from tca_mj.tca import CATALOGUE

BEAM = BeamSpec.circular(
    length=45e-3, diameter=4.5e-3, young=0.125e6, shear=0.125e6 / 3.0, density=1070.0,
    outer_diameter=9e-3,
)  # fmt: skip
L = BEAM.length
TCA = Helix(4e-3)


def model_of(routes, body=BEAM, nodes=5, **options):
    """A chain with TCAs in MuJoCo, some tensions, and its smooth body."""
    spec = new_spec("test")
    chain = add_chain(spec.worldbody, body, nodes=nodes, name="body", **options)
    tcas = []
    for i, route in enumerate(routes):
        length = sum(leg_length(leg, body.length, body.curvature) for leg in route.legs)
        tca = CATALOGUE["free-stroke"].of_length(length)
        tcas.append(route_tca(spec, tca, route_passes(chain, route), name=f"tca{i}"))
    model = spec.compile()
    return model, mujoco.MjData(model), SmoothBody(model, tcas)


ROUTES = [TCA, Helix(3e-3, 1.0, 0.4), UTurn.double_helix(4e-3, -0.7, 1.0)]


@pytest.mark.parametrize(
    ("motions", "twists"),
    [
        (("bend_x",), ()), (("bend_x", "bend_y"), ()), (("twist",), ("twist",)),
        (("bend_x", "bend_y", "twist"), ("bend_x", "bend_y", "twist")),
    ],
)
def test_tension_damps_what_twists_and_nothing_else(motions, twists):
    """Polylines resist twist where a cell can twist; then a bend across a bend twists it, too."""
    model, data, smooth = model_of(ROUTES, motions=motions)
    data.qpos[:] = model.qpos_spring + 0.2
    strained, tension = smooth.at(data.qpos), np.array([0.03, 0.02, 0.05])
    more = smooth.damped(strained, tension, 1e-2) - smooth.damped(strained, 0.0 * tension, 1e-2)
    names = [model.joint(int(joint)).name for joint in smooth._joint]
    assert len(names) == len(motions) * 5
    for name, each in zip(names, more, strict=True):
        assert (each > 0.0) == any(twist in name for twist in twists)


@pytest.mark.parametrize("curvature", [(0.0, 0.0, 0.0), (20.0, -30.0, 15.0)])
@pytest.mark.parametrize(
    "motions", [("stretch", "bend_x", "bend_y", "twist"), ("bend_y", "bend_x")]
)
def test_joints_are_loaded_by_the_gradient_of_the_energy(motions, curvature):
    """½ (q - q0) K (q - q0) + Σ F l by finite differences, q stretch and rotation vector."""
    body = replace(BEAM, curvature=curvature)
    model, data, smooth = model_of(ROUTES, body, motions=motions)
    tension = np.array([0.03, 0.02, 0.05])
    rng = np.random.default_rng(0)
    data.qpos[:] = model.qpos_spring + 0.3 * rng.standard_normal(model.nq)
    data.qpos[model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)] *= 1e-3

    def energy(qpos):
        strained = smooth.at(qpos)
        off = strained.motion - smooth.rest
        return 0.5 * np.sum(smooth.stiffness * off**2) + tension @ strained.length

    model.opt.gravity[:] = 0.0
    model.actuator_biasprm[:, 0] = -tension
    mujoco.mj_fwdPosition(model, data)
    smooth.support(data, smooth.at(data.qpos), tension)
    mujoco.mj_forward(model, data)
    for i in range(model.nq):
        step = np.zeros(model.nq)
        step[i] = 1e-6
        slope = (energy(data.qpos + step) - energy(data.qpos - step)) / 2e-6
        assert data.qfrc_smooth[i] == pytest.approx(-slope, rel=1e-6, abs=1e-9)


def test_a_cell_has_the_rotation_vector_of_its_hinges():
    """Joints of 0.7 rad and less: turns below half a turn."""
    model, data, smooth = model_of([TCA], nodes=6)
    data.qpos[:] = np.random.default_rng(1).uniform(-0.7, 0.7, model.nq)
    mujoco.mj_kinematics(model, data)
    frames = [data.body(f"body.piece{i}").xmat.reshape(3, 3) for i in range(7)]
    turns = [
        Rotation.from_matrix(a.T @ b).as_rotvec() for a, b in zip(frames, frames[1:], strict=False)
    ]
    assert smooth.at(data.qpos).motion[1:].T == pytest.approx(np.array(turns), abs=1e-9)


def test_a_body_with_any_curvature_rests_without_load():
    """Its hinges stand at the angles that make the rotation vector of the curvature."""
    body = replace(BEAM, curvature=(20.0, -30.0, 15.0))
    model, data, smooth = model_of([TCA], body, nodes=4)
    assert smooth.rest[1:] == pytest.approx(np.tile(np.array(body.curvature) * L / 4, (4, 1)).T)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_fwdPosition(model, data)
    smooth.support(data, smooth.at(data.qpos), np.zeros(1))
    assert model.qpos_spring == pytest.approx(data.qpos, abs=1e-15)

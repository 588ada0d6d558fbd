"""The static shape of a chain: MuJoCo's answer to the question that a rod solver answers."""

from collections.abc import Sequence
from copy import copy

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.model.chain import Chain
from tca_mj.model.chain import beam as build
from tca_mj.model.part import new_spec
from tca_mj.model.tendon import RoutedTca, route_passes, route_tca
from tca_mj.rod.beam import BeamSpec
from tca_mj.rod.shape import RodShape
from tca_mj.routes import Route, leg_length
from tca_mj.tca import CATALOGUE

# Pseudo-time: a step in units of L² sqrt(line density / EI), about half the period of the first
# mode, and the damping times of every joint over the step, tried one after the other. None of
# them has an influence on the shape at rest, only on whether and how fast it is found.
_STEP, _DAMPING = 1.0, (2.0, 8.0, 32.0)
_BATCH = 20  # steps between two looks at the residual
_MOST = 500  # steps over damping before the next damping is tried
_TOLERANCE = 1e-10  # left in the joints: angle, or stretch over the cell
_WEIGHTLESS_TCA = CATALOGUE["free-stroke"]  # any one: only its rest length is used


class NotSettledError(ArithmeticError):
    """The chain found no rest.

    Attributes:
        residual: Largest unbalanced load of a joint over its stiffness, as an angle [rad] or a
            stretch over the length of a cell [1].
    """

    def __init__(self, residual: float) -> None:
        super().__init__(
            f"the chain does not come to rest: a joint is off by {residual:.3g}, allowed"
            f" {_TOLERANCE:g}; a smaller load or more nodes may help"
        )
        self.residual = residual


def settle(
    beam: BeamSpec,
    routes: Sequence[Route],
    tensions: ArrayLike,
    *,
    nodes: int,
    tip_force: ArrayLike = (0.0, 0.0, 0.0),
    tip_moment: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
) -> RodShape:
    """Static shape of a clamped beam whose TCAs pull with given tensions.

    The chain that modules are built from is led from its unloaded shape to rest by heavily
    damped steps of MuJoCo, with the stiffness that the joints are owed for the polyline of sites.

    Args:
        beam: The beam, its base at the origin, along +z.
        routes: Routes of the k TCAs, which are weightless here.
        tensions: Their tensions, not negative, shape (k,) [N].
        nodes: Nodes of the chain.
        tip_force: Force on the tip in the world's frame, shape (3,) [N].
        tip_moment: Moment on the tip in the world's frame, shape (3,) [N m].
        gravity: Acceleration of gravity in the world's frame, shape (3,) [m/s²].

    Returns:
        The shape at the base, the ends of the cells and the tip: ``nodes`` + 1 points.

    Raises:
        ValueError: If an array has the wrong shape or is not finite, a tension is negative, or
            the chain cannot be built.
        NotSettledError: If the chain does not come to rest.
    """
    pull = _vector("tensions", tensions, len(routes))
    if (pull < 0.0).any():
        raise ValueError(f"tensions must be at least 0 N, got {pull}")
    mjspec = new_spec("settle")
    mjspec.option.gravity = _vector("gravity", gravity, 3)
    mjspec.option.timestep = _STEP * beam.length**2 * np.sqrt(beam.line_density / min(beam.bending))
    chain = build(mjspec.worldbody, beam, nodes=nodes, name="body", collide=False)
    masses = [piece.first_geom().mass for piece in chain.pieces]
    tcas = [_routed(mjspec, chain, route, f"tca{i}") for i, route in enumerate(routes)]
    for piece, mass in zip(chain.pieces, masses, strict=True):
        piece.first_geom().mass = mass
    # MuJoCo applies loads at a body's centre of mass: a massless body has it where it is told.
    tip = chain.tip.add_body(name="tip", pos=[0.0, 0.0, chain.local(nodes)])
    tip.ipos = [0.0, 0.0, 0.0]

    model: mujoco.MjModel = mjspec.compile()
    data = mujoco.MjData(model)
    load = [*_vector("tip_force", tip_force, 3), *_vector("tip_moment", tip_moment, 3)]
    data.xfrc_applied[model.body("tip").id] = load
    data.qpos[:] = model.qpos_spring
    mujoco.mj_fwdPosition(model, data)
    unloaded = _polyline(model, data, tcas)
    _pull(model, tcas, pull)
    _to_rest(model, data, chain.cell)
    path = np.array([tca.path_length for tca in tcas])
    return _shape(model, data, chain, path + _polyline(model, data, tcas) - unloaded)


def _vector(name: str, values: ArrayLike, size: int) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be {size} finite numbers, got {values!r}")
    return array


def _routed(mjspec: mujoco.MjSpec, chain: Chain, route: Route, name: str) -> RoutedTca:
    length = sum(leg_length(leg, chain.beam.length, chain.beam.curvature) for leg in route.legs)
    tca = _WEIGHTLESS_TCA.of_length(length)
    return route_tca(mjspec, tca, route_passes(chain, route), name=name)


def _polyline(
    model: mujoco.MjModel, data: mujoco.MjData, tcas: Sequence[RoutedTca]
) -> NDArray[np.float64]:
    """Lengths of the tendons and of the stiffening, l + Σ k θ²/2, so that F dl is all its work."""
    length = np.array([data.ten_length[model.tendon(tca.name).id] for tca in tcas])
    for i, tca in enumerate(tcas):
        for name, value in tca.stiffening:
            length[i] += 0.5 * value * data.qpos[model.joint(name).qposadr[0]] ** 2
    return length


def _pull(model: mujoco.MjModel, tcas: Sequence[RoutedTca], tension: NDArray[np.float64]) -> None:
    """Constant tensions, and the springs towards the straight joint that they are owed."""
    before = model.jnt_stiffness.copy()
    for tca, force in zip(tcas, tension, strict=True):
        model.actuator_biasprm[model.actuator(tca.name).id, 0] = -force
        for name, value in tca.stiffening:
            model.jnt_stiffness[model.joint(name).id] += value * force
    model.qpos_spring *= before / model.jnt_stiffness


def _to_rest(model: mujoco.MjModel, data: mujoco.MjData, cell: float) -> None:
    stiffness = model.jnt_stiffness
    unit = np.where(model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE), cell, 1.0) * stiffness
    start = copy(data)
    best = np.inf
    for damping in _DAMPING:
        model.dof_damping[:] = damping * model.opt.timestep * stiffness
        mujoco.mj_copyData(data, model, start)
        for _ in range(round(_MOST * damping) // _BATCH):
            mujoco.mj_step(model, data, _BATCH)
            data.qvel[:] = 0.0
            mujoco.mj_forward(model, data)
            residual = float(np.max(np.abs(data.qfrc_smooth) / unit))
            if residual <= _TOLERANCE:
                return
            if not np.isfinite(residual) or any(warning.number for warning in data.warning):
                break
            best = min(best, residual)
    raise NotSettledError(best)


def _shape(
    model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, tca_length: NDArray[np.float64]
) -> RodShape:
    ids = [model.body(piece.name).id for piece in chain.pieces]
    rotation = data.xmat[ids].reshape(-1, 3, 3)
    reach = np.array([chain.local(i) for i in range(len(ids))])
    mujoco.mj_rnePostConstraint(model, data)
    # MuJoCo's spatial forces are about the centre of mass of the whole tree.
    moment, force = data.cfrc_int[ids[0]].reshape(2, 3)
    return RodShape(
        position=data.xpos[ids] + reach[:, None] * rotation[:, :, 2],
        rotation=rotation,
        arc_length=chain.points.copy(),
        strain=_strain(model, data, chain, rotation),
        tca_length=tca_length,
        base_force=force.copy(),
        base_moment=moment + np.cross(data.subtree_com[model.body_rootid[ids[0]]], force),
    )


def _strain(
    model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, rotation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Strains of the cells, interpolated to the points; second order in the cell's length."""
    cells = np.empty((chain.nodes, 6))
    for node in range(chain.nodes):
        turn, vector = np.empty(4), np.empty(3)
        mujoco.mju_mat2Quat(turn, (rotation[node].T @ rotation[node + 1]).ravel())
        mujoco.mju_quat2Vel(vector, turn, 1.0)
        slide = model.jnt_qposadr[model.joint(chain.joints[node]["stretch"]).id]
        cells[node] = [*vector / chain.cell, 0.0, 0.0, 1.0 + data.qpos[slide] / chain.cell]
    if chain.nodes == 1:
        return np.repeat(cells, 2, axis=0)
    inner = (cells[1:] + cells[:-1]) / 2.0
    return np.concatenate([[1.5 * cells[0] - 0.5 * cells[1]], inner,
                           [1.5 * cells[-1] - 0.5 * cells[-2]]])  # fmt: skip

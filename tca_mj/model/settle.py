"""The static shape of a chain: MuJoCo's answer to the question that a rod solver answers."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tca_mj.model.chain import Chain
from tca_mj.model.chain import beam as build
from tca_mj.model.part import new_spec
from tca_mj.model.smooth import SmoothBody, Strained
from tca_mj.model.tendon import RoutedTca, route_passes, route_tca
from tca_mj.rod.beam import BeamSpec
from tca_mj.rod.problem import StrandLaw
from tca_mj.rod.shape import RodShape
from tca_mj.routes import Route, leg_length
from tca_mj.tca import CATALOGUE

# Pseudo-time: a step in units of L² sqrt(line density / EI), about half the period of the first
# mode, and the damping times of every joint over the step, tried one after the other. None of
# them has an influence on the shape at rest, only on whether and how fast it is found.
_STEP, _DAMPING = 1.0, (2.0, 8.0, 32.0)
_BATCH = 5  # steps between two looks at the residual
_MOST = 500  # steps over damping before the next damping is tried
_TOLERANCE = 1e-11  # left in the joints: angle, or stretch over the cell
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
    tensions: Sequence[float | StrandLaw],
    *,
    nodes: int,
    tip_force: ArrayLike = (0.0, 0.0, 0.0),
    tip_moment: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
) -> RodShape:
    """Static shape of a clamped beam with TCAs in it: what ``rod.solve_static`` computes exactly.

    The chain that modules are built from is led from its unloaded shape to rest by heavily
    damped steps of MuJoCo, with the springs that ``Simulation`` gives it too.

    Args:
        beam: The beam, its base at the origin, along +z.
        routes: Routes of the k TCAs, which are weightless here and may lie outside the body.
        tensions: For each of them its tension, at least 0 [N], or its law, for a TCA at a
            temperature: from the length of its route to tension and slope.
        nodes: Nodes of the chain.
        tip_force: Force on the tip in the world's frame, shape (3,) [N].
        tip_moment: Moment on the tip in the world's frame, shape (3,) [N m].
        gravity: Acceleration of gravity in the world's frame, shape (3,) [m/s²].

    Returns:
        The shape at the base, the ends of the cells and the tip: ``nodes`` + 1 points.

    Raises:
        ValueError: If an array has the wrong shape or is not finite, a tension is negative, or
            the chain cannot be built; or from a law.
        NotSettledError: If the chain does not come to rest.
    """
    laws = _laws(tensions, len(routes))
    # Forces in a small unit: the implicit step of a law ignores loads below about 1e-8 of MuJoCo's.
    unit = 1e-3 * min(beam.bending) / beam.length
    beam = _in_units(beam, unit)
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
    data.xfrc_applied[model.body("tip").id] = np.array(load) / unit
    data.qpos[:] = model.qpos_spring
    body = SmoothBody(model, tcas, [chain])
    strands = _Strands(model, tcas, laws, body.at(data.qpos).length, unit)
    _to_rest(model, data, body, strands, chain.cell)
    return _shape(model, data, chain, strands.length(body.at(data.qpos)), unit)


def _vector(name: str, values: ArrayLike, size: int) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be {size} finite numbers, got {values!r}")
    return array


def _laws(tensions: Sequence[float | StrandLaw], count: int) -> list[StrandLaw]:
    entries = list(tensions) if isinstance(tensions, Sequence) else list(np.atleast_1d(tensions))
    constant = [0.0 if callable(entry) else entry for entry in entries]
    pull = _vector("tensions", constant, count)
    if (pull < 0.0).any():
        raise ValueError(f"tensions must be at least 0 N, got {pull}")
    return [
        entry if callable(entry) else lambda length, force=float(force): (force, 0.0)
        for entry, force in zip(entries, pull, strict=True)
    ]


class _Strands:
    """What pulls in the chain."""

    def __init__(
        self,
        model: mujoco.MjModel,
        tcas: Sequence[RoutedTca],
        laws: Sequence[StrandLaw],
        unloaded: NDArray[np.float64],
        unit: float,
    ) -> None:
        self._model, self._laws, self._unit = model, laws, unit
        model.actuator_forcerange[:, 0] = -np.inf
        self._actuator = [model.actuator(tca.name).id for tca in tcas]
        self._tendon = [model.tendon(tca.name).id for tca in tcas]
        self._more = np.array([tca.path_length for tca in tcas]) - unloaded

    def length(self, strained: Strained) -> NDArray[np.float64]:
        """Lengths along the routes, shape (k,) [m]."""
        return strained.length + self._more

    def pull(self, data: mujoco.MjData, strained: Strained) -> NDArray[np.float64]:
        """Hands the laws to MuJoCo, linearised; returns the tensions, shape (k,) [unit]."""
        lengths = self.length(strained)
        now = [law(float(length)) for law, length in zip(self._laws, lengths, strict=True)]
        tension, slope = np.array(now, dtype=np.float64).reshape(-1, 2).T / self._unit
        bias = self._model.actuator_biasprm
        bias[self._actuator, 0] = -tension + slope * data.ten_length[self._tendon]
        bias[self._actuator, 1] = -slope
        return tension


def _in_units(beam: BeamSpec, unit: float) -> BeamSpec:
    return replace(
        beam,
        bending=(beam.bending[0] / unit, beam.bending[1] / unit),
        torsion=beam.torsion / unit,
        stretching=beam.stretching / unit,
        shearing=beam.shearing / unit,
        line_density=beam.line_density / unit,
    )


def _routed(mjspec: mujoco.MjSpec, chain: Chain, route: Route, name: str) -> RoutedTca:
    length = sum(leg_length(leg, chain.beam.length, chain.beam.curvature) for leg in route.legs)
    tca = _WEIGHTLESS_TCA.of_length(length)
    return route_tca(mjspec, tca, route_passes(chain, route), name=name, inside=False)


def _to_rest(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: SmoothBody,
    strands: _Strands,
    cell: float,
) -> None:
    stiffness = model.jnt_stiffness.copy()
    scale = np.where(model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE), cell, 1.0) * stiffness
    start = copy(data)
    best = np.inf
    for damping in _DAMPING:
        model.dof_damping[:] = damping * model.opt.timestep * stiffness
        mujoco.mj_copyData(data, model, start)
        for _ in range(round(_MOST * damping) // _BATCH):
            mujoco.mj_fwdPosition(model, data)
            strained = body.at(data.qpos)
            body.support(data, strained, strands.pull(data, strained))
            data.qvel[:] = 0.0
            mujoco.mj_forward(model, data)
            residual = float(np.max(np.abs(data.qfrc_smooth) / scale))
            if residual <= _TOLERANCE:
                return
            if not np.isfinite(residual) or any(warning.number for warning in data.warning):
                break
            best = min(best, residual)
            mujoco.mj_step(model, data, _BATCH)
    raise NotSettledError(best)


def _shape(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    chain: Chain,
    tca_length: NDArray[np.float64],
    unit: float,
) -> RodShape:
    ids = [model.body(piece.name).id for piece in chain.pieces]
    rotation = data.xmat[ids].reshape(-1, 3, 3)
    reach = np.array([chain.local(i) for i in range(len(ids))])
    mujoco.mj_rnePostConstraint(model, data)
    # MuJoCo's spatial forces are about the centre of mass of the whole tree.
    moment, force = unit * data.cfrc_int[ids[0]].reshape(2, 3)
    return RodShape(
        position=data.xpos[ids] + reach[:, None] * rotation[:, :, 2],
        rotation=rotation,
        arc_length=chain.points.copy(),
        strain=_strain(model, data, chain, rotation),
        tca_length=tca_length,
        base_force=force,
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

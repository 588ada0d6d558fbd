"""The static shape of a chain: MuJoCo's answer to the question that a rod solver answers."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from tca_mj.checks import Array, door
from tca_mj.model.chain import Chain, Nodes, add_chain
from tca_mj.model.mujoco_warnings import count_warnings
from tca_mj.model.part import new_spec
from tca_mj.model.smooth import SmoothBody, Strained
from tca_mj.model.tendon import lay_tca, route_passes
from tca_mj.rod.beam import BeamSpec
from tca_mj.rod.problem import Segment, StaticProblem, StrandLaw
from tca_mj.rod.shape import RodShape
from tca_mj.routes import AnyRoute
from tca_mj.tca import CATALOGUE

# Pseudo-time: a step in units of L² sqrt(line density / EI), about half the period of the first
# mode, and the damping times of every joint over the step, tried one after the other. None of
# them has an influence on the shape at rest, only on whether and how fast it is found.
_STEP, _DAMPING = 1.0, (2.0, 8.0, 32.0)
_BATCH = 5  # steps between two looks at the residual
_MOST = 500  # steps over damping before the next damping is tried
_TOLERANCE = 1e-11  # left in the joints: angle, or stretch over the cell
_ANY_TCA = CATALOGUE["free-stroke"]  # only its rest length is used


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


@door
def settle(
    beam: BeamSpec,
    routes: Sequence[AnyRoute],
    tensions: Sequence[float | StrandLaw],
    *,
    nodes: Nodes,
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
        nodes: Nodes of the chain, 1 to 128.
        tip_force: Force on the tip in the world's frame, shape (3,) [N].
        tip_moment: Moment on the tip in the world's frame, shape (3,) [N m].
        gravity: Acceleration of gravity in the world's frame, shape (3,) [m/s²].

    Returns:
        The shape at the base, the ends of the cells and the tip: ``nodes`` + 1 points.

    Raises:
        ValueError: If an array has the wrong shape or is not finite, a tension is negative, or
            the chain cannot be built; or from a law.
        NotSettledError: If the chain does not come to rest.

    Example:
        >>> from tca_mj import parallel
        >>> from tca_mj.model import settle
        >>> from tca_mj.modules import silicone_cylinder
        >>> beam = silicone_cylinder(45e-3, 4.5e-3, 9e-3)
        >>> shape = settle(beam, parallel(1, 4e-3), [0.02], nodes=8)  # one TCA pulls with 0.02 N
        >>> (1e3 * shape.position[-1]).round(1)  # of the tip [mm]
        array([26.7,  0. , 30.8])
    """
    segment = Segment(beam, routes, tensions)
    loaded = _LoadedChain(StaticProblem([segment], tip_force, tip_moment, gravity), nodes)
    loaded.to_rest()
    return loaded.shape()


class _LoadedChain:
    """The chain of one segment with all that pulls at it, in units of a small force."""

    def __init__(self, problem: StaticProblem, nodes: int) -> None:
        segment = problem.segments[0]
        # The implicit step of a law ignores loads below about 1e-8 of MuJoCo's unit of force.
        self._unit = unit = 1e-3 * min(segment.beam.bending) / segment.beam.length
        beam = _in_units(segment.beam, unit)
        mjspec = new_spec("settle")
        mjspec.option.gravity = problem.gravity
        softest = min(beam.bending)
        mjspec.option.timestep = _STEP * beam.length**2 * np.sqrt(beam.line_density / softest)
        self._chain = chain = add_chain(
            mjspec.worldbody, beam, nodes=nodes, name="body", collide=False
        )
        passes = [route_passes(chain, route) for route in segment.routes]
        tcas = [
            lay_tca(mjspec, _ANY_TCA, each, name=f"tca{i}", ideal=True)
            for i, each in enumerate(passes)
        ]
        # MuJoCo applies loads at a body's centre of mass: a massless body has it where it is told.
        tip = chain.tip.add_body(name="tip", pos=[0.0, 0.0, chain.local(nodes)])
        tip.ipos = [0.0, 0.0, 0.0]

        count_warnings()
        self._model: mujoco.MjModel = mjspec.compile()
        self._data = mujoco.MjData(self._model)
        load = [*np.asarray(problem.tip_force), *np.asarray(problem.tip_moment)]
        self._data.xfrc_applied[self._model.body("tip").id] = np.array(load) / unit
        self._data.qpos[:] = self._model.qpos_spring
        self._body, self._laws = SmoothBody(self._model, tcas, [chain]), segment.tensions
        self._model.actuator_forcerange[:, 0] = -np.inf
        self._actuator = [self._model.actuator(tca.name).id for tca in tcas]
        self._tendon = [self._model.tendon(tca.name).id for tca in tcas]
        path = np.array([tca.path_length for tca in tcas])
        self._more = path - self._body.at(self._data.qpos).length

    def _pull(self, strained: Strained) -> Array:
        """Hands the laws to MuJoCo, linearised; returns the tensions, shape (k,) [unit]."""
        lengths = strained.length + self._more
        now = [
            law(float(length)) if callable(law) else (law, 0.0)
            for law, length in zip(self._laws, lengths, strict=True)
        ]
        tension, slope = np.array(now, dtype=np.float64).reshape(-1, 2).T / self._unit
        bias = self._model.actuator_biasprm
        bias[self._actuator, 0] = -tension + slope * self._data.ten_length[self._tendon]
        bias[self._actuator, 1] = -slope
        return tension

    def to_rest(self) -> None:
        """Steps until nothing is left that moves the joints.

        Raises:
            NotSettledError: If that takes too long at any damping.
        """
        model, data = self._model, self._data
        stiffness = model.jnt_stiffness.copy()
        slides = model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)
        scale = np.where(slides, self._chain.cell, 1.0) * stiffness
        start = copy(data)
        best = np.inf
        for damping in _DAMPING:
            model.dof_damping[:] = damping * model.opt.timestep * stiffness
            mujoco.mj_copyData(data, model, start)
            for _ in range(round(_MOST * damping) // _BATCH):
                mujoco.mj_fwdPosition(model, data)
                strained = self._body.at(data.qpos)
                self._body.support(data, strained, self._pull(strained))
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

    def shape(self) -> RodShape:
        """What ``settle`` returns, of the chain as it is now."""
        model, data, chain = self._model, self._data, self._chain
        strained = self._body.at(data.qpos)
        ids = [model.body(piece.name).id for piece in chain.pieces]
        rotation = data.xmat[ids].reshape(-1, 3, 3)
        reach = np.array([chain.local(i) for i in range(len(ids))])
        mujoco.mj_rnePostConstraint(model, data)
        # MuJoCo's spatial forces are about the centre of mass of the whole tree.
        moment, force = self._unit * data.cfrc_int[ids[0]].reshape(2, 3)
        return RodShape(
            position=data.xpos[ids] + reach[:, None] * rotation[:, :, 2], rotation=rotation,
            arc_length=chain.points.copy(), strain=_strain(strained.motion, chain),
            tca_length=strained.length + self._more, base_force=force,
            base_moment=moment + np.cross(data.subtree_com[model.body_rootid[ids[0]]], force),
        )  # fmt: skip


def _in_units(beam: BeamSpec, unit: float) -> BeamSpec:
    names = ("torsion", "stretching", "shearing", "line_density")
    bending = (beam.bending[0] / unit, beam.bending[1] / unit)
    return replace(beam, bending=bending, **{name: getattr(beam, name) / unit for name in names})


def _strain(motion: Array, chain: Chain) -> Array:
    """Strains of the cells, interpolated to the points; second order in the cell's length."""
    cells = np.zeros((chain.nodes, 6))
    cells[:, :3] = motion[1:].T / chain.cell
    cells[:, 5] = 1.0 + motion[0] / chain.cell
    if chain.nodes == 1:
        return np.repeat(cells, 2, axis=0)
    inner = (cells[1:] + cells[:-1]) / 2.0
    return np.concatenate([[1.5 * cells[0] - 0.5 * cells[1]], inner,
                           [1.5 * cells[-1] - 0.5 * cells[-2]]])  # fmt: skip

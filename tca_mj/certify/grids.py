"""The grid of morphing modules against what theory knows of it: rods in a tree do not close loops.

Known are the vault, whose rows are independent arcs; small deflections, by the linear theory of
frames; and that commands with a symmetry make a shape with that symmetry.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tca_mj.certify.solid import solid
from tca_mj.checks import Array
from tca_mj.robots.morphing_grid import SIDES, MorphingGridSpec, morphing_grid
from tca_mj.rod import BeamSpec
from tca_mj.rod.lie import hat
from tca_mj.sim import Simulation

SOFT = 120.0  # temperature of the spines [°C]
_PERIOD = 0.1  # of the simulations, which are led to rest and no more [s]
# Time steps [s]: the welds that close loops are as stiff as they allow. What bends by tens of
# degrees does not notice, small deflections do.
_COARSE, _FINE = 20e-3, 5e-3
_WARMING, _HOLDING = 2.0, 12.0  # time in which its TCAs are heated, and in which it settles [s]
# Bend of a member [deg] and gravity [m/s²] of small deflections: what they shorten the grid by is
# of second order.
_LITTLE, _LIGHT = 0.2, 0.05
_RIGID = 1e4  # stretching stiffness of members that do not stretch, over their own


class Lattice(NamedTuple):
    """A grid at rest.

    Attributes:
        place: Middles of the junctions, shape (rows, columns, 3) [m].
        tension: Tensions of its TCAs [N].
        velocity: Largest velocity of a joint that is left [rad/s].
    """

    place: Array
    tension: Array
    velocity: float


def soft_grid(
    spec: MorphingGridSpec, temperatures: Array, gravity: float = 0.0, timestep: float = _COARSE
) -> Lattice:
    """A grid whose spines are soft, at rest.

    Args:
        spec: The grid.
        temperatures: Of its TCAs [°C].
        gravity: Acceleration of gravity, down [m/s²].
        timestep: Time step [s].
    """
    part = morphing_grid(spec)
    part.spec.option.gravity = [0.0, 0.0, -gravity]
    springs = solid(part, SOFT).part
    sim = Simulation(springs, timestep=timestep, tca_period=_PERIOD)
    left = sim.rest(temperatures, warming=_WARMING, longest=_HOLDING)
    sites = [[sim.data.site(f"junction{i}.{j}").xpos for j in range(spec.columns)]
             for i in range(spec.rows)]  # fmt: skip
    return Lattice(np.array(sites), sim.tension, left)


def flat(spec: MorphingGridSpec) -> Array:
    """Middles of the junctions of the flat grid, shape (rows, columns, 3) [m]."""
    rows, columns = np.arange(spec.rows) - spec.held[0], np.arange(spec.columns) - spec.held[1]
    y, x = np.meshgrid(spec.pitch * rows, spec.pitch * columns, indexing="ij")
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def vault(spec: MorphingGridSpec, angle: float) -> Array:
    """Middles of the junctions of a weightless grid whose members along x are bent by an angle.

    Rows are alike and do not hinder each other: arcs between rigid junctions.

    Args:
        spec: The grid.
        angle: Bend of a member, positive where the edges go up, not 0 [rad].
    """
    place, half = flat(spec), spec.junction / 2.0
    radius = spec.member.spine.length / angle
    for way in (1, -1):
        x = z = turned = 0.0
        for column in range(spec.held[1] + way, spec.columns if way > 0 else -1, way):
            for bend in (0.0, angle, 0.0):
                step = half if bend == 0.0 else 0.0
                x += step * np.cos(turned) + radius * (np.sin(turned + bend) - np.sin(turned))
                z += step * np.sin(turned) - radius * (np.cos(turned + bend) - np.cos(turned))
                turned += bend
            place[:, column, 0], place[:, column, 2] = way * x, z
    return place


def frame(spec: MorphingGridSpec, tension: Array, gravity: float = 0.0) -> Array:
    """Displacements of the junctions of a soft grid, by the linear theory of frames.

    Members bend and twist after Euler, Bernoulli and Saint-Venant, junctions are rigid.

    Args:
        spec: The grid.
        tension: Tensions of its TCAs [N].
        gravity: Acceleration of gravity, down [m/s²].

    Returns:
        Displacements and rotations, shape (rows, columns, 6) [m, rad].
    """
    part, place = morphing_grid(spec), flat(spec)
    beams, size = solid(part, SOFT).beams, spec.member.spine
    number = {(i, j): 6 * (i * spec.columns + j)
              for i in range(spec.rows) for j in range(spec.columns)}  # fmt: skip
    stiffness, load = np.zeros((2, 6 * len(number), 6 * len(number)))
    load = load[0]
    load[2::6] = -spec.junction_mass * gravity
    for index, beam in enumerate(spec.members):
        ends = [slice(at, at + 6) for at in (number[beam.start], number[beam.end])]
        start, end = place[beam.start], place[beam.end]
        way = (end - start) / np.linalg.norm(end - start)
        up = np.array([0.0, 0.0, 1.0])
        turn = np.column_stack([np.cross(up, way), up, way])
        both = np.kron(np.eye(2), turn)
        faces = start + 0.5 * spec.junction * way, end - 0.5 * spec.junction * way
        # How far the member's end is from where its start would take it: by both junctions.
        far = np.hstack([-_carried(faces[1] - start), _carried(faces[1] - end)])
        springs = both @ np.linalg.inv(_flexibility(beams[beam.name])) @ both.T
        where = np.r_[ends[0], ends[1]]
        stiffness[np.ix_(where, where)] += far.T @ springs @ far
        for pull, sign in zip(tension[2 * index : 2 * index + 2], SIDES.values(), strict=True):
            arm = np.array([0.0, sign * size.tca_offset, 0.0])
            force = np.array([0.0, 0.0, -2.0 * pull])
            load[where] += far.T @ both @ np.concatenate([force, np.cross(arm, force)])
        tcas = part.tcas[2 * index : 2 * index + 2]
        mass = beams[beam.name].mass + sum(tca.spec.mass for tca in tcas)
        half, moment = mass * gravity / 2.0, mass * gravity * size.length / 12.0
        for which, (at, sign) in enumerate(((start, 1.0), (end, -1.0))):
            fixed = np.array([0.0, -half, 0.0, sign * moment, 0.0, 0.0])
            load[ends[which]] += _carried(faces[which] - at).T @ both @ fixed
    free = np.delete(np.arange(load.size), slice(number[spec.held], number[spec.held] + 6))
    moved = np.zeros(load.size)
    moved[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
    return moved.reshape(spec.rows, spec.columns, 6)


def _carried(arm: Array) -> Array:
    """From the motion of a place to that of what is rigid with it, an arm away, shape (6, 6)."""
    carried = np.eye(6)
    carried[:3, 3:] = -hat(arm)
    return carried


def _flexibility(beam: BeamSpec) -> Array:
    """Displacement and rotation of a cantilever's end per force and moment on it, shape (6, 6)."""
    length, found = beam.length, np.zeros((6, 6))
    # About x the end goes to -y, about y to x.
    for across, about, stiff, sign in ((1, 3, beam.bending[0], -1.0), (0, 4, beam.bending[1], 1.0)):
        found[across, across] = length**3 / (3.0 * stiff)
        found[across, about] = found[about, across] = sign * length**2 / (2.0 * stiff)
        found[about, about] = length / stiff
    found[2, 2], found[5, 5] = length / (_RIGID * beam.stretching), length / beam.torsion
    return found


def lattices() -> Iterator[tuple[str, str, float, float]]:
    """What the grid is asked: the case, what it is compared with, the error and its bound."""
    spec, small = MorphingGridSpec(), MorphingGridSpec(rows=2, columns=2)
    reach = spec.pitch
    bend = np.radians(40.0)
    found = soft_grid(spec, spec.temperatures(bend))
    yield "vault, 40° in each member", "arcs", _off(found.place, vault(spec, bend)) / reach, 0.01
    for name, sign in (("bowl", 1.0), ("saddle", -1.0)):
        command = small.temperatures(np.radians(_LITTLE), sign * np.radians(_LITTLE))
        found = soft_grid(small, command, timestep=_FINE)
        error = _off(found.place - flat(small), frame(small, found.tension)[..., :3])
        moved = float(np.linalg.norm(found.place - flat(small), axis=-1).max())
        what = f"{name}, {_LITTLE:g}° in each member"
        yield what, "linear frame, of its deflection", error / moved, 0.01
    error = sagging(small)
    yield f"sag under {_LIGHT:g} m/s²", "linear frame, of its deflection", error, 0.01
    command = spec.temperatures(np.radians(30.0), np.radians(30.0))
    place = soft_grid(spec, command).place
    error = max(_off(place, other) for other in (
        place[::-1] * [1.0, -1.0, 1.0], np.swapaxes(place, 0, 1)[..., [1, 0, 2]]))  # fmt: skip
    yield "bowl, 30° in each member", "its mirror images", error / reach, 1e-3
    command = spec.temperatures(np.radians(30.0), np.radians(-30.0))
    place = soft_grid(spec, command).place
    error = _off(place, np.swapaxes(place, 0, 1)[..., [1, 0, 2]] * [1.0, 1.0, -1.0])
    yield "saddle, 30° and -30°", "itself, turned over", error / reach, 1e-3


def sagging(spec: MorphingGridSpec, times: int = 1) -> float:
    """Error of the sag of a soft grid under little weight, over that sag [1].

    Args:
        spec: The grid.
        times: Multiple of its nodes.
    """
    finer = replace(spec, member=replace(spec.member, nodes=times * spec.member.nodes))
    cold = np.full(2 * len(spec.members), 25.0)
    found = soft_grid(finer, cold, _LIGHT, _FINE)
    exact = frame(finer, found.tension, _LIGHT)[..., :3]
    return _off(found.place - flat(spec), exact) / float(np.abs(exact).max())


def _off(found: Array, exact: Array) -> float:
    """Largest distance of two sets of places [m]."""
    return float(np.linalg.norm(found - exact, axis=-1).max())

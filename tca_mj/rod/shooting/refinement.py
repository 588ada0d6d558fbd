"""Finer meshes for the balance of bodies in series, and what lies between the nodes."""

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.quadrature import halved, lagrange
from tca_mj.rod.shooting.collocation import NODES, STAGES, WEIGHTS
from tca_mj.rod.shooting.equations import Look, Mesh, State

Indices = NDArray[np.intp]


def refined(
    mesh: Mesh, state: State, marked: NDArray[np.bool_]
) -> tuple[Mesh, State, Indices, NDArray[np.bool_]]:
    """The mesh with marked steps halved, and the state on it by the polynomials of the steps.

    Returns:
        Mesh, state, and for each of the new steps in which of the old ones it lies, and whether it
        starts where that one does.
    """
    finer = Mesh(mesh.series, halved(mesh.nodes, mesh.owner, marked))
    parent = np.repeat(np.arange(len(marked)), 1 + marked)
    second = np.append(False, parent[1:] == parent[:-1])
    size = np.repeat(1.0 / (1 + marked), 1 + marked)
    start, stages, strain = sample(mesh, state, parent, second * size, second * size + size)
    nodes = np.empty((finer.total, 7))
    nodes[finer.starts] = start
    nodes[np.append(finer.joints, -1)] = state.nodes[np.append(mesh.joints, -1)]
    return finer, State(nodes, stages, strain, state.tension), parent, ~second


def sample(
    mesh: Mesh, state: State, parent: Indices, start: Array, end: Array
) -> tuple[Array, Array, Array]:
    """Smaller steps within steps, by the polynomials of these.

    Args:
        mesh: The mesh.
        state: State on it.
        parent: In which step each small one lies, shape (n,).
        start: Where in that it starts, from 0 to 1, shape (n,).
        end: Where it ends, shape (n,).

    Returns:
        y at the start, shape (n, 7), at the stages, (n, STAGES, 7), and strains, (n STAGES, 6).
    """
    first = state.nodes[mesh.starts]
    known = np.concatenate([first[:, None], state.stages], axis=1)[parent]
    with_start = np.append(0.0, NODES)
    begin = np.einsum("nk,nky->ny", lagrange(with_start, start), known)
    at = start[:, None] + (end - start)[:, None] * NODES
    stages = np.einsum("njk,nky->njy", lagrange(with_start, at), known)
    strain = state.strain.reshape(-1, STAGES, 6)[parent]
    inner = np.einsum("njk,nky->njy", lagrange(NODES, at), strain)
    return begin, stages, inner.reshape(-1, 6)


def differences(
    mesh: Mesh, coarse: tuple[State, Look], finer: Mesh, fine: tuple[State, Look],
    parent: Indices, first: NDArray[np.bool_],
) -> tuple[float, Array]:  # fmt: skip
    """What a refinement has changed in nodes, position and lengths of strands, and what of routes
    it has not seen.

    Returns:
        The change in all, and that of each old step, both without unit: frames and moments as they
        are, the moments over the largest one if it is above 1, lengths over the whole length.
    """
    scale = max(1.0, float(np.abs(fine[0].nodes).max()))
    before = np.abs(fine[0].nodes[finer.starts][first] - coarse[0].nodes[mesh.starts]) / scale
    last = np.append(parent[1:] != parent[:-1], True)
    after = np.abs(fine[0].nodes[finer.starts + 1][last] - coarse[0].nodes[mesh.starts + 1])
    after /= scale
    moved = np.add.reduceat(_reach(finer, *fine), np.flatnonzero(first)) - _reach(mesh, *coarse)
    moved /= mesh.series.reach
    gap = np.maximum.reduceat(_gap(finer), np.flatnonzero(first)) / mesh.series.reach
    local = np.max([np.abs(after - before).max(axis=1), np.abs(moved).max(axis=1), gap], axis=0)
    return max(float(after.max()), float(np.abs(moved.sum(axis=0)).max()), float(gap.max())), local


def _reach(mesh: Mesh, state: State, look: Look) -> Array:
    """Translation of each step and length of each leg in it, shape (steps, 3 + J) [m]."""
    density = look.at.density.reshape(len(mesh.starts), STAGES, -1)
    legs = mesh.steps.length[:, None] * np.einsum("j,ijl->il", WEIGHTS, density)
    return np.hstack([mesh.steps.translation(state.stages, look.at.strain), legs])


def _gap(mesh: Mesh) -> Array:
    """By how much the slope of a leg misses its offset over each step, shape (steps,) [m].

    This sees a kink in a route where by accident two meshes agree about it.
    """
    run = [np.diff(mesh.series.sections(k, at).offset, axis=0) for k, at in enumerate(mesh.nodes)]
    slope = mesh.steps.sections.slope.reshape(len(mesh.starts), STAGES, -1, 3)[..., :2]
    rise = mesh.steps.length[:, None, None] * np.einsum("j,ijla->ila", WEIGHTS, slope)
    return np.abs(np.concatenate(run) - rise).max(axis=(1, 2), initial=0.0)

"""Functions of arc length on rods in series: polynomials on pieces, given at Gauss's points."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.quadrature import GaussRule, halved, lagrange
from tca_mj.rod.errors import RodSolveError
from tca_mj.rod.problem import Segment

POINTS = 12  # of Gauss on one piece
_ROUTE_TAIL = 1e-4  # last Legendre coefficients of a route's offset over its largest value
_PIECES = 64  # at most: the Hessian is a full matrix


class Mesh:
    """Pieces of segments in series, n in all, with q points each.

    Attributes:
        edges: Ends of the pieces of each segment, from 0 at its base to 1 at its tip.
        rule: Gauss's points of a piece.
        owner: Segment of each piece, shape (n,).
        part: Length of each piece over that of its segment, shape (n,).
    """

    def __init__(self, edges: Sequence[Array]) -> None:
        """A mesh with these ends of pieces.

        Raises:
            RodSolveError: If there are too many pieces.
        """
        self.edges = tuple(edges)
        counts = [len(edge) - 1 for edge in edges]
        if sum(counts) > _PIECES:
            raise RodSolveError("routes or strains are not smooth enough", sum(counts) / _PIECES)
        self.rule = GaussRule.of(POINTS)
        self.owner = np.repeat(np.arange(len(counts)), counts)
        self.part = np.concatenate([np.diff(edge) for edge in edges])

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> "Mesh":
        """The coarsest mesh by halving that follows the segments' routes roughly.

        Raises:
            RodSolveError: If that takes too many pieces.
        """
        mesh = cls([np.array([0.0, 1.0])] * len(segments))
        while True:
            rough = np.zeros(len(mesh.owner), dtype=np.bool_)
            for index, segment in enumerate(segments):
                s = mesh.points(index)
                for leg in [leg for route in segment.routes for leg in route.legs]:
                    offset = leg.offset(s)
                    tail = mesh.tail(offset) > _ROUTE_TAIL * np.abs(offset).max()
                    rough[mesh.owner == index] |= tail
            if not rough.any():
                return mesh
            mesh = mesh.halved(rough)

    def points(self, segment: int) -> Array:
        """The points of a segment, from 0 to 1, shape (pieces, q)."""
        edge = self.edges[segment]
        return edge[:-1, None] + np.diff(edge)[:, None] * self.rule.node

    def tail(self, values: Array) -> Array:
        """Largest of the last Legendre coefficients of each piece, (n, q, m) -> (n,)."""
        coefficients = np.einsum("kq,nqi->nki", self.rule.transform[-2:], values)
        return np.abs(coefficients).max(axis=(1, 2))

    def halved(self, rough: NDArray[np.bool_]) -> "Mesh":
        """The mesh with chosen pieces halved.

        Raises:
            RodSolveError: If that makes too many pieces.
        """
        return Mesh(halved(self.edges, self.owner, rough))

    def inside(self, segment: int, s: Array) -> tuple[NDArray[np.intp], Array]:
        """Pieces in which points of a segment lie, and where in them, from 0 to 1."""
        edge = self.edges[segment]
        piece = np.clip(np.searchsorted(edge, s, side="right") - 1, 0, len(edge) - 2)
        place = (s - edge[piece]) / np.diff(edge)[piece]
        return np.flatnonzero(self.owner == segment)[piece], place

    def at(self, values: Array, segment: int, s: Array) -> Array:
        """Values at points of a segment from those at the mesh's, (n, q, m) -> (..., m)."""
        piece, place = self.inside(segment, s)
        return np.einsum("...q,...qi->...i", lagrange(self.rule.node, place), values[piece])

    def carried(self, values: Array, finer: "Mesh") -> Array:
        """The values at the points of another mesh."""
        return np.concatenate(
            [self.at(values, index, finer.points(index)) for index in range(len(self.edges))]
        )

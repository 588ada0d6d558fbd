"""Energy of soft bodies with strands as a function of their strains, with its derivatives.

With the strain xi = (u, v) of a body's centre line, g' = g xi^ for its frames, the energy is

    E = sum over segments of integral 1/2 (xi - xi*)^T K (xi - xi*) ds
        + sum over strands of U_a(l_a) + sum over springs of 1/2 k (longer)²
        - f . p(tip) - gravity . (sum of mass times position),

U_a' = tension, with the length of a strand l_a = sum over its legs of the integral of |w| ds,
w = v + u x r + r' at the offset r. A moment on the tip that is fixed in the world has no energy;
its virtual work has a derivative, the antisymmetric part of which tells so.

Bodies that branch are a tree. Every way through it, from the clamp to a tip, is one *line*, a rod
of its own; of the masses that lines share, one line counts each, so that the works add up.

The strains are polynomials on pieces of the rod, given at Gauss's points, which are those of the
integrals too: the elastic part of the Hessian is one small block for each point, and the work of
the loads has gradient and Hessian in closed form (``tca_mj.rod.energy.motion``).

Pure numbers inside: length over that of all segments L, force over the smallest EI/L².
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Array
from tca_mj.quadrature import lagrange
from tca_mj.rod.energy.mesh import POINTS, Mesh
from tca_mj.rod.energy.motion import BASIS, Pieces, lump, rigid
from tca_mj.rod.lie import hat, matrix_quaternion, quaternion_log
from tca_mj.rod.problem import Segment, Spring, StaticProblem, asked
from tca_mj.rod.sections import Sections, place
from tca_mj.rod.shape import RodShape

_TAIL = 1e-9  # last Legendre coefficients of the strain, times the length of the piece
_TURN = 6.0  # of a piece [rad]: below, the points integrate a constant strain to 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """One way from the clamp to a tip, over k pieces.

    Attributes:
        segments: Its segments, from the clamp.
        pieces: Numbers of its pieces, shape (k,).
        density: What it counts of their mass per length, shape (k,).
        joint: What is rigid before each, as factors of G, shape (k, 5, 5).
        end: What is rigid behind the last one, shape (5, 5).
        loaded: 1 if the load on the tip acts on its own, else 0.
        springs: Those that pull on its tip.
    """

    segments: tuple[int, ...]
    pieces: NDArray[np.intp]
    density: Array
    joint: Array
    end: Array
    loaded: float
    springs: tuple[Spring, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """A line at given strains.

    Attributes:
        pieces: Motions over its pieces.
        before: G at the start of the pieces, shape (k, 5, 5).
        after: What follows on the end of the pieces up to the tip, shape (k, 5, 5).
        tip: G at the tip.
        pull: Derivative of the loads' work by G at the tip, shape (5, 5).
        work: Work of force and gravity, less the energy of springs.
        stiff: For each spring where it is fixed on the tip, as G moves it, shape (5,), and by how
            much its force falls with a motion of that point, shape (3, 3).
    """

    pieces: Pieces
    before: Array
    after: Array
    tip: Array
    pull: Array
    work: float
    stiff: tuple[tuple[Array, Array], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """The rods at given strains, n pieces of q points with m strains each.

    Attributes:
        strain: The strains, shape (n, q, m).
        factor: Part of the load that acts.
        courses: Of the lines; the last one ends at the tip of the last segment.
        elastic: Energy of the bodies.
        work: Work of force and gravity.
        length: Lengths of the strands, shape (k,).
        tension: Their tensions, shape (k,).
        stiffness: Derivatives of the tensions by the lengths, shape (k,).
        drawn: Gradients of the lengths over the weights of the points, shape (k, n, q, m).
        slope: Gradient of the energy without loads over the weights, shape (n, q, m).
        bend: Its derivative at fixed tensions, shape (n, q, m, m).
        shortest: Smallest |w| of a strand.
    """

    strain: Array
    factor: float
    courses: tuple[Course, ...]
    elastic: float
    work: float
    length: Array
    tension: Array
    stiffness: Array
    drawn: Array
    slope: Array
    bend: Array
    shortest: float


class Potential:
    """The energy of a problem on one mesh.

    Attributes:
        mesh: The mesh.
        unloaded: Strains without loads and tensions, shape (n, q, m).
        start: Those with which the rods set out, the same shape.
        conservative: Whether there is an energy: no moment acts on the tip.
        metric: Twice the elastic energy of unit strains at each point, shape (n, q, m).
    """

    def __init__(self, problem: StaticProblem, mesh: Mesh) -> None:
        """Scales the problem."""
        self.mesh, self._rule = mesh, mesh.rule
        self._problem = problem
        self._segments = segments = cast(tuple[Segment, ...], problem.segments)
        beams = [segment.beam for segment in segments]
        self._size = sum(beam.length for beam in beams)
        self._force = min(min(beam.bending) for beam in beams) / self._size**2
        self._active = np.arange(6) if problem.shearable else np.array([0, 1, 2, 5])
        self._basis = BASIS[self._active]
        owner = mesh.owner
        self._span = mesh.part * np.array([beam.length for beam in beams])[owner] / self._size
        self._weight = self._span[:, None] * self._rule.weight
        self._laws = problem.tensions
        parts = [place(problem, k, mesh.points(k).ravel()) for k in range(len(segments))]
        self._sections = Sections.joined(parts).scaled(self._size, self._force)
        shape = len(owner), POINTS, 6
        self._stiffness = self._sections.stiffness.reshape(shape)[..., self._active]
        self.unloaded = self._sections.reference.reshape(shape)[..., self._active]
        self.start = self.unloaded.copy()
        for k, segment in enumerate(segments):
            if segment.start is not None:
                self.start[owner == k, :, :3] = self._size * np.asarray(segment.start)
        self._density = np.array([beam.line_density for beam in beams])[owner]
        self._density = self._density * self._size / self._force
        self.metric = self._weight[..., None] * self._stiffness
        self._moment = np.asarray(problem.tip_moment) / (self._force * self._size)
        self.conservative = not self._moment.any()
        counted: set[int] = set()
        self._lines = []
        for tip in range(len(segments)):
            if tip not in problem.bases:
                self._lines.append(self._line(tip, counted))
                counted |= set(self._lines[-1].segments)

    def _line(self, tip: int, counted: set[int]) -> Line:
        """The line to the tip of a segment, without the masses of segments that are counted."""
        way = [tip]
        while (base := self._problem.bases[way[0]]) >= 0:
            way.insert(0, base)
        owner = self.mesh.owner
        pieces = np.concatenate([np.flatnonzero(owner == index) for index in way])
        joint, end = np.tile(np.eye(5), (len(pieces), 1, 1)), np.eye(5)
        for index in way:
            segment, share = self._segments[index], float(index not in counted)
            turn = rigid(segment.rotation, np.asarray(segment.offset) / self._size)
            joint[np.argmax(owner[pieces] == index)] = end @ turn
            mass = share * segment.mass / self._force
            end = lump(mass, np.asarray(segment.centre) / self._size)
        fresh = ~np.isin(owner[pieces], list(counted))
        return Line(
            segments=tuple(way), pieces=pieces, density=np.where(fresh, self._density[pieces], 0.0),
            joint=joint, end=end, loaded=float(tip == len(self._segments) - 1),
            springs=self._segments[tip].springs,
        )  # fmt: skip

    def rough(self, strain: Array) -> NDArray[np.bool_]:
        """Pieces that are too long for these strains, shape (n,)."""
        turn = np.sum(self._weight * np.linalg.norm(self._full(strain)[..., :3], axis=-1), axis=1)
        rough: NDArray[np.bool_] = (self.mesh.tail(strain) * self._span > _TAIL) | (turn > _TURN)
        return rough

    def _full(self, strain: Array) -> Array:
        """All six strains of the m that may change, shape (..., 6)."""
        whole = np.zeros((*strain.shape[:-1], 6))
        whole[..., self._active] = strain
        return whole

    def at(self, strain: Array, factor: float) -> State:
        """Energy, and all that its derivatives need, under a part of the loads and tensions."""
        xi = self._full(strain)
        courses = tuple(self._course(line, xi[line.pieces], factor) for line in self._lines)
        sections, count, shape = self._sections, len(self._laws), strain.shape
        density, tangent = sections.directions(xi.reshape(-1, 6))
        length = sections.lengths(density, self._weight, count + 1)[:count]
        law = [asked(i, law, float(length[i]) * self._size) for i, law in enumerate(self._laws)]
        scaled = np.array(law).reshape(-1, 2) * [1.0, self._size] / self._force
        tension, stiffness = factor * scaled.T
        drawn = sections.pull(tangent, range(count))[:, self._active]
        drawn = np.moveaxis(drawn, -1, 0).reshape(count, *shape)
        bend = sections.hessian(density, tangent, np.append(tension, 0.0)[sections.strand])
        bend = bend[:, self._active][..., self._active].reshape(*shape, shape[-1])
        excess = strain - (factor * self.unloaded + (1.0 - factor) * self.start)
        stress = self._stiffness * excess
        return State(
            strain=strain, factor=factor, courses=courses,
            elastic=0.5 * float(np.sum(self._weight[..., None] * stress * excess)),
            work=sum(course.work for course in courses), length=length, tension=tension,
            stiffness=stiffness, drawn=drawn, slope=stress + np.tensordot(tension, drawn, 1),
            bend=bend,
            shortest=float(density[sections.strand < count].min(initial=1.0)),
        )  # fmt: skip

    def _course(self, line: Line, xi: Array, factor: float) -> Course:
        """A line at the strains of its points, shape (k, q, 6), under a part of the loads."""
        pieces = Pieces.of(self._rule, self._span[line.pieces], xi, line.density)
        n = len(xi)
        before, after = np.empty((n, 5, 5)), np.empty((n, 5, 5))
        tip, follow = np.eye(5), line.end
        for i in range(n):
            before[i] = tip @ line.joint[i]
            tip = before[i] @ pieces.motion[i]
        tip = tip @ line.end
        for i in reversed(range(n)):
            after[i] = follow
            follow = line.joint[i] @ pieces.motion[i] @ follow

        load = np.zeros((5, 5))
        load[:3, 3] = line.loaded * factor * np.asarray(self._problem.tip_force) / self._force
        load[:3, 4] = factor * np.asarray(self._problem.gravity)
        pull = load.copy()
        # A turn w of the tip changes R by w x R; the product with this is w . moment.
        pull[:3, :3] = 0.5 * line.loaded * hat(factor * self._moment) @ tip[:3, :3]
        work, stiff = float(np.sum(load * tip)), []
        for spring in line.springs:
            at = np.array([*np.asarray(spring.end) / self._size, 1.0, 0.0])
            way = tip[:3] @ at - np.asarray(spring.start) / self._size
            long, rate = float(np.linalg.norm(way)), factor * spring.stiffness
            rate *= self._size / self._force
            more = long - spring.length / self._size
            if more <= 0.0:
                continue
            work -= 0.5 * rate * more**2
            pull[:3] -= rate * more / long * np.outer(way, at)
            along = np.outer(way, way) / long**2
            stiff.append((at, rate * (along + more / long * (np.eye(3) - along))))
        return Course(pieces=pieces, before=before, after=after, tip=tip, pull=pull, work=work,
                      stiff=tuple(stiff))  # fmt: skip

    def change(self, old: State, new: State) -> float:
        """Energy of a state minus that of another one nearby, with a moment's work on the way.

        A strand's energy is the integral of its tension, by Hermite's formula of fourth order.
        """
        longer = new.length - old.length
        stored = 0.5 * longer @ (old.tension + new.tension)
        stored += longer * longer @ (old.stiffness - new.stiffness) / 12.0
        now, before = new.courses[-1].tip[:3, :3], old.courses[-1].tip[:3, :3]
        turn = quaternion_log(matrix_quaternion(now @ before.T))
        work = new.work - old.work + new.factor * self._moment @ turn
        return float(new.elastic - old.elastic + stored - work)

    def gradient(self, state: State) -> Array:
        """Derivative of the energy by the strains, shape (n, q, m)."""
        work = np.zeros_like(state.slope)
        for line, course in zip(self._lines, state.courses, strict=True):
            ring = self._ring(course)[:, range(POINTS), range(POINTS)]
            work[line.pieces] += np.einsum("nqij,aji->nqa", ring, self._basis)
        return self._weight[..., None] * state.slope - work

    def _ring(self, course: Course) -> Array:
        """T_q P^T S_r with P the derivative of the work by a piece's motion, (k, q, r, 5, 5)."""
        transposed = course.after @ course.pull.T @ course.before
        left = course.pieces.behind @ transposed[:, None]
        return left[:, :, None] @ course.pieces.ahead[:, None]

    def hessian(self, state: State) -> tuple[Array, Array]:
        """Second derivative of the energy, and what a moment adds to the gradient's derivative.

        Returns:
            A symmetric and an antisymmetric matrix, each (n q m) x (n q m).
        """
        n, q, m = state.strain.shape
        hessian, twist = np.zeros((2, n * q * m, n * q * m))
        for line, course in zip(self._lines, state.courses, strict=True):
            place = (line.pieces[:, None] * q * m + np.arange(q * m)).ravel()
            own, turn = self._curving(course, q, m)
            hessian[place[:, None], place] += own
            if line.loaded:
                moment = hat(state.factor * self._moment)
                twist[place[:, None], place] = -0.5 * turn @ moment @ turn.T
        # The bodies with strands of fixed tension, then the strands' stiffness.
        blocks, of = hessian.reshape(n * q, m, n * q, m), np.arange(n * q)
        blocks[of, :, of, :] += (self._weight[..., None, None] * state.bend).reshape(n * q, m, m)
        drawn = (self._weight[..., None] * state.drawn).reshape(len(self._laws), n * q * m)
        hessian += (drawn.T * state.stiffness) @ drawn
        return hessian, twist

    def _curving(self, course: Course, q: int, m: int) -> tuple[Array, Array]:
        """Minus the second derivative of the work on a line, and how its strains turn the tip."""
        pieces, n = course.pieces, len(course.before)
        # Points of two pieces, by the changes of G at the tip seen from the world.
        ahead = course.before[:, None] @ pieces.ahead
        behind = pieces.behind @ (course.after @ np.linalg.inv(course.tip))[:, None]
        move = (ahead[:, :, None] @ self._basis @ behind[:, :, None]).reshape(n * q * m, 5, 5)
        lever = np.swapaxes(move, 1, 2) @ (course.pull @ course.tip.T)
        across = -lever.reshape(-1, 25) @ move.reshape(-1, 25).T
        piece = np.repeat(np.arange(n), q * m)
        across *= piece[:, None] < piece
        hessian = across + across.T
        # Points of one piece.
        one = np.einsum("nqrij,ajk->nrqaik", self._ring(course), self._basis)
        two = np.einsum("nrqkl,bli->nrqbik", pieces.between, self._basis)
        within = one.reshape(n, q, q, m, 25) @ np.swapaxes(two.reshape(n, q, q, m, 25), -1, -2)
        within = within.swapaxes(2, 3).reshape(n, q * m, q * m)
        blocks, of = hessian.reshape(n, q * m, n, q * m), np.arange(n)
        blocks[of, :, of, :] -= within + np.swapaxes(within, 1, 2)
        for at, stiffness in course.stiff:
            moved = move[:, :3] @ (course.tip @ at)
            hessian += moved @ stiffness @ moved.T
        return hessian, np.stack([move[:, 2, 1], move[:, 0, 2], move[:, 1, 0]], axis=-1)

    def distance(self, change: Array) -> float:
        """Turn and stretch of the whole rod in a change of its strains."""
        return float(np.sum(self._weight * np.linalg.norm(change, axis=-1)))

    def shapes(self, state: State, points: int) -> tuple[RodShape, ...]:
        """One shape for each segment under the whole load, in SI units."""
        s = np.linspace(0.0, 1.0, points)
        return tuple(self._shape(state, index, s) for index in range(len(self._segments)))

    def _shape(self, state: State, index: int, s: Array) -> RodShape:
        segment, problem, owner = self._segments[index], self._problem, self.mesh.owner
        piece, place = self.mesh.inside(index, s)
        # From the start of its piece to each point.
        known = self._rule.node
        inner = self._full(lagrange(known, place[:, None] * known) @ state.strain[piece])
        strain = self._full(self.mesh.at(state.strain, index, s))
        strain[:, :3] /= self._size
        ways = zip(self._lines, state.courses, strict=True)
        through = [(line, course) for line, course in ways if index in line.segments]
        lever, masses = np.zeros(3), 0.0
        for line, course in through:
            mine = np.searchsorted(line.pieces, piece)
            part = Pieces.of(self._rule, place * self._span[piece], inner, line.density[mine])
            frame = course.before[mine] @ part.motion
            lever += (course.tip[:3, 4] - frame[0, :3, 4]) * self._force * self._size
            masses += float(course.tip[3, 4] - frame[0, 3, 4]) * self._force
        lengths = self._sections.lengths(
            self._sections.directions(self._full(state.strain).reshape(-1, 6))[0],
            np.where((owner == index)[:, None], self._weight, 0.0), len(self._laws) + 1,
        )  # fmt: skip
        gravity, last = np.asarray(problem.gravity), through[-1]
        force, moment = last[0].loaded * np.array([problem.tip_force, problem.tip_moment])
        moment = moment + np.cross(last[1].tip[:3, 3] * self._size, force)
        for line, course in through:
            for spring in line.springs:
                there = course.tip[:3] @ [*spring.end, self._size, 0.0]
                pulled = spring.pull(there - np.asarray(spring.start))
                force, moment = force + pulled, moment + np.cross(there, pulled)
        return RodShape(
            position=self._size * frame[:, :3, 3], rotation=frame[:, :3, :3].copy(),
            arc_length=segment.beam.length * s, strain=strain,
            tca_length=self._size * lengths[list(problem.strands[index])],
            base_force=0.0 - force - masses * gravity,
            base_moment=0.0 - moment - np.cross(lever, gravity),
        )  # fmt: skip

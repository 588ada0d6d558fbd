"""The best TCAs for a wish: a search over several aims at once, by the NSGA-II of pymoo."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np

from tca_mj.checks import Array, Seed, door, require_one_of, shown, whole
from tca_mj.hints import nearest
from tca_mj.tca.design.candidates import (
    BOUNDS,
    RARELY,
    Figures,
    Winding,
    designed,
    judged,
    tightest,
)
from tca_mj.tca.design.wish import Space, Wish
from tca_mj.tca.spec import TcaSpec

_Size = Annotated[int, partial(whole, at_least=8, at_most=1000)]
_Generations = Annotated[int, partial(whole, at_least=1, at_most=10_000)]
_UNREACHED = 1e9  # of an aim that is infinite; designs that break no limit have none


class NoDesign(ValueError):
    """Nothing that may be wound does what is wanted."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Design:
    """A TCA for the wish.

    Attributes:
        winding: How it is made.
        tca: What comes of that, at its natural length.
        figures: What it does under the load, single numbers.
    """

    winding: Winding
    tca: TcaSpec
    figures: Figures


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Designs:
    """Designs of which none is better in one aim without being worse in another.

    Attributes:
        wish: What they were searched for.
        space: Of what.
        aims: Names of figures, each the less the better.
        front: The designs, by the first aim.
        chosen: Index of the one nearest to the best of all aims, each over its range on the front.
        evaluated: How many were tried.
    """

    wish: Wish
    space: Space
    aims: tuple[str, ...]
    front: tuple[Design, ...]
    chosen: int
    evaluated: int

    @property
    def best(self) -> Design:
        """The chosen one."""
        return self.front[self.chosen]

    @door
    def values(self, name: str) -> Array:
        """One figure of all designs of the front, shape (n,).

        Args:
            name: One of ``Figures``.

        Raises:
            ValueError: If there is no such figure.
        """
        require_one_of("name", name, Figures._fields)
        return np.array([float(getattr(each.figures, name)) for each in self.front])

    @door
    def spread(self, count: Annotated[int, partial(whole, at_least=1)]) -> list[int]:
        """Indices of a few designs that lie apart, the chosen one first, the best of each aim next.

        Args:
            count: How many at most.
        """
        scaled = _scaled(np.array([self.values(name) for name in self.aims]).T)
        picked = [self.chosen, *(int(i) for i in scaled.argmin(axis=0))]
        picked = list(dict.fromkeys(picked))[:count]
        while len(picked) < min(count, len(self.front)):
            apart = np.linalg.norm(scaled[:, None] - scaled[picked], axis=-1).min(axis=1)
            picked.append(int(apart.argmax()))
        return picked


@door
def find_designs(
    wish: Wish,
    space: Space | None = None,
    *,
    aims: Sequence[str] = ("energy", "temperature", "length"),
    population: _Size = 120,
    generations: _Generations = 100,
    seed: Seed = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Designs:
    """TCAs that do what is wanted, as well as can be: a Pareto front.

    Args:
        wish: What is wanted.
        space: What there is; None for the published thread.
        aims: Two to four figures that ought to be small.
        population: Designs in a generation.
        generations: How many of these.
        seed: What is drawn comes from it alone.
        progress: Called after each generation with its number and that of designs that keep all
            limits.

    Raises:
        ValueError: If an aim is unknown.
        NoDesign: If nothing was found; the message says what nearly did.
        ImportError: If pymoo is not installed, extra ``design``.

    Example:
        >>> from tca_mj.tca.design import Wish, find_designs
        >>> wish = Wish(stroke=20e-3, load=0.3, time=5.0, voltage=6.0)
        >>> found = find_designs(wish, population=40, generations=15)
        >>> found.best.figures.time <= 5.0
        True
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem

    space = space or Space()
    aims = _aims(aims)
    names = list(space.threads)
    low, high = _ends(space)
    known: dict[bytes, None] = {}
    problem = Problem(n_var=len(low), n_obj=len(aims), n_ieq_constr=len(BOUNDS), xl=low, xu=high)
    algorithm = NSGA2(pop_size=population)
    algorithm.setup(problem, termination=("n_gen", generations), seed=seed, verbose=False)
    while algorithm.has_next():
        asked = algorithm.ask()
        rows = asked.get("X")
        known.update(dict.fromkeys(row.tobytes() for row in rows))
        _, found, broken = _tried(wish, space, names, rows)
        goals = np.array([getattr(found, name) for name in aims]).T
        goals = np.where(np.isfinite(goals), goals, _UNREACHED)
        Evaluator().eval(StaticProblem(problem, F=goals, G=broken.T), asked)
        algorithm.tell(infills=asked)
        if progress is not None:
            kept = (algorithm.pop.get("CV") <= 0.0).sum()
            progress(int(algorithm.n_gen) - 1, int(kept))
    rows = algorithm.pop.get("X")
    designs, found, broken = _tried(wish, space, names, rows)
    kept = np.flatnonzero((broken == 0.0).all(axis=0))
    if kept.size == 0:
        raise NoDesign(_missed(broken))
    goals = np.array([getattr(found, name) for name in aims]).T
    kept = kept[_undominated(goals[kept])]
    kept = kept[np.lexsort(goals[kept].T[::-1])]
    front = tuple(
        Design(winding=designs[i][0], tca=designs[i][1],
               figures=Figures(*(float(each[i]) for each in found)))  # type: ignore[arg-type]
        for i in kept
    )  # fmt: skip
    chosen = int(np.linalg.norm(_scaled(goals[kept]), axis=1).argmin())
    return Designs(
        wish=wish, space=space, aims=aims, front=front, chosen=chosen, evaluated=len(known)
    )


def _aims(aims: Sequence[str]) -> tuple[str, ...]:
    known = Figures._fields
    for name in aims:
        if name not in known:
            hint = nearest(name, known)
            raise ValueError(f"aims must be of {list(known)}, got {shown(name)}{hint}")
    if not 2 <= len(set(aims)) == len(aims) <= 4:
        raise ValueError(f"aims must be two to four different figures, got {list(aims)}")
    return tuple(aims)


def _ends(space: Space) -> tuple[Array, Array]:
    """Least and largest of what is searched: lengths by their logarithms, threads by number."""
    spans = np.array([
        [math.log(each) for each in space.core_diameter], list(space.groove_pitch_angle),
        [math.log(each) for each in space.fibre_length],
        [space.strands[0], space.strands[1] + 0.999], [0.0, len(space.threads) - 0.001],
    ])  # fmt: skip
    return spans[:, 0], spans[:, 1]


def _tried(
    wish: Wish, space: Space, names: Sequence[str], rows: Array
) -> tuple[list[tuple[Winding, TcaSpec]], Figures, Array]:
    """What a generation, (n, 5), comes to: designs, figures, and the limits that they break."""
    made, short = [], []
    for core, groove, fibre, strands, thread in rows.tolist():
        name, core = names[int(thread)], math.exp(core)
        least = tightest(space.threads[name], core)
        short.append(max(0.0, least - groove))
        winding = Winding(
            thread=name, core_diameter=core, groove_pitch_angle=max(groove, least),
            fibre_length=math.exp(fibre), strands=int(strands),
        )  # fmt: skip
        tca = designed(space.threads[name], winding, space.annealing_temperature)
        made.append((winding, tca))
    found, broken = judged(wish, space, [tca for _, tca in made], short)
    return made, found, broken


def _undominated(goals: Array) -> Any:
    """Which rows, (n, aims), no other row is at least as good as in all aims and better in one."""
    at_least = np.all(goals[:, None] >= goals, axis=-1)
    better = np.any(goals[:, None] > goals, axis=-1)
    _, first = np.unique(goals, axis=0, return_index=True)
    single = np.isin(np.arange(len(goals)), first)
    return ~np.any(at_least & better, axis=1) & single


def _scaled(goals: Array) -> Array:
    """Aims over their ranges, (n, aims): 0 for the best, 1 for the worst."""
    low, high = goals.min(axis=0), goals.max(axis=0)
    return (goals - low) / np.where(high > low, high - low, 1.0)


def _missed(broken: Array) -> str:
    """What stands in the way: the limits that the nearest design breaks."""
    nearest_one = broken[:, broken.sum(axis=0).argmin()]
    missed = [
        f"{words} by {100.0 * over:.3g} %" if over < RARELY else f"{words} altogether"
        for words, over in zip(BOUNDS.values(), nearest_one, strict=True)
        if over > 0.0
    ]
    return f"no TCA of this space keeps the wish; the nearest one misses: {', '.join(missed)}"

"""Models of a task that step in time, as plain numbers: linear in a lifted state, or a network.

What commands heat is *driven*: its rows follow the command by linear laws. The rest *follows*, at
once or nearly so, by a law that is not linear. Heat that has gone where no sensor is comes back
later: it is remembered by running means of the driven rows, which are linear in the state as well.
So the state is

    x = (driven d, its running means m, followed f)    m' = a m + (1 - a) d,  a = exp(-dt/τ)

and its lift is ψ(d), the products of 2 to ``degree`` driven numbers. The kinds of models:

* ``split``: d' = A (d, m, u, 1), and then f' = B (f, 1, d', ψ(d')). Two linear steps, one behind
  the other (Koopman operators split after Lie and Trotter), each in a state that it keeps closed.
* ``linear``: (d, f, ψ)' = A (x, ψ, u, 1), the lifted state as a whole (Koopman operator with
  control, by dynamic mode decomposition).
* ``bilinear``: the same with the products of u and (x, ψ).
* ``network``: (d, f)' - (d, f) = N(x, u), a perceptron.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations_with_replacement
from math import comb
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.model.data import opened, packed, period_of, rows_of
from tca_mj.agents.policies.archives import why
from tca_mj.checks import Array, Checked, Positive, door, require_one_of, shown, whole, within

KINDS = ("split", "linear", "bilinear", "network")
KIND, FORMAT = "model", 1
MOST = 2000  # numbers of a lifted state, whose matrices have millions then

Kind = Annotated[str, partial(require_one_of, choices=KINDS)]
Degree = Annotated[int, partial(whole, at_least=1, at_most=10)]


@dataclass(frozen=True, kw_only=True, eq=False)
class View(Checked):
    """What of a task a model sees, and how it is lifted.

    Attributes:
        made_for: The contract of the task, see ``tca_mj.agents.policies.contract``.
        driven: Rows of the observation that commands drive.
        followed: Rows that follow them.
        memories: Time constants of the running means of the driven rows [s].
        degree: Largest degree of the products of driven numbers; 1 for no lift.

    Raises:
        ValueError: If there is no such row, or the lifted state has more than 2000 numbers.
    """

    made_for: Mapping[str, Any]
    driven: tuple[str, ...]
    followed: tuple[str, ...] = ()
    memories: tuple[Positive, ...] = ()
    degree: Degree = 1

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        rows = rows_of(self.made_for, "observation")
        chosen = (*self.driven, *self.followed)
        if not self.driven or len(set(chosen)) != len(chosen) or not set(chosen) <= set(rows):
            raise ValueError(
                f"driven and followed must be different rows of {list(rows)}, got {shown(chosen)}"
            )
        within("control_period and size of action", [self.period, self.acts], above=0.0)
        size = self.sizes[0]
        numbers = comb(size + self.degree, self.degree) + sum(self.sizes[1:])
        if numbers > MOST:
            raise ValueError(
                f"degree must leave at most {MOST} numbers of a lifted state, got {self.degree}"
                f" with {size} driven ones, {numbers}"
            )

    @cached_property
    def _columns(self) -> Array:
        """Of each number that is seen its place, centre and scale, shape (3, n)."""
        found, start = {}, 0
        for name, (size, centre, scale) in rows_of(self.made_for, "observation").items():
            found[name] = [(start + i, centre, scale) for i in range(size)]
            start += size
        return np.array([c for n in (*self.driven, *self.followed) for c in found[n]]).T

    @cached_property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of a state: driven, remembered and followed."""
        rows = rows_of(self.made_for, "observation")
        driven, followed = (sum(rows[n][0] for n in ns) for ns in (self.driven, self.followed))
        return driven, driven * len(self.memories), followed

    @property
    def acts(self) -> int:
        """Numbers of an action."""
        return sum(row[0] for row in rows_of(self.made_for, "action").values())

    @property
    def period(self) -> float:
        """Time of a step [s]."""
        return period_of(self.made_for)

    @cached_property
    def kept(self) -> Array:
        """Share of the running means that a step leaves, one for each, shape (remembered,)."""
        return np.repeat(np.exp(-self.period / np.array(self.memories)), self.sizes[0])

    @cached_property
    def _repeated(self) -> NDArray[np.int64]:
        """Which driven number each running mean is of."""
        return np.tile(np.arange(self.sizes[0]), len(self.memories))

    @cached_property
    def _factors(self) -> list[tuple[int, ...]]:
        numbers = range(self.sizes[0])
        return [
            factors for degree in range(2, self.degree + 1)
            for factors in combinations_with_replacement(numbers, degree)
        ]  # fmt: skip

    @cached_property
    def _products(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Each product is a product that stands before it, or a number, times a number."""
        places: dict[tuple[int, ...], int] = {(i,): i for i in range(self.sizes[0])}
        places |= {factors: len(places) + i for i, factors in enumerate(self._factors)}
        pairs = [(places[factors[:-1]], factors[-1]) for factors in self._factors]
        first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        return first, second

    def lift(self, driven: Array) -> Array:
        """ψ, the products of driven numbers, shape (..., products)."""
        first, second = self._products
        found = np.empty((len(first) + self.sizes[0], *driven.shape[:-1]))
        found[: self.sizes[0]] = np.moveaxis(driven, -1, 0)
        start, before = 0, self.sizes[0]
        for degree in range(2, self.degree + 1):  # those of one degree at a time
            count = comb(self.sizes[0] + degree - 1, degree)
            here = slice(start, start + count)
            found[before : before + count] = found[first[here]] * found[second[here]]
            start, before = start + count, before + count
        return np.moveaxis(found[self.sizes[0] :], 0, -1)

    def scaled(self, seen: Array) -> Array:
        """The rows that it sees, driven and followed, of the order of 1, shape (..., n)."""
        place, centre, scale = self._columns
        return (seen[..., place.astype(int)] - centre) / scale

    def remember(self, driven: Array, means: Array) -> Array:
        """The running means after a step that began with these, shape (..., remembered)."""
        return self.kept * means + (1.0 - self.kept) * driven[..., self._repeated]

    def states(self, seen: Array) -> Array:
        """States of an episode.

        Args:
            seen: Its observations from the first one on, shape (steps, seen) [as the task].

        Returns:
            Shape (steps, n), scaled [1]. The means begin where the driven rows do.
        """
        rows, (size, _, _) = self.scaled(seen), self.sizes
        driven, means = rows[:, :size], [np.tile(rows[0, :size], len(self.memories))]
        for now in driven[:-1]:
            means.append(self.remember(now, means[-1]))
        return np.hstack([driven, np.array(means), rows[:, size:]])

    def read(self, states: Array) -> dict[str, Array]:
        """The rows of states, shape (..., n), by name, shape (..., size) [as the task]."""
        _, centre, scale = self._columns
        driven, remembered, followed = self.sizes
        held = [states[..., :driven], states[..., driven + remembered :][..., :followed]]
        rows, found, start = np.concatenate(held, axis=-1) * scale + centre, {}, 0
        for name in (*self.driven, *self.followed):
            size = self.made_for["observation"][name][0]
            found[name] = rows[..., start : start + size]
            start += size
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskModel(Checked):
    """A model of a task, see the module for the kinds.

    Attributes:
        view: What it sees of the task.
        kind: ``split``, ``linear``, ``bilinear`` or ``network``.
        weights: Its matrices, the last column of each for the number 1: of ``split`` those of the
            driven and of the followed numbers, of ``network`` one for each layer, tanh in between.

    Raises:
        ValueError: If a matrix has the wrong shape.
    """

    view: View
    kind: Kind
    weights: tuple[Array, ...]

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        view = self.view
        if not all(np.ndim(weight) == 2 for weight in self.weights):
            raise ValueError(f"weights must be matrices, got {shown(self.weights)}")
        driven, remembered, followed = view.sizes
        lifted = len(view._factors)
        state, acts = driven + remembered + followed, view.acts
        if self.kind == "split":
            shapes = [(driven, driven + remembered + acts + 1)]
            shapes += [(followed, followed + driven + lifted + 1)]
        elif self.kind == "network":
            widths = [state + acts, *(len(w) for w in self.weights[:-1]), driven + followed]
            shapes = [(out, into + 1) for into, out in zip(widths, widths[1:], strict=False)]
        else:
            wide = (state + lifted) * (1 + acts * (self.kind == "bilinear")) + acts + 1
            shapes = [(driven + followed + lifted, wide)]
        if len(shapes) != len(self.weights):
            raise ValueError(f"weights must be {len(shapes)} matrices, got {len(self.weights)}")
        for i, (weight, shape) in enumerate(zip(self.weights, shapes, strict=True)):
            within(f"weights[{i}]", weight, shape=shape)

    def begin(self, states: Array) -> Array:
        """What it steps, from states of its view, shape (..., n): lifted if that is kept."""
        if self.kind not in ("linear", "bilinear"):
            return states
        return np.concatenate([states, self.view.lift(states[..., : self.view.sizes[0]])], axis=-1)

    def advance(self, state: Array, command: Array, off: Array | None = None) -> Array:
        """The state after a step.

        Args:
            state: As ``begin`` gives it, shape (..., n) [1].
            command: The action, shape (..., acts) [1].
            off: What the robot does besides, of its driven and followed numbers, shape (seen,) [1].
        """
        return self.predict(state, command[..., None, :], off)[..., 0, :]

    def predict(self, state: Array, commands: Array, off: Array | None = None) -> Array:
        """The states after each of several steps.

        Args:
            state: The first one, as ``begin`` gives it, shape (..., n) [1].
            commands: The actions, shape (..., steps, acts) [1].
            off: As for ``advance``.

        Returns:
            Shape (..., steps, n); ``view.read`` has their rows.
        """
        driven, remembered, followed = self.view.sizes
        more = np.zeros(driven + followed) if off is None else off
        each = np.moveaxis(commands, -2, 0)
        if self.kind == "split":
            return self._split(state, each, more)
        found = []
        for command in each:
            here, apart = state[..., :driven], driven + remembered
            means = self.view.remember(here, state[..., driven:apart])
            if self.kind == "network":
                hidden = np.concatenate([state, command], axis=-1)
                for weight in self.weights[:-1]:
                    hidden = np.tanh(_affine(weight, hidden))
                now = np.concatenate([here, state[..., apart:]], axis=-1)
                now += _affine(self.weights[-1], hidden)
            else:
                now = _affine(self.weights[0], *regressors(self.kind, state, command))
            now[..., : more.size] += more
            state = np.concatenate([now[..., :driven], means, now[..., driven:]], axis=-1)
            found.append(state)
        return np.stack(found, axis=-2)

    def _split(self, state: Array, commands: Array, off: Array) -> Array:
        """First all steps of what is driven, then of what follows: its lift is made at once."""
        driven, remembered, _ = self.view.sizes
        apart = driven + remembered
        heat, body = self.weights
        before, follows, heated = state[..., :apart], state[..., apart:], []
        for command in commands:
            now = _affine(heat, before, command) + off[:driven]
            means = self.view.remember(before[..., :driven], before[..., driven:])
            before = np.concatenate([now, means], axis=-1)
            heated.append(before)
        rows = np.stack(heated)
        given = np.concatenate([rows[..., :driven], self.view.lift(rows[..., :driven])], axis=-1)
        own = follows.shape[-1]
        pushed = _affine(body[:, own:], given) + off[driven:]
        followed = []
        for push in pushed:
            follows = follows @ body[:, :own].T + push
            followed.append(follows)
        return np.moveaxis(np.concatenate([rows, np.stack(followed)], axis=-1), 0, -2)

    @door
    def save(self, path: str | Path) -> Path:
        """Writes the file, an ``.npz``, in one go."""
        view = self.view
        header = {"kind": KIND, "format": FORMAT, "model": self.kind, "view": {
            name: getattr(view, name)
            for name in ("made_for", "driven", "followed", "memories", "degree")
        }}  # fmt: skip
        named = {f"weight{i}": weight for i, weight in enumerate(self.weights)}
        return packed(path, header, named)

    @classmethod
    @door
    def read(cls, path: str | Path) -> TaskModel:
        """Reads a file.

        Raises:
            FileNotFoundError: If there is none.
            ValueError: If it is no model.
        """
        try:
            header, found = opened(path, KIND, FORMAT)
            for name in ("driven", "followed", "memories"):
                header["view"][name] = tuple(header["view"][name])
            weights = tuple(found[f"weight{i}"] for i in range(len(found)))
            return cls(view=View(**header["view"]), kind=header["model"], weights=weights)
        except FileNotFoundError:
            raise
        except Exception as error:
            raise ValueError(f"{path} is no model: {why(error)}") from error


def regressors(kind: str, lifted: Array, command: Array) -> tuple[Array, ...]:
    """What the next lifted state is linear in, but for the number 1."""
    if kind == "linear":
        return lifted, command
    products = command[..., :, None] * lifted[..., None, :]
    return lifted, command, products.reshape(*products.shape[:-2], -1)


def _affine(weight: Array, *parts: Array) -> Array:
    """W (parts, 1), shape (..., rows of W)."""
    return np.concatenate(parts, axis=-1) @ weight[:, :-1].T + weight[:, -1]

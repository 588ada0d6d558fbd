"""A learned network as plain numbers: from an observation to an action, by NumPy alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import (
    Checked,
    NotNegative,
    Numbers,
    Positive,
    door,
    require_one_of,
    shown,
    within,
)
from tca_mj.envs.table import Mirror

Floats: TypeAlias = NDArray[np.float32]


def _floats32(name: str, value: Any) -> Floats:
    return within(name, value).astype(np.float32)


Singles = Annotated[Floats, _floats32]

ACTIVATIONS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "tanh": np.tanh,
    "relu": lambda h: np.maximum(h, 0.0),
    "elu": lambda h: np.where(h > 0.0, h, np.expm1(np.minimum(h, 0.0))),
    "leaky_relu": lambda h: np.where(h > 0.0, h, 0.01 * h),
    "silu": lambda h: 0.5 * h * (1.0 + np.tanh(0.5 * h)),  # h/(1 + exp(-h)) without overflow
}
SQUASHES = ("clip", "tanh")


@dataclass(frozen=True, kw_only=True, slots=True)
class Network(Checked):
    """A multi-layer perceptron behind a normalisation, without noise.

    The observation x, in ``units`` where there are any, becomes
    clip((x - mean)/sqrt(var + epsilon), ±clip), passes through the layers W h + b with the
    activation between them, is kept within ±limit, and is squashed to what lies within ``bounds``.
    What the layers see is float32, as when they learned; they are computed in float64, where it
    makes no difference in which order a library adds up.

    Attributes:
        weights: One matrix per layer, shape (out, in), float32.
        biases: One row per layer, shape (out,), float32.
        mean: Of each number of the observation, shape (in,), float64 [their units].
        var: Variance of each, shape (in,), float64 [their units squared].
        clip: Largest size of a normalised number [1]; None for no limit.
        epsilon: Added to the variance [as ``var``].
        activation: One of ``ACTIVATIONS``.
        squash: ``clip`` (what is out of bounds is cut off) or ``tanh`` (its -1 and 1 are the
            bounds).
        limit: Largest size of what is squashed [1]; None for no limit.
        units: Centre and scale by which each number of the observation is taken first, in float32,
            shape (2, in) [their units]; None for the observation as it is.
        bounds: Least and most of each number of an action, shape (2, out), float32 [1]; None for
            -1 and 1.

    Raises:
        ValueError: If shapes do not fit, numbers are not finite or a name is unknown.
    """

    weights: tuple[Singles, ...]
    biases: tuple[Singles, ...]
    mean: Numbers
    var: Numbers
    clip: Positive | None = 10.0
    epsilon: NotNegative = 1e-8
    activation: Annotated[str, partial(require_one_of, choices=tuple(ACTIVATIONS))] = "tanh"
    squash: Annotated[str, partial(require_one_of, choices=SQUASHES)] = "clip"
    limit: Positive | None = None
    units: Singles | None = None
    bounds: Singles | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if not self.weights or len(self.weights) != len(self.biases):
            raise ValueError(
                f"biases must be as many as weights and at least 1, got {len(self.biases)}"
                f" for {len(self.weights)}"
            )
        width = np.shape(self.mean)
        if len(width) != 1 or np.shape(self.var) != width:
            raise ValueError(f"var must be a row like mean {width}, got {np.shape(self.var)}")
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            if weight.ndim != 2 or weight.shape != (*bias.shape, *width):
                raise ValueError(
                    f"weights[{i}] must have the shape {(*bias.shape, *width)}, got {weight.shape}"
                )
            width = bias.shape
        within("var + epsilon", within("var", self.var, at_least=0.0) + self.epsilon, above=0.0)
        if self.units is not None:
            within("units", self.units, shape=(2, self.inputs))
            within("units[1]", self.units[1], above=0.0)
        if self.bounds is not None:
            low, high = within("bounds", self.bounds, shape=(2, self.outputs))
            within("bounds[1] - bounds[0]", high - low, above=0.0)

    @property
    def inputs(self) -> int:
        """Length of an observation."""
        return len(self.mean)

    @property
    def outputs(self) -> int:
        """Length of an action."""
        return len(self.biases[-1])

    def __call__(self, observation: NDArray[np.floating]) -> Floats:
        """Action within the bounds, shape (outputs,), to an observation of shape (inputs,)."""
        seen: NDArray[Any] = observation
        if self.units is not None:
            seen = ((observation - self.units[0]) / self.units[1]).astype(np.float32)
        seen = (seen - self.mean) / np.sqrt(self.var + self.epsilon)
        if self.clip is not None:
            seen = np.clip(seen, -self.clip, self.clip)
        hidden = seen.astype(np.float32).astype(np.float64)
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            hidden = weight @ hidden + bias
            if i + 1 < len(self.weights):
                hidden = ACTIVATIONS[self.activation](hidden)
        if self.limit is not None:
            hidden = np.clip(hidden, -self.limit, self.limit)
        low, high = (-1.0, 1.0) if self.bounds is None else self.bounds.astype(np.float64)
        if self.squash == "tanh":
            hidden = low + 0.5 * (np.tanh(hidden) + 1.0) * (high - low)
        return np.clip(hidden, low, high).astype(np.float32)

    @door
    def alike(self, observation: Mirror, action: Mirror) -> Network:
        """A network that in a mirror does what is seen of it there: right as left, left as right.

        What it asks for before that is squashed is the mean of what this one asks for and of the
        image of what this one asks for in the mirror. It is twice as wide.

        Args:
            observation: The mirror of what it sees, ``Table.mirror``.
            action: That of what it does.

        Raises:
            ValueError: If a mirror has another length, or normalisation, units or bounds are not
                their own image in it.
        """
        (source, sign), (place, side) = observation, action
        for name, size, row in (("observation", self.inputs, source),
                                ("action", self.outputs, place)):  # fmt: skip
            if len(row) != size:
                raise ValueError(f"{name} must mirror {size} numbers, got {len(row)}")
        images: dict[str, tuple[Any, Any]] = {
            "mean": (self.mean, self.mean[source] * sign), "var": (self.var, self.var[source]),
        }  # fmt: skip
        if self.units is not None:
            centre, scale = self.units
            images["units"] = self.units, np.array([centre[source] * sign, scale[source]])
        if self.bounds is not None:
            low, high = self.bounds[:, place]
            ends = np.where(side > 0.0, low, -high), np.where(side > 0.0, high, -low)
            images["bounds"] = self.bounds, np.array(ends)
        for name, (own, image) in images.items():
            if not np.array_equal(own, image):
                raise ValueError(f"{name} must be the same in the mirror, got {shown(own)}")
        first, last = self.weights[0], self.weights[-1]
        seen = np.empty_like(first)
        seen[:, source] = first * sign
        if len(self.weights) == 1:
            weights: list[Any] = [0.5 * (first + seen[place] * side[:, None])]
        else:
            weights = [
                np.concatenate((first, seen)),
                *(np.kron(np.eye(2, dtype=np.float32), weight) for weight in self.weights[1:-1]),
                0.5 * np.concatenate((last, last[place] * side[:, None]), axis=1),
            ]  # fmt: skip
        end = self.biases[-1]
        biases: list[Any] = [np.tile(bias, 2) for bias in self.biases[:-1]]
        biases.append(0.5 * (end + end[place] * side))
        return replace(self, weights=tuple(weights), biases=tuple(biases))

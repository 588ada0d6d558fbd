"""A learned network as plain numbers: from an observation to an action, by NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tca_mj.checks import Checked, Positive, within

ACTIVATIONS = ("tanh", "relu")
SQUASHES = ("clip", "tanh")


@dataclass(frozen=True, kw_only=True, slots=True)
class Network(Checked):
    """A multi-layer perceptron behind a normalisation, without noise.

    The observation x becomes clip((x - mean)/sqrt(var + epsilon), ±clip), passes through the
    layers W h + b with the activation between them, and is squashed into -1 to 1.

    Attributes:
        weights: One matrix per layer, shape (out, in), float32.
        biases: One row per layer, shape (out,), float32.
        mean: Of each number of the observation, shape (in,), float64 [their units].
        var: Variance of each, shape (in,), float64 [their units squared].
        clip: Largest size of a normalised number [1].
        epsilon: Added to the variance [as ``var``].
        activation: ``tanh`` or ``relu``.
        squash: ``clip`` (what is beyond ±1 is cut off) or ``tanh``.

    Raises:
        ValueError: If shapes do not fit, numbers are not finite or a name is unknown.
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]
    mean: NDArray[np.float64]
    var: NDArray[np.float64]
    clip: Positive = 10.0
    epsilon: Positive = 1e-8
    activation: str = "tanh"
    squash: str = "clip"

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        for name, known in (("activation", ACTIVATIONS), ("squash", SQUASHES)):
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {known}, got {getattr(self, name)!r}")
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
        for array in (*self.weights, *self.biases):
            within("weights and biases", array)
        within("mean", self.mean)
        within("var", self.var, at_least=0.0)

    @property
    def inputs(self) -> int:
        """Length of an observation."""
        return len(self.mean)

    @property
    def outputs(self) -> int:
        """Length of an action."""
        return len(self.biases[-1])

    def __call__(self, observation: NDArray[np.floating]) -> NDArray[np.float32]:
        """Action between -1 and 1, shape (outputs,), to an observation of shape (inputs,)."""
        scaled = (observation - self.mean) / np.sqrt(self.var + self.epsilon)
        hidden: NDArray[np.float32] = np.clip(scaled, -self.clip, self.clip).astype(np.float32)
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            hidden = weight @ hidden + bias
            if i + 1 < len(self.weights):
                hidden = np.tanh(hidden) if self.activation == "tanh" else np.maximum(hidden, 0.0)
        return np.tanh(hidden) if self.squash == "tanh" else np.clip(hidden, -1.0, 1.0)

"""Fits models of a task to a data set, and says how far their predictions are off."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated, Any

import numpy as np

from tca_mj.agents.model.data import Transitions
from tca_mj.agents.model.dynamics import Kind, TaskModel, View, regressors
from tca_mj.checks import Array, Count, NotNegative, Positive, Seed, door, shown, whole

Width = Annotated[int, partial(whole, at_least=1, at_most=4096)]

_BATCH = 512  # of what a network learns from at once: estimate


@door
def fit_model(data: Transitions, view: View, kind: Kind = "split", *, ridge: NotNegative = 1e-10,
              hidden: tuple[Width, ...] = (64, 64), epochs: Count = 60, rate: Positive = 3e-3,
              seed: Seed = 0) -> TaskModel:  # fmt: skip
    """Fits a model: ``network`` by gradients, with torch, the others by least squares, exactly.

    Args:
        data: Steps of the task.
        view: What the model sees, and how it is lifted.
        kind: One of ``split``, ``linear``, ``bilinear`` and ``network``.
        ridge: Added to the mean squares of the regressors, against those that say the same [1].
        hidden: Widths of a network's layers.
        epochs: How often a network sees the data.
        rate: Its first rate of learning, which falls to 0 along a cosine [1].
        seed: Seed of a network's weights and of the order of the data.

    Raises:
        ValueError: If the view is of another task than the data.
        ImportError: If torch is not installed, for a network.
    """
    require_same(data, view)
    driven, remembered, _ = view.sizes
    befores, afters, commands = [], [], []
    for seen, done in data.episodes():
        states = view.states(seen)
        befores.append(states[:-1])
        afters.append(states[1:])
        commands.append(done)
    before, after, command = (np.concatenate(rows) for rows in (befores, afters, commands))
    moved, apart = after[:, :driven], driven + remembered
    if kind == "network":
        change = np.hstack([after[:, :driven] - before[:, :driven],
                            after[:, apart:] - before[:, apart:]])  # fmt: skip
        weights = _perceptron(np.hstack([before, command]), change, hidden, epochs, rate, seed)
    elif kind == "split":
        weights = (
            _least_squares([before[:, :apart], command], moved, ridge),
            _least_squares([before[:, apart:], moved, view.lift(moved)], after[:, apart:], ridge),
        )
    else:
        lifted, then = (np.hstack([x, view.lift(x[:, :driven])]) for x in (before, after))
        target = np.hstack([moved, then[:, apart:]])
        weights = (_least_squares(regressors(kind, lifted, command), target, ridge),)
    return TaskModel(view=view, kind=kind, weights=weights)


def require_same(data: Transitions, view: View) -> None:
    """Refuses a view of a task that is not the one of the data."""
    for part in ("observation", "action", "timing"):
        if view.made_for.get(part) != data.made_for.get(part):
            raise ValueError(
                f"view must be of the task of the data, got another {part}:"
                f" {shown(view.made_for.get(part))}"
            )


def _least_squares(parts: Sequence[Array], target: Array, ridge: float) -> Array:
    """W of target = W (parts, 1), the last column not held down by the ridge."""
    rows = np.hstack([*parts, np.ones((len(target), 1))])
    held = np.full(rows.shape[1], math.sqrt(ridge * len(rows)))
    held[-1] = 0.0
    stacked = np.vstack([rows, np.diag(held)])
    aim = np.vstack([target, np.zeros((len(held), target.shape[1]))])
    # By QR first: the factor says the same in as many rows as there are columns.
    joint: Any = np.linalg.qr(np.hstack([stacked, aim]), mode="r")
    width = rows.shape[1]
    return np.linalg.lstsq(joint[:width, :width], joint[:width, width:], rcond=None)[0].T


def _perceptron(seen: Array, target: Array, hidden: Sequence[int], epochs: int, rate: float,
                seed: int) -> tuple[Array, ...]:  # fmt: skip
    """Layers W (h, 1) with tanh in between, learned from normalised numbers and told of plain."""
    import torch

    centre, spread = seen.mean(axis=0), seen.std(axis=0) + 1e-9
    size = target.std(axis=0) + 1e-9
    draw = np.random.default_rng(seed)
    widths = [seen.shape[1], *hidden, target.shape[1]]
    layers = [
        [torch.tensor(draw.normal(0.0, 1.0 / math.sqrt(into), (out, into)), dtype=torch.float32),
         torch.zeros(out)]
        for into, out in zip(widths, widths[1:], strict=False)
    ]  # fmt: skip
    figures = [figure.requires_grad_() for layer in layers for figure in layer]
    inputs, outputs = (torch.tensor(rows, dtype=torch.float32)
                       for rows in ((seen - centre) / spread, target / size))  # fmt: skip
    optimiser = torch.optim.Adam(figures, lr=rate)
    count = epochs * math.ceil(len(seen) / _BATCH)
    falling = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, count)
    for _ in range(epochs):
        order = torch.tensor(draw.permutation(len(seen)))
        for part in order.split(_BATCH):
            guess = inputs[part]
            for i, (weight, bias) in enumerate(layers):
                guess = guess @ weight.T + bias
                guess = torch.tanh(guess) if i + 1 < len(layers) else guess
            loss = torch.nn.functional.mse_loss(guess, outputs[part])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            falling.step()
    plain: list[Any] = [
        [figure.detach().numpy().astype(float) for figure in layer] for layer in layers
    ]
    plain[0] = [plain[0][0] / spread, plain[0][1] - plain[0][0] @ (centre / spread)]
    plain[-1] = [plain[-1][0] * size[:, None], plain[-1][1] * size]
    return tuple(np.column_stack(layer) for layer in plain)


@door
def prediction_errors(
    model: TaskModel, data: Transitions, steps: Count, output: Callable[[dict[str, Array]], Array],
    *, every: Count = 10,
) -> Array:  # fmt: skip
    """By how much predictions are off that know the commands and nothing else that comes.

    Args:
        model: The model.
        data: Steps of its task, others than it was fitted to.
        steps: How far ahead.
        output: From rows by name, shape (..., size), to what is compared, shape (..., n).
        every: Steps between two predictions; what has happened before in the episode is known.

    Returns:
        Predicted minus true output at the end, shape (predictions, n) [as ``output``].

    Raises:
        ValueError: If the data are of another task, or have no episode as long as that.
    """
    require_same(data, model.view)
    starts, commands, ends = [], [], []
    for seen, done in data.episodes():
        states = model.view.states(seen)
        for k in range(0, len(done) - steps + 1, every):
            starts.append(states[k])
            commands.append(done[k : k + steps])
            ends.append(states[k + steps])
    if not starts:
        raise ValueError(f"data must have an episode of {steps} steps, got {data.length.max()}")
    state = model.begin(np.array(starts))
    for command in np.moveaxis(np.array(commands), 1, 0):
        state = model.advance(state, command)
    read = model.view.read
    own = sum(model.view.sizes)
    return output(read(state[:, :own])) - output(read(np.array(ends)))

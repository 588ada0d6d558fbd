"""Learning from a script: half of each batch is what it did with success, and is imitated.

After Oh et al. (Self-Imitation Learning, 2018), Nair et al. (Overcoming exploration with
demonstrations, 2018), from where the filter by the critic is, and Ball et al. (Efficient online
reinforcement learning with offline data, 2023), from where the halves and the normalised critics
are.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.torch_layers import create_mlp
from stable_baselines3.common.type_aliases import ReplayBufferSamples

_LAST_IMITATION = 0.02  # share of its weight that is left at the end, an estimate
_AVERAGING = 1e-4  # share by which the mean follows the actor, with each update; an estimate
_FIRST_SPREAD = -3.0  # logarithm of the standard deviation of the first actions, an estimate


class Shelf:
    """Rows of numbers, of which the oldest give way to new ones.

    Attributes:
        rows: The rows.
        size: How many of them are there.
    """

    def __init__(self, room: int, width: int) -> None:
        self.rows = np.zeros((room, width), np.float32)
        self.size = self._next = 0

    def add(self, row: NDArray[np.float32]) -> None:
        """Keeps a row."""
        self.rows[self._next] = row
        self._next = (self._next + 1) % len(self.rows)
        self.size = min(self.size + 1, len(self.rows))

    def drawn(self, count: int) -> NDArray[np.float32]:
        """Rows by chance, shape (count, width); there has to be one."""
        return self.rows[np.random.randint(self.size, size=count)]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"rows": (len(self.rows), self.rows[: self.size])}

    def __setstate__(self, state: dict[str, Any]) -> None:
        room, rows = state["rows"]
        self.__dict__ |= state | {"rows": np.zeros((room, rows.shape[1]), np.float32)}
        self.rows[: self.size] = rows


class SuccessReplayBuffer(ReplayBuffer):
    """A replay buffer whose batches are, in their first half, from episodes that were shown.

    Those are a script's that succeeded. What the learner does is in the other half only, with
    success or without: its lucky episodes alone would say that haste is safe.

    An episode is remembered when it is over. A memory tells what its action and the next
    ``n_steps`` - 1 have earned, and what was seen then.

    Attributes:
        showing: Whether what is added is the script's.
        lived: All memories. A row is an observation, an action, the observation after ``n_steps``,
            whether the episode has ended by then, what was earned and the discount of what comes.
        shown: Those of the script's episodes with success.
    """

    def __init__(
        self, buffer_size: int, observation_space: Any, action_space: Any, device: Any = "auto",
        n_envs: int = 1, *, n_steps: int = 1, gamma: float = 0.99, **kwargs: Any,
    ) -> None:  # fmt: skip
        """Takes the arguments of ``ReplayBuffer``, and those of its ``NStepReplayBuffer``.

        Args:
            buffer_size: Memories of each kind.
            observation_space: What is seen.
            action_space: What is done.
            device: Where batches go.
            n_envs: Environments that are stepped together.
            n_steps: Steps whose rewards a memory adds up.
            gamma: Discount per step [1].
            **kwargs: As for ``ReplayBuffer``.
        """
        super().__init__(1, observation_space, action_space, device, 1, **kwargs)
        self.n_steps, self.gamma = n_steps, gamma
        seen, done = int(np.prod(self.obs_shape)), self.action_dim
        self._edges = np.cumsum([seen, done, seen, 1, 1])
        width = int(self._edges[-1]) + 1
        self.lived, self.shown = Shelf(buffer_size, width), Shelf(buffer_size, width)
        self.showing = False
        self._paths: list[list[tuple[Any, ...]]] = [[] for _ in range(n_envs)]

    def begin(self, *, showing: bool = False) -> None:
        """All environments begin anew, with a script or without: what was not over is forgotten."""
        self.showing, self._paths = showing, [[] for _ in self._paths]

    def add(self, obs: Any, next_obs: Any, action: Any, reward: Any, done: Any, infos: Any) -> None:
        """Takes a step of every environment."""
        for i, (path, info) in enumerate(zip(self._paths, infos, strict=True)):
            ended = bool(done[i]) and not info.get("TimeLimit.truncated", False)
            path.append((obs[i].copy(), action[i].copy(), next_obs[i].copy(), ended, reward[i]))
            if done[i]:
                for row in self._told(path):
                    self.lived.add(row)
                    if self.showing and info.get("success", False):
                        self.shown.add(row)
                self._paths[i] = []

    def _told(self, path: list[tuple[Any, ...]]) -> list[NDArray[np.float32]]:
        """The memories of an episode."""
        rows = []
        for k, (seen, action, *_) in enumerate(path):
            steps = path[k : k + self.n_steps]
            *_, after, ended, _ = steps[-1]
            earned = sum(self.gamma**n * float(step[-1]) for n, step in enumerate(steps))
            last = [float(ended), earned, self.gamma ** len(steps)]
            rows.append(np.concatenate([seen, action, after, last]).astype(np.float32))
        return rows

    def size(self) -> int:
        """How many memories there are."""
        return self.lived.size

    def sample(self, batch_size: int, env: Any = None) -> ReplayBufferSamples:
        """A batch; if nothing was shown it is of all memories."""
        half = batch_size // 2 if self.shown.size else 0
        drawn = [self.shown.drawn(half)] if half else []
        return self.parts(np.concatenate([*drawn, self.lived.drawn(batch_size - half)]))

    def parts(self, rows: NDArray[np.float32]) -> ReplayBufferSamples:
        """Rows of memories as a batch."""
        parts = np.split(rows, self._edges, axis=1)
        return ReplayBufferSamples(*(self.to_torch(np.ascontiguousarray(part)) for part in parts))


class ImitatingSAC(SAC):
    """SAC that does, too, what it was shown: less and less.

    The layers of its critics are normalised, which lets them learn more often from a memory, and
    its first actions vary little. It remembers in a ``SuccessReplayBuffer``. What it is good for is
    the mean of what its actor was lately, which fails far less often than the actor of any moment.

    Attributes:
        averaged: That mean, the actor's tensors by name; empty before anything is learned.
        imitation: Weight of the squared distance from actions that were shown, in units of the
            reward, at the beginning [1].
    """

    imitation: float = 0.0
    averaged: dict[str, torch.Tensor]

    def _setup_model(self) -> None:
        super()._setup_model()
        self.averaged = {}
        for critic in (self.critic, self.critic_target):
            widths: Any = self.policy.net_arch
            for i, network in enumerate(critic.q_networks):
                first: Any = next(iter(network.children()))
                layers = create_mlp(
                    first.in_features, 1, list(widths), post_linear_modules=[torch.nn.LayerNorm]
                )
                critic.q_networks[i] = torch.nn.Sequential(*layers).to(self.device)
                setattr(critic, f"qf{i}", critic.q_networks[i])
        self.critic_target.load_state_dict(self.critic.state_dict())
        self.critic.optimizer = torch.optim.Adam(self.critic.parameters(), self.lr_schedule(1))
        spread: Any = self.actor.log_std
        with torch.no_grad():
            spread.weight.mul_(0.01)
            spread.bias.fill_(_FIRST_SPREAD)

    def warm_up(self, steps: int) -> None:
        """Learns from what is remembered to act likewise, and then what that is worth."""
        batch_size: int = self.batch_size
        for _ in range(steps):
            self._imitate(batch_size // 2)
        learned = {name: row.clone() for name, row in self.actor.state_dict().items()}
        for _ in range(steps):
            super().train(1, batch_size)
            self.actor.load_state_dict(learned)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Learns from batches of memories, and imitates as many."""
        for _ in range(gradient_steps):
            super().train(1, batch_size)
            self._imitate(batch_size // 2)
            now = self.actor.state_dict()
            if not self.averaged:
                self.averaged = {name: row.clone() for name, row in now.items()}
            for name, row in self.averaged.items():
                row.lerp_(now[name], _AVERAGING)

    @contextmanager
    def at_its_mean(self) -> Iterator[None]:
        """Meanwhile the actor is its mean."""
        now = {name: row.clone() for name, row in self.actor.state_dict().items()}
        self.actor.load_state_dict(self.averaged or now)
        try:
            yield
        finally:
            self.actor.load_state_dict(now)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "averaged"]

    def _imitate(self, count: int) -> None:
        memory: Any = self.replay_buffer
        weight = self.imitation * max(self._current_progress_remaining, _LAST_IMITATION)
        if not (weight and memory.shown.size):
            return
        batch = memory.parts(memory.shown.drawn(count))
        own = self.actor(batch.observations, deterministic=True)
        loss = weight * ((own - batch.actions) ** 2).sum(dim=1).mean()
        self.actor.optimizer.zero_grad()
        loss.backward()
        self.actor.optimizer.step()

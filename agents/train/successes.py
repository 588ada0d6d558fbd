"""Learning from a script: half of each batch is what it did with success, and is imitated.

After Oh et al. (Self-Imitation Learning, 2018), Nair et al. (Overcoming exploration with
demonstrations, 2018), from where the filter by the critic is, and Ball et al. (Efficient online
reinforcement learning with offline data, 2023), from where the halves and the normalised critics
are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.policies import ContinuousCritic
from stable_baselines3.common.torch_layers import create_mlp
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from stable_baselines3.common.utils import polyak_update

_LATELY, _SAFE = 20, 0.85  # episodes, and the share of them that is safe; estimates
_AVERAGING = 2e-4  # share by which the mean follows the actor, with each update; an estimate
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

    def close(self) -> None:
        """Leaves no room but for the rows that are there."""
        if self.size < len(self.rows):
            self.rows, self._next = self.rows[: self.size].copy(), 0

    def drawn(self, count: int) -> NDArray[np.float32]:
        """Rows by chance, shape (count, width); there has to be one."""
        return self.rows[np.random.randint(self.size, size=count)]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"rows": (len(self.rows), self.rows[: self.size])}

    def __setstate__(self, state: dict[str, Any]) -> None:
        room, rows = state["rows"]
        self.__dict__ |= state | {"rows": np.zeros((room, rows.shape[1]), np.float32)}
        self.rows[: self.size] = rows


class Examples:
    """What is imitated of one kind of episode: a script's successes, then better ones.

    Attributes:
        shelf: Their memories.
        lengths: Steps that each of these episodes took.
        lately: Whether each of the learner's last episodes of this kind succeeded.
    """

    def __init__(self, room: int, width: int) -> None:
        self.shelf = Shelf(room, width)
        self.lengths: list[int] = []
        self.lately: list[bool] = []

    def show(self, rows: list[NDArray[np.float32]]) -> None:
        """Keeps an episode of the script."""
        self.lengths.append(len(rows))
        for row in rows:
            self.shelf.add(row)

    def offer(self, rows: list[NDArray[np.float32]], success: bool) -> bool:
        """Judges an episode of the learner, and keeps it in the oldest one's place if it is better.

        It is if it succeeded in less time than half of the examples, and nearly all that was done
        lately succeeded: a lucky episode alone would say that haste is safe.
        """
        self.lately = [*self.lately, success][-_LATELY:]
        safe = len(self.lately) == _LATELY and np.mean(self.lately) >= _SAFE
        better = bool(success and safe and self.lengths and len(rows) < np.median(self.lengths))
        if better:
            self.shelf.close()
            self.lengths = [*self.lengths[1:], len(rows)]
            for row in rows:
                self.shelf.add(row)
        return better


class SuccessReplayBuffer(ReplayBuffer):
    """A replay buffer whose batches are, in their first half, from episodes that were shown.

    Those are a script's that succeeded, and in their place, by and by, the learner's that were
    better, see ``Examples``. All else that the learner does is in the other half only.

    An episode is remembered when it is over. A memory tells what its action and the next
    ``n_steps`` - 1 have earned, and what was seen then.

    Attributes:
        showing: Whether what is added is the script's.
        kind: What in a task's info tells kinds of episodes apart; "" for nothing.
        lived: All memories. A row is an observation, an action, the observation after ``n_steps``,
            whether the episode has ended by then, what was earned and the discount of what comes.
        examples: What is imitated, by kind.
        steady: Whether the learner's are examples only where it acts without noise.
    """

    def __init__(
        self, buffer_size: int, observation_space: Any, action_space: Any, device: Any = "auto",
        n_envs: int = 1, *, n_steps: int = 1, gamma: float = 0.99, kind: str = "",
        steady: bool = False, **kwargs: Any,
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
            kind: What in a task's info tells kinds of episodes apart; "" for nothing.
            steady: As ``OffPolicy.steady``.
            **kwargs: As for ``ReplayBuffer``.
        """
        super().__init__(1, observation_space, action_space, device, 1, **kwargs)
        self.n_steps, self.gamma = n_steps, gamma
        seen, done = int(np.prod(self.obs_shape)), self.action_dim
        self._edges = np.cumsum([seen, done, seen, 1, 1])
        width = int(self._edges[-1]) + 1
        self.lived = Shelf(buffer_size, width)
        self._room, self._width = buffer_size, width
        self.showing, self.kind, self.steady = False, kind, steady
        self.examples: dict[str, Examples] = {}
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
                self._remember(self._told(path), info, not self.steady or calm(i))
                self._paths[i] = []

    def _remember(
        self, rows: list[NDArray[np.float32]], info: dict[str, Any], offered: bool
    ) -> None:
        """Keeps an episode, also as an example if it is one."""
        for row in rows:
            self.lived.add(row)
        success, kind = bool(info.get("success", False)), str(info.get(self.kind, ""))
        if kind not in self.examples:
            self.examples[kind] = Examples(self._room, self._width)
        if self.showing and success:
            self.examples[kind].show(rows)
        elif offered and not self.showing:
            self.examples[kind].offer(rows, success)

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
        half = batch_size // 2 if self.shown else 0
        return self.parts(np.concatenate([self.drawn(half), self.lived.drawn(batch_size - half)]))

    @property
    def shown(self) -> int:
        """How many memories are examples."""
        return sum(each.shelf.size for each in self.examples.values())

    def drawn(self, count: int) -> NDArray[np.float32]:
        """Memories of examples by chance, shape (count, width)."""
        shelves = [each.shelf for each in self.examples.values() if each.shelf.size]
        if not (count and shelves):
            return np.zeros((0, self._width), np.float32)
        shares = np.array([shelf.size for shelf in shelves]) / self.shown
        counts = np.random.multinomial(count, shares).tolist()
        return np.concatenate([s.drawn(n) for s, n in zip(shelves, counts, strict=True)])

    def parts(self, rows: NDArray[np.float32]) -> ReplayBufferSamples:
        """Rows of memories as a batch."""
        parts = np.split(rows, self._edges, axis=1)
        return ReplayBufferSamples(*(self.to_torch(np.ascontiguousarray(part)) for part in parts))


def calm(i: int) -> bool:
    """Whether a steady learner acts without noise in an environment: in every second one."""
    return i % 2 == 1


def worth_of(
    critic: ContinuousCritic, seen: torch.Tensor, actions: torch.Tensor,
    which: Iterable[int] | None = None,
) -> torch.Tensor:  # fmt: skip
    """What critics, or some of them, say that actions are worth, shape (n, critics)."""
    given = torch.cat([seen, actions], dim=1)
    chosen = range(critic.n_critics) if which is None else which
    return torch.cat([critic.q_networks[i](given) for i in chosen], dim=1)


class ImitatingSAC(SAC):
    """SAC that does, too, what it was shown: less and less.

    The layers of its critics are normalised, which lets them learn more often from a memory. What
    comes is worth what the lesser says of two of them by chance (Chen et al., Randomized ensembled
    double Q-learning, 2021); in what to do the least of all counts. Its first actions vary little.
    It remembers in a ``SuccessReplayBuffer``. What it is good for is the mean of what its actor was
    lately, which fails far less often than the actor of any moment.

    Attributes:
        averaged: That mean, the actor's tensors by name; empty before anything is learned.
        imitation: Weight of the squared distance from actions that were shown, in units of the
            reward, at the beginning [1].
        last_imitation: Share of it that is left at the end [1].
        steady: Whether it acts without noise in every second environment, as its mean.
    """

    imitation: float = 0.0
    last_imitation: float = 0.02
    steady: bool = False
    averaged: dict[str, torch.Tensor]
    replay_buffer: SuccessReplayBuffer

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
        for each in (self.actor, self.critic):
            rate = self.lr_schedule(1)
            each.optimizer = torch.optim.Adam(each.parameters(), rate, fused=True)
        spread: Any = self.actor.log_std
        with torch.no_grad():
            spread.weight.mul_(0.01)
            spread.bias.fill_(_FIRST_SPREAD)

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """What is done next, also as it is remembered."""
        action, told = super()._sample_action(learning_starts, action_noise, n_envs)
        those = [i for i in range(n_envs) if self.steady and calm(i)]
        if those and self.num_timesteps >= learning_starts:
            with self.at_its_mean():
                seen: Any = self._last_obs
                action[those], _ = self.predict(seen[those], deterministic=True)
            told[those] = self.policy.scale_action(action[those])
        return action, told

    def warm_up(self, steps: int) -> None:
        """Learns from what is remembered to act likewise, and then what that is worth."""
        for _ in range(steps):
            self._act_better(self.replay_buffer.sample(self.batch_size), judged=False)
        for _ in range(steps):
            self._judge_better(self.replay_buffer.sample(self.batch_size))

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Learns from batches of memories, and imitates their first halves."""
        self.policy.set_training_mode(True)
        self._update_learning_rate([self.actor.optimizer, self.critic.optimizer])
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size)
            self._judge_better(batch)
            self._act_better(batch)
            now = self.actor.state_dict()
            if not self.averaged:
                self.averaged = {name: row.clone() for name, row in now.items()}
            for name, row in self.averaged.items():
                row.lerp_(now[name], _AVERAGING)

    def _weight(self) -> torch.Tensor:
        """Weight of the entropy."""
        if self.ent_coef_optimizer is None:
            return self.ent_coef_tensor
        assert self.log_ent_coef is not None
        return self.log_ent_coef.detach().exp()

    def _judge_better(self, batch: ReplayBufferSamples) -> None:
        """A gradient step of the critics."""
        critic, target = self.critic, self.critic_target
        assert batch.discounts is not None
        with torch.no_grad():
            after, likely = self.actor.action_log_prob(batch.next_observations)
            pair = np.random.choice(critic.n_critics, 2, replace=False).tolist()
            worth = worth_of(target, batch.next_observations, after, pair).amin(dim=1, keepdim=True)
            worth -= self._weight() * likely.reshape(-1, 1)
            aim = batch.rewards + (1.0 - batch.dones) * batch.discounts * worth
        off = worth_of(critic, batch.observations, batch.actions) - aim
        loss = 0.5 * (off**2).mean(dim=0).sum()
        self.critic.optimizer.zero_grad()
        loss.backward()
        self.critic.optimizer.step()
        polyak_update(critic.parameters(), target.parameters(), self.tau)
        self.logger.record("train/critic_loss", float(loss.detach()) / critic.n_critics)

    def _act_better(self, batch: ReplayBufferSamples, *, judged: bool = True) -> None:
        """A gradient step of the actor, by the critics or by imitation alone, and of the noise."""
        critic, actor = self.critic, self.actor
        noise: Any = actor.action_dist
        mean, spread, _ = actor.get_action_dist_params(batch.observations)
        loss = torch.zeros(())
        if judged:
            actions, likely = noise.log_prob_from_params(mean, spread)
            critic.requires_grad_(False)
            worth = worth_of(critic, batch.observations, actions).amin(dim=1)
            critic.requires_grad_(True)
            loss = (self._weight() * likely - worth).mean()
            self.logger.record("train/actor_loss", float(loss.detach()))
        shown = len(mean) // 2 if self.replay_buffer.shown else 0
        left = self._current_progress_remaining
        weight = self.imitation * (self.last_imitation + (1.0 - self.last_imitation) * left)
        if shown and weight:
            apart = torch.tanh(mean[:shown]) - batch.actions[:shown]
            apart = (apart**2).sum(dim=1).mean()
            self.logger.record("train/apart", float(apart.detach()))
            loss = loss + weight * apart
        actor.optimizer.zero_grad()
        loss.backward()
        actor.optimizer.step()
        if judged and self.ent_coef_optimizer is not None:
            assert self.log_ent_coef is not None
            missing = (likely.detach() + float(self.target_entropy)).mean()
            self.ent_coef_optimizer.zero_grad()
            (-self.log_ent_coef * missing).sum().backward()
            self.ent_coef_optimizer.step()
            self.logger.record("train/ent_coef", float(self._weight()))

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

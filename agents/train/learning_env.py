"""Tasks as a learner sees them: what its episodes earned is noted, and it may correct a gait."""

import pickle
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from tca_mj.agents.policies.files import with_clock
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.rollout import tally
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.control import Gait

Observations = NDArray[np.float32]


class LearningEnv(VecEnvWrapper):
    """Several tasks, and statistics of their episodes.

    With ``alike`` an action has a number for each pair of a left and a right TCA. With ``gait`` an
    action is a correction of the temperatures of a gait, 1 being ``bound``, and an observation ends
    with sine and cosine of the gait's phase: what is learned is the network of a
    ``tca_mj.agents.policies.files.ResidualPolicy``.

    Attributes:
        finished: For every episode that ended since it was last emptied: ``return``, ``length``,
            ``success``, ``early_end``, each reward term, and ``speed`` [m/s] where there is one.
        pairs: Which number of an action each TCA gets; None where each has its own.
        level: Reward of a step that is told to the learner as none.
    """

    venv: TaskVecEnv

    def __init__(
        self, venv: TaskVecEnv, gait: tuple[Gait, tuple[float, ...]] | None = None,
        bound: float = 0, alike: bool = False,
    ) -> None:  # fmt: skip
        """Wraps ``venv``.

        Args:
            venv: The tasks.
            gait: The gait that is corrected, and its steering per leg [K/rad]; None for none.
            bound: Largest correction [K].
            alike: Whether left and right are told the same.
        """
        seen: Any = venv.observation_space
        if gait is not None:
            low, high = np.append(seen.low, [-1.0, -1.0]), np.append(seen.high, [1.0, 1.0])
            seen = spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)
        self.pairs = venv.tasks.envs[0].action.pairs if alike else None
        acts: Any = venv.action_space
        if self.pairs is not None:
            acts = spaces.Box(-1.0, 1.0, (int(self.pairs.max()) + 1,), np.float32)
        super().__init__(venv, observation_space=seen, action_space=acts)
        self.level = 0.0
        self.finished: list[dict[str, float]] = []
        self._walkers: list[GaitPolicy] = []
        if gait is not None:
            self._walkers = [GaitPolicy.in_task(task, *gait) for task in venv.tasks.envs]
        self._bound = bound
        self._seen = np.zeros(venv.tasks.observation_space.shape or (), dtype=np.float32)
        self._sums: list[dict[str, float]] = [defaultdict(float) for _ in range(venv.num_envs)]

    def reset(self) -> Observations:
        """Begins new episodes."""
        self._sums = [defaultdict(float) for _ in range(self.num_envs)]
        for walker in self._walkers:
            walker.reset()
        return self._with_clocks(self.venv.reset())

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Turns corrections, or what both sides are told, into actions."""
        if self.pairs is not None:
            actions = actions[:, self.pairs]
        if self._walkers:
            changes = self._bound * actions.astype(np.float64)
            # Scaled or not: of what is seen a gait that asks for temperatures reads the commanded
            # direction alone, whose scale is 1, and one that sets power is never scaled.
            each = zip(self._walkers, self._seen, changes, strict=True)
            actions = np.stack([walker.act(seen, change) for walker, seen, change in each])
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Steps, and notes what was earned."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for i, (reward, done, info) in enumerate(zip(rewards, dones, infos, strict=True)):
            sums = self._sums[i]
            tally(sums, reward, info)
            if not done:
                continue
            over = "truncation_reason" in info or not info["TimeLimit.truncated"]
            ends = {"success": float(info["success"]),
                    "early_end": float(over and not info["success"])}  # fmt: skip
            if "speed" in info:
                ends["speed"] = float(info["speed"])
            self.finished.append(dict(sums | ends))
            self._sums[i] = defaultdict(float)
            if self._walkers:
                last = info["terminal_observation"]
                info["terminal_observation"] = with_clock(last, self._walkers[i])
                self._walkers[i].reset()
        return self._with_clocks(observations), rewards - np.float32(self.level), dones, infos

    def _with_clocks(self, observations: Any) -> Observations:
        if not self._walkers:
            return observations
        self._seen = observations
        pairs = zip(observations, self._walkers, strict=True)
        return np.stack([with_clock(row, walker) for row, walker in pairs])

    def state(self) -> dict[str, Any]:
        """All there is to it, to be given to ``restore``."""
        names = ("finished", "_walkers", "_seen", "_sums", "level")
        kept = {name: getattr(self, name) for name in names}
        return {"venv": pickle.dumps(self.venv), "kept": pickle.dumps(kept)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on where ``state`` was taken."""
        self.venv = pickle.loads(state["venv"])
        for name, value in pickle.loads(state["kept"]).items():
            setattr(self, name, value)

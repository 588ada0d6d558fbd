"""Deep reinforcement learning by Stable-Baselines3, in runs that survive being killed.

After every interval the whole state of the run (networks, optimisers, statistics, replay buffer,
environments, generators, curve) is replaced in one file. A run that goes on from it does, to the
last bit, what it would have done without the interruption.
"""

import io
import os
import pickle
import random
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.vec_env import VecNormalize
from tqdm import tqdm

from tca_mj.agents.policies import Origin, Policy, SavedPolicy
from tca_mj.agents.rollout import rollout
from tca_mj.agents.train.config import OnPolicy, TrainConfig
from tca_mj.agents.train.export import exported
from tca_mj.agents.train.learning_env import LearningEnv
from tca_mj.agents.train.runs import CURVE, LIBRARIES, RunFolder
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.agents.train.search import first_gait
from tca_mj.envs.wrappers import RecordRerun
from tca_mj.machine import versions
from tca_mj.record.film import Film
from tca_mj.record.render import RenderingUnavailable
from tca_mj.registry import episode_steps, make

EVALUATIONS = "evaluations.csv"
BEST, LAST = "best", "last"  # with the ending of their kind
RECORDING, VIDEO = "best.rrd", "best.mp4"

_FILM = 10.0  # length of the film of an episode that takes all its time [s]

_LEARNERS: dict[str, Any] = {"ppo": PPO, "sac": SAC, "td3": TD3}


def train(
    config: TrainConfig,
    out: Path,
    *,
    command: str = "",
    video: bool = True,
    progress: bool = True,
) -> SavedPolicy:
    """Trains a policy, or goes on with the run that ``out`` holds.

    Into ``out`` go ``run.json``, ``state.pkl``, ``curve.csv``, ``evaluations.csv``, the policies
    ``best`` (by the evaluations) and ``last``, ``best.rrd``, ``best.mp4`` and ``tensorboard``.
    Torch computes on one thread meanwhile.

    Args:
        config: The settings.
        out: Folder of the run.
        command: What to note as the command.
        video: Whether to film the best policy at the end, where there is OpenGL.
        progress: Whether to show a progress bar, where there is a terminal.

    Returns:
        The best policy.

    Raises:
        FileNotFoundError, ValueError: If the settings do not fit, or not to the run in ``out``.
        KeyboardInterrupt: As it came; the same call goes on from the last interval.
    """
    with _one_thread():
        run = Run(config, RunFolder(out, config, command), command)
        bar = tqdm(
            total=config.steps, initial=run.model.num_timesteps, unit="step", unit_scale=True,
            disable=None if progress else True,
        )  # fmt: skip
        with closing(bar), closing(run):
            if not run.new:
                run.explain()  # the state may be newer, if the run was killed in between
            left = config.steps - run.model.num_timesteps
            if left > 0:
                # No log of its own, which would empty what the curve takes from the logger.
                never: Any = None
                run.model.learn(
                    left, _Watch(run, bar), log_interval=never, reset_num_timesteps=run.new
                )
                run.mark(last=True)
            if run.best is None:
                run.evaluate()
            run.record(video=video)
        assert run.best is not None
        return run.best[1]


class Run:
    """A run under way: the model, and what there is to know and to keep of it.

    Attributes:
        model: The learner.
        new: Whether it has not begun yet.
        best: The best mean return in an evaluation, and the policy that earned it.
        rows: The learning curve.
        evaluations: Those so far.
    """

    def __init__(self, config: TrainConfig, folder: RunFolder, command: str) -> None:
        self.config, self.folder, self.command = config, folder, command
        state = folder.load()
        self.new = state is None
        self.rows: list[dict[str, float]] = [] if state is None else state["rows"]
        self.evaluations: list[dict[str, float]] = [] if state is None else state["evaluations"]
        self.best: tuple[float, SavedPolicy] | None = None if state is None else state["best"]
        self._gait = first_gait(config.task, config.start) if config.residual else None
        tasks = TaskVecEnv.make(
            config.task, config.envs, reset_options=dict(config.options), **config.arguments
        )
        self.env = LearningEnv(tasks, self._gait, config.residual)
        if state is None:
            self.normalise = VecNormalize(self.env, gamma=config.learner.gamma)
            self.model = _learner(config, self.normalise)
        else:
            self.env.restore(state["env"])
            self.normalise = pickle.loads(state["normalise"])
            self.normalise.set_venv(self.env)
            self.normalise.returns = state["returns"]
            self.model = _LEARNERS[config.algorithm].load(
                io.BytesIO(state["model"]), self.normalise, device="cpu", force_reset=False
            )
            if state["replay"] is not None:
                self.model.replay_buffer = pickle.loads(state["replay"])  # type: ignore[attr-defined]
            _set_generators(self.model, state["generators"])
        self.model.set_logger(Logger(folder=None, output_formats=[]))
        self.test_env: gym.Env[Any, Any] = self._made()
        self.board = folder.tensorboard(self.model.num_timesteps)
        self.marks = self.model.num_timesteps // config.interval

    def _made(self) -> gym.Env[Any, Any]:
        """The task, by itself."""
        made: gym.Env[Any, Any] = make(self.config.task, **self.config.arguments)
        return made

    def due(self) -> bool:
        """Whether an interval is over."""
        return self.model.num_timesteps // self.config.interval > self.marks

    def mark(self, *, last: bool = False) -> None:
        """Adds a row to the curve, evaluates if it is time to, and writes all there is."""
        self.marks = self.model.num_timesteps // self.config.interval
        episodes, self.env.finished = self.env.finished, []
        row: dict[str, float] = {"steps": self.model.num_timesteps, "episodes": len(episodes)}
        for name in dict.fromkeys(name for episode in episodes for name in episode):
            row[f"{name}_mean"] = float(np.mean([episode.get(name, 0.0) for episode in episodes]))
        learned = self.model.logger.name_to_value
        row |= {name: float(learned[name]) for name in sorted(learned) if name[:6] == "train/"}
        self.rows.append(row)
        self._show("training", row)
        if last or len(self.rows) % self.config.evaluate_every == 0:
            self.evaluate()
        self.save()

    def evaluate(self) -> None:
        """Runs the episodes of an evaluation, and keeps the policy if it is the best so far."""
        config, saved = self.config, self.policy()
        random = np.random.default_rng((config.seed, 1))
        seeds = random.integers(2**31, size=config.evaluation_episodes).tolist()
        policy, options = saved.make(self.test_env), dict(config.options)
        found = [episode(self.test_env, policy, seed, options) for seed in seeds]
        row = {"steps": float(self.model.num_timesteps)}
        row |= {name: float(np.mean([each[name] for each in found])) for name in found[0]}
        self.evaluations.append(row)
        self._show("evaluation", row)
        if self.best is None or row["return"] > self.best[0]:
            self.best = row["return"], saved
            self.record(video=False)

    def policy(self) -> SavedPolicy:
        """The policy as it is now."""
        config, gait = self.config, self._gait
        origin = Origin(
            algorithm=config.algorithm, seed=config.seed, steps=self.model.num_timesteps,
            command=self.command, versions=versions(*LIBRARIES),
            source=f"corrects the gait '{config.start}'" if gait else "",
        )  # fmt: skip
        network = exported(self.model, self.normalise)
        if gait is None:
            return SavedPolicy(
                task=config.task, origin=origin, network=network, arguments=config.arguments
            )
        return SavedPolicy(
            task=config.task, origin=origin, network=network, gait=gait[0], steering=gait[1],
            bound=config.residual, arguments=config.arguments,
        )  # fmt: skip

    def save(self) -> None:
        """Replaces the state, then what follows from it."""
        buffer, model = io.BytesIO(), self.model
        model.save(buffer)
        replay = getattr(model, "replay_buffer", None)
        state = {
            "model": buffer.getvalue(),
            "replay": None if replay is None else pickle.dumps(replay),
            "normalise": pickle.dumps(self.normalise),
            "returns": self.normalise.returns,
            "env": self.env.state(),
            "generators": _generators(model),
            "rows": self.rows,
            "evaluations": self.evaluations,
            "best": self.best,
        }
        self.folder.save(state)
        self.explain()

    def explain(self) -> None:
        """Writes what follows from the state: curves and policies."""
        self.folder.write_curves({CURVE: self.rows, EVALUATIONS: self.evaluations})
        self.policy().save(self.folder.path / f"{LAST}.npz")
        if self.best is not None:
            self.best[1].save(self.folder.path / f"{BEST}.npz")
        self.board.flush()

    def record(self, *, video: bool) -> None:
        """Records an episode of the best policy; its files are replaced when they are whole."""
        if self.best is None:
            return
        folder, made = self.folder.path, [RECORDING]
        with ExitStack() as ends:
            env = ends.enter_context(
                closing(RecordRerun(self._made(), folder / f"part-{RECORDING}"))
            )
            task: Any = env.unwrapped
            frames: list[Callable[[], None]] = []
            if video:
                steps = episode_steps(self.config.task, task.control_period) or 1
                limit = steps * task.control_period
                try:
                    film = Film(
                        task.sim, folder / f"part-{VIDEO}", camera=task._camera,
                        speed=max(1.0, limit / _FILM),
                    )  # fmt: skip
                    ends.callback(film.close)
                    frames, made = [film.frame], [*made, VIDEO]
                except ImportError as error:
                    tqdm.write(f"{VIDEO} is left out: {error}")

            def each() -> None:
                try:
                    for frame in frames:
                        frame()
                except RenderingUnavailable as error:
                    frames.clear()
                    made.remove(VIDEO)
                    tqdm.write(f"{VIDEO} is left out: {error}")

            options = dict(self.config.options)
            episode(env, self.best[1].make(env), self.config.seed, options, each)
        for name in made:
            os.replace(folder / f"part-{name}", folder / name)

    def close(self) -> None:
        """Ends what the run has opened."""
        self.board.close()
        self.normalise.close()
        self.test_env.close()

    def _show(self, kind: str, row: dict[str, float]) -> None:
        for name, value in row.items():
            self.board.add_scalar(f"{kind}/{name}", value, self.model.num_timesteps)


class _Watch(BaseCallback):
    """Tells the run when the model is at rest: collected steps learned from, no others begun."""

    def __init__(self, run: Run, bar: Any) -> None:
        super().__init__()
        self.run, self.bar = run, bar

    def _on_rollout_start(self) -> None:
        self.bar.update(self.num_timesteps - self.bar.n)
        if self.run.due():
            self.run.mark()
            self.bar.set_postfix(
                {
                    "return": f"{self.run.rows[-1].get('return_mean', np.nan):.2f}",
                    "best": f"{self.run.best[0] if self.run.best else np.nan:.2f}",
                }
            )

    def _on_step(self) -> bool:
        return True


def episode(
    env: gym.Env[Any, Any],
    policy: Policy,
    seed: int,
    options: dict[str, Any],
    each: Callable[[], None] = lambda: None,
) -> dict[str, float]:
    """Runs one episode.

    Args:
        env: The task.
        policy: Who acts.
        seed: Seed of the episode.
        options: Options of the reset.
        each: Called after the reset and after every step.

    Returns:
        ``return``, ``length``, ``success``, and the sum of each reward term.
    """
    sums = {"return": 0.0, "length": -1.0, "success": 0.0}
    for step in rollout(env, policy, seed=seed, options=options):
        each()
        sums["return"] += step.reward
        sums["length"] += 1.0
        for name, term in step.info.get("reward_terms", {}).items():
            sums[f"term_{name}"] = sums.get(f"term_{name}", 0.0) + float(term)
    return sums | {"success": float(step.info["success"])}


def _learner(config: TrainConfig, env: VecNormalize) -> BaseAlgorithm:
    """A new model."""
    settings = config.learner
    common: dict[str, Any] = {
        "policy": "MlpPolicy", "env": env, "seed": config.seed, "device": "cpu",
        "learning_rate": settings.learning_rate, "gamma": settings.gamma,
        "batch_size": settings.batch_size,
    }  # fmt: skip
    hidden = list(settings.hidden)
    if isinstance(settings, OnPolicy):
        return PPO(
            **common, n_steps=settings.n_steps, n_epochs=settings.n_epochs,
            gae_lambda=settings.gae_lambda, clip_range=settings.clip_range,
            ent_coef=settings.ent_coef,
            policy_kwargs={"net_arch": hidden, "log_std_init": settings.log_std_init},
        )  # fmt: skip
    common |= {
        "buffer_size": settings.buffer_size, "learning_starts": settings.learning_starts,
        "train_freq": settings.train_freq, "gradient_steps": settings.gradient_steps,
        "tau": settings.tau, "policy_kwargs": {"net_arch": hidden},
    }  # fmt: skip
    if config.algorithm == "sac":
        return SAC(**common)
    n = env.action_space.shape or (1,)
    noise = NormalActionNoise(np.zeros(n), np.full(n, settings.noise))
    return TD3(**common, action_noise=noise)


def _generators(model: BaseAlgorithm) -> dict[str, Any]:
    """The states of all generators that a learner draws from; those of the tasks are their own."""
    return {
        "python": random.getstate(),
        "numpy": np.random.get_state(),
        "torch": torch.get_rng_state(),
        "actions": model.action_space.np_random.bit_generator.state,
    }


def _set_generators(model: BaseAlgorithm, states: dict[str, Any]) -> None:
    random.setstate(states["python"])
    np.random.set_state(states["numpy"])
    torch.set_rng_state(states["torch"])
    model.action_space.np_random.bit_generator.state = states["actions"]


@contextmanager
def _one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)

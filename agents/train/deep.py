"""Deep reinforcement learning by Stable-Baselines3, in runs that survive being killed.

After every interval the whole state of the run (networks, optimisers, statistics, replay buffer,
environments, generators, curve) is replaced in one file. A run that goes on from it does, to the
last bit, what it would have done without the interruption.
"""

from __future__ import annotations

import inspect
import io
import os
import pickle
import random
import shutil
from contextlib import ExitStack, closing, nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import TQC, CrossQ
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from tca_mj.agents.episode import RECORDING, VIDEO, Episode
from tca_mj.agents.output import write_csv
from tca_mj.agents.policies import Model, Network, SavedPolicy, Statistics
from tca_mj.agents.policies.actors import first_gait, first_gaits
from tca_mj.agents.policies.contracts import contract, differences
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.rollout import earned, rollout
from tca_mj.agents.train.config import TrainConfig
from tca_mj.agents.train.demonstrations import demonstrate, show
from tca_mj.agents.train.learning_env import LearningEnv
from tca_mj.agents.train.mirrored import clock_mirror, mirrored_memory
from tca_mj.agents.train.runs import CURVE, RunFolder, drawn
from tca_mj.agents.train.sb3_env import TaskVecEnv, silence
from tca_mj.agents.train.successes import ImitatingSAC, SuccessReplayBuffer
from tca_mj.control import Gait
from tca_mj.files import PART, claimed
from tca_mj.registry import make, task_class

EVALUATIONS = "evaluations.csv"
BEST, LAST = "best", "last"  # with the ending of their kind

_WARM_UP = 2000  # gradient steps of each kind between a script's steps and the first own ones
_FILM = 10.0  # length of the film of an episode that takes all its time [s]

_LEARNERS: dict[str, Any] = {"ppo": PPO, "sac": SAC, "td3": TD3, "tqc": TQC, "crossq": CrossQ}


def train(
    config: TrainConfig, out: Path, *, command: str = "", video: bool = True, progress: bool = True
) -> SavedPolicy:
    """Trains a policy, or goes on with the run that ``out`` holds.

    Into ``out`` go ``run.json``, ``state.pkl``, ``curve.csv``, ``evaluations.csv``, the policies
    ``best`` (by the evaluations) and ``last``, ``best.rrd`` and ``tensorboard``, and what ``film``
    writes.
    Torch computes on one thread meanwhile.

    Args:
        config: The settings.
        out: Folder of the run.
        command: What to note as the command.
        video: Whether to ``film`` the best policy at the end.
        progress: Whether to show how far it is.

    Returns:
        The best policy.

    Raises:
        FileNotFoundError, ValueError: If the settings do not fit, or not to the run in ``out``.
        BlockingIOError: If another process works in ``out``.
        OSError: If something cannot be written.
        KeyboardInterrupt: As it came; the same call goes on from the last interval.
    """
    if config.start != "random" and task_class(config.task).legs:
        first_gaits(config.task, config.start)  # before a file is touched
    with ExitStack() as ends:
        ends.enter_context(claimed(out))
        ends.callback(torch.set_num_threads, torch.get_num_threads())
        torch.set_num_threads(1)
        run = ends.enter_context(closing(Run(config, RunFolder(out, config, command))))
        done = run.model.num_timesteps
        bar = progress_bar(config.steps, unit="steps", done=done, progress=progress)
        ends.callback(bar.close)
        if not run.new:
            run.explain()  # the state may be newer, if the run was killed in between
        if run.new:
            run.demonstrate()
        left = config.steps - run.model.num_timesteps
        if left > 0:
            # No log of its own, which would empty what the curve takes from the logger.
            silent: dict[str, Any] = {"log_interval": None, "reset_num_timesteps": False}
            run.model.learn(left, _Watch(run, bar), **silent)
            run.mark(last=True)
        if run.best is None:
            run.evaluate()
        if run.best is not None and not (out / f"{BEST}.rrd").is_file():
            record(config, out, run.best[1])
    assert run.best is not None
    if video:
        film(config, out)
    return run.best[1]


def film(config: TrainConfig, out: Path) -> None:
    """Films the best policy of a run into ``best.mp4``, where there is OpenGL, unless that is done.

    It may take longer than the training, and may be broken off at no loss.

    Args:
        config: The settings.
        out: Folder of the run.
    """
    if not (out / f"{BEST}.mp4").is_file():
        with claimed(out):
            record(config, out, SavedPolicy.read(out / f"{BEST}.npz"), video=True)


def record(config: TrainConfig, out: Path, policy: SavedPolicy, *, video: bool = False) -> None:
    """Records an episode of a policy as the best; its files are replaced when they are whole."""
    env: gym.Env[Any, Any] = make(config.task, **config.made_with)
    part = out / f".{BEST}{PART}"
    try:
        episode = Episode(
            env, policy.make(env), names=(config.task, BEST), seed=config.seed, out=part,
            options=config.options, files=(RECORDING, VIDEO) if video else (RECORDING,),
        )  # fmt: skip
        limited = np.isfinite(episode.limit)
        speed = max(1.0, episode.limit / _FILM) if limited else episode.task.film_speed
        files = episode.run(episode.limit, speed=speed, progress=video)["files"]
        (out / f"{BEST}.mp4").unlink(missing_ok=True)  # it would show another policy
        for name in files:
            os.replace(part / name, out / name.replace("rollout", BEST))
    finally:
        shutil.rmtree(part, ignore_errors=True)


class Run:
    """A run under way: the model, and what there is to know and to keep of it.

    Attributes:
        model: The learner.
        new: Whether it has not begun yet.
        best: The best mean return in an evaluation, and the policy that earned it.
        rows: The learning curve.
        evaluations: Those so far.
    """

    def __init__(self, config: TrainConfig, folder: RunFolder) -> None:
        self.config, self.folder = config, folder
        state = folder.load()
        self.new = state is None
        known = state or {"rows": [], "evaluations": [], "best": None}
        self.rows: list[dict[str, float]] = known["rows"]
        self.evaluations: list[dict[str, float]] = known["evaluations"]
        self.best: tuple[float, SavedPolicy] | None = known["best"]
        self._gait = first_gait(config.task, config.start) if config.residual else None
        coarser = {} if config.timestep is None else {"timestep": config.timestep}
        short = _shorter(config)
        tasks = TaskVecEnv.make(
            config.task, config.envs, reset_options=dict(config.options), scaled=config.scaled,
            **config.made_with, **coarser, **short,
        )  # fmt: skip
        tasks.practised = dict(config.practised)
        self.env = LearningEnv(tasks, self._gait, config.residual, config.alike)
        if state is None:
            running = not config.scaled
            self.normalise = VecNormalize(
                self.env, norm_obs=running, norm_reward=running, gamma=config.learner.gamma
            )
            self.model = learner(config, self.normalise, self._gait and self._gait[0])
        else:
            self.env.restore(state["env"])
            self.normalise = pickle.loads(state["normalise"])
            self.normalise.set_venv(self.env)
            self.normalise.returns = state["returns"]
            self.model = _kind(config).load(
                io.BytesIO(state["model"]), self.normalise, device="cpu", force_reset=False
            )
            if isinstance(self.model, ImitatingSAC):
                self.model.averaged = state["averaged"]
            if state["replay"] is not None:
                self.model.replay_buffer = pickle.loads(state["replay"])  # type: ignore[attr-defined]
            _set_generators(self.model, state["generators"])
        silence(self.model)
        self.test_env: gym.Env[Any, Any] = make(config.task, **config.made_with, **short)
        task: Any = self.test_env.unwrapped
        self._units = task.observation.units if config.scaled else None
        if self._units is not None and self._gait:  # the clock comes as it is
            self._units = np.column_stack([self._units, np.array([[0.0], [1.0]]).repeat(2, axis=1)])
        self._made_for = contract(self.test_env)
        if self.best and (apart := differences(self.best[1].made_for, self._made_for)):
            raise ValueError(f"{folder.path} holds a run in another task, {' | '.join(apart)}")
        self.board = folder.tensorboard(self.model.num_timesteps)
        for kind, known_rows in (("training", self.rows), ("evaluation", self.evaluations)):
            if known_rows and known_rows[-1]["steps"] == self.model.num_timesteps:
                self._show(kind, known_rows[-1])
        self.marks = self.model.num_timesteps // config.interval

    def begin(self) -> None:
        """What comes before steps are collected: options of the next resets grow."""
        config, done = self.config, self.model.num_timesteps
        if config.growth:
            shares = {name: min(1.0, done / steps) for name, steps in config.growth.items()}
            grown = {name: float(config.options[name]) * share for name, share in shares.items()}
            self.env.venv.tasks.reset_options = {**config.options, **grown}

    def demonstrate(self) -> None:
        """What comes before anything is learned: steps of a gait instead of steps by chance."""
        config = self.config
        if config.start == "random" or config.residual:
            return
        self.begin()
        tasks = self.env.venv.tasks.envs
        first = min(config.learner.learning_starts, config.steps)  # type: ignore[union-attr]
        if not tasks[0].legs:
            show(self.model, tasks, first, config.seed)
            if isinstance(self.model, ImitatingSAC):
                self.model.warm_up(_WARM_UP)
                self.evaluate()  # what imitation alone has given
            return
        gait = first_gaits(config.task, config.start)
        demonstrate(self.model, tasks, gait, first, config.seed, self.env.pairs)
        if config.centred:
            memory: Any = self.model.replay_buffer  # type: ignore[attr-defined]
            earned = memory.rewards[: memory.size()]
            self.env.level = float(earned.mean(dtype=np.float64))
            earned -= np.float32(self.env.level)

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
        seeds = drawn(config.seed, 1, config.evaluation_episodes)
        env, policy = self.test_env, saved.make(self.test_env)
        found = [earned(rollout(env, policy, seed=s, options=config.options)) for s in seeds]
        if config.successes:
            gamma = config.learner.gamma
            found = [one | {"worth": one["return"] * gamma ** one["length"]} for one in found]
        row = {"steps": float(self.model.num_timesteps)}
        row |= {name: float(np.mean([each[name] for each in found])) for name in found[0]}
        self.evaluations.append(row)
        self._show("evaluation", row)
        score = row.get("worth", row["return"])
        if self.best is None or score > self.best[0]:
            self.best = score, saved
            for kind in (RECORDING, VIDEO):  # they would show another policy
                (self.folder.path / kind.replace("rollout", BEST)).unlink(missing_ok=True)

    def policy(self) -> SavedPolicy:
        """The policy as it is now."""
        config = self.config
        gait, steering = self._gait or (None, ())
        source = f"corrects the gait '{config.start}'" if gait else ""
        network = exported(self.model, self.normalise, self._units, self.env.pairs)
        return SavedPolicy(
            task=config.task, network=network, gait=gait,
            steering=steering, bound=config.residual, arguments=config.arguments,
            made_for=self._made_for,
            origin=self.folder.origin(config.algorithm, self.model.num_timesteps, source),
        )  # fmt: skip

    def shown(self) -> dict[str, str]:
        """How well it learns, in a few words."""
        row, found = self.rows[-1], {}
        if "speed_mean" in row:
            found["speed"] = f"{1e3 * row['speed_mean']:.2f} mm/s"
        if "return_mean" in row:
            found["return"] = f"{row['return_mean']:.2f}"
        return found | ({"best": f"{self.best[0]:.2f}"} if self.best else {})

    def save(self) -> None:
        """Replaces the state, then what follows from it."""
        buffer, model = io.BytesIO(), self.model
        model.save(buffer)
        replay = getattr(model, "replay_buffer", None)
        self.folder.save(
            {
                "model": buffer.getvalue(),
                "averaged": getattr(model, "averaged", None),
                "replay": None if replay is None else pickle.dumps(replay),
                "normalise": pickle.dumps(self.normalise),
                "returns": self.normalise.returns,
                "env": self.env.state(),
                "generators": _generators(model),
                "rows": self.rows,
                "evaluations": self.evaluations,
                "best": self.best,
            }
        )
        self.explain()

    def explain(self) -> None:
        """Writes what follows from the state: curves and policies."""
        write_csv(self.folder.path / CURVE, self.rows)
        write_csv(self.folder.path / EVALUATIONS, self.evaluations)
        self.policy().save(self.folder.path / f"{LAST}.npz")
        if self.best is not None:
            self.best[1].save(self.folder.path / f"{BEST}.npz")
        self.board.flush()

    def close(self) -> None:
        """Ends what the run has opened."""
        self.board.close()
        self.normalise.close()
        self.test_env.close()

    def _show(self, kind: str, row: dict[str, float]) -> None:
        self.folder.require_room()
        for name, value in row.items():
            self.board.add_scalar(f"{kind}/{name}", value, self.model.num_timesteps)


class _Watch(BaseCallback):
    """Tells the run when the model is at rest: collected steps learned from, no others begun."""

    def __init__(self, run: Run, bar: Any) -> None:
        super().__init__()
        self.run, self.bar = run, bar

    def _on_rollout_start(self) -> None:
        self.bar.update(self.num_timesteps - self.bar.n)
        if self.num_timesteps // self.run.config.interval > self.run.marks:
            self.run.mark()
            self.bar.set_postfix(self.run.shown())
        self.run.begin()

    def _on_step(self) -> bool:
        return True


@dataclass(frozen=True)
class _Falling:
    """A rate that falls to a share of it, as a function of the share of the run that is left."""

    first: float
    last: float

    def __call__(self, left: float) -> float:
        return self.first * (self.last + (1.0 - self.last) * left)


def learner(config: TrainConfig, env: VecEnv, gait: Gait | None = None) -> BaseAlgorithm:
    """A new model of Stable-Baselines3.

    Args:
        config: The settings.
        env: What it learns in; with mirrored memories round a ``TaskVecEnv``.
        gait: The gait that is corrected; None for none. Where left and right legs do not step as in
            a mirror, memories are not mirrored.
    """
    kind, settings = _kind(config), asdict(config.learner)
    network: dict[str, Any] = {"net_arch": list(settings["hidden"])}
    if "log_std_init" in settings:
        network["log_std_init"] = settings["log_std_init"]
    if settings.get("last_rate", 1.0) < 1.0:
        settings["learning_rate"] = _Falling(settings["learning_rate"], settings["last_rate"])
    if kind is TD3:
        n = env.action_space.shape or (1,)
        settings["action_noise"] = NormalActionNoise(np.zeros(n), np.full(n, settings["noise"]))
    clock = clock_mirror(gait) if gait else ()
    if config.mirrored and (clock or gait is None):
        assert isinstance(env.unwrapped, TaskVecEnv)
        settings |= mirrored_memory(
            env.unwrapped, retold=config.retold, alike=config.alike, seed=config.seed, clock=clock
        )
    if config.successes:
        network["n_critics"] = settings["critics"]
        settings["replay_buffer_class"] = SuccessReplayBuffer
        settings["replay_buffer_kwargs"] = {
            "n_steps": settings.pop("n_steps"), "gamma": settings["gamma"],
            "kind": next(iter(config.practised), ""), "steady": settings["steady"],
        }  # fmt: skip
    known = inspect.signature(kind).parameters
    model: BaseAlgorithm = kind(
        "MlpPolicy", env, seed=config.seed, device="cpu", policy_kwargs=network,
        **{name: value for name, value in settings.items() if name in known},
    )  # fmt: skip
    if isinstance(model, ImitatingSAC):
        model.imitation = settings["imitation"]
        model.last_imitation = settings["last_imitation"]
        model.steady = settings["steady"]
    return model


def _kind(config: TrainConfig) -> Any:
    return ImitatingSAC if config.successes else _LEARNERS[config.algorithm]


def _shorter(config: TrainConfig) -> dict[str, Any]:
    """How long episodes are, where the task does not say it."""
    if config.limit is None:
        return {}
    period = config.arguments.get("control_period") or task_class(config.task).control_period
    return {"max_episode_steps": max(1, round(config.limit / period))}


def exported(
    model: BaseAlgorithm, normalise: VecNormalize, units: Any,
    pairs: NDArray[np.int64] | None = None,
) -> Network:  # fmt: skip
    """What a model does without noise, as plain numbers.

    Args:
        model: The model.
        normalise: What normalises its observations, or does not.
        units: Centre and scale by which they are taken first; None for as they are.
        pairs: Which of its numbers each of the task's gets; None for the same.
    """
    statistics = None
    if normalise.norm_obs:
        seen: Any = normalise.obs_rms
        statistics = Statistics(
            mean=tuple(seen.mean.tolist()), var=tuple(seen.var.tolist()),
            clip=float(normalise.clip_obs), epsilon=float(normalise.epsilon),
        )  # fmt: skip
    buffer = io.BytesIO()
    with model.at_its_mean() if isinstance(model, ImitatingSAC) else nullcontext():
        model.save(buffer)
    network = Model.parsed(buffer.getvalue(), "").preprocessed(units, statistics)
    if pairs is None:
        return network
    (*weights, weight), (*biases, bias) = network.weights, network.biases
    bounds = None if network.bounds is None else network.bounds[:, pairs]
    return replace(
        network, weights=(*weights, weight[pairs]), biases=(*biases, bias[pairs]), bounds=bounds
    )


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

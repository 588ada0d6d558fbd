"""One policy of several: what each of them does with its options, one network learns to do.

Teachers are policies that see the same. Episodes begin with the options of one of them; in the
first round it drives them, in all others the pupil, with noise, so that it is told what to do where
it gets to by itself (DAgger: Ross, Gordon and Bagnell, AISTATS 2011). What it learns by is the
difference between its action and the teacher's, over all rounds so far, and mirrored ones.

After every round the state is replaced in one file, and all that is drawn in a round follows from
the seed and its number: a run that was killed ends as one that was not, to the last bit.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
from numpy.typing import NDArray

from tca_mj.agents.output import write_csv
from tca_mj.agents.policies import Network, SavedPolicy
from tca_mj.agents.policies.contracts import contract, differences
from tca_mj.agents.policies.load import find
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.rollout import tally
from tca_mj.agents.train.config import Few, LearnerSeed, Many, Part, Steps, Widths
from tca_mj.agents.train.runs import CURVE, RunFolder
from tca_mj.checks import Checked, Positive, door, number, shown
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.vector import TaskVector
from tca_mj.files import claimed
from tca_mj.registry import Envs, episode_steps, find_task, make, recipes, task_class

POLICY = "best.npz"  # as that of other runs, so that it is found as theirs
_MOST = 64  # teachers
_LAST = 0.01  # share of the rate that is left at the end of a round
Floats = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True, slots=True)
class Teacher(Checked):
    """Who is to be learned from, and where.

    Attributes:
        policy: A policy's file, a shipped policy's name, or the folder of a training run.
        options: Options of the resets of which it knows what to do.

    Raises:
        ValueError: If a field is not of its kind.
    """

    policy: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def saved(self) -> SavedPolicy:
        """The policy.

        Raises:
            FileNotFoundError: If there is none.
            ValueError: If it is no policy, or has no network or a gait beneath it: what that does
                depends on time, which a pupil does not see.
        """
        saved = SavedPolicy.read(find(self.policy))
        if saved.network is None or saved.gait is not None:
            raise ValueError(f"teacher must be a network, got {self.policy}, a {saved.kind}")
        return saved


@dataclass(frozen=True, kw_only=True, slots=True)
class DistilConfig(Checked):
    """Settings of a run.

    Attributes:
        task: Gymnasium id of the task that the pupil learns.
        teachers: Who it learns from, 1 to 64.
        steps: Steps of all environments together, up to a billion, rounded up to whole rounds.
        seed: Seed of everything that is drawn, below 2**32.
        envs: Environments that are stepped together, up to 1024; each has one of the teachers, by
            turns, and in a round as many steps as an episode takes.
        options: Options of every reset besides the teachers'.
        arguments: Values of arguments that the task is made with besides the teachers'; with
            several there are as many environments with each, and the policy is one for the first.
        timestep: Physics time step; None for the task's own [s].
        noise: Standard deviation of what is added to the actions of every second environment, 0 to
            1 [1].
        hidden: Widths of the up to 16 hidden layers, with ReLU; up to 10 000.
        gradient_steps: Gradient steps of each round, up to a million.
        batch_size: Of the gradient, up to a million.
        learning_rate: Of Adam at the start of a round, above 0 up to 1 [1].

    Raises:
        ValueError: If a field is out of range.
    """

    task: str
    teachers: tuple[Teacher, ...]
    steps: Steps = 15_000
    seed: LearnerSeed = 0
    envs: Envs = 6
    options: Mapping[str, Any] = field(default_factory=dict)
    arguments: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    timestep: Positive | None = None
    noise: Annotated[float, partial(number, at_least=0.0, at_most=1.0)] = 0.1
    hidden: Widths = (256, 256)
    gradient_steps: Many = 1500
    batch_size: Few = 512
    learning_rate: Part = 1e-3

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        task_class(self.task)
        if not 1 <= len(self.teachers) <= _MOST:
            raise ValueError(f"teachers must be 1 to {_MOST}, got {len(self.teachers)}")
        for name, values in self.arguments.items():
            if not isinstance(values, tuple) or not values:
                raise ValueError(f"arguments[{name!r}] must be values, got {shown(values)}")


@door
def distil_config(task: str, teachers: tuple[Teacher, ...], **change: Any) -> DistilConfig:
    """The default for a task: options and time step are those of its recipe, where it has one.

    Args:
        task: Gymnasium id.
        teachers: Who is learned from.
        **change: Fields of ``DistilConfig`` that differ from it; ``options`` come on top of the
            recipe's.

    Raises:
        ValueError: If a field is out of range.
    """
    recipe = next(iter(recipes(task).values()), Recipe(steps=1))
    options = {**recipe.options, **change.pop("options", {})}
    usual: dict[str, Any] = {"timestep": recipe.timestep, "options": options}
    return DistilConfig(task=task, teachers=teachers, **usual | change)


def distil(
    config: DistilConfig, out: Path, *, command: str = "", progress: bool = True
) -> SavedPolicy:
    """Teaches one policy, or goes on with the run that ``out`` holds.

    Into ``out`` go ``run.json``, ``state.pkl``, ``curve.csv``, a row for each round, and the policy
    ``best.npz``. Torch computes on one thread meanwhile.

    Args:
        config: The settings.
        out: Folder of the run.
        command: What to note as the command.
        progress: Whether to show how far it is.

    Returns:
        The policy after the last round.

    Raises:
        FileNotFoundError, ValueError: If the settings do not fit, or not to the run in ``out``.
        BlockingIOError: If another process works in ``out``.
        OSError: If something cannot be written.
        KeyboardInterrupt: As it came; the same call goes on from the last round.
    """
    lesson = _Lesson(config)  # what is wrong is said before a file is touched
    with ExitStack() as ends:
        ends.callback(lesson.close)
        ends.enter_context(claimed(out))
        ends.callback(torch.set_num_threads, torch.get_num_threads())
        torch.set_num_threads(1)
        folder = RunFolder(out, config, command)
        state = folder.load() or {"teachers": lesson.digests, "rounds": [], "rows": [],
                                  "layers": lesson.first()}  # fmt: skip
        if state["teachers"] != lesson.digests:
            raise ValueError(f"{out} must hold a run with these teachers, got one with others")
        rows: list[dict[str, float]] = state["rows"]
        bar = progress_bar(
            lesson.rounds * lesson.size, unit="steps", done=len(rows) * lesson.size,
            progress=progress,
        )  # fmt: skip
        ends.callback(bar.close)
        explain = partial(lesson.explain, folder, state)
        while len(rows) < lesson.rounds:
            random = np.random.default_rng((config.seed, 3, len(rows)))
            pupil = lesson.network(state["layers"]) if rows else None
            seen, told, row = lesson.collect(pupil, random, len(rows))
            state["rounds"].append((seen, told))
            state["layers"] = lesson.fit(state["layers"], state["rounds"], random)
            rows.append({"steps": (len(rows) + 1) * lesson.size, **row})
            folder.save(state)
            explain()
            bar.update(lesson.size)
            bar.set_postfix({name: f"{row[name]:.3f}" for name in row if name == "error"})
        return explain()  # the state may be newer, if the run was killed in between


class _Lesson:
    """Tasks, teachers, and what is computed of them; between rounds it remembers nothing."""

    def __init__(self, config: DistilConfig) -> None:
        self.config = config
        saved = [teacher.saved for teacher in config.teachers]
        self.teachers = [each.network for each in saved if each.network is not None]
        content = (find(teacher.policy).read_bytes() for teacher in config.teachers)
        self.digests = [hashlib.sha256(each).hexdigest() for each in content]
        self.source = "; ".join(
            " ".join([teacher.policy, *(f"{k}={v}" for k, v in teacher.options.items())])
            for teacher in config.teachers
        )
        self.arguments = dict(saved[0].arguments)
        for teacher, each in zip(config.teachers, saved, strict=True):
            if dict(each.arguments) != self.arguments:
                raise ValueError(
                    f"teachers must be made with the same arguments, got {self.arguments} and, of"
                    f" {teacher.policy}, {dict(each.arguments)}"
                )
        self.made_for = self._accepted(saved)
        limit = episode_steps(config.task, self.arguments.get("control_period"))
        if limit is None:
            raise ValueError(f"task must have a limit of steps, got {config.task} without")
        self.length, self.vectors = limit, list(self._vectors())
        self.size = self.length * config.envs * len(self.vectors)  # steps of a round
        self.rounds = -(-config.steps // self.size)
        task = self.vectors[0].envs[0]
        self.observation, self.action = task.observation, task.action
        self.mirrored = self.observation.symmetric and self.action.symmetric

    def _accepted(self, saved: list[SavedPolicy]) -> dict[str, Any]:
        """The contract of the task, with the first value of each argument, to which the teachers'
        fit but for how they scale."""
        first = {name: values[0] for name, values in self.config.arguments.items()}
        env = make(self.config.task, disable_env_checker=True, **self.arguments, **first)
        found, options = contract(env), env.unwrapped.options
        env.close()
        given = {name: _unscaled(name, part) for name, part in found.items()}
        for teacher, each in zip(self.config.teachers, saved, strict=True):
            needed = {name: _unscaled(name, part) for name, part in each.made_for.items()}
            if apart := differences(needed, given):
                raise ValueError(
                    f"teacher must see and do what {self.config.task} has, got {teacher.policy}:"
                    f" {' | '.join(apart)}"
                )
            spaces = env.observation_space.shape[0], env.action_space.shape[0]
            if each.network is None or (each.network.inputs, each.network.outputs) != spaces:
                raise ValueError(
                    f"teacher must turn {spaces[0]} numbers into {spaces[1]}, got {teacher.policy}"
                )
            options.setup(np.random.default_rng(0), {**self.config.options, **teacher.options})
        return found

    def _vectors(self) -> Iterator[TaskVector]:
        """Tasks with every combination of the arguments."""
        config, task = self.config, task_class(self.config.task)
        common = {**find_task(config.task).kwargs, **self.arguments}
        common |= {} if config.timestep is None else {"timestep": config.timestep}
        for values in product(*config.arguments.values()):
            more = dict(zip(config.arguments, values, strict=True))
            yield TaskVector(task, num_envs=config.envs, **common | more)

    def collect(
        self, pupil: Network | None, random: np.random.Generator, number: int
    ) -> tuple[Floats, Floats, dict[str, float]]:
        """What is seen in a round, what the teachers would do there, and how far the pupil is off.

        Args:
            pupil: Who drives; None for the teachers.
            random: What is drawn from.
            number: Of the round.
        """
        seen, told, errors = [], [], defaultdict(list)
        sums: dict[str, list[float]] = defaultdict(list)
        for tasks in self.vectors:
            now = [self._begin(tasks, i, number, random) for i in range(tasks.num_envs)]
            earned: list[dict[str, float]] = [defaultdict(float) for _ in now]
            for _ in range(self.length):
                right = np.stack([
                    self.teachers[self._turn(i, number)](each) for i, each in enumerate(now)
                ])  # fmt: skip
                done = right if pupil is None else np.stack([pupil(each) for each in now])
                seen.append(np.stack(now))
                told.append(right)
                if pupil is not None:
                    for i, off in enumerate(np.square(done - right).mean(axis=1).tolist()):
                        errors[self._turn(i, number)].append(off)
                noise = self.config.noise * random.standard_normal(done.shape)
                noise[::2] = 0.0
                actions = np.clip(done + noise, -1.0, 1.0).astype(np.float32)
                for i, outcome in enumerate(tasks.advance(actions)):
                    assert outcome is not None  # all are stepped
                    now[i], reward, terminated, truncated, info = outcome
                    tally(earned[i], reward, info)
                    if terminated or truncated:
                        now[i] = self._begin(tasks, i, number, random)
            for i, each in enumerate(earned):
                sums[f"return_{self._turn(i, number)}"].append(each["return"])
        every = [off for each in errors.values() for off in each]
        row = {"error": float(np.sqrt(np.mean(every)))} if every else {}
        row |= {f"error_{k}": float(np.sqrt(np.mean(errors[k]))) for k in sorted(errors)}
        row |= {name: float(np.mean(sums[name])) for name in sorted(sums)}
        return self.observation.scaled(np.concatenate(seen)), np.concatenate(told), row

    def _turn(self, i: int, number: int) -> int:
        """Whose options an environment has in a round; two neighbours, one with noise, the same."""
        return (i // 2 + number) % len(self.teachers)

    def _begin(
        self, tasks: TaskVector, i: int, number: int, random: np.random.Generator
    ) -> Floats:
        """The first observation of an episode."""
        teacher = self.config.teachers[self._turn(i, number)]
        options = {**self.config.options, **teacher.options}
        return tasks.restart(i, seed=int(random.integers(2**31)), options=options)[0]

    def first(self) -> list[Floats]:
        """Weights and biases of a network that knows nothing, layer by layer."""
        random = np.random.default_rng((self.config.seed, 4))
        widths = [self.observation.size, *self.config.hidden, self.action.size]
        return [
            random.uniform(-(n**-0.5), n**-0.5, shape).astype(np.float32)
            for n, m in zip(widths, widths[1:], strict=False) for shape in ((m, n), (m,))
        ]  # fmt: skip

    def fit(
        self, layers: list[Floats], rounds: list[tuple[Floats, Floats]],
        random: np.random.Generator,
    ) -> list[Floats]:  # fmt: skip
        """The network after learning from all rounds; half of every batch is mirrored.

        Args:
            layers: The network before.
            rounds: What was seen, scaled, and what is to be done.
            random: What batches are drawn from.
        """
        config = self.config
        seen, told = (np.concatenate(each) for each in zip(*rounds, strict=True))
        tensors = [torch.tensor(each, requires_grad=True) for each in layers]
        adam = torch.optim.Adam(tensors, lr=config.learning_rate)
        fall = _LAST ** (1.0 / config.gradient_steps)
        slower = torch.optim.lr_scheduler.ExponentialLR(adam, fall)
        half = config.batch_size // 2 if self.mirrored else 0
        for _ in range(config.gradient_steps):
            drawn = random.integers(len(seen), size=config.batch_size)
            x, y = seen[drawn], told[drawn]
            if half:
                x[:half] = self.observation.mirrored(x[:half])
                y[:half] = self.action.mirrored(y[:half])
            h = torch.from_numpy(x)
            for k in range(0, len(tensors), 2):
                h = torch.nn.functional.linear(h if k == 0 else torch.relu(h), *tensors[k : k + 2])
            loss = torch.square(torch.tanh(h) - torch.from_numpy(y)).mean()
            adam.zero_grad()
            loss.backward()
            adam.step()
            slower.step()
        return [each.detach().numpy().copy() for each in tensors]

    def network(self, layers: list[Floats]) -> Network:
        """The network as it acts."""
        n = self.observation.size
        return Network(
            weights=tuple(layers[::2]), biases=tuple(layers[1::2]), mean=np.zeros(n),
            var=np.ones(n), clip=None, epsilon=0.0, activation="relu", squash="tanh",
            units=self.observation.units,
        )  # fmt: skip

    def explain(self, folder: RunFolder, state: Mapping[str, Any]) -> SavedPolicy:
        """Writes what follows from a state: the curve and the policy, which it returns."""
        rows = state["rows"]
        write_csv(folder.path / CURVE, rows)
        saved = SavedPolicy(
            task=self.config.task, network=self.network(state["layers"]), made_for=self.made_for,
            arguments=self.arguments,
            origin=folder.origin("dagger", len(rows) * self.size, self.source),
        )  # fmt: skip
        saved.save(folder.path / POLICY)
        return saved

    def close(self) -> None:
        """Ends the tasks."""
        for tasks in self.vectors:
            tasks.close()


def _unscaled(name: str, part: Mapping[str, Any]) -> dict[str, Any]:
    """A part of a contract; of rows size and unit, for a network scales by itself."""
    rows = name in ("observation", "action")
    return {key: value[:2] if rows else value for key, value in part.items()}

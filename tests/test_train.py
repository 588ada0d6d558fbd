"""Training by Stable-Baselines3: a run that was broken off ends as one that was not, to the bit."""

import csv
import os
import signal
import subprocess
import sys
import time
from contextlib import closing, suppress
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from tca_mj.agents.episode import Episode
from tca_mj.agents.policies import SavedPolicy, load_policy
from tca_mj.agents.policies.files import ResidualPolicy
from tca_mj.agents.scripts.tetrapod import GAITS, STEERING, gait_policy
from tca_mj.agents.train import config as settings
from tca_mj.agents.train import deep, gait_score
from tca_mj.agents.train.config import OffPolicy, OnPolicy, TrainConfig, default_config
from tca_mj.agents.train.deep import Run, exported, learner, train
from tca_mj.agents.train.learning_env import LearningEnv
from tca_mj.agents.train.mirrored import clock_mirror
from tca_mj.agents.train.runs import RunFolder
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.agents.train.search import SearchConfig, search
from tca_mj.cli import main
from tca_mj.envs import gaits
from tca_mj.registry import TASKS

QUICK = "TCA/MorphModule-v0"
GAIT = GAITS["walk"], (STEERING["walk"],) * 4
WALK = "TCA/TetrapodWalk-v0"
GAIT_ACTION = gaits.ACTION
REMEMBERED = OffPolicy(
    buffer_size=60, learning_starts=16, gradient_steps=1, batch_size=8, hidden=(8,), last_rate=0.5
)
LEARNERS = {
    "ppo": OnPolicy(n_steps=10, batch_size=20, n_epochs=2, hidden=(8,)),
    "sac": REMEMBERED,
    "td3": REMEMBERED,
    "tqc": REMEMBERED,
    "crossq": REMEMBERED,
}


def tiny(algorithm, **change):
    good = {"task": QUICK, "algorithm": algorithm, "learner": LEARNERS[algorithm], "steps": 120,
            "envs": 2, "interval": 20, "evaluate_every": 2, "evaluation_episodes": 1}  # fmt: skip
    return TrainConfig(**good | change)


def written(folder):
    return {name: (folder / name).read_bytes() for name in ("curve.csv", "evaluations.csv")} | {
        name: [a.tobytes() for a in SavedPolicy.read(folder / name).network.weights]
        for name in ("best.npz", "last.npz")
    }


@pytest.fixture
def quiet(without_board, monkeypatch):
    """No TensorBoard and no recordings, which take longer than the rest."""
    monkeypatch.setattr("tca_mj.agents.train.deep.record", lambda *_, **__: None)


def broken_off_after(steps, monkeypatch):
    """For each number of steps, learning ends in an interruption after so many."""
    step, left = LearningEnv.step_wait, 0

    def breaking(self):
        nonlocal left
        left -= 1
        if left < 0:
            raise KeyboardInterrupt
        return step(self)

    monkeypatch.setattr(LearningEnv, "step_wait", breaking)
    for left in steps:  # noqa: B007
        yield


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize("algorithm", LEARNERS)
def test_a_run_that_is_broken_off_ends_as_one_that_is_not(algorithm, tmp_path, monkeypatch):
    config = tiny(algorithm)
    expected = train(config, tmp_path / "whole", progress=False)
    for _ in broken_off_after((27, 17, 200), monkeypatch):  # amid intervals and episodes
        try:
            found = train(config, tmp_path / "parts", progress=False)
        except KeyboardInterrupt:
            torch.manual_seed(99)  # a new process would be elsewhere
            np.random.seed(99)
    assert written(tmp_path / "parts") == written(tmp_path / "whole")
    assert found.origin == expected.origin
    # Killed between the last state and the curve: the same command writes what was missing.
    curve = (tmp_path / "parts" / "curve.csv").read_bytes()
    (tmp_path / "parts" / "curve.csv").write_bytes(b"")
    train(config, tmp_path / "parts", progress=False)
    assert (tmp_path / "parts" / "curve.csv").read_bytes() == curve
    rows = list(csv.DictReader((tmp_path / "whole" / "curve.csv").read_text().splitlines()))
    assert [float(row["steps"]) for row in rows] == [20, 40, 60, 80, 100, 120]
    assert sum(float(row["episodes"]) for row in rows) > 3
    assert any(name.startswith("train/") for name in rows[0])


def walking(**change):
    """Settings under which the script's gait makes the first 40 steps."""
    learner = replace(REMEMBERED, learning_starts=40)
    good = {"task": WALK, "scaled": True, "mirrored": True, "start": "scripted", "steps": 80,
            "interval": 40, "learner": learner, "timestep": 0.0125,
            "arguments": {"action": "temperature", "control_period": 0.2}}  # fmt: skip
    return tiny(change.pop("algorithm", "sac"), **good | change)


@pytest.mark.usefixtures("quiet")
def test_a_gait_makes_the_first_steps(tmp_path):
    config = walking(options={"wander": 1.0}, retold=True)
    with closing(Run(config, RunFolder(tmp_path / "run", config, ""))) as run:
        run.demonstrate()
        memory, task = run.model.replay_buffer, run.env.venv.tasks.envs[0]
        assert (memory.size() * memory.n_envs, run.model.num_timesteps) == (40, 40)
        hot = GAITS["walk"].temperature(np.linspace(0.0, 1.0, 1000))
        levels = np.stack([hot.min(axis=0), hot.max(axis=0)])  # each TCA is hot or warm
        told = (memory.actions[:20] + 1.0) / 2.0 * (172.0 - 25.0) + 25.0
        off = np.abs(told[..., None, :] - levels).min(axis=-2) / ((172.0 - 25.0) / 2.0)
        assert 0.08 < off.mean() < 0.15  # noise with a spread of 0.15, cut off at 172 °C
        np.testing.assert_allclose(task.heated(task.asking(hot[0])), hot[0], rtol=1e-13)
        assert not memory._ways.any()  # the learner's episodes gain nothing from the gait's
        # In the middle of a cycle some TCAs are hot, others are not, and tasks are not in step.
        assert (memory.actions[:20].std(axis=(0, 1)) > 0.3).all()
        assert np.abs(memory.actions[0, 0] - memory.actions[0, 1]).max() > 1.0


@pytest.mark.usefixtures("quiet")
def test_a_run_from_a_gait_goes_on_as_one_that_is_not_broken_off(tmp_path, monkeypatch):
    config = walking()
    train(config, tmp_path / "whole", progress=False)
    for _ in broken_off_after((7, 33, 200), monkeypatch):  # amid the gait's steps, the learner's
        with suppress(KeyboardInterrupt):
            train(config, tmp_path / "parts", progress=False)
    assert written(tmp_path / "parts") == written(tmp_path / "whole")


@pytest.mark.usefixtures("quiet")
def test_left_and_right_are_told_the_same(tmp_path, monkeypatch):
    """The policy says so for whatever is seen; it goes on as others do."""
    config = walking(alike=True, centred=True)
    found = train(config, tmp_path / "whole", progress=False)
    source, _ = GAIT_ACTION.mirror
    random = np.random.default_rng(0)
    centre, scale = found.network.units
    for _ in range(5):
        action = found.network(centre + 0.3 * scale * random.normal(size=len(scale)))
        np.testing.assert_array_equal(action, action[source])
        assert len(set(action.tolist())) > 3  # not all of them, as some may be at their bounds
    for _ in broken_off_after((7, 33, 200), monkeypatch):
        with suppress(KeyboardInterrupt):
            train(config, tmp_path / "parts", progress=False)
    assert written(tmp_path / "parts") == written(tmp_path / "whole")


@pytest.mark.usefixtures("quiet")
def test_rewards_count_from_those_of_the_first_steps(tmp_path):
    runs = []
    for centred in (False, True):
        config = walking(alike=True, centred=centred)
        with closing(Run(config, RunFolder(tmp_path / str(centred), config, ""))) as run:
            run.demonstrate()
            memory = run.model.replay_buffer
            assert memory.actions.shape[-1] == 6
            runs.append((memory.rewards[: memory.size()].copy(), run.env.level))
            if centred:  # what the learner is told from now on, and what is noted of an episode
                one, _ = runs[0]
                assert run.env.level == pytest.approx(one.mean(), rel=1e-6) and one.std() > 0.0
                actions = np.zeros((2, 6), dtype=np.float32)
                raw = run.env.venv
                run.env.step_async(actions)
                outcome = raw.step_wait()
                raw.step_wait = lambda outcome=outcome: outcome
                told = run.env.step_wait()[1]
                assert told == pytest.approx(outcome[1] - run.env.level, abs=1e-6)
    (plain, none), (counted, level) = runs[:2]
    assert none == 0.0
    np.testing.assert_allclose(counted, plain - level, atol=1e-6)


@pytest.mark.parametrize(
    "change",
    [
        {"task": QUICK, "mirrored": False},
        {"scaled": False, "mirrored": False},
        {"arguments": {"action": "power"}},
        {"algorithm": "ppo", "learner": LEARNERS["ppo"], "mirrored": False},
    ],
)
def test_a_gait_that_cannot_make_the_first_steps_is_refused(change):
    with pytest.raises(ValueError, match=r"start|arguments\['action'\]"):
        walking(**change)


SCRIPT = """
import sys
from pathlib import Path
from tca_mj.agents.train.config import OnPolicy, TrainConfig
from tca_mj.agents.train.deep import train
train(TrainConfig(learner=OnPolicy(**eval(sys.argv[2])), **eval(sys.argv[1])), Path(sys.argv[3]))
"""


@pytest.mark.usefixtures("quiet")
def test_a_correction_of_a_gait_goes_on_too(tmp_path, monkeypatch):
    monkeypatch.setattr(gym.spec(WALK), "max_episode_steps", 7)
    config = tiny("ppo", task=WALK, steps=40, residual=10.0, start="scripted", interval=20,
                  evaluate_every=9, arguments={"action": "power"})  # fmt: skip
    train(config, tmp_path / "whole", progress=False)
    save = Run.save

    def breaking(self):
        save(self)
        raise KeyboardInterrupt

    monkeypatch.setattr(Run, "save", breaking)
    with pytest.raises(KeyboardInterrupt):
        train(config, tmp_path / "parts", progress=False)
    monkeypatch.setattr(Run, "save", save)
    train(config, tmp_path / "parts", progress=False)
    assert written(tmp_path / "parts") == written(tmp_path / "whole")
    env = gym.make(WALK, **config.arguments)
    policy = load_policy(tmp_path / "parts" / "best.npz", env)
    assert isinstance(policy, ResidualPolicy) and policy.bound == 10.0
    assert env.action_space.contains(policy.act(env.reset(seed=0)[0]))
    with pytest.raises(ValueError, match=r"holds a run with residual 10\.0, not 20\.0"):
        train(replace(config, residual=20.0), tmp_path / "parts", progress=False)
    monkeypatch.setattr("tca_mj.agents.train.search.walking", gait_score.walking.__wrapped__)
    with pytest.raises(ValueError, match=r"algorithm \w+, not cma; take another folder"):
        search(SearchConfig(task=WALK), tmp_path / "parts", progress=False)


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
def test_a_run_that_is_killed_goes_on(tmp_path):
    """By kill -9; with a recording and TensorBoard."""
    learner = {"n_steps": 5, "batch_size": 10, "n_epochs": 1, "hidden": (8,)}
    common = {"task": QUICK, "algorithm": "ppo", "steps": 30, "envs": 2, "interval": 10,
              "evaluate_every": 9, "evaluation_episodes": 1}  # fmt: skip
    config = TrainConfig(learner=OnPolicy(**learner), **common)
    out = tmp_path / "killed"
    run = subprocess.Popen([sys.executable, "-c", SCRIPT, repr(common), repr(learner), str(out)])
    deadline = time.monotonic() + 600.0  # only against hanging
    while not (out / "curve.csv").is_file():
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    train(config, out, progress=False, video=False)
    train(config, tmp_path / "whole", progress=False, video=False)
    assert written(out) == written(tmp_path / "whole")
    assert (out / "best.rrd").is_file() and not list(out.glob(".*"))
    assert list((out / "tensorboard").iterdir())


def test_tensorboard_has_every_point_once(tmp_path, monkeypatch):
    """However often the run is broken off after its state is written, before its curves are."""
    monkeypatch.setattr("tca_mj.agents.train.deep.record", lambda *_, **__: None)
    config, explain, broken = tiny("ppo"), Run.explain, []

    def breaking(self):
        if self.model.num_timesteps in (40, 80) and self.model.num_timesteps not in broken:
            broken.append(self.model.num_timesteps)
            raise KeyboardInterrupt
        explain(self)

    monkeypatch.setattr(Run, "explain", breaking)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            train(config, tmp_path, progress=False, video=False)
    train(config, tmp_path, progress=False, video=False)
    train(config, tmp_path, progress=False, video=False)  # there is nothing to do
    shown = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    for kind, name, file in (("training", "episodes", "curve.csv"),
                             ("evaluation", "return", "evaluations.csv")):  # fmt: skip
        rows = list(csv.DictReader((tmp_path / file).read_text().splitlines()))
        points = [(event.step, event.value) for event in shown.Scalars(f"{kind}/{name}")]
        assert [step for step, _ in points] == [float(row["steps"]) for row in rows]
        assert [value for _, value in points] == pytest.approx([float(r[name]) for r in rows])


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_a_film_can_be_left_for_later(tmp_path, monkeypatch, capsys):
    """Broken off it leaves what there was, and says how it is made; a new best removes it."""
    config = tiny("ppo", steps=20)
    policy = train(config, tmp_path, progress=False, video=False)
    before = contents(tmp_path)
    assert "best.rrd" in before

    class Filmed(Episode):
        def run(self, limit, *, speed, progress):
            self.env.close()
            (self.out / "rollout.mp4").write_bytes(b"half")
            if stop:
                raise KeyboardInterrupt
            return {"files": ["rollout.mp4"]}

    monkeypatch.setattr(deep, "Episode", Filmed)
    stop = True
    monkeypatch.setattr(settings, "default_config", lambda *_, **__: config)
    command = ["train", QUICK, "--algo", "ppo", "--out", str(tmp_path)]
    assert main(command) == 130
    said = capsys.readouterr().err
    assert "but for its film, which the same command makes, or" in said
    assert f"tca-mj demo --policy {tmp_path} --task {QUICK}\n" in said
    noted = ("run.json", "last.npz")  # the command
    after = contents(tmp_path)
    assert after == before | {name: after[name] for name in noted}
    stop = False
    assert main(command) == 0 and (tmp_path / "best.mp4").read_bytes() == b"half"
    stop = True
    assert main(command) == 0  # it is made once
    with pytest.raises(KeyboardInterrupt):
        deep.record(config, tmp_path, policy)
    assert contents(tmp_path)["best.mp4"] == b"half" and not list(tmp_path.glob(".*"))
    monkeypatch.undo()
    deep.record(config, tmp_path, policy)  # of what may be another policy
    assert "best.mp4" not in contents(tmp_path) and not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("algorithm", LEARNERS)
def test_an_exported_network_acts_as_the_learner_does(algorithm):
    env = VecNormalize(LearningEnv(TaskVecEnv.make(QUICK, 2)), clip_obs=3.0)
    env.obs_rms.mean[:], env.obs_rms.var[:] = 0.3, 2.0
    wide = replace(LEARNERS[algorithm], hidden=(16, 16))
    model = learner(tiny(algorithm, learner=wide), env)
    network = exported(model, env, None)
    random = np.random.default_rng(0)
    for _ in range(20):
        seen = random.normal(0.0, 5.0, network.inputs).astype(np.float32)
        action, _ = model.predict(env.normalize_obs(seen[None]), deterministic=True)
        np.testing.assert_allclose(network(seen), action[0], atol=2e-6)


def test_the_residual_learner_sees_and_does_what_the_policy_will():
    """A correction of nothing is the gait; the clock starts anew with every episode."""
    told = {"max_episode_steps": 4, "action": "power"}
    env = LearningEnv(TaskVecEnv.make(WALK, 2, **told), GAIT, 20.0)
    single, script = gym.make(WALK, **told), gait_policy("walk")
    env.seed(3)
    seen = env.reset()
    observation, _ = single.reset(seed=3)
    n = len(observation)
    assert seen.shape == (2, n + 2) and env.observation_space.shape == (n + 2,)
    zero = np.zeros((2, 12), dtype=np.float32)
    for _ in range(4):
        np.testing.assert_array_equal(seen[0, :n], observation)
        angle = 2.0 * np.pi * script.cycle
        np.testing.assert_allclose(seen[0, n:], [np.sin(angle), np.cos(angle)], atol=1e-6)
        observation, *_ = single.step(script.act(observation))
        seen, _, dones, infos = env.step(zero)
    assert dones.all() and env.observation_space.contains(infos[0]["terminal_observation"])
    np.testing.assert_array_equal(infos[0]["terminal_observation"][:n], observation)
    np.testing.assert_array_equal(seen[:, n:], [[0.0, 1.0]] * 2)
    assert [row["length"] for row in env.finished] == [4.0, 4.0]
    row = env.finished[0]
    assert row["return"] == pytest.approx(sum(v for k, v in row.items() if k[:5] == "term_"),
                                          rel=1e-5)  # fmt: skip
    assert (row["success"], row["early_end"]) == (0.0, 0.0)


def test_a_gait_and_its_clock_are_the_same_in_a_mirror():
    """What a gait asks for at a phase is, in the mirror, what it asks for at the mirrored one."""
    for name, gait in GAITS.items():
        signs = np.sign(clock_mirror(gait))
        shift = 0.0 if (signs > 0).all() else 0.5
        assert (np.abs(clock_mirror(gait)) == [1, 2]).all() and abs(signs.sum()) == 2, name
        for phase in (0.0, 0.13, 0.77):
            swapped = GAIT_ACTION.mirrored(gait.temperature(phase))
            np.testing.assert_allclose(gait.temperature(phase + shift), swapped, atol=1e-9)
    askew = replace(GAITS["walk"], offset=(0.0, 0.4, 0.7, 0.2))
    assert clock_mirror(askew) == ()


@pytest.mark.usefixtures("quiet")
def test_corrections_of_held_temperatures_are_learned_with_mirrored_memories(tmp_path, monkeypatch):
    """What is learned acts as the learner did: on what is seen, the clock and the gait."""
    monkeypatch.setattr(gym.spec(WALK), "max_episode_steps", 70)
    config = default_config(WALK, "sac", residual=30.0, steps=32, interval=32, envs=2,
                            evaluation_episodes=1)  # fmt: skip
    config = replace(config, learner=replace(config.learner, learning_starts=8, batch_size=16))
    assert config.mirrored and config.scaled and config.arguments["action"] == "temperature"
    train(config, tmp_path, progress=False)
    run = Run(config, RunFolder(tmp_path, config, ""))
    memory = run.model.replay_buffer
    assert memory._tables[0].size == run.test_env.observation_space.shape[0] + 2
    policy = run.policy().make(run.test_env)
    observation, _ = run.test_env.reset(seed=0, options=config.options)
    policy.reset()
    run.env.seed(0)
    told, _ = run.model.predict(run.env.reset(), deterministic=True)
    sent = []
    monkeypatch.setattr(run.env.venv, "step_async", sent.append)
    run.env.step_async(told)
    np.testing.assert_allclose(sent[0][0], policy.act(observation), atol=2e-5)
    run.close()


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize(
    ("task", "algorithm"),
    [*((task.id, "ppo") for task in TASKS), (QUICK, "sac"), (QUICK, "td3")],
)
def test_every_task_has_a_default(task, algorithm, tmp_path):
    config = default_config(task, algorithm, seed=4, envs=1)
    assert config.seed == 4 and config.task == task
    run = Run(config, RunFolder(tmp_path, config, ""))
    action = run.policy().make(run.test_env).act(
        run.test_env.reset(seed=0, options=dict(config.options))[0]
    )
    assert run.test_env.action_space.contains(action)
    run.close()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": "Ant-v5"}, "task must be a SimulatedTask, got 'Ant-v5'"),
        ({"algorithm": "dqn"}, "algorithm must be one of"),
        ({"algorithm": "sac"}, "learner must be OffPolicy, got OnPolicy"),
        ({"steps": 0}, "steps must be"),
        ({"residual": 110.0}, "residual must be finite and at least 0 and at most 100 K"),
        ({"residual": 10.0}, "which has no gait"),
        ({"centred": True}, "centred must be False where no gait makes the first steps"),
        ({"alike": True}, "alike must be False where memories are not mirrored"),
    ],
)
def test_impossible_settings_are_refused(change, message):
    good = {"task": QUICK, "algorithm": "ppo", "learner": OnPolicy()}
    TrainConfig(**good)
    with pytest.raises(ValueError, match=message):
        TrainConfig(**good | change)


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        (OnPolicy, {"gamma": 1.1}, "gamma must be finite and above 0"),
        (OnPolicy, {"n_steps": 0}, "n_steps must be"),
        (OffPolicy, {"hidden": ()}, "hidden must be 1 to 16 widths"),
        (OffPolicy, {"tau": 0.0}, "tau must be"),
    ],
)
def test_impossible_learners_are_refused(kind, change, message):
    with pytest.raises(ValueError, match=message):
        kind(**change)


def test_the_command_makes_the_settings(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(
        "tca_mj.agents.train.deep.train",
        lambda config, out, *, command, video: asked.append((config, out, command)),
    )
    filmed = []
    monkeypatch.setattr("tca_mj.agents.train.deep.film", lambda _, out: filmed.append(out.name))
    out = ["--out", str(tmp_path)]
    arguments = ["train", WALK, "--algo", "ppo", "--residual", "15", "--envs", "3", "--seeds", "2"]
    assert main([*arguments, "--steps", "5000", *out]) == 0
    assert filmed == ["seed_0", "seed_1"]
    assert main([*arguments, "--steps", "5000", *out, "--no-video"]) == 0 and len(filmed) == 2
    (first, folder, command), (second, *_) = asked[:2]
    assert first == settings.default_config(
        WALK, "ppo", residual=15.0, envs=3, steps=5000, seed=0, start="scripted"
    )
    assert second.seed == 1 and folder == tmp_path / "seed_0"
    assert command.startswith(f"tca-mj train {WALK} --algo ppo")
    assert main(["train", QUICK, "--algo", "sac", "--residual", "15", *out]) == 2

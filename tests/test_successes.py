"""What a script did with success: half of each batch is from there, and it is imitated."""

from contextlib import closing, suppress
from dataclasses import replace

import numpy as np
import pytest
import torch
from gymnasium import spaces
from test_train import broken_off_after

from tca_mj.agents.policies import SavedPolicy, load_policy
from tca_mj.agents.train.config import OffPolicy, TrainConfig, default_config
from tca_mj.agents.train.deep import Run, train
from tca_mj.agents.train.runs import RunFolder
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.agents.train.successes import SuccessReplayBuffer
from tca_mj.registry import TASKS, make, recipes

ARM = "TCA/ArmPickPlace-v0"
GAMMA, STEPS = 0.9, 3


def memory(**change):
    box = spaces.Box(-1.0, 1.0, (2,), np.float32)
    given = {"n_envs": 2, "n_steps": STEPS, "gamma": GAMMA}
    return SuccessReplayBuffer(50, box, spaces.Box(-1.0, 1.0, (1,), np.float32), **given | change)


def lived(buffer, length=5):
    """Two episodes side by side: what is seen and done counts up, the second one succeeds."""
    for k in range(length):
        last = k == length - 1
        seen = np.array([[k, 0.0], [k, 1.0]], np.float32)
        buffer.add(
            seen, seen + [[1.0, 0.0]], np.array([[k], [10 + k]], np.float32),
            np.array([k, 100.0 + k]), np.array([last, last]),
            [{"success": False, "TimeLimit.truncated": last}, {"success": last}],
        )  # fmt: skip


def test_half_of_a_batch_is_what_the_script_did_with_success():
    buffer = memory()
    buffer.begin(showing=True)
    lived(buffer)
    buffer.begin()
    assert (buffer.size(), buffer.shown) == (10, 5)
    lived(buffer)  # what a learner does is not shown: it is not quicker
    assert (buffer.size(), buffer.shown) == (20, 5)
    np.random.seed(0)
    batch = buffer.sample(64)
    which = batch.observations[:, 1].numpy()
    assert (which[:32] == 1.0).all() and 0.2 < which[32:].mean() < 0.8
    assert set(batch.actions[:32, 0].tolist()) == {10.0, 11.0, 12.0, 13.0, 14.0}


def test_quicker_episodes_take_the_place_of_the_scripts_where_nearly_all_succeed():
    buffer = memory(n_envs=2, kind="object", steady=True)

    def lived(success, kind, length, mark):
        """In the second environment; in the first, with noise, what is quickest counts nothing."""
        for k in range(length):
            last = k == length - 1
            seen = np.array([[0.4] * 2, [mark] * 2], np.float32)
            infos = [{"success": not buffer.showing, "object": kind},
                     {"success": success and last, "object": kind}]  # fmt: skip
            buffer.add(seen, seen, seen[:, :1], np.zeros(2), np.array([True, last]), infos)

    def marks(kind):
        shelf = buffer.examples[kind].shelf
        return sorted(shelf.rows[: shelf.size, 0].tolist())

    buffer.begin(showing=True)
    for kind in ("board", "tool"):
        for _ in range(2):
            lived(True, kind, 6, 0.0)
        lived(False, kind, 6, 0.0)
    buffer.begin()
    for n in range(19):
        lived(True, "board", 3, 0.5)
        lived(n % 4 > 0, "tool", 3, 0.5)
    assert marks("board") == marks("tool") == [0.0] * 12  # too few to know
    lived(True, "board", 7, 0.6)
    assert marks("board") == [0.0] * 12  # slower
    lived(True, "board", 5, 0.7)
    lived(True, "tool", 5, 0.7)
    assert marks("board") == [0.0] * 7 + [buffer.to_torch(np.float32(0.7)).item()] * 5
    assert marks("tool") == [0.0] * 12  # a quarter failed: luck
    assert buffer.examples["board"].lengths == [6, 5]
    for _ in range(20):
        lived(False, "board", 3, 0.8)
    lived(True, "board", 3, 0.9)
    assert 0.9 not in np.round(marks("board"), 3)  # not safe any more


def test_if_nothing_has_succeeded_a_batch_is_of_all_memories():
    buffer = memory(n_envs=1)
    buffer.begin(showing=True)
    for k in range(4):
        seen = np.full((1, 2), k, np.float32)
        ended = np.array([k == 3])
        buffer.add(seen, seen + 1.0, seen[:, :1], np.zeros(1), ended, [{"success": False}])
        assert buffer.size() == (4 if k == 3 else 0)  # when it is over
    assert buffer.sample(6).observations.shape == (6, 2)


def test_a_memory_tells_what_some_steps_have_earned():
    buffer = memory()
    lived(buffer)
    batch = buffer.parts(buffer.lived.rows[: buffer.size()])
    for seen, after, done, reward, discount in zip(
        batch.observations.numpy(), batch.next_observations.numpy(), batch.dones[:, 0].tolist(),
        batch.rewards[:, 0].tolist(), batch.discounts[:, 0].tolist(), strict=True,
    ):  # fmt: skip
        k, success = int(seen[0]), seen[1] == 1.0
        told = range(k, min(k + STEPS, 5))
        assert reward == pytest.approx(sum(GAMMA**(j - k) * (j + 100.0 * success) for j in told))
        assert discount == pytest.approx(GAMMA ** len(told))
        assert after.tolist() == [told[-1] + 1.0, seen[1]]
        # Who ran out of time could have gone on.
        assert done == float(success and told[-1] == 4)


def tiny(**change):
    """The recipe, so small that it ends within seconds: an episode is cut off after 0.6 s."""
    config = default_config(ARM, envs=2)
    learner = replace(
        config.learner, learning_starts=8, gradient_steps=2, batch_size=8, hidden=(8,),
        buffer_size=60,
    )  # fmt: skip
    given = {"learner": learner, "steps": 20, "interval": 10, "evaluation_episodes": 1,
             "limit": 0.6}  # fmt: skip
    return replace(config, **given | change)


@pytest.fixture
def quick(without_board, monkeypatch):
    """No recordings, a short warm-up, and what is cut off has succeeded, so that it is imitated."""
    monkeypatch.setattr("tca_mj.agents.train.deep.record", lambda *_, **__: None)
    monkeypatch.setattr("tca_mj.agents.train.deep._WARM_UP", 3)
    add = SuccessReplayBuffer.add

    def pleased(self, obs, next_obs, action, reward, done, infos):
        infos = [{**info, "success": True} for info in infos]
        add(self, obs, next_obs, action, reward, done, infos)

    monkeypatch.setattr(SuccessReplayBuffer, "add", pleased)


def written(folder):
    return {name: (folder / name).read_bytes() for name in ("curve.csv", "evaluations.csv")} | {
        name: [a.tobytes() for a in SavedPolicy.read(folder / name).network.weights]
        for name in ("best.npz", "last.npz")
    }


@pytest.mark.usefixtures("quick")
def test_every_second_environment_is_driven_by_the_mean_without_noise(tmp_path):
    config = tiny(envs=4)
    config = replace(config, learner=replace(config.learner, steady=True))
    run = Run(config, RunFolder(tmp_path, config, ""))
    model = run.model
    model._last_obs = np.random.default_rng(0).normal(size=(4, 50)).astype(np.float32)
    model.averaged = {name: row * 0.9 for name, row in model.actor.state_dict().items()}
    model.num_timesteps = 8
    first, told = model._sample_action(8, None, 4)
    again, _ = model._sample_action(8, None, 4)
    assert (first == told).all()
    assert (first[1::2] == again[1::2]).all() and (first[::2] != again[::2]).any(axis=1).all()
    with model.at_its_mean():
        mean, _ = model.predict(model._last_obs, deterministic=True)
    np.testing.assert_array_equal(first[1::2], mean[1::2])
    model.steady = False
    first, again = (model._sample_action(8, None, 4)[0] for _ in range(2))
    assert (first != again).any(axis=1).all()
    run.close()


@pytest.mark.usefixtures("quick")
def test_a_run_that_is_broken_off_ends_as_one_that_is_not(tmp_path, monkeypatch):
    config = tiny()
    saved = train(config, tmp_path / "whole", progress=False, video=False)
    rows = (tmp_path / "whole" / "evaluations.csv").read_text().splitlines()
    assert [row.split(",")[0] for row in rows] == ["steps", "8.0", "20.0"]  # imitation, the end
    assert saved.arguments == {"action": "temperature", "control_period": 0.2, "offsets": True}
    env = make(ARM, **saved.arguments)
    policy = load_policy(tmp_path / "whole" / "best.npz", env)
    assert env.action_space.contains(policy.act(env.reset(seed=0)[0]))
    env.close()
    for _ in broken_off_after((2, 7, 100), monkeypatch):  # amid the script's steps, an interval
        with suppress(KeyboardInterrupt):
            train(config, tmp_path / "parts", progress=False, video=False)
        torch.manual_seed(99)  # a new process would be elsewhere
        np.random.seed(99)
    assert written(tmp_path / "parts") == written(tmp_path / "whole")


@pytest.mark.usefixtures("quick")
def test_the_script_makes_the_first_steps_and_is_imitated(tmp_path):
    """After a warm-up the policy does in what it has seen what the script did there."""
    config = tiny(learner=replace(tiny().learner, learning_starts=60, batch_size=128))
    with closing(Run(config, RunFolder(tmp_path, config, ""))) as run:
        assert not any(isinstance(m, torch.nn.LayerNorm) for m in run.model.actor.modules())
        assert sum(isinstance(m, torch.nn.LayerNorm) for m in run.model.critic.modules()) == 4
        run.demonstrate()
        model = run.model
        memory = model.replay_buffer
        assert set(memory.examples) == {"pcb", "screwdriver"} and not memory.showing
        rows = [each.shelf.rows[: each.shelf.size] for each in memory.examples.values()]
        batch = memory.parts(np.concatenate(rows))
        assert len(batch.actions) == memory.shown > 0
        assert (batch.dones == 0.0).all()  # the script is under way when time is up

        def off():
            own = model.actor(batch.observations, deterministic=True)
            return float(((own - batch.actions) ** 2).mean().detach())

        before = off()
        model.warm_up(400)
        assert off() < 0.3 * before
        model.train(20, 8)
        mean, now = model.averaged["mu.weight"], model.actor.mu.weight
        assert not torch.equal(mean, now)
        np.testing.assert_array_equal(run.policy().network.weights[-1], mean.numpy())
        assert torch.equal(now, model.actor.mu.weight)  # writing a policy changes nothing
    opened = batch.actions[:, 4] > -1.0
    assert float(opened.float().mean()) > 0.8  # the script heats the gripper from the start


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scaled": False}, "successes must be False but for SAC"),
        ({"algorithm": "td3"}, "successes must be False but for SAC"),
        ({"successes": False}, "learner.imitation must be 0 without successes, got 10"),
        ({"start": "random"}, "successes must be False where no script is shown"),
        ({"start": "trot"}, "start must be 'random' but for a task with legs"),
        ({"limit": 0.0}, "limit must be finite and above 0"),
        ({"arguments": {"action": "power"}}, r"arguments\['action'\] must be 'temperature'"),
    ],
)
def test_impossible_settings_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(default_config(ARM), **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_steps": 0}, "n_steps must be"),
        ({"imitation": -1.0}, "imitation must be"),
        ({"last_imitation": 1.5}, "last_imitation must be"),
        ({"critics": 1}, "critics must be"),
        ({"target_entropy": "auto_1"}, "target_entropy must be"),
    ],
)
def test_impossible_learners_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        OffPolicy(**change)


def test_more_than_two_critics_are_of_learners_that_are_shown_something():
    with pytest.raises(ValueError, match="learner.critics must be 2 without successes, got 4"):
        TrainConfig(
            task="TCA/TetrapodWalk-v0", algorithm="sac", learner=OffPolicy(critics=4), scaled=True
        )


def test_several_steps_are_told_by_unmirrored_memories_only():
    with pytest.raises(ValueError, match="learner.n_steps must be 1"):
        TrainConfig(
            task="TCA/TetrapodWalk-v0", algorithm="sac", learner=OffPolicy(n_steps=2), scaled=True,
            mirrored=True,
        )  # fmt: skip


def test_every_third_environment_practises():
    tasks = TaskVecEnv.make(ARM, 4, max_episode_steps=1)
    tasks.practised = {"object": "pcb", "object_yaw": 2.2}
    tasks.seed(0)
    tasks.reset()
    still = np.tile(tasks.tasks.envs[0].action.still, (4, 1))
    for _ in range(2):  # also in the episodes that follow
        yaws = [float(np.arctan2(*env.seen()[[32, 29]]) * 2.0) for env in tasks.tasks.envs]
        assert [abs(yaw - 2.2) < 1e-5 for yaw in yaws] == [True, False, False, True]
        assert [tasks.tasks.envs[i].object for i in (0, 3)] == ["pcb", "pcb"]
        tasks.step(still)
    tasks.close()


def test_cases_of_recipes_are_options_of_their_tasks():
    """A case with a slip would be passed over in silence."""
    found = [
        (task.id, *case.split("=")) for task in TASKS
        for recipe in recipes(task.id).values() for case in recipe.alone
    ]  # fmt: skip
    assert found
    for id, name, value in found:
        env = make(id, disable_env_checker=True)
        setup = env.unwrapped.options.setup(np.random.default_rng(0), {name: value})
        assert str(setup[name]) == value
        env.close()


def test_a_recipe_has_settings_of_its_own_for_one_object():
    both = default_config(ARM)
    tool = default_config(ARM, options={"object": "screwdriver"})
    board = default_config(ARM, options={"object": "pcb"}, steps=500)
    assert (tool.learner.last_imitation, both.learner.last_imitation) == (0.6, 0.3)
    assert replace(tool.learner, last_imitation=0.3, gamma=both.learner.gamma) == both.learner
    assert (board.learner.steady, tool.learner.steady, both.learner.steady) == (True, False, False)
    assert [c.learner.gamma for c in (tool, board)] == pytest.approx([0.93**0.2, 0.9**0.2])
    assert (board.steps, tool.steps, both.steps) == (500, 24_000, 30_000)  # what is asked for wins


def test_what_a_run_is_asked_for_is_not_practised_otherwise():
    config = default_config(ARM, options={"object": "pcb"})
    assert config.practised == {} and default_config(ARM).practised == {"object": "screwdriver"}
    tasks = TaskVecEnv.make(ARM, 4, reset_options=dict(config.options))
    tasks.practised = dict(config.practised)
    tasks.seed(0)
    tasks.reset()
    assert [env.object for env in tasks.tasks.envs] == ["pcb"] * 4
    tasks.close()
    with pytest.raises(ValueError, match=r"options\['friction'\] must be a number or a text"):
        default_config(ARM, options={"friction": None})

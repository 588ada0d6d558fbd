"""Memories: mirrored they are what the other side would have lived through; told with other
commands, what would have been seen and earned under those."""

import math

import numpy as np
import pytest
import torch

from tca_mj.agents.train.mirrored import MirroredReplayBuffer, mirrored_memory
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.envs import TetrapodGait
from tca_mj.envs.command import LEASH, Command, Following, Retelling
from tca_mj.envs.gaits import ACTION, OBSERVATION, TASKS

WALK = TASKS["walk"]
RETELLING = Retelling(OBSERVATION, WALK.speed, WALK.fastest, (), 0.3)


class Chosen:
    """A generator that draws what is wanted."""

    def __init__(self, turn, told, tilt, lead, aside):
        self.uniforms = [turn, 0.0 if math.isinf(told) else 1.0, 0.0 if math.isinf(told) else told]
        self.normals = [tilt, lead, aside]

    def uniform(self, *_, size=None):
        return np.full(1, self.uniforms.pop(0))

    def normal(self, *_):
        return np.full(1, self.normals.pop(0))


def seen_by(following, yaw):
    """What a robot that looks to ``yaw`` sees of its commands, scaled; the rest is 0."""
    course = following.course - yaw
    values = {entry.name: np.full(entry.size, entry.centre) for entry in OBSERVATION.entries}
    values |= {
        "commanded direction": [math.cos(course), math.sin(course)],
        "commanded speed": min(following.command.speed, WALK.fastest),
        "lead": following.lead,
        "way aside": following.aside,
        "commanded turning": following.command.turning,
        "heading error": following.error,
    }
    return OBSERVATION.scaled(OBSERVATION.pack(values))


@pytest.mark.parametrize("told", [math.inf, 5e-3, 0.0])
@pytest.mark.parametrize("turning", [0.0, 0.04])
def test_a_memory_told_anew_is_what_would_have_been(told, turning):
    """Exactly, for a robot that went the same way under the other command."""
    yaw, turn, tilt, lead, aside = 0.2, 2.1, -0.15, 0.004, -0.007
    lead = 0.0 if math.isinf(told) else lead
    lived = Following(Command(0.4, 3e-3, turning), heading=0.1, error=-0.1, aside=0.003, lead=0.001)
    other = Following(
        Command(0.4 + turn - tilt, told, turning), heading=0.1 + tilt, error=-0.1 + tilt,
        aside=aside, lead=lead,
    )  # fmt: skip
    x, y, later = 2.2e-3, -1.3e-3, yaw + 0.05
    after = lived.moved(x, y, later, 0.3)
    expected = other.moved(x, y, later, 0.3)
    paid = sum(after.earned(lived, WALK.speed).values())
    notes = [after.along - lived.along, after.across - lived.across, paid]
    before, then, reward = RETELLING.told(
        seen_by(lived, yaw)[None], seen_by(after, later)[None], np.array([paid - 0.03]),
        np.array([notes]), Chosen(turn, told, tilt, lead, aside),
    )  # fmt: skip
    np.testing.assert_allclose(before[0], seen_by(other, yaw), atol=1e-5)
    np.testing.assert_allclose(then[0], seen_by(expected, later), atol=1e-5)
    earned = sum(expected.earned(other, WALK.speed).values()) - 0.03
    assert reward[0] == pytest.approx(earned, abs=1e-6)
    assert expected.lead > -LEASH


@pytest.fixture(scope="module")
def tasks():
    made = TaskVecEnv.make(
        "TCA/TetrapodWalk-v0", 2, scaled=True, control_period=0.2, max_episode_steps=3,
        timestep=0.01, reset_options={"wander": 1.0},
    )  # fmt: skip
    made.seed(0)
    yield made
    made.close()


def filled(tasks, **more):
    """A buffer with six steps, the third of which ends an episode; and the steps."""
    buffer = MirroredReplayBuffer(
        8, tasks.observation_space, tasks.action_space, n_envs=2, device="cpu",
        handle_timeout_termination=True, **mirrored_memory(tasks, **more)["replay_buffer_kwargs"],
    )  # fmt: skip
    random, seen, lived = np.random.default_rng(0), tasks.reset(), []
    for _ in range(3):
        action = random.uniform(-1.0, 1.0, (2, ACTION.size)).astype(np.float32)
        after, reward, done, infos = tasks.step(action)
        pairs = zip(infos, after, strict=True)
        last = [info.get("terminal_observation", row) for info, row in pairs]
        lived += [*zip(seen, action, last, reward, strict=True)]
        buffer.add(seen, np.stack(last), action, reward, done, infos)
        seen = after
    return buffer, lived


def test_half_of_a_batch_is_mirrored_and_all_of_it_was_lived(tasks):
    buffer, lived = filled(tasks)
    np.random.seed(0)
    batch = buffer.sample(64)
    sides = 0
    for i in range(64):
        row = [part[i].numpy() for part in (batch.observations, batch.actions,
                                            batch.next_observations)]  # fmt: skip
        if i < 32:
            tables = OBSERVATION, ACTION, OBSERVATION
            row = [table.mirrored(part) for table, part in zip(tables, row, strict=True)]
        reward = batch.rewards[i, 0].item()
        found = [
            all(np.array_equal(a, b) for a, b in zip(row, one[:3], strict=True))
            and reward == np.float32(one[3])
            for one in lived
        ]
        assert sum(found) == 1
        sides += i < 32
    assert sides == 32 and (batch.dones == 0.0).all()  # time was up, nothing ended


def test_who_is_told_the_same_on_both_sides_keeps_that_in_the_mirror(tasks):
    settings = mirrored_memory(tasks, alike=True)["replay_buffer_kwargs"]
    told = np.random.default_rng(0).uniform(-1.0, 1.0, 6)
    np.testing.assert_array_equal(settings["action"].mirrored(told), told)
    assert settings["observation"] is tasks.tasks.envs[0].observation


def test_retold_memories_keep_what_was_done_and_come_from_the_seed(tasks):
    buffer, lived = filled(tasks, retold=True, seed=5)
    again, _ = filled(tasks, retold=True, seed=5)
    again._notes[:], again._random = buffer._notes, np.random.default_rng(5)
    buffer._random = np.random.default_rng(5)
    for name in ("observations", "next_observations", "actions", "rewards"):
        getattr(again, name)[:] = getattr(buffer, name)
    batches = []
    for each in (buffer, again):
        np.random.seed(1)
        batches.append(each.sample(50))
    assert all(torch.equal(a, b) for a, b in zip(*batches, strict=True) if a is not None)
    own = slice(0, OBSERVATION.slices["commanded direction"].start)
    states = {one[0][own].tobytes() for one in lived}
    source, sign = OBSERVATION.ends
    told = [row[source] * sign if i % 2 == 0 else row
            for i, row in enumerate(batches[0].observations.numpy())]  # fmt: skip
    told = [OBSERVATION.mirrored(row) if i < 25 else row for i, row in enumerate(told)]
    assert all(row[own].tobytes() in states for row in told)
    directions = {row[OBSERVATION.slices["commanded direction"]].tobytes() for row in told}
    assert len(directions) >= 40  # four of five are new ones


def test_what_cannot_be_mirrored_or_told_is_refused(tasks):
    plain = TaskVecEnv.make("TCA/TetrapodWalk-v0", 1)
    with pytest.raises(ValueError, match="tasks must give scaled observations"):
        mirrored_memory(plain)
    arm = TaskVecEnv.make("TCA/ArmPickPlace-v0", 1, scaled=True)
    with pytest.raises(ValueError, match="tasks must know a mirror"):
        mirrored_memory(arm)


def test_the_shimmy_is_only_told_to_go_back_or_forth():
    task = TetrapodGait(gait="shimmy")
    n = 20
    seen = np.tile(task.observation.scaled(task.reset(seed=0)[0]), (n, 1))
    before, *_ = task.retelling.told(seen, seen, np.zeros(n), np.zeros((n, 3)),
                                     np.random.default_rng(0))  # fmt: skip
    rows = task.observation.read(before)["commanded direction"]
    assert {tuple(row) for row in np.round(rows, 1).tolist()} == {(1.0, 0.0), (-1.0, 0.0)}

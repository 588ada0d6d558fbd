"""``TCA/Jump-v0``: that it jumps, what its height depends on, and where the energy goes."""

from dataclasses import replace

import numpy as np
import pytest

from tca_mj.agents.scripts.jump import JumpPolicy
from tca_mj.envs.jump import ACTION, OBSERVATION, Jump
from tca_mj.robots.jumper import JumperSpec
from tca_mj.sim import Drive, Haste
from tca_mj.validation.jumping import NOMINAL, balance, jumped, jumper_with
from tca_mj.validation.pulses import JUMP, endured

OFF = np.full(ACTION.size, -1.0, np.float32)


@pytest.fixture(scope="module")
def shared():
    """One environment for the tests that reset it."""
    return Jump()


def played(env, seed, **options):
    """Last information of an episode of the script, and what it returned."""
    policy, total = JumpPolicy(), 0.0
    observation, info = env.reset(seed=seed, options=options)
    for _ in range(150):
        observation, reward, terminated, truncated, info = env.step(policy.act(observation))
        total += reward
        if terminated or truncated:
            break
    return info, total


def test_it_rests_as_an_arch_in_state_1(shared):
    observation, info = shared.reset(seed=0)
    rows = OBSERVATION.read(observation)
    first = shared.jumper_spec.module.rod.states()[0]
    assert rows["bend"] == pytest.approx(first, abs=0.1) and abs(rows["rate of bend"]) < 0.05
    assert info["time"] == 0.0 and info["energy"].sum() == 0.0 and not info["jumped"]
    for _ in range(10):
        observation, reward, *_ = shared.step(OFF)
    rows = OBSERVATION.read(observation)
    assert rows["bend"] == pytest.approx(first, abs=0.1) and abs(rows["height"]) < 2e-4
    # It stands on its ends.
    touching = {int(c.geom[1]) for c in shared.data.contact if c.dist < 1e-4}
    names = {shared.model.geom(i).name.split(".rib")[-1] for i in touching}
    assert names == {"0", str(shared.jumper_spec.module.nodes)}


@pytest.mark.parametrize("seed", range(10))
def test_it_jumps(shared, seed):
    """On every seed, with friction and mass 20 % off, and with no TCA hotter than is safe."""
    info, total = played(shared, seed, randomise=0.2, tca_gain=1.0, heat_loss=1.0, ambient=25.0)
    assert info["success"] and info["height"] > 30e-3
    assert info["temperature"].max() < shared.safe_temperature
    assert total == pytest.approx(100.0 * info["height"] - 0.1 * info["energy"].sum())


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_the_height_does_not_depend_on_the_steps(shared, share):
    """Of physics and TCA alike, also while it snaps."""
    height = jumped(shared, **NOMINAL)["height"]
    assert height == pytest.approx(jumped(jumper_with(share), **NOMINAL)["height"], rel=0.03)


def test_more_damping_is_a_lower_jump(shared):
    """The height is a fit: this is to what."""
    spec = JumperSpec()
    dull = replace(spec, module=replace(spec.module, damping_time=4e-3))
    assert played(Jump(jumper_spec=dull), 0)[0]["height"] < 0.7 * played(shared, 0)[0]["height"]


def test_the_energy_of_the_snap_is_accounted_for():
    """What spring, band, weight and motion lose is what damping, ground and TCA take."""
    found = balance()
    assert found.lost > 7e-3  # [J]; a jump of 70 mm is 0.8
    assert abs(found.error) < 0.03 and found.kept > 0.0 and found.taken > 0.5 * found.lost


def test_the_published_pulse_is_longer_than_is_safe():
    """2.5 A for 0.3 s; what is safe is more than the robot needs."""
    found = endured(JUMP)
    assert found.alone > found.inside > Jump.max_temperature
    assert found.over < found.safe_inside < JUMP.seconds and found.safe_alone < found.safe_inside
    # The lone TCA by hand: I² R t/C, 6.7 ohm/dm.
    heat = Jump(action="power").heat
    assert found.alone - 25.0 == pytest.approx(
        2.5**2 * 0.3 * 67.0 * 0.094 / float(heat.capacity[0]), rel=0.02
    )


def test_a_batch_snaps_like_one(shared):
    """What snaps leaves the common course of a batch, and goes where it goes alone."""
    from tca_mj.batch import SimulationBatch

    alone, left, right = (Jump(action="power") for _ in range(3))
    for env in (alone, left, right):
        env.reset(seed=3)
    batch, told = SimulationBatch([left.sim, right.sim]), np.array([40.0])
    hurried = False
    for _ in range(25):
        alone.sim.step(told, 1e-2)
        batch.step([Drive(command=told), Drive(command=0.0 * told)], 1e-2)
        hurried |= alone.sim.snaps(alone.data.qvel)
        assert left.data.qpos.tobytes() == alone.data.qpos.tobytes()
    assert hurried and left.bent() > 1.5 and right.bent() < 0.0


def test_a_state_before_the_snap_leads_to_the_same_jump(shared):
    """Haste keeps nothing of its own, and leaves the model's steps as they were."""
    shared.reset(seed=4)
    own = shared.model.opt.timestep, shared.model.opt.integrator
    while shared.bent() < -0.8:
        shared.step(-OFF)
    state, ends = shared.get_state(), []
    for _ in range(2):
        shared.set_state(state)
        for _ in range(4):
            shared.step(-OFF)
        ends.append(shared.data.qpos.tobytes())
    assert ends[0] == ends[1] and shared.bent() > 0.5
    assert (shared.model.opt.timestep, shared.model.opt.integrator) == own


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"timestep": 3e-4}, "tca_period must be a positive multiple of timestep 0.0003"),
        ({"haste": Haste(speed=1.0, timestep=1e-4, tca_period=3e-3)},
         "tca_period must be a positive multiple of haste.tca_period 0.003"),
        ({"camera": "top"}, "camera must be one of"),
    ],
)  # fmt: skip
def test_bad_arguments_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        Jump(**given)

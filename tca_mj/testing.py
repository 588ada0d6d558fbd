"""What every task has to keep, as checks that run on any of them, also outside this package.

    from tca_mj.testing import check_task
    check_task("my_robots:Mine/Reach-v0")

Each check of ``CHECKS`` takes an id and raises an ``AssertionError`` that says what is not kept.
"""

import hashlib
import math
import pickle
import subprocess
import sys
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

from tca_mj.envs.vector import TaskVector
from tca_mj.record.render import RenderingUnavailable
from tca_mj.registry import find_task, task_class

KEYS = {
    "time", "energy", "heater_energy", "temperature", "body_temperature", "spine_temperature",
    "extrapolated", "tension", "damaged", "variation", "success",
}  # fmt: skip
"""What every ``info`` says; after a step also ``reward_terms`` and ``cost``."""


def check_task(id: str) -> None:
    """Runs all checks on a task.

    Args:
        id: Gymnasium id, or ``module:id``.

    Raises:
        AssertionError: If one of them fails; it says which.
        ValueError: If there is no such task.
    """
    task_class(id)
    for name, check in CHECKS.items():
        try:
            check(id)
        except AssertionError as error:
            raise AssertionError(f"{id}, {name}: {error}") from error


def _task(id: str, **arguments: Any) -> Any:
    return gym.make(id, disable_env_checker=True, **arguments).unwrapped


def _actions(task: Any, steps: int, seed: int = 0) -> NDArray[np.float32]:
    """Actions of which most heat little."""
    drawn = np.random.default_rng(seed).uniform(-1.0, 0.2, (steps, *task.action_space.shape))
    return drawn.astype(np.float32)


def _rollout(task: Any, steps: int = 4, **reset: Any) -> list[Any]:
    """All that an episode returns, in a form that can be compared bit by bit."""
    found = [_bits(task.reset(**reset))]
    found += [_bits(task.step(action)) for action in _actions(task, steps)]
    return found


def _bits(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _bits(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_bits(item) for item in value]
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    return np.float64(value).tobytes() if isinstance(value, float) else value


def check_interface(id: str) -> None:
    """Gymnasium's checker, and Stable-Baselines3's where it is installed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(_task(id), skip_render_check=True)
        try:
            from stable_baselines3.common.env_checker import check_env as check_for_learners
        except ImportError:
            return
        check_for_learners(_task(id))


def check_tables(id: str) -> None:
    """Spaces are the tables; actions lie between -1 and 1; every ``info`` has its keys."""
    task = _task(id)
    assert task.observation_space == task.observation.space, "the observation is not its table"
    assert task.action_space == task.action.space, "the action is not its table"
    assert (task.action_space.low == -1.0).all() and (task.action_space.high == 1.0).all()
    observation, info = task.reset(seed=0)
    assert observation in task.observation_space, "the first observation is out of bounds"
    missing = KEYS - set(info)
    assert not missing, f"info lacks {sorted(missing)}"
    observation, *_, info = task.step(task.action.still)
    assert observation in task.observation_space, "an observation is out of bounds"
    missing = KEYS | {"reward_terms", "cost"}
    missing -= set(info)
    assert not missing, f"info lacks {sorted(missing)} after a step"
    assert info["energy"].sum() == 0.0, "the action that leaves the robot alone heats it"


def check_reward(id: str) -> None:
    """The reward is the sum of its terms, whose names are always the same; costs are none."""
    task = _task(id)
    task.reset(seed=1)
    for action in _actions(task, 10):
        before = task.energy
        _, reward, _, _, info = task.step(action)
        assert set(info["reward_terms"]) == set(task.terms), "terms are not those of the class"
        assert math.isclose(reward, sum(info["reward_terms"].values()), abs_tol=1e-12)
        assert info["cost"] >= 0.0
    joules = task.energy - before
    assert math.isclose(
        info["reward_terms"]["energy"], -task.energy_price * joules, abs_tol=1e-12
    ), "the energy is not charged as said"


def check_seeds(id: str) -> None:
    """The same seed gives the same bits after any history, another one others."""
    task, used = _task(id), _task(id)
    first = _rollout(task, seed=7)
    _rollout(used, seed=99, options={"randomise": 0.2})
    assert _rollout(used, seed=7) == first, "the same seed gives other bits after another episode"
    assert _rollout(used, seed=8) != first, "another seed gives the same episode"


def check_options(id: str) -> None:
    """An option that is given shifts no other draw; one that cannot be is refused by its name."""
    task = _task(id)

    def drawn(given: dict[str, Any]) -> dict[str, Any]:
        setup: dict[str, Any] = task.options.setup(np.random.default_rng(3), given)
        return setup

    free = drawn({})
    for row in task.options.rows:
        if free[row.name] is None or row.name.startswith("randomise"):
            continue
        told = drawn({row.name: free[row.name]})
        assert _bits(told) == _bits(free), f"giving {row.name} shifts another draw"
        for wrong in (math.nan, "nonsense", np.full((7, 7), 0.1), row.high + 1.0, row.low - 1.0):
            if isinstance(wrong, float) and math.isinf(wrong):
                continue
            try:
                task.reset(options={row.name: wrong})
            except ValueError as error:
                assert row.name in str(error), f"{error} does not name {row.name}"
            else:
                raise AssertionError(f"{row.name} = {wrong!r} is not refused")
    try:
        task.reset(options={"nonsense": 1.0})
    except ValueError as error:
        assert "nonsense" in str(error)
    else:
        raise AssertionError("an unknown option is not refused")


def check_copies(id: str) -> None:
    """A copy by pickle in the middle of an episode goes on where the original does."""
    task = _task(id)
    _rollout(task, 2, seed=2)
    copied = pickle.loads(pickle.dumps(task))
    for action in _actions(task, 3, seed=1):
        assert _bits(copied.step(action)) == _bits(task.step(action)), "a copy goes elsewhere"
    assert _bits(copied.reset()) == _bits(task.reset()), "a copy draws another episode"


def check_state(id: str) -> None:
    """From a state that it is put back to, a task goes where it went before, to the last bit."""
    task, other = _task(id), _task(id)
    task.reset(seed=2, options={"randomise": 0.2})
    for action in _actions(task, 2):
        task.step(action)
    state = task.get_state()

    def go(one: Any) -> list[Any]:
        return [_bits(one.step(a)) for a in _actions(one, 3, seed=1)] + [_bits(one.reset())]

    gone = go(task)
    task.set_state(state)
    assert go(task) == gone, "a state that was taken back leads elsewhere"
    other.reset(seed=5)
    other.set_state(state)
    assert go(other) == gone, "the state leads elsewhere in another task of the kind"


def check_vector(id: str) -> None:
    """Several tasks stepped together do what each does alone."""
    spec = find_task(id)
    together = TaskVector(task_class(id), num_envs=2, num_threads=2, **spec.kwargs)
    alone = [_task(id) for _ in range(2)]
    first, _ = together.reset(seed=[3, 4])
    for i, task in enumerate(alone):
        assert _bits(first[i]) == _bits(task.reset(seed=3 + i)[0]), "another first observation"
    for actions in _actions(together, 4):
        outcomes = together.advance(actions)
        for outcome, task, action in zip(outcomes, alone, actions, strict=True):
            assert _bits(outcome) == _bits(task.step(action)), "not what it does alone"
        if any(outcome is not None and (outcome[2] or outcome[3]) for outcome in outcomes):
            break
    together.close()


def check_actions(id: str) -> None:
    """An action of another shape, not finite or out of bounds is refused."""
    task = _task(id)
    task.reset(seed=0)
    still = task.action.still
    for wrong in (still[:-1], np.append(still, 0.0), 0.0 * still + 1.1, np.nan * still, "left"):
        try:
            task.step(wrong)
        except ValueError as error:
            assert "action must be" in str(error), error
        else:
            raise AssertionError(f"the action {wrong!r} is not refused")
    for name, argument in (("render_mode", "human"), ("camera", "nowhere"), ("size", (0, 9))):
        try:
            task_class(id)(**{**find_task(id).kwargs, name: argument})
        except ValueError as error:
            assert name in str(error), error
        else:
            raise AssertionError(f"{name} = {argument!r} is not refused")


def check_process(id: str) -> None:
    """Another process, where nothing happened before, gives the same bits."""
    text = f"from tca_mj.testing import fingerprint; print(fingerprint({id!r}))"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}; {text}"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.strip() == fingerprint(id), f"other bits in a fresh process {done.stderr}"


def fingerprint(id: str) -> str:
    """A hash of all that a short episode returns."""
    return hashlib.sha256(repr(_rollout(_task(id), seed=11)).encode()).hexdigest()


def check_control_period(id: str) -> None:
    """A step of twice the time is two steps with one action, whose rewards add up."""
    task = _task(id)
    longer = _task(id, control_period=2.0 * task.control_period)
    assert _bits(longer.reset(seed=4)[0]) == _bits(task.reset(seed=4)[0])
    for action in _actions(task, 3):
        _, first, *ended, _ = task.step(action)
        if any(ended):
            break
        observation, second, *ended, info = task.step(action)
        if any(ended):
            break
        seen, reward, *_, whole = longer.step(action)
        assert _bits(seen) == _bits(observation), "two short steps lead elsewhere"
        assert math.isclose(reward, first + second, abs_tol=1e-9), "rewards do not add up"
        assert whole["time"] == info["time"]
    try:
        _task(id, control_period=0.37 * task.interval)
    except ValueError as error:
        assert "control_period" in str(error), error
    else:
        raise AssertionError("a control period between two updates is not refused")


def check_heat(id: str) -> None:
    """Whatever temperatures are asked for, no TCA gets too hot or torn."""
    task, random = _task(id), np.random.default_rng(5)
    task.reset(seed=5)
    for number in range(200):
        if number % 10 == 0:
            action = random.choice([-1.0, 1.0], task.action.size).astype(np.float32)
        *_, terminated, truncated, info = task.step(action)
        sim = task.sim
        assert (sim.temperature < task.max_temperature).all(), f"{sim.temperature} °C"
        assert (sim.tension < sim.bank.breaking_force).all(), f"{sim.tension} N"
        if terminated or truncated:
            assert "overheated" not in info.get("truncation_reason", "")
            task.reset()


def check_scales(id: str) -> None:
    """Scaled observations are of the order of 1; mirrored twice, everything is as it was."""
    task = _task(id)
    observation, _ = task.reset(seed=6)
    for action in _actions(task, 10):
        scaled = task.observation.scaled(observation)
        assert np.abs(scaled).max() < 10.0, f"scaled to {scaled}"
        for table, values in ((task.observation, observation), (task.action, action)):
            if table.symmetric:
                assert _bits(table.mirrored(table.mirrored(values))) == _bits(values)
        observation, *_ = task.step(action)


def check_divergence(id: str) -> None:
    """A state that is not finite ends the episode with a reason, within the space."""
    task = _task(id)
    task.reset(seed=0)
    task.data.qvel[-1] = math.nan
    observation, reward, terminated, truncated, info = task.step(task.action.still)
    assert observation in task.observation_space, "the observation is out of bounds"
    assert truncated and not terminated and math.isfinite(reward)
    assert info["truncation_reason"].startswith("diverged: "), info["truncation_reason"]
    assert set(info["reward_terms"]) == set(task.terms)
    _rollout(task, 1, seed=0)


def check_pictures(id: str) -> None:
    """Where there is OpenGL a picture has the size that was asked for, and is not one colour."""
    assert _task(id).render() is None, "there is a picture without a render mode"
    task = _task(id, render_mode="rgb_array", size=(64, 48))
    task.reset(seed=0)
    try:
        picture = task.render()
    except RenderingUnavailable:
        return
    assert picture.shape == (48, 64, 3) and picture.dtype == np.uint8
    assert picture.std() > 5.0, "the picture is empty"
    task.close()


CHECKS: dict[str, Callable[[str], None]] = {
    "interface": check_interface,
    "tables": check_tables,
    "reward": check_reward,
    "seeds": check_seeds,
    "options": check_options,
    "copies": check_copies,
    "state": check_state,
    "vector": check_vector,
    "actions": check_actions,
    "process": check_process,
    "control period": check_control_period,
    "heat": check_heat,
    "scales": check_scales,
    "divergence": check_divergence,
    "pictures": check_pictures,
}
"""All checks, by name."""

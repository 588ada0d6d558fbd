"""Data sets of steps, models fitted to them, and control by prediction, against what is known."""

import itertools
import json
import math
import time

import numpy as np
import pytest
from scipy.signal import lfilter

import tca_mj  # noqa: F401  (registers the ids)
from tca_mj import cli
from tca_mj.agents.model import (
    ByModel,
    BySimulation,
    Horizon,
    Predictive,
    TaskModel,
    Transitions,
    View,
    collect,
    fit_model,
    prediction_errors,
)
from tca_mj.agents.model.predictive import planned
from tca_mj.envs.reach import BendReach

TASK = "TCA/BendReach-v0"
POWER = {"action": "power"}


def made_for(driven, followed, acts, period=0.1):
    """The contract of a task that does not exist, with rows of these sizes."""
    rows = {"driven": [driven, "-", 0.5, 2.0], "followed": [followed, "-", 0.0, 1.0]}
    return {
        "observation": {name: row for name, row in rows.items() if row[0]},
        "action": {"command": [acts, "-", 0.0, None]},
        "timing": {"control_period": period, "action": "power"},
    }


def steps_of(law, first, acts, contract, episodes=6, steps=60, seed=0, seen=None):
    """What a law x' = law(x, u) does under commands that are drawn."""
    draw, rows, done = np.random.default_rng(seed), [], []
    for _ in range(episodes):
        x = first(draw)
        for u in draw.uniform(-1.0, 1.0, (steps, acts)):
            then = law(x, u)
            rows.append((x[:seen], then[:seen]))
            done.append(u)
            x = then
    before, after = (np.array(column) for column in zip(*rows, strict=True))
    none = np.zeros(len(done), dtype=bool)
    return Transitions(
        task="None", observation=before, action=np.array(done), next_observation=after,
        reward=np.zeros(len(done)), terminated=none, truncated=none, made_for=contract,
        length=np.full(episodes, steps), seed=np.arange(episodes),
    )  # fmt: skip


def worst(model, test, steps=40):
    """Largest error of predictions of all rows."""
    return max(
        np.abs(prediction_errors(model, test, steps, lambda rows, n=name: rows[n])).max()
        for name in (*model.view.driven, *model.view.followed)
    )


A = np.array([[0.9, 0.05, 0.0], [-0.02, 0.8, 0.0], [0.1, 0.3, 0.5]])
B = np.array([[0.1, 0.0], [0.02, 0.2], [0.0, 0.05]])


@pytest.mark.parametrize("kind", ["linear", "split"])
def test_a_linear_system_is_recovered(kind):
    def law(x, u):
        heated = A[:2, :2] @ x[:2] + B[:2] @ u + [0.01, -0.02]
        # Split, what follows sees what is driven at the end of the step.
        given = heated if kind == "split" else x[:2]
        return np.append(heated, A[2, :2] @ given + A[2, 2] * x[2])

    contract = made_for(2, 1, 2)
    view = View(made_for=contract, driven=("driven",), followed=("followed",))
    known, test = (
        steps_of(law, lambda draw: draw.normal(size=3), 2, contract, seed=s) for s in (1, 2)
    )
    model = fit_model(known, view, kind, ridge=0.0)
    assert worst(model, test) < 1e-10
    assert model.weights[0][:, :2] == pytest.approx(A[: len(model.weights[0]), :2], abs=1e-10) or (
        kind == "linear"
    )
    # In the scaled rows x = 0.5 + 2 z the command counts half.
    place = slice(2, 4) if kind == "split" else slice(3, 5)
    assert model.weights[0][:2, place] == pytest.approx(B[:2] / 2.0, abs=1e-10)


def test_a_body_that_bends_with_products_needs_the_lift():
    """Linear heat and a body that follows its products: exact when split, not when linear."""

    def law(x, u):
        heated = np.array([0.9, 0.8]) * x[:2] + np.array([0.3, 0.2]) * u
        bend = heated[0] * heated[1] - 0.5 * heated[0] ** 3 + heated[1]
        return np.append(heated, 0.3 * x[2] + bend)

    contract = made_for(2, 1, 2)
    known, test = (
        steps_of(law, lambda draw: draw.normal(size=3), 2, contract, seed=s) for s in (1, 2)
    )

    def error(kind, degree):
        view = View(made_for=contract, driven=("driven",), followed=("followed",), degree=degree)
        return worst(fit_model(known, view, kind, ridge=0.0), test)

    assert error("split", 3) < 1e-9
    assert error("split", 2) > 0.05 and error("linear", 3) > 0.05
    assert error("bilinear", 3) < error("linear", 3)


def test_a_bilinear_system_is_recovered():
    turn, contract = np.array([[0.0, 0.1], [-0.1, 0.0]]), made_for(2, 0, 1)

    def law(x, u):
        return A[:2, :2] @ x + u[0] * (turn @ x) + 0.1 * u

    known, test = (
        steps_of(law, lambda draw: draw.normal(size=2), 1, contract, seed=s) for s in (1, 2)
    )
    view = View(made_for=contract, driven=("driven",))
    assert worst(fit_model(known, view, "bilinear", ridge=0.0), test) < 1e-10
    assert worst(fit_model(known, view, "linear", ridge=0.0), test) > 0.01


def test_heat_that_is_not_seen_is_remembered():
    """Two bodies, of which one is seen: a running mean of its own time constant says the other."""
    period, slow = 0.1, 5.0
    share = math.exp(-period / slow)

    def law(x, u):
        return np.array([0.9 * x[0] + 0.08 * x[1] + 0.3 * u[0], share * x[1] + (1 - share) * x[0]])

    contract = made_for(1, 0, 1, period)
    known, test = (
        steps_of(law, lambda draw: np.repeat(draw.normal(), 2), 1, contract, seed=s, seen=1)
        for s in (1, 2)
    )

    def error(*memories):
        view = View(made_for=contract, driven=("driven",), memories=memories)
        return worst(fit_model(known, view, ridge=0.0), test)

    assert error(slow) < 1e-10
    assert error() > 0.1
    assert error(2.0, 10.0) < 0.1 * error()  # others stand in for it


def test_running_means_are_those_of_a_filter():
    view = View(made_for=made_for(2, 1, 1), driven=("driven",), followed=("followed",),
                memories=(0.5, 3.0))  # fmt: skip
    seen = np.random.default_rng(0).normal(size=(50, 3))
    states, rows = view.states(seen), (seen[:, :2] - 0.5) / 2.0
    for k, constant in enumerate(view.memories):
        a = math.exp(-0.1 / constant)
        late = np.vstack([rows[0], rows[:-1]])
        means = lfilter([1.0 - a], [1.0, -a], late - rows[0], axis=0) + rows[0]
        assert states[:, 2 + 2 * k : 4 + 2 * k] == pytest.approx(means, abs=1e-12)
    assert view.read(states)["driven"] == pytest.approx(seen[:, :2], abs=1e-12)
    assert view.read(states)["followed"] == pytest.approx(seen[:, 2:], abs=1e-12)


def test_the_lift_is_all_products_up_to_its_degree():
    view = View(made_for=made_for(3, 0, 1), driven=("driven",), degree=4)
    a, b, c = 2.0, 3.0, 5.0
    found = view.lift(np.array([[a, b, c], [0.0, 1.0, 0.0]]))
    powers = [p for p in itertools.product(range(5), repeat=3) if 2 <= sum(p) <= 4]
    assert sorted(found[0]) == sorted(a**i * b**j * c**k for i, j, k in powers)
    assert found[1].sum() == 3.0  # b², b³ and b⁴


# Control.


def integrator(period=0.2):
    """Place and speed of a mass that is pushed, as a model that nobody had to fit."""
    contract = made_for(2, 0, 1, period)
    view = View(made_for=contract, driven=("driven",))
    weight = np.array([[1.0, period, 0.5 * period**2, 0.0], [0.0, 1.0, period, 0.0]])
    return TaskModel(view=view, kind="linear", weights=(weight,))


def test_the_plan_is_the_optimum_within_the_bounds():
    """The conditions of Karush, Kuhn and Tucker of the problem, written out by hand."""
    model, count = integrator(), 15
    period, start = model.view.period, np.array([-1.5, 0.4])
    horizon = Horizon(holds=(1,) * count, effort=0.01, change=0.05, rounds=1)

    def ahead(commands):
        begun = np.broadcast_to(start, (len(commands), 2))
        places = model.predict(begun, commands)[..., :1]
        return places, np.zeros((*places.shape[:-1], 0))

    plan = planned(ahead, np.full((count, 1), 0.7), horizon, before=np.array([0.3]),
                   guess=np.zeros((count, 1)), still=np.array([-0.2])).ravel()  # fmt: skip
    k = np.arange(1, count + 1)
    free = start[0] + period * k * start[1]
    push = period**2 * np.tril(k[:, None] - np.arange(count) - 0.5)
    slopes = np.eye(count) - np.eye(count, k=-1)
    led = np.append(0.3, np.zeros(count - 1))
    gradient = (push.T @ (free + push @ plan - 0.7) + 0.01 * (plan + 0.2)
                + 0.05 * slopes.T @ (slopes @ plan - led))  # fmt: skip
    low, high = plan < -1.0 + 1e-9, plan > 1.0 - 1e-9
    assert low.any() and high.any() and (~low & ~high).any()  # it speeds up, brakes and glides
    assert np.abs(gradient[~low & ~high]).max() < 1e-6
    assert (gradient[low] > 0.0).all() and (gradient[high] < 0.0).all()


def heater(share=0.95):
    """A driven number that a command of -1 leaves to cool and one of 1 holds at 1."""
    contract = made_for(1, 0, 1)
    weight = np.array([[share, 0.5 * (1.0 - share), 0.5 * (1.0 - share)]])
    view = View(made_for=contract, driven=("driven",))
    return TaskModel(view=view, kind="split", weights=(weight, np.zeros((0, 2))))


def acting(model, wanted, excess=None, averaging=0.0, more=0.0, steps=80):
    """Commands and scaled outputs of a policy on a heater that gets a little ``more``."""
    view = model.view

    def output(rows):
        return (rows["driven"] - 0.5) / 2.0

    given = {} if excess is None else {"excess": excess}
    policy = Predictive(
        ByModel(model, averaging), output, wanted, 1.0, np.array([-1.0], np.float32), view.period,
        Horizon(holds=(1, 1, 2, 2, 4, 4)), **given,
    )  # fmt: skip
    state, found = np.zeros(1), []
    for _ in range(steps):
        action = policy.act((2.0 * state + 0.5).astype(np.float32))
        state = model.advance(state, action.astype(float), np.array([more]))
        found.append((float(action[0]), float(state[0])))
    return np.array(found).T


def test_a_heater_is_off_on_or_between_as_it_must_be():
    commands, _ = acting(heater(), lambda t: np.full((len(t), 1), 2.0))
    assert (commands == 1.0).all()  # it never gets there
    commands, outputs = acting(heater(), lambda t: np.full((len(t), 1), 0.5))
    assert commands[-1] == pytest.approx(0.0, abs=1e-3)  # what holds half
    assert outputs[-1] == pytest.approx(0.5, abs=1e-4)
    commands, _ = acting(heater(), lambda t: np.full((len(t), 1), -1.0))
    assert (commands == -1.0).all()


def test_it_lets_cool_before_the_course_falls():
    """Nothing cools but time: whoever knows the course begins earlier, and is half as far off."""

    def course(t):
        return np.where(np.asarray(t)[:, None] < 4.0, 0.7, 0.4)

    commands, outputs = acting(heater(), course)
    assert commands[39] < commands[30] - 0.5  # the step at 4 s comes after 40 steps
    off = np.abs(outputs - course(0.1 * np.arange(1, 81))[:, 0])
    late = 0.3 * 0.95 ** np.arange(1, 12)  # who begins at 4 s
    assert np.sum(off[30:51] ** 2) < 0.6 * np.sum(late**2)


def test_what_must_not_be_is_kept_off():
    _, outputs = acting(heater(), lambda t: np.full((len(t), 1), 0.8),
                        lambda rows: 50.0 * ((rows["driven"] - 0.5) / 2.0 - 0.6))  # fmt: skip
    assert outputs.max() == pytest.approx(0.6, abs=1e-3)


def test_what_is_off_is_learned():
    """A heater that gets 0.01 more every step ends where it should, and higher otherwise."""

    def course(t):
        return np.full((len(t), 1), 0.5)

    _, outputs = acting(heater(), course, averaging=0.3, more=0.01, steps=120)
    assert outputs[-1] == pytest.approx(0.5, abs=1e-4)
    _, outputs = acting(heater(), course, more=0.01, steps=120)
    assert outputs[-1] > 0.504


# The bending module.


@pytest.fixture(scope="module")
def steps():
    return collect(TASK, episodes=14, steps=120, seed=3, arguments=POWER, threads=1)


@pytest.fixture(scope="module")
def model(steps):
    view = View(made_for=steps.made_for, driven=("TCA temperature",), followed=("tip position",),
                memories=(3.0, 15.0), degree=4)  # fmt: skip
    return fit_model(steps, view)


def bend(rows):
    """Angle of the arc whose tip lies where it does [°]."""
    tip = rows["tip position"]
    return 2.0 * np.degrees(np.arctan2(np.hypot(tip[..., 0], tip[..., 1]), -tip[..., 2]))[..., None]


def test_the_angle_is_predicted_within_2_degrees_over_5_seconds(model):
    test = collect(TASK, episodes=5, steps=120, seed=900, arguments=POWER, threads=1)
    off = np.abs(prediction_errors(model, test, 50, bend))
    moved = np.ptp(bend({"tip position": test.observation[:, 9:12]}))
    assert len(off) > 20 and moved > 30.0
    assert off.max() < 2.0


def test_steps_are_those_of_the_task(steps):
    """The single task, with the same seed and commands, sees the same; episodes hang together."""
    env = BendReach(action="power")
    first, second = (list(steps.episodes())[k] for k in (0, 13))
    for seed, (seen, done) in ((3, first), (16, second)):
        observation, _ = env.reset(seed=seed)
        assert (observation == seen[0]).all()
        for action, after in zip(done[:20].astype(np.float32), seen[1:], strict=False):
            assert (env.step(action)[0] == after).all()
    assert steps.seed.tolist() == list(range(3, 17))
    inside = np.ones(len(steps.action), dtype=bool)
    inside[np.cumsum(steps.length) - 1] = False
    assert (steps.next_observation[inside] == steps.observation[1:][inside[:-1]]).all()
    assert (steps.truncated | steps.terminated).sum() == 14


def test_what_is_drawn_comes_from_the_seed_alone():
    def made(**given):
        given = {"episodes": 3} | given
        return collect(TASK, steps=15, arguments=POWER, threads=1, **given)

    one, two, other = made(seed=5), made(seed=5, envs=2), made(seed=6, episodes=1)
    for name in ("observation", "action", "next_observation", "reward", "truncated", "length"):
        assert (getattr(one, name) == getattr(two, name)).all(), name
    assert (one.action[:15] != other.action).any()
    assert (one.action[:15] != one.action[15:30]).any()


def test_commands_are_held_and_disturbed(steps):
    changes = np.diff(steps.action[: steps.length[0]], axis=0) != 0.0
    assert 0.02 < changes.mean() < 0.5  # from 2 to 60 steps at a time
    assert (steps.action == -1.0).mean() > 0.15  # for 30 % of the times nothing is disturbed
    assert steps.action.max() > 0.5


def test_what_is_too_hot_is_cut_off():
    found = collect(TASK, episodes=3, steps=100, seed=1, arguments=POWER, threads=1, hottest=45.0)
    hottest = found.next_observation[:, :3].max(axis=1)
    ends = np.cumsum(found.length) - 1
    assert (found.length < 100).all() and (hottest[ends] > 45.0).all()
    assert (np.delete(hottest, ends) <= 45.0).all() and found.truncated[ends].all()


def test_the_task_tells_where_commands_lead_and_is_left_alone():
    env = BendReach(action="power")
    foresight = BySimulation(env)
    observation, _ = env.reset(seed=2)
    foresight.reset()
    for _ in range(5):
        observation, *_ = env.step(np.array([0.5, -1.0, 0.0], np.float32))
    before = env.sim.data.qpos.copy(), env.sim.temperature.copy()
    ahead = foresight.look(observation, lambda rows: rows["tip position"],
                           lambda rows: rows["TCA temperature"])  # fmt: skip
    commands = np.random.default_rng(0).uniform(-1.0, 0.5, (2, 4, 3))
    tips, temperatures = ahead(commands)
    assert (env.sim.data.qpos == before[0]).all() and (env.sim.temperature == before[1]).all()
    for command, tip, temperature in zip(commands[1], tips[1], temperatures[1], strict=True):
        seen = env.observation.read(env.step(command)[0])
        assert (seen["tip position"] == tip).all()
        assert (seen["TCA temperature"] == temperature).all()


def test_a_course_is_followed_in_less_time_than_there_is(model):
    """A swing of 15° in 6 s: within a degree, each decision in less than the control period."""
    env = BendReach(action="power")
    observation, _ = env.reset(seed=0)

    def course(t):
        angle = np.minimum(t / 3.0, 1.0) * (30.0 + 7.5 * np.sin(2.0 * np.pi * t / 6.0))
        return np.stack([angle, 0.0 * t], axis=-1)

    def tilt(rows):
        tip = rows["tip position"]
        return 2.0 * np.degrees(np.arctan2(tip[..., :2], -tip[..., 2:]))

    policy = Predictive(ByModel(model), tilt, course, 1.0, env.action.still, 0.1,
                        Horizon(effort=1e-3, change=1e-3))  # fmt: skip
    off, spent = [], []
    for k in range(1, 101):
        start = time.thread_time()
        action = policy.act(observation)
        spent.append(time.thread_time() - start)
        observation, *_ = env.step(action)
        seen = env.observation.read(observation.astype(float))
        off.append(np.abs(tilt(seen) - course(np.array([0.1 * k]))[0]).max())
    assert max(off[30:]) < 1.0
    assert np.median(spent) < 0.1


# Files and the command.


def test_files_are_read_as_they_were_written(tmp_path, steps, model):
    again = Transitions.read(steps.save(tmp_path / "steps.npz"))
    assert (again.observation == steps.observation).all() and (again.seed == steps.seed).all()
    assert (again.task, again.arguments, again.period) == (TASK, POWER, 0.1)
    back = TaskModel.read(model.save(tmp_path / "model.npz"))
    states = model.view.states(steps.observation[:5].astype(float))
    command = np.zeros((5, 3))
    assert (back.advance(states, command) == model.advance(states, command)).all()


def test_other_files_are_refused(tmp_path, steps):
    path = steps.save(tmp_path / "steps.npz")
    with pytest.raises(ValueError, match="is no model: kind must be 'model'"):
        TaskModel.read(path)
    with pytest.raises(FileNotFoundError):
        Transitions.read(tmp_path / "none.npz")
    content = path.read_bytes()
    for broken in (content[:-100], b"", content.replace(b"reward.npy", b"reworn.npy")):
        path.write_bytes(broken)
        with pytest.raises(ValueError, match="is no data set"):
            Transitions.read(path)
    np.savez(path, header=np.array([{"kind": "transitions"}], dtype=object))
    with pytest.raises(ValueError, match="is no data set"):
        Transitions.read(path)
    header = json.dumps({"kind": "transitions", "format": 2})
    np.savez(path, header=np.array(header))
    with pytest.raises(ValueError, match="in format 1"):
        Transitions.read(path)


def test_what_is_too_much_or_too_little_is_refused(steps):
    with pytest.raises(ValueError, match=r"episodes must be at most \d+ of 100000 steps"):
        collect(TASK, episodes=100, steps=100_000, threads=1)
    with pytest.raises(ValueError, match="driven and followed must be different rows"):
        View(made_for=steps.made_for, driven=("TCA temperature", "gait"))
    with pytest.raises(ValueError, match="degree must leave at most 2000 numbers"):
        View(made_for=steps.made_for, driven=("TCA temperature", "TCA tension", "TCA length"),
             degree=6)  # fmt: skip
    view = View(made_for=made_for(2, 1, 2), driven=("driven",))
    with pytest.raises(ValueError, match="view must be of the task of the data"):
        fit_model(steps, view)
    with pytest.raises(ValueError, match=r"weights\[0\] must be"):
        TaskModel(view=view, kind="linear", weights=(np.zeros((2, 4)),))


def test_a_network_learns_the_same_from_the_same_seed(steps):
    pytest.importorskip("torch")
    view = View(made_for=steps.made_for, driven=("TCA temperature",), memories=(15.0,))
    one, two, other = (
        fit_model(steps, view, "network", hidden=(16,), epochs=60, seed=s) for s in (0, 0, 1)
    )
    assert all((a == b).all() for a, b in zip(one.weights, two.weights, strict=True))
    assert (one.weights[0] != other.weights[0]).any()

    def temperature(rows):
        return rows["TCA temperature"]

    off = prediction_errors(one, steps, 10, temperature)
    still = fit_model(steps, view, "network", hidden=(16,), epochs=1, rate=1e-9)
    untaught = prediction_errors(still, steps, 10, temperature)
    assert np.mean(off**2) < 0.1 * np.mean(untaught**2)


def test_the_commands_work_on_a_task_from_outside(tmp_path, monkeypatch, capsys):
    """Its script's and nobody's commands by turns; and what is told is the error."""
    from test_outside import ROOT, TURN

    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    known, model = tmp_path / "turn.npz", tmp_path / "model.npz"
    command = ["collect", TURN, "--episodes", "4", "--steps", "40", "--policy", "off"]
    assert cli.main([*command, "--policy", "scripted", "--out", str(known)]) == 0
    assert "steps of 4 episodes" in capsys.readouterr().out
    found = Transitions.read(known)
    assert found.policies == ("off", "scripted") and found.action.shape[1] == 9
    command = ["fit", str(known), "--driven", "TCA temperature", "--followed", "angle"]
    assert cli.main([*command, "--degree", "1", "--test", str(known), "--out", str(model)]) == 0
    said = capsys.readouterr().out
    assert "| off after | 1 s |" in said and "| angle [rad] |" in said
    assert TaskModel.read(model).view.followed == ("angle",)
    assert cli.main(["fit", str(known), "--driven", "gait", "--out", str(model)]) == 2
    assert "driven and followed must be different rows" in capsys.readouterr().err

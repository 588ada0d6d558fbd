"""The tables and the picture of docs/learned-model.md.

    python scripts/learned_model_page.py            draws docs/pictures/learned_model.png
    python scripts/learned_model_page.py --tables   prints the tables

Data, models, gains and runs are kept in runs/learned-model, from which both go on; from nothing it
takes 20 minutes of one core.
"""

import json
import time
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import least_squares
from studies import BLUE, GREEN, GREY, ORANGE, PURPLE

import tca_mj
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
from tca_mj.agents.policies import load_policy
from tca_mj.control import PiSpec, pi_rest, pi_step
from tca_mj.envs.reach import ACTION, BendReach
from tca_mj.files import write_whole
from tca_mj.pages import folder_of_pictures, table

TASK = "TCA/BendReach-v0"
KEPT = Path("runs/learned-model")
DT = BendReach.control_period
MEMORIES = (3.0, 10.0, 30.0)
STEPS = 300  # of a course
JUDGED = 5.0  # from when on a course is judged [s]
MODELS = {
    "split, degree 6": ("split", 6, MEMORIES),
    "split, degree 4": ("split", 4, MEMORIES),
    "split, degree 6, no memory": ("split", 6, ()),
    "linear, not lifted": ("linear", 1, MEMORIES),
    "linear, degree 3": ("linear", 3, MEMORIES),
    "bilinear, degree 3": ("bilinear", 3, MEMORIES),
    "network": ("network", 1, MEMORIES),
}
BEST = "split, degree 6"
HORIZON = Horizon(effort=1e-3, change=1e-3)
SHORT = Horizon(holds=(2, 3, 5), effort=1e-3, change=1e-3, rounds=1, probe=0.05)
AVERAGING = 0.05  # time in which it learns what is off, where nothing has noise [s]
HOT = 135.0  # from where on prediction keeps away [°C]
WARM = 70.0  # of a TCA that has nothing to do, in the inverse of the model [°C]
_SIDES = -2.0 * np.pi / 3.0 * np.arange(3)
TOWARDS = np.stack([np.cos(_SIDES), np.sin(_SIDES)])  # where each TCA bends to, (2, 3)
OFF = {"tca_gain": 0.8, "heat_loss": 1.2}

Course = Callable[[Any], Any]
Rows = dict[str, Any]


def tilt(rows: Rows) -> Any:
    """Bend towards x and y of the arc whose tip lies where it does, shape (..., 2) [°]."""
    tip = rows["tip position"]
    return 2.0 * np.degrees(np.arctan2(tip[..., :2], -tip[..., 2:]))


def bend(rows: Rows) -> Any:
    """The same towards wherever it bends, from 0 on, shape (..., 1) [°]."""
    tip = rows["tip position"]
    aside = np.hypot(tip[..., 0], tip[..., 1])
    return 2.0 * np.degrees(np.arctan2(aside, -tip[..., 2]))[..., None]


def place(rows: Rows) -> Any:
    """Where the tip is, seen from below, shape (..., 2) [mm]."""
    return 1e3 * rows["tip position"][..., :2]


def too_hot(rows: Rows) -> Any:
    """By how much TCAs are above ``HOT``, 1 for 5 K."""
    return (rows["TCA temperature"] - HOT) / 5.0


def kept(name: str, make: Callable[[], Any]) -> Any:
    """A result that is made once, as JSON."""
    path = KEPT / f"{name}.json"
    if not path.exists():
        write_whole(path, json.dumps(make()).encode())
    return json.loads(path.read_text())


def data(name: str, **given: Any) -> Transitions:
    """A data set that is made once."""
    path = KEPT / f"{name}.npz"
    if not path.exists():
        collect(TASK, steps=400, arguments={"action": "power"}, threads=1, **given).save(path)
    return Transitions.read(path)


def training() -> Transitions:
    """What models are fitted to."""
    return data("training", episodes=120, seed=1000)


def model(name: str) -> TaskModel:
    """A model that is fitted once."""
    path = KEPT / f"model-{name.replace(', ', '-').replace(' ', '-')}.npz"
    if not path.exists():
        kind, degree, memories = MODELS[name]
        known = training()
        view = View(made_for=known.made_for, driven=("TCA temperature",),
                    followed=("tip position",), memories=memories, degree=degree)  # fmt: skip
        fit_model(known, view, kind).save(path)
    return TaskModel.read(path)


def predictions() -> str:
    """Errors of predictions, as Markdown."""
    tests = {
        "": data("test", episodes=40, seed=5000),
        ", the script's commands": data("script", episodes=16, seed=7000, policies=["scripted"]),
        ", modules ± 20 %": data("off", episodes=16, seed=6000, options={"randomise": 0.2}),
    }
    rows = []
    for name in MODELS:
        for also, test in tests.items():
            if also and name != BEST:
                continue
            row = [name + also]
            for steps in (10, 50, 200):
                if steps > test.length.max():
                    row += ["", ""]
                    continue
                with np.errstate(all="ignore"):
                    off = np.abs(prediction_errors(model(name), test, steps, bend))
                    tip = prediction_errors(model(name), test, steps,
                                            lambda rows: 1e3 * rows["tip position"])  # fmt: skip
                far = np.sqrt((tip**2).sum(axis=1).mean())
                angle = np.sqrt((off**2).mean())
                row.append(f"{angle:.2f} ({np.percentile(off, 95):.2f}, {off.max():.2f})")
                row.append(f"{far:.2f}")
            rows.append(row)
    heads = ["model"]
    for seconds in (1, 5, 20):
        heads += [f"angle after {seconds} s [°]", f"tip after {seconds} s [mm]"]
    return "\n".join(table(heads, rows))


def swing(seed: int) -> Course:
    """Angles towards x, a sum of three swings, the faster ones of 4 s [°]."""
    draw = np.random.default_rng(seed)
    periods, phases = draw.uniform(4.0, 12.0, 3), draw.uniform(0.0, 2.0 * np.pi, 3)

    def course(times: Any) -> Any:
        t = np.asarray(times)[..., None]
        angle = 35.0 + 8.0 * np.sin(2.0 * np.pi * t / periods + phases).sum(axis=-1)
        return np.stack([angle * np.clip(t[..., 0] / 4.0, 0.0, 1.0), 0.0 * angle], axis=-1)

    return course


def jumps(low: float, high: float, every: float) -> Course:
    """Angles towards x that jump, which no module can follow [°]."""

    def course(times: Any) -> Any:
        angle = np.where(np.asarray(times) / every % 2.0 < 1.0, low, high)
        return np.stack([angle, 0.0 * angle], axis=-1)

    return course


def polygon(corners: int, radius: float, lap: float) -> Course:
    """Along the sides of a polygon round the middle, one lap after the other [mm]."""
    points = radius * np.exp(2j * np.pi * (np.arange(corners + 1) / corners + 0.125))

    def course(times: Any) -> Any:
        t = np.asarray(times, dtype=float)
        at = np.interp(t / lap % 1.0 * corners, np.arange(corners + 1), points)
        at = at * np.clip(t / 4.0, 0.0, 1.0)
        return np.stack([at.real, at.imag], axis=-1)

    return course


GOALS: dict[str, tuple[Callable[[Rows], Any], Sequence[Course], Sequence[Course]]] = {
    "angle": (tilt, [swing(0), swing(1)], [swing(10), swing(11)]),
    "jumps": (tilt, [jumps(20.0, 45.0, 4.0)], [jumps(15.0, 50.0, 5.0), jumps(30.0, 45.0, 3.0)]),
    "path": (place, [polygon(3, 12.0, 18.0)], [polygon(4, 14.0, 20.0), polygon(60, 12.0, 12.0)]),
}  # what is controlled, courses to tune at, courses to judge by


def pi_command(gains: Any, state: Any, error: Any, base: Any) -> tuple[Any, Any]:
    """PI of each TCA on the error towards its side, about a power, and its command.

    Args:
        gains: Proportional and integral, shape (..., 2).
        state: Of the controllers.
        error: Towards x and y, shape (..., 2) [unit of the output].
        base: The power, shape (..., 3) [W].
    """
    proportional, integral = gains[..., :1], gains[..., 1:]
    spec = PiSpec(proportional=proportional, integral=integral,
                  lowest=-base - 1e-6, highest=ENV.max_power - base + 1e-6)  # fmt: skip
    state, more = pi_step(spec, state, error @ TOWARDS, DT)
    return state, np.clip(2.0 * (base + more) / ENV.max_power - 1.0, -1.0, 1.0)


class Pi:
    """PI about a power that all TCAs have, or that is fed forward, shape (steps, 3) [W]."""

    phase = "pi"

    def __init__(self, gains: Sequence[float], output: Callable[[Rows], Any], course: Course,
                 fed: Any = None) -> None:  # fmt: skip
        self.gains, self.power = np.array(gains[:2]), np.full(3, gains[2])
        self.output, self.course, self.fed = output, course, fed
        self.reset()

    def reset(self) -> None:
        self._step, self._state = 0, pi_rest((3,))

    def act(self, observation: Any) -> Any:
        # What is fed forward leads to where the course is next: the error is that of now.
        wanted = self.course(DT * (self._step + (self.fed is None)))
        error = wanted - self.output(ENV.observation.read(observation.astype(float)))
        base = self.power if self.fed is None else self.fed[self._step]
        self._state, command = pi_command(self.gains, self._state, error, base)
        self._step += 1
        return command.astype(np.float32)


class Learned:
    """The shipped policy, whose target goes along."""

    phase = "learned"

    def __init__(self, targets: Any) -> None:
        self.policy, self.targets = load_policy("bend-reach", MADE), targets

    def reset(self) -> None:
        self._step = 0

    def act(self, observation: Any) -> Any:
        seen = observation.copy()
        seen[ENV.observation.slices["target position"]] = self.targets[self._step]
        seen[ENV.observation.slices["time at the target"]] = 0.0
        self._step += 1
        return self.policy.act(seen)


@cache
def inverse(goal: str, number: int) -> tuple[Any, Any]:
    """Powers that lead along a course by the model, shape (steps, 3) [W], and where the tip rests.

    Temperatures are those nearest to ``WARM`` at which the module would rest where it is to be.
    """
    output, to_tune, to_judge = GOALS[goal.partition(",")[0]]
    course = (to_tune if "," in goal else to_judge)[number]
    known = model(BEST)
    view, (heat, body) = known.view, known.weights
    own = view.sizes[2]

    def resting(driven: Any) -> Any:
        push = np.concatenate([driven, view.lift(driven), [1.0]]) @ body[:, own:].T
        follows = np.linalg.solve(np.eye(own) - body[:, :own], push)
        return np.concatenate([driven, np.zeros(view.sizes[1]), follows])

    cold, warm, hot = (view.scaled(np.full(19, t))[:3] for t in (ENV.heat.ambient[0], WARM, HOT))
    driven, means, powers, tips = cold, np.tile(cold, len(MEMORIES)), [], []
    for k in range(STEPS):
        aim_at = course(DT * (k + 1))

        def missed(guess: Any, aim_at: Any = aim_at) -> Any:
            rows = view.read(resting(guess))
            return np.concatenate([output(rows) - aim_at, 0.3 * (guess - warm)])

        start = np.clip(driven, cold + 1e-6, hot - 1e-6)
        aim = least_squares(missed, start, bounds=(cold, hot)).x
        state = np.concatenate([driven, means])
        left = aim - state @ heat[:, : state.size].T - heat[:, -1]
        command = np.clip(np.linalg.solve(heat[:, state.size : -1], left), -1.0, 1.0)
        means = view.remember(driven, means)
        driven = heat @ np.concatenate([state, command, [1.0]])
        powers.append((command + 1.0) * ENV.max_power / 2.0)
        tips.append(view.read(resting(aim))["tip position"])
    return np.array(powers), np.array(tips)


def follow(policy: Any, output: Callable[[Rows], Any], course: Course, steps: int,
           **options: float) -> dict[str, Any]:  # fmt: skip
    """What a policy makes of a course, judged from 5 s on."""
    observation, info = ENV.reset(seed=0, options=options)
    policy.reset()
    spent, outputs, hottest = [], [], 0.0
    for _ in range(steps):
        start = time.process_time()
        action = policy.act(observation)
        spent.append(1e3 * (time.process_time() - start))
        observation, _, _, _, info = ENV.step(action)
        outputs.append(output(ENV.observation.read(observation.astype(float))).tolist())
        hottest = max(hottest, float(info["temperature"].max()))
    missed = np.array(outputs) - course(DT * (np.arange(steps) + 1.0))
    off = np.linalg.norm(missed, axis=1)[round(JUDGED / DT) :]
    return {"rms": float(np.sqrt((off**2).mean())), "most": float(off.max()),
            "energy": float(info["energy"].sum()), "hottest": hottest, "outputs": outputs,
            "decision": [float(np.median(spent)), float(np.percentile(spent, 99))]}  # fmt: skip


def tuned(goal: str, fed: bool) -> list[float]:
    """Gains and power of PI that miss the courses for tuning least, by the model.

    The best of four rounds of 300 draws, on a logarithmic scale, each round nearer to the best.
    """
    output, courses, _ = GOALS[goal]
    known, draw = model(BEST), np.random.default_rng(0)
    centre, spread = np.log([0.1, 0.1, 0.2]), np.array([3.0, 3.0, 1.0])
    for _ in range(4):
        tried = np.exp(centre + spread * draw.uniform(-1.0, 1.0, (300, 3)))
        tried[0] = np.exp(centre)
        missed = np.zeros(len(tried))
        for number, course in enumerate(courses):
            powers = inverse(f"{goal}, to tune", number)[0] if fed else None
            start = known.view.states(ENV.reset(seed=0)[0].astype(float)[None])
            state, pi = np.repeat(start, len(tried), axis=0), pi_rest((len(tried), 3))
            for k in range(STEPS):
                error = course(DT * (k + (not fed))) - output(known.view.read(state))
                base = np.repeat(tried[:, 2:], 3, axis=1) if powers is None else powers[k]
                pi, command = pi_command(tried[:, :2], pi, error, base)
                state = known.advance(state, command)
                if k * DT >= JUDGED:
                    off = output(known.view.read(state)) - course(DT * (k + 1))
                    missed += (off**2).sum(axis=-1)
        centre, spread = np.log(tried[np.nanargmin(missed)]), 0.4 * spread
    return [float(gain) for gain in np.exp(centre)]


def follower(who: str, goal: str, number: int) -> Any:
    """A policy of ``WHO`` for a course."""
    output, _, courses = GOALS[goal]
    course = courses[number]
    if who == "PI":
        return Pi(kept(f"gains-{goal}", lambda: tuned(goal, False)), output, course)
    if who == "PI with feed-forward":
        gains = kept(f"gains-{goal}-fed", lambda: tuned(goal, True))
        return Pi(gains, output, course, inverse(goal, number)[0])
    if who == "learned (SAC)":
        return Learned(inverse(goal, number)[1])
    by, horizon = {"model": (ByModel(model(BEST), AVERAGING), HORIZON),
                   "network": (ByModel(model("network")), HORIZON),
                   "simulation": (BySimulation(ENV), SHORT)}[who.split()[-1]]  # fmt: skip
    return Predictive(by, output, course, 1.0, ACTION.still, DT, horizon, too_hot)


WHO = ("PI", "PI with feed-forward", "learned (SAC)", "prediction by the split model",
       "prediction by the network", "prediction by the simulation")  # fmt: skip


def followed(goal: str, who: str, number: int, off: bool) -> dict[str, Any]:
    """A run that is made once."""
    output, _, courses = GOALS[goal]
    steps = STEPS // 2 if who == WHO[-1] else STEPS
    options = OFF if off else {}
    name = f"{goal}-{number}-{who.replace(' ', '-')}{'-off' if off else ''}"
    return dict(kept(name, lambda: follow(
        follower(who, goal, number), output, courses[number], steps, **options)))  # fmt: skip


def tracking(goal: str) -> str:
    """Who follows how well, as Markdown."""
    rows, unit = [], "mm" if goal == "path" else "°"
    for who in WHO[:-1] if goal == "jumps" else WHO:
        slow = who in WHO[-2:]  # these run the first course alone
        for off in (False,) if slow else (False, True):
            count = 1 if slow else len(GOALS[goal][2])
            runs = [followed(goal, who, k, off) for k in range(count)]
            median, most = np.max([run["decision"] for run in runs], axis=0)
            rows.append([
                who, "weaker" if off else "nominal",
                f"{np.sqrt(np.mean([run['rms'] ** 2 for run in runs])):.3f}",
                f"{max(run['most'] for run in runs):.2f}",
                f"{np.mean([run['energy'] for run in runs]):.0f}",
                f"{max(run['hottest'] for run in runs):.0f}", f"{median:.1f} ({most:.1f})",
            ])  # fmt: skip
    heads = ["who", "module", f"error, rms [{unit}]", f"most [{unit}]", "energy [J]",
             "hottest [°C]", "decision [ms]"]  # fmt: skip
    return "\n".join(table(heads, rows))


def picture(path: Path) -> None:
    """A prediction; an angle that jumps and a path that is followed."""
    figure = Figure(figsize=(13.5, 4.2), layout="constrained")
    ahead, angle, way = figure.subplots(1, 3)
    test = data("test", episodes=40, seed=5000)
    seen, done = next(e for e in test.episodes() if len(e[1]) == 400)
    clock = DT * (np.arange(200) + 1.0)
    colours = {BEST: BLUE, "network": ORANGE, "bilinear, degree 3": PURPLE,
               "linear, degree 3": GREEN}  # fmt: skip
    truth = bend({"tip position": seen[101:301, 9:12]})
    ahead.plot(clock, truth, color="#111111", lw=3, label="simulation")
    for name, colour in colours.items():
        view = model(name).view
        state = model(name).begin(view.states(seen[:101])[-1])
        rows = view.read(model(name).predict(state, done[100:300])[..., : sum(view.sizes)])
        ahead.plot(clock, bend(rows), color=colour, lw=1.2, label=name)
    ahead.set(xlabel="time since the prediction [s]", ylabel="bend [°]", ylim=(0.0, 80.0))
    who = {"PI": ORANGE, "learned (SAC)": PURPLE, "prediction by the split model": BLUE}
    for axes, goal in ((angle, "jumps"), (way, "path")):
        course = GOALS[goal][2][0](DT * (np.arange(STEPS) + 1.0))
        t = DT * (np.arange(STEPS) + 1.0)
        pair = (t, course[:, 0]) if goal == "jumps" else course[50:].T
        axes.plot(*pair, color=GREY, lw=4, alpha=0.5, label="wanted")
        for name, colour in who.items():
            found = np.array(followed(goal, name, 0, False)["outputs"])
            pair = (t, found[:, 0]) if goal == "jumps" else found[50:].T
            axes.plot(*pair, color=colour, lw=1.2, label=name)
    angle.set(xlabel="time [s]", ylabel="bend towards x [°]", xlim=(0.0, 30.0))
    way.set(xlabel="tip, x [mm]", ylabel="y [mm]", aspect="equal")
    for axes in (ahead, angle, way):
        axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=110)


def main() -> None:
    out = folder_of_pictures(__doc__, Path("docs/pictures"))
    if out is None:
        for block in (predictions, *(partial(tracking, goal) for goal in GOALS)):
            print(block(), flush=True, end="\n\n")
    else:
        picture(out / "learned_model.png")


MADE: Any = tca_mj.make(TASK, action="power")
ENV: Any = MADE.unwrapped

if __name__ == "__main__":
    main()

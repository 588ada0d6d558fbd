"""Sweeps: the same evaluation or training at many settings, side by side, by Ray Tune.

Every trial has a folder of its own, in which it goes on where it stopped (see ``evaluate``,
``train`` and ``search``). So a trial whose process or machine is lost is begun again by Ray and
loses what was under way, and so does a sweep that is called a second time. Ray is loaded when a
sweep begins; the extra ``sweep`` installs it.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from tca_mj.agents.cluster import Failures, cluster
from tca_mj.agents.evaluate import METRICS, Evaluation, cell, evaluate, label
from tca_mj.agents.output import read_json, write_csv, write_json
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.workers import Processes
from tca_mj.checks import Checked, door, instance, require_one_of, shown, whole
from tca_mj.files import claimed, write_whole
from tca_mj.machine import machine, versions
from tca_mj.pages import table
from tca_mj.registry import ALGORITHMS
from tca_mj.tca import find_tca

TRIALS, RESULT = "trials", "result.json"
TABLE, PAGE, FIGURE, ABOUT = "results.csv", "results.md", "results.png", "sweep.json"

Value = float | int | str
# What is drawn, the first three of these that there are.
_DRAWN = ("speed", "success", "duration", "energy_per_metre", "energy", "return")
MOST_TRIALS = 10_000
"""Most combinations of a sweep, each of which has a folder and takes seconds at least."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Sweep(Checked):
    """What is swept.

    Attributes:
        evaluation: What is measured at each setting, where an axis says nothing else.
        axes: Values by name; all combinations are run. Names are fields of ``Evaluation`` (its task
            too), ``design.PATH`` for a figure of the robot (see ``tca_mj.agents.design.robot_of``),
            and with an algorithm ``train.FIELD`` or ``train.learner.FIELD`` of the training's
            settings. ``train.design.PATH`` is a figure of the robot that is trained and evaluated,
            ``design.PATH`` of the one that is only evaluated.
        algorithm: Whether a policy is trained first, and how: one of
            ``tca_mj.registry.ALGORITHMS``. What is evaluated is then the best policy of the
            run. Training is on the robot with its default figures, but for ``train.design.PATH``,
            and with the muscle of ``evaluation.arguments``, if that has one.

    Raises:
        ValueError: If a name is unknown, a value cannot be, an axis has no value or one twice, or
            there are more than 10 000 combinations.
    """

    evaluation: Evaluation
    axes: Mapping[str, Sequence[Value]]
    algorithm: str | None = None

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        require_one_of("algorithm", self.algorithm, (None, *ALGORITHMS))
        for name, values in self.axes.items():
            if not values or len(set(values)) != len(values):
                raise ValueError(
                    f"{name} must have one or more values, all different, got {shown(values)}"
                )
        count = math.prod(map(len, self.axes.values()))
        whole("combinations of axes", count, at_most=MOST_TRIALS)
        for trial in self.trials():
            trial.config()  # whoever is wrong says so before anything runs

    def trials(self) -> list[Trial]:
        """All combinations."""
        combinations = itertools.product(*self.axes.values())
        return [Trial(self, dict(zip(self.axes, point, strict=True))) for point in combinations]


@dataclass(frozen=True, slots=True)
class Trial:
    """One setting of a sweep.

    Attributes:
        sweep: What it belongs to.
        point: Value of each axis.
    """

    sweep: Sweep
    point: Mapping[str, Value]

    @property
    def name(self) -> str:
        """Name of the folder: the same for the same settings, whatever else is swept."""
        about = repr((self.sweep.evaluation, self.sweep.algorithm, sorted(self.point.items())))
        evaluation = self.sweep.evaluation
        robots = ("design.", "train.design.")  # whose muscle may be a file
        values = [v for n, v in self.point.items() if n.startswith(robots) or n == "train.tca"]
        values += [*evaluation.arguments.values(), *evaluation.design.values()]
        muscles = [find_tca(v) for v in map(str, values) if v.endswith(".json")]
        about += "".join(map(repr, muscles))  # a file is what it holds
        return hashlib.sha256(about.encode()).hexdigest()[:12]

    def evaluation(self, folder: Path) -> Evaluation:
        """What is measured; the policy is that of the run in ``folder`` if one is trained."""
        known = {entry.name for entry in fields(Evaluation)} - {
            "design", "arguments", "preprocessing", "options",
        }  # fmt: skip
        design = dict(self.sweep.evaluation.design)
        change: dict[str, Any] = {}
        for name, value in self.point.items():
            trained = self.sweep.algorithm and name.startswith("train.design.")
            head, _, rest = (name.removeprefix("train.") if trained else name).partition(".")
            if head == "design" and rest:
                design[rest] = value
            elif name in known and not (name == "policy" and self.sweep.algorithm):
                change[name] = value
            elif head != "train" or self.sweep.algorithm is None:
                raise ValueError(
                    f"{name!r} must be design.PATH, with an algorithm train.FIELD, or one of"
                    f" {sorted(known)}"
                )
        if self.sweep.algorithm:
            change["policy"] = str(folder)
        return replace(self.sweep.evaluation, **change, design=design)

    def config(self) -> Any:
        """Settings of the training, or None."""
        task, algorithm = self.evaluation(Path()).task, self.sweep.algorithm
        if algorithm is None:
            return None
        tca = self.sweep.evaluation.arguments.get("tca")
        given = [name for name in self.point if name.startswith("train.")]
        change: dict[str, Any] = {name[6:]: self.point[name] for name in given}
        paths = [name for name in change if name.startswith("design.")]
        if paths:
            change["design"] = {name[7:]: change.pop(name) for name in paths}
        try:
            if algorithm == "cma":
                from tca_mj.agents.train.search import SearchConfig

                return replace(SearchConfig(task=task, tca=tca), **change)
            from tca_mj.agents.train.config import default_config

            learner = [name for name in change if name.startswith("learner.")]
            inner: dict[str, Any] = {name[8:]: change.pop(name) for name in learner}
            muscle = {} if tca is None else {"tca": tca}
            config = default_config(task, algorithm, arguments=muscle, **change)
            return replace(config, learner=replace(config.learner, **inner))
        except TypeError as error:  # no such field
            raise ValueError(f"train: {error}") from error

    def run(self, folder: Path) -> dict[str, Any]:
        """Trains if it has to, evaluates, and writes ``result.json``; goes on where it stopped."""
        config = self.config()
        if config is not None:
            if self.sweep.algorithm == "cma":
                from tca_mj.agents.train.search import search

                search(config, folder, workers=1, progress=False)
            else:
                from tca_mj.agents.train.deep import train

                train(config, folder, video=False, progress=False)
        summary = evaluate(self.evaluation(folder), out=folder / "evaluation", progress=False)
        result = {"point": dict(self.point), "figures": summary["figures"]}
        write_json(folder / RESULT, result, indent=1)
        return result


@door
def run_sweep(
    sweep: Sweep, out: Path, *, workers: Processes = 2, address: str | None = None,
    failures: Failures = 3,
) -> list[dict[str, Any]]:
    """Runs what is missing of the trials and writes the table of all.

    Into ``out`` go ``trials/NAME/``, ``sweep.json`` (axes, versions, machine), ``results.csv``,
    ``results.md``, and where Matplotlib is installed ``results.png``. Trials that ended in an
    error are left out of the table and named.

    Args:
        sweep: What is swept.
        out: Folder; on a cluster one that all machines see under the same path.
        workers: Trials at a time, 1 to 1024, each in a process of its own with one core.
        address: Address of a running Ray cluster, as ``ray.init`` takes it; None for a cluster in
            this machine that ends with the sweep.
        failures: How often a trial is begun again whose process was lost, up to 100 times.

    Returns:
        For each finished trial its ``point`` and its ``figures``, in the order of the axes.

    Raises:
        ImportError: If Ray is not installed.
        FileNotFoundError: If there is no such policy.
        ConnectionError: If there is no cluster at ``address``.
        RuntimeError: If Ray does not start, or trials ended in an error; what the others found is
            written.
        BlockingIOError: If another process works in ``out``.
        OSError: If something cannot be written.
        ValueError: If ``workers`` or ``failures`` is out of range.
    """
    out = out.absolute()
    trials = sweep.trials()
    files = [out / TRIALS / trial.name / RESULT for trial in trials]
    with claimed(out):
        held = [
            _result(file, trial.point) if file.is_file() else None
            for file, trial in zip(files, trials, strict=True)
        ]
        missing = [trial for trial, result in zip(trials, held, strict=True) if result is None]
        for trial in missing:
            if sweep.algorithm is None:
                trial.evaluation(out).key()  # reads the policy: one that is not there says so now
        about = {"axes": {k: list(v) for k, v in sweep.axes.items()}, "versions": versions("ray"),
                 "machine": machine(), "command": repr(sweep)}  # fmt: skip
        write_json(out / ABOUT, about, indent=1)
        errors = _tune(missing, out, workers, address, failures) if missing else {}
        found = [
            _result(file, trial.point)
            for file, trial in zip(files, trials, strict=True) if file.is_file()
        ]
        _write(sweep, found, out)
    if errors:
        raise RuntimeError(f"{len(errors)} trials ended in an error: {errors}")
    return found


def _tune(
    trials: Sequence[Trial], out: Path, workers: int, address: str | None, failures: int
) -> dict[str, str]:
    """Lets Ray Tune run the trials; returns what went wrong, by the trial's point."""
    with cluster(out, workers, address), progress_bar(len(trials), unit="trials") as bar:
        from ray import tune

        class Progress(tune.Callback):
            def on_trial_complete(self, *_: Any, **__: Any) -> None:
                bar.update()

            def on_trial_error(self, *_: Any, **__: Any) -> None:
                bar.update()

        start = Path.cwd()

        def trainable(config: dict[str, Any]) -> None:
            with suppress(OSError):  # of another machine, which needs no relative paths then
                os.chdir(start)
            trial = trials[config["number"]]
            result = trial.run(out / TRIALS / trial.name)
            tune.report({name: row["mean"] for name, row in result["figures"].items()})

        tuner = tune.Tuner(
            tune.with_resources(trainable, {"cpu": 1}),
            param_space={"number": tune.grid_search(list(range(len(trials))))},
            tune_config=tune.TuneConfig(max_concurrent_trials=workers, reuse_actors=True),
            run_config=tune.RunConfig(
                name="ray", storage_path=str(out), verbose=0, callbacks=[Progress()],
                failure_config=tune.FailureConfig(max_failures=failures),
            ),
        )  # fmt: skip
        results = tuner.fit()
        ended = [results[i] for i in range(len(results))]
        return {
            json.dumps(dict(trials[result.config["number"]].point)): _last_line(result.error)
            for result in ended
            if result.error is not None and result.config
        }


def _result(file: Path, point: Mapping[str, Value]) -> dict[str, Any]:
    """What the trial of a point has found.

    Raises:
        ValueError: If the file is broken.
    """
    found = read_json(file)
    figures: Any = found.get("figures")
    try:
        require_one_of("point", found.get("point"), [dict(point)])
        instance("figures", figures, dict)
        for name, figure in figures.items():
            cell(name, figure)
    except ValueError as error:
        raise ValueError(
            f"{file} must be what the trial has found, or be removed to run it again: {error}"
        ) from error
    return {"point": dict(point), "figures": figures}


def _last_line(error: Exception) -> str:
    """What an error says, without the way that it has come."""
    return str(error).strip().splitlines()[-1]


def _write(sweep: Sweep, found: Sequence[dict[str, Any]], out: Path) -> None:
    """The table, as CSV in SI units and as Markdown."""
    names = [name for name in METRICS if any(name in row["figures"] for row in found)]
    columns = [*sweep.axes, *(f"{name}{end}" for name in names for end in ("", "_low", "_high"))]
    data, lines = [], []
    for row in found:
        figures = {name: row["figures"].get(name, {}) for name in names}
        values = [figure.get(key) for figure in figures.values() for key in ("mean", "low", "high")]
        data.append(dict(zip(columns, [*row["point"].values(), *values], strict=True)))
        cells = [cell(name, figure) for name, figure in figures.items()]
        lines.append([*map(str, row["point"].values()), *cells])
    write_csv(out / TABLE, data, columns)
    page = table([*sweep.axes, *map(label, names)], lines)
    write_whole(out / PAGE, ("\n".join(page) + "\n").encode())
    _draw(sweep, found, names, out / FIGURE)


def _draw(
    sweep: Sweep, found: Sequence[dict[str, Any]], names: Sequence[str], path: Path
) -> None:
    """Means and intervals, a row for each combination; no figure without Matplotlib."""
    shown = [name for name in _DRAWN if name in names][:3]
    if not shown or not find_spec("matplotlib"):
        return
    from tca_mj.validation.figures import draw

    varied = [name for name, values in sweep.axes.items() if len(values) > 1]
    rows = [", ".join(f"{name} {row['point'][name]}" for name in varied) for row in found]
    colours = {value: f"C{i % 10}" for i, value in enumerate(sweep.axes[varied[0]])} \
        if varied else {}  # fmt: skip

    def fill(figure: Any) -> None:
        for axis, name in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
            unit = METRICS[name][1]
            for i, row in enumerate(found):
                known = row["figures"].get(name, {})
                colour = colours.get(row["point"].get(varied[0])) if varied else "C0"
                ends = [known.get(end) for end in ("low", "high")]
                if None not in ends:
                    axis.plot([unit * end for end in ends], [i, i], color=colour, alpha=0.5)
                if known.get("mean") is not None:
                    axis.plot(unit * known["mean"], i, "o", color=colour)
            axis.set(xlabel=label(name), ylim=(len(found) - 0.5, -0.5))
            axis.set_yticks(range(len(found)), rows if name == shown[0] else [""] * len(found))

    draw(path, 3.2 * len(shown) + 3.0, min(40.0, 1.2 + 0.24 * len(found)), fill)

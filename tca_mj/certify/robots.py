"""The certificate of a robot of one's own: its chains against the theory of rods, case by case."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from itertools import combinations
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from tca_mj import pages
from tca_mj.agents.progress import progress_bar
from tca_mj.agents.workers import Workers
from tca_mj.certify.cases import Case
from tca_mj.certify.outcomes import POSITION, ROTATION, Effort, Outcome, judge
from tca_mj.certify.rest import Load
from tca_mj.certify.solid import solid
from tca_mj.certify.subjects import Subject, read
from tca_mj.checks import Array, Count, Positive, Temperature, door, shown, within
from tca_mj.machine import machine, versions
from tca_mj.model.chain import MOTIONS
from tca_mj.model.part import Part
from tca_mj.tca import TcaSpec, find_tca

HOT = 120.0  # temperature of a hot TCA [°C]
COLD = 25.0  # of a cold one [°C]
_PAIRS = 6  # of hot TCAs at one gravity, up to which the table shows each
_AS_RUN = 1e-3  # how far from the rest that was judged a simulation may end [1]


@dataclass(frozen=True, kw_only=True, slots=True)
class Asked:
    """What a robot is asked.

    Attributes:
        hot: Names of the TCAs that are hot; the others are cold.
        gravity: Gravity, shape (3,) [m/s²].
        close: Whether it is looked at more closely, as a simulation and by a second solver.
    """

    hot: tuple[str, ...]
    gravity: tuple[float, float, float]
    close: bool


Answer: TypeAlias = tuple[Asked, Outcome, bool]
"""A case, its answer, and whether that is within the bounds."""


@door
def certify_robot(
    robot: Part | str, *, hot: ArrayLike = HOT, gravity: ArrayLike | None = None,
    spine: Temperature | None = None, nodes: Count | None = None,
    tca: TcaSpec | str | Path | None = None, position: Positive = POSITION,
    rotation: Positive = ROTATION, out: Path | None = None, workers: Count = 1,
) -> dict[str, Any]:  # fmt: skip
    """Compares a part at rest with the theory of rods: cold, each TCA hot, each two, and all.

    Each case is answered without gravity and with it. The part is held as it was built.

    Args:
        robot: The part, which stays as it is; or ``module:function``, what builds it.
        hot: Temperature of a hot TCA, one for all or one for each, shape (n,) [°C].
        gravity: Gravity, shape (3,); None for that of the part [m/s²].
        spine: Temperature of its shape-memory spines, which stay at it in their memorised shape;
            None if it has none [°C].
        nodes: Argument ``nodes`` of the function that builds it; None for its own.
        tca: Its argument ``tca``, what ``find_tca`` finds; None for its own.
        position: Bound of the error of place of every chain's end, over the length of the chains on
            the way there [1].
        rotation: Bound of the error of its frame [rad].
        out: Folder for ``report.json`` and ``report.md``; None to write nothing.
        workers: Processes that share the work, if ``robot`` says what builds it.

    Returns:
        ``robot``, ``within`` (whether all cases are within the bounds), ``cases``, ``bounds``,
        ``seconds``, ``machine``, ``versions`` and ``text``.

    Raises:
        ValueError: If an argument is out of range, there is no such function, or theory does not
            cover the part; the message names the part and the body.
    """
    given = {"nodes": nodes, "tca": None if tca is None else find_tca(tca)}
    given = {name: value for name, value in given.items() if value is not None}
    for name, value in given.items():
        if isinstance(robot, Part):
            raise ValueError(f"{name} must be None where robot is a Part, got {shown(value)}")
    part = robot if isinstance(robot, Part) else built(robot, **given)
    names = [tca.name for tca in part.tcas]
    warm = within("hot", hot, above=COLD, unit="°C")
    if warm.shape not in ((), (len(names),)):
        raise ValueError(f"hot must be one temperature or {len(names)}, got {hot!r}")
    down = part.spec.option.gravity if gravity is None else gravity
    down = within("gravity", down, shape=(3,), unit="m/s²")
    _subject(part, spine)  # refuses what theory does not cover
    asked = list(_asked(names, down))
    begin = time.perf_counter()
    job = robot, given, np.broadcast_to(warm, len(names)), spine
    found: dict[int, Outcome] = {}
    with (
        Workers(workers if isinstance(robot, str) else 1) as processes,
        progress_bar(len(asked), unit="cases", leave=False) as bar,
    ):
        for place, row in processes.run(_answer, [(*job, one) for one in asked]):
            found[place] = row
            bar.update()
    rows = [found[place] for place in range(len(asked))]
    good = [_within(row, position, rotation) for row in rows]
    result = {
        "robot": part.spec.modelname, "within": all(good), "machine": machine(),
        "versions": versions(), "bounds": {"position": position, "rotation": rotation},
        "seconds": time.perf_counter() - begin,
        "cases": [asdict(one) | asdict(row) | {"within": held}
                  for one, row, held in zip(asked, rows, good, strict=True)],
    }  # fmt: skip
    answered = list(zip(asked, rows, good, strict=True))
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        pages.write_result(out, "report", result, report(part, answered, result), indent=1)
    return result | {"text": report(part, _shown(answered), result)}


def built(text: str, **given: Any) -> Part:
    """What a function builds.

    Args:
        text: ``module:function``.
        **given: Its arguments.

    Raises:
        ValueError: If there is no such function, it cannot be called so, or builds no part.
    """
    module, _, name = text.partition(":")
    try:
        build: Callable[..., Any] = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"robot must be module:function, got {text!r}: {error}") from error
    try:
        part = build(**given)
    except TypeError as error:
        how = f"with the argument {' and '.join(given)}" if given else "without arguments"
        raise ValueError(
            f"robot must be a function that is called {how}, got {text!r}: {error}"
        ) from error
    if not isinstance(part, Part):
        raise ValueError(f"robot must build a Part, got {part!r} from {text!r}")
    return part


def _subject(part: Part, spine: float | None) -> Subject:
    if spine is None:
        return read(part, what=part.spec.modelname)
    springs, beams = solid(part, spine)
    return read(springs, what=part.spec.modelname, beams=beams)


def _asked(names: Sequence[str], gravity: Array) -> Iterator[Asked]:
    """All cases: how many TCAs are hot, which, and gravity."""
    fields: list[tuple[float, float, float]] = [(0.0, 0.0, 0.0)]
    if gravity.any():
        x, y, z = gravity.tolist()
        fields.append((x, y, z))
    for count in sorted({0, 1, min(2, len(names)), len(names)}):
        for place, some in enumerate(combinations(names, count)):
            for field in fields:
                close = place == 0 and count != 2 and field == fields[-1]
                yield Asked(hot=some, gravity=field, close=close)


def _answer(
    robot: Part | str, given: Mapping[str, Any], hot: Array, spine: float | None, asked: Asked
) -> Outcome:
    """The answer to one case."""
    part = robot if isinstance(robot, Part) else built(robot, **given)
    subject = _subject(part, spine)
    warm = np.array([tca.name in asked.hot for tca in part.tcas])
    still = np.zeros((len(subject.tips), 3))
    case = Case(
        temperature=np.where(warm, hot, COLD), posture="as built",
        load=Load(force=still, moment=still, gravity=np.array(asked.gravity)),
    )  # fmt: skip
    more = int(asked.close)
    return judge(subject, case, 0, Effort(cases=1, finer=0, runs=more, solvers=more))


def _within(row: Outcome, position: float, rotation: float) -> bool:
    """Whether a case has an answer within the bounds, and the simulation ends there, too."""
    gap, run = row.gap, row.run
    if gap is None or row.failure is not None:
        return False
    ran = run is None or run.position < _AS_RUN
    return gap.position < position and gap.rotation < rotation and ran


def _shown(answered: Sequence[Answer]) -> list[Answer]:
    """Of many pairs of hot TCAs only the worst at each gravity."""
    pairs = [one for one in answered if len(one[0].hot) == 2]
    fields = list(dict.fromkeys(asked.gravity for asked, _, _ in pairs))
    if len(pairs) <= _PAIRS * len(fields):
        return list(answered)
    worst = [max((one for one in pairs if one[0].gravity == field), key=_badness)
             for field in fields]  # fmt: skip
    return [one for one in answered if one not in pairs or one in worst]


def _badness(answer: Answer) -> tuple[bool, float]:
    _, row, held = answer
    return not held, np.inf if row.gap is None else row.gap.position


def report(part: Part, answered: Sequence[Answer], result: dict[str, Any]) -> str:
    """The certificate as Markdown.

    Args:
        part: What was certified.
        answered: The cases to show.
        result: As ``certify_robot`` returns it, but for the text.
    """
    bounds, cases = result["bounds"], result["cases"]
    bound = f"{100.0 * bounds['position']:g} % of L and {np.degrees(bounds['rotation']):g}°"
    chains = ", ".join(f"{name} of {member.nodes} nodes" for name, member in part.members.items())
    missed = sum(not case["within"] for case in cases)
    verdict = f"**{missed} of {len(cases)} cases are not**" if missed else "all cases are"
    pairs = sum(len(case["hot"]) == 2 for case in cases)
    more = f"; of {pairs} with two hot TCAs the worst" if len(answered) < len(cases) else ""
    return pages.page(
        pages.made_with(result), f"# {result['robot']}",
        f"{len(part.tcas)} TCAs; chains: {chains}. L is the length of the chains up to the end that"
        f" is worst. {len(cases)} cases in {result['seconds']:.0f} s{more}:",
        pages.table(["hot", "gravity [m/s²]", "bend [°]", "tip [% of L]", "rotation [°]",
                     "TCA lengths [‰]", "tension [mN]", f"within {bound}"],
                    [_line(part, *one) for one in answered]),
        list(_remarks(part, answered, cases)), f"Verdict: {verdict} within {bound}.",
    )  # fmt: skip


def _hot(part: Part, asked: Asked) -> str:
    """Which TCAs are hot, in words."""
    if len(asked.hot) == len(part.tcas) > 2:
        return "all"
    return " + ".join(asked.hot) or "none"


def _line(part: Part, asked: Asked, row: Outcome, held: bool) -> list[str]:
    """A row of the table."""
    hot, where = _hot(part, asked), " ".join(f"{each:g}" for each in asked.gravity)
    if row.gap is None:
        return [hot, where, *["-"] * 5, "**no**"]
    gap = row.gap
    figures = [np.degrees(row.bend or 0.0), 100.0 * gap.position, np.degrees(gap.rotation),
               1e3 * gap.strain, 1e3 * gap.tension]  # fmt: skip
    said = [f"{figure:.{digits}f}" for figure, digits in zip(figures, (1, 3, 3, 3, 3), strict=True)]
    return [hot, where, *said, "yes" if held else "**no**"]


def _remarks(
    part: Part, answered: Sequence[Answer], cases: Sequence[dict[str, Any]]
) -> Iterator[str]:
    """What the table does not say."""
    for name, member in part.members.items():
        missing = [motion for motion in MOTIONS if motion not in member.motions]
        if missing:
            yield f"* The chain {name} leaves out {', '.join(missing)}; theory has it."
    shear, run = ([100.0 * case[key]["position"] for case in cases if case[key] is not None]
                  for key in ("shear", "run"))  # fmt: skip
    if shear:
        yield (f"* Shear, which chains leave out, would move a tip by {max(shear):.2f} % of L at"
               " most.")  # fmt: skip
    if run:
        yield f"* {len(run)} simulations from the cold end within {max(run):.4f} % of L of that."
    apart = [case["solvers"] for case in cases if case["solvers"] is not None]
    if apart:
        yield f"* Two solvers of the theory differ by {max(apart):.0e} m at most."
    for asked, row, _ in answered:
        if row.failure is not None:
            yield f"* No answer with {_hot(part, asked)} hot: {row.failure}."
        elif row.elsewhere:
            yield (f"* With {_hot(part, asked)} hot the body has two states at rest: left alone the"
                   " chain sinks to the one, theory found the other; compared are those next to"
                   " each other.")  # fmt: skip

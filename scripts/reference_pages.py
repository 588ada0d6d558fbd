"""The reference of the site, written from the code: tasks, robots and modules, commands, names.

``scripts/build_site.py`` asks for it; none of these pages is kept, or typed by hand.
"""

import argparse
import inspect
import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_type_hints

import gymnasium as gym
from api_pages import api, plain, prose, section, signature
from gait_page import HEADS, rows_of
from results_page import table as table_of_results

import tca_mj
from tca_mj import pages
from tca_mj.agents.policies import SavedPolicy, shipped
from tca_mj.agents.train.config import default_config, described
from tca_mj.certify import SUBJECTS
from tca_mj.checks import shown
from tca_mj.cli import _parser
from tca_mj.registry import DEMOS, TASKS, recipes

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
_SOURCE = re.compile(r"[.,;:] +((?:an? )?(?:Sun\b|[Ee]stimate|[Ff]itted|[Mm]easured).*)$")
_UNIT = re.compile(r"\s*\[([^\]]+)\]")


def slug(task: str) -> str:
    """What the page of a task is called."""
    return task.partition("/")[2]


def texts() -> dict[str, str]:
    """The guides in ``docs``, by file name."""
    paths = (path for path in sorted(DOCS.glob("*.md")) if path.name != "README.md")
    return {path.name: path.read_text(encoding="utf-8") for path in paths}


def links(guides: Mapping[str, str], names: Iterable[str]) -> str:
    """Links to guides, called by their titles."""
    titles = {name: guides[name].partition("\n")[0].strip("# ") for name in names}
    return ", ".join(f"[{title}]({name})" for name, title in titles.items())


def first_line(value: Any) -> str:
    """What a docstring begins with, as Markdown."""
    return plain((inspect.getdoc(value) or "").partition("\n\n")[0])


# Tasks


def task_page(id: str, guides: Mapping[str, str], log: Sequence[str]) -> str:
    """All that the code knows of a task."""
    env = gym.make(id, disable_env_checker=True)
    task: Any = env.unwrapped
    kind, steps = type(task), env.spec.max_episode_steps  # type: ignore[union-attr]
    observation = task.observation.markdown()
    own = [name for name, text in guides.items() if observation in text]
    home = (ROOT / "README.md").read_text("utf-8").replace("docs/pictures/", "pictures/")
    shown = re.findall(r"^!\[.*?\]\(pictures/.*?\)", guides[own[0]] + home, re.MULTILINE)
    named = f"(pictures/{own[0].removesuffix('.md')}."
    pictures = [picture for picture in shown if named in picture] + shown
    policies = {name: SavedPolicy.read(path) for name, path in shipped().items()}
    policies = {name: policy for name, policy in policies.items() if policy.task == id}
    robot = kind.robot_argument
    demos = [demo.name for demo in DEMOS.values() if demo.task == id]
    known = list(recipes(id))
    told = ", ".join(f"`{name}={value!r}`" for name, value in kind.scripted_arguments.items())
    facts = {
        "class": f"[`{kind.__name__}`](api/tca_mj.envs.md#{kind.__name__.lower()})",
        "robot": f"argument `{robot[0]}`, {_link(robot[1]())}" if robot else "",
        "a step": f"{task.control_period:g} s",
        "an episode": f"{steps} steps, {steps * task.control_period:g} s",
        "numbers of an action": f"{task.action_space.shape[0]}",
        "numbers of an observation": f"{task.observation_space.shape[0]}",
        "a TCA is asked for at most": f"{task.safe_temperature:g} °C",
        "an episode ends at": f"{task.max_temperature:g} °C",
        "scripted policy": f"`scripted`{told and f', made with {told}'}",
        "demo": ", ".join(f"`tca-mj demo {name}`" for name in demos),
        "learned policies": ", ".join(f"`{name}` ({policy.kind} by {policy.origin.algorithm})"
                                      for name, policy in policies.items()),
        "finer models": ", ".join(f"`{name}`" for name in kind.finer),
        "learned by": described(default_config(id, known[0])).partition(": ")[2] if known else "",
    }  # fmt: skip
    curves = [f"![Learning curve of {name}](pictures/curve_{name}.png)" for name in policies
              if (DOCS / "pictures" / f"curve_{name}.png").is_file()]  # fmt: skip
    text = pages.page(
        f"# `{id}`", first_line(kind), *pictures[:1], _film(id),
        f"Guide: {links(guides, own)}.",
        pages.table(["what", "value"], ([name, fact] for name, fact in facts.items() if fact)),
        "## What it is", prose(kind).partition("\n\n")[2], "## Observation", observation,
        "## Action", task.action.markdown(), "## Options of `reset`", task.options.markdown(),
        *_results(id), *(["## Learning", *curves] if curves else []),
        *(["## History", "\n".join(line for line in log if slug(id) in line)]),
    )  # fmt: skip
    env.close()
    return text


def _film(id: str) -> str:
    """An episode, moving when it is asked for; `scripts/task_films.py` draws them."""
    path = f"pictures/film_{slug(id).partition('-')[0]}.webp"
    if not (DOCS / path).is_file():
        return ""
    return (
        "<details><summary>An episode, moving</summary>\n"
        f'<img loading="lazy" src="{path}" alt="An episode of {id} by a policy of this package">\n'
        "</details>"
    )


def _results(id: str) -> list[str]:
    """The tables of how good policies are."""
    results, gaits = (
        json.loads((DOCS / f"{name}.json").read_text("utf-8")) for name in ("results", "gaits")
    )
    found = []
    if id in results:
        found += ["## Results", "How and on what: [results](results.md).",
                  "\n".join(table_of_results(id, results[id]))]  # fmt: skip
    if id in gaits:
        found += ["## Several seeds", "How and on what: [gaits](gaits.md).",
                  "\n".join(pages.table(HEADS, rows_of(gaits[id])))]  # fmt: skip
    return found


# Robots and modules


def specs() -> dict[type, list[str]]:
    """Builders of parts by what they are told; all that is public and takes a ``spec``."""
    found: dict[type, list[str]] = {}
    for package in (tca_mj.modules, tca_mj.robots, tca_mj):
        for name in package.__all__:
            value = getattr(package, name)
            if not inspect.isfunction(value) or "spec" not in inspect.signature(value).parameters:
                continue
            hints = get_type_hints(value)
            kinds = [kind for kind in _options(hints["spec"]) if is_dataclass(kind)]
            within = value.__module__.startswith(("tca_mj.modules", "tca_mj.robots"))
            part = within and hints["return"] is tca_mj.Part
            if part and kinds and value not in found.setdefault(kinds[0], []):
                found[kinds[0]].append(value)
    return found


def _options(hint: Any) -> tuple[Any, ...]:
    return getattr(hint, "__args__", None) or (hint,)


def _link(value: Any) -> str:
    """A specification as a word, with a link to its page where it has one."""
    for name, known in tca_mj.CATALOGUE.items():
        if value == known:
            return f"[`{name}`](catalogue.md)"
    kind = type(value)
    if kind in specs():
        return f"[`{kind.__name__}`]({kind.__name__}.md)"
    return f"`{kind.__name__}`"


def cell(value: Any) -> str:
    """A value in a table."""
    if is_dataclass(value):
        return _link(value)
    if isinstance(value, bool | int) or value is None:
        return str(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple | list):
        return ", ".join(cell(each) for each in value) or "none"
    return f"`{shown(value)}`"


def rows(spec: Any) -> Iterator[list[str]]:
    """The fields of a specification: name, value, unit, what it is, and where it comes from."""
    said = section(type(spec), "Attributes")
    for field in fields(spec):
        text = next((text for names, text in said.items()
                     if field.name in names.replace(",", " ").split()), "")  # fmt: skip
        unit = _UNIT.search(text)
        what, source, *_ = [*_SOURCE.split(" ".join(_UNIT.sub("", text, count=1).split())), ""]
        yield [f"`{field.name}`", cell(getattr(spec, field.name)), unit[1] if unit else "",
               plain(what), plain(source)]  # fmt: skip


def nested(spec: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Specifications inside another one that have no page of their own, by their paths."""
    for field in fields(spec):
        value = getattr(spec, field.name)
        if not is_dataclass(value) or "](" in _link(value):
            continue
        yield f"{path}{field.name}", value
        yield from nested(value, f"{path}{field.name}.")


def spec_page(kind: type, builders: Sequence[Any], guides: Mapping[str, str]) -> str:
    """A robot or a module: how it is built, what it is told, and how accurate it is."""
    heads = ["field", "value", "unit", "what", "source"]
    spec, names = kind(), [builder.__name__ for builder in builders]
    home = sys.modules[kind.__module__]
    calls = "|".join([kind.__name__, *(rf"`{name}`|\b{name}\(" for name in names)])
    naming = [name for name, text in guides.items() if re.search(calls, text)]
    own = kind.__module__.rpartition(".")[2].replace("_", "-")
    certified = [line for line in guides["accuracy.md"].partition("## Order")[0].splitlines()
                 if re.match(rf"\| ({own}(-\w+)?|module) \|", line)]  # fmt: skip
    subjects = [name for name in SUBJECTS if re.fullmatch(rf"{own}(-\w+)*", name)]
    sections = "|".join(re.findall(r"\d\.\d(?:\.\d)?", inspect.getdoc(home).partition("\n")[0]))
    judged = "\n".join(text for name, text in guides.items() if name.startswith("validation"))
    about = re.compile(rf"\| (Section ({sections or 'none'})(?!\d)|source \|)")
    facts = [line for line in judged.splitlines() if about.match(line)]
    seen: list[Any] = []
    more = []
    for path, value in nested(spec):
        if value not in seen:
            more += [f"### `{path}`: `{type(value).__name__}`", pages.table(heads, rows(value))]
            seen.append(value)
    return pages.page(
        f"# `{kind.__name__}`", prose(home),
        f"Guides that name it: {links(guides, naming)}." * bool(naming),
        "## How it is built",
        *(block for builder in builders
          for block in (f"```python\n{signature(builder.__name__, builder, {})}\n```",
                        prose(builder))),
        "## What it is told", prose(kind, without=("Attributes",)),
        pages.table(heads, rows(spec)),
        *(["## What is inside", *more] if more else []),
        *(["## How accurate it is", "How and by what: [accuracy](accuracy.md).",
           titled(certified)] if len(certified) > 1 else []),
        *([f"Anew: `tca-mj certify {' '.join(subjects)}`."] if subjects else []),
        *(["## Published facts", "What a verdict means, and why some are missed:"
           " [validation](validation.md).", titled(facts)] if len(facts) > 1 else []),
    )  # fmt: skip


def titled(lines: Sequence[str]) -> list[str]:
    """Lines of tables with one head, which comes first."""
    head, *rest = dict.fromkeys(lines)
    return [head, "|---" * (head.count("|") - 1) + "|", *rest]


def catalogue_page() -> str:
    """The TCAs of the catalogue side by side."""
    known = tca_mj.CATALOGUE
    columns = [{row[0]: row for row in rows(spec)} for spec in known.values()]
    fibres = [{f"`fibre.{row[0][1:]}": row for row in rows(spec.fibre)} for spec in known.values()]
    columns = [one | other for one, other in zip(columns, fibres, strict=True)]
    lines = (
        [name, *(column[name][1] for column in columns), *columns[0][name][2:]]
        for name in columns[0] if name != "`fibre`"
    )  # fmt: skip
    return pages.page(
        "# The catalogue of TCAs", prose(sys.modules[tca_mj.TcaSpec.__module__]),
        "How they were found, and which facts they give: [twisted-and-coiled actuators](tca.md).",
        pages.table(["field", *(f"`{name}`" for name in known), "unit", "what", "source"], lines),
    )  # fmt: skip


# The command line


def command_page() -> str:
    """What every command takes, as its parser says it."""
    parser = _parser()
    commands = next(action for action in parser._actions
                    if isinstance(action, argparse._SubParsersAction))  # fmt: skip
    abouts = {action.dest: action.help for action in commands._choices_actions}
    blocks = ["# The command line", plain(parser.description or ""),
              f"```text\n{(parser.epilog or '').partition(chr(10))[2].rstrip()}\n```"]  # fmt: skip
    for name, command in commands.choices.items():
        about = command.description or abouts[name] or ""
        shaped = "\n " in about
        said = f"```text\n{about.rstrip()}\n```" if shaped else plain(about)
        blocks += [f"## `tca-mj {name}`", said]
        arguments = []
        for action in command._actions:
            if action.dest == "help":
                continue
            words = action.option_strings or [action.metavar or action.dest]
            value = "" if action.nargs == 0 or not action.option_strings else _value(action)
            arguments.append([f"`{', '.join(map(str, words))}{value}`", plain(action.help or "")])
        blocks.append("\n".join(pages.table(["argument", "what"], arguments)))
    return pages.page(*blocks)


def _value(action: argparse.Action) -> str:
    if action.metavar is None and action.choices:
        return f" {{{','.join(map(str, action.choices))}}}"
    if action.nargs == 0 or isinstance(action, argparse.BooleanOptionalAction):
        return ""
    return f" {action.metavar or action.dest.upper()}"


# All of it


def reference() -> dict[str, tuple[str, list[str]]]:
    """All pages by path, each with the paths of those that are listed below it."""
    guides = texts()
    log = re.findall(r"^- .*(?:\n  .*)*", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    tasks = {f"{slug(task.id)}.md": task_page(task.id, guides, log) for task in TASKS}
    listed = ([f"[`{task.id}`]({slug(task.id)}.md)", first_line(tca_mj.task_class(task.id))]
              for task in TASKS)  # fmt: skip
    all_tasks = pages.page("# All tasks", "What they share: [tasks](tasks.md).",
                           pages.table(["task", "what it asks for"], listed))  # fmt: skip

    kinds = specs()
    robots = {f"{kind.__name__}.md": spec_page(kind, builders, guides)
              for kind, builders in kinds.items()}  # fmt: skip
    listed = ([f"[`{kind.__name__}`]({kind.__name__}.md)", f"`{builder.__name__}`",
               first_line(sys.modules[kind.__module__])]
              for kind, builders in kinds.items() for builder in builders)  # fmt: skip
    all_robots = pages.page("# All robots and modules",
                            pages.table(["told by", "built by", "what"], listed))  # fmt: skip
    robots["catalogue.md"] = catalogue_page()

    names = api()
    listed = ([f"[`{path[4:-3]}`]({path})", text.split("\n\n")[1].replace("\n", " ")]
              for path, text in names.items())  # fmt: skip
    all_names = pages.page("# All public names", pages.table(["package", "what"], listed))

    found = {path: (text, []) for path, text in (tasks | robots | names).items()}
    return found | {
        "all-tasks.md": (all_tasks, [*tasks]), "all-robots.md": (all_robots, [*robots]),
        "all-names.md": (all_names, [*names]), "commands.md": (command_page(), []),
    }  # fmt: skip

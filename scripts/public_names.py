"""Writes what the package promises: its public names, how they are called, and its tasks.

    python scripts/public_names.py           writes tests/public_names.txt
    python scripts/public_names.py --print   shows it

``tests/test_public_names.py`` compares the file with the code: who changes a name, a parameter or
a default writes it anew, and the difference is what the release notes have to say.
"""

import inspect
from enum import Enum
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from api_pages import PACKAGES

from tca_mj.checks import shown
from tca_mj.files import write_whole
from tca_mj.pages import command_line
from tca_mj.registry import TASKS

PROMISED = (*PACKAGES, "tca_mj.testing")
FILE = Path(__file__).resolve().parent.parent / "tests" / "public_names.txt"


def _default(value: Any) -> str:
    """A default as the file has it: the name of what is called, ``...`` for what is made anew."""
    if inspect.isroutine(value) or inspect.isclass(value):
        return value.__name__
    if isinstance(value, Enum):
        return f"{type(value).__name__}.{value.name}"
    text = shown(value)
    return "..." if " object at " in text or "<factory>" in text else text


def called(value: Any) -> str:
    """Parameters and defaults of what can be called, without types; empty for what cannot."""
    try:
        found = inspect.signature(value)
    except (TypeError, ValueError):
        return ""
    parts: list[str] = []
    starred = slashed = False
    for each in found.parameters.values():
        if each.kind is each.POSITIONAL_ONLY:
            slashed = True
        elif slashed:
            parts, slashed = [*parts, "/"], False
        if each.kind is each.KEYWORD_ONLY and not starred:
            parts.append("*")
        starred = starred or each.kind in (each.KEYWORD_ONLY, each.VAR_POSITIONAL)
        stars = {each.VAR_POSITIONAL: "*", each.VAR_KEYWORD: "**"}.get(each.kind, "")
        given = "" if each.default is each.empty else f"={_default(each.default)}"
        parts.append(f"{stars}{each.name}{given}")
    return f"({', '.join(part for part in parts if part not in ('self', 'cls'))})"


def members(kind: type) -> list[str]:
    """Public methods and properties that a class has from this package, each with its call."""
    found = {}
    for base in reversed([each for each in kind.__mro__ if each.__module__.startswith("tca_mj")]):
        for name, value in vars(base).items():
            value = getattr(value, "__func__", value)
            alone = isinstance(value, property)
            if not name.startswith("_") and (alone or inspect.isroutine(value)):
                found[name] = "" if alone else called(value)
    return [f"{name}{how}" for name, how in sorted(found.items())]


def offered(module: ModuleType) -> list[str]:
    """Names that a module offers: its ``__all__``, else what it defines without an underscore."""
    own = (name for name, value in vars(module).items() if not name.startswith("_")
           and getattr(value, "__module__", "") == module.__name__)  # fmt: skip
    return getattr(module, "__all__", None) or sorted(own)


def promised() -> list[str]:
    """The lines of the file: tasks and lengths of their episodes, then names by package."""
    lines = [f"task {task.id} {task.max_episode_steps}" for task in TASKS]
    modules = [import_module(package) for package in PROMISED]
    homes = {id(getattr(module, name)): module.__name__
             for module in modules for name in offered(module)}  # fmt: skip
    for module in modules:
        package = module.__name__
        for name in offered(module):
            value = getattr(module, name)
            if homes[id(value)] != package:
                lines.append(f"{package}.{name} is {homes[id(value)]}.{name}")
                continue
            routine = inspect.isclass(value) or inspect.isfunction(value)
            lines.append(f"{package}.{name}{called(value) if routine else ''}")
            if inspect.isclass(value):
                lines += [f"{package}.{name}.{member}" for member in members(value)]
    return lines


if __name__ == "__main__":
    parser = command_line(__doc__)
    parser.add_argument("--print", action="store_true", help="show it, write nothing")
    text = "\n".join(promised()) + "\n"
    if parser.parse_args().print:
        print(text, end="")
    else:
        write_whole(FILE, text.encode())

"""What the code says of itself as Markdown: docstrings, signatures, and the public names.

``scripts/build_site.py`` makes the reference of the site of it; nothing here is typed by hand.
"""

import ast
import inspect
import re
import sys
import textwrap
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, get_args, get_origin

from tca_mj import pages
from tca_mj.checks import shown

PACKAGES = (
    "tca_mj", "tca_mj.tca", "tca_mj.tca.identify", "tca_mj.tca.design", "tca_mj.rod", "tca_mj.smp",
    "tca_mj.control", "tca_mj.model", "tca_mj.modules", "tca_mj.robots", "tca_mj.record",
    "tca_mj.envs", "tca_mj.agents", "tca_mj.agents.model", "tca_mj.agents.policies",
    "tca_mj.agents.scripts", "tca_mj.agents.train", "tca_mj.certify", "tca_mj.validation",
)  # fmt: skip
OFFERED = frozenset(name for package in PACKAGES for name in import_module(package).__all__)
_CODE = re.compile(r"(``.+?``|`[^`]+`)", re.DOTALL)
_NAMED = re.compile(r"^(\S[^:\n]*):\s+", re.MULTILINE)
_SECTIONS = {"Args": "Arguments", "Attributes": "Attributes", "Returns": "Returns",
             "Yields": "Yields", "Raises": "Raises", "Example": "Example"}  # fmt: skip


def plain(text: str) -> str:
    """Text of a docstring on one line, as Markdown that shows it as it is."""
    parts = _CODE.split(" ".join(text.split()))
    return "".join(
        part if i % 2 else re.sub(r"([<\[\]|])", r"\\\1", part) for i, part in enumerate(parts)
    )


def entries(block: str) -> dict[str, str]:
    """What a section of a docstring says of each name."""
    _, *parts = _NAMED.split(textwrap.dedent(block))
    return dict(zip(parts[::2], parts[1::2], strict=True))


def section(value: Any, name: str) -> dict[str, str]:
    """The entries of a section of a docstring, none if it has no such section."""
    found = re.search(rf"^{name}:\n((?: +.*\n|\n)+)", inspect.getdoc(value) + "\n", re.MULTILINE)
    return entries(found[1]) if found else {}


def prose(value: Any, *, without: tuple[str, ...] = ()) -> str:
    """A docstring as Markdown, without some of its sections."""
    blocks: list[str] = []
    left_out = False
    for block in re.split(r"\n\s*\n", inspect.getdoc(value) or ""):
        lead, _, rest = block.partition("\n    ") if block[0] != " " else ("", "", block.strip())
        if lead:
            left_out = lead.rstrip(":") in without
        if left_out:
            continue
        title = _SECTIONS.get(lead.rstrip(":"))
        blocks.append(f"**{title}**" if title else lead if "\n* " in lead else plain(lead))
        rest = textwrap.dedent(" " * 4 + rest) if rest else ""
        if rest.startswith(">>>"):
            blocks.append(f"```pycon\n{rest}\n```")
        elif lead.startswith("Reward"):
            rows = ([f"`{name}`", plain(said)] for name, said in entries(rest).items())
            blocks += ["\n".join(pages.table(["term", "what it pays for"], rows))]
        elif named := entries(rest):
            blocks.append("\n".join(f"* `{each.strip('* ')}`: {plain(named[each])}"
                                    for each in named))  # fmt: skip
        elif rest:
            blocks.append(plain(rest))
    return pages.page(*blocks)


class _Bare(str):
    """Text that is its own ``repr``, as ``inspect`` writes annotations and defaults."""

    __repr__ = str.__str__


def readable(annotation: Any, home: ModuleType, names: dict[str, Any]) -> str:
    """A type in few words; the named types of this package that it uses are noted in ``names``."""
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    text = re.sub(r"ForwardRef\('(.*?)'\)", r"\1", text.replace("NDArray[np.float64]", "Array"))
    text = re.sub(r"\b(?:\w+\.)+(?=[A-Za-z_])", "", text)
    text = re.sub(r"Annotated\[((?:[^,\[\]]|\[[^\]]*\])*), (?:[^\[\]]|\[[^\]]*\])*\]", r"\1", text)

    def folded(found: re.Match[str]) -> str:
        value = getattr(home, found[0], None)
        if get_origin(value) is not Annotated:
            return found[0]
        if found[0].startswith("_") or found[0] in OFFERED:
            return readable(get_args(value)[0], home, names)
        names[found[0]] = value
        return found[0]

    return re.sub(r"\b[A-Z_]\w*", folded, text)


def bounds(annotated: Any) -> str:
    """What a named type admits, from its check."""
    kind, check = get_args(annotated)[:2]
    base = readable(kind, sys.modules[__name__], {}).replace("ndarray[tuple[Any, ...], ", "Array[")
    words = [f"`{re.sub(r'Array.dtype.float64..', 'Array', base)}`"]
    if isinstance(check, partial):
        words += [f"{name.replace('_', ' ')} {value:g}" for name, value in check.keywords.items()
                  if isinstance(value, int | float)]  # fmt: skip
        words += [f"in {check.keywords['unit']}"] if check.keywords.get("unit") else []
    return ", ".join(words)


def signature(name: str, value: Callable[..., Any], names: dict[str, Any]) -> str:
    """How something is called, as code."""
    home = sys.modules[value.__module__]
    try:
        found = inspect.signature(value)
    except ValueError:  # what C code or an enumeration does not tell
        return f"{name}(...)"

    def typed(annotation: Any) -> Any:
        if annotation is inspect.Signature.empty:
            return annotation
        return _Bare(readable(annotation, home, names))

    def of(parameter: inspect.Parameter) -> str:
        default = parameter.default
        if default is not parameter.empty:
            factory = "<factory>" in repr(default) or " object at " in repr(default)
            default = _Bare("..." if factory else shown(default))
        return str(parameter.replace(annotation=typed(parameter.annotation), default=default))

    parameters = [each for each in found.parameters.values() if each.name not in ("self", "cls")]
    parts, starred = [], False
    for each in parameters:
        if each.kind is each.KEYWORD_ONLY and not starred:
            parts.append("*")
        starred = starred or each.kind in (each.KEYWORD_ONLY, each.VAR_POSITIONAL)
        parts.append(of(each))
    returned = typed(found.return_annotation)
    arrow = "" if returned is inspect.Signature.empty else f" -> {returned}"
    line = f"{name}({', '.join(parts)}){arrow}"
    return line if len(line) <= 80 else f"{name}(\n    {f',{chr(10)}    '.join(parts)},\n){arrow}"


def _members(kind: type) -> Iterator[tuple[str, Any]]:
    """Public methods and properties that a class has of its own."""
    for name, value in vars(kind).items():
        value = value.__func__ if isinstance(value, classmethod | staticmethod) else value
        if name.startswith("_") or not (inspect.isfunction(value) or isinstance(value, property)):
            continue
        if inspect.getdoc(value):
            yield name, value


def _constant(name: str, value: Any, package: ModuleType) -> str:
    """A constant: its value, and what the file that has it says in a comment or below it."""
    stub = Path(package.__file__ or "").with_suffix(".pyi").read_text(encoding="utf-8")
    homes = {alias.name: str(node.module) for node in ast.parse(stub).body
             if isinstance(node, ast.ImportFrom) for alias in node.names}  # fmt: skip
    source = inspect.getsource(import_module(homes[name]))
    body = ast.parse(source).body
    said = ""
    for node, after in zip(body, [*body[1:], None], strict=True):
        targets = [node.target] if isinstance(node, ast.AnnAssign) else getattr(node, "targets", [])
        if name in [target.id for target in targets if isinstance(target, ast.Name)]:
            lines = source.splitlines()[node.lineno - 1 : node.end_lineno]
            notes = (line.partition("  # ")[2] for line in lines)
            said = " ".join(note for note in notes if note and not note.startswith("fmt"))
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                said = str(after.value.value)
    return pages.page(f"```text\n{name} = {shown(value)}\n```", plain(said))


def described(name: str, value: Any, package: ModuleType, names: dict[str, Any]) -> str:
    """A public name as Markdown, with a heading of the second level."""
    heading = f"## `{name}`"
    if not (inspect.isclass(value) or inspect.isfunction(value)):
        return pages.page(heading, _constant(name, value, package))
    called = signature(name, value, names)
    if inspect.isclass(value):
        called = f"class {called.removesuffix(' -> None')}"
    blocks = [heading, f"```python\n{called}\n```", prose(value)]
    if inspect.isclass(value):
        for member, found in _members(value):
            if isinstance(found, property):
                line = signature(f"{name}.{member}", found.fget, names).replace("() ->", ":")
            else:
                line = signature(f"{name}.{member}", found, names)
            blocks += [f"```python\n{line}\n```", prose(found)]
    return pages.page(*blocks)


def api() -> dict[str, str]:
    """The pages of the public packages, and of the types that their signatures name, by path."""
    homes = {id(getattr(import_module(package), name)): package
             for package in PACKAGES for name in import_module(package).__all__}  # fmt: skip
    names: dict[str, Any] = {}
    found = {}
    for package in PACKAGES:
        module = import_module(package)
        offered = {name: getattr(module, name) for name in module.__all__}
        own = {name: value for name, value in offered.items() if homes[id(value)] == package}
        other = (
            [f"`{name}`", f"[`{homes[id(value)]}`]({homes[id(value)]}.md#{name.lower()})"]
            for name, value in offered.items() if name not in own
        )  # fmt: skip
        elsewhere = pages.table(["name", "explained with"], other) if own != offered else ""
        found[f"api/{package}.md"] = pages.page(
            f"# `{package}`", prose(module), elsewhere,
            *(described(name, value, module, names) for name, value in own.items()),
        )  # fmt: skip
    rows = ([f"`{name}`", bounds(value)] for name, value in sorted(names.items()))
    found["api/types.md"] = pages.page(
        "# Named types",
        "What a signature names is checked where it comes in; `ValueError` says the bound.",
        pages.table(["type", "what it admits"], rows),
    )
    return found

"""What ``help`` says of every name that a package offers: enough to use it, and short."""

from __future__ import annotations

import ast
import doctest
import inspect
import pydoc
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, is_typeddict

import pytest
from test_architecture import FILES
from test_names import offered

import tca_mj

SECTION = re.compile(r"^(Args|Attributes|Returns|Yields|Raises|Example):$", re.MULTILINE)
# A unit in brackets, or a word of what has none, or has that of something else.
UNIT = re.compile(
    r"\[[^\]]+\]|°|\b(share|factor|ratio|relative|coefficients?|number of|ids of|index of"
    r"|whether|in the unit|unit of|as in|see|quaternion)\b|\bas ``",
    re.IGNORECASE,
)
NUMBER = re.compile(
    r"^(float|ArrayLike|Array|NDArray\[np\.float64\]|Positives?|NotNegatives?|Finite|Temperature"
    r"|Triple|Annotated\[float.*)( \| .*)?$"
)


def once() -> dict[str, Any]:
    """What is offered, each under the first name that it has."""
    found: dict[int, tuple[str, Any]] = {}
    for name, value in offered().items():
        found.setdefault(id(value), (name, value))
    return dict(found.values())


PUBLIC = once()
FUNCTIONS = {name: value for name, value in PUBLIC.items() if inspect.isfunction(value)}
CLASSES = {name: value for name, value in PUBLIC.items() if inspect.isclass(value)}
CONSTANTS = [name for name in PUBLIC if name not in {**FUNCTIONS, **CLASSES}]


def sections(text: str) -> dict[str, str]:
    """A docstring by section; what stands before the first one is ``""``."""
    first, *rest = SECTION.split(inspect.cleandoc(text))
    return {"": first, **dict(zip(rest[::2], rest[1::2], strict=True))}


def entries(section: str) -> dict[str, str]:
    """What a section says of each name; two names may share a line."""
    lines = textwrap.dedent(section.strip("\n"))
    parts = re.split(r"^(\S[^:\n]*):", lines, flags=re.MULTILINE)[1:]
    return {
        name.strip("* "): said
        for names, said in zip(parts[::2], parts[1::2], strict=True) for name in names.split(",")
    }  # fmt: skip


def definition(value: Any) -> ast.FunctionDef | ast.ClassDef:
    """The source of a function or a class."""
    (node,) = ast.parse(textwrap.dedent(inspect.getsource(value))).body
    assert isinstance(node, ast.FunctionDef | ast.ClassDef)
    return node


def raised(node: ast.AST) -> Iterator[str]:
    """Names of the errors that a body raises itself, not those of functions inside it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            continue
        if isinstance(child, ast.Raise) and child.exc is not None:
            error = child.exc.func if isinstance(child.exc, ast.Call) else child.exc
            if isinstance(error, ast.Name) and error.id[0].isupper():
                yield error.id
        yield from raised(child)


def said(texts: list[str], *titles: str) -> dict[str, str]:
    """What the sections of some titles in some docstrings say, by name."""
    return {
        name: words
        for text in texts for title in titles
        for name, words in entries(sections(text).get(title, "")).items()
    }  # fmt: skip


def complaints(types: dict[str, str], words: dict[str, str], title: str) -> list[str]:
    """What is not said of names, with their types, that should be."""
    found = [f"{name} is not under {title}" for name in types if name not in words]
    return found + [
        f"{name} has no unit" for name, type in types.items()
        if NUMBER.match(type) and name in words and not UNIT.search(words[name])
    ]  # fmt: skip


def parameters(function: Any) -> dict[str, str]:
    """Its parameters and their types as written, without ``self``."""
    found = inspect.signature(function).parameters.values()
    return {each.name: str(each.annotation) for each in found if each.name not in ("self", "cls")}


def complaints_of_function(function: Any, texts: list[str] | None = None) -> list[str]:
    """What the docstring of a function leaves open; ``texts`` if there are others to read."""
    texts = texts or [function.__doc__ or ""]
    found = complaints(parameters(function), said(texts, "Args", "Attributes"), "Args")
    errors = said(texts, "Raises")
    found += [
        f"{error} is not under Raises" for error in set(raised(definition(function)))
        if error not in errors
    ]  # fmt: skip
    returned = str(inspect.signature(function).return_annotation)
    first = sections(texts[0])
    if NUMBER.match(returned) and not UNIT.search(first[""] + first.get("Returns", "")):
        found.append("what it returns has no unit")
    return found


def complaints_of_class(kind: Any) -> list[str]:
    """What the docstrings of a class leave open: of a value its fields, else what builds it."""
    texts = [inspect.cleandoc(each.__doc__ or "") for each in (*kind.__mro__[:-1], kind.__init__)]
    if issubclass(kind, BaseException):
        return []
    if is_dataclass(kind) or hasattr(kind, "_fields") or is_typeddict(kind):
        types = {each.name: str(each.type) for each in fields(kind)} if is_dataclass(kind) else {
            name: getattr(type, "__forward_arg__", str(type))
            for name, type in kind.__annotations__.items()
        }  # fmt: skip
        public = {name: type for name, type in types.items() if not name.startswith("_")}
        return complaints(public, said(texts, "Attributes"), "Attributes")
    if getattr(kind, "_is_protocol", False) or "__init__" not in kind.__dict__:
        return []
    return complaints_of_function(kind.__init__, texts)


def home(name: str) -> Path:
    """The file in which what a package offers is defined."""
    package, _, short = name.rpartition(".")
    stub = Path(import_module(package).__file__ or "").with_suffix(".pyi")
    source = stub if stub.exists() else stub.with_suffix(".py")
    for node in ast.parse(source.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and short in [alias.name for alias in node.names]:
            return FILES[str(node.module)]
    raise LookupError(name)


def explained(name: str, source: str) -> bool:
    """Whether a constant has a comment on or above its line, or a text below it."""
    lines = [line.replace("# fmt: skip", "") for line in source.splitlines()]
    body = ast.parse(source).body
    (at,) = [
        i for i, node in enumerate(body) if isinstance(node, ast.Assign | ast.AnnAssign)
        if ast.unparse(getattr(node, "target", None) or node.targets[0]) == name
    ]  # fmt: skip
    start, end = lines[body[at].lineno - 1], lines[(body[at].end_lineno or 0) - 1]
    below = isinstance(body[at + 1], ast.Expr) if at + 1 < len(body) else False
    return "  # " in start + end or lines[body[at].lineno - 2].startswith("# ") or below


def signatures() -> Iterator[tuple[str, inspect.Signature]]:
    """Of all functions, classes and their methods; errors are no functions of anything."""
    for name, value in {**FUNCTIONS, **CLASSES}.items():
        if not (inspect.isclass(value) and issubclass(value, BaseException | dict)):
            yield name, inspect.signature(value)
        for key, method in vars(value).items() if inspect.isclass(value) else ():
            method = getattr(method, "__func__", method)
            if inspect.isfunction(method) and not key.startswith("_"):
                yield f"{name}.{key}", inspect.signature(method)


def test_the_first_paragraph_is_a_sentence():
    texts = {name: value.__doc__ or "" for name, value in {**FUNCTIONS, **CLASSES}.items()}
    firsts = {name: inspect.cleandoc(text).split("\n\n")[0] for name, text in texts.items()}
    assert {
        name: first for name, first in firsts.items()
        if not first.endswith((".", ":")) or len(first.split()) < 3
        or first.startswith(f"{name.rpartition('.')[2]}(")  # what a dataclass says by itself
    } == {}  # fmt: skip


def test_functions_say_what_they_take_and_give():
    found = {name: complaints_of_function(function) for name, function in FUNCTIONS.items()}
    assert {name: said for name, said in found.items() if said} == {}


def test_classes_say_what_they_have():
    found = {name: complaints_of_class(kind) for name, kind in CLASSES.items()}
    assert {name: said for name, said in found.items() if said} == {}


def test_every_method_says_what_it_does():
    assert [
        f"{name}.{key}"
        for name, kind in CLASSES.items() for key, value in vars(kind).items()
        if not key.startswith("_") and not inspect.getdoc(getattr(kind, key))
        if isinstance(value, property | classmethod | staticmethod) or inspect.isfunction(value)
    ] == []  # fmt: skip


def test_constants_say_what_they_are():
    assert [
        name for name in CONSTANTS
        if not explained(name.rpartition(".")[2], home(name).read_text(encoding="utf-8"))
    ] == []  # fmt: skip


def test_signatures_are_short():
    """Three lines of a terminal, or more where there are many parameters; types by their names."""
    assert {
        name: str(signature) for name, signature in signatures()
        if len(str(signature)) > max(3 * 80, 50 * len(signature.parameters))
        or re.search(r"numpy\.|functools|Union\[", str(signature))
    } == {}  # fmt: skip


def test_help_fits_on_a_screen():
    """What one looks up first, on a terminal of 24 lines of 80."""
    shown = pydoc.plain(pydoc.render_doc(tca_mj.tca.hanging_length)).rstrip().splitlines()
    assert sum(max(1, -(-len(line) // 80)) for line in shown) <= 24


# Those that documentation, examples and scripts name most, ordinary words left out.
MOST_USED = {
    "tca_mj": "Part Simulation Supply TcaBank TcaSpec add_chain add_tca arm finger_pair make"
    " new_spec parallel BendingSpec bending_module TwistingSpec twisting_module Helix",
    "tca_mj.tca": "law_at", "tca_mj.rod": "solve_static", "tca_mj.model": "settle",
    "tca_mj.envs": "TetrapodGait", "tca_mj.agents": "play",
    "tca_mj.agents.policies": "load_policy", "tca_mj.agents.scripts": "gait_policy",
}  # fmt: skip


def examples() -> dict[str, doctest.DocTest]:
    """All examples in docstrings of what is offered, by name."""
    read, found = doctest.DocTestParser(), {}
    for name, value in {**FUNCTIONS, **CLASSES}.items():
        text = inspect.cleandoc(value.__doc__ or "")
        if ">>>" in text:
            assert "\nExample:\n" in text, name
            found[name] = read.get_doctest(text, {}, name, inspect.getfile(value), 0)
    return found


def test_what_is_used_most_has_an_example():
    named = {f"{package}.{name}" for package, all in MOST_USED.items() for name in all.split()}
    assert len(named) >= 20 and named <= set(examples())


@pytest.mark.parametrize("name", examples())
def test_examples_run(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    failed = doctest.DocTestRunner().run(examples()[name]).failed
    assert not failed, capsys.readouterr().out


def planted(length: float, shape: ArrayLike, name: str) -> Array:  # noqa: F821
    """Does something.

    Args:
        length: A length.
        shape: Numbers [m].
    """
    if name:
        raise ValueError(f"name must be empty, got {name!r}")


@dataclass
class Planted:
    """Has something.

    Attributes:
        first: A number.
    """

    first: float
    second: str


def test_the_checks_see_what_is_planted():
    assert sorted(complaints_of_function(planted)) == [
        "ValueError is not under Raises", "length has no unit", "name is not under Args",
        "what it returns has no unit",
    ]  # fmt: skip
    assert sorted(complaints_of_class(Planted)) == [
        "first has no unit", "second is not under Attributes",
    ]  # fmt: skip
    assert explained("A", "A = 1  # one") and explained("A", "# one\nA = 1")
    assert explained("A", "\nA = 1\n'One.'") and not explained("A", "import b\nA = 1\nB = 2")

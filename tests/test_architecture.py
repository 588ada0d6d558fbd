"""Who may import whom: every file has a layer, and imports only from there downwards.

The imports are read from the source, at every depth: one inside a function or under
``TYPE_CHECKING`` counts like any other.
"""

import ast
import sys
import tomllib
from collections.abc import Collection, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MAPPED = ("envs", "agents", "assets")  # folders of the checkout that are installed in tca_mj

# Bottom to top; a layer imports itself and what stands before it.
LAYERS = "routes rod tca smp control model sim record modules robots envs agents".split()
# The same with what surrounds it: the door (__init__ and registry, which every import of the
# package runs) and the static files below, the command line above.
STACK = ["door", "assets", *LAYERS, "cli"]
# Files and folders directly in tca_mj that do not have the name of their layer.
LAYER_OF = {
    "__init__": "door",
    "registry": "door",
    "files": "door",
    "forks": "door",
    "checks": "door",
    "quadrature": "door",
    "machine": "door",
    "pages": "door",
    "lazy": "door",
    "hints": "door",
    "bench": "agents",
    "validation": "agents",
    "certify": "agents",
    "variation": "sim",
    "batch": "sim",
    "state": "sim",
    "couple": "sim",
    "drive": "sim",
    "traces": "sim",
    "actuation": "control",
    "exported": "sim",
    "testing": "agents",
}
# The lowest layer that may import a third-party package.
LOWEST = {
    "numpy": "routes",
    "scipy": "rod",
    "pymoo": "tca",
    "mujoco": "model",
    "dm_control": "model",
    "imageio": "record",
    "rerun": "record",
    "gymnasium": "envs",
    "dm_env": "envs",
    "glfw": "envs",
    "stable_baselines3": "agents",
    "sb3_contrib": "agents",
    "torch": "agents",
    "cmaes": "agents",
    "onnx": "agents",
    "ray": "agents",
    "tqdm": "agents",
}
# Third-party packages that belong to single files or packages instead: where, and nowhere else.
ONLY_IN = {"matplotlib": {"record", "validation"}}
# What a file may import although its layer may not.
BESIDES = {"registry": {"gymnasium"}, "checks": {"numpy"}, "quadrature": {"numpy"}}

# Where the names that the door offers come from.
HOMES = {
    alias.name: str(node.module)
    for node in ast.parse((ROOT / "tca_mj" / "__init__.pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}


def source_files() -> dict[str, Path]:
    """The files of the package by module name; ``tca_mj.rod.__init__`` keeps its last part."""
    roots = {"tca_mj": ROOT / "tca_mj"} | {f"tca_mj.{name}": ROOT / name for name in MAPPED}
    return {
        ".".join([prefix, *path.relative_to(folder).with_suffix("").parts]): path
        for prefix, folder in roots.items()
        for path in sorted(folder.rglob("*.py"))
    }


def unit_of(module: str) -> str:
    """The part of a module name below ``tca_mj``: a layer, or one of the special files."""
    return (module.split(".") + ["__init__"])[1]


def rank(unit: str) -> int:
    """Height of a unit in the stack.

    Raises:
        ValueError: If the unit has no layer.
    """
    layer = LAYER_OF.get(unit, unit)
    if layer not in STACK:
        raise ValueError(f"tca_mj.{unit} has no layer")
    return STACK.index(layer)


def resolve(name: str, modules: Collection[str]) -> str:
    """The file behind an imported name: a module, a package, or what holds the imported object."""
    for candidate in (name, f"{name}.__init__"):
        if candidate in modules:
            return candidate
    parent = name.rpartition(".")[0]
    if parent and f"{parent}.__init__" in modules:
        return f"{parent}.__init__"
    return parent if parent in modules else name


def imports(tree: ast.AST, modules: Collection[str]) -> Iterator[tuple[ast.stmt, str]]:
    """Yields every import below a node and the module, ours or not, that it reaches."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node, resolve(alias.name, modules)
        elif isinstance(node, ast.ImportFrom):
            source = "." * node.level + (node.module or "")
            for alias in node.names:
                ours = source.split(".")[0] == "tca_mj"
                name = alias.name
                # What the door fetches from somewhere stands there.
                home = HOMES.get(name, source) if source == "tca_mj" else source
                yield node, resolve(f"{home}.{name}", modules) if ours else source


def fetched(tree: ast.AST) -> set[str]:
    """What of other files a file takes through the package's door, as ``tca_mj.<name>``."""
    return {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "tca_mj"
        and (node.attr in HOMES or node.attr in STACK)
    }


def breaches(module: str, source: str, modules: Collection[str]) -> list[str]:
    """Checks the imports of one file.

    Args:
        module: Name of the file as in ``source_files``.
        source: Its text.
        modules: Names of all files of the package.

    Returns:
        One sentence for each import that breaks a rule.
    """
    unit = unit_of(module)
    height = rank(unit)
    tree = ast.parse(source)
    inside_functions = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for inner in ast.walk(node)
    }
    found = []

    def report(node: ast.stmt, text: str) -> None:
        found.append(f"{module}:{node.lineno} {text}")

    for node, target in imports(tree, modules):
        top = target.split(".")[0]
        if target.startswith("."):
            report(node, f"imports {target} relatively")
        elif top in MAPPED:
            report(node, f"imports {target}, which is tca_mj.{target} once installed")
        elif top == "tca_mj":
            other = unit_of(target)
            if target not in modules:
                report(node, f"imports {target}, which does not exist")
            elif rank(other) > height:
                report(node, f"imports {target}, which stands above it")
            elif unit == "cli" and rank(other) > 0 and id(node) not in inside_functions:
                if other != "cli":
                    report(node, f"imports {target} outside a function")
        elif top not in sys.stdlib_module_names:
            if unit == "cli" and id(node) not in inside_functions:
                report(node, f"imports {top} outside a function")
            elif top in ONLY_IN:
                if unit not in ONLY_IN[top]:
                    report(node, f"imports {top}, which belongs to {sorted(ONLY_IN[top])}")
            elif top in BESIDES.get(unit, ()):
                pass
            elif top not in LOWEST:
                report(node, f"imports {top}, which has no lowest layer")
            elif height < rank(LOWEST[top]):
                report(node, f"imports {top}, which is not for layers below {LOWEST[top]}")
    return found


def cycle(sources: dict[str, str]) -> list[str]:
    """The modules on a circle of imports, the first one also at the end; empty if there is none.

    That Python runs a package's ``__init__`` before its files is no import in this sense.
    """
    graph = {
        module: {
            target
            for _, target in imports(ast.parse(source), sources)
            if target in sources and target != module
        }
        for module, source in sources.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


FILES = source_files()


@pytest.mark.parametrize("module", FILES)
def test_imports_stay_within_the_layers(module):
    assert breaches(module, FILES[module].read_text(encoding="utf-8"), FILES) == []


def test_one_file_takes_something_from_above_through_the_door():
    """A part is led to rest by a simulation to be exported: ``Part.export``."""
    found = {
        (module, name)
        for module, path in FILES.items()
        for name in fetched(ast.parse(path.read_text(encoding="utf-8")))
    }
    assert found == {("tca_mj.model.part", "export")}


def test_no_circle_of_imports():
    assert cycle({module: path.read_text(encoding="utf-8") for module, path in FILES.items()}) == []


def test_pyproject_lists_every_package():
    """What is not listed works in an editable install and is missing from the wheel."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    setuptools = project["tool"]["setuptools"]
    assert sorted(setuptools["packages"]) == sorted({name.rpartition(".")[0] for name in FILES})
    assert setuptools["package-dir"] == {f"tca_mj.{name}": name for name in MAPPED}


def test_every_folder_with_code_is_a_package():
    folders = {name.rpartition(".")[0] for name in FILES}
    assert {folder for folder in folders if f"{folder}.__init__" not in FILES} == set()


# The checker itself: a small package in which everything below is planted.
PLANTED = [
    *(f"tca_mj.{name}" for name in ("__init__", "registry", "routes", "sim", "record.__init__")),
    *(f"tca_mj.{name}" for name in ("record.plots", "record.render", "cli", "envs.arm")),
    *(f"tca_mj.{name}" for name in ("rod.__init__", "rod.lie")),
    *(f"tca_mj.{name}" for name in ("tca.__init__", "tca.bank", "model.__init__", "agents.train")),
    *(f"tca_mj.{name}" for name in ("validation.__init__", "validation.facts")),
]


@pytest.mark.parametrize(
    ("module", "source", "complaint"),
    [
        ("tca_mj.tca.bank", "import mujoco", "not for layers below model"),
        ("tca_mj.tca.bank", "from tca_mj.sim import Simulation", "stands above it"),
        ("tca_mj.tca.bank", "from tca_mj import sim", "stands above it"),
        ("tca_mj.tca.bank", "def f():\n    import tca_mj.sim", "stands above it"),
        ("tca_mj.tca.bank", "from tca_mj import Simulation", "stands above it"),
        ("tca_mj.tca.bank", "from tca_mj.nowhere import x", "does not exist"),
        ("tca_mj.tca.bank", "from . import spec", "relatively"),
        ("tca_mj.tca.bank", "import pandas", "has no lowest layer"),
        ("tca_mj.tca.bank", "from tca_mj.record.plots import curve", "stands above it"),
        ("tca_mj.routes", "import scipy.optimize", "not for layers below rod"),
        ("tca_mj.record", "import gymnasium as gym", "not for layers below envs"),
        ("tca_mj.sim", "from tca_mj.record.plots import curve", "stands above it"),
        ("tca_mj.sim", "import matplotlib.pyplot as plt", "belongs to"),
        ("tca_mj.tca.bank", "from tca_mj.validation import facts", "stands above it"),
        ("tca_mj.record.plots", "from tca_mj.envs import arm", "stands above it"),
        ("tca_mj.envs.arm", "import torch", "not for layers below agents"),
        ("tca_mj.envs.arm", "import envs", "once installed"),
        ("tca_mj.registry", "from tca_mj.envs.arm import ArmPickPlace", "stands above it"),
        ("tca_mj.__init__", "import numpy", "not for layers below routes"),
        ("tca_mj.cli", "from tca_mj.agents import train", "outside a function"),
        ("tca_mj.cli", "import numpy as np", "outside a function"),
    ],
)
def test_the_checker_sees_a_planted_breach(module, source, complaint):
    (found,) = breaches(module, source, PLANTED)
    assert found.startswith(f"{module}:") and complaint in found


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("tca_mj.tca.bank", "from tca_mj import __version__\nfrom tca_mj.rod import lie"),
        ("tca_mj.tca.bank", "import json\nimport numpy as np\nfrom scipy.optimize import root"),
        ("tca_mj.record.plots", "import matplotlib.pyplot as plt\nfrom tca_mj.tca import bank"),
        ("tca_mj.record.render", "import imageio, mujoco\nfrom tca_mj.sim import Simulation"),
        ("tca_mj.registry", "import gymnasium"),
        ("tca_mj.record", "import rerun\nfrom tca_mj.record.plots import curve"),
        ("tca_mj.agents.train", "import torch\nfrom tca_mj.record.plots import curve"),
        ("tca_mj.cli", "import argparse\nfrom tca_mj import __version__"),
        ("tca_mj.cli", "def main():\n    from tca_mj.agents.train import train"),
    ],
)
def test_the_checker_lets_good_imports_pass(module, source):
    assert breaches(module, source, PLANTED) == []


def test_the_checker_wants_a_layer_for_every_file():
    with pytest.raises(ValueError, match="tca_mj.helpers has no layer"):
        breaches("tca_mj.helpers", "", PLANTED)


def test_the_checker_sees_a_planted_circle():
    circle = {
        "tca_mj.rod.__init__": "",
        "tca_mj.rod.lie": "from tca_mj.rod import loads",
        "tca_mj.rod.loads": "def f():\n    from tca_mj.rod.lie import hat",
    }
    assert set(cycle(circle)) == {"tca_mj.rod.lie", "tca_mj.rod.loads"}

"""What each package offers: every name exists, is its own, and none that a user needs is missing.

A name is public if the ``__all__`` of a package has it. ``INTERNAL`` says what is for other files
of the package, and may change; what is in neither is a mistake.
"""

import ast
import inspect
import pkgutil
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from test_architecture import FILES

import tca_mj

# What other files of the package use of its modules ("" for all of them), "*" for all that is not
# offered.
# By their own names users import ``tca_mj.checks`` (specifications of one's own) and
# ``tca_mj.testing`` (tasks of one's own).
INTERNAL = {
    "tca_mj": {
        "actuation": "bank_of muscle_group", "bench": "*", "checks": "*", "couple": "*",
        "drive": "Ambient DIVERGENCE Timestep whole_number", "files": "*", "forks": "*",
        "hints": "*", "lazy": "*", "machine": "*", "pages": "*", "quadrature": "*",
        "registry": "Demo recipes", "routes": "require_route", "testing": "*",
    },
    "tca_mj.smp": {"damage": "damaging", "fixing": "with_glass", "heater": "heated"},
    "tca_mj.tca": {
        "arrays": "*", "laws.castigliano": "*", "laws.coil": "*", "laws.love": "*",
        "laws.model": "*", "laws.plies": "*", "laws.rod": "Point require_domain sheared",
        "laws.roots": "bracketed closed", "laws.table": "coil_alone evaluate evaluate_one solved",
        "materials": "Named", "moduli": "softened softened_one", "spec": "heat_of",
        "thermal": "BareStep require_bare",
    },
    "tca_mj.tca.identify": {
        "bench": "measured", "constants": "decoded encoded known_of", "data": "SHOWN", "fit": "*",
        "latent": "*", "loops": "direction loops words_on",
        "predict": "*", "reporting": "picture_name result",
    },
    "tca_mj.tca.design": {
        "candidates": "judged tightest", "reporting": "result",
    },
    "tca_mj.rod": {
        "deadload": "*", "energy": "*", "lie": "*", "problem": "StaticProblem asked",
        "sections": "*", "shooting": "*", "solving": "*",
    },
    "tca_mj.model": {
        "chain": "hinge_angles", "curves": "*", "moved": "*", "smooth": "*", "spines": "*",
        "sums": "*", "surface": "*",
    },
    "tca_mj.robots": {
        "lift": "add_bridge add_lift", "morphing_grid": "Beam",
        "tetrapod": "add_rail attach_legs dress route_spine_tca trunk",
    },
    "tca_mj.modules": {
        "bistable": "BAND_RATIO NYLON_DENSITY NYLON_POISSON RUBBER_MASS SIDES capstan",
        "morphing": "add_end dress",
    },
    "tca_mj.record": {
        "coils": "*", "film": "clock", "layout": "*", "plots": "event_rows save_figure",
        "render": "Closing", "shapes": "*",
    },
    "tca_mj.certify": {"": "*"},
    "tca_mj.validation": {"": "*"},
    "tca_mj.envs": {
        "adaptive": "OBJECTS Thing", "arm": "misaligned yaw",
        "command": "command_options commanded drawn",
        "gaits": "told", "options": "variation_of",
        "holding": "*", "objects": "*",
        "outcome": "broken_off finite harm how_it_ended measured together",
        "recipe": "HELD", "rewards": "*",
        "stance": "*", "table": "commands", "task": "parts",
    },
    "tca_mj.agents": {
        "cluster": "*", "evaluate": "endings report", "finished": "begun keep",
        "output": "*", "progress": "*", "workers": "*",
    },
    "tca_mj.agents.model": {
        "data": "opened packed period_of rows_of", "dynamics": "regressors",
        "fit": "require_same", "predictive": "Foresight nothing planned",
    },
    "tca_mj.agents.policies": {
        "actors": "called first_gaits script_of", "archives": "*",
        "load": "require_untold", "onnx": "*",
    },
    "tca_mj.agents.scripts": {
        # one for each task, found by the task's ``scripted``
        "adaptive": "scripted", "arm": "scripted", "bistable_grasp": "scripted",
        "finger": "Run calibrate scripted", "grasp": "scripted", "jump": "scripted",
        "morph": "calibrate scripted",
        "course_quick": "*", "reach": "scripted", "tetrapod": "EveryGait scripted",
    },
    "tca_mj.agents.train": {
        "config": "best_algorithm described", "deep": "Run exported film learner record",
        "demonstrations": "*", "gait_score": "*", "learning_env": "*", "runs": "*",
        "mirrored": "clock_mirror", "sb3_env": "silence", "successes": "*",
    },
}  # fmt: skip
# Packages that are an arrangement of files: what they have for users, the package above offers.
WITHIN = ["bench", "rod.deadload", "rod.energy", "rod.shooting", "tca.dynamics", "tca.fibre",
          "tca.laws", "tca.sensing"]  # fmt: skip


def packages() -> dict[str, ModuleType]:
    """All packages that offer names, by name."""
    found = [file.removesuffix(".__init__") for file in FILES if file.endswith(".__init__")]
    within = {f"tca_mj.{name}" for name in WITHIN}
    return {name: import_module(name) for name in found if name not in within}


def offered() -> dict[str, Any]:
    """Everything that a package offers, by its full name."""
    return {
        f"{package}.{name}": getattr(module, name)
        for package, module in packages().items() for name in module.__all__
    }  # fmt: skip


def public_definitions(source: str) -> dict[str, ast.FunctionDef | ast.ClassDef]:
    """Functions and classes of a file whose names have no underscore in front."""
    return {
        node.name: node
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
    }


def owner(module: str) -> str:
    """The package that offers what a module has."""
    package = module.rpartition(".")[0]
    return package if package in packages() else owner(package)


def internal(package: str, module: str, name: str) -> bool:
    """Whether ``INTERNAL`` has a name, or all of its module or of a package round this."""
    table = INTERNAL.get(package, {})
    inside = module.removeprefix(f"{package}.")
    keys = ["", inside, *(key for key in table if inside.startswith(f"{key}."))]
    return any(table.get(key) == "*" or name in table.get(key, "").split() for key in keys)


@pytest.mark.parametrize("package", packages())
def test_what_a_package_offers_is_there_and_its_own(package):
    module = packages()[package]
    assert module.__all__ == sorted(module.__all__) and module.__doc__
    assert set(module.__all__) <= set(dir(module))
    modules = {found.name for found in pkgutil.iter_modules(module.__path__)}
    assert not modules & set(module.__all__)  # a module would hide it once it is imported
    for name in module.__all__:
        value = getattr(module, name)
        if inspect.isfunction(value) or inspect.isclass(value):
            assert value.__module__.startswith(package), name
    with pytest.raises(AttributeError, match=f"'{package}' has no attribute 'nothing'"):
        module.nothing  # noqa: B018


@pytest.mark.parametrize("package", packages())
def test_the_stub_says_what_the_package_says(package):
    """Type checkers read its ``__all__``, the package the imports above that."""
    module = packages()[package]
    stub = Path(module.__file__).with_suffix(".pyi")
    if not stub.exists():
        assert package in ("tca_mj.assets", "tca_mj.cli")
        return
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    (said,) = [node.value for node in tree.body if isinstance(node, ast.Assign)]
    imported = [a for n in tree.body if isinstance(n, ast.ImportFrom) for a in n.names]
    assert ast.literal_eval(said) == sorted(a.name for a in imported if not a.asname)


def test_no_public_name_is_missing():
    """A function or class of a public module is offered, internal, or named as its module."""
    missing = []
    for module, path in FILES.items():
        if module.endswith("__init__") or module.startswith("tca_mj.cli."):
            continue
        package, own = owner(module), import_module(module)
        for name in public_definitions(path.read_text(encoding="utf-8")):
            here = getattr(packages()[package], name, None) is getattr(own, name)
            if not (here or internal(package, module, name) or name == module.rpartition(".")[2]):
                missing.append(f"{module}.{name}")
    assert missing == []


def test_nothing_internal_is_stale():
    """What is named as internal exists and is not offered."""
    for package, table in INTERNAL.items():
        for module, names in table.items():
            own = import_module(f"{package}.{module}".rstrip("."))
            for name in names.replace("*", "").split():
                assert getattr(own, name) and name not in packages()[package].__all__, name


def test_a_package_that_offers_nothing_says_so():
    for name in WITHIN:
        assert not hasattr(import_module(f"tca_mj.{name}"), "__all__"), name


def test_what_pages_have_told_to_import_is_found_there():
    lines = (Path(__file__).parent / "documented_imports.txt").read_text(encoding="utf-8")
    paths = [line for line in lines.splitlines() if not line.startswith("#")]
    assert len(paths) > 100
    missing = []
    for path in paths:
        module, _, name = path.partition(":")
        try:
            found = pkgutil.resolve_name(module)
            getattr(found, name) if name else None
        except (AttributeError, ImportError) as error:
            missing.append(f"{path}: {error}")
    assert missing == []


def test_modules_are_found_through_their_packages():
    assert tca_mj.robots.arm.arm is tca_mj.arm  # the module, whatever was imported before
    assert tca_mj.rod.beam.BeamSpec is tca_mj.BeamSpec

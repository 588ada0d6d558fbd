"""What the package ships, what importing it costs, and what it says of itself."""

import ast
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import gymnasium as gym
import pytest

import tca_mj
from tca_mj import registry
from tca_mj.assets import mjcf
from tca_mj.machine import how_to_install

ROOT = Path(__file__).resolve().parent.parent
SHIPPED = ("tca_mj", "envs", "agents", "assets")

# Paths of single machines and unfinished work. Each has a class of one letter, so that the pattern
# does not find itself.
FORBIDDEN = re.compile(
    r"/w[o]rk/|/t[m]p/|/h[o]me/|/r[o]ot/|\bT[O]DO\b|\bF[I]XME\b|\bX[X]X\b|\bH[A]CK\b"
    r"|N[o]tImplementedError"
)
TEXT = {".py", ".md", ".toml", ".xml", ".txt", ".cff", ".in", ".yml", ".yaml", ".json", ""}


def run_python(code: str, cwd: Path) -> str:
    """What a fresh interpreter prints; the test fails with its error output where it fails."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def project_files() -> list[Path]:
    folders = (*SHIPPED, "tests", "scripts", "docs", ".ci")
    inside = [path for folder in folders for path in (ROOT / folder).rglob("*")]
    return [
        path
        for path in [*inside, *ROOT.iterdir()]
        if path.is_file() and path.suffix in TEXT and "__pycache__" not in path.parts
    ]


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


def test_no_file_speaks_of_single_machines_or_unfinished_work():
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in project_files()
        for number, line in enumerate(text_of(path).splitlines(), start=1)
        if FORBIDDEN.search(line)
    ]
    assert found == []


def test_hints_name_packages_that_an_index_has(monkeypatch):
    """This one is on none; a test of the same words in what is shipped."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    monkeypatch.setattr(
        "tca_mj.machine.requires", lambda _: [
            f'{package}; extra == "{name}"' for name in extras for package in extras[name]
        ]
    )  # fmt: skip
    assert how_to_install("sweep") == "pip install 'ray[tune]>=2.50'"
    for name in set(extras) - {"dev"}:
        assert shlex.split(how_to_install(name)) == ["pip", "install", *extras[name]]
    monkeypatch.setattr("tca_mj.machine.requires", lambda _: None)
    assert how_to_install("rl") == "pip install -e '.[rl]'"
    hint = re.compile(r"install\b[^`\n]*\btca-mj\[")
    assert [path for path in project_files() if path.suffix == ".py" and path.parts[-2] != "tests"
            and hint.search(text_of(path))] == []  # fmt: skip


@pytest.mark.parametrize("text", ["/w" "ork/x", "# T" "ODO: later", "raise N" "otImplementedError"])
def test_the_search_for_forbidden_words_finds_them(text):
    assert FORBIDDEN.search(text)


def test_importing_the_package_loads_nothing_heavy(tmp_path):
    heavy = ["mujoco", "dm_control", "rerun", "torch", "stable_baselines3", "matplotlib", "scipy"]
    loaded = run_python(
        f"import sys, tca_mj; print([m for m in {heavy} + ['tca_mj.envs'] if m in sys.modules])",
        tmp_path,
    )
    assert loaded == "[]"


def test_recordings_are_read_under_the_name_of_their_folder(tmp_path):
    """Without an import of it, and without Rerun until then."""
    code = """
import sys, tca_mj
folder = tca_mj.record
print("rerun" in sys.modules)
try:
    folder.read("nothing.rrd")
except FileNotFoundError as error:
    print(error, "rerun" in sys.modules)
"""
    assert run_python(code, tmp_path).splitlines() == [
        "False", "there is no recording nothing.rrd True"
    ]  # fmt: skip


@pytest.mark.parametrize("module", ["tca_mj.tca", "tca_mj.rod", "tca_mj.smp", "tca_mj.control"])
def test_the_physics_needs_numpy_and_scipy_alone(tmp_path, module):
    """Whatever else is hidden, everything that it offers is there, and a TCA pulls."""
    hidden = {name for name in packages_distributions() if not name.startswith("_")}
    hidden -= {"tca_mj", "numpy", "scipy"}
    assert {"gymnasium", "mujoco", "rerun"} <= hidden
    code = f"""
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {hidden}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Hidden())
from {module} import *
import {module}
if {module!r} == "tca_mj.tca":
    bank = TcaBank([CATALOGUE["free-stroke"]])
    print(bank.pull(bank.rest(), bank.rest_length).tension.shape)
print(len(set({module}.__all__) & set(globals())) == len({module}.__all__))
"""
    assert run_python(code, tmp_path).splitlines()[-1] == "True"


def test_gymnasium_finds_the_tasks_by_the_name_of_the_package(tmp_path):
    """``gymnasium.make`` imports what stands before the colon; nobody has imported it before."""
    code = "import gymnasium; print(gymnasium.make('tca_mj:TCA/ArmPickPlace-v0').spec.id)"
    assert run_python(code, tmp_path).splitlines()[-1].endswith("TCA/ArmPickPlace-v0")


def test_registering_again_changes_nothing(recwarn):
    before = dict(gym.registry)
    registry.register()
    assert gym.registry == before
    assert all(gym.registry[name] is spec for name, spec in before.items())
    assert list(recwarn) == []


@pytest.mark.parametrize("task", registry.TASKS, ids=lambda task: task.id)
def test_every_task_is_registered_and_its_class_exists(task):
    assert gym.spec(task.id).max_episode_steps == task.max_episode_steps
    module, _, name = task.entry_point.partition(":")
    package, _, file = module.rpartition(".")
    assert package == "tca_mj.envs"
    tree = ast.parse((ROOT / "envs" / f"{file}.py").read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.ClassDef)}


def test_every_place_states_the_same_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert tca_mj.__version__ == project["version"]
    assert f"\nversion: {tca_mj.__version__}\n" in citation
    assert tca_mj.__version__ in changelog


def test_mjcf_refuses_what_it_does_not_have():
    with pytest.raises(ValueError, match=r"name must be one of .*, got .nothing\.xml."):
        mjcf("nothing.xml")
    with pytest.raises(ValueError, match="name must be one of"):
        mjcf("../__init__.py")


def test_mjcf_finds_every_file_of_its_folder():
    folder = ROOT / "assets" / "mjcf"
    for path in folder.rglob("*.xml"):
        name = path.relative_to(folder).as_posix()
        assert mjcf(name).read_bytes() == path.read_bytes()


def copied(copy: Path) -> Path:
    """A copy of what a wheel is built from."""
    copy.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE", "MANIFEST.in"):
        shutil.copy(ROOT / name, copy)
    for name in SHIPPED:
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def built(copy: Path) -> Path:
    """The wheel of a copy, built without network."""
    run_python("from setuptools import build_meta; build_meta.build_wheel('out')", copy)
    (wheel,) = (copy / "out").glob("*.whl")
    return wheel


def test_wheel_holds_the_package_and_nothing_else(tmp_path):
    """Files planted in assets and policies must arrive."""
    copy = copied(tmp_path / "copy")
    planted = copy / "assets" / "mjcf" / "deep" / "planted.xml"
    planted.parent.mkdir(parents=True)
    planted.write_text("<mujoco/>", encoding="utf-8")
    policy = copy / "agents" / "policies" / "planted.npz"
    policy.parent.mkdir(exist_ok=True)
    policy.write_bytes(b"")

    with zipfile.ZipFile(built(copy)) as archive:
        names = set(archive.namelist())
        command = archive.read(f"tca_mj-{tca_mj.__version__}.dist-info/entry_points.txt").decode()

    assert {name.split("/")[0] for name in names} == {
        "tca_mj",
        f"tca_mj-{tca_mj.__version__}.dist-info",
    }
    expected = {
        (path.relative_to(copy) if folder == "tca_mj" else "tca_mj" / path.relative_to(copy))
        for folder in SHIPPED
        for path in (copy / folder).rglob("*")
        if path.is_file()
    }
    shipped = {name for name in names if name.startswith("tca_mj/")}
    assert shipped == {path.as_posix() for path in expected}
    assert "tca_mj/assets/mjcf/deep/planted.xml" in shipped
    assert "tca_mj/agents/policies/planted.npz" in shipped
    assert "tca-mj = tca_mj.cli:main" in command

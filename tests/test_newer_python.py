"""The package, installed as a wheel by the newest Python here that it says it runs on, works."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from test_package import ROOT, built, copied

from tca_mj.tca import CATALOGUE, hanging_length

# The physics, a step of every task, an export that plain MuJoCo reads, and the command.
SMOKE = """
import json, sys
import gymnasium as gym, mujoco, numpy as np
import tca_mj
from tca_mj import cli, robots, modules, model, record, rod, smp, tca
for task in tca_mj.TASKS:
    env = gym.make(task.id)
    env.reset(seed=0)
    observation, reward, *_ = env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    assert observation in env.observation_space and np.isfinite(reward)
tca_mj.export(tca_mj.bending_module(), "module.xml", temperatures=60.0)
assert mujoco.MjModel.from_xml_path("module.xml").ntendon == 3
length = float(tca.hanging_length(tca.CATALOGUE["free-stroke"], 100.0, 0.1))
assert cli.main(["list"]) == 0
print(json.dumps({"python": sys.version_info[:2], "length": length, "home": tca_mj.__file__}))
"""


def newer() -> Path | None:
    """The newest interpreter, on the path or by pyenv, of a version in the classifiers."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    said = re.findall(r":: 3\.(\d+)$", "\n".join(project["classifiers"]), re.MULTILINE)
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    for minor in sorted((int(each) for each in said), reverse=True):
        if minor <= sys.version_info.minor:
            break
        on_path = shutil.which(f"python3.{minor}")
        for found in [*filter(None, [on_path]), *pyenv.glob(f"3.{minor}.*/bin/python")]:
            asked = [found, "-c", "import sys, venv, ensurepip; print(sys.version_info.minor)"]
            done = subprocess.run(asked, capture_output=True, text=True, timeout=60, check=False)
            if done.stdout.strip() == str(minor):  # pyenv's own python3.x only tells what to do
                return Path(found)
    return None


def test_the_wheel_works_on_a_newer_python(tmp_path):
    interpreter = newer()
    if interpreter is None:
        pytest.skip("no newer Python of those in pyproject.toml is installed here")
    wheel = built(copied(tmp_path / "copy"))
    made = tmp_path / "venv"
    subprocess.run([interpreter, "-m", "venv", made], check=True, timeout=120)
    python = made / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pip = [python, "-m", "pip", "install", "--quiet", "--no-compile", "--disable-pip-version-check",
           "--retries", "1", "--timeout", "15", "--only-binary", ":all:", wheel]  # fmt: skip
    done = subprocess.run(pip, capture_output=True, text=True, timeout=600, check=False)
    if done.returncode and "connection broken" in done.stderr:
        pytest.skip("pip reaches no index")
    assert done.returncode == 0, done.stderr
    done = subprocess.run(
        [python, "-c", SMOKE], cwd=tmp_path, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    *_, said = done.stdout.splitlines()
    found = json.loads(said)
    assert tuple(found["python"]) > sys.version_info[:2]
    assert Path(found["home"]).is_relative_to(made)
    assert found["length"] == pytest.approx(hanging_length(CATALOGUE["free-stroke"], 100.0, 0.1))
    assert "TCA/TetrapodCourse-v0" in done.stdout

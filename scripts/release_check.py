"""Everything that a release is tried with, and a table of what came of it in docs/release.md.

    python scripts/release_check.py                   all of it, some hours; `make release-check`
    python scripts/release_check.py oldest newest     some of it; the rest of the table stays
    python scripts/release_check.py --list            the checks and their commands

What a check printed stands in runs/release. A check that fails does not stop the others; the exit
code tells of those that were run. ``oldest`` installs the wheel with every package that
pyproject.toml names at its lower bound, ``newest`` the sdist with the newest that the index has.
"""

import argparse
import datetime
import json
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

from tca_mj import pages
from tca_mj.files import write_whole
from tca_mj.machine import machine, versions

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "runs" / "release"
PAGE = ROOT / "docs" / "release.md"
MARK = "<!-- Written by scripts/release_check.py from here on. -->"
EXTRAS = ("rl", "demo", "onnx", "design")
# What is tried in the clean environments, from the unpacked sdist: physics, bodies, a step of
# every task, recordings, policies, and the command.
TESTS = ("test_bank", "test_statics", "test_static", "test_chain", "test_sim", "test_wrappers",
         "test_public_names", "test_tasks", "test_policy", "test_record", "test_help")  # fmt: skip
TESTED_WITH = ("pytest", "pytest-xdist", "hypothesis", "mpmath")
ASK = """
import tca_mj, mujoco, gymnasium, numpy, scipy
print(tca_mj.__file__)
print(*(f"{each.__name__} {each.__version__}" for each in (mujoco, gymnasium, numpy, scipy)))
"""
PYTHON, PYTEST = ".venv/bin/python", ".venv/bin/pytest -q -n auto --maxprocesses 8 --dist loadfile"
CHECKS = {
    "build": f"{PYTHON} scripts/release_check.py --build",
    "oldest": f"{PYTHON} scripts/release_check.py --clean oldest",
    "newest": f"{PYTHON} scripts/release_check.py --clean newest",
    "style": "make lint",
    "tests": PYTEST,
    "long tests": f"{PYTEST} -m long",
    "tutorials": f"{PYTHON} scripts/tutorials.py",
    "printed tables": f"{PYTHON} scripts/page_tables.py --check",
    "site": "make docs",
    "browser": "npm install --silent --prefix build/axe axe-core && "
               f"{PYTHON} -m pip install -q selenium && {PYTHON} scripts/audit_site.py",
    "first command": "make demo",
    "published facts": ".venv/bin/tca-mj validate tca",
    "certificates": ".venv/bin/tca-mj certify",
    "benchmark": "make bench",
}  # fmt: skip


def lowest() -> list[str]:
    """Every package that is installed with the extras, at its lower bound."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    needed = [*project["dependencies"], *(each for name in EXTRAS for each in extras[name])]
    found = (re.fullmatch(r"([\w-]+)(?:\[\w+\])?>=([\d.]+)(.*)", each) for each in needed)
    return [f"{each[1]}=={each[2]}{each[3].removeprefix(',<4')}" for each in found if each]


def build() -> None:
    """Makes wheel and sdist anew in dist, of the files that git knows."""
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    shutil.rmtree(ROOT / "build" / "lib", ignore_errors=True)
    subprocess.run([sys.executable, "-m", "build", "--no-isolation"], cwd=ROOT, check=True)
    print(*sorted(f"{path.name} {path.stat().st_size >> 10} KiB" for path in
                  (ROOT / "dist").iterdir()), sep=", ")  # fmt: skip


def clean(which: str) -> None:
    """Installs what was built into an environment of its own and runs tests against it there."""
    home = OUT / which
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    (wheel,), (sdist,) = (ROOT / "dist").glob("*.whl"), (ROOT / "dist").glob("*.tar.gz")
    shutil.unpack_archive(sdist, home, filter="data")
    (unpacked,) = home.glob("tca_mj-*")
    subprocess.run([sys.executable, "-m", "venv", home / "venv"], check=True)
    python = home / "venv" / "bin" / "python"
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    taken, bounds = (wheel, lowest()) if which == "oldest" else (sdist, ["--upgrade"])
    asked = [f"{taken}[{','.join(EXTRAS)}]", *bounds, "-c", str(ROOT / "constraints.txt")]
    subprocess.run([*pip, *asked, *TESTED_WITH], check=True)
    found = subprocess.check_output([python, "-c", ASK], cwd=home, text=True)
    where, numbers = found.splitlines()
    if not Path(where).is_relative_to(home / "venv"):
        raise RuntimeError(f"the package must come from {home / 'venv'}, got {where}")
    tests = [f"tests/{name}.py" for name in TESTS if (unpacked / "tests" / f"{name}.py").exists()]
    done = subprocess.run([home / "venv" / "bin" / "pytest", "-q", "-n", "2", *tests], cwd=unpacked,
                          capture_output=True, text=True, check=False)  # fmt: skip
    print(done.stdout, done.stderr)
    print(f"{done.stdout.strip().splitlines()[-1].strip('= ')}; {numbers}")
    if done.returncode:
        sys.exit(done.returncode)


def tried(name: str) -> dict[str, Any]:
    """Runs a check; what it printed is kept."""
    print(f"{name}: {CHECKS[name]}", flush=True)
    begun = time.monotonic()
    done = subprocess.run(["sh", "-c", CHECKS[name]], cwd=ROOT, capture_output=True, text=True)
    took = time.monotonic() - begun
    said = [line for line in done.stdout.splitlines() if line.strip()]
    write_whole(OUT / f"{name.replace(' ', '-')}.txt", (done.stdout + done.stderr).encode())
    print(f"  {'held' if done.returncode == 0 else 'FAILED'} in {took:.0f} s", flush=True)
    return {
        "held": done.returncode == 0, "seconds": round(took), "on": str(datetime.date.today()),
        "said": re.sub(r"\s+", " ", said[-1]).replace(str(ROOT), ".")[:160] if said else "",
    }  # fmt: skip


def written(results: dict[str, Any]) -> str:
    """The table of all checks, also of those that were not run."""
    rows = []
    for name, command in CHECKS.items():
        found = results.get(name)
        verdict = "not run" if not found else "held" if found["held"] else "**failed**"
        last = ["", "", ""]
        if found:
            last = [found["on"], f"{found['seconds']} s", found["said"].replace("|", "\\|")]
        rows.append([name, f"`{command}`", verdict, *last])
    made = pages.made_with({"machine": machine(), "versions": versions()})
    heads = ["check", "command", "", "on", "took", "last line"]
    return pages.page(MARK, pages.table(heads, rows), "\n".join(made)) + "\n"


def read_back(page: str) -> dict[str, Any]:
    """What the table of a page says, so that rows of another checkout's checks stay."""
    row = re.compile(
        r"^\| ([a-z ]+) \| `.*?` \| (\S+) \| ([\d-]+) \| (\d+) s \| (.*) \|$", re.MULTILINE
    )
    return {
        name: {"held": held == "held", "seconds": int(seconds), "on": on,
               "said": said.replace("\\|", "|")}
        for name, held, on, seconds, said in row.findall(page)
    }  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("checks", nargs="*", help="names of checks; without any, all")
    parser.add_argument("--list", action="store_true", help="the checks, and nothing else")
    parser.add_argument("--build", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--clean", choices=("oldest", "newest"), help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.list:
        print(*(f"{name:16} {command}" for name, command in CHECKS.items()), sep="\n")
    elif asked.build:
        build()
    elif asked.clean:
        clean(asked.clean)
    else:
        unknown = [name for name in asked.checks if name not in CHECKS]
        if unknown:
            parser.error(f"checks must be among {', '.join(CHECKS)}, got {', '.join(unknown)}")
        kept = OUT / "results.json"
        results: dict[str, Any] = {}
        names = asked.checks or list(CHECKS)
        for name in names:
            found = tried(name)
            # Read anew: another call may have tried other checks meanwhile.
            page = PAGE.read_text(encoding="utf-8")
            results = json.loads(kept.read_text("utf-8")) if kept.exists() else read_back(page)
            results[name] = found
            write_whole(kept, json.dumps(results, indent=1).encode())
            head = page.partition(MARK)[0]
            write_whole(PAGE, f"{head}{written(results)}".encode())
        return 0 if all(results[name]["held"] for name in names) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

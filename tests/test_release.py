"""What is released: the checks name what is there, files of containers can be read and are true."""

import json
import re
import shlex
import sys
import tomllib

import pytest
from packaging.requirements import Requirement
from test_docs import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import release_check  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_what_is_installed_by_users_has_a_lower_bound():
    """Else the oldest environment would be any."""
    extras = PROJECT["optional-dependencies"]
    needed = [*PROJECT["dependencies"], *(e for name in release_check.EXTRAS for e in extras[name])]
    bounds = [Requirement(each) for each in release_check.lowest()]
    assert [each.name for each in bounds] == [Requirement(each).name for each in needed]
    for asked, pinned in zip(map(Requirement, needed), bounds, strict=True):
        (version,) = (each.version for each in pinned.specifier)
        assert f">={version}" in str(asked.specifier) and version in asked.specifier
        assert str(asked.marker) == str(pinned.marker)


def test_checks_name_files_and_targets_that_exist():
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    for command in release_check.CHECKS.values():
        for word in shlex.split(command):
            if re.fullmatch(r"scripts/\w+\.py", word):
                assert (ROOT / word).is_file()
        assert set(re.findall(r"^make (\S+)", command)) <= set(targets)
    for name in release_check.TESTS:
        assert (ROOT / "tests" / f"{name}.py").is_file()


def test_the_table_tells_what_failed_and_what_was_not_run():
    found = {"held": False, "seconds": 3, "on": "2026-01-01", "said": "1 failed | 2 passed"}
    table = release_check.written({"build": found})
    assert "**failed** | 2026-01-01 | 3 s | 1 failed \\| 2 passed |" in table
    assert table.count("| not run |") == len(release_check.CHECKS) - 1
    assert release_check.MARK in release_check.PAGE.read_text(encoding="utf-8")
    assert release_check.read_back(table) == {"build": found}
    assert release_check.read_back(release_check.PAGE.read_text(encoding="utf-8"))


def test_an_unknown_check_is_refused(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["release_check.py", "everything"])
    with pytest.raises(SystemExit):
        release_check.main()
    assert "checks must be among build" in capsys.readouterr().err


def test_what_the_containerfile_copies_and_installs_exists():
    text = (ROOT / "Containerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line.split(maxsplit=1) for line in text.splitlines() if line and line[0] != "#"]
    assert lines[0][0] == "FROM"
    words = {"FROM", "RUN", "WORKDIR", "COPY", "ENV", "ENTRYPOINT", "CMD"}
    assert {word for word, _ in lines} <= words
    copied = [name for word, rest in lines if word == "COPY" for name in rest.split()[:-1]]
    assert [name for name in copied if not (ROOT / name).exists()] == []
    assert {"tca_mj", "envs", "agents", "assets", "pyproject.toml", "README.md"} <= set(copied)
    (extras,) = re.findall(r'"\.\[([\w,]+)\]"', text)
    assert set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    (python,) = re.findall(r"python:(3\.\d+)-", text)
    assert f"Programming Language :: Python :: {python}" in PROJECT["classifiers"]
    assert json.loads(dict(lines)["ENTRYPOINT"])[0] in PROJECT["scripts"]


def test_the_devcontainer_file_is_read_and_calls_a_target():
    path = ROOT / ".devcontainer" / "devcontainer.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert found["postCreateCommand"].removeprefix("make ") in targets
    assert f"Python :: {found['image'].rpartition(':')[2]}" in " ".join(PROJECT["classifiers"])

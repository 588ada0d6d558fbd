"""The examples are what their pages say, and the page on a robot of one's own can be followed."""

import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from test_docs import FENCE

from tca_mj import cli
from tca_mj.certify import robots
from tca_mj.record.render import RenderingUnavailable, gl_backend

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
PAGE = ROOT / "docs" / "own-robot.md"
# What makes the commands of the page quick, by their first words.
QUICK = {
    "tca-mj certify": ["--workers", "1"],
    "tca-mj demo": ["--no-video"],
    "tca-mj eval": ["--episodes", "1", "--steps", "3"],
    "tca-mj train": ["--steps", "120"],
}


def blocks(page):
    """Kind and text of every block of a page."""
    return [(kind.strip(), text) for kind, text in FENCE.findall(page.read_text(encoding="utf-8"))]


def test_every_example_is_a_block_of_a_page():
    found = {
        kind.split()[1]: text
        for page in (PAGE, ROOT / "docs" / "actuators.md")
        for kind, text in blocks(page)
        if re.fullmatch(r"python \w+\.py", kind)
    }
    assert found == {path.name: path.read_text("utf-8") for path in EXAMPLES.glob("*.py")}


def test_robot_task_and_script_take_ninety_lines_at_most():
    files = [EXAMPLES / name for name in ("own_robot.py", "own_task.py")]
    lines = sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files)
    assert lines <= 90 and f"{lines} lines" in " ".join(PAGE.read_text(encoding="utf-8").split())


def test_the_examples_are_formatted():
    pytest.importorskip("ruff")
    done = subprocess.run(
        [sys.executable, "-m", "ruff", "format", "--no-cache", "--check", str(EXAMPLES)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def some_cases(names, gravity):
    """Of the cases of a certificate three: cold, one TCA hot, and all."""
    every = [one for one in CASES(names, gravity) if one.gravity != (0.0, 0.0, 0.0)]
    return [every[0], every[1], every[-1]]


CASES = robots._asked


def test_the_page_can_be_followed(tmp_path, monkeypatch, capsys):
    """In an empty folder: its files, its commands at tiny sizes, and its Python, in its order."""
    pytest.importorskip("stable_baselines3")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    monkeypatch.setattr(robots, "_asked", some_cases)
    python, typed = {"__name__": "__main__"}, []
    for kind, text in blocks(PAGE):
        if kind.endswith(".py"):
            (tmp_path / kind.split()[1]).write_text(text, encoding="utf-8")
        elif kind.startswith("python"):
            sys.path.append(str(tmp_path))  # as where one types python in this folder
            exec(compile(_small_film(text), str(PAGE), "exec"), python)
        elif "tca-mj" in text:
            for line in text.splitlines():
                words = shlex.split(line)
                more = QUICK.get(" ".join(words[:2]), [])
                code = cli.main([*words[1:], *more])
                assert code == 0, (line, capsys.readouterr())
                typed.append(words[1])
    assert typed == ["certify", "list", "demo", "export", "eval", "train", "eval"]
    for name in ("own_robot", "own_task"):
        sys.modules.pop(name, None)
    said = capsys.readouterr().out
    assert "Verdict: all cases are within 1 % of L and 2°" in said and "success after" in said
    tips = re.findall(r"the tip is at (.*) mm", said)
    assert len(tips) == 2 and tips[0] == tips[1]  # in the simulation, and in plain MuJoCo
    assert json.loads((tmp_path / "certificate" / "report.json").read_text("utf-8"))["within"]
    for name in ("robot.rrd", "demo/rollout.rrd", "demo/rollout.csv", "learned/best.npz",
                 "two_modules.xml", "script/summary.md", "learned/eval/summary.md"):  # fmt: skip
        assert (tmp_path / name).stat().st_size > 200, name


def test_rows_of_the_certificate_are_those_of_the_page(tmp_path, monkeypatch):
    """Without simulations from the cold, which are no rows."""
    (tmp_path / "two.py").write_text((EXAMPLES / "own_robot.py").read_text("utf-8"), "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    text = PAGE.read_text(encoding="utf-8")
    head, *rest = text[text.index("| hot | gravity") :].partition("\n\n")[0].splitlines()
    rows = {tuple(cell.strip() for cell in row.split("|")[1:3]): row for row in rest[1:]}
    assert len(rows) == 3

    def shown(names, gravity):
        return [replace(one, close=False) for one in CASES(names, gravity)
                if (" + ".join(one.hot), " ".join(f"{g:g}" for g in one.gravity)) in rows]

    monkeypatch.setattr(robots, "_asked", shown)
    found = robots.certify_robot("two:two_modules", workers=1)["text"].splitlines()
    assert {head, *rows.values()} <= set(found)
    monkeypatch.delitem(sys.modules, "two")


def _small_film(text):
    """A piece of Python with a small film, and without one where none can be made."""
    try:
        gl_backend()
        pytest.importorskip("imageio_ffmpeg")
    except (RenderingUnavailable, pytest.skip.Exception):
        return "".join(line for line in text.splitlines(True) if "film" not in line.lower())
    return text.replace('camera="view"', 'camera="view", fps=3, width=160, height=128')

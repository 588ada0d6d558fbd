"""The pages: links lead somewhere, ids exist, examples run, tables are what the code says."""

import re
import runpy
import sys
import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import tca_mj  # noqa: F401  (registers the ids)
from tca_mj.registry import TASKS, task_class

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
ID = re.compile(r"\bTCA/[A-Za-z0-9]+-v\d+")
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)")


def names(paths):
    return [path.relative_to(ROOT).as_posix() for path in paths]


def anchors(page):
    """Names that headings of a page get on GitHub."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ +(.+?) *$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def examples():
    """But for those of the tutorials, which are run whole (tests/test_tutorials.py)."""
    for page in PAGES:
        if page.name.startswith("tutorial-"):
            continue
        text = page.read_text(encoding="utf-8")
        for match in FENCE.finditer(text):
            if match[1].strip() == "python":
                line = text.count("\n", 0, match.start()) + 1
                # Empty lines in front: errors name the line of the page.
                source = "\n" * line + match[2]
                yield pytest.param(page, source, id=f"{page.name}:{line}")


@pytest.mark.parametrize("page", PAGES, ids=names(PAGES))
def test_links_and_pictures_exist(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    missing = []
    for link in LINK.findall(text):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            missing.append(link)
    assert missing == []


def test_ids_in_the_pages_are_registered():
    found = {name for page in PAGES for name in ID.findall(page.read_text(encoding="utf-8"))}
    assert found
    assert sorted(found - set(gym.registry)) == []


@pytest.mark.parametrize(("page", "source"), list(examples()))
def test_examples_run(page, source, tmp_path, monkeypatch):
    """Marked ``python``; ``python no-run`` is skipped. Episodes are cut to five steps."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # what others leave there
    for name, spec in gym.registry.items():
        if name.startswith("TCA/"):
            monkeypatch.setattr(spec, "max_episode_steps", 5)
    exec(compile(source, str(page), "exec"), {"__name__": "__main__"})


def test_tables_of_the_actuators_are_what_the_script_prints():
    """After a change: python scripts/tca_figures.py --tables, and copy into docs/tca.md."""
    pytest.importorskip("matplotlib")
    script = runpy.run_path(str(ROOT / "scripts" / "tca_figures.py"))
    page = (ROOT / "docs" / "tca.md").read_text(encoding="utf-8")
    for table in script["tables"]():
        assert table in page


@pytest.mark.parametrize("id", [task.id for task in TASKS])
def test_a_page_has_the_observation_table(id):
    table = sys.modules[task_class(id).__module__].OBSERVATION
    assert np.isfinite(table.space.high).all()
    assert any(table.markdown() in page.read_text(encoding="utf-8") for page in PAGES)


def test_the_page_of_tasks_has_the_options_of_all():
    from tca_mj.envs.options import Options, variation_options

    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    common = Options(variation_options())
    assert common.markdown() in page
    for task in TASKS:
        rows = gym.make(task.id, disable_env_checker=True).unwrapped.options.rows
        own = Options([row for row in rows if row.name not in common.names])
        assert f"`{task.id}`:\n\n{own.markdown()}\n" in page


def test_numbers_of_the_readme_are_those_of_the_pages():
    """Those that a command writes into a page; rounded as they are in the README."""
    page = {path.name: path.read_text(encoding="utf-8") for path in PAGES}
    readme = re.sub(r"\s+", " ", (ROOT / "README.md").read_text(encoding="utf-8"))

    def number(pattern, text):
        (found,) = re.findall(pattern, text)
        return float(found.rstrip("."))

    facts = number(r"recomputes (\d+) reported facts", readme)
    assert facts == number(r"(\d+) facts: \d+ held", page["validation.md"])
    _, _, walk = page["gaits.md"].partition("## `TCA/TetrapodWalk-v0`")
    walk = walk.partition("\n## ")[0]
    learned = number(r"\| \*\*SAC, mean of 5 seeds\*\* \| \*\*([\d.]+) ", walk)
    for words, other in (("the script", "scripted"), ("the best of", "tetrapod-walk")):
        said = number(rf"([\d.]+) % faster than {words}", readme)
        gain = learned / number(rf"\n\| {other} \| ([\d.]+) ", walk) - 1.0
        assert said == round(100.0 * gain), words
    rods = dict(re.findall(r"\| (0\.\d+) mm \| [\d.]+ \| [\d.]+ \| ([\d.]+) ",
                           page["tetrapod-model.md"]))  # fmt: skip
    speeds = {"0.50": r"the scripted walk goes at ([\d.]+) mm/s", "0.45": r"0.45 mm at ([\d.]+)",
              "0.40": r"0.4 mm at ([\d.]+)"}  # fmt: skip
    for rod, pattern in speeds.items():
        assert number(pattern, readme) == round(float(rods[rod]), 1), rod
    off = number(r"is at most ([\d.]+)° off after 5 s", readme)
    assert off == round(number(r"at most ([\d.]+)° off in \d+ predictions",
                               page["learned-model.md"]), 1)  # fmt: skip

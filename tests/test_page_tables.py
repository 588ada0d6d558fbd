"""Tables of pages that scripts print: which of them differ is found, and written."""

import runpy
import sys

import pytest
from test_docs import ROOT

SCRIPT = runpy.run_path(str(ROOT / "scripts" / "page_tables.py"))
TWICE = "# Page\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\nwords\n\n| a | b |\n|---|---|\n| 3 | 4 |\n"


def test_what_differs_is_written_and_what_is_nowhere_is_not():
    printed = SCRIPT["tables"](
        "| a | b |\n|---|---|\n| 1 | 2 |\n\n| a | b |\n|---|---|\n| 3 | 5 |\n\n| c |\n|---|\n| 1 |"
    )
    text, known, changed = SCRIPT["replaced"](TWICE, printed)
    assert text == TWICE.replace("| 4 |", "| 5 |")
    assert known == changed == ["| a | b |"]
    assert SCRIPT["replaced"](text, printed) == (text, known, [])
    zero = SCRIPT["tables"]("| a | b |\n|---|---|\n| -0.0 | -0.01 |\n")
    assert zero["| a | b |"] == ["| a | b |\n|---|---|\n| 0.0 | -0.01 |\n"]


def test_a_column_of_times_does_not_count_and_all_else_does():
    steady = SCRIPT["steady"]
    row = "| who | error | decision [ms] |\n|---|---|---|\n| PI | {} | {} |\n"
    assert steady(row.format(0.5, 8.1)) == steady(row.format(0.5, 9.7))
    assert steady(row.format(0.5, 8.1)) != steady(row.format(0.6, 8.1))
    rows = "| | walk |\n|---|---|\n| slide | {} |\n| env.step | {} |\n"
    assert steady(rows.format(0.03, 3.9)) == steady(rows.format(0.03, 4.6))
    assert steady(rows.format(0.03, 3.9)) != steady(rows.format(0.04, 3.9))


def test_every_source_is_a_script_and_its_pages_exist():
    for name, command in SCRIPT["PRINTED"].items():
        assert (ROOT / "scripts" / command.split()[0]).is_file()
        for page in SCRIPT["ELSEWHERE"].get(name, (name,)):
            assert (ROOT / "docs" / f"{page}.md").is_file()


def test_scripts_that_print_tables_are_held_against_their_pages():
    known = {command.split()[0] for command in SCRIPT["PRINTED"].values()}
    without = {"family_picture.py"}
    for path in (ROOT / "scripts").glob("*.py"):
        if "folder_of_pictures(__doc__" in path.read_text(encoding="utf-8"):
            assert path.name in known | without, path.name


def test_an_unknown_name_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["page_tables.py", "nothing"])
    with pytest.raises(SystemExit):
        SCRIPT["main"]()
    assert "names must be among adaptive-grasp" in capsys.readouterr().err


def test_every_constant_of_the_sensitivity_is_one_and_changes_something(monkeypatch):
    """Also those that are patched into modules, which may have moved."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    sensitivity = pytest.importorskip("sensitivity")
    usual = sensitivity.World().with_tca()
    for constant in sensitivity.CONSTANTS:
        for text, change in constant.values:
            world = change(sensitivity.World())
            with world.patched():
                inside = [spec.embedded for spec in (world.wrist, world.gripper)]
                changed = world.with_tca() != usual
                assert changed, (constant.name, text)
            if constant.name.startswith("share of wall"):
                assert inside != [spec.embedded for spec in (world.wrist, world.gripper)]

"""What the pages tell to type: every command exists and takes what it is given.

Nothing long is run here: `tca-mj` reads its arguments, scripts show their help. Tutorials, examples
in Python and the page of one's own robot are run by other tests.
"""

import contextlib
import io
import re
import runpy
import shlex
import sys
from functools import cache

import gymnasium as gym
import pytest
from test_docs import FENCE, PAGES, ROOT

from tca_mj.agents.policies import shipped
from tca_mj.cli import POLICIES, _parser
from tca_mj.registry import DEMOS

TYPED = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
FIRST = ("tca-mj", "python", "python3", "make", "pytest", "pip")
OF_THE_SHELL = {
    ".", "cd", "done", "echo", "for", "grep", "head", "ls", "mkdir", "sed", "rerun", "tensorboard",
}  # fmt: skip
OWN = re.compile(r"\w+:Example/\S+")  # a task of one's own, of a module that the page makes
SCRIPTS = sorted(
    path for path in (ROOT / "scripts").glob("*.py") if "__main__" in path.read_text("utf-8")
)


def commands(text):
    """Of a block for the shell, word by word; a loop's variable stays one."""
    found = []
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.shlex(line, posix=True, punctuation_chars=";|&>")
        words.whitespace_split = True
        now, file = [], False
        for word in [*words, ";"]:
            if set(word) <= set(";|&"):
                found += [now] if now else []
                now = []
            elif not file and word not in (">", "do"):
                now.append(word)
            file = word == ">"
    return found


def typed():
    """Page, words, whether they can be run as they are: blocks for the shell are, code in a line
    may be a part of a command, or have NAMES that stand for others."""
    for page in TYPED:
        text = page.read_text(encoding="utf-8")
        for kind, block in FENCE.findall(text):
            if kind.split()[:1] == ["sh"]:
                yield from ((page, words, True) for words in commands(block))
        for code in re.findall(r"`([^`\n]+)`", FENCE.sub("", text)):
            if code.split()[0] in FIRST:
                yield from ((page, words, False) for words in commands(code))


def subcommands():
    """Parsers of tca-mj by name."""
    (found,) = (each for each in _parser()._actions if each.dest == "==SUPPRESS==")
    return found.choices


@cache
def options(task):
    """What may be given to a task's ``reset``."""
    return {row.name for row in gym.make(task, disable_env_checker=True).unwrapped.options.rows}


def mentioned(words):
    """What a part of a command is refused for: a name, or an option that this one has not."""
    if not words[1:] or words[1].startswith("--"):
        return ""
    parser = subcommands().get(words[1])
    if parser is None:
        return f"no command {words[1]}"
    known = {each for action in parser._actions for each in action.option_strings}
    unknown = {word.partition("=")[0] for word in words if word.startswith("--")} - known
    return f"no option {sorted(unknown)}" if unknown else ""


def refused(page, words):
    """What a whole command is refused for; nothing if it is taken."""
    arguments = [re.sub(r"\$\w+", "1", OWN.sub("TCA/BendReach-v0", word)) for word in words[1:]]
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            asked = _parser().parse_args(arguments)
    except SystemExit as end:
        return said.getvalue() if end.code else ""
    demo = DEMOS.get(getattr(asked, "name", None) or "")
    task = demo.task if demo else getattr(asked, "task", None)
    given = {word.partition("=")[0] for before, word in zip(words, words[1:], strict=False)
             if before == "--option"}  # fmt: skip
    if given and not any(map(OWN.search, words)) and given - options(task):
        return f"{task} has no option {sorted(given - options(task))}"
    who = getattr(asked, "policy", None) or "scripted"
    # It comes with the package, or the page says how it is made.
    at, there = who.removesuffix("/best.json"), (*POLICIES, *shipped(), "1")
    if who not in there and page.read_text(encoding="utf-8").count(at) < 2:
        return f"nobody is called {who}"
    return ""


@cache
def help_of(path):
    """What a script says of itself; it must end with that."""
    said, before, folders = io.StringIO(), sys.argv, list(sys.path)
    sys.argv = [str(path), "--help"]
    sys.path.insert(0, str(path.parent))
    try:
        with contextlib.redirect_stdout(said), pytest.raises(SystemExit) as end:
            runpy.run_path(str(path), run_name="__main__")
    finally:
        sys.argv, sys.path[:] = before, folders
    assert end.value.code in (0, None)
    return said.getvalue()


def test_commands_of_the_pages_are_taken():
    found = [each for each in typed() if each[1][0] == "tca-mj"]
    wrong = [f"{page.name}: {' '.join(words)}: {said}" for page, words, whole in found
             if (said := refused(page, words) if whole else mentioned(words))]  # fmt: skip
    assert len(found) > 150 and wrong == []


def test_no_two_runs_go_into_the_same_folder():
    """Who types the pages one after the other would be refused."""
    runs = {}
    for page, words, whole in typed():
        if whole and words[:2] in (["tca-mj", "train"], ["tca-mj", "sweep"]) and "--out" in words:
            if page.name.startswith(("tutorial", "own-robot")):
                continue  # in a folder of their own
            out = words[words.index("--out") + 1]
            assert runs.setdefault(out, words) == words, (page.name, words)
    assert len(runs) > 5


def test_everything_typed_is_known():
    """Else a command of another kind would be looked at by nobody."""
    firsts = {words[0].rpartition("/")[2] for _, words, _ in typed()}
    assert firsts - {*FIRST, *OF_THE_SHELL} == set()


def test_targets_files_and_folders_that_are_typed_exist():
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    for page, words, _ in typed():
        if words[0] == "make":
            called = [word for word in words[1:] if "=" not in word]
            assert set(called) <= set(targets), (page.name, words)
        for word in words[1:]:
            if re.match(r"(scripts|tests)/", word):
                assert (ROOT / word).exists(), (page.name, words)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_scripts_say_what_they_do(path):
    """And take the options that pages give them."""
    reads = re.search(r"import argparse|command_line|folder_of_pictures|studies.publish|tca_mj.cli",
                      path.read_text("utf-8"))  # fmt: skip
    assert reads, f"{path.name} would not stop at --help, but begin"
    said = help_of(path)
    assert said.startswith("usage:")
    given = {
        word.partition("=")[0]
        for _, words, _ in typed() if f"scripts/{path.name}" in words
        for word in words if word.startswith("--")
    }  # fmt: skip
    assert {option for option in given if option not in said} == set()


def test_a_wrong_command_is_found():
    for line in (
        "tca-mj trian TCA/TetrapodWalk-v0", "tca-mj train TCA/TetrapodWalk-v0 --stps 3",
        "tca-mj eval nobody-was-here --task TCA/BendReach-v0",
        "tca-mj demo pick-and-place --option objct=pcb > said.txt",
    ):  # fmt: skip
        (words,) = commands(line)
        assert refused(ROOT / "README.md", words), line
    for line in ("tca-mj trian", "tca-mj train TASK --stps N"):
        assert mentioned(line.split()), line

"""What the package promises is what it promised, or somebody has said that it changed."""

import difflib
import subprocess
import sys

from test_docs import ROOT

FILE = ROOT / "tests" / "public_names.txt"
COMMAND = [sys.executable, str(ROOT / "scripts" / "public_names.py"), "--print"]


def test_public_names_and_their_calls_are_those_of_the_file():
    """After a change on purpose: python scripts/public_names.py, and a line in CHANGELOG.md."""
    done = subprocess.run(COMMAND, capture_output=True, text=True, timeout=120, check=True)
    kept, found = FILE.read_text(encoding="utf-8").splitlines(), done.stdout.splitlines()
    assert len(found) > 1000
    changes = difflib.unified_diff(kept, found, "promised", "found", n=0, lineterm="")
    assert list(changes) == []


def test_the_file_tells_of_a_default_a_method_and_an_episode():
    lines = FILE.read_text(encoding="utf-8").splitlines()
    assert "task TCA/MorphModule-v0 800" in lines
    assert "tca_mj.model.at_rest is tca_mj.model.at_rest" not in lines
    film = "tca_mj.record.Film(simulation, path, *, fps=30.0"
    assert any(line.startswith(film) for line in lines)
    assert "tca_mj.record.Film.close()" in lines

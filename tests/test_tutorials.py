"""The tutorials: walked through whole, as pages and as notebooks, and what they say they print."""

import re
import subprocess
import sys

import pytest
from test_docs import ROOT

from tca_mj.record.render import RenderingUnavailable, gl_backend

sys.path.insert(0, str(ROOT / "scripts"))
import tutorials  # noqa: E402

# What takes longer than seconds, and how it is made quick; nothing is compared then.
QUICK = {
    "robot": ["(50.0, 80.0, 110.0, 130.0)=(110.0,)", "range(80)=range(40)", "--nodes 16=--nodes 6"],
    "train": [
        "--steps 4000=--steps 120", "in 15000 20000 25000 30000;=in 200;",
        "in off random scripted;=in off;", "in reach scripted;=in reach;",
        "--episodes 20=--episodes 1", "not done:=steps < 9:",
        "--seed 1001 --out demo > demo.txt=--no-video --seed 1001 --out demo > demo.txt || true",
        "ls demo=ls demo/rollout.rrd",
    ],
}
DRAWN = ("robot", "train")  # by OpenGL
LONG = pytest.mark.long
WRITTEN = [name for name in tutorials.NAMES if tutorials.page_of(name).exists()]


def walked(name, *more):
    """A walk in a process of its own, as it is typed."""
    pytest.importorskip("matplotlib")
    if name == "train":
        pytest.importorskip("stable_baselines3")
    if name in DRAWN:
        pytest.importorskip("imageio_ffmpeg")
        try:
            gl_backend()
        except RenderingUnavailable as error:
            pytest.skip(str(error))
    command = [sys.executable, str(ROOT / "scripts" / "tutorials.py"), name, *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", WRITTEN)
def test_a_tutorial_can_be_walked(name):
    """In seconds; where the page takes longer, with smaller numbers."""
    walked(name, *(f"--instead={each}" for each in QUICK.get(name, [])))


@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG) for name in QUICK])
def test_a_tutorial_prints_what_it_says(name):
    """Those that are walked with smaller numbers above."""
    walked(name)


def test_a_page_that_says_something_else_is_found(tmp_path, monkeypatch):
    page = tmp_path / "tutorial-physics.md"
    monkeypatch.setattr(tutorials, "DOCS", tmp_path)
    said = "```python\nx = 2.5\nprint('found', x)\n```\n\n```text{kind}\n{text}\n```\n"
    for kind, text, wrong in (
        ("", "found 2.5", 0), ("", "found 2.52", 0), ("", "found 3.0", 1), ("", "lost 2.5", 1),
        (" varies", "found 9.0", 0), (" varies", "lost 9.0", 1),
    ):  # fmt: skip
        page.write_text(said.format(kind=kind, text=text), encoding="utf-8")
        assert len(tutorials.run("physics", instead={}, write=False)) == wrong, (kind, text)
    page.write_text("![nothing](pictures/tutorial_physics.png)\n", encoding="utf-8")
    assert tutorials.run("physics", instead={}, write=False) == [
        "tutorial_physics.png was not drawn"
    ]
    page.write_text("```sh\nfalse | true\n```\n", encoding="utf-8")
    with pytest.raises(RuntimeError, match="false | true\nended with 1"):
        tutorials.run("physics", instead={}, write=False)


@pytest.mark.parametrize("name", WRITTEN)
def test_a_notebook_has_what_its_page_has(name):
    nbformat = pytest.importorskip("nbformat")
    from notebooks import code_of, notebook

    made, page = notebook(name), tutorials.page_of(name).read_text(encoding="utf-8")
    nbformat.validate(made)
    pieces = [block for block in tutorials.blocks(page) if block.kind in ("python", "file", "sh")]
    code = [cell for cell in made.cells if cell.cell_type == "code"]
    assert [cell.source for cell in code] == [code_of(block) for block in pieces]
    assert pieces == sorted(pieces, key=lambda block: block.line) and len(pieces) >= 4
    said = [text for text in re.findall(r"^```text[^\n]*\n(.*?)^```", page, re.M | re.S)]
    assert [cell.outputs[0].text for cell in code if cell.outputs] == said
    shown = page.count("](pictures/")
    assert sum(len(cell.get("attachments", {})) for cell in made.cells) == shown >= 1
    assert not re.search(r"\]\((?!https?:|attachment:|\.\./[\w-]+\.html)", str(made.cells))


def test_a_notebook_runs(tmp_path, monkeypatch):
    """The tutorial of physics, whole, in a kernel; its cells print what the page says."""
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    from notebooks import notebook

    for place in ("IPYTHONDIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR"):
        monkeypatch.setenv(place, str(tmp_path / "jupyter"))
    monkeypatch.delenv("MPLBACKEND", raising=False)  # pictures are shown below their cells
    monkeypatch.setenv("PATH", str(sys.executable).rpartition("/")[0], prepend=":")
    made = notebook("physics")
    expected = {cell.id: cell.outputs[0].text for cell in made.cells if cell.get("outputs")}
    work = tmp_path / "work"
    work.mkdir()
    nbclient.NotebookClient(made, timeout=300, resources={"metadata": {"path": work}}).execute()
    for cell in made.cells:
        if cell.cell_type == "code" and cell.id in expected:
            said = "".join(out.text for out in cell.outputs if out.get("name") == "stdout")
            tidy = "\n".join(line.rstrip() for line in said.splitlines()) + "\n"
            assert tutorials.agrees(tidy, expected[cell.id], False), (expected[cell.id], tidy)
    assert (work / "tutorial_physics.png").stat().st_size > 5000
    drawn = [out for cell in made.cells for out in cell.get("outputs", []) if "data" in out]
    assert [out for out in drawn if "image/png" in out.data]

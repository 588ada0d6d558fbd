"""The site: it is whole, asks no other host, and says what the code says; no page is too long."""

import re
import subprocess
import sys
from dataclasses import fields
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import gymnasium as gym
import pytest
from test_docs import FENCE, PAGES, ROOT
from test_names import packages

import tca_mj
from tca_mj.cli import _parser
from tca_mj.registry import TASKS

SCRIPTS = ROOT / "scripts"
LONGEST = 2500  # words of prose on a page


class Html(HTMLParser):
    """What of a page is tested."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.language: str | None = None
        self.levels: list[int] = []
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.silent: list[str] = []
        self.text = path.read_text(encoding="utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        has = dict(attrs)
        if tag == "html":
            self.language = has.get("lang")
        if re.fullmatch("h[1-6]", tag):
            self.levels.append(int(tag[1]))
        self.ids |= {has["id"]} if has.get("id") else set()
        if tag == "a" and has.get("href"):
            self.links.append(has["href"])
        if tag == "link" and has.get("rel") not in ("index", "search", "next", "prev", "canonical"):
            self.fetched.append(has["href"])
        self.fetched += [has[key] for key in ("src", "srcset", "poster", "data") if has.get(key)]
        if tag == "img" and not (has.get("alt") or "").strip():
            self.silent.append(has.get("src") or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built once, as ``make docs`` does."""
    for name in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(name)
    out = tmp_path_factory.mktemp("site") / "html"
    command = [sys.executable, str(SCRIPTS / "build_site.py"), str(out)]
    made = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert made.returncode == 0, made.stderr
    return {path.relative_to(out).as_posix(): Html(path) for path in out.rglob("*.html")}, out


def test_the_site_asks_no_other_host(site):
    html, out = site
    for name, page in html.items():
        assert [each for each in page.fetched if re.match(r"(\w+:)?//", each)] == [], name
    for style in out.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        assert re.findall(r"(?:url\(|@import )['\"]?(?:https?:)?//[^'\")]+", text) == [], style


def test_links_of_the_site_lead_to_pages_and_their_sections(site):
    html, out = site
    lost = []
    for name, page in html.items():
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                continue
            path, _, section = unquote(link).partition("#")
            target = (out / name).parent / path if path else out / name
            there = target.resolve().relative_to(out.resolve()).as_posix()
            if not target.is_file() or (section and section not in html[there].ids):
                lost.append(f"{name}: {link}")
    assert lost == []


def test_pages_of_the_site_are_called_by_their_titles(site):
    """Not by the files of the checkout, which a reader of the site has not."""
    for name, page in site[0].items():
        assert re.findall(r">[\w/-]+\.md(?:</span>)?</a>", page.text) == [], name
    text = site[0]["tutorial-muscle.html"].text
    for title in ("How sure a fit is", "What to measure first"):  # a page, a section of one
        assert re.search(rf"<a [^>]*>(<span [^>]*>)?{title}(</span>)?</a>", text), title


def test_pages_of_the_site_can_be_heard(site):
    """A language, one title, headings that leave out no level, words for every picture; what
    scrolls can be reached without a mouse."""
    for name, page in site[0].items():
        assert page.language == "en", name
        assert page.silent == [], name
        assert page.levels.count(1) == 1 and page.levels[0] == 1, name
        assert re.findall(r'<pre>|role="heading">|<div class="table-wrapper', page.text) == [], name
        steps = zip(page.levels, page.levels[1:], strict=False)
        assert all(after <= before + 1 for before, after in steps), name


def test_the_site_has_what_the_code_says(site):
    html, out = site
    for task in TASKS:
        text = html[f"{task.id.partition('/')[2]}.html"].text
        env = gym.make(task.id, disable_env_checker=True).unwrapped
        rows = [*env.observation.entries, *env.action.entries, *env.options.rows]
        assert [row.name for row in rows if row.name not in text] == []
        assert [term for term in env.terms if f">{term}<" not in text] == [], task.id
    for spec in (tca_mj.BendingSpec, tca_mj.TetrapodSpec, tca_mj.GripperSpec):
        text = html[f"{spec.__name__}.html"].text
        assert [each.name for each in fields(spec) if f">{each.name}<" not in text] == []
    text = html["commands.html"].text
    (commands,) = (each for each in _parser()._actions if each.dest == "==SUPPRESS==")
    for name, command in commands.choices.items():
        options = {each for action in command._actions for each in action.option_strings}
        assert f">{name}<" in text
        assert {each for each in options if each not in text} <= {"-h", "--help"}, name
    for package, module in packages().items():
        if package not in ("tca_mj.cli", "tca_mj.assets"):
            ids = html[f"api/{package}.html"]
            assert [name for name in module.__all__ if f">{name}<" not in ids.text] == [], package
    assert "hysteresi" in (out / "searchindex.js").read_text("utf-8")


def test_tutorials_of_the_site_are_notebooks_too(site):
    html, out = site
    pages = sorted(name for name in html if name.startswith("tutorial-"))
    made = sorted(path.name for path in (out / "notebooks").iterdir())
    assert made == [name.replace(".html", ".ipynb") for name in pages] != []
    for name, page in zip(made, pages, strict=True):
        assert f"notebooks/{name}" in html[page].links


def test_pictures_of_the_site_are_there_and_tasks_move(site):
    html, out = site
    for name, page in html.items():
        pictures = [path for path in page.fetched if not re.match(r"data:", path)]
        lost = [p for p in pictures if not ((out / name).parent / p.partition("?")[0]).is_file()]
        assert lost == [], name
    films = {path.stem.removeprefix("film_") for path in (out / "pictures").glob("film_*.webp")}
    assert films <= {task.id.partition("/")[2].partition("-")[0] for task in TASKS} and films
    assert all(f"pictures/film_{name}.webp" in html[f"{name}-v0.html"].text for name in films)


def test_a_link_to_nowhere_ends_the_building(tmp_path):
    pytest.importorskip("furo")
    (tmp_path / "index.md").write_text("# Start\n\n[there](#start), [nowhere](#end)\n")
    code = (
        f"import sys; sys.path.insert(0, {str(SCRIPTS)!r}); from build_site import build;"
        "from pathlib import Path; sys.exit(build(Path('.'), Path('html')))"
    )
    command = [sys.executable, "-c", code]
    made = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert made.returncode == 1 and "'end'" in made.stderr and "'start'" not in made.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_page_is_too_long(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    text = re.sub(r"^\s*\|.*$", "", text, flags=re.MULTILINE)
    words = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    assert len(re.findall(r"\w[\w'’.-]*", words)) <= LONGEST

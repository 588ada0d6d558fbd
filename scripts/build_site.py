"""Builds the site: every page of the project and a reference written from the code, as HTML.

    python scripts/build_site.py             into build/site; open build/site/index.html
    python scripts/build_site.py FOLDER      elsewhere

The tutorials are notebooks besides, in ``notebooks``. A link that leads nowhere, also to a section,
a page that is in no list, or a warning of any other kind ends it with code 1. Nothing on the site
asks another host for anything.
"""

import os
import re
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path

from notebooks import write_notebook

from tca_mj.files import write_whole
from tca_mj.pages import command_line

ROOT = Path(__file__).resolve().parent.parent
FENCE = re.compile(r"(^```.*?^```\n)", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(\]\()([^)#:\s]+)(#[^)\s]*)?(?=\))")
NAMED = re.compile(r"\[[\w/-]+\.md(?=\]\(([^)#:\s]+\.md)(?:#([^)\s]*))?\))")  # by its file's name
OUTSIDE = {"README.md": "overview", "CONTRIBUTING.md": "contributing", "CHANGELOG.md": "changelog"}
SETTINGS = {
    "project": "tca-mj", "html_title": "tca-mj", "language": "en", "extensions": ["myst_parser"],
    "root_doc": "index", "myst_heading_anchors": 4, "smartquotes": False,
    "html_theme": "furo", "html_copy_source": False, "html_show_sphinx": False,
    "html_show_copyright": False, "html_use_index": False, "html_extra_path": ["replays"],
    "html_static_path": [str(ROOT / "scripts" / "site.css")], "html_css_files": ["site.css"],
    "html_show_search_summary": False,  # it would fetch the pages, which no browser does from files
}  # fmt: skip
# What is replayed, by page: title, task, policy, what is left out and shown [s], and speed.
REPLAYS = {
    "replay-arm": ("Pick and place", "TCA/ArmPickPlace-v0", "scripted", 0.0, 90.0, 4.0),
    "replay-crawl": ("Crawling", "TCA/TetrapodCrawl-v0", "tetrapod-crawl-sac", 12.0, 24.0, 4.0),
    "replay-walk": ("Walking", "TCA/TetrapodWalk-v0", "tetrapod-walk-sac", 12.0, 24.0, 4.0),
    "replay-shimmy": ("Shimmying", "TCA/TetrapodShimmy-v0", "tetrapod-shimmy", 12.0, 24.0, 4.0),
    "replay-jump": ("Jumping", "TCA/Jump-v0", "scripted", 0.06, 0.3, 0.05),
}  # fmt: skip
# What the theme leaves out for those who listen to a page or have no mouse.
HEARD = {
    'class="caption" role="heading"': 'class="caption" role="heading" aria-level="2"',
    '<aside class="sidebar-drawer"': '<aside aria-label="All pages" class="sidebar-drawer"',
    '<aside class="toc-drawer': '<aside aria-label="This page" class="toc-drawer',
    '<div id="search-results">': '<h1>Search</h1>\n<div id="search-results">',
    '<div class="table-wrapper': '<div tabindex="0" class="table-wrapper',
    "<pre>": '<pre tabindex="0">',
    '<th class="head"><p></p></th>': '<td class="head"></td>',
}


def place(path: str) -> str:
    """Where a file of the project lies among the pages of the site."""
    if path in OUTSIDE:
        return f"{OUTSIDE[path]}.md"
    return "index.md" if path == "docs/README.md" else path.removeprefix("docs/")


def gather(path: str, pages: Path) -> str:
    """A page of the project as one of the site: its links are moved, what they lead to is copied.

    Args:
        path: The page, from the root of the project.
        pages: Folder of the pages of the site.
    """

    def moved(link: re.Match[str]) -> str:
        target = os.path.normpath(Path(path).parent / link[2])
        there = pages / place(target)
        if not target.endswith(".md") and (ROOT / target).is_file():
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / target, there)
        near = os.path.relpath(place(target), Path(place(path)).parent)
        return f"{link[1]}{near}{link[3] or ''}"

    def called(link: re.Match[str]) -> str:
        return f"[{heading(os.path.normpath(Path(path).parent / link[1]), link[2])}"

    parts = FENCE.split((ROOT / path).read_text(encoding="utf-8"))
    return "".join(
        part if i % 2 else LINK.sub(moved, NAMED.sub(called, part)) for i, part in enumerate(parts)
    )


def heading(path: str, section: str | None) -> str:
    """What a page, or a section of it, is called.

    Args:
        path: The page, from the root of the project.
        section: What a link to it has behind the ``#``; None for the page.
    """
    text = FENCE.sub("", (ROOT / path).read_text(encoding="utf-8"))
    for title in re.findall(r"^#+ +(.+?) *$", text, re.MULTILINE):
        if section in (None, re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")):
            return str(title)
    return path  # the building ends there: the link leads nowhere


def toctree(names: Iterable[str], caption: str = "") -> str:
    """What Sphinx makes the navigation of."""
    head = f":caption: {caption}\n" if caption else ""
    return "```{toctree}\n:hidden:\n:titlesonly:\n" + head + "\n" + "\n".join(names) + "\n```"


def navigation(index: str) -> str:
    """The start page with what Sphinx makes the navigation of: its lists of pages, by heading."""
    lists = []
    for title, body in re.findall(r"^### (.+)\n((?:(?!#).*\n)*)", index, re.MULTILINE):
        names = re.findall(r"^\| \[.*?\]\(([\w-]+)\.md\)", body, re.MULTILINE)
        lists.append(toctree(names, title))
    generated = ["replays", "all-tasks", "all-robots", "commands", "all-names"]
    lists.append(toctree(generated, "Reference"))
    watched = "**[Watch them](replays.md)** in this browser, from all sides.\n\n## "
    index = index.replace("## ", watched, 1)
    return "\n\n".join([index, *lists, toctree([*OUTSIDE.values()], "Project"), ""])


def with_notebook(path: str, text: str) -> str:
    """A tutorial's page with where its notebook lies, below the title; others as they are."""
    found = re.fullmatch(r"docs/(tutorial-\w+)\.md", path)
    if not found:
        return text
    link = f'<a href="notebooks/{found[1]}.ipynb" download>This page as a notebook</a>'
    title, _, rest = text.partition("\n")
    return f"{title}\n\n{link}\n{rest}"


def write_pages(pages: Path) -> None:
    """Writes all pages of the site as Markdown into an empty folder."""
    from reference_pages import reference  # slow: it loads all of the package

    for path in [*OUTSIDE, *sorted(f"docs/{page.name}" for page in (ROOT / "docs").glob("*.md"))]:
        text = with_notebook(path, gather(path, pages))
        text = navigation(text) if place(path) == "index.md" else text
        write_whole(pages / place(path), text.encode())
    for path, (text, below) in reference().items():
        listed = toctree([name.removesuffix(".md") for name in below]) if below else ""
        write_whole(pages / path, f"{text}\n\n{listed}\n".encode())
    shutil.copytree(ROOT / "docs" / "pictures", pages / "pictures", dirs_exist_ok=True)
    write_replays(pages)


def replay(path: Path, task: str, policy: str, warm: float, shown: float, speed: float) -> None:
    """Writes a page that replays an episode.

    Args:
        path: The page.
        task: Gymnasium id.
        policy: Who acts.
        warm: Time that is not shown, until the gait is steady [s].
        shown: Time that is [s].
        speed: Simulated seconds per second.
    """
    from tca_mj.agents.policies import actor, arguments_of
    from tca_mj.record import WebPage
    from tca_mj.registry import make

    env = make(task, disable_env_checker=True, **arguments_of(policy, task))
    acting = actor(policy, env)
    observation, info = env.reset(seed=0)
    title = f"{task}: {policy}"
    sim, interval = env.unwrapped.sim, min(0.2, 0.05 * speed)
    follow = env.unwrapped.headway() is not None
    with WebPage(sim, path, title=title, interval=interval, speed=speed, follow=follow) as page:
        over = False
        while not over and info["time"] < warm + shown:
            observation, _, ended, cut, info = env.step(acting.act(observation))
            over = ended or cut
            if info["time"] >= warm:
                page.frame(acting.phase)


def write_replays(pages: Path) -> None:
    """Writes the page of the replays and what it shows."""
    blocks = [
        "# Replays", "Scripts and gaits that come with the package, simulated when this site was"
        " built. Drag to turn, scroll to come closer. A demo of yours leaves such a page, too:"
        " [recordings](recording.md#in-a-browser).",
    ]  # fmt: skip
    for name, (title, *how) in REPLAYS.items():
        replay(pages / "replays" / f"{name}.html", *how)
        blocks += [f"## {title}", f'<iframe src="{name}.html" title="{title}" loading="lazy"'
                   ' style="width: 100%; aspect-ratio: 4 / 3; min-height: 24rem; border: 0">'
                   "</iframe>"]  # fmt: skip
    write_whole(pages / "replays.md", ("\n\n".join(blocks) + "\n").encode())


def build(pages: Path, out: Path) -> int:
    """Makes HTML of pages, all or nothing; returns the exit code.

    Args:
        pages: Folder of the pages, ``index.md`` among them.
        out: Folder of the site.
    """
    from sphinx.application import Sphinx

    site = Sphinx(pages, None, out, pages / ".built", "html", confoverrides=SETTINGS,
                  freshenv=True, warningiserror=True, status=None)  # fmt: skip
    site.build()
    for page in out.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        for silent, heard in HEARD.items():
            text = text.replace(silent, heard)
        page.write_text(text, encoding="utf-8")
    return site.statuscode


def main() -> int:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "build" / "site")
    out = parser.parse_args().folder.resolve()
    pages = out.with_name(f"{out.name}-pages")
    for folder in (pages, out):
        shutil.rmtree(folder, ignore_errors=True)
    write_pages(pages)
    code = build(pages, out)
    for page in sorted((ROOT / "docs").glob("tutorial-*.md")):
        write_notebook(page.stem.removeprefix("tutorial-"), out / "notebooks")
    (out / "pictures").mkdir(parents=True, exist_ok=True)
    for film in (ROOT / "docs" / "pictures").glob("film_*.webp"):  # Sphinx sees no raw HTML
        shutil.copyfile(film, out / "pictures" / film.name)
    if code == 0:
        print(f"open {out / 'index.html'}")
    return code


if __name__ == "__main__":
    sys.exit(main())

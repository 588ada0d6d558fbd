"""Every table of the pages is held by something: tests/tables.txt says by what.

It lists the pages with the first rows of their tables, in their order; a long row is cut off by an
ellipsis, "3 x" stands for three of the same. Above them stands what holds them:

    marks SCRIPT      a script or command writes them, between marks or from a mark on
    printed NAME      ``scripts/page_tables.py NAME`` compares them with what a script prints
    test FILE::TEST   a test reads them from the page, or makes the same from the code
    command WORDS     the command in the page prints them and takes long, or other packages
    record WORDS      figures of runs that no command repeats; the page says so with these words
    text              no measured figure
    text: REASON      no measured figure, though numbers with decimals or units stand in it
"""

import re
import runpy

import pytest
from test_docs import FENCE, PAGES, ROOT

SCRIPT = runpy.run_path(str(ROOT / "scripts" / "page_tables.py"))
HOLDERS = SCRIPT["holders"]()
MEASURED = re.compile(
    r"\d\.\d|\d ?(?:[%°‰]|(?:mm|m|m/s|mm/s|s|min|ms|µs|K|k?W|V|m?A|m?N|N/m|m?g|kg|k?J|[MG]?Pa|m?ohm"
    r"|k?Hz|kB)\b)"
)


def found_on(text):
    """Tables of a page, in its order: each as text, with the mark above that has no end yet."""
    text = FENCE.sub(lambda match: "\n" * match[0].count("\n"), text)
    tables = []
    for match in SCRIPT["TABLE"].finditer(text):
        marks = re.findall(r"<!-- (.+?) -->", text[: match.start()])
        tables.append((match[0], marks[-1] if marks and marks[-1] != "end" else ""))
    return tables


def fault(page, text, kind, table, mark):
    """Why what is said to hold a table does not; nothing if all is well."""
    how, _, what = kind.partition(" ")
    plain = re.sub(r"\s+", " ", text)
    if how == "marks":
        known = (ROOT / what).is_file() if what.startswith("scripts/") else any(
            f'"{what}"' in path.read_text("utf-8") for path in (ROOT / "scripts").glob("*.py")
        )  # fmt: skip
        if not known or what not in mark:
            return f"no mark of {what}"
        name = page.rpartition("/")[2].removesuffix(".md")
        writes = not what.startswith("scripts/") or name in (ROOT / what).read_text("utf-8")
        return "" if writes else f"{what} does not know this page"
    if mark and how != "printed":
        return f"stands between the marks of {mark}"
    if how == "printed":
        name = page.rpartition("/")[2].removesuffix(".md")
        pages = SCRIPT["ELSEWHERE"].get(what, (what,)) if what in SCRIPT["PRINTED"] else ()
        return "" if name in pages else f"page_tables.py {what} has no such page"
    if how == "test":
        file, _, test = what.partition("::")
        path = ROOT / "tests" / file
        there = path.is_file() and f"def {test}(" in path.read_text("utf-8")
        return "" if there else f"no test {what}"
    if how == "command":
        files = [ROOT / word for word in what.split() if word.startswith(("scripts/", "tests/"))]
        if what not in plain or not all(path.is_file() for path in files):
            return f"the page has no command {what}"
        cells = SCRIPT["first_row"](table).strip("| ").split(" | ")
        if any(path.parent.name == "scripts" and cell not in path.read_text("utf-8")
               for path in files for cell in cells):  # fmt: skip
            return f"{what} prints no such first row"
        return ""
    if how == "record":
        return "" if len(what) > 20 and what in plain else f"the page does not say {what}"
    body = table.partition("\n")[2].partition("\n")[2]
    figure = MEASURED.search(body)
    if how == "text" and figure:
        return f"is no text, it has {figure[0]}"
    if how == "text:" and not figure:
        return "has nothing for which it needs a reason"
    return "" if re.fullmatch(r"text|text: \w.{8,}", kind) else f"nothing is called {kind}"


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_every_table_is_held(page):
    name, text = page.relative_to(ROOT).as_posix(), page.read_text(encoding="utf-8")
    said = [(kind, row) for there, kind, row in HOLDERS if there == name]
    tables = found_on(text)
    lines = re.findall(r"^ *\|.*$", FENCE.sub("", text), re.MULTILINE)
    assert "".join(table for table, _ in tables).splitlines() == lines  # none in another form
    heads = [SCRIPT["first_row"](table) for table, _ in tables]
    # A table that is new, gone or elsewhere is found as the first row that differs.
    for i, head in enumerate(heads):
        assert i < len(said) and SCRIPT["stands_for"](said[i][1], head), f"{name}: {head}"
    assert [row for _, row in said[len(heads) :]] == []
    wrong = [
        f"{head}: {why}"
        for (kind, _), head, (table, mark) in zip(said, heads, tables, strict=True)
        if (why := fault(name, text, kind, table, mark))
    ]
    assert wrong == []


def test_every_page_that_is_listed_exists():
    pages = {page.relative_to(ROOT).as_posix() for page in PAGES}
    assert len(HOLDERS) > 200 and {page for page, _, _ in HOLDERS} <= pages


def test_every_source_of_printed_tables_has_one():
    named = {kind.split()[1] for _, kind, _ in HOLDERS if kind.startswith("printed ")}
    assert named == set(SCRIPT["PRINTED"])


def test_what_contacts_meet_follows_from_their_tables():
    """The largest figures of rows, rounded as there; what was put down and timed is said apart."""
    text = (ROOT / "docs" / "tetrapod.md").read_text(encoding="utf-8")
    tables = {SCRIPT["first_row"](table): table for table, _ in found_on(text)}

    def rows(head):
        (table,) = (table for first, table in tables.items() if first.startswith(head))
        lines = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
        return {first: " ".join(rest) for first, *rest in lines}

    speeds, still, aims = rows("| | crawl, script"), rows("| | crawl | walk"), rows("| aim")

    def most(*names):
        return max(abs(float(x)) for name in names for x in re.findall(r"[-+]?\d+\.\d+", name))

    deepest = most(speeds["deepest contact"], still["deepest under random actions"])
    changed = [row for name, row in speeds.items() if name.endswith("halved and doubled")]
    assert len(changed) == 5 and most(still["slide while standing for 20 s"]) < 0.1
    told = {
        "slide below": f"yes, {deepest:g} mm",
        "half the time": f"yes, {most(speeds['half the time step over task']):g} %",
        "within 5 %": f"yes, {most(speeds['task over hard, 0.5 ms']):g} %",
        "every number": f"yes, {most(*changed):g} %",
    }  # fmt: skip
    for beginning, met in told.items():
        (found,) = (said for aim, said in aims.items() if aim.startswith(beginning))
        assert found.startswith(met), beginning
    (found,) = (said for aim, said in aims.items() if aim.startswith("TCAs handed"))
    assert round(most(found), 1) == most(speeds["task over TCAs in every step"])

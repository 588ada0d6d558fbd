"""Pages that commands write into."""

import pytest

from tca_mj.pages import write_between

PAGE = "# T\n\n<!-- a -->\n\nold\n\n<!-- end -->\n\nkept\n\n<!-- b -->\n\nother\n\n<!-- end -->\n"


def test_a_table_is_written_where_its_mark_stands_and_nowhere_else(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE, encoding="utf-8")
    write_between(page, "b", ["| x |", "|---|"])
    assert page.read_text("utf-8") == PAGE.replace("other", "| x |\n|---|")
    write_between(page, "b", ["other"])
    assert page.read_text("utf-8") == PAGE


@pytest.mark.parametrize("text", ["none", "<!-- a -->\n\nopen", PAGE + PAGE])
def test_a_page_without_one_mark_is_left_as_it_is(tmp_path, text):
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"page.md must have one <!-- a --> that <!-- end --> "):
        write_between(page, "a", ["new"])
    assert page.read_text("utf-8") == text

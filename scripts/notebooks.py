"""The tutorials as notebooks: what stands on a page, in cells, with what it printed.

``scripts/build_site.py`` writes them beside the pages of the site. Links lead to those pages;
pictures are kept in the notebook, so that it can be read anywhere.
"""

import base64
import re
from pathlib import Path

import nbformat
from nbformat import NotebookNode, v4
from tutorials import DOCS, Block, blocks, page_of

PICTURE = re.compile(r"\]\((pictures/[\w.-]+)\)")
PAGE = re.compile(r"(\]\()([\w-]+)\.md(#[^)\s]*)?(?=\))")
KERNEL = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def code_of(block: Block) -> str:
    """What of a block that is run is typed into a cell."""
    magic = {"file": f"%%writefile {block.name}\n", "sh": "%%bash\n", "python": ""}
    return magic[block.kind] + block.text.rstrip("\n")


def prose(text: str) -> NotebookNode:
    """A cell of text; its links lead to the site, its pictures are attached."""
    found = {Path(path).name: DOCS / path for path in PICTURE.findall(text)}
    text = PICTURE.sub(lambda link: f"](attachment:{Path(link[1]).name})", text)
    text = PAGE.sub(lambda link: f"{link[1]}../{link[2]}.html{link[3] or ''}", text)
    text = re.sub(r"\[([^\]]*)\]\(\.\./(?!\w+[\w-]*\.html)[^)]*\)", r"`\1`", text)  # in no site
    cell = v4.new_markdown_cell(text.strip("\n"))
    if found:
        cell["attachments"] = {
            name: {"image/png": base64.b64encode(path.read_bytes()).decode()}
            for name, path in found.items()
        }
    return cell


def notebook(name: str) -> NotebookNode:
    """A tutorial as a notebook, valid by its format.

    Args:
        name: The tutorial, of ``tutorials.NAMES``.

    Raises:
        nbformat.ValidationError: If it is no valid notebook.
    """
    cells: list[NotebookNode] = []
    for i, block in enumerate(blocks(page_of(name).read_text(encoding="utf-8"))):
        if block.kind == "text":
            cell = prose(block.text)
        elif block.kind == "shown":
            language = block.name.partition(" ")[0]
            cell = v4.new_markdown_cell(f"```{language}\n{block.text}```")
        elif block.kind == "said":
            cells[-1]["outputs"] = [v4.new_output("stream", name="stdout", text=block.text)]
            continue
        else:
            cell = v4.new_code_cell(code_of(block))
        cell["id"] = f"{name}-{i}"  # the same each time
        cells.append(cell)
    made = v4.new_notebook(cells=cells, metadata=KERNEL)
    nbformat.validate(made)
    return made


def write_notebook(name: str, folder: Path) -> Path:
    """Writes a tutorial as ``tutorial-NAME.ipynb`` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{page_of(name).stem}.ipynb"
    nbformat.write(notebook(name), path)
    return path

"""Mark the cells of lessons that can be run, and the answers and tests of problem sets."""

import html
import re
import tomllib
from functools import cache
from pathlib import Path

from nbformat import NotebookNode
from nbformat.v4 import new_markdown_cell

from rbclassroom.assignments.locked_cells import grade_id, is_answer, is_test

_IN_PAGES = {  # sentences about Jupyter, and the sentences that replace them
    r"Each answer is followed by a test\. Run the test, and it tells you": "*Check*, below each "
    "answer, tells you",
    r"Save the notebook\. Then run `rbclassroom\.assignments\.check .*": "Press *Check* below each "
    "answer once more. Then download the file, and hand it in where your teacher collects it.",
}


@cache
def left_out() -> dict[str, dict[str, str]]:
    """Return the cells of each lesson that cannot be run in a page, with the reasons."""
    return tomllib.loads(Path(__file__).with_name("left_out.toml").read_text("utf-8"))


def cells_of(notebook: NotebookNode) -> list[dict[str, str]]:
    """Return the code cells of a lesson in order, without explorers, which need Jupyter.

    Code without output is joined with the code that follows it, as in the pages.
    """
    found, last = list[dict[str, str]](), None
    for cell in notebook.cells:
        if cell.cell_type == "code" and not re.search(r"explorers\.\w+_explorer\(", cell.source):
            joins = last is not None and last.cell_type == "code" and not last.outputs
            before = f"{found.pop()['source']}\n\n" if joins else ""
            found.append({"id": cell.id, "source": before + cell.source})
        last = cell
    return found


def mark_lesson(notebook: NotebookNode, name: str) -> None:
    """Mark the cells of a lesson that can be run."""
    can = {each["id"] for each in cells_of(notebook)} - left_out().get(name, {}).keys()
    for cell in notebook.cells:
        if cell.id in can and cell.cell_type == "code":
            cell.metadata.tags = [*cell.metadata.get("tags", []), f"try-{cell.id}"]


def mark_problems(notebook: NotebookNode) -> None:
    """Mark the answers and the tests of a problem set."""
    text = "\n".join(cell.source for cell in notebook.cells)
    if missing := [jupyter for jupyter in _IN_PAGES if not re.search(jupyter, text)]:
        raise ValueError(f"problem set: the sentence {missing[0]!r} is missing")
    for at, cell in enumerate(notebook.cells):
        name = grade_id(cell)
        if is_test(cell):
            cell.metadata.tags = ["test"]
        elif is_answer(cell) and cell.cell_type == "code":
            cell.metadata.tags = [f"answer-{name}"]
        elif cell.cell_type == "markdown" and not is_answer(cell):
            for jupyter, here in _IN_PAGES.items():
                cell.source = re.sub(jupyter, here, cell.source)
        elif is_answer(cell):
            text = html.escape(cell.source)
            notebook.cells[at] = new_markdown_cell(
                f'<div class="answer-in-words" id="{name}">{text}</div>'
            )

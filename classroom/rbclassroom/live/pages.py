"""Mark the cells of lessons that can be run, and the answers and tests of problem sets."""

import html
import re
import tomllib
from pathlib import Path

from nbformat import NotebookNode

from rbclassroom.assignments.locked_cells import grade_id, is_answer, is_test

_REASONS = tomllib.loads(Path(__file__).with_name("left_out.toml").read_text("utf-8"))
LEFT_OUT = {
    lesson: {cell: why for why, cells in reasons.items() for cell in cells}
    for lesson, reasons in _REASONS.items()
}
"""The cells of each lesson that cannot be run in a page, with the reasons."""
_IN_PAGES = {  # sentences about Jupyter, and the sentences that replace them
    r"Each answer is followed by a test\. Run the test, and it tells you": "*Check*, below each "
    "answer, tells you",
    r"Save the notebook\. Then run `python3 course\.py check .*": "Press *Check* below each "
    "answer once more. Then download the file, and hand it in where your teacher collects it.",
}


def mark_lesson(notebook: NotebookNode, name: str) -> None:
    """Mark the cells of a lesson that can be run, without its opening; explorers need Jupyter."""
    for cell in notebook.cells:
        apart = cell.id in {"opening", *LEFT_OUT.get(name, {})} or "_explorer(" in cell.source
        if cell.cell_type == "code" and not apart:
            cell.metadata.tags = [*cell.metadata.get("tags", []), f"try-{cell.id}"]


def mark_problems(notebook: NotebookNode) -> None:
    """Mark the answers and the tests of a problem set."""
    for jupyter, here in _IN_PAGES.items():
        cells = [cell for cell in notebook.cells if re.search(jupyter, cell.source)]
        if not cells:
            raise ValueError(f"problem set: the sentence {jupyter!r} is missing")
        for cell in cells:
            cell.source = re.sub(jupyter, here, cell.source)
    for cell in notebook.cells:
        name = grade_id(cell)
        if is_test(cell):
            cell.metadata.tags = ["test"]
        elif name == "compare-table" or "mine(" in cell.source:
            cell.metadata.tags = [f"try-{name}"]
        elif is_answer(cell) and cell.cell_type == "code":
            cell.metadata.tags = [f"answer-{name}"]
        elif is_answer(cell):
            text = html.escape(cell.source)
            cell.source = f'<div class="answer-in-words" id="{name}">{text}</div>'

"""Tell the cells of a problem set apart by the marks of nbgrader in their metadata.

The module does not import nbgrader, because students do not have it.
"""

import re
from typing import Any

from nbformat import NotebookNode


def marks_of(cell: NotebookNode) -> dict[str, Any]:
    """Return the metadata of nbgrader in a cell."""
    marks = cell.metadata.get("nbgrader")
    return marks if isinstance(marks, dict) else {}


def grade_id(cell: NotebookNode) -> str:
    """Return the name that nbgrader gives to a cell."""
    return str(marks_of(cell).get("grade_id") or "")


def is_answer(cell: NotebookNode) -> bool:
    """Tell whether a cell holds an answer of the student."""
    return bool(marks_of(cell).get("solution"))


def is_test(cell: NotebookNode) -> bool:
    """Tell whether a cell holds tests."""
    return bool(cell.cell_type == "code" and marks_of(cell).get("grade") and not is_answer(cell))


def title_of(cells: list[NotebookNode], at: int) -> str:
    """Return the last heading in or above a cell; headings of the student do not count."""
    given = [c for c in cells[: at + 1] if c.cell_type == "markdown" and not is_answer(c)]
    text = "\n".join(cell.source for cell in given if grade_id(cell))
    return (re.findall(r"^#+\s+(.+?)\s*$", text, re.MULTILINE) or [""])[-1]


def name_cell(cells: list[NotebookNode], at: int) -> str:
    """Describe a cell by its number, kind and title."""
    cell, title = cells[at], title_of(cells, at)
    given = "answer" if is_answer(cell) else "test" if is_test(cell) else "locked cell"
    kind = given if grade_id(cell) else "added cell"
    return f"cell {at + 1}, {kind}" + f" of “{title}”" * bool(title)


def blame(answer: str, wrong: list[str]) -> str:
    """Return a hint if a wrong answer calls a wrong function; add its own functions to `wrong`."""
    called = [name for name in wrong if re.search(rf"\b{name}\(", answer)]
    wrong += re.findall(r"^def (\w+)", answer, re.MULTILINE)
    return f"It calls {called[0]}, which is not right yet." if called else ""
